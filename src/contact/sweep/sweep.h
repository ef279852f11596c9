/* Block Gauss-Seidel: the workspace, shared by its files. Its blocks are the constraints: contacts
 * and bilateral rows. */
#ifndef PERP_CONTACT_SWEEP_H
#define PERP_CONTACT_SWEEP_H

#include "contact/bodies/bodies.h"
#include "contact/sweep/local.h"
#include "contact/method.h"
#include "contact/sweep/mixing.h"

enum { PERP__PACKED_WIDTH = 6, PERP__PACKED_ROW = 12 };

/* The parts of a contact that rolls or spins, whose local problem is solved by turns; or the
 * tangents of one that holds both ways, beside normals that follow them by A. */
typedef struct perp__sweep_discs {
    perp__local part[3];
    double A[3 * 2];
    double W[PERP__ROWS_MOST * PERP__ROWS_MOST];
} perp__sweep_discs;

/* A contact of at most 3 rows on at most 2 blocks of 3 or 6 unknowns (packed.c). */
typedef struct perp__packed_contact {
    double P[36]; /* 3 rows, in the order that packed.c tells */
    double q[3], compliance[2];
    perp__local local;
    double weight; /* trace / omega^2 */
    int32_t blocks[2];
} perp__packed_contact;

/* Where unknown j of block 0 or 1 is in a row of P: 0 to 3 of the one, 0 to 3 of the other, 4 and 5
 * of both. */
static inline int32_t perp__packed_place(int32_t which, int32_t j)
{
    return j < 4 ? 4 * which + j : 4 + 2 * which + j;
}

typedef struct perp__sweep_work {
    perp__contact_work common;
    int32_t constraints, size;
    int32_t *rows;                /* constraints + 1 */
    perp__local *local;           /* constraints */
    perp__sweep_discs *discs;     /* contacts, if some roll, spin or hold both ways */
    double *weights;              /* constraints: sqrt(trace) / omega */
    double *row_weights;          /* size: the same for each row */
    double *r;                    /* size; the tangents of packed contacts turned */
    double *x, *u;                /* size: r in the caller's frame, and W x + q */
    int8_t *modes;                /* contacts */
    double *best;                 /* size: the r of the smallest change, up to a factor 2 */
    double *y;                    /* bodies: P'r in blocks by stride, then a block of zeros */
    int32_t stride;               /* of blocks in y: their width; 6 where contacts are packed */
    int8_t *packs;                /* contacts: is packed */
    perp__packed_contact *packed; /* contacts; NULL where there are no bodies of width 3 or 6 */
    perp__mixing mixing;
    int64_t sweeps;             /* done */
    double least, least_before; /* change; and at the end of the last window */
    double looked[2];           /* and when its rate was looked at, the last time and before */
    int64_t next_look;
    double remembered, residual; /* the change that led to `best`; the residual of r in the end */
    double share;                /* of tol: the change that makes the residual worth its cost */
    int32_t *entry_starts, *columns; /* W by rows: size + 1, ...; NULL: dense */
    double *entries;
} perp__sweep_work;

/* One pass over all constraints. Returns the largest weighted change of r, max sqrt(t_k) |dr_k| /
 * omega; NaN or infinity where a number overflowed. */
double perp__sweep_pass(perp__sweep_work *work);

/* Whether contact k can be packed; packs it; one pass over the contacts from `from` up to
 * before `to`, all packed, which raises *most to the largest squared change. */
int32_t perp__sweep_packs(const perp__sweep_work *work, int32_t k);
void perp__sweep_pack(perp__sweep_work *work, int32_t k, perp__packed_contact *packed);
void perp__sweep_packed(perp__sweep_work *work, int32_t from, int32_t to, double *most);

/* r := x of the caller's frame; x := r in the caller's frame, within its cones. */
void perp__sweep_import(perp__sweep_work *work, const double *x);
void perp__sweep_export(perp__sweep_work *work, const double *r);

/* W by rows from problem->W; the local problems from either. */
void perp__sweep_read(perp__sweep_work *work);
void perp__sweep_layout(perp__arena *arena, void *work);

/* The tested residual of x, in the caller's frame, with u := W x + q. */
double perp__sweep_residual(perp__sweep_work *work, const double *x, double *u);

#endif
