/* Checks of what callers hand over: struct sizes and arrays. Messages name argument and index. */
#ifndef PERP_BASE_CHECK_H
#define PERP_BASE_CHECK_H

#include <perp/base.h>

/* Size of struct type T in its first release: no shorter one is accepted. None has grown yet;
 * padding is spelt out, so that the last field ends the struct. */
#define PERP__FIRST(T) sizeof(T)

/* Body of every perp_x_init: zeroes `size` bytes and sets struct_size. */
perp_status perp__struct_init(void *object, size_t size, size_t first_size);

/* Copies a caller's struct over *copy, which holds the defaults, as far as the caller's struct
 * reaches. NULL leaves the defaults. Tells apart: not initialised or too small, too large, and a
 * tail this library does not know that is not zero. `context` may be NULL: then no message. */
perp_status perp__struct_read(perp_context *context, const char *name, void *copy, size_t own_size,
                              const void *caller, size_t first_size);

/* Checks an output struct before the work starts; NULL is refused. */
perp_status perp__struct_check(perp_context *context, const char *name, const void *caller,
                               size_t own_size, size_t first_size);

/* Copies *copy into the caller's struct, all but struct_size, as far as the caller's reaches. */
void perp__struct_write(void *caller, const void *copy, size_t own_size);

/* The whole T_init of a struct with defaults: PERP__INIT_WITH(T, .tol = 1e-10). */
#define PERP__INIT_WITH(T, ...)                                                     \
    perp_status T##_init(T *object, size_t size)                                    \
    {                                                                               \
        static const T defaults = {__VA_ARGS__};                                    \
        const perp_status status = perp__struct_init(object, size, PERP__FIRST(T)); \
                                                                                    \
        if (status == PERP_OK)                                                      \
            perp__struct_write(object, &defaults, sizeof defaults);                 \
        return status;                                                              \
    }

/* Defines `const char *name(int32_t code)`, the word of each of the codes 0, 1, 2, ... */
#define PERP__WORDS(name, unknown, ...)                                \
    const char *name(int32_t code)                                     \
    {                                                                  \
        static const char *const words[] = {__VA_ARGS__};              \
        const int32_t count = (int32_t)(sizeof words / sizeof *words); \
                                                                       \
        return code >= 0 && code < count ? words[code] : unknown;      \
    }

/* perp__struct_check of an output, perp__struct_read of an input into *own; messages call it by the
 * name that `caller` has here. */
#define PERP__CHECK(T, context, caller) \
    perp__struct_check(context, #caller, caller, sizeof(T), PERP__FIRST(T))
#define PERP__READ(T, context, copy, caller) \
    perp__struct_read(context, #caller, copy, sizeof(T), caller, PERP__FIRST(T))

/* A number in a struct and the interval that it has to be in. */
typedef struct perp__field {
    size_t offset;
    const char *name;
    char type;          /* 'i': int32_t, 'l': int64_t, 'd': double */
    char brackets[3];   /* "[]", "[)", "(]" or "()" */
    double least, most; /* infinite: no end; a double may be that where the bracket is closed */
} perp__field;

#define PERP__INTEGER(T, field, least, most)                                                    \
    {                                                                                           \
        offsetof(T, field), #field, sizeof(((T *)0)->field) == 4 ? 'i' : 'l', "[]", least, most \
    }
#define PERP__REAL(T, field, brackets, least, most)            \
    {                                                          \
        offsetof(T, field), #field, 'd', brackets, least, most \
    }

/* Checks `count` fields of the struct `object`, which messages call `name`: PERP_ERROR_NOT_FINITE
 * for a NaN, PERP_ERROR_ARGUMENT for what is outside. */
perp_status perp__check_fields(perp_context *context, const char *name, const void *object,
                               const perp__field *fields, size_t count);
#define PERP__CHECK_FIELDS(context, name, object, fields) \
    perp__check_fields(context, name, object, fields, sizeof fields / sizeof *fields)

/* Defines the reader of settings of type T: own := the caller's over the defaults, or these for
 * NULL, where all of `fields` are in their intervals and `agree`, an expression in context and
 * read, is PERP_OK; else own is untouched. */
#define PERP__SETTINGS_READER(name, T, fields, agree)                        \
    perp_status name(perp_context *context, T *copy, const T *settings)      \
    {                                                                        \
        T read;                                                              \
        perp_status status = T##_init(&read, sizeof read);                   \
                                                                             \
        if (status == PERP_OK)                                               \
            status = PERP__READ(T, context, &read, settings);                \
        if (status == PERP_OK)                                               \
            status = (agree);                                                \
        if (status == PERP_OK)                                               \
            status = PERP__CHECK_FIELDS(context, "settings", &read, fields); \
        if (status == PERP_OK)                                               \
            *copy = read;                                                    \
        return status;                                                       \
    }

perp_status perp__check_pointer(perp_context *context, const char *name, const void *pointer);

/* Of many arguments: no count is below 0, and where it is more there is an array; whose numbers
 * are places 0 <= place < most, int32_t, unless most < 0. */
typedef struct perp__array {
    const char *name;
    const void *array;
    int32_t count, most;
} perp__array;
perp_status perp__check_arrays(perp_context *context, const perp__array *arrays, size_t count);

/* x NULL: an argument that is optional. */
perp_status perp__check_finite(perp_context *context, const char *name, const double *x,
                               size_t count);
/* Both of a vector that is not optional; of none where count is 0. */
perp_status perp__check_vector(perp_context *context, const char *name, const double *x,
                               size_t count);
/* lower and upper may be NULL (0 and +inf). Refuses NaN, lower = +inf, upper = -inf and
 * lower > upper. */
perp_status perp__check_bounds(perp_context *context, const double *lower, const double *upper,
                               size_t count);
/* The dimensions of contacts, fields of `name`: rows that a contact may have, normals and tangents
 * together. dims may be NULL (all have `dim`), two_sided too (none holds both ways). */
perp_status perp__check_dims(perp_context *context, const char *name, int32_t contacts, int32_t dim,
                             const int32_t *dims, const int32_t *two_sided);

#endif
