/* Joints among the contacts of rigid bodies: chains on the ground and in the air, joints that
 * repeat others. */
#include "base/outcome.h"
#include "memory.h"
#include "rigid_fixture.h"

/* A chain of boxes with ball joints, turned and pushed at random, corners on the ground: contacts
 * come first. `twice`: every joint is there twice. Returns how many are contacts. */
static int32_t make_chain(rigid_scene *s, uint64_t seed, int32_t links, int32_t twice)
{
    static const double half[3] = {0.5, 0.3, 0.2};
    gen_random random;
    int32_t contacts, k, i;

    gen_seed(&random, seed);
    for (k = 0; k < links; k++) {
        const double place[3] = {1.2 * k, 0.1 * (k % 2), 0.3};
        double velocity[6];

        for (i = 0; i < 6; i++)
            velocity[i] = gen_uniform(&random, -1.0, 1.0);
        rigid_add(s, place, half, gen_uniform(&random, 0.5, 2.0), velocity);
    }
    for (k = 0; k < links; k += 2)
        for (i = 0; i < 2; i++) {
            const double point[3] = {1.2 * k + (i ? 0.5 : -0.5), 0.3, 0.0};
            const double up[3] = {0.0, 0.0, 1.0};

            rigid_touch(s, RIGID_GROUND, k, point, up, 3, gen_uniform(&random, 0.1, 0.8));
        }
    contacts = s->contacts;
    for (k = 1; k < links; k++)
        for (i = 0; i <= twice; i++) {
            const double point[3] = {1.2 * k - 0.6, 0.0, 0.3}, along[3] = {1.0, 0.0, 0.0};

            rigid_touch(s, k - 1, k, point, along, 3, 0.0);
        }
    return contacts;
}

/* The chain's first `contacts` rows are contacts, the others joints. */
static perp__rigid_problem chain_problem(rigid_scene *s, int32_t contacts)
{
    perp__rigid_problem p = rigid_problem(s);

    p.contacts = contacts;
    p.joints = s->contacts - contacts;
    p.method = PERP_CONTACT_METHOD_PROXIMAL;
    p.tol = 1e-10;
    return p;
}

/* A search without last resorts (brief) meets the laws of contacts and joints. */
static void test_chains(void **state)
{
    int32_t seed, contacts;

    (void)state;
    for (seed = 0; seed < 40; seed++) {
        const int32_t links = 2 + seed % 17;
        fixture f;
        perp__rigid_problem p;
        perp__rigid_answer a;
        double worst;

        open_fixture(&f, 0, NULL);
        contacts = make_chain(&f.s, (uint64_t)seed, links, 0);
        p = chain_problem(&f.s, contacts);
        p.max_iterations = 100;
        p.quick = 1;
        a = solve(&f, &p);
        assert_true(a.outcome == PERP_OUTCOME_SOLVED || a.outcome == PERP_OUTCOME_ROUNDING_LIMIT);
        for (int32_t i = 3 * p.contacts; i < 3 * f.s.contacts; i++)
            assert_true(fabs(a.velocity[i]) <= 1e-12); /* some tens of roundings of unit speeds */
        check_momentum(&f.s);
        f.s.contacts = p.contacts;
        worst = worst_violation(&f.s, &a);
        assert_true(worst <= 4.0 * p.tol); /* speeds are a few units */
        close_fixture(&f);
    }
}

/* Where joints say the same the laws hold on all. */
static void test_redundant_joints(void **state)
{
    fixture f;
    perp__rigid_problem p;
    perp__rigid_answer a;
    int32_t contacts;

    (void)state;
    open_fixture(&f, 0, NULL);
    contacts = make_chain(&f.s, 5, 8, 1);
    p = chain_problem(&f.s, contacts);
    a = solve(&f, &p);
    assert_true(a.outcome == PERP_OUTCOME_SOLVED || a.outcome == PERP_OUTCOME_ROUNDING_LIMIT);
    check_momentum(&f.s);
    f.s.contacts = contacts;
    assert_true(worst_violation(&f.s, &a) <= 4.0 * p.tol);
    close_fixture(&f);
}

/* Every allocation of a first solve fails once, after which the same solver solves it; none is made
 * once it has. */
static void test_memory(void **state)
{
    memory m = {0, 0, 0};
    perp_context_settings settings = memory_settings(&m);
    int32_t fails, failed = 1, contacts;

    (void)state;
    for (fails = 1; failed; fails++) {
        fixture f;
        perp__rigid_problem p;
        perp__rigid_answer a;

        m.calls = m.fails_at = 0;
        open_fixture(&f, 0, &settings);
        contacts = make_chain(&f.s, 11, 9, 0);
        p = chain_problem(&f.s, contacts);
        a = rigid_answer(&f.s);
        m.fails_at = m.calls + fails;
        failed = perp__rigid_solve(f.solver, &a, &p) == PERP_ERROR_MEMORY;
        m.fails_at = 0;
        assert_int_equal(solve(&f, &p).outcome, PERP_OUTCOME_SOLVED);
        m.calls = 0;
        solve(&f, &p);
        assert_int_equal(m.calls, 0);
        close_fixture(&f);
        assert_int_equal(m.live, 0);
    }
    assert_true(fails > 4); /* the arrays of rows and of the methods that it needs */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_chains),
        cmocka_unit_test(test_redundant_joints),
        cmocka_unit_test(test_memory),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
