/* All accelerations of the machines beside their steps: fingers that jam, pegs that wedge, and
 * that a short step follows an answer wherever there is one. */
#include "rig.h"

/* The answers of the rig's state. */
static perp_mechanism_summary ask(rig *r)
{
    perp_mechanism_summary summary = fresh_mechanism_summary();

    if (perp_mechanism_accelerations(r->mechanism, &summary, r->t, r->q, r->v) != PERP_OK)
        fail_msg("%s: %s", r->machine.name, perp_context_message(r->context));
    assert_int_equal(summary.exhaustive, 1);
    return summary;
}

static perp_mechanism_found answer(rig *r, int32_t index)
{
    perp_mechanism_found found = fresh_mechanism_found();

    assert_int_equal(perp_mechanism_get_acceleration(r->mechanism, &found, index), PERP_OK);
    return found;
}

/* Pressed down: one acceleration for mu < cot(angle), else none; lifted: one (it lifts off), else
 * two (or it slides on, pressed by its own friction, and that is not stable). */
static void test_finger(void **state)
{
    static const double angles[] = {30, 63, 64, 80};
    int k, lifted;

    (void)state;
    for (k = 0; k < 4; k++)
        for (lifted = 0; lifted < 2; lifted++) {
            const double angle = angles[k] * MACHINE_PI / 180, mu = 0.5,
                         lever = 0.5 * (cos(angle) - mu * sin(angle)), torque = lifted ? -1 : 1;
            const int jams = lever < 0;
            perp_mechanism_summary summary;
            rig r;

            rig_open(&r, MACHINE_FINGER);
            r.machine.q[1] = angle;
            r.machine.data.finger.height = 0.5 * sin(angle);
            r.machine.data.finger.torque = torque;
            rig_start(&r);
            summary = ask(&r);
            assert_int_equal(summary.count, lifted ? 1 + jams : 1 - jams);
            assert_int_equal(summary.reason,
                             jams ? PERP_MECHANISM_NEGATIVE_INERTIA : PERP_MECHANISM_ALWAYS_ONE);
            if (lifted) {
                const perp_mechanism_found off = answer(&r, 0);

                assert_int_equal(off.stable, 1);
                assert_true(off.force[0] == 0.0);
                near(off.acceleration[1], -1 / 0.02, 1e-11, "lifts off");
            }
            if (summary.count == 1 + lifted) { /* the one that slides */
                const perp_mechanism_found slides = answer(&r, lifted);

                assert_int_equal(slides.stable, !lifted);
                near(slides.force[0], torque / lever, 1e-9, "normal force");
                near(slides.acceleration[0], 1 - mu * torque / lever, 1e-9, "acceleration");
                near(slides.acceleration[1], 0, 1e-9, "keeps its angle");
            }
            rig_close(&r);
        }
}

/* Opens a peg at rest that touches at two points. */
static void open_peg(rig *r, double depth, int32_t one, int32_t other, double across, double along,
                     double moment)
{
    rig_open(r, MACHINE_PEG);
    machine_touch_peg(&r->machine, one, other);
    r->machine.q[1] = -depth;
    r->machine.data.peg.load[0] = across;
    r->machine.data.peg.load[1] = along;
    r->machine.data.peg.load[2] = moment * r->machine.data.peg.radius;
    rig_start(r);
}

/* Whether rest is among the answers. */
static int may_rest(rig *r)
{
    const perp_mechanism_summary summary = ask(r);
    int32_t k;

    for (k = 0; k < summary.count; k++) {
        const perp_mechanism_found found = answer(r, k);

        if (found.acceleration[0] == 0.0 && found.acceleration[1] == 0.0 &&
            found.acceleration[2] == 0.0)
            return 1;
    }
    return 0;
}

/* Deeper than mu times the diameter nothing holds a peg that is pulled out straight; above, the
 * line through two opposite points lies in both cones, and it may be stuck: a family of forces. */
static void test_peg_wedges(void **state)
{
    static const double depths[] = {0.012, 0.0041, 0.0039, 0.001};
    static const int32_t pairs[2][2] = {{0, 3}, {1, 2}};
    int k, i, pulled;

    (void)state;
    for (k = 0; k < 4; k++)
        for (i = 0; i < 2; i++)
            for (pulled = 0; pulled < 2; pulled++) {
                int wedges;
                rig r;

                open_peg(&r, depths[k], pairs[i][0], pairs[i][1], 0, pulled ? 1 : -1, 0);
                wedges = depths[k] <= machine_value(&r.machine, "wedges to depth");
                assert_int_equal(may_rest(&r), wedges);
                if (wedges) /* and may move all the same */
                    assert_true(ask(&r).count >= 2);
                rig_close(&r);
            }
}

/* Whitney's diagram again: rest is an answer of some pair exactly outside of it, and the step
 * takes it wherever it is one. */
static void test_peg_diagram(void **state)
{
    static const int32_t pairs[4][2] = {{0, 3}, {1, 2}, {0, 2}, {1, 3}};
    const double mu = 0.2, lambda = 3;
    int a, b, k;

    (void)state;
    for (a = -7; a <= 7; a++)
        for (b = -14; b <= 14; b++) {
            const double across = 0.999 * a, moment = 0.999 * b + 0.01;
            const int slides =
                fabs(moment + mu * (1 + lambda) * across) < lambda && fabs(across) < 1 / mu;
            int rests = 0;

            for (k = 0; k < 4; k++) {
                rig r;
                int may;

                open_peg(&r, 0.012, pairs[k][0], pairs[k][1], across, -1, moment);
                may = may_rest(&r);
                rests = rests || may;
                rig_step(&r, 1e-4);
                if (rig_rests(&r) != may)
                    fail_msg("load (%g, %g), points %d and %d: rest is %s answer, the step %s",
                             across, moment, (int)pairs[k][0], (int)pairs[k][1], may ? "an" : "no",
                             may ? "moves" : "rests");
                rig_close(&r);
            }
            if (rests == slides)
                fail_msg("load (%g, %g): should %s", across, moment, slides ? "slide" : "jam");
        }
}

/* Whether a step's change of velocity over h is an answer's acceleration, to `tolerance`. */
static int is_answer(rig *r, int32_t count, const double *change, double tolerance)
{
    int32_t k, i;

    for (k = 0; k < count; k++) {
        const perp_mechanism_found found = answer(r, k);
        double distance = 0;

        for (i = 0; i < r->machine.model.velocities; i++)
            distance = fmax(distance, fabs(change[i] - found.acceleration[i]));
        if (distance <= tolerance || found.free > 0)
            return 1;
    }
    return 0;
}

/* From the start of every machine, where no impact comes first and answers exist, a short step in
 * each scheme goes along one of them: to first order in h, with accelerations up to 200 here. */
static void test_steps_follow(void **state)
{
    const double h = 1e-7;
    int32_t name, scheme, i, asked = 0;

    (void)state;
    for (name = 0; name < MACHINES; name++)
        for (scheme = PERP_MECHANISM_FROZEN; scheme <= PERP_MECHANISM_THETA; scheme++) {
            perp_mechanism_summary summary;
            double change[MACHINE_ROOM];
            rig r;

            rig_open(&r, name);
            if (r.machine.model.contacts > 12) { /* more than are enumerated */
                perp_context_destroy(r.context);
                continue;
            }
            r.settings.scheme = scheme;
            rig_start(&r);
            summary = ask(&r);
            rig_step(&r, h);
            for (i = 0; i < r.machine.model.velocities; i++)
                change[i] = (r.v[i] - r.machine.v[i]) / h;
            if (!summary.impact && summary.count > 0) {
                asked++;
                /* velocities up to 200 carry roundings of 3e-14, over h */
                if (!is_answer(&r, summary.count, change, 1e-4))
                    fail_msg("%s, %s: no answer is (%g, %g, %g)", r.machine.name,
                             perp_mechanism_scheme_text(scheme), change[0], change[1], change[2]);
            } else if (summary.count == 0 && !summary.impact) /* Painleve: at once */
                assert_true(fabs(change[0]) * h > 0.1);
            rig_close(&r);
        }
    assert_true(asked > 60);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_finger),
        cmocka_unit_test(test_peg_wedges),
        cmocka_unit_test(test_peg_diagram),
        cmocka_unit_test(test_steps_follow),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
