/* Enumeration of complementary patterns.
 *
 * A complementarity problem has a choice at each of its positions: a variable at a bound or between
 * them, a contact that separates, sticks or slips. One choice at each is a pattern; within it the
 * problem is linear: equations, and inequalities that tell whether the pattern is the right one.
 * All answers are found by a tree over the patterns. Where a pattern's equations determine
 * the point its answer is isolated; where they leave directions free it is a family, a polyhedron
 * known by its vertices and rays (polyhedron.c). Neighbouring patterns find the same answers: a
 * store has each of them once, and none within another. */
#ifndef PERP_PATTERNS_PATTERNS_H
#define PERP_PATTERNS_PATTERNS_H

#include <stdbool.h>

#include "linalg/cone.h"

/* ---- the tree ------------------------------------------------------------------------------ */

typedef struct perp__pattern_tree {
    int32_t positions;
    int32_t *next;   /* positions: of work */
    int32_t ended;   /* set by a callback: nothing more is looked at */
    int32_t reverse; /* the last position is the root's */
    void *user;
    int32_t (*choices)(void *user, int32_t position);
    /* Takes a choice, with those of all positions above it taken; 0 where nothing can follow. */
    int32_t (*choose)(void *user, int32_t position, int32_t choice);
    perp_status (*leaf)(void *user); /* every position has its choice */
} perp__pattern_tree;

/* Depth first. A status other than PERP_OK ends it, and is returned. */
perp_status perp__pattern_tree_search(perp__pattern_tree *tree);

/* The number of patterns, or more than `most`. */
int64_t perp__pattern_tree_count(const perp__pattern_tree *tree, int64_t most);

/* ---- the store ----------------------------------------------------------------------------- */

/* An isolated answer is a family with one vertex. */
typedef struct perp__answer {
    struct perp__answer *next;
    int32_t dimension; /* 0: isolated */
    int32_t vertices, rays;
    int32_t room; /* points */
    int32_t at_vertex, stable, flutter, eigenvalue_count;
    int32_t kind, free; /* the user's own */
    double residual;
    double *points;         /* vertices, then rays */
    double *middle, *width; /* a point inside; what is 0 there */
    double *eigenvalues;
    double *extra;   /* numbers of the user's own */
    int32_t *modes;  /* positions */
    int8_t *pattern; /* 2 positions */
} perp__answer;

typedef struct perp__answers {
    perp_context *context;
    int32_t length;    /* of a point */
    int32_t positions; /* of a pattern */
    int32_t eigenvalues, extra;
    /* Whether `inner` is part of `outer`, which is a family, or equal to it, both isolated. */
    int32_t (*holds)(void *user, perp__answer *outer, const perp__answer *inner);
    void *user;
    perp__answer *first;
    perp__answer *spare; /* of earlier answers, with room for one point */
    int32_t count;
    int32_t incomplete; /* of some pattern it is not known whether it has an answer */
} perp__answers;

/* An answer that is not kept yet; NULL without memory. Memory of isolated ones is used again. */
perp__answer *perp__answer_create(perp__answers *answers, int32_t points);
void perp__answer_release(perp__answers *answers, perp__answer *answer);

/* middle := the mean of the vertices, plus the rays. */
void perp__answer_find_middle(const perp__answers *answers, perp__answer *answer);

/* Takes the answer over: it comes last, and those within it go, or it goes itself where another one
 * holds it. Where two isolated ones meet and one is not stable, neither is the answer. */
void perp__answers_keep(perp__answers *answers, perp__answer *answer);

/* A stable order. */
void perp__answers_sort(perp__answers *answers,
                        int32_t (*is_before)(const void *user, const perp__answer *a,
                                             const perp__answer *b));
const perp__answer *perp__answers_get(const perp__answers *answers, int32_t index);

/* Forgets the answers; the second their memory, too. */
void perp__answers_clear(perp__answers *answers);
void perp__answers_release(perp__answers *answers);

/* ---- families ------------------------------------------------------------------------------ */

/* origin + sum_k t_k directions_k where all inequalities hold: the cone of (s, t) with s >= 0,
 * whose rays with s > 0 are the vertices. */
typedef struct perp__polyhedron {
    perp__cone cone;
    int32_t length;    /* of origin and directions */
    int32_t dimension; /* directions, one after the other */
    const double *origin, *directions;
    double rounding;        /* entries of points below this, beside their terms, are 0, */
    double row_rounding;    /* and of inequalities */
    double least;           /* s of a vertex */
    const int32_t *entries; /* where the entries of a point go in an answer; NULL: as they are */
    int32_t empty;          /* an inequality never holds */
} perp__polyhedron;

/* constant + row . x >= 0; size: of what the constant is summed of. strict: somewhere > 0. */
typedef struct perp__inequality {
    double constant, size;
    const double *row;
    int32_t strict;
} perp__inequality;

/* Without an inequality; room for `rows`. PERP_OK or _MEMORY. */
perp_status perp__polyhedron_begin(perp__polyhedron *p, int32_t rows, int32_t dimension);
void perp__polyhedron_cut(perp__polyhedron *p, const perp__inequality *g);

/* The generators of the cone. Where they are too many the store is incomplete, and there are none.
 * PERP_OK or _MEMORY. */
perp_status perp__polyhedron_enumerate(perp__polyhedron *p, perp__answers *answers);
bool perp__polyhedron_is_vertex(const perp__polyhedron *p, int32_t k);
/* Generator k as a point or, times `sign`, as a direction. */
void perp__polyhedron_point(const perp__polyhedron *p, int32_t k, double sign, double *to);
/* All as an answer of points alone; NULL where there is no vertex. PERP_OK or _MEMORY. */
perp_status perp__polyhedron_list(perp__polyhedron *p, perp__answers *answers, perp__answer **made);

/* Adds the direction in row `rank` of an orthonormal basis of n columns, where more than `least` of
 * it is outside of the others' span; returns the new rank. */
int32_t perp__rank_add(double *basis, int32_t rank, int32_t n, double least);

#endif
