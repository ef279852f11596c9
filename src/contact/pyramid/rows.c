/* The rows of the LCP of pyramid.c, from contacts and W. */
#include <math.h>
#include <string.h>

#include <perp/contact.h>

#include "base/clock.h"
#include "contact/law.h"
#include "contact/pyramid/pyramid.h"

/* Edges where the exact cone was asked for and this is only its start. */
enum { EDGES = 10 };

/* Radians from the middle of a window: the last vertex before the opposite one. */
#define WIDEST 2.0

/* Vertices of a part's polygon; 0 where its coefficient is. */
static int32_t edges_of(const perp__contact_problem *problem, const perp__contact_part *part)
{
    if (part->coefficient == 0.0)
        return 0;
    return part->size == 1 ? 2 : problem->cone > 0 ? problem->cone : EDGES;
}

int64_t perp__pyramid_count(const perp__contact_problem *problem)
{
    int64_t n = problem->size - problem->rows;

    for (int32_t k = 0; k < problem->contacts; k++) {
        perp__contact_part parts[3];
        const int32_t count = perp__contact_parts(problem, k, parts);

        n += 1 + perp__contact_two_sided(problem, k);
        for (int32_t p = 0; p < count; p++)
            if (edges_of(problem, &parts[p]) > 0)
                n += edges_of(problem, &parts[p]) + 1;
    }
    return n;
}

static void add_unknown(perp__pyramid *p, int32_t unit, int32_t row, int32_t size, double x,
                        double y)
{
    perp__unknown *added = &p->unknowns[p->n++];

    added->unit = unit;
    added->row = row;
    added->size = size;
    added->d[0] = x;
    added->d[1] = y;
}

/* Vertex j of the polygon of a disc, part c of contact k. */
static void vertex(const perp__pyramid *p, int32_t edges, int32_t k, int32_t c, int32_t j,
                   double d[2])
{
    const double angle = p->angles[3 * k + c], width = p->widths[3 * k + c];
    double offset = 0.0;

    if (p->regular) {
        perp__contact_direction(edges, j, d);
        return;
    }
    if (j == EDGES - 1) {
        d[0] = -cos(angle); /* to the last bit opposite to vertex 0 */
        d[1] = -sin(angle);
        return;
    }
    if (j > 0) {
        const double steps = (EDGES - 2) / 2 - 1, growth = pow(WIDEST / width, 1.0 / steps);

        offset = width * pow(growth, (j - 1) / 2) * (j % 2 ? 1.0 : -1.0);
    }
    d[0] = cos(angle + offset);
    d[1] = sin(angle + offset);
}

void perp__pyramid_number(perp__pyramid *p)
{
    const perp__contact_problem *problem = p->base.problem;

    p->n = 0;
    for (int32_t k = 0; k < problem->contacts + problem->size - problem->rows; k++) {
        perp__contact_units(problem, k, &p->impulse[k], &p->per_velocity[k]);
        p->per_velocity[k] = 1.0 / p->per_velocity[k];
    }
    for (int32_t k = 0; k < problem->contacts; k++) {
        perp__contact_part parts[3];
        const int32_t count = perp__contact_parts(problem, k, parts);

        for (int32_t i = 0; i < perp__contact_normals(problem, k); i++)
            add_unknown(p, k, problem->starts[k] + i, 1, 1.0, 0.0);
        if (perp__contact_two_sided(problem, k) > 0)
            add_unknown(p, k, -1, 0, 0.0, 0.0);
        for (int32_t c = 0; c < count; c++) {
            const int32_t edges = edges_of(problem, &parts[c]);

            for (int32_t j = 0; j < edges; j++) {
                double d[2] = {j == 0 ? 1.0 : -1.0, 0.0};

                if (parts[c].size == 2)
                    vertex(p, edges, k, c, j, d);
                add_unknown(p, k, parts[c].row, parts[c].size, d[0], d[1]);
            }
            if (edges > 0)
                add_unknown(p, k, -1, 0, 0.0, 0.0);
        }
    }
    for (int32_t k = problem->rows; k < problem->size; k++)
        add_unknown(p, problem->contacts + k - problem->rows, k, 1, 1.0, 0.0);
}

void perp__pyramid_spread(perp__pyramid *p)
{
    const perp__matrix *W = p->base.problem->W;
    const size_t size = (size_t)W->rows;

    if (!p->W || size == 0)
        return;
    memset(p->W, 0, size * size * sizeof(double));
    for (int32_t j = 0; j < W->columns; j++)
        for (int32_t k = W->column_starts[j]; k < W->column_starts[j + 1]; k++)
            p->W[(size_t)W->row_indices[k] + (size_t)j * size] = W->values[k];
}

static double product(const double *W, size_t row_stride, size_t column_stride,
                      const perp__unknown *a, const perp__unknown *b)
{
    double sum = 0.0;

    for (int32_t i = 0; i < a->size; i++)
        for (int32_t j = 0; j < b->size; j++)
            sum += a->d[i] * b->d[j] *
                   W[(size_t)(a->row + i) * row_stride + (size_t)(b->row + j) * column_stride];
    return sum;
}

static void fill_column(perp__pyramid *p, size_t j)
{
    const perp__contact_problem *problem = p->base.problem;
    const perp__matrix *W = problem->W;
    const double *values = p->W ? p->W : W->values;
    const size_t row_stride = p->W ? 1 : W->row_stride;
    const size_t column_stride = p->W ? (size_t)problem->size : W->column_stride;
    const perp__unknown *b = &p->unknowns[j];
    double *column = p->M + j * (size_t)p->n;

    for (size_t i = 0; i < (size_t)p->n; i++) {
        const perp__unknown *a = &p->unknowns[i];

        column[i] = 0.0;
        if (a->size > 0 && b->size > 0 && perp__contact_couples(problem, a->unit, b->unit))
            column[i] = product(values, row_stride, column_stride, a, b) *
                        (p->impulse[b->unit] * p->per_velocity[a->unit]);
    }
}

/* Bilateral rows and normals that hold both ways. */
static int32_t has_any_sign(const perp__contact_problem *problem, const perp__unknown *a)
{
    if (a->size == 0 || a->unit >= problem->contacts)
        return a->size > 0;
    return a->row < problem->starts[a->unit] + perp__contact_two_sided(problem, a->unit);
}

int32_t perp__pyramid_fill_impulses(perp__pyramid *p)
{
    const perp__contact_problem *problem = p->base.problem;
    const double deadline = problem->control ? problem->control->deadline : 0.0;

    for (int32_t i = 0; i < p->n; i++) {
        const perp__unknown *a = &p->unknowns[i];

        if (deadline > 0.0 && perp__now() >= deadline)
            return 0;
        fill_column(p, (size_t)i);
        p->q[i] = 0.0;
        for (int32_t c = 0; c < a->size; c++)
            p->q[i] += a->d[c] * problem->q[a->row + c] * p->per_velocity[a->unit];
        p->lower[i] = has_any_sign(problem, a) ? -INFINITY : 0.0;
    }
    return 1;
}

/* 0 <= z  perp  e'r_N + z >= 0 of contact k, whose unknowns begin at `normal`. */
static void fill_side(perp__pyramid *p, int32_t k, size_t normal)
{
    const size_t n = (size_t)p->n, both = (size_t)p->base.problem->two_sided[k], z = normal + both;

    for (size_t i = 0; i < both; i++)
        p->M[z + (normal + i) * n] = p->sides[3 * (size_t)k + i];
    p->M[z + z * n] = 1.0;
}

/* coefficient r_n, or that of e'r_N + 2 z = |e'r_N|, in the row of a slip speed. */
static void fill_pressure(perp__pyramid *p, int32_t k, size_t normal, size_t row,
                          double coefficient)
{
    const size_t n = (size_t)p->n, both = (size_t)perp__contact_two_sided(p->base.problem, k);

    if (both == 0)
        p->M[row + normal * n] = coefficient;
    for (size_t i = 0; i < both; i++)
        p->M[row + (normal + i) * n] = coefficient * p->sides[3 * (size_t)k + i];
    if (both > 0)
        p->M[row + (normal + both) * n] = 2.0 * coefficient;
}

/* The rows and columns of the slip speeds. */
void perp__pyramid_fill_speeds(perp__pyramid *p)
{
    const perp__contact_problem *problem = p->base.problem;
    const size_t n = (size_t)p->n;
    size_t at = 0;

    for (int32_t k = 0; k < problem->contacts; k++) {
        perp__contact_part parts[3];
        const int32_t count = perp__contact_parts(problem, k, parts);
        const size_t normal = at, both = (size_t)perp__contact_two_sided(problem, k);

        if (both > 0)
            fill_side(p, k, normal);
        at += both + 1;
        for (int32_t c = 0; c < count; c++) {
            const int32_t edges = edges_of(problem, &parts[c]);
            const size_t lambda = at + (size_t)edges;

            for (int32_t j = 0; j < edges; j++, at++) {
                p->M[at + lambda * n] = 1.0;
                p->M[lambda + at * n] = -1.0;
            }
            if (edges > 0)
                fill_pressure(p, k, normal, at++, parts[c].coefficient);
        }
    }
}

/* x := the impulses that z stands for. */
void perp__pyramid_gather(const perp__pyramid *p, const double *z, double *x)
{
    for (int32_t i = 0; i < p->base.problem->size; i++)
        x[i] = 0.0;
    for (int32_t i = 0; i < p->n; i++)
        for (int32_t c = 0; c < p->unknowns[i].size; c++)
            x[p->unknowns[i].row + c] +=
                p->unknowns[i].d[c] * (z[i] * p->impulse[p->unknowns[i].unit]);
}

void perp__pyramid_modes(const perp__pyramid *p, int8_t *modes)
{
    const perp__contact_problem *problem = p->base.problem;
    int32_t at = 0, k, c;

    for (k = 0; k < problem->contacts; k++) {
        perp__contact_part parts[3];
        const int32_t count = perp__contact_parts(problem, k, parts);

        modes[k] = p->z[at++] > 0.0 ? PERP_CONTACT_STICK : PERP_CONTACT_SEPARATE;
        for (c = 0; c < count; c++) {
            const int32_t edges = edges_of(problem, &parts[c]);

            at += edges > 0 ? edges + 1 : 0;
            if (modes[k] == PERP_CONTACT_STICK && (edges == 0 || p->z[at - 1] > 0.0))
                modes[k] = PERP_CONTACT_SLIP;
        }
    }
}
