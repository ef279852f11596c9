#include "base/handle.h"

#include <string.h>

/* How the struct behind every handle begins; copied, for the struct has a type of its own. */
typedef struct head {
    PERP__HANDLE;
} head;

int32_t perp__handle_is(const void *handle, const perp__kind *kind)
{
    const perp__kind *own = NULL;

    if (handle)
        memcpy(&own, handle, sizeof own);
    return own == kind;
}

static head head_of(const void *handle)
{
    head own;

    memcpy(&own, handle, sizeof own);
    return own;
}

void *perp__handle_create(perp_context *context, const perp__kind *kind)
{
    const head own = {kind, context};
    void *made = perp__allocate_zeros(context, 1, kind->size, kind->name);

    if (!made)
        return NULL;
    memcpy(made, &own, sizeof own);
    context->children++;
    return made;
}

void perp__handle_end(void *handle)
{
    head own;

    if (!handle)
        return;
    own = head_of(handle);
    own.kind->release(handle);
    memset(handle, 0, sizeof own);
    perp__release(own.context, handle);
    own.context->children--;
}

perp_status perp__handle_enter(const void *handle, const perp__kind *kind)
{
    return perp__handle_is(handle, kind) ? perp__open(head_of(handle).context) : PERP_ERROR_HANDLE;
}

void perp__handle_destroy(void *handle, const perp__kind *kind)
{
    perp_context *context;

    if (!perp__handle_is(handle, kind))
        return;
    context = head_of(handle).context;
    if (context->busy)
        return;
    context->busy = PERP__DESTROYS;
    perp__handle_end(handle);
    perp__leave(context, PERP_OK);
}
