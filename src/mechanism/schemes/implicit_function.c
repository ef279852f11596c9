/* F of the implicit scheme:
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
#include "mechanism/schemes/implicit.h"

double perp__implicit_curvature(perp_mechanism *m, perp__implicit *s, int32_t row, double now,
                                double before)
{
    const double curvature = (now - before) / s->h - s->u[row];

    return fabs(curvature) * s->h <= perp__gap_rounding(m, &m->end, row, s->q) ? 0.0 : curvature;
}

static void fill_impulses(perp_mechanism *m, perp__implicit *s, const double *z)
{
    int32_t k, i, l;

    memset(s->r, 0, (size_t)m->rows * sizeof *s->r);
    for (k = 0; k < s->discs_count; k++) {
        const perp__implicit_disc *disc = s->discs + k;
        const double unit = disc->edges > 0 ? 1.0 : perp__implicit_radius(m, s, disc, z);

        if (disc->normal >= 0)
            s->r[m->starts[disc->contact]] = z[disc->normal];
        for (i = 0; i < disc->forces; i++) {
            double d[2];

            perp__implicit_direction(disc, i, d);
            for (l = 0; l < disc->tangents; l++)
                s->r[disc->row + l] += unit * d[l] * z[disc->first + i];
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

        perp__implicit_direction(disc, j, d);
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
        size_t l;

        F[j] = -s->h * end->k[j];
        for (l = 0; l < n; l++)
            F[j] += end->M[j * n + l] * (z[l] - s->v0[l]);
    }
    for (i = 0; i < m->rows; i++)
        perp__add_row(m, end, i, -s->r[i], F);
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
perp_status perp__implicit_evaluate_at(perp_mechanism *m, perp__implicit *s, double *F,
                                       const double *z)
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
    status = perp__implicit_evaluate_at(m, s, s->F, z);
    if (status == PERP_OK) {
        memcpy(s->at, z, bytes);
        s->is_at = 1;
    }
    return status;
}

/* What a callback of the solver returns: only an abort ends the search. Numbers that are no model's
 * (not finite, M not positive definite, ...) at a point on the way mean that it is outside. */
int32_t perp__implicit_reply(perp_mechanism *m, perp__implicit *s, perp_status status)
{
    if (status == PERP_ERROR_CALLBACK) {
        s->failed = status;
        memcpy(s->message, m->context->message, sizeof s->message);
        return -1;
    }
    if (status < 0)
        m->context->message[0] = '\0';
    return status != PERP_OK;
}

int32_t perp__implicit_function(double *F, const double *z, void *user)
{
    perp_mechanism *m = user;
    perp__implicit *s = m->implicit;
    const perp_status status = perp__implicit_evaluate(m, s, z);

    if (status == PERP_OK)
        memcpy(F, s->F, (size_t)s->size * sizeof *F);
    return perp__implicit_reply(m, s, status);
}
