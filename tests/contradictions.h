/* Quadratic programs with equations, and LCPs like them, with and without a solution: what is true
 * of each is known by construction. */
#ifndef PERP_TESTS_CONTRADICTIONS_H
#define PERP_TESTS_CONTRADICTIONS_H

#include "gen.h"

/* M = [eps Q, B; A, 0], B = -A' but for one problem in four; the last rows of A are sums of the
 * others. The multipliers are free, or, for inequalities, not below 0. Everything is a multiple of
 * powers of two, so that z solves the twin exactly, and the last row of the other contradicts the
 * rest by its own size or more. Rows, or rows and their multipliers, are scaled by 2^-20 to 2^20,
 * eps is 0 or 2^-46 to 1, and honest multipliers are as large as 2^26. */
void gen_contradiction(gen_lcp *problem, gen_random *random, int32_t solvable);

#endif
