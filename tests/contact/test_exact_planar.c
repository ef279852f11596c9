/* Planar contacts in integers: every solution by trying all modes in exact arithmetic, and what the
 * methods say beside it. W is positive definite, so there always is a solution, and with these mu
 * there often are several. */
#include "suite.h"

#include <math.h>
#include <string.h>

#include <perp/perp.h>

#include "gen.h"
#include "rational.h"

enum { MOST = 3, ROWS = 2 * MOST, MODES = 4, SEPARATE = 0, STICK = 1, FORWARD = 2, BACKWARD = 3 };

typedef struct planar {
    int contacts;
    int W[ROWS * ROWS], q[ROWS], mu[MOST]; /* row-major */
    int found;
    double r[64][ROWS], u[64][ROWS]; /* every solution */
} planar;

/* W = B B' + 1 with entries of B in -2 .. 2: conditions below 100. */
static void draw(planar *p, uint64_t seed)
{
    gen_random random;
    int B[ROWS * (ROWS + 1)], i, j, k, n;

    memset(p, 0, sizeof *p);
    gen_seed(&random, seed);
    p->contacts = 1 + (int)gen_integer(&random, MOST);
    n = 2 * p->contacts;
    for (i = 0; i < n * (n + 1); i++)
        B[i] = (int)gen_integer(&random, 5) - 2;
    for (i = 0; i < n; i++) {
        for (j = 0; j < n; j++) {
            p->W[i * n + j] = i == j;
            for (k = 0; k <= n; k++)
                p->W[i * n + j] += B[i * (n + 1) + k] * B[j * (n + 1) + k];
        }
        p->q[i] = (int)gen_integer(&random, 19) - 9;
    }
    for (k = 0; k < p->contacts; k++)
        p->mu[k] = (int)gen_integer(&random, 4);
}

static int sign_of_slip(int mode)
{
    return mode == FORWARD ? 1 : mode == BACKWARD ? -1 : 0;
}

/* The rows that have an equation, and how r depends on their unknowns: r_t = -sign mu r_n. */
static int list_unknowns(const planar *p, const int *modes, int *rows)
{
    int count = 0, k;

    for (k = 0; k < p->contacts; k++) {
        if (modes[k] != SEPARATE)
            rows[count++] = 2 * k;
        if (modes[k] == STICK)
            rows[count++] = 2 * k + 1;
    }
    return count;
}

/* r D, D the determinant that is returned; 0 if the modes' equations are singular. */
static int64_t solve_modes(const planar *p, const int *modes, int64_t *r)
{
    const int n = 2 * p->contacts;
    int64_t A[ROWS * ROWS], b[ROWS], numerators[ROWS], D;
    int rows[ROWS], count = list_unknowns(p, modes, rows), i, j;

    for (i = 0; i < count; i++) {
        b[i] = -p->q[rows[i]];
        for (j = 0; j < count; j++) {
            const int k = rows[j] / 2, row = rows[i] * n;

            A[i * count + j] = p->W[row + rows[j]];
            if (rows[j] % 2 == 0)
                A[i * count + j] -= sign_of_slip(modes[k]) * p->mu[k] * p->W[row + 2 * k + 1];
        }
    }
    memset(r, 0, ROWS * sizeof *r);
    D = count == 0 ? 1 : rational_solve(count, A, b, numerators);
    for (i = 0; i < count && D != 0; i++) {
        const int k = rows[i] / 2;

        r[rows[i]] = numerators[i];
        if (rows[i] % 2 == 0 && modes[k] >= FORWARD)
            r[2 * k + 1] = -sign_of_slip(modes[k]) * p->mu[k] * numerators[i];
    }
    return D;
}

static int obeys(const planar *p, const int *modes, const int64_t *r, const int64_t *u)
{
    int k;

    for (k = 0; k < p->contacts; k++) {
        const int64_t r_n = r[2 * k], r_t = r[2 * k + 1], u_t = u[2 * k + 1];
        const int64_t most = p->mu[k] * r_n;

        if (r_n < 0 || u[2 * k] < 0)
            return 0;
        if (modes[k] == STICK && (r_t > most || -r_t > most))
            return 0;
        if (modes[k] >= FORWARD && sign_of_slip(modes[k]) * u_t < 0)
            return 0;
    }
    return 1;
}

static void enumerate(planar *p)
{
    const int n = 2 * p->contacts;
    int code, total = 1, k, i, j;

    for (k = 0; k < p->contacts; k++)
        total *= MODES;
    for (code = 0; code < total; code++) {
        int modes[MOST], rest = code;
        int64_t r[ROWS], u[ROWS], D;

        for (k = 0; k < p->contacts; k++, rest /= MODES)
            modes[k] = rest % MODES;
        D = solve_modes(p, modes, r);
        if (D == 0)
            continue;
        for (i = 0; i < n; i++) {
            u[i] = p->q[i] * D;
            for (j = 0; j < n; j++)
                u[i] += p->W[i * n + j] * r[j];
        }
        if (!obeys(p, modes, r, u))
            continue;
        for (i = 0; i < n; i++) {
            p->r[p->found][i] = (double)r[i] / (double)D;
            p->u[p->found][i] = (double)u[i] / (double)D;
        }
        p->found++;
    }
}

/* 1e-9: residuals are below 1e-12, conditions below 1e3 with friction. */
static int is_known(const planar *p, const double *r, const double *u)
{
    int s, i;

    for (s = 0; s < p->found; s++) {
        double off = 0.0, size = 1.0;

        for (i = 0; i < 2 * p->contacts; i++) {
            off = fmax(off, fmax(fabs(r[i] - p->r[s][i]), fabs(u[i] - p->u[s][i])));
            size = fmax(size, fmax(fabs(p->r[s][i]), fabs(p->u[s][i])));
        }
        if (off <= 1e-9 * size)
            return 1;
    }
    return 0;
}

static void check(perp_context *context, const planar *p, int32_t method, uint64_t seed)
{
    const int n = 2 * p->contacts;
    double W[ROWS * ROWS], q[ROWS], mu[MOST], r[ROWS], u[ROWS];
    perp_contact_settings settings = fresh_contact_settings();
    perp_contact_result result = fresh_contact_result();
    perp_contact_laws laws = fresh_contact_laws();
    perp_matrix view;
    int i;

    for (i = 0; i < n * n; i++)
        W[i] = p->W[i];
    for (i = 0; i < n; i++)
        q[i] = p->q[i];
    for (i = 0; i < p->contacts; i++)
        mu[i] = p->mu[i];
    view = matrix_rows(W, n, n);
    settings.method = method;
    settings.tol = 1e-12;
    laws.contacts = p->contacts;
    laws.dim = 2;
    laws.mu = mu;
    assert_int_equal(perp_contact_solve(context, ANSWER(NULL, r, u), &result, &settings,
                                        DELASSUS(&laws, &view, q), NULL),
                     PERP_OK);
    if (result.outcome != PERP_OUTCOME_SOLVED && result.outcome != PERP_OUTCOME_ROUNDING_LIMIT) {
        /* pivoting and all that auto has must not fail; a single method may */
        if (method == PERP_CONTACT_METHOD_AUTO || method == PERP_CONTACT_METHOD_LEMKE)
            fail_msg("seed %d: %s", (int)seed, perp_outcome_text(result.outcome));
        return;
    }
    if (!is_known(p, r, u))
        fail_msg("seed %d: %s found what is none of the %d solutions", (int)seed,
                 perp_contact_method_text(method), p->found);
}

static void test_answers_are_solutions(void **state)
{
    perp_context *context = NULL;
    uint64_t seed;
    int several = 0;

    (void)state;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    for (seed = 1; seed <= 400; seed++) {
        planar p;
        int32_t method;

        draw(&p, seed);
        enumerate(&p);
        assert_true(p.found >= 1);
        several += p.found > 1;
        for (method = PERP_CONTACT_METHOD_AUTO; method <= PERP_CONTACT_METHOD_LEMKE; method++)
            check(context, &p, method, seed);
    }
    assert_true(several > 0); /* the draw has such problems */
    perp_context_destroy(context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_answers_are_solutions)};

    return cmocka_run_group_tests(tests, NULL, NULL);
}
