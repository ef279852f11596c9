/* Derivatives of a solution with respect to the data.
 *
 * Near a strictly complementary solution with a regular block M_AA the index set stays, and
 *   M_AA dz_A = -(dq + dM z + M_AN dz_N)_A,  dz_N = the movement of the bounds they are at,
 * N the variables at a bound (Cottle, Pang & Stone, section 7.4). One factorisation serves all
 * products; the adjoint uses its transpose. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/check.h"
#include "lcp/solver.h"
#include "linalg/factor/factor.h"

struct perp_lcp_sensitivity {
    PERP__HANDLE;
    perp_lcp_solver *solver; /* the problem, its scaling, and z with its w */
    perp__arena arena;
    int32_t n, count, verdict;
    int8_t *places;                      /* enum perp__place */
    int32_t *active;                     /* the rows that are between */
    int32_t *position;                   /* where a row is among them, or -1 */
    double *x, *work;                    /* count; 2 count */
    double *rhs, *move, *product, *wide; /* n */
};

/* ---- the index set of a solution, how clear it is, and the factors of its block ---- */

static void layout(perp__arena *arena, void *object)
{
    perp_lcp_sensitivity *s = object;
    const size_t n = (size_t)s->n, count = (size_t)s->count;

    s->places = perp__arena_take(arena, n, sizeof(int8_t));
    PERP__INTEGERS(arena, n, &s->active, &s->position);
    PERP__DOUBLES(arena, n, &s->rhs, &s->move, &s->product, &s->wide);
    s->x = perp__arena_take(arena, count, sizeof(double));
    s->work = perp__arena_take(arena, 2 * count, sizeof(double));
}

/* x := (D_A M_AA D_A)^-1 x, or its transpose; count entries. */
static void solve_block(void *user, double *x, int32_t transposed)
{
    perp_lcp_sensitivity *s = user;

    for (int32_t k = 0; k < s->count; k++)
        s->wide[s->active[k]] = x[k];
    perp__sparse_block_solve(&s->solver->block, s->wide, transposed);
    for (int32_t k = 0; k < s->count; k++)
        x[k] = s->wide[s->active[k]];
}

/* Factors D_A M_AA D_A, the solver's block, and finds its condition number: 1 if it is empty, +inf
 * if it is singular. */
static perp_status factor(perp_lcp_sensitivity *s, double *condition)
{
    perp_status status = perp__read_block(s->solver);
    double norm = 0.0;

    PERP__THEN(status, perp__sparse_block_factor(&s->solver->block, s->active, s->count, 0.0));
    *condition = INFINITY;
    if (status != PERP_OK)
        return status == PERP__FACTOR_SINGULAR ? PERP_OK : status;
    for (int32_t c = 0; c < s->count; c++) {
        const perp__line l = perp__line_of(&s->solver->S, s->active[c]);
        double sum = 0.0;

        for (int32_t k = 0; k < l.count; k++)
            if (s->position[l.indices ? l.indices[k] : k] >= 0)
                sum += fabs(l.values[k]);
        perp__raise_to(&norm, sum);
    }
    *condition = 1.0 / perp__reciprocal_condition(s->count, norm, s->work, solve_block, s);
    return PERP_OK;
}

int32_t perp__lcp_verdict(bool good, double condition, double margin, double tol)
{
    if (!good)
        return PERP_VERDICT_NOT_A_SOLUTION;
    if (!(condition * DBL_EPSILON < 1.0))
        return PERP_VERDICT_SINGULAR;
    return margin > tol ? PERP_VERDICT_REGULAR : PERP_VERDICT_DEGENERATE;
}

perp_status perp__lcp_check_verdict(perp_context *context, const char *name, const char *set,
                                    int32_t verdict)
{
    if (verdict == PERP_VERDICT_REGULAR || verdict == PERP_VERDICT_DEGENERATE)
        return PERP_OK;
    return perp__refuse(context, "%s has no derivatives: it is %s%s%s%s", name,
                        verdict == PERP_VERDICT_SINGULAR ? "a solution whose " : "",
                        verdict == PERP_VERDICT_SINGULAR ? set : "",
                        verdict == PERP_VERDICT_SINGULAR ? " is " : "",
                        perp_lcp_verdict_text(verdict));
}

/* Margin, verdict, and the row that decides. */
static void find_verdict(perp_lcp_sensitivity *s, perp_lcp_sensitivity_info *info,
                         const perp__evaluation *residuals)
{
    perp_lcp_solver *solver = s->solver;
    const perp__evidence evidence = perp__lcp_evidence(solver, residuals, 1.0);
    const bool good = perp__is_good(perp__gate(&evidence, solver->settings.tol, -1));
    double largest = -1.0;
    int32_t least = -1, worst = -1;

    info->margin = INFINITY;
    for (int32_t i = 0; i < s->n && !isnan(info->margin); i++) {
        const double margin = perp__margin_of(solver, i);

        if (!(margin >= info->margin)) {
            info->margin = margin;
            least = i;
        }
    }
    for (int32_t i = 0; i < s->n && !isnan(largest); i++) { /* the largest tested residual */
        const double w = perp__w_scaled(solver, i, solver->w_high[i]);
        const double above = perp__z_scaled(solver, i, solver->z[i] - solver->lower[i]);
        const double below = perp__z_scaled(solver, i, solver->z[i] - solver->upper[i]);
        const double residual = fabs(perp__mid(0.0, -above, -below, w));

        if (!(residual <= largest)) {
            largest = residual;
            worst = i;
        }
    }
    s->verdict = info->verdict =
        perp__lcp_verdict(good, info->condition, info->margin, solver->settings.tol);
    info->index = info->verdict == PERP_VERDICT_NOT_A_SOLUTION ? worst
                  : info->verdict == PERP_VERDICT_DEGENERATE   ? least
                                                               : -1;
}

/* Reads the index set, factors its block, finds verdict, index, margin and condition. PERP_OK or
 * PERP_ERROR_MEMORY. */
static perp_status prepare(perp_lcp_sensitivity *s, perp_lcp_sensitivity_info *info)
{
    const perp__evaluation residuals = perp__evaluate(s->solver);
    const int8_t *places = s->solver->places;
    int32_t count = 0;
    perp_status status;

    perp__read_places(s->solver, s->solver->places);
    for (int32_t i = 0; i < s->n; i++)
        count += places[i] == PERP__BETWEEN;
    s->count = info->active = count;
    status = perp__arena_fit(&s->arena, s->context, layout, s);
    if (status != PERP_OK)
        return status;
    count = 0;
    for (int32_t i = 0; i < s->n; i++) {
        s->places[i] = places[i];
        s->position[i] = places[i] == PERP__BETWEEN ? count : -1;
        if (places[i] == PERP__BETWEEN)
            s->active[count++] = i;
    }
    status = factor(s, &info->condition);
    if (status == PERP_OK)
        find_verdict(s, info, &residuals);
    return status;
}

/* x_A := M_AA^-1 x_A, or its transpose; x has n entries, the others are not touched. */
static void solve(perp_lcp_sensitivity *s, double *x, int32_t transposed)
{
    const double *d = s->solver->factors;

    /* M_AA^-1 = D (D M_AA D)^-1 D */
    for (int32_t k = 0; k < s->count; k++)
        s->x[k] = d[s->active[k]] * x[s->active[k]];
    solve_block(s, s->x, transposed);
    for (int32_t k = 0; k < s->count; k++)
        x[s->active[k]] = d[s->active[k]] * s->x[k];
}

/* ---- life ---------------------------------------------------------------------------------- */

static void release(void *object)
{
    perp_lcp_sensitivity *s = object;

    perp__arena_release(&s->arena);
    perp__handle_end(s->solver);
}

static const perp__kind kind = {"sensitivities", sizeof(perp_lcp_sensitivity), release};

perp_status perp_lcp_sensitivity_create(perp_context *context, perp_lcp_sensitivity **sensitivity,
                                        perp_lcp_sensitivity_info *info,
                                        const perp_lcp_settings *settings,
                                        const perp_lcp_problem *problem, const double *z)
{
    perp_lcp_sensitivity_info copy = {0};
    perp_lcp_sensitivity *made = NULL;
    perp_lcp_problem p = {0};
    perp_status status = perp__enter(context);

    if (status != PERP_OK)
        return status;
    status = perp__check_pointer(context, "sensitivity", sensitivity);
    PERP__THEN(status, PERP__CHECK(perp_lcp_sensitivity_info, context, info));
    if (status == PERP_OK) {
        made = perp__handle_create(context, &kind);
        status = made ? PERP_OK : PERP_ERROR_MEMORY;
    }
    /* 1. The problem goes into a solver of its own; z is the point that is evaluated. */
    PERP__THEN(status, perp__lcp_create(context, &made->solver, settings));
    if (status == PERP_OK)
        made->solver->as_given = 1;
    PERP__THEN(status, perp__lcp_caller_read(context, &p, problem, 0));
    PERP__THEN(status, perp__lcp_setup(made->solver, p.M, p.lower, p.upper));
    if (status == PERP_OK)
        made->n = made->solver->n;
    PERP__THEN(status, perp__check_vector(context, "q", p.q, (size_t)made->n));
    PERP__THEN(status, perp__check_vector(context, "z", z, (size_t)made->n));
    if (status == PERP_OK) {
        perp__scale_problem(made->solver, p.q);
        perp__copy(made->solver->z, z, made->n);
        status = prepare(made, &copy);
    }
    /* 2. The handle. */
    if (status == PERP_OK)
        perp__struct_write(info, &copy, sizeof copy);
    if (made)
        PERP__HAND_OUT(status, made, sensitivity);
    return perp__leave(context, status);
}

void perp_lcp_sensitivity_destroy(perp_lcp_sensitivity *sensitivity)
{
    perp__handle_destroy(sensitivity, &kind);
}

/* ---- products ------------------------------------------------------------------------------ */

static perp_status check_verdict(const perp_lcp_sensitivity *s)
{
    return perp__lcp_check_verdict(s->context, "z", "block", s->verdict);
}

/* move := dz: rhs := dM z + M_.N dz_N + dq with dz_N the movement of the bounds, then
 * dz_A = -M_AA^-1 rhs_A. */
static perp_status forward(perp_lcp_sensitivity *s, double *dz, const double *dq,
                           const perp_matrix *dM, const double *dlower, const double *dupper)
{
    perp__matrix copy;
    perp_status status = check_verdict(s);

    if (status == PERP_OK && s->n > 0)
        status = perp__check_pointer(s->context, "dz", dz);
    PERP__THEN(status, perp__check_finite(s->context, "dq", dq, (size_t)s->n));
    PERP__THEN(status, perp__check_finite(s->context, "dlower", dlower, (size_t)s->n));
    PERP__THEN(status, perp__check_finite(s->context, "dupper", dupper, (size_t)s->n));
    if (status == PERP_OK && dM)
        status = perp__matrix_read_sized(s->context, "dM", &copy, dM, s->n, s->n);
    if (status != PERP_OK || s->n == 0)
        return status;
    for (int32_t i = 0; i < s->n; i++) {
        const double *moved = s->places[i] == PERP__BETWEEN    ? NULL
                              : s->places[i] == PERP__AT_UPPER ? dupper
                                                               : dlower;

        s->move[i] = moved ? moved[i] : 0.0;
    }
    perp__multiply(&s->solver->M, s->move, s->rhs);
    for (int32_t i = 0; dq && i < s->n; i++)
        s->rhs[i] += dq[i];
    if (dM) {
        perp__multiply(&copy, s->solver->z, s->product);
        for (int32_t i = 0; i < s->n; i++)
            s->rhs[i] += s->product[i];
    }
    solve(s, s->rhs, 0);
    for (int32_t k = 0; k < s->count; k++)
        s->move[s->active[k]] = -s->rhs[s->active[k]];
    status = perp__check_finite(s->context, "dz", s->move, (size_t)s->n);
    if (status == PERP_OK)
        memcpy(dz, s->move, (size_t)s->n * sizeof *dz);
    return status;
}

perp_status perp_lcp_sensitivity_forward(perp_lcp_sensitivity *sensitivity, double *dz,
                                         const double *dq, const perp_matrix *dM,
                                         const double *dlower, const double *dupper)
{
    return PERP__HANDLE_CALL(sensitivity, &kind, forward(sensitivity, dz, dq, dM, dlower, dupper));
}

/* rhs := p, p_A = -M_AA^-T g_A and 0 elsewhere; for a direction (d, e) of q and of the bounds of N
 * then g'dz = p'd + sum_N (g + M'p)_j e_j, since M_AA dz_A = -(d_A + M_AN e). */
static perp_status adjoint(perp_lcp_sensitivity *s, double *p, double *lower, double *upper,
                           const double *g)
{
    perp_status status = check_verdict(s);

    PERP__THEN(status, perp__check_vector(s->context, "g", g, (size_t)s->n));
    if (status != PERP_OK)
        return status;
    for (int32_t i = 0; i < s->n; i++) {
        s->rhs[i] = s->places[i] == PERP__BETWEEN ? -g[i] : 0.0;
        s->move[i] = g[i]; /* g may be the caller's p */
    }
    solve(s, s->rhs, 1);
    for (int32_t i = 0; i < s->n; i++) {
        const int32_t place = s->places[i];
        const bool asked = place == PERP__AT_UPPER ? upper != NULL : lower != NULL;

        s->product[i] = place == PERP__BETWEEN || !asked
                            ? 0.0
                            : s->move[i] + perp__column_times(&s->solver->M, i, s->rhs);
    }
    status = perp__check_finite(s->context, "p", s->rhs, (size_t)s->n);
    PERP__THEN(status, perp__check_finite(s->context, "lower or upper", s->product, (size_t)s->n));
    for (int32_t i = 0; i < s->n && status == PERP_OK; i++) {
        const bool is_upper = s->places[i] == PERP__AT_UPPER;

        if (p)
            p[i] = s->rhs[i];
        if (lower)
            lower[i] = is_upper ? 0.0 : s->product[i];
        if (upper)
            upper[i] = is_upper ? s->product[i] : 0.0;
    }
    return status;
}

perp_status perp_lcp_sensitivity_adjoint(perp_lcp_sensitivity *sensitivity, double *p,
                                         double *lower, double *upper, const double *g)
{
    return PERP__HANDLE_CALL(sensitivity, &kind, adjoint(sensitivity, p, lower, upper, g));
}

perp_status perp_lcp_sensitivity_places(perp_lcp_sensitivity *sensitivity, int32_t *places)
{
    perp_status status = perp__handle_enter(sensitivity, &kind);

    if (status != PERP_OK)
        return status;
    if (sensitivity->n > 0)
        status = perp__check_pointer(sensitivity->context, "places", places);
    for (int32_t i = 0; status == PERP_OK && i < sensitivity->n; i++)
        places[i] = sensitivity->places[i];
    return perp__leave(sensitivity->context, status);
}
