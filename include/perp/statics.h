/* perp/statics.h: can it stand? Equilibrium of contacts with Coulomb friction, decided.
 *
 * Forces f on n velocities are in equilibrium with contacts and joints where impulses exist with
 *
 *   f + H'r + G's = 0,     r_i in K_i
 *
 * K_i is the friction cone |r_t| <= mu r_n of contact i (with rolling and spinning friction the
 * larger one of perp/contact.h), the half-line r >= 0 of a contact without friction, the interval
 * [lower, upper] of a row with bounds; bilateral impulses s are free. The laws of a two-sided
 * contact, |r_t| <= mu |r_N|, allow no convex set; decided is whether it can press along the
 * direction d of its impulse in r0, r_N . d >= |r_t| / mu, with r_N across d free. This is a convex
 * problem: phase one of an interior-point method (Nesterov & Todd, SIAM J. Optim. 8 (1998) 324;
 * Andersen, Roos & Terlaky, Math. Program. 95 (2003) 249) decides it for every assembly alike, and
 * where no such impulses exist finds a virtual velocity v that proves it (theorem of the
 * alternative; in limit analysis the mechanism of collapse: Heyman, Int. J. Solids Struct. 2 (1966)
 * 249):
 *
 *   u = H v in the dual cones (u_n >= mu |u_t|),   G v = 0,   f'v > 0
 *
 * because then 0 = v'(f + H'r + G's) = f'v + r'u > 0 for every admissible r. Rows with bounds count
 * with the least r_i u_i that their interval allows.
 *
 * "Equilibrium" is what the laws allow at velocity zero. Where friction is Coulomb's a body that
 * can rest may also have another motion (Stewart & Trinkle's and Dupont's ambiguous states); perp
 * takes rest. */
#ifndef PERP_STATICS_H
#define PERP_STATICS_H

#include <perp/base.h>
#include <perp/contact.h>
#include <perp/matrix.h>

#ifdef __cplusplus
extern "C" {
#endif

/* What was decided. Values never change. */
enum perp_statics_verdict_value {
    PERP_STATICS_STANDS = 0,       /* the impulses returned balance the forces, within all cones */
    PERP_STATICS_FALLS = 1,        /* none do: the virtual velocity returned proves it */
    PERP_STATICS_INDETERMINATE = 2 /* doubles cannot tell: the margin is within rounding of 0, or
                                      numbers are too far apart for them */
};

/* Which of the impulses that balance the forces is returned. Values never change. */
enum perp_statics_objective_value {
    PERP_STATICS_LEAST = 0,   /* the least ones, min |r|^2: unique; those of equally stiff contacts
                                 that can lift off and slide, so that what is symmetric is carried
                                 symmetrically */
    PERP_STATICS_INTERIOR = 1 /* the first ones strictly inside all cones: for less work, and best
                                 to start from when forces change */
};

typedef struct perp_statics_settings {
    size_t struct_size;
    int32_t objective;      /* PERP_STATICS_...; default least */
    int32_t max_iterations; /* of the interior point; 0 (default): 100 */
} perp_statics_settings;

typedef struct perp_statics_result {
    size_t struct_size;
    int32_t verdict;    /* PERP_STATICS_... */
    int32_t iterations; /* factorisations of H D H' that it took */
    double margin;      /* the largest s, to a hundredth, for which impulses exist that keep s w
                           from the edge of every cone, r_n - s w >= |r_t| / mu; w is the load of
                           the less loaded of the bodies that the contact pushes. At most 1.
                           Negative: what is missing; -inf: no impulses of any sign balance the
                           forces. 0 also where contacts can carry nothing at all (a flush
                           neighbour that nothing presses) */
    double safety;      /* the largest factor with which `load` is carried beside f, to 1e-8; inf
                           where no factor is too large; NaN without a load, where no factor is, or where
                           the only one is known to rounding alone */
    double unbalance;   /* of the impulses returned: the largest |f + H'r + G's| of a body over the
                           largest sum of its terms' sizes; of a body that no force pushes, over at
                           least 16 eps / 1e-12 of the largest among those it is coupled with */
    double work;        /* f'v of the certificate, plus the least r'u of rows with bounds; with
                           |v| at most 1 in every entry */
    double seconds;
} perp_statics_result;

/* Forces and rows. */
typedef struct perp_statics_problem {
    size_t struct_size;
    int32_t n;                     /* velocities */
    int32_t reserved;              /* 0 */
    const perp_contact_laws *laws; /* contacts, and rows with bounds; compliance is not read */
    const perp_matrix *H; /* rows of the contacts and those with bounds by n, dense or CSC */
    const perp_matrix *G; /* bilateral rows by n, or NULL */
    const double *f;      /* n: forces, or impulses: what balances them has their unit */
    const double *load;   /* n: a further force, asked for result.safety; decided is
                             f + load. NULL: none */
    const double *r0;     /* rows of H: impulses, of the last step for instance, that tell which
                             way two-sided contacts with friction press; of others not read.
                             NULL: nothing is known */
} perp_statics_problem;

/* Returns "stands", "falls" or "indeterminate"; "unknown verdict" otherwise. Static. */
PERP_API const char *perp_statics_verdict_text(int32_t verdict);

/* Decides whether forces are in equilibrium with contacts and joints.
 *
 * Returns: PERP_OK with result->verdict; PERP_ERROR_ARGUMENT (sizes, mu < 0, inverted bounds,
 *          unsorted indices, two-sided contacts with friction of which r0 does not tell which way
 *          they press), _NOT_FINITE, _ABI, _HANDLE, _BUSY or _MEMORY.
 *          After a negative status nothing was written.
 * Out:     r: impulses of the contacts and of the rows with bounds, then the bilateral ones; where
 *             it stands, within their cones to the last bit, 0.0 in contacts that can carry
 *             nothing. Else untouched. NULL: not wanted.
 *          v: n: where it falls, the virtual velocity, |v_i| at most 1. Else untouched. NULL: not
 *             wanted.
 *          result: initialised by perp_struct_init.
 * In:      problem: read during the call only. settings: NULL for the defaults.
 * Cost:    a few factorisations of H D H' (D a block a contact), n by n with the sparsity of bodies
 *          that touch; 1 to 10 us a contact of rigid bodies for 1 to 10 of them.
 * Memory:  allocated and released within the call. */
PERP_API perp_status perp_contact_statics(perp_context *context, double *r, double *v,
                                          perp_statics_result *result,
                                          const perp_statics_problem *problem,
                                          const perp_statics_settings *settings) PERP_WARN_UNUSED;

#ifdef __cplusplus
}
#endif

#endif
