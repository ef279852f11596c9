/* The objects of a world: what changes in time, what does not, what a step makes of it. The phases
 * of a step, and what they give each other, are in step.h. */
#ifndef PERP_WORLD_WORLD_H
#define PERP_WORLD_WORLD_H

#include <perp/world.h>

#include "base/arena.h"
#include "base/handle.h"
#include "base/outcome.h"
#include "base/sort.h"
#include "contact/coloured/coloured.h"
#include "contact/contact.h"
#include "contact/statics/statics.h"
#include "world/collide/collision.h"
#include "world/collide/tree.h"
#include "world/joints/joint.h"
#include "world/tuning.h"

#define PERP__MAX_DIRECTIONS 64
#define PERP__MAX_SUBSTEPS 1000

/* A caller moved the body, or changed what it touches, since the last step; the body still overlaps
 * others that it was put deep into. */
enum { PERP__PUT = 1, PERP__PUT_INTO = 2 };

/* What changes in time: exactly what a snapshot holds. */
typedef struct perp__state {
    double position[3];
    double orientation[4]; /* three dimensions */
    double angle;          /* planar */
    double velocity[3], angular_velocity[3], force[3], torque[3];
    int64_t put;   /* PERP__PUT, PERP__PUT_INTO; 0: neither */
    double led[6]; /* of a kinematic body: the twist that it had in the last step */
} perp__state;

/* What does not change in time. */
typedef struct perp__body {
    uint32_t generation;
    int32_t alive, kind;
    int32_t spherical;   /* inertia is a multiple of the identity: no gyroscopic term */
    double inverse_mass; /* 0 unless dynamic, as the matrices below */
    double radius;       /* of the sphere about the mass centre that holds the bounded shapes */
    int32_t first_joint; /* of its list, see perp__joint.next */
    int32_t first_shape; /* list of the shapes; -1: none */
    int32_t shapes, next_free;
    /* rest.c */
    int32_t awake; /* is in world->sleep.awake */
    int32_t nap;   /* of a dynamic body that is asleep; -1: none */
    int32_t next_member;
    double mass, inertia[9], inverse_inertia[9];
    double factor[9];         /* C with inverse_inertia = C C' */
    double inverse_factor[9]; /* C^-1 */
    double given_mass;        /* of the settings; 0, inertia too: from the shapes */
    double given_inertia[9];
    double shape_mass; /* sum over the shapes; moments about the body's origin */
    double shape_moment[3], shape_inertia[9];
} perp__body;

/* Two shapes whose fat boxes overlap. Fields that every step reads of all pairs come first. */
typedef struct perp__pair {
    int32_t first; /* slots, first < second; -1: the pair is free */
    int32_t second;
    int32_t next[2]; /* links in the lists of the two shapes */
    int32_t previous[2];
    int32_t body[2]; /* of the shapes */
    int8_t plane;    /* one is a half-space */
    int8_t listed;   /* is in world->pairs.order, unless that is to be made anew */
    int8_t open;     /* the shapes do not touch plainly at the start of the step */
    int8_t joined;   /* rounds of this step in which points were added */
    int8_t made;     /* number of points at the start, PERP__MAX_POINTS at most */
    int8_t plain;    /* `made` does not depend on the impulses of the last step */
    int8_t changed;  /* memories differ from those of the step before */
    int8_t same;     /* points are those of the last step: its contacts from first_last on */
    double spare;    /* before a half-space: points beyond this gap are left out; INFINITY: none */
    double reach[2]; /* perp__turning_reach of the shapes */
    perp__collision collision;
    double overlap;       /* at the end of the step: projection.c */
    uint64_t steps;       /* number of the step whose points `made` counts */
    int32_t first_now;    /* its first contact of this step, */
    int32_t first_last;   /* and of the last */
    int32_t late, latest; /* list of contacts added after the first round; -1: none */
    int32_t first_memory; /* impulses of the last step, see perp__remember */
    int32_t memories;
    int32_t had_first; /* memories of the step before that */
    int32_t had;
    int32_t first_sleeping; /* those that it fell asleep with; -1: none */
} perp__pair;

/* Impulse of a contact point in the last step, along the axes that belong to its normal. */
typedef struct perp__memory {
    int32_t first; /* the shapes' slots */
    int32_t second;
    uint64_t feature;
    double normal[3], position[3], impulse[3];
    double base[3]; /* of an island at rest: the impulse that statics found */
} perp__memory;

/* A contact point of bodies that are asleep. */
typedef struct perp__sleeping_contact {
    int32_t next; /* of the pair; of a free one: the next free one */
    int32_t included;
    uint64_t order; /* its place among the contacts */
    perp__memory memory;
    perp_world_contact record;
} perp__sleeping_contact;

/* Bodies that fell asleep together, and the results of their last step. */
typedef struct perp__nap {
    int32_t first; /* member; -1: free */
    int32_t last, next_free, islands, solved, contacts;
    int32_t tangents; /* rows of friction */
    int32_t rounded;  /* an island's outcome was rounding_limit */
    double residual;
} perp__nap;

typedef struct perp__shape {
    uint32_t generation;
    int32_t alive, next_free, body;
    double friction, restitution, density, offset[3], rotation[9];
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

/* How the solve of a body's island went: flags, but for counts and numbers that say so. */
typedef struct perp__verdict {
    perp_outcome outcome;
    int32_t stages;        /* count of intervals that were solved; 0: nothing to solve */
    int32_t impacts;       /* count of instants with impacts */
    int32_t swept;         /* solved by sweeps, which also took out overlap */
    int32_t is_first;      /* of the island's first body */
    int32_t jointed;       /* has joints, */
    int32_t swings;        /* and was solved by these alone: joints/swing.c */
    int32_t rough;         /* it turns too far in an interval: the step is to be divided */
    int32_t coarse;        /* joint rows are those of the start, as it turns too far */
    int32_t endless;       /* count of contacts that are not finite */
    int32_t asked;         /* count of rows for which statics last said: cannot stand */
    int32_t sketched;      /* swept to see what meets, at a level that asks for more */
    int32_t in_vain;       /* all methods failed in some interval of this step */
    int32_t stands, moves; /* statics found it at rest on its carrier; it begins otherwise */
    int32_t rides;         /* it stands, and moves with a kinematic body */
    int32_t may_rest;      /* swept at nearly no velocity; statics has not found rest */
    double turn;           /* largest rotation of a body in radians: joints/trial.c */
    double residual;
    double drive; /* of sweeps: velocity that `residual` is relative to; 0: not swept */
} perp__verdict;

/* What loops over all pairs and contacts read of a body. */
typedef struct perp__role {
    int32_t island; /* -1: none */
    int32_t local;  /* number within the island */
    int8_t dynamic;
    int8_t touched; /* has contact points in this step */
    int8_t jointed; /* has joints */
    int8_t swept;   /* verdict.swept */
    int8_t far;     /* turning or closing joints took it far from where the solve led */
    int8_t put;     /* state.put at the end of the step */
    int8_t repeats; /* ends the step as it began, and nobody changed it since */
    int8_t calm;    /* of a set's root: all its bodies repeat. At the start of a step: all that is
                       near the body did */
} perp__role;

/* A body within the step. Twists are (velocity, angular velocity), world frame. */
typedef struct perp__motion {
    uint64_t coasts;  /* world->step.coasting if it coasts: it is in its next state already */
    uint64_t placed;  /* world->step.coasting when its shapes were placed last */
    int32_t enclosed; /* its shapes stay in their fat boxes */
    int32_t carrier;  /* number within the island, of a kinematic body; -1: of none */
    double spare;     /* gap for pairs with half-spaces: perp__pair.spare */
    double room;      /* way that its shapes have in their fat boxes, from where they begin */
    perp__verdict verdict;
    double moving[6]; /* twist that moves the positions; of a body that nothing touches, the mean
                         of start and free */
    double tried[6];  /* the moving twist that contacts were looked for with last */
    double start[6];  /* twist before the step */
    double free[6];   /* twist that forces alone would give */
    double after[6];  /* twist after the step */
    double rotation[9];
    double
        trial[6];   /* joints/trial.c: the moving twist, and that after the interval, that joints */
    double last[6]; /* are placed by */
    double shift[6]; /* displacement by the projection; */
    double overlap;  /* the deepest of its pairs, and the error of its joints */
    double unspent;  /* its part of the energy that the step lost */
} perp__motion;

/* A contact point. From `axes` on, fields are common to the points of a pair with one normal. */
typedef struct perp__world_contact {
    double gap;         /* distance that the step may close along the normal */
    double free, start; /* velocity along the normal with the free twists, and before the step */
    double position[3]; /* at the start of the step, midway between the surfaces */
    double arms[2][3];  /* from the mass centres to the surfaces, in the pose of the collision */
    uint64_t feature;   /* tells the points of a pair apart, from step to step */
    double axes[3][3];  /* normal, tangent 1, tangent 2 */
    double rounding;    /* gaps below this are not told apart from 0 */
    double size;        /* of the two bodies */
    double friction, restitution;
    int32_t body_a, body_b, shape_a, shape_b, pair;
    int32_t round;           /* in which it was found */
    uint32_t generations[4]; /* of bodies and shapes */
} perp__world_contact;

/* What a step computes of a contact point. */
typedef struct perp__response {
    double remembered[3]; /* impulse of the last step, along the axes; */
    double warm[3];       /* and the one to start from */
    double next[3];       /* for the next step to start from */
    double impulse[3], velocity[3];
    double base[3]; /* perp__memory */
    int32_t mode;   /* PERP_CONTACT_... */
    int32_t later;  /* next in the pair's list `late`; -1: none */
} perp__response;

/* What rounds and islands read of a contact point. */
typedef struct perp__contact_flags {
    int32_t body[2];
    int32_t local[2]; /* their numbers within the island; -1: of none */
    int8_t included;  /* takes part in the problems */
    int8_t fresh;     /* included since its island was solved last */
    int8_t closed;    /* its gap was 0 to rounding when it was found */
    int8_t rubs;      /* has friction */
    int8_t moved;     /* found in a later pose, and its gap is not 0 */
    int8_t deep;      /* perp__is_deep() */
    int8_t repeats;   /* equals that of the last step, bit for bit */
    int8_t pushes;    /* takes part where joints are closed (joints/closing.c) */
    uint64_t key;     /* identifies the data of its rows; 0: not made yet (standing.c) */
} perp__contact_flags;

typedef struct perp__contact_set {
    perp__world_contact *contacts;
    perp__response *responses;
    perp__contact_flags *flags;
    int32_t included; /* how many are included, */
    int32_t rubbing;  /* of them, with friction, */
    int32_t early;    /* and how many were found in the first round */
    int32_t count, capacity;
} perp__contact_set;

typedef struct perp__island {
    int32_t first_body, bodies;      /* in body_order */
    int32_t first_contact, contacts; /* in contact_order */
    int32_t first_joint, joints;     /* in joint_order */
    int32_t ties, tied; /* how often the body that is not dynamic changes in them, and the last */
    int64_t spent;      /* iterations of its last solve: lanes.c */
} perp__island;

/* Workspace of one island, large enough for the largest. Numbers: coordinates by body. */
typedef struct perp__island_work {
    int32_t max_contacts, max_bodies; /* contacts with joint units; bodies with carriers */
    int32_t max_jointed;              /* bodies of an island with joints, for `before` to `tried` */
    size_t fitted[3];
    int32_t carriers;                  /* kinematic bodies among them */
    int32_t count;                     /* contacts that take part in the problem at hand, */
    int32_t *chosen;                   /* by number in the island, */
    perp__rigid_rows *rows;            /* and their rows */
    int32_t inequalities, units;       /* and with the joints': up to here, and all */
    perp__joint_unit *joint_units;     /* which those are */
    double share;                      /* interval of `free` as a share of the step */
    double length, gone, span;         /* times: the step, what is past of it, the interval */
    int32_t set_up;                    /* the solver is set up for these rows */
    int32_t *members, *parts;          /* the bodies; their sets by joints: joints/step.c */
    perp__state *before;               /* joints/projection.c: their next states, before a shift */
    perp__path *paths;                 /* their displacements in the interval, with joints */
    double *factors, *origins;         /* of the bodies, perp__rigid_problem */
    double *start, *gain;              /* numbers: before the step, and what forces add in it */
    double *now, *drift;               /* numbers: velocities, and displacements so far */
    double *tried;                     /* PERP__TRIED a body and round: trial.c */
    double *free, *v, *moving;         /* numbers: of the interval at hand */
    int32_t *carrier, *modes;          /* bodies; contacts chosen */
    double *impulse, *velocity, *warm; /* 3 a contact chosen */
    double *turning;                   /* 3 a contact chosen, too: along.c */
    double *came;                      /* contacts chosen: normal velocities of `now` */
    double *gap, *guard;               /* contacts of the island; overlap that is left: sweep.c */
    double *strength, *solved, *solved_rows; /* bodies; numbers; 3 a contact: exact.c */
    double *forces;                          /* 7 a body: standing.c */
    double *still, *stand_forces;            /* numbers: of standing.c, like all these */
    double *stand_base, *stand_r;            /* 3 a unit */
    double *stand_values;
    perp__statics_rows stand_rows;
    perp__statics_unit *stand_units;
    perp__statics_link *stand_links;
    int8_t *hit; /* contacts of the island */
} perp__island_work;

/* A snapshot of the world's own. */
typedef struct perp__saved_state {
    char *bytes;
    size_t room;
} perp__saved_state;

/* Time and iterations that the step may still spend. */
typedef struct perp__budget {
    int32_t limited;    /* by time */
    double until;       /* the phase at hand; on perp__now()'s clock */
    double deadline;    /* the step */
    int64_t iterations; /* left; INT64_MAX: no limit */
    int64_t spent;      /* iterations of all methods */
    int32_t contacts;   /* of the islands that are still to be solved */
} perp__budget;

/* The parts of a world. First the bodies, by slot: lists of free slots end with -1. */
typedef struct perp__world_bodies {
    perp__body *all;
    perp__state *states;
    int32_t *clusters; /* bodies joined by fixed joints: a forest (base/groups.h) */
    int32_t slots, capacity, free;
    int32_t weighed;  /* mass centres were checked since the last shape was added */
    uint64_t edition; /* counts bodies and joints added and removed */
} perp__world_bodies;

typedef struct perp__world_shapes {
    perp__shape *all;
    int32_t slots, capacity, free;
} perp__world_shapes;

/* Broad phase: the pairs whose fat boxes overlap. */
typedef struct perp__world_pairs {
    perp__tree tree; /* of the shapes' fat boxes */
    int32_t first_plane, planes_changed, mark;
    perp__pair *all;
    int32_t slots, capacity, free, count; /* count: of what is awake */
    perp__keyed *order;                   /* these, by their shapes; as much again for sorting */
    int32_t added;                        /* count since the last sort, in the second half; */
    int32_t changed;                      /* some pair ended; 2: all may have changed */
    int32_t *met;                         /* pairs that meet in the round at hand */
} perp__world_pairs;

/* Sets of contacts. */
typedef struct perp__world_contacts {
    perp__contact_set now;         /* of the step */
    perp__contact_set last;        /* of the last step that advanced */
    perp__contact_set overlaps;    /* of the projection */
    int32_t last_included, rounds; /* rounds of looking for contacts in this step */
} perp__world_contacts;

/* Impulses of the last step, pair by pair, from which the next one starts. */
typedef struct perp__world_memory {
    perp__memory *all, *next;
    int32_t count, capacity, restored; /* restored: from a snapshot, not yet of pairs */
} perp__world_memory;

/* What is awake, and what fell asleep: rest.c. */
typedef struct perp__world_sleep {
    int32_t *awake, *awake_shapes; /* bodies in order, then those woken since; their shapes */
    int32_t awake_count, roused_count, awake_changed, awake_shape_count;
    int32_t some_put; /* some body is PERP__PUT, or _INTO others */
    int32_t settled;  /* bodies that ended the last step as they began it */
    perp__nap *naps;
    int32_t nap_slots, nap_capacity, free_nap, residual_changed;
    perp__nap asleep; /* all of them together */
    perp__sleeping_contact *contacts;
    int32_t contact_slots, kept_capacity, free_contact, contact_count, included;
    int32_t first_orphan, orphan_count; /* contacts of ended pairs */
} perp__world_sleep;

/* The bodies within the step, in memory of its own. */
typedef struct perp__world_step {
    perp__arena arena;
    int32_t fitted_bodies, fitted_shapes; /* sizes that the arena has room for */
    perp__state *next;                    /* of what coasts: the state before the step */
    perp__motion *motions;
    perp__role *roles;
    perp__placed *placed;
    int32_t *moving, moving_count; /* awake bodies that do not coast */
    int32_t *moved;                /* bodies: the last round in which the motion changed */
    uint64_t coasting;             /* number of the step: motions with it in `coasts` coast */
    int32_t divides;  /* > 0: the step is one of so many parts; a rough one is given up */
    int32_t rough;    /* the last step was rough: perp__is_rough */
    int32_t sketches; /* solves only find what meets; exact solves follow */
    int32_t untimed;  /* steps since one was timed */
    double length;    /* of the last step */
    double scaled;    /* largest residual of swept islands whose impulses were cut for energy */
    perp__budget budget;
} perp__world_step;

/* The islands of the step: ranges of the three orders. */
typedef struct perp__world_islands {
    perp__island *all;
    int32_t count;
    const perp__contact_set *set; /* the set that their contacts are in */
    int32_t *parent, *body_order, *contact_order, *joint_order;
    perp__arena arena;
    size_t fitted[3];
} perp__world_islands;

/* What solves an island: each thread has its own. */
typedef struct perp__world_solve {
    perp__arena arena;
    perp__island_work work;
    perp_contact_solver *solver;
    perp__coloured coloured;
    struct perp__standing *standing; /* islands/islands.h */
    struct perp__batch *batch;       /* islands/lanes.h */
} perp__world_solve;

/* What the last step answered. */
typedef struct perp__world_results {
    perp_world_contact *records; /* of the last step, when they were asked for */
    int32_t record_count, record_capacity, recorded; /* recorded: they are up to date */
    perp_world_stats stats;
} perp__world_results;

struct perp_world {
    PERP__HANDLE;
    perp_world_settings settings;
    int32_t dof; /* coordinates of a body: 6, those of a twist; planar 3, its numbers 0, 1 and 5 */
    perp__world_bodies bodies;
    perp__world_shapes shapes;
    perp__world_joints joints;
    perp__world_pairs pairs;
    perp__world_contacts contacts;
    perp__world_memory memory;
    perp__world_sleep sleep;
    perp__world_step step;
    perp__world_islands islands;
    perp__world_solve solve;
    struct perp__tasks *tasks; /* lanes.h; NULL: all on the caller's thread */
    struct perp__lane *lanes;
    int32_t lane_count;
    perp__saved_state begun, tried, whole; /* adaptive.c: before the call, a step; after it */
    perp__world_results results;
};

static inline bool perp__is_dynamic(const perp_world *world, int32_t body)
{
    return world->bodies.all[body].kind == PERP_BODY_DYNAMIC;
}

/* Opens a public call on a world: PERP_ERROR_HANDLE for what is none. perp__leave closes it. */
perp_status perp__world_enter(const perp_world *world);
#define PERP__WORLD_CALL(world, works) PERP__CALL(perp__world_enter(world), (world)->context, works)

/* Ids. */
uint64_t perp__id(int32_t slot, uint32_t generation);
perp_status perp__find_body(const perp_world *world, int32_t *slot, perp_body id);

/* body.c: adds a body from checked or unchecked, complete settings. */
perp_status perp__add_body(perp_world *world, perp_body *id, const perp_body_settings *settings);

/* Checks shared by bodies and shapes: a unit quaternion to 1e-6, which is normalised (one that is a
 * unit to rounding keeps its bits); numbers, and no z components in a planar world. */
perp_status perp__check_quaternion(perp_context *context, const char *name, double *q);
perp_status perp__check_vector3(const perp_world *world, const char *name, const double *x);

/* mass.c: the mass properties of a dynamic body, from what its settings give and its shapes. */
perp_status perp__body_mass(const perp_world *world, perp__body *body, double mass,
                            const double *inertia);
perp_status perp__add_shape_mass(const perp_world *world, perp__body *body,
                                 const perp__shape *shape);
/* Refuses bodies that would turn about another point than their shapes' mass centre. */
perp_status perp__check_centres(perp_world *world);

/* Releases the shapes of a body; recomputes its bounding radius. */
void perp__remove_shapes(perp_world *world, int32_t body);

#endif
