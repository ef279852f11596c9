/* Compliant runs that go on: the lead screw reverses, stops and starts, against an integration of
 * its own equations and beside the rigid prediction; the belt, bounces and blocks in closed form.
 */
#include "screw.h"

#include "context.h"
#include "memory.h"

/* ---- the screw's equations in closed form, by steps of Runge and Kutta's method of order 4 ----
 */

typedef struct machine {
    double T, k, c;
    double y[4]; /* th, x, th', x' */
    int mode;    /* the sign of sliding; 0: sticks */
    int flank;   /* the sign of N when it last turned: stick does not change it */
    int stops, reversals, starts;
} machine;

static const double lead = 3.14159265358979323846 / 36;

static double normal_force(const machine *s, const double *y)
{
    return s->k * (r * y[0] * sin(lead) - y[1] * cos(lead)) +
           s->c * (r * y[2] * sin(lead) - y[3] * cos(lead));
}

static double sliding(const double *y)
{
    return r * y[2] * cos(lead) + y[3] * sin(lead);
}

/* The friction that keeps the thread from sliding: r cos th'' + sin x'' = 0. */
static double sticking(const machine *s, const double *y)
{
    const double N = normal_force(s, y);

    return (r * cos(lead) * (s->T - r * N * sin(lead)) / J + sin(lead) * (N * cos(lead) - W) / m) /
           (r * r * cos(lead) * cos(lead) / J + sin(lead) * sin(lead) / m);
}

static void rates(const machine *s, const double *y, double *rate)
{
    const double N = normal_force(s, y), F = s->mode ? s->mode * mu * fabs(N) : sticking(s, y);

    rate[0] = y[2];
    rate[1] = y[3];
    rate[2] = (s->T - r * N * sin(lead) - r * F * cos(lead)) / J;
    rate[3] = (N * cos(lead) - F * sin(lead) - W) / m;
}

static void advance(const machine *s, double h, double *to)
{
    static const double nodes[] = {0, 0.5, 0.5, 1}, weights[] = {1, 2, 2, 1};
    double y[4], rate[4] = {0}, sum[4] = {0};
    int i, stage;

    for (stage = 0; stage < 4; stage++) {
        for (i = 0; i < 4; i++)
            y[i] = s->y[i] + h * nodes[stage] * rate[i];
        rates(s, y, rate);
        for (i = 0; i < 4; i++)
            sum[i] += weights[stage] * rate[i] / 6;
    }
    for (i = 0; i < 4; i++)
        to[i] = s->y[i] + h * sum[i];
}

/* Roundings of 0; speeds are 1e-4 and more. */
static int slides_back(const machine *s, const double *y)
{
    return s->mode * sliding(y) < -1e-15;
}

/* Or comes to where |N| has a kink: stick does not pass that, and it costs slip its digits (N is
 * rounded to k eps th r = 1e-8). */
static int has_turned(const machine *s, const double *y)
{
    const double N = s->flank * normal_force(s, y);

    return s->mode ? slides_back(s, y) || N < -1e-7 : fabs(sticking(s, y)) > mu * N;
}

static void turn(machine *s)
{
    const double F = sticking(s, s->y);
    const int before = s->mode, holds = fabs(F) <= mu * fabs(normal_force(s, s->y));

    s->flank = normal_force(s, s->y) < 0 ? -1 : 1;
    if (before && !slides_back(s, s->y))
        return;
    s->mode = before && holds ? 0 : F > 0 ? 1 : -1;
    s->y[2] = -s->y[3] * tan(lead) / r; /* sliding is 0 but for roundings: those go */
    s->stops += before && !s->mode;
    s->starts += !before;
    s->reversals += before && s->mode;
}

static void integrate(machine *s, double span, double h)
{
    const double steps = ceil(span / h);
    double y[4], count;
    int k;

    for (count = 0; count < steps; count++) {
        double left = span / steps;

        for (advance(s, left, y); has_turned(s, y); advance(s, left, y)) {
            double low = 0, high = left;

            for (k = 0; k < 60; k++) {
                const double middle = 0.5 * (low + high);

                advance(s, middle, y);
                *(has_turned(s, y) ? &high : &low) = middle;
            }
            advance(s, high, s->y);
            turn(s);
            left -= high;
        }
        memcpy(s->y, y, sizeof y);
    }
}

/* ---- perp ------------------------------------------------------------------------------------ */

typedef struct ran {
    perp_compliant_result result;
    double x[4], v[4], N[2], F[2];
    int32_t modes[2];
} ran;

/* Through all events up to t_end. */
static ran run_through(perp_compliant *compliant, int32_t p, const double *x0, const double *v0,
                       double t_end)
{
    perp_compliant_settings settings = fresh_compliant_settings();
    ran out;
    int32_t k;

    perp_struct_init(&out.result, sizeof out.result);
    settings.through = 1;
    settings.tol = 1e-10;
    settings.most_steps = 20000; /* 4 times as many as are needed */
    assert_int_equal(
        perp_compliant_run(compliant, out.x, out.v, out.N, &out.result, &settings, x0, v0, t_end),
        PERP_OK);
    assert_int_equal(out.result.end, PERP_COMPLIANT_TIME);
    assert_true(out.result.t == t_end);
    for (k = 0; k < p; k++) {
        out.F[k] = out.result.friction[k];
        out.modes[k] = out.result.modes[k];
    }
    return out;
}

/* ---- the screw ------------------------------------------------------------------------------- */

/* The screw both ways from the same state, which becomes perp's: to ten times the tolerance of a
 * step, as errors decay but where it jams. */
static ran run_both(machine *s, double T, double span, double top)
{
    screw driven;
    ran out;
    int i;

    s->T = T;
    s->mode = (sliding(s->y) > 1e-12) - (sliding(s->y) < -1e-12);
    s->flank = normal_force(s, s->y) < 0 ? -1 : 1;
    if (!s->mode && has_turned(s, s->y))
        turn(s);
    s->stops = s->starts = s->reversals = 0;
    start_screw(&driven, T, s->k, s->c);
    out = run_through(driven.compliant, 1, s->y, s->y + 2, span);
    finish_screw(&driven);
    integrate(s, span, 2e-7);
    assert_int_equal(out.result.stops, s->stops);
    assert_int_equal(out.result.starts, s->starts);
    assert_int_equal(out.result.reversals, s->reversals);
    assert_int_equal(out.modes[0], s->mode ? PERP_CONTACT_SLIP : PERP_CONTACT_STICK);
    assert_true(fabs(out.v[0] - s->y[2]) <= 1e-9 * top);
    assert_true(fabs(out.v[1] - s->y[3]) <= 1e-9 * top * r);
    assert_true(fabs(out.x[0] - s->y[0]) <= 1e-9 * top * span);
    assert_true(fabs(out.N[0] - normal_force(s, s->y)) <= 1e-7 * W);
    for (i = 0; i < 2; i++) {
        s->y[i] = out.x[i];
        s->y[2 + i] = out.v[i];
    }
    return out;
}

/* The rigid acceleration where th' has the sign `sense` and N > 0 (side 1) or N < 0 (-1). */
static double rigid(double T, int sense, int side)
{
    const double k = tan(lead + side * sense * atan(mu));

    return (T - r * W * k) / (J + m * r * r * tan(lead) * k);
}

/* Turning forward it is driven backward, where no rigid acceleration exists: it jams, turns round
 * and runs backward as a rigid screw does; without a torque it jams again and holds; started anew
 * it runs forward. */
static void test_reverses_stops_and_starts(void **state)
{
    machine s = {0, 1e9, 1e5, {0}, 0, 1, 0, 0, 0};
    double before;
    ran out;

    (void)state;
    s.y[1] = -1 / s.k / cos(lead);
    s.y[2] = 10;
    s.y[3] = r * tan(lead) * 10;
    out = run_both(&s, -0.5, 0.005, 30);
    assert_int_equal(out.result.stops + out.result.reversals, 1);
    before = out.v[0];
    out = run_both(&s, -0.5, 0.005, 60); /* what the thread gives has settled: exp(-700) */
    assert_near((out.v[0] - before) / 0.005, rigid(-0.5, -1, -1), 1e-6);
    out = run_both(&s, 0, 0.02, 60);
    assert_int_equal(out.result.stops, 7); /* the jam's swings */
    assert_int_equal(out.modes[0], PERP_CONTACT_STICK);
    out = run_both(&s, 0, 0.03, 1); /* what sticks decays by exp(-1000 t) along the thread */
    assert_true(fabs(out.v[0]) < 1e-7 && fabs(out.v[1]) < 1e-9);
    assert_near(out.N[0], W * cos(lead), 1e-6);  /* J th'' = m x'' = 0 */
    assert_near(out.F[0], -W * sin(lead), 1e-6); /* within mu N: self-locking */
    out = run_both(&s, 0.4, 0.005, 4);
    before = out.v[0];
    out = run_both(&s, 0.4, 0.005, 8);
    assert_near((out.v[0] - before) / 0.005, rigid(0.4, 1, 1), 1e-6);
}

/* With a tenth of the damping the thread swings: stick, slip and stick again. */
static void test_swings(void **state)
{
    machine s = {0, 1e9, 1e4, {0}, 0, 1, 0, 0, 0};
    ran out;

    (void)state;
    s.y[1] = -1 / s.k / cos(lead);
    s.y[2] = 10;
    s.y[3] = r * tan(lead) * 10;
    out = run_both(&s, -0.5, 0.005, 10);
    assert_true(out.result.stops > 5);
    out = run_both(&s, 0, 0.01, 10);
    assert_int_equal(out.modes[0], PERP_CONTACT_STICK);
    out = run_both(&s, 0.4, 0.01, 10);
    assert_true(out.modes[0] == PERP_CONTACT_SLIP && out.v[0] > 3);
}

/* ---- closed forms ---------------------------------------------------------------------------- */

/* n coordinates, p contacts; all matrices row-major. */
static perp_compliant *posed(const perp_compliant_system *described, const double *mass,
                             const double *normal, const double *tangent)
{
    perp_compliant_system system = *described;
    perp_compliant *compliant;
    perp_matrix view[3];
    int k;

    for (k = 0; k < 3; k++)
        perp_struct_init(&view[k], sizeof view[k]);
    perp_matrix_dense(&view[0], PERP_STORAGE_ROW_MAJOR, system.n, system.n, mass, system.n);
    perp_matrix_dense(&view[1], PERP_STORAGE_ROW_MAJOR, system.contacts, system.n, normal,
                      system.n);
    perp_matrix_dense(&view[2], PERP_STORAGE_ROW_MAJOR, system.contacts, system.n, tangent,
                      system.n);
    system.mass = &view[0];
    system.normal = &view[1];
    system.tangent = &view[2];
    assert_int_equal(perp_compliant_create(context, &compliant, &system), PERP_OK);
    return compliant;
}

static perp_compliant_system describe_system(int32_t n, int32_t p, const double *force,
                                             const double *coefficients, double stiffness)
{
    perp_compliant_system system = fresh_compliant_system();

    system.n = n;
    system.contacts = p;
    system.force = force;
    system.mu = coefficients;
    system.stiffness = stiffness;
    return system;
}

/* The belt of theory.md (q): a block of weight 10 on a spring whose other end moves with V = 0.2.
 * Sticks for 2 (Fs - Fk) / (k V), slips for (2 / w) (pi - atan((Fs - Fk) w / (k V))). */
static void test_belt(void **state)
{
    const double mass[] = {1, 0, 0, 0, 1, 0, 0, 0, 1e12}, force[] = {0, -10, 0};
    const double normal[] = {0, -1, 0, 1, 0, -1}, tangent[] = {1, 0, 0, 0, 0, 0};
    const double kinetic[] = {0.3, 0}, breakaway[] = {0.5, 0};
    const double x0[] = {0, -0.1, 0}, v0[] = {0, 0, 0.2};
    const double slip = 0.47123889803846899, period = slip + 0.2, first = 0.25;
    perp_compliant_system system = describe_system(3, 2, force, kinetic, 100);
    perp_compliant *belt;
    ran out;

    (void)state;
    system.mu_static = breakaway;
    belt = posed(&system, mass, normal, tangent);
    out = run_through(belt, 2, x0, v0, first - 1e-6);
    assert_true(out.x[0] == 0 && out.v[0] == 0); /* exactly */
    assert_int_equal(out.modes[0], PERP_CONTACT_STICK);
    assert_near(out.F[0], 5, 1e-5); /* 1e-6 of 0.25 before the end */
    out = run_through(belt, 2, x0, v0, first + 7 * period + slip + 0.1);
    assert_int_equal(out.result.starts, 8);
    assert_int_equal(out.result.stops, 8);
    assert_true(out.v[0] == 0);
    /* 8 cycles of V period each; the driver's mass takes 1e-12 of it */
    assert_near(out.x[0], 8 * 0.2 * period, 1e-8);
    out = run_through(belt, 2, x0, v0, first + 7 * period + slip / 2);
    assert_int_equal(out.modes[0], PERP_CONTACT_SLIP);
    assert_near(out.v[0], 0.2 + hypot(0.2, 0.2), 1e-7); /* the fastest: V + hypot(V, (Fs-Fk) w/k) */
    perp_compliant_destroy(belt);
}

/* A mass dropped on a spring without damping: in flight for 2 u / g, pressed for
 * (2 / w) (pi - atan(u w / g)), for ever; while it presses, friction brakes it along the ground by
 * mu times the impulse 2 u each time, until it stops. */
static void test_bounces(void **state)
{
    const double mass[] = {1, 0, 0, 1}, normal[] = {0, -1}, tangent[] = {1, 0};
    const double force[] = {0, -10}, coefficient = 0.25, k = 1e4, u = 2, w = 100;
    const double x0[] = {0, 0}, v0[] = {3.5, 2};
    const double flight = 2 * u / 10, pressed = 2 / w * (pi - atan(u * w / 10));
    const int32_t sides = 1;
    perp_compliant_system system = describe_system(2, 1, force, &coefficient, k);
    perp_compliant *ball;
    ran out;

    (void)state;
    system.one_sided = &sides;
    ball = posed(&system, mass, normal, tangent);
    out = run_through(ball, 1, x0, v0, 3 * (flight + pressed) + flight / 2);
    assert_int_equal(out.result.releases, 3);
    assert_int_equal(out.modes[0], PERP_CONTACT_SEPARATE);
    assert_true(out.N[0] == 0 && out.F[0] == 0 && out.result.least_normal == 0);
    assert_near(out.x[1], u * u / 20, 1e-7);
    assert_true(fabs(out.v[1]) < 1e-6 * u);
    /* the impulse of N in a period is that of the weight */
    assert_near(out.v[0], 3.5 - 0.25 * 10 * 3 * (flight + pressed), 1e-7);
    out = run_through(ball, 1, x0, v0, 6 * (flight + pressed) + flight / 2);
    assert_true(out.v[0] == 0 && out.result.stops >= 1);
    perp_compliant_destroy(ball);
}

/* A block on two supports that carry 12 and 4, pulled along both: their friction is not determined
 * one by one; together they hold up to mu 16. */
static void test_two_supports(void **state)
{
    const double mass[] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, coefficients[] = {0.5, 0.5};
    const double normal[] = {0, -1, 1, 0, -1, -1}, tangent[] = {1, 0, 0, 1, 0, 0};
    const double x0[] = {0, -8, -4}, v0[] = {0, 0, 0}; /* stiffness 1: N = 8 -+ 4 */
    double force[] = {7.9, -16, -8};
    perp_compliant_system system = describe_system(3, 2, force, coefficients, 1);
    perp_compliant *block;
    ran out;

    (void)state;
    block = posed(&system, mass, normal, tangent);
    out = run_through(block, 2, x0, v0, 1);
    assert_near(out.N[0], 4, 1e-12);
    assert_near(out.N[1], 12, 1e-12);
    assert_true(out.v[0] == 0 && out.x[0] == 0);
    assert_near(out.F[0] + out.F[1], 7.9, 1e-12);
    assert_true(fabs(out.F[0]) <= 2 && fabs(out.F[1]) <= 6);
    perp_compliant_destroy(block);
    force[0] = 8.1;
    block = posed(&system, mass, normal, tangent);
    out = run_through(block, 2, x0, v0, 1);
    assert_near(out.v[0], 0.1, 1e-12);
    assert_int_equal(out.modes[0], PERP_CONTACT_SLIP);
    perp_compliant_destroy(block);
}

/* A block that bobs on a support, N = 8 + cos t, and a slot beside it that carries nothing: however
 * the two are told in order, the support alone holds the pull. */
static void test_nothing_holds_by_nothing(void **state)
{
    const double mass[] = {1, 0, 0, 1}, coefficients[] = {0.5, 0.5}, force[] = {3, -8};
    const double x0[] = {0, -9}, v0[] = {0, 0}, tangent[] = {1, 0, 1, 0}; /* stiffness 1 */

    (void)state;
    for (int32_t slot = 0; slot < 2; slot++) {
        const double normal[] = {0, slot == 0 ? 0 : -1, 0, slot == 0 ? -1 : 0};
        perp_compliant_system system = describe_system(2, 2, force, coefficients, 1);
        perp_compliant *block = posed(&system, mass, normal, tangent);
        const ran out = run_through(block, 2, x0, v0, 1);

        assert_true(out.v[0] == 0 && out.x[0] == 0);
        assert_true(out.N[slot] == 0 && out.F[slot] == 0);
        assert_near(out.F[1 - slot], 3, 1e-12);
        perp_compliant_destroy(block);
    }
}

/* A block on a block that is pulled, 16 against mu_static 20 = 10: as it breaks away only 4 is left
 * to hold it, the upper one would need 6, and mu_static 10 = 5: it slides, too. */
static void test_one_after_the_other(void **state)
{
    const double mass[] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}; /* x, y below; above */
    const double normal[] = {0, -1, 0, 0, 0, 1, 0, -1}, tangent[] = {1, 0, 0, 0, -1, 0, 1, 0};
    const double kinetic[] = {0.2, 0.2}, breakaway[] = {0.5, 0.5}, force[] = {16, -10, 0, -10};
    const double x0[] = {0, -0.02, 0, -0.03}, v0[] = {0, 0, 0, 0};
    perp_compliant_system system = describe_system(4, 2, force, kinetic, 1000);
    perp_compliant *blocks;
    ran out;

    (void)state;
    system.mu_static = breakaway;
    blocks = posed(&system, mass, normal, tangent);
    out = run_through(blocks, 2, x0, v0, 0.5);
    assert_near(out.v[0], (16 - 4 - 2) * 0.5, 1e-9); /* steps of 1e-10 */
    assert_near(out.v[2], 2 * 0.5, 1e-9);
    perp_compliant_destroy(blocks);
}

/* Released with speed under a ceiling that it reaches and leaves within what would be one step: it
 * does not go through. */
static void test_nothing_is_missed(void **state)
{
    const double mass = 1, normal = 1, tangent = 0, force = -1, none = 0;
    const double x0 = -0.5 + 1e-4, v0 = 1; /* up to 1e-4 in the ceiling without it */
    const int32_t sides = 1;
    perp_compliant_system system = describe_system(1, 1, &force, &none, 1e6);
    perp_compliant *ball;
    ran out;

    (void)state;
    system.one_sided = &sides;
    ball = posed(&system, &mass, &normal, &tangent);
    out = run_through(ball, 1, &x0, &v0, 3);
    assert_int_equal(out.result.releases, 1);
    /* energy stays; it comes back a little earlier than without the ceiling */
    assert_near(out.v[0] * out.v[0] / 2 + out.x[0], 1e-4, 1e-3);
    perp_compliant_destroy(ball);
}

/* A mass that sinks into its spring, y = -(g/k) (1 - exp(-10 t) (...)), in 20 pieces: the errors of
 * each are those beside what the whole run has seen, not beside swings that have died away. */
static void test_pieces(void **state)
{
    const double mass[] = {1, 0, 0, 1}, normal[] = {0, -1}, tangent[] = {1, 0};
    const double force[] = {0, -10}, coefficient = 0.25;
    enum { PIECES = 20 };
    const double x0[] = {0, 0}, v0[] = {0, 0};
    double x[2] = {0, 0}, v[2] = {0, 0};
    perp_compliant_system system = describe_system(2, 1, force, &coefficient, 1e4);
    perp_compliant_settings settings = fresh_compliant_settings();
    perp_compliant_result result = fresh_compliant_result();
    perp_compliant *block;
    int64_t steps = 0;
    ran whole;

    (void)state;
    system.damping = 20;
    block = posed(&system, mass, normal, tangent);
    settings.through = settings.resume = 1; /* the first run has none to go on from */
    settings.tol = 1e-10;
    for (int k = 0; k < PIECES; k++) {
        assert_int_equal(
            perp_compliant_run(block, x, v, NULL, &result, &settings, x, v, 4.0 / PIECES), PERP_OK);
        settings.first_step = result.next_step;
        steps += result.steps;
    }
    whole = run_through(block, 1, x0, v0, 4);
    assert_true(steps <= whole.result.steps + 3 * PIECES); /* to end there, and to grow again */
    assert_near(x[1], -10 / 1e4, 1e-9);
    settings.resume = 2;
    assert_int_equal(perp_compliant_run(block, x, v, NULL, &result, &settings, x, v, 1),
                     PERP_ERROR_ARGUMENT);
    perp_compliant_destroy(block);
}

/* Over a spring at rest, its context destroyed: a mass of 2 under 20 slides v^2 / (2 mu g) and is
 * held there, by a solver that is made when it stops. */
static void test_outlives_the_handle_of_its_context(void **state)
{
    const double mass[] = {2, 0, 0, 2}, normal[] = {0, -1}, tangent[] = {1, 0};
    const double force[] = {0, -20}, coefficient = 0.25;
    const double x0[] = {0, -20 / 1e6}, v0[] = {-3, 0};
    const perp_compliant_system system = describe_system(2, 1, force, &coefficient, 1e6);
    perp_compliant *block = posed(&system, mass, normal, tangent);
    ran out;

    perp_context_destroy(context);
    out = run_through(block, 1, x0, v0, 2);
    assert_int_equal(out.modes[0], PERP_CONTACT_STICK);
    assert_near(out.x[0], -9 / (2 * 0.25 * 10), 1e-9); /* an event's time is known to 1e-10 */
    perp_compliant_destroy(block);
    assert_int_equal(make(state), 0);
}

static void test_refused(void **state)
{
    const double x0[] = {0, 0}, v0[] = {0, 0}, lower = 0.1;
    const int32_t neither = 2;
    perp_compliant_settings through = fresh_compliant_settings();
    perp_compliant_result result = fresh_compliant_result();
    perp_compliant *other = NULL;
    double x[2], v[2];
    screw s;

    (void)state;
    start_screw(&s, 0.4, 1e9, 1e5);
    through.through = 2;
    assert_int_equal(perp_compliant_run(s.compliant, x, v, NULL, &result, &through, x0, v0, 1),
                     PERP_ERROR_ARGUMENT);
    s.system.mu_static = &lower;
    assert_int_equal(perp_compliant_create(s.context, &other, &s.system), PERP_ERROR_ARGUMENT);
    s.system.mu_static = NULL;
    s.system.one_sided = &neither;
    assert_int_equal(perp_compliant_create(s.context, &other, &s.system), PERP_ERROR_ARGUMENT);
    finish_screw(&s);
}

/* What runs from rest take: memory at the first of them alone. */
static perp_status everything(const perp_context_settings *settings)
{
    const double x0[] = {0, 0}, v0[] = {0, 0};
    const memory *used = settings->allocator_user;
    perp_compliant_settings through = fresh_compliant_settings();
    perp_compliant_result result = fresh_compliant_result();
    double x[2] = {7, 7}, v[2];
    screw s = {0};
    perp_status status = perp_context_create(&s.context, settings);

    through.through = 1;
    describe_screw(&s, 0.4, 1e9, 1e5);
    if (status == PERP_OK)
        status = perp_compliant_create(s.context, &s.compliant, &s.system);
    if (status == PERP_OK)
        status = perp_compliant_run(s.compliant, x, v, NULL, &result, &through, x0, v0, 1e-4);
    assert_true((x[0] == 7) == (status != PERP_OK));
    if (status == PERP_OK) {
        const int before = used->calls;

        (void)run_through(s.compliant, 1, x0, v0, 1e-4);
        assert_int_equal(used->calls, before);
    }
    finish_screw(&s);
    return status;
}

static void test_memory(void **state)
{
    (void)state;
    memory_fails_anywhere(everything, 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_reverses_stops_and_starts),
        cmocka_unit_test(test_swings),
        cmocka_unit_test(test_belt),
        cmocka_unit_test(test_bounces),
        cmocka_unit_test(test_two_supports),
        cmocka_unit_test(test_nothing_holds_by_nothing),
        cmocka_unit_test(test_one_after_the_other),
        cmocka_unit_test(test_nothing_is_missed),
        cmocka_unit_test(test_pieces),
        cmocka_unit_test(test_outlives_the_handle_of_its_context),
        cmocka_unit_test(test_refused),
        cmocka_unit_test(test_memory),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
