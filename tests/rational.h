/* Exact solutions of small systems of integers, by fraction-free elimination. */
#ifndef PERP_TESTS_RATIONAL_H
#define PERP_TESTS_RATIONAL_H

#include <stdint.h>

#define RATIONAL_LARGEST 12

/* Solves A x = b, A row-major, n <= RATIONAL_LARGEST: x_i = numerators[i] / the result, which is
 * |det A|; 0 where A is singular. Hadamard's bound of the minors of (A, b) must stay below 2^62. */
int64_t rational_solve(int n, const int64_t *A, const int64_t *b, int64_t *numerators);

/* The plain LCP of the integers M, q (row-major): true if index set `set` (bit i: z_i basic) has a
 * regular block and its point solves the problem; then z_i = numerators[i] / *denominator. */
int rational_basic_solution(int n, const int *M, const int *q, unsigned set, int64_t *numerators,
                            int64_t *denominator);

#endif
