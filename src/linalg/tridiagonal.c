/* LU factorisation of tridiagonal blocks with partial pivoting: Golub & Van Loan, "Matrix
 * Computations" (4th ed.), section 4.3; an exchange of two neighbouring rows fills the second
 * diagonal above. */
#include "linalg/tridiagonal.h"

#include <math.h>

bool perp__is_tridiagonal(const perp__matrix *M)
{
    if (!M->column_starts)
        return 0;
    for (int32_t j = 0; j < M->columns; j++) {
        const int32_t first = M->column_starts[j], last = M->column_starts[j + 1] - 1;

        if (first <= last && (M->row_indices[first] < j - 1 || M->row_indices[last] > j + 1))
            return 0;
    }
    return 1;
}

void perp__tridiagonal_layout(perp__arena *arena, perp__tridiagonal *T, size_t n)
{
    PERP__DOUBLES(arena, n, &T->below, &T->diagonal, &T->above);
}

void perp__tridiagonal_read(perp__tridiagonal *T, const perp__matrix *M)
{
    const int32_t n = M->columns;

    T->n = n;
    for (int32_t j = 0; j < n; j++)
        T->below[j] = T->diagonal[j] = T->above[j] = 0.0;
    for (int32_t j = 0; j < n; j++)
        for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++) {
            const int32_t i = M->row_indices[k];
            const double value = M->values[k];

            if (i < j)
                T->above[i] = value;
            else if (i == j)
                T->diagonal[j] = value;
            else
                T->below[j] = value;
        }
}

void perp__tridiagonal_factor_layout(perp__arena *arena, perp__tridiagonal_factor *factor, size_t n)
{
    PERP__DOUBLES(arena, n, &factor->multipliers, &factor->pivots, &factor->above, &factor->second);
    factor->exchanged = perp__arena_take(arena, n, sizeof(int8_t));
}

/* Entry k of a diagonal beside the main one of the block: neighbours in the block that are none in
 * T do not couple. */
static double beside(const double *diagonal, const int32_t *active, int32_t count, int32_t k)
{
    return k + 1 < count && active[k + 1] == active[k] + 1 ? diagonal[active[k]] : 0.0;
}

int32_t perp__tridiagonal_factorise(perp__tridiagonal_factor *factor, const perp__tridiagonal *T,
                                    const int32_t *active, int32_t count, double rho)
{
    double pivot = count > 0 ? T->diagonal[active[0]] + rho : 1.0;
    double above = beside(T->above, active, count, 0);
    int32_t regular = 1, k;

    factor->n = count;
    for (k = 0; k < count; k++) {
        const double below = beside(T->below, active, count, k);
        const double next = k + 1 < count ? T->diagonal[active[k + 1]] + rho : 0.0;
        const double next_above = beside(T->above, active, count, k + 1);

        factor->exchanged[k] = fabs(below) > fabs(pivot);
        if (factor->exchanged[k]) {
            const double multiplier = pivot / below;

            factor->multipliers[k] = multiplier;
            factor->pivots[k] = 1.0 / below;
            factor->above[k] = next;
            factor->second[k] = next_above;
            pivot = above - multiplier * next;
            above = -multiplier * next_above;
        } else {
            const double multiplier = below / pivot;

            factor->multipliers[k] = multiplier;
            factor->pivots[k] = 1.0 / pivot;
            factor->above[k] = above;
            factor->second[k] = 0.0;
            pivot = next - multiplier * above;
            above = next_above;
        }
        /* the reciprocal of zero is infinite, that of an infinite pivot is zero */
        regular &= isfinite(factor->pivots[k]) && factor->pivots[k] != 0.0;
    }
    return regular;
}

void perp__tridiagonal_solve(const perp__tridiagonal_factor *factor, double *x)
{
    const int32_t n = factor->n;

    for (int32_t k = 0; k + 1 < n; k++) {
        if (factor->exchanged[k]) {
            const double first = x[k + 1];

            x[k + 1] = x[k] - factor->multipliers[k] * first;
            x[k] = first;
        } else {
            x[k + 1] -= factor->multipliers[k] * x[k];
        }
    }
    for (int32_t k = n - 1; k >= 0; k--) {
        if (k + 2 < n)
            x[k] -= factor->second[k] * x[k + 2];
        if (k + 1 < n)
            x[k] -= factor->above[k] * x[k + 1];
        x[k] *= factor->pivots[k];
    }
}

void perp__tridiagonal_solve_transposed(const perp__tridiagonal_factor *factor, double *x)
{
    const int32_t n = factor->n;

    for (int32_t k = 0; k < n; k++) {
        if (k > 0)
            x[k] -= factor->above[k - 1] * x[k - 1];
        if (k > 1)
            x[k] -= factor->second[k - 2] * x[k - 2];
        x[k] *= factor->pivots[k];
    }
    for (int32_t k = n - 2; k >= 0; k--) {
        const double value = x[k] - factor->multipliers[k] * x[k + 1];

        x[k] = value;
        if (factor->exchanged[k]) {
            x[k] = x[k + 1];
            x[k + 1] = value;
        }
    }
}
