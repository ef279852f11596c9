/* Polyhedral cones by pivoting: the law of their error, joints, rolling and spinning, wedges and
 * walls. */
#include <math.h>

#include "suite.h"

#include "contact/law.h"
#include "hand_over.h"

#include "context.h"

static const double pi = 3.14159265358979323846;

typedef struct answer {
    double r[8], u[8], ray[8];
    int32_t modes[4];
    perp_contact_result result;
} answer;

static void solve(answer *a, const perp_contact_laws *laws, int32_t cone, int32_t n,
                  const double *W, const double *q)
{
    perp_contact_settings settings = fresh_contact_settings();
    perp_matrix view = fresh_matrix();

    memset(a, 0, sizeof *a);
    assert_int_equal(perp_struct_init(&a->result, sizeof a->result), PERP_OK);
    settings.cone = cone;
    settings.tol = 1e-13;
    assert_int_equal(perp_matrix_dense(&view, PERP_STORAGE_COLUMN_MAJOR, n, n, W, n), PERP_OK);
    assert_int_equal(perp_contact_solve(context, ANSWER(NULL, a->r, a->u, a->modes, a->ray),
                                        &a->result, &settings, DELASSUS(laws, &view, q), NULL),
                     PERP_OK);
}

static perp_contact_laws laws_of(int32_t contacts, int32_t dim, const double *mu)
{
    perp_contact_laws laws = fresh_contact_laws();

    laws.contacts = contacts;
    laws.dim = dim;
    laws.mu = mu;
    return laws;
}

/* The friction of a k-gon against a slip at angle `a` from a vertex is, along the slip, cos(a) mu
 * up to half an edge, and cos(pi / k) mu at worst (theory: force at the vertex that opposes it). */
static void test_error_law(void **state)
{
    static const int32_t edges[] = {3, 4, 5, 6, 8, 12, 16, 64};
    const double W[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, mu = 0.5;
    const perp_contact_laws laws = laws_of(1, 3, &mu);
    size_t e;
    int32_t step;

    (void)state;
    for (e = 0; e < sizeof edges / sizeof *edges; e++) {
        const int32_t k = edges[e];
        double least = 1.0;

        for (step = 0; step < 12; step++) {
            /* slip against vertex 1, off it by up to half an edge; fast, so that W r does not turn
             * it into another sector */
            const double off = pi / k * (step / 12.0), angle = 2 * pi / k + off + pi;
            const double q[3] = {-1, 1e6 * cos(angle), 1e6 * sin(angle)};
            answer a;
            double along;

            solve(&a, &laws, k, 3, W, q);
            assert_int_equal(a.result.outcome, PERP_OUTCOME_SOLVED);
            assert_int_equal(a.result.method, PERP_CONTACT_METHOD_LEMKE);
            assert_int_equal(a.modes[0], PERP_CONTACT_SLIP);
            along = -(a.r[1] * cos(angle) + a.r[2] * sin(angle)) / mu;
            assert_true(fabs(along - cos(off)) <= 1e-9); /* W r turns the slip by 1e-6 at most */
            least = fmin(least, along);
        }
        assert_true(least >= cos(pi / k));
    }
}

/* A push that the circle holds and the polygon does not, and one that both hold. */
static void test_holding(void **state)
{
    const double W[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, mu = 0.5;
    const perp_contact_laws laws = laws_of(1, 3, &mu);
    const double share[2] = {0.9 * cos(pi / 4), 0.5 * (1 + cos(pi / 4))};
    int32_t i;

    (void)state;
    for (i = 0; i < 2; i++) { /* along the middle of an edge of the square */
        const double q[3] = {-1, mu * share[i] * cos(pi / 4), mu * share[i] * sin(pi / 4)};
        answer a;

        solve(&a, &laws, 4, 3, W, q);
        assert_int_equal(a.result.outcome, PERP_OUTCOME_SOLVED);
        assert_int_equal(a.modes[0], i == 0 ? PERP_CONTACT_STICK : PERP_CONTACT_SLIP);
        if (i == 0)
            assert_true(a.u[0] == 0.0 && a.u[1] == 0.0 && a.u[2] == 0.0);
        else /* what the edge does not hold */
            assert_true(fabs(hypot(a.u[1], a.u[2]) - mu * (share[1] - cos(pi / 4))) <= 1e-14);
    }
}

/* The LCP of planar contacts is exact: the front door's other methods agree. */
static void test_planar_is_exact(void **state)
{
    uint64_t seed;
    int32_t i;

    (void)state;
    for (seed = 0; seed < 40; seed++) {
        hand_over p, other;

        hand_make(&p, seed, 20, 7, seed % 3 ? 2 : 1, (int32_t)(seed % 4), 1.0);
        hand_make(&other, seed, 20, 7, seed % 3 ? 2 : 1, (int32_t)(seed % 4), 1.0);
        p.settings.method = PERP_CONTACT_METHOD_LEMKE;
        p.settings.tol = other.settings.tol = 1e-12;
        other.settings.method = PERP_CONTACT_METHOD_SWEEP;
        assert_int_equal(hand_solve(&p, context, NULL), PERP_OK);
        assert_int_equal(hand_solve(&other, context, NULL), PERP_OK);
        assert_int_equal(p.result.outcome, PERP_OUTCOME_SOLVED);
        assert_int_equal(p.result.method, PERP_CONTACT_METHOD_LEMKE);
        assert_true(hand_violation(&p) <= 1e-10);
        for (i = 0; i < p.n; i++)
            assert_true(fabs(p.v[i] - other.v[i]) <= 1e-9);
    }
}

/* With 64 edges the answer is near the exact one: mu is off by 1 - cos(pi / 64) = 1.2e-3. */
static void test_many_edges_are_round(void **state)
{
    uint64_t seed;
    int32_t i;

    (void)state;
    for (seed = 0; seed < 10; seed++) {
        hand_over p, exact;

        hand_make(&p, seed, 20, 5, 3, 1, 0.8);
        hand_make(&exact, seed, 20, 5, 3, 1, 0.8);
        p.settings.cone = 64;
        assert_int_equal(hand_solve(&p, context, NULL), PERP_OK);
        assert_int_equal(hand_solve(&exact, context, NULL), PERP_OK);
        assert_true(p.result.outcome <= PERP_OUTCOME_ROUNDING_LIMIT);
        assert_true(exact.result.outcome <= PERP_OUTCOME_ROUNDING_LIMIT);
        /* the direction of friction is off by pi / 64 = 5e-2, of impulses of order 1 */
        for (i = 0; i < p.n; i++)
            assert_true(fabs(p.v[i] - exact.v[i]) <= 0.2);
    }
}

/* One contact with W = 1 that rolls and spins: each part stops or is held back by its radius. */
static void test_rolling_and_spinning(void **state)
{
    const double mu = 0.5, rolling = 0.25, spinning = 0.125;
    perp_contact_laws laws = laws_of(1, 3, &mu);
    double W[36] = {0};
    int32_t fast, i, cone;

    (void)state;
    laws.rolling = &rolling;
    laws.spinning = &spinning;
    for (i = 0; i < 6; i++)
        W[7 * i] = 1.0;
    for (cone = 0; cone <= 4; cone += 4) /* along vertices the square is exact */
        for (fast = 0; fast < 8; fast++) {
            const double q[6] = {
                -1, 0, fast & 1 ? 2.0 : 0.25, fast & 2 ? -2.0 : -0.125, 0, fast & 4 ? 2.0 : 0.0625};
            answer a;

            solve(&a, &laws, cone, 6, W, q);
            assert_int_equal(a.result.outcome, PERP_OUTCOME_SOLVED);
            assert_int_equal(a.modes[0], fast ? PERP_CONTACT_SLIP : PERP_CONTACT_STICK);
            assert_true(fabs(a.r[0] - 1) <= 1e-12);
            assert_true(fabs(a.r[2] + (fast & 1 ? 0.5 : 0.25)) <= 1e-12);
            assert_true(fabs(a.r[3] - (fast & 2 ? 0.25 : 0.125)) <= 1e-12);
            assert_true(fabs(a.r[5] + (fast & 4 ? 0.125 : 0.0625)) <= 1e-12);
        }
}

/* Walls on both sides that close on a body: y = (1, 0, 0, 1, 0, 0). With friction, and where a
 * third contact has no part in it. */
static void test_walls(void **state)
{
    const double mu[2] = {0.5, 0.5};
    const double H[2][6] = {{1, 0, 0, -1, 0, 0}, {0, 1, 0, 0, 1, 0}};
    const double q[6] = {-1, 0.5, 0, -1, 0.5, 0};
    perp_contact_laws laws = laws_of(2, 3, mu);
    int32_t i, j, k, cone;
    double W[36];

    (void)state;
    for (i = 0; i < 6; i++)
        for (j = 0; j < 6; j++)
            for (W[i + 6 * j] = 0.0, k = 0; k < 2; k++)
                W[i + 6 * j] += H[k][i] * H[k][j];
    W[2 + 6 * 2] = W[5 + 6 * 5] = 1.0; /* the second tangents move something else */
    for (cone = 0; cone <= 6; cone += 6) {
        answer a;

        solve(&a, &laws, cone, 6, W, q);
        assert_int_equal(a.result.outcome, PERP_OUTCOME_RAY);
        assert_int_equal(a.result.certificate, PERP_CONTACT_CERTIFICATE_INFEASIBLE);
        for (i = 0; i < 6; i++)
            assert_true(a.ray[i] == (i % 3 == 0 ? 1.0 : 0.0));
    }
}

/* A wedge of half angle 10 degrees that is pulled out, mu > tan: it jams or it comes, both are
 * right (theory: velocities 0 and (0, 1)); pushed in it stays. */
static void test_wedge(void **state)
{
    const double c = cos(pi / 18), s = sin(pi / 18), mu[2] = {0.3, 0.3};
    const double H[4][2] = {{-c, s}, {s, c}, {c, s}, {-s, c}};
    const perp_contact_laws laws = laws_of(2, 2, mu);
    double W[16], q[4];
    int32_t i, j, pulled;

    (void)state;
    for (i = 0; i < 4; i++)
        for (j = 0; j < 4; j++)
            W[i + 4 * j] = H[i][0] * H[j][0] + H[i][1] * H[j][1];
    for (pulled = 0; pulled < 2; pulled++) {
        answer a;

        for (i = 0; i < 4; i++)
            q[i] = H[i][1] * (pulled ? 1.0 : -1.0);
        solve(&a, &laws, 0, 4, W, q);
        assert_true(a.result.outcome <= PERP_OUTCOME_ROUNDING_LIMIT);
        for (i = 0; i < 4; i++) {
            const double jammed = fabs(a.u[i]), free = fabs(a.u[i] - q[i]);

            assert_true(jammed <= 1e-12 || (pulled && free <= 1e-12));
        }
    }
}

/* The smallest change of u that makes the law of a square exact, by hand: r at vertex (1, 0), on
 * the middle of an edge, inside. */
static void test_backward_distance(void **state)
{
    static const struct {
        double r[2], u[2], change;
    } cases[] = {
        {{1, 0}, {-1, 0}, 0.0},
        {{1, 0}, {-1, 1}, 0.0},                /* the end of the vertex's cone */
        {{1, 0}, {0, 1}, 0.70710678118654752}, /* beyond it by 45 degrees */
        {{1, 0}, {2, 0}, 2.0},
        {{0.5, 0.5}, {-3, -3}, 0.0},
        {{0.5, 0.5}, {-1, 0}, 0.70710678118654752},
        {{0.5, 0.5}, {1, 1}, 1.4142135623730951},
        {{0.25, 0.25}, {-3, -4}, 5.0},
        {{0, -1}, {0, 7}, 0.0},
    };
    const int32_t starts[2] = {0, 3}, dim = 3;
    const double mu = 1.0, trace = 3.0;
    perp__contact_problem problem;
    perp__contact_law law;
    size_t c;

    (void)state;
    memset(&problem, 0, sizeof problem);
    problem.contacts = 1;
    problem.rows = problem.size = 3;
    problem.starts = starts;
    problem.dims = &dim;
    problem.mu = &mu;
    problem.trace = &trace;
    problem.cone = 4;
    for (c = 0; c < sizeof cases / sizeof *cases; c++) {
        const double r[3] = {1, cases[c].r[0], cases[c].r[1]};
        const double u[3] = {0, cases[c].u[0], cases[c].u[1]};

        perp__contact_outcome_of(&problem, 0, r, u, &law);
        if (!(fabs(law.change - cases[c].change) <= 1e-15))
            fail_msg("case %d: %.17g instead of %.17g", (int)c, law.change, cases[c].change);
    }
}

/* Opposite vertices are opposite to the last bit, and quarter turns are exact. */
static void test_directions(void **state)
{
    int32_t k, j;

    (void)state;
    for (k = 3; k <= 64; k++)
        for (j = 0; j < k; j++) {
            double d[2], opposite[2];

            perp__contact_direction(k, j, d);
            assert_true(fabs(hypot(d[0], d[1]) - 1.0) <= 4e-16);
            if (k % 2 == 0) {
                perp__contact_direction(k, (j + k / 2) % k, opposite);
                assert_true(d[0] == -opposite[0] && d[1] == -opposite[1]);
            }
            if (4 * j % k == 0)
                assert_true(d[0] == 0.0 || d[1] == 0.0);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_error_law),
        cmocka_unit_test(test_holding),
        cmocka_unit_test(test_planar_is_exact),
        cmocka_unit_test(test_many_edges_are_round),
        cmocka_unit_test(test_rolling_and_spinning),
        cmocka_unit_test(test_walls),
        cmocka_unit_test(test_wedge),
        cmocka_unit_test(test_backward_distance),
        cmocka_unit_test(test_directions),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
