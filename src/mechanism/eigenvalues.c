/* Balancing, reduction to Hessenberg form by elimination, and Francis' double-shift QR iteration:
 * routines balanc, elmhes and hqr of Wilkinson & Reinsch, "Handbook for Automatic Computation II"
 * (1971), as in EISPACK. */
#include "mechanism/eigenvalues.h"

#include <float.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>

#include "linalg/matrix.h"

typedef struct square {
    int32_t n;
    double *a;
} square;

static double *at(const square *A, int32_t i, int32_t j)
{
    return A->a + (size_t)i + (size_t)A->n * (size_t)j;
}

/* The e that brings 4^e column into [row / 2, 2 row), and is nearest to 0. On exponents: no number
 * on the way overflows, and there is nothing to iterate. */
static int32_t balancing_exponent(double row, double column)
{
    int row_exponent, column_exponent;
    const double r = frexp(row, &row_exponent), c = frexp(column, &column_exponent);
    const int up = row_exponent - 1 - column_exponent, down = column_exponent - row_exponent - 1;

    if (column < 0.5 * row)
        return up % 2 == 0 ? up / 2 + (c < r) : (up + 1) / 2;
    if (column >= 2.0 * row)
        return -(down % 2 == 0 ? down / 2 + (c >= r) : (down + 1) / 2);
    return 0;
}

/* Scales rows by 1/f and their columns by f, f powers of two that bring their norms together, as
 * long as that is worth it. */
static void balance(const square *A)
{
    int32_t changed = 1;

    for (int32_t round = 0; changed && round < 100; round++) {
        changed = 0;
        for (int32_t i = 0; i < A->n; i++) {
            double row = 0.0, column = 0.0, f;

            for (int32_t j = 0; j < A->n; j++)
                if (j != i) {
                    row += fabs(*at(A, i, j));
                    column += fabs(*at(A, j, i));
                }
            if (!(row > 0.0 && column > 0.0 && row + column <= DBL_MAX))
                continue;
            f = ldexp(1.0, balancing_exponent(row, column));
            if (!(row / f + column * f < 0.95 * (row + column)) || !isfinite(f) || f <= DBL_MIN)
                continue;
            for (int32_t j = 0; j < A->n; j++)
                *at(A, i, j) /= f;
            for (int32_t j = 0; j < A->n; j++)
                *at(A, j, i) *= f;
            changed = 1;
        }
    }
}

static void exchange(double *x, double *y)
{
    const double moved = *x;

    *x = *y;
    *y = moved;
}

static void to_hessenberg(const square *A)
{
    int32_t i, p;

    for (int32_t m = 1; m < A->n - 1; m++) {
        for (p = m, i = m + 1; i < A->n; i++)
            if (fabs(*at(A, i, m - 1)) > fabs(*at(A, p, m - 1)))
                p = i;
        for (int32_t j = m - 1; j < A->n && p != m; j++)
            exchange(at(A, p, j), at(A, m, j));
        for (int32_t j = 0; j < A->n && p != m; j++)
            exchange(at(A, j, p), at(A, j, m));
        for (i = m + 1; i < A->n && *at(A, m, m - 1) != 0.0; i++) {
            const double y = *at(A, i, m - 1) / *at(A, m, m - 1);

            *at(A, i, m - 1) = 0.0;
            if (y == 0.0)
                continue;
            for (int32_t j = m; j < A->n; j++)
                *at(A, i, j) -= y * *at(A, m, j);
            for (int32_t j = 0; j < A->n; j++)
                *at(A, j, m) += y * *at(A, j, i);
        }
    }
}

/* The first row of the block that ends at `last`: the entry left of it is as good as zero. */
static int32_t block_start(const square *A, int32_t last, double norm)
{
    int32_t l;

    for (l = last; l > 0; l--) {
        double s = fabs(*at(A, l - 1, l - 1)) + fabs(*at(A, l, l));

        if (s == 0.0)
            s = norm;
        if (fabs(*at(A, l, l - 1)) <= DBL_EPSILON * s) {
            *at(A, l, l - 1) = 0.0;
            break;
        }
    }
    return l;
}

/* Applies the reflection (1, q, r) to the rows and columns k, k + 1 and, if `three`, k + 2. b: its
 * vector before s is added to its first entry. */
static void reflect(const square *A, int32_t k, int32_t l, int32_t last, int32_t three, double s,
                    const double *b)
{
    const double p0 = b[0] + s, x = p0 / s, y = b[1] / s, z = b[2] / s;
    const double q = b[1] / p0, r = b[2] / p0;
    const int32_t bottom = last < k + 3 ? last : k + 3;

    for (int32_t j = k; j <= last; j++) {
        double p = *at(A, k, j) + q * *at(A, k + 1, j);

        if (three) {
            p += r * *at(A, k + 2, j);
            *at(A, k + 2, j) -= p * z;
        }
        *at(A, k + 1, j) -= p * y;
        *at(A, k, j) -= p * x;
    }
    for (int32_t i = l; i <= bottom; i++) {
        double p = x * *at(A, i, k) + y * *at(A, i, k + 1);

        if (three) {
            p += z * *at(A, i, k + 2);
            *at(A, i, k + 2) -= p * r;
        }
        *at(A, i, k + 1) -= p * q;
        *at(A, i, k) -= p;
    }
}

/* b := b / the sum of its sizes, which is returned; not where that is 0. */
static double normalise(double *b)
{
    const double size = fabs(b[0]) + fabs(b[1]) + fabs(b[2]);

    for (int32_t k = 0; k < 3 && size != 0.0; k++)
        b[k] /= size;
    return size;
}

/* One double-shift QR step on rows l to last. */
static void sweep(const square *A, int32_t l, int32_t last, double x, double y, double w)
{
    double b[3];
    int32_t m;

    /* 1. It starts where two successive small entries below the diagonal allow it. */
    for (m = last - 2; m >= l; m--) {
        const double z = *at(A, m, m), r = x - z, s = y - z;
        double u, v;

        b[0] = (r * s - w) / *at(A, m + 1, m) + *at(A, m, m + 1);
        b[1] = *at(A, m + 1, m + 1) - z - r - s;
        b[2] = *at(A, m + 2, m + 1);
        normalise(b);
        if (m == l)
            break;
        u = fabs(*at(A, m, m - 1)) * (fabs(b[1]) + fabs(b[2]));
        v = fabs(b[0]) * (fabs(*at(A, m - 1, m - 1)) + fabs(z) + fabs(*at(A, m + 1, m + 1)));
        if (u <= DBL_EPSILON * v)
            break;
    }
    for (int32_t i = m + 2; i <= last; i++) {
        *at(A, i, i - 2) = 0.0;
        if (i != m + 2)
            *at(A, i, i - 3) = 0.0;
    }
    /* 2. Reflections chase the bulge down. */
    for (int32_t k = m; k < last; k++) {
        const int32_t three = k != last - 1;
        double size = 0.0, s;

        if (k != m) {
            b[0] = *at(A, k, k - 1);
            b[1] = *at(A, k + 1, k - 1);
            b[2] = three ? *at(A, k + 2, k - 1) : 0.0;
            size = normalise(b);
            if (size == 0.0)
                continue;
        }
        s = copysign(sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2]), b[0]);
        if (s == 0.0)
            continue;
        if (k != m)
            *at(A, k, k - 1) = -s * size;
        else if (l != m)
            *at(A, k, k - 1) = -*at(A, k, k - 1);
        reflect(A, k, l, last, three, s, b);
    }
}

static int32_t iterate(const square *A, double norm, double *real, double *imaginary)
{
    int32_t last = A->n - 1, rounds = 0;
    double shift = 0.0;

    while (last >= 0) {
        const int32_t l = block_start(A, last, norm), before = last > 0 ? last - 1 : 0;
        double x = *at(A, last, last), y = *at(A, before, before);
        double w = *at(A, last, before) * *at(A, before, last);

        if (l == last) { /* 1. An eigenvalue is found, */
            real[last] = x + shift;
            imaginary[last] = 0.0;
        } else if (l == last - 1) { /* 2. or two, those of a block of 2 by 2. */
            const double p = 0.5 * (y - x), q = p * p + w, root = sqrt(fabs(q));

            if (q >= 0.0) {
                const double z = p + copysign(root, p);

                real[before] = x + shift + z;
                real[last] = z != 0.0 ? x + shift - w / z : real[before];
                imaginary[before] = imaginary[last] = 0.0;
            } else {
                real[before] = real[last] = x + shift + p;
                imaginary[before] = root;
                imaginary[last] = -root;
            }
        }
        if (l >= last - 1) {
            last = l - 1;
            rounds = 0;
            continue;
        }
        /* 3. Another step. */
        if (++rounds > 90)
            return 1;
        if (rounds % 10 == 0) { /* the shifts go round in circles: others */
            const double s = fabs(*at(A, last, before)) + fabs(*at(A, before, before - 1));

            shift += x;
            for (int32_t i = 0; i <= last; i++)
                *at(A, i, i) -= x;
            x = y = 0.75 * s;
            w = -0.4375 * s * s;
        }
        sweep(A, l, last, x, y, w);
    }
    return 0;
}

int32_t perp__eigenvalues(int32_t n, double *A, double *real, double *imaginary)
{
    const square view = {n, A};
    double norm = 0.0;
    int32_t failed = !isfinite(perp__largest_or_nan(A, n * n)), i, j;
    int exponent = 0;

    if (!failed) {
        balance(&view);
        /* Where products of a few entries might leave the range of doubles, A := A / 2^e with a
         * largest entry in [1/2, 1). */
        frexp(perp__largest_or_nan(A, n * n), &exponent);
        if (abs(exponent) < 200)
            exponent = 0;
        for (i = 0; i < n * n && exponent != 0; i++)
            A[i] = ldexp(A[i], -exponent);
        to_hessenberg(&view);
        for (j = 0; j < n; j++)
            for (i = 0; i < n && i <= j + 1; i++)
                norm += fabs(*at(&view, i, j));
        failed = iterate(&view, norm, real, imaginary);
    }
    for (i = 0; i < n && !failed; i++) {
        real[i] = ldexp(real[i], exponent);
        imaginary[i] = ldexp(imaginary[i], exponent);
        failed = !isfinite(real[i]) || !isfinite(imaginary[i]);
    }
    for (i = 0; i < n && failed; i++)
        real[i] = imaginary[i] = NAN;
    return failed;
}
