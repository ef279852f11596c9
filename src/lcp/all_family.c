/* A leaf with a singular block: its points are z(t) = origin + sum t_k directions_k, t the
 * variables that no equation determines, as long as all bounds and signs hold: a polyhedron in t.
 */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "base/outcome.h"
#include "lcp/all.h"

/* Entries this small beside their row are rounding. */
static const double noise = 1e-10;

static const double *row_of(const perp__all *all, const perp__tree_level *level, int32_t i)
{
    return level->T + (size_t)i * (size_t)(all->n + 1);
}

static double *direction(const perp__all *all, int32_t k)
{
    return all->directions + (size_t)k * (size_t)all->n;
}

static void find_affine_set(perp__all *all, const perp__tree_level *level)
{
    const int32_t n = all->n;
    int32_t i, k;

    memset(all->directions, 0, (size_t)level->pending * (size_t)n * sizeof *all->directions);
    for (i = 0; i < n; i++)
        all->origin[i] = all->places[i] == PERP__BETWEEN    ? 0.0
                         : all->places[i] == PERP__AT_UPPER ? all->solver->upper_scaled[i]
                                                            : all->solver->lower_scaled[i];
    for (i = 0; i < n; i++) {
        const double *T = row_of(all, level, i);

        if (level->kind[i] != PERP__ROW_Z)
            continue;
        all->origin[level->basic[i]] = T[n];
        for (k = 0; k < level->pending; k++)
            direction(all, k)[level->basic[i]] = T[level->columns[k]];
    }
    for (k = 0; k < level->pending; k++)
        direction(all, k)[level->columns[k]] = 1.0;
}

/* Appends the constraint constant + sum_k t_k coefficients_k >= 0 unless it says 0 >= 0. `size`
 * measures the row. */
static void add_constraint(perp__cone *cone, double constant, double sign, const double *row,
                           const int8_t *columns, double size)
{
    double *a = cone->A + (size_t)cone->rows * (size_t)cone->dimension;
    int32_t some, k;

    a[0] = fabs(constant) <= noise * size ? 0.0 : constant;
    some = a[0] != 0.0;
    for (k = 1; k < cone->dimension; k++) {
        const double entry = sign * row[columns ? columns[k - 1] : k - 1];

        a[k] = fabs(entry) <= noise * size ? 0.0 : entry;
        some |= a[k] != 0.0;
    }
    cone->rows += some;
}

/* Both bounds of a variable with this constant and these coefficients. */
static void add_bounds(const perp__all *all, perp__cone *cone, int32_t variable, double constant,
                       const double *row, const int8_t *columns)
{
    const double l = all->solver->lower_scaled[variable], u = all->solver->upper_scaled[variable];
    const double size = 1.0 + fabs(constant);

    if (l > -INFINITY)
        add_constraint(cone, constant - l, 1.0, row, columns, size);
    if (u < INFINITY)
        add_constraint(cone, u - constant, -1.0, row, columns, size);
}

/* In (s, t): s >= 0 first, then every sign and bound, s times its constant. */
static void fill_cone(perp__all *all, const perp__tree_level *level)
{
    perp__cone *cone = &all->cone;
    double *unit = all->work;
    int32_t i, k;

    memset(cone->A, 0, (size_t)cone->dimension * sizeof *cone->A);
    cone->A[0] = 1.0;
    cone->rows = 1;
    for (i = 0; i < all->n; i++) {
        const double *T = row_of(all, level, i);
        const double size = all->row_sizes[i] + fabs(T[all->n]);

        if (level->kind[i] == PERP__ROW_W_LOWER)
            add_constraint(cone, T[all->n], 1.0, T, level->columns, size);
        else if (level->kind[i] == PERP__ROW_W_UPPER)
            add_constraint(cone, -T[all->n], -1.0, T, level->columns, size);
        else if (level->kind[i] == PERP__ROW_Z)
            add_bounds(all, cone, level->basic[i], T[all->n], T, level->columns);
    }
    for (k = 0; k < level->pending; k++) {
        memset(unit, 0, (size_t)level->pending * sizeof *unit);
        unit[k] = 1.0;
        add_bounds(all, cone, level->columns[k], 0.0, unit, NULL);
    }
}

/* z of a ray (s, t) of the cone: a vertex where s > 0, else a direction. */
static void expand(const perp__all *all, const double *x, double *z)
{
    const double scale = x[0] > 0.0 ? 1.0 / x[0] : 1.0;
    int32_t i, k;

    for (i = 0; i < all->n; i++) {
        z[i] = x[0] > 0.0 ? all->origin[i] : 0.0;
        for (k = 1; k < all->cone.dimension; k++)
            z[i] += scale * x[k] * direction(all, k - 1)[i];
    }
}

static double largest_of(const double *x, int32_t count)
{
    double largest = 0.0;
    int32_t i;

    for (i = 0; i < count; i++)
        largest = fmax(largest, fabs(x[i]));
    return largest;
}

/* The cone's rays with s > 0 that solve the problem to the end of `points`; their count. */
static int32_t collect_vertices(perp__all *all, double *points, double *residual)
{
    const perp__cone *cone = &all->cone;
    const size_t n = (size_t)all->n;
    int32_t count = 0, r;

    *residual = 0.0;
    for (r = 0; r < cone->rays; r++) {
        double *z = points + (size_t)count * n;
        perp__evaluation worth;

        if (!(cone->x[r * cone->dimension] > noise))
            continue;
        expand(all, cone->x + r * cone->dimension, z);
        worth = perp__all_evaluate(all, z);
        if (!perp__all_is_solution(all, &worth, largest_of(z, all->n)))
            continue;
        *residual = fmax(*residual, worth.tested);
        count++;
    }
    return count;
}

/* In the search for the first solution: offers the vertices until one is taken. */
static void offer_vertices(perp__all *all)
{
    const perp__cone *cone = &all->cone;
    int32_t r;

    for (r = 0; r < cone->rays && !all->found; r++) {
        perp__evaluation worth;

        if (!(cone->x[r * cone->dimension] > noise))
            continue;
        expand(all, cone->x + r * cone->dimension, all->z);
        worth = perp__all_evaluate(all, all->z);
        perp__all_offer(all, &worth);
    }
}

/* The others, and the lines in both directions, with largest entry 1. */
static int32_t collect_rays(perp__all *all, double *points)
{
    perp__cone *cone = &all->cone;
    int32_t count = 0, r, i, sign;

    for (r = 0; r < cone->rays + cone->lines; r++) {
        double *x = cone->x + r * cone->dimension;

        if (r < cone->rays && x[0] > noise)
            continue;
        x[0] = 0.0;
        for (sign = 1; sign >= (r < cone->rays ? 1 : -1); sign -= 2) {
            double *y = points + (size_t)count * (size_t)all->n, size;

            expand(all, x, y);
            size = largest_of(y, all->n);
            for (i = 0; i < all->n; i++)
                y[i] *= sign / size;
            count++;
        }
    }
    return count;
}

perp_status perp__all_family(perp__all *all, const perp__tree_level *level)
{
    const size_t n = (size_t)all->n;
    perp_status status;
    double *points, residual;
    int32_t vertices, rays;

    find_affine_set(all, level);
    if (!perp__all_finite(all->origin, n) ||
        !perp__all_finite(all->directions, n * (size_t)level->pending)) {
        all->incomplete = 1;
        return PERP_OK;
    }
    if (perp__all_is_covered(all, all->origin, all->directions, level->pending))
        return PERP_OK;
    status = perp__cone_fit(&all->cone, 2 * all->n + 1, level->pending + 1);
    if (status != PERP_OK)
        return status;
    fill_cone(all, level);
    status = perp__cone_enumerate(&all->cone);
    if (status == PERP__CONE_TOO_LARGE) {
        all->incomplete = 1;
        return PERP_OK;
    }
    if (status == PERP_OK && all->first)
        offer_vertices(all);
    if (status != PERP_OK || all->first)
        return status;
    points =
        perp__allocate(all->context, ((size_t)all->cone.rays + 2 * (size_t)all->cone.lines + 1) * n,
                       sizeof *points);
    if (!points)
        return perp__fail_memory(all->context, "a family of solutions");
    vertices = collect_vertices(all, points, &residual);
    if (vertices == 0) {
        perp__release(all->context, points);
        return PERP_OK;
    }
    rays = collect_rays(all, points + (size_t)vertices * n);
    return perp__all_keep(all, all->places, points, vertices, rays, residual);
}
