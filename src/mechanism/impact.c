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
 *   Stronge  the same compression; then, by contact, an expansion that gives back e^2 of the work
 *            that it took,
 *
 * and contacts that did not touch must not be passed, u_n+ + gap'/h >= 0 with the gap' that the
 * first stage leaves. Where a stage has no solution that was found, the velocities of the stage
 * before stand, and the outcome tells.
 *
 * Energy. Without friction and with the same e everywhere no law adds any; Moreau and Newton then
 * leave (1 - e^2) of what a plastic impact takes, all of it where e = 1. With friction Moreau's and
 * Newton's laws can add energy (T. R. Kane's double pendulum), also with a single contact.
 * Poisson's with the same e everywhere was never seen to; with e that differ between contacts it
 * can. Stronge's does not. tests/mechanism/test_impact.c looks at random impacts. */
#include "mechanism/mechanism.h"

#include <math.h>
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

/* W := the mobility of contact j's rows with the constraints held; m->work: M^-1 J' of them. */
static void find_mobility(perp_mechanism *m, const perp__terms *terms, int32_t j, double W[3][3])
{
    const size_t n = (size_t)m->n;
    const int32_t first = m->starts[j], rows = m->dims[j];

    perp__hold_constraints(m, terms);
    for (int32_t i = 0; i < rows; i++) {
        double *x = m->work + (size_t)i * n;

        memcpy(x, terms->J + (size_t)(first + i) * n, n * sizeof *x);
        perp__solve_lower(m, terms, x);
        perp__project_out(m->held.basis, m->held.rank, m->n, x);
        perp__solve_upper(m, terms, x);
        for (int32_t k = 0; k < rows; k++)
            W[k][i] = perp__row_times(m, terms, first + k, 0.0, x);
    }
}

double perp__sliding_inertia(perp_mechanism *m, int32_t j, double speed)
{
    const double *u = m->start_velocity + m->tangent[j];
    double W[3][3], p;

    find_mobility(m, &m->begin, j, W);
    p = W[0][0];
    for (int32_t i = 0; i < m->tangents[j]; i++) {
        const double share = m->friction[j] * u[i] / speed;

        p -= share * W[0][1 + i];
        for (int32_t k = 0; k < m->n; k++)
            m->work[k] -= share * m->work[(1 + i) * m->n + k];
    }
    return p;
}

bool perp__is_jammed(perp_mechanism *m, const perp__motion *answer, int32_t j)
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

bool perp__is_impact(perp_mechanism *m, const perp__motion *answer, int32_t j)
{
    const int32_t row = m->starts[j];
    const double before = m->start_velocity[row];

    if (!(m->restitution[j] > 0.0) || !answer->holds[row])
        return 0;
    return perp__is_hit(m->restitution[j], before, m->free_velocity[row] - before) ||
           (m->settings.law >= PERP_MECHANISM_POISSON && perp__is_jammed(m, answer, j));
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

/* m->answer := the expansion from m->free, the momentum there, with these m->pressure. */
static perp_status expand(perp_mechanism *m, const perp__velocity_problem *compression)
{
    perp__velocity_problem problem = *compression;
    const double *compressed = m->compressed.r;
    perp_status status;

    memcpy(m->momentum, m->free, (size_t)m->n * sizeof *m->momentum);
    for (int32_t j = 0; j < m->contacts; j++)
        perp__add_row(m, problem.terms, m->starts[j], m->pressure[j], m->momentum);
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

/* The compression in m->answer, with what Poisson's law gives back of it. */
static void keep_compression(perp_mechanism *m, const perp__terms *terms)
{
    perp__copy_motion(m, &m->compressed, &m->answer);
    perp__multiply_mass(m, terms, m->free, m->answer.v);
    for (int32_t j = 0; j < m->contacts; j++)
        m->pressure[j] = m->restitution[j] * m->answer.r[m->starts[j]];
}

perp_status perp__expand(perp_mechanism *m, const perp__velocity_problem *compression)
{
    keep_compression(m, compression->terms);
    return expand(m, compression);
}

/* ---- Stronge's law -----------------------------------------------------------------------------
 *
 * A contact that nothing else which touches is coupled with goes through its impact alone
 * (stronge.c): its impulses take the place of those of the compression. The others are hit at once,
 * and both parts are straight lines: contact j expands with x_j c_j, and the x_j are those with
 *
 *   x_j c_j (u_j + u_j+)/2 = s e_j^2 L_j,   L_j = max(-c_j (u_j- + u_j)/2, 0),
 *
 * u_j- before, u_j behind the compression, u_j+ at the end; or what Poisson's law gives if it stays
 * closed. What comes back is no more than sum(e_j^2 L_j), less by one factor where the L_j are more
 * than the whole compression takes; s <= 1 is the most with which that is so. So no impact adds
 * energy. Where the x_j are not found (contacts that open and close by them) nothing comes back. */
#define POWER 0.35      /* of what a factor is off by, in a correction, at most, */
#define LEAST_POWER .01 /* and least: more of it oscillates where a contact hardly opens */
enum { MOST_PASSES = 1000 };

/* J_row x, where that is more than rounding of its terms. */
static bool moves(const perp_mechanism *m, const perp__terms *terms, int32_t row, const double *x)
{
    return fabs(perp__row_times(m, terms, row, 0.0, x)) >
           PERP__NOTHING * perp__row_terms(m, terms, row, 0.0, x);
}

/* The impact of contact j; 0 where others that touch answer to its impulses. */
static bool isolate(perp_mechanism *m, const perp__velocity_problem *problem, int32_t j,
                    perp__hit_contact *c)
{
    const double *u = m->compressed.u, *r = m->compressed.r;
    const int32_t first = m->starts[j];

    memset(c, 0, sizeof *c);
    find_mobility(m, problem->terms, j, c->W);
    for (int32_t k = 0; k < m->contacts; k++) {
        if (m->two_sided[k] > 0 && problem->friction[k] > 0.0)
            return 0;
        for (int32_t row = m->starts[k]; row < m->starts[k + 1]; row++)
            for (int32_t i = 0; i < m->dims[j] && k != j && problem->included[k]; i++)
                if (moves(m, problem->terms, row, m->work + i * m->n))
                    return 0;
    }
    for (int32_t i = 0; i < m->dims[j]; i++) {
        c->u[i] = u[first + i];
        for (int32_t k = 0; k < m->dims[j]; k++)
            c->u[i] -= c->W[i][k] * r[first + k];
    }
    if (m->dims[j] == 2)
        c->W[2][2] = c->W[1][1];
    c->mu = m->dims[j] > 1 ? problem->friction[j] : 0.0;
    c->e = m->restitution[j];
    return 1;
}

/* Corrects x_j c_j of the contacts that are hit together after the expansion in m->answer, and s
 * where they do not change any more and all of it gives too much; returns the largest change beside
 * the largest impulse. */
static double correct(perp_mechanism *m, double *share, double power)
{
    const perp__motion *end = &m->answer, *middle = &m->compressed;
    double taken = 0.0, back = 0.0, losses = 0.0, due = 0.0, change = 0.0, largest = 0.0;

    for (int32_t j = 0; j < m->contacts; j++) {
        const int32_t row = m->starts[j];
        const double given = m->pressure[j], e = m->restitution[j], c = middle->r[row];
        const double mean = 0.5 * (middle->u[row] + end->u[row]);
        const double loss = fmax(-0.5 * c * (m->start_velocity[row] + middle->u[row]), 0.0);

        if (!m->together[j])
            continue;
        for (int32_t i = row; i < m->starts[j + 1]; i++) {
            taken -= 0.5 * middle->r[i] * (m->start_velocity[i] + middle->u[i]);
            back += 0.5 * (end->r[i] - middle->r[i]) * (middle->u[i] + end->u[i]);
        }
        losses += loss;
        due += e * e * loss;
        largest = fmax(largest, c);
        if (loss == 0.0 || given == 0.0)
            m->pressure[j] = 0.0;
        else if (mean > 0.0)
            m->pressure[j] *= pow(*share * e * e * loss / (mean * given), power);
        change = fmax(change, fabs(m->pressure[j] - given) / power);
    }
    if (losses > taken) { /* some compressions gave what others took */
        *share = fmin(*share, fmax(taken, 0.0) / losses);
        due *= fmax(taken, 0.0) / losses;
    }
    if (change > PERP__SAME_DIRECTION * largest || back <= due * (1.0 + 0.1 * PERP__SAME_DIRECTION))
        return largest > 0.0 ? change / largest : 0.0;
    *share *= (1.0 - 10.0 * PERP__SAME_DIRECTION) * due / back; /* so that it is not too much */
    return 1.0;
}

/* The expansion of the contacts that are hit together, from m->answer, the compression. */
static perp_status expand_together(perp_mechanism *m, const perp__velocity_problem *problem)
{
    double share = 1.0, change = 1.0, power = POWER;
    perp_status status = PERP_OK;

    correct(m, &share, power);
    for (int32_t pass = 0; pass < MOST_PASSES && change > PERP__SAME_DIRECTION &&
                           status == PERP_OK && perp__is_good(m->answer.outcome);
         pass++) {
        const double before = change;

        status = expand(m, problem);
        change = correct(m, &share, power);
        power = change > before ? fmax(LEAST_POWER, 0.6 * power) : fmin(POWER, 1.03 * power);
    }
    if (change <= PERP__SAME_DIRECTION || status != PERP_OK || !perp__is_good(m->answer.outcome))
        return status;
    for (int32_t j = 0; j < m->contacts; j++) /* not found: nothing comes back */
        m->pressure[j] *= !m->together[j];
    return expand(m, problem);
}

perp_status perp__solve_impacts(perp_mechanism *m, const perp__velocity_problem *problem)
{
    const perp__motion *first = &m->answer;
    const bool expands = m->settings.law >= PERP_MECHANISM_POISSON;
    perp__velocity_problem stage = *problem;
    perp_status status;

    for (int32_t j = 0; j < m->contacts; j++) {
        const int32_t row = m->starts[j];
        const double e = expands ? 0.0 : m->restitution[j], before = m->start_velocity[row];

        if (m->begin.gap[j] > 0.0 && !first->holds[row])
            m->impact_shift[j] = problem->shift[j] + first->u[row]; /* gap' / h */
        else
            m->impact_shift[j] = m->settings.law == PERP_MECHANISM_MOREAU
                                     ? perp__moreau_shift(e, before)
                                     : -e * fmax(-before, 0.0);
    }
    stage.shift = m->impact_shift;
    status = solve_second(m, &stage);
    if (status != PERP_OK || !expands || !perp__is_good(m->answer.outcome))
        return status;
    if (m->settings.law == PERP_MECHANISM_POISSON)
        return perp__expand(m, &stage);
    keep_compression(m, stage.terms);
    /* the contacts that were hit alone go through their impacts; m->together: the others */
    for (int32_t j = 0; j < m->contacts; j++) {
        const int32_t row = m->starts[j];
        double *r = m->compressed.r + row;
        perp__hit_contact c;

        m->together[j] = 1;
        if (!perp__is_impact(m, &m->compressed, j) || !isolate(m, &stage, j, &c))
            continue;
        perp__stronge_impact(&c);
        for (int32_t i = 0; i < m->dims[j]; i++) {
            perp__add_row(m, stage.terms, row + i, c.r[i] - r[i], m->free);
            r[i] = c.r[i];
        }
        m->pressure[j] = c.stuck;
        m->together[j] = 0;
    }
    return expand_together(m, &stage);
}
