/* Numbers in order. */
#ifndef PERP_BASE_SORT_H
#define PERP_BASE_SORT_H

#include <stdint.h>

typedef struct perp__keyed {
    uint64_t key;
    int32_t value;
} perp__keyed;

/* The first of an ascending list that is not below x: its number, or count. */
static inline int32_t perp__lower_bound(const int32_t *list, int32_t count, int32_t x)
{
    int32_t low = 0, high = count;

    while (low < high) {
        const int32_t middle = low + (high - low) / 2;

        if (list[middle] < x)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* Ascending by key; equal keys keep their order. spare: room for as many. O(count). */
void perp__sort(perp__keyed *items, perp__keyed *spare, int32_t count);
/* Ascending, by insertion: short lists. */
void perp__sort_few(int32_t *list, int32_t count);

#endif
