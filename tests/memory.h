/* An allocator that counts and that fails when told to. */
#ifndef PERP_TESTS_MEMORY_H
#define PERP_TESTS_MEMORY_H

#include <perp/perp.h>

typedef struct memory {
    int calls, live;
    int fails_at; /* the call that fails, from 1; 0: none */
} memory;

/* Settings of a context that takes its memory from *m. */
perp_context_settings memory_settings(memory *m);

#endif
