/* Multifrontal factors of block matrices on random graphs: the residual of A x = b, with A as it
 * was handed over, and parts of the graph one by one. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

#include "gen.h"
#include "linalg/fronts/fronts.h"

enum { MOST = 60 };

typedef struct graph {
    int32_t nodes, width, starts[MOST + 1], neighbours[MOST * MOST];
} graph;

/* Two parts, of nodes 0 .. half-1 and of the others, each connected by a path; further edges at
 * random. */
static void make_graph(graph *g, gen_random *random, int32_t nodes, int32_t width, int32_t edges)
{
    int8_t near[MOST][MOST] = {{0}};
    const int32_t half = nodes / 2;
    int32_t at = 0;

    g->nodes = nodes;
    g->width = width;
    for (int32_t i = 0; i < nodes; i++)
        near[i][i] = 1;
    for (int32_t i = 0; i + 1 < nodes; i++)
        if (i + 1 != half)
            near[i][i + 1] = near[i + 1][i] = 1;
    for (int32_t k = 0; k < edges; k++) {
        const int32_t i = gen_integer(random, nodes), j = gen_integer(random, nodes);

        if ((i < half) == (j < half))
            near[i][j] = near[j][i] = 1;
    }
    for (int32_t i = 0; i < nodes; i++) {
        g->starts[i] = at;
        for (int32_t j = 0; j < nodes; j++)
            if (near[i][j])
                g->neighbours[at++] = j;
    }
    g->starts[nodes] = at;
}

/* I + an unsymmetric matrix whose symmetric part is positive definite: diagonally dominant. */
static void fill(perp__fronts *f, gen_random *random)
{
    const int32_t w = f->width;

    for (int32_t j = 0; j < f->nodes; j++)
        for (int32_t e = f->starts[j]; e < f->starts[j + 1]; e++)
            for (int32_t k = 0; k < w * w; k++)
                f->values[e * w * w + k] =
                    gen_normal(random) +
                    (f->neighbours[e] == j && k % (w + 1) == 0 ? 4.0 * w * MOST : 0.0);
}

/* The upper triangle becomes the lower one. */
static void make_symmetric(perp__fronts *f)
{
    const int32_t w = f->width;

    for (int32_t j = 0; j < f->nodes; j++)
        for (int32_t e = f->starts[j]; e < f->starts[j + 1]; e++) {
            const int32_t i = f->neighbours[e];
            const double *lower = f->values + perp__fronts_edge(f, j, i) * w * w;

            for (int32_t k = 0; k < w * w && i <= j; k++)
                if (i < j || k % w < k / w)
                    f->values[e * w * w + k] = lower[k % w * w + k / w];
        }
}

/* max |A x - b| over the rows of one node */
static double residual_at(const perp__fronts *f, const double *x, const double *b, int32_t node)
{
    const int32_t w = f->width;
    double y[MOST] = {0.0}, worst = 0.0;

    for (int32_t e = f->starts[node]; e < f->starts[node + 1]; e++) {
        const int32_t other = f->neighbours[e], edge = perp__fronts_edge(f, node, other);

        for (int32_t k = 0; k < w * w; k++)
            y[k % w] += f->values[edge * w * w + k] * x[other * w + k / w];
    }
    for (int32_t i = 0; i < w; i++)
        worst = fmax(worst, fabs(y[i] - b[node * w + i]));
    return worst;
}

/* max |A x - b| over the rows of the nodes first .. end-1 */
static double residual(const perp__fronts *f, const double *x, const double *b, int32_t first,
                       int32_t end)
{
    const int32_t w = f->width;
    double y[MOST * 6] = {0.0}, worst = 0.0;

    for (int32_t j = first; j < end; j++)
        for (int32_t e = f->starts[j]; e < f->starts[j + 1]; e++)
            for (int32_t k = 0; k < w * w; k++)
                y[f->neighbours[e] * w + k % w] += f->values[e * w * w + k] * x[j * w + k / w];
    for (int32_t i = first * w; i < end * w; i++)
        worst = fmax(worst, fabs(y[i] - b[i]));
    return worst;
}

/* Backward stable on dominant matrices: |A| |x| eps, with |x| about |b| / |A_ii|, times n. */
#define TOL 1e-11

static void check_residuals(int32_t symmetric)
{
    perp_context *context;
    perp__fronts f;
    graph g;

    memset(&f, 0, sizeof f);
    f.is_symmetric = symmetric;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    for (int32_t k = 0; k < 200; k++) {
        double b[MOST * 6], x[MOST * 6], parts[MOST * 6];
        gen_random random;
        int32_t half;

        gen_seed(&random, (uint64_t)k);
        make_graph(&g, &random, 1 + gen_integer(&random, MOST), k % 3 ? 6 : 3, k % 80);
        half = g.nodes / 2;
        assert_int_equal(
            perp__fronts_analyse(&f, context, g.nodes, g.width, g.starts, g.neighbours), PERP_OK);
        fill(&f, &random);
        if (symmetric)
            make_symmetric(&f);
        for (int32_t i = 0; i < g.nodes * g.width; i++)
            b[i] = x[i] = parts[i] = gen_normal(&random);
        assert_true(perp__fronts_factor(&f, 0, g.nodes));
        perp__fronts_solve(&f, 0, g.nodes, x);
        assert_true(residual(&f, x, b, 0, g.nodes) < TOL);
        assert_true(perp__fronts_factor(&f, half, g.nodes));
        perp__fronts_solve(&f, half, g.nodes, parts);
        assert_memory_equal(parts, b, (size_t)(half * g.width) * sizeof *b);
        assert_memory_equal(parts + half * g.width, x + half * g.width,
                            (size_t)((g.nodes - half) * g.width) * sizeof *x);
    }
    perp__fronts_release(&f);
    perp_context_destroy(context);
}

/* Blocks of random nodes, one after the other in the memory of the whole: those from a part alone,
 * an empty one and the whole are among them. */
static void test_blocks(void **state)
{
    perp_context *context;
    perp__fronts f;
    graph g;

    (void)state;
    memset(&f, 0, sizeof f);
    f.is_symmetric = f.takes_blocks = 1;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    for (int32_t k = 0; k < 300; k++) {
        double b[MOST * 3], x[MOST * 3], block[MOST * 3];
        int32_t nodes[MOST], count = 0, w;
        gen_random random;

        gen_seed(&random, (uint64_t)k / 5); /* five blocks of a graph */
        make_graph(&g, &random, 1 + gen_integer(&random, MOST), 1 + k / 5 % 3, k / 5 % 80);
        w = g.width;
        assert_int_equal(perp__fronts_analyse(&f, context, g.nodes, w, g.starts, g.neighbours),
                         PERP_OK);
        fill(&f, &random);
        make_symmetric(&f);
        gen_seed(&random, (uint64_t)k);
        for (int32_t i = 0; i < g.nodes; i++)
            if (gen_integer(&random, 4) < k % 5)
                nodes[count++] = i;
        for (int32_t i = 0; i < g.nodes * w; i++)
            b[i] = x[i] = gen_normal(&random);
        perp__fronts_take(&f, nodes, count);
        assert_true(perp__fronts_factor(&f, 0, count));
        perp__fronts_solve(&f, 0, count, x);
        /* the residual of the block: x and b are 0 elsewhere, where x is as it was */
        memset(block, 0, sizeof block);
        for (int32_t i = 0; i < count; i++)
            memcpy(block + nodes[i] * w, x + nodes[i] * w, (size_t)w * sizeof *x);
        for (int32_t i = 0, at = 0; i < g.nodes; i++) {
            const int32_t is_inside = at < count && nodes[at] == i;

            at += is_inside;
            if (!is_inside)
                assert_memory_equal(x + i * w, b + i * w, (size_t)w * sizeof *x);
        }
        for (int32_t i = 0; i < count; i++)
            assert_true(residual_at(&f, block, b, nodes[i]) < TOL);
    }
    perp__fronts_release(&f);
    perp_context_destroy(context);
}

static void test_residuals(void **state)
{
    (void)state;
    check_residuals(0);
}

/* Cholesky's factors: the same, and a pivot that is not positive is refused. */
static void test_symmetric(void **state)
{
    const int32_t starts[] = {0, 1}, neighbours[] = {0};
    perp_context *context;
    perp__fronts f;

    (void)state;
    check_residuals(1);
    memset(&f, 0, sizeof f);
    f.is_symmetric = 1;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    assert_int_equal(perp__fronts_analyse(&f, context, 1, 1, starts, neighbours), PERP_OK);
    f.values[0] = -1.0;
    assert_false(perp__fronts_factor(&f, 0, 1));
    perp__fronts_release(&f);
    perp_context_destroy(context);
}

/* [0 1; 1 0] in the block of a node: rows are exchanged; a column of zeros: refused. */
static void test_pivots(void **state)
{
    const int32_t starts[] = {0, 2, 4}, neighbours[] = {0, 1, 0, 1};
    perp_context *context;
    perp__fronts f;
    double x[4] = {1.0, 2.0, 3.0, 4.0};

    (void)state;
    memset(&f, 0, sizeof f);
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    assert_int_equal(perp__fronts_analyse(&f, context, 2, 2, starts, neighbours), PERP_OK);
    memset(f.values, 0, 16 * sizeof *f.values);
    for (int32_t i = 0; i < 2; i++) {
        double *block = f.values + 4 * perp__fronts_edge(&f, i, i);

        block[1] = block[2] = 1.0;
    }
    assert_true(perp__fronts_factor(&f, 0, 2));
    perp__fronts_solve(&f, 0, 2, x);
    assert_true(x[0] == 2.0 && x[1] == 1.0 && x[2] == 4.0 && x[3] == 3.0);
    f.values[4 * perp__fronts_edge(&f, 1, 1) + 1] = 0.0;
    assert_false(perp__fronts_factor(&f, 0, 2));
    perp__fronts_release(&f);
    perp_context_destroy(context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_blocks),
        cmocka_unit_test(test_residuals),
        cmocka_unit_test(test_symmetric),
        cmocka_unit_test(test_pivots),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
