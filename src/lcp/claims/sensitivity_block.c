/* The index set of a solution, how clear it is, and the factors of its block. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "lcp/claims/sensitivity.h"
#include "linalg/principal.h"

/* Below this size a sparse block is factored as a dense one. */
#define PERP__SMALL_BLOCK 64

static int32_t uses_csc(const perp_lcp_sensitivity *s)
{
    return s->solver->M.column_starts && s->count > PERP__SMALL_BLOCK;
}

static void layout(perp__arena *arena, void *object)
{
    perp_lcp_sensitivity *s = object;
    const size_t n = (size_t)s->n, count = (size_t)s->count;
    const size_t entries = uses_csc(s) ? (size_t)s->solver->M.column_starts[n] : count * count;

    s->places = perp__arena_take(arena, n, sizeof(int8_t));
    PERP__INTEGERS(arena, n, &s->active, &s->position);
    PERP__DOUBLES(arena, n, &s->rhs, &s->move, &s->product);
    s->x = perp__arena_take(arena, count, sizeof(double));
    s->block = perp__arena_take(arena, entries, sizeof(double));
    s->starts = perp__arena_take(arena, uses_csc(s) ? count + 1 : 0, sizeof(int32_t));
    s->rows = perp__arena_take(arena, uses_csc(s) ? entries : 0, sizeof(int32_t));
}

static void collect(perp_lcp_sensitivity *s)
{
    int32_t i, count = 0;

    memcpy(s->places, s->solver->places, (size_t)s->n);
    for (i = 0; i < s->n; i++) {
        s->position[i] = -1;
        if (s->places[i] == PERP__BETWEEN) {
            s->position[i] = count;
            s->active[count++] = i;
        }
    }
}

/* block := D_A M_AA D_A */
static perp__square fill(perp_lcp_sensitivity *s)
{
    const double *d = s->solver->factors;
    perp__principal block;
    perp__square A;

    block.count = s->count;
    block.active = s->active;
    block.position = s->position;
    memset(&A, 0, sizeof A);
    A.n = s->count;
    A.values = s->block;
    if (uses_csc(s)) {
        perp__principal_csc(&s->solver->M, &block, s->starts, s->rows, s->block);
        A.column_starts = s->starts;
        A.row_indices = s->rows;
    } else {
        perp__principal_dense(&s->solver->M, &block, s->block, 1, (size_t)s->count);
    }
    for (int32_t c = 0; c < s->count; c++) {
        const int32_t from = uses_csc(s) ? s->starts[c] : 0;
        const int32_t to = uses_csc(s) ? s->starts[c + 1] : s->count;
        double *column = uses_csc(s) ? s->block : s->block + (size_t)c * (size_t)s->count;

        for (int32_t k = from; k < to; k++)
            column[k] *= d[s->active[uses_csc(s) ? s->rows[k] : k]] * d[s->active[c]];
    }
    return A;
}

/* The condition number of the scaled block: 1 if it is empty, +inf if it is singular. */
static perp_status factor(perp_lcp_sensitivity *s, double *condition)
{
    const perp__factor_type *type = uses_csc(s) ? &perp__factor_klu : &perp__factor_lapack;
    const perp__square A = fill(s);
    perp_status status = perp__kept_factor_analyse(&s->kept, s->context, type, &A);

    *condition = INFINITY;
    if (status == PERP_OK)
        status = type->factor(s->kept.factor, &A, 0);
    if (status == PERP_OK)
        *condition = 1.0 / type->condition(s->kept.factor, &A);
    return status == PERP__FACTOR_SINGULAR ? PERP_OK : status;
}

/* How far row i is from changing its place, in the units of the tested residual. */
static double margin_of(const perp_lcp_solver *solver, int32_t i)
{
    const double w = perp__w_scaled(solver, i, solver->w_high[i]);
    const double above = perp__z_scaled(solver, i, solver->z[i] - solver->lower[i]);
    const double below = perp__z_scaled(solver, i, solver->upper[i] - solver->z[i]);

    switch (solver->places[i]) {
    case PERP__AT_LOWER:
        return w;
    case PERP__AT_UPPER:
        return -w;
    case PERP__FIXED:
        return INFINITY;
    default:
        return above < below ? above : below;
    }
}

/* The row with the largest tested residual. */
static int32_t find_worst(const perp_lcp_solver *solver)
{
    double largest = -1.0;
    int32_t worst = -1, i;

    for (i = 0; i < solver->n; i++) {
        const double w = perp__w_scaled(solver, i, solver->w_high[i]);
        const double above = perp__z_scaled(solver, i, solver->z[i] - solver->lower[i]);
        const double below = perp__z_scaled(solver, i, solver->z[i] - solver->upper[i]);
        const double residual = fabs(perp__mid(0.0, -above, -below, w));

        if (!(residual <= largest)) {
            largest = residual;
            worst = i;
        }
        if (isnan(residual))
            break;
    }
    return worst;
}

static void judge(perp_lcp_sensitivity *s, perp_lcp_sensitivity_info *info,
                  const perp__evaluation *worth)
{
    const perp__evidence evidence = perp__lcp_evidence(s->solver, worth, 1.0);
    int32_t i, least = -1;

    info->margin = INFINITY;
    for (i = 0; i < s->n && !isnan(info->margin); i++) {
        const double margin = margin_of(s->solver, i);

        if (!(margin >= info->margin)) {
            info->margin = margin;
            least = i;
        }
    }
    info->index = -1;
    if (!perp__is_good(perp__gate(&evidence, s->solver->settings.tol, -1))) {
        info->verdict = PERP_VERDICT_NOT_A_SOLUTION;
        info->index = find_worst(s->solver);
    } else if (!(info->condition * DBL_EPSILON < 1.0)) {
        info->verdict = PERP_VERDICT_SINGULAR;
    } else if (!(info->margin > s->solver->settings.tol)) {
        info->verdict = PERP_VERDICT_DEGENERATE;
        info->index = least;
    } else {
        info->verdict = PERP_VERDICT_REGULAR;
    }
    s->verdict = info->verdict;
}

perp_status perp__sensitivity_prepare(perp_lcp_sensitivity *s, perp_lcp_sensitivity_info *info)
{
    const perp__evaluation worth = perp__evaluate(s->solver);
    perp_status status;

    perp__read_places(s->solver, s->solver->places);
    s->count = 0;
    for (int32_t i = 0; i < s->n; i++)
        s->count += s->solver->places[i] == PERP__BETWEEN;
    status = perp__arena_fit(&s->arena, layout, s);
    if (status != PERP_OK)
        return status;
    collect(s);
    status = factor(s, &info->condition);
    if (status != PERP_OK)
        return status;
    info->active = s->count;
    judge(s, info, &worth);
    return PERP_OK;
}

void perp__sensitivity_solve(perp_lcp_sensitivity *s, double *x, int32_t transposed)
{
    const double *d = s->solver->factors;

    /* M_AA^-1 = D (D M_AA D)^-1 D */
    for (int32_t k = 0; k < s->count; k++)
        s->x[k] = d[s->active[k]] * x[s->active[k]];
    s->kept.type->solve(s->kept.factor, s->x, transposed);
    for (int32_t k = 0; k < s->count; k++)
        x[s->active[k]] = d[s->active[k]] * s->x[k];
}
