/* For each eigenvalue gamma of Gamma, the roots of l^2 + gamma c l + gamma k (dividing by the one
 * that doesn't cancel), and the Hurwitz test in closed form: Re gamma > 0 and
 * c^2 Re(gamma) |gamma|^2 > k Im(gamma)^2. The second condition is flutter. */
#include "mechanism/stability.h"

#include <math.h>

#include "base/outcome.h"
#include "linalg/eigenvalues.h"

typedef struct number {
    double re, im;
} number;

static number square_root(number z)
{
    const double size = hypot(z.re, z.im), root = sqrt(0.5 * (size + fabs(z.re)));
    number result = {root, 0.0};

    if (root > 0.0)
        result.im = 0.5 * z.im / root;
    if (z.re < 0.0) {
        result.re = fabs(result.im);
        result.im = copysign(root, z.im);
    }
    return result;
}

static number quotient(number a, number b)
{
    const double size = hypot(b.re, b.im), re = b.re / size, im = b.im / size;
    const number result = {(a.re * re + a.im * im) / size, (a.im * re - a.re * im) / size};

    return result;
}

/* In units of time sqrt(k): m^2 + zeta gamma m + gamma = 0 with zeta = c / sqrt(k). */
static void roots_of(number gamma, double stiffness, double damping, number root[2])
{
    const double unit = sqrt(stiffness), zeta = damping / unit;
    const number half = {0.5 * zeta * gamma.re, 0.5 * zeta * gamma.im};
    const number inside = {half.re * half.re - half.im * half.im - gamma.re,
                           2.0 * half.re * half.im - gamma.im};
    number s = square_root(inside);

    if (half.re * s.re + half.im * s.im < 0.0) {
        s.re = -s.re;
        s.im = -s.im;
    }
    root[0].re = -(half.re + s.re);
    root[0].im = -(half.im + s.im);
    if (root[0].re == 0.0 && root[0].im == 0.0)
        root[1] = root[0];
    else
        root[1] = quotient(gamma, root[0]);
    if (gamma.im == 0.0 && root[0].im != 0.0) { /* a conjugate pair, exactly */
        root[1].re = root[0].re;
        root[1].im = -root[0].im;
    }
    root[0].re *= unit;
    root[0].im *= unit;
    root[1].re *= unit;
    root[1].im *= unit;
}

perp__stability perp__stability_of(int32_t p, double *Gamma, double stiffness, double damping,
                                   double *gamma, double *roots)
{
    const double zeta = damping / sqrt(stiffness);
    perp__stability verdict = {1, 0};
    int32_t positive = 1, i;

    perp__eigenvalues(p, Gamma, gamma, gamma + p);
    for (i = 0; i < p; i++) {
        const number g = {gamma[i], gamma[p + i]};
        const double size = hypot(g.re, g.im);
        number root[2];

        roots_of(g, stiffness, damping, root);
        roots[4 * i] = root[0].re;
        roots[4 * i + 1] = root[0].im;
        roots[4 * i + 2] = root[1].re;
        roots[4 * i + 3] = root[1].im;
        positive &= g.re > 0.0;
        verdict.stable &= g.re > 0.0 && zeta * sqrt(g.re) > fabs(g.im) / size &&
                          perp__all_finite(roots + 4 * i, 4);
    }
    verdict.flutter = positive && !verdict.stable && zeta > 0.0;
    return verdict;
}
