/* perp/ncp.h: nonlinear complementarity problems with bounds (mixed complementarity problems).
 *
 *   find z in [l, u] with w = F(z) such that, for every i,
 *     w_i >= 0 where z_i = l_i,   w_i <= 0 where z_i = u_i,   w_i = 0 where l_i < z_i < u_i.
 *
 * w_i is free where l_i = u_i. The defaults l = 0, u = +inf give 0 <= z perp F(z) >= 0; both bounds
 * infinite make row i an equation. F and its Jacobian J are callbacks, which are only ever called
 * at points within the bounds.
 *
 * The life of a solve: create, setup (with the problem), solve (again and again), destroy; or
 * perp_ncp_solve() for a single problem.
 *
 * Source of the problem class: Facchinei & Pang, "Finite-Dimensional Variational Inequalities and
 * Complementarity Problems" (2003). */
#ifndef PERP_NCP_H
#define PERP_NCP_H

#include <perp/base.h>
#include <perp/matrix.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Values never change. */
enum perp_ncp_method_value {
    PERP_NCP_AUTO = 0,    /* fischer, then josephy, then both from perturbed starts */
    PERP_NCP_FISCHER = 1, /* semismooth Newton on the Fischer-Burmeister function */
    PERP_NCP_JOSEPHY = 2  /* Josephy-Newton: a linear complementarity problem a step */
};

/* F := F(z), n entries each. Returns 0 when done; a positive number where z is outside of the
 * domain, which a value that is not finite says too: then the step is shortened; a negative number
 * to abort the call with PERP_ERROR_CALLBACK. Must not call into the same context. */
typedef int32_t (*perp_ncp_function)(double *F, const double *z, void *user);

/* Values of J_ij = dF_i/dz_j at z: n by n with leading dimension n, by columns or by rows as the
 * problem's storage says, or in the order of its CSC pattern. Called where F was defined. Every
 * value must be written. Returns as perp_ncp_function. */
typedef int32_t (*perp_ncp_jacobian)(double *values, const double *z, void *user);

typedef struct perp_ncp_problem {
    size_t struct_size;
    int32_t n;
    int32_t storage;              /* of the Jacobian: PERP_STORAGE_... */
    const int32_t *column_starts; /* CSC: n + 1; else NULL */
    const int32_t *row_indices;   /* CSC: sorted within a column; else NULL */
    perp_ncp_function function;
    perp_ncp_jacobian jacobian; /* NULL: finite differences, F called once a column (dense) or
                                   once a colour of the pattern's columns (CSC) */
    const double *lower;        /* n entries, finite or -inf; NULL: 0 */
    const double *upper;        /* n entries, finite or +inf, >= lower; NULL: +inf */
    void *user;                 /* handed to both callbacks */
} perp_ncp_problem;

/* What the monitor sees. Filled by the library. */
typedef struct perp_ncp_progress {
    size_t struct_size;
    int32_t method;
    int32_t restarts;    /* perturbed starts so far */
    int64_t iterations;  /* of this run */
    int64_t evaluations; /* calls of the function so far, those for differences included */
    double residual;     /* natural residual in the method's scaled units */
} perp_ncp_progress;

/* Called once an iteration. Returns 0 to go on, a positive number to stop (outcome 'stopped', best
 * iterate returned), a negative one to abort the call with PERP_ERROR_CALLBACK. Must not call into
 * the same context. */
typedef int32_t (*perp_ncp_monitor)(const perp_ncp_progress *progress, void *user);

typedef struct perp_ncp_settings {
    size_t struct_size;
    int32_t method;           /* PERP_NCP_...; default PERP_NCP_AUTO */
    int32_t max_iterations;   /* Newton steps of the call, all runs together, half of them for
                                 fischer under auto; 0 (default): 200 a run, but 100 for fischer
                                 under auto, and no limit for all together */
    double tol;               /* tested residual that counts as solved; default 1e-10; > 0 */
    double time_limit;        /* seconds of the call; 0 (default): none, and no decision reads the
                                 clock. Looked at before each call of F: one more may follow */
    double penalty;           /* fischer: weight of max(a,0) max(b,0), in [0, 1); default
                               0.1; 0: the plain function */
    int32_t restarts;         /* auto: most perturbed starts; default 20; >= 0 */
    int32_t scaling;          /* 1 (default): equilibrate by powers of two; 0: as it is */
    int32_t polish;           /* 1 (default): on to the limit of rounding; 0: stop at tol */
    int32_t reserved;         /* 0 */
    perp_ncp_monitor monitor; /* NULL (default): none */
    void *monitor_user;
} perp_ncp_settings;

typedef struct perp_ncp_result {
    size_t struct_size;
    int32_t outcome;              /* PERP_OUTCOME_... */
    int32_t method;               /* the method that gave the answer, PERP_NCP_... */
    int64_t iterations;           /* Newton steps of all runs of the call */
    double residual;              /* tested residual of z, dimensionless: compared with tol */
    double natural_residual;      /* max |mid(z - l, z - u, w)| in the caller's units */
    double backward_error;        /* row-wise, of the linearisation at z; 2^-52 is one unit */
    double seconds;               /* wall time of the call */
    int64_t function_evaluations; /* calls of the function, those for differences included */
    int64_t jacobian_evaluations; /* Jacobians, by callback or by differences */
    int32_t restarts;             /* perturbed starts made */
    int32_t trapped; /* 1: z is no solution, but a stationary point of the merit function; Newton's
                        method can't leave it, and only another start can help */
} perp_ncp_result;

/* Sets every field to its default. Returns PERP_OK; PERP_ERROR_ABI for NULL or an unknown size. */
PERP_API perp_status perp_ncp_settings_init(perp_ncp_settings *settings, size_t size);

/* Returns "auto", "fischer", "josephy"; "unknown method" otherwise. Static. */
PERP_API const char *perp_ncp_method_text(int32_t method);

/* A problem with its workspace. */
typedef struct perp_ncp_solver perp_ncp_solver;

/* Creates a solver without a problem.
 *
 * Returns: PERP_OK, PERP_ERROR_HANDLE, _BUSY, _ARGUMENT, _NOT_FINITE, _ABI or _MEMORY.
 * Out:     solver: the new solver; untouched after failure.
 * In:      settings: copied; NULL for the defaults. */
PERP_API perp_status perp_ncp_solver_create(perp_context *context, perp_ncp_solver **solver,
                                            const perp_ncp_settings *settings) PERP_WARN_UNUSED;

/* Releases a solver; NULL is allowed. Ignored inside a callback of the solver's own context. */
PERP_API void perp_ncp_solver_destroy(perp_ncp_solver *solver);

/* Replaces the settings; the problem stays.
 * Returns: PERP_OK, or a negative status with the old settings still in force. */
PERP_API perp_status perp_ncp_solver_set(perp_ncp_solver *solver,
                                         const perp_ncp_settings *settings) PERP_WARN_UNUSED;

/* Gives the solver its problem. No callback is called.
 *
 * Returns: PERP_OK; PERP_ERROR_ARGUMENT (no function, unsorted indices, lower > upper, ...),
 *          PERP_ERROR_NOT_FINITE, _ABI, _HANDLE, _BUSY or _MEMORY. After failure the solver keeps
 *          the problem it had.
 * In:      problem: the struct, pattern and bounds are copied.
 * Cost:    linear in n and the pattern. Memory: about n^2 doubles dense, three times the pattern
 *          sparse, before factorisation. */
PERP_API perp_status perp_ncp_solver_setup(perp_ncp_solver *solver,
                                           const perp_ncp_problem *problem) PERP_WARN_UNUSED;

/* Solves the problem from one start.
 *
 * What counts is judged at the point returned, not by the method: with J = J(z), q = F(z) - J z and
 * D the power-of-two equilibration of J (as perp/lcp.h has it), rows and variables hang together by
 * entries of J other than 0. All that hangs together has one unit omega, the power of two near
 * max(|D q|, |z/D|, 2^-20 |z0/D|), and independent parts of a system don't see each other. The
 * tested residual is max |mid((z - l)/(D omega_z), (z - u)/(D omega_z), D w/omega_w)|. (omega =
 * |D q|, as for linear problems, would be rounding alone where F is homogeneous.) 'solved' is
 * tested residual <= tol, and <= sqrt(tol) with the J, D and omega of the start, as a guard against
 * scales that have run away, and no row wrong by more than tol of what it and its neighbours carry;
 * 'rounding_limit' that tol was missed, but the backward error of (J, q) is at most 16 eps and the
 * others at most sqrt(tol); both come with finite z and w only. 'evaluation_failed' that F was
 * defined neither at z0 nor near it (z is then z0 projected onto the bounds, w NaN); 'singular'
 * that the Jacobian had no use at the last point; 'stalled' that no run of any method got further.
 * Up to 64 parts that are not solved together are solved one by one.
 *
 * Returns: PERP_OK with the outcome in result->outcome; PERP_ERROR_ARGUMENT (no problem set up),
 *          PERP_ERROR_NOT_FINITE, _ABI, _HANDLE, _BUSY, _MEMORY or _CALLBACK. After a negative
 *          status nothing was written.
 * Out:     z: n entries, within the bounds; the best iterate found, whatever the outcome. With
 *             polish = 1, variables that an answer has at a bound are exactly that bound.
 *          w: n entries, F(z); or NULL.
 *          result: initialised by perp_struct_init.
 * In:      z0: n entries, the start; projected onto the bounds; NULL for the point nearest to 0.
 * Memory:  none allocated after the first call of a size (third-party factorisations excepted);
 *          josephy makes its memory when it is first needed.
 * Cost:    one Jacobian and one factorisation (or linear complementarity problem) a step.
 * Source:  De Luca, Facchinei & Kanzow, Math. Prog. 75 (1996); Chen, Chen & Kanzow, Math. Prog. 88
 *          (2000) (penalty); Kanzow, Munson & Ferris, "Feasible descent algorithms for mixed
 *          complementarity problems", Math. Prog. 86 (1999); Josephy (1979); Billups (1995). */
PERP_API perp_status perp_ncp_solver_solve(perp_ncp_solver *solver, double *z, double *w,
                                           perp_ncp_result *result,
                                           const double *z0) PERP_WARN_UNUSED;

/* Creates, sets up, solves and destroys in one call; arguments and statuses as above. */
PERP_API perp_status perp_ncp_solve(perp_context *context, double *z, double *w,
                                    perp_ncp_result *result, const perp_ncp_settings *settings,
                                    const perp_ncp_problem *problem,
                                    const double *z0) PERP_WARN_UNUSED;

/* How a Jacobian callback compares with differences of F. Entries are numbered from 0. */
typedef struct perp_ncp_check {
    size_t struct_size;
    int32_t wrong;       /* entries that differ by more than differences can be wrong */
    int32_t missing;     /* entries not in the CSC pattern whose difference isn't 0 */
    int32_t row, column; /* the entry with the worst disagreement; -1 if n = 0 */
    double given;        /* there: the callback's value, */
    double difference;   /* the value by differences, */
    double uncertainty;  /* and the estimated error of that */
    int32_t missing_row; /* the missing entry with the largest difference; -1 if there is none */
    int32_t missing_column;
    double missing_difference;
    int32_t unchecked; /* columns that could not be checked: a fixed variable, or F is not
                          defined next to z */
    int32_t reserved;  /* 0 */
} perp_ncp_check;

/* Compares problem->jacobian at z with central differences, extrapolated from two steps
 * (Richardson), which tell their own error; one-sided where a bound is near.
 *
 * An entry is wrong if it is further from the difference than 8 times the estimated error and 1e-7
 * of itself.
 *
 * Returns: PERP_OK with the verdict in check; PERP_ERROR_ARGUMENT (also: no jacobian callback, z
 *          outside of the bounds, F or J not defined at z), _NOT_FINITE, _ABI, _HANDLE, _BUSY,
 *          _MEMORY or _CALLBACK, and then nothing was written.
 * Out:     check: initialised by perp_struct_init.
 * In:      problem: as for perp_ncp_solver_setup. z: n entries, within the bounds; a point without
 *          special values (0, 1) shows more.
 * Cost:    one call of the Jacobian, about 4 n of the function. */
PERP_API perp_status perp_ncp_check_jacobian(perp_context *context, perp_ncp_check *check,
                                             const perp_ncp_problem *problem,
                                             const double *z) PERP_WARN_UNUSED;

#ifdef __cplusplus
}
#endif

#endif
