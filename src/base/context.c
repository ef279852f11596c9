#include "base/context.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/check.h"

/* Its address is what a context is known by. */
static const char known = 0;

static void *default_allocate(size_t size, void *user)
{
    (void)user;
    return malloc(size);
}

static void default_release(void *pointer, void *user)
{
    (void)user;
    free(pointer);
}

static int is_context(const perp_context *context)
{
    return context && context->is == &known && !context->destroyed;
}

PERP__INIT(perp_context_settings)

void perp__context_init(perp_context *context, perp_allocate_function allocate,
                        perp_release_function release, void *user)
{
    memset(context, 0, sizeof *context);
    context->is = &known;
    context->allocate = allocate;
    context->release = release;
    context->allocator_user = user;
}

perp_status perp_context_create(perp_context **context, const perp_context_settings *settings)
{
    perp_context_settings own = {0};
    perp_status status;
    perp_context *made;

    if (!context)
        return PERP_ERROR_ARGUMENT;
    status = PERP__READ(perp_context_settings, NULL, &own, settings);
    if (status != PERP_OK)
        return status;
    if (!own.allocate != !own.release)
        return PERP_ERROR_ARGUMENT;
    if (!own.allocate) {
        own.allocate = default_allocate;
        own.release = default_release;
    }
    made = own.allocate(sizeof *made, own.allocator_user);
    if (!made)
        return PERP_ERROR_MEMORY;
    perp__context_init(made, own.allocate, own.release, own.allocator_user);
    made->log = own.log;
    made->log_user = own.log_user;
    *context = made;
    return PERP_OK;
}

static void release_if_unused(perp_context *context)
{
    if (context->destroyed && context->children == 0 && !context->busy) {
        context->is = NULL;
        context->release(context, context->allocator_user);
    }
}

void perp_context_destroy(perp_context *context)
{
    if (!is_context(context) || context->busy)
        return;
    context->destroyed = 1;
    release_if_unused(context);
}

const char *perp_context_message(const perp_context *context)
{
    return is_context(context) ? context->message : "";
}

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
    return is_context(context) ? perp__open(context) : PERP_ERROR_HANDLE;
}

perp_status perp__leave(perp_context *context, perp_status status)
{
    if (status == PERP_OK && context->busy != PERP__DESTROYS)
        context->message[0] = '\0'; /* what went wrong on the way was mended */
    context->busy = PERP__IDLE;
    release_if_unused(context);
    return status;
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
