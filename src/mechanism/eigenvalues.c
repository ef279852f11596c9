/* Balancing, reduction to Hessenberg form by reflections, and Francis' double-shift QR iteration
 * (Golub & Van Loan, "Matrix Computations", 4th ed., algorithms 7.4.2, 7.5.1 and 7.5.2), with the
 * balancing and shifts of Wilkinson & Reinsch, "Handbook for Automatic Computation II" (1971). */
#include "mechanism/eigenvalues.h"

#include <float.h>
#include <math.h>
#include <stddef.h>

#include "base/outcome.h"
#include "linalg/matrix.h"

typedef struct square {
    int32_t n;
    double *a;
} square;

static double *at(const square *A, int32_t i, int32_t j)
{
    return A->a + (size_t)i + (size_t)A->n * (size_t)j;
}

/* Scales rows by 1/f and their columns by f, f powers of two that bring their norms together, as
 * long as that is worth it. On exponents: no number on the way overflows. */
static void balance(const square *A)
{
    bool changed = 1;

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
            f = ldexp(1.0, (ilogb(row) - ilogb(column)) / 2); /* 4^e column is near row */
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

/* A := P A P, P the reflection in rows k to k + count - 1 that turns x into a multiple of its first
 * axis. w: count. Nothing to do where it is one: what is 0 stays so. */
static void reflect(const square *A, int32_t k, int32_t count, const double *x, double *w)
{
    double length = 0.0, rest = 0.0;

    for (int32_t l = count; l-- > 0; length = hypot(length, x[l]))
        rest = length;
    if (rest == 0.0)
        return;
    for (int32_t l = 0; l < count; l++)
        w[l] = x[l] / length;
    w[0] += copysign(1.0, w[0]); /* its square is 2 |w_0| now */
    for (int32_t i = 0; i < A->n; i++) {
        double p = 0.0;

        for (int32_t l = 0; l < count; l++)
            p += w[l] * *at(A, k + l, i);
        for (int32_t l = 0; l < count; l++)
            *at(A, k + l, i) -= w[l] * (p / fabs(w[0]));
    }
    for (int32_t i = 0; i < A->n; i++) {
        double p = 0.0;

        for (int32_t l = 0; l < count; l++)
            p += *at(A, i, k + l) * w[l];
        for (int32_t l = 0; l < count; l++)
            *at(A, i, k + l) -= w[l] * (p / fabs(w[0]));
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

/* One double-shift QR step on rows l to last, with the shifts of the block [y, w; 1, x]:
 * reflections chase the bulge down. */
static void sweep(const square *A, int32_t l, int32_t last, double x, double y, double w)
{
    const double z = *at(A, l, l), r = x - z, s = y - z;
    double b[3] = {(r * s - w) / *at(A, l + 1, l) + *at(A, l, l + 1),
                   *at(A, l + 1, l + 1) - z - r - s, *at(A, l + 2, l + 1)};
    double work[3];

    for (int32_t k = l; k < last; k++) {
        const int32_t count = k < last - 1 ? 3 : 2;

        for (int32_t i = 0; i < count && k > l; i++)
            b[i] = *at(A, k + i, k - 1);
        reflect(A, k, count, b, work);
        for (int32_t i = 1; i < count && k > l; i++)
            *at(A, k + i, k - 1) = 0.0;
    }
}

static bool iterate(const square *A, double norm, double *real, double *imaginary)
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
        /* A := A / 2^e with a largest entry in [1/2, 1): products stay in the range of doubles */
        frexp(perp__largest_or_nan(A, n * n), &exponent);
        for (i = 0; i < n * n; i++)
            A[i] = ldexp(A[i], -exponent);
        for (int32_t k = 1; k < n - 1; k++) { /* to Hessenberg form */
            reflect(&view, k, n - k, at(&view, k, k - 1), real);
            for (i = k + 1; i < n; i++)
                *at(&view, i, k - 1) = 0.0;
        }
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

/* ---- compliant contacts --------------------------------------------------------------------
 *
 * For each eigenvalue gamma of Gamma, the roots of l^2 + gamma c l + gamma k (dividing by the one
 * that doesn't cancel), and the Hurwitz test in closed form: Re gamma > 0 and
 * c^2 Re(gamma) |gamma|^2 > k Im(gamma)^2. The second condition is flutter. */

typedef struct number {
    double re, im;
} number;

/* In units of time sqrt(k): m^2 + zeta gamma m + gamma = 0 with zeta = c / sqrt(k). */
static void roots_of(number gamma, double stiffness, double damping, number root[2])
{
    const double unit = sqrt(stiffness), zeta = damping / unit;
    const number half = {0.5 * zeta * gamma.re, 0.5 * zeta * gamma.im};
    const number inside = {half.re * half.re - half.im * half.im - gamma.re,
                           2.0 * half.re * half.im - gamma.im};
    const double length = sqrt(0.5 * (hypot(inside.re, inside.im) + fabs(inside.re)));
    number s = {length, 0.0};

    /* 1. s, the square root of `inside` on the side of half */
    if (length > 0.0)
        s.im = 0.5 * inside.im / length;
    if (inside.re < 0.0) {
        s.re = fabs(s.im);
        s.im = copysign(length, inside.im);
    }
    if (half.re * s.re + half.im * s.im < 0.0) {
        s.re = -s.re;
        s.im = -s.im;
    }
    /* 2. the root that does not cancel, and gamma over it; a conjugate pair exactly */
    root[0].re = -(half.re + s.re);
    root[0].im = -(half.im + s.im);
    root[1] = root[0];
    if (gamma.im == 0.0 && root[0].im != 0.0) {
        root[1].im = -root[0].im;
    } else if (root[0].re != 0.0 || root[0].im != 0.0) {
        const double size = hypot(root[0].re, root[0].im);
        const double re = root[0].re / size, im = root[0].im / size;

        root[1].re = (gamma.re * re + gamma.im * im) / size;
        root[1].im = (gamma.im * re - gamma.re * im) / size;
    }
    for (int32_t k = 0; k < 2; k++) {
        root[k].re *= unit;
        root[k].im *= unit;
    }
}

void perp__stability_of(int32_t p, double *Gamma, double stiffness, double damping, double *gamma,
                        double *roots, int32_t *stable, int32_t *flutter)
{
    const double zeta = damping / sqrt(stiffness);
    bool positive = 1;

    *stable = 1;
    perp__eigenvalues(p, Gamma, gamma, gamma + p);
    for (int32_t i = 0; i < p; i++) {
        const number g = {gamma[i], gamma[p + i]};
        number root[2];

        roots_of(g, stiffness, damping, root);
        roots[4 * i] = root[0].re;
        roots[4 * i + 1] = root[0].im;
        roots[4 * i + 2] = root[1].re;
        roots[4 * i + 3] = root[1].im;
        positive &= g.re > 0.0;
        *stable &= g.re > 0.0 && zeta * sqrt(g.re) > fabs(g.im) / hypot(g.re, g.im) &&
                   perp__all_finite(roots + 4 * i, 4);
    }
    *flutter = positive && !*stable && zeta > 0.0;
}
