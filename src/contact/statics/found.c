/* What has been found: how far impulses are from balance and from the edge of their cones, a step
 * of refinement, and whether a dual point is a proof. */
#include <math.h>
#include <string.h>

#include "base/outcome.h"
#include "contact/statics/interior.h"
#include "linalg/matrix.h"

/* What a certificate may lack in rows, beside their terms; and how many times the work that
 * impulses could do on that it must have. */
#define ROW_ROUNDING 1e-10
#define WORK_BESIDE 10.0

/* rb := b + s c - A x */
void perp__statics_find_unbalance(perp__statics *s)
{
    const size_t n = perp__statics_numbers(s);

    for (size_t i = 0; i < n; i++) {
        s->rb[i] = s->b[i];
        s->rb_low[i] = 0.0;
        if (s->aim == PERP__AIM_LOAD) {
            const double product = s->s * s->c[i], sum = s->b[i] + product;
            const double part = sum - s->b[i];

            s->rb[i] = sum;
            s->rb_low[i] =
                (s->b[i] - (sum - part)) + (product - part) + fma(s->s, s->c[i], -product);
        }
    }
    perp__statics_load(s, -1.0, s->x, s->rb, s->rb_low);
}

double perp__statics_unbalance(perp__statics *s)
{
    const int32_t width = s->rows->width;
    const size_t n = perp__statics_numbers(s);
    double most = 0.0;

    perp__statics_find_unbalance(s);
    for (size_t i = 0; i < n; i++)
        s->terms[i] = fabs(s->b[i]);
    for (int32_t u = 0; u < s->rows->units; u++) {
        const perp__statics_unit *unit = &s->rows->unit[u];

        for (int32_t l = 0; l < unit->links && !s->idle[u]; l++) {
            const perp__statics_link *link = &s->rows->link[unit->link + l];

            for (int32_t k = 0; k < unit->rows; k++)
                for (int32_t i = 0; i < width; i++)
                    s->terms[link->node * width + i] += fabs(
                        s->rows->values[link->at + (size_t)(k * width + i)] * s->x[unit->row + k]);
        }
    }
    for (int32_t node = 0; node < s->rows->nodes; node++) {
        const double left = perp__largest_or_nan(s->rb + node * width, width);
        const double terms = perp__largest(s->terms + node * width, width);

        if (left != 0.0)
            perp__raise_to(&most, left / terms);
    }
    return most;
}

/* x += S^-1 A' K^-1 rb, by the last factors. */
static void balance(perp__statics *s)
{
    const size_t n = perp__statics_numbers(s);

    memcpy(s->dy, s->rb, n * sizeof *s->dy);
    memcpy(s->dy_low, s->rb_low, n * sizeof *s->dy);
    perp__statics_solve(s, s->dy, s->dy_low);
    memset(s->p, 0, (size_t)s->rows->size * sizeof *s->p);
    perp__statics_pull(s, s->p, s->dy, s->dy_low, s->dx);
    for (int32_t i = 0; i < s->rows->size; i++)
        s->x[i] += s->dx[i];
}

double perp__statics_refine(perp__statics *s, double enough)
{
    double left = perp__statics_unbalance(s), last = INFINITY;

    for (int32_t round = 0; round < 4 && left > enough && left < 0.5 * last; round++) {
        last = left;
        balance(s);
        left = perp__statics_unbalance(s);
    }
    return left;
}

/* The least room of x in its cones, in units of each; idle units carry nothing. */
double perp__statics_room(perp__statics *s)
{
    double least = INFINITY;

    for (int32_t c = 0; c < s->cone_count; c++) {
        perp__cone *cone = &s->cones[c];

        if (s->idle[cone->unit])
            continue;
        perp__cone_place(s, cone, s->x, cone->h, cone->z);
        least = fmin(least, perp__cone_room(cone->z) / cone->e);
    }
    return least;
}

/* Whether y proves that there is no equilibrium; *work: y'b and the least that rows with bounds
 * add. What rows lack of the dual cones counts as rounding where impulses a few times those at hand
 * could not do that work on it. */
static int32_t proves(perp__statics *s, const double *y, double *work)
{
    const perp__statics_rows *rows = s->rows;
    const double most = perp__largest(y, (int32_t)perp__statics_numbers(s));
    double undone = 0.0, sum = 0.0, size = 0.0;

    for (size_t i = 0; i < perp__statics_numbers(s); i++) {
        sum += y[i] * s->b[i];
        size += fabs(y[i] * s->b[i]);
    }
    if (!(sum > 0.0))
        return 0;
    for (int32_t u = 0; u < rows->units; u++) {
        const perp__statics_unit *unit = &rows->unit[u];
        double v[6] = {0.0}, lack = 0.0, terms = 0.0, carried = s->weight[u];

        perp__statics_row(s, u, y, v); /* of idle units too: they may push against this motion */
        for (int32_t l = 0; l < unit->links; l++) {
            const perp__statics_link *link = &rows->link[unit->link + l];

            for (int32_t i = 0; i < unit->rows * rows->width; i++)
                terms += most * fabs(rows->values[link->at + (size_t)i]);
        }
        for (int32_t k = 0; k < unit->rows; k++)
            carried = fmax(carried, fabs(s->x[unit->row + k]));
        if (unit->kind == PERP__STATICS_INTERVAL) {
            const double least = v[0] > 0.0 ? -unit->upper * v[0] : -unit->lower * v[0];

            /* u = -A'y: what the interval allows least of r u */
            if (isinf(least))
                lack = fabs(v[0]);
            else if (v[0] != 0.0)
                sum += least / s->scale;
        } else if (unit->kind == PERP__STATICS_FREE) {
            for (int32_t k = 0; k < unit->rows; k++)
                lack += fabs(v[k]);
        } else {
            const double *roll = v + 1 + unit->tangents, *spin = roll + unit->rolls;

            lack = v[0] + unit->mu * hypot(unit->tangents > 0 ? v[1] : 0.0,
                                           unit->tangents > 1 ? v[2] : 0.0);
            if (unit->rolls > 0)
                lack += unit->rolling * hypot(roll[0], unit->rolls > 1 ? roll[1] : 0.0);
            if (unit->spins)
                lack += unit->spinning * fabs(spin[0]);
        }
        if (!(lack <= ROW_ROUNDING * terms))
            return 0;
        undone += fmax(lack, 0.0) * carried;
    }
    *work = sum;
    return sum > WORK_BESIDE * undone + 64.0 * DBL_EPSILON * size;
}

int32_t perp__statics_prove(perp__statics *s, perp__statics_answer *answer, const double *y)
{
    const int32_t n = (int32_t)perp__statics_numbers(s);
    const double most = perp__largest(y, n);
    double work;

    if (!(most > 0.0) || !proves(s, y, &work))
        return 0;
    for (int32_t i = 0; i < n && answer->v; i++)
        answer->v[i] = -y[i] / most;
    answer->work = work / most * s->scale;
    return 1;
}
