/* perp_lcp_all: what it reports solves the problem, and nothing is left out of an exhaustive list.
 */
#include <math.h>
#include <string.h>

#include "problem.h"

#define MOST_FOUND 256

typedef struct list {
    const lcp_problem *problem;
    double tol;
    int32_t count, isolated, families, stop_at;
    struct {
        int32_t dimension, places[ORACLE_LARGEST];
        double z[ORACLE_LARGEST];
    } found[MOST_FOUND];
} list;

/* Numbers of a solution that sums of exact rationals differ from by less than this: 1e-8 is what
 * the call itself takes for one point, blocks have inverses below 1e6. */
#define NEAR 1e-3

static void check_ray(const lcp_problem *p, const int32_t *places, const double *ray)
{
    wide *M = oracle_wide(p->n * p->n, p->M.dense), *w = fuzz_take(p->n, sizeof *w);
    int32_t i;

    fuzz_finite("ray", ray, p->n);
    oracle_multiply(p->n, p->n, M, oracle_wide(p->n, ray), NULL, w, NULL);
    for (i = 0; p->integer && i < p->n; i++)
        if (places[i] == PERP_PLACE_LOWER ? ray[i] != 0 || w[i] < -NEAR
                                          : ray[i] < -NEAR || oracle_abs(w[i]) > NEAR)
            fuzz_fail("lcp_all: a family's ray keeps to its index set: row %d", i);
}

static int32_t visit(const perp_lcp_found *found, void *user)
{
    list *l = user;
    int32_t n = l->problem->n, k;
    int mark = fuzz_mark();

    lcp_problem_check("lcp_all", l->problem, found->z, found->w, PERP_OUTCOME_ROUNDING_LIMIT,
                      l->tol, 0);
    for (k = 0; k < found->vertex_count; k++)
        lcp_problem_check("lcp_all, a vertex", l->problem, &found->vertices[k * n], NULL,
                          PERP_OUTCOME_ROUNDING_LIMIT, l->tol, 0);
    for (k = 0; k < found->ray_count; k++)
        check_ray(l->problem, found->places, &found->rays[k * n]);
    if (l->problem->integer && l->count < MOST_FOUND) {
        l->found[l->count].dimension = found->dimension;
        memcpy(l->found[l->count].z, found->z, (size_t)n * sizeof(double));
        memcpy(l->found[l->count].places, found->places, (size_t)n * sizeof(int32_t));
    }
    *(found->dimension > 0 ? &l->families : &l->isolated) += 1;
    l->count++;
    fuzz_drop_to(mark);
    return l->count == l->stop_at;
}

/* Whether `z` is the solution found, or lies in the polyhedron of its index set. */
static int covers(const list *l, int32_t k, const double *z)
{
    int mark = fuzz_mark();
    wide *w = fuzz_take(l->problem->n, sizeof *w), *t = fuzz_take(l->problem->n, sizeof *t);
    int32_t i, inside = 1;

    lcp_problem_rows(l->problem, z, w, t);
    for (i = 0; i < l->problem->n; i++)
        if (l->found[k].dimension == 0)
            inside = inside && fabs(z[i] - l->found[k].z[i]) <= NEAR;
        else
            inside =
                inside &&
                (l->found[k].places[i] == PERP_PLACE_LOWER ? z[i] == 0 : oracle_abs(w[i]) < NEAR);
    fuzz_drop_to(mark);
    return inside;
}

static void check_complete(const list *l)
{
    oracle_vertex *vertices = fuzz_take(ORACLE_VERTICES, sizeof *vertices);
    const lcp_problem *p = l->problem;
    int32_t count = oracle_vertices(p->n, p->iM, p->iq, vertices), i, k;

    for (i = 0; i < count; i++) {
        for (k = 0; k < l->count && !covers(l, k, vertices[i].z); k++)
            ;
        if (k == l->count)
            fuzz_fail("lcp_all: all index sets were looked at; solution %d of %d (z[0] = %g) is "
                      "not among the %d found",
                      i, count, vertices[i].z[0], l->count);
    }
    for (i = 0; i < l->count; i++)
        for (k = 0; k < i; k++)
            if (l->found[k].dimension == 0 && l->found[i].dimension == 0 &&
                covers(l, k, l->found[i].z))
                fuzz_fail("lcp_all: a solution is reported once: %d and %d of %d", k, i, l->count);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_bytes bytes = {data, data + size};
    perp_context *context = fuzz_open(&bytes, 1);
    perp_lcp_settings settings;
    perp_lcp_enumeration *result = fuzz_take(1, sizeof *result), kept;
    lcp_problem problem;
    static list found;
    perp_status status;

    lcp_settings_make(&bytes, &settings);
    settings.time_limit = 0;
    settings.max_iterations = fuzz_one_in(&bytes, 4) ? 1 + fuzz_pick(&bytes, 100) : 0;
    memset(&found, 0, sizeof found);
    found.problem = &problem;
    found.tol = settings.tol;
    found.stop_at = fuzz_one_in(&bytes, 8) ? 1 : -1;
    lcp_problem_make(&bytes, &problem, 0, 7);
    if (perp_struct_init(result, sizeof *result) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    kept = *result;
    status = perp_lcp_all(context, result, &settings,
                          LCP(&problem.M.view, problem.q, problem.lower_given, problem.upper_given),
                          visit, &found);
    if (fuzz_status(context, status, "perp_lcp_all")) {
        if (result->isolated != found.isolated || result->families != found.families)
            fuzz_fail("lcp_all: %d isolated solutions and %d families are counted, %d and %d told",
                      result->isolated, result->families, found.isolated, found.families);
        if (result->outcome == PERP_OUTCOME_SOLVED && problem.integer && settings.tol >= 1e-12 &&
            settings.tol <= 1e-6 && found.count <= MOST_FOUND)
            check_complete(&found);
    } else if (memcmp(&kept, result, sizeof kept) != 0)
        fuzz_fail("a refusal leaves the result untouched");
    fuzz_close(context);
    return 0;
}
