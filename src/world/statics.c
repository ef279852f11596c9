/* perp_world_statics: the question of perp/statics.h about a world as it is. Contacts are those
 * that a step would find that is so short that nothing moves visibly; the step is not taken. */
#include "base/check.h"
#include "base/clock.h"
#include "base/context.h"
#include "linalg/matrix.h"
#include "world/joints/joints.h"

typedef struct question {
    perp_world *world;
    perp__statics_aim aim;
    const perp_world_load *loads;
    int32_t load_count;
    perp_world_contact *contacts;
    int32_t capacity, count;
    double *velocities;
    perp_statics_result copy;
    double h;
    int32_t any; /* an island was decided */
} question;

static perp_status check_loads(const question *q)
{
    perp_context *context = q->world->context;
    perp_status status = PERP_OK;

    for (int32_t i = 0; i < q->load_count && status == PERP_OK; i++) {
        const perp_world_load *load = &q->loads[i];
        int32_t slot;

        status =
            perp__struct_check(context, "loads", load, sizeof *load, PERP__FIRST(perp_world_load));
        PERP__THEN(status, perp__find_body(q->world, &slot, load->body));
        PERP__THEN(status, perp__check_vector3(q->world, "load.force", load->force));
        if (status == PERP_OK && !perp__is_finite3(load->torque))
            status = perp__fail(context, PERP_ERROR_NOT_FINITE, "loads[%d].torque is not finite",
                                (int)i);
    }
    return status;
}

/* The forces on a body, and of the loads those alone. */
static void add_forces(const question *q, int32_t body, double *wrench, double *load)
{
    const perp_world *world = q->world;
    const double mass = world->bodies.all[body].mass;

    for (int32_t k = 0; k < 3; k++) {
        wrench[k] = mass * world->settings.gravity[k] + world->bodies.states[body].force[k];
        wrench[3 + k] = world->bodies.states[body].torque[k];
    }
    memset(load, 0, 6 * sizeof *load);
    for (int32_t i = 0; i < q->load_count; i++) {
        int32_t slot;

        if (perp__find_body(world, &slot, q->loads[i].body) != PERP_OK || slot != body)
            continue;
        perp__add3(load, 1.0, q->loads[i].force);
        perp__add3(load + 3, 1.0, q->loads[i].torque);
    }
}

/* Forces and loads as impulses over h, turns over the bodies' lengths. */
static void write_forces(const question *q, const perp__island *island)
{
    perp_world *world = q->world;
    perp__island_work *work = &world->solve.work;
    const int32_t n = world->dof;

    for (int32_t i = 0; i < island->bodies; i++) {
        const double length = perp__body_length(world, work->members[i]);
        double wrench[6], load[6];

        add_forces(q, work->members[i], wrench, load);
        for (int32_t k = 0; k < 6; k++) {
            wrench[k] *= k < 3 ? q->h : q->h / length;
            load[k] *= k < 3 ? q->h : q->h / length;
        }
        perp__coordinates_of(world, wrench, work->stand_forces + n * i);
        perp__coordinates_of(world, load, work->still + n * i);
    }
}

static void write_contacts(question *q, const perp__island *island, bool stands)
{
    perp_world *world = q->world;
    const perp__island_work *work = &world->solve.work;

    for (int32_t i = 0; i < work->count; i++) {
        const perp__statics_unit *unit = &work->stand_units[i];
        perp_world_contact record;

        if (unit->rows == 0)
            continue;
        if (q->count++ >= q->capacity)
            continue;
        perp__write_record(&world->contacts.now,
                           world->islands.contact_order[island->first_contact + work->chosen[i]],
                           &record);
        memset(record.impulse, 0, sizeof record.impulse);
        memset(record.velocity, 0, sizeof record.velocity);
        for (int32_t k = 0; k < unit->rows && stands; k++)
            record.impulse[k] = work->stand_r[unit->row + k] / q->h;
        record.mode = record.impulse[0] > 0.0 ? PERP_CONTACT_STICK : PERP_CONTACT_SEPARATE;
        perp__struct_write(&q->contacts[q->count - 1], &record, sizeof record);
    }
}

static void write_velocities(const question *q, const perp__island *island, const double *v)
{
    const perp_world *world = q->world;

    for (int32_t i = 0; i < island->bodies && q->velocities; i++) {
        const int32_t body = world->solve.work.members[i];
        const double length = perp__body_length(world, body);
        double *twist = q->velocities + 6 * body;

        perp__twist_of(world, v + world->dof * i, twist);
        for (int32_t k = 3; k < 6; k++)
            twist[k] /= length;
    }
}

/* What of the whole world is known with one part more. */
static void take_in(question *q, const perp__statics_answer *answer)
{
    perp_statics_result *copy = &q->copy;

    if (answer->verdict == PERP_STATICS_FALLS && copy->verdict != PERP_STATICS_FALLS)
        copy->work = answer->work / q->h;
    if (answer->verdict != PERP_STATICS_STANDS && copy->verdict != PERP_STATICS_FALLS)
        copy->verdict = answer->verdict;
    copy->margin = fmin(copy->margin, answer->margin);
    copy->safety = fmin(copy->safety, answer->safety); /* NaN: has no part of the load */
    copy->unbalance = fmax(copy->unbalance, answer->unbalance);
    copy->iterations += answer->iterations;
    q->any = 1;
}

static perp_status decide(question *q, const perp__island *island)
{
    perp_world *world = q->world;
    perp__island_work *work = &world->solve.work;
    perp__statics_aim aim = q->aim;
    perp__statics_answer answer = {0};
    perp__statics *statics;
    perp_status status = perp__find_spare_rows(world, island);

    if (status != PERP_OK)
        return status;

    /* 1. Rows where the bodies are. */
    if (island->joints > 0)
        perp__begin_joints(world, island, q->h, 0);
    perp__gather_bodies(world, island);
    perp__find_limits(world, island, 0.0);
    perp__place_joints(world, island, 0.0);
    perp__choose_rows(world, island, NULL);
    perp__close_gaps(world, island, q->h);
    perp__time_joints(world, q->h);
    perp__gather_standing(world, island, NULL, 1);
    write_forces(q, island);

    /* 2. The decision. */
    aim.load = perp__is_zero(work->still, world->dof * island->bodies) ? NULL : work->still;
    answer.r = work->stand_r;
    answer.v = work->solved;
    statics = perp__statics_create(world->context);
    status = statics ? perp__statics_set_up(statics, &work->stand_rows, 0.0) : PERP_ERROR_MEMORY;
    PERP__THEN(status, perp__statics_decide(statics, &answer, work->stand_forces, &aim));
    perp__statics_destroy(statics);
    if (status != PERP_OK)
        return status;

    /* 3. What it says of the world. */
    write_contacts(q, island, answer.verdict == PERP_STATICS_STANDS);
    if (answer.verdict == PERP_STATICS_FALLS && q->copy.verdict != PERP_STATICS_FALLS)
        write_velocities(q, island, answer.v);
    take_in(q, &answer);
    return PERP_OK;
}

/* A body that touches nothing falls along its force, if there is one. */
static void let_fall(question *q, int32_t body)
{
    perp__statics_answer answer = {.margin = -INFINITY, .safety = NAN};
    double wrench[6], load[6], most;

    add_forces(q, body, wrench, load);
    for (int32_t k = 0; k < 6; k++)
        wrench[k] += load[k];
    most = perp__largest(wrench, 6);
    if (most == 0.0)
        return;
    answer.verdict = PERP_STATICS_FALLS;
    answer.work = q->h * perp__dot(wrench, wrench, 6) / most;
    for (int32_t k = 0; k < 6 && q->velocities && q->copy.verdict != PERP_STATICS_FALLS; k++)
        q->velocities[6 * body + k] = wrench[k] / most;
    take_in(q, &answer);
}

static perp_status ask(question *q)
{
    perp_world *world = q->world;
    perp__solve_summary summary;
    double least = INFINITY;
    perp_status status;

    /* 1. Contacts of a step in which nothing gets far, and islands, without the step. */
    for (int32_t i = 0; i < world->bodies.slots; i++) {
        const double length = world->bodies.all[i].radius;
        double wrench[6], load[6], force;

        if (!world->bodies.all[i].alive || !perp__is_dynamic(world, i))
            continue;
        add_forces(q, i, wrench, load);
        force = perp__length3(wrench) + perp__length3(load);
        if (force > 0.0 && length > 0.0)
            least = fmin(least, sqrt(length * world->bodies.all[i].mass / force));
    }
    q->h = least < INFINITY ? sqrt(PERP__NEGLIGIBLE) * least : 1.0;
    perp__rouse_all(world);
    perp__open_budget(world);
    do
        status = perp__find_step_contacts(world, q->h, &summary);
    while (status == PERP_OK && world->sleep.awake_changed);
    PERP__THEN(status, perp__build_islands(world, &world->contacts.now, 0));
    PERP__THEN(status, perp__fit_island_work(world));
    if (status != PERP_OK)
        return status;
    /* 2. The decisions. */
    q->copy.margin = q->copy.safety = INFINITY;
    if (q->velocities)
        memset(q->velocities, 0, 6 * (size_t)world->bodies.slots * sizeof *q->velocities);
    for (int32_t i = 0; i < world->islands.count && status == PERP_OK; i++)
        status = decide(q, &world->islands.all[i]);
    for (int32_t i = 0; i < world->bodies.slots && status == PERP_OK; i++)
        if (world->bodies.all[i].alive && perp__is_dynamic(world, i) &&
            world->step.roles[i].island < 0)
            let_fall(q, i);
    if (!q->any)
        q->copy.margin = 1.0; /* nothing that could fall */
    if (q->load_count == 0 || !q->any)
        q->copy.safety = NAN;
    return status;
}

perp_status perp_world_statics(perp_world *world, perp_world_contact *contacts, int32_t capacity,
                               int32_t *count, double *velocities, perp_statics_result *result,
                               const perp_statics_settings *settings, const perp_world_load *loads,
                               int32_t load_count)
{
    const double started = perp__now();
    question q = {.world = world,
                  .loads = loads,
                  .load_count = load_count,
                  .contacts = contacts,
                  .capacity = contacts ? capacity : 0,
                  .velocities = velocities};
    perp_status status = perp__world_enter(world);

    if (status != PERP_OK)
        return status;
    status = PERP__CHECK(perp_statics_result, world->context, result);
    PERP__THEN(status, perp__statics_read_settings(world->context, &q.aim, settings));
    if (status == PERP_OK && (capacity < 0 || load_count < 0))
        status = perp__refuse(world->context, "%s is %d, expected 0 or more",
                              capacity < 0 ? "capacity" : "load_count",
                              (int)(capacity < 0 ? capacity : load_count));
    if (status == PERP_OK && load_count > 0)
        status = perp__check_pointer(world->context, "loads", loads);
    for (int32_t i = 0; i < q.capacity && status == PERP_OK; i++)
        status = PERP__CHECK(perp_world_contact, world->context, &contacts[i]);
    PERP__THEN(status, check_loads(&q));
    PERP__THEN(status, ask(&q));
    if (status == PERP_OK) {
        q.copy.seconds = perp__now() - started;
        perp__struct_write(result, &q.copy, sizeof q.copy);
        if (count)
            *count = q.count;
    }
    return perp__leave(world->context, status);
}
