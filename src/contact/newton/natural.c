#include "contact/newton/newton.h"

#include <math.h>
#include <string.h>

#define DELTA 1e-9     /* carries the steps along null(A) */
#define PATIENCE 3     /* polish steps that do not bring the residual down to a half */
#define ROUNDING 1e-15 /* no step is worth its factorisation */

double perp__natural_map(const perp__newton_blocks *b, const double *x, const double *y, double *v,
                         double *phi)
{
    double largest = 0.0;

    for (int32_t k = 0; k < b->blocks; k++) {
        int32_t at = b->starts[k], d = b->starts[k + 1] - at;
        double argument[3] = {0.0, 0.0, 0.0}, p[3];

        for (int32_t i = 0; i < d; i++)
            argument[i] = x[at + i] - y[at + i];
        if (d > 1)
            argument[0] -= d == 2 ? fabs(y[at + 1]) : hypot(y[at + 1], y[at + 2]);
        if (k < b->contacts)
            perp__cone_project(d, argument, p);
        else
            p[0] = argument[0];
        for (int32_t i = 0; i < d; i++) {
            double change = x[at + i] - p[i];

            largest = fabs(change) <= largest ? largest : fabs(change); /* keeps a NaN */
            if (v)
                v[at + i] = argument[i];
            if (phi)
                phi[at + i] = change;
        }
    }
    return largest;
}

/* Nearest point of {|p_t| <= mu p_n}. */
static void project_friction(int32_t d, double mu, const double *v, double *p)
{
    double n = d == 1 ? 0.0 : (d == 2 ? fabs(v[1]) : hypot(v[1], v[2]));

    for (int32_t i = 0; i < d; i++)
        p[i] = v[i];
    if (n <= mu * v[0])
        return;
    p[0] = fmax(0.0, (v[0] + mu * n) / (1.0 + mu * mu));
    for (int32_t i = 1; i < d; i++)
        p[i] = n > 0.0 ? mu * p[0] * (v[i] / n) : 0.0;
}

/* sqrt(t) |r - P(r - (u + s e_n) / t)| / omega of block k */
static double tested(const perp__newton *s, int32_t k, const double *x, const double *y)
{
    const perp__contact_problem *problem = s->common.problem;
    const perp__newton_blocks *b = &s->blocks;
    const double t = problem->trace[k] > 0.0 ? problem->trace[k] : 1.0;
    int32_t at = b->starts[k], d = b->starts[k + 1] - at;
    double r[3], v[3] = {0.0, 0.0, 0.0}, p[3], u[3] = {0.0, 0.0, 0.0}, sum = 0.0;

    for (int32_t i = 0; i < d; i++) {
        r[i] = x[at + i] * b->scales[at + i] * s->units[at + i];
        u[i] = y[at + i] / b->scales[at + i] * s->units[at + i];
        v[i] = r[i] - u[i] / t;
    }
    if (d > 1)
        v[0] -= problem->mu[k] * hypot(u[1], u[2]) / t;
    if (k >= b->contacts)
        return fabs(u[0]) / sqrt(t) / problem->omega[k];
    if (d == 1)
        p[0] = fmax(v[0], 0.0);
    else
        project_friction(d, problem->mu[k], v, p);
    for (int32_t i = 0; i < d; i++)
        sum = hypot(sum, r[i] - p[i]);
    return sum * sqrt(t) / problem->omega[k];
}

double perp__natural_tested(const perp__newton *s, const double *x, const double *y)
{
    double largest = 0.0;

    for (int32_t k = 0; k < s->blocks.blocks; k++) {
        double one = tested(s, k, x, y);

        largest = one <= largest ? largest : one; /* keeps a NaN */
    }
    return largest;
}

/* L = V J and R = I - V + delta V at v = x - z, J = I + e1 y_t' / |y_t|. */
static void set_block(perp__newton *s, int32_t k, const double *v, const double *y)
{
    int32_t d = s->blocks.starts[k + 1] - s->blocks.starts[k];
    double *L = &s->L[9 * (size_t)k], *R = &s->R[9 * (size_t)k];
    double V[9] = {1.0}, n;
    int32_t i;

    if (k < s->blocks.contacts)
        perp__cone_derivative(d, v, V);
    n = d == 1 ? 0.0 : (d == 2 ? fabs(y[1]) : hypot(y[1], y[2]));
    for (int32_t j = 0; j < d; j++)
        for (i = 0; i < d; i++) {
            int32_t e = 3 * j + i;

            L[e] = V[e] + (j > 0 && n > 0.0 ? V[i] * (y[j] / n) : 0.0);
            R[e] = (i == j ? 1.0 : 0.0) - (1.0 - DELTA) * V[e];
        }
}

static void keep_best(perp__newton *s, double residual)
{
    if (residual < s->best_residual) {
        s->best_residual = residual;
        memcpy(s->best, s->trial, (size_t)s->blocks.n * sizeof *s->best);
    }
}

/* y, v, phi and the tested residual at trial. */
static double measure(perp__newton *s, double *y, double *v, double *phi)
{
    double residual;

    perp__newton_multiply(&s->matrix, s->trial, y);
    for (int32_t i = 0; i < s->blocks.n; i++)
        y[i] += s->b[i];
    residual = perp__natural_map(&s->blocks, s->trial, y, v, phi);
    return isfinite(residual) ? perp__natural_tested(s, s->trial, y) : residual;
}

void perp__natural_start(perp__newton *s)
{
    const perp__newton_blocks *b = &s->blocks;

    for (int32_t k = 0; k < b->blocks; k++) {
        int32_t at = b->starts[k], d = b->starts[k + 1] - at;

        for (int32_t i = 0; i < d; i++)
            s->trial[at + i] = s->x[at + i] - (k < b->contacts ? s->z[at + i] : 0.0);
        if (k < b->contacts)
            perp__cone_project(d, &s->trial[at], &s->trial[at]);
    }
}

perp_status perp__natural_polish(perp__newton *s, int32_t steps)
{
    const perp__newton_blocks *b = &s->blocks;
    double milestone = INFINITY;
    int32_t waited = 0, step, i, k;
    double *y = s->change, *v = s->dz, *phi = s->rhs;

    for (step = 0;; step++) {
        double residual = measure(s, y, v, phi);
        perp_status status;

        keep_best(s, residual);
        waited = residual < 0.5 * milestone ? 0 : waited + 1;
        milestone = fmin(milestone, residual);
        if (!isfinite(residual) || residual <= ROUNDING || step >= steps || waited >= PATIENCE ||
            (waited > 0 && s->best_residual < PERP__NEWTON_ENOUGH) || perp__newton_is_spent(s))
            return PERP_OK;
        for (k = 0; k < b->blocks; k++)
            set_block(s, k, &v[b->starts[k]], &y[b->starts[k]]);
        for (i = 0; i < b->n; i++)
            phi[i] = -phi[i];
        status = perp__newton_factor(&s->matrix, s->L, s->R);
        if (status == PERP__FACTOR_SINGULAR)
            return PERP_OK;
        if (status != PERP_OK)
            return status;
        perp__newton_solve(&s->matrix, s->L, s->R, phi, s->dx);
        for (i = 0; i < b->n; i++)
            s->trial[i] += s->dx[i];
    }
}
