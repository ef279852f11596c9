/* What is true of an answer, recomputed without the library: residuals in __float128 (113 bits, and
 * exponents that no product of doubles leaves), and small problems in exact rationals.
 *
 * A row is judged beside what it and its neighbours carry. With M in units where the largest entry
 * of every row and column is near 1, t = |M||z| + |q|, and
 *
 *   zhat_j = max(|z_j|, t_k / |M_kj| over rows k with a significant |M_kj|),
 *   carried_i = t_i + sum_j |M_ij| zhat_j + 1e-5 max t   (of the rows that i is connected with),
 *
 * a violation v_i of the law of row i is right if v_i <= 1e3 tol carried_i (sqrt(tol) in the place
 * of tol where the outcome is rounding_limit). It is the second witness of the library's own
 * definition of 'solved', written again from its text; the factor 1e3 is for other choices of the
 * units, of what is significant, and for the first witness, so that what fails here is false by any
 * reading. Units are not unique where the largest entries leave a row and a column free to trade a
 * factor, M = [[e, 1], [1, 0]]: the larger of what is carried counts, in units found from the
 * caller's (row after row, and all at once) and from those of the diagonal. A contact is one thing:
 * its rows are judged beside the largest of them. Allowed on top is what couplings that are not
 * significant bring in, up to tol of what their own rows carry (a problem may be read as the parts
 * that it falls into without them). What the grid of the denormals makes of z is allowed on top;
 * and where q = 0 a unit of 1, as perp/lcp.h and perp/contact.h say (a problem without a size has
 * no other). */
#ifndef PERP_TESTS_ORACLE_H
#define PERP_TESTS_ORACLE_H

#include <stdint.h>

__extension__ typedef __float128 wide;

/* w = A x + add (or 0) and t = |A||x| + |add|; A row-major, rows by columns. t may be NULL. */
void oracle_multiply(int32_t rows, int32_t columns, const wide *A, const wide *x, const wide *add,
                     wide *w, wide *t);
wide *oracle_wide(int32_t count, const double *x); /* a copy; fuzz_drop releases it */
wide oracle_abs(wide x);
wide oracle_sqrt(wide x);

/* b := A^-1 b for `columns` right-hand sides (b row-major, n by columns); A is destroyed. Returns 0
 * where a pivot is 0. Partial pivoting in units of the rows. */
int oracle_solve(int32_t n, int32_t columns, wide *A, wide *b);

/* carried_i of the rows, as above, and `unit` more in equilibrated units. Rows with the same block
 * are one thing; block, zhat may be NULL. */
void oracle_carried(int32_t n, const wide *A, const wide *z, const wide *t, const int32_t *block,
                    double tol, int unit, wide *carried, wide *zhat);

/* The largest violation over `carried` that an outcome allows; above 0.1 nothing is claimed. */
double oracle_limit(int32_t outcome, double tol);

/* A complementarity problem with bounds, and the point that is said to solve it. */
typedef struct oracle_point {
    const char *where;
    int32_t n, outcome;
    double tol;
    const double *M;             /* n by n, row-major: the matrix or the Jacobian at z */
    const double *lower, *upper; /* n each, infinities included */
    const double *z;
    const wide *w, *t;   /* n each: residuals and the sums of the sizes of their terms */
    const double *start; /* n: what z is judged beside too, times 2^-20 (perp/ncp.h); or NULL */
    int homogeneous;     /* q = 0 */
} oracle_point;

/* Aborts if z is outside of its bounds; for a good outcome, if a row is violated. */
void oracle_check_point(const oracle_point *point);
/* Whether z solves the problem without any error: every outcome but a good one is false then. */
int oracle_is_exact(const oracle_point *point);

/* What the rows of a contact problem obey. */
enum { ORACLE_NORMAL, ORACLE_FRICTION, ORACLE_BILATERAL, ORACLE_BOUNDED };

typedef struct oracle_law {
    int32_t kind, first, rows;
    int32_t normal; /* friction: the row of its normal, -1: the bound is `mu` itself */
    double mu;
    int32_t block, block_rows; /* the rows of its contact */
    int32_t polyhedral;  /* friction: the cone is smaller than the disc; only its size is known */
    int32_t normals;     /* friction: rows of r_N of any sign, mu |r_N|; 0: mu r_n */
    double lower, upper; /* bounded */
} oracle_law;

typedef struct oracle_contacts {
    const char *where;
    int32_t rows, laws, outcome;
    double tol;
    const wide *W, *q; /* u = W r + q */
    const wide *t;     /* sizes of the terms of u; NULL: |W||r| + |q| */
    const oracle_law *law;
    const double *r;
    const double *u; /* as returned; or NULL */
} oracle_contacts;

/* Aborts if impulses leave their cones; for a good outcome, if Signorini's or Coulomb's law is
 * violated by impulses and the velocities they lead to. */
void oracle_check_contacts(const oracle_contacts *contacts);

/* Plain LCPs of integers, n <= ORACLE_LARGEST, |entries| <= 3: the vertices of all their solution
 * sets, exactly. A solution exists if and only if there is a vertex, for every piece is a
 * polyhedron without lines. Row-major. */
#define ORACLE_LARGEST 6
#define ORACLE_VERTICES 729

typedef struct oracle_vertex {
    double z[ORACLE_LARGEST]; /* rounded quotients of integers */
} oracle_vertex;

int32_t oracle_vertices(int32_t n, const int *M, const int *q, oracle_vertex *vertices);
/* Whether some z >= 0 has M z + q >= 0. */
int oracle_feasible(int32_t n, const int *M, const int *q);
/* No principal minor is 0: every solution is isolated. */
int oracle_nondegenerate(int32_t n, const int *M);

/* A complementarity problem with bounds, n <= 7, M row-major, and a point. */
typedef struct oracle_set {
    int32_t n;
    const double *M, *q, *lower, *upper, *z;
    const double *radii; /* or NULL */
} oracle_set;

/* Whether the index set `places` (PERP_PLACE_LOWER, _BETWEEN, _UPPER) has a regular block and its
 * point solves the problem, within the radii of z: exactly. */
int oracle_solves(const oracle_set *problem, const int32_t *places);

#endif
