/* Energy and momentum of the dynamic bodies, and what becomes of energy that a step gave. */
#include "world/joints/joints.h"

#include "base/context.h"

/* I w in the world frame. */
static void spin_of(const perp_world *world, int32_t i, const perp__state *state, double *spin)
{
    double R[9], w[3], Iw[3];

    perp__copy3(spin, state->angular_velocity);
    if (perp__is_zero3(spin))
        return;
    perp__rotation_of(world, state, R);
    perp__apply_transposed3(w, R, spin);
    perp__apply3(Iw, world->bodies.all[i].inertia, w);
    perp__apply3(spin, R, Iw);
}

double perp__kinetic_of(const perp_world *world, int32_t i, const perp__state *state,
                        const double *frame)
{
    double spin[3], beside[3];

    spin_of(world, i, state, spin);
    perp__subtract3(beside, state->velocity, frame);
    return 0.5 * (world->bodies.all[i].mass * perp__dot3(beside, beside) +
                  perp__dot3(spin, state->angular_velocity));
}

double perp__energy_lost(const perp_world *world, int32_t i, const double *frame, double *rounding)
{
    const perp__state *from = &world->bodies.states[i], *to = &world->step.next[i];
    const double before = perp__kinetic_of(world, i, from, frame);
    const double after = perp__kinetic_of(world, i, to, frame);
    double shift[6], sum = before + after;

    for (int32_t k = 0; k < 3; k++) {
        shift[k] = to->position[k] - from->position[k] - world->step.length * frame[k];
        shift[3 + k] = world->step.length * world->step.motions[i].moving[3 + k];
        sum += fabs(world->bodies.all[i].mass * world->settings.gravity[k] + from->force[k]) *
                   (fabs(from->position[k]) + fabs(to->position[k])) +
               fabs(from->torque[k]);
    }
    *rounding += PERP__SUM_ROUNDING * sum;
    return before - after - perp__work_needed(world, i, shift);
}

double perp__work_needed(const perp_world *world, int32_t i, const double *shift)
{
    double work = 0.0;

    for (int32_t k = 0; k < 3; k++)
        work -= (world->bodies.all[i].mass * world->settings.gravity[k] +
                 world->bodies.states[i].force[k]) *
                    shift[k] +
                world->bodies.states[i].torque[k] * shift[3 + k];
    return work;
}

double perp__kinetic_beside(const perp_world *world, const perp__island *island, const double *v)
{
    double kinetic = 0.0;

    for (int32_t i = 0; i < island->bodies; i++) {
        const int32_t body = world->islands.body_order[island->first_body + i];
        kinetic += perp__kinetic_of(world, body, &world->step.next[body], v);
    }
    return kinetic;
}

double perp__energy_gained(const perp_world *world, const perp__island *island, double *rounding)
{
    double gained = 0.0, frame[3];

    *rounding = 0.0;
    if (!perp__find_frame(world, island, frame))
        return -INFINITY;
    for (int32_t i = 0; i < island->bodies; i++) {
        const int32_t body = world->islands.body_order[island->first_body + i];

        if (!perp__stays(world, body))
            gained -= perp__energy_lost(world, body, frame, rounding);
    }
    return gained;
}

/* What its turn gave of a body's energy, by an inertia beside its angular velocity, or all that it
 * has by turning; joints settle that otherwise. */
static double turn_gave(const perp_world *world, int32_t body, bool all)
{
    const perp__state *next = &world->step.next[body];
    double spinning = perp__kinetic_of(world, body, next, next->velocity);
    perp__state before = world->bodies.states[body];

    perp__copy3(before.angular_velocity, next->angular_velocity);
    spinning -= all ? 0.0 : perp__kinetic_of(world, body, &before, before.velocity);
    return world->step.roles[body].jointed ? 0.0 : fmax(spinning, 0.0);
}

double perp__take_turns(perp_world *world, const perp__island *island, double given, bool all)
{
    double sum = 0.0, share;

    for (int32_t i = 0; i < island->bodies; i++)
        sum += turn_gave(world, world->islands.body_order[island->first_body + i], all);
    share = fmin(given / sum, 1.0);
    for (int32_t i = 0; i < island->bodies && share > 0.0; i++) {
        const int32_t body = world->islands.body_order[island->first_body + i];
        const double gave = turn_gave(world, body, all), spin = turn_gave(world, body, 1);

        for (int32_t k = 0; k < 3 && gave > 0.0; k++)
            world->step.next[body].angular_velocity[k] *= sqrt(1.0 - share * gave / spin);
    }
    return share < 1.0 ? 0.0 : given - sum;
}

/* What a way did more than that of its mean velocity, to which forces do what kinetic energy says:
 * out of overlap, or where an impact took velocity; or all of it beside the frame. No more than
 * motions may go deep, where to take it back may lead. Returns the energy that it gave. */
static double way_gave(const perp_world *world, int32_t body, const double *frame, double *way)
{
    const double deep = fmax(perp__level_of(world)->deep, PERP__NEAR), h = world->step.length;
    const double most = deep * perp__body_length(world, body);
    const perp__state *from = &world->bodies.states[body], *to = &world->step.next[body];

    memset(way, 0, 6 * sizeof *way);
    for (int32_t k = 0; k < 3; k++)
        way[k] = to->position[k] - from->position[k] -
                 h * (frame ? frame[k] : 0.5 * (from->velocity[k] + to->velocity[k]));
    perp__add3(way, fmin(most / perp__length3(way), 1.0) - 1.0, way);
    return fmax(perp__work_needed(world, body, way), 0.0);
}

/* Takes what the step gave from such ways that gave some, by one share of all. */
static double take_from_ways(perp_world *world, const perp__island *island, double given,
                             const double *frame)
{
    double sum = 0.0, way[6];

    for (int32_t i = 0; i < island->bodies; i++)
        sum += way_gave(world, world->islands.body_order[island->first_body + i], frame, way);
    for (int32_t i = 0; i < island->bodies; i++) {
        const int32_t body = world->islands.body_order[island->first_body + i];

        if (way_gave(world, body, frame, way) > 0.0)
            perp__add3(world->step.next[body].position, -fmin(given / sum, 1.0), way);
    }
    return perp__energy_given(world, island);
}

/* Whether contact i is of a body that the step leaves at rest: its impulses balance. */
static bool rests(const perp_world *world, const perp__island *island, int32_t i)
{
    const int32_t *body = perp__step_flags(world, island, i)->body;
    bool any = 0;

    for (int32_t side = 0; side < 2; side++)
        any |= perp__is_dynamic(world, body[side]) &&
               perp__is_zero3(world->step.next[body[side]].velocity) &&
               perp__is_zero3(world->step.next[body[side]].angular_velocity);
    return any;
}

/* Shifts := what impulses that may give less make of the velocities, all or those of friction. */
static void find_made(perp_world *world, const perp__island *island, int32_t friction)
{
    for (int32_t i = 0; i < island->bodies; i++)
        memset(perp__island_motion(world, island, i)->shift, 0, 6 * sizeof(double));
    for (int32_t i = 0; i < 2 * island->contacts; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i / 2);
        const int32_t body = i % 2 == 0 ? contact->body_a : contact->body_b;
        const double *r = perp__step_response(world, island, i / 2)->impulse;
        perp__motion *motion = &world->step.motions[body];
        double row[6], moment[3] = {0.0}, seen[3];

        if (!perp__is_dynamic(world, body) || rests(world, island, i / 2))
            continue;
        for (int32_t k = friction; k < 3; k++) {
            perp__contact_row(contact, i % 2, k, row);
            perp__add3(motion->shift, r[k] * world->bodies.all[body].inverse_mass, row);
            perp__add3(moment, r[k], row + 3);
        }
        perp__apply_transposed3(seen, motion->rotation, moment);
        perp__apply3(moment, world->bodies.all[body].inverse_inertia, seen);
        perp__apply3(seen, motion->rotation, moment);
        perp__add3(motion->shift + 3, 1.0, seen);
    }
}

/* Impulses give less in one ratio 1 - t, all or those of friction, and where that is not enough
 * ways half of what velocities lose. With d what these make of velocities and g what forces do,
 * energy is less by t d'M (v - g/2) - t^2 d'M d/2. Returns what is left. */
static double take_impulses(perp_world *world, const perp__island *island, double excess,
                            int32_t friction)
{
    const perp__verdict *verdict = &perp__island_motion(world, island, 0)->verdict;
    double frame[3], slope = 0.0, square = 0.0, forced = 0.0, half, t, root;

    /* 1. d, d'M v, d'M d, d'M g */
    (void)perp__find_frame(world, island, frame);
    find_made(world, island, friction);
    for (int32_t i = 0; i < island->bodies; i++) {
        const int32_t body = world->islands.body_order[island->first_body + i];
        const perp__motion *motion = &world->step.motions[body];
        const double *d = motion->shift, mass = world->bodies.all[body].mass;
        perp__state turned = world->step.next[body];
        double spin[3];

        spin_of(world, body, &turned, spin);
        slope += mass * (perp__dot3(d, turned.velocity) - perp__dot3(d, frame)) +
                 perp__dot3(d + 3, spin);
        perp__copy3(turned.angular_velocity, d + 3);
        spin_of(world, body, &turned, spin);
        square += mass * perp__dot3(d, d) + perp__dot3(d + 3, spin);
        forced += mass * (perp__dot3(d, motion->free) -
                          perp__dot3(d, world->bodies.states[body].velocity));
    }

    /* 2. as much as there is of these impulses, and of energy by them */
    half = slope > 0.0 && slope * slope >= 2.0 * square * excess ? 0.0 : 0.5;
    slope -= half * forced;
    root = sqrt(fmax(slope * slope - 2.0 * square * excess, 0.0));
    t = slope > 0.0 ? fmin(fmin(2.0 * excess / (slope + root), slope / square), 1.0) : 0.0;

    /* 3. what is told, ways and velocities */
    for (int32_t i = 0; i < 3 * island->contacts; i++)
        if ((!friction || i % 3 > 0) && !rests(world, island, i / 3))
            perp__step_response(world, island, i / 3)->impulse[i % 3] *= 1.0 - t;
    for (int32_t i = 0; i < island->bodies; i++) {
        const double *d = perp__island_motion(world, island, i)->shift;
        perp__state *next = &world->step.next[world->islands.body_order[island->first_body + i]];

        perp__add3(next->position, -half * world->step.length * t, d);
        perp__add3(next->velocity, -t, d);
        perp__add3(next->angular_velocity, -t, d + 3);
    }
    /* u + t (q - u) misses by t beside what drives it, and by no more than t d */
    if (verdict->swept)
        perp__raise_to(&world->step.scaled,
                       verdict->residual + t * fmin(sqrt(square) / verdict->drive, 1.0));
    return perp__energy_given(world, island);
}

double perp__take_given(perp_world *world, const perp__island *island, double given)
{
    double frame[3];

    given = perp__take_turns(world, island, given, 0);
    if (given > 0.0 && island->joints == 0)
        given = take_from_ways(world, island, given, NULL);
    for (int32_t k = 1; k >= 0 && given > 0.0 && island->joints == 0; k--)
        given = take_impulses(world, island, given, k);
    if (given > 0.0 && island->joints == 0 && perp__find_frame(world, island, frame))
        given = take_from_ways(world, island, given, frame);
    return island->joints == 0 ? perp__take_turns(world, island, given, 1) : given;
}

/* Of all dynamic bodies, where they are asked for. */
static perp_status add_up(const perp_world *world, double *kinetic, double *potential, double *p,
                          double *L)
{
    const double at_rest[3] = {0.0};
    double sums[8] = {0.0};
    perp_status status = perp__world_enter(world);

    if (status != PERP_OK)
        return status;
    for (int32_t i = 0; i < world->bodies.slots; i++) {
        const perp__state *state = &world->bodies.states[i];
        const double mass = world->bodies.all[i].mass;
        double spin[3], orbit[3];

        if (!world->bodies.all[i].alive || !perp__is_dynamic(world, i))
            continue;
        sums[0] += perp__kinetic_of(world, i, state, at_rest);
        sums[1] -= mass * perp__dot3(world->settings.gravity, state->position);
        spin_of(world, i, state, spin);
        perp__cross(orbit, state->position, state->velocity);
        perp__add3(sums + 2, mass, state->velocity);
        perp__add3(sums + 5, mass, orbit);
        perp__add3(sums + 5, 1.0, spin);
    }
    if (kinetic)
        *kinetic = sums[0];
    if (potential)
        *potential = sums[1];
    if (p)
        perp__copy3(p, sums + 2);
    if (L)
        perp__copy3(L, sums + 5);
    return perp__leave(world->context, PERP_OK);
}

perp_status perp_world_energy(const perp_world *world, double *kinetic, double *potential)
{
    return add_up(world, kinetic, potential, NULL, NULL);
}

perp_status perp_world_momentum(const perp_world *world, double *linear, double *angular)
{
    return add_up(world, NULL, NULL, linear, angular);
}
