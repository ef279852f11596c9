/* perp_lcp_verify and perp_lcp_sensitivity: what they claim of a point. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "problem.h"

/* Solves M_AA x_A = right_A in 113 bits, x = 0 elsewhere. Corrected by its own residual: of numbers
 * much smaller than others elimination keeps fewer digits than a radius may have. */
static int solve_block(const lcp_problem *p, const int *active, const wide *right, wide *x)
{
    int32_t n = p->n, i, j, round;
    wide *A = fuzz_take(n * n, sizeof *A), *rest = fuzz_take(n, sizeof *rest);

    for (i = 0; i < n; i++)
        x[i] = 0;
    for (round = 0; round < 12; round++) {
        for (i = 0; i < n; i++) {
            rest[i] = active[i] ? right[i] : 0;
            for (j = 0; j < n; j++) {
                A[i * n + j] = active[i] && active[j] ? (wide)p->M.dense[i * n + j] : i == j;
                rest[i] -= A[i * n + j] * x[j];
            }
        }
        if (!oracle_solve(n, 1, A, rest))
            return 0;
        for (i = 0; i < n; i++)
            x[i] += rest[i];
    }
    return 1;
}

/* error := |A^-1| (|A||x| + |right|) 2^-104: how far 113 bits may be off, far beyond a condition of
 * 2^53 between rows and columns of very different units. x is 0 where not active. */
static void find_error(const lcp_problem *p, const int *active, const wide *right, const wide *x,
                       wide *error)
{
    int32_t n = p->n, i, j;
    wide *A = fuzz_take(n * n, sizeof *A), *inverse = fuzz_take(n * n, sizeof *inverse);
    wide *size = fuzz_take(n, sizeof *size);

    for (i = 0; i < n; i++)
        for (size[i] = active[i] ? oracle_abs(right[i]) : 0, error[i] = 0, j = 0; j < n; j++) {
            A[i * n + j] = active[i] && active[j] ? (wide)p->M.dense[i * n + j] : i == j;
            inverse[i * n + j] = i == j;
            size[i] += oracle_abs(A[i * n + j] * x[j]);
        }
    oracle_solve(n, n, A, inverse);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            error[i] += oracle_abs(inverse[i * n + j]) * size[j] * (wide)0x1p-104;
}

/* Whether the index set `places` has a solution; x is what its equations give, but for `error`. */
static int solution_at(const lcp_problem *p, const int32_t *places, wide *x, wide *error)
{
    int32_t n = p->n, i;
    wide *w = fuzz_take(n, sizeof *w), *t = fuzz_take(n, sizeof *t);
    wide *at = fuzz_take(n, sizeof *at), *doubt = fuzz_take(n, sizeof *doubt),
         *M = oracle_wide(n * n, p->M.dense);
    wide *q = oracle_wide(n, p->q);
    int *active = fuzz_take(n, sizeof *active);

    for (i = 0; i < n; i++) {
        active[i] = places[i] == PERP_PLACE_BETWEEN;
        at[i] = active[i] ? 0 : places[i] == PERP_PLACE_LOWER ? p->lower[i] : p->upper[i];
        if (isinf((double)at[i]))
            return 0;
    }
    oracle_multiply(n, n, M, at, q, w, t);
    for (i = 0; i < n; i++)
        t[i] = -w[i];
    if (!solve_block(p, active, t, x))
        return 0;
    find_error(p, active, t, x, error);
    for (i = 0; i < n; i++)
        x[i] += at[i];
    oracle_multiply(n, n, M, x, q, w, t);
    oracle_multiply(n, n, M, error, NULL, t, doubt);
    for (i = 0; i < n; i++)
        if (active[i] ? x[i] < p->lower[i] - error[i] || x[i] > p->upper[i] + error[i]
                      : p->lower[i] < p->upper[i] &&
                            (places[i] == PERP_PLACE_LOWER ? w[i] < -doubt[i] : w[i] > doubt[i]))
            return 0;
    return 1;
}

/* 2^-60 of the radius: the reference has 113 bits, and the block a condition below 2^53. */
static int is_within(const lcp_problem *p, const wide *x, const wide *error, const double *z,
                     const double *radii)
{
    int32_t i;

    for (i = 0; i < p->n; i++)
        if (!(oracle_abs(x[i] - z[i]) <=
              radii[i] * (1 + (wide)0x1p-60) + oracle_abs(x[i]) * 0x1p-60 + error[i]))
            return 0;
    return 1;
}

/* Which index set z shows depends on the units of z and w: all of them are tried. */
static void check_radii(const lcp_problem *p, const double *z, const double *radii)
{
    int32_t *places = fuzz_take(p->n, sizeof *places), i, count = 1, k;
    wide *x = fuzz_take(p->n, sizeof *x), *error = fuzz_take(p->n, sizeof *error);
    int mark = fuzz_mark(), found = 0;

    for (i = 0; i < p->n; i++)
        count *= 3;
    for (k = 0; k < count && !found; k++) {
        int32_t rest = k;

        for (i = 0; i < p->n; i++, rest /= 3)
            places[i] = rest % 3;
        found = solution_at(p, places, x, error) && is_within(p, x, error, z, radii);
        fuzz_drop_to(mark);
    }
    if (!found)
        fuzz_fail("verify: 'regular', but no solution is within radii[0] = %g of z",
                  p->n > 0 ? radii[0] : 0);
}

/* z - w tells the index set where units play no part: at integers, without ties. */
static void check_denial(const lcp_problem *p, const double *z)
{
    wide *w = fuzz_take(p->n, sizeof *w), *t = fuzz_take(p->n, sizeof *t);
    wide *x = fuzz_take(p->n, sizeof *x), *error = fuzz_take(p->n, sizeof *error);
    int32_t *places = fuzz_take(p->n, sizeof *places), i;

    lcp_problem_rows(p, z, w, t);
    for (i = 0; i < p->n; i++) {
        places[i] = z[i] > w[i] ? PERP_PLACE_BETWEEN : PERP_PLACE_LOWER; /* w < 0 at z = 0 too */
        if ((z[i] > 0 && w[i] > 0) || (z[i] < 0 && w[i] < 0) || (z[i] == 0 && w[i] == 0))
            return;
    }
    if (solution_at(p, places, x, error))
        fuzz_fail("verify: 'not a solution' of an index set that has one");
}

static void verify(perp_context *context, const lcp_problem *p, const double *z)
{
    double *radii = fuzz_doubles(p->n);
    perp_lcp_proof *proof = fuzz_take(1, sizeof *proof);
    const void *const outputs[] = {radii, NULL};

    if (perp_lcp_proof_init(proof, sizeof *proof) != PERP_OK)
        fuzz_fail("perp_lcp_proof_init takes its own size");
    if (!fuzz_status_of(context,
                        perp_lcp_verify(context, radii, proof, &p->M.view, p->q, p->lower_given,
                                        p->upper_given, z),
                        "perp_lcp_verify", outputs))
        return;
    fuzz_show("radii", radii, p->n);
    if (proof->verdict == PERP_VERDICT_REGULAR && p->n <= 4)
        check_radii(p, z, radii);
    if (proof->verdict == PERP_VERDICT_NOT_A_SOLUTION && p->integer)
        check_denial(p, z);
}

/* Numbers of 1e300 may have an infinite product, but never NaN. */
static void check_finite(const lcp_problem *p, double *const *x, int32_t vectors)
{
    int32_t k, i;

    for (k = 0; k < vectors; k++)
        for (i = 0; i < p->n; i++)
            if (isnan(x[k][i]) || (p->mood <= FUZZ_MODERATE && isinf(x[k][i])))
                fuzz_fail("a product of the sensitivity is finite: [%d] = %g", i, x[k][i]);
}

/* g'dz = p'dq + l'dlower + u'dupper for dM = 0: both sides come from the same block. 1e-4: it is
 * asked for only where the condition is below 1e8, and of what is small beside the largest entry of
 * its vector a factorisation promises nothing. */
static void check_products(fuzz_bytes *bytes, perp_context *context, const lcp_problem *p,
                           perp_lcp_sensitivity *sensitivity, const perp_lcp_sensitivity_info *info)
{
    enum { DQ, DLOWER, DUPPER, G, DZ, P, LOWER, UPPER, VECTORS };
    double *x[VECTORS], largest[VECTORS] = {0}, left = 0, right = 0, size;
    int32_t n = p->n, i;

    for (i = 0; i < VECTORS; i++)
        x[i] = fuzz_doubles(n);
    for (i = DQ; i <= G; i++)
        fuzz_numbers(bytes, p->mood, x[i], n);
    if (!fuzz_status(
            context,
            perp_lcp_sensitivity_forward(sensitivity, x[DZ], x[DQ], NULL, x[DLOWER], x[DUPPER]),
            "forward") ||
        !fuzz_status(context,
                     perp_lcp_sensitivity_adjoint(sensitivity, x[P], x[LOWER], x[UPPER], x[G]),
                     "adjoint"))
        return;
    check_finite(p, &x[DZ], UPPER - DZ + 1);
    for (i = 0; i < n; i++) {
        left += x[G][i] * x[DZ][i];
        right += x[P][i] * x[DQ][i] + x[LOWER][i] * x[DLOWER][i] + x[UPPER][i] * x[DUPPER][i];
        for (int32_t k = 0; k < VECTORS; k++)
            largest[k] = fmax(largest[k], fabs(x[k][i]));
    }
    size = n * (largest[G] * largest[DZ] + largest[P] * largest[DQ] +
                largest[LOWER] * largest[DLOWER] + largest[UPPER] * largest[DUPPER]);
    if (p->mood <= FUZZ_MODERATE && info->condition < 1e8 && fabs(left - right) > 1e-4 * size)
        fuzz_fail("sensitivity: g'dz = %g, p'dq + ... = %g", left, right);
}

static void differentiate(fuzz_bytes *bytes, perp_context *context, const lcp_problem *p,
                          const perp_lcp_settings *settings, const double *z)
{
    perp_lcp_sensitivity *sensitivity = NULL;
    perp_lcp_sensitivity_info info;
    int32_t *places = fuzz_take(p->n, sizeof *places), i;

    if (perp_lcp_sensitivity_info_init(&info, sizeof info) != PERP_OK)
        fuzz_fail("perp_lcp_sensitivity_info_init takes its own size");
    if (!fuzz_status(context,
                     perp_lcp_sensitivity_create(context, &sensitivity, &info, settings, &p->M.view,
                                                 p->q, p->lower_given, p->upper_given, z),
                     "perp_lcp_sensitivity_create"))
        return;
    if (fuzz_status(context, perp_lcp_sensitivity_places(sensitivity, places), "places"))
        for (i = 0; i < p->n; i++)
            if (places[i] < PERP_PLACE_LOWER || places[i] > PERP_PLACE_FIXED)
                fuzz_fail("sensitivity: place %d of row %d", places[i], i);
    check_products(bytes, context, p, sensitivity, &info);
    perp_lcp_sensitivity_destroy(sensitivity);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_bytes bytes = {data, data + size};
    perp_context *context = fuzz_open(&bytes, 1);
    perp_lcp_settings settings;
    perp_lcp_result result;
    lcp_problem problem;
    double *z;

    lcp_settings_make(&bytes, &settings);
    lcp_problem_make(&bytes, &problem, 0, 8);
    z = fuzz_doubles(problem.n);
    fuzz_numbers(&bytes, problem.mood, z, problem.n);
    if (perp_lcp_result_init(&result, sizeof result) != PERP_OK)
        fuzz_fail("perp_lcp_result_init takes its own size");
    if (!fuzz_one_in(&bytes, 4)) /* mostly a solution, if the solver has one */
        fuzz_status(context,
                    perp_lcp_solve(context, z, NULL, NULL, &result, &settings, &problem.M.view,
                                   problem.q, problem.lower_given, problem.upper_given, NULL),
                    "perp_lcp_solve");
    fuzz_show("z", z, problem.n);
    verify(context, &problem, z);
    differentiate(&bytes, context, &problem, &settings, z);
    fuzz_close(context);
    return 0;
}
