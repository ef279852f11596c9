/* All answers of a question by enumeration of the patterns, or as many as a search finds. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "lcp/lcp.h"
#include "mechanism/load_friction/load_friction.h"

/* ---- enumeration --------------------------------------------------------------------------- */

/* Choices of a coordinate: in motion the sign of its normal force; at rest to stick, or to start
 * forward or backward with either sign. */
static int32_t choices(const perp_load_friction *f, int32_t i)
{
    const int32_t sides = f->mu[i] > 0.0 ? 2 : 1;

    return f->question.sign[i] != 0 ? sides : 1 + 2 * sides;
}

static void choose(perp_load_friction *f, int32_t i, int32_t choice)
{
    const int32_t sides = f->mu[i] > 0.0 ? 2 : 1;
    const int32_t start = f->question.sign[i] != 0 ? choice : choice - 1;

    if (start < 0) {
        f->pattern.mode[i] = PERP_LOAD_STICK;
        f->pattern.side[i] = 0;
        return;
    }
    f->pattern.mode[i] = (int8_t)(f->question.sign[i] != 0 ? PERP_LOAD_SLIDE
                                  : start < sides          ? PERP_LOAD_FORWARD
                                                           : PERP_LOAD_BACKWARD);
    f->pattern.side[i] = (int8_t)(sides == 1 ? 0 : start % 2 == 0 ? 1 : -1);
}

int64_t perp__friction_patterns(const perp_load_friction *f, int64_t most)
{
    int64_t product = 1;
    int32_t i;

    for (i = 0; i < f->n && product <= most; i++)
        product *= choices(f, i);
    return product;
}

/* Solves the pattern and keeps what holds. */
static perp_status try_pattern(perp_load_friction *f)
{
    const int32_t dimension = perp__friction_solve_pattern(f);
    int32_t at_vertex;

    if (dimension > 0)
        return perp__friction_keep_family(f, dimension);
    if (dimension < 0 || !perp__friction_holds(f, &at_vertex))
        return PERP_OK;
    return perp__friction_keep_point(f, at_vertex);
}

static perp_status enumerate(perp_load_friction *f, int64_t patterns)
{
    perp_status status = PERP_OK;
    int64_t k;

    for (k = 0; k < patterns && status == PERP_OK; k++) {
        int64_t rest = k;
        int32_t i;

        for (i = 0; i < f->n; i++) {
            const int32_t count = choices(f, i);

            choose(f, i, (int32_t)(rest % count));
            rest /= count;
        }
        status = try_pattern(f);
    }
    return status;
}

/* ---- search -------------------------------------------------------------------------------- */

/* Moves the pattern to what its own point asks for; 0 where nothing changes. */
static int32_t follow(perp_load_friction *f)
{
    int32_t changed = 0, i;

    for (i = 0; i < f->n; i++) {
        int8_t mode = f->pattern.mode[i], side = f->normal[i] >= 0.0 ? 1 : -1;

        if (mode == PERP_LOAD_STICK &&
            fabs(f->rhs[i]) > f->question.mu_stick[i] * fabs(f->normal[i]))
            mode = f->rhs[i] > 0.0 ? PERP_LOAD_FORWARD : PERP_LOAD_BACKWARD;
        else if ((mode == PERP_LOAD_FORWARD && !(f->x[i] > f->question.stop[i])) ||
                 (mode == PERP_LOAD_BACKWARD && !(f->x[i] < f->question.stop[i])))
            mode = PERP_LOAD_STICK;
        if (mode == PERP_LOAD_STICK || f->mu[i] == 0.0)
            side = 0;
        changed |= mode != f->pattern.mode[i] || side != f->pattern.side[i];
        f->pattern.mode[i] = mode;
        f->pattern.side[i] = side;
    }
    return changed;
}

static perp_status walk(perp_load_friction *f, int64_t *patterns)
{
    int32_t round, at_vertex;

    for (round = 0; round < 3 * f->n + 10; round++) {
        ++*patterns;
        if (perp__friction_solve_pattern(f) != 0)
            return PERP_OK;
        if (perp__friction_holds(f, &at_vertex))
            return perp__friction_keep_point(f, at_vertex);
        if (!follow(f))
            return PERP_OK;
    }
    return PERP_OK;
}

/* All forward and all backward first, then signs by a fixed random sequence (Knuth's MMIX). */
static perp_status walk_from(perp_load_friction *f, int32_t start, uint64_t *seed,
                             int64_t *patterns)
{
    int32_t i;

    for (i = 0; i < f->n; i++) {
        const int32_t count = choices(f, i);

        *seed = *seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
        choose(f, i,
               start == 0   ? 0
               : start == 1 ? count - 1
                            : (int32_t)((*seed >> 33) % (uint64_t)count));
    }
    return walk(f, patterns);
}

/* The equivalent LCP, N = w - z: free x, 0 <= z  perp  w = C x + d + z >= 0 and
 * (A + t C) x + 2 t z + b + t d - tau = 0 with t = mu sign; 2 n columns of 2 n rows in M. */
static void fill_lcp(const perp_load_friction *f, double *M, double *q, double *lower)
{
    const size_t n = (size_t)f->n;
    size_t i, j;

    memset(M, 0, 4 * n * n * sizeof *M);
    for (i = 0; i < n; i++) {
        const double t = f->mu[i] * f->question.sign[i];

        for (j = 0; j < n; j++) {
            M[i + 2 * n * j] = f->A[i + n * j] + t * f->C[i + n * j];
            M[n + i + 2 * n * j] = f->C[i + n * j];
        }
        M[i + 2 * n * (n + i)] = 2.0 * t;
        M[n + i + 2 * n * (n + i)] = 1.0;
        q[i] = f->b[i] + t * f->d[i] - f->question.tau[i];
        q[n + i] = f->d[i];
        lower[i] = -INFINITY;
        lower[n + i] = 0.0;
    }
}

static perp_status solve_lcp(perp_load_friction *f, double *M, double *q, double *lower, double *z)
{
    perp_lcp_settings settings;
    perp_lcp_solver *solver;
    perp_lcp_result result;
    perp_matrix view;
    perp_status status;
    int32_t i;

    perp_lcp_settings_init(&settings, sizeof settings);
    perp_lcp_result_init(&result, sizeof result);
    perp_matrix_init(&view, sizeof view);
    perp_matrix_dense(&view, PERP_STORAGE_COLUMN_MAJOR, 2 * f->n, 2 * f->n, M, 2 * f->n);
    settings.method = PERP_LCP_LEMKE;
    status = perp__lcp_create(f->context, &solver, &settings);
    if (status != PERP_OK)
        return status;
    status = perp__lcp_setup(solver, &view, lower, NULL);
    if (status == PERP_OK)
        status = perp__lcp_solve(solver, z, NULL, NULL, &result, q, NULL);
    perp__lcp_destroy(solver);
    for (i = 0; i < f->n && status == PERP_OK; i++) {
        f->pattern.mode[i] = PERP_LOAD_SLIDE;
        f->pattern.side[i] = (int8_t)(f->mu[i] == 0.0 ? 0 : z[f->n + i] > 0.0 ? -1 : 1);
    }
    return status;
}

static perp_status walk_from_lemke(perp_load_friction *f, int64_t *patterns)
{
    const size_t n = (size_t)f->n;
    double *M;
    perp_status status;
    int32_t i;

    for (i = 0; i < f->n; i++)
        if (f->question.sign[i] == 0)
            return PERP_OK;
    M = perp__allocate(f->context, 4 * n * n + 6 * n, sizeof *M);
    if (!M)
        return perp__fail_memory(f->context, "the LCP of the normal forces");
    fill_lcp(f, M, M + 4 * n * n, M + 4 * n * n + 2 * n);
    status = solve_lcp(f, M, M + 4 * n * n, M + 4 * n * n + 2 * n, M + 4 * n * n + 4 * n);
    perp__release(f->context, M);
    return status == PERP_OK ? walk(f, patterns) : status;
}

static perp_status search(perp_load_friction *f, int64_t *patterns)
{
    uint64_t seed = 1;
    perp_status status;
    int32_t start;

    f->insist = 1;
    status = walk_from_lemke(f, patterns);
    for (start = 0; start < f->settings.starts && status == PERP_OK; start++)
        status = walk_from(f, start, &seed, patterns);
    f->insist = 0;
    return status;
}

/* ---- the call ------------------------------------------------------------------------------ */

static int32_t comes_before(const perp_load_friction *f, const perp__friction_answer *a,
                            const perp__friction_answer *b)
{
    int32_t i;

    for (i = 0; i < f->n; i++)
        if (a->x[i] != b->x[i])
            return a->x[i] < b->x[i];
    return 1;
}

static perp__friction_answer *merge(const perp_load_friction *f, perp__friction_answer *a,
                                    perp__friction_answer *b)
{
    perp__friction_answer *first = NULL, **link = &first;

    while (a && b) {
        perp__friction_answer **from = comes_before(f, a, b) ? &a : &b;

        *link = *from;
        link = &(*from)->next;
        *from = *link;
    }
    *link = a ? a : b;
    return first;
}

static perp__friction_answer *sort(const perp_load_friction *f, perp__friction_answer *list,
                                   int32_t count)
{
    perp__friction_answer *last = list, *second;
    int32_t k;

    if (count < 2)
        return list;
    for (k = 1; k < count / 2; k++)
        last = last->next;
    second = last->next;
    last->next = NULL;
    return merge(f, sort(f, list, count / 2), sort(f, second, count - count / 2));
}

perp_status perp__friction_answer_all(perp_load_friction *f, perp_load_summary *summary)
{
    const int64_t most = f->settings.most_patterns, patterns = perp__friction_patterns(f, most);
    const perp__friction_answer *a;
    perp_status status;

    memset(summary, 0, sizeof *summary);
    perp__friction_release_answers(f);
    f->unsettled = 0;
    summary->exhaustive = patterns <= most;
    summary->patterns = summary->exhaustive ? patterns : 0;
    status = summary->exhaustive ? enumerate(f, patterns) : search(f, &summary->patterns);
    if (status != PERP_OK) {
        perp__friction_release_answers(f);
        return status;
    }
    summary->exhaustive &= !f->unsettled;
    f->answers = sort(f, f->answers, f->count);
    for (a = f->answers; a; a = a->next) {
        summary->count++;
        summary->families += a->kind == PERP_LOAD_FAMILY;
        summary->stable += a->stable;
    }
    return PERP_OK;
}
