/* Checks and keeps what a problem is made of. */
#include <math.h>
#include <string.h>

#include "base/check.h"
#include "base/context.h"
#include "contact/contact.h"
#include "contact/law.h"
#include "contact/solver.h"

/* Normals that hold both ways. */
static int32_t both_of(const perp_contact_laws *laws, int32_t k)
{
    return laws->two_sided ? laws->two_sided[k] : 0;
}

static bool is_positive(const double *x, int32_t k)
{
    return x && x[k] > 0.0;
}

static int32_t rows_of(const perp_contact_laws *laws, int32_t k)
{
    const int32_t dim = perp__contact_dim(laws, k);

    if (both_of(laws, k) > 0)
        return dim;
    return dim + (is_positive(laws->rolling, k) ? dim - 1 : 0) + is_positive(laws->spinning, k);
}

static perp_status check_coefficients(perp_context *context, const char *name, const double *x,
                                      int32_t count)
{
    for (int32_t k = 0; x && k < count; k++) {
        if (!isfinite(x[k]))
            return perp__fail(context, PERP_ERROR_NOT_FINITE, "%s[%d] is %g", name, (int)k, x[k]);
        if (x[k] < 0.0)
            return perp__refuse(context, "%s[%d] is %g, expected a number >= 0", name, (int)k,
                                x[k]);
    }
    return PERP_OK;
}

static const perp__field counts[] = {
    PERP__INTEGER(perp_contact_laws, contacts, 0, INFINITY),
    PERP__INTEGER(perp_contact_laws, bilateral, 0, INFINITY),
    PERP__INTEGER(perp_contact_laws, bounded, 0, INT32_MAX / 4),
};

/* Everything but compliance, whose length is not known yet; `rows` is what the contacts need. */
perp_status perp__contact_read_laws(perp_context *context, perp_contact_laws *copy, int32_t *rows,
                                    const perp_contact_laws *laws)
{
    perp_status status = perp_contact_laws_init(copy, sizeof *copy);
    int64_t sum = 0;

    PERP__THEN(status, perp__check_pointer(context, "laws", laws));
    PERP__THEN(status, PERP__READ(perp_contact_laws, context, copy, laws));
    if (status != PERP_OK)
        return status;
    status = PERP__CHECK_FIELDS(context, "laws", copy, counts);
    if (status == PERP_OK && copy->bounded > 0)
        status = perp__check_bounds(context, copy->lower, copy->upper, (size_t)copy->bounded);
    PERP__THEN(status, check_coefficients(context, "laws.mu", copy->mu, copy->contacts));
    PERP__THEN(status, check_coefficients(context, "laws.rolling", copy->rolling, copy->contacts));
    PERP__THEN(status,
               check_coefficients(context, "laws.spinning", copy->spinning, copy->contacts));
    if (status == PERP_OK && !copy->dims && (copy->dim < 1 || copy->dim > 3))
        status = perp__refuse(context, "laws.dim is %d, expected 1, 2 or 3", (int)copy->dim);
    PERP__THEN(status, perp__check_dims(context, "laws", copy->contacts, copy->dim, copy->dims,
                                        copy->two_sided));
    for (int32_t k = 0; status == PERP_OK && k < copy->contacts; k++) {
        const int32_t both = both_of(copy, k) > 0, dim = perp__contact_dim(copy, k);
        const bool rolls = is_positive(copy->rolling, k) && (both || dim < 2);

        sum += rows_of(copy, k);
        if (rolls || (is_positive(copy->spinning, k) && (both || dim < 3)))
            status = perp__refuse(context, "laws.%s[%d] is %g, but contact %d %s",
                                  rolls ? "rolling" : "spinning", (int)k,
                                  rolls ? copy->rolling[k] : copy->spinning[k], (int)k,
                                  both       ? "holds both ways"
                                  : dim == 1 ? "has dimension 1"
                                             : "has dimension 2");
    }
    if (status == PERP_OK && sum > INT32_MAX - (int64_t)copy->bilateral - 2 * copy->bounded)
        status = perp__refuse(context, "laws.contacts is %d, too many rows", (int)copy->contacts);
    *rows = (int32_t)sum;
    return status;
}

void perp__contact_lay_out(perp__arena *arena, void *object)
{
    perp_contact_solver *s = object;
    const size_t contacts = (size_t)s->contacts, size = (size_t)s->size;
    const size_t constraints = (size_t)s->constraints, n = (size_t)s->n;

    s->starts = perp__arena_take(arena, constraints + 1, sizeof(int32_t));
    PERP__INTEGERS(arena, contacts, &s->dims, &s->two_sided);
    PERP__DOUBLES(arena, contacts, &s->mu, &s->rolling, &s->spinning, &s->bound);
    PERP__DOUBLES(arena, size, &s->compliance, &s->diagonal);
    s->trace = perp__arena_take(arena, contacts + size, sizeof(double));
    s->constraint_of = perp__arena_take(arena, size, sizeof(int32_t));
    PERP__INTEGERS(arena, constraints, &s->part, &s->near, &s->number);
    s->evidence = perp__arena_take(arena, constraints, sizeof(perp__evidence));
    s->best.evidence = perp__arena_take(arena, constraints, sizeof(perp__evidence));
    PERP__DOUBLES(arena, constraints, &s->root, &s->omega, &s->drive, &s->terms, &s->lack, &s->wide,
                  &s->most_speed, &s->most_energy);
    PERP__DOUBLES(arena, size, &s->q, &s->load, &s->scale, &s->high, &s->low, &s->r, &s->u,
                  &s->start, &s->warm, &s->ray, &s->best.r, &s->best.u);
    PERP__DOUBLES(arena, n, &s->push, &s->push_low, &s->v, &s->v_low, &s->best_v);
    s->modes = perp__arena_take(arena, contacts, sizeof(int8_t));
    s->best.modes = perp__arena_take(arena, contacts, sizeof(int8_t));
    s->rest_modes = perp__arena_take(arena, contacts, sizeof(int8_t));
}

static void keep(double *copy, const double *given, int32_t count)
{
    for (int32_t k = 0; k < count; k++)
        copy[k] = given ? given[k] : 0.0;
}

/* Of the contacts as they were given, and what all rows yield where none has bounds (bounded.c). */
static void keep_laws(perp_contact_solver *solver, const perp_contact_laws *laws)
{
    const int32_t given = laws->contacts;

    solver->starts[0] = solver->holds_both = solver->rolls = solver->spins = 0;
    keep(solver->mu, laws->mu, given);
    keep(solver->rolling, laws->rolling, given);
    keep(solver->spinning, laws->spinning, given);
    keep(solver->bound, NULL, given);
    keep(solver->compliance, laws->bounded > 0 ? NULL : laws->compliance, solver->size);
    for (int32_t k = 0; k < given; k++) {
        solver->dims[k] = perp__contact_dim(laws, k);
        solver->two_sided[k] = both_of(laws, k);
        solver->holds_both |= solver->two_sided[k] > 0;
        solver->starts[k + 1] = solver->starts[k] + rows_of(laws, k);
        solver->rolls |= solver->rolling[k] > 0.0;
        solver->spins |= solver->spinning[k] > 0.0;
    }
    solver->has_discs = solver->rolls || solver->spins;
    solver->has_bounds = solver->bounded.boxes > 0;
}

/* In the caller's words. */
static perp_status moves_nothing(const perp_contact_solver *solver, int32_t k, int32_t row)
{
    const perp__contact_bounded *bounded = &solver->bounded;
    const int32_t first = bounded->rows - bounded->count;
    const char *what = k < solver->contacts ? "contact" : "bilateral row";
    int32_t number = k < solver->contacts ? k : k - solver->contacts, given = row;

    for (int32_t i = 0; bounded->count > 0 && i < bounded->size; i++)
        if (bounded->row[i] == row) {
            given = i;
            what = i < first ? "contact" : i < bounded->rows ? "row with bounds" : "bilateral row";
            number = i < first ? k : i < bounded->rows ? i - first : i - bounded->rows;
        }
    return perp__refuse(solver->context, "%s %d: its %simpulse moves nothing, W(%d,%d) is %g", what,
                        (int)number, what[0] == 'c' ? "normal " : "", (int)given, (int)given,
                        solver->diagonal[row]);
}

/* t_k = trace(W_kk). A contact or joint between things that can't move is a mistake in the scene:
 * no impulse changes its velocity. */
static perp_status read_traces(perp_contact_solver *solver)
{
    const double *bound = solver->has_bounds ? solver->bound : NULL;
    int32_t i;

    if (solver->has_bodies)
        perp__bodies_diagonals(&solver->bodies, solver->diagonal);
    else
        perp__delassus_diagonal(&solver->W, solver->diagonal);
    for (i = 0; i < solver->size; i++)
        if (!(solver->diagonal[i] >= 0.0))
            return perp__refuse(solver->context, "W(%d,%d) is %g, expected a number >= 0", (int)i,
                                (int)i, solver->diagonal[i]);
    for (int32_t k = 0; k < solver->contacts; k++) {
        solver->trace[k] = 0.0;
        i = solver->starts[k] + (bound && bound[k] > 0.0);
        for (int32_t row = i; row < solver->starts[k + 1]; row++)
            solver->trace[k] += solver->diagonal[row];
        for (int32_t row = i; row <= i || row < solver->starts[k] + solver->two_sided[k]; row++)
            if (!(solver->diagonal[row] > 0.0) || !isfinite(solver->trace[k]))
                return moves_nothing(solver, k, row);
    }
    for (int32_t k = solver->contacts; k < solver->constraints; k++) {
        i = solver->starts[k];
        solver->trace[k] = solver->diagonal[i];
        if (!(solver->diagonal[i] > 0.0) || !isfinite(solver->diagonal[i]))
            return moves_nothing(solver, k, i);
    }
    return PERP_OK;
}

static void present(perp_contact_solver *solver)
{
    perp__contact_problem *p = &solver->problem;
    bool yields = 0; /* whether some row does that moves */

    memset(p, 0, sizeof *p);
    p->context = solver->context;
    p->contacts = solver->contacts;
    p->rows = solver->rows;
    p->size = solver->size;
    p->has_discs = solver->has_discs;
    p->starts = solver->starts;
    p->constraint_of = solver->constraint_of;
    p->dims = solver->dims;
    p->two_sided = solver->holds_both ? solver->two_sided : NULL;
    p->mu = solver->mu;
    p->rolling = solver->rolls ? solver->rolling : NULL;
    p->spinning = solver->spins ? solver->spinning : NULL;
    p->bound = solver->has_bounds ? solver->bound : NULL;
    p->trace = solver->trace;
    p->diagonal = solver->diagonal;
    p->q = solver->q;
    p->omega = solver->omega;
    p->part = solver->part;
    p->parts = solver->parts;
    p->leaks = solver->leaks;
    p->W = solver->has_bodies ? NULL : &solver->W;
    for (int32_t i = 0; i < solver->size; i++)
        yields |= solver->compliance[i] > 0.0 &&
                  i >= perp__contact_first_row(p, solver->constraint_of[i]);
    if (solver->entrance == PERP__ENTRANCE_DYNAMICS && p->W && !yields)
        p->half = perp__dynamics_half(&solver->dynamics, &p->half_stride);
    p->half_rows = p->half ? solver->dynamics.n : 0;
    p->bodies = solver->has_bodies ? &solver->bodies : NULL;
    p->control = &solver->control;
}

perp_status perp__contact_finish_setup(perp_contact_solver *solver)
{
    perp_status status;

    for (int32_t k = solver->contacts; k < solver->constraints; k++)
        solver->starts[k + 1] = solver->starts[k] + 1;
    status = read_traces(solver);
    if (status == PERP_OK) {
        perp__contact_find_parts(solver);
        present(solver);
    }
    return status;
}

perp_status perp__contact_find_bodies(perp_contact_solver *solver, int32_t *found)
{
    const perp__dynamics *d = &solver->dynamics;
    perp__bodies_input input = {.n = d->n, .contacts = solver->contacts, .size = solver->size};
    perp_status status;

    input.starts = solver->starts;
    input.M = &d->M, input.H = &d->H, input.G = d->G.rows > 0 ? &d->G : NULL;
    input.compliance = solver->complies ? solver->compliance : NULL;
    status = perp__bodies_setup(&solver->bodies, &input, found);
    return status == PERP_OK && *found ? perp__hold_fit(&solver->hold, &solver->bodies) : status;
}

/* The matrix of the methods, or the bodies, after the laws were kept. */
static perp_status make_matrices(perp_contact_solver *solver)
{
    const size_t size = (size_t)solver->size;
    const bool wants_W = solver->settings.raw_velocity == 2 &&
                         solver->size <= PERP__POLISH_START_MOST && solver->size <= 3 * solver->n;
    perp_status status = PERP_OK;

    solver->complies = solver->has_bodies = 0;
    for (size_t i = 0; i < size; i++)
        solver->complies |= solver->compliance[i] > 0.0;
    /* 1. Bodies, where M falls into blocks. Small problems want W, where the caller allows it and
     * there are no more contacts than velocities: sets of rows that depend on each other circle.
     * New sizes find bodies all the same: what comes to rest later has memory (active.c). */
    if (solver->entrance == PERP__ENTRANCE_DYNAMICS && solver->dynamics.has_M &&
        (!wants_W || solver->size > solver->bodies.size || solver->n > solver->bodies.n))
        status = perp__contact_find_bodies(solver, &solver->has_bodies);
    solver->has_bodies &= !wants_W;
    /* 2. Else W. */
    if (solver->entrance == PERP__ENTRANCE_DELASSUS)
        return solver->complies ? perp__delassus_add(&solver->delassus, solver->context, &solver->W,
                                                     solver->compliance)
                                : PERP_OK;
    solver->dynamics.forms_W = !solver->has_bodies;
    PERP__THEN(status, perp__dynamics_setup(&solver->dynamics));
    if (status != PERP_OK || solver->has_bodies)
        return status;
    solver->W = (perp__matrix){solver->size, solver->size, 1, size, solver->dynamics.W, NULL, NULL};
    if (solver->bounded.boxes > 0 && !solver->dynamics.has_M) {
        perp__contact_bounded_yield(&solver->bounded, solver->W.values);
        solver->complies = 1;
    }
    for (size_t i = 0; i < size; i++)
        solver->dynamics.W[i + i * size] += solver->compliance[i];
    return PERP_OK;
}

perp_status perp__contact_delassus(perp_contact_solver *solver, int32_t *made)
{
    perp_status status = PERP_OK;

    *made = 1;
    if (solver->problem.W)
        return PERP_OK;
    status = perp__delassus_of_bodies(&solver->delassus, solver->context, &solver->bodies,
                                      &solver->W, made);
    if (status == PERP_OK && *made)
        solver->problem.W = &solver->W;
    return status;
}

/* Reads W or the dynamics into `next`, and the bilateral rows into laws. */
static perp_status read_matrices(perp_contact_solver *next, perp_contact_laws *laws,
                                 const perp_contact_dynamics *dynamics, const perp_matrix *W)
{
    perp_context *context = next->context;
    const int32_t rows = next->bounded.rows, needed = rows + laws->bilateral;
    perp_status status;

    if (next->entrance == PERP__ENTRANCE_DYNAMICS) {
        status = perp__dynamics_read(context, &next->dynamics, rows, dynamics);
        if (status == PERP_OK && laws->bilateral != 0 && laws->bilateral != next->dynamics.G.rows)
            status = perp__refuse(context, "laws.bilateral is %d, but G has %d rows",
                                  (int)laws->bilateral, (int)next->dynamics.G.rows);
        laws->bilateral = status == PERP_OK ? next->dynamics.G.rows : 0;
        return status;
    }
    status = perp__matrix_read(context, "W", &next->W, W);
    if (status == PERP_OK && (next->W.rows != needed || next->W.columns != needed))
        status = perp__refuse(
            context, "W is %d by %d, but the contacts have %d rows and %d are bilateral",
            (int)next->W.rows, (int)next->W.columns, (int)rows, (int)laws->bilateral);
    return status;
}

perp_status perp__contact_setup(perp_contact_solver *solver, const perp_contact_laws *laws,
                                const perp_contact_dynamics *dynamics, const perp_matrix *W)
{
    perp_contact_solver next = *solver;
    perp_contact_laws copy;
    perp_status status = perp__contact_read_laws(solver->context, &copy, &next.rows, laws);

    if (status != PERP_OK)
        return status;
    next.entrance = W ? PERP__ENTRANCE_DELASSUS : PERP__ENTRANCE_DYNAMICS;
    perp__contact_bounded_count(&next.bounded, &copy, next.rows);
    next.contacts = next.bounded.own_contacts;
    status = read_matrices(&next, &copy, dynamics, W);
    if (status != PERP_OK)
        return status;
    next.rows = next.bounded.own_rows;
    next.size = next.rows + next.bounded.free + copy.bilateral;
    next.constraints = next.contacts + next.bounded.free + copy.bilateral;
    next.n = W ? 0 : next.dynamics.n;
    status = check_coefficients(solver->context, "laws.compliance", copy.compliance,
                                next.bounded.rows + copy.bilateral);
    PERP__THEN(status, perp__arena_fit(&next.arena, next.context, perp__contact_lay_out, &next));
    if (status != PERP_OK)
        return status;
    /* from here on the old problem is gone */
    next.setups++;
    *solver = next;
    keep_laws(solver, &copy);
    if (copy.bounded > 0)
        status = perp__contact_bounded_read(solver, &copy);
    PERP__THEN(status, make_matrices(solver));
    PERP__THEN(status, perp__contact_finish_setup(solver));
    if (status != PERP_OK)
        solver->entrance = PERP__NO_PROBLEM;
    return status;
}
