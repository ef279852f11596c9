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

/* `work`, which makes and destroys a context, takes its memory in more than `least` pieces; where
 * any of them fails it returns PERP_ERROR_MEMORY, and nothing stays. */
void memory_fails_anywhere(perp_status (*work)(const perp_context_settings *settings), int least);

#endif
