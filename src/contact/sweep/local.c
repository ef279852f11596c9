/* One contact by itself, exactly: r in K and u = W_kk r + b obey Signorini's and Coulomb's laws.
 *
 * With the normal impulse eliminated, r_n = z - a'r_t, z = -b_n / W_nn, a = W_tn / W_nn, and the
 * tangents turned so that the Schur complement W_tt - W_tn W_nt / W_nn is diag(s):
 *   b_n >= 0:             r = 0 (take-off);
 *   r_t = -c / s          in its disc |r_t| <= mu r_n (stick), c = b_t - a b_n;
 *   r_t = -c / (s + l),   |r_t| = mu r_n, l > 0 (slip: u_t = -l r_t, u_n = 0).
 * The last equation is a quartic in the slip multiplier l. It is solved by Newton's method on
 * mu r_n / |r_t| - 1, nearly linear in l, inside of a bracket that always exists: the function is
 * negative at l = 0, where sticking failed, and positive for large l. Where friction and coupling
 * are so large that there are several solutions, r = 0 is taken before any other, sticking before
 * slipping, and of several slips one at which the function rises. (Quartic: Bonnefon & Daviet,
 * INRIA 2011; secular equations: Conn, Gould & Toint, Trust-Region Methods, 2000, chapter 7.) */
#include "contact/sweep/sweep.h"

#include <math.h>
#include <string.h>

#include "base/rounding.h"
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
