/* contact.h: a solver of the front door that is set up with bodies and rows as they are, no copy
 * but P = J C, and asked for no proofs. */
#include "contact/solver.h"

#include <math.h>
#include <string.h>

#include "linalg/doubled.h"
#include "linalg/lanes/multiversion.h"

/* ---- velocities ----
 *
 * Velocities of rigid bodies and of their contacts,
 *
 *   v = v_free + C C' J'r,     u = J v + bias,
 *
 * in doubled precision from the caller's rows and factors (products and their sums with the errors
 * beside them: Ogita, Rump & Oishi, SIAM J. Sci. Comput. 26 (2005) 1955). */
/* The velocity of what a constraint's side is on: NULL where that is the world at rest. v: of the
 * bodies; carriers have their own. */
PERP__KERNEL static const double *velocity_of(const perp__rigid_problem *p, int32_t body,
                                              const double *v)
{
    if (body < 0)
        return NULL;
    return (body < p->bodies ? v : p->free) + (size_t)body * (size_t)p->width;
}

/* u of row i of g, rounded once; v_low: what v lacks. *size, unless NULL: the size of its terms. */
PERP__KERNEL static double relative(int32_t width, const perp__rigid_problem *p,
                                    const perp__rigid_rows *g, int32_t i, const double *v,
                                    const double *v_low, double *size)
{
    double u = g->bias[i], error = 0.0, sum = fabs(u);

    for (int32_t side = 0; side < 2; side++) {
        const double *x = velocity_of(p, g->body[side], v), *J = g->rows[side][i];
        const double *low = v_low + (int64_t)g->body[side] * width;

        if (!x)
            continue;
        for (int32_t j = 0; j < width; j++)
            perp__accumulate(&u, &error, J[j], x[j]);
        for (int32_t j = 0; g->body[side] < p->bodies && j < width; j++)
            error += J[j] * low[j];
        for (int32_t j = 0; size && j < width; j++)
            sum += fabs(J[j] * x[j]);
    }
    if (size)
        *size = sum;
    return u + error;
}

PERP__MULTIVERSION(relative_doubled,
                   (const perp__rigid_problem *p, const double *v, const double *v_low, double *u,
                    double *sizes),
                   (p, v, v_low, u, sizes))
{
    for (int32_t k = 0; k < p->contacts + p->joints; k++)
        for (int32_t i = 0; i < p->rows[k].dim; i++) {
            double *size = sizes ? sizes++ : NULL;

            *u++ = p->width == 6 ? relative(6, p, &p->rows[k], i, v, v_low, size)
                                 : relative(p->width, p, &p->rows[k], i, v, v_low, size);
        }
}

void perp__rigid_load(perp_contact_solver *solver)
{
    const perp__rigid_problem *p = solver->rigid;

    perp__copy(solver->v, p->free, solver->n);
    if (solver->n > 0)
        memset(solver->v_low, 0, (size_t)solver->n * sizeof *solver->v_low);
    relative_doubled(p, solver->v, solver->v_low, solver->q, solver->load);
}

void perp__rigid_bias(const perp_contact_solver *solver, double *u)
{
    const perp__rigid_problem *p = solver->rigid;

    for (int32_t k = 0; k < p->contacts + p->joints; k++)
        for (int32_t i = 0; i < p->rows[k].dim; i++) {
            const perp__rigid_rows *g = &p->rows[k];
            double sum = g->bias[i];

            for (int32_t side = 0; side < 2; side++)
                for (int32_t j = 0; g->body[side] >= p->bodies && j < p->width; j++)
                    sum += g->rows[side][i][j] *
                           p->free[(size_t)g->body[side] * (size_t)p->width + (size_t)j];
            *u++ = sum;
        }
}

/* A carrier that does not move is as good as none. */
static int32_t root_of(const perp__rigid_problem *p, int32_t body)
{
    if (body < p->bodies) /* -1, or one that is of no account here */
        return PERP__RIGID_AT_REST;
    for (int32_t j = 0; j < p->width; j++)
        if (p->free[(size_t)body * (size_t)p->width + (size_t)j] != 0.0)
            return body;
    return PERP__RIGID_AT_REST;
}

/* Where a body is that moves as one with others: PERP__RIGID_FREE if it is with none. */
static int32_t place_of(const perp_contact_solver *solver, int32_t body)
{
    return perp__rigid_moves(solver->rigid, body) ? solver->hold.root[body]
                                                  : root_of(solver->rigid, body);
}

/* u of all rows after active.c has written v: exactly 0 where they hold, bias between bodies that
 * move as one, else from v. */
static void find_held_velocities(const perp_contact_solver *solver, const double *v, double *u)
{
    const perp__rigid_problem *p = solver->rigid;
    int32_t constraint = 0, row = 0;

    for (int32_t k = 0; k < p->contacts + p->joints; k++) {
        const perp__rigid_rows *g = &p->rows[k];
        const int32_t a = place_of(solver, g->body[0]);
        const bool is_one = a != PERP__RIGID_FREE && a == place_of(solver, g->body[1]);

        for (int32_t i = 0; i < g->dim; i++, row++) {
            const bool holds = k < p->contacts ? i < solver->hold.holds[constraint] : 1;

            u[row] = holds ? 0.0 : g->bias[i];
            for (int32_t side = 0; side < 2 && !holds && !is_one; side++) {
                const double *x = velocity_of(p, g->body[side], v);

                for (int32_t j = 0; x && j < p->width; j++)
                    u[row] += g->rows[side][i][j] * x[j];
            }
        }
        constraint += k < p->contacts ? 1 : g->dim;
    }
}

void perp__rigid_beside(const perp_contact_solver *solver, const int8_t *holds, int32_t *beside,
                        int8_t *pushed)
{
    const perp__rigid_problem *p = solver->rigid;
    int32_t constraint = 0;

    for (int32_t k = 0; k < p->contacts + p->joints; k++) {
        const perp__rigid_rows *g = &p->rows[k];
        const int32_t a = root_of(p, g->body[0]), b = root_of(p, g->body[1]);

        for (int32_t i = 0; i < (k < p->contacts ? 1 : g->dim); i++, constraint++) {
            const int32_t first = k < p->contacts ? 0 : i;

            beside[constraint] = a != PERP__RIGID_AT_REST ? a : b;
            pushed[constraint] = 0;
            for (int32_t j = first; j < first + holds[constraint]; j++)
                pushed[constraint] |= g->bias[j] != 0.0 && g->compliance[j] == 0.0;
        }
    }
}

/* out := C x or, transposed, C'x of every body; x + x_low and out + out_low. */
PERP__MULTIVERSION(apply,
                   (const perp__rigid_problem *p, int32_t transposed, const double *x,
                    const double *x_low, double *out, double *out_low),
                   (p, transposed, x, x_low, out, out_low))
{
    const int32_t width = p->width;
    const int32_t row = transposed ? 1 : width, column = transposed ? width : 1;
    const double *C = p->factors;

    for (int32_t b = 0; b < p->bodies; b++, C += width * width)
        for (int32_t i = 0; i < width; i++) {
            const size_t at = (size_t)b * (size_t)width;
            double sum = 0.0, error = 0.0;

            for (int32_t j = 0; j < width; j++) {
                perp__accumulate(&sum, &error, C[i * row + j * column], x[at + (size_t)j]);
                error += C[i * row + j * column] * x_low[at + (size_t)j];
            }
            perp__round_sum(&sum, &error);
            out[at + (size_t)i] = sum;
            out_low[at + (size_t)i] = error;
        }
}

/* sum + error += J_i r for the bodies of a contact or joint */
PERP__KERNEL static void push_rows(int32_t width, const perp__rigid_problem *p,
                                   const perp__rigid_rows *g, const double *r, double *sum,
                                   double *error)
{
    for (int32_t side = 0; side < 2; side++) {
        const int64_t at = (int64_t)g->body[side] * width;

        if (!perp__rigid_moves(p, g->body[side]))
            continue;
        for (int32_t i = 0; i < g->dim; i++)
            for (int32_t j = 0; j < width; j++)
                perp__accumulate(sum + at + j, error + at + j, g->rows[side][i][j], r[i]);
    }
}

PERP__MULTIVERSION(push,
                   (const perp__rigid_problem *p, const double *r, double *sum, double *error),
                   (p, r, sum, error))
{
    for (int32_t k = 0; k < p->contacts + p->joints; k++) {
        if (p->width == 6)
            push_rows(6, p, &p->rows[k], r, sum, error);
        else
            push_rows(p->width, p, &p->rows[k], r, sum, error);
        r += p->rows[k].dim;
    }
}

void perp__rigid_velocities(perp_contact_solver *solver)
{
    const perp__rigid_problem *p = solver->rigid;
    const size_t bytes = (size_t)solver->n * sizeof(double);

    if (bytes > 0) {
        memset(solver->push, 0, bytes);
        memset(solver->push_low, 0, bytes);
    }
    push(p, solver->r, solver->push, solver->push_low);
    apply(p, 1, solver->push, solver->push_low, solver->v, solver->v_low);
    apply(p, 0, solver->v, solver->v_low, solver->push, solver->push_low);
    for (int32_t i = 0; i < solver->n; i++) {
        solver->v[i] = p->free[i];
        solver->v_low[i] = solver->push_low[i];
        perp__accumulate(solver->v + i, solver->v_low + i, 1.0, solver->push[i]);
        perp__round_sum(solver->v + i, solver->v_low + i);
    }
    relative_doubled(p, solver->v, solver->v_low, solver->u, NULL);
    for (int32_t i = 0; solver->complies && i < solver->size; i++)
        solver->u[i] += solver->compliance[i] * solver->r[i];
}

/* ---- calls ---- */

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
        find_held_velocities(s, v, u);
    for (int32_t k = 0; status == PERP_OK && carrier && k < s->bodies.blocks; k++)
        carrier[k] = s->hold.root[k];
    return status;
}

static perp_status prepare(perp_contact_solver *s, const perp__rigid_problem *problem)
{
    const bool keeps = problem->again && s->entrance == PERP__ENTRANCE_RIGID;
    const perp_status status = keeps ? PERP_OK : set_up(s, problem);

    if (keeps)
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
