#define _POSIX_C_SOURCE 200112L /* getpid, pthread_sigmask */
#include "base/tasks.h"

#include <pthread.h>
#include <signal.h>
#include <string.h>
#include <unistd.h>

struct perp__tasks {
    perp_context *context;
    pthread_mutex_t memory; /* the context's allocator is called by one thread at a time */
    int32_t threads;
    perp_run_tasks run;
    void *user;
    pthread_t *workers; /* threads - 1 at most; NULL with a caller's `run` */
    int32_t started;
    pid_t owner;
    pthread_mutex_t lock; /* of what follows */
    pthread_cond_t begun, ended;
    perp_task task;
    void *data;
    int32_t next, left; /* the task to begin with next, and how many have not ended; by number: */
    int8_t *taken;
    int32_t stops;
};

static void *allocate(size_t size, void *user)
{
    perp__tasks *tasks = user;
    void *memory;

    pthread_mutex_lock(&tasks->memory);
    memory = tasks->context->allocate(size, tasks->context->allocator_user);
    pthread_mutex_unlock(&tasks->memory);
    return memory;
}

static void release(void *pointer, void *user)
{
    perp__tasks *tasks = user;

    pthread_mutex_lock(&tasks->memory);
    tasks->context->release(pointer, tasks->context->allocator_user);
    pthread_mutex_unlock(&tasks->memory);
}

void perp__tasks_context(perp__tasks *tasks, perp_context *context)
{
    perp__context_init(context, allocate, release, tasks);
    context->busy = PERP__CALLED;
}

/* Whether task `which` has not been taken; it is now. */
static int32_t take(perp__tasks *tasks, int32_t which)
{
    const int32_t is_free = which < tasks->threads && !tasks->taken[which];

    if (is_free)
        tasks->taken[which] = 1;
    return is_free;
}

/* Runs tasks that no one has begun, with the lock held on the way in and out. */
static void help(perp__tasks *tasks)
{
    while (tasks->next < tasks->threads) {
        const int32_t which = tasks->next++;

        if (!take(tasks, which))
            continue;
        pthread_mutex_unlock(&tasks->lock);
        tasks->task(which, tasks->data);
        pthread_mutex_lock(&tasks->lock);
        if (--tasks->left == 0)
            pthread_cond_signal(&tasks->ended);
    }
}

static void *work(void *object)
{
    perp__tasks *tasks = object;

    pthread_mutex_lock(&tasks->lock);
    while (!tasks->stops) {
        help(tasks);
        if (!tasks->stops)
            pthread_cond_wait(&tasks->begun, &tasks->lock);
    }
    pthread_mutex_unlock(&tasks->lock);
    return NULL;
}

/* The caller's threads get the signals. */
static void start_workers(perp__tasks *tasks)
{
    sigset_t all, before;

    sigfillset(&all);
    if (pthread_sigmask(SIG_SETMASK, &all, &before) != 0)
        return;
    while (tasks->started < tasks->threads - 1 &&
           pthread_create(&tasks->workers[tasks->started], NULL, work, tasks) == 0)
        tasks->started++;
    pthread_sigmask(SIG_SETMASK, &before, NULL);
}

static int32_t make_locks(perp__tasks *tasks)
{
    if (pthread_mutex_init(&tasks->memory, NULL) != 0)
        return 0;
    if (pthread_mutex_init(&tasks->lock, NULL) == 0) {
        if (pthread_cond_init(&tasks->begun, NULL) == 0) {
            if (pthread_cond_init(&tasks->ended, NULL) == 0)
                return 1;
            pthread_cond_destroy(&tasks->begun);
        }
        pthread_mutex_destroy(&tasks->lock);
    }
    pthread_mutex_destroy(&tasks->memory);
    return 0;
}

perp_status perp__tasks_create(perp_context *context, perp__tasks **tasks, int32_t threads,
                               perp_run_tasks run, void *user)
{
    perp__tasks *made = perp__allocate(context, 1, sizeof *made);
    pthread_t *workers = perp__allocate(context, (size_t)threads, sizeof *workers);
    int8_t *taken = perp__allocate(context, (size_t)threads, sizeof *taken);

    if (made)
        memset(made, 0, sizeof *made);
    if (!made || !workers || !taken || !make_locks(made)) {
        perp__release(context, taken);
        perp__release(context, workers);
        perp__release(context, made);
        return perp__fail_memory(context, "the threads");
    }
    made->context = context;
    made->threads = made->next = threads;
    made->run = run;
    made->user = user;
    made->workers = workers;
    made->taken = taken;
    made->owner = getpid();
    if (!run)
        start_workers(made);
    *tasks = made;
    return PERP_OK;
}

void perp__tasks_destroy(perp__tasks *tasks)
{
    if (!tasks)
        return;
    if (tasks->owner == getpid()) {
        pthread_mutex_lock(&tasks->lock);
        tasks->stops = 1;
        pthread_cond_broadcast(&tasks->begun);
        pthread_mutex_unlock(&tasks->lock);
        for (int32_t k = 0; k < tasks->started; k++)
            pthread_join(tasks->workers[k], NULL);
        pthread_cond_destroy(&tasks->ended);
        pthread_cond_destroy(&tasks->begun);
        pthread_mutex_destroy(&tasks->lock);
        pthread_mutex_destroy(&tasks->memory);
    }
    perp__release(tasks->context, tasks->taken);
    perp__release(tasks->context, tasks->workers);
    perp__release(tasks->context, tasks);
}

/* As a caller runs it: once, however often it is called. */
static void run_one(int32_t which, void *object)
{
    perp__tasks *tasks = object;
    int32_t is_free;

    pthread_mutex_lock(&tasks->lock);
    is_free = which >= 0 && take(tasks, which);
    pthread_mutex_unlock(&tasks->lock);
    if (!is_free)
        return;
    tasks->task(which, tasks->data);
    pthread_mutex_lock(&tasks->lock);
    if (--tasks->left == 0)
        pthread_cond_signal(&tasks->ended);
    pthread_mutex_unlock(&tasks->lock);
}

void perp__tasks_run(perp__tasks *tasks, perp_task task, void *data)
{
    pthread_mutex_lock(&tasks->lock);
    tasks->task = task;
    tasks->data = data;
    tasks->left = tasks->threads;
    memset(tasks->taken, 0, (size_t)tasks->threads);
    if (tasks->run) {
        pthread_mutex_unlock(&tasks->lock);
        tasks->run(run_one, tasks, tasks->threads, tasks->user);
        pthread_mutex_lock(&tasks->lock);
    } else {
        pthread_cond_broadcast(&tasks->begun);
    }
    tasks->next = 0; /* what a caller left out is done here */
    help(tasks);
    while (tasks->left > 0)
        pthread_cond_wait(&tasks->ended, &tasks->lock);
    pthread_mutex_unlock(&tasks->lock);
}
