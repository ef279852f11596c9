/* The velocities of one body that what holds leaves: held.c and hold.c for contacts side by side.
 */
#include "contact/rigid/single.h"

#include <math.h>
#include <string.h>

/* As in held_rows.c and hold.c. */
#define RANK_TOLERANCE 1e-8
#define PIVOT_THRESHOLD 0.5
#define SPAN 1e-10

/* A row of which less than this is left is made orthogonal again. */
#define LITTLE 0.1

/* Rows that hold, at length 1 (others are 0), and the velocities they are to have. */
typedef struct held {
    lane_rows rows;
    lane_numbers targets, squares;
} held;

/* The first row that is long enough, normals first; -1 where none is. */
PERP__KERNEL static int32_t pick_row(const perp__single *s, const held *h)
{
    perp__lanes most = {0.0};
    double largest;

    for (int32_t g = 0; g < s->groups; g++)
        for (int32_t a = 0; a < s->axes; a++) {
            const perp__lanes square = PERP__CONST_LANES_AT(h->squares[g][a]);

            most = PERP__SELECT_LANES(square > most, square, most);
        }
    largest = most[0];
    for (int32_t l = 1; l < LANES; l++)
        largest = most[l] > largest ? most[l] : largest;
    if (!(largest > RANK_TOLERANCE * RANK_TOLERANCE))
        return -1;
    for (int32_t a = 0; a < s->axes; a++)
        for (int32_t k = 0; k < s->problem->contacts; k++)
            if (h->squares[k / LANES][a][k % LANES] >= PIVOT_THRESHOLD * PIVOT_THRESHOLD * largest)
                return AXES * k + a;
    return -1;
}

/* A sum of products, side by side. */
PERP__KERNEL static double dot(const double *a, const double *b, int32_t n)
{
    const double first = (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2];

    return n == 3 ? first : first + ((a[3] * b[3] + a[4] * b[4]) + a[5] * b[5]);
}

/* Takes the newest of the basis, which comes to `target`, out of a group's rows, and that from
 * which it was made as a whole. */
PERP__KERNEL static void reduce(const perp__single *s, held *h, int32_t g, int32_t pick,
                                double target, int32_t n)
{
    const perp__lanes lane = {0.0, 1.0, 2.0, 3.0};
    const double *b = s->basis[s->rank];

    for (int32_t a = 0; a < s->axes; a++) {
        const perp__lane_bits gone =
            lane == PERP__SAME_LANES((double)(pick % AXES == a ? pick / AXES - LANES * g : -1));
        perp__lanes share = {0.0}, square = {0.0}, other = {0.0};

        for (int32_t i = 0; i < n; i += 3) {
            share += PERP__SAME_LANES(b[i]) * PERP__CONST_LANES_AT(h->rows[g][a][i]) +
                     PERP__SAME_LANES(b[i + 1]) * PERP__CONST_LANES_AT(h->rows[g][a][i + 1]);
            other += PERP__SAME_LANES(b[i + 2]) * PERP__CONST_LANES_AT(h->rows[g][a][i + 2]);
        }
        share += other;
        other = PERP__SAME_LANES(0.0);
        for (int32_t i = 0; i < n; i++) {
            const perp__lanes left =
                PERP__CONST_LANES_AT(h->rows[g][a][i]) - share * PERP__SAME_LANES(b[i]);
            const perp__lanes row = PERP__SELECT_LANES(gone, PERP__SAME_LANES(0.0), left);

            PERP__LANES_AT(h->rows[g][a][i]) = row;
            if (i % 2)
                square += row * row;
            else
                other += row * row;
        }
        PERP__LANES_AT(h->targets[g][a]) -= share * PERP__SAME_LANES(target);
        PERP__LANES_AT(h->squares[g][a]) = square + other;
    }
}

/* move := the least that takes the rows to their targets; modified Gram-Schmidt. */
PERP__KERNEL static void solve(perp__single *s, held *h, double *move, int32_t n)
{
    int32_t pick;

    for (s->rank = 0; s->rank < n && (pick = pick_row(s, h)) >= 0; s->rank++) {
        const int32_t g = pick / AXES / LANES, a = pick % AXES, l = pick / AXES % LANES;
        double(*row)[LANES] = h->rows[g][a];
        double *b = s->basis[s->rank], target = h->targets[g][a][l], length = h->squares[g][a][l];

        /* 1. The row picked becomes the newest of the basis. */
        PERP__LANES_AT(b) =
            (perp__lanes){row[0][l], row[1][l], row[2][l], n == WIDTH ? row[3][l] : 0.0};
        if (n == WIDTH)
            PERP__LANES_AT(b + LANES) = (perp__lanes){row[4][l], row[5][l], 0.0, 0.0};

        /* 2. Where little is left of it, what the basis has of it is taken out for the second time,
         * and the same out of its target. */
        if (length < LITTLE * LITTLE) {
            for (int32_t k = 0; k < s->rank; k++) {
                const double share = dot(s->basis[k], b, n);

                for (int32_t i = 0; i < n; i++)
                    b[i] -= share * s->basis[k][i];
                target -= share * dot(s->basis[k], move, n);
            }
            length = dot(b, b, n);
        }
        length = sqrt(length);
        target /= length;
        for (int32_t i = 0; i < n; i += LANES) {
            PERP__LANES_AT(b + i) /= PERP__SAME_LANES(length);
            PERP__LANES_AT(move + i) += PERP__SAME_LANES(target) * PERP__CONST_LANES_AT(b + i);
        }

        /* 3. It is taken out of all rows. */
        for (int32_t group = 0; group < s->groups && s->rank + 1 < n; group++)
            reduce(s, h, group, pick, target, n);
    }
}

/* v = v_free + C move, and exactly 0.0 the coordinates that the rows that hold determine, as in
 * hold.c: those of whose rows of C the basis leaves nothing. */
PERP__KERNEL static void move_body(perp__single *s, const double *move, int32_t n)
{
    double whole[ROOM], left[ROOM];

    memset(s->v, 0, sizeof s->v);
    if (s->rank == n)
        return;
    memcpy(s->v, s->problem->free, (size_t)n * sizeof *s->v);
    for (int32_t at = 0; at < n; at += LANES) { /* rows of C side by side */
        perp__lanes part[WIDTH], go = {0.0}, square = {0.0}, rest = {0.0};

        for (int32_t j = 0; j < n; j++)
            go += PERP__CONST_LANES_AT(s->columns[j] + at) * PERP__SAME_LANES(move[j]);
        PERP__LANES_AT(s->v + at) += go;
        for (int32_t k = 0; k < s->rank; k++) {
            part[k] = PERP__SAME_LANES(0.0);
            for (int32_t j = 0; j < n; j++)
                part[k] +=
                    PERP__SAME_LANES(s->basis[k][j]) * PERP__CONST_LANES_AT(s->columns[j] + at);
        }
        for (int32_t j = 0; j < n; j++) {
            perp__lanes row = PERP__CONST_LANES_AT(s->columns[j] + at);

            square += row * row;
            for (int32_t k = 0; k < s->rank; k++)
                row -= part[k] * PERP__SAME_LANES(s->basis[k][j]);
            rest += row * row;
        }
        PERP__LANES_AT(whole + at) = square;
        PERP__LANES_AT(left + at) = rest;
    }
    for (int32_t i = 0; i < n; i++)
        if (s->v[i] == 0.0 || left[i] <= SPAN * SPAN * whole[i])
            s->v[i] = 0.0; /* never -0.0 */
}

/* The factors that make rows that hold as long as 1, and the impulses along those that do not.
 * Returns what all impulses come to, whichever way they act. */
PERP__KERNEL static double sort_rows(const perp__single *s, double (*scale)[AXES][LANES],
                                     double (*free)[AXES][LANES], int32_t n)
{
    const perp__lanes zero = {0.0}, one = PERP__SAME_LANES(1.0);
    lane_numbers strengths;
    double strength = 0.0;

    for (int32_t g = 0; g < s->groups; g++)
        for (int32_t a = 0; a < PERP__AXES_OF(n); a++) {
            const perp__lanes r = PERP__CONST_LANES_AT(s->r[g][a]);
            const perp__lanes square = PERP__CONST_LANES_AT(s->squares[g][a]);
            const perp__lanes size = PERP__ROOT_LANES(square);
            const perp__lane_bits holds =
                PERP__SAME_LANES(a) < PERP__CONST_LANES_AT(s->held + LANES * g);

            PERP__LANES_AT(strengths[g][a]) = PERP__ABSOLUTE_LANES(r) * size;
            PERP__LANES_AT(free[g][a]) = PERP__SELECT_LANES(holds, zero, r);
            PERP__LANES_AT(scale[g][a]) =
                PERP__SELECT_LANES(holds & (size > zero), one / size, zero);
        }
    for (int32_t k = 0; k < s->problem->contacts; k++)
        for (int32_t a = 0; a < s->dims[k]; a++)
            strength += PERP__OF(strengths, k, a);
    return strength;
}

/* v, after = J v + bias, and the change beside the solution's velocities as a share of their terms.
 */
PERP__KERNEL static void hold_width(perp__single *s, int32_t n)
{
    double loose[WIDTH], move[ROOM] = {0.0}, change = 0.0, strength;
    lane_numbers scale, free;
    held h;

    /* 1. Rows that hold, of length 1, and their velocities without what they push. */
    strength = sort_rows(s, scale, free, n);
    perp__single_push(s, (const double(*)[AXES][LANES])free, loose, NULL, NULL, n);
    for (int32_t g = 0; g < s->groups; g++)
        for (int32_t a = 0; a < s->axes; a++) {
            const perp__lanes factor = PERP__CONST_LANES_AT(scale[g][a]);
            perp__lanes sum = PERP__CONST_LANES_AT(s->drift[g][a]), square = {0.0};

            for (int32_t i = 0; i < n; i++) {
                const perp__lanes P = PERP__CONST_LANES_AT(s->P[g][a][i]), row = factor * P;

                sum += P * PERP__SAME_LANES(loose[i]);
                square += row * row;
                PERP__LANES_AT(h.rows[g][a][i]) = row;
            }
            PERP__LANES_AT(h.targets[g][a]) = -factor * sum;
            PERP__LANES_AT(h.squares[g][a]) = square;
        }
    /* 2. The body's velocity, and those of its contacts. */
    solve(s, &h, move, n);
    for (int32_t j = 0; j < n; j++) {
        move[j] += loose[j];
        change += (move[j] - s->y[j]) * (move[j] - s->y[j]);
    }
    move_body(s, move, n);
    for (int32_t g = 0; g < s->groups; g++)
        for (int32_t a = 0; a < PERP__AXES_OF(n); a++) {
            perp__lanes u = PERP__CONST_LANES_AT(s->bias[g][a]);

            for (int32_t i = 0; i < n; i++)
                u += PERP__CONST_LANES_AT(s->J[g][a][i]) * PERP__SAME_LANES(s->v[i]);
            PERP__LANES_AT(s->after[g][a]) = u;
        }
    s->change = change > 0.0 ? sqrt(change) / strength : 0.0;
}

PERP__MULTIVERSION_SHARED(perp__single_hold, (perp__single * s), (s))
{
    if (s->problem->width == 6)
        hold_width(s, 6);
    else
        hold_width(s, 3);
}
