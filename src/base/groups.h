/* Parts of 0 .. n - 1 that pairs join (Galler & Fischer, Comm. ACM 7 (1964) 301): a forest in which
 * parents have lower indices, so that parts do not depend on the order of the joins. At first
 * everyone is its own parent. */
#ifndef PERP_BASE_GROUPS_H
#define PERP_BASE_GROUPS_H

#include <stdbool.h>
#include <stdint.h>

/* Lowest index of i's part so far, in a forest of parents with lower indices. */
static inline int32_t perp__root_of(int32_t *parents, int32_t i)
{
    while (parents[i] != i) {
        parents[i] = parents[parents[i]];
        i = parents[i];
    }
    return i;
}

/* Puts i and j into one part. True if they were in two. */
static inline bool perp__join(int32_t *parents, int32_t i, int32_t j)
{
    const int32_t a = perp__root_of(parents, i), b = perp__root_of(parents, j);

    parents[a < b ? b : a] = a < b ? a : b;
    return a != b;
}

/* Numbers the parts of a forest 0, 1, ... in the order of their lowest indices: parents[i] becomes
 * the number of i's part. Returns how many there are. */
static inline int32_t perp__number_parts(int32_t *parents, int32_t n)
{
    int32_t count = 0, i;

    for (i = 0; i < n; i++) /* a parent is lower, so it has its number, coded as -1 - number */
        parents[i] = parents[i] == i ? -1 - count++ : parents[parents[i]];
    for (i = 0; i < n; i++)
        parents[i] = -1 - parents[i];
    return count;
}

#endif
