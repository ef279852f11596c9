/* Extreme rays of a polyhedral cone {x : A x >= 0}, by the double description method. */
#ifndef PERP_LINALG_CONE_H
#define PERP_LINALG_CONE_H

#include <perp/base.h>

/* Most rows of A. */
#define PERP__CONE_ROWS 128

typedef struct perp__cone {
    perp_context *context;
    int32_t dimension, rows;
    double *A;       /* rows by dimension, row-major; filled by the caller, normalised here */
    double *work;    /* (rows + 3 dimension) * dimension */
    int32_t *chosen; /* 3 dimension: rows and columns of a regular block of A */
    int32_t rays, lines;
    int32_t most_rows, most_dimension; /* there is room for */
    int32_t capacity;                  /* rays of that dimension */
    double effort;                     /* comparisons made */
    double *x;       /* rays + lines by dimension: the rays, then the lines; largest entry 1 */
    double *values;  /* capacity: of a row at the rays */
    uint64_t *tight; /* capacity by 2: which rows a ray meets with 0 */
} perp__cone;

enum { PERP__CONE_TOO_LARGE = 1 };

/* All 0 but the context at first. Makes room for `rows` by `dimension`, once: PERP_OK, _MEMORY. */
perp_status perp__cone_fit(perp__cone *cone, int32_t rows, int32_t dimension);

/* Row 0 must not be zero. Finds rays and lines with {x} = {sum of rays with factors >= 0, and of
 * lines with any}. PERP_OK, PERP_ERROR_MEMORY, or PERP__CONE_TOO_LARGE where it takes seconds. */
perp_status perp__cone_enumerate(perp__cone *cone);

void perp__cone_release(perp__cone *cone);

#endif
