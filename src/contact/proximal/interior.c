/* An interior point method for a part, from no impulses. With the duals
 *
 *   w = (u_n + |u_t|, u_t),   x in K,   w in K,   x'w = 0
 *
 * of De Saxce & Feng's law, the method of Acary, Armand, Nguyen & Shpakovych (Optim. Methods Softw.
 * 39 (2024)), which takes |u_t| for one unknown more: here |w_t|^2 / w_n in its place, which is the
 * same where a contact slips and 0 where it sticks, and, unlike |w_t|, smooth inside of the cone.
 * With it
 *
 *   u_n = det w / w_n,   x o w = (mean) e,   v = J'x,   u = J v + q
 *
 * are solved by Newton's steps, in the scaling of Nesterov and Todd, with the mean going to 0. With
 * G that takes w to x and dw = T (du + ...), a step is one solve with I + J' G T J. A row with two
 * bounds has two duals, one for each; a bilateral one is proximal. */
#include <math.h>
#include <string.h>

#include "contact/proximal/proximal.h"

/* The share of the mean that is aimed at where the predictor comes all the way. */
#define LEAST_CENTRE 1e-2

/* Bilateral rows: x -= this times u. */
#define STIFF 1e8

/* The path has come to a fold, as that of a law that is no gradient may, where so many steps do not
 * halve the mean. */
enum { MOST_STEPS = 60, FOLD = 6 };

enum kind { CONE, INTERVAL, FREE };

static enum kind kind_of(const perp__proximal *s, int32_t k)
{
    return s->radius[k] > 0.0 ? CONE : s->radius[k] > -INFINITY ? INTERVAL : FREE;
}

/* Tangents of x are this times those of the cone whose disc has radius 1; w is this times u. */
static double stretch(const perp__proximal *s, int32_t k, int32_t i)
{
    return i > 0 ? s->radius[k] : 1.0;
}

/* The mean of x w over cones and ends of intervals; 0 where there are none. */
static double find_mean(const perp__proximal *s, const perp__proximal_part *part)
{
    double sum = 0.0;
    int32_t count = 0;

    for (int32_t k = part->constraint; k < part->last_constraint; k++) {
        const perp__cone *cone = &s->cones[k];

        for (int32_t i = 0; kind_of(s, k) != FREE && i < 3; i++)
            sum += cone->z[i] * cone->u[i];
        count += kind_of(s, k) == CONE ? 1 : kind_of(s, k) == INTERVAL ? 2 : 0;
    }
    return count > 0 ? sum / count : 0.0;
}

/* What w lacks of T(u): its own rows, and det w / w_n of the normal; and T's first row, by the
 * derivative 1 + |w_t|^2 / w_n^2 of that. */
static void find_lack(const perp__proximal *s, int32_t k, double lack[3], double tilt[3])
{
    const perp__cone *cone = &s->cones[k];
    const double *u = s->speed + s->starts[k], *w = cone->u;
    const double share[2] = {w[1] / w[0], w[2] / w[0]};
    const double slope = 1.0 + share[0] * share[0] + share[1] * share[1];

    tilt[0] = 1.0 / slope;
    lack[0] = tilt[0] * (u[0] - perp__cone_det(w) / w[0]);
    for (int32_t i = 1; i < 3; i++) {
        lack[i] = i < cone->dim ? stretch(s, k, i) * u[i] - w[i] : 0.0;
        tilt[i] = 2.0 * share[i - 1] / slope;
        lack[0] += tilt[i] * lack[i];
    }
}

/* G = V^-2, of a cone. */
static void find_slope(const perp__cone *cone, double G[9])
{
    for (int32_t i = 0; i < 3; i++)
        for (int32_t j = 0; j < 3; j++) {
            G[3 * i + j] = 0.0;
            for (int32_t m = 0; m < 3; m++)
                G[3 * i + j] += cone->inverse[3 * i + m] * cone->inverse[3 * m + j];
        }
}

/* K = -dx / du of all constraints. */
static void find_slopes(perp__proximal *s, const perp__proximal_part *part)
{
    for (int32_t k = part->constraint; k < part->last_constraint; k++) {
        perp__cone *cone = &s->cones[k];
        double *K = perp__proximal_slope(s, k), G[9], lack[3], tilt[3];

        memset(K, 0, (size_t)(s->side * s->side) * sizeof *K);
        if (kind_of(s, k) == FREE) {
            K[0] = STIFF;
            continue;
        }
        if (kind_of(s, k) == INTERVAL) {
            K[0] = 1.0 / (cone->u[0] / cone->z[0] + cone->u[1] / cone->z[1]);
            continue;
        }
        perp__cone_scale(cone);
        find_slope(cone, G);
        find_lack(s, k, lack, tilt);
        for (int32_t i = 0; i < cone->dim; i++)
            for (int32_t j = 0; j < cone->dim; j++)
                K[s->side * j + i] = (G[3 * i] * tilt[j] + (j > 0 ? G[3 * i + j] : 0.0)) *
                                     stretch(s, k, i) * stretch(s, k, j);
    }
}

/* Of dx = c - K J dv: c of constraint k towards complementarity of `target`, with `corrects` times
 * the second-order part of the cone's last step. */
static void find_aim(perp__proximal *s, int32_t k, double target, double corrects, double *c)
{
    perp__cone *cone = &s->cones[k];
    const double *K = perp__proximal_slope(s, k), *u = s->speed + s->starts[k];
    double G[9], lack[3], tilt[3];

    if (kind_of(s, k) == FREE) {
        c[0] = -STIFF * u[0];
        return;
    }
    if (kind_of(s, k) == INTERVAL) { /* towards `target` at both of its ends */
        double ends[2];

        for (int32_t i = 0; i < 2; i++)
            ends[i] = (target - corrects * cone->dz[i] * cone->du[i]) / cone->z[i] - cone->u[i];
        c[0] = K[0] * (ends[0] - ends[1] - (u[0] - (cone->u[0] - cone->u[1])));
        return;
    }
    perp__cone_aim(cone, target, corrects);
    find_slope(cone, G);
    find_lack(s, k, lack, tilt);
    for (int32_t i = 0; i < cone->dim; i++) {
        c[i] = 0.0;
        for (int32_t j = 0; j < 3; j++)
            c[i] += stretch(s, k, i) * G[3 * i + j] * (cone->rc[j] - lack[j]);
    }
}

/* The step of x, in s->start, and of the cones: (I + J'KJ) dv = J'c, dx = c - K J dv. */
static void find_step(perp__proximal *s, const perp__proximal_part *part, double target,
                      double corrects)
{
    for (int32_t k = part->constraint; k < part->last_constraint; k++)
        find_aim(s, k, target, corrects, s->spare + s->starts[k]);
    perp__proximal_push(s, part, s->spare, s->rhs);
    perp__proximal_find_step(s, part, 1);
    perp__proximal_move(s, part, s->step, NULL, s->start);
    for (int32_t k = part->constraint; k < part->last_constraint; k++) {
        const double *K = perp__proximal_slope(s, k);
        const int32_t at = s->starts[k], d = s->starts[k + 1] - at;
        const double *du = s->start + at;
        perp__cone *cone = &s->cones[k];
        double dx[3] = {0.0}, lack[3], tilt[3];

        for (int32_t i = 0; i < d; i++) {
            dx[i] = s->spare[at + i];
            for (int32_t j = 0; j < d; j++)
                dx[i] -= K[s->side * j + i] * s->start[at + j];
        }
        /* the steps dz of z and du of u: of the ends of an interval, or of a cone */
        for (int32_t i = 0; i < 2 && kind_of(s, k) == INTERVAL; i++) {
            const double dz = i == 0 ? dx[0] : -dx[0],
                         second = corrects * cone->dz[i] * cone->du[i];

            cone->du[i] = (target - second - cone->u[i] * dz) / cone->z[i] - cone->u[i];
            cone->dz[i] = dz;
        }
        if (kind_of(s, k) == CONE) {
            find_lack(s, k, lack, tilt);
            cone->du[0] = lack[0] + tilt[0] * du[0];
            cone->dz[0] = dx[0];
            for (int32_t i = 1; i < cone->dim; i++) {
                cone->du[i] = lack[i] + stretch(s, k, i) * du[i];
                cone->du[0] += tilt[i] * stretch(s, k, i) * du[i];
                cone->dz[i] = dx[i] / stretch(s, k, i);
            }
        }
        memcpy(s->start + at, dx, (size_t)d * sizeof *dx);
    }
}

static double longest_step(const perp__proximal *s, const perp__proximal_part *part)
{
    double most = INFINITY;

    for (int32_t k = part->constraint; k < part->last_constraint; k++) {
        const perp__cone *cone = &s->cones[k];

        if (kind_of(s, k) == CONE)
            most = fmin(most, fmin(perp__cone_longest(cone->z, cone->dz),
                                   perp__cone_longest(cone->u, cone->du)));
        for (int32_t i = 0; i < 2 && kind_of(s, k) == INTERVAL; i++) {
            most = cone->dz[i] < 0.0 ? fmin(most, -cone->z[i] / cone->dz[i]) : most;
            most = cone->du[i] < 0.0 ? fmin(most, -cone->u[i] / cone->du[i]) : most;
        }
    }
    return most;
}

void perp__proximal_interior_run(perp__proximal *s, const perp__proximal_part *part)
{
    const size_t rows = (size_t)(part->last_row - part->row);
    const double before = s->best_residual;
    double passed[FOLD], first = 0.0, mean = 0.0, step;

    /* Cones at their middle; z and u of an interval: what is left to its ends, and their duals. */
    for (int32_t k = part->constraint; k < part->last_constraint; k++) {
        perp__cone *cone = &s->cones[k];

        memset(cone, 0, sizeof *cone);
        cone->dim = s->starts[k + 1] - s->starts[k];
        cone->z[0] = cone->u[0] = 1.0;
        for (int32_t i = s->starts[k]; i < s->starts[k + 1]; i++)
            s->x[i] = i == s->starts[k] && kind_of(s, k) == CONE;
        if (kind_of(s, k) == INTERVAL) {
            cone->z[0] = cone->z[1] = -s->radius[k];
            cone->u[1] = 1.0;
        }
    }
    for (int32_t k = 0; k < MOST_STEPS; k++) {
        mean = find_mean(s, part);
        first = k == 0 ? mean : first;
        if (k >= FOLD && mean > 0.5 * passed[k % FOLD])
            break;
        passed[k % FOLD] = mean;
        /* 1. What the point is worth; u of it, as it is. */
        memcpy(s->start + part->row, s->x + part->row, rows * sizeof *s->x);
        s->residual = perp__proximal_residual(s, part, s->start, s->speed);
        s->outcome = perp__proximal_asks_to_stop(s);
        if (!perp__proximal_goes_on(s, s->tol) || !(mean > 0.0))
            break;
        perp__proximal_push(s, part, s->x, s->v);
        perp__proximal_move(s, part, s->v, s->q, s->speed);

        /* 2. The predictor, and the corrector: the more of it the farther that comes. */
        find_slopes(s, part);
        s->factorisations++;
        if (!perp__proximal_factor(s, part))
            break;
        find_step(s, part, 0.0, 0.0);
        step = fmin(1.0, longest_step(s, part));
        find_step(s, part, mean * fmax(LEAST_CENTRE, 1.0 - step), step * step * step);
        step = fmin(1.0, PERP__CONE_REACH * longest_step(s, part));
        if (!(step > 0.0))
            break;
        for (int32_t i = part->row; i < part->last_row; i++)
            s->x[i] += step * s->start[i];
        for (int32_t c = part->constraint; c < part->last_constraint; c++)
            for (int32_t i = 0; i < 3; i++) {
                s->cones[c].z[i] += step * s->cones[c].dz[i];
                s->cones[c].u[i] += step * s->cones[c].du[i];
            }
    }
    /* The best point where it is of this path, else its end: nearer to the solution's active set
     * than a point of a smaller residual elsewhere. */
    if (s->best_residual < before)
        memcpy(s->x + part->row, s->best + part->row, rows * sizeof *s->x);
    else
        perp__proximal_project(s, part, s->x);
    s->folds = mean > LEAST_CENTRE * first;
}
