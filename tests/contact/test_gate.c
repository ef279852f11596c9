/* What a good outcome promises: every contact right beside its own terms, finite numbers; and what
 * limits promise: that they hold, and that what was met by then is returned. */
#include <math.h>
#include <stdlib.h>

#include "suite.h"

#include <perp/perp.h>

#include "piles.h"
#include "run.h"

#include "context.h"

static const int32_t methods[] = {PERP_CONTACT_METHOD_AUTO, PERP_CONTACT_METHOD_SWEEP,
                                  PERP_CONTACT_METHOD_NEWTON, PERP_CONTACT_METHOD_LEMKE};

enum { METHODS = sizeof methods / sizeof *methods, MOST = 10 };

static int32_t is_good(int32_t outcome)
{
    return outcome == PERP_OUTCOME_SOLVED || outcome == PERP_OUTCOME_ROUNDING_LIMIT;
}

/* ---- contacts beside their own terms --------------------------------------------------------- */

/* A tower of boxes without friction, contact k under body k, on W of contacts: what lies on contact
 * k is M_k = m_k + ... + m_(n-1), and at rest r_k = M_k g h. */
typedef struct tower {
    int32_t n;
    double mass[MOST], W[MOST * MOST], q[MOST], r[MOST], u[MOST];
    int32_t modes[MOST];
    perp_contact_settings settings;
    perp_contact_result result;
} tower;

#define FALL 0.1 /* g h */

static void build(tower *t)
{
    int32_t k;

    for (k = 0; k < t->n * t->n; k++)
        t->W[k] = 0.0;
    for (k = 0; k < t->n; k++) {
        t->W[k + k * t->n] = 1.0 / t->mass[k] + (k > 0 ? 1.0 / t->mass[k - 1] : 0.0);
        if (k > 0)
            t->W[k + (k - 1) * t->n] = t->W[k - 1 + k * t->n] = -1.0 / t->mass[k - 1];
        t->q[k] = k == 0 ? -FALL : 0.0;
    }
    assert_int_equal(perp_contact_settings_init(&t->settings, sizeof t->settings), 0);
    assert_int_equal(perp_struct_init(&t->result, sizeof t->result), 0);
}

static void solve(tower *t, const double *r0)
{
    const perp_matrix W = run_dense(t->W, t->n);
    perp_contact_laws laws = fresh_contact_laws();

    laws.contacts = t->n;
    laws.dim = 1;
    assert_int_equal(perp_contact_solve(context, ANSWER(NULL, t->r, t->u, t->modes), &t->result,
                                        &t->settings, DELASSUS(&laws, &W, t->q), r0),
                     PERP_OK);
}

static double weight_on(const tower *t, int32_t k)
{
    double sum = 0.0;

    for (; k < t->n; k++)
        sum += t->mass[k];
    return sum * FALL;
}

/* A contact on W_00 = 1e-24 whose tangential velocity of 1 nothing can change, beside a bilateral
 * row that nothing moves: that velocity is no excuse for a row at 1.07 instead of 0 (s = -1.07). */
static void test_what_pressing_answers_to(void **state)
{
    static const double entries[16] = {1e-24, 0, 0, -1e-12, 0,      0, 0, 0,
                                       0,     0, 0, 0,      -1e-12, 0, 0, 1};
    static const double q[4] = {0, 1, 2, 1.07};
    const perp_matrix W = run_dense(entries, 4);

    (void)state;
    for (size_t m = 0; m < METHODS; m++) {
        perp_contact_settings settings = fresh_contact_settings();
        perp_contact_result result = fresh_contact_result();
        perp_contact_laws laws = fresh_contact_laws();
        double r[4], u[4];

        settings.method = methods[m];
        laws.contacts = laws.bilateral = 1;
        assert_int_equal(perp_contact_solve(context, ANSWER(NULL, r, u), &result, &settings,
                                            DELASSUS(&laws, &W, q), NULL),
                         PERP_OK);
        assert_true(!is_good(result.outcome) ||
                    fabs(-1e-12 * r[0] + r[3] + 1.07) <= 1e-7); /* ten times tol */
    }
}

/* Two contacts without friction on one body in the plane, or on W. */
typedef struct pair {
    double mass[3], H[6], f[3]; /* H: row by row */
    double W[4], q[2];
    double r[2], u[2], v[3];
    perp_contact_result result;
} pair;

static void solve_pair(pair *p, int32_t method, const double *r0)
{
    static const int32_t starts[] = {0, 1, 2, 3}, places[] = {0, 1, 2};
    static const double w[2] = {0};
    const int32_t by_W = p->W[0] > 0.0;
    const perp_matrix W = run_dense(p->W, 2);
    perp_contact_dynamics dynamics = fresh_contact_dynamics();
    perp_contact_settings settings = fresh_contact_settings();
    perp_contact_laws laws = fresh_contact_laws();
    perp_matrix M, H;

    assert_int_equal(perp_struct_init(&p->result, sizeof p->result), 0);
    M = matrix_csc(3, 3, starts, places, p->mass);
    H = matrix_rows(p->H, 2, 3);
    laws.contacts = 2;
    laws.dim = 1;
    settings.method = method;
    settings.tol = 1e-8;
    dynamics.n = 3;
    dynamics.M = &M;
    dynamics.H = &H;
    if (by_W)
        assert_int_equal(perp_contact_solve(context, ANSWER(NULL, p->r, p->u), &p->result,
                                            &settings, DELASSUS(&laws, &W, p->q), r0),
                         PERP_OK);
    else
        assert_int_equal(perp_contact_solve(context, ANSWER(p->v, p->r, p->u), &p->result,
                                            &settings, DYNAMICS(&laws, &dynamics, p->f, w), r0),
                         PERP_OK);
}

/* A contact that closes with 1, on a body another coordinate of which carries 1e15: nothing of the
 * one reaches the other. Nor does much from a contact that departs with 5e15 and whose coupling is
 * 1e-5. Without its impulse of 1 it is off by all that it is made of. */
static void test_closing_beside_large_numbers(void **state)
{
    static const double r0[] = {1e15, 0.0};

    (void)state;
    for (size_t m = 0; m < METHODS; m++) {
        pair body = {.mass = {1, 1, 1}, .H = {1, 0, 0, 0, 1, 0}, .f = {-1e15, -1, 0}};
        pair matrix = {.W = {1, 1e-5, 1e-5, 1}, .q = {5e15, -1}};

        solve_pair(&body, methods[m], r0);
        assert_true(!is_good(body.result.outcome) || fabs(body.r[1] - 1) <= 1e-7);
        solve_pair(&matrix, methods[m], NULL);
        assert_true(!is_good(matrix.result.outcome) || fabs(matrix.r[1] - 1) <= 1e-7);
        if (methods[m] == PERP_CONTACT_METHOD_AUTO)
            assert_true(is_good(body.result.outcome) && is_good(matrix.result.outcome));
    }
}

/* Both contacts hold two coordinates of a body at rest, one of mass 1e-12 and one of 1. What W says
 * of the impulses is what the light one says, their sum; the difference, 0.06, moves the heavy one,
 * and v has to tell it: M v = f + H'r in each coordinate. */
static void test_momentum_of_the_heavy(void **state)
{
    static const double r0[] = {1.03, 0.97};

    (void)state;
    for (size_t m = 0; m < METHODS; m++) {
        pair p = {.mass = {1e-12, 1, 1}, .H = {1, -1, 0, 1, 1, 0}, .f = {-2, 0, 0}};

        solve_pair(&p, methods[m], r0);
        assert_true(is_good(p.result.outcome));
        for (int32_t i = 0; i < 3; i++) {
            const double moves = p.mass[i] * p.v[i], push = p.H[i] * p.r[0] + p.H[3 + i] * p.r[1];

            /* 10 tol and rounding of the terms, which are 2 */
            assert_true(fabs(moves - p.f[i] - push) <= 1e-6);
        }
    }
}

/* The same of three random contacts that press by some 1 on masses of 1 and from 1 down to 1e-16,
 * from starts that balance the light one alone: zeros take no more of the heavy one's momentum. */
static void test_momentum_beside_any_mass(void **state)
{
    static const int32_t starts[] = {0, 1, 2}, places[] = {0, 1};
    static const double w[3] = {0};

    (void)state;
    for (uint64_t seed = 1; seed <= 300; seed++) {
        perp_contact_dynamics dynamics = fresh_contact_dynamics();
        perp_contact_settings settings = fresh_contact_settings();
        perp_contact_laws laws = fresh_contact_laws();
        double mass[2] = {1.0}, H[6], f[2] = {0.0}, r0[3], r[3], u[3], v[2];
        perp_matrix M, rows;
        gen_random random;

        gen_seed(&random, seed);
        mass[1] = pow(10.0, -gen_integer(&random, 17));
        for (int32_t k = 0; k < 3; k++) {
            r0[k] = gen_uniform(&random, 0.0, 2.0);
            H[2 * k] = gen_normal(&random);
            H[2 * k + 1] = gen_integer(&random, 2) ? 1.0 : -1.0;
            f[1] -= H[2 * k + 1] * r0[k];
        }
        f[0] = gen_normal(&random);
        M = matrix_csc(2, 2, starts, places, mass);
        rows = matrix_rows(H, 3, 2);
        laws.contacts = 3;
        laws.dim = 1;
        dynamics.n = 2;
        dynamics.M = &M;
        dynamics.H = &rows;
        for (size_t m = 0; m < METHODS; m++) {
            perp_contact_result result = fresh_contact_result();

            settings.method = methods[m];
            assert_int_equal(perp_contact_solve(context, ANSWER(v, r, u), &result, &settings,
                                                DYNAMICS(&laws, &dynamics, f, w), r0),
                             PERP_OK);
            if (is_good(result.outcome))
                assert_true(fabs(v[0] - f[0] - H[0] * r[0] - H[2] * r[1] - H[4] * r[2]) <= 1e-6);
        }
    }
}

/* A grain of 1e-9 kg on a block of 1e9 kg: without its impulse, or with ten times that, nothing in
 * the units of the block is wrong by 1e-8, and the grain is at u_n = -0.1 or 0.9 m/s. Such a start
 * is no answer. Of r, 1e-6 is what velocities right to 1e-8 leave. */
static void test_grain_on_a_block(void **state)
{
    static const double starts[] = {0.0, 10.0};
    int32_t m, s;

    (void)state;
    for (m = 0; m < METHODS; m++)
        for (s = 0; s < 2; s++) {
            tower t = {.n = 2, .mass = {1e9, 1e-9}};
            double r0[2];

            build(&t);
            t.settings.method = methods[m];
            r0[0] = 1e9 * FALL + 1e-9 * FALL * starts[s];
            r0[1] = 1e-9 * FALL * starts[s];
            solve(&t, r0);
            assert_true(is_good(t.result.outcome));
            assert_true(fabs(t.r[1] / (1e-9 * FALL) - 1.0) <= 1e-6);
        }
}

/* Towers with masses from 1e9 down to 1e-9: an answer called good has every impulse right, not the
 * largest alone. With the heavy below the terms of a velocity are some g h; right to 1e-8 of that
 * for each contact they leave r_k right to n times as much, as W^-1 adds up the masses on k. */
static void test_mixed_towers(void **state)
{
    int32_t good = 0, m, k;
    uint64_t seed;

    (void)state;
    for (seed = 1; seed <= 100; seed++)
        for (m = 0; m < METHODS; m++) {
            gen_random random;
            tower t = {.n = 0};

            gen_seed(&random, seed);
            t.n = 2 + gen_integer(&random, MOST - 1);
            for (k = 0; k < t.n; k++)
                t.mass[k] = pow(10.0, 9 - 18 * (k + gen_uniform(&random, 0, 1)) / t.n);
            build(&t);
            t.settings.method = methods[m];
            solve(&t, NULL);
            if (!is_good(t.result.outcome))
                continue;
            good += methods[m] == PERP_CONTACT_METHOD_AUTO;
            for (k = 0; k < t.n; k++)
                assert_true(fabs(t.r[k] / weight_on(&t, k) - 1.0) <= 1e-6);
        }
    assert_int_equal(good, 100); /* pivoting finds all of them */
}

/* ---- limits ---------------------------------------------------------------------------------- */

typedef struct watch {
    int64_t last[8], calls; /* by method: the last count seen; in all */
    int64_t stop_at;        /* calls; 0: never */
} watch;

static int32_t look(const perp_contact_progress *progress, void *user)
{
    watch *w = user;

    w->last[progress->method] = progress->iterations;
    return ++w->calls == w->stop_at;
}

static perp_contact_result solve_pile(const piles *p, const perp_contact_settings *settings)
{
    double *v = gen_allocate((size_t)p->n, sizeof *v),
           *r = gen_allocate((size_t)p->rows, sizeof *r);
    perp_contact_result result;

    assert_int_equal(piles_solve(context, p, settings, &result, v, r, NULL, NULL), PERP_OK);
    for (int32_t i = 0; i < p->n; i++)
        assert_true(isfinite(v[i]));
    free(v);
    free(r);
    return result;
}

static void make_pile(piles *p)
{
    piles_options o = piles_defaults();

    o.class = PILES_BALLS;
    o.contacts = 60;
    o.motion = PILES_IMPACT;
    o.mass_ratio = 100;
    piles_make(p, &o);
}

static perp_contact_settings settings_of(int32_t method, int32_t limit)
{
    perp_contact_settings settings = piles_settings(method, 1e-14); /* more than can be had */

    settings.max_iterations = limit;
    return settings;
}

/* A method takes no more than its limit, and the polish no more than as many steps. */
static void test_iterations_hold(void **state)
{
    static const int32_t limits[] = {1, 2, 3, 7, 20, 60, 150};
    piles p;

    (void)state;
    make_pile(&p);
    for (size_t k = 0; k < sizeof limits / sizeof *limits; k++) {
        perp_contact_settings settings = settings_of(PERP_CONTACT_METHOD_SWEEP, limits[k]);

        assert_true(solve_pile(&p, &settings).iterations <= 2 * limits[k]);
        settings = settings_of(PERP_CONTACT_METHOD_NEWTON, limits[k]);
        assert_true(solve_pile(&p, &settings).iterations <= 2 * limits[k]);
    }
    piles_destroy(&p);
}

/* On more rows than are polished there is nothing beside the method. A limit falls into each of its
 * stages: alternating directions, Newton's steps, the path. */
static void test_proximal_holds(void **state)
{
    piles_options o = piles_defaults();
    piles p;

    (void)state;
    o.class = PILES_BALLS;
    o.contacts = 210;
    o.mass_ratio = 1e4;
    piles_make(&p, &o);
    assert_true(p.rows > 600);
    for (int32_t limit = 1; limit <= 120; limit += limit < 40 ? 1 : 40) {
        const perp_contact_settings settings = settings_of(PERP_CONTACT_METHOD_NEWTON, limit);

        assert_true(solve_pile(&p, &settings).iterations <= limit);
    }
    piles_destroy(&p);
}

/* Sweeps that end at the tested residual go on where a contact's own is not there yet: without that
 * these five stall, none of them at its limit. */
static void test_sweeps_go_on(void **state)
{
    static const struct {
        uint64_t seed;
        int32_t contacts;
    } drawn[] = {{4000003, 21}, {4000063, 15}, {4000181, 54}, {4000242, 48}, {4000266, 19}};

    (void)state;
    for (size_t k = 0; k < sizeof drawn / sizeof *drawn; k++) {
        const piles_options o = piles_draw(drawn[k].seed, drawn[k].contacts);
        perp_contact_settings settings = settings_of(PERP_CONTACT_METHOD_SWEEP, 0);
        piles p;

        settings.tol = 1e-3;
        piles_make(&p, &o);
        assert_int_equal(solve_pile(&p, &settings).outcome, PERP_OUTCOME_SOLVED);
        piles_destroy(&p);
    }
}

/* Iterations are those of all that ran: at least what the monitor saw of each method. */
static void test_iterations_of_all(void **state)
{
    perp_contact_settings settings = settings_of(PERP_CONTACT_METHOD_AUTO, 0);
    piles_options o = piles_defaults();
    watch w = {{0}, 0, 0};
    perp_contact_result result;
    int64_t seen = 0;
    int32_t m;
    piles p;

    (void)state;
    o.class = PILES_WALL; /* hit, it is too much for a hundred sweeps */
    o.contacts = 300;
    o.motion = PILES_IMPACT;
    o.mu = 1.0;
    piles_make(&p, &o);
    settings.monitor = look;
    settings.monitor_user = &w;
    result = solve_pile(&p, &settings);
    for (m = 0; m < (int32_t)(sizeof w.last / sizeof *w.last); m++)
        seen += w.last[m];
    assert_true(w.last[PERP_CONTACT_METHOD_SWEEP] > 0);
    assert_true(w.last[PERP_CONTACT_METHOD_PROXIMAL] > 0);
    assert_true(result.iterations >= seen);
    piles_destroy(&p);
}

/* A time that is over leaves one step of the method that is first, no more. */
static void test_no_time(void **state)
{
    piles p;

    (void)state;
    make_pile(&p);
    for (int32_t m = 0; m < METHODS; m++) {
        perp_contact_settings settings = settings_of(methods[m], 0);
        perp_contact_result result;

        settings.time_limit = 1e-12;
        result = solve_pile(&p, &settings);
        assert_int_equal(result.outcome, PERP_OUTCOME_TIME_LIMIT);
        assert_true(result.iterations <= 1);
    }
    piles_destroy(&p);
}

/* An interior point method that is cut short hands over where it is, not where it began. */
static void test_cut_short(void **state)
{
    perp_contact_settings settings = settings_of(PERP_CONTACT_METHOD_NEWTON, 0);
    perp_contact_result result;
    watch w = {{0}, 0, 1};
    double begun;
    piles p;

    (void)state;
    make_pile(&p);
    settings.monitor = look;
    settings.monitor_user = &w;
    begun = solve_pile(&p, &settings).residual;
    w.calls = 0;
    w.stop_at = 12; /* steps of which each but the first few halves the residual */
    result = solve_pile(&p, &settings);
    assert_int_equal(result.outcome, PERP_OUTCOME_STOPPED);
    assert_true(result.residual <= 0.1 * begun);
    piles_destroy(&p);
}

/* Walls that close on a body: the proof that there are no velocities is not begun with a budget
 * that is used up. */
static void test_no_proof_without_budget(void **state)
{
    (void)state;
    for (int32_t limit = 0; limit <= 1; limit++) {
        tower t = {.n = 2, .mass = {1.0, 1.0}};

        build(&t);
        t.W[0] = t.W[3] = 1.0;
        t.W[1] = t.W[2] = -1.0;
        t.q[0] = t.q[1] = -1.0;
        t.settings.method = PERP_CONTACT_METHOD_SWEEP;
        t.settings.max_iterations = limit;
        solve(&t, NULL);
        assert_int_equal(t.result.outcome, limit ? PERP_OUTCOME_ITERATION_LIMIT : PERP_OUTCOME_RAY);
        assert_int_equal(t.result.has_ray, !limit);
    }
}

/* ---- numbers out of range -------------------------------------------------------------------- */

/* Impulses of 1e400 are none. */
static void test_impulse_out_of_range(void **state)
{
    (void)state;
    for (int32_t m = 0; m < METHODS; m++) {
        tower t = {.n = 1, .mass = {1e200}};

        build(&t);
        t.q[0] = -1e200;
        t.settings.method = methods[m];
        solve(&t, NULL);
        assert_false(is_good(t.result.outcome));
        assert_true(isfinite(t.r[0]) && isfinite(t.u[0]));
    }
}

/* Contact 1 presses by q_1 = -1.5e308, which adds half of that to the 1.5e308 at which contact 0
 * opens anyway: 2.25e308 is no velocity, and what leaves so fast lacks nothing of its law. */
static void test_velocity_out_of_range(void **state)
{
    (void)state;
    for (int32_t m = 0; m < METHODS; m++) {
        tower t = {.n = 2, .mass = {1.0, 1.0}};

        build(&t);
        t.W[0] = t.W[3] = 1.0;
        t.W[1] = t.W[2] = 0.5;
        t.q[0] = 1.5e308;
        t.q[1] = -1.5e308;
        t.settings.method = methods[m];
        solve(&t, NULL);
        assert_false(is_good(t.result.outcome));
    }
}

/* Where omega itself is, that is said. */
static void test_omega_out_of_range(void **state)
{
    const double W[] = {1e-300}, q[] = {-1e300};
    const perp_matrix view = run_dense(W, 1);
    double r[1] = {77.0}, u[1];
    perp_contact_result result = fresh_contact_result();
    perp_contact_laws laws = fresh_contact_laws();

    (void)state;
    laws.contacts = 1;
    laws.dim = 1;
    assert_int_equal(perp_contact_solve(context, ANSWER(NULL, r, u), &result, NULL,
                                        DELASSUS(&laws, &view, q), NULL),
                     PERP_ERROR_NOT_FINITE);
    assert_string_equal(perp_context_message(context),
                        "contact 0: omega, the largest |q| / sqrt(t) of its part, is inf");
    assert_true(r[0] == 77.0);
}

/* ---- right sides of rounding ----------------------------------------------------------------- */

/* Five joints in four velocities, three of the rows made of the other two: impulses answer to two
 * numbers alone. b = -G v0 leaves them nothing to do but what rounding makes of five sums, which
 * contradict each other: no answer is nearer than 16 eps of the terms. A contradiction of 1e-9 is
 * none of rounding's. */
static void test_joints_of_rounding(void **state)
{
    static const double tols[] = {1e-3, 1e-8, 1e-12}, mass[] = {0.3, 2.0, 7.0, 40.0};
    static const double v0[] = {0.1, -0.7, 1.3, 0.9}, w[1] = {0};
    static const int32_t starts[] = {0, 1, 2, 3, 4}, rows[] = {0, 1, 2, 3};
    double G[20] = {0.1, 0.2, -0.7, 0.3, 1.1, -0.6, 0.4, 0.9}, f[4], b[5], v[4], s[5];
    perp_contact_dynamics dynamics = fresh_contact_dynamics();
    perp_contact_settings settings = fresh_contact_settings();
    perp_contact_solver *solver;
    perp_contact_result result = fresh_contact_result();
    perp_contact_laws laws = fresh_contact_laws();
    perp_matrix M, H, view;

    (void)state;
    for (int32_t i = 0; i < 4; i++) {
        G[8 + i] = 0.1 * G[i] + 0.7 * G[4 + i];
        G[12 + i] = 0.3 * G[i] - 1.7 * G[4 + i];
        G[16 + i] = -0.9 * G[i] + 0.2 * G[4 + i];
        f[i] = mass[i] * v0[i];
    }
    for (int32_t i = 0; i < 5; i++)
        b[i] = -(G[4 * i] * v0[0] + G[4 * i + 1] * v0[1] + G[4 * i + 2] * v0[2] +
                 G[4 * i + 3] * v0[3]);
    M = matrix_csc(4, 4, starts, rows, mass);
    H = matrix_rows(w, 0, 4);
    view = matrix_rows(G, 5, 4);
    laws.bilateral = 5;
    dynamics.n = 4;
    dynamics.M = &M;
    dynamics.H = &H;
    dynamics.G = &view;
    for (int32_t k = 0; k < 6; k++) {
        const int32_t contradicts = k >= 3;

        settings.tol = tols[k % 3];
        b[2] += k == 3 ? 1e-9 : 0.0;
        assert_int_equal(perp_contact_solver_create(context, &solver, &settings), PERP_OK);
        assert_int_equal(perp_contact_solver_setup_dynamics(solver, &laws, &dynamics), PERP_OK);
        assert_int_equal(
            perp_contact_solver_solve_dynamics(solver, ANSWER(v, s), &result, f, w, b, NULL),
            PERP_OK);
        assert_int_equal(is_good(result.outcome), !contradicts);
        for (int32_t i = 0; i < 4 && !contradicts; i++) /* a few roundings */
            assert_true(fabs(v[i] - v0[i]) <= 64 * 2.2e-16);
        perp_contact_solver_destroy(solver);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_what_pressing_answers_to),
        cmocka_unit_test(test_closing_beside_large_numbers),
        cmocka_unit_test(test_momentum_of_the_heavy),
        cmocka_unit_test(test_momentum_beside_any_mass),
        cmocka_unit_test(test_grain_on_a_block),
        cmocka_unit_test(test_mixed_towers),
        cmocka_unit_test(test_iterations_hold),
        cmocka_unit_test(test_proximal_holds),
        cmocka_unit_test(test_sweeps_go_on),
        cmocka_unit_test(test_iterations_of_all),
        cmocka_unit_test(test_no_time),
        cmocka_unit_test(test_cut_short),
        cmocka_unit_test(test_no_proof_without_budget),
        cmocka_unit_test(test_impulse_out_of_range),
        cmocka_unit_test(test_velocity_out_of_range),
        cmocka_unit_test(test_omega_out_of_range),
        cmocka_unit_test(test_joints_of_rounding),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
