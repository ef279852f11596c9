/* The unknowns of the implicit scheme's problem: their numbers, bounds, where they start, and what
 * they say where they end. */
#include <math.h>
#include <string.h>

#include "mechanism/schemes/implicit.h"

#define TAU 6.28318530717958647693

void perp__implicit_direction(const perp__implicit_disc *disc, int32_t i, double d[2])
{
    const double angle = disc->edges > 0 ? TAU * i / disc->edges : 0.0;

    d[0] = disc->edges > 0 ? cos(angle) : i == 0;
    d[1] = disc->edges > 0 ? sin(angle) : i == 1;
}

static int32_t unknowns_of(int32_t tangents, int32_t edges)
{
    return tangents < 2 ? tangents : edges == 0 ? 3 : edges + 1;
}

int32_t perp__implicit_most(const perp_mechanism *m, int32_t edges)
{
    int32_t count = m->n + m->contacts + m->constraints, j; /* at the most */

    for (j = 0; j < m->contacts; j++)
        count += unknowns_of(m->tangents[j], edges);
    return count + m->dry * unknowns_of(m->model.dry_dim, edges);
}

/* s->noise, with the gap or the c behind the row. */
static void add_noise(const perp_mechanism *m, perp__implicit *s, int32_t row)
{
    const double unit = s->from.h * s->speed * sqrt(s->inverse_mass[row]);

    if (unit > 0.0)
        s->noise = fmax(s->noise, perp__gap_rounding(m, &m->begin, row, s->from.q) / unit);
}

/* The sizes of the step's speeds and impulses, from energies, so that units of q do not count. */
static void find_sizes(perp_mechanism *m, perp__implicit *s)
{
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

static void number_contact(perp_mechanism *m, perp__implicit *s, int32_t j)
{
    const int32_t row = m->starts[j];
    const double inverse = s->inverse_mass[row];
    const double impulse = inverse > 0.0 ? s->speed / sqrt(inverse) : 0.0;

    number_disc(m, s, j, m->friction[j] > 0.0 ? m->tangents[j] : 0,
                m->friction[j] * fmax(perp__load_of(m, m->answer.r, j), impulse));
}

/* Whether there is friction at all is asked at the step's start. */
void perp__implicit_number(perp_mechanism *m, perp__implicit *s)
{
    find_sizes(m, s);
    s->size = s->discs_count = 0;
    for (int32_t i = 0; i < m->n; i++)
        bound(s, s->size++, -INFINITY, INFINITY);
    for (int32_t i = 0; i < m->contacts; i++)
        if (m->included[i])
            number_contact(m, s, i);
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

double perp__implicit_share(const perp_mechanism *m, const perp__implicit_disc *disc, int32_t i,
                            const double *z)
{
    double length;

    if (m->two_sided[disc->contact] == 0)
        return 1.0;
    length = perp__length(z + disc->normal, disc->normals);
    return length > 0.0 ? z[disc->normal + i] / length : 0.0;
}

/* beta of the two vertices next to the direction of r, and the slip speed against the polygon. */
static void start_polygon(const perp__implicit_disc *disc, double *z, const double *r,
                          const double *u)
{
    const double step = TAU / disc->edges, length = hypot(r[0], r[1]);
    double angle = length > 0.0 ? atan2(r[1], r[0]) : 0.0, rest, speed = 0.0;
    int32_t low;

    if (angle < 0.0)
        angle += TAU;
    low = (int32_t)floor(angle / step);
    rest = angle - low * step;
    low = low >= disc->edges ? 0 : low;
    for (int32_t j = 0; j < disc->edges; j++) {
        double d[2];

        perp__implicit_direction(disc, j, d);
        z[disc->first + j] = 0.0;
        speed = fmax(speed, -(d[0] * u[0] + d[1] * u[1]));
    }
    z[disc->first + low] = fmax(length * sin(step - rest) / sin(step), 0.0);
    z[disc->first + (low + 1) % disc->edges] = fmax(length * sin(rest) / sin(step), 0.0);
    z[disc->first + disc->edges] = speed;
}

static void start_friction(const perp__implicit_disc *disc, double *z, double radius,
                           const double *r, const double *u, int32_t sticks)
{
    const double *from = radius > 0.0 ? r : u;
    const double speed = disc->tangents > 1 ? hypot(u[0], u[1]) : fabs(u[0]);
    const double unit = radius > 0.0 ? radius : speed > 0.0 ? -speed : 1.0;

    if (disc->edges > 0) {
        start_polygon(disc, z, r, u);
        return;
    }
    for (int32_t i = 0; i < disc->tangents; i++)
        z[disc->first + i] = from[i] / unit;
    if (disc->tangents > 1)
        z[disc->first + 2] = sticks ? 0.0 : speed;
    else if (disc->tangents == 1)
        z[disc->first] = fmin(fmax(z[disc->first], -1.0), 1.0);
}

void perp__implicit_start(perp_mechanism *m, perp__implicit *s, double *z)
{
    const perp__motion *answer = &m->answer;

    memcpy(z, answer->v, (size_t)m->n * sizeof *z);
    for (int32_t k = 0; k < s->discs_count; k++) {
        const perp__implicit_disc *disc = s->discs + k;
        const int32_t is_contact = disc->normal >= 0;
        double radius;

        for (int32_t i = 0; i < disc->normals; i++)
            z[disc->normal + i] = answer->r[m->starts[disc->contact] + i];
        radius = is_contact ? perp__implicit_radius(m, s, disc, z)
                            : m->dry_bound[disc->contact - m->contacts];
        if (disc->tangents > 0)
            start_friction(disc, z, radius, answer->r + disc->row, answer->u + disc->row,
                           answer->modes[disc->contact] == PERP_MECHANISM_STICK);
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

/* Friction of a disc; whether it sticks: what it could still bear is more than its slip, both as
 * speeds. Friction that slips is on the edge of its disc. */
static int32_t take_friction(perp_mechanism *m, const perp__implicit *s,
                             const perp__implicit_disc *disc, const double *z)
{
    const double radius = perp__implicit_radius(m, s, disc, z), *x = z + disc->first;
    const double length = disc->tangents == 1 ? fabs(x[0]) : hypot(x[0], x[1]);
    const double slip = disc->tangents == 1 ? fabs(s->u[disc->row]) : x[disc->forces];
    double room = disc->edges > 0 ? radius : (1.0 - length) * radius;
    int32_t sticks;

    for (int32_t i = 0; i < disc->edges; i++)
        room -= x[i];
    sticks =
        (disc->edges > 0 ? room > 0.0 : length < 1.0) && room * s->inverse_mass[disc->row] >= slip;
    for (int32_t i = 0; i < disc->tangents; i++) {
        m->answer.holds[disc->row + i] = (int8_t)sticks;
        m->answer.r[disc->row + i] = disc->edges > 0 || sticks || length == 0.0
                                         ? s->r[disc->row + i]
                                         : radius * (x[i] / length);
    }
    return sticks;
}

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
    if (disc->tangents > 0)
        sticks = take_friction(m, s, disc, z);
    answer->modes[disc->contact] = sticks ? PERP_MECHANISM_STICK : PERP_MECHANISM_SLIP;
}

/* Momentum, shifts and bounds of the problem at q+. c's curvature goes into its drift. */
static void prepare(perp_mechanism *m, perp__implicit *s)
{
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
}

void perp__implicit_answer(perp_mechanism *m, perp__implicit *s, const double *z, const double *w)
{
    perp__motion *answer = &m->answer;
    perp__velocity_problem problem;
    int32_t j;

    perp__clear_motion(m, answer);
    answer->outcome = s->outcome;
    answer->residual = s->residual;
    memcpy(answer->v, z, (size_t)m->n * sizeof *z);
    for (int32_t k = 0; k < s->discs_count; k++)
        take(m, s, s->discs + k, z, w);
    for (j = 0; j < m->bilateral; j++) {
        answer->r[m->contact_rows + j] = z[s->bilateral + j];
        answer->holds[m->contact_rows + j] = 1;
    }
    prepare(m, s);
    perp__pose(m, &problem);
    problem.terms = &m->end;
    perp__hold_velocities(m, answer, &problem);
    perp__judge_motion(m, answer, &problem);
    for (j = 0; j < m->constraints; j++) { /* u of c at q+ is G v + drift itself */
        const int32_t row = m->constraint_row[j];
        const double curvature = perp__implicit_curvature(m, s, row, m->end.c[j], m->begin.c[j]);

        m->end.drift[row] -= curvature;
        answer->u[row] -= curvature;
    }
}
