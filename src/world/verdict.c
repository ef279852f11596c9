/* How far an island's velocities and impulses are from the laws, each body and each contact beside
 * its own terms: a light body does not hide behind a heavy one of the same island. */
#include "world/world.h"

#include <math.h>
#include <string.h>

#include "world/spatial.h"

/* Of an impulse that is less than this of what its contact's velocity is made of, nothing but its
 * being in the cone matters. */
#define SMALLEST 1e-5

double perp__mass_norm(const perp__motion *motion, const double *twist)
{
    double turning[3];

    perp__apply3(turning, motion->inverse_factor, twist + 3);
    return hypot(motion->root_mass * perp__length3(twist), perp__length3(turning));
}

double perp__row_norm(const perp__motion *motion, const double *row)
{
    double turning[3];

    perp__apply_transposed3(turning, motion->factor, row + 3);
    return hypot(motion->root_inverse_mass * perp__length3(row), perp__length3(turning));
}

double perp__axis_scale(const perp_world *world, const perp__world_contact *contact, int32_t axis)
{
    const int32_t bodies[2] = {contact->body_a, contact->body_b};
    double scale = axis == 0 ? fabs(contact->target) : 0.0;
    int32_t side, i;

    for (side = 0; side < 2; side++) {
        const perp__motion *motion = &world->motions[bodies[side]];
        const double *row = contact->rows[side][axis];

        if (world->bodies[bodies[side]].kind == PERP_BODY_DYNAMIC)
            scale += perp__row_norm(motion, row) * motion->strength;
        else
            for (i = 0; i < 6; i++)
                scale += fabs(row[i] * motion->start[i]);
    }
    return scale;
}

double perp__gauge(const perp_world *world, const double *r)
{
    double largest = 0.0;
    int32_t j;

    if (world->edges == 2)
        return fabs(r[0]);
    for (j = 0; j < world->edges; j++) { /* by the sides of the polygon */
        const double *d = world->edge[j], *e = world->edge[(j + 1) % world->edges];
        const double side = (d[0] + e[0]) * r[0] + (d[1] + e[1]) * r[1];

        perp__raise_to(&largest, side / (1.0 + d[0] * e[0] + d[1] * e[1]));
    }
    return largest;
}

double perp__slip(const perp_world *world, const double *u)
{
    double fastest = 0.0;
    int32_t j;

    for (j = 0; j < world->edges; j++)
        perp__raise_to(&fastest, -(world->edge[j][0] * u[0] + world->edge[j][1] * u[1]));
    return fastest;
}

/* 0 beside anything is 0. */
static double beside(double violation, double scale)
{
    return violation == 0.0 ? 0.0 : violation / scale;
}

/* Signorini's law: beside the terms of the contact's own normal velocity. */
static double normal_residual(const perp_world *world, const perp__world_contact *contact,
                              const double *u)
{
    const double excess = u[0] - contact->target;

    if (!(contact->impulse[0] >= 0.0))
        return INFINITY;
    return beside(contact->impulse[0] > 0.0 ? fabs(excess) : fmax(-excess, 0.0),
                  perp__axis_scale(world, contact, 0));
}

/* The impulse that makes a velocity of size `scale` along the tangents. */
static double impulse_of(const perp__world_contact *contact, double scale)
{
    double response = 0.0;
    int32_t side, axis;

    for (side = 0; side < 2; side++)
        for (axis = 1; axis < 3; axis++)
            response += perp__dot6(contact->rows[side][axis], contact->response[side][axis]);
    return response > 0.0 ? scale / response : 0.0;
}

/* Coulomb's law: the cone beside the contact's own normal impulse; no slip inside of it; on it,
 * friction along the edges that oppose the slip most. */
static double friction_residual(const perp_world *world, const perp__world_contact *contact,
                                const double *u)
{
    const double *r = contact->impulse;
    const double most = contact->friction * r[0];
    const double gauge = perp__gauge(world, r + 1);
    const double scale = perp__axis_scale(world, contact, 1) + perp__axis_scale(world, contact, 2);
    const double impulse = most + SMALLEST * impulse_of(contact, scale);
    double largest = beside(fmax(gauge - most, 0.0), most), power = 0.0, slip;
    int32_t i;

    slip = beside(perp__slip(world, u + 1), scale);
    perp__raise_to(&largest, fmin(most < INFINITY ? beside(most - gauge, impulse) : 1.0, slip));
    for (i = 1; i < 3; i++)
        power += beside(r[i], impulse) * beside(u[i], scale);
    perp__raise_to(&largest, beside(gauge, impulse) * slip + power);
    return largest;
}

/* Momentum: velocities are those of the impulses, beside the terms of the body's own. */
static double body_residual(const perp__motion *motion, size_t twist)
{
    double difference[6];

    memcpy(difference, perp__const_twist(motion, twist), sizeof difference);
    perp__add6(difference, -1.0, motion->solved);
    return beside(perp__mass_norm(motion, difference), motion->strength);
}

double perp__own_residual(const perp_world *world, const perp__island *island, size_t twist)
{
    double largest = 0.0;
    int32_t i;

    for (i = 0; i < island->bodies; i++)
        perp__raise_to(&largest, body_residual(perp__island_motion(world, island, i), twist));
    for (i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact =
            perp__island_contact(world, &world->contacts, island, i);
        double u[3];

        perp__relative_velocity(world, contact, twist, u);
        perp__raise_to(&largest, normal_residual(world, contact, u));
        if (contact->edges > 0)
            perp__raise_to(&largest, friction_residual(world, contact, u));
    }
    return largest;
}
