/* What a leaf of the tree stands for: a point, or the polyhedron z(t) = origin + sum t_k
 * directions_k in the variables t that the equations of a singular block leave free, as long as all
 * bounds and signs hold. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "base/outcome.h"
#include "lcp/all/all.h"

/* Scaled numbers that differ by less, beside the largest, are the same. */
static const double same = 1e-8;
/* A solution whose rows are all farther than this from changing their place has an index set of its
 * own: no other leaf can find it. */
static const double clear_margin = 1e-6;

static double *direction(const perp__lcp_all *all, int32_t k)
{
    return all->directions + (size_t)k * (size_t)all->n;
}

/* ---- points -------------------------------------------------------------------------------- */

perp__evaluation perp__lcp_all_evaluate(perp__lcp_all *all, const int8_t *places, const double *z)
{
    perp_lcp_solver *solver = all->solver;

    for (int32_t i = 0; i < all->n; i++)
        solver->z[i] = places[i] == PERP__BETWEEN    ? perp__z_exact(solver, i, z[i])
                       : places[i] == PERP__AT_UPPER ? solver->upper[i]
                                                     : solver->lower[i];
    return perp__evaluate(solver);
}

bool perp__lcp_all_is_solution(perp__lcp_all *all, const perp__evaluation *residuals, double size)
{
    const perp__evidence evidence = perp__lcp_evidence(all->solver, residuals, fmax(1.0, size));

    return perp__is_good(perp__gate(&evidence, all->solver->settings.tol, -1));
}

/* In the search for the first solution: takes the point just evaluated if the gate does. */
static void offer(perp__lcp_all *all, const perp__evaluation *residuals)
{
    all->found = perp__is_good(perp__lcp_outcome_of(all->solver, residuals, PERP_OUTCOME_STALLED));
    all->tree.ended |= all->found;
}

/* The solver's point, which solves the problem: told at once where its index set is its own. */
static perp_status keep_point(perp__lcp_all *all, double residual)
{
    perp_lcp_solver *solver = all->solver;
    perp__answer *answer;
    int32_t clear = 1, lost = 0, i; /* lost: to the end of doubles */

    perp__read_places(solver, solver->places);
    for (i = 0; i < all->n && clear; i++)
        clear = perp__margin_of(solver, i) > clear_margin;
    if (clear && memcmp(solver->places, all->places, (size_t)all->n) != 0)
        return PERP_OK; /* the polish went over to a solution that has a leaf of its own */
    answer = perp__answer_create(&all->answers, 1);
    if (!answer)
        return perp__fail_memory(all->context, "a solution");
    answer->residual = residual;
    memcpy(answer->pattern, solver->places, (size_t)all->n);
    for (i = 0; i < all->n; i++) {
        answer->points[i] = perp__z_scaled(solver, i, solver->z[i]);
        lost |= solver->places[i] == PERP__BETWEEN &&
                perp__z_exact(solver, i, answer->points[i]) != solver->z[i];
    }
    if (lost) {
        all->answers.incomplete = 1;
        perp__answer_release(&all->answers, answer);
    } else if (clear) {
        perp__lcp_all_report(all, answer);
        perp__answer_release(&all->answers, answer);
    } else {
        perp__answers_keep(&all->answers, answer);
    }
    return PERP_OK;
}

perp_status perp__lcp_all_point(perp__lcp_all *all)
{
    perp_lcp_solver *solver = all->solver;
    perp__evaluation residuals = perp__lcp_all_evaluate(all, all->places, all->z);
    perp_status status = PERP_OK;

    if (!isfinite(residuals.tested)) {
        all->answers.incomplete = 1;
        return PERP_OK;
    }
    memcpy(solver->places, all->places, (size_t)all->n);
    if (!(residuals.backward <= 4.0 * DBL_EPSILON && residuals.tested <= solver->settings.tol))
        status = perp__polish_run(
            solver, &residuals,
            perp__is_good(perp__lcp_outcome_of(solver, &residuals, PERP_OUTCOME_STALLED)));
    if (status == PERP_OK && all->first)
        offer(all, &residuals);
    if (status != PERP_OK || all->first || !perp__lcp_all_is_solution(all, &residuals, 0.0))
        return status;
    return keep_point(all, residuals.tested);
}

/* ---- inclusion ----------------------------------------------------------------------------- */

/* Whether z (constant = 1) or every point along it (0) keeps the equations of an index set: the
 * bounds first, which cost nothing. */
static bool keeps_equations(const perp__lcp_all *all, const int8_t *places, const double *z,
                            bool constant)
{
    const perp_lcp_solver *solver = all->solver;
    const double largest = perp__largest(z, all->n);
    const double size = constant ? fmax(1.0, largest) : largest;

    for (int32_t i = 0; i < all->n; i++) {
        const double bound = !constant                     ? 0.0
                             : places[i] == PERP__AT_UPPER ? solver->upper_scaled[i]
                                                           : solver->lower_scaled[i];

        if (places[i] != PERP__BETWEEN && !(fabs(z[i] - bound) <= same * size))
            return 0;
    }
    for (int32_t i = 0; i < all->n; i++) {
        const double *row = perp__row_of(all, &all->levels[0], i);
        double sum = constant ? row[all->n] : 0.0;

        if (places[i] != PERP__BETWEEN)
            continue;
        for (int32_t j = 0; j < all->n; j++)
            sum += row[j] * z[j];
        if (!(fabs(sum) <= same * (all->row_sizes[i] * size + fabs(row[all->n]))))
            return 0;
    }
    return 1;
}

/* Points of `inner` are solutions, so only the equations of `outer` are left to check. */
int32_t perp__lcp_all_holds(void *user, perp__answer *outer, const perp__answer *inner)
{
    const perp__lcp_all *all = user;

    for (int32_t k = 0; k < inner->vertices + inner->rays; k++)
        if (!keeps_equations(all, outer->pattern, inner->points + (size_t)k * (size_t)all->n,
                             k < inner->vertices))
            return 0;
    return 1;
}

/* Whether z = origin + sum t_k directions_k, for all t, keeps the equations of a family kept. */
static bool is_covered(const perp__lcp_all *all, int32_t count)
{
    const perp__answer *family;

    for (family = all->answers.first; family; family = family->next) {
        bool covered =
            family->dimension > 0 && keeps_equations(all, family->pattern, all->origin, 1);

        for (int32_t k = 0; k < count && covered; k++)
            covered = keeps_equations(all, family->pattern, direction(all, k), 0);
        if (covered)
            return 1;
    }
    return 0;
}

/* ---- families ------------------------------------------------------------------------------ */

static void find_affine_set(perp__lcp_all *all, const perp__tableau *level)
{
    const int32_t n = all->n;

    memset(all->directions, 0, (size_t)level->pending * (size_t)n * sizeof *all->directions);
    for (int32_t i = 0; i < n; i++)
        all->origin[i] = all->places[i] == PERP__BETWEEN    ? 0.0
                         : all->places[i] == PERP__AT_UPPER ? all->solver->upper_scaled[i]
                                                            : all->solver->lower_scaled[i];
    for (int32_t i = 0; i < n; i++) {
        const double *T = perp__row_of(all, level, i);

        if (level->kind[i] != PERP__ROW_Z)
            continue;
        all->origin[level->basic[i]] = T[n];
        for (int32_t k = 0; k < level->pending; k++)
            direction(all, k)[level->basic[i]] = T[level->columns[k]];
    }
    for (int32_t k = 0; k < level->pending; k++)
        direction(all, k)[level->columns[k]] = 1.0;
}

/* sign (constant + row . z) >= 0 */
static void cut(perp__lcp_all *all, double sign, double constant, const double *row)
{
    perp__inequality g = {sign * constant, 0.0, all->work, 0};

    for (int32_t j = 0; j < all->n; j++)
        all->work[j] = sign * row[j];
    perp__polyhedron_cut(&all->polyhedron, &g);
}

/* Leaves the vertices that solve the problem, and the rays that lead from the first one to points
 * that do; these get a largest entry of 1. */
static void check_points(perp__lcp_all *all, perp__answer *answer)
{
    const size_t n = (size_t)all->n;
    const int32_t vertices = answer->vertices, rays = answer->rays;
    double *to = answer->points;

    answer->residual = 0.0;
    answer->vertices = answer->rays = 0;
    for (int32_t k = 0; k < vertices + rays; k++) {
        const double *z = answer->points + (size_t)k * n;
        const double size = k < vertices ? 1.0 : perp__largest(z, all->n);
        const double reach = fmax(1.0, perp__largest(answer->points, all->n));
        perp__evaluation residuals;

        for (size_t i = 0; i < n; i++)
            all->z[i] = k < vertices ? z[i] : answer->points[i] + reach * (z[i] / size);
        if (k >= vertices && answer->vertices == 0)
            continue;
        residuals = perp__lcp_all_evaluate(all, all->places, all->z);
        if (!perp__lcp_all_is_solution(all, &residuals, perp__largest(all->z, all->n)))
            continue;
        if (k < vertices)
            answer->residual = fmax(answer->residual, residuals.tested);
        *(k < vertices ? &answer->vertices : &answer->rays) += 1;
        for (size_t i = 0; i < n; i++)
            to[i] = z[i] / size;
        to += n;
    }
}

static int32_t find_dimension(const perp__lcp_all *all, const perp__answer *answer)
{
    const int32_t n = all->n;
    const double least = same * fmax(1.0, perp__largest(answer->points, n));
    int32_t rank = 0, i, k;

    for (k = 1; k < answer->vertices + answer->rays && rank < n; k++) {
        const double *point = answer->points + (size_t)k * (size_t)n;
        double *x = all->work + (size_t)rank * (size_t)n, size;

        for (i = 0; i < n; i++)
            x[i] = point[i] - (k < answer->vertices ? answer->points[i] : 0.0);
        size = perp__largest(x, n);
        if (size > least)
            rank = perp__rank_add(all->work, rank, n, same * size);
    }
    return rank;
}

perp_status perp__lcp_all_family(perp__lcp_all *all, const perp__tableau *level)
{
    const size_t n = (size_t)all->n;
    perp__polyhedron *p = &all->polyhedron;
    perp__answer *answer = NULL;
    double *unit = all->work + n;
    perp_status status;

    find_affine_set(all, level);
    if (!perp__all_finite(all->origin, n) ||
        !perp__all_finite(all->directions, n * (size_t)level->pending)) {
        all->answers.incomplete = 1;
        return PERP_OK;
    }
    if (is_covered(all, level->pending))
        return PERP_OK;
    status = perp__polyhedron_begin(p, 2 * all->n, level->pending);
    if (status != PERP_OK)
        return status;
    /* bounds of what is between them, signs of w at the others */
    for (int32_t i = 0; i < all->n; i++) {
        const double l = all->solver->lower_scaled[i], u = all->solver->upper_scaled[i];
        const double *row = perp__row_of(all, &all->levels[0], i);

        memset(unit, 0, n * sizeof *unit);
        unit[i] = 1.0;
        if (all->places[i] == PERP__AT_LOWER)
            cut(all, 1.0, row[n], row);
        else if (all->places[i] == PERP__AT_UPPER)
            cut(all, -1.0, row[n], row);
        if (all->places[i] == PERP__BETWEEN && l > -INFINITY)
            cut(all, 1.0, -l, unit);
        if (all->places[i] == PERP__BETWEEN && u < INFINITY)
            cut(all, -1.0, -u, unit);
    }
    status = perp__polyhedron_enumerate(p, &all->answers);
    if (status == PERP_OK && !all->first)
        status = perp__polyhedron_list(p, &all->answers, &answer);
    /* In the search for the first solution the vertices are offered until one is taken. */
    for (int32_t k = 0; status == PERP_OK && all->first && k < p->cone.rays && !all->found; k++)
        if (perp__polyhedron_is_vertex(p, k)) {
            perp__evaluation residuals;

            perp__polyhedron_point(p, k, 1.0, all->z);
            residuals = perp__lcp_all_evaluate(all, all->places, all->z);
            offer(all, &residuals);
        }
    if (!answer)
        return status;
    check_points(all, answer);
    if (answer->vertices == 0) {
        perp__answer_release(&all->answers, answer);
        return PERP_OK;
    }
    memcpy(answer->pattern, all->places, n);
    answer->dimension = find_dimension(all, answer);
    perp__answers_keep(&all->answers, answer);
    return PERP_OK;
}
