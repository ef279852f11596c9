/* Contacts that hold both ways: proofs that there is no answer, compliance, refusals of what does
 * not go with them, and memory. */
#include <math.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

#include "memory.h"
#include "two_sided.h"

static perp_status call(both_problem *p, both_rig *g, both_answer *a)
{
    return perp_contact_solve(
        both_context, ANSWER(a->v, a->r, a->u, a->modes, a->ray), &a->result, &g->settings,
        DYNAMICS(&g->laws, &g->dynamics, p->f, p->w, p->w + p->rows + p->bounded), NULL);
}

/* A body on two pins whose holes part along their second normals, by `speed`. */
static void build_torn(both_problem *p, double speed)
{
    memset(p, 0, sizeof *p);
    both_add(p, 2, 3, 0.3);
    both_add(p, 2, 3, 0.3);
    p->size = p->rows;
    p->n = 3;
    for (int i = 0; i < 3; i++)
        p->M[i * MOST + i] = 1.0 + i;
    for (int k = 0; k < 2; k++) {
        p->H[3 * k * MOST] = p->H[(3 * k + 1) * MOST + 1] = p->H[(3 * k + 2) * MOST + 2] = 1.0;
        p->w[3 * k] = 0.25; /* both holes go to the left */
    }
    p->w[4] = speed;
    both_form(p);
}

/* The proof is y = +-(e_1 - e_4), and any of e_0 - e_3: equal pins push on one another, and only
 * the second normals say so. Sweeps, unlike pivots, come across no ray themselves. */
static void test_ray(void **state)
{
    static const double speeds[] = {1.0, -1.0, 1e-3, 0.0};
    (void)state;
    for (int s = 0; s < 4; s++)
        for (int way = 0; way < 6; way++) {
            const int32_t method = way % 2 ? PERP_CONTACT_METHOD_SWEEP : 0;
            both_problem p;
            both_answer a;
            build_torn(&p, speeds[s]);
            if (way < 4)
                both_by_dynamics(&p, method, way / 2, NULL, &a);
            else
                both_by_delassus(&p, method, NULL, &a);
            if (speeds[s] == 0.0) {
                assert_true(both_is_good(&a));
                continue;
            }
            assert_int_equal(a.result.outcome, PERP_OUTCOME_RAY);
            assert_int_equal(a.result.certificate, PERP_CONTACT_CERTIFICATE_INFEASIBLE);
            assert_true(a.ray[1] == -a.ray[4] && a.ray[4] * speeds[s] < 0.0);
            assert_true(a.ray[0] == -a.ray[3] && a.ray[2] == 0.0 && a.ray[5] == 0.0);
        }
}

/* A mass m pushed by f_n against a guide of compliance c, beside it by f_t: u_N = v_n + c r_N = 0,
 * so that r_N = -f_n / (1 + m c), whatever its sign, and v_t = (f_t - mu |r_N|) / m. */
static void test_compliance(void **state)
{
    const double m = 2.0, c[] = {0.25, 0.0}, mu = 0.5, along = 30.0;
    (void)state;
    for (int method = 0; method < 4; method++)
        for (double push = -10.0; push <= 10.0; push += 20.0) {
            const double N = -push / (1.0 + m * c[0]);
            both_problem p;
            both_answer a;
            both_rig g;
            memset(&p, 0, sizeof p);
            both_add(&p, 1, 2, mu);
            p.n = p.size = 2;
            p.M[0] = p.M[MOST + 1] = m;
            p.H[0] = p.H[MOST + 1] = 1.0;
            p.f[0] = push;
            p.f[1] = along;
            both_set(&p, method, 0, &g, &a);
            g.laws.compliance = c;
            assert_int_equal(call(&p, &g, &a), PERP_OK);
            both_require_solved(&a, (uint64_t)method);
            /* tol 1e-10 of numbers of size 10 */
            assert_true(fabs(a.r[0] - N) <= 1e-9 && fabs(a.r[1] + mu * fabs(N)) <= 1e-9);
            assert_true(fabs(a.v[0] + c[0] * N) <= 1e-9 && a.u[0] == 0.0);
            assert_true(fabs(a.v[1] - (along - mu * fabs(N)) / m) <= 1e-9);
        }
}

static void require_message(const char *text)
{
    if (!strstr(perp_context_message(both_context), text))
        fail_msg("'%s' without '%s'", perp_context_message(both_context), text);
}

static void test_refusals(void **state)
{
    const double turning[2] = {0.0, 0.125};
    (void)state;
    for (int kind = 0; kind < 3; kind++) {
        both_problem p;
        both_answer a;
        both_rig g;
        build_torn(&p, 0.0);
        both_set(&p, 0, 0, &g, &a);
        g.laws.rolling = kind == 0 ? turning : NULL;
        g.laws.spinning = kind == 1 ? turning : NULL;
        g.settings.cone = kind == 2 ? 6 : 0;
        assert_int_equal(call(&p, &g, &a), PERP_ERROR_ARGUMENT);
        require_message(kind == 0   ? "laws.rolling[1] is 0.125, but contact 1 holds both ways"
                        : kind == 1 ? "laws.spinning[1] is 0.125, but contact 1 holds both ways"
                                    : "settings.cone is 6, expected 0");
    }
}

/* ---- memory --------------------------------------------------------------------------------- */

enum { KINDS = 5 };

/* auto, proximal, lemke; derivatives; a proof. */
static perp_status run(int kind, both_answer *a)
{
    static const int32_t methods[KINDS] = {0, PERP_CONTACT_METHOD_PROXIMAL,
                                           PERP_CONTACT_METHOD_LEMKE, 0, 0};
    perp_contact_sensitivity *s = NULL;
    perp_contact_sensitivity_info info = fresh_contact_sensitivity_info();
    both_problem p;
    both_rig g;
    perp_status status;
    memset(&p, 0, sizeof p);
    both_seed = 12;
    both_add(&p, 2, 4, 0.4);
    both_add(&p, 1, 2, 0.7);
    both_add(&p, 0, 3, 0.5);
    both_fill(&p, 1, 0, 0);
    if (kind == 4)
        build_torn(&p, 1.0);
    both_set(&p, methods[kind], 0, &g, a);
    a->result.outcome = 77;
    if (kind != 3)
        return call(&p, &g, a);
    status = perp_contact_sensitivity_create(both_context, &s, &info, &g.settings,
                                             DYNAMICS(&g.laws, &g.dynamics, p.f, p.w), a->r);
    if (status == PERP_OK)
        perp_contact_sensitivity_destroy(s);
    else
        assert_null(s);
    return status;
}

static void test_every_allocation_may_fail(void **state)
{
    perp_context *outer = both_context;
    (void)state;
    for (int kind = 0; kind < KINDS; kind++) {
        memory m = {0, 0, 0};
        perp_context_settings settings = memory_settings(&m);
        both_answer a, again;
        int count;
        assert_int_equal(perp_context_create(&both_context, &settings), PERP_OK);
        m.calls = 0;
        assert_int_equal(run(kind, &a), PERP_OK);
        count = m.calls;
        assert_true(count > 0);
        for (int k = 1; k <= count; k++) {
            const int live = m.live;
            m.calls = 0;
            m.fails_at = k;
            if (run(kind, &again) != PERP_ERROR_MEMORY)
                fail_msg("kind %d: allocation %d of %d may fail unnoticed", kind, k, count);
            m.fails_at = 0;
            assert_int_equal(again.result.outcome, 77);
            assert_int_equal(m.live, live);
        }
        assert_int_equal(run(kind, &again), PERP_OK); /* as good as before */
        assert_memory_equal(again.r, a.r, sizeof a.r);
        perp_context_destroy(both_context);
        assert_int_equal(m.live, 0);
    }
    both_context = outer;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ray),
        cmocka_unit_test(test_compliance),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_every_allocation_may_fail),
    };
    return cmocka_run_group_tests(tests, both_make, both_destroy);
}
