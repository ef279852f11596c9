/* The proof of a solution, in parts: the scaled problem, the enclosure, the verdict. */
#ifndef PERP_LCP_VERIFY_H
#define PERP_LCP_VERIFY_H

#include "base/arena.h"
#include "lcp/method.h"
#include "linalg/verified.h"

typedef struct perp__verify {
    perp_context *context;
    perp__arena arena, dense_arena;
    int32_t n;
    const double *z_caller, *lower_caller, *upper_caller; /* bounds may be NULL */
    perp__matrix M;                                       /* D M D, a copy */
    double *values;                                       /* its entries */
    int32_t *exponents, *work;                            /* log2 of D; 2 n */
    int32_t omega;                                        /* log2, as in evaluate.c */
    double *z, *q, *lower, *upper;                        /* scaled */
    int8_t *places;                                       /* enum perp__place */
    int32_t *active, *position; /* rows that are between; where a row is among them, or -1 */
    int32_t count;              /* of active rows */
    double *high, *low;         /* the point whose neighbourhood is searched: high + low */
    double *w_high, *w_low;
    double *w, *width;        /* M (high + low) + q lies within width of w */
    double *delta;            /* the solution lies within delta of high + low */
    double *spread;           /* |M| delta */
    double *middle, *margin;  /* count: w and width of the active rows */
    double *step, *enclosure; /* count */
    int32_t *starts, *rows;   /* CSC: pattern of the active block */
    double *block;            /* CSC: its entries */
    perp__verified dense;     /* one of these two bounds |M_AA^-1 r| */
    perp__dominance dominance;
    int32_t uses_dense;
} perp__verify;

/* Takes the arrays; sizes come from v->M, which is the caller's here. */
void perp__verify_layout(perp__arena *arena, void *object);

/* Scales everything by powers of two and reads the index set off z. */
void perp__verify_scale(perp__verify *v, const perp__matrix *M, const double *q);

/* Finds the solution of the index set's equations and an interval around it that holds the exact
 * one. *verdict: PERP_VERDICT_REGULAR, _SINGULAR or _TOO_LARGE. PERP_OK or PERP_ERROR_MEMORY. */
perp_status perp__verify_enclose(perp__verify *v, int32_t *verdict);

/* Compares the enclosure with bounds and signs; *index is the row that decides, or -1. */
int32_t perp__verify_judge(const perp__verify *v, int32_t *index);

/* |z_i - z*_i| at most, in the caller's units. */
double perp__verify_radius(const perp__verify *v, int32_t i);

#endif
