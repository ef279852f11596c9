/* perp/mechanism.h: mechanisms in generalised coordinates, with contacts and friction; the header
 * of libperp-mechanism (link with -lperp-mechanism -lperp).
 *
 *   M(q) dv - k(t,q,v) dt = H'dr + G'ds + B'dy,     q' = N(q) v
 *
 * q: coordinates, v: velocities, k: forces with the gyroscopic ones. The mechanism is given by
 * callbacks for M, k, and the rows of three kinds of constraints:
 *
 * - contacts: gap_j(t,q) >= 0. The rows of contact j in H are the gradient of its gap (the normal),
 *   then its tangents (none in dimension 1, one in 2, two in 3), contact after contact, as in
 *   perp/contact.h. u = H v + drift: separating, then sliding velocity. Impulses r: 0 <= r_n perp
 *   gap >= 0, and |r_t| <= mu r_n, opposite to u_t where that is not 0. One that holds both ways
 *   (model.two_sided: a guide, a pin, a ball joint, the flank of a screw) has one to three normals
 *   with r_N of any sign, u_N = 0 instead, and |r_t| <= mu |r_N|: P. Dupont, "Existence and
 *   uniqueness of rigid-body dynamics with Coulomb friction", Trans. CSME 17 (1993).
 * - bilateral: c_i(t,q) = 0, G its gradients.
 * - dry: friction of a given bound (Tresca), groups of one row or of two in B, slip u = B v +
 * drift, |y| <= bound(t,q,v) h, opposite to u where that is not 0.
 *
 * Four questions can be asked: a step in time, a run of steps, all accelerations of a state, and
 * all answers of a step. Impulses, not forces, are a step's unknowns: a step exists also where no
 * acceleration does.
 *
 * A step's answer is one solution of its complementarity problem. There may be others (a wedge,
 * redundant contacts): perp_mechanism_answers tells all of them, settings.select which to take.
 *
 * Sources: D. E. Stewart & J. C. Trinkle, "Dynamics, friction, and complementarity problems" (1995)
 * and IJNME 39 (1996); M. Anitescu & F. A. Potra, Nonlinear Dynamics 14 (1997); J. J. Moreau,
 * "Unilateral contact and dry friction in finite freedom dynamics" (1988). */
#ifndef PERP_MECHANISM_H
#define PERP_MECHANISM_H

#include <perp/base.h>
#include <perp/bristle.h> /* these two: the rest of libperp-mechanism */
#include <perp/friction.h>

#ifdef __cplusplus
extern "C" {
#endif

/* How a step discretises the equations. Values never change. */
enum perp_mechanism_scheme_value {
    PERP_MECHANISM_FROZEN = 0,   /* M, k, H at the step's start; gaps linearised (Stewart-Trinkle
                                    1996): one complementarity problem */
    PERP_MECHANISM_IMPLICIT = 1, /* M, k, H and gaps at the step's end (Stewart & Trinkle 1995): a
                                    nonlinear complementarity problem, with frozen as the start */
    PERP_MECHANISM_THETA = 2 /* Moreau-Jean: k weighted between both ends, theta at the end's; M, H
                                in the middle for theta = 1/2, which is of order 2 without events;
                                an iteration for k */
};

/* What an impact gives back. e is the contact's restitution. Values never change. */
enum perp_mechanism_law_value {
    PERP_MECHANISM_MOREAU = 0, /* 0 <= r_n perp u_n+ + e u_n- >= 0 */
    PERP_MECHANISM_NEWTON = 1, /* the same with max(-u_n-, 0): u_n+ >= e max(-u_n-, 0) */
    PERP_MECHANISM_POISSON =
        2, /* the impulse of expansion is at least e times that of compression */
    PERP_MECHANISM_STRONGE =
        3 /* the normal work of expansion is e^2 of what compression takes, with
             friction against the slip of each instant; no impact adds energy */
};

/* What a contact or a dry group does. Values never change; those of enum perp_contact_mode_value.
 */
enum perp_mechanism_mode_value {
    PERP_MECHANISM_SEPARATE = 0,
    PERP_MECHANISM_STICK = 1,
    PERP_MECHANISM_SLIP = 2
};

/* Which velocities a step takes where its problem has several. "Nearest" and "freest" are looked
 * for among the stable ones of perp_mechanism_answers, if there are any. Values never change. */
enum perp_mechanism_select_value {
    PERP_MECHANISM_ANY = 0,     /* those that the solver finds: nothing is known of others */
    PERP_MECHANISM_NEAREST = 1, /* the least change of velocity, |v+ - v| in the metric of M: what
                                   moves goes on moving, what rests stays at rest */
    PERP_MECHANISM_FREEST = 2   /* the least impulses, |v+ - v - h M^-1 k| in that metric */
};

/* Callbacks return 0 when done; a positive number where q is outside of what the mechanism is
 * defined for (a step then says 'evaluation_failed', or is shortened); a negative one to abort the
 * call with PERP_ERROR_CALLBACK. Numbers that are not finite are an error too. They must not call
 * into the same context, and give the same answer to the same question. All matrices are written
 * row by row without gaps, n = velocities wide; everything is 0 before the call unless said. */

/* M: n by n, symmetric positive definite. */
typedef int32_t (*perp_mechanism_mass)(double *M, const double *q, void *user);
/* k: n forces: applied, gravity, -C(q,v)v. */
typedef int32_t (*perp_mechanism_force)(double *k, double t, const double *q, const double *v,
                                        void *user);
/* gap: contacts; > 0 separated; one that holds both ways has a number for each of its normals, 0
 * where it is met. H, drift: rows as above; drift is u at v = 0 (moving walls, belts; for a normal
 * the partial derivative of the gap by t). mu: contacts; holds the model's. */
typedef int32_t (*perp_mechanism_contacts)(double *gap, double *H, double *drift, double *mu,
                                           double t, const double *q, void *user);
/* c: bilateral; G: bilateral by n; drift: partial derivative of c by t. */
typedef int32_t (*perp_mechanism_bilateral)(double *c, double *G, double *drift, double t,
                                            const double *q, void *user);
/* bound: dry; >= 0, a force. B: dry * dry_dim by n. drift: dry * dry_dim. */
typedef int32_t (*perp_mechanism_dry)(double *bound, double *B, double *drift, double t,
                                      const double *q, const double *v, void *user);
/* rate := N(q) v, `coordinates` entries. */
typedef int32_t (*perp_mechanism_kinematics)(double *rate, const double *q, const double *v,
                                             void *user);
/* Puts q back where it belongs (unit quaternions) after a step has moved it. */
typedef int32_t (*perp_mechanism_normalise)(double *q, void *user);
/* bias := d/dt(H) v + d/dt(drift), rows of H, then those of G and of B: what the rows'
 * accelerations are at v' = 0. */
typedef int32_t (*perp_mechanism_curvature)(double *bias, double t, const double *q,
                                            const double *v, void *user);

typedef struct perp_mechanism_model {
    size_t struct_size;
    int32_t velocities;         /* n; at least 1 */
    int32_t coordinates;        /* of q; 0 (default): n; another number needs `kinematics` */
    int32_t contacts;           /* default 0 */
    int32_t dim;                /* of every contact where dims is NULL: 1, 2 (default) or 3 */
    const int32_t *dims;        /* contacts: 1 (frictionless), 2 or 3; two-sided ones: all their
                                   rows, 2 to 5; or NULL */
    int32_t bilateral;          /* rows of G; default 0 */
    int32_t dry;                /* groups of dry friction; default 0 */
    int32_t dry_dim;            /* rows of each: 1 (default), or 2: a disc */
    int32_t reserved;           /* 0 */
    const double *mu;           /* contacts, >= 0: of sliding, 0 without tangents; NULL: 0 */
    const double *mu_static;    /* contacts, >= mu: what holds where the contact did not slide; what
                                   leaves that slips with mu; NULL: mu */
    const double *stribeck;     /* contacts, a speed > 0: mu + (mu_static - mu) exp(-(|u_t|/s)^2);
                                   NULL, or 0 at a contact: mu_static only where it did not slide */
    const double *restitution;  /* contacts, in [0, 1]; NULL: 0 */
    perp_mechanism_mass mass;   /* NULL: the identity */
    perp_mechanism_force force; /* NULL: 0 */
    perp_mechanism_contacts contact_rows;    /* needed where contacts > 0 */
    perp_mechanism_bilateral bilateral_rows; /* needed where bilateral > 0 */
    perp_mechanism_dry dry_rows;             /* needed where dry > 0 */
    perp_mechanism_kinematics kinematics;    /* NULL: q' = v */
    perp_mechanism_normalise normalise;      /* NULL: nothing to do */
    perp_mechanism_curvature curvature;      /* NULL: by differences; accelerations only */
    void *user;                              /* handed to all of them */
    const int32_t *two_sided; /* contacts: 0: ordinary; 1, 2 or 3: so many normals that hold both
                                 ways, then 1 or 2 tangents: 1 a guide or a flank, 2 a pin in the
                                 plane or an axle, 3 a ball joint; the tangent row of a pin is its
                                 radius times the relative turning. No restitution. NULL: none */
} perp_mechanism_model;

typedef struct perp_mechanism_settings {
    size_t struct_size;
    int32_t scheme;        /* PERP_MECHANISM_FROZEN (default), ... */
    int32_t law;           /* PERP_MECHANISM_MOREAU (default), ... */
    int32_t cone;          /* 0 (default): exact; k >= 3: a polyhedron of k edges, perp/contact.h */
    int32_t project;       /* 1 (default): removes penetration and drift of c after the step */
    double theta;          /* of PERP_MECHANISM_THETA; in [0, 1]; default 0.5 */
    double tol;            /* tested residual of a step's problem that counts; default 1e-10; > 0 */
    double error;          /* of perp_mechanism_run: 0 (default): steps of equal length; > 0: steps
                              chosen so that a step's estimated error is below this: in q and h v,
                              beside the largest q so far (or h v with the first h; at least 1e-3 of
                              the largest of all), and in v but where it jumps, beside the largest
                              so far in the norm of M. Forces that a contact or friction takes up
                              count where it holds */
    double shortest;       /* step of such a run; 0 (default): 2^-40 of its span */
    double longest;        /* 0 (default): its span */
    double time_limit;     /* seconds of a call, with all that it solves; 0 (default): none. What is
                              under way then ends: a step with its last iterate and the outcome
                              time_limit, a run where it is, answers with those found so far */
    int64_t most_patterns; /* more combinations of modes are not enumerated by
                              perp_mechanism_accelerations, _answers; default 2^22; >= 1 */
    int32_t directions; /* in 3 dimensions, of slips that start, with two or more of them at once:
                           tried at first (every second of them with three or four, every fourth
                           with more), then made exact; default 16; >= 3. One alone is found by
                           the zeros of a polynomial. At most 1024 */
    int32_t starts;     /* patterns that the search beyond most_patterns begins with; default 16 */
    double stiffness;   /* of compliant contacts, for the label 'stable'; > 0; default 1 */
    double damping;     /* >= 0; default 2 */
    int32_t select;     /* PERP_MECHANISM_ANY (default), ...; NEAREST and FREEST enumerate in
                           every frozen step, and so in those that implicit steps start from;
                           not for THETA */
    int32_t reserved;   /* 0 */
    double overlap;     /* penetration and |c| that a run may have at the end of a step, in the
                           model's units: with more its outcome is stalled, though it goes on; 0
                           (default): with `project` 1e-3, or `error` if that is more, of the largest
                           sum |J_i| times the largest |q| so far, or what there was at the start;
                           without it any */
} perp_mechanism_settings;

/* One step. */
typedef struct perp_mechanism_step {
    size_t struct_size;
    int32_t outcome;     /* PERP_OUTCOME_...; the state moved unless it is ray, evaluation_failed or
                            singular */
    int32_t scheme;      /* that gave the answer: FROZEN where no implicit answer was met */
    int32_t closed;      /* contacts with an impulse */
    int32_t sticking;    /* of those and of the dry groups */
    int32_t impacts;     /* contacts with restitution > 0 that were hit */
    int32_t certificate; /* of a ray: PERP_CONTACT_CERTIFICATE_... */
    int32_t has_ray;     /* 1: a verified ray was found (and written, if asked for) */
    int32_t method;      /* of the last contact problem, PERP_CONTACT_METHOD_... */
    double residual;     /* tested residual, the largest of the problems that the outcome is of: of
                            both stages of an impact, of all iterates for k what is left at the end */
    double penetration;  /* max(-gap, 0), the largest, at the end */
    double drift;        /* the largest |c|, at the end */
    double error;        /* estimate (perp_mechanism_run with settings.error > 0); else nan */
    double seconds;      /* wall time of the step */
    int64_t iterations;  /* of all problems and attempts of the step, projection's included */
    int64_t evaluations; /* of the contact rows, or of the force if there are none */
    int32_t answers;     /* with settings.select: velocities that the step's problem has, families
                            included; 0: not looked for */
    int32_t exhaustive;  /* 1: there are no others */
} perp_mechanism_step;

/* Where a step or a run begins: the caller's arrays. */
typedef struct perp_mechanism_start {
    size_t struct_size;
    double t;
    double h;        /* > 0: the length of a step; in chosen steps, of the first */
    const double *q; /* coordinates */
    const double *v; /* n */
} perp_mechanism_start;

/* What an observer sees. The arrays are the library's, valid during the call. */
typedef struct perp_mechanism_view {
    size_t struct_size;
    double t, h;            /* the end of the step, and its length; h = 0 at the start of a run, and
                               behind an impact of a run in chosen steps, which ends a step at it */
    const double *q;        /* coordinates */
    const double *v;        /* n */
    const double *impulse;  /* rows of H, of G, of B */
    const double *velocity; /* the same: u */
    const int32_t *modes;   /* contacts, then dry groups: PERP_MECHANISM_... */
    const perp_mechanism_step *step;
} perp_mechanism_view;

/* Called at the start and after every step. Returns 0 to go on, a positive number to stop (outcome
 * 'stopped'), a negative one to abort with PERP_ERROR_CALLBACK. */
typedef int32_t (*perp_mechanism_observer)(const perp_mechanism_view *view, void *user);

typedef struct perp_mechanism_run_result {
    size_t struct_size;
    int32_t outcome;    /* that of the step that ended the run; stopped; time_limit; stalled where
                           steps became shorter than the shortest; else that of the first step
                           that was not solved, stalled for one that ends with more than
                           settings.overlap; solved */
    int32_t fallbacks;  /* steps of the implicit scheme that frozen answered */
    double t;           /* reached: q and v are those there */
    double error;       /* sum of the steps' estimates; nan with equal steps */
    double residual;    /* the largest of all steps */
    double penetration; /* the same */
    double drift;       /* the same */
    double seconds;     /* wall time of the call */
    int64_t steps;
    int64_t rejected;   /* steps that were tried again shorter */
    int64_t iterations; /* of all steps, rejected ones included */
    int64_t evaluations;
} perp_mechanism_run_result;

/* Why a state has the number of accelerations it has: what the contacts are, whatever the loads.
 * Every pattern of modes is a linear system; its determinant is a principal minor of the contact
 * matrix. In 3 dimensions slips that start are those of settings.directions. Values never change.
 */
enum perp_mechanism_reason_value {
    PERP_MECHANISM_ALWAYS_ONE = 0,       /* one acceleration for any load: every principal minor is
                                            positive */
    PERP_MECHANISM_NEGATIVE_INERTIA = 1, /* a single contact that slides, or may, pulls itself in:
                                            n'M^-1 (n - mu d) < 0 */
    PERP_MECHANISM_ZERO_INERTIA = 2,     /* the same = 0 */
    PERP_MECHANISM_COUPLED = 3,          /* several contacts together: a principal minor < 0 */
    PERP_MECHANISM_REDUNDANT = 4,        /* contacts that share a load: a principal minor = 0 */
    PERP_MECHANISM_UNDECIDED = 5,      /* too many contacts to look at every minor; or an impact */
    PERP_MECHANISM_STATIC_FRICTION = 6 /* a contact at rest has mu_static > mu: it may stick or
                                          start to slip under the same load */
};

/* One acceleration with its forces. The arrays are the handle's, valid until its next call. */
typedef struct perp_mechanism_found {
    size_t struct_size;
    int32_t stable;       /* 1: compliant contacts settle on it (docs/mechanism.md) */
    int32_t flutter;      /* 1: unstable though no eigenvalue of it says so without damping */
    int32_t at_vertex;    /* 1: within rounding of a change of modes */
    int32_t dimension;    /* 0; of a family of forces or accelerations, at least 1 */
    int32_t free;         /* dimension of the accelerations in that family; 0: forces alone */
    int32_t vertex_count; /* of the family, at least 1 */
    int32_t ray_count;
    int32_t reserved;
    double residual;                /* largest violation of the laws, relative */
    const double *acceleration;     /* n: v' */
    const double *force;            /* rows of H, of G, of B */
    const double *row_acceleration; /* the same: u' */
    const int32_t *modes;           /* contacts, then dry groups */
    const double *eigenvalues; /* of the compliant contacts: eigenvalue_count (real, imaginary) */
    int32_t eigenvalue_count;
    int32_t reserved_too;   /* 0 */
    const double *vertices; /* vertex_count times rows of force */
    const double *rays;     /* ray_count times rows of force */
} perp_mechanism_found;

typedef struct perp_mechanism_summary {
    size_t struct_size;
    int32_t count; /* answers, families included */
    int32_t families;
    int32_t stable;     /* stable ones among them */
    int32_t exhaustive; /* 1: there are no others (in 3 dimensions: none with several slips that
                           start but those found from settings.directions) */
    int32_t closed;     /* contacts that take part: gap and u_n are 0 */
    int32_t impact;     /* 1: a closed contact approaches: an impact comes before any acceleration;
                           count is 0, nothing was looked at */
    int32_t reason;     /* PERP_MECHANISM_ALWAYS_ONE, ... */
    int32_t contact;    /* that the reason names first, or that approaches; else -1 */
    double inertia;     /* the smallest of n'M^-1 (n - mu d) / n'M^-1 n of a contact that slides
                           along d (at rest: the worst direction), with M^-1 of what the bilateral
                           rows leave free: the effective inverse inertia; +inf: no friction */
    int64_t patterns;   /* combinations of modes looked at */
} perp_mechanism_summary;

/* What a wrong entry is one of. Values never change. */
enum perp_mechanism_part_value {
    PERP_MECHANISM_NORMAL = 0,   /* H: a normal has to be its gap's gradient */
    PERP_MECHANISM_GRADIENT = 1, /* G: of c */
    PERP_MECHANISM_DRIFT = 2,    /* of a normal or of c: the partial derivative by t */
    PERP_MECHANISM_TANGENT = 3   /* H: a multiple of its contact's normal */
};

/* How a model's rows compare with differences of its gaps and constraints. Numbers from 0. */
typedef struct perp_mechanism_check_result {
    size_t struct_size;
    int32_t wrong;    /* entries that differ by more than differences can be wrong, and tangents
                         that are multiples of their normals */
    int32_t constant; /* normals and rows of G, not 0, whose gap or c never changes: not compared */
    int32_t unchecked; /* velocities (and the time) next to whose side nothing is defined */
    int32_t part;      /* of the worst wrong entry: PERP_MECHANISM_NORMAL, ...; -1: none is wrong */
    int32_t index;     /* its contact, or its bilateral row; else -1 */
    int32_t row;       /* its row, of H, G, B; else -1 */
    int32_t column;    /* its velocity; -1 for a drift or a tangent */
    int32_t reserved;  /* 0 */
    double given;      /* what the callback said (of a tangent: nan), */
    double difference; /* the value by differences, */
    double uncertainty; /* and the estimated error of that */
} perp_mechanism_check_result;

typedef struct perp_mechanism perp_mechanism;

/* Set every field to its default. Return PERP_OK, or PERP_ERROR_ABI for NULL or an unknown size. */
PERP_API perp_status perp_mechanism_model_init(perp_mechanism_model *model, size_t size);
PERP_API perp_status perp_mechanism_settings_init(perp_mechanism_settings *settings, size_t size);

/* Return "frozen", ...; "moreau", ...; "any", ...; a sentence. Static; "unknown ..." otherwise.
 * Modes: see perp_contact_mode_text. */
PERP_API const char *perp_mechanism_scheme_text(int32_t scheme);
PERP_API const char *perp_mechanism_law_text(int32_t law);
PERP_API const char *perp_mechanism_select_text(int32_t select);
PERP_API const char *perp_mechanism_reason_text(int32_t reason);

/* Takes a mechanism. No callback is called.
 *
 * Returns: PERP_OK; PERP_ERROR_ARGUMENT (no velocities, mu < 0, mu_static < mu, restitution outside
 *          [0, 1], a callback that is missing, ...), _NOT_FINITE, _ABI, _HANDLE, _BUSY, _MEMORY.
 * Out:     mechanism: the handle; untouched after failure.
 * In:      settings: copied; NULL for the defaults. model: copied with its arrays. */
PERP_API perp_status perp_mechanism_create(perp_context *context, perp_mechanism **mechanism,
                                           const perp_mechanism_settings *settings,
                                           const perp_mechanism_model *model) PERP_WARN_UNUSED;

/* Releases the handle; NULL is accepted. Ignored inside a callback of its own context. */
PERP_API void perp_mechanism_destroy(perp_mechanism *mechanism);

/* Replaces the settings. After failure the old ones are still in force. */
PERP_API perp_status perp_mechanism_set(perp_mechanism *mechanism,
                                        const perp_mechanism_settings *settings) PERP_WARN_UNUSED;

/* Compares normals, G and their drifts with central differences of gap and c along each velocity
 * (q' = N v) and the time, extrapolated from two steps (Richardson), which tell their own error: an
 * entry is wrong if it is further from the difference than 8 times that and 1e-5 of its row's
 * largest. At a kink nothing is wrong. A tangent is no gradient, but wrong where it is a multiple
 * of a normal of its contact, and both move several velocities, or where it is that normal itself.
 *
 * Returns: PERP_OK with the verdict in result; PERP_ERROR_ARGUMENT (also: q is outside of what the
 *          mechanism is defined for), _NOT_FINITE, _ABI, _HANDLE, _BUSY, _MEMORY or _CALLBACK, and
 *          then nothing was written.
 * Out:     result: initialised by perp_struct_init.
 * In:      q: coordinates. v: n, for the bounds of dry friction. A state without special values
 *          (0, right angles) shows more.
 * Cost:    4 (n + 1) to 12 (n + 1) calls of the rows' callbacks. */
PERP_API perp_status perp_mechanism_check(perp_mechanism *mechanism,
                                          perp_mechanism_check_result *result, double t,
                                          const double *q, const double *v) PERP_WARN_UNUSED;

/* Steps from `start` (t, q0, v0) to t + h.
 *
 * solved: the laws' tested residuals are at most settings.tol, v and the impulses belong together,
 * M (v - v0) = h k + J'r up to max(16 tol, 1e-8) of its terms, and all numbers are finite.
 * rounding_limit: tol is below what rounding of q makes of gap / h. The outcome of a whole is that
 * of its worst part.
 *
 * Gaps below 0, and those that are rounding of q, count as 0; overlaps are opened afterwards by the
 * smallest displacement in the metric of M, to first order; theta closes those of contacts that
 * press at the end, too. Restitution: docs/mechanism.md. Where rows that hold (closed normals,
 * sticking tangents, bilateral ones) determine a velocity it carries no rounding: at rest it is
 * 0.0.
 *
 * Where the step's outcome is ray, evaluation_failed or singular, q and v are q0 and v0, impulses
 * are 0.
 *
 * Returns: PERP_OK with the outcome in step->outcome; PERP_ERROR_ARGUMENT (h <= 0, M not symmetric
 *          positive definite, a bound or mu < 0, ...), _NOT_FINITE (also where finite numbers
 *          overflow together), _ABI, _HANDLE, _BUSY, _MEMORY or _CALLBACK, and then nothing was
 *          written.
 * Out:     q, v: may be those of the start.
 *          impulse, velocity: rows of H, of G, of B: r, s, y and u at the end, of both stages of an
 *             impact together; or NULL.
 *          modes: contacts, then dry groups; or NULL.
 *          ray: rows as impulse: impulses that no motion can answer, written only if step->has_ray;
 *             or NULL.
 *          step: initialised by perp_struct_init.
 * Memory:  none allocated after the first call in which as many contacts take part (third-party
 *          factorisations excepted; a method that auto falls back on makes its memory when it is
 *          first needed).
 * Cost:    frozen: one call of each callback, of the rows a second one at the step's end (a run
 *          keeps them for the next step), a Cholesky factorisation of M, one contact problem.
 *          implicit: that, then a call of each callback and a contact problem an iterate, mostly
 *          one to four of them (none where nothing changes in the step), and n calls more where
 *          they come near slowly.
 *          theta: k at least three times, the rows twice, a contact problem for each iterate (one
 *          where k does not depend on q and v, one more where a slip in space, or with Stribeck's
 *          coefficient, lasts). Where the iteration does not converge the outcome is
 *          iteration_limit. */
PERP_API perp_status perp_mechanism_advance(perp_mechanism *mechanism, double *q, double *v,
                                            double *impulse, double *velocity, int32_t *modes,
                                            double *ray, perp_mechanism_step *step,
                                            const perp_mechanism_start *start) PERP_WARN_UNUSED;

/* Steps from the start's t0 to t1: in ceil((t1 - t0) / h) steps of equal length up to rounding, or,
 * with settings.error > 0, in steps chosen by their estimated error (step doubling), the first of
 * h.
 *
 * Returns: as perp_mechanism_advance; t1 <= t0 is refused.
 * Out:     q, v: at result->t; may be those of the start.
 *          result: initialised by perp_struct_init.
 * In:      observer: NULL for none. */
PERP_API perp_status perp_mechanism_run(perp_mechanism *mechanism, double *q, double *v,
                                        perp_mechanism_run_result *result,
                                        const perp_mechanism_start *start, double t1,
                                        perp_mechanism_observer observer,
                                        void *user) PERP_WARN_UNUSED;

/* Finds all accelerations of a state, with their forces, and keeps them in the handle: every
 * combination of modes (separate, stick, slip) of the contacts that are closed (gap and u_n are 0
 * up to rounding) and of the dry groups. There may be none (Painleve's paradox: perp_mechanism_
 * advance still steps over it, by an impact without collision), one, several, or families.
 *
 * A contact is closed where its gap is at most 1e-12 of sum |H_i q_i| (with other coordinates than
 * velocities, of sum |H_i| max |q|), and takes part where |u_n| is at most 1e-12 of
 * sum |H_i v_i| + |drift|; sliding velocities are judged alike. What a slip that starts has is mu,
 * with Stribeck's curve mu_static.
 *
 * Forces that are not unique are families: polyhedra, by their vertices and rays. In 3 dimensions,
 * where a contact sticks, polygons within its disc of friction stand for it, so that the family
 * holds more than its vertices tell. Of one with more than 10 dimensions one point is given.
 *
 * Up to settings.most_patterns combinations (and 12 contacts) all are looked at; beyond, and where
 * a family is too large, the contact solver and fixed points of patterns, from settings.starts of
 * them, find some, and summary->exhaustive is 0. settings.time_limit ends either. An answer whose
 * residual is more than 1e-8 (numbers that overflow, or vanish) is none, and then exhaustive is 0,
 * too.
 *
 * Returns: PERP_OK, also where there is none; else as perp_mechanism_advance (then the handle keeps
 *          no answers).
 * Out:     summary: initialised by perp_struct_init.
 * Source:  docs/mechanism.md; P. Lotstedt, SIAM J. Appl. Math. 42 (1982); F. Genot & B. Brogliato,
 *          Eur. J. Mech. A 18 (1999). */
PERP_API perp_status perp_mechanism_accelerations(perp_mechanism *mechanism,
                                                  perp_mechanism_summary *summary, double t,
                                                  const double *q,
                                                  const double *v) PERP_WARN_UNUSED;

/* Finds all answers of a frozen step from (t, q0, v0) to t + h, before restitution, and keeps them
 * as accelerations v' = (v+ - v0) / h, with forces f = r / h, and u' = (u+ + max(gap, 0) / h) / h
 * of a normal, u+ / h of the other rows. All contacts take part (up to 12; beyond, those within
 * reach, and summary->exhaustive is 0). A wedge that is pulled may come out or jam; the jam of
 * Painleve's rod is an answer beside its accelerations. 'stable' is that of compliant contacts, as
 * for accelerations.
 *
 * Returns, Out: as perp_mechanism_accelerations; h <= 0 is refused. */
PERP_API perp_status perp_mechanism_answers(perp_mechanism *mechanism,
                                            perp_mechanism_summary *summary, double t, double h,
                                            const double *q0, const double *v0) PERP_WARN_UNUSED;

/* Gives answer `index`, from 0, of the last perp_mechanism_accelerations or perp_mechanism_answers:
 * fewer contacts that press come first. */
PERP_API perp_status perp_mechanism_get_acceleration(perp_mechanism *mechanism,
                                                     perp_mechanism_found *found,
                                                     int32_t index) PERP_WARN_UNUSED;

#ifdef __cplusplus
}
#endif

#endif
