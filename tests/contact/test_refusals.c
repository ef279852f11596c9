/* Every refusal of contact.h: the status, a message that names argument and index, outputs
 * untouched, and a solver that works as before. */
#include <math.h>
#include <stdio.h>

#include "suite.h"

#include "hand_over.h"
#include "refused.h"

#include "context.h"

enum { N = 5, CONTACTS = 2 };

typedef struct call {
    hand_over p;
    double r0[HAND_SIZE], rolling[CONTACTS], spinning[CONTACTS], compliance[HAND_SIZE];
    int32_t starts[N + 1], rows[N * N];
    const double *start;
} call;

static void prepare(call *c)
{
    memset(c, 0, sizeof *c);
    hand_make(&c->p, 3, N, CONTACTS, 3, 1, 1.0);
}

static perp_status run(call *c)
{
    return hand_solve(&c->p, context, c->start);
}

/* The call is refused with the status and a message that holds the words. */
static void require(call *c, perp_status status, const char *words, const char *changes)
{
    const hand_over before = c->p;

    refused(context, run(c), status, words, changes);
    assert_memory_equal(before.r, c->p.r, sizeof before.r);
    assert_memory_equal(before.v, c->p.v, sizeof before.v);
    assert_memory_equal(&before.result, &c->p.result, sizeof before.result);
    /* and what is good still works */
    prepare(c);
    assert_int_equal(run(c), PERP_OK);
    assert_string_equal(perp_context_message(context), "");
    prepare(c);
}

/* That is what these changes of a good call c make of it. */
#define REFUSED(status, words, ...)               \
    do {                                          \
        __VA_ARGS__;                              \
        require(&c, status, words, #__VA_ARGS__); \
    } while (0)

static void test_laws(void **state)
{
    call c;

    (void)state;
    prepare(&c);
    REFUSED(ARGUMENT, "laws.contacts is -1", c.p.laws.contacts = -1);
    REFUSED(ARGUMENT, "laws.bounded is -1", c.p.laws.bounded = -1);
    REFUSED(ARGUMENT, "laws.bilateral is -1", c.p.laws.bilateral = -1);
    REFUSED(ARGUMENT, "laws.bilateral is 2, but G has 1 rows", c.p.laws.bilateral = 2);
    REFUSED(ABI, "laws.struct_size", c.p.laws.struct_size = 3);
    REFUSED(ARGUMENT, "laws.dims[1] is 4", c.p.dims[1] = 4);
    REFUSED(ARGUMENT, "laws.dims[1] is 0", c.p.dims[1] = 0);
    REFUSED(ARGUMENT, "laws.dim is 7", c.p.laws.dims = NULL; c.p.laws.dim = 7);
    REFUSED(ARGUMENT, "H has 6 rows, but the contacts have 5", c.p.dims[1] = 2);
    REFUSED(ARGUMENT, "laws.mu[1] is -0.5", c.p.mu[1] = -0.5);
    REFUSED(NOT_FINITE, "laws.mu[0] is nan", c.p.mu[0] = NAN);
    REFUSED(NOT_FINITE, "laws.mu[0] is inf", c.p.mu[0] = INFINITY);
    REFUSED(ARGUMENT, "laws.rolling[1] is -1", c.rolling[1] = -1.0; c.p.laws.rolling = c.rolling);
    REFUSED(ARGUMENT, "H has 6 rows, but the contacts have 8", c.rolling[1] = 1.0;
            c.p.laws.rolling = c.rolling);
    REFUSED(ARGUMENT, "laws.spinning[0] is 1, but contact 0 has dimension 2", c.spinning[0] = 1.0;
            c.p.laws.spinning = c.spinning; c.p.dims[0] = 2);
    REFUSED(ARGUMENT, "laws.rolling[0] is 1, but contact 0 has dimension 1", c.rolling[0] = 1.0;
            c.p.laws.rolling = c.rolling; c.p.dims[0] = 1);
    REFUSED(ARGUMENT, "laws.compliance[6] is -0.001", c.compliance[6] = -1e-3; /* of the joint */
            c.p.laws.compliance = c.compliance);
    REFUSED(NOT_FINITE, "laws.compliance[2] is nan", c.compliance[2] = NAN;
            c.p.laws.compliance = c.compliance);
}

static int32_t no_solve(double *x, int32_t columns, void *user)
{
    (void)columns;
    if (user)
        x[1] = NAN;
    return user ? 0 : 1;
}

/* Row of N entries that are so far apart := 0. */
static void no_row(double *entries, int32_t apart)
{
    for (int32_t i = 0; i < N; i++)
        entries[i * apart] = 0.0;
}

static void test_dynamics(void **state)
{
    static int some;
    call c;

    (void)state;
    prepare(&c);
    REFUSED(ARGUMENT, "dynamics.n is -1", c.p.dynamics.n = -1);
    REFUSED(ARGUMENT, "M is 5 by 5, expected 6 by 6", c.p.dynamics.n = N + 1);
    REFUSED(ARGUMENT, "dynamics.reserved is 1", c.p.dynamics.reserved = 1);
    REFUSED(ABI, "dynamics.struct_size", c.p.dynamics.struct_size = 1 << 20);
    REFUSED(ARGUMENT, "dynamics.M and dynamics.solve are both NULL", c.p.dynamics.M = NULL);
    REFUSED(ARGUMENT, "dynamics.M and dynamics.solve are both given",
            c.p.dynamics.solve = no_solve);
    REFUSED(CALLBACK, "dynamics.solve asked to abort", c.p.dynamics.M = NULL;
            c.p.dynamics.solve = no_solve);
    REFUSED(NOT_FINITE, "dynamics.solve made entry 1 of right-hand side 0 nan",
            c.p.dynamics.M = NULL;
            c.p.dynamics.solve = no_solve; c.p.dynamics.user = &some);
    REFUSED(ARGUMENT, "H is NULL", c.p.dynamics.H = NULL);
    REFUSED(ARGUMENT, "H has 4 columns", c.p.H_view.columns = 4);
    REFUSED(ARGUMENT, "H.leading_dimension is 2", c.p.H_view.leading_dimension = 2);
    REFUSED(NOT_FINITE, "H(1,1) is nan", c.p.H[7] = NAN);
    REFUSED(ARGUMENT, "G has 4 columns", c.p.G_view.columns = 4);
    REFUSED(NOT_FINITE, "G(0,2) is inf", c.p.G[2] = INFINITY);
    REFUSED(ARGUMENT, "M(1,1) is -1: M is not positive definite", c.p.M[6] = -1.0);
    REFUSED(ARGUMENT, "M is not symmetric", c.p.M[1] += 1.0);
    REFUSED(ARGUMENT, "not positive definite", c.p.M[1] = c.p.M[N] = 100.0);
    REFUSED(ARGUMENT, "contact 1: its normal impulse moves nothing, W(3,3) is 0",
            no_row(c.p.H + 3, 6));
    REFUSED(ARGUMENT, "bilateral row 0: its impulse moves nothing", no_row(c.p.G, 1));
}

static void test_sparse(void **state)
{
    call c;
    int32_t j, i;

    (void)state;
    prepare(&c);
    for (i = 0; i < 4; i++) {
        prepare(&c);
        for (j = 0; j <= N; j++)
            c.starts[j] = j * N;
        for (j = 0; j < N * N; j++)
            c.rows[j] = j % N;
        assert_int_equal(perp_matrix_csc(&c.p.M_view, N, N, c.starts, c.rows, c.p.M), PERP_OK);
        if (i == 0)
            assert_int_equal(run(&c), PERP_OK);
        else if (i == 1)
            REFUSED(ARGUMENT, "M.row_indices[2] = 1 is not above", c.rows[2] = 1);
        else if (i == 2)
            REFUSED(ARGUMENT, "M.column_starts[0] is 1", c.starts[0] = 1);
        else
            REFUSED(ARGUMENT, "M is not symmetric", c.p.M[1] += 1.0);
    }
}

static void test_vectors_and_settings(void **state)
{
    call c;

    (void)state;
    prepare(&c);
    REFUSED(NOT_FINITE, "f[4] is nan", c.p.f[4] = NAN);
    REFUSED(NOT_FINITE, "w[5] is inf", c.p.w[5] = INFINITY);
    REFUSED(NOT_FINITE, "b[0] is nan", c.p.b[0] = NAN);
    REFUSED(NOT_FINITE, "r0[6] is nan", c.r0[6] = NAN; c.start = c.r0);
    REFUSED(ABI, "result.struct_size is 8", c.p.result.struct_size = 8);
    REFUSED(ARGUMENT, "settings.method is 77", c.p.settings.method = 77);
    REFUSED(ARGUMENT, "settings.method is 4, which is only ever reported",
            c.p.settings.method = PERP_CONTACT_METHOD_POLISH);
    REFUSED(ARGUMENT, "settings.cone is 2", c.p.settings.cone = 2);
    REFUSED(ARGUMENT, "a polyhedron, which the method sweep can't take", c.p.settings.cone = 8;
            c.p.settings.method = PERP_CONTACT_METHOD_SWEEP);
    REFUSED(ARGUMENT, "settings.cone is 4096", c.p.settings.cone = 4096);
    REFUSED(ARGUMENT, "settings.tol is 0", c.p.settings.tol = 0.0);
    REFUSED(NOT_FINITE, "settings.tol is nan", c.p.settings.tol = NAN);
    REFUSED(ARGUMENT, "settings.time_limit is -1", c.p.settings.time_limit = -1.0);
    REFUSED(ARGUMENT, "settings.max_iterations is -1", c.p.settings.max_iterations = -1);
    REFUSED(ARGUMENT, "settings.raw_velocity is 3", c.p.settings.raw_velocity = 3);
    REFUSED(ABI, "settings.struct_size", c.p.settings.struct_size = 0);
}

static perp_status delassus(const perp_contact_laws *laws, int32_t storage, int32_t n,
                            const double *W, const double *q, double *r)
{
    perp_contact_result result = fresh_contact_result();
    perp_matrix view = fresh_matrix();

    assert_int_equal(perp_matrix_dense(&view, storage, n, n, W, n), PERP_OK);
    return perp_contact_solve(context, ANSWER(NULL, r), &result, NULL,
                              DELASSUS(laws, W ? &view : NULL, q), NULL);
}

static void test_delassus(void **state)
{
    const double W[4] = {1, 0, 0, 1}, negative[4] = {1, 0, 0, -1}, nothing[4] = {0, 0, 0, 1};
    const double nan[4] = {1, 0, NAN, 1}, q[2] = {-1, 0.25}, mu = 0.5;
    double r[2] = {5.0, 5.0};
    perp_contact_laws laws = fresh_contact_laws();
    const perp_contact_dynamics dynamics = fresh_contact_dynamics();
    const perp_matrix view = fresh_matrix();

    (void)state;
    laws.contacts = 1;
    laws.dim = 2;
    laws.mu = &mu;
    refused(context, delassus(&laws, 0, 2, NULL, q, r), ARGUMENT, "dynamics is NULL", "delassus");
    refused(context,
            perp_contact_solve(context, ANSWER(NULL, r), NULL, NULL,
                               DYNAMICS(&laws, &dynamics, .W = &view, .q = q), NULL),
            ARGUMENT, "dynamics and W", "delassus");
    refused(context, delassus(NULL, 0, 2, W, q, r), ARGUMENT, "laws is NULL", "delassus");
    refused(context, delassus(&laws, 9, 2, W, q, r), ARGUMENT, "W.storage is 9", "delassus");
    refused(context, delassus(&laws, 0, 1, W, q, r), ARGUMENT,
            "W is 1 by 1, but the contacts have 2 rows and 0 are bilateral", "delassus");
    refused(context, delassus(&laws, 0, 2, negative, q, r), ARGUMENT, "W(1,1) is -1", "delassus");
    refused(context, delassus(&laws, 0, 2, nothing, q, r), ARGUMENT,
            "contact 0: its normal impulse moves nothing", "delassus");
    refused(context, delassus(&laws, 0, 2, nan, q, r), NOT_FINITE, "W(0,1) is nan", "delassus");
    refused(context, delassus(&laws, 0, 2, W, NULL, r), ARGUMENT, "q is NULL", "delassus");
    refused(context, delassus(&laws, 0, 2, W, q, NULL), ARGUMENT, "r is NULL", "delassus");
    assert_true(r[0] == 5.0 && r[1] == 5.0);
    assert_int_equal(delassus(&laws, 0, 2, W, q, r), PERP_OK);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_laws),     cmocka_unit_test(test_dynamics),
        cmocka_unit_test(test_sparse),   cmocka_unit_test(test_vectors_and_settings),
        cmocka_unit_test(test_delassus),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
