/* The state that the parts of methods `admm` and `proximal` share: contacts in the space of bodies,
 * or, where W alone is known, in that of impulses.
 *
 * With x = r / s and u times s, s = 1 / (m sqrt(t)) for the normal, m = min(mu, 1) or 1 / FIRST_RHO
 * if that is more, 1 / sqrt(t) for tangents, over the part's unit omega, t the trace of W_kk,
 *
 *   u = J v + q,   v = J'x,   x = P(x - rho u)  for any rho > 0,
 *   P(z) = (z_n^+, z_t on the disc of radius mu / m z_n^+),
 *
 * which is Signorini's and Coulomb's law of a contact as it stands (Alart & Curnier 1991). What
 * rolls or spins has a disc more for each, in a scale of its own trace; what holds both ways keeps
 * its normals as they are, and |z_N| stands for z_n^+. Rows of contacts without
 * friction are their normals alone; of rows with two bounds, scaled, P is the nearest point between
 * these, and of bilateral rows the identity. J is P of
 * bodies.h, scaled, and a row that yields moves a body of its own; where W alone is known J is W,
 * scaled on both sides, v = x, and for J' read the identity throughout. */
#ifndef PERP_CONTACT_PROXIMAL_H
#define PERP_CONTACT_PROXIMAL_H

#include "contact/bodies/bodies.h"
#include "contact/cones.h"
#include "contact/method.h"
#include "linalg/fronts/fronts.h"

/* Stiffness of the first sweeps, of the next and of Newton's first centre, and of that from where
 * an answer is near: each as much more. */
#define PERP__FIRST_RHO 10.0
#define PERP__CENTRE_RHO (PERP__FIRST_RHO * PERP__FIRST_RHO)
#define PERP__WARM_RHO (PERP__FIRST_RHO * PERP__CENTRE_RHO)

/* What belongs to a part of the problem: one range of each. */
typedef struct perp__proximal_part {
    int32_t constraint, last_constraint, row, last_row, block, last_block;
} perp__proximal_part;

/* The discs of a constraint that rolls or spins, or holds both ways: their rows follow each other,
 * behind the normals. */
typedef struct perp__discs {
    int32_t both; /* normals that hold both ways; 0: an ordinary one */
    int32_t count, sizes[3];
    double radii[3];
} perp__discs;

static inline int32_t perp__discs_first(const perp__discs *discs)
{
    return discs->both > 0 ? discs->both : 1;
}

/* The width of blocks that are whole parts is a multiple of this: two lanes. */
enum { PERP__WHOLE_STEP = 8 };

typedef struct perp__proximal {
    perp__contact_work common;
    /* constraints and blocks in the order of their parts */
    int32_t width, constraints, blocks, parts;
    perp__proximal_part *part;
    int32_t by_rows;             /* J is W, J' the identity */
    int32_t whole;               /* without bodies: a block a part, not a constraint */
    int32_t *home;               /* of constraints, by_rows: where in v their rows are */
    int32_t *constraint, *place; /* a constraint's number in the problem, and back */
    int32_t *block, *number;     /* the same of blocks; -1 - k: constraint k has it to itself */
    int32_t *mark;               /* blocks: work */
    int32_t *starts;             /* constraints + 1: own rows */
    double *radius;            /* constraints: of the disc; < 0: - the bound of a row of any sign */
    struct perp__discs *discs; /* constraints: that roll, spin or hold both ways; NULL: none */
    double *scale;             /* rows: s */
    int64_t *piece_starts;     /* constraints + 1 */
    int32_t *piece_blocks;     /* own */
    int64_t *value_starts;     /* constraints: the pieces of one follow each other */
    double *values;            /* as in bodies.h, scaled */
    double *sloping, *images;  /* parts that are blocks, not by rows: rows with K, and -K J */
    int64_t *slot_starts;      /* constraints */
    int32_t *slots;            /* pieces by pieces of each constraint: edges of the graph */
    int32_t *graph_starts, *graph; /* of blocks that share a constraint */
    perp__fronts fronts;
    double *q;                                        /* rows */
    double *x, *z, *y, *best, *start, *speed, *spare; /* rows */
    double *r, *u;                         /* size: as the problem knows them, over omega */
    int32_t side;                          /* of K: 3, or 6 where there are discs */
    double *K;                             /* constraints: side by side, by columns */
    double *v, *step, *image, *rhs, *rest; /* blocks by width */
    perp__cone *cones;                     /* constraints: of the interior point */
    int32_t splits;                        /* nothing but alternating directions */
    int64_t limit;                         /* of sweeps then, else of factorisations */
    int64_t factorisations, sweeps;
    double residual, best_residual, tol; /* tested ones, of the part */
    double aim;                          /* what is worth a few steps where tol is met */
    perp_outcome outcome;                /* what stopped it, or -1 */
    int32_t folds;                       /* the interior point's path ended next to its beginning */
} perp__proximal;

/* Rows and graph of the problem; PERP_OK or _MEMORY: rows.c. And, with W alone, how many pairs of
 * constraints are coupled at most. */
int64_t perp__proximal_couplings(const perp__contact_problem *problem);
void perp__proximal_layout(perp__arena *arena, void *work);
perp_status perp__proximal_read(void *work);

/* K of constraint k. */
static inline double *perp__proximal_slope(const perp__proximal *s, int32_t k)
{
    return s->K + (size_t)(s->side * s->side) * (size_t)k;
}

/* passes.c: over the constraints of a part. x := P(x). */
void perp__proximal_project(const perp__proximal *s, const perp__proximal_part *part, double *x);
/* z := x - rho (speed + J v), y := P(z), rhs := J'(y - x). */
void perp__proximal_visit(const perp__proximal *s, const perp__proximal_part *part, double rho,
                          const double *v);
/* K := rho P'(z). */
void perp__proximal_slopes(perp__proximal *s, const perp__proximal_part *part, double rho);
/* One sweep of ADMM but for the solution with I + rho J'J: z, from v and y unless `first`, then x
 * and the right side, in `rhs`. */
void perp__proximal_split(const perp__proximal *s, const perp__proximal_part *part, double rho,
                          int32_t first);
/* u := J v + q; q: NULL, or of rows. */
void perp__proximal_move(const perp__proximal *s, const perp__proximal_part *part, const double *v,
                         const double *q, double *u);
/* out := J'x */
void perp__proximal_push(const perp__proximal *s, const perp__proximal_part *part, const double *x,
                         double *out);
/* out := J' K J v + v. */
void perp__proximal_apply(const perp__proximal *s, const perp__proximal_part *part, const double *v,
                          double *out);
/* Factors I + J' K J. Returns 0 where that fails. */
int32_t perp__proximal_factor(perp__proximal *s, const perp__proximal_part *part);

/* The tested residual of P(x), which takes the place of x; keeps the best, leaves its speeds. */
double perp__proximal_residual(perp__proximal *s, const perp__proximal_part *part, double *x,
                               double *speed);

/* s->step := (I + J'KJ)^-1 s->rhs by the last factors, refined once where asked for: proximal.c. */
void perp__proximal_find_step(perp__proximal *s, const perp__proximal_part *part, bool refines);

/* -1 to go on, or what to stop with. And whether there is a reason to go on at all. */
int32_t perp__proximal_asks_to_stop(const perp__proximal *s);
bool perp__proximal_goes_on(const perp__proximal *s, double enough);

/* An interior point method, from no impulses, for parts without discs: interior.c. s->x is its best
 * point, or its end where s->best_residual is of another. */
void perp__proximal_interior_run(perp__proximal *s, const perp__proximal_part *part);

#endif
