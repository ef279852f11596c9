/* Rows with bounds of their own, lower <= r_i <= upper, said in words that every method knows. With
 * r = shift + sign x:
 *
 *   lower alone    r = lower + x:    a contact without friction, 0 <= x perp u >= 0
 *   upper alone    r = upper - x:    the same of -u
 *   neither        a bilateral row
 *   both           r = middle + x, |x| <= (upper - lower) / 2 = F: a planar contact with mu = 1
 *                  whose normal moves nothing but yields by c, 0 = c x_n - c F
 *
 * The last are judged by their one row (law.h: problem->bound). Rows of the caller's problem are
 * 'given', those of the methods 'own'.
 *
 * A shift to a bound of 1e9, or to the middle between it and 0, would drown impulses of 1 in its
 * rounding, and in the size of W shift what the verdict asks of them. So bounds count as no further
 * off than a call's impulses are likely to reach; if one reaches such a bound, that moves off. */
#ifndef PERP_CONTACT_BOUNDED_H
#define PERP_CONTACT_BOUNDED_H

#include <perp/contact.h>

#include "base/arena.h"
#include "contact/dynamics/dynamics.h"

/* Compressed columns of our own. */
typedef struct perp__contact_lines {
    int32_t *starts, *indices;
    double *values;
    int64_t room; /* entries */
} perp__contact_lines;

typedef struct perp__contact_bounded {
    perp__arena arena;
    int32_t count;                  /* rows with bounds; 0: nothing here is in use */
    int32_t contacts, rows, size;   /* given: contacts, rows before the bilateral ones, and all */
    int32_t own_contacts, own_rows; /* the contacts of what the methods get */
    int32_t free;                   /* own bilateral rows among the bounded */
    int32_t n;                      /* columns of H; of W: size */
    int32_t by_W, boxes, shifts, given; /* given: own rows are the given ones */
    perp__matrix H, G;                  /* given; W as H */
    const double *lower, *upper;
    perp__contact_lines lines[2]; /* own H and G; or W */
    double *low, *high;           /* count */
    double *reach, *likely;       /* count: how far from the bounds' nearest to 0 impulses may be */
    double *near_low, *near_high; /* count: the bounds, no further off than that */
    int32_t *contact_of;          /* count: own contact, -1: bilateral */
    int32_t *row;                 /* size: own row */
    double *sign, *shift;         /* size */
    double *bound;             /* the solver's: x_n of those with two bounds, by near_...; else 0 */
    double *compliance;        /* the solver's */
    double *f, *w, *r0, *work; /* of a call; f: or q */
    double *load;              /* own size: |q| at the impulses nearest to 0 */
    double *away;              /* own size: x + away is counted from those */
} perp__contact_bounded;

/* Counts what the methods get: own_contacts, own_rows, free. `rows` of `contacts` come before. */
void perp__contact_bounded_count(perp__contact_bounded *set, const perp_contact_laws *laws,
                                 int32_t rows);

/* Appends contacts to those that the solver keeps, and makes its views of H and G, or of W, those
 * of own's copies. PERP_OK or _MEMORY. */
perp_status perp__contact_bounded_read(perp_contact_solver *solver, const perp_contact_laws *laws);

/* Whether there are bounds that a shift to could drown impulses in. */
bool perp__contact_bounded_is_far(const perp__contact_bounded *set);

/* The bounds of the next call, by own->reach; and own->away. */
void perp__contact_bounded_draw_in(perp__contact_bounded *set);

/* Lets impulses x, with velocities u, that are at a bound which is not the caller's reach further,
 * as far as is likely at least (own->likely); and all where there are said to be none, which bounds
 * further off might change. Returns 0 if x may stay. */
bool perp__contact_bounded_widen(perp__contact_bounded *set, const double *x, const double *u,
                                 bool is_ray);

/* Chooses c anew, by W, dense, in the place of a callback that does not tell M. */
void perp__contact_bounded_yield(perp__contact_bounded *set, const double *W);

/* Rows of contact k, without those that roll or spin. */
static inline int32_t perp__contact_dim(const perp_contact_laws *laws, int32_t k)
{
    return laws->dims ? laws->dims[k] : laws->dim;
}

struct perp__contact_call;

/* The methods' f, w, b (q) and r0 of a call. */
void perp__contact_bounded_pose(perp__contact_bounded *set, const struct perp__contact_call *given,
                                struct perp__contact_call *call);

/* Own impulses, velocities and modes as the caller knows them. A ray, a direction of impulses,
 * changes as velocities do. */
void perp__contact_bounded_impulses(const perp__contact_bounded *set, const double *x, double *r);
void perp__contact_bounded_velocities(const perp__contact_bounded *set, const double *x, double *u);
void perp__contact_bounded_modes(const perp__contact_bounded *set, const int8_t *modes,
                                 const double *x, const double *u, int32_t *given);

#endif
