/* What the parts of Lemke's method share: the bounded problem in standard form. */
#ifndef PERP_LCP_LEMKE_H
#define PERP_LCP_LEMKE_H

#include "lcp/active_set/block_pivoting.h"
#include "lcp/lemke/doubled.h"
#include "lcp/lemke/rows.h"
#include "lcp/lemke/tableau.h"

/* The covering vector: e; the norms of the rows; what a row needs, and 0.1; random in [1, 2]. */
enum perp__lemke_cover {
    PERP__COVER_ONES,
    PERP__COVER_NORMS,
    PERP__COVER_NEEDS,
    PERP__COVER_RANDOM
};

/* How an attempt goes about it. Sizes are relative to the largest number of b, and of the column.
 */
typedef struct perp__lemke_trial {
    int32_t doubled; /* in doubled precision */
    enum perp__lemke_cover cover;
    int32_t patience;      /* pivots a pair */
    double perturbation;   /* added to b, random between one and two of these */
    double slack;          /* of the ratio test */
    double smallest_pivot; /* that is no rounding */
} perp__lemke_trial;

/* Pairs k = 0 .. pairs-1 of (x_k, v_k): z_i = base_i + sign_k x_k with i = index_k,
 * v_k = sign_k (M z + q)_i + d_k t, x_k in [0, range_k], v_k >= 0 at x_k = 0, v_k <= 0 at
 * x_k = range_k. Variables are named x_k = k, v_k = pairs + k, t = 2 pairs. */
typedef struct perp__lemke {
    perp__lcp_work head;
    perp__tableau tableau;
    int32_t capacity; /* most pairs: n and one more for every free variable */
    int32_t pairs;
    int32_t *index; /* caller's variable of a pair */
    int8_t *sign;
    int8_t *at_upper; /* x_k nonbasic rests (or last rested) at range_k */
    double *range;
    double *cover;      /* d_k */
    int32_t *twin;      /* pair of -x_k where a free x_k is split, else -1 */
    int32_t *basic;     /* variable of a row */
    int32_t *nonbasic;  /* variable of a column */
    int32_t *row_of;    /* row of a variable, or -1 */
    int32_t *column_of; /* column of a variable, or -1 */
    double *base;       /* n: z where all x are 0 */
    double *b;          /* values of the basic variables */
    double *low, *high; /* limits of the basic variables; -inf and +inf where they have none */
    double *column;     /* of the entering variable */
    double *row;        /* n */
    double *far,
        *speed; /* of the ratio test, a row each; speed 0: does not block. far has one more */
    const perp__row_kernels *kernels;
    double largest_b;      /* max |b| at the start */
    double slack;          /* of the absolute Harris ratio test, relative to largest_b */
    double smallest_pivot; /* relative to the column's largest entry */
    double direction;      /* +1 or -1: how the entering variable moves */
    int32_t idle, near,
        most_idle;   /* steps of length 0 on end, and with t near 0; the most of them */
    double near_end; /* t that counts as near 0 */
    double *row_unit, *column_unit; /* v_k and x_k are measured in 1 / row_unit_k, column_unit_k */
    int32_t *queue;
    const perp__lemke_trial *trial;
    int32_t tried, tried_doubled;
    perp_outcome outcome;  /* of the last attempt */
    perp__doubled doubled; /* what attempts after the first need */

    perp__block_pivoting crash;  /* dense M only; its block lies in the tableau's memory */
    int32_t examined;            /* since the last set-up: what M says is known */
    int32_t positive, symmetric; /* the diagonal; M */
    int32_t crashes;             /* a crash from cold may pay */
    int8_t *places;              /* n: a complementary basis to start from */
    int64_t spent;               /* rounds and pivots of this attempt before the path began */
    int32_t guessed;             /* attempt 0 was no cold start, which is then attempt 1 */
} perp__lemke;

/* The name of t. */
static inline int32_t perp__lemke_t(const perp__lemke *l)
{
    return 2 * l->pairs;
}

/* What perp__lemke_blocking_row says where it is not a row. */
enum { PERP__NO_ROW = -1, PERP__FLIP = -2 };

/* The row whose basic variable stops the entering one, whose column is in l->column; PERP__FLIP if
 * that reaches its own other bound, own_range away, before any row blocks; PERP__NO_ROW if nothing
 * does. */
int32_t perp__lemke_blocking_row(perp__lemke *l, double own_range);

/* The limits of a basic variable; -inf and +inf where it has none. */
void perp__lemke_limits(const perp__lemke *l, int32_t variable, double *low, double *high);

/* Writes low and high of every row; a pivot keeps them up to date. */
void perp__lemke_write_limits(perp__lemke *l);

/* How far the basic variable of row r is from the limit it moves towards, and how fast it moves for
 * a unit of the entering variable. Returns 0 where it does not block: no limit, or slower than
 * `floor`. */
int32_t perp__lemke_distance(const perp__lemke *l, int32_t r, double floor, double *far,
                             double *speed);

/* Entry k of the covering vector: e in attempt 0, later random in [1, 2], the same in every run. */
double perp__lemke_cover_entry(int32_t attempt, int32_t k);

/* Later attempts differ in what they take for rounding too: contact problems of mass ratio 1e8 have
 * pivots of every size, and no one pair of tolerances tells them all from noise. */
void perp__lemke_tolerances(int32_t attempt, double *slack, double *smallest_pivot);

/* Sets l->trial, given how the last one ended, and what the iterate may say of the next. */
void perp__lemke_choose_trial(perp__lemke *l, perp__lcp_iterate *iterate, perp_outcome last);

/* d in the row of a basic v. */
double perp__lemke_trial_cover(const perp__lemke *l, const perp__lcp_iterate *iterate, int32_t r);

/* The trial's tolerances; no end to the path but its own. */
void perp__lemke_begin_path(perp__lemke *l);

/* Against wandering: the trial's perturbation, and an end to steps that lead nowhere. */
void perp__lemke_perturb(perp__lemke *l, int32_t attempt);

/* Sets all units to 1. */
void perp__lemke_reset_units(perp__lemke *l);

/* Takes back a scaling of the rows, where one is found in a tableau that is -M yet. eager: also
 * where the norms of the rows do not differ much. */
void perp__lemke_choose_units(perp__lemke *l, int32_t eager);

/* Writes the problem in standard form, makes free variables basic, splits those that cannot be. */
void perp__lemke_start(perp__lemke *l);

/* The two halves of that for any start: standard form with all x nonbasic at 0; rows, columns and
 * sizes once the first basis is there. */
void perp__lemke_fill(perp__lemke *l);
void perp__lemke_index(perp__lemke *l);
int32_t perp__lemke_is_free(const perp__lemke *l, int32_t pair);

/* Starts at the complementary basis l->places instead, with the column of t: x basic between the
 * bounds, else v. Returns 0 if that basis is singular or too nearly so; then nothing is started. */
int32_t perp__lemke_start_at(perp__lemke *l);

/* By how much the basic variable of row r is outside of its limits; 0 if it is not. */
double perp__lemke_violation(const perp__lemke *l, int32_t r);

/* The row that t must make feasible last; of rows that tie, the last, as the lexicographic order of
 * the unit matrix has it. -1: the basis solves the problem. */
int32_t perp__lemke_first_row(const perp__lemke *l);

/* perp__lcp_iterate's correct: by the last tableau, or by the block of the crash. */
int32_t perp__lemke_correct(void *work, const double *residual, double *step);
int32_t perp__lemke_correct_crash(void *work, const double *residual, double *step);

/* What a look for a better start than the cold one led to. */
enum perp__lemke_guess {
    PERP__GUESS_NONE,
    PERP__GUESS_BASIS, /* l->places is worth a try */
    PERP__GUESS_END    /* the iterate holds a solution, or the end that the monitor asked for */
};

/* Block pivoting where M looks positive definite, and the basis that a start of the caller's names.
 * Counts its rounds in l->spent. */
enum perp__lemke_guess perp__lemke_guess_basis(perp__lemke *l, perp__lcp_iterate *iterate);

#endif
