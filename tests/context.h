/* The context of a suite, and what makes and destroys it around a group of tests. */
#ifndef PERP_TESTS_CONTEXT_H
#define PERP_TESTS_CONTEXT_H

#include <perp/base.h>

static perp_context *context;

static inline int make(void **state)
{
    (void)state;
    return perp_context_create(&context, NULL);
}

static inline int destroy(void **state)
{
    (void)state;
    perp_context_destroy(context);
    return 0;
}

#endif
