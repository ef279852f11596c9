/* What a point is worth, part by part: the tested residual, beside the largest free velocity of the
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
#include <float.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "contact/law.h"
#include "contact/solver.h"
#include "linalg/spatial.h"

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

static void gather(const perp_contact_solver *solver, perp__contact_residuals *residuals)
{
    residuals->tested = residuals->own_residual = residuals->backward = 0.0;
    for (int32_t p = 0; p < solver->parts; p++) {
        perp__raise_to(&residuals->tested, solver->evidence[p].tested);
        perp__raise_to(&residuals->own_residual, solver->evidence[p].own_residual);
        perp__raise_to(&residuals->backward, solver->evidence[p].backward);
    }
}

void perp__contact_measure(perp_contact_solver *solver, perp__contact_residuals *residuals)
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
    gather(solver, residuals);
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
        const int32_t closes = row >= 0 && solver->modes[k] == PERP_CONTACT_SEPARATE &&
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
    int32_t is_open = 0;

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
    gather(solver, residuals);
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
