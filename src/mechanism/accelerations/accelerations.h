/* All accelerations of a state: what the files of the enumeration share.
 *
 * The rows that take part ("active"): those of the closed contacts, then the bilateral ones, then
 * those of dry friction. Their accelerations are u' = W f + beta, with W = J M^-1 J' and
 * beta = J M^-1 k + d/dt(J) v + d/dt(drift). A unit is a closed contact or a dry group; a pattern
 * says for each of them what it does, and is a linear system. */
#ifndef PERP_MECHANISM_ACCELERATIONS_H
#define PERP_MECHANISM_ACCELERATIONS_H

#include "linalg/cone.h"
#include "linalg/pivoting.h"
#include "mechanism/mechanism.h"

/* Relative size that counts as nothing: of forces and accelerations. */
#define PERP__FOUND_TOLERANCE 1e-12
/* A pivot below this, beside the largest entry of an equilibrated system, is 0. */
#define PERP__FOUND_SINGULAR (4.0 * PERP__FOUND_TOLERANCE)
/* Of gaps and velocities, beside the terms of their sums. */
#define PERP__CLOSED_TOLERANCE 1e-12
/* The same of a family's points, which the double description method gives to 1e-9 or so. */
#define PERP__FAMILY_TOLERANCE 1e-8
#define PERP__MOST_CONTACTS 12
#define PERP__MOST_ANGLES 4

typedef struct perp__unit {
    int32_t source; /* contact, or contacts + dry group */
    int32_t dry;
    int32_t row;      /* first active row: the normal, or the first row of the group */
    int32_t tangents; /* 0, 1 or 2 */
    int32_t friction; /* 1: there can be a force along the tangents */
    int32_t moves;    /* 1: it slides now */
    double way[2];    /* along which, a unit vector */
    double mu, mu_stick, bound;
} perp__unit;

/* What the units do. way: of slip, two numbers a unit; 0 without friction. */
typedef struct perp__found_pattern {
    int8_t *mode;
    double *way;
} perp__found_pattern;

/* An answer; a point is a family with one vertex. Points are in all rows of the mechanism. */
typedef struct perp__found_answer {
    struct perp__found_answer *next;
    perp__found_pattern pattern;
    double *acceleration, *force, *row_acceleration, *eigenvalues, *points;
    double *width; /* of the force */
    int32_t *modes;
    double residual;
    int32_t room; /* points */
    int32_t stable, flutter, at_vertex, dimension, free, vertices, rays, eigenvalue_count, pressing;
} perp__found_answer;

struct perp__acceleration {
    perp__arena arena;
    perp__arena blocks; /* matrices of the rows that take part */
    perp_mechanism *m;
    perp__cone cone;
    int32_t asked; /* there are answers, or it is known that there are none */
    int32_t units, closed, active, bilateral_row;
    perp__unit *unit;
    int32_t *row_of;     /* active: row of the mechanism */
    int32_t *indices;    /* 3 rows, of work */
    double *bias, *size; /* rows: d/dt(J) v + d/dt(drift), and how large its error may be */
    double *W, *held;    /* active by active; held: where the bilateral rows hold */
    double *beta, *load; /* active; load: the size of beta's terms */
    double *scale;       /* active: a power of 2 near 1 / sqrt(W_ii) */
    perp__found_pattern pattern;
    /* patterns with a determinant of 0, and below 0: whether there is one, and its first contact */
    int32_t has_singular, singular_unit, has_negative, negative_unit;
    /* the linear system of a pattern */
    perp__pivoting system;
    int32_t *first, *count; /* columns: active rows from `first` on have the coefficients */
    double *coefficient;    /* 3 a column */
    double *x, *x_width, *rhs, *rhs_load;
    double *known;             /* active: forces that the pattern gives */
    double *f, *u;             /* active: of the particular solution */
    double *f_width, *u_width; /* what counts as 0 there */
    double *null;              /* active by active: rows are directions of f */
    perp__pivoting turning;    /* of the angles of slips */
    double *turn_work;         /* 3 rows */
    double *work;              /* 4 active^2 + 8 active + 4 n */
    double *row_work;          /* 32 rows, of differences */
    double *velocity;          /* n: M^-1 k */
    double *angle;             /* units: of the polygons of their discs */
    double *zeros;             /* rows */
    struct {
        double *momentum, *friction, *dry; /* n, contacts, dry */
        int8_t *included;                  /* contacts */
    } seed;                                /* a problem of its own: a step may be asking */
    int32_t impossible;                    /* 1: an inequality of a family never holds */
    int32_t complete;                      /* 1: every pattern was looked at */
    int32_t incomplete;                    /* 1: a family was too large to be listed */
    perp__found_answer *answers, *spare;
    int32_t answer_count;
    int64_t patterns;
};

/* ---- accelerations_bias.c ---- */
perp_status perp__found_bias(perp__acceleration *a, double t, const double *q, const double *v);

/* ---- accelerations_state.c ---- */
/* The units, W and beta at (t, q, v); *impact: a closed contact that approaches, or -1. */
perp_status perp__found_state(perp__acceleration *a, int32_t *impact, double t, const double *q,
                              const double *v);

/* W, beta and their sizes, from M, k and J in m->begin and from bias and size; and `held`. PERP_OK
 * or _MEMORY. */
perp_status perp__found_reduce(perp__acceleration *a);

/* ---- accelerations.c ---- */
/* Room for the matrices of the active rows; what they held is lost. */
perp_status perp__found_make_room(perp__acceleration *a);
/* m->found_work with its room, and without answers. */
perp_status perp__found_open(perp_mechanism *m);
/* Finds, labels, sorts and counts answers; impact: a contact that approaches, so that there are
 * none, or -1. */
perp_status perp__found_look(perp__acceleration *a, perp_mechanism_summary *summary,
                             int32_t impact);

/* ---- accelerations_pattern.c ---- */
int32_t perp__found_choices(const perp__acceleration *a, const perp__unit *unit);
void perp__found_choose(perp__acceleration *a, int32_t unit, int32_t choice);
/* Whether the unit starts to slip in the pattern, and so has to slip the way of its force. */
int32_t perp__found_starts(const perp__unit *unit, int32_t mode);
int32_t perp__found_presses(const perp__unit *unit, int32_t mode);
/* Solves: 0, or the dimension of the null space (then `null` is filled), or -1: no solution. */
int32_t perp__found_solve(perp__acceleration *a);
/* The same without widths and null space, with pivots of at most `singular` of the largest entry,
 * and those beyond `most`, as 0. */
void perp__found_solve_roughly(perp__acceleration *a, double singular, int32_t most);
/* Makes f meet the equations of the pattern that was solved last. */
void perp__found_correct(perp__acceleration *a);
/* f := f + the forces of the unknowns x of the system. */
void perp__found_add_forces(const perp__acceleration *a, double *f, const double *x);
/* u := W f + beta (or W f alone) and, where width is not NULL, the size of its terms. */
void perp__found_row_accelerations(const perp__acceleration *a, double *u, double *size,
                                   const double *f, int32_t homogeneous);

/* ---- accelerations_turn.c ---- */
/* Slips of the pattern that start in a plane. */
int32_t perp__found_turning(const perp__acceleration *a);
int32_t perp__found_turns(const perp__acceleration *a, int32_t unit);
/* Turns them until friction is opposite to the acceleration; as perp__found_solve, or -1. */
int32_t perp__found_turn(perp__acceleration *a, double singular);

/* ---- accelerations_angle.c ---- */
/* All directions of the only slip of the pattern that starts in a plane, up to
 * PERP__MOST_ANGLES; -1 where the pattern is singular. */
int32_t perp__found_angles(perp__acceleration *a, double *angles);

/* ---- accelerations_keep.c ---- */
/* Whether forces f with row accelerations u do what the pattern says. `strict`: of a slip that
 * starts, more than 0. */
int32_t perp__found_keeps(const perp__acceleration *a, const perp__found_pattern *pattern,
                          const double *f, const double *u, const double *f_width,
                          const double *u_width, int32_t homogeneous, int32_t strict,
                          int32_t *at_vertex);
/* The point f; dimension: of the family that stands for, or 0. */
perp_status perp__found_keep_point(perp__acceleration *a, int32_t at_vertex, int32_t dimension);
/* The new answer with its points is described and joins the list, or goes where another one has it
 * already, or where its residuals say that it is none. */
void perp__found_keep(perp__acceleration *a, perp__found_answer *answer);
perp__found_answer *perp__found_create(perp__acceleration *a, int32_t points);
void perp__found_release_answer(perp__acceleration *a, perp__found_answer *answer);
void perp__found_release_answers(perp__acceleration *a);
/* Fewer contacts that press first. */
void perp__found_sort(perp__acceleration *a);

/* ---- accelerations_describe.c ---- */
/* Accelerations, modes, residual and label of an answer whose force is known. */
void perp__found_describe(perp__acceleration *a, perp__found_answer *answer);

/* ---- accelerations_family.c ---- */
perp_status perp__found_keep_family(perp__acceleration *a, int32_t dimension);

/* ---- accelerations_points.c ---- */
/* The polyhedron of the cone, in `null` directions, as an answer without a description; NULL where
 * it is empty. PERP_OK or _MEMORY. */
perp_status perp__found_polyhedron(perp__acceleration *a, int32_t dimension,
                                   perp__found_answer **made);
/* The rank of the points' differences, as forces or as accelerations. */
int32_t perp__found_rank(perp__acceleration *a, const perp__found_answer *answer,
                         int32_t accelerations);
/* Whether the middle does what the pattern says; *at_vertex: at a limit, and so is the family. */
int32_t perp__found_is_kept(perp__acceleration *a, const perp__found_answer *answer,
                            int32_t *at_vertex);

/* ---- accelerations_label.c ---- */
void perp__found_label(perp__acceleration *a, perp__found_answer *answer);

/* ---- accelerations_reason.c ---- */
void perp__found_hold_bilateral(perp__acceleration *a);
/* Remembers the sign of the determinant of the pattern that was solved last. */
void perp__found_note_sign(perp__acceleration *a);
void perp__found_reason(const perp__acceleration *a, perp_mechanism_summary *summary);

/* ---- accelerations_search.c ---- */
/* Answers where there are too many patterns, or too large a family: Lemke's method. */
perp_status perp__found_search(perp__acceleration *a, perp_mechanism_summary *summary);

/* ---- accelerations_seed.c ---- */
/* Tries the pattern of one solution that the contact solver gives, where nothing slides yet and
 * slips start in a plane: contacts that share a load, whose directions Newton's method does not
 * find from anywhere. */
perp_status perp__found_seed(perp__acceleration *a);

/* ---- accelerations_all.c ---- */
/* Solves the pattern and keeps what holds. singular: of perp__found_turn. */
perp_status perp__found_try(perp__acceleration *a, double singular);
/* All patterns, or what a search finds; writes exhaustive and patterns. */
perp_status perp__found_all(perp__acceleration *a, perp_mechanism_summary *summary);

#endif
