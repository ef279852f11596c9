/* 1 / cond_1 of A from its LU factors and its 1-norm; work: 2 n doubles. */
#ifndef PERP_TESTS_LU_CONDITION_H
#define PERP_TESTS_LU_CONDITION_H

#include "linalg/blas.h"
#include "linalg/factor/factor.h"

typedef struct lu_factors {
    int32_t n, lda;
    const double *A;
    const int32_t *pivots;
} lu_factors;

static void lu_solve(void *user, double *x, int32_t transposed)
{
    const lu_factors *lu = user;

    perp__lu_solve(lu->n, lu->A, lu->lda, lu->pivots, x, transposed);
}

static double lu_condition(int32_t n, const double *A, int32_t lda, double norm, double *work,
                           const int32_t *pivots)
{
    lu_factors lu = {n, lda, A, pivots};

    return perp__reciprocal_condition(n, norm, work, lu_solve, &lu);
}

#endif
