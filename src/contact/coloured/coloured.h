/* Sweeps over many contacts side by side.
 *
 * In y = C^-1 v, body by body (M^-1 = C C'), a contact's rows are P = J C and u = P y + w. Pairs of
 * bodies are coloured so that no two of one colour share a body that impulses move; eight of a
 * colour are a group, whose contacts are visited lane by lane: one pass is Gauss-Seidel in the
 * order of the groups, at the price of an eighth. Problems that share no body are swept side by
 * side, each with the bits it has alone: their groups have lanes of several.
 *
 *   r_n := max(0, r_n - (u_n + b) / W_nn),
 *   r_t := the point of the disc mu r_n next to r_t - u_t / L,   L: largest eigenvalue of W_tt;
 *
 * its fixed point is Coulomb's law. Equations of joints are a block of their own after each pass
 * (joint_block.h); their limits, motors and dry friction are rows like those of contacts. A
 * penetration never enters b: what b pushes apart would stay in the impulses that the next step
 * starts from, and feed a drift. A pass of its own removes it, which moves positions alone. */
#ifndef PERP_CONTACT_COLOURED_H
#define PERP_CONTACT_COLOURED_H

#include "base/arena.h"
#include "base/tasks.h"
#include "contact/coloured/joint_block.h"
#include "contact/contact.h"

/* Which of the 8 numbers of a body is its part's momentum: the plane has all in the first four. */
#define PERP__MOMENTUM(width) ((width) > 3 ? 7 : 3)

/* Bodies of a piece, where a problem is cut into pieces: one of as many points, of eight contacts
 * each, and more. */
#define PERP__PIECE_BODIES 128

enum { PERP__GROUP = 8, PERP__PAIR_POINTS = 4, PERP__COLOURS = 64, PERP__COLOURED_PIECES = 64 };
enum { PERP__FAR_POINTS = 512 }; /* 1.8 MB: with fewer, asking ahead takes up to .15 of a pass */

/* A contact of each of the eight pairs. Where a pair has none all is 0 and `contact` is -1. */
typedef struct perp__lane_point {
    double P[36][PERP__GROUP]; /* normal, tangent 1, 2; six numbers of A and six of B each */
    double r[3][PERP__GROUP];
    double last[3][PERP__GROUP];         /* r of the pass before */
    double w[3][PERP__GROUP];            /* velocities that impulses do not change */
    double bias[PERP__GROUP];            /* of the normal row, as it is swept */
    double inverse_normal[PERP__GROUP];  /* 1 / W_nn */
    double inverse_tangent[PERP__GROUP]; /* 1 / L */
    double across[2][PERP__GROUP];       /* W_nt */
    double mu[PERP__GROUP];
    double gap[PERP__GROUP], guard[PERP__GROUP]; /* from here on no sweep reads anything */
    double shift[PERP__GROUP];                   /* normal pushes of the pass over positions */
    int32_t contact[PERP__GROUP], unused[PERP__GROUP]; /* whole cache lines, as rows are read */
} perp__lane_point;

typedef struct perp__lane_group {
    int32_t a[PERP__GROUP], b[PERP__GROUP]; /* bodies; from `bodies` on what nothing moves */
    int32_t pair[PERP__GROUP];              /* -1: none, as all that come after it */
    int32_t pairs;
    int32_t first, points; /* in `point` */
    int32_t rests;         /* the parts of all its pairs have ended */
} perp__lane_group;

struct perp__coloured_part;

typedef struct perp__coloured {
    const struct perp__coloured_kernels *kernels;
    perp_context *context;
    perp__tasks *tasks; /* what is large is shared out to them from so many points on; NULL: none */
    int32_t shared_from;
    perp__arena arena, point_arena;
    struct perp__coloured_part *part; /* at hand, and how many */
    int32_t parts;
    int32_t bodies, width; /* of all parts */
    int32_t groups, points;
    int32_t is_large; /* it is cut into pieces, whether there are tasks or not */
    int32_t rows;     /* bodies, and for each piece of a colour one that nothing moves */
    int32_t colour_count;
    int32_t colour_first[PERP__COLOURS + 2];                      /* in `piece_first` */
    int32_t most_bodies, most_contacts, most_groups, most_points; /* room */
    perp__lane_group *group;
    perp__lane_point *point;
    int32_t *piece_first; /* in `group` */
    perp__joint_block joints;
    double *y, *free, *before, *moved; /* rows by 8; y[PERP__MOMENTUM]: that of its part */
    double *back;                      /* of pieces of the bodies: how much of a pass led back */
    uint64_t *colours;                 /* bodies: those of their pairs */
    int32_t *pair_first, *pair_points, *pair_key, *pair_order; /* contacts of its part */
    int32_t *pair_part, *pair_body; /* and two bodies of all; -1: nothing moves it */
    int32_t *place;                 /* contacts of all parts: 8 times the point, and the lane */
} perp__coloured;

void perp__coloured_init(perp__coloured *c, perp_context *context);
void perp__coloured_release(perp__coloured *c);

/* What a step takes away of a penetration: this share, and no more than so many guards. */
#define PERP__CLEARED_SHARE 0.2
#define PERP__CLEARED_GUARDS 64.0
static inline double perp__cleared(double lack, double guard)
{
    return fmin(PERP__CLEARED_SHARE * lack, PERP__CLEARED_GUARDS * guard);
}

/* What is asked for beside the problem: contacts by pairs of bodies, contiguously; bias of the rows
 * is what impulses do not change, without gaps. */
typedef struct perp__passes {
    double h; /* length of the step */
    int32_t passes;
    int32_t rounds;      /* of these at most, if measured, until answer->tested is problem->tol */
    int32_t clear;       /* passes that remove penetration */
    int32_t measures;    /* 1: answer->velocity, ->modes and ->tested are written, too */
    double deep;         /* guards: down to there a contact may sink */
    const double *gap;   /* contacts; NULL: none, as clear = 0 */
    const double *guard; /* contacts: a penetration up to this length is left */
} perp__passes;

/* Passes over the whole step, from the impulses problem->warm: answer->impulse and ->v and, bodies
 * by width, the velocities that move the positions, where `moving` is not NULL. v is that of the
 * impulses. Nothing is judged. Costs about passes times contacts. PERP_OK or PERP_ERROR_MEMORY. */
perp_status perp__coloured_step(perp__coloured *c, perp__rigid_answer *answer, double *moving,
                                const perp__rigid_problem *problem, const perp__passes *step);

/* A problem among those that are swept side by side, of the same width, passes and tol; one with
 * joints is alone. */
typedef struct perp__coloured_part {
    perp__rigid_answer *answer;
    double *moving;
    const perp__rigid_problem *problem;
    const perp__passes *step;
    int32_t first_body, end_body, first_contact, end_contact; /* these are the passes' own */
    int32_t ends, ended;    /* with this round, whatever it came to; with one */
    int32_t plain;          /* a round grew: without momentum from there on */
    int32_t worst;          /* the group that told last that it goes on; -1: none did */
    double theta, momentum; /* the share of its last way by which r goes on before it is swept */
    double way, first_way;  /* what the passes of a round change, in y'y; those of the first one */
    double drive, residual, sinks; /* how far a contact sinks in the step, in guards, at most */
} perp__coloured_part;
perp_status perp__coloured_parts(perp__coloured *c, perp__coloured_part *parts, int32_t count);

/* What the passes have come to in the parts that go on, before overlap is taken out: measure.c. Of
 * those that do so in any case, beside what drove them when all was measured, no more than that. */
void perp__coloured_measure(const perp__coloured *c);

/* What a pass does with each contact: its impulses change; its push apart does; y += P'r alone. */
enum { PERP__COLOURED_SWEEP, PERP__COLOURED_CLEAR, PERP__COLOURED_ADD };

/* What passes have come to at a contact of each of eight pairs, with t the trace of P P': 0 where
 * that is. */
typedef struct perp__lane_measure {
    double u[3][PERP__GROUP], trace[PERP__GROUP];
    double drive[PERP__GROUP];   /* |q| / sqrt(t): velocities that the passes began from */
    double natural[PERP__GROUP]; /* sqrt(t) times the natural residual */
    double mode[PERP__GROUP];    /* a perp_contact_mode */
} perp__lane_measure;

/* The passes that a set of instructions gives, for tests and benchmarks too: over groups from
 * `first` up to `end`. */
typedef struct perp__coloured_kernels {
    void (*pass)(perp__coloured *c, int32_t what, double *y, int32_t first, int32_t end);
    void (*invert)(perp__lane_point *p); /* writes 1 / W_nn and 1 / L of the lanes */
    /* of q's terms `share` is granted for their roundings (contact/evaluation.c) */
    void (*measure)(const perp__coloured *c, const perp__lane_group *group,
                    const perp__lane_point *p, double share, perp__lane_measure *found);
} perp__coloured_kernels;

/* Those that this processor has, the fastest first; returns how many. They give the same bits. */
enum { PERP__COLOURED_SETS = 3 };
int32_t perp__coloured_find_kernels(const perp__coloured_kernels **found);

/* The groups of the parts: pack.c; and what is in them, from `first` up to `end`. */
perp_status perp__coloured_pack(perp__coloured *c);
void perp__coloured_fill(perp__coloured *c, int32_t first, int32_t end);

#endif
