/* Where joints are in a step, round after round.
 *
 * Bodies go from q0 with the mean of both ends' velocities, as they see it: x by t (v0 + v1)/2, R
 * by exp(t (W0 + W1)/2), W = R'w. On that path
 *
 *   I (W1 - W0) + t Wm x I Wm = t torque + J'r,   Wm = (W0 + W1)/2,   the implicit midpoint rule,
 *
 * with the rows J of the whole path (rows.c). What only swings on its joints asks J (v0 + v1) = 0:
 * impulses do no work then, whatever path J is that of, and joints stay closed where it is the one
 * that is gone (swing.c). Where contacts, limits, motors or friction act as well, velocities are to
 * obey them at the end: J v1 + (J1 - J) v1* = 0 with v1* of the round before.
 *
 * That gives no energy as far as its path is known. Where it is not, the step is rough and taken in
 * parts (adaptive.c); where these cannot be J(q0) serves for all, which is of first order.
 *
 * Paths and Wm are those of the round before, to begin with those of v0, or what all rounds so far
 * tell of them. Two rounds are second order. Numbers of angular velocities are w1 = R1 W1, with R1
 * of the path at hand. */
#include "world/joints/joints.h"

#include <float.h>

#include "linalg/matrix.h"

/* Change of the motion, in radians and sizes, that ends rounds of what swings, to keep its energy;
 * of other motions, known to the exact tol, that is enough. */
#define SETTLED 1e-14
#define EXTRA_ROUNDS 3 /* for limits that are reached on the way */
#define ENOUGH 0.5     /* what a round may leave of the last one's change; two are second order */

/* Of turn_of, a quarter of a pendulum's angle: too much for geometry that is frozen; and as much of
 * an angle is too much to be unsure of when rounds end. */
#define FAR 0.25

/* At a time t after the interval at hand began. */
static void pose_along(const perp_world *world, int32_t body, double t, perp__placement *pose)
{
    const perp__motion *motion = &world->step.motions[body];
    const bool moves = perp__is_dynamic(world, body);
    perp__state state = world->bodies.states[body];
    double drift[6] = {0.0}, turn[3];

    if (moves)
        perp__twist_of(world, world->solve.work.drift + world->dof * world->step.roles[body].local,
                       drift);
    else
        t += world->solve.work.gone;
    perp__add3(state.position, 1.0, drift);
    perp__add3(state.position, t, motion->trial);
    for (int32_t k = 0; k < 3; k++)
        turn[k] = t * motion->trial[3 + k];
    perp__turn(world, &state, 1.0, drift + 3);
    perp__turn(world, &state, t, motion->trial + 3);
    perp__copy3(pose->position, state.position);
    if (perp__is_zero3(drift + 3) && perp__is_zero3(turn))
        memcpy(pose->rotation, motion->rotation, sizeof pose->rotation);
    else
        perp__rotation_of(world, &state, pose->rotation);
}

void perp__common_turn(double *turn, const double *a, const double *b)
{
    double d[3], square;

    perp__subtract3(d, b, a);
    square = perp__dot3(d, d);
    perp__copy3(turn, a);
    if (square > 0.0)
        perp__add3(turn, fmin(fmax(-perp__dot3(a, d) / square, 0.0), 1.0), d);
}

/* For a time t along the trial motion. The mean turn is that of exp(s u) over s in (0,1),
 *   E = 1 + (1 - cos a) / a^2 [u]x + (a - sin a) / a^3 [u]x^2,   a = |u|;
 * where a does not show beside 1 its first two terms are all. */
static void path_along(const perp_world *world, int32_t body, double t, perp__path *path)
{
    const double *spin = world->step.motions[body].trial + 3;
    const double u[3] = {t * spin[0], t * spin[1], t * spin[2]};
    const double a = perp__length3(u), s = sin(0.5 * a) / a;
    const bool small = a < 0x1p-27;
    const double first = small ? 0.5 : 2.0 * s * s;
    const double second = small ? 0.0 : (a - sin(a)) / a / a / a;

    pose_along(world, body, t, &path->to);
    path->from = path->to;
    memset(path->mean, 0, sizeof path->mean);
    path->mean[0] = path->mean[4] = path->mean[8] = 1.0;
    memcpy(path->turn, path->mean, sizeof path->turn);
    memcpy(path->half, path->mean, sizeof path->half);
    path->stays = 1;
    if (t == 0.0 || (perp__is_zero3(spin) && perp__is_zero3(world->step.motions[body].trial)))
        return;
    path->stays = 0;
    pose_along(world, body, 0.0, &path->from);
    for (int32_t i = 0; i < 3; i++)
        for (int32_t j = 0; j < 3; j++)
            path->mean[3 * i + j] = second * (u[i] * u[j] - (i == j ? a * a : 0.0)) + (i == j);
    for (int32_t i = 0; i < 3; i++) {
        const int32_t j = (i + 1) % 3, k = (i + 2) % 3;

        path->mean[3 * k + j] += first * u[i];
        path->mean[3 * j + k] -= first * u[i];
    }
    perp__multiply_transposed3(path->turn, path->to.rotation, path->from.rotation);
    perp__turn_matrix(path->half, (const double[3]){0.5 * u[0], 0.5 * u[1], 0.5 * u[2]});
}

void perp__twist_now(const perp_world *world, int32_t body, double *twist)
{
    const perp__motion *motion = &world->step.motions[body];

    if (perp__is_dynamic(world, body))
        perp__twist_of(world, world->solve.work.now + world->dof * world->step.roles[body].local,
                       twist);
    else
        memcpy(twist, motion->start, sizeof motion->start);
}

/* M of the end of an interval of length t, and the velocity that forces alone would give then, as
 * what they add in a step: I (W1 - W0) = t (mean torque - Wm x I Wm), seen from the end. */
static void turn_mass(perp_world *world, int32_t body, double t)
{
    const perp__body *of = &world->bodies.all[body];
    const int32_t n = world->dof, i = world->step.roles[body].local;
    perp__island_work *work = &world->solve.work;
    const perp__path *path = &work->paths[i];
    double now[6], gain[6], W[3], torque[3], momentum[3], push[3], seen[3];

    if (!of->spherical)
        perp__write_factor(world, body, path->to.rotation, work->factors + n * n * i);
    if (t == 0.0 || n == 3)
        return;
    perp__twist_now(world, body, now);
    perp__twist_of(world, work->gain + n * i, gain);
    perp__apply_transposed3(W, path->from.rotation, world->step.motions[body].trial + 3);
    perp__apply3(momentum, of->inertia, W);
    perp__cross(push, momentum, W);
    perp__apply3(seen, path->mean, world->bodies.states[body].torque);
    perp__apply_transposed3(torque, path->to.rotation, seen);
    perp__add3(push, 1.0, torque);
    perp__apply3(W, of->inverse_inertia, push);
    perp__apply3(push, path->to.rotation, W);
    perp__apply3(seen, path->turn, now + 3);
    for (int32_t k = 0; k < 3; k++)
        gain[3 + k] = work->length * (push[k] + (seen[k] - now[3 + k]) / t);
    perp__coordinates_of(world, gain, work->gain + n * i);
}

/* A joint that has limits, but for its equations, at a time along the trial motion. */
static bool view_there(const perp_world *world, const perp__joint *joint, double t,
                       perp__joint_view *view)
{
    const perp__joint_state *state = perp__state_of(world, joint);
    perp__placement places[2];

    if (!(state->lower > -INFINITY || state->upper < INFINITY))
        return 0;
    for (int32_t side = 0; side < 2; side++)
        pose_along(world, joint->body[side], t, &places[side]);
    perp__view_placed(world, joint, state->coordinate, places, 0, view);
    return 1;
}

void perp__find_paths(perp_world *world, const perp__island *island, double t)
{
    for (int32_t i = 0; i < island->bodies && island->joints > 0; i++)
        path_along(world, world->solve.work.members[i], t, &world->solve.work.paths[i]);
}

/* How the anchors of a joint part, and at which rate, as A sees it as the interval begins. */
static void find_parting(const perp_world *world, const perp__joint *joint,
                         const perp__path *const paths[2], double *d, double *rate)
{
    double arms[2][3], twists[2][6], spun[3];

    for (int32_t side = 0; side < 2; side++) {
        perp__twist_now(world, joint->body[side], twists[side]);
        perp__apply3(arms[side], paths[side]->from.rotation, joint->anchors[side]);
    }
    perp__subtract3(d, paths[1]->from.position, paths[0]->from.position);
    perp__add3(d, 1.0, arms[1]); /* from A's mass centre */
    perp__subtract3(rate, twists[1], twists[0]);
    perp__cross(spun, twists[1] + 3, arms[1]);
    perp__add3(rate, 1.0, spun);
    perp__cross(spun, twists[0] + 3, d);
    perp__add3(rate, -1.0, spun);
}

/* Rows beside contacts are those half-way, of bodies that turn and move beside each other as A sees
 * it, in axes that turn as both do: of what turns as one all rows are those of the beginning then,
 * only turned, and what they had to do with each other they still have. They are told as they are
 * seen from the end, and `end` is what they are there. */
static void view_beside_contacts(const perp_world *world, perp__joint *joint,
                                 const perp__path *const paths[2], double t, perp__joint_view *end)
{
    const double before = perp__state_of(world, joint)->coordinate;
    const int32_t axes = world->settings.planar ? 2 : 3;
    double d[3], rate[3], common[3], turn[9], seen[3];
    perp__placement there[2];

    find_parting(world, joint, paths, d, rate);
    perp__common_turn(common, world->step.motions[joint->body[0]].trial + 3,
                      world->step.motions[joint->body[1]].trial + 3);
    for (int32_t k = 1; k < 3; k++) {
        perp__joint_view *view = k == 1 ? &joint->middle : end;

        /* 1. both bodies, seen from the mass centre of A, with B where its anchor is then */
        perp__add3(d, 0.5 * t, rate);
        perp__apply3(there[1].position, k == 1 ? paths[0]->half : paths[0]->turn, d);
        perp__copy3(there[0].position, paths[0]->to.position);
        perp__add3(there[1].position, 1.0, there[0].position);
        for (int32_t side = 0; side < 2; side++)
            perp__multiply3(there[side].rotation, k == 1 ? paths[side]->half : paths[side]->turn,
                            paths[side]->from.rotation);
        perp__apply3(seen, there[1].rotation, joint->anchors[1]);
        perp__add3(there[1].position, -1.0, seen);

        /* 2. rows there, in axes that turn as both do */
        perp__view_placed(world, joint, before, there, 1, view);
        for (int32_t i = 0; i < 3; i++)
            seen[i] = 0.5 * t * k * common[i];
        perp__turn_matrix(turn, seen);
        for (int32_t i = 0; i < 12 && perp__has_space_axes(joint->kind); i++) {
            double along[3] = {0.0, 0.0, 0.0};

            for (int32_t j = 0; j < axes; j++)
                along[j] = view->rows[j][i / 6][i % 6];
            perp__apply_transposed3(seen, turn, along);
            for (int32_t j = 0; j < axes; j++)
                view->rows[j][i / 6][i % 6] = seen[j];
        }
    }

    /* 3. those of half-way as seen from the end */
    for (int32_t row = 0; row <= PERP__JOINT_ROWS; row++)
        for (int32_t side = 0; side < 2 && (row < end->count || row == PERP__JOINT_ROWS); side++) {
            double *moment = joint->middle.rows[row][side] + 3;

            perp__apply3(seen, paths[side]->half, moment);
            perp__copy3(moment, seen);
        }
    memcpy(joint->middle.mean, paths[1]->half, sizeof joint->middle.mean);
    memcpy(joint->middle.arms, end->arms, sizeof end->arms);
}

/* Whether the trial motion is that before the step. */
static bool goes_on(const perp_world *world, int32_t body)
{
    const perp__motion *motion = &world->step.motions[body];

    return !memcmp(motion->trial, motion->start, sizeof motion->start) &&
           !memcmp(motion->last, motion->start, sizeof motion->start);
}

void perp__place_joints(perp_world *world, const perp__island *island, double t)
{
    const bool swings = perp__swings(world, island) && world->solve.work.carriers == 0;
    const bool whole = t == world->step.length && world->solve.work.gone == 0.0 && !swings;
    const int32_t beside = island->contacts > 0 ? 2 : 1;

    world->solve.work.span = t;
    perp__find_paths(world, island, t);
    for (int32_t i = 0; i < island->bodies && island->joints > 0; i++)
        turn_mass(world, world->solve.work.members[i], t);
    for (int32_t i = 0; i < island->joints; i++) {
        perp__joint *joint = perp__island_joint(world, island, i);
        const perp__path *paths[2];
        perp__path told[2];
        perp__joint_view end;
        int32_t stays,
            begins = whole && goes_on(world, joint->body[0]) && goes_on(world, joint->body[1])
                         ? beside
                         : 0;

        if (begins > 0 && joint->placed == begins) /* in a look before this one */
            continue;
        joint->placed = begins;
        /* 1. rows of the paths of both bodies, of which those of the island are known */
        for (int32_t side = 0; side < 2; side++) {
            const int32_t body = joint->body[side];

            paths[side] = &told[side];
            if (perp__is_dynamic(world, body))
                paths[side] = &world->solve.work.paths[world->step.roles[body].local];
            else
                path_along(world, body, t, &told[side]);
        }
        memset(joint->turning, 0, sizeof joint->turning);
        stays = paths[0]->stays && paths[1]->stays;
        if (stays || island->contacts == 0)
            perp__view_joint(world, joint, perp__state_of(world, joint)->coordinate, paths, 1,
                             &joint->middle);
        if (stays || swings)
            continue;

        /* 2. what their change till the end makes of the trial motion's last velocity, if it is
         * more than rounding; of what stays there is none, and what swings does not ask */
        if (island->contacts > 0)
            view_beside_contacts(world, joint, paths, t, &end);
        else
            perp__view_placed(world, joint, perp__state_of(world, joint)->coordinate,
                              (const perp__placement[2]){paths[0]->to, paths[1]->to}, 1, &end);
        const double length = fmax(end.size, fabs(end.coordinate));
        const double unsure = length > 0.0 ? end.rounding / length : 0.0;

        for (int32_t row = 0; row <= PERP__JOINT_ROWS; row++) {
            double turning = 0.0, terms = 0.0;

            for (int32_t k = 0; k < 12 && (row < end.count || row == PERP__JOINT_ROWS); k++) {
                const double *last = world->step.motions[joint->body[k / 6]].last;
                const double now = joint->middle.rows[row][k / 6][k % 6];

                turning += (end.rows[row][k / 6][k % 6] - now) * last[k % 6];
                terms += fabs(now * last[k % 6]);
            }
            joint->turning[row] = fabs(turning) > unsure * terms ? turning : 0.0;
        }
    }
}

/* By how much of the largest velocities of its points a body's anchors go elsewhere on their arcs
 * than is linear: than half-way, and where contacts are frozen as they were than at first. */
static double turn_of(const perp_world *world, const perp__island *island)
{
    const bool swings = perp__swings(world, island);
    double largest = 0.0;

    for (int32_t k = 0; k < 2 * island->joints; k++) {
        const perp__joint *joint = perp__island_joint(world, island, k / 2);
        const int32_t body = joint->body[k % 2];
        const double *arm = joint->middle.arms[k % 2], *last = world->step.motions[body].last;
        const double spin = perp__length3(last + 3);
        const perp__path *path;
        double seen[3];

        if (!perp__is_dynamic(world, body) || spin == 0.0 || perp__is_zero3(arm))
            continue;
        path = &world->solve.work.paths[world->step.roles[body].local];
        perp__apply3(seen, swings ? path->mean : path->turn, arm);
        perp__add3(seen, -1.0, arm);
        perp__raise_to(&largest,
                       perp__length3(seen) * spin /
                           (perp__length3(last) +
                            (world->bodies.all[body].radius + perp__length3(arm)) * spin));
    }
    return largest;
}

/* ---- the rounds of an interval ---- */

/* Beyond the lower limit, or below the upper one. */
static double gap_of(const perp__joint_state *state, const perp__joint_view *view, int32_t which)
{
    return which == 0 ? view->coordinate - state->lower : state->upper - view->coordinate;
}

void perp__aim_joints(perp_world *world, const perp__island *island)
{
    for (int32_t i = 0; i < island->bodies && island->joints > 0; i++) {
        perp__motion *motion = perp__island_motion(world, island, i);

        perp__twist_now(world, world->solve.work.members[i], motion->trial);
        memcpy(motion->last, motion->trial, sizeof motion->last);
    }
}

void perp__begin_joints(perp_world *world, const perp__island *island, double h, bool known)
{
    world->solve.work.length = h;
    for (int32_t i = 0; i < island->bodies; i++) {
        perp__motion *motion = perp__island_motion(world, island, i);

        memcpy(motion->trial, known ? motion->moving : motion->start, sizeof motion->trial);
        memcpy(motion->last, known ? motion->after : motion->start, sizeof motion->last);
    }
}

void perp__find_limits(perp_world *world, const perp__island *island, double ahead)
{
    for (int32_t i = 0; i < island->joints; i++) {
        perp__joint *joint = perp__island_joint(world, island, i);
        const bool turns = joint->kind == PERP_JOINT_REVOLUTE || joint->kind == PERP_JOINT_SCREW;
        double rate = 0.0, terms = 0.0, rounding;
        perp__joint_view view;

        joint->reached[0] = joint->reached[1] = 0;
        if (!view_there(world, joint, 0.0, &view))
            continue;
        for (int32_t side = 0; side < 2; side++) {
            double now[6];

            perp__twist_now(world, joint->body[side], now);
            for (int32_t k = 0; k < 6; k++) {
                const double term = view.rows[PERP__JOINT_ROWS][side][k] * now[k];

                rate += term;
                terms += fabs(term);
            }
        }
        rounding = turns ? PERP__SUM_ROUNDING : view.rounding;
        for (int32_t which = 0; which < 2; which++) {
            const double gap = gap_of(perp__state_of(world, joint), &view, which);

            joint->gap[which] = gap > rounding ? gap : 0.0;
            joint->came[which] = (which == 0 ? rate : -rate) < -PERP__NEGLIGIBLE * terms;
            joint->reached[which] =
                gap <= rounding ||
                (ahead > 0.0 && gap < fmax((which == 0 ? -2.0 : 2.0) * ahead * rate, 0.0) +
                                          FAR * (turns ? 1.0 : view.size));
        }
    }
}

/* Limits that the motion goes beyond take part from now on. */
static int32_t reach_limits(perp_world *world, const perp__island *island, double t)
{
    int32_t came = 0;

    for (int32_t i = 0; i < island->joints; i++) {
        perp__joint *joint = perp__island_joint(world, island, i);
        perp__joint_view end;

        if (!view_there(world, joint, t, &end))
            continue;
        for (int32_t which = 0; which < 2; which++)
            if (gap_of(perp__state_of(world, joint), &end, which) < 0.0 && !joint->reached[which])
                came += joint->reached[which] = 1;
    }
    return came;
}

void perp__stop_trial(perp_world *world, const perp__island *island)
{
    for (int32_t i = 0; i < island->bodies; i++)
        memset(perp__island_motion(world, island, i)->trial, 0, 6 * sizeof(double));
}

/* y -= c x of n numbers, the first m of which y then has none of along x. */
static void leave_out(double *y, const double *x, int32_t m, int32_t n)
{
    const double square = perp__dot(x, x, m);
    const double c = square > 0.0 ? perp__dot(x, y, m) / square : 0.0;

    for (int32_t k = 0; k < n; k++)
        y[k] -= c * x[k];
}

/* The next trial is what the round led to, g, but for what the rounds so far tell of the way there.
 * Of two in turn, what they lead to differs by dg, and what their trials miss, f = g - x, by df. If
 * that goes on, least is missed at g - sum c_k dg_k, c_k = f.df_k / |df_k|^2, with each df freed of
 * those before it, and its dg with it: Anderson's method (J. ACM 12 (1965) 547). A df of which less
 * than half of its digits are left tells nothing. */
static void choose_trial(const perp_world *world, const perp__island *island, int32_t round)
{
    const int32_t n = PERP__TRIED * island->bodies, six = 6 * island->bodies;
    double *first = world->solve.work.tried, *now = first + (size_t)round * (size_t)n,
           *next = now + n;
    double *last = now - n, whole;

    /* 1. the round before becomes what it differs by from this one */
    for (int32_t k = 0; k < n && round > 0; k++)
        last[k] = now[k] - last[k];
    whole = round > 0 ? perp__dot(last, last, six) : 0.0;
    for (double *way = first; way < last; way += n)
        leave_out(last, way, six, n);
    if (round > 0 && !(perp__dot(last, last, six) > DBL_EPSILON * whole))
        memset(last, 0, (size_t)n * sizeof *last);
    /* 2. what is missed along all of these is left out */
    memcpy(next, now, (size_t)n * sizeof *next);
    for (double *way = first; way < now; way += n)
        leave_out(next, way, six, n);
    for (int32_t i = 0; i < island->bodies; i++) {
        memcpy(perp__island_motion(world, island, i)->trial, next + six + 12 * i, 6 * sizeof *next);
        memcpy(perp__island_motion(world, island, i)->last, next + six + 12 * i + 6,
               6 * sizeof *next);
    }
}

/* What trials missed and the last round led to; by how much that differs, if not by rounding. */
static void measure_change(const perp_world *world, const perp__island *island, double t,
                           perp__rounds *rounds)
{
    const perp__island_work *work = &world->solve.work;
    double *missed = work->tried + (size_t)PERP__TRIED * (size_t)(rounds->done * island->bodies);
    double *found = missed + 6 * island->bodies, common[6] = {0.0};
    bool flies = perp__swings(world, island);

    /* what all bodies of an island that nothing holds take up in this round changes no row */
    for (int32_t k = 0; k < 2 * island->joints && flies; k++)
        flies = perp__is_dynamic(world, perp__island_joint(world, island, k / 2)->body[k % 2]);
    for (int32_t k = 0; k < world->dof / 3 + 1 && flies; k++)
        common[k] = work->moving[k] - perp__island_motion(world, island, 0)->trial[k];
    rounds->change = rounds->swerve = 0.0;
    for (int32_t i = 0; i < island->bodies; i++, missed += 6, found += 12) {
        perp__motion *motion = perp__island_motion(world, island, i);
        const double radius = world->bodies.all[work->members[i]].radius;
        const double rounding = PERP__SUM_ROUNDING * t *
                                (perp__length3(motion->trial + 3) +
                                 (radius > 0.0 ? perp__length3(motion->trial) / radius : 0.0));

        perp__twist_of(world, work->moving + world->dof * i, found);
        perp__twist_of(world, work->v + world->dof * i, found + 6);
        for (int32_t k = 0; k < 6; k++) {
            missed[k] = t * (found[k] - motion->trial[k] - common[k]);
            if (k < 3 && radius > 0.0)
                missed[k] /= radius;
            if (fabs(missed[k]) > rounding)
                perp__raise_to(k < 3 ? &rounds->change : &rounds->swerve, fabs(missed[k]));
        }
        memcpy(motion->trial, found, sizeof motion->trial);
        memcpy(motion->last, found + 6, sizeof motion->last);
    }
    perp__raise_to(&rounds->change, rounds->swerve);
    if (rounds->done == 0)
        rounds->first = rounds->change;
}

int32_t perp__goes_round(perp_world *world, const perp__island *island, double t,
                         perp__rounds *rounds)
{
    const double before = rounds->change;
    const bool swings = perp__swings(world, island);
    const double settled = swings ? SETTLED : perp__exact_tol(world);
    bool lost;

    /* 1. the motion that was found is the next trial; by how much it differs */
    rounds->turn = fmax(rounds->turn, turn_of(world, island)); /* of any of the paths tried */
    measure_change(world, island, t, rounds);
    if (rounds->coarse) { /* what is linear there is so as far as that motion turns little */
        perp__find_paths(world, island, t);
        rounds->turn = fmax(rounds->turn, turn_of(world, island));
        return 0;
    }

    /* 2. again for limits that it reached, and until it is settled, unless two rounds leave too
     * much; what turns too far to settle, or does not, has the rows of the beginning at last */
    lost = !(rounds->swerve <= FAR) && rounds->done > 1 && !(rounds->change <= rounds->first);
    if (!lost && rounds->most > 1 && reach_limits(world, island, t) > 0 &&
        rounds->extra++ < EXTRA_ROUNDS) {
        rounds->done = 0;
        rounds->change = INFINITY;
        return 1;
    }
    if (!lost && rounds->done + 1 < rounds->most && rounds->change > settled &&
        (rounds->done < 2 || rounds->change <= ENOUGH * rounds->earlier)) {
        rounds->earlier = before;
        if (!swings) /* which settles to rounding, as secants do not */
            choose_trial(world, island, rounds->done);
        rounds->done++;
        return 1;
    }
    rounds->parts = rounds->change > settled && !(rounds->change <= rounds->first);
    rounds->coarse = (rounds->parts || !(rounds->swerve <= FAR)) && !swings;
    if (rounds->coarse)
        perp__stop_trial(world, island);
    return rounds->coarse;
}

bool perp__is_rough(const perp__rounds *rounds)
{
    return (rounds->parts && !rounds->coarse) ||
           !(rounds->turn <= FAR && (rounds->coarse ? rounds->most == 1 : rounds->swerve <= FAR));
}
