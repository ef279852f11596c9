#include "base/check.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/context.h"

/* No struct of ours will ever be larger: a greater size is an uninitialised field. */
#define PERP__LARGEST_STRUCT 4096

perp_status perp__struct_init(void *object, size_t size, size_t first_size)
{
    if (!object || size < first_size || size > PERP__LARGEST_STRUCT)
        return PERP_ERROR_ABI;
    memset(object, 0, size);
    memcpy(object, &size, sizeof size);
    return PERP_OK;
}

perp_status perp__struct_check(perp_context *context, const char *name, const void *caller,
                               size_t own_size, size_t first_size)
{
    const unsigned char *bytes = caller;
    size_t size;

    if (!caller)
        return perp__refuse(context, "%s is NULL", name);
    memcpy(&size, caller, sizeof size);
    if (size < first_size)
        return perp__fail(context, PERP_ERROR_ABI,
                          "%s.struct_size is %zu, at least %zu expected: initialise it first", name,
                          size, first_size);
    if (size > PERP__LARGEST_STRUCT)
        return perp__fail(context, PERP_ERROR_ABI,
                          "%s.struct_size is %zu, which no version has: initialise it first", name,
                          size);
    for (size_t i = own_size; i < size; i++)
        if (bytes[i] != 0)
            return perp__fail(context, PERP_ERROR_ABI,
                              "%s uses a field at byte %zu that this library (%s) does not know",
                              name, i, perp_version_text());
    return PERP_OK;
}

perp_status perp__struct_read(perp_context *context, const char *name, void *copy, size_t own_size,
                              const void *caller, size_t first_size)
{
    perp_status status;
    size_t size;

    if (!caller)
        return PERP_OK;
    status = perp__struct_check(context, name, caller, own_size, first_size);
    if (status != PERP_OK)
        return status;
    memcpy(&size, caller, sizeof size);
    memcpy(copy, caller, size < own_size ? size : own_size);
    return PERP_OK;
}

void perp__struct_write(void *caller, const void *copy, size_t own_size)
{
    size_t size;

    memcpy(&size, caller, sizeof size);
    if (size > own_size)
        size = own_size;
    memcpy((char *)caller + sizeof size, (const char *)copy + sizeof size, size - sizeof size);
}

/* What a field has to be, in words. */
static void describe(const perp__field *field, char *text, size_t size)
{
    const int whole = field->type != 'd';

    if (whole && field->least == 0.0 && field->most == 1.0)
        snprintf(text, size, "0 or 1");
    else if (isinf(field->most))
        snprintf(text, size, field->brackets[0] == '[' ? "at least %.15g" : "a number above %.15g",
                 field->least);
    else if (field->least == field->most)
        snprintf(text, size, "%.15g", field->least);
    else if (whole)
        snprintf(text, size, "%.15g to %.15g", field->least, field->most);
    else
        snprintf(text, size, "a number in %c%.15g, %.15g%c", field->brackets[0], field->least,
                 field->most, field->brackets[1]);
}

perp_status perp__check_fields(perp_context *context, const char *name, const void *object,
                               const perp__field *fields, size_t count)
{
    char expected[80];

    for (size_t k = 0; k < count; k++) {
        const perp__field *field = &fields[k];
        const char *at = (const char *)object + field->offset;
        int32_t integer;
        int64_t number;
        double value;

        /* 1. Its value. */
        if (field->type == 'i') {
            memcpy(&integer, at, sizeof integer);
            value = integer;
        } else if (field->type == 'l') {
            memcpy(&number, at, sizeof number);
            value = (double)number;
        } else {
            memcpy(&value, at, sizeof value);
        }
        /* 2. Whether it is within the brackets. */
        if (isnan(value))
            return perp__fail(context, PERP_ERROR_NOT_FINITE, "%s.%s is nan", name, field->name);
        if ((value > field->least || (value == field->least && field->brackets[0] == '[')) &&
            (value < field->most || (value == field->most && field->brackets[1] == ']')))
            continue;
        describe(field, expected, sizeof expected);
        return perp__refuse(context, "%s.%s is %.15g, expected %s", name, field->name, value,
                            expected);
    }
    return PERP_OK;
}

perp_status perp__check_pointer(perp_context *context, const char *name, const void *pointer)
{
    if (pointer)
        return PERP_OK;
    return perp__refuse(context, "%s is NULL", name);
}

perp_status perp__check_arrays(perp_context *context, const perp__array *arrays, size_t count)
{
    for (size_t k = 0; k < count; k++) {
        if (arrays[k].count < 0)
            return perp__refuse(context, "%s has a count below 0", arrays[k].name);
        if (arrays[k].count > 0 && !arrays[k].array)
            return perp__check_pointer(context, arrays[k].name, NULL);
    }
    for (size_t k = 0; k < count; k++) {
        const int32_t *places = arrays[k].array, most = arrays[k].most;
        uint32_t outside = 0;

        /* as unsigned numbers the negative are the largest: one test without a branch */
        for (int32_t i = 0; most >= 0 && i < arrays[k].count; i++)
            outside |= (uint32_t)places[i] >= (uint32_t)most;
        for (int32_t i = 0; outside && i < arrays[k].count; i++)
            if (places[i] < 0 || places[i] >= most)
                return perp__refuse(context, "%s[%d] is %d, expected 0 to %d", arrays[k].name,
                                    (int)i, (int)places[i], (int)most - 1);
    }
    return PERP_OK;
}

perp_status perp__check_finite(perp_context *context, const char *name, const double *x,
                               size_t count)
{
    for (size_t i = 0; x && i < count; i++)
        if (!isfinite(x[i]))
            return perp__fail(context, PERP_ERROR_NOT_FINITE, "%s[%zu] is %g", name, i, x[i]);
    return PERP_OK;
}

perp_status perp__check_vector(perp_context *context, const char *name, const double *x,
                               size_t count)
{
    const perp_status status = count > 0 ? perp__check_pointer(context, name, x) : PERP_OK;

    return status == PERP_OK ? perp__check_finite(context, name, x, count) : status;
}

perp_status perp__check_bounds(perp_context *context, const double *lower, const double *upper,
                               size_t count)
{
    for (size_t i = 0; i < count && (lower || upper); i++) {
        double l = lower ? lower[i] : 0.0;
        double u = upper ? upper[i] : INFINITY;

        if (isnan(l) || l == INFINITY)
            return perp__fail(context, PERP_ERROR_NOT_FINITE, "lower[%zu] is %g", i, l);
        if (isnan(u) || u == -INFINITY)
            return perp__fail(context, PERP_ERROR_NOT_FINITE, "upper[%zu] is %g", i, u);
        if (l > u)
            return perp__refuse(context, "lower[%zu] = %g > upper[%zu] = %g", i, l, i, u);
    }
    return PERP_OK;
}

perp_status perp__check_dims(perp_context *context, const char *name, int32_t contacts, int32_t dim,
                             const int32_t *dims, const int32_t *two_sided)
{
    for (int32_t k = 0; k < contacts; k++) {
        const int32_t both = two_sided ? two_sided[k] : 0, rows = dims ? dims[k] : dim;

        if (both < 0 || both > 3)
            return perp__refuse(context, "%s.two_sided[%d] is %d, expected 0, 1, 2 or 3", name,
                                (int)k, (int)both);
        if (both > 0 && (rows < both + 1 || rows > both + 2))
            return perp__refuse(context,
                                "%s.dims[%d] is %d, expected %d or %d: %d normals that hold both "
                                "ways and 1 or 2 tangents",
                                name, (int)k, (int)rows, (int)both + 1, (int)both + 2, (int)both);
        if (both == 0 && (rows < 1 || rows > 3))
            return perp__refuse(context, "%s.dims[%d] is %d, expected 1, 2 or 3", name, (int)k,
                                (int)rows);
    }
    return PERP_OK;
}
