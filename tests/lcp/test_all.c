/* perp_lcp_all: all solutions of problems whose solutions are known, and of random ones against
 * rational arithmetic. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "rational.h"
#include "run.h"

enum { LARGEST = 20, MOST_POINTS = 4000 };

static perp_context *context;

static int make(void **state)
{
    (void)state;
    return perp_context_create(&context, NULL);
}

static int destroy(void **state)
{
    (void)state;
    perp_context_destroy(context);
    return 0;
}

/* What the visits told: every isolated solution and every vertex in a list. */
typedef struct list {
    const gen_lcp *problem;
    int32_t n, isolated, families, points, rays;
    int32_t largest_dimension;
    double *at; /* points by n */
    double first[LARGEST];
} list;

/* A solution of the problem, to the front door's tolerance and some rounding of its own. */
static void require_solution(const gen_lcp *problem, const double *z)
{
    const check_lcp lcp = {&problem->view, problem->q, problem->lower, problem->upper, 1};
    check_measures measures;
    double size = 1.0;
    int32_t i;

    for (i = 0; i < problem->n; i++)
        check_raise(&size, fabs(z[i]));
    check_measure(&measures, &lcp, z, NULL);
    assert_true(measures.residual <= 1e-9 * size);
}

static void require_found(list *l, const perp_lcp_found *found)
{
    double point[LARGEST];
    int32_t i, k;

    assert_int_equal(found->struct_size, sizeof *found);
    assert_true(found->vertex_count >= 1 && found->residual <= 1e-9);
    require_solution(l->problem, found->z);
    for (k = 0; k < found->vertex_count; k++)
        require_solution(l->problem, found->vertices + k * l->n);
    for (k = 0; k < found->ray_count; k++) { /* from the first vertex, a long way */
        for (i = 0; i < l->n; i++)
            point[i] = found->vertices[i] + 100.0 * found->rays[k * l->n + i];
        require_solution(l->problem, point);
    }
    for (i = 0; i < l->n; i++) { /* the index set is one of all points */
        if (found->places[i] == PERP_PLACE_LOWER)
            assert_true(found->z[i] == (l->problem->lower ? l->problem->lower[i] : 0.0));
        if (found->places[i] == PERP_PLACE_BETWEEN)
            assert_true(fabs(found->w[i]) <= 1e-9);
    }
    if (found->dimension == 0) {
        assert_true(found->vertex_count == 1 && found->ray_count == 0);
        assert_true(run_distance(found->z, found->vertices, l->n) <= 1e-12);
    }
}

static int32_t visit(const perp_lcp_found *found, void *user)
{
    list *l = user;

    require_found(l, found);
    if (l->isolated + l->families == 0)
        memcpy(l->first, found->z, (size_t)l->n * sizeof *l->first);
    if (found->dimension == 0)
        l->isolated++;
    else
        l->families++;
    if (found->dimension > l->largest_dimension)
        l->largest_dimension = found->dimension;
    l->rays += found->ray_count;
    assert_true(l->points + found->vertex_count <= MOST_POINTS);
    memcpy(l->at + l->points * l->n, found->vertices,
           (size_t)(found->vertex_count * l->n) * sizeof(double));
    l->points += found->vertex_count;
    return 0;
}

static perp_lcp_enumeration fresh(void)
{
    perp_lcp_enumeration result;

    assert_int_equal(perp_lcp_enumeration_init(&result, sizeof result), PERP_OK);
    return result;
}

static void open_list(list *l, const gen_lcp *problem)
{
    memset(l, 0, sizeof *l);
    l->problem = problem;
    l->n = problem->n;
    l->at = check_allocate((size_t)(MOST_POINTS * problem->n) + 1, sizeof(double));
}

static perp_lcp_enumeration enumerate(list *l, const gen_lcp *problem)
{
    perp_lcp_enumeration result = fresh();

    open_list(l, problem);
    assert_int_equal(perp_lcp_all(context, &result, NULL, &problem->view, problem->q,
                                  problem->lower, problem->upper, visit, l),
                     PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    assert_int_equal(result.isolated, l->isolated);
    assert_int_equal(result.families, l->families);
    return result;
}

static int is_listed(const list *l, const double *z)
{
    int32_t k;

    for (k = 0; k < l->points; k++)
        if (run_distance(z, l->at + k * l->n, l->n) <= 1e-9)
            return 1;
    return 0;
}

/* ---- known solutions ----------------------------------------------------------------------- */

typedef struct known {
    const char *name;
    int n, M[16], q[4];
    int isolated, families, dimension, points, rays;
} known;

/* The matrices' classes are Cottle, Pang & Stone's, the counts by exact enumeration. */
static const known zoo[] = {
    {"P, not PD", 2, {1, 3, 0, 1}, {-1, -1}, 1, 0, 0, 1, 0},
    {"PSD, a segment", 2, {1, 1, 1, 1}, {-1, -1}, 0, 1, 1, 2, 0},
    {"P0, none", 2, {0, 1, 0, 0}, {1, -1}, 0, 0, 0, 0, 0},
    {"copositive-plus, none", 2, {0, -1, 1, 0}, {-1, -1}, 0, 0, 0, 0, 0},
    {"copositive-plus, one", 2, {0, -1, 1, 0}, {1, -1}, 1, 0, 0, 1, 0},
    {"strictly copositive", 2, {1, 2, 2, 1}, {-1, -1}, 3, 0, 0, 3, 0},
    {"Z, none", 2, {1, -2, -2, 1}, {-1, -1}, 0, 0, 0, 0, 0},
    {"Z, two", 2, {1, -2, -2, 1}, {1, 1}, 2, 0, 0, 2, 0},
    {"N, one", 2, {-1, 2, 2, -1}, {-1, -1}, 1, 0, 0, 1, 0},
    {"N, three", 2, {-1, 2, 2, -1}, {1, 1}, 3, 0, 0, 3, 0},
    {"bimatrix",
     4,
     {0, 0, 10, 30, 0, 0, 20, 15, 10, 30, 0, 0, 20, 15, 0, 0},
     {-1, -1, -1, -1},
     3,
     0,
     0,
     3,
     0},
    {"CPS 4.4.7", 3, {0, -1, 2, 2, 0, -2, -1, 1, 0}, {-3, 6, -1}, 1, 0, 0, 1, 0},
    {"everything", 3, {0}, {0}, 0, 1, 3, 1, 3},
    {"two half-lines", 2, {0, 0, 1, 0}, {0, -1}, 0, 2, 1, 2, 2},
    {"a degenerate point", 2, {2, 1, 1, 2}, {-2, -1}, 1, 0, 0, 1, 0},
};

static void test_zoo(void **state)
{
    size_t k;

    (void)state;
    for (k = 0; k < sizeof zoo / sizeof *zoo; k++) {
        const known *z = &zoo[k];
        gen_lcp problem;
        list l;

        gen_from_integers(&problem, z->n, z->M, z->q);
        enumerate(&l, &problem);
        if (l.isolated != z->isolated || l.families != z->families ||
            l.largest_dimension != z->dimension || l.points != z->points || l.rays != z->rays)
            fail_msg("%s: %d isolated, %d families, dimension %d, %d points, %d rays", z->name,
                     (int)l.isolated, (int)l.families, (int)l.largest_dimension, (int)l.points,
                     (int)l.rays);
        free(l.at);
        gen_destroy(&problem);
    }
}

static void test_empty(void **state)
{
    gen_lcp problem;
    list l;

    (void)state;
    gen_from_integers(&problem, 0, NULL, NULL);
    enumerate(&l, &problem);
    assert_int_equal(l.isolated, 1); /* the empty vector */
    free(l.at);
    gen_destroy(&problem);
}

/* Classes with one solution, with all kinds of bounds: it is found, alone. */
static void test_unique(void **state)
{
    static const int classes[] = {GEN_PD_SYMMETRIC, GEN_PD_UNSYMMETRIC, GEN_P, GEN_M};
    gen_random random;
    int round;

    (void)state;
    gen_seed(&random, 1);
    for (round = 0; round < 200; round++) {
        const int32_t n = 1 + gen_integer(&random, 8);
        gen_lcp problem;
        list l;

        gen_problem(&problem, &random, n, classes[round % 4], round / 4 % GEN_BOUNDS);
        enumerate(&l, &problem);
        assert_int_equal(l.isolated, 1);
        assert_int_equal(l.families, 0);
        assert_true(run_distance(l.first, problem.z, n) <= 1e-9);
        free(l.at);
        gen_destroy(&problem);
    }
}

/* M = -I, q = e: every vector of zeros and ones. */
static void test_many(void **state)
{
    const int32_t n = 10;
    gen_lcp problem;
    list l;
    int32_t i, code;

    (void)state;
    gen_problem(&problem, &(gen_random){1}, n, GEN_M, GEN_PLAIN);
    for (i = 0; i < n * n; i++)
        problem.M[i] = i % (n + 1) == 0 ? -1.0 : 0.0;
    for (i = 0; i < n; i++)
        problem.q[i] = 1.0;
    assert_int_equal(enumerate(&l, &problem).bases, 1024);
    assert_int_equal(l.isolated, 1024);
    for (code = 0; code < 1024; code++) {
        double z[10];

        for (i = 0; i < n; i++)
            z[i] = code >> i & 1;
        assert_true(is_listed(&l, z));
    }
    free(l.at);
    gen_destroy(&problem);
}

/* ---- against rational arithmetic ----------------------------------------------------------- */

/* A basic solution with a regular block is a vertex of every polyhedron of solutions that holds it:
 * none may be missing. Where every block is regular the isolated solutions are just those. */
static void test_rational(void **state)
{
    gen_random random;
    int round, solutions = 0;

    (void)state;
    gen_seed(&random, 2);
    for (round = 0; round < 500; round++) {
        int M[36], q[6], n = 1 + gen_integer(&random, 6), size = 1 + gen_integer(&random, 4), i;
        double basic[64][6];
        int32_t count = 0, k;
        gen_lcp problem;
        unsigned set;
        list l;

        for (i = 0; i < n * n; i++)
            M[i] = gen_integer(&random, 2 * size + 1) - size;
        for (i = 0; i < n; i++)
            q[i] = gen_integer(&random, 2 * size + 1) - size;
        gen_from_integers(&problem, n, M, q);
        enumerate(&l, &problem);
        for (set = 0; set < 1u << n; set++) {
            int64_t numerators[6], denominator;

            if (!rational_basic_solution(n, M, q, set, numerators, &denominator))
                continue;
            for (i = 0; i < n; i++)
                basic[count][i] = (double)numerators[i] / (double)denominator;
            assert_true(is_listed(&l, basic[count]));
            for (k = 0; k < count; k++)
                if (run_distance(basic[k], basic[count], n) <= 1e-12)
                    break;
            count += k == count; /* a degenerate one has several index sets */
        }
        solutions += count;
        if (l.families == 0)
            assert_true(l.isolated >= count);
        free(l.at);
        gen_destroy(&problem);
    }
    assert_true(solutions > 300);
}

/* ---- contact ------------------------------------------------------------------------------- */

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
        enumerate(&l, &problem);
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
        enumerate(&l, &problem);
        assert_true(l.isolated + l.families >= 1); /* solvable for every friction */
        free(l.at);
        gen_destroy(&problem);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_zoo),      cmocka_unit_test(test_empty),
        cmocka_unit_test(test_unique),   cmocka_unit_test(test_many),
        cmocka_unit_test(test_rational), cmocka_unit_test(test_wedge),
        cmocka_unit_test(test_contact),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
