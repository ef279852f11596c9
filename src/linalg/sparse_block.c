#include "linalg/sparse_block.h"

#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/rounding.h"
#include "linalg/blas.h"
#include "linalg/signs.h"

/* Blocks of at least so many rows are left to a hierarchy: on plane grids of five points multigrid
 * overtakes Cholesky at 6e4 rows, in space at 1000. */
#define PERP__LARGE_BLOCK 3000
#define PERP__LARGE_PLANE 60000
#define PERP__PLANE 5 /* entries a row */
/* A product in a dense front takes a tenth of what an entry takes in a sparse product: a
 * factorisation as many steps without a preconditioner. Below so many, these are not tried. */
#define PERP__ENTRY 10.0
#define PERP__LEAST_STEPS 500.0

/* What an ordering takes for each entry, and LU for each product, in units of what reading an entry
 * takes: 20 to 110 and 0.2 to 0.3, on grids in the plane and in space. Only a time limit asks. */
#define ORDERING 110.0
#define PRODUCT 0.25

static void layout(perp__arena *arena, void *object)
{
    perp__sparse_block *b = object;
    const size_t n = (size_t)b->M->columns;
    const size_t diagonals = b->kind == PERP__SPARSE_TRIDIAGONAL ? n : 0;
    const size_t lines = b->kind == PERP__DENSE ? n : 0;

    PERP__INTEGERS(arena, n, &b->active, &b->local);
    PERP__DOUBLES(arena, n, &b->x, &b->residual, &b->direction, &b->product, &b->diagonal);
    perp__tridiagonal_layout(arena, &b->T, diagonals);
    perp__tridiagonal_factor_layout(arena, &b->tridiagonal, diagonals);
    b->dense = b->room ? b->room : perp__arena_take(arena, lines * n, sizeof(double));
    b->pivots = perp__arena_take(arena, lines, sizeof(int32_t));
    perp__border_layout(arena, &b->border, lines);
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

perp_status perp__sparse_block_read(perp__sparse_block *block, const perp__matrix *M,
                                    const double *row_norms)
{
    const double started = perp__now();
    const bool positive = perp__has_positive_diagonal(M), is_dense = !M->column_starts;
    const double entries = is_dense ? (double)M->rows * M->rows : M->column_starts[M->columns];
    perp_status status;

    block->M = M;
    block->factored = 0;
    block->on_grid = 0;
    block->ordered = 0;
    block->by_steps = 0;
    block->steps = -1;
    block->grid_built = 0;
    block->border.is_open = block->border.changes = 0;
    block->suits_grid = block->is_nearly_z = 0;
    block->has_positive_diagonal = positive;
    block->has_z_signs = positive && !is_dense && perp__has_z_signs(M);
    block->kind = is_dense                  ? PERP__DENSE
                  : perp__is_tridiagonal(M) ? PERP__SPARSE_TRIDIAGONAL
                                            : PERP__SPARSE_GENERAL;
    status = perp__arena_fit(&block->arena, block->context, layout, block);
    if (status != PERP_OK)
        return status;
    block->is_symmetric =
        is_dense ? perp__is_dense_symmetric(M, row_norms)
                 : positive && perp__has_symmetric_entries(M, block->local, PERP__ROUNDING_LIMIT);
    if (block->kind == PERP__SPARSE_TRIDIAGONAL)
        perp__tridiagonal_read(&block->T, M);
    else if (block->is_symmetric && !is_dense)
        block->kind = PERP__SPARSE_SYMMETRIC;
    block->is_nearly_z =
        positive && !is_dense && M->columns >= PERP__LARGE_MATRIX && perp__is_nearly_z(M);
    block->suits_grid =
        block->is_nearly_z && (block->is_symmetric || block->kind == PERP__SPARSE_GENERAL);
    block->pace = (perp__now() - started) / (entries + 1.0);
    return PERP_OK;
}

/* The block in compressed columns. */
static perp__square extract(perp__sparse_block *b)
{
    const perp__square A = {b->count, b->values, b->starts, b->rows};
    const perp__index_set set = {b->count, b->active, b->local};

    for (int32_t k = 0; k < b->M->columns; k++)
        b->local[k] = -1;
    for (int32_t k = 0; k < b->count; k++)
        b->local[b->active[k]] = k;
    perp__principal_csc(b->M, &set, b->rho, b->weights, b->starts, b->rows, b->values);
    return A;
}

/* Whether there is no time left for something that takes as long as reading so many entries. */
static bool is_late(perp__sparse_block *b, double entries)
{
    if (b->deadline > 0.0 && perp__now() + b->pace * entries > b->deadline)
        b->late = 1;
    return b->late;
}

/* Whether that may be so for the ordering, which comes but once and cannot be ended. */
static bool orders_late(const perp__sparse_block *b)
{
    return !b->ordered && b->deadline > 0.0 &&
           perp__now() + b->pace * ORDERING * b->M->column_starts[b->M->columns] > b->deadline;
}

bool perp__block_is_late(perp__sparse_block *block, double products)
{
    return is_late(block, PRODUCT * products);
}

/* The block in compressed columns, ordered for LU. */
static perp_status order_general(perp__sparse_block *b, perp__square *A)
{
    perp_status status = perp__arena_fit(&b->general_arena, b->context, layout_general, b);

    if (status == PERP_OK && b->lu_capacity < b->M->columns) { /* room for every block */
        perp__klu_destroy(b->lu);
        b->lu = NULL;
        b->lu_capacity = 0;
        status = perp__klu_with_room(b->context, &b->lu, b->M->columns, b->starts, b->rows);
        if (status == PERP_OK)
            b->lu_capacity = b->M->columns;
    }
    if (status != PERP_OK)
        return status;
    *A = extract(b);
    if (is_late(b, 2.0 * ORDERING * (double)A->column_starts[A->n])) /* it orders A + A' */
        return PERP__FACTOR_SINGULAR;
    return perp__klu_reanalyse(b->lu, A);
}

static perp_status factor_general(perp__sparse_block *b)
{
    perp__square A;
    const perp_status status = order_general(b, &A);

    /* a search for each column comes before its products */
    if (status == PERP_OK &&
        is_late(b, ORDERING * (double)A.column_starts[A.n] + PRODUCT * perp__klu_products(b->lu)))
        return PERP__FACTOR_SINGULAR;
    return status == PERP_OK ? perp__klu_factor(b->lu, &A) : status;
}

perp_status perp__sparse_block_lu_cost(perp__sparse_block *block, int64_t *products)
{
    perp_status status;
    perp__square A;

    block->count = block->M->columns;
    block->factored = 0;
    block->rho = 0.0;
    for (int32_t i = 0; i < block->count; i++)
        block->active[i] = i;
    status = order_general(block, &A);
    *products = 1;
    if (status == PERP_OK)
        *products += (int64_t)(perp__klu_products(block->lu) / A.column_starts[A.n]);
    return status == PERP__FACTOR_SINGULAR ? PERP_OK : status;
}

perp_status perp__sparse_block_grid(perp__sparse_block *block, perp__multigrid **grid)
{
    perp_status status = PERP_OK;

    *grid = NULL;
    if (!block->suits_grid || block->grid_built < 0 || block->late)
        return PERP_OK;
    block->grid.deadline = block->deadline;
    if (!block->grid_built) {
        block->grid.context = block->context;
        block->grid.unsymmetric = block->kind == PERP__SPARSE_GENERAL;
        status = perp__multigrid_build(&block->grid, block->M);
        block->late |= status == PERP_OK && block->grid.levels == 0;
        if (status != PERP_OK || block->late)
            return status;
        block->grid_built = 1;
    }
    if (block->grid.levels == 1) /* nothing to coarsen */
        return PERP_OK;
    block->on_grid = 0;
    *grid = &block->grid;
    return PERP_OK;
}

void perp__sparse_block_restart(perp__sparse_block *block, double deadline)
{
    block->deadline = deadline;
    block->late = 0;
    block->border.is_open = block->border.changes = 0;
    if (block->by_steps) { /* steps that there are for a block do not tell from what was before */
        block->by_steps = 0;
        block->count = -1;
    }
    if (block->grid_built < 0) {
        block->grid_built = 1;
        block->factored = 0;
    }
}

/* Whether it holds the factors, or else the coarse matrices, of this block. */
static bool holds(const perp__sparse_block *b, const int32_t *active, int32_t count, double rho)
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
    b->border.is_open = b->border.changes = 0;
    b->by_lu = 0;
    b->factored = 0;
    b->on_grid = 0;
    b->by_steps = b->by_steps < 0 ? -1 : 0;
}

/* The fronts of the matrix, but where they cost more than `most` products; PERP__FACTOR_SINGULAR
 * where that would be late. */
static perp_status find_fronts(perp__sparse_block *b, double most)
{
    const perp__matrix *M = b->M;
    perp_status status;

    if (is_late(b, ORDERING * (double)M->column_starts[M->columns]))
        return PERP__FACTOR_SINGULAR;
    b->fronts.is_symmetric = b->fronts.takes_blocks = 1;
    b->fronts.most_products = most;
    status = perp__fronts_analyse(&b->fronts, b->context, M->columns, 1, M->column_starts,
                                  M->row_indices);
    b->ordered = status == PERP_OK && !b->fronts.is_too_large;
    return status;
}

/* Cholesky's factors; PERP__FACTOR_SINGULAR where the block is not positive definite. */
static perp_status factor_definite(perp__sparse_block *b)
{
    const perp__matrix *M = b->M;
    const perp_status status = b->ordered ? PERP_OK : find_fronts(b, 0.0);

    if (status != PERP_OK)
        return status;
    b->fronts.deadline = b->deadline;
    perp__fronts_take(&b->fronts, b->active, b->count);
    for (int32_t c = 0; c < b->count; c++) {
        const int32_t j = b->active[c];

        for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++) {
            b->fronts.values[k] = M->values[k];
            if (M->row_indices[k] == j)
                b->fronts.values[k] += b->weights ? b->weights[j] : b->rho;
        }
    }
    if (is_late(b, 0.0) || !perp__fronts_factor(&b->fronts, 0, b->count))
        return PERP__FACTOR_SINGULAR;
    return PERP_OK;
}

/* Overflow is of no more use than a zero pivot. */
static perp_status factor_dense(perp__sparse_block *b)
{
    const size_t n = (size_t)b->M->rows, count = (size_t)b->count;
    const int32_t order = b->count, stride = order > 0 ? order : 1;
    const double products = (double)count * (double)count * (double)count;
    bool regular = 0;

    for (int32_t by_lu = !b->is_symmetric; by_lu < 2 && !regular; by_lu++) {
        if (is_late(b, PRODUCT * products / (by_lu ? 3.0 : 6.0)))
            return PERP__FACTOR_SINGULAR;
        for (size_t c = 0; c < count; c++) {
            const double *from = b->M->values + (size_t)b->active[c] * n;
            double *column = b->dense + c * count;

            for (size_t r = by_lu ? 0 : c; r < count; r++)
                column[r] = from[b->active[r]];
            column[c] += b->weights ? b->weights[b->active[c]] : b->rho;
        }
        regular = by_lu ? perp__lu_factor(order, b->dense, stride, b->pivots) == 0
                        : perp__cholesky_factor(order, b->dense, stride) == 0;
        b->by_lu = by_lu;
    }
    for (size_t k = 0; k < count; k++)
        regular = regular && isfinite(b->dense[k * (count + 1)]);
    return regular ? PERP_OK : PERP__FACTOR_SINGULAR;
}

static perp_status factor(perp__sparse_block *b)
{
    perp_status status = PERP__FACTOR_SINGULAR;

    if (is_late(b, 0.0))
        return status;
    if (b->kind == PERP__DENSE) {
        status = factor_dense(b);
    } else if (b->kind == PERP__SPARSE_TRIDIAGONAL && !b->weights) {
        if (perp__tridiagonal_factorise(&b->tridiagonal, &b->T, b->active, b->count, b->rho))
            status = PERP_OK;
    } else {
        if (b->kind == PERP__SPARSE_SYMMETRIC)
            status = factor_definite(b);
        b->by_lu = status == PERP__FACTOR_SINGULAR && !is_late(b, 0.0);
        if (b->by_lu)
            status = factor_general(b);
    }
    b->factored = status == PERP_OK;
    return status;
}

perp_status perp__sparse_block_factor(perp__sparse_block *block, const int32_t *active,
                                      int32_t count, double rho)
{
    if (block->factored && holds(block, active, count, rho)) {
        block->border.changes = 0;
        return PERP_OK;
    }
    take(block, active, count, rho);
    return factor(block);
}

perp_status perp__sparse_block_factor_with(perp__sparse_block *block, const int32_t *active,
                                           int32_t count, const double *weights)
{
    perp_status status;

    take(block, active, count, NAN); /* nobody asks for these again */
    block->weights = weights;
    status = factor(block);
    block->weights = NULL;
    return status;
}

void perp__dense_block_solve(const perp__sparse_block *block, int32_t columns, double *X,
                             int32_t transposed)
{
    if (block->count == 0)
        return;
    if (block->by_lu)
        perp__lu_solve_columns(block->count, columns, block->dense, block->count, block->pivots, X,
                               block->M->rows, transposed);
    else
        perp__cholesky_solve(block->count, columns, block->dense, block->count, X, block->M->rows);
}

void perp__sparse_block_solve(perp__sparse_block *block, double *x, int32_t transposed)
{
    if (block->kind == PERP__SPARSE_SYMMETRIC && !block->by_lu) {
        perp__fronts_solve(&block->fronts, 0, block->count, x);
        return;
    }
    for (int32_t k = 0; k < block->count; k++)
        block->x[k] = x[block->active[k]];
    if (block->kind == PERP__DENSE) {
        perp__dense_block_solve(block, 1, block->x, transposed);
        if (block->border.changes > 0)
            perp__border_solve(block, x);
    } else if (block->by_lu)
        perp__klu_solve(block->lu, block->x, transposed);
    else if (transposed)
        perp__tridiagonal_solve_transposed(&block->tridiagonal, block->x);
    else
        perp__tridiagonal_solve(&block->tridiagonal, block->x);
    for (int32_t k = 0; k < block->count; k++)
        x[block->active[k]] = block->x[k];
}

/* How many steps of conjugate gradients cost as much as factors of the matrix; by_steps stays 0
 * where these are cheap. */
static perp_status count_steps(perp__sparse_block *b)
{
    const double step = PERP__ENTRY * b->M->column_starts[b->M->columns];
    const perp_status status = b->steps < 0 ? find_fronts(b, PERP__LEAST_STEPS * step) : PERP_OK;

    if (status == PERP_OK && b->steps < 0)
        b->steps = b->ordered ? 0 : (int32_t)fmin(b->fronts.products / step, b->M->columns);
    b->by_steps = status == PERP_OK ? b->steps : 0;
    if (b->by_steps == 0)
        return status;
    for (int32_t i = 0; i < b->M->columns; i++) {
        b->diagonal[i] = perp__entry(b->M, i, i);
        b->direction[i] = 0.0;
    }
    return PERP_OK;
}

/* x_A := M_AA^-1 x_A up to PERP__ROUGH, with the diagonal as preconditioner (Saad, "Iterative
 * Methods for Sparse Linear Systems" (2003), algorithm 9.1). Returns 0 if the steps do not suffice,
 * or the block is not positive definite. */
static bool solve_by_steps(perp__sparse_block *b, const double *right)
{
    double square = 0.0, goal = 0.0, rho = 0.0;

    for (int32_t k = 0; k < b->count; k++) {
        const int32_t i = b->active[k];

        b->residual[i] = right[i];
        b->x[i] = b->direction[i] = 0.0;
        goal += right[i] * right[i];
    }
    square = goal;
    goal *= PERP__ROUGH * PERP__ROUGH;
    for (int32_t step = 0, fresh = 1; square > goal; step++, fresh = 0) {
        const double before = rho;
        double curvature = 0.0, length;

        if (step == b->by_steps || perp__is_past(b->deadline))
            break;
        rho = 0.0;
        for (int32_t k = 0; k < b->count; k++)
            rho +=
                b->residual[b->active[k]] * b->residual[b->active[k]] / b->diagonal[b->active[k]];
        for (int32_t k = 0; k < b->count; k++) {
            const int32_t i = b->active[k];

            b->direction[i] =
                b->residual[i] / b->diagonal[i] + (fresh ? 0.0 : rho / before * b->direction[i]);
        }
        for (int32_t k = 0; k < b->count; k++) {
            const int32_t j = b->active[k];

            b->product[j] = perp__column_times(b->M, j, b->direction);
            curvature += b->product[j] * b->direction[j];
        }
        if (!(curvature > 0.0) || !isfinite(curvature))
            break;
        length = rho / curvature;
        square = 0.0;
        for (int32_t k = 0; k < b->count; k++) {
            const int32_t i = b->active[k];

            b->x[i] += length * b->direction[i];
            b->residual[i] -= length * b->product[i];
            square += b->residual[i] * b->residual[i];
        }
    }
    for (int32_t k = 0; k < b->count; k++)
        b->direction[b->active[k]] = 0.0;
    return square <= goal;
}

/* By a border of the factors that this solve has made or found, or else by new ones. */
static perp_status approach_dense(perp__sparse_block *block, const int32_t *active, int32_t count)
{
    perp_status status;

    if (block->factored && block->border.is_open && perp__border_choose(block, active, count))
        return PERP_OK;
    status = perp__sparse_block_factor(block, active, count, 0.0);
    block->border.is_open = status == PERP_OK;
    if (status == PERP_OK)
        perp__border_begin(block);
    return status;
}

perp_status perp__sparse_block_approach(perp__sparse_block *block, const int32_t *active,
                                        int32_t count)
{
    const int32_t n = block->M->columns, *starts = block->M->column_starts;
    const bool is_plane = starts && starts[n] / PERP__PLANE <= n;
    const int32_t largest = is_plane ? PERP__LARGE_PLANE : PERP__LARGE_BLOCK;
    perp__multigrid *grid = NULL;
    perp_status status = PERP_OK;

    if (block->kind == PERP__DENSE)
        return approach_dense(block, active, count);
    if ((block->factored || block->on_grid || block->by_steps > 0) &&
        holds(block, active, count, 0.0))
        return PERP_OK;
    if (block->kind == PERP__SPARSE_SYMMETRIC && (count >= largest || orders_late(block)))
        status = perp__sparse_block_grid(block, &grid);
    if (status != PERP_OK)
        return status;
    take(block, active, count, 0.0);
    block->on_grid = grid && perp__multigrid_take_block(grid, 0, block->active, count);
    if (block->on_grid)
        return PERP_OK;
    if (block->kind == PERP__SPARSE_SYMMETRIC && block->by_steps == 0 && !is_late(block, 0.0))
        status = count_steps(block);
    return status != PERP_OK || block->by_steps > 0 ? status : factor(block);
}

perp_status perp__sparse_block_solve_roughly(perp__sparse_block *block, double *x)
{
    perp_status status = PERP_OK;

    if (block->by_steps > 0 && solve_by_steps(block, x)) {
        for (int32_t k = 0; k < block->count; k++)
            x[block->active[k]] = block->x[block->active[k]];
        return PERP_OK;
    }
    if (block->by_steps > 0) {
        if (is_late(block, 0.0))
            return PERP__FACTOR_SINGULAR;
        block->by_steps = -1;
        status = factor(block);
    }
    if (block->on_grid) {
        for (int32_t k = 0; k < block->count; k++)
            block->residual[block->active[k]] = x[block->active[k]];
        if (perp__multigrid_solve(&block->grid, block->residual, block->x, PERP__ROUGH,
                                  PERP__STEPS) >= 0) {
            for (int32_t k = 0; k < block->count; k++)
                x[block->active[k]] = block->x[block->active[k]];
            return PERP_OK;
        }
        if (is_late(block, 0.0))
            return PERP__FACTOR_SINGULAR;
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
    perp__multigrid_release(&block->grid);
    perp__fronts_release(&block->fronts);
    perp__klu_destroy(block->lu);
    block->lu = NULL;
    block->lu_capacity = 0;
    block->factored = 0;
}
