/* Numbers by their keys. */
#ifndef PERP_BASE_SORT_H
#define PERP_BASE_SORT_H

#include <stdint.h>

typedef struct perp__keyed {
    uint64_t key;
    int32_t value;
} perp__keyed;

/* Ascending by key; equal keys keep their order. spare: room for as many. O(count). */
void perp__sort(perp__keyed *items, perp__keyed *spare, int32_t count);

#endif
