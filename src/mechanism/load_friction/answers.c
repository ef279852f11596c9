/* Answers: what belongs to a pattern's point or polyhedron, which of them are one, and their
 * stability. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "base/outcome.h"
#include "linalg/blas.h"
#include "mechanism/load_friction/load_friction.h"
#include "mechanism/eigenvalues.h"

static size_t at(const perp_load_friction *f, int32_t i, int32_t j)
{
    return (size_t)i + (size_t)f->n * (size_t)j;
}

static bool contains(const perp_load_friction *f, const perp__answer *outer,
                     const perp__answer *inner)
{
    const perp__friction_pattern pattern = {outer->pattern, outer->pattern + f->n};
    int32_t at_vertex;

    for (int32_t k = 0; k < inner->vertices + inner->rays; k++)
        if (!perp__linear_holds_at(&f->linear, &pattern, inner->points + (size_t)k * (size_t)f->n,
                                   k >= inner->vertices, 0.0, &at_vertex))
            return 0;
    return 1;
}

int32_t perp__friction_holds_answer(void *user, perp__answer *outer, const perp__answer *inner)
{
    const perp_load_friction *f = user;
    bool same;

    if (outer->dimension > 0)
        return contains(f, outer, inner);
    if (memcmp(outer->pattern, inner->pattern, 2 * (size_t)f->n) == 0)
        return 1;                                /* a search comes by more than once */
    same = outer->at_vertex && inner->at_vertex; /* both patterns that meet in a vertex find it */
    for (int32_t i = 0; i < f->n && same; i++)
        same =
            fabs(outer->middle[i] - inner->middle[i]) <= 2.0 * (outer->width[i] + inner->width[i]);
    return same;
}

/* ---- description --------------------------------------------------------------------------- */

/* Stability of an answer: contacts with normal inertia S, stiffness k and damping c, displaced by
 * y, N = -(k y + c y'). With M = [A C'; C Y], Y = S + C A^-1 C', and coordinates T that stick,
 *
 *   S_L y'' = (I + C_L A_LL^-1 (diag(mu) D)_L) N + const,   S_L = Y - C_L A_LL^-1 C_L',
 *
 * so that y'' + Gamma (k y + c y') = const with Gamma = S_L^-1 (I + C_L A_LL^-1 (diag(mu) D)_L).
 *
 * From the slopes of the pattern that was solved last. */
static void label(perp_load_friction *f, perp__answer *a)
{
    const int32_t n = f->n;
    const size_t square = (size_t)n * (size_t)n;
    double *block = f->work, *C = block + square, *X = C + square, *Gamma = X + 2 * square;
    double *S = Gamma + square;
    const int32_t m = f->linear.system.n, *moving = f->linear.first;

    memset(X, 0, 2 * square * sizeof *X);
    for (int32_t r = 0; r < m; r++) {
        for (int32_t c = 0; c < m; c++)
            block[at(f, r, c)] = f->A[at(f, moving[r], moving[c])];
        for (int32_t i = 0; i < n;
             i++) { /* C_L, and the right-hand sides C_L' and (diag(mu) D)_L */
            C[at(f, i, r)] = f->C[at(f, i, moving[r])];
            X[at(f, r, i)] = C[at(f, i, r)];
        }
        X[at(f, r, n + moving[r])] = f->linear.slope[moving[r]];
    }
    memcpy(S, f->Y, square * sizeof *S);
    memset(Gamma, 0, square * sizeof *Gamma);
    for (int32_t i = 0; i < n; i++)
        Gamma[at(f, i, i)] = -1.0;
    if (m > 0) {
        perp__cholesky_factor(m, block, n);
        perp__cholesky_solve(m, 2 * n, block, n, X, n);
        perp__gemm_subtract(n, n, m, C, n, X, n, S, n);
        perp__gemm_subtract(n, n, m, C, n, X + square, n, Gamma, n);
    }
    for (int32_t i = 0; i < n * n; i++)
        Gamma[i] = -Gamma[i];
    perp__cholesky_factor(n, S, n);
    perp__cholesky_solve(n, n, S, n, Gamma, n);
    perp__stability_of(n, Gamma, f->stiffness, f->damping, S + square, a->eigenvalues, &a->stable,
                       &a->flutter);
    a->eigenvalue_count = 2 * n;
}

/* The answer's middle is f->linear.x, and evaluated. */
static void describe(perp_load_friction *f, perp__answer *a)
{
    double *normal = a->extra, *friction = a->extra + f->n;
    int32_t sticks = 0;

    memcpy(a->pattern, f->pattern.mode, 2 * (size_t)f->n);
    for (int32_t i = 0; i < f->n; i++) {
        const int32_t mode = f->pattern.mode[i], before = f->question.before[i];

        normal[i] = f->linear.u[f->n + i];
        friction[i] =
            mode == PERP_LOAD_STICK ? f->linear.residual[i] : f->linear.slope[i] * normal[i];
        perp__raise_to(&a->residual, mode == PERP_LOAD_STICK || f->linear.load[i] == 0.0
                                         ? 0.0
                                         : fabs(f->linear.residual[i]) / f->linear.load[i]);
        /* what a step does to a coordinate that moved before: it stops, goes on, or turns round */
        a->modes[i] = before != 0 && mode == PERP_LOAD_STICK ? PERP_LOAD_STOPPED
                      : (before > 0 && mode == PERP_LOAD_FORWARD) ||
                              (before < 0 && mode == PERP_LOAD_BACKWARD)
                          ? PERP_LOAD_SLIDE
                          : mode;
        sticks += mode == PERP_LOAD_STICK;
    }
    a->kind = a->dimension > 0 ? PERP_LOAD_FAMILY
              : sticks == 0    ? PERP_LOAD_DYNAMIC
              : sticks == f->n ? PERP_LOAD_STATIC
                               : PERP_LOAD_MIXED;
    label(f, a);
    if (a->dimension > 0) /* one direction is free: nothing brings it back */
        a->stable = 0;
}

/* Keeps it if it is one: all that would be told of it is finite (but eigenvalues: where they are
 * unknown it is not stable), and what sticks is held by its friction, beside the terms of its own
 * rows, not the largest of the system. */
static void keep(perp_load_friction *f, perp__answer *a, bool holds)
{
    const size_t n = (size_t)f->n, points = (size_t)(a->vertices + a->rays);
    const double *N = a->extra, *friction = a->extra + f->n;

    holds = holds && perp__all_finite(a->points, points * n) && perp__all_finite(a->middle, n) &&
            perp__all_finite(a->extra, 2 * n) && a->residual <= PERP__SAME_DIRECTION;
    for (int32_t i = 0; i < f->n && holds; i++) {
        const double *size = f->linear.u_size + i; /* and of N behind those */
        const double bound = fabs(N[i]) + PERP__SAME_DIRECTION * size[f->n];

        holds =
            a->pattern[i] != PERP_LOAD_STICK ||
            fabs(friction[i]) <= f->question.mu_stick[i] * bound + PERP__SAME_DIRECTION * size[0];
    }
    if (holds) {
        perp__answers_keep(&f->answers, a);
    } else {
        f->answers.incomplete = 1;
        perp__answer_release(&f->answers, a);
    }
}

perp_status perp__friction_keep_point(perp_load_friction *f, int32_t at_vertex)
{
    const size_t size = (size_t)f->n * sizeof(double);
    perp__answer *a = perp__answer_create(&f->answers, 1);

    if (!a)
        return perp__fail_memory(f->context, "an acceleration");
    a->at_vertex = at_vertex;
    memcpy(a->middle, f->linear.x, size);
    memcpy(a->width, f->linear.x_width, size);
    memcpy(a->points, f->linear.x, size);
    describe(f, a);
    keep(f, a, 1);
    return PERP_OK;
}

/* Whether the coordinate sticks by friction: it is bounded by mu |N|, and each sign of N has a
 * polyhedron of its own. */
static bool is_bounded(const perp_load_friction *f, int32_t i)
{
    return f->pattern.mode[i] == PERP_LOAD_STICK && f->question.mu_stick[i] > 0.0;
}

perp_status perp__friction_keep_family(perp_load_friction *f, int32_t dimension)
{
    const size_t size = (size_t)f->n * sizeof *f->linear.x;
    uint32_t sides, most = 1;
    perp__answer *a;
    perp_status status = PERP_OK;

    for (int32_t i = 0; i < f->n; i++)
        if (is_bounded(f, i)) {
            f->answers.incomplete |= most == 4096;
            most = most < 4096 ? 2 * most : most;
        }
    for (sides = 0; sides < most && status == PERP_OK; sides++) {
        for (int32_t i = 0, bit = 0; i < f->n; i++)
            if (is_bounded(f, i))
                f->pattern.side[i] = (sides >> bit++) & 1u ? -1 : 1;
        status = perp__polyhedron_begin(&f->polyhedron, 4 * f->n, dimension);
        if (status != PERP_OK)
            break;
        perp__linear_cut(&f->linear, &f->pattern, &f->polyhedron);
        status = perp__polyhedron_enumerate(&f->polyhedron, &f->answers);
        PERP__THEN(status, perp__polyhedron_list(&f->polyhedron, &f->answers, &a));
        if (status != PERP_OK || !a)
            continue;
        /* its middle is described; the other sides start from the point, too */
        for (int32_t i = 0; i < f->n; i++)
            a->width[i] = PERP__AGREEMENT * fabs(a->middle[i]);
        a->dimension = a->vertices + a->rays == 1 ? 0 : f->polyhedron.dimension;
        a->at_vertex = 1;
        memcpy(f->origin, f->linear.x, size);
        memcpy(f->linear.x, a->middle, size);
        perp__friction_evaluate(f);
        describe(f, a);
        memcpy(f->linear.x, f->origin, size);
        keep(f, a, contains(f, a, a)); /* each row beside its own terms */
    }
    for (int32_t i = 0; i < f->n; i++)
        if (is_bounded(f, i))
            f->pattern.side[i] = 0;
    return status;
}
