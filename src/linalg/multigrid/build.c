/* The levels of the hierarchy: aggregates, prolongation, coarse matrices. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "linalg/multigrid/multigrid.h"

/* ---- which rows form a coarse variable: rows that are strongly coupled (Vanek, Mandel & Brezina
 * 1996, section 5) ---- */

#define PERP__MANY_SWEEPS 10

/* S_ij < 0 and S_ij^2 > threshold^2 S_ii S_jj */
static bool is_coupled(const perp__level *level, double threshold, int32_t i, int32_t k)
{
    const int32_t j = level->rows[k];
    const double value = level->values[k];

    return value < 0.0 && j != i &&
           value * value * level->inverse_diagonal[i] * level->inverse_diagonal[j] >
               threshold * threshold;
}

/* Symmetric Gauss-Seidel sweeps on S t = 0 from t = 1, keeping t positive. Where neighbouring rows
 * differ in scale, as across a jump of a coefficient, many rows change by more than a twentieth and
 * it takes more sweeps. */
static void find_near_null(const perp__multigrid *grid)
{
    const perp__level *level = &grid->level[0];
    const int32_t n = level->n;
    int32_t changes = n;
    double *t = level->near_null;

    for (int32_t i = 0; i < n; i++)
        t[i] = 1.0;
    for (int32_t sweeps = 0; sweeps < PERP__MANY_SWEEPS && changes > n / 10; sweeps++) {
        changes = 0;
        for (int32_t step = 0; step < 2 * n && !perp__multigrid_is_late(grid, step); step++) {
            const int32_t i = step < n ? step : 2 * n - 1 - step;
            const double sum = perp__level_times(level, level->values, i, t), before = t[i];

            t[i] = fmax(before - sum * level->inverse_diagonal[i], 0x1p-10 * before);
            changes += step < n && fabs(t[i] - before) > 0.05 * before;
        }
    }
}

static void find_aggregates(perp__level *level, double threshold)
{
    int32_t *aggregate = level->aggregate;

    for (int32_t i = 0; i < level->n; i++)
        aggregate[i] = -1;
    /* 1. A row whose strong neighbours are all unclaimed starts an aggregate with them. Rows
     * without strong neighbours belong to none: sweeps alone solve for them. */
    for (int32_t i = 0; i < level->n; i++) {
        int32_t strong = 0, claimed = aggregate[i] >= 0;

        for (int32_t k = level->starts[i]; k < level->starts[i + 1] && !claimed; k++)
            if (is_coupled(level, threshold, i, k)) {
                strong++;
                claimed = aggregate[level->rows[k]] >= 0;
            }
        if (claimed || strong == 0)
            continue;
        for (int32_t k = level->starts[i]; k < level->starts[i + 1]; k++)
            if (is_coupled(level, threshold, i, k))
                aggregate[level->rows[k]] = level->coarse;
        aggregate[i] = level->coarse++;
    }
    /* 2. What is left next to an aggregate joins that of its strongest neighbour; -2 - a until all
     * have chosen. */
    for (int32_t i = 0; i < level->n; i++) {
        double largest = 0.0;
        int32_t found = -1;

        if (aggregate[i] != -1)
            continue;
        for (int32_t k = level->starts[i]; k < level->starts[i + 1]; k++) {
            const int32_t a = aggregate[level->rows[k]];

            if (a >= 0 && -level->values[k] > largest && is_coupled(level, threshold, i, k)) {
                largest = -level->values[k];
                found = a;
            }
        }
        aggregate[i] = found < 0 ? -1 : -2 - found;
    }
    for (int32_t i = 0; i < level->n; i++)
        if (aggregate[i] < -1)
            aggregate[i] = -2 - aggregate[i];
}

/* ---- memory ---- */

#define PERP__SLOWEST 0.8       /* coarse rows per row: coarsening as slow as that does not pay */
#define PERP__THRESHOLD 0.08    /* on the finest level, half as much on each coarser one */
#define PERP__DAMPING (2.0 / 3) /* 4/3 over 2, the largest eigenvalue of D^-1 S */

void perp__multigrid_release(perp__multigrid *grid)
{
    for (int32_t k = 0; k < PERP__LEVELS && grid->level; k++) {
        perp__arena_release(&grid->level[k].arena);
        perp__arena_release(&grid->level[k].transfer_arena);
        perp__arena_release(&grid->level[k].matrix_arena);
    }
    perp__fronts_release(&grid->bottom);
    perp__arena_release(&grid->arena);
    perp__release(grid->context, grid->level);
    grid->level = NULL;
    grid->levels = 0;
}

static void layout(perp__arena *arena, void *object)
{
    perp__multigrid *grid = object;
    const size_t n = (size_t)grid->level[0].n;

    PERP__DOUBLES(arena, n, &grid->sums, &grid->direction, &grid->product, &grid->preconditioned);
    grid->marks = perp__arena_take(arena, n, sizeof(int32_t));
}

static void layout_level(perp__arena *arena, void *object)
{
    perp__level *level = object;
    const size_t n = (size_t)level->n;

    PERP__DOUBLES(arena, n, &level->inverse_diagonal, &level->block_inverse_diagonal,
                  &level->near_null, &level->x, &level->b);
    PERP__INTEGERS(arena, n, &level->aggregate, &level->active);
    level->p_starts = perp__arena_take(arena, n + 1, sizeof(int32_t));
    level->inside = perp__arena_take(arena, n, sizeof(int8_t));
}

/* A row of P has no more entries than that of S. */
static void layout_transfer(perp__arena *arena, void *object)
{
    perp__level *level = object;

    PERP__INTEGERS(arena, level->entries, &level->p_columns, &level->r_rows);
    PERP__DOUBLES(arena, level->entries, &level->p_values, &level->r_values);
    level->r_starts = perp__arena_take(arena, (size_t)level->coarse + 1, sizeof(int32_t));
}

/* The finest level borrows the caller's pattern, where its columns are rows. */
static void layout_finest(perp__arena *arena, void *object)
{
    perp__level *level = object;
    const bool borrows = level->starts != NULL;

    level->own_values = perp__arena_take(arena, level->entries, sizeof(double));
    level->own_starts =
        perp__arena_take(arena, borrows ? 0 : (size_t)level->n + 1, sizeof(int32_t));
    level->own_rows = perp__arena_take(arena, borrows ? 0 : level->entries, sizeof(int32_t));
}

static void layout_matrix(perp__arena *arena, void *object)
{
    perp__level *level = object;

    level->own_starts = perp__arena_take(arena, (size_t)level->n + 1, sizeof(int32_t));
    level->own_rows = perp__arena_take(arena, level->entries, sizeof(int32_t));
    PERP__DOUBLES(arena, level->entries, &level->own_values, &level->block_values);
}

static perp_status read_finest(perp__multigrid *grid, const perp__matrix *M)
{
    perp__level *level = &grid->level[0];
    perp_status status;

    level->n = M->columns;
    level->starts = grid->unsymmetric ? NULL : M->column_starts;
    level->rows = M->row_indices;
    level->entries = (size_t)M->column_starts[M->columns];
    status = perp__arena_fit(&grid->arena, grid->context, layout, grid);
    PERP__THEN(status, perp__arena_fit(&level->arena, grid->context, layout_level, level));
    PERP__THEN(status, perp__arena_fit(&level->matrix_arena, grid->context, layout_finest, level));
    if (status != PERP_OK)
        return status;
    if (grid->unsymmetric) {
        perp__transpose_csc(M, level->own_starts, level->own_rows, level->own_values);
        level->starts = level->own_starts;
        level->rows = level->own_rows;
    } else {
        memcpy(level->own_values, M->values, level->entries * sizeof *M->values);
    }
    for (int32_t i = 0; i < level->n; i++) {
        grid->sums[i] = 0.0;
        for (int32_t k = level->starts[i]; k < level->starts[i + 1]; k++)
            if (level->rows[k] == i)
                level->inverse_diagonal[i] = 1.0 / level->own_values[k];
    }
    level->values = level->own_values;
    return PERP_OK;
}

/* The entry of P in column a of the row that begins at `start`; a new one if there is none. */
static double *value_of(const perp__level *fine, int32_t a, int32_t start, int32_t *end,
                        int32_t *marks)
{
    if (marks[a] < start) {
        marks[a] = (*end)++;
        fine->p_columns[marks[a]] = a;
        fine->p_values[marks[a]] = 0.0;
    }
    return &fine->p_values[marks[a]];
}

/* P = (I - 2/3 diag(F)^-1 F) P0, a damped Jacobi sweep on the aggregates' shares of t. F is S
 * without its weak couplings: they are added to the diagonal such that F t = S t. The rows of P
 * stay short where couplings are weak in some directions. */
static void fill_prolongation(perp__level *fine, const double *coarse_null, double threshold,
                              int32_t *marks)
{
    const double *t = fine->near_null;

    for (int32_t a = 0; a < fine->coarse; a++)
        marks[a] = -1;
    fine->p_starts[0] = 0;
    for (int32_t i = 0; i < fine->n; i++) {
        const int32_t start = fine->p_starts[i], copy = fine->aggregate[i];
        const double diagonal = 1.0 / fine->inverse_diagonal[i];
        double weak = 0.0, damping;
        int32_t end = start;

        for (int32_t k = fine->starts[i]; k < fine->starts[i + 1]; k++)
            if (fine->rows[k] != i && !is_coupled(fine, threshold, i, k))
                weak += fine->values[k] * t[fine->rows[k]];
        damping = PERP__DAMPING / fmax(diagonal + weak / t[i], 0.1 * diagonal);
        if (copy >= 0)
            *value_of(fine, copy, start, &end, marks) =
                (1.0 - PERP__DAMPING) * t[i] / coarse_null[copy];
        for (int32_t k = fine->starts[i]; k < fine->starts[i + 1]; k++) {
            const int32_t j = fine->rows[k], a = fine->aggregate[j];

            if (a >= 0 && is_coupled(fine, threshold, i, k))
                *value_of(fine, a, start, &end, marks) -=
                    damping * fine->values[k] * t[j] / coarse_null[a];
        }
        fine->p_starts[i + 1] = end;
    }
}

/* The pattern of P' S P; without `writes` it only counts. Returns the number of entries. */
static size_t coarse_pattern(const perp__multigrid *grid, const perp__level *fine,
                             const perp__level *coarse, bool writes)
{
    int32_t *marks = grid->marks;
    size_t entries = 0;

    for (int32_t a = 0; a < fine->coarse; a++)
        marks[a] = -1;
    for (int32_t a = 0; a < fine->coarse && !perp__multigrid_is_late(grid, a); a++) {
        if (writes)
            coarse->own_starts[a] = (int32_t)entries;
        for (int32_t r = fine->r_starts[a]; r < fine->r_starts[a + 1]; r++) {
            const int32_t i = fine->r_rows[r];

            for (int32_t k = fine->starts[i]; k < fine->starts[i + 1]; k++) {
                const int32_t j = fine->rows[k];

                for (int32_t p = fine->p_starts[j]; p < fine->p_starts[j + 1]; p++) {
                    if (marks[fine->p_columns[p]] == a)
                        continue;
                    marks[fine->p_columns[p]] = a;
                    if (writes)
                        coarse->own_rows[entries] = fine->p_columns[p];
                    entries++;
                }
            }
        }
    }
    if (writes)
        coarse->own_starts[fine->coarse] = (int32_t)entries;
    return entries;
}

/* Makes the level after `k`, or finds that there is none: then the k-th has coarse = 0. */
static perp_status make_level(perp__multigrid *grid, int32_t k)
{
    perp__level *fine = &grid->level[k], *coarse = fine + 1;
    const double threshold = ldexp(PERP__THRESHOLD, -k);
    int32_t *counts = grid->marks;
    perp__matrix P; /* its rows as columns */
    perp_status status;

    /* 1. Aggregates are the coarse variables. */
    fine->coarse = 0;
    if (fine->n <= PERP__COARSEST || k + 1 == PERP__LEVELS)
        return PERP_OK;
    find_aggregates(fine, threshold);
    if (fine->coarse > PERP__SLOWEST * fine->n)
        fine->coarse = 0;
    if (fine->coarse == 0)
        return PERP_OK;
    coarse->n = fine->coarse;
    status = perp__arena_fit(&coarse->arena, grid->context, layout_level, coarse);
    if (status != PERP_OK)
        return status;
    /* 2. The mean of t over each aggregate. */
    for (int32_t a = 0; a < coarse->n; a++) {
        coarse->near_null[a] = 0.0;
        counts[a] = 0;
    }
    for (int32_t i = 0; i < fine->n; i++)
        if (fine->aggregate[i] >= 0) {
            coarse->near_null[fine->aggregate[i]] += fine->near_null[i];
            counts[fine->aggregate[i]]++;
        }
    for (int32_t a = 0; a < coarse->n; a++)
        coarse->near_null[a] /= counts[a];
    /* 3. P by rows and columns, and P' S P. */
    status = perp__arena_fit(&fine->transfer_arena, grid->context, layout_transfer, fine);
    if (status != PERP_OK)
        return status;
    fill_prolongation(fine, coarse->near_null, threshold, grid->marks);
    P = (perp__matrix){coarse->n, fine->n, 1, 1, fine->p_values, fine->p_starts, fine->p_columns};
    perp__transpose_csc(&P, fine->r_starts, fine->r_rows, fine->r_values);
    coarse->entries = coarse_pattern(grid, fine, coarse, 0);
    if (coarse->entries > INT32_MAX)
        return perp__fail_memory(grid->context, "a coarse matrix");
    status = perp__arena_fit(&coarse->matrix_arena, grid->context, layout_matrix, coarse);
    if (status != PERP_OK || perp__is_past(grid->deadline))
        return status;
    coarse_pattern(grid, fine, coarse, 1);
    coarse->starts = coarse->own_starts;
    coarse->rows = coarse->own_rows;
    coarse->values = coarse->own_values;
    perp__coarse_values(grid, fine, fine->values, NULL, coarse, coarse->own_values,
                        coarse->inverse_diagonal);
    return PERP_OK;
}

perp_status perp__multigrid_build(perp__multigrid *grid, const perp__matrix *S)
{
    const perp__level *last;
    perp_status status;
    int32_t k = 0;

    if (!grid->level)
        grid->level = perp__allocate_zeros(grid->context, PERP__LEVELS, sizeof *grid->level,
                                           "the levels of multigrid");
    status = grid->level ? read_finest(grid, S) : PERP_ERROR_MEMORY;
    if (status == PERP_OK)
        find_near_null(grid);
    while (status == PERP_OK && !perp__is_past(grid->deadline)) {
        status = make_level(grid, k);
        if (grid->level[k].coarse == 0)
            break;
        k++;
    }
    grid->levels = 0;
    if (status == PERP_OK && perp__is_past(grid->deadline))
        return PERP_OK;
    if (status == PERP_OK && k > 0 && !grid->unsymmetric) { /* the last level is factored */
        last = &grid->level[k];
        for (int32_t i = 0; i < last->n; i++)
            last->active[i] = i;
        grid->bottom.is_symmetric = grid->bottom.takes_blocks = 1;
        status = perp__fronts_analyse(&grid->bottom, grid->context, last->n, 1, last->starts,
                                      last->rows);
    }
    grid->levels = status == PERP_OK ? k + 1 : 0;
    return status;
}
