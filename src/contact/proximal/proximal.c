/* Methods `admm` and `proximal`: alternating directions for a middle accuracy, and, from there, the
 * proximal Newton method; part after part. */
#include "contact/proximal/proximal.h"

#include <math.h>

#include <perp/contact.h>

#include "base/clock.h"
#include "base/context.h"
#include "contact/law.h"

/* Stiffness of the sweeps that Newton's method starts from, and of its first centre. */
#define SOFT_RHO 3.0
#define FIRST_RHO 10.0
#define SECOND_RHO 30.0
#define CENTRE_RHO 100.0
#define WARM_RHO 1e3

/* Where a factorisation is worth so many solves, more sweeps come before Newton's method. */
#define DEAR 15.0

/* Who asks for less than the former, or for this method, has what a few more steps give, down to
 * the latter. */
#define SHARP 1e-9
#define ROUNDING 1e-15

enum {
    SWEEPS = 30,
    FEW_FACTORS = 8, /* of a solve that goes well */
    LONG_SWEEPS = 120,
    MOST_SWEEPS = 1200, /* of admm */
    WARM_SWEEPS = 20,
    WARM_STEPS = 12,
    STEPS = 100,
    PATH_STEPS = 1000, /* of the second attempt, which follows paths; */
    MANY = 2000,       /* of a part with more rows than this, */
    FEW_STEPS = 300    /* so many */
};

static perp_status check(const perp__contact_problem *problem)
{
    if (!problem->bodies && perp__proximal_couplings(problem) > INT32_MAX)
        return perp__refuse(problem->context,
                            "W has too many couplings for methods admm, newton and proximal");
    return PERP_OK;
}

int32_t perp__proximal_tick(perp__proximal *s, perp_status *status)
{
    const perp__contact_control *control = s->common.problem->control;
    const int64_t count = s->splits ? s->sweeps : s->factorisations;

    if (count >= s->limit)
        return PERP_OUTCOME_ITERATION_LIMIT;
    if (!control)
        return -1;
    if (control->deadline > 0.0 && perp__now() >= control->deadline)
        return PERP_OUTCOME_TIME_LIMIT;
    if (control->tick) {
        const int32_t request = control->tick(control->tick_user, count, s->residual);

        if (request < 0)
            *status = PERP_ERROR_CALLBACK;
        if (request != 0)
            return PERP_OUTCOME_STOPPED;
    }
    return -1;
}

int32_t perp__proximal_goes_on(const perp__proximal *s, perp_status status, double enough)
{
    return status == PERP_OK && s->outcome < 0 && s->best_residual > enough;
}

static perp_status run_warm(perp__proximal *s, const perp__proximal_part *part)
{
    perp_status status = perp__proximal_split_run(s, part, SECOND_RHO, WARM_SWEEPS);

    if (perp__proximal_goes_on(s, status, s->aim))
        status = perp__proximal_newton_run(s, part, WARM_RHO, WARM_STEPS, 0);
    return status;
}

/* From no impulses: these lead to the inside of the cones, sweeps to their edges. */
static perp_status run_cold(perp__proximal *s, const perp__proximal_part *part)
{
    perp_status status;

    for (int32_t i = part->row; i < part->last_row; i++)
        s->x[i] = 0.0;
    status = perp__proximal_split_run(s, part, FIRST_RHO, SWEEPS);
    if (perp__proximal_goes_on(s, status, s->tol))
        status = perp__proximal_split_run(s, part, SECOND_RHO, SWEEPS);
    if (perp__fronts_cost(&s->fronts) >= DEAR && perp__proximal_goes_on(s, status, s->tol))
        status = perp__proximal_split_run(s, part, FIRST_RHO, LONG_SWEEPS);
    if (perp__proximal_goes_on(s, status, s->aim))
        status = perp__proximal_newton_run(
            s, part, s->best_residual <= s->tol ? WARM_RHO : CENTRE_RHO, STEPS, 0);
    return status;
}

/* From where the first attempt has come to. */
static perp_status follow_paths(perp__proximal *s, const perp__proximal_part *part)
{
    const int32_t most = part->last_row - part->row > MANY ? FEW_STEPS : PATH_STEPS;

    return perp__proximal_newton_run(s, part, CENTRE_RHO, most, 1);
}

/* The stiffness that does best differs from pile to pile. */
static perp_status run_splits(perp__proximal *s, const perp__proximal_part *part)
{
    static const double rho[] = {FIRST_RHO, SECOND_RHO, FIRST_RHO, SOFT_RHO};
    perp_status status = PERP_OK;

    for (int32_t k = 0; perp__proximal_goes_on(s, status, s->tol); k++)
        status = perp__proximal_split_run(s, part, rho[k % 4], k < 2 ? SWEEPS : LONG_SWEEPS);
    return status;
}

/* x from r and r from x. */
static void load(const perp__proximal *s, const perp__proximal_part *part, const double *r,
                 double *x)
{
    const perp__contact_problem *problem = s->common.problem;

    for (int32_t k = part->constraint; k < part->last_constraint; k++) {
        const double omega = problem->omega[s->constraint[k]];
        const double *from = r + perp__contact_first_row(problem, s->constraint[k]);

        for (int32_t i = s->starts[k]; i < s->starts[k + 1]; i++)
            x[i] = from[i - s->starts[k]] / omega / s->scale[i];
    }
}

static void store(const perp__proximal *s, const perp__proximal_part *part, const double *x,
                  double *r)
{
    const perp__contact_problem *problem = s->common.problem;

    for (int32_t k = part->constraint; k < part->last_constraint; k++) {
        const double omega = problem->omega[s->constraint[k]];
        double *to = r + perp__contact_first_row(problem, s->constraint[k]);

        for (int32_t i = s->starts[k]; i < s->starts[k + 1]; i++)
            to[i - s->starts[k]] = x[i] * omega * s->scale[i];
    }
}

static perp_status run_part(perp__proximal *s, const perp__proximal_part *part,
                            perp__contact_iterate *iterate)
{
    perp_status status = PERP_OK;

    s->best_residual = INFINITY;
    s->outcome = -1;
    load(s, part, iterate->r, s->x);
    s->residual = perp__proximal_judge(s, part, s->x, s->speed);
    if (s->splits)
        status = run_splits(s, part);
    else if (iterate->attempt > 0 && perp__proximal_goes_on(s, status, s->tol))
        status = follow_paths(s, part);
    else if (iterate->given && perp__proximal_goes_on(s, status, s->tol))
        status = run_warm(s, part);
    if (!s->splits && iterate->attempt == 0 && perp__proximal_goes_on(s, status, s->tol))
        status = run_cold(s, part);
    store(s, part, s->best, iterate->r);
    if (s->best_residual > iterate->residual)
        iterate->residual = s->best_residual;
    return status;
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
    s->tol = problem->tol;
    s->aim = s->tol < SHARP || problem->chosen ? fmin(s->tol, ROUNDING) : s->tol;
    s->outcome = -1;
    iterate->residual = 0.0;
    for (int32_t p = 0; p < s->parts && status == PERP_OK; p++) {
        status = run_part(s, &s->part[p], iterate);
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

perp_status perp__proximal_worth(void *work, double *sweeps)
{
    perp__proximal *s = work;
    const perp_status status = perp__proximal_read(s);
    double values = 1.0;

    if (status != PERP_OK)
        return status;
    for (int32_t k = 0; k < s->constraints; k++)
        values += (double)(s->piece_starts[k + 1] - s->piece_starts[k]) *
                  (s->starts[k + 1] - s->starts[k]) * s->width;
    *sweeps = (2.0 * SWEEPS + FEW_FACTORS * perp__fronts_cost(&s->fronts)) *
              perp__fronts_solve_cost(&s->fronts) / values;
    return PERP_OK;
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

const perp__contact_method perp__contact_proximal = {
    PERP_CONTACT_METHOD_PROXIMAL, sizeof(perp__proximal), 2,       0, 0, check,
    perp__proximal_layout,        solve_proximal,         release,
};

const perp__contact_method perp__contact_admm = {
    PERP_CONTACT_METHOD_ADMM,
    sizeof(perp__proximal),
    1,
    0,
    0,
    check,
    perp__proximal_layout,
    solve_admm,
    release,
};
