#include "base/sort.h"

#include <stddef.h>
#include <string.h>

/* Below this insertion is faster. */
#define FEW 24

void perp__sort_few(int32_t *x, int32_t count)
{
    for (int32_t i = 1; i < count; i++) {
        const int32_t moved = x[i];
        int32_t j = i;

        for (; j > 0 && x[j - 1] > moved; j--)
            x[j] = x[j - 1];
        x[j] = moved;
    }
}

void perp__sort(perp__keyed *items, perp__keyed *spare, int32_t count)
{
    perp__keyed *from = items, *to = spare;
    uint64_t different = 0;

    for (int32_t i = 1; i < count && count <= FEW; i++) {
        const perp__keyed item = items[i];
        int32_t k = i;

        for (; k > 0 && items[k - 1].key > item.key; k--)
            items[k] = items[k - 1];
        items[k] = item;
    }
    if (count <= FEW)
        return;
    for (int32_t i = 1; i < count; i++)
        different |= items[i].key ^ items[0].key;
    for (int32_t shift = 0; shift < 64; shift += 8) { /* a counting sort by each byte */
        int32_t start[256] = {0}, sum = 0;
        perp__keyed *other = from;

        if ((different >> shift & 255) == 0)
            continue;
        for (int32_t i = 0; i < count; i++)
            start[from[i].key >> shift & 255]++;
        for (int32_t k = 0; k < 256; k++) {
            const int32_t here = start[k];

            start[k] = sum;
            sum += here;
        }
        for (int32_t i = 0; i < count; i++)
            to[start[from[i].key >> shift & 255]++] = from[i];
        from = to;
        to = other;
    }
    if (from != items)
        memcpy(items, from, (size_t)count * sizeof *items);
}
