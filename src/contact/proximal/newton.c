/* The proximal point method (Rockafellar, SIAM J. Control Optim. 14 (1976) 877) on impulses: from a
 * centre r with speeds u = J J'r + q, the change v of the bodies' velocities with
 *
 *   F(v) = v - J' (P(r - rho (u + J v)) - r) = 0
 *
 * by semismooth Newton steps (Qi & Sun 1993) with I + J' (rho P') J, then the next centre is
 * P(r - rho (u + J v)), and rho grows where few steps were needed: near a solution u is small, and
 * so is what rho makes of its rounding. Where the steps fail, as F is no gradient, rho is less: a
 * softer centre is nearer. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "contact/law.h"
#include "contact/proximal/proximal.h"

/* The largest rho, which leaves PERP__RIDGE; and that from which on solutions are refined. */
#define MOST_RHO (1.0 / PERP__RIDGE)
#define REFINED (PERP__FIRST_RHO * PERP__WARM_RHO)
#define WORSE 3.0

enum { STEPS = 20, HALVINGS = 6 };

/* |F(v)|; F in s->rhs, z and the next centre in s->y. */
static double evaluate(perp__proximal *s, const perp__proximal_part *part, double rho,
                       const double *v)
{
    const int32_t begin = part->block * s->width, end = part->last_block * s->width;

    perp__proximal_visit(s, part, rho, v);
    for (int32_t i = begin; i < end; i++)
        s->rhs[i] = v[i] - s->rhs[i];
    return perp__contact_length(s->rhs, begin, end);
}

void perp__proximal_find_step(perp__proximal *s, const perp__proximal_part *part, int32_t refines)
{
    const int32_t begin = part->block * s->width, end = part->last_block * s->width;

    memcpy(s->step + begin, s->rhs + begin, (size_t)(end - begin) * sizeof *s->step);
    perp__fronts_solve(&s->fronts, part->block, part->last_block, s->step);
    if (!refines)
        return;
    perp__proximal_apply(s, part, s->step, s->rest);
    for (int32_t i = begin; i < end; i++)
        s->rest[i] = s->rhs[i] - s->rest[i];
    perp__fronts_solve(&s->fronts, part->block, part->last_block, s->rest);
    for (int32_t i = begin; i < end; i++)
        s->step[i] += s->rest[i];
}

/* Newton steps for one centre. Returns how many it took, negative where they failed. */
static int32_t solve_centre(perp__proximal *s, const perp__proximal_part *part, double rho)
{
    const int32_t begin = part->block * s->width, end = part->last_block * s->width;
    const double length_x = perp__contact_length(s->x, part->row, part->last_row);
    const double enough = fmax(2.0 * DBL_EPSILON * (1.0 + length_x), 0.1 * fmin(s->residual, 1.0));
    double size;

    memset(s->v + begin, 0, (size_t)(end - begin) * sizeof *s->v);
    size = evaluate(s, part, rho, s->v);
    for (int32_t step = 1; step <= STEPS && s->factorisations < s->limit; step++) {
        double best = INFINITY, length = 1.0, looked = 1.0;

        /* 1. The step. */
        perp__proximal_slopes(s, part, rho);
        s->factorisations++;
        if (!perp__proximal_factor(s, part))
            return -step;
        perp__proximal_find_step(s, part, rho > REFINED);

        /* 2. The best of a few lengths; none where |F| grows much. */
        for (int32_t round = 0; round < HALVINGS; round++) {
            const double a = ldexp(1.0, -round);
            double found;

            for (int32_t i = begin; i < end; i++)
                s->image[i] = s->v[i] - a * s->step[i];
            found = evaluate(s, part, rho, s->image);
            looked = a;
            if (found < best) {
                best = found;
                length = a;
            } else if (best < size) {
                break;
            }
            if (found < (1.0 - 0.3 * a) * size)
                break;
        }
        if (!(best <= WORSE * size))
            return -step;
        for (int32_t i = begin; i < end; i++)
            s->v[i] -= length * s->step[i];
        size = length == looked ? best : evaluate(s, part, rho, s->v);

        /* 3. The end. */
        if (size < enough)
            return step;
    }
    return -STEPS;
}

void perp__proximal_newton_run(perp__proximal *s, const perp__proximal_part *part, double rho,
                               int32_t most, int32_t patience)
{
    const size_t rows = (size_t)(part->last_row - part->row);
    const int64_t last = s->factorisations + most;
    double ceiling = MOST_RHO; /* of rho: half of what steps failed at last, and bold times as */
    double bold = 1.0, halved; /* much, more each time, as they do not */
    int64_t since = s->factorisations;

    s->residual = perp__proximal_residual(s, part, s->x, s->speed);
    halved = s->best_residual;
    while (s->factorisations < last && perp__proximal_goes_on(s, s->aim) &&
           s->factorisations - since < patience) {
        int32_t steps;
        double found;

        s->outcome = perp__proximal_asks_to_stop(s);
        if (s->outcome >= 0)
            break;
        steps = solve_centre(s, part, rho);
        memcpy(s->start + part->row, s->y + part->row, rows * sizeof *s->x);
        found = perp__proximal_residual(s, part, s->start, s->spare);
        if (s->best_residual <= s->tol && !(found < 0.5 * s->residual))
            break;
        if (s->best_residual < 0.5 * halved) {
            halved = s->best_residual;
            since = s->factorisations;
        }
        if (steps > 0 || found < 0.5 * s->residual) {
            memcpy(s->x + part->row, s->start + part->row, rows * sizeof *s->x);
            memcpy(s->speed + part->row, s->spare + part->row, rows * sizeof *s->x);
            s->residual = found;
            steps = steps < 0 ? -steps : steps;
            if (rho >= ceiling)
                ceiling = fmin(MOST_RHO, (bold *= 2.0) * ceiling);
            rho *= steps <= 1    ? 32.0
                   : steps <= 3  ? 4.0
                   : steps <= 6  ? 2.0
                   : steps <= 10 ? 1.5
                                 : 1.0;
            rho = fmin(ceiling, rho);
            continue;
        }
        ceiling = 0.5 * rho;
        bold = 1.0;
        rho = fmax(1.0, rho / 4.0);
    }
}
