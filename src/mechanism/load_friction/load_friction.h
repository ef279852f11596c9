/* What the files of load-dependent friction share. All matrices column-major, n by n. */
#ifndef PERP_MECHANISM_LOAD_FRICTION_H
#define PERP_MECHANISM_LOAD_FRICTION_H

#include <perp/friction.h>

#include "base/arena.h"
#include "base/check.h"
#include "base/handle.h"
#include "linalg/matrix.h"
#include "mechanism/linear.h"

/* One choice of mode and sign of the normal force a coordinate: within it the system is linear. */
typedef struct perp__friction_pattern {
    int8_t *mode; /* PERP_LOAD_...; sliding with the sign of that coordinate's motion */
    int8_t *side; /* behind mode: sign of N_i that the friction counts with; 0: doesn't matter
                     (mu_i = 0, sticks) */
} perp__friction_pattern;

/* The question: which x = q'' solve A x + b + f = tau, that of the handle, where coordinate i moves
 * with sign[i], or, sign[i] = 0, sticks at x_i = stop[i] with |f_i| <= mu_stick[i] |N_i|, or slides
 * away. */
typedef struct perp__friction_question {
    int8_t *sign;
    double *stop;     /* 0 at rest; in a step, -v_i / h */
    double *mu_stick; /* static friction at rest; in a step that of the motion before */
    int8_t *before;   /* in a step, the sign of the motion before it */
} perp__friction_question;

struct perp_load_friction {
    PERP__HANDLE;
    perp__arena arena;
    perp_load_settings settings;
    int32_t n;
    int32_t
        monotone; /* friction never turns the sign of x'(A x + f): every question has one answer */
    double stiffness, damping;
    double *A, *C, *S, *X, *Y; /* S: normal inertia; X = A^-1 C', Y = S + C X */
    double *b, *d, *mu, *mu_static;
    double *tau;  /* of the question */
    double *size; /* 1 / sqrt(A_ii): the unit of x_i, up to one factor */
    perp__matrix A_view, C_view;
    perp__friction_question question;
    perp__friction_pattern pattern;
    perp__pattern_tree tree;
    perp__answers answers; /* points are x = q''; own: n normal forces, n of friction */
    int8_t *regular;       /* of a step: a stable acceleration stops this coordinate within it */
    /* work */
    perp__linear linear; /* of a pattern: x, and u = (A x + b - tau, C x + d) */
    double *c, *c_size;  /* 2 n: its constants */
    double *origin;      /* of a family */
    double *product, *product_low, *normal, *normal_low;
    double *work; /* 6 n^2 + 4 n */
    perp__polyhedron polyhedron;
};

/* Solves the pattern: f->linear has the solution with its widths and 0 is returned; else the
 * dimension of the null space, or -1 where the equations contradict each other. */
int32_t perp__friction_solve_pattern(perp_load_friction *f);

/* u, residual and load of f->linear.x in the pattern, in doubled precision. */
void perp__friction_evaluate(perp_load_friction *f);

/* Whether the solution's signs and modes are the pattern's; *at_vertex: only within tol. */
bool perp__friction_holds(perp_load_friction *f, int32_t *at_vertex);

/* Of perp__linear. */
int32_t perp__friction_conditions(const void *user, const void *pattern, int32_t i,
                                  perp__condition *list);

/* Keeps the point of the pattern, or the family of which it is one. PERP_OK or _MEMORY. */
perp_status perp__friction_keep_point(perp_load_friction *f, int32_t at_vertex);
perp_status perp__friction_keep_family(perp_load_friction *f, int32_t dimension);

/* Whether an answer is part of another one: of perp__answers. */
int32_t perp__friction_holds_answer(void *user, perp__answer *outer, const perp__answer *inner);

/* Answers all patterns, or what a search finds. Answers are sorted and labelled. */
perp_status perp__friction_answer_all(perp_load_friction *f, perp_load_summary *summary);

/* The same to the question of forward dynamics, with f->tau and the signs of velocity. */
perp_status perp__friction_solve(perp_load_friction *f, perp_load_summary *summary,
                                 const double *velocity);

/* The handle of a public call, entered. */
perp_status perp__friction_enter(perp_load_friction *f);

#endif
