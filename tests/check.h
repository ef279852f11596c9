/* Independent checks of what a solver says about a linear complementarity problem.
 *
 * Everything is recomputed from the caller's data. Sums of products are exact (exact.h). No
 * routine of the library is called, so that nothing here can share one of its mistakes. */
#ifndef PERP_TESTS_CHECK_H
#define PERP_TESTS_CHECK_H

#include <perp/perp.h>

/* A problem as the caller stated it. lower and upper may be NULL. */
typedef struct check_lcp {
    const perp_matrix *M;
    const double *q, *lower, *upper;
    int scaling; /* the setting of that name */
} check_lcp;

/* What docs/lcp.md defines, recomputed. */
typedef struct check_measures {
    double residual;         /* tested residual, dimensionless */
    double natural_residual; /* max |mid(z - l, z - u, w)| */
    double backward_error;   /* row-wise, of the equilibrated M and q */
    double complementarity;  /* max w_i+ (z_i - l_i), w_i- (u_i - z_i) over finite bounds */
    double violation;        /* how far z lies outside of its bounds */
    double w_error;          /* max |w - (Mz + q)| over eps |Mz + q| + noise; 0 without w */
    double noise;            /* rounding of a double-double product, in the tested residual */
    double natural_noise;    /* the same in the caller's units */
    double backward_noise;   /* and in the backward error */
    int overflow;            /* some number on the way is larger than any double */
} check_measures;

/* log2 of the symmetric equilibration of M, n entries. */
void check_exponents(const perp_matrix *M, int scaling, int32_t *exponents);

/* The same; or 0 where it may come from noise. */
void check_witness_start(const perp_matrix *M, int scaling, int32_t *exponents);

/* part[i], part[n + j] := the lowest row that row i, or column j, hangs together with through
 * entries of M; n + j for a column of zeros. 2 n entries. */
void check_parts(const perp_matrix *M, int32_t *part);

/* 1-norms of the rows of the equilibrated M. */
void check_row_norms(const perp_matrix *M, const int32_t *exponents, double *norms);

/* w may be NULL. */
void check_measure(check_measures *measures, const check_lcp *problem, const double *z,
                   const double *w);

/* The largest residual of a row beside its own terms and those of its neighbours, w = Mz + q given,
 * or tol times that beside what it may be off by at an ordinary size of z: the second witness for
 * `solved` at this tolerance. NaN where a row is so small beside the others
 * that doubles in one unit can't hold both: no verdict is wrong there. */
double check_own(const check_lcp *problem, const double *z, const double *w, double tol);

/* Checks everything a solve handed back: measures as reported, outcome as its definition says, z
 * within the bounds, finite numbers, ray and certificate. settings NULL: the defaults. Returns
 * NULL if all is right, else what is wrong (static, until the next call). */
const char *check_lcp_result(const perp_matrix *M, const double *q, const double *lower,
                             const double *upper, const double *z, const double *w,
                             const double *ray, const perp_lcp_result *result,
                             const perp_lcp_settings *settings);

/* Fails the running test with the complaint of check_lcp_result and `where`, if there is one. */
void check_require(const char *complaint, const char *where);

/* Entry (i,j) of any view. Slow for CSC. */
double check_entry(const perp_matrix *M, int32_t i, int32_t j);

/* The non-zero entries of M, column by column; the caller frees them. */
typedef struct check_item {
    int32_t row, column;
    double value;
} check_item;

check_item *check_items(const perp_matrix *M, size_t *count);

/* y_i = 2^shift_i (sum_j M_ij x_j + add_i), exact but for the last rounding, or with M' if
 * transposed; shift and add may be NULL. */
void check_multiply(const perp_matrix *M, int transposed, const double *x, const double *add,
                    const int32_t *shift, double *y);

double check_lower(const check_lcp *problem, int32_t i);
double check_upper(const check_lcp *problem, int32_t i);

/* Zeroed memory, or the test fails. */
void *check_allocate(size_t count, size_t size);

/* largest = max(largest, x), and NaN if either is. */
void check_raise(double *largest, double x);

#endif
