/* The problem of an island solved to tol by methods of contact/, or as far as the budget goes. */
#include "world/joints/joints.h"

#include "base/context.h"

/* What is solved to tol is so to this, where the caller says nothing; and what methods are asked
 * for beside it: they come to rounding nearly always, and then so does a brick at its threshold. */
#define EXACT_TOL 1e-10
#define SHARPER 1e-2

/* Iterations of each method within which it comes to an answer or hardly ever does. */
#define QUICK 100

double perp__exact_tol(const perp_world *world)
{
    return world->settings.tol > 0.0 ? world->settings.tol : EXACT_TOL;
}

/* The word for the answer at tol. */
static void say_outcome(perp__rigid_answer *answer, double tol)
{
    const perp__evidence evidence = {answer->tested, answer->own_residual, answer->backward, 1};

    answer->outcome = perp__gate(&evidence, tol, answer->outcome);
}

/* ---- velocities in what the rows that hold leave free (contact.h) ---- */

double perp__mass_norm(const perp_world *world, int32_t body, const double *v)
{
    double twist[6], local[3], turning[3];

    perp__twist_of(world, v, twist);
    perp__apply_transposed3(local, world->step.motions[body].rotation, twist + 3);
    perp__apply3(turning, world->bodies.all[body].inverse_factor, local);
    return perp__length2(sqrt(world->bodies.all[body].mass) * perp__length3(twist),
                         perp__length3(turning));
}

/* |C'J'| of a row of a body of the island, whose factor is at hand: a multiple of the identity for
 * the mass centre, and a block for turns. */
static double pushed_by(const double *C, const double *row, int32_t n)
{
    double square, turn = 0.0;

    if (n == 3)
        return perp__length2(C[0] * perp__length2(row[0], row[1]), C[8] * row[2]);
    for (int32_t j = 3; j < 6; j++) {
        const double x = C[18 + j] * row[3] + C[24 + j] * row[4] + C[30 + j] * row[5];

        turn += x * x;
    }
    square = C[0] * C[0] * perp__dot3(row, row) + turn;
    return square > 1e-280 && square < 1e280 ? sqrt(square)
                                             : perp__length2(C[0] * perp__length3(row), sqrt(turn));
}

double perp__moved_by(const perp_world *world, const perp__island *island,
                      const perp__rigid_rows *rows, int32_t k)
{
    const int32_t n = world->dof;
    double sum = 0.0;

    for (int32_t side = 0; side < 2; side++)
        if (rows->body[side] >= 0 && rows->body[side] < island->bodies)
            sum = perp__length2(sum, pushed_by(world->solve.work.factors + n * n * rows->body[side],
                                               rows->rows[side][k], n));
    return sum * sum;
}

void perp__find_strengths(const perp_world *world, const perp__island *island, double *strength)
{
    const perp__island_work *work = &world->solve.work;
    const int32_t n = world->dof;

    for (int32_t i = 0; i < island->bodies; i++)
        strength[i] = perp__mass_norm(world, work->members[i], work->now + n * i) +
                      perp__mass_norm(world, work->members[i], work->gain + n * i);
    for (int32_t i = 0; i < work->units; i++)
        for (int32_t k = 0; k < work->rows[i].dim; k++)
            for (int32_t side = 0; side < 2 && work->impulse[3 * i + k] != 0.0; side++) {
                const int32_t body = work->rows[i].body[side];

                if (body >= 0 && body < island->bodies)
                    strength[body] +=
                        fabs(work->impulse[3 * i + k]) *
                        pushed_by(work->factors + n * n * body, work->rows[i].rows[side][k], n);
            }
}

/* Velocities in what the rows that hold leave free, where they are an answer to the problem's tol
 * with the impulses that there are. */
static perp_status hold(perp_world *world, const perp__island *island, perp__rigid_answer *answer,
                        const perp__rigid_problem *problem)
{
    perp__island_work *work = &world->solve.work;
    const int32_t n = world->dof;
    const size_t numbers = (size_t)(n * island->bodies);
    perp__evidence evidence = {answer->tested, answer->own_residual, answer->backward, 1};
    perp_outcome outcome;
    perp_status status;

    perp__find_strengths(world, island, work->strength);
    memcpy(work->solved, work->v, numbers * sizeof(double));
    memcpy(work->solved_rows, work->velocity, 3 * (size_t)work->units * sizeof(double));
    status = perp__rigid_hold(world->solve.solver, answer, problem);
    if (status != PERP_OK)
        return status;
    /* the largest change of a body's velocity beside its own terms: a light body does not hide
     * behind a heavy one */
    for (int32_t i = 0; i < island->bodies; i++) {
        double change[6], norm;

        for (int32_t k = 0; k < n; k++)
            change[k] = work->v[n * i + k] - work->solved[n * i + k];
        norm = perp__mass_norm(world, work->members[i], change);
        if (norm != 0.0)
            perp__raise_to(&evidence.own_residual, norm / work->strength[i]);
    }
    outcome = perp__gate(&evidence, problem->tol, answer->outcome);
    if (perp__is_good(outcome)) {
        answer->outcome = perp__worse_outcome(outcome, answer->outcome);
        return PERP_OK;
    }
    memcpy(work->v, work->solved, numbers * sizeof(double));
    memcpy(work->velocity, work->solved_rows, 3 * (size_t)work->units * sizeof(double));
    return PERP_OK;
}

/* ---- the methods ---- */

/* By the methods of the contact layer, each for what it takes at accuracy `exact`, where few
 * contacts get all, last resorts as well; else as long as it is quick: at `exact` in vain once a
 * step, as what comes later only adds. */
static perp_status solve(perp_world *world, const perp__island *island, perp__rigid_answer *answer,
                         perp__rigid_problem *problem, int32_t *in_vain)
{
    const int32_t limit = problem->max_iterations;
    const int32_t is_exact = world->settings.accuracy == PERP_ACCURACY_EXACT;
    const bool thorough = is_exact && !*in_vain;
    perp__carrying carrying;
    perp_status status;

    problem->enough = problem->tol;
    problem->tol = SHARPER * problem->enough;
    problem->quick = thorough ? world->solve.work.count > perp__level_of(world)->few &&
                                    !perp__begins_standing(world, island, 0, &carrying)
                              : (problem->contacts > PERP__FEW_CONTACTS) * (1 + is_exact);
    if (!thorough && (limit == 0 || limit > QUICK))
        problem->max_iterations = QUICK;
    status = perp__rigid_solve(world->solve.solver, answer, problem);
    problem->max_iterations = limit;
    problem->tol = problem->enough;
    if (status == PERP_OK)
        say_outcome(answer, problem->tol);
    if (answer->outcome == PERP_OUTCOME_ITERATION_LIMIT && limit == 0 && is_exact)
        answer->outcome = PERP_OUTCOME_STALLED; /* nobody asked for that limit */
    *in_vain |= thorough && !perp__is_good(answer->outcome);
    if (status == PERP_OK && !perp__is_good(answer->outcome) && !is_exact)
        say_outcome(answer, perp__swept_tol(world));
    if (status == PERP_OK && perp__is_good(answer->outcome))
        status = hold(world, island, answer, problem);
    world->solve.work.set_up = status == PERP_OK;
    return status;
}

perp_status perp__solve_rows(perp_world *world, const perp__island *island, bool bounces,
                             perp__verdict *verdict)
{
    perp__island_work *work = &world->solve.work;
    perp__rigid_problem problem;
    perp__rigid_answer answer;
    perp_status status = PERP_OK;
    int32_t found = 0, is_solvable = work->carriers == 0;

    verdict->stands = 0;
    if (!bounces)
        status = perp__stand(world, island, NULL, verdict);
    if (status != PERP_OK || verdict->stands) {
        memcpy(work->warm, work->impulse, 3 * (size_t)work->units * sizeof *work->warm);
        return status;
    }
    status = perp__solve_bounds(world, island, verdict, &found);
    if (status != PERP_OK || found)
        return status;
    perp__turn_contacts(world);
    perp__pose_island(world, island, &problem);
    perp__receive(world, &answer);
    if (island->joints > 0 || !perp__rigid_single(&answer, &problem, SHARPER * problem.tol))
        status = solve(world, island, &answer, &problem, &verdict->in_vain);
    if (status == PERP_ERROR_NOT_FINITE)
        return perp__fail(world->context, status,
                          "the step takes the contacts beyond the range of numbers");
    if (status != PERP_OK)
        return status;
    if (!bounces && perp__is_good(answer.outcome))
        status = perp__stand_partly(world, island, 0, &answer.tested);
    memcpy(work->warm, work->impulse, 3 * (size_t)work->units * sizeof *work->warm);
    perp__spend(world, answer.iterations);
    /* Theory promises a solution (docs/world.md) without restitution and for one that is the same
     * everywhere, unless something that nothing stops closes on a body: then a ray is of the
     * method, not of the scene. */
    for (int32_t i = 1; i < island->contacts && bounces; i++)
        is_solvable &= perp__step_contact(world, island, i)->restitution ==
                       perp__step_contact(world, island, 0)->restitution;
    if (answer.outcome == PERP_OUTCOME_RAY && is_solvable)
        answer.outcome = PERP_OUTCOME_STALLED;
    verdict->outcome = perp__worse_outcome(verdict->outcome, answer.outcome);
    perp__raise_to(&verdict->residual, answer.tested);
    return status;
}
