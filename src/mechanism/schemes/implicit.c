/* The step with everything at its end (Stewart & Trinkle 1995): a nonlinear complementarity problem
 * (implicit.h, implicit_function.c) that starts from the answer of the frozen step. Where Newton's
 * method does not get from there to a solution the step is the frozen one: no start far from it is
 * tried, as the solutions found so would be others than the motion's.
 *
 * As in the frozen step only contacts within reach are part of the problem, and restitution is a
 * second stage, here with the rows at q+. */
#include "mechanism/schemes/implicit.h"

#include <math.h>
#include <string.h>

#include "ncp/ncp.h"

#define COARSEST 1e-6 /* tolerance, however short the step is */
#define MOST_STEPS 50 /* of Newton, of each method: an answer is near, or there is none */

/* ---- memory -------------------------------------------------------------------------------- */

static void layout(perp__arena *arena, void *object)
{
    perp__implicit *s = object;
    const perp_mechanism *m = s->m;

    s->discs = perp__arena_take(arena, (size_t)(m->contacts + m->dry), sizeof *s->discs);
    PERP__DOUBLES(arena, (size_t)s->most, &s->z, &s->w, &s->start, &s->lower, &s->upper,
                  &s->changed, &s->shifted, &s->at, &s->F);
    PERP__DOUBLES(arena, (size_t)m->rows, &s->r, &s->u, &s->inverse_mass, &s->bent_r);
    s->q = perp__arena_take(arena, (size_t)m->coordinates, sizeof(double));
    PERP__DOUBLES(arena, (size_t)m->n, &s->steps, &s->bent_at);
    s->bent = perp__arena_take(arena, (size_t)m->n * (size_t)s->most, sizeof(double));
}

static perp_status set_up(perp_mechanism *m, perp__implicit *s)
{
    perp_ncp_problem problem;
    perp_status status = perp_ncp_problem_init(&problem, sizeof problem);

    problem.n = s->size;
    problem.storage = PERP_STORAGE_COLUMN_MAJOR;
    problem.function = perp__implicit_function;
    problem.jacobian = perp__implicit_jacobian;
    problem.lower = s->lower;
    problem.upper = s->upper;
    problem.user = m;
    PERP__THEN(status, perp__ncp_setup(s->solver, &problem));
    return status == PERP_OK ? status : perp__mechanism_fail_in(m, status, "the implicit step");
}

/* The solver, with room for the largest problem. */
static perp_status create_solver(perp_mechanism *m, perp__implicit *s)
{
    perp_status status = perp_ncp_settings_init(&s->settings, sizeof s->settings);

    s->settings.restarts = 0;
    s->settings.max_iterations = 2 * MOST_STEPS;
    for (int32_t i = 0; i < s->most; i++) {
        s->lower[i] = -INFINITY;
        s->upper[i] = INFINITY;
    }
    PERP__THEN(status, perp__ncp_create(m->context, &s->solver, &s->settings));
    if (status != PERP_OK)
        return perp__mechanism_fail_in(m, status, "the implicit step");
    s->size = s->most;
    return set_up(m, s);
}

perp_status perp__implicit_create(perp_mechanism *m, perp__implicit **made,
                                  const perp_mechanism_settings *settings)
{
    perp__implicit *s;
    perp_status status;

    *made = NULL;
    if (settings->scheme != PERP_MECHANISM_IMPLICIT)
        return PERP_OK;
    s = perp__work_create(m, sizeof *s, NULL);
    if (!s)
        return PERP_ERROR_MEMORY;
    s->most = perp__implicit_most(m, settings->cone);
    status = perp__arena_fit(&s->arena, m->context, layout, s);
    PERP__THEN(status, create_solver(m, s));
    if (status == PERP_OK)
        *made = s;
    else
        perp__implicit_release(s);
    return status;
}

void perp__implicit_release(perp__implicit *s)
{
    if (s)
        perp__ncp_destroy(s->solver);
    perp__work_release(s);
}

/* ---- the step ------------------------------------------------------------------------------ */

/* The solver was asked for no more than rounding of q leaves of gap / h, or says itself that
 * rounding is what is left: a backward error of as little. */
static void judge(const perp_mechanism *m, perp__implicit *s, const perp_ncp_result *result)
{
    const perp__evidence evidence = {result->residual, result->residual, 0.0, 1};

    s->residual = result->residual;
    s->outcome = perp__worse_outcome(result->outcome,
                                     perp__gate(&evidence, m->settings.tol, result->outcome));
}

/* Where velocities pass through 0, rows consist of the rounding of gaps and forces alone, which no
 * linear terms show: the second witness is asked again for what these are good to. */
static perp_status ask_again(const perp_mechanism *m, perp__implicit *s, perp_ncp_result *result)
{
    const int64_t iterations = result->iterations;
    perp_status status;

    if (perp__is_good(result->outcome) || !(result->residual <= m->settings.tol) ||
        s->settings.tol >= COARSEST)
        return PERP_OK;
    s->settings.tol = COARSEST;
    memcpy(s->start, s->z, (size_t)s->size * sizeof *s->z);
    status = perp__ncp_set(s->solver, &s->settings);
    PERP__THEN(status, perp__ncp_solve(s->solver, s->z, s->w, result, s->start));
    result->iterations += iterations;
    return status;
}

/* s->z, s->w := the problem's solution, from the frozen answer; found: whether there is one. */
static perp_status solve(perp_mechanism *m, perp__implicit *s, perp_mechanism_step *step,
                         int32_t *found)
{
    perp_ncp_result result;
    perp_status status = perp_ncp_result_init(&result, sizeof result);

    *found = 0;
    s->is_at = s->is_bent = 0;
    s->failed = PERP_OK;
    perp__implicit_number(m, s);
    perp__implicit_start(m, s, s->start);
    s->settings.tol = fmin(fmax(m->settings.tol, s->noise), fmax(m->settings.tol, COARSEST));
    s->settings.time_limit = perp__mechanism_time_left(m);
    PERP__THEN(status, perp__ncp_set(s->solver, &s->settings));
    PERP__THEN(status, set_up(m, s));
    PERP__THEN(status, perp__ncp_solve(s->solver, s->z, s->w, &result, s->start));
    PERP__THEN(status, ask_again(m, s, &result));
    if (s->failed != PERP_OK) { /* what the callback said, not what came of it */
        memcpy(m->context->message, s->message, sizeof s->message);
        return s->failed;
    }
    if (status != PERP_OK)
        return perp__mechanism_fail_in(m, status, "the implicit step");
    step->iterations += result.iterations;
    if (!perp__is_good(result.outcome))
        return PERP_OK;
    judge(m, s, &result);
    status = perp__implicit_evaluate(m, s, s->z);
    *found = status == PERP_OK;
    return status == PERP__OUTSIDE ? PERP_OK : status;
}

/* Includes contacts that the solution passes; whether there were any. */
static int32_t include_passed(perp_mechanism *m)
{
    int32_t more = 0, j;

    for (j = 0; j < m->contacts; j++)
        more |= perp__include(m, j, m->end.gap[j] < fmin(m->begin.gap[j], 0.0));
    return more;
}

/* Where the frozen step has no answer its last iterate may be anything: the start is then the
 * motion without impulses. */
static void start_free(perp_mechanism *m)
{
    perp__motion *answer = &m->answer;

    memcpy(answer->v, m->free, (size_t)m->n * sizeof *answer->v);
    memcpy(answer->u, m->free_velocity, (size_t)m->rows * sizeof *answer->u);
    memset(answer->r, 0, (size_t)m->rows * sizeof *answer->r);
    memset(answer->modes, 0, (size_t)(m->contacts + m->dry) * sizeof *answer->modes);
}

/* m->answer := the implicit step's, if there is one. */
static perp_status find(perp_mechanism *m, perp_mechanism_step *step, int32_t *found)
{
    perp__implicit *s = m->implicit;
    perp__velocity_problem problem;
    perp_status status = perp__evaluate_all(m, &m->begin, s->from.t, s->from.q, s->from.v);

    *found = 0;
    if (status != PERP_OK)
        return status;
    perp__prepare_step(m, &s->from);
    perp__pose(m, &problem);
    status = perp__solve_frozen(m, &problem);
    if (status != PERP_OK || !perp__outcome_moves(m->answer.outcome))
        return status;
    if (!perp__is_good(m->answer.outcome))
        start_free(m);
    do
        status = solve(m, s, step, found);
    while (status == PERP_OK && *found && include_passed(m));
    if (status == PERP_OK && *found)
        perp__implicit_answer(m, s, s->z, s->w);
    return status;
}

perp_status perp__advance_implicit(perp_mechanism *m, perp__motion *to, perp_mechanism_step *step,
                                   const perp__start *from)
{
    perp__implicit *s = m->implicit;
    perp__velocity_problem problem;
    perp_status status;
    int32_t found;

    s->from = *from;
    status = find(m, step, &found);
    if (status == PERP_OK && !found) {
        step->iterations += m->answer.iterations; /* which the frozen step counts anew */
        return perp__advance_frozen(m, to, step, from);
    }
    PERP__THEN(status, perp__evaluate_move(m, to->q, from->q, from->h, m->answer.v));
    if (status != PERP_OK)
        return status;
    step->scheme = PERP_MECHANISM_IMPLICIT;
    perp__pose(m, &problem);
    problem.terms = &m->end;
    return perp__finish_step(m, to, step, from->t + from->h, &problem);
}
