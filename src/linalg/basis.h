/* A sparse basis matrix B, factored once and then updated column by column.
 *
 * Columns with a single entry (the slacks) are set aside with their rows; what is left, the kernel,
 * is factored:   B = [D  R; 0  K]   with D diagonal. Where the caller knows K for a principal block
 * of a sparse matrix, that is factored in the cheapest way (linalg/sparse_block.h), else K by KLU.
 * Replaced columns follow in product form (Dantzig & Orchard-Hays 1954): B_k = B E_1 ... E_k, where
 * E_j is the identity but for one column, the spike. A file of fixed size holds the spikes; when it
 * is full, B is loaded anew.
 *
 * Rows are numbered by equations, columns by positions 0 .. n-1 of the basis. */
#ifndef PERP_LINALG_BASIS_H
#define PERP_LINALG_BASIS_H

#include "base/arena.h"
#include "linalg/sparse_block.h"

/* Where columns come from. */
typedef struct perp__columns {
    const void *user;
    /* Writes the entries of a column, rows ascending, no row twice; returns how many. */
    int32_t (*read)(const void *user, int32_t column, int32_t *rows, double *values);
} perp__columns;

/* K = -Sigma (S_AA + rho I) Sigma where every position of the kernel has its row in it too:
 * position p stands for row and column index[p] of S, ascending, and Sigma_pp = sign[p]. */
typedef struct perp__principal {
    perp__sparse_block *block;
    const int32_t *index;
    const int8_t *sign;
    double rho; /* 0 but for bases that need be no more than near */
} perp__principal;

/* All zero at first. */
typedef struct perp__basis {
    int32_t capacity, n;
    perp__factor *factor;      /* of the kernel; NULL before the first load */
    perp__principal principal; /* block NULL: the kernel is in `factor` */
    double *wide;              /* order of S */
    int32_t *active;           /* A */
    int32_t factor_order;      /* largest kernel it can take */
    int32_t kernel;            /* order of the kernel */
    int32_t *position_of;      /* of a kernel column */
    int32_t *kernel_row;       /* of a row, or -1 - p where position p has that single entry */
    int32_t *single_row;       /* of a position, or -1 */
    double *single;            /* the entry itself */
    int32_t *starts, *rows;
    double *values; /* the kernel, CSC */
    int32_t *outer_starts, *outer_positions;
    double *outer_values; /* R: entries of kernel columns in rows of single entries */
    double *part;         /* right-hand side of the kernel */
    double *work;         /* 2 n, of the condition */
    int32_t spikes, most_spikes;
    size_t file_entries; /* room in the file */
    size_t *spike_starts;
    int32_t *spike_position;
    double *spike_pivot;
    int32_t *spike_rows;
    double *spike_values;
} perp__basis;

/* Takes the arrays for n columns with at most `entries` entries in those that have several, and for
 * a file of most_spikes spikes with file_entries entries in all. */
void perp__basis_layout(perp__arena *arena, perp__basis *basis, int32_t n, size_t entries,
                        int32_t most_spikes, size_t file_entries);

/* Factors the first n columns; n no more than in the layout; principal may be NULL, and the order
 * of its S is no more than that either. PERP_OK, PERP__FACTOR_SINGULAR or PERP_ERROR_MEMORY. Asks
 * the context for memory only the first time, or for a larger layout. */
perp_status perp__basis_load(perp__basis *basis, perp_context *context, int32_t n,
                             const int32_t *columns, const perp__columns *source,
                             const perp__principal *principal);

/* x := B^-1 a; a in rows, x in positions. They may not overlap. */
void perp__basis_solve(perp__basis *basis, const double *a, double *x);

/* y := B^-T e; e in positions, destroyed; y in rows. */
void perp__basis_solve_transposed(perp__basis *basis, double *e, double *y);

/* Whether the file has room for any spike. An empty one has. */
bool perp__basis_has_room(const perp__basis *basis);

/* Puts a column into position r; spike = B^-1 column, spike[r] != 0. There must be room. */
void perp__basis_replace(perp__basis *basis, int32_t r, const double *spike);

/* Estimate of the reciprocal condition of the kernel as loaded. */
double perp__basis_condition(perp__basis *basis);

void perp__basis_release(perp__basis *basis);

#endif
