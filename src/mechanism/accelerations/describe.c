/* What there is to say of an answer whose forces are known: M v' = k + J'f, u' = J v' + bias, the
 * modes, and how well the laws are met. Rows that hold have u' = 0 exactly, and v' is found in what
 * they leave free: at rest it is 0.0. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "mechanism/accelerations/accelerations.h"

/* Rows that do not hold say something about u' all the same: to this, relative to its terms. */
#define SMALL 1e-11

static void mark_rows(const perp__acceleration *a, perp__found_answer *answer, int8_t *holds)
{
    const perp_mechanism *m = a->m;
    int32_t index, i;

    memset(holds, 0, (size_t)m->rows);
    memset(holds + m->contact_rows, 1, (size_t)m->bilateral);
    for (index = 0; index < a->units; index++) {
        const perp__unit *unit = a->unit + index;
        const int32_t mode = answer->pattern.mode[index], first = a->row_of[unit->row];
        const int32_t rows = unit->tangents + (unit->dry ? 0 : 1);

        for (i = 0; i < rows; i++)
            holds[first + i] = (int8_t)(mode == PERP_MECHANISM_STICK ||
                                        (perp__found_presses(unit, mode) && i == 0));
    }
}

/* v' and u' from the forces. */
static void find_acceleration(perp__acceleration *a, perp__found_answer *answer)
{
    perp_mechanism *m = a->m;
    perp__terms terms = m->begin;
    perp__velocity_problem problem = {0};
    perp__velocity_answer held = {0};

    terms.drift = a->bias;
    problem.terms = &terms;
    problem.momentum = terms.k;
    problem.shift = a->zeros;
    held.v = answer->acceleration;
    held.r = answer->force;
    held.u = answer->row_acceleration;
    held.holds = m->second.holds;
    mark_rows(a, answer, held.holds);
    memcpy(held.v, terms.k, (size_t)m->n * sizeof *held.v);
    perp__add_impulses(m, &terms, held.v, held.r);
    perp__solve_mass(m, &terms, held.v);
    perp__hold_velocities(m, &held, &problem);
}

/* |M v' - k - J'f| beside its terms, in units of sqrt(M_ii). */
static double dynamic_residual(const perp__acceleration *a, const perp__found_answer *answer)
{
    const perp_mechanism *m = a->m;
    const size_t n = (size_t)m->n;
    double worst = 0.0, largest = 0.0;
    size_t i, k;

    for (i = 0; i < n; i++) {
        const double unit = sqrt(m->begin.M[i * (n + 1)]);
        double sum = -m->begin.k[i], size = fabs(sum);

        for (k = 0; k < n; k++) {
            const double term = m->begin.M[i * n + k] * answer->acceleration[k];

            sum += term;
            size += fabs(term);
        }
        for (k = 0; k < (size_t)m->rows; k++) {
            const double term = m->begin.J[k * n + i] * answer->force[k];

            sum -= term;
            size += fabs(term);
        }
        perp__raise_to(&worst, fabs(sum) / unit);
        perp__raise_to(&largest, size / unit);
    }
    return largest == 0.0 ? 0.0 : worst / largest;
}

/* How far u' of active row r is off where it is to be 0 (sign 0) or not negative (sign 1). */
static double row_residual(const perp__acceleration *a, const perp__found_answer *answer, int32_t r,
                           int32_t sign)
{
    const perp_mechanism *m = a->m;
    const size_t n = (size_t)m->n, row = (size_t)a->row_of[r];
    double sum = a->bias[row], size = a->load[r];
    size_t k;

    for (k = 0; k < n; k++)
        sum += m->begin.J[row * n + k] * answer->acceleration[k];
    for (k = 0; k < (size_t)a->active; k++)
        size += fabs(a->W[(size_t)r * (size_t)a->active + k] * answer->force[a->row_of[k]]);
    if (!sign || sum < 0.0)
        return size == 0.0 ? 0.0 : fabs(sum) / size;
    return sum >= 0.0 ? 0.0 : sum; /* NaN */
}

/* largest: of the forces in their units. */
static double unit_residual(const perp__acceleration *a, const perp__found_answer *answer,
                            int32_t index, double largest)
{
    const perp__unit *unit = a->unit + index;
    const int32_t mode = answer->pattern.mode[index], row = a->row_of[unit->row];
    const int32_t tangent = unit->dry ? row : row + 1;
    const double *f = answer->force;
    double worst = 0.0, size = unit->dry ? unit->bound : f[row], length = 0.0, limit;
    int32_t i;

    if (!unit->dry) {
        worst = row_residual(a, answer, unit->row, mode == PERP_MECHANISM_SEPARATE);
        perp__raise_to(&worst, -size / (largest * a->scale[unit->row]));
    }
    for (i = 0; i < unit->tangents; i++) {
        length = hypot(length, f[tangent + i]);
        if (mode == PERP_MECHANISM_STICK)
            perp__raise_to(&worst, row_residual(a, answer, unit->row + !unit->dry + i, 0));
    }
    limit = (unit->dry                      ? 1.0
             : mode == PERP_MECHANISM_STICK ? unit->mu_stick
                                            : unit->mu) *
            fmax(size, 0.0);
    if (unit->tangents > 0)
        perp__raise_to(&worst, (length - limit) / (largest * a->scale[unit->row + !unit->dry]));
    return worst;
}

static void name_modes(const perp__acceleration *a, perp__found_answer *answer)
{
    const perp_mechanism *m = a->m;
    int32_t index, i;

    memset(answer->modes, 0, (size_t)(m->contacts + m->dry) * sizeof *answer->modes);
    answer->pressing = 0;
    for (index = 0; index < a->units; index++) {
        const perp__unit *unit = a->unit + index;
        int32_t mode = answer->pattern.mode[index];

        answer->pressing += perp__found_presses(unit, mode);
        if (mode == PERP_MECHANISM_SLIP && !unit->dry && !unit->friction && !unit->moves) {
            mode = PERP_MECHANISM_STICK; /* nothing holds it, but it does not move either */
            for (i = 0; i < unit->tangents; i++)
                if (row_residual(a, answer, unit->row + 1 + i, 0) > SMALL)
                    mode = PERP_MECHANISM_SLIP;
        }
        answer->modes[unit->source] = mode;
    }
}

void perp__found_describe(perp__acceleration *a, perp__found_answer *answer)
{
    const perp_mechanism *m = a->m;
    double largest = DBL_MIN;
    int32_t i;

    find_acceleration(a, answer);
    for (i = 0; i < a->active; i++)
        largest = fmax(largest, fabs(answer->force[a->row_of[i]]) / a->scale[i]);
    answer->residual = dynamic_residual(a, answer);
    for (i = 0; i < m->bilateral; i++)
        perp__raise_to(&answer->residual, row_residual(a, answer, a->bilateral_row + i, 0));
    for (i = 0; i < a->units; i++)
        perp__raise_to(&answer->residual, unit_residual(a, answer, i, largest));
    name_modes(a, answer);
    perp__found_label(a, answer);
}
