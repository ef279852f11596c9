/* The parts that a problem falls into: contacts and bilateral rows that no significant coupling
 * connects. Each part is judged by itself, in its own units. */
#include <math.h>
#include <string.h>

#include "base/groups.h"
#include "contact/solver.h"

/* Beside sqrt(t_k t_j), which bounds what contacts k and j can have of each other: a coupling that
 * is no more than this, 1e-9, is noise where a zero should be, and beside the larger one's terms
 * the smaller one is not to be judged. */
#define NOISE 0x1p-30

/* Of every pair of units that W couples, by so much of sqrt(t_k t_j): joins their parts, and notes
 * whether there is noise; or, once the parts are numbered, whether there is any between them. */
static inline void visit(perp_contact_solver *solver, int32_t numbered, int32_t a, int32_t b,
                         double coupling)
{
    if (a == b || coupling == 0.0)
        return;
    if (numbered)
        solver->leaks |= solver->part[a] != solver->part[b];
    else if (coupling > NOISE)
        solver->parts -= perp__join(solver->part, a, b);
    else
        solver->leaks = 1;
}

static void visit_entry(perp_contact_solver *solver, int32_t numbered, int32_t i, int32_t j,
                        double value)
{
    const int32_t a = solver->unit_of[i], b = solver->unit_of[j];

    visit(solver, numbered, a, b, fabs(value) / solver->root[a] / solver->root[b]);
}

static void visit_matrix(perp_contact_solver *solver, int32_t numbered)
{
    const perp__matrix *W = &solver->W;

    /* one part, and there is nothing left to ask */
    for (int32_t j = 0; j < solver->size && solver->parts > 1; j++)
        if (W->column_starts)
            for (int32_t k = W->column_starts[j]; k < W->column_starts[j + 1]; k++)
                visit_entry(solver, numbered, W->row_indices[k], j, W->values[k]);
        else
            for (int32_t i = 0; i < solver->size; i++)
                visit_entry(solver, numbered, i, j,
                            W->values[(size_t)i * W->row_stride + (size_t)j * W->column_stride]);
}

/* What two contacts have of each other through a block is at most |P_k| |P_j|: on each block the
 * one with the largest share |P_k|^2 / t_k is coupled with all others, and that finds all that are.
 */
static void visit_bodies(perp_contact_solver *solver, int32_t numbered)
{
    const perp__bodies *b = &solver->bodies;
    double *shares = solver->terms;

    for (int32_t block = 0; block < b->blocks; block++) {
        double most = -1.0;
        int32_t first = -1;

        for (int64_t at = b->block_starts[block]; at < b->block_starts[block + 1]; at++) {
            const int32_t unit = b->block_units[at];

            shares[unit] = b->squares[b->block_pieces[at]] / solver->trace[unit];
            if (shares[unit] > most) {
                most = shares[unit];
                first = unit;
            }
        }
        for (int64_t at = b->block_starts[block]; at < b->block_starts[block + 1]; at++)
            visit(solver, numbered, first, b->block_units[at],
                  sqrt(most * shares[b->block_units[at]]));
    }
}

static void visit_couplings(perp_contact_solver *solver, int32_t numbered)
{
    solver->leaks = 0;
    if (solver->has_bodies)
        visit_bodies(solver, numbered);
    else
        visit_matrix(solver, numbered);
}

void perp__contact_find_parts(perp_contact_solver *solver)
{
    for (int32_t k = 0; k < solver->units; k++) {
        solver->part[k] = k;
        solver->root[k] = sqrt(solver->trace[k]);
    }
    for (int32_t k = 0; k < solver->contacts; k++)
        for (int32_t i = solver->starts[k]; i < solver->starts[k + 1]; i++)
            solver->unit_of[i] = k;
    for (int32_t i = solver->rows; i < solver->size; i++)
        solver->unit_of[i] = solver->contacts + i - solver->rows;
    solver->parts = solver->units;
    visit_couplings(solver, 0);
    solver->leaks &= solver->parts > 1;
    solver->parts = perp__number_parts(solver->part, solver->units);
    if (solver->leaks)
        visit_couplings(solver, 1);
}
