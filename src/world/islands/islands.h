/* Islands of a step: what touches, directly or through others, and the velocities it gets. */
#ifndef PERP_WORLD_ISLANDS_H
#define PERP_WORLD_ISLANDS_H

#include "linalg/spatial.h"
#include "world/world.h"

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

static inline perp__response *perp__step_response(const perp_world *world,
                                                  const perp__island *island, int32_t i)
{
    return &world->contacts.responses[world->contact_order[island->first_contact + i]];
}

static inline int32_t perp__is_finite_contact(const perp__contact_set *set, int32_t i)
{
    const perp__world_contact *contact = &set->contacts[i];
    const perp__response *response = &set->responses[i];

    return perp__is_finite3(contact->position) && perp__is_finite3(contact->axes[0]) &&
           0.0 * contact->gap + 0.0 * contact->free == 0.0 && perp__is_finite3(response->impulse) &&
           perp__is_finite3(response->velocity);
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
    int32_t endless; /* contacts that are not finite */
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

/* near.c: sweeps near the contacts that came to an island whose motion is known. */
perp_status perp__sweep_near(perp_world *world, const perp__island *island, double h);

/* energy.c: takes what impulses and ways have too much. Returns whether there is less of impulses.
 */
int32_t perp__take_energy(perp_world *world, const perp__island *island, double h);

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

#endif
