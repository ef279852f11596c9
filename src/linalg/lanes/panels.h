/* Products with a thin matrix U of few columns, kept in panels of 16 rows: U(i,k) is number
 * (i / 16) * stride + k * 16 + i % 16 of an array, so that the kernels read it front to back. Rows
 * are padded to whole panels, and what lies in the padding is of no account.
 *
 * Every entry of a result is the chain of its own multiply-subtracts in the order of k. Columns are
 * brought up to date by plain ones, which round a product before they subtract it: a difference of
 * equal products is 0 then, which keeps ties of exact data ties. Whole matrices are by fused ones,
 * which are twice as fast. All kernels give the same bits. */
#ifndef PERP_LINALG_PANELS_H
#define PERP_LINALG_PANELS_H

#include <stddef.h>
#include <stdint.h>

enum { PERP__PANEL = 16, PERP__TILE = 12, PERP__STRIP = 48, PERP__GROUP = 8 };

/* Exchanges that were kept, one after the other: number k replaced entry rows[k] of a column. */
typedef struct perp__exchanges {
    const int32_t *rows;
    const double *pivots;
    const double *L; /* row k: what entry rows[k] owes to number 0 .. k-1 */
    size_t stride;   /* between the rows of L */
} perp__exchanges;

typedef struct perp__panel_kernels {
    /* For k = first .. last-1, at most PERP__GROUP: v[k-first] := y[rows[k]] - (what that owes to
     * first .. k-1) and then y[rows[k]] := v[k-first] / pivots[k]. */
    void (*eliminate)(const perp__exchanges *e, size_t first, size_t last, double *v, double *y);
    /* y := y - U v, v of `depth` entries; y is padded too. */
    void (*subtract_vector)(size_t panels, size_t depth, const double *U, size_t stride,
                            const double *v, double *y);
    /* C := C - U V for PERP__TILE columns of C; V is depth by PERP__TILE, its rows PERP__STRIP
     * apart. Makes the caches ready for the same rows of the columns PERP__STRIP further on. */
    void (*subtract_tile)(size_t panels, size_t depth, const double *U, size_t stride,
                          const double *V, double *C, size_t ldc);
    /* x := x - f V for rows of PERP__STRIP entries, quotients := x / pivot; V: depth rows. */
    void (*subtract_rows)(size_t depth, const double *f, const double *V, double pivot, double *x,
                          double *quotients);
    /* u := column / pivot, into a column of U, and into := -u. */
    void (*keep)(size_t panels, double pivot, const double *column, double *into, double *u,
                 size_t stride);
} perp__panel_kernels;

/* The kernels that this processor has, the fastest first: number 0, 1, ..., then NULL. */
const perp__panel_kernels *perp__panel_kernels_number(int32_t number);

#endif
