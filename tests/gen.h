/* Problems with a known solution, and the random numbers they are made of. The same seed gives the
 * same bits everywhere: integers, products of small dyadic numbers and square roots only, except
 * for the directions of contact friction. */
#ifndef PERP_TESTS_GEN_H
#define PERP_TESTS_GEN_H

#include <perp/perp.h>

typedef struct gen_random {
    uint64_t state;
} gen_random;

void gen_seed(gen_random *random, uint64_t seed);
uint64_t gen_bits(gen_random *random);
double gen_uniform(gen_random *random, double low, double high);
/* Roughly normal, variance 1 (a sum of uniforms: no library function that differs elsewhere). */
double gen_normal(gen_random *random);
/* A random rotation: a unit quaternion's, about z only in the plane. And x := R x. */
void gen_rotation(gen_random *random, int32_t planar, double R[3][3]);
void gen_turn(double R[3][3], double x[3]);
/* 0 .. count - 1 */
int32_t gen_integer(gen_random *random, int32_t count);
/* A multiple of 1/16 in [-limit, limit]: products of two and sums of thousands are exact. */
double gen_dyadic(gen_random *random, int32_t limit);

/* An LCP and, where it is known, a solution. Arrays belong to the problem. */
typedef struct gen_lcp {
    int32_t n;
    double *M; /* dense, row-major; NULL for a CSC problem */
    int32_t *column_starts, *row_indices;
    double *values;
    double *q, *lower, *upper;
    double *z, *w; /* the solution that q was made from (exact where gen says so) */
    perp_matrix view;
} gen_lcp;

void gen_destroy(gen_lcp *problem);

/* For the generators: zeroed memory, or the program ends. */
void *gen_allocate(size_t count, size_t size);
/* An empty problem with q, z and w of n entries; with a zero dense M too. */
void gen_begin(gen_lcp *problem, int32_t n);
void gen_begin_dense(gen_lcp *problem, int32_t n);

enum gen_class {
    GEN_PD_SYMMETRIC,
    GEN_PD_UNSYMMETRIC,
    GEN_PSD_LOW_RANK,
    GEN_P, /* not positive definite: a permuted triangle */
    GEN_M, /* diagonally dominant, off-diagonal entries <= 0 */
    GEN_CLASSES
};

enum gen_bounds {
    GEN_PLAIN, /* lower and upper stay NULL */
    GEN_BOXED,
    GEN_MIXED, /* lower only, upper only, boxes, free and fixed variables */
    GEN_BOUNDS
};

/* A random problem of n variables with the exact solution z, w; degenerate pairs (z_i at a bound
 * and w_i = 0) appear too. All numbers are dyadic and q = w - M z holds without rounding. The
 * solution is unique but for GEN_PSD_LOW_RANK. */
void gen_problem(gen_lcp *problem, gen_random *random, int32_t n, int class, int bounds);

/* A linear program: c'x least for x >= 0 and A x >= b, or A x = b, by its optimality conditions in
 * (x, y), M = [0, -A'; A, 0], y of any sign for equations. Planted pairs are strictly
 * complementary; solutions are whole faces, c'x is the same on them. Exact up to rounding of q. */
void gen_linear_program(gen_lcp *problem, gen_random *random, int32_t rows, int32_t columns,
                        int equations);
/* c'x at the planted solution less c'x at z. */
double gen_program_error(const gen_lcp *problem, int32_t columns, const double *z);

/* The obstacle problem -u'' + 2 >= 0, u >= 0 on [-1, 1], u(+-1) = 1/4, by finite differences with
 * h = 1 / (2 k): n = 4 k - 1, exact at the nodes, u = max(|x| - 1/2, 0)^2; k a power of two. */
void gen_obstacle(gen_lcp *problem, int32_t k);

/* Five-point Laplacian on side x side inner points as CSC, with a dyadic z that is zero on a part
 * of the square and a load made from it. Exact and unique. */
void gen_obstacle_2d(gen_lcp *problem, int32_t side);

/* One step of Stewart and Trinkle with frozen geometry,
 *   M = [[B' m^-1 B, (0; E)], [(mu, -E'), 0]],  q = (N' v + gap / h, D' v, 0),  B = [N D],
 * with friction directions in pairs d, -d and gaps >= 0: solvable for every mu. No solution is
 * recorded. */
typedef struct gen_contact_options {
    int32_t bodies, contacts;
    int32_t directions; /* even, 4 .. 16 */
    double mass_ratio;  /* heaviest over lightest */
    double mu_max;
    int32_t duplicates; /* contacts that repeat an earlier one */
    int32_t permuted;   /* variables in random order */
} gen_contact_options;

void gen_contact(gen_lcp *problem, gen_random *random, const gen_contact_options *options);

/* M = Hilbert matrix, q = -M e, z = e up to the rounding of q. */
void gen_hilbert(gen_lcp *problem, int32_t n);

/* A problem from the caller's row-major integers (copied). */
void gen_from_integers(gen_lcp *problem, int32_t n, const int *M, const int *q);

/* A CSC copy of a dense problem's M, without its zeros: fills the CSC arrays and the view. */
void gen_to_csc(gen_lcp *copy, const gen_lcp *problem);

#endif
