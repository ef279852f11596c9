/* Method sweep by itself: closed forms, the law checked row by row on piles in body space and on W,
 * warm starts, limits, discs, bilateral rows, determinism. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "contact/bodies.h"
#include "contact/method.h"
#include "piles.h"

enum { SEPARATE, STICK, SLIP };

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

/* A problem with its arrays, and one run of the method on it. */
typedef struct fixture {
    piles p;
    perp__bodies bodies;
    perp__contact_problem problem;
    perp__contact_iterate iterate;
    perp__matrix W;
    int32_t *starts, *W_starts, *W_rows;
    double *W_values, *trace, *q, *r, *u;
    int8_t *modes;
} fixture;

static void prepare(fixture *f, int32_t contacts, int32_t size)
{
    f->problem.context = context;
    f->problem.contacts = contacts;
    f->problem.rows = f->problem.size = size;
    f->problem.starts = f->starts;
    f->problem.tol = 1e-8;
    f->trace = gen_allocate((size_t)size, sizeof(double));
    f->q = gen_allocate((size_t)size, sizeof(double));
    f->r = gen_allocate((size_t)size, sizeof(double));
    f->u = gen_allocate((size_t)size, sizeof(double));
    f->modes = gen_allocate((size_t)contacts, 1);
    f->problem.trace = f->trace;
    f->problem.q = f->q;
    f->iterate.r = f->r;
    f->iterate.u = f->u;
    f->iterate.modes = f->modes;
}

static void begin(fixture *f, const piles_options *options)
{
    perp__matrix M, H;
    perp__bodies_input input;
    int32_t suits;
    int64_t entries;

    memset(f, 0, sizeof *f);
    piles_make(&f->p, options);
    f->starts = gen_allocate((size_t)f->p.contacts + 1, sizeof *f->starts);
    for (int32_t k = 0; k < f->p.contacts; k++)
        f->starts[k + 1] = f->starts[k] + f->p.dims[k];
    prepare(f, f->p.contacts, f->p.rows);
    assert_int_equal(perp__matrix_read(context, "M", &M, &f->p.M), PERP_OK);
    assert_int_equal(perp__matrix_read(context, "H", &H, &f->p.H), PERP_OK);
    memset(&input, 0, sizeof input);
    input.n = f->p.n;
    input.contacts = f->p.contacts;
    input.size = f->p.rows;
    input.starts = f->starts;
    input.M = &M;
    input.H = &H;
    perp__bodies_init(&f->bodies, context);
    assert_int_equal(perp__bodies_setup(&f->bodies, &input, &suits), PERP_OK);
    assert_true(suits);
    perp__bodies_load(&f->bodies, f->p.f, f->p.w, NULL, f->q);
    perp__bodies_traces(&f->bodies, f->trace);
    entries = perp__bodies_delassus_entries(&f->bodies);
    f->W_starts = gen_allocate((size_t)f->p.rows + 1, sizeof *f->W_starts);
    f->W_rows = gen_allocate((size_t)entries, sizeof *f->W_rows);
    f->W_values = gen_allocate((size_t)entries, sizeof *f->W_values);
    perp__bodies_delassus(&f->bodies, f->W_starts, f->W_rows, f->W_values);
    f->W.rows = f->W.columns = f->p.rows;
    f->W.column_starts = f->W_starts;
    f->W.row_indices = f->W_rows;
    f->W.values = f->W_values;
    f->problem.dims = f->p.dims;
    f->problem.mu = f->p.mu;
    f->problem.bodies = &f->bodies;
}

static void end(fixture *f)
{
    piles_destroy(&f->p);
    perp__bodies_release(&f->bodies);
    free(f->starts);
    free(f->W_starts);
    free(f->W_rows);
    free(f->W_values);
    free(f->trace);
    free(f->q);
    free(f->r);
    free(f->u);
    free(f->modes);
}

static perp_outcome run(fixture *f)
{
    perp__arena arena;
    perp__contact_work *work = gen_allocate(1, perp__contact_sweep.work_size);

    work->problem = &f->problem;
    perp__arena_init(&arena, context);
    assert_int_equal(perp__contact_sweep.check(&f->problem), PERP_OK);
    assert_int_equal(perp__arena_fit(&arena, perp__contact_sweep.layout, work), PERP_OK);
    assert_int_equal(perp__contact_sweep.solve(work, &f->iterate), PERP_OK);
    perp__arena_release(&arena);
    free(work);
    return f->iterate.outcome;
}

/* W r + q from W's columns. */
static void velocities(const fixture *f, double *u)
{
    memcpy(u, f->q, (size_t)f->problem.size * sizeof *u);
    for (int32_t j = 0; j < f->problem.size; j++)
        for (int32_t k = f->W.column_starts[j]; k < f->W.column_starts[j + 1]; k++)
            u[f->W.row_indices[k]] += f->W.values[k] * f->r[j];
}

/* The law, contact by contact, in units of omega = max |q_k| / sqrt(t_k). */
static double law(const fixture *f)
{
    double *u = gen_allocate((size_t)f->problem.size, sizeof *u), omega = 0.0, worst = 0.0;

    velocities(f, u);
    for (int32_t k = 0; k < f->problem.contacts; k++) {
        double sum = 0.0;

        for (int32_t i = f->starts[k]; i < f->starts[k + 1]; i++)
            sum += f->q[i] * f->q[i];
        omega = fmax(omega, sqrt(sum / f->trace[k]));
    }
    for (int32_t k = 0; k < f->problem.contacts; k++) {
        const double t = f->trace[k], root = sqrt(t), mu = f->problem.mu[k];
        const double *r = f->r + f->starts[k], *v = u + f->starts[k];
        double friction = 0.0, length = 0.0, speed = 0.0, error;

        for (int32_t i = 1; i < f->problem.dims[k]; i++) {
            length += r[i] * r[i];
            speed += v[i] * v[i];
            friction += r[i] * v[i];
        }
        length = sqrt(length);
        speed = sqrt(speed);
        assert_true(r[0] >= 0.0 && length <= mu * r[0] * (1 + 1e-14));
        error = fabs(fmin(r[0] * root, v[0] / root));
        /* |r_t - P(r_t - u_t / t)| of the disc of radius mu r_n is at most these two */
        if (f->problem.dims[k] > 1)
            error = fmax(error, fmin(speed / root,
                                     (friction + mu * r[0] * speed) / (speed / root + 1e-300)));
        worst = fmax(worst, error / omega);
    }
    free(u);
    return worst;
}

static void start_cold(fixture *f)
{
    memset(f->r, 0, (size_t)f->problem.size * sizeof *f->r);
    f->iterate.warm = 0;
}

/* Each class at rest and hit, in body space, with W as CSC and dense: solved, and lawful. */
static void test_piles(void **state)
{
    (void)state;
    for (int32_t k = 0; k < 3 * PILES_CLASSES; k++) {
        piles_options options = piles_defaults();
        fixture f;
        double *dense;

        options.class = k % PILES_CLASSES;
        options.layers = 3;
        options.motion = k / PILES_CLASSES;
        options.dim = k == 2 ? 0 : 3;
        options.mu = k == 4 ? -1 : 0.4;
        options.seed = (uint64_t)k + 1;
        begin(&f, &options);
        assert_int_equal(run(&f), PERP_OUTCOME_SOLVED);
        assert_true(f.iterate.residual <= f.problem.tol);
        assert_true(f.iterate.has_modes);
        /* the parts of the law are no larger than a few times the natural map */
        assert_true(law(&f) <= 4 * f.problem.tol);
        f.problem.W = &f.W;
        f.problem.bodies = NULL;
        start_cold(&f);
        assert_int_equal(run(&f), PERP_OUTCOME_SOLVED);
        assert_true(law(&f) <= 4 * f.problem.tol);
        f.iterate.warm = 1; /* from its own solution: a sweep to see it */
        assert_int_equal(run(&f), PERP_OUTCOME_SOLVED);
        assert_in_range(f.iterate.iterations, 1, 3);
        dense = gen_allocate((size_t)f.p.rows * (size_t)f.p.rows, sizeof *dense);
        for (int32_t j = 0; j < f.p.rows; j++)
            for (int32_t i = f.W_starts[j]; i < f.W_starts[j + 1]; i++)
                dense[j * f.p.rows + f.W_rows[i]] = f.W_values[i];
        f.W.column_starts = f.W.row_indices = NULL;
        f.W.row_stride = 1;
        f.W.column_stride = (size_t)f.p.rows;
        f.W.values = dense;
        start_cold(&f);
        assert_int_equal(run(&f), PERP_OUTCOME_SOLVED);
        f.W.column_starts = f.W_starts;
        f.W.row_indices = f.W_rows;
        f.W.values = f.W_values;
        assert_true(law(&f) <= 4 * f.problem.tol);
        free(dense);
        end(&f);
    }
}

/* A block on a slope, pushed by gravity for one step: four feet share the load. On tan = 0.4 it
 * sticks with mu = 0.5 and slips with mu = 0.3, by (0.4 - 0.3) cos g h along the slope. */
static void test_slope(void **state)
{
    const double slope = 0.4, cosine = 1 / sqrt(1 + slope * slope), h = 0.01, g = 9.81;

    (void)state;
    for (int32_t slips = 0; slips < 2; slips++) {
        piles_options options = piles_defaults();
        fixture f;
        double normal = 0.0;

        options.contacts = 4;
        options.layers = 1;
        options.moved = 0;
        options.mu = slips ? 0.3 : 0.5;
        begin(&f, &options);
        f.p.f[2] *= cosine; /* f = m g h along the ground's normal; turned by the slope */
        f.p.f[0] = -f.p.f[2] * slope;
        perp__bodies_load(&f.bodies, f.p.f, f.p.w, NULL, f.q);
        f.problem.tol = 1e-12;
        assert_int_equal(run(&f), PERP_OUTCOME_SOLVED);
        for (int32_t k = 0; k < 4; k++) {
            const double speed = hypot(f.u[3 * k + 1], f.u[3 * k + 2]);

            /* where the feet stick, one of them may use all of its friction and not move */
            assert_true(f.modes[k] == SLIP || (!slips && f.modes[k] == STICK));
            /* omega is of the order of g h = 0.1: 1e-12 of that, a few times over */
            assert_true(fabs(speed - slips * (slope - 0.3) * cosine * g * h) <= 1e-11);
            normal += f.r[3 * k];
        }
        assert_true(fabs(normal - cosine * g * h) <= 1e-11); /* mass 1 */
        end(&f);
    }
}

/* One contact that rolls and spins, W = I: three discs of radius coefficient * r_n. */
static void test_discs(void **state)
{
    static const double q[6] = {-2, 3, 0, 0.25, 0.25, -4};
    const double mu = 0.5, rolling = 0.25, spinning = 0.125;
    const int32_t dims = 3;
    double identity[36] = {0};
    fixture f;

    (void)state;
    memset(&f, 0, sizeof f);
    f.starts = gen_allocate(2, sizeof *f.starts);
    f.starts[1] = 6;
    prepare(&f, 1, 6);
    f.problem.dims = &dims;
    f.problem.mu = &mu;
    f.problem.rolling = &rolling;
    f.problem.spinning = &spinning;
    f.problem.has_discs = 1;
    f.trace[0] = 6;
    memcpy(f.q, q, sizeof q);
    for (int32_t i = 0; i < 6; i++)
        identity[7 * i] = 1.0;
    f.W.rows = f.W.columns = 6;
    f.W.row_stride = 6;
    f.W.column_stride = 1;
    f.W.values = identity;
    f.problem.W = &f.W;
    assert_int_equal(run(&f), PERP_OUTCOME_SOLVED);
    assert_true(f.r[0] == 2.0);
    assert_true(f.r[1] == -1.0 && f.r[2] == 0.0);    /* slips: mu r_n = 1 < 3 */
    assert_true(f.r[3] == -0.25 && f.r[4] == -0.25); /* 0.354 < rolling r_n = 0.5 */
    assert_true(f.r[5] == 0.25 && f.u[5] == -3.75);  /* spins */
    assert_int_equal(f.modes[0], SLIP);
    end(&f);
}

/* A bilateral row beside a contact: W = [[2, 1], [1, 2]], u_0 perp r_0, u_1 = 0. */
static void test_bilateral(void **state)
{
    static const double W[4] = {2, 1, 1, 2};
    const int32_t dims = 1;
    const double mu = 0.0;
    fixture f;

    (void)state;
    memset(&f, 0, sizeof f);
    f.starts = gen_allocate(2, sizeof *f.starts);
    f.starts[1] = 1;
    prepare(&f, 1, 2);
    f.problem.rows = 1;
    f.problem.tol = 1e-14;
    f.problem.dims = &dims;
    f.problem.mu = &mu;
    f.trace[0] = f.trace[1] = 2;
    f.q[0] = -1;
    f.q[1] = 4;
    f.W.rows = f.W.columns = 2;
    f.W.row_stride = 2;
    f.W.column_stride = 1;
    f.W.values = W;
    f.problem.W = &f.W;
    assert_int_equal(run(&f), PERP_OUTCOME_SOLVED);
    assert_true(fabs(f.r[0] - 2.0) <= 1e-13 && fabs(f.r[1] + 3.0) <= 1e-13); /* 2 r0 + r1 = 1 */
    end(&f);
}

/* Piles at rest, whatever their height: settling level by level is nearly the solution. */
static void test_high_piles(void **state)
{
    (void)state;
    for (int32_t k = 0; k < 6; k++) {
        piles_options options = piles_defaults();
        fixture f;

        options.class = k % 2 ? PILES_TOWER : PILES_COLUMN;
        options.layers = k < 4 ? 10 : 40;
        options.contacts = k % 2 ? 36 * options.layers - 24 : 4 * options.layers;
        options.shuffled = k / 2 % 2;
        options.mass_ratio = k < 4 ? 1.0 : 1e4;
        begin(&f, &options);
        f.problem.tol = 1e-4;
        assert_int_equal(run(&f), PERP_OUTCOME_SOLVED);
        assert_in_range(f.iterate.iterations, 1, 10); /* hundreds without */
        assert_true(law(&f) <= 4 * f.problem.tol);
        end(&f);
    }
}

/* A start that the caller gives is where it begins; body space and W agree on the way. */
static void test_warm_start(void **state)
{
    piles_options options = piles_defaults();
    fixture f;

    (void)state;
    options.class = PILES_WALL;
    options.layers = 3;
    options.motion = PILES_IMPACT;
    begin(&f, &options);
    assert_int_equal(run(&f), PERP_OUTCOME_SOLVED);
    for (int32_t i = 0; i < f.p.rows; i++)
        f.q[i] *= 1.0 + 2e-5 * sin(i);
    f.iterate.warm = 1;
    f.problem.tol = 1e-4; /* more than the change of q */
    assert_int_equal(run(&f), PERP_OUTCOME_SOLVED);
    assert_in_range(f.iterate.iterations, 1, 3);
    end(&f);
}

static int32_t count_ticks(void *user, int64_t iterations, double residual)
{
    (void)residual;
    ++*(int32_t *)user;
    return iterations == 3;
}

/* The limit, the monitor, and a problem without a solution: two walls that close. */
static void test_stops(void **state)
{
    piles_options options = piles_defaults();
    int32_t ticks = 0;
    perp__contact_control control = {0.0, count_ticks, &ticks};
    fixture f;

    (void)state;
    options.contacts = 120;
    options.motion = PILES_IMPACT;
    begin(&f, &options);
    f.problem.iteration_limit = 5;
    assert_int_equal(run(&f), PERP_OUTCOME_ITERATION_LIMIT);
    assert_int_equal(f.iterate.iterations, 5);
    assert_true(isfinite(f.iterate.residual) && f.iterate.residual > 1e-8);
    f.problem.control = &control;
    start_cold(&f);
    assert_int_equal(run(&f), PERP_OUTCOME_STOPPED);
    assert_int_equal(ticks, 3);
    end(&f);
}

static void test_no_solution(void **state)
{
    static const double W[4] = {1, -1, -1, 1};
    static const double mu[2] = {0, 0};
    static const int32_t dims[2] = {1, 1};
    fixture f;

    (void)state;
    memset(&f, 0, sizeof f);
    f.starts = gen_allocate(3, sizeof *f.starts);
    f.starts[1] = 1;
    f.starts[2] = 2;
    prepare(&f, 2, 2);
    f.problem.dims = dims;
    f.problem.mu = mu;
    f.trace[0] = f.trace[1] = 1;
    f.q[0] = f.q[1] = -1;
    f.W.rows = f.W.columns = 2;
    f.W.row_stride = 2;
    f.W.column_stride = 1;
    f.W.values = W;
    f.problem.W = &f.W;
    assert_int_equal(run(&f), PERP_OUTCOME_STALLED);
    assert_false(f.iterate.has_modes);
    assert_true(isfinite(f.r[0]) && isfinite(f.r[1]));
    end(&f);
}

static void test_determinism(void **state)
{
    piles_options options = piles_draw(31, 200);
    fixture f, g;

    (void)state;
    begin(&f, &options);
    begin(&g, &options);
    f.problem.iteration_limit = g.problem.iteration_limit = 50;
    run(&f);
    run(&g);
    run(&g);
    assert_int_equal(f.iterate.iterations, g.iterate.iterations);
    assert_memory_equal(f.u, g.u, (size_t)f.problem.size * sizeof *f.u);
    end(&f);
    end(&g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_piles),       cmocka_unit_test(test_slope),
        cmocka_unit_test(test_discs),       cmocka_unit_test(test_bilateral),
        cmocka_unit_test(test_stops),       cmocka_unit_test(test_no_solution),
        cmocka_unit_test(test_determinism), cmocka_unit_test(test_high_piles),
        cmocka_unit_test(test_warm_start),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
