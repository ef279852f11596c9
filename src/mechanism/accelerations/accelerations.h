/* All accelerations of a state: what the files of the enumeration share.
 *
 * The rows that take part ("active"): those of the closed contacts, then the bilateral ones, then
 * those of dry friction. Their accelerations are u' = W f + beta, with W = J M^-1 J' and
 * beta = J M^-1 k + d/dt(J) v + d/dt(drift). An element is a closed contact or a dry group; a
 * pattern says for each of them what it does, and is a linear system. */
#ifndef PERP_MECHANISM_ACCELERATIONS_H
#define PERP_MECHANISM_ACCELERATIONS_H

#include "base/clock.h"
#include "linalg/spatial.h"
#include "mechanism/mechanism.h"
#include "mechanism/linear.h"

/* A pivot below this, beside the largest entry of an equilibrated system, is 0. */
#define PERP__ACCELERATION_SINGULAR (PERP__SINGULAR * PERP__NOTHING)
/* Pivots from directions that an iteration gives: of a double solution half of the digits. */
#define PERP__ROUGH_DIRECTIONS sqrt(PERP__NOTHING)
#define PERP__MOST_CONTACTS 12

typedef struct perp__element {
    int32_t source; /* contact, or contacts + dry group */
    int32_t dry;
    int32_t two_sided;   /* 1: its normals hold both ways */
    int32_t row;         /* first active row: the normal, or the first row of the group */
    int32_t normals;     /* 0 of a dry group, 1 of an ordinary contact */
    int32_t tangent;     /* first active row along the tangents */
    int32_t tangents;    /* 0, 1 or 2 */
    int32_t friction;    /* 1: there can be a force along the tangents */
    int32_t moves;       /* 1: it slides now */
    double direction[2]; /* along which, a unit vector */
    double mu, mu_stick, bound;
} perp__element;

enum { PERP__MOST_NORMALS = 3 };

/* What the elements do. direction: of slip, two numbers an element; 0 without friction. load: the
 * direction N / |N| of the normal forces, three numbers an element, so that |N| = load'N is linear;
 * a sign where there is one of them. */
typedef struct perp__mode_pattern {
    int8_t *mode;
    double *direction, *load;
} perp__mode_pattern;

struct perp__acceleration {
    PERP__WORK;
    perp__arena blocks; /* matrices of the rows that take part */
    int32_t asked;      /* there are answers, or it is known that there are none */
    int32_t elements, closed, active, bilateral_row;
    perp__element *element;
    int32_t *row_of;     /* active: row of the mechanism */
    int32_t *indices;    /* 2 rows, of work */
    double *bias, *size; /* rows: d/dt(J) v + d/dt(drift), and how large its error may be */
    double *W, *held;    /* active by active; held: where the bilateral rows hold */
    double *beta, *load; /* active; load: the size of beta's terms */
    double *scale;       /* active: a power of 2 near 1 / sqrt(W_ii) */
    perp__mode_pattern pattern;
    /* patterns with a determinant of 0, and below 0: whether there is one, and its first contact */
    int32_t has_singular, singular_contact, has_negative, negative_contact;
    perp__linear linear;    /* a pattern's: x are forces, u accelerations */
    perp__pivoting turning; /* of the angles of slips */
    double *turn_work;      /* 3 rows */
    double *load_work;      /* of load.c */
    int32_t bent;           /* a pattern that is not linear was met: its minors say nothing */
    double *work;           /* 4 active^2 + 8 active + 4 n */
    double *velocity;       /* n: M^-1 k */
    double *zeros;          /* rows */
    struct {
        double *friction, *dry; /* contacts, dry */
        int8_t *included;       /* contacts */
    } seed;                     /* a problem of its own: a step may be asking */
    int32_t complete;           /* 1: every pattern was looked at */
    perp__pattern_tree tree;
    int64_t leaves;
    double *chosen; /* 2 elements: directions of slip at a leaf of the tree */
    perp__polyhedron polyhedron;
    perp__answers answers; /* points are forces in all rows of the mechanism */
};

/* ---- of an answer, besides its force, and its acceleration first in `own` ----------------------
 */
static inline double *perp__answer_row_acceleration(const perp__acceleration *a,
                                                    const perp__answer *answer)
{
    return answer->extra + a->m->n;
}

static inline perp__mode_pattern perp__answer_pattern(const perp__acceleration *a,
                                                      const perp__answer *answer)
{
    double *direction = answer->extra + a->m->n + a->m->rows;
    const perp__mode_pattern pattern = {answer->pattern, direction,
                                        direction + 2 * (size_t)(a->m->contacts + a->m->dry)};

    return pattern;
}

/* ---- state.c ---- */
/* The next element, of a contact or a dry group behind them, with its rows; behind those of the
 * contacts the bilateral rows come. */
perp__element *perp__element_add(perp__acceleration *a, int32_t source);
void perp__element_add_bilateral(perp__acceleration *a);
/* The elements, W and beta at (t, q, v); *impact: a closed contact that approaches, or -1. */
perp_status perp__acceleration_state(perp__acceleration *a, int32_t *impact, double t,
                                     const double *q, const double *v);
/* W, beta and their sizes, from M, k and J in m->begin and from bias and size; and `held`. PERP_OK
 * or _MEMORY. */
perp_status perp__acceleration_reduce(perp__acceleration *a);

/* ---- accelerations.c ---- */
/* m->accelerations with its room, and without answers. */
perp_status perp__acceleration_open(perp_mechanism *m);

/* ---- pattern.c ---- */
/* Of the tree of patterns. */
int32_t perp__element_choices(void *user, int32_t index);
int32_t perp__element_choose(void *user, int32_t index, int32_t choice);
/* Whether the element starts to slip in the mode, and so has to slip the way of its force. */
bool perp__element_starts(const perp__element *element, int32_t mode);
bool perp__element_presses(const perp__element *element, int32_t mode);
/* Solves: 0, or the dimension of the null space (then `null` is filled), or -1: no solution. */
int32_t perp__pattern_solve(perp__acceleration *a);
/* The same without widths and null space, with pivots of at most `singular` of the largest entry,
 * and those beyond `most`, as 0. */
void perp__pattern_solve_roughly(perp__acceleration *a, double singular, int32_t most);
/* Forces and, in `change`, accelerations that `force`, of all active rows, makes with what the
 * pattern, solved last, answers to it. */
void perp__pattern_respond(perp__acceleration *a, double *force, double *change);
/* Of perp__linear: what an element does and, behind them, that bilateral rows hold. */
int32_t perp__element_conditions(const void *user, const void *pattern, int32_t index,
                                 perp__condition *list);

/* ---- slip.c ---- */
/* Slips of the pattern that start in a plane. */
int32_t perp__slip_count(const perp__acceleration *a);
bool perp__slip_starts(const perp__acceleration *a, int32_t index);
/* Turns them until friction is opposite to the acceleration; as perp__pattern_solve, or -1. */
int32_t perp__slip_turn(perp__acceleration *a, double singular);
/* All directions of the only slip of the pattern that starts in a plane, up to four; -1 where the
 * pattern is singular. */
int32_t perp__slip_angles(perp__acceleration *a, double angles[4]);

/* ---- load.c: contacts with two or three normals that hold both ways ---- */
/* Whether |N| of the element counts and is no linear function of N; and it slips. */
bool perp__load_bends(const perp__element *element);
bool perp__load_slips(const perp__acceleration *a, int32_t index);
/* Doubles of load_work. */
size_t perp__load_room(size_t elements);
/* load := N / |N| of linear.x; the largest change. */
double perp__load_turn(perp__acceleration *a);
/* Calls `found` at every set of loads for which the pattern has |N| = load'N where it slips, with
 * the loads set, up to 1e-6 or so. */
perp_status perp__load_all(perp__acceleration *a, perp_status (*found)(perp__acceleration *a));

/* ---- answers.c ---- */
/* holds: rows of the mechanism whose velocity the answer keeps at 0. */
void perp__acceleration_mark_rows(const perp__acceleration *a, const perp__answer *answer,
                                  int8_t *holds);
/* The point f. */
perp_status perp__acceleration_keep_point(perp__acceleration *a, int32_t at_vertex);
int32_t perp__acceleration_holds(void *user, perp__answer *outer, const perp__answer *inner);
/* The family of the pattern that was solved. */
perp_status perp__acceleration_keep_family(perp__acceleration *a, int32_t dimension);

/* ---- search.c ---- */
/* Answers where there are too many patterns, or too large a family, from settings.starts. */
perp_status perp__acceleration_search(perp__acceleration *a, perp_mechanism_summary *summary);
/* Tries the pattern of one solution that the contact solver gives: where patterns are too many, and
 * after an enumeration where slips start in a plane: contacts that share a load, whose directions
 * Newton's method does not find from anywhere. */
perp_status perp__acceleration_seed(perp__acceleration *a);

/* ---- all.c ---- */
/* Solves the pattern and keeps what holds. singular: of perp__slip_turn. */
perp_status perp__acceleration_try(perp__acceleration *a, double singular);
/* Finds, labels, sorts and counts answers: all patterns, or what a search finds; impact: a contact
 * that approaches, so that there are none, or -1. */
perp_status perp__acceleration_look(perp__acceleration *a, perp_mechanism_summary *summary,
                                    int32_t impact);

#endif
