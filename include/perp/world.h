/* perp/world.h: rigid bodies with contact and Coulomb friction.
 *
 * A step follows every island of bodies that touch through its length h: geometry frozen at the
 * start, velocities implicit (Stewart & Trinkle 1996, Anitescu & Potra 1997), over an interval of
 * length t with forces that alone would lead to v_f,
 *
 *   M (v+ - v_f) = J'r,      u = J v+
 *   0 <= r_n  perp  u_n + max(gap, 0) / t >= 0,      |r_t| <= mu r_n, opposed to u_t: the exact
 * cone
 *
 * which has a solution for every mu, h and number of contacts. Rows exist only for what the scene
 * needs: a frictionless contact is one row, a planar body has three coordinates, a body that
 * nothing touches costs no solve. Positions move with the mean of the velocities where contact
 * lasts, which is second order, else with those at the end.
 *
 * Restitution is Moreau's law, at the instant of the impact: where a contact with e > 0 closes
 * faster than the step's forces alone explain, the island goes there along its parabola, u_n jumps
 * so that u_n+ + e u_n- >= 0 at all contacts that touch, and the rest of the step begins. Neither
 * this nor Newton's or Poisson's law passes a chain of equal balls its first speed on to the last:
 * simultaneous impacts share it.
 *
 * What a step may cost is perp_world_settings.accuracy.
 *
 * Conventions. Any consistent units. A quaternion (w,x,y,z) maps body to world; velocities are
 * those of the mass centre in the world frame; inertia is about the mass centre in the body frame.
 * Planar worlds use x, y and an angle about z. gap > 0 is separated. A contact's normal points from
 * body A to body B; a normal impulse >= 0 pushes B along it; a normal velocity > 0 separates.
 * Contact components come as (normal, tangent 1, tangent 2), right-handed; planar, tangent 1 is the
 * normal turned by +90 degrees. A half-space is solid where n.x <= offset, n its normal brought to
 * length 1. A sphere of radius 0 is a point.
 */
#ifndef PERP_WORLD_H
#define PERP_WORLD_H

#include <perp/base.h>
#include <perp/contact.h>
#include <perp/statics.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct perp_world perp_world;

/* Ids by value; 0 is null. An id of something removed is recognised and refused. */
typedef uint64_t perp_body;
typedef uint64_t perp_shape;

/* Values never change. */
enum perp_body_kind_value {
    PERP_BODY_DYNAMIC = 0,  /* moved by forces and contacts */
    PERP_BODY_STATIC = 1,   /* never moves */
    PERP_BODY_KINEMATIC = 2 /* moves with the velocity it was given, whatever touches it */
};

/* What a step may cost. Islands of few contacts, and contacts among bodies with large ratios of
 * masses, are solved to tol; the others are at `exact`, and up to `accurate` get a fixed number of
 * sweeps: then 'iteration_limit' and the residual tell how far those came. Equations of joints are
 * met at every accuracy. docs/world.md has the numbers and the measured curve. Values never change.
 */
enum perp_accuracy_value {
    PERP_ACCURACY_FAST = 0,
    PERP_ACCURACY_STANDARD = 1,
    PERP_ACCURACY_ACCURATE = 2,
    PERP_ACCURACY_EXACT = 3
};

typedef struct perp_world_settings {
    size_t struct_size;
    double gravity[3];      /* default (0, 0, -9.81); planar: default (0, -9.81, 0) */
    int32_t planar;         /* 0 (default): three dimensions; 1: x-y plane */
    int32_t accuracy;       /* PERP_ACCURACY_...; default standard */
    int32_t cone;           /* friction in three dimensions: 0 (default) the exact cone; k,
                               even, 4 .. 64: the polyhedron of Stewart & Trinkle with k
                               edges, solved by pivoting at every accuracy */
    int32_t method;         /* PERP_CONTACT_METHOD_... of what is solved to tol; default auto */
    int32_t substeps;       /* of what is not, of four sweeps each; 0 (default): the accuracy's */
    int32_t max_iterations; /* of a whole step; 0 (default): the methods' own limits */
    int32_t strict;         /* 1: a step that is not solved leaves the state untouched;
                               0 (default): on a limit it advances with the best iterate */
    int32_t wakeful;   /* 1: steps of what rests are taken like all others, for the same bits at
                          more cost; 0 (default): they are skipped */
    double tol;        /* residual that counts as solved, see below; 0 (default): 1e-10
                          of what is solved exactly; of what is swept 1e-2, 1e-3, 1e-6
                          from fast to accurate */
    double time_limit; /* seconds for a whole step; 0 (default): none, and no decision
                          reads the clock */
    double friction;   /* mu >= 0 of shapes that have none of their own; default 0 */
    double error;      /* 0 (default): a step is one step; > 0, a length: it is taken in as many as
                          it needs for the estimated error of each to be below this, see
                          perp_world_step */
    /* Threads that take part in a step, 1 to 256; 0 (default): 1. Any number gives the same bits.
     * Those beyond the caller's are the world's, asleep between its steps, unless `run_tasks` is
     * there. The context's allocator is called by one thread at a time. Steps with a time_limit or
     * max_iterations, which all islands share, solve one island after the other. */
    int32_t threads;
    int32_t reserved;
    perp_run_tasks run_tasks; /* runs tasks, as many as `threads` at a time, on the caller's
                                 threads; NULL (default): the world has its own. Called within
                                 perp_world_step, some hundred times where a pile has more than
                                 16 000 contacts; it must not call perp. */
    void *tasks_user;         /* for run_tasks */
} perp_world_settings;

/* State and properties of a body that is about to be added. */
typedef struct perp_body_settings {
    size_t struct_size;
    int32_t kind; /* PERP_BODY_...; default dynamic */
    int32_t reserved;
    double mass;        /* > 0, or 0 (default): that of the shapes. Ignored unless dynamic. */
    double inertia[9];  /* body frame, about the mass centre, symmetric positive definite with the
                           triangle inequality, or all 0 (default): that of the shapes, see
                           perp_world_add_body. Planar: only inertia[8], about z. */
    double position[3]; /* mass centre; default 0 */
    double orientation[4]; /* unit quaternion (w,x,y,z) to 1e-6, normalised; default identity */
    double angle;          /* planar only, instead of orientation; default 0 */
    double velocity[3];    /* default 0 */
    double angular_velocity[3]; /* default 0. Planar: only [2]. */
} perp_body_settings;

/* What changes in time. Planar: z components are 0, orientation is ignored on input. */
typedef struct perp_body_state {
    size_t struct_size;
    double position[3];
    double orientation[4];
    double angle; /* planar only; 0 otherwise */
    double velocity[3];
    double angular_velocity[3];
    double force[3];  /* applied at the mass centre, world frame, kept until changed */
    double torque[3]; /* world frame, kept until changed. Planar: only [2]. */
} perp_body_state;

/* Material and place of a shape on its body. */
typedef struct perp_shape_settings {
    size_t struct_size;
    double friction; /* mu >= 0, or PERP_FRICTION_OF_WORLD (default); a pair's mu is the geometric
                        mean */
    double restitution; /* 0 .. 1; a pair's is the larger; default 0 */
    double offset[3];   /* of the shape's centre from the mass centre, body frame; default 0 */
    double rotation[4]; /* shape to body, unit quaternion; default identity. Planar: about z. */
    double density;     /* >= 0, mass a volume (planar: an area); default 1000, water in SI units */
} perp_shape_settings;

#define PERP_FRICTION_OF_WORLD (-1.0)

/* One contact point of the last step. Points that the step's velocities left open without any
 * impulse, and that were not near, are not among them. */
typedef struct perp_world_contact {
    size_t struct_size;
    perp_body body_a;
    perp_body body_b;
    perp_shape shape_a;
    perp_shape shape_b;
    double position[3]; /* midway between the two surfaces, at the start of the step */
    double normal[3];   /* from A to B */
    double tangent_1[3];
    double tangent_2[3]; /* planar: 0 */
    double gap;          /* at the start of the step */
    double impulse[3];   /* on B: normal, tangent 1, tangent 2, the sum over the step, in which
                            impacts may lie and beside joints these axes turn: what changes
                            momentum, as seen along them; exactly 0 where separated */
    double velocity[3];  /* of B relative to A after the step; exactly 0 where the contact holds */
    double friction;
    double restitution;
    int32_t mode; /* PERP_CONTACT_... */
    int32_t reserved;
} perp_world_contact;

typedef struct perp_step_result {
    size_t struct_size;
    int32_t outcome;    /* the worst of the islands': solved and rounding_limit are good */
    int32_t advanced;   /* 1 if the state moved on; 0 if it was left untouched */
    int64_t iterations; /* of all methods and problems of the step, projection included; what
                           rests takes none */
    double residual;    /* the largest tested residual of the islands' velocities, each beside its
                           island's numbers; where sweeps gave them, that of perp_world_step */
    int32_t contacts;
    int32_t islands; /* islands that needed a solve */
    int32_t steps;   /* that it was taken in: 1, unless settings.error or far turns say */
    int32_t reserved;
    double error; /* sum of their estimated errors; nan where steps were not chosen */
} perp_step_result;

typedef struct perp_world_stats {
    size_t struct_size;
    int32_t bodies;
    int32_t shapes;
    int32_t islands;        /* with contacts, last step */
    int32_t contacts;       /* contact points, last step */
    int32_t rows_normal;    /* of all contact problems, last step */
    int32_t rows_friction;  /* tangents of contacts with friction: one in the plane, else two */
    int32_t impacts;        /* islands that solved a second problem for restitution */
    int64_t iterations;     /* last step, as in its result */
    int64_t steps;          /* since creation */
    double residual;        /* last step, as in its result */
    double seconds_collide; /* since creation, by phase; of steps with few bodies awake one in 16 is
                               timed, for all of them */
    double seconds_solve;
    double seconds_integrate;
    double seconds_project;
    int32_t joints;
    int32_t rows_joint; /* of all joints, last step: equations, limits reached, motors and dry
                           friction */
} perp_world_stats;

/* Where the states of all bodies are: the numbers of slot k begin k strides (in bytes) after those
 * of slot 0. The ground is in slot 0; a body keeps its slot; that of a removed body keeps its last
 * numbers until another body gets it. */
typedef struct perp_world_states {
    size_t struct_size;
    int32_t slots;
    int32_t reserved;
    size_t pose_stride;
    size_t twist_stride;
    const double *position;         /* 3 numbers; a stride of poses */
    const double *orientation;      /* 4 numbers; planar: of the angle */
    const double *angle;            /* 1 number; 0 in three dimensions */
    const double *velocity;         /* 3 numbers; a stride of twists */
    const double *angular_velocity; /* 3 numbers; planar: only [2] */
} perp_world_states;

/* Set every field to its default. Return PERP_OK, or PERP_ERROR_ABI for NULL or an unknown size.
 * perp_world_settings_init takes the planar flag because gravity's default depends on it. */
PERP_API perp_status perp_world_settings_init(perp_world_settings *settings, size_t size,
                                              int32_t planar);
PERP_API perp_status perp_body_settings_init(perp_body_settings *settings, size_t size);
PERP_API perp_status perp_body_state_init(perp_body_state *state, size_t size);
PERP_API perp_status perp_shape_settings_init(perp_shape_settings *settings, size_t size);

/* Creates a world that holds one static body, the ground.
 * Returns: PERP_OK, PERP_ERROR_ARGUMENT, _NOT_FINITE, _ABI, _HANDLE, _BUSY or _MEMORY.
 * In:      settings: copied; NULL for the defaults in three dimensions. */
PERP_API perp_status perp_world_create(perp_context *context, perp_world **world,
                                       const perp_world_settings *settings) PERP_WARN_UNUSED;

/* Releases a world; NULL is allowed. Ignored inside a callback of the world's own context. */
PERP_API void perp_world_destroy(perp_world *world);

/* Returns the id of the world's static body; 0 if `world` is not a world. */
PERP_API perp_body perp_world_ground(const perp_world *world);

/* Adds a body, which has no shapes yet.
 *
 * What the settings leave open comes from the shapes that are added: the mass is the sum of density
 * times volume, the inertia that of the shapes where they are, in the ratio of the given mass to
 * theirs. The body's position and the shapes' offsets are those of the mass centre also then: a
 * step refuses a body whose inertia is left open and whose shapes have their mass centre elsewhere.
 * Shapes that overlap count twice, points and half-spaces nothing. A body whose shapes have no mass
 * has the mass 1 and the identity for inertia unless they are given.
 *
 * Returns: PERP_OK, PERP_ERROR_ARGUMENT (mass <= 0, inertia not positive definite, ...),
 *          _NOT_FINITE, _ABI, _HANDLE, _BUSY or _MEMORY. */
PERP_API perp_status perp_world_add_body(perp_world *world, perp_body *body,
                                         const perp_body_settings *settings) PERP_WARN_UNUSED;

/* Removes a body and its shapes; the ground can't be removed. */
PERP_API perp_status perp_world_remove_body(perp_world *world, perp_body body) PERP_WARN_UNUSED;

/* Read or replace what changes in time. set takes the whole state; orientation is normalised.
 * For a static body only position and orientation may be set. */
PERP_API perp_status perp_world_get_body(const perp_world *world, perp_body_state *state,
                                         perp_body body) PERP_WARN_UNUSED;
PERP_API perp_status perp_world_set_body(perp_world *world, const perp_body_state *state,
                                         perp_body body) PERP_WARN_UNUSED;

/* Mass and inertia of a body, given or of its shapes; infinite unless it is dynamic.
 * Out:     mass, inertia: 9 numbers, body frame, about the mass centre; planar: all but [8] are 0.
 *          Either may be NULL. */
PERP_API perp_status perp_world_get_mass(const perp_world *world, double *mass, double *inertia,
                                         perp_body body) PERP_WARN_UNUSED;

/* Tells where the states of all bodies are, to be read without copies.
 * Returns: PERP_OK, PERP_ERROR_ARGUMENT, _ABI, _HANDLE or _BUSY.
 * Out:     states: initialised by perp_struct_init. Its arrays belong to the world and show
 *          what the last step, set_body or restore left there, until a body is added or removed or
 *          the world is destroyed; then ask again. Don't write to them: they are not checked.
 * Cost:    none that grows with the world. */
PERP_API perp_status perp_world_get_states(const perp_world *world,
                                           perp_world_states *states) PERP_WARN_UNUSED;

/* The slot of a body in the arrays of perp_world_get_states, from 0 (the ground) on. */
PERP_API perp_status perp_world_body_slot(const perp_world *world, int32_t *slot,
                                          perp_body body) PERP_WARN_UNUSED;

/* The most corners that a convex hull may have; points that are no corners do not count. */
#define PERP_MAX_HULL_CORNERS 128

/* Add a shape to a body. `shape` may be NULL, `settings` NULL for the defaults.
 * radius >= 0 (a capsule's > 0). half_extents: 3 numbers > 0 (planar: the first 2). half_length:
 * >= 0, half of the segment along the shape's x axis all points of a capsule are within `radius`
 * of. points: count times 3 numbers (planar: the third is 0), of which the shape is the convex
 * hull; they may repeat and lie inside or on faces, and those less than 1.2e-7 of the size beyond a
 * face count as on it (where noise would tear the surface, as much as it takes). A hull that
 * encloses nothing, or has too many corners, is refused. The points are copied, and are measured
 * from the shape's centre, which need not be that of the hull.
 * normal: 3 numbers, not zero, normalised; a half-space, allowed on static and kinematic bodies
 * only, in the body's frame. Cost of a hull: points times faces. */
PERP_API perp_status perp_world_add_sphere(perp_world *world, perp_shape *shape, perp_body body,
                                           double radius,
                                           const perp_shape_settings *settings) PERP_WARN_UNUSED;
PERP_API perp_status perp_world_add_box(perp_world *world, perp_shape *shape, perp_body body,
                                        const double *half_extents,
                                        const perp_shape_settings *settings) PERP_WARN_UNUSED;
PERP_API perp_status perp_world_add_capsule(perp_world *world, perp_shape *shape, perp_body body,
                                            double radius, double half_length,
                                            const perp_shape_settings *settings) PERP_WARN_UNUSED;
PERP_API perp_status perp_world_add_hull(perp_world *world, perp_shape *shape, perp_body body,
                                         const double *points, int32_t count,
                                         const perp_shape_settings *settings) PERP_WARN_UNUSED;
PERP_API perp_status perp_world_add_plane(perp_world *world, perp_shape *shape, perp_body body,
                                          const double *normal, double offset,
                                          const perp_shape_settings *settings) PERP_WARN_UNUSED;

/* Advances the world by dt > 0.
 *
 * Returns: PERP_OK with the outcome in result->outcome, PERP_ERROR_ARGUMENT, _NOT_FINITE, _ABI,
 *          _HANDLE, _BUSY or _MEMORY; after a negative status the state is untouched.
 * Out:     result: initialised by perp_struct_init; or NULL.
 * 'solved' says: every island's problem is solved to tol beside its own numbers, and every body and
 * contact beside its own, however small they are beside their neighbours': momentum beside the
 * sizes of its terms, Signorini's law and slips beside those of the contact's velocity, friction
 * beside the contact's normal impulse. 'rounding_limit' says the same to sqrt(tol), where doubles
 * give no more.
 *
 * Islands that a level of accuracy gives a budget are judged by that level's tol, and else say
 * 'iteration_limit'. On a limit ('iteration_limit', 'time_limit') and where a method stalls, a few
 * sweeps over the contacts take over, which keep bodies apart as far as they come; at least eight
 * for each problem are made, also after the limit, and counted as iterations. A time limit is
 * overrun by that much, and by what a method does between two looks at the clock. Numbers beyond
 * the range of doubles, in states or contacts, are PERP_ERROR_NOT_FINITE.
 *
 * With settings.error > 0 the step is taken in steps that are chosen by their estimated error: the
 * largest difference between a step and its two halves, of any point of a body, in its place and
 * in what its velocity makes of it in such a step. Impacts, stops and releases are located so that
 * nothing moves by more than that in the step which holds one. Steps get no shorter than 2^-30 dt,
 * and what is left when a budget is spent is taken as one; result->error tells. Contact points are
 * those of the last step. Nothing that rests is skipped. After a negative status the contact points
 * are those of the step that was tried last.
 *
 * Where no step exists (outcome 'ray': restitutions differ on contacts that oppose each other, or
 * kinematic bodies close on one between them) the state is left untouched. */
PERP_API perp_status perp_world_step(perp_world *world, perp_step_result *result,
                                     double dt) PERP_WARN_UNUSED;

/* Replaces the gravity of the settings: 3 numbers, in a planar world [2] is 0.
 * Returns: PERP_OK, PERP_ERROR_ARGUMENT, _NOT_FINITE, _HANDLE or _BUSY. Snapshots don't hold it. */
PERP_API perp_status perp_world_set_gravity(perp_world *world,
                                            const double *gravity) PERP_WARN_UNUSED;

/* The contact points of the last step. index from 0 to perp_world_contact_count() - 1. The first
 * one that is asked for after a step makes the records of all, and may run out of memory. */
PERP_API int32_t perp_world_contact_count(const perp_world *world);
PERP_API perp_status perp_world_get_contact(const perp_world *world, perp_world_contact *contact,
                                            int32_t index) PERP_WARN_UNUSED;

/* A force and a torque on a body, for perp_world_statics. Planar: only torque[2]. */
typedef struct perp_world_load {
    size_t struct_size;
    perp_body body;
    double force[3]; /* at the mass centre, world frame */
    double torque[3];
} perp_world_load;

/* Decides whether the world, with velocities 0 and kinematic bodies held where they are, is in
 * equilibrium with gravity, the bodies' forces and the loads (perp/statics.h), and how far the
 * loads could grow. States and contact points stay as they are; what sleeps wakes.
 *
 * Returns: PERP_OK with the verdict; PERP_ERROR_ARGUMENT, _NOT_FINITE, _ABI, _HANDLE, _BUSY or
 *          _MEMORY: then result and *count are untouched.
 * Out:     contacts: the points that touch, at most `capacity` of them, each initialised by
 *             perp_struct_init; `impulse` is a force here, 0 where the world falls at that
 *             point's part. NULL: not wanted. *count: how many there are; NULL: not wanted.
 *          velocities: 6 numbers (velocity, angular velocity) for each slot of a body
 *             (perp_world_body_slot, perp_world_states.slots): the virtual velocity of a part that
 *             falls, 0 elsewhere. NULL: not wanted.
 *          result: the worst verdict of the parts, the least margin and safety.
 * In:      settings: NULL for the defaults. loads: load_count of them, of dynamic bodies.
 * Cost:    that of a step, and a few factorisations; memory for the largest part. */
PERP_API perp_status perp_world_statics(perp_world *world, perp_world_contact *contacts,
                                        int32_t capacity, int32_t *count, double *velocities,
                                        perp_statics_result *result,
                                        const perp_statics_settings *settings,
                                        const perp_world_load *loads,
                                        int32_t load_count) PERP_WARN_UNUSED;

/* Kinetic and potential energy (zero height at the origin) of the dynamic bodies. Either output may
 * be NULL. */
PERP_API perp_status perp_world_energy(const perp_world *world, double *kinetic,
                                       double *potential) PERP_WARN_UNUSED;

/* Linear momentum, and angular momentum about the origin, of the dynamic bodies; 3 numbers each.
 * Either output may be NULL. */
PERP_API perp_status perp_world_momentum(const perp_world *world, double *linear,
                                         double *angular) PERP_WARN_UNUSED;

PERP_API perp_status perp_world_get_stats(const perp_world *world,
                                          perp_world_stats *stats) PERP_WARN_UNUSED;

/* Save and restore what the next step reads: the states of all bodies and the impulses of the last
 * step. The blob is `size` bytes as told by perp_world_snapshot_size at the time of saving, and is
 * valid for this world while no body is added or removed (PERP_ERROR_ARGUMENT otherwise). A
 * restored world continues with the same bits. Restoring may return PERP_ERROR_MEMORY. */
PERP_API perp_status perp_world_snapshot_size(const perp_world *world,
                                              size_t *size) PERP_WARN_UNUSED;
PERP_API perp_status perp_world_snapshot_save(const perp_world *world, void *blob,
                                              size_t size) PERP_WARN_UNUSED;
PERP_API perp_status perp_world_snapshot_restore(perp_world *world, const void *blob,
                                                 size_t size) PERP_WARN_UNUSED;

#ifdef __cplusplus
}
#endif

#endif
