/* What methods share: products and copies of the scaled matrix. */
#include <string.h>

#include "lcp/method.h"

void perp__lcp_dense(const perp__lcp_problem *problem, double sign, double *dense,
                     size_t leading_dimension)
{
    const perp__matrix *M = problem->M;

    for (int32_t j = 0; j < problem->n; j++) {
        const perp__line l = perp__line_of(M, j);
        double *column = dense + (size_t)j * leading_dimension;

        if (l.count < problem->n)
            memset(column, 0, (size_t)problem->n * sizeof *column);
        for (int32_t k = 0; k < l.count; k++)
            column[l.indices ? l.indices[k] : k] = sign * l.values[k];
    }
}

void perp__lcp_affine(const perp__lcp_problem *problem, const double *z, double *w)
{
    perp__multiply(problem->M, z, w);
    for (int32_t i = 0; i < problem->n; i++)
        w[i] += problem->q[i];
}
