/* Answers: what belongs to a pattern's point or polyhedron, which of them are one, and their
 * stability. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "base/outcome.h"
#include "linalg/blas.h"
#include "mechanism/load_friction/load_friction.h"
#include "mechanism/stability.h"

/* Points of a family are the double description method's, which works to 1e-9 or so. */
static const double same = PERP__FRICTION_SAME;

/* What friction may miss beside the terms of its row and of its load. */
#define HELD 1e-9

static size_t at(const perp_load_friction *f, int32_t i, int32_t j)
{
    return (size_t)i + (size_t)f->n * (size_t)j;
}

/* ---- one answer in another ----------------------------------------------------------------- */

static int32_t contains(const perp_load_friction *f, const perp__answer *outer,
                        const perp__answer *inner)
{
    const perp__friction_pattern pattern = {outer->pattern, outer->pattern + f->n};
    int32_t at_vertex;

    for (int32_t k = 0; k < inner->vertices + inner->rays; k++)
        if (!perp__linear_holds_at(&f->linear, &pattern, inner->points + (size_t)k * (size_t)f->n,
                                   k >= inner->vertices, same, 0.0, &at_vertex))
            return 0;
    return 1;
}

/* Two patterns that meet in a vertex find it both. */
static int32_t is_same(const perp_load_friction *f, const perp__answer *a, const perp__answer *b)
{
    if (memcmp(a->pattern, b->pattern, 2 * (size_t)f->n) == 0)
        return 1; /* a search comes by more than once */
    if (!a->at_vertex || !b->at_vertex)
        return 0;
    for (int32_t i = 0; i < f->n; i++)
        if (!(fabs(a->middle[i] - b->middle[i]) <= 2.0 * (a->width[i] + b->width[i])))
            return 0;
    return 1;
}

int32_t perp__friction_holds_answer(void *user, perp__answer *outer, const perp__answer *inner)
{
    const perp_load_friction *f = user;

    return outer->dimension > 0 ? contains(f, outer, inner) : is_same(f, outer, inner);
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
    perp__stability verdict;

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
    verdict = perp__stability_of(n, Gamma, f->stiffness, f->damping, S + square, a->eigenvalues);
    a->stable = verdict.stable;
    a->flutter = verdict.flutter;
    a->eigenvalue_count = 2 * n;
}

/* What a step does to a coordinate that moved before: it goes on, or stops, or turns round. */
static int32_t name_mode(int32_t mode, int32_t before)
{
    if (before != 0 && mode == PERP_LOAD_STICK)
        return PERP_LOAD_STOPPED;
    if ((before > 0 && mode == PERP_LOAD_FORWARD) || (before < 0 && mode == PERP_LOAD_BACKWARD))
        return PERP_LOAD_SLIDE;
    return mode;
}

/* The answer's middle is f->linear.x, and evaluated. */
static void describe(perp_load_friction *f, perp__answer *a)
{
    double *normal = perp__friction_normal(a), *friction = perp__friction_force(f, a);
    int32_t sticks = 0, i, j;

    memcpy(a->pattern, f->pattern.mode, 2 * (size_t)f->n);
    for (i = 0; i < f->n; i++) {
        const int32_t mode = f->pattern.mode[i];
        double row = f->b[i] - f->question.tau[i];

        for (j = 0; j < f->n; j++)
            row += f->A[at(f, i, j)] * a->middle[j];
        normal[i] = f->linear.u[f->n + i];
        friction[i] = mode == PERP_LOAD_STICK ? -row : f->linear.slope[i] * normal[i];
        perp__raise_to(&a->residual, mode == PERP_LOAD_STICK || f->linear.load[i] == 0.0
                                         ? 0.0
                                         : fabs(f->linear.residual[i]) / f->linear.load[i]);
        a->modes[i] = name_mode(mode, f->question.before[i]);
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

/* Whether all that would be told of an answer is finite. (Eigenvalues may be unknown, then it is
 * not stable.) */
static int32_t is_finite(const perp_load_friction *f, const perp__answer *a)
{
    const size_t n = (size_t)f->n, points = (size_t)(a->vertices + a->rays);

    return perp__all_finite(a->points, points * n) && perp__all_finite(a->middle, n) &&
           perp__all_finite(a->own, 2 * n) && perp__all_finite(&a->residual, 1);
}

/* Whether what sticks is held by its friction: beside the terms of its own rows, not the largest of
 * the system. */
static int32_t is_held(const perp_load_friction *f, const perp__answer *a)
{
    for (int32_t i = 0; i < f->n; i++) {
        double terms = fabs(f->d[i]), size = fabs(f->b[i]) + fabs(f->question.tau[i]);

        if (a->pattern[i] != PERP_LOAD_STICK)
            continue;
        for (int32_t j = 0; j < f->n; j++) {
            terms += fabs(f->C[at(f, i, j)] * a->middle[j]);
            size += fabs(f->A[at(f, i, j)] * a->middle[j]);
        }
        if (!(fabs(perp__friction_force(f, a)[i]) <=
              f->question.mu_stick[i] * (fabs(perp__friction_normal(a)[i]) + HELD * terms) +
                  HELD * size))
            return 0;
    }
    return 1;
}

/* Keeps it if it is one. */
static void keep(perp_load_friction *f, perp__answer *a, int32_t holds)
{
    if (holds && is_finite(f, a) && is_held(f, a) && a->residual <= HELD) {
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

/* ---- families ------------------------------------------------------------------------------ */

/* Whether the coordinate sticks by friction: it is bounded by mu |N|, and each sign of N has a
 * polyhedron of its own. */
static int32_t is_bounded(const perp_load_friction *f, int32_t i)
{
    return f->pattern.mode[i] == PERP_LOAD_STICK && f->question.mu_stick[i] > 0.0;
}

/* Signs are the bits of `sides`. */
static void choose_sides(perp_load_friction *f, uint32_t sides)
{
    int32_t i, bit = 0;

    for (i = 0; i < f->n; i++)
        if (is_bounded(f, i))
            f->pattern.side[i] = (sides >> bit++) & 1u ? -1 : 1;
}

static perp_status keep_polyhedron(perp_load_friction *f)
{
    const size_t size = (size_t)f->n * sizeof *f->linear.x;
    perp__answer *a;
    const perp_status status = perp__polyhedron_list(&f->polyhedron, &f->answers, &a);

    if (!a)
        return status;
    for (int32_t i = 0; i < f->n; i++)
        a->width[i] = same * fabs(a->middle[i]);
    a->dimension = a->vertices + a->rays == 1 ? 0 : f->polyhedron.dimension;
    a->at_vertex = 1;
    memcpy(f->origin, f->linear.x, size); /* the other sides start from it, too */
    memcpy(f->linear.x, a->middle, size);
    perp__friction_evaluate(f);
    describe(f, a);
    memcpy(f->linear.x, f->origin, size);
    keep(f, a, contains(f, a, a)); /* each row beside its own terms */
    return PERP_OK;
}

perp_status perp__friction_keep_family(perp_load_friction *f, int32_t dimension)
{
    uint32_t sides, most = 1;
    perp_status status = PERP_OK;

    for (int32_t i = 0; i < f->n; i++)
        if (is_bounded(f, i)) {
            f->answers.incomplete |= most == 4096;
            most = most < 4096 ? 2 * most : most;
        }
    for (sides = 0; sides < most && status == PERP_OK; sides++) {
        choose_sides(f, sides);
        status = perp__polyhedron_begin(&f->polyhedron, 4 * f->n, dimension);
        if (status != PERP_OK)
            break;
        perp__linear_cut(&f->linear, &f->pattern, &f->polyhedron);
        status = perp__polyhedron_enumerate(&f->polyhedron, &f->answers);
        PERP__THEN(status, keep_polyhedron(f));
    }
    for (int32_t i = 0; i < f->n; i++)
        if (is_bounded(f, i))
            f->pattern.side[i] = 0;
    return status;
}
