/* Karush-Kuhn-Tucker systems of programs with polynomials.
 *
 * Function 0 is minimised, the others are >= 0 (or = 0). With multipliers y >= 0 (or free):
 * x perp grad f_0 - sum y_k grad f_k, y_k perp f_k. */
#ifndef PERP_TESTS_NCP_PROBLEMS_POLYNOMIAL_H
#define PERP_TESTS_NCP_PROBLEMS_POLYNOMIAL_H

#include "problems.h"

/* coefficient (x_v - shift)^power x_a x_b x_c; variables from 1, 0 for none. */
typedef struct term {
    int32_t function;
    double coefficient;
    int32_t v, power;
    double shift;
    int32_t other[3];
} term;

typedef struct program {
    int32_t variables, functions, equalities; /* the last `equalities` functions are = 0 */
    const term *terms;                        /* ended by a coefficient of zero */
} program;

/* Free variables, multipliers >= 0 or free; two starts, with multipliers 0 and 1; one solution. */
void zoo_polynomial(zoo_problem *problem, const program *form, const double *start,
                    const double *solution);

#endif
