/* The path of an island through the step, with its impacts where they are.
 *
 * The geometry is frozen, so that a gap goes along gap + t u_n + t^2 a_n / 2 while forces and what
 * presses stay the same. A contact with restitution that would close faster than what forces alone
 * explain is an impact: the island goes to the first one smoothly, as if those were not there; the
 * velocities jump by Moreau's law,
 *
 *   0 <= r_n  perp  u_n+ + e u_n- >= 0    of what touches what is hit,   Coulomb's law of u_t+;
 *
 * and the rest of the step begins there, in which all are hit alike. What presses without impact
 * has velocity -gap / t at the end of its interval, so that it ends touching; where all of it lasts
 * (its normal velocities are 0 at both ends), and between impacts, positions move with the mean of
 * both velocities, which is second order, else with the one at the end.
 *
 * An approach |u_n| <= h |a_n| / (2 n), with at most n impacts a step, is resting contact: bounces
 * end at rest (docs/world.md). */
#include "world/joints/joints.h"

#include "base/groups.h"
#include "step/impact.h"

/* Impacts of a step, by the contacts of each: many where a problem is small, else one. */
#define CONTACTS_IN_ALL 64

/* The least share of restitution that is tried where impacts give energy. */
#define LEAST_SHARE 0.25

/* Time until gap + t u + t^2 a / 2 is 0, going down; INFINITY if it is not reached. */
static double time_to(double gap, double u, double a)
{
    const double inside = u * u - 2.0 * a * gap;

    if (gap == 0.0) /* it is there, or comes back */
        return u < 0.0 ? 0.0 : u > 0.0 && a < 0.0 ? -2.0 * u / a : INFINITY;
    if (!(inside >= 0.0) || !(sqrt(inside) - u > 0.0))
        return INFINITY;
    return 2.0 * gap / (sqrt(inside) - u);
}

double perp__normal_terms(const perp_world *world, int32_t i, const double *x, int32_t bodies)
{
    const perp__rigid_rows *rows = &world->solve.work.rows[i];
    const int32_t n = world->dof;
    double sum = 0.0;

    for (int32_t side = 0; side < 2; side++)
        for (int32_t k = 0; k < n && rows->body[side] >= 0 && rows->body[side] < bodies; k++)
            sum += fabs(rows->rows[side][0][k] * x[n * rows->body[side] + k]);
    return sum;
}

bool perp__lies_on_something(const perp_world *world, const perp__island *island)
{
    for (int32_t i = 0; i < 2 * world->solve.work.count; i++)
        if ((uint32_t)world->solve.work.rows[i / 2].body[i % 2] >= (uint32_t)island->bodies)
            return 1; /* -1: at rest */
    return 0;
}

double perp__forced_speed(const perp_world *world, const perp__island *island, int32_t i, bool lies)
{
    const perp__rigid_rows *rows = &world->solve.work.rows[i];
    const double pressed =
        perp__moved_by(world, island, rows, 0) * world->solve.work.impulse[3 * i];
    double made = 0.0, twist[6];

    for (int32_t side = 0; side < 2 && lies; side++)
        if (rows->body[side] >= 0 && rows->body[side] < island->bodies) {
            perp__twist_of(world, world->solve.work.gain + world->dof * rows->body[side], twist);
            made += perp__length3(twist);
        }
    return fmax(0.5 * fmin(made, pressed),
                fabs(perp__row_velocity(world, i, 0, world->solve.work.gain, island->bodies, 0)));
}

/* Marks contacts that the interval at hand closes, and that are hit in it, beside those that are;
 * returns whether there are any. Which of a face's press is the method's choice: all of them close.
 * slow: the share of a step's change of velocity below which an approach is none. After an impact
 * those without restitution are hit as well: what it throws at them stops there. */
static int32_t find_hits(perp_world *world, const perp__island *island, double h, int32_t impacts,
                         double slow)
{
    perp__island_work *work = &world->solve.work;
    const bool lies = perp__lies_on_something(world, island);
    int32_t i, hits = 0;

    for (i = 0; i < work->count; i++) {
        if (impacts == 0 &&
            !(perp__step_contact(world, island, work->chosen[i])->restitution > 0.0))
            continue;
        const double u = work->came[i];
        const double forced = perp__row_velocity(world, i, 0, work->gain, island->bodies, 0);
        const double speed = sqrt(fmax(u * u - 2.0 * forced / h * work->gap[work->chosen[i]], 0.0));
        const double terms = perp__normal_terms(world, i, work->now, island->bodies);
        const double after = perp__row_velocity(world, i, 0, work->v, island->bodies, 1);

        if ((work->impulse[3 * i] > 0.0 ||
             after + work->rows[i].bias[0] <= perp__exact_tol(world) * terms) &&
            speed > slow * perp__forced_speed(world, island, i, lies) + PERP__NEGLIGIBLE * terms)
            hits += work->hit[work->chosen[i]] = 1;
    }
    return hits;
}

void perp__force_bodies(perp_world *world, const perp__island *island, double share)
{
    perp__island_work *work = &world->solve.work;

    work->share = share;
    for (int32_t i = 0; i < world->dof * island->bodies; i++)
        work->free[i] = work->now[i] + share * work->gain[i];
}

/* Goes on for a time t of the interval `left` that leads from now to v, by the mean velocity, or by
 * that at the interval's end. Velocities have their share of what forces and impulses make of them,
 * also where positions move as if they had all: the rest is that of the time which is left. */
static void go(perp_world *world, const perp__island *island, double t, int32_t mean, double left)
{
    perp__island_work *work = &world->solve.work;
    const int32_t n = world->dof, places = n == 6 ? 3 : n;

    for (int32_t i = 0; i < n * island->bodies; i++) {
        const double v =
            t < left ? work->now[i] + t / left * (work->v[i] - work->now[i]) : work->v[i];

        if (t < left || island->contacts > 0) /* else what joints were placed by */
            work->moving[i] = mean ? 0.5 * (work->now[i] + v) : work->v[i];
        work->now[i] = v;
    }
    /* turns follow each other: where their axes differ the turn of both is not their sum */
    for (int32_t i = 0; i < island->bodies; i++) {
        double *drift = work->drift + n * i, turn[3];
        const double *moving = work->moving + n * i;

        for (int32_t k = 0; k < places; k++)
            drift[k] += t * moving[k];
        for (int32_t k = 0; k < n - places; k++)
            turn[k] = t * moving[3 + k];
        if (n == 6)
            perp__add_turn(drift + 3, turn);
    }
    work->gone += t;
}

/* Whether nothing that presses came in this interval, by velocities known to tol; 0: exactly. */
static bool lasts(const perp_world *world, const perp__island *island, double tol)
{
    const perp__island_work *work = &world->solve.work;

    for (int32_t i = 0; i < work->count; i++) {
        const double way = fmax(work->gap[work->chosen[i]], 0.0) / world->step.length;

        if (!(work->impulse[3 * i] > 0.0) || (way == 0.0 && work->came[i] == 0.0))
            continue;
        const double terms = perp__normal_terms(world, i, work->now, island->bodies) +
                             perp__normal_terms(world, i, work->gain, island->bodies);
        if (way > tol * terms || fabs(work->came[i]) > fmax(PERP__NEGLIGIBLE, tol) * terms)
            return 0;
    }
    return perp__limits_last(world);
}

static double normal_after(const perp_world *world, const perp__island *island, int32_t i)
{
    return perp__row_velocity(world, i, 0, world->solve.work.v, island->bodies, 1) +
           world->solve.work.turning[3 * i];
}

/* The first time at which a marked contact is closed; the way there is from now to `v` at `left`,
 * or v all along: then what leaves and comes back does so at once. */
static double first_impact(const perp_world *world, const perp__island *island, double left,
                           int32_t mean, int32_t *which)
{
    const perp__island_work *work = &world->solve.work;
    double first = INFINITY;

    for (int32_t i = 0; i < work->count; i++) {
        const int32_t k = work->chosen[i];
        const double end = normal_after(world, island, i), u = mean ? work->came[i] : end;
        const double t = work->hit[k] ? time_to(work->gap[k], u, (end - u) / left) : INFINITY;

        if (t < first) {
            first = t;
            *which = k;
        }
    }
    return first;
}

void perp__move_bodies(perp_world *world, const perp__island *island, double tol)
{
    perp__island_work *work = &world->solve.work;
    const bool mean = lasts(world, island, tol);

    if (mean && island->contacts == 0)
        perp__mean_of_ends(world, island);
    else
        for (int32_t i = 0; i < world->dof * island->bodies; i++)
            work->moving[i] = mean ? 0.5 * (work->now[i] + work->v[i]) : work->v[i];
}

bool perp__gives_energy(const perp_world *world, const perp__island *island, int32_t units,
                        double tol)
{
    const perp__island_work *work = &world->solve.work;
    const int32_t n = world->dof;
    double sum = 0.0, size = 0.0; /* half of r'(u- + u+), and of its terms */

    for (int32_t i = 0; i < 2 * units; i++) {
        const perp__rigid_rows *rows = &work->rows[i / 2];
        const int32_t body = rows->body[i % 2], k = i / 2 - work->count;
        const double *ends = body < island->bodies ? work->v : work->now;

        if (body < 0 || (k >= 0 && work->joint_units[k].slot == PERP__SLOT_MOTOR))
            continue;
        for (int32_t j = 0; j < n * rows->dim; j++) {
            const double push =
                0.5 * work->impulse[3 * (i / 2) + j / n] * rows->rows[i % 2][j / n][j % n];
            const double before = work->now[n * body + j % n], after = ends[n * body + j % n];

            sum += push * (before + after);
            size += fabs(push) * (fabs(before) + fabs(after));
        }
    }
    return !(sum <= tol * size);
}

/* None there is, or none that there is time for: what methods leave then may be anything. */
static bool has_no_answer(const perp__verdict *verdict)
{
    return verdict->outcome == PERP_OUTCOME_RAY || verdict->outcome == PERP_OUTCOME_TIME_LIMIT;
}

/* Velocities of the rows at hand, with joints where they are taken to be. */
static perp_status solve_round(perp_world *world, const perp__island *island,
                               perp__verdict *verdict)
{
    perp__island_work *work = &world->solve.work;
    perp_status status = PERP_OK;

    if (work->units == 0) {
        memcpy(work->v, work->free, (size_t)(world->dof * island->bodies) * sizeof *work->v);
        return PERP_OK;
    }
    if (!perp__swings(world, island))
        return perp__solve_rows(world, island, 0, verdict);
    if (work->carriers > 0) /* what hangs still beside what moves, to the last bit */
        status = perp__stand(world, island, NULL, verdict);
    return status == PERP_OK && !verdict->stands ? perp__swing(world, island, verdict) : status;
}

/* Solves an interval of length t from `now`, without the contacts that are left out; work->v are
 * the velocities at its end. Joints are placed by what was found, round after round. */
static perp_status solve_interval(perp_world *world, const perp__island *island,
                                  const int8_t *leaves_out, double t, double h,
                                  perp__verdict *verdict)
{
    const perp__verdict before = *verdict;
    perp__island_work *work = &world->solve.work;
    perp__rounds rounds = {.change = INFINITY, .most = perp__level_of(world)->rounds};
    perp_status status = PERP_OK;
    int32_t units = -1;

    perp__find_limits(world, island, 0.0);
    do {
        *verdict = before;
        perp__place_joints(world, island, t);
        perp__choose_rows(world, island, leaves_out);
        if (work->units == units) /* from the round before */
            memcpy(work->warm, work->impulse, 3 * (size_t)units * sizeof *work->warm);
        units = work->units;
        perp__force_bodies(world, island, t / h);
        for (int32_t i = 0; i < work->count; i++) /* what gaps leave to an interval so long */
            work->rows[i].bias[0] = work->gap[work->chosen[i]] / t;
        perp__time_joints(world, t);
        status = solve_round(world, island, verdict);
        if (status != PERP_OK || has_no_answer(verdict) || island->joints == 0)
            return status;
        perp__move_bodies(world, island, 0.0);
    } while (perp__goes_round(world, island, t, &rounds));
    verdict->rough |= perp__is_rough(&rounds);
    if (perp__swings(world, island) && !verdict->stands)
        perp__end_swing(world, island, t, verdict);
    return PERP_OK;
}

/* Where a body of the island is turned by now. */
static void turned_by_now(const perp_world *world, int32_t i, double *R)
{
    double turn[9];

    perp__turn_matrix(turn, world->solve.work.drift + world->dof * i + 3);
    perp__multiply3(R, turn, world->step.motions[world->solve.work.members[i]].rotation);
}

/* What forces add in a step, at the rate at which they do in the time that is left: the gyroscopic
 * part goes with the angular velocity, which jumped. */
static void renew_gain(perp_world *world, const perp__island *island, double left, double h)
{
    for (int32_t i = 0; i < island->bodies && left > 0.0; i++) {
        const int32_t body = world->solve.work.members[i];
        const double *now = world->solve.work.now + 6 * i;
        double R[9], w[3], torque[3], change[3], turned[3];

        if (world->bodies.all[body].spherical)
            continue;
        turned_by_now(world, i, R);
        perp__apply_transposed3(w, R, now + 3);
        perp__apply_transposed3(torque, R, world->bodies.states[body].torque);
        perp__euler_step(&world->bodies.all[body], left, w, torque, change);
        perp__subtract3(change, change, w);
        perp__apply3(turned, R, change);
        for (int32_t k = 0; k < 3; k++)
            world->solve.work.gain[6 * i + 3 + k] = h / left * turned[k];
    }
}

bool perp__lessens(const perp_world *world, const perp__island *island, double tol,
                   double *restitution)
{
    if (*restitution == 0.0 || !perp__gives_energy(world, island, world->solve.work.count, tol))
        return 0;
    *restitution = *restitution > LEAST_SHARE ? 0.5 * *restitution : 0.0;
    return 1;
}

/* work.hit := what a jump leaves out: contacts that lack more than the first one does, as joints
 * are known to lead there, and gaps to tol; and without joints those that touch apart from what
 * is hit: mere rounding moves there, which the rest of the step stops. */
static void leave_out(perp_world *world, const perp__island *island, double lacking)
{
    const double tol = perp__exact_tol(world) * world->step.length;
    perp__island_work *work = &world->solve.work;
    int32_t *parent = world->islands.parent, hit = -1;

    for (int32_t i = 0; i < island->bodies; i++)
        parent[work->members[i]] = work->members[i];
    for (int32_t i = 0; i < island->contacts; i++) {
        const int32_t *body = perp__step_flags(world, island, i)->body, is_hit = work->hit[i];
        const int32_t one = body[!perp__is_dynamic(world, body[0])];

        work->hit[i] =
            work->gap[i] > lacking + tol * perp__normal_terms(world, i, work->now, island->bodies);
        if (work->hit[i])
            continue;
        perp__join(parent, one, body[perp__is_dynamic(world, body[1])]);
        perp__join(parent, one, is_hit && hit >= 0 ? hit : one);
        hit = is_hit ? one : hit;
    }
    for (int32_t i = 0; i < island->contacts && island->joints == 0 && hit >= 0; i++) {
        const int32_t *body = perp__step_flags(world, island, i)->body;

        work->hit[i] |= perp__root_of(parent, body[!perp__is_dynamic(world, body[0])]) !=
                        perp__root_of(parent, hit);
    }
}

/* The jump of the velocities of what is hit. */
static perp_status jump(perp_world *world, const perp__island *island, double lacking,
                        perp__verdict *verdict)
{
    perp__island_work *work = &world->solve.work;
    double share = 1.0;
    perp_status status;

    leave_out(world, island, lacking);
    perp__find_limits(world, island, 0.0);
    perp__place_joints(world, island, 0.0);
    perp__choose_rows(world, island, work->hit);
    perp__time_joints(world, 0.0);
    perp__force_bodies(world, island, 0.0);
    do {
        for (int32_t i = 0; i < work->count; i++)
            work->rows[i].bias[0] = perp__moreau_shift(
                share * perp__step_contact(world, island, work->chosen[i])->restitution,
                work->came[i]);
        status = perp__solve_rows(world, island, 1, verdict);
    } while (status == PERP_OK && perp__lessens(world, island, perp__exact_tol(world), &share));
    perp__take_answer(world, island);
    memcpy(work->now, work->v, (size_t)(world->dof * island->bodies) * sizeof *work->now);
    perp__aim_joints(world, island);
    return status;
}

/* Goes to the first impact and through it; *left is what remains then. *done is 1 where there is
 * none in this time, and all of it is gone smoothly: what velocities at the end of an interval
 * would close, its way need not. Where nothing stops what is hit, others may be that it kept off;
 * not so with joints, on whose arcs ends of ways do not tell what these pass. */
static perp_status go_to_impact(perp_world *world, const perp__island *island, double *left,
                                double h, double slow, int32_t *done, perp__verdict *verdict)
{
    perp__island_work *work = &world->solve.work;
    int32_t which = -1, mean, passed, i;
    double t, whole, lacking;
    perp_status status;

    perp__aim_joints(world, island);
    for (whole = *left;; whole = t) { /* joints go just there in a second one */
        do {
            status = solve_interval(world, island, work->hit, whole, h, verdict);
            *done = 1;
            if (status != PERP_OK || has_no_answer(verdict))
                return status;
        } while (island->joints == 0 && find_hits(world, island, h, verdict->impacts, slow) > 0);
        mean = verdict->impacts > 0 || lasts(world, island, 0.0);
        for (i = 0; i < work->count; i++)
            perp__tell_contact(world, island, i,
                               perp__step_response(world, island, work->chosen[i])->next);
        passed = work->count;
        perp__choose_rows(world, island, NULL);
        t = fmin(first_impact(world, island, whole, mean, &which), whole);
        if (island->joints == 0 || whole < *left || t == 0.0 || t == whole)
            break;
    }
    *done = !(t < *left);
    perp__add_joint_impulses(world, work->impulse + 3 * passed, t / whole);
    for (i = 0; i < island->contacts; i++)
        if (!work->hit[i])
            perp__add3(perp__step_response(world, island, i)->impulse, t / whole,
                       perp__step_response(world, island, i)->next);
    for (i = 0; i < work->count && !*done; i++) { /* by t times the mean normal velocity */
        double *gap = &work->gap[work->chosen[i]];
        const double end = normal_after(world, island, i), came = work->came[i];

        *gap += t * (mean ? came + 0.5 * t / whole * (end - came) : end);
        *gap = perp__open_gap(perp__step_contact(world, island, work->chosen[i]), *gap);
    }
    go(world, island, t, mean, whole);
    for (i = 0; i < 3 * work->count && *done; i++)
        work->velocity[i] = NAN; /* it was that of fewer rows: bodies tell the velocities */
    if (*done)
        return PERP_OK;
    lacking = fmax(work->gap[which], 0.0);
    work->gap[which] = 0.0;
    *left -= t;
    /* inertia as bodies are turned there, where angular momentum and energy are kept */
    for (i = 0; i < island->bodies; i++) {
        double R[9];

        if (world->bodies.all[work->members[i]].spherical)
            continue;
        turned_by_now(world, i, R);
        perp__write_factor(world, work->members[i], R, work->factors + 36 * i);
    }
    status = jump(world, island, lacking, verdict);
    renew_gain(world, island, *left, h);
    return status;
}

/* Impacts that are left over when their number is spent: the velocities after the step are Moreau's
 * from the same beginning, where contacts touch in the end, or press as others are hit. */
static perp_status end_on_impacts(perp_world *world, const perp__island *island, double left,
                                  perp__verdict *verdict)
{
    perp__island_work *work = &world->solve.work;
    perp_status status = PERP_OK;
    double share = 1.0;
    int32_t came = 1;

    for (int32_t i = 0; i < work->count; i++) {
        const int32_t k = work->chosen[i];
        const double end = work->gap[k] + left * normal_after(world, island, i);

        work->guard[i] = work->came[i];
        work->gap[k] = perp__open_gap(perp__step_contact(world, island, k), end) / left;
    }
    go(world, island, left, 0, left);
    for (int32_t i = 0; i < world->dof * island->bodies; i++) /* the beginning again */
        work->now[i] = work->free[i] - work->share * work->gain[i];
    if (island->joints > 0) { /* which are where these velocities are */
        perp__place_joints(world, island, 0.0);
        perp__choose_rows(world, island, NULL);
        perp__time_joints(world, left);
    }
    while (status == PERP_OK &&
           (came > 0 || perp__lessens(world, island, perp__exact_tol(world), &share))) {
        came = 0;
        for (int32_t i = 0; i < work->count; i++) {
            const int32_t k = work->chosen[i];
            const double e = perp__step_contact(world, island, k)->restitution;
            const bool is_hit = work->gap[k] <= 0.0 || e * work->impulse[3 * i] > 0.0;

            came += is_hit && work->gap[k] > -INFINITY;
            work->gap[k] = is_hit ? -INFINITY : work->gap[k];
            work->rows[i].bias[0] =
                fmax(perp__moreau_shift(share * e, work->guard[i]), work->gap[k]);
        }
        if (came > 0 || share < 1.0)
            status = perp__solve_rows(world, island, 1, verdict);
    }
    memcpy(work->now, work->v, (size_t)(world->dof * island->bodies) * sizeof(double));
    perp__take_answer(world, island);
    return status;
}

perp_status perp__follow_island(perp_world *world, const perp__island *island, double h,
                                perp__verdict *verdict)
{
    const int32_t most = (int32_t)fmax(1.0, CONTACTS_IN_ALL / fmax(1.0, island->contacts));
    perp__island_work *work = &world->solve.work;
    double left = h;
    int32_t done = 0;
    perp_status status;

    /* 1. Nothing has moved yet. */
    perp__gather_bodies(world, island);
    for (int32_t i = 0; i < island->contacts; i++) {
        memset(perp__step_response(world, island, i)->impulse, 0, 3 * sizeof(double));
        work->gap[i] = perp__left_gap(world, perp__step_contact(world, island, i));
    }
    /* 2. From impact to impact, to the interval in which nothing is hit. */
    do {
        status = solve_interval(world, island, NULL, left, h, verdict);
        verdict->stages++;
        if (status != PERP_OK || has_no_answer(verdict))
            return status;
        memset(work->hit, 0, (size_t)island->contacts * sizeof *work->hit);
        if (find_hits(world, island, h, verdict->impacts, 0.5 / most) == 0) {
            perp__take_answer(world, island);
            /* what stands goes as its carrier does, which has its velocity all along */
            go(world, island, left, !verdict->stands && lasts(world, island, 0.0), left);
            /* as if over all of h */
            for (int32_t i = 0; i < 3 * work->count && left > 0.0 && left < h; i++)
                perp__step_response(world, island, work->chosen[i / 3])->next[i % 3] =
                    h / left * work->impulse[i];
            done = 1;
        } else if (verdict->impacts == most) {
            status = end_on_impacts(world, island, left, verdict);
            done = 1;
        } else {
            status = go_to_impact(world, island, &left, h, 0.5 / most, &done, verdict);
            verdict->impacts += !done;
        }
        if (status != PERP_OK || has_no_answer(verdict))
            return status;
    } while (!done);
    /* 3. What the island has come to. */
    for (int32_t i = 0; i < world->dof * island->bodies && verdict->impacts > 0; i++)
        work->moving[i] = work->drift[i] / h; /* else the interval is the step */
    perp__write_twists(world, island);
    perp__write_velocities(world, island);
    return PERP_OK;
}
