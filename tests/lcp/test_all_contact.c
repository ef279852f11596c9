/* perp_lcp_all on contact problems, where most blocks are singular. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "run.h"
#include "all_list.h"

#include "context.h"

/* A wedge of half-angle 10 degrees between two walls, friction 0.3 > tan 10 degrees, mass 1, pushed
 * in or pulled out with velocity 1: pushed in it stays (velocity 0); pulled out it jams or comes
 * free, and both solve the problem. Impulses are not unique: families, told apart by velocity. */
static void make_wedge(gen_lcp *problem, double direction, double B[2][6])
{
    const double c = cos(3.14159265358979324 / 18.0), s = sin(3.14159265358979324 / 18.0);
    const double columns[6][2] = {{c, s}, {-c, s}, {-s, c}, {s, -c}, {s, c}, {-s, -c}};
    int32_t i, j;

    gen_problem(problem, &(gen_random){1}, 8, GEN_M, GEN_PLAIN);
    memset(problem->M, 0, 64 * sizeof(double));
    for (i = 0; i < 6; i++) {
        B[0][i] = columns[i][0];
        B[1][i] = columns[i][1];
        problem->q[i] = columns[i][1] * direction;
        for (j = 0; j < 6; j++)
            problem->M[8 * i + j] = columns[i][0] * columns[j][0] + columns[i][1] * columns[j][1];
    }
    problem->q[6] = problem->q[7] = 0.0;
    for (i = 2; i < 6; i++) {
        problem->M[8 * i + 6 + (i - 2) / 2] = 1.0;
        problem->M[8 * (6 + (i - 2) / 2) + i] = -1.0;
    }
    problem->M[8 * 6 + 0] = problem->M[8 * 7 + 1] = 0.3;
}

static void test_wedge(void **state)
{
    int pulled;

    (void)state;
    for (pulled = 0; pulled < 2; pulled++) {
        double B[2][6];
        int32_t jams = 0, frees = 0, k, i;
        gen_lcp problem;
        list l;

        make_wedge(&problem, pulled ? 1.0 : -1.0, B);
        enumerate(context, &l, &problem);
        assert_int_equal(l.families, 1 + pulled);
        assert_int_equal(l.isolated, 0);
        for (k = 0; k < l.points; k++) {
            double v[2] = {0.0, pulled ? 1.0 : -1.0};

            for (i = 0; i < 6; i++) {
                v[0] += B[0][i] * l.at[8 * k + i];
                v[1] += B[1][i] * l.at[8 * k + i];
            }
            assert_true(fabs(v[0]) <= 1e-12);
            jams += fabs(v[1]) <= 1e-12;
            frees += fabs(v[1] - 1.0) <= 1e-12;
        }
        assert_int_equal(jams + frees, l.points);
        assert_true(jams > 0 && (frees > 0) == pulled);
        free(l.at);
        gen_destroy(&problem);
    }
}

/* A step of Stewart and Trinkle with 13 to 16 variables: all solutions give one velocity more often
 * than not, and the front door's is among the families' points. */
static void test_contact(void **state)
{
    gen_random random;
    int round;

    (void)state;
    gen_seed(&random, 4);
    for (round = 0; round < 6; round++) {
        const gen_contact_options options = {1 + round % 2, 2, 4, 100.0, 1.0, round % 2, round & 1};
        gen_lcp problem;
        list l;

        gen_contact(&problem, &random, &options);
        assert_true(problem.n <= LARGEST);
        enumerate(context, &l, &problem);
        assert_true(l.isolated + l.families >= 1); /* solvable for every friction */
        free(l.at);
        gen_destroy(&problem);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_wedge),
        cmocka_unit_test(test_contact),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
