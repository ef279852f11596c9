/* Broad phase: sort by the low end in x, sweep. */
#include "world/collide/collide.h"

#include <string.h>

/* Heap sort: O(n log n) at worst, in place, and without the allocation that qsort is free to do. */

typedef int before(const void *x, const void *y);

enum { LARGEST_ELEMENT = sizeof(perp__extent) };

static void swap(char *x, char *y, size_t size)
{
    char held[LARGEST_ELEMENT];
    memcpy(held, x, size);
    memcpy(x, y, size);
    memcpy(y, held, size);
}

/* Restores the heap below `root`: no child comes after its parent. */
static void sift(char *base, size_t root, size_t count, size_t size, before *comes_before)
{
    for (;;) {
        size_t last = root;
        for (size_t child = 2 * root + 1; child <= 2 * root + 2 && child < count; child++)
            if (comes_before(base + last * size, base + child * size))
                last = child;
        if (last == root)
            return;
        swap(base + root * size, base + last * size, size);
        root = last;
    }
}

static void heap_sort(void *elements, size_t count, size_t size, before *comes_before)
{
    char *base = elements;
    for (size_t root = count / 2; root-- > 0;)
        sift(base, root, count, size, comes_before);
    for (size_t end = count; end-- > 1;) {
        swap(base, base + end * size, size);
        sift(base, 0, end, size, comes_before);
    }
}

/* Both orders are total, so that the outcome of the sort is unique. */

static int extent_before(const void *x, const void *y)
{
    const perp__extent *a = x, *b = y;
    if (a->low[0] < b->low[0] || a->low[0] > b->low[0])
        return a->low[0] < b->low[0];
    return a->item < b->item;
}

static int pair_before(const void *x, const void *y)
{
    const perp__pair *a = x, *b = y;
    return a->first != b->first ? a->first < b->first : a->second < b->second;
}

/* The sweep has seen to x. */
static int overlap(const perp__extent *a, const perp__extent *b)
{
    return a->group != b->group && a->low[1] <= b->high[1] && b->low[1] <= a->high[1] &&
           a->low[2] <= b->high[2] && b->low[2] <= a->high[2];
}

int32_t perp__broad_phase(perp__extent *extents, int32_t count, perp__pair *pairs, int32_t capacity)
{
    if (count < 2)
        return 0;
    heap_sort(extents, (size_t)count, sizeof *extents, extent_before);

    int32_t found = 0;
    for (int32_t i = 0; i < count; i++) {
        const perp__extent *a = &extents[i];
        for (int32_t j = i + 1; j < count && extents[j].low[0] <= a->high[0]; j++) {
            const perp__extent *b = &extents[j];
            if (!overlap(a, b))
                continue;
            if (found < capacity) {
                pairs[found].first = a->item < b->item ? a->item : b->item;
                pairs[found].second = a->item < b->item ? b->item : a->item;
            }
            if (found < INT32_MAX)
                found++;
        }
    }
    int32_t written = found < capacity ? found : capacity;
    if (written > 1)
        heap_sort(pairs, (size_t)written, sizeof *pairs, pair_before);
    return found;
}
