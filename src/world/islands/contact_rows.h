/* Rows of the contacts. A contact has the axes (n, t1, t2), right-handed. With r the arm from a
 * body's mass centre to the contact point, the row of axis a is J_B = (a, r_B x a),
 * J_A = -(a, r_A x a). */
#ifndef PERP_WORLD_CONTACT_ROWS_H
#define PERP_WORLD_CONTACT_ROWS_H

#include <stddef.h>

#include "linalg/spatial.h"
#include "world/step.h"

/* The row of a gap in the next positions (../projection.c). */
void perp__write_normal(const perp_world *world, const perp__world_contact *contact, double gap,
                        perp__rigid_rows *rows);

/* Tangents for the normal in axes[0]. */
void perp__contact_frame(const perp_world *world, perp__world_contact *contact);

/* The twists of a motion by offset, for functions that take any of them. */
#define PERP__TWIST_START offsetof(perp__motion, start)
#define PERP__TWIST_FREE offsetof(perp__motion, free)
#define PERP__TWIST_MOVING offsetof(perp__motion, moving)
#define PERP__TWIST_AFTER offsetof(perp__motion, after)
#define PERP__TWIST_SHIFT offsetof(perp__motion, shift)

static inline const double *perp__const_twist(const perp__motion *motion, size_t twist)
{
    return (const double *)((const char *)motion + twist);
}

/* Row k of side A or B: relative velocity = J_A twist_A + J_B twist_B. */
static inline void perp__contact_row(const perp__world_contact *contact, int32_t side, int32_t k,
                                     double *row)
{
    perp__copy3(row, contact->axes[k]);
    perp__cross(row + 3, contact->arms[side], contact->axes[k]);
    for (int32_t i = 0; i < 6 && side == 0; i++)
        row[i] = -row[i];
}

/* Relative velocity of the surfaces at the contact, in the world's frame. */
static inline void perp__relative_twist(const perp_world *world, const perp__world_contact *contact,
                                        size_t twist, double *x)
{
    const double *a = perp__const_twist(&world->motions[contact->body_a], twist);
    const double *b = perp__const_twist(&world->motions[contact->body_b], twist);
    const double *r = contact->arms[0], *s = contact->arms[1];

    x[0] = (b[0] - a[0]) + ((b[4] * s[2] - b[5] * s[1]) - (a[4] * r[2] - a[5] * r[1]));
    x[1] = (b[1] - a[1]) + ((b[5] * s[0] - b[3] * s[2]) - (a[5] * r[0] - a[3] * r[2]));
    x[2] = (b[2] - a[2]) + ((b[3] * s[1] - b[4] * s[0]) - (a[3] * r[1] - a[4] * r[0]));
}

static inline void perp__relative_velocity(const perp_world *world,
                                           const perp__world_contact *contact, size_t twist,
                                           double *u)
{
    double x[3];

    perp__relative_twist(world, contact, twist, x);
    perp__apply3(u, contact->axes[0], x);
}

static inline double perp__normal_velocity(const perp_world *world,
                                           const perp__world_contact *contact, size_t twist)
{
    double x[3];

    perp__relative_twist(world, contact, twist, x);
    return perp__dot3(contact->axes[0], x);
}

#endif
