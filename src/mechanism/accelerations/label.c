/* Stability of an answer where its contacts give way a little: displacements y of the normals that
 * press and of the tangents that stick, forces -(k y + c y'), so that
 *
 *   y'' = -Gamma (k y + c y') + const,   Gamma = J_a M^-1 C_a,
 *
 * with the bilateral rows held and C_a the columns of forces: a normal with the friction of its
 * slip, or one of its own. y moves in the range of S = J_a M^-1 J_a' alone: rows that depend on
 * each other count once. With S = B B' (Cholesky with pivoting), Gamma B = B Gamma_r. */
#include <math.h>
#include <string.h>

#include "mechanism/accelerations/accelerations.h"
#include "mechanism/stability.h"

/* What is left of a diagonal entry, beside what it was, that counts as 0. */
#define DEPENDENT 1e-11

typedef struct compliant {
    int32_t count;
    int32_t *row, *way; /* way: of the unit's slip, or -1 */
    double *Gamma, *S, *B, *product;
    int32_t *pivot;
} compliant;

static void list_rows(perp__acceleration *a, const perp__found_pattern *pattern, compliant *c)
{
    int32_t index, i;

    c->count = 0;
    for (index = 0; index < a->units; index++) {
        const perp__unit *unit = a->unit + index;
        const int32_t mode = pattern->mode[index];
        const int32_t normal = perp__found_presses(unit, mode);
        const int32_t rows = mode == PERP_MECHANISM_STICK ? normal + unit->tangents : normal;

        for (i = 0; i < rows; i++) {
            c->row[c->count] = unit->row + i;
            c->way[c->count++] =
                mode == PERP_MECHANISM_SLIP && unit->friction && i == 0 ? index : -1;
        }
    }
}

static void fill(perp__acceleration *a, const perp__found_pattern *pattern, compliant *c)
{
    const size_t active = (size_t)a->active, n = (size_t)c->count;
    size_t i, j;
    int32_t k;

    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            const double *row = a->held + (size_t)c->row[i] * active + c->row[j];
            double sum = row[0];

            c->S[i * n + j] = row[0];
            for (k = 0; c->way[j] >= 0 && k < a->unit[c->way[j]].tangents; k++)
                sum -= a->unit[c->way[j]].mu * pattern->way[2 * c->way[j] + k] * row[1 + k];
            c->Gamma[i * n + j] = sum;
        }
}

/* Returns the rank. B: n by n, its columns the factor's. product: the diagonal at the start. */
static int32_t factor(compliant *c)
{
    const size_t n = (size_t)c->count;
    size_t rank, i, j;

    for (i = 0; i < n; i++)
        c->product[i] = c->S[i * (n + 1)];
    for (rank = 0; rank < n; rank++) {
        size_t p = 0;
        double best = DEPENDENT;

        for (i = 0; i < n; i++)
            if (c->product[i] > 0.0 && c->S[i * (n + 1)] > best * c->product[i]) {
                best = c->S[i * (n + 1)] / c->product[i];
                p = i;
            }
        if (best <= DEPENDENT)
            break;
        c->pivot[rank] = (int32_t)p;
        for (i = 0; i < n; i++)
            c->B[i * n + rank] = c->S[i * n + p] / sqrt(c->S[p * (n + 1)]);
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++)
                c->S[i * n + j] -= c->B[i * n + rank] * c->B[j * n + rank];
        for (i = 0; i <= rank; i++) /* exactly nothing is left there */
            for (j = 0; j < n; j++)
                c->S[(size_t)c->pivot[i] * n + j] = c->S[j * n + (size_t)c->pivot[i]] = 0.0;
    }
    return (int32_t)rank;
}

/* Gamma_r = B_p^-1 (Gamma B)_p, rank by rank by columns, with B_p the pivots' rows: triangular. */
static void restrict_to_range(compliant *c, int32_t rank)
{
    const size_t n = (size_t)c->count, r = (size_t)rank;
    size_t i, j, k;

    for (j = 0; j < r; j++)
        for (i = 0; i < r; i++) {
            const size_t p = (size_t)c->pivot[i];
            double sum = 0.0;

            for (k = 0; k < n; k++)
                sum += c->Gamma[p * n + k] * c->B[k * n + j];
            for (k = 0; k < i; k++)
                sum -= c->B[p * n + k] * c->product[k + r * j];
            c->product[i + r * j] = sum / c->B[p * n + i];
        }
}

void perp__found_label(perp__acceleration *a, perp__found_answer *answer)
{
    const perp_mechanism_settings *settings = &a->m->settings;
    const size_t active = (size_t)a->active;
    perp__stability verdict;
    compliant c;
    int32_t rank;

    c.Gamma = a->work;
    c.S = c.Gamma + active * active;
    c.B = c.S + active * active;
    c.product = c.B + active * active;
    c.row = a->indices;
    c.way = c.row + active;
    c.pivot = c.way + active;
    list_rows(a, &answer->pattern, &c);
    fill(a, &answer->pattern, &c);
    rank = factor(&c);
    restrict_to_range(&c, rank);
    verdict = perp__stability_of(rank, c.product, settings->stiffness, settings->damping, c.S,
                                 answer->eigenvalues);
    answer->eigenvalue_count = 2 * rank;
    answer->stable = verdict.stable && answer->free == 0;
    answer->flutter = verdict.flutter;
}
