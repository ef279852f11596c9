/* The tree over patterns, and the store of their answers: each once, and none within another. */
#include "patterns/patterns.h"

#include <string.h>

#include "base/context.h"

/* ---- the tree ------------------------------------------------------------------------------ */

/* Without recursion: there may be thousands of positions with one choice each. */
perp_status perp__pattern_tree_search(perp__pattern_tree *tree)
{
    perp_status status = PERP_OK;
    int32_t depth = 0;

    if (tree->positions == 0)
        return tree->leaf(tree->user);
    tree->next[0] = 0;
    while (depth >= 0 && status == PERP_OK && !tree->ended) {
        const int32_t position = tree->reverse ? tree->positions - 1 - depth : depth;

        if (tree->next[depth] == tree->choices(tree->user, position)) {
            depth--;
            continue;
        }
        if (!tree->choose(tree->user, position, tree->next[depth]++))
            continue;
        if (depth + 1 < tree->positions)
            tree->next[++depth] = 0;
        else
            status = tree->leaf(tree->user);
    }
    return status;
}

int64_t perp__pattern_tree_count(const perp__pattern_tree *tree, int64_t most)
{
    int64_t product = 1;

    for (int32_t i = 0; i < tree->positions && product <= most; i++)
        product *= tree->choices(tree->user, i);
    return product;
}

/* ---- memory of answers --------------------------------------------------------------------- */

perp__answer *perp__answer_create(perp__answers *answers, int32_t points)
{
    const size_t length = (size_t)answers->length, positions = (size_t)answers->positions;
    const size_t doubles =
        ((size_t)points + 2) * length + (size_t)answers->eigenvalues + (size_t)answers->extra;
    perp__answer *answer = answers->spare;
    double *block;

    if (points == 1 && answer) {
        answers->spare = answer->next;
        answer->dimension = answer->rays = answer->at_vertex = 0;
        answer->residual = 0.0;
        answer->vertices = 1;
        return answer;
    }
    answer = perp__allocate(answers->context, 1,
                            sizeof *answer + doubles * sizeof *block +
                                positions * (sizeof *answer->modes + 2));
    if (!answer)
        return NULL;
    memset(answer, 0, sizeof *answer);
    block = (double *)(void *)(answer + 1);
    answer->room = answer->vertices = points;
    answer->middle = block;
    answer->width = block + length;
    answer->eigenvalues = block + 2 * length;
    answer->extra = answer->eigenvalues + answers->eigenvalues;
    answer->points = answer->extra + answers->extra;
    answer->modes = (int32_t *)(void *)(block + doubles);
    answer->pattern = (int8_t *)(answer->modes + positions);
    return answer;
}

/* Families are rare and of any size. */
void perp__answer_release(perp__answers *answers, perp__answer *answer)
{
    if (answer->room == 1) {
        answer->next = answers->spare;
        answers->spare = answer;
    } else {
        perp__release(answers->context, answer);
    }
}

void perp__answers_clear(perp__answers *answers)
{
    while (answers->first) {
        perp__answer *next = answers->first->next;

        perp__answer_release(answers, answers->first);
        answers->first = next;
    }
    answers->count = answers->incomplete = 0;
}

void perp__answers_release(perp__answers *answers)
{
    perp__answers_clear(answers);
    while (answers->spare) {
        perp__answer *next = answers->spare->next;

        perp__release(answers->context, answers->spare);
        answers->spare = next;
    }
}

/* ---- answers ------------------------------------------------------------------------------- */

void perp__answer_find_middle(const perp__answers *answers, perp__answer *answer)
{
    const size_t n = (size_t)answers->length;
    int32_t k;

    for (size_t i = 0; i < n; i++) {
        double sum = 0.0, rays = 0.0;

        for (k = 0; k < answer->vertices; k++)
            sum += answer->points[(size_t)k * n + i];
        for (; k < answer->vertices + answer->rays; k++)
            rays += answer->points[(size_t)k * n + i];
        answer->middle[i] = sum / answer->vertices + rays;
    }
}

void perp__answers_keep(perp__answers *answers, perp__answer *answer)
{
    perp__answer **link, *old;

    for (old = answers->first; old; old = old->next)
        if ((old->dimension > 0 || answer->dimension == 0) &&
            answers->holds(answers->user, old, answer)) {
            /* of two branches that meet, one is not stable: so is the point where they do */
            if (old->dimension == 0 && old->stable && !answer->stable) {
                old->stable = 0;
                old->flutter = answer->flutter;
                old->eigenvalue_count = answer->eigenvalue_count;
                memcpy(old->eigenvalues, answer->eigenvalues,
                       (size_t)answers->eigenvalues * sizeof *old->eigenvalues);
            }
            perp__answer_release(answers, answer);
            return;
        }
    for (link = &answers->first; *link;) {
        old = *link;
        if (answer->dimension > 0 && answers->holds(answers->user, answer, old)) {
            *link = old->next;
            perp__answer_release(answers, old);
            answers->count--;
        } else {
            link = &old->next;
        }
    }
    answer->next = NULL;
    *link = answer;
    answers->count++;
}

const perp__answer *perp__answers_get(const perp__answers *answers, int32_t index)
{
    const perp__answer *answer = answers->first;

    for (; index > 0; index--)
        answer = answer->next;
    return answer;
}

/* ---- order --------------------------------------------------------------------------------- */

typedef int32_t (*order)(const void *user, const perp__answer *a, const perp__answer *b);

static perp__answer *sort(const perp__answers *answers, perp__answer *list, int32_t count,
                          order is_before)
{
    perp__answer *last = list, *one, *other, **link = &list;

    if (count < 2)
        return list;
    for (int32_t k = 1; k < count / 2; k++)
        last = last->next;
    other = last->next;
    last->next = NULL;
    one = sort(answers, list, count / 2, is_before);
    other = sort(answers, other, count - count / 2, is_before);
    while (one && other) {
        perp__answer **from = is_before(answers->user, one, other) ? &one : &other;

        *link = *from;
        link = &(*from)->next;
        *from = *link;
    }
    *link = one ? one : other;
    return list;
}

void perp__answers_sort(perp__answers *answers,
                        int32_t (*is_before)(const void *user, const perp__answer *a,
                                             const perp__answer *b))
{
    answers->first = sort(answers, answers->first, answers->count, is_before);
}
