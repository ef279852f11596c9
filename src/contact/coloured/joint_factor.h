/* Factors L D L' of K = P P', the equations of joints, node by node.
 *
 * A node's rows are those of one pair of bodies, up to eight, side by side in lanes. Nodes that
 * share a body meet in a tile of K; L has the tiles that these fill in, found along the elimination
 * tree (Davis, "Direct Methods for Sparse Linear Systems", 2006, chapter 4), in the order of
 * Amestoy, Davis & Duff, "Algorithm 837: AMD", ACM TOMS 30 (2004). Trees have none. */
#ifndef PERP_CONTACT_JOINT_FACTOR_H
#define PERP_CONTACT_JOINT_FACTOR_H

#include <stdint.h>

#include "base/arena.h"
#include "linalg/lanes/lanes.h"

enum { PERP__NODE = 8 };

/* Column by column, the rows in lanes. */
typedef double perp__joint_tile[PERP__NODE][PERP__NODE];

/* What a node has of P: a row of numbers y, eight of A and eight of B, in each of its lanes. */
typedef double perp__joint_lanes[2 * PERP__NODE][PERP__NODE];

/* to := to + sign A x, of as many lanes as cover `rows`; A has so many columns, which the compiler
 * knows. */
PERP__KERNEL static void perp__add_columns(double *to, int32_t rows, double sign,
                                           double (*A)[PERP__NODE], const double *x,
                                           int32_t columns)
{
    perp__lanes sums[2] = {PERP__CONST_LANES_AT(to), PERP__CONST_LANES_AT(to + PERP__NODE / 2)};

    for (int32_t c = 0; c < columns; c++) { /* of both halves side by side: neither waits */
        const perp__lanes factor = PERP__SAME_LANES(sign * x[c]);

        sums[0] += factor * PERP__CONST_LANES_AT(A[c]);
        if (rows > PERP__NODE / 2)
            sums[1] += factor * PERP__CONST_LANES_AT(A[c] + PERP__NODE / 2);
    }
    PERP__LANES_AT(to) = sums[0];
    if (rows > PERP__NODE / 2)
        PERP__LANES_AT(to + PERP__NODE / 2) = sums[1];
}

/* The same of a tile, beyond whose columns, three of a ball and five of a hinge, all is 0. */
PERP__KERNEL static void perp__add_product(double *to, int32_t rows, double sign,
                                           double (*A)[PERP__NODE], const double *x,
                                           int32_t columns)
{
    if (columns <= 3)
        perp__add_columns(to, rows, sign, A, x, 3);
    else if (columns <= 6)
        perp__add_columns(to, rows, sign, A, x, 6);
    else
        perp__add_columns(to, rows, sign, A, x, PERP__NODE);
}

typedef struct perp__joint_factor {
    perp__arena arena, link_arena, tile_arena;
    int32_t nodes, bodies;
    int32_t most_nodes, most_bodies, most_links, most_tiles; /* room */
    size_t fitted[4];
    int32_t known, known_bodies; /* of the pattern at hand */
    /* of nodes, written by who sets them up */
    int32_t *rows, *body;      /* how many; and 2: of what impulses do not move `bodies` */
    int32_t *old_body;         /* as they were when they were ordered */
    perp__joint_lanes *P;      /* of unit rows */
    int8_t *repeats;           /* lanes */
    int32_t *starts, *links;   /* K by columns: nodes */
    int32_t *first, *touching; /* nodes of a body: twice the node + side */
    /* L by columns, in order; a column's first tile is the inverse of
     * its diagonal's root */
    int32_t *order, *rank, *parent, *mark, *count, *tiles, *row;
    perp__joint_tile *tile, *back; /* and the same with rows and columns exchanged */
} perp__joint_factor;

/* Room for so many nodes, whose rows, body and P are to be written. PERP_OK or _MEMORY. */
perp_status perp__joint_factor_open(perp__joint_factor *f, perp_context *context, int32_t nodes,
                                    int32_t bodies);

/* Factors K + ridge without the rows whose pivots are not above `least` > 0: those repeat others.
 * *definite: 0 where a pivot is no positive number. PERP_OK or _MEMORY. */
perp_status perp__joint_factor_make(perp__joint_factor *f, perp_context *context, double ridge,
                                    double least, int32_t *definite);

/* x := (K + ridge)^-1 x, eight numbers a node; 0 in rows that repeat others. */
void perp__joint_factor_solve(const perp__joint_factor *f, double *x);
void perp__joint_factor_release(perp__joint_factor *f);

#endif
