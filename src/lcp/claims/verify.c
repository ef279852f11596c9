/* perp_lcp_verify: that a solution lies near z, proved for the caller's own doubles.
 *
 * The index set that z shows turns the problem into linear equations for the variables between
 * their bounds. If their matrix is regular they have one solution; if in an interval around it all
 * variables keep strictly within their bounds and every other w_i keeps its sign, then that
 * solution, with the other variables at their bounds, solves the problem. */
#include "lcp/claims/verify.h"

#include <math.h>
#include <string.h>

#include "base/check.h"
#include "base/context.h"
#include "base/outcome.h"

PERP__INIT(perp_lcp_proof)

const char *perp_lcp_verdict_text(int32_t verdict)
{
    switch (verdict) {
    case PERP_VERDICT_REGULAR:
        return "regular";
    case PERP_VERDICT_NOT_A_SOLUTION:
        return "not a solution";
    case PERP_VERDICT_SINGULAR:
        return "singular";
    case PERP_VERDICT_DEGENERATE:
        return "degenerate";
    case PERP_VERDICT_TOO_LARGE:
        return "too large";
    default:
        return "unknown verdict";
    }
}

static perp_status check(perp_context *context, perp__matrix *own, const perp_lcp_proof *proof,
                         const perp_matrix *M, const double *q, const double *lower,
                         const double *upper, const double *z)
{
    perp_status status = PERP__CHECK(perp_lcp_proof, context, proof);

    if (status == PERP_OK)
        status = perp__matrix_read(context, "M", own, M);
    if (status == PERP_OK && own->rows != own->columns)
        status = perp__fail(context, PERP_ERROR_ARGUMENT, "M is %d by %d, expected a square matrix",
                            (int)own->rows, (int)own->columns);
    if (status == PERP_OK)
        status = perp__check_bounds(context, lower, upper, (size_t)own->rows);
    if (status == PERP_OK && own->rows > 0)
        status = perp__check_pointer(context, "q", q);
    if (status == PERP_OK)
        status = perp__check_finite(context, "q", q, (size_t)own->rows);
    if (status == PERP_OK && own->rows > 0)
        status = perp__check_pointer(context, "z", z);
    if (status == PERP_OK)
        status = perp__check_finite(context, "z", z, (size_t)own->rows);
    return status;
}

/* A radius that is not finite proves nothing. */
static void write_out(const perp__verify *v, double *radii, perp_lcp_proof *proof, int32_t verdict,
                      int32_t index)
{
    perp_lcp_proof own;

    memset(&own, 0, sizeof own);
    for (int32_t i = 0; i < v->n && verdict == PERP_VERDICT_REGULAR; i++)
        perp__raise_to(&own.radius, perp__verify_radius(v, i));
    if (!isfinite(own.radius))
        verdict = PERP_VERDICT_SINGULAR;
    if (verdict != PERP_VERDICT_REGULAR)
        own.radius = INFINITY;
    own.verdict = verdict;
    own.index = index;
    for (int32_t i = 0; i < v->n && radii; i++)
        radii[i] = verdict == PERP_VERDICT_REGULAR ? perp__verify_radius(v, i) : INFINITY;
    perp__struct_write(proof, &own, sizeof own);
}

static perp_status prove(perp__verify *v, double *radii, perp_lcp_proof *proof, const double *q)
{
    const perp__matrix M = v->M;
    perp_status status = perp__arena_fit(&v->arena, perp__verify_layout, v);
    int32_t verdict = PERP_VERDICT_SINGULAR, index = -1;

    if (status != PERP_OK)
        return status;
    perp__verify_scale(v, &M, q);
    status = perp__verify_enclose(v, &verdict);
    if (status != PERP_OK)
        return status;
    if (verdict == PERP_VERDICT_REGULAR)
        verdict = perp__verify_judge(v, &index);
    write_out(v, radii, proof, verdict, index);
    return PERP_OK;
}

static perp_status verify(perp_context *context, double *radii, perp_lcp_proof *proof,
                          const perp_matrix *M, const double *q, const double *lower,
                          const double *upper, const double *z)
{
    perp__verify v;
    perp_status status;

    memset(&v, 0, sizeof v);
    status = check(context, &v.M, proof, M, q, lower, upper, z);
    if (status != PERP_OK)
        return status;
    v.context = context;
    v.n = v.M.rows;
    v.z_caller = z;
    v.lower_caller = lower;
    v.upper_caller = upper;
    perp__arena_init(&v.arena, context);
    perp__arena_init(&v.dense_arena, context);
    status = prove(&v, radii, proof, q);
    perp__dominance_release(&v.dominance);
    perp__arena_release(&v.dense_arena);
    perp__arena_release(&v.arena);
    return status;
}

perp_status perp_lcp_verify(perp_context *context, double *radii, perp_lcp_proof *proof,
                            const perp_matrix *M, const double *q, const double *lower,
                            const double *upper, const double *z)
{
    perp_status status = perp__enter(context);

    if (status != PERP_OK)
        return status;
    return perp__leave(context, verify(context, radii, proof, M, q, lower, upper, z));
}
