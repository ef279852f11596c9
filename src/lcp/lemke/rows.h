/* Loops over the rows of Lemke's tableau. Arrays are padded to perp__tableau_length; in the padding
 * columns are 0, so that nothing there blocks. */
#ifndef PERP_LCP_LEMKE_ROWS_H
#define PERP_LCP_LEMKE_ROWS_H

#include <stddef.h>
#include <stdint.h>

/* The basic variables and how they move: at b between low and high, -direction column for a unit of
 * the entering variable. */
typedef struct perp__lemke_rows {
    size_t length; /* padding included */
    const double *b, *low, *high, *column;
    double direction;
    double slack;
    double smallest_pivot; /* relative to the column's largest entry; slower rows do not block */
    double noise;          /* the same for the row `always` */
    int32_t always;        /* this row blocks however slow it is, but for noise; -1: none such */
} perp__lemke_rows;

typedef struct perp__row_kernels {
    const char *name;
    /* b := b - factor column */
    void (*move)(size_t length, double factor, const double *column, double *b);
    /* How far each row is from the limit it moves towards, at least 0, and how fast it moves: 0
     * where it does not block. Returns the least (far + slack) / speed, but for rounding; +inf
     * where nothing blocks. */
    double (*reach)(const perp__lemke_rows *rows, double *far, double *speed);
    /* The row of the largest speed > 0 among those with far <= reach speed, the first of equals;
     * -1: none. */
    int32_t (*fastest)(size_t length, const double *far, const double *speed, double reach);
} perp__row_kernels;

/* The kernels that this processor has, the fastest first: number 0, 1, ..., then NULL. All give the
 * same bits. */
const perp__row_kernels *perp__row_kernels_number(int32_t number);

#endif
