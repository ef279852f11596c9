/* The inner entrance of the contact layer, for the layers above. It works in the caller's context,
 * which is entered already, and writes failures into its message. First the front door as it is;
 * then rigid bodies with contacts and joints, flat, whose numbers are not checked: they are the
 * caller's own.
 *
 *   v = v_free + M^-1 (J'r),     u = J v + bias,     M^-1 = C C' of each body
 *
 * and every contact obeys Signorini's and Coulomb's laws (perp/contact.h), every joint u = 0. Gap
 * and restitution are folded into bias (bias_n = gap / h, or e times the old u_n).
 *
 * Bodies are numbered: 0 .. bodies - 1 move under impulses; bodies .. bodies + carriers - 1 are
 * carriers, which move as they are told; -1 is the world at rest. Velocities have `width`
 * coordinates: (v_x, v_y, omega) in the plane, (v, omega) in space, each about the body's own
 * origin, where its mass is centred. */
#ifndef PERP_CONTACT_CONTACT_H
#define PERP_CONTACT_CONTACT_H

#include <stdbool.h>

#include <perp/contact.h>

/* ---- the front door ------------------------------------------------------------------------- */

/* Arguments of one solve. */
typedef struct perp__contact_call {
    perp_contact_answer to;
    perp_contact_result *result;
    const double *f, *w, *b; /* with dynamics */
    const double *q;         /* with W */
    const double *r0;
} perp__contact_call;

/* Checks all settings and fills *copy, untouched on failure; NULL gives the defaults. And one name
 * for methods that have two: solver.c. */
perp_status perp__contact_settings_read(perp_context *context, perp_contact_settings *copy,
                                        const perp_contact_settings *settings);
int32_t perp__contact_method_named(int32_t method);

/* A solver without a problem; its settings; and its end: solver.c. */
perp_status perp__contact_create(perp_context *context, perp_contact_solver **solver,
                                 const perp_contact_settings *settings);
perp_status perp__contact_configure(perp_contact_solver *solver,
                                    const perp_contact_settings *settings);

/* Reads the laws and lays out the arrays: problem.c. With dynamics, `dynamics` is not NULL, else W
 * is. */
perp_status perp__contact_setup(perp_contact_solver *solver, const perp_contact_laws *laws,
                                const perp_contact_dynamics *dynamics, const perp_matrix *W);

/* Reads and checks laws, but for compliance, whose length is that of all rows; *rows: those of the
 * contacts: problem.c. */
perp_status perp__contact_read_laws(perp_context *context, perp_contact_laws *copy, int32_t *rows,
                                    const perp_contact_laws *laws);

/* The whole solve: contact.c. */
perp_status perp__contact_solve(perp_contact_solver *solver, const perp__contact_call *call);

/* ---- rigid bodies --------------------------------------------------------------------------- */

/* Rows of one contact, normal first, or of one joint: u = J_A v_A + J_B v_B + bias. */
typedef struct perp__rigid_rows {
    int32_t body[2];      /* A and B; two different ones, or -1 */
    int32_t dim;          /* rows: 1, 2 or 3. A contact with mu = 0 is best given with 1 */
    int32_t bounded;      /* 1: a contact whose normal moves nothing, but for its compliance: then
                             -bias / compliance bounds the row after it (law.h), times mu */
    double rows[2][3][6]; /* J_A, J_B: the first `width` columns; those of -1 are not read */
    double bias[3];
    double mu;            /* >= 0; of a joint not read */
    double compliance[3]; /* >= 0, added to the diagonal of u(r): 0 but of rows that give way */
} perp__rigid_rows;

typedef struct perp__rigid_problem {
    int32_t width; /* 3 in the plane, 6 in space */
    int32_t bodies, carriers, contacts, joints;
    const double *factors; /* bodies by width by width, row-major: C of each, M^-1 = C C'; in space
                              diag(c, c, c) beside a 3 by 3 block */
    const double *free;    /* bodies + carriers by width: velocities without impulses */
    const double *origins; /* bodies + carriers by 3: where each is; read only for what a carrier
                              that turns carries; NULL: nothing is known to be carried by those */
    const perp__rigid_rows *rows; /* contacts, then joints */
    const double *warm;           /* impulses to start from, 3 for each of rows; NULL: none */
    double tol;                   /* tested residual that counts as solved */
    int32_t method;               /* PERP_CONTACT_METHOD_... */
    int32_t cone;                 /* 0: exact; k: polyhedron, as perp_contact_settings.cone */
    int32_t max_iterations;       /* of each method; 0: their own; -1: none, the start alone
                                     is judged */
    double enough;                /* residual at which no further method is tried; 0: none */
    int32_t quick;                /* 1: sweeps and the first method after them, no last resorts;
                                     2: and no second try after a path that ended at its start */
    int32_t again;                /* 1: bodies, factors, rows (but bias) and mu are those of the
                                     last solve: only free, bias, warm and what follows are read */
    int32_t holds;                /* 1: v, velocity and carrier are those of perp__rigid_hold,
                                     whatever the outcome */
    double deadline;              /* on perp__now()'s clock; 0: none */
} perp__rigid_problem;

/* Whether impulses move it. */
static inline bool perp__rigid_moves(const perp__rigid_problem *problem, int32_t body)
{
    return body >= 0 && body < problem->bodies;
}

/* Arrays are the caller's; NULL where not wanted, impulse and v excepted. */
typedef struct perp__rigid_answer {
    double *impulse;  /* 3 for each of rows; 0.0 in rows past dim */
    double *velocity; /* the same: u */
    double *v;        /* bodies by width */
    int32_t *modes;   /* contacts: PERP_CONTACT_... */
    int32_t *carrier; /* bodies: the body that each moves with as one, PERP__RIGID_... or a carrier;
                         written where velocities are held */
    perp_outcome outcome;
    int64_t iterations;
    double tested, own_residual, backward; /* residuals that decide the outcome */
    double drive; /* of passes: the velocity that `tested` is relative to */
} perp__rigid_answer;

enum { PERP__RIGID_AT_REST = -1, PERP__RIGID_FREE = -2 };

/* Solves the problem, with no search for proofs that there is no solution; one that a method comes
 * across counts. Any of the problem's bodies, contacts and joints may be none.
 *
 * Returns PERP_OK with the answer; else PERP_ERROR_MEMORY, or _ARGUMENT or _NOT_FINITE where rows
 * move nothing or numbers leave the range of doubles: then nothing was written.
 * The best iterate is written whatever the outcome.
 * Allocates nothing after the first call of a size (third-party factorisations excepted). */
perp_status perp__rigid_solve(perp_contact_solver *solver, perp__rigid_answer *answer,
                              const perp__rigid_problem *problem);

/* One body that a few contacts join with the world at rest: whether the impulses problem->warm are
 * an answer to tol, and with them the velocities that what holds leaves to problem->tol. Then the
 * answer is written as perp__rigid_solve and perp__rigid_hold do, at a small share of their cost;
 * else 0 is returned, which says nothing, and the answer is not to be read. */
bool perp__rigid_single(perp__rigid_answer *answer, const perp__rigid_problem *problem, double tol);

/* Velocities in what the contacts that hold leave free (hold.h), for impulses and modes from
 * anywhere: reads answer->impulse (of contacts that slip: their tangents) and ->modes, writes ->v,
 * ->velocity and ->carrier. Rows that hold: normals of contacts that press, all of contacts
 * that stick, joints; and of contacts that press by nothing what is 0 to rounding. Of rows that
 * impulses leave with more than sqrt(tol) omega sqrt(t_k) the modes are not believed. Their u is
 * exactly 0.0; what they pin in every coordinate has exactly the velocity of what it is pinned to,
 * 0.0 at rest; the rest is v_free and what the other impulses do, with those rows taken out. At a
 * cost linear in the contacts: about 0.1 us each after the set-up, which `again` saves. Clusters of
 * more than 96 velocities that hold each other only together keep v_free + M^-1 J'r.
 * PERP_OK or PERP_ERROR_MEMORY. */
perp_status perp__rigid_hold(perp_contact_solver *solver, perp__rigid_answer *answer,
                             const perp__rigid_problem *problem);

#endif
