#include "grids.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

typedef struct grid {
    const grid_options *options;
    int32_t step[3];
    int32_t *order, *node; /* node to row, and back */
    double *conductivity;
} grid;

static int32_t coordinate(const grid *g, int32_t node, int d)
{
    return node / g->step[d] % g->options->size[d];
}

static void number_nodes(grid *g, gen_random *random, int32_t n)
{
    int32_t i, k, kept;

    for (i = 0; i < n; i++)
        g->node[i] = i;
    for (i = n - 1; i > 0 && g->options->permuted; i--) {
        k = gen_integer(random, i + 1);
        kept = g->node[i];
        g->node[i] = g->node[k];
        g->node[k] = kept;
    }
    for (i = 0; i < n; i++)
        g->order[g->node[i]] = i;
}

/* One number a block of 8 nodes in each direction. */
static void draw_conductivity(grid *g, gen_random *random, int32_t n)
{
    int32_t i;

    for (i = 0; i < n; i++) {
        gen_random own = *random;

        own.state += (uint64_t)(coordinate(g, i, 0) / 8) * 7919 +
                     (uint64_t)(coordinate(g, i, 1) / 8) * 104729 +
                     (uint64_t)(coordinate(g, i, 2) / 8) * 1299709;
        g->conductivity[i] = pow(10.0, g->options->contrast * (gen_uniform(&own, 0, 1) - 0.5));
    }
    gen_bits(random);
}

/* Entries of the column that belongs to `node`, rows ascending; returns how many. */
static int32_t make_column(const grid *g, int32_t node, int32_t *rows, double *values)
{
    const grid_options *o = g->options;
    double diagonal = 0.0;
    int32_t count = 0, d, side, k;

    for (d = 0; d < 3; d++) {
        const double base = o->conductance[0] + o->conductance[1] + o->conductance[2] == 0.0
                                ? 1.0
                                : o->conductance[d];

        for (side = -1; side <= 1 && o->size[d] > 1; side += 2) {
            const int32_t at = coordinate(g, node, d) + side;
            const int inside = at >= 0 && at < o->size[d];
            const int32_t other = inside ? node + side * g->step[d] : node;
            const double a = g->conductivity[node], b = g->conductivity[other];
            double value = base * 2.0 * a * b / (a + b);

            diagonal += value;
            if (d == 0 && side == 1) /* the flow leaves this node for the next one */
                value += o->wind;
            if (d == 0 && side == 1)
                diagonal += o->wind;
            if (!inside)
                continue;
            for (k = count++; k > 0 && rows[k - 1] > g->order[other]; k--) {
                rows[k] = rows[k - 1];
                values[k] = values[k - 1];
            }
            rows[k] = g->order[other];
            values[k] = -value;
        }
    }
    for (k = count++; k > 0 && rows[k - 1] > g->order[node]; k--) {
        rows[k] = rows[k - 1];
        values[k] = values[k - 1];
    }
    rows[k] = g->order[node];
    values[k] = diagonal;
    return count;
}

static void allocate(gen_lcp *problem, int32_t n)
{
    const size_t size = (size_t)n;
    int32_t i;

    memset(problem, 0, sizeof *problem);
    problem->n = n;
    problem->column_starts = gen_allocate(size + 1, sizeof(int32_t));
    problem->row_indices = gen_allocate(7 * size, sizeof(int32_t));
    problem->values = gen_allocate(7 * size, sizeof(double));
    problem->q = gen_allocate(size, sizeof(double));
    problem->lower = gen_allocate(size, sizeof(double));
    problem->upper = gen_allocate(size, sizeof(double));
    for (i = 0; i < n; i++)
        problem->upper[i] = INFINITY;
}

void grid_problem(gen_lcp *problem, gen_random *random, const grid_options *options)
{
    const int32_t n = options->size[0] * options->size[1] * options->size[2];
    int32_t count = 0, j, d;
    grid g;

    g.options = options;
    g.step[0] = 1;
    g.step[1] = options->size[0];
    g.step[2] = options->size[0] * options->size[1];
    g.order = gen_allocate((size_t)n, sizeof *g.order);
    g.node = gen_allocate((size_t)n, sizeof *g.node);
    g.conductivity = gen_allocate((size_t)n, sizeof *g.conductivity);
    number_nodes(&g, random, n);
    draw_conductivity(&g, random, n);
    allocate(problem, n);
    for (j = 0; j < n; j++) {
        count += make_column(&g, g.node[j], problem->row_indices + count, problem->values + count);
        problem->column_starts[j + 1] = count;
        for (d = 0; d < 3 && options->place; d++)
            options->place[3 * j + d] =
                (coordinate(&g, g.node[j], d) + 1.0) / (options->size[d] + 1.0);
    }
    free(g.order);
    free(g.node);
    free(g.conductivity);
    assert_int_equal(perp_struct_init(&problem->view, sizeof problem->view), PERP_OK);
    assert_int_equal(perp_matrix_csc(&problem->view, n, n, problem->column_starts,
                                     problem->row_indices, problem->values),
                     PERP_OK);
}

void grid_load(gen_lcp *problem, const double *place, int32_t side)
{
    const double pi = 3.14159265358979323846, h = 1.0 / (side + 1);
    int32_t i;

    for (i = 0; i < problem->n; i++) {
        const double *x = place + 3 * i;

        problem->q[i] =
            -h * h * (sin(3 * pi * x[0]) * sin(2 * pi * x[1]) * sin(2 * pi * x[2] + 0.5) + 0.1);
    }
}
