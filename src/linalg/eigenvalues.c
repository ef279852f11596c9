/* Balancing, reduction to Hessenberg form by elimination, and Francis' double-shift QR iteration:
 * routines balanc, elmhes and hqr of Wilkinson & Reinsch, "Handbook for Automatic Computation II"
 * (1971), as in EISPACK. */
#include "linalg/eigenvalues.h"

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

/* Scales a row by 1/f and its column by f, f a power of two that brings their norms together.
 * Returns whether that was worth it. */
static int32_t balance_row(const square *A, int32_t i)
{
    double row = 0.0, column = 0.0, f;

    for (int32_t j = 0; j < A->n; j++)
        if (j != i) {
            row += fabs(*at(A, i, j));
            column += fabs(*at(A, j, i));
        }
    if (!(row > 0.0 && column > 0.0 && row + column <= DBL_MAX))
        return 0;
    f = ldexp(1.0, balancing_exponent(row, column));
    if (!(row / f + column * f < 0.95 * (row + column)) || !isfinite(f) || f <= DBL_MIN)
        return 0;
    for (int32_t j = 0; j < A->n; j++)
        *at(A, i, j) /= f;
    for (int32_t j = 0; j < A->n; j++)
        *at(A, j, i) *= f;
    return 1;
}

static void balance(const square *A)
{
    int32_t round, i, changed = 1;

    for (round = 0; changed && round < 100; round++)
        for (i = 0, changed = 0; i < A->n; i++)
            changed |= balance_row(A, i);
}

static void exchange(const square *A, int32_t m, int32_t p)
{
    for (int32_t j = m - 1; j < A->n; j++) {
        const double kept = *at(A, p, j);

        *at(A, p, j) = *at(A, m, j);
        *at(A, m, j) = kept;
    }
    for (int32_t j = 0; j < A->n; j++) {
        const double kept = *at(A, j, p);

        *at(A, j, p) = *at(A, j, m);
        *at(A, j, m) = kept;
    }
}

static void to_hessenberg(const square *A)
{
    int32_t i, p;

    for (int32_t m = 1; m < A->n - 1; m++) {
        for (p = m, i = m + 1; i < A->n; i++)
            if (fabs(*at(A, i, m - 1)) > fabs(*at(A, p, m - 1)))
                p = i;
        if (p != m)
            exchange(A, m, p);
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

/* Eigenvalues of the 2 by 2 block that ends at `last`. */
static void pair(const square *A, int32_t last, double shift, double *real, double *imaginary)
{
    const double x = *at(A, last, last), y = *at(A, last - 1, last - 1);
    const double w = *at(A, last, last - 1) * *at(A, last - 1, last);
    const double p = 0.5 * (y - x), q = p * p + w, root = sqrt(fabs(q));

    if (q >= 0.0) {
        const double z = p + copysign(root, p);

        real[last - 1] = x + shift + z;
        real[last] = z != 0.0 ? x + shift - w / z : real[last - 1];
        imaginary[last - 1] = imaginary[last] = 0.0;
    } else {
        real[last - 1] = real[last] = x + shift + p;
        imaginary[last - 1] = root;
        imaginary[last] = -root;
    }
}

typedef struct bulge {
    double p, q, r;
} bulge;

/* Where two successive small entries below the diagonal allow the sweep to start. */
static int32_t sweep_start(const square *A, int32_t l, int32_t last, double x, double y, double w,
                           bulge *b)
{
    int32_t m;

    for (m = last - 2; m >= l; m--) {
        const double z = *at(A, m, m), r = x - z, s = y - z;
        double size, u, v;

        b->p = (r * s - w) / *at(A, m + 1, m) + *at(A, m, m + 1);
        b->q = *at(A, m + 1, m + 1) - z - r - s;
        b->r = *at(A, m + 2, m + 1);
        size = fabs(b->p) + fabs(b->q) + fabs(b->r);
        b->p /= size;
        b->q /= size;
        b->r /= size;
        if (m == l)
            break;
        u = fabs(*at(A, m, m - 1)) * (fabs(b->q) + fabs(b->r));
        v = fabs(b->p) * (fabs(*at(A, m - 1, m - 1)) + fabs(z) + fabs(*at(A, m + 1, m + 1)));
        if (u <= DBL_EPSILON * v)
            break;
    }
    return m;
}

/* Applies the reflection (1, q, r) to the rows and columns k, k + 1 and, if `three`, k + 2. */
static void reflect(const square *A, int32_t k, int32_t l, int32_t last, int32_t three, double s,
                    bulge *b)
{
    const double p0 = b->p + s, x = p0 / s, y = b->q / s, z = b->r / s;
    const double q = b->q / p0, r = b->r / p0;
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

/* One double-shift QR step on rows l to last. */
static void sweep(const square *A, int32_t l, int32_t last, double x, double y, double w)
{
    bulge b = {0.0, 0.0, 0.0};
    const int32_t m = sweep_start(A, l, last, x, y, w, &b);

    for (int32_t i = m + 2; i <= last; i++) {
        *at(A, i, i - 2) = 0.0;
        if (i != m + 2)
            *at(A, i, i - 3) = 0.0;
    }
    for (int32_t k = m; k < last; k++) {
        const int32_t three = k != last - 1;
        double size = 0.0, s;

        if (k != m) {
            b.p = *at(A, k, k - 1);
            b.q = *at(A, k + 1, k - 1);
            b.r = three ? *at(A, k + 2, k - 1) : 0.0;
            size = fabs(b.p) + fabs(b.q) + fabs(b.r);
            if (size == 0.0)
                continue;
            b.p /= size;
            b.q /= size;
            b.r /= size;
        }
        s = copysign(sqrt(b.p * b.p + b.q * b.q + b.r * b.r), b.p);
        if (s == 0.0)
            continue;
        if (k != m)
            *at(A, k, k - 1) = -s * size;
        else if (l != m)
            *at(A, k, k - 1) = -*at(A, k, k - 1);
        reflect(A, k, l, last, three, s, &b);
    }
}

static int32_t iterate(const square *A, double norm, double *real, double *imaginary)
{
    int32_t last = A->n - 1, rounds = 0, i;
    double shift = 0.0;

    while (last >= 0) {
        const int32_t l = block_start(A, last, norm);

        if (l >= last - 1) {
            if (l == last) {
                real[last] = *at(A, last, last) + shift;
                imaginary[last] = 0.0;
            } else {
                pair(A, last, shift, real, imaginary);
            }
            last = l - 1;
            rounds = 0;
        } else {
            double x = *at(A, last, last), y = *at(A, last - 1, last - 1);
            double w = *at(A, last, last - 1) * *at(A, last - 1, last);

            if (++rounds > 90)
                return 1;
            if (rounds % 10 == 0) { /* the shifts go round in circles: others */
                const double s = fabs(*at(A, last, last - 1)) + fabs(*at(A, last - 1, last - 2));

                shift += x;
                for (i = 0; i <= last; i++)
                    *at(A, i, i) -= x;
                x = y = 0.75 * s;
                w = -0.4375 * s * s;
            }
            sweep(A, l, last, x, y, w);
        }
    }
    return 0;
}

/* Where products of a few entries might leave the range of doubles, A := A / 2^e with a largest
 * entry in [1/2, 1). Returns e, else 0. */
static int32_t scale(const square *A)
{
    const size_t entries = (size_t)A->n * (size_t)A->n;
    int exponent;

    frexp(perp__largest_or_nan(A->a, A->n * A->n), &exponent);
    if (abs(exponent) < 200)
        return 0;
    for (size_t k = 0; k < entries; k++)
        A->a[k] = ldexp(A->a[k], -exponent);
    return exponent;
}

int32_t perp__eigenvalues(int32_t n, double *A, double *real, double *imaginary)
{
    const square view = {n, A};
    double norm = 0.0;
    int32_t failed = !isfinite(perp__largest_or_nan(view.a, view.n * view.n)), exponent = 0, i, j;

    if (!failed) {
        balance(&view);
        exponent = scale(&view);
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
