/* Method sweep by itself: closed forms, the law checked row by row on piles in body space and on W,
 * high piles, warm starts, limits, determinism. */
#include "sweep_fixture.h"

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
        bodies_load(&f.bodies, f.p.f, f.p.w, NULL, f.q);
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

/* Piles at rest, whatever their height, order and mass ratio: a few sweeps show that they come to
 * rest, and statics decides it. Alone, sweeps carry the news of the load through a pile of n layers
 * in the order of n^2 of them. */
static void test_high_piles(void **state)
{
    (void)state;
    for (int32_t k = 0; k < 6; k++) {
        const perp_contact_settings settings = piles_settings(PERP_CONTACT_METHOD_SWEEP, 1e-4);
        piles_options options = piles_defaults();
        perp_contact_result result = fresh_contact_result();
        double *v, *r;
        piles p;

        options.class = k % 2 ? PILES_TOWER : PILES_COLUMN;
        options.layers = k < 4 ? 10 : 40;
        options.contacts = k % 2 ? 36 * options.layers - 24 : 4 * options.layers;
        options.shuffled = k / 2 % 2;
        options.mass_ratio = k < 4 ? 1.0 : 10.0;
        piles_make(&p, &options);
        v = gen_allocate((size_t)p.n, sizeof *v);
        r = gen_allocate((size_t)p.rows, sizeof *r);
        assert_int_equal(piles_solve(context, &p, &settings, &result, v, r, NULL, NULL), PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
        assert_in_range(result.iterations, 1, 50); /* the first two looks */
        for (int32_t i = 0; i < p.n; i++)
            assert_true(v[i] == 0.0);
        free(v);
        free(r);
        piles_destroy(&p);
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

/* The limit and the monitor. */
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
        cmocka_unit_test(test_piles),      cmocka_unit_test(test_slope),
        cmocka_unit_test(test_high_piles), cmocka_unit_test(test_warm_start),
        cmocka_unit_test(test_stops),      cmocka_unit_test(test_determinism)};

    return cmocka_run_group_tests(tests, make, destroy);
}
