/* The problem of an island solved to tol by the methods of the contact layer, or as far as the
 * budget goes. */
#include "world/joints/joints.h"

#include <math.h>
#include <string.h>

#include "base/context.h"
#include "world/islands/standing.h"

/* What is solved to tol is so to this, where the caller says nothing; and what the methods are
 * asked for beside it: they come to rounding nearly always, and then so does a brick at its
 * threshold. */
#define EXACT_TOL 1e-10
#define SHARPER 1e-2

/* Iterations of each method within which it comes to an answer or hardly ever does. */
#define QUICK 100

double perp__exact_tol(const perp_world *world)
{
    return world->settings.tol > 0.0 ? world->settings.tol : EXACT_TOL;
}

/* Whether theory promises a solution (docs/world.md): always without restitution and for one that
 * is the same everywhere, unless something that nothing stops closes on a body. */
static int32_t is_solvable(const perp_world *world, const perp__island *island, int32_t bounces)
{
    double restitution = -1.0;

    if (world->work.carriers > 0)
        return 0;
    for (int32_t i = 0; i < island->contacts && bounces; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);

        if (restitution >= 0.0 && contact->restitution != restitution)
            return 0;
        restitution = contact->restitution;
    }
    return 1;
}

/* The word for the answer at tol. */
static void say_outcome(perp__rigid_answer *answer, double tol)
{
    const perp__evidence evidence = {answer->tested, answer->own, answer->backward, 1};

    answer->outcome = perp__gate(&evidence, tol, answer->outcome);
}

/* By the methods of the contact layer, each for what it takes at accuracy `exact`, where few
 * contacts get all, last resorts as well; else as long as it is quick: at `exact` in vain once a
 * step, as what comes later only adds. */
static perp_status solve_by(perp_world *world, const perp__island *island,
                            perp__rigid_answer *answer, perp__rigid_problem *problem,
                            int32_t *in_vain)
{
    const int32_t limit = problem->max_iterations;
    const int32_t is_exact = world->settings.accuracy == PERP_ACCURACY_EXACT;
    const int32_t thorough = is_exact && !*in_vain;
    perp__carrying carrying;
    perp_status status;

    problem->enough = problem->tol;
    problem->tol = SHARPER * problem->enough;
    problem->brief = thorough ? world->work.count > perp__level_of(world)->few &&
                                    !perp__begins_standing(world, island, 0, &carrying)
                              : (problem->contacts > PERP__FEW_CONTACTS) * (1 + is_exact);
    if (!thorough && (limit == 0 || limit > QUICK))
        problem->max_iterations = QUICK;
    status = perp__rigid_solve(world->solver, answer, problem);
    problem->max_iterations = limit;
    problem->tol = problem->enough;
    if (status == PERP_OK)
        say_outcome(answer, problem->tol);
    if (answer->outcome == PERP_OUTCOME_ITERATION_LIMIT && limit == 0 && is_exact)
        answer->outcome = PERP_OUTCOME_STALLED; /* nobody asked for that limit */
    *in_vain |= thorough && !perp__is_good(answer->outcome);
    return status;
}

static perp_status solve(perp_world *world, const perp__island *island, perp__rigid_answer *answer,
                         perp__rigid_problem *problem, int32_t *in_vain)
{
    double tol = problem->tol;
    perp_status status = solve_by(world, island, answer, problem, in_vain);

    if (status == PERP_OK && !perp__is_good(answer->outcome) &&
        world->settings.accuracy != PERP_ACCURACY_EXACT)
        say_outcome(answer, tol = perp__swept_tol(world));
    if (status == PERP_OK && perp__is_good(answer->outcome))
        status = perp__hold_island(world, island, answer, problem, tol);
    if (status == PERP_OK && perp__is_good(answer->outcome) && island->joints > 0 &&
        world->work.carriers == 0)
        perp__stop_still(world, island);
    world->work.set_up = status == PERP_OK;
    return status;
}

perp_status perp__solve_rows(perp_world *world, const perp__island *island, int32_t bounces,
                             perp__verdict *verdict)
{
    perp__island_work *work = &world->work;
    perp__rigid_problem problem;
    perp__rigid_answer answer;
    perp_status status = PERP_OK;
    int32_t found = 0;

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
    memcpy(work->warm, work->impulse, 3 * (size_t)work->units * sizeof *work->warm);
    perp__spend(world, answer.iterations);
    if (answer.outcome == PERP_OUTCOME_RAY && is_solvable(world, island, bounces))
        answer.outcome = PERP_OUTCOME_STALLED; /* of the method, not of the scene */
    verdict->outcome = perp__worse_outcome(verdict->outcome, answer.outcome);
    perp__raise_to(&verdict->residual, answer.tested);
    return PERP_OK;
}
