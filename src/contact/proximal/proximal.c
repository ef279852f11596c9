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

int32_t perp__proximal_goes_on(const perp__proximal *s, double enough)
{
    return s->outcome < 0 && s->best_residual > enough;
}

void perp__proximal_split_run(perp__proximal *s, const perp__proximal_part *part, double rho,
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

/* From a start as long as that leads on, or from no impulses, which lead to the inside of the
 * cones, sweeps to their edges: what is easy has an answer from there before an interior point had.
 * What is not begins again in one. */
static void run_first(perp__proximal *s, const perp__proximal_part *part, int32_t given)
{
    if (given)
        perp__proximal_newton_run(s, part, PERP__WARM_RHO, STEPS, IN_VAIN);
    if (perp__proximal_goes_on(s, s->tol) && (!given || s->discs)) {
        for (int32_t i = part->row; i < part->last_row; i++)
            s->x[i] = 0.0;
        perp__proximal_split_run(s, part, PERP__FIRST_RHO, SWEEPS);
        if (perp__proximal_goes_on(s, s->tol))
            perp__proximal_split_run(s, part, PERP__CENTRE_RHO, SWEEPS);
        if (perp__proximal_goes_on(s, s->aim))
            perp__proximal_newton_run(
                s, part, s->best_residual <= s->tol ? PERP__WARM_RHO : PERP__CENTRE_RHO, STEPS,
                s->discs ? STEPS : IN_VAIN);
    }
    if (!s->discs && perp__proximal_goes_on(s, s->tol)) {
        perp__proximal_interior_run(s, part);
        if (perp__proximal_goes_on(s, s->aim))
            perp__proximal_newton_run(s, part, PERP__WARM_RHO, STEPS,
                                      s->folds ? 2 * IN_VAIN : STEPS);
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
        perp__proximal_split_run(s, part, rho[k % 2], k < 2 ? SWEEPS : LONG_SWEEPS);
    if (newton && iterate->attempt == 0 && perp__proximal_goes_on(s, s->tol))
        run_first(s, part, iterate->given);
    else if (newton && perp__proximal_goes_on(s, s->tol))
        perp__proximal_newton_run(s, part, PERP__CENTRE_RHO, steps, patience);

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

static perp_status solve(void *work, perp__contact_iterate *iterate, int32_t splits)
{
    perp__proximal *s = work;
    const perp__contact_problem *problem = s->common.problem;
    perp_status status = perp__proximal_read(s);

    iterate->outcome = PERP_OUTCOME_STALLED;
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
        run_part(s, &s->part[p], iterate);
        if (s->outcome >= 0 && s->outcome != PERP_OUTCOME_STALLED)
            break;
    }
    iterate->iterations = splits ? s->sweeps : s->factorisations;
    if (s->outcome >= 0)
        iterate->outcome = s->outcome;
    else if (iterate->residual <= s->tol)
        iterate->outcome = PERP_OUTCOME_SOLVED;
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
    perp__proximal *s = work;

    perp__fronts_release(&s->fronts);
}

const perp__contact_method perp__contact_proximal = {PERP_CONTACT_METHOD_PROXIMAL,
                                                     sizeof(perp__proximal),
                                                     2,
                                                     0,
                                                     check,
                                                     perp__proximal_layout,
                                                     solve_proximal,
                                                     release,
                                                     perp__proximal_read};

const perp__contact_method perp__contact_admm = {.id = PERP_CONTACT_METHOD_ADMM,
                                                 .work_size = sizeof(perp__proximal),
                                                 .attempts = 1,
                                                 .check = check,
                                                 .layout = perp__proximal_layout,
                                                 .solve = solve_admm,
                                                 .release = release};
