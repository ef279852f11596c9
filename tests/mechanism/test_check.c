/* Models against differences of their gaps: right ones pass, and each kind of wrong entry is named.
 */
#include "rig.h"

#include "memory.h"

#define ARM 0.7

/* A body with q = (x, y, cos a, sin a) and velocities (x', y', a'): an arm's end above a floor that
 * moves up and down, a two-sided guide through the origin at the body's angle, and a circle that
 * grows. */
typedef struct body {
    perp_context *context;
    perp_mechanism *mechanism;
    perp_mechanism_model model;
    perp_mechanism_check_result check;
    double H[12], drift[4], G[3], growth; /* added to what is right */
    double outside;                       /* x beyond this is undefined */
    int32_t aborts;
} body;

static int32_t contacts(double *gap, double *H, double *drift, double *mu, double t,
                        const double *q, void *user)
{
    const body *b = user;
    const double rows[12] = {
        0, 1, ARM * q[2], 1, 0, -ARM * q[3], q[3], -q[2], q[0] * q[2] + q[1] * q[3], q[2], q[3], 0};
    const double speeds[4] = {-cos(t), 0, 0, 0};

    (void)mu;
    if (b->aborts)
        return -3;
    if (q[0] > b->outside)
        return 1;
    gap[0] = q[1] + ARM * q[3] - sin(t);
    gap[1] = q[0] * q[3] - q[1] * q[2];
    for (int i = 0; i < 12; i++)
        H[i] = rows[i] + b->H[i];
    for (int i = 0; i < 4; i++)
        drift[i] = speeds[i] + b->drift[i];
    return 0;
}

static int32_t circle(double *c, double *G, double *drift, double t, const double *q, void *user)
{
    const body *b = user;

    c[0] = q[0] * q[0] + q[1] * q[1] - 1 - 0.3 * t;
    G[0] = 2 * q[0] + b->G[0];
    G[1] = 2 * q[1] + b->G[1];
    G[2] = b->G[2];
    drift[0] = -0.3 + b->growth;
    return 0;
}

static int32_t turn(double *rate, const double *q, const double *v, void *user)
{
    (void)user;
    rate[0] = v[0];
    rate[1] = v[1];
    rate[2] = -q[3] * v[2];
    rate[3] = q[2] * v[2];
    return 0;
}

static const double place[] = {0.9, 1.3, 0.8, 0.6}, speed[] = {0.1, -0.2, 0.3};
static const int32_t two_sided[] = {0, 1};

static void open_body(body *b, const perp_context_settings *settings)
{
    memset(b, 0, sizeof *b);
    b->outside = INFINITY;
    assert_int_equal(perp_context_create(&b->context, settings), PERP_OK);
    assert_int_equal(perp_mechanism_model_init(&b->model, sizeof b->model), PERP_OK);
    assert_int_equal(perp_struct_init(&b->check, sizeof b->check), PERP_OK);
    b->model.velocities = 3;
    b->model.coordinates = 4;
    b->model.contacts = 2;
    b->model.bilateral = 1;
    b->model.two_sided = two_sided;
    b->model.contact_rows = contacts;
    b->model.bilateral_rows = circle;
    b->model.kinematics = turn;
    b->model.user = b;
    assert_int_equal(perp_mechanism_create(b->context, &b->mechanism, NULL, &b->model), PERP_OK);
}

static void close_body(body *b)
{
    perp_mechanism_destroy(b->mechanism);
    perp_context_destroy(b->context);
}

static perp_status ask(body *b)
{
    return perp_mechanism_check(b->mechanism, &b->check, 0.4, place, speed);
}

static void test_right(void **state)
{
    body b;

    (void)state;
    open_body(&b, NULL);
    assert_int_equal(ask(&b), PERP_OK);
    assert_int_equal(b.check.wrong, 0);
    assert_int_equal(b.check.constant, 0);
    assert_int_equal(b.check.unchecked, 0);
    assert_true(b.check.part == -1 && b.check.index == -1 && b.check.row == -1);
    close_body(&b);
}

/* Off by 1e-4 of the row, which is ten times what is let through. */
static void test_each_entry(void **state)
{
    const struct {
        size_t at; /* of what is added to */
        int32_t part, index, row, column;
    } cases[] = {
        {offsetof(body, H[0]), PERP_MECHANISM_NORMAL, 0, 0, 0},
        {offsetof(body, H[2]), PERP_MECHANISM_NORMAL, 0, 0, 2},
        {offsetof(body, H[7]), PERP_MECHANISM_NORMAL, 1, 2, 1},
        {offsetof(body, H[8]), PERP_MECHANISM_NORMAL, 1, 2, 2},
        {offsetof(body, G[1]), PERP_MECHANISM_GRADIENT, 0, 4, 1},
        {offsetof(body, drift[0]), PERP_MECHANISM_DRIFT, 0, 0, -1},
        {offsetof(body, drift[2]), PERP_MECHANISM_DRIFT, 1, 2, -1},
        {offsetof(body, growth), PERP_MECHANISM_DRIFT, 0, 4, -1},
    };
    body b;

    (void)state;
    open_body(&b, NULL);
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        double *entry = (double *)(void *)((char *)&b + cases[k].at);

        *entry = 3e-4;
        assert_int_equal(ask(&b), PERP_OK);
        assert_int_equal(b.check.wrong, 1);
        assert_int_equal(b.check.part, cases[k].part);
        assert_int_equal(b.check.index, cases[k].index);
        assert_int_equal(b.check.row, cases[k].row);
        assert_int_equal(b.check.column, cases[k].column);
        /* 1e-9: what differences of numbers of size 1 know */
        assert_true(fabs(b.check.given - b.check.difference - 3e-4) < 1e-9);
        assert_true(b.check.uncertainty < 1e-7);
        *entry = 0;
    }
    b.H[3] = 7; /* tangents are no gradients, and their drift may be anything */
    b.drift[1] = 5;
    assert_int_equal(ask(&b), PERP_OK);
    assert_int_equal(b.check.wrong, 0);
    close_body(&b);
}

/* The tangent of the guide becomes 3 times its normal. */
static void test_tangent(void **state)
{
    const double normal[] = {0.6, -0.8, 0.9 * 0.8 + 1.3 * 0.6}, tangent[] = {0.8, 0.6, 0};
    body b;

    (void)state;
    open_body(&b, NULL);
    for (int i = 0; i < 3; i++)
        b.H[9 + i] = 3 * normal[i] - tangent[i];
    assert_int_equal(ask(&b), PERP_OK);
    assert_int_equal(b.check.wrong, 1);
    assert_int_equal(b.check.part, PERP_MECHANISM_TANGENT);
    assert_int_equal(b.check.index, 1);
    assert_int_equal(b.check.row, 3);
    assert_int_equal(b.check.column, -1);
    close_body(&b);
}

/* A point mass whose tangent is its normal again, written twice: one velocity can't be both, unless
 * it is the only one (a slider that comes to a floor at 45 degrees). */
static int32_t twice(double *gap, double *H, double *drift, double *mu, double t, const double *q,
                     void *user)
{
    const body *b = user;
    const int32_t n = b->model.velocities;

    (void)drift;
    (void)mu;
    (void)t;
    gap[0] = q[n - 1];
    H[n - 1] = 1;
    H[2 * n - 1] = b->H[0];
    return 0;
}

static void test_twice(void **state)
{
    const struct {
        int32_t n, wrong;
        double tangent;
    } cases[] = {{2, 1, 1}, {2, 1, -1}, {2, 0, 0.3}, {1, 0, 1}};

    (void)state;
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        body b;

        open_body(&b, NULL);
        perp_mechanism_destroy(b.mechanism);
        assert_int_equal(perp_mechanism_model_init(&b.model, sizeof b.model), PERP_OK);
        b.model.velocities = cases[k].n;
        b.model.contacts = 1;
        b.model.dim = 2;
        b.model.contact_rows = twice;
        b.model.user = &b;
        b.H[0] = cases[k].tangent;
        assert_int_equal(perp_mechanism_create(b.context, &b.mechanism, NULL, &b.model), PERP_OK);
        assert_int_equal(ask(&b), PERP_OK);
        assert_int_equal(b.check.wrong, cases[k].wrong);
        assert_int_equal(b.check.part, cases[k].wrong ? PERP_MECHANISM_TANGENT : -1);
        close_body(&b);
    }
}

/* Where one side is undefined nothing is said. */
static void test_edge(void **state)
{
    body b;

    (void)state;
    open_body(&b, NULL);
    b.outside = place[0];
    b.H[0] = 3;
    assert_int_equal(ask(&b), PERP_OK);
    assert_int_equal(b.check.wrong, 0);
    assert_int_equal(b.check.unchecked, 1);
    b.outside = 0;
    assert_int_equal(ask(&b), PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(b.context), "outside"));
    close_body(&b);
}

/* gap = |x| at its kink, and a gap that is one step's number. */
static int32_t kink(double *gap, double *H, double *drift, double *mu, double t, const double *q,
                    void *user)
{
    (void)drift;
    (void)mu;
    (void)t;
    (void)user;
    gap[0] = fabs(q[0]);
    gap[1] = 0.25;
    H[0] = H[1] = 1;
    return 0;
}

static void test_kink(void **state)
{
    const double zero = 0;
    body b;

    (void)state;
    open_body(&b, NULL);
    perp_mechanism_destroy(b.mechanism);
    assert_int_equal(perp_mechanism_model_init(&b.model, sizeof b.model), PERP_OK);
    b.model.velocities = 1;
    b.model.contacts = 2;
    b.model.dim = 1;
    b.model.contact_rows = kink;
    assert_int_equal(perp_mechanism_create(b.context, &b.mechanism, NULL, &b.model), PERP_OK);
    assert_int_equal(perp_mechanism_check(b.mechanism, &b.check, 0, &zero, &zero), PERP_OK);
    assert_int_equal(b.check.wrong, 0);
    assert_int_equal(b.check.constant, 1);
    close_body(&b);
}

static void test_refusals(void **state)
{
    perp_mechanism_check_result before;
    double bad[4];
    body b;

    (void)state;
    open_body(&b, NULL);
    memcpy(bad, place, sizeof bad);
    bad[2] = (double)NAN;
    before = b.check;
    assert_int_equal(perp_mechanism_check(NULL, &b.check, 0, place, speed), PERP_ERROR_HANDLE);
    assert_int_equal(perp_mechanism_check(b.mechanism, NULL, 0, place, speed), PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_mechanism_check(b.mechanism, &b.check, 0, NULL, speed),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_mechanism_check(b.mechanism, &b.check, 0, bad, speed),
                     PERP_ERROR_NOT_FINITE);
    b.aborts = 1;
    assert_int_equal(ask(&b), PERP_ERROR_CALLBACK);
    assert_memory_equal(&before, &b.check, sizeof before);
    close_body(&b);
}

static void test_memory(void **state)
{
    int k;

    (void)state;
    for (k = 1;; k++) {
        memory m = {0};
        const perp_context_settings settings = memory_settings(&m);
        perp_status status;
        int before;
        body b;

        open_body(&b, &settings);
        before = m.calls;
        m.fails_at = before + k;
        status = ask(&b);
        m.fails_at = 0;
        if (m.calls >= before + k) {
            assert_int_equal(status, PERP_ERROR_MEMORY);
            assert_int_equal(ask(&b), PERP_OK);
        }
        assert_int_equal(b.check.wrong, 0);
        close_body(&b);
        assert_int_equal(m.live, 0);
        if (status == PERP_OK)
            break;
    }
    assert_true(k > 2); /* the work and its room */
}

/* A ball above a floor, whose normal has this sign. */
static int32_t floor_rows(double *gap, double *H, double *drift, double *mu, double t,
                          const double *q, void *user)
{
    (void)drift;
    (void)mu;
    (void)t;
    gap[0] = q[0];
    H[0] = *(const double *)user;
    return 0;
}

static int32_t weight(double *k, double t, const double *q, const double *v, void *user)
{
    (void)t;
    (void)q;
    (void)v;
    (void)user;
    k[0] = -9.81;
    return 0;
}

/* From y = 1 or, in the floor, from y = -1/2 for a second. */
static int32_t fall(double sign, int32_t project, double overlap, double error, double y)
{
    const double zero = 0;
    perp_mechanism_model model = fresh_mechanism_model();
    perp_mechanism_settings settings = fresh_mechanism_settings();
    perp_mechanism_run_result result = fresh_mechanism_run_result();
    perp_mechanism *mechanism;
    perp_context *context;
    double v;

    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    model.velocities = model.contacts = model.dim = 1;
    model.contact_rows = floor_rows;
    model.force = weight;
    model.user = &sign;
    settings.project = project;
    settings.overlap = overlap;
    settings.error = error;
    settings.scheme = PERP_MECHANISM_THETA;
    assert_int_equal(perp_mechanism_create(context, &mechanism, &settings, &model), PERP_OK);
    assert_int_equal(
        perp_mechanism_run(mechanism, &y, &v, &result, START(0, 0.01, &y, &zero), 1, NULL, NULL),
        PERP_OK);
    assert_true(result.t == 1.0); /* it goes on */
    perp_mechanism_destroy(mechanism);
    perp_context_destroy(context);
    return result.outcome;
}

/* A ball that falls through its floor is no answer, unless that is what was asked for. theta
 * without projection ends up to h v inside. */
static void test_overlap(void **state)
{
    (void)state;
    for (int32_t k = 0; k < 2; k++) {
        const double error = k * 1e-6;

        assert_int_equal(fall(1, 1, 0, error, 1), PERP_OUTCOME_SOLVED);
        assert_int_equal(fall(-1, 1, 0, error, 1), PERP_OUTCOME_STALLED);
        assert_int_equal(fall(-1, 0, 0, error, 1), PERP_OUTCOME_SOLVED);
        assert_int_equal(fall(-1, 1, 10, error, 1), PERP_OUTCOME_SOLVED);
        assert_int_equal(fall(-1, 0, 3, error, 1), PERP_OUTCOME_STALLED); /* 1 - 9.81/2 = -3.9 */
        assert_int_equal(fall(1, 0, 0, error, -0.5), PERP_OUTCOME_SOLVED);
        assert_int_equal(fall(1, 0, 0.4, error, -0.5), PERP_OUTCOME_STALLED);
    }
}

/* Every machine at its start, where some are at a corner, and next to it. */
static void test_machines(void **state)
{
    (void)state;
    for (int32_t name = 0; name < MACHINES; name++)
        for (int32_t away = 0; away < 2; away++) {
            perp_mechanism_check_result check = fresh_mechanism_check_result();
            rig r;

            rig_open(&r, name);
            rig_start(&r);
            for (int32_t i = 0; i < MACHINE_ROOM && away; i++)
                r.q[i] += 0.013 * (i + 1);
            assert_int_equal(perp_mechanism_check(r.mechanism, &check, 0.1, r.q, r.v), PERP_OK);
            if (check.wrong || check.constant || check.unchecked)
                fail_msg("%s: %d wrong, %d constant, %d unchecked: part %d, row %d, column %d: "
                         "%.17g, not %.17g +- %.2g",
                         r.machine.name, check.wrong, check.constant, check.unchecked, check.part,
                         check.row, check.column, check.given, check.difference, check.uncertainty);
            rig_close(&r);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_right),    cmocka_unit_test(test_each_entry),
        cmocka_unit_test(test_tangent),  cmocka_unit_test(test_twice),
        cmocka_unit_test(test_edge),     cmocka_unit_test(test_kink),
        cmocka_unit_test(test_refusals), cmocka_unit_test(test_memory),
        cmocka_unit_test(test_overlap),  cmocka_unit_test(test_machines),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
