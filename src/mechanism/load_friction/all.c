/* All answers of a question by enumeration of the patterns, or as many as a search finds. */
#include <math.h>
#include <string.h>

#include "base/random.h"
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
    const int32_t dimension = perp__friction_solve_pattern(f);
    int32_t at_vertex;

    if (dimension > 0)
        return perp__friction_keep_family(f, dimension);
    if (dimension < 0 || !perp__friction_holds(f, &at_vertex))
        return PERP_OK;
    return perp__friction_keep_point(f, at_vertex);
}

/* From the pattern: what its own point asks for, until that is the pattern; then it is kept. */
static perp_status iterate(perp_load_friction *f, int64_t *patterns)
{
    int32_t changed = 1, at_vertex;

    for (int32_t round = 0; changed && round < 3 * f->n + 10; round++) {
        ++*patterns;
        if (perp__friction_solve_pattern(f) != 0)
            return PERP_OK;
        if (perp__friction_holds(f, &at_vertex))
            return perp__friction_keep_point(f, at_vertex);
        changed = 0;
        for (int32_t i = 0; i < f->n; i++) {
            const double x = f->linear.x[i], N = f->linear.u[f->n + i];
            int8_t mode = f->pattern.mode[i], side = N >= 0.0 ? 1 : -1;

            if (mode == PERP_LOAD_STICK &&
                fabs(f->linear.residual[i]) > f->question.mu_stick[i] * fabs(N))
                mode = f->linear.residual[i] > 0.0 ? PERP_LOAD_FORWARD : PERP_LOAD_BACKWARD;
            else if ((mode == PERP_LOAD_FORWARD && !(x > f->question.stop[i])) ||
                     (mode == PERP_LOAD_BACKWARD && !(x < f->question.stop[i])))
                mode = PERP_LOAD_STICK;
            if (mode == PERP_LOAD_STICK || f->mu[i] == 0.0)
                side = 0;
            changed |= mode != f->pattern.mode[i] || side != f->pattern.side[i];
            f->pattern.mode[i] = mode;
            f->pattern.side[i] = side;
        }
    }
    return PERP_OK;
}

static perp_status search(perp_load_friction *f, int64_t *patterns)
{
    uint64_t seed = 1;
    perp_status status = PERP_OK;

    for (int32_t start = 0; start < f->settings.starts && status == PERP_OK; start++) {
        /* all forward and all backward first, then signs by a fixed random sequence */
        for (int32_t i = 0; i < f->n; i++) {
            const int32_t count = choices(f, i);
            const int32_t some = (int32_t)(perp__next_random(&seed) % (uint64_t)count);

            choose(f, i, start == 0 ? 0 : start == 1 ? count - 1 : some);
        }
        status = iterate(f, patterns);
    }
    return status;
}

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

static int32_t is_before(const void *user, const perp__answer *a, const perp__answer *b)
{
    const perp_load_friction *f = user;

    for (int32_t i = 0; i < f->n; i++)
        if (a->middle[i] != b->middle[i])
            return a->middle[i] < b->middle[i];
    return 1;
}

perp_status perp__friction_answer_all(perp_load_friction *f, perp_load_summary *summary)
{
    const int64_t most = f->settings.most_patterns;
    const perp__answer *a;
    int64_t patterns;
    perp_status status = PERP_OK;

    memset(summary, 0, sizeof *summary);
    perp__answers_clear(&f->answers);
    f->linear.tolerance = f->settings.tol;
    for (int32_t i = 0; i < f->n; i++) {
        f->c[i] = f->b[i] - f->tau[i];
        f->c_size[i] = fabs(f->tau[i]) + fabs(f->b[i]);
        f->c[f->n + i] = f->d[i];
        f->c_size[f->n + i] = fabs(f->d[i]);
    }
    f->answers.user = f->linear.user = f; /* handles change places in perp_load_friction_set */
    f->tree = (perp__pattern_tree){f->n, f->tree.next, 0, 1, f, choices, choose, try_pattern};
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
