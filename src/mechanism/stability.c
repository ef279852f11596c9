/* For each eigenvalue gamma of Gamma, the roots of l^2 + gamma c l + gamma k (dividing by the one
 * that doesn't cancel), and the Hurwitz test in closed form: Re gamma > 0 and
 * c^2 Re(gamma) |gamma|^2 > k Im(gamma)^2. The second condition is flutter. */
#include "mechanism/stability.h"

#include <math.h>

#include "base/outcome.h"
#include "mechanism/eigenvalues.h"

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
    int32_t positive = 1;

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
