/* What sweeps need of a problem: local problems, weights, W by rows. */
#include <math.h>
#include <string.h>

#include "contact/law.h"
#include "contact/sweep/sweep.h"
#include "linalg/pivoting.h"

void perp__sweep_layout(perp__arena *arena, void *object)
{
    perp__sweep_work *work = object;
    const perp__contact_problem *problem = work->common.problem;
    const perp__bodies *b = problem->bodies;
    const perp__matrix *W = problem->W;
    const size_t size = (size_t)problem->size, contacts = (size_t)problem->contacts;
    const size_t constraints = contacts + size - (size_t)problem->rows;
    size_t y_size = 0, entries = 0;

    /* 1. Of every problem. */
    work->constraints = (int32_t)constraints;
    work->size = problem->size;
    work->rows = perp__arena_take(arena, constraints + 1, sizeof *work->rows);
    work->local = perp__arena_take(arena, constraints, sizeof *work->local);
    work->discs = NULL;
    if (problem->has_discs || problem->two_sided)
        work->discs = perp__arena_take(arena, contacts, sizeof *work->discs);
    work->weights = perp__arena_take(arena, constraints, sizeof(double));
    PERP__DOUBLES(arena, size, &work->row_weights, &work->r, &work->x, &work->u, &work->best);
    work->modes = perp__arena_take(arena, contacts, sizeof *work->modes);
    work->y = work->entries = NULL;
    work->packs = NULL;
    work->packed = NULL;
    work->entry_starts = work->columns = NULL;

    /* 2. Of bodies; of W. */
    if (b) {
        const int32_t packs = b->width == 3 || b->width == PERP__PACKED_WIDTH;

        work->stride = packs ? PERP__PACKED_WIDTH : b->width;
        y_size = (size_t)b->blocks * (size_t)work->stride;
        work->y = perp__arena_take(arena, y_size + (size_t)work->stride, sizeof(double));
        work->packs = perp__arena_take(arena, contacts, sizeof *work->packs);
        if (packs)
            work->packed = perp__arena_take(arena, contacts, sizeof *work->packed);
    } else {
        entries = W->column_starts ? (size_t)W->column_starts[W->columns]
                                   : (size_t)W->rows * (size_t)W->columns;
        work->entries = perp__arena_take(arena, entries, sizeof(double));
        if (W->column_starts) {
            PERP__INTEGERS(arena, size + 1, &work->entry_starts);
            PERP__INTEGERS(arena, entries, &work->columns);
        }
    }
    perp__mixing_layout(arena, &work->mixing, size, y_size);
}

/* W_kk of a constraint, row-major. */
static void read_diagonal(const perp__sweep_work *work, int32_t constraint, double *W)
{
    const int32_t first = work->rows[constraint], rows = work->rows[constraint + 1] - first;

    if (work->common.problem->bodies) {
        perp__bodies_diagonal(work->common.problem->bodies, constraint, W);
        return;
    }
    memset(W, 0, (size_t)(rows * rows) * sizeof *W);
    for (int32_t i = 0; i < rows; i++) {
        if (!work->columns) {
            memcpy(W + i * rows, work->entries + (size_t)(first + i) * (size_t)work->size + first,
                   (size_t)rows * sizeof *W);
            continue;
        }
        for (int32_t k = work->entry_starts[first + i]; k < work->entry_starts[first + i + 1]; k++)
            if (work->columns[k] >= first && work->columns[k] < first + rows)
                W[i * rows + work->columns[k] - first] = work->entries[k];
    }
}

/* Of a contact that holds both ways: A, what its normals, `both`, follow its tangents by, and S,
 * what is then left of W_kk in these. */
static void eliminate_normals(perp__sweep_discs *discs, int32_t rows, int32_t both)
{
    const int32_t tangents = rows - both;
    const double *W = discs->W;
    double S[2 * 2];

    for (int32_t i = 0; i < both; i++)
        for (int32_t j = 0; j < tangents; j++)
            discs->A[i * tangents + j] = W[i * rows + both + j];
    (void)perp__solve_small(W, both, rows, discs->A, tangents);
    for (int32_t i = 0; i < tangents; i++)
        for (int32_t j = 0; j < tangents; j++) {
            S[i * tangents + j] = W[(both + i) * rows + both + j];
            for (int32_t n = 0; n < both; n++)
                S[i * tangents + j] -= W[(both + i) * rows + n] * discs->A[n * tangents + j];
        }
    perp__local_make_disc(&discs->part[0], tangents, S, tangents);
}

void perp__sweep_read(perp__sweep_work *work)
{
    const perp__contact_problem *problem = work->common.problem;
    const perp__bodies *b = problem->bodies;
    const perp__matrix *W = problem->W;

    memcpy(work->rows, problem->starts, ((size_t)problem->contacts + 1) * sizeof *work->rows);
    for (int32_t k = problem->contacts; k < work->constraints; k++)
        work->rows[k + 1] = work->rows[k] + 1;
    if (b)
        memset(work->y, 0, (size_t)(b->blocks + 1) * (size_t)work->stride * sizeof *work->y);
    else if (W->column_starts)
        perp__transpose_csc(W, work->entry_starts, work->columns, work->entries);
    else
        perp__matrix_spread(&(perp__matrix){W->columns, W->rows, W->column_stride, W->row_stride,
                                            W->values, NULL, NULL},
                            work->entries, (size_t)work->size);
    for (int32_t k = 0; k < work->constraints; k++) {
        const int32_t contact = k < problem->contacts, rows = work->rows[k + 1] - work->rows[k];
        const int32_t both = contact ? perp__contact_two_sided(problem, k) : 0;
        double block[PERP__ROWS_MOST * PERP__ROWS_MOST];

        /* 1. The local problem; of a contact that is solved by turns, its parts, too. */
        read_diagonal(work, k, block);
        perp__local_make(&work->local[k], contact && both == 0 ? problem->dims[k] : 1, block, rows,
                         contact ? problem->mu[k] : 0.0);
        if (contact && work->discs) {
            perp__contact_part parts[3];
            const int32_t count = perp__contact_parts(problem, k, parts);

            memcpy(work->discs[k].W, block, (size_t)(rows * rows) * sizeof *block);
            for (int32_t p = 1; p < count; p++)
                perp__local_make_disc(&work->discs[k].part[p], parts[p].size,
                                      block + (parts[p].row - work->rows[k]) * (rows + 1), rows);
            if (both > 0)
                eliminate_normals(&work->discs[k], rows, both);
        }
        /* 2. Weights; and the piece of memory of contacts that have one. */
        work->weights[k] = sqrt(problem->trace[k]) / problem->omega[k];
        for (int32_t i = work->rows[k]; i < work->rows[k + 1]; i++)
            work->row_weights[i] = work->weights[k];
        if (contact && b) {
            work->packs[k] = (int8_t)(work->packed && perp__sweep_packs(work, k));
            if (work->packs[k])
                perp__sweep_pack(work, k, &work->packed[k]);
        }
    }
}
