/* The same equations in doubled precision, for where doubles cannot tell: a margin of 1e-9 makes K
 * of numbers 1 and 1e-18. Double-double arithmetic (Dekker, Numer. Math. 18 (1971) 224) with fma();
 * Cholesky's factors in an envelope: row after row, each from its first neighbour on, in the order
 * of the fronts. */
#include <math.h>
#include <string.h>

#include "contact/statics/interior.h"

/* Products of a factorisation up to which doubled precision is tried: some 20 ms. */
#define MOST_PRODUCTS 1.5e6

/* A product in doubled precision takes about as long as so many in doubles. */
#define DOUBLED_PRODUCT 20.0

/* A pivot beside its diagonal entry that is none: its coordinate is one that nothing pushes, or a
 * combination of others, and stays 0: what is nothing beside what doubles come to at best. Margins
 * of 1e-13 have pivots of 1e-26. */
#define NONE (PERP__BALANCED * PERP__BALANCED_AT_BEST)

typedef perp__pair pair;

static inline pair join(double high, double low)
{
    const double sum = high + low;
    return (pair){sum, low - (sum - high)};
}

static inline pair add(pair a, pair b)
{
    const double sum = a.high + b.high, part = sum - a.high;
    const double error = (a.high - (sum - part)) + (b.high - part);

    return join(sum, error + (a.low + b.low));
}

static inline pair times(pair a, pair b)
{
    const double product = a.high * b.high;

    return join(product, fma(a.high, b.high, -product) + (a.high * b.low + a.low * b.high));
}

static inline pair single(double x)
{
    return (pair){x, 0.0};
}

/* sum - a b */
static inline pair less(pair sum, pair a, pair b)
{
    return add(sum, times((pair){-a.high, -a.low}, b));
}

static inline pair ratio(pair a, pair b)
{
    const double q = a.high / b.high;

    return join(q, less(a, single(q), b).high / b.high);
}

static inline pair root(pair a)
{
    const double r = sqrt(a.high);

    return join(r, r > 0.0 ? 0.5 * less(a, single(r), single(r)).high / r : 0.0);
}

/* ---- the envelope ---- */

static void lay_out(perp__arena *arena, void *object)
{
    perp__statics *s = object;
    const size_t n = (size_t)(s->rows->nodes * s->rows->width);

    s->first = perp__arena_take(arena, n, sizeof *s->first);
    s->starts = perp__arena_take(arena, n + 1, sizeof *s->starts);
    s->L = perp__arena_take(arena, s->envelope, sizeof *s->L);
    s->ordered = perp__arena_take(arena, n, sizeof *s->ordered);
}

/* The first place, of nodes, that the node at `place` is coupled with. */
static int32_t first_place(const perp__statics *s, int32_t place)
{
    const perp__fronts *f = &s->fronts;
    const int32_t node = f->order[place];
    int32_t first = place;

    for (int32_t e = f->starts[node]; e < f->starts[node + 1]; e++)
        if (f->place[f->neighbours[e]] < first)
            first = f->place[f->neighbours[e]];
    return first;
}

perp_status perp__statics_go_doubled(perp__statics *s, int32_t *goes)
{
    const int32_t width = s->rows->width, n = s->rows->nodes * width;
    double products = 0.0, most = MOST_PRODUCTS;
    perp_status status;

    *goes = 0;
    s->envelope = 0;
    for (int32_t i = 0; i < n; i++) {
        const int32_t first = first_place(s, i / width);
        const double row = width * (double)(i / width - first + 1);

        products += 0.5 * row * row;
        s->envelope += (size_t)(i - width * first + 1);
    }
    if (s->fronts.most_products > 0.0)
        most = fmin(most, s->fronts.most_products / DOUBLED_PRODUCT);
    if (s->doubled || !(products <= most))
        return PERP_OK;
    status = perp__arena_fit(&s->doubled_arena, s->context, lay_out, s);
    for (int32_t i = 0; status == PERP_OK && i < n; i++) {
        s->first[i] = width * first_place(s, i / width);
        s->starts[i] = i == 0 ? 0 : s->starts[i - 1] + (size_t)(i - s->first[i - 1]);
    }
    s->doubled = *goes = status == PERP_OK;
    return status;
}

/* Entry (i, j), j <= i, is at row_of(i) + j. */
static size_t row_of(const perp__statics *s, int32_t i)
{
    return s->starts[i] - (size_t)s->first[i];
}

/* The column j of A_l' F. */
static pair factor_entry(const perp__statics *s, const perp__statics_unit *unit, int32_t u,
                         const perp__statics_link *link, int32_t i, int32_t j)
{
    const double *F = s->F + s->square[u], *A = s->rows->values + link->at;
    pair sum = {0.0, 0.0};

    for (int32_t k = 0; k < unit->rows; k++)
        sum = add(sum, times(single(A[k * s->rows->width + i]), single(F[k * unit->rows + j])));
    return sum;
}

/* K += A_from F F' A_to', of what is not above the diagonal. */
static void add_block(perp__statics *s, int32_t u, const perp__statics_link *from,
                      const perp__statics_link *to)
{
    const perp__statics_unit *unit = &s->rows->unit[u];
    const int32_t width = s->rows->width;
    const int32_t row = width * s->fronts.place[from->node];
    const int32_t column = width * s->fronts.place[to->node];

    for (int32_t k = 0; k < unit->rows && column <= row; k++)
        for (int32_t i = 0; i < width; i++) {
            const pair P = factor_entry(s, unit, u, from, i, k);
            pair *L = s->L + row_of(s, row + i) + column;

            for (int32_t j = 0; j < width && column + j <= row + i; j++)
                L[j] = add(L[j], times(P, factor_entry(s, unit, u, to, j, k)));
        }
}

bool perp__statics_factor_doubled(perp__statics *s)
{
    const int32_t width = s->rows->width, n = s->rows->nodes * width;

    /* 1. K's lower triangle. */
    memset(s->L, 0, s->envelope * sizeof *s->L);
    for (int32_t u = 0; u < s->rows->units; u++) {
        const perp__statics_unit *unit = &s->rows->unit[u];

        for (int32_t ab = 0; ab < unit->links * unit->links && !s->idle[u]; ab++)
            add_block(s, u, &s->rows->link[unit->link + ab / unit->links],
                      &s->rows->link[unit->link + ab % unit->links]);
    }

    /* 2. Its factors, row after row. */
    for (int32_t i = 0; i < n; i++) {
        pair *Li = s->L + row_of(s, i);
        const double size = Li[i].high;

        for (int32_t j = s->first[i]; j <= i; j++) {
            const pair *Lj = s->L + row_of(s, j);
            pair sum = Li[j];

            for (int32_t k = s->first[i] > s->first[j] ? s->first[i] : s->first[j]; k < j; k++)
                sum = less(sum, Li[k], Lj[k]);
            Li[j] = j < i                    ? ratio(sum, Lj[j])
                    : sum.high > NONE * size ? root(sum)
                                             : single(1.0 / NONE);
        }
        if (!isfinite(Li[i].high))
            return 0;
    }
    return 1;
}

void perp__statics_solve_doubled(perp__statics *s, double *x, double *low)
{
    const int32_t width = s->rows->width, n = s->rows->nodes * width;
    pair *ordered = s->ordered; /* in the order of elimination */

    for (int32_t i = 0; i < n; i++) {
        const size_t at = (size_t)(s->fronts.order[i / width] * width + i % width);
        const pair *L = s->L + row_of(s, i);

        ordered[i] = (pair){x[at], low[at]};
        for (int32_t k = s->first[i]; k < i; k++)
            ordered[i] = less(ordered[i], L[k], ordered[k]);
        ordered[i] = ratio(ordered[i], L[i]);
    }
    for (int32_t i = n - 1; i >= 0; i--) {
        const size_t at = (size_t)(s->fronts.order[i / width] * width + i % width);
        const pair *L = s->L + row_of(s, i);

        ordered[i] = ratio(ordered[i], L[i]);
        x[at] = ordered[i].high;
        low[at] = ordered[i].low;
        for (int32_t k = s->first[i]; k < i; k++)
            ordered[k] = less(ordered[k], L[k], ordered[i]);
    }
}

/* ---- products ---- */

static void apply_inverse(const perp__statics *s, int32_t u, pair *x)
{
    const int32_t rows = s->rows->unit[u].rows;
    const double *F = s->F + s->square[u];
    pair q[PERP__STATICS_MOST_ROWS];

    for (int32_t j = 0; j < rows; j++) {
        q[j] = single(0.0);
        for (int32_t k = 0; k < rows; k++)
            q[j] = add(q[j], times(single(F[k * rows + j]), x[k]));
    }
    for (int32_t i = 0; i < rows; i++) {
        x[i] = single(0.0);
        for (int32_t j = 0; j < rows; j++)
            x[i] = add(x[i], times(single(F[i * rows + j]), q[j]));
    }
}

void perp__statics_push_doubled(perp__statics *s, double factor, int32_t inverse, const double *p,
                                double *to, double *low)
{
    const int32_t width = s->rows->width;

    for (int32_t u = 0; u < s->rows->units; u++) {
        const perp__statics_unit *unit = &s->rows->unit[u];
        pair x[PERP__STATICS_MOST_ROWS];

        if (inverse && s->idle[u])
            continue;
        for (int32_t k = 0; k < unit->rows; k++)
            x[k] = single(factor * p[unit->row + k]);
        if (inverse)
            apply_inverse(s, u, x);
        for (int32_t l = unit->link; l < unit->link + unit->links; l++) {
            const double *A = s->rows->values + s->rows->link[l].at;

            for (int32_t i = 0; i < width; i++) {
                const size_t at = (size_t)(s->rows->link[l].node * width + i);
                pair sum = {to[at], low[at]};

                for (int32_t k = 0; k < unit->rows; k++)
                    sum = add(sum, times(x[k], single(A[k * width + i])));
                to[at] = sum.high;
                low[at] = sum.low;
            }
        }
    }
}

void perp__statics_pull_doubled(perp__statics *s, const double *p, const double *dy,
                                const double *dy_low, double *dx)
{
    const int32_t width = s->rows->width;

    for (int32_t u = 0; u < s->rows->units; u++) {
        const perp__statics_unit *unit = &s->rows->unit[u];
        pair q[PERP__STATICS_MOST_ROWS];

        for (int32_t k = 0; k < unit->rows; k++)
            q[k] = single(s->idle[u] ? 0.0 : p[unit->row + k]);
        for (int32_t l = 0; l < unit->links && !s->idle[u]; l++) {
            const perp__statics_link *link = &s->rows->link[unit->link + l];

            for (int32_t i = 0; i < unit->rows * width; i++) {
                const size_t at = (size_t)(link->node * width + i % width);

                q[i / width] =
                    add(q[i / width], times(single(s->rows->values[link->at + (size_t)i]),
                                            (pair){dy[at], dy_low[at]}));
            }
        }
        if (!s->idle[u])
            apply_inverse(s, u, q);
        for (int32_t k = 0; k < unit->rows; k++)
            dx[unit->row + k] = q[k].high;
    }
}
