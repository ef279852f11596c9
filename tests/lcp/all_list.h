/* What perp_lcp_all tells of a problem, checked visit by visit and kept in a list. */
#ifndef PERP_TESTS_LCP_ALL_LIST_H
#define PERP_TESTS_LCP_ALL_LIST_H

#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "run.h"

enum { LARGEST = 20, MOST_POINTS = 4000 };

/* What the visits told: every isolated solution and every vertex in a list. */
typedef struct list {
    const gen_lcp *problem;
    int32_t n, isolated, families, points, rays;
    int32_t largest_dimension;
    double *at; /* points by n */
    double first[LARGEST];
} list;

/* A solution of the problem, to the front door's tolerance and some rounding of its own. */
static inline void require_solution(const gen_lcp *problem, const double *z)
{
    const check_lcp lcp = {&problem->view, problem->q, problem->lower, problem->upper, 1};
    check_measures measures;
    double size = 1.0;
    int32_t i;

    for (i = 0; i < problem->n; i++)
        check_raise(&size, fabs(z[i]));
    check_measure(&measures, &lcp, z, NULL);
    assert_true(measures.residual <= 1e-9 * size);
}

static inline void require_found(list *l, const perp_lcp_found *found)
{
    double point[LARGEST];
    int32_t i, k;

    assert_int_equal(found->struct_size, sizeof *found);
    assert_true(found->vertex_count >= 1 && found->residual <= 1e-9);
    require_solution(l->problem, found->z);
    for (k = 0; k < found->vertex_count; k++)
        require_solution(l->problem, found->vertices + k * l->n);
    for (k = 0; k < found->ray_count; k++) { /* from the first vertex, a long way */
        for (i = 0; i < l->n; i++)
            point[i] = found->vertices[i] + 100.0 * found->rays[k * l->n + i];
        require_solution(l->problem, point);
    }
    for (i = 0; i < l->n; i++) { /* the index set is one of all points */
        if (found->places[i] == PERP_PLACE_LOWER)
            assert_true(found->z[i] == (l->problem->lower ? l->problem->lower[i] : 0.0));
        if (found->places[i] == PERP_PLACE_BETWEEN)
            assert_true(fabs(found->w[i]) <= 1e-9);
    }
    if (found->dimension == 0) {
        assert_true(found->vertex_count == 1 && found->ray_count == 0);
        assert_true(run_distance(found->z, found->vertices, l->n) <= 1e-12);
    }
}

static inline int32_t visit(const perp_lcp_found *found, void *user)
{
    list *l = user;

    require_found(l, found);
    if (l->isolated + l->families == 0)
        memcpy(l->first, found->z, (size_t)l->n * sizeof *l->first);
    if (found->dimension == 0)
        l->isolated++;
    else
        l->families++;
    if (found->dimension > l->largest_dimension)
        l->largest_dimension = found->dimension;
    l->rays += found->ray_count;
    assert_true(l->points + found->vertex_count <= MOST_POINTS);
    memcpy(l->at + l->points * l->n, found->vertices,
           (size_t)(found->vertex_count * l->n) * sizeof(double));
    l->points += found->vertex_count;
    return 0;
}

static inline void open_list(list *l, const gen_lcp *problem)
{
    memset(l, 0, sizeof *l);
    l->problem = problem;
    l->n = problem->n;
    l->at = check_allocate((size_t)(MOST_POINTS * problem->n) + 1, sizeof(double));
}

/* Finds all solutions; the caller frees l->at. */
static inline perp_lcp_enumeration enumerate(perp_context *context, list *l, const gen_lcp *problem)
{
    perp_lcp_enumeration result;

    open_list(l, problem);
    assert_int_equal(perp_struct_init(&result, sizeof result), PERP_OK);
    assert_int_equal(perp_lcp_all(context, &result, NULL,
                                  LCP(&problem->view, problem->q, problem->lower, problem->upper),
                                  visit, l),
                     PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    assert_int_equal(result.isolated, l->isolated);
    assert_int_equal(result.families, l->families);
    return result;
}

static inline int is_listed(const list *l, const double *z)
{
    int32_t k;

    for (k = 0; k < l->points; k++)
        if (run_distance(z, l->at + k * l->n, l->n) <= 1e-9)
            return 1;
    return 0;
}

#endif
