/* perp/bristle.h: friction that depends on speed (Stribeck), and on what its bristles remember
 * (LuGre).
 *
 *   g(v) = kinetic + (breakaway - kinetic) exp(-(v / speed)^2)
 *
 *   Stribeck   F = g(v) sgn v + viscosity v
 *   LuGre      z' = v - stiffness |v| z / g(v),   F = stiffness z + damping z' + viscosity v
 *
 * v is the sliding velocity and F opposes it: what acts on a body that slides with v is -F. In
 * steady sliding LuGre's force is Stribeck's. At rest Stribeck's is a set, [-breakaway, breakaway];
 * LuGre's is that of bristles bent by z, which are an elastic spring for displacements that are
 * small beside breakaway / stiffness, and creep under any load that swings. Exact sticking is
 * perp/mechanism.h's.
 *
 * These are plain functions: they keep nothing, and allocate nothing. The context is where the
 * message of a refusal goes; it may be NULL, also inside of callbacks.
 *
 * Source: C. Canudas de Wit, H. Olsson, K. J. Astrom & P. Lischinsky, "A new model for control of
 * systems with friction", IEEE Trans. Automatic Control 40 (1995). */
#ifndef PERP_BRISTLE_H
#define PERP_BRISTLE_H

#include <perp/base.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The law. In papers Fc, Fs, vs, Fv or sigma2, sigma0, sigma1, in this order. All default to 0. */
typedef struct perp_bristle {
    size_t struct_size;
    double kinetic;   /* force of fast sliding; > 0 */
    double breakaway; /* force at v = 0, >= kinetic; 0: kinetic */
    double speed;     /* that takes g from one to the other; > 0 unless they are equal */
    double viscosity; /* force / speed, >= 0 */
    double stiffness; /* of the bristles; > 0; LuGre only */
    double damping;   /* of the bristles; >= 0; LuGre only */
} perp_bristle;

/* Gives the force of steady sliding and its derivative.
 *
 * Returns: PERP_OK; PERP_ERROR_ARGUMENT (kinetic <= 0, breakaway < kinetic, ...), _NOT_FINITE
 *          (also of the result), _ABI; also _HANDLE or _BUSY for a context that is given. Then
 *          nothing was written.
 * Out:     force: 0 at v = 0, the middle of its set. slope: dF/dv, at v = 0 that on either side of
 *          it; or NULL.
 * In:      context: or NULL. stiffness and damping are not looked at. */
PERP_API perp_status perp_stribeck_force(perp_context *context, double *force, double *slope,
                                         const perp_bristle *law, double v) PERP_WARN_UNUSED;

/* Gives LuGre's force at one instant, and the rate at which the bristles bend.
 *
 * Returns: as perp_stribeck_force; also PERP_ERROR_ARGUMENT for stiffness <= 0 or damping < 0.
 * Out:     force. rate: z'; or NULL.
 * In:      context: or NULL. z: of the bristles, |z| <= breakaway / stiffness in any motion that
 *          starts from 0; other values are taken as they are. */
PERP_API perp_status perp_lugre_force(perp_context *context, double *force, double *rate,
                                      const perp_bristle *law, double z, double v) PERP_WARN_UNUSED;

/* Steps the bristles over h at constant v: the exact solution of the linear equation for z, for
 * any h, however stiff (A-stable, and |z| never leaves its bounds).
 *
 * Returns: as perp_lugre_force; also PERP_ERROR_ARGUMENT for h <= 0.
 * Out:     next: z at the end; may be &z. force: the mean of F over the step, so that h F is the
 *          impulse and h F v the work, exactly. slope: d(force)/dv, for implicit steps of what
 *          slides (at v = 0 the mean of both sides); or NULL.
 * In:      context: or NULL. */
PERP_API perp_status perp_lugre_step(perp_context *context, double *next, double *force,
                                     double *slope, const perp_bristle *law, double z, double v,
                                     double h) PERP_WARN_UNUSED;

/* Tells whether LuGre's friction never gives back more than the bristles hold,
 * int F v dt >= [stiffness z^2 / 2], in every motion with |z| <= breakaway / stiffness.
 *
 * Returns: as perp_lugre_force.
 * Out:     passive: 1 if viscosity kinetic >= damping (breakaway - kinetic), else 0.
 * In:      context: or NULL.
 * Source:  N. Barabanov & R. Ortega, "Necessary and sufficient conditions for passivity of the
 *          LuGre friction model", IEEE Trans. Automatic Control 45 (2000). */
PERP_API perp_status perp_lugre_passive(perp_context *context, int32_t *passive,
                                        const perp_bristle *law) PERP_WARN_UNUSED;

#ifdef __cplusplus
}
#endif

#endif
