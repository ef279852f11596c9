/* Corners of the question what stands: no forces, impulses that bounds ask for, limits that carry
 * nothing, loads and forces no row answers, and numbers of very different size. Each answer is
 * checked from the caller's own data (statics_case.h); none may be NaN or infinite. */
#include <math.h>
#include <stdio.h>

#include "suite.h"

#include "statics_case.h"

#include "context.h"

static statics_case one;

/* Velocities of one body, pushed by these forces. */
static void begin(int32_t n, const double *f)
{
    case_begin(&one, n, 1);
    memcpy(one.f, f, (size_t)n * sizeof *f);
}

static void contact(int32_t dim, double mu, const double *rows)
{
    one.dims[one.contacts] = dim;
    one.mu[one.contacts] = mu;
    one.rolling[one.contacts] = one.spinning[one.contacts] = 0.0;
    one.contacts++;
    for (int32_t k = 0; k < dim; k++)
        memcpy(case_next(&one), rows + k * one.n, (size_t)one.n * sizeof *rows);
}

static void bounded(double lower, double upper, const double *row)
{
    memcpy(case_bounded(&one, lower, upper), row, (size_t)one.n * sizeof *row);
}

static void joint(const double *row)
{
    memcpy(one.G + one.n * one.joints++, row, (size_t)one.n * sizeof *row);
}

static void load(const double *load)
{
    memcpy(one.load, load, (size_t)one.n * sizeof *load);
    one.loaded = 1;
}

/* The verdict, with numbers that are some; safety is NaN where nothing was found. */
static void require(const char *name, int32_t verdict)
{
    case_require(name, &one, context, verdict);
    if (isnan(one.result.margin) || !(one.result.margin <= 1.0) || isnan(one.result.unbalance) ||
        isnan(one.result.work))
        fail_msg("%s: margin %g, unbalance %g, work %g", name, one.result.margin,
                 one.result.unbalance, one.result.work);
    for (int32_t i = 0; i < one.rows + one.joints; i++)
        assert_true(isfinite(one.r[i]));
}

static void require_safety(const char *name, double safety, double tolerance)
{
    if (one.result.safety != safety && !(fabs(one.result.safety - safety) <= tolerance * safety))
        fail_msg("%s: safety %.17g instead of %.17g", name, one.result.safety, safety);
}

/* Both forms of a row: its own direction and the other one, with the bounds that belong to it. */
static void bounded_either_way(int32_t way, double lower, double upper, const double *row)
{
    double turned[CASE_N];

    for (int32_t j = 0; j < one.n; j++)
        turned[j] = way ? -row[j] : row[j];
    bounded(way ? -upper : lower, way ? -lower : upper, turned);
}

/* ---- impulses that bounds ask for ---- */

/* A motor that pushes at least by 1 moves what nothing holds; against a wall it rests, pushed by 1
 * to `upper`; what pulls it back by 1.5 is answered. */
static void test_bounds_without_zero(void **state)
{
    const double none[] = {0.0}, row[] = {1.0}, wall[] = {-1.0}, pull[] = {-1.5};
    const double sizes[] = {1e-9, 1.0, 1e9};

    (void)state;
    for (int32_t i = 0; i < 6; i++) {
        const double size = sizes[i / 2], back[] = {size * pull[0]}, more[] = {size * -2.5};

        begin(1, none);
        bounded_either_way(i & 1, size, 2.0 * size, row);
        require("a motor, no forces", PERP_STATICS_FALLS);
        assert_true(fabs(one.result.work - size) <= 1e-9 * size);
        begin(1, none);
        bounded_either_way(i & 1, size, INFINITY, row);
        require("a motor without limit, no forces", PERP_STATICS_FALLS);
        begin(1, none);
        contact(1, 0.0, wall);
        bounded_either_way(i & 1, size, 2.0 * size, row);
        require("a motor against a wall", PERP_STATICS_STANDS);
        assert_true(fabs(one.r[0] - size) <= 1e-9 * size); /* the least impulses */
        begin(1, back);
        bounded_either_way(i & 1, size, 2.0 * size, row);
        require("a motor that is pulled back", PERP_STATICS_STANDS);
        begin(1, more);
        bounded_either_way(i & 1, size, 2.0 * size, row);
        require("a motor that is pulled back by more", PERP_STATICS_FALLS);
    }
}

/* A limit that touches beside a contact that carries: it carries nothing, whatever its bounds are,
 * and the body stands; where something pulls against it, it carries that or lets go. */
static void test_limits_that_touch(void **state)
{
    const double f[] = {-1.0, 0.0}, pulled[] = {-1.0, -0.5}, pushed[] = {-1.0, 0.5};
    const double normal[] = {1.0, 0.0}, row[] = {0.0, 1.0};

    (void)state;
    for (int32_t way = 0; way < 2; way++) {
        const double upper[] = {INFINITY, 3.0};

        for (int32_t k = 0; k < 2; k++) {
            begin(2, f);
            contact(1, 0.0, normal);
            bounded_either_way(way, 0.0, upper[k], row);
            require("a limit touches", PERP_STATICS_STANDS);
            assert_true(one.r[1] == 0.0);
            begin(2, pulled);
            contact(1, 0.0, normal);
            bounded_either_way(way, 0.0, upper[k], row);
            require("a limit carries", PERP_STATICS_STANDS);
            begin(2, pushed);
            contact(1, 0.0, normal);
            bounded_either_way(way, 0.0, upper[k], row);
            require("a limit lets go", PERP_STATICS_FALLS);
        }
    }
}

/* A motor at its limit: what it carries is its bound, exactly. */
static void test_motors_at_the_limit(void **state)
{
    const double f[] = {-1.0, -2.0}, row[] = {0.0, 1.0}, normal[] = {1.0, 0.0};

    (void)state;
    for (int32_t way = 0; way < 2; way++) {
        begin(2, f);
        contact(1, 0.0, normal);
        bounded_either_way(way, -1.0, 2.0, row);
        require("a motor at its limit", PERP_STATICS_STANDS);
        assert_true(fabs(one.r[1]) == 2.0);
    }
}

/* ---- no forces ---- */

static void require_nothing(const char *name)
{
    require(name, PERP_STATICS_STANDS);
    for (int32_t i = 0; i < one.rows + one.joints; i++)
        if (one.r[i] != 0.0)
            fail_msg("%s: r[%d] is %g", name, (int)i, one.r[i]);
    assert_true(one.result.unbalance == 0.0);
    assert_true(one.result.iterations == 0);
}

/* Where 0 is within all bounds, the least impulses that carry no force are none. */
static void test_no_forces(void **state)
{
    const double none[] = {0.0, 0.0, 0.0, 0.0}, wedge[] = {1.0, -2.0};
    const double rows[] = {0.0, 1.0, 0.0, 1.0}, more[] = {0.0, 2.0, 0.0, 3.0};

    (void)state;
    for (int32_t k = 0; k < 3; k++) {
        begin(1, none);
        contact(2, 0.4 + 0.1 * k, wedge);
        require_nothing("a wedge");
    }
    begin(4, none);
    bounded(-5e5, 1e6, rows);
    bounded(-1.0, INFINITY, more);
    require_nothing("rows with wide bounds");
    begin(4, none);
    joint(rows);
    require_nothing("a joint");
    begin(4, none);
    require_nothing("nothing");
}

/* ---- loads and forces no row answers ---- */

static void test_loads_no_row_answers(void **state)
{
    const double f[] = {-6.0, 0.0, 0.0}, normal[] = {3.0, 0.0, 0.0};
    const double aside[] = {2.0, 3.0, 3.0}, up[] = {2.0, 0.0, 0.0}, down[] = {-2.0, 0.0, 0.0};

    (void)state;
    begin(3, f);
    contact(1, 0.0, normal);
    load(aside);
    require("a load aside", PERP_STATICS_FALLS);
    assert_true(one.result.safety == 0.0);
    begin(3, f);
    contact(1, 0.0, normal);
    load(up);
    require("a load up", PERP_STATICS_STANDS);
    require_safety("a load up", 3.0, 1e-8);
    begin(3, f);
    contact(1, 0.0, normal);
    load(down);
    require("a load down", PERP_STATICS_STANDS);
    assert_true(one.result.safety == INFINITY);
}

/* A weight of 1 on a rod that bears up to `wide`: however wide, its load may grow to wide - 1, and
 * without end on one that bears anything. */
static void test_loads_that_wide_bounds_carry(void **state)
{
    const double f[] = {-1.0}, row[] = {1.0};

    (void)state;
    for (double wide = 2.0; wide < 1e14; wide *= 7.0)
        for (int32_t way = 0; way < 2; way++) {
            begin(1, f);
            bounded_either_way(way, -wide, wide, row);
            load(f);
            require("a load on a rod", PERP_STATICS_STANDS);
            require_safety("a load on a rod", wide - 1.0, 1e-8);
        }
    begin(1, f);
    bounded(0.0, INFINITY, row);
    load(f);
    require("a load on a rod of any strength", PERP_STATICS_STANDS);
    assert_true(one.result.safety == INFINITY);
}

/* A velocity that no row reaches, and what pushes it, however little that is. */
static void test_forces_no_row_answers(void **state)
{
    const double row[] = {-1.0, 0.0};

    (void)state;
    for (double small = 1.0; small > 1e-300; small *= 1e-6) {
        const double f[] = {1.0, small};

        begin(2, f);
        bounded(-3.0, 3.0, row);
        require("a small force without a row", PERP_STATICS_FALLS);
    }
}

/* A joint that carries nothing beside contacts that carry much: its rounding is theirs. */
static void test_unbalance_of_idle_joints(void **state)
{
    const double f[] = {0.0, 0.0, 6.0, 0.0, -2.0};
    const double a[] = {0.0, 3.0, 0.0, 0.0, 2.0}, b[] = {0.0, -1.0, -2.0, 0.0, 0.0};
    const double row[] = {0.0, 0.0, 1.0, 3.0, 0.0};

    (void)state;
    begin(5, f);
    contact(1, 0.0, a);
    contact(1, 0.0, b);
    joint(row);
    require("a joint without a force", PERP_STATICS_STANDS);
    for (int32_t k = 0; k < 2; k++)
        assert_true(fabs(one.r[k] - (k ? 3.0 : 1.0)) <= 1e-12);
    assert_true(fabs(one.r[2]) <= 1e-14);
}

/* ---- sizes ---- */

/* Bounds far away are none, and bounds close together are a force. */
static void test_bounds_of_any_width(void **state)
{
    const double f[] = {-1.0, -0.25}, row[] = {1.0, 0.0}, other[] = {0.0, 1.0};

    (void)state;
    for (double wide = 1.0; wide < 1e308; wide *= 1e3) {
        begin(2, f);
        bounded(-wide, wide, row);
        bounded(-INFINITY, wide, other);
        require("wide bounds", PERP_STATICS_STANDS);
        begin(2, f);
        bounded(-wide, -0.5, row);
        bounded(-wide, wide, other);
        require("wide bounds on the wrong side", PERP_STATICS_FALLS);
        begin(2, f);
        bounded(-1.0, 2.0 + 1.0 / wide, row);
        bounded(0.25 - 1.0 / wide, 0.25, other);
        require("narrow bounds", PERP_STATICS_STANDS);
        begin(2, f);
        bounded(-1.0 / wide, 1.0 / wide, row);
        bounded(-1.0, 1.0, other);
        require("bounds close to 0", wide > 1.0 ? PERP_STATICS_FALLS : PERP_STATICS_STANDS);
    }
}

/* A box between two fingers, each pressed against it by `press`: 2 mu press carries its weight. */
static void make_grasp(double press, double weight)
{
    const double f[] = {0.0, -weight, 0.0, press, -press};
    const double left[] = {1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0, -1.0, 0.0, 0.0};
    const double right[] = {-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0};

    begin(5, f);
    contact(2, 0.5, left);
    contact(2, 0.5, right);
}

static void test_grasps(void **state)
{
    const double down[] = {0.0, -1.0, 0.0, 0.0, 0.0};

    (void)state;
    for (double ratio = 1e-15; ratio < 1e16; ratio *= 10.0 / 3.0) {
        char name[64];

        snprintf(name, sizeof name, "a grasp, press / weight %.3g", ratio);
        make_grasp(ratio, 1.0);
        require(name, ratio > 1.0 ? PERP_STATICS_STANDS : PERP_STATICS_FALLS);
        make_grasp(ratio, 0.0);
        load(down);
        require(name, ratio > 1.0 ? PERP_STATICS_STANDS : PERP_STATICS_FALLS);
        require_safety(name, ratio, 1e-8);
    }
}

/* Forces, rows and loads whose products leave the range of doubles, or nearly so. */
static void test_range(void **state)
{
    const double f[] = {-1.0}, f2[] = {1e100, 1.34}, normal[] = {1.0}, half[] = {0.5};
    const double row[] = {3.89, -8.7e-311}, pure[] = {3.89, 0.0}, most[] = {-1.7e308};
    const double sizes[] = {1e-310, 1e-300, 1e-150, 1e150, 1e300, 1e306};

    (void)state;
    begin(1, f);
    contact(1, 0.0, half);
    load(most);
    case_pose(&one);
    assert_int_equal(case_decide("a load of any size", &one, context), PERP_STATICS_INDETERMINATE);
    begin(2, f2);
    contact(1, 0.0, row);
    require("a row of noise", PERP_STATICS_FALLS);
    begin(2, f2);
    joint(pure);
    require("a joint with a zero", PERP_STATICS_FALLS);
    begin(2, f2); /* an entry below the rounding of its row proves nothing */
    joint(row);
    case_pose(&one);
    assert_int_not_equal(case_decide("a joint of noise", &one, context), PERP_STATICS_FALLS);
    for (int32_t i = 0; i < 6; i++) {
        const double force[] = {-sizes[i]}, away[] = {sizes[i]};

        begin(1, force);
        contact(1, 0.0, normal);
        bounded(-1.0, 1.0, normal);
        require("forces of any size", PERP_STATICS_STANDS);
        begin(1, away);
        contact(1, 0.0, normal);
        require("forces of any size, away", PERP_STATICS_FALLS);
        begin(1, f);
        load(away);
        contact(1, 0.0, normal);
        require("loads of any size", sizes[i] > 1.0 ? PERP_STATICS_FALLS : PERP_STATICS_STANDS);
        require_safety("loads of any size", 1.0 / sizes[i], 1e-8);
        begin(1, force);
        load(force);
        require("no rows", PERP_STATICS_FALLS);
    }
}

/* Rows of 1 beside one of 1e200 that is pushed as it is told, and one of 1e217 without friction:
 * how they move is nothing but rounding, and proves nothing. The last row can push back. */
static void test_rows_of_any_size(void **state)
{
    const double f[] = {0.3}, rows[] = {-0.3, 3.0, -1.7e217}, told[] = {-1e200}, back[] = {1.1};

    (void)state;
    begin(1, f);
    contact(3, 0.0, rows);
    bounded(1e-3, 1e-3, told);
    bounded(-1e12, INFINITY, back);
    case_pose(&one);
    assert_int_equal(case_call(&one, context), PERP_OK);
    assert_true(one.result.verdict != PERP_STATICS_FALLS);
}

/* Between two walls, whose rows may be of any size: the one ahead carries 1. */
static void test_walls_of_any_size(void **state)
{
    const double f[] = {1.0}, ahead[] = {-1.1};

    (void)state;
    for (double size = 1e-300; size < 1e301; size *= 10.0) {
        const double behind[] = {size};

        begin(1, f);
        contact(1, 0.0, behind);
        contact(1, 0.0, ahead);
        case_pose(&one);
        assert_int_not_equal(case_decide("two walls", &one, context), PERP_STATICS_FALLS);
    }
}

/* A motor holds a push of 1. A second one and a wall, whose row may be of any size, could but push
 * the same way: at 1e17 doubles cannot tell the wall's impulse from 0, and it is left out. */
static void test_motors_beside_a_wall(void **state)
{
    const double f[] = {-1.0}, either_way[] = {-1.0}, one_way[] = {-2.0};

    (void)state;
    for (double size = 1e-25; size < 1e25; size *= 10.0) {
        const double behind[] = {-size};

        begin(1, f);
        contact(1, 0.0, behind);
        bounded(-3.0, INFINITY, either_way);
        bounded(0.0, 1.5, one_way);
        require("motors beside a wall", PERP_STATICS_STANDS);
    }
}

/* Coefficients that are small because tangents are in units 2^20 of the normal's count as in any
 * other units: a box on a slope stands up to its friction. */
static void test_units_of_tangents(void **state)
{
    (void)state;
    for (int32_t power = -20; power <= 20; power += 10) {
        const double unit = ldexp(1.0, power), rows[] = {0.0, 1.0, unit, 0.0};

        for (int32_t side = -1; side < 2; side += 2) {
            const double f[] = {0.5 * (1.0 + 1e-3 * side), -1.0};

            begin(2, f);
            contact(2, 0.5 / unit, rows);
            require("a body on a slope", side > 0 ? PERP_STATICS_FALLS : PERP_STATICS_STANDS);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bounds_without_zero),
        cmocka_unit_test(test_limits_that_touch),
        cmocka_unit_test(test_motors_at_the_limit),
        cmocka_unit_test(test_no_forces),
        cmocka_unit_test(test_loads_no_row_answers),
        cmocka_unit_test(test_loads_that_wide_bounds_carry),
        cmocka_unit_test(test_forces_no_row_answers),
        cmocka_unit_test(test_unbalance_of_idle_joints),
        cmocka_unit_test(test_bounds_of_any_width),
        cmocka_unit_test(test_grasps),
        cmocka_unit_test(test_range),
        cmocka_unit_test(test_rows_of_any_size),
        cmocka_unit_test(test_walls_of_any_size),
        cmocka_unit_test(test_motors_beside_a_wall),
        cmocka_unit_test(test_units_of_tangents),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
