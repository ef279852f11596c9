/* Lemke's method, shared by its files: the bounded problem in standard form, the path, and what a
 * representation of the basis does for it. */
#ifndef PERP_LCP_LEMKE_H
#define PERP_LCP_LEMKE_H

#include "lcp/active_set/active_set.h"
#include "base/arena.h"
#include "linalg/basis.h"
#include "linalg/lanes/panels.h"

/* Free variables are dependent where a pivot among them, beside the largest entry, or the
 * reciprocal condition of their basis is below this. */
#define PERP__DEPENDENT 1e-12

/* Pivots this small in their column are not believed before a refactorisation; a t that is larger
 * than this, relative to its start, is no end that a polish could mend. */
#define PERP__DOUBTFUL 1e-6

/* ---- tableau.c ---- */

/* A condensed simplex tableau with delayed updates.
 *
 * Basic variables depend on the nonbasic ones as x_B = b - T x_N. Exchanging basic row r with
 * nonbasic column c changes any other column y of T alike (the product form of the inverse, Dantzig
 * & Orchard-Hays 1954): y_r becomes y_r / p and y_i becomes y_i - u_i y_r, where p = T(r,c) and
 * u = T(:,c) / p. So the last exchanges are kept as the columns u of a matrix U and applied to a
 * column when it is asked for, and to all of T together, as one matrix product, when there are too
 * many: an exchange reads and writes one column. */

typedef struct perp__tableau {
    int32_t rows, columns; /* in use */
    int32_t leading_dimension;
    int32_t delay;     /* most exchanges kept before they are applied */
    int32_t pending;   /* exchanges kept now */
    double *T;         /* leading_dimension by columns, column-major */
    double *U;         /* in panels; u_r = 0 from its exchange backwards */
    double *L;         /* delay by delay, row-major: row k is row r of U before exchange k */
    double *rewritten; /* what becomes of the rows exchanged, for some columns */
    double *V;         /* of the multiples of U for some columns */
    double *pivots;    /* p of the exchanges kept */
    int32_t *exchanged, *entered; /* r and c of the exchanges kept */
    int32_t *again;               /* the next one kept with the same row, or 0 */
    int32_t *last;                /* of a row: the last exchange kept, or -1 */
    int32_t *started;             /* of a column: exchanges kept that are in T already */
    const perp__panel_kernels *kernels;
} perp__tableau;

/* Entries of a column with its padding. */
size_t perp__tableau_length(int32_t rows);

/* Takes memory for up to `rows` by `columns`. */
void perp__tableau_layout(perp__arena *arena, perp__tableau *t, int32_t rows, int32_t columns);

/* Forgets the kept exchanges: T, as the caller fills it, is `rows` by `columns` from here on. To be
 * called again whenever a row or a column joins. */
void perp__tableau_reset(perp__tableau *t, int32_t rows, int32_t columns);

/* column := T(:,c), kept exchanges included; perp__tableau_length entries, 0 in the padding. */
void perp__tableau_column(perp__tableau *t, int32_t c, double *column);

/* y := T x, kept exchanges included; y has perp__tableau_length entries, x is destroyed. */
void perp__tableau_multiply(perp__tableau *t, double *x, double *y);

/* Exchanges row r and column c, which the caller has just read into `column`. */
void perp__tableau_exchange(perp__tableau *t, int32_t r, int32_t c, const double *column);

/* Forgets column c; the last column takes its place. */
void perp__tableau_drop(perp__tableau *t, int32_t c);

/* Applies what is kept, so that T itself is up to date. */
void perp__tableau_flush(perp__tableau *t);

/* ---- loops over the rows of the tableau. Arrays are padded to perp__tableau_length; in the
 * padding columns are 0, so that nothing there blocks ---- */

/* The basic variables and how they move: at b between low and high, -direction column for a unit of
 * the entering variable. */
typedef struct perp__lemke_rows {
    size_t length; /* padding included */
    const double *b, *low, *high, *column;
    double direction, slack;
    double smallest_pivot; /* relative to the column's largest entry; slower rows do not block */
    double noise;          /* the same for the row `always` */
    int32_t always;        /* this row blocks however slow it is, but for noise; -1: none such */
} perp__lemke_rows;

typedef struct perp__row_kernels {
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

/* ---- the method ---- */

typedef struct perp__lemke perp__lemke;

/* What a look for a better start than the cold one led to. */
enum perp__lemke_guess {
    PERP__GUESS_NONE,
    PERP__GUESS_BASIS, /* the current basis is near a solution's */
    PERP__GUESS_END    /* the iterate holds a solution, or the end that the monitor asked for */
};

/* There is nothing that new factors could change. */
enum { PERP__LEMKE_AS_NEW = PERP__FACTOR_SINGULAR + 1 };

/* What the path asks of a representation of the basis: a dense tableau, the same in doubled
 * precision, sparse factors. Operations that return a perp_status may find the basis singular:
 * PERP__FACTOR_SINGULAR. Those not needed by all may be NULL. */
typedef struct perp__lemke_basis {
    double noise; /* what rounding leaves of 0 at most, beside a column's largest; 0: not known */
    /* The standard form, with the slacks v and the free x basic; names, b, limits, largest_b. Where
     * free x depend on each other they are split. */
    perp_status (*start)(perp__lemke *l, const perp__lcp_iterate *iterate);
    /* The same at a guess of the solution's basis; *guess says whether there is one. */
    perp_status (*start_near)(perp__lemke *l, perp__lcp_iterate *iterate,
                              enum perp__lemke_guess *guess);
    /* Gives t the column that l->column holds. */
    void (*set_covering)(perp__lemke *l);
    /* l->column := that of a nonbasic variable. Where it factors anew, rows may change places. */
    perp_status (*column)(perp__lemke *l, int32_t variable);
    /* Moves b with the entering variable, by `far` where r is PERP__FLIP, else until row r has come
     * as far. Returns the step. */
    double (*move)(perp__lemke *l, int32_t r, double far);
    /* Row r, whose names are exchanged already, takes the column last asked for. Rows may change
     * places. */
    perp_status (*exchange)(perp__lemke *l, int32_t r, int32_t leaving);
    /* Factors the basis anew; rows may change places. PERP__LEMKE_AS_NEW: no need to. */
    perp_status (*refactor)(perp__lemke *l);
    /* Recomputes b from the problem's own data, without a perturbation. */
    perp_status (*values)(perp__lemke *l);
    /* Row r of the inverse, in the columns of the v of all pairs that are not free. */
    void (*inverse_row)(perp__lemke *l, int32_t r, double *row);
    /* perp__lcp_iterate's. */
    int32_t (*correct)(void *work, const double *residual, double *step);
} perp__lemke_basis;

extern const perp__lemke_basis perp__lemke_dense;
extern const perp__lemke_basis perp__lemke_doubled;
extern const perp__lemke_basis perp__lemke_sparse;

/* In doubled precision: the basis is that of the tableau at the start times E_1 E_2 ... E_count,
 * each E_k a unit matrix but for one column: high + low, the pivot apart and 0 in its place. */
typedef struct perp__doubled {
    perp__arena arena;
    int32_t count, capacity;
    int32_t *rows;                     /* of the pivots */
    double *pivot_high, *pivot_low;    /* `capacity` of them */
    double *high, *low;                /* `capacity` columns */
    double *column_low, *b_low;        /* the second halves of the method's column and b */
    double step_low;                   /* and of the last step */
    double *start_b;                   /* b where the path starts */
    int32_t *start_row, *start_column; /* of a variable in the tableau that the path starts from */
    int32_t *taken;                    /* of a reinversion: the variable whose row it is, or -1 */
    double *kept_high, *kept_low;      /* b during a reinversion */
} perp__doubled;

/* Sparse factors of the columns of v - S x - h t = q, S = sign M sign. */
typedef struct perp__factored {
    perp__basis basis;
    int32_t split;    /* free variables are */
    int32_t missing;  /* the pair of which no member is basic while t is; else -1 */
    int32_t *pair_of; /* n: pair of the caller's variable, or -1 if that is fixed */
    double *q, *h;
    int32_t *entry_rows; /* of one column */
    double *entry_values;
} perp__factored;

/* How an attempt goes about it. Sizes are relative to the largest of b, and of the column. */
typedef struct perp__lemke_trial {
    int32_t doubled;       /* in doubled precision */
    int32_t random;        /* the covering vector: random in [1, 2], else all 1 */
    int32_t patience;      /* pivots a pair */
    double perturbation;   /* added to b, random between one and two of these */
    double slack;          /* of the ratio test */
    double smallest_pivot; /* that is no rounding */
} perp__lemke_trial;

/* Pairs k = 0 .. pairs-1 of (x_k, v_k): z_i = base_i + sign_k x_k with i = index_k,
 * v_k = sign_k (M z + q)_i + d_k t, x_k in [0, range_k], v_k >= 0 at x_k = 0, v_k <= 0 at
 * x_k = range_k. Variables are named x_k = k, v_k = pairs + k, t = 2 pairs. */
struct perp__lemke {
    perp__lcp_work head;
    const perp__lemke_basis *basis;
    int32_t is_sparse; /* the problem is one for sparse factors */
    int32_t capacity;  /* most pairs: n and one more for every free variable */
    int32_t pairs;
    int32_t *index; /* caller's variable of a pair */
    int8_t *sign;
    int8_t *at_upper; /* x_k nonbasic rests (or last rested) at range_k */
    double *range;
    double *covering;               /* d_k */
    int32_t *twin;                  /* pair of -x_k where a free x_k is split, else -1 */
    int32_t *basic;                 /* variable of a row */
    int32_t *row_of;                /* row of a variable, or -1 */
    double *base;                   /* n: z where all x are 0 */
    double *row_unit, *column_unit; /* v_k and x_k are measured in 1 / row_unit_k, column_unit_k */

    /* the path: an entry a row, padding and one more */
    double *b;           /* values of the basic variables */
    double *low, *high;  /* limits of the basic variables; -inf and +inf where they have none */
    double *column;      /* of the entering variable */
    double *far, *speed; /* of the ratio test, a row each; speed 0: does not block */
    double *work;        /* n */
    const perp__row_kernels *kernels;
    int32_t entering;
    double direction;      /* +1 or -1: how the entering variable moves */
    double largest_b;      /* max |b| at the start */
    double slack;          /* of the absolute Harris ratio test, relative to largest_b */
    double smallest_pivot; /* relative to the column's largest entry */

    /* attempts */
    const perp__lemke_trial *trial;
    int32_t tried, tried_doubled;
    int32_t guessed;      /* attempt 0 was no cold start, which is then attempt 1 */
    int64_t spent;        /* rounds and pivots of this attempt before the path began */
    perp_outcome outcome; /* of the last attempt */
    int8_t *places;       /* n: a complementary basis to start from */

    /* representations of the basis */
    perp__arena tableau_arena; /* made when a tableau is first filled */
    perp__tableau tableau;
    int32_t *nonbasic;  /* variable of a column */
    int32_t *column_of; /* column of a variable, or -1 */
    int32_t *queue;
    perp__doubled doubled;
    perp__factored factored;

    perp__active_set crash;
};

/* The name of t. */
static inline int32_t perp__lemke_t(const perp__lemke *l)
{
    return 2 * l->pairs;
}

static inline int32_t perp__lemke_pair(const perp__lemke *l, int32_t variable)
{
    return variable < l->pairs ? variable : variable - l->pairs;
}

/* Whether x_k is free and stands for the whole of its variable: it never leaves the basis. */
bool perp__lemke_is_free(const perp__lemke *l, int32_t k);

/* lemke.c: every variable that is not fixed is a pair, x at 0; base. Returns whether the pairs are
 * the variables as they come, unchanged in sign. */
int32_t perp__lemke_name_pairs(perp__lemke *l);

void perp__lemke_write_pair(perp__lemke *l, int32_t k, int32_t i, int32_t sign, double range);

/* path.c. What a ratio test says where it is not a row. */
enum { PERP__NO_ROW = -1, PERP__FLIP = -2 };

/* Goes from the current complementary basis, with t's column in l->column, to the end of the path,
 * or `most` pivots far. Writes the outcome, the number of pivots, and where it is a ray
 * l->entering. PERP_OK or an error. */
perp_status perp__lemke_follow_path(perp__lemke *l, perp__lcp_iterate *iterate, int64_t most);

/* Writes low and high of every row, and the padding of arrays; a pivot keeps them up to date. */
void perp__lemke_write_limits(perp__lemke *l);

/* By how much the basic variable of row r is outside of its limits; 0 if it is not. */
double perp__lemke_violation(const perp__lemke *l, int32_t r);

/* perp__lemke_basis's move in double. */
double perp__lemke_move(perp__lemke *l, int32_t r, double far);

/* lemke.c: active sets, from the iterate's point until they have solved the problem, which is
 * *guess's END, or, with l->crash.wrong signs not more than `few`, or not to be lowered, come near:
 * BASIS, that of iterate->places. `rho`: the limits'. Rounds are counted in l->spent. */
perp_status perp__lemke_crash(perp__lemke *l, perp__lcp_iterate *iterate, int32_t few, double rho,
                              enum perp__lemke_guess *guess);

/* dense.c: rows, columns and sizes once the first basis is there. */
void perp__lemke_index(perp__lemke *l);

/* units.c: takes back a scaling of the rows, where one is found in a tableau that is -M yet. eager:
 * also where the norms of the rows do not differ much. */
void perp__lemke_choose_units(perp__lemke *l, bool eager);

/* sparse.c: memory of the factors. */
void perp__factored_layout(perp__arena *arena, perp__lemke *l);

#endif
