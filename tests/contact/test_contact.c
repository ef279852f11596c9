/* Closed forms: one contact in every mode, a block on a slope, joints, compliance, rolling. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

#include "context.h"

enum { MOST = 16 };

typedef struct answer {
    double r[MOST], u[MOST], v[MOST], ray[MOST];
    int32_t modes[MOST];
    perp_contact_result result;
} answer;

static perp_contact_laws laws_of(int32_t contacts, int32_t dim, const double *mu)
{
    perp_contact_laws laws = fresh_contact_laws();

    laws.contacts = contacts;
    laws.dim = dim;
    laws.mu = mu;
    return laws;
}

static perp_contact_settings settings_of(int32_t cone)
{
    perp_contact_settings settings = fresh_contact_settings();

    settings.cone = cone;
    settings.tol = 1e-12;
    return settings;
}

static void solve_delassus(answer *a, const perp_contact_laws *laws, int32_t cone, int32_t size,
                           const double *W, const double *q)
{
    const perp_contact_settings settings = settings_of(cone);
    perp_matrix view;

    memset(a, 0, sizeof *a);
    view = matrix_rows(W, size, size);
    assert_int_equal(perp_struct_init(&a->result, sizeof a->result), PERP_OK);
    assert_int_equal(perp_contact_solve(context, ANSWER(NULL, a->r, a->u, a->modes, a->ray),
                                        &a->result, &settings, DELASSUS(laws, &view, q), NULL),
                     PERP_OK);
}

static void require_solved(const answer *a)
{
    if (a->result.outcome != PERP_OUTCOME_SOLVED)
        fail_msg("%s by %s, residual %g", perp_outcome_text(a->result.outcome),
                 perp_contact_method_text(a->result.method), a->result.residual);
}

/* A particle of unit mass that touches the plane with velocity q: W = 1. */
static void one_contact(answer *a, int32_t dim, double mu, int32_t cone, double q_n, double q_t)
{
    const double W[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, W2[4] = {1, 0, 0, 1}, W1[1] = {1};
    const double q[3] = {q_n, q_t, 0};
    const perp_contact_laws laws = laws_of(1, dim, &mu);

    solve_delassus(a, &laws, cone, dim, dim == 3 ? W : dim == 2 ? W2 : W1, q);
    require_solved(a);
}

static void test_modes(void **state)
{
    const double tight = 1e-12; /* what was asked for, of numbers of order 1 */
    int32_t dim;

    (void)state;
    for (dim = 1; dim <= 3; dim++) {
        answer a;
        const int32_t cone = dim == 3 ? 4 : 0; /* slip along a vertex: the polyhedron is exact */

        one_contact(&a, dim, 0.5, cone, 0.25, 1.0);
        assert_int_equal(a.modes[0], PERP_CONTACT_SEPARATE);
        assert_true(a.r[0] == 0.0 && a.r[1] == 0.0 && a.u[0] == 0.25);
        one_contact(&a, dim, 0.5, cone, -1.0, 0.25);
        assert_int_equal(a.modes[0], PERP_CONTACT_STICK);
        assert_true(fabs(a.r[0] - 1.0) <= tight && a.u[0] == 0.0 && a.u[1] == 0.0);
        if (dim == 1)
            continue;
        assert_true(fabs(a.r[1] + 0.25) <= tight);
        one_contact(&a, dim, 0.5, cone, -1.0, 2.0);
        assert_int_equal(a.modes[0], PERP_CONTACT_SLIP);
        assert_true(fabs(a.r[0] - 1.0) <= tight && fabs(a.r[1] + 0.5) <= tight);
        assert_true(a.u[0] == 0.0 && fabs(a.u[1] - 1.5) <= 2 * tight);
    }
}

/* A block of mass m on a slope, one planar contact: g h sin - mu g h cos, or exactly 0. */
static void test_slope(void **state)
{
    const double g = 9.81, h = 0.01, angle = 0.3, m = 2.0;
    double k;

    (void)state;
    for (k = 0.5; k < 2.0; k += 0.25) {
        const double mu = k * tan(angle); /* holds from k = 1 on */
        const double W[4] = {1 / m, 0, 0, 1 / m};
        const double q[2] = {-g * h * cos(angle), g * h * sin(angle)};
        const perp_contact_laws laws = laws_of(1, 2, &mu);
        answer a;

        if (k == 1.0)
            continue;
        solve_delassus(&a, &laws, 0, 2, W, q);
        require_solved(&a);
        assert_int_equal(a.modes[0], k > 1.0 ? PERP_CONTACT_STICK : PERP_CONTACT_SLIP);
        if (k > 1.0)
            assert_true(a.u[1] == 0.0);
        else /* the tolerance asked for, relative to g h */
            assert_true(fabs(a.u[1] - g * h * (sin(angle) - mu * cos(angle))) <= 1e-12 * g * h);
    }
}

/* A particle of mass 4 on the ground, with and without a joint that holds its x. */
static void test_dynamics(void **state)
{
    const double M[4] = {4, 0, 0, 4}, H[4] = {0, 1, 1, 0}, G[2] = {1, 0}; /* normal y, tangent x */
    const double f[2] = {12, -8}, w[2] = {0, 0}, mu = 0.5;
    perp_contact_laws laws = laws_of(1, 2, &mu);
    const perp_contact_settings settings = settings_of(0);
    perp_contact_dynamics dynamics;
    perp_matrix views[3];
    answer a;
    int32_t joint;

    (void)state;
    for (joint = 0; joint < 2; joint++) {
        memset(&a, 0, sizeof a);
        views[0] = matrix_rows(M, 2, 2);
        views[1] = matrix_rows(H, 2, 2);
        views[2] = matrix_rows(G, 1, 2);
        assert_int_equal(perp_struct_init(&dynamics, sizeof dynamics), PERP_OK);
        dynamics.n = 2;
        dynamics.M = &views[0];
        dynamics.H = &views[1];
        dynamics.G = joint ? &views[2] : NULL;
        assert_int_equal(perp_struct_init(&a.result, sizeof a.result), PERP_OK);
        assert_int_equal(perp_contact_solve(context, ANSWER(a.v, a.r, a.u, a.modes), &a.result,
                                            &settings, DYNAMICS(&laws, &dynamics, f, w), NULL),
                         PERP_OK);
        require_solved(&a);
        /* r_n = 8; sliding: r_t = -4, v = (12 - 4) / 4; held: v = 0 */
        assert_true(a.r[0] == 8.0 && a.u[0] == 0.0 && a.v[1] == 0.0);
        if (joint)
            assert_true(a.v[0] == 0.0 && a.u[1] == 0.0 && a.u[2] == 0.0 && /* it rests */
                        fabs(a.r[1] + a.r[2] + 12.0) <= 4.0 * 12.0 * DBL_EPSILON);
        else
            assert_true(a.r[1] == -4.0 && a.v[0] == 2.0 && a.u[1] == 2.0 &&
                        a.modes[0] == PERP_CONTACT_SLIP);
    }
}

/* Two opposed walls that close on a body: no velocity is right, and y = (1, 1) proves it. */
static void test_ray(void **state)
{
    const double W[4] = {1, -1, -1, 1}, q[2] = {-1, -1};
    const perp_contact_laws laws = laws_of(2, 1, NULL);
    answer a;

    (void)state;
    solve_delassus(&a, &laws, 0, 2, W, q);
    assert_int_equal(a.result.outcome, PERP_OUTCOME_RAY);
    assert_int_equal(a.result.certificate, PERP_CONTACT_CERTIFICATE_INFEASIBLE);
    assert_int_equal(a.result.has_ray, 1);
    assert_true(a.ray[0] == 1.0 && a.ray[1] == 1.0);
}

/* A Hilbert matrix in integers, cond = 1.5e10: v = 1 solves M v = f exactly. One step of refinement
 * with the residual in doubled precision squares what rounding left, (cond eps)^2 = 1e-11. */
static void test_refinement(void **state)
{
    enum { N = 8 };
    const perp_contact_settings settings = settings_of(0);
    perp_contact_laws laws = laws_of(0, 3, NULL);
    double M[N * N], f[N] = {0.0}, v[N];
    perp_contact_dynamics dynamics = fresh_contact_dynamics();
    perp_contact_result result = fresh_contact_result();
    perp_matrix mass, none;
    int32_t i, j;

    (void)state;
    for (j = 0; j < N; j++)
        for (i = 0; i < N; i++) {
            M[i + j * N] = 360360.0 / (i + j + 1);
            f[i] += M[i + j * N];
        }
    mass = matrix_rows(M, N, N);
    none = matrix_rows(NULL, 0, N);
    dynamics.n = N;
    dynamics.M = &mass;
    dynamics.H = &none;
    assert_int_equal(perp_contact_solve(context, ANSWER(v), &result, &settings,
                                        DYNAMICS(&laws, &dynamics, f), NULL),
                     PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    for (i = 0; i < N; i++)
        assert_true(fabs(v[i] - 1.0) <= 1e-10);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_modes),      cmocka_unit_test(test_slope),
        cmocka_unit_test(test_dynamics),   cmocka_unit_test(test_ray),
        cmocka_unit_test(test_refinement),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
