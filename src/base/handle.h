/* One life for all that is made from a context: create, enter, end, destroy. The struct behind a
 * handle begins with PERP__HANDLE, and its layer says by a perp__kind what it is. What lives keeps
 * its context's memory; what is dead is of no kind, and every use of it is PERP_ERROR_HANDLE. */
#ifndef PERP_BASE_HANDLE_H
#define PERP_BASE_HANDLE_H

#include "base/context.h"

typedef struct perp__kind {
    const char *name; /* in messages, with its article */
    size_t size;
    void (*release)(void *object); /* what it holds, which may be all 0 still; not the struct */
} perp__kind;

#define PERP__HANDLE        \
    const perp__kind *kind; \
    perp_context *context

/* Makes a struct that is 0 but for its head, in a context that is entered. NULL: there is no
 * memory, and the message says so. */
void *perp__handle_create(perp_context *context, const perp__kind *kind);

/* The end of what is not in a caller's hands, in a context that is entered. NULL is accepted. */
void perp__handle_end(void *handle);

/* How a create ends: *place := what was made, or, where something failed, the end of it. */
#define PERP__HAND_OUT(status, made, place) \
    ((status) == PERP_OK ? (void)(*(place) = (made)) : perp__handle_end(made))

/* Opens a public call: PERP_ERROR_HANDLE for what is not of this kind (of a stranger no more than a
 * pointer is read), PERP_ERROR_BUSY inside another call. perp__leave closes it. */
perp_status perp__handle_enter(const void *handle, const perp__kind *kind);

/* A public function that does no more with a handle of this kind than `works` (PERP__CALL). */
#define PERP__HANDLE_CALL(handle, kind, works) \
    PERP__CALL(perp__handle_enter((handle), (kind)), (handle)->context, works)

/* The body of a public destroy. Ignored are what is not of this kind, and a destroy inside a
 * callback, where the call around it needs the memory. Keeps the message: a caller may clean up
 * first and tell afterwards. */
void perp__handle_destroy(void *handle, const perp__kind *kind);

bool perp__handle_is(const void *handle, const perp__kind *kind);

#endif
