/* Where Newton's method begins: a guess at which bounds are active, safe for any S since only the
 * best point met is kept. */
#include <math.h>
#include <string.h>

#include "lcp/fischer/fischer.h"

#define SLACK 0.95 /* Khobotov's bound on t |F(y) - F(z)| / |y - z| */
#define SHRINKS 30
#define PROGRESS 0.9 /* sweeps go on while each takes off a tenth of the residual */

/* One sweep of projected Gauss-Seidel by columns, which keeps w up to date. */
static void sweep(perp__fischer_state *f)
{
    const perp__lcp_problem *p = f->common.problem;

    for (int32_t j = 0; j < p->n; j++) {
        double diagonal = perp__fischer_matrix_diagonal(&f->S, j);
        double z = f->z[j];

        if (!(diagonal > 0.0))
            diagonal = p->row_norms[j] > 0.0 ? p->row_norms[j] : 1.0;
        f->z[j] = perp__clamp(z - f->w[j] / diagonal, p->lower[j], p->upper[j]);
        if (f->z[j] != z)
            perp__fischer_matrix_add_column(&f->S, j, f->z[j] - z, f->w);
    }
}

static void sweeps(perp__fischer_state *f, int32_t count)
{
    double last = f->best_residual;

    for (int32_t k = 0; k < count; k++) {
        sweep(f);
        perp__fischer_judge(f);
        if (!(f->best_residual <= PROGRESS * last))
            break;
        last = f->best_residual;
    }
}

/* y := P(z - t w), F(y) -> wy; returns t |F(y) - F(z)| / |y - z|, 0 where y = z. */
static double look_ahead(perp__fischer_state *f, double t, double *y, double *wy)
{
    const perp__lcp_problem *p = f->common.problem;
    double moved = 0.0, changed = 0.0;

    for (int32_t i = 0; i < p->n; i++)
        y[i] = perp__clamp(f->z[i] - t * f->w[i], p->lower[i], p->upper[i]);
    perp__fischer_multiply(f, y, wy);
    for (int32_t i = 0; i < p->n; i++) {
        moved += (y[i] - f->z[i]) * (y[i] - f->z[i]);
        changed += (wy[i] - f->w[i]) * (wy[i] - f->w[i]);
    }
    return moved > 0.0 ? t * sqrt(changed / moved) : 0.0;
}

/* z := P(z - t F(P(z - t F(z)))): Korpelevich 1976, for monotone F; t as in Khobotov 1987. */
static void extragradient(perp__fischer_state *f, int32_t steps)
{
    const perp__lcp_problem *p = f->common.problem;
    double *y = f->correction, *wy = f->work;
    double t = 1.0;

    for (int32_t k = 0; k < steps; k++) {
        double ratio = look_ahead(f, t, y, wy);

        for (int32_t shrink = 0; shrink < SHRINKS && !(ratio <= SLACK); shrink++) {
            t *= ratio < 1.0 ? 0.7 : ratio < 9.0 ? 0.9 / ratio : 0.1;
            ratio = look_ahead(f, t, y, wy);
        }
        for (int32_t i = 0; i < p->n; i++)
            f->z[i] = perp__clamp(f->z[i] - t * wy[i], p->lower[i], p->upper[i]);
        perp__fischer_multiply(f, f->z, f->w);
        perp__fischer_judge(f);
    }
}

/* z := mid(l, u, z - w_i / |S_i|_1) */
static void jacobi(perp__fischer_state *f, int32_t steps)
{
    const perp__lcp_problem *p = f->common.problem;

    for (int32_t k = 0; k < steps; k++) {
        for (int32_t i = 0; i < p->n; i++) {
            double s = p->row_norms[i] > 0.0 ? p->row_norms[i] : 1.0;

            f->z[i] = perp__clamp(f->z[i] - f->w[i] / s, p->lower[i], p->upper[i]);
        }
        perp__fischer_multiply(f, f->z, f->w);
        perp__fischer_judge(f);
    }
}

void perp__fischer_start(perp__fischer_state *f, int32_t steps, int32_t jacobi_steps)
{
    perp__fischer_stand(f);
    if (f->S.symmetric)
        sweeps(f, steps);
    else
        extragradient(f, steps);
    jacobi(f, jacobi_steps);
    memcpy(f->z, f->best, (size_t)f->common.problem->n * sizeof(double));
    perp__fischer_stand(f);
}
