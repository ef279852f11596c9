/* What the front door asks of rigid bodies in the place of the dynamics; solver->rigid is the
 * caller's problem. */
#ifndef PERP_CONTACT_RIGID_H
#define PERP_CONTACT_RIGID_H

#include "contact/solver.h"

/* v and q of the free velocities, and in `load` the sizes of the terms of q. */
void perp__rigid_load(perp_contact_solver *solver);

/* v and u of solver->r. */
void perp__rigid_velocities(perp_contact_solver *solver);

/* u := that of bodies that stand still, where impulses can move them. */
void perp__rigid_bias(const perp_contact_solver *solver, double *u);

/* For held.c: what constraints with one body are beside, and which of those that hold are pushed by
 * more than a carrier. */
void perp__rigid_beside(const perp_contact_solver *solver, const int8_t *holds, int32_t *beside,
                        int8_t *pushed);

/* u of all rows after held.c has written v: exactly 0 where they hold, bias between bodies that
 * move as one, else from v. */
void perp__rigid_held_velocities(const perp_contact_solver *solver, const double *v, double *u);

#endif
