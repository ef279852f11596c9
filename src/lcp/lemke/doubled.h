/* Lemke's path in doubled precision: columns of the tableau from the product form of the inverse,
 * and the values of the basic variables, each number the sum of two doubles. */
#ifndef PERP_LCP_LEMKE_DOUBLED_H
#define PERP_LCP_LEMKE_DOUBLED_H

#include "base/arena.h"

/* The basis is E_1 E_2 ... E_count, each E_k a unit matrix but for one column: high + low, with the
 * pivot apart and 0 in its place. */
typedef struct perp__doubled {
    perp__arena arena;
    int32_t on; /* the path is followed in doubled precision */
    int32_t count, capacity;
    int32_t *rows;                     /* of the pivots */
    double *pivot_high, *pivot_low;    /* `capacity` of them */
    double *high, *low;                /* `capacity` columns */
    double *column_low, *b_low;        /* the second halves of the method's column and b */
    double *start_b;                   /* b where the path starts */
    int32_t *start_row, *start_column; /* of a variable in the tableau that the path starts from */
    int32_t *taken;                    /* of a reinversion: the variable whose row it is, or -1 */
    double *kept_high, *kept_low;      /* b during a reinversion */
} perp__doubled;

struct perp__lemke;

/* Memory for a path. PERP_OK or PERP_ERROR_MEMORY. */
perp_status perp__doubled_fit(struct perp__lemke *l);
void perp__doubled_release(struct perp__lemke *l);

/* Switches it on; the tableau as it stands, not touched from now on, is where the path starts. */
void perp__doubled_start(struct perp__lemke *l);

/* column := the tableau's column of a nonbasic variable. */
void perp__doubled_column(struct perp__lemke *l, int32_t variable);

/* How far the entering variable goes until row r blocks: far / speed with the second half. */
double perp__doubled_step(const struct perp__lemke *l, int32_t r, double far, double *low);

/* b -= direction (step + low) column. */
void perp__doubled_move(struct perp__lemke *l, double step, double low);

/* Keeps the exchange of row r with the last column, the variables' names being exchanged already.
 * Where there is no more room the basis is inverted afresh, and rows may change places. Returns 0
 * if it turns out singular. */
int32_t perp__doubled_exchange(struct perp__lemke *l, int32_t r);

/* b := the values of the basic variables where the nonbasic ones are at their limits. */
void perp__doubled_values(struct perp__lemke *l);

/* Makes t's column -1 in the rows whose variables are below their limits, +1 where they are above,
 * and 0 elsewhere. Returns how far the farthest is off; 0: none is by more than what half a
 * rounding may change. */
double perp__doubled_cover(struct perp__lemke *l);

#endif
