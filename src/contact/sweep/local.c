#include "contact/sweep/local.h"

#include <math.h>
#include <string.h>

#include "base/rounding.h"
#include "contact/law.h"
#include "contact/sweep/local_step.h"

/* Turns [[p, o], [o, q]], or p alone, to where it is diagonal. */
static void set_tangents(perp__local *local, int32_t tangents, double p, double o, double q,
                         double least)
{
    double half, tangent, size;

    if (tangents == 2 && o != 0.0) {
        half = 0.5 * (q - p) / o; /* Jacobi: t^2 + 2 half t - 1 = 0, the smaller root */
        tangent = (half >= 0.0 ? 1.0 : -1.0) / (fabs(half) + sqrt(1.0 + half * half));
        size = 1.0 / sqrt(1.0 + tangent * tangent);
        local->turn[0] = size;
        local->turn[1] = -tangent * size;
        p -= tangent * o;
        q += tangent * o;
    }
    local->s[0] = fmax(p, least);
    local->s[1] = tangents == 2 ? fmax(q, least) : 1.0;
    local->inverse_s[0] = 1.0 / local->s[0];
    local->inverse_s[1] = 1.0 / local->s[1];
}

static void begin(perp__local *local, int32_t dim, double mu)
{
    memset(local, 0, sizeof *local);
    local->dim = dim;
    local->mu = mu;
    local->turn[0] = 1.0;
    local->s[0] = local->s[1] = local->inverse_s[0] = local->inverse_s[1] = 1.0;
}

void perp__local_make(perp__local *local, int32_t dim, const double *W, int32_t stride, double mu)
{
    double S[3][3], trace = 0.0, least, normal, a[2] = {0.0, 0.0};

    begin(local, dim, mu);
    for (int32_t i = 0; i < dim; i++) {
        for (int32_t j = 0; j < dim; j++)
            S[i][j] = 0.5 * W[i * stride + j] + 0.5 * W[j * stride + i];
        trace += S[i][i];
    }
    least = trace > 0.0 ? PERP__SUM_ROUNDING * trace : 1.0; /* of a diagonal or pivot */
    normal = fmax(S[0][0], least);
    local->inverse_normal = 1.0 / normal;
    if (dim == 1)
        return;
    for (int32_t i = 1; i < dim; i++)
        a[i - 1] = S[i][0] / normal;
    set_tangents(local, dim - 1, S[1][1] - a[0] * S[1][0],
                 dim == 3 ? S[1][2] - a[0] * S[2][0] : 0.0,
                 dim == 3 ? S[2][2] - a[1] * S[2][0] : 0.0, least);
    local->a[0] = local->turn[0] * a[0] + local->turn[1] * a[1];
    local->a[1] = local->turn[0] * a[1] - local->turn[1] * a[0];
}

void perp__local_make_disc(perp__local *local, int32_t dim, const double *W, int32_t stride)
{
    const double second = dim == 2 ? W[stride + 1] : 0.0;
    const double trace = W[0] + second;

    begin(local, dim, 1.0); /* of a pressure that is the radius */
    set_tangents(local, dim, W[0], dim == 2 ? 0.5 * W[1] + 0.5 * W[stride] : 0.0, second,
                 trace > 0.0 ? PERP__SUM_ROUNDING * trace : 1.0);
}

static void turn(const double t[2], const double *from, double *to)
{
    const double x = from[0], y = from[1];

    to[0] = t[0] * x + t[1] * y;
    to[1] = t[0] * y - t[1] * x;
}

static void turn_back(const double t[2], double *x)
{
    const double first = x[0], second = x[1];

    x[0] = t[0] * first - t[1] * second;
    x[1] = t[1] * first + t[0] * second;
}

int32_t perp__local_step(perp__local *local, const double *u, double *r)
{
    double turned[3];
    int32_t mode;

    if (local->dim == 1) {
        const double z = r[0] - u[0] * local->inverse_normal;

        r[0] = z > 0.0 ? z : 0.0;
        return z > 0.0 ? PERP_CONTACT_STICK : PERP_CONTACT_SEPARATE;
    }
    if (local->dim == 2)
        return perp__step_2(local, u, r);
    turned[0] = u[0];
    turn(local->turn, u + 1, turned + 1);
    turn(local->turn, r + 1, r + 1);
    mode = perp__step_3(local, turned, r);
    turn_back(local->turn, r + 1);
    return mode;
}

int32_t perp__local_step_disc(perp__local *local, double radius, const double *u, double *r)
{
    double turned[2] = {u[0], 0.0}, old[2] = {r[0], 0.0}, c[2], next[2];
    int32_t mode = PERP_CONTACT_STICK;

    if (local->dim == 2) {
        turn(local->turn, u, turned);
        turn(local->turn, r, old);
    }
    for (int32_t i = 0; i < 2; i++)
        next[i] = old[i] - turned[i] * local->inverse_s[i];
    if (!(next[0] * next[0] + next[1] * next[1] <= radius * radius)) {
        mode = PERP_CONTACT_SLIP;
        for (int32_t i = 0; i < 2; i++)
            c[i] = turned[i] - local->s[i] * old[i];
        if (local->dim == 1)
            next[0] = next[0] > 0.0 ? radius : -radius;
        else if (radius > 0.0)
            perp__slip(local, radius, c, next);
        else
            next[0] = next[1] = 0.0;
    }
    if (local->dim == 2)
        turn_back(local->turn, next);
    r[0] = next[0];
    if (local->dim == 2)
        r[1] = next[1];
    return mode;
}

/* ---- contacts that hold both ways ---- */

enum { ROWS = PERP__NORMALS_MOST + PERP__TANGENTS_MOST };

/* Columns of K past the first n := W^-1 times these, W symmetric positive definite in the first. */
static void eliminate(int32_t n, int32_t columns, double K[][ROWS + PERP__NORMALS_MOST],
                      double least)
{
    for (int32_t p = 0; p < n; p++) {
        const double pivot = fmax(K[p][p], least);

        for (int32_t i = 0; i < n; i++) {
            const double factor = i == p ? 0.0 : K[i][p] / pivot;

            for (int32_t j = p; j < columns; j++)
                K[i][j] -= factor * K[p][j];
        }
        for (int32_t j = p; j < columns; j++)
            K[p][j] /= pivot;
    }
}

void perp__two_sided_make(perp__two_sided *p, int32_t normals, int32_t tangents, const double *W,
                          double mu)
{
    const int32_t rows = normals + tangents;
    double symmetric[ROWS][ROWS], trace = 0.0, least;
    double K[PERP__NORMALS_MOST][ROWS + PERP__NORMALS_MOST] = {
        {0.0}}; /* W_NN, W_Nt, the identity */

    memset(p, 0, sizeof *p);
    p->normals = normals;
    p->tangents = tangents;
    p->mu = mu;
    for (int32_t i = 0; i < rows; i++) {
        for (int32_t j = 0; j < rows; j++)
            symmetric[i][j] = 0.5 * W[i * rows + j] + 0.5 * W[j * rows + i];
        trace += symmetric[i][i];
    }
    least = trace > 0.0 ? PERP__SUM_ROUNDING * trace : 1.0; /* of a diagonal or pivot */
    for (int32_t i = 0; i < normals; i++) {
        memcpy(K[i], symmetric[i], (size_t)rows * sizeof(double));
        K[i][rows + i] = 1.0;
    }
    eliminate(normals, rows + normals, K, least);
    for (int32_t i = 0; i < normals; i++) {
        for (int32_t j = 0; j < tangents; j++)
            p->A[i][j] = K[i][normals + j];
        for (int32_t j = 0; j < normals; j++)
            p->inverse[i][j] = K[i][rows + j];
    }
    for (int32_t i = 0; i < tangents; i++) {
        for (int32_t j = 0; j < tangents; j++) {
            p->S[i][j] = symmetric[normals + i][normals + j];
            for (int32_t k = 0; k < normals; k++)
                p->S[i][j] -= symmetric[normals + i][k] * p->A[k][j];
        }
        p->S[i][i] = fmax(p->S[i][i], least);
    }
}

/* to := n - A t; returns its length. */
static double carry(const perp__two_sided *p, const double *n, const double *t, double *to)
{
    for (int32_t i = 0; i < p->normals; i++) {
        to[i] = n[i];
        for (int32_t j = 0; j < p->tangents; j++)
            to[i] -= p->A[i][j] * t[j];
    }
    return perp__contact_length(to, 0, p->normals);
}

/* t := -(S + l)^-1 c */
static void rub(const perp__two_sided *p, double l, const double *c, double *t)
{
    const double a = p->S[0][0] + l, b = p->S[0][1], d = p->S[1][1] + l, det = a * d - b * b;

    if (p->tangents == 1) {
        t[0] = -c[0] / a;
        return;
    }
    t[0] = -(d * c[0] - b * c[1]) / det;
    t[1] = -(a * c[1] - b * c[0]) / det;
}

/* |t| = mu |n - A t| between 0 and t: one tangent, a quadratic; two, regula falsi (Illinois) in l,
 * at 0 of which that much friction is missing. */
static void slip_both_ways(const perp__two_sided *p, const double *n, const double *c, double *t,
                           double excess)
{
    const double sign = t[0] > 0.0 ? 1.0 : -1.0, square = p->mu * p->mu;
    const double length = perp__contact_length(n, 0, p->normals);
    double alpha = 1.0, beta = 0.0, gamma = 0.0, reach = 0.0;
    double low = 0.0, high, at_low = excess, at_high, carried[PERP__NORMALS_MOST];
    int32_t side = 0;

    if (p->tangents == 1) {
        for (int32_t i = 0; i < p->normals; i++) {
            alpha -= square * p->A[i][0] * p->A[i][0];
            beta += square * sign * n[i] * p->A[i][0];
            gamma += square * n[i] * n[i];
        }
        t[0] = gamma > 0.0 ? sign * gamma / (beta + sqrt(fmax(0.0, beta * beta + alpha * gamma)))
                           : 0.0;
        return;
    }
    for (int32_t i = 0; i < p->normals; i++)
        reach = hypot(reach, hypot(p->A[i][0], p->A[i][1]));
    if (!(p->mu * length > 0.0)) {
        t[0] = t[1] = 0.0;
        return;
    }
    high = 2.0 * perp__contact_length(c, 0, 2) * (1.0 + p->mu * reach) / (p->mu * length);
    rub(p, high, c, t);
    at_high = p->mu * carry(p, n, t, carried) - perp__contact_length(t, 0, 2);
    for (int32_t step = 0; step < 2 * DBL_MANT_DIG && at_high > 0.0; step++) {
        const double l = (low * at_high - high * at_low) / (at_high - at_low);

        rub(p, l, c, t);
        excess = p->mu * carry(p, n, t, carried) - perp__contact_length(t, 0, 2);
        if (fabs(excess) <= 2.0 * DBL_EPSILON * p->mu * length || !(l > low && l < high))
            return;
        if (excess < 0.0) {
            low = l;
            at_low = excess;
            at_high *= side < 0 ? 0.5 : 1.0;
        } else {
            high = l;
            at_high = excess;
            at_low *= side > 0 ? 0.5 : 1.0;
        }
        side = excess < 0.0 ? -1 : 1;
    }
}

int32_t perp__two_sided_step(const perp__two_sided *p, const double *u, double *r)
{
    const double *u_t = u + p->normals;
    double n[PERP__NORMALS_MOST], carried[PERP__NORMALS_MOST], *t = r + p->normals;
    double c[PERP__TANGENTS_MOST], excess;

    for (int32_t i = 0; i < p->normals; i++) {
        n[i] = r[i];
        for (int32_t j = 0; j < p->normals; j++)
            n[i] -= p->inverse[i][j] * u[j];
        for (int32_t j = 0; j < p->tangents; j++)
            n[i] += p->A[i][j] * t[j];
    }
    for (int32_t i = 0; i < p->tangents; i++) {
        c[i] = u_t[i];
        for (int32_t j = 0; j < p->normals; j++)
            c[i] -= p->A[j][i] * u[j];
        for (int32_t j = 0; j < p->tangents; j++)
            c[i] -= p->S[i][j] * t[j];
    }
    rub(p, 0.0, c, t);
    excess = p->mu * carry(p, n, t, carried) - perp__contact_length(t, 0, p->tangents);
    if (!(excess >= 0.0)) {
        slip_both_ways(p, n, c, t, excess);
        carry(p, n, t, carried);
    }
    memcpy(r, carried, (size_t)p->normals * sizeof *r);
    return excess >= 0.0 ? PERP_CONTACT_STICK : PERP_CONTACT_SLIP;
}
