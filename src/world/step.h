/* The phases of a step, and what their files give each other. A step goes through
 *
 *   place        rotations, mass matrices and free velocities of the bodies    (motion.c)
 *   contact set  contact points that can close within the step                 (contacts/)
 *   islands      bodies that touch, directly or through others                 (islands/)
 *   solve        per island: to tol, its impacts where they are, or within
 *                the budget of the world's accuracy                            (islands/solve.c)
 *   integrate    the next positions                                            (integrate.c)
 *   project      what penetrates is pushed apart                               (projection.c)
 *   commit       next states become states                                     (step.c)
 *   rest         bodies whose states would repeat for ever fall asleep         (rest.c)
 *
 * within a budget (islands/budget.c), and nothing that a caller can see changes before the commit.
 * Each of them goes through what is awake alone. Who includes this has the vectors of space
 * (linalg/spatial.h), arenas and outcomes as well. */
#ifndef PERP_WORLD_STEP_H
#define PERP_WORLD_STEP_H

#include "world/contacts/contacts.h"
#include "world/islands/islands.h"

/* motion.c */
void perp__rotation_of(const perp_world *world, const perp__state *state, double *R);
/* Places a shape; a body or all awake bodies, with their shapes. turned: it may have turned since
 * it was placed last. */
void perp__place_shape(const perp__shape *shape, const double *position, const double *R,
                       bool turned, perp__placed *placed);
void perp__place_body(perp_world *world, const perp__state *states, int32_t body, bool turned);
/* Places the body where the step begins, unless it is there already. */
void perp__keep_placed(perp_world *world, int32_t body);
void perp__place(perp_world *world, const perp__state *states);
/* The twist that forces would give a body, if its inertia is that of a ball; else the velocity. */
void perp__push_freely(const perp_world *world, int32_t body, double h, double *free);
/* A body in place, moving as if nothing touched it. Returns 0 where its numbers are not finite. */
bool perp__start_motion(perp_world *world, int32_t body, double h);
/* One step of Euler's equations in the body frame by the implicit midpoint rule: w to w_next. */
void perp__euler_step(const perp__body *body, double h, const double *w, const double *torque,
                      double *w_next);

/* rest.c */
/* Wakes a body, new or asleep, and all that fell asleep with it; wakes all bodies. */
void perp__rouse(perp_world *world, int32_t body);
void perp__rouse_all(perp_world *world);
/* The body is changed or removed: it wakes, and so does what is near it. */
void perp__disturb(perp_world *world, int32_t body);
/* Brings world->sleep.awake up to date after bodies were woken or removed. */
void perp__list_awake(perp_world *world);
/* After a step: bodies that repeated their state fall asleep. */
void perp__fall_asleep(perp_world *world);
/* Frees a list of sleeping contacts, which is empty then. */
void perp__drop_sleeping(perp_world *world, int32_t *first);
/* Frees all naps and sleeping contacts. */
void perp__forget_naps(perp_world *world);
/* The largest residual of what is asleep, after some of it woke. */
void perp__find_asleep_residual(perp_world *world);

/* integrate.c */
/* Computes the next states, and places the shapes there, to look for overlaps. Returns a body
 * whose numbers are not finite, or -1. */
int32_t perp__integrate(perp_world *world, double h);
/* The same for a body with the inertia of a ball that nothing is near and that stays in its fat
 * boxes: it gets its next state at once, and the phases skip it as long as it coasts. Returns 0
 * where that is not so. */
bool perp__glide(perp_world *world, int32_t body, double h);
/* Ends that, and takes the step back: of one body, of all. */
void perp__stop_coasting(perp_world *world, int32_t body);
void perp__stop_all_coasting(perp_world *world);
int32_t perp__find_infinite(const perp_world *world);
void perp__turn(const perp_world *world, perp__state *state, double t, const double *w);

/* energy.c */
/* The kinetic energy in the frame that moves with the velocity `frame`. */
double perp__kinetic_of(const perp_world *world, int32_t body, const perp__state *state,
                        const double *frame);
/* The energy that a body lost in the step, the work of forces counted, in that frame; *rounding
 * grows by the part of it that may be rounding. */
double perp__energy_lost(const perp_world *world, int32_t body, const double *frame,
                         double *rounding);
/* The work against forces of a displacement by a small twist. */
double perp__work_needed(const perp_world *world, int32_t body, const double *shift);

/* projection.c */
/* A caller put the body where it is, or changed what it touches: until a step of it awake. */
static inline void perp__note_put(perp_world *world, int32_t body)
{
    world->bodies.states[body].put |= PERP__PUT;
    world->sleep.some_put = 1;
    perp__rouse(world, body);
}
/* When the step's contacts are known: which bodies callers put deep into others, and are not apart
 * from them yet. */
void perp__find_put(perp_world *world);
/* *changed: some next state changed. */
perp_status perp__project_overlaps(perp_world *world, int32_t *changed);

/* snapshot.c: all that the next step reads, as bytes. */
size_t perp__snapshot_bytes(const perp_world *world);
void perp__snapshot_write(const perp_world *world, char *blob);
perp_status perp__snapshot_read(perp_world *world, const char *blob);

/* adaptive.c: a caller's step, in steps chosen by settings.error if that is not 0. */
perp_status perp__advance_world(perp_world *world, perp_step_result *result, double dt);

/* step.c: the contacts of a step of length h and the velocities that meet them, as a step has them
 * before it goes on; again where world->sleep.awake_changed. */
perp_status perp__find_step_contacts(perp_world *world, double h,
                                     struct perp__solve_summary *summary);
/* One step, within the budget that is open. Where world->step.divides and the step would be rough
 * there is none, and world->step.rough is set. */
perp_status perp__step(perp_world *world, perp_step_result *result, double h);

#endif
