/* Equilibrium as a convex problem (perp/statics.h), for the layers above: rows in blocks on a graph
 * of bodies, unchecked. Find impulses
 *
 *   A r = b,   r_i in K_i,        A = H', b = -forces
 *
 * Units are contacts, rows with bounds and joints; nodes are bodies, of `width` coordinates each. A
 * unit has up to 6 rows, and for each node that it pushes a link: its rows there, row after row. */
#ifndef PERP_CONTACT_STATICS_H
#define PERP_CONTACT_STATICS_H

#include <perp/statics.h>

#include "base/arena.h"
#include "contact/dynamics/dynamics.h"
#include "contact/tuning.h"

enum { PERP__STATICS_CONE, PERP__STATICS_INTERVAL, PERP__STATICS_FREE };
enum { PERP__STATICS_MOST_ROWS = 6 };

typedef struct perp__statics_unit {
    int32_t kind;
    int32_t row, rows; /* the first of r; a cone's: the normal, then these: */
    int32_t tangents;  /* 0, 1 or 2 */
    int32_t rolls;     /* 0, 1 or 2 */
    int32_t spins;     /* 0 or 1 */
    int32_t link, links;
    double mu, rolling, spinning; /* > 0 where there are such rows */
    double lower, upper;          /* of an interval; equal: a force */
} perp__statics_unit;

typedef struct perp__statics_link {
    int32_t node, reserved;
    size_t at; /* of `values`: rows by width */
} perp__statics_link;

typedef struct perp__statics_rows {
    int32_t width, nodes, units, size, links; /* size: of r */
    const perp__statics_unit *unit;
    const perp__statics_link *link;
    const double *values;
} perp__statics_rows;

/* How far a decision goes. */
typedef struct perp__statics_aim {
    int32_t objective;      /* PERP_STATICS_... */
    int32_t max_iterations; /* > 0 */
    double gap;         /* of the margin, beside it, and of what certificates prove; 0: the first
                           that there is will do */
    const double *load; /* nodes by width, or NULL: for safety */
} perp__statics_aim;

typedef struct perp__statics_answer {
    double *r; /* size; written where it stands */
    double *v; /* nodes by width; written where it falls */
    int32_t verdict, iterations;
    double margin, safety, unbalance, work;
} perp__statics_answer;

typedef struct perp__statics perp__statics;

/* The aim that a caller's settings ask for; NULL: the defaults. */
perp_status perp__statics_read_settings(perp_context *context, perp__statics_aim *aim,
                                        const perp_statics_settings *given);

/* A workspace; NULL where there is no memory. */
perp__statics *perp__statics_create(perp_context *context);
void perp__statics_destroy(perp__statics *statics);

/* Products of one factorisation with which a decision, some thirty of them, takes so long, at a
 * product a nanosecond. */
static inline double perp__statics_products(double seconds)
{
    return seconds * (1e9 / 30.0);
}

/* The rows of a problem: orders, lays out and copies them. Where a factorisation takes more
 * products than `most`, unless that is 0, all is indeterminate. PERP_OK or _MEMORY. */
perp_status perp__statics_set_up(perp__statics *statics, const perp__statics_rows *rows,
                                 double most);

/* Of what falls: impulses within the cones of contacts, near to balance. r: size. */
void perp__statics_nearest(perp__statics *s, double *r);
/* Decides. forces: nodes by width. PERP_OK or _MEMORY. */
perp_status perp__statics_decide(perp__statics *statics, perp__statics_answer *answer,
                                 const double *forces, const perp__statics_aim *aim);

/* Impulses `base` of the rows that were set up, for adjusting them to other forces:
 *
 *   r = base - D J (J' D J)^-1 (forces + J' base)
 *
 * D: in the metric of base's own place in its cones, so that what has little room moves little.
 * Base and the factor are kept until the next set-up or decision; from a base that is not strictly
 * inside all cones nothing can be adjusted. */
void perp__statics_keep(perp__statics *statics, const double *base);

/* Whether r is balanced and in all cones; then answer->r, margin (the least room left beside
 * base's) and unbalance are written. */
bool perp__statics_adjust(perp__statics *statics, perp__statics_answer *answer,
                          const double *forces);

/* Whether velocities of 0 answer dynamics with the forces f, contacts without bounds, and w that is
 * 0 but for the normals of open ones; then r: the least impulses that balance them: front.c. What
 * it works in is made at the first call, into *kept; what takes longer than `seconds` is not begun.
 * PERP_OK or _MEMORY. */
typedef struct perp__statics_front perp__statics_front;
perp_status perp__statics_rests(perp_context *context, perp__statics_front **kept,
                                const perp_contact_laws *laws, const perp__dynamics *dynamics,
                                const double *f, const double *w, double seconds, double *r,
                                int32_t *rests);
void perp__statics_front_release(perp_context *context, perp__statics_front *kept);

#endif
