/* perp/friction.h: friction that grows with the load it moves (Dupont's model of transmissions).
 *
 *   A q'' + b + f = tau,   N = C q'' + d,   f_i = mu_i |N_i| sgn q_i'   where q_i' != 0,
 *                                         |f_i| <= mu_static_i |N_i|   where q_i' = q_i'' = 0.
 *
 * A is the inertia of the mechanism, N_i the normal force at the sliding contact of coordinate i:
 * it depends on the acceleration, so that friction adds to the inertia or takes from it. Where it
 * takes more than there is, a torque has no acceleration or several, and this header tells all of
 * them, which are stable, whether there can be more than one, and steps over states that have none.
 *
 * This header is about friction whose contacts are never left (screws, gears, guides, fingers) with
 * the normal force eliminated; contacts that open and close are perp/mechanism.h's.
 *
 * Source: P. Dupont, "Existence and uniqueness of rigid-body dynamics with Coulomb friction",
 * Trans. CSME (1993), for n = 1; several coordinates and the compliant limit: docs/friction.md.
 */
#ifndef PERP_FRICTION_H
#define PERP_FRICTION_H

#include <perp/base.h>
#include <perp/matrix.h>

#ifdef __cplusplus
extern "C" {
#endif

/* What kind of answer. Values never change. */
enum perp_load_kind_value {
    PERP_LOAD_DYNAMIC = 0, /* every coordinate slides, or starts to */
    PERP_LOAD_STATIC = 1,  /* every coordinate sticks */
    PERP_LOAD_MIXED = 2,   /* some stick, some slide */
    PERP_LOAD_FAMILY = 3   /* not isolated: a polyhedron of accelerations for one torque */
};

/* What a coordinate does. Values never change. */
enum perp_load_mode_value {
    PERP_LOAD_SLIDE = 0,    /* q_i' != 0 */
    PERP_LOAD_STICK = 1,    /* q_i' = 0 and stays so */
    PERP_LOAD_FORWARD = 2,  /* q_i' = 0, q_i'' > 0 */
    PERP_LOAD_BACKWARD = 3, /* q_i' = 0, q_i'' < 0 */
    PERP_LOAD_STOPPED = 4   /* of a step: q_i' becomes 0 */
};

/* Whether every torque has exactly one acceleration. Values never change. */
enum perp_load_verdict_value {
    PERP_LOAD_UNIQUE = 0,     /* proved */
    PERP_LOAD_NOT_UNIQUE = 1, /* disproved: some torque has none, several, or a family */
    PERP_LOAD_UNDECIDED = 2   /* neither a sufficient nor a necessary condition decides */
};

/* Why a torque and an acceleration do not determine each other. Values never change. */
enum perp_load_reason_value {
    PERP_LOAD_WELL_POSED = 0,    /* they do, and the motion is stable */
    PERP_LOAD_IN_FAMILY = 1,     /* the torque leaves the acceleration free along a direction */
    PERP_LOAD_UNSTABLE = 2,      /* a branch with negative effective inertia */
    PERP_LOAD_FLUTTERS = 3,      /* compliant contacts oscillate away from it */
    PERP_LOAD_SEVERAL = 4,       /* stable, but the torque has other answers, too */
    PERP_LOAD_AT_REST = 5,       /* static friction leaves the torque open */
    PERP_LOAD_NOT_ENUMERATED = 6 /* too large to exclude other answers */
};

/* The system. Matrices and vectors are the caller's and are copied. */
typedef struct perp_load_system {
    size_t struct_size;
    int32_t n;                         /* coordinates; at least 1 */
    int32_t reserved;                  /* 0 */
    const perp_matrix *A;              /* n by n, symmetric positive definite */
    const perp_matrix *C;              /* n by n */
    const double *b, *d;               /* n; NULL: 0 */
    const double *mu;                  /* n, >= 0 */
    const double *mu_static;           /* n, >= mu; NULL: mu */
    const perp_matrix *normal_inertia; /* S, n by n symmetric positive definite: what the contacts
                                          move in normal direction, M_yy - C A^-1 C'; NULL: 1 */
    double stiffness;                  /* of every contact in normal direction; > 0; default 1 */
    double damping;                    /* >= 0; default 2, critical for unit inertia */
} perp_load_system;

typedef struct perp_load_settings {
    size_t struct_size;
    double tol;            /* an answer counts if it is one for data changed by this, relatively;
                              default 1e-13; in (0, 1e-3] */
    int64_t most_patterns; /* more combinations of signs and modes than this are not enumerated;
                              default 2^21; >= 1 */
    int32_t starts;        /* of the search that then takes its place; default 64; >= 1 */
    int32_t reserved;      /* 0 */
} perp_load_settings;

/* One answer. The arrays are the handle's, valid until its next call. */
typedef struct perp_load_found {
    size_t struct_size;
    int32_t kind;         /* PERP_LOAD_DYNAMIC, ... */
    int32_t stable;       /* 1: the compliant contacts settle on it (B12 of docs/friction.md) */
    int32_t flutter;      /* 1: unstable though every effective inertia is positive */
    int32_t at_vertex;    /* 1: within tol of a change of signs or modes: other data very near have
                             more answers, or fewer */
    int32_t dimension;    /* 0, of a family at least 1 */
    int32_t vertex_count; /* at least 1 */
    int32_t ray_count;    /* 0 unless the family is unbounded */
    int32_t reserved;     /* 0 */
    double residual;      /* largest |A q'' + b + f - tau|_i beside the sum of sizes in that row */
    const double *acceleration; /* n: q''; of a family a point inside */
    const double *normal_force; /* n: C q'' + d there */
    const double *friction;     /* n: f there */
    const int32_t *modes;       /* n: PERP_LOAD_SLIDE, ... */
    const double *eigenvalues;  /* 2 n pairs (real, imaginary) of the compliant contacts */
    const double *vertices;     /* vertex_count times n: the family is their convex hull */
    const double *rays;         /* ray_count times n: plus sums of these with factors >= 0 */
} perp_load_found;

typedef struct perp_load_summary {
    size_t struct_size;
    int32_t count;      /* answers, families included */
    int32_t families;   /* families among them */
    int32_t stable;     /* stable ones among them */
    int32_t exhaustive; /* 1: there are no others; 0 too where numbers of a pattern overflow, or
                           its equations are not solved to tol beside each row's own terms */
    int64_t patterns;   /* combinations of signs and modes looked at */
} perp_load_summary;

typedef struct perp_load_uniqueness {
    size_t struct_size;
    int32_t verdict;    /* PERP_LOAD_UNIQUE, ... */
    int32_t exact;      /* 1: by all determinants (n <= 12): necessary and sufficient, and margin is
                           exact; 0: by norms */
    double margin;      /* all mu may be multiplied by less than this; +inf: by anything. If not
                           exact, a lower bound. Of coordinates in motion */
    double determinant; /* exact: the smallest det(I + G D); else nan */
    double norm;        /* ||G||_2 */
    double radius;      /* spectral radius of |G|, an upper bound */
} perp_load_uniqueness;

typedef struct perp_load_inverse {
    size_t struct_size;
    int32_t well_posed;    /* 1: this torque has this acceleration alone, and it is stable */
    int32_t accelerations; /* answers of this torque that were found; families count once */
    int32_t exhaustive;    /* 1: there are no others */
    int32_t stable;        /* 1: the wanted motion is stable */
    int32_t flutter;       /* as in perp_load_found */
    int32_t undetermined;  /* coordinates at rest, for which any torque within the friction does */
    int32_t reason;        /* PERP_LOAD_WELL_POSED, ...: the first of those above that applies */
    int32_t reserved;      /* 0 */
} perp_load_inverse;

/* A step in time. */
typedef struct perp_load_step {
    size_t struct_size;
    int32_t chosen;     /* the answer that was taken; -1: a search (not exhaustive) found none, and
                              the velocity stays */
    int32_t answers;    /* of the equations of the step */
    int32_t exhaustive; /* 1: there are no others */
    int32_t stable;     /* 1: the answer that was taken is stable */
    int32_t stopped;    /* coordinates that come to rest in this step */
    int32_t jam;        /* 1: one of them by an impulse, not by the acceleration */
    int32_t accelerations; /* answers of the rigid system before the step */
    int32_t reserved;      /* 0 */
} perp_load_step;

/* Contacts that give: with x the displacements of n coordinates, x = 0 where all contacts just
 * touch, and constant matrices,
 *
 *   mass x'' + normal' N + tangent' F = force,   F = mu sgn(tangent x') |N| where it slides,
 *   |F| <= mu_static |N| and tangent x' = 0 where it sticks,
 *   N = stiffness delta + damping delta',   delta = normal x  (penetration; N < 0: the other
 * flank); of a one-sided contact, where delta > 0 and that is positive, else N = 0.
 */
typedef struct perp_compliant_system {
    size_t struct_size;
    int32_t n;                  /* coordinates; at least 1 */
    int32_t contacts;           /* p, at least 1 */
    const perp_matrix *mass;    /* n by n, symmetric positive definite */
    const perp_matrix *normal;  /* p by n */
    const perp_matrix *tangent; /* p by n */
    const double *force;        /* n; NULL: 0 */
    const double *mu;           /* p, >= 0 */
    double stiffness;           /* > 0 */
    double damping;             /* >= 0 */
    const double *mu_static;    /* p, >= mu; NULL: mu */
    const int32_t *one_sided;   /* p: 1 where N < 0 is not possible; NULL: 0 */
} perp_compliant_system;

/* How a compliant run ended. Values never change. */
enum perp_compliant_end_value {
    PERP_COMPLIANT_TIME = 0,     /* at t_end */
    PERP_COMPLIANT_STOPPED = 1,  /* a contact stopped sliding */
    PERP_COMPLIANT_STEPS = 2,    /* most_steps taken */
    PERP_COMPLIANT_FAILED = 3,   /* steps became too short: no digits left */
    PERP_COMPLIANT_RELEASED = 4, /* a one-sided contact separated */
    PERP_COMPLIANT_TOUCHED = 5   /* a one-sided contact began to press */
};

typedef struct perp_compliant_settings {
    size_t struct_size;
    double tol;         /* error of a step, beside the largest value so far; default 1e-9 */
    double first_step;  /* default 0: chosen */
    int64_t most_steps; /* default 10^6 */
    int32_t through;    /* 1: starts at rest, too, and goes on where contacts stop, stick, reverse,
                           separate and touch; 0 (default): ends where one does */
    int32_t resume;     /* 1: the largest values of this handle's last run count as values so far:
                           a run in pieces, as long as one; 0 (default) */
} perp_compliant_settings;

typedef struct perp_compliant_result {
    size_t struct_size;
    int32_t end;         /* PERP_COMPLIANT_TIME, ... */
    int32_t contact;     /* that stopped; else -1 */
    double t;            /* when it ended */
    double next_step;    /* to go on with as first_step */
    double least_normal; /* smallest and largest normal force on the way */
    double largest_normal;
    int64_t steps;
    int64_t rejected;
    int32_t stops;     /* of slip that ended in stick */
    int32_t reversals; /* of slip that ended in slip the other way */
    int32_t starts;    /* of stick that ended in slip */
    int32_t releases;  /* of one-sided contacts */
    /* at the end; the handle's, valid until its next call */
    const double *friction; /* p: F */
    const int32_t *modes;   /* p: PERP_CONTACT_SEPARATE, _STICK or _SLIP (contact.h) */
} perp_compliant_result;

typedef struct perp_compliant_stability {
    size_t struct_size;
    int32_t stable;  /* 1: all eigenvalues have negative real parts */
    int32_t flutter; /* 1: not stable, though Re gamma > 0 for all */
    double growth;   /* the largest real part of an eigenvalue, 1 / time */
} perp_compliant_stability;

typedef struct perp_compliant perp_compliant;
typedef struct perp_load_friction perp_load_friction;

PERP_API perp_status perp_load_system_init(perp_load_system *system, size_t size);
PERP_API perp_status perp_load_settings_init(perp_load_settings *settings, size_t size);
PERP_API perp_status perp_compliant_settings_init(perp_compliant_settings *settings, size_t size);

/* Return the words ("dynamic", ...; "slide", ...; a sentence, "" for PERP_LOAD_WELL_POSED);
 * "unknown kind", "unknown mode", "unknown reason" otherwise. */
PERP_API const char *perp_load_kind_text(int32_t kind);
PERP_API const char *perp_load_mode_text(int32_t mode);
PERP_API const char *perp_load_reason_text(int32_t reason);

/* Takes a system. It is released by perp_load_friction_destroy.
 *
 * Returns: PERP_OK; PERP_ERROR_ARGUMENT (n < 1, A or S not symmetric positive definite, mu < 0,
 *          mu_static < mu, a size that doesn't fit), _NOT_FINITE, _ABI, _HANDLE, _BUSY or _MEMORY.
 * Out:     friction: the handle; untouched after failure.
 * In:      settings: NULL for the defaults.
 * Cost:    n^3. */
PERP_API perp_status perp_load_friction_create(perp_context *context, perp_load_friction **friction,
                                               const perp_load_settings *settings,
                                               const perp_load_system *system) PERP_WARN_UNUSED;

/* Replaces the system by another one of the same n, and drops the answers. After failure the old
 * system stays, with its answers. Returns as perp_load_friction_create. */
PERP_API perp_status perp_load_friction_set(perp_load_friction *friction,
                                            const perp_load_system *system) PERP_WARN_UNUSED;

/* Releases the handle; NULL is accepted. Ignored inside a callback of its own context. */
PERP_API void perp_load_friction_destroy(perp_load_friction *friction);

/* Forward dynamics: finds the accelerations that a torque may have, and keeps them in the handle.
 * Up to most_patterns combinations all are found; beyond, those that a search from several signs
 * finds, and summary.exhaustive is 0.
 *
 * Returns: PERP_OK, also where there is none; PERP_ERROR_ARGUMENT, _NOT_FINITE, _ABI, _HANDLE,
 *          _BUSY or _MEMORY (then the handle keeps no answers, else those it had).
 * Out:     summary: initialised by perp_struct_init.
 * In:      tau, velocity: n entries; of the velocity only the signs count, 0.0 is at rest.
 * Cost:    2^n patterns in motion, 5^n at rest, n^3 each: 1 us at n = 4, 4 us at 8, 20 us at 12; a
 *          few patterns where friction is so weak that <A> - (mu |C| + |C|' mu) / 2 is positive
 *          definite (<A> is A with -|A_ij| off the diagonal) and what rests has mu_static = mu:
 *          there is one answer then. No memory, once the answers have room. */
PERP_API perp_status perp_load_friction_solve(perp_load_friction *friction,
                                              perp_load_summary *summary, const double *tau,
                                              const double *velocity) PERP_WARN_UNUSED;

/* Gives answer `index`, from 0, of the last perp_load_friction_solve or perp_load_friction_step, in
 * increasing order of accelerations (the first coordinate counts first). */
PERP_API perp_status perp_load_friction_get(perp_load_friction *friction, perp_load_found *found,
                                            int32_t index) PERP_WARN_UNUSED;

/* Tells whether every torque has exactly one acceleration.
 *
 * In motion, the verdict is that of the determinants det(I + G D), G = C A^-1 diag(mu), for all
 * D = diag(+-1) (they don't depend on the directions of motion); for n > 12 that of ||G||_2 < 1 or
 * rho(|G|) < 1, which suffice, or of one determinant <= 0 that was met. At rest, n > 1, and where
 * mu_static > mu, 'unique' is by diagonal dominance, which suffices.
 *
 * Returns: PERP_OK; PERP_ERROR_ARGUMENT, _NOT_FINITE, _ABI, _HANDLE, _BUSY or _MEMORY.
 * In:      velocity: n entries, NULL: all in motion.
 * Cost:    2^n n^3 up to n = 12 (0.1 s there), then n^3.
 * Source:  sign-real spectral radius: S. M. Rump, "Theorems of Perron-Frobenius type for matrices
 *          without sign restrictions", Linear Algebra Appl. 266 (1997). */
PERP_API perp_status perp_load_friction_uniqueness(perp_load_friction *friction,
                                                   perp_load_uniqueness *uniqueness,
                                                   const double *velocity) PERP_WARN_UNUSED;

/* Inverse dynamics: the torque for a wanted acceleration, and what that torque may do instead.
 *
 * Returns: as perp_load_friction_solve. The handle's answers are then those of that torque.
 * Out:     tau: n entries. A coordinate that stays at rest gets the torque without friction;
 *             any within mu_static |N_i| of it does.
 *          inverse: initialised by perp_struct_init; or NULL. */
PERP_API perp_status perp_load_friction_inverse(perp_load_friction *friction, double *tau,
                                                perp_load_inverse *inverse, const double *velocity,
                                                const double *acceleration) PERP_WARN_UNUSED;

/* A step in time, implicit in the velocity: x = (v_next - v) / h solves
 *
 *   A x + b + f = tau,   f_i = mu_i |N_i| Sgn v_next_i,   N = C x + d,   Sgn 0 = [-1, 1],
 *
 * with mu_static_i where v_i = v_next_i = 0. Such a step exists at every state, for every h and n,
 * because friction never drives: where the rigid system has no acceleration, a coordinate stops
 * within the step (the impulsive jam), and its v_next is exactly 0.0. All answers are found and
 * kept as by perp_load_friction_solve, acceleration being x. One is taken:
 * - a stable one if there is any;
 * - of these, one whose normal forces have the signs of `previous` where coordinates move (for
 *   n = 1, one on the same side of the unstable answer as `previous`, which is what compliant
 *   contacts do);
 * - of these, one that leaves most coordinates at rest where they are at rest;
 * - of these, the one with the least x'A x.
 *
 * Returns: PERP_OK; PERP_ERROR_ARGUMENT, _NOT_FINITE (also if next is not: next and normal are
 *          untouched then), _ABI, _HANDLE, _BUSY or _MEMORY.
 * Out:     next: n velocities; normal: n normal forces N, or NULL. They may be `velocity` and
 *             `previous`.
 *          step: initialised by perp_struct_init; or NULL.
 * In:      tau, velocity: n entries. previous: n normal forces of the step before, of which nan is
 *             unknown; NULL: all unknown. h > 0.
 * Cost:    5^n patterns, or a few, and those of perp_load_friction_solve: 10 us at n = 4 where they
 *          are few.
 * Source:  docs/friction.md. */
PERP_API perp_status perp_load_friction_step(perp_load_friction *friction, double *next,
                                             double *normal, perp_load_step *step,
                                             const double *tau, const double *velocity,
                                             const double *previous, double h) PERP_WARN_UNUSED;

/* Takes a system of compliant contacts. It is released by perp_compliant_destroy.
 *
 * Returns: PERP_OK; PERP_ERROR_ARGUMENT, _NOT_FINITE, _ABI, _HANDLE, _BUSY or _MEMORY.
 * Out:     compliant: the handle; untouched after failure.
 * In:      system: is copied. */
PERP_API perp_status perp_compliant_create(perp_context *context, perp_compliant **compliant,
                                           const perp_compliant_system *system) PERP_WARN_UNUSED;

/* Releases the handle; NULL is accepted. Ignored inside a callback of its own context. */
PERP_API void perp_compliant_destroy(perp_compliant *compliant);

/* Linearises the contacts where they slide in the directions `slip` with normal forces of the signs
 * `load`: delta'' + Gamma (stiffness delta + damping delta') = const,
 * Gamma = normal mass^-1 (normal' + tangent' diag(mu slip load)).
 *
 * Returns: PERP_OK; PERP_ERROR_ARGUMENT (an entry of slip that is not -1, 0 or 1, of load not -1 or
 *          1), _NOT_FINITE (eigenvalues that overflow), _ABI, _HANDLE or _BUSY.
 * Out:     stability: initialised by perp_struct_init. Stable if and only if, for all
 *          gamma, Re gamma > 0 and damping^2 Re(gamma) |gamma|^2 > stiffness Im(gamma)^2.
 *          gamma: p eigenvalues of Gamma as pairs (real, imaginary); or NULL.
 *          eigenvalues: the 2 p roots of l^2 + gamma (damping l + stiffness), as pairs; or NULL.
 * In:      slip, load: p signs; slip 0: without friction. */
PERP_API perp_status perp_compliant_linearise(perp_compliant *compliant,
                                              perp_compliant_stability *stability, double *gamma,
                                              double *eigenvalues, const int32_t *slip,
                                              const int32_t *load) PERP_WARN_UNUSED;

/* Integrates from t = 0 until t_end, or until a contact stops sliding: there |tangent x'| is 0 to
 * the last digits of t; or separates or touches. With settings.through it starts at rest, too, and
 * goes on: what rests sticks or slides by the friction that the normal forces allow, stick ends
 * where it is used up, and slip where it comes to rest. A velocity that stuck contacts determine
 * along an axis is 0.0.
 *
 * Returns: PERP_OK; PERP_ERROR_ARGUMENT (also where a contact with friction doesn't slide at first,
 *          without `through`), _NOT_FINITE, _ABI, _HANDLE, _BUSY or _MEMORY (the first run in which
 *          something rests takes some).
 * Out:     x, v: n each; N: p normal forces, or NULL; x may be x0, v may be v0.
 *          result: initialised by perp_struct_init.
 * In:      settings: NULL for the defaults.
 * Cost:    about 5 p^3 + 15 n p a step.
 * Source:  L-stable SDIRK of order 4 with 5 stages: Hairer & Wanner, "Solving ODE II",
 *          table IV.6.5; within a stage the signs of N are iterated. */
PERP_API perp_status perp_compliant_run(perp_compliant *compliant, double *x, double *v, double *N,
                                        perp_compliant_result *result,
                                        const perp_compliant_settings *settings, const double *x0,
                                        const double *v0, double t_end) PERP_WARN_UNUSED;

#ifdef __cplusplus
}
#endif

#endif
