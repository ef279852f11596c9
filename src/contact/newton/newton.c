/* Method `newton`: an interior point method to where the active set shows, and a semismooth Newton
 * method from there. The Delassus matrix is used as given, unsymmetric or rank-deficient. */
#include "contact/newton/newton.h"

#include <math.h>
#include <string.h>

#include <perp/contact.h>

#include "base/clock.h"
#include "contact/law.h"

/* A warm start goes by the first, and the next attempt by the first again, afresh. */
static const perp__newton_plan plans[] = {{0.95, 1.0, 1.0, 0, 0.0, 0}, {0.9, 0.8, 0.8, 0, 0.0, 0},
                                          {0.95, 1.0, 1.0, 1, 0.0, 0}, {0.95, 1.0, 1.0, 1, 1.0, 0},
                                          {0.95, 1.0, 1.0, 1, 0.0, 1}, {0.95, 1.0, 1.0, 1, 1.0, 2},
                                          {0.95, 1.0, 1.0, 1, 0.0, 3}, {0.95, 1.0, 1.0, 1, 1.0, 4}};
#define PLANS (int32_t)(sizeof plans / sizeof plans[0])
#define LONG_PLANS 3 /* as many for problems of more unknowns than MANY */
#define MANY 1000
#define WARM_STEPS 12 /* of the polish, straight from a warm start */

static perp_status check(const perp__contact_problem *problem)
{
    return perp__newton_matrix_check(problem);
}

static void layout(perp__arena *arena, void *work)
{
    perp__newton *s = work;
    const perp__contact_problem *problem = s->common.problem;
    size_t n = (size_t)problem->size;
    size_t blocks = (size_t)(problem->contacts + problem->size - problem->rows);
    double **const vectors[] = {&s->b,     &s->x,     &s->z,     &s->y,      &s->gap,
                                &s->slope, &s->dx,    &s->dz,    &s->change, &s->rhs,
                                &s->trial, &s->best,  &s->cover, &s->v,      &s->tangent,
                                &s->ahead, &s->along, &s->error, &s->units};

    perp__newton_blocks_layout(arena, &s->blocks, problem);
    perp__newton_matrix_layout(arena, &s->matrix, problem);
    s->scalings = perp__arena_take(arena, blocks, sizeof *s->scalings);
    PERP__DOUBLES(arena, 9 * blocks, &s->L, &s->R);
    for (size_t k = 0; k < sizeof vectors / sizeof vectors[0]; k++)
        *vectors[k] = perp__arena_take(arena, n, sizeof(double));
}

perp_outcome perp__newton_tick(const perp__newton *s, perp_status *status)
{
    const perp__contact_control *control = s->common.problem->control;
    int64_t iterations = s->matrix.factorisations;

    *status = PERP_OK;
    if (iterations >= s->limit)
        return PERP_OUTCOME_ITERATION_LIMIT;
    if (!control)
        return -1;
    if (control->deadline > 0.0 && perp__now() >= control->deadline)
        return PERP_OUTCOME_TIME_LIMIT;
    if (control->tick) {
        int32_t request = control->tick(control->tick_user, iterations, s->residual);

        if (request < 0)
            *status = PERP_ERROR_CALLBACK;
        if (request != 0)
            return PERP_OUTCOME_STOPPED;
    }
    return -1;
}

int32_t perp__newton_is_spent(const perp__newton *s)
{
    const perp__contact_control *control = s->common.problem->control;

    return s->matrix.factorisations >= s->limit ||
           (control && control->deadline > 0.0 && perp__now() >= control->deadline);
}

static void read_right_side(perp__newton *s)
{
    const perp__newton_blocks *b = &s->blocks;
    const perp__contact_problem *problem = s->common.problem;
    const int32_t *part = problem->leaks ? NULL : problem->part;
    double *largest = s->R; /* of each part */

    for (int32_t i = 0; i < b->blocks; i++)
        largest[i] = 0.0;
    for (int32_t i = 0; i < b->n; i++) {
        const int32_t p = part ? part[b->owners[i]] : 0;

        s->b[i] = problem->q[b->rows[i]] * b->scales[i];
        largest[p] = fmax(largest[p], fabs(s->b[i]));
    }
    for (int32_t i = 0; i < b->n; i++) {
        const double most = largest[part ? part[b->owners[i]] : 0];

        s->units[i] = most > 0.0 ? most : 1.0;
        s->b[i] /= s->units[i];
    }
}

static void start_cold(perp__newton *s)
{
    const perp__newton_blocks *b = &s->blocks;

    memset(s->x, 0, (size_t)b->n * sizeof *s->x);
    memset(s->z, 0, (size_t)b->n * sizeof *s->z);
    for (int32_t k = 0; k < b->contacts; k++)
        s->x[b->starts[k]] = s->z[b->starts[k]] = 1.0;
}

/* x = p(v), z = p(-v) at v = x - z(x), which is left in dz, smoothed the more the further x is off.
 */
static void start_warm(perp__newton *s)
{
    const perp__newton_blocks *b = &s->blocks;
    double eps;

    perp__newton_multiply(&s->matrix, s->x, s->y);
    for (int32_t i = 0; i < b->n; i++)
        s->y[i] += s->b[i];
    s->residual = perp__natural_map(b, s->x, s->y, s->dz, NULL);
    eps = fmax(0.3 * s->residual, 1e-3);
    memset(s->z, 0, (size_t)b->n * sizeof *s->z);
    for (int32_t k = 0; k < b->contacts; k++) {
        int32_t at = b->starts[k], d = b->starts[k + 1] - at;
        double negative[3];

        for (int32_t i = 0; i < d; i++)
            negative[i] = -s->dz[at + i];
        perp__cone_smooth(d, &s->dz[at], eps * eps, &s->x[at]);
        perp__cone_smooth(d, negative, eps * eps, &s->z[at]);
    }
}

/* r and the modes from the best x, u = W r + q. */
static void finish(perp__newton *s, perp__contact_iterate *iterate)
{
    const perp__contact_problem *problem = s->common.problem;
    const perp__newton_blocks *b = &s->blocks;

    perp__newton_multiply(&s->matrix, s->best, s->y);
    for (int32_t i = 0; i < b->n; i++)
        s->y[i] += s->b[i];
    perp__natural_map(b, s->best, s->y, s->trial, NULL);
    memset(iterate->r, 0, (size_t)problem->size * sizeof *iterate->r);
    for (int32_t k = 0; k < b->blocks; k++) {
        int32_t at = b->starts[k], d = b->starts[k + 1] - at;
        double low, high;

        if (k < b->contacts) {
            perp__cone_values(d, &s->trial[at], &low, &high);
            iterate->modes[k] = high <= 0.0 ? PERP_CONTACT_SEPARATE
                                : low > 0.0 && (d > 1 || problem->dims[k] == 1) ? PERP_CONTACT_STICK
                                                                                : PERP_CONTACT_SLIP;
            perp__cone_project(d, &s->trial[at], &s->trial[at]);
        }
        for (int32_t i = 0; i < d; i++)
            iterate->r[b->rows[at + i]] = s->trial[at + i] * b->scales[at + i] * s->units[at + i];
    }
    if (problem->bodies) {
        perp__bodies_multiply(problem->bodies, iterate->r, problem->q, iterate->u);
    } else {
        perp__multiply(problem->W, iterate->r, iterate->u);
        for (int32_t i = 0; i < problem->size; i++)
            iterate->u[i] += problem->q[i];
    }
    iterate->has_modes = 1;
    iterate->residual = s->best_residual;
}

/* The polish from r, and the interior point method from near it if that is not enough. */
static perp_status run_warm(perp__newton *s, const double *r, perp_outcome *outcome)
{
    const perp__newton_blocks *b = &s->blocks;
    perp_status status;

    for (int32_t i = 0; i < b->n; i++)
        s->x[i] = r[b->rows[i]] / (b->scales[i] * s->units[i]);
    start_warm(s);
    memcpy(s->trial, s->dz, (size_t)b->n * sizeof *s->trial);
    for (int32_t k = 0; k < b->contacts; k++)
        perp__cone_project(b->starts[k + 1] - b->starts[k], &s->trial[b->starts[k]],
                           &s->trial[b->starts[k]]);
    status = perp__natural_polish(s, WARM_STEPS);
    *outcome = PERP_OUTCOME_STALLED;
    if (status != PERP_OK || s->best_residual <= PERP__NEWTON_ENOUGH)
        return status;
    return perp__interior_run(s, outcome);
}

static perp_status run(perp__newton *s, perp__contact_iterate *iterate)
{
    int32_t attempt =
        iterate->warm && iterate->attempt > 0 ? iterate->attempt - 1 : iterate->attempt;

    if (attempt >= (s->blocks.n > MANY ? LONG_PLANS : PLANS))
        return PERP_OK;
    s->plan = &plans[attempt];
    if (iterate->warm && iterate->attempt == 0)
        return run_warm(s, iterate->r, &iterate->outcome);
    start_cold(s);
    return s->plan->path ? perp__path_run(s, &iterate->outcome)
                         : perp__interior_run(s, &iterate->outcome);
}

static perp_status solve(void *work, perp__contact_iterate *iterate)
{
    perp__newton *s = work;
    const perp__contact_problem *problem = s->common.problem;
    perp_status status;

    iterate->iterations = 0;
    iterate->has_modes = 0;
    iterate->outcome = PERP_OUTCOME_STALLED;
    if (problem->has_discs)
        return PERP_OK; /* not for these cones */
    perp__newton_blocks_read(&s->blocks, problem);
    status = perp__newton_matrix_read(&s->matrix, &s->blocks, problem);
    if (status != PERP_OK)
        return status;
    s->limit = problem->iteration_limit > 0 ? problem->iteration_limit : INT64_MAX;
    s->best_residual = s->residual = INFINITY;
    read_right_side(s);
    status = run(s, iterate);
    if (status == PERP_OK &&
        iterate->outcome != PERP_OUTCOME_STALLED) { /* cut short: where it was */
        perp__natural_start(s);
        status = perp__natural_polish(s, 0);
    }
    iterate->iterations = s->matrix.factorisations;
    if (status != PERP_OK || !isfinite(s->best_residual))
        return status;
    finish(s, iterate);
    if (iterate->residual <= problem->tol)
        iterate->outcome = PERP_OUTCOME_SOLVED;
    else if (iterate->outcome == PERP_OUTCOME_STALLED && iterate->iterations >= s->limit)
        iterate->outcome = PERP_OUTCOME_ITERATION_LIMIT;
    return PERP_OK;
}

static void release(void *work)
{
    perp__newton *s = work;

    perp__newton_matrix_release(&s->matrix);
}

const perp__contact_method perp__contact_newton = {
    PERP_CONTACT_METHOD_NEWTON,
    sizeof(perp__newton),
    PLANS + 1,
    0,
    0,
    check,
    layout,
    solve,
    release,
};
