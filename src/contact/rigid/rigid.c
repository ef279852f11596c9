/* contact.h: a solver of the front door that is set up with bodies and rows as they are, no copy
 * but P = J C, and asked for no proofs. */
#include "contact/solver.h"

static void read_bounds(perp_contact_solver *s, const perp__rigid_problem *problem)
{
    for (int32_t k = 0; k < problem->contacts && s->has_bounds; k++)
        s->bound[k] = problem->rows[k].bounded
                          ? -problem->rows[k].bias[0] / problem->rows[k].compliance[0]
                          : 0.0;
}

static perp_status set_up(perp_contact_solver *s, const perp__rigid_problem *problem)
{
    perp_status status;

    s->entrance = PERP__NO_PROBLEM;
    s->rigid = problem;
    status = perp__bodies_setup_rigid(&s->bodies, problem);
    if (status != PERP_OK)
        return status;
    s->has_bodies = 1;
    s->contacts = problem->contacts;
    s->size = s->bodies.size;
    s->rows = s->bodies.rows[problem->contacts];
    s->constraints = s->bodies.constraints;
    s->n = s->bodies.n;
    s->setups++;
    status = perp__arena_fit_sizes(
        &s->arena, s->context, perp__contact_lay_out, s, s->fitted,
        (size_t[]){(size_t)s->contacts, (size_t)s->size, (size_t)s->constraints, (size_t)s->n}, 4);
    if (status != PERP_OK)
        return status;
    /* what laws are to the public entrance */
    s->rolls = s->spins = s->complies = s->has_discs = s->holds_both = s->has_bounds = 0;
    s->starts[0] = 0;
    for (int32_t k = 0; k < problem->contacts; k++) {
        s->dims[k] = problem->rows[k].dim;
        s->two_sided[k] = 0;
        s->mu[k] = problem->rows[k].dim > 1 ? problem->rows[k].mu : 0.0;
        s->starts[k + 1] = s->starts[k] + s->dims[k];
        s->has_bounds |= problem->rows[k].bounded;
    }
    read_bounds(s, problem);
    for (int32_t i = 0; i < s->size; i++) {
        s->compliance[i] = s->bodies.compliance[i];
        s->complies |= s->compliance[i] > 0.0;
    }
    status = perp__contact_finish_setup(s);
    if (status == PERP_OK)
        s->entrance = PERP__ENTRANCE_RIGID;
    return status;
}

/* 3 a contact or joint to the rows that there are, or back; what is missing is 0. */
static void pack(const perp__rigid_problem *problem, const double *from, double *rows)
{
    for (int32_t k = 0; k < problem->contacts + problem->joints; k++)
        for (int32_t i = 0; i < problem->rows[k].dim; i++)
            *rows++ = from[3 * (size_t)k + (size_t)i];
}

static void unpack(const perp__rigid_problem *problem, const double *rows, double *to)
{
    for (int32_t k = 0; k < problem->contacts + problem->joints; k++)
        for (int32_t i = 0; i < 3; i++)
            *to++ = i < problem->rows[k].dim ? *rows++ : 0.0;
}

/* Velocities of the rows that hold, and, unless NULL, which body moves with which. */
static perp_status hold(perp_contact_solver *s, double *r, double *u, const int8_t *modes,
                        double *v, int32_t *carrier)
{
    perp_status status = perp__contact_hold(s, r, u, modes, v);

    if (status == PERP_OK)
        perp__rigid_held_velocities(s, v, u);
    for (int32_t k = 0; status == PERP_OK && carrier && k < s->bodies.blocks; k++)
        carrier[k] = s->hold.root[k];
    return status;
}

static perp_status prepare(perp_contact_solver *s, const perp__rigid_problem *problem)
{
    const int32_t keeps = problem->again && s->entrance == PERP__ENTRANCE_RIGID;
    const perp_status status = keeps ? PERP_OK : set_up(s, problem);

    read_bounds(s, problem);
    s->rigid = problem;
    s->bodies.C = problem->factors;
    s->bodies.v_free = problem->free;
    s->proves = 0;
    s->quick = problem->quick;
    s->enough = problem->enough;
    s->settings.method = perp__contact_method_named(problem->method);
    s->settings.cone = problem->cone;
    s->settings.tol = problem->tol;
    s->settings.max_iterations = problem->max_iterations;
    return status;
}

perp_status perp__rigid_solve(perp_contact_solver *s, perp__rigid_answer *answer,
                              const perp__rigid_problem *problem)
{
    perp__contact_candidate *best = &s->best;
    perp__contact_call call = {0};
    perp_status status = prepare(s, problem);

    if (status == PERP_OK && problem->warm) {
        pack(problem, problem->warm, s->warm);
        call.r0 = s->warm;
    }
    PERP__THEN(status, perp__contact_find(s, &call, problem->deadline));
    if (status == PERP_OK && problem->holds)
        status = hold(s, best->r, best->u, best->modes, s->best_v, answer->carrier);
    else if (status == PERP_OK && perp__is_good(best->outcome))
        perp__contact_write_zeros(s, best->modes, best->u);
    s->rigid = NULL;
    s->call = NULL;
    if (status != PERP_OK)
        return status;
    unpack(problem, best->r, answer->impulse);
    if (answer->velocity)
        unpack(problem, best->u, answer->velocity);
    perp__copy(answer->v, s->best_v, s->n);
    for (int32_t k = 0; answer->modes && k < problem->contacts; k++)
        answer->modes[k] = best->modes[k];
    answer->outcome = best->outcome;
    answer->iterations = s->iterations;
    answer->tested = best->residuals.tested;
    answer->own_residual = best->residuals.own_residual;
    answer->backward = best->residuals.backward;
    return PERP_OK;
}

perp_status perp__rigid_hold(perp_contact_solver *s, perp__rigid_answer *answer,
                             const perp__rigid_problem *problem)
{
    perp__contact_call call = {0};
    perp_status status = prepare(s, problem);

    s->call = &call;
    PERP__THEN(status, perp__contact_load(s));
    if (status == PERP_OK) {
        pack(problem, answer->impulse, s->r);
        for (int32_t k = 0; k < problem->contacts; k++)
            s->modes[k] = (int8_t)answer->modes[k];
        perp__rigid_velocities(s);
        status = hold(s, s->r, s->u, s->modes, s->v, answer->carrier);
    }
    if (status == PERP_OK && answer->velocity)
        unpack(problem, s->u, answer->velocity);
    if (status == PERP_OK)
        perp__copy(answer->v, s->v, s->n);
    s->rigid = NULL;
    s->call = NULL;
    return status;
}
