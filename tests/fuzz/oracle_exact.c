/* Index sets of small complementarity problems of any doubles, exactly: Cramer's rule in integers
 * of any length. */
#include <math.h>
#include <string.h>

#include "fuzz.h"
#include "oracle.h"

/* sign sum_k limb[k] 2^(32 (k + exponent)); no limb at either end is 0. */
typedef struct number {
    const uint32_t *limb;
    int32_t count, exponent, sign;
} number;

#define MOST_ROWS 7
#define LIMBS (1 << 21)

static uint32_t pool[LIMBS];
static int32_t pool_count;

static uint32_t *take(int32_t count)
{
    uint32_t *limb = pool + pool_count;

    if (count > LIMBS - pool_count)
        fuzz_fail("the oracle takes too much memory");
    memset(limb, 0, (size_t)count * sizeof *limb);
    pool_count += count;
    return limb;
}

static number trimmed(const uint32_t *limb, int32_t count, int32_t exponent, int32_t sign)
{
    while (count > 0 && limb[count - 1] == 0)
        count--;
    for (; count > 0 && limb[0] == 0; count--, exponent++)
        limb++;
    return (number){limb, count, exponent, count > 0 ? sign : 0};
}

static number of(double x)
{
    int power;
    uint64_t digits = (uint64_t)ldexp(frexp(fabs(x), &power), 53);
    int32_t exponent, shift;
    uint32_t *limb = take(3);

    power -= 53;
    exponent = (power - (power < 0 ? 31 : 0)) / 32;
    shift = power - 32 * exponent;
    limb[0] = (uint32_t)(digits << shift);
    limb[1] = (uint32_t)(digits >> (32 - shift));
    limb[2] = shift > 0 ? (uint32_t)(digits >> (64 - shift)) : 0;
    return trimmed(limb, 3, exponent, x < 0 ? -1 : 1);
}

static number times(number a, number b)
{
    uint32_t *limb = take(a.count + b.count);

    for (int32_t i = 0; i < a.count; i++) {
        uint64_t carry = 0;

        for (int32_t j = 0; j < b.count; j++) {
            carry += (uint64_t)a.limb[i] * b.limb[j] + limb[i + j];
            limb[i + j] = (uint32_t)carry;
            carry >>= 32;
        }
        limb[i + b.count] = (uint32_t)carry;
    }
    return trimmed(limb, a.count + b.count, a.exponent + b.exponent, a.sign * b.sign);
}

static uint32_t limb_at(number a, int32_t exponent)
{
    const int32_t k = exponent - a.exponent;

    return k >= 0 && k < a.count ? a.limb[k] : 0;
}

/* The sign of |a| - |b|. */
static int32_t compare_sizes(number a, number b)
{
    int32_t top = a.exponent + a.count, bottom = a.exponent;

    if (a.sign == 0 || b.sign == 0)
        return (a.sign != 0) - (b.sign != 0);
    top = b.exponent + b.count > top ? b.exponent + b.count : top;
    bottom = b.exponent < bottom ? b.exponent : bottom;
    while (--top >= bottom)
        if (limb_at(a, top) != limb_at(b, top))
            return limb_at(a, top) > limb_at(b, top) ? 1 : -1;
    return 0;
}

/* a + sign b */
static number plus(number a, int32_t sign, number b)
{
    const number larger = compare_sizes(a, b) >= 0 ? a : b;
    const number smaller = compare_sizes(a, b) >= 0 ? b : a;
    const int32_t same = a.sign == sign * b.sign;
    const int32_t bottom = a.exponent < b.exponent ? a.exponent : b.exponent;
    const int32_t count = larger.exponent + larger.count - bottom + 1;
    uint32_t *limb;
    int64_t carry = 0;

    b.sign *= sign;
    if (a.sign == 0 || b.sign == 0)
        return a.sign == 0 ? b : a;
    limb = take(count);
    for (int32_t k = 0; k < count; k++) {
        carry += limb_at(larger, bottom + k);
        carry +=
            same ? (int64_t)limb_at(smaller, bottom + k) : -(int64_t)limb_at(smaller, bottom + k);
        limb[k] = (uint32_t)(carry & 0xffffffff);
        carry = carry < 0 ? -1 : carry >> 32;
    }
    return trimmed(limb, count, bottom, compare_sizes(a, b) >= 0 ? a.sign : b.sign);
}

/* minors[s] := the minor of the first |s| rows and the columns of set s; T: m by m + 1. */
static void find_minors(int32_t m, number (*T)[MOST_ROWS + 1], number *minors)
{
    minors[0] = of(1.0);
    for (int32_t s = 1; s < 1 << (m + 1); s++) {
        int32_t row = -1, place = 0;

        for (int32_t j = 0; j <= m; j++)
            row += s >> j & 1;
        if (row >= m)
            continue;
        minors[s] = of(0.0);
        for (int32_t j = 0; j <= m; j++)
            if (s >> j & 1)
                minors[s] = plus(minors[s], (row + place++) % 2 ? -1 : 1,
                                 times(T[row][j], minors[s ^ (1 << j)]));
    }
}

/* x_i = X_i / D of the equations of an index set; D = 0 where there is not one solution. */
static number solve_set(const oracle_set *p, const int32_t *places, number *X)
{
    static number minors[1 << (MOST_ROWS + 1)];
    number T[MOST_ROWS][MOST_ROWS + 1], D;
    int32_t active[MOST_ROWS], m = 0, i, j, k;

    for (i = 0; i < p->n; i++)
        if (places[i] == PERP_PLACE_BETWEEN)
            active[m++] = i;
        else
            X[i] = of(places[i] == PERP_PLACE_LOWER ? p->lower[i] : p->upper[i]);
    for (k = 0; k < m; k++) {
        i = active[k];
        for (j = 0; j < m; j++)
            T[k][j] = of(p->M[i * p->n + active[j]]);
        T[k][m] = of(-p->q[i]);
        for (j = 0; j < p->n; j++)
            if (places[j] != PERP_PLACE_BETWEEN)
                T[k][m] = plus(T[k][m], -1, times(of(p->M[i * p->n + j]), X[j]));
    }
    find_minors(m, T, minors);
    D = minors[(1 << m) - 1];
    for (i = 0; i < p->n; i++)
        if (places[i] != PERP_PLACE_BETWEEN)
            X[i] = times(X[i], D);
    for (k = 0; k < m; k++) {
        X[active[k]] = minors[((1 << (m + 1)) - 1) ^ (1 << k)];
        X[active[k]].sign *= (m - 1 - k) % 2 ? -1 : 1;
    }
    return D;
}

/* The sign of X / D - bound. */
static int32_t side_of(number X, number D, double bound)
{
    if (isinf(bound))
        return bound < 0 ? 1 : -1;
    return D.sign * plus(X, -1, times(of(bound), D)).sign;
}

int oracle_solves(const oracle_set *p, const int32_t *places)
{
    number X[MOST_ROWS], D, w, off;
    int32_t i, j;

    pool_count = 0;
    for (i = 0; i < p->n; i++)
        if ((places[i] == PERP_PLACE_LOWER && isinf(p->lower[i])) ||
            (places[i] == PERP_PLACE_UPPER && isinf(p->upper[i])))
            return 0;
    D = solve_set(p, places, X);
    if (D.sign == 0)
        return 0;
    for (i = 0; i < p->n; i++) {
        w = times(of(p->q[i]), D);
        for (j = 0; j < p->n; j++)
            w = plus(w, 1, times(of(p->M[i * p->n + j]), X[j]));
        w.sign *= D.sign;
        if (places[i] == PERP_PLACE_BETWEEN
                ? side_of(X[i], D, p->lower[i]) < 0 || side_of(X[i], D, p->upper[i]) > 0
                : p->lower[i] < p->upper[i] && w.sign == (places[i] == PERP_PLACE_LOWER ? -1 : 1))
            return 0;
        off = plus(X[i], -1, times(of(p->z[i]), D));
        if (p->radii && isfinite(p->radii[i]) && compare_sizes(off, times(of(p->radii[i]), D)) > 0)
            return 0;
    }
    return 1;
}
