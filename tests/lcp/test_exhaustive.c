/* Every LCP of order 2 with entries -2 .. 2, and every 31st of order 3 with entries -1 .. 1,
 * against enumeration in integers. What a class of matrices promises (Cottle, Pang & Stone 1992,
 * sections 3.3, 3.8, 4.4) is demanded: P: one solution; strictly copositive: solved; positive
 * semidefinite: solved, or infeasible. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "rational.h"
#include "run.h"

#include "context.h"

static int minor_2(const int *M, int n, int i, int j)
{
    return M[n * i + i] * M[n * j + j] - M[n * i + j] * M[n * j + i];
}

static int determinant(const int *M, int n)
{
    if (n == 2)
        return minor_2(M, 2, 0, 1);
    return M[0] * (M[4] * M[8] - M[5] * M[7]) - M[1] * (M[3] * M[8] - M[5] * M[6]) +
           M[2] * (M[3] * M[7] - M[4] * M[6]);
}

/* The smallest principal minor; its sign tells P (> 0) and, for symmetric M, semidefinite (>= 0).
 */
static int smallest_minor(const int *M, int n)
{
    int least = determinant(M, n), i, j;

    for (i = 0; i < n; i++) {
        least = M[n * i + i] < least ? M[n * i + i] : least;
        for (j = 0; j < i; j++)
            least = minor_2(M, n, i, j) < least ? minor_2(M, n, i, j) : least;
    }
    return least;
}

static int is_semidefinite(const int *M, int n)
{
    int S[9], i, j;

    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            S[n * i + j] = M[n * i + j] + M[n * j + i];
    return smallest_minor(S, n) >= 0;
}

/* Sufficient only: no negative entry and a positive diagonal. */
static int is_strictly_copositive(const int *M, int n)
{
    int i;

    for (i = 0; i < n * n; i++)
        if (M[i] < 0 || (i % (n + 1) == 0 && M[i] == 0))
            return 0;
    return 1;
}

/* The distance of z to the nearest solution with a regular basis; +inf if there is none. */
static double distance_to_solutions(const int *M, const int *q, int n, const double *z)
{
    double nearest = INFINITY;
    unsigned set;

    for (set = 0; set < 1u << n; set++) {
        int64_t numerators[RATIONAL_LARGEST], denominator;
        double distance = 0.0;
        int i;

        if (!rational_basic_solution(n, M, q, set, numerators, &denominator))
            continue;
        for (i = 0; i < n; i++)
            distance = fmax(distance, fabs(z[i] - (double)numerators[i] / (double)denominator));
        nearest = fmin(nearest, distance);
    }
    return nearest;
}

typedef struct tally {
    int solved, infeasible, ray, other;
} tally;

/* 1e-13: integers up to 2, determinants from 1 to 40: a solution rounds to a few eps. */
static void examine(const int *M, const int *q, int n, int32_t method, tally *count)
{
    static const double zero[3] = {0.0, 0.0, 0.0};
    perp_lcp_settings settings = run_settings(method);
    const int has_solution = distance_to_solutions(M, q, n, zero) < INFINITY;
    const int semidefinite = is_semidefinite(M, n);
    gen_lcp problem;
    char where[160];
    run r;

    snprintf(where, sizeof where, "%s, n = %d, M = %d %d %d %d %d %d %d %d %d, q = %d %d %d",
             perp_lcp_method_text(method), n, M[0], M[1], M[2], M[3], M[4], M[5], M[6], M[7], M[8],
             q[0], q[1], q[2]);
    gen_from_integers(&problem, n, M, q);
    run_lcp(&r, context, &problem, &settings, NULL, where);
    if (run_ok(&r)) {
        count->solved++;
        if (smallest_minor(M, n) > 0 && !(distance_to_solutions(M, q, n, r.z) <= 1e-13))
            fail_msg("%s: not the solution", where);
    } else if (r.result.certificate == PERP_CERTIFICATE_INFEASIBLE) {
        count->infeasible++;
        if (has_solution)
            fail_msg("%s: called infeasible", where);
    } else {
        *(r.result.outcome == PERP_OUTCOME_RAY ? &count->ray : &count->other) += 1;
        if (has_solution &&
            (smallest_minor(M, n) > 0 || semidefinite || is_strictly_copositive(M, n)))
            fail_msg("%s: %s, though solvable and of a class that is processed", where,
                     perp_outcome_text(r.result.outcome));
        if (semidefinite)
            fail_msg("%s: %s without a certificate", where, perp_outcome_text(r.result.outcome));
    }
    run_release(&r);
    gen_destroy(&problem);
}

static void sweep(int n, int lowest, int values, int stride, int32_t method, tally *count)
{
    int M[9] = {0}, q[3] = {0}, entries = n * n, k, j;
    int64_t all = 1, at;

    for (k = 0; k < entries + n; k++)
        all *= k < entries ? values : 3;
    for (at = 0; at < all; at += stride) {
        int64_t rest = at;

        for (k = 0; k < entries; k++, rest /= values)
            M[k] = lowest + (int)(rest % values);
        for (j = 0; j < n; j++, rest /= 3)
            q[j] = (int)(rest % 3) - 1;
        examine(M, q, n, method, count);
    }
}

static void test_order_2(void **state)
{
    tally lemke = {0, 0, 0, 0}, choice = {0, 0, 0, 0};

    (void)state;
    sweep(2, -2, 5, 1, PERP_LCP_LEMKE, &lemke);
    sweep(2, -2, 5, 1, PERP_LCP_AUTO, &choice);
    assert_int_equal(lemke.solved + lemke.infeasible + lemke.ray + lemke.other, 625 * 9);
    assert_true(choice.solved >= lemke.solved);
}

static void test_order_3(void **state)
{
    tally lemke = {0, 0, 0, 0}, choice = {0, 0, 0, 0};

    (void)state;
    sweep(3, -1, 3, 31, PERP_LCP_LEMKE, &lemke); /* 31: no divisor in common with 3^12 */
    sweep(3, -1, 3, 31, PERP_LCP_AUTO, &choice);
    assert_true(choice.solved >= lemke.solved);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_order_2),
        cmocka_unit_test(test_order_3),
    };
    return cmocka_run_group_tests(tests, make, destroy);
}
