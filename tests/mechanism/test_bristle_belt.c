/* A mass on a spring, on a belt: stick-slip. With forces 5 at breakaway and 3 in motion, m = 1,
 * k = 100 and a belt of 0.2, it sticks for 2 (5 - 3) / (k V) = 0.2 and slips for
 * (2/w)(pi - atan((5 - 3) w / (k V))) = 0.47123889803846899, w = sqrt(k/m). Stribeck's and LuGre's
 * laws have that period in the limit of a small speed and stiff bristles. */
#include <math.h>

#include "suite.h"

#include <perp/mechanism.h>

#define STIFFNESS 100.0
#define BELT 0.2
#define PERIOD 0.67123889803846899

static perp_bristle law_of(double speed, double stiffness, double damping)
{
    perp_bristle law = fresh_bristle();

    law.kinetic = 3;
    law.breakaway = 5;
    law.speed = speed;
    law.stiffness = stiffness;
    law.damping = damping;
    return law;
}

/* ---- Stribeck: the slip is integrated, the stick is a straight line ------------------------- */

static double acceleration(const perp_bristle *law, double x, double v)
{
    double force;

    assert_int_equal(perp_stribeck_force(NULL, &force, NULL, law, v - BELT), PERP_OK);
    return -STIFFNESS * x - force;
}

/* From breakaway until the mass has the belt's velocity again: time, and where. At v = V
 * forces are in balance, unstably: x' = V takes the mass away from there. */
static double slip_time(const perp_bristle *law, double *x)
{
    double v = BELT * (1 - 1e-9), t = 0, h, k1, k2, k3, k4, w2, w3, w4, v_next;

    *x = law->breakaway / STIFFNESS;
    for (;;) {
        h = fmin(1e-4, 0.02 * law->speed);
        k1 = acceleration(law, *x, v);
        w2 = v + h / 2 * k1;
        k2 = acceleration(law, *x + h / 2 * v, w2);
        w3 = v + h / 2 * k2;
        k3 = acceleration(law, *x + h / 2 * w2, w3);
        w4 = v + h * k3;
        k4 = acceleration(law, *x + h * w3, w4);
        v_next = v + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
        if (v_next >= BELT && t > 0.1)
            return t + h * (BELT - v) / (v_next - v);
        *x += h / 6 * (v + 2 * w2 + 2 * w3 + w4);
        v = v_next;
        t += h;
    }
}

static double stribeck_period(double speed)
{
    const perp_bristle law = law_of(speed, 0, 0);
    double x, time = slip_time(&law, &x);

    return time + (law.breakaway / STIFFNESS - x) / BELT;
}

static void test_stribeck(void **state)
{
    double error[3];
    int k;

    (void)state;
    for (k = 0; k < 3; k++)
        error[k] = fabs(stribeck_period(1e-2 / (1 << (2 * k))) - PERIOD);
    /* The forces differ where the speed is below a few times `speed`, for times in proportion to
     * its root (x leaves like t): each quarter halves the error, or better. */
    assert_true(error[1] < 0.6 * error[0] && error[2] < 0.6 * error[1]);
    assert_true(error[2] < 0.01 * PERIOD);
}

/* ---- LuGre: no events, an implicit midpoint rule for the mass, exact steps for the bristles -- */

typedef struct mass {
    double x, v, z;
} mass;

/* m (v+ - v) = -h k (x + h u / 2) - h F(u - V), u = (v + v+) / 2, by Newton's method. */
static void advance(mass *m, const perp_bristle *law, double h)
{
    double u = m->v, next = 0, force, slope, residual;
    int k;

    for (k = 0; k < 50; k++) {
        assert_int_equal(perp_lugre_step(NULL, &next, &force, &slope, law, m->z, u - BELT, h),
                         PERP_OK);
        residual = 2 * (u - m->v) + h * STIFFNESS * (m->x + h / 2 * u) + h * force;
        if (fabs(residual) <= 1e-14)
            break;
        u -= residual / (2 + h * h / 2 * STIFFNESS + h * slope);
    }
    m->x += h * u;
    m->v += 2 * (u - m->v);
    m->z = next;
}

/* The mean of the periods between passes of x upwards through its middle, after the first two. */
static double lugre_period(const perp_bristle *law, double h, double *low, double *high)
{
    const double middle = 3 / STIFFNESS;
    mass m = {0, BELT, 0};
    double t = 0, first = 0, before;
    int passes = 0;

    *low = INFINITY;
    *high = -INFINITY;
    for (;;) {
        before = m.x;
        advance(&m, law, h);
        t += h;
        if (passes > 1) {
            *low = fmin(*low, m.x);
            *high = fmax(*high, m.x);
        }
        if (before < middle && m.x >= middle) {
            const double pass = t - h * (m.x - middle) / (m.x - before);

            if (++passes == 2)
                first = pass;
            else if (passes == 5)
                return (pass - first) / 3;
        }
    }
}

static void test_lugre(void **state)
{
    double error[4], low, high;
    perp_bristle law;
    int k;

    (void)state;
    for (k = 0; k < 4; k++) {
        /* bristles damped like a tenth of critical, 2 sqrt(stiffness m) / 10 */
        const double stiffness = 1e4 * (1 << (4 * k));

        law = law_of(1e-2 / (1 << (2 * k)), stiffness, 0.2 * sqrt(stiffness));
        error[k] = fabs(lugre_period(&law, 2e-4 / (1 << k), &low, &high) - PERIOD);
        /* as above; bristles that are 16 times as stiff bend a sixteenth as far */
        assert_true(k == 0 || error[k] < 0.6 * error[k - 1]);
    }
    assert_true(error[3] < 0.01 * PERIOD);
    /* 0.03 -+ 0.02 sqrt(2), where the mass turns with Coulomb's two forces */
    assert_true(fabs(low - (0.03 - 0.02 * sqrt(2))) < 0.01 * 0.06);
    assert_true(fabs(high - (0.03 + 0.02 * sqrt(2))) < 0.01 * 0.06);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_stribeck),
                                       cmocka_unit_test(test_lugre)};

    return cmocka_run_group_tests(tests, NULL, NULL);
}
