/* The phases of a step, and what their files give each other. A step goes through
 *
 *   place        rotations, mass matrices and free velocities of the bodies    (motion.c)
 *   contact set  contact points that can close within the step                 (contact_set.c,
 * rounds.c) islands      bodies that touch, directly or through others                 (island.c)
 *   solve        per island: to tol, its impacts where they are        (solve.c, exact.c,
 *                or within the budget of the world's accuracy         impacts.c, sweep.c)
 *   integrate    the next positions                                            (integrate.c)
 *   project      what penetrates is pushed apart                               (projection.c)
 *   commit       next states become states                                        (step.c)
 *   rest         what would repeat itself for ever falls asleep                   (rest.c)
 *
 * within a budget (budget.c), and nothing that a caller can see changes before the commit. Each of
 * them goes through what is awake alone. */
#ifndef PERP_WORLD_STEP_H
#define PERP_WORLD_STEP_H

#include <string.h>

#include "linalg/lanes/multiversion.h"
#include "world/world.h"

/* motion.c */
void perp__rotation_of(const perp_world *world, const perp__state *state, double *R);
void perp__place_shape(const perp__shape *shape, const double *position, const double *R,
                       perp__placed *placed);
/* A body, or all that are awake, with their shapes. */
void perp__place_body(perp_world *world, const perp__state *states, int32_t body);
/* Where the step begins, unless it is so already. */
void perp__keep_placed(perp_world *world, int32_t body);
void perp__place(perp_world *world, const perp__state *states);
/* The twist that forces would give a body, if its inertia is that of a ball; else the velocity. */
void perp__push_freely(const perp_world *world, int32_t body, double h, double *free);
/* A body in place, moving as if nothing touched it. Returns 0 where its numbers are not finite. */
int32_t perp__start_motion(perp_world *world, int32_t body, double h);
/* One step of Euler's equations in the body frame by the implicit midpoint rule: w to w_next. */
void perp__euler_step(const perp__body *body, double h, const double *w, const double *torque,
                      double *w_next);

/* pairs.c */
/* Starts the motions of all that is awake. Pairs for all shapes that are near each other where
 * `placed`, or where `moving` takes them within h; the same after motions of islands changed; for
 * all that are nearer than twice the margin. */
perp_status perp__enclose_motions(perp_world *world, double h);
perp_status perp__enclose_changes(perp_world *world, double h);
perp_status perp__enclose_places(perp_world *world, double margin);
/* Whether the fat boxes of a body hold what a twist makes of it from its state on. */
int32_t perp__stays_enclosed(const perp_world *world, int32_t body, const double *moving, double h);
/* For what is not covered where it is placed: what the motions at hand did not bring there. */
perp_status perp__enclose_strays(perp_world *world);
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
/* Pair i of what is gone through in order, and which is asked of memory meanwhile. */
#define PERP__PAIRS_AHEAD 8
PERP__KERNEL static perp__pair *perp__ordered_pair(const perp_world *world, int32_t i)
{
    if (i + PERP__PAIRS_AHEAD < world->pair_count)
        perp__fetch(&world->pairs[world->pair_order[i + PERP__PAIRS_AHEAD].value],
                    sizeof *world->pairs);
    return &world->pairs[world->pair_order[i].value];
}
/* Whether the body's next state is the one at hand. */
static inline int32_t perp__stays(const perp_world *world, int32_t body)
{
    return memcmp(&world->states[body], &world->next[body], sizeof *world->states) == 0;
}
/* The body, or what is near it, is not what it was in the last step. */
static inline void perp__unsettle(perp_world *world, int32_t body)
{
    if (body >= world->fitted_bodies)
        return;
    world->motions[body].repeats = 0;
    world->motions[body].placed = 0;
}
/* A shape that is about to be removed. */
void perp__forget_shape(perp_world *world, int32_t shape);

/* rest.c */
/* Wakes a body, or one that is new, and all that fell asleep with it; all bodies. */
void perp__rouse(perp_world *world, int32_t body);
void perp__rouse_all(perp_world *world);
/* The body is changed or removed: it wakes, and so does what is near it. */
void perp__disturb(perp_world *world, int32_t body);
/* Takes in what was roused or removed. */
void perp__list_awake(perp_world *world);
/* After a step: what repeated itself falls asleep. */
void perp__fall_asleep(perp_world *world);
/* Frees the kept contacts of a list. */
void perp__drop_kept(perp_world *world, int32_t first);
/* Frees all naps and kept contacts. */
void perp__forget_naps(perp_world *world);
/* The largest residual of what is asleep. */
double perp__asleep_residual(perp_world *world);

/* A gap below this share of the bodies' size is near: such points take part from the start. */
#define PERP__NEAR 1e-3

/* collisions.c */
double perp__pair_rounding(const perp_world *world, const perp__pair *pair);
/* The size of the two bodies. */
double perp__pair_size(const perp_world *world, const perp__pair *pair);
/* Whether the spheres about two shapes are within `margin` of each other; half-spaces are. */
int32_t perp__are_near(const perp_world *world, const perp__pair *pair, double margin);
/* How far a shape has points that turning may move, from its body's mass centre; and what turning
 * adds to the way of those of a body that have them so far, at most. */
double perp__turning_reach(const perp__shape *shape);
static inline double perp__turning(const perp_world *world, int32_t body, double reach, double h)
{
    const double *spin = world->motions[body].moving + 3;

    return h * (fabs(spin[0]) + fabs(spin[1]) + fabs(spin[2])) * reach;
}
/* A shape on the way of its body's motion. */
perp__moving perp__moving_shape(const perp_world *world, int32_t shape, double h);
/* Points of shapes that touch plainly at the start; 0: they don't. Those of half-spaces may be left
 * out from a gap of `far` on. */
int32_t perp__touching_points(const perp_world *world, perp__pair *pair, double h, double far,
                              perp__point *points);
int32_t perp__has_plane(const perp_world *world, const perp__pair *pair);
/* Whether the motion at hand makes the pair meet, and in which points, of the pose at the time of
 * pair->collision. */
int32_t perp__pair_collides(const perp_world *world, perp__pair *pair, double h);
/* Whether it takes a pair that touches deep into each other: what turns comes down on another
 * corner or edge. */
int32_t perp__pair_sinks(const perp_world *world, perp__pair *pair, double h);
int32_t perp__collision_points(const perp_world *world, perp__pair *pair, double h,
                               perp__point *points);

/* contact_set.c */
/* Starts a step's contacts: the points of shapes that touch plainly, none included yet. */
perp_status perp__find_contacts(perp_world *world, double h);
/* Room for so many contacts of a set; a point of a pair, of which there is room; its velocity as if
 * nothing touched; and all of a pair's points that are farther apart than `least` at the start. */
perp_status perp__reserve_contacts(perp_world *world, perp__contact_set *set, int32_t needed);
perp__world_contact *perp__append_contact(const perp_world *world, perp__contact_set *set,
                                          const perp__pair *pair, const perp__point *point);
void perp__prepare_contact(const perp_world *world, perp__world_contact *contact);
perp_status perp__append_points(perp_world *world, perp__pair *pair, const perp__point *points,
                                int32_t count, double least);
/* How far the motion at hand takes any point of a body. */
double perp__longest_displacement(const perp_world *world, int32_t body, double h);
/* What sweeps move they take out of overlaps as well. */
static inline int32_t perp__is_swept(const perp_world *world, const perp__pair *pair)
{
    return world->motions[world->shapes[pair->first].body].verdict.swept ||
           world->motions[world->shapes[pair->second].body].verdict.swept;
}
/* Points with gaps up to `margin` in the next states, of what is not swept. */
perp_status perp__find_overlaps(perp_world *world, double margin);

/* rounds.c */
/* Includes what the bodies' `moving` twists close or make meet: points come to the set, and points
 * of the set become `included` and `fresh`; *came tells how many. Call it until none comes, after
 * each change of `moving`. Contacts keep their numbers, not their places in memory. */
perp_status perp__join_contacts(perp_world *world, double h, int32_t *came);

/* memory.c */
/* Room for so many memories. */
perp_status perp__reserve_memories(perp_world *world, int32_t count);
/* contact->warm := what the last step left to the pair's point of that feature, if it did. */
void perp__recall(const perp_world *world, const perp__pair *pair, perp__world_contact *contact);
/* Gives memories that came with a snapshot back to their pairs. */
void perp__find_memories(perp_world *world);
/* Which bodies are, with all that is near them, what they were when the last step began. */
void perp__note_settled(perp_world *world);
/* Whether the points of a pair are, to the last bit, those that it had then: pair->made; point k of
 * them, and its contact as it comes to the set. */
int32_t perp__stays_same(const perp_world *world, const perp__pair *pair);
void perp__repeat_point(const perp_world *world, const perp__pair *pair, int32_t k,
                        perp__point *point);
void perp__repeat_contact(const perp_world *world, const perp__pair *pair, int32_t k,
                          perp__world_contact *contact);
/* Keeps the impulses of the step's contacts for the next step's `warm`. */
void perp__remember(perp_world *world);
void perp__write_memory(const perp__world_contact *contact, perp__memory *memory);

/* How many bodies are in islands: the first ones of body_order. */
static inline int32_t perp__count_members(const perp_world *world)
{
    const perp__island *last = world->islands + world->island_count - 1;

    return world->island_count > 0 ? last->first_body + last->bodies : 0;
}

/* island.c: islands of the dynamic bodies that the set's included contacts join. */
perp_status perp__build_islands(perp_world *world, const perp__contact_set *set);

static inline perp__motion *perp__island_motion(const perp_world *world, const perp__island *island,
                                                int32_t i)
{
    return &world->motions[world->body_order[island->first_body + i]];
}

static inline perp__world_contact *perp__island_contact(const perp_world *world,
                                                        const perp__contact_set *set,
                                                        const perp__island *island, int32_t i)
{
    return &set->contacts[world->contact_order[island->first_contact + i]];
}

static inline perp__tie *perp__step_tie(const perp_world *world, const perp__island *island,
                                        int32_t i)
{
    return &world->contacts.ties[world->contact_order[island->first_contact + i]];
}

/* One of the step's contacts. */
static inline perp__world_contact *perp__step_contact(const perp_world *world,
                                                      const perp__island *island, int32_t i)
{
    return perp__island_contact(world, &world->contacts, island, i);
}

/* budget.c */
void perp__open_budget(perp_world *world);
/* The share of what is left of it that velocities may have. */
void perp__open_velocities(perp_world *world);
int32_t perp__is_budget_spent(const perp_world *world);
/* When an island has to be done, by its share of the contacts that are left; 0 without a limit. */
double perp__island_deadline(const perp_world *world, const perp__island *island);
void perp__spend(perp_world *world, int64_t iterations);
/* For a method: 0 without a limit, else at least 1. */
int32_t perp__iterations_left(const perp_world *world);

/* solve.c */
typedef struct perp__solve_summary {
    perp_outcome outcome;
    double residual;
    int32_t solved;  /* islands that needed a solve */
    int32_t impacts; /* and those with impacts */
    int32_t rough;   /* of those with joints */
} perp__solve_summary;

perp_status perp__solve_islands(perp_world *world, double h, perp__solve_summary *summary);
/* An island to which contacts came, or joints, and that writes to nothing but what is its own; or,
 * none having come to any, the end of one that is swept so far: then *open := 1. */
perp_status perp__solve_one(perp_world *world, const perp__island *island, double h,
                            int32_t finishes, int32_t *open);

/* problem.c */
/* Makes the workspace fit the largest island. */
perp_status perp__fit_island_work(perp_world *world);
/* The coordinates of a twist, and back; C with M^-1 = C C', row-major. */
void perp__coordinates_of(const perp_world *world, const double *twist, double *x);
void perp__twist_of(const perp_world *world, const double *x, double *twist);
void perp__write_factor(const perp_world *world, int32_t body, const double *R, double *C);
/* What is not told apart from 0 is 0. */
double perp__open_gap(const perp__world_contact *contact, double gap);
/* The number of what a row is on: a body of the island, one that moves as it is told, or what
 * rests. */
int32_t perp__number_of(perp_world *world, const perp__island *island, int32_t body);
/* Before an island is numbered. */
void perp__forget_number(perp_world *world, int32_t body);
/* |C^-1 v| of a body: half its square is the kinetic energy; |C'J'| of a row of it. */
double perp__mass_norm(const perp_world *world, int32_t body, const double *v);
double perp__row_norm(const perp_world *world, int32_t body, const double *row);
/* Bodies and carriers of an island, where they are and how they start. */
void perp__gather_bodies(perp_world *world, const perp__island *island);
/* Rows of the contacts that take part: those not left out; NULL: all. */
void perp__choose_rows(perp_world *world, const perp__island *island, const int8_t *leaves_out);
/* The problem of the chosen rows with work.free, and where its answer goes. */
void perp__pose_island(perp_world *world, const perp__island *island, perp__rigid_problem *problem);
void perp__receive(perp_world *world, perp__rigid_answer *answer);
/* Adds to the impulse of the island's contact i; adds those of the answer, and takes its modes. */
void perp__add_impulse(perp_world *world, const perp__island *island, int32_t i,
                       const double *impulse, double share);
void perp__take_answer(perp_world *world, const perp__island *island);
/* work.moving := the way so far over h. */
void perp__mean_motion(perp_world *world, const perp__island *island, double h);
/* The twists of the island's bodies, from work.moving and work.now. */
void perp__write_twists(perp_world *world, const perp__island *island);
/* Relative velocities of the contacts solved, after the step. What a contact holds is exact: its
 * bias and no more. */
void perp__write_velocities(perp_world *world, const perp__island *island);

/* exact.c */
/* What is solved exactly is so to the first; what is not, for want of time or of a method that can,
 * is judged by the second. */
double perp__exact_tol(const perp_world *world);
double perp__swept_tol(const perp_world *world);
/* Solves it to the world's tol, or as far as the budget goes. bounces: with restitution. */
perp_status perp__solve_rows(perp_world *world, const perp__island *island, int32_t bounces,
                             perp__verdict *verdict);

/* hold.c */
/* Velocities in what the rows that hold leave free, where they are an answer to tol as well: then
 * answer->held. */
perp_status perp__hold_island(perp_world *world, const perp__island *island,
                              perp__rigid_answer *answer, const perp__rigid_problem *problem,
                              double tol);
/* Whether all of an island is at rest, and nothing that moves as it is told is next to it. */
int32_t perp__begins_at_rest(const perp_world *world, const perp__island *island);
/* Writes the velocities of what rests as 0.0, where the impulses at hand leave it so to tol, beside
 * each body's own terms; returns whether. *change: what is left, beside these. */
int32_t perp__rest_island(perp_world *world, const perp__island *island, double tol,
                          double *change);

/* statics.c: the impulses of what sticks become the nearest ones that hold the island at rest,
 * where there are any; work.v, what they leave of it. */
void perp__balance_island(perp_world *world, const perp__island *island);
/* Whether impulses near those of a pile hold it at rest, to rounding and within their cones: then
 * these are its answer, and *left what they leave of a body's terms. */
int32_t perp__balance_pile(perp_world *world, const perp__island *island, double *left);

/* impacts.c: an island solved to tol. */
perp_status perp__follow_island(perp_world *world, const perp__island *island, double h,
                                perp__verdict *verdict);
/* work.free := now + share of what forces add. */
void perp__force_bodies(perp_world *world, const perp__island *island, double share);
/* Size of the terms of a normal velocity: of the chosen contact i, with numbers x of bodies. */
double perp__normal_terms(const perp_world *world, int32_t i, const double *x, int32_t bodies);

/* What forces make of the normal velocity of the chosen contact i in a step, or of its bodies where
 * the island lies on something. */
double perp__forced_speed(const perp_world *world, int32_t i, int32_t bodies, int32_t lies);
int32_t perp__lies_on_something(const perp_world *world, const perp__island *island);

/* lying.c: whether the island begins at rest, and the impulses of the last step leave it so, to
 * rounding beside the terms of each body; then that is its motion. */
int32_t perp__lies_still(perp_world *world, const perp__island *island, perp__verdict *verdict);

/* near.c: sweeps near the contacts that came to an island whose motion is known. */
perp_status perp__sweep_near(perp_world *world, const perp__island *island, double h);

/* sweep.c: an island within the budget of the world's accuracy: its motion, from the impulses that
 * it has; and once no more contacts come the velocities at its end, and what they are worth. */
perp_status perp__sweep_island(perp_world *world, const perp__island *island, double h,
                               perp__verdict *verdict);
perp_status perp__finish_swept(perp_world *world, const perp__island *island, double h,
                               perp__verdict *verdict);
/* What moves heavily over what moves lightly: a mass, or the inertia about some axis beside the
 * body's size. */
double perp__mass_ratio(const perp_world *world, const perp__island *island);
/* Whether sweeps take the overlap out of what rests. */
int32_t perp__is_deep(const perp__world_contact *contact);
/* Whether an exact solution costs no more, or nothing less will do. */
int32_t perp__is_worth_exact(const perp_world *world, const perp__island *island);
/* Whether it costs so little that it may be done whenever a contact comes. */
int32_t perp__is_small(const perp_world *world, const perp__island *island);
/* Whether the chosen contacts come from rest, but for what forces do in a few steps. */
int32_t perp__comes_from_rest(const perp_world *world, const perp__island *island);

/* integrate.c */
/* The next states, and all that overlaps are looked for in is placed there. Returns a body whose
 * numbers are not finite, or -1. */
int32_t perp__integrate(perp_world *world, double h);
/* The same for a ball, or what turns like one, that stays in its fat boxes: of its motion nothing
 * else is made, as long as it coasts. Returns 0 where that is not so. */
int32_t perp__glide(perp_world *world, int32_t body, double h);
/* Takes a body that is near nothing and moves on to its next state at once: no one has to look at
 * it again in the step. Returns 0 where its numbers are not finite. */
int32_t perp__coast(perp_world *world, int32_t body, double h);
/* Takes it back, if it did; all of them. */
void perp__stop_coasting(perp_world *world, int32_t body);
void perp__stop_all_coasting(perp_world *world);
int32_t perp__find_infinite(const perp_world *world);
void perp__turn(const perp_world *world, perp__state *state, const double *turn);

/* energy.c */
/* What the step took from a body, with the work of forces: from its state to the next one. */
double perp__energy_lost(const perp_world *world, int32_t body);
/* What it takes to shift it by a small twist against forces. */
double perp__work_needed(const perp_world *world, int32_t body, const double *shift);

/* projection.c */
/* *changed: next states are others. */
perp_status perp__project_overlaps(perp_world *world, int32_t *changed);

/* records.c */
void perp__write_record(const perp__world_contact *contact, perp_world_contact *record);
/* Contacts of a step come by this number, those of a pair and round one after the other. */
uint64_t perp__contact_order(const perp__world_contact *contact);
/* Makes the records of the last step, unless they are there. */
perp_status perp__write_records(perp_world *world);

/* snapshot.c: all that the next step reads, as bytes. */
size_t perp__snapshot_bytes(const perp_world *world);
void perp__snapshot_write(const perp_world *world, char *blob);
perp_status perp__snapshot_read(perp_world *world, const char *blob);

/* adaptive.c: a caller's step, in steps chosen by settings.error if that is not 0. */
perp_status perp__advance_world(perp_world *world, perp_step_result *result, double dt);

/* step.c: one step, within the budget that is open; or none, where that would be rough, as
 * world->rough says then, and world->divides. */
perp_status perp__step(perp_world *world, perp_step_result *result, double h);

#endif
