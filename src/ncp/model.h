/* A problem as the methods see it: F and its Jacobian in scaled coordinates, counted, with failures
 * told apart, and the residuals of a point.
 *
 *   z_j = z_caller_j / (D_j unit_z_j),  w_i = D_i F_i / unit_w_i,  S = the Jacobian of that
 *
 * with powers of two D = diag(2^e_i), so that S is the equilibrated D J D, and a unit for all that
 * hangs together (units.c): exact but for under- and overflow, and no part's numbers depend on
 * another's. Arrays of 2 n belong to the rows, then to the columns. Callbacks are only ever called
 * at finite points within the bounds. */
#ifndef PERP_NCP_MODEL_H
#define PERP_NCP_MODEL_H

#include <perp/ncp.h>

#include "base/arena.h"
#include "linalg/matrix.h"

/* Beside PERP_OK and the negative statuses: not defined here. */
enum { PERP__NCP_OUTSIDE = 1 };

/* Of a step of differences that leaves the domain of F: tries, and how much shorter it gets. */
#define PERP__NCP_SHRINKS 6
#define PERP__NCP_SHRINK (1.0 / 32.0)

/* How the columns of a pattern are evaluated together: those of a colour share no row. */
typedef struct perp__ncp_colours {
    int32_t known; /* the rest is of this problem's pattern */
    int32_t count;
    int32_t *of;     /* n: the colour of a column, -1 where the variable is fixed */
    int32_t *starts; /* n + 1, */
    int32_t *order;  /* n: columns by colour */
    int32_t *row_starts, *row_columns; /* the pattern by rows */
    int32_t *marks;                    /* n */
} perp__ncp_colours;

typedef struct perp__ncp_control {
    double deadline;    /* on perp__now()'s clock; 0: none */
    perp_outcome ended; /* stopped or time_limit, once that has happened; else -1 */
    int32_t method, restarts;
} perp__ncp_control;

typedef struct perp__ncp_model {
    perp_context *context;
    const perp_ncp_settings *settings;
    perp_ncp_problem problem; /* its pointers lead to copies */
    int32_t n, sparse;
    double *lower, *upper; /* caller's units */
    int32_t *pattern_starts, *pattern_rows;
    int32_t *exponents;      /* log2 of D */
    int32_t *exponents_work; /* 2 n */
    double *D, *unit;        /* unit: 2 n */
    double *z_unit, *w_unit; /* D unit, unit/D: what 1 is in the caller's units */
    int32_t *part;           /* 2 n: what hangs together by the last Jacobian */
    int32_t apart;           /* else by groups: J may fall apart by accident at one point */
    int32_t *group, groups;  /* n: what any Jacobian of this solve, or the pattern, couples */
    double *omega, *offset;  /* 2 n, n: see perp__ncp_find_omega */
    double *most;            /* 2 n: of a part */
    double *low, *high;      /* the bounds, scaled; a finite one stays finite */

    /* S, dense by columns, or CSC in the caller's pattern and the diagonal; the caller's entry k is
     * entry place[k] of that */
    double *S;
    size_t entries;
    int32_t *starts, *rows, *place, *diagonal;
    double *given; /* J as the caller wrote it, or as differences made it, in his order */
    int32_t known; /* all of that */

    double *z_caller, *w_caller; /* of the last evaluation */
    double *shifted, *w_shifted; /* differences */
    double *step, *largest;      /* differences: steps, the largest |z_i| met, */
    double *sizes, *moved;       /* taken for that of z_i; how much of an F_j its step moved */
    perp__ncp_colours colours;
    int32_t start_known; /* D_start, omega_start */
    double *z_start;     /* |z| in the caller's units at the start of the solve, */
    double *D_start;     /* D there, */
    double *omega_start; /* and omega, 2 n; 0: none */
    int32_t central;     /* differences to both sides */

    int64_t function_evaluations, jacobian_evaluations;
    perp__ncp_control control;
} perp__ncp_model;

/* Takes the arrays for problem, n, pattern_entries; the model's problem is to be copied in then. */
void perp__ncp_model_layout(perp__arena *arena, perp__ncp_model *model);

/* Copies the caller's problem into the arrays laid out for it. */
void perp__ncp_model_read(perp__ncp_model *model, const perp_ncp_problem *problem);

/* D := 1, or the equilibration of the last Jacobian, and S with it; unit := 1. */
void perp__ncp_model_unscale(perp__ncp_model *model);
void perp__ncp_model_equilibrate(perp__ncp_model *model);

/* S := D J D from the last Jacobian, whatever D is. */
void perp__ncp_scale_matrix(perp__ncp_model *model);

/* z_unit, w_unit and the bounds for D and `unit` as they are. */
void perp__ncp_model_set_units(perp__ncp_model *model);

/* The last Jacobian as the caller or differences gave it. */
perp__matrix perp__ncp_given(const perp__ncp_model *model);

/* S, by columns. */
perp__matrix perp__ncp_view(const perp__ncp_model *model);

/* w := F in scaled coordinates, z projected onto the bounds by the caller of this. PERP_OK,
 * PERP__NCP_OUTSIDE or PERP_ERROR_CALLBACK. The caller's units stay in z_caller, w_caller. */
perp_status perp__ncp_evaluate(perp__ncp_model *model, const double *z, double *w);

/* S := the Jacobian at z, where w is F; by differences without a callback's value. As above. */
perp_status perp__ncp_linearise(perp__ncp_model *model, const double *z, const double *w);

/* given := the callback's Jacobian at z_caller. Statuses as above. */
perp_status perp__ncp_ask(perp__ncp_model *model);

/* given := differences of F at z_caller, where F is w_caller. */
perp_status perp__ncp_differences(perp__ncp_model *model);

/* From now on, differences to both sides. True if that is news: differences were to one side. */
bool perp__ncp_sharpen(perp__ncp_model *model);

/* What differences take for the size of z_j. The step that really is added to z_j where this one is
 * wanted: a double's, and within the bounds; 0 if there is no room. */
double perp__ncp_size(const perp__ncp_model *model, int32_t j);
double perp__ncp_fit_step(const perp__ncp_model *model, int32_t j, double step);

/* One call of the function, counted and checked, in the caller's units. */
perp_status perp__ncp_call(perp__ncp_model *model, const double *z, double *F);

/* Calls the monitor and looks at the deadline. *outcome: -1 to go on, or what to stop with.
 * PERP_OK, or PERP_ERROR_CALLBACK. */
perp_status perp__ncp_tick(perp__ncp_model *model, perp_outcome *outcome, int64_t iterations,
                           double residual);

/* True once the time is over; the outcome is in control.ended then. */
bool perp__ncp_is_late(perp__ncp_model *model);

/* model->part := which rows and columns of S hang together. */
void perp__ncp_find_parts(perp__ncp_model *model);

/* A solve begins: groups of one, or those of the pattern. Joining also sets part := group. The last
 * Jacobian's couplings join them. */
void perp__ncp_start_groups(perp__ncp_model *model);
void perp__ncp_join_groups(perp__ncp_model *model);

/* |z_j| in scaled coordinates, or what is left of it at the start where it has vanished. */
double perp__ncp_size_left(const perp__ncp_model *model, int32_t j, double z);

/* omega := the units of the tested residual, the power of two near max(|q|, |z|) of all that hangs
 * together, |z| at least as large as what is left; 0 where all that is 0. offset := q = w - S z. */
void perp__ncp_find_omega(perp__ncp_model *model, const double *z, const double *w);

/* D and omega (with `apart`) of z, w are those of the start, if these are the first. */
void perp__ncp_mark_start(perp__ncp_model *model, const double *z, const double *w);

/* The tested residual of z, w in the caller's units, by the D and omega of the start; 0 if those
 * are not known. */
double perp__ncp_residual_at_start(const perp__ncp_model *model, const double *z, const double *w);

/* Whether those tell something of every row whose law is broken: where nothing drives z or w there
 * is no unit of it. */
bool perp__ncp_start_tells(const perp__ncp_model *model, const double *z, const double *w);

/* max |mid(z - l, z - u, w)| in scaled units over omega; NaN stays. */
double perp__ncp_tested(const perp__ncp_model *model, const double *z, const double *w);

#endif
