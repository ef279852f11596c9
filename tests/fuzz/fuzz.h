/* What the fuzz targets share: bytes become sizes, choices and hostile numbers; memory that shows
 * who wrote to it; complaints that name the violated property and abort. */
#ifndef PERP_TESTS_FUZZ_H
#define PERP_TESTS_FUZZ_H

#include <stddef.h>
#include <stdint.h>

#include "../calls.h"

/* libFuzzer's entrance, or the driver's of standalone.c. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* ---- bytes: past the end all are 0, so that a short input is a simple problem ---------------- */

typedef struct fuzz_bytes {
    const uint8_t *at, *end;
} fuzz_bytes;

uint8_t fuzz_byte(fuzz_bytes *bytes);
int32_t fuzz_pick(fuzz_bytes *bytes, int32_t count); /* 0 .. count - 1 */
int fuzz_one_in(fuzz_bytes *bytes, int32_t count);   /* false where the bytes are used up */

/* Which numbers a problem is made of. */
typedef enum fuzz_mood {
    FUZZ_INTEGERS, /* -3 .. 3 */
    FUZZ_MODERATE, /* plain ones, zeros and noise of 1e-12 in their place, near-equal values */
    FUZZ_WIDE,     /* powers of ten from 1e-20 to 1e20 */
    FUZZ_HOSTILE   /* denormals, 1e-300 .. 1e300, the largest double, and all of the above */
} fuzz_mood;

/* PERP_FUZZ_MOODS=2 in the environment leaves out all but the first two: for a look past faults of
 * hostile numbers that are known. */
fuzz_mood fuzz_mood_of(fuzz_bytes *bytes);
double fuzz_number(fuzz_bytes *bytes, fuzz_mood mood);
double fuzz_size(fuzz_bytes *bytes, fuzz_mood mood); /* |number|, not 0 */
void fuzz_numbers(fuzz_bytes *bytes, fuzz_mood mood, double *x, int32_t count);
/* A tolerance; in half of the cases the caller's default, as 0 in most other settings. */
double fuzz_tol(fuzz_bytes *bytes, double standard);

/* ---- memory: blocks of their own, so that the sanitizer sees their ends ---------------------- */

/* count * size bytes of a pattern; released by fuzz_drop. */
void *fuzz_take(int32_t count, size_t size);
double *fuzz_doubles(int32_t count);
void fuzz_drop(void);
/* Releases what was taken since fuzz_mark. */
int fuzz_mark(void);
void fuzz_drop_to(int mark);
/* Whether a block still has its pattern. */
int fuzz_untouched(const void *block);

/* A matrix: a view as a caller would hand it over, and the same numbers row by row. */
typedef struct fuzz_matrix {
    perp_matrix view;
    double *dense;
} fuzz_matrix;

/* Wraps rows by columns numbers in a storage of the bytes' choice; padding of a leading dimension
 * is NaN, which nobody may read. */
void fuzz_wrap(fuzz_bytes *bytes, fuzz_matrix *matrix, int32_t rows, int32_t columns,
               double *dense);
void fuzz_fill(fuzz_bytes *bytes, fuzz_mood mood, fuzz_matrix *matrix, int32_t rows,
               int32_t columns);
/* Symmetric and diagonally dominant by blocks of `block` rows with diagonals of very different
 * size: positive definite, and no block is ill-conditioned. */
void fuzz_fill_definite(fuzz_bytes *bytes, fuzz_mood mood, fuzz_matrix *matrix, int32_t n,
                        int32_t block);

/* ---- complaints ------------------------------------------------------------------------------ */

/* Prints 'property violated: ...' and aborts. */
#if defined(__GNUC__)
__attribute__((format(printf, 1, 2), noreturn))
#endif
void fuzz_fail(const char *format, ...);
/* Numbers that a complaint shows: name = [...] as Python reads them. Forgotten by fuzz_open. */
void fuzz_show(const char *name, const double *x, int32_t count);
void fuzz_finite(const char *what, const double *x, int32_t count);
/* A good outcome: the solver claims to have the answer. */
int fuzz_good(int32_t outcome);

/* A context whose memory runs out at an allocation of the bytes' choice (seldom, and only if
 * `failing`). fuzz_close checks that all of it was given back. */
perp_context *fuzz_open(fuzz_bytes *bytes, int failing);
void fuzz_close(perp_context *context);
/* Memory runs out at the next allocation but `count`; -1: never. */
void fuzz_fail_after(int32_t count);
/* A refusal has a message, a success has none; returns whether it was a success. */
int fuzz_status(const perp_context *context, perp_status status, const char *call);
/* The same, and after a refusal the blocks (a list that ends with NULL) are untouched. */
int fuzz_status_of(const perp_context *context, perp_status status, const char *call,
                   const void *const *outputs);

#endif
