/* One contact by itself: closed forms, the law of every answer on random data at all scales, the
 * solutions of several that are documented, exhaustive search where the answer is unique. */
#include <math.h>
#include <string.h>

#include "suite.h"

#include "contact/sweep/sweep.h"
#include "gen.h"

enum { SEPARATE, STICK, SLIP };

/* r from r = start, u = W start + b; then u for the result. */
static int32_t solve(int32_t dim, const double *W, const double *b, double mu, const double *start,
                     double *r, double *u)
{
    perp__local local;
    int32_t mode;

    perp__local_make(&local, dim, W, dim, mu);
    for (int32_t i = 0; i < dim; i++) {
        u[i] = b[i];
        for (int32_t j = 0; j < dim; j++)
            u[i] += W[i * dim + j] * start[j];
        r[i] = start[i];
    }
    mode = perp__local_step(&local, u, r);
    for (int32_t i = 0; i < dim; i++) {
        u[i] = b[i];
        for (int32_t j = 0; j < dim; j++)
            u[i] += W[i * dim + j] * r[j];
    }
    return mode;
}

static const double none[3] = {0, 0, 0};

static void test_take_off(void **state)
{
    const double W[9] = {2, 0.5, 0, 0.5, 3, 0, 0, 0, 4}, b[3] = {1, -5, 7};
    double r[3], u[3];

    (void)state;
    assert_int_equal(solve(3, W, b, 0.5, none, r, u), SEPARATE);
    assert_true(r[0] == 0.0 && r[1] == 0.0 && r[2] == 0.0);
    assert_int_equal(solve(2, W, b, 0.5, none, r, u), SEPARATE);
    assert_int_equal(solve(1, W, b, 0.5, none, r, u), SEPARATE);
    assert_true(r[0] == 0.0);
}

/* W = I: stick where |b_t| <= mu |b_n|, else r_t = mu r_n against b_t. Powers of two: exact. */
static void test_identity(void **state)
{
    const double W[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const double sticks[3] = {-4, 1, -1}, slips[3] = {-4, 6, 8};
    double r[3], u[3];

    (void)state;
    assert_int_equal(solve(3, W, sticks, 0.5, none, r, u), STICK);
    assert_true(r[0] == 4.0 && r[1] == -1.0 && r[2] == 1.0);
    assert_int_equal(solve(3, W, slips, 0.5, none, r, u), SLIP);
    assert_true(r[0] == 4.0); /* |r_t| = 2 along (-6, -8) / 10, to rounding */
    assert_true(fabs(r[1] + 1.2) <= 4e-16 && fabs(r[2] + 1.6) <= 4e-16);
    assert_int_equal(solve(3, W, slips, 0.0, none, r, u), SLIP);
    assert_true(r[0] == 4.0 && r[1] == 0.0 && r[2] == 0.0);
}

/* A rod's end in the plane, W = [[1, a], [a, 1]]: sliding to the right, r_n = 1 / (1 - a mu). */
static void test_plane(void **state)
{
    const double a = 0.5, mu = 0.75, b[2] = {-1, 4};
    const double W[4] = {1, a, a, 1};
    double r[2], u[2];

    (void)state;
    assert_int_equal(solve(2, W, b, mu, none, r, u), SLIP);
    assert_true(fabs(r[0] - 1.0 / (1.0 - a * mu)) <= 4e-16);
    assert_true(fabs(r[1] + mu * r[0]) <= 4e-16);
    assert_true(fabs(u[0]) <= 4e-16 && u[1] > 0.0);
}

/* W = X X' with X random; rows scaled apart by up to `spread`. */
static void draw(gen_random *random, int32_t dim, double spread, double *W, double *b)
{
    double X[3][3];

    for (int32_t i = 0; i < dim; i++) {
        const double scale = exp(gen_uniform(random, -1, 1) * log(spread));

        b[i] = gen_normal(random) * exp(gen_uniform(random, -1, 1) * log(spread));
        for (int32_t j = 0; j < dim; j++)
            X[i][j] = gen_normal(random) * scale;
    }
    for (int32_t i = 0; i < dim; i++)
        for (int32_t j = 0; j < dim; j++) {
            W[i * dim + j] = 0.0;
            for (int32_t k = 0; k < dim; k++)
                W[i * dim + j] += X[i][k] * X[j][k];
        }
}

/* How near to the edge of its cone a slip has to be. From a known multiplier it gets there to
 * second order of 1e-4 in one step. */
static double edge = 1e-15;

/* How far (r, u) is from the law, relative to what was summed up to get there. */
static double violation(int32_t dim, int32_t mode, const double *W, const double *b, double mu,
                        const double *r, const double *u)
{
    double size = 0.0, tangent = 0.0, speed = 0.0, along = 0.0, worst;

    for (int32_t i = 0; i < dim; i++) {
        size = fmax(size, fabs(b[i]));
        for (int32_t j = 0; j < dim; j++)
            size = fmax(size, fabs(W[i * dim + j] * r[j]));
        tangent += i ? r[i] * r[i] : 0.0;
        speed += i ? u[i] * u[i] : 0.0;
        along += i ? r[i] * u[i] : 0.0;
    }
    tangent = sqrt(tangent);
    speed = sqrt(speed);
    assert_true(r[0] >= 0.0);
    if (mode == SEPARATE)
        return fmax(-u[0], 0.0) / size + tangent + r[0];
    worst = fabs(u[0]) / size;
    if (dim == 1)
        return worst;
    assert_true(tangent <= mu * r[0] * (1 + edge));
    if (mode == STICK)
        return fmax(worst, speed / size);
    assert_true(tangent >= mu * r[0] * (1 - edge));
    if (mu == 0.0)
        return worst;
    return fmax(worst, (speed + along / tangent) / size); /* u_t against r_t */
}

/* Every answer obeys the law, to rounding times what the elimination of r_n may lose. */
static void test_law_on_random_data(void **state)
{
    static const double spreads[] = {1, 1, 10, 100, 1e3};
    static const double tolerances[] = {1e-12, 1e-12, 1e-12, 1e-11, 1e-8};
    static const double frictions[] = {0, 1e-3, 0.3, 1, 10, 1e3};
    int32_t seen[3] = {0, 0, 0};
    gen_random random;

    (void)state;
    gen_seed(&random, 11);
    for (int32_t trial = 0; trial < 60000; trial++) {
        const int32_t dim = 1 + trial % 3, scale = trial / 3 % 5;
        const double mu = frictions[gen_integer(&random, 6)];
        double W[9], b[3], start[3], r[3], u[3], error;
        int32_t mode;

        draw(&random, dim, spreads[scale], W, b);
        for (int32_t i = 0; i < 3; i++)
            start[i] = trial % 2 ? 0.0 : gen_normal(&random) * fabs(b[0]) / W[0];
        mode = solve(dim, W, b, mu, start, r, u);
        for (int32_t i = 0; i < dim; i++)
            assert_true(isfinite(r[i]));
        seen[mode]++;
        error = violation(dim, mode, W, b, mu, r, u);
        if (trial % 2) /* from r = 0; a far start adds its own rounding */
            assert_true(error <= tolerances[scale]);
        else
            assert_true(error <= 100 * tolerances[scale] * (1 + fabs(start[0] * W[0] / b[0])));
    }
    assert_true(seen[SEPARATE] > 1000 && seen[STICK] > 1000 && seen[SLIP] > 1000);
}

/* Slips of weakly coupled contacts are unique: the angle of r_t, found by bisection of the
 * direction on a grid, agrees. */
static void test_slip_by_search(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 12);
    for (int32_t trial = 0; trial < 300; trial++) {
        double W[9], b[3], r[3], u[3], best = INFINITY, best_angle = 0, width = 3.2;
        const double mu = 0.1;

        draw(&random, 3, 1.0, W, b);
        if (solve(3, W, b, mu, none, r, u) != SLIP)
            continue;
        for (int32_t level = 0; level < 12; level++, width *= 0.2) {
            const double middle = best_angle;

            best = INFINITY;
            for (int32_t k = -40; k <= 40; k++) {
                const double angle = middle + width * k / 40;
                const double t[2] = {cos(angle), sin(angle)};
                const double n = -b[0] / (W[0] + mu * (W[1] * t[0] + W[2] * t[1]));
                double s[2], wrong;

                for (int32_t i = 0; i < 2; i++)
                    s[i] = b[i + 1] +
                           n * (W[3 * i + 3] + mu * (W[3 * i + 4] * t[0] + W[3 * i + 5] * t[1]));
                wrong = sqrt(s[0] * s[0] + s[1] * s[1]) + (s[0] * t[0] + s[1] * t[1]);
                if (n > 0.0 && wrong < best) {
                    best = wrong;
                    best_angle = angle;
                }
            }
        }
        /* the search minimises a square: half of the digits */
        assert_true(fabs(r[1] - mu * r[0] * cos(best_angle)) <= 1e-5 * r[0]);
        assert_true(fabs(r[2] - mu * r[0] * sin(best_angle)) <= 1e-5 * r[0]);
    }
}

/* The tangents' frame is of no account: to rounding, all turns with it. */
static void test_isotropy(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 13);
    for (int32_t trial = 0; trial < 2000; trial++) {
        const double angle = gen_uniform(&random, 0, 6.3), c = cos(angle), s = sin(angle);
        const double Q[3][3] = {{1, 0, 0}, {0, c, s}, {0, -s, c}};
        double W[9], b[3], V[9], d[3], r[3], u[3], x[3], back[3];
        int32_t mode;

        draw(&random, 3, 1.0, W, b);
        for (int32_t i = 0; i < 3; i++) {
            d[i] = 0.0;
            for (int32_t j = 0; j < 3; j++) {
                d[i] += Q[i][j] * b[j];
                V[3 * i + j] = 0.0;
                for (int32_t k = 0; k < 9; k++)
                    V[3 * i + j] += Q[i][k / 3] * W[k] * Q[j][k % 3];
            }
        }
        mode = solve(3, W, b, 0.7, none, r, u);
        if (mode != solve(3, V, d, 0.7, none, x, u))
            continue; /* on the edge of two modes */
        for (int32_t i = 0; i < 3; i++) {
            back[i] = 0.0;
            for (int32_t j = 0; j < 3; j++)
                back[i] += Q[j][i] * x[j];
        }
        for (int32_t i = 0; i < 3; i++) /* 3 by 3, condition up to 1e4 or so among 2000 */
            assert_true(fabs(back[i] - r[i]) <= 1e-9 * (fabs(r[0]) + fabs(r[1]) + fabs(r[2])));
    }
}

/* Steps from the solution, which begin at its slip multiplier, stay there. */
static void test_again(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 15);
    edge = 1e-6;
    for (int32_t trial = 0; trial < 3000; trial++) {
        double W[9], b[3], r[3] = {0, 0, 0}, u[3];
        const double mu = trial % 2 ? 0.5 : 3.0;
        perp__local local;
        int32_t mode = 0;

        draw(&random, 3, trial % 3 ? 1.0 : 10.0, W, b);
        perp__local_make(&local, 3, W, 3, mu);
        for (int32_t step = 0; step < 4; step++) {
            for (int32_t i = 0; i < 3; i++) {
                u[i] = b[i];
                for (int32_t j = 0; j < 3; j++)
                    u[i] += W[i * 3 + j] * r[j];
            }
            if (step > 0)
                assert_true(violation(3, mode, W, b, mu, r, u) <= (step > 1 ? 1e-11 : 1e-6));
            if (step > 0 && mode != perp__local_step(&local, u, r))
                break; /* on the edge of two modes */
            else if (step == 0)
                mode = perp__local_step(&local, u, r);
        }
    }
}

/* W that no simulator should make, but one will: zero, rank one, indefinite. Never NaN. */
static void test_singular(void **state)
{
    static const double bad[][9] = {{0, 0, 0, 0, 0, 0, 0, 0, 0},     {1, 0, 0, 0, 0, 0, 0, 0, 0},
                                    {1, 1, 1, 1, 1, 1, 1, 1, 1},     {0, 0, 0, 0, 1, 0, 0, 0, 1},
                                    {1, 4, 0, 4, 1, 0, 0, 0, 1},     {-1, 0, 0, 0, -1, 0, 0, 0, -1},
                                    {1, 0.25, 0, 0.5, 1, 0, 0, 0, 1}};
    static const double loads[][3] = {{0, 0, 0}, {-1, 0, 0},      {-1, 1, 1},
                                      {1, 1, 1}, {-1e-300, 1, 0}, {-1, 1e-300, 1e200}};
    static const double frictions[] = {0, 0.5, 1e3, 1e300};

    (void)state;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        for (size_t j = 0; j < sizeof loads / sizeof loads[0]; j++)
            for (size_t k = 0; k < 4; k++) {
                double r[3], u[3];

                solve(3, bad[i], loads[j], frictions[k], none, r, u);
                assert_true(!isnan(r[0]) && !isnan(r[1]) && !isnan(r[2]));
                assert_true(r[0] >= 0.0);
            }
}

/* |r| <= radius, opposed to u. */
static void test_discs(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 14);
    for (int32_t trial = 0; trial < 3000; trial++) {
        const int32_t dim = 1 + trial % 2;
        const double radius = trial % 7 ? gen_uniform(&random, 0, 2) : 0.0;
        double W[9], b[3], r[2] = {0, 0}, u[2] = {0, 0}, size, speed, along;
        perp__local disc;
        int32_t mode;

        draw(&random, dim, 1.0, W, b);
        perp__local_make_disc(&disc, dim, W, dim);
        mode = perp__local_step_disc(&disc, radius, b, r);
        for (int32_t i = 0; i < dim; i++) {
            u[i] = b[i];
            for (int32_t j = 0; j < dim; j++)
                u[i] += W[i * dim + j] * r[j];
        }
        size = sqrt(r[0] * r[0] + r[1] * r[1]);
        speed = sqrt(u[0] * u[0] + u[1] * u[1]);
        along = r[0] * u[0] + r[1] * u[1];
        assert_true(size <= radius * (1 + 1e-15));
        if (mode == STICK)
            assert_true(speed <= 1e-12);
        else
            assert_true(radius == 0.0 || fabs(along + size * speed) <= 1e-12 * size * (1 + speed));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_take_off),       cmocka_unit_test(test_identity),
        cmocka_unit_test(test_plane),          cmocka_unit_test(test_law_on_random_data),
        cmocka_unit_test(test_slip_by_search), cmocka_unit_test(test_isotropy),
        cmocka_unit_test(test_singular),       cmocka_unit_test(test_discs),
        cmocka_unit_test(test_again)};

    return cmocka_run_group_tests(tests, NULL, NULL);
}
