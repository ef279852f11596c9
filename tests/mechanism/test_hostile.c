/* Finite numbers that overflow together, or vanish: an outcome, or a refusal with a message, and
 * nothing that is not finite on the way out. */
#include "rig.h"

#include "gen.h"

/* ---- random mechanisms over a palette ------------------------------------------------------ */

enum { N = 3, CONTACTS = 2, ROWS = 6, MODELS = 400 };

typedef struct hostile {
    perp_context *context;
    perp_mechanism *mechanism;
    perp_mechanism_model model;
    perp_mechanism_settings settings;
    double M[N * N], k[N], H[ROWS * N], gap[CONTACTS], drift[ROWS], mu[CONTACTS], e[CONTACTS];
    double h, q[N], v[N];
} hostile;

static double number(gen_random *random)
{
    static const double palette[] = {0.0,    1e-300, 1e300, 1e154, 1e-154, 1e308,
                                     5e-324, 1e-12,  1e12,  1e16,  1e100,  1.7e308};
    const double sign = gen_uniform(random, 0.0, 1.0) < 0.5 ? -1.0 : 1.0;

    if (gen_uniform(random, 0.0, 1.0) < 0.6)
        return gen_uniform(random, -1.0, 1.0);
    return sign * palette[(int)gen_uniform(random, 0.0, 11.999)];
}

static double positive(gen_random *random)
{
    const double x = fabs(number(random));

    return x > 0.0 ? x : 1.0;
}

static int32_t mass(double *M, const double *q, void *user)
{
    (void)q;
    memcpy(M, ((const hostile *)user)->M, sizeof((hostile *)user)->M);
    return 0;
}

static int32_t force(double *k, double t, const double *q, const double *v, void *user)
{
    (void)t;
    (void)q;
    (void)v;
    memcpy(k, ((const hostile *)user)->k, sizeof((hostile *)user)->k);
    return 0;
}

static int32_t rows(double *gap, double *H, double *drift, double *mu, double t, const double *q,
                    void *user)
{
    const hostile *m = user;

    (void)mu;
    (void)t;
    (void)q;
    memcpy(gap, m->gap, sizeof m->gap);
    memcpy(H, m->H, sizeof m->H);
    memcpy(drift, m->drift, sizeof m->drift);
    return 0;
}

static void fill(hostile *m, gen_random *random)
{
    int32_t i;

    for (i = 0; i < N; i++) {
        m->M[i * (N + 1)] = positive(random);
        m->k[i] = number(random);
        m->q[i] = number(random);
        m->v[i] = number(random);
    }
    for (i = 0; i < ROWS * N; i++)
        m->H[i] = number(random);
    for (i = 0; i < ROWS; i++)
        m->drift[i] = i % 2 ? number(random) : 0.0;
    for (i = 0; i < CONTACTS; i++) {
        m->gap[i] = i % 2 ? number(random) : 0.0;
        m->mu[i] = fabs(number(random));
        m->e[i] = gen_uniform(random, -1.0, 1.0);
        m->e[i] = m->e[i] < 0.0 ? 0.0 : m->e[i];
    }
    m->h = gen_uniform(random, 0.0, 1.0) < 0.7 ? 0.01 : positive(random);
}

/* Whether the mechanism was taken. memory: NULL, or where it comes from. */
static int32_t start_in(hostile *m, gen_random *random, int32_t k,
                        const perp_context_settings *memory)
{
    memset(m, 0, sizeof *m);
    fill(m, random);
    assert_int_equal(perp_context_create(&m->context, memory), PERP_OK);
    assert_int_equal(perp_mechanism_model_init(&m->model, sizeof m->model), PERP_OK);
    assert_int_equal(perp_mechanism_settings_init(&m->settings, sizeof m->settings), PERP_OK);
    m->model.velocities = N;
    m->model.contacts = CONTACTS;
    m->model.dim = 1 + k % 3;
    m->model.mu = m->model.dim > 1 ? m->mu : NULL;
    m->model.restitution = m->e;
    m->model.mass = mass;
    m->model.force = force;
    m->model.contact_rows = rows;
    m->model.user = m;
    m->settings.scheme = k / 3 % 3;
    m->settings.law = (k / 9 + k / 54) % 4;
    m->settings.cone = k / 27 % 2 ? 4 : 0;
    m->settings.select = k / 54 % 3;
    m->settings.most_patterns = 1000;
    m->settings.tol = k % 5 == 0 ? 1e-18 : 1e-10;
    if (perp_mechanism_create(m->context, &m->mechanism, &m->settings, &m->model) == PERP_OK)
        return 1;
    assert_true(strlen(perp_context_message(m->context)) > 0);
    perp_context_destroy(m->context);
    return 0;
}

static int32_t start(hostile *m, gen_random *random, int32_t k)
{
    return start_in(m, random, k, NULL);
}

static void is_finite(const double *x, int32_t count, const char *what, int32_t k)
{
    int32_t i;

    for (i = 0; i < count; i++)
        if (!isfinite(x[i]))
            fail_msg("model %d: %s[%d] is %g", (int)k, what, (int)i, x[i]);
}

static void try_step(hostile *m, int32_t k)
{
    const double untouched = 12345.0;
    const int32_t count = CONTACTS * m->model.dim;
    double q[N], v[N], impulse[ROWS], velocity[ROWS];
    perp_mechanism_step step = fresh_mechanism_step();
    perp_status status;

    q[0] = v[0] = impulse[0] = velocity[0] = untouched;
    status = perp_mechanism_advance(m->mechanism, q, v, impulse, velocity, NULL, NULL, &step,
                                    START(0.0, m->h, m->q, m->v));
    if (status != PERP_OK) {
        assert_true(strlen(perp_context_message(m->context)) > 0);
        assert_true(q[0] == untouched && v[0] == untouched && impulse[0] == untouched &&
                    velocity[0] == untouched);
        return;
    }
    is_finite(q, N, "q", k);
    is_finite(v, N, "v", k);
    is_finite(impulse, count, "impulse", k);
    is_finite(velocity, count, "velocity", k);
    if (step.outcome == PERP_OUTCOME_SOLVED && !(step.residual <= m->settings.tol))
        fail_msg("model %d: solved with residual %g", (int)k, step.residual);
}

static void try_run(hostile *m, int32_t k)
{
    perp_mechanism_run_result result = fresh_mechanism_run_result();
    double q[N], v[N];

    if (perp_mechanism_run(m->mechanism, q, v, &result, START(0.0, m->h, m->q, m->v), 3.0 * m->h,
                           NULL, NULL) != PERP_OK)
        return;
    is_finite(q, N, "q of the run", k);
    is_finite(v, N, "v of the run", k);
    if (result.outcome == PERP_OUTCOME_SOLVED && !(result.residual <= m->settings.tol))
        fail_msg("model %d: a run is solved with residual %g", (int)k, result.residual);
}

static void try_accelerations(hostile *m, int32_t answers, int32_t k)
{
    perp_mechanism_summary summary = fresh_mechanism_summary();
    perp_mechanism_found found = fresh_mechanism_found();
    const int32_t count = CONTACTS * m->model.dim;
    int32_t i;

    if ((answers
             ? perp_mechanism_answers(m->mechanism, &summary, 0.0, m->h, m->q, m->v)
             : perp_mechanism_accelerations(m->mechanism, &summary, 0.0, m->q, m->v)) != PERP_OK) {
        assert_true(strlen(perp_context_message(m->context)) > 0);
        return;
    }
    for (i = 0; i < summary.count; i++) {
        assert_int_equal(perp_mechanism_get_acceleration(m->mechanism, &found, i), PERP_OK);
        is_finite(found.acceleration, N, "acceleration", k);
        is_finite(found.force, count, "force", k);
        is_finite(found.row_acceleration, count, "row_acceleration", k);
        is_finite(found.vertices, found.vertex_count * count, "vertices", k);
        if (!(found.residual <= 1e-8)) /* that of families; most have 1e-15 */
            fail_msg("model %d: an answer has the residual %g", (int)k, found.residual);
        if (found.stable)
            is_finite(found.eigenvalues, 2 * found.eigenvalue_count, "eigenvalues", k);
    }
}

/* Twice: the handle serves after a refusal. */
static void test_palette(void **state)
{
    gen_random random;
    int32_t k, round;
    hostile m;

    (void)state;
    gen_seed(&random, 10);
    for (k = 0; k < MODELS; k++) {
        if (!start(&m, &random, k))
            continue;
        for (round = 0; round < 2; round++) {
            try_step(&m, k);
            try_accelerations(&m, 0, k);
            try_accelerations(&m, 1, k);
        }
        try_run(&m, k);
        m.settings.error = 1e-3;
        assert_int_equal(perp_mechanism_set(m.mechanism, &m.settings), PERP_OK);
        try_run(&m, k);
        perp_mechanism_destroy(m.mechanism);
        perp_context_destroy(m.context);
    }
}

/* Memory that is full of these bytes. */
static void *allocate_filled(size_t size, void *user)
{
    void *block = malloc(size);

    if (block)
        memset(block, *(const int *)user, size);
    return block;
}

static void release_filled(void *pointer, void *user)
{
    (void)user;
    free(pointer);
}

/* What was in memory before has no say in a run in chosen steps, even where its steps are taken
 * though their problems are not solved. */
static void test_memory_has_no_say(void **state)
{
    static const int bytes[] = {0, 2, 0x55};

    (void)state;
    for (int32_t k = 0; k < MODELS; k++) {
        double q[3][N], v[3][N];
        perp_mechanism_run_result result[3];
        perp_status status[3] = {PERP_ERROR_ARGUMENT, PERP_ERROR_ARGUMENT, PERP_ERROR_ARGUMENT};

        memset(q, 0, sizeof q);
        memset(v, 0, sizeof v);
        for (int32_t i = 0; i < 3; i++) {
            int byte = bytes[i];
            perp_context_settings memory = fresh_context_settings();
            gen_random random;
            hostile m;

            memory.allocate = allocate_filled;
            memory.release = release_filled;
            memory.allocator_user = &byte;
            gen_seed(&random, (uint64_t)k);
            if (!start_in(&m, &random, k, &memory))
                break;
            m.settings.error = 1e-3;
            assert_int_equal(perp_mechanism_set(m.mechanism, &m.settings), PERP_OK);
            assert_int_equal(perp_struct_init(&result[i], sizeof *result), PERP_OK);
            status[i] = perp_mechanism_run(m.mechanism, q[i], v[i], &result[i],
                                           START(0.0, m.h, m.q, m.v), 3.0 * m.h, NULL, NULL);
            result[i].seconds = 0.0;
            perp_mechanism_destroy(m.mechanism);
            perp_context_destroy(m.context);
            assert_int_equal(status[i], status[0]);
            assert_memory_equal(q[i], q[0], sizeof *q);
            assert_memory_equal(v[i], v[0], sizeof *v);
            if (status[0] == PERP_OK)
                assert_memory_equal(&result[i], &result[0], sizeof *result);
        }
    }
}

/* A force of 1e160 holds a weight of 1 on a lever of 1e-160: the acceleration is 0. But the
 * effective inverse inertia, 1e-320, has four digits, and the force no more: nothing is found, and
 * it isn't said that there is nothing. */
static void test_vanishing_inertia(void **state)
{
    perp_mechanism_summary summary = fresh_mechanism_summary();
    gen_random random;
    hostile m;
    int32_t i;

    (void)state;
    gen_seed(&random, 10);
    assert_true(start(&m, &random, 0));
    memset(m.M, 0, sizeof m.M);
    memset(m.H, 0, sizeof m.H);
    memset(m.drift, 0, sizeof m.drift);
    for (i = 0; i < N; i++) {
        m.M[i * (N + 1)] = 1.0;
        m.k[i] = -1.0;
        m.q[i] = m.v[i] = 0.0;
    }
    m.gap[0] = 0.0;
    m.gap[1] = 1.0;
    m.H[0] = 1e-160;
    m.H[N + 1] = 1.0;
    assert_int_equal(perp_mechanism_accelerations(m.mechanism, &summary, 0.0, m.q, m.v), PERP_OK);
    assert_int_equal(summary.closed, 1);
    assert_int_equal(summary.count, 0);
    assert_int_equal(summary.exhaustive, 0);
    perp_mechanism_destroy(m.mechanism);
    perp_context_destroy(m.context);
}

/* ---- compliant contacts -------------------------------------------------------------------- */

/* A unit mass on a spring along x. */
static perp_status make_spring(perp_context *context, perp_compliant **made, double normal,
                               double stiffness)
{
    static const double one[] = {1.0}, none[] = {0.0};
    perp_compliant_system system = fresh_compliant_system();
    perp_matrix mass_view, normal_view, tangent_view;

    mass_view = matrix_rows(one, 1, 1);
    normal_view = matrix_rows(&normal, 1, 1);
    tangent_view = matrix_rows(none, 1, 1);
    system.n = system.contacts = 1;
    system.mass = &mass_view;
    system.normal = &normal_view;
    system.tangent = &tangent_view;
    system.mu = none;
    system.stiffness = stiffness;
    return perp_compliant_create(context, made, &system);
}

static void test_compliant(void **state)
{
    static const double starts[][3] = {/* x, v, span */
                                       {1e300, 0.0, 1.0},     {0.0, 1e308, 1e10},
                                       {1e308, 1e308, 1e300}, {0.0, 1e-300, 1e-300},
                                       {1.0, 0.0, 1e-308},    {0.0, 1e300, 1.0}};
    perp_compliant_result result = fresh_compliant_result();
    perp_compliant *spring = NULL;
    perp_context *context;
    size_t k;

    (void)state;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    assert_int_equal(make_spring(context, &spring, 1e200, 1.0), PERP_ERROR_NOT_FINITE);
    assert_int_equal(make_spring(context, &spring, 1.0, 1e10), PERP_OK);
    for (k = 0; k < sizeof starts / sizeof *starts; k++) {
        double x = 7.0, v = 7.0, force_there = 7.0;
        const perp_status status = perp_compliant_run(spring, &x, &v, &force_there, &result, NULL,
                                                      &starts[k][0], &starts[k][1], starts[k][2]);

        if (status != PERP_OK)
            assert_true(x == 7.0 && v == 7.0 && force_there == 7.0);
        is_finite(&x, 1, "x", (int32_t)k);
        is_finite(&v, 1, "v", (int32_t)k);
        is_finite(&force_there, 1, "N", (int32_t)k);
    }
    perp_compliant_destroy(spring);
    perp_context_destroy(context);
}

/* ---- bristles ------------------------------------------------------------------------------ */

static void test_bristles(void **state)
{
    double next = 7.0, given = 7.0, slope = 7.0;
    int32_t passive;
    perp_bristle law = fresh_bristle();

    (void)state;
    law.kinetic = law.breakaway = 1.0;
    law.stiffness = 1.0;
    law.viscosity = 1e300;
    assert_int_equal(perp_stribeck_force(NULL, &given, &slope, &law, 1e300), PERP_ERROR_NOT_FINITE);
    assert_int_equal(perp_lugre_force(NULL, &given, &slope, &law, 0.0, 1e300),
                     PERP_ERROR_NOT_FINITE);
    assert_int_equal(perp_lugre_step(NULL, &next, &given, &slope, &law, 0.0, 1e300, 1.0),
                     PERP_ERROR_NOT_FINITE);
    assert_true(next == 7.0 && given == 7.0 && slope == 7.0);
    /* stiffness |v| overflows, stiffness |v| h / kinetic is 1e-100: the bristles follow, z = v h */
    law.viscosity = 0.0;
    law.kinetic = law.breakaway = law.stiffness = 1e200;
    assert_int_equal(perp_lugre_step(NULL, &next, &given, NULL, &law, 0.0, 1e200, 1e-300), PERP_OK);
    near(next, 1e-100, 1e-114, "z");
    near(given, 0.5e100, 1e86, "mean force");
    /* 1e-400 is less than 2e-400 */
    law.kinetic = 1e-200;
    law.breakaway = 3e-200;
    law.speed = 1.0;
    law.viscosity = law.damping = 1e-200;
    assert_int_equal(perp_lugre_passive(NULL, &passive, &law), PERP_OK);
    assert_int_equal(passive, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_palette),           cmocka_unit_test(test_memory_has_no_say),
        cmocka_unit_test(test_vanishing_inertia), cmocka_unit_test(test_compliant),
        cmocka_unit_test(test_bristles),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
