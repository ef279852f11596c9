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
#include "linalg/lanes/multiversion.h"

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
    double after[ROWS];              /* u of v */
    double y[WIDTH], v[WIDTH];       /* P'r; what is left of the velocity */
    double change;                   /* of it by what holds, beside its terms */
} single;

/* Row a of contact k, as the caller has it. */
static const double *row_of(const single *s, int32_t k, int32_t a)
{
    const perp__rigid_rows *rows = &s->problem->rows[k];

    return rows->rows[rows->body[0] != 0][a];
}

/* Contacts, J, bias (in q) and impulses as the caller has them. */
static void gather(single *s)
{
    const perp__rigid_problem *p = s->problem;

    memset(s->J, 0, sizeof s->J);
    memset(s->q, 0, sizeof s->q);
    memset(s->r, 0, sizeof s->r);
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
            for (int32_t l = 0; l < p->width; l++)
                s->J[l][first + a] = row[l];
        }
    }
}

/* P, A and q, J times C and the free velocity; |P|^2. */
PERP__KERNEL static void read_rows(single *s, int32_t rows)
{
    const int32_t n = s->problem->width;

    for (int32_t i = 0; i < rows; i++) {
        s->terms[i] = fabs(s->q[i]);
        s->square[i] = 0.0;
    }
    for (int32_t j = 0; j < n; j++) {
        for (int32_t i = 0; i < rows; i++)
            s->P[j][i] = s->A[j][i] = 0.0;
        for (int32_t l = 0; l < n; l++) {
            const double c = s->problem->factors[l * n + j];

            for (int32_t i = 0; i < rows && c != 0.0; i++) {
                s->P[j][i] += c * s->J[l][i];
                s->A[j][i] += fabs(c * s->J[l][i]);
            }
        }
        for (int32_t i = 0; i < rows; i++) {
            s->square[i] += s->P[j][i] * s->P[j][i];
            s->q[i] += s->J[j][i] * s->problem->free[j];
            s->terms[i] += fabs(s->J[j][i] * s->problem->free[j]);
        }
    }
}

/* u = P P'r + q, its terms, and its errors: products and sums of at most rows + 3 n + 4 terms. */
PERP__KERNEL static void find_velocities(single *s, int32_t rows)
{
    const int32_t n = s->problem->width;
    const double unit = (AXES * s->problem->contacts + 3 * n + 4) * DBL_EPSILON;

    for (int32_t i = 0; i < rows; i++)
        s->u[i] = s->scale[i] = s->error[i] = 0.0;
    for (int32_t j = 0; j < n; j++) {
        double y[LANES] = {0.0}, terms[LANES] = {0.0}, most[LANES] = {0.0}, size, bound;

        for (int32_t i = 0; i < rows; i += LANES)
            for (int32_t l = 0; l < LANES; l++) {
                y[l] += s->r[i + l] * s->P[j][i + l];
                terms[l] += fabs(s->r[i + l] * s->P[j][i + l]);
                most[l] += fabs(s->r[i + l]) * s->A[j][i + l];
            }
        s->y[j] = (y[0] + y[1]) + (y[2] + y[3]);
        size = (terms[0] + terms[1]) + (terms[2] + terms[3]);
        bound = (most[0] + most[1]) + (most[2] + most[3]);
        for (int32_t i = 0; i < rows; i++) {
            s->u[i] += s->P[j][i] * s->y[j];
            s->scale[i] += fabs(s->P[j][i]) * size;
            s->error[i] += s->A[j][i] * bound;
        }
    }
    for (int32_t i = 0; i < rows; i++) {
        s->u[i] += s->q[i];
        s->scale[i] += fabs(s->q[i]);
        s->error[i] = unit * (s->error[i] + s->terms[i]);
    }
}

PERP__MULTIVERSION(read, (single * s), (s))
{
    if (s->problem->contacts <= MOST / 2)
        read_rows(s, ROWS / 2);
    else
        read_rows(s, ROWS);
}

PERP__MULTIVERSION(push, (single * s), (s))
{
    if (s->problem->contacts <= MOST / 2)
        find_velocities(s, ROWS / 2);
    else
        find_velocities(s, ROWS);
}

/* The squares of all contacts' rows, and omega, the largest free velocity. */
static void find_sizes(single *s)
{
    s->omega = 0.0;
    for (int32_t k = 0; k < s->problem->contacts; k++) {
        const int32_t first = s->starts[k], end = s->starts[k + 1];

        s->trace[k] = 0.0;
        for (int32_t i = first; i < end; i++)
            s->trace[k] += s->square[i];
        s->root[k] = sqrt(s->trace[k]);
        perp__raise_to(&s->omega, perp__contact_length(s->q, first, end) / s->root[k]);
    }
}

/* What contact k lacks of its law, or where that is more the velocities that its mode says are 0,
 * with what rounding may have made of the velocities. False for one that presses and separates. */
static int32_t find_lack(single *s, int32_t k, perp__evidence *residuals)
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
static int32_t find_held(single *s)
{
    const double slack = sqrt(s->problem->tol) * s->omega;
    int32_t may = 1;

    for (int32_t k = 0; k < s->problem->contacts; k++) {
        const int32_t first = s->starts[k], mode = s->modes[k];
        const int32_t rows = s->mu[k] > 0.0 ? s->dims[k] : 1;
        int32_t held = 0, is_near = 1;

        for (int32_t a = 0; a < s->dims[k] && is_near; a++) {
            const double speed = fabs(s->u[first + a]);
            const int32_t is_still = speed <= PERP__SUM_ROUNDING * s->scale[first + a];

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

/* v = v_free + C move, and exactly 0.0 in coordinates that the rows that hold determine. */
static void move_body(single *s, perp__active_rows *held, const double *move)
{
    const int32_t n = s->problem->width;
    const double *C = s->problem->factors;

    memset(s->v, 0, sizeof s->v);
    for (int32_t i = 0; i < n && s->rank < n; i++, C += n) {
        const double length = perp__contact_length(C, 0, n);

        s->v[i] = s->problem->free[i] + perp__dot(C, move, n);
        for (int32_t j = 0; j < n; j++)
            held->unit[j] = C[j] / length;
        if (s->v[i] == 0.0 || perp__active_rows_fix(held, 0, n))
            s->v[i] = 0.0; /* never -0.0 */
    }
}

/* v, after = J v + bias, and the change beside the solution's velocities, by their terms. */
static void hold(single *s)
{
    const perp__rigid_problem *p = s->problem;
    const int32_t n = p->width;
    double rows[ROWS * WIDTH], targets[ROWS], norms[ROWS], basis[WIDTH * WIDTH];
    double particular[WIDTH], components[WIDTH] = {0.0}, unit[WIDTH], move[WIDTH] = {0.0};
    double change = 0.0, strength = 0.0;
    int32_t taken[ROWS];
    perp__active_rows held = {.rows = rows,
                              .targets = targets,
                              .norms = norms,
                              .taken = taken,
                              .basis = basis,
                              .particular = particular,
                              .components = components,
                              .unit = unit};

    /* 1. What the rows that do not hold push. */
    for (int32_t k = 0; k < p->contacts; k++)
        for (int32_t i = s->starts[k]; i < s->starts[k + 1]; i++) {
            strength += fabs(s->r[i]) * sqrt(s->square[i]);
            for (int32_t j = 0; j < n && i >= s->starts[k] + s->held[k]; j++)
                move[j] += s->r[i] * s->P[j][i];
        }
    /* 2. The least that stops the rows that hold, normals first. */
    perp__active_rows_begin(&held, n);
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
    s->change = change > 0.0 ? sqrt(change) / strength : 0.0;
    /* 3. The body's velocity, and those of its contacts. */
    move_body(s, &held, move);
    for (int32_t k = 0; k < p->contacts; k++)
        for (int32_t a = 0; a < s->dims[k]; a++)
            s->after[s->starts[k] + a] = p->rows[k].bias[a] + perp__dot(row_of(s, k, a), s->v, n);
}

static void write_answer(const single *s, perp__rigid_answer *answer)
{
    memcpy(answer->v, s->v, (size_t)s->problem->width * sizeof *answer->v);
    for (int32_t k = 0; k < s->problem->contacts; k++) {
        for (int32_t a = 0; a < AXES; a++) {
            const int32_t i = s->starts[k] + a, is_there = a < s->dims[k];

            answer->impulse[AXES * k + a] = is_there ? s->r[i] : 0.0;
            answer->velocity[AXES * k + a] = is_there && a >= s->held[k] ? s->after[i] : 0.0;
        }
        answer->modes[k] = s->modes[k];
    }
    answer->carrier[0] = s->rank == s->problem->width ? PERP__RIGID_AT_REST : PERP__RIGID_FREE;
    answer->iterations = 0;
}

int32_t perp__rigid_single(perp__rigid_answer *answer, const perp__rigid_problem *problem,
                           double tol)
{
    const perp__rigid_problem *p = problem;
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
    gather(&s);
    read(&s);
    find_sizes(&s);
    /* 2. No square may leave the range of numbers. */
    for (int32_t k = 0; k < p->contacts; k++)
        if (!(s.trace[k] > LEAST && s.trace[k] < 1.0 / LEAST))
            return 0;
    if (!(s.omega > LEAST && s.omega < 1.0 / LEAST))
        return 0;
    /* 3. The residuals, as they are or larger. Contacts that press must not separate. */
    for (int32_t k = 0; k < p->contacts; k++)
        perp__contact_clip(&s.law, k, s.r);
    push(&s);
    for (int32_t k = 0; k < p->contacts; k++)
        if (!find_lack(&s, k, &residuals))
            return 0;
    if (!perp__is_good(perp__gate(&residuals, tol, -1)) || !find_held(&s))
        return 0;
    answer->tested = residuals.tested;
    /* 4. The velocities that what holds leaves. */
    hold(&s);
    perp__raise_to(&residuals.own_residual, s.change);
    residuals.sound = perp__all_finite(s.v, WIDTH); /* where u is not, neither are its errors */
    answer->outcome = perp__gate(&residuals, p->tol, -1);
    answer->own_residual = residuals.own_residual;
    answer->backward = residuals.backward;
    if (!perp__is_good(answer->outcome))
        return 0;
    write_answer(&s, answer);
    return 1;
}
