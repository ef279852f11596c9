/* The interior point's own things, shared by the files of this folder alone. */
#ifndef PERP_CONTACT_STATICS_INTERIOR_H
#define PERP_CONTACT_STATICS_INTERIOR_H

#include <math.h>

#include "contact/cones.h"
#include "contact/statics/statics.h"

/* What is maximised: the margin s; nothing, but least squares are minimised. */
enum { PERP__AIM_MARGIN, PERP__AIM_LEAST };

/* A number in doubled precision. */
typedef struct perp__pair {
    double high, low;
} perp__pair;

struct perp__statics {
    perp_context *context;
    perp__arena arena, doubled_arena;
    size_t edges, squares, widest, numbers; /* of `edge`, F and P, and the rows' */
    const perp__statics_rows *rows;         /* `kept`, the workspace's own: */
    perp__fronts fronts;
    perp__statics_rows kept; /* the workspace's own, of what is adjusted: */
    perp__statics_unit *kept_units;
    perp__statics_link *kept_links;
    double *kept_values, *base;
    int32_t cone_count, factored; /* factored: factors are those of base */
    int32_t *unit_cone;           /* units + 1: the cones of each */
    int32_t *square;              /* units + 1: where F begins */
    int32_t *edge;                /* for each unit: links by links */
    int32_t *unit_edge;           /* units + 1 */
    int32_t *graph_starts, *mark;
    int32_t *unit_starts, *units, *graph; /* while it is ordered */
    int8_t *idle;                         /* units whose x is told: nothing, or a bound */
    perp__cone *cones;                    /* of the others */
    double *weight;                       /* units: impulses of ordinary size */
    double *reach;                        /* nodes by width: the largest entry of A there */
    double *F, *P;                        /* S^-1 = F F' of each unit; A'F of one */
    double *k;                            /* size: S^-1 B'G e */
    double *x, *dx, *p, *rd, *met;        /* size; met: A'dy of the last pull */
    double *inside;                       /* size: strictly inside all cones */
    double *b, *g, *c, *rb, *y, *dy, *Kr, *Kg, *shift, *terms, *permuted; /* nodes by width */
    double *rb_low, *dy_low, *Kr_low, *Kg_low;
    double scale, work; /* of b; what a proof does, in that unit */
    double s, t, tau;   /* the margin; t = 1 - s, its dual */
    double kappa;
    int32_t aim, doubled, iterations;
    int32_t pushes;  /* 1: 0 may not be within all bounds */
    int32_t recedes; /* 1: cones of what impulses may grow by without end */
    /* doubled.c: L L' = K in doubled precision, row after row from `first` on */
    size_t envelope;
    int32_t *first;
    size_t *starts;
    perp__pair *L, *ordered;
};

typedef enum perp__statics_end {
    PERP__STATICS_FOUND,  /* inside all cones, as far as was asked for */
    PERP__STATICS_PROVED, /* there is nothing: the certificate is written */
    PERP__STATICS_ENDED,  /* the margin is 0, as far as numbers tell */
    PERP__STATICS_STUCK   /* numbers end before that */
} perp__statics_end;

static inline size_t perp__statics_numbers(const perp__statics *s)
{
    return (size_t)s->rows->nodes * (size_t)s->rows->width;
}

/* How much of a normal's impulse a row may have: what its velocity counts beside the normal's. */
static inline double perp__statics_share(const perp__statics_unit *unit, int32_t k)
{
    return k == 0 || unit->kind != PERP__STATICS_CONE ? 1.0
           : k <= unit->tangents                      ? unit->mu
           : k <= unit->tangents + unit->rolls        ? unit->rolling
                                                      : unit->spinning;
}

/* The power of two at or below a size; 1 where there is none. */
static inline double perp__unit_of(double size)
{
    return size > 0.0 && size < INFINITY ? ldexp(1.0, ilogb(size)) : 1.0;
}

/* point.c */
/* Forces with a load times a factor, or a load alone (forces: NULL): then cones are those of what
 * may grow without end. */
void perp__statics_set_forces(perp__statics *s, const double *forces, double factor,
                              const double *load);
/* The cones of the units that are not idle, in units of their weights; intervals without end but
 * towards infinity where they recede. */
void perp__statics_build_cones(perp__statics *s);
/* What is nearest to 0 within a unit's bounds. */
double perp__statics_least(const perp__statics_unit *unit);
double perp__statics_start_balanced(perp__statics *s);
/* No impulses, but of what is idle. */
void perp__statics_clear(perp__statics *s);
void perp__statics_start_margin(perp__statics *s, double room);
void perp__statics_start_inside(perp__statics *s, int32_t aim, double mean);

/* interior.c */
perp__statics_end perp__statics_follow_path(perp__statics *s, perp__statics_answer *answer,
                                            const perp__statics_aim *aim, int32_t most);
/* S^-1 of all units, from the cones' z and u. */
void perp__statics_condense(perp__statics *s, double mean);

/* point.c, what has been found */
/* The largest that a node's rows lack of b = A x, beside its terms: of perp__statics_balance. */
double perp__statics_unbalance(perp__statics *s, bool corrects);
/* Balances x by the last factors until what it lacks, which is `left` by now, is `enough`, or no
 * better; returns it. */
double perp__statics_refine(perp__statics *s, double left, double enough);
/* The least room of x in a cone, in units of each. */
double perp__statics_room(perp__statics *s);
/* Whether y proves that nothing stands; then the certificate is written. */
bool perp__statics_prove(perp__statics *s, perp__statics_answer *answer, const double *y);

/* z := B x + shift e_0 of a cone: point.c. */
void perp__cone_place(const perp__statics *s, const perp__cone *cone, const double *x, double shift,
                      double *z);

/* equations.c */
perp_status perp__statics_order(perp__statics *s);
/* Factors K = A S^-1 A', S^-1 = F F'. Returns 0 where that is not possible. */
int32_t perp__statics_factor(perp__statics *s);
/* x := K^-1 x; low: NULL, or what x is rounded by. */
void perp__statics_solve(perp__statics *s, double *x, double *low);
/* to += factor A S^-1 p; inverse 0: factor A p, of all units. */
void perp__statics_push(perp__statics *s, double factor, int32_t inverse, const double *p,
                        double *to, double *low);
/* x += S^-1 A' K^-1 rb where it `corrects`; rb := b - A x, and terms: sizes of what that adds. */
void perp__statics_balance(perp__statics *s, bool corrects);
/* dx := S^-1 (p + A'dy), with `met` */
void perp__statics_pull(perp__statics *s, const double *p, const double *dy, const double *dy_low,
                        double *dx);
/* out := A'y */
void perp__statics_meet(const perp__statics *s, const double *y, double *out);

/* doubled.c */
/* From now on in doubled precision, where that is not so already and costs little: *goes. */
perp_status perp__statics_go_doubled(perp__statics *s, int32_t *goes);
bool perp__statics_factor_doubled(perp__statics *s);
void perp__statics_solve_doubled(perp__statics *s, double *x, double *low);
void perp__statics_push_doubled(perp__statics *s, double factor, int32_t inverse, const double *p,
                                double *to, double *low);
void perp__statics_pull_doubled(perp__statics *s, const double *p, const double *dy,
                                const double *dy_low, double *dx);

#endif
