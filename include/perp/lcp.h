/* perp/lcp.h: linear complementarity problems with bounds.
 *
 *   find z in [l, u] with w = M z + q such that, for every i,
 *     w_i >= 0 where z_i = l_i,   w_i <= 0 where z_i = u_i,   w_i = 0 where l_i < z_i < u_i.
 *
 * w_i is free where l_i = u_i. The defaults l = 0, u = +inf give the plain LCP
 * 0 <= z  perp  M z + q >= 0; both bounds infinite make row i an equation.
 *
 * The life of a solve: create, setup (with the problem), solve (again and again), destroy; or
 * perp_lcp_solve() for a single problem.
 *
 * Source of the problem class: Cottle, Pang & Stone, "The Linear Complementarity Problem" (1992).
 */
#ifndef PERP_LCP_H
#define PERP_LCP_H

#include <perp/base.h>
#include <perp/matrix.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Values never change. */
enum perp_lcp_method_value {
    PERP_LCP_AUTO = 0,    /* chosen from size, storage and diagonal; falls through on failure */
    PERP_LCP_LEMKE = 1,   /* complementary pivoting; exact, any M; memory n^2, sparse M: factors */
    PERP_LCP_PGS = 2,     /* projected Gauss-Seidel; needs M_ii > 0; cheap, linear convergence */
    PERP_LCP_FISCHER = 3, /* semismooth Newton on the Fischer-Burmeister function */
    PERP_LCP_POLISH = 4,  /* only ever reported: the active set of z0 already solved the problem */
    PERP_LCP_ACTIVE_SET = 5, /* primal-dual active sets; a few factorisations; P-matrices */
    PERP_LCP_PATTERNS = 6,   /* only ever reported: enumeration of the index sets, by which auto has
                                the last word where n <= 12 */
    PERP_LCP_MPRGP = 7       /* only ever reported: of a problem given by products */
};

/* How Lemke's method chooses among the rows that tie in the ratio test. Values never change. */
enum perp_pivot_rule_value {
    PERP_PIVOT_HARRIS = 0,       /* largest pivot within an absolute tolerance; restarts on a ray */
    PERP_PIVOT_LEXICOGRAPHIC = 1 /* the textbook rule with its termination proof; no restarts */
};

/* The order in which pgs visits the rows. Values never change. */
enum perp_sweep_value {
    PERP_SWEEP_FORWARD = 0,
    PERP_SWEEP_SYMMETRIC = 1 /* forward, then backward: two sweeps */
};

/* What pgs does between sweeps. Values never change. */
enum perp_acceleration_value {
    PERP_ACCELERATION_NONE = 0,
    PERP_ACCELERATION_CONJUGATE_GRADIENT = 1 /* nonsmooth nonlinear conjugate gradients */
};

/* What a ray proves. Values never change. */
enum perp_certificate_value {
    PERP_CERTIFICATE_NONE = 0,
    PERP_CERTIFICATE_INFEASIBLE = 1 /* no z >= l has M z + q >= 0: the ray y has y >= 0, M'y <= 0
                                       and y'(q + M l) < 0, checked in the caller's data */
};

/* y := M x, n numbers each. Returns 0 when done; a positive number where there is no product, which
 * a value that is not finite says too (outcome 'evaluation_failed'); a negative number to abort the
 * call with PERP_ERROR_CALLBACK. Must not call into the same context. */
typedef int32_t (*perp_lcp_product)(double *y, const double *x, void *user);

/* A problem: views on the caller's memory. M, or products with it. */
typedef struct perp_lcp_problem {
    size_t struct_size;
    const perp_matrix *M;     /* n by n, dense or CSC */
    const double *q;          /* n */
    const double *lower;      /* n, finite or -inf; NULL: 0 */
    const double *upper;      /* n, finite or inf, upper >= lower; NULL: inf */
    perp_lcp_product product; /* in the place of M, of perp_lcp_solve alone; M is symmetric,
                                 positive definite or semidefinite */
    void *user;
    const double *diagonal; /* of products: n, M's own diagonal or about that, > 0: variables of
                               different units are scaled by it; NULL: all units are alike */
    int32_t n;              /* of products: the size; M tells its own */
    int32_t reserved;       /* 0 */
} perp_lcp_problem;

/* What the monitor sees. Filled by the library. */
typedef struct perp_lcp_progress {
    size_t struct_size;
    int32_t method;
    int32_t reserved;
    int64_t iterations;
    double residual; /* the method's own running estimate; +inf where it has none (lemke,
                        active_set on dense problems) */
} perp_lcp_progress;

/* Called once an iteration (lemke, dense: at the first pivot and every 16, and at every round of a
 * crash). Returns 0 to go on, a positive number to stop (outcome 'stopped', best iterate returned),
 * a negative number to abort the call with PERP_ERROR_CALLBACK. Must not call into the same
 * context. */
typedef int32_t (*perp_lcp_monitor)(const perp_lcp_progress *progress, void *user);

typedef struct perp_lcp_settings {
    size_t struct_size;
    int32_t method;           /* PERP_LCP_...; default PERP_LCP_AUTO */
    int32_t max_iterations;   /* pivots, sweeps, Newton steps and nodes, of all methods and attempts
                                 of   the call together; 0 (default): each method's own limit */
    double tol;               /* tested residual, and every row's own residual, that count as
                                 solved; default 1e-10; > 0 */
    double time_limit;        /* seconds; 0 (default): none, and no decision reads the clock */
    double relaxation;        /* pgs: over- or under-relaxation in (0, 2); default 1 */
    int32_t pivot_rule;       /* lemke: PERP_PIVOT_...; default PERP_PIVOT_HARRIS */
    int32_t scaling;          /* 1 (default): equilibrate by powers of two; 0: use M as it is */
    int32_t polish;           /* 1 (default): re-solve the final active set; 0: leave it */
    int32_t crash;            /* lemke: 1 (default): start from a basis found by active sets
                                 where that pays; 0: from the caller's problem as it is */
    perp_lcp_monitor monitor; /* NULL (default): none */
    void *monitor_user;
    int32_t sweep;        /* pgs: PERP_SWEEP_...; default forward */
    int32_t acceleration; /* pgs: PERP_ACCELERATION_...; default none */
    double penalty; /* fischer: weight of max(a,0) max(b,0), in [0, 1); default 0: plain phi */
} perp_lcp_settings;

typedef struct perp_lcp_result {
    size_t struct_size;
    int32_t outcome;         /* PERP_OUTCOME_... */
    int32_t method;          /* the method that gave the answer, PERP_LCP_... */
    int64_t iterations;      /* pivots, sweeps, Newton steps, nodes: of all methods and attempts */
    double residual;         /* tested residual, dimensionless: the one compared with tol */
    double natural_residual; /* max |mid(z - l, z - u, w)| in the caller's units */
    double backward_error;   /* row-wise, on the index set read from z; 2^-52 is one unit */
    double seconds;          /* wall time of the call */
    int32_t certificate;     /* PERP_CERTIFICATE_... */
    int32_t has_ray;         /* 1 if a verified ray was found (and written, if asked for) */
} perp_lcp_result;

/* Sets every field to its default. Returns PERP_OK; PERP_ERROR_ABI for NULL or an unknown size. */
PERP_API perp_status perp_lcp_settings_init(perp_lcp_settings *settings, size_t size);

/* Returns "auto", "lemke", "pgs", "fischer", "polish", "active_set", "patterns", "mprgp"; "unknown
 * method" otherwise. Static. */
PERP_API const char *perp_lcp_method_text(int32_t method);

/* A problem with its workspace. */
typedef struct perp_lcp_solver perp_lcp_solver;

/* Creates a solver without a problem.
 *
 * Returns: PERP_OK, PERP_ERROR_HANDLE, _BUSY, _ARGUMENT, _NOT_FINITE, _ABI or _MEMORY.
 * Out:     solver: the new solver; untouched after failure.
 * In:      settings: copied; NULL for the defaults. */
PERP_API perp_status perp_lcp_solver_create(perp_context *context, perp_lcp_solver **solver,
                                            const perp_lcp_settings *settings) PERP_WARN_UNUSED;

/* Releases a solver; NULL is allowed. Ignored inside a callback of the solver's own context. */
PERP_API void perp_lcp_solver_destroy(perp_lcp_solver *solver);

/* Replaces the settings. The problem and the workspace stay; cost as perp_lcp_solver_setup only
 * where another method needs other memory.
 * Returns: PERP_OK, or a negative status with the old settings still in force. */
PERP_API perp_status perp_lcp_solver_set(perp_lcp_solver *solver,
                                         const perp_lcp_settings *settings) PERP_WARN_UNUSED;

/* Gives the solver its problem: checks every number, finds the scaling, allocates the workspace.
 * Call it again after values of M changed, with the same sizes it allocates nothing.
 *
 * Returns: PERP_OK; PERP_ERROR_ARGUMENT (M not square, unsorted indices, lower > upper, ...),
 *          PERP_ERROR_NOT_FINITE, _ABI, _HANDLE, _BUSY or _MEMORY. After failure the solver keeps
 *          the problem it had.
 * In:      M: n by n, dense or CSC. The view is copied, its arrays are not: they must stay in
 *             place and unchanged until the next setup or destroy.
 *          lower: n entries, or NULL for 0; finite or -inf. Copied.
 *          upper: n entries, or NULL for +inf; finite or +inf, upper >= lower. Copied.
 * Cost:    one pass over M. */
PERP_API perp_status perp_lcp_solver_setup(perp_lcp_solver *solver, const perp_matrix *M,
                                           const double *lower,
                                           const double *upper) PERP_WARN_UNUSED;

/* Solves the problem for one q.
 *
 * Returns: PERP_OK with the outcome in result->outcome; PERP_ERROR_ARGUMENT (no problem set up,
 *          method pgs with M_ii <= 0), PERP_ERROR_NOT_FINITE, _ABI, _HANDLE, _BUSY, _MEMORY or
 *          _CALLBACK. After a negative status nothing was written.
 * Out:     z: n entries, within the bounds; the best iterate found, whatever the outcome.
 *             Variables off the final index set are exactly their bound.
 *          w: n entries, M z + q recomputed from the caller's data; or NULL.
 *          ray: n entries, the direction of z along the secondary ray, largest entry 1; written
 *               only if result->has_ray; or NULL.
 *          result: initialised by perp_struct_init.
 * In:      q: n entries.
 *          z0: n entries, a start (pgs, fischer) or a guess of the active set: it is tried first
 *              (lemke, auto; only with polish = 1), and pivoting starts from the basis it names
 *              (lemke with pivot rule harris, active_set); projected onto the bounds; or NULL.
 * Memory:  none allocated after the first call of a size (third-party factorisations excepted);
 *          under auto a fall-back method makes its memory when it is first needed. */
PERP_API perp_status perp_lcp_solver_solve(perp_lcp_solver *solver, double *z, double *w,
                                           double *ray, perp_lcp_result *result, const double *q,
                                           const double *z0) PERP_WARN_UNUSED;

/* Creates, sets up, solves and destroys in one call; arguments and statuses as above.
 *
 * A problem whose M is known by its products alone (a convolution by FFT, a finite element code of
 * the caller's, a solve) is solved by conjugate gradients on the variables between their bounds,
 * with gradient projections where they meet one (MPRGP). One product a step; their number grows as
 * the square root of M's condition. Then PERP_ERROR_ARGUMENT is also: the product is seen not to be
 * symmetric; and 'stalled' says that M is not positive semidefinite, that no z solves this, or that
 * the residual fell by less than 1 % in 1000 products. There
 *
 * Out:     w: M z + q by one product. ray: not written.
 *          result: `iterations` counts products; `residual` is scaled by D from `diagonal`;
 *             `backward_error` is |r| / (|M| |z| + |q|) in 2-norms of scaled numbers, as rows of M
 *             are not known.
 * In:      settings: tol, max_iterations (products; default 10000), time_limit and monitor are
 *             used.
 * Memory:  13 n doubles, released at the end.
 * Source:  Dostal & Schoberl, Computational Optimization and Applications 30 (2005) 23. */
PERP_API perp_status perp_lcp_solve(perp_context *context, double *z, double *w, double *ray,
                                    perp_lcp_result *result, const perp_lcp_settings *settings,
                                    const perp_lcp_problem *problem,
                                    const double *z0) PERP_WARN_UNUSED;

/* What is known of a point that is to solve a problem. Values never change. */
enum perp_verdict_value {
    PERP_VERDICT_REGULAR = 0,        /* regular block, strictly complementary */
    PERP_VERDICT_NOT_A_SOLUTION = 1, /* the index set that z shows has no solution */
    PERP_VERDICT_SINGULAR = 2,       /* the block M_AA was not shown to be regular */
    PERP_VERDICT_DEGENERATE = 3,     /* some variable is too near its bound, or w_i too near 0 */
    PERP_VERDICT_TOO_LARGE = 4       /* no proof: a sparse block of more than 2048 rows that is
                                        not an H-matrix */
};

/* Returns "regular", "not a solution", "singular", "degenerate", "too large"; "unknown verdict"
 * otherwise. Static. */
PERP_API const char *perp_lcp_verdict_text(int32_t verdict);

typedef struct perp_lcp_proof {
    size_t struct_size;
    int32_t verdict; /* PERP_VERDICT_... */
    int32_t index;   /* the row that decided (not a solution, degenerate); else -1 */
    double radius;   /* regular: a solution z* has |z_i - z*_i| <= radius; else +inf */
} perp_lcp_proof;

/* Proves that a true solution lies near z, for the very doubles given, all rounding counted.
 *
 * A is the set of variables that z, by the natural map, shows strictly between their bounds; a
 * solution with that index set solves M_AA z_A = -(q + M z)_A with the others at their bounds. The
 * proof: M_AA is regular, and in an interval around its solution all of A stays within the bounds
 * and every other w_i keeps its sign. 'Regular' claims that, and then the solution is isolated.
 * 'Not a solution' claims that no solution has this index set. 'Singular' says that M_AA could not
 * be proved regular (its condition is near 1/eps, it is singular, or radii overflow), 'degenerate'
 * that the interval does not settle row `index`; both leave open whether there is a solution.
 *
 * Returns: PERP_OK with the verdict in proof->verdict; PERP_ERROR_ARGUMENT, _NOT_FINITE, _ABI,
 *          _HANDLE, _BUSY or _MEMORY, and then nothing was written.
 * Out:     radii: n entries, |z_i - z*_i| <= radii[i] (+inf without a proof), caller's units; or
 *                 NULL. 0 where z_i is exactly its bound, and z*_i too.
 *          proof: initialised by perp_struct_init.
 * In:      problem: as for perp_lcp_solve, with M. z: n entries, the point.
 * Cost:    |A| = k: about 5 k^3 flops and 4 n^2 doubles (dense M). Sparse M with an H-matrix (so an
 *          M-matrix) as its block: one or two sparse factorisations.
 * Source:  Alefeld, Chen & Potra, "Validation of solutions of linear complementarity problems",
 *          Numer. Math. 83 (1999); Rump, "Verification methods", Acta Numerica 19 (2010). */
PERP_API perp_status perp_lcp_verify(perp_context *context, double *radii, perp_lcp_proof *proof,
                                     const perp_lcp_problem *problem,
                                     const double *z) PERP_WARN_UNUSED;

/* Where a variable of a solution stands. Values never change. */
enum perp_place_value {
    PERP_PLACE_LOWER = 0,   /* at its lower bound */
    PERP_PLACE_UPPER = 1,   /* at its upper bound */
    PERP_PLACE_BETWEEN = 2, /* between its bounds: w_i = 0 */
    PERP_PLACE_FIXED = 3    /* the bounds are equal */
};

/* The derivatives of a solution with respect to its data. */
typedef struct perp_lcp_sensitivity perp_lcp_sensitivity;

typedef struct perp_lcp_sensitivity_info {
    size_t struct_size;
    int32_t verdict;  /* PERP_VERDICT_REGULAR: differentiable; _DEGENERATE, _SINGULAR: not;
                         _NOT_A_SOLUTION: by the front door's own test */
    int32_t index;    /* the row that decided (degenerate, not a solution); else -1 */
    int32_t active;   /* variables between their bounds */
    int32_t reserved; /* 0 */
    double margin;    /* how far the nearest row is from changing its place, in the units of the
                         tested residual; degenerate if it is at most settings.tol */
    double condition; /* estimate of cond_1 of the equilibrated block; 1 if it is empty */
} perp_lcp_sensitivity_info;

/* Reads the index set of a solution off z by the natural map and factors its block M_AA.
 *
 * With strict complementarity and M_AA regular the solution near z is a smooth function of the
 * data, M_AA dz_A = -(dq + dM z + M_AN dz_N)_A,  dz_N = the change of the bounds that N stand at.
 * A degenerate solution is a kink: the products below then are those of the linear piece that
 * belongs to the index set read, one of several that meet there.
 *
 * Returns: PERP_OK, PERP_ERROR_ARGUMENT, _NOT_FINITE, _ABI, _HANDLE, _BUSY or _MEMORY.
 * Out:     sensitivity: the new handle, whatever the verdict; untouched after failure.
 *          info: initialised by perp_struct_init.
 * In:      settings: tol and scaling are used; NULL for the defaults.
 *          problem: as for perp_lcp_solve, with M, whose arrays must stay in place and unchanged
 *             until the handle is destroyed; the others are copied.
 *          z: n entries, a solution as perp_lcp_solve returns it.
 * Cost:    one factorisation of M_AA (LAPACK, or KLU for sparse M). The products cost one solve
 *          each and allocate nothing.
 * Source:  Cottle, Pang & Stone, section 7.4. */
PERP_API perp_status perp_lcp_sensitivity_create(perp_context *context,
                                                 perp_lcp_sensitivity **sensitivity,
                                                 perp_lcp_sensitivity_info *info,
                                                 const perp_lcp_settings *settings,
                                                 const perp_lcp_problem *problem,
                                                 const double *z) PERP_WARN_UNUSED;

/* NULL is allowed. Ignored inside a callback of its own context. */
PERP_API void perp_lcp_sensitivity_destroy(perp_lcp_sensitivity *sensitivity);

/* Writes the index set used: n times PERP_PLACE_... */
PERP_API perp_status perp_lcp_sensitivity_places(perp_lcp_sensitivity *sensitivity,
                                                 int32_t *places) PERP_WARN_UNUSED;

/* dz := the derivative of z in the direction (dq, dM, dlower, dupper).
 *
 * Returns: PERP_OK; PERP_ERROR_ARGUMENT where the verdict was 'singular' or 'not a solution';
 *          _NOT_FINITE (also if dz is not), _ABI, _HANDLE or _BUSY. After failure dz is untouched.
 * Out:     dz: n entries.
 * In:      dq, dlower, dupper: n entries; dM: n by n, any storage; NULL stands for 0. Only the
 *          bound that a variable is at matters; one whose bounds are equal follows dlower. */
PERP_API perp_status perp_lcp_sensitivity_forward(perp_lcp_sensitivity *sensitivity, double *dz,
                                                  const double *dq, const perp_matrix *dM,
                                                  const double *dlower,
                                                  const double *dupper) PERP_WARN_UNUSED;

/* The gradient of a function of z with respect to the data, from its gradient g with respect to z:
 * p := d/dq, p_A = -M_AA^-T g_A and 0 elsewhere. The gradient with respect to M_ij is p_i z_j.
 *
 * Returns: as perp_lcp_sensitivity_forward.
 * Out:     p, lower, upper: n entries each, d/dq, d/dlower and d/dupper; NULL: not needed. p may be
 *          g itself.
 * In:      g: n entries. */
PERP_API perp_status perp_lcp_sensitivity_adjoint(perp_lcp_sensitivity *sensitivity, double *p,
                                                  double *lower, double *upper,
                                                  const double *g) PERP_WARN_UNUSED;

/* A solution, or a family of them, as perp_lcp_all tells it. The arrays are the library's, and
 * valid during the visit only. */
typedef struct perp_lcp_found {
    size_t struct_size;
    int32_t dimension;      /* 0: an isolated solution; else that of the family */
    int32_t vertex_count;   /* at least 1 */
    int32_t ray_count;      /* 0 unless the family is unbounded */
    int32_t reserved;       /* 0 */
    double residual;        /* the largest tested residual of z and the vertices */
    const double *z, *w;    /* n: the solution, of a family a point inside; M z + q */
    const int32_t *places;  /* n: PERP_PLACE_..., an index set that shows it */
    const double *vertices; /* vertex_count times n: the family is their convex hull, */
    const double *rays;     /* ray_count times n: plus all sums of these with factors >= 0 */
} perp_lcp_found;

/* Returns 0 to go on, a positive number to stop (outcome 'stopped'), a negative one to abort the
 * call with PERP_ERROR_CALLBACK. Must not call into the same context. */
typedef int32_t (*perp_lcp_visit)(const perp_lcp_found *found, void *user);

typedef struct perp_lcp_enumeration {
    size_t struct_size;
    int32_t outcome;  /* 'solved': all index sets were looked at; 'iteration_limit', 'time_limit',
                         'stopped': not all; 'stalled': a family with too many vertices (10000) is
                         left out, or an index set whose numbers overflow; 'evaluation_failed': the
                         equilibrated M overflows */
    int32_t isolated; /* solutions reported */
    int32_t families; /* families reported */
    int32_t reserved; /* 0 */
    int64_t nodes;    /* of the tree of index sets */
    int64_t bases;    /* index sets that were not ruled out on the way; */
    int64_t singular; /* those of them with a singular block */
    double seconds;   /* wall time of the call */
} perp_lcp_enumeration;

/* Finds all solutions of a small problem.
 *
 * The solutions with one index set form a polyhedron, mostly a point or empty. Reported are those
 * that no other one contains, each once: isolated solutions, and families by their vertices and
 * rays (two families may meet in points of both). A solution has the front door's residual, at most
 * settings.tol. This is floating-point arithmetic: a block is singular where a pivot of the
 * equilibrated matrix is below 1e-11 of its row, and points closer than 1e-8 of the largest entry
 * are one; perp_lcp_verify proves what is isolated.
 *
 * Returns: PERP_OK; PERP_ERROR_ARGUMENT (also for n > 60), _NOT_FINITE, _ABI, _HANDLE, _BUSY,
 *          _MEMORY or _CALLBACK. After a negative status `result` is untouched; visits may have
 *          been made.
 * Out:     result: initialised by perp_struct_init.
 * In:      settings: tol, scaling, time_limit, max_iterations (nodes), monitor; NULL: the defaults.
 *          problem: as for perp_lcp_solve, with M.
 *          visit: called for each solution; NULL: only counts are wanted.
 * Cost:    up to 2^n index sets, 3^n with finite bounds on both sides; about 0.3 us a node at
 *          n = 20, and branches are cut where a row can't get its sign any more.
 * Source:  polyhedra of index sets: Cottle, Pang & Stone, section 3.1; vertices and rays by the
 *          double description method. */
PERP_API perp_status perp_lcp_all(perp_context *context, perp_lcp_enumeration *result,
                                  const perp_lcp_settings *settings,
                                  const perp_lcp_problem *problem, perp_lcp_visit visit,
                                  void *user) PERP_WARN_UNUSED;

/* Problems of one size: views on the caller's memory, problem k behind problem k - 1. */
typedef struct perp_lcp_stack {
    size_t struct_size;
    int64_t count;
    int32_t n;
    int32_t reserved;    /* 0 */
    const double *M;     /* count matrices n x n, each by rows */
    const double *q;     /* count x n */
    const double *lower; /* count x n; NULL: 0 */
    const double *upper; /* count x n; NULL: inf */
} perp_lcp_stack;

/* Solves `count` problems of the same small size n in one call: groups of them side by side in
 * vector registers, then those that this does not surely solve by a solver each: the outcomes are
 * those of perp_lcp_solve. (A matrix that falls into parts is one of these.)
 *
 * Returns: PERP_OK with an outcome a problem; PERP_ERROR_ARGUMENT, _NOT_FINITE, _ABI, _HANDLE,
 * _BUSY or _MEMORY, and then nothing was written. In messages the index counts through all
 *          problems: entry i of problem k is [k n + i].
 * Out:     z: count x n, row k the answer to problem k, as perp_lcp_solve gives it.
 *          w: count x n, M z + q; or NULL.
 *          outcomes: count times PERP_OUTCOME_...; or NULL.
 *          residuals: count tested residuals; or NULL.
 * In:      settings: as for perp_lcp_solve, NULL for the defaults. The monitor is not called. The
 *             time limit is the call's: a problem gets what is left of it, and once it is over
 *             the rest have outcome time_limit, z nearest to 0, w nan, residual inf. A method
 *             other than auto, or n > 32, is one solve after the other.
 *          threads: 1 to 256 threads of the call's own. The answers have the same bits for any
 *             number of them. The context's allocator is called by one thread at a time.
 * Cost:    bench/results/lcp_batch.txt. Memory: the answers once more, until the call succeeds. */
PERP_API perp_status perp_lcp_batch(perp_context *context, double *z, double *w, int32_t *outcomes,
                                    double *residuals, const perp_lcp_settings *settings,
                                    int32_t threads,
                                    const perp_lcp_stack *problems) PERP_WARN_UNUSED;

#ifdef __cplusplus
}
#endif

#endif
