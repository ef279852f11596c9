/* LU factors, or Cholesky's, of matrices made of square blocks whose pattern is a graph: a node is
 * a block row and column, an edge a block that is not 0. The multifrontal method of Duff & Reid
 * (ACM TOMS 9 (1983) 302), with rows exchanged inside of a front's own nodes, dense kernels, and
 * nodes in an order of minimum degree (Amestoy, Davis & Duff, ACM TOMS 30 (2004) 381); for matrices
 * of which no leading block is singular, such as those whose symmetric part is positive definite.
 *
 * Unions of connected parts of the graph whose nodes are numbered one after the other can be
 * factored one by one; so can principal blocks, in the whole matrix's order and memory: leaving
 * nodes out creates no fill, and what is left of a front's pattern lies in that of its parent. */
#ifndef PERP_LINALG_FRONTS_H
#define PERP_LINALG_FRONTS_H

#include "base/arena.h"

/* Columns of a symmetric front that are eliminated at a time; and those that are brought up to date
 * at a time, to leave out what is above the diagonal. The clock is looked at in between. */
enum { PERP__FRONT_PANEL = 256, PERP__FRONT_STRIP = 48 };

/* Nodes that are eliminated together, with the others that they are coupled with by then. */
typedef struct perp__front {
    int32_t first, count;      /* its own, in order of elimination */
    int32_t rest, parent;      /* how many others; the front that these go on to, or -1 */
    int32_t *others;           /* their places in the order */
    int32_t *in_parent;        /* and in the parent, where its own come first */
    int32_t entry, last_entry; /* of the list of entries */
    double *panel;             /* the columns of its own; factors and what is below them */
    double *across;            /* A^-1 times the columns of the others; of Cholesky's, room */
    int32_t *pivots;
} perp__front;

/* A block of the matrix in the front where it goes: in units of blocks. */
typedef struct perp__front_entry {
    int32_t edge, row, column;
} perp__front_entry;

typedef struct perp__fronts {
    perp__arena graph_arena, pattern_arena, value_arena;
    int32_t nodes, width, count;
    int32_t *starts, *neighbours;  /* of the graph */
    int32_t *order, *place;        /* nodes in order of elimination, and back */
    int32_t *parent, *mark, *work; /* nodes */
    int32_t *column_starts;        /* nodes + 1: of L's pattern, by place */
    int32_t *column_rows, *in_parent;
    perp__front *fronts;
    int32_t *front_of; /* by place */
    perp__front_entry *entries;
    double *values; /* width^2 for each edge, column by column */
    double *stack;  /* what children leave to their parents */
    size_t stack_size;
    double products; /* of a factorisation of the whole, found first; where they are more than */
    double most_products; /* these, analysis ends before there is memory for it; 0: no limit */
    int32_t is_too_large; /* then 1 */
    double deadline;      /* on perp__now()'s clock, of factorisations; 0: none */
    int32_t is_symmetric; /* 1, before analysis: values are, and positive definite: L L', in half
                             the time; one triangle is read */
    int32_t takes_blocks; /* 1, before analysis: perp__fronts_take may be called */
    int32_t is_negative;  /* the determinant of what was factored last */
    perp__front *whole;   /* of the whole graph, where the block's are above */
    int32_t *whole_order, *block_lists;
    double *right, *gathered; /* nodes by width */
} perp__fronts;

/* All zero at first. starts, neighbours: the graph, symmetric, sorted, each node among its own
 * neighbours. Nothing is done where it is the last one's. PERP_OK or _MEMORY. */
perp_status perp__fronts_analyse(perp__fronts *fronts, perp_context *context, int32_t nodes,
                                 int32_t width, const int32_t *starts, const int32_t *neighbours);

/* The edge of the block in this row and column, nodes that are neighbours: its entries begin at
 * values + edge * width^2. */
int32_t perp__fronts_edge(const perp__fronts *fronts, int32_t row, int32_t column);

/* From now on the matrix is the block of these nodes, and the places that a factorisation and a
 * solve go over are 0 .. count-1. Asks for no memory. */
void perp__fronts_take(perp__fronts *fronts, const int32_t *nodes, int32_t count);

/* Factors, from `values`, what belongs to the nodes first .. end-1. Returns 0 where a pivot is 0 or
 * not finite, or the deadline over. */
int32_t perp__fronts_factor(perp__fronts *fronts, int32_t first, int32_t end);

/* x := A^-1 x over those nodes; x is of all nodes. */
void perp__fronts_solve(perp__fronts *fronts, int32_t first, int32_t end, double *x);

void perp__fronts_release(perp__fronts *fronts);

#endif
