/* Nested iteration: the index set of a large problem from those of ever coarser ones. */
#ifndef PERP_LCP_NESTED_H
#define PERP_LCP_NESTED_H

#include "lcp/method.h"
#include "linalg/multigrid/multigrid.h"

/* The problem on one level. */
typedef struct perp__nested_level {
    const double *q, *lower, *upper;
    double *own_q, *own_lower, *own_upper; /* memory of the above, but for the finest level */
    double *z, *residual;                  /* n */
    int8_t *places;                        /* n, enum perp__place */
} perp__nested_level;

typedef struct perp__nested {
    perp__multigrid *grid;
    perp__nested_level *level; /* grid->levels of them */
    double *correction;        /* n of the finest level */
    int32_t *active;           /* n of the finest level: rows between their bounds */
    perp__arena arena;
} perp__nested;

/* Makes room for the levels of `grid`, which stays the caller's. PERP_OK or _MEMORY. */
perp_status perp__nested_fit(perp__nested *nested, perp__multigrid *grid);

/* Finds z and places near the solution's. With `warm`, from z on the finest level alone. Returns 0
 * if z overflowed. Adds its steps on the finest level to *iterations; *request is what stopped it,
 * or -1. */
int32_t perp__nested_run(perp__nested *nested, const perp__lcp_problem *problem, int32_t warm,
                         double *z, int8_t *places, int64_t *iterations, perp_outcome *request);

void perp__nested_release(perp__nested *nested);

#endif
