/* Methods `admm` and `proximal`, part after part: alternating directions for a middle accuracy; and
 * the proximal Newton method, from there, and from where an interior point has come to
 * (interior.c).
 *
 * Alternating directions (Boyd et al., Foundations and Trends in ML 3 (2011) 1) on
 *
 *   v = J'r,  y = J v + q,  r = P(r - rho y)
 *
 * with the law of each contact as it stands in the place of a projection: r = P(-z), y = (z + r) /
 * rho, v = (I + rho J'J)^-1 J'(r - rho (q - y)), z = rho (J v + q) - r, the speeds over-relaxed.
 * One factorisation for all sweeps. */
#include "contact/proximal/proximal.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include <perp/contact.h>

#include "base/context.h"
#include "contact/law.h"

/* Who asks for less than this, or for this method, has what a few more steps give, down to
 * rounding. */
#define SHARP 1e-9

enum {
    SWEEPS = 30,
    LONG_SWEEPS = 120,
    MOST_SWEEPS = 1200, /* of admm */
    STEPS = 100,
    MORE_STEPS = 1000, /* of the second attempt; */
    MANY = 2000,       /* of a part with more rows than this, */
    FEW_STEPS = 300,   /* so many; and in a plan that many in vain */
    IN_VAIN = 15,      /* that do not halve the residual: half of what an interior point takes */
    LOOK = 10          /* sweeps after which the residual is looked at */
};

static perp_status check(const perp__contact_problem *problem)
{
    if (!problem->bodies && perp__proximal_couplings(problem) > INT32_MAX)
        return perp__refuse(problem->context,
                            "W has too many couplings for methods admm, newton and proximal");
    return PERP_OK;
}

int32_t perp__proximal_asks_to_stop(const perp__proximal *s)
{
    const int64_t count = s->splits ? s->sweeps : s->factorisations;

    return count >= s->limit
               ? PERP_OUTCOME_ITERATION_LIMIT
               : perp__contact_asks_to_stop(s->common.problem->control, count, s->residual);
}

bool perp__proximal_goes_on(const perp__proximal *s, double enough)
{
    return s->outcome < 0 && s->best_residual > enough;
}

/* From s->x. So many sweeps, fewer where the residual, looked at now and then, comes to tol.
 * s->outcome >= 0 where it was stopped. */
static void run_splits(perp__proximal *s, const perp__proximal_part *part, double rho,
                       int32_t sweeps)
{
    const size_t begin = (size_t)part->block * (size_t)s->width;
    const size_t end = (size_t)part->last_block * (size_t)s->width;
    const size_t rows = (size_t)(part->last_row - part->row), side = (size_t)s->side;

    s->outcome = perp__proximal_asks_to_stop(s);
    if (s->outcome >= 0)
        return;
    /* 1. Factors of I + rho J'J. */
    for (int32_t k = part->constraint; k < part->last_constraint; k++) {
        double *K = perp__proximal_slope(s, k);

        memset(K, 0, side * side * sizeof *K);
        for (size_t i = 0; i < side; i++)
            K[side * i + i] = rho;
    }
    s->factorisations++;
    if (!perp__proximal_factor(s, part)) {
        s->outcome = PERP_OUTCOME_STALLED;
        return;
    }
    /* 2. Sweeps, until the residual comes to tol. */
    perp__proximal_push(s, part, s->x, s->v);
    for (int32_t k = 0; k < sweeps && s->outcome < 0; k++) {
        perp__proximal_split(s, part, rho, k == 0);
        memcpy(s->v + begin, s->rhs + begin, (end - begin) * sizeof *s->v);
        perp__fronts_solve(&s->fronts, part->block, part->last_block, s->v);
        s->sweeps++;
        if ((k + 1) % LOOK == 0 || k + 1 == sweeps) {
            memcpy(s->start + part->row, s->x + part->row, rows * sizeof *s->x);
            s->residual = perp__proximal_residual(s, part, s->start, s->speed);
            if (s->residual <= s->tol)
                break;
            s->outcome = perp__proximal_asks_to_stop(s);
        }
    }
    perp__proximal_project(s, part, s->x);
}

/* ---- Newton's method ----
 *
 * The proximal point method (Rockafellar, SIAM J. Control Optim. 14 (1976) 877) on impulses: from a
 * centre r with speeds u = J J'r + q, the change v of the bodies' velocities with
 *
 *   F(v) = v - J' (P(r - rho (u + J v)) - r) = 0
 *
 * by semismooth Newton steps (Qi & Sun 1993) with I + J' (rho P') J, then the next centre is
 * P(r - rho (u + J v)), and rho grows where few steps were needed: near a solution u is small, and
 * so is what rho makes of its rounding. Where the steps fail, as F is no gradient, rho is less: a
 * softer centre is nearer. */
/* The largest rho, which leaves PERP__RIDGE; and that from which on solutions are refined. */
#define MOST_RHO (1.0 / PERP__RIDGE)
#define REFINED (PERP__FIRST_RHO * PERP__WARM_RHO)
#define WORSE 3.0

enum { CENTRE_STEPS = 20, HALVINGS = 6 };

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

void perp__proximal_find_step(perp__proximal *s, const perp__proximal_part *part, bool refines)
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
    for (int32_t step = 1; step <= CENTRE_STEPS && s->factorisations < s->limit; step++) {
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
    return -CENTRE_STEPS;
}

/* From s->x, as above. It ends after `most` factorisations, after `patience` of them in which the
 * residual has not halved, and, tol met, where a centre has not halved it. */
static void run_newton(perp__proximal *s, const perp__proximal_part *part, double rho, int32_t most,
                       int32_t patience)
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

/* ---- a part ---- */

/* From a start as long as that leads on, or from no impulses, which lead to the inside of the
 * cones, sweeps to their edges: what is easy has an answer from there before an interior point had.
 * What is not begins again in one. */
static void run_first(perp__proximal *s, const perp__proximal_part *part, bool given)
{
    if (given)
        run_newton(s, part, PERP__WARM_RHO, STEPS, IN_VAIN);
    if (perp__proximal_goes_on(s, s->tol) && (!given || s->discs)) {
        for (int32_t i = part->row; i < part->last_row; i++)
            s->x[i] = 0.0;
        run_splits(s, part, PERP__FIRST_RHO, SWEEPS);
        if (perp__proximal_goes_on(s, s->tol))
            run_splits(s, part, PERP__CENTRE_RHO, SWEEPS);
        if (perp__proximal_goes_on(s, s->aim))
            run_newton(s, part, s->best_residual <= s->tol ? PERP__WARM_RHO : PERP__CENTRE_RHO,
                       STEPS, s->discs ? STEPS : IN_VAIN);
    }
    if (!s->discs && perp__proximal_goes_on(s, s->tol)) {
        perp__proximal_interior_run(s, part);
        if (perp__proximal_goes_on(s, s->aim))
            run_newton(s, part, PERP__WARM_RHO, STEPS, s->folds ? 2 * IN_VAIN : STEPS);
    }
}

/* Solves a part from iterate->r, where its best point is left. */
static void run_part(perp__proximal *s, const perp__proximal_part *part,
                     perp__contact_iterate *iterate)
{
    /* the stiffness that does best differs from pile to pile */
    static const double rho[] = {PERP__FIRST_RHO, 1.0};
    const perp__contact_problem *problem = s->common.problem;
    const int32_t steps = part->last_row - part->row > MANY ? FEW_STEPS : MORE_STEPS;
    const int32_t patience = problem->chosen ? steps : FEW_STEPS, newton = !s->splits;

    /* 1. x from r. */
    s->best_residual = INFINITY;
    s->outcome = -1;
    s->folds = 0;
    for (int32_t k = part->constraint; k < part->last_constraint; k++) {
        const double omega = problem->omega[s->constraint[k]];
        const double *r = iterate->r + perp__contact_first_row(problem, s->constraint[k]);

        for (int32_t i = s->starts[k]; i < s->starts[k + 1]; i++)
            s->x[i] = r[i - s->starts[k]] / omega / s->scale[i];
    }
    s->residual = perp__proximal_residual(s, part, s->x, s->speed);

    /* 2. Alternating directions alone; or Newton's method: a second attempt goes on from where
     * the first has come to, the first from a start, or begins without impulses. */
    for (int32_t k = 0; s->splits && perp__proximal_goes_on(s, s->tol); k++)
        run_splits(s, part, rho[k % 2], k < 2 ? SWEEPS : LONG_SWEEPS);
    if (newton && iterate->attempt == 0 && perp__proximal_goes_on(s, s->tol))
        run_first(s, part, iterate->given);
    else if (newton && perp__proximal_goes_on(s, s->tol))
        run_newton(s, part, PERP__CENTRE_RHO, steps, patience);

    /* 3. r from the best x. */
    for (int32_t k = part->constraint; k < part->last_constraint; k++) {
        const double omega = problem->omega[s->constraint[k]];
        double *r = iterate->r + perp__contact_first_row(problem, s->constraint[k]);

        for (int32_t i = s->starts[k]; i < s->starts[k + 1]; i++)
            r[i - s->starts[k]] = s->best[i] * omega * s->scale[i];
    }
    iterate->residual = fmax(iterate->residual, s->best_residual);
    iterate->folds |= s->folds;
}

static perp_status solve(void *work, perp__contact_iterate *iterate, bool splits)
{
    perp__proximal *s = work;
    const perp__contact_problem *problem = s->common.problem;
    int64_t sweeps = 0;
    perp_status status = perp__proximal_read(s);

    s->splits = splits;
    s->limit = problem->iteration_limit > 0 ? problem->iteration_limit
               : splits                     ? MOST_SWEEPS
                                            : INT64_MAX;
    s->factorisations = s->sweeps = 0;
    s->tol = fmax(problem->tol, problem->enough);
    s->aim = s->tol < SHARP || problem->chosen ? fmin(s->tol, DBL_EPSILON) : s->tol;
    s->outcome = -1;
    iterate->residual = 0.0;
    for (int32_t p = 0; p < s->parts && status == PERP_OK; p++) {
        s->sweeps = 0; /* a part that takes all leaves the others theirs */
        run_part(s, &s->part[p], iterate);
        sweeps = s->sweeps > sweeps ? s->sweeps : sweeps;
        if (s->outcome >= 0 && s->outcome != PERP_OUTCOME_STALLED &&
            s->outcome != PERP_OUTCOME_ITERATION_LIMIT)
            break;
    }
    iterate->iterations = splits ? sweeps : s->factorisations;
    iterate->outcome = s->outcome >= 0               ? s->outcome
                       : iterate->residual <= s->tol ? PERP_OUTCOME_SOLVED
                       : sweeps >= s->limit          ? PERP_OUTCOME_ITERATION_LIMIT
                                                     : PERP_OUTCOME_STALLED;
    return status;
}

static perp_status solve_proximal(void *work, perp__contact_iterate *iterate)
{
    return solve(work, iterate, 0);
}

static perp_status solve_admm(void *work, perp__contact_iterate *iterate)
{
    return solve(work, iterate, 1);
}

static void release(void *work)
{
    perp__fronts_release(&((perp__proximal *)work)->fronts);
}

const perp__contact_method perp__contact_proximal = {.id = PERP_CONTACT_METHOD_PROXIMAL,
                                                     .work_size = sizeof(perp__proximal),
                                                     .attempts = 2,
                                                     .check = check,
                                                     .layout = perp__proximal_layout,
                                                     .solve = solve_proximal,
                                                     .release = release,
                                                     .reserve = perp__proximal_read};

const perp__contact_method perp__contact_admm = {.id = PERP_CONTACT_METHOD_ADMM,
                                                 .work_size = sizeof(perp__proximal),
                                                 .attempts = 1,
                                                 .check = check,
                                                 .layout = perp__proximal_layout,
                                                 .solve = solve_admm,
                                                 .release = release};
