/* What both steppers, mechanism and world, say of an impact at a normal row.
 *
 * Little more of a step is common to them, and it stands in the layers below: the problem of the
 * velocities in src/contact, what holds in linalg/active_rows.h. The rest looks alike and is not:
 *
 *   rows that take part   mechanism has all contacts from the start and includes those that the
 *                         velocities pass; world finds them, island by island, and drops them
 *                         again between the impacts of a step
 *   impacts               mechanism has a second stage from the same beginning, whatever was hit;
 *                         world goes to the first impact, through it, and on from there
 *   projection            mechanism repeats a step of Newton's method on dense callbacks, with
 *                         bilateral rows; world makes one pass over the islands that overlap,
 *                         and turns bodies on the way */
#ifndef PERP_STEP_IMPACT_H
#define PERP_STEP_IMPACT_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

/* Whether a contact that presses was hit: it came faster than what the forces of the step make of
 * its velocity. A slower approach is resting contact, which would else bounce for ever. */
static inline bool perp__is_hit(double restitution, double before, double forced)
{
    return restitution > 0.0 && before < -fabs(forced);
}

/* s of Moreau's law 0 <= r_n perp u_n+ + s >= 0 of an impact. */
static inline double perp__moreau_shift(double restitution, double before)
{
    return restitution * before;
}

#endif
