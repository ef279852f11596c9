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

/* What a caller did to a body, or to what it touches, since the last step; and what it is known for
 * until it comes apart from what it was put deep into. */
enum { PERP__PUT = 1, PERP__PUT_INTO = 2 };

/* What changes in time: exactly what a snapshot holds. */
typedef struct perp__state {
    double position[3];
    double orientation[4]; /* three dimensions */
    double angle;          /* planar */
    double velocity[3];
    double angular_velocity[3];
    double force[3];
    double torque[3];
    int64_t put;   /* PERP__PUT, _INTO others; 0: neither */
    double led[6]; /* of a kinematic body: the twist that it had in the last step */
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

/* Two shapes whose fat boxes overlap. What lists and each pass read comes first. */
typedef struct perp__pair {
    int32_t first; /* slots, first < second; -1: the pair is free */
    int32_t second;
    int32_t next[2]; /* links in the lists of the two shapes */
    int32_t previous[2];
    int32_t body[2]; /* of the shapes */
    int8_t plane;    /* one is a half-space */
    int8_t listed;   /* among the ordered pairs, unless those are to be found anew */
    int8_t open;     /* the shapes do not touch plainly at the start of the step */
    int8_t joined;   /* how often their points have come */
    int8_t made;     /* points at the start of the step, PERP__MAX_POINTS at most; */
    int8_t plain;    /* which did not depend on what pressed in the step before */
    int8_t changed;  /* memories are others than those of the step before */
    int8_t same;     /* points are those of the last step: its contacts from first_last on */
    double spare;    /* gap from which on points of a half-space wait; INFINITY: none do */
    double reach[2]; /* perp__turning_reach of the shapes */
    perp__collision collision;
    double overlap;       /* of the next states: projection.c */
    uint64_t steps;       /* after which `made` are those at hand */
    int32_t first_now;    /* its first contact of this step, */
    int32_t first_last;   /* and of the last */
    int32_t late, latest; /* contacts that came after the first round: a list; -1: none */
    int32_t first_memory; /* impulses of the last step, see perp__remember */
    int32_t memories;
    int32_t had_first; /* those of the step before */
    int32_t had;
    int32_t first_sleeping; /* those that it fell asleep with; -1: none */
} perp__pair;

/* What a contact point was given in the last step, along the axes that come with its normal. */
typedef struct perp__memory {
    int32_t first; /* the shapes' slots */
    int32_t second;
    uint64_t feature;
    double normal[3];
    double position[3];
    double impulse[3];
    double
        base[3]; /* of an island that stands: as it was decided, from which forces changed since */
} perp__memory;

/* A contact point of bodies that are asleep. */
typedef struct perp__sleeping_contact {
    int32_t next; /* of the pair; of a free one: the next free one */
    int32_t included;
    uint64_t order; /* its place among the contacts */
    perp__memory memory;
    perp_world_contact record;
} perp__sleeping_contact;

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
    int32_t stages;   /* intervals that were solved; 0: nothing to solve */
    int32_t impacts;  /* instants */
    int32_t swept;    /* within a budget, overlap and all */
    int32_t is_first; /* of the island's first body */
    int32_t jointed;  /* with its joints, */
    int32_t swings;   /* and nothing else */
    int32_t rough;    /* which turn further in an interval than what is linear there knows of */
    int32_t coarse;   /* its joints were where the step begins, as it turns too far otherwise; */
    int32_t endless;  /* contacts that are not finite */
    int32_t asked;    /* rows of which it was asked whether they stand, and do not */
    int32_t sketched; /* swept to see what meets, at a level that asks for more */
    int32_t in_vain;  /* all that there is came to no answer in this step, of some part of it */
    int32_t stands;   /* at rest beside what carries it, decided (islands/carried.c) */
    int32_t rides;    /* it stands with the motion of a kinematic body */
    int32_t may_rest; /* swept from next to nothing, and yet not found to stand */
    double turn;      /* how far: joints/trial.c */
    double residual;
    double drive; /* of sweeps: the velocities that it is a share of; 0: none were made */
} perp__verdict;

/* Of a body, what passes through all pairs and contacts ask for. */
typedef struct perp__role {
    int32_t island; /* -1: none */
    int32_t local;  /* number within the island */
    int8_t dynamic;
    int8_t touched; /* has contact points in this step */
    int8_t jointed; /* has joints */
    int8_t swept;   /* verdict.swept */
    int8_t far;     /* turning or joints took it far from where that led */
    int8_t put;     /* its state's, at the end of the step */
    int8_t repeats; /* ends the step as it began, and no one changed it since */
    int8_t calm;    /* so does all that is joined to it; at the root. When a step begins: so did all
                       that is near it */
} perp__role;

/* A body within the step. Twists are (velocity, angular velocity), world frame. */
typedef struct perp__motion {
    uint64_t coasts;  /* world->coasting: is in its next state, as nothing is near it */
    uint64_t placed;  /* world->coasting of the step whose states its shapes are placed by */
    int32_t enclosed; /* the fat boxes hold what it does to the shapes */
    int32_t carrier;  /* number within the island of what moves as it is told; -1: none */
    double spare;     /* of its pairs with half-spaces */
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
    double shift[6]; /* of the projection; */
    double overlap;  /* the deepest of its pairs, and what joints lack */
    double unspent;  /* its part of the energy that the step lost */
} perp__motion;

/* Where bodies touch. From the axes on it is what points of a pair and normal have in common. */
typedef struct perp__world_contact {
    double gap;         /* what may be closed along the normal */
    double free, start; /* velocity along the normal with the free twists, and before the step */
    double position[3]; /* at the start of the step, midway between the surfaces */
    double arms[2][3];  /* from the mass centres to the surfaces, in the pose of the collision */
    uint64_t feature;   /* tells the points of a pair apart, from step to step */
    double axes[3][3];  /* normal, tangent 1, tangent 2 */
    double rounding;    /* gaps below this are not told apart from 0 */
    double size;        /* of the two bodies */
    double friction;
    double restitution;
    int32_t body_a;
    int32_t body_b;
    int32_t shape_a;
    int32_t shape_b;
    int32_t pair;
    int32_t round;           /* of looking for contacts in which it came */
    uint32_t generations[4]; /* of bodies and shapes */
} perp__world_contact;

/* What a step makes of it. */
typedef struct perp__response {
    double remembered[3]; /* impulse of the last step, along the axes; */
    double warm[3];       /* and the one to start from */
    double next[3];       /* for the next step to start from */
    double impulse[3];
    double velocity[3];
    double base[3]; /* perp__memory */
    int32_t mode;   /* PERP_CONTACT_... */
    int32_t later;  /* contact of the pair, of those that came after the first round; -1: none */
} perp__response;

/* And what rounds read of it. */
typedef struct perp__contact_flags {
    int32_t body[2];
    int32_t local[2]; /* their numbers within the island; -1: of none */
    int8_t included;  /* takes part in the problems; the others were found not to matter */
    int8_t fresh;     /* included since its island was solved last */
    int8_t closed;    /* its gap is not told apart from 0, as it came */
    int8_t rubs;      /* has friction */
    int8_t moved;     /* lies where only a motion of the bodies brings it */
    int8_t deep;      /* perp__is_deep() */
    int8_t repeats;   /* is that of the last step, to the last bit */
    int8_t pushes;    /* takes part in closing joints */
    uint64_t key;     /* of what its rows are made of; 0: not made yet (standing.c) */
} perp__contact_flags;

typedef struct perp__contact_set {
    perp__world_contact *contacts;
    perp__response *responses;
    perp__contact_flags *flags;
    int32_t included; /* of the step's: how many are, */
    int32_t rubbing;  /* of them, with friction, */
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
    int32_t max_jointed;              /* bodies of an island with joints, for `before` to `tried` */
    size_t fitted[3];
    int32_t carriers;                  /* of the latter */
    int32_t count;                     /* contacts that take part in the problem at hand, */
    int32_t *chosen;                   /* by number in the island, */
    perp__rigid_rows *rows;            /* and their rows */
    int32_t inequalities, units;       /* and with the joints': up to here, and all */
    perp__joint_unit *joint_units;     /* which those are */
    double share;                      /* of a step: the interval of `free` */
    double length, gone, span;         /* of the step; up to the interval at hand; and of that */
    int32_t set_up;                    /* the solver has these */
    int32_t *members, *parts;          /* the bodies; which of them joints join: joints/step.c */
    perp__state *before;               /* joints/projection.c: their next states, before a shift */
    perp__path *paths;                 /* their ways through the interval, with joints */
    double *factors, *origins;         /* of the bodies, perp__rigid_problem */
    double *start, *gain;              /* numbers: before the step, and what forces add in it */
    double *now, *drift;               /* numbers: velocities, and the way so far */
    double *tried;                     /* PERP__TRIED a body and round: trial.c */
    double *free, *v, *moving;         /* numbers: of the interval at hand */
    int32_t *carrier, *modes;          /* bodies; contacts chosen */
    double *impulse, *velocity, *warm; /* 3 a contact chosen */
    double *turning;                   /* 3 a contact chosen, too: along.c */
    double *came;                      /* contacts chosen: normal velocities of `now` */
    double *gap, *guard;               /* contacts of the island */
    double *strength, *solved, *solved_rows; /* bodies; numbers; 3 a contact: of hold */
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
    int32_t dof; /* coordinates of a body: 6, those of a twist; planar 3, its numbers 0, 1 and 5 */

    perp__body *bodies;
    perp__state *states;
    int32_t *clusters; /* of bodies that fixed joints hold together: a forest (base/groups.h) */
    int32_t *awake;    /* bodies: in order, and after them what was roused since */
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
    int32_t divides;  /* parts of a step, of which one that is rough is given up; 0: none is */
    int32_t rough;    /* the last one was */
    uint64_t edition; /* counts bodies and joints added and removed */
    int32_t weighed;  /* since shapes came, the mass centres have been looked at */

    /* the step's own memory, by size */
    perp__arena body_arena;
    perp__state *next; /* of what coasts: the state before the step */
    perp__motion *motions;
    perp__role *roles;
    int32_t *moving_bodies; /* awake bodies that do not coast */
    int32_t moving_count;
    uint64_t coasting; /* the number of the step, to know those that do */
    int32_t *parent;
    int32_t *moved; /* the round of looking for contacts in which a body's motion was a new one */
    int32_t *body_order;
    perp__island *islands;
    int32_t fitted_bodies, fitted_shapes; /* what there was room for */
    perp__placed *placed;
    int32_t *awake_shapes;
    perp__arena order_arena;
    size_t fitted_order[3];
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
    int32_t *met_pairs;      /* those that meet in a round */
    perp__memory *memories;  /* pair by pair */
    perp__memory *next_memories;
    int32_t memory_count;
    int32_t memory_capacity;
    int32_t memories_restored; /* and not found by their pairs yet */
    int32_t rounds;            /* of looking for contacts in this step */
    int32_t sketches; /* what meets is not known yet, and solutions say no more than that */
    int32_t island_count;
    const perp__contact_set *island_set; /* whose contacts they have */
    perp__contact_set contacts;          /* of the step */
    perp__contact_set last;              /* of the last one that went on */
    int32_t last_included;
    int32_t some_put;           /* some body is PERP__PUT, or _INTO others */
    int32_t settled;            /* bodies that end the last step as they began it */
    perp__contact_set overlaps; /* of the projection */
    perp_contact_solver *solver;
    perp__coloured coloured;
    perp__budget budget;
    struct perp__standing *standing; /* islands/islands.h */
    struct perp__batch *batch;       /* islands/lanes.h */
    struct perp__tasks *tasks;       /* lanes.h; NULL: all on the caller's thread */
    struct perp__lane *lanes;
    int32_t lane_count;

    /* rest.c */
    double step_length; /* of the last step */
    double scaled; /* the largest residual of what was swept and has less impulse for its energy */
    int32_t untimed; /* steps since one was timed */
    perp__nap *naps;
    int32_t nap_slots, nap_capacity, free_nap;
    perp__nap asleep; /* all of them together */
    int32_t residual_changed;
    perp__sleeping_contact *sleeping;
    int32_t sleeping_slots, kept_capacity, free_sleeping;
    int32_t sleeping_count, sleeping_included;
    int32_t first_orphan, orphan_count; /* kept of pairs that ended since the last step */

    perp__saved_state begun, tried; /* adaptive.c: before the call, before the step tried; */
    perp__saved_state whole;        /* states where that leads as a whole */
    perp_world_contact *records;    /* of the last step, when they were asked for */
    int32_t record_count;
    int32_t record_capacity;
    int32_t recorded; /* they are up to date */
    perp_world_stats stats;
};

static inline int32_t perp__is_dynamic(const perp_world *world, int32_t body)
{
    return world->bodies[body].kind == PERP_BODY_DYNAMIC;
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

#endif
