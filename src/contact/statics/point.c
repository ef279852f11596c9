/* A point of the interior point's way: where it starts, x by least squares or from inside, in units
 * in which forces and cones have ordinary size; how far impulses are from balance and from the edge
 * of their cones; and whether a dual point is a proof. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/outcome.h"
#include "contact/statics/interior.h"
#include "linalg/matrix.h"

void perp__cone_place(const perp__statics *s, const perp__cone *cone, const double *x, double shift,
                      double *z)
{
    const double *at_unit = x + s->rows->unit[cone->unit].row;

    z[0] = cone->sign * at_unit[0] + shift;
    z[1] = cone->dim > 1 ? cone->scale * at_unit[cone->first] : 0.0;
    z[2] = cone->dim > 2 ? cone->scale * at_unit[cone->first + 1] : 0.0;
}

/* Of the smallest load beside the largest: what counts. */
#define LIGHTEST 1e-8

/* What a certificate may lack in rows, beside their terms; and how many times the work that
 * impulses could do on that it must have. */
#define ROW_ROUNDING 1e-10
#define WORK_BESIDE 10.0

/* Beside a body without forces: the rounding of what its part carries is none of its own. */
#define FLOOR (PERP__ROUNDING_LIMIT / PERP__BALANCED)

/* ---- forces and cones, and the first point ---- */

static perp__cone *add_cone(perp__statics *s, int32_t u, double sign, double h, double e)
{
    perp__cone *cone = &s->cones[s->cone_count++];

    memset(cone, 0, sizeof *cone);
    cone->unit = u;
    cone->dim = 1;
    cone->sign = sign / s->weight[u];
    cone->h = h / s->scale / s->weight[u];
    cone->e = e;
    return cone;
}

static void add_disc(perp__statics *s, int32_t u, int32_t first, int32_t rows, double coefficient)
{
    perp__cone *cone = add_cone(s, u, 1.0, 0.0, 1.0);

    cone->dim = 1 + rows;
    cone->first = first;
    cone->scale = fmax(1.0 / coefficient, DBL_EPSILON) / s->weight[u]; /* beyond: rounding */
}

/* The cones of an interval. A bound beside which impulses of ordinary size are rounding is none,
 * and so is one side of an interval that is as narrow as rounding: it is a force. */
static void add_bounds(perp__statics *s, int32_t u)
{
    const perp__statics_unit *unit = &s->rows->unit[u];
    const double lower = unit->lower / s->scale / s->weight[u];
    const double upper = unit->upper / s->scale / s->weight[u];
    const double half = s->recedes ? 1.0 : 0.5 * (upper - lower);
    const double e = fmin(1.0, half), most = s->recedes ? INFINITY : 1.0 / DBL_EPSILON;

    if (half <= DBL_EPSILON || (s->recedes && lower > -most && upper < most)) {
        s->idle[u] = 1;
        s->x[unit->row] = s->recedes ? 0.0 : perp__statics_least(unit) / s->scale;
        return;
    }
    if (lower > -most)
        add_cone(s, u, 1.0, s->recedes ? 0.0 : -unit->lower, e);
    if (upper < most)
        add_cone(s, u, -1.0, s->recedes ? 0.0 : unit->upper, e);
}

void perp__statics_build_cones(perp__statics *s)
{
    s->cone_count = 0;
    for (int32_t u = 0; u < s->rows->units; u++) {
        const perp__statics_unit *unit = &s->rows->unit[u];

        s->unit_cone[u] = s->cone_count;
        if (s->idle[u] || unit->rows == 0)
            continue;
        if (unit->kind == PERP__STATICS_INTERVAL) {
            add_bounds(s, u);
        } else if (unit->kind == PERP__STATICS_CONE) {
            const int32_t rolling = 1 + unit->tangents, spinning = rolling + unit->rolls;

            if (unit->tangents > 0)
                add_disc(s, u, 1, unit->tangents, unit->mu);
            if (unit->rolls > 0)
                add_disc(s, u, rolling, unit->rolls, unit->rolling);
            if (unit->spins > 0)
                add_disc(s, u, spinning, 1, unit->spinning);
            if (unit->rows == 1)
                add_cone(s, u, 1.0, 0.0, 1.0);
        }
    }
    s->unit_cone[s->rows->units] = s->cone_count;
}

void perp__statics_clear(perp__statics *s)
{
    for (int32_t u = 0; u < s->rows->units; u++)
        for (int32_t k = 0; k < s->rows->unit[u].rows && !s->idle[u]; k++)
            s->x[s->rows->unit[u].row + k] = 0.0;
}

/* x := the least |x|^2 with A x = b, without cones; y; returns what is left of b. */
double perp__statics_start_balanced(perp__statics *s)
{
    for (int32_t u = 0; u < s->rows->units; u++) {
        double *F = s->F + s->square[u];
        const int32_t rows = s->rows->unit[u].rows;

        memset(F, 0, (size_t)(rows * rows) * sizeof *F);
        for (int32_t i = 0; i < rows; i++)
            F[i * rows + i] = 1.0;
    }
    s->aim = PERP__AIM_MARGIN;
    if (!perp__statics_factor(s))
        return INFINITY;
    perp__statics_clear(s);
    memset(s->y, 0, perp__statics_numbers(s) * sizeof *s->y);
    return perp__statics_refine(s, perp__statics_unbalance(s, 0), PERP__BALANCED_AT_BEST);
}

/* The first z and u of the margin's way, s below the worst margin. */
void perp__statics_start_margin(perp__statics *s, double room)
{
    const int32_t count = s->cone_count + 1;

    s->aim = PERP__AIM_MARGIN;
    s->s = fmin(room, 1.0 - 1e-3);
    if (!(room < INFINITY))
        s->s = 0.0;
    s->s -= fmax(1.0, fabs(s->s));
    s->t = 1.0 - s->s;
    memset(s->y, 0, (size_t)(s->rows->nodes * s->rows->width) * sizeof *s->y);
    s->tau = 1.0 / count;
    for (int32_t c = 0; c < s->cone_count; c++) {
        perp__cone *cone = &s->cones[c];

        cone->z[0] -= s->s * cone->e;
        memset(cone->u, 0, sizeof cone->u);
        cone->u[0] = 1.0 / count / cone->e;
    }
}

/* The first u of a way from inside, on the central path: u o z = mean e. */
void perp__statics_start_inside(perp__statics *s, int32_t aim, double mean)
{
    s->aim = aim;
    s->tau = s->t = 0.0;
    memset(s->y, 0, (size_t)(s->rows->nodes * s->rows->width) * sizeof *s->y);
    memset(s->k, 0, (size_t)s->rows->size * sizeof *s->k);
    perp__statics_room(s); /* z */
    for (int32_t c = 0; c < s->cone_count; c++) {
        perp__cone *cone = &s->cones[c];
        const double det = perp__cone_det(cone->z);

        cone->u[0] = mean * cone->z[0] / det;
        cone->u[1] = -mean * cone->z[1] / det;
        cone->u[2] = -mean * cone->z[2] / det;
    }
}

double perp__statics_least(const perp__statics_unit *unit)
{
    return unit->kind == PERP__STATICS_INTERVAL ? fmin(fmax(unit->lower, 0.0), unit->upper) : 0.0;
}

void perp__statics_set_forces(perp__statics *s, const double *forces, double factor,
                              const double *load)
{
    const perp__statics_rows *rows = s->rows;
    const int32_t width = rows->width, n = rows->nodes * width;
    const double one = perp__unit_of(load ? perp__largest(load, n) : 0.0), added = factor * one;
    const double unit =
        perp__unit_of(fmax(forces ? perp__largest(forces, n) : 0.0, load ? added : 0.0));
    double most;

    /* 1. b, in units of its largest term; sums of forces may be no doubles. */
    for (int32_t i = 0; i < n; i++) {
        s->b[i] =
            -(forces ? forces[i] / unit : 0.0) - (load ? added / unit * (load[i] / one) : 0.0);
        s->terms[i] = fabs(s->b[i]);
    }
    s->pushes = !forces;
    for (int32_t u = 0; u < rows->units && forces; u++) {
        const double least = perp__statics_least(&rows->unit[u]);

        s->pushes |= least != 0.0;
        for (int32_t l = 0; l < rows->unit[u].links && least != 0.0; l++) {
            const perp__statics_link *link = &rows->link[rows->unit[u].link + l];

            for (int32_t i = 0; i < width; i++)
                s->terms[link->node * width + i] +=
                    fabs(rows->values[link->at + (size_t)i] * (least / unit));
        }
    }
    most = perp__largest(s->terms, n);
    most = unit * most < INFINITY ? perp__unit_of(most) : 1.0;
    s->scale = unit * most;
    for (int32_t i = 0; i < n; i++) {
        s->b[i] /= most;
        s->terms[i] /= most;
    }

    /* 2. The load of each node; a coordinate that rows but graze has no say. */
    for (int32_t node = 0; node < rows->nodes; node++) {
        const double *reach = s->reach + node * width, *terms = s->terms + node * width;
        const double least = LIGHTEST * perp__largest(reach, width);
        double carried = 0.0;

        for (int32_t i = 0; i < width; i++)
            if (reach[i] > least)
                carried = fmax(carried, terms[i] / reach[i]);
        s->terms[node] = carried;
    }

    /* 3. The weight of a unit: the load of the less loaded of the nodes that it pushes. */
    for (int32_t u = 0; u < rows->units; u++) {
        double least = INFINITY, largest = 0.0;

        for (int32_t l = 0; l < rows->unit[u].links; l++) {
            const double carried = s->terms[rows->link[rows->unit[u].link + l].node];

            if (carried > PERP__BALANCED_AT_BEST)
                least = fmin(least, carried);
            largest = fmax(largest, carried);
        }
        s->weight[u] = least < INFINITY ? fmax(least, LIGHTEST * largest) : 1.0;
    }
    s->doubled = 0;
    s->recedes = !forces;
    memset(s->idle, 0, (size_t)rows->units * sizeof *s->idle);
    perp__statics_build_cones(s);
}

/* ---- what has been found ---- */

double perp__statics_unbalance(perp__statics *s, bool corrects)
{
    const int32_t width = s->rows->width, *parent = s->fronts.parent;
    double *floor = s->permuted, most = 0.0;

    /* 1. The terms of each row. */
    perp__statics_balance(s, corrects);

    /* 2. For each place in the order of elimination, the largest terms of its part. */
    for (int32_t i = 0; i < s->rows->nodes; i++)
        floor[i] = perp__largest(s->terms + s->fronts.order[i] * width, width);
    for (int32_t i = 0; i < s->rows->nodes; i++)
        if (parent[i] >= 0)
            floor[parent[i]] = fmax(floor[parent[i]], floor[i]);
    for (int32_t i = s->rows->nodes - 1; i >= 0; i--)
        if (parent[i] >= 0)
            floor[i] = floor[parent[i]];

    /* 3. What is left beside them. */
    for (int32_t place = 0; place < s->rows->nodes; place++) {
        const int32_t at = s->fronts.order[place] * width;
        const double left = perp__largest_or_nan(s->rb + at, width);
        const double terms = perp__largest(s->terms + at, width);

        if (left != 0.0)
            perp__raise_to(&most, left / (perp__is_zero(s->b + at, width)
                                              ? fmax(terms, FLOOR * floor[place])
                                              : terms));
    }
    return most;
}

double perp__statics_refine(perp__statics *s, double left, double enough)
{
    double last = INFINITY;

    for (int32_t round = 0; round < 4 && left > enough && left < 0.5 * last; round++) {
        last = left;
        left = perp__statics_unbalance(s, 1);
    }
    return left;
}

double perp__statics_room(perp__statics *s)
{
    double least = INFINITY;

    for (int32_t c = 0; c < s->cone_count; c++) {
        perp__cone *cone = &s->cones[c];

        perp__cone_place(s, cone, s->x, cone->h, cone->z);
        least = fmin(least, perp__cone_room(cone->z) / cone->e);
    }
    return least;
}

/* Whether y proves that there is no equilibrium; *work: y'b and the least that rows with bounds
 * add. What rows lack of the dual cones counts as rounding where impulses a few times those at hand
 * could not do that work on it. */
static bool proves(perp__statics *s, const double *y, double *work)
{
    const perp__statics_rows *rows = s->rows;
    const double most = perp__largest(y, (int32_t)perp__statics_numbers(s));
    double undone = 0.0, sum = 0.0, size = 0.0;

    for (size_t i = 0; i < perp__statics_numbers(s); i++) {
        sum += y[i] * s->b[i];
        size += fabs(y[i] * s->b[i]);
    }
    if (!(sum > 0.0) && !s->pushes) /* rows can but take from it */
        return 0;
    perp__statics_meet(s, y, s->met);
    for (int32_t u = 0; u < rows->units; u++) { /* idle ones too may push against this motion */
        const perp__statics_unit *unit = &rows->unit[u];
        const double *v = s->met + unit->row;
        double lack = 0.0, terms = 0.0, made = 0.0, carried = s->weight[u];

        for (int32_t l = 0; l < unit->links; l++) {
            const perp__statics_link *link = &rows->link[unit->link + l];
            double longest = 0.0;

            for (int32_t i = 0; i < unit->rows * rows->width; i++) {
                const double entry = perp__statics_share(unit, i / rows->width) *
                                     fabs(rows->values[link->at + (size_t)i]);

                longest = fmax(longest, entry);
                terms += most * entry;
            }
            for (int32_t i = 0; i < unit->rows * rows->width; i++) /* any but 0 is as rough */
                if (rows->values[link->at + (size_t)i] != 0.0)
                    made += fabs(y[link->node * rows->width + i % rows->width]) * longest;
            if (longest > 0.0) /* what would balance the forces on that node */
                carried = fmax(
                    carried, perp__largest(s->b + link->node * rows->width, rows->width) / longest);
        }
        for (int32_t k = 0; k < unit->rows; k++)
            carried = fmax(carried, fabs(s->x[unit->row + k]) / perp__statics_share(unit, k));
        if (unit->rows == 0) /* what is open */
            continue;
        if (unit->kind == PERP__STATICS_INTERVAL) {
            const double least = v[0] > 0.0 ? -unit->upper * v[0] : -unit->lower * v[0];

            /* u = -A'y: what the interval allows least of r u */
            if (isinf(least))
                lack = fabs(v[0]);
            else if (v[0] != 0.0) {
                sum += least / s->scale;
                undone += DBL_EPSILON * made * fabs(least / v[0] / s->scale);
            }
        } else if (unit->kind == PERP__STATICS_FREE) {
            lack = perp__sum_of_sizes(v, unit->rows);
        } else {
            const double *roll = v + 1 + unit->tangents, *spin = roll + unit->rolls;

            lack = v[0] + unit->mu * perp__length(v + 1, unit->tangents) +
                   unit->rolling * perp__length(roll, unit->rolls) +
                   unit->spinning * perp__length(spin, unit->spins);
        }
        if (!(lack <= ROW_ROUNDING * terms))
            return 0;
        undone += (fmax(lack, 0.0) + DBL_EPSILON * made) * carried;
    }
    *work = sum;
    return sum > WORK_BESIDE * undone + PERP__SUM_ROUNDING * size;
}

bool perp__statics_prove(perp__statics *s, perp__statics_answer *answer, const double *y)
{
    const int32_t n = (int32_t)perp__statics_numbers(s);
    const double unit = perp__unit_of(perp__largest(y, n));
    double *at_unit = s->permuted, work, most; /* y of size 1, lest rows round to nothing */

    for (int32_t i = 0; i < n; i++)
        at_unit[i] = y[i] / unit;
    most = perp__largest(at_unit, n);
    if (!(most > 0.0) || !proves(s, at_unit, &work))
        return 0;
    for (int32_t i = 0; i < n && answer->v; i++)
        answer->v[i] = -at_unit[i] / most;
    s->work = work / most;
    answer->work = s->work * s->scale;
    return 1;
}
