/* Rows of the contacts. A contact has the axes (n, t1, t2), right-handed. With r the arm from a
 * body's mass centre to the contact point, the row of axis a is J_B = (a, r_B x a),
 * J_A = -(a, r_A x a). */
#include "world/world.h"

#include <string.h>

#include "linalg/spatial.h"

/* t1 is the x axis brought into the tangent plane, or the y axis where the normal is close to x;
 * t2 = n x t1. Planar: t1 is the normal turned by +90 degrees. The normal (0,0,1) has t1 = x and
 * t2 = y. */
void perp__contact_frame(const perp_world *world, perp__world_contact *contact)
{
    const double *n = contact->axes[0];
    double *t1 = contact->axes[1];
    int32_t i, axis = fabs(n[0]) > 0.9 ? 1 : 0;
    double length;

    memset(contact->axes[1], 0, 2 * sizeof contact->axes[1]);
    if (world->settings.planar) {
        t1[0] = -n[1];
        t1[1] = n[0];
        return;
    }
    t1[axis] = 1.0;
    perp__add3(t1, -n[axis], n);
    length = perp__length3(t1);
    for (i = 0; i < 3; i++)
        t1[i] /= length;
    perp__cross(contact->axes[2], n, t1);
}

void perp__contact_row(const perp__world_contact *contact, int32_t side, int32_t k, double *row)
{
    const double sign = side == 0 ? -1.0 : 1.0;

    perp__cross(row + 3, contact->arms[side], contact->axes[k]);
    for (int32_t i = 0; i < 3; i++) {
        row[i] = sign * contact->axes[k][i];
        row[3 + i] *= sign;
    }
}

void perp__relative_velocity(const perp_world *world, const perp__world_contact *contact,
                             size_t twist, double *u)
{
    const double *a = perp__const_twist(&world->motions[contact->body_a], twist);
    const double *b = perp__const_twist(&world->motions[contact->body_b], twist);
    const double *r = contact->arms[0], *s = contact->arms[1];
    const double x = (b[0] - a[0]) + ((b[4] * s[2] - b[5] * s[1]) - (a[4] * r[2] - a[5] * r[1]));
    const double y = (b[1] - a[1]) + ((b[5] * s[0] - b[3] * s[2]) - (a[5] * r[0] - a[3] * r[2]));
    const double z = (b[2] - a[2]) + ((b[3] * s[1] - b[4] * s[0]) - (a[3] * r[1] - a[4] * r[0]));

    for (int32_t k = 0; k < 3; k++)
        u[k] = contact->axes[k][0] * x + contact->axes[k][1] * y + contact->axes[k][2] * z;
}
