#include "base/handle.h"

#include <string.h>

/* How the struct behind every handle begins; copied, for the struct has a type of its own. */
typedef struct head {
    PERP__HANDLE;
} head;

bool perp__handle_is(const void *handle, const perp__kind *kind)
{
    const perp__kind *copy = NULL;

    if (handle)
        memcpy(&copy, handle, sizeof copy);
    return copy == kind;
}

static head head_of(const void *handle)
{
    head copy;

    memcpy(&copy, handle, sizeof copy);
    return copy;
}

void *perp__handle_create(perp_context *context, const perp__kind *kind)
{
    const head copy = {kind, context};
    void *made = perp__allocate_zeros(context, 1, kind->size, kind->name);

    if (!made)
        return NULL;
    memcpy(made, &copy, sizeof copy);
    context->children++;
    return made;
}

void perp__handle_end(void *handle)
{
    head copy;

    if (!handle)
        return;
    copy = head_of(handle);
    copy.kind->release(handle);
    memset(handle, 0, sizeof copy);
    perp__release(copy.context, handle);
    copy.context->children--;
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
