/* What takes part in a state's accelerations. A contact is closed where its gap is at most
 * rounding: 1e-12 of sum |H_i q_i|, the terms that a gap is a sum of (with coordinates other than
 * velocities, sum |H_i| max |q|); it takes part where its normal velocity is 0 up to 1e-12 of
 * sum |H_i v_i| + |drift|. Sliding velocities are judged alike. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "mechanism/accelerations/accelerations.h"

/* The first step moves the coordinates by this, beside the largest of them or 1 (an angle's unit);
 * what is too long is no harm. Not a round number: motion with a period must not look as if it
 * stood still. */
#define FIRST_MOVE 0.3711

/* Whether the element slides now, and along which direction. */
static void find_slip(const perp_mechanism *m, perp__element *element, const double *v)
{
    const double *u = m->start_velocity + m->tangent[element->source];
    const double speed =
        perp__sliding_speed(m, &m->begin, element->source, m->start_velocity, v, PERP__NOTHING);

    element->moves = speed > 0.0;
    for (int32_t i = 0; i < element->tangents && element->moves; i++)
        element->direction[i] = u[i] / speed;
}

perp__element *perp__element_add(perp__acceleration *a, int32_t source)
{
    const perp_mechanism *m = a->m;
    perp__element *element = a->element + a->elements++;

    memset(element, 0, sizeof *element);
    element->source = source;
    element->row = a->active;
    element->dry = source >= m->contacts;
    element->two_sided = !element->dry && m->two_sided[source] > 0;
    element->normals = element->two_sided ? m->two_sided[source] : !element->dry;
    element->tangent = element->row + element->normals;
    element->tangents = m->tangents[source];
    if (element->dry)
        element->bound = m->begin.bound[source - m->contacts];
    element->friction = element->bound > 0.0;
    a->pattern.load[PERP__MOST_NORMALS * (a->elements - 1)] = 1.0;
    for (int32_t i = -element->normals; i < element->tangents; i++)
        a->row_of[a->active++] = m->tangent[source] + i;
    return element;
}

void perp__element_add_bilateral(perp__acceleration *a)
{
    a->closed = a->elements;
    a->bilateral_row = a->active;
    for (int32_t j = 0; j < a->m->bilateral; j++)
        a->row_of[a->active++] = a->m->contact_rows + j;
}

/* The bias, with what it may be wrong by: a tolerance of its size covers that, too. */
static perp_status find_bias(perp__acceleration *a, double t, const double *q, const double *v)
{
    perp_mechanism *m = a->m;
    double largest = 1.0, fastest = 0.0;
    /* from a time in which the coordinates change by about their size */
    perp_status status = perp__evaluate_move(m, m->moved, q, q, 1.0, v);

    for (int32_t i = 0; i < m->coordinates && status == PERP_OK; i++) {
        largest = fmax(largest, fabs(q[i]));
        fastest = fmax(fastest, fabs(m->moved[i] - q[i]));
    }
    if (status == PERP__OUTSIDE)
        status = PERP_OK;
    PERP__THEN(status, perp__evaluate_bias(m, a->bias, a->size, t, q, v,
                                           FIRST_MOVE * (fastest > 0.0 ? largest / fastest : 1.0),
                                           PERP__MOST_HALVES));
    for (int32_t i = 0; i < m->rows; i++)
        a->size[i] = fabs(a->bias[i]) + a->size[i] / PERP__NOTHING;
    return status;
}

/* ---- the system ----------------------------------------------------------------------------- */

/* What grows with the square of the rows that take part: few of many, in most states. */
static void layout_blocks(perp__arena *arena, void *object)
{
    perp__acceleration *a = object;
    const size_t active = (size_t)a->active, square = active * active;

    PERP__DOUBLES(arena, square, &a->W, &a->held, &a->turning.K);
    perp__linear_layout(&a->linear, arena);
    a->work =
        perp__arena_take(arena, 4 * square + 8 * active + 4 * (size_t)a->m->n, sizeof(double));
}

/* Room for the matrices of the active rows; what they held is lost. */
static perp_status make_room(perp__acceleration *a)
{
    perp__linear *p = &a->linear;

    p->length = p->rows = a->polyhedron.length = a->active;
    if (perp__arena_fit(&a->blocks, a->m->context, layout_blocks, a) != PERP_OK)
        return perp__fail_memory(a->m->context, "accelerations");
    p->block[0] = a->W;
    p->c = a->beta;
    p->c_size = a->load;
    p->scale = a->scale;
    p->positions = a->elements + a->m->bilateral;
    a->polyhedron.origin = p->x;
    a->polyhedron.directions = p->null;
    a->polyhedron.entries = a->row_of;
    return PERP_OK;
}

/* held := W - W_b W_bb^+ W_b', the same where the bilateral rows hold. */
static void hold_bilateral(perp__acceleration *a)
{
    const size_t active = (size_t)a->active, n = (size_t)a->m->bilateral;
    const size_t b = (size_t)a->bilateral_row;
    double *rhs = a->linear.residual, *x = a->linear.y;

    memcpy(a->held, a->W, active * active * sizeof *a->held);
    if (n == 0)
        return;
    a->linear.system.n = (int32_t)n;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++)
            a->linear.system.K[i * n + j] =
                a->W[(b + i) * active + b + j] * a->scale[b + i] * a->scale[b + j];
    perp__pivoting_eliminate(&a->linear.system, PERP__SINGULAR * PERP__ACCELERATION_SINGULAR,
                             a->linear.system.n);
    for (size_t j = 0; j < active; j++) {
        for (size_t k = 0; k < n; k++)
            rhs[k] = a->W[(b + k) * active + j] * a->scale[b + k];
        perp__pivoting_solve(&a->linear.system, x, rhs);
        for (size_t i = 0; i < active; i++) {
            double sum = a->W[i * active + j], size = fabs(sum);

            for (size_t k = 0; k < n; k++) {
                const double term = a->W[i * active + b + k] * a->scale[b + k] * x[k];

                sum -= term;
                size += fabs(term);
            }
            a->held[i * active + j] = fabs(sum) <= PERP__SUM_ROUNDING * size ? 0.0 : sum;
        }
    }
}

perp_status perp__acceleration_reduce(perp__acceleration *a)
{
    const perp_mechanism *m = a->m;
    const size_t n = (size_t)m->n, active = (size_t)a->active;
    perp_status status = make_room(a);

    if (status != PERP_OK)
        return status;
    perp__solve_mass(m, &m->begin, a->velocity, m->begin.k);
    for (size_t i = 0; i < active; i++) {
        const int32_t row = a->row_of[i];
        const double *J = m->begin.J + (size_t)row * n;
        int exponent;

        a->beta[i] = perp__row_times(m, &m->begin, row, a->bias[row], a->velocity);
        a->load[i] = perp__row_terms(m, &m->begin, row, a->size[row], a->velocity);
        perp__solve_mass(m, &m->begin, a->work, J);
        for (size_t j = 0; j <= i; j++)
            a->W[i * active + j] = a->W[j * active + i] =
                perp__row_times(m, &m->begin, a->row_of[j], 0.0, a->work);
        /* a row without digits to tell signs by */
        a->answers.incomplete |= a->W[i * (active + 1)] < DBL_MIN && perp__largest(J, m->n) > 0.0;
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
    const double *u = m->start_velocity;
    perp_status status = perp__evaluate_all(m, &m->begin, t, q, v);

    *impact = -1;
    a->elements = a->closed = a->active = 0;
    if (status == PERP__OUTSIDE)
        return perp__refuse(m->context, "q is outside of what the mechanism is defined for");
    if (status != PERP_OK)
        return status;
    perp__row_velocities(m, &m->begin, m->start_velocity, v);
    perp__friction_of_speed(m, &m->begin, m->friction, u, v);
    /* 1. the elements */
    for (int32_t j = 0; j < m->contacts; j++) {
        const int32_t row = m->starts[j], one_sided = m->two_sided[j] == 0;
        const double rounding = PERP__NOTHING * perp__row_size(m, &m->begin, row, v);
        const double at_rest = fmax(m->mu_static[j], m->begin.mu[j]);
        perp__element *element;

        if (one_sided && (m->begin.gap[j] > PERP__NOTHING * perp__gap_size(m, &m->begin, row, q) ||
                          u[row] > rounding))
            continue;
        if (one_sided && u[row] < -rounding && *impact < 0)
            *impact = j;
        element = perp__element_add(a, j);
        find_slip(m, element, v);
        element->mu_stick = at_rest;
        /* a slip that starts is slow: Stribeck's curve is at its beginning */
        element->mu = element->moves         ? m->friction[j]
                      : m->stribeck[j] > 0.0 ? at_rest
                                             : m->begin.mu[j];
        element->friction =
            element->tangents > 0 && (element->moves ? element->mu > 0.0 : at_rest > 0.0);
    }
    perp__element_add_bilateral(a);
    for (int32_t j = 0; j < m->dry; j++)
        find_slip(m, perp__element_add(a, m->contacts + j), v);
    /* 2. their accelerations, unless an impact comes before */
    if (*impact < 0) {
        status = find_bias(a, t, q, v);
        if (status == PERP__OUTSIDE)
            status = perp__refuse(m->context, "q is outside of what the mechanism is defined for");
        PERP__THEN(status, perp__acceleration_reduce(a));
    }
    return status;
}
