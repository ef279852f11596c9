/* The question whether an island stands, put to contact/statics anew, or of changed forces. */
#include "world/joints/joints.h"

/* Products of a factorisation up to which this is asked: some .4 s, a heap of 1500 bodies. */
#define MOST_PRODUCTS 2e9

void perp__standing_release(perp__standing *standing)
{
    for (int32_t i = 0; i < PERP__STANDING_KEPT; i++)
        perp__statics_destroy(standing->statics[i]);
    memset(standing, 0, sizeof *standing);
}

/* ---- rows ---- */

double perp__body_length(const perp_world *world, int32_t body)
{
    const double *I = world->bodies.all[body].inertia;

    return sqrt((I[0] + I[4] + I[8]) / world->bodies.all[body].mass);
}

/* The rows of a unit of work from row `from` on, turns over the bodies' lengths. */
static void link_unit(perp_world *world, const perp__island *island, int32_t i, int32_t from,
                      perp__statics_unit *unit, int32_t *links, size_t *at)
{
    perp__island_work *work = &world->solve.work;
    const perp__rigid_rows *rows = &work->rows[i];
    const int32_t n = world->dof, linear = n == 6 ? 3 : 2;

    unit->link = *links;
    for (int32_t side = 0; side < 2; side++) {
        const int32_t body = rows->body[side];
        double *to = work->stand_values + *at, arm;

        if (body < 0 || body >= island->bodies)
            continue;
        arm = 1.0 / perp__body_length(world, work->members[body]);
        work->stand_links[(*links)++] = (perp__statics_link){body, 0, *at};
        for (int32_t k = 0; k < unit->rows; k++)
            for (int32_t j = 0; j < n; j++)
                to[n * k + j] = rows->rows[side][from + k][j] * (j < linear ? 1.0 : arm);
        *at += (size_t)(unit->rows * n);
    }
    unit->links = *links - unit->link;
}

/* Returns 0 where unit i makes its bodies move, whatever the forces. What is open, or what only a
 * motion would bring about, carries nothing. A motor without its speed is a force, all it may. */
static bool write_unit(const perp_world *world, const perp__island *island, int32_t i, bool ignores,
                       perp__statics_unit *unit, int32_t *from)
{
    const perp__island_work *work = &world->solve.work;
    const perp__rigid_rows *rows = &work->rows[i];

    *from = 0;
    unit->rows = rows->dim;
    if (i < work->count) {
        const perp__world_contact *contact = perp__step_contact(world, island, work->chosen[i]);

        unit->kind = PERP__STATICS_CONE;
        unit->mu = rows->mu;
        unit->tangents = rows->dim - 1;
        if (rows->bias[0] * world->step.length >
                (ignores ? 0.0 : perp__closed_gap(world, contact)) ||
            perp__step_flags(world, island, work->chosen[i])->moved)
            unit->rows = unit->tangents = 0;
        return rows->bias[0] >= 0.0;
    }
    if (i >= work->inequalities) {
        unit->kind = PERP__STATICS_FREE; /* and what moves as one keeps what joins it */
        return work->joint_units[i - work->count].slot != PERP__SLOT_MOTOR || rows->bias[0] == 0.0;
    }
    unit->kind = PERP__STATICS_INTERVAL;
    unit->rows = rows->bounded || !(rows->bias[0] > 0.0);
    unit->upper = INFINITY;
    if (rows->bounded) {
        *from = 1;
        unit->upper = -rows->bias[0] / rows->compliance[0];
        unit->lower = -unit->upper;
        if (rows->bias[1] != 0.0 && !ignores)
            unit->lower = unit->upper = copysign(unit->upper, -rows->bias[1]);
        return 1;
    }
    return rows->bias[0] >= 0.0;
}

/* Whether the unit is of something that moves otherwise than what carries. */
static bool is_of_other(const perp_world *world, const perp__island *island,
                        const perp__carrying *carrying, int32_t i)
{
    const int32_t k = i - world->solve.work.count;
    const int32_t *body = k < 0 ? perp__step_flags(world, island, world->solve.work.chosen[i])->body
                                : world->joints.all[world->solve.work.joint_units[k].joint].body;

    return carrying && carrying->parts &&
           ((!perp__is_dynamic(world, body[0]) && !perp__moves_with(world, carrying, body[0])) ||
            (!perp__is_dynamic(world, body[1]) && !perp__moves_with(world, carrying, body[1])));
}

/* Whether unit i is of something that moves, by work.still or as it is told. */
static bool moves(const perp_world *world, const perp__island *island, int32_t i)
{
    const int32_t *body = world->solve.work.rows[i].body, n = world->dof;
    bool any = body[0] >= island->bodies || body[1] >= island->bodies;

    for (int32_t side = 0; side < 2 && !any; side++)
        any = body[side] >= 0 && !perp__is_zero(world->solve.work.still + n * body[side], n);
    return any;
}

bool perp__gather_standing(perp_world *world, const perp__island *island,
                           const perp__carrying *carrying, bool ignores)
{
    const bool partly = carrying && carrying->motion == PERP__CARRIED_PARTLY;
    perp__island_work *work = &world->solve.work;
    perp__statics_rows *rows = &work->stand_rows;
    int32_t links = 0, from;
    size_t at = 0;

    rows->size = 0;
    for (int32_t i = 0; i < work->units; i++) {
        perp__statics_unit *unit = &work->stand_units[i];

        memset(unit, 0, sizeof *unit);
        unit->row = rows->size;
        if (partly && moves(world, island, i))
            continue;
        if (!write_unit(world, island, i, ignores, unit, &from) && !ignores)
            return 0;
        if (is_of_other(world, island, carrying, i)) {
            if (i >= work->count || /* as it moves, it is to open */
                !(work->rows[i].bias[0] +
                      perp__row_velocity(world, i, 0, work->still, island->bodies, 1) >
                  0.0))
                return 0;
            unit->rows = unit->tangents = 0;
        }
        link_unit(world, island, i, from, unit, &links, &at);
        if (unit->links == 0)
            unit->rows = 0;
        rows->size += unit->rows;
    }
    *rows =
        (perp__statics_rows){world->dof, island->bodies,    work->units,       rows->size,
                             links,      work->stand_units, work->stand_links, work->stand_values};
    return 1;
}

/* Impulses of the forces, and what the change to v_carried takes, of each body, turns over its
 * length, from velocities `now` that a time t makes `free`; work.still: v_carried. */
static void find_forces(perp_world *world, const perp__island *island,
                        const perp__carrying *carrying, double t, const double *now,
                        const double *free)
{
    perp__island_work *work = &world->solve.work;
    const int32_t n = world->dof;

    for (int32_t i = 0; i < island->bodies; i++) {
        double twist[6], begun[6], force[6];

        perp__carried_twist(world, carrying, work->members[i], t, twist);
        perp__coordinates_of(world, twist, work->still + n * i);
        perp__twist_of(world, free + n * i, twist);
        perp__twist_of(world, now + n * i, begun);
        perp__find_force(world, carrying, work->members[i], t, begun, twist, force);
        perp__coordinates_of(world, force, work->stand_forces + n * i);
    }
}

/* ---- factors ---- */

/* Four words side by side: each chain's products wait for nothing but its own. */
static void mix(uint64_t *key, const void *data, size_t bytes)
{
    uint64_t words[PERP__STANDING_WORDS], word;

    memcpy(words, key, sizeof words);
    for (size_t at = 0; at < bytes / sizeof word; at++) {
        uint64_t *to = &words[at % PERP__STANDING_WORDS];

        memcpy(&word, (const char *)data + at * sizeof word, sizeof word);
        *to = (*to ^ word) * 0x9E3779B97F4A7C15u;
        *to ^= *to >> 29;
    }
    memcpy(key, words, sizeof words);
}

/* Of the contacts' keys, and what was decided of them. Returns 0 where nothing was, or of others:
 * what pressed is open, what only a motion brings about came, or sweeps take out what is deep. */
static bool find_key(const perp_world *world, const perp__island *island, bool swept, uint64_t *key)
{
    bool any = 0;

    for (int32_t i = 0; i < PERP__STANDING_WORDS; i++)
        key[i] = 0x243F6A8885A308D3u + (uint64_t)i;
    for (int32_t i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);
        perp__contact_flags *flags = perp__step_flags(world, island, i);
        const double *base = perp__step_response(world, island, i)->base;
        uint64_t words[5] = {(uint64_t)(uint32_t)flags->local[0] << 32 | (uint32_t)flags->local[1]};

        if (flags->moved || (swept && flags->deep) ||
            (base[0] > 0.0 && !flags->closed && perp__open_gap(contact, contact->gap) > 0.0))
            return 0;
        any |= base[0] > 0.0;
        if (flags->key == 0) { /* of what its rows are made of, tangents from the normal; never 0 */
            uint64_t k[PERP__STANDING_WORDS] = {1, 2, 3, 4};

            mix(k, (const char *)contact + offsetof(perp__world_contact, arms),
                offsetof(perp__world_contact, axes[1]) - offsetof(perp__world_contact, arms));
            mix(k, &contact->friction, sizeof contact->friction);
            flags->key = (k[0] + 3 * k[1] + 5 * k[2] + 7 * k[3]) | 1;
        }
        words[1] = flags->key;
        memcpy(words + 2, base, 3 * sizeof *base);
        mix(key, words, sizeof words);
    }
    for (int32_t i = 0; i < island->bodies; i++) {
        const double length =
            perp__body_length(world, world->islands.body_order[island->first_body + i]);

        mix(key, &length, sizeof length);
    }
    return any;
}

/* The workspace with this key, or the one that was used longest ago. */
static perp__statics *find_statics(perp_world *world, const uint64_t *key, int32_t *is_known)
{
    perp__standing *standing = world->solve.standing;
    int32_t oldest = 0;

    *is_known = 0;
    for (int32_t i = 0; i < PERP__STANDING_KEPT && !*is_known; i++) {
        *is_known = key && standing->statics[i] &&
                    memcmp(standing->key[i], key, sizeof standing->key[i]) == 0;
        if (*is_known || standing->used[i] < standing->used[oldest])
            oldest = i;
    }
    if (!standing->statics[oldest])
        standing->statics[oldest] = perp__statics_create(world->context);
    standing->used[oldest] = ++standing->clock;
    if (!*is_known)
        memset(standing->key[oldest], 0, sizeof standing->key[oldest]);
    standing->last = oldest;
    return standing->statics[oldest];
}

/* ---- the question ---- */

/* Within what a step may cost: where it has a time limit, decisions that fit in. */
static perp_status set_up(const perp_world *world, perp__statics *statics)
{
    const double seconds = world->step.budget.limited ? world->settings.time_limit : INFINITY;

    return perp__statics_set_up(statics, &world->solve.work.stand_rows,
                                fmin(MOST_PRODUCTS, perp__statics_products(seconds)));
}

/* Adjusts decided impulses to work.stand_forces, by the rows of the contacts, those at hand if they
 * are `posed`, and their factor in the metric of the decision: what had no impulse has none. */
static perp_status adjust(perp_world *world, const perp__island *island, const uint64_t *key,
                          bool posed, perp__statics_answer *answer, int32_t *adjusted)
{
    perp__island_work *work = &world->solve.work;
    int32_t is_known;
    perp__statics *statics = find_statics(world, key, &is_known);
    perp_status status = statics ? PERP_OK : PERP_ERROR_MEMORY;

    *adjusted = 0;
    if (statics && !is_known) {
        if (!posed) {
            perp__gather_bodies(world, island);
            perp__choose_rows(world, island, NULL);
            perp__gather_standing(world, island, NULL, 0);
        }
        for (int32_t i = 0; i < work->count; i++)
            memcpy(work->stand_base + work->stand_units[i].row,
                   perp__step_response(world, island, work->chosen[i])->base,
                   (size_t)work->stand_units[i].rows * sizeof(double));
        status = set_up(world, statics);
        if (status == PERP_OK)
            perp__statics_keep(statics, work->stand_base);
    }
    *adjusted = status == PERP_OK && perp__statics_adjust(statics, answer, work->stand_forces);
    if (*adjusted)
        memcpy(world->solve.standing->key[world->solve.standing->last], key,
               sizeof world->solve.standing->key[0]);
    return status;
}

perp_status perp__stand_as_decided(perp_world *world, const perp__island *island,
                                   const perp__carrying *carrying, bool swept, double *unbalance)
{
    perp__island_work *work = &world->solve.work;
    perp__statics_answer answer = {.r = work->stand_r};
    uint64_t key[PERP__STANDING_WORDS];
    int32_t adjusted, row = 0;
    perp_status status;

    if (!find_key(world, island, swept, key))
        return PERP_OK;
    for (int32_t i = 0; i < island->bodies; i++) {
        const int32_t body = world->islands.body_order[island->first_body + i];
        const perp__motion *motion = &world->step.motions[body];
        double force[6];

        perp__find_force(world, carrying, body, world->step.length, motion->start, motion->free,
                         force);
        perp__coordinates_of(world, force, work->stand_forces + world->dof * i);
    }
    status = adjust(world, island, key, 0, &answer, &adjusted);
    if (!adjusted)
        return status;
    *unbalance = answer.unbalance;
    for (int32_t i = 0; i < island->contacts; i++) {
        const bool rubs = perp__step_flags(world, island, i)->rubs;
        const int32_t rows = !rubs ? 1 : world->settings.planar ? 2 : 3;
        double *next = perp__step_response(world, island, i)->next;

        for (int32_t k = 0; k < 3; k++)
            next[k] = k < rows ? work->stand_r[row + k] : 0.0;
        row += rows;
    }
    return PERP_OK;
}

/* Impulses and velocities of what stands: as it was decided, or as that was adjusted. */
static void take_answer(perp_world *world, const perp__island *island, bool decided)
{
    perp__island_work *work = &world->solve.work;

    for (int32_t i = 0; i < work->units; i++) {
        const perp__statics_unit *unit = &work->stand_units[i];
        const perp__rigid_rows *rows = &work->rows[i];
        double *r = work->impulse + 3 * i;

        if (unit->links == 0) /* as it is */
            continue;
        memset(r, 0, 3 * sizeof *r);
        memset(work->velocity + 3 * i, 0, 3 * sizeof *r);
        for (int32_t k = 0; k < unit->rows; k++)
            r[k + rows->bounded] = work->stand_r[unit->row + k];
        if (rows->bounded)
            r[0] = fabs(unit->upper);
        if (i < work->count || !rows->bounded)
            work->velocity[3 * i] = rows->bias[0];
        for (int32_t k = 0; k < 3 && i < work->count && unit->rows == 0; k++)
            work->velocity[3 * i + k] = NAN; /* its bodies tell it */
        if (i < work->count)
            work->modes[i] = r[0] > 0.0 ? PERP_CONTACT_STICK : PERP_CONTACT_SEPARATE;
        if (i < work->count && decided)
            perp__copy3(perp__step_response(world, island, work->chosen[i])->base, r);
    }
    memcpy(work->v, work->still, (size_t)(world->dof * island->bodies) * sizeof(double));
}

/* Solvers of what falls begin at impulses next to balance. */
static void start_from(perp_world *world, const perp__island *island, perp__statics *statics)
{
    perp__island_work *work = &world->solve.work;

    perp__statics_nearest(statics, work->stand_r);
    for (int32_t i = 0; i < work->count; i++) {
        const perp__statics_unit *unit = &work->stand_units[i];
        double *warm = perp__step_response(world, island, work->chosen[i])->warm;

        for (int32_t k = 0; k < 3; k++)
            work->warm[3 * i + k] = warm[k] = k < unit->rows ? work->stand_r[unit->row + k] : 0.0;
    }
}

/* Of work.stand_rows with work.stand_forces. */
static perp_status decide(perp_world *world, perp__statics_answer *answer, perp__statics **statics)
{
    const perp__statics_aim aim = {PERP_STATICS_INTERIOR, PERP__STATICS_ITERATIONS, 0.0, NULL};
    int32_t is_known;
    perp_status status;

    *statics = find_statics(world, NULL, &is_known);
    status = *statics ? set_up(world, *statics) : PERP_ERROR_MEMORY;
    PERP__THEN(status,
               perp__statics_decide(*statics, answer, world->solve.work.stand_forces, &aim));
    perp__spend(world, answer->iterations);
    return status;
}

perp_status perp__stand(perp_world *world, const perp__island *island,
                        const perp__carrying *carrying, perp__verdict *verdict)
{
    perp__island_work *work = &world->solve.work;
    perp__statics_answer answer = {.r = work->stand_r};
    const int32_t *size = &work->stand_rows.size;
    perp__statics *statics;
    perp__carrying begun;
    const bool begins = !verdict->moves && perp__begins_standing(world, island, 0, &begun);
    perp_status status;

    verdict->stands = 0;
    carrying = carrying ? carrying : &begun;
    if ((carrying == &begun && !begins) || (world->settings.cone != 0 && !world->settings.planar))
        return PERP_OK;
    find_forces(world, island, carrying, work->share * world->step.length, work->now, work->free);
    if (!perp__gather_standing(world, island, carrying, 0) || *size == verdict->asked)
        return PERP_OK;
    status = decide(world, &answer, &statics);
    if (status == PERP_OK && answer.verdict == PERP_STATICS_FALLS && begins)
        start_from(world, island, statics);
    if (status != PERP_OK || answer.verdict != PERP_STATICS_STANDS) {
        verdict->asked = *size;
        return status;
    }
    take_answer(world, island, 1);
    verdict->outcome = perp__worse_outcome(verdict->outcome, PERP_OUTCOME_SOLVED);
    perp__raise_to(&verdict->residual, answer.unbalance);
    verdict->stands = 1;
    verdict->rides = carrying->motion == PERP__CARRIED_ALONG;
    return PERP_OK;
}

/* Change of unit i's velocities, work.v -> work.still, beside the free ones of its bodies, in units
 * of the tested residual: its law lacks no more then. None of what is open, and stays so; INFINITY
 * where that closes it, or parts a joint, faster than forces explain, unless it is `slowly`. */
static double change_of(const perp_world *world, const perp__island *island, int32_t i,
                        int32_t slowly)
{
    const perp__island_work *work = &world->solve.work;
    const perp__rigid_rows *rows = &work->rows[i];
    const int32_t m = island->bodies, n = world->dof;
    const int32_t tested = slowly ? 0 : i >= work->count ? rows->dim : work->impulse[3 * i] > 0.0;
    double change = 0.0, trace = 0.0, drive = 0.0;

    if (i < work->count && work->impulse[3 * i] == 0.0 &&
        perp__row_velocity(world, i, 0, work->still, m, 1) + rows->bias[0] >= 0.0)
        return 0.0;
    for (int32_t k = 0; k < rows->dim; k++) {
        const double by = perp__row_velocity(world, i, k, work->v, m, 1) -
                          perp__row_velocity(world, i, k, work->still, m, 1);

        if (k < tested && fabs(by) > perp__forced_speed(world, island, i, 1))
            return INFINITY;
        change = perp__length2(change, by);
        trace += perp__moved_by(world, island, rows, k);
    }
    for (int32_t k = 0; k < 2 && change > 0.0; k++)
        if (rows->body[k] >= 0 && rows->body[k] < m)
            drive = perp__length2(drive, perp__mass_norm(world, work->members[rows->body[k]],
                                                         work->free + n * rows->body[k]));
    return change > 0.0 ? change / sqrt(trace) / drive : 0.0;
}

/* work.still := work.v, but 0 of what began at rest, `slowly`: and has less than forces make of it;
 * *change: of what moves. Returns whether it can be asked: it changes, and no swept one is deep. */
static bool part(perp_world *world, const perp__island *island, int32_t slowly, bool swept,
                 double *change)
{
    perp__island_work *work = &world->solve.work;
    const int32_t n = world->dof;
    bool may = 0;

    *change = 0.0;
    if (world->settings.cone != 0 && !world->settings.planar) /* statics has the exact one */
        return 0;
    memcpy(work->still, work->v, (size_t)(n * island->bodies) * sizeof(double));
    for (int32_t i = 0; i < island->bodies; i++) {
        if (!perp__is_zero(work->now + n * i, n) ||
            (slowly && !(perp__mass_norm(world, work->members[i], work->v + n * i) <
                         perp__mass_norm(world, work->members[i], work->free + n * i))))
            continue;
        may |= !perp__is_zero(work->v + n * i, n);
        memset(work->still + n * i, 0, (size_t)n * sizeof *work->still);
    }
    for (int32_t i = 0; i < work->units && may; i++)
        if (moves(world, island, i))
            perp__raise_to(change, change_of(world, island, i, slowly));
        else
            may = !swept || i >= work->count || perp__step_flags(world, island, i)->moved ||
                  !perp__is_deep(perp__step_contact(world, island, i));
    return may;
}

/* A key of the rows at hand, and of what was decided; 0 where nothing was, or joints take part. */
static bool find_posed_key(const perp_world *world, const perp__island *island, uint64_t *key)
{
    const perp__island_work *work = &world->solve.work;
    const perp__statics_rows *rows = &work->stand_rows;
    size_t numbers = 0;
    bool any = 0;

    for (int32_t i = 0; i < PERP__STANDING_WORDS; i++)
        key[i] = (uint64_t)rows->nodes << 32 | (uint64_t)i; /* some have no row */
    for (int32_t i = 0; i < work->count; i++) {
        const double *base = perp__step_response(world, island, work->chosen[i])->base;
        const perp__statics_unit *unit = &work->stand_units[i];

        any |= unit->rows > 0 && base[0] > 0.0;
        numbers += (size_t)(unit->rows * unit->links * world->dof);
        mix(key, base, (size_t)unit->rows * sizeof *base);
    }
    mix(key, rows->unit, (size_t)rows->units * sizeof *rows->unit);
    mix(key, rows->link, (size_t)rows->links * sizeof *rows->link);
    mix(key, rows->values, numbers * sizeof *rows->values);
    return any && work->units == work->count;
}

perp_status perp__stand_partly(perp_world *world, const perp__island *island, bool swept,
                               double *residual)
{
    static const perp__carrying partly = {PERP__CARRIED_PARTLY, -1, 0};
    perp__island_work *work = &world->solve.work;
    const int32_t n = world->dof;
    perp__statics_answer answer = {.r = work->stand_r, .verdict = PERP_STATICS_FALLS};
    const double tol = fmax(*residual, swept ? perp__swept_tol(world) : perp__exact_tol(world));
    uint64_t key[PERP__STANDING_WORDS];
    perp__statics *statics;
    int32_t adjusted = 0;
    double change = 0.0;
    perp_status status = PERP_OK;

    for (int32_t slowly = 0; slowly < 2 && answer.verdict != PERP_STATICS_STANDS; slowly++) {
        if (status != PERP_OK || !part(world, island, slowly, swept, &change) || !(change <= tol) ||
            !perp__gather_standing(world, island, &partly, 0))
            continue;
        /* all but their own impulses: M v less J'r of these */
        find_forces(world, island, &partly, 0.0, work->v, work->v);
        for (int32_t i = 0; i < 2 * work->units; i++) {
            const perp__rigid_rows *rows = &work->rows[i / 2];
            const int32_t body = rows->body[i % 2];

            for (int32_t j = 0; j < n && body >= 0 && work->stand_units[i / 2].links > 0; j++)
                for (int32_t k = 0; k < rows->dim; k++)
                    work->stand_forces[n * body + j] -=
                        rows->rows[i % 2][k][j] * work->impulse[3 * (i / 2) + k] *
                        (j < (n == 6 ? 3 : 2)
                             ? 1.0
                             : 1.0 / perp__body_length(world, work->members[body]));
        }
        if (find_posed_key(world, island, key))
            status = adjust(world, island, key, 1, &answer, &adjusted);
        if (adjusted)
            answer.verdict = PERP_STATICS_STANDS;
        else
            PERP__THEN(status, decide(world, &answer, &statics));
    }
    if (status != PERP_OK || answer.verdict != PERP_STATICS_STANDS)
        return status;
    take_answer(world, island, !adjusted);
    perp__raise_to(residual, fmax(answer.unbalance, change));
    for (int32_t i = 0; i < n * island->bodies; i++) /* where it is: to lift it would be work */
        if (perp__is_zero(work->now + i / n * n, n) && perp__is_zero(work->v + i / n * n, n))
            work->moving[i] = 0.0;
    return PERP_OK;
}
