#include "gen.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

static double *at(gen_lcp *problem, int32_t i, int32_t j)
{
    return &problem->M[(size_t)i * (size_t)problem->n + (size_t)j];
}

/* ---- random problems of a class ------------------------------------------------------------ */

/* M += A' A with A a rank by n matrix of small dyadic numbers */
static void add_gram(gen_lcp *problem, gen_random *random, int32_t rank)
{
    int32_t n = problem->n, i, j, k;
    double *row = gen_allocate((size_t)n, sizeof *row);

    for (k = 0; k < rank; k++) {
        for (i = 0; i < n; i++)
            row[i] = gen_dyadic(random, 2);
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++)
                *at(problem, i, j) += row[i] * row[j];
    }
    free(row);
}

static void add_skew(gen_lcp *problem, gen_random *random)
{
    int32_t i, j;

    for (i = 0; i < problem->n; i++)
        for (j = 0; j < i; j++) {
            double x = gen_dyadic(random, 2);

            *at(problem, i, j) += x;
            *at(problem, j, i) -= x;
        }
}

static void shuffle(gen_random *random, int32_t *order, int32_t n)
{
    int32_t i;

    for (i = 0; i < n; i++)
        order[i] = i;
    for (i = n - 1; i > 0; i--) {
        int32_t j = gen_integer(random, i + 1), kept = order[i];

        order[i] = order[j];
        order[j] = kept;
    }
}

/* A triangle with positive diagonal has positive principal minors in any order of the variables. */
static void make_triangle(gen_lcp *problem, gen_random *random)
{
    int32_t n = problem->n, i, j;
    int32_t *order = gen_allocate((size_t)n, sizeof *order);

    shuffle(random, order, n);
    for (i = 0; i < n; i++) {
        *at(problem, order[i], order[i]) = 1.0 + gen_integer(random, 48) / 16.0;
        for (j = 0; j < i; j++)
            *at(problem, order[i], order[j]) = gen_dyadic(random, 4);
    }
    free(order);
}

static void make_dominant(gen_lcp *problem, gen_random *random)
{
    int32_t n = problem->n, i, j;

    for (i = 0; i < n; i++) {
        double sum = 0.0;

        for (j = 0; j < n; j++)
            if (j != i && gen_integer(random, 3) == 0) {
                *at(problem, i, j) = -gen_integer(random, 33) / 16.0;
                sum -= *at(problem, i, j);
            }
        *at(problem, i, i) = sum + (1 + gen_integer(random, 16)) / 16.0;
    }
}

static void make_matrix(gen_lcp *problem, gen_random *random, int class)
{
    int32_t n = problem->n, i;

    if (class == GEN_P) {
        make_triangle(problem, random);
    } else if (class == GEN_M) {
        make_dominant(problem, random);
    } else {
        add_gram(problem, random, class == GEN_PSD_LOW_RANK ? (n + 1) / 2 : n);
        if (class == GEN_PD_UNSYMMETRIC)
            add_skew(problem, random);
        if (class != GEN_PSD_LOW_RANK)
            for (i = 0; i < n; i++)
                *at(problem, i, i) += 0.5;
    }
}

/* Bounds of row i, and a solution at one of the places they leave. */
static void make_row(gen_lcp *problem, gen_random *random, int32_t i, int bounds)
{
    double l = 0.0, u = INFINITY, push = gen_integer(random, 64) / 16.0;
    int kind = bounds == GEN_PLAIN ? 0 : bounds == GEN_BOXED ? 1 : gen_integer(random, 5);
    int place = gen_integer(random, 3);

    if (kind != 0 || bounds == GEN_MIXED)
        l = gen_dyadic(random, 4);
    if (kind == 1)
        u = l + (1 + gen_integer(random, 64)) / 16.0;
    if (kind == 2) {
        u = l;
        l = -INFINITY;
    }
    if (kind == 3)
        l = -INFINITY;
    if (kind == 4)
        u = l;
    if (problem->lower) {
        problem->lower[i] = l;
        problem->upper[i] = u;
    }
    if (l == u) {
        problem->z[i] = l;
        problem->w[i] = gen_dyadic(random, 4);
    } else if (isfinite(l) && (place == 0 || (place == 1 && !isfinite(u)))) {
        problem->z[i] = l;
        problem->w[i] = push;
    } else if (isfinite(u) && place < 2) {
        problem->z[i] = u;
        problem->w[i] = -push;
    } else { /* between; with both bounds in the middle */
        problem->z[i] = kind == 1     ? l + (u - l) / 2
                        : isfinite(l) ? l + (1 + gen_integer(random, 64)) / 16.0
                        : isfinite(u) ? u - (1 + gen_integer(random, 64)) / 16.0
                                      : gen_dyadic(random, 4);
    }
}

/* q = w - M z */
static void make_q(gen_lcp *problem)
{
    int32_t i, j;

    for (i = 0; i < problem->n; i++) {
        double sum = problem->w[i];

        for (j = 0; j < problem->n; j++)
            sum -= *at(problem, i, j) * problem->z[j];
        problem->q[i] = sum;
    }
}

void gen_problem(gen_lcp *problem, gen_random *random, int32_t n, int class, int bounds)
{
    int32_t i;

    gen_begin_dense(problem, n);
    if (bounds != GEN_PLAIN) {
        problem->lower = gen_allocate((size_t)n, sizeof(double));
        problem->upper = gen_allocate((size_t)n, sizeof(double));
    }
    make_matrix(problem, random, class);
    for (i = 0; i < n; i++)
        make_row(problem, random, i, bounds);
    make_q(problem);
}

void gen_linear_program(gen_lcp *problem, gen_random *random, int32_t rows, int32_t columns,
                        int equations)
{
    const int32_t n = rows + columns;

    gen_begin_dense(problem, n);
    problem->lower = gen_allocate((size_t)n, sizeof(double));
    problem->upper = gen_allocate((size_t)n, sizeof(double));
    for (int32_t i = columns; i < n; i++)
        for (int32_t j = 0; j < columns; j++) {
            *at(problem, i, j) = gen_normal(random);
            *at(problem, j, i) = -*at(problem, i, j);
        }
    for (int32_t i = 0; i < n; i++) {
        const int is_free = equations && i >= columns;
        const double z = gen_normal(random);

        problem->lower[i] = is_free ? -INFINITY : 0.0;
        problem->upper[i] = INFINITY;
        problem->z[i] = is_free ? z : fmax(z, 0.0);
        problem->w[i] = is_free || z > 0.0 ? 0.0 : gen_uniform(random, 0, 1);
    }
    make_q(problem);
}

double gen_program_error(const gen_lcp *problem, int32_t columns, const double *z)
{
    double error = 0.0;

    for (int32_t j = 0; j < columns; j++)
        error += problem->q[j] * (problem->z[j] - z[j]);
    return error;
}

/* ---- problems with a closed form ----------------------------------------------------------- */

void gen_obstacle(gen_lcp *problem, int32_t k)
{
    int32_t n = 4 * k - 1, i;
    double h = 0.5 / k;

    gen_begin_dense(problem, n);
    for (i = 0; i < n; i++) {
        double x = (i + 1) * h - 1.0, beyond = fabs(x) - 0.5;

        *at(problem, i, i) = 2.0;
        if (i > 0)
            *at(problem, i, i - 1) = -1.0;
        if (i < n - 1)
            *at(problem, i, i + 1) = -1.0;
        problem->q[i] = 2.0 * h * h - (i == 0 || i == n - 1 ? 0.25 : 0.0);
        problem->z[i] = beyond > 0 ? beyond * beyond : 0.0;
    }
    for (i = 0; i < n; i++)
        problem->w[i] = 2.0 * problem->z[i] + problem->q[i] - (i > 0 ? problem->z[i - 1] : 0.0) -
                        (i < n - 1 ? problem->z[i + 1] : 0.0);
}

void gen_hilbert(gen_lcp *problem, int32_t n)
{
    int32_t i, j;

    gen_begin_dense(problem, n);
    for (i = 0; i < n; i++) {
        problem->z[i] = 1.0;
        for (j = 0; j < n; j++)
            *at(problem, i, j) = 1.0 / (i + j + 1);
    }
    make_q(problem);
}

void gen_from_integers(gen_lcp *problem, int32_t n, const int *M, const int *q)
{
    int32_t i, j;

    gen_begin_dense(problem, n);
    for (i = 0; i < n; i++) {
        problem->q[i] = q[i];
        for (j = 0; j < n; j++)
            *at(problem, i, j) = M[i * n + j];
    }
}

/* ---- sparse -------------------------------------------------------------------------------- */

static void begin_csc(gen_lcp *problem, int32_t n, int32_t entries)
{
    problem->column_starts = gen_allocate((size_t)n + 1, sizeof(int32_t));
    problem->row_indices = gen_allocate((size_t)entries, sizeof(int32_t));
    problem->values = gen_allocate((size_t)entries, sizeof(double));
    assert_int_equal(perp_struct_init(&problem->view, sizeof problem->view), PERP_OK);
    assert_int_equal(perp_matrix_csc(&problem->view, n, n, problem->column_starts,
                                     problem->row_indices, problem->values),
                     PERP_OK);
}

static void append(gen_lcp *problem, int32_t column, int32_t row, double value)
{
    int32_t p = problem->column_starts[column + 1]++;

    problem->row_indices[p] = row;
    problem->values[p] = value;
}

void gen_to_csc(gen_lcp *copy, const gen_lcp *problem)
{
    int32_t n = problem->n, i, j;

    memset(copy, 0, sizeof *copy);
    copy->n = n;
    begin_csc(copy, n, n * n);
    for (j = 0; j < n; j++) {
        copy->column_starts[j + 1] = copy->column_starts[j];
        for (i = 0; i < n; i++) {
            double value = problem->M[(size_t)i * (size_t)n + (size_t)j];

            if (value != 0)
                append(copy, j, i, value);
        }
    }
}

/* A plateau of zeros in one corner, a bump elsewhere: multiples of 1/16 (side up to 2^20). */
static double bump(int32_t x, int32_t y, int32_t side)
{
    int32_t inside = x + y - side / 2;

    return inside > 0 ? (double)((side - x) * (side - y) % 64) / 16.0 + inside / 4.0 : 0.0;
}

void gen_obstacle_2d(gen_lcp *problem, int32_t side)
{
    static const int32_t dx[5] = {0, -1, 0, 1, 0}, dy[5] = {-1, 0, 0, 0, 1};
    int32_t n = side * side, j, k;

    gen_begin(problem, n);
    begin_csc(problem, n, 5 * n);
    for (j = 0; j < n; j++) {
        problem->z[j] = bump(j % side, j / side, side);
        problem->w[j] = problem->z[j] > 0 ? 0.0 : (j % 16) / 16.0;
        problem->q[j] = problem->w[j];
    }
    for (j = 0; j < n; j++) {
        problem->column_starts[j + 1] = problem->column_starts[j];
        for (k = 0; k < 5; k++) {
            int32_t x = j % side + dx[k], y = j / side + dy[k];
            double value = k == 2 ? 4.0 : -1.0;

            if (x < 0 || x >= side || y < 0 || y >= side)
                continue;
            append(problem, j, y * side + x, value);
            problem->q[y * side + x] -= value * problem->z[j];
        }
    }
}
