/* Contacts in the space of bodies whose mass matrix falls into blocks.
 *
 * M = L L' block by block; with y = L'v and the pieces P_kb = H_kb L_b^-T of constraint k (a
 * contact, or one bilateral row) on block b,
 *   W = P P' + compliance,   q = P L^-1 f + w,   v = L^-T (L^-1 f + P'r),
 * so that one copy of P serves both products, and no product with W ever forms W.
 *
 * The blocks are the connected components of M's pattern; where all of these lie in groups of 6 (or
 * of 3) consecutive unknowns, as rigid bodies do, the groups are the blocks. */
#ifndef PERP_CONTACT_BODIES_H
#define PERP_CONTACT_BODIES_H

#include "base/arena.h"
#include "linalg/matrix.h"

/* Unknowns of a block; rows of a constraint: normal, 2 tangents, 2 of rolling, 1 of spinning. */
enum { PERP__BODY_WIDTH_MOST = 12, PERP__ROWS_MOST = 6 };

/* At first all 0 but for the context. */
typedef struct perp__bodies {
    perp_context *context;
    perp__arena constraints_arena, blocks_arena, pieces_arena;
    size_t fitted[5]; /* rigid bodies: what constraints_arena was laid out for */
    int32_t n, contacts, constraints, size; /* size: rows of all constraints */
    int32_t width;                          /* of every block, the smaller ones padded */
    int32_t blocks;
    int64_t pieces, entries;    /* entries: of `values` */
    int32_t *block_of;          /* n */
    int32_t *place_of;          /* n: where in its block */
    int32_t *rows;              /* constraints + 1: first row of each constraint */
    int32_t *constraint_of;     /* size */
    double *compliance;         /* size */
    int64_t *piece_starts;      /* constraints + 1 */
    int32_t *mark;              /* work: max(n, constraints) + 1 */
    int32_t *sizes;             /* blocks: unknowns; NULL: width, of rigid bodies */
    int32_t *dofs;              /* blocks by width: the unknowns, -1 where padded */
    double *factors;            /* blocks by width by width, row-major: L (unit where padded) */
    double *y;                  /* work: blocks by width */
    double *free;               /* blocks by width: L^-1 f of the last load; 0 before */
    const double *C, *v_free;   /* of rigid bodies, whose `free` is C^-1 v_free, see find_free */
    int64_t *block_starts;      /* blocks + 1: into block_pieces */
    int32_t *block_constraints; /* per piece, by block: its constraint, ascending */
    int64_t *block_pieces;      /* and the piece */
    int32_t *piece_blocks;      /* per piece; ascending within a constraint */
    int64_t *piece_values;      /* per piece: where in `values` it begins */
    int64_t *cursors;           /* work: most pieces of a constraint */
    double *coupling;           /* work: most_rows by most_rows */
    double *squares;            /* per piece: |P|^2 */
    double *values;             /* each piece: rows of its constraint by width, row-major */
    int32_t most_pieces;        /* of a constraint */
    int32_t most_rows;
} perp__bodies;

/* Unknowns of a block. */
static inline int32_t perp__bodies_unknowns(const perp__bodies *bodies, int32_t block)
{
    return bodies->sizes ? bodies->sizes[block] : bodies->width;
}

typedef struct perp__bodies_input {
    int32_t n, contacts, size;     /* size: rows of H and of G */
    const int32_t *starts;         /* contacts + 1: first rows; the last is the rows of H */
    const perp__matrix *M, *H, *G; /* G may be NULL */
    const double *compliance;      /* size; may be NULL */
} perp__bodies_input;

void perp__bodies_release(perp__bodies *bodies);

/* Reads everything that f and w do not change. *suits is 0, and the bodies are of no use, where M
 * has a connected component of more than PERP__BODY_WIDTH_MOST unknowns. PERP_OK;
 * PERP_ERROR_MEMORY; PERP_ERROR_ARGUMENT where a block is not positive definite: the message tells
 * the unknown. M's lower triangle is used. Linear in the entries of M and H (dense ones: in n
 * size). */
perp_status perp__bodies_setup(perp__bodies *bodies, const perp__bodies_input *input,
                               int32_t *suits);

/* The same from rigid bodies (contact.h), whose arrays must stay in place: P = J C. PERP_OK or
 * _MEMORY. */
struct perp__rigid_problem;
perp_status perp__bodies_setup_rigid(perp__bodies *bodies,
                                     const struct perp__rigid_problem *problem);

/* Keeps L^-1 f, the velocities without contact, from which sweeps guess what comes to rest. */
void perp__bodies_force(const perp__bodies *bodies, const double *f);

/* u := W r + q in working precision; q may be NULL. */
void perp__bodies_multiply(const perp__bodies *bodies, const double *r, const double *q, double *u);

/* y := P'r, in blocks by width. */
void perp__bodies_gather(const perp__bodies *bodies, const double *r, double *y);

/* Between the velocities of a block and its own coordinates, v = C y, C = L^-T; row i of C; and y
 * of the free velocities of the last load. All `width` long. The first is for rigid bodies, which
 * have C and may move with others. */
void perp__bodies_to_own(const perp__bodies *bodies, int32_t block, const double *v, double *y);
void perp__bodies_from_own(const perp__bodies *bodies, int32_t block, const double *y, double *v);
void perp__bodies_own_row(const perp__bodies *bodies, int32_t block, int32_t i, double *row);
void perp__bodies_own_free(const perp__bodies *bodies, int32_t block, double *y);

/* out := |W| |x| + |add| by way of the bodies, |P| (|P|' |x|) + |compliance x| + |add|; y: work,
 * blocks times width. */
void perp__absolute_bodies(const perp__bodies *bodies, const double *x, const double *add,
                           double *y, double *out);

/* diagonal := W_ii of all rows; and squares. */
void perp__bodies_diagonals(const perp__bodies *bodies, double *diagonal);

/* W_kk of constraint k, row-major with stride of its rows. */
void perp__bodies_diagonal(const perp__bodies *bodies, int32_t constraint, double *W);

/* W in compressed columns: entries, or -1 where there are more than INT32_MAX; then, with room for
 * these, the matrix. Constraints that share a block are coupled densely. */
int64_t perp__bodies_delassus_entries(const perp__bodies *bodies);
void perp__bodies_delassus(const perp__bodies *bodies, int32_t *column_starts, int32_t *row_indices,
                           double *values);

void perp__bodies_layout_constraints(perp__arena *arena, void *bodies);
void perp__bodies_layout_pieces(perp__arena *arena, void *bodies);
/* The constraints of each block in ascending order; the ends of the blocks before stand in
 * block_starts. */
void perp__bodies_list_constraints(perp__bodies *bodies);

#endif
