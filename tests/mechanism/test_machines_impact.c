/* Impacts: a ball that bounces, chains of balls under the three laws, a rocking block. */
#include "rig.h"

/* Bounces infinitely often until t0 (1 + e) / (1 - e). Steps stop bouncing at speeds below g h, and
 * the ball lies still to the last bit. Each impact loses up to 2 g h of speed (the flight of steps
 * is one step shorter, and the speed at the start of the last one counts), so 4 h of the flight
 * that follows and, with those after it, 4 h / (1 - e): first order in h, times the number of
 * impacts, a logarithm of h. */
static void test_ball(void **state)
{
    static const double restitutions[] = {0.5, 0.8, 0.9};
    const double t0 = sqrt(2 / MACHINE_GRAVITY);
    double h;
    int k;

    (void)state;
    for (k = 0; k < 3; k++)
        for (h = 4e-3; h > 2e-4; h /= 4) {
            const double e = restitutions[k], rest = t0 * (1 + e) / (1 - e);
            double slack, path = 0, next = t0, flight = 2 * t0 * e, rests = 0;
            int impacts = 0;
            rig r;

            rig_open(&r, MACHINE_BALL);
            r.machine.restitution[0] = e;
            rig_start(&r);
            while (r.t < 1.2 * rest) {
                const double before = r.q[0];

                rig_step(&r, h);
                path += fabs(r.q[0] - before);
                if (r.step.impacts > 0) {
                    impacts++;
                    if (impacts < 10) /* 4 h of each flight, for all flights so far */
                        near(r.t, next, impacts * (impacts + 1) * 2 * h, "impact");
                    next += flight;
                    flight *= e;
                }
                if (r.v[0] != 0.0 || r.q[0] > 0.0)
                    rests = r.t;
            }
            slack = 4 * h / (1 - e) * (impacts + 1);
            near(rests, rest, slack, "rest");
            near(path, (1 + e * e) / (1 - e * e), 5 * slack, "path"); /* at up to 4.43 */
            assert_true(impacts >= 5);
            assert_true(r.v[0] == 0.0 && r.q[0] == 0.0);
            rig_close(&r);
        }
}

/* All laws that treat the chain at once agree: (1 + e)/n - e, and (1 + e)/n for all others. None of
 * them gives what a row of steel balls does. */
static void hit_chains(int32_t scheme)
{
    static const int32_t names[] = {MACHINE_CHAIN_3, MACHINE_CHAIN_5, MACHINE_CHAIN_UNLIKE},
                         laws[] = {PERP_MECHANISM_MOREAU, PERP_MECHANISM_NEWTON,
                                   PERP_MECHANISM_POISSON, PERP_MECHANISM_STRONGE};
    static const double restitutions[] = {0, 0.5, 1};
    int a, b, k;
    int32_t i;

    for (a = 0; a < 3; a++)
        for (b = 0; b < 4; b++)
            for (k = 0; k < 3; k++) {
                const double e = restitutions[k];
                double total = 0, moment = 0, first;
                int32_t n;
                rig r;

                rig_open(&r, names[a]);
                r.settings.scheme = scheme;
                r.settings.law = laws[b];
                n = r.machine.model.velocities;
                for (i = 0; i + 1 < n; i++)
                    r.machine.restitution[i] = e;
                rig_start(&r);
                rig_step(&r, 1e-3);
                for (i = 0; i < n; i++) {
                    total += r.machine.data.mass.mass[i];
                    moment += r.machine.data.mass.mass[i] * r.v[i];
                }
                first = (1 + e) / total - e;
                near(r.v[0], first, 1e-10, "first"); /* tol */
                for (i = 1; i < n; i++)
                    near(r.v[i], (1 + e) / total, 1e-10, "others");
                near(moment, 1, 1e-10, "momentum");
                assert_int_equal(r.step.impacts, e > 0);
                rig_close(&r);
            }
}

static void test_chains(void **state)
{
    int32_t scheme;

    (void)state;
    for (scheme = PERP_MECHANISM_FROZEN; scheme <= PERP_MECHANISM_THETA; scheme++)
        hit_chains(scheme);
}

/* A block comes down on its other corner without gravity: one step, exact at any length. */
static void land(rig *r, double width, double height, double mu, double h)
{
    rig_open(r, MACHINE_BLOCK);
    r->machine.data.body.gravity[1] = 0;
    r->machine.data.body.inertia = (width * width + height * height) / 3;
    r->machine.data.body.along[0] = -width;
    r->machine.data.body.along[1] = width;
    r->machine.data.body.across[0] = r->machine.data.body.across[1] = -height;
    r->machine.mu[0] = r->machine.mu[1] = mu;
    r->machine.q[0] = r->machine.q[2] = 0;
    r->machine.q[1] = height;
    r->machine.v[0] = height; /* spin -1 about the left corner */
    r->machine.v[1] = -width;
    r->machine.v[2] = -1;
    rig_start(r);
    rig_step(r, h);
}

/* Housner: what is left of the spin is 1 - 3/2 sin^2 a, where friction holds the new corner. */
static void test_housner(void **state)
{
    static const double rows[][3] = {{0.2, 0.94230769230769231, 0.148514851485148515},
                                     {0.5, 0.7, 0.352941176470588235},
                                     {1.0, 0.25, 0.6},
                                     {1.4, 1 - 1.5 * 1.96 / 2.96, 0}};
    double h;
    int k, more;

    (void)state;
    for (k = 0; k < 4; k++)
        for (h = 1; h > 1e-7; h /= 1000)
            for (more = 0; more < 2; more++) {
                const double needed = 3 * rows[k][0] / (rows[k][0] * rows[k][0] + 4);
                rig r;

                if (rows[k][2] > 0) /* 3 s c / (1 + 3 c^2), tan = b / h */
                    near(needed, rows[k][2], 1e-15, "mu needed");
                land(&r, rows[k][0] * 0.5, 0.5, needed * (more ? 1.001 : 0.999), h);
                if (more) {
                    near(r.v[2], -rows[k][1], 1e-14, "spin after");
                    assert_int_equal(r.modes[1], PERP_MECHANISM_STICK);
                    assert_true(r.velocity[2] == 0.0 && r.velocity[3] == 0.0);
                } else
                    assert_int_equal(r.modes[1], PERP_MECHANISM_SLIP);
                assert_true(r.impulse[0] == 0.0 && r.impulse[1] == 0.0);
                near(r.velocity[0], -rows[k][0] * r.v[2], 1e-14, "old corner lifts"); /* 2 b spin */
                rig_close(&r);
            }
}

/* Wider than high times sqrt 2 it stops dead: the old corner would have to be pulled at. */
static void test_dead_stop(void **state)
{
    static const double ratios[] = {1.41, 1.42, 2, 10};
    int k;

    (void)state;
    for (k = 0; k < 4; k++) {
        rig r;

        land(&r, 0.5 * ratios[k], 0.5, 10, 1e-3);
        assert_int_equal(rig_rests(&r), ratios[k] >= sqrt(2.0));
        rig_close(&r);
    }
}

/* Half a swing, an impact, and up the other side. First order; errors grow about as cosh(p t), p =
 * 3.8, which is 3.4 at the end, times accelerations of 3. */
static void test_rocking(void **state)
{
    double h;

    (void)state;
    for (h = 4e-3; h > 1e-4; h /= 4) {
        double spin = 0, at = 0;
        rig r;

        rig_open(&r, MACHINE_BLOCK);
        rig_start(&r);
        while (r.t < r.machine.end - h / 2) {
            const double before = r.v[2];

            rig_step(&r, h);
            if (r.t < 0.3 + h / 2)
                near(r.q[2], r.t < 0.3 - h / 2 ? r.q[2] : 0.0275328293629887746, 2 * h, "at 0.3");
            if (at == 0 && r.impulse[2] > 0) {
                at = r.t;
                near(before, -machine_value(&r.machine, "spin before"), 4 * h, "spin before");
            }
            if (at > 0 && r.t < at + 1.5 * h)
                spin = r.v[2]; /* of the step after: the first leaves gap / h of the approach */
        }
        near(at, machine_value(&r.machine, "first impact"), 2 * h, "first impact");
        near(spin, -machine_value(&r.machine, "spin after"), 10 * h, "spin after");
        near(r.q[2], machine_value(&r.machine, "angle"), 4 * h, "angle");
        near(r.v[2], machine_value(&r.machine, "spin"), 12 * h, "spin");
        assert_true(r.step.penetration < 1e-15);
        rig_close(&r);
    }
}

/* Energy of the rod, m = 1, I = 1/3; once it has grown, by the largest share. */
static int32_t watch_energy(const perp_mechanism_view *view, void *user)
{
    double *energy = user; /* at first, and the largest growth */
    const double now = 0.5 * (view->v[0] * view->v[0] + view->v[1] * view->v[1]) +
                       view->v[2] * view->v[2] / 6 + MACHINE_GRAVITY * view->q[1];

    energy[1] = fmax(energy[1], (now - energy[0]) / energy[0]);
    energy[0] = fmin(energy[0], now);
    return 0;
}

/* The rod falls on its tip and bounces, e = 1, in steps of chosen error: impacts that end in
 * sticking or turn the slip round take energy, none adds any. */
static void test_rod_bounces(void **state)
{
    int k, lost = 0;

    (void)state;
    for (k = 0; k < 12; k++) {
        const double error = 1e-7, angle = 0.7 + 0.15 * k;
        perp_mechanism_run_result result = fresh_mechanism_run_result();
        double q[3], v[3], energy[2] = {INFINITY, -1}, first;
        rig r;

        rig_open(&r, MACHINE_ROD);
        r.settings.scheme = PERP_MECHANISM_THETA;
        r.settings.law = PERP_MECHANISM_STRONGE;
        r.settings.error = error;
        r.machine.mu[0] = r.machine.mu_static[0] = 0.1 * k;
        r.machine.restitution[0] = 1;
        r.machine.q[0] = 0;
        r.machine.q[1] = sin(angle) + 0.3;
        r.machine.q[2] = angle;
        r.machine.v[0] = 1 - 0.2 * k;
        r.machine.v[1] = 0;
        r.machine.v[2] = 0.5;
        first = 0.5 * r.machine.v[0] * r.machine.v[0] + 0.25 / 6 + MACHINE_GRAVITY * r.machine.q[1];
        energy[0] = first;
        rig_start(&r);
        assert_int_equal(perp_mechanism_run(r.mechanism, q, v, &result, START(0, 1e-3, r.q, r.v),
                                            0.5, watch_energy, energy),
                         PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
        assert_true(energy[1] < 100 * error); /* of the flight's steps */
        if (k == 0)
            near(energy[0] / first, 1, 100 * error, "energy without friction");
        lost += energy[0] < (1 - 1e-3) * first;
        rig_close(&r);
    }
    assert_true(lost > 6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rod_bounces), cmocka_unit_test(test_ball),
        cmocka_unit_test(test_chains),      cmocka_unit_test(test_housner),
        cmocka_unit_test(test_dead_stop),   cmocka_unit_test(test_rocking),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
