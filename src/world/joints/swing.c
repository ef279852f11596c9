/* What only swings on its joints: nothing touches it, no limit is reached, nothing drives it. Then
 *
 *   J (v0 + v1) = 0,   impulses J'r,
 *
 * J that of the path gone by (trial.c). Whatever J is, these do no work, r'J (v0 + v1) / 2 = 0, and
 * neither does the implicit midpoint rule: energy is kept, and joints stay closed where J is that
 * of the path itself. What is left to do at its end is in projection.c. */
#include "world/joints/joints.h"

#include <math.h>

#include "linalg/spatial.h"

int32_t perp__swings(const perp_world *world, const perp__island *island)
{
    const perp__island_work *work = &world->work;

    if (island->joints == 0 || island->contacts > 0 || work->inequalities > 0)
        return 0;
    for (int32_t i = 0; i < work->units; i++)
        if (work->joint_units[i].slot >= PERP__SLOT_MOTOR)
            return 0;
    return 1;
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
    status = perp__coloured_step(&world->coloured, &answer, NULL, &problem, &passes);
    if (residual)
        *residual = status == PERP_OK ? answer.tested : INFINITY;
    return status;
}

/* x := y with angular velocities as bodies see them that turn along their paths, or back. */
static void turn_numbers(perp_world *world, const perp__island *island, double *x, const double *y,
                         int32_t back)
{
    const int32_t n = world->dof;

    for (int32_t i = 0; i < island->bodies; i++) {
        double twist[6], seen[3];

        perp__twist_of(world, y + n * i, twist);
        if (back)
            perp__apply_transposed3(seen, world->work.paths[i].turn, twist + 3);
        else
            perp__apply3(seen, world->work.paths[i].turn, twist + 3);
        perp__copy3(twist + 3, seen);
        perp__coordinates_of(world, twist, x + n * i);
    }
}

void perp__mean_of_ends(perp_world *world, const perp__island *island)
{
    perp__island_work *work = &world->work;

    turn_numbers(world, island, work->moving, work->v, 1);
    for (int32_t i = 0; i < world->dof * island->bodies; i++)
        work->moving[i] = 0.5 * (work->now[i] + work->moving[i]);
}

/* What the velocities are worth. What hangs still is pinned by nothing along its way: they are 0
 * where all are no more than the rounding of what they are made of. */
void perp__judge_equations(perp_world *world, const perp__island *island, double tested,
                           perp__verdict *verdict)
{
    perp__island_work *work = &world->work;
    const perp__evidence evidence = {
        .sound = 1, .tested = tested, .own = tested, .backward = tested};

    verdict->stands = 0;
    verdict->outcome = perp__worse_outcome(
        verdict->outcome, perp__gate(&evidence, perp__exact_tol(world), PERP_OUTCOME_SOLVED));
    perp__raise_to(&verdict->residual, tested);
    perp__spend(world, 1);
    if (work->carriers == 0) {
        perp__find_strengths(world, island, work->strength);
        perp__stop_still(world, island);
    }
}

perp_status perp__swing(perp_world *world, const perp__island *island, perp__verdict *verdict)
{
    perp__island_work *work = &world->work;
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
        perp__judge_equations(world, island, tested, verdict);
    return status;
}

void perp__end_swing(perp_world *world, const perp__island *island, double t,
                     perp__verdict *verdict)
{
    double *v = world->work.v;

    verdict->swings = 1;
    turn_numbers(world, island, v, v, 1);
    perp__find_paths(world, island, t);
    turn_numbers(world, island, v, v, 0);
}
