/* Parts that the methods did not solve together are solved one by one, each a problem of its own
 * with its block of W: what a part is worth is not to depend on what else there is. */
#include <string.h>

#include <perp/contact.h>

#include "base/clock.h"
#include "contact/solver.h"

static void lay_out(perp__arena *arena, void *object)
{
    perp__contact_apart *own = object;
    const size_t n = (size_t)own->room;

    own->W = perp__arena_take(arena, n, n * sizeof(double));
    own->position = perp__arena_take(arena, (size_t)own->size, sizeof(int32_t));
    PERP__DOUBLES(arena, n, &own->mu, &own->rolling, &own->spinning, &own->q, &own->r0, &own->r,
                  &own->u, &own->ray);
    PERP__INTEGERS(arena, n, &own->rows, &own->numbers, &own->dims, &own->two_sided, &own->modes);
}

static int32_t is_solved(const perp_contact_solver *solver, int32_t part)
{
    return perp__is_good(perp__gate(&solver->best.evidence[part], solver->settings.tol, -1));
}

static int32_t count_rows(const perp_contact_solver *solver, int32_t part)
{
    int32_t count = 0, i;

    for (i = 0; i < solver->size; i++)
        count += solver->part[solver->constraint_of[i]] == part;
    return count;
}

/* The part's rows, its contacts and their coefficients. */
static void list(const perp_contact_solver *solver, perp__contact_apart *own, int32_t part)
{
    own->size = own->contacts = 0;
    for (int32_t i = 0; i < solver->size; i++) {
        own->position[i] = solver->part[solver->constraint_of[i]] == part ? own->size : -1;
        if (own->position[i] >= 0)
            own->rows[own->size++] = i;
    }
    for (int32_t k = 0; k < solver->contacts; k++)
        if (solver->part[k] == part) {
            own->numbers[own->contacts] = k;
            own->dims[own->contacts] = solver->dims[k];
            own->two_sided[own->contacts] = solver->two_sided[k];
            own->mu[own->contacts] = solver->mu[k];
            own->rolling[own->contacts] = solver->rolls ? solver->rolling[k] : 0.0;
            own->spinning[own->contacts++] = solver->spins ? solver->spinning[k] : 0.0;
        }
    own->bilateral = 0;
    for (int32_t k = solver->contacts; k < solver->constraints; k++)
        own->bilateral += solver->part[k] == part;
}

/* W, column by column, and q of the part's rows. */
static void copy(const perp_contact_solver *solver, perp__contact_apart *own)
{
    const perp__index_set set = {own->size, own->rows, own->position};

    perp__principal_dense(&solver->W, &set, own->W, 1, (size_t)own->size);
    for (int32_t i = 0; i < own->size; i++) {
        own->q[i] = solver->q[own->rows[i]];
        own->r0[i] = solver->best.r[own->rows[i]];
    }
}

static perp_status set_up(perp_contact_solver *solver, perp__contact_apart *own)
{
    perp_contact_laws laws;

    perp_contact_laws_init(&laws, sizeof laws);
    laws.contacts = own->contacts;
    laws.dims = own->dims;
    laws.two_sided = own->two_sided;
    laws.mu = own->mu;
    laws.rolling = own->rolling;
    laws.spinning = own->spinning;
    laws.bilateral = own->bilateral;
    return perp__contact_set_up_inner(solver, &own->solver, &laws, own->size, own->W);
}

/* What was found to the whole: a proof, or impulses that are better than those of before. */
static void hand_back(perp_contact_solver *solver, perp__contact_apart *own,
                      const perp_contact_result *result)
{
    solver->iterations += result->iterations;
    if (!perp__is_good(result->outcome))
        solver->said = result->outcome;
    if (result->outcome == PERP_OUTCOME_STOPPED || result->outcome == PERP_OUTCOME_TIME_LIMIT)
        solver->ended = result->outcome;
    if (result->has_ray) {
        memset(solver->start, 0, (size_t)solver->size * sizeof *solver->start);
        for (int32_t i = 0; i < own->size; i++)
            solver->start[own->rows[i]] = own->ray[i];
        perp__contact_keep_ray(solver, solver->start);
    }
    if (!perp__is_good(result->outcome) && !(result->residual < own->least))
        return;
    own->least = result->residual;
    solver->running = result->method;
    for (int32_t i = 0; i < own->size; i++)
        solver->r[own->rows[i]] = own->r[i];
    for (int32_t i = 0; i < own->contacts; i++)
        solver->modes[own->numbers[i]] = (int8_t)own->modes[i];
}

/* From where the whole has brought it, then from the start that the caller gave. */
static perp_status solve_part(perp_contact_solver *solver, int32_t part)
{
    perp__contact_apart *own = &solver->apart;
    perp_contact_result result;
    perp__contact_call call = {.r = own->r,
                               .u = own->u,
                               .modes = own->modes,
                               .ray = own->ray,
                               .result = &result,
                               .q = own->q,
                               .r0 = own->r0};
    perp_status status = perp_contact_result_init(&result, sizeof result);

    list(solver, own, part);
    copy(solver, own);
    PERP__THEN(status, set_up(solver, own));
    own->least = solver->best.evidence[part].tested;
    for (int32_t attempt = 0; attempt < 2 && status == PERP_OK; attempt++) {
        if (solver->deadline > 0.0)
            own->solver->settings.time_limit = perp__time_left(solver->deadline);
        status = perp__contact_solve(own->solver, &call);
        if (status == PERP_OK)
            hand_back(solver, own, &result);
        if (status != PERP_OK || perp__is_good(result.outcome) || result.has_ray ||
            solver->ended >= 0)
            break;
        for (int32_t i = 0; i < own->size && solver->call->r0; i++)
            own->r0[i] = solver->call->r0[own->rows[i]];
        call.r0 = solver->call->r0 ? own->r0 : NULL;
    }
    return status;
}

perp_status perp__contact_solve_apart(perp_contact_solver *solver, int32_t *some)
{
    perp__contact_apart *own = &solver->apart;
    perp_status status;
    int32_t part, made = 1;

    if (solver->parts < 2 || solver->leaks || solver->settings.max_iterations > 0)
        return PERP_OK;
    own->room = 0;
    for (part = 0; part < solver->parts; part++) {
        const int32_t rows = is_solved(solver, part) ? 0 : count_rows(solver, part);

        own->room = rows <= PERP__APART_MOST && rows > own->room ? rows : own->room;
    }
    if (own->room == 0)
        return PERP_OK;
    status = perp__contact_delassus(solver, &made);
    own->size = solver->size;
    if (status == PERP_OK && made)
        status = perp__arena_fit(&own->arena, solver->context, lay_out, own);
    if (status != PERP_OK || !made)
        return status;
    *some = 1;
    memcpy(solver->r, solver->best.r, (size_t)solver->size * sizeof *solver->r);
    if (solver->contacts > 0)
        memcpy(solver->modes, solver->best.modes, (size_t)solver->contacts);
    for (part = 0; part < solver->parts && status == PERP_OK && solver->ended < 0; part++)
        if (!is_solved(solver, part) && count_rows(solver, part) <= own->room)
            status = solve_part(solver, part);
    return status;
}
