#include "linalg/basis.h"

#include <string.h>

#include "base/context.h"
#include "linalg/factor/factor.h"

void perp__basis_layout(perp__arena *arena, perp__basis *basis, int32_t n, size_t entries,
                        int32_t most_spikes, size_t file_entries)
{
    const size_t columns = (size_t)n, spikes = (size_t)most_spikes;

    if (entries < columns) /* the first analysis is of a diagonal */
        entries = columns;
    basis->capacity = n;
    basis->most_spikes = most_spikes;
    basis->file_entries = file_entries;
    basis->n = basis->kernel = basis->spikes = 0;
    PERP__INTEGERS(arena, columns, &basis->position_of, &basis->kernel_row, &basis->single_row,
                   &basis->active);
    PERP__DOUBLES(arena, columns, &basis->single, &basis->part, &basis->wide);
    PERP__INTEGERS(arena, columns + 1, &basis->starts, &basis->outer_starts);
    PERP__INTEGERS(arena, entries, &basis->rows, &basis->outer_positions);
    PERP__DOUBLES(arena, entries, &basis->values, &basis->outer_values);
    basis->work = perp__arena_take(arena, 2 * columns, sizeof(double));
    basis->spike_starts = perp__arena_take(arena, spikes + 1, sizeof(size_t));
    basis->spike_position = perp__arena_take(arena, spikes, sizeof(int32_t));
    basis->spike_pivot = perp__arena_take(arena, spikes, sizeof(double));
    basis->spike_rows = perp__arena_take(arena, file_entries, sizeof(int32_t));
    basis->spike_values = perp__arena_take(arena, file_entries, sizeof(double));
}

static perp__square kernel_of(const perp__basis *basis)
{
    const perp__square K = {basis->kernel, basis->values, basis->starts, basis->rows};

    return K;
}

/* Sets single entries aside with their rows, and splits the other columns into K and R. Returns how
 * many single ones are among these: their rows were taken. */
static int32_t split_columns(perp__basis *basis, const int32_t *columns,
                             const perp__columns *source)
{
    int32_t at = 0, left = 0, inner = 0, outer = 0, r, p, c, k;

    /* 1. Columns that are not set aside one after the other, as they are read. */
    basis->kernel = 0;
    for (r = 0; r < basis->n; r++)
        basis->kernel_row[r] = 0;
    for (p = 0; p < basis->n; p++) {
        int32_t *rows = basis->rows + at;
        double *values = basis->values + at;
        int32_t count = source->read(source->user, columns[p], rows, values);

        basis->single_row[p] = -1;
        if (count == 1 && values[0] != 0.0 && basis->kernel_row[rows[0]] >= 0) {
            basis->kernel_row[rows[0]] = -1 - p;
            basis->single_row[p] = rows[0];
            basis->single[p] = values[0];
            continue;
        }
        left += count == 1;
        basis->position_of[basis->kernel] = p;
        basis->starts[basis->kernel++] = at;
        at += count;
    }
    basis->starts[basis->kernel] = at;
    for (r = 0, p = 0; r < basis->n; r++)
        if (basis->kernel_row[r] >= 0)
            basis->kernel_row[r] = p++;
    /* 2. K in their place, and R. */
    for (c = 0, at = 0; c < basis->kernel; c++) {
        const int32_t to = basis->starts[c + 1];

        basis->starts[c] = inner;
        basis->outer_starts[c] = outer;
        for (k = at; k < to; k++) {
            const int32_t row = basis->kernel_row[basis->rows[k]];

            if (row >= 0) {
                basis->rows[inner] = row;
                basis->values[inner++] = basis->values[k];
            } else {
                basis->outer_positions[outer] = -1 - row;
                basis->outer_values[outer++] = basis->values[k];
            }
        }
        at = to;
    }
    basis->starts[basis->kernel] = inner;
    basis->outer_starts[basis->kernel] = outer;
    return left;
}

perp_status perp__basis_load(perp__basis *basis, perp_context *context, int32_t n,
                             const int32_t *columns, const perp__columns *source,
                             const perp__principal *principal)
{
    perp_status status = PERP_OK;
    bool is_principal;

    /* 1. A factorisation with room for every kernel there can be. */
    if (!basis->factor || basis->factor_order < basis->capacity) {
        perp__basis_release(basis);
        status = perp__klu_with_room(context, &basis->factor, basis->capacity, basis->starts,
                                     basis->rows);
        if (status != PERP_OK)
            return status;
        basis->factor_order = basis->capacity;
    }
    /* 2. The kernel, and whether every column of it has its own row in it. */
    basis->n = n;
    basis->spikes = 0;
    basis->spike_starts[0] = 0;
    is_principal = split_columns(basis, columns, source) == 0 && principal;
    for (int32_t c = 0; c < basis->kernel && is_principal; c++)
        is_principal = basis->kernel_row[basis->position_of[c]] == c;
    /* 3. Its factors. */
    basis->principal.block = NULL;
    if (is_principal) {
        basis->principal = *principal;
        for (int32_t c = 0; c < basis->kernel; c++)
            basis->active[c] = principal->index[basis->position_of[c]];
        status = perp__sparse_block_factor(principal->block, basis->active, basis->kernel,
                                           principal->rho);
    } else {
        const perp__square K = kernel_of(basis);

        status = perp__klu_reanalyse(basis->factor, &K);
        PERP__THEN(status, perp__klu_factor(basis->factor, &K));
    }
    return status;
}

/* part := K^-1 part, or K^-T part */
static void solve_kernel(perp__basis *basis, int32_t transposed)
{
    const perp__principal *p = &basis->principal;

    if (!p->block) {
        perp__klu_solve(basis->factor, basis->part, transposed);
        return;
    }
    for (int32_t c = 0; c < basis->kernel; c++)
        basis->wide[basis->active[c]] = p->sign[basis->position_of[c]] * basis->part[c];
    perp__sparse_block_solve(p->block, basis->wide, transposed);
    for (int32_t c = 0; c < basis->kernel; c++)
        basis->part[c] = -p->sign[basis->position_of[c]] * basis->wide[basis->active[c]];
}

void perp__basis_solve(perp__basis *basis, const double *a, double *x)
{
    /* 1. B_0^-1: the kernel first, then the single entries. */
    for (int32_t r = 0; r < basis->n; r++)
        if (basis->kernel_row[r] >= 0)
            basis->part[basis->kernel_row[r]] = a[r];
    solve_kernel(basis, 0);
    for (int32_t p = 0; p < basis->n; p++)
        if (basis->single_row[p] >= 0)
            x[p] = a[basis->single_row[p]];
    for (int32_t c = 0; c < basis->kernel; c++) {
        const double value = basis->part[c];

        x[basis->position_of[c]] = value;
        if (value == 0.0)
            continue;
        for (int32_t k = basis->outer_starts[c]; k < basis->outer_starts[c + 1]; k++)
            x[basis->outer_positions[k]] -= basis->outer_values[k] * value;
    }
    for (int32_t p = 0; p < basis->n; p++)
        if (basis->single_row[p] >= 0)
            x[p] /= basis->single[p];
    /* 2. The spikes, in their order. */
    for (int32_t j = 0; j < basis->spikes; j++) {
        const int32_t r = basis->spike_position[j];
        double value = x[r];

        if (value == 0.0)
            continue;
        value /= basis->spike_pivot[j];
        x[r] = value;
        for (size_t k = basis->spike_starts[j]; k < basis->spike_starts[j + 1]; k++)
            x[basis->spike_rows[k]] -= basis->spike_values[k] * value;
    }
}

void perp__basis_solve_transposed(perp__basis *basis, double *e, double *y)
{
    /* 1. The spikes, from the last. */
    for (int32_t j = basis->spikes - 1; j >= 0; j--) {
        double sum = e[basis->spike_position[j]];

        for (size_t k = basis->spike_starts[j]; k < basis->spike_starts[j + 1]; k++)
            sum -= basis->spike_values[k] * e[basis->spike_rows[k]];
        e[basis->spike_position[j]] = sum / basis->spike_pivot[j];
    }
    /* 2. B_0^-T: the single entries first, then the kernel. */
    for (int32_t p = 0; p < basis->n; p++)
        if (basis->single_row[p] >= 0)
            y[basis->single_row[p]] = e[p] / basis->single[p];
    for (int32_t c = 0; c < basis->kernel; c++) {
        double sum = e[basis->position_of[c]];

        for (int32_t k = basis->outer_starts[c]; k < basis->outer_starts[c + 1]; k++)
            sum -= basis->outer_values[k] * y[basis->single_row[basis->outer_positions[k]]];
        basis->part[c] = sum;
    }
    solve_kernel(basis, 1);
    for (int32_t r = 0; r < basis->n; r++)
        if (basis->kernel_row[r] >= 0)
            y[r] = basis->part[basis->kernel_row[r]];
}

bool perp__basis_has_room(const perp__basis *basis)
{
    return basis->spikes < basis->most_spikes &&
           basis->spike_starts[basis->spikes] + (size_t)basis->n <= basis->file_entries;
}

void perp__basis_replace(perp__basis *basis, int32_t r, const double *spike)
{
    const int32_t j = basis->spikes++;
    size_t at = basis->spike_starts[j];

    for (int32_t p = 0; p < basis->n; p++) {
        if (spike[p] == 0.0 || p == r)
            continue;
        basis->spike_rows[at] = p;
        basis->spike_values[at++] = spike[p];
    }
    basis->spike_position[j] = r;
    basis->spike_pivot[j] = spike[r];
    basis->spike_starts[j + 1] = at;
}

static void solve_for_condition(void *user, double *x, int32_t transposed)
{
    perp__basis *basis = user;
    const size_t bytes = (size_t)basis->kernel * sizeof *x;

    memcpy(basis->part, x, bytes);
    solve_kernel(basis, transposed);
    memcpy(x, basis->part, bytes);
}

double perp__basis_condition(perp__basis *basis)
{
    perp__square K = kernel_of(basis);

    return perp__reciprocal_condition(K.n, perp__norm_1(&K), basis->work, solve_for_condition,
                                      basis);
}

void perp__basis_release(perp__basis *basis)
{
    if (basis->factor)
        perp__klu_destroy(basis->factor);
    basis->factor = NULL;
    basis->factor_order = 0;
}
