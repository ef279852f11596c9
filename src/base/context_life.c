/* The life of a context, what one is known by, and the texts and numbers that tell a caller what
 * was loaded: of libperp alone. PERP__BLAS_NAME comes from the Makefile. */
#include "base/context.h"

#include <stdlib.h>
#include <string.h>

#include "base/check.h"

#ifndef PERP__BLAS_NAME
#define PERP__BLAS_NAME "blas"
#endif
#define PERP__TEXT2(x) #x
#define PERP__TEXT(x) PERP__TEXT2(x)
#define PERP__LIST_CASE(name, value, text) \
    case name:                             \
        return text;

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
    perp_context_settings copy = {0};
    perp_status status;
    perp_context *made;

    if (!context)
        return PERP_ERROR_ARGUMENT;
    status = PERP__READ(perp_context_settings, NULL, &copy, settings);
    if (status != PERP_OK)
        return status;
    if (!copy.allocate != !copy.release)
        return PERP_ERROR_ARGUMENT;
    if (!copy.allocate) {
        copy.allocate = default_allocate;
        copy.release = default_release;
    }
    made = copy.allocate(sizeof *made, copy.allocator_user);
    if (!made)
        return PERP_ERROR_MEMORY;
    perp__context_init(made, copy.allocate, copy.release, copy.allocator_user);
    made->log = copy.log;
    made->log_user = copy.log_user;
    *context = made;
    return PERP_OK;
}

void perp_context_destroy(perp_context *context)
{
    if (!is_context(context) || context->busy)
        return;
    context->busy = PERP__DESTROYS; /* which keeps the message, if something lives on */
    context->destroyed = 1;
    perp__leave(context, PERP_OK);
}

const char *perp_context_message(const perp_context *context)
{
    return is_context(context) ? context->message : "";
}

const char *perp_status_text(perp_status status)
{
    switch (status) {
        PERP_STATUS_LIST(PERP__LIST_CASE)
    }
    return "unknown status";
}

const char *perp_outcome_text(perp_outcome outcome)
{
    switch (outcome) {
        PERP_OUTCOME_LIST(PERP__LIST_CASE)
    }
    return "unknown outcome";
}

perp_status perp_struct_init(void *object, size_t size)
{
    return perp__struct_init(object, size, sizeof size);
}

int32_t perp_version(void)
{
    return PERP_VERSION;
}

int32_t perp_abi_version(void)
{
    return PERP_ABI_VERSION;
}

const char *perp_version_text(void)
{
    return PERP__TEXT(PERP_VERSION_MAJOR) "." PERP__TEXT(PERP_VERSION_MINOR) "." PERP__TEXT(
        PERP_VERSION_PATCH) " " PERP__BLAS_NAME " klu";
}
