/* Diffusion on grids: the M-matrices of obstacle problems, in one to three dimensions. */
#ifndef PERP_TESTS_GRIDS_H
#define PERP_TESTS_GRIDS_H

#include "gen.h"

typedef struct grid_options {
    int32_t size[3];       /* nodes in each direction; 1: none */
    double conductance[3]; /* in each direction; all 0: one everywhere */
    double contrast;       /* blocks of 8 nodes conduct between 10^-c/2 and 10^c/2 times as well */
    double wind;           /* upwind convection in the first direction: M is unsymmetric */
    int32_t permuted;      /* nodes in random order */
    double *place;         /* 3 n coordinates in (0, 1), if not NULL: filled, in the nodes' order */
} grid_options;

/* Fills M (central differences, z = 0 beyond the rim; CSC), lower = 0, upper = +inf, q = 0. */
void grid_problem(gen_lcp *problem, gen_random *random, const grid_options *options);

/* q_i = -h^2 f at the nodes, f = sin(3 pi x) sin(2 pi y) sin(2 pi z + 1/2) + 1/10: islands of
 * contact. */
void grid_load(gen_lcp *problem, const double *place, int32_t side);

#endif
