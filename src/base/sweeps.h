/* Iterations that cost little, in lcp and contact: sweeps, products with M, exchanges. */
#ifndef PERP_BASE_SWEEPS_H
#define PERP_BASE_SWEEPS_H

/* The default limit; and fewer, where so many would touch more numbers than this. */
#define PERP__SWEEPS_MOST 10000
#define PERP__ENTRIES_MOST 1e10

/* Stagnation: within so many, or more where a method knows of longer ways, the residual fell to no
 * less than this. */
#define PERP__STAGNATION 1000
#define PERP__STAGNATION_FACTOR 0.99

/* A residual this much above the best one seen is divergence. Where M is symmetric and positive
 * definite the residual can grow by the square root of its condition number at most, 1e6 for 1e12;
 * such a problem would stagnate all the same. */
#define PERP__DIVERGENCE 1e6

#endif
