/* Contacts over dynamics from bytes, and what holds of their answers: momentum and derivatives. */
#ifndef PERP_TESTS_FUZZ_DYNAMICS_H
#define PERP_TESTS_FUZZ_DYNAMICS_H

#include "laws.h"

#define VELOCITIES 12

typedef struct dynamics_problem {
    int32_t n, bilateral;
    fuzz_matrix M, H, G;
    double *f, *w, *b;
    perp_contact_dynamics dynamics;
    int32_t calls, abort_at;
} dynamics_problem;

/* Rows that touch one block or two of `block` velocities, as contacts of bodies do. */
void dynamics_make_rows(fuzz_bytes *bytes, fuzz_mood mood, fuzz_matrix *H, int32_t rows, int32_t n,
                        int32_t block);

void dynamics_make(fuzz_bytes *bytes, fuzz_mood mood, const laws_problem *problem,
                   dynamics_problem *dynamics);

/* W = rows M^-1 rows', q = rows M^-1 f + w, t = |W||r| + sizes of q. */
void dynamics_reduce(const laws_problem *problem, const dynamics_problem *dynamics, double limit,
                     const double *r, wide *W, wide *q, wide *t);

/* M v = f + H'r + G's, W and t from dynamics_reduce. */
void dynamics_check(const laws_problem *problem, const dynamics_problem *dynamics, double tol,
                    const double *v, const double *r, const wide *W, const wide *t);

/* Derivatives at an answer, by what forward and adjoint products have in common. */
void dynamics_differentiate(perp_context *context, const perp_contact_settings *settings,
                            const laws_problem *problem, dynamics_problem *dynamics,
                            const double *r);

#endif
