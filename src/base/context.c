/* What goes on inside a public call. Compiled into libperp-mechanism too: nothing public here. */
#include "base/context.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

perp_status perp__open(perp_context *context)
{
    if (context->busy)
        return PERP_ERROR_BUSY;
    context->busy = PERP__CALLED;
    context->message[0] = '\0';
    return PERP_OK;
}

perp_status perp__enter(perp_context *context)
{
    /* Asked of the library that makes contexts: this code is in libperp-mechanism too. */
    if (perp_version() != PERP_VERSION)
        return PERP_ERROR_ABI;
    if (!context || perp_context_message(context) != context->message)
        return PERP_ERROR_HANDLE;
    return perp__open(context);
}

perp_status perp__leave(perp_context *context, perp_status status)
{
    if (status == PERP_OK && context->busy != PERP__DESTROYS)
        context->message[0] = '\0'; /* what went wrong on the way was mended */
    context->busy = PERP__IDLE;
    if (context->destroyed && context->children == 0) {
        context->is = NULL;
        context->release(context, context->allocator_user);
    }
    return status;
}

perp__pause perp__pause_call(perp_context *context)
{
    const perp__pause pause = {context->busy, context->destroyed};

    context->busy = PERP__IDLE;
    context->destroyed = 0;
    context->children++;
    return pause;
}

void perp__resume_call(perp_context *context, perp__pause pause)
{
    context->busy = pause.busy;
    context->destroyed = pause.destroyed;
    context->children--;
}

perp_status perp__fail(perp_context *context, perp_status status, const char *format, ...)
{
    va_list arguments;

    if (!context)
        return status;
    va_start(arguments, format);
    vsnprintf(context->message, sizeof context->message, format, arguments);
    va_end(arguments);
    if (context->log)
        context->log(context->message, context->log_user);
    return status;
}

perp_status perp__fail_memory(perp_context *context, const char *what)
{
    return perp__fail(context, PERP_ERROR_MEMORY, "out of memory for %s", what);
}

void *perp__allocate(perp_context *context, size_t count, size_t size)
{
    if (size != 0 && count > SIZE_MAX / size)
        return NULL;
    return context->allocate(count * size > 0 ? count * size : 1, context->allocator_user);
}

void *perp__allocate_zeros(perp_context *context, size_t count, size_t size, const char *what)
{
    void *made = perp__allocate(context, count, size);

    if (!made)
        perp__fail_memory(context, what);
    return made ? memset(made, 0, count * size) : NULL;
}

void perp__release(perp_context *context, void *pointer)
{
    if (pointer)
        context->release(pointer, context->allocator_user);
}
