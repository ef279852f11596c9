/* perp/world.h: any order of adding, removing, setting, stepping, reading and restoring. */
#include <math.h>
#include <string.h>

#include "fuzz.h"

#define BODIES 8
#define CALLS 40

typedef struct scene {
    perp_context *context;
    perp_world *world;
    fuzz_mood mood;
    int planar, timed; /* a reached time limit may give other bits */
    double sharp, tol; /* what is solved is so to `sharp`, or, where a budget ended it, to `tol` */
    int32_t count;
    perp_body bodies[BODIES + 1]; /* the ground is the last */
    double size[BODIES];          /* radius of the smallest ball around the shapes; 0: none */
    int gentle; /* moderate numbers over a static floor through the origin, all started above it,
                   every step so far solved, nobody but gravity pulled */
} scene;

static double gentle_size(fuzz_bytes *bytes)
{
    return 0.25 + fuzz_pick(bytes, 8) * 0.125;
}

static perp_body any_body(fuzz_bytes *bytes, const scene *s)
{
    int32_t k = fuzz_pick(bytes, s->count + 2);

    return k == s->count + 1 ? (perp_body)fuzz_byte(bytes) << 30
           : k == s->count   ? s->bodies[BODIES]
                             : s->bodies[k];
}

/* Sums and differences of x, of which some enclose something. */
static void add_hull(fuzz_bytes *bytes, scene *s, perp_body body, const double *x,
                     const perp_shape_settings *settings)
{
    double points[8][3];
    int32_t i, k, count = fuzz_pick(bytes, 6) + 3;

    for (i = 0; i < count; i++)
        for (k = 0; k < 3; k++)
            points[i][k] = k == 2 && s->planar ? 0.0 : i >> k & 1 ? x[k] : -x[k];
    fuzz_status(s->context, perp_world_add_hull(s->world, NULL, body, points[0], count, settings),
                "add_hull");
}

static void add_shape(fuzz_bytes *bytes, scene *s, perp_body body, double *reach)
{
    perp_shape_settings settings;
    double x[3], radius = s->gentle ? gentle_size(bytes) : fuzz_number(bytes, s->mood);
    int32_t k;

    if (perp_shape_settings_init(&settings, sizeof settings) != PERP_OK)
        fuzz_fail("perp_shape_settings_init takes its own size");
    settings.friction = fuzz_pick(bytes, 9) * 0.125;
    settings.restitution = fuzz_one_in(bytes, 4) ? fuzz_pick(bytes, 5) * 0.25 : 0.0;
    for (k = 0; k < 3; k++)
        x[k] = s->gentle ? gentle_size(bytes) : fuzz_number(bytes, s->mood);
    if (fuzz_one_in(bytes, 4) && !s->gentle)
        fuzz_numbers(bytes, s->mood, settings.offset, 3);
    switch (fuzz_pick(bytes, s->gentle ? 2 : 5)) {
    case 0:
        *reach = fmax(*reach, radius);
        fuzz_status(s->context, perp_world_add_sphere(s->world, NULL, body, radius, &settings),
                    "add_sphere");
        break;
    case 1:
        *reach = fmax(*reach, sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]));
        fuzz_status(s->context, perp_world_add_box(s->world, NULL, body, x, &settings), "add_box");
        break;
    case 2:
        fuzz_status(s->context,
                    perp_world_add_capsule(s->world, NULL, body, radius, fabs(x[0]), &settings),
                    "add_capsule");
        break;
    case 3:
        add_hull(bytes, s, body, x, &settings);
        break;
    default:
        fuzz_status(s->context, perp_world_add_plane(s->world, NULL, body, x, radius, &settings),
                    "add_plane");
    }
}

static void place(fuzz_bytes *bytes, const scene *s, perp_body_settings *settings)
{
    int up = s->planar ? 1 : 2;

    if (s->gentle) { /* above the floor and apart: a column each */
        settings->mass = 0.25 * (1 + fuzz_pick(bytes, 8));
        settings->position[0] = (fuzz_pick(bytes, 7) - 3) * 0.5;
        settings->position[up] = 2.0 + s->count * 2.5;
        settings->velocity[0] = fuzz_pick(bytes, 9) - 4.0;
        settings->velocity[up] = -fuzz_pick(bytes, 8);
        settings->angular_velocity[2] = fuzz_pick(bytes, 5) - 2.0;
    } else {
        settings->kind = fuzz_pick(bytes, 4) % 3;
        settings->mass = fuzz_number(bytes, s->mood);
        settings->inertia[0] = settings->inertia[4] = settings->inertia[8] =
            fuzz_size(bytes, s->mood);
        fuzz_numbers(bytes, s->mood, settings->position, 3);
        fuzz_numbers(bytes, s->mood, settings->velocity, 3);
        fuzz_numbers(bytes, s->mood, settings->angular_velocity, 3);
        settings->angle = fuzz_number(bytes, s->mood);
        if (s->planar)
            settings->position[2] = settings->velocity[2] = settings->angular_velocity[0] =
                settings->angular_velocity[1] = 0.0;
    }
}

static void add_body(fuzz_bytes *bytes, scene *s)
{
    perp_body_settings settings;

    if (s->count == BODIES)
        return;
    if (perp_body_settings_init(&settings, sizeof settings) != PERP_OK)
        fuzz_fail("perp_body_settings_init takes its own size");
    place(bytes, s, &settings);
    if (!fuzz_status(s->context, perp_world_add_body(s->world, &s->bodies[s->count], &settings),
                     "add_body"))
        return;
    s->size[s->count] = 0.0;
    add_shape(bytes, s, s->bodies[s->count], &s->size[s->count]);
    s->count++;
}

static void remove_body(fuzz_bytes *bytes, scene *s)
{
    perp_body body = any_body(bytes, s);
    perp_body_state state;
    int32_t k;

    if (perp_body_state_init(&state, sizeof state) != PERP_OK)
        fuzz_fail("perp_body_state_init takes its own size");
    if (!fuzz_status(s->context, perp_world_remove_body(s->world, body), "remove_body"))
        return;
    if (perp_world_get_body(s->world, &state, body) == PERP_OK)
        fuzz_fail("world: a removed body is refused");
    for (k = 0; k < s->count && s->bodies[k] != body; k++)
        ;
    if (k == s->count)
        fuzz_fail("world: the ground was removed, or a body that was not there");
    s->count--;
    s->bodies[k] = s->bodies[s->count];
    s->size[k] = s->size[s->count];
}

static void set_body(fuzz_bytes *bytes, scene *s)
{
    perp_body body = any_body(bytes, s);
    perp_body_state state;

    if (perp_body_state_init(&state, sizeof state) != PERP_OK)
        fuzz_fail("perp_body_state_init takes its own size");
    if (!fuzz_status(s->context, perp_world_get_body(s->world, &state, body), "get_body"))
        return;
    fuzz_numbers(bytes, s->mood, state.velocity, 3);
    fuzz_numbers(bytes, s->mood, state.force, 3);
    if (fuzz_one_in(bytes, 2))
        fuzz_numbers(bytes, s->mood, state.position, 3);
    if (fuzz_one_in(bytes, 4))
        fuzz_numbers(bytes, s->mood, state.orientation, 4);
    if (fuzz_status(s->context, perp_world_set_body(s->world, &state, body), "set_body"))
        s->gentle = 0;
}

/* What is seen without copies is what is read. */
static void check_slot(const scene *s, const perp_body_state *state, perp_body body)
{
    perp_world_states states;
    int32_t slot = -1;

    if (perp_struct_init(&states, sizeof states) != PERP_OK ||
        perp_world_get_states(s->world, &states) != PERP_OK ||
        perp_world_body_slot(s->world, &slot, body) != PERP_OK || slot < 1 || slot >= states.slots)
        fuzz_fail("world: a body that was added has a slot");
    if (memcmp((const char *)states.position + (size_t)slot * states.pose_stride, state->position,
               sizeof state->position) != 0 ||
        memcmp((const char *)states.velocity + (size_t)slot * states.twist_stride, state->velocity,
               sizeof state->velocity) != 0)
        fuzz_fail("world: slot %d holds another body", slot);
}

/* All bodies, after a step that counts as solved. */
static void check_states(const scene *s)
{
    perp_body_state state;
    int32_t k;

    for (k = 0; k < s->count; k++) {
        if (perp_body_state_init(&state, sizeof state) != PERP_OK ||
            perp_world_get_body(s->world, &state, s->bodies[k]) != PERP_OK)
            fuzz_fail("world: a body that was added can be read");
        fuzz_finite("position", state.position, 3);
        fuzz_finite("orientation", state.orientation, 4);
        fuzz_finite("velocity", state.velocity, 3);
        fuzz_finite("angular_velocity", state.angular_velocity, 3);
        check_slot(s, &state, s->bodies[k]);
        /* The steps' contacts are linearised: a corner that turns may end below the floor, the
         * centre of a body of at least 0.25 may not. */
        if (s->gentle && s->size[k] > 0 && state.position[s->planar ? 1 : 2] < -0.05)
            fuzz_fail("world: body %d of size %g fell through the floor: its centre is at %g", k,
                      s->size[k], state.position[s->planar ? 1 : 2]);
    }
}

/* How fast the bodies of a contact move there: u_n is their difference. */
static double speed_at(const scene *s, const perp_world_contact *c)
{
    const perp_body bodies[2] = {c->body_a, c->body_b};
    double speed = 0.0;
    int32_t side, i;

    for (side = 0; side < 2; side++) {
        perp_body_state state;
        double arm = 0.0, turning = 0.0;

        if (perp_body_state_init(&state, sizeof state) != PERP_OK ||
            perp_world_get_body(s->world, &state, bodies[side]) != PERP_OK)
            fuzz_fail("world: a body that touches can be read");
        for (i = 0; i < 3; i++) {
            speed += fabs(state.velocity[i]);
            arm += fabs(c->position[i] - state.position[i]);
            turning += fabs(state.angular_velocity[i]);
        }
        speed += arm * turning;
    }
    return speed;
}

/* What the impulses of all contacts make of the velocities that meet at c, term by term. Bodies
 * that turn easily make more of them: of their moments the least counts. */
static double push_at(const scene *s, const perp_world_contact *c)
{
    int32_t count = perp_world_contact_count(s->world), k, i, side;
    const perp_body bodies[2] = {c->body_a, c->body_b};
    perp_world_contact other;
    double push = 0.0;

    for (side = 0; side < 2; side++) {
        perp_body_state state;
        double mass = INFINITY, I[9], least, arm = 0.0;

        if (perp_body_state_init(&state, sizeof state) != PERP_OK ||
            perp_world_get_body(s->world, &state, bodies[side]) != PERP_OK ||
            perp_world_get_mass(s->world, &mass, I, bodies[side]) != PERP_OK)
            fuzz_fail("world: a body that touches can be read");
        least = s->planar ? I[8] : fmin(I[0], fmin(I[4], I[8]));
        for (i = 0; i < 3; i++)
            arm += fabs(c->position[i] - state.position[i]);
        for (k = 0; k < count; k++) {
            double force = 0.0, lever = 0.0;

            if (perp_struct_init(&other, sizeof other) != PERP_OK ||
                perp_world_get_contact(s->world, &other, k) != PERP_OK)
                fuzz_fail("world: contact %d of %d can be read", k, count);
            if (other.body_a != bodies[side] && other.body_b != bodies[side])
                continue;
            for (i = 0; i < 3; i++) {
                force += fabs(other.impulse[i]);
                lever += fabs(other.position[i] - state.position[i]);
            }
            push += force * (1.0 / mass + arm * lever / least);
        }
    }
    return push;
}

/* What an answer may leave of a normal velocity that should be 0. Of one to `sharp`: roundings, of
 * the turn into world axes too, beside the speeds. Of one that a budget ended, to a share of the
 * terms of its contact's velocity (docs/world.md): before the impulses it was up to the velocity at
 * the end and what they made of it, and that once more. */
static double leeway(const scene *s, const perp_world_contact *c, double residual)
{
    if (residual <= s->sharp)
        return 1e-9 * speed_at(s, c);
    return s->tol * (speed_at(s, c) + 2.0 * push_at(s, c));
}

/* The laws, contact by contact, for good outcomes: 1e-9 for roundings of the turn into world axes
 * and of sums over the edges of a polyhedral cone. */
static void check_contacts(const scene *s, int good, double residual)
{
    int32_t count = perp_world_contact_count(s->world), k, i;
    perp_world_stats stats;
    perp_world_contact c;

    if (perp_struct_init(&stats, sizeof stats) != PERP_OK ||
        perp_world_get_stats(s->world, &stats) != PERP_OK)
        fuzz_fail("world: statistics can be read");

    for (k = 0; k < count; k++) {
        double slip, most;

        if (perp_struct_init(&c, sizeof c) != PERP_OK ||
            perp_world_get_contact(s->world, &c, k) != PERP_OK)
            fuzz_fail("world: contact %d of %d can be read", k, count);
        if (!good)
            continue;
        fuzz_finite("impulse", c.impulse, 3);
        fuzz_finite("velocity", c.velocity, 3);
        fuzz_finite("normal", c.normal, 3);
        slip = hypot(c.impulse[1], c.impulse[2]);
        most = c.friction * c.impulse[0];
        if (!(c.impulse[0] >= 0) || slip > most * (1 + 1e-9) + 1e-300)
            fuzz_fail("world: contact %d has impulse %g, %g outside of its cone (mu = %g)", k,
                      c.impulse[0], slip, c.friction);
        for (i = 0; i < 3; i++)
            if ((c.mode == PERP_CONTACT_SEPARATE && c.impulse[i] != 0) ||
                (c.mode == PERP_CONTACT_STICK && i > 0 && c.velocity[i] != 0))
                fuzz_fail("world: contact %d is called '%s' with impulse %g, velocity %g", k,
                          perp_contact_mode_text(c.mode), c.impulse[i], c.velocity[i]);
        /* exact zeros are promised where a contact sticks; else u_n is what the solve leaves. Where
         * impacts cut the step, what pressed in one part of it may have opened in another. */
        if (stats.impacts == 0 && c.restitution == 0 && c.impulse[0] > 0 && c.gap <= 0 &&
            fabs(c.velocity[0]) > (c.mode == PERP_CONTACT_STICK ? 0.0 : leeway(s, &c, residual)))
            fuzz_fail("world: contact %d (%s) presses with %g and moves with %g", k,
                      perp_contact_mode_text(c.mode), c.impulse[0], c.velocity[0]);
    }
}

static int step(fuzz_bytes *bytes, scene *s, double dt)
{
    perp_step_result result;
    int good;

    (void)bytes;
    if (perp_struct_init(&result, sizeof result) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    if (!fuzz_status(s->context, perp_world_step(s->world, &result, dt), "step"))
        return 0;
    good = fuzz_good(result.outcome);
    if (!good)
        s->gentle = 0;
    if (good && isnan(result.residual))
        fuzz_fail("world: '%s' with residual nan", perp_outcome_text(result.outcome));
    if (good && !result.advanced)
        fuzz_fail("world: '%s' did not advance", perp_outcome_text(result.outcome));
    if (good)
        check_states(s);
    check_contacts(s, good, result.residual);
    return 1;
}

static void state_bits(const scene *s, double *bits)
{
    perp_body_state state;
    int32_t k;

    for (k = 0; k < s->count; k++) {
        if (perp_body_state_init(&state, sizeof state) != PERP_OK ||
            perp_world_get_body(s->world, &state, s->bodies[k]) != PERP_OK)
            fuzz_fail("world: a body that was added can be read");
        memcpy(&bits[14 * k], state.position, 14 * sizeof *bits);
    }
}

/* Save, step, restore, step: the same bits. */
static void restore(fuzz_bytes *bytes, scene *s)
{
    double *first = fuzz_doubles(14 * BODIES), *second = fuzz_doubles(14 * BODIES);
    double dt = 0.01 * (1 + fuzz_pick(bytes, 4));
    size_t size = 0;
    char *blob;
    int gentle = s->gentle, same;

    if (!fuzz_status(s->context, perp_world_snapshot_size(s->world, &size), "snapshot_size") ||
        size > 100000)
        return;
    blob = fuzz_take((int32_t)size, 1);
    if (!fuzz_status(s->context, perp_world_snapshot_save(s->world, blob, size), "save"))
        return;
    same = step(bytes, s, dt);
    state_bits(s, first);
    s->gentle = gentle;
    if (!fuzz_status(s->context, perp_world_snapshot_restore(s->world, blob, size), "restore"))
        return;
    if (same && !s->timed && step(bytes, s, dt)) {
        state_bits(s, second);
        if (memcmp(first, second, (size_t)(14 * s->count) * sizeof *first) != 0)
            fuzz_fail("world: a restored world continues with the same bits");
    }
    blob[0] = (char)(blob[0] + 1);
    if (fuzz_one_in(bytes, 2) && perp_world_snapshot_restore(s->world, blob, size - 1) == PERP_OK)
        fuzz_fail("world: a snapshot of another size is refused");
}

static void read_all(fuzz_bytes *bytes, scene *s)
{
    perp_world_stats stats;
    perp_world_contact contact;
    double x[9], mass = 0;

    if (perp_struct_init(&stats, sizeof stats) != PERP_OK ||
        perp_struct_init(&contact, sizeof contact) != PERP_OK)
        fuzz_fail("the structs of perp/world.h take their own sizes");
    fuzz_status(s->context, perp_world_get_stats(s->world, &stats), "get_stats");
    fuzz_status(s->context, perp_world_energy(s->world, &x[0], &x[1]), "energy");
    fuzz_status(s->context, perp_world_momentum(s->world, &x[0], &x[3]), "momentum");
    if (fuzz_status(s->context, perp_world_get_mass(s->world, &mass, x, any_body(bytes, s)),
                    "get_mass") &&
        !(mass > 0 && x[8] > 0))
        fuzz_fail("world: a body has mass %g and inertia %g", mass, x[8]);
    fuzz_status(s->context, perp_world_get_contact(s->world, &contact, fuzz_byte(bytes) - 1),
                "get_contact");
    if (stats.bodies < s->count)
        fuzz_fail("world: stats count %d bodies of %d", stats.bodies, s->count);
}

static void make(fuzz_bytes *bytes, scene *s)
{
    static const double levels[] = {1e-2, 1e-3, 1e-6, 1e-10}; /* of accuracy, docs/world.md */
    perp_world_settings settings;
    uint8_t flags = fuzz_byte(bytes);
    double up[3] = {0, 0, 0};

    s->planar = flags & 1;
    s->gentle = (flags & 2) == 0;
    s->mood = s->gentle ? FUZZ_MODERATE : fuzz_mood_of(bytes);
    if (perp_world_settings_init(&settings, sizeof settings, s->planar) != PERP_OK)
        fuzz_fail("perp_world_settings_init takes its own size");
    settings.tol = s->gentle ? settings.tol : fuzz_tol(bytes, settings.tol);
    settings.strict = (flags & 4) != 0;
    if (flags & 8)
        settings.cone = 4 + 2 * fuzz_pick(bytes, 4);
    settings.accuracy = flags >> 6;
    s->sharp = settings.tol > 0.0 ? settings.tol : levels[PERP_ACCURACY_EXACT];
    s->tol = settings.tol > 0.0 ? settings.tol : levels[settings.accuracy];
    if (flags & 16)
        settings.max_iterations = 1 + fuzz_pick(bytes, 50);
    s->timed = (flags & 0x60) == 0x60;
    if (s->timed)
        settings.time_limit = 1e-4;
    if (!fuzz_status(s->context, perp_world_create(s->context, &s->world, &settings), "create"))
        return;
    s->bodies[BODIES] = perp_world_ground(s->world);
    up[s->planar ? 1 : 2] = 1.0;
    if (s->gentle &&
        !fuzz_status(s->context,
                     perp_world_add_plane(s->world, NULL, s->bodies[BODIES], up, 0.0, NULL),
                     "add_plane"))
        s->gentle = 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_bytes bytes = {data, data + size};
    perp_context *context = fuzz_open(&bytes, 1);
    scene s = {0};
    int32_t call;

    s.context = context;
    make(&bytes, &s);
    for (call = 0; s.world && call < CALLS && bytes.at < bytes.end; call++) {
        int mark = fuzz_mark(), what = fuzz_pick(&bytes, 12);

        if (what < 3)
            add_body(&bytes, &s);
        else if (what < 8)
            step(&bytes, &s,
                 s.gentle ? 0.005 * (1 + fuzz_pick(&bytes, 4)) : fuzz_number(&bytes, s.mood));
        else if (what == 8 && !s.gentle)
            set_body(&bytes, &s);
        else if (what == 9)
            remove_body(&bytes, &s);
        else if (what == 10)
            restore(&bytes, &s);
        else
            read_all(&bytes, &s);
        fuzz_drop_to(mark);
    }
    perp_world_destroy(s.world);
    fuzz_close(context);
    return 0;
}
