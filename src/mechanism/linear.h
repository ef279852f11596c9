/* A pattern as a linear problem: equations that give its point or affine set, and the conditions
 * under which that is an answer. Stated once, they are tested at points, with what rounding is
 * worth there, or cut the polyhedron of a family. */
#ifndef PERP_MECHANISM_LINEAR_H
#define PERP_MECHANISM_LINEAR_H

#include "base/arena.h"
#include "linalg/pivoting.h"
#include "mechanism/tuning.h"
#include "patterns/patterns.h"

/* A condition on constant + sum of factors times rows u_i, or entries x_i where index is ~i. */
enum perp__condition_kind {
    PERP__CONDITION_EQUATION, /* 0, one of those that are solved */
    PERP__CONDITION_NOT_NEGATIVE,
    PERP__CONDITION_POSITIVE, /* or not negative in the closure of the pattern */
    PERP__CONDITION_PARALLEL, /* 0 beside the condition before */
    PERP__CONDITION_DISC      /* not below the length of two entries, the first two */
};

enum { PERP__MOST_CONDITIONS = 8, PERP__MOST_TERMS = 5 };

typedef struct perp__condition {
    int32_t kind;
    int32_t strict; /* families where it is 0 everywhere are another pattern's */
    int32_t count;
    int32_t index[PERP__MOST_TERMS];
    double constant, factor[PERP__MOST_TERMS];
} perp__condition;

typedef struct perp__linear {
    /* u = B x + c. B has one or two blocks of `length` rows, each by columns. */
    int32_t length, rows;
    const double *block[2];
    const double *c, *c_size; /* rows; c_size: what c is summed up of */
    const double *scale;      /* length: the unit of x_i, and of row i one over it */
    double tolerance;         /* of points, relative to what they are summed up of */
    /* x = known + columns y; the equation of a column is u_i + slope_i u_(length + i) = 0 with its
     * first entry i */
    perp__pivoting system;
    int32_t *first, *count;
    double *coefficient; /* PERP__MOST_TERMS a column */
    double *slope, *known;
    /* the solution */
    double *y;
    double *x, *x_width; /* width: what counts as 0 */
    double *u, *u_size, *u_width;
    double *residual, *load; /* length: of the equations, and what they are summed up of */
    double *null;            /* directions of x */
    double *work;            /* 8 length */
    /* the conditions */
    int32_t positions;
    void *user;
    int32_t (*conditions)(const void *user, const void *pattern, int32_t position,
                          perp__condition *list);
    double *angle;  /* positions: of the polygons of their discs, */
    int32_t edges;  /* which have so many edges */
    int32_t inside; /* and are within the discs, or around them */
} perp__linear;

/* A point, or homogeneous, a direction; what counts as 0 in it. */
typedef struct perp__linear_point {
    const double *x, *u, *x_width, *u_width;
    int32_t homogeneous;
    int32_t closed; /* in the closure of the pattern, of which it need not be an inner point */
    int32_t solved; /* its equations need no test */
} perp__linear_point;

/* Takes the arrays of a problem with `length` and blocks. */
void perp__linear_layout(perp__linear *p, perp__arena *arena);

/* No columns, x = 0. */
void perp__linear_begin(perp__linear *p);
void perp__linear_column(perp__linear *p, int32_t first, int32_t count, const double coefficient[]);
/* The matrix of the equations, to be eliminated, with x = known; its largest entry, without
 * cancellation. */
double perp__linear_load(perp__linear *p);
/* u, and unless NULL its sizes, at x. */
void perp__linear_rows(const perp__linear *p, double *u, double *size, const double *x,
                       int32_t homogeneous);
/* u, residual and load of p->x. */
void perp__linear_evaluate(perp__linear *p);
/* Takes the residual off. */
void perp__linear_correct(perp__linear *p);
/* x := x + columns y, or with absolute values. */
void perp__linear_add(const perp__linear *p, double *x, const double *y, bool absolute);
/* From load and u_size of the solution: x_width and u_width. */
void perp__linear_find_widths(perp__linear *p);
/* Directions that residual and load leave free, in `null`; -1 where they leave no solution. */
int32_t perp__linear_find_null(perp__linear *p);

/* Whether the point meets the pattern's conditions; *at_vertex: at the limit of one. */
bool perp__linear_holds(const perp__linear *p, const void *pattern, const perp__linear_point *point,
                        int32_t *at_vertex);
/* The same of a family's point or direction x: to its tolerance of an entry, and of `spread` times
 * the largest entry, in units. */
bool perp__linear_holds_at(const perp__linear *p, const void *pattern, const double *x,
                           int32_t homogeneous, double spread, int32_t *at_vertex);
/* Cuts the polyhedron with the pattern's conditions. */
void perp__linear_cut(const perp__linear *p, const void *pattern, perp__polyhedron *polyhedron);

#endif
