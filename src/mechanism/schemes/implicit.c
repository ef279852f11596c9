/* The step with everything at its end (Stewart & Trinkle 1995):
 *
 *   M(q+) (v+ - v) = h k(t+h, q+, v+) + J(q+)'r,   q+ = q + h N(q) v+,
 *   0 <= r_n perp (gap(q+) - min(gap(q), 0)) / h >= 0,   (c(q+) - c(q)) / h = 0,   friction of
 * u_t+.
 *
 * An overlap or drift that the step starts with throws nothing: it does not grow, and projection
 * removes it. From the answer of the frozen step on, the problem in velocities with the geometry
 * and the forces that the last iterate v leads to is solved again (Josephy and Newton's method on
 * gaps and constraints): their speeds are u + curvature, with what the linear rows leave out of
 * (gap(q+) - gap(q)) / h at v in `curvature`. A gap is known up to rounding of q, and so much of
 * the curvature does not count: gap / h would be noise, and iterates go to and fro in it.
 *
 * Where iterates come near slowly M is replaced by A, the symmetric part of the derivative by v of
 * M(q+) (v - v_0) - h k - J(q+)'r, by differences: n calls of every callback. Where they do not
 * meet the step is the frozen one: no start far from it is tried, as the solutions found so would
 * be others than the motion's. */
#include "mechanism/mechanism.h"

#include <math.h>
#include <string.h>

#include "base/context.h"

struct perp__implicit {
    PERP__WORK;
    perp_mechanism_start from;          /* of the step */
    double *A, *factor;                 /* n by n: in the place of M, and its L, columns */
    double *v, *left, *moved, *x, *sum; /* n: iterate; what it lacks of its balance; scratch */
    double *q;                          /* coordinates: where v leads */
    double *curvature, *rounding; /* rows: of gaps and constraints, and of their speeds; else 0 */
    double *kept_u, *kept_bound;  /* rows: u and shift of the last solution; contacts, then dry
                                     groups: its coefficients and bounds */
};

static void layout(perp__arena *arena, void *object)
{
    perp__implicit *s = object;
    const size_t n = (size_t)s->m->n;

    PERP__DOUBLES(arena, n * n, &s->A, &s->factor);
    PERP__DOUBLES(arena, n, &s->v, &s->left, &s->moved, &s->x, &s->sum);
    PERP__DOUBLES(arena, (size_t)s->m->coordinates, &s->q);
    PERP__DOUBLES(arena, (size_t)s->m->rows, &s->curvature, &s->rounding, &s->kept_u);
    PERP__DOUBLES(arena, (size_t)(s->m->contacts + s->m->dry), &s->kept_bound);
}

/* What the row's gap (or c) is beyond the linear one, as a speed, without what may be rounding. */
static double curvature_of(const perp_mechanism *m, perp__implicit *s, int32_t row, double now,
                           double before)
{
    const double linear = perp__row_times(m, &m->end, row, m->end.drift[row], s->v);
    const double curvature = (now - before) / s->from.h - linear;

    s->rounding[row] = perp__gap_rounding(m, &m->end, row, s->q) / s->from.h;
    return copysign(fmax(fabs(curvature) - s->rounding[row], 0.0), curvature);
}

/* s->q and m->end := those of v. Numbers that are no model's (not finite, M not positive definite)
 * mean that v is outside, too; only an abort ends the step. */
static perp_status evaluate(perp_mechanism *m, perp__implicit *s, const double *v)
{
    perp_status status = perp__evaluate_move(m, s->q, s->from.q, s->from.q, s->from.h, v);

    PERP__THEN(status, perp__evaluate_all(m, &m->end, s->from.t + s->from.h, s->q, v));
    if (status == PERP_ERROR_NOT_FINITE || status == PERP_ERROR_ARGUMENT) {
        m->context->message[0] = '\0';
        status = PERP__OUTSIDE;
    }
    return status;
}

/* The problem in velocities of the iterate: m->end, with curvatures in its drift and in the shifts,
 * coefficients, bounds and momentum. */
static perp_status pose(perp_mechanism *m, perp__implicit *s)
{
    perp_status status = evaluate(m, s, s->v);

    for (int32_t retreat = 0; status == PERP__OUTSIDE && retreat < PERP__MOST_HALVES; retreat++) {
        for (int32_t i = 0; i < m->n; i++)
            s->v[i] *= 0.5;
        status = evaluate(m, s, s->v);
    }
    if (status != PERP_OK)
        return status;
    perp__friction_of_speed(m, &m->end, m->friction, m->start_velocity, s->from.v);
    perp__prepare_impulses(m, &m->end, &s->from);
    memset(s->curvature, 0, (size_t)m->rows * sizeof *s->curvature);
    memset(s->rounding, 0, (size_t)m->rows * sizeof *s->rounding);
    for (int32_t j = 0; j < m->constraints; j++)
        s->curvature[m->constraint_row[j]] =
            curvature_of(m, s, m->constraint_row[j], m->end.c[j], m->begin.c[j]);
    for (int32_t j = 0; j < m->contacts; j++)
        if (m->two_sided[j] == 0)
            m->shift[j] = fmax(m->begin.gap[j], 0.0) / s->from.h +
                          curvature_of(m, s, m->starts[j], m->end.gap[j], m->begin.gap[j]);
    for (int32_t i = 0; i < m->rows; i++)
        m->end.drift[i] += s->curvature[i];
    return PERP_OK;
}

/* to := M(q+) (v - v_0) - h k - J(q+)'r, with m->end of v. */
static void balance(const perp_mechanism *m, perp__implicit *s, double *to, const double *v)
{
    for (int32_t i = 0; i < m->n; i++)
        s->x[i] = v[i] - s->from.v[i];
    perp__multiply_mass(m, &m->end, to, s->x);
    for (int32_t i = 0; i < m->n; i++)
        to[i] -= s->from.h * m->end.k[i];
    for (int32_t i = 0; i < m->rows; i++)
        perp__add_row(m, &m->end, i, -m->answer.r[i], to);
}

/* s->A, about the iterate, and whether it is positive definite; M serves where it is not. */
static perp_status find_matrix(perp_mechanism *m, perp__implicit *s, int32_t *found)
{
    const size_t n = (size_t)m->n;
    const double speed = fmax(perp__energy_norm(m, &m->begin, s->x, s->from.v),
                              perp__energy_norm(m, &m->begin, s->x, s->v));
    perp_status status = PERP_OK;

    balance(m, s, s->left, s->v);
    memcpy(s->moved, s->v, n * sizeof *s->v);
    for (size_t j = 0; j < n && status == PERP_OK; j++) {
        const double unit = (speed > 0.0 ? speed : 1.0) / sqrt(m->begin.M[j * (n + 1)]);

        s->moved[j] = s->v[j] + perp__difference_step(2) * fmax(fabs(s->v[j]), unit);
        status = evaluate(m, s, s->moved);
        balance(m, s, s->sum, s->moved);
        for (size_t i = 0; i < n; i++)
            s->A[i + n * j] = (s->sum[i] - s->left[i]) / (s->moved[j] - s->v[j]);
        s->moved[j] = s->v[j];
    }
    *found = status == PERP_OK && perp__factor_symmetric_part(m->n, s->A, s->factor);
    return status == PERP__OUTSIDE ? PERP_OK : status;
}

/* What the last solution lacks of the problem that it leads to, the worst of its momentum balance,
 * speeds of rows and bounds of friction, each beside its terms; kept: those it was found with. */
static double lacks(perp_mechanism *m, const perp__implicit *s)
{
    const perp__motion *answer = &m->answer;
    double worst = perp__momentum_residual(m, &m->end, m->momentum, answer->v, answer->r);

    for (int32_t i = 0; i < m->rows; i++) {
        const int32_t normal = m->normal_of[i];
        const double shift = normal < 0 ? 0.0 : m->shift[normal];
        const double size = perp__row_size(m, &m->end, i, answer->v) + fabs(shift);
        const double now = perp__row_times(m, &m->end, i, m->end.drift[i] + shift, answer->v);

        if (fabs(now - s->kept_u[i]) > s->rounding[i])
            perp__raise_to(&worst, fabs(now - s->kept_u[i]) / size);
    }
    for (int32_t j = 0; j < m->contacts + m->dry; j++) {
        const double now = j < m->contacts ? m->friction[j] : m->dry_bound[j - m->contacts];

        if (now != s->kept_bound[j])
            perp__raise_to(&worst, fabs(now - s->kept_bound[j]) / fmax(now, s->kept_bound[j]));
    }
    return worst;
}

/* m->answer := the step's solution, and m->end where it leads; found: whether there is one. */
static perp_status iterate(perp_mechanism *m, perp__implicit *s, perp_mechanism_step *step,
                           int32_t *found)
{
    double lacking = INFINITY;
    int32_t has_matrix = 0;
    perp_status status = PERP_OK;

    for (int32_t pass = 0; pass < PERP__MOST_ITERATES && status == PERP_OK &&
                           !(pass > 0 && perp__mechanism_is_late(m));
         pass++) {
        const double before = lacking;
        perp__velocity_problem problem;
        perp__terms terms;

        /* 1. what the last solution leads to, and whether it is that of the step */
        for (int32_t i = 0; i < m->rows; i++)
            s->kept_u[i] = m->answer.u[i] + (m->normal_of[i] < 0 ? 0.0 : m->shift[m->normal_of[i]]);
        memcpy(s->kept_bound, m->friction, (size_t)m->contacts * sizeof *s->kept_bound);
        memcpy(s->kept_bound + m->contacts, m->dry_bound, (size_t)m->dry * sizeof *s->kept_bound);
        memcpy(s->v, m->answer.v, (size_t)m->n * sizeof *s->v);
        status = pose(m, s);
        if (status != PERP_OK)
            break;
        lacking = lacks(m, s);
        *found = memcmp(s->v, m->answer.v, (size_t)m->n * sizeof *s->v) == 0 &&
                 perp__is_good(m->answer.outcome) &&
                 lacking <= (lacking < before ? 1.0 : PERP__LEVERS) * m->settings.tol;
        if (*found)
            break;
        if (pass > 0 && lacking > PERP__SLOW * before) {
            status = find_matrix(m, s, &has_matrix);
            PERP__THEN(status, pose(m, s));
        }
        /* 2. the next one */
        terms = m->end;
        problem = perp__pose(m, &terms);
        if (has_matrix) {
            terms.M = s->A;
            terms.factor = s->factor;
            perp__multiply_mass(m, &terms, s->x, s->v);
            perp__multiply_mass(m, &m->end, s->sum, s->v);
            for (int32_t i = 0; i < m->n; i++)
                s->left[i] = m->momentum[i] + (s->x[i] - s->sum[i]);
            problem.momentum = s->left;
        }
        step->iterations += m->answer.iterations;
        PERP__THEN(status, perp__solve_frozen(m, &problem));
        if (!perp__is_good(m->answer.outcome))
            break;
    }
    if (*found)
        perp__check_iterate(m, fmin(lacking, m->settings.tol)); /* but for levers */
    return status == PERP__OUTSIDE || status == PERP_ERROR_NOT_FINITE ? PERP_OK : status;
}

perp_status perp__advance_implicit(perp_mechanism *m, perp__motion *to, perp_mechanism_step *step,
                                   const perp_mechanism_start *from)
{
    perp__implicit *s = m->implicit ? m->implicit : perp__work_create(m, sizeof *s, layout);
    perp__motion *answer = &m->answer;
    perp__velocity_problem problem;
    perp_status status;
    int32_t found = 0;

    m->implicit = s;
    if (!s)
        return PERP_ERROR_MEMORY;
    /* 1. the frozen step, and from there the implicit one */
    s->from = *from;
    status = perp__evaluate_all(m, &m->begin, from->t, from->q, from->v);
    if (status != PERP_OK)
        return status;
    perp__prepare_step(m, from);
    problem = perp__pose(m, &m->begin);
    status = perp__solve_frozen(m, &problem);
    if (!perp__is_good(answer->outcome)) { /* its last iterate may be anything: free motion */
        memcpy(answer->v, m->free, (size_t)m->n * sizeof *answer->v);
        memset(answer->r, 0, (size_t)m->rows * sizeof *answer->r);
    }
    if (status == PERP_OK && perp__outcome_moves(answer->outcome))
        status = iterate(m, s, step, &found);
    if (status == PERP_OK && !found) {
        step->iterations += answer->iterations; /* which the frozen step counts anew */
        return perp__advance_frozen(m, to, step, from);
    }
    /* 2. its end; u of a constraint at q+ is G v + drift itself */
    for (int32_t i = 0; i < m->rows && status == PERP_OK; i++) {
        m->end.drift[i] -= s->curvature[i];
        answer->u[i] -= s->curvature[i];
    }
    PERP__THEN(status, perp__evaluate_move(m, to->q, from->q, from->q, from->h, answer->v));
    if (status != PERP_OK)
        return status;
    step->scheme = PERP_MECHANISM_IMPLICIT;
    problem = perp__pose(m, &m->end);
    return perp__finish_step(m, to, step, from->t + from->h, &problem);
}
