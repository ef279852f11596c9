/* The condition number's estimate that all factorisations share. */
#ifndef PERP_LINALG_CONDITION_H
#define PERP_LINALG_CONDITION_H

#include <stdint.h>

#include "linalg/factor/factor.h"

/* x := A^-1 x, or A^-T x. */
typedef void (*perp__solve_function)(void *user, double *x, int32_t transposed);

/* The largest sum of absolute values in a column. */
double perp__norm_1(const perp__square *A);

/* 1 / (norm ||A^-1||_1), 0 where that is not a number between 0 and 1. work: 2 n doubles. */
double perp__reciprocal_condition(int32_t n, double norm, double *work, perp__solve_function solve,
                                  void *user);

#endif
