/* perp/base.h: statuses, outcomes, the context, versions.
 *
 * Rules that hold for every function of the library:
 *
 * - Argument order: the object the call acts on, outputs, inputs, then a callback followed by its
 *   `void *user`. An output that may be NULL is 'not needed'.
 * - A function that can fail returns a `perp_status`: PERP_OK (0), or a negative PERP_ERROR_*.
 * - After a negative status no output has been written, the object is as it was before the call,
 *   and perp_context_message() names the argument and the index at fault.
 * - What the mathematics said (solved, no solution, limit reached) is not an error: it is an
 *   'outcome', found in the result struct of a call that returned PERP_OK.
 * - Every struct that crosses this boundary starts with `struct_size`, and is initialised before
 *   any field is set: by its perp_..._init(&x, sizeof x), or where it has none by
 *   perp_struct_init(&x, sizeof x). Structs grow at the tail only.
 * - Handles (context, solver, world) are owned by the caller and released by their _destroy
 *   function, which accepts NULL. Arrays belong to the caller throughout.
 * - A context and everything created from it belong to one thread at a time; different contexts
 *   share nothing. After a fork the child may only destroy.
 * - The library never prints, exits, or changes the floating-point environment.
 */
#ifndef PERP_BASE_H
#define PERP_BASE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(PERP_BUILD) && defined(__GNUC__)
#define PERP_API __attribute__((visibility("default")))
#else
#define PERP_API
#endif

#if defined(__GNUC__)
#define PERP_WARN_UNUSED __attribute__((warn_unused_result))
#else
#define PERP_WARN_UNUSED
#endif

/* The version of these headers. perp_version() tells the version of the library that was loaded. */
#define PERP_VERSION_MAJOR 0
#define PERP_VERSION_MINOR 1
#define PERP_VERSION_PATCH 0
#define PERP_VERSION (PERP_VERSION_MAJOR * 10000 + PERP_VERSION_MINOR * 100 + PERP_VERSION_PATCH)

/* Number in the shared library's soname: libraries with the same number are drop-in replacements.
 */
#define PERP_ABI_VERSION 0

/* Status: did the call work? Values never change. */
#define PERP_STATUS_LIST(X)                                                        \
    X(PERP_OK, 0, "success")                                                       \
    X(PERP_ERROR_ARGUMENT, -1, "invalid argument")                                 \
    X(PERP_ERROR_NOT_FINITE, -2, "an input is NaN or infinite")                    \
    X(PERP_ERROR_MEMORY, -3, "out of memory")                                      \
    X(PERP_ERROR_ABI, -4, "struct of an incompatible version, or not initialised") \
    X(PERP_ERROR_HANDLE, -5, "not a valid handle")                                 \
    X(PERP_ERROR_BUSY, -6, "the context is inside another call")                   \
    X(PERP_ERROR_CALLBACK, -7, "a callback asked to abort")

/* Outcome: what did the mathematics say? Values never change. */
#define PERP_OUTCOME_LIST(X)                              \
    X(PERP_OUTCOME_SOLVED, 0, "solved")                   \
    X(PERP_OUTCOME_ROUNDING_LIMIT, 1, "rounding_limit")   \
    X(PERP_OUTCOME_RAY, 2, "ray")                         \
    X(PERP_OUTCOME_ITERATION_LIMIT, 3, "iteration_limit") \
    X(PERP_OUTCOME_TIME_LIMIT, 4, "time_limit")           \
    X(PERP_OUTCOME_STALLED, 5, "stalled")                 \
    X(PERP_OUTCOME_SINGULAR, 6, "singular")               \
    X(PERP_OUTCOME_STOPPED, 7, "stopped")                 \
    X(PERP_OUTCOME_EVALUATION_FAILED, 8, "evaluation_failed")

#define PERP__LIST_VALUE(name, value, text) name = value,
enum perp_status_value { PERP_STATUS_LIST(PERP__LIST_VALUE) };
enum perp_outcome_value { PERP_OUTCOME_LIST(PERP__LIST_VALUE) };
#undef PERP__LIST_VALUE

typedef int32_t perp_status;
typedef int32_t perp_outcome;

/* Returns the words of a status or an outcome; "unknown status" or "unknown outcome" otherwise.
 * The string is static and never NULL. */
PERP_API const char *perp_status_text(perp_status status);
PERP_API const char *perp_outcome_text(perp_outcome outcome);

/* Returns PERP_VERSION of the loaded library (major * 10000 + minor * 100 + patch). */
PERP_API int32_t perp_version(void);

/* Returns PERP_ABI_VERSION of the loaded library. */
PERP_API int32_t perp_abi_version(void);

/* Returns a static string such as "0.1.0 openblas klu": version, BLAS, sparse factorisations. */
PERP_API const char *perp_version_text(void);

/* Holds the allocator, the log callback and the last message. Creation is cheap (one allocation);
 * one context a thread is the usual arrangement. */
typedef struct perp_context perp_context;

/* Must return memory aligned for any object, or NULL. */
typedef void *(*perp_allocate_function)(size_t size, void *user);
typedef void (*perp_release_function)(void *pointer, void *user);

/* Receives one line of text, without a newline, valid during the call only. */
typedef void (*perp_log_function)(const char *message, void *user);

/* One task of several that keep apart, by its number. */
typedef void (*perp_task)(int32_t index, void *data);

/* A caller's way to run tasks: calls task(index, data) for each index from 0 to count - 1, in any
 * order and on any threads, one after the other also, and returns once all have returned. */
typedef void (*perp_run_tasks)(perp_task task, void *data, int32_t count, void *user);

typedef struct perp_context_settings {
    size_t struct_size;
    perp_allocate_function allocate; /* NULL: malloc. Both or neither of allocate and release. */
    perp_release_function release;   /* NULL: free */
    void *allocator_user;
    perp_log_function log; /* NULL: silent */
    void *log_user;
} perp_context_settings;

/* Begins a struct whose fields are all 0 by default, as results and problems are: zeroes it and
 * sets struct_size. Other structs have an _init of their own, which sets every field to its default
 * and refuses sizes below the struct's first release.
 *
 * Returns: PERP_OK, or PERP_ERROR_ABI if `object` is NULL or no struct is so small or large.
 * In:      size: sizeof *object as the caller compiled it. */
PERP_API perp_status perp_struct_init(void *object, size_t size);

/* Creates a context.
 *
 * Returns: PERP_OK, PERP_ERROR_ARGUMENT, PERP_ERROR_ABI or PERP_ERROR_MEMORY.
 * Out:     context: the new context; untouched after failure, and no message exists then.
 * In:      settings: NULL for the defaults. */
PERP_API perp_status perp_context_create(perp_context **context,
                                         const perp_context_settings *settings) PERP_WARN_UNUSED;

/* Releases a context. Solvers and worlds created from it stay usable until they are destroyed
 * themselves; the context's memory goes with the last of them. Nothing new is made from it, and
 * whatever is given it says PERP_ERROR_HANDLE.
 *
 * Inside a callback (allocator, log, monitor, a model's functions) the call around it needs its
 * memory: there this and the destruction of whatever was made from the context are ignored. */
PERP_API void perp_context_destroy(perp_context *context);

/* Returns the message of the last failure on this context, "" if the last call succeeded. The
 * string is valid until the next call that uses the context, its solvers or its worlds; destroying
 * one of these keeps it. */
PERP_API const char *perp_context_message(const perp_context *context);

#ifdef __cplusplus
}
#endif

#endif
