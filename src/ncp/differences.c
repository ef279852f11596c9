/* Jacobians by differences of F, within the bounds and around holes of its domain. */
#include <math.h>
#include <string.h>

#include "base/rounding.h"
#include "ncp/model.h"

/* ---- columns that can be differenced together: Curtis, Powell & Reid, "On the estimation of
 * sparse Jacobian matrices", J. Inst. Maths Applics 13 (1974); greedy, in columns' order ---- */

/* Colours the columns of the caller's pattern, once. A dense matrix has a colour a column. */
static void colour(perp__ncp_model *m)
{
    perp__ncp_colours *c = &m->colours;
    const int32_t *starts = m->pattern_starts, *rows = m->pattern_rows;
    const perp__matrix pattern = {m->n, m->n, 1, 1, NULL, starts, rows};

    if (c->known)
        return;
    c->known = 1;
    c->count = 0;
    /* 1. The pattern by rows. */
    if (m->sparse)
        perp__transpose_csc(&pattern, c->row_starts, c->row_columns, NULL);
    /* 2. Each column gets the least colour that no column of its rows has. */
    for (int32_t i = 0; i < m->n; i++)
        c->marks[i] = 0;
    for (int32_t j = 0; j < m->n; j++) {
        int32_t colour = m->sparse ? 0 : c->count;

        c->of[j] = -1;
        if (!(m->lower[j] < m->upper[j]))
            continue;
        if (m->sparse) {
            for (int32_t k = starts[j]; k < starts[j + 1]; k++)
                for (int32_t p = c->row_starts[rows[k]];
                     p < c->row_starts[rows[k] + 1] && c->row_columns[p] < j; p++)
                    if (c->of[c->row_columns[p]] >= 0)
                        c->marks[c->of[c->row_columns[p]]] = j + 1;
            while (c->marks[colour] == j + 1)
                colour++;
        }
        c->of[j] = colour;
        c->count = colour >= c->count ? colour + 1 : c->count;
    }
    /* 3. The columns by colour. */
    memset(c->starts, 0, ((size_t)m->n + 1) * sizeof(int32_t));
    for (int32_t j = 0; j < m->n; j++)
        if (c->of[j] >= 0)
            c->starts[c->of[j] + 1]++;
    for (int32_t k = 0; k < m->n; k++) {
        c->starts[k + 1] += c->starts[k];
        c->marks[k] = c->starts[k];
    }
    for (int32_t j = 0; j < m->n; j++)
        if (c->of[j] >= 0)
            c->order[c->marks[c->of[j]]++] = j;
}

/* ---- differences ---- */

#define KEPT 1e-3 /* of the largest value a variable had, where it is near 0 now */

enum { LENGTHENINGS = 3 }; /* from sqrt(eps) to 1 / eps */

/* 0: unknown. */
static double known_size(const perp__ncp_model *m, int32_t j)
{
    double size = fmax(fabs(m->z_caller[j]), KEPT * m->largest[j]);

    if (size == 0.0 && isfinite(m->lower[j]))
        size = fabs(m->lower[j]);
    if (size == 0.0 && isfinite(m->upper[j]))
        size = fabs(m->upper[j]);
    return size;
}

double perp__ncp_size(const perp__ncp_model *m, int32_t j)
{
    double size = known_size(m, j);

    for (int32_t i = 0; i < m->n && size == 0.0; i++)
        size = m->largest[i];
    return size > 0.0 ? size : 1.0;
}

double perp__ncp_fit_step(const perp__ncp_model *m, int32_t j, double step)
{
    const double z = m->z_caller[j];
    const double room = step > 0.0 ? m->upper[j] - z : z - m->lower[j];
    volatile double there = z + (fabs(step) <= room ? step : copysign(room, step));

    return perp__clamp(there, m->lower[j], m->upper[j]) - z;
}

/* What rounding alone may have made is no derivative: a zero stays one. */
static double quotient(double high, double low, double width, double *moved)
{
    const double share = fabs(high - low) / fmax(fabs(high), fabs(low));

    if (!(share > PERP__ROUNDING_LIMIT))
        return 0.0;
    *moved = fmax(*moved, share);
    return (high - low) / width;
}

static void put(perp__ncp_model *m, int32_t j, const double *high, const double *low, double width)
{
    const size_t n = (size_t)m->n;
    double *moved = &m->moved[j];
    const int by_rows = m->problem.storage == PERP_STORAGE_ROW_MAJOR;

    *moved = 0.0;
    if (m->sparse)
        for (int32_t k = m->pattern_starts[j]; k < m->pattern_starts[j + 1]; k++)
            m->given[k] = quotient(high[m->pattern_rows[k]], low[m->pattern_rows[k]], width, moved);
    else
        for (size_t i = 0; i < n; i++)
            m->given[by_rows ? i * n + (size_t)j : (size_t)j * n + i] =
                quotient(high[i], low[i], width, moved);
}

/* F at z + sign * (the steps of count columns), into F */
static perp_status shift(perp__ncp_model *m, const int32_t *columns, int32_t count, double sign,
                         double *F)
{
    perp_status status;

    for (int32_t k = 0; k < count; k++)
        m->shifted[columns[k]] = m->z_caller[columns[k]] + sign * m->step[columns[k]];
    status = perp__ncp_call(m, m->shifted, F);
    for (int32_t k = 0; k < count; k++)
        m->shifted[columns[k]] = m->z_caller[columns[k]];
    return status;
}

/* The columns of one colour together, to both sides where that is asked for and there is room; else
 * one after the other. */
static perp_status difference_together(perp__ncp_model *m, const int32_t *columns, int32_t count)
{
    double *high = m->w_shifted, *low = m->w_shifted + m->n;
    perp_status status = shift(m, columns, count, 1.0, high);
    bool both = status == PERP_OK && m->central;

    for (int32_t k = 0; k < count && both; k++) {
        const double z = m->z_caller[columns[k]] - m->step[columns[k]];

        both = z >= m->lower[columns[k]] && z <= m->upper[columns[k]];
    }
    if (both) {
        const perp_status other = shift(m, columns, count, -1.0, low);

        both = other == PERP_OK;
        status = other < 0 ? other : PERP_OK;
    }
    if (status == PERP_OK)
        for (int32_t k = 0; k < count; k++)
            put(m, columns[k], high, both ? low : m->w_caller,
                (both ? 2.0 : 1.0) * m->step[columns[k]]);
    if (status != PERP__NCP_OUTSIDE)
        return status;
    /* each by itself, where the others' company, or this side of it, was outside */
    status = PERP_OK;
    for (int32_t k = 0; k < count && status == PERP_OK; k++) {
        const int32_t j = columns[k];
        double wanted = m->step[j];

        status = PERP__NCP_OUTSIDE;
        for (int32_t s = 0; s < PERP__NCP_SHRINKS && status == PERP__NCP_OUTSIDE; s++) {
            m->step[j] = perp__ncp_fit_step(m, j, wanted);
            if (m->step[j] != 0.0)
                status = shift(m, &j, 1, 1.0, m->w_shifted);
            wanted *= s % 2 == 0 ? -1.0 : PERP__NCP_SHRINK;
        }
        if (status == PERP_OK)
            put(m, j, m->w_shifted, m->w_caller, m->step[j]);
    }
    return status;
}

/* Longer steps for those columns, put first, whose variable is of unknown size and moves no F_i by
 * more than eps^(3/4) of itself. Times eps^(-1/2), what rounding doesn't hide yet moves F by
 * eps^(3/4) to eps^(1/4): as far from rounding as from the size of F. Returns how many. */
static int32_t lengthen_steps(perp__ncp_model *m, int32_t *columns, int32_t count)
{
    const double root = perp__difference_step(2), least = root * perp__difference_step(4);
    int32_t left = 0;

    for (int32_t k = 0; k < count; k++) {
        const int32_t j = columns[k];
        const double step = perp__ncp_fit_step(m, j, m->step[j] / root);

        if (known_size(m, j) > 0.0 || m->moved[j] >= least || fabs(step) <= fabs(m->step[j]))
            continue;
        m->step[j] = step;
        columns[k] = columns[left];
        columns[left++] = j;
    }
    return left;
}

bool perp__ncp_sharpen(perp__ncp_model *m)
{
    const bool news = !m->problem.jacobian && !m->central;

    m->central = 1;
    return news;
}

perp_status perp__ncp_differences(perp__ncp_model *m)
{
    const size_t count = m->sparse ? (size_t)m->pattern_starts[m->n] : (size_t)m->n * (size_t)m->n;
    const perp__ncp_colours *c = &m->colours;
    const perp__matrix J = perp__ncp_given(m);
    const bool by_rows = perp__lines_are_rows(&J);
    const double forward = perp__difference_step(2), central = perp__difference_step(3);
    double *largest = m->w_shifted;
    perp_status status = PERP_OK;

    colour(m);
    if (count > 0)
        memset(m->given, 0, count * sizeof(double)); /* the columns of fixed variables */
    /* 1. The steps, to the side where there is room. */
    for (int32_t j = 0; j < m->n; j++)
        m->largest[j] = fmax(m->largest[j], fabs(m->z_caller[j]));
    for (int32_t j = 0; j < m->n; j++) {
        const double size = perp__ncp_size(m, j), wide = size * central, z = m->z_caller[j];
        const double up = perp__ncp_fit_step(m, j, size * forward);
        const double down = perp__ncp_fit_step(m, j, -(size * forward));

        m->sizes[j] = size;
        m->step[j] = fabs(up) >= 0.5 * fabs(down) ? up : down;
        m->shifted[j] = z;
        if (m->central && z - m->lower[j] >= wide && m->upper[j] - z >= wide)
            m->step[j] = perp__ncp_fit_step(m, j, wide);
    }
    /* 2. The differences. */
    for (int32_t k = 0; k < c->count && status == PERP_OK; k++) {
        int32_t *columns = c->order + c->starts[k], left = c->starts[k + 1] - c->starts[k];

        for (int32_t round = 0; left > 0 && status == PERP_OK; round++) {
            status = difference_together(m, columns, left);
            if (round > 0 && status == PERP__NCP_OUTSIDE) { /* a longer step is none there */
                status = PERP_OK;
                break;
            }
            left = round < LENGTHENINGS ? lengthen_steps(m, columns, left) : 0;
        }
    }
    /* 3. Entries with which z_j, as large as it is, would move F_i by next to nothing beside the
     * other entries of the row, less than differences can tell from 0, are zero: at z = 0, z^3 has
     * the slope 0, and by differences h^2. */
    for (int32_t i = 0; i < m->n; i++)
        largest[i] = 0.0;
    for (int32_t pass = 0; pass < 2 && status == PERP_OK; pass++)
        for (int32_t j = 0; j < m->n; j++) {
            const perp__line l = perp__line_of(&J, j);

            for (int32_t k = 0; k < l.count; k++) {
                const int32_t other = l.indices ? l.indices[k] : k;
                const int32_t row = by_rows ? j : other;
                double *entry = m->given + (l.values - m->given) + k;
                const int32_t column = by_rows ? other : j;
                const double moved = fabs(*entry) * m->sizes[column];

                if (m->w_caller[row] != 0.0 && known_size(m, column) == 0.0)
                    continue; /* rounding of F_i has told */
                if (pass == 0)
                    largest[row] = fmax(largest[row], moved);
                else if (moved < forward * largest[row])
                    *entry = 0.0;
            }
        }
    return status;
}
