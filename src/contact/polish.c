/* Newton's method on the equations of one active set:
 *
 *   contact presses   u_n = 0; or u_N = 0, one that holds both ways, with |r_N| for r_n
 *   part sticks       u_p = 0
 *   part slips        |r_p| = coefficient r_n,   r_p x u_p = 0   (2 rows; of 1 row the first alone)
 *   bilateral         u_i = 0
 *
 * and afterwards the signs: r_n >= 0, u_n >= 0, |r_p| <= coefficient r_n, r_p'u_p <= 0. What has
 * the wrong one changes its place, for a few rounds. Redundant contacts leave the equations
 * singular but consistent: they are regularised and the solution is refined towards that of the
 * equations as they stand (a proximal point iteration, Rockafellar 1976), so that r moves no
 * further than it must. Unlike a natural map, these equations are smooth on all of the active set:
 * contacts with tiny impulses or slip speeds do not shorten the way from which Newton's method
 * converges. */
#include <math.h>
#include <string.h>

#include "base/random.h"
#include "contact/law.h"
#include "contact/solver.h"
#include "linalg/blas.h"

/* What a friction part of a contact that presses does. */
enum perp__part_state { PERP__PART_NONE, PERP__PART_STICKS, PERP__PART_SLIPS };

/* Of tol: what in plain doubles is enough before the verdict. */
#define ENOUGH 1e-3

/* In plain doubles, and in units in which traces and omegas are 1: a step of more than FAR comes
 * from a set that contradicts itself, nearly singular, and would turn every sign. A proximal step
 * by K + SOFT goes the same way and not so far. A robot that falls, with dry friction in its
 * joints, comes to an end so in two of three steps where FAR is infinite, and SOFT = 1e-4 or 1e-3,
 * in five of six. */
#define FAR 100.0
#define SOFT 3e-4

enum { START_STEPS = 30, ROUNDS = 12, STEPS = 6, REFINEMENTS = 12, PATIENCE = 3 };
enum { MOST_SETS = START_STEPS + 1, RETURNS = 2 };

/* The search: sets that are drawn, and the steps from each. */
enum { DRAWS = 3000, DRAWN_STEPS = 16 };

static void layout(perp__arena *arena, void *object)
{
    perp__contact_polish *p = object;
    const size_t n = (size_t)p->room;

    PERP__DOUBLES(arena, n * n, &p->K, &p->factors);
    PERP__DOUBLES(arena, n, &p->rhs, &p->step, &p->error, &p->units, &p->weights);
    PERP__INTEGERS(arena, n, &p->rows, &p->pivots, &p->place);
    p->presses = perp__arena_take(arena, 4 * n, 1);
    p->parts = p->presses ? p->presses + n : NULL;
    p->seen = perp__arena_take(arena, MOST_SETS * n, 4);
}

/* Whether the one row of such a contact is at its bound: no row of the system, either. */
static bool is_at_bound(const perp__contact_polish *p, const perp__contact_problem *problem,
                        int32_t k)
{
    return perp__contact_is_bound(problem, k) && p->parts[3 * k] == PERP__PART_SLIPS;
}

static void add_row(perp__contact_polish *p, int32_t row)
{
    p->place[row] = p->n;
    p->rows[p->n++] = row;
}

/* The rows of the set, and units in which traces and omegas are 1: `units` of impulses, and weights
 * of velocities. Whether impulses of other rows, which are known, were others. */
static bool number_rows(perp__contact_polish *p, const perp_contact_solver *solver)
{
    const perp__contact_problem *problem = &solver->problem;
    double *r = solver->r;
    bool changes = 0;

    p->n = 0;
    for (int32_t i = 0; i < problem->size; i++)
        p->place[i] = -1;
    for (int32_t k = 0; k < problem->contacts; k++) {
        perp__contact_part parts[3];
        const int32_t count = perp__contact_parts(problem, k, parts);

        for (int32_t i = perp__contact_is_bound(problem, k);
             p->presses[k] && i < perp__contact_normals(problem, k); i++)
            add_row(p, problem->starts[k] + i);
        for (int32_t c = 0; c < count && !is_at_bound(p, problem, k); c++)
            for (int32_t i = 0; p->parts[3 * k + c] != PERP__PART_NONE && i < parts[c].size; i++)
                add_row(p, parts[c].row + i);
    }
    for (int32_t i = problem->rows; i < problem->size; i++)
        add_row(p, i);
    for (int32_t k = 0; k < problem->contacts; k++)
        for (int32_t i = problem->starts[k]; i < problem->starts[k + 1]; i++) {
            const double bound = perp__contact_is_bound(problem, k) ? problem->bound[k] : 0.0;
            const double known = bound > 0.0 && i > problem->starts[k]
                                     ? copysign(problem->mu[k] * bound, r[i])
                                     : bound;

            if (p->place[i] < 0) {
                changes |= r[i] != known;
                r[i] = known;
            }
        }
    for (int32_t i = 0; i < p->n; i++) {
        const int32_t k = problem->constraint_of[p->rows[i]];

        p->units[i] = problem->omega[k] / solver->root[k];
        p->weights[i] = 1.0 / (solver->root[k] * problem->omega[k]);
    }
    return changes;
}

/* Whether part c of contact k slips within the system, where it has equations of its own. */
static bool slips(const perp__contact_polish *p, const perp__contact_problem *problem, int32_t k,
                  int32_t c)
{
    return p->parts[3 * k + c] == PERP__PART_SLIPS && !is_at_bound(p, problem, k);
}

/* What the equations lack: velocities of 0, but of a part that slips |r_p| = coefficient r_n, in
 * the units of velocities, and then r_p x u_p / |r_p| = 0. */
static void find_goal(perp__contact_polish *p, const perp__contact_problem *problem,
                      const double *r, const double *u)
{
    for (int32_t i = 0; i < p->n; i++)
        p->rhs[i] = -u[p->rows[i]];
    for (int32_t k = 0; k < problem->contacts; k++) {
        perp__contact_part parts[3];
        const int32_t count = perp__contact_parts(problem, k, parts);

        for (int32_t c = 0; c < count; c++) {
            const double *x = r + parts[c].row, *y = u + parts[c].row;
            const double length = perp__length(x, parts[c].size);
            double *rhs = p->rhs;

            if (!slips(p, problem, k, c))
                continue;
            rhs += p->place[parts[c].row];
            rhs[0] = -problem->trace[k] *
                     (length - parts[c].coefficient * perp__contact_pressure(problem, k, r));
            if (parts[c].size == 2)
                rhs[1] = -(x[0] * y[1] - x[1] * y[0]) / length;
        }
    }
    for (int32_t i = 0; i < p->n; i++)
        p->rhs[i] *= p->weights[i];
}

/* The rows a and b of K for a part that slips. */
static void write_slip(perp__contact_polish *p, const perp__contact_problem *problem,
                       const perp__contact_part *part, int32_t k, const double *r, const double *u)
{
    const size_t n = (size_t)p->n, a = (size_t)p->place[part->row], b = a + 1;
    const double *x = r + part->row, *y = u + part->row;
    const double length = perp__length(x, part->size), t = problem->trace[k];
    const double pressure = perp__contact_pressure(problem, k, r);
    const int32_t normal = problem->starts[k], both = perp__contact_two_sided(problem, k);

    for (size_t j = 0; j < n; j++) {
        double *column = p->K + j * n;

        if (part->size == 2)
            column[b] = (x[0] * column[b] - x[1] * column[a]) / length;
        column[a] = 0.0;
    }
    if (part->size == 2) {
        p->K[b + a * n] += y[1] / length;
        p->K[b + b * n] -= y[0] / length;
    }
    for (int32_t i = 0; i < part->size; i++)
        p->K[a + (a + (size_t)i) * n] = t * (x[i] / length);
    if (both == 0 && p->place[normal] >= 0)
        p->K[a + (size_t)p->place[normal] * n] = -t * part->coefficient;
    for (int32_t i = normal; i < normal + both && pressure > 0.0; i++)
        p->K[a + (size_t)p->place[i] * n] = -t * part->coefficient * (r[i] / pressure);
}

/* K, the derivative of all of these. */
static void fill(perp__contact_polish *p, const perp__contact_problem *problem, const double *r,
                 const double *u)
{
    const perp__index_set set = {p->n, p->rows, p->place};
    const size_t n = (size_t)p->n;

    perp__principal_dense(problem->W, &set, p->K, 1, n);
    for (int32_t k = 0; k < problem->contacts; k++) {
        perp__contact_part parts[3];
        const int32_t count = perp__contact_parts(problem, k, parts);

        for (int32_t c = 0; c < count; c++)
            if (slips(p, problem, k, c))
                write_slip(p, problem, &parts[c], k, r, u);
    }
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++)
            p->K[i + j * n] *= p->weights[i] * p->units[j];
}

/* The factors of K, so regularised. Returns 0 where that is singular. */
static bool factor(perp__contact_polish *p, double regular)
{
    const size_t n = (size_t)p->n;

    memcpy(p->factors, p->K, n * n * sizeof *p->K);
    for (size_t i = 0; i < n; i++)
        p->factors[i * (n + 1)] += regular;
    return perp__lu_factor(p->n, p->factors, p->n, p->pivots) == 0;
}

/* step = K^-1 rhs by refinement with the factors of what is near K. */
static void solve_step(perp__contact_polish *p)
{
    const size_t bytes = (size_t)p->n * sizeof(double);
    double last = INFINITY;

    memset(p->step, 0, bytes);
    memcpy(p->error, p->rhs, bytes);
    for (int32_t k = 0; k < REFINEMENTS; k++) {
        const double size = perp__largest_or_nan(p->error, p->n);

        if (!(size < 0.9 * last) || size <= p->enough)
            return;
        last = size;
        perp__lu_solve(p->n, p->factors, p->n, p->pivots, p->error, 0);
        for (int32_t i = 0; i < p->n; i++)
            p->step[i] += p->error[i];
        memcpy(p->error, p->rhs, bytes);
        perp__gemv_subtract(p->n, p->n, p->K, p->n, p->step, p->error);
    }
}

static void velocities(perp_contact_solver *solver)
{
    if (solver->polish.enough > 0.0) {
        perp__multiply(solver->problem.W, solver->r, solver->u);
        for (int32_t i = 0; i < solver->size; i++)
            solver->u[i] += solver->q[i];
        return;
    }
    perp__multiply_doubled(solver->problem.W, solver->r, solver->q, solver->high, solver->low);
    perp__copy(solver->u, solver->high, solver->size);
}

/* Takes one more step of the polish from what limits and monitor grant. Returns 0 where there is
 * none left. */
static bool take_step(perp_contact_solver *solver)
{
    const int64_t limit = solver->settings.max_iterations;

    if ((limit > 0 && solver->polished >= limit) ||
        perp__contact_tick(solver, solver->polished, solver->best.residuals.tested))
        return 0;
    solver->polished++;
    solver->iterations++;
    return 1;
}

/* Newton's steps while they bring the equations down; u is that of the last r, as it is at first
 * unless r `moved`. Returns 0 where K was singular. */
static bool follow(perp_contact_solver *solver, perp__contact_polish *p, bool moved)
{
    const perp__contact_problem *problem = &solver->problem;
    double least = INFINITY, size;

    p->is_soft = 0;
    if (moved)
        velocities(solver);
    for (int32_t step = 0; step < STEPS && !p->is_soft; step++) {
        /* 1. Whether to take one. */
        find_goal(p, problem, solver->r, solver->u);
        size = perp__largest_or_nan(p->rhs, p->n);
        if (!(size < 0.5 * least) || (step > 0 && size <= p->enough))
            return 1;
        least = size;
        if (p->enough > 0.0 && solver->polished >= p->last)
            return 0;
        if (!take_step(solver))
            return step > 0;

        /* 2. The step; a proximal one of a set that contradicts itself. */
        fill(p, problem, solver->r, solver->u);
        if (!factor(p, PERP__REGULAR))
            return 0;
        solve_step(p);
        p->is_soft = p->enough > 0.0 && !(perp__largest_or_nan(p->step, p->n) <= FAR);
        if (p->is_soft) {
            if (!factor(p, SOFT))
                return 0;
            memcpy(p->step, p->rhs, (size_t)p->n * sizeof(double));
            perp__lu_solve(p->n, p->factors, p->n, p->pivots, p->step, 0);
        }
        if (!isfinite(perp__largest_or_nan(p->step, p->n)))
            return 0;

        /* 3. Impulses and velocities there. */
        for (int32_t i = 0; i < p->n; i++)
            solver->r[p->rows[i]] += p->step[i] * p->units[i];
        velocities(solver);
    }
    return 1;
}

/* Moves what has the wrong sign to its other place. Returns how many did. */
static int32_t change_set(perp__contact_polish *p, const perp__contact_problem *problem,
                          const double *r, const double *u)
{
    int32_t changes = 0, k, c, i;

    for (k = 0; k < problem->contacts; k++) {
        const int32_t normal = problem->starts[k];
        perp__contact_part parts[3];
        const int32_t count = perp__contact_parts(problem, k, parts);
        const int32_t presses = perp__contact_two_sided(problem, k) > 0 ||
                                perp__contact_is_bound(problem, k) ||
                                (p->presses[k] ? r[normal] > 0.0 : u[normal] < 0.0);
        const double pressure = perp__contact_pressure(problem, k, r);
        const int32_t flips = presses != p->presses[k];

        changes += flips;
        p->presses[k] = (int8_t)presses;
        for (c = 0; c < count; c++) {
            int8_t *state = &p->parts[3 * k + c];
            const double *x = r + parts[c].row, *y = u + parts[c].row;
            const double radius = parts[c].coefficient * pressure;
            double power = 0.0;

            if (parts[c].coefficient == 0.0)
                continue;
            if (flips) {
                *state = presses ? PERP__PART_STICKS : PERP__PART_NONE;
                continue;
            }
            for (i = 0; i < parts[c].size; i++)
                power += x[i] * y[i];
            if (*state == PERP__PART_STICKS &&
                perp__length(x, parts[c].size) > radius * (1 + 1e-14)) {
                *state = PERP__PART_SLIPS;
                changes++;
            } else if (*state == PERP__PART_SLIPS && power > 0.0) {
                *state = PERP__PART_STICKS;
                changes++;
            }
        }
    }
    return changes;
}

/* From set to set. Returns whether that ended with one that stays. Sets that come back go round in
 * a circle; once they may, as slips have turned meanwhile. */
static bool follow_sets(perp_contact_solver *solver, perp__contact_polish *p)
{
    const size_t bytes = 4 * (size_t)p->room;
    int8_t *now = p->seen;
    int32_t returns = 0;

    for (int32_t sets = 0; sets < MOST_SETS && returns < RETURNS; sets++, now += bytes) {
        int32_t earlier = 0;

        memcpy(now, p->presses, bytes);
        while (memcmp(p->seen + (size_t)earlier * bytes, now, bytes) != 0)
            earlier++;
        returns += earlier < sets && memcmp(now - bytes, now, bytes) != 0;
        if (!follow(solver, p, number_rows(p, solver)))
            return 0;
        if (change_set(p, &solver->problem, solver->r, solver->u) == 0)
            return !p->is_soft;
    }
    return 0;
}

static perp_status fit(perp_contact_solver *solver, perp__contact_polish *p)
{
    p->room = solver->size;
    return perp__arena_fit(&p->arena, solver->context, layout, p);
}

static void write_modes(const perp__contact_polish *p, const perp__contact_problem *problem,
                        int8_t *modes)
{
    for (int32_t k = 0; k < problem->contacts; k++) {
        modes[k] = p->presses[k] ? PERP_CONTACT_STICK : PERP_CONTACT_SEPARATE;
        for (int32_t c = 0; c < 3 && p->presses[k]; c++)
            if (p->parts[3 * k + c] == PERP__PART_SLIPS)
                modes[k] = PERP_CONTACT_SLIP;
    }
}

/* The active set that r and u show; `most` steps. */
static void begin(perp_contact_solver *solver, perp__contact_polish *p, double enough, int64_t most)
{
    const perp__contact_problem *problem = &solver->problem;
    const double *r = solver->r, *u = solver->u;

    p->enough = enough;
    p->last = solver->polished + most;
    memset(p->presses, PERP__PART_NONE, 4 * (size_t)p->room);
    for (int32_t k = 0; k < problem->contacts; k++) { /* the side of the kink on which each lies */
        const int32_t normal = problem->starts[k];
        perp__contact_part parts[3];
        const int32_t count = perp__contact_parts(problem, k, parts);
        const double pressure = perp__contact_pressure(problem, k, r);

        p->presses[k] = perp__contact_two_sided(problem, k) > 0 ||
                        perp__contact_is_bound(problem, k) ||
                        r[normal] > u[normal] / problem->trace[k];
        for (int32_t c = 0; c < count; c++) {
            const int32_t row = parts[c].row;
            double x[2] = {0.0, 0.0};

            for (int32_t i = 0; i < parts[c].size; i++)
                x[i] = r[row + i] - u[row + i] / problem->trace[k];
            p->parts[3 * k + c] =
                !p->presses[k] || parts[c].coefficient == 0.0 ? PERP__PART_NONE
                : perp__length(x, parts[c].size) > parts[c].coefficient * pressure &&
                        perp__length(r + row, parts[c].size) > 0.0
                    ? PERP__PART_SLIPS
                    : PERP__PART_STICKS;
        }
    }
}

perp_status perp__contact_polish_run(perp_contact_solver *solver)
{
    perp__contact_polish *p = &solver->polish;
    const perp__contact_problem *problem = &solver->problem;
    double best = INFINITY;
    int32_t round, waited = 0, made = 0;
    perp_status status;

    if (solver->size == 0 || solver->size > PERP__POLISH_MOST || problem->cone > 0)
        return PERP_OK;
    status = perp__contact_delassus(solver, &made);
    PERP__THEN(status, fit(solver, p));
    if (status != PERP_OK || !made)
        return status;
    begin(solver, p, 0.0, 0);
    for (round = 0; round < ROUNDS && waited < PATIENCE; round++) {
        perp__contact_residuals residuals;
        int32_t changes;

        number_rows(p, solver);
        if (!follow(solver, p, 1))
            return PERP_OK;
        changes = change_set(p, problem, solver->r, solver->u);
        write_modes(p, problem, solver->modes);
        /* the next round goes on from r as it is, not clipped to its cones */
        memcpy(solver->start, solver->r, (size_t)solver->size * sizeof(double));
        status = perp__contact_consider(solver, solver->running, solver->modes, &residuals);
        if (status != PERP_OK || perp__is_good(solver->best.outcome) || changes == 0)
            return status;
        memcpy(solver->r, solver->start, (size_t)solver->size * sizeof(double));
        waited = residuals.tested < 0.5 * best ? 0 : waited + 1;
        best = fmin(best, residuals.tested);
    }
    return PERP_OK;
}

bool perp__contact_polish_suits(const perp_contact_solver *solver)
{
    return solver->size > 0 && solver->size <= PERP__POLISH_START_MOST && solver->problem.W &&
           solver->problem.cone == 0;
}

bool perp__contact_is_near(perp_contact_solver *solver)
{
    solver->polish.enough = solver->settings.tol;
    for (int32_t k = 0; k < solver->contacts; k++)
        perp__contact_clip(&solver->problem, k, solver->r);
    velocities(solver);
    return perp__contact_tested(&solver->problem, solver->r, solver->u) <= solver->settings.tol;
}

perp_status perp__contact_polish_start(perp_contact_solver *solver, bool knows_u)
{
    perp__contact_polish *p = &solver->polish;
    perp__contact_residuals residuals;
    perp_status status = fit(solver, p);

    if (status != PERP_OK)
        return status;
    p->enough = ENOUGH * solver->settings.tol;
    if (!knows_u)
        velocities(solver);
    begin(solver, p, p->enough, START_STEPS);
    if (!follow_sets(solver, p))
        return PERP_OK;
    write_modes(p, &solver->problem, solver->modes);
    status = perp__contact_consider(solver, solver->running, solver->modes, &residuals);
    return status == PERP_OK && !perp__is_good(solver->best.outcome)
               ? perp__contact_polish_run(solver)
               : status;
}

/* ---- the search ----------------------------------------------------------------------------- */

perp_status perp__contact_polish_search(perp_contact_solver *solver)
{
    const perp__contact_problem *problem = &solver->problem;
    perp__contact_polish *p = &solver->polish;
    perp__contact_residuals residuals;
    uint64_t seed = 1;
    perp_status status = fit(solver, p);

    for (int32_t set = 0; set < DRAWS && status == PERP_OK && solver->ended < 0; set++) {
        begin(solver, p, ENOUGH * solver->settings.tol, DRAWN_STEPS);
        /* modes, and impulses that have them, up to a few times what the problem drives with */
        for (int32_t k = 0; k < problem->contacts; k++) {
            const double unit = problem->omega[k] / sqrt(problem->trace[k]);
            const double size = ldexp(unit, (int)(3.0 * perp__draw(&seed)));
            int8_t *states = p->parts + 3 * k;
            perp__contact_part parts[3];
            const int32_t count = perp__contact_parts(problem, k, parts);

            for (int32_t i = problem->starts[k]; i < problem->starts[k + 1]; i++)
                solver->r[i] = size * perp__draw(&seed);
            p->presses[k] =
                perp__contact_two_sided(problem, k) > 0 || solver->r[problem->starts[k]] > 0.0;
            for (int32_t c = 0; c < count; c++)
                states[c] = !p->presses[k] || parts[c].coefficient == 0.0 ? PERP__PART_NONE
                            : perp__draw(&seed) > 0.0                     ? PERP__PART_SLIPS
                                                                          : PERP__PART_STICKS;
            perp__contact_clip(problem, k, solver->r);
        }
        velocities(solver);
        if (!follow_sets(solver, p))
            continue;
        write_modes(p, problem, solver->modes);
        status = perp__contact_consider(solver, solver->running, solver->modes, &residuals);
        if (perp__is_good(solver->best.outcome))
            break;
    }
    return status;
}
