/* Scenes of rigid bodies in contact, and the complementarity problem of one step of Stewart and
 * Trinkle (1996) on them:
 *   M = [[B' m^-1 B, (0; E)], [(mu, -E'), 0]],  q = (N' v + gap / h, D' v, 0),  B = [N D],
 * with v the velocities that gravity alone leads to, friction directions in pairs d, -d and gaps >=
 * 0: solvable whatever friction, masses and number of contacts. Free of the test framework, so that
 * benchmarks use it too. */
#ifndef PERP_TESTS_SCENE_H
#define PERP_TESTS_SCENE_H

#include "gen.h"

enum { SCENE_GROUND = -1 };

/* The classes. Those called planar move in x-y only and have two directions of friction. */
enum scene_class {
    SCENE_STACK,         /* boxes upon boxes, a grid of contacts a face */
    SCENE_PUSHED,        /* a box pushed over the floor, its face a grid of contacts */
    SCENE_WEDGE,         /* a block in a groove, driven in or pulled out */
    SCENE_TABLE,         /* a plate on legs in a circle, a load on top */
    SCENE_WALL,          /* bricks in bond */
    SCENE_TOWER,         /* layers of three bars, crossed */
    SCENE_PILE,          /* balls in a pyramid */
    SCENE_RANDOM,        /* any two bodies, any normals */
    SCENE_PLANAR_WALL,   /* boxes in a pyramid */
    SCENE_PLANAR_ARCH,   /* wedge stones between two abutments */
    SCENE_PLANAR_PEG,    /* pegs in holes: normals that oppose each other */
    SCENE_PLANAR_RANDOM, /* any two bodies, any normals */
    SCENE_CLASSES
};

enum scene_order { SCENE_LIGHT_ON_HEAVY, SCENE_HEAVY_ON_LIGHT, SCENE_ALTERNATING, SCENE_ANY_ORDER };
enum scene_motion { SCENE_REST, SCENE_PUSH, SCENE_IMPACT };
enum scene_scaling { SCENE_PLAIN, SCENE_SYMMETRIC, SCENE_ROWS };

/* All that a problem depends on. The same options give the same problem; `version` of the
 * generator is part of a problem's name. */
#define SCENE_VERSION 1
typedef struct scene_options {
    uint64_t seed; /* of all that is random below */
    int32_t class;
    int32_t contacts;   /* about as many; the class rounds to what it can build */
    int32_t directions; /* even, 4 .. 16; planar: 2, whatever is asked for */
    double mass_ratio;  /* heaviest over lightest body */
    int32_t order;
    double mu;          /* of every contact; < 0: 0, 0.3, 1 or 1000, contact by contact */
    int32_t gaps;       /* 1: every other contact is open */
    double jitter;      /* contact points are off by so much of a body's size */
    int32_t motion;     /* at rest, one body pushed, or all moving */
    int32_t duplicated; /* contacts that occur twice */
    int32_t moved;      /* the scene is turned and shifted at random */
    int32_t permuted;   /* variables in random order */
    int32_t scaling;    /* symmetric: row and column i by s_i; rows: row i by s_i; 1e-6 .. 1e6 */
} scene_options;

typedef struct scene_body {
    double position[3], rotation[3][3]; /* rows: the body's axes */
    double half[3];
    double mass, inertia[3];
    double velocity[6];
    double inverse[6][6]; /* mass matrix^-1 in the world's axes */
} scene_body;

/* The normal points from body[0] to body[1]. */
typedef struct scene_contact {
    int32_t body[2];
    double point[3], normal[3], tangent[3];
    double gap, mu;
} scene_contact;

typedef struct scene {
    int32_t planar, bodies, contacts;
    scene_body *body;
    scene_contact *contact;
} scene;

/* scene_build.c */
int32_t scene_add_box(scene *s, double x, double y, double z, double a, double b, double c);
/* count1 x count2 contacts on the parallelogram of corner, edge1 and edge2. */
void scene_add_face(scene *s, int32_t below, int32_t above, const double corner[3],
                    const double edge1[3], const double edge2[3], const double normal[3],
                    int32_t count1, int32_t count2);
void scene_add_contact(scene *s, int32_t below, int32_t above, const double point[3],
                       const double normal[3]);
void scene_cross(const double a[3], const double b[3], double c[3]);
void scene_unit(gen_random *random, int32_t planar, double x[3]);
void scene_release(scene *s);

/* scene_class.c: bodies and contacts of a class, at rest, without masses. */
void scene_fill(scene *s, gen_random *random, int32_t class, int32_t contacts);

/* scene_finish.c: masses, friction, gaps, velocities, jitter, duplicates, the rigid motion. */
void scene_finish(scene *s, gen_random *random, const scene_options *options);

/* scene_lcp.c */
const char *scene_class_text(int32_t class);
/* Options as various as they come, from a seed alone. */
scene_options scene_draw(uint64_t seed);
void scene_lcp(gen_lcp *problem, const scene_options *options);

#endif
