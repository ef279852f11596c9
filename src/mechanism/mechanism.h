/* What the files of mechanisms share. n: velocities. Matrices of rows are row-major, n wide; the
 * rows are those of the contacts, then the bilateral ones, then those of dry friction. */
#ifndef PERP_MECHANISM_MECHANISM_H
#define PERP_MECHANISM_MECHANISM_H

#include <perp/contact.h>
#include <perp/mechanism.h>

#include "base/arena.h"
#include "base/check.h"
#include "base/handle.h"
#include "base/outcome.h"

#define PERP__EPS 2.220446049250313e-16

/* The velocities of an answer and its impulses belong together up to this, beside the terms of
 * their balance: impulses are known up to tol times what bodies and levers make of that.
 * Velocities that hold.c finds have to be as near to the solution's; where they are not (a problem
 * stopped early) the solution's stand. */
#define PERP__AGREEMENT 1e-8

/* Beside the negative statuses: q is outside of what the mechanism is defined for. */
enum { PERP__OUTSIDE = 1 };

/* What the callbacks say at one t, q, v. */
typedef struct perp__terms {
    double *M;      /* n by n */
    double *factor; /* n by n: L of M = L L', column-major, lower triangle */
    double *k;      /* n */
    double *gap;    /* contacts */
    double *mu;     /* contacts: of sliding */
    double *J;      /* rows by n: H, G, B */
    double *drift;  /* rows: of H, G, B */
    double *c;      /* bilateral */
    double *bound;  /* dry */
} perp__terms;

/* A problem in velocities at one geometry:
 *
 *   M v = momentum + J'r,   u = J v + drift,   0 <= r_n perp u_n + shift >= 0,   friction,
 *
 * with friction * (r_n + pressure) the size of a contact's friction. */
typedef struct perp__velocity_problem {
    const perp__terms *terms;
    const double *momentum; /* n */
    const double *shift;    /* contacts */
    const double *friction; /* contacts: the coefficient that counts */
    const double *pressure; /* contacts: a normal impulse that acts already; NULL: 0 */
    const int8_t *included; /* contacts: 0: not part of the problem */
    const double *dry;      /* dry: bounds of impulses */
} perp__velocity_problem;

/* Its solution. */
typedef struct perp__velocity_answer {
    double *v;      /* n */
    double *r;      /* rows; 0 of contacts that are not included */
    double *u;      /* rows: J v + drift, exact where rows hold */
    int32_t *modes; /* contacts, then dry groups */
    double *ray;    /* rows */
    int8_t *holds;  /* rows: 1 where u is prescribed: bilateral, closed normals, what sticks */
    int32_t outcome, method, certificate, has_ray;
    int64_t iterations;
    double residual;
} perp__velocity_answer;

/* The contact solver with the problem that it is given. */
typedef struct perp__assembly {
    perp__arena arena;
    perp_contact_settings settings;
    perp_contact_solver *solver;
    int32_t columns, contacts, rows; /* of the problem at hand */
    int32_t next_column;             /* first that is not given away */
    int32_t most_contacts, most_rows, most_columns;
    int32_t holds_itself; /* hold.c finds the velocities: the solver need not */
    double *M, *H, *G, *f, *w, *b, *mu;
    double *v, *r, *u, *ray;
    int32_t *dims, *modes;
    int32_t *source; /* contact of the mechanism; contacts + group: dry friction; -1 - contact:
                        friction of a pressure */
} perp__assembly;

/* A state, and what the last step to it was. */
typedef struct perp__mechanism_state {
    double *q, *v;
    double *impulse, *velocity, *ray;
    int32_t *modes;
} perp__mechanism_state;

typedef struct perp__acceleration perp__acceleration;
typedef struct perp__theta perp__theta;
typedef struct perp__adaptive perp__adaptive;

struct perp_mechanism {
    PERP__HANDLE;
    perp__arena arena;
    perp_mechanism_settings settings;
    double deadline;            /* of the call, for perp__now(); 0: none */
    perp_mechanism_model model; /* its arrays: the copies below */
    int32_t n, coordinates, contacts, contact_rows, bilateral, dry, dry_rows, rows;
    int32_t *dims, *starts; /* contacts; starts: contacts + 1, first rows */
    double *mu, *mu_static, *stribeck, *restitution;
    perp__terms begin, end; /* at the step's start; where else it is evaluated */
    perp__velocity_answer answer, second;
    perp__assembly assembly, projection;
    perp__mechanism_state now, next, trial, half; /* of a run */
    double *momentum, *free; /* n: M v + h k, and the velocities without impulses */
    double *shift, *friction, *pressure, *dry_bound;
    double *impact_shift;   /* contacts: of the second stage */
    double *start_velocity; /* rows: u at the step's start */
    double *free_velocity;  /* rows: u of `free` */
    double *start_speed;    /* contacts: |u_t| at the step's start, under Poisson's law */
    double *moved;          /* coordinates */
    int8_t *included;
    double *work;     /* work_size(m) doubles, nobody's beyond a function */
    int32_t *indices; /* 2 rows, the same */
    int64_t evaluations;
    double *kept_q, *kept_v; /* coordinates, n: where m->end holds the rows at kept_t, */
    double kept_t;
    int32_t keeps;     /* 1: and it still does: the next step of a run need not ask again */
    void *scheme_work; /* of the implicit scheme; NULL with another */
    perp__acceleration *accelerations; /* of accelerations, made when first needed */
    perp__theta *theta_work;           /* of the theta scheme, made when first needed */
    perp__adaptive *adaptive_work;     /* of runs that choose their steps, the same */
};

/* ---- evaluate.c: PERP_OK, PERP__OUTSIDE, or a negative status with its message ---- */
perp_status perp__evaluate_mass(perp_mechanism *m, perp__terms *terms, const double *q);
perp_status perp__evaluate_force(perp_mechanism *m, double *k, double t, const double *q,
                                 const double *v);
/* Gaps, bilateral values and all rows; the bounds of dry friction need v. */
perp_status perp__evaluate_rows(perp_mechanism *m, perp__terms *terms, double t, const double *q,
                                const double *v);
/* The rows just evaluated in m->end are those at t, q, v. */
void perp__keep_rows(perp_mechanism *m, double t, const double *q, const double *v);
perp_status perp__evaluate_all(perp_mechanism *m, perp__terms *terms, double t, const double *q,
                               const double *v);
/* rate := N(q) v; may be neither q nor v. */
perp_status perp__evaluate_rate(perp_mechanism *m, double *rate, const double *q, const double *v);
/* q1 := q0 + h N(q0) v, normalised. q1 may not be q0. */
perp_status perp__evaluate_move(perp_mechanism *m, double *q1, const double *q0, double h,
                                const double *v);
/* q1 := q0 + h N(at) v, normalised. q1 may be neither q0 nor at. */
perp_status perp__evaluate_move_at(perp_mechanism *m, double *q1, const double *q0,
                                   const double *at, double h, const double *v);

/* ---- rows.c: what rows make of velocities ---- */
/* u := J v + drift, all rows. */
void perp__row_velocities(const perp_mechanism *m, const perp__terms *terms, double *u,
                          const double *v);
/* x := x + J' r. */
void perp__add_impulses(const perp_mechanism *m, const perp__terms *terms, double *x,
                        const double *r);
/* x := M x, and x := M^-1 x. */
void perp__multiply_mass(const perp_mechanism *m, const perp__terms *terms, double *y,
                         const double *x);
void perp__solve_mass(const perp_mechanism *m, const perp__terms *terms, double *x);
/* Sliding speed of contact j, 0.0 where it is rounding. */
double perp__sliding_speed(const perp_mechanism *m, const perp__terms *terms, int32_t j,
                           const double *u, const double *v);
/* The coefficients of friction that count where a step starts with row velocities u. */
void perp__friction_of_speed(const perp_mechanism *m, const perp__terms *terms, double *friction,
                             const double *u, const double *v);

/* ---- assembly.c ---- */
/* Solves; answer->outcome tells. PERP_OK or a negative status. h scales nothing: impulses. */
perp_status perp__solve_velocities(perp_mechanism *m, perp__velocity_answer *answer,
                                   const perp__velocity_problem *problem);

/* ---- hold.c: velocities in what the rows that hold leave free ---- */
/* x := L^-1 x, with M = L L'. */
void perp__solve_lower(const perp_mechanism *m, const perp__terms *terms, double *x);
void perp__hold_velocities(perp_mechanism *m, perp__velocity_answer *answer,
                           const perp__velocity_problem *problem);

/* ---- judge.c ---- */
/* The answer's outcome, after what v and r leave of the problem's momentum balance. */
void perp__judge_motion(perp_mechanism *m, perp__velocity_answer *answer,
                        const perp__velocity_problem *problem);
/* PERP_OK, or a refusal that names what overflowed. */
perp_status perp__mechanism_check_end(perp_mechanism *m, const perp__mechanism_state *state);

/* ---- project.c ---- */
/* q: moved; m->end holds the rows there afterwards. Writes what is left of penetration and |c|. */
perp_status perp__project(perp_mechanism *m, perp_mechanism_step *step, double *q, double t,
                          const double *v);
/* What rounding of q makes of the gap or the c of this row. */
double perp__gap_rounding(const perp_mechanism *m, const perp__terms *terms, int32_t row,
                          const double *q);

/* ---- the schemes: from (t, q0, v0) to `to`; fill step, but not seconds and evaluations ---- */
perp_status perp__advance_frozen(perp_mechanism *m, perp__mechanism_state *to,
                                 perp_mechanism_step *step, double t, double h, const double *q0,
                                 const double *v0);
perp_status perp__advance_implicit(perp_mechanism *m, perp__mechanism_state *to,
                                   perp_mechanism_step *step, double t, double h, const double *q0,
                                   const double *v0);
perp_status perp__advance_theta(perp_mechanism *m, perp__mechanism_state *to,
                                perp_mechanism_step *step, double t, double h, const double *q0,
                                const double *v0);
/* The scheme of the settings, with the state kept where there is no step. */
perp_status perp__advance(perp_mechanism *m, perp__mechanism_state *to, perp_mechanism_step *step,
                          double t, double h, const double *q0, const double *v0);

/* ---- answers.c ---- */
/* With the step prepared: where its problem has several answers, m->answer becomes the one that the
 * settings select. Writes step->answers and exhaustive. */
perp_status perp__select_answer(perp_mechanism *m, perp_mechanism_step *step,
                                const perp__velocity_problem *problem, double h, const double *v0);

/* ---- impact.c ---- */
/* The contacts with restitution that were hit in the step that `answer` solves. */
int32_t perp__count_impacts(perp_mechanism *m, const perp__velocity_answer *answer);
/* Second stage: m->answer, of the first stage, is replaced by velocities and impulses after the
 * impacts. */
perp_status perp__solve_impacts(perp_mechanism *m, const perp__velocity_problem *problem);

/* ---- accelerations.c ---- */
/* NULL is accepted. */
void perp__acceleration_release(perp__acceleration *a);

/* ---- jam.c ---- */
/* Whether sliding in contact j ended though it was not hit: Painleve's impact without collision. */
int32_t perp__is_jammed(perp_mechanism *m, const perp__velocity_answer *answer, int32_t j);

/* mechanism.c */
/* Enters the context and sets the deadline. */
perp_status perp__mechanism_enter(perp_mechanism *m);
int32_t perp__mechanism_is_late(const perp_mechanism *m);
/* What is left of the call's time, for a solver's settings: 0 without a limit, else > 0. */
double perp__mechanism_time_left(const perp_mechanism *m);
perp_status perp__mechanism_check_state(perp_mechanism *m, double t, const double *q,
                                        const double *v);
/* Says in front of a solver's message what it was solving; returns `status`. */
perp_status perp__mechanism_fail_in(perp_mechanism *m, perp_status status, const char *what);

#endif
