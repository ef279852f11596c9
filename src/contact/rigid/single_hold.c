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

/* Pivots of P'P beside its largest: far above the squares of RANK_TOLERANCE, whatever the rows'
 * lengths. */
#define FULL 1e-6

/* Rows that hold, at length 1 (others are 0), and the velocities they are to have. */
typedef struct held {
    lane_rows rows;
    lane_numbers targets, squares;
} held;

/* The velocities along them are those without what they push. */
PERP__KERNEL static void gather(const perp__single *s, double (*scale)[AXES][LANES],
                                const double *loose, held *h, int32_t n)
{
    for (int32_t g = 0; g < s->groups; g++)
        for (int32_t a = 0; a < s->axes; a++) {
            const perp__lanes factor = PERP__CONST_LANES_AT(scale[g][a]);
            perp__lanes sum = PERP__CONST_LANES_AT(s->drift[g][a]), square = {0.0};

            for (int32_t i = 0; i < n; i++) {
                const perp__lanes P = PERP__CONST_LANES_AT(s->P[g][a][i]), row = factor * P;

                sum += P * PERP__SAME_LANES(loose[i]);
                square += row * row;
                PERP__LANES_AT(h->rows[g][a][i]) = row;
            }
            PERP__LANES_AT(h->targets[g][a]) = -factor * sum;
            PERP__LANES_AT(h->squares[g][a]) = square;
        }
}

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

/* Takes what the basis has of it out of its newest vector for the second time, where little was
 * left of that; and the same out of its target. */
PERP__KERNEL static double take_again(perp__single *s, const double *move, double target, int32_t n)
{
    double *b = s->basis[s->rank];

    for (int32_t k = 0; k < s->rank; k++) {
        const double share = dot(s->basis[k], b, n);

        for (int32_t i = 0; i < n; i++)
            b[i] -= share * s->basis[k][i];
        target -= share * dot(s->basis[k], move, n);
    }
    return target;
}

/* The row picked becomes the newest of the basis. Returns its target over its length. */
PERP__KERNEL static double take(perp__single *s, const held *h, int32_t pick, const double *move,
                                int32_t n)
{
    const int32_t g = pick / AXES / LANES, a = pick % AXES, l = pick / AXES % LANES;
    const double(*row)[LANES] = h->rows[g][a];
    double *b = s->basis[s->rank], target = h->targets[g][a][l], square = h->squares[g][a][l];

    PERP__LANES_AT(b) =
        (perp__lanes){row[0][l], row[1][l], row[2][l], n == WIDTH ? row[3][l] : 0.0};
    if (n == WIDTH)
        PERP__LANES_AT(b + LANES) = (perp__lanes){row[4][l], row[5][l], 0.0, 0.0};
    if (square < LITTLE * LITTLE) {
        target = take_again(s, move, target, n);
        square = dot(b, b, n);
    }
    square = sqrt(square);
    for (int32_t i = 0; i < n; i += LANES)
        PERP__LANES_AT(b + i) /= PERP__SAME_LANES(square);
    return target / square;
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
        const double target = take(s, h, pick, move, n);

        for (int32_t i = 0; i < n; i += LANES)
            PERP__LANES_AT(move + i) +=
                PERP__SAME_LANES(target) * PERP__CONST_LANES_AT(s->basis[s->rank] + i);
        for (int32_t g = 0; g < s->groups && s->rank + 1 < n; g++)
            reduce(s, h, g, pick, target, n);
    }
}

/* What the basis has of the rows of C from `at` on, side by side, and what it leaves of them. */
PERP__KERNEL static void find_left(const perp__single *s, int32_t at, double *left, double *whole,
                                   int32_t n)
{
    perp__lanes part[WIDTH], square = {0.0}, rest = {0.0};

    for (int32_t k = 0; k < s->rank; k++) {
        part[k] = PERP__SAME_LANES(0.0);
        for (int32_t j = 0; j < n; j++)
            part[k] += PERP__SAME_LANES(s->basis[k][j]) * PERP__CONST_LANES_AT(s->columns[j] + at);
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

/* v = v_free + C move, and exactly 0.0 the coordinates that the rows that hold determine, as in
 * hold.c: those of whose rows of C the basis leaves nothing. */
PERP__KERNEL static void move_body(perp__single *s, const double *move, int32_t n)
{
    double whole[ROOM], left[ROOM];

    memset(s->v, 0, sizeof s->v);
    if (s->rank == n)
        return;
    memcpy(s->v, s->problem->free, (size_t)n * sizeof *s->v);
    for (int32_t at = 0; at < n; at += LANES) {
        perp__lanes go = {0.0};

        for (int32_t j = 0; j < n; j++)
            go += PERP__CONST_LANES_AT(s->columns[j] + at) * PERP__SAME_LANES(move[j]);
        PERP__LANES_AT(s->v + at) += go;
        find_left(s, at, left, whole, n);
    }
    for (int32_t i = 0; i < n; i++)
        if (s->v[i] == 0.0 || left[i] <= SPAN * SPAN * whole[i])
            s->v[i] = 0.0; /* never -0.0 */
}

/* u = J v + bias. */
PERP__KERNEL static void find_after(perp__single *s, int32_t n)
{
    for (int32_t g = 0; g < s->groups; g++)
        for (int32_t a = 0; a < PERP__AXES_OF(n); a++) {
            perp__lanes u = PERP__CONST_LANES_AT(s->bias[g][a]);

            for (int32_t i = 0; i < n; i++)
                u += PERP__CONST_LANES_AT(s->J[g][a][i]) * PERP__SAME_LANES(s->v[i]);
            PERP__LANES_AT(s->after[g][a]) = u;
        }
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

/* ---- all rows hold, and leave nothing ---- */

/* P'P = L D L'. Returns whether its pivots are so large that the rows pin the body beyond doubt. */
PERP__KERNEL static int32_t factorise(perp__single *s, int32_t n)
{
    double largest = 0.0;

    for (int32_t i = 0; i < n; i++)
        for (int32_t j = 0; j <= i; j++) {
            perp__lanes sum = {0.0};

            for (int32_t g = 0; g < s->groups; g++)
                for (int32_t a = 0; a < PERP__AXES_OF(n); a++)
                    sum +=
                        PERP__CONST_LANES_AT(s->P[g][a][i]) * PERP__CONST_LANES_AT(s->P[g][a][j]);
            s->gram[i][j] = perp__sum_lanes((const double *)&sum);
        }
    for (int32_t i = 0; i < n; i++)
        largest = s->gram[i][i] > largest ? s->gram[i][i] : largest;
    for (int32_t j = 0; j < n; j++) {
        for (int32_t k = 0; k < j; k++) {
            const double share = s->gram[j][k] * s->gram[k][k];

            for (int32_t i = j + 1; i < n; i++)
                s->gram[i][j] -= s->gram[i][k] * share;
            s->gram[j][j] -= s->gram[j][k] * share;
            s->gram[j][k] = share;
        }
        if (!(s->gram[j][j] > FULL * largest))
            return 0;
        s->gram[j][j] = 1.0 / s->gram[j][j];
    }
    return 1;
}

/* x := (P'P)^-1 x. */
PERP__KERNEL static void divide(const perp__single *s, double *x, int32_t n)
{
    for (int32_t i = 1; i < n; i++)
        for (int32_t k = 0; k < i; k++)
            x[i] -= s->gram[i][k] * x[k];
    for (int32_t i = 0; i < n; i++)
        x[i] *= s->gram[i][i];
    for (int32_t i = n - 1; i > 0; i--)
        for (int32_t k = 0; k < i; k++)
            x[k] -= s->gram[i][k] * x[i];
}

/* v = 0; by what velocities differ that the solution leaves. Returns 0 where that is not sure. */
PERP__KERNEL static int32_t pin(perp__single *s, double strength, int32_t n)
{
    double left[WIDTH], change = 0.0;

    for (int32_t k = 0; k < s->problem->contacts; k++)
        if (s->held[k] < s->dims[k])
            return 0;
    if (!factorise(s, n))
        return 0;
    perp__single_push(s, (const double(*)[AXES][LANES])s->u, left, NULL, NULL, n);
    divide(s, left, n);
    for (int32_t i = 0; i < n; i++)
        change += left[i] * left[i];
    memset(s->v, 0, sizeof s->v);
    memset(s->after, 0, sizeof s->after);
    s->rank = n;
    s->change = change > 0.0 ? sqrt(change) / strength : 0.0;
    return 1;
}

PERP__KERNEL static int32_t guess_width(perp__single *s, int32_t n)
{
    double way[WIDTH];

    if (!factorise(s, n))
        return 0;
    perp__single_push(s, (const double(*)[AXES][LANES])s->drift, way, NULL, NULL, n);
    divide(s, way, n);
    divide(s, way, n);
    for (int32_t g = 0; g < s->groups; g++)
        for (int32_t a = 0; a < PERP__AXES_OF(n); a++) {
            perp__lanes r = {0.0};

            for (int32_t i = 0; i < n; i++)
                r -= PERP__CONST_LANES_AT(s->P[g][a][i]) * PERP__SAME_LANES(way[i]);
            PERP__LANES_AT(s->r[g][a]) = r;
        }
    return 1;
}

PERP__MULTIVERSION(guess, (perp__single * s, int32_t *made), (s, made))
{
    *made = s->problem->width == 6 ? guess_width(s, 6) : guess_width(s, 3);
}

int32_t perp__single_guess(perp__single *s)
{
    int32_t made;

    for (int32_t k = 0; k < s->problem->contacts; k++)
        for (int32_t a = 0; a < s->dims[k]; a++)
            if (PERP__OF(s->bias, k, a) != 0.0)
                return 0;
    guess(s, &made);
    return made;
}

/* ---- some do ---- */

/* v, and the change beside the solution's velocities as a share of their terms. */
PERP__KERNEL static void hold_width(perp__single *s, int32_t n)
{
    double loose[WIDTH], move[ROOM] = {0.0}, change = 0.0, strength;
    lane_numbers scale, free;
    held h;

    strength = sort_rows(s, scale, free, n);
    if (pin(s, strength, n))
        return;
    perp__single_push(s, (const double(*)[AXES][LANES])free, loose, NULL, NULL, n);
    gather(s, scale, loose, &h, n);
    solve(s, &h, move, n);
    for (int32_t j = 0; j < n; j++) {
        move[j] += loose[j];
        change += (move[j] - s->y[j]) * (move[j] - s->y[j]);
    }
    move_body(s, move, n);
    find_after(s, n);
    s->change = change > 0.0 ? sqrt(change) / strength : 0.0;
}

PERP__MULTIVERSION_SHARED(perp__single_hold, (perp__single * s), (s))
{
    if (s->problem->width == 6)
        hold_width(s, 6);
    else
        hold_width(s, 3);
}
