/* Lemke's method: friction cones as polyhedra, the contact problem as an LCP (Stewart & Trinkle
 * 1996; Anitescu & Potra 1997). For each contact, with directions d_1 .. d_k that span its tangent
 * plane positively, r_t = sum_j beta_j d_j and
 *
 *   0 <= r_n    perp  u_n             >= 0
 *   0 <= beta_j perp  d_j'u_t + lambda >= 0
 *   0 <= lambda perp  mu r_n - sum_j beta_j >= 0
 *
 * and the same for rolling and spinning friction; bilateral rows are equations. At the solution
 * lambda is the slip speed against the polygon: lambda = 0 is stick, r_n = 0 separation. Of a
 * contact that holds both ways r_N is free, u_N = 0, and
 *
 *   0 <= z  perp  e'r_N + z >= 0,     mu (e'r_N + 2 z) - sum_j beta_j  in the last row,
 *
 * as z is the negative part of e'r_N. With one normal e = 1 and that is exact; with more, e is
 * where the last answer pushed.
 *
 * A row with one tangent takes two opposite directions, which is exact. */
#include <math.h>

#include <perp/contact.h>

#include "base/clock.h"
#include "base/context.h"
#include "base/outcome.h"
#include "contact/law.h"
#include "contact/pyramid/pyramid.h"

/* Attempts after the first look closer: each disc's polygon has its vertices near the direction in
 * which the last answer pushed and further and further apart from there on. In the window, `width`
 * radians to either side of the middle, the error is of second order in it. An answer in the window
 * narrows it. */
#define WIDTH 0.2  /* of attempt 1 */
#define LEAST 1e-6 /* narrower, the vertices could hardly be told apart */
#define NARROWER 0.125

/* More unknowns than this are more than pivoting serves. */
enum { MOST_UNKNOWNS = 20000 };

static perp_status check(const perp__contact_problem *problem)
{
    const int64_t n = perp__pyramid_count(problem);

    if (problem->cone > 0 && problem->two_sided)
        return perp__refuse(problem->context,
                            "settings.cone is %d, expected 0 with contacts that hold both ways",
                            (int)problem->cone);
    if (n <= MOST_UNKNOWNS)
        return PERP_OK;
    return perp__refuse(problem->context,
                        "the method lemke takes up to %d unknowns, and the contacts' polyhedral "
                        "cones have %lld",
                        (int)MOST_UNKNOWNS, (long long)n);
}

static void layout(perp__arena *arena, void *work)
{
    perp__pyramid *p = work;
    const perp__contact_problem *problem = p->base.problem;
    const size_t n = (size_t)perp__pyramid_count(problem), size = (size_t)problem->size;

    p->n = (int32_t)n;
    p->unknowns = perp__arena_take(arena, n, sizeof(perp__unknown));
    p->M = perp__arena_take(arena, n, n * sizeof(double));
    PERP__DOUBLES(arena, n, &p->q, &p->lower, &p->z, &p->direction);
    PERP__DOUBLES(arena, 3 * (size_t)problem->contacts, &p->angles, &p->widths, &p->sides);
    PERP__DOUBLES(arena, size, &p->impulse, &p->per_velocity);
    p->W = problem->W->column_starts ? perp__arena_take(arena, size, size * sizeof(double)) : NULL;
}

/* The next windows: about where the discs of r push, or, where there is no impulse, would push
 * first. */
static void set_windows(perp__pyramid *p, const double *r, const double *u)
{
    const perp__contact_problem *problem = p->base.problem;

    for (int32_t k = 0; k < problem->contacts; k++) {
        perp__contact_part parts[3];
        const int32_t count = perp__contact_parts(problem, k, parts);

        for (int32_t c = 0; c < count; c++) {
            const double *x = r + parts[c].row, *y = u + parts[c].row;
            double *angle = &p->angles[3 * k + c], *width = &p->widths[3 * k + c];
            const double last = p->regular ? 0.0 : *angle; /* of no account after regular ones */
            double turn;

            if (parts[c].size != 2)
                continue;
            *angle = x[0] != 0.0 || x[1] != 0.0 ? atan2(x[1], x[0]) : atan2(0.0 - y[1], 0.0 - y[0]);
            turn = fabs(remainder(*angle - last, 2.0 * 3.14159265358979323846));
            *width = p->regular       ? WIDTH
                     : turn <= *width ? fmax(LEAST, NARROWER * *width)
                                      : fmin(WIDTH, turn);
        }
    }
}

/* e of contacts that hold both ways: along r_N, or, where there is none, against u_N. */
static void set_sides(perp__pyramid *p, const double *r, const double *u)
{
    const perp__contact_problem *problem = p->base.problem;

    for (int32_t k = 0; k < problem->contacts; k++) {
        const int32_t row = problem->starts[k], end = row + perp__contact_two_sided(problem, k);
        const double length = perp__contact_length(r, row, end);
        const double speed = perp__contact_length(u, row, end);
        double *e = p->sides + 3 * (size_t)k;

        for (int32_t i = row; i < end; i++)
            e[i - row] = end - row == 1 ? 1.0
                         : length > 0.0 ? r[i] / length
                         : speed > 0.0  ? -u[i] / speed
                                        : i == row;
    }
}

/* Whether M and q are numbers: in the units of their contacts they may overflow where W and q are
 * at the ends of what there is. */
static int32_t can_be_posed(const perp__pyramid *p)
{
    const size_t n = (size_t)p->n;

    return perp__all_finite(p->M, n * n) && perp__all_finite(p->q, n);
}

static int32_t watch(const perp_lcp_progress *progress, void *user)
{
    const perp__contact_control *control = user;

    return control->tick(control->tick_user, progress->iterations, progress->residual);
}

/* A solver for this call's tolerance and limits. */
static perp_status prepare(perp__pyramid *p)
{
    const perp__contact_problem *problem = p->base.problem;
    perp_lcp_settings settings;
    const perp_matrix M = perp__view(PERP_STORAGE_COLUMN_MAJOR, p->n, p->n, p->M);
    perp_status status = perp_lcp_settings_init(&settings, sizeof settings);

    settings.tol = fmin(settings.tol, problem->tol);
    settings.monitor = watch;
    settings.monitor_user = (void *)(uintptr_t)problem->control;
    if (problem->control->deadline > 0.0)
        settings.time_limit = perp__time_left(problem->control->deadline);
    if (problem->iteration_limit > 0)
        settings.max_iterations = (int32_t)problem->iteration_limit;
    if (status == PERP_OK && !p->lcp)
        status = perp__lcp_create(problem->context, &p->lcp, &settings);
    if (p->lcp)
        perp__lcp_insist(p->lcp, problem->two_sided != NULL);
    PERP__THEN(status, perp__lcp_set(p->lcp, &settings));
    return status == PERP_OK ? perp__lcp_setup(p->lcp, &M, p->lower, NULL) : status;
}

static perp_status solve(void *work, perp__contact_iterate *iterate)
{
    perp__pyramid *p = work;
    const perp__contact_problem *problem = p->base.problem;
    perp_lcp_result result;
    perp_status status = perp_lcp_result_init(&result, sizeof result);

    p->regular = iterate->attempt == 0 || problem->cone > 0;
    if (p->regular)
        set_sides(p, iterate->r, problem->q);
    perp__pyramid_number(p);
    perp__pyramid_spread(p);
    iterate->outcome = PERP_OUTCOME_TIME_LIMIT;
    if (status != PERP_OK || !perp__pyramid_fill_impulses(p))
        return status; /* with the start */
    perp__pyramid_fill_speeds(p);
    if (!can_be_posed(p)) { /* the caller's numbers are finite: no error of theirs */
        iterate->outcome = PERP_OUTCOME_STALLED;
        return PERP_OK;
    }
    status = prepare(p);
    PERP__THEN(status, perp__lcp_solve(p->lcp, p->z, NULL, p->direction, &result, p->q, NULL));
    if (status != PERP_OK)
        return status;
    perp__pyramid_gather(p, p->z, iterate->r);
    perp__multiply(problem->W, iterate->r, iterate->u);
    for (int32_t i = 0; i < problem->size; i++)
        iterate->u[i] += problem->q[i];
    set_windows(p, iterate->r, iterate->u);
    set_sides(p, iterate->r, iterate->u);
    iterate->outcome = result.outcome;
    iterate->iterations = result.iterations;
    if (result.outcome == PERP_OUTCOME_RAY)
        perp__pyramid_gather(p, p->direction, iterate->ray);
    /* an exact cone's contacts may do something else than the polyhedron's */
    if ((result.outcome == PERP_OUTCOME_SOLVED || result.outcome == PERP_OUTCOME_ROUNDING_LIMIT) &&
        problem->cone > 0) {
        perp__pyramid_modes(p, iterate->modes);
        iterate->has_modes = 1;
    }
    return PERP_OK;
}

static void release(void *work)
{
    perp__pyramid *p = work;

    perp__lcp_destroy(p->lcp);
    p->lcp = NULL;
}

const perp__contact_method perp__contact_lemke = {
    PERP_CONTACT_METHOD_LEMKE, sizeof(perp__pyramid), 1, 1, 0, check, layout, solve, release};
