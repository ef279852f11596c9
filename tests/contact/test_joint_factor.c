/* Factors of the joints' equations: over random graphs of nodes their solution leaves nothing of
 * the right side, patterns may follow each other, and of rows that say the same one is left out. */
#include <math.h>
#include <string.h>

#include "suite.h"

#include <perp/base.h>

#include "contact/coloured/joint_factor.h"
#include "gen.h"

enum { BODIES = 14, NODES = 16 };

static perp_context *create(void)
{
    perp_context *context;

    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    return context;
}

/* A chain or a tree, some of whose ends no body holds, and bodies that close loops. */
static void make(perp__joint_factor *f, perp_context *context, gen_random *random, int32_t nodes)
{
    assert_int_equal(perp__joint_factor_open(f, context, nodes, BODIES), PERP_OK);
    memset(f->P, 0, (size_t)nodes * sizeof *f->P);
    for (int32_t k = 0; k < nodes; k++) {
        f->rows[k] = 1 + gen_integer(random, 5);
        f->body[2 * k] = k < BODIES - 1 ? k + 1 : gen_integer(random, BODIES + 1);
        f->body[2 * k + 1] = k < BODIES - 1 ? gen_integer(random, k + 1) : BODIES;
        for (int32_t l = 0; l < f->rows[k]; l++)
            for (int32_t j = 0; j < 16; j++)
                f->P[k][j][l] = j % 8 < 6 && f->body[2 * k + j / 8] < BODIES
                                    ? gen_uniform(random, -1.0, 1.0)
                                    : 0.0;
    }
}

/* P P' x, node by node, by way of the bodies. */
static void multiply(const perp__joint_factor *f, const double *x, double *product)
{
    double y[8 * (BODIES + 1)] = {0.0};

    for (int32_t k = 0; k < f->nodes; k++)
        for (int32_t j = 0; j < 16; j++)
            for (int32_t l = 0; l < f->rows[k]; l++)
                y[8 * f->body[2 * k + j / 8] + j % 8] += f->P[k][j][l] * x[8 * k + l];
    memset(product, 0, 8 * (size_t)f->nodes * sizeof *product);
    for (int32_t k = 0; k < f->nodes; k++)
        for (int32_t j = 0; j < 16; j++)
            for (int32_t l = 0; l < f->rows[k] && f->body[2 * k + j / 8] < BODIES; l++)
                product[8 * k + l] += f->P[k][j][l] * y[8 * f->body[2 * k + j / 8] + j % 8];
}

static void test_random_graphs(void **state)
{
    const double least = 0x1p-20;
    perp_context *context = create();
    perp__joint_factor f = {0};
    gen_random random;

    (void)state;
    gen_seed(&random, 29);
    for (int32_t trial = 0; trial < 200; trial++) {
        double x[8 * NODES] = {0.0}, b[8 * NODES], product[8 * NODES], size = 0.0;
        int32_t definite;

        make(&f, context, &random, 1 + gen_integer(&random, NODES));
        for (int32_t k = 0; k < f.nodes; k++)
            for (int32_t l = 0; l < f.rows[k]; l++)
                x[8 * k + l] = gen_uniform(&random, -1.0, 1.0);
        memcpy(b, x, sizeof b);
        assert_int_equal(perp__joint_factor_make(&f, context, 0.0, least, &definite), PERP_OK);
        assert_true(definite);
        perp__joint_factor_solve(&f, x);
        multiply(&f, x, product);
        for (int32_t i = 0; i < 8 * f.nodes; i++)
            size = fmax(size, fabs(x[i]));
        for (int32_t k = 0; k < f.nodes; k++)
            for (int32_t i = 8 * k; i < 8 * k + f.rows[k]; i++)
                if (f.repeats[i])
                    assert_true(x[i] == 0.0);
                else /* roundings, 1 / least times larger at most, of numbers of size 1 */
                    assert_true(fabs(product[i] - b[i]) <= 1e-9 * (1.0 + size));
    }
    perp__joint_factor_release(&f);
    perp_context_destroy(context);
}

static void test_rows_that_say_the_same(void **state)
{
    perp_context *context = create();
    perp__joint_factor f = {0};
    double x[8] = {3.0, 3.0};
    int32_t definite;

    (void)state;
    assert_int_equal(perp__joint_factor_open(&f, context, 1, 1), PERP_OK);
    memset(f.P, 0, sizeof *f.P);
    f.rows[0] = 2;
    f.body[0] = 0;
    f.body[1] = 1;
    f.P[0][2][0] = f.P[0][2][1] = 1.0;
    assert_int_equal(perp__joint_factor_make(&f, context, 0.0, 0x1p-40, &definite), PERP_OK);
    assert_true(definite && !f.repeats[0] && f.repeats[1]);
    perp__joint_factor_solve(&f, x);
    assert_true(x[0] == 3.0 && x[1] == 0.0);
    f.P[0][2][1] = NAN;
    assert_int_equal(perp__joint_factor_make(&f, context, 0.0, 0x1p-40, &definite), PERP_OK);
    assert_false(definite);
    perp__joint_factor_release(&f);
    perp_context_destroy(context);
}

/* Of three rows in two directions the one stays that is farther from the first. */
static void test_the_clearest_rows_stay(void **state)
{
    perp_context *context = create();
    perp__joint_factor f = {0};
    double x[8] = {2.0, 5.0, 3.0};
    int32_t definite;

    (void)state;
    assert_int_equal(perp__joint_factor_open(&f, context, 1, 1), PERP_OK);
    memset(f.P, 0, sizeof *f.P);
    f.rows[0] = 3;
    f.body[0] = 0;
    f.body[1] = 1;
    f.P[0][2][0] = f.P[0][4][2] = 1.0;
    f.P[0][2][1] = 0.8;
    f.P[0][4][1] = 0.6;
    assert_int_equal(perp__joint_factor_make(&f, context, 0.0, 0x1p-40, &definite), PERP_OK);
    assert_true(definite && !f.repeats[0] && f.repeats[1] && !f.repeats[2]);
    perp__joint_factor_solve(&f, x);
    assert_true(x[0] == 2.0 && x[1] == 0.0 && x[2] == 3.0);
    perp__joint_factor_release(&f);
    perp_context_destroy(context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_random_graphs),
        cmocka_unit_test(test_rows_that_say_the_same),
        cmocka_unit_test(test_the_clearest_rows_stay),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
