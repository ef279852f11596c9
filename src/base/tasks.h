/* Tasks side by side: on threads of our own that wait in between, or as a caller runs them. What
 * tasks do is theirs to keep apart; each has a context of its own, whose memory is that of one
 * context, taken by one thread at a time. */
#ifndef PERP_BASE_TASKS_H
#define PERP_BASE_TASKS_H

#include "base/context.h"

#define PERP__MOST_THREADS 256

typedef struct perp__tasks perp__tasks;

/* For up to `threads` tasks at a time, 1 or more, the caller's thread among them; `run`, or NULL.
 * Threads that the system does not give are done without. */
perp_status perp__tasks_create(perp_context *context, perp__tasks **tasks, int32_t threads,
                               perp_run_tasks run, void *user);
/* NULL is accepted; in a child of the process that created them the threads are not there. */
void perp__tasks_destroy(perp__tasks *tasks);

/* task(i, data) once for every i below `threads`. */
void perp__tasks_run(perp__tasks *tasks, perp_task task, void *data);

/* Many rounds of small pieces: between opening and closing, which is when threads of our own wait
 * for them awake, piece(i, data) once for every i from `first` to below `end`, and the round is
 * over once all have returned. Tasks are not run meanwhile. A round costs about as much as a few
 * cache misses; of a caller's `run`, a call of it. */
void perp__tasks_open(perp__tasks *tasks);
void perp__tasks_pieces(perp__tasks *tasks, int32_t first, int32_t end, perp_task piece,
                        void *data);
void perp__tasks_close(perp__tasks *tasks);

/* A context for one task; the tasks live longer. */
void perp__tasks_context(perp__tasks *tasks, perp_context *context);

#endif
