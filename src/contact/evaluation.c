/* What impulses are worth, from the caller's data; and the best point so far: what every method,
 * start and polish has to offer goes through here. */
#include <float.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "base/context.h"
#include "base/outcome.h"
#include "contact/law.h"
#include "contact/solver.h"
#include "linalg/spatial.h"

/* load := |q|, or where that is more, 16 eps / tol of the terms that it is made of: they have
 * roundings, and of rows that depend on each other no impulses remove those. omega is no less. */
static void grant_rounding(perp_contact_solver *solver)
{
    const double share = fmin(1.0, PERP__ROUNDING_LIMIT / solver->settings.tol);
    bool raised = 0;

    for (int32_t k = 0; k < solver->constraints; k++) {
        double *drive = &solver->drive[solver->part[k]], most = 0.0;

        for (int32_t i = solver->starts[k]; i < solver->starts[k + 1]; i++) {
            const double size = fabs(solver->q[i]), least = share * solver->load[i];
            const bool is_granted = least > size && least < INFINITY;

            solver->load[i] = is_granted ? least : size;
            most = is_granted && least > most ? least : most;
        }
        if (most > solver->root[k] * *drive && *drive > 0.0 && most / solver->root[k] < INFINITY) {
            perp__raise_to(drive, most / solver->root[k]);
            raised = 1;
        }
    }
    for (int32_t k = 0; raised && k < solver->constraints; k++)
        if (solver->drive[solver->part[k]] > 0.0)
            solver->omega[k] = solver->drive[solver->part[k]];
}

perp_status perp__contact_load(perp_contact_solver *solver)
{
    const perp__contact_call *call = solver->call;
    perp_status status = PERP_OK;

    if (solver->entrance == PERP__ENTRANCE_DELASSUS) {
        for (int32_t i = 0; i < solver->size; i++) {
            solver->q[i] = call->q[i];
            solver->load[i] = 0.0; /* the caller's word: nothing is granted */
        }
    } else if (solver->entrance == PERP__ENTRANCE_RIGID) {
        perp__rigid_load(solver);
    } else {
        status =
            perp__dynamics_velocities(&solver->dynamics, call->f, NULL, solver->v, solver->v_low);
        if (status == PERP_OK)
            perp__dynamics_relative(&solver->dynamics, solver->v, solver->v_low, call->w, call->b,
                                    solver->q);
        perp__dynamics_sizes(&solver->dynamics, solver->v, call->w, call->b, solver->load);
        solver->free_speed = perp__largest(solver->v, solver->n);
        if (solver->has_bodies)
            perp__bodies_force(&solver->bodies, call->f);
    }
    solver->is_free = 1;
    if (status != PERP_OK)
        return status;
    /* far bounds are counted from the impulses nearest to 0: a shift to them drives nothing */
    solver->problem.q = solver->is_far ? solver->bounded.load : solver->q;
    perp__contact_omegas(&solver->problem, solver->part, solver->parts, solver->drive,
                         solver->omega);
    solver->problem.q = solver->q;
    grant_rounding(solver);
    solver->is_idle = 0;
    for (int32_t p = 0; p < solver->parts; p++)
        solver->is_idle |= solver->drive[p] == 0.0;

    /* finite data may make numbers that no double holds */
    for (int32_t i = 0; i < solver->size; i++)
        if (!isfinite(solver->q[i]))
            return perp__fail(solver->context, PERP_ERROR_NOT_FINITE,
                              "row %d of q = H M^-1 f + w is %g", (int)i, solver->q[i]);
    for (int32_t k = 0; k < solver->constraints; k++)
        if (!(solver->omega[k] < INFINITY))
            return perp__fail(solver->context, PERP_ERROR_NOT_FINITE,
                              "%s %d: omega, the largest |q| / sqrt(t) of its part, is %g",
                              k < solver->contacts ? "contact" : "bilateral row",
                              (int)(k < solver->contacts ? k : k - solver->contacts),
                              solver->omega[k]);
    return PERP_OK;
}

/* u = W r + q, or with dynamics H v + w, v = M^-1 (f + H'r + G's). */
static perp_status compute_velocities(perp_contact_solver *solver)
{
    const perp__contact_call *call = solver->call;
    perp_status status;

    if (solver->is_free && perp__is_zero(solver->r, solver->size)) {
        perp__copy(solver->u, solver->q, solver->size);
        return PERP_OK;
    }
    solver->is_free = 0;
    if (solver->entrance == PERP__ENTRANCE_DELASSUS) {
        perp__multiply_doubled(&solver->W, solver->r, solver->q, solver->high, solver->low);
        perp__copy(solver->u, solver->high, solver->size);
        return PERP_OK;
    }
    if (solver->entrance == PERP__ENTRANCE_RIGID) {
        perp__rigid_velocities(solver);
        return PERP_OK;
    }
    status =
        perp__dynamics_velocities(&solver->dynamics, call->f, solver->r, solver->v, solver->v_low);
    if (status != PERP_OK)
        return status;
    perp__dynamics_relative(&solver->dynamics, solver->v, solver->v_low, call->w, call->b,
                            solver->u);
    for (int32_t i = 0; solver->complies && i < solver->size; i++)
        solver->u[i] += solver->compliance[i] * solver->r[i];
    return PERP_OK;
}

/* ---- residuals ----
 *
 * What a point is worth, part by part: the tested residual, beside the largest free velocity of the
 * part, and the own residual, beside the terms of each contact itself. Each alone is fooled: the
 * one by a light contact that hides behind a heavy one, the other by contacts where all is noise.
 *
 * The own residual of contact k is what u_k lacks of its law, as a velocity, over
 *
 *   S_k + sum_j |W_kj| S_j / t_j + floor min(max S_j, sqrt(t_k) max S_j / sqrt(t_j)),
 *
 * S_k = |W_k| |r| + |q_k| (|q_i| as load: solver.h). The second term is what the impulses that its
 * neighbours have to do with would change here; in the third, over what is near (parts.c), the
 * former maximum is right where light bodies lie on heavy ones, the latter where rows have
 * different units. In both, S_j is what impulses can answer to: nothing of a contact that opens, of
 * tangents no more than friction can. |W_kj| is at most sqrt(t_k t_j) where W is semidefinite: a
 * contact with more, of another or of itself, in a W that no mechanics has, excuses nobody. */
/* Of its terms: a contact that closes faster than this has none that cancel, and what others around
 * it carry is no excuse. One that opens faster keeps its impulse of 0, and excuses nobody. */
#define CLOSING 0.0625

/* Couplings are those of a semidefinite W but for this. */
#define NOISE sqrt(DBL_EPSILON)

/* change / scale, both >= 0; a scale that overflowed excuses nothing. */
static double relative_change(double change, double scale)
{
    return change == 0.0 ? 0.0 : scale > 0.0 && scale < INFINITY ? change / scale : INFINITY;
}

/* out := |W| |x| + |add| */
static void absolute(perp_contact_solver *solver, const double *x, const double *add, double *out)
{
    if (solver->has_bodies)
        perp__absolute_bodies(&solver->bodies, x, add, solver->bodies.y, out);
    else
        perp__absolute_product(&solver->W, x, add, out);
}

static void gather_parts(const perp_contact_solver *solver, perp__contact_residuals *residuals)
{
    residuals->tested = residuals->own_residual = residuals->backward = 0.0;
    for (int32_t p = 0; p < solver->parts; p++) {
        perp__raise_to(&residuals->tested, solver->evidence[p].tested);
        perp__raise_to(&residuals->own_residual, solver->evidence[p].own_residual);
        perp__raise_to(&residuals->backward, solver->evidence[p].backward);
    }
}

/* The numbers of (r, u), and the modes by the side on which each contact lies. */
static void measure(perp_contact_solver *solver, perp__contact_residuals *residuals)
{
    const perp__contact_problem *problem = &solver->problem;
    const perp__contact_bounded *bounded = &solver->bounded;
    const double *r = solver->r, *load = solver->load;

    memset(residuals, 0, sizeof *residuals);
    if (solver->parts > 0)
        memset(solver->evidence, 0, (size_t)solver->parts * sizeof *solver->evidence);
    /* 1. S of each row. Beside bounds that are far off, W shift would excuse what all rows lack:
     * then S is that of what impulses nearest to 0 leave open, and of those from there on. */
    for (int32_t i = 0; i < solver->size && solver->is_far; i++)
        solver->high[i] = solver->r[i] + bounded->away[i];
    if (solver->is_far) {
        r = solver->high;
        load = bounded->load;
    }
    absolute(solver, r, load, solver->scale);
    for (int32_t k = 0; k < solver->constraints; k++)
        solver->terms[k] = perp__contact_length(solver->scale, perp__contact_first_row(problem, k),
                                                problem->starts[k + 1]);
    /* 2. What each constraint lacks of its law. */
    for (int32_t k = 0; k < solver->constraints; k++) {
        perp__evidence *part = &solver->evidence[solver->part[k]];
        const double t = problem->trace[k];
        perp__contact_law law = {0};

        if (k < solver->contacts) {
            perp__contact_outcome_of(problem, k, solver->r, solver->u, &law);
            solver->modes[k] = (int8_t)law.mode;
            solver->lack[k] = t * law.natural;
            perp__raise_to(&part->tested, solver->root[k] * law.natural / solver->omega[k]);
            perp__raise_to(&residuals->bilateral, t * law.bilateral);
        } else { /* u = 0 */
            law.change = fabs(solver->u[perp__contact_first_row(problem, k)]);
            law.natural = law.change / t;
            solver->lack[k] = law.change;
            perp__raise_to(&part->tested, law.change / solver->root[k] / solver->omega[k]);
            perp__raise_to(&residuals->bilateral, law.change);
        }
        perp__raise_to(&part->backward, relative_change(law.change, solver->terms[k]));
        perp__raise_to(&residuals->natural, law.natural);
        perp__raise_to(&residuals->signorini_impulse, law.signorini);
        perp__raise_to(&residuals->signorini_velocity, t * law.signorini);
        perp__raise_to(&residuals->cone, law.cone);
        perp__raise_to(&residuals->dissipation_impulse, law.dissipation);
        perp__raise_to(&residuals->dissipation_velocity, t * law.dissipation);
    }
    gather_parts(solver, residuals);
}

/* own := the largest lack[k] / terms[k] of each part. */
static void compare(perp_contact_solver *solver, const double *terms)
{
    for (int32_t p = 0; p < solver->parts; p++)
        solver->evidence[p].own_residual = 0.0;
    for (int32_t k = 0; k < solver->constraints; k++)
        perp__raise_to(&solver->evidence[solver->part[k]].own_residual,
                       relative_change(solver->lack[k], terms[k]));
}

/* Terms of contact k that impulses have to do with, and in push[...], zeros before, what these may
 * be: friction cannot answer to more than tol of what all of it, turned round, would change, and to
 * what its normal has to do with. */
static double answerable(const perp_contact_solver *solver, int32_t k, double *push)
{
    const perp__contact_problem *p = &solver->problem;
    const int32_t row = perp__contact_first_row(&solver->problem, k);
    const int32_t first = solver->starts[k] + perp__contact_normals(p, k);
    const double t = solver->trace[k], normal = perp__contact_length(solver->scale, row, first);
    const double most =
        2.0 * t * perp__contact_pressure(p, k, solver->r) / solver->settings.tol + normal;
    perp__contact_part parts[3];
    const int32_t count = perp__contact_parts(p, k, parts);
    double terms = normal;

    if (solver->modes[k] == PERP_CONTACT_SEPARATE && row < first &&
        solver->u[row] > CLOSING * normal)
        return 0.0;
    for (int32_t i = 0; i < count; i++)
        terms = perp__length2(terms, fmin(parts[i].coefficient * most,
                                          perp__contact_length(solver->scale, parts[i].row,
                                                               parts[i].row + parts[i].size)));
    for (int32_t i = row; i < first; i++)
        push[i] = (first - row > 1 ? terms : solver->scale[i]) / t; /* one answers to u_n alone */
    for (int32_t i = 0; i < count; i++)
        for (int32_t j = 0; j < parts[i].size; j++)
            push[parts[i].row + j] = fmin(parts[i].coefficient * most, terms) / t;
    return terms;
}

/* wide := the whole denominator. */
static void widen(perp_contact_solver *solver, double *wide)
{
    const double share = perp__floor_of(solver->settings.tol);
    double *push = solver->high, *moves = solver->low;
    perp__cursor c = perp__first(&solver->W);

    perp__contact_find_near(solver);
    for (int32_t k = 0; k < solver->constraints; k++)
        solver->most_speed[k] = solver->most_energy[k] = wide[k] = 0.0;
    memset(push, 0, (size_t)solver->size * sizeof *push);
    /* wide[k] := whether contact k has such a coupling, in a W that no mechanics has */
    while (!solver->has_bodies && perp__advance(&c)) {
        const int32_t a = solver->constraint_of[c.i], b = solver->constraint_of[c.j];

        if (fabs(c.value) > (1.0 + NOISE) * solver->root[a] * solver->root[b])
            wide[a] = wide[b] = 1.0;
    }
    for (int32_t k = 0; k < solver->constraints; k++) {
        const double terms = wide[k] > 0.0          ? 0.0
                             : k < solver->contacts ? answerable(solver, k, push)
                                                    : solver->terms[k];

        if (k >= solver->contacts)
            push[perp__contact_first_row(&solver->problem, k)] = terms / solver->trace[k];
        perp__raise_to(&solver->most_speed[solver->near[k]], terms);
        perp__raise_to(&solver->most_energy[solver->near[k]], terms / solver->root[k]);
    }
    absolute(solver, push, solver->scale, moves);
    for (int32_t k = 0; k < solver->constraints; k++) {
        /* one that is said to separate and closes; a normal that is a bound has no velocity that
         * could */
        const int32_t row = k < solver->contacts ? solver->starts[k] : -1;
        const bool closes = row >= 0 && solver->modes[k] == PERP_CONTACT_SEPARATE &&
                            perp__contact_first_row(&solver->problem, k) == row &&
                            0.0 - solver->u[row] > CLOSING * solver->terms[k];

        wide[k] = perp__contact_length(moves, perp__contact_first_row(&solver->problem, k),
                                       solver->starts[k + 1]) +
                  share * fmin(solver->most_speed[solver->near[k]],
                               solver->root[k] * solver->most_energy[solver->near[k]]);
        /* then the contact's own terms are all that is known */
        if (!(wide[k] < INFINITY) || closes)
            wide[k] = solver->terms[k];
    }
}

void perp__contact_weigh(perp_contact_solver *solver, perp__contact_residuals *residuals)
{
    const double tol = solver->settings.tol;
    bool is_open = 0;

    /* 1. What is said of a contact must hold beside its own terms: one that presses does not move
     * along its normal, one that sticks not at all. */
    for (int32_t k = 0; k < solver->contacts; k++) {
        const int32_t row = solver->starts[k], sticks = solver->modes[k] == PERP_CONTACT_STICK;
        const int32_t end =
            sticks ? solver->starts[k + 1] : row + perp__contact_normals(&solver->problem, k);

        if (solver->modes[k] != PERP_CONTACT_SEPARATE)
            perp__raise_to(&solver->lack[k], perp__contact_length(solver->u, row, end));
    }
    /* 2. The own residuals, beside the terms of the contacts alone, or beside all where those leave
     * something open that may still be an answer. */
    compare(solver, solver->terms);
    for (int32_t p = 0; p < solver->parts; p++)
        is_open |=
            !(solver->evidence[p].own_residual <= tol) && solver->evidence[p].tested <= sqrt(tol);
    if (is_open) {
        widen(solver, solver->wide);
        compare(solver, solver->wide);
    }
    gather_parts(solver, residuals);
    residuals->sound =
        perp__all_finite(&residuals->tested,
                         offsetof(perp__contact_residuals, sound) / sizeof(double)) &&
        perp__all_finite(solver->r, (size_t)solver->size) &&
        perp__all_finite(solver->u, (size_t)solver->size) &&
        perp__all_finite(solver->v, (size_t)solver->n);
    for (int32_t p = 0; p < solver->parts; p++)
        solver->evidence[p].sound = residuals->sound;
}

perp_outcome perp__contact_verdict(const perp_contact_solver *solver,
                                   const perp__contact_candidate *point, perp_outcome said)
{
    perp__evidence whole = {0.0, 0.0, 0.0, 0};
    perp_outcome outcome;

    whole.sound = point->residuals.sound;
    outcome = perp__gate(&whole, solver->settings.tol, said);
    for (int32_t p = 0; p < solver->parts; p++)
        outcome = perp__worse_outcome(outcome,
                                      perp__gate(&point->evidence[p], solver->settings.tol, said));
    return outcome;
}

/* ---- a point ---- */

/* Writes what the modes know of r: 0 of the contacts that separate, the bound that a row is at;
 * `moves`: on the side that u tells, be r where it may. Returns whether that changed anything. */
static int32_t separate(perp_contact_solver *solver, const int8_t *modes, bool moves)
{
    const perp__contact_problem *p = &solver->problem;
    int32_t changed = 0, k, i;

    for (k = 0; k < p->contacts; k++) {
        const double most = perp__contact_is_bound(p, k) ? p->mu[k] * p->bound[k] : 0.0;

        i = p->starts[k];
        if (!perp__contact_is_bound(p, k)) {
            for (; modes[k] == PERP_CONTACT_SEPARATE && i < p->starts[k + 1]; i++)
                changed |= perp__put(&solver->r[i], 0.0);
        } else if (modes[k] != PERP_CONTACT_STICK) {
            if (fabs(solver->r[i + 1]) > 0.5 * most)
                changed |= perp__put(&solver->r[i + 1], copysign(most, solver->r[i + 1]));
            else if (moves && solver->u[i + 1] != 0.0)
                changed |= perp__put(&solver->r[i + 1], copysign(most, 0.0 - solver->u[i + 1]));
        }
    }
    return changed;
}

perp_status perp__contact_evaluate(perp_contact_solver *solver, const int8_t *modes,
                                   perp__contact_residuals *residuals)
{
    const perp__contact_problem *p = &solver->problem;
    perp_status status;

    for (int32_t k = 0; k < p->contacts; k++)
        perp__contact_clip(p, k, solver->r);

    /* a part that nothing drives has no impulses: beside which size any could be right, nobody
     * knows; normals that are bounds stay what they are */
    for (int32_t i = 0; solver->is_idle && i < p->size; i++) {
        const int32_t k = solver->constraint_of[i];

        if (solver->drive[solver->part[k]] == 0.0 &&
            (k >= p->contacts || i >= perp__contact_first_row(p, k)))
            solver->r[i] = 0.0;
    }
    if (modes)
        separate(solver, modes, 0);
    status = compute_velocities(solver);
    if (status != PERP_OK)
        return status;
    measure(solver, residuals);
    /* far from a solution the sides on which a point lies are no active set */
    if (residuals->tested <= sqrt(solver->settings.tol) &&
        separate(solver, modes ? modes : solver->modes, 1)) {
        status = compute_velocities(solver);
        if (status == PERP_OK)
            measure(solver, residuals);
    }

    /* a contact without a normal impulse separates, and one with presses, whatever was said */
    for (int32_t k = 0; k < p->contacts; k++) {
        if (modes)
            solver->modes[k] = modes[k];
        if (solver->r[p->starts[k]] == 0.0 && perp__contact_two_sided(p, k) == 0 &&
            !perp__contact_is_bound(p, k))
            solver->modes[k] = PERP_CONTACT_SEPARATE;
        else if (solver->modes[k] == PERP_CONTACT_SEPARATE)
            solver->modes[k] = PERP_CONTACT_SLIP;
    }
    if (status == PERP_OK)
        perp__contact_weigh(solver, residuals);
    return status;
}

void perp__contact_write_zeros(perp_contact_solver *solver, const int8_t *modes, double *u)
{
    const perp__contact_problem *p = &solver->problem;

    for (int32_t k = 0; k < p->contacts; k++) {
        const double rounding = PERP__SUM_ROUNDING * solver->omega[k] * solver->root[k];
        int32_t end = p->starts[k] + perp__contact_normals(p, k), next = p->starts[k + 1];

        if (modes[k] == PERP_CONTACT_STICK ||
            (solver->settings.raw_velocity == 2 && perp__contact_length(u, end, next) <= rounding))
            end = next;
        for (int32_t i = p->starts[k]; modes[k] != PERP_CONTACT_SEPARATE && i < end; i++)
            u[i] = 0.0;
    }
    for (int32_t i = p->rows; i < p->size; i++)
        u[i] = 0.0;
}

/* ---- the best point so far ---- */

void perp__contact_keep(perp_contact_solver *solver, const perp__contact_candidate *point)
{
    perp__contact_candidate *best = &solver->best;

    best->residuals = point->residuals;
    best->outcome = point->outcome;
    best->method = point->method;
    if (solver->parts > 0)
        memcpy(best->evidence, solver->evidence, (size_t)solver->parts * sizeof *best->evidence);
    perp__copy(best->r, solver->r, solver->size);
    perp__copy(best->u, solver->u, solver->size);
    if (solver->contacts > 0)
        memcpy(best->modes, solver->modes, (size_t)solver->contacts);
    perp__copy(solver->best_v, solver->v, solver->n);
}

perp_status perp__contact_consider(perp_contact_solver *solver, int32_t method, const int8_t *modes,
                                   perp__contact_residuals *found)
{
    perp__contact_candidate point = {.evidence = solver->evidence, .method = method};
    const perp__contact_candidate *best = &solver->best;
    perp_status status = perp__contact_evaluate(solver, modes, &point.residuals);
    int32_t good, was_good;

    if (status != PERP_OK)
        return status;
    point.outcome = perp__contact_verdict(solver, &point, solver->said);
    *found = point.residuals;
    /* it takes the place of the best: a good one, then a sound one, then the smaller residual */
    good = perp__is_good(point.outcome);
    was_good = perp__is_good(best->outcome);
    if (best->method < 0 || good > was_good ||
        (good == was_good && point.residuals.sound > best->residuals.sound) ||
        (good == was_good && point.residuals.sound == best->residuals.sound &&
         point.residuals.tested < best->residuals.tested))
        perp__contact_keep(solver, &point);
    return PERP_OK;
}
