/* The Jacobian of the implicit scheme's F. By impulses, and what J(q+) and M(q+) stand for by
 * velocities, it is known. What is left of its columns of v, `bent`, are the derivatives of M, k, J
 * and the coefficients by q+, times h, and those of k and bounds by v: by differences, n calls of
 * every callback. They are small beside the rest, of the order of h, and serve until z has moved
 * so far that they do not. */
#include <math.h>
#include <string.h>

#include "mechanism/schemes/implicit.h"

#define FORWARD 0x1p-26 /* about sqrt(eps), of a speed: a step of differences */
#define FAR 0.03        /* of the step's speed (or impulse): `bent` is out of date */

/* Columns of the friction's unknowns. */
static void fill_disc_columns(perp_mechanism *m, const perp__implicit *s,
                              const perp__implicit_disc *disc, double *J, const double *z)
{
    const size_t size = (size_t)s->size, first = (size_t)disc->first;
    const size_t last = first + (size_t)disc->forces; /* lambda */
    const double unit = disc->edges > 0 ? 1.0 : perp__implicit_radius(m, s, disc, z);
    const double *x = z + first;
    size_t i;
    int32_t l;

    for (i = 0; i < (size_t)disc->forces; i++) {
        double *column = J + (first + i) * size, d[2];

        perp__implicit_direction(disc, (int32_t)i, d);
        for (l = 0; l < disc->tangents; l++)
            perp__add_row(m, &m->end, disc->row + l, -unit * d[l], column);
        if (disc->edges > 0) {
            column[last] = -1.0;
            J[last * size + first + i] = 1.0;
        } else if (disc->tangents > 1) {
            column[first + i] += disc->weight * x[2];
            column[last] = -disc->weight * x[i];
            J[last * size + first + i] = disc->weight * x[i];
        }
    }
}

static void fill_impulse_columns(perp_mechanism *m, perp__implicit *s, double *J, const double *z)
{
    const size_t size = (size_t)s->size;
    int32_t k, i;

    for (k = 0; k < s->discs_count; k++) {
        const perp__implicit_disc *disc = s->discs + k;

        if (disc->normal >= 0) {
            double *column = J + (size_t)disc->normal * size;
            const double mu = m->friction[disc->contact];

            perp__add_row(m, &m->end, disc->row - 1, -1.0, column);
            for (i = 0; i < disc->tangents && disc->edges == 0; i++)
                perp__add_row(m, &m->end, disc->row + i, -mu * z[disc->first + i], column);
            if (disc->edges > 0)
                column[disc->first + disc->edges] = mu;
        }
        fill_disc_columns(m, s, disc, J, z);
    }
    for (i = 0; i < m->bilateral; i++)
        perp__add_row(m, &m->end, m->contact_rows + i, -1.0, J + (size_t)(s->bilateral + i) * size);
}

static int32_t is_gap(const perp_mechanism *m, const perp__implicit *s, int32_t i)
{
    int32_t k;

    if (i >= s->bilateral && i < s->bilateral + m->bilateral)
        return 1;
    for (k = 0; k < s->discs_count; k++)
        if (s->discs[k].normal == i)
            return 1;
    return 0;
}

/* column += factor J of the row, at row `to` of all columns of v. */
static void add_speed(const perp_mechanism *m, const perp__implicit *s, double *J, int32_t to,
                      int32_t row, double factor)
{
    const size_t n = (size_t)m->n, size = (size_t)s->size;
    size_t i;

    for (i = 0; i < n && factor != 0.0; i++)
        J[i * size + (size_t)to] += factor * m->end.J[(size_t)row * n + i];
}

/* Columns of v with the rows and M as they are. Gradients of gaps and of c are exact so; by
 * differences gap / h would be rounding. */
static void fill_speed_columns(const perp_mechanism *m, const perp__implicit *s, double *J)
{
    const size_t n = (size_t)m->n, size = (size_t)s->size;
    int32_t k, i, t;
    size_t j, l;

    for (j = 0; j < n; j++)
        for (l = 0; l < n; l++)
            J[j * size + l] = m->end.M[l * n + j];
    for (k = 0; k < s->discs_count; k++) {
        const perp__implicit_disc *disc = s->discs + k;
        const double weight = disc->edges > 0 ? 1.0 : disc->weight;

        if (disc->normal >= 0)
            add_speed(m, s, J, disc->normal, disc->row - 1, 1.0);
        for (i = 0; i < disc->forces; i++) {
            double d[2];

            perp__implicit_direction(disc, i, d);
            for (t = 0; t < disc->tangents; t++)
                add_speed(m, s, J, disc->first + i, disc->row + t, weight * d[t]);
        }
    }
    for (i = 0; i < m->bilateral; i++)
        add_speed(m, s, J, s->bilateral + i, m->contact_rows + i, 1.0);
}

/* Column i of `bent`: by differences, forwards or, at the edge of the domain, backwards. */
static perp_status bend(perp_mechanism *m, perp__implicit *s, const double *J, const double *z,
                        int32_t i)
{
    const double step = FORWARD * fmax(fabs(z[i]), s->steps[i]);
    const size_t at = (size_t)i * (size_t)s->size;
    perp_status status = PERP__OUTSIDE;
    int32_t side, k;

    memcpy(s->shifted, z, (size_t)s->size * sizeof *z);
    for (side = 0; side < 2 && status != PERP_OK && status != PERP_ERROR_CALLBACK; side++) {
        volatile double there = z[i] + (side == 0 ? step : -step);

        s->shifted[i] = there;
        status = perp__implicit_evaluate_at(m, s, s->changed, s->shifted);
    }
    if (status != PERP_OK)
        return status;
    for (k = 0; k < s->size; k++)
        s->bent[at + (size_t)k] =
            is_gap(m, s, k)
                ? 0.0
                : (s->changed[k] - s->F[k]) / (s->shifted[i] - z[i]) - J[at + (size_t)k];
    return PERP_OK;
}

/* Whether z is where `bent` does not hold any more. */
static int32_t has_moved(const perp_mechanism *m, const perp__implicit *s, const double *z)
{
    int32_t i;

    for (i = 0; i < m->n; i++)
        if (!(fabs(z[i] - s->bent_at[i]) <= FAR * s->steps[i]))
            return 1;
    for (i = 0; i < m->rows; i++)
        if (!(fabs(s->r[i] - s->bent_r[i]) * sqrt(s->inverse_mass[i]) <= FAR * s->speed))
            return 1;
    return 0;
}

int32_t perp__implicit_jacobian(double *J, const double *z, void *user)
{
    perp_mechanism *m = user;
    perp__implicit *s = m->implicit;
    const size_t size = (size_t)s->size;
    perp_status status = perp__implicit_evaluate(m, s, z);
    size_t k;
    int32_t i;

    memset(J, 0, size * size * sizeof *J);
    if (status == PERP_OK) {
        fill_impulse_columns(m, s, J, z);
        fill_speed_columns(m, s, J);
    }
    if (status == PERP_OK && (!s->is_bent || has_moved(m, s, z))) {
        memcpy(s->bent_at, z, (size_t)m->n * sizeof *z);
        memcpy(s->bent_r, s->r, (size_t)m->rows * sizeof *s->r);
        s->is_at = s->is_bent = 0; /* m->end leaves the point; F stays */
        for (i = 0; i < m->n && status == PERP_OK; i++)
            status = bend(m, s, J, z, i);
        s->is_bent = status == PERP_OK;
    }
    for (k = 0; k < (size_t)m->n * size && status == PERP_OK; k++)
        J[k] += s->bent[k];
    return perp__implicit_reply(m, s, status);
}
