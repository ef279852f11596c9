/* What sweeps have come to is seldom an answer, and that shows without a set-up: from the caller's
 * rows alone, with no more than the caller's answer for memory. The numbers are those of law.c and
 * verdict.c where all contacts hang together and the residual is tested alone. */
#include "contact/rigid/rigid.h"

#include <math.h>
#include <string.h>

#include "contact/law.h"
#include "linalg/lanes/lanes.h"
#include "linalg/lanes/multiversion.h"

typedef struct look {
    const perp__rigid_problem *problem;
    perp__rigid_answer *answer;
    double drive, residual; /* the largest |q| / sqrt(t) and sqrt(t) times a natural residual */
    double least_root, most_bias;
    perp__lanes arms, end_arms; /* the largest |J|: its first four columns, and the last two */
} look;

/* Of a contact: u, q without impulses, t = trace(W_kk). */
typedef struct terms {
    double u[3], q[3], trace;
} terms;

PERP__KERNEL static int32_t moves(const perp__rigid_problem *p, int32_t body)
{
    return body >= 0 && body < p->bodies;
}

PERP__KERNEL static void measure_any(int32_t width, look *l, const perp__rigid_rows *g, terms *x)
{
    const perp__rigid_problem *p = l->problem;

    for (int32_t side = 0; side < 2; side++) {
        const int32_t body = g->body[side], acts = moves(p, body);
        const double *f = p->free + (int64_t)width * body;
        const double *v = acts ? l->answer->v + (int64_t)width * body : f;
        const double *C = p->factors + (int64_t)(width * width) * body;

        for (int32_t i = 0; body >= 0 && i < g->dim; i++) {
            const double *J = g->rows[side][i];

            for (int32_t j = 0; j < width; j++) {
                double P = 0.0;

                x->u[i] += J[j] * v[j];
                x->q[i] += J[j] * f[j];
                l->arms[0] = fabs(J[j]) > l->arms[0] ? fabs(J[j]) : l->arms[0];
                for (int32_t k = 0; acts && k < width; k++)
                    P += J[k] * C[width * k + j];
                x->trace += P * P;
            }
        }
    }
}

#define SUM(four, two) ((((four)[0] + (four)[2]) + ((four)[1] + (four)[3])) + ((two)[0] + (two)[1]))

/* Raises lanes to those of |x|. */
PERP__KERNEL static void raise_lanes(perp__lanes *most, const perp__lanes *x)
{
    const perp__lanes size = PERP__ABSOLUTE_LANES(*x);

    *most = PERP__SELECT_LANES(size > *most, size, *most);
}

/* The same for three rows of six, in vectors: the first four columns and the last two. */
PERP__KERNEL static void measure_6(look *l, const perp__rigid_rows *g, terms *x)
{
    const perp__rigid_problem *p = l->problem;
    perp__lanes u[3] = {{0.0}}, q[3] = {{0.0}}, square = {0.0};
    perp__lane_pair end_u[3] = {{0.0}}, end_q[3] = {{0.0}}, end_square = {0.0};

    for (int32_t side = 0; side < 2; side++) {
        const int32_t body = g->body[side], acts = moves(p, body);
        const double *f = p->free + 6 * (int64_t)body, *C = p->factors + 36 * (int64_t)body;
        const double *v = acts ? l->answer->v + 6 * (int64_t)body : f;

        for (int32_t i = 0; body >= 0 && i < 3; i++) {
            const double *J = g->rows[side][i];
            const perp__lanes row = PERP__CONST_LANES_AT(J);
            const perp__lane_pair end = PERP__CONST_PAIR_AT(J + 4);
            const perp__lanes both = {end[0], end[1], 0.0, 0.0};
            perp__lanes P = {0.0};
            perp__lane_pair Q = {0.0};

            u[i] += row * PERP__CONST_LANES_AT(v);
            q[i] += row * PERP__CONST_LANES_AT(f);
            end_u[i] += end * PERP__CONST_PAIR_AT(v + 4);
            end_q[i] += end * PERP__CONST_PAIR_AT(f + 4);
            raise_lanes(&l->arms, &row);
            raise_lanes(&l->end_arms, &both);
            for (int32_t k = 0; acts && k < 6; k++) {
                P += PERP__SAME_LANES(J[k]) * PERP__CONST_LANES_AT(C + 6 * k);
                Q += PERP__SAME_PAIR(J[k]) * PERP__CONST_PAIR_AT(C + 6 * k + 4);
            }
            square += P * P;
            end_square += Q * Q;
        }
    }
    x->trace = SUM(square, end_square);
    for (int32_t i = 0; i < 3; i++) {
        x->u[i] += SUM(u[i], end_u[i]);
        x->q[i] += SUM(q[i], end_q[i]);
    }
}

PERP__KERNEL static void measure(look *l, int32_t k)
{
    const perp__rigid_rows *g = &l->problem->rows[k];
    double square = 0.0, root, natural;
    terms x = {{0.0}, {0.0}, 0.0};

    for (int32_t i = 0; i < g->dim; i++) {
        x.u[i] = x.q[i] = g->bias[i];
        l->most_bias = fabs(g->bias[i]) > l->most_bias ? fabs(g->bias[i]) : l->most_bias;
    }
    if (l->problem->width == 6 && g->dim == 3)
        measure_6(l, g, &x);
    else
        measure_any(l->problem->width, l, g, &x);
    for (int32_t i = 0; i < g->dim; i++)
        square += x.q[i] * x.q[i];
    root = sqrt(x.trace);
    l->least_root = root < l->least_root ? root : l->least_root;
    perp__raise_to(&l->drive, sqrt(square) / root);
    natural = perp__contact_natural_of(g->mu, g->dim - 1, x.trace, l->answer->impulse + 3 * k, x.u,
                                       &l->answer->modes[k]);
    perp__raise_to(&l->residual, root * natural);
    memcpy(l->answer->velocity + 3 * k, x.u, sizeof x.u);
}

/* y += J'r of one side */
PERP__KERNEL static void push(int32_t width, const perp__rigid_rows *g, int32_t side,
                              const double *r, double *y)
{
    for (int32_t i = 0; i < g->dim; i++)
        for (int32_t j = 0; j < width; j++)
            y[j] += g->rows[side][i][j] * r[i];
}

PERP__KERNEL static void push_6(const perp__rigid_rows *g, int32_t side, const double *r, double *y)
{
    perp__lanes sum = PERP__CONST_LANES_AT(y);
    perp__lane_pair end = PERP__CONST_PAIR_AT(y + 4);

    for (int32_t i = 0; i < 3; i++) {
        sum += PERP__CONST_LANES_AT(g->rows[side][i]) * PERP__SAME_LANES(r[i]);
        end += PERP__CONST_PAIR_AT(g->rows[side][i] + 4) * PERP__SAME_PAIR(r[i]);
    }
    PERP__LANES_AT(y) = sum;
    PERP__PAIR_AT(y + 4) = end;
}

/* v := v_free + C C' v */
PERP__KERNEL static void move(const perp__rigid_problem *p, int32_t width, int32_t body, double *v)
{
    const double *C = p->factors + width * width * body;
    double y[6] = {0.0};

    for (int32_t i = 0; i < width; i++)
        for (int32_t j = 0; j < width; j++)
            y[j] += C[width * i + j] * v[i];
    for (int32_t i = 0; i < width; i++) {
        v[i] = p->free[width * body + i];
        for (int32_t j = 0; j < width; j++)
            v[i] += C[width * i + j] * y[j];
    }
}

/* v of the impulses, and what that makes of the contacts. */
PERP__MULTIVERSION(evaluate, (look * l), (l))
{
    const perp__rigid_problem *p = l->problem;
    const int32_t width = p->width;
    double *v = l->answer->v;

    memset(v, 0, (size_t)(width * p->bodies) * sizeof *v);
    for (int32_t k = 0; k < p->contacts; k++)
        for (int32_t side = 0; side < 2; side++) {
            const perp__rigid_rows *g = &p->rows[k];

            if (!moves(p, g->body[side]))
                continue;
            if (width == 6 && g->dim == 3)
                push_6(g, side, l->answer->impulse + 3 * k, v + 6 * g->body[side]);
            else
                push(width, g, side, l->answer->impulse + 3 * k, v + width * g->body[side]);
        }
    for (int32_t b = 0; b < p->bodies; b++)
        if (width == 6)
            move(p, 6, b, v + 6 * b);
        else
            move(p, width, b, v + width * b);
    l->drive = l->residual = l->most_bias = 0.0;
    l->least_root = INFINITY;
    l->arms = l->end_arms = PERP__SAME_LANES(0.0);
    for (int32_t k = 0; k < p->contacts; k++)
        measure(l, k);
}

/* Whether q has so much of its terms that their rounding is no drive (evaluation.c). */
static int32_t is_driven(const look *l)
{
    const perp__rigid_problem *p = l->problem;
    double most = 0.0, arm = 0.0;

    for (int32_t b = 0; b < p->bodies + p->carriers; b++) {
        double sum = 0.0;

        for (int32_t i = 0; i < p->width; i++)
            sum += fabs(p->free[p->width * b + i]);
        most = sum > most ? sum : most;
    }
    for (int32_t i = 0; i < 4; i++)
        arm = fmax(arm, fmax(l->arms[i], l->end_arms[i]));
    return PERP__ROUNDING_LIMIT / p->tol * (2.0 * arm * most + l->most_bias) <=
           l->drive * l->least_root;
}

/* The start in its cones. */
static void clip(look *l)
{
    for (int32_t k = 0; k < l->problem->contacts; k++) {
        const perp__rigid_rows *g = &l->problem->rows[k];
        const double *given = l->problem->warm + 3 * k;
        double *r = l->answer->impulse + 3 * k, most, length;

        for (int32_t i = 0; i < 3; i++)
            r[i] = i < g->dim ? given[i] : 0.0;
        r[0] = r[0] > 0.0 ? r[0] : 0.0;
        most = g->mu * r[0];
        if (!(r[1] * r[1] + r[2] * r[2] > most * most))
            continue;
        length = hypot(r[1], r[2]);
        r[1] *= most / length;
        r[2] *= most / length;
    }
}

/* r := 0 where contacts separate; returns whether it was not. */
static int32_t separate(look *l)
{
    int32_t some = 0;

    for (int32_t k = 0; k < l->problem->contacts; k++)
        for (int32_t i = 0; i < 3 && l->answer->modes[k] == PERP_CONTACT_SEPARATE; i++) {
            some |= l->answer->impulse[3 * k + i] != 0.0;
            l->answer->impulse[3 * k + i] = 0.0;
        }
    return some;
}

static int32_t is_plain(const perp__rigid_problem *p)
{
    int32_t plain = p->joints == 0 && p->cone == 0 && p->tol >= PERP__RIGID_PLAIN;

    for (int32_t k = 0; k < p->contacts; k++)
        plain = plain && p->rows[k].mu <= PERP__STEEP;
    return plain;
}

static void write_answer(perp__rigid_answer *answer, int32_t contacts)
{
    for (int32_t k = 0; k < contacts; k++)
        if (answer->impulse[3 * k] == 0.0)
            answer->modes[k] = PERP_CONTACT_SEPARATE;
        else if (answer->modes[k] == PERP_CONTACT_SEPARATE)
            answer->modes[k] = PERP_CONTACT_SLIP;
    answer->outcome = PERP_OUTCOME_ITERATION_LIMIT;
    answer->method = PERP_CONTACT_METHOD_POLISH;
    answer->held = 0;
    answer->iterations = 0;
    answer->own = INFINITY;
    answer->backward = 1.0;
    answer->certificate = PERP_CONTACT_CERTIFICATE_NONE;
}

int32_t perp__rigid_refute(perp__rigid_answer *answer, const perp__rigid_problem *problem,
                           double tol)
{
    look l;

    if (!is_plain(problem))
        return 0;
    l.problem = problem;
    l.answer = answer;
    clip(&l);
    evaluate(&l);
    if (l.residual <= sqrt(problem->tol) * l.drive && separate(&l))
        evaluate(&l);
    answer->tested = l.residual / l.drive;
    if (!(answer->tested > tol && answer->tested < INFINITY && is_driven(&l)))
        return 0;
    write_answer(answer, problem->contacts);
    return 1;
}
