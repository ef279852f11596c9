#include "base/arena.h"

#include <string.h>

#include "base/context.h"

#define PERP__ALIGNMENT ((size_t)64)

/* More than any memory. */
#define LARGEST (SIZE_MAX / 4)

/* Numbers below have a product that fits twice over. */
#define SMALL ((size_t)1 << (4 * sizeof(size_t) - 1))

/* Room for `many` arrays of `count` elements, whole cache lines each: *bytes. Returns the first. */
static char *take(perp__arena *arena, size_t count, size_t size, size_t many, size_t *bytes)
{
    const size_t offset = arena->used;

    /* a division that most are spared */
    if ((count >= SMALL || size >= SMALL) && size != 0 && count > LARGEST / size)
        *bytes = SIZE_MAX;
    else
        *bytes = (count * size + PERP__ALIGNMENT - 1) & ~(PERP__ALIGNMENT - 1);
    if (*bytes > LARGEST / many || offset > LARGEST) {
        arena->used = SIZE_MAX; /* an overflow while measuring: the fit will fail */
        return NULL;
    }
    arena->used = offset + *bytes * many;
    return arena->base && arena->used <= arena->capacity ? arena->base + offset : NULL;
}

void *perp__arena_take(perp__arena *arena, size_t count, size_t size)
{
    size_t bytes;

    return take(arena, count, size, 1, &bytes);
}

void perp__arena_take_all(perp__arena *arena, size_t count, size_t size, const void *places,
                          size_t many)
{
    size_t bytes;
    char *first = take(arena, count, size, many, &bytes);

    for (size_t k = 0; k < many; k++) { /* pointers are copied, for they have types of their own */
        void *place, *array = first ? first + k * bytes : NULL;

        memcpy(&place, (const char *)places + k * sizeof place, sizeof place);
        memcpy(place, &array, sizeof array);
    }
}

void perp__arena_lend(perp__arena *arena, perp_context *context, void *block, size_t bytes)
{
    arena->context = context;
    arena->block = block;
    arena->is_lent = 1;
    arena->capacity = bytes - PERP__ALIGNMENT;
}

/* Runs the layout on the block, or without one to measure. Whether all fits. */
static int lay_out(perp__arena *arena, perp__layout layout, void *object, void *block)
{
    const uintptr_t past = (uintptr_t)block % PERP__ALIGNMENT;

    arena->base = block ? (char *)block + (past ? PERP__ALIGNMENT - past : 0) : NULL;
    arena->used = 0;
    layout(arena, object);
    return block && arena->used <= arena->capacity;
}

perp_status perp__arena_fit(perp__arena *arena, perp_context *context, perp__layout layout,
                            void *object)
{
    void *block = NULL;
    size_t needed;

    if (arena->block && lay_out(arena, layout, object, arena->block)) /* most often enough */
        return PERP_OK;
    lay_out(arena, layout, object, NULL);
    arena->context = context;
    /* what outgrew its block grows on, as a pile does that comes to lie: room for a quarter more
     * spares new pages in most of its steps */
    needed = arena->used;
    if (needed <= SIZE_MAX / 2) {
        needed += arena->block && !arena->is_lent ? needed / 4 : 0;
        block = perp__allocate(context, 1, needed + PERP__ALIGNMENT);
    }
    if (!block)
        return perp__fail_memory(context, "the workspace");
    if (!arena->is_lent)
        perp__release(context, arena->block);
    arena->is_lent = 0;
    arena->block = block;
    arena->capacity = needed;
    lay_out(arena, layout, object, block);
    return PERP_OK;
}

perp_status perp__arena_fit_sizes(perp__arena *arena, perp_context *context, perp__layout layout,
                                  void *object, size_t *fitted, const size_t *sizes, size_t count)
{
    perp_status status;
    size_t i, enough = 0;

    while (enough < count && arena->block && sizes[enough] <= fitted[enough])
        enough++;
    if (enough == count)
        return PERP_OK;
    memset(fitted, 0, count * sizeof *fitted);
    status = perp__arena_fit(arena, context, layout, object);
    for (i = 0; status == PERP_OK && i < count; i++)
        fitted[i] = sizes[i];
    return status;
}

void perp__arena_release(perp__arena *arena)
{
    if (arena->block && !arena->is_lent)
        perp__release(arena->context, arena->block);
    memset(arena, 0, sizeof *arena);
}

perp_status perp__workspace_fit(perp__workspace *space, perp_context *context, size_t size,
                                perp__layout layout, const void *problem, int64_t setup)
{
    perp_status status;

    if (!space->work) {
        space->work = perp__allocate_zeros(context, 1, size, "a method's workspace");
        if (!space->work)
            return PERP_ERROR_MEMORY;
    }
    memcpy(space->work, &problem, sizeof problem);
    if (space->fitted == setup)
        return PERP_OK;
    space->fitted = 0;
    status = perp__arena_fit(&space->arena, context, layout, space->work);
    if (status == PERP_OK)
        space->fitted = setup;
    return status;
}

void perp__workspace_release(perp__workspace *space, void (*release)(void *work))
{
    if (!space->work)
        return;
    if (release)
        release(space->work);
    perp__release(space->arena.context, space->work);
    perp__arena_release(&space->arena);
}

/* ---- arrays that grow ---- */

enum { FIRST = 16 };

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
    for (const perp__growing *array = arrays; array < arrays + count && made; array++) {
        void *old, *block = perp__allocate(context, (size_t)entries, array->entry);

        memcpy(&old, array->pointer, sizeof old); /* the pointer has a type of its own */
        made = block != NULL;
        if (!made)
            break;
        if (array->kept > 0)
            memcpy(block, old, array->kept);
        memcpy(array->pointer, &block, sizeof block);
        perp__release(context, old);
    }
    if (!made)
        return what ? perp__fail_memory(context, what) : PERP_ERROR_MEMORY;
    *capacity = (int32_t)entries;
    return PERP_OK;
}
