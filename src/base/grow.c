#include "base/grow.h"

#include <string.h>

#include "base/context.h"

enum { FIRST = 16 };

/* The pointer is copied, for it has a type of its own. */
static int grow(perp_context *context, const perp__growing *array, size_t entries)
{
    void *old, *block = perp__allocate(context, entries, array->entry);

    if (!block)
        return 0;
    memcpy(&old, array->pointer, sizeof old);
    if (array->kept > 0)
        memcpy(block, old, array->kept);
    memcpy(array->pointer, &block, sizeof block);
    perp__release(context, old);
    return 1;
}

perp_status perp__grow(perp_context *context, const char *what, int32_t *capacity, int64_t needed,
                       const perp__growing *arrays, size_t count)
{
    int64_t entries = *capacity > 0 ? *capacity : FIRST;
    int made = 1;

    if (needed <= *capacity)
        return PERP_OK;
    while (entries < needed)
        entries *= 2;
    made = entries <= INT32_MAX / 8;
    for (size_t k = 0; k < count && made; k++)
        made = grow(context, &arrays[k], (size_t)entries);
    if (!made)
        return what ? perp__fail_memory(context, what) : PERP_ERROR_MEMORY;
    *capacity = (int32_t)entries;
    return PERP_OK;
}
