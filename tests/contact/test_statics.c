/* Equilibrium against closed forms, on both sides of each limit. Whatever the verdict, the answer
 * is checked from the caller's own data (statics_case.h). */
#include <math.h>
#include <stdio.h>

#include "suite.h"

#include "statics_case.h"

#include "context.h"

static statics_case one;
static const double pi = 3.14159265358979323846;

/* Stands just below the limit and falls just above. */
static void require_edge(const char *name, double factor, double side)
{
    char text[160];

    snprintf(text, sizeof text, "%.99s at %.12g", name, factor);
    case_require(text, &one, context, side < 0.0 ? PERP_STATICS_STANDS : PERP_STATICS_FALLS);
}

static double between(gen_random *random, double least, double most)
{
    return least * pow(most / least, gen_uniform(random, 0.0, 1.0));
}

/* ---- one body ---- */

/* A box on a slope of any direction slides where tan > mu, whatever its size, mass and heading. Its
 * height is such that it does not tip: the resultant stays within half of the inscribed circle. */
static void make_slope(gen_random *random, double mu, double slope, double mass)
{
    const double x = between(random, 1e-2, 1e2), y = x * between(random, 0.2, 5.0);
    const double height = 0.5 * fmin(x, y) / slope * gen_uniform(random, 0.1, 1.0);
    const double heading = gen_uniform(random, -pi, pi), g = 9.81 * mass / hypot(1.0, slope);
    double R[3][3], normal[3] = {0.0, 0.0, 1.0};
    double pull[3] = {g * slope * cos(heading), g * slope * sin(heading), -g};
    int32_t k;

    gen_rotation(random, 0, R);
    gen_turn(R, normal);
    gen_turn(R, pull);
    case_begin(&one, 6, 1);
    memcpy(one.f, pull, sizeof pull);
    for (k = 0; k < 4; k++) {
        double p[3] = {k & 1 ? x : -x, k & 2 ? y : -y, -height};

        gen_turn(R, p);
        case_contact_at(&one, 0, CASE_GROUND, p, normal, gen_uniform(random, -pi, pi), mu, 0, 0);
    }
}

static void test_slope(void **state)
{
    gen_random random;
    char name[96];
    int32_t i;

    (void)state;
    gen_seed(&random, 28);
    for (i = 0; i < 2000; i++) {
        const double mu = between(&random, 0.05, 5.0), mass = between(&random, 1e-6, 1e6);
        const double side = i & 1 ? 1e-9 : -1e-9;

        make_slope(&random, mu, mu * (1.0 + side), mass);
        snprintf(name, sizeof name, "slope %d, mu %.17g, mass %g", (int)i, mu, mass);
        require_edge(name, 1.0 + side, side);
    }
}

/* A box of any size with a corner in front of which it tips, pushed at some height; safety. */
static void test_tipping(void **state)
{
    gen_random random;
    int32_t i;

    (void)state;
    gen_seed(&random, 3);
    for (i = 0; i < 200; i++) {
        const double half = between(&random, 1e-2, 1e2), weight = between(&random, 1e-6, 1e6);
        const double height = half * between(&random, 0.5, 20.0), side = i & 1 ? 1e-9 : -1e-9;
        const double most = weight * half / height, mu = 1.5 * half / height;

        case_begin(&one, 6, 1);
        one.center[0][2] = height; /* where it is pushed; the weight has no moment about that */
        case_corners(&one, 0, CASE_GROUND, 0.0, 0.0, 0.0, half, half, mu);
        one.f[2] = -weight;
        one.load[i & 2 ? 0 : 1] = most * (1.0 + side);
        one.loaded = 1;
        require_edge("tipping", 1.0 + side, side);
        if (!(fabs(one.result.safety * (1.0 + side) - 1.0) <= 1e-8))
            fail_msg("tipping %d: safety %.12g", (int)i, one.result.safety);
    }
}

/* A ladder on a floor with friction mu, against a wall with friction nu: tan of its angle is at
 * least (1 - mu nu) / (2 mu). */
static void test_ladder(void **state)
{
    int32_t i;

    (void)state;
    for (i = 0; i < 60; i++) {
        const double mu = 0.1 + 0.04 * (i % 15), nu = (i / 15) * 0.2, side = i & 1 ? 1e-9 : -1e-9;
        const double x = 1.0, y = (1.0 - mu * nu) / (2.0 * mu) * (1.0 - side);

        case_begin(&one, 3, 1);
        one.center[0][0] = x / 2;
        one.center[0][1] = y / 2;
        case_contact(&one, 0, CASE_GROUND, 0, 0, 0, 0, 1, 0, mu);
        case_contact(&one, 0, CASE_GROUND, x, y, 0, -1, 0, 0, nu > 0.0 ? nu : -1.0);
        one.f[1] = -3.0;
        require_edge("ladder", 1.0 - side, side);
    }
}

/* A ball rolls where the slope is above rolling / radius, slides where it is above mu, and turns on
 * its point where a moment is above spinning times its weight; in the plane the same. */
static void test_rolling(void **state)
{
    const double p[3] = {0, 0, -2.0}, q[3] = {0, -2.0, 0}, normal[3] = {0, 0, 1}, up[3] = {0, 1, 0};
    int32_t i;

    (void)state;
    for (i = 0; i < 64; i++) {
        const double side = i & 1 ? 1e-9 : -1e-9, factor = 1.0 + side, heading = 0.1 * i;

        case_begin(&one, 6, 1);
        case_contact_at(&one, 0, CASE_GROUND, p, normal, heading, 0.5, i & 2 ? 0.2 : 2.0, 0.0);
        one.f[0] = 7.0 * factor * cos(3.0 * heading) * (i & 2 ? 0.1 : 0.5);
        one.f[1] = 7.0 * factor * sin(3.0 * heading) * (i & 2 ? 0.1 : 0.5);
        one.f[2] = -7.0;
        require_edge("rolling", factor, side);

        case_begin(&one, 6, 1);
        case_contact_at(&one, 0, CASE_GROUND, p, normal, heading, 0.5, i & 2 ? 0.2 : 0.0, 0.03);
        one.f[2] = -7.0;
        one.f[5] = (i & 4 ? -0.21 : 0.21) * factor;
        require_edge("spinning", factor, side);

        case_begin(&one, 3, 1);
        case_contact_at(&one, 0, CASE_GROUND, q, up, 0.0, 0.5, i & 2 ? 0.2 : 2.0, 0.0);
        one.f[0] = (i & 4 ? -7.0 : 7.0) * factor * (i & 2 ? 0.1 : 0.5);
        one.f[1] = -7.0;
        require_edge("rolling in the plane", factor, side);
    }
}

/* Beads on wires: dry friction, a motor, a stop, a given force, and nothing at all. */
static void test_bounds(void **state)
{
    const double forces[] = {3.0, -1.5, 40.0, -2.0};
    int32_t i, k;

    (void)state;
    for (i = 0; i < 8; i++) {
        const double side = i & 1 ? 1e-9 : -1e-9;

        case_begin(&one, 1, 4);
        case_bounded(&one, -3.0, 3.0)[0] = -1.0;
        case_bounded(&one, -1.0, 1.5)[1] = 1.0;
        case_bounded(&one, 0.0, INFINITY)[2] = -1.0;
        case_bounded(&one, 2.0, 2.0)[3] = 1.0;
        memcpy(one.f, forces, sizeof forces);
        k = i / 2 % 2;
        one.f[k] *= 1.0 + side;
        one.f[1 - k] *= 0.9;
        require_edge("bead", 1.0 + side, side);
        if (side < 0.0)
            assert_true(one.r[2] == 40.0 && one.r[3] == 2.0);
    }
    one.f[0] = one.f[1] = 0.0;
    case_require("beads", &one, context, PERP_STATICS_STANDS);
    one.f[2] = -1e-9;
    case_require("away from the stop", &one, context, PERP_STATICS_FALLS);
    one.f[2] = 1.0;
    one.f[3] = -2.0 - 1e-9;
    case_require("a given force", &one, context, PERP_STATICS_FALLS);
}

/* A bar on a pin hangs below it and nowhere else; both rows twice are the same. */
static void test_joints(void **state)
{
    const double p[3] = {0, 0, 0}, x[3] = {1, 0, 0}, y[3] = {0, 1, 0};
    int32_t twice, i;

    (void)state;
    for (twice = 0; twice < 2; twice++) {
        case_begin(&one, 3, 1);
        one.center[0][1] = -2.0;
        for (i = 0; i <= twice; i++) {
            case_joint(&one, 0, CASE_GROUND, p, x, 0);
            case_joint(&one, 0, CASE_GROUND, p, y, 0);
        }
        one.f[1] = -5.0;
        case_require("hung", &one, context, PERP_STATICS_STANDS);
        for (i = 0; i < 2 * (1 + twice); i++)
            assert_true(fabs(one.r[i] - (i & 1 ? 5.0 : 0.0) / (1 + twice)) <= 1e-14);
        one.f[0] = 5e-9; /* aside by 1e-9 */
        case_require("hung aside", &one, context, PERP_STATICS_FALLS);
    }
}

/* ---- impulses ---- */

/* Four legs carry a quarter each and nothing sideways, at any heading of the tangents; with each
 * contact twice, an eighth. */
static void test_table(void **state)
{
    int32_t twice, i, j;

    (void)state;
    for (twice = 0; twice < 2; twice++)
        for (i = 0; i < 20; i++) {
            const double weight = ldexp(1.1, 4 * i - 40);

            case_begin(&one, 6, 1);
            for (j = 0; j <= twice; j++)
                case_corners(&one, 0, CASE_GROUND, 0, 0, -0.7, 0.5, i & 1 ? 0.5 : 0.8,
                             0.05 + 0.2 * i);
            one.f[2] = -weight;
            case_require("table", &one, context, PERP_STATICS_STANDS);
            for (j = 0; j < one.rows; j++) {
                const double right = j % 3 ? 0.0 : weight / (4 + 4 * twice);

                if (fabs(one.r[j] - right) > 1e-12 * weight)
                    fail_msg("table %d: row %d: %.17g instead of %.17g", (int)i, (int)j, one.r[j],
                             right);
            }
        }
}

/* Blocks on each other, masses 1 and 1e12 or 1, 1e4, 1e8 and 1e12, in any order. */
static void test_tower(void **state)
{
    static const int order[][4] = {{0, 0, 0, 12},  {12, 0, 0, 0},  {0, 4, 8, 12}, {12, 8, 4, 0},
                                   {0, 12, 0, 12}, {12, 0, 12, 0}, {-6, 6, -6, 6}};
    int32_t i, k, j;

    (void)state;
    for (i = 0; i < (int32_t)(sizeof order / sizeof *order); i++) {
        double carried = 0.0;

        case_begin(&one, 6, 4);
        for (k = 0; k < 4; k++) {
            one.center[k][2] = k + 0.5;
            one.f[6 * k + 2] = -9.81 * pow(10.0, order[i][k]);
            case_corners(&one, k, k - 1, 0, 0, k, 0.5, 0.5, 0.6);
        }
        case_require("tower", &one, context, PERP_STATICS_STANDS);
        for (k = 3; k >= 0; k--) {
            carried -= one.f[6 * k + 2];
            for (j = 0; j < 4; j++)
                if (fabs(one.r[12 * k + 3 * j] - carried / 4) > 1e-12 * carried)
                    fail_msg("tower %d, block %d: %.17g instead of %.17g", (int)i, (int)k,
                             one.r[12 * k + 3 * j], carried / 4);
        }
    }
}

/* Blocks without friction beside each other press each other by exactly 0.0. */
static void test_flush(void **state)
{
    int32_t i, k;

    (void)state;
    case_begin(&one, 3, 5);
    for (i = 0; i < 5; i++) {
        one.center[i][0] = i;
        one.center[i][1] = 0.5;
        one.f[3 * i + 1] = -1.0 - i;
        for (k = 0; k < 2; k++) {
            case_contact(&one, i, CASE_GROUND, i - 0.5 + k, 0, 0, 0, 1, 0, -1.0);
            if (i > 0)
                case_contact(&one, i, i - 1, i - 0.5, k, 0, 1, 0, 0, -1.0);
        }
    }
    case_require("flush", &one, context, PERP_STATICS_STANDS);
    for (k = 0; k < one.rows; k++) {
        const double *H = one.H + k * one.n;
        int32_t upright = 0;

        for (i = 0; i < 5; i++)
            upright |= H[3 * i + 1] != 0.0;
        if (!upright && one.r[k] != 0.0)
            fail_msg("flush: row %d carries %g", (int)k, one.r[k]);
    }
    one.f[0] = -1e-9; /* away from its neighbour */
    case_require("flush, away", &one, context, PERP_STATICS_FALLS);
}

/* ---- assemblies ---- */

/* Bricks of length 1 over an edge: the k-th from above may stand out by 1 / 2k over the next. */
static void test_overhang(void **state)
{
    int32_t bricks, i, falls;

    (void)state;
    for (bricks = 1; bricks <= 16; bricks++)
        for (falls = 0; falls < 2; falls++) {
            const double factor = falls ? 1.0 + 1e-6 : 1.0 - 1e-6;
            double x = 0.0;

            case_begin(&one, 3, bricks);
            for (i = 0; i < bricks; i++) { /* from above; the centre of each */
                one.center[i][0] = x;
                one.center[i][1] = 0.3 * (bricks - i) - 0.15;
                one.f[3 * i + 1] = -2.0;
                x -= factor / (2.0 * (i + 1));
            }
            for (i = 0; i < bricks; i++) {
                const double y = one.center[i][1] - 0.15, left = one.center[i][0] - 0.5;
                const double right = (i + 1 < bricks ? one.center[i + 1][0] : x) + 0.5;
                const int32_t below = i + 1 < bricks ? i + 1 : CASE_GROUND;

                case_contact(&one, i, below, left, y, 0, 0, 1, 0, 0.5);
                case_contact(&one, i, below, right, y, 0, 0, 1, 0, 0.5);
            }
            require_edge("overhang", factor, falls ? 1.0 : -1.0);
        }
}

/* A semicircular arch of 48 stones, thickness t, mean radius 1; centres of gravity on the mean
 * circle's side that a sector has. */
static void make_arch(statics_case *c, double t, int32_t stones)
{
    const double in = 1.0 - t / 2, out = 1.0 + t / 2, step = pi / stones;
    const double weight = 0.5 * step * (out * out - in * in);
    const double radius = 2.0 / 3.0 * sin(step / 2) / (step / 2) *
                          (out * out * out - in * in * in) / (out * out - in * in);
    int32_t i, k;

    case_begin(c, 3, stones);
    for (i = 0; i < stones; i++) {
        c->center[i][0] = -radius * cos((i + 0.5) * step);
        c->center[i][1] = radius * sin((i + 0.5) * step);
        c->f[3 * i + 1] = -weight;
    }
    for (i = 0; i <= stones; i++) {
        const double x = -cos(i * step), y = sin(i * step);

        for (k = 0; k < 2; k++)
            case_contact(c, i < stones ? i : CASE_GROUND, i > 0 ? i - 1 : CASE_GROUND,
                         (k ? out : in) * x, (k ? out : in) * y, 0, y, -x, 0, 0.7);
    }
}

/* Heyman's least thickness of a semicircular arch is .1075 of its radius (Milankovitch 1907;
 * Heyman, "The safety of masonry arches", Int. J. Mech. Sci. 11 (1969) 363), with as many joints as
 * one likes; with 48 of them hinges miss their best places by a few 1e-4. */
static void test_arch(void **state)
{
    double least = 0.09, most = 0.13;

    (void)state;
    while (most - least > 1e-7) {
        const double t = 0.5 * (least + most);

        make_arch(&one, t, 48);
        case_pose(&one);
        if (case_decide("arch", &one, context) == PERP_STATICS_STANDS)
            most = t;
        else
            least = t;
        assert_int_not_equal(one.result.verdict, PERP_STATICS_INDETERMINATE);
    }
    if (!(fabs(most - 0.1075) < 1e-3))
        fail_msg("least thickness of an arch: %g", most);
    make_arch(&one, 0.9 * most, 48);
    case_require("thin arch", &one, context, PERP_STATICS_FALLS);
}

/* ---- what falls beside what stands ---- */

/* A wedge in a notch that is steeper than friction can be as tight as one likes; the box beside it
 * falls, or is carried by a post. */
static void test_wedged(void **state)
{
    int32_t held, jammed;

    (void)state;
    for (held = 0; held < 2; held++)
        for (jammed = 0; jammed < 2; jammed++) {
            const double slope = 0.2, size = hypot(1.0, slope), mu = jammed ? 0.5 : 0.1;

            case_begin(&one, 3, 2);
            case_contact(&one, 0, CASE_GROUND, -1, 0, 0, 1 / size, slope / size, 0, mu);
            case_contact(&one, 0, CASE_GROUND, 1, 0, 0, -1 / size, slope / size, 0, mu);
            one.f[1] = -1.0;
            one.f[4] = -1.0;
            if (held)
                case_contact(&one, 1, CASE_GROUND, 0, 0, 0, 0, 1, 0, 0.3);
            case_require("wedged", &one, context, held ? PERP_STATICS_STANDS : PERP_STATICS_FALLS);
            if (!held && !(fabs(one.v[4] + 1.0) <= 1e-9 && fabs(one.v[1]) <= 1e-9))
                fail_msg("wedged: the box falls by %g, the wedge by %g", one.v[4], one.v[1]);
        }
}

/* Two fingers that press by N each hold 2 mu N; a floor holds everything from above; what has
 * already fallen holds nothing. */
static void test_safety(void **state)
{
    int32_t i;

    (void)state;
    for (i = 0; i < 40; i++) {
        const double mu = 0.05 + 0.1 * i, N = ldexp(1.3, (i - 20) / 2),
                     weight = ldexp(0.9, (20 - i) / 2);

        case_begin(&one, 3, 3); /* the fingers move along x alone */
        case_contact(&one, 0, 1, -1, 0, 0, 1, 0, 0, mu);
        case_contact(&one, 0, 2, 1, 0, 0, -1, 0, 0, mu);
        case_bounded(&one, -INFINITY, INFINITY)[4] = 1.0;
        case_bounded(&one, -INFINITY, INFINITY)[5] = 1.0;
        case_bounded(&one, -INFINITY, INFINITY)[7] = 1.0;
        case_bounded(&one, -INFINITY, INFINITY)[8] = 1.0;
        one.f[3] = N;
        one.f[6] = -N;
        one.load[1] = -weight;
        one.loaded = 1;
        case_require("grasp", &one, context,
                     2 * mu * N > weight ? PERP_STATICS_STANDS : PERP_STATICS_FALLS);
        if (!(fabs(one.result.safety * weight / (2 * mu * N) - 1.0) <= 1e-8))
            fail_msg("grasp %d: safety %.12g instead of %.12g", (int)i, one.result.safety,
                     2 * mu * N / weight);
    }
    case_begin(&one, 6, 1);
    case_corners(&one, 0, CASE_GROUND, 0, 0, -1, 1, 1, 0.5);
    one.f[2] = -1.0;
    case_require("no load", &one, context, PERP_STATICS_STANDS);
    assert_true(isnan(one.result.safety));
    one.load[2] = -1.0;
    one.loaded = 1;
    case_require("from above", &one, context, PERP_STATICS_STANDS);
    assert_true(isinf(one.result.safety) && one.result.safety > 0.0);
    one.load[2] = 0.0;
    one.load[0] = 2.0;
    case_require("aside", &one, context, PERP_STATICS_FALLS);
    assert_true(fabs(one.result.safety - 0.25) <= 0.25e-8);
    one.f[2] = 1.0;
    case_require("upwards", &one, context, PERP_STATICS_FALLS);
    assert_true(isnan(one.result.safety));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_slope),  cmocka_unit_test(test_tipping),
        cmocka_unit_test(test_ladder), cmocka_unit_test(test_rolling),
        cmocka_unit_test(test_bounds), cmocka_unit_test(test_joints),
        cmocka_unit_test(test_table),  cmocka_unit_test(test_tower),
        cmocka_unit_test(test_flush),  cmocka_unit_test(test_overhang),
        cmocka_unit_test(test_arch),   cmocka_unit_test(test_wedged),
        cmocka_unit_test(test_safety),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
