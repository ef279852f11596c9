/* Checks of what callers hand over: struct sizes and arrays. Messages name argument and index. */
#ifndef PERP_BASE_CHECK_H
#define PERP_BASE_CHECK_H

#include <perp/base.h>

/* The structs that cross the boundary, each by the last field of its first release, for ever: no
 * shorter one is accepted. */
#define PERP__LAST_perp_body_settings angular_velocity
#define PERP__LAST_perp_body_state torque
#define PERP__LAST_perp_bristle damping
#define PERP__LAST_perp_compliant_result modes
#define PERP__LAST_perp_compliant_settings resume
#define PERP__LAST_perp_compliant_stability growth
#define PERP__LAST_perp_compliant_system one_sided
#define PERP__LAST_perp_contact_answer ray
#define PERP__LAST_perp_contact_change dG
#define PERP__LAST_perp_contact_dynamics G
#define PERP__LAST_perp_contact_laws bounded
#define PERP__LAST_perp_contact_problem q
#define PERP__LAST_perp_contact_result has_ray
#define PERP__LAST_perp_contact_run again_count
#define PERP__LAST_perp_contact_sensitivity_info condition
#define PERP__LAST_perp_contact_settings monitor_user
#define PERP__LAST_perp_contact_source bounds
#define PERP__LAST_perp_contact_step speeds
#define PERP__LAST_perp_context_settings log_user
#define PERP__LAST_perp_joint_settings friction
#define PERP__LAST_perp_joint_state friction
#define PERP__LAST_perp_lcp_enumeration seconds
#define PERP__LAST_perp_lcp_problem reserved
#define PERP__LAST_perp_lcp_proof radius
#define PERP__LAST_perp_lcp_result has_ray
#define PERP__LAST_perp_lcp_sensitivity_info condition
#define PERP__LAST_perp_lcp_settings penalty
#define PERP__LAST_perp_lcp_stack upper
#define PERP__LAST_perp_load_found rays
#define PERP__LAST_perp_load_inverse reserved
#define PERP__LAST_perp_load_settings reserved
#define PERP__LAST_perp_load_step reserved
#define PERP__LAST_perp_load_summary patterns
#define PERP__LAST_perp_load_system damping
#define PERP__LAST_perp_load_uniqueness radius
#define PERP__LAST_perp_matrix row_indices
#define PERP__LAST_perp_mechanism_check_result uncertainty
#define PERP__LAST_perp_mechanism_found rays
#define PERP__LAST_perp_mechanism_model user
#define PERP__LAST_perp_mechanism_run_result evaluations
#define PERP__LAST_perp_mechanism_settings reserved
#define PERP__LAST_perp_mechanism_start v
#define PERP__LAST_perp_mechanism_step exhaustive
#define PERP__LAST_perp_mechanism_summary patterns
#define PERP__LAST_perp_ncp_check reserved
#define PERP__LAST_perp_ncp_problem user
#define PERP__LAST_perp_ncp_result trapped
#define PERP__LAST_perp_ncp_settings monitor_user
#define PERP__LAST_perp_shape_settings density
#define PERP__LAST_perp_statics_problem load
#define PERP__LAST_perp_statics_result seconds
#define PERP__LAST_perp_statics_settings max_iterations
#define PERP__LAST_perp_step_result error
#define PERP__LAST_perp_world_contact reserved
#define PERP__LAST_perp_world_load torque
#define PERP__LAST_perp_world_settings tasks_user
#define PERP__LAST_perp_world_states angular_velocity
#define PERP__LAST_perp_world_stats rows_joint

/* Size of struct type T up to and including `field`; and that of its first release. */
#define PERP__SIZE_THROUGH(T, field) (offsetof(T, field) + sizeof(((T *)0)->field))
#define PERP__FIRST(T) PERP__FIRST_THROUGH(T, PERP__LAST_##T)
#define PERP__FIRST_THROUGH(T, field) PERP__SIZE_THROUGH(T, field)

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
