/* What the files of the world share: the objects and who writes what. A step goes through
 *
 *   place        rotations, mass matrices and free velocities of the bodies    (motion.c)
 *   contact set  contact points that can close within the step                 (contact_set.c)
 *   islands      bodies that touch, directly or through others                 (island.c)
 *   solve        per island: rows, complementarity problem, exact velocities   (contact_rows.c,
 *                                                                    solve.c, velocity.c)
 *   judge        what that is worth, each contact beside its own terms         (verdict.c)
 *   sweep        where a budget or a method ended short of an answer           (sweep.c)
 *   integrate    the next positions                                            (integrate.c)
 *   project      what penetrates is pushed apart                               (projection.c)
 *   commit       next states become states, records become the last step's     (step.c)
 *
 * within a budget (budget.c), and nothing that a caller can see changes before the commit. */
#ifndef PERP_WORLD_WORLD_H
#define PERP_WORLD_WORLD_H

#include <perp/lcp.h>
#include <perp/world.h>

#include "base/arena.h"
#include "base/handle.h"
#include "base/outcome.h"
#include "world/collide/collide.h"

#define PERP__MAX_DIRECTIONS 64
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
    int32_t next_free;
    int32_t spherical; /* inertia is a multiple of the identity: no gyroscopic term */
    double mass;
    double inverse_mass; /* 0 unless dynamic, as the matrices below */
    double inertia[9];
    double inverse_inertia[9];
    double factor[9];         /* C with inverse_inertia = C C' */
    double inverse_factor[9]; /* C^-1 */
    double radius;  /* of the sphere about the mass centre that holds the bounded shapes */
    int32_t planes; /* half-spaces among the shapes */
} perp__body;

typedef struct perp__shape {
    uint32_t generation;
    int32_t alive;
    int32_t next_free;
    int32_t body;
    double friction;
    double restitution;
    double offset[3];
    double rotation[9];
    double radius; /* of the sphere about the shape's centre; 0 for a half-space */
    perp__geometry geometry;
} perp__shape;

/* What holds a body still relative to a rigid motion: a kinematic body's slot, the static world, or
 * nothing. */
enum { PERP__ROOT_STATIC = -1, PERP__ROOT_NONE = -2 };

/* How the solve of a body's island went. */
typedef struct perp__verdict {
    perp_outcome outcome;
    int32_t stages; /* 0: nothing to solve, 1, 2: with an impact */
    double residual;
} perp__verdict;

/* A body within the step. Twists are (velocity, angular velocity), world frame. */
typedef struct perp__motion {
    double rotation[9];
    double inverse_mass;
    double root_mass; /* square roots of mass and inverse mass */
    double root_inverse_mass;
    double inverse_inertia[9]; /* world frame */
    double factor[9];          /* L with inverse_inertia = L L', world frame */
    double inverse_factor[9];
    double start[6];  /* twist before the step */
    double free[6];   /* twist that forces alone would give */
    double moving[6]; /* twist that moves the positions: the first stage's; of a body that nothing
                         touches, the mean of start and free */
    double after[6];  /* twist after the step */
    double solved[6]; /* twist as the complementarity problem's solution gives it */
    double reach;     /* largest speed of a point of it that the margins allow for */
    int32_t touched;  /* has contact points in this step */
    int32_t island;   /* -1: none */
    int32_t local;    /* number within the island */
    int32_t first_link;
    perp__verdict verdict;
    /* velocity.c */
    double strength; /* size of the terms of its velocity in the mass metric: what rounding is
                        measured against */
    int32_t held;    /* its velocity is known */
    int32_t root;    /* PERP__ROOT_..., or the kinematic body that carries it */
    int32_t group;   /* named after its first body */
    int32_t column;
} perp__motion;

typedef struct perp__world_contact {
    int32_t body_a;
    int32_t body_b;
    int32_t shape_a;
    int32_t shape_b;
    double position[3];
    double axes[3][3]; /* normal, tangent 1, tangent 2 */
    double gap;
    double rounding; /* gaps below this are not told apart from 0 */
    double size;     /* of the two bodies */
    double friction;
    double restitution;
    double rows[2][3][6];     /* J of A and of B: relative velocity = J_A twist_A + J_B twist_B */
    double response[2][3][6]; /* M^-1 J' */
    double start[3];          /* relative velocity before the step */
    double free[3];           /* with the free twists */
    double target;            /* where the contact is closed, the normal velocity is this */
    double impulse[3];
    double slip; /* 0: the solution holds it tangentially, if it presses */
    double velocity[3];
    int32_t first_row; /* in the island's problem */
    int32_t edges;     /* friction directions; 0: frictionless, one row */
    int32_t included;  /* takes part in the problems; the others were found not to matter */
    int32_t fresh;     /* included since its island was solved last */
    int32_t closed;    /* holds in normal direction */
    int32_t sticks;    /* holds tangentially too */
} perp__world_contact;

/* Contact `contact` seen from one of its bodies. */
typedef struct perp__link {
    int32_t contact;
    int32_t side; /* 0: A, 1: B */
} perp__link;

typedef struct perp__contact_set {
    perp__world_contact *contacts;
    int32_t count;
    int32_t capacity;
} perp__contact_set;

typedef struct perp__island {
    int32_t first_body; /* in body_order */
    int32_t bodies;
    int32_t first_contact; /* in contact_order */
    int32_t contacts;
    int32_t rows;
} perp__island;

/* Workspace of one island, large enough for the largest. */
typedef struct perp__island_work {
    int32_t max_rows;
    int32_t max_contacts;
    int32_t max_bodies;
    int32_t max_held_rows; /* rows and columns of velocity.c */
    int32_t max_columns;
    double *matrix; /* max_rows squared, column-major */
    double *q;
    double *z;
    double *held_rows; /* row by row */
    double *targets;
    double *norms;
    int32_t *taken;
    double *basis;
    double *particular;
    double *loose;
    double *unit;
    int32_t *group_bodies;
    perp_lcp_result result; /* of the last solve, */
    int32_t fresh;          /* which is that of the problem at hand */
    int32_t set_up;         /* the solver has the matrix of the island at hand */
} perp__island_work;

/* What the step may still spend. */
typedef struct perp__budget {
    int32_t limited;    /* by time */
    double until;       /* the phase at hand; on perp__now()'s clock */
    double deadline;    /* the step */
    int64_t iterations; /* left; INT64_MAX: no limit */
    int64_t spent;      /* iterations of all methods */
} perp__budget;

struct perp_world {
    PERP__HANDLE;
    perp_world_settings settings;
    int32_t dof;                       /* coordinates of a body: 3 planar, 6 */
    int32_t edges;                     /* friction directions: 2 planar */
    int32_t coordinate[PERP__MAX_DOF]; /* which entries of a twist they are */
    double edge[PERP__MAX_DIRECTIONS][2];

    perp__body *bodies;
    perp__state *states;
    int32_t body_slots;
    int32_t body_capacity;
    int32_t free_body; /* list of free slots, -1 at its end */
    perp__shape *shapes;
    int32_t shape_slots;
    int32_t shape_capacity;
    int32_t free_shape;
    uint64_t edition; /* counts bodies added and removed */

    /* the step's own memory, by size */
    perp__arena body_arena;
    perp__state *next;
    perp__motion *motions;
    int32_t *parent;
    int32_t *body_order;
    perp__island *islands;
    perp__arena shape_arena;
    perp__placed *placed;
    perp__extent *extents;
    perp__arena link_arena;
    int32_t *contact_order;
    perp__link *links;
    perp__arena island_arena;
    perp__island_work work;
    perp__pair *pairs;
    int32_t pair_count;
    int32_t pair_capacity;
    int32_t island_count;
    perp__contact_set contacts; /* of the step */
    perp__contact_set overlaps; /* of the projection */
    perp_lcp_solver *solver;
    perp_lcp_settings solver_settings;
    perp__budget budget;

    perp_world_contact *records; /* of the last step */
    perp_world_contact *next_records;
    int32_t record_count;
    int32_t next_record_count;
    int32_t record_capacity;
    perp_world_stats stats;
};

/* Opens a public call on a world: PERP_ERROR_HANDLE for what is none. perp__leave closes it. */
perp_status perp__world_enter(const perp_world *world);

/* Block of `size` bytes that starts with the first `used` bytes of `old`, which is released; NULL,
 * with `old` as it was, if there is no memory. */
void *perp__grown(perp_context *context, void *old, size_t used, size_t size);

/* Ids. */
uint64_t perp__id(int32_t slot, uint32_t generation);
perp_status perp__find_body(const perp_world *world, int32_t *slot, perp_body id);

/* body.c: adds a body from checked or unchecked, complete settings. */
perp_status perp__add_body(perp_world *world, perp_body *id, const perp_body_settings *settings);

/* Checks shared by bodies and shapes: a unit quaternion to 1e-6, which is normalised (one that is a
 * unit to rounding keeps its bits); z components that a planar world does not have. */
perp_status perp__check_quaternion(perp_context *context, const char *name, double *q);
perp_status perp__check_planar_vector(const perp_world *world, const char *name, const double *x);

/* mass.c: fills the mass properties of a dynamic body from settings->mass and inertia. */
perp_status perp__body_mass(const perp_world *world, perp__body *body, double mass,
                            const double *inertia);

/* Releases the shapes of a body; recomputes its bounding radius. */
void perp__remove_shapes(perp_world *world, int32_t body);

/* motion.c */
void perp__rotation_of(const perp_world *world, const perp__state *state, double *R);
void perp__place(perp_world *world, const perp__state *states);
void perp__free_velocities(perp_world *world, double h);
/* Every body moves as if nothing touched it. */
void perp__untouch(perp_world *world);
/* One step of Euler's equations in the body frame by the implicit midpoint rule: w to w_next. */
void perp__euler_step(const perp__body *body, double h, const double *w, const double *torque,
                      double *w_next);

/* contact_set.c */
/* How fast each body's points may move before contacts act. */
void perp__find_reaches(perp_world *world);
/* After a solve: raises the reach of bodies that turned out faster than the margins allow for;
 * returns how many, and then contacts may have been missed. */
int32_t perp__raise_reaches(perp_world *world);
perp_status perp__find_contacts(perp_world *world, double h);
/* Points of the pairs at hand, those that the step met unless others were found since. */
perp_status perp__find_overlaps(perp_world *world, double margin);
perp_status perp__find_near_pairs(perp_world *world, double margin);

/* island.c: islands of the dynamic bodies that the set's included contacts join. */
perp_status perp__build_islands(perp_world *world, const perp__contact_set *set);

/* contact_rows.c */
void perp__contact_frame(const perp_world *world, perp__world_contact *contact);
void perp__contact_jacobian(const perp_world *world, const perp__state *states,
                            perp__world_contact *contact);
void perp__relative_velocity(const perp_world *world, const perp__world_contact *contact,
                             size_t twist, double *u);
void perp__assemble_matrix(perp_world *world, const perp__contact_set *set,
                           const perp__island *island);

/* The twists of a motion by offset, for functions that take any of them. */
#define PERP__TWIST_START offsetof(perp__motion, start)
#define PERP__TWIST_FREE offsetof(perp__motion, free)
#define PERP__TWIST_MOVING offsetof(perp__motion, moving)
#define PERP__TWIST_AFTER offsetof(perp__motion, after)
#define PERP__TWIST_SOLVED offsetof(perp__motion, solved)

static inline double *perp__twist(perp__motion *motion, size_t twist)
{
    return (double *)((char *)motion + twist);
}

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

/* budget.c */
void perp__open_budget(perp_world *world);
/* Of the phase at hand; INFINITY without a limit. */
double perp__seconds_left(const perp_world *world);
void perp__spend(perp_world *world, int64_t iterations);
/* SOLVED if a complementarity problem of so many rows may be tried, else the limit in the way. */
perp_outcome perp__may_pivot(const perp_world *world, int32_t rows);
/* Whether there is time for exact velocities of an island. */
int32_t perp__may_hold(const perp_world *world, const perp__island *island);

/* verdict.c */
/* |L^-1 twist|: twice its square is the kinetic energy. */
double perp__mass_norm(const perp__motion *motion, const double *twist);
/* |L' row'|: the largest row-velocity of a twist of mass norm 1. */
double perp__row_norm(const perp__motion *motion, const double *row);
/* Size of the terms that make the relative velocity along an axis. */
double perp__axis_scale(const perp_world *world, const perp__world_contact *contact, int32_t axis);
/* The mu r_n that friction r needs: 1 on the boundary of the polygon of the edges. */
double perp__gauge(const perp_world *world, const double *r);
/* lambda: the largest speed against an edge. */
double perp__slip(const perp_world *world, const double *u);
/* The largest residual of a body or contact beside its own terms; `solved` and `strength` of the
 * bodies must be those of the impulses. */
double perp__own_residual(const perp_world *world, const perp__island *island, size_t twist);

/* sweep.c: works on `solved` of the bodies and the impulses of the contacts. */
/* No impulses, and the twists `from`; PERP__TWIST_SOLVED: 0. */
void perp__start_sweeps(perp_world *world, perp__contact_set *set, const perp__island *island,
                        size_t from);
/* Sweeps until nothing changes any more, or `seconds` and the least number have passed. */
void perp__sweep_island(perp_world *world, perp__contact_set *set, const perp__island *island,
                        double seconds);

/* island_work.c */
/* Makes the workspace fit the largest island. velocities: with that of velocity.c. */
perp_status perp__fit_island_work(perp_world *world, int32_t velocities);
/* Solves the problem of n rows, work.z from work.matrix and work.q; work.result tells how it went.
 * With work.set_up the matrix is that of the last call. */
perp_status perp__solve_rows(perp_world *world, int32_t n);

/* solve.c */
typedef struct perp__solve_summary {
    perp_outcome outcome;
    double residual;
    int32_t solved;  /* islands that needed a solve */
    int32_t impacts; /* and those that needed two */
} perp__solve_summary;

perp_status perp__solve_islands(perp_world *world, double h, perp__solve_summary *summary);

/* velocity.c: exact velocities of an island from its impulses. Writes evidence->own, what they are
 * worth; the rest of the evidence is that of the impulses. */
void perp__exact_velocities(perp_world *world, const perp__island *island, size_t twist,
                            perp__evidence *evidence);

/* integrate.c */
void perp__integrate(perp_world *world, double h);
void perp__turn(const perp_world *world, perp__state *state, const double *turn);

/* projection.c */
perp_status perp__project_overlaps(perp_world *world);

/* records.c */
perp_status perp__write_records(perp_world *world);

/* step.c */
perp_status perp__step(perp_world *world, perp_step_result *result, double h);

#endif
