/* What only swings on its joints: nothing touches it, no limit is reached, nothing drives it. Then
 *
 *   J (v0 + v1) = 0,   impulses J'r,
 *
 * J that of the path gone by (trial.c). Whatever J is, these do no work, r'J (v0 + v1) / 2 = 0, and
 * neither does the implicit midpoint rule: energy is kept, and joints stay closed where J is that
 * of the path itself. What is left to do at its end is in projection.c. */
#include "world/joints/joints.h"

bool perp__swings(const perp_world *world, const perp__island *island)
{
    bool swings = island->joints > 0 && island->contacts == 0;

    for (int32_t i = 0; i < island->joints && swings; i++) {
        const perp__joint *joint = perp__island_joint(world, island, i);
        const perp__joint_state *state = perp__state_of(world, joint);

        swings = perp__is_locked(state) || (!joint->reached[0] && !joint->reached[1] &&
                                            state->force == 0.0 && state->friction == 0.0);
    }
    return swings;
}

perp_status perp__solve_equations(perp_world *world, const perp__island *island, int32_t most,
                                  double *residual)
{
    perp__passes passes = {.h = 1.0, .passes = most, .measures = residual != NULL};
    perp__rigid_problem problem;
    perp__rigid_answer answer;
    perp_status status;

    perp__pose_island(world, island, &problem);
    perp__receive(world, &answer);
    problem.warm = NULL;
    status = perp__coloured_step(&world->solve.coloured, &answer, NULL, &problem, &passes);
    if (residual)
        *residual = status == PERP_OK ? answer.tested : INFINITY;
    return status;
}

/* x := y with angular velocities as bodies see them that turn along their paths, or back. */
static void turn_numbers(perp_world *world, const perp__island *island, double *x, const double *y,
                         bool back)
{
    const int32_t n = world->dof;

    for (int32_t i = 0; i < island->bodies; i++) {
        double twist[6], seen[3];

        perp__twist_of(world, y + n * i, twist);
        if (back)
            perp__apply_transposed3(seen, world->solve.work.paths[i].turn, twist + 3);
        else
            perp__apply3(seen, world->solve.work.paths[i].turn, twist + 3);
        perp__copy3(twist + 3, seen);
        perp__coordinates_of(world, twist, x + n * i);
    }
}

void perp__mean_of_ends(perp_world *world, const perp__island *island)
{
    perp__island_work *work = &world->solve.work;

    turn_numbers(world, island, work->moving, work->v, 1);
    for (int32_t i = 0; i < world->dof * island->bodies; i++)
        work->moving[i] = 0.5 * (work->now[i] + work->moving[i]);
}

/* What the velocities are worth. What hangs still is pinned by nothing along its way: they are 0
 * where all are no more than the rounding of what they are made of. */
static void check_equations(perp_world *world, const perp__island *island, double tested,
                            perp__verdict *verdict)
{
    perp__island_work *work = &world->solve.work;
    bool still = work->carriers == 0;
    const perp__evidence evidence = {
        .sound = 1, .tested = tested, .own_residual = tested, .backward = tested};

    verdict->stands = 0;
    verdict->outcome = perp__worse_outcome(
        verdict->outcome, perp__gate(&evidence, perp__exact_tol(world), PERP_OUTCOME_SOLVED));
    perp__raise_to(&verdict->residual, tested);
    perp__spend(world, 1);
    if (still)
        perp__find_strengths(world, island, work->strength);
    for (int32_t i = 0; i < island->bodies && still; i++)
        still = perp__mass_norm(world, work->members[i], work->v + world->dof * i) <=
                PERP__SUM_ROUNDING * work->strength[i];
    if (still)
        memset(work->v, 0, (size_t)(world->dof * island->bodies) * sizeof(double));
}

perp_status perp__swing(perp_world *world, const perp__island *island, perp__verdict *verdict)
{
    perp__island_work *work = &world->solve.work;
    double tested;
    perp_status status;

    /* biases J v0, of what turns with bodies along their paths */
    turn_numbers(world, island, work->solved, work->now, 0);
    for (int32_t u = 0; u < work->units; u++)
        for (int32_t k = 0; k < work->rows[u].dim; k++)
            work->rows[u].bias[k] =
                perp__row_velocity(world, u, k, work->solved, island->bodies, 1);
    status = perp__solve_equations(world, island, PERP__REFINED, &tested);
    if (status == PERP_OK)
        check_equations(world, island, tested, verdict);
    return status;
}

void perp__end_swing(perp_world *world, const perp__island *island, double t,
                     perp__verdict *verdict)
{
    double *v = world->solve.work.v;

    verdict->swings = 1;
    turn_numbers(world, island, v, v, 1);
    perp__find_paths(world, island, t);
    turn_numbers(world, island, v, v, 0);
}

/* ---- bounds ----
 *
 * Limits, motors and dry friction of joints where no contact presses. A row's impulse is between 0
 * (limits) or -most and most. Where it is inside the row is an equation (dim = 1); else it is at
 * one of these ends, -1 or 1 in work->modes, and the row is none (dim = 0). Which rows are
 * equations is found by exchanges; what they ask for, by the factors of the joints' block. */

/* The largest impulse: of a limit it is infinite. */
static double most_of(const perp__rigid_rows *rows)
{
    return rows->bounded ? -rows->bias[1] / rows->compliance[0] : INFINITY;
}

/* Rows with bounds are the second ones of their units (step.c): the first ones for now, or back. */
static void swap_rows(perp_world *world, int32_t count)
{
    for (int32_t i = 0; i < count; i++) {
        perp__rigid_rows *rows = &world->solve.work.rows[i];
        const perp__rigid_rows last = *rows;

        for (int32_t k = 0; k < 2 && rows->bounded; k++) {
            rows->bias[k] = last.bias[1 - k];
            for (int32_t side = 0; side < 2; side++)
                memcpy(rows->rows[side][k], last.rows[side][1 - k], sizeof last.rows[side][k]);
        }
    }
}

/* Rows of one joint are the same but for signs. One of them is an equation, which tells at which of
 * their ends the others are. */
static void hold_joint(perp_world *world, int32_t from, int32_t end, int32_t held)
{
    perp__island_work *work = &world->solve.work;
    const bool turned = work->joint_units[held].slot == PERP__SLOT_UPPER;
    const double bias = work->rows[held].bias[0];

    for (int32_t i = from; i < end; i++) {
        perp__rigid_rows *rows = &work->rows[i];
        const bool same = (work->joint_units[i].slot == PERP__SLOT_UPPER) == turned;
        const double u = rows->bias[0] - (same ? bias : -bias);

        rows->dim = i == held;
        if (rows->bounded && fabs(u) > PERP__SUM_ROUNDING * (fabs(rows->bias[0]) + fabs(bias)))
            work->modes[i] = u > 0.0 ? -1 : 1;
    }
}

/* The rows that were equations last, of each joint the first one. */
static void begin_joint(perp_world *world, int32_t from, int32_t end)
{
    perp__island_work *work = &world->solve.work;
    int32_t held = -1;

    for (int32_t i = end - 1; i >= from; i--) {
        const int32_t bounded = work->rows[i].bounded;
        const double *warm = work->warm + 3 * i;

        work->modes[i] = bounded && warm[1] > 0.0 ? 1 : -1;
        work->rows[i].dim = 0;
        if (bounded ? fabs(warm[1]) < warm[0] : warm[0] > 0.0)
            held = i;
    }
    if (held >= 0)
        hold_joint(world, from, end, held);
}

/* Exchanges an equation whose impulse is beyond its ends, or takes as one the first row whose
 * velocity its end does not have: u >= 0 at the lower one, u <= 0 at the upper. Returns whether. */
static int32_t exchange_joint(perp_world *world, const perp__island *island, int32_t from,
                              int32_t end, double tol)
{
    perp__island_work *work = &world->solve.work;

    for (int32_t i = from; i < end; i++) {
        perp__rigid_rows *rows = &work->rows[i];
        const double r = work->impulse[3 * i], most = most_of(rows), bias = rows->bias[0];
        const double u = bias + perp__row_velocity(world, i, 0, work->v, island->bodies, 1);
        const double size = fabs(bias) + perp__normal_terms(world, i, work->v, island->bodies);

        if (rows->dim == 0 && work->modes[i] * u > tol * size) {
            hold_joint(world, from, end, i);
            return 1;
        }
        if (rows->dim == 1 && !(r >= (rows->bounded ? -most : 0.0) && r <= most)) {
            work->modes[i] = r > 0.0 ? 1 : -1;
            rows->dim = 0;
            return 1;
        }
    }
    return 0;
}

/* Joints that begin, or make exchanges: of these at most so many. Returns how many did. */
static int32_t exchange(perp_world *world, const perp__island *island, int32_t count, bool begins,
                        int32_t most, double tol)
{
    const perp__joint_unit *units = world->solve.work.joint_units;
    int32_t wrong = 0;

    for (int32_t from = 0, end = 1; from < count && wrong < most; from = end++) {
        while (end < count && units[end].joint == units[from].joint)
            end++;
        if (begins)
            begin_joint(world, from, end);
        else
            wrong += exchange_joint(world, island, from, end, tol);
    }
    return wrong;
}

/* The velocities `base`, with the impulses of rows at their bounds, which pull with all they may.
 * Returns whether there are any. */
static bool push_by_bounds(perp_world *world, const perp__island *island, const double *base,
                           int32_t count)
{
    perp__island_work *work = &world->solve.work;
    const int32_t n = world->dof;
    bool pushed = 0;

    memcpy(work->free, base, (size_t)(n * island->bodies) * sizeof *base);
    for (int32_t i = 0; i < 2 * count; i++) {
        const perp__rigid_rows *rows = &work->rows[i / 2];
        const int32_t body = rows->body[i % 2];

        if (rows->dim == 1 || !rows->bounded || body < 0 || body >= island->bodies)
            continue;
        pushed = 1;
        for (int32_t k = 0; k < n; k++) {
            const double *C = work->factors + n * n * body + k;
            double r = 0.0;

            for (int32_t j = 0; j < n; j++)
                r += C[n * j] * rows->rows[i % 2][0][j];
            r *= work->modes[i / 2] * most_of(rows);
            for (int32_t j = 0; j < n; j++)
                work->free[n * body + j] += C[n * j] * r;
        }
    }
    return pushed;
}

/* Units as they were, with the impulses that were found. */
static void end_exchanges(perp_world *world, int32_t count)
{
    perp__island_work *work = &world->solve.work;

    for (int32_t i = 0; i < count; i++) {
        perp__rigid_rows *rows = &work->rows[i];
        double *r = work->impulse + 3 * i;

        if (rows->bounded) {
            r[1] = rows->dim == 1 ? r[0] : work->modes[i] * most_of(rows);
            r[0] = most_of(rows);
        }
        rows->dim = 1 + rows->bounded;
    }
    swap_rows(world, count);
    work->inequalities = count;
}

/* The primal-dual active set method (Hintermueller, Ito & Kunisch 2003), from what pressed, drove
 * and stuck last: limits that press are equations, as is what has the speed of a motor or sticks.
 * Where as many exchanges as there are rows come to no end they go on one by one (Murty 1974), and
 * to tol, as velocities of rows that say what others do are but rounding. */
perp_status perp__solve_bounds(perp_world *world, const perp__island *island,
                               perp__verdict *verdict, int32_t *found)
{
    perp__island_work *work = &world->solve.work;
    const int32_t count = work->inequalities;
    const double tol = perp__exact_tol(world);
    const size_t numbers = (size_t)(world->dof * island->bodies);
    int32_t wrong = 1, pushed = 0;
    double tested = INFINITY;
    perp_status status = PERP_OK;

    *found = 0;
    if (work->count > 0)
        return PERP_OK;
    swap_rows(world, count);
    (void)exchange(world, island, count, 1, 1, tol);
    memcpy(work->solved, work->free, numbers * sizeof(double));
    work->inequalities = 0; /* for the equations' sake */
    for (int32_t k = 0; k <= 3 * count && wrong > 0 && status == PERP_OK; k++) {
        pushed = push_by_bounds(world, island, work->solved, count);
        status = perp__solve_equations(world, island, PERP__REFINED, &tested);
        wrong = exchange(world, island, count, 0, k < count ? count : 1,
                         k < count ? PERP__SUM_ROUNDING : tol);
    }
    *found = status == PERP_OK && wrong == 0 && tested <= tol;
    if (*found && pushed) { /* to the rounding of velocities, not to that of bounds' impulses */
        memcpy(work->solved_rows, work->impulse, 3 * (size_t)work->units * sizeof(double));
        memcpy(work->free, work->v, numbers * sizeof(double));
        status = perp__solve_equations(world, island, PERP__REFINED, NULL);
        memcpy(work->impulse, work->solved_rows, 3 * (size_t)work->units * sizeof(double));
    }
    memcpy(work->free, work->solved, numbers * sizeof(double));
    end_exchanges(world, count);
    if (!*found || status != PERP_OK)
        return status;
    memcpy(work->warm, work->impulse, 3 * (size_t)work->units * sizeof *work->warm);
    check_equations(world, island, tested, verdict);
    return PERP_OK;
}
