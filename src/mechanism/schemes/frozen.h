/* The parts of a frozen step, which other schemes take over. */
#ifndef PERP_MECHANISM_FROZEN_H
#define PERP_MECHANISM_FROZEN_H

#include "mechanism/mechanism.h"

/* With m->begin evaluated: momentum, shifts, coefficients, bounds and the contacts within reach. A
 * gap that is no more than rounding of q0 counts as 0: moving by it would not change q, and a body
 * at rest would keep a velocity of rounding. */
void perp__prepare_step(perp_mechanism *m, double h, const double *q0, const double *v0);

/* The problem of what was prepared. */
void perp__pose(perp_mechanism *m, perp__velocity_problem *problem);

/* m->answer := its solution, with all contacts kept. */
perp_status perp__solve_frozen(perp_mechanism *m, const perp__velocity_problem *problem);

/* Whether a step with this outcome moves the state. */
int32_t perp__outcome_moves(int32_t outcome);

/* m->answer into a state (but q) and a report. */
void perp__report_answer(const perp_mechanism *m, perp__mechanism_state *to,
                         perp_mechanism_step *step);

#endif
