/* The loops of the ratio test against the definition, row by row, for every set of vectors that the
 * processor has. */
#include <math.h>
#include <stdlib.h>

#include "suite.h"

#include "gen.h"
#include "lcp/lemke/lemke.h"

enum { LENGTH = 64 };

typedef struct problem {
    perp__lemke_rows rows;
    double b[LENGTH], low[LENGTH], high[LENGTH], column[LENGTH];
} problem;

/* Bounds of every kind, some b beyond them, many ties, small entries, zeros. */
static void draw(problem *p, gen_random *random)
{
    int32_t i;

    for (i = 0; i < LENGTH; i++) {
        p->low[i] = gen_integer(random, 4) == 0 ? -INFINITY : 0.0;
        p->high[i] = gen_integer(random, 2) == 0 ? INFINITY : 3.0;
        p->b[i] = gen_integer(random, 8) * 0.5 - 0.5;
        p->column[i] = gen_integer(random, 5) == 0   ? 0.0
                       : gen_integer(random, 3) == 0 ? gen_uniform(random, -1e-11, 1e-11)
                                                     : (gen_integer(random, 9) - 4) / 3.0;
    }
    p->rows.length = LENGTH;
    p->rows.b = p->b;
    p->rows.low = p->low;
    p->rows.high = p->high;
    p->rows.column = p->column;
    p->rows.direction = gen_integer(random, 2) ? 1.0 : -1.0;
    p->rows.slack = 1e-11;
    p->rows.smallest_pivot = 1e-11;
    p->rows.noise = gen_integer(random, 2) ? 1e-12 : 0.0;
    p->rows.always = gen_integer(random, LENGTH + 1) - 1;
}

static double largest(const problem *p)
{
    double found = 0.0;
    int32_t i;

    for (i = 0; i < LENGTH; i++)
        found = fmax(found, fabs(p->column[i]));
    return found;
}

static void compare(const perp__row_kernels *kernels, const problem *p)
{
    double far[LENGTH], speed[LENGTH], least = INFINITY, best = 0.0;
    const double floor = p->rows.smallest_pivot * largest(p);
    const double reach = kernels->reach(&p->rows, far, speed);
    int32_t i, fastest = -1;

    for (i = 0; i < LENGTH; i++) {
        const double rate = -p->rows.direction * p->column[i];
        const double distance = rate < 0.0 ? p->b[i] - p->low[i] : p->high[i] - p->b[i];

        if (isfinite(distance) &&
            fabs(rate) > (i == p->rows.always ? p->rows.noise * largest(p) : floor)) {
            assert_true(speed[i] == fabs(rate));
            assert_true(far[i] == fmax(distance, 0.0));
            least = fmin(least, (far[i] + p->rows.slack) / speed[i]);
        } else {
            assert_true(speed[i] == 0.0);
        }
    }
    assert_true(reach == least);
    for (i = 0; i < LENGTH; i++)
        if (speed[i] > best && far[i] <= reach * speed[i]) {
            best = speed[i];
            fastest = i;
        }
    assert_int_equal(kernels->fastest(LENGTH, far, speed, reach), fastest);
}

/* The same bits from every set. */
static void compare_sets(const problem *p)
{
    double far[2][LENGTH], speed[2][LENGTH], b[2][LENGTH];
    const perp__row_kernels *kernels;
    double reach = 0.0;
    int32_t number, i;

    for (number = 0; (kernels = perp__row_kernels_number(number)) != NULL; number++) {
        const int32_t k = number > 0;
        const double found = kernels->reach(&p->rows, far[k], speed[k]);

        for (i = 0; i < LENGTH; i++)
            b[k][i] = p->b[i];
        kernels->move(LENGTH, 0.3, p->column, b[k]);
        if (k == 0)
            reach = found;
        assert_true(found == reach);
        assert_memory_equal(far[k], far[0], sizeof far[0]);
        assert_memory_equal(speed[k], speed[0], sizeof speed[0]);
        assert_memory_equal(b[k], b[0], sizeof b[0]);
        for (i = 0; i < LENGTH; i++)
            assert_true(b[k][i] == p->b[i] - 0.3 * p->column[i]);
    }
    assert_true(number > 0);
}

static void test_rows(void **state)
{
    gen_random random;
    problem p;
    int32_t k, number;

    (void)state;
    gen_seed(&random, 3);
    assert_null(perp__row_kernels_number(-1));
    for (k = 0; k < 2000; k++) {
        draw(&p, &random);
        for (number = 0; perp__row_kernels_number(number) != NULL; number++)
            compare(perp__row_kernels_number(number), &p);
        compare_sets(&p);
    }
}

static void test_nothing_blocks(void **state)
{
    double far[LENGTH], speed[LENGTH];
    gen_random random;
    problem p;
    int32_t number, i;

    (void)state;
    gen_seed(&random, 4);
    draw(&p, &random);
    p.rows.always = -1;
    for (i = 0; i < LENGTH; i++) {
        p.low[i] = -INFINITY;
        p.high[i] = INFINITY;
    }
    for (number = 0; perp__row_kernels_number(number) != NULL; number++) {
        const perp__row_kernels *kernels = perp__row_kernels_number(number);

        assert_true(kernels->reach(&p.rows, far, speed) == INFINITY);
        assert_int_equal(kernels->fastest(LENGTH, far, speed, INFINITY), -1);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rows),
        cmocka_unit_test(test_nothing_blocks),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
