/* Anderson mixing (J. ACM 12 (1965) 547) of sweeps: with f = sweep(r) - r of the last few sweeps,
 * the next start is the affine combination of their results for which the combined f is least.
 * Within one active set, where sweeps are linear, that is GMRES (Walker & Ni, SIAM J. Numer. Anal.
 * 49 (2011) 1715). Sweeps over other active sets mislead it: it forgets all once |f| grows. */
#include "contact/sweep/sweep.h"

#include <math.h>
#include <string.h>

#include "linalg/lanes/loops.h"
#include "linalg/lanes/multiversion.h"

void perp__mixing_layout(perp__arena *arena, perp__mixing *mixing, size_t size, size_t y_size)
{
    mixing->size = (int32_t)size;
    mixing->y_size = (int32_t)y_size;
    PERP__DOUBLES(arena, size, &mixing->before, &mixing->f, &mixing->r);
    mixing->y = perp__arena_take(arena, y_size, sizeof(double));
    mixing->F = perp__arena_take(arena, size, PERP__MIXING_DEPTH * sizeof(double));
    mixing->R = perp__arena_take(arena, size, PERP__MIXING_DEPTH * sizeof(double));
    mixing->Y = perp__arena_take(arena, y_size, PERP__MIXING_DEPTH * sizeof(double));
}

void perp__mixing_forget(perp__mixing *mixing, const double *r)
{
    memcpy(mixing->before, r, (size_t)mixing->size * sizeof *r);
    mixing->count = mixing->next = mixing->has_last = 0;
    mixing->norm = INFINITY;
    memset(mixing->f, 0, (size_t)mixing->size * sizeof *mixing->f);
    memset(mixing->r, 0, (size_t)mixing->size * sizeof *mixing->r);
    for (int32_t i = 0; i < mixing->y_size; i++)
        mixing->y[i] = 0.0;
}

/* f := weights (r - before) with F := f - f of the last sweep, R := r - r of the last sweep */
PERP__MULTIVERSION(difference,
                   (perp__mixing * m, const double *weights, const double *r, double *F, double *R),
                   (m, weights, r, F, R))
{
    for (int32_t i = 0; i < m->size; i++) {
        const double f = weights[i] * (r[i] - m->before[i]);

        F[i] = f - m->f[i];
        R[i] = r[i] - m->r[i];
        m->f[i] = f;
        m->r[i] = r[i];
    }
}

/* x := x - sum_k factors[k] D_k, the D_k one after the other in memory */
PERP__MULTIVERSION(combine,
                   (double *x, const double *D, const double *factors, int32_t count, int32_t n),
                   (x, D, factors, count, n))
{
    int32_t k = 0;

    for (; k + 1 < count; k += 2) {
        const double *a = D + (size_t)k * (size_t)n, *b = a + n;
        const double s = factors[k], t = factors[k + 1];

        for (int32_t i = 0; i < n; i++)
            x[i] -= s * a[i] + t * b[i];
    }
    for (; k < count; k++) {
        const double *a = D + (size_t)k * (size_t)n;

        for (int32_t i = 0; i < n; i++)
            x[i] -= factors[k] * a[i];
    }
}

/* x := (F'F + ridge)^-1 F'f; 0 where that breaks down. */
static bool least_squares(const perp__mixing *m, double *x)
{
    double A[PERP__MIXING_DEPTH * PERP__MIXING_DEPTH], ridge = 0.0;
    const int32_t n = m->count;

    for (int32_t i = 0; i < n; i++) {
        ridge += PERP__REGULAR * m->gram[i][i];
        perp__loops_dot(m->size, m->F + (size_t)i * (size_t)m->size, m->f, &x[i]);
    }
    for (int32_t i = 0; i < n; i++)
        for (int32_t j = 0; j < n; j++)
            A[i * n + j] = m->gram[i][j] + (i == j ? ridge : 0.0);
    if (perp__loops_cholesky(n, A, n) != 0)
        return 0;
    perp__loops_cholesky_solve(n, 1, A, n, x, n);
    return 1;
}

void perp__mixing_after(perp__mixing *m, const double *weights, double *r, double *y)
{
    const int32_t at = m->next;
    const size_t size = (size_t)m->size;
    double *F = m->F + (size_t)at * size, *Y = m->Y + (size_t)at * (size_t)m->y_size;
    double norm, x[PERP__MIXING_DEPTH];

    /* 1. The differences from the last sweep, where there was one. */
    difference(m, weights, r, F, m->R + (size_t)at * size);
    for (int32_t i = 0; i < m->y_size; i++) {
        Y[i] = y[i] - m->y[i];
        m->y[i] = y[i];
    }
    if (m->has_last) {
        m->next = (at + 1) % PERP__MIXING_DEPTH;
        if (m->count < PERP__MIXING_DEPTH)
            m->count++;
    }
    for (int32_t k = 0; k < m->count && m->has_last; k++) {
        perp__loops_dot(m->size, m->F + (size_t)k * size, F, &m->gram[at][k]);
        m->gram[k][at] = m->gram[at][k];
    }
    m->has_last = 1;

    /* 2. The next start; all is forgotten but the last sweep where |f| has grown. */
    perp__loops_dot(m->size, m->f, m->f, &norm);
    if (!(norm <= m->norm))
        m->count = m->next = 0;
    m->norm = norm;
    if (m->count > 0 && least_squares(m, x)) {
        combine(r, m->R, x, m->count, m->size);
        combine(y, m->Y, x, m->count, m->y_size);
    }
    memcpy(m->before, r, size * sizeof *r);
}
