/* Scenes of the stepper whose answers are known in closed form, and what it is off by: relative
 * errors, of whatever sizes, steps, masses, speeds and places. */
#ifndef PERP_TESTS_EXTREME_SCENES_H
#define PERP_TESTS_EXTREME_SCENES_H

#include <stdint.h>

/* What calls said since this was last cleared; whoever reads it clears it. */
extern struct extreme_said {
    unsigned outcomes; /* bit k: some step ended with outcome k */
    int refused;       /* and some call was refused as not finite, after which no step is taken */
} extreme_said;

/* A stack of boxes on the ground, or on a static box around (x, x, x). */
typedef struct extreme_stack {
    int32_t planar, accuracy, wakeful;
    int count, number; /* boxes, at most 20; steps */
    double side, g, h, at;
} extreme_stack;

/* What its boxes move by and their speeds, beside its height and sqrt(g height). */
double extreme_stack_moves(const extreme_stack *a);

/* The worst of all accuracies from a.accuracy on, in the plane and in space. */
double extreme_stacks_move(extreme_stack a);

/* A point or a box slides at speed v, (3, 4)/5 of it along the axes in space, to its stop after
 * v^2 / (2 mu g): what it is off by, beside that, and no velocity is left. Stopping within a step
 * costs a h^2 / 8 (docs/world.md). */
typedef struct extreme_slide {
    int32_t planar;
    double size, mu, g, v, h, at; /* size 0: a point */
} extreme_slide;

double extreme_slide_off(const extreme_slide *a, double allowed);

/* A point pushed by 1 - 1e-9 and by 1 + 1e-9 of what friction holds: at rest, and accelerated by
 * the difference. The error of that, or 1 where what has to rest moves. */
double extreme_threshold_off(double mu, double g);

/* Bits at 4^k. A heap of boxes, balls and capsules in space; lengths times 4^k, times 2^k and the
 * velocities so. Counts the numbers that are not those of k = 0 times a power of two. */
double extreme_bits_differ(double k);

/* A ball with e = 1/2 from 1 m: its height after 1 s, on its second bounce. */
double extreme_bounce_off(double h);

/* Without friction a box keeps its velocity v to the last bit. */
double extreme_slides_on(double v);

/* Two boxes, 1 and R, and R and 1: still, and the ground carries both. Two bodies are solved to
 * `tol` at every accuracy. */
double extreme_load_off(double ratio);

/* Ten boxes; every other one is heavy, or the last. */
double extreme_tower_moves(double ratio, int last);

/* A ball of mass R runs into one of mass 1, e = 1; each speed beside its own. */
double extreme_hit_off(double ratio);

/* A ball, or a box that spins, flies at a plate of a thousandth of its size; how far it gets
 * behind, or what velocity it has left. */
double extreme_plate_passed(double v);

/* Spin of a body that nothing touches: its energy and angular momentum. */
double extreme_spin_off(double omega, double h, int number);

/* A ball with e = 1: the loss of energy after so many steps. */
double extreme_energy_lost(double number);

#endif
