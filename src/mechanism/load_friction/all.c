/* All answers of a question by enumeration of the patterns, or as many as a search finds. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "lcp/lcp.h"
#include "mechanism/load_friction/load_friction.h"

/* ---- enumeration --------------------------------------------------------------------------- */

/* Choices of a coordinate: in motion the sign of its normal force; at rest to stick, or to start
 * forward or backward with either sign. */
static int32_t choices(void *user, int32_t i)
{
    const perp_load_friction *f = user;
    const int32_t sides = f->mu[i] > 0.0 ? 2 : 1;

    return f->question.sign[i] != 0 ? sides : 1 + 2 * sides;
}

static int32_t choose(void *user, int32_t i, int32_t choice)
{
    perp_load_friction *f = user;
    const int32_t sides = f->mu[i] > 0.0 ? 2 : 1;
    const int32_t start = f->question.sign[i] != 0 ? choice : choice - 1;

    if (start < 0) {
        f->pattern.mode[i] = PERP_LOAD_STICK;
        f->pattern.side[i] = 0;
        return 1;
    }
    f->pattern.mode[i] = (int8_t)(f->question.sign[i] != 0 ? PERP_LOAD_SLIDE
                                  : start < sides          ? PERP_LOAD_FORWARD
                                                           : PERP_LOAD_BACKWARD);
    f->pattern.side[i] = (int8_t)(sides == 1 ? 0 : start % 2 == 0 ? 1 : -1);
    return 1;
}

/* Solves the pattern and keeps what holds. */
static perp_status try_pattern(void *user)
{
    perp_load_friction *f = user;
    const int32_t dimension = perp__friction_solve_pattern(f, 0);
    int32_t at_vertex;

    if (dimension > 0)
        return perp__friction_keep_family(f, dimension);
    if (dimension < 0 || !perp__friction_holds(f, &at_vertex))
        return PERP_OK;
    return perp__friction_keep_point(f, at_vertex);
}

/* ---- search -------------------------------------------------------------------------------- */

/* Moves the pattern to what its own point asks for; 0 where nothing changes. */
static int32_t correct(perp_load_friction *f)
{
    int32_t changed = 0, i;

    for (i = 0; i < f->n; i++) {
        int8_t mode = f->pattern.mode[i], side = f->linear.u[f->n + i] >= 0.0 ? 1 : -1;

        if (mode == PERP_LOAD_STICK &&
            fabs(f->linear.residual[i]) > f->question.mu_stick[i] * fabs(f->linear.u[f->n + i]))
            mode = f->linear.residual[i] > 0.0 ? PERP_LOAD_FORWARD : PERP_LOAD_BACKWARD;
        else if ((mode == PERP_LOAD_FORWARD && !(f->linear.x[i] > f->question.stop[i])) ||
                 (mode == PERP_LOAD_BACKWARD && !(f->linear.x[i] < f->question.stop[i])))
            mode = PERP_LOAD_STICK;
        if (mode == PERP_LOAD_STICK || f->mu[i] == 0.0)
            side = 0;
        changed |= mode != f->pattern.mode[i] || side != f->pattern.side[i];
        f->pattern.mode[i] = mode;
        f->pattern.side[i] = side;
    }
    return changed;
}

/* Corrects the pattern until its point holds; keeps that. */
static perp_status iterate(perp_load_friction *f, int64_t *patterns)
{
    int32_t at_vertex;

    for (int32_t round = 0; round < 3 * f->n + 10; round++) {
        ++*patterns;
        if (perp__friction_solve_pattern(f, 1) != 0)
            return PERP_OK;
        if (perp__friction_holds(f, &at_vertex))
            return perp__friction_keep_point(f, at_vertex);
        if (!correct(f))
            return PERP_OK;
    }
    return PERP_OK;
}

/* All forward and all backward first, then signs by a fixed random sequence. */
static perp_status iterate_from(perp_load_friction *f, int32_t start, uint64_t *seed,
                                int64_t *patterns)
{
    for (int32_t i = 0; i < f->n; i++) {
        const int32_t count = choices(f, i);

        perp__next_random(seed);
        choose(f, i,
               start == 0   ? 0
               : start == 1 ? count - 1
                            : (int32_t)((*seed >> 33) % (uint64_t)count));
    }
    return iterate(f, patterns);
}

/* The equivalent LCP, N = w - z: free x, 0 <= z  perp  w = C x + d + z >= 0 and
 * (A + t C) x + 2 t z + b + t d - tau = 0 with t = mu sign; 2 n columns of 2 n rows in M. */
static void fill_lcp(const perp_load_friction *f, double *M, double *q, double *lower)
{
    const size_t n = (size_t)f->n;

    memset(M, 0, 4 * n * n * sizeof *M);
    for (size_t i = 0; i < n; i++) {
        const double t = f->mu[i] * f->question.sign[i];

        for (size_t j = 0; j < n; j++) {
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
    const perp_matrix view = perp__view(PERP_STORAGE_COLUMN_MAJOR, 2 * f->n, 2 * f->n, M);
    perp_lcp_settings settings;
    perp_lcp_solver *solver;
    perp_lcp_result result;
    perp_status status;

    perp_lcp_settings_init(&settings, sizeof settings);
    perp_lcp_result_init(&result, sizeof result);
    settings.method = PERP_LCP_LEMKE;
    status = perp__lcp_create(f->context, &solver, &settings);
    if (status != PERP_OK)
        return status;
    status = perp__lcp_setup(solver, &view, lower, NULL);
    PERP__THEN(status, perp__lcp_solve(solver, z, NULL, NULL, &result, q, NULL));
    perp__lcp_destroy(solver);
    for (int32_t i = 0; i < f->n && status == PERP_OK; i++) {
        f->pattern.mode[i] = PERP_LOAD_SLIDE;
        f->pattern.side[i] = (int8_t)(f->mu[i] == 0.0 ? 0 : z[f->n + i] > 0.0 ? -1 : 1);
    }
    return status;
}

static perp_status iterate_from_lemke(perp_load_friction *f, int64_t *patterns)
{
    const size_t n = (size_t)f->n;
    double *M;
    perp_status status;

    for (int32_t i = 0; i < f->n; i++)
        if (f->question.sign[i] == 0)
            return PERP_OK;
    M = perp__allocate(f->context, 4 * n * n + 6 * n, sizeof *M);
    if (!M)
        return perp__fail_memory(f->context, "the LCP of the normal forces");
    fill_lcp(f, M, M + 4 * n * n, M + 4 * n * n + 2 * n);
    status = solve_lcp(f, M, M + 4 * n * n, M + 4 * n * n + 2 * n, M + 4 * n * n + 4 * n);
    perp__release(f->context, M);
    return status == PERP_OK ? iterate(f, patterns) : status;
}

static perp_status search(perp_load_friction *f, int64_t *patterns)
{
    uint64_t seed = 1;
    perp_status status = iterate_from_lemke(f, patterns);

    for (int32_t start = 0; start < f->settings.starts && status == PERP_OK; start++)
        status = iterate_from(f, start, &seed, patterns);
    return status;
}

/* ---- one answer ---------------------------------------------------------------------------- */

/* Where the system is monotone there is one answer, and a pattern that holds, with room, is its
 * only one. From going on as before with constant normal forces it is a few corrections. */
static perp_status answer_directly(perp_load_friction *f, int64_t *patterns)
{
    perp_status status;

    for (int32_t i = 0; i < f->n; i++) {
        const int32_t sense = f->question.sign[i] != 0 ? 0 : f->question.before[i];

        if (f->question.mu_stick[i] > f->mu[i] && f->question.sign[i] == 0)
            return PERP_OK;
        f->pattern.mode[i] = (int8_t)(f->question.sign[i] != 0 ? PERP_LOAD_SLIDE
                                      : sense > 0              ? PERP_LOAD_FORWARD
                                      : sense < 0              ? PERP_LOAD_BACKWARD
                                                               : PERP_LOAD_STICK);
        f->pattern.side[i] = (int8_t)(f->mu[i] == 0.0 || f->pattern.mode[i] == PERP_LOAD_STICK ? 0
                                      : f->d[i] < 0.0                                          ? -1
                                                                                               : 1);
    }
    status = iterate(f, patterns);
    if (f->answers.count != 1 || f->answers.first->at_vertex || f->answers.incomplete)
        perp__answers_clear(&f->answers);
    return status;
}

/* ---- the call ------------------------------------------------------------------------------ */

static int32_t is_before(const void *user, const perp__answer *a, const perp__answer *b)
{
    const perp_load_friction *f = user;

    for (int32_t i = 0; i < f->n; i++)
        if (a->middle[i] != b->middle[i])
            return a->middle[i] < b->middle[i];
    return 1;
}

static void set_constants(perp_load_friction *f)
{
    f->linear.tolerance = f->settings.tol;
    for (int32_t i = 0; i < f->n; i++) {
        f->c[i] = f->b[i] - f->question.tau[i];
        f->c_size[i] = fabs(f->question.tau[i]) + fabs(f->b[i]);
        f->c[f->n + i] = f->d[i];
        f->c_size[f->n + i] = fabs(f->d[i]);
    }
}

perp_status perp__friction_answer_all(perp_load_friction *f, perp_load_summary *summary)
{
    const int64_t most = f->settings.most_patterns;
    const perp__answer *a;
    int64_t patterns;
    perp_status status = PERP_OK;

    memset(summary, 0, sizeof *summary);
    perp__answers_clear(&f->answers);
    set_constants(f);
    f->tree.positions = f->n;
    f->tree.user = f->answers.user = f->linear.user =
        f; /* handles change places in perp_load_friction_set */
    f->tree.reverse = 1;
    f->tree.choices = choices;
    f->tree.choose = choose;
    f->tree.leaf = try_pattern;
    if (f->monotone)
        status = answer_directly(f, &summary->patterns);
    patterns = perp__pattern_tree_count(&f->tree, most);
    summary->exhaustive = f->answers.count > 0 || patterns <= most;
    if (status == PERP_OK && f->answers.count == 0) {
        summary->patterns = summary->exhaustive ? patterns : 0;
        status = summary->exhaustive ? perp__pattern_tree_search(&f->tree)
                                     : search(f, &summary->patterns);
    }
    if (status != PERP_OK) {
        perp__answers_clear(&f->answers);
        return status;
    }
    summary->exhaustive &= !f->answers.incomplete;
    perp__answers_sort(&f->answers, is_before);
    summary->count = f->answers.count;
    for (a = f->answers.first; a; a = a->next) {
        summary->families += a->kind == PERP_LOAD_FAMILY;
        summary->stable += a->stable;
    }
    return PERP_OK;
}
