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

/* Iterations of each method within which it comes to an answer or hardly ever does: all that is
 * spent, but at accuracy `exact`. Piles in motion get fewer at first, with joints or without. At
 * `exact` few contacts get all, last resorts as well; more of them only if they have come as near
 * as this: others that are hit hard have an answer out of reach. */
#define QUICK 100
#define HURRIED 25
#define HURRIED_JOINTS 40
#define FEW 64
#define FEW_PLANAR 200
#define PROMISING 1e-4

/* Contacts beyond which an island is swept where that does not bring it to an answer quickly. */
#define SMALL 8

/* Joints, and contacts beside them, up to which sweeps come to an answer as fast as proximal's
 * method; and the residual that joints may be left with where methods come to no better one. */
#define FEW_JOINTS 8
#define JOINT_TOL 1e-6

/* Passes over what the methods did not solve. */
#define LEAST_PASSES 8

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

static int32_t most_thorough(const perp_world *world)
{
    return world->settings.planar ? FEW_PLANAR : FEW;
}

/* Piles in motion, and what hangs together by joints: these hold at any effort
 * (contact/condensed.c), what is missing then is the contacts'. */
static int32_t is_hurried(const perp_world *world, const perp__island *island)
{
    const int32_t joints = island->joints > 0, accuracy = world->settings.accuracy;
    const int32_t thorough =
        accuracy == PERP_ACCURACY_EXACT || (joints && accuracy == PERP_ACCURACY_ACCURATE);

    if (world->work.count <= (thorough ? most_thorough(world) : SMALL))
        return 0;
    return joints ? accuracy != PERP_ACCURACY_EXACT && world->settings.tol == 0.0
                  : !perp__comes_from_rest(world, island);
}

static perp_status solve_by(perp_world *world, const perp__island *island,
                            perp__rigid_answer *answer, perp__rigid_problem *problem)
{
    const int32_t limit = problem->max_iterations;
    const int32_t most = !is_hurried(world, island) ? QUICK
                         : island->joints > 0       ? HURRIED_JOINTS
                                                    : HURRIED;
    perp_status status;

    problem->tol = SHARPER * perp__exact_tol(world);
    problem->max_iterations = limit == 0 || limit > most ? most : limit;
    status = perp__rigid_solve(world->solver, answer, problem);
    problem->max_iterations = limit;
    problem->tol = perp__exact_tol(world);
    if (status == PERP_OK)
        say_outcome(answer, perp__exact_tol(world));
    if (answer->outcome == PERP_OUTCOME_ITERATION_LIMIT && limit == 0)
        answer->outcome = PERP_OUTCOME_STALLED; /* nobody asked for that limit */
    return status;
}

/* What will do where methods come to no better: at `exact` nothing else. Joints are not to give way
 * visibly. */
static double rough_tol(const perp_world *world, const perp__rigid_answer *answer)
{
    const double tol = perp__swept_tol(world);

    return answer->joints <= JOINT_TOL ? tol : fmin(tol, JOINT_TOL);
}

/* Joints couple their bodies too tightly for sweeps: they are taken out, or, where they can't be,
 * proximal solves their equations at once. */
static perp_status solve_quickly(perp_world *world, const perp__island *island,
                                 perp__rigid_answer *answer, perp__rigid_problem *problem,
                                 double *tol)
{
    const int32_t method = problem->method;
    perp_status status = PERP_OK;

    problem->brief = world->settings.accuracy != PERP_ACCURACY_EXACT && problem->contacts > SMALL &&
                     (island->joints == 0 || is_hurried(world, island));
    if (island->joints + island->contacts * (island->joints > 0) > FEW_JOINTS &&
        method == PERP_CONTACT_METHOD_AUTO && problem->cone == 0) {
        problem->method = PERP_CONTACT_METHOD_PROXIMAL;
        status = solve_by(world, island, answer, problem);
        problem->method = method;
        if (status == PERP_OK && !perp__is_good(answer->outcome))
            say_outcome(answer, *tol = rough_tol(world, answer));
        if (status != PERP_OK || perp__is_good(answer->outcome))
            return status;
        *tol = perp__exact_tol(world);
        problem->again = 1;
    }
    return solve_by(world, island, answer, problem);
}

static int32_t is_worth_more(const perp_world *world, const perp__island *island,
                             const perp__rigid_answer *answer)
{
    if (perp__is_good(answer->outcome))
        return 0;
    if (world->settings.accuracy != PERP_ACCURACY_EXACT)
        return island->joints > 0 && !(answer->joints <= JOINT_TOL && is_hurried(world, island));
    return !is_hurried(world, island) || fmax(answer->tested, answer->own) <= PROMISING;
}

/* From where that has come to, with all that the methods have: last resorts too for what rests, or
 * is little. */
static perp_status solve_thoroughly(perp_world *world, const perp__island *island,
                                    perp__rigid_answer *answer, perp__rigid_problem *problem)
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
    problem->brief = is_hurried(world, island) ||
                     (work->count > most_thorough(world) && !perp__begins_at_rest(world, island));
    status = perp__rigid_solve(world->solver, answer, problem);
    answer->iterations += spent;
    return status;
}

/* A method that a budget or a stall ended short of an answer: a few passes from where it came to,
 * which keep bodies apart as far as they come. Taken where they are nearer. */
static perp_status sweep_on(perp_world *world, perp__rigid_answer *answer,
                            const perp__rigid_problem *problem)
{
    perp__island_work *work = &world->work;
    const perp__rigid_answer first = *answer;
    perp__rigid_problem swept = *problem;
    perp__passes passes = {0};
    perp_status status;

    passes.h = 1.0;
    passes.passes = LEAST_PASSES;
    memcpy(work->warm, work->impulse, 3 * (size_t)work->count * sizeof(double));
    swept.warm = work->warm;
    swept.again = 1;
    swept.max_iterations = -1; /* only a look */
    status = perp__coloured_step(&world->coloured, answer, NULL, &swept, &passes);
    if (status != PERP_OK)
        return status;
    swept.warm = work->impulse;
    status = perp__rigid_solve(world->solver, answer, &swept);
    if (status == PERP_OK && !(answer->own < first.own)) {
        swept.warm = work->warm;
        status = perp__rigid_solve(world->solver, answer, &swept);
    }
    answer->iterations = first.iterations + LEAST_PASSES;
    if (!perp__is_good(answer->outcome))
        answer->outcome = first.outcome;
    return status;
}

/* By all that there is, as far as the budget goes. */
static perp_status solve(perp_world *world, const perp__island *island, perp__rigid_answer *answer,
                         perp__rigid_problem *problem)
{
    double tol = perp__exact_tol(world);
    perp_status status = solve_quickly(world, island, answer, problem, &tol);

    if (status == PERP_OK && !perp__is_good(answer->outcome) &&
        world->settings.accuracy != PERP_ACCURACY_EXACT)
        say_outcome(answer, tol = rough_tol(world, answer));
    if (status == PERP_OK && is_worth_more(world, island, answer))
        status = solve_thoroughly(world, island, answer, problem);
    if (status == PERP_OK && !perp__is_good(answer->outcome) &&
        answer->outcome != PERP_OUTCOME_RAY && island->joints == 0)
        status = sweep_on(world, answer, problem);
    if (status == PERP_OK && perp__is_good(answer->outcome))
        status = perp__hold_island(world, island, answer, problem, tol);
    if (status == PERP_OK && perp__is_good(answer->outcome))
        status = perp__rest_joints(world, island, answer, problem);
    world->work.set_up = status == PERP_OK;
    return status;
}

/* What begins with the motion of what carries it, and is not hit: whether it keeps that. */
static perp_status stand(perp_world *world, const perp__island *island, perp__verdict *verdict)
{
    perp__carrying carrying;

    verdict->stands = 0;
    if (!perp__begins_standing(world, island, &carrying))
        return PERP_OK;
    return perp__stand(world, island, &carrying, verdict, &verdict->stands);
}

perp_status perp__solve_rows(perp_world *world, const perp__island *island, int32_t bounces,
                             perp__verdict *verdict)
{
    perp__island_work *work = &world->work;
    perp__rigid_problem problem;
    perp__rigid_answer answer;
    perp_status status = PERP_OK;

    verdict->stands = 0;
    if (!bounces)
        status = stand(world, island, verdict);
    if (status != PERP_OK || verdict->stands) {
        memcpy(work->warm, work->impulse, 3 * (size_t)work->units * sizeof *work->warm);
        return status;
    }
    perp__pose_island(world, island, &problem);
    perp__receive(world, &answer);
    if (island->joints > 0 || !perp__rigid_single(&answer, &problem, SHARPER * problem.tol))
        status = solve(world, island, &answer, &problem);
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
