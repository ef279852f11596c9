#include "proximal_scene.h"

#include "contact/law.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

double proximal_entry(const proximal_scene *s, int32_t i, int32_t j)
{
    return s->W[j * s->size + i];
}

void proximal_add_contact(proximal_scene *s, int32_t dim, double mu)
{
    s->starts[s->contacts] = s->rows;
    s->dims[s->contacts] = dim;
    s->mu[s->contacts++] = mu;
    s->rows += dim;
    s->starts[s->contacts] = s->size = s->rows;
}

void proximal_set_traces(proximal_scene *s)
{
    memset(s->trace, 0, sizeof s->trace);
    for (int32_t k = 0; k < s->contacts; k++)
        for (int32_t i = s->starts[k]; i < s->starts[k + 1]; i++) {
            s->trace[k] += proximal_entry(s, i, i);
            s->constraint_of[i] = k;
        }
    for (int32_t i = s->rows; i < s->size; i++) {
        s->constraint_of[i] = s->contacts + i - s->rows;
        s->starts[s->constraint_of[i] + 1] = i + 1;
        s->trace[s->constraint_of[i]] = proximal_entry(s, i, i);
    }
}

void proximal_random_delassus(proximal_scene *s, gen_random *random, int32_t rank)
{
    double B[PROXIMAL_ROWS][PROXIMAL_ROWS];

    for (int32_t i = 0; i < s->size; i++)
        for (int32_t k = 0; k < rank; k++)
            B[i][k] = gen_dyadic(random, 2);
    for (int32_t i = 0; i < s->size; i++)
        for (int32_t j = 0; j < s->size; j++) {
            s->W[j * s->size + i] = 0.0;
            for (int32_t k = 0; k < rank; k++)
                s->W[j * s->size + i] += B[i][k] * B[j][k];
        }
    /* q = B v + (gap, 0, 0), gap >= 0: v = 0 then is admissible, so that a solution exists */
    for (int32_t i = 0; i < s->size; i++) {
        s->q[i] = 0.0;
        for (int32_t k = 0; k < rank; k++)
            s->q[i] += B[i][k] * ((k * 7 + 3) % 5 - 2.0);
    }
    for (int32_t k = 0; k < s->contacts; k++)
        s->q[s->starts[k]] += 0.25 * (k % 3);
    proximal_set_traces(s);
}

static void layout(perp__arena *arena, void *work)
{
    perp__contact_proximal.layout(arena, work);
}

static perp_status make_attempts(const perp__contact_problem *p, perp__contact_work *work,
                                 proximal_scene *s)
{
    int32_t last = s->last ? s->last : perp__contact_proximal.attempts - 1;
    perp__contact_iterate iterate;
    perp_status status = PERP_OK;

    memset(&iterate, 0, sizeof iterate);
    iterate.r = s->r;
    iterate.u = s->u;
    iterate.modes = s->modes;
    iterate.warm = iterate.given = s->warm;
    iterate.attempt = s->first;
    work->problem = p;
    s->iterations = 0;
    for (; status == PERP_OK && iterate.attempt <= last; iterate.attempt++) {
        status = perp__contact_proximal.solve(work, &iterate);
        s->outcome = iterate.outcome;
        s->iterations += iterate.iterations;
        if (s->outcome == PERP_OUTCOME_SOLVED)
            break;
    }
    return status;
}

perp_status proximal_run(const perp__contact_problem *given, proximal_scene *s)
{
    perp__contact_work *work = gen_allocate(1, perp__contact_proximal.work_size);
    perp__contact_problem whole = *given;
    const perp__contact_problem *p = &whole;
    perp_status status = perp__contact_proximal.check(p);
    double omega[PROXIMAL_ROWS], drive;
    perp__arena arena;

    perp__contact_omegas(p, NULL, 1, &drive, omega);
    whole.omega = omega;
    work->problem = p;
    memset(&arena, 0, sizeof arena);
    if (status == PERP_OK)
        status = perp__arena_fit(&arena, p->context, layout, work);
    if (status == PERP_OK)
        status = make_attempts(p, work, s);
    perp__contact_proximal.release(work);
    perp__arena_release(&arena);
    free(work);
    return status;
}

perp__contact_problem proximal_problem_of(perp_context *context, const proximal_scene *s,
                                          const perp__matrix *W)
{
    perp__contact_problem p;

    memset(&p, 0, sizeof p);
    p.context = context;
    p.contacts = s->contacts;
    p.rows = s->rows;
    p.size = s->size;
    p.starts = s->starts;
    p.constraint_of = s->constraint_of;
    p.dims = s->dims;
    p.mu = s->mu;
    p.trace = s->trace;
    p.q = s->q;
    p.W = W;
    p.tol = 1e-12;
    return p;
}

void proximal_compress(const proximal_scene *s, proximal_columns *c)
{
    int32_t at = 0;

    for (int32_t j = 0; j < s->size; j++) {
        c->starts[j] = at;
        for (int32_t i = 0; i < s->size; i++)
            if (proximal_entry(s, i, j) != 0.0) {
                c->rows[at] = i;
                c->values[at++] = proximal_entry(s, i, j);
            }
    }
    c->starts[s->size] = at;
    memset(&c->view, 0, sizeof c->view);
    c->view.rows = c->view.columns = s->size;
    c->view.values = c->values;
    c->view.column_starts = c->starts;
    c->view.row_indices = c->rows;
}

double proximal_violation(const proximal_scene *s)
{
    double omega = 0.0, worst = 0.0;

    for (int32_t k = 0; k < s->contacts; k++)
        for (int32_t i = s->starts[k]; i < s->starts[k + 1]; i++)
            omega = fmax(omega, fabs(s->q[i]) / sqrt(s->trace[k]));
    omega = omega > 0.0 ? omega : 1.0;
    for (int32_t k = 0; k < s->contacts; k++) {
        int32_t at = s->starts[k], d = s->dims[k];
        double root = sqrt(s->trace[k]);
        double normal = s->r[at] * root / omega, u[3] = {0.0, 0.0, 0.0}, power = 0.0;
        double force = 0.0, speed = 0.0;

        for (int32_t i = 0; i < d; i++) {
            u[i] = s->q[at + i];
            for (int32_t j = 0; j < s->size; j++)
                u[i] += proximal_entry(s, at + i, j) * s->r[j];
            u[i] /= root * omega;
        }
        for (int32_t i = 1; i < d; i++) {
            double r = s->r[at + i] * root / omega;

            force += r * r;
            speed += u[i] * u[i];
            power += r * u[i];
        }
        worst = fmax(worst, fmax(-normal, -u[0]));
        worst = fmax(worst, fabs(normal * u[0]));
        worst = fmax(worst, sqrt(force) - s->mu[k] * normal);
        /* maximal dissipation: r_t'u_t = -mu r_n |u_t| */
        worst = fmax(worst, fabs(power + s->mu[k] * normal * sqrt(speed)));
    }
    for (int32_t i = s->rows; i < s->size; i++) {
        double u = s->q[i];

        for (int32_t j = 0; j < s->size; j++)
            u += proximal_entry(s, i, j) * s->r[j];
        worst = fmax(worst, fabs(u) / sqrt(s->trace[s->contacts + i - s->rows]) / omega);
    }
    return worst;
}

void proximal_random_scene(proximal_scene *s, gen_random *random, int32_t contacts, double mu,
                           int32_t rank)
{
    memset(s, 0, sizeof *s);
    for (int32_t k = 1 + gen_integer(random, contacts); k > 0; k--) {
        const double mus[4] = {0.0, 0.3, 0.7, 1.0};

        proximal_add_contact(s, 1 + gen_integer(random, 3), mu * mus[gen_integer(random, 4)]);
    }
    s->size += gen_integer(random, 3);
    proximal_random_delassus(s, random, rank);
}
