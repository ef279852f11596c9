/* What a run keeps between its steps. */
#ifndef PERP_MECHANISM_RUN_H
#define PERP_MECHANISM_RUN_H

#include "mechanism/mechanism.h"

typedef struct perp__run {
    perp_mechanism *m; /* m->now: where the run is */
    perp_mechanism_run_result result;
    perp_mechanism_observer observer;
    void *user;
    double t, end;
    int32_t ended; /* result.outcome says why */
} perp__run;

/* Takes a step to `next` at t: m->now, result, observer. A step without motion ends the run. */
perp_status perp__run_take(perp__run *run, const perp__mechanism_state *next, double t, double h,
                           const perp_mechanism_step *step);

#endif
