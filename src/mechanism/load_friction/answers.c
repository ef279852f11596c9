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

/* Whether x (constant = 1) keeps the rows and signs of a pattern, or a direction does (0). */
static int32_t keeps(const perp_load_friction *f, const perp__answer *a, const double *x,
                     int32_t constant)
{
    int32_t i, j;

    for (i = 0; i < f->n; i++) {
        const int32_t sticks = a->pattern[i] == PERP_LOAD_STICK;
        const double sign = a->pattern[i] == PERP_LOAD_FORWARD    ? 1.0
                            : a->pattern[i] == PERP_LOAD_BACKWARD ? -1.0
                            : sticks                              ? 0.0
                                                                  : f->question.sign[i];
        const double t = f->mu[i] * sign * a->pattern[f->n + i];
        double row = constant ? f->b[i] - f->question.tau[i] : 0.0;
        double size = constant ? fabs(f->b[i]) + fabs(f->question.tau[i]) : 0.0;
        double normal = constant ? f->d[i] : 0.0, normal_size = fabs(normal);

        for (j = 0; j < f->n; j++) {
            row += f->A[at(f, i, j)] * x[j];
            size += fabs(f->A[at(f, i, j)] * x[j]);
            normal += f->C[at(f, i, j)] * x[j];
            normal_size += fabs(f->C[at(f, i, j)] * x[j]);
        }
        if (!(a->pattern[f->n + i] * normal >= -same * normal_size))
            return 0;
        if (sticks) {
            if (!(fabs(x[i] - constant * f->question.stop[i]) <=
                  same * fabs(f->question.stop[i])) ||
                !(fabs(row) <= f->question.mu_stick[i] * fabs(normal) + same * size))
                return 0;
        } else if (!(fabs(row + t * normal) <= same * (size + fabs(t) * normal_size)) ||
                   (f->question.sign[i] == 0 &&
                    !(sign * (x[i] - constant * f->question.stop[i]) >=
                      -same * (fabs(x[i]) + fabs(f->question.stop[i]))))) {
            return 0;
        }
    }
    return 1;
}

static int32_t contains(const perp_load_friction *f, const perp__answer *outer,
                        const perp__answer *inner)
{
    int32_t k;

    for (k = 0; k < inner->vertices + inner->rays; k++)
        if (!keeps(f, outer, inner->points + (size_t)k * (size_t)f->n, k < inner->vertices))
            return 0;
    return 1;
}

/* Two patterns that meet in a vertex find it both. */
static int32_t is_same(const perp_load_friction *f, const perp__answer *a, const perp__answer *b)
{
    int32_t i;

    if (memcmp(a->pattern, b->pattern, 2 * (size_t)f->n) == 0)
        return 1; /* a search comes by more than once */
    if (!a->at_vertex || !b->at_vertex)
        return 0;
    for (i = 0; i < f->n; i++)
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
    perp__stability verdict;
    int32_t m = 0, r, c, i;

    memset(X, 0, 2 * square * sizeof *X);
    for (i = 0; i < n; i++)
        if (a->pattern[i] != PERP_LOAD_STICK)
            f->list[m++] = i;
    for (r = 0; r < m; r++) {
        for (c = 0; c < m; c++)
            block[at(f, r, c)] = f->A[at(f, f->list[r], f->list[c])];
        for (i = 0; i < n; i++) { /* C_L, and the right-hand sides C_L' and (diag(mu) D)_L */
            C[at(f, i, r)] = f->C[at(f, i, f->list[r])];
            X[at(f, r, i)] = C[at(f, i, r)];
        }
        X[at(f, r, n + f->list[r])] = f->slope[f->list[r]];
    }
    memcpy(S, f->Y, square * sizeof *S);
    memset(Gamma, 0, square * sizeof *Gamma);
    for (i = 0; i < n; i++)
        Gamma[at(f, i, i)] = -1.0;
    if (m > 0) {
        perp__cholesky_factor(m, block, n);
        perp__cholesky_solve(m, 2 * n, block, n, X, n);
        perp__gemm_subtract(n, n, m, C, n, X, n, S, n);
        perp__gemm_subtract(n, n, m, C, n, X + square, n, Gamma, n);
    }
    for (i = 0; i < n * n; i++)
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

/* The answer's middle is f->x, and evaluated. */
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
        normal[i] = f->normal[i];
        friction[i] = mode == PERP_LOAD_STICK ? -row : f->slope[i] * normal[i];
        perp__raise_to(&a->residual, mode == PERP_LOAD_STICK || f->load[i] == 0.0
                                         ? 0.0
                                         : fabs(f->rhs[i]) / f->load[i]);
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
    int32_t i, j;

    for (i = 0; i < f->n; i++) {
        double terms = fabs(f->d[i]), size = fabs(f->b[i]) + fabs(f->question.tau[i]);

        if (a->pattern[i] != PERP_LOAD_STICK)
            continue;
        for (j = 0; j < f->n; j++) {
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
    if (holds && is_finite(f, a) && is_held(f, a)) {
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
    memcpy(a->middle, f->x, size);
    memcpy(a->width, f->width, size);
    memcpy(a->points, f->x, size);
    describe(f, a);
    keep(f, a, 1);
    return PERP_OK;
}

/* ---- families ------------------------------------------------------------------------------ */

/* The side of a coordinate that sticks: its friction is bounded by mu |N|, and each sign of N has a
 * polyhedron of its own. Signs are the bits of `sides`. */
static double side_of(const perp_load_friction *f, int32_t i, uint32_t sides, int32_t *bit)
{
    if (f->pattern.mode[i] != PERP_LOAD_STICK || !(f->question.mu_stick[i] > 0.0))
        return f->pattern.side[i];
    return (sides >> (*bit)++) & 1u ? -1.0 : 1.0;
}

/* constant + (normal C_i + inertia A_i) x >= 0 */
static void cut(perp_load_friction *f, int32_t i, double normal, double inertia)
{
    perp__inequality g = {0};
    int32_t j;

    for (j = 0; j < f->n; j++)
        f->product[j] = normal * f->C[at(f, i, j)] + inertia * f->A[at(f, i, j)];
    g.constant = normal * f->d[i] + inertia * (f->b[i] - f->question.tau[i]);
    g.row = f->product;
    perp__polyhedron_cut(&f->polyhedron, &g);
}

/* The inequalities of the pattern. */
static void cut_all(perp_load_friction *f, uint32_t sides)
{
    int32_t i, bit = 0;

    for (i = 0; i < f->n; i++) {
        const int32_t mode = f->pattern.mode[i];
        const double side = side_of(f, i, sides, &bit), limit = f->question.mu_stick[i];

        if (side != 0.0)
            cut(f, i, side, 0.0);
        if (mode == PERP_LOAD_STICK) {
            cut(f, i, limit * side, -1.0);
            cut(f, i, limit * side, 1.0);
        } else if (mode == PERP_LOAD_FORWARD || mode == PERP_LOAD_BACKWARD) {
            const double sign = mode == PERP_LOAD_FORWARD ? 1.0 : -1.0;
            perp__inequality g = {0};

            memset(f->product, 0, (size_t)f->n * sizeof *f->product);
            f->product[i] = sign;
            g.constant = -sign * f->question.stop[i];
            g.row = f->product;
            perp__polyhedron_cut(&f->polyhedron, &g);
        }
    }
}

static perp_status keep_polyhedron(perp_load_friction *f, uint32_t sides)
{
    const size_t size = (size_t)f->n * sizeof *f->x;
    perp__answer *a;
    const perp_status status = perp__polyhedron_list(&f->polyhedron, &f->answers, &a);
    int32_t i, bit = 0;

    if (!a)
        return status;
    for (i = 0; i < f->n; i++)
        a->width[i] = same * fabs(a->middle[i]);
    a->dimension = a->vertices + a->rays == 1 ? 0 : f->polyhedron.dimension;
    a->at_vertex = 1;
    memcpy(f->x_low, f->x, size); /* the other sides start from it, too */
    memcpy(f->x, a->middle, size);
    perp__friction_evaluate(f);
    describe(f, a);
    memcpy(f->x, f->x_low, size);
    for (i = 0; i < f->n; i++) /* what sticks belongs to the family on this side alone */
        a->pattern[f->n + i] = (int8_t)side_of(f, i, sides, &bit);
    keep(f, a, contains(f, a, a)); /* each row beside its own terms */
    return PERP_OK;
}

perp_status perp__friction_keep_family(perp_load_friction *f, int32_t dimension)
{
    uint32_t sides, most = 1;
    perp_status status = PERP_OK;
    int32_t i;

    for (i = 0; i < f->n; i++)
        if (f->pattern.mode[i] == PERP_LOAD_STICK && f->question.mu_stick[i] > 0.0) {
            f->answers.incomplete |= most == 4096;
            most = most < 4096 ? 2 * most : most;
        }
    for (sides = 0; sides < most && status == PERP_OK; sides++) {
        status = perp__polyhedron_begin(&f->polyhedron, 4 * f->n, dimension);
        if (status != PERP_OK)
            return status;
        cut_all(f, sides);
        status = perp__polyhedron_enumerate(&f->polyhedron, &f->answers);
        if (status == PERP_OK)
            status = keep_polyhedron(f, sides);
    }
    return status;
}
