/* Velocities in what the rows that hold leave free (contact.h), where they are an answer as well.
 */
#include "world/step.h"

#include <math.h>
#include <string.h>

#include "linalg/spatial.h"

/* |C^-1 v| of a body: twice its square is the kinetic energy. */
double perp__mass_norm(const perp_world *world, int32_t body, const double *v)
{
    double twist[6], own[3], turning[3];

    perp__twist_of(world, v, twist);
    perp__apply_transposed3(own, world->motions[body].rotation, twist + 3);
    perp__apply3(turning, world->bodies[body].inverse_factor, own);
    return perp__length2(sqrt(world->bodies[body].mass) * perp__length3(twist),
                         perp__length3(turning));
}

double perp__mass_product(const perp_world *world, int32_t body, const double *x, const double *y)
{
    const double a = perp__mass_norm(world, body, x), b = perp__mass_norm(world, body, y);
    double both[6], c;

    for (int32_t k = 0; k < world->dof; k++)
        both[k] = x[k] + y[k];
    c = perp__mass_norm(world, body, both);
    return 0.5 * (c * c - a * a - b * b);
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
        if (rows->body[side] >= 0 && rows->body[side] < island->bodies) {
            const double norm =
                pushed_by(world->work.factors + n * n * rows->body[side], rows->rows[side][k], n);

            sum += norm * norm;
        }
    return sum;
}

void perp__find_strengths(const perp_world *world, const perp__island *island, double *strength)
{
    const perp__island_work *work = &world->work;
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

/* Velocities in what the rows that hold leave free, where they are an answer as well. */
perp_status perp__hold_island(perp_world *world, const perp__island *island,
                              perp__rigid_answer *answer, const perp__rigid_problem *problem,
                              double tol)
{
    perp__island_work *work = &world->work;
    const int32_t n = world->dof;
    const size_t numbers = (size_t)(n * island->bodies);
    perp__evidence evidence = {answer->tested, answer->own, answer->backward, 1};
    perp_outcome outcome;
    perp_status status;

    perp__find_strengths(world, island, work->strength);
    memcpy(work->solved, work->v, numbers * sizeof(double));
    memcpy(work->solved_rows, work->velocity, 3 * (size_t)work->units * sizeof(double));
    status = perp__rigid_hold(world->solver, answer, problem);
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
            perp__raise_to(&evidence.own, norm / work->strength[i]);
    }
    outcome = perp__gate(&evidence, tol, answer->outcome);
    if (perp__is_good(outcome)) {
        answer->outcome = perp__worse_outcome(outcome, answer->outcome);
        return PERP_OK;
    }
    memcpy(work->v, work->solved, numbers * sizeof(double));
    memcpy(work->velocity, work->solved_rows, 3 * (size_t)work->units * sizeof(double));
    return PERP_OK;
}
