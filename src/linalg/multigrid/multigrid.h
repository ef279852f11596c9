/* Algebraic multigrid by smoothed aggregation, for one sparse matrix whose positive entries lie on
 * the diagonal or are small: coarse matrices and, where it is symmetric, solves with principal
 * blocks by conjugate gradients. Vanek, Mandel & Brezina, "Algebraic multigrid by smoothed
 * aggregation for second and fourth order elliptic problems", Computing 56 (1996) 179. */
#ifndef PERP_LINALG_MULTIGRID_H
#define PERP_LINALG_MULTIGRID_H

#include <limits.h>

#include "base/clock.h"
#include "linalg/fronts/fronts.h"
#include "linalg/matrix.h"

/* Of fewer rows a factorisation costs next to nothing. */
#define PERP__COARSEST 100
/* Most coarser levels have less than half as many rows: what has more levels than a count of rows
 * has bits ends there. */
#define PERP__LEVELS ((int32_t)(CHAR_BIT * sizeof(int32_t)))
/* Conjugate gradient steps: as many take about as long as a factorisation. */
#define PERP__STEPS 80

/* A matrix S by rows, and how it hangs together with the next coarser one, P' S P. The entries of a
 * row come in any order. */
typedef struct perp__level {
    int32_t n, coarse; /* coarse: rows of the next level; 0 on the last one */
    const int32_t *starts, *rows;
    const double *values;
    double *inverse_diagonal;
    double *block_values; /* of the coarse matrix of a block of a finer level */
    double *block_inverse_diagonal;
    double *near_null;  /* t > 0 with S t near 0: what errors look like that sweeps do not remove */
    int32_t *aggregate; /* the coarse variable that a row belongs to, or -1 */
    int32_t *p_starts, *p_columns; /* P by rows */
    double *p_values;
    int32_t *r_starts, *r_rows; /* P by columns */
    double *r_values;
    double *x, *b;   /* the cycle's vectors */
    int8_t *inside;  /* rows of the block, where this is its level */
    int32_t *active; /* the same as a list; on the last level: all rows */
    int32_t active_count;
    int32_t *own_starts, *own_rows; /* memory of what is const above */
    double *own_values;
    size_t entries;
    perp__arena arena, transfer_arena, matrix_arena;
} perp__level;

/* Row i of the level's pattern with these values, times x. */
static inline double perp__level_times(const perp__level *level, const double *values, int32_t i,
                                       const double *x)
{
    double sum = 0.0;

    for (int32_t k = level->starts[i]; k < level->starts[i + 1]; k++)
        sum += values[k] * x[level->rows[k]];
    return sum;
}

/* At first all 0 but for the context. */
typedef struct perp__multigrid {
    perp_context *context;
    double deadline;     /* on perp__now()'s clock; 0: none */
    int32_t unsymmetric; /* so is the matrix: then there are levels to sweep on, no solves */
    int32_t levels;      /* 0: nothing built; 1: no coarser level was found */
    perp__level *level;  /* PERP__LEVELS of them, from the first building on */
    int32_t top;         /* the level of the block */
    double *sums;        /* n: a row of a product; zero between uses */
    int32_t *marks;      /* n */
    double *direction, *product, *preconditioned; /* n */
    perp__arena arena;
    perp__fronts bottom; /* the last level as it is factored */
} perp__multigrid;

void perp__multigrid_release(perp__multigrid *grid);

/* Builds the hierarchy for S, which must have a positive diagonal. PERP_OK, then with no levels if
 * the deadline is over, or _MEMORY. */
perp_status perp__multigrid_build(perp__multigrid *grid, const perp__matrix *S);

/* Makes the coarse matrices for the block of level `top` (not the last one) with the rows active[0]
 * < active[1] ...: those of P' S P where the rows of P outside of the block are zero (Graeser &
 * Kornhuber, "Multigrid methods for obstacle problems", J. Comput. Math. 27 (2009) 1). Returns 0 if
 * the coarsest one is not positive definite, or the deadline over. */
bool perp__multigrid_take_block(perp__multigrid *grid, int32_t top, const int32_t *active,
                                int32_t count);

/* Other rows of the same level with the coarse matrices that are there: good for few changes. */
void perp__multigrid_change_block(perp__multigrid *grid, int32_t top, const int32_t *active,
                                  int32_t count);

/* Factors the block of these rows of the last level, plus rho I; 0: not positive definite. */
int32_t perp__multigrid_factor_bottom(perp__multigrid *grid, const double *values,
                                      const int32_t *active, int32_t count, double rho);

/* x_A := S_AA^-1 b_A up to `tolerance`, relative to b in the 2-norm; both are indexed by the rows
 * of the block's level. b_A is overwritten by the residual, x is zero outside of the block. Returns
 * the number of conjugate gradient steps, or -1 if `limit` of them do not suffice or the matrix
 * turns out not to be positive definite. */
int32_t perp__multigrid_solve(perp__multigrid *grid, double *b, double *x, double tolerance,
                              int32_t limit);

/* ---- parts ---- */

/* Values and inverse diagonal of P' S P, for the pattern of `coarse`; only rows with inside[i] take
 * part if it is not NULL. Returns 0 if the deadline ends it. */
bool perp__coarse_values(const perp__multigrid *grid, const perp__level *fine,
                         const double *fine_values, const int8_t *inside, const perp__level *coarse,
                         double *values, double *inverse_diagonal);

/* Whether the deadline is over, asked at each of many rows or sweeps: looked at now and then. */
static inline bool perp__multigrid_is_late(const perp__multigrid *grid, int32_t row)
{
    return row % 256 == 0 && perp__is_past(grid->deadline);
}

#endif
