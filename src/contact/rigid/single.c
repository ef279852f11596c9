/* One body that contacts join with the world at rest, as most that slide or lie are: whether the
 * impulses to start from are the answer, and the velocities that what holds leaves (hold.h), with
 * all numbers on the stack.
 *
 * The residuals are those of evaluation.c with the terms of the contacts alone below, in plain
 * doubles, and what rounding may have made of them added: a point that passes here passes there.
 * Where one does not, that says nothing. */
#include <math.h>
#include <string.h>

#include "base/outcome.h"
#include "contact/contact.h"
#include "contact/law.h"
#include "linalg/active_rows.h"
#include "linalg/lanes/lanes.h"

/* Squares of numbers between this and its inverse lose nothing to the range of doubles, nor do
 * those squares' products with a third. */
#define LEAST cbrt(DBL_MIN)

enum { MOST = 8, AXES = 3, WIDTH = 6, ROWS = MOST * AXES, LANES = 4 };

typedef struct single {
    const perp__rigid_problem *problem;
    perp__contact_problem law; /* contacts, starts, dims, mu and trace: what law.h reads */
    int32_t starts[MOST + 1], dims[MOST], modes[MOST], held[MOST], rank;
    double mu[MOST], trace[MOST], root[MOST], omega;
    /* By coordinates, so that rows go in lanes; rows that are not there are 0. P' = J C, and
     * A' = |J| |C|. */
    double J[WIDTH][ROWS], P[WIDTH][ROWS], A[WIDTH][ROWS];
    double q[ROWS], terms[ROWS]; /* J v + bias, and its terms */
    double r[ROWS], u[ROWS];
    double scale[ROWS], error[ROWS]; /* |P| |P'| |r| + |q|; at least what rounding made of u */
    double square[ROWS];             /* of P's rows */
    double y[WIDTH], v[WIDTH];       /* P'r; what is left of the velocity */
} single;

/* Row a of contact k, as the caller has it. */
static const double *row_of(const single *s, int32_t k, int32_t a)
{
    const perp__rigid_rows *rows = &s->problem->rows[k];

    return rows->rows[rows->body[0] != 0][a];
}

/* Contacts, J, bias (in q) and impulses as the caller has them. */
PERP__KERNEL static void gather(single *s, int32_t n)
{
    const perp__rigid_problem *p = s->problem;

    s->starts[0] = 0;
    for (int32_t k = 0; k < p->contacts; k++) {
        const int32_t first = s->starts[k], dim = p->rows[k].dim;

        s->starts[k + 1] = first + dim;
        s->dims[k] = dim;
        s->mu[k] = dim > 1 ? p->rows[k].mu : 0.0;
        for (int32_t a = 0; a < dim; a++) {
            const double *row = row_of(s, k, a);

            s->q[first + a] = p->rows[k].bias[a];
            s->r[first + a] = p->warm[AXES * k + a];
            for (int32_t l = 0; l < n; l++)
                s->J[l][first + a] = row[l];
        }
    }
    for (int32_t i = s->starts[p->contacts]; i < ROWS; i++) { /* no rows */
        s->q[i] = s->r[i] = 0.0;
        for (int32_t l = 0; l < n; l++)
            s->J[l][i] = 0.0;
    }
}

/* P, A and q, J times C and the free velocity; |P|^2. Then u = P P'r + q, its terms, and its
 * errors: products and sums of at most rows + 3 n + 4 terms. */
PERP__KERNEL static void find_all(single *s, int32_t rows, int32_t n)
{
    const double *C = s->problem->factors, *free = s->problem->free;
    const double unit = (AXES * s->problem->contacts + 3 * n + 4) * DBL_EPSILON;
    double size[WIDTH], bound[WIDTH];

    for (int32_t i = 0; i < rows; i += LANES) {
        PERP__LANES_AT(s->terms + i) = PERP__ABSOLUTE_LANES(PERP__LANES_AT(s->q + i));
        PERP__LANES_AT(s->square + i) = PERP__SAME_LANES(0.0);
    }
    for (int32_t j = 0; j < n; j++) {
        perp__lanes P[ROWS / LANES] = {{0.0}}, A[ROWS / LANES] = {{0.0}}, term;

        for (int32_t l = 0; l < n; l++) {
            const double c = C[l * n + j];

            for (int32_t i = 0; i < rows && c != 0.0; i += LANES) {
                term = PERP__SAME_LANES(c) * PERP__LANES_AT(s->J[l] + i);
                P[i / LANES] += term;
                A[i / LANES] += PERP__ABSOLUTE_LANES(term);
            }
        }
        for (int32_t i = 0; i < rows; i += LANES) {
            PERP__LANES_AT(s->P[j] + i) = P[i / LANES];
            PERP__LANES_AT(s->A[j] + i) = A[i / LANES];
            PERP__LANES_AT(s->square + i) += P[i / LANES] * P[i / LANES];
            term = PERP__SAME_LANES(free[j]) * PERP__LANES_AT(s->J[j] + i);
            PERP__LANES_AT(s->q + i) += term;
            PERP__LANES_AT(s->terms + i) += PERP__ABSOLUTE_LANES(term);
        }
    }
    for (int32_t j = 0; j < n; j++) {
        perp__lanes y = {0.0}, terms = {0.0}, most = {0.0};

        for (int32_t i = 0; i < rows; i += LANES) {
            const perp__lanes r = PERP__LANES_AT(s->r + i);
            const perp__lanes term = r * PERP__LANES_AT(s->P[j] + i);

            y += term;
            terms += PERP__ABSOLUTE_LANES(term);
            most += PERP__ABSOLUTE_LANES(r) * PERP__LANES_AT(s->A[j] + i);
        }
        s->y[j] = (y[0] + y[1]) + (y[2] + y[3]);
        size[j] = (terms[0] + terms[1]) + (terms[2] + terms[3]);
        bound[j] = (most[0] + most[1]) + (most[2] + most[3]);
    }
    for (int32_t i = 0; i < rows; i += LANES) {
        const perp__lanes q = PERP__LANES_AT(s->q + i);
        perp__lanes u = {0.0}, scale = {0.0}, error = {0.0};

        for (int32_t j = 0; j < n; j++) {
            const perp__lanes P = PERP__LANES_AT(s->P[j] + i);

            u += P * PERP__SAME_LANES(s->y[j]);
            scale += PERP__ABSOLUTE_LANES(P) * PERP__SAME_LANES(size[j]);
            error += PERP__LANES_AT(s->A[j] + i) * PERP__SAME_LANES(bound[j]);
        }
        PERP__LANES_AT(s->u + i) = u + q;
        PERP__LANES_AT(s->scale + i) = scale + PERP__ABSOLUTE_LANES(q);
        PERP__LANES_AT(s->error + i) =
            PERP__SAME_LANES(unit) * (error + PERP__LANES_AT(s->terms + i));
    }
}

PERP__MULTIVERSION(push, (single * s), (s))
{
    if (s->problem->contacts > MOST / 2)
        find_all(s, ROWS, s->problem->width);
    else if (s->problem->width == WIDTH)
        find_all(s, ROWS / 2, WIDTH);
    else
        find_all(s, ROWS / 2, AXES);
}

/* The squares of all contacts' rows, and omega, the largest free velocity. Returns 0 where a square
 * might leave the range of numbers. */
static bool find_sizes(single *s)
{
    s->omega = 0.0;
    for (int32_t k = 0; k < s->problem->contacts; k++) {
        const int32_t first = s->starts[k], end = s->starts[k + 1];

        s->trace[k] = 0.0;
        for (int32_t i = first; i < end; i++)
            s->trace[k] += s->square[i];
        if (!(s->trace[k] > LEAST && s->trace[k] < 1.0 / LEAST))
            return 0;
        s->root[k] = sqrt(s->trace[k]);
        perp__raise_to(&s->omega, perp__contact_length(s->q, first, end) / s->root[k]);
    }
    return s->omega > LEAST && s->omega < 1.0 / LEAST;
}

/* What contact k lacks of its law, or where that is more the velocities that its mode says are 0,
 * with what rounding may have made of the velocities. False for one that presses and separates. */
static bool find_lack(single *s, int32_t k, perp__evidence *residuals)
{
    const int32_t first = s->starts[k], end = s->starts[k + 1];
    int32_t mode;
    double lack = s->trace[k] * perp__contact_natural(&s->law, k, s->r, s->u, &mode);

    s->modes[k] = s->r[first] == 0.0 ? PERP_CONTACT_SEPARATE : mode;
    if (s->r[first] != 0.0 && mode == PERP_CONTACT_SEPARATE)
        return 0;
    if (s->r[first] != 0.0)
        perp__raise_to(
            &lack, perp__contact_length(s->u, first, mode == PERP_CONTACT_STICK ? end : first + 1));
    lack += 2.0 * (1.0 + s->mu[k]) * perp__contact_length(s->error, first, end);
    perp__raise_to(&residuals->tested, lack / (s->root[k] * s->omega));
    perp__raise_to(&residuals->own_residual, lack / perp__contact_length(s->scale, first, end));
    return 1;
}

/* How many rows of each contact hold, as in active.c. Returns whether none of those is to move. */
static bool find_held(single *s)
{
    const double slack = sqrt(s->problem->tol) * s->omega;
    bool may = 1;

    for (int32_t k = 0; k < s->problem->contacts; k++) {
        const int32_t first = s->starts[k], mode = s->modes[k];
        const int32_t rows = s->mu[k] > 0.0 ? s->dims[k] : 1;
        int32_t held = 0, is_near = 1;

        for (int32_t a = 0; a < s->dims[k] && is_near; a++) {
            const double speed = fabs(s->u[first + a]);
            const bool is_still = speed <= PERP__SUM_ROUNDING * s->scale[first + a];

            is_near =
                speed <= slack * s->root[k] &&
                (is_still || (a == 0 ? mode != PERP_CONTACT_SEPARATE : mode == PERP_CONTACT_STICK));
            held = is_near ? (a + 1 == s->dims[k] ? rows : 1) : held;
        }
        s->held[k] = held;
        for (int32_t a = 0; a < held; a++)
            may = may && s->problem->rows[k].bias[a] == 0.0;
    }
    return may;
}

/* v. Returns its change beside the solution's velocities, by their terms. */
PERP__KERNEL static double hold(single *s, int32_t n)
{
    const perp__rigid_problem *p = s->problem;
    double rows[ROWS * WIDTH], targets[ROWS], norms[ROWS], basis[WIDTH * WIDTH];
    double particular[WIDTH], components[WIDTH] = {0.0}, unit[WIDTH], move[WIDTH] = {0.0};
    double change = 0.0, strength = 0.0;
    int32_t taken[ROWS];
    perp__active_rows held = {n,     0,     0,          rows,       targets, norms,
                              taken, basis, particular, components, unit};

    /* 1. What the rows that do not hold push. */
    for (int32_t k = 0; k < p->contacts; k++)
        for (int32_t i = s->starts[k]; i < s->starts[k + 1]; i++) {
            strength += fabs(s->r[i]) * sqrt(s->square[i]);
            for (int32_t j = 0; i >= s->starts[k] + s->held[k] && j < n; j++)
                move[j] += s->r[i] * s->P[j][i];
        }
    /* 2. The least that stops the rows that hold, normals first. */
    for (int32_t a = 0; a < AXES; a++)
        for (int32_t k = 0; k < p->contacts; k++) {
            const int32_t i = s->starts[k] + a;
            double *row = perp__active_rows_next(&held), push = 0.0;

            if (a >= s->held[k])
                continue;
            for (int32_t j = 0; j < n; j++) {
                row[j] = s->P[j][i];
                push += row[j] * move[j];
            }
            perp__active_rows_add(&held, -(s->q[i] + push));
        }
    perp__active_rows_solve(&held);
    s->rank = held.rank;
    for (int32_t j = 0; j < n; j++) {
        move[j] += particular[j];
        change += (move[j] - s->y[j]) * (move[j] - s->y[j]);
    }
    /* 3. v = v_free + C move, and exactly 0.0 in coordinates that the rows that hold determine. */
    memset(s->v, 0, sizeof s->v);
    for (int32_t i = 0; i < n && s->rank < n; i++) {
        const double *C = p->factors + i * n, length = perp__contact_length(C, 0, n);

        s->v[i] = p->free[i] + perp__dot(C, move, n);
        for (int32_t j = 0; j < n; j++)
            unit[j] = C[j] / length;
        if (s->v[i] == 0.0 || perp__active_rows_fix(&held, 0, n))
            s->v[i] = 0.0; /* never -0.0 */
    }
    return change > 0.0 ? sqrt(change) / strength : 0.0;
}

PERP__KERNEL static bool solve(perp__rigid_answer *answer, const perp__rigid_problem *p, double tol,
                               int32_t n)
{
    perp__evidence residuals = {0.0, 0.0, 1.0, 1};
    single s;

    /* 1. Whether there is but one body, on the world at rest. */
    if (p->bodies != 1 || p->carriers > 0 || p->joints > 0 || p->contacts < 1 ||
        p->contacts > MOST || !p->warm || p->cone > 0 || p->method != PERP_CONTACT_METHOD_AUTO)
        return 0;
    for (int32_t k = 0; k < p->contacts; k++)
        if (p->rows[k].body[0] + p->rows[k].body[1] != PERP__RIGID_AT_REST)
            return 0;
    s.problem = p;
    s.law = (perp__contact_problem){
        .contacts = p->contacts, .starts = s.starts, .dims = s.dims, .mu = s.mu, .trace = s.trace};
    gather(&s, n);
    for (int32_t k = 0; k < p->contacts; k++)
        perp__contact_clip(&s.law, k, s.r);
    push(&s);
    if (!find_sizes(&s))
        return 0;
    /* 2. The residuals, as they are or larger. Contacts that press must not separate. */
    for (int32_t k = 0; k < p->contacts; k++)
        if (!find_lack(&s, k, &residuals))
            return 0;
    if (!perp__is_good(perp__gate(&residuals, tol, -1)) || !find_held(&s))
        return 0;
    answer->tested = residuals.tested;
    /* 3. The velocities that what holds leaves. */
    perp__raise_to(&residuals.own_residual, hold(&s, n));
    residuals.sound = perp__all_finite(s.v, WIDTH); /* where u is not, neither are its errors */
    answer->outcome = perp__gate(&residuals, p->tol, -1);
    answer->own_residual = residuals.own_residual;
    answer->backward = residuals.backward;
    if (!perp__is_good(answer->outcome))
        return 0;
    /* 4. What the caller asked for. */
    memcpy(answer->v, s.v, (size_t)n * sizeof *answer->v);
    memcpy(answer->modes, s.modes, (size_t)p->contacts * sizeof *answer->modes);
    for (int32_t i = 0; i < AXES * p->contacts; i++) {
        const int32_t k = i / AXES, a = i % AXES, is_there = a < s.dims[k];

        answer->impulse[i] = is_there ? s.r[s.starts[k] + a] : 0.0;
        answer->velocity[i] = is_there && a >= s.held[k]
                                  ? p->rows[k].bias[a] + perp__dot(row_of(&s, k, a), s.v, n)
                                  : 0.0;
    }
    answer->carrier[0] = s.rank == n ? PERP__RIGID_AT_REST : PERP__RIGID_FREE;
    answer->iterations = 0;
    return 1;
}

bool perp__rigid_single(perp__rigid_answer *answer, const perp__rigid_problem *problem, double tol)
{
    return problem->width == WIDTH ? solve(answer, problem, tol, WIDTH)
                                   : solve(answer, problem, tol, AXES);
}
