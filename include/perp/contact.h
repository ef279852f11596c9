/* perp/contact.h: contact with Coulomb friction over somebody else's dynamics.
 *
 *   M v = f + H'r + G's,     u = H v + w,     0 = G v + b
 *
 * v: n velocities, f: M times the velocities without contact (momentum and impulses of the forces),
 * r: impulses and u: velocities of the contacts, s: impulses of the bilateral rows (joints). Gap
 * and restitution are folded into w by the caller (w_n = gap / h, or the share e of the old
 * velocity). Or, with v eliminated,
 *
 *   u = W r + q,     W = H M^-1 H' + compliance,     q = H M^-1 f + w.
 *
 * The rows of a contact are its normal first, r_n >= 0 and u_n > 0 where it opens; then its
 * tangents (none in dimension 1, one in 2, two in 3); then, where its coefficient of rolling
 * friction is > 0, its rolling rows (one in 2, two in 3 dimensions); then, where its coefficient of
 * spinning friction is > 0, its spinning row (3 dimensions). Contact after contact, without gaps.
 * The law:
 *
 *   0 <= r_n  perp  u_n >= 0                                                   (Signorini)
 *   |r_t| <= mu r_n,   r_t = -mu r_n u_t / |u_t|  where u_t != 0               (Coulomb)
 *
 * and the same with rolling r_n and spinning r_n for their rows. With s = mu |u_t| this is r in K
 * and u + s e_n in K*, perpendicular to each other, for the cone K = {|r_t| <= mu r_n}: the
 * friction cone itself, no dilation of u.
 *
 * A contact may also hold both ways (a pin in its hole, a gib, the flank of a screw;
 * laws.two_sided): its first rows, 1, 2 or 3, are normals with r_N of any sign, then come 1 or 2
 * tangents, and
 *
 *   u_N = 0,   |r_t| <= mu |r_N|,   r_t = -mu |r_N| u_t / |u_t|  where u_t != 0
 *
 * Friction grows with what the contact itself carries, whichever way it is pushed (Dupont,
 * "Existence and uniqueness of rigid-body dynamics with Coulomb friction", Trans. CSME 17 (1993)):
 * v need not be unique, and the answer is one of several.
 *
 * Rows of H past those of the contacts have bounds of their own, lower <= r_i <= upper:
 *
 *   u_i >= 0 where r_i = lower,   u_i <= 0 where r_i = upper,   u_i = 0 between
 *
 * A limit of a joint is [0, inf) against u = gap / h + velocity; a motor that asks for a speed,
 * or dry friction of a given bound, is [-h F, h F] against the velocity less that speed; both
 * infinite is an equation.
 *
 * Uniqueness: docs/contact.md. With redundant contacts (four feet of a table) only v and the
 * resultants H'r are determined; with friction even v may not be (a wedge).
 *
 * Sources: De Saxce & Feng, Math. Comput. Modelling 28 (1998); Acary & Brogliato, "Numerical
 * Methods for Nonsmooth Dynamical Systems" (2008); Stewart & Trinkle, IJNME 39 (1996).
 */
#ifndef PERP_CONTACT_H
#define PERP_CONTACT_H

#include <perp/base.h>
#include <perp/lcp.h> /* verdicts */
#include <perp/matrix.h>

#ifdef __cplusplus
extern "C" {
#endif

/* What a contact, or a row with bounds of its own, does. Values never change. */
enum perp_contact_mode_value {
    PERP_CONTACT_SEPARATE = 0, /* no impulse */
    PERP_CONTACT_STICK = 1,    /* it presses and nothing slides; a row: u = 0 */
    PERP_CONTACT_SLIP = 2,     /* it presses, or holds both ways, and slides (or rolls, or spins) */
    PERP_CONTACT_LOWER = 3,    /* a row: at its lower bound */
    PERP_CONTACT_UPPER = 4     /* a row: at its upper bound */
};

/* Values never change. */
enum perp_contact_method_value {
    PERP_CONTACT_METHOD_AUTO = 0,    /* sweeps, proximal, then lemke with a refinement */
    PERP_CONTACT_METHOD_SWEEP = 1,   /* block Gauss-Seidel with an exact solver a contact */
    PERP_CONTACT_METHOD_NEWTON = 2,  /* another name of PROXIMAL */
    PERP_CONTACT_METHOD_LEMKE = 3,   /* pivoting on polyhedral cones; dense, for hundreds of rows */
    PERP_CONTACT_METHOD_POLISH = 4,  /* only ever reported: the start r0 was the answer */
    PERP_CONTACT_METHOD_ADMM = 5,    /* alternating directions: a middle accuracy */
    PERP_CONTACT_METHOD_PROXIMAL = 6 /* those, then second order */
};

/* What a ray proves. Values never change. */
enum perp_contact_certificate_value {
    PERP_CONTACT_CERTIFICATE_NONE = 0,
    PERP_CONTACT_CERTIFICATE_INFEASIBLE = 1 /* no velocities keep all u_n >= 0: the ray y has
                                               y_n >= 0, nothing on other rows of contacts,
                                               W y = 0 (H'y = 0) and y'q < 0, checked in the
                                               caller's data */
};

/* Contacts and their coefficients. */
typedef struct perp_contact_laws {
    size_t struct_size;
    int32_t contacts;
    int32_t dim;              /* of every contact where dims is NULL: 1, 2 or 3; default 3 */
    const int32_t *dims;      /* contacts: 1 (frictionless), 2 or 3; two-sided ones: all their
                                 rows, 2 to 5; or NULL */
    const double *mu;         /* contacts, >= 0; not read where the dimension is 1; NULL: 0 */
    const double *rolling;    /* contacts, >= 0; a length; NULL: none. Adds rows where > 0 */
    const double *spinning;   /* contacts, >= 0; a length; NULL: none. Adds a row where > 0 */
    const double *compliance; /* all rows, >= 0: added to the diagonal of W; NULL: rigid */
    int32_t bilateral;        /* rows past those of the contacts that are bilateral, u_i = 0. With
                                 perp_contact_dynamics it is the rows of G, and may be left 0 */
    int32_t bounded;     /* rows past those of the contacts, before the bilateral ones, that have
                            bounds of their own: the last ones of H */
    const double *lower; /* bounded: may be -inf; NULL: 0 */
    const double *upper; /* bounded: may be inf; NULL: inf */
    const int32_t *two_sided; /* contacts: 0: ordinary; 1, 2 or 3: so many normals that hold both
                                 ways, with dims - two_sided tangents, 1 or 2: 1 a guide or a
                                 flank, 2 a pin in the plane or an axle, 3 a ball joint; its tangent
                                 row is the radius times the relative angular velocity. Without
                                 rolling or spinning friction, and only with cone 0. NULL: none */
} perp_contact_laws;

/* x := M^-1 x for `columns` right-hand sides of n entries each, one after the other. Returns 0, or
 * any other number to abort the call with PERP_ERROR_CALLBACK. Must give the same answer to the
 * same question, and must not call into the same context. */
typedef int32_t (*perp_contact_mass_solve)(double *x, int32_t columns, void *user);

/* The dynamics: M and G, or a callback in the place of M. */
typedef struct perp_contact_dynamics {
    size_t struct_size;
    int32_t n;                     /* velocities */
    int32_t reserved;              /* 0 */
    const perp_matrix *M;          /* n by n, symmetric positive definite, dense or CSC; or NULL */
    perp_contact_mass_solve solve; /* in the place of M: exactly one of the two */
    void *user;
    const perp_matrix *H; /* rows of the contacts and those with bounds by n, dense or CSC */
    const perp_matrix *G; /* bilateral rows by n, or NULL */
} perp_contact_dynamics;

/* A problem: contacts with their dynamics, f, w and b, or with W and q. */
typedef struct perp_contact_problem {
    size_t struct_size;
    const perp_contact_laws *laws;
    const perp_contact_dynamics *dynamics;
    const double *f;      /* n */
    const double *w;      /* rows */
    const double *b;      /* bilateral rows; NULL: 0 */
    const perp_matrix *W; /* in the place of dynamics, f, w and b: the Delassus matrix, */
    const double *q;      /* and q, of all rows */
} perp_contact_problem;

/* Where an answer is written: the caller's arrays; NULL: not needed. */
typedef struct perp_contact_answer {
    size_t struct_size;
    double *v;      /* n */
    double *r;      /* rows, then bilateral rows; needed */
    double *u;      /* as r */
    int32_t *modes; /* contacts, then rows with bounds */
    double *ray;    /* as r */
} perp_contact_answer;

/* What the monitor sees. Filled by the library. */
typedef struct perp_contact_progress {
    size_t struct_size;
    int32_t method;
    int32_t reserved;
    int64_t iterations;
    double residual; /* the method's own running estimate; +inf where it has none */
} perp_contact_progress;

/* Called every iteration or every few. Returns 0 to go on, a positive number to stop (outcome
 * 'stopped', best iterate returned), a negative number to abort the call with PERP_ERROR_CALLBACK.
 * Must not call into the same context. */
typedef int32_t (*perp_contact_monitor)(const perp_contact_progress *progress, void *user);

typedef struct perp_contact_settings {
    size_t struct_size;
    int32_t method;               /* PERP_CONTACT_METHOD_...; default auto */
    int32_t cone;                 /* 0 (default): exact. k >= 3: in 3 dimensions a polyhedron with k
                                     edges inscribed in the cone, the first along the first tangent; it
                                     holds back by as little as cos(pi / k) mu. Taken by lemke alone,
                                     which auto then is. Up to 1024 */
    double tol;                   /* tested residual that counts as solved; default 1e-8; > 0 */
    int32_t max_iterations;       /* of each method, all its attempts together, and of the polish; 0
                                     (default): their own limits. Where it is reached no proof of
                                     infeasibility is looked for */
    int32_t raw_velocity;         /* 1: v and u are left as the impulses make them, to rounding: for
                                     callers who find exact zeros themselves; it takes about half
                                     the time. 2: small problems leave v so but where all of it is
                                     slow, and u of what holds is 0. 0 (default): what holds has its
                                     velocity exactly */
    double time_limit;            /* seconds; 0 (default): none, and no decision reads the clock */
    perp_contact_monitor monitor; /* NULL (default): none */
    void *monitor_user;
} perp_contact_settings;

/* Residuals are those of the impulses returned, recomputed from the caller's data with u in doubled
 * precision. t_k is the trace of contact k's block of W (an inverse mass), D_k the friction disc,
 * interval or polygon of size mu r_n. Velocities are in the units of u, impulses in those of r.
 * Parts of the problem that W does not couple, or by less than 2^-30 sqrt(t_j t_k), are judged each
 * by itself, and the outcome is that of the worst. */
typedef struct perp_contact_result {
    size_t struct_size;
    int32_t outcome;    /* PERP_OUTCOME_... */
    int32_t method;     /* that gave the answer, PERP_CONTACT_METHOD_... */
    int64_t iterations; /* sweeps, pivots and Newton steps of all that ran in the call */
    double residual;    /* tested residual, dimensionless, the one compared with tol: max sqrt(t_k)
                           |r - P_K(r - (u + s e_n) / t_k)| / omega, omega = max |q_k| / sqrt(t_k)
                           over the contact's part. A good outcome says besides that each contact
                           is right beside its own terms (docs/contact.md) */
    double natural_residual;     /* max |r - P_K(r - (u + s e_n) / t_k)|, impulse */
    double backward_error;       /* largest change of a contact's u that makes the law exact, over
                                    sum_j |W_kj| |r_j| + |q_k|; 2^-52 is one unit */
    double signorini_velocity;   /* max |min(u_n, t_k r_n)|; rows with one bound likewise */
    double signorini_impulse;    /* max |min(u_n / t_k, r_n)| */
    double cone;                 /* max |r_t| - mu r_n where above 0, impulse */
    double dissipation_velocity; /* max t_k |r_t - P_D(r_t - u_t / t_k)|; rows with two likewise */
    double dissipation_impulse;  /* max |r_t - P_D(r_t - u_t / t_k)| */
    double bilateral;            /* max |u_i| of the bilateral rows and of the normals that hold
                                    both ways, velocity */
    double seconds;              /* wall time of the whole call */
    int32_t certificate;         /* PERP_CONTACT_CERTIFICATE_... */
    int32_t has_ray;             /* 1 if a verified ray was found (and written, if asked for) */
} perp_contact_result;

/* Set every field to its default. Return PERP_OK, or PERP_ERROR_ABI for NULL or an unknown size. */
PERP_API perp_status perp_contact_laws_init(perp_contact_laws *laws, size_t size);
PERP_API perp_status perp_contact_settings_init(perp_contact_settings *settings, size_t size);

/* Returns "separate", "stick", "slip", "lower" or "upper"; "unknown mode" otherwise. Static. */
PERP_API const char *perp_contact_mode_text(int32_t mode);

/* Returns "auto", "sweep", "newton", "lemke", "polish", "admm", "proximal"; "unknown method"
 * otherwise. Static. */
PERP_API const char *perp_contact_method_text(int32_t method);

/* A problem with its workspace. */
typedef struct perp_contact_solver perp_contact_solver;

/* Creates a solver without a problem.
 *
 * Returns: PERP_OK, PERP_ERROR_HANDLE, _BUSY, _ARGUMENT, _NOT_FINITE, _ABI or _MEMORY.
 * Out:     solver: the new solver; untouched after failure.
 * In:      settings: copied; NULL for the defaults. */
PERP_API perp_status perp_contact_solver_create(perp_context *context, perp_contact_solver **solver,
                                                const perp_contact_settings *settings)
    PERP_WARN_UNUSED;

/* Releases a solver; NULL is allowed. Ignored inside a callback of the solver's own context. */
PERP_API void perp_contact_solver_destroy(perp_contact_solver *solver);

/* Replaces the settings; problem and workspace stay.
 * Returns: PERP_OK, or a negative status with the old settings still in force. */
PERP_API perp_status perp_contact_solver_set(
    perp_contact_solver *solver, const perp_contact_settings *settings) PERP_WARN_UNUSED;

/* Gives the solver contacts and dynamics: checks every number, factors M, forms W.
 *
 * Returns: PERP_OK; PERP_ERROR_ARGUMENT (sizes, mu < 0, M not symmetric positive definite, unsorted
 *          indices, a contact or bilateral row that moves nothing, ...), _NOT_FINITE, _ABI,
 *          _HANDLE, _BUSY, _MEMORY or _CALLBACK. After failure the solver has the problem it had,
 *          or none, where the fault came to light only at work (a factorisation, W, memory, the
 *          callback); a solve then says so.
 * In:      laws: copied.
 *          dynamics: the views are copied, the arrays of M, H and G are not: they must stay in
 *             place and unchanged until the next setup or destroy.
 * Cost:    where M falls into blocks of up to 12 unknowns, as that of rigid bodies does: linear in
 *          the entries of M and H. Else a factorisation of M, a solve for each row, and W, rows^2
 *          doubles. With the same sizes and patterns it allocates nothing. */
PERP_API perp_status
perp_contact_solver_setup_dynamics(perp_contact_solver *solver, const perp_contact_laws *laws,
                                   const perp_contact_dynamics *dynamics) PERP_WARN_UNUSED;

/* Gives the solver contacts and the Delassus matrix W.
 *
 * Returns: as above, without _CALLBACK.
 * In:      laws: copied.
 *          W: square, rows of the contacts, laws->bounded and laws->bilateral; dense or CSC. It is
 *             used as it is given, slightly unsymmetric or not. The view is copied, its arrays are
 *             not (unless there is compliance): they must stay in place and unchanged as above.
 * Cost:    one pass over W. */
PERP_API perp_status perp_contact_solver_setup_delassus(perp_contact_solver *solver,
                                                        const perp_contact_laws *laws,
                                                        const perp_matrix *W) PERP_WARN_UNUSED;

/* Solves the problem that was set up with dynamics, for one f, w and b.
 *
 * Returns: PERP_OK with the outcome in result->outcome; PERP_ERROR_ARGUMENT, _NOT_FINITE, _ABI,
 *          _HANDLE, _BUSY, _MEMORY or _CALLBACK. After a negative status nothing was written.
 * Out:     answer->v: velocities after the impulses; or NULL. Where the outcome is good and M falls
 *             into blocks of up to 12 unknowns: 0.0 in what the rows that hold keep at rest.
 *          answer->r: impulses of the rows, within their cones and bounds; then the bilateral ones.
 *             The best iterate found, whatever the outcome. 0.0 on every row of a contact that
 *             separates.
 *          answer->u: velocities (with compliance: plus compliance times impulse); or NULL. Where
 *             the outcome is good: u_n is 0.0 of every contact that presses, all of u where it
 *             sticks, rows between their bounds, and the bilateral rows.
 *          answer->modes: PERP_CONTACT_... for each contact and each row with bounds; or NULL.
 *          answer->ray: a direction of impulses, largest entry 1, written only if result->has_ray;
 *             or NULL.
 *          result: initialised by perp_struct_init.
 * In:      f: n entries. w: rows entries. b: bilateral entries; NULL: 0.
 *          r0: as r, a start, projected onto the cones; or NULL.
 * Memory:  none allocated after the first call of a size (third-party factorisations excepted);
 *          under auto a fall-back method makes its memory when it is first needed. */
PERP_API perp_status perp_contact_solver_solve_dynamics(
    perp_contact_solver *solver, const perp_contact_answer *answer, perp_contact_result *result,
    const double *f, const double *w, const double *b, const double *r0) PERP_WARN_UNUSED;

/* Solves the problem that was set up with W, for one q; arguments and statuses as above. There is
 * no v. */
PERP_API perp_status perp_contact_solver_solve_delassus(perp_contact_solver *solver,
                                                        const perp_contact_answer *answer,
                                                        perp_contact_result *result,
                                                        const double *q,
                                                        const double *r0) PERP_WARN_UNUSED;

/* Creates, sets up, solves and destroys in one call; arguments and statuses as above.
 * In:      problem: with `dynamics` or with `W`, one of the two. */
PERP_API perp_status perp_contact_solve(perp_context *context, const perp_contact_answer *answer,
                                        perp_contact_result *result,
                                        const perp_contact_settings *settings,
                                        const perp_contact_problem *problem,
                                        const double *r0) PERP_WARN_UNUSED;

/* ---- a step of a simulator that keeps M and J in an order of its own --------------------------
 */

/* Numbers that stay as long as the same things touch: `bytes` of each of `count` elements, the
 * first one `offset` bytes behind what *at points to and the others `stride` apart; and how they
 * were. */
typedef struct perp_contact_watch {
    const void *const *at;
    const void *seen; /* count times bytes, without gaps */
    int32_t count, offset, stride, bytes;
} perp_contact_watch;

/* Where a simulator has its contacts and the rows of its J, for perp_contact_solver_arrange: rows
 * of equations, of dry friction, of limits, and then each contact's: normal, two tangents, spin,
 * two of rolling, as many as its dimension says. */
typedef struct perp_contact_source {
    size_t struct_size;
    const int32_t *counts; /* 5: contacts, equations, rows of dry friction, of limits, all rows */
    const void *const *contacts; /* *contacts: one every `stride` bytes; in each at so many bytes */
    int32_t stride;
    int32_t geoms_at;    /* int32_t[2]: numbers of what touches, by which contacts are known */
    int32_t row_at;      /* int32_t: its first row, -1: none */
    int32_t dim_at;      /* int32_t: 1, 3, 4 or 6 */
    int32_t friction_at; /* double[5]: of the tangents, spinning, rolling */
    int32_t surface_at; /* double[3]: velocity of the second's surface against the first's along the
                           tangents, and spin: added to u; 0: none move */
    const int32_t *const *kinds; /* *kinds, *ids: what each row of dry friction and limits is of */
    const int32_t *const *ids;
    const double *const *bounds; /* *bounds: of each row: the largest force of its dry friction */
} perp_contact_source;

/* M, H and G are made of numbers of the simulator's, in places that stay as long as the same bodies
 * touch:
 *
 *   M = mass[mass_sources] + h damping on the diagonal,   H = J[H_sources] H_scale,
 *   G = J[G_sources],   f = M velocity + h force,
 *   w = max(gaps[gap_sources], 0) / h in the rows gap_rows,   b = (correction / h)
 * gaps[G_rows].
 *
 * Arrays are the caller's. M, H and G are those that dynamics shows, any storage; a source < 0
 * leaves an entry of M as it is. Other rows of w are the caller's as well. */
typedef struct perp_contact_step {
    size_t struct_size;
    int32_t n, contacts, rows, bilateral; /* velocities; contacts; rows of H; of G */
    int32_t M_entries, H_entries, G_entries, gap_count, J_rows;
    int32_t warm;  /* 1: from `start` */
    int32_t rests; /* in and out: with `start` and the numbers of M, H, G, f, w and b as they are,
                      nothing moves; a step that finds them the same to the last bit is not solved
                      again, and has the same answer. Set it 0 where anything else changes */
    double h;
    double correction;
    const double *mass, *damping;   /* damping: n, or NULL */
    const double *velocity, *force; /* n */
    const double *const *J;         /* *J: entries; it may move from step to step, and so may */
    const double *const *gaps;      /* *gaps: J_rows, of all rows of J; and */
    double *const *row_force; /* out: *row_force: J_rows: r / h, 0 in those of neither H nor G;
                                 NULL: not needed */
    const int32_t *mass_sources, *mass_diagonal; /* M_entries; n: places in M, rising */
    const int32_t *H_sources, *G_sources;        /* H_entries, G_entries */
    const double *H_scale;                       /* H_entries, or NULL: 1 */
    const int32_t *gap_rows, *gap_sources;       /* gap_count */
    const int32_t *H_rows, *G_rows; /* rows, bilateral: where they stand among the rows of J */
    const double *row_scale;        /* rows: what H_scale is there, or NULL: 1 */
    double *M, *H, *G, *f, *w, *b; /* compared with what is gathered: zeros before the first step */
    double *v, *r, *u, *start;     /* as for perp_contact_solver_solve_dynamics; start becomes r */
    int32_t *modes;
    const perp_contact_watch *watches; /* watch_count; or NULL */
    int32_t watch_count;
    int32_t is_other;     /* out: 1: something watched is not what was seen, and nothing was done */
    double *acceleration; /* out: n: (v - velocity) / h */
    double *force_of_rows; /* out: n: (H'r + G's) / h */
    double least_gap;      /* out: 0 where there is none */
    double fastest;        /* out: the largest |v| */
    int32_t slips;         /* out: contacts that slip */
    int32_t was_known;     /* out: 1: it was not solved again */
    int32_t by_rows; /* 1: H, G and J are dense, row by row, and H and G are the rows H_rows and
                        G_rows of J, those of H times row_scale: H_sources, G_sources and H_scale
                        are not looked at */
    int32_t shifts;  /* out: 1: overlaps are taken away by `shift` */
    double slop;     /* of gaps: the overlap that stays */
    double driven;   /* out: the largest |u| of a row of H without impulses */
    double *shift;   /* out: n; NULL: not needed. Where least_gap < -2 slop and that exists: the
                        least velocity, in the metric of M, that takes the share `correction` of
                        what overlaps by more than slop away in a step, while rows without
                        overlap do not get one and G shift = 0; where overlaps contradict each
                        other, one between what they need; and shortened as `reach` says; else as
                        it was */
    const perp_contact_source *source; /* perp_contact_solver_arrange goes by it, and is_other tells
                                          whether it is to be called; NULL: `watches` do */
    const int32_t *first;              /* contacts: their first rows; NULL: not known */
    double restitution; /* of contacts whose gap is closed: u >= -restitution times what it was */
    const double *const *speeds; /* *speeds: J_rows: J velocity; read where restitution > 0 */
    const double *reach; /* n: how far `shift` moves each coordinate in a step at most, INFINITY:
                            any way; NULL: all any way. Rows are those of a place: what turns by
                            much more than correction / 1 rad goes where they say nothing */
    double *shares; /* out: n, or NULL: what `shift` is of the velocity without `reach`, 0 to 1: one
                       number for what M, H and G couple */
} perp_contact_step;

/* Arranges the rows that step.source has now: those that move anything, of tangents in dimension 3.
 * What lasts keeps its impulse in step.start; others begin at 0. J is dense, row by row.
 *
 * Returns: PERP_OK, _ARGUMENT for an array that is missing or a place that cannot be, _MEMORY,
 * _ABI, _HANDLE or _BUSY; then step, laws and dynamics are as they were. Out:     step: counts,
 * H_rows, G_rows, gaps, first, row_scale, modes, H, G, w, b, r, u, start, by_rows. laws: all of
 * contacts and bounds. dynamics: H and G. The arrays are the solver's, until the call after next.
 */
PERP_API perp_status perp_contact_solver_arrange(perp_contact_solver *solver,
                                                 perp_contact_step *step, perp_contact_laws *laws,
                                                 perp_contact_dynamics *dynamics) PERP_WARN_UNUSED;

/* Gathers the numbers, sets the solver up and solves, and hands back what came of it; but where
 * something watched has changed says so and does no more.
 *
 * Returns: as perp_contact_solver_setup_dynamics and _solve_dynamics, and _ARGUMENT for an array
 *          that is missing, a place that cannot be, a size that is not that of laws and dynamics,
 *          or a mass that is a callback. After a refusal the arrays of the answer are as they were;
 *          numbers may have been gathered, and then nothing rests.
 * Out:     step: see there. result: of the last solve.
 * In:      laws, dynamics: as for the setup; the arrays of M, H and G are those of `step`. */
PERP_API perp_status perp_contact_solver_step(
    perp_contact_solver *solver, perp_contact_step *step, perp_contact_result *result,
    const perp_contact_laws *laws, const perp_contact_dynamics *dynamics) PERP_WARN_UNUSED;

/* Hands back again, where the caller has put another v, r and modes into the step's arrays. Returns
 * PERP_OK, _ARGUMENT, _NOT_FINITE, _ABI, _HANDLE or _BUSY. */
PERP_API perp_status perp_contact_solver_hand_back(perp_contact_solver *solver,
                                                   perp_contact_step *step) PERP_WARN_UNUSED;

/* Functions of the simulator's: a stage of its step; acceleration := M^-1 force, of `count` forces;
 * and place := place moved by velocity for h. */
typedef void (*perp_contact_stage)(const void *model, void *data);
typedef void (*perp_contact_invert)(const void *model, void *data, double *acceleration,
                                    const double *force, int32_t count);
typedef void (*perp_contact_integrate)(const void *model, double *place, const double *velocity,
                                       double h);

/* to := source, `count` numbers; in step k of a run one of them is `stride` k numbers further on:
 * `source` of inputs, `to` of outputs. */
typedef struct perp_contact_copy {
    double *to, *source;
    int32_t count, stride;
} perp_contact_copy;

enum perp_contact_wait {
    PERP_CONTACT_WAIT_DONE = 0,  /* nothing is left to do */
    PERP_CONTACT_WAIT_OTHER = 1, /* step.is_other, without step.source: rows are to be arranged */
    PERP_CONTACT_WAIT_LOOK = 2 /* solved, not yet advanced: slow slips, or something nearly rests */
};

enum perp_contact_phase {
    PERP_CONTACT_PHASE_BEGIN = 0, /* of a step */
    PERP_CONTACT_PHASE_SOLVE = 1, /* `before` is done */
    PERP_CONTACT_PHASE_MOVE = 2   /* solved */
};

/* Steps one after the other, without the caller. Each is: inputs are copied; `before`, up to mass,
 * J, gaps and force; where there is `metric`, that, and then source := to of what `kept` copied
 * before it, and metric_mass = metric_M - h metric_D[metric_places]; perp_contact_solver_step;
 * `after`, meanwhile, where there is `invert`, with the step's acceleration as M alone has it,
 * without what is implicit, unless that is 0; `advance` or else *time += h, with place as it was
 * before it; velocity := v; integrate with v, and `shift` where that is; outputs are copied. Where
 * a step is known and nothing of it moves but time, place and velocity stay. Where `again` is and J
 * has no rows, the step is one of Runge and Kutta's classical scheme: `before` is its first stage,
 * and `again` are the others, from place and velocity to `drive`, the acceleration; no row takes
 * part in these. Arrays are the caller's. */
typedef struct perp_contact_run {
    size_t struct_size;
    const void *model;
    void *data;
    const perp_contact_stage *before, *after, *advance;
    int32_t before_count, after_count, advance_count;
    int32_t places;            /* of place */
    perp_contact_stage metric; /* or NULL */
    const double *metric_M, *metric_D;
    double *metric_mass;
    const int32_t *metric_places;
    int32_t metric_count, kept_count;
    const perp_contact_copy *kept;
    double *place, *velocity, *time;
    double *room; /* places and 2 n velocities: work */
    perp_contact_integrate integrate;
    const perp_contact_copy *inputs, *outputs;
    int32_t input_count, output_count;
    int32_t steps;    /* to be made */
    int32_t done;     /* in and out */
    int32_t phase;    /* in and out: PERP_CONTACT_PHASE_... of the next step */
    int32_t wait;     /* out: PERP_CONTACT_WAIT_... */
    int32_t patience; /* in and out: steps with slips before slow ones are looked at again */
    double look_slip; /* slips slower than this times step.driven are slow, where step.first is */
    double look_rest; /* faster than 0 and slower than this times h |drive| is nearly at rest */
    const double *drive;        /* n; or NULL: rest is not looked at, and `again` is not */
    int64_t unsolved;           /* in and out: steps without a good outcome */
    double residual;            /* in and out: the largest */
    perp_contact_invert invert; /* or NULL */
    const perp_contact_stage *again;
    int32_t again_count, reserved; /* reserved: 0 */
} perp_contact_run;

/* Makes steps until `steps` are done or the caller is needed. step.warm becomes whether the
 * last one is good, and stays where that is to be looked at.
 *
 * Returns: as perp_contact_solver_step, of the step that refuses, in its phase SOLVE; _ARGUMENT for
 *          an array that is missing or a count below 0.
 * Out:     laws, dynamics: as by perp_contact_solver_arrange, where step.source is. */
PERP_API perp_status perp_contact_solver_run(perp_contact_solver *solver, perp_contact_run *run,
                                             perp_contact_step *step, perp_contact_result *result,
                                             perp_contact_laws *laws,
                                             perp_contact_dynamics *dynamics) PERP_WARN_UNUSED;

/* ---- derivatives of a solution -------------------------------------------------------------- */

typedef struct perp_contact_sensitivity perp_contact_sensitivity;

typedef struct perp_contact_sensitivity_info {
    size_t struct_size;
    int32_t verdict;  /* PERP_VERDICT_REGULAR: differentiable; _DEGENERATE: on the edge between two
                         modes, _SINGULAR: impulses are not determined; _NOT_A_SOLUTION: by the
                         front door's own test */
    int32_t index;    /* degenerate: the contact that decided, or contacts + the row with bounds;
                         else -1 */
    int32_t active;   /* rows whose impulses move */
    int32_t reserved; /* 0 */
    double margin; /* how far the nearest contact is from another mode, in the units of the tested
                      residual; degenerate if it is at most settings.tol */
    double condition; /* estimate of cond_1 of the scaled equations; 1 if there are none */
} perp_contact_sensitivity_info;

/* Reads the modes of a solution and factors the equations of its active set.
 *
 * Where modes are strict v and r are smooth functions of the data near them (a contact that holds
 * both ways is not strict at r_N = 0, and r_n stands for |r_N|):
 *
 *   M dv = df - dM v + H'dr + dH'r,    du = H dv + dH v + dw,
 *   du = 0 in rows that hold,    dr_t = -d(mu r_n u_t / |u_t|) where it slips,    else dr = 0,
 *
 * and the rows of G as those of H. Dissipation is not linear: where a contact slips the direction
 * of its impulse turns with that of u_t. Redundant contacts are singular: give fewer. At a
 * degenerate solution the products are those of the modes read, one of several pieces that meet
 * there.
 *
 * Returns: PERP_OK, PERP_ERROR_ARGUMENT, _NOT_FINITE, _ABI, _HANDLE, _BUSY, _MEMORY or _CALLBACK.
 * Out:     sensitivity: the new handle, whatever the verdict; untouched after failure.
 *          info: initialised by perp_struct_init.
 * In:      settings: tol is used; NULL for the defaults.
 *          problem: as for perp_contact_solve, with dynamics. The arrays of M, H and G must stay
 *              in place and unchanged until the handle is destroyed; the rest is copied.
 *          r: rows, then bilateral impulses: a solution as perp_contact_solve returns it.
 * Cost:    a solve with M for each active row, and a dense factorisation of that many. The
 *          products cost three solves with M each and allocate nothing.
 * Source:  the implicit function theorem on the equations of an active set; Le Lidec et al.,
 *          "Differentiable simulation for physical system identification", IEEE RA-L 6 (2021).
 */
PERP_API perp_status perp_contact_sensitivity_create(perp_context *context,
                                                     perp_contact_sensitivity **sensitivity,
                                                     perp_contact_sensitivity_info *info,
                                                     const perp_contact_settings *settings,
                                                     const perp_contact_problem *problem,
                                                     const double *r) PERP_WARN_UNUSED;

/* NULL is allowed. Ignored inside a callback of its own context. */
PERP_API void perp_contact_sensitivity_destroy(perp_contact_sensitivity *sensitivity);

/* Writes the point that is differentiated: n velocities, impulses and velocities of all rows, and
 * modes, as perp_contact_solver_solve_dynamics does; NULL: not needed. */
PERP_API perp_status perp_contact_sensitivity_point(perp_contact_sensitivity *sensitivity,
                                                    double *v, double *r, double *u,
                                                    int32_t *modes) PERP_WARN_UNUSED;

/* A direction of the data; NULL stands for 0. */
typedef struct perp_contact_change {
    size_t struct_size;
    const double *df;                /* n */
    const double *dw;                /* rows */
    const double *db;                /* bilateral rows */
    const double *dmu;               /* contacts */
    const perp_matrix *dM, *dH, *dG; /* of the sizes of M, H and G, any storage */
} perp_contact_change;

/* dv, dr := the derivatives of v and r in the direction `change`.
 *
 * Returns: PERP_OK; PERP_ERROR_ARGUMENT where the verdict was 'singular' or 'not a solution';
 *          _NOT_FINITE (also if dv or dr are not), _ABI, _HANDLE, _BUSY or _CALLBACK. After failure
 *          both are untouched.
 * Out:     dv: n; dr: rows, then bilateral; NULL: not needed.
 * In:      change: NULL is no change. */
PERP_API perp_status
perp_contact_sensitivity_forward(perp_contact_sensitivity *sensitivity, double *dv, double *dr,
                                 const perp_contact_change *change) PERP_WARN_UNUSED;

/* The gradients of a function of v and r with respect to f, w, b and mu, from those with respect to
 * v and r: x, y, z and mu, one solve for all data. That with respect to M_ij is -x_i v_j, to H_ij
 * r_i x_j + y_i v_j, and to G_ij s_i x_j + z_i v_j.
 *
 * Returns: as perp_contact_sensitivity_forward.
 * Out:     x: n, d/df; y: rows, d/dw; z: bilateral, d/db; mu: contacts; NULL: not needed.
 * In:      gv: n; gr: rows, then bilateral; NULL stands for 0. */
PERP_API perp_status perp_contact_sensitivity_adjoint(perp_contact_sensitivity *sensitivity,
                                                      double *x, double *y, double *z, double *mu,
                                                      const double *gv,
                                                      const double *gr) PERP_WARN_UNUSED;

#ifdef __cplusplus
}
#endif

#endif
