/* Memory: every allocation may fail, nothing is lost, and a second solve asks for none. */
#include <float.h>
#include <math.h>

#include "suite.h"

#include "hand_over.h"
#include "memory.h"

typedef struct scenario {
    const char *name;
    int32_t method, cone, joints, dim, separate_bodies;
    int ray;
} scenario;

static const scenario scenarios[] = {
    {"auto", PERP_CONTACT_METHOD_AUTO, 0, 2, 3, 0, 0},
    {"auto, bodies", PERP_CONTACT_METHOD_AUTO, 0, 0, 0, 1, 0},
    {"sweep, bodies", PERP_CONTACT_METHOD_SWEEP, 0, 1, 3, 1, 0},
    {"sweep", PERP_CONTACT_METHOD_SWEEP, 0, 0, 3, 0, 0},
    {"newton", PERP_CONTACT_METHOD_NEWTON, 0, 1, 3, 0, 0},
    {"newton, bodies", PERP_CONTACT_METHOD_NEWTON, 0, 0, 3, 1, 0},
    {"lemke", PERP_CONTACT_METHOD_LEMKE, 6, 1, 3, 0, 0},
    {"lemke, bodies, exact", PERP_CONTACT_METHOD_LEMKE, 0, 0, 2, 1, 0},
    {"admm", PERP_CONTACT_METHOD_ADMM, 0, 1, 0, 1, 0},
    {"proximal", PERP_CONTACT_METHOD_PROXIMAL, 0, 1, 3, 1, 0},
    {"auto, a ray", PERP_CONTACT_METHOD_AUTO, 0, 0, 1, 0, 1},
};

enum { SCENARIOS = sizeof scenarios / sizeof *scenarios, N = 12, CONTACTS = 4 };

/* Blocks of 6, or one of 12; for a ray contact 1 is the opposite of contact 0. */
static void make_problem(hand_over *p, const scenario *s)
{
    int32_t i, j;

    hand_make(p, 7, s->separate_bodies ? N : N + 4, CONTACTS, s->dim, s->joints, 1.0);
    for (j = 0; s->separate_bodies && j < p->n; j++)
        for (i = 0; i < p->n; i++)
            if (i / 6 != j / 6)
                p->M[i + j * p->n] = 0.0;
    for (j = 0; s->ray && j < p->n; j++)
        p->H[1 + j * p->rows] = -p->H[j * p->rows];
    if (s->ray)
        p->w[0] = p->w[1] = -1.0;
    p->settings.method = s->method;
    p->settings.cone = s->cone;
    p->settings.tol = 1e-10;
}

static perp_status run(hand_over *p, perp_context *context)
{
    int32_t i;

    for (i = 0; i < p->size; i++)
        p->r[i] = p->u[i] = 123.25;
    for (i = 0; i < p->n; i++)
        p->v[i] = 123.25;
    p->result.outcome = 77;
    return hand_solve(p, context, NULL);
}

static void require_untouched(const hand_over *p)
{
    int32_t i;

    assert_int_equal(p->result.outcome, 77);
    for (i = 0; i < p->size; i++)
        assert_true(p->r[i] == 123.25 && p->u[i] == 123.25);
    for (i = 0; i < p->n; i++)
        assert_true(p->v[i] == 123.25);
}

static void require_right(const hand_over *p, const scenario *s)
{
    if (s->ray)
        assert_int_equal(p->result.outcome, PERP_OUTCOME_RAY);
    else if (p->result.outcome > PERP_OUTCOME_ROUNDING_LIMIT)
        fail_msg("%s: %s", s->name, perp_outcome_text(p->result.outcome));
}

static void test_every_allocation_may_fail(void **state)
{
    int s;

    (void)state;
    for (s = 0; s < SCENARIOS; s++) {
        memory m = {0, 0, 0};
        perp_context_settings settings = memory_settings(&m);
        perp_context *context;
        hand_over expected, p;
        int k, count;

        assert_int_equal(perp_context_create(&context, &settings), PERP_OK);
        make_problem(&expected, &scenarios[s]);
        m.calls = 0;
        assert_int_equal(run(&expected, context), PERP_OK);
        require_right(&expected, &scenarios[s]);
        count = m.calls;
        assert_true(count > 0);
        for (k = 1; k <= count; k++) {
            const int live = m.live;

            make_problem(&p, &scenarios[s]);
            m.calls = 0;
            m.fails_at = k;
            if (run(&p, context) != PERP_ERROR_MEMORY)
                fail_msg("%s: allocation %d of %d may fail unnoticed", scenarios[s].name, k, count);
            m.fails_at = 0;
            assert_string_not_equal(perp_context_message(context), "");
            require_untouched(&p);
            assert_int_equal(m.live, live);
        }
        assert_int_equal(run(&p, context), PERP_OK); /* as good as before */
        assert_memory_equal(p.r, expected.r, (size_t)p.size * sizeof(double));
        perp_context_destroy(context);
        assert_int_equal(m.live, 0);
    }
}

static void test_creation(void **state)
{
    memory m = {0, 0, 0};
    perp_context_settings settings = memory_settings(&m);
    perp_context *context;
    perp_contact_solver *solver = (perp_contact_solver *)(void *)&m;

    (void)state;
    assert_int_equal(perp_context_create(&context, &settings), PERP_OK);
    m.calls = 0;
    m.fails_at = 1;
    assert_int_equal(perp_contact_solver_create(context, &solver, NULL), PERP_ERROR_MEMORY);
    assert_ptr_equal(solver, &m);
    m.fails_at = 0;
    assert_int_equal(perp_contact_solver_create(context, &solver, NULL), PERP_OK);
    perp_contact_solver_destroy(solver);
    perp_context_destroy(context);
    assert_int_equal(m.live, 0);
}

static perp_status solve_again(perp_contact_solver *solver, hand_over *p, const double *r0)
{
    return perp_contact_solver_solve_dynamics(solver, ANSWER(p->v, p->r, p->u, p->modes, p->ray),
                                              &p->result, p->f, p->w, p->b, r0);
}

/* With other loads, cold and warm, and after a second setup of the same size. */
static void test_later_solves_allocate_nothing(void **state)
{
    int s, round, allocations = 0;

    (void)state;
    for (s = 0; s < SCENARIOS; s++) {
        memory m = {0, 0, 0};
        perp_context_settings settings = memory_settings(&m);
        perp_contact_solver *solver;
        perp_context *context;
        hand_over p;
        int32_t i;

        make_problem(&p, &scenarios[s]);
        assert_int_equal(perp_context_create(&context, &settings), PERP_OK);
        assert_int_equal(perp_contact_solver_create(context, &solver, &p.settings), PERP_OK);
        assert_int_equal(perp_contact_solver_setup_dynamics(solver, &p.laws, &p.dynamics), PERP_OK);
        assert_int_equal(solve_again(solver, &p, NULL), PERP_OK);
        require_right(&p, &scenarios[s]);
        m.calls = 0;
        for (round = 0; round < 4; round++) {
            for (i = 0; i < p.n; i++)
                p.f[i] += (i % 3 - 1) * 0.25;
            if (round == 2)
                assert_int_equal(perp_contact_solver_setup_dynamics(solver, &p.laws, &p.dynamics),
                                 PERP_OK);
            assert_int_equal(solve_again(solver, &p, round & 1 ? p.r : NULL), PERP_OK);
        }
        if (m.calls != 0)
            print_error("%s: %d allocations in later solves\n", scenarios[s].name, m.calls);
        allocations += m.calls;
        perp_contact_solver_destroy(solver);
        perp_context_destroy(context);
        assert_int_equal(m.live, 0);
    }
    assert_int_equal(allocations, 0);
}

/* Settings that ask for W while something moves: what then comes to a near rest has blocks of M,
 * and memory for them lies ready. A point slips on a floor that creeps by 1e-12, then sticks to it:
 * v = -w. */
static void test_a_late_rest_allocates_nothing(void **state)
{
    memory m = {0, 0, 0};
    perp_context_settings settings = memory_settings(&m);
    perp_contact_solver *solver;
    perp_context *context;
    hand_over p;

    (void)state;
    hand_make(&p, 7, 3, 1, 3, 0, 1.0);
    for (int32_t i = 0; i < 9; i++)
        p.M[i] = p.H[i] = i % 4 == 0;
    p.mu[0] = 0.5;
    p.settings.raw_velocity = 2;
    assert_int_equal(perp_context_create(&context, &settings), PERP_OK);
    assert_int_equal(perp_contact_solver_create(context, &solver, &p.settings), PERP_OK);
    assert_int_equal(perp_contact_solver_setup_dynamics(solver, &p.laws, &p.dynamics), PERP_OK);
    for (int32_t round = 0; round < 2; round++) {
        p.f[0] = -1.0;
        p.f[1] = round ? 0.0 : 2.0;
        p.f[2] = p.w[0] = p.w[2] = 0.0;
        p.w[1] = 1e-12;
        m.calls = 0;
        assert_int_equal(solve_again(solver, &p, NULL), PERP_OK);
        assert_int_equal(p.result.outcome, PERP_OUTCOME_SOLVED);
    }
    assert_true(p.v[0] == 0.0 && fabs(p.v[1] + p.w[1]) <= DBL_EPSILON && p.u[1] == 0.0);
    assert_int_equal(m.calls, 0);
    perp_contact_solver_destroy(solver);
    perp_context_destroy(context);
    assert_int_equal(m.live, 0);
}

/* A setup that runs out of memory leaves a solver without a problem, or with the old one; never one
 * that is half made. */
static void test_setup_step_by_step(void **state)
{
    int s, k;

    (void)state;
    for (s = 0; s < SCENARIOS; s++) {
        memory m = {0, 0, 0};
        perp_context_settings settings = memory_settings(&m);
        perp_contact_solver *solver;
        perp_context *context;
        hand_over p, small;
        perp_status status = PERP_ERROR_MEMORY;

        make_problem(&p, &scenarios[s]);
        hand_make(&small, 8, 6, 1, 3, 0, 1.0);
        assert_int_equal(perp_context_create(&context, &settings), PERP_OK);
        assert_int_equal(perp_contact_solver_create(context, &solver, &p.settings), PERP_OK);
        for (k = 1; status != PERP_OK; k++) {
            assert_int_equal(
                perp_contact_solver_setup_dynamics(solver, &small.laws, &small.dynamics), PERP_OK);
            assert_int_equal(solve_again(solver, &small, NULL), PERP_OK);
            m.calls = 0;
            m.fails_at = k;
            status = perp_contact_solver_setup_dynamics(solver, &p.laws, &p.dynamics);
            m.fails_at = 0;
            if (status != PERP_OK) {
                assert_int_equal(status, PERP_ERROR_MEMORY);
                status = solve_again(solver, &small, NULL);
                assert_true(status == PERP_OK || status == PERP_ERROR_ARGUMENT);
                status = PERP_ERROR_MEMORY;
            }
        }
        assert_int_equal(solve_again(solver, &p, NULL), PERP_OK);
        require_right(&p, &scenarios[s]);
        perp_contact_solver_destroy(solver);
        perp_context_destroy(context);
        assert_int_equal(m.live, 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_creation),
        cmocka_unit_test(test_every_allocation_may_fail),
        cmocka_unit_test(test_later_solves_allocate_nothing),
        cmocka_unit_test(test_a_late_rest_allocates_nothing),
        cmocka_unit_test(test_setup_step_by_step),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
