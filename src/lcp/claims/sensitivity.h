/* What the two files of the sensitivities share. */
#ifndef PERP_LCP_SENSITIVITY_H
#define PERP_LCP_SENSITIVITY_H

#include "lcp/solver.h"
#include "linalg/kept_factor.h"

struct perp_lcp_sensitivity {
    PERP__HANDLE;
    perp_lcp_solver *solver; /* the problem, its scaling, and z with its w */
    perp__arena arena;
    int32_t n, count;
    int32_t verdict;
    int8_t *places;    /* enum perp__place */
    int32_t *active;   /* the rows that are between */
    int32_t *position; /* where a row is among them, or -1 */
    double *block;     /* of D M D, dense or the CSC block's values */
    int32_t *starts, *rows;
    double *x;                    /* count */
    double *rhs, *move, *product; /* n */
    perp__kept_factor kept;
};

/* Reads the index set, factors its block, finds verdict, index, margin and condition. PERP_OK or
 * PERP_ERROR_MEMORY. */
perp_status perp__sensitivity_prepare(perp_lcp_sensitivity *s, perp_lcp_sensitivity_info *info);

/* x_A := M_AA^-1 x_A, or its transpose; x has n entries, the others are not touched. */
void perp__sensitivity_solve(perp_lcp_sensitivity *s, double *x, int32_t transposed);

#endif
