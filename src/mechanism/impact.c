/* Restitution: the second stage of a step in which something was hit.
 *
 * The first stage, without restitution, moves the positions. A contact with e > 0 that it presses
 * was hit if it approached faster than the step's forces make it, u_n- < -h |a_n|: slower approach
 * is resting contact, which would else bounce at speeds of order g h for ever. Under Poisson's law
 * an impulse without approach is an impact too where sliding cannot go on. The second stage
 * starts from the same momentum:
 *
 *   Moreau   0 <= r_n perp u_n+ + e u_n- >= 0        where the contact touches,
 *   Newton   0 <= r_n perp u_n+ - e max(-u_n-, 0) >= 0,
 *   Poisson  compression: 0 <= c perp u_n >= 0; then expansion from its velocities with e c given:
 *            0 <= x perp u_n+ >= 0, |r_t| <= mu (e c + x)   (Anitescu & Potra 1997),
 *
 * and contacts that did not touch must not be passed, u_n+ + gap'/h >= 0 with the gap' that the
 * first stage leaves. Where a stage has no solution that was found, the velocities of the stage
 * before stand, and the outcome tells.
 *
 * Energy. Without friction and with the same e everywhere no law adds any; Moreau and Newton then
 * leave (1 - e^2) of what a plastic impact takes, all of it where e = 1. With friction Moreau's and
 * Newton's laws can add energy (T. R. Kane's double pendulum), also with a single contact.
 * Poisson's with the same e everywhere was never seen to; with e that differ between contacts it
 * can. tests/mechanism/test_impact.c looks at random impacts. */
#include "mechanism/mechanism.h"

#include <string.h>

#include "step/impact.h"

/* ---- impacts without collision (Painleve; Genot & Brogliato 1999) -----------------------------
 *
 * A contact slides with u_t != 0 and u_n = 0. If the force of a contact that goes on sliding pulls
 * the bodies together instead of pushing them apart,
 *
 *   p = n' P (n - mu d) <= 0,     d = direction of u_t,     P = M^-1 restricted to G v = 0,
 *
 * no force keeps it from penetrating: an impulse of the order of the momentum ends the sliding, at
 * any h. With p > 0 the impulse is the integral of a force, of order h, and no impact. The test is
 * of one contact at a time: contacts that only together cannot go on sliding are not recognised. */

double perp__sliding_inertia(perp_mechanism *m, int32_t j, double speed)
{
    const size_t n = (size_t)m->n;
    double *force = m->work, *pressed = force + n, p = 0.0;

    perp__hold_constraints(m);
    memcpy(pressed, m->begin.J + (size_t)m->starts[j] * n, n * sizeof *pressed);
    memcpy(force, pressed, n * sizeof *force);
    for (int32_t i = m->starts[j] + 1; i < m->starts[j + 1]; i++)
        perp__add_row(m, &m->begin, i, -m->friction[j] * m->start_velocity[i] / speed, force);
    perp__solve_lower(m, &m->begin, pressed);
    perp__solve_lower(m, &m->begin, force);
    perp__project_out(m->held.basis, m->held.rank, m->n, force);
    for (size_t k = 0; k < n; k++)
        p += pressed[k] * force[k];
    return p;
}

int32_t perp__is_jammed(perp_mechanism *m, const perp__motion *answer, int32_t j)
{
    const double *u = m->start_velocity + m->tangent[j];
    const double speed = perp__length(u, m->tangents[j]);
    double along = 0.0;

    if (!(speed > 0.0) || m->friction[j] == 0.0)
        return 0;
    for (int32_t i = 0; i < m->tangents[j]; i++)
        along += u[i] * answer->u[m->tangent[j] + i];
    return along <= 0.0 && perp__sliding_inertia(m, j, speed) <= 0.0;
}

/* ---- restitution --------------------------------------------------------------------------- */

int32_t perp__count_impacts(perp_mechanism *m, const perp__motion *answer)
{
    int32_t count = 0;

    for (int32_t j = 0; j < m->contacts; j++) {
        const int32_t row = m->starts[j];
        const double before = m->start_velocity[row];

        if (!(m->restitution[j] > 0.0) || !answer->holds[row])
            continue;
        count += perp__is_hit(m->restitution[j], before, m->free_velocity[row] - before) ||
                 (m->settings.law == PERP_MECHANISM_POISSON && perp__is_jammed(m, answer, j));
    }
    return count;
}

/* second := solution of a problem of the second stage; taken over where it is one. */
static perp_status solve_second(perp_mechanism *m, const perp__velocity_problem *problem)
{
    perp_status status;

    m->second.iterations = 0;
    status = perp__solve_velocities(m, &m->second, problem);
    if (status != PERP_OK)
        return status;
    m->answer.iterations += m->second.iterations;
    perp__raise_to(&m->answer.residual, m->second.residual);
    m->answer.method = m->second.method;
    m->answer.outcome = perp__worse_outcome(m->answer.outcome, m->second.outcome);
    m->answer.certificate = m->second.certificate;
    m->answer.has_ray = m->second.has_ray;
    memcpy(m->answer.ray, m->second.ray, (size_t)m->rows * sizeof *m->answer.ray);
    if (perp__is_good(m->second.outcome))
        perp__copy_motion(m, &m->answer, &m->second);
    return PERP_OK;
}

perp_status perp__expand(perp_mechanism *m, const perp__velocity_problem *compression)
{
    perp__velocity_problem problem = *compression;
    double *compressed = m->free_velocity; /* no longer needed: impulses of the compression */
    perp_status status;

    memcpy(compressed, m->answer.r, (size_t)m->rows * sizeof *compressed);
    perp__multiply_mass(m, problem.terms, m->momentum, m->answer.v);
    for (int32_t j = 0; j < m->contacts; j++) {
        m->pressure[j] = m->restitution[j] * m->answer.r[m->starts[j]];
        perp__add_row(m, problem.terms, m->starts[j], m->pressure[j], m->momentum);
    }
    memset(m->dry_bound, 0, (size_t)m->dry * sizeof *m->dry_bound); /* used in the compression */
    problem.pressure = m->pressure;
    status = solve_second(m, &problem);
    if (status != PERP_OK || !perp__is_good(m->answer.outcome))
        return status;
    for (int32_t j = 0; j < m->rows; j++)
        m->answer.r[j] += compressed[j];
    for (int32_t j = 0; j < m->contacts; j++) {
        const int32_t row = m->starts[j];

        m->answer.r[row] += m->pressure[j];
        if (m->answer.modes[j] == PERP_CONTACT_SEPARATE && m->answer.r[row] > 0.0)
            m->answer.modes[j] = m->dims[j] == 1 || m->answer.holds[row + 1] ? PERP_CONTACT_STICK
                                                                             : PERP_CONTACT_SLIP;
    }
    return PERP_OK;
}

perp_status perp__solve_impacts(perp_mechanism *m, const perp__velocity_problem *problem)
{
    const perp__motion *first = &m->answer;
    const int32_t poisson = m->settings.law == PERP_MECHANISM_POISSON;
    perp__velocity_problem stage = *problem;
    perp_status status;

    for (int32_t j = 0; j < m->contacts; j++) {
        const int32_t row = m->starts[j];
        const double e = poisson ? 0.0 : m->restitution[j], before = m->start_velocity[row];

        if (m->begin.gap[j] > 0.0 && !first->holds[row])
            m->impact_shift[j] = problem->shift[j] + first->u[row]; /* gap' / h */
        else
            m->impact_shift[j] = m->settings.law == PERP_MECHANISM_MOREAU
                                     ? perp__moreau_shift(e, before)
                                     : perp__newton_shift(e, before);
    }
    stage.shift = m->impact_shift;
    status = solve_second(m, &stage);
    if (status == PERP_OK && poisson && perp__is_good(m->answer.outcome))
        status = perp__expand(m, &stage);
    return status;
}
