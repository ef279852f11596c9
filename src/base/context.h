/* The context: allocator, log, last message; entering and leaving a public call. */
#ifndef PERP_BASE_CONTEXT_H
#define PERP_BASE_CONTEXT_H

#include <perp/base.h>

#define PERP__CONTEXT_MAGIC UINT64_C(0x7065727063747874)
#define PERP__MESSAGE_SIZE 256

struct perp_context {
    uint64_t magic;
    perp_allocate_function allocate;
    perp_release_function release;
    void *allocator_user;
    perp_log_function log;
    void *log_user;
    int32_t children; /* solvers and worlds alive: they keep the context's memory */
    int32_t destroyed;
    int32_t busy;
    char message[PERP__MESSAGE_SIZE];
};

/* How the struct behind every handle begins; a destroyed one has magic 0. */
typedef struct perp__handle {
    uint64_t magic;
    perp_context *context;
} perp__handle;

/* Opens a public call that is given a context: refuses what is none, what was destroyed and lives
 * on only in what it made, and what is already inside a call; clears the message. Every successful
 * enter is closed by a leave, which passes `status` through. */
perp_status perp__enter(perp_context *context);
/* The same for a call that is given something made from a context, which may be destroyed. */
perp_status perp__enter_handle(const void *handle, uint64_t magic);
/* Whether a handle may be destroyed now, and then a call is open that perp__leave closes: not if it
 * is none, and not inside a callback, where the call around it needs its memory. Keeps the
 * message, which the caller may want to read still. */
int32_t perp__enter_to_destroy(const void *handle, uint64_t magic);
perp_status perp__leave(perp_context *context, perp_status status);

/* Writes the message (and logs it) and returns `status`. */
#if defined(__GNUC__)
__attribute__((format(printf, 3, 4)))
#endif
perp_status
perp__fail(perp_context *context, perp_status status, const char *format, ...);

/* Memory through the context's allocator. allocate gives NULL on failure or on count * size
 * overflow, without a message; release accepts NULL. */
void *perp__allocate(perp_context *context, size_t count, size_t size);
void perp__release(perp_context *context, void *pointer);

/* Says that memory ran out while doing `what`; returns PERP_ERROR_MEMORY. */
perp_status perp__fail_memory(perp_context *context, const char *what);

/* Solvers and worlds announce their birth and death. */
void perp__attach(perp_context *context);
void perp__detach(perp_context *context);

#endif
