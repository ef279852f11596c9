/* Islands of a step: what touches, directly or through others, and the velocities it gets. */
#ifndef PERP_WORLD_ISLANDS_H
#define PERP_WORLD_ISLANDS_H

#include "linalg/spatial.h"
#include "world/world.h"

/* How many bodies are in islands: the first ones of body_order. */
static inline int32_t perp__count_members(const perp_world *world)
{
    const perp__island *last = world->islands.all + world->islands.count - 1;

    return world->islands.count > 0 ? last->first_body + last->bodies : 0;
}

/* island.c: islands of the dynamic bodies that the set's included contacts join; `pressing`: those
 * that impulses, or ways that close joints, press. */
perp_status perp__build_islands(perp_world *world, const perp__contact_set *set, bool pressing);

static inline perp__motion *perp__island_motion(const perp_world *world, const perp__island *island,
                                                int32_t i)
{
    return &world->step.motions[world->islands.body_order[island->first_body + i]];
}

/* Contact i of an island, of the set that joins it: the step's, but for the projection. */
static inline perp__world_contact *perp__step_contact(const perp_world *world,
                                                      const perp__island *island, int32_t i)
{
    return &world->islands.set->contacts[world->islands.contact_order[island->first_contact + i]];
}

static inline perp__contact_flags *perp__step_flags(const perp_world *world,
                                                    const perp__island *island, int32_t i)
{
    return &world->islands.set->flags[world->islands.contact_order[island->first_contact + i]];
}

/* The bodies that contacts, and after them joints, tie, two of each; without joints, and where it
 * is one in all of them, or none, just that which is not dynamic. */
static inline int32_t perp__count_ties(const perp__island *island)
{
    return island->joints == 0 && island->ties < 2 ? island->ties
                                                   : 2 * (island->contacts + island->joints);
}

static inline int32_t perp__tie(const perp_world *world, const perp__island *island, int32_t k)
{
    const int32_t i = k / 2, joint = i - island->contacts;

    if (island->joints == 0 && island->ties < 2)
        return island->tied;
    return joint < 0 ? perp__step_flags(world, island, i)->body[k % 2]
                     : world->joints.all[world->islands.joint_order[island->first_joint + joint]]
                           .body[k % 2];
}

/* Whether callers put one of its bodies deep into others: the projection parts all of it then. */
static inline bool perp__has_put(const perp_world *world, const perp__island *island)
{
    bool put = 0;

    for (int32_t i = 0; i < island->bodies && !put; i++)
        put = world->step.roles[world->islands.body_order[island->first_body + i]].put != 0;
    return put;
}

static inline perp__response *perp__step_response(const perp_world *world,
                                                  const perp__island *island, int32_t i)
{
    return &world->contacts.now.responses[world->islands.contact_order[island->first_contact + i]];
}

static inline bool perp__is_finite_contact(const perp__contact_set *set, int32_t i)
{
    const perp__world_contact *contact = &set->contacts[i];
    const perp__response *response = &set->responses[i];

    return perp__is_finite3(contact->position) && perp__is_finite3(contact->axes[0]) &&
           0.0 * contact->gap + 0.0 * contact->free == 0.0 && perp__is_finite3(response->impulse) &&
           perp__is_finite3(response->velocity);
}

/* budget.c */
/* What a level of accuracy gives: how often all that the motion makes meet joins in, and it is
 * found anew; how deep it may take bodies into each other then, beside their size, before what
 * meets there joins in as well; the residual that counts as an answer of a sweep; whether a few
 * bodies are swept, too; contacts up to which exact methods go on where it came to none; rounds of
 * placing joints. */
typedef struct perp__level {
    int32_t looks;
    double deep, tol;
    int32_t sweeps_few, few, rounds;
} perp__level;
extern const perp__level perp__levels[]; /* by accuracy */
/* Whether all that is swept is a sketch, as at level `accurate`. */
static inline bool perp__is_sketch(const perp_world *world)
{
    return world->step.sketches && world->settings.accuracy == PERP_ACCURACY_EXACT;
}
const perp__level *perp__level_of(const perp_world *world);
void perp__open_budget(perp_world *world);
/* The share of what is left of it that velocities may have. */
void perp__open_velocities(perp_world *world);
bool perp__is_budget_spent(const perp_world *world);
bool perp__is_time_over(const perp_world *world); /* the step's time is over */
/* When an island has to be done, by its share of the contacts that are left; 0 without a limit. */
double perp__island_deadline(const perp_world *world, const perp__island *island);
void perp__spend(perp_world *world, int64_t iterations);
/* For a method: 0 without a limit, else at least 1. */
int32_t perp__iterations_left(const perp_world *world);

/* solve.c */
typedef struct perp__solve_summary {
    perp_outcome outcome;
    double residual;
    int32_t solved;   /* islands that needed a solve */
    int32_t impacts;  /* and those with impacts */
    int32_t rough;    /* of those with joints */
    int32_t endless;  /* contacts that are not finite */
    int32_t sketched; /* islands that are to be solved yet */
} perp__solve_summary;
/* Whether that is given up, for more parts of the step. */
bool perp__takes_parts(const perp_world *world, const perp__solve_summary *summary);

perp_status perp__solve_islands(perp_world *world, double h, perp__solve_summary *summary);
/* An island by its number, to which contacts came, or joints; it writes to nothing but what is its
 * own. It may wait to be swept beside others (lanes.h), up to perp__end_solving. *last: the first
 * island that ended the work, a failure or a ray; unchanged where there is none. */
perp_status perp__solve_one(perp_world *world, int32_t number, double h, int32_t *last);
perp_status perp__end_solving(perp_world *world, double h, perp_status status, int32_t *last);
/* What sweeps came to, or the exact solution where that is no answer, or nearly rest. */
perp_status perp__keep_sweep(perp_world *world, const perp__island *island, double h,
                             const perp__verdict *before, perp__verdict *verdict);
/* What is known of an island now, solved with that status, for its bodies and *last. */
void perp__conclude_one(perp_world *world, int32_t number, double h, perp__verdict *verdict,
                        perp_status status, int32_t *last);
/* Whether nothing but forces moves a body, be there contacts beside it or not. */
bool perp__goes_freely(const perp_world *world, int32_t body);

/* problem.c */
/* Makes the workspace fit the largest island; or as many contacts with joints' units, and bodies
 * with what moves as it is told. */
perp_status perp__fit_island_work(perp_world *world);
perp_status perp__fit_work(perp_world *world, int32_t contacts, int32_t bodies, int32_t jointed);
/* The coordinates of a twist, and back; C with M^-1 = C C', row-major. */
void perp__coordinates_of(const perp_world *world, const double *twist, double *x);
void perp__twist_of(const perp_world *world, const double *x, double *twist);
void perp__write_factor(const perp_world *world, int32_t body, const double *R, double *C);
/* What is not told apart from 0 is 0. */
double perp__open_gap(const perp__world_contact *contact, double gap);
double perp__closed_gap(const perp_world *world, const perp__world_contact *contact);
double perp__left_gap(const perp_world *world, const perp__world_contact *contact);
/* The number of what a row is on: a body of the island, one that moves as told, or what rests. */
int32_t perp__number_of(perp_world *world, const perp__island *island, int32_t body);
/* |C^-1 v| of a body: half its square is the kinetic energy. */
double perp__mass_norm(const perp_world *world, int32_t body, const double *v);
/* J M^-1 J' of row k: what an impulse of 1 along it makes of its velocity. */
double perp__moved_by(const perp_world *world, const perp__island *island,
                      const perp__rigid_rows *rows, int32_t k);
/* Bodies and carriers of an island, where they are and how they start. */
void perp__gather_bodies(perp_world *world, const perp__island *island);
/* Rows of the contacts that take part: those not left out; NULL: all. */
void perp__choose_rows(perp_world *world, const perp__island *island, const int8_t *leaves_out);
/* along.c: arms of a contact with this gap go to one point, the gap aside, where bodies are now. */
void perp__meet_now(const perp_world *world, perp__world_contact *contact, double gap);
/* along.c: a contact's rows along its interval; and adds what they change by to all biases. */
void perp__turn_contact(perp_world *world, const perp__island *island,
                        const perp__world_contact *contact);
void perp__turn_contacts(perp_world *world);
/* What row k of unit i makes of velocities x, and where `carried` of what moves as it is told. */
double perp__row_velocity(const perp_world *world, int32_t i, int32_t k, const double *x,
                          int32_t bodies, bool carried);
/* The problem of the chosen rows with work.free, and where its answer goes. */
void perp__pose_island(perp_world *world, const perp__island *island, perp__rigid_problem *problem);
void perp__receive(perp_world *world, perp__rigid_answer *answer);
/* The chosen contact's impulse along the axes of the step's beginning: rows turn with joints. */
void perp__tell_contact(const perp_world *world, const perp__island *island, int32_t i,
                        double *impulse);
/* Adds the impulses of the answer, and takes its modes. */
void perp__take_answer(perp_world *world, const perp__island *island);
/* The twists of the island's bodies, from work.moving and work.now. */
void perp__write_twists(perp_world *world, const perp__island *island);
/* Relative velocities of solved contacts after the step; what holds has exactly its bias. */
void perp__write_velocities(perp_world *world, const perp__island *island);

/* exact.c */
/* What is solved exactly is so to the first; what is not, for want of time or of a method that can,
 * is judged by the second. */
double perp__exact_tol(const perp_world *world);
double perp__swept_tol(const perp_world *world);
/* Solves it to the world's tol, or as far as the budget goes. bounces: with restitution. */
perp_status perp__solve_rows(perp_world *world, const perp__island *island, bool bounces,
                             perp__verdict *verdict);

/* The sizes of the terms that each body's velocity is made of. */
void perp__find_strengths(const perp_world *world, const perp__island *island, double *strength);
/* impacts.c: an island solved to tol. */
perp_status perp__follow_island(perp_world *world, const perp__island *island, double h,
                                perp__verdict *verdict);
/* work.moving: what positions move with over all of an interval, from work.now to work.v: the mean
 * of both where what presses did so from the start, as velocities known to tol tell, else what is
 * there at the end. */
void perp__move_bodies(perp_world *world, const perp__island *island, double tol);
/* Whether the first `units` rows, but for motors, do more work on the island's bodies from work.now
 * to work.v, u beside what moves as it is told, than that share of its terms, which may cancel. */
bool perp__gives_energy(const perp_world *world, const perp__island *island, int32_t units,
                        double tol);
/* Whether Moreau's law gave energy so, as with friction or several contacts it can: then it is to
 * be done again with less of the restitution, in the end none, which never does. */
bool perp__lessens(const perp_world *world, const perp__island *island, double tol,
                   double *restitution);
/* work.free := now + share of what forces add. */
void perp__force_bodies(perp_world *world, const perp__island *island, double share);

/* Size of the terms of the first velocity of unit i, with numbers x of bodies. */
double perp__normal_terms(const perp_world *world, int32_t i, const double *x, int32_t bodies);
/* What forces make of the normal velocity of the chosen contact i in a step; where the island lies
 * on something, of its bodies in any way, as others press them there: half of it and of that. */
double perp__forced_speed(const perp_world *world, const perp__island *island, int32_t i,
                          bool lies);
bool perp__lies_on_something(const perp_world *world, const perp__island *island);

/* sweep.c: an island within the budget of the world's accuracy, from the impulses that it has. Of
 * one with joints the equations hold to rounding; begin_joints() comes first. */
perp_status perp__sweep_island(perp_world *world, const perp__island *island, double h,
                               perp__verdict *verdict);
/* Biases of a step of length h: what gaps leave. */
void perp__close_gaps(perp_world *world, const perp__island *island, double h);
/* The overlap from which on it is deep: so sweeps of an island take it out of what rests, too. */
double perp__deep_overlap(const perp__world_contact *contact);
bool perp__is_deep(const perp__world_contact *contact);
/* Whether an exact solution costs no more than sweeps, or nothing less will do; and whether an
 * island has so many contacts at most: a joint is as many rows as two. */
bool perp__is_worth_exact(const perp_world *world, const perp__island *island);
bool perp__is_few(const perp_world *world, const perp__island *island, int32_t most);

/* carried.c, standing.c: what can rest, rests (perp/statics.h): an island whose bodies have the
 * motion of what carries them keeps it where impulses within all cones make the forces do that. */

/* Factors of the islands that stood last: one costs a factorisation to make anew, and its key is
 * made of all that goes into it, so that which of them are here changes no bit. */
enum { PERP__STANDING_KEPT = 8, PERP__STANDING_WORDS = 4 };

typedef struct perp__standing {
    perp__statics *statics[PERP__STANDING_KEPT];
    uint64_t key[PERP__STANDING_KEPT][PERP__STANDING_WORDS]; /* 0: none */
    uint64_t used[PERP__STANDING_KEPT], clock;
    int32_t last; /* the one that was asked for last */
} perp__standing;

void perp__standing_release(perp__standing *standing);

/* A motion that an island may keep. */
enum {
    PERP__CARRIED_AT_REST, /* beside static bodies, or nothing */
    PERP__CARRIED_ALONG,   /* as one with `body`, which is kinematic */
    PERP__CARRIED_ON,      /* as it began the step */
    PERP__CARRIED_PARTLY   /* at rest, but for what moves */
};

typedef struct perp__carrying {
    int32_t motion, body;
    int32_t parts; /* it has to part from what moves otherwise */
} perp__carrying;

/* The common motion of all static and kinematic bodies that an island touches or is joined with;
 * carrying->body is -1 where there is none. Returns 0 where they move differently; `moving`: where
 * all are at rest, and others than the first that is not may move as they like. */
bool perp__find_carrying(const perp_world *world, const perp__island *island, int32_t moving,
                         perp__carrying *carrying);
bool perp__moves_with(const perp_world *world, const perp__carrying *carrying, int32_t body);
/* Its velocity: seen from there it does no work. Returns 0 where it turns or there is none. */
bool perp__find_frame(const perp_world *world, const perp__island *island, double *frame);
/* The twist that a body of the island has at a time t of the step if it keeps that motion; before
 * it, t < 0, if it had it in the last one. */
void perp__carried_twist(const perp_world *world, const perp__carrying *carrying, int32_t body,
                         double t, double *twist);
/* Bodies of an island that stands go in a step of h where a carrier that turns takes them. */
void perp__ride(perp_world *world, const perp__island *island, double h);
/* Whether there is a motion that the island may keep: that of what carries it, where all bodies
 * begin with it, or with the one that this had in the last step, `slowly` nearly so; or the one
 * that it has, where contacts with friction do not slide and none opens or closes. */
bool perp__begins_standing(const perp_world *world, const perp__island *island, bool slowly,
                           perp__carrying *carrying);

/* The same impulses as in the last step, or what other forces make of those that were decided:
 * whether they leave an island at rest to rounding beside the terms of each body. Then
 * verdict->stands is 1, and that is its motion. swept: not what is deep, which sweeps take out.
 * Without joints; work is that of another problem then. PERP_OK or _MEMORY. */
perp_status perp__lie_still(perp_world *world, const perp__island *island, bool swept,
                            perp__verdict *verdict);
/* The second of these: contacts' `next` and *unbalance are written where it stands. */
perp_status perp__stand_as_decided(perp_world *world, const perp__island *island,
                                   const perp__carrying *carrying, bool swept, double *unbalance);

/* What takes a body in a time t from the twist `now`, where it would have `free` alone, to the
 * carried one, as force[6]: an impulse, and an angular one over the body's length. */
void perp__find_force(const perp_world *world, const perp__carrying *carrying, int32_t body,
                      double t, const double *now, const double *free, double *force);
/* A length of a body, of its inertia: what turns are taken times. */
double perp__body_length(const perp_world *world, int32_t body);
/* work.stand_rows: the rows of work as statics has them, without those of what bodies part from
 * that move by work.still with `carrying`, which may be NULL. Returns 0 where one makes its bodies
 * move otherwise, whatever the forces; speeds of motors are not looked at where `ignores` is 1. */
bool perp__gather_standing(perp_world *world, const perp__island *island,
                           const perp__carrying *carrying, bool ignores);

/* Whether the rows of work, over an interval whose velocities would be work.free without impulses,
 * can stand with the bodies in that motion, NULL: the one that they begin with, if there is one:
 * verdict->stands. Then work has the answer. */
perp_status perp__stand(perp_world *world, const perp__island *island,
                        const perp__carrying *carrying, perp__verdict *verdict);
/* The same of those bodies that began at rest, beside others that move with work.v and press on
 * them with work.impulse, whose laws hold so to the level's tol or *residual: work has it then. */
perp_status perp__stand_partly(perp_world *world, const perp__island *island, bool swept,
                               double *residual);

#endif
