/* What a leaf of the tree stands for: a point, or a polyhedron in the free variables of a singular
 * block, given by its vertices and rays. Of polyhedra within each other the largest is kept. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "base/outcome.h"
#include "lcp/all.h"

/* Scaled numbers that differ by less, beside the largest, are the same. */
static const double same = 1e-8;
/* A solution whose rows are all farther than this from changing their place has an index set of its
 * own: no other leaf can find it. */
static const double clear_margin = 1e-6;

static double largest_of(const double *x, int32_t count)
{
    double largest = 0.0;
    int32_t i;

    for (i = 0; i < count; i++)
        largest = fmax(largest, fabs(x[i]));
    return largest;
}

/* ---- evaluation ---------------------------------------------------------------------------- */

perp__evaluation perp__all_evaluate(perp__all *all, const double *z)
{
    perp_lcp_solver *solver = all->solver;
    int32_t i;

    for (i = 0; i < all->n; i++)
        solver->z[i] = all->places[i] == PERP__BETWEEN    ? perp__z_caller(solver, i, z[i])
                       : all->places[i] == PERP__AT_UPPER ? solver->upper[i]
                                                          : solver->lower[i];
    return perp__evaluate(solver);
}

int32_t perp__all_is_solution(const perp__all *all, const perp__evaluation *worth, double size)
{
    const perp__evidence evidence = perp__lcp_evidence(all->solver, worth, fmax(1.0, size));

    return perp__is_good(perp__gate(&evidence, all->solver->settings.tol, -1));
}

static double margin_of(const perp_lcp_solver *solver, int32_t i)
{
    const double w = perp__w_scaled(solver, i, solver->w_high[i]);
    const double above = perp__z_scaled(solver, i, solver->z[i] - solver->lower[i]);
    const double below = perp__z_scaled(solver, i, solver->upper[i] - solver->z[i]);

    switch (solver->places[i]) {
    case PERP__AT_LOWER:
        return w;
    case PERP__AT_UPPER:
        return -w;
    case PERP__FIXED:
        return INFINITY;
    default:
        return fmin(above, below);
    }
}

static int32_t is_clear(const perp__all *all)
{
    int32_t i;

    for (i = 0; i < all->n; i++)
        if (!(margin_of(all->solver, i) > clear_margin))
            return 0;
    return 1;
}

static perp_status keep_point(perp__all *all, double residual)
{
    double *point = perp__allocate(all->context, (size_t)all->n, sizeof *point);
    int32_t i;

    if (!point)
        return perp__fail_memory(all->context, "a solution");
    for (i = 0; i < all->n; i++)
        point[i] = perp__z_scaled(all->solver, i, all->solver->z[i]);
    return perp__all_keep(all, all->solver->places, point, 1, 0, residual);
}

void perp__all_offer(perp__all *all, const perp__evaluation *worth)
{
    all->found = perp__is_good(perp__lcp_judge(all->solver, worth, PERP_OUTCOME_STALLED));
    all->ended |= all->found;
}

perp_status perp__all_point(perp__all *all)
{
    perp_lcp_solver *solver = all->solver;
    perp__evaluation worth = perp__all_evaluate(all, all->z);
    perp_status status = PERP_OK;
    perp__face face;
    int32_t i;

    if (!isfinite(worth.tested)) {
        all->incomplete = 1;
        return PERP_OK;
    }
    memcpy(solver->places, all->places, (size_t)all->n);
    if (!(worth.backward <= 4.0 * DBL_EPSILON && worth.tested <= solver->settings.tol))
        status = perp__polish_run(solver, &worth);
    if (status == PERP_OK && all->first)
        perp__all_offer(all, &worth);
    if (status != PERP_OK || all->first || !perp__all_is_solution(all, &worth, 0.0))
        return status;
    perp__read_places(solver, solver->places);
    if (!is_clear(all))
        return keep_point(all, worth.tested);
    if (memcmp(solver->places, all->places, (size_t)all->n) != 0)
        return PERP_OK; /* the polish went over to a solution that has a leaf of its own */
    memset(&face, 0, sizeof face);
    face.places = all->places;
    face.points = all->z;
    face.vertices = 1;
    face.residual = worth.tested;
    for (i = 0; i < all->n; i++)
        all->z[i] = perp__z_scaled(solver, i, solver->z[i]);
    return perp__all_report(all, &face);
}

/* ---- inclusion ----------------------------------------------------------------------------- */

/* Whether z (constant = 1) or every point along it (0) keeps the equations of an index set: the
 * bounds first, which cost nothing. */
static int32_t keeps_equations(const perp__all *all, const int8_t *places, const double *z,
                               int32_t constant)
{
    const perp_lcp_solver *solver = all->solver;
    const double largest = largest_of(z, all->n);
    const double size = constant ? fmax(1.0, largest) : largest;
    int32_t i, j;

    for (i = 0; i < all->n; i++) {
        const double bound = !constant                     ? 0.0
                             : places[i] == PERP__AT_UPPER ? solver->upper_scaled[i]
                                                           : solver->lower_scaled[i];

        if (places[i] != PERP__BETWEEN && !(fabs(z[i] - bound) <= same * size))
            return 0;
    }
    for (i = 0; i < all->n; i++) {
        const double *row = all->levels[0].T + (size_t)i * (size_t)(all->n + 1);
        double sum = constant ? row[all->n] : 0.0;

        if (places[i] != PERP__BETWEEN)
            continue;
        for (j = 0; j < all->n; j++)
            sum += row[j] * z[j];
        if (!(fabs(sum) <= same * (all->row_sizes[i] * size + fabs(row[all->n]))))
            return 0;
    }
    return 1;
}

/* Points of `inner` are solutions, so only the equations of `outer` are left to check. */
static int32_t holds(const perp__all *all, const perp__face *outer, const perp__face *inner)
{
    int32_t k;

    for (k = 0; k < inner->vertices + inner->rays; k++)
        if (!keeps_equations(all, outer->places, inner->points + (size_t)k * (size_t)all->n,
                             k < inner->vertices))
            return 0;
    /* a point's index set may be regular or not: as the set of one point it holds itself alone */
    return outer->dimension > 0 || inner->dimension == 0;
}

int32_t perp__all_is_covered(const perp__all *all, const double *origin, const double *directions,
                             int32_t count)
{
    const perp__face *face;
    int32_t k;

    for (face = all->faces; face; face = face->next) {
        int32_t covered = face->dimension > 0 && keeps_equations(all, face->places, origin, 1);

        for (k = 0; k < count && covered; k++)
            covered =
                keeps_equations(all, face->places, directions + (size_t)k * (size_t)all->n, 0);
        if (covered)
            return 1;
    }
    return 0;
}

/* Dimension of the hull: the rank of the differences, by orthogonalisation. */
static int32_t find_dimension(perp__all *all, const perp__face *face)
{
    const int32_t n = all->n;
    int32_t rank = 0, i, k, r;

    for (k = 1; k < face->vertices + face->rays && rank < n; k++) {
        const double *point = face->points + (size_t)k * (size_t)n;
        double *x = all->work + (size_t)rank * (size_t)n;
        double size, rest;

        for (i = 0; i < n; i++)
            x[i] = point[i] - (k < face->vertices ? face->points[i] : 0.0);
        size = largest_of(x, n);
        for (r = 0; r < rank; r++) {
            const double *e = all->work + (size_t)r * (size_t)n;
            double dot = 0.0;

            for (i = 0; i < n; i++)
                dot += e[i] * x[i];
            for (i = 0; i < n; i++)
                x[i] -= dot * e[i];
        }
        rest = 0.0;
        for (i = 0; i < n; i++)
            rest += x[i] * x[i];
        rest = sqrt(rest);
        if (!(rest > same * size) || size <= same * fmax(1.0, largest_of(face->points, n)))
            continue;
        for (i = 0; i < n; i++)
            x[i] /= rest;
        rank++;
    }
    return rank;
}

static void release(perp__all *all, perp__face *face)
{
    perp__release(all->context, face->points);
    perp__release(all->context, face->places);
    perp__release(all->context, face);
}

void perp__all_release_faces(perp__all *all)
{
    while (all->faces) {
        perp__face *next = all->faces->next;

        release(all, all->faces);
        all->faces = next;
    }
}

static perp__face *make_face(perp__all *all, const int8_t *places, double *points)
{
    perp__face *face = perp__allocate(all->context, 1, sizeof *face);
    int8_t *copy = perp__allocate(all->context, (size_t)all->n, sizeof *copy);

    if (!face || !copy) {
        perp__release(all->context, face);
        perp__release(all->context, copy);
        perp__release(all->context, points);
        perp__fail_memory(all->context, "a solution");
        return NULL;
    }
    memset(face, 0, sizeof *face);
    memcpy(copy, places, (size_t)all->n);
    face->places = copy;
    face->points = points;
    return face;
}

perp_status perp__all_keep(perp__all *all, const int8_t *places, double *points, int32_t vertices,
                           int32_t rays, double residual)
{
    perp__face *face = make_face(all, places, points), **link, *other;

    if (!face)
        return PERP_ERROR_MEMORY;
    face->vertices = vertices;
    face->rays = rays;
    face->residual = residual;
    face->dimension = find_dimension(all, face);
    for (other = all->faces; other; other = other->next)
        if (holds(all, other, face)) {
            release(all, face);
            return PERP_OK;
        }
    for (link = &all->faces; *link;) {
        other = *link;
        if (holds(all, face, other)) {
            *link = other->next;
            release(all, other);
        } else {
            link = &other->next;
        }
    }
    *link = face; /* at the end: reports come in the order of the tree */
    return PERP_OK;
}
