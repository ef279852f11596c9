/* The callbacks, called and checked. */
#include "mechanism/mechanism.h"

#include <math.h>
#include <string.h>

#include "base/context.h"
#include "mechanism/copy.h"

/* What a callback returned. */
static perp_status check_answer(perp_mechanism *m, const char *name, int32_t answer)
{
    if (answer < 0)
        return perp__fail(m->context, PERP_ERROR_CALLBACK, "the %s callback returned %d", name,
                          (int)answer);
    return answer > 0 ? PERP__OUTSIDE : PERP_OK;
}

/* What a callback filled. */
typedef struct filled {
    const char *name;
    const double *x;
    size_t count;
    int32_t is_size; /* none may be negative */
} filled;

static perp_status check(perp_mechanism *m, perp_status status, const filled *list, int32_t count)
{
    for (int32_t k = 0; k < count && status == PERP_OK; k++) {
        for (size_t i = 0; i < list[k].count && status == PERP_OK; i++)
            if (!isfinite(list[k].x[i]))
                status = perp__fail(m->context, PERP_ERROR_NOT_FINITE,
                                    "%s[%zu] of its callback is %g", list[k].name, i, list[k].x[i]);
        for (size_t i = 0; i < list[k].count && list[k].is_size && status == PERP_OK; i++)
            if (list[k].x[i] < 0.0)
                status = perp__refuse(m->context, "%s[%zu] of its callback is %g, negative",
                                      list[k].name, i, list[k].x[i]);
    }
    return status;
}

perp_status perp__evaluate_mass(perp_mechanism *m, perp__terms *terms, const double *q)
{
    const size_t n = (size_t)m->n;
    perp_status status = PERP_OK;

    memset(terms->M, 0, n * n * sizeof *terms->M);
    if (m->model.mass)
        status = check_answer(m, "mass", m->model.mass(terms->M, q, m->model.user));
    else
        for (size_t i = 0; i < n; i++)
            terms->M[i * (n + 1)] = 1.0;
    status = check(m, status, &(filled){"M", terms->M, n * n, 0}, 1);
    PERP__THEN(status, perp__check_inertia(m->context, "M", m->n, terms->M, terms->factor));
    return status;
}

perp_status perp__evaluate_force(perp_mechanism *m, double *k, double t, const double *q,
                                 const double *v)
{
    perp_status status;

    memset(k, 0, (size_t)m->n * sizeof *k);
    if (!m->model.force)
        return PERP_OK;
    if (m->contacts == 0)
        m->evaluations++;
    status = check_answer(m, "force", m->model.force(k, t, q, v, m->model.user));
    return check(m, status, &(filled){"k", k, (size_t)m->n, 0}, 1);
}

void perp__keep_rows(perp_mechanism *m, double t, const double *q, const double *v)
{
    memcpy(m->kept_q, q, (size_t)m->coordinates * sizeof *q);
    memcpy(m->kept_v, v, (size_t)m->n * sizeof *v);
    m->kept_t = t;
    m->keeps = 1;
}

/* The normals must not be zero. gap has a number for each of them; those that hold both ways are
 * constraints. */
static perp_status evaluate_contacts(perp_mechanism *m, perp__terms *terms, double t,
                                     const double *q)
{
    const size_t rows = (size_t)m->contact_rows, n = (size_t)m->n, contacts = (size_t)m->contacts;
    const size_t gaps = contacts + (size_t)(m->constraints - m->bilateral); /* at the most */
    const filled list[] = {{"gap", terms->gap, gaps, 0},
                           {"H", terms->J, rows * n, 0},
                           {"drift (contacts)", terms->drift, rows, 0},
                           {"mu", terms->mu, contacts, 1}};
    int32_t from = 0, c = m->bilateral;
    perp_status status;

    memset(terms->gap, 0, gaps * sizeof *terms->gap);
    memcpy(terms->mu, m->mu, contacts * sizeof *terms->mu);
    m->evaluations++;
    status = check_answer(
        m, "contact_rows",
        m->model.contact_rows(terms->gap, terms->J, terms->drift, terms->mu, t, q, m->model.user));
    status = check(m, status, list, 4);
    for (int32_t j = 0; j < m->contacts && status == PERP_OK; j++)
        for (int32_t row = m->starts[j]; row < m->tangent[j]; row++)
            if (perp__largest(terms->J + (size_t)row * n, m->n) == 0.0)
                status = perp__refuse(
                    m->context, "H of its callback: the normal of contact %d is zero", (int)j);
    for (int32_t j = 0; j < m->contacts && m->constraints > m->bilateral; j++) {
        if (m->two_sided[j] == 0)
            terms->gap[j] = terms->gap[from++];
        for (int32_t i = 0; i < m->two_sided[j]; i++)
            terms->c[c++] = terms->gap[from++];
        if (m->two_sided[j] > 0)
            terms->gap[j] = 0.0;
    }
    return status;
}

perp_status perp__evaluate_rows(perp_mechanism *m, perp__terms *terms, double t, const double *q,
                                const double *v)
{
    const size_t n = (size_t)m->n, rows = (size_t)m->rows, dry = (size_t)m->dry;
    const size_t g = (size_t)m->contact_rows, b = g + (size_t)m->bilateral; /* first rows */
    perp_status status = PERP_OK;

    /* 1. those of the end are kept for the next step of a run */
    if (terms != &m->end && m->keeps && t == m->kept_t &&
        memcmp(q, m->kept_q, (size_t)m->coordinates * sizeof *q) == 0 &&
        (dry == 0 || memcmp(v, m->kept_v, n * sizeof *v) == 0)) {
        memcpy(terms->J, m->end.J, rows * n * sizeof *terms->J);
        memcpy(terms->drift, m->end.drift, rows * sizeof *terms->drift);
        memcpy(terms->gap, m->end.gap, (size_t)m->contacts * sizeof *terms->gap);
        memcpy(terms->mu, m->end.mu, (size_t)m->contacts * sizeof *terms->mu);
        memcpy(terms->c, m->end.c, (size_t)m->constraints * sizeof *terms->c);
        memcpy(terms->bound, m->end.bound, dry * sizeof *terms->bound);
        return PERP_OK;
    }
    /* 2. contacts, bilateral rows, dry friction */
    m->keeps = 0;
    memset(terms->J, 0, rows * n * sizeof *terms->J);
    memset(terms->drift, 0, rows * sizeof *terms->drift);
    if (m->contacts > 0)
        status = evaluate_contacts(m, terms, t, q);
    if (status == PERP_OK && m->bilateral > 0) {
        double *G = terms->J + g * n, *drift = terms->drift + g;
        const filled list[] = {{"c", terms->c, b - g, 0},
                               {"G", G, (b - g) * n, 0},
                               {"drift (bilateral)", drift, b - g, 0}};

        memset(terms->c, 0, (b - g) * sizeof *terms->c);
        status = check_answer(m, "bilateral_rows",
                              m->model.bilateral_rows(terms->c, G, drift, t, q, m->model.user));
        status = check(m, status, list, 3);
    }
    if (status == PERP_OK && dry > 0) {
        double *B = terms->J + b * n, *drift = terms->drift + b;
        const filled list[] = {{"bound", terms->bound, dry, 1},
                               {"B", B, (rows - b) * n, 0},
                               {"drift (dry)", drift, rows - b, 0}};

        memset(terms->bound, 0, dry * sizeof *terms->bound);
        status = check_answer(m, "dry_rows",
                              m->model.dry_rows(terms->bound, B, drift, t, q, v, m->model.user));
        status = check(m, status, list, 3);
    }
    return status;
}

perp_status perp__evaluate_all(perp_mechanism *m, perp__terms *terms, double t, const double *q,
                               const double *v)
{
    perp_status status = perp__evaluate_mass(m, terms, q);

    PERP__THEN(status, perp__evaluate_force(m, terms->k, t, q, v));
    PERP__THEN(status, perp__evaluate_rows(m, terms, t, q, v));
    return status;
}

perp_status perp__evaluate_rate(perp_mechanism *m, double *rate, const double *q, const double *v)
{
    perp_status status;

    if (!m->model.kinematics) {
        memcpy(rate, v, (size_t)m->n * sizeof *rate);
        return PERP_OK;
    }
    memset(rate, 0, (size_t)m->coordinates * sizeof *rate);
    status = check_answer(m, "kinematics", m->model.kinematics(rate, q, v, m->model.user));
    return check(m, status, &(filled){"rate", rate, (size_t)m->coordinates, 0}, 1);
}

/* ---- the bias -------------------------------------------------------------------------------
 *
 * The derivative of phi(s) = J(t + s, q(s)) v + drift(t + s, q(s)), q(s) = q + s N(q) v. Central
 * differences (phi(s) - phi(-s)) / 2 s have an error in even powers of s, which Neville's scheme
 * removes (C. J. F. Ridders, Advances in Engineering Software 4 (1982)). Of all entries of the
 * scheme the one that agrees best with its neighbours is taken. */

#define RATIO sqrt(2.0) /* of a span and the next one: their squares are halved */

perp_status perp__evaluate_bias(perp_mechanism *m, double *bias, double *error, double t,
                                const double *q, const double *v, double first, int32_t levels)
{
    const size_t rows = (size_t)m->rows;
    double *const side[2] = {m->differences, m->differences + rows};
    double *terms = side[1] + rows, *now = terms + rows, *last = now + PERP__BIAS_COLUMNS * rows;
    double s = first, wrong = m->model.curvature || rows == 0 ? 0.0 : INFINITY;
    int32_t level = 0, gained = 0, retreats = 0;
    perp_status status = PERP_OK;

    memset(bias, 0, rows * sizeof *bias);
    memset(terms, 0, rows * sizeof *terms); /* the largest so far */
    if (m->model.curvature && rows > 0) {
        status = check_answer(m, "curvature", m->model.curvature(bias, t, q, v, m->model.user));
        status = check(m, status, &(filled){"bias", bias, rows, 0}, 1);
    }
    while (wrong > 0.0 && level < levels && level < gained + PERP__BIAS_COLUMNS) {
        double *const swap = last;
        const double before = wrong;
        double power = 1.0;

        /* 1. the central difference, with a shorter span where its ends are outside */
        last = now;
        now = swap;
        for (int32_t k = 0; k < 2 && status == PERP_OK; k++) {
            const double at = k == 0 ? s : -s;

            status = perp__evaluate_move(m, m->moved, q, q, at, v);
            PERP__THEN(status, perp__evaluate_rows(m, &m->end, t + at, m->moved, v));
            for (int32_t i = 0; i < m->rows && status == PERP_OK; i++) {
                side[k][i] = perp__row_times(m, &m->end, i, m->end.drift[i], v);
                terms[i] = fmax(terms[i], perp__row_size(m, &m->end, i, v));
            }
        }
        if (status == PERP__OUTSIDE && retreats++ < PERP__MOST_HALVES) {
            status = PERP_OK;
            level = gained = 0;
            s /= RATIO;
            continue;
        }
        if (status != PERP_OK)
            return status;
        for (size_t i = 0; i < rows; i++)
            now[i] = (side[0][i] - side[1][i]) / (2.0 * s);
        /* 2. the row of the scheme from the one before; what agrees best is kept */
        for (int32_t j = 1; j < PERP__BIAS_COLUMNS && j <= level; j++) {
            const double *coarse = last + (size_t)(j - 1) * rows;
            double *fine = now + (size_t)(j - 1) * rows, *to = fine + rows, apart = 0.0;

            power *= RATIO * RATIO;
            for (size_t i = 0; i < rows; i++) {
                to[i] = fine[i] + (fine[i] - coarse[i]) / (power - 1.0);
                if (terms[i] > 0.0)
                    apart = fmax(apart, fmax(fabs(to[i] - fine[i]), fabs(to[i] - coarse[i])) *
                                            first / terms[i]);
            }
            if (apart < wrong) {
                wrong = apart;
                memcpy(bias, to, rows * sizeof *bias);
            }
        }
        level++;
        gained = wrong < before ? level : gained;
        s /= RATIO;
    }
    for (size_t i = 0; i < rows && error; i++)
        error[i] = wrong * terms[i] / first;
    return status;
}

perp_status perp__evaluate_move(perp_mechanism *m, double *q1, const double *q0, const double *at,
                                double h, const double *v)
{
    perp_status status = perp__evaluate_rate(m, q1, at, v);

    if (status != PERP_OK)
        return status;
    for (int32_t i = 0; i < m->coordinates; i++)
        q1[i] = q0[i] + h * q1[i];
    status = perp__check_finite(m->context, "(q + h N(q) v)", q1, (size_t)m->coordinates);
    if (status == PERP_OK && m->model.normalise) {
        status = check_answer(m, "normalise", m->model.normalise(q1, m->model.user));
        status = check(m, status, &(filled){"q", q1, (size_t)m->coordinates, 0}, 1);
    }
    return status;
}
