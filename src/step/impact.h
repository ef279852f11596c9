/* What both steppers, mechanism and world, say of an impact at a normal row. */
#ifndef PERP_STEP_IMPACT_H
#define PERP_STEP_IMPACT_H

#include <math.h>
#include <stdint.h>

/* Whether a contact that presses was hit: it came faster than what the forces of the step make of
 * its velocity. A slower approach is resting contact, which would else bounce for ever. */
static inline int32_t perp__is_hit(double restitution, double before, double forced)
{
    return restitution > 0.0 && before < -fabs(forced);
}

/* s of the law 0 <= r_n perp u_n+ + s >= 0 of an impact: Moreau's, u_n+ = -e u_n- wherever an
 * impulse acts; and Newton's, which has nothing of what leaves already. */
static inline double perp__moreau_shift(double restitution, double before)
{
    return restitution * before;
}

static inline double perp__newton_shift(double restitution, double before)
{
    return -restitution * fmax(-before, 0.0);
}

#endif
