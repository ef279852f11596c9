/* What the files of mechanisms share. n: velocities. Matrices of rows are row-major, n wide; the
 * rows are those of the contacts, then the bilateral ones, then those of dry friction. */
#ifndef PERP_MECHANISM_MECHANISM_H
#define PERP_MECHANISM_MECHANISM_H

#include <float.h>

#include <perp/contact.h>
#include <perp/mechanism.h>

#include "base/arena.h"
#include "base/check.h"
#include "base/handle.h"
#include "base/outcome.h"
#include "linalg/active_rows.h"
#include "linalg/matrix.h"
#include "mechanism/tuning.h"

/* What bodies and levers make of a residual: up to 6 was seen in random problems. */
#define PERP__LEVERS 16.0

/* In a problem in accelerations a slip is a drift faster than these by this factor. */
#define PERP__FAST 64.0

/* Of the scheme of differences in perp__evaluate_bias. */
enum { PERP__BIAS_COLUMNS = 10 };

/* Beside the negative statuses: q is outside of what the mechanism is defined for. */
enum { PERP__OUTSIDE = 1 };

/* What the callbacks say at one t, q, v. */
typedef struct perp__terms {
    double *M;      /* n by n */
    double *factor; /* n by n: L of M = L L', column-major, lower triangle */
    double *k;      /* n */
    double *gap;    /* contacts; 0 of those that hold both ways */
    double *mu;     /* contacts: of sliding */
    double *J;      /* rows by n: H, G, B */
    double *drift;  /* rows: of H, G, B */
    double *c;      /* constraints */
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

/* A state of motion: the solution of such a problem; with q, where a step led. */
typedef struct perp__motion {
    double *q;           /* coordinates */
    double *v;           /* n; and behind it */
    double *u, *r, *ray; /* rows: J v + drift, exact where rows hold; impulses, 0 of contacts that
                            are not included; a ray */
    int32_t *modes;      /* contacts, then dry groups */
    int8_t *holds;       /* rows: 1 where u is prescribed: bilateral, closed normals, what sticks */
    int32_t outcome, method, certificate, has_ray;
    int64_t iterations;
    double residual;
} perp__motion;

/* The contact solver with the problem that it is given. */
typedef struct perp__assembly {
    perp__arena arena;
    perp_contact_settings settings;
    perp_contact_solver *solver;
    int32_t columns, contacts, rows; /* of the problem at hand */
    int32_t next_column;             /* first that is not given away */
    int32_t most_contacts, most_rows, most_columns;
    double *M, *H, *G, *f, *w, *b, *mu;
    double *v, *r, *u, *ray;
    double *start;  /* rows: impulses to start from, */
    int32_t starts; /* if there are any */
    int32_t *dims, *two_sided, *modes;
    int32_t *source; /* contact of the mechanism; contacts + group: dry friction; -1 - contact:
                        friction of a pressure */
} perp__assembly;

/* What a scheme, a run or a question keeps begins with this; made when first needed. */
#define PERP__WORK     \
    perp__arena arena; \
    perp_mechanism *m

typedef struct perp__acceleration perp__acceleration;
typedef struct perp__implicit perp__implicit;
typedef struct perp__theta perp__theta;
typedef struct perp__adaptive perp__adaptive;

struct perp_mechanism {
    PERP__HANDLE;
    perp__arena arena;
    perp_mechanism_settings settings;
    double deadline;            /* of the call, for perp__now(); 0: none */
    perp_mechanism_model model; /* its arrays are the caller's: copies of them are below */
    int32_t n, coordinates, contacts, contact_rows, bilateral, dry, dry_rows, rows;
    int32_t constraints;     /* bilateral rows, and normals of contacts that hold both ways */
    int32_t *dims, *starts;  /* contacts; starts: contacts + 1, first rows */
    int32_t *two_sided;      /* contacts: 0, or normals that hold both ways */
    int32_t *constraint_row; /* constraints: their rows */
    int32_t *normal_of;      /* rows: the contact whose one-sided normal it is; -1: of none */
    int32_t *tangent,
        *tangents; /* contacts, then dry groups: first row of its friction, and rows */
    double *mu, *mu_static, *stribeck, *restitution;
    perp__terms begin, end;              /* at the step's start; where else it is evaluated */
    perp__motion answer, second;         /* of the problem at hand */
    perp__motion compressed;             /* of an impact: where its expansion begins */
    perp__motion now, next, trial, half; /* of a run */
    perp__assembly assembly, projection;
    perp__active_rows held;
    double *momentum, *free; /* n: M v + h k, and the velocities without impulses */
    double *shift, *friction, *pressure, *dry_bound;
    double *impact_shift;   /* contacts: of the second stage */
    double *start_velocity; /* rows: u at the step's start */
    double *free_velocity;  /* rows: u of `free` */
    double *start_speed; /* contacts: |u_t| at the step's start, under Poisson's law, and of those
                            that hold both ways */
    double *moved;       /* coordinates */
    int8_t *included;
    int8_t *together; /* contacts: 0: hit alone, under Stronge's law */
    int8_t *apart; /* contacts: 1: open in a step, whatever its gap does: a run in chosen steps ends
                      one where it closes; else 0 */
    int8_t *let_go; /* contacts: 1: starts to slip, without static friction; -1: comes to rest, with
                       it; 0: as its speed says */
    double span;    /* of a run in chosen steps; else 0 */
    double *acceleration; /* n: that a step may expect; of runs in chosen steps, else 0 */
    double *work;         /* 4 n, nobody's beyond a function */
    double *differences;  /* 3 + 2 PERP__BIAS_COLUMNS rows, of perp__evaluate_bias */
    int64_t evaluations;
    double *kept_q, *kept_v; /* coordinates, n: where m->end holds the rows at kept_t, */
    double kept_t;
    int32_t keeps;            /* 1: and it still does: the next step of a run need not ask again */
    perp__implicit *implicit; /* these made when first needed */
    perp__acceleration *accelerations;
    perp__theta *theta;
    perp__adaptive *adaptive; /* of runs that choose their steps */
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
/* bias := d/dt(J) v + d/dt(drift) along q' = N v: by the model's callback or, where it has none, by
 * differences over +-first and, at most `levels` times in all, shorter ones. error: rows, of it; or
 * NULL. */
perp_status perp__evaluate_bias(perp_mechanism *m, double *bias, double *error, double t,
                                const double *q, const double *v, double first, int32_t levels);
/* q1 := q0 + h N(at) v, normalised. q1 may be neither q0 nor at. */
perp_status perp__evaluate_move(perp_mechanism *m, double *q1, const double *q0, const double *at,
                                double h, const double *v);

/* ---- rows.c: what rows make of velocities ---- */
/* sum + J_row x, and with the sizes of the products; and x := x + s J_row'. */
double perp__row_times(const perp_mechanism *m, const perp__terms *terms, int32_t row, double sum,
                       const double *x);
double perp__row_terms(const perp_mechanism *m, const perp__terms *terms, int32_t row, double sum,
                       const double *x);
void perp__add_row(const perp_mechanism *m, const perp__terms *terms, int32_t row, double s,
                   double *x);
/* |drift| + |J_row| |v|: what a velocity of the row is summed up of. */
double perp__row_size(const perp_mechanism *m, const perp__terms *terms, int32_t row,
                      const double *v);
/* u := J v + drift, all rows. */
void perp__row_velocities(const perp_mechanism *m, const perp__terms *terms, double *u,
                          const double *v);
/* x := x + J' r. */
void perp__add_impulses(const perp_mechanism *m, const perp__terms *terms, double *x,
                        const double *r);
/* J_row M^-1 J_row' at the step's start; in m->work. */
double perp__row_mobility(perp_mechanism *m, int32_t row);
/* What the friction of contact j grows with: r_n, or |r_N| where it holds both ways. */
double perp__load_of(const perp_mechanism *m, const double *r, int32_t j);
/* y := M x; x := M^-1 b, b may be x itself; and x := L^-1 x, L^-T x, with M = L L'. */
void perp__multiply_mass(const perp_mechanism *m, const perp__terms *terms, double *y,
                         const double *x);
void perp__solve_mass(const perp_mechanism *m, const perp__terms *terms, double *x,
                      const double *b);
void perp__solve_lower(const perp_mechanism *m, const perp__terms *terms, double *x);
void perp__solve_upper(const perp_mechanism *m, const perp__terms *terms, double *x);
/* y := L' x, which may be x itself; its length, sqrt(x' M x). */
double perp__energy_norm(const perp_mechanism *m, const perp__terms *terms, double *y,
                         const double *x);
/* Sliding speed of a contact or dry group, 0.0 where it is no more than this share of its terms. */
double perp__sliding_speed(const perp_mechanism *m, const perp__terms *terms, int32_t place,
                           const double *u, const double *v, double rounding);
/* The coefficients of friction that count where a step starts with row velocities u. */
void perp__friction_of_speed(const perp_mechanism *m, const perp__terms *terms, double *friction,
                             const double *u, const double *v);

/* ---- assembly.c ---- */
/* Room and a solver for problems with these settings. pressures: contacts with friction of a
 * pressure. On failure all is as it was. PERP_OK or _MEMORY. */
perp_status perp__assembly_fit(perp_mechanism *m, perp__assembly *a, bool pressures, double tol,
                               int32_t cone);
void perp__assembly_release(const perp_mechanism *m, perp__assembly *a);
/* Sets up and solves what a->... describe; fills a->v, r, u, modes, ray and answer's outcome.
 * G has `bilateral` rows. PERP_OK or a negative status with its message. */
perp_status perp__assembly_solve(perp_mechanism *m, perp__assembly *a, int32_t bilateral,
                                 perp__motion *answer);
/* Solves; answer->outcome tells. PERP_OK or a negative status. */
perp_status perp__solve_velocities(perp_mechanism *m, perp__motion *answer,
                                   const perp__velocity_problem *problem);

/* ---- hold.c ---- */
/* m->held := the constraints. */
void perp__hold_constraints(perp_mechanism *m, const perp__terms *terms);
/* Appends L^-1 J_row' to m->held. */
void perp__hold_row(perp_mechanism *m, const perp__terms *terms, int32_t row, double target);
/* v and u of the answer: velocities in what the rows that hold leave free. */
void perp__hold_velocities(perp_mechanism *m, perp__motion *answer,
                           const perp__velocity_problem *problem);

/* |M v - momentum - J'r| beside its terms; in m->work. */
double perp__momentum_residual(perp_mechanism *m, const perp__terms *terms, const double *momentum,
                               const double *v, const double *r);
/* An iteration ended with this left of the step's problem, beside its terms: m->answer's residual
 * and outcome tell. */
void perp__check_iterate(perp_mechanism *m, double beside);
/* factor := L of the symmetric part of A, n by n, which takes the place of A; whether that is
 * positive definite. */
bool perp__factor_symmetric_part(int32_t n, double *A, double *factor);
/* The answer's outcome, after what v and r leave of the problem's momentum balance. */
void perp__check_motion(perp_mechanism *m, perp__motion *answer,
                        const perp__velocity_problem *problem);
/* PERP_OK, or a refusal that names what overflowed: numbers that are finite each may together. */
perp_status perp__mechanism_check_end(perp_mechanism *m, const perp__motion *state);

/* ---- project.c ---- */
/* to->q: moved; m->end holds the rows there afterwards; to->r: which contacts press. Writes what is
 * left of penetration and |c|. */
perp_status perp__project(perp_mechanism *m, perp_mechanism_step *step, perp__motion *to, double t);
/* step->penetration and drift := those of m->end's rows; whether there is more than rounding. */
int32_t perp__measure_overlap(const perp_mechanism *m, perp_mechanism_step *step, const double *q);
/* What the gap or the c of this row is summed up of; and what rounding of q makes of it. */
double perp__gap_size(const perp_mechanism *m, const perp__terms *terms, int32_t row,
                      const double *q);
double perp__gap_rounding(const perp_mechanism *m, const perp__terms *terms, int32_t row,
                          const double *q);

/* ---- the schemes: from that start to `to`; fill step, but not seconds and evaluations ---- */
typedef perp_status perp__scheme(perp_mechanism *m, perp__motion *to, perp_mechanism_step *step,
                                 const perp_mechanism_start *from);
perp__scheme perp__advance_frozen, perp__advance_implicit, perp__advance_theta;
/* to := that state, without impulses. */
void perp__stay(const perp_mechanism *m, perp__motion *to, const double *q, const double *v);
/* The scheme of the settings, with the state kept where there is no step. */
perp__scheme perp__take_step;
/* The same for steps of the caller's length: what leaves rest slips with mu, not mu_static. */
perp__scheme perp__advance_from;

/* ---- schemes/frozen.c: the parts of a frozen step, which other schemes take over ---- */
/* With m->begin's rows evaluated: speeds at the start, shifts, and the contacts that touch. A gap
 * that is no more than rounding of q counts as 0: moving by it would not change q, and a body at
 * rest would keep a velocity of rounding. */
void perp__prepare_contacts(perp_mechanism *m, const perp_mechanism_start *from);
/* m->momentum := M v + h k, and the bounds of dry friction. */
void perp__prepare_impulses(perp_mechanism *m, const perp__terms *terms,
                            const perp_mechanism_start *from);
/* With all of it: momentum, coefficients, bounds and the contacts within reach, too. */
void perp__prepare_step(perp_mechanism *m, const perp_mechanism_start *from);
/* m->free: the velocities that m->momentum has without impulses; includes what they reach. */
void perp__include_reached(perp_mechanism *m, const perp__terms *terms);
/* The impact of the contacts that are not apart, at (t, to): a frozen step of no length. */
perp_status perp__impact(perp_mechanism *m, perp__motion *to, perp_mechanism_step *step, double t);
/* The problem of what was prepared, with these rows and this M. */
perp__velocity_problem perp__pose(const perp_mechanism *m, const perp__terms *terms);
/* m->answer := its solution, with all contacts kept. */
perp_status perp__solve_frozen(perp_mechanism *m, const perp__velocity_problem *problem);
/* Whether a step with this outcome moves the state. */
bool perp__outcome_moves(int32_t outcome);
/* The end of a step to to->q at t, whose problem m->answer solves: impacts, report, projection. */
perp_status perp__finish_step(perp_mechanism *m, perp__motion *to, perp_mechanism_step *step,
                              double t, const perp__velocity_problem *problem);

/* ---- answers.c ---- */
/* With the step prepared: where its problem has several answers, m->answer becomes the one that the
 * settings select. Writes step->answers and exhaustive. */
perp_status perp__select_answer(perp_mechanism *m, perp_mechanism_step *step,
                                const perp__velocity_problem *problem,
                                const perp_mechanism_start *from);

/* ---- impact.c ---- */
/* p of contact j, which slides with `speed` at the step's start; M^-1 of the force n - mu d is left
 * in m->work. */
double perp__sliding_inertia(perp_mechanism *m, int32_t j, double speed);
/* Whether sliding in contact j ended though it was not hit, in an impulse at any h. In m->work. */
bool perp__is_jammed(perp_mechanism *m, const perp__motion *answer, int32_t j);
/* Whether contact j, with restitution, was hit or jammed in the step that `answer` solves. */
bool perp__is_impact(perp_mechanism *m, const perp__motion *answer, int32_t j);
/* Second stage: m->answer, of the first stage, is replaced by velocities and impulses after the
 * impacts. */
perp_status perp__solve_impacts(perp_mechanism *m, const perp__velocity_problem *problem);
/* Poisson's expansion, from the compression in m->answer. */
perp_status perp__expand(perp_mechanism *m, const perp__velocity_problem *compression);

/* ---- stronge.c ---- */
/* The impact of one contact. In the plane the second tangent has the first one's mobility, is not
 * coupled and at rest. */
typedef struct perp__hit_contact {
    double W[3][3], u[3]; /* of its rows: their mobility, and what they do before */
    double mu, e;
    double r[3], stuck; /* impulses of all but its end in which it sticks; the normal one of that */
} perp__hit_contact;

/* r and stuck, after Stronge. */
void perp__stronge_impact(perp__hit_contact *c);

/* ---- accelerations/accelerations.c: NULL is accepted ---- */
void perp__acceleration_release(perp__acceleration *a);

/* ---- run.c ---- */
/* What a run keeps between its steps. */
typedef struct perp__run {
    perp_mechanism *m; /* m->now: where the run is */
    perp_mechanism_run_result result;
    perp_mechanism_observer observer;
    void *user;
    double t, end;
    int32_t ended;   /* result.outcome says why */
    double largest;  /* |q| so far */
    double overlaps; /* penetration or |c| at the start */
} perp__run;

/* Takes a step to `next` at t: m->now, result, observer. A step without motion ends the run. */
perp_status perp__run_take(perp__run *run, const perp__motion *next, double t, double h,
                           const perp_mechanism_step *step);

/* ---- mechanism.c ---- */
/* A struct that begins with PERP__WORK, 0 behind it but for what `layout` (NULL: none yet) takes;
 * NULL without memory, and the message says so. And its end; NULL is accepted. */
void *perp__work_create(perp_mechanism *m, size_t size, perp__layout layout);
void perp__work_release(void *work);
/* All but q. */
void perp__copy_motion(const perp_mechanism *m, perp__motion *to, const perp__motion *from);
/* No impulses, nothing that holds, no ray. */
void perp__clear_motion(const perp_mechanism *m, perp__motion *motion);
/* Enters the context and sets the deadline. */
perp_status perp__mechanism_enter(perp_mechanism *m);
bool perp__mechanism_is_late(const perp_mechanism *m);
perp_status perp__mechanism_check_state(perp_mechanism *m, double t, const double *q,
                                        const double *v);
perp_status perp__mechanism_check_start(perp_mechanism *m, const perp_mechanism_start *from);

#endif
