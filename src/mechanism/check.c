/* A model's rows against differences of its gaps and constraints. The differences tell their own
 * error, by Richardson's extrapolation from steps s and s/2 and, at kinks, by their two sides. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "mechanism/mechanism.h"

/* Steps, beside the largest coordinate or 1. The first is near eps^(1/5), for an error of the
 * fourth order; the others are for what is small or turns fast. */
static const double steps[] = {0x1p-11, 0x1p-17, 0x1p-24};

#define RELATIVE 1e-5 /* of the row's largest entry */

typedef struct look {
    PERP__WORK;
    perp_mechanism_check_result result;
    double t;
    const double *q, *v;
    double *here, *at[4]; /* rows: gap or c; 0 of others; there, and at the points of a step */
    double *difference, *uncertainty; /* rows by n + 1: by each velocity, then by t */
    double *rate, *unit;              /* coordinates; n */
} look;

static void layout(perp__arena *arena, void *object)
{
    look *a = object;
    const size_t rows = (size_t)a->m->rows, n = (size_t)a->m->n;

    PERP__DOUBLES(arena, rows, &a->here, &a->at[0], &a->at[1], &a->at[2], &a->at[3]);
    PERP__DOUBLES(arena, rows * (n + 1), &a->difference, &a->uncertainty);
    PERP__DOUBLES(arena, (size_t)a->m->coordinates, &a->rate);
    PERP__DOUBLES(arena, n, &a->unit);
}

/* values := what the rows should be the gradients of. */
static void collect(const perp_mechanism *m, const perp__terms *terms, double *values)
{
    memset(values, 0, (size_t)m->rows * sizeof *values);
    for (int32_t j = 0; j < m->contacts; j++)
        values[m->starts[j]] = terms->gap[j];
    for (int32_t j = 0; j < m->constraints; j++)
        values[m->constraint_row[j]] = terms->c[j];
}

static double largest_entry(const perp_mechanism *m, int32_t row)
{
    return perp__largest(m->begin.J + (size_t)row * (size_t)m->n, m->n);
}

/* Samples at the four points of a step, by time or along the rate, and the derivatives of all rows
 * from them, where they are the most certain so far; whether each is known as well as it is going
 * to be compared. What is refused there is no fault of the model's here. */
static perp_status sample(look *a, int32_t column, double step, int32_t *suffices)
{
    const double at[] = {step, 0.5 * step, -step, -0.5 * step};
    perp_mechanism *m = a->m;
    perp_status status = PERP_OK;

    for (int32_t k = 0; k < 4 && status == PERP_OK; k++) {
        const double dt = column == m->n ? at[k] : 0.0, s = column == m->n ? 0.0 : at[k];

        for (int32_t i = 0; i < m->coordinates; i++)
            m->moved[i] = a->q[i] + s * a->rate[i];
        status = perp__evaluate_rows(m, &m->end, a->t + dt, m->moved, a->v);
        if (status == PERP_OK)
            collect(m, &m->end, a->at[k]);
    }
    *suffices = status == PERP_OK;
    for (int32_t row = 0; row < m->rows && status == PERP_OK; row++) {
        const size_t entry = (size_t)row * ((size_t)m->n + 1) + (size_t)column;
        const double wide = (a->at[0][row] - a->at[2][row]) / (2.0 * step);
        const double narrow = (a->at[1][row] - a->at[3][row]) / step;
        const double best = narrow + (narrow - wide) / 3.0;
        /* the jump of the derivative at a kink; of a smooth function this is of order step^3 */
        const double far = (a->at[0][row] - a->here[row]) + (a->at[2][row] - a->here[row]);
        const double near = (a->at[1][row] - a->here[row]) + (a->at[3][row] - a->here[row]);
        const double size =
            fabs(a->here[row]) + fabs(a->at[0][row]) + perp__gap_size(m, &m->begin, row, a->q);
        const double uncertainty = fabs(best - narrow) + fabs(4.0 * near - far) / step +
                                   PERP__ROUNDING_LIMIT * size / step;

        if (!(uncertainty >= a->uncertainty[entry])) {
            a->uncertainty[entry] = uncertainty;
            a->difference[entry] = best;
        }
        if (PERP__CERTAIN * a->uncertainty[entry] > 0.1 * RELATIVE * largest_entry(m, row))
            *suffices = 0;
    }
    return status == PERP_ERROR_NOT_FINITE || status == PERP_ERROR_ARGUMENT ? PERP__OUTSIDE
                                                                            : status;
}

/* Differences by velocity `column`, or by t. */
static perp_status differ(look *a, int32_t column)
{
    perp_mechanism *m = a->m;
    const int32_t by_time = column == m->n;
    double size = by_time ? fabs(a->t) : 0.0, speed = by_time, unit;
    perp_status status = PERP_OK;
    int32_t defined = 0, suffices = 0;

    memset(a->unit, 0, (size_t)m->n * sizeof *a->unit);
    memset(a->rate, 0, (size_t)m->coordinates * sizeof *a->rate);
    if (!by_time) {
        a->unit[column] = 1.0;
        status = perp__evaluate_rate(m, a->rate, a->q, a->unit);
    }
    if (status != PERP_OK)
        return status;
    for (int32_t i = 0; i < m->coordinates && !by_time; i++) {
        size = fmax(size, fabs(a->q[i]));
        speed = fmax(speed, fabs(a->rate[i]));
    }
    unit = ldexp(1.0, ilogb(fmax(size, 1.0) / (speed > 0.0 ? speed : 1.0)));
    for (size_t k = 0; k < sizeof steps / sizeof *steps && status >= 0 && !suffices; k++) {
        status = sample(a, column, steps[k] * unit, &suffices);
        defined |= status == PERP_OK;
    }
    a->result.unchecked += !defined;
    return status < 0 ? status : PERP_OK;
}

/* ---- the verdict --------------------------------------------------------------------------- */

/* Whether it is the worst so far. */
static bool blame(look *a, double ratio, double *worst, int32_t part, int32_t index, int32_t row)
{
    a->result.wrong++;
    if (!(ratio > *worst))
        return 0;
    *worst = ratio;
    a->result.part = part;
    a->result.index = index;
    a->result.row = row;
    a->result.column = -1;
    a->result.given = a->result.difference = (double)NAN;
    a->result.uncertainty = 0.0;
    return 1;
}

/* Row `row` of contact `j` or, behind these, of G. */
static void compare(look *a, int32_t j, int32_t row, double *worst)
{
    const perp_mechanism *m = a->m;
    const size_t first = (size_t)row * ((size_t)m->n + 1);
    const double *J = m->begin.J + (size_t)row * (size_t)m->n, largest = largest_entry(m, row);
    const bool bilateral = j >= m->contacts;
    int32_t changes = 0, column;

    for (column = 0; column <= m->n; column++)
        changes |=
            fmax(fabs(a->difference[first + (size_t)column]),
                 PERP__CERTAIN * a->uncertainty[first + (size_t)column]) > RELATIVE * largest;
    a->result.constant += !changes && largest > 0.0;
    for (column = 0; column <= m->n && changes; column++) {
        const double found = a->difference[first + (size_t)column];
        const double uncertainty = a->uncertainty[first + (size_t)column];
        const double given = column < m->n ? J[column] : m->begin.drift[row];
        const double size = column < m->n ? largest : fmax(fabs(given), fabs(found));
        const double allowed = fmax(PERP__CERTAIN * uncertainty, RELATIVE * size);
        const int32_t part = column == m->n ? PERP_MECHANISM_DRIFT
                             : bilateral    ? PERP_MECHANISM_GRADIENT
                                            : PERP_MECHANISM_NORMAL;

        if (fabs(given - found) > allowed && blame(a, fabs(given - found) / allowed, worst, part,
                                                   bilateral ? j - m->contacts : j, row)) {
            a->result.column = column < m->n ? column : -1;
            a->result.given = given;
            a->result.difference = found;
            a->result.uncertainty = uncertainty;
        }
    }
}

/* Whether both rows move several velocities in the same way, or are the same row twice. Rows with
 * one velocity may otherwise be multiples: a slider comes to the ground at an angle. */
static bool are_parallel(const perp_mechanism *m, int32_t normal, int32_t tangent)
{
    const double *x = m->begin.J + (size_t)normal * (size_t)m->n;
    const double *y = m->begin.J + (size_t)tangent * (size_t)m->n;
    const double allowed = PERP__NOTHING * largest_entry(m, normal) * largest_entry(m, tangent);
    int32_t of_x = 0, of_y = 0, most = 0, same;

    for (int32_t i = 0; i < m->n; i++) {
        of_x += x[i] != 0.0;
        of_y += y[i] != 0.0;
        most = fabs(x[i]) > fabs(x[most]) ? i : most;
    }
    for (int32_t i = 0; i < m->n; i++)
        if (fabs(x[i] * y[most] - y[i] * x[most]) > allowed)
            return 0;
    same = m->n > 1 && of_x > 0 && fabs(x[most]) == fabs(y[most]);
    return same || (of_x > 1 && of_y > 1);
}

static void find_worst(look *a)
{
    const perp_mechanism *m = a->m;
    double worst = 0.0;

    for (int32_t j = 0; j < m->contacts; j++) {
        for (int32_t row = m->starts[j]; row < m->tangent[j]; row++)
            compare(a, j, row, &worst);
        for (int32_t row = m->tangent[j]; row < m->starts[j + 1]; row++) {
            bool parallel = 0;

            for (int32_t normal = m->starts[j]; normal < m->tangent[j]; normal++)
                parallel = parallel || are_parallel(m, normal, row);
            if (parallel) /* as wrong as what is wrong by all of itself */
                blame(a, 1.0 / RELATIVE, &worst, PERP_MECHANISM_TANGENT, j, row);
        }
    }
    for (int32_t j = 0; j < m->bilateral; j++)
        compare(a, m->contacts + j, m->contact_rows + j, &worst);
}

perp_status perp_mechanism_check(perp_mechanism *mechanism, perp_mechanism_check_result *result,
                                 double t, const double *q, const double *v)
{
    perp_mechanism *m = mechanism;
    look *a = NULL;
    perp_status status = perp__mechanism_enter(m);

    if (status != PERP_OK)
        return status;
    status = PERP__CHECK(perp_mechanism_check_result, m->context, result);
    PERP__THEN(status, perp__mechanism_check_state(m, t, q, v));
    if (status == PERP_OK) {
        a = perp__work_create(m, sizeof *a, layout);
        status = a ? PERP_OK : PERP_ERROR_MEMORY;
    }
    if (a) {
        a->t = t;
        a->q = q;
        a->v = v;
        a->result.part = a->result.index = a->result.row = a->result.column = -1;
        m->keeps = 0;
        status = perp__evaluate_rows(m, &m->begin, t, q, v);
        if (status == PERP_OK)
            collect(m, &m->begin, a->here);
        for (size_t i = 0; i < (size_t)m->rows * ((size_t)m->n + 1); i++) {
            a->difference[i] = 0.0;
            a->uncertainty[i] = INFINITY;
        }
        for (int32_t column = 0; column <= m->n && status == PERP_OK; column++)
            status = differ(a, column);
        if (status == PERP__OUTSIDE)
            status = perp__refuse(m->context, "q is outside of what the mechanism is defined for");
        if (status == PERP_OK) {
            find_worst(a);
            perp__struct_write(result, &a->result, sizeof a->result);
        }
    }
    perp__work_release(a);
    return perp__leave(m->context, status);
}
