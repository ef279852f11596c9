/* Anderson mixing of x := A x + b: with as many differences as unknowns the least squares are
 * exact, and it ends in n + 1 steps; what it carries along (y) stays linear in x; it forgets on
 * growth. */
#include <math.h>
#include <string.h>

#include "suite.h"

#include "contact/sweep/sweep.h"
#include "gen.h"

enum { N = 4, Y = 2 };

typedef struct fixture {
    perp_context *context;
    perp__arena arena;
    perp__mixing mixing;
} fixture;

static void layout(perp__arena *arena, void *object)
{
    fixture *f = object;

    perp__mixing_layout(arena, &f->mixing, N, Y);
}

static void begin(fixture *f)
{
    static const double start[N] = {0.0};

    assert_int_equal(perp_context_create(&f->context, NULL), PERP_OK);
    memset(&f->arena, 0, sizeof f->arena);
    assert_int_equal(perp__arena_fit(&f->arena, f->context, layout, f), PERP_OK);
    perp__mixing_forget(&f->mixing, start);
}

static void end(fixture *f)
{
    perp__arena_release(&f->arena);
    perp_context_destroy(f->context);
}

/* y = C x */
static void follow(const double *x, double *y)
{
    y[0] = x[0] - 2.0 * x[1] + x[3];
    y[1] = x[2] + 3.0 * x[3];
}

static void test_linear(void **state)
{
    static const double weights[N] = {1.0, 2.0, 0.5, 3.0};
    gen_random random;

    (void)state;
    gen_seed(&random, 2);
    for (int32_t trial = 0; trial < 50; trial++) {
        double A[N][N], b[N], x[N] = {0}, next[N], y[Y], again[Y], change = 0.0;
        fixture f;

        for (int32_t i = 0; i < N; i++) {
            b[i] = gen_normal(&random);
            for (int32_t j = 0; j < N; j++) /* contracts by 0.9 in the maximum norm */
                A[i][j] = gen_uniform(&random, -0.9, 0.9) / N;
        }
        begin(&f);
        for (int32_t step = 0; step < N + 2; step++) {
            if (step > 0)
                perp__mixing_after(&f.mixing, weights, x, y);
            change = 0.0;
            for (int32_t i = 0; i < N; i++) {
                next[i] = b[i];
                for (int32_t j = 0; j < N; j++)
                    next[i] += A[i][j] * x[j];
            }
            for (int32_t i = 0; i < N; i++) {
                change = fmax(change, fabs(next[i] - x[i]));
                x[i] = next[i];
            }
            follow(x, y);
        }
        /* the ridge leaves 1e-10 times the condition of F'F; without mixing 1e-2 is left */
        assert_true(change <= 1e-4);
        perp__mixing_after(&f.mixing, weights, x, y);
        follow(x, again);
        assert_true(fabs(y[0] - again[0]) <= 1e-12 && fabs(y[1] - again[1]) <= 1e-12);
        end(&f);
    }
}

/* A step that is longer than the last one: the sweep's own result is kept. */
static void test_growth(void **state)
{
    static const double weights[N] = {1.0, 1.0, 1.0, 1.0};
    double x[N] = {0}, y[Y] = {0};
    fixture f;

    (void)state;
    begin(&f);
    for (int32_t step = 1; step <= 4; step++) {
        x[0] += step;
        y[0] += step;
        perp__mixing_after(&f.mixing, weights, x, y);
        assert_true(x[0] == 0.5 * step * (step + 1) && y[0] == x[0]);
    }
    end(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_linear),
                                       cmocka_unit_test(test_growth)};

    return cmocka_run_group_tests(tests, NULL, NULL);
}
