/* One body that contacts join with the world at rest, as most that slide or lie are: whether the
 * impulses to start from are the answer, and the velocities that what holds leaves (hold.h), with
 * all numbers on the stack.
 *
 * The residuals are those of verdict.c with the terms of the contacts alone below, in plain
 * doubles, and what rounding may have made of them added: a point that passes here passes there.
 * Where one does not, that says nothing. */
#include "contact/rigid/single.h"

#include <math.h>
#include <string.h>

#include "base/outcome.h"

/* As in held.c. */
#define ROUNDING (256.0 * DBL_EPSILON)

/* Squares of numbers between this and its inverse lose nothing to the range of doubles. */
#define LEAST 1e-100

/* One number of each of four arrays. */
#define PERP__EACH_LANE(x, i) ((perp__lanes){(x)[0][i], (x)[1][i], (x)[2][i], (x)[3][i]})

/* Rows, bias and impulses of a group as the caller has them; lanes without a row are 0. */
PERP__KERNEL static void load(perp__single *s, int32_t g, int32_t n)
{
    static const perp__rigid_rows none = {0};
    const perp__rigid_problem *p = s->problem;
    const double *J[AXES][LANES], *bias[AXES][LANES], *r[AXES][LANES];

    for (int32_t l = 0, k = LANES * g; l < LANES; l++, k++) {
        const perp__rigid_rows *rows = k < p->contacts ? &p->rows[k] : &none;
        const double(*row)[6] = rows->rows[rows->body[0] != 0];

        s->dims[k] = rows->dim;
        s->mu[k] = rows->dim > 1 ? rows->mu : 0.0;
        for (int32_t a = 0; a < PERP__AXES_OF(n); a++) {
            J[a][l] = a < rows->dim ? row[a] : none.rows[0][0];
            bias[a][l] = a < rows->dim ? rows->bias + a : none.bias;
            r[a][l] = a < rows->dim ? p->warm + AXES * k + a : none.bias;
        }
    }
    for (int32_t a = 0; a < PERP__AXES_OF(n); a++) {
        PERP__LANES_AT(s->bias[g][a]) = PERP__EACH_LANE(bias[a], 0);
        PERP__LANES_AT(s->r[g][a]) = PERP__EACH_LANE(r[a], 0);
        for (int32_t i = 0; i < n; i++)
            PERP__LANES_AT(s->J[g][a][i]) = PERP__EACH_LANE(J[a], i);
    }
}

/* P, |J| |C| and the squares of P's rows, of a group. */
PERP__KERNEL static void whiten(perp__single *s, int32_t g, int32_t n)
{
    perp__lanes square[AXES] = {{0.0}, {0.0}, {0.0}};

    for (int32_t i = 0; i < n; i++) {
        perp__lanes sum[AXES] = {{0.0}, {0.0}, {0.0}}, size[AXES] = {{0.0}, {0.0}, {0.0}};

        for (int32_t l = 0; l < n; l++) {
            if (s->columns[i][l] == 0.0)
                continue;
            for (int32_t a = 0; a < PERP__AXES_OF(n); a++) {
                const perp__lanes term =
                    PERP__SAME_LANES(s->columns[i][l]) * PERP__CONST_LANES_AT(s->J[g][a][l]);

                sum[a] += term;
                size[a] += PERP__ABSOLUTE_LANES(term);
            }
        }
        for (int32_t a = 0; a < PERP__AXES_OF(n); a++) {
            PERP__LANES_AT(s->P[g][a][i]) = sum[a];
            PERP__LANES_AT(s->A[g][a][i]) = size[a];
            square[a] += sum[a] * sum[a];
        }
    }
    for (int32_t a = 0; a < AXES; a++)
        PERP__LANES_AT(s->squares[g][a]) = square[a];
}

/* Lengths of three numbers of each contact of a group. */
PERP__KERNEL static void measure(double *length, const double (*x)[LANES])
{
    const perp__lanes a = PERP__CONST_LANES_AT(x[0]), b = PERP__CONST_LANES_AT(x[1]);
    const perp__lanes c = PERP__CONST_LANES_AT(x[2]), square = a * a + b * b + c * c;

    PERP__LANES_AT(length) = PERP__ROOT_LANES(square);
}

/* C by columns, filled up with zeros; then all groups. */
PERP__KERNEL static void load_width(perp__single *s, int32_t n)
{
    const double *C = s->problem->factors;

    for (int32_t j = 0; j < n; j++) {
        PERP__LANES_AT(s->columns[j]) =
            (perp__lanes){C[j], C[n + j], C[2 * n + j], n == WIDTH ? C[3 * n + j] : 0.0};
        PERP__LANES_AT(s->columns[j] + LANES) = (perp__lanes){
            n == WIDTH ? C[4 * n + j] : 0.0, n == WIDTH ? C[5 * n + j] : 0.0, 0.0, 0.0};
    }
    s->groups = (s->problem->contacts + LANES - 1) / LANES;
    for (int32_t g = 0; g < s->groups; g++) {
        const perp__lanes zero = {0.0};
        perp__lanes trace;

        load(s, g, n);
        whiten(s, g, n);
        /* q = J v + bias and its terms */
        for (int32_t a = 0; a < PERP__AXES_OF(n); a++) {
            perp__lanes sum = PERP__CONST_LANES_AT(s->bias[g][a]), size = PERP__ABSOLUTE_LANES(sum);

            for (int32_t l = 0; l < n; l++) {
                const perp__lanes term =
                    PERP__SAME_LANES(s->problem->free[l]) * PERP__CONST_LANES_AT(s->J[g][a][l]);

                sum += term;
                size += PERP__ABSOLUTE_LANES(term);
            }
            PERP__LANES_AT(s->drift[g][a]) = sum;
            PERP__LANES_AT(s->terms[g][a]) = size;
        }
        for (int32_t a = PERP__AXES_OF(n); a < AXES; a++)
            PERP__LANES_AT(s->r[g][a]) = PERP__LANES_AT(s->u[g][a]) =
                PERP__LANES_AT(s->scale[g][a]) = PERP__LANES_AT(s->error[g][a]) =
                    PERP__LANES_AT(s->drift[g][a]) = PERP__LANES_AT(s->after[g][a]) = zero;
        measure(s->driven + LANES * g, (const double(*)[LANES])s->drift[g]);
        trace = PERP__CONST_LANES_AT(s->squares[g][0]) + PERP__CONST_LANES_AT(s->squares[g][1]) +
                PERP__CONST_LANES_AT(s->squares[g][2]);
        PERP__LANES_AT(s->trace + LANES * g) = trace;
        PERP__LANES_AT(s->root + LANES * g) = PERP__ROOT_LANES(trace);
        PERP__LANES_AT(s->driven + LANES * g) /= PERP__CONST_LANES_AT(s->root + LANES * g);
    }
}

PERP__MULTIVERSION(set_up, (perp__single * s), (s))
{
    if (s->problem->width == WIDTH)
        load_width(s, WIDTH);
    else
        load_width(s, 3);
}

/* u = P P'r + q, its terms, and its errors: products and sums of at most rows + 3 n + 4 terms. */
PERP__KERNEL static void velocities_width(perp__single *s, int32_t n)
{
    const double unit = (AXES * s->problem->contacts + 3 * n + 4) * DBL_EPSILON;
    double terms[WIDTH], most[WIDTH];

    perp__single_push(s, (const double(*)[AXES][LANES])s->r, s->y, terms, most, n);
    for (int32_t g = 0; g < s->groups; g++) {
        for (int32_t a = 0; a < PERP__AXES_OF(n); a++) {
            const perp__lanes q = PERP__CONST_LANES_AT(s->drift[g][a]);
            perp__lanes sum = {0.0}, size = {0.0}, bound = {0.0};

            for (int32_t i = 0; i < n; i++) {
                const perp__lanes P = PERP__CONST_LANES_AT(s->P[g][a][i]);

                sum += P * PERP__SAME_LANES(s->y[i]);
                size += PERP__ABSOLUTE_LANES(P) * PERP__SAME_LANES(terms[i]);
                bound += PERP__CONST_LANES_AT(s->A[g][a][i]) * PERP__SAME_LANES(most[i]);
            }
            PERP__LANES_AT(s->u[g][a]) = sum + q;
            PERP__LANES_AT(s->scale[g][a]) = size + PERP__ABSOLUTE_LANES(q);
            PERP__LANES_AT(s->error[g][a]) =
                PERP__SAME_LANES(unit) * (bound + PERP__CONST_LANES_AT(s->terms[g][a]));
        }
        measure(s->scales + LANES * g, (const double(*)[LANES])s->scale[g]);
        measure(s->errors + LANES * g, (const double(*)[LANES])s->error[g]);
    }
}

/* Impulses into their cones, as in law.c. */
PERP__KERNEL static void clip(perp__single *s, int32_t g)
{
    const perp__lanes r_n = PERP__CONST_LANES_AT(s->r[g][0]), zero = {0.0};
    const perp__lanes r_1 = PERP__CONST_LANES_AT(s->r[g][1]);
    const perp__lanes r_2 = PERP__CONST_LANES_AT(s->r[g][2]), square = r_1 * r_1 + r_2 * r_2;
    const perp__lanes pressure = PERP__SELECT_LANES(r_n > zero, r_n, zero);
    const perp__lanes radius = PERP__CONST_LANES_AT(s->mu + LANES * g) * pressure;
    const perp__lanes length = PERP__ROOT_LANES(square), ratio = radius / length;
    const perp__lanes inside = PERP__SELECT_LANES(radius > zero, PERP__SAME_LANES(1.0), zero);
    const perp__lanes share =
        PERP__SELECT_LANES((length > radius) & (radius > zero), ratio, inside);

    PERP__LANES_AT(s->r[g][0]) = pressure;
    PERP__LANES_AT(s->r[g][1]) = r_1 * share;
    PERP__LANES_AT(s->r[g][2]) = r_2 * share;
}

/* |r - P_K(r - (u + s e_n) / t)| t of each contact of a group, or where that is more the velocities
 * that its mode says are 0; the residuals that come of it, with what rounding may have made of the
 * velocities; and the mode, as in law.c. All cases at once: what a lane does not need may be NaN.
 */
PERP__KERNEL static void find_lack(perp__single *s, int32_t g)
{
    const perp__lanes zero = {0.0}, one = PERP__SAME_LANES(1.0), two = PERP__SAME_LANES(2.0);
    const perp__lanes mu = PERP__CONST_LANES_AT(s->mu + LANES * g);
    const perp__lanes t = PERP__CONST_LANES_AT(s->trace + LANES * g);
    const perp__lanes r_n = PERP__CONST_LANES_AT(s->r[g][0]),
                      u_n = PERP__CONST_LANES_AT(s->u[g][0]);
    const perp__lanes r_1 = PERP__CONST_LANES_AT(s->r[g][1]),
                      u_1 = PERP__CONST_LANES_AT(s->u[g][1]);
    const perp__lanes r_2 = PERP__CONST_LANES_AT(s->r[g][2]),
                      u_2 = PERP__CONST_LANES_AT(s->u[g][2]);
    const perp__lanes d_1 = u_1 / t, d_2 = u_2 / t, speed_2 = d_1 * d_1 + d_2 * d_2;
    const perp__lanes x_1 = r_1 - d_1, x_2 = r_2 - d_2, length_2 = x_1 * x_1 + x_2 * x_2;
    const perp__lanes speed = PERP__ROOT_LANES(speed_2), length = PERP__ROOT_LANES(length_2);
    const perp__lanes d_n = u_n / t + mu * speed, x_n = r_n - d_n;
    /* slip: how far x is outside of the cone, without what cancels in it */
    const perp__lanes size_2 = r_1 * r_1 + r_2 * r_2, size = PERP__ROOT_LANES(size_2);
    const perp__lanes change = d_1 * (d_1 - two * r_1) + d_2 * (d_2 - two * r_2);
    const perp__lanes over = size + (change / (length + size) + mu * (d_n - r_n));
    const perp__lanes c = over / (one + mu * mu), e_n = d_n - mu * c;
    const perp__lanes e_1 = d_1 + c * x_1 / length, e_2 = d_2 + c * x_2 / length;
    const perp__lanes slip_2 = e_n * e_n + e_1 * e_1 + e_2 * e_2;
    const perp__lanes stick_2 = d_n * d_n + speed * speed;
    const perp__lanes apart_2 = r_n * r_n + r_1 * r_1 + r_2 * r_2;
    const perp__lanes still_2 = u_n * u_n + u_1 * u_1 + u_2 * u_2;
    const perp__lane_bits sticks = mu * x_n >= length, parts = mu * length <= -x_n;
    const perp__lanes move_2 =
        PERP__SELECT_LANES(parts, apart_2, PERP__SELECT_LANES(sticks, stick_2, slip_2));
    const perp__lanes move = PERP__ROOT_LANES(move_2), still = PERP__ROOT_LANES(still_2);
    const perp__lanes free =
        t * PERP__SELECT_LANES(parts | (mu > zero), move, PERP__ABSOLUTE_LANES(d_n));
    const perp__lanes holds = PERP__SELECT_LANES(sticks, still, PERP__ABSOLUTE_LANES(u_n));
    const perp__lanes held = PERP__SELECT_LANES(~parts & (r_n != zero), holds, zero);

    const perp__lanes error = two * (one + mu) * PERP__CONST_LANES_AT(s->errors + LANES * g);
    const perp__lanes lack = PERP__SELECT_LANES(held > free, held, free) + error;

    PERP__LANES_AT(s->tested + LANES * g) =
        lack / (PERP__CONST_LANES_AT(s->root + LANES * g) * PERP__SAME_LANES(s->omega));
    PERP__LANES_AT(s->own + LANES * g) = lack / PERP__CONST_LANES_AT(s->scales + LANES * g);
    PERP__LANES_AT(s->pressed + LANES * g) =
        PERP__SELECT_LANES(parts, zero, PERP__SELECT_LANES(sticks, two, one));
}

PERP__MULTIVERSION(judge_all, (perp__single * s), (s))
{
    for (int32_t g = 0; g < s->groups; g++)
        clip(s, g);
    if (s->problem->width == WIDTH)
        velocities_width(s, WIDTH);
    else
        velocities_width(s, 3);
    for (int32_t g = 0; g < s->groups; g++)
        find_lack(s, g);
}

/* How many rows of each contact hold, as in held.c. Returns whether none of those is to move. */
static int32_t find_held(perp__single *s)
{
    const double slack = sqrt(s->problem->tol) * s->omega;
    int32_t may = 1;

    s->axes = 0;
    memset(s->held, 0, sizeof s->held); /* lanes without a contact too */
    for (int32_t k = 0; k < s->problem->contacts; k++) {
        const int32_t mode = s->modes[k], rows = s->mu[k] > 0.0 ? s->dims[k] : 1;
        int32_t held = 0, is_near = 1;

        for (int32_t a = 0; a < s->dims[k] && is_near; a++) {
            const double speed = fabs(PERP__OF(s->u, k, a));
            const int32_t is_still = speed <= ROUNDING * PERP__OF(s->scale, k, a);

            is_near =
                speed <= slack * s->root[k] &&
                (is_still || (a == 0 ? mode != PERP_CONTACT_SEPARATE : mode == PERP_CONTACT_STICK));
            held = is_near ? (a + 1 == s->dims[k] ? rows : 1) : held;
        }
        s->held[k] = held;
        s->axes = held > s->axes ? held : s->axes;
        for (int32_t a = 0; a < held; a++)
            may = may && s->problem->rows[k].bias[a] == 0.0;
    }
    return may;
}

int32_t perp__rigid_single(perp__rigid_answer *answer, const perp__rigid_problem *problem,
                           double tol)
{
    static const int32_t modes[] = {PERP_CONTACT_SEPARATE, PERP_CONTACT_SLIP, PERP_CONTACT_STICK};
    const perp__rigid_problem *p = problem;
    perp__evidence worth = {0.0, 0.0, 1.0, 1};
    perp__single s;

    /* 1. Whether there is but one body, on the world at rest. */
    s.problem = p;
    if (p->bodies != 1 || p->carriers > 0 || p->joints > 0 || p->contacts < 1 ||
        p->contacts > MOST || !p->warm || p->cone > 0 || p->method != PERP_CONTACT_METHOD_AUTO)
        return 0;
    for (int32_t k = 0; k < p->contacts; k++)
        if (p->rows[k].body[0] + p->rows[k].body[1] != PERP__RIGID_AT_REST)
            return 0;
    set_up(&s);
    /* 2. The largest free velocity, where no square might leave the range of numbers. */
    s.omega = 0.0;
    for (int32_t k = 0; k < p->contacts; k++) {
        s.omega = s.driven[k] > s.omega ? s.driven[k] : s.omega;
        if (!(s.trace[k] > LEAST && s.trace[k] < 1.0 / LEAST))
            return 0;
    }
    if (!(s.omega > LEAST && s.omega < 1.0 / LEAST))
        return 0;
    /* 3. The residuals, as they are or larger. Contacts that press must not separate. */
    judge_all(&s);
    for (int32_t k = 0; k < p->contacts; k++) {
        const double r_n = PERP__OF(s.r, k, 0);

        if (r_n != 0.0 && s.pressed[k] == 0.0)
            return 0;
        s.modes[k] = r_n == 0.0 ? PERP_CONTACT_SEPARATE : modes[(int32_t)s.pressed[k]];
        perp__raise_to(&worth.tested, s.tested[k]);
        perp__raise_to(&worth.own, s.own[k]);
    }
    if (!perp__is_good(perp__gate(&worth, tol, -1)) || !find_held(&s))
        return 0;
    answer->tested = worth.tested;
    /* 4. The velocities that what holds leaves. */
    perp__single_hold(&s);
    perp__raise_to(&worth.own, s.change);
    worth.sound = perp__all_finite(s.v, ROOM); /* where u is not, neither are its errors */
    answer->outcome = perp__gate(&worth, p->tol, -1);
    answer->own = worth.own;
    answer->backward = worth.backward;
    if (!perp__is_good(answer->outcome))
        return 0;
    memcpy(answer->v, s.v, (size_t)p->width * sizeof *answer->v);
    for (int32_t k = 0; k < p->contacts; k++) {
        for (int32_t a = 0; a < AXES; a++) {
            answer->impulse[AXES * k + a] = PERP__OF(s.r, k, a);
            answer->velocity[AXES * k + a] = a < s.held[k] ? 0.0 : PERP__OF(s.after, k, a);
        }
        answer->modes[k] = s.modes[k];
    }
    answer->carrier[0] = s.rank == p->width ? PERP__RIGID_AT_REST : PERP__RIGID_FREE;
    answer->held = 1;
    answer->iterations = 0;
    return 1;
}
