/* perp_lcp_verify and perp_lcp_sensitivity: what they claim of a point. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "problem.h"

/* Which index set z shows depends on the units of z and w: all of them are tried. */
static void check_radii(const lcp_problem *p, const double *z, const double *radii)
{
    const oracle_set set = {p->n, p->M.dense, p->q, p->lower, p->upper, z, radii};
    int32_t *places = fuzz_take(p->n, sizeof *places), i, count = 1, k;
    int found = 0;

    for (i = 0; i < p->n; i++)
        count *= 3;
    for (k = 0; k < count && !found; k++) {
        int32_t rest = k;

        for (i = 0; i < p->n; i++, rest /= 3)
            places[i] = rest % 3;
        found = oracle_solves(&set, places);
    }
    if (!found)
        fuzz_fail("verify: 'regular', but no solution is within radii[0] = %g of z",
                  p->n > 0 ? radii[0] : 0);
}

/* z - w tells the index set where units play no part: at integers, without ties. */
static void check_denial(const lcp_problem *p, const double *z)
{
    const oracle_set set = {p->n, p->M.dense, p->q, p->lower, p->upper, z, NULL};
    wide *w = fuzz_take(p->n, sizeof *w), *t = fuzz_take(p->n, sizeof *t);
    int32_t *places = fuzz_take(p->n, sizeof *places), i;

    lcp_problem_rows(p, z, w, t);
    for (i = 0; i < p->n; i++) {
        places[i] = z[i] > w[i] ? PERP_PLACE_BETWEEN : PERP_PLACE_LOWER; /* w < 0 at z = 0 too */
        if ((z[i] > 0 && w[i] > 0) || (z[i] < 0 && w[i] < 0) || (z[i] == 0 && w[i] == 0))
            return;
    }
    if (oracle_solves(&set, places))
        fuzz_fail("verify: 'not a solution' of an index set that has one");
}

static void verify(perp_context *context, const lcp_problem *p, const double *z)
{
    double *radii = fuzz_doubles(p->n);
    perp_lcp_proof *proof = fuzz_take(1, sizeof *proof);
    const void *const outputs[] = {radii, NULL};

    if (perp_struct_init(proof, sizeof *proof) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    if (!fuzz_status_of(context,
                        perp_lcp_verify(context, radii, proof,
                                        LCP(&p->M.view, p->q, p->lower_given, p->upper_given), z),
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

    if (perp_struct_init(&info, sizeof info) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    if (!fuzz_status(
            context,
            perp_lcp_sensitivity_create(context, &sensitivity, &info, settings,
                                        LCP(&p->M.view, p->q, p->lower_given, p->upper_given), z),
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
    if (perp_struct_init(&result, sizeof result) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    if (!fuzz_one_in(&bytes, 4)) /* mostly a solution, if the solver has one */
        fuzz_status(context,
                    perp_lcp_solve(
                        context, z, NULL, NULL, &result, &settings,
                        LCP(&problem.M.view, problem.q, problem.lower_given, problem.upper_given),
                        NULL),
                    "perp_lcp_solve");
    fuzz_show("z", z, problem.n);
    verify(context, &problem, z);
    differentiate(&bytes, context, &problem, &settings, z);
    fuzz_close(context);
    return 0;
}
