/* Why a state has as many accelerations as it has. Each pattern's system has a determinant, a
 * principal minor of the contact matrix; in the plane all of them are positive if and only if there
 * is exactly one answer whatever the loads are (the map of the patterns is piecewise linear, with
 * no more than four pieces around an edge: S. Scholtes, "Introduction to Piecewise Differentiable
 * Equations" (2012), section 2.3). */
#include <math.h>
#include <string.h>

#include "mechanism/accelerations/accelerations.h"

#define SINGULAR PERP__FOUND_SINGULAR

/* held := W - W_b W_bb^+ W_b', the same where the bilateral rows hold. */
void perp__found_hold_bilateral(perp__acceleration *a)
{
    const size_t active = (size_t)a->active, n = (size_t)a->m->bilateral;
    const size_t b = (size_t)a->bilateral_row;
    double *rhs = a->rhs, *x = a->x;
    size_t i, j, k;

    memcpy(a->held, a->W, active * active * sizeof *a->held);
    if (n == 0)
        return;
    a->system.n = (int32_t)n;
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            a->system.K[i * n + j] =
                a->W[(b + i) * active + b + j] * a->scale[b + i] * a->scale[b + j];
    perp__pivoting_eliminate(&a->system, SINGULAR * 4.0, a->system.n);
    for (j = 0; j < active; j++) {
        for (k = 0; k < n; k++)
            rhs[k] = a->W[(b + k) * active + j] * a->scale[b + k];
        perp__pivoting_solve(&a->system, x, rhs);
        for (i = 0; i < active; i++) {
            double sum = a->W[i * active + j], size = fabs(sum);

            for (k = 0; k < n; k++) {
                const double term = a->W[i * active + b + k] * a->scale[b + k] * x[k];

                sum -= term;
                size += fabs(term);
            }
            a->held[i * active + j] = fabs(sum) <= 1e-14 * size ? 0.0 : sum;
        }
    }
}

static int32_t first_contact(const perp__acceleration *a)
{
    int32_t i;

    for (i = 0; i < a->closed; i++)
        if (a->pattern.mode[i] != PERP_MECHANISM_SEPARATE)
            return a->unit[i].source;
    return -1;
}

void perp__found_note_sign(perp__acceleration *a)
{
    if (a->system.sign == 0 && !a->has_singular) {
        a->has_singular = 1;
        a->singular_unit = first_contact(a);
    }
    if (a->system.sign < 0 && !a->has_negative) {
        a->has_negative = 1;
        a->negative_unit = first_contact(a);
    }
}

/* n'M^-1 (n - mu d) beside n'M^-1 n, in the worst direction; +inf where there is no such thing. */
static double inertia_of(const perp__acceleration *a, const perp__unit *unit)
{
    const size_t active = (size_t)a->active, r = (size_t)unit->row;
    const double *row = a->held + r * active;
    const double normal = row[r];
    double coupling;

    if (!unit->friction || !(normal > PERP__FOUND_TOLERANCE * a->W[r * (active + 1)]))
        return INFINITY;
    coupling = unit->tangents == 1 ? row[r + 1] : hypot(row[r + 1], row[r + 2]);
    if (unit->moves)
        coupling =
            unit->way[0] * row[r + 1] + (unit->tangents > 1 ? unit->way[1] * row[r + 2] : 0.0);
    else
        coupling = fabs(coupling);
    return (normal - unit->mu * coupling) / normal;
}

/* A contact at rest that has more friction than it slips with. */
static int32_t first_with_static_friction(const perp__acceleration *a)
{
    int32_t i;

    for (i = 0; i < a->closed; i++)
        if (a->unit[i].friction && !a->unit[i].moves && a->unit[i].mu_stick > a->unit[i].mu)
            return a->unit[i].source;
    return -1;
}

void perp__found_reason(const perp__acceleration *a, perp_mechanism_summary *summary)
{
    int32_t worst = -1, i;

    summary->inertia = INFINITY;
    summary->contact = -1;
    for (i = 0; i < a->closed; i++) {
        const double inertia = inertia_of(a, a->unit + i);

        if (inertia < summary->inertia) {
            summary->inertia = inertia;
            worst = a->unit[i].source;
        }
    }
    if (summary->inertia < -SINGULAR) {
        summary->reason = PERP_MECHANISM_NEGATIVE_INERTIA;
        summary->contact = worst;
    } else if (!a->complete) {
        summary->reason = PERP_MECHANISM_UNDECIDED;
    } else if (a->has_negative) {
        summary->reason = PERP_MECHANISM_COUPLED;
        summary->contact = a->negative_unit;
    } else if (summary->inertia <= SINGULAR) {
        summary->reason = PERP_MECHANISM_ZERO_INERTIA;
        summary->contact = worst;
    } else if (a->has_singular) {
        summary->reason = PERP_MECHANISM_REDUNDANT;
        summary->contact = a->singular_unit;
    } else {
        summary->contact = first_with_static_friction(a);
        summary->reason =
            summary->contact >= 0 ? PERP_MECHANISM_STATIC_FRICTION : PERP_MECHANISM_ALWAYS_ONE;
    }
}
