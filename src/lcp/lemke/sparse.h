/* What the parts of the sparse Lemke method share: the bounded problem in standard form, with a
 * factored basis in place of a tableau. */
#ifndef PERP_LCP_LEMKE_SPARSE_H
#define PERP_LCP_LEMKE_SPARSE_H

#include "lcp/method.h"
#include "lcp/active_set/nested.h"
#include "lcp/active_set/tridiagonal.h"
#include "linalg/basis.h"

/* Pairs k = 0 .. pairs-1 of (x_k, v_k) as in lcp/lemke.h: z_i = base_i + sign_k x_k with i =
 * index_k, and the equations
 *
 *   v - S x - h t = q,   S = sign M sign,   x_k in [0, range_k].
 *
 * Variables are named x_k = k, v_k = pairs + k, t = 2 pairs. A free x_k is basic from the start and
 * its v_k never is, unless the free variables had to be split. */
typedef struct perp__sparse_lemke {
    perp__lcp_work head;
    perp__basis basis;
    perp__tridiagonal_lcp tridiagonal;
    perp__nested nested;
    int32_t pairs;
    int32_t split;    /* free variables are */
    double rho;       /* proximal term of the basis; 0 but for the crash */
    int32_t *pair_of; /* n: pair of the caller's variable, or -1 if that is fixed */
    int32_t *index;   /* caller's variable of a pair */
    int8_t *sign;
    int8_t *at_upper; /* x_k nonbasic rests (or last rested) at range_k */
    double *range;
    int32_t *twin;        /* pair of -x_k where a free x_k is split, else -1 */
    double *base;         /* n: z where all x are 0 */
    double *q, *h;        /* of the equations */
    int32_t *basic;       /* variable of a position of the basis */
    int32_t *position_of; /* of a variable, or -1 */
    double *b;            /* values of the basic variables */
    double *low, *high;   /* and their limits */
    double *column;       /* of the entering variable: B^-1 times its column */
    double *rows;         /* a right-hand side */
    int32_t *entry_rows;  /* of one column */
    double *entry_values;
    double *far, *speed;          /* of the ratio test, a position each; speed 0: does not block */
    int8_t *places, *next, *best; /* of the pairs, while the start is sought */
    double *order_a, *order_b;    /* rows of B^-1 for the lexicographic order */
    double largest_b;             /* max |b| at the start */
    double slack;                 /* of the absolute Harris ratio test, relative to largest_b */
    double smallest_pivot;        /* relative to the column's largest entry */
    double direction;             /* +1 or -1: how the entering variable moves */
    int32_t missing;              /* the pair of which no member is basic while t is; else -1 */
    int32_t guesses;              /* attempts of this solve that began at a guess */
} perp__sparse_lemke;

/* The name of t. */
static inline int32_t perp__sparse_t(const perp__sparse_lemke *l)
{
    return 2 * l->pairs;
}

/* What perp__sparse_blocking_row says where it is not a position. */
enum { PERP__SPARSE_NO_ROW = -1, PERP__SPARSE_FLIP = -2 };

/* The position whose basic variable stops the entering one; see perp__lemke_blocking_row. */
int32_t perp__sparse_blocking_row(perp__sparse_lemke *l, double own_range);

/* Distance and speed of the basic variable at position r; see perp__lemke_distance. */
int32_t perp__sparse_distance(const perp__sparse_lemke *l, int32_t r, double floor, double *far,
                              double *speed);

/* What becomes of free variables: basic from the start, or two pairs each, x >= 0 and x' >= 0 with
 * x - x' in its place (see lcp/lemke_start.c). */
enum perp__free_variables { PERP__FREE_BASIC, PERP__FREE_SPLIT };

/* Writes the problem in standard form. */
void perp__sparse_write_pairs(perp__sparse_lemke *l, int32_t free_variables);

/* Whether x_k is free, so that it never leaves the basis. */
int32_t perp__sparse_is_free(const perp__sparse_lemke *l, int32_t k);

/* Entries of a column of [I, -S]: the perp__columns of the basis. */
int32_t perp__sparse_column(const void *user, int32_t variable, int32_t *rows, double *values);

/* Adds factor times the column of any variable, t included, to `rows`. */
void perp__sparse_add_column(perp__sparse_lemke *l, int32_t variable, double factor, double *rows);

/* Writes the limits of the variable at position r. */
void perp__sparse_limit(perp__sparse_lemke *l, int32_t r);

/* Factors the columns of the variables in `basic`; see perp__basis_load. */
perp_status perp__sparse_load(perp__sparse_lemke *l);

/* Recomputes b = B^-1 (q + what rests at upper bounds), `rounds` solves with what is left over: two
 * are a step of refinement, more with rho > 0 the proximal point method. */
void perp__sparse_values(perp__sparse_lemke *l, int32_t rounds);

/* Makes the complementary basis that `places` describe the current one, factored, with its values.
 * PERP_OK, PERP__FACTOR_SINGULAR or PERP_ERROR_MEMORY. */
perp_status perp__sparse_take_places(perp__sparse_lemke *l, const int8_t *places);

/* Chooses the covering vector d for the current complementary basis B: h = B d, and `column` holds
 * B^-1 times the column of t, -d. */
void perp__sparse_cover(perp__sparse_lemke *l, int32_t attempt);

/* The position that t, with its column in `column`, must make feasible last; of those that tie, the
 * last, as the lexicographic order of the unit matrix has it. -1: the basis solves the problem. */
int32_t perp__sparse_first_row(const perp__sparse_lemke *l);

/* Factors the current basis anew, pair k at position k, t at that of the missing pair, and
 * recomputes its values. Statuses as perp__sparse_take_places. */
perp_status perp__sparse_refresh(perp__sparse_lemke *l);

/* Finds a complementary basis near the solution: from the caller's z0, by active sets, or both, as
 * the settings allow. PERP_OK with the number of basic variables beyond their limits, or with
 * iterate->outcome >= 0 where it was asked to stop; PERP__FACTOR_SINGULAR: none was found;
 * PERP_ERROR_MEMORY. */
perp_status perp__sparse_start_near(perp__sparse_lemke *l, perp__lcp_iterate *iterate,
                                    int32_t *violated);

/* The basis of the slacks and the free variables. Statuses as above. */
perp_status perp__sparse_start_cold(perp__sparse_lemke *l);

#endif
