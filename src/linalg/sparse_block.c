#include "linalg/sparse_block.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* ---- what a sparse matrix is like, as far as one pass tells ---- */

/* Entries that mirror each other may differ by this much, relative: matrices are often assembled in
 * an order that rounds the two triangles differently. The solver refines with M itself. */
#define PERP__ASYMMETRY (8.0 * DBL_EPSILON)
/* Largest sum of a row's positive entries beside the diagonal, relative to it. */
#define PERP__POSITIVE_SHARE 0.25

/* M is CSC with sorted columns. */
static int32_t has_positive_diagonal(const perp__matrix *M)
{
    int32_t k;

    for (int32_t j = 0; j < M->columns; j++) {
        for (k = M->column_starts[j]; k < M->column_starts[j + 1]; k++)
            if (M->row_indices[k] >= j)
                break;
        if (k == M->column_starts[j + 1] || M->row_indices[k] != j || !(M->values[k] > 0.0))
            return 0;
    }
    return 1;
}

/* No positive entry beside the diagonal. */
static int32_t has_z_signs(const perp__matrix *M)
{
    for (int32_t j = 0; j < M->columns; j++)
        for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++)
            if (M->values[k] > 0.0 && M->row_indices[k] != j)
                return 0;
    return 1;
}

/* Whether positive entries beside the diagonal are small, in every column. scale NULL: 1. */
static int32_t is_nearly_z(const perp__matrix *M, const double *scale)
{
    for (int32_t j = 0; j < M->columns; j++) {
        double positive = 0.0, diagonal = 0.0;

        for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++) {
            const int32_t i = M->row_indices[k];

            if (i == j)
                diagonal = M->values[k] * (scale ? scale[j] : 1.0);
            else if (M->values[k] > 0.0)
                positive += M->values[k] * (scale ? scale[i] : 1.0);
        }
        if (positive > PERP__POSITIVE_SHARE * diagonal)
            return 0;
    }
    return 1;
}

/* Columns from left to right meet the mirror images of their entries in the order in which these
 * are stored: one cursor a column. */
int32_t perp__has_symmetric_entries(const perp__matrix *M, int32_t *cursor, double tolerance)
{
    const int32_t n = M->columns;

    memcpy(cursor, M->column_starts, (size_t)n * sizeof *cursor);
    for (int32_t j = 0; j < n; j++) {
        for (int32_t k = cursor[j]; k < M->column_starts[j + 1]; k++) {
            const int32_t i = M->row_indices[k];
            const double a = M->values[k];
            double b;

            if (i == j)
                continue;
            if (i < j || cursor[i] == M->column_starts[i + 1] || M->row_indices[cursor[i]] != j)
                return 0; /* no mirror image */
            b = M->values[cursor[i]++];
            if (!(fabs(a - b) <= tolerance * fabs(a)))
                return 0;
        }
    }
    return 1;
}

int32_t perp__is_like_laplace(const perp__matrix *M, int32_t *cursor)
{
    return has_positive_diagonal(M) && is_nearly_z(M, NULL) &&
           perp__has_symmetric_entries(M, cursor, PERP__ASYMMETRY);
}

/* ---- its blocks ---- */

/* Matrices of at least so many rows get a hierarchy, blocks of at least so many are left to it: on
 * plane grids of five points multigrid overtakes Cholesky at 6e4 rows, in space at 1000. */
#define PERP__LARGE_MATRIX 1000
#define PERP__LARGE_BLOCK 3000
#define PERP__LARGE_PLANE 60000
#define PERP__PLANE 5 /* entries a row */
/* Conjugate gradient steps: as many take about as long as a factorisation */
#define PERP__STEPS 80

static void layout(perp__arena *arena, void *object)
{
    perp__sparse_block *b = object;
    const size_t n = (size_t)b->M->columns;
    const size_t diagonals = b->kind == PERP__SPARSE_TRIDIAGONAL ? n : 0;

    PERP__INTEGERS(arena, n, &b->active, &b->local);
    b->x = perp__arena_take(arena, n, sizeof(double));
    perp__tridiagonal_layout(arena, &b->T, diagonals);
    perp__tridiagonal_factor_layout(arena, &b->tridiagonal, diagonals);
}

static void layout_general(perp__arena *arena, void *object)
{
    perp__sparse_block *b = object;
    const size_t n = (size_t)b->M->columns;
    const size_t entries = (size_t)b->M->column_starts[n] + n;

    b->starts = perp__arena_take(arena, n + 1, sizeof(int32_t));
    b->rows = perp__arena_take(arena, entries, sizeof(int32_t));
    b->values = perp__arena_take(arena, entries, sizeof(double));
}

static void layout_grid(perp__arena *arena, void *object)
{
    perp__sparse_block *b = object;

    b->residual = perp__arena_take(arena, (size_t)b->M->columns, sizeof(double));
}

perp_status perp__sparse_block_read(perp__sparse_block *block, const perp__matrix *M,
                                    const double *scale)
{
    const int32_t positive = has_positive_diagonal(M);
    int32_t symmetric;
    perp_status status;

    block->M = M;
    block->scale = scale;
    block->factored = 0;
    block->on_grid = 0;
    block->ordered = 0;
    block->grid_built = 0;
    block->suits_grid = block->is_nearly_z = 0;
    block->has_positive_diagonal = positive;
    block->has_z_signs = positive && has_z_signs(M);
    block->kind = perp__is_tridiagonal(M) ? PERP__SPARSE_TRIDIAGONAL : PERP__SPARSE_GENERAL;
    status = perp__arena_fit(&block->arena, block->context, layout, block);
    if (status != PERP_OK)
        return status;
    symmetric = positive && perp__has_symmetric_entries(M, block->local, PERP__ASYMMETRY);
    if (block->kind == PERP__SPARSE_TRIDIAGONAL)
        perp__tridiagonal_read(&block->T, M, scale);
    else if (symmetric)
        block->kind = PERP__SPARSE_SYMMETRIC;
    block->is_nearly_z = positive && M->columns >= PERP__LARGE_MATRIX && is_nearly_z(M, scale);
    block->suits_grid = symmetric && block->is_nearly_z;
    return PERP_OK;
}

/* The block in compressed columns. */
static perp__square extract(perp__sparse_block *b)
{
    const perp__matrix *M = b->M;
    const perp__square A = {b->count, b->values, b->starts, b->rows};
    int32_t at = 0, c, k;

    for (k = 0; k < M->columns; k++)
        b->local[k] = -1;
    for (k = 0; k < b->count; k++)
        b->local[b->active[k]] = k;
    for (c = 0; c < b->count; c++) {
        const int32_t j = b->active[c];
        const double shift = b->weights ? b->weights[j] : b->rho;
        int32_t placed = shift == 0.0; /* the diagonal's entry, needed for a shift */

        b->starts[c] = at;
        for (k = M->column_starts[j]; k < M->column_starts[j + 1]; k++) {
            const int32_t i = M->row_indices[k];

            if (b->local[i] < 0)
                continue;
            if (!placed && i > j) {
                b->rows[at] = c;
                b->values[at++] = shift;
            }
            placed |= i >= j;
            b->rows[at] = b->local[i];
            b->values[at++] = M->values[k] * (b->scale[i] * b->scale[j]) + (i == j ? shift : 0.0);
        }
        if (!placed) {
            b->rows[at] = c;
            b->values[at++] = shift;
        }
    }
    b->starts[b->count] = at;
    return A;
}

/* An LU factorisation with room for every block. */
static perp_status make_lu(perp__sparse_block *b)
{
    perp_status status;

    perp__factor_klu.destroy(b->lu);
    b->lu = NULL;
    b->lu_capacity = 0;
    status = perp__factor_with_room(b->context, &b->lu, b->M->columns, b->starts, b->rows);
    if (status == PERP_OK)
        b->lu_capacity = b->M->columns;
    return status;
}

static perp_status factor_general(perp__sparse_block *b)
{
    perp__square A;
    perp_status status = perp__arena_fit(&b->general_arena, b->context, layout_general, b);

    if (status == PERP_OK && b->lu_capacity < b->M->columns)
        status = make_lu(b);
    if (status != PERP_OK)
        return status;
    A = extract(b);
    status = perp__factor_klu.reanalyse(b->lu, &A);
    return status == PERP_OK ? perp__factor_klu.factor(b->lu, &A, 0) : status;
}

perp_status perp__sparse_block_grid(perp__sparse_block *block, perp__multigrid **grid)
{
    perp_status status = PERP_OK;

    *grid = NULL;
    if (!block->suits_grid || block->grid_built < 0)
        return PERP_OK;
    if (!block->grid_built) {
        block->grid.context = block->context;
        status = perp__multigrid_build(&block->grid, block->M, block->scale);
        if (status == PERP_OK)
            status = perp__arena_fit(&block->grid_arena, block->context, layout_grid, block);
        if (status != PERP_OK)
            return status;
        block->grid_built = 1;
    }
    if (block->grid.levels == 1) /* nothing to coarsen */
        return PERP_OK;
    block->on_grid = 0;
    *grid = &block->grid;
    return PERP_OK;
}

void perp__sparse_block_restart(perp__sparse_block *block)
{
    if (block->grid_built < 0) {
        block->grid_built = 1;
        block->factored = 0;
    }
}

static perp_status factor_symmetric(perp__sparse_block *b)
{
    if (!b->ordered) {
        perp_status status =
            perp__sparse_cholesky_analyse(&b->cholesky, b->context, b->M, b->scale);

        if (status != PERP_OK)
            return status;
        b->ordered = 1;
    }
    b->by_lu = !perp__sparse_cholesky_factor(&b->cholesky, b->active, b->count, b->rho);
    return b->by_lu ? factor_general(b) : PERP_OK;
}

/* Whether it holds the factors, or else the coarse matrices, of this block. */
static int32_t holds(const perp__sparse_block *b, const int32_t *active, int32_t count, double rho)
{
    return b->count == count && b->rho == rho &&
           (count == 0 || !memcmp(b->active, active, (size_t)count * sizeof *active));
}

static void take(perp__sparse_block *b, const int32_t *active, int32_t count, double rho)
{
    if (count > 0)
        memmove(b->active, active, (size_t)count * sizeof *active);
    b->count = count;
    b->rho = rho;
    b->weights = NULL;
    b->by_lu = 0;
    b->factored = 0;
    b->on_grid = 0;
}

static perp_status factor(perp__sparse_block *b)
{
    perp_status status;

    if (b->kind == PERP__SPARSE_TRIDIAGONAL)
        status = perp__tridiagonal_factorise(&b->tridiagonal, &b->T, b->active, b->count, b->rho)
                     ? PERP_OK
                     : PERP__FACTOR_SINGULAR;
    else if (b->kind == PERP__SPARSE_SYMMETRIC)
        status = factor_symmetric(b);
    else
        status = factor_general(b);
    b->factored = status == PERP_OK;
    return status;
}

perp_status perp__sparse_block_factor(perp__sparse_block *block, const int32_t *active,
                                      int32_t count, double rho)
{
    if (block->factored && holds(block, active, count, rho))
        return PERP_OK;
    take(block, active, count, rho);
    return factor(block);
}

perp_status perp__sparse_block_factor_with(perp__sparse_block *block, const int32_t *active,
                                           int32_t count, const double *weights)
{
    perp_status status;

    take(block, active, count, NAN); /* nobody asks for these again */
    block->weights = weights;
    block->by_lu = 1;
    status = factor_general(block);
    block->weights = NULL;
    block->factored = status == PERP_OK;
    return status;
}

void perp__sparse_block_solve(perp__sparse_block *block, double *x, int32_t transposed)
{
    if (block->kind == PERP__SPARSE_SYMMETRIC && !block->by_lu) {
        perp__sparse_cholesky_solve(&block->cholesky, x);
        return;
    }
    for (int32_t k = 0; k < block->count; k++)
        block->x[k] = x[block->active[k]];
    if (block->by_lu || block->kind != PERP__SPARSE_TRIDIAGONAL)
        perp__factor_klu.solve(block->lu, block->x, transposed);
    else if (transposed)
        perp__tridiagonal_solve_transposed(&block->tridiagonal, block->x);
    else
        perp__tridiagonal_solve(&block->tridiagonal, block->x);
    for (int32_t k = 0; k < block->count; k++)
        x[block->active[k]] = block->x[k];
}

perp_status perp__sparse_block_approach(perp__sparse_block *block, const int32_t *active,
                                        int32_t count)
{
    const int32_t n = block->M->columns;
    const int32_t is_plane = block->M->column_starts[n] / PERP__PLANE <= n;
    const int32_t largest = is_plane ? PERP__LARGE_PLANE : PERP__LARGE_BLOCK;
    perp__multigrid *grid = NULL;
    perp_status status = PERP_OK;

    if ((block->factored || block->on_grid) && holds(block, active, count, 0.0))
        return PERP_OK;
    if (count >= largest && block->kind != PERP__SPARSE_TRIDIAGONAL)
        status = perp__sparse_block_grid(block, &grid);
    if (status != PERP_OK)
        return status;
    take(block, active, count, 0.0);
    block->on_grid = grid && perp__multigrid_take_block(grid, 0, block->active, count);
    return block->on_grid ? PERP_OK : factor(block);
}

/* Returns 0 if multigrid does not get there. */
static int32_t solve_on_grid(perp__sparse_block *b, double *x)
{
    for (int32_t k = 0; k < b->count; k++)
        b->residual[b->active[k]] = x[b->active[k]];
    if (perp__multigrid_solve(&b->grid, b->residual, b->x, PERP__ROUGH, PERP__STEPS) < 0)
        return 0;
    for (int32_t k = 0; k < b->count; k++)
        x[b->active[k]] = b->x[b->active[k]];
    return 1;
}

perp_status perp__sparse_block_solve_roughly(perp__sparse_block *block, double *x)
{
    perp_status status = PERP_OK;

    if (block->on_grid && solve_on_grid(block, x))
        return PERP_OK;
    if (block->on_grid) {
        block->grid_built = -1;
        block->on_grid = 0;
        status = factor(block);
    }
    if (status == PERP_OK)
        perp__sparse_block_solve(block, x, 0);
    return status;
}

void perp__sparse_block_release(perp__sparse_block *block)
{
    perp__arena_release(&block->arena);
    perp__arena_release(&block->general_arena);
    perp__arena_release(&block->grid_arena);
    perp__multigrid_release(&block->grid);
    perp__sparse_cholesky_release(&block->cholesky);
    perp__factor_klu.destroy(block->lu);
    block->lu = NULL;
    block->lu_capacity = 0;
    block->factored = 0;
}
