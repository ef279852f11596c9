/* What the files of the world share: the objects and who writes what. A step goes through
 *
 *   place        rotations, mass matrices and free velocities of the bodies    (motion.c)
 *   contact set  contact points that can close within the step                 (contact_set.c)
 *   islands      bodies that touch, directly or through others                 (island.c)
 *   solve        per island: to tol, its impacts where they are        (solve.c, exact.c,
 *                or within the budget of the world's accuracy         impacts.c, sweep.c)
 *   integrate    the next positions                                            (integrate.c)
 *   project      what penetrates is pushed apart                               (projection.c)
 *   commit       next states become states                                        (step.c)
 *   rest         what would repeat itself for ever falls asleep                   (rest.c)
 *
 * within a budget (budget.c), and nothing that a caller can see changes before the commit. Each of
 * them goes through what is awake alone. */
#ifndef PERP_WORLD_WORLD_H
#define PERP_WORLD_WORLD_H

#include <perp/world.h>

#include "base/arena.h"
#include "base/handle.h"
#include "base/outcome.h"
#include "base/sort.h"
#include "contact/coloured/coloured.h"
#include "contact/contact.h"
#include "world/collide/meeting.h"
#include "world/collide/tree.h"
#include "world/joint.h"

#define PERP__MAX_DIRECTIONS 64
#define PERP__MAX_SUBSTEPS 1000
#define PERP__MAX_DOF 6

/* Unit of rounding, 2^-52. */
#define PERP__EPSILON 2.220446049250313e-16

/* What changes in time: exactly what a snapshot holds. */
typedef struct perp__state {
    double position[3];
    double orientation[4]; /* three dimensions */
    double angle;          /* planar */
    double velocity[3];
    double angular_velocity[3];
    double force[3];
    double torque[3];
} perp__state;

/* What does not. */
typedef struct perp__body {
    uint32_t generation;
    int32_t alive;
    int32_t kind;
    int32_t spherical;   /* inertia is a multiple of the identity: no gyroscopic term */
    double inverse_mass; /* 0 unless dynamic, as the matrices below */
    double radius;       /* of the sphere about the mass centre that holds the bounded shapes */
    int32_t first_joint; /* of its list, see perp__joint.next */
    int32_t first_shape; /* list of the shapes; -1: none */
    int32_t shapes;
    int32_t planes; /* half-spaces among the shapes */
    int32_t next_free;
    /* rest.c */
    int32_t awake; /* on the list of these */
    int32_t nap;   /* of a dynamic body that is asleep; -1: none */
    int32_t next_member;
    double mass;
    double inertia[9];
    double inverse_inertia[9];
    double factor[9];         /* C with inverse_inertia = C C' */
    double inverse_factor[9]; /* C^-1 */
    double given_mass;        /* 0, and an inertia of zeros: the shapes' */
    double given_inertia[9];
    double shape_mass; /* of all shapes, with their moments about the body's origin */
    double shape_moment[3];
    double shape_inertia[9];
} perp__body;

/* Two shapes whose fat boxes overlap. */
typedef struct perp__pair {
    int32_t first; /* slots, first < second; -1: the pair is free */
    int32_t second;
    int32_t next[2]; /* links in the lists of the two shapes */
    int32_t previous[2];
    int32_t listed;       /* among the ordered pairs, unless those are to be found anew */
    int32_t open;         /* the shapes do not touch plainly at the start of the step */
    int32_t met;          /* the motion at hand makes them meet */
    int32_t joined;       /* how often their points have come */
    int32_t late, latest; /* contacts that came after the first round: a list; -1: none */
    double spare;         /* gap beyond which points of a half-space are left out: no motion so far
                             goes so far; INFINITY: none */
    int32_t waited;       /* a meeting of theirs has */
    int32_t made;         /* points at the start of the step */
    int32_t first_memory; /* impulses of the last step, see perp__remember */
    int32_t memories;
    int32_t had_first; /* those of the step before */
    int32_t had;
    int32_t changed;    /* which are others */
    int32_t first_kept; /* those that it fell asleep with; -1: none */
    perp__meeting meeting;
} perp__pair;

/* What a contact point was given in the last step, along the axes that come with its normal. */
typedef struct perp__memory {
    int32_t first; /* the shapes' slots */
    int32_t second;
    uint64_t feature;
    double normal[3];
    double impulse[3];
} perp__memory;

/* A contact point of bodies that are asleep. */
typedef struct perp__kept {
    int32_t next; /* of the pair; of a free one: the next free one */
    int32_t included;
    uint64_t order; /* its place among the contacts */
    perp__memory memory;
    perp_world_contact record;
} perp__kept;

/* Bodies that fell asleep together. */
typedef struct perp__nap {
    int32_t first; /* member; -1: free */
    int32_t last;
    int32_t next_free;
    int32_t islands;
    int32_t solved;
    int32_t contacts;
    int32_t tangents; /* rows of friction */
    int32_t rounded;  /* an island's outcome was rounding_limit */
    double residual;
} perp__nap;

typedef struct perp__shape {
    uint32_t generation;
    int32_t alive;
    int32_t next_free;
    int32_t body;
    double friction;
    double restitution;
    double density;
    double offset[3];
    double rotation[9];
    double radius;    /* of the sphere about the shape's centre; 0 for a half-space */
    double reach;     /* of its points, from the mass centre; 0 for a half-space */
    double thickness; /* half of its least width; INFINITY for half-spaces and points */
    /* pairs.c */
    int32_t next_of_body;
    int32_t leaf;       /* its fat box; -1: none */
    int32_t first_link; /* of its pairs; -1: none */
    int32_t next_plane; /* of a half-space */
    int32_t mark;
    perp__geometry geometry;
} perp__shape;

/* How the solve of a body's island went. */
typedef struct perp__verdict {
    perp_outcome outcome;
    int32_t stages;  /* intervals that were solved; 0: nothing to solve */
    int32_t impacts; /* instants */
    int32_t swept;   /* within a budget, overlap and all */
    int32_t sweeps;  /* over all of it; to be finished then */
    int32_t patched; /* swept since near what came */
    int32_t leads;   /* of the island's first body */
    int32_t jointed; /* with its joints */
    double residual;
} perp__verdict;

/* A body within the step. Twists are (velocity, angular velocity), world frame. */
typedef struct perp__motion {
    uint64_t coasts; /* world->coasting: is in its next state, as nothing is near it */
    int32_t moved;   /* the round of looking for contacts in which that was a new one */
    int32_t covered; /* the fat boxes hold what it does to the shapes */
    int32_t touched; /* has contact points in this step */
    int32_t jointed; /* has joints */
    int32_t island;  /* -1: none */
    int32_t local;   /* number within the island */
    int32_t carrier; /* number within the island of what moves as it is told; -1: none */
    int32_t repeats; /* ends the step as it began */
    int32_t calm;    /* so does all that is joined to it; at the root */
    double earliest; /* when it meets something first, in shares of the step */
    double spare;    /* of its pairs with half-spaces */
    perp__verdict verdict;
    double moving[6]; /* twist that moves the positions; of a body that nothing touches, the mean
                         of start and free */
    double tried[6];  /* the moving twist that contacts were looked for with last */
    double start[6];  /* twist before the step */
    double free[6];   /* twist that forces alone would give */
    double after[6];  /* twist after the step */
    double rotation[9];
    double trial[6];  /* joint_step.c: the moving twist, and that after the step, that joints are */
    double last[6];   /* placed by */
    double turned[9]; /* of bodies with joints: at the end of the trial motion */
    double shift[6];  /* of the projection */
} perp__motion;

typedef struct perp__world_contact {
    int32_t body_a; /* what each step reads of all contacts comes first */
    int32_t body_b;
    int32_t shape_a;
    int32_t shape_b;
    int32_t pair;
    int32_t round;    /* of looking for contacts in which it came */
    int32_t later;    /* contact of the pair, of those that came after the first round; -1: none */
    int32_t mode;     /* PERP_CONTACT_... */
    int32_t included; /* takes part in the problems; the others were found not to matter */
    int32_t fresh;    /* included since its island was solved last */
    uint64_t feature; /* tells the points of a pair apart, from step to step */
    double gap;       /* what may be closed along the normal */
    double rounding;  /* gaps below this are not told apart from 0 */
    double position[3]; /* at the start of the step, midway between the surfaces */
    double arms[2][3];  /* from the mass centres, in the pose of the meeting */
    double axes[3][3];  /* normal, tangent 1, tangent 2 */
    double size;        /* of the two bodies */
    double friction;
    double restitution;
    double start[3];      /* relative velocity before the step */
    double free[3];       /* with the free twists */
    double remembered[3]; /* impulse of the last step, along the axes; */
    double warm[3];       /* and the one to start from */
    double next[3];       /* for the next step to start from */
    double impulse[3];
    double velocity[3];
    uint32_t generations[4]; /* of bodies and shapes */
} perp__world_contact;

typedef struct perp__contact_set {
    perp__world_contact *contacts;
    int32_t included; /* of the step's: how many are, */
    int32_t early;    /* and how many came in the first round */
    int32_t count;
    int32_t capacity;
} perp__contact_set;

typedef struct perp__island {
    int32_t first_body; /* in body_order */
    int32_t bodies;
    int32_t first_contact; /* in contact_order */
    int32_t contacts;
    int32_t first_joint; /* in joint_order */
    int32_t joints;
    int64_t spent; /* lanes.c: on it, when it was solved last */
} perp__island;

/* Workspace of one island, large enough for the largest. Numbers: coordinates by body. */
typedef struct perp__island_work {
    int32_t max_contacts, max_bodies; /* with the units of joints; and what moves as it is told */
    size_t fitted[2];
    int32_t carriers;              /* of the latter */
    int32_t count;                 /* contacts that take part in the problem at hand, */
    int32_t *chosen;               /* by number in the island, */
    perp__rigid_rows *rows;        /* and their rows */
    int32_t inequalities, units;   /* and with the joints': up to here, and all */
    perp__joint_unit *joint_units; /* which those are */
    double length;                 /* of the step */
    int32_t set_up;                /* the solver has these */
    int32_t *members;              /* the bodies */
    double *factors, *origins;     /* of the bodies, perp__rigid_problem */
    double *start, *gain;          /* numbers: before the step, and what forces add in it */
    double *now, *drift;           /* numbers: velocities, and the way so far */
    double *free, *v, *moving;     /* numbers: of the interval at hand */
    int32_t *carrier, *modes;      /* bodies; contacts chosen */
    double *impulse, *velocity, *warm, *next_warm; /* 3 a contact chosen */
    double *gap, *guard;                           /* contacts of the island */
    double *strength, *solved, *solved_rows;       /* bodies; numbers; 3 a contact: of hold */
    double *still;                                 /* numbers: statics.c */
    int8_t *hit, *near;                            /* contacts of the island; bodies */
    int32_t *part;                                 /* contacts of a part of it: near.c */
} perp__island_work;

/* A snapshot of the world's own. */
typedef struct perp__kept_state {
    char *bytes;
    size_t room;
} perp__kept_state;

/* What the step may still spend. */
typedef struct perp__budget {
    int32_t limited;    /* by time */
    double until;       /* the phase at hand; on perp__now()'s clock */
    double deadline;    /* the step */
    int64_t iterations; /* left; INT64_MAX: no limit */
    int64_t spent;      /* iterations of all methods */
    int32_t contacts;   /* of the islands that are still to be solved */
} perp__budget;

struct perp_world {
    PERP__HANDLE;
    perp_world_settings settings;
    int32_t dof;                       /* coordinates of a body: 3 planar, 6 */
    int32_t coordinate[PERP__MAX_DOF]; /* which entries of a twist they are */

    perp__body *bodies;
    perp__state *states;
    int32_t *awake; /* bodies: in order, and after them what was roused since */
    int32_t awake_count;
    int32_t roused_count;
    int32_t awake_changed;
    int32_t awake_shape_count;
    int32_t body_slots;
    int32_t body_capacity;
    int32_t free_body; /* list of free slots, -1 at its end */
    perp__shape *shapes;
    int32_t shape_slots;
    int32_t shape_capacity;
    int32_t free_shape;
    perp__joint *joints;
    perp__joint_state *joint_states;
    int32_t joint_slots;
    int32_t joint_capacity;
    int32_t free_joint;
    int32_t joint_count;
    uint64_t edition; /* counts bodies and joints added and removed */
    int32_t weighed;  /* since shapes came, the mass centres have been looked at */

    /* the step's own memory, by size */
    perp__arena body_arena;
    perp__state *next; /* of what coasts: the state before the step */
    perp__motion *motions;
    int32_t *lively; /* awake bodies that do not coast */
    int32_t lively_count;
    uint64_t coasting; /* the number of the step, to know those that do */
    int32_t *parent;
    int32_t *body_order;
    perp__island *islands;
    int32_t fitted_bodies, fitted_shapes; /* what there was room for */
    perp__arena shape_arena;
    perp__placed *placed;
    int32_t *awake_shapes;
    perp__arena order_arena;
    int32_t *contact_order;
    int32_t *joint_order;
    perp__arena island_arena;
    perp__island_work work;
    perp__tree tree; /* of the shapes' fat boxes */
    int32_t first_plane;
    int32_t planes_changed;
    int32_t mark;
    perp__pair *pairs;
    int32_t pair_slots;
    int32_t pair_capacity;
    int32_t free_pair;
    int32_t pair_count;      /* of what is awake */
    perp__keyed *pair_order; /* these, by their shapes; as much again for sorting */
    int32_t pairs_added;     /* since they were sorted: so many in the second half; */
    int32_t pairs_changed;   /* others ended; 2: all may be others */
    perp__memory *memories;  /* pair by pair */
    perp__memory *next_memories;
    int32_t memory_count;
    int32_t memory_capacity;
    int32_t memories_restored; /* and not found by their pairs yet */
    int32_t rounds;            /* of looking for contacts in this step */
    int32_t island_count;
    perp__contact_set contacts; /* of the step */
    perp__contact_set last;     /* of the last one that went on */
    int32_t last_included;
    perp__contact_set overlaps; /* of the projection */
    perp__rigid_solver *solver;
    perp__coloured coloured;
    perp__budget budget;
    struct perp__tasks *tasks; /* lanes.h; NULL: all on the caller's thread */
    struct perp__lane *lanes;
    int32_t lane_count;

    /* rest.c */
    double step_length; /* of the last step */
    perp__nap *naps;
    int32_t nap_slots, nap_capacity, free_nap;
    perp__nap asleep; /* all of them together */
    int32_t residual_changed;
    perp__kept *kept;
    int32_t kept_slots, kept_capacity, free_kept;
    int32_t kept_count, kept_included;
    int32_t first_orphan, orphan_count; /* kept of pairs that ended since the last step */

    perp__kept_state begun, tried; /* adaptive.c: before the call, before the step tried; */
    perp__kept_state whole;        /* states where that leads as a whole */
    perp_world_contact *records;   /* of the last step, when they were asked for */
    int32_t record_count;
    int32_t record_capacity;
    int32_t recorded; /* they are up to date */
    perp_world_stats stats;
};

/* Opens a public call on a world: PERP_ERROR_HANDLE for what is none. perp__leave closes it. */
perp_status perp__world_enter(const perp_world *world);

/* Ids. */
uint64_t perp__id(int32_t slot, uint32_t generation);
perp_status perp__find_body(const perp_world *world, int32_t *slot, perp_body id);

/* body.c: adds a body from checked or unchecked, complete settings. */
perp_status perp__add_body(perp_world *world, perp_body *id, const perp_body_settings *settings);

/* Checks shared by bodies and shapes: a unit quaternion to 1e-6, which is normalised (one that is a
 * unit to rounding keeps its bits); z components that a planar world does not have. */
perp_status perp__check_quaternion(perp_context *context, const char *name, double *q);
perp_status perp__check_planar_vector(const perp_world *world, const char *name, const double *x);

/* mass.c: the mass properties of a dynamic body, from what its settings give and from its shapes.
 */
perp_status perp__body_mass(const perp_world *world, perp__body *body, double mass,
                            const double *inertia);
perp_status perp__add_shape_mass(const perp_world *world, perp__body *body,
                                 const perp__shape *shape);
/* Refuses bodies that would turn about another point than their shapes' mass centre. */
perp_status perp__check_centres(perp_world *world);

/* Releases the shapes of a body; recomputes its bounding radius. */
void perp__remove_shapes(perp_world *world, int32_t body);

/* motion.c */
void perp__rotation_of(const perp_world *world, const perp__state *state, double *R);
/* A body, or all that are awake, with their shapes. */
void perp__place_body(perp_world *world, const perp__state *states, int32_t body);
void perp__place(perp_world *world, const perp__state *states);
/* A body in place, moving as if nothing touched it. Returns 0 where its numbers are not finite. */
int32_t perp__start_motion(perp_world *world, int32_t body, double h);
/* One step of Euler's equations in the body frame by the implicit midpoint rule: w to w_next. */
void perp__euler_step(const perp__body *body, double h, const double *w, const double *torque,
                      double *w_next);

/* pairs.c */
/* Starts the motions of all that is awake. Pairs for all shapes that are near each other where
 * `placed`, or where `moving` takes them within h; the same after motions of islands changed; for
 * all that are nearer than twice the margin. */
perp_status perp__cover_motions(perp_world *world, double h);
perp_status perp__cover_changes(perp_world *world, double h);
perp_status perp__cover_places(perp_world *world, double margin);
/* For what is not covered where it is placed: what the motions at hand did not bring there. */
perp_status perp__cover_strays(perp_world *world);
static inline perp__pair *perp__ordered_pair(const perp_world *world, int32_t i)
{
    return &world->pairs[world->pair_order[i].value];
}
/* A shape that is new, or about to be removed. */
void perp__enlist_shape(perp_world *world, int32_t shape);
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

/* meetings.c */
double perp__pair_rounding(const perp_world *world, const perp__pair *pair);
/* The size of the two bodies. */
double perp__pair_size(const perp_world *world, const perp__pair *pair);
/* Whether the spheres about two shapes are within `margin` of each other; half-spaces are. */
int32_t perp__are_near(const perp_world *world, const perp__pair *pair, double margin);
/* A shape on the way of its body's motion. */
perp__moving perp__moving_shape(const perp_world *world, int32_t shape, double h);
/* Points of shapes that touch plainly at the start; 0: they don't. Those of half-spaces may be left
 * out from a gap of `far` on. */
int32_t perp__touching_points(const perp_world *world, perp__pair *pair, double h, double far,
                              perp__point *points);
/* Whether the motion at hand makes the pair meet, and in which points, of the pose at the time of
 * pair->meeting. */
int32_t perp__pair_meets(const perp_world *world, perp__pair *pair, double h);
int32_t perp__meeting_points(const perp_world *world, perp__pair *pair, double h,
                             perp__point *points);

/* contact_set.c */
/* Starts a step's contacts: the points of shapes that touch plainly, none included yet. */
perp_status perp__find_contacts(perp_world *world, double h);
/* Includes what the bodies' `moving` twists close or make meet: points come to the set, and points
 * of the set become `included` and `fresh`; *came tells how many. Call it until none comes, after
 * each change of `moving`. Contacts keep their numbers, not their places in memory. */
perp_status perp__join_contacts(perp_world *world, double h, int32_t *came);
/* Points with gaps up to `margin` in the next states. */
perp_status perp__find_overlaps(perp_world *world, double margin);

/* memory.c */
/* Room for so many memories. */
perp_status perp__reserve_memories(perp_world *world, int32_t count);
/* contact->warm := what the last step left to the pair's point of that feature, if it did. */
void perp__recall(const perp_world *world, const perp__pair *pair, perp__world_contact *contact);
/* Gives memories that came with a snapshot back to their pairs. */
void perp__find_memories(perp_world *world);
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

/* contact_rows.c */
void perp__contact_frame(const perp_world *world, perp__world_contact *contact);
/* Row k of side A or B: relative velocity = J_A twist_A + J_B twist_B. */
void perp__contact_row(const perp__world_contact *contact, int32_t side, int32_t k, double *row);
void perp__relative_velocity(const perp_world *world, const perp__world_contact *contact,
                             size_t twist, double *u);
/* The twists of a motion by offset, for functions that take any of them. */
#define PERP__TWIST_START offsetof(perp__motion, start)
#define PERP__TWIST_FREE offsetof(perp__motion, free)
#define PERP__TWIST_MOVING offsetof(perp__motion, moving)
#define PERP__TWIST_AFTER offsetof(perp__motion, after)

static inline const double *perp__const_twist(const perp__motion *motion, size_t twist)
{
    return (const double *)((const char *)motion + twist);
}

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

/* sweep.c: an island within the budget of the world's accuracy: its motion, from the impulses that
 * it has; and once no more contacts come the velocities at its end, and what they are worth. */
perp_status perp__sweep_island(perp_world *world, const perp__island *island, double h,
                               perp__verdict *verdict);
perp_status perp__finish_swept(perp_world *world, const perp__island *island, double h,
                               perp__verdict *verdict);
/* What moves heavily over what moves lightly: a mass, or the inertia about some axis beside the
 * body's size. */
double perp__mass_ratio(const perp_world *world, const perp__island *island);
/* Whether an exact solution costs no more, or nothing less will do. */
int32_t perp__is_worth_exact(const perp_world *world, const perp__island *island);
/* Whether it costs so little that it may be done whenever a contact comes. */
int32_t perp__is_small(const perp_world *world, const perp__island *island);

/* integrate.c */
/* The next states, and all that overlaps are looked for in is placed there. Returns a body whose
 * numbers are not finite, or -1. */
int32_t perp__integrate(perp_world *world, double h);
/* Takes a body that is near nothing and moves on to its next state at once: no one has to look at
 * it again in the step. Returns 0 where its numbers are not finite. */
int32_t perp__coast(perp_world *world, int32_t body, double h);
/* Takes it back, if it did; all of them. */
void perp__stop_coasting(perp_world *world, int32_t body);
void perp__stop_all_coasting(perp_world *world);
int32_t perp__find_infinite(const perp_world *world);
void perp__turn(const perp_world *world, perp__state *state, const double *turn);

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

/* step.c: one step, within the budget that is open. */
perp_status perp__step(perp_world *world, perp_step_result *result, double h);

#endif
