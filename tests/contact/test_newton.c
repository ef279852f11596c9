/* Method `newton` by its inner interface: closed forms, random scenes checked from the law itself,
 * and everything a Delassus matrix may be: dense, sparse, unsymmetric, rank-deficient. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "contact/method.h"
#include "gen.h"

#define MOST 64 /* rows */

/* A problem with room for its solution. W is dense, column by column. */
typedef struct scene {
    int32_t contacts, rows, size;
    int32_t starts[MOST + 1], dims[MOST];
    double mu[MOST], trace[MOST], q[MOST], W[MOST * MOST];
    double r[MOST], u[MOST];
    int8_t modes[MOST];
    perp_outcome outcome;
    int64_t iterations;
} scene;

static perp_context *context;

static int make(void **state)
{
    (void)state;
    return perp_context_create(&context, NULL);
}

static int destroy(void **state)
{
    (void)state;
    perp_context_destroy(context);
    return 0;
}

static double entry(const scene *s, int32_t i, int32_t j)
{
    return s->W[j * s->size + i];
}

static void add_contact(scene *s, int32_t dim, double mu)
{
    s->starts[s->contacts] = s->rows;
    s->dims[s->contacts] = dim;
    s->mu[s->contacts++] = mu;
    s->rows += dim;
    s->starts[s->contacts] = s->size = s->rows;
}

static void set_traces(scene *s)
{
    memset(s->trace, 0, sizeof s->trace);
    for (int32_t k = 0; k < s->contacts; k++)
        for (int32_t i = s->starts[k]; i < s->starts[k + 1]; i++)
            s->trace[k] += entry(s, i, i);
    for (int32_t i = s->rows; i < s->size; i++)
        s->trace[s->contacts + i - s->rows] = entry(s, i, i);
}

/* W = B B' with B size by `rank` of random dyadic numbers: exactly symmetric and of that rank. */
static void random_delassus(scene *s, gen_random *random, int32_t rank)
{
    double B[MOST][MOST];

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
    set_traces(s);
}

static void layout(perp__arena *arena, void *work)
{
    perp__contact_newton.layout(arena, work);
}

static perp_status attempt_all(const perp__contact_problem *p, scene *s, int32_t warm)
{
    perp__contact_iterate iterate;
    perp__arena arena;
    perp__contact_work *work = gen_allocate(1, perp__contact_newton.work_size);
    perp_status status;

    memset(&iterate, 0, sizeof iterate);
    iterate.r = s->r;
    iterate.u = s->u;
    iterate.modes = s->modes;
    iterate.warm = warm;
    work->problem = p;
    perp__arena_init(&arena, p->context);
    status = perp__contact_newton.check(p);
    if (status == PERP_OK)
        status = perp__arena_fit(&arena, layout, work);
    s->iterations = 0;
    for (; status == PERP_OK && iterate.attempt < perp__contact_newton.attempts;
         iterate.attempt++) {
        status = perp__contact_newton.solve(work, &iterate);
        s->outcome = iterate.outcome;
        s->iterations += iterate.iterations;
        if (s->outcome == PERP_OUTCOME_SOLVED)
            break;
    }
    perp__contact_newton.release(work);
    perp__arena_release(&arena);
    free(work);
    return status;
}

static perp__contact_problem problem_of(const scene *s, const perp__matrix *W)
{
    perp__contact_problem p;

    memset(&p, 0, sizeof p);
    p.context = context;
    p.contacts = s->contacts;
    p.rows = s->rows;
    p.size = s->size;
    p.starts = s->starts;
    p.dims = s->dims;
    p.mu = s->mu;
    p.trace = s->trace;
    p.q = s->q;
    p.W = W;
    p.tol = 1e-8;
    return p;
}

static void solve(scene *s)
{
    perp__matrix W = {s->size, s->size, 1, (size_t)s->size, s->W, NULL, NULL};
    perp__contact_problem p = problem_of(s, &W);

    assert_int_equal(attempt_all(&p, s, 0), PERP_OK);
    assert_int_equal(s->outcome, PERP_OUTCOME_SOLVED);
}

/* How far (r, u) are from the laws of Signorini and Coulomb, as written in a textbook: products of
 * impulse and velocity in the units of q^2 / trace, the rest in those of q / sqrt(trace). */
static double violation(const scene *s)
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
                u[i] += entry(s, at + i, j) * s->r[j];
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
            u += entry(s, i, j) * s->r[j];
        worst = fmax(worst, fabs(u) / sqrt(s->trace[s->contacts + i - s->rows]) / omega);
    }
    return worst;
}

/* One particle of mass 1/2 on a plane, W = 2 I: u = 2 r + q in every mode. */
static void test_one_particle_in_every_mode(void **state)
{
    static const struct {
        double mu, q[3], r[3];
        int mode;
    } cases[] = {
        {0.5, {1.0, 3.0, 4.0}, {0.0, 0.0, 0.0}, PERP_CONTACT_SEPARATE},
        {0.5, {-2.0, 0.3, -0.4}, {1.0, -0.15, 0.2}, PERP_CONTACT_STICK},
        /* r_n = 1, r_t = -mu q_t / |q_t| */
        {0.5, {-2.0, 3.0, 4.0}, {1.0, -0.3, -0.4}, PERP_CONTACT_SLIP},
        {2.5, {-2.0, -6.0, 8.0}, {1.0, 1.5, -2.0}, PERP_CONTACT_SLIP},
    };

    (void)state;
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        scene s;

        memset(&s, 0, sizeof s);
        add_contact(&s, 3, cases[k].mu);
        for (int32_t i = 0; i < 3; i++) {
            s.W[4 * i] = 2.0;
            s.q[i] = cases[k].q[i];
        }
        set_traces(&s);
        solve(&s);
        assert_int_equal(s.modes[0], cases[k].mode);
        for (int32_t i = 0; i < 3; i++)
            assert_true(fabs(s.r[i] - cases[k].r[i]) <= 1e-14);
    }
}

/* Random low-rank problems with contacts of every kind and bilateral rows. A product of two numbers
 * of size up to a few hundred and of the solution's 1e-13 stays below 1e-10. */
static void test_laws_hold_on_random_problems(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 11);
    for (int trial = 0; trial < 200; trial++) {
        scene s;

        memset(&s, 0, sizeof s);
        for (int32_t k = 1 + gen_integer(&random, 8); k > 0; k--) {
            static const double mus[4] = {0.0, 0.3, 0.7, 1.0};

            add_contact(&s, 1 + gen_integer(&random, 3), mus[gen_integer(&random, 4)]);
        }
        s.size += gen_integer(&random, 3);
        random_delassus(&s, &random, 6 + gen_integer(&random, 12));
        solve(&s);
        assert_true(violation(&s) <= 1e-10);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_one_particle_in_every_mode, make, destroy),
        cmocka_unit_test_setup_teardown(test_laws_hold_on_random_problems, make, destroy),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
