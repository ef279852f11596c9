#include "memory.h"

#include <stdlib.h>
#include <string.h>

#include "suite.h"

static void *limited_allocate(size_t size, void *user)
{
    memory *m = user;
    void *pointer;

    m->calls++;
    if (m->calls == m->fails_at)
        return NULL;
    pointer = malloc(size);
    if (pointer) {
        memset(pointer, 0xa5, size); /* nobody may rely on fresh memory being zero */
        m->live++;
    }
    return pointer;
}

static void limited_release(void *pointer, void *user)
{
    memory *m = user;

    assert_non_null(pointer);
    m->live--;
    free(pointer);
}

perp_context_settings memory_settings(memory *m)
{
    perp_context_settings settings;

    assert_int_equal(perp_struct_init(&settings, sizeof settings), PERP_OK);
    settings.allocate = limited_allocate;
    settings.release = limited_release;
    settings.allocator_user = m;
    return settings;
}

void memory_fails_anywhere(perp_status (*work)(const perp_context_settings *settings), int least)
{
    memory m = {0, 0, 0};
    const perp_context_settings settings = memory_settings(&m);
    int calls;

    assert_int_equal(work(&settings), PERP_OK);
    assert_int_equal(m.live, 0);
    calls = m.calls;
    assert_true(calls > least);
    for (int k = 1; k <= calls; k++) {
        m.calls = 0;
        m.fails_at = k;
        assert_int_equal(work(&settings), PERP_ERROR_MEMORY);
        assert_int_equal(m.live, 0);
    }
}
