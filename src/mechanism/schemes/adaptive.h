/* Runs in steps chosen by their estimated error: what is kept from step to step. */
#ifndef PERP_MECHANISM_ADAPTIVE_H
#define PERP_MECHANISM_ADAPTIVE_H

#include "mechanism/mechanism.h"

/* A gap that closes in a step, or a slip that turns round. */
typedef struct perp__event {
    double late;    /* by how much the step comes after it, a time; 0: none */
    double error;   /* what that makes of q, or of v, estimated */
    double after;   /* its time, from the step's start */
    int32_t impact; /* velocities jump: a jam */
    int32_t closes; /* 1 + the contact whose gap closes; 0: none */
} perp__event;

/* What a contact or dry group does: the more, the more it holds. And that a contact which holds
 * both ways, with one normal, and slides, presses against its other side: friction has a kink where
 * it changes sides. */
enum { PERP__FREE = 0, PERP__SLIDES = 1, PERP__STICKS = 2, PERP__HOLD = 3, PERP__OTHER_SIDE = 4 };

struct perp__adaptive {
    PERP__WORK;
    double *largest;              /* coordinates: of |q|, so far, or what stands in for it */
    double *scale;                /* coordinates: the same, with the step at hand */
    double *rate, *moved;         /* coordinates: scratch */
    double *difference, *scratch; /* n */
    double *expected;             /* n: m->acceleration at the start; 0: not known */
    double *force[3];             /* n: k at the start, in the middle, at the end */
    perp_mechanism_step full, first, second;
    perp__event event;           /* of the step at hand */
    double fastest, speed_scale; /* of v in the norm of M, so far; with the step at hand */
    double error, speed;         /* estimates of it: of q and h v, of v, */
    double hidden;               /* of what friction may hide */
    double first_speed;          /* of the first attempt at it */
    double h, proper;            /* the next step; the one that an impact cut short */
    double shortest, longest;    /* bounds */
    double unit;                 /* a time: unit |v| stands in for |q| */
    int32_t order;               /* of the scheme */
    int32_t started;             /* m->now.modes are those of a step */
    int32_t refused;             /* attempts in a row */
    /* releases */
    int8_t *does[3];       /* contacts, then dry groups: at the start, in the middle, at the end */
    int8_t *planned;       /* the same, from the end of a step that is planned on */
    int8_t *tried, *after; /* of a trial; of what was held, what goes on */
    double *bias, *drift;  /* rows: d/dt(J) v + d/dt(drift); of a problem in accelerations */
    double span, free;     /* of its differences; its size */
    double length;         /* of the step that led to the state that is looked at */
    int32_t known;         /* 1: it has a solution */
    int32_t release;       /* in which half of the step at hand something lets go; 0: none */
    int32_t plans;         /* 1: the next step ends where something lets go */
    int32_t cut;           /* 1: it ends at an impact, or a little behind another event */
    int64_t searched;      /* iterations of trials */
    double *gap[3], *open; /* contacts: where the step ends, its first half, its second; at first */
    /* jams */
    double *inertia[3]; /* contacts: p in the step, in its halves; NAN: not sliding */
    int32_t jam;        /* the contact that jams where the step at hand ends; -1: none */
};

/* ---- adaptive_error.c ---- */
/* Largest |x_i| beside the scale. */
double perp__adaptive_beside(const perp_mechanism *m, const double *x, const double *scale);
/* a->event := this one, if it is the first of those that matter, or matters most. */
void perp__adaptive_keep(const perp_mechanism *m, perp__adaptive *a, double late, double error,
                         double after);
/* After the half step `to` of `length` from `from`, begun `start` after the step's start: a->event
 * where one in it matters most. */
void perp__adaptive_events(perp_mechanism *m, perp__adaptive *a, const perp__motion *from,
                           const perp__motion *to, double start, double length);
/* a->scale and a->speed_scale, for a step from t whose answers are in m->trial and m->half. */
perp_status perp__adaptive_scale(perp_mechanism *m, perp__adaptive *a, double t);
/* a->error, a->speed and a->hidden of it. */
perp_status perp__adaptive_estimate(perp_mechanism *m, perp__adaptive *a, double t, double h);

/* ---- adaptive_impact.c ---- */
/* What may be wrong with the gap of contact j, with m->begin. */
double perp__adaptive_uncertainty(const perp_mechanism *m, const perp__adaptive *a, int32_t j);
/* a->event, of a step with all three, where a gap closes in it. */
void perp__adaptive_look_for_impact(perp_mechanism *m, perp__adaptive *a, double h);
/* At m->now: the impact there, if there is one, and m->apart of the next step. looked:
 * perp__adaptive_look_at_start() just did. */
perp_status perp__adaptive_meet(perp__run *run, perp__adaptive *a, bool looked);

/* ---- adaptive_release.c ---- */
/* a->does[0]: what holds at the start of a run. */
perp_status perp__adaptive_look_at_start(perp_mechanism *m, perp__adaptive *a, double t);
/* a->does[1] and [2], and a->release, of a step whose answers are in m->half and m->next. */
perp_status perp__adaptive_releases(perp_mechanism *m, perp__adaptive *a, double t, double h);
/* Of a step with a release: when that is, from the start; a->planned: what holds from there on. A
 * time that is worth a step is planned; else what lets go does so now: a->does[0]. */
perp_status perp__adaptive_locate(perp_mechanism *m, perp__adaptive *a, double t, double h,
                                  double *when);
/* Which contacts start to slip with that state: static friction no longer counts. NULL: none. */
void perp__adaptive_let_go(perp_mechanism *m, const int8_t *does, const perp__motion *state);

/* A step. A contact whose slip turns round comes to rest on the way, and there static friction
 * counts: a step that is short behind the turn ends in it. */
perp_status perp__adaptive_step(perp_mechanism *m, perp__motion *to, perp_mechanism_step *step,
                                double t, double h, const perp__motion *state);

/* With m->begin at (t, state): m->answer := accelerations, and forces of what is held. PERP_OK:
 * also where there are none; its outcome tells. */
perp_status perp__adaptive_find_forces(perp_mechanism *m, perp__adaptive *a, double t,
                                       const perp__motion *state, const int8_t *does);

/* ---- adaptive_jam.c ---- */
/* a->jam, which is -1, and a->event, of a step with all three. */
perp_status perp__adaptive_look_for_jam(perp_mechanism *m, perp__adaptive *a, double h);
/* The jam of contact a->jam at (t, to): v, r and u after it. */
perp_status perp__adaptive_jam(perp_mechanism *m, perp__adaptive *a, perp_mechanism_step *step,
                               perp__motion *to, double t);

/* ---- adaptive.c ---- */
perp_status perp__run_adaptive(perp__run *run, double t1, double h);

#endif
