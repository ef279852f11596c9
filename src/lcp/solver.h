/* The solver's own memory, shared by the files of the front door only. */
#ifndef PERP_LCP_SOLVER_H
#define PERP_LCP_SOLVER_H

#include "base/arena.h"
#include "base/handle.h"
#include "base/outcome.h"
#include "lcp/lcp.h"
#include "lcp/method.h"
#include "linalg/scale.h"
#include "linalg/witness.h"

#define PERP__METHODS 4

/* What a point is worth: the numbers docs/lcp.md defines, all from the caller's data. */
typedef struct perp__evaluation {
    double natural, tested, backward;
    int32_t finite; /* all of z and w */
    int32_t small;  /* every row's violation is at most tol |q_i|: the second witness agrees */
} perp__evaluation;

/* A method and its workspace, made when it first runs. */
typedef struct perp__method_slot {
    const perp__lcp_method *method;
    perp__workspace space;
} perp__method_slot;

/* A point in the caller's units with all that is known of it. */
typedef struct perp__candidate {
    double *z, *w;
    perp__evaluation residuals;
    perp_outcome outcome;
    int32_t method;
} perp__candidate;

/* Workspace of the polish; the factors of the active block are the solver's. */
typedef struct perp__polish {
    perp__arena arena;
    int64_t fitted;
    int32_t *active;            /* n */
    int8_t *places;             /* n, of the best point */
    double *z, *w_high, *w_low; /* n, the best point */
    double *step;               /* n */
} perp__polish;

struct perp_lcp_solver {
    PERP__HANDLE;
    perp_lcp_settings settings;
    perp__arena arena;
    int64_t setups; /* 0: no problem yet */
    int64_t shape;  /* the set-up since which arrays have needed no other sizes */
    int32_t free_variables, n;
    int32_t length; /* n; up to PERP__SMALL_LENGTH whole vectors: arrays are 0 from n to there */
    perp__matrix M;
    perp__matrix wide;        /* for products: M, with zeros to that length where M has them */
    double *columns, *scaled; /* small dense problems: M, which is a view of them then, and -D M D;
                                 16 entries a column, 0 beyond n */
    int32_t by_columns;       /* they are in use */
    int32_t is_small;         /* and the bounds are 0 and +inf */
    double *lower, *upper;    /* caller's units */
    double *factors;          /* D */
    perp__matrix S;           /* of perp__scale_matrix */
    double *S_values;
    perp__arena S_arena;
    int64_t S_setup;    /* the set-up that it is of */
    int32_t *exponents; /* log2 of D, see linalg/scale.h */
    int32_t *work;      /* 2 n */
    double *row_norms;  /* 1-norms of the rows of D M D */
    const double *q;    /* the caller's, during a solve, or q_own */
    double *q_own;      /* 0 beyond n */
    double *turned;     /* M's values with equations turned round */
    size_t turned_entries;
    int8_t *signs;        /* n: -1 where a row is, */
    int32_t is_turned;    /* if any is */
    int32_t as_given;     /* 1: none is to be turned: of who reads w, or M, from here */
    int32_t *part, parts; /* 2 n: the part of M that a row, or n + a column, belongs to; how many */
    int32_t *omega; /* 2 n: a row's, then a column's: log2 of the power of two near max |D q| in
                       its part */
    int32_t *part_omega;   /* the same, a part's */
    int32_t powers_known;  /* those below are of these exponents and omegas */
    int32_t powers_normal; /* and none is beyond the range of normal numbers: else use ldexp */
    double *z_down, *z_up; /* 2^-(e_i + omega), 2^(e_i + omega) */
    double *w_down;        /* 2^(e_i - omega) */
    double *reach;         /* a part's largest |z_i|, scaled, of the point evaluated last */
    int32_t doubtful;      /* w may have lost q in doubled precision: terms tell by how much */
    perp__witness witness;
    double *q_scaled, *lower_scaled, *upper_scaled;
    double *iterate;        /* scaled, what a method works on */
    double *ray, *covering; /* scaled */
    int8_t *places;
    double *z, *w_high, *w_low; /* the point under evaluation, caller's units */
    perp__candidate best;
    double *game_start;
    int32_t missing;  /* its strategy j, whose w_j > 0 as well */
    double *best_ray; /* caller's units, largest entry 1 */
    int32_t best_certificate;
    int32_t rays;       /* verified ones, of this solve */
    int32_t improvable; /* what the last attempt said of itself */
    int32_t refused;    /* the last candidate passed the first witness, not the second */
    int64_t spent;      /* iterations of all attempts that ended */
    perp_outcome ended; /* stopped or time_limit, once that has happened; else -1 */
    double deadline;    /* of the solve, on perp__now()'s clock; 0: none */
    perp__lcp_problem problem;
    perp__lcp_control control;
    perp__method_slot slots[PERP__METHODS];
    perp__polish polish;
    perp_lcp_solver *inner;     /* of parts that are solved one by one; NULL until there are some */
    int32_t *apart;             /* 4 n: their variables, see apart.c */
    struct perp__lcp_all *tree; /* of the last word on small problems; NULL until it is asked */
    int32_t insists;            /* on larger ones, too */
    int32_t (*correct)(void *work, const double *residual, double *step); /* perp__lcp_iterate's */
    void *correct_work;
    perp__sparse_block block; /* blocks of S */
    int64_t block_read;       /* the set-up it was read from */
};

/* D M D by columns, for methods and the polish: CSC where M is, and large, else dense; and how many
 * values it has. */
perp__matrix perp__scale_matrix(const perp_lcp_solver *solver, double *values);
size_t perp__scaled_entries(const perp_lcp_solver *solver);

/* Makes solver->S, and solver->block of it, once a set-up. PERP_OK or _MEMORY. */
perp_status perp__read_block(perp_lcp_solver *solver);

/* The monitor and the time limit of a call that began then. */
void perp__open_control(perp_lcp_solver *solver, double started);

/* Scales q and the bounds into q_scaled, lower_scaled, upper_scaled; finds omega. */
void perp__scale_problem(perp_lcp_solver *solver, const double *q);

/* Caller's units to scaled ones and back, for the variable z_i, and for w_i. */
static inline double perp__z_scaled(const perp_lcp_solver *solver, int32_t i, double z)
{
    return solver->powers_normal
               ? z * solver->z_down[i]
               : perp__shift(z, -solver->exponents[i] - solver->omega[solver->n + i]);
}

static inline double perp__z_caller(const perp_lcp_solver *solver, int32_t i, double z)
{
    return solver->powers_normal
               ? z * solver->z_up[i]
               : perp__shift(z, solver->exponents[i] + solver->omega[solver->n + i]);
}

/* The same for a point of a method or a face: bounds come back as they are, however far the scaling
 * has pushed them. */
static inline double perp__z_exact(const perp_lcp_solver *solver, int32_t i, double z)
{
    return z == solver->lower_scaled[i]   ? solver->lower[i]
           : z == solver->upper_scaled[i] ? solver->upper[i]
                                          : perp__z_caller(solver, i, z);
}

static inline double perp__w_scaled(const perp_lcp_solver *solver, int32_t i, double w)
{
    return solver->powers_normal ? w * solver->w_down[i]
                                 : perp__shift(w, solver->exponents[i] - solver->omega[i]);
}

/* reach := the largest |z_i|, scaled, of every part. */
void perp__find_reach(perp_lcp_solver *solver);

/* Projects solver->z onto the bounds and recomputes w = M z + q in doubled precision (w_high,
 * w_low). */
void perp__find_product(perp_lcp_solver *solver);
/* The same, and the three numbers. */
perp__evaluation perp__evaluate(perp_lcp_solver *solver);
/* The same for a z within its bounds whose w is there already. */
perp__evaluation perp__evaluate_product(perp_lcp_solver *solver);

/* What the gate is told of the point of the last perp__evaluate; the second witness is asked where
 * the first may pass. `unit`: that of a point which is not refined, so that rounding is beside its
 * largest entry; 1 else. */
perp__evidence perp__lcp_evidence(perp_lcp_solver *solver, const perp__evaluation *residuals,
                                  double unit);

/* What the point of the last perp__evaluate is called (base/outcome.h): the gate, with the second
 * witness where the first has passed. */
perp_outcome perp__lcp_outcome_of(perp_lcp_solver *solver, const perp__evaluation *residuals,
                                  perp_outcome said);

/* From this tolerance on a few sweeps are tried before anything is factored, and nothing that is
 * good is polished. */
#define PERP__ROUGH_TOLERANCE 1e-4

/* A method that the front door tries, and what it may spend. */
typedef struct perp__plan_step {
    int32_t method;          /* PERP_LCP_... */
    int64_t iteration_limit; /* <= 0: the method's own */
    double share;            /* of the time limit; 1: all that is left */
    int32_t yields;          /* iterations after which their rate may end it; 0: it does not */
    int32_t as_lu;           /* what LU of M costs is the iteration_limit */
    int32_t rough;           /* its point is taken as it is, without the polish */
} perp__plan_step;

/* plan.c: fills `steps` (room for PERP__PLAN_MOST) with the methods to try, in their order; returns
 * how many there are. */
#define PERP__PLAN_MOST (PERP__METHODS + 3)
int32_t perp__make_plan(const perp_lcp_solver *solver, perp__plan_step *steps);

/* small.c: makes M a view of its columns; perp__equilibrate for it, which scales them as well, and
 * finds the factors. */
void perp__small_read(perp_lcp_solver *solver);
void perp__small_equilibrate(perp_lcp_solver *solver);
/* The shortest way for a small dense problem. False where that does not solve it to the last
 * digits: nothing but the point and solver->spent has changed then. */
bool perp__small_solve(perp_lcp_solver *solver, const double *z0, perp__evaluation *residuals);

/* Makes solver->z the candidate of a step: evaluates it, polishes it unless it is far off, keeps it
 * if it is the best so far or the first. PERP_OK, or _MEMORY. */
perp_status perp__consider(perp_lcp_solver *solver, const perp__plan_step *step, perp_outcome said,
                           const perp__lcp_iterate *iterate, const double *z0);

/* Keeps solver->z as it is, by this method which said this, if it is the best so far. */
void perp__consider_point(perp_lcp_solver *solver, int32_t method, perp_outcome said);

/* As good as a double gets: a backward error up to PERP__EXACT leaves nothing to gain. */
#define PERP__EXACT (4.0 * DBL_EPSILON)
bool perp__is_exact(const perp_lcp_solver *solver, const perp__evaluation *residuals);

/* Reads places off solver->z and w_high: the side of z - w, in scaled units, on which it lies. */
void perp__read_places(perp_lcp_solver *solver, int8_t *places);

/* How far row i is from changing its place in solver->places, in units of the tested residual. */
double perp__margin_of(const perp_lcp_solver *solver, int32_t i);

/* Makes the polish's memory ready for this set-up. PERP_OK, or _MEMORY. */
perp_status perp__polish_fit(perp_lcp_solver *solver);

/* A step of this relative size s is the last one: it leaves an error of about s^2, as the inverse
 * is about as inaccurate as the point that came with it. */
#define PERP__LAST_STEP sqrt(DBL_EPSILON)

/* Where the method that found the point of the last perp__find_product holds the inverse of its
 * active block: one step of refinement with it, instead of a factorisation, if that is all it
 * takes. True if that gave a point as good as a double gets, with its worth; else nothing has
 * changed. */
bool perp__polish_correct(perp_lcp_solver *solver, perp__evaluation *residuals);

/* Solves the parts of few variables that share nothing one by one; nothing where there is but one
 * part. PERP_OK, _MEMORY, or _CALLBACK if the monitor aborts. */
perp_status perp__solve_apart(perp_lcp_solver *solver);

/* Re-solves the index set `places`, starting from solver->z as evaluated last, which is good as it
 * is or not, repairs a few signs,
 * and leaves the best point it met in solver->z with w_high, w_low and its worth. PERP_OK, or
 * _MEMORY. */
perp_status perp__polish_run(perp_lcp_solver *solver, perp__evaluation *residuals, bool is_good);

/* Checks the ray in solver->ray against the caller's matrix; true if it is one, and then D ray is
 * in solver->z. The certificate tells whether it, or a vector within its rounding that is left
 * there instead, proves that no z >= l has M z + q >= 0. */
bool perp__ray_verify(perp_lcp_solver *solver);
bool perp__ray_certificate(perp_lcp_solver *solver);

#endif
