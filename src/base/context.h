/* The context: allocator, log, last message; entering and leaving a public call. */
#ifndef PERP_BASE_CONTEXT_H
#define PERP_BASE_CONTEXT_H

#include <stdbool.h>

#include <perp/base.h>

#define PERP__MESSAGE_SIZE 256

/* What `busy` tells: outside of calls, inside one, inside the end of a handle, which is no call. */
enum { PERP__IDLE, PERP__CALLED, PERP__DESTROYS };

struct perp_context {
    const void *is; /* a context: context.c; NULL once it is none */
    perp_allocate_function allocate;
    perp_release_function release;
    void *allocator_user;
    perp_log_function log;
    void *log_user;
    int32_t children; /* solvers and worlds alive: they keep the context's memory */
    int32_t destroyed, busy;
    char message[PERP__MESSAGE_SIZE];
};

/* A context without messages or children yet, in memory of the caller's. */
void perp__context_init(perp_context *context, perp_allocate_function allocate,
                        perp_release_function release, void *user);

/* Opens a public call that is given a context: refuses what is none, what was destroyed and lives
 * on only in what it made, and what is already inside a call; clears the message. Every successful
 * enter is closed by a leave, which passes `status` through. For calls that are given a handle:
 * base/handle.h. */
perp_status perp__enter(perp_context *context);
perp_status perp__leave(perp_context *context, perp_status status);
/* The same as enter for a context that is one, and may be destroyed. */
perp_status perp__open(perp_context *context);

/* A public call that pauses, so that other public functions can be called on its context: between
 * the two the context is as it is outside of calls, and not destroyed. */
typedef struct perp__pause {
    int32_t busy, destroyed;
} perp__pause;

perp__pause perp__pause_call(perp_context *context);
void perp__resume_call(perp_context *context, perp__pause pause);

/* status := what `call`, of a public function, comes to, where all went well before. */
#define PERP__ASK(status, context, call)                            \
    do {                                                            \
        const perp__pause perp__paused = perp__pause_call(context); \
        PERP__THEN(status, call);                                   \
        perp__resume_call(context, perp__paused);                   \
    } while (0)
/* The same of a function that returns nothing, whatever went before. */
#define PERP__TELL(context, call)                                   \
    do {                                                            \
        const perp__pause perp__paused = perp__pause_call(context); \
        call;                                                       \
        perp__resume_call(context, perp__paused);                   \
    } while (0)

/* What a public function returns that does no more than to open a call by `opens`, one of these or
 * of base/handle.h, to work, and to close it: what `works` comes to, or, where it may not open one,
 * the reason, which is the same when asked again. */
#define PERP__CALL(opens, context, works) \
    ((opens) == PERP_OK ? perp__leave((context), (works)) : (opens))

/* One step of many: status := what it comes to, where all went well before. */
#define PERP__THEN(status, step) ((void)((status) == PERP_OK && ((status) = (step))))

/* Writes the message (and logs it) and returns `status`; or PERP_ERROR_ARGUMENT. */
#if defined(__GNUC__)
__attribute__((format(printf, 3, 4)))
#endif
perp_status
perp__fail(perp_context *context, perp_status status, const char *format, ...);
#define perp__refuse(context, ...) perp__fail((context), PERP_ERROR_ARGUMENT, __VA_ARGS__)

/* Memory through the context's allocator. allocate gives NULL on failure or on count * size
 * overflow, without a message; release accepts NULL. */
void *perp__allocate(perp_context *context, size_t count, size_t size);
/* The same filled with 0; on failure the message says that there is none for `what`. */
void *perp__allocate_zeros(perp_context *context, size_t count, size_t size, const char *what);
void perp__release(perp_context *context, void *pointer);

/* Says that memory ran out while doing `what`; returns PERP_ERROR_MEMORY. */
perp_status perp__fail_memory(perp_context *context, const char *what);

#endif
