/* The semismooth Newton method (newton.h) on linear problems: where it begins, and which steps it
 * tries. An active set's step comes before Newton's, see steps.c; the first point comes from a few
 * cheap steps, or from the path of the smoothed equations. */
#include "lcp/fischer/fischer.h"

#include <float.h>

#include "base/clock.h"

#define LAST 1e-5 /* mu below which the path takes Phi = 0; where that fails, a share of it */

/* Before attempt 0, 1, ... from a cold start and from a warm one: different starts end in different
 * local minima of Psi. */
typedef struct start {
    int32_t sweeps, jacobi;
    int32_t by_sets; /* tries active-set steps */
    int32_t path;    /* follows the smoothed equation first */
} start;

static const start starts[2][PERP__FISCHER_STARTS] = {
    {{10, 0, 1, 0}, {0, 0, 1, 1}, {0, 20, 1, 0}, {0, 0, 0, 0}, {0, 60, 0, 0}},
    {{0, 0, 1, 0}, {0, 0, 1, 1}, {10, 0, 1, 0}, {0, 20, 1, 0}, {0, 60, 0, 0}},
};

static void layout(perp__arena *arena, void *object)
{
    perp__fischer_state *s = object;
    const size_t n = (size_t)s->common.problem->n;

    perp__newton_layout(arena, &s->newton, n);
    s->active = perp__arena_take(arena, n, sizeof(int32_t));
    PERP__DOUBLES(arena, n, &s->weights, &s->kept_z);
    s->places = perp__arena_take(arena, n, sizeof(int8_t));
    s->next_places = perp__arena_take(arena, n, sizeof(int8_t));
}

static perp_status evaluate(perp__newton *f, const double *z, double *w)
{
    const perp__fischer_state *s = f->owner;

    perp__lcp_affine(s->common.problem, z, w);
    return PERP_OK;
}

/* Sweeps of projected Gauss-Seidel for as long as the residual falls. */
static void sweeps(perp__fischer_state *s, int32_t count)
{
    const perp__lcp_problem *p = s->common.problem;
    perp__newton *f = &s->newton;
    double last = f->best_residual;

    for (int32_t k = 0; k < count && !perp__is_past(p->control->deadline); k++) {
        perp__lcp_sweep(p, f->z, f->w);
        perp__newton_note(f);
        if (!(f->best_residual <= PERP__PROGRESS * last))
            break;
        last = f->best_residual;
    }
}

static perp_status begin(perp__newton *f)
{
    const perp__fischer_state *s = f->owner;

    if (f->iterations > 0)
        f->outcome = perp__lcp_tick(s->common.problem->control, f->iterations, f->best_residual);
    if (f->outcome >= 0)
        return PERP_OK;
    if (f->best_residual <= f->target)
        f->outcome = PERP_OUTCOME_SOLVED;
    else if (s->quick && s->failures > 0)
        f->outcome = PERP_OUTCOME_STALLED;
    else if (f->iterations >= f->limit)
        f->outcome = PERP_OUTCOME_ITERATION_LIMIT;
    return PERP_OK;
}

/* One step of either kind. */
static perp_status step(perp__newton *f, void *user)
{
    perp__fischer_state *s = user;
    const perp__sparse_block *block = s->common.problem->block;
    perp_status moved = 0;

    perp__newton_follow_path(f);
    if (s->by_sets && f->smoothing == 0.0) {
        moved = perp__fischer_active_step(s);
        if (moved == 0 && f->least > DBL_EPSILON)
            perp__newton_smooth(f, f->least *= PERP__FISCHER_SHARE);
    }
    if (moved == 0 && !block->late) /* else another factorisation is too late as well */
        moved = perp__newton_by_direction(f);
    return moved != 0 || block->late ? moved : perp__newton_descend(f);
}

static perp_status solve(void *object, perp__lcp_iterate *iterate)
{
    static const perp__newton_problem linear = {evaluate, perp__fischer_direction, begin};
    perp__fischer_state *s = object;
    perp__newton *f = &s->newton;
    const perp__lcp_problem *p = s->common.problem;
    const start *first = &starts[iterate->warm ? 1 : 0][iterate->attempt];
    perp_status status;

    f->problem = &linear;
    f->owner = s;
    f->n = p->n;
    f->projects = 0;
    f->lower = p->lower;
    f->upper = p->upper;
    f->S = *p->M;
    f->penalty = p->settings->penalty;
    f->z = iterate->z;
    f->limit = p->iteration_limit > 0 ? p->iteration_limit : PERP__ITERATIONS;
    f->target = p->tol;
    f->path = first->path;
    f->least = first->path ? LAST : 0.0;
    s->by_sets = first->by_sets;
    /* what the active sets of an unsymmetric S miss at first is left to the path */
    s->quick = iterate->attempt == 0 && !p->block->is_symmetric;
    s->has_places = s->watched = s->failures = 0;
    s->rho = 0.0;
    /* 1. Where Newton's method begins: a guess at which bounds are active, safe for any S since
     * only the best point met is kept. */
    perp__newton_start(f);
    perp__newton_set_point(f);
    sweeps(s, first->sweeps);
    for (int32_t k = 0; k < first->jacobi && !perp__is_past(p->control->deadline); k++) {
        for (int32_t i = 0; i < p->n; i++) { /* z := mid(l, u, z - w_i / |S_i|_1) */
            const double norm = p->row_norms[i] > 0.0 ? p->row_norms[i] : 1.0;

            f->z[i] = perp__clamp(f->z[i] - f->w[i] / norm, p->lower[i], p->upper[i]);
        }
        perp__newton_set_point(f);
    }
    perp__copy(f->z, f->best, p->n);
    perp__newton_set_point(f);
    /* 2. Its steps. */
    status = perp__newton_iterate(f, step, s);
    for (int32_t i = 0; i < p->n; i++)
        iterate->z[i] = perp__clamp(f->best[i], p->lower[i], p->upper[i]);
    iterate->iterations = f->iterations;
    iterate->outcome = f->best_residual <= f->target ? PERP_OUTCOME_SOLVED : f->outcome;
    iterate->has_places = 0;
    return status;
}

const perp__lcp_method perp__lcp_fischer = {
    PERP_LCP_FISCHER,
    sizeof(perp__fischer_state),
    PERP__FISCHER_STARTS,
    0,
    NULL,
    layout,
    solve,
    NULL,
};
