/* F of the implicit scheme and its Jacobian:
 *
 *   M(q+) (v+ - v) - h k(t+h, q+, v+) - J(q+)' r = 0,    q+ = q (+) h N(q) v+,
 *   0 <= r_n perp (gap(q+) - min(gap(q), 0)) / h >= 0,   (c(q+) - c(q)) / h = 0,
 *
 * and friction as implicit.h has it. An overlap or drift that the step starts with throws nothing:
 * it does not grow, and projection removes it.
 *
 * A gap is known up to rounding of q, and gap / h is not more than that. It is therefore written as
 * max(gap(q), 0) / h + u_n + curvature, with what the linearised gap leaves out in `curvature`, and
 * a curvature that is no more than rounding is none. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "mechanism/implicit.h"

#define FORWARD 0x1p-26 /* about sqrt(eps), of a speed: a step of differences */

double perp__implicit_curvature(perp_mechanism *m, perp__implicit *s, int32_t row, double now,
                                double before)
{
    const double curvature = (now - before) / s->h - s->u[row];

    return fabs(curvature) * s->h <= perp__gap_rounding(m, &m->end, row, s->q) ? 0.0 : curvature;
}

static void fill_impulses(perp_mechanism *m, perp__implicit *s, const double *z)
{
    int32_t k, i, j;

    memset(s->r, 0, (size_t)m->rows * sizeof *s->r);
    for (k = 0; k < s->discs_count; k++) {
        const perp__implicit_disc *disc = s->discs + k;
        const double radius = perp__implicit_radius(m, s, disc, z);

        if (disc->normal >= 0)
            s->r[m->starts[disc->contact]] = z[disc->normal];
        for (i = 0; i < disc->tangents && (disc->tangents == 1 || disc->edges == 0); i++)
            s->r[disc->row + i] = radius * z[disc->first + i];
        for (j = 0; j < disc->edges && disc->tangents > 1; j++) {
            double d[2];

            perp__implicit_edge(disc->edges, j, d);
            s->r[disc->row] += d[0] * z[disc->first + j];
            s->r[disc->row + 1] += d[1] * z[disc->first + j];
        }
    }
    for (i = 0; i < m->bilateral; i++)
        s->r[m->contact_rows + i] = z[s->bilateral + i];
}

static void fill_friction(const perp_mechanism *m, const perp__implicit *s,
                          const perp__implicit_disc *disc, double *F, const double *z)
{
    const double *u = s->u + disc->row, *x = z + disc->first;
    double *f = F + disc->first;
    int32_t j;

    if (disc->tangents == 1)
        f[0] = disc->weight * u[0];
    if (disc->tangents < 2)
        return;
    if (disc->edges == 0) {
        f[0] = disc->weight * (u[0] + x[2] * x[0]);
        f[1] = disc->weight * (u[1] + x[2] * x[1]);
        f[2] = 0.5 * disc->weight * (1.0 - x[0] * x[0] - x[1] * x[1]);
        return;
    }
    f[disc->edges] = perp__implicit_radius(m, s, disc, z);
    for (j = 0; j < disc->edges; j++) {
        double d[2];

        perp__implicit_edge(disc->edges, j, d);
        f[j] = d[0] * u[0] + d[1] * u[1] + x[disc->edges];
        f[disc->edges] -= x[j];
    }
}

static void fill(perp_mechanism *m, perp__implicit *s, double *F, const double *z)
{
    const perp__terms *end = &m->end;
    const size_t n = (size_t)m->n;
    int32_t i, k;
    size_t j;

    for (j = 0; j < n; j++) {
        double sum = -s->h * end->k[j];
        size_t l;

        for (l = 0; l < n; l++)
            sum += end->M[j * n + l] * (z[l] - s->v0[l]);
        for (i = 0; i < m->rows; i++)
            sum -= end->J[(size_t)i * n + j] * s->r[i];
        F[j] = sum;
    }
    for (k = 0; k < s->discs_count; k++) {
        const perp__implicit_disc *disc = s->discs + k;
        const int32_t c = disc->contact;

        if (disc->normal >= 0)
            F[disc->normal] =
                fmax(m->begin.gap[c], 0.0) / s->h + s->u[m->starts[c]] +
                perp__implicit_curvature(m, s, m->starts[c], end->gap[c], m->begin.gap[c]);
        fill_friction(m, s, disc, F, z);
    }
    for (i = 0; i < m->bilateral; i++) {
        const int32_t row = m->contact_rows + i;

        F[s->bilateral + i] =
            s->u[row] + perp__implicit_curvature(m, s, row, end->c[i], m->begin.c[i]);
    }
}

/* Into F, s->q, s->u, s->r, m->end and m->friction. */
static perp_status evaluate(perp_mechanism *m, perp__implicit *s, double *F, const double *z)
{
    perp_status status = perp__evaluate_move(m, s->q, s->q0, s->h, z);

    if (status == PERP_OK)
        status = perp__evaluate_all(m, &m->end, s->t + s->h, s->q, z);
    if (status != PERP_OK)
        return status;
    perp__friction_of_speed(m, &m->end, m->friction, m->start_velocity, s->v0);
    perp__row_velocities(m, &m->end, s->u, z);
    fill_impulses(m, s, z);
    fill(m, s, F, z);
    return PERP_OK;
}

perp_status perp__implicit_evaluate(perp_mechanism *m, perp__implicit *s, const double *z)
{
    const size_t bytes = (size_t)s->size * sizeof *z;
    perp_status status;

    if (s->is_at && memcmp(s->at, z, bytes) == 0)
        return PERP_OK;
    s->is_at = 0;
    status = evaluate(m, s, s->F, z);
    if (status == PERP_OK) {
        memcpy(s->at, z, bytes);
        s->is_at = 1;
    }
    return status;
}

/* What a callback of the solver returns: only an abort ends the search. Numbers that are no model's
 * (not finite, M not positive definite, ...) at a point on the way mean that it is outside. */
static int32_t answer(perp_mechanism *m, perp__implicit *s, perp_status status)
{
    if (status == PERP_ERROR_CALLBACK) {
        s->failed = status;
        return -1;
    }
    if (status < 0)
        m->context->message[0] = '\0';
    return status != PERP_OK;
}

int32_t perp__implicit_function(double *F, const double *z, void *user)
{
    perp_mechanism *m = user;
    perp__implicit *s = m->scheme_work;
    const perp_status status = perp__implicit_evaluate(m, s, z);

    if (status == PERP_OK)
        memcpy(F, s->F, (size_t)s->size * sizeof *F);
    return answer(m, s, status);
}

/* ---- the Jacobian, by columns -------------------------------------------------------------- */

/* dF/dr at rows of v: -J'. */
static void add_row(const perp_mechanism *m, double *column, int32_t row, double factor)
{
    int32_t i;

    for (i = 0; i < m->n; i++)
        column[i] -= factor * m->end.J[(size_t)row * (size_t)m->n + (size_t)i];
}

static void fill_disc_columns(perp_mechanism *m, const perp__implicit *s,
                              const perp__implicit_disc *disc, double *J, const double *z)
{
    const size_t size = (size_t)s->size, first = (size_t)disc->first;
    const double radius = perp__implicit_radius(m, s, disc, z), *x = z + first;
    const size_t last = first + 2;
    size_t i;

    for (i = 0; i < (size_t)disc->tangents; i++)
        add_row(m, J + (first + i) * size, disc->row + (int32_t)i, radius);
    if (disc->tangents < 2)
        return;
    for (i = 0; i < 2; i++) {
        J[(first + i) * size + first + i] += disc->weight * x[2];
        J[(first + i) * size + last] = -disc->weight * x[i];
        J[last * size + first + i] = disc->weight * x[i];
    }
}

static void fill_polygon_columns(perp_mechanism *m, const perp__implicit *s,
                                 const perp__implicit_disc *disc, double *J)
{
    const size_t size = (size_t)s->size, first = (size_t)disc->first;
    const size_t last = first + (size_t)disc->edges;
    int32_t j;

    for (j = 0; j < disc->edges; j++) {
        double *column = J + (first + (size_t)j) * size, d[2];

        perp__implicit_edge(disc->edges, j, d);
        add_row(m, column, disc->row, d[0]);
        add_row(m, column, disc->row + 1, d[1]);
        column[last] = -1.0;
        J[last * size + first + (size_t)j] = 1.0;
    }
}

static void fill_impulse_columns(perp_mechanism *m, perp__implicit *s, double *J, const double *z)
{
    const size_t size = (size_t)s->size;
    int32_t k, i;

    for (k = 0; k < s->discs_count; k++) {
        const perp__implicit_disc *disc = s->discs + k;
        const int32_t polygon = disc->tangents > 1 && disc->edges > 0;

        if (disc->normal >= 0) {
            double *column = J + (size_t)disc->normal * size;
            const double mu = m->friction[disc->contact];

            add_row(m, column, disc->row - 1, 1.0);
            for (i = 0; i < disc->tangents && !polygon; i++)
                add_row(m, column, disc->row + i, mu * z[disc->first + i]);
            if (polygon)
                column[disc->first + disc->edges] = mu;
        }
        if (polygon)
            fill_polygon_columns(m, s, disc, J);
        else
            fill_disc_columns(m, s, disc, J, z);
    }
    for (i = 0; i < m->bilateral; i++)
        add_row(m, J + (size_t)(s->bilateral + i) * size, m->contact_rows + i, 1.0);
}

/* Rows of gaps and of c: their gradients are known, and differences of gap / h would be rounding.
 */
static void fill_gap_rows(const perp_mechanism *m, const perp__implicit *s, double *J)
{
    const size_t size = (size_t)s->size, n = (size_t)m->n;
    int32_t k;
    size_t i;

    for (i = 0; i < n; i++) {
        for (k = 0; k < s->discs_count; k++)
            if (s->discs[k].normal >= 0)
                J[i * size + (size_t)s->discs[k].normal] =
                    m->end.J[(size_t)(s->discs[k].row - 1) * n + i];
        for (k = 0; k < m->bilateral; k++)
            J[i * size + (size_t)(s->bilateral + k)] =
                m->end.J[(size_t)(m->contact_rows + k) * n + i];
    }
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

/* Column i of v: by differences, forwards or, at the edge of the domain, backwards. */
static perp_status difference(perp_mechanism *m, perp__implicit *s, double *J, const double *z,
                              int32_t i)
{
    double step = FORWARD * fmax(fabs(z[i]), s->steps[i]);
    perp_status status = PERP__OUTSIDE;
    int32_t side, k;

    memcpy(s->shifted, z, (size_t)s->size * sizeof *z);
    for (side = 0; side < 2 && status != PERP_OK && status != PERP_ERROR_CALLBACK; side++) {
        volatile double there = z[i] + (side == 0 ? step : -step);

        s->shifted[i] = there;
        status = evaluate(m, s, s->changed, s->shifted);
    }
    if (status != PERP_OK)
        return status;
    for (k = 0; k < s->size; k++)
        if (!is_gap(m, s, k))
            J[(size_t)i * (size_t)s->size + (size_t)k] =
                (s->changed[k] - s->F[k]) / (s->shifted[i] - z[i]);
    return PERP_OK;
}

int32_t perp__implicit_jacobian(double *J, const double *z, void *user)
{
    perp_mechanism *m = user;
    perp__implicit *s = m->scheme_work;
    perp_status status = perp__implicit_evaluate(m, s, z);
    int32_t i;

    memset(J, 0, (size_t)s->size * (size_t)s->size * sizeof *J);
    if (status == PERP_OK) {
        fill_impulse_columns(m, s, J, z);
        fill_gap_rows(m, s, J);
        s->is_at = 0; /* m->end leaves the point; F stays */
    }
    for (i = 0; i < m->n && status == PERP_OK; i++)
        status = difference(m, s, J, z, i);
    return answer(m, s, status);
}
