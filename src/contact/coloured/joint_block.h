/* The equations of joints among sweeps: all of them at once, exactly.
 *
 * Sweeps carry an impulse one body further a pass, so that a chain of joints would need as many
 * passes as it has links. With P = J C of the equations and K = P P', which is as sparse as the
 * joints' graph (a chain or a tree has factors without fill),
 *
 *   e = P y + w,     y := y - P' K^-1 e,     r := r - K^-1 e
 *
 * is their exact answer to what contacts do at the moment: one more block in Gauss-Seidel's order.
 * Whatever the passes leave of the contacts, the joints' velocities are met to rounding. Rows that
 * say the same leave K singular; it gets PERP__RIDGE on its unit diagonal, and what that leaves of
 * e the next pass takes away. */
#ifndef PERP_CONTACT_JOINT_BLOCK_H
#define PERP_CONTACT_JOINT_BLOCK_H

#include "base/arena.h"
#include "contact/contact.h"
#include "contact/coloured/joint_factor.h"

/* P := J C of row i of g on one side; of what moves by itself 0, and its velocity is added to w. */
void perp__coloured_row(const perp__rigid_problem *problem, const perp__rigid_rows *g, int32_t side,
                        int32_t i, double P[6], double *w);

typedef struct perp__joint_block {
    perp__arena arena;
    perp__joint_factor factor;
    int32_t rows;     /* 0: no joints */
    int32_t factored; /* 0: K is outside the range of doubles */
    int32_t most_rows;
    size_t fitted;
    int32_t *body;                /* 2 a row; `factor.bodies`: of none that impulses move */
    int32_t *lane;                /* of the rows, eight a node */
    double *P;                    /* 16 a row: 8 of A, 8 of B, as the bodies' numbers y */
    double *w, *r, *last, *error; /* rows */
    double *scale;                /* makes them units; 0 where impulses move nothing */
    double *x;                    /* lanes */
    double most_angle; /* > 0: rows as near to others as this times their number are left out, and K
                          has no ridge */
    int32_t keeps;     /* the next set-up reads biases only, if it has as many rows; then 0 */
} perp__joint_block;

/* Reads the joints of the problem, whose contacts come first, and factors K. PERP_OK or _MEMORY. */
perp_status perp__joint_block_set_up(perp__joint_block *block, perp_context *context,
                                     const perp__rigid_problem *problem);

void perp__joint_block_release(perp__joint_block *block);

/* y += P' r. */
void perp__joint_block_add(const perp__joint_block *block, double *y);

/* y meets P y + share w = 0; r goes on by `momentum` of its last change, as y did already, and by
 * what that takes. Returns the largest that a unit row lacked, but for rounding beside its bodies'
 * y: infinity where K has no factors. */
double perp__joint_block_solve(perp__joint_block *block, double share, double momentum, double *y);

#endif
