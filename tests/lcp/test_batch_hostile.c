/* perp_lcp_batch on numbers of every size: what its kernel accepts is a solution, verdicts are
 * those of the front door, and what overflows is not called solved. */
#include <math.h>

#include "suite.h"

#include "batch_many.h"

/* Many lanes are left to the kernel: a positive diagonal of moderate size more often than not. */
static double hostile(gen_random *random, int moderate)
{
    static const double sizes[] = {0.0,    4.9e-324, 1e-310, 2.3e-308, 1e-300,
                                   1e-100, 1e-30,    1e-16,  1e-12,    1e-8,
                                   0.5,    1.0,      3.0,    1e3,      1e8,
                                   1e12,   1e30,     1e100,  1e300,    1.7976931348623157e308};
    const int first = moderate ? 8 : 0, count = moderate ? 7 : 20;
    const double size = sizes[first + (int)(gen_uniform(random, 0.0, 1.0) * count) % count];

    return gen_uniform(random, -1.0, 1.0) < 0.0 ? -size : size;
}

/* Of three problems one is of moderate numbers, one of all sizes, one has a moderate matrix that
 * may fall into parts. Of three pairs of bounds one is 0 and inf. */
static void create_hostile(many *p, int32_t n, uint64_t seed, int all_sizes)
{
    const size_t size = (size_t)n;
    gen_random random;
    size_t k, i;

    allocate(p, n);
    gen_seed(&random, seed);
    for (k = 0; k < COUNT; k++) {
        for (i = 0; i < size * size; i++)
            p->M[k * size * size + i] = gen_uniform(&random, 0.0, 1.0) < 0.4
                                            ? 0.0
                                            : hostile(&random, !all_sizes || k % 3 != 1);
        for (i = 0; i < size; i++) {
            double *diagonal = &p->M[k * size * size + i * (size + 1)];
            const double a = hostile(&random, !all_sizes),
                         b = hostile(&random, !all_sizes || k % 3 == 0);
            const int kind = (int)gen_uniform(&random, 0.0, 9.0);

            *diagonal = k % 3 == 1 && kind < 2 ? *diagonal : fabs(*diagonal) + 1e-3;
            p->q[k * size + i] = hostile(&random, !all_sizes || k % 3 != 1);
            p->lower[k * size + i] = kind < 4 ? 0.0 : kind == 5 ? -INFINITY : fmin(a, b);
            p->upper[k * size + i] = kind < 4 || kind == 6 ? INFINITY : fmax(a, b);
            if (p->upper[k * size + i] < 0.0 && kind == 5)
                p->upper[k * size + i] = -p->upper[k * size + i];
        }
    }
}

/* The row's violation on the index set that z shows, and the sum of the sizes of its terms. Long
 * doubles: no product of doubles leaves their range, and a sum is good to 1e-18 of its terms. */
static long double violation_of(const many *p, size_t k, size_t i, const double *z,
                                long double *terms)
{
    const size_t n = (size_t)p->n, at = k * n + i;
    long double w = p->q[at];
    size_t j;

    *terms = fabsl(w);
    for (j = 0; j < n; j++) {
        const long double product = (long double)p->M[at * n + j] * z[j];

        w += product;
        *terms += fabsl(product);
    }
    if (p->lower[at] == p->upper[at])
        return 0.0L;
    return z[i] == p->lower[at]   ? fmaxl(-w, 0.0L)
           : z[i] == p->upper[at] ? fmaxl(w, 0.0L)
                                  : fabsl(w);
}

/* The largest |q_j| / sqrt(M_jj) of the rows that hang together with row i through entries that are
 * not 0. */
static long double unit_of_part(const many *p, size_t k, size_t i)
{
    const size_t n = (size_t)p->n;
    const double *M = p->M + k * n * n;
    int member[N] = {0}, changed = 1;
    long double largest = 0.0L;
    size_t a, b;

    for (member[i] = 1; changed;)
        for (changed = 0, a = 0; a < n; a++)
            for (b = 0; b < n; b++)
                if (member[a] && !member[b] && (M[a * n + b] != 0.0 || M[b * n + a] != 0.0))
                    changed = member[b] = 1;
    for (a = 0; a < n; a++)
        if (member[a])
            largest = fmaxl(largest, fabsl(p->q[k * n + a]) / sqrtl(M[a * n + a]));
    return largest;
}

/* What the kernel would have accepted is a solution in each row beside its own terms, and in each
 * part beside its own q. Powers of two in place of sqrt(M_ii) and max |q|: factors of up to 2 each
 * on both sides, 8 together. */
static int check_lane(const many *p, size_t k, const double *z, const double *w)
{
    const size_t n = (size_t)p->n;
    size_t i;

    for (i = 0; i < n; i++) {
        const double l = p->lower[k * n + i], u = p->upper[k * n + i];
        long double terms, violation;

        assert_true(isfinite(z[i]) && isfinite(w[i]) && z[i] >= l && z[i] <= u);
        violation = violation_of(p, k, i, z, &terms);
        assert_true(violation <= 1e-10L * terms);
        /* or z is as near to a bound, which the residual counts too, as w to 0 */
        if (violation > 0.0L && z[i] - l > 0.0 && u - z[i] > 0.0)
            assert_true(violation / sqrtl(p->M[(k * n + i) * n + i]) <=
                        8e-10L * unit_of_part(p, k, i));
    }
    return 1;
}

/* The kernel alone, whatever would have become of the lanes that it leaves to a solver. */
static void test_what_the_kernel_accepts(void **state)
{
    const perp__batch_kernel *kernel = perp__batch_kernel_number(0);
    int accepted = 0, round;

    (void)state;
    for (round = 0; round < 120; round++) {
        perp__batch_group group;
        perp__batch_data data;
        perp__arena arena;
        int64_t at, lane;
        many p;

        create_hostile(&p, 1 + round % 6, 1000 + (uint64_t)round, 1);
        data = data_of(&p);
        open_group(&group, &arena, &p, kernel);
        for (at = 0; at < COUNT; at += kernel->width) {
            int32_t takes[8];

            perp__batch_group_read(&group, &data, at, takes);
            kernel->solve(&group);
            for (lane = 0; lane < kernel->width && at + lane < COUNT; lane++) {
                double z[N], w[N];
                int i;

                for (i = 0; i < p.n; i++) {
                    z[i] = group.z[i * kernel->width + lane];
                    w[i] = group.high[i * kernel->width + lane];
                }
                if (takes[lane] && group.tested[lane] <= 1e-10 && group.own_residual[lane] <= 1e-10)
                    accepted += check_lane(&p, (size_t)(at + lane), z, w);
            }
        }
        perp__arena_release(&arena);
        release(&p);
    }
    assert_true(accepted >= 500); /* the test is about something */
}

/* The same verdict as the front door's on the same problem: good or not, and if not, why. */
static void test_verdicts_are_the_front_doors(void **state)
{
    int round;

    (void)state;
    for (round = 0; round < 30; round++) {
        many p;
        size_t k;

        create_hostile(&p, 1 + round % 6, 2000 + (uint64_t)round, 1);
        assert_int_equal(solve(&p, NULL, 1), PERP_OK);
        for (k = 0; k < COUNT; k++) {
            const size_t n = (size_t)p.n;
            const int good = p.outcomes[k] == PERP_OUTCOME_SOLVED ||
                             p.outcomes[k] == PERP_OUTCOME_ROUNDING_LIMIT;
            const perp_matrix M = run_dense(p.M + k * n * n, p.n);
            perp_lcp_result result = fresh_lcp_result();
            double z[N];
            size_t i;

            assert_int_equal(perp_lcp_solve(context, z, NULL, NULL, &result, NULL,
                                            LCP(&M, p.q + k * n, p.lower + k * n, p.upper + k * n),
                                            NULL),
                             PERP_OK);
            assert_true(good ? result.outcome == PERP_OUTCOME_SOLVED ||
                                   result.outcome == PERP_OUTCOME_ROUNDING_LIMIT
                             : result.outcome == p.outcomes[k]);
            for (i = 0; good && i < n; i++)
                assert_true(isfinite(p.z[k * n + i]));
        }
        release(&p);
    }
}

/* z_0 and z_1 rest at bounds that overflow with the other's: once 'solved' with z = nan. */
static void test_overflow_is_no_solution(void **state)
{
    const double M[] = {1.0, 0.0, 1.0, 0x1p-16}, q[] = {1.0, 1.0};
    const double lower[] = {-1.7976931348623157e308, -INFINITY};
    const double upper[] = {INFINITY, INFINITY};
    double z[2], residual;
    int32_t outcome;

    (void)state;
    assert_int_equal(perp_lcp_batch(context, z, NULL, &outcome, &residual, NULL, 1,
                                    LCP_STACK(1, 2, M, q, lower, upper)),
                     PERP_OK);
    /* the solution is (-1, 0) */
    assert_true(outcome != PERP_OUTCOME_SOLVED || (z[0] == -1.0 && z[1] == 0.0));
    assert_true(isfinite(z[0]) && isfinite(z[1]) && !isnan(residual));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_what_the_kernel_accepts),
        cmocka_unit_test(test_verdicts_are_the_front_doors),
        cmocka_unit_test(test_overflow_is_no_solution),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
