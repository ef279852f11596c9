/* The parts that a problem falls into: contacts and bilateral rows that no significant coupling
 * connects. Each part is judged by itself, in its own units; and what a constraint may miss of the
 * largest terms around it (evaluation.c) ends where couplings are below sqrt(tol), as that of an
 * LCP's row does (linalg/witness.c). */
#include <math.h>

#include "base/groups.h"
#include "contact/solver.h"

/* Beside sqrt(t_k t_j), which bounds what contacts k and j can have of each other: a coupling that
 * is no more than this, 1e-9, is noise where a zero should be, and beside the larger one's terms
 * the smaller one is not to be judged. */
#define NOISE 0x1p-30

/* A forest that pairs of constraints join, and what couples less than `least` of sqrt(t_k t_j). */
typedef struct look {
    int32_t *part;
    double least; /* INFINITY: the parts are numbered, nothing joins them any more */
    int32_t parts;
    int32_t leaks; /* something is coupled that is in two parts */
} look;

static inline void visit(look *l, int32_t a, int32_t b, double coupling)
{
    if (a == b || coupling == 0.0 || l->part[a] == l->part[b])
        return;
    if (coupling > l->least)
        l->parts -= perp__join(l->part, a, b);
    else
        l->leaks = 1;
}

static void visit_matrix(const perp_contact_solver *solver, look *l)
{
    const bool is_symmetric = solver->entrance == PERP__ENTRANCE_DYNAMICS; /* as it was made */

    /* one part, and there is nothing left to ask */
    for (int32_t j = 0; j < solver->size && l->parts > 1; j++) {
        const perp__line line = perp__line_of(&solver->W, j);

        for (int32_t k = is_symmetric && !line.indices ? j + 1 : 0; k < line.count; k++) {
            const int32_t a = solver->constraint_of[line.indices ? line.indices[k] : k];
            const int32_t b = solver->constraint_of[j];

            /* the quotients only where they may join something */
            if (line.values[k] != 0.0 && l->part[a] != l->part[b])
                visit(l, a, b, fabs(line.values[k]) / solver->root[a] / solver->root[b]);
        }
    }
}

/* What two contacts have of each other through a block is at most |P_k| |P_j|: on each block the
 * one with the largest share |P_k|^2 / t_k is coupled with all others: that finds all that are. */
static void visit_bodies(const perp_contact_solver *solver, look *l)
{
    const perp__bodies *b = &solver->bodies;
    double *shares = solver->terms;

    for (int32_t block = 0; block < b->blocks; block++) {
        double most = -1.0;
        int32_t first = -1;

        for (int64_t at = b->block_starts[block]; at < b->block_starts[block + 1]; at++) {
            const int32_t constraint = b->block_constraints[at];

            shares[constraint] = b->squares[b->block_pieces[at]] / solver->trace[constraint];
            if (shares[constraint] > most) {
                most = shares[constraint];
                first = constraint;
            }
        }
        for (int64_t at = b->block_starts[block]; at < b->block_starts[block + 1]; at++)
            visit(l, first, b->block_constraints[at],
                  sqrt(most * shares[b->block_constraints[at]]));
    }
}

/* The same in single coordinates of blocks: constraints that act on others of its coordinates have
 * nothing of each other, however much of the block is theirs. A pile hangs together by the first
 * coordinates: the others are not looked at. */
static void visit_coordinates(const perp_contact_solver *solver, look *l)
{
    const perp__bodies *b = &solver->bodies;
    double *shares = solver->wide;

    for (int32_t at = 0; at < b->width * b->blocks && l->parts > 1; at++) {
        const int32_t i = at / b->blocks, block = at % b->blocks;
        const int64_t begin = b->block_starts[block], end = b->block_starts[block + 1];
        int32_t first = -1;
        double most = 0.0;
        int64_t p = begin + 1;

        /* 1. Not where all are in one part. */
        while (p < end && perp__root_of(l->part, b->block_constraints[p]) ==
                              perp__root_of(l->part, b->block_constraints[begin]))
            p++;
        if (p >= end)
            continue;

        /* 2. The share of each, the largest of its rows; the largest is coupled with all. */
        for (p = begin; p < end; p++) {
            const int32_t constraint = b->block_constraints[p];
            const double *P = b->values + b->piece_values[b->block_pieces[p]] + i;
            double largest = 0.0;

            for (int32_t row = b->rows[constraint]; row < b->rows[constraint + 1]; row++) {
                largest = fabs(*P) > largest ? fabs(*P) : largest;
                P += b->width;
            }
            shares[constraint] = largest / solver->root[constraint];
            if (shares[constraint] > most) {
                most = shares[constraint];
                first = constraint;
            }
        }
        for (p = begin; first >= 0 && p < end; p++)
            visit(l, first, b->block_constraints[p], most * shares[b->block_constraints[p]]);
    }
}

static look begin(const perp_contact_solver *solver, int32_t *part, double least)
{
    const look l = {part, least, solver->constraints, 0};

    for (int32_t k = 0; k < solver->constraints; k++)
        part[k] = k;
    return l;
}

void perp__contact_find_parts(perp_contact_solver *solver)
{
    void (*const visit_couplings)(const perp_contact_solver *, look *) =
        solver->has_bodies ? visit_bodies : visit_matrix;
    look l = begin(solver, solver->part, NOISE);

    for (int32_t k = 0; k < solver->constraints; k++) {
        solver->root[k] = sqrt(solver->trace[k]);
        for (int32_t i = solver->starts[k]; i < solver->starts[k + 1]; i++)
            solver->constraint_of[i] = k;
    }
    visit_couplings(solver, &l);
    solver->leaks = l.leaks && l.parts > 1;
    solver->parts = perp__number_parts(solver->part, solver->constraints);
    if (solver->leaks) {
        l = (look){solver->part, INFINITY, solver->parts, 0};
        visit_couplings(solver, &l);
        solver->leaks = l.leaks;
    }
    solver->near_tol = 0.0;
}

void perp__contact_find_near(perp_contact_solver *solver)
{
    const double tol = solver->settings.tol;
    look l;

    if (solver->near_tol == tol)
        return;
    l = begin(solver, solver->near, sqrt(tol));
    if (solver->has_bodies)
        visit_coordinates(solver, &l);
    else
        visit_matrix(solver, &l);
    (void)perp__number_parts(solver->near, solver->constraints);
    solver->near_tol = tol;
}
