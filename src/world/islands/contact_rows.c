/* The tangents of contacts. */
#include "world/islands/contact_rows.h"

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
    if (n[axis] != 0.0) { /* else it lies there */
        perp__add3(t1, -n[axis], n);
        length = perp__length3(t1);
        for (i = 0; i < 3; i++)
            t1[i] /= length;
    }
    perp__cross(contact->axes[2], n, t1);
}
