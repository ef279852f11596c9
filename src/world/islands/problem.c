/* The contact problem of an island: its memory, its bodies, the rows of the contacts that take
 * part, and what its answer makes of bodies and contacts. Bodies are numbered within the island;
 * after them come carriers, which move as they are told (contact.h). */
#include "world/joints/joints.h"
#include "world/islands/contact_rows.h"

#include <string.h>

#include "linalg/spatial.h"

static void lay_out(perp__arena *arena, void *object)
{
    perp_world *world = object;
    perp__island_work *work = &world->work;
    const size_t bodies = (size_t)work->max_bodies, contacts = (size_t)work->max_contacts;
    const size_t numbers = bodies * (size_t)world->dof;

    work->rows = perp__arena_take(arena, contacts, sizeof *work->rows);
    work->factors = perp__arena_take(arena, numbers * (size_t)world->dof, sizeof(double));
    PERP__DOUBLES(arena, numbers, &work->start, &work->gain, &work->now, &work->drift,
                  &work->moving, &work->free, &work->v, &work->solved, &work->still);
    PERP__INTEGERS(arena, bodies, &work->carrier, &work->members);
    work->before = perp__arena_take(arena, bodies, sizeof *work->before);
    work->paths = perp__arena_take(arena, bodies, sizeof *work->paths);
    work->origins = perp__arena_take(arena, 3 * bodies, sizeof(double));
    PERP__INTEGERS(arena, contacts, &work->chosen, &work->modes);
    PERP__DOUBLES(arena, 3 * contacts, &work->impulse, &work->velocity, &work->warm,
                  &work->solved_rows, &work->turning);
    PERP__DOUBLES(arena, contacts, &work->gap, &work->guard, &work->came);
    work->strength = perp__arena_take(arena, bodies, sizeof(double));
    work->stand_forces = perp__arena_take(arena, numbers, sizeof(double));
    PERP__DOUBLES(arena, 3 * contacts, &work->stand_base, &work->stand_r);
    work->stand_values = perp__arena_take(arena, 6 * contacts * (size_t)world->dof, sizeof(double));
    work->stand_units = perp__arena_take(arena, contacts, sizeof *work->stand_units);
    work->stand_links = perp__arena_take(arena, 2 * contacts, sizeof *work->stand_links);
    work->forces = perp__arena_take(arena, 7 * bodies, sizeof(double));
    work->joint_units = perp__arena_take(arena, contacts, sizeof *work->joint_units);
    work->hit = perp__arena_take(arena, contacts, sizeof(int8_t));
}

/* Room for the largest island. Bodies: twice those of its contacts at most count as carriers. */
perp_status perp__fit_island_work(perp_world *world)
{
    perp__island_work *work = &world->work;
    size_t sizes[2];

    for (int32_t i = 0; i < world->island_count; i++) {
        const perp__island *island = &world->islands[i];

        perp__raise_room(&work->max_contacts,
                         island->contacts + PERP__JOINT_UNITS * island->joints);
        perp__raise_room(&work->max_bodies, island->bodies + island->contacts + island->joints);
    }
    sizes[0] = (size_t)work->max_contacts;
    sizes[1] = (size_t)work->max_bodies;
    return perp__arena_fit_sizes(&world->island_arena, world->context, lay_out, world, work->fitted,
                                 sizes, 2);
}

/* A gap that is not told apart from 0 is 0: rounding of coordinates must not move what rests. */
double perp__open_gap(const perp__world_contact *contact, double gap)
{
    return gap > contact->rounding ? gap : 0.0;
}

/* The coordinates of a twist. */
void perp__coordinates_of(const perp_world *world, const double *twist, double *x)
{
    if (world->dof == 6) {
        memcpy(x, twist, 6 * sizeof *x);
        return;
    }
    x[0] = twist[0];
    x[1] = twist[1];
    x[2] = twist[5];
}

void perp__twist_of(const perp_world *world, const double *x, double *twist)
{
    if (world->dof == 6) {
        memcpy(twist, x, 6 * sizeof *x);
        return;
    }
    memset(twist, 0, 6 * sizeof *twist);
    twist[0] = x[0];
    twist[1] = x[1];
    twist[5] = x[2];
}

/* C with M^-1 = C C', row-major. World frame: I^-1 = (R C)(R C)'. */
void perp__write_factor(const perp_world *world, int32_t i, const double *R, double *C)
{
    const perp__body *body = &world->bodies[i];
    const int32_t n = world->dof;
    const double root = sqrt(body->inverse_mass);
    double turned[9];

    if (body->spherical)
        memcpy(turned, body->factor, sizeof turned);
    else
        perp__multiply3(turned, R, body->factor);
    memset(C, 0, (size_t)(n * n) * sizeof *C);
    if (n == 6) {
        C[0] = C[7] = C[14] = root;
        for (int32_t k = 0; k < 9; k++)
            C[6 * (3 + k / 3) + 3 + k % 3] = turned[k];
    } else {
        C[0] = C[4] = root;
        C[8] = turned[8];
    }
}

int32_t perp__number_of(perp_world *world, const perp__island *island, int32_t body)
{
    perp__motion *motion = &world->motions[body];
    perp__island_work *work = &world->work;

    if (perp__is_dynamic(world, body))
        return world->roles[body].local;
    if (world->bodies[body].kind == PERP_BODY_STATIC ||
        (perp__is_zero3(motion->start) && perp__is_zero3(motion->start + 3)))
        return PERP__RIGID_AT_REST;
    if (motion->carrier < 0) {
        const int32_t number = island->bodies + work->carriers++;

        motion->carrier = number;
        work->members[number] = body;
        perp__coordinates_of(world, motion->start, work->now + world->dof * number);
        perp__copy3(work->origins + 3 * number, world->states[body].position);
    }
    return motion->carrier;
}

void perp__forget_number(perp_world *world, int32_t body)
{
    if (world->bodies[body].kind == PERP_BODY_KINEMATIC)
        world->motions[body].carrier = -1;
}

static int32_t touches_carrier(const perp_world *world, const perp__world_contact *contact)
{
    return world->bodies[contact->body_a].kind == PERP_BODY_KINEMATIC ||
           world->bodies[contact->body_b].kind == PERP_BODY_KINEMATIC;
}

/* Bodies and carriers of the island, where they are and how they start. */
void perp__gather_bodies(perp_world *world, const perp__island *island)
{
    perp__island_work *work = &world->work;
    const int32_t n = world->dof;
    int32_t touched = 0;

    for (int32_t i = 0; i < island->bodies; i++) {
        const int32_t body = world->body_order[island->first_body + i];
        const perp__motion *motion = &world->motions[body];
        double free[6];

        work->members[i] = body;
        perp__write_factor(world, body, motion->rotation, work->factors + n * n * i);
        perp__coordinates_of(world, motion->start, work->start + n * i);
        perp__coordinates_of(world, motion->free, free);
        for (int32_t k = 0; k < n; k++) {
            work->now[n * i + k] = work->start[n * i + k];
            work->gain[n * i + k] = free[k] - work->start[n * i + k];
            work->drift[n * i + k] = 0.0;
        }
        perp__copy3(work->origins + 3 * i, world->states[body].position);
    }
    work->carriers = 0;
    for (int32_t i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);

        if (touches_carrier(world, contact)) {
            perp__forget_number(world, contact->body_a);
            perp__forget_number(world, contact->body_b);
            touched = 1;
        }
    }
    perp__number_joint_bodies(world, island, 1);
    perp__number_joint_bodies(world, island, 0);
    for (int32_t i = 0; i < island->contacts && touched; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);

        if (touches_carrier(world, contact)) {
            perp__number_of(world, island, contact->body_a);
            perp__number_of(world, island, contact->body_b);
        }
    }
}

double perp__normal_of(const perp_world *world, int32_t i, const double *x, int32_t bodies,
                       int32_t carried)
{
    const perp__island_work *work = &world->work;
    const perp__rigid_rows *rows = &work->rows[i];
    const int32_t n = world->dof;
    double sum = 0.0;

    for (int32_t side = 0; side < 2; side++) {
        const int32_t body = rows->body[side];
        const double *row = rows->rows[side][0], *v = body < bodies ? x : work->now;

        if (body >= 0 && (body < bodies || carried))
            sum += n == 6 ? perp__dot(row, v + 6 * body, 6) : perp__dot(row, v + 3 * body, 3);
    }
    return sum;
}

/* ---- contacts along the paths of bodies that joints hold ---- */

/* How a contact goes along: turns of both bodies and, of its normal, that which both have in
 * common; before the interval, and up to half of it. */
typedef struct contact_path {
    int32_t late; /* bodies turned before */
    double begun[3][9], normal[9];
    const double *half[2];
    perp__path told[2];
    double slide[2][3]; /* of the point on either body, up to half of it, as the normal sees it */
} contact_path;

/* A contact goes with what is round or stands beside what moves, and between others. */
static double share_of_slide(const perp_world *world, const perp__world_contact *contact,
                             int32_t side)
{
    const perp__shape *own = &world->shapes[side == 0 ? contact->shape_a : contact->shape_b];
    const perp__shape *other = &world->shapes[side == 0 ? contact->shape_b : contact->shape_a];
    const int32_t is_round = own->geometry.radius > 0.0;

    if (is_round || other->geometry.radius > 0.0)
        return is_round ? 0.0 : 1.0;
    if (world->bodies[own->body].kind == PERP_BODY_STATIC ||
        world->bodies[other->body].kind == PERP_BODY_STATIC)
        return world->bodies[own->body].kind == PERP_BODY_STATIC ? 1.0 : 0.0;
    return 0.5;
}

/* Returns 0 where nothing turns. */
static int32_t find_contact_path(const perp_world *world, const perp__world_contact *contact,
                                 contact_path *path)
{
    const perp__island_work *work = &world->work;
    double gone[3][3], turn[3][3], rate[3] = {0.0, 0.0, 0.0};
    int32_t turns = 0;

    path->late = 0;
    for (int32_t side = 0; side < 2; side++) {
        const int32_t body = side == 0 ? contact->body_a : contact->body_b;
        const double *spin = world->motions[body].trial + 3;
        double drift[6] = {0.0};

        if (perp__is_dynamic(world, body))
            perp__twist_of(world, work->drift + world->dof * world->roles[body].local, drift);
        else
            perp__add3(drift + 3, work->gone, spin);
        perp__copy3(gone[side], drift + 3);
        for (int32_t k = 0; k < 3; k++)
            turn[side][k] = 0.5 * work->span * spin[k];
        path->late |= !perp__is_zero3(gone[side]);
        turns |= !perp__is_zero3(turn[side]);
    }
    if (!turns && !path->late)
        return 0;
    perp__common_turn(turn[2], turn[0], turn[1]);
    perp__turn_matrix(path->normal, turn[2]);
    perp__common_turn(gone[2], gone[0], gone[1]);
    for (int32_t k = 0; k < 3 && path->late; k++)
        perp__turn_matrix(path->begun[k], gone[k]);
    for (int32_t side = 0; side < 2; side++) {
        const int32_t body = side == 0 ? contact->body_a : contact->body_b;
        const double sign = side == 0 ? -1.0 : 1.0;
        double now[6], spun[3];

        path->half[side] = perp__path_of(world, body, work->span, &path->told[side])->half;
        perp__twist_now(world, body, now);
        perp__cross(spun, now + 3, contact->arms[side]);
        for (int32_t k = 0; k < 3; k++)
            rate[k] += sign * (now[k] + spun[k]);
    }
    for (int32_t side = 0; side < 2; side++)
        for (int32_t k = 0; k < 3; k++)
            path->slide[side][k] = (side == 0 ? 0.5 : -0.5) * work->span * rate[k] *
                                   share_of_slide(world, contact, side);
    return 1;
}

/* Contacts go along as joints do that are beside them (trial.c): else a joint and a contact on one
 * line contradict each other by as much as all turns. What is round turns below its contact: the
 * radius goes along with the normal. */
static void turn_rows(perp_world *world, const perp__world_contact *contact,
                      const contact_path *path, perp__rigid_rows *rows)
{
    perp__island_work *work = &world->work;
    double *turning = work->turning + 3 * work->count, axes[3][3][3];

    /* 1. axes in the beginning, half-way, and at the end */
    for (int32_t k = 0; k < rows->dim; k++) {
        perp__copy3(axes[0][k], contact->axes[k]);
        if (path->late)
            perp__apply3(axes[0][k], path->begun[2], contact->axes[k]);
        perp__apply3(axes[1][k], path->normal, axes[0][k]);
        perp__apply3(axes[2][k], path->normal, axes[1][k]);
    }
    work->came[work->count] = 0.0;
    for (int32_t side = 0; side < 2; side++) {
        const int32_t body = side == 0 ? contact->body_a : contact->body_b;
        const int32_t shape = side == 0 ? contact->shape_a : contact->shape_b;
        const double sign = side == 0 ? -1.0 : 1.0, *last = world->motions[body].last;
        const double radius = -sign * world->shapes[shape].geometry.radius;
        double core[3][3], now[6], moment[3], seen[3];

        if (rows->body[side] < 0)
            continue;

        /* 2. arms there: to the core of the shape, and on to its surface */
        perp__copy3(core[0], contact->arms[side]);
        perp__add3(core[0], -radius, contact->axes[0]);
        perp__copy3(moment, core[0]);
        if (path->late)
            perp__apply3(core[0], path->begun[side], moment);
        perp__apply3(core[1], path->half[side], core[0]);
        perp__apply3(core[2], path->half[side], core[1]);
        perp__apply3(moment, path->normal, path->slide[side]);
        perp__add3(core[1], 1.0, moment);
        perp__apply3(seen, path->normal, moment);
        perp__add3(core[2], 2.0, seen);
        for (int32_t at = 0; at < 3; at++)
            perp__add3(core[at], radius, axes[at][0]);

        /* 3. rows of the path, as they are seen from its end, and what they are there */
        perp__twist_of(world, work->now + world->dof * rows->body[side], now);
        perp__cross(moment, core[0], axes[0][0]);
        work->came[work->count] +=
            sign * (perp__dot3(axes[0][0], now) + perp__dot3(moment, now + 3));
        for (int32_t k = 0; k < rows->dim; k++) {
            double twist[6] = {0.0};

            perp__cross(moment, core[1], axes[1][k]);
            perp__apply3(seen, path->half[side], moment);
            perp__add3(twist, sign, axes[1][k]);
            perp__add3(twist + 3, sign, seen);
            perp__coordinates_of(world, twist, rows->rows[side][k]);
            perp__cross(moment, core[2], axes[2][k]);
            turning[k] += sign * (perp__dot3(axes[2][k], last) + perp__dot3(moment, last + 3)) -
                          perp__dot(twist, last, 6);
        }
    }
}

/* Rows of the chosen contacts; bias is written for each problem. */
void perp__choose_rows(perp_world *world, const perp__island *island, const int8_t *leaves_out)
{
    perp__island_work *work = &world->work;

    work->count = 0;
    work->set_up = 0;
    for (int32_t i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);
        perp__rigid_rows *rows = &work->rows[work->count];
        contact_path path;

        if (leaves_out && leaves_out[i])
            continue;
        rows->body[0] = perp__number_of(world, island, contact->body_a);
        rows->body[1] = perp__number_of(world, island, contact->body_b);
        rows->dim = contact->friction > 0.0 ? (world->settings.planar ? 2 : 3) : 1;
        rows->bounded = 0;
        memset(rows->bias, 0, sizeof rows->bias);
        memset(rows->compliance, 0, sizeof rows->compliance);
        rows->mu = contact->friction;
        for (int32_t side = 0; side < 2; side++)
            for (int32_t k = 0; k < rows->dim && rows->body[side] >= 0; k++) {
                double twist[6], *row = rows->rows[side][k];

                perp__contact_row(contact, side, k, world->dof == 6 ? row : twist);
                if (world->dof == 3)
                    perp__coordinates_of(world, twist, row);
            }
        work->came[work->count] = perp__normal_of(world, work->count, work->now, island->bodies, 1);
        memset(work->turning + 3 * work->count, 0, 3 * sizeof(double));
        if (island->joints > 0 && find_contact_path(world, contact, &path))
            turn_rows(world, contact, &path, rows);
        perp__copy3(work->warm + 3 * work->count, perp__step_response(world, island, i)->warm);
        work->chosen[work->count++] = i;
    }
    perp__add_joint_rows(world, island);
}

/* The problem of the chosen rows with `free` velocities. */
void perp__pose_island(perp_world *world, const perp__island *island, perp__rigid_problem *problem)
{
    perp__island_work *work = &world->work;
    const perp_world_settings *settings = &world->settings;
    const int32_t n = world->dof;

    memset(problem, 0, sizeof *problem);
    problem->width = n;
    problem->bodies = island->bodies;
    problem->carriers = work->carriers;
    problem->contacts = work->inequalities;
    problem->joints = work->units - work->inequalities;
    problem->factors = work->factors;
    problem->free = work->free;
    for (int32_t i = n * island->bodies; i < n * (island->bodies + work->carriers); i++)
        work->free[i] = work->now[i];
    problem->origins = work->origins;
    problem->rows = work->rows;
    problem->warm = work->warm;
    problem->tol = perp__exact_tol(world);
    problem->method = settings->method;
    problem->cone = settings->planar ? 0 : settings->cone;
    problem->max_iterations = perp__iterations_left(world);
    problem->deadline = perp__island_deadline(world, island);
    problem->again = work->set_up;
}

void perp__receive(perp_world *world, perp__rigid_answer *answer)
{
    perp__island_work *work = &world->work;

    memset(answer, 0, sizeof *answer);
    answer->impulse = work->impulse;
    answer->velocity = work->velocity;
    answer->v = work->v;
    answer->modes = work->modes;
    answer->carrier = work->carrier;
}

void perp__take_answer(perp_world *world, const perp__island *island)
{
    const perp__island_work *work = &world->work;

    for (int32_t i = 0; i < work->count; i++) {
        perp__response *response = perp__step_response(world, island, work->chosen[i]);

        perp__add3(response->impulse, 1.0, work->impulse + 3 * i);
        perp__copy3(response->next, work->impulse + 3 * i);
        response->mode = work->modes[i];
    }
    perp__add_joint_impulses(world, work->impulse + 3 * work->count, 1.0);
}

/* The motion of the step: the ways of its intervals over all of it. */
void perp__mean_motion(perp_world *world, const perp__island *island, double h)
{
    perp__island_work *work = &world->work;

    for (int32_t i = 0; i < world->dof * island->bodies; i++)
        work->moving[i] = work->drift[i] / h;
}

void perp__turn_contacts(perp_world *world)
{
    perp__island_work *work = &world->work;

    for (int32_t i = 0; i < work->count; i++)
        for (int32_t k = 0; k < work->rows[i].dim; k++)
            work->rows[i].bias[k] += work->turning[3 * i + k];
}

void perp__write_velocities(perp_world *world, const perp__island *island)
{
    const perp__island_work *work = &world->work;

    for (int32_t i = 0; i < work->count; i++) {
        const perp__rigid_rows *rows = &work->rows[i];
        double *velocity = perp__step_response(world, island, work->chosen[i])->velocity;

        if (rows->dim < 3 || !perp__is_zero3(work->velocity + 3 * i))
            perp__relative_velocity(world, perp__step_contact(world, island, work->chosen[i]),
                                    PERP__TWIST_AFTER, velocity);
        for (int32_t k = 0; k < rows->dim; k++)
            if (work->velocity[3 * i + k] == 0.0)
                velocity[k] = work->turning[3 * i + k] - rows->bias[k];
    }
}

void perp__write_twists(perp_world *world, const perp__island *island)
{
    const perp__island_work *work = &world->work;
    const int32_t n = world->dof;

    for (int32_t i = 0; i < island->bodies; i++) {
        perp__motion *motion = &world->motions[work->members[i]];

        perp__twist_of(world, work->moving + n * i, motion->moving);
        perp__twist_of(world, work->now + n * i, motion->after);
    }
}

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
