/* The law of one contact: its friction parts, projections, natural maps and distances, for exact
 * and polyhedral cones. Vectors are those of the whole problem. */
#ifndef PERP_CONTACT_LAW_H
#define PERP_CONTACT_LAW_H

#include <float.h>
#include <math.h>

#include "contact/method.h"
#include "linalg/matrix.h"

/* Sliding, rolling or spinning friction: `size` rows from `row` on, r_part in a disc (2 rows) or an
 * interval (1) of radius coefficient * r_n. */
typedef struct perp__contact_part {
    int32_t row, size;
    double coefficient;
} perp__contact_part;

/* Normals of contact k that hold both ways; 0: it is an ordinary one. */
static inline int32_t perp__contact_two_sided(const perp__contact_problem *problem, int32_t k)
{
    return problem->two_sided ? problem->two_sided[k] : 0;
}

/* Normals of contact k, which come before its tangents. */
static inline int32_t perp__contact_normals(const perp__contact_problem *problem, int32_t k)
{
    const int32_t both = perp__contact_two_sided(problem, k);

    return both > 0 ? both : 1;
}

/* Returns how many parts contact k has. */
int32_t perp__contact_parts(const perp__contact_problem *problem, int32_t k,
                            perp__contact_part parts[3]);

/* Whether contact k is a row with two bounds (bounded.h): its normal moves nothing, presses as it
 * does, and is no row of the law. */
static inline bool perp__contact_is_bound(const perp__contact_problem *problem, int32_t k)
{
    return problem->bound && problem->bound[k] > 0.0;
}

/* The first row of constraint k, a contact or a bilateral row, that its law is about. */
static inline int32_t perp__contact_first_row(const perp__contact_problem *problem, int32_t k)
{
    return problem->starts[k] + (k < problem->contacts && perp__contact_is_bound(problem, k));
}

/* Vertex j of the regular polygon with `edges` vertices in the unit circle, 0 at the first tangent;
 * opposite vertices are opposite to the last bit. */
void perp__contact_direction(int32_t edges, int32_t j, double d[2]);

/* r: normal impulses of contact k to >= 0, then the parts to the nearest point of their discs. */
void perp__contact_clip(const perp__contact_problem *problem, int32_t k, double *r);

/* What the law of a contact says of (r, u), r within its cone. */
typedef struct perp__contact_law {
    double natural;     /* |r - P_K(r - (u + s e_n) / t)| */
    double change;      /* smallest change of u for which (r, u) obey the law */
    double signorini;   /* |min(r_n, u_n / t)|, impulse */
    double bilateral;   /* |u_N| / t of two-sided ones, impulse */
    double cone;        /* how far r is outside, impulse */
    double dissipation; /* |r_t - P_D(r_t - u_t / t)|, impulse */
    int32_t mode;       /* PERP_CONTACT_..., by the side on which r - (u + s e_n) / t lies */
} perp__contact_law;

void perp__contact_outcome_of(const perp__contact_problem *problem, int32_t k, const double *r,
                              const double *u, perp__contact_law *law);

/* Friction from which a contact is judged normal and tangents apart, as those with discs are: the
 * map onto its cone, next to a half-space, has 1 / mu of a closing speed, and less of sliding. */
#define PERP__STEEP 1e3

/* law->natural alone; *mode: law->mode. */
double perp__contact_natural(const perp__contact_problem *problem, int32_t k, const double *r,
                             const double *u, int32_t *mode);

/* The tested residual of impulses r within their cones, with the velocities u. */
double perp__contact_tested(const perp__contact_problem *problem, const double *r, const double *u);

/* A sum of squares between this and its inverse has lost nothing to the range of doubles; nor has
 * the quotient of two such. */
#define PERP__SMALL sqrt(DBL_MIN)

/* |x| of the entries begin .. end-1. */
static inline double perp__contact_length(const double *x, int32_t begin, int32_t end)
{
    double sum = 0.0;

    for (int32_t i = begin; i < end; i++)
        sum += x[i] * x[i];
    return sum >= PERP__SMALL && sum <= 1.0 / PERP__SMALL ? sqrt(sum)
                                                          : perp__length(x + begin, end - begin);
}

/* What the friction of contact k grows with: r_n, or |r_N|. */
static inline double perp__contact_pressure(const perp__contact_problem *problem, int32_t k,
                                            const double *r)
{
    const int32_t row = problem->starts[k], both = perp__contact_two_sided(problem, k);

    return both > 0 ? perp__contact_length(r, row, row + both) : r[row];
}

/* omega of the tested residual, of each contact and bilateral row: the largest |q_k| / sqrt(t_k) of
 * its part, an impulse times the root of an inverse mass; 1 if that is 0. drive: parts: the maxima
 * as they are. part: NULL if there is only one part. */
void perp__contact_omegas(const perp__contact_problem *problem, const int32_t *part, int32_t parts,
                          double *drive, double *omega);

/* A power of two near x, within what has an inverse; 1 where there is none. */
double perp__contact_power_near(double x);

/* Constraints of contact or bilateral row k in which traces and omegas are 1, as near as powers of
 * two come: what an LCP of its rows is given in. */
void perp__contact_units(const perp__contact_problem *problem, int32_t k, double *impulse,
                         double *velocity);

/* Whether the couplings between constraints a and b are more than noise. */
static inline bool perp__contact_couples(const perp__contact_problem *problem, int32_t a, int32_t b)
{
    return !problem->part || problem->part[a] == problem->part[b];
}

#endif
