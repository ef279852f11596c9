#include "contact/sweep/local.h"

#include <math.h>
#include <string.h>

#include <perp/contact.h>

/* What a pivot is lifted to, of the trace. */
#define LEAST 1e-14
#define ACCURACY 5e-16
enum { STEPS = 100, ROWS = PERP__NORMALS_MOST + PERP__TANGENTS_MOST };

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
    least = trace > 0.0 ? LEAST * trace : 1.0;
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

static double norm(const double *x, int32_t size)
{
    double sum = 0.0;

    for (int32_t i = 0; i < size; i++)
        sum += x[i] * x[i];
    return sqrt(sum);
}

/* to := n - A t; returns its length. */
static double carry(const perp__two_sided *p, const double *n, const double *t, double *to)
{
    for (int32_t i = 0; i < p->normals; i++) {
        to[i] = n[i];
        for (int32_t j = 0; j < p->tangents; j++)
            to[i] -= p->A[i][j] * t[j];
    }
    return norm(to, p->normals);
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
static void slip(const perp__two_sided *p, const double *n, const double *c, double *t,
                 double excess)
{
    const double sign = t[0] > 0.0 ? 1.0 : -1.0, square = p->mu * p->mu;
    const double length = norm(n, p->normals);
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
    high = 2.0 * norm(c, 2) * (1.0 + p->mu * reach) / (p->mu * length);
    rub(p, high, c, t);
    at_high = p->mu * carry(p, n, t, carried) - norm(t, 2);
    for (int32_t step = 0; step < STEPS && at_high > 0.0; step++) {
        const double l = (low * at_high - high * at_low) / (at_high - at_low);

        rub(p, l, c, t);
        excess = p->mu * carry(p, n, t, carried) - norm(t, 2);
        if (fabs(excess) <= ACCURACY * p->mu * length || !(l > low && l < high))
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
    excess = p->mu * carry(p, n, t, carried) - norm(t, p->tangents);
    if (!(excess >= 0.0)) {
        slip(p, n, c, t, excess);
        carry(p, n, t, carried);
    }
    memcpy(r, carried, (size_t)p->normals * sizeof *r);
    return excess >= 0.0 ? PERP_CONTACT_STICK : PERP_CONTACT_SLIP;
}
