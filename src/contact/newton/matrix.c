#include "contact/newton/matrix.h"

#include <math.h>
#include <string.h>

#include "base/context.h"
#include "linalg/blas.h"

/* Refinements of what the bodies' form gives, which loses the digits that the inverse of R lacks,
 * down to a residual of this part of the right side. */
#define BODY_ROUNDS 4
#define REST 1e-13

static int32_t block_count(const perp__contact_problem *problem)
{
    return problem->contacts + problem->size - problem->rows;
}

void perp__newton_blocks_layout(perp__arena *arena, perp__newton_blocks *blocks,
                                const perp__contact_problem *problem)
{
    size_t n = (size_t)problem->size;

    blocks->starts = perp__arena_take(arena, (size_t)block_count(problem) + 1, sizeof(int32_t));
    PERP__INTEGERS(arena, n, &blocks->rows, &blocks->unknowns, &blocks->owners);
    blocks->scales = perp__arena_take(arena, n, sizeof(double));
}

static void add_block(perp__newton_blocks *b, int32_t row, int32_t dim, double head, double scale)
{
    int32_t k = b->blocks++;

    for (int32_t i = 0; i < dim; i++) {
        b->rows[b->n] = row + i;
        b->unknowns[row + i] = b->n;
        b->owners[b->n] = k;
        b->scales[b->n++] = i == 0 ? head : scale;
    }
    b->starts[b->blocks] = b->n;
}

void perp__newton_blocks_read(perp__newton_blocks *blocks, const perp__contact_problem *problem)
{
    int32_t bilateral = problem->size - problem->rows;

    blocks->contacts = problem->contacts;
    blocks->blocks = blocks->n = 0;
    blocks->starts[0] = 0;
    for (int32_t i = 0; i < problem->size; i++)
        blocks->unknowns[i] = -1;
    for (int32_t k = 0; k < problem->contacts; k++) {
        double scale = 1.0 / sqrt(problem->trace[k]);
        double balance = sqrt(fmax(problem->mu[k], 1.0) * fmin(10.0 * problem->mu[k], 1.0));

        if (problem->dims[k] == 1 || !(problem->mu[k] > 0.0))
            add_block(blocks, problem->starts[k], 1, scale, scale);
        else
            add_block(blocks, problem->starts[k], problem->dims[k],
                      scale * balance / problem->mu[k], scale * balance);
    }
    for (int32_t i = 0; i < bilateral; i++) {
        double trace = problem->trace[problem->contacts + i];
        double scale = trace > 0.0 ? 1.0 / sqrt(trace) : 1.0;

        add_block(blocks, problem->rows + i, 1, scale, scale);
    }
}

/* The contact or bilateral row that `row` belongs to, from a first guess not behind it. */
static int32_t owner_of(const perp__contact_problem *problem, int32_t row, int32_t guess)
{
    int32_t last = problem->contacts;
    int32_t low = guess;

    if (row >= problem->rows)
        return last + row - problem->rows;
    while (low + 1 < last) {
        int32_t middle = low + (last - low) / 2;

        if (problem->starts[middle] <= row)
            low = middle;
        else
            last = middle;
    }
    return low;
}

static int32_t owner_size(const perp__contact_problem *problem, int32_t k)
{
    return k < problem->contacts ? problem->starts[k + 1] - problem->starts[k] : 1;
}

/* An upper bound of the entries of A in whole blocks of rows. */
static size_t count_entries(const perp__contact_problem *problem)
{
    const perp__matrix *W = problem->W;
    size_t entries = 0;
    int32_t column, at, own = 0;

    for (column = 0; column < problem->size; column++) {
        int32_t last = -1, found = 0;

        own = owner_of(problem, column, own < problem->contacts ? own : 0);
        for (at = W->column_starts[column]; at < W->column_starts[column + 1]; at++) {
            int32_t owner = owner_of(problem, W->row_indices[at],
                                     last >= 0 && last < problem->contacts ? last : 0);

            if (owner == last)
                continue;
            last = owner;
            found |= owner == own;
            entries += (size_t)owner_size(problem, owner);
        }
        entries += found ? 0 : (size_t)owner_size(problem, own);
    }
    return entries;
}

perp_status perp__newton_matrix_check(const perp__contact_problem *problem)
{
    if (problem->bodies ? perp__newton_bodies_entries(problem->bodies) > INT32_MAX
                        : problem->W->column_starts && count_entries(problem) > INT32_MAX)
        return perp__fail(problem->context, PERP_ERROR_ARGUMENT,
                          "the problem has too many couplings for method newton");
    return PERP_OK;
}

void perp__newton_matrix_layout(perp__arena *arena, perp__newton_matrix *matrix,
                                const perp__contact_problem *problem)
{
    size_t n = (size_t)problem->size;
    int32_t sparse = !problem->bodies && problem->W->column_starts != NULL;
    size_t entries = problem->bodies ? 0 : sparse ? count_entries(problem) : n * n;

    matrix->by_bodies = problem->bodies != NULL;
    matrix->sparse = sparse;
    if (matrix->by_bodies)
        perp__newton_bodies_layout(arena, &matrix->bodies, problem);
    matrix->column_starts = perp__arena_take(arena, sparse ? n + 1 : 0, sizeof(int32_t));
    matrix->row_indices = perp__arena_take(arena, sparse ? entries : 0, sizeof(int32_t));
    PERP__DOUBLES(arena, entries, &matrix->A, &matrix->values);
    matrix->rest = perp__arena_take(arena, n, sizeof(double));
}

static void read_dense(perp__newton_matrix *matrix, const perp__matrix *W)
{
    const perp__newton_blocks *b = matrix->blocks;

    for (int32_t j = 0; j < b->n; j++)
        for (int32_t i = 0; i < b->n; i++)
            matrix->A[(size_t)j * (size_t)b->n + (size_t)i] =
                W->values[(size_t)b->rows[i] * W->row_stride +
                          (size_t)b->rows[j] * W->column_stride] *
                (b->scales[i] * b->scales[j]);
}

static int32_t append_block(perp__newton_matrix *matrix, int32_t block, int32_t at)
{
    for (int32_t i = matrix->blocks->starts[block]; i < matrix->blocks->starts[block + 1]; i++) {
        matrix->row_indices[at] = i;
        matrix->A[at++] = 0.0;
    }
    return at;
}

static int32_t read_column(perp__newton_matrix *matrix, const perp__matrix *W, int32_t j,
                           int32_t at)
{
    const perp__newton_blocks *b = matrix->blocks;
    int32_t column = b->rows[j], own = b->owners[j], last = -1, found = 0;

    for (int32_t p = W->column_starts[column]; p < W->column_starts[column + 1]; p++) {
        int32_t i = b->unknowns[W->row_indices[p]];
        int32_t owner;

        if (i < 0)
            continue;
        owner = b->owners[i];
        if (!found && owner >= own) {
            found = 1;
            if (owner > own)
                at = append_block(matrix, own, at);
        }
        if (owner != last)
            at = append_block(matrix, owner, at);
        last = owner;
        matrix->A[at - b->starts[owner + 1] + i] = W->values[p] * (b->scales[i] * b->scales[j]);
    }
    return found ? at : append_block(matrix, own, at);
}

static void read_sparse(perp__newton_matrix *matrix, const perp__matrix *W)
{
    int32_t at = 0;

    for (int32_t j = 0; j < matrix->blocks->n; j++) {
        matrix->column_starts[j] = at;
        at = read_column(matrix, W, j, at);
    }
    matrix->column_starts[matrix->blocks->n] = at;
}

static perp__square square(const perp__newton_matrix *matrix)
{
    perp__square A = {matrix->blocks->n, matrix->values, NULL, NULL};

    if (matrix->sparse) {
        A.column_starts = matrix->column_starts;
        A.row_indices = matrix->row_indices;
    }
    return A;
}

perp_status perp__newton_matrix_read(perp__newton_matrix *matrix, const perp__newton_blocks *blocks,
                                     const perp__contact_problem *problem)
{
    perp__square A;

    matrix->blocks = blocks;
    matrix->fresh = 1;
    matrix->factorisations = 0;
    if (matrix->by_bodies)
        return perp__newton_bodies_read(&matrix->bodies, blocks, problem);
    if (matrix->sparse)
        read_sparse(matrix, problem->W);
    else
        read_dense(matrix, problem->W);
    A = square(matrix);
    return perp__kept_factor_analyse(&matrix->factor, problem->context,
                                     matrix->sparse ? &perp__factor_klu : &perp__factor_lapack, &A);
}

void perp__newton_matrix_release(perp__newton_matrix *matrix)
{
    perp__kept_factor_release(&matrix->factor);
    perp__kept_factor_release(&matrix->bodies.factor);
}

void perp__newton_multiply(const perp__newton_matrix *matrix, const double *x, double *y)
{
    int32_t n = matrix->blocks->n;

    if (matrix->by_bodies) {
        perp__newton_bodies_multiply(&matrix->bodies, x, y);
        return;
    }
    memset(y, 0, (size_t)n * sizeof *y);
    if (!matrix->sparse) {
        perp__gemv_subtract(n, n, matrix->A, n, x, 1, y);
        for (int32_t i = 0; i < n; i++)
            y[i] = -y[i];
        return;
    }
    for (int32_t j = 0; j < n; j++)
        for (int32_t p = matrix->column_starts[j]; p < matrix->column_starts[j + 1]; p++)
            y[matrix->row_indices[p]] += matrix->A[p] * x[j];
}

/* values := L A + R in column j, entries [at, end). */
static void fill_column(const perp__newton_matrix *matrix, const double *L, const double *R,
                        int32_t j, size_t at, size_t end)
{
    const perp__newton_blocks *b = matrix->blocks;
    int32_t own = b->owners[j];
    int32_t block = 0;

    while (at < end) {
        const double *left, *a = &matrix->A[at];
        double *v = &matrix->values[at];
        int32_t d;

        if (matrix->sparse)
            block = b->owners[matrix->row_indices[at]];
        left = &L[9 * (size_t)block];
        d = b->starts[block + 1] - b->starts[block];
        for (int32_t i = 0; i < d; i++) {
            v[i] = left[i] * a[0];
            if (d > 1)
                v[i] += left[3 + i] * a[1];
            if (d > 2)
                v[i] += left[6 + i] * a[2];
            if (block == own)
                v[i] += R[9 * (size_t)own + 3 * (size_t)(j - b->starts[own]) + (size_t)i];
        }
        at += (size_t)d;
        block++;
    }
}

perp_status perp__newton_factor(perp__newton_matrix *matrix, const double *L, const double *R)
{
    int32_t n = matrix->blocks->n;
    int32_t keep = !matrix->fresh;
    perp__square A;

    matrix->fresh = 0;
    matrix->factorisations++;
    if (matrix->by_bodies)
        return perp__newton_bodies_factor(&matrix->bodies, L, R, keep);
    for (int32_t j = 0; j < n; j++)
        if (matrix->sparse)
            fill_column(matrix, L, R, j, (size_t)matrix->column_starts[j],
                        (size_t)matrix->column_starts[j + 1]);
        else
            fill_column(matrix, L, R, j, (size_t)j * (size_t)n, ((size_t)j + 1) * (size_t)n);
    A = square(matrix);
    return matrix->factor.type->factor(matrix->factor.factor, &A, keep);
}

/* rest = rhs - (L A + R) x */
static void residual(const perp__newton_matrix *matrix, const double *L, const double *R,
                     const double *rhs, const double *x, double *rest)
{
    const perp__newton_blocks *b = matrix->blocks;

    perp__newton_multiply(matrix, x, rest);
    for (int32_t k = 0; k < b->blocks; k++) {
        int32_t at = b->starts[k], d = b->starts[k + 1] - at;
        double part[3];

        for (int32_t i = 0; i < d; i++) {
            part[i] = rhs[at + i];
            for (int32_t j = 0; j < d; j++)
                part[i] -= L[9 * k + 3 * j + i] * rest[at + j] + R[9 * k + 3 * j + i] * x[at + j];
        }
        memcpy(&rest[at], part, (size_t)d * sizeof *part);
    }
}

static void apply_inverse(perp__newton_matrix *matrix, const double *L, double *x)
{
    if (matrix->by_bodies)
        perp__newton_bodies_solve(&matrix->bodies, L, x);
    else
        matrix->factor.type->solve(matrix->factor.factor, x, 0);
}

static double largest(const double *x, int32_t n)
{
    double most = 0.0;

    for (int32_t i = 0; i < n; i++)
        most = fmax(most, fabs(x[i]));
    return most;
}

void perp__newton_solve(perp__newton_matrix *matrix, const double *L, const double *R,
                        const double *rhs, double *x)
{
    int32_t n = matrix->blocks->n, rounds = matrix->by_bodies ? BODY_ROUNDS : 1;
    double scale = matrix->by_bodies ? largest(rhs, n) : 0.0, last = INFINITY;

    memcpy(x, rhs, (size_t)n * sizeof *x);
    apply_inverse(matrix, L, x);
    for (int32_t round = 0; round < rounds; round++) {
        double size;

        residual(matrix, L, R, rhs, x, matrix->rest);
        size = matrix->by_bodies ? largest(matrix->rest, n) : 1.0;
        if (matrix->by_bodies && (size <= REST * scale || !(size < 0.5 * last)))
            return;
        last = size;
        apply_inverse(matrix, L, matrix->rest);
        for (int32_t i = 0; i < n; i++)
            x[i] += matrix->rest[i];
    }
}
