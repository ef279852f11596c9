/* Within a pattern of modes and signs the system is linear: rows of the coordinates that move,
 *
 *   sum_j (A_ij + t_i C_ij) x_j = tau_i - b_i - t_i d_i,   t_i = mu_i sign_i side_i,
 *
 * and x_i = stop_i where they stick. Solved with complete pivoting and corrected by residuals in
 * doubled precision, then compared with what the pattern assumes. */
#include <math.h>

#include "base/outcome.h"
#include "linalg/doubled.h"
#include "mechanism/load_friction/load_friction.h"

/* With entries up to here elimination with complete pivoting does not overflow. */
static const double largest = 0x1p1000;

/* The direction of motion in a mode. */
static double sign_of(const perp_load_friction *f, int32_t mode, int32_t i)
{
    return mode == PERP_LOAD_FORWARD    ? 1.0
           : mode == PERP_LOAD_BACKWARD ? -1.0
           : mode == PERP_LOAD_STICK    ? 0.0
                                        : f->question.sign[i];
}

/* ---- doubled precision --------------------------------------------------------------------- */

/* Normal forces N = C x + d, and residual_i = tau_i - b_i - (A x)_i - t_i N_i. */
static void find_residual(perp_load_friction *f)
{
    perp__linear *p = &f->linear;
    double *normal = p->u + f->n;

    perp__multiply_doubled(&f->A_view, p->x, f->b, f->product, f->product_low);
    perp__multiply_doubled(&f->C_view, p->x, f->d, normal, f->normal_low);
    for (int32_t i = 0; i < f->n; i++) {
        const double t = p->slope[i];
        double sum = f->tau[i], low = -(f->product_low[i] + t * f->normal_low[i]);

        perp__accumulate(&sum, &low, -1.0, f->product[i]);
        perp__accumulate(&sum, &low, -t, normal[i]);
        p->residual[i] = sum + low;
    }
}

void perp__friction_evaluate(perp_load_friction *f)
{
    perp__linear *p = &f->linear;

    perp__linear_evaluate(p);
    find_residual(f);
    for (int32_t i = 0; i < f->n; i++)
        if (p->slope[i] == 0.0)
            p->u[i] = -p->residual[i];
}

int32_t perp__friction_solve_pattern(perp_load_friction *f)
{
    static const double alone[3] = {1.0, 0.0, 0.0};
    perp__linear *p = &f->linear;
    const size_t n = (size_t)f->n;
    double top;

    perp__linear_begin(p);
    for (int32_t i = 0; i < f->n; i++) {
        p->slope[i] = f->mu[i] * sign_of(f, f->pattern.mode[i], i) * f->pattern.side[i];
        if (f->pattern.mode[i] == PERP_LOAD_STICK)
            p->known[i] = f->question.stop[i];
        else
            perp__linear_column(p, i, 1, alone);
    }
    top = perp__linear_load(p);
    if (!(top <= largest)) { /* beyond the range of doubles: nothing is known of the pattern */
        f->answers.incomplete = 1;
        return -1;
    }
    perp__pivoting_eliminate(&p->system, PERP__SINGULAR * f->settings.tol * top, f->n);
    perp__linear_evaluate(p);
    perp__linear_correct(p);
    for (int32_t round = 0; round < 2; round++) {
        find_residual(f);
        perp__linear_correct(p);
    }
    perp__friction_evaluate(f);
    perp__linear_find_widths(p);
    if (!perp__all_finite(p->x, n) || !perp__all_finite(p->residual, n) ||
        !perp__all_finite(p->load, n) || !perp__all_finite(p->u + n, n) ||
        !perp__all_finite(p->x_width, n) || !perp__all_finite(p->u_width + n, n)) {
        f->answers.incomplete = 1;
        return -1;
    }
    return perp__linear_find_null(p);
}

/* ---- what the pattern says ------------------------------------------------------------------ */

/* factor u_i + normal N_i, or of x_i where i is ~i */
static perp__condition condition(const perp_load_friction *f, int32_t kind, int32_t i,
                                 double factor, double normal)
{
    const bool entry = i < 0;
    const perp__condition g = {kind,
                               0,
                               entry ? 1 : 2,
                               {i, f->n + i, 0},
                               entry ? -factor * f->question.stop[~i] : 0.0,
                               {factor, normal, 0.0}};

    return g;
}

/* What sticks is held by mu |N|: on the side of the pattern, or that of the solution of now. */
int32_t perp__friction_conditions(const void *user, const void *of, int32_t i,
                                  perp__condition *list)
{
    const perp_load_friction *f = user;
    const perp__friction_pattern *pattern = of;
    const int32_t mode = pattern->mode[i], sticks = mode == PERP_LOAD_STICK;
    const double side = pattern->side[i], sign = sign_of(f, mode, i);
    int32_t count = 0;

    list[count++] = sticks ? condition(f, PERP__CONDITION_EQUATION, ~i, 1.0, 0.0)
                           : condition(f, PERP__CONDITION_EQUATION, i, 1.0, f->mu[i] * sign * side);
    if (side != 0.0)
        list[count++] = condition(f, PERP__CONDITION_NOT_NEGATIVE, i, 0.0, side);
    if (sticks) {
        const double on = side != 0.0 ? side : f->linear.u[f->n + i] >= 0.0 ? 1.0 : -1.0;
        const double limit = on * f->question.mu_stick[i];

        list[count++] = condition(f, PERP__CONDITION_NOT_NEGATIVE, i, -1.0, limit);
        list[count++] = condition(f, PERP__CONDITION_NOT_NEGATIVE, i, 1.0, limit);
    } else if (f->question.sign[i] == 0) {
        /* where a slide from rest has no acceleration it sticks as well, and is found so */
        list[count++] = condition(f, PERP__CONDITION_POSITIVE, ~i, sign, 0.0);
    }
    return count;
}

bool perp__friction_holds(perp_load_friction *f, int32_t *at_vertex)
{
    const perp__linear *p = &f->linear;
    const perp__linear_point point = {p->x, p->u, p->x_width, p->u_width, 0, 0, 1};
    const double tol = fmax(f->settings.tol, PERP__ROUNDING_LIMIT);

    for (int32_t i = 0; i < f->n; i++)
        if (f->pattern.mode[i] != PERP_LOAD_STICK && !(fabs(p->residual[i]) <= tol * p->load[i])) {
            f->answers.incomplete = 1; /* the equations have a solution, and this is not it */
            return 0;
        }
    return perp__linear_holds(p, &f->pattern, &point, at_vertex);
}
