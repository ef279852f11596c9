/* The solution of the implicit problem as an answer in velocities.
 *
 * At the solution z the problem in velocities with the rows at q+, the impulses that do not hold,
 * and shift = (gap(q+) - min(gap(q), 0)) / h - u_n of z is the linearisation of F on the index set
 * of z: it has the same solution, up to the second order in what F(z) leaves of 0. Its velocities
 * are then those that perp__hold_velocities finds in what the rows that hold leave free, and so a
 * body that sticks has the velocity 0.0, not one of rounding. */
#include <math.h>
#include <string.h>

#include "mechanism/schemes/implicit.h"

/* Friction of a disc; whether it sticks: what it could still bear is more than its slip, both as
 * speeds. Friction that slips is on the edge of its disc. */
static int32_t take_friction(perp_mechanism *m, const perp__implicit *s,
                             const perp__implicit_disc *disc, const double *z)
{
    const double radius = perp__implicit_radius(m, s, disc, z), *x = z + disc->first;
    const double length = disc->tangents == 1 ? fabs(x[0]) : hypot(x[0], x[1]);
    const double slip = disc->tangents == 1 ? fabs(s->u[disc->row]) : x[disc->forces];
    double room = disc->edges > 0 ? radius : (1.0 - length) * radius;
    int32_t i, sticks;

    for (i = 0; i < disc->edges; i++)
        room -= x[i];
    sticks =
        (disc->edges > 0 ? room > 0.0 : length < 1.0) && room * s->inverse_mass[disc->row] >= slip;
    for (i = 0; i < disc->tangents; i++) {
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

    if (disc->normal >= 0) {
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
    const size_t n = (size_t)m->n;
    int32_t j;
    size_t i;

    for (j = 0; j < m->bilateral; j++) {
        const int32_t row = m->contact_rows + j;

        m->end.drift[row] += perp__implicit_curvature(m, s, row, m->end.c[j], m->begin.c[j]);
    }
    perp__multiply_mass(m, &m->end, m->momentum, s->v0);
    for (i = 0; i < n; i++)
        m->momentum[i] += s->h * m->end.k[i];
    for (j = 0; j < m->contacts; j++)
        m->shift[j] = fmax(m->begin.gap[j], 0.0) / s->h +
                      perp__implicit_curvature(m, s, m->starts[j], m->end.gap[j], m->begin.gap[j]);
    for (j = 0; j < m->dry; j++)
        m->dry_bound[j] = s->h * m->end.bound[j];
}

void perp__implicit_answer(perp_mechanism *m, perp__implicit *s, const double *z, const double *w)
{
    perp__motion *answer = &m->answer;
    perp__velocity_problem problem;
    int32_t j, k;

    perp__clear_motion(m, answer);
    answer->outcome = s->outcome;
    answer->residual = s->residual;
    memcpy(answer->v, z, (size_t)m->n * sizeof *z);
    for (k = 0; k < s->discs_count; k++)
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
    for (j = 0; j < m->bilateral; j++) { /* u of c at q+ is G v + drift itself */
        const int32_t row = m->contact_rows + j;
        const double curvature = perp__implicit_curvature(m, s, row, m->end.c[j], m->begin.c[j]);

        m->end.drift[row] -= curvature;
        answer->u[row] -= curvature;
    }
}
