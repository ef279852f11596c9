/* The proximal point method (Rockafellar, SIAM J. Control Optim. 14 (1976) 877) on impulses: from a
 * centre r with speeds u = J J'r + q, the change v of the bodies' velocities with
 *
 *   F(v) = v - J' (P(r - rho (u + J v)) - r) = 0
 *
 * by semismooth Newton steps (Qi & Sun 1993) with I + J' (rho P') J, then the next centre is
 * P(r - rho (u + J v)), and rho grows where few steps were needed: near a solution u is small, and
 * so is what rho makes of its rounding. Where the steps fail, as F is no gradient, alternating
 * directions bring another centre. */
#include <math.h>
#include <string.h>

#include "contact/proximal/proximal.h"

#define MOST_RHO 1e13
#define SOFT_RHO 10.0  /* of the directions */
#define REFINED 1e4    /* rho from which on solutions are refined */
#define ROUNDING 4e-16 /* |F| that is, over |r| */
#define EASIER 0.125
#define SLOW 0.7
#define WORSE 3.0

enum { STEPS = 20, SLOW_STEPS = 3, HALVINGS = 6, FAILURES = 60, PATIENCE = 30, SWEEPS = 100 };

static double length_of(const double *x, int32_t begin, int32_t end)
{
    double sum = 0.0;

    for (int32_t i = begin; i < end; i++)
        sum += x[i] * x[i];
    return sqrt(sum);
}

/* |F(v)|; F in s->rhs, z and the next centre. */
double perp__proximal_evaluate(perp__proximal *s, const perp__proximal_part *part, double rho,
                               const double *v)
{
    perp__proximal_visit(s, part, rho, v);
    for (int32_t i = part->block * s->width; i < part->last_block * s->width; i++)
        s->rhs[i] = v[i] - s->rhs[i];
    return length_of(s->rhs, part->block * s->width, part->last_block * s->width);
}

double perp__proximal_enough(const perp__proximal *s, const perp__proximal_part *part)
{
    return fmax(ROUNDING * (1.0 + length_of(s->x, part->row, part->last_row)),
                0.1 * fmin(s->residual, 1.0));
}

void perp__proximal_solve(perp__proximal *s, const perp__proximal_part *part, double rho,
                          const double *rhs, double *x)
{
    const int32_t begin = part->block * s->width, end = part->last_block * s->width;

    for (int32_t i = begin; i < end; i++)
        x[i] = rhs[i];
    perp__fronts_solve(&s->fronts, part->block, part->last_block, x);
    if (rho <= REFINED)
        return;
    perp__proximal_apply(s, part, x, s->rest);
    for (int32_t i = begin; i < end; i++)
        s->rest[i] = rhs[i] - s->rest[i];
    perp__fronts_solve(&s->fronts, part->block, part->last_block, s->rest);
    for (int32_t i = begin; i < end; i++)
        x[i] += s->rest[i];
}

/* v - a step for the best of a few a; *size: |F| there. Returns 0, and leaves v, where it grows
 * much. */
static int32_t move(perp__proximal *s, const perp__proximal_part *part, double rho, double *size)
{
    const int32_t begin = part->block * s->width, end = part->last_block * s->width;
    double best = INFINITY, length = 1.0, looked = 1.0;

    for (int32_t round = 0; round < HALVINGS; round++) {
        const double a = ldexp(1.0, -round);
        double found;

        for (int32_t i = begin; i < end; i++)
            s->image[i] = s->v[i] - a * s->step[i];
        found = perp__proximal_evaluate(s, part, rho, s->image);
        looked = a;
        if (found < best) {
            best = found;
            length = a;
        } else if (best < *size) {
            break;
        }
        if (found < (1.0 - 0.3 * a) * *size)
            break;
    }
    if (!(best <= WORSE * *size))
        return 0;
    for (int32_t i = begin; i < end; i++)
        s->v[i] -= length * s->step[i];
    *size = length == looked ? best : perp__proximal_evaluate(s, part, rho, s->v);
    return 1;
}

/* Newton steps for one centre. Returns how many it took, negative where they failed. */
static int32_t solve_centre(perp__proximal *s, const perp__proximal_part *part, double rho)
{
    const double enough = perp__proximal_enough(s, part);
    double size;
    int32_t slow = 0;

    memset(s->v + (size_t)part->block * (size_t)s->width, 0,
           (size_t)(part->last_block - part->block) * (size_t)s->width * sizeof *s->v);
    size = perp__proximal_evaluate(s, part, rho, s->v);
    for (int32_t step = 1; step <= STEPS && s->factorisations < s->limit; step++) {
        const double before = size;

        perp__proximal_slopes(s, part, rho);
        s->factorisations++;
        if (!perp__proximal_factor(s, part))
            return -step;
        perp__proximal_solve(s, part, rho, s->rhs, s->step);
        if (!move(s, part, rho, &size))
            return -step;
        if (size < enough)
            return step;
        slow += size > SLOW * before;
        if (slow >= SLOW_STEPS)
            return -step;
    }
    return -STEPS;
}

static double growth(int32_t steps)
{
    return steps <= 1 ? 32.0 : steps <= 3 ? 4.0 : steps <= 6 ? 2.0 : steps <= 10 ? 1.5 : 1.0;
}

/* The next centre, judged. */
static void take(perp__proximal *s, const perp__proximal_part *part, double residual)
{
    const size_t bytes = (size_t)(part->last_row - part->row) * sizeof *s->x;

    memcpy(s->x + part->row, s->start + part->row, bytes);
    memcpy(s->speed + part->row, s->spare + part->row, bytes);
    s->residual = residual;
}

/* The path from a solution with less rho; the next centre is on it. Returns 0 where that fails. */
static int32_t follow_centre(perp__proximal *s, const perp__proximal_part *part, double *rho,
                             int32_t most)
{
    double there = EASIER * *rho;

    if (solve_centre(s, part, there) < 0 || !perp__proximal_follow(s, part, &there, most))
        return 0;
    take(s, part, perp__proximal_judge(s, part, s->start, s->spare));
    *rho = fmin(MOST_RHO, there);
    return 1;
}

perp_status perp__proximal_newton_run(perp__proximal *s, const perp__proximal_part *part,
                                      double rho, int32_t most, int32_t follows)
{
    const size_t rows = (size_t)(part->last_row - part->row);
    const int64_t last = s->factorisations + most;
    perp_status status = PERP_OK;
    int32_t failures = 0, stale = 0;

    s->residual = perp__proximal_judge(s, part, s->x, s->speed);
    while (s->factorisations < last && perp__proximal_goes_on(s, status, s->aim) &&
           failures < FAILURES && stale < PATIENCE) {
        const double best = s->best_residual;
        int32_t steps;
        double found;

        s->outcome = perp__proximal_tick(s, &status);
        if (s->outcome >= 0)
            break;
        steps = solve_centre(s, part, rho);
        memcpy(s->start + part->row, s->y + part->row, rows * sizeof *s->x);
        found = perp__proximal_judge(s, part, s->start, s->spare);
        if (s->best_residual <= s->tol && !(found < 0.5 * s->residual))
            break;
        stale = s->best_residual < 0.9 * best ? 0 : stale + 1;
        if (steps > 0 || found < 0.5 * s->residual) {
            take(s, part, found);
            rho = fmin(MOST_RHO, rho * growth(steps < 0 ? -steps : steps));
            continue;
        }
        if (follows && follow_centre(s, part, &rho, (int32_t)(last - s->factorisations)))
            continue;
        failures++;
        status = perp__proximal_split_run(s, part, SOFT_RHO, SWEEPS);
        s->residual = perp__proximal_judge(s, part, s->x, s->speed);
        rho = fmax(1.0, rho / 4.0);
    }
    return status;
}
