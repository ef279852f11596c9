/* Compliant contacts in time: the lead screw of docs/friction.md, whose times are those of
 * another integrator (DOP853 at 1e-11); refusals and memory. */
#include "screw.h"

#include "memory.h"

/* From th' = 10 with normal force N0, until it stops. */
static perp_compliant_result run_screw(screw *s, double N0, double stiffness, double *N, double tol)
{
    const double lead = pi / 36;
    const double x0[] = {0, -N0 / stiffness / cos(lead)}, v0[] = {10, r * tan(lead) * 10};
    perp_compliant_settings settings = fresh_compliant_settings();
    perp_compliant_result result = fresh_compliant_result();
    double x[2], v[2];

    settings.tol = tol;
    assert_int_equal(perp_compliant_run(s->compliant, x, v, N, &result, &settings, x0, v0, 0.05),
                     PERP_OK);
    assert_int_equal(result.end, PERP_COMPLIANT_STOPPED);
    assert_int_equal(result.contact, 0);
    assert_true(fabs(r * v[0] * cos(lead) + v[1] * sin(lead)) < 1e-14);
    return result;
}

/* On either side of the unstable answer N2 = -69.5: to the stable branch, or into a jam. */
static void test_separatrix(void **state)
{
    const double N2 = -69.547005614481321;
    perp_compliant_result result;
    double N;
    screw s;

    (void)state;
    start_screw(&s, 0, 1e9, 1e4);
    result = run_screw(&s, N2 * 1.001, 1e9, &N, 1e-10);
    assert_near(result.t, 0.0016688277341284424, 1e-7); /* errors grow by exp(5500 t) = 1e4 */
    assert_near(N, -414.00176012844025, 1e-6);
    result = run_screw(&s, N2 * 0.999, 1e9, &N, 1e-10);
    assert_near(result.t, 0.0038314914522984463, 1e-6);
    assert_near(N, 21.30728861514737, 1e-4);
    assert_near(result.least_normal, -69.47745860886684, 1e-6);
    finish_screw(&s);
}

/* T < T*: no rigid acceleration. The stiffer, the sooner it jams. */
static void test_jam_times(void **state)
{
    const double expected[] = {0.0011570925232247487, 0.0005817584394053737,
                               0.00025261941824126355};
    double N, last = 0, stiffness = 1e8;
    screw s;
    int k;

    (void)state;
    for (k = 0; k < 3; k++, stiffness *= 10) {
        start_screw(&s, -0.1, stiffness, 0);
        assert_near(run_screw(&s, -1, stiffness, &N, 1e-9).t, expected[k], 1e-7);
        finish_screw(&s);
    }
    /* With a normal force that grows like the root of the stiffness, so that the impulse in it is
     * always the same, the rate is 1/2 up to the ratio of the constant force to it. */
    for (k = 0, stiffness = 1e10; k < 4; k++, stiffness *= 100) {
        double t;

        start_screw(&s, -0.1, stiffness, 0);
        t = run_screw(&s, -sqrt(stiffness / 1e8), stiffness, &N, 1e-9).t;
        if (k > 1)
            assert_true(fabs(log10(last / t) / 2 - 0.5) < (k == 2 ? 0.02 : 0.004));
        last = t;
        finish_screw(&s);
    }
}

/* A mass that slides over a spring at rest: N stays mg, so it stops after v / (mu g). */
static void test_constant_load(void **state)
{
    const double mass[] = {2, 0, 0, 2}, normal[] = {0, -1}, tangent[] = {1, 0}, force[] = {0, -20};
    const double coefficient = 0.25, stiffness = 1e6, x0[] = {0, -20 / 1e6}, v0[] = {-3, 0};
    perp_matrix view[3];
    perp_compliant_system system = fresh_compliant_system();
    perp_compliant_result result = fresh_compliant_result();
    perp_compliant *compliant;
    perp_context *context;
    double x[2], v[2], N;
    int k;

    (void)state;
    for (k = 0; k < 3; k++)
        perp_struct_init(&view[k], sizeof view[k]);
    perp_matrix_dense(&view[0], PERP_STORAGE_ROW_MAJOR, 2, 2, mass, 2);
    perp_matrix_dense(&view[1], PERP_STORAGE_ROW_MAJOR, 1, 2, normal, 2);
    perp_matrix_dense(&view[2], PERP_STORAGE_ROW_MAJOR, 1, 2, tangent, 2);
    system.n = 2;
    system.contacts = 1;
    system.mass = &view[0];
    system.normal = &view[1];
    system.tangent = &view[2];
    system.force = force;
    system.mu = &coefficient;
    system.stiffness = stiffness;
    system.damping = 100;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    assert_int_equal(perp_compliant_create(context, &compliant, &system), PERP_OK);
    assert_int_equal(perp_compliant_run(compliant, x, v, &N, &result, NULL, x0, v0, 0.5), PERP_OK);
    assert_int_equal(result.end, PERP_COMPLIANT_TIME);
    assert_true(result.t == 0.5);
    assert_near(v[0], -3 + 2.5 * 0.5, 1e-12);
    assert_int_equal(perp_compliant_run(compliant, x, v, &N, &result, NULL, x0, v0, 9), PERP_OK);
    assert_int_equal(result.end, PERP_COMPLIANT_STOPPED);
    assert_near(result.t, 1.2, 1e-12);
    assert_near(x[0], -1.8, 1e-12);
    assert_near(N, 20, 1e-9); /* a rounding of x is stiffness x eps */
    perp_compliant_destroy(compliant);
    perp_context_destroy(context);
}

/* ---- refusals and memory ------------------------------------------------------------------- */

static void test_refusals(void **state)
{
    const double x0[] = {0, 0}, v0[] = {1, 0}, still[] = {0, 0};
    const int32_t plus = 1, two = 2, none = 0;
    perp_compliant_stability stability = fresh_compliant_stability();
    perp_compliant_settings settings = fresh_compliant_settings();
    perp_compliant_result result = fresh_compliant_result();
    perp_compliant *other = NULL;
    double x[2] = {7, 7}, v[2];
    screw s;

    (void)state;
    start_screw(&s, 0, 1e9, 1e4);
    s.mu = -1;
    assert_int_equal(perp_compliant_create(s.context, &other, &s.system), PERP_ERROR_ARGUMENT);
    s.mu = NAN;
    assert_int_equal(perp_compliant_create(s.context, &other, &s.system), PERP_ERROR_NOT_FINITE);
    s.mu = 0.2;
    s.values[0] = -1;
    assert_int_equal(perp_compliant_create(s.context, &other, &s.system), PERP_ERROR_ARGUMENT);
    s.values[0] = J;
    s.system.n = 0;
    assert_int_equal(perp_compliant_create(s.context, &other, &s.system), PERP_ERROR_ARGUMENT);
    s.system.n = 2;
    s.system.stiffness = -1;
    assert_int_equal(perp_compliant_create(s.context, &other, &s.system), PERP_ERROR_ARGUMENT);
    assert_null(other);
    assert_int_equal(perp_compliant_linearise(s.compliant, &stability, NULL, NULL, &two, &plus),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_compliant_linearise(s.compliant, &stability, NULL, NULL, &plus, &none),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_compliant_run(s.compliant, x, v, NULL, &result, NULL, x0, still, 1),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_compliant_run(s.compliant, x, v, NULL, &result, NULL, x0, v0, -1),
                     PERP_ERROR_ARGUMENT);
    settings.tol = 0;
    assert_int_equal(perp_compliant_run(s.compliant, x, v, NULL, &result, &settings, x0, v0, 1),
                     PERP_ERROR_ARGUMENT);
    settings.tol = 1e-6;
    assert_true(x[0] == 7);
    settings.most_steps = 3;
    assert_int_equal(perp_compliant_run(s.compliant, x, v, NULL, &result, &settings, x0, v0, 1),
                     PERP_OK);
    assert_int_equal(result.end, PERP_COMPLIANT_STEPS);
    assert_int_equal(result.steps, 3);
    finish_screw(&s);
}

/* Runs ask for no memory. */
static perp_status everything(const perp_context_settings *settings)
{
    const memory *used = settings->allocator_user;
    screw s = {0};
    perp_status status = perp_context_create(&s.context, settings);

    describe_screw(&s, 0, 1e9, 1e4);
    if (status == PERP_OK)
        status = perp_compliant_create(s.context, &s.compliant, &s.system);
    if (status == PERP_OK) {
        const int before = used->calls;
        double N;

        (void)run_screw(&s, -1, 1e9, &N, 1e-4);
        assert_int_equal(used->calls, before);
    }
    finish_screw(&s);
    return status;
}

static void test_memory(void **state)
{
    (void)state;
    memory_fails_anywhere(everything, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_separatrix),    cmocka_unit_test(test_jam_times),
        cmocka_unit_test(test_constant_load), cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_memory),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
