#include "contradictions.h"

#include <math.h>
#include <string.h>

enum { MOST_X = 7, MOST_ROWS = 9 };

/* n variables and m rows, before any scaling. */
typedef struct program {
    int32_t n, m, is_bounded, is_inequality;
    double Q[MOST_X * MOST_X], A[MOST_ROWS * MOST_X], B[MOST_X * MOST_ROWS]; /* row by row */
    double x[MOST_X], multipliers[MOST_ROWS], side[MOST_ROWS];
} program;

/* A whole number in [-4, 4]. */
static double small(gen_random *random)
{
    return gen_integer(random, 9) - 4;
}

static double power(gen_random *random, int32_t low, int32_t high)
{
    return ldexp(1.0, low + gen_integer(random, high - low + 1));
}

/* Rows that mean something, then sums of these: of an inequality a x >= b the one that says
 * a x <= b. */
static void make_rows(program *p, gen_random *random)
{
    const int32_t own = 1 + gen_integer(random, p->n < 5 ? p->n : 5);
    int32_t i, j, k;

    p->is_inequality = gen_integer(random, 4) == 0;
    p->m = own + 1 + (p->is_inequality ? 0 : gen_integer(random, 2));
    for (i = 0; i < own; i++) {
        for (j = 0; j < p->n; j++)
            p->A[i * MOST_X + j] = small(random);
        p->A[i * MOST_X + gen_integer(random, p->n)] = 1 + gen_integer(random, 4);
    }
    for (i = own; i < p->m; i++)
        for (k = 0; k < own; k++) {
            const double share = p->is_inequality ? -(k == 0)
                                 : k == 0         ? 1 + gen_integer(random, 2)
                                                  : gen_integer(random, 5) - 2;

            for (j = 0; j < p->n; j++)
                p->A[i * MOST_X + j] += share * p->A[k * MOST_X + j];
        }
}

/* x_j in half of the rows is another variable, and a row without a right side says that both are
 * the same: its multiplier has to carry the contradiction on. */
static void split(program *p, gen_random *random)
{
    const int32_t j = gen_integer(random, p->n), other = p->n++, row = p->m++;

    for (int32_t i = 0; i < row; i++)
        if (gen_integer(random, 2)) {
            p->A[i * MOST_X + other] = p->A[i * MOST_X + j];
            p->A[i * MOST_X + j] = 0.0;
        }
    p->A[row * MOST_X + j] = 1.0;
    p->A[row * MOST_X + other] = -1.0;
    /* the row that contradicts is the last but one */
}

static void make_energy(program *p, gen_random *random)
{
    const double eps = gen_integer(random, 4) == 0 ? 0.0 : power(random, -46, 0);
    const int32_t is_unsymmetric = gen_integer(random, 4) == 0;
    int32_t i, j;

    for (i = 0; i < p->n; i++)
        p->Q[i * MOST_X + i] = eps * (1 + gen_integer(random, 4));
    if (gen_integer(random, 2)) { /* of rank one */
        double g[MOST_X];

        for (i = 0; i < p->n; i++)
            g[i] = small(random);
        for (i = 0; i < p->n; i++)
            for (j = 0; j < p->n; j++)
                p->Q[i * MOST_X + j] = eps * g[i] * g[j];
    }
    for (i = 0; i < p->n; i++)
        for (j = 0; j < p->m; j++)
            p->B[i * MOST_ROWS + j] = is_unsymmetric ? small(random) : -p->A[j * MOST_X + i];
}

/* The solution, and b of A x = b: of the row that contradicts off by its own size or more. */
static void make_solution(program *p, gen_random *random, int32_t row, int32_t solvable)
{
    const double large = gen_integer(random, 3) == 0 ? power(random, 0, 26) : 1.0;
    double size = 1.0;

    for (int32_t j = 0; j < p->n; j++)
        p->x[j] = p->is_bounded ? gen_integer(random, 4) : small(random);
    if (row < p->m - 1) /* split */
        for (int32_t j = 0; j < p->n - 1; j++)
            if (p->A[(p->m - 1) * MOST_X + j] != 0.0)
                p->x[p->n - 1] = p->x[j];
    for (int32_t i = 0; i < p->m; i++) {
        p->multipliers[i] = large * (p->is_inequality ? gen_integer(random, 4) : small(random));
        for (int32_t j = 0; j < p->n; j++)
            p->side[i] += p->A[i * MOST_X + j] * p->x[j];
    }
    for (int32_t j = 0; j < p->n; j++)
        size += fabs(p->A[row * MOST_X + j] * p->x[j]);
    if (!solvable)
        p->side[row] += size * (p->is_inequality || gen_integer(random, 2) ? 1 : -1);
}

static void pose(gen_lcp *problem, const program *p, gen_random *random)
{
    const int32_t n = p->n, m = p->m, scaled = gen_integer(random, 3); /* 1: rows; 2: both */
    int32_t i, j;

    gen_begin_dense(problem, n + m);
    problem->lower = gen_allocate((size_t)(n + m), sizeof(double));
    for (i = 0; i < n; i++) {
        double *row = problem->M + (size_t)i * (size_t)(n + m);
        const double slack = p->is_bounded && p->x[i] == 0.0 ? gen_integer(random, 4) : 0.0;

        problem->z[i] = p->x[i];
        problem->q[i] = slack;
        for (j = 0; j < n; j++) {
            row[j] = p->Q[i * MOST_X + j];
            problem->q[i] -= row[j] * p->x[j];
        }
        for (j = 0; j < m; j++) {
            row[n + j] = p->B[i * MOST_ROWS + j];
            problem->q[i] -= row[n + j] * p->multipliers[j];
        }
        problem->lower[i] = p->is_bounded ? 0.0 : -INFINITY;
    }
    for (i = 0; i < m; i++) {
        const double d = scaled ? power(random, -20, 20) : 1.0, column = scaled == 2 ? d : 1.0;

        for (j = 0; j < n; j++) {
            problem->M[(size_t)(n + i) * (size_t)(n + m) + (size_t)j] = d * p->A[i * MOST_X + j];
            problem->M[(size_t)j * (size_t)(n + m) + (size_t)(n + i)] *= column;
        }
        problem->q[n + i] = -d * p->side[i];
        problem->z[n + i] = p->multipliers[i] / column;
        problem->lower[n + i] = p->is_inequality ? 0.0 : -INFINITY;
    }
}

void gen_contradiction(gen_lcp *problem, gen_random *random, int32_t solvable)
{
    program p;
    int32_t row;

    memset(&p, 0, sizeof p);
    p.n = 1 + gen_integer(random, MOST_X - 1);
    p.is_bounded = gen_integer(random, 2);
    make_rows(&p, random);
    row = p.m - 1;
    if (!p.is_inequality && gen_integer(random, 4) == 0)
        split(&p, random);
    make_energy(&p, random);
    make_solution(&p, random, row, solvable);
    pose(problem, &p, random);
}
