/* Bases whose columns come from a pool, and solves checked against these columns. */
#ifndef PERP_TESTS_LINALG_BASES_H
#define PERP_TESTS_LINALG_BASES_H

#include "suite.h"

#include "linalg/basis.h"
#include "linalg/squares.h"

/* Columns to choose from: unit columns 0 .. n-1, then `others` of any kind. */
typedef struct pool {
    int32_t n, others;
    double *dense; /* n by n + others */
} pool;

static inline int32_t read_column(const void *user, int32_t column, int32_t *rows, double *values)
{
    const pool *p = user;
    const double *entries = p->dense + (size_t)column * (size_t)p->n;
    int32_t count = 0, i;

    for (i = 0; i < p->n; i++)
        if (entries[i] != 0.0) {
            rows[count] = i;
            values[count++] = entries[i];
        }
    return count;
}

/* Others: sparse with a large entry in row k mod n, a few of them full. */
static inline pool make_pool(gen_random *random, int32_t n, int32_t others)
{
    pool p = {n, others, NULL};
    int32_t i, k;

    p.dense = check_allocate((size_t)n * (size_t)(n + others) + 1, sizeof(double));
    for (i = 0; i < n; i++)
        p.dense[i + n * i] = 1.0;
    for (k = 0; k < others && n > 0; k++) {
        double *column = p.dense + (size_t)(n + k) * (size_t)n;

        for (i = 0; i < (k % 9 == 4 ? n : 3); i++)
            column[k % 9 == 4 ? i : gen_integer(random, n)] = gen_uniform(random, -1.0, 1.0);
        column[k % n] += k % 2 ? 8.0 : -8.0;
    }
    return p;
}

typedef struct bench {
    pool columns;
    perp__columns source;
    perp__principal principal;
    perp__basis basis;
    perp__arena arena;
    int32_t spikes;
    size_t file_entries;
    int32_t *chosen;
} bench;

static inline void lay_out(perp__arena *arena, void *object)
{
    bench *b = object;
    const int32_t n = b->columns.n + 10; /* room for more than is used */

    perp__basis_layout(arena, &b->basis, n, (size_t)(n * n), b->spikes, b->file_entries);
}

static inline void open_bench(bench *b, perp_context *of, pool columns, int32_t spikes,
                              size_t entries)
{
    int32_t i;

    memset(b, 0, sizeof *b);
    b->columns = columns;
    b->spikes = spikes;
    b->file_entries = entries;
    b->chosen = check_allocate((size_t)columns.n + 1, sizeof *b->chosen);
    for (i = 0; i < columns.n; i++)
        b->chosen[i] = i;
    memset(&b->arena, 0, sizeof b->arena);
    assert_int_equal(perp__arena_fit(&b->arena, of, lay_out, b), PERP_OK);
    b->source.user = &b->columns;
    b->source.read = read_column;
}

static inline void close_bench(bench *b)
{
    perp__basis_release(&b->basis);
    perp__arena_release(&b->arena);
    free(b->chosen);
    free(b->columns.dense);
}

static inline perp_status load(bench *b)
{
    return perp__basis_load(&b->basis, b->arena.context, b->columns.n, b->chosen, &b->source,
                            b->principal.block ? &b->principal : NULL);
}

/* Both solves against the chosen columns. */
static inline void require_solves(bench *b, gen_random *random, double tolerance)
{
    const int32_t n = b->columns.n;
    const size_t bytes = (size_t)n * sizeof(double);
    matrix B = matrix_zero(n);
    double *a = check_allocate(3 * (size_t)n + 1, sizeof *a), *x = a + n, *e = x + n;
    double error;
    int32_t i, k;

    for (k = 0; k < n; k++)
        memcpy(B.dense + (size_t)k * (size_t)n, b->columns.dense + (size_t)b->chosen[k] * (size_t)n,
               bytes);
    for (i = 0; i < n; i++)
        a[i] = e[i] = gen_integer(random, 3) ? 0.0 : gen_normal(random);
    perp__basis_solve(&b->basis, a, x);
    error = backward_error(&B, 0, x, a);
    if (!(error <= tolerance))
        fail_msg("n = %d, %d spikes: backward error %g", (int)n, (int)b->basis.spikes, error);
    perp__basis_solve_transposed(&b->basis, e, x);
    error = backward_error(&B, 1, x, a);
    if (!(error <= tolerance))
        fail_msg("n = %d, %d spikes, transposed: backward error %g", (int)n, (int)b->basis.spikes,
                 error);
    free(a);
    matrix_release(&B);
}

#endif
