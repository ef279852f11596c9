/* Stability of an answer: contacts with normal inertia S, stiffness k and damping c, displaced by
 * y, N = -(k y + c y'). With M = [A C'; C Y], Y = S + C A^-1 C', and coordinates T that stick,
 *
 *   S_L y'' = (I + C_L A_LL^-1 (diag(mu) D)_L) N + const,   S_L = Y - C_L A_LL^-1 C_L',
 *
 * so that y'' + Gamma (k y + c y') = const with Gamma = S_L^-1 (I + C_L A_LL^-1 (diag(mu) D)_L). */
#include <string.h>

#include "linalg/blas.h"
#include "mechanism/load_friction/load_friction.h"
#include "mechanism/stability.h"

static size_t at(int32_t i, int32_t j, int32_t ld)
{
    return (size_t)i + (size_t)ld * (size_t)j;
}

/* From the slopes of the pattern that was solved last. */
void perp__friction_label(perp_load_friction *f, const perp__friction_pattern *pattern,
                          int32_t *stable, int32_t *flutter, double *eigenvalues)
{
    const int32_t n = f->n;
    const size_t square = (size_t)n * (size_t)n;
    double *block = f->work, *C = block + square, *X = C + square, *Gamma = X + 2 * square;
    double *S = Gamma + square;
    perp__stability verdict;
    int32_t m = 0, r, c, i;

    memset(X, 0, 2 * square * sizeof *X);
    for (i = 0; i < n; i++)
        if (pattern->mode[i] != PERP_LOAD_STICK)
            f->list[m++] = i;
    for (r = 0; r < m; r++) {
        for (c = 0; c < m; c++)
            block[at(r, c, n)] = f->A[at(f->list[r], f->list[c], n)];
        for (i = 0; i < n; i++) { /* C_L, and the right-hand sides C_L' and (diag(mu) D)_L */
            C[at(i, r, n)] = f->C[at(i, f->list[r], n)];
            X[at(r, i, n)] = C[at(i, r, n)];
        }
        X[at(r, n + f->list[r], n)] = f->slope[f->list[r]];
    }
    memcpy(S, f->Y, square * sizeof *S);
    memset(Gamma, 0, square * sizeof *Gamma);
    for (i = 0; i < n; i++)
        Gamma[at(i, i, n)] = -1.0;
    if (m > 0) {
        perp__cholesky_factor(m, block, n);
        perp__cholesky_solve(m, 2 * n, block, n, X, n);
        perp__gemm_subtract(n, n, m, C, n, X, n, S, n);
        perp__gemm_subtract(n, n, m, C, n, X + square, n, Gamma, n);
    }
    for (i = 0; i < n * n; i++)
        Gamma[i] = -Gamma[i];
    perp__cholesky_factor(n, S, n);
    perp__cholesky_solve(n, n, S, n, Gamma, n);
    verdict = perp__stability_of(n, Gamma, f->stiffness, f->damping, S + square, eigenvalues);
    *stable = verdict.stable;
    *flutter = verdict.flutter;
}
