/* The step with everything at its end (Stewart & Trinkle 1995): a nonlinear complementarity problem
 * (implicit.h, implicit_function.c) that starts from the answer of the frozen step. Where Newton's
 * method does not get from there to a solution the step is the frozen one: no start far from it is
 * tried, as the solutions found so would be others than the motion's.
 *
 * As in the frozen step only contacts within reach are part of the problem, and restitution is a
 * second stage, here with the rows at q+. */
#include "mechanism/schemes/implicit.h"

#include <math.h>
#include <string.h>

#define TAU 6.28318530717958647693
#define COARSEST 1e-6 /* tolerance, however short the step is */
#define MOST_STEPS 50 /* of Newton, of each method: an answer is near, or there is none */

/* ---- the unknowns: their numbers, bounds, where they start ----------------------------------- */

void perp__implicit_direction(const perp__implicit_disc *disc, int32_t i, double d[2])
{
    const double angle = disc->edges > 0 ? TAU * i / disc->edges : 0.0;

    d[0] = disc->edges > 0 ? cos(angle) : i == 0;
    d[1] = disc->edges > 0 ? sin(angle) : i == 1;
}

/* s->noise, with the gap or the c behind the row. */
static void add_noise(const perp_mechanism *m, perp__implicit *s, int32_t row)
{
    const double unit = s->from.h * s->speed * sqrt(s->inverse_mass[row]);

    if (unit > 0.0)
        s->noise = fmax(s->noise, perp__gap_rounding(m, &m->begin, row, s->from.q) / unit);
}

static void bound(perp__implicit *s, int32_t i, double lower, double upper)
{
    s->lower[i] = lower;
    s->upper[i] = upper;
}

static void number_disc(perp_mechanism *m, perp__implicit *s, int32_t contact, int32_t tangents,
                        double weight)
{
    perp__implicit_disc *disc = s->discs + s->discs_count++;

    disc->contact = contact;
    disc->row = m->tangent[contact];
    disc->tangents = tangents;
    disc->edges = tangents > 1 ? m->settings.cone : 0;
    disc->forces = disc->edges > 0 ? disc->edges : tangents;
    disc->weight = weight;
    disc->normal = contact < m->contacts ? s->size : -1;
    disc->normals = contact < m->contacts ? m->tangent[contact] - m->starts[contact] : 0;
    for (int32_t i = 0; i < disc->normals; i++)
        bound(s, s->size++, m->two_sided[contact] > 0 ? -INFINITY : 0.0, INFINITY);
    disc->first = s->size;
    for (int32_t i = 0; i < disc->forces; i++)
        bound(s, s->size++,
              disc->edges > 0 ? 0.0
              : tangents == 1 ? -1.0
                              : -INFINITY,
              disc->edges > 0 || tangents > 1 ? INFINITY : 1.0);
    if (tangents > 1)
        bound(s, s->size++, 0.0, INFINITY);
}

/* Whether there is friction at all is asked at the step's start. */
static void number_unknowns(perp_mechanism *m, perp__implicit *s)
{
    /* 1. sizes of the step's speeds and impulses, from energies: units of q do not count */
    s->speed =
        fmax(perp__speed(m, &m->begin, s->from.v),
             fmax(perp__speed(m, &m->begin, m->free), perp__speed(m, &m->begin, m->answer.v)));
    if (s->speed == 0.0)
        s->speed = 1.0; /* nothing moves and nothing pulls */
    for (int32_t i = 0; i < m->n; i++)
        s->steps[i] = s->speed / sqrt(m->begin.M[(size_t)i * ((size_t)m->n + 1)]);
    for (int32_t i = 0; i < m->rows; i++)
        s->inverse_mass[i] = perp__row_mobility(m, i);
    s->noise = 0.0;
    for (int32_t i = 0; i < m->constraints; i++)
        add_noise(m, s, m->constraint_row[i]);
    for (int32_t j = 0; j < m->contacts; j++)
        if (m->included[j] && m->two_sided[j] == 0)
            add_noise(m, s, m->starts[j]);
    /* 2. velocities, contacts, bilateral rows, dry groups */
    s->size = s->discs_count = 0;
    for (int32_t i = 0; i < m->n; i++)
        bound(s, s->size++, -INFINITY, INFINITY);
    for (int32_t i = 0; i < m->contacts; i++)
        if (m->included[i]) {
            const int32_t row = m->starts[i];
            const double inverse = s->inverse_mass[row];
            const double impulse = inverse > 0.0 ? s->speed / sqrt(inverse) : 0.0;

            number_disc(m, s, i, m->friction[i] > 0.0 ? m->tangents[i] : 0,
                        m->friction[i] * fmax(perp__load_of(m, m->answer.r, i), impulse));
        }
    s->bilateral = s->size;
    for (int32_t i = 0; i < m->bilateral; i++)
        bound(s, s->size++, -INFINITY, INFINITY);
    for (int32_t i = 0; i < m->dry; i++)
        if (m->dry_bound[i] > 0.0)
            number_disc(m, s, m->contacts + i, m->model.dry_dim, m->dry_bound[i]);
}

double perp__implicit_radius(const perp_mechanism *m, const perp__implicit *s,
                             const perp__implicit_disc *disc, const double *z)
{
    if (disc->normal < 0)
        return s->from.h * m->end.bound[disc->contact - m->contacts];
    if (m->two_sided[disc->contact] > 0)
        return m->friction[disc->contact] * perp__length(z + disc->normal, disc->normals);
    return m->friction[disc->contact] * z[disc->normal];
}

/* z := what m->answer says. */
static void write_start(perp_mechanism *m, perp__implicit *s, double *z)
{
    const perp__motion *answer = &m->answer;

    memcpy(z, answer->v, (size_t)m->n * sizeof *z);
    for (int32_t k = 0; k < s->discs_count; k++) {
        const perp__implicit_disc *disc = s->discs + k;
        const double *r, *u;
        double radius, speed, unit, *x = z + disc->first;

        for (int32_t i = 0; i < disc->normals; i++)
            z[disc->normal + i] = answer->r[m->starts[disc->contact] + i];
        radius = disc->normal >= 0 ? perp__implicit_radius(m, s, disc, z)
                                   : m->dry_bound[disc->contact - m->contacts];
        r = answer->r + disc->row;
        u = answer->u + disc->row;
        speed = perp__length(u, disc->tangents);
        unit = radius > 0.0 ? radius : speed > 0.0 ? -speed : 1.0;
        for (int32_t i = 0; i < disc->tangents && disc->edges == 0; i++)
            x[i] = (radius > 0.0 ? r : u)[i] / unit;
        if (disc->edges > 0) {
            /* beta of the two vertices next to the direction of r, and the slip speed against the
             * polygon */
            const double step = TAU / disc->edges, length = hypot(r[0], r[1]);
            double angle = length > 0.0 ? atan2(r[1], r[0]) : 0.0, rest;
            int32_t low;

            if (angle < 0.0)
                angle += TAU;
            low = (int32_t)floor(angle / step);
            rest = angle - low * step;
            low = low >= disc->edges ? 0 : low;
            speed = 0.0;
            for (int32_t j = 0; j < disc->edges; j++) {
                double d[2];

                perp__implicit_direction(disc, j, d);
                x[j] = 0.0;
                speed = fmax(speed, -(d[0] * u[0] + d[1] * u[1]));
            }
            x[low] = fmax(length * sin(step - rest) / sin(step), 0.0);
            x[(low + 1) % disc->edges] = fmax(length * sin(rest) / sin(step), 0.0);
            x[disc->edges] = speed;
        } else if (disc->tangents > 1)
            x[2] = answer->modes[disc->contact] == PERP_MECHANISM_STICK ? 0.0 : speed;
        else if (disc->tangents == 1)
            x[0] = fmin(fmax(x[0], -1.0), 1.0);
    }
    for (int32_t i = 0; i < m->bilateral; i++)
        z[s->bilateral + i] = answer->r[m->contact_rows + i];
}

/* ---- the solution as an answer in velocities --------------------------------------------------
 *
 * At the solution z the problem in velocities with the rows at q+, the impulses that do not hold,
 * and shift = (gap(q+) - min(gap(q), 0)) / h - u_n of z is the linearisation of F on the index set
 * of z: it has the same solution, up to the second order in what F(z) leaves of 0. Its velocities
 * are then those that perp__hold_velocities finds in what the rows that hold leave free, and so a
 * body that sticks has the velocity 0.0, not one of rounding. */

static void take(perp_mechanism *m, const perp__implicit *s, const perp__implicit_disc *disc,
                 const double *z, const double *w)
{
    perp__motion *answer = &m->answer;
    int32_t sticks = 1;

    if (disc->normal >= 0 && m->two_sided[disc->contact] > 0) {
        for (int32_t i = 0; i < disc->normals; i++) {
            answer->r[m->starts[disc->contact] + i] = z[disc->normal + i];
            answer->holds[m->starts[disc->contact] + i] = 1;
        }
        sticks = 0; /* without friction it slides */
    } else if (disc->normal >= 0) {
        const int32_t row = m->starts[disc->contact];
        const double impulse = z[disc->normal];

        /* the one that is not 0 counts: both are speeds here */
        if (!(impulse > 0.0 && impulse * s->inverse_mass[row] >= w[disc->normal]))
            return;
        answer->r[row] = impulse;
        answer->holds[row] = 1;
        sticks = m->dims[disc->contact] == 1;
    }
    if (disc->tangents > 0) {
        const double radius = perp__implicit_radius(m, s, disc, z), *x = z + disc->first;
        const double length = perp__length(x, disc->tangents);
        const double slip = disc->tangents == 1 ? fabs(s->u[disc->row]) : x[disc->forces];
        double room = disc->edges > 0 ? radius : (1.0 - length) * radius;

        /* it sticks where nothing slips, or what friction could still bear is more than its slip,
         * both as speeds; friction that slips is on the edge of its disc */
        for (int32_t i = 0; i < disc->edges; i++)
            room -= x[i];
        sticks = slip == 0.0 || ((disc->edges > 0 ? room > 0.0 : length < 1.0) &&
                                 room * s->inverse_mass[disc->row] >= slip);
        for (int32_t i = 0; i < disc->tangents; i++) {
            m->answer.holds[disc->row + i] = (int8_t)sticks;
            m->answer.r[disc->row + i] = disc->edges > 0 || sticks || length == 0.0
                                             ? s->r[disc->row + i]
                                             : radius * (x[i] / length);
        }
    }
    answer->modes[disc->contact] = sticks ? PERP_MECHANISM_STICK : PERP_MECHANISM_SLIP;
}

/* m->answer := the solution z with F(z) = w, with the velocities held that the laws prescribe. */
static void read_answer(perp_mechanism *m, perp__implicit *s, const double *z, const double *w)
{
    perp__motion *answer = &m->answer;
    perp__velocity_problem problem;

    perp__clear_motion(m, answer);
    answer->outcome = s->outcome;
    answer->residual = s->residual;
    memcpy(answer->v, z, (size_t)m->n * sizeof *z);
    for (int32_t k = 0; k < s->discs_count; k++)
        take(m, s, s->discs + k, z, w);
    for (int32_t j = 0; j < m->bilateral; j++) {
        answer->r[m->contact_rows + j] = z[s->bilateral + j];
        answer->holds[m->contact_rows + j] = 1;
    }
    /* momentum, shifts and bounds of the problem at q+; c's curvature goes into its drift */
    for (int32_t j = 0; j < m->constraints; j++) {
        const int32_t row = m->constraint_row[j];

        m->end.drift[row] += perp__implicit_curvature(m, s, row, m->end.c[j], m->begin.c[j]);
    }
    perp__prepare_impulses(m, &m->end, &s->from);
    for (int32_t j = 0; j < m->contacts; j++)
        if (m->two_sided[j] == 0)
            m->shift[j] =
                fmax(m->begin.gap[j], 0.0) / s->from.h +
                perp__implicit_curvature(m, s, m->starts[j], m->end.gap[j], m->begin.gap[j]);
    problem = perp__pose(m, &m->end);
    perp__hold_velocities(m, answer, &problem);
    perp__judge_motion(m, answer, &problem);
    for (int32_t j = 0; j < m->constraints; j++) { /* u of c at q+ is G v + drift itself */
        const int32_t row = m->constraint_row[j];
        const double curvature = perp__implicit_curvature(m, s, row, m->end.c[j], m->begin.c[j]);

        m->end.drift[row] -= curvature;
        answer->u[row] -= curvature;
    }
}

/* ---- memory -------------------------------------------------------------------------------- */

static void layout(perp__arena *arena, void *object)
{
    perp__implicit *s = object;
    const perp_mechanism *m = s->m;

    s->discs = perp__arena_take(arena, (size_t)(m->contacts + m->dry), sizeof *s->discs);
    PERP__DOUBLES(arena, (size_t)s->most, &s->z, &s->w, &s->start, &s->lower, &s->upper,
                  &s->changed, &s->shifted, &s->at, &s->F);
    PERP__DOUBLES(arena, (size_t)m->rows, &s->r, &s->u, &s->inverse_mass, &s->bent_r);
    s->q = perp__arena_take(arena, (size_t)m->coordinates, sizeof(double));
    PERP__DOUBLES(arena, (size_t)m->n, &s->steps, &s->bent_at);
    s->bent = perp__arena_take(arena, (size_t)m->n * (size_t)s->most, sizeof(double));
}

/* Unknowns of friction in a disc, or a polygon of so many edges. */
static int32_t unknowns_of(int32_t tangents, int32_t edges)
{
    return tangents < 2 ? tangents : edges == 0 ? 3 : edges + 1;
}

/* m->implicit with room for the largest problem of these settings, and its solver. */
static perp_status open(perp_mechanism *m)
{
    const int32_t edges = m->settings.cone;
    int32_t most = m->n + m->contacts + m->constraints + /* at the most */
                   m->dry * unknowns_of(m->model.dry_dim, edges);
    perp__implicit *s = m->implicit ? m->implicit : perp__work_create(m, sizeof *s, NULL);
    perp_status status;

    m->implicit = s;
    if (!s)
        return PERP_ERROR_MEMORY;
    for (int32_t j = 0; j < m->contacts; j++)
        most += unknowns_of(m->tangents[j], edges);
    if (s->most >= most) /* 0 until all is there */
        return PERP_OK;
    s->most = most;
    status = perp__arena_fit(&s->arena, m->context, layout, s);
    perp_ncp_settings_init(&s->settings, sizeof s->settings);
    s->settings.restarts = 0;
    s->settings.max_iterations = 2 * MOST_STEPS;
    if (!s->solver)
        PERP__ASK(status, m->context, perp_ncp_solver_create(m->context, &s->solver, &s->settings));
    s->most = status == PERP_OK ? most : 0;
    return status;
}

/* ---- the step ------------------------------------------------------------------------------ */

/* Where velocities pass through 0, rows consist of the rounding of gaps and forces alone, which no
 * linear terms show: the second witness is asked again for what these are good to. */
static perp_status ask_again(const perp_mechanism *m, perp__implicit *s, perp_ncp_result *result)
{
    const int64_t iterations = result->iterations;
    perp_status status = PERP_OK;

    if (perp__is_good(result->outcome) || !(result->residual <= m->settings.tol) ||
        s->settings.tol >= COARSEST)
        return PERP_OK;
    s->settings.tol = COARSEST;
    memcpy(s->start, s->z, (size_t)s->size * sizeof *s->z);
    PERP__ASK(status, m->context, perp_ncp_solver_set(s->solver, &s->settings));
    PERP__ASK(status, m->context, perp_ncp_solver_solve(s->solver, s->z, s->w, result, s->start));
    result->iterations += iterations;
    return status;
}

/* s->z, s->w := the problem's solution, from the frozen answer; found: whether there is one. */
static perp_status solve(perp_mechanism *m, perp__implicit *s, perp_mechanism_step *step,
                         int32_t *found)
{
    perp_ncp_result result;
    perp_ncp_problem problem;
    perp_status status = perp_ncp_result_init(&result, sizeof result);

    /* 1. the problem */
    *found = 0;
    s->is_at = s->is_bent = 0;
    s->failed = PERP_OK;
    number_unknowns(m, s);
    write_start(m, s, s->start);
    s->settings.tol = fmin(fmax(m->settings.tol, s->noise), fmax(m->settings.tol, COARSEST));
    s->settings.time_limit = perp__mechanism_time_left(m);
    perp_ncp_problem_init(&problem, sizeof problem);
    problem.n = s->size;
    problem.storage = PERP_STORAGE_COLUMN_MAJOR;
    problem.function = perp__implicit_function;
    problem.jacobian = perp__implicit_jacobian;
    problem.lower = s->lower;
    problem.upper = s->upper;
    problem.user = m;
    /* 2. its solution */
    PERP__ASK(status, m->context, perp_ncp_solver_set(s->solver, &s->settings));
    PERP__ASK(status, m->context, perp_ncp_solver_setup(s->solver, &problem));
    PERP__ASK(status, m->context, perp_ncp_solver_solve(s->solver, s->z, s->w, &result, s->start));
    PERP__THEN(status, ask_again(m, s, &result));
    if (s->failed != PERP_OK) { /* what the callback said, not what came of it */
        memcpy(m->context->message, s->message, sizeof s->message);
        return s->failed;
    }
    if (status != PERP_OK)
        return perp__mechanism_fail_in(m, status, "the implicit step");
    step->iterations += result.iterations;
    if (perp__is_good(result.outcome)) {
        /* 3. what it is worth: the solver was asked for no more than rounding of q leaves of gap /
         * h, or says itself that rounding is what is left: a backward error of as little */
        const perp__evidence evidence = {result.residual, result.residual, 0.0, 1};

        s->residual = result.residual;
        s->outcome = perp__worse_outcome(result.outcome,
                                         perp__gate(&evidence, m->settings.tol, result.outcome));
        status = perp__implicit_evaluate(m, s, s->z);
        *found = status == PERP_OK;
    }
    return status == PERP__OUTSIDE ? PERP_OK : status;
}

perp_status perp__advance_implicit(perp_mechanism *m, perp__motion *to, perp_mechanism_step *step,
                                   const perp__start *from)
{
    perp__motion *answer = &m->answer;
    perp__velocity_problem problem;
    perp_status status = open(m);
    int32_t found = 0;
    int8_t more;

    /* 1. the frozen step */
    if (status == PERP_OK)
        m->implicit->from = *from;
    PERP__THEN(status, perp__evaluate_all(m, &m->begin, from->t, from->q, from->v));
    if (status != PERP_OK)
        return status;
    perp__prepare_step(m, from);
    problem = perp__pose(m, &m->begin);
    status = perp__solve_frozen(m, &problem);
    if (!perp__is_good(answer->outcome)) { /* its last iterate may be anything: free motion */
        memcpy(answer->v, m->free, (size_t)m->n * sizeof *answer->v);
        memcpy(answer->u, m->free_velocity, (size_t)m->rows * sizeof *answer->u);
        memset(answer->r, 0, (size_t)m->rows * sizeof *answer->r);
        memset(answer->modes, 0, (size_t)(m->contacts + m->dry) * sizeof *answer->modes);
    }
    /* 2. from there the implicit one, with the contacts that it passes */
    if (status == PERP_OK && perp__outcome_moves(answer->outcome))
        do {
            more = 0;
            status = solve(m, m->implicit, step, &found);
            for (int32_t j = 0; j < m->contacts && status == PERP_OK && found; j++)
                if (!m->included[j] && !m->apart[j] && m->end.gap[j] < fmin(m->begin.gap[j], 0.0))
                    m->included[j] = more = 1;
        } while (more);
    if (status == PERP_OK && !found) {
        step->iterations += answer->iterations; /* which the frozen step counts anew */
        return perp__advance_frozen(m, to, step, from);
    }
    /* 3. its end */
    if (status == PERP_OK)
        read_answer(m, m->implicit, m->implicit->z, m->implicit->w);
    PERP__THEN(status, perp__evaluate_move(m, to->q, from->q, from->h, answer->v));
    if (status != PERP_OK)
        return status;
    step->scheme = PERP_MECHANISM_IMPLICIT;
    problem = perp__pose(m, &m->end);
    return perp__finish_step(m, to, step, from->t + from->h, &problem);
}
