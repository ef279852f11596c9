/* Nonsmooth contact dynamics' block Gauss-Seidel (Jean, Comput. Methods Appl. Mech. Eng. 177 (1999)
 * 235): constraint by constraint, with the newest r throughout, the exact solution of the
 * constraint's own problem
 *   u_k = W_kk r_k + b_k,   b_k = q_k + sum_{j != k} W_kj r_j.
 * A sweep's largest change of r, max sqrt(t_k) |dr_k| / omega, is of the size of the tested
 * residual and costs nothing; once it is small the residual itself is computed. No theorem says
 * that the sweeps converge for Coulomb's law, and where they stagnate or diverge that is said. */
#include "contact/sweep/sweep.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include <perp/contact.h>

#include "base/sweeps.h"
#include "contact/law.h"
#include "linalg/pivoting.h"

/* The rate is looked at first early, and then whenever the sweeps have doubled; what is slow by
 * then may still come to an end before so many, which are cheap beside what follows. */
#define PATIENCE 160

/* ---- what sweeps need of a problem ---- */

static void layout(perp__arena *arena, void *object)
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
        const bool packs = b->width == 3 || b->width == PERP__PACKED_WIDTH;

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
    const perp__contact_problem *problem = work->common.problem;
    const int32_t first = problem->starts[constraint];
    const int32_t rows = problem->starts[constraint + 1] - first;

    if (problem->bodies) {
        perp__bodies_diagonal(problem->bodies, constraint, W);
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

/* Local problems, weights, W by rows. */
static void read(perp__sweep_work *work)
{
    const perp__contact_problem *problem = work->common.problem;
    const perp__bodies *b = problem->bodies;
    const perp__matrix *W = problem->W;

    if (b)
        memset(work->y, 0, (size_t)(b->blocks + 1) * (size_t)work->stride * sizeof *work->y);
    else if (W->column_starts)
        perp__transpose_csc(W, work->entry_starts, work->columns, work->entries);
    else
        perp__matrix_spread(&(perp__matrix){W->columns, W->rows, W->column_stride, W->row_stride,
                                            W->values, NULL, NULL},
                            work->entries, (size_t)work->size);
    for (int32_t k = 0; k < work->constraints; k++) {
        const int32_t contact = k < problem->contacts,
                      rows = problem->starts[k + 1] - problem->starts[k];
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
                                      block + (parts[p].row - problem->starts[k]) * (rows + 1),
                                      rows);
            if (both > 0)
                eliminate_normals(&work->discs[k], rows, both);
        }
        /* 2. Weights; and the piece of memory of contacts that have one. */
        work->weights[k] = sqrt(problem->trace[k]) / problem->omega[k];
        for (int32_t i = problem->starts[k]; i < problem->starts[k + 1]; i++)
            work->row_weights[i] = work->weights[k];
        if (contact && b) {
            work->packs[k] = (int8_t)(work->packed && perp__sweep_packs(work, k));
            if (work->packs[k])
                perp__sweep_pack(work, k, &work->packed[k]);
        }
    }
}

/* ---- the method ---- */

/* Whether what is left is more than the limit leaves room for, at the rate since there were a
 * quarter as many sweeps: over less they often stand still, and go on. */
static bool is_too_slow(perp__sweep_work *work, int64_t limit)
{
    const perp__contact_problem *problem = work->common.problem;
    const double before = work->looked[0];
    double sweeps;

    if (!problem->yields || work->sweeps != work->next_look)
        return 0;
    work->next_look *= 2;
    work->looked[0] = work->looked[1];
    work->looked[1] = work->least;
    if (!(before < INFINITY) || work->least <= problem->tol)
        return 0;
    sweeps =
        0.75 * (double)work->sweeps * log(problem->tol / work->least) / log(work->least / before);
    return work->sweeps >= PATIENCE && !(sweeps >= 0.0 && sweeps <= (double)(limit - work->sweeps));
}

/* A sweep that hardly changes r: is r the solution? `share` of tol is what the change has to be
 * for the question to be worth its cost. */
static bool is_solved(perp__sweep_work *work, double change)
{
    const double tol = work->common.problem->tol;
    double residual;

    if (!(change <= work->share * tol))
        return 0;
    perp__sweep_export(work, work->r);
    residual = perp__sweep_residual(work, work->x, work->u);
    if (residual <= tol) {
        work->residual = residual;
        return 1;
    }
    work->share = fmax(1e-3, fmin(0.5 * work->share, change / residual));
    return 0;
}

static void start(perp__sweep_work *work, perp__contact_iterate *iterate)
{
    const perp__contact_problem *problem = work->common.problem;
    const perp__bodies *b = problem->bodies;
    const size_t bytes = (size_t)work->size * sizeof *work->r;

    read(work);
    if (!iterate->warm)
        memset(iterate->r, 0, bytes);
    perp__sweep_import(work, iterate->r);
    if (b)
        perp__bodies_gather(b, iterate->r, work->y);
    for (int32_t i = b && work->stride > b->width ? b->blocks : 0; i-- > 0;) {
        /* by width, then by stride */
        double *block = work->y + (size_t)i * (size_t)work->stride;

        memmove(block, work->y + (size_t)i * (size_t)b->width, (size_t)b->width * sizeof *block);
        memset(block + b->width, 0, (size_t)(work->stride - b->width) * sizeof *block);
    }
    memcpy(work->best, work->r, bytes);
    perp__mixing_forget(&work->mixing, work->r);
    memset(work->modes, 0, (size_t)problem->contacts * sizeof *work->modes);
    work->least = work->least_before = work->remembered = work->residual = INFINITY;
    work->looked[0] = work->looked[1] = INFINITY;
    work->next_look = PERP__FIRST_LOOK;
    work->share = 1.0;
    work->sweeps = 0;
}

/* The better of the last r and the remembered one. */
static void finish(perp__sweep_work *work, perp__contact_iterate *iterate, perp_outcome outcome)
{
    const size_t bytes = (size_t)work->size * sizeof *work->r;

    if (outcome != PERP_OUTCOME_SOLVED) {
        double best;

        perp__sweep_export(work, work->best);
        best = perp__sweep_residual(work, work->x, work->u);
        perp__sweep_export(work, work->r);
        work->residual = perp__sweep_residual(work, work->x, work->u);
        if (!(work->residual <= best)) {
            perp__sweep_export(work, work->best);
            work->residual = perp__sweep_residual(work, work->x, work->u);
        }
    }
    memcpy(iterate->r, work->x, bytes);
    memcpy(iterate->u, work->u, bytes);
    memcpy(iterate->modes, work->modes, (size_t)work->common.problem->contacts);
    iterate->has_modes = outcome == PERP_OUTCOME_SOLVED;
    iterate->residual = work->residual;
    iterate->iterations = work->sweeps;
    iterate->outcome = outcome;
}

static perp_status solve(void *object, perp__contact_iterate *iterate)
{
    perp__sweep_work *work = object;
    const perp__contact_problem *problem = work->common.problem;
    const double entries =
        12.0 * (work->constraints + 1.0); /* a normal's, of two bodies, at least */
    const double affordable = fmin(1.0 + PERP__ENTRIES_MOST / entries, PERP__SWEEPS_MOST);
    const int64_t limit =
        problem->iteration_limit > 0 ? problem->iteration_limit : (int64_t)affordable;
    perp_outcome outcome = -1;

    start(work, iterate);
    while (outcome < 0 && work->sweeps < limit) {
        double change;
        bool is_hopeless;

        /* 1. One sweep, from where mixing the last ones leads to. */
        if (work->sweeps > 0)
            perp__mixing_after(&work->mixing, work->row_weights, work->r, work->y);
        work->sweeps++;
        change = perp__sweep_pass(work);

        /* 2. The r where the change has halved is kept: copies are few. */
        if (change < work->least)
            work->least = change;
        if (change < 0.5 * work->remembered) {
            work->remembered = change;
            memcpy(work->best, work->r, (size_t)work->size * sizeof *work->best);
        }

        /* 3. Whether to go on; not where sweeps diverge or stagnate. */
        if (is_solved(work, change)) {
            outcome = PERP_OUTCOME_SOLVED;
        } else {
            is_hopeless = !(change <= DBL_MAX) || change > PERP__DIVERGENCE * work->least;
            if (!is_hopeless && work->sweeps % PERP__STAGNATION == 0) {
                is_hopeless = work->least > PERP__STAGNATION_FACTOR * work->least_before;
                work->least_before = work->least;
            }
            if (!is_hopeless && is_too_slow(work, limit))
                break;
            outcome = is_hopeless
                          ? PERP_OUTCOME_STALLED
                          : perp__contact_asks_to_stop(problem->control, work->sweeps, change);
        }
    }
    finish(work, iterate, outcome < 0 ? PERP_OUTCOME_ITERATION_LIMIT : outcome);
    return PERP_OK;
}

const perp__contact_method perp__contact_sweep = {.id = PERP_CONTACT_METHOD_SWEEP,
                                                  .work_size = sizeof(perp__sweep_work),
                                                  .attempts = 1,
                                                  .layout = layout,
                                                  .solve = solve};
