/* d/dt(J) v + d/dt(drift) along q' = N v: by the callback, or by differences of
 * phi(s) = J(t + s, q(s)) v + drift(t + s, q(s)), with q(s) = q + s N(q) v.
 *
 * Central differences (phi(s) - phi(-s)) / 2 s have an error in even powers of s, which Neville's
 * scheme removes (C. J. F. Ridders, Advances in Engineering Software 4 (1982)). Of all entries of
 * the scheme the one that agrees best with its neighbours is taken. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "mechanism/accelerations/accelerations.h"

#define LEVELS 64
#define LEVELS_WITHOUT_GAIN 16
#define COLUMNS 10
#define RATIO 1.4142135623730951
/* The first step moves the coordinates by this, beside the largest of them or 1 (an angle's unit);
 * what is too long is no harm. Not a round number: motion with a period must not look as if it
 * stood still. */
#define FIRST_MOVE 0.3711
#define MOST_RETREATS 60

typedef struct differences {
    double t, *plus, *minus, *previous, *current, *best, *size;
    const double *q, *v;
    double error; /* of the best entry, relative to the largest of the row's terms */
} differences;

/* to := phi(s); size: the largest of its terms so far. */
static perp_status evaluate(perp__acceleration *a, differences *d, double *to, double s)
{
    perp_mechanism *m = a->m;
    perp_status status = perp__evaluate_move(m, m->moved, d->q, s, d->v);
    int32_t i;

    if (status == PERP_OK)
        status = perp__evaluate_rows(m, &m->end, d->t + s, m->moved, d->v);
    if (status != PERP_OK)
        return status;
    perp__row_velocities(m, &m->end, to, d->v);
    for (i = 0; i < m->rows; i++)
        d->size[i] = fmax(d->size[i], perp__row_size(m, &m->end, i, d->v));
    return PERP_OK;
}

/* A time in which the coordinates change by about their size. */
static perp_status first_step(perp__acceleration *a, differences *d, double *step)
{
    perp_mechanism *m = a->m;
    double largest = 0.0, fastest = 0.0;
    perp_status status = perp__evaluate_move(m, m->moved, d->q, 1.0, d->v);
    int32_t i;

    if (status == PERP__OUTSIDE) {
        *step = FIRST_MOVE;
        return PERP_OK;
    }
    for (i = 0; i < m->coordinates && status == PERP_OK; i++) {
        largest = fmax(largest, fabs(d->q[i]));
        fastest = fmax(fastest, fabs(m->moved[i] - d->q[i]));
    }
    *step = FIRST_MOVE * (fastest > 0.0 ? fmax(largest, 1.0) / fastest : 1.0);
    return status;
}

/* The worst relative difference of two candidates. */
static double distance(const perp_mechanism *m, const differences *d, const double *x,
                       const double *y, double s)
{
    double worst = 0.0;
    int32_t i;

    for (i = 0; i < m->rows; i++)
        if (d->size[i] > 0.0)
            worst = fmax(worst, fabs(x[i] - y[i]) * s / d->size[i]);
    return worst;
}

/* Row `level` of the scheme from the one before; keeps what agrees best. s: the first step. */
static void extrapolate(perp_mechanism *m, differences *d, int32_t level, double s)
{
    const size_t rows = (size_t)m->rows;
    double factor = RATIO * RATIO;
    int32_t j;
    size_t i;

    for (j = 1; j < COLUMNS && j <= level; j++, factor *= RATIO * RATIO) {
        const double *coarse = d->previous + (size_t)(j - 1) * rows;
        const double *fine = d->current + (size_t)(j - 1) * rows;
        double *to = d->current + (size_t)j * rows, error;

        for (i = 0; i < rows; i++)
            to[i] = fine[i] + (fine[i] - coarse[i]) / (factor - 1.0);
        error = fmax(distance(m, d, to, fine, s), distance(m, d, to, coarse, s));
        if (error < d->error) {
            d->error = error;
            memcpy(d->best, to, rows * sizeof *d->best);
        }
    }
}

static perp_status difference(perp__acceleration *a, differences *d, double s)
{
    perp_mechanism *m = a->m;
    const size_t rows = (size_t)m->rows;
    const double first = s;
    int32_t level = 0, retreats = 0, gained = 0;
    perp_status status = PERP_OK;
    size_t i;

    while (level < LEVELS && level < gained + LEVELS_WITHOUT_GAIN) {
        const double before = d->error;
        double *swap = d->previous;

        d->previous = d->current;
        d->current = swap;
        status = evaluate(a, d, d->plus, s);
        if (status == PERP_OK)
            status = evaluate(a, d, d->minus, -s);
        if (status == PERP__OUTSIDE && retreats++ < MOST_RETREATS) {
            level = gained = 0;
            s /= RATIO;
            continue;
        }
        if (status != PERP_OK)
            return status;
        for (i = 0; i < rows; i++)
            d->current[i] = (d->plus[i] - d->minus[i]) / (2.0 * s);
        extrapolate(m, d, level, first);
        level++;
        if (d->error < before)
            gained = level;
        s /= RATIO;
    }
    return status;
}

static perp_status call_back(perp__acceleration *a, double t, const double *q, const double *v)
{
    perp_mechanism *m = a->m;
    const int32_t answer = m->model.curvature(a->bias, t, q, v, m->model.user);
    int32_t i;

    if (answer < 0)
        return perp__fail(m->context, PERP_ERROR_CALLBACK, "the curvature callback returned %d",
                          (int)answer);
    for (i = 0; i < m->rows && answer == 0; i++) {
        if (!isfinite(a->bias[i]))
            return perp__fail(m->context, PERP_ERROR_NOT_FINITE, "bias[%d] of its callback is %g",
                              (int)i, a->bias[i]);
        a->size[i] = fabs(a->bias[i]);
    }
    return answer > 0 ? PERP__OUTSIDE : PERP_OK;
}

perp_status perp__acceleration_bias(perp__acceleration *a, double t, const double *q,
                                    const double *v)
{
    perp_mechanism *m = a->m;
    const size_t rows = (size_t)m->rows;
    differences d = {0};
    perp_status status;
    double s = 1.0;
    size_t i;

    memset(a->bias, 0, rows * sizeof *a->bias);
    memset(a->size, 0, rows * sizeof *a->size);
    if (rows == 0)
        return PERP_OK;
    if (m->model.curvature)
        return call_back(a, t, q, v);
    d.t = t;
    d.q = q;
    d.v = v;
    d.plus = a->row_work;
    d.minus = d.plus + rows;
    d.previous = d.minus + rows;
    d.current = d.previous + (size_t)COLUMNS * rows;
    d.size = d.current + (size_t)COLUMNS * rows;
    d.best = a->bias;
    d.error = INFINITY;
    memset(d.size, 0, rows * sizeof *d.size);
    status = first_step(a, &d, &s);
    if (status == PERP_OK)
        status = difference(a, &d, s);
    for (i = 0; i < rows; i++) /* so that a tolerance of it covers the error, too */
        a->size[i] = fabs(a->bias[i]) + d.error * d.size[i] / (s * PERP__ACCELERATION_TOLERANCE);
    return status;
}
