/* The impact of one contact as its normal impulse p grows (G. Darboux 1880, J. B. Keller 1986):
 *
 *   du/dp = W (1, f),   f = -mu u_t / |u_t|,  or what holds u_t = 0 if that is no more than mu,
 *
 * with W the mobility of its rows. A slip that ends and cannot stay starts anew: in the plane the
 * other way (E. J. Routh), in space where it is driven to, from where it turns at once to the one
 * direction in which it grows. Directions that do not turn, and so all in the plane, are exact
 * pieces. One that turns is integrated in steps of p that are a share of the slip, by Runge and
 * Kutta's scheme of order 4.
 *
 * The work of p, integral of u_n dp, falls in the compression and comes back in the expansion, up
 * to its 1 - e^2 (W. J. Stronge 1990). Sliding that pulls the bodies together (a jam) compresses as
 * well, from u_n = 0 on, and in three dimensions it may do so once more. */
#include <math.h>
#include <string.h>

#include "mechanism/mechanism.h"

#define STEP (1.0 / 64.0) /* of p: changes the slip by no more than this share */
enum { MOST_PIECES = 100000 };

/* u at these impulses. */
static void velocities(const perp__hit_contact *c, const double *r, double *u)
{
    for (int32_t i = 0; i < 3; i++)
        u[i] = c->u[i] + c->W[i][0] * r[0] + c->W[i][1] * r[1] + c->W[i][2] * r[2];
}

/* f := the impulse of sliding along u_t, by p. */
static void slide(const perp__hit_contact *c, const double *u, double *f)
{
    const double speed = hypot(u[1], u[2]), share = speed > 0.0 ? c->mu / speed : 0.0;

    f[0] = 1.0;
    f[1] = -share * u[1];
    f[2] = -share * u[2];
}

/* f := the impulse at rest; whether it stays. Else f is of sliding in the direction in which the
 * tangents are driven: in space the slip turns from there to the one that grows, at once. */
static bool rest(const perp__hit_contact *c, double *f)
{
    const double a = c->W[1][1], b = c->W[1][2], d = c->W[2][2], trace = a + d;
    const double determinant = a * d - b * b;
    double size;

    f[1] = trace > 0.0 ? -c->W[1][0] / trace : 0.0; /* if one direction alone can slip */
    f[2] = trace > 0.0 ? -c->W[2][0] / trace : 0.0;
    if (determinant > PERP__NOTHING * trace * trace) {
        f[1] = (b * c->W[2][0] - d * c->W[1][0]) / determinant;
        f[2] = (b * c->W[1][0] - a * c->W[2][0]) / determinant;
    }
    size = hypot(f[1], f[2]);
    if (size <= c->mu)
        return 1;
    f[1] *= c->mu / size;
    f[2] *= c->mu / size;
    return 0;
}

/* A step of p with a direction that turns. */
static void turn(const perp__hit_contact *c, double *r, double *work, double step)
{
    static const double share[] = {0.0, 0.5, 0.5, 1.0}, weight[] = {1.0, 2.0, 2.0, 1.0};
    double f[3] = {0.0, 0.0, 0.0}, sum[3] = {0.0, 0.0, 0.0}, at[3], u[3];

    for (int32_t k = 0; k < 4; k++) {
        for (int32_t i = 0; i < 3; i++)
            at[i] = r[i] + share[k] * step * f[i];
        velocities(c, at, u);
        slide(c, u, f);
        *work += step / 6.0 * weight[k] * u[0];
        for (int32_t i = 0; i < 3; i++)
            sum[i] += step / 6.0 * weight[k] * f[i];
    }
    for (int32_t i = 0; i < 3; i++)
        r[i] += sum[i];
}

/* p until the work is `target`, with u_n and its rate as they are now; INFINITY: never so. */
static double until(double work, double target, double u, double rate)
{
    const double root = u * u + 2.0 * rate * (target - work);

    return root >= 0.0 && u + sqrt(root) > 0.0 ? 2.0 * (target - work) / (u + sqrt(root))
                                               : INFINITY;
}

/* What is ahead at the impulses r. */
typedef struct piece {
    double u[3], f[3], rate[3]; /* by p: impulses, and u */
    double length;              /* of p, that this lasts */
    int32_t sticks, turns;
} piece;

static void look_ahead(const perp__hit_contact *c, const double *r, piece *next)
{
    const double fastest =
        hypot(c->W[1][0], c->W[2][0]) + c->mu * (c->W[1][1] + 2.0 * fabs(c->W[1][2]) + c->W[2][2]);
    const double none =
        PERP__NOTHING * (hypot(c->u[1], c->u[2]) + fastest * (r[0] + fabs(c->u[0]) / c->W[0][0]));
    const double *u = next->u, *rate = next->rate;
    double speed, grows;

    velocities(c, r, next->u);
    slide(c, u, next->f);
    speed = hypot(u[1], u[2]);
    next->sticks = speed <= none && c->mu > 0.0 && rest(c, next->f);
    for (int32_t i = 0; i < 3; i++)
        next->rate[i] = c->W[i][0] * next->f[0] + c->W[i][1] * next->f[1] + c->W[i][2] * next->f[2];
    grows = u[1] * rate[1] + u[2] * rate[2];
    next->turns = speed > none && c->mu > 0.0 &&
                  fabs(u[1] * rate[2] - u[2] * rate[1]) > PERP__NOTHING * fastest * speed;
    next->length = INFINITY;
    if (next->turns)
        next->length = STEP * speed / fastest;
    else if (speed > none && c->mu > 0.0 && grows < 0.0)
        next->length = -speed * speed / grows;
    else if (speed <= none && c->mu > 0.0 && !next->sticks)
        next->length = 8.0 * none / hypot(rate[1], rate[2]);
}

void perp__stronge_impact(perp__hit_contact *c)
{
    const double kept = 1.0 - c->e * c->e; /* of the work */
    double r[3] = {0.0, 0.0, 0.0}, work = 0.0, least = 0.0, left, length;
    bool expands = 0;
    piece next;

    memset(c->r, 0, sizeof c->r); /* until it sticks */
    for (int32_t count = 0; count < MOST_PIECES; count++) {
        /* 1. up to where this ends, or the compression, or the expansion */
        look_ahead(c, r, &next);
        expands = expands && !(next.u[0] <= 0.0 && next.rate[0] <= 0.0);
        left = expands              ? until(work, kept * least, next.u[0], next.rate[0])
               : next.rate[0] > 0.0 ? -next.u[0] / next.rate[0]
                                    : INFINITY;
        length = fmin(left, next.length);
        if (!isfinite(length) || (!expands && left <= 0.0 && !(work < 0.0)))
            break; /* it leaves */
        if (next.turns)
            turn(c, r, &work, length);
        else
            work += length * (next.u[0] + 0.5 * length * next.rate[0]);
        for (int32_t i = 0; i < 3 && !next.turns; i++)
            r[i] += length * next.f[i];
        if (!next.sticks)
            memcpy(c->r, r, sizeof r);
        /* 2. what comes then */
        if (length != left || (next.turns && fabs(left) > PERP__SUM_ROUNDING * r[0]))
            continue;
        if (expands || c->e == 0.0 || !(work < 0.0))
            break;
        expands = 1;
        least = work;
    }
    c->stuck = r[0] - c->r[0];
}
