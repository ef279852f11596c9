/* Contacts of a step: pairs of shapes that may meet, their points, and what they remember. */
#ifndef PERP_WORLD_CONTACTS_H
#define PERP_WORLD_CONTACTS_H

#include <stddef.h>
#include <string.h>

#include "linalg/lanes/multiversion.h"
#include "linalg/spatial.h"
#include "world/world.h"

/* pairs.c */
/* Starts the motions of all that is awake. Pairs for all shapes that are near each other where
 * `placed`, or where `moving` takes them within h. */
perp_status perp__enclose_motions(perp_world *world, double h);
/* The same for bodies of a list, where h is 0 where they are placed alone: all of them, with room
 * for `ways` times their overlap; or, where that is 0, those whose boxes do not hold it yet. */
perp_status perp__enclose(perp_world *world, const int32_t *bodies, int32_t count, double h,
                          double ways);
/* Forces and times near the largest numbers can leave the range of doubles: a body did. */
perp_status perp__fail_range(const perp_world *world, int32_t body);
/* Whether the fat boxes of a body hold what a twist makes of it from its state on. */
bool perp__stays_enclosed(const perp_world *world, int32_t body, const double *moving, double h);
/* Asks memory for what is read soon. Kernels, as calls of what has no effect are left out. */
PERP__KERNEL static void perp__fetch(const void *from, size_t bytes)
{
#ifdef __GNUC__
    for (size_t at = 0; at < bytes; at += 64)
        __builtin_prefetch((const char *)from + at, 1);
#else
    (void)from;
    (void)bytes;
#endif
}
/* Pair i of what is gone through in order; one after it is asked of memory meanwhile. */
PERP__KERNEL static perp__pair *perp__ordered_pair(const perp_world *world, int32_t i)
{
    if (i + PERP__FETCHED_AHEAD < world->pairs.count)
        perp__fetch(&world->pairs.all[world->pairs.order[i + PERP__FETCHED_AHEAD].value],
                    sizeof *world->pairs.all);
    return &world->pairs.all[world->pairs.order[i].value];
}
/* Whether the body's next state is the one at hand. */
static inline bool perp__stays(const perp_world *world, int32_t body)
{
    return memcmp(&world->bodies.states[body], &world->step.next[body], sizeof(perp__state)) == 0;
}
/* Whether some shape is near one of the body's. */
static inline bool perp__has_pairs(const perp_world *world, int32_t body)
{
    int32_t shape = world->bodies.all[body].first_shape;

    while (shape >= 0 && world->shapes.all[shape].first_link < 0)
        shape = world->shapes.all[shape].next_of_body;
    return shape >= 0;
}
/* The body, or what is near it, is not what it was in the last step. */
static inline void perp__unsettle(perp_world *world, int32_t body)
{
    if (body >= world->step.fitted_bodies)
        return;
    world->step.roles[body].repeats = 0;
    world->step.motions[body].placed = 0;
}
/* A shape that is about to be removed. */
void perp__forget_shape(perp_world *world, int32_t shape);

/* contact_set.c: measures */
double perp__pair_rounding(const perp_world *world, const perp__pair *pair);
/* The size of the two bodies: an overlap is large beside the smaller one, whatever the other is;
 * points and half-spaces are not asked. */
double perp__pair_size(const perp_world *world, const perp__pair *pair);
/* The thickness of the thinner shape; 0 for points before half-spaces. */
double perp__pair_thickness(const perp_world *world, const perp__pair *pair);
/* Shapes no farther apart, nor deeper in each other, touch; `rounding`: the pair's. */
double perp__pair_touching(const perp_world *world, const perp__pair *pair, double rounding);

/* The geometric mean; exact where both are equal. */
static inline double perp__pair_friction(const perp__shape *a, const perp__shape *b)
{
    return a->friction == b->friction ? a->friction : sqrt(a->friction) * sqrt(b->friction);
}
/* Whether the spheres about two shapes are within `margin` of each other; half-spaces are. */
bool perp__are_near(const perp_world *world, const perp__pair *pair, double margin);
/* How far a shape has points that turning may move, from its body's mass centre; and what turning
 * adds to the way of those of a body that have them so far, at most. */
double perp__turning_reach(const perp__shape *shape);
static inline double perp__turning(const perp_world *world, int32_t body, double reach, double h)
{
    const double *spin = world->step.motions[body].moving + 3;

    return h * (fabs(spin[0]) + fabs(spin[1]) + fabs(spin[2])) * reach;
}
/* A shape on the way of its body's motion, and how far its points go, at most. */
void perp__moving_shape(const perp_world *world, int32_t shape, double h, perp__moving *moving);
double perp__way_of(const perp__moving *shape);

/* collisions.c */
/* Points of shapes that touch plainly at the start; 0: they don't. Those of half-spaces may be left
 * out from a gap of `far` on. */
int32_t perp__touching_points(const perp_world *world, perp__pair *pair, double h, double far,
                              perp__point *points);
/* Whether the motion at hand makes the pair meet, and in which points, of the pose at the time of
 * pair->collision. */
bool perp__pair_collides(const perp_world *world, perp__pair *pair, double h);
/* Whether the motion at hand makes a pair meet that is no half-space's. */
bool perp__pair_meets(const perp_world *world, const perp__pair *pair, double h);
/* Whether it takes a pair that touches deep into each other: what turns comes down on another
 * corner or edge. */
bool perp__pair_sinks(const perp_world *world, perp__pair *pair, double h);
int32_t perp__collision_points(const perp_world *world, perp__pair *pair, double h,
                               perp__point *points);

/* Whether the motion at hand closes contact i of the step's, which its rates leave a gap of
 * `end` < 0. */
bool perp__meets(const perp_world *world, int32_t i, double h, double end);

/* contact_set.c */
/* Starts a step's contacts: the points of shapes that touch plainly, none included yet. */
perp_status perp__find_contacts(perp_world *world, double h);
/* Room for so many contacts of a set; a point of a pair, of which there is room, where bodies are
 * in such states; its velocity as if nothing touched; and both, of contact i of the step, which the
 * caller counts. `last`: the contact before, NULL: none. */
perp_status perp__reserve_contacts(perp_world *world, perp__contact_set *set, int32_t needed);
perp__world_contact *perp__append_contact(const perp_world *world, perp__contact_set *set,
                                          const perp__pair *pair, const perp__point *point,
                                          const perp__state *states);
void perp__prepare_contact(const perp_world *world, const perp__contact_set *set, int32_t i);
void perp__write_touching(const perp_world *world, int32_t i, const perp__world_contact *last,
                          const perp__pair *pair, const perp__point *point);
/* Arms from these mass centres to the surfaces of both shapes, which meet as the gap is closed. */
void perp__write_arms(perp__world_contact *contact, const double *centre_a, const double *centre_b);
/* How far the motion at hand takes any point of a body. */
double perp__longest_displacement(const perp_world *world, int32_t body, double h);
/* What sweeps move they take out of overlaps as well, unless joints took it elsewhere. */
static inline bool perp__is_swept(const perp_world *world, const perp__pair *pair)
{
    const perp__role *a = &world->step.roles[pair->body[0]], *b = &world->step.roles[pair->body[1]];

    return (a->swept || b->swept) && !a->far && !b->far;
}
/* Points of the next states, of what is not swept: gaps up to `ways` times the bodies' overlaps. */
perp_status perp__find_overlaps(perp_world *world, double ways);

/* rounds.c */
/* Includes the points that touch, or that the bodies' `moving` twists close; or with `deep` > 0
 * what these take into each other by more than that share of their size. Returns how many. */
int32_t perp__include_points(perp_world *world, double h, double deep);
/* Includes what they make meet, too. Points come to the set, and points of the set become
 * `included` and `fresh`; *came tells how many. Contacts keep numbers, not places in memory. */
perp_status perp__join_contacts(perp_world *world, double h, double deep, int32_t *came);

/* memory.c */
/* Room for so many memories. */
perp_status perp__reserve_memories(perp_world *world, int32_t count);
/* Gives what the pair's points of the first round did not recall to the nearest of them. */
void perp__hand_over(const perp_world *world, const perp__pair *pair);
/* warm, base := what the last step left to the pair's point of that feature, if it did. */
void perp__recall(const perp_world *world, const perp__pair *pair,
                  const perp__world_contact *contact, double *warm, double *base);
/* Gives memories that came with a snapshot, memories_restored, back to their pairs. */
void perp__find_memories(perp_world *world);
/* Where some are `settled`: which bodies are, with all that is near them, what they were when the
 * last step began. */
void perp__note_settled(perp_world *world);
/* Whether the points of a pair are, to the last bit, those that it had then: pair->made; and
 * contact i of the step := point k of them. */
bool perp__stays_same(const perp_world *world, const perp__pair *pair);
void perp__repeat_contact(const perp_world *world, const perp__pair *pair, int32_t k, int32_t i);
/* Keeps the impulses of the step's contacts for the next step's `warm`. */
void perp__remember(perp_world *world);
void perp__write_memory(const perp__contact_set *set, int32_t i, perp__memory *memory);

/* records.c */
void perp__write_record(const perp__contact_set *set, int32_t i, perp_world_contact *record);
/* Contacts of a step come by this number, those of a pair and round one after the other. */
uint64_t perp__contact_order(const perp__world_contact *contact);
/* Makes the records of the last step, unless they are there. */
perp_status perp__write_records(perp_world *world);

/* Rows of the contacts. A contact has the axes (n, t1, t2), right-handed. With r the arm from a
 * body's mass centre to the contact point, the row of axis a is J_B = (a, r_B x a),
 * J_A = -(a, r_A x a). */
/* The row of a gap in the next positions (../projection.c). */
void perp__write_normal(const perp_world *world, const perp__world_contact *contact, double gap,
                        perp__rigid_rows *rows);

/* Tangents for the normal in axes[0]. */
void perp__contact_frame(const perp_world *world, perp__world_contact *contact);

/* The twists of a motion by offset, for functions that take any of them. */
#define PERP__TWIST_START offsetof(perp__motion, start)
#define PERP__TWIST_FREE offsetof(perp__motion, free)
#define PERP__TWIST_MOVING offsetof(perp__motion, moving)
#define PERP__TWIST_AFTER offsetof(perp__motion, after)
#define PERP__TWIST_SHIFT offsetof(perp__motion, shift)

static inline const double *perp__const_twist(const perp__motion *motion, size_t twist)
{
    return (const double *)((const char *)motion + twist);
}

/* Row k of side A or B: relative velocity = J_A twist_A + J_B twist_B. */
static inline void perp__contact_row(const perp__world_contact *contact, int32_t side, int32_t k,
                                     double *row)
{
    perp__copy3(row, contact->axes[k]);
    perp__cross(row + 3, contact->arms[side], contact->axes[k]);
    for (int32_t i = 0; i < 6 && side == 0; i++)
        row[i] = -row[i];
}

/* Relative velocity of the surfaces at the contact, in the world's frame. */
static inline void perp__relative_twist(const perp_world *world, const perp__world_contact *contact,
                                        size_t twist, double *x)
{
    const double *a = perp__const_twist(&world->step.motions[contact->body_a], twist);
    const double *b = perp__const_twist(&world->step.motions[contact->body_b], twist);
    const double *r = contact->arms[0], *s = contact->arms[1];

    x[0] = (b[0] - a[0]) + ((b[4] * s[2] - b[5] * s[1]) - (a[4] * r[2] - a[5] * r[1]));
    x[1] = (b[1] - a[1]) + ((b[5] * s[0] - b[3] * s[2]) - (a[5] * r[0] - a[3] * r[2]));
    x[2] = (b[2] - a[2]) + ((b[3] * s[1] - b[4] * s[0]) - (a[3] * r[1] - a[4] * r[0]));
}

static inline void perp__relative_velocity(const perp_world *world,
                                           const perp__world_contact *contact, size_t twist,
                                           double *u)
{
    double x[3];

    perp__relative_twist(world, contact, twist, x);
    perp__apply3(u, contact->axes[0], x);
}

static inline double perp__normal_velocity(const perp_world *world,
                                           const perp__world_contact *contact, size_t twist)
{
    double x[3];

    perp__relative_twist(world, contact, twist, x);
    return perp__dot3(contact->axes[0], x);
}

#endif
