/* What joints do for the files of the world: their rows in an island's problem, their errors in the
 * projection, and who they keep awake or apart. */
#ifndef PERP_WORLD_JOINTS_H
#define PERP_WORLD_JOINTS_H

#include "world/step.h"

#include <string.h>

/* joint.c */
/* Whether joints keep two bodies from touching each other: one that joins them, or fixed ones in a
 * chain, which leave a contact nothing to do. */
bool perp__joint_parts(const perp_world *world, int32_t a, int32_t b);
/* The clusters of bodies, of the fixed joints that there are. */
void perp__find_clusters(perp_world *world);
void perp__remove_joints(perp_world *world, int32_t body);
/* Rouses what joints hold to a body. */
void perp__rouse_joined(perp_world *world, int32_t body);
/* Whether the joint in a slot takes part in steps: one of its bodies is awake. */
bool perp__joint_works(const perp_world *world, int32_t i);
void perp__view_of_states(const perp_world *world, const perp__joint *joint,
                          const perp__state *states, double before, bool equations,
                          perp__joint_view *view);

static inline perp__joint *perp__island_joint(const perp_world *world, const perp__island *island,
                                              int32_t i)
{
    return &world->joints.all[world->islands.joint_order[island->first_joint + i]];
}
static inline perp__joint_state *perp__state_of(const perp_world *world, const perp__joint *joint)
{
    return &world->joints.states[joint - world->joints.all];
}

/* rows.c: before: the coordinate of a moment before, from which turns are counted; without its
 * equations where the coordinate is all that is asked for. */
void perp__view_joint(const perp_world *world, const perp__joint *joint, double before,
                      const perp__path *const paths[2], bool equations, perp__joint_view *view);
/* The same where both bodies are. */
void perp__view_placed(const perp_world *world, const perp__joint *joint, double before,
                       const perp__placement places[2], bool equations, perp__joint_view *view);
bool perp__joint_has_coordinate(int32_t kind);
/* Whether the first three equations are along the axes of space. */
bool perp__has_space_axes(int32_t kind);
/* Whether error i is a length, else an angle. */
bool perp__is_length(const perp_world *world, const perp__joint *joint, int32_t i);

/* trial.c */
/* Before an island with joints goes through a step of length h: the motion at hand is one of it,
 * with these contacts or fewer, where `known`. */
void perp__begin_joints(perp_world *world, const perp__island *island, double h, bool known);
/* From here on the joints' poses are to be those of the velocities now. */
void perp__aim_joints(perp_world *world, const perp__island *island);
/* How far limits are at the beginning of an interval, and which are reached; where `ahead` is not 0
 * those as well that twice the velocity now may reach after it, and a quarter of a radian more: so
 * that one solve is enough. */
void perp__find_limits(perp_world *world, const perp__island *island, double ahead);
/* Joints along an interval of length t, inertia at its end, by the motion found so far; t = 0:
 * where they are. */
void perp__place_joints(perp_world *world, const perp__island *island, double t);
/* The turn that two bodies have in common: of all between their turns the least. What turns as one
 * takes its contacts along, a wheel's stays below it, and that of gears between them. */
void perp__common_turn(double *turn, const double *a, const double *b);
/* The twist of a body as the interval at hand begins. */
void perp__twist_now(const perp_world *world, int32_t body, double *twist);
/* The paths of that motion alone. */
void perp__find_paths(perp_world *world, const perp__island *island, double t);
/* Whether the interval is to be solved again, by the motion work.moving and work.v it led to. */
enum { PERP__TRIED = 18 }; /* numbers a body and round: 6 that its trial missed, 12 it led to */
typedef struct perp__rounds {
    int32_t most;        /* rounds to come to a motion that settles */
    int32_t done, extra; /* with all limits; and until these were reached */
    int32_t coarse;      /* rows are those of the interval's beginning */
    double change, turn; /* of the last one */
    double first,
        earlier;   /* change, of the first with all limits, and of the one before the last */
    double swerve; /* of the change, what is an angle */
    int32_t parts; /* they come to no motion: the interval is too long */
} perp__rounds;
int32_t perp__goes_round(perp_world *world, const perp__island *island, double t,
                         perp__rounds *rounds);
/* Joints are to be where the interval begins. */
void perp__stop_trial(perp_world *world, const perp__island *island);
/* Whether joints turn too far in the interval: by about a radian, or so that rounds do not settle;
 * sweeps have one, and then the rows of the beginning, of first order. */
bool perp__is_rough(const perp__rounds *rounds);

/* swing.c */
/* Whether nothing but joints acts, no limit is reached, and nothing drives them. */
bool perp__swings(const perp_world *world, const perp__island *island);
/* The mean of both ends' velocities, as bodies see it: of `now` and `v`. */
void perp__mean_of_ends(perp_world *world, const perp__island *island);
/* The velocities to which that leads; once its path is known, as they are at its end. */
perp_status perp__swing(perp_world *world, const perp__island *island, perp__verdict *verdict);
void perp__end_swing(perp_world *world, const perp__island *island, double t,
                     perp__verdict *verdict);

/* work.v := the velocities next to work.free, in the metric of M, that meet all units at hand,
 * which are equations but for contacts that closing holds; work.impulse: their impulses. The first
 * pass is their answer, as many more at most take what its rounding left. *residual: what rows lack
 * beside their terms; NULL: not asked for. */
#define PERP__REFINED 64
perp_status perp__solve_equations(perp_world *world, const perp__island *island, int32_t passes,
                                  double *residual);

/* The velocities of rows that are all of joints; *found: 0 where contacts are, or where exchanges
 * come to no end. */
perp_status perp__solve_bounds(perp_world *world, const perp__island *island,
                               perp__verdict *verdict, int32_t *found);

/* step.c */
/* They have no impulses yet. */
void perp__clear_joints(perp_world *world, const perp__island *island);
/* work.parts: a forest of the bodies that joints join, by way of what impulses do not move as well.
 * Returns whether some are joined twice: in a tree no row says what others do. */
int32_t perp__join_parts(const perp_world *world, const perp__island *island);
/* Which equations say what others do as the step begins: these take no part. PERP_OK, _MEMORY. */
perp_status perp__find_spare_rows(perp_world *world, const perp__island *island);
/* The joints' units after those of the contacts; and the bounds of an interval of length t. */
void perp__add_joint_rows(perp_world *world, const perp__island *island);
void perp__time_joints(perp_world *world, double t);
/* impulse: of the joints' units, 3 each. */
void perp__add_joint_impulses(perp_world *world, const double *impulse, double share);
/* Adds an impulse along the view's row of a slot to what a joint tells of momentum. */
void perp__tell_impulse(perp__joint *joint, const perp__joint_view *view, int32_t slot, double r);
/* Whether limits that press did so from the start. */
bool perp__limits_last(const perp_world *world);
/* Refuses next states between which a joint's coordinate is no number. */
perp_status perp__check_joints(const perp_world *world);
/* What the step made of joints becomes their last one's. */
void perp__keep_joints(perp_world *world);
/* Rows of all joints, those asleep too. */
int32_t perp__count_joint_rows(const perp_world *world);
/* Joins the parts of joined bodies in world->islands.parent, and notes that these are jointed. */
void perp__join_joined(perp_world *world);
/* For rest.c: what may not sleep for its joints is not calm. */
void perp__upset_joints(perp_world *world);

/* Whether its limits are equal. */
static inline bool perp__is_locked(const perp__joint_state *state)
{
    return state->lower == state->upper;
}
/* A distance of 0 has no direction. */
bool perp__has_direction(const perp__joint_view *view);

/* projection.c, of the next states */
/* Takes what joints lack out of the positions of the step's islands, while these are there, and
 * lets no island gain energy, also one of contacts alone. *changed: next states are others. */
perp_status perp__end_islands(perp_world *world, int32_t *changed);

/* Beyond the work of forces, as what it is tied to sees it; -INFINITY where that is several. */
double perp__energy_gained(const perp_world *world, const perp__island *island, double *rounding);
/* The same beyond what motors can do, and of what is left of that what is not rounding. */
double perp__energy_given(const perp_world *world, const perp__island *island);
/* Energy that was given goes whence it came: from turns, and where contacts alone act from ways,
 * friction where slips turn round, all impulses, all ways, and all that turns. So momentum is that
 * of the impulses that are told. Returns what is left. */
double perp__take_given(perp_world *world, const perp__island *island, double given);
/* The same from what turns gave, or all that turns, each body's share from its own. */
double perp__take_turns(perp_world *world, const perp__island *island, double given, bool all);
/* The kinetic energy beside that of a velocity. */
double perp__kinetic_beside(const perp_world *world, const perp__island *island, const double *v);
/* What ways left by their turns; with no more energy than `gained` and what the step left. */
perp_status perp__close_joints(perp_world *world, const perp__island *island, double gained);
/* The sum of what joints lack, as lengths, 0 where that is rounding; and of an island. */
double perp__joint_errors(const perp_world *world);
double perp__island_errors(const perp_world *world, const perp__island *island);
/* A row of the next positions, its sign and what it lacks. */
void perp__write_row(const perp_world *world, const int32_t body[2], const double row[2][6],
                     double error, double sign, perp__rigid_rows *rows);
/* Rows of what: limits, what lacks, both, velocities along them, these but for repeats. */
typedef enum perp__row_kind {
    PERP__ROWS_OF_LIMITS,
    PERP__ROWS_OF_ERRORS,
    PERP__ROWS_OF_CLOSING,
    PERP__ROWS_OF_RATES,
    PERP__ROWS_NOT_SPARE
} perp__row_kind;
/* Inertia and rows where the island is; bodies at rest. */
void perp__pose_positions(perp_world *world, const perp__island *island, perp__row_kind which,
                          int32_t equally);
/* Newton's steps: one that does not lessen the errors is taken again with the limits that it
 * passes, or halved where there are none, and one that takes contacts deep with these, or where
 * they leave no way without any; as long as any does. The set's contacts are those of t ago. */
perp_status perp__close_island(perp_world *world, const perp__island *island, double t,
                               int32_t *changed);
/* Rows of the joints after those of the overlaps: limits within `reach`, and equations. */
void perp__add_joint_errors(perp_world *world, const perp__island *island, double reach);

#endif
