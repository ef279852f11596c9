/* Projected Gauss-Seidel on the impulses of an island, without a matrix: at every contact in turn
 *
 *   r_n := max(0, r_n - (u_n - target) / W_nn),
 *   r_t := the point of the polygon mu r_n next to r_t - u_t / L,    L the largest eigenvalue of
 * W_tt,
 *
 * and the bodies' twists follow. It takes over where a budget or a method ends short of an answer:
 * each sweep costs the same, and none gives energy, so that what a few of them leave is usable. */
#include "world/world.h"

#include <math.h>
#include <string.h>

#include "world/spatial.h"

/* Sweeps that are always made, and most of them. */
#define LEAST 8
#define MOST 200

static void push(perp_world *world, const perp__world_contact *contact, int32_t axis, double change)
{
    perp__add6(world->motions[contact->body_a].solved, change, contact->response[0][axis]);
    perp__add6(world->motions[contact->body_b].solved, change, contact->response[1][axis]);
}

/* W_ij of a contact with itself. */
static double response(const perp__world_contact *contact, int32_t i, int32_t j)
{
    return perp__dot6(contact->rows[0][i], contact->response[0][j]) +
           perp__dot6(contact->rows[1][i], contact->response[1][j]);
}

/* Moves `point` to the nearest one of the segment from a to b. */
static void nearest_on(double *point, const double *a, const double *b)
{
    const double along[2] = {b[0] - a[0], b[1] - a[1]};
    const double length = along[0] * along[0] + along[1] * along[1];
    double t = (point[0] - a[0]) * along[0] + (point[1] - a[1]) * along[1];

    t = length > 0.0 ? fmin(fmax(t / length, 0.0), 1.0) : 0.0;
    point[0] = a[0] + t * along[0];
    point[1] = a[1] + t * along[1];
}

/* The point of the polygon with vertices `most` times the edges that is next to r. */
static void into_polygon(const perp_world *world, double most, double *r)
{
    double best = INFINITY, next[2] = {0.0, 0.0};
    int32_t j;

    if (most > 0.0 && world->edges > 2 && perp__gauge(world, r) <= most)
        return;
    for (j = 0; j < world->edges && most > 0.0; j++) {
        const double *d = world->edge[j], *e = world->edge[(j + 1) % world->edges];
        const double from[2] = {most * d[0], most * d[1]}, to[2] = {most * e[0], most * e[1]};
        double near[2] = {r[0], r[1]}, distance;

        nearest_on(near, from, to);
        distance = hypot(near[0] - r[0], near[1] - r[1]);
        if (distance < best) {
            best = distance;
            next[0] = near[0];
            next[1] = near[1];
        }
    }
    r[0] = next[0];
    r[1] = next[1];
}

/* Friction of one contact; returns the change as a velocity. */
static double sweep_friction(perp_world *world, perp__world_contact *contact)
{
    const double a = response(contact, 1, 1), b = response(contact, 1, 2),
                 c = response(contact, 2, 2);
    const double largest = 0.5 * (a + c) + hypot(0.5 * (a - c), b);
    const double old[2] = {contact->impulse[1], contact->impulse[2]};
    double u[3];

    if (!(largest > 0.0))
        return 0.0;
    perp__relative_velocity(world, contact, PERP__TWIST_SOLVED, u);
    contact->impulse[1] -= u[1] / largest;
    contact->impulse[2] -= u[2] / largest;
    into_polygon(world, contact->friction * contact->impulse[0], contact->impulse + 1);
    push(world, contact, 1, contact->impulse[1] - old[0]);
    push(world, contact, 2, contact->impulse[2] - old[1]);
    return largest * hypot(contact->impulse[1] - old[0], contact->impulse[2] - old[1]);
}

/* One contact; returns the change as a velocity. */
static double sweep_contact(perp_world *world, perp__world_contact *contact)
{
    const double W = response(contact, 0, 0), old = contact->impulse[0];
    double u[3];

    if (!(W > 0.0))
        return 0.0;
    perp__relative_velocity(world, contact, PERP__TWIST_SOLVED, u);
    contact->impulse[0] = fmax(0.0, old - (u[0] - contact->target) / W);
    push(world, contact, 0, contact->impulse[0] - old);
    return fmax(W * fabs(contact->impulse[0] - old),
                contact->edges > 0 ? sweep_friction(world, contact) : 0.0);
}

void perp__start_sweeps(perp_world *world, perp__contact_set *set, const perp__island *island,
                        size_t from)
{
    int32_t i;

    for (i = 0; i < island->bodies; i++) {
        perp__motion *motion = perp__island_motion(world, island, i);

        if (from == PERP__TWIST_SOLVED)
            memset(motion->solved, 0, sizeof motion->solved);
        else
            memcpy(motion->solved, perp__twist(motion, from), sizeof motion->solved);
    }
    for (i = 0; i < island->contacts; i++)
        memset(perp__island_contact(world, set, island, i)->impulse, 0, 3 * sizeof(double));
}

void perp__sweep_island(perp_world *world, perp__contact_set *set, const perp__island *island,
                        double seconds)
{
    const double share = perp__seconds_left(world) - seconds;
    double first = 0.0, change = INFINITY;
    int32_t k, i;

    for (k = 0; k < MOST && change > world->settings.tol * first; k++) {
        if (k >= LEAST && (world->budget.iterations == 0 || perp__seconds_left(world) < share))
            break;
        change = 0.0;
        for (i = 0; i < island->contacts; i++) {
            int32_t at = k % 2 == 0 ? i : island->contacts - 1 - i;

            perp__raise_to(&change,
                           sweep_contact(world, perp__island_contact(world, set, island, at)));
        }
        if (k == 0)
            first = change;
    }
    perp__spend(world, k);
}
