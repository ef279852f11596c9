/* F of the implicit scheme, and its Jacobian:
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

#include "mechanism/schemes/implicit.h"

#define FORWARD 0x1p-26 /* about sqrt(eps), of a speed: a step of differences */
#define FAR 0.03        /* of the step's speed (or impulse): `bent` is out of date */

double perp__implicit_curvature(perp_mechanism *m, perp__implicit *s, int32_t row, double now,
                                double before)
{
    const double curvature = (now - before) / s->from.h - s->u[row];

    return fabs(curvature) * s->from.h <= perp__gap_rounding(m, &m->end, row, s->q) ? 0.0
                                                                                    : curvature;
}

/* (c(q+) - c(q)) / h. */
static double speed_of(perp_mechanism *m, perp__implicit *s, int32_t constraint)
{
    const int32_t row = m->constraint_row[constraint];

    return s->u[row] +
           perp__implicit_curvature(m, s, row, m->end.c[constraint], m->begin.c[constraint]);
}

static void fill(perp_mechanism *m, perp__implicit *s, double *F, const double *z)
{
    const perp__terms *end = &m->end;
    const size_t n = (size_t)m->n;
    int32_t held = m->bilateral; /* of the constraints: the contacts' own come behind these */

    for (size_t j = 0; j < n; j++) {
        F[j] = -s->from.h * end->k[j];
        for (size_t l = 0; l < n; l++)
            F[j] += end->M[j * n + l] * (z[l] - s->from.v[l]);
    }
    for (int32_t i = 0; i < m->rows; i++)
        perp__add_row(m, end, i, -s->r[i], F);
    for (int32_t i = 0; i < m->bilateral; i++)
        F[s->bilateral + i] = speed_of(m, s, i);
    for (int32_t k = 0; k < s->discs_count; k++) {
        const perp__implicit_disc *disc = s->discs + k;
        const int32_t c = disc->contact;
        const double *u, *x;
        double *f;

        if (disc->normal >= 0 && m->two_sided[c] == 0)
            F[disc->normal] =
                fmax(m->begin.gap[c], 0.0) / s->from.h + s->u[m->starts[c]] +
                perp__implicit_curvature(m, s, m->starts[c], end->gap[c], m->begin.gap[c]);
        else
            for (int32_t i = 0; i < disc->normals; i++)
                F[disc->normal + i] = speed_of(m, s, held++);
        u = s->u + disc->row;
        x = z + disc->first;
        f = F + disc->first;
        if (disc->tangents == 1) {
            f[0] = disc->weight * u[0];
        } else if (disc->tangents == 2 && disc->edges == 0) {
            f[0] = disc->weight * (u[0] + x[2] * x[0]);
            f[1] = disc->weight * (u[1] + x[2] * x[1]);
            f[2] = 0.5 * disc->weight * (1.0 - x[0] * x[0] - x[1] * x[1]);
        } else if (disc->tangents == 2) {
            f[disc->edges] = perp__implicit_radius(m, s, disc, z);
            for (int32_t j = 0; j < disc->edges; j++) {
                double d[2];

                perp__implicit_direction(disc, j, d);
                f[j] = d[0] * u[0] + d[1] * u[1] + x[disc->edges];
                f[disc->edges] -= x[j];
            }
        }
    }
}

/* Into F, s->q, s->u, s->r, m->end and m->friction. */
static perp_status evaluate_at(perp_mechanism *m, perp__implicit *s, double *F, const double *z)
{
    perp_status status = perp__evaluate_move(m, s->q, s->from.q, s->from.h, z);

    PERP__THEN(status, perp__evaluate_all(m, &m->end, s->from.t + s->from.h, s->q, z));
    if (status != PERP_OK)
        return status;
    perp__friction_of_speed(m, &m->end, m->friction, m->start_velocity, s->from.v);
    perp__row_velocities(m, &m->end, s->u, z);
    memset(s->r, 0, (size_t)m->rows * sizeof *s->r);
    for (int32_t k = 0; k < s->discs_count; k++) {
        const perp__implicit_disc *disc = s->discs + k;
        const double unit = disc->edges > 0 ? 1.0 : perp__implicit_radius(m, s, disc, z);

        for (int32_t i = 0; i < disc->normals; i++)
            s->r[m->starts[disc->contact] + i] = z[disc->normal + i];
        for (int32_t i = 0; i < disc->forces; i++) {
            double d[2];

            perp__implicit_direction(disc, i, d);
            for (int32_t l = 0; l < disc->tangents; l++)
                s->r[disc->row + l] += unit * d[l] * z[disc->first + i];
        }
    }
    for (int32_t i = 0; i < m->bilateral; i++)
        s->r[m->contact_rows + i] = z[s->bilateral + i];
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
    status = evaluate_at(m, s, s->F, z);
    if (status == PERP_OK) {
        memcpy(s->at, z, bytes);
        s->is_at = 1;
    }
    return status;
}

/* What a callback of the solver returns: only an abort ends the search. Numbers that are no model's
 * (not finite, M not positive definite, ...) at a point on the way mean that it is outside. */
static int32_t reply(perp_mechanism *m, perp__implicit *s, perp_status status)
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
    return reply(m, s, status);
}

/* ---- the Jacobian ---------------------------------------------------------------------------
 *
 * By impulses, and what J(q+) and M(q+) stand for by
 * velocities, it is known. What is left of its columns of v, `bent`, are the derivatives of M, k, J
 * and the coefficients by q+, times h, and those of k and bounds by v: by differences, n calls of
 * every callback. They are small beside the rest, of the order of h, and serve until z has moved
 * so far that they do not. */

static void fill_impulse_columns(perp_mechanism *m, perp__implicit *s, double *J, const double *z)
{
    const size_t size = (size_t)s->size;

    for (int32_t k = 0; k < s->discs_count; k++) {
        const perp__implicit_disc *disc = s->discs + k;
        const size_t first = (size_t)disc->first, last = first + (size_t)disc->forces;
        const double unit = disc->edges > 0 ? 1.0 : perp__implicit_radius(m, s, disc, z);
        const double *x = z + first, *N = disc->normals > 0 ? z + disc->normal : z;
        const double load = perp__length(N, disc->normals);

        for (int32_t l = 0; l < disc->normals; l++) { /* mu: what friction grows by with it */
            double *column = J + (size_t)(disc->normal + l) * size;
            const double share = m->two_sided[disc->contact] == 0 ? 1.0
                                 : load > 0.0                     ? N[l] / load
                                                                  : 0.0;
            const double mu = m->friction[disc->contact] * share;

            perp__add_row(m, &m->end, m->starts[disc->contact] + l, -1.0, column);
            for (int32_t i = 0; i < disc->tangents && disc->edges == 0; i++)
                perp__add_row(m, &m->end, disc->row + i, -mu * x[i], column);
            if (disc->edges > 0)
                column[disc->first + disc->edges] = mu;
        }
        for (size_t i = 0; i < (size_t)disc->forces; i++) { /* last: lambda */
            double *column = J + (first + i) * size, d[2];

            perp__implicit_direction(disc, (int32_t)i, d);
            for (int32_t l = 0; l < disc->tangents; l++)
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
    for (int32_t i = 0; i < m->bilateral; i++)
        perp__add_row(m, &m->end, m->contact_rows + i, -1.0, J + (size_t)(s->bilateral + i) * size);
}

/* column += factor J of the row, at row `to` of all columns of v. */
static void add_speed(const perp_mechanism *m, const perp__implicit *s, double *J, int32_t to,
                      int32_t row, double factor)
{
    const size_t n = (size_t)m->n, size = (size_t)s->size;

    for (size_t i = 0; i < n && factor != 0.0; i++)
        J[i * size + (size_t)to] += factor * m->end.J[(size_t)row * n + i];
}

/* Columns of v with the rows and M as they are. Gradients of gaps and of c are exact so; by
 * differences gap / h would be rounding. */
static void fill_speed_columns(const perp_mechanism *m, const perp__implicit *s, double *J)
{
    const size_t n = (size_t)m->n, size = (size_t)s->size;

    for (size_t j = 0; j < n; j++)
        for (size_t l = 0; l < n; l++)
            J[j * size + l] = m->end.M[l * n + j];
    for (int32_t k = 0; k < s->discs_count; k++) {
        const perp__implicit_disc *disc = s->discs + k;
        const double weight = disc->edges > 0 ? 1.0 : disc->weight;

        for (int32_t i = 0; i < disc->normals; i++)
            add_speed(m, s, J, disc->normal + i, m->starts[disc->contact] + i, 1.0);
        for (int32_t i = 0; i < disc->forces; i++) {
            double d[2];

            perp__implicit_direction(disc, i, d);
            for (int32_t t = 0; t < disc->tangents; t++)
                add_speed(m, s, J, disc->first + i, disc->row + t, weight * d[t]);
        }
    }
    for (int32_t i = 0; i < m->bilateral; i++)
        add_speed(m, s, J, s->bilateral + i, m->contact_rows + i, 1.0);
}

int32_t perp__implicit_jacobian(double *J, const double *z, void *user)
{
    perp_mechanism *m = user;
    perp__implicit *s = m->implicit;
    const size_t size = (size_t)s->size;
    perp_status status = perp__implicit_evaluate(m, s, z);
    int32_t moved;

    memset(J, 0, size * size * sizeof *J);
    if (status == PERP_OK) {
        fill_impulse_columns(m, s, J, z);
        fill_speed_columns(m, s, J);
    }
    /* `bent`, where there is none or z is where it does not hold any more */
    moved = !s->is_bent;
    for (int32_t i = 0; i < m->n && !moved; i++)
        moved = !(fabs(z[i] - s->bent_at[i]) <= FAR * s->steps[i]);
    for (int32_t i = 0; i < m->rows && !moved; i++)
        moved = !(fabs(s->r[i] - s->bent_r[i]) * sqrt(s->inverse_mass[i]) <= FAR * s->speed);
    if (status == PERP_OK && moved) {
        memcpy(s->bent_at, z, (size_t)m->n * sizeof *z);
        memcpy(s->bent_r, s->r, (size_t)m->rows * sizeof *s->r);
        s->is_at = s->is_bent = 0; /* m->end leaves the point; F stays */
        for (size_t i = 0; i < (size_t)m->n && status == PERP_OK; i++) {
            const double step = FORWARD * fmax(fabs(z[i]), s->steps[i]);
            double *column = s->bent + i * size;

            memcpy(s->shifted, z, size * sizeof *z);
            status = PERP__OUTSIDE; /* forwards or, at the edge of the domain, backwards */
            for (int32_t side = 0; side < 2 && status != PERP_OK && status != PERP_ERROR_CALLBACK;
                 side++) {
                volatile double there = z[i] + (side == 0 ? step : -step);

                s->shifted[i] = there;
                status = evaluate_at(m, s, s->changed, s->shifted);
            }
            for (size_t k = 0; k < size && status == PERP_OK; k++)
                column[k] = (s->changed[k] - s->F[k]) / (s->shifted[i] - z[i]) - J[i * size + k];
            memset(column + s->bilateral, 0, (size_t)m->bilateral * sizeof *column); /* c, gaps */
            for (int32_t k = 0; k < s->discs_count; k++)
                memset(column + s->discs[k].first - s->discs[k].normals, 0,
                       (size_t)s->discs[k].normals * sizeof *column);
        }
        s->is_bent = status == PERP_OK;
    }
    for (size_t k = 0; k < (size_t)m->n * size && status == PERP_OK; k++)
        J[k] += s->bent[k];
    return reply(m, s, status);
}
