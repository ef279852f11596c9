/* K = A S^-1 A' on the graph of nodes: its pattern, its factors, and products with A. S^-1 = F F'
 * is kept by its root F: K is then positive semidefinite whatever rounding does, and near the edge
 * of a cone F is worth twice the digits of S^-1. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "base/sort.h"
#include "contact/statics/interior.h"
#include "linalg/doubled.h"
#include "linalg/lanes/lanes.h"

/* Neighbours of each node, sorted. */
static void list_neighbours(perp__statics *s, const int32_t *unit_starts, const int32_t *units,
                            int32_t *starts, int32_t *graph)
{
    const perp__statics_rows *rows = s->rows;
    int32_t count = 0;

    for (int32_t i = 0; i < rows->nodes; i++)
        s->mark[i] = -1;
    for (int32_t i = 0; i < rows->nodes; i++) {
        starts[i] = count;
        s->mark[i] = i;
        graph[count++] = i;
        for (int32_t at = unit_starts[i]; at < unit_starts[i + 1]; at++) {
            const perp__statics_unit *unit = &rows->unit[units[at]];

            for (int32_t l = unit->link; l < unit->link + unit->links; l++) {
                const int32_t other = rows->link[l].node;

                if (s->mark[other] != i)
                    graph[count++] = other;
                s->mark[other] = i;
            }
        }
        perp__sort_few(graph + starts[i], count - starts[i]);
    }
    starts[rows->nodes] = count;
}

perp_status perp__statics_order(perp__statics *s)
{
    const perp__statics_rows *rows = s->rows;
    int32_t *unit_starts = s->unit_starts, *units = s->units, *graph = s->graph;
    perp_status status;

    /* 1. Units of each node. */
    memset(unit_starts, 0, ((size_t)rows->nodes + 2) * sizeof *unit_starts);
    for (int32_t i = 0; i < rows->links; i++)
        unit_starts[rows->link[i].node + 2]++;
    for (int32_t i = 0; i < rows->nodes; i++)
        unit_starts[i + 2] += unit_starts[i + 1];
    for (int32_t u = 0; u < rows->units; u++)
        for (int32_t l = 0; l < rows->unit[u].links; l++)
            units[unit_starts[rows->link[rows->unit[u].link + l].node + 1]++] = u;

    /* 2. The graph, and the order of elimination. */
    list_neighbours(s, unit_starts, units, s->graph_starts, graph);
    status = perp__fronts_analyse(&s->fronts, s->context, rows->nodes, rows->width, s->graph_starts,
                                  graph);

    /* 3. Where each unit's blocks go. */
    for (int32_t u = 0; status == PERP_OK && !s->fronts.is_too_large && u < rows->units; u++) {
        const perp__statics_link *link = rows->link + rows->unit[u].link;
        const int32_t links = rows->unit[u].links;

        for (int32_t a = 0; a < links; a++)
            for (int32_t b = 0; b < links; b++)
                s->edge[s->unit_edge[u] + a * links + b] =
                    s->fronts.place[link[a].node] < s->fronts.place[link[b].node]
                        ? -1 /* above the diagonal: never read */
                        : perp__fronts_edge(&s->fronts, link[a].node, link[b].node);
    }
    return status == PERP_ERROR_MEMORY ? perp__fail_memory(s->context, "statics") : status;
}

/* Column c of `out` += sum_k row k of X times Y_kc, or the sizes of these terms, of `width` numbers
 * each; a body's six are four lanes and two: the compiler finds no vectors there. */
PERP__KERNEL static void add_product(int32_t columns, int32_t depth, int32_t width, bool sizes,
                                     const double *X, const double *Y, double *out)
{
    for (int32_t c = 0; c < columns; c++, out += width) {
        perp__lanes sum = {0.0};
        perp__lane_pair sum_2 = {0.0};

        for (int32_t k = 0; k < depth; k++) {
            const double *row = X + k * width, y = Y[k * columns + c];

            for (int32_t i = 0; i < width && width != 6; i++)
                out[i] += sizes ? fabs(row[i] * y) : row[i] * y;
            if (width != 6)
                continue;
            const perp__lanes four = PERP__CONST_LANES_AT(row) * y;
            const perp__lane_pair two = PERP__CONST_PAIR_AT(row + 4) * y;

            sum += sizes ? PERP__ABSOLUTE_LANES(four) : four;
            sum_2 += sizes ? (perp__lane_pair){fabs(two[0]), fabs(two[1])} : two;
        }
        if (width != 6)
            continue;
        PERP__LANES_AT(out) += sum;
        PERP__PAIR_AT(out + 4) += sum_2;
    }
}

/* K += A S^-1 A' = P P' of all units, P := A'F: of each link by coordinates, rows of F side by
 * side. width, and rows_of where the unit has as many: constants of bodies and their contacts. */
PERP__KERNEL static void assemble_units(const perp__statics *s, int32_t width, int32_t rows_of)
{
    const perp__statics_rows *rows = s->rows;
    const size_t square = (size_t)width * (size_t)width;

    for (int32_t u = 0; u < rows->units; u++) {
        const perp__statics_unit *unit = &rows->unit[u];
        const int32_t n = rows_of > 0 && unit->rows == rows_of ? rows_of : unit->rows;
        const size_t size = (size_t)n * (size_t)width;
        const int32_t *edge = s->edge + s->unit_edge[u];

        if (s->idle[u])
            continue;
        memset(s->P, 0, (size_t)unit->links * size * sizeof *s->P);
        for (int32_t a = 0; a < unit->links; a++)
            add_product(n, n, width, 0, rows->values + rows->link[unit->link + a].at,
                        s->F + s->square[u], s->P + (size_t)a * size);
        for (int32_t pair = 0; pair < unit->links * unit->links; pair++)
            if (edge[pair] >= 0)
                add_product(width, n, width, 0, s->P + (size_t)(pair / unit->links) * size,
                            s->P + (size_t)(pair % unit->links) * size,
                            s->fronts.values + (size_t)edge[pair] * square);
    }
}

PERP__MULTIVERSION(assemble_bodies, (const perp__statics *s), (s))
{
    assemble_units(s, 6, 3);
}

static double *diagonal_of(const perp__statics *s, int32_t node, int32_t i)
{
    const size_t width = (size_t)s->rows->width;
    const size_t edge = (size_t)perp__fronts_edge(&s->fronts, node, node);

    return s->fronts.values + edge * width * width + (size_t)i * (width + 1);
}

int32_t perp__statics_factor(perp__statics *s)
{
    const perp__statics_rows *rows = s->rows;
    const int32_t width = rows->width;
    const size_t square = (size_t)width * (size_t)width;
    double most = 0.0;

    s->iterations++;
    s->factored = 0;
    if (s->doubled)
        return perp__statics_factor_doubled(s);
    memset(s->fronts.values, 0, (size_t)s->fronts.starts[rows->nodes] * square * sizeof(double));
    if (width == 6)
        assemble_bodies(s);
    else
        assemble_units(s, width, 0);
    for (int32_t node = 0; node < rows->nodes; node++)
        for (int32_t i = 0; i < width; i++)
            most = fmax(most, *diagonal_of(s, node, i));
    for (int32_t node = 0; node < rows->nodes; node++) {
        const double *reach = s->reach + node * width;
        const double least = PERP__BALANCED_AT_BEST * perp__largest(reach, width);

        for (int32_t i = 0; i < width; i++) { /* entries of rounding count as none */
            double *entry = diagonal_of(s, node, i);
            const double size = *entry, reached = reach[i] > least ? size : 0.0;

            *entry += PERP__RIDGE * (reached > 0.0 ? reached : most > 0.0 ? most : 1.0);
            s->shift[node * width + i] = *entry - size;
        }
    }
    return perp__fronts_factor(&s->fronts, 0, rows->nodes);
}

void perp__statics_solve(perp__statics *s, double *x, double *low)
{
    if (s->doubled) {
        perp__statics_solve_doubled(s, x, low);
    } else {
        perp__fronts_solve(&s->fronts, 0, s->rows->nodes, x);
        memset(low, 0, perp__statics_numbers(s) * sizeof *low);
    }
}

PERP__KERNEL static double dot(int32_t n, const double *a, const double *b)
{
    double sum = 0.0;

    if (n == 6) {
        const perp__lanes four = PERP__CONST_LANES_AT(a) * PERP__CONST_LANES_AT(b);
        const perp__lane_pair two = PERP__CONST_PAIR_AT(a + 4) * PERP__CONST_PAIR_AT(b + 4);

        return ((four[0] + four[2]) + two[0]) + ((four[1] + four[3]) + two[1]);
    }
    for (int32_t i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

#define SIZED(kernel, s, unit, ...) \
    PERP__WITH_SHAPE(kernel, (s)->rows->width, (unit)->rows, __VA_ARGS__)

/* to += factor A x, and terms, unless NULL, their sizes. */
PERP__KERNEL static void add_rows(int32_t width, int32_t rows, const perp__statics *s,
                                  const perp__statics_unit *unit, double factor, const double *x,
                                  double *to, double *terms)
{
    double y[PERP__STATICS_MOST_ROWS];

    for (int32_t k = 0; k < rows; k++)
        y[k] = factor * x[k];
    for (int32_t l = unit->link; l < unit->link + unit->links; l++) {
        const size_t first = (size_t)(s->rows->link[l].node * width);
        const double *A = s->rows->values + s->rows->link[l].at;

        add_product(1, rows, width, 0, A, y, to + first);
        if (terms)
            add_product(1, rows, width, 1, A, y, terms + first);
    }
}

/* out := A'y */
PERP__KERNEL static void take_rows(int32_t width, int32_t rows, const perp__statics *s,
                                   const perp__statics_unit *unit, const double *y, double *out)
{
    for (int32_t k = 0; k < rows; k++)
        out[k] = 0.0;
    for (int32_t l = unit->link; l < unit->link + unit->links; l++) {
        const double *at = y + s->rows->link[l].node * width;
        const double *A = s->rows->values + s->rows->link[l].at;

        for (int32_t k = 0; k < rows; k++)
            out[k] += dot(width, A + k * width, at);
    }
}

PERP__MULTIVERSION_SHARED(perp__statics_meet,
                          (const perp__statics *s, const double *y, double *out), (s, y, out))
{
    for (int32_t u = 0; u < s->rows->units; u++)
        SIZED(take_rows, s, &s->rows->unit[u], s, &s->rows->unit[u], y, out + s->rows->unit[u].row);
}

/* out := F F' p */
PERP__KERNEL static void apply_inverse(int32_t width, int32_t rows, const double *F,
                                       const double *p, double *out)
{
    double q[PERP__STATICS_MOST_ROWS];

    (void)width;
    for (int32_t j = 0; j < rows; j++) {
        q[j] = 0.0;
        for (int32_t k = 0; k < rows; k++)
            q[j] += F[k * rows + j] * p[k];
    }
    for (int32_t i = 0; i < rows; i++)
        out[i] = dot(rows, F + i * rows, q);
}

PERP__MULTIVERSION(push_all,
                   (const perp__statics *s, double factor, int32_t inverse, const double *p,
                    double *to),
                   (s, factor, inverse, p, to))
{
    for (int32_t u = 0; u < s->rows->units; u++) {
        const perp__statics_unit *unit = &s->rows->unit[u];
        double out[PERP__STATICS_MOST_ROWS];

        if (inverse && s->idle[u])
            continue;
        if (inverse)
            SIZED(apply_inverse, s, unit, s->F + s->square[u], p + unit->row, out);
        SIZED(add_rows, s, unit, s, unit, factor, inverse ? out : p + unit->row, to, NULL);
    }
}

/* x += S^-1 A'dy where it corrects, left -= A x and terms, unless NULL, += |A| |x|, in one pass
 * over A. */
PERP__MULTIVERSION(balance_all,
                   (const perp__statics *s, int32_t corrects, double *left, double *terms),
                   (s, corrects, left, terms))
{
    for (int32_t u = 0; u < s->rows->units; u++) {
        const perp__statics_unit *unit = &s->rows->unit[u];
        double *x = s->x + unit->row, q[PERP__STATICS_MOST_ROWS], dx[PERP__STATICS_MOST_ROWS];

        if (corrects && !s->idle[u]) {
            SIZED(take_rows, s, unit, s, unit, s->dy, q);
            SIZED(apply_inverse, s, unit, s->F + s->square[u], q, dx);
            for (int32_t k = 0; k < unit->rows; k++)
                x[k] += dx[k];
        }
        if (!s->idle[u] || x[0] != 0.0) /* else it carries nothing */
            SIZED(add_rows, s, unit, s, unit, -1.0, x, left, terms);
    }
}

void perp__statics_balance(perp__statics *s, bool corrects)
{
    const size_t n = perp__statics_numbers(s), size = (size_t)s->rows->size;

    if (corrects) {
        memcpy(s->dy, s->rb, n * sizeof *s->dy);
        memcpy(s->dy_low, s->rb_low, n * sizeof *s->dy);
        perp__statics_solve(s, s->dy, s->dy_low);
    }
    if (corrects && s->doubled) {
        memset(s->p, 0, size * sizeof *s->p);
        perp__statics_pull_doubled(s, s->p, s->dy, s->dy_low, s->dx);
        for (size_t i = 0; i < size; i++)
            s->x[i] += s->dx[i];
    }
    for (size_t i = 0; i < n; i++) {
        s->rb[i] = s->b[i];
        s->rb_low[i] = 0.0;
        s->terms[i] = s->factored ? s->terms[i] : fabs(s->b[i]); /* of base */
    }
    balance_all(s, corrects && !s->doubled, s->doubled ? s->dy : s->rb,
                s->factored ? NULL : s->terms);
    if (s->doubled)
        perp__statics_push_doubled(s, -1.0, 0, s->x, s->rb, s->rb_low);
}

void perp__statics_push(perp__statics *s, double factor, int32_t inverse, const double *p,
                        double *to, double *low)
{
    if (s->doubled)
        perp__statics_push_doubled(s, factor, inverse, p, to, low);
    else
        push_all(s, factor, inverse, p, to);
}

void perp__statics_pull(perp__statics *s, const double *p, const double *dy, const double *dy_low,
                        double *dx)
{
    perp__statics_meet(s, dy, s->met);
    if (s->doubled) {
        perp__statics_pull_doubled(s, p, dy, dy_low, dx);
        return;
    }
    for (int32_t u = 0; u < s->rows->units; u++) {
        const int32_t row = s->rows->unit[u].row, rows = s->rows->unit[u].rows;
        double q[PERP__STATICS_MOST_ROWS];

        for (int32_t k = 0; k < rows; k++)
            dx[row + k] = q[k] = s->idle[u] ? 0.0 : s->met[row + k] + p[row + k];
        if (!s->idle[u])
            apply_inverse(0, rows, s->F + s->square[u], q, dx + row);
    }
}
