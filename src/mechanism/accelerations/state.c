/* What takes part in a state's accelerations. A contact is closed where its gap is at most
 * rounding: 1e-12 of sum |H_i q_i|, the terms that a gap is a sum of (with coordinates other than
 * velocities, sum |H_i| max |q|); it takes part where its normal velocity is 0 up to 1e-12 of
 * sum |H_i v_i| + |drift|. Sliding velocities are judged alike. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "linalg/blas.h"
#include "mechanism/accelerations/accelerations.h"

/* Of gaps and velocities, beside the terms of their sums. */
#define CLOSED_TOLERANCE 1e-12

static double velocity_tolerance(const perp_mechanism *m, int32_t row, const double *v)
{
    return CLOSED_TOLERANCE * perp__row_size(m, &m->begin, row, v);
}

/* The direction along which `tangents` rows from `row` on slide; 0: they don't. */
static int32_t slides(const perp_mechanism *m, int32_t row, int32_t tangents, const double *v,
                      double direction[2])
{
    const double *u = m->start_velocity + row;
    double length = 0.0, tolerance = 0.0;
    int32_t i;

    direction[0] = direction[1] = 0.0;
    for (i = 0; i < tangents; i++) {
        length = hypot(length, u[i]);
        tolerance = hypot(tolerance, velocity_tolerance(m, row + i, v));
    }
    if (!(length > tolerance))
        return 0;
    for (i = 0; i < tangents; i++)
        direction[i] = u[i] / length;
    return 1;
}

perp__element *perp__element_add(perp__acceleration *a, int32_t source)
{
    const perp_mechanism *m = a->m;
    perp__element *element = a->element + a->elements++;
    int32_t i;

    memset(element, 0, sizeof *element);
    element->source = source;
    element->row = a->active;
    element->dry = source >= m->contacts;
    element->tangents = m->tangents[source];
    if (element->dry)
        element->bound = m->begin.bound[source - m->contacts];
    element->friction = element->bound > 0.0;
    for (i = -!element->dry; i < element->tangents; i++)
        a->row_of[a->active++] = m->tangent[source] + i;
    return element;
}

void perp__element_add_bilateral(perp__acceleration *a)
{
    int32_t j;

    a->closed = a->elements;
    a->bilateral_row = a->active;
    for (j = 0; j < a->m->bilateral; j++)
        a->row_of[a->active++] = a->m->contact_rows + j;
}

/* friction: the coefficient that counts at the speed of now. */
static void add_contact(perp__acceleration *a, int32_t j, const double *friction, const double *v)
{
    const perp_mechanism *m = a->m;
    perp__element *element = perp__element_add(a, j);
    const double at_rest = fmax(m->mu_static[j], m->begin.mu[j]);

    element->moves = slides(m, m->starts[j] + 1, element->tangents, v, element->direction);
    element->mu_stick = at_rest;
    /* a slip that starts is slow: Stribeck's curve is at its beginning */
    element->mu = element->moves ? friction[j] : m->stribeck[j] > 0.0 ? at_rest : m->begin.mu[j];
    element->friction =
        element->tangents > 0 && (element->moves ? element->mu > 0.0 : at_rest > 0.0);
}

/* Returns a closed contact that approaches, or -1. */
static int32_t find_elements(perp__acceleration *a, const double *q, const double *v)
{
    perp_mechanism *m = a->m;
    int32_t impact = -1, j;

    a->elements = a->active = 0;
    perp__row_velocities(m, &m->begin, m->start_velocity, v);
    perp__friction_of_speed(m, &m->begin, m->friction, m->start_velocity, v);
    for (j = 0; j < m->contacts; j++) {
        const int32_t row = m->starts[j];
        const double speed = m->start_velocity[row], rounding = velocity_tolerance(m, row, v);

        if (m->begin.gap[j] > CLOSED_TOLERANCE * perp__gap_size(m, &m->begin, row, q) ||
            speed > rounding)
            continue;
        if (speed < -rounding && impact < 0)
            impact = j;
        add_contact(a, j, m->friction, v);
    }
    perp__element_add_bilateral(a);
    for (j = 0; j < m->dry; j++) {
        perp__element *element = perp__element_add(a, m->contacts + j);

        element->moves =
            slides(m, a->row_of[element->row], element->tangents, v, element->direction);
    }
    return impact;
}

/* held := W - W_b W_bb^+ W_b', the same where the bilateral rows hold. */
static void hold_bilateral(perp__acceleration *a)
{
    const size_t active = (size_t)a->active, n = (size_t)a->m->bilateral;
    const size_t b = (size_t)a->bilateral_row;
    double *rhs = a->linear.residual, *x = a->linear.y;
    size_t i, j, k;

    memcpy(a->held, a->W, active * active * sizeof *a->held);
    if (n == 0)
        return;
    a->linear.system.n = (int32_t)n;
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            a->linear.system.K[i * n + j] =
                a->W[(b + i) * active + b + j] * a->scale[b + i] * a->scale[b + j];
    perp__pivoting_eliminate(&a->linear.system, PERP__ACCELERATION_SINGULAR * 4.0,
                             a->linear.system.n);
    for (j = 0; j < active; j++) {
        for (k = 0; k < n; k++)
            rhs[k] = a->W[(b + k) * active + j] * a->scale[b + k];
        perp__pivoting_solve(&a->linear.system, x, rhs);
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

perp_status perp__acceleration_reduce(perp__acceleration *a)
{
    const perp_mechanism *m = a->m;
    const size_t n = (size_t)m->n, active = (size_t)a->active;
    perp_status status = perp__acceleration_make_room(a);
    size_t i, j, k;

    if (status != PERP_OK)
        return status;
    memcpy(a->velocity, m->begin.k, n * sizeof *a->velocity);
    perp__solve_mass(m, &m->begin, a->velocity);
    for (i = 0; i < active; i++) {
        const size_t row = (size_t)a->row_of[i];
        const double *J = m->begin.J + row * n;
        int32_t moves = 0;
        int exponent;

        a->beta[i] = a->bias[row];
        a->load[i] = a->size[row];
        for (k = 0; k < n; k++) {
            a->beta[i] += J[k] * a->velocity[k];
            a->load[i] += fabs(J[k] * a->velocity[k]);
            moves = moves || J[k] != 0.0;
        }
        memcpy(a->work, J, n * sizeof *a->work);
        perp__solve_mass(m, &m->begin, a->work);
        for (j = 0; j <= i; j++) {
            const double *other = m->begin.J + (size_t)a->row_of[j] * n;
            double sum = 0.0;

            for (k = 0; k < n; k++)
                sum += other[k] * a->work[k];
            a->W[i * active + j] = a->W[j * active + i] = sum;
        }
        if (moves && a->W[i * (active + 1)] < DBL_MIN) /* it has no digits to tell signs by */
            a->answers.incomplete = 1;
        frexp(a->W[i * (active + 1)], &exponent);
        a->scale[i] = ldexp(1.0, -(exponent / 2));
    }
    if (!perp__all_finite(a->W, active * active) || !perp__all_finite(a->beta, active) ||
        !perp__all_finite(a->load, active) || !perp__all_finite(a->velocity, n))
        return perp__fail(m->context, PERP_ERROR_NOT_FINITE,
                          "accelerations: M^-1 k, J M^-1 J' or d/dt(J) v overflows");
    hold_bilateral(a);
    return PERP_OK;
}

perp_status perp__acceleration_state(perp__acceleration *a, int32_t *impact, double t,
                                     const double *q, const double *v)
{
    perp_mechanism *m = a->m;
    perp_status status = perp__evaluate_all(m, &m->begin, t, q, v);

    *impact = -1;
    a->elements = a->closed = a->active = 0;
    if (status == PERP_OK)
        *impact = find_elements(a, q, v);
    if (status == PERP_OK && *impact < 0)
        status = perp__acceleration_bias(a, t, q, v);
    if (status == PERP__OUTSIDE)
        return perp__fail(m->context, PERP_ERROR_ARGUMENT,
                          "q is outside of what the mechanism is defined for");
    if (status == PERP_OK && *impact < 0)
        status = perp__acceleration_reduce(a);
    return status;
}
