/* One block of memory that several arrays share. A layout function takes the arrays one after the
 * other, to measure or, with a block in place, to hand out pointers; it may run up to three times.
 * All 0 at first. */
#ifndef PERP_BASE_ARENA_H
#define PERP_BASE_ARENA_H

#include <stdbool.h>

#include <perp/base.h>

typedef struct perp__arena {
    perp_context *context;
    void *block; /* as allocated, or lent */
    int32_t is_lent;
    char *base; /* aligned; NULL while measuring */
    size_t capacity, used;
} perp__arena;

typedef void (*perp__layout)(perp__arena *arena, void *object);

/* Takes `count` elements of `size` bytes, aligned to a cache line. While measuring, and beyond the
 * end of a block that is too small, the result is NULL. The memory is not cleared. */
void *perp__arena_take(perp__arena *arena, size_t count, size_t size);

/* The same for several arrays of `count` numbers: PERP__DOUBLES(arena, n, &a, &b, &c). */
#define PERP__DOUBLES(arena, count, ...) PERP__TAKE_ALL(double, arena, count, __VA_ARGS__)
#define PERP__INTEGERS(arena, count, ...) PERP__TAKE_ALL(int32_t, arena, count, __VA_ARGS__)
#define PERP__TAKE_ALL(T, arena, count, ...)                                   \
    perp__arena_take_all(arena, count, sizeof(T), (T * *const[]){__VA_ARGS__}, \
                         sizeof((T **const[]){__VA_ARGS__}) / sizeof(T **))
void perp__arena_take_all(perp__arena *arena, size_t count, size_t size, const void *places,
                          size_t many);

/* Gives an arena that is all 0 its first block, which is the caller's and outlives the arena. */
void perp__arena_lend(perp__arena *arena, perp_context *context, void *block, size_t bytes);

/* Makes room for what `layout` takes and runs it on `object`. Grows, never shrinks; what the block
 * held is lost when it grows. On failure the block is as it was, but the pointers that `layout`
 * writes into `object` are NULL: lay out a copy where the old ones matter. */
perp_status perp__arena_fit(perp__arena *arena, perp_context *context, perp__layout layout,
                            void *object);

/* The same for a layout of arrays that are no longer for smaller `sizes`: where none of these is
 * larger than in the last fit, all stays as it is. `fitted`: as many, kept by the caller, 0 at
 * first and after a release. */
perp_status perp__arena_fit_sizes(perp__arena *arena, perp_context *context, perp__layout layout,
                                  void *object, size_t *fitted, const size_t *sizes, size_t count);

/* *room := count where that is more. */
static inline void perp__raise_room(int32_t *room, int32_t count)
{
    if (*room < count)
        *room = count;
}

/* What a method works in: a struct of its own, whose first member points to its problem, and that
 * struct's arrays, laid out once for each set-up. All 0 at first. */
typedef struct perp__workspace {
    void *work;
    perp__arena arena;
    int64_t fitted; /* the set-up it was laid out for; 0: none */
} perp__workspace;

/* Makes the struct, `size` bytes, 0 at first, and its arrays for set-up number `setup`, 1 or more.
 * PERP_OK or _MEMORY. And its end, after `release`, which may be NULL, of what is not in them. */
perp_status perp__workspace_fit(perp__workspace *space, perp_context *context, size_t size,
                                perp__layout layout, const void *problem, int64_t setup);
void perp__workspace_release(perp__workspace *space, void (*release)(void *work));

void perp__arena_release(perp__arena *arena);

/* ---- arrays that grow, alone or side by side ---- */

/* One of them: where its pointer is, the bytes that are kept, and those of an entry. */
typedef struct perp__growing {
    void *pointer;
    size_t kept, entry;
} perp__growing;

/* The first `used` numbers of `array` are kept; an entry has `wide` of them. */
#define PERP__GROWING(array, used, wide)                                             \
    {                                                                                \
        &(array), (size_t)(used) * sizeof *(array), (size_t)(wide) * sizeof *(array) \
    }

/* Room for `needed` entries: *capacity is doubled until it is enough. Where there is no memory,
 * what was there is in place, the message names `what`; NULL: no message. PERP_OK or _MEMORY. */
perp_status perp__grow(perp_context *context, const char *what, int32_t *capacity, int64_t needed,
                       const perp__growing *arrays, size_t count);

#endif
