/* Velocities in what the contacts leave free.
 *
 * Let A v = t be the rows that hold: closed normals, sticking tangents. In mass-weighted
 * coordinates y = L^-1 v (M^-1 = L L') the problem's solution is
 *
 *   y = y_0 + (E - Q Q') (L^-1 v_f + L' J_slip' r_slip),    A L y_0 = t,
 *
 * with Q an orthonormal basis of the rows of A L: impulses of the rows that hold lie in its span
 * and drop out, so that no cancellation of large impulses touches the result. Where A L has full
 * rank, v is determined by t alone: 0.0 if t = 0, the rigid motion of what carries the bodies if
 * that is one body, else L y_0. The same holds for a single coordinate that the rows determine.
 *
 * Bodies that bodies already held hold come first, one at a time; then groups. */
#include "world/hold.h"

#include <math.h>
#include <string.h>

#include "linalg/orthogonal.h"
#include "world/spatial.h"

/* Rows of a group of bodies, gathered in the island's workspace. */
typedef struct gathered {
    int32_t rows;
    int32_t columns;
    int32_t root;   /* common to all supports; NONE: several */
    int32_t rooted; /* a support was seen */
} gathered;

static int32_t is_dynamic(const perp_world *world, int32_t body)
{
    return world->bodies[body].kind == PERP_BODY_DYNAMIC;
}

/* A kinematic body at rest is as good as static, and translations with equal velocity are one. */
int32_t perp__root_of(const perp_world *world, int32_t body)
{
    const double *twist = world->motions[body].start;
    int32_t i;

    if (is_dynamic(world, body))
        return world->motions[body].root;
    if (perp__is_zero3(twist) && perp__is_zero3(twist + 3))
        return PERP__ROOT_STATIC;
    if (!perp__is_zero3(twist + 3))
        return body;
    for (i = 0; i < body; i++) {
        const double *other = world->motions[i].start;

        if (world->bodies[i].alive && world->bodies[i].kind == PERP_BODY_KINEMATIC &&
            perp__is_zero3(other + 3) && memcmp(other, twist, 3 * sizeof *twist) == 0)
            return i;
    }
    return body;
}

static int32_t is_held(const perp_world *world, int32_t body)
{
    return !is_dynamic(world, body) || world->motions[body].held;
}

/* Coordinates of L' row, the row of one body in mass-weighted coordinates. */
static void weighted_row(const perp_world *world, const perp__motion *motion, const double *row,
                         double *weighted)
{
    double full[6];
    int32_t i;

    for (i = 0; i < 3; i++)
        full[i] = motion->root_inverse_mass * row[i];
    perp__apply_transposed3(full + 3, motion->factor, row + 3);
    for (i = 0; i < world->dof; i++)
        weighted[i] = full[world->coordinate[i]];
}

static void twist_from_weighted(const perp_world *world, const perp__motion *motion,
                                const double *y, double *twist)
{
    double full[6] = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    int32_t i;

    for (i = 0; i < world->dof; i++)
        full[world->coordinate[i]] = y[i];
    for (i = 0; i < 3; i++)
        twist[i] = motion->root_inverse_mass * full[i];
    perp__apply3(twist + 3, motion->factor, full + 3);
}

static void weighted_twist(const perp_world *world, const perp__motion *motion, const double *twist,
                           double *y)
{
    double full[6];
    int32_t i;

    for (i = 0; i < 3; i++)
        full[i] = motion->root_mass * twist[i];
    perp__apply3(full + 3, motion->inverse_factor, twist + 3);
    for (i = 0; i < world->dof; i++)
        y[i] = full[world->coordinate[i]];
}

/* Appends row `axis` of the contact: columns of group bodies, the motion of others to the right. */
static void add_row(perp_world *world, const perp__world_contact *contact, int32_t axis,
                    int32_t group, size_t twist, gathered *all)
{
    double *row = world->work.held_rows + (size_t)all->rows * (size_t)all->columns;
    const int32_t bodies[2] = {contact->body_a, contact->body_b};
    double target = axis == 0 ? contact->target : 0.0;
    double length = 0.0;
    int32_t side, i;

    memset(row, 0, (size_t)all->columns * sizeof *row);
    for (side = 0; side < 2; side++) {
        const perp__motion *motion = &world->motions[bodies[side]];

        if (is_dynamic(world, bodies[side]) && !motion->held && motion->group == group)
            weighted_row(world, motion, contact->rows[side][axis],
                         row + motion->column * world->dof);
        else
            target -= perp__dot6(contact->rows[side][axis], perp__const_twist(motion, twist));
    }
    for (i = 0; i < all->columns; i++)
        length = hypot(length, row[i]);
    if (length == 0.0)
        return; /* holds nothing, such as the moment of a point's own contact */
    for (i = 0; i < all->columns; i++)
        row[i] /= length;
    world->work.targets[all->rows++] = target / length;
}

static void note_support(const perp_world *world, const perp__world_contact *contact, int32_t other,
                         gathered *all)
{
    int32_t root = perp__root_of(world, other);

    if (contact->target != 0.0)
        root = PERP__ROOT_NONE;
    if (!all->rooted)
        all->root = root;
    else if (all->root != root)
        all->root = PERP__ROOT_NONE;
    all->rooted = 1;
}

/* Takes part: closed, and its other body is held or of the group; counted once. */
static int32_t takes_part(const perp_world *world, const perp__world_contact *contact,
                          const perp__link *link, int32_t group)
{
    int32_t other = link->side == 0 ? contact->body_b : contact->body_a;

    if (!contact->closed)
        return 0;
    if (is_held(world, other))
        return 1;
    return world->motions[other].group == group && link->side == 0;
}

/* All rows that hold the group's bodies: first the normals, then the tangents. */
static void gather(perp_world *world, const int32_t *bodies, int32_t count, int32_t group,
                   size_t twist, gathered *all)
{
    int32_t tangents = world->settings.planar ? 1 : 2;
    int32_t axis, i, j;

    memset(all, 0, sizeof *all);
    all->columns = count * world->dof;
    all->root = PERP__ROOT_NONE;
    for (axis = 0; axis <= tangents; axis++)
        for (i = 0; i < count; i++) {
            const perp__motion *motion = &world->motions[bodies[i]];
            const perp__link *link = world->links + motion->first_link;

            for (j = 0; j < motion->touched; j++, link++) {
                const perp__world_contact *contact = &world->contacts.contacts[link->contact];
                int32_t other = link->side == 0 ? contact->body_b : contact->body_a;

                if (!takes_part(world, contact, link, group) || (axis > 0 && !contact->sticks))
                    continue;
                add_row(world, contact, axis, group, twist, all);
                if (axis == 0 && (is_held(world, other) || contact->target != 0.0))
                    note_support(world, contact, other, all);
            }
        }
}

/* The rigid motion of `root` at a body. */
static void carried_twist(const perp_world *world, int32_t body, int32_t root, double *twist)
{
    const double *carrier;
    double arm[3], turned[3];
    int32_t i;

    memset(twist, 0, 6 * sizeof *twist);
    if (root == PERP__ROOT_STATIC)
        return;
    carrier = world->motions[root].start;
    memcpy(twist, carrier, 6 * sizeof *twist);
    if (perp__is_zero3(carrier + 3))
        return;
    for (i = 0; i < 3; i++)
        arm[i] = world->states[body].position[i] - world->states[root].position[i];
    perp__cross(turned, carrier + 3, arm);
    perp__add3(twist, 1.0, turned);
}

/* Full rank: velocities from the targets alone. */
static void hold_bodies(perp_world *world, const int32_t *bodies, int32_t count, int32_t root,
                        size_t twist)
{
    const double *y = world->work.particular;
    int32_t resting = 1;
    int32_t i;

    for (i = 0; i < count * world->dof; i++)
        resting = resting && y[i] == 0.0;
    if (root == PERP__ROOT_NONE && resting)
        root = PERP__ROOT_STATIC;
    for (i = 0; i < count; i++) {
        perp__motion *motion = &world->motions[bodies[i]];

        if (root == PERP__ROOT_NONE)
            twist_from_weighted(world, motion, y + i * world->dof, perp__twist(motion, twist));
        else
            carried_twist(world, bodies[i], root, perp__twist(motion, twist));
        motion->root = root;
        motion->held = 1;
    }
}

/* Orthonormal basis of the gathered rows; returns 1 if they determine every coordinate. */
static int32_t determine(perp_world *world, const gathered *all, int32_t *rank)
{
    perp__island_work *work = &world->work;

    *rank = perp__orthogonal_rows(work->held_rows, work->targets, work->taken, work->norms,
                                  work->basis, work->particular, all->rows, all->columns);
    return *rank == all->columns;
}

int32_t perp__hold_body(perp_world *world, int32_t body, size_t twist)
{
    perp__motion *motion = &world->motions[body];
    gathered all;
    int32_t rank;

    motion->group = body;
    motion->column = 0;
    gather(world, &body, 1, body, twist, &all);
    if (all.rows >= all.columns && determine(world, &all, &rank))
        hold_bodies(world, &body, 1, all.root, twist);
    motion->group = -1;
    return motion->held;
}

/* L^-1 v_f + L' J_slip' r_slip of one body. */
static void loose_velocity(const perp_world *world, const perp__motion *motion, double *y)
{
    const perp__link *link = world->links + motion->first_link;
    double weighted[PERP__MAX_DOF];
    int32_t i, j, axis;

    weighted_twist(world, motion, motion->free, y);
    for (j = 0; j < motion->touched; j++, link++) {
        const perp__world_contact *contact = &world->contacts.contacts[link->contact];

        if (!contact->closed || contact->sticks)
            continue;
        for (axis = 1; axis < 3; axis++) {
            if (contact->impulse[axis] == 0.0)
                continue;
            weighted_row(world, motion, contact->rows[link->side][axis], weighted);
            for (i = 0; i < world->dof; i++)
                y[i] += contact->impulse[axis] * weighted[i];
        }
    }
}

void perp__hold_group(perp_world *world, const int32_t *bodies, int32_t count, int32_t group,
                      size_t twist)
{
    perp__island_work *work = &world->work;
    gathered all;
    int32_t rank, i;

    gather(world, bodies, count, group, twist, &all);
    if (all.rows == 0) {
        for (i = 0; i < count; i++) {
            perp__motion *motion = &world->motions[bodies[i]];

            memcpy(perp__twist(motion, twist), motion->free, sizeof motion->free);
        }
        return;
    }
    if (determine(world, &all, &rank)) {
        hold_bodies(world, bodies, count, all.root, twist);
        return;
    }
    for (i = 0; i < count; i++)
        loose_velocity(world, &world->motions[bodies[i]], work->loose + i * world->dof);
    perp__project_out(work->basis, rank, all.columns, work->loose);
    for (i = 0; i < all.columns; i++) {
        if (perp__in_span(work->basis, rank, all.columns, i, work->unit))
            work->loose[i] = 0.0;
        work->loose[i] += work->particular[i];
    }
    for (i = 0; i < count; i++)
        twist_from_weighted(world, &world->motions[bodies[i]], work->loose + i * world->dof,
                            perp__twist(&world->motions[bodies[i]], twist));
}
