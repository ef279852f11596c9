/* Block Gauss-Seidel: the workspace, shared by its files. Its blocks are the constraints: contacts
 * and bilateral rows. */
#ifndef PERP_CONTACT_SWEEP_H
#define PERP_CONTACT_SWEEP_H

#include "contact/bodies/bodies.h"
#include "contact/method.h"

/* ---- one contact: local.c ---- */

/* Everything in the turned frame: t = (c t1 + s t2, -s t1 + c t2) of the caller's. */
typedef struct perp__local {
    double inverse_normal; /* 1 / W_nn */
    double a[2], s[2], inverse_s[2], mu;
    double slip; /* the last multiplier: where the next search begins */
    double turn[2];
    int32_t dim;
} perp__local;

/* Reads the symmetric part of W_kk, dim by dim (1, 2 or 3), row-major with that stride. A diagonal
 * that is zero or negative, which no symmetric positive definite W has, is lifted to 1e-14 of the
 * trace. */
void perp__local_make(perp__local *local, int32_t dim, const double *W, int32_t stride, double mu);

/* A disc |r| <= radius of 1 or 2 rows, opposed to u: reads W the same way. */
void perp__local_make_disc(perp__local *local, int32_t dim, const double *W, int32_t stride);

/* r := the solution for b = u - W_kk r, with the r given. Returns PERP_CONTACT_SEPARATE (0), STICK
 * (1) or SLIP (2). Caller's frame. */
int32_t perp__local_step(perp__local *local, const double *u, double *r);

/* The same for a disc; returns STICK or SLIP. */
int32_t perp__local_step_disc(perp__local *local, double radius, const double *u, double *r);

/* ---- several sweeps: mixing.c ---- */

enum { PERP__MIXING_DEPTH = 5 };

/* A state is r and y, which is linear in r. */
typedef struct perp__mixing {
    int32_t size, y_size;
    int32_t count, next; /* differences held; where the next one goes */
    int32_t has_last;
    double norm;       /* of the last f */
    double *before;    /* r when the sweep began */
    double *f, *r, *y; /* of the last sweep; f weighted */
    double *F, *R, *Y; /* differences, PERP__MIXING_DEPTH of each */
    double gram[PERP__MIXING_DEPTH][PERP__MIXING_DEPTH]; /* F'F */
} perp__mixing;

void perp__mixing_layout(perp__arena *arena, perp__mixing *mixing, size_t size, size_t y_size);
/* The first sweep begins at r. */
void perp__mixing_forget(perp__mixing *mixing, const double *r);

/* After a sweep: r and y, its result, become the next start. weights: size. */
void perp__mixing_after(perp__mixing *mixing, const double *weights, double *r, double *y);

/* ---- all constraints ---- */

enum { PERP__PACKED_WIDTH = 6, PERP__PACKED_ROW = 12 };

/* The parts of a contact that rolls or spins, whose local problem is solved by turns; or the
 * tangents of one that holds both ways, beside normals that follow them by A. */
typedef struct perp__sweep_discs {
    perp__local part[3];
    double A[3 * 2], W[PERP__ROWS_MOST * PERP__ROWS_MOST];
} perp__sweep_discs;

/* A contact of at most 3 rows on at most 2 blocks of 3 or 6 unknowns (pass.c). */
typedef struct perp__packed_contact {
    double P[36]; /* 3 rows, in the order of perp__packed_place */
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

/* Whether contact k can be packed; packs it. */
bool perp__sweep_packs(const perp__sweep_work *work, int32_t k);
void perp__sweep_pack(perp__sweep_work *work, int32_t k, perp__packed_contact *packed);

/* r := x of the caller's frame; x := r in the caller's frame, within its cones. */
void perp__sweep_import(perp__sweep_work *work, const double *x);
void perp__sweep_export(perp__sweep_work *work, const double *r);

/* The tested residual of x, in the caller's frame, with u := W x + q. */
double perp__sweep_residual(perp__sweep_work *work, const double *x, double *u);

#endif
