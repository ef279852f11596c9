#include "fuzz.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- complaints ------------------------------------------------------------------------------ */

#define MOST_SHOWN 32

static struct {
    const char *name;
    const double *x;
    int32_t count;
} shown[MOST_SHOWN];
static int shown_count;

void fuzz_show(const char *name, const double *x, int32_t count)
{
    if (shown_count < MOST_SHOWN) {
        shown[shown_count].name = name;
        shown[shown_count].x = x;
        shown[shown_count++].count = count;
    }
}

static void print_shown(void)
{
    int32_t i;
    int k;

    for (k = 0; k < shown_count; k++) {
        fprintf(stderr, "%s = [", shown[k].name);
        for (i = 0; i < shown[k].count; i++)
            fprintf(stderr, "%s%.17g", i ? ", " : "", shown[k].x[i]);
        fputs("]\n", stderr);
    }
}

void fuzz_fail(const char *format, ...)
{
    va_list arguments;

    fputs("property violated: ", stderr);
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fputc('\n', stderr);
    print_shown();
    abort();
}

void fuzz_finite(const char *what, const double *x, int32_t count)
{
    int32_t i;

    for (i = 0; i < count; i++)
        if (!isfinite(x[i]))
            fuzz_fail("a good outcome has finite outputs: %s[%d] = %g", what, i, x[i]);
}

int fuzz_good(int32_t outcome)
{
    return outcome == PERP_OUTCOME_SOLVED || outcome == PERP_OUTCOME_ROUNDING_LIMIT;
}

/* ---- bytes ----------------------------------------------------------------------------------- */

uint8_t fuzz_byte(fuzz_bytes *bytes)
{
    return bytes->at < bytes->end ? *bytes->at++ : 0;
}

int32_t fuzz_pick(fuzz_bytes *bytes, int32_t count)
{
    return fuzz_byte(bytes) % count;
}

int fuzz_one_in(fuzz_bytes *bytes, int32_t count)
{
    return fuzz_pick(bytes, count) == count - 1;
}

fuzz_mood fuzz_mood_of(fuzz_bytes *bytes)
{
    const char *moods = getenv("PERP_FUZZ_MOODS");

    return (fuzz_mood)fuzz_pick(bytes, moods ? (moods[0] - '1') % 4 + 1 : 4);
}

static double signed_by(uint8_t byte, double x)
{
    return byte & 1 ? -x : x;
}

/* In (-4, 4), from two bytes. */
static double plain(fuzz_bytes *bytes)
{
    uint8_t high = fuzz_byte(bytes);

    return (high * 256 + fuzz_byte(bytes) - 0x7fff) / 8192.1;
}

static double moderate(fuzz_bytes *bytes)
{
    static const double palette[] = {
        0.0, -0.0, 1.0, -1.0, 2.0, 0.5, -2.0, 3.0, 1e-12, -1e-12, 1e-6, 1e3, -100.0, 1.0 / 3.0,
    };
    uint8_t byte = fuzz_byte(bytes);

    if (byte < 96)
        return palette[byte % 14];
    if (byte < 112)
        return signed_by(byte, 1.0 + (byte / 2 % 4 - 2) * DBL_EPSILON);
    if (byte < 128) /* noise in the place of a zero */
        return plain(bytes) * 1e-12;
    return plain(bytes);
}

static double hostile(fuzz_bytes *bytes)
{
    static const double palette[] = {
        DBL_MAX, DBL_MIN, 0x1p-1074, 0x1p-1030, 1e300, 1e-300, 1e154,       1e-154,
        1e200,   1e-200,  1e100,     1e-100,    1e308, 1e-308, DBL_EPSILON, 1e-16,
    };
    uint8_t byte = fuzz_byte(bytes);

    if (byte < 64)
        return signed_by(byte, palette[byte / 2 % 16]);
    if (byte < 128)
        return plain(bytes) * pow(10, fuzz_byte(bytes) * 600.0 / 255 - 300);
    return moderate(bytes);
}

double fuzz_number(fuzz_bytes *bytes, fuzz_mood mood)
{
    switch (mood) {
    case FUZZ_INTEGERS:
        return (fuzz_pick(bytes, 7) + 3) % 7 - 3;
    case FUZZ_MODERATE:
        return moderate(bytes);
    case FUZZ_WIDE:
        return moderate(bytes) * pow(10, fuzz_pick(bytes, 41) - 20);
    default:
        return hostile(bytes);
    }
}

double fuzz_size(fuzz_bytes *bytes, fuzz_mood mood)
{
    double x = fabs(fuzz_number(bytes, mood));

    return x > 0 ? x : 1.0;
}

void fuzz_numbers(fuzz_bytes *bytes, fuzz_mood mood, double *x, int32_t count)
{
    int32_t i;

    for (i = 0; i < count; i++)
        x[i] = fuzz_number(bytes, mood);
}

double fuzz_tol(fuzz_bytes *bytes, double standard)
{
    static const double palette[] = {1e-6, 1e-3, 1e-12, 1e-15, 1e-1, 1e-8};
    uint8_t byte = fuzz_byte(bytes);

    return byte < 128 ? standard : palette[byte % 6];
}

/* ---- memory ---------------------------------------------------------------------------------- */

#define BLOCKS 512
#define PATTERN 0xa5

static struct {
    unsigned char *bytes;
    size_t size;
} blocks[BLOCKS];
static int block_count;

void *fuzz_take(int32_t count, size_t size)
{
    size_t bytes = (size_t)count * size;
    unsigned char *block = malloc(bytes > 0 ? bytes : 1);

    if (!block || block_count == BLOCKS)
        fuzz_fail("the target takes too much memory");
    memset(block, PATTERN, bytes);
    blocks[block_count].bytes = block;
    blocks[block_count++].size = bytes;
    return block;
}

double *fuzz_doubles(int32_t count)
{
    return fuzz_take(count, sizeof(double));
}

int fuzz_mark(void)
{
    return block_count;
}

void fuzz_drop_to(int mark)
{
    while (block_count > mark)
        free(blocks[--block_count].bytes);
}

void fuzz_drop(void)
{
    fuzz_drop_to(0);
}

int fuzz_untouched(const void *block)
{
    size_t i;
    int k;

    for (k = 0; k < block_count && blocks[k].bytes != block; k++)
        ;
    if (k == block_count)
        fuzz_fail("the target asks about a block that isn't its own");
    for (i = 0; i < blocks[k].size; i++)
        if (blocks[k].bytes[i] != PATTERN)
            return 0;
    return 1;
}

/* ---- matrices -------------------------------------------------------------------------------- */

static void wrap_sparse(fuzz_bytes *bytes, fuzz_matrix *m, int32_t rows, int32_t columns)
{
    int32_t keep_zeros = fuzz_pick(bytes, 2), i, j, count = 0;
    int32_t *starts = fuzz_take(columns + 1, sizeof *starts);
    int32_t *indices = fuzz_take(rows * columns, sizeof *indices);
    double *values = fuzz_doubles(rows * columns);

    for (j = 0; j < columns; j++) {
        starts[j] = count;
        for (i = 0; i < rows; i++)
            if (m->dense[i * columns + j] != 0 || (keep_zeros && (i + j) % 2 == 0)) {
                indices[count] = i;
                values[count++] = m->dense[i * columns + j];
            }
    }
    starts[columns] = count;
    if (perp_matrix_csc(&m->view, rows, columns, starts, indices, values) != PERP_OK)
        fuzz_fail("perp_matrix_csc takes an initialised view");
}

static void wrap_dense(fuzz_bytes *bytes, fuzz_matrix *m, int32_t rows, int32_t columns,
                       int32_t storage)
{
    int by_rows = storage == PERP_STORAGE_ROW_MAJOR;
    int32_t across = by_rows ? columns : rows, lines = by_rows ? rows : columns, i, j;
    int32_t leading = across + fuzz_pick(bytes, 2) + (across == 0);
    double *values = fuzz_doubles(leading * lines);

    for (i = 0; i < leading * lines; i++)
        values[i] = NAN;
    for (i = 0; i < rows; i++)
        for (j = 0; j < columns; j++)
            values[by_rows ? i * leading + j : i + j * leading] = m->dense[i * columns + j];
    if (perp_matrix_dense(&m->view, storage, rows, columns, values, leading) != PERP_OK)
        fuzz_fail("perp_matrix_dense takes an initialised view");
}

void fuzz_wrap(fuzz_bytes *bytes, fuzz_matrix *m, int32_t rows, int32_t columns, double *dense)
{
    int32_t storage = fuzz_pick(bytes, 3);

    m->dense = dense;
    if (perp_struct_init(&m->view, sizeof m->view) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    if (storage == PERP_STORAGE_CSC)
        wrap_sparse(bytes, m, rows, columns);
    else
        wrap_dense(bytes, m, rows, columns, storage);
}

void fuzz_fill(fuzz_bytes *bytes, fuzz_mood mood, fuzz_matrix *m, int32_t rows, int32_t columns)
{
    double *dense = fuzz_doubles(rows * columns);

    fuzz_numbers(bytes, mood, dense, rows * columns);
    fuzz_wrap(bytes, m, rows, columns, dense);
}

void fuzz_fill_definite(fuzz_bytes *bytes, fuzz_mood mood, fuzz_matrix *m, int32_t n, int32_t block)
{
    double *dense = fuzz_doubles(n * n), scale = 1.0;
    int32_t i, j;

    memset(dense, 0, (size_t)(n * n) * sizeof *dense);
    for (i = 0; i < n; i++) {
        if (i % block == 0)
            scale = mood == FUZZ_INTEGERS ? 2.0 * block : fuzz_size(bytes, mood);
        dense[i * n + i] = scale * (1.0 + fuzz_pick(bytes, 4));
        for (j = i - i % block; j < i; j++) /* at most half of either diagonal in all */
            dense[i * n + j] = dense[j * n + i] =
                scale * ((fuzz_pick(bytes, 3) - 1) / (2.0 * block));
    }
    fuzz_wrap(bytes, m, n, n, dense);
}

/* ---- contexts -------------------------------------------------------------------------------- */

static int32_t live, calls_left = -1;

static void *counted_allocate(size_t size, void *user)
{
    void *pointer;

    (void)user;
    if (calls_left == 0)
        return NULL;
    if (calls_left > 0)
        calls_left--;
    pointer = malloc(size);
    if (!pointer)
        return NULL;
    memset(pointer, PATTERN, size); /* nobody may rely on fresh memory being zero */
    live++;
    return pointer;
}

static void counted_release(void *pointer, void *user)
{
    (void)user;
    live--;
    free(pointer);
}

void fuzz_fail_after(int32_t count)
{
    calls_left = count;
}

perp_context *fuzz_open(fuzz_bytes *bytes, int failing)
{
    perp_context_settings settings;
    perp_context *context = NULL;

    live = 0;
    shown_count = 0;
    fuzz_fail_after(-1);
    if (perp_struct_init(&settings, sizeof settings) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    settings.allocate = counted_allocate;
    settings.release = counted_release;
    if (perp_context_create(&context, &settings) != PERP_OK)
        fuzz_fail("a context can be created");
    if (failing && fuzz_one_in(bytes, 16))
        fuzz_fail_after(fuzz_pick(bytes, 24));
    return context;
}

void fuzz_close(perp_context *context)
{
    fuzz_fail_after(-1);
    perp_context_destroy(context);
    shown_count = 0;
    fuzz_drop();
    if (live != 0)
        fuzz_fail("all memory is given back: %d blocks are left", live);
}

int fuzz_status(const perp_context *context, perp_status status, const char *call)
{
    const char *message = perp_context_message(context);

    if (status > 0)
        fuzz_fail("%s: a status is 0 or negative: %d", call, status);
    if (status == PERP_OK && message[0])
        fuzz_fail("%s: a success leaves no message: '%s'", call, message);
    if (status < 0 && !message[0])
        fuzz_fail("%s: a refusal (%d) has a message", call, status);
    return status == PERP_OK;
}

int fuzz_status_of(const perp_context *context, perp_status status, const char *call,
                   const void *const *outputs)
{
    if (fuzz_status(context, status, call))
        return 1;
    for (; *outputs; outputs++)
        if (!fuzz_untouched(*outputs))
            fuzz_fail("%s: a refusal (%s) leaves the outputs untouched", call,
                      perp_context_message(context));
    return 0;
}
