/* Frictional contact problems with redundant contacts, in the form that other simulators hand over:
 *   M v = f + H' r,   u = H v + w,   one row of normal and dim - 1 of tangents a contact,
 * the velocities of one step of length 1/100 under gravity. Columns, towers and walls of boxes that
 * touch in 4 points, pyramids and random heaps of balls; from one contact to hundreds of thousands,
 * in linear time. The same options give the same bits on one machine. Free of the test framework,
 * so that benchmarks use it too. */
#ifndef PERP_TESTS_PILES_H
#define PERP_TESTS_PILES_H

#include "calls.h"
#include "gen.h"

enum piles_class {
    PILES_COLUMN, /* boxes on boxes, as many columns as it takes */
    PILES_TOWER,  /* layers of three bars, crossed: 36 contacts a layer */
    PILES_WALL,   /* bricks in bond */
    PILES_BALLS,  /* a pyramid, a ball on four */
    PILES_HEAP,   /* balls of various sizes, some of them touch, others are a gap apart */
    PILES_CLASSES
};

enum piles_order { PILES_ANY_ORDER, PILES_HEAVY_ON_LIGHT, PILES_LIGHT_ON_HEAVY, PILES_ALTERNATING };
enum piles_motion { PILES_REST, PILES_PUSH, PILES_IMPACT };

typedef struct piles_options {
    uint64_t seed;
    int32_t class;
    int32_t contacts;   /* about as many */
    int32_t layers;     /* that many high at most; 0: as the class likes */
    int32_t dim;        /* 1, 2, 3, or 0: contact by contact */
    double mass_ratio;  /* heaviest over lightest */
    int32_t order;      /* of the masses */
    double mu;          /* < 0: 0, 0.3, 1 or 1000, contact by contact */
    int32_t motion;     /* at rest, some bodies pushed, all moving */
    double restitution; /* Moreau's */
    int32_t gaps;       /* 1: every other contact is open */
    int32_t moved;      /* the whole turned and shifted at random */
    int32_t shuffled;   /* contacts in random order; otherwise from the ground up */
} piles_options;

typedef struct piles {
    int32_t bodies, n, contacts, rows; /* n = 6 bodies */
    int32_t *dims;                     /* contacts */
    double *mu;                        /* contacts */
    double *f, *w;                     /* n; rows */
    perp_matrix M, H;                  /* CSC: n by n, rows by n */
    int32_t *M_starts, *M_rows, *H_starts, *H_rows;
    double *M_values, *H_values;
} piles;

/* PILES_COLUMN, 3-D, at rest, mu = 0.5, equal masses, turned at random. */
piles_options piles_defaults(void);
/* Options as various as they come, from a seed alone. */
piles_options piles_draw(uint64_t seed, int32_t contacts);
void piles_make(piles *p, const piles_options *options);
void piles_destroy(piles *p);
/* Of a call: views on p; and the defaults but for these two. */
perp_contact_laws piles_laws(const piles *p);
perp_contact_dynamics piles_dynamics(const piles *p);
perp_contact_settings piles_settings(int32_t method, double tol);
/* perp_contact_solve of it; v, u and r0 may be NULL. */
perp_status piles_solve(perp_context *context, const piles *p,
                        const perp_contact_settings *settings, perp_contact_result *result,
                        double *v, double *r, double *u, const double *r0);
const char *piles_class_text(int32_t class);

/* For piles_build.c and piles_rows.c: the scene. Contact normals point from body[0] to body[1]. */
enum { PILES_GROUND = -1 };

typedef struct piles_body {
    double position[3], velocity[6];
    double half[3]; /* a ball has three times its radius */
    double mass;
    double inertia[3][3];
} piles_body;

typedef struct piles_contact {
    int32_t body[2], dim;
    double point[3], normal[3], tangent[3];
    double gap, mu;
} piles_contact;

typedef struct piles_scene {
    int32_t bodies, contacts, body_room, contact_room;
    double down[3];
    piles_body *body;
    piles_contact *contact;
} piles_scene;

void piles_fill(piles_scene *s, gen_random *random, const piles_options *options);
void piles_assemble(piles *p, const piles_scene *s, const piles_options *options);

#endif
