#define _POSIX_C_SOURCE 200112L /* getpid, pthread_sigmask */
#include "base/tasks.h"

#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <string.h>
#include <unistd.h>

/* Looks at what is to be done, a fraction of a microsecond each, before a thread that finds nothing
 * lets others have its processor. */
#define LOOKS 2000

/* And before it takes from what another one has before it. */
#define PATIENCE 20

/* A run of pieces that one thread begins with: those of the next round lie near them, in its cache.
 * What is left of it others take. A cache line each. */
typedef struct perp__portion {
    uint64_t ticket; /* its end, above the first that no one has begun */
    perp_task piece;
    void *data;
    char apart[40];
} perp__portion;

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
    /* ---- pieces, without the lock ---- */
    int32_t opened;
    perp__portion *portions; /* as many as threads */
    int32_t pieces_done;     /* by others than the caller */
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
static bool take(perp__tasks *tasks, int32_t which)
{
    const bool is_free = which < tasks->threads && !tasks->taken[which];

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

static bool make_locks(perp__tasks *tasks)
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
    perp__portion *portions = perp__allocate(context, (size_t)threads, sizeof *portions);
    sigset_t all, before;

    if (made)
        memset(made, 0, sizeof *made);
    if (!made || !workers || !taken || !portions || !make_locks(made)) {
        perp__release(context, portions);
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
    memset(portions, 0, (size_t)threads * sizeof *portions);
    made->portions = portions;
    made->owner = getpid();
    sigfillset(&all); /* the caller's threads get the signals */
    if (!run && pthread_sigmask(SIG_SETMASK, &all, &before) == 0) {
        while (made->started < threads - 1 &&
               pthread_create(&made->workers[made->started], NULL, work, made) == 0)
            made->started++;
        pthread_sigmask(SIG_SETMASK, &before, NULL);
    }
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
    perp__release(tasks->context, tasks->portions);
    perp__release(tasks->context, tasks->taken);
    perp__release(tasks->context, tasks->workers);
    perp__release(tasks->context, tasks);
}

/* As a caller runs it: once, however often it is called. */
static void run_one(int32_t which, void *object)
{
    perp__tasks *tasks = object;
    bool is_free;

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

static void wait_for_all(perp__tasks *tasks)
{
    while (tasks->left > 0)
        pthread_cond_wait(&tasks->ended, &tasks->lock);
}

/* With the lock held on the way in and out, once all of the tasks before have ended. */
static void begin(perp__tasks *tasks, perp_task task, void *data)
{
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
}

void perp__tasks_run(perp__tasks *tasks, perp_task task, void *data)
{
    pthread_mutex_lock(&tasks->lock);
    wait_for_all(tasks);
    begin(tasks, task, data);
    help(tasks);
    wait_for_all(tasks);
    pthread_mutex_unlock(&tasks->lock);
}

/* ---- pieces ---- */

/* Does pieces of a portion that no one has begun, half of them at a time: to take some is dear
 * where processors are far apart. Returns how many. Whoever has one keeps the next round from
 * beginning: what they are is read then. */
static int32_t do_portion(perp__portion *portion)
{
    uint64_t ticket = __atomic_load_n(&portion->ticket, __ATOMIC_ACQUIRE);
    int32_t done = 0;

    while ((uint32_t)ticket < ticket >> 32) {
        const uint32_t first = (uint32_t)ticket;
        const uint32_t count = ((uint32_t)(ticket >> 32) - first + 1) / 2;

        if (!__atomic_compare_exchange_n(&portion->ticket, &ticket, ticket + count, 0,
                                         __ATOMIC_ACQ_REL, __ATOMIC_ACQUIRE))
            continue;
        for (uint32_t i = first; i < first + count; i++)
            portion->piece((int32_t)i, portion->data);
        done += (int32_t)count;
        ticket = __atomic_load_n(&portion->ticket, __ATOMIC_ACQUIRE);
    }
    return done;
}

/* What is left of the other portions: to look at them keeps those who are at work there waiting. */
static int32_t do_others(perp__tasks *tasks, int32_t self)
{
    int32_t done = 0;

    for (int32_t k = self + 1; k < self + tasks->threads; k++)
        done += do_portion(&tasks->portions[k % tasks->threads]);
    return done;
}

/* Adds to what others than the caller did. */
static int32_t report(perp__tasks *tasks, int32_t done)
{
    if (done > 0)
        __atomic_add_fetch(&tasks->pieces_done, done, __ATOMIC_RELEASE);
    return done;
}

/* Returns whether it is time to take from others. */
static bool look_again(uint32_t *looks)
{
    if (++*looks > LOOKS)
        sched_yield();
#if defined(__x86_64__)
    else
        __builtin_ia32_pause();
#endif
    return *looks % PATIENCE == 0;
}

/* A thread of our own, while pieces may come. */
static void attend(int32_t which, void *object)
{
    perp__tasks *tasks = object;
    uint32_t looks = 0;

    while (__atomic_load_n(&tasks->opened, __ATOMIC_ACQUIRE))
        if (report(tasks, do_portion(&tasks->portions[which])) > 0 ||
            (look_again(&looks) && report(tasks, do_others(tasks, which)) > 0))
            looks = 0;
}

/* One of a caller's. */
static void take_part(int32_t which, void *object)
{
    perp__tasks *tasks = object;

    report(tasks, do_portion(&tasks->portions[which]) + do_others(tasks, which));
}

void perp__tasks_open(perp__tasks *tasks)
{
    if (tasks->run)
        return;
    pthread_mutex_lock(&tasks->lock);
    wait_for_all(tasks);
    __atomic_store_n(&tasks->opened, 1, __ATOMIC_RELEASE);
    begin(tasks, attend, tasks);
    pthread_mutex_unlock(&tasks->lock);
}

/* Those that look for pieces still, and have none, are waited for when tasks are run next. */
void perp__tasks_close(perp__tasks *tasks)
{
    if (tasks->run)
        return;
    __atomic_store_n(&tasks->opened, 0, __ATOMIC_RELEASE);
    pthread_mutex_lock(&tasks->lock);
    help(tasks);
    pthread_mutex_unlock(&tasks->lock);
}

void perp__tasks_pieces(perp__tasks *tasks, int32_t first, int32_t end, perp_task piece, void *data)
{
    const int32_t threads = tasks->threads;
    const uint64_t count = (uint64_t)(end - first);
    perp__portion *self = &tasks->portions[threads - 1]; /* others have the other numbers */
    int32_t left = end - first;
    uint32_t looks = 0;

    __atomic_store_n(&tasks->pieces_done, 0, __ATOMIC_RELAXED);
    for (int32_t k = 0; k < threads; k++) {
        perp__portion *portion = &tasks->portions[k];
        const uint64_t from = (uint64_t)first + count * (uint64_t)k / (uint64_t)threads;
        const uint64_t to = (uint64_t)first + count * (uint64_t)(k + 1) / (uint64_t)threads;

        portion->piece = piece;
        portion->data = data;
        __atomic_store_n(&portion->ticket, to << 32 | from, __ATOMIC_RELEASE);
    }
    if (tasks->run)
        perp__tasks_run(tasks, take_part, tasks);
    left -= do_portion(self);
    while (__atomic_load_n(&tasks->pieces_done, __ATOMIC_ACQUIRE) < left)
        if (look_again(&looks))
            left -= do_others(tasks, threads - 1);
}
