/* The contact problems of the islands: which contacts take part, the path of an island through the
 * step, and what that is worth. The velocities themselves are the contact layer's (contact.h).
 *
 * Over an interval of length t from velocities v, with forces that would lead to v_f,
 *
 *   M (v+ - v_f) = J'r,   u = J v+,   0 <= r_n  perp  u_n + max(gap, 0) / t >= 0,   Coulomb's law
 *
 * (Stewart & Trinkle 1996, Anitescu & Potra 1997). An island without impacts is one such interval.
 * One with impacts is cut there (impacts.c). */
#include "world/world.h"

#include <math.h>
#include <string.h>

#include "base/context.h"
#include "linalg/spatial.h"

/* What is solved to tol is so to this, where the caller says nothing; and what the methods are
 * asked for beside it: they come to rounding nearly always, and then so does a brick at its
 * threshold. */
#define EXACT_TOL 1e-10
#define SHARPER 1e-2

/* Iterations of each method within which it comes to an answer or hardly ever does: all that is
 * spent, but at accuracy `exact`. */
#define QUICK 100

/* Joints of an island up to which sweeps come to an answer as fast as newton's method. */
#define FEW_JOINTS 8

/* Residual that joints may be left with where methods come to no better one. */
#define JOINT_TOL 1e-6

/* How often an island within a budget is solved in a step: what closes after that waits for the
 * next one. */
#define MOST_ROUNDS 2

static int32_t larger_of(int32_t a, int32_t b)
{
    return a > b ? a : b;
}

static void lay_out(perp__arena *arena, void *object)
{
    perp_world *world = object;
    perp__island_work *work = &world->work;
    const size_t bodies = (size_t)work->max_bodies, contacts = (size_t)work->max_contacts;
    const size_t numbers = bodies * (size_t)world->dof;

    work->rows = perp__arena_take(arena, contacts, sizeof *work->rows);
    work->factors = perp__arena_take(arena, numbers * (size_t)world->dof, sizeof(double));
    work->start = perp__arena_take(arena, numbers, sizeof(double));
    work->gain = perp__arena_take(arena, numbers, sizeof(double));
    work->now = perp__arena_take(arena, numbers, sizeof(double));
    work->drift = perp__arena_take(arena, numbers, sizeof(double));
    work->smooth = perp__arena_take(arena, numbers, sizeof(double));
    work->moving = perp__arena_take(arena, numbers, sizeof(double));
    work->free = perp__arena_take(arena, numbers, sizeof(double));
    work->v = perp__arena_take(arena, numbers, sizeof(double));
    work->carrier = perp__arena_take(arena, bodies, sizeof(int32_t));
    work->members = perp__arena_take(arena, bodies, sizeof(int32_t));
    work->origins = perp__arena_take(arena, 3 * bodies, sizeof(double));
    work->chosen = perp__arena_take(arena, contacts, sizeof(int32_t));
    work->modes = perp__arena_take(arena, contacts, sizeof(int32_t));
    work->impulse = perp__arena_take(arena, 3 * contacts, sizeof(double));
    work->velocity = perp__arena_take(arena, 3 * contacts, sizeof(double));
    work->warm = perp__arena_take(arena, 3 * contacts, sizeof(double));
    work->gap = perp__arena_take(arena, contacts, sizeof(double));
    work->none = perp__arena_take(arena, contacts, sizeof(double));
    work->guard = perp__arena_take(arena, contacts, sizeof(double));
    work->strength = perp__arena_take(arena, bodies, sizeof(double));
    work->solved = perp__arena_take(arena, numbers, sizeof(double));
    work->solved_rows = perp__arena_take(arena, 3 * contacts, sizeof(double));
    work->joint_units = perp__arena_take(arena, contacts, sizeof *work->joint_units);
    work->hit = perp__arena_take(arena, contacts, sizeof(int8_t));
    work->smooth_impulse = perp__arena_take(arena, 3 * contacts, sizeof(double));
    work->next_warm = perp__arena_take(arena, 3 * contacts, sizeof(double));
    work->smooth_chosen = perp__arena_take(arena, contacts, sizeof(int32_t));
}

/* Room for the largest island. Bodies: twice those of its contacts at most count as carriers. */
perp_status perp__fit_island_work(perp_world *world)
{
    perp__island_work *work = &world->work;
    int32_t i;

    for (i = 0; i < world->island_count; i++) {
        const perp__island *island = &world->islands[i];

        work->max_contacts =
            larger_of(work->max_contacts, island->contacts + PERP__JOINT_UNITS * island->joints);
        work->max_bodies =
            larger_of(work->max_bodies, island->bodies + island->contacts + island->joints);
    }
    return perp__arena_fit(&world->island_arena, lay_out, world);
}

static perp__world_contact *island_contact(const perp_world *world, const perp__island *island,
                                           int32_t i)
{
    return perp__island_contact(world, &world->contacts, island, i);
}

/* A gap that is not told apart from 0 is 0: rounding of coordinates must not move what rests. */
double perp__open_gap(const perp__world_contact *contact, double gap)
{
    return gap > contact->rounding ? gap : 0.0;
}

/* The coordinates of a twist. */
void perp__coordinates_of(const perp_world *world, const double *twist, double *x)
{
    int32_t i;

    for (i = 0; i < world->dof; i++)
        x[i] = twist[world->coordinate[i]];
}

void perp__twist_of(const perp_world *world, const double *x, double *twist)
{
    int32_t i;

    memset(twist, 0, 6 * sizeof *twist);
    for (i = 0; i < world->dof; i++)
        twist[world->coordinate[i]] = x[i];
}

/* C with M^-1 = C C', row-major. */
void perp__write_factor(const perp_world *world, const perp__motion *motion, double *C)
{
    const int32_t n = world->dof;
    int32_t i, j;

    memset(C, 0, (size_t)(n * n) * sizeof *C);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            const int32_t row = world->coordinate[i], column = world->coordinate[j];

            if (row < 3 && row == column)
                C[n * i + j] = motion->root_inverse_mass;
            else if (row >= 3 && column >= 3)
                C[n * i + j] = motion->factor[3 * (row - 3) + column - 3];
        }
}

int32_t perp__number_of(perp_world *world, const perp__island *island, int32_t body)
{
    perp__motion *motion = &world->motions[body];
    perp__island_work *work = &world->work;

    if (world->bodies[body].kind == PERP_BODY_DYNAMIC)
        return motion->local;
    if (perp__is_zero3(motion->start) && perp__is_zero3(motion->start + 3))
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

/* Bodies and carriers of the island, where they are and how they start. */
void perp__gather_bodies(perp_world *world, const perp__island *island)
{
    perp__island_work *work = &world->work;
    const int32_t n = world->dof;
    int32_t i, k;

    for (i = 0; i < island->bodies; i++) {
        const int32_t body = world->body_order[island->first_body + i];
        const perp__motion *motion = &world->motions[body];
        double free[6];

        work->members[i] = body;
        perp__write_factor(world, motion, work->factors + n * n * i);
        perp__coordinates_of(world, motion->start, work->start + n * i);
        perp__coordinates_of(world, motion->free, free);
        for (k = 0; k < n; k++) {
            work->now[n * i + k] = work->start[n * i + k];
            work->gain[n * i + k] = free[k] - work->start[n * i + k];
            work->drift[n * i + k] = 0.0;
        }
        perp__copy3(work->origins + 3 * i, world->states[body].position);
    }
    work->carriers = 0;
    for (i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = island_contact(world, island, i);

        world->motions[contact->body_a].carrier = world->motions[contact->body_b].carrier = -1;
    }
    perp__number_joint_bodies(world, island, 1);
    perp__number_joint_bodies(world, island, 0);
    for (i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = island_contact(world, island, i);

        perp__number_of(world, island, contact->body_a);
        perp__number_of(world, island, contact->body_b);
    }
}

/* Rows of the chosen contacts; bias is written for each problem. */
void perp__choose_rows(perp_world *world, const perp__island *island, const int8_t *leaves_out)
{
    perp__island_work *work = &world->work;
    int32_t i, k, side;

    work->count = 0;
    work->set_up = 0;
    for (i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = island_contact(world, island, i);
        perp__rigid_rows *rows = &work->rows[work->count];

        if (leaves_out && leaves_out[i])
            continue;
        memset(rows, 0, sizeof *rows);
        rows->body[0] = perp__number_of(world, island, contact->body_a);
        rows->body[1] = perp__number_of(world, island, contact->body_b);
        rows->dim = contact->friction > 0.0 ? (world->settings.planar ? 2 : 3) : 1;
        rows->mu = contact->friction;
        for (side = 0; side < 2; side++)
            for (k = 0; k < rows->dim; k++)
                perp__coordinates_of(world, contact->rows[side][k], rows->rows[side][k]);
        memcpy(work->warm + 3 * work->count, contact->warm, sizeof contact->warm);
        work->chosen[work->count++] = i;
    }
    perp__add_joint_rows(world, island);
}

double perp__exact_tol(const perp_world *world)
{
    return world->settings.tol > 0.0 ? world->settings.tol : EXACT_TOL;
}

/* The problem of the chosen rows with `free` velocities. */
void perp__pose_island(perp_world *world, const perp__island *island, perp__rigid_problem *problem)
{
    perp__island_work *work = &world->work;
    const perp_world_settings *settings = &world->settings;
    const int32_t n = world->dof;
    int32_t i;

    memset(problem, 0, sizeof *problem);
    problem->width = n;
    problem->bodies = island->bodies;
    problem->carriers = work->carriers;
    problem->contacts = work->inequalities;
    problem->joints = work->units - work->inequalities;
    problem->factors = work->factors;
    problem->free = work->free;
    for (i = n * island->bodies; i < n * (island->bodies + work->carriers); i++)
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

/* Whether theory promises a solution (docs/world.md): always without restitution and for one that
 * is the same everywhere, unless something that nothing stops closes on a body. */
static int32_t is_solvable(const perp_world *world, const perp__island *island, int32_t bounces)
{
    double restitution = -1.0;
    int32_t i;

    if (world->work.carriers > 0)
        return 0;
    for (i = 0; i < island->contacts && bounces; i++) {
        const perp__world_contact *contact = island_contact(world, island, i);

        if (restitution >= 0.0 && contact->restitution != restitution)
            return 0;
        restitution = contact->restitution;
    }
    return 1;
}

/* The word for the answer at tol. */
static void weigh(perp__rigid_answer *answer, double tol)
{
    const perp__evidence evidence = {answer->tested, answer->own, answer->backward, 1};

    answer->outcome = perp__gate(&evidence, tol, answer->outcome);
}

/* |C^-1 v| of a body: twice its square is the kinetic energy. */
double perp__mass_norm(const perp_world *world, const perp__motion *motion, const double *v)
{
    double twist[6], turning[3];

    perp__twist_of(world, v, twist);
    perp__apply3(turning, motion->inverse_factor, twist + 3);
    return hypot(motion->root_mass * perp__length3(twist), perp__length3(turning));
}

/* |C'J'| of a row of a body: its velocity for a twist of norm 1. */
double perp__row_norm(const perp__motion *motion, const double *twist)
{
    double turning[3];

    perp__apply_transposed3(turning, motion->factor, twist + 3);
    return hypot(motion->root_inverse_mass * perp__length3(twist), perp__length3(turning));
}

/* The sizes of the terms that each body's velocity is made of. */
static void find_strengths(const perp_world *world, const perp__island *island, double *strength)
{
    const perp__island_work *work = &world->work;
    const int32_t n = world->dof;
    int32_t i, k, side;

    for (i = 0; i < island->bodies; i++) {
        const perp__motion *motion = &world->motions[work->members[i]];

        strength[i] = perp__mass_norm(world, motion, work->now + n * i) +
                      perp__mass_norm(world, motion, work->gain + n * i);
    }
    for (i = 0; i < work->units; i++)
        for (k = 0; k < work->rows[i].dim; k++)
            for (side = 0; side < 2 && work->impulse[3 * i + k] != 0.0; side++) {
                const int32_t body = work->rows[i].body[side];
                double twist[6];

                if (body < 0 || body >= island->bodies)
                    continue;
                perp__twist_of(world, work->rows[i].rows[side][k], twist);
                strength[body] += fabs(work->impulse[3 * i + k]) *
                                  perp__row_norm(&world->motions[work->members[body]], twist);
            }
}

/* The largest change of a body's velocity beside its own terms: a light body does not hide behind a
 * heavy one. */
static double largest_change(const perp_world *world, const perp__island *island,
                             const double *from, const double *strength)
{
    const int32_t n = world->dof;
    double largest = 0.0;
    int32_t i, k;

    for (i = 0; i < island->bodies; i++) {
        double change[6], norm;

        for (k = 0; k < n; k++)
            change[k] = world->work.v[n * i + k] - from[n * i + k];
        norm = perp__mass_norm(world, &world->motions[world->work.members[i]], change);
        if (norm != 0.0)
            perp__raise_to(&largest, norm / strength[i]);
    }
    return largest;
}

/* Velocities in what the rows that hold leave free, where they are an answer as well. */
perp_status perp__hold_island(perp_world *world, const perp__island *island,
                              perp__rigid_answer *answer, const perp__rigid_problem *problem,
                              double tol)
{
    perp__island_work *work = &world->work;
    const size_t numbers = (size_t)(world->dof * island->bodies);
    perp__evidence evidence = {answer->tested, answer->own, answer->backward, 1};
    perp_outcome outcome;
    perp_status status;

    find_strengths(world, island, work->strength);
    memcpy(work->solved, work->v, numbers * sizeof(double));
    memcpy(work->solved_rows, work->velocity, 3 * (size_t)work->units * sizeof(double));
    status = perp__rigid_hold(world->solver, answer, problem);
    if (status != PERP_OK)
        return status;
    perp__raise_to(&evidence.own, largest_change(world, island, work->solved, work->strength));
    outcome = perp__gate(&evidence, tol, answer->outcome);
    if (perp__is_good(outcome)) {
        answer->outcome = perp__worse_outcome(outcome, answer->outcome);
        return PERP_OK;
    }
    answer->held = 0;
    memcpy(work->v, work->solved, numbers * sizeof(double));
    memcpy(work->velocity, work->solved_rows, 3 * (size_t)work->units * sizeof(double));
    return PERP_OK;
}

static perp_status solve_by(perp_world *world, perp__rigid_answer *answer,
                            perp__rigid_problem *problem)
{
    const int32_t limit = problem->max_iterations;
    perp_status status;

    problem->tol = SHARPER * perp__exact_tol(world);
    problem->max_iterations = limit == 0 || limit > QUICK ? QUICK : limit;
    status = perp__rigid_solve(world->solver, answer, problem);
    problem->max_iterations = limit;
    problem->tol = perp__exact_tol(world);
    if (status == PERP_OK)
        weigh(answer, perp__exact_tol(world));
    if (answer->outcome == PERP_OUTCOME_ITERATION_LIMIT && limit == 0)
        answer->outcome = PERP_OUTCOME_STALLED; /* nobody asked for that limit */
    return status;
}

/* What will do where methods come to no better: at `exact` nothing else. Joints are not to give way
 * visibly. */
static double rough_tol(const perp_world *world, const perp__island *island)
{
    const double tol = perp__swept_tol(world);

    return island->joints > 0 ? fmin(tol, JOINT_TOL) : tol;
}

/* Joints couple their bodies too tightly for sweeps: newton's method solves equations at once. */
static perp_status solve_quickly(perp_world *world, const perp__island *island,
                                 perp__rigid_answer *answer, perp__rigid_problem *problem,
                                 double *tol)
{
    const int32_t method = problem->method;
    perp_status status = PERP_OK;

    if (island->joints > FEW_JOINTS && method == PERP_CONTACT_METHOD_AUTO && problem->cone == 0) {
        problem->method = PERP_CONTACT_METHOD_NEWTON;
        status = solve_by(world, answer, problem);
        problem->method = method;
        if (status == PERP_OK && !perp__is_good(answer->outcome))
            weigh(answer, *tol = rough_tol(world, island));
        if (status != PERP_OK || perp__is_good(answer->outcome))
            return status;
        *tol = perp__exact_tol(world);
        problem->again = 1;
    }
    return solve_by(world, answer, problem);
}

/* From where that has come to, with all that the methods have. */
static perp_status solve_thoroughly(perp_world *world, perp__rigid_answer *answer,
                                    perp__rigid_problem *problem)
{
    perp__island_work *work = &world->work;
    const int64_t spent = answer->iterations;
    perp_status status;

    if (problem->max_iterations > 0 && spent >= problem->max_iterations)
        return PERP_OK;
    if (problem->max_iterations > 0)
        problem->max_iterations -= (int32_t)spent;
    memcpy(work->warm, work->impulse, 3 * (size_t)work->units * sizeof *work->warm);
    problem->again = 1;
    status = perp__rigid_solve(world->solver, answer, problem);
    answer->iterations += spent;
    return status;
}

perp_status perp__solve_rows(perp_world *world, const perp__island *island, int32_t bounces,
                             perp__verdict *verdict)
{
    perp__island_work *work = &world->work;
    perp__rigid_problem problem;
    perp__rigid_answer answer;
    double tol = perp__exact_tol(world);
    perp_status status;

    perp__pose_island(world, island, &problem);
    perp__receive(world, &answer);
    status = solve_quickly(world, island, &answer, &problem, &tol);
    if (status == PERP_OK && !perp__is_good(answer.outcome) &&
        world->settings.accuracy != PERP_ACCURACY_EXACT)
        weigh(&answer, tol = rough_tol(world, island));
    if (status == PERP_OK && !perp__is_good(answer.outcome) &&
        (world->settings.accuracy == PERP_ACCURACY_EXACT || island->joints > 0))
        status = solve_thoroughly(world, &answer, &problem);
    if (status == PERP_OK && !perp__is_good(answer.outcome) && answer.outcome != PERP_OUTCOME_RAY &&
        island->joints == 0)
        status = perp__sweep_on(world, island, &answer, &problem);
    if (status == PERP_OK && perp__is_good(answer.outcome))
        status = perp__hold_island(world, island, &answer, &problem, tol);
    if (status == PERP_OK && perp__is_good(answer.outcome))
        status = perp__rest_joints(world, island, &answer, &problem);
    if (status == PERP_ERROR_NOT_FINITE)
        return perp__fail(world->context, status,
                          "the step takes the contacts beyond the range of numbers");
    if (status != PERP_OK)
        return status;
    work->set_up = 1;
    memcpy(work->warm, work->impulse, 3 * (size_t)work->units * sizeof *work->warm);
    perp__spend(world, answer.iterations);
    if (answer.outcome == PERP_OUTCOME_RAY && is_solvable(world, island, bounces))
        answer.outcome = PERP_OUTCOME_STALLED; /* of the method, not of the scene */
    verdict->outcome = perp__worse_outcome(verdict->outcome, answer.outcome);
    perp__raise_to(&verdict->residual, answer.tested);
    return PERP_OK;
}

void perp__add_impulse(perp_world *world, const perp__island *island, int32_t i,
                       const double *impulse, double share)
{
    perp__world_contact *contact = island_contact(world, island, i);
    int32_t k;

    for (k = 0; k < 3; k++)
        contact->impulse[k] += share * impulse[k];
}

void perp__take_answer(perp_world *world, const perp__island *island)
{
    const perp__island_work *work = &world->work;
    int32_t i;

    for (i = 0; i < work->count; i++) {
        perp__world_contact *contact = island_contact(world, island, work->chosen[i]);

        perp__add_impulse(world, island, work->chosen[i], work->impulse + 3 * i, 1.0);
        memcpy(contact->next, work->impulse + 3 * i, sizeof contact->next);
        contact->mode = work->modes[i];
    }
    perp__add_joint_impulses(world, work->impulse + 3 * work->count, 1.0);
}

/* The motion of the step: the ways of its intervals over all of it. */
void perp__mean_motion(perp_world *world, const perp__island *island, double h)
{
    perp__island_work *work = &world->work;
    int32_t i;

    for (i = 0; i < world->dof * island->bodies; i++)
        work->moving[i] = work->drift[i] / h;
}

/* Relative velocity after the step. What a contact holds is exact: its bias and no more. */
static void write_velocities(perp_world *world, const perp__island *island)
{
    const perp__island_work *work = &world->work;
    int32_t i, k;

    for (i = 0; i < work->count; i++) {
        perp__world_contact *contact = island_contact(world, island, work->chosen[i]);
        const perp__rigid_rows *rows = &work->rows[i];

        perp__relative_velocity(world, contact, PERP__TWIST_AFTER, contact->velocity);
        for (k = 0; k < rows->dim; k++)
            if (work->velocity[3 * i + k] == 0.0)
                contact->velocity[k] = 0.0 - rows->bias[k];
    }
}

/* Writes the twists of the island's bodies: that which moves the positions, and that after it. */
void perp__write_twists(perp_world *world, const perp__island *island)
{
    const perp__island_work *work = &world->work;
    const int32_t n = world->dof;
    int32_t i;

    for (i = 0; i < island->bodies; i++) {
        perp__motion *motion = &world->motions[work->members[i]];

        perp__twist_of(world, work->moving + n * i, motion->moving);
        perp__twist_of(world, work->now + n * i, motion->after);
    }
    write_velocities(world, island);
}

/* Whether something closes if nothing acts: by the end of the step, or by its velocities then. */
static int32_t closes(perp_world *world, const perp__island *island, double h)
{
    int32_t i;

    for (i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = island_contact(world, island, i);
        const double gap = fmax(perp__open_gap(contact, contact->gap), 0.0);

        if (gap + h * fmin(contact->free[0], 0.5 * (contact->start[0] + contact->free[0])) < 0.0)
            return 1;
    }
    return 0;
}

/* Nothing acts: velocities are those of the forces. */
static void leave_alone(perp_world *world, const perp__island *island)
{
    int32_t i, k;

    for (i = 0; i < island->bodies; i++) {
        perp__motion *motion = perp__island_motion(world, island, i);

        for (k = 0; k < 6; k++)
            motion->moving[k] = 0.5 * (motion->start[k] + motion->free[k]);
        memcpy(motion->after, motion->free, sizeof motion->after);
    }
    for (i = 0; i < island->contacts; i++) {
        perp__world_contact *contact = island_contact(world, island, i);

        memset(contact->impulse, 0, sizeof contact->impulse);
        memset(contact->next, 0, sizeof contact->next);
        perp__copy3(contact->velocity, contact->free);
        contact->mode = PERP_CONTACT_SEPARATE;
    }
}

static perp_status solve_island(perp_world *world, const perp__island *island, double h,
                                perp__verdict *verdict)
{
    if (island->joints > 0)
        return perp__solve_jointed(world, island, h, verdict);
    memset(verdict, 0, sizeof *verdict);
    if (!closes(world, island, h)) {
        leave_alone(world, island);
        return PERP_OK;
    }
    if (perp__is_worth_exact(world, island))
        return perp__follow_island(world, island, h, verdict);
    return perp__sweep_island(world, island, h, verdict);
}

/* Whether contacts came to the island since it was solved; they count as old from now on. */
static int32_t has_changed(perp_world *world, const perp__island *island)
{
    int32_t changed =
        island->joints > 0 && perp__island_motion(world, island, 0)->verdict.rounds == 0;
    int32_t i;

    for (i = 0; i < island->contacts; i++) {
        perp__world_contact *contact = island_contact(world, island, i);

        changed = changed || contact->fresh;
        contact->fresh = 0;
    }
    return changed;
}

/* Islands of the contacts included so far; those that changed are solved. Stops at a ray. */
static perp_status solve_changed(perp_world *world, double h, perp__solve_summary *summary)
{
    perp_status status = perp__build_islands(world, &world->contacts);
    int32_t i, k;

    if (status == PERP_OK)
        status = perp__fit_island_work(world);
    world->budget.contacts = 0;
    for (i = 0; i < world->island_count; i++)
        world->budget.contacts += world->islands[i].contacts + world->islands[i].joints;
    for (i = 0; i < world->island_count && status == PERP_OK; i++) {
        const perp__island *island = &world->islands[i];
        perp__verdict verdict;

        verdict = perp__island_motion(world, island, 0)->verdict;
        if (has_changed(world, island) && !(verdict.swept && verdict.rounds >= MOST_ROUNDS)) {
            const int32_t rounds = verdict.rounds + 1;

            status = solve_island(world, island, h, &verdict);
            verdict.rounds = rounds;
        }
        world->budget.contacts -= island->contacts + island->joints;
        for (k = 0; k < island->bodies; k++)
            perp__island_motion(world, island, k)->verdict = verdict;
        if (verdict.outcome == PERP_OUTCOME_RAY) {
            summary->outcome = PERP_OUTCOME_RAY;
            summary->residual = verdict.residual;
            break;
        }
    }
    return status;
}

/* The last word on each island. */
static void summarise(const perp_world *world, perp__solve_summary *summary)
{
    int32_t i;

    for (i = 0; i < world->island_count; i++) {
        const perp__verdict *verdict = &perp__island_motion(world, &world->islands[i], 0)->verdict;

        summary->outcome = perp__worse_outcome(summary->outcome, verdict->outcome);
        perp__raise_to(&summary->residual, verdict->residual);
        summary->solved += verdict->stages > 0;
        summary->impacts += verdict->impacts > 0;
    }
}

perp_status perp__solve_islands(perp_world *world, double h, perp__solve_summary *summary)
{
    perp_status status;
    int32_t came = 0;

    memset(summary, 0, sizeof *summary);
    world->island_count = 0;
    status = world->joint_count > 0 ? solve_changed(world, h, summary) : PERP_OK;
    if (status == PERP_OK && summary->outcome != PERP_OUTCOME_RAY)
        status = perp__join_contacts(world, h, &came);
    while (status == PERP_OK && summary->outcome != PERP_OUTCOME_RAY && came > 0) {
        status = solve_changed(world, h, summary);
        if (status == PERP_OK)
            status = perp__join_contacts(world, h, &came);
    }
    if (status == PERP_OK && summary->outcome != PERP_OUTCOME_RAY)
        summarise(world, summary);
    return status;
}
