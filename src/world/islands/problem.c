/* The contact problem of an island: its memory, its bodies, the rows of the contacts that take
 * part, and what its answer makes of bodies and contacts. Bodies are numbered within the island;
 * after them come carriers, which move as they are told (contact.h). */
#include "world/joints/joints.h"

static void lay_out(perp__arena *arena, void *object)
{
    perp_world *world = object;
    perp__island_work *work = &world->solve.work;
    const size_t bodies = (size_t)work->max_bodies, contacts = (size_t)work->max_contacts;
    const size_t jointed = (size_t)work->max_jointed, numbers = bodies * (size_t)world->dof;
    const size_t rounds = 1 + (size_t)perp__levels[world->settings.accuracy].rounds;

    work->rows = perp__arena_take(arena, contacts, sizeof *work->rows);
    work->factors = perp__arena_take(arena, numbers * (size_t)world->dof, sizeof(double));
    PERP__DOUBLES(arena, numbers, &work->start, &work->gain, &work->now, &work->drift,
                  &work->moving, &work->free, &work->v, &work->solved, &work->still);
    PERP__INTEGERS(arena, bodies, &work->carrier, &work->members, &work->parts);
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
    work->before = perp__arena_take(arena, jointed, sizeof *work->before);
    work->paths = perp__arena_take(arena, jointed, sizeof *work->paths);
    work->tried = perp__arena_take(arena, PERP__TRIED * rounds * jointed, sizeof(double));
    work->joint_units = perp__arena_take(arena, contacts, sizeof *work->joint_units);
    work->hit = perp__arena_take(arena, contacts, sizeof(int8_t));
}

perp_status perp__fit_work(perp_world *world, int32_t contacts, int32_t bodies, int32_t jointed)
{
    perp__island_work *work = &world->solve.work;

    perp__raise_room(&work->max_contacts, contacts);
    perp__raise_room(&work->max_bodies,
                     bodies < world->bodies.slots ? bodies : world->bodies.slots);
    perp__raise_room(&work->max_jointed, jointed);
    return perp__arena_fit_sizes(
        &world->solve.arena, world->context, lay_out, world, work->fitted,
        (size_t[]){(size_t)work->max_contacts, (size_t)work->max_bodies, (size_t)work->max_jointed},
        3);
}

/* Room for the largest island, with the carriers that its contacts and joints can have. */
perp_status perp__fit_island_work(perp_world *world)
{
    int32_t contacts = 0, bodies = 0, jointed = 0;

    for (int32_t i = 0; i < world->islands.count; i++) {
        const perp__island *island = &world->islands.all[i];

        perp__raise_room(&contacts, island->contacts + PERP__JOINT_UNITS * island->joints);
        perp__raise_room(&bodies, island->bodies + island->contacts + island->joints);
        if (island->joints > 0)
            perp__raise_room(&jointed, island->bodies);
    }
    return perp__fit_work(world, contacts, bodies, jointed);
}

/* A gap that is not told apart from 0 is 0: rounding of coordinates must not move what rests. */
double perp__open_gap(const perp__world_contact *contact, double gap)
{
    return gap > contact->rounding ? gap : 0.0;
}

/* What velocities known to `tol` leave of a gap, beside the overlap that stays, is none either. */
double perp__closed_gap(const perp_world *world, const perp__world_contact *contact)
{
    return fmax(contact->rounding, perp__swept_tol(world) * perp__deep_overlap(contact));
}

/* What is left to close of a gap: none where bodies stand on it. A bounce begins when it closes. */
double perp__left_gap(const perp_world *world, const perp__world_contact *contact)
{
    const double none = contact->start == 0.0 && contact->restitution == 0.0
                            ? perp__closed_gap(world, contact)
                            : contact->rounding;

    return contact->gap > none ? contact->gap : 0.0;
}

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
    const perp__body *body = &world->bodies.all[i];
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
    perp__motion *motion = &world->step.motions[body];
    perp__island_work *work = &world->solve.work;

    if (world->step.roles[body].dynamic)
        return world->step.roles[body].local;
    if (world->bodies.all[body].kind == PERP_BODY_STATIC ||
        (perp__is_zero3(motion->start) && perp__is_zero3(motion->start + 3)))
        return PERP__RIGID_AT_REST;
    if (motion->carrier < 0) {
        const int32_t number = island->bodies + work->carriers++;

        motion->carrier = number;
        work->members[number] = body;
        perp__coordinates_of(world, motion->start, work->now + world->dof * number);
        perp__copy3(work->origins + 3 * number, world->bodies.states[body].position);
    }
    return motion->carrier;
}

void perp__gather_bodies(perp_world *world, const perp__island *island)
{
    perp__island_work *work = &world->solve.work;
    const int32_t n = world->dof, ties = perp__count_ties(island);

    for (int32_t i = 0; i < island->bodies; i++) {
        const int32_t body = world->islands.body_order[island->first_body + i];
        const perp__motion *motion = &world->step.motions[body];
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
        perp__copy3(work->origins + 3 * i, world->bodies.states[body].position);
    }
    work->carriers = 0;
    work->gone = 0.0;
    for (int32_t k = 0; k < ties; k++) {
        const int32_t body = perp__tie(world, island, k);

        if (!world->step.roles[body].dynamic && world->bodies.all[body].kind == PERP_BODY_KINEMATIC)
            world->step.motions[body].carrier = -1;
    }
    if (island->joints > 0)
        (void)perp__join_parts(world, island);
    perp__clear_joints(world, island);
    for (int32_t k = 0; k < ties; k++)
        perp__number_of(world, island, perp__tie(world, island, k));
}

double perp__row_velocity(const perp_world *world, int32_t i, int32_t k, const double *x,
                          int32_t bodies, bool carried)
{
    const perp__island_work *work = &world->solve.work;
    const perp__rigid_rows *rows = &work->rows[i];
    const int32_t n = world->dof;
    double sum = 0.0;

    for (int32_t side = 0; side < 2; side++) {
        const int32_t body = rows->body[side];
        const double *row = rows->rows[side][k], *v = body < bodies ? x : work->now;

        if (body >= 0 && (body < bodies || carried))
            sum += n == 6 ? perp__dot(row, v + 6 * body, 6) : perp__dot(row, v + 3 * body, 3);
    }
    return sum;
}

/* Rows of the chosen contacts; bias is written for each problem. */
void perp__choose_rows(perp_world *world, const perp__island *island, const int8_t *leaves_out)
{
    perp__island_work *work = &world->solve.work;

    work->count = 0;
    work->set_up = 0;
    for (int32_t i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);
        perp__rigid_rows *rows = &work->rows[work->count];
        perp__world_contact now;

        if (leaves_out && leaves_out[i])
            continue;
        if (work->gone > 0.0 && work->span == 0.0 && island->joints == 0) { /* a jump */
            now = *contact;
            perp__meet_now(world, &now, work->gap[i]);
            contact = &now;
        }
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
        work->came[work->count] =
            perp__row_velocity(world, work->count, 0, work->now, island->bodies, 1);
        memset(work->turning + 3 * work->count, 0, 3 * sizeof(double));
        if (island->joints > 0)
            perp__turn_contact(world, island, contact);
        perp__copy3(work->warm + 3 * work->count, perp__step_response(world, island, i)->warm);
        work->chosen[work->count++] = i;
    }
    perp__add_joint_rows(world, island);
}

void perp__pose_island(perp_world *world, const perp__island *island, perp__rigid_problem *problem)
{
    perp__island_work *work = &world->solve.work;
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
    perp__island_work *work = &world->solve.work;

    memset(answer, 0, sizeof *answer);
    answer->impulse = work->impulse;
    answer->velocity = work->velocity;
    answer->v = work->v;
    answer->modes = work->modes;
    answer->carrier = work->carrier;
}

void perp__tell_contact(const perp_world *world, const perp__island *island, int32_t i,
                        double *impulse)
{
    const double *r = world->solve.work.impulse + 3 * i;
    const perp__rigid_rows *rows = &world->solve.work.rows[i];
    const perp__world_contact *contact =
        perp__step_contact(world, island, world->solve.work.chosen[i]);
    const int32_t side = rows->body[1] >= 0;
    double push[3] = {0.0}, twist[6];

    if (island->joints == 0 || perp__is_zero3(r)) {
        perp__copy3(impulse, r);
        return;
    }
    for (int32_t k = 0; k < rows->dim; k++) {
        perp__twist_of(world, rows->rows[side][k], twist);
        perp__add3(push, side == 1 ? r[k] : -r[k], twist);
    }
    perp__apply3(impulse, contact->axes[0], push);
}

void perp__take_answer(perp_world *world, const perp__island *island)
{
    const perp__island_work *work = &world->solve.work;

    for (int32_t i = 0; i < work->count; i++) {
        perp__response *response = perp__step_response(world, island, work->chosen[i]);
        double told[3];

        perp__tell_contact(world, island, i, told);
        perp__add3(response->impulse, 1.0, told);
        perp__copy3(response->next, work->impulse + 3 * i);
        response->mode = work->modes[i];
    }
    perp__add_joint_impulses(world, work->impulse + 3 * work->count, 1.0);
}

void perp__write_velocities(perp_world *world, const perp__island *island)
{
    const perp__island_work *work = &world->solve.work;

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
    const perp__island_work *work = &world->solve.work;
    const int32_t n = world->dof;

    for (int32_t i = 0; i < island->bodies; i++) {
        perp__motion *motion = &world->step.motions[work->members[i]];

        perp__twist_of(world, work->moving + n * i, motion->moving);
        perp__twist_of(world, work->now + n * i, motion->after);
    }
}

/* t1 is the x axis brought into the tangent plane, or the y axis where the normal is close to x;
 * t2 = n x t1: x and y for the normal (0,0,1). Planar: t1 is the normal turned by +90 degrees. */
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
