#include "contact/newton/cone.h"

#include <math.h>
#include <string.h>

static double tail(int32_t d, const double *x)
{
    if (d == 1)
        return 0.0;
    return d == 2 ? fabs(x[1]) : hypot(x[1], x[2]);
}

static double dot(int32_t d, const double *a, const double *b)
{
    double sum = a[0] * b[0];

    for (int32_t i = 1; i < d; i++)
        sum += a[i] * b[i];
    return sum;
}

void perp__cone_values(int32_t d, const double *x, double *low, double *high)
{
    double n = tail(d, x);

    *low = x[0] - n;
    *high = x[0] + n;
}

void perp__cone_product(int32_t d, const double *a, const double *b, double *c)
{
    c[0] = dot(d, a, b);
    for (int32_t i = 1; i < d; i++)
        c[i] = a[0] * b[i] + b[0] * a[i];
}

void perp__cone_divide(int32_t d, const double *a, const double *b, double *c)
{
    double n = tail(d, a);
    double along = 0.0;

    for (int32_t i = 1; i < d; i++)
        along += a[i] * b[i];
    c[0] = (a[0] * b[0] - along) / ((a[0] - n) * (a[0] + n));
    if (d == 1)
        c[0] = b[0] / a[0];
    for (int32_t i = 1; i < d; i++)
        c[i] = (b[i] - a[i] * c[0]) / a[0];
}

/* sqrt(det x), or 0 where x is not inside of K. */
static double root(int32_t d, const double *x)
{
    double n = tail(d, x);

    if (!(x[0] > n))
        return 0.0;
    return sqrt(x[0] - n) * sqrt(x[0] + n);
}

int32_t perp__cone_scale(int32_t d, const double *x, const double *z, perp__cone_scaling *T)
{
    double root_x = root(d, x), root_z = root(d, z);
    double gamma;

    if (!(root_x > 0.0) || !(root_z > 0.0))
        return 0;
    T->eta = sqrt(root_z / root_x);
    T->w[0] = 1.0;
    T->w[1] = T->w[2] = 0.0;
    if (d == 1)
        return isfinite(T->eta);
    gamma = sqrt(0.5 * (1.0 + dot(d, x, z) / (root_x * root_z)));
    for (int32_t i = 1; i < d; i++)
        T->w[i] = (z[i] / root_z - x[i] / root_x) / (2.0 * gamma);
    T->w[0] = hypot(1.0, tail(d, T->w)); /* determinant 1 to rounding */
    return isfinite(T->eta) && isfinite(T->w[0]);
}

/* y = P(w)^(1/2) x for w = (w_1, sign w_t): [w_1, w_t'; w_t, I + w_t w_t' / (1 + w_1)]. */
static void root_apply(int32_t d, const double *w, double sign, double factor, const double *x,
                       double *y)
{
    double along = 0.0, head = x[0], c;

    for (int32_t i = 1; i < d; i++)
        along += sign * w[i] * x[i];
    c = head + along / (1.0 + w[0]);
    y[0] = factor * (w[0] * head + along);
    for (int32_t i = 1; i < d; i++)
        y[i] = factor * (x[i] + sign * w[i] * c);
}

void perp__cone_apply(int32_t d, const perp__cone_scaling *T, const double *x, double *y)
{
    root_apply(d, T->w, 1.0, T->eta, x, y);
}

void perp__cone_apply_inverse(int32_t d, const perp__cone_scaling *T, const double *x, double *y)
{
    root_apply(d, T->w, -1.0, 1.0 / T->eta, x, y);
}

void perp__cone_metric(int32_t d, const perp__cone_scaling *T, double *G)
{
    double square = T->eta * T->eta;

    for (int32_t j = 0; j < d; j++)
        for (int32_t i = 0; i < d; i++)
            G[3 * j + i] =
                square * (2.0 * T->w[i] * T->w[j] - (i != j ? 0.0 : (i == 0 ? 1.0 : -1.0)));
    /* 2 w_1^2 - 1 cancels near w_1 = 1 */
    if (d > 1)
        G[0] = square * (T->w[0] * T->w[0] + tail(d, T->w) * tail(d, T->w));
}

double perp__cone_step(int32_t d, const double *x, const double *step)
{
    double det_root = root(d, x);
    double along, c, behind;
    double transformed[3] = {0.0, 0.0, 0.0};

    if (d == 1)
        return step[0] < 0.0 ? x[0] / -step[0] : INFINITY;
    if (!(det_root > 0.0))
        return 0.0;
    /* P(x)^(-1/2) step, and how far e may go along it */
    along = x[0] * step[0];
    for (int32_t i = 1; i < d; i++)
        along -= x[i] * step[i];
    along /= det_root;
    c = (along + step[0]) / (x[0] / det_root + 1.0);
    for (int32_t i = 1; i < d; i++)
        transformed[i] = step[i] - c * x[i] / det_root;
    behind = (tail(d, transformed) - along) / det_root;
    return behind > 0.0 ? 1.0 / behind : INFINITY;
}

void perp__cone_project(int32_t d, const double *v, double *p)
{
    double n = tail(d, v), high = v[0] + n, ratio;

    if (v[0] >= n) {
        memmove(p, v, (size_t)d * sizeof *p);
        return;
    }
    if (high <= 0.0 || d == 1) {
        memset(p, 0, (size_t)d * sizeof *p);
        return;
    }
    ratio = 0.5 * high / n;
    for (int32_t i = 1; i < d; i++)
        p[i] = ratio * v[i];
    p[0] = tail(d, p); /* on the cone to the last bit */
}

/* (a + sqrt(a^2 + 4 s)) / 2 without cancellation */
static double smooth(double a, double s)
{
    double half = 0.5 * (fabs(a) + sqrt(a * a + 4.0 * s));

    return a >= 0.0 ? half : (half > 0.0 ? s / half : 0.0);
}

void perp__cone_smooth(int32_t d, const double *v, double s, double *p)
{
    double n = tail(d, v);
    double low = smooth(v[0] - n, s), high = smooth(v[0] + n, s);
    double ratio = n > 0.0 ? 0.5 * (high - low) / n : 0.0;

    p[0] = 0.5 * (low + high);
    for (int32_t i = 1; i < d; i++)
        p[i] = ratio * v[i];
}

void perp__cone_derivative(int32_t d, const double *v, double *V)
{
    double n = tail(d, v), ratio;
    double w[3] = {1.0, 0.0, 0.0};

    memset(V, 0, 9 * sizeof *V);
    if (v[0] - n > 0.0) {
        for (int32_t i = 0; i < d; i++)
            V[4 * i] = 1.0;
        return;
    }
    if (d == 1 || v[0] + n <= 0.0)
        return;
    for (int32_t i = 1; i < d; i++)
        w[i] = v[i] / n;
    ratio = v[0] / n;
    V[0] = 0.5;
    for (int32_t j = 1; j < d; j++) {
        V[j] = V[3 * j] = 0.5 * w[j];
        for (int32_t i = 1; i < d; i++)
            V[3 * j + i] = 0.5 * ((i == j ? 1.0 + ratio : 0.0) - ratio * w[i] * w[j]);
    }
}
