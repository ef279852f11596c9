/* Every refusal of ncp.h: the status, a message that names argument and index, outputs untouched;
 * and memory: every allocation may fail, nothing is lost, and a second solve asks for none. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "suite.h"

#include "memory.h"
#include "refused.h"

#include "context.h"

enum { N = 3 };

/* z_i^3 + 4 z_i - z_{i-1} - z_{i+1} - (i + 1) */
static int32_t function(double *F, const double *z, void *user)
{
    (void)user;
    for (int i = 0; i < N; i++)
        F[i] = z[i] * z[i] * z[i] + 4 * z[i] - (i > 0 ? z[i - 1] : 0) - (i + 1 < N ? z[i + 1] : 0) -
               (i + 1);
    return 0;
}

static int32_t jacobian(double *J, const double *z, void *user)
{
    (void)user;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++)
            J[i + N * j] = i == j ? 3 * z[i] * z[i] + 4 : i - j == 1 || j - i == 1 ? -1 : 0;
    return 0;
}

/* All arguments of one solve, good as they come; a case spoils one of them. The structs are unions
 * with room for fields of later releases. */
typedef struct call {
    union {
        perp_ncp_settings settings;
        unsigned char bytes[sizeof(perp_ncp_settings) + 16];
    } s;
    union {
        perp_ncp_problem problem;
        unsigned char bytes[sizeof(perp_ncp_problem) + 16];
    } p;
    union {
        perp_ncp_result result;
        unsigned char bytes[sizeof(perp_ncp_result) + 16];
    } r;
    double lower[N], upper[N], z0[N], z[N], w[N];
    int32_t starts[N + 1], rows[N * N];
    perp_ncp_problem *problem;
    perp_ncp_result *result;
    double *z_out;
} call;

static void prepare(call *c)
{
    memset(c, 0, sizeof *c);
    assert_int_equal(perp_ncp_settings_init(&c->s.settings, sizeof c->s.settings), PERP_OK);
    assert_int_equal(perp_struct_init(&c->p.problem, sizeof c->p.problem), PERP_OK);
    assert_int_equal(perp_struct_init(&c->r.result, sizeof c->r.result), PERP_OK);
    memset(c->r.bytes + sizeof(size_t), 0x5a, sizeof(perp_ncp_result) - sizeof(size_t));
    for (int i = 0; i < N; i++) {
        c->upper[i] = 10;
        c->z[i] = c->w[i] = 123.25;
        c->starts[i + 1] = N * (i + 1);
    }
    for (int i = 0; i < N * N; i++)
        c->rows[i] = i % N;
    c->p.problem.n = N;
    c->p.problem.function = function;
    c->p.problem.jacobian = jacobian;
    c->p.problem.lower = c->lower;
    c->p.problem.upper = c->upper;
    c->problem = &c->p.problem;
    c->result = &c->r.result;
    c->z_out = c->z;
}

static void make_sparse(call *c)
{
    c->p.problem.storage = PERP_STORAGE_CSC;
    c->p.problem.column_starts = c->starts;
    c->p.problem.row_indices = c->rows;
    c->p.problem.jacobian = NULL;
}

static refusal spoil_problem(call *c, int *k)
{
    SPOIL(ARGUMENT, "problem.n", "", c->p.problem.n = -1)
    SPOIL(ARGUMENT, "problem.function", "", c->p.problem.function = NULL)
    SPOIL(ARGUMENT, "problem", "", c->problem = NULL)
    SPOIL(ARGUMENT, "result", "", c->result = NULL)
    SPOIL(ARGUMENT, "z is NULL", "", c->z_out = NULL)
    SPOIL(ARGUMENT, "problem.storage", "", c->p.problem.storage = 3)
    SPOIL(ARGUMENT, "row_indices", "", c->p.problem.row_indices = c->rows)
    SPOIL(NOT_FINITE, "lower[1]", "", c->lower[1] = NAN)
    SPOIL(NOT_FINITE, "lower[1]", "", c->lower[1] = INFINITY)
    SPOIL(NOT_FINITE, "upper[2]", "", c->upper[2] = NAN)
    SPOIL(ARGUMENT, "lower[2]", "", c->lower[2] = 11)
    SPOIL(NOT_FINITE, "z0[1]", "", c->z0[1] = NAN)
    SPOIL(NOT_FINITE, "z0[2]", "", c->z0[2] = INFINITY)
    make_sparse(c);
    SPOIL(ARGUMENT, "column_starts", "", c->p.problem.column_starts = NULL)
    SPOIL(ARGUMENT, "row_indices", "", c->p.problem.row_indices = NULL)
    SPOIL(ARGUMENT, "column_starts[0]", "", c->starts[0] = 1)
    SPOIL(ARGUMENT, "column_starts[2]", "", c->starts[2] = 2)
    SPOIL(ARGUMENT, "row_indices[5]", "", c->rows[5] = 3)
    SPOIL(ARGUMENT, "row_indices[3]", "", c->rows[3] = -1)
    SPOIL(ARGUMENT, "row_indices[4]", "", c->rows[4] = 0)
    END_OF_CASES;
}

static refusal spoil_settings_and_structs(call *c, int *k)
{
    SPOIL(ARGUMENT, "settings.method", "", c->s.settings.method = 3)
    SPOIL(ARGUMENT, "settings.max_iterations", "", c->s.settings.max_iterations = -1)
    SPOIL(ARGUMENT, "settings.restarts", "", c->s.settings.restarts = -1)
    SPOIL(ARGUMENT, "settings.scaling", "", c->s.settings.scaling = 2)
    SPOIL(ARGUMENT, "settings.polish", "", c->s.settings.polish = -1)
    SPOIL(ARGUMENT, "settings.reserved", "", c->s.settings.reserved = 1)
    SPOIL(ARGUMENT, "settings.tol", "", c->s.settings.tol = 0)
    SPOIL(NOT_FINITE, "settings.tol", "", c->s.settings.tol = NAN)
    SPOIL(ARGUMENT, "settings.tol", "", c->s.settings.tol = INFINITY)
    SPOIL(ARGUMENT, "settings.time_limit", "", c->s.settings.time_limit = -1)
    SPOIL(ARGUMENT, "settings.penalty", "", c->s.settings.penalty = 1)
    SPOIL(NOT_FINITE, "settings.penalty", "", c->s.settings.penalty = NAN)
    SPOIL(ABI, "settings.struct_size", "", c->s.settings.struct_size = 0)
    SPOIL(ABI, "settings", "", c->s.settings.struct_size += 8;
          c->s.bytes[sizeof(perp_ncp_settings) + 1] = 1)
    SPOIL(ABI, "problem.struct_size", "", c->p.problem.struct_size = 8)
    SPOIL(ABI, "problem", "", c->p.problem.struct_size += 8;
          c->p.bytes[sizeof(perp_ncp_problem)] = 1)
    SPOIL(ABI, "result.struct_size", "", c->r.result.struct_size = 8)
    END_OF_CASES;
}

static void test_refusals(void **state)
{
    static refusal (*const groups[])(call *, int *) = {spoil_problem, spoil_settings_and_structs};

    (void)state;
    for (size_t g = 0; g < sizeof groups / sizeof *groups; g++)
        for (int k = 0;; k++) {
            call c, before;
            refusal expected;
            int left = k;

            prepare(&c);
            expected = groups[g](&c, &left);
            if (expected.status == PERP_OK)
                break;
            before = c;
            refused_as(
                context,
                perp_ncp_solve(context, c.z_out, c.w, c.result, &c.s.settings, c.problem, c.z0),
                expected);
            assert_memory_equal(&c, &before, sizeof c);
        }
}

static void test_good_calls(void **state)
{
    call c;
    perp_ncp_solver *solver = NULL;

    (void)state;
    prepare(&c);
    assert_int_equal(perp_ncp_solve(context, c.z, NULL, c.result, NULL, c.problem, NULL), PERP_OK);
    assert_int_equal(c.result->outcome, PERP_OUTCOME_SOLVED);
    make_sparse(&c);
    assert_int_equal(perp_ncp_solve(context, c.z, c.w, c.result, NULL, c.problem, c.z0), PERP_OK);
    assert_int_equal(c.result->outcome, PERP_OUTCOME_SOLVED);
    c.problem->n = 0; /* nothing is to be found, and is found */
    for (int method = PERP_NCP_AUTO; method <= PERP_NCP_JOSEPHY; method++) {
        c.s.settings.method = method;
        c.starts[0] = 0;
        assert_int_equal(
            perp_ncp_solve(context, NULL, NULL, c.result, &c.s.settings, c.problem, NULL), PERP_OK);
        assert_int_equal(c.result->outcome, PERP_OUTCOME_SOLVED);
    }
    assert_int_equal(perp_ncp_solver_create(context, &solver, NULL), PERP_OK);
    assert_int_equal(perp_ncp_solver_solve(solver, c.z, NULL, c.result, NULL), PERP_ERROR_ARGUMENT);
    prepare(&c);
    assert_int_equal(perp_ncp_solver_setup(solver, c.problem), PERP_OK);
    c.lower[1] = NAN; /* a set-up that fails leaves the problem there was, bounds and all */
    assert_int_equal(perp_ncp_solver_setup(solver, c.problem), PERP_ERROR_NOT_FINITE);
    assert_int_equal(perp_ncp_solver_solve(solver, c.z, NULL, c.result, NULL), PERP_OK);
    assert_int_equal(c.result->outcome, PERP_OUTCOME_SOLVED);
    c.s.settings.tol = -1;
    assert_int_equal(perp_ncp_solver_set(solver, &c.s.settings), PERP_ERROR_ARGUMENT);
    c.s.settings.tol = 1e-6;
    assert_int_equal(perp_ncp_solver_set(solver, &c.s.settings), PERP_OK);
    assert_int_equal(perp_ncp_solver_solve(solver, c.z, NULL, c.result, NULL), PERP_OK);
    perp_ncp_solver_destroy(solver);
    perp_ncp_solver_destroy(NULL);
}

static void test_handles(void **state)
{
    struct {
        uint64_t magic;
    } stranger = {1};
    perp_ncp_solver *solver = (perp_ncp_solver *)(void *)&stranger;
    call c;

    (void)state;
    prepare(&c);
    assert_int_equal(perp_ncp_solver_create(NULL, &solver, NULL), PERP_ERROR_HANDLE);
    assert_int_equal(perp_ncp_solver_create(context, NULL, NULL), PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_ncp_solver_set(NULL, NULL), PERP_ERROR_HANDLE);
    assert_int_equal(perp_ncp_solver_setup(NULL, c.problem), PERP_ERROR_HANDLE);
    assert_int_equal(perp_ncp_solver_solve(solver, c.z, NULL, c.result, NULL), PERP_ERROR_HANDLE);
    assert_int_equal(perp_ncp_solve(NULL, c.z, NULL, c.result, NULL, c.problem, NULL),
                     PERP_ERROR_HANDLE);
    assert_int_equal(perp_ncp_settings_init(NULL, 8), PERP_ERROR_ABI);
    assert_string_equal(perp_ncp_method_text(PERP_NCP_JOSEPHY), "josephy");
    assert_string_equal(perp_ncp_method_text(3), "unknown method");
    assert_string_equal(perp_ncp_method_text(-1), "unknown method");
}

/* ---- memory ---------------------------------------------------------------------------------- */

static void test_every_allocation_fails(void **state)
{
    (void)state;
    for (int k = 0; k < 6; k++) {
        memory m = {0, 0, 0};
        perp_context_settings settings = memory_settings(&m);
        perp_context *limited;
        int refused = 0;

        assert_int_equal(perp_context_create(&limited, &settings), PERP_OK);
        for (int fails_at = 1;; fails_at++) {
            call c, before;
            perp_status status;

            prepare(&c);
            if (k % 2)
                make_sparse(&c);
            c.s.settings.method = k / 2;
            before = c;
            m.calls = 0;
            m.fails_at = fails_at;
            status = perp_ncp_solve(limited, c.z, c.w, c.result, &c.s.settings, c.problem, c.z0);
            assert_int_equal(m.live, 1); /* the context alone */
            if (status == PERP_OK) {
                assert_int_equal(c.result->outcome, PERP_OUTCOME_SOLVED);
                if (m.calls < fails_at)
                    break;
                continue; /* a failure that the linear solver had an answer to */
            }
            assert_int_equal(status, PERP_ERROR_MEMORY);
            assert_string_not_equal(perp_context_message(limited), "");
            assert_memory_equal(&c, &before, sizeof c);
            refused++;
        }
        assert_true(refused >= 2); /* the solver and its arrays at least */
        m.fails_at = 0;
        perp_context_destroy(limited);
        assert_int_equal(m.live, 0);
    }
}

static void test_second_solve_allocates_nothing(void **state)
{
    (void)state;
    for (int k = 0; k < 6; k++) {
        memory m = {0, 0, 0};
        perp_context_settings settings = memory_settings(&m);
        perp_context *limited;
        perp_ncp_solver *solver;
        call c;

        prepare(&c);
        if (k % 2)
            make_sparse(&c);
        c.s.settings.method = k / 2;
        assert_int_equal(perp_context_create(&limited, &settings), PERP_OK);
        assert_int_equal(perp_ncp_solver_create(limited, &solver, &c.s.settings), PERP_OK);
        assert_int_equal(perp_ncp_solver_setup(solver, c.problem), PERP_OK);
        assert_int_equal(perp_ncp_solver_solve(solver, c.z, c.w, c.result, c.z0), PERP_OK);
        m.calls = 0;
        c.lower[0] = 0.5;
        assert_int_equal(perp_ncp_solver_setup(solver, c.problem), PERP_OK);
        assert_int_equal(perp_ncp_solver_solve(solver, c.z, c.w, c.result, c.z0), PERP_OK);
        assert_int_equal(c.result->outcome, PERP_OUTCOME_SOLVED);
        assert_true(c.z[0] >= 0.5);
        assert_int_equal(m.calls, 0);
        perp_ncp_solver_destroy(solver);
        perp_context_destroy(limited);
        assert_int_equal(m.live, 0);
    }
}

/* The check of a Jacobian, too. */
static void test_check_in_little_memory(void **state)
{
    memory m = {0, 0, 0};
    perp_context_settings settings = memory_settings(&m);
    perp_context *limited;
    const double z[N] = {0.3, 0.2, 0.1};
    perp_status status = PERP_ERROR_MEMORY;
    perp_ncp_check check = fresh_ncp_check();
    call c;

    (void)state;
    prepare(&c);
    assert_int_equal(perp_context_create(&limited, &settings), PERP_OK);
    for (int fails_at = 1; status != PERP_OK; fails_at++) {
        m.calls = 0;
        m.fails_at = fails_at;
        status = perp_ncp_check_jacobian(limited, &check, c.problem, z);
        assert_int_equal(m.live, 1);
        assert_true(status == PERP_OK || status == PERP_ERROR_MEMORY);
    }
    assert_int_equal(check.wrong, 0);
    perp_context_destroy(limited);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_good_calls),
        cmocka_unit_test(test_handles),
        cmocka_unit_test(test_every_allocation_fails),
        cmocka_unit_test(test_second_solve_allocates_nothing),
        cmocka_unit_test(test_check_in_little_memory),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
