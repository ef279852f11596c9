/* Checks of what callers hand over: struct sizes and arrays. The message names argument and index.
 */
#ifndef PERP_BASE_CHECK_H
#define PERP_BASE_CHECK_H

#include <perp/base.h>

/* Size of struct type T up to and including `field`: the smallest size the library accepts is that
 * of the struct's first release, so `field` is the last one of that release, for ever. */
#define PERP__SIZE_THROUGH(T, field) (offsetof(T, field) + sizeof(((T *)0)->field))

/* Body of every perp_x_init: zeroes `size` bytes and sets struct_size. first_size as above. */
perp_status perp__struct_init(void *object, size_t size, size_t first_size);

/* Copies a caller's struct over `own`, which holds the defaults, as far as the caller's struct
 * reaches. NULL leaves the defaults. Tells apart: not initialised or too small, too large, and a
 * tail this library does not know that is not zero. `context` may be NULL: then no message. */
perp_status perp__struct_read(perp_context *context, const char *name, void *own, size_t own_size,
                              const void *caller, size_t first_size);

/* Checks an output struct before the work starts; NULL is refused. */
perp_status perp__struct_check(perp_context *context, const char *name, const void *caller,
                               size_t own_size, size_t first_size);

/* Copies `own` into the caller's struct, all but struct_size, as far as the caller's reaches. */
void perp__struct_write(void *caller, const void *own, size_t own_size);

perp_status perp__check_pointer(perp_context *context, const char *name, const void *pointer);
perp_status perp__check_finite(perp_context *context, const char *name, const double *x,
                               size_t count);
/* lower and upper may be NULL (0 and +inf). Refuses NaN, lower = +inf, upper = -inf and
 * lower > upper. */
perp_status perp__check_bounds(perp_context *context, const double *lower, const double *upper,
                               size_t count);

#endif
