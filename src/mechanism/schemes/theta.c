/* The step of Moreau and Jean (J. J. Moreau 1988; M. Jean, Comput. Methods Appl. Mech. Eng. 177
 * (1999)), with positions that land on contacts as those of the frozen step do:
 *
 *   M (v+ - v) = h (theta k(t+h, q+, v+) + (1 - theta) k(t, q, v)) + J'r,
 *   q+ = q + h N (theta v+ + (1 - theta) v),   with v+ alone where velocities jump,
 *   0 <= r_n perp max(gap, 0)/h + u_n+ >= 0,   friction of u_t+.
 *
 * M is taken at q + (1 - theta) h N v, and J = theta J(q) + (1 - theta) J(q*), q* the predicted
 * end: q + h N v, in chosen steps q + h N (v + h a/2) with the acceleration of the step before, so
 * that u+ is 0 at the true end up to h^3; for theta = 1/2 both are in the middle, up to h^2. The
 * speeds u+ of the laws are those at the end, J(q*) v+ + drift(q*); what differs from J v+ is taken
 * from the last iterate, so that the contact problem keeps its symmetry. With theta = 1 all
 * geometry is that of the start.
 *
 * Friction and contact act through v+ alone: weighted like k they would ring (u_n+ = -u_n). Where
 * something slips at both ends nothing rings, and friction is that of the mean theta u_t+ + (1 -
 * theta) u_t-: so that a slip that turns, and one with the coefficient of its speed, have the
 * second order too. A contact that the step reaches keeps the speed gap/h that brings it to 0; it
 * has gap 0 when the next step begins, and u_n+ = 0 (or the restitution's) from there on. */
#include "mechanism/mechanism.h"

#include <math.h>
#include <string.h>

/* Velocities that change by more than this share are followed by the rows of the end. */
#define CHANGED 0.05

/* What the steps of the scheme keep. */
struct perp__theta {
    PERP__WORK;
    perp_mechanism_start from; /* of the step */
    double *A, *factor;        /* n by n: iteration matrix and its L, columns */
    double *force;             /* n: k at the end, of the iterate */
    double *p, *last;   /* n: M v0 + h (theta k+ + (1 - theta) k), and that of the last iterate */
    double *v, *last_v; /* n: iterates */
    double *middle;     /* n: theta v+ + (1 - theta) v0 */
    double *x, *y;      /* n: scratch */
    double *q, *at, *probe; /* coordinates: of the iterate; where N is taken; of differences */
    perp__terms terms;      /* m->begin with A for M where that is needed */
    int32_t has_matrix;     /* A is not M */
    int32_t tried_matrix;
    int32_t corrected; /* speeds are measured with the rows of the end */
    int8_t *mean;      /* contacts, then dry groups: 1: friction is that of the mean slip */
    double *slip;      /* rows: that, else the slip at the start */
};

static void layout(perp__arena *arena, void *object)
{
    perp__theta *w = object;
    const size_t n = (size_t)w->m->n;

    PERP__DOUBLES(arena, n * n, &w->A, &w->factor);
    PERP__DOUBLES(arena, n, &w->force, &w->p, &w->last, &w->v, &w->last_v, &w->middle, &w->x,
                  &w->y);
    PERP__DOUBLES(arena, (size_t)w->m->coordinates, &w->q, &w->at, &w->probe);
    PERP__DOUBLES(arena, (size_t)w->m->rows, &w->slip);
    w->mean = perp__arena_take(arena, (size_t)(w->m->contacts + w->m->dry), 1);
}

/* ---- what is fixed during a step ----------------------------------------------------------- */

/* begin.M; begin.J := J, end.J := what the rows of the end have more, begin.mu and begin.bound
 * between. */
static perp_status evaluate_geometry(perp_mechanism *m, perp__theta *w)
{
    const size_t entries = (size_t)m->rows * (size_t)m->n;
    const double theta = m->settings.theta, ahead = 1.0 - theta, t = w->from.t + w->from.h;
    perp_status status = PERP_OK;

    /* 1. M, or that of the start where the model has none ahead; the velocities expected */
    w->corrected = 0;
    for (int32_t i = 0; i < m->n; i++)
        w->v[i] = w->from.v[i] + w->from.h * m->acceleration[i];
    memcpy(w->at, w->from.q, (size_t)m->coordinates * sizeof *w->at);
    if (ahead > 0.0)
        status = perp__evaluate_move(m, w->at, w->from.q, w->from.q, ahead * w->from.h, w->from.v);
    PERP__THEN(status, perp__evaluate_mass(m, &m->begin, w->at));
    if (status == PERP__OUTSIDE)
        status = perp__evaluate_mass(m, &m->begin, w->from.q);
    if (status != PERP_OK || !(ahead > 0.0) || m->rows == 0) {
        memcpy(m->end.drift, m->begin.drift, (size_t)m->rows * sizeof *m->end.drift);
        return status;
    }
    /* 2. the rows at the predicted end, or at the start alike */
    for (int32_t i = 0; i < m->n; i++)
        w->middle[i] = 0.5 * (w->from.v[i] + w->v[i]);
    status = perp__evaluate_move(m, w->q, w->from.q, w->from.q, w->from.h, w->middle);
    PERP__THEN(status, perp__evaluate_rows(m, &m->end, t, w->q, w->v));
    if (status == PERP__OUTSIDE)
        status = perp__evaluate_rows(m, &m->end, t, w->from.q, w->v);
    if (status != PERP_OK)
        return status;
    /* 3. between */
    for (size_t i = 0; i < entries; i++) {
        const double change = m->end.J[i] - m->begin.J[i];

        m->begin.J[i] += ahead * change;
        m->end.J[i] = theta * change;
        w->corrected = w->corrected || m->end.J[i] != 0.0;
    }
    for (size_t i = 0; i < (size_t)m->contacts; i++)
        m->begin.mu[i] += ahead * (m->end.mu[i] - m->begin.mu[i]);
    for (size_t i = 0; i < (size_t)m->dry; i++)
        m->begin.bound[i] += ahead * (m->end.bound[i] - m->begin.bound[i]);
    return status;
}

/* ---- forces at the end -----------------------------------------------------------------------
 *
 * k(t+h, q+, v+) is found by fixed-point iteration. Where k depends on q and v so strongly that
 * this converges slowly, the iteration's matrix is A = M - h theta sym(K), K = dk/dv + h theta
 * dk/dq N: symmetric and positive definite, as the contact problem needs it. One difference of k in
 * each velocity, with the position that goes with it, gives all of K. */

/* q := where the velocities lead. N is taken between start and end. */
static perp_status move(perp_mechanism *m, perp__theta *w, double *q, const double *v)
{
    const double theta = m->settings.theta, *at = w->from.q;
    perp_status status = PERP_OK;

    for (int32_t i = 0; i < m->n; i++)
        w->middle[i] = theta * v[i] + (1.0 - theta) * w->from.v[i];
    if (m->model.kinematics && theta < 1.0) {
        status = perp__evaluate_move(m, w->at, w->from.q, at, (1.0 - theta) * w->from.h, w->middle);
        at = w->at;
    }
    PERP__THEN(status, perp__evaluate_move(m, q, w->from.q, at, w->from.h, w->middle));
    return status;
}

/* w->q := q0 moved by h N (theta v + (1 - theta) v0), and w->force := k there. */
static perp_status find_force(perp_mechanism *m, perp__theta *w, const double *v)
{
    perp_status status = move(m, w, w->q, v);

    PERP__THEN(status, perp__evaluate_force(m, w->force, w->from.t + w->from.h, w->q, v));
    return status;
}

/* w->A := M - h theta sym(dk/dv + h theta dk/dq N), by differences about the iterate, and w->terms
 * with it; stays M where that is not positive definite. */
static perp_status find_matrix(perp_mechanism *m, perp__theta *w)
{
    const size_t n = (size_t)m->n;
    const double weight = w->from.h * m->settings.theta;
    double largest = 0.0;
    perp_status status = PERP_OK;

    /* 1. M - h theta K, K by columns */
    w->tried_matrix = 1;
    for (size_t i = 0; i < n; i++)
        largest = fmax(largest, fmax(fabs(w->v[i]), fabs(w->from.v[i])));
    memcpy(w->x, w->v, n * sizeof *w->x);
    for (size_t j = 0; j < n && status == PERP_OK; j++) {
        const double size = fmax(fmax(fabs(w->v[j]), fabs(w->from.v[j])), PERP__LITTLE * largest);
        double delta;

        w->x[j] = w->v[j] + perp__difference_step(2) * size;
        delta = w->x[j] - w->v[j];
        status = move(m, w, w->probe, w->x);
        PERP__THEN(status, perp__evaluate_force(m, w->y, w->from.t + w->from.h, w->probe, w->x));
        for (size_t i = 0; i < n && status == PERP_OK; i++)
            w->A[i + n * j] = m->begin.M[i * n + j] -
                              (delta > 0.0 ? weight * (w->y[i] - w->force[i]) / delta : 0.0);
        w->x[j] = w->v[j];
    }
    if (status != PERP_OK)
        return status == PERP__OUTSIDE ? PERP_OK : status; /* M serves */
    /* 2. its symmetric part, if that is positive definite */
    w->has_matrix = perp__factor_symmetric_part(m->n, w->A, w->factor);
    if (w->has_matrix) {
        w->terms.M = w->A;
        w->terms.factor = w->factor;
    }
    return PERP_OK;
}

/* ---- the iteration ------------------------------------------------------------------------- */

/* To x, of rows that friction against the mean slip acts in: s times what the slip at the start
 * adds to that at the end, ((1 - theta)/theta) u_t-. The laws ask for directions alone. */
static void add_means(const perp_mechanism *m, const perp__theta *w, double s, double *x)
{
    const double theta = m->settings.theta;

    for (int32_t j = 0; j < m->contacts + m->dry; j++)
        for (int32_t i = m->tangent[j]; i < m->tangent[j] + m->tangents[j] && w->mean[j]; i++)
            x[i] += s * (1.0 - theta) / theta * m->start_velocity[i];
}

/* begin.drift := drift of the end, what its rows make of `v` beyond J, and of means. */
static void correct_drift(perp_mechanism *m, const perp__theta *w, const double *v)
{
    memcpy(m->begin.drift, m->end.drift, (size_t)m->rows * sizeof *m->begin.drift);
    if (w->corrected)
        perp__row_velocities(m, &m->end, m->begin.drift, v);
    add_means(m, w, 1.0, m->begin.drift);
}

/* Whether velocities jump: a contact was hit, approached faster than the forces of the step make
 * it, or its sliding, faster than what these make of it, jams. */
static bool jumps(perp_mechanism *m)
{
    const double *start = m->start_velocity, *free = m->free_velocity;
    bool found = 0;

    for (int32_t j = 0; j < m->contacts && !found && perp__outcome_moves(m->answer.outcome); j++) {
        const int32_t row = m->starts[j];
        double before = 0.0, change = 0.0;

        if (m->two_sided[j] > 0 || !(m->answer.r[row] > 0.0))
            continue;
        for (int32_t i = m->tangent[j]; i < m->tangent[j] + m->tangents[j]; i++) {
            before = hypot(before, start[i]);
            change = hypot(change, free[i] - start[i]);
        }
        found = start[row] < -fabs(free[row] - start[row]) ||
                (before > change && perp__is_jammed(m, &m->answer, j));
    }
    return found;
}

/* After the first solution: what slips at both ends, by less than a right angle apart; a mean in
 * which the start counts more would be no friction of the end. After a later one: takes back what
 * the mean turned further. Whether anything changed. */
static bool find_means(perp_mechanism *m, perp__theta *w, bool first)
{
    const bool may = first && m->settings.theta >= 0.5 && !jumps(m);
    bool changed = 0;

    memcpy(w->slip, m->start_velocity, (size_t)m->rows * sizeof *w->slip);
    for (int32_t j = 0; j < m->contacts + m->dry; j++) {
        const int32_t row = m->tangent[j], end = row + m->tangents[j];
        const bool differs = m->tangents[j] > 1 || (j < m->contacts && m->stribeck[j] > 0.0);
        double along = 0.0;

        if (!differs || !(may || w->mean[j]))
            continue;
        for (int32_t i = row; i < end; i++)
            along += m->start_velocity[i] * m->answer.u[i];
        if (w->mean[j] != (m->answer.modes[j] == PERP_MECHANISM_SLIP && along > 0.0)) {
            w->mean[j] = !w->mean[j];
            changed = 1;
        }
        for (int32_t i = row; i < end && w->mean[j]; i++)
            w->slip[i] += m->settings.theta * (m->answer.u[i] - w->slip[i]);
    }
    if (changed)
        perp__friction_of_speed(m, &m->begin, m->friction, w->slip, w->from.v);
    return changed;
}

/* to := to + (A - M) x. */
static void add_excess(perp_mechanism *m, perp__theta *w, double *to, const double *x)
{
    perp__multiply_mass(m, &w->terms, w->x, x);
    perp__multiply_mass(m, &m->begin, w->y, x);
    for (int32_t i = 0; i < m->n; i++)
        to[i] += w->x[i] - w->y[i];
}

/* Solves for the velocities after the iterate w->v. */
static perp_status solve(perp_mechanism *m, perp__theta *w, perp_mechanism_step *step)
{
    perp__velocity_problem problem;
    perp_status status;

    memcpy(m->momentum, w->p, (size_t)m->n * sizeof *m->momentum);
    if (w->has_matrix)
        add_excess(m, w, m->momentum, w->v);
    perp__include_reached(m, &w->terms);
    problem = perp__pose(m, &w->terms);
    status = perp__solve_frozen(m, &problem);
    step->iterations += m->answer.iterations;
    m->answer.iterations = 0;
    return status;
}

/* Size of what the momentum balance still lacks, p - p_last + (A - M)(v - v_last), in the norm
 * sqrt(x' M^-1 x); *size: of its terms, with `start`, the size of v0. */
static double defect(perp_mechanism *m, perp__theta *w, double start, double *size)
{
    double *change = w->middle, *left = m->work, *x = w->x;

    for (int32_t i = 0; i < m->n; i++) {
        change[i] = w->v[i] - w->last_v[i];
        left[i] = w->p[i] - w->last[i];
    }
    if (w->has_matrix)
        add_excess(m, w, left, change);
    perp__solve_lower(m, &m->begin, left);
    memcpy(x, w->p, (size_t)m->n * sizeof *x);
    perp__solve_lower(m, &m->begin, x);
    *size = perp__length(x, m->n) + start;
    for (int32_t i = 0; i < m->n; i++)
        x[i] = w->from.h * (fabs(w->force[i]) + fabs(m->begin.k[i]));
    perp__solve_lower(m, &m->begin, x);
    *size += perp__length(x, m->n);
    return perp__length(left, m->n);
}

/* After the first solution, a change of that size: whether the speeds of the rows are to be taken
 * again, as something presses. */
static bool follows(perp_mechanism *m, perp__theta *w, double change)
{
    const double before = w->corrected ? perp__energy_norm(m, &m->begin, w->y, w->last_v) : 0.0;
    int32_t i = 0;

    while (i < m->rows && m->answer.r[i] == 0.0)
        i++;
    return before > 0.0 && change > CHANGED * before && i < m->rows;
}

/* m->answer, w->q and w->p belong together afterwards, or the outcome says that they do not. */
static perp_status iterate(perp_mechanism *m, perp__theta *w, perp_mechanism_step *step)
{
    const double rounding = PERP__ROUNDING_LIMIT, tol = fmax(m->settings.tol, rounding);
    /* what is left adds up over a run's steps */
    const double wanted =
        m->span > 0.0 ? fmax(PERP__LITTLE * m->settings.error * w->from.h / m->span, rounding)
                      : tol;
    const double start = perp__energy_norm(m, &m->begin, w->y, w->from.v);
    perp_status status;
    double lacking = 0.0;
    int32_t pass;

    correct_drift(m, w, w->v);
    status = find_force(m, w, w->v);
    for (pass = 0; status == PERP_OK && pass < PERP__MOST_ITERATES &&
                   !(pass > 0 && perp__mechanism_is_late(m));
         pass++) {
        const double theta = m->settings.theta;

        /* p := M v0 + h (theta k+ + (1 - theta) k) */
        memcpy(w->last, w->p, (size_t)m->n * sizeof *w->last);
        perp__multiply_mass(m, &m->begin, w->p, w->from.v);
        for (int32_t i = 0; i < m->n; i++)
            w->p[i] += w->from.h * (theta * w->force[i] + (1.0 - theta) * m->begin.k[i]);
        if (pass > 0) {
            const double before = lacking;
            double change, size;
            int32_t again;

            for (int32_t i = 0; i < m->n; i++)
                w->x[i] = w->v[i] - w->last_v[i];
            change = perp__energy_norm(m, &m->begin, w->x, w->x);
            again = (pass == 1 && follows(m, w, change)) + find_means(m, w, pass == 1);
            if (again)
                correct_drift(m, w, w->v);
            lacking = defect(m, w, start, &size);
            if (lacking <= tol * size && !again &&
                (lacking <= wanted * size || (pass > 1 && 2.0 * lacking > before))) {
                perp__check_iterate(m, size > 0.0 ? lacking / size : 0.0);
                return PERP_OK;
            }
            if (!w->tried_matrix && lacking > PERP__SLOW * change)
                status = find_matrix(m, w);
        }
        PERP__THEN(status, solve(m, w, step));
        if (status != PERP_OK || !perp__outcome_moves(m->answer.outcome))
            return status;
        add_means(m, w, -1.0, m->answer.u);
        memcpy(w->last_v, w->v, (size_t)m->n * sizeof *w->v);
        memcpy(w->v, m->answer.v, (size_t)m->n * sizeof *w->v);
        status = find_force(m, w, w->v);
    }
    if (status == PERP_OK)
        m->answer.outcome = perp__worse_outcome(
            m->answer.outcome,
            pass < PERP__MOST_ITERATES ? PERP_OUTCOME_TIME_LIMIT : PERP_OUTCOME_ITERATION_LIMIT);
    return status;
}

perp_status perp__advance_theta(perp_mechanism *m, perp__motion *to, perp_mechanism_step *step,
                                const perp_mechanism_start *from)
{
    perp__theta *w = m->theta ? m->theta : perp__work_create(m, sizeof *w, layout);
    perp__velocity_problem problem;
    perp_status status;

    m->theta = w;
    if (!w)
        return PERP_ERROR_MEMORY;
    w->from = *from;
    step->scheme = PERP_MECHANISM_THETA;
    /* 1. what is fixed during the step */
    status = perp__evaluate_force(m, m->begin.k, from->t, from->q, from->v);
    PERP__THEN(status, perp__evaluate_rows(m, &m->begin, from->t, from->q, from->v));
    if (status != PERP_OK)
        return status;
    perp__prepare_contacts(m, from);
    status = evaluate_geometry(m, w);
    if (status != PERP_OK)
        return status;
    perp__friction_of_speed(m, &m->begin, m->friction, m->start_velocity, from->v);
    for (int32_t j = 0; j < m->dry; j++)
        m->dry_bound[j] = from->h * m->begin.bound[j];
    w->terms = m->begin;
    w->has_matrix = w->tried_matrix = 0;
    memset(w->mean, 0, (size_t)(m->contacts + m->dry));
    /* 2. its end */
    status = iterate(m, w, step);
    if (status != PERP_OK)
        return status;
    if (jumps(m)) /* there is no mean: those after the jump stop at the contact */
        status = perp__evaluate_move(m, to->q, from->q, from->q, from->h, m->answer.v);
    else
        memcpy(to->q, w->q, (size_t)m->coordinates * sizeof *to->q);
    if (status != PERP_OK)
        return status;
    memcpy(m->momentum, w->p, (size_t)m->n * sizeof *m->momentum); /* that of the forces: impacts */
    add_means(m, w, -1.0, m->begin.drift);
    problem = perp__pose(m, &m->begin);
    return perp__finish_step(m, to, step, from->t + from->h, &problem);
}
