/* What a solver reported, against what check.c recomputes. */
#include "check.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "exact.h"

#define EPS 0x1p-52

static char complaint[512];

#define COMPLAIN(...) (snprintf(complaint, sizeof complaint, __VA_ARGS__), complaint)

/* Reported and recomputed numbers agree when they differ by roundings only: a quotient and a sum
 * of n terms in double (relative), and the noise of a product in double-double (absolute). */
static int agree(double reported, double recomputed, int32_t n, double noise)
{
    if (reported == recomputed)
        return 1;
    return fabs(reported - recomputed) <= (n + 8) * EPS * fabs(recomputed) + noise + 0x1p-1070;
}

static const char *check_numbers(const check_lcp *problem, const double *z, const double *w,
                                 const perp_lcp_result *result, const check_measures *m)
{
    int32_t n = problem->M->rows, i;

    for (i = 0; i < n; i++) {
        double l = check_lower(problem, i), u = check_upper(problem, i);

        if (!isfinite(z[i]))
            return COMPLAIN("z[%d] is %g", i, z[i]);
        if (w && isnan(w[i]))
            return COMPLAIN("w[%d] is NaN", i);
        if (z[i] < l || z[i] > u)
            return COMPLAIN("z[%d] = %.17g is outside of [%g, %g]", i, z[i], l, u);
    }
    if (!(result->seconds >= 0.0) || result->iterations < 0)
        return COMPLAIN("%g seconds, %ld iterations", result->seconds, (long)result->iterations);
    if (result->method <= PERP_LCP_AUTO || result->method > PERP_LCP_PATTERNS)
        return COMPLAIN("method is %d", (int)result->method);
    if (!agree(result->residual, m->residual, 0, m->noise) &&
        !(m->overflow && result->residual >= m->residual))
        return COMPLAIN("residual reported %.17g, is %.17g", result->residual, m->residual);
    return NULL;
}

static const char *check_units(const perp_lcp_result *result, const check_measures *m, int32_t n)
{
    /* a rounded double-double lies within half a unit and the noise */
    if (m->w_error > 1.0)
        return COMPLAIN("w is off by %g units in the last place", m->w_error);
    if (!agree(result->natural_residual, m->natural_residual, 0, m->natural_noise))
        return COMPLAIN("natural residual reported %.17g, is %.17g", result->natural_residual,
                        m->natural_residual);
    if (!agree(result->backward_error, m->backward_error, n, m->backward_noise) &&
        !(m->overflow && result->backward_error >= 0))
        return COMPLAIN("backward error reported %.17g, is %.17g", result->backward_error,
                        m->backward_error);
    return NULL;
}

/* Where the second witness is nearer to tol than this factor, roundings may decide. */
#define CLOSE 4.0

static const char *check_good(const check_lcp *problem, const double *z, const double *w,
                              const perp_lcp_result *result, double tol)
{
    int within = result->residual <= tol;
    int limit = result->backward_error <= 16 * EPS && result->residual <= sqrt(tol);
    int solved = result->outcome == PERP_OUTCOME_SOLVED;
    int good = solved || result->outcome == PERP_OUTCOME_ROUNDING_LIMIT, finite = 1;
    double own;

    if ((solved && !within) || (good && !within && !limit))
        return COMPLAIN("outcome %s with residual %g, backward error %g, tol %g",
                        perp_outcome_text(result->outcome), result->residual,
                        result->backward_error, tol);
    for (int32_t i = 0; w && i < problem->M->rows; i++)
        finite &= isfinite(w[i]);
    if (good && !finite)
        return COMPLAIN("outcome %s with w that is not finite", perp_outcome_text(result->outcome));
    if (!w || !finite || !within)
        return NULL;
    own = check_own(problem, z, w, tol);
    if (solved ? own > CLOSE * tol : own < tol / CLOSE)
        return COMPLAIN("outcome %s with residual %g, own residual %g, tol %g",
                        perp_outcome_text(result->outcome), result->residual, own, tol);
    return NULL;
}

static const char *check_outcome(const perp_lcp_result *result)
{
    if (result->outcome < PERP_OUTCOME_SOLVED || result->outcome > PERP_OUTCOME_STOPPED)
        return COMPLAIN("outcome is %d", (int)result->outcome);
    if (result->has_ray != (result->outcome == PERP_OUTCOME_RAY))
        return COMPLAIN("outcome %s, has_ray %d", perp_outcome_text(result->outcome),
                        (int)result->has_ray);
    if (result->certificate != PERP_CERTIFICATE_NONE &&
        (result->certificate != PERP_CERTIFICATE_INFEASIBLE || !result->has_ray))
        return COMPLAIN("certificate %d, has_ray %d", (int)result->certificate,
                        (int)result->has_ray);
    return NULL;
}

/* How far My may miss the sign that exact pivoting gives it, as a change of the scaled row relative
 * to its norm. */
#define RAY_TOLERANCE 2e-9

/* The direction lies in the recession cone of the bounds, its largest entry is 1, and y_i (My)_i
 * <= 0: on Lemke's secondary ray w grows by My + d y0 with y_i (My + d y0)_i = 0, d > 0, y0 >= 0
 * (Cottle, Pang & Stone, section 4.4). size_i is the norm of row i of the equilibrated M times the
 * largest scaled entry of y, in the caller's units. */
static const char *check_ray(const check_lcp *problem, const double *y, const double *product,
                             const double *size)
{
    double largest = 0.0;
    int32_t i;

    for (i = 0; i < problem->M->rows; i++) {
        int below = isfinite(check_lower(problem, i)), above = isfinite(check_upper(problem, i));

        if (!isfinite(y[i]) || (below && y[i] < 0) || (above && y[i] > 0))
            return COMPLAIN("ray[%d] = %g leaves the bounds", i, y[i]);
        check_raise(&largest, fabs(y[i]));
        if ((below || above) && y[i] != 0 &&
            (y[i] > 0 ? product[i] : -product[i]) > RAY_TOLERANCE * size[i])
            return COMPLAIN("ray[%d] = %g has (M ray)[%d] = %g", i, y[i], i, product[i]);
    }
    /* scaled back by powers of two, then divided by its largest entry: one rounding */
    if (fabs(largest - 1.0) > 2 * EPS)
        return COMPLAIN("the largest entry of the ray is %.17g", largest);
    return NULL;
}

/* y >= 0, M'y <= 0, y'(q + M l) < 0: then no z >= l has Mz + q >= 0; of a free z_j, l_j = 0 and y_j
 * has any sign, (M'y)_j none. `product` is M'y. */
static const char *check_certificate(const check_lcp *problem, const double *y,
                                     const double *product, const double *size)
{
    check_sum sum;
    int32_t i;

    check_sum_clear(&sum);
    for (i = 0; i < problem->M->rows; i++) {
        double l = check_lower(problem, i);

        if (y[i] < 0 && isfinite(l)) /* the row of a free z_i is an equation */
            return COMPLAIN("certificate with ray[%d] = %g", i, y[i]);
        /* 64 eps: the sign of a sum whose terms cancel is known to its roundings only */
        if (product[i] > 64 * EPS * size[i] || (!isfinite(l) && product[i] < -64 * EPS * size[i]))
            return COMPLAIN("certificate with (M' ray)[%d] = %g", i, product[i]);
        check_sum_add(&sum, y[i], problem->q[i]);
        if (isfinite(l))
            check_sum_add(&sum, product[i], l);
    }
    if (!(check_sum_value(&sum, 0) < 0))
        return COMPLAIN("certificate with ray'(q + M l) = %g", check_sum_value(&sum, 0));
    return NULL;
}

/* size_j = sum_i |M_ij| |y_i| */
static void column_sizes(const perp_matrix *M, const double *y, double *size)
{
    size_t count, p;
    check_item *list = check_items(M, &count);

    memset(size, 0, (size_t)M->rows * sizeof *size);
    for (p = 0; p < count; p++)
        size[list[p].column] += fabs(list[p].value * y[list[p].row]);
    free(list);
}

/* See check_ray. */
static void row_sizes(const check_lcp *problem, const double *y, double *size)
{
    int32_t n = problem->M->rows, i;
    int32_t *e = check_allocate((size_t)n, sizeof *e);
    double largest = 0.0;

    check_exponents(problem->M, problem->scaling, e);
    check_row_norms(problem->M, e, size);
    for (i = 0; i < n; i++)
        check_raise(&largest, ldexp(fabs(y[i]), -e[i]));
    for (i = 0; i < n; i++)
        size[i] = ldexp(size[i] * largest, -e[i]);
    free(e);
}

static const char *check_ray_result(const check_lcp *problem, const double *ray,
                                    int32_t certificate)
{
    size_t n = (size_t)problem->M->rows;
    double *product = check_allocate(n, sizeof *product), *size = check_allocate(n, sizeof *size);
    const char *wrong;

    check_multiply(problem->M, 0, ray, NULL, NULL, product);
    row_sizes(problem, ray, size);
    wrong = check_ray(problem, ray, product, size);
    if (!wrong && certificate == PERP_CERTIFICATE_INFEASIBLE) {
        check_multiply(problem->M, 1, ray, NULL, NULL, product);
        column_sizes(problem->M, ray, size);
        wrong = check_certificate(problem, ray, product, size);
    }
    free(size);
    free(product);
    return wrong;
}

const char *check_lcp_result(const perp_matrix *M, const double *q, const double *lower,
                             const double *upper, const double *z, const double *w,
                             const double *ray, const perp_lcp_result *result,
                             const perp_lcp_settings *settings)
{
    check_lcp problem = {M, q, lower, upper, settings ? settings->scaling : 1};
    double tol = settings ? settings->tol : 1e-10;
    check_measures m;
    const char *wrong;

    check_measure(&m, &problem, z, w);
    wrong = check_numbers(&problem, z, w, result, &m);
    if (!wrong)
        wrong = check_units(result, &m, M->rows);
    if (!wrong)
        wrong = check_good(&problem, z, w, result, tol);
    if (!wrong)
        wrong = check_outcome(result);
    if (!wrong && result->has_ray && ray)
        wrong = check_ray_result(&problem, ray, result->certificate);
    return wrong;
}

void check_require(const char *wrong, const char *where)
{
    if (wrong)
        fail_msg("%s: %s", where, wrong);
}
