/* Every refusal of lcp.h and matrix.h: the status, a message that names argument and index, outputs
 * untouched, and a solver that works as before. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "refused.h"
#include "run.h"

#include "context.h"

enum { N = 3 };

/* All arguments of one solve, good as they come; a case spoils one of them. The structs are unions
 * with room for fields of later releases. */
typedef struct call {
    union {
        perp_lcp_settings settings;
        unsigned char bytes[sizeof(perp_lcp_settings) + 16];
    } s;
    union {
        perp_matrix view;
        unsigned char bytes[sizeof(perp_matrix) + 16];
    } M;
    union {
        perp_lcp_result result;
        unsigned char bytes[sizeof(perp_lcp_result) + 16];
    } r;
    double values[N * N], q[N], lower[N], upper[N], z0[N], z[N], w[N], ray[N];
    int32_t starts[N + 1], rows[N * N];
    perp_matrix *matrix; /* &M.view, or NULL */
    double *z_out, *q_in;
    perp_lcp_result *result;
} call;

static void prepare(call *c)
{
    static const double values[] = {4, 1, 0, 1, 4, 1, 0, 1, 4};
    int32_t i;

    memset(c, 0, sizeof *c);
    c->s.settings = run_settings(PERP_LCP_AUTO);
    memcpy(c->values, values, sizeof values);
    assert_int_equal(perp_struct_init(&c->M.view, sizeof c->M.view), PERP_OK);
    assert_int_equal(perp_matrix_dense(&c->M.view, PERP_STORAGE_COLUMN_MAJOR, N, N, c->values, N),
                     PERP_OK);
    assert_int_equal(perp_struct_init(&c->r.result, sizeof c->r.result), PERP_OK);
    memset(c->r.bytes + sizeof(size_t), 0x5a, sizeof(perp_lcp_result) - sizeof(size_t));
    for (i = 0; i < N; i++) {
        c->q[i] = i - 2.0;
        c->upper[i] = 10.0;
        c->z[i] = c->w[i] = c->ray[i] = 123.25;
        c->starts[i + 1] = N * (i + 1);
    }
    for (i = 0; i < N * N; i++)
        c->rows[i] = i % N;
    c->matrix = &c->M.view;
    c->z_out = c->z;
    c->q_in = c->q;
    c->result = &c->r.result;
}

static void as_csc(call *c)
{
    assert_int_equal(perp_matrix_csc(&c->M.view, N, N, c->starts, c->rows, c->values), PERP_OK);
}

/* ---- the cases ------------------------------------------------------------------------------- */

static refusal spoil_settings(call *c, int *k)
{
    SPOIL(ABI, "settings", "struct_size", c->s.settings.struct_size = 0)
    SPOIL(ABI, "settings", "struct_size", c->s.settings.struct_size = sizeof(size_t))
    SPOIL(ABI, "settings", "struct_size", c->s.settings.struct_size = SIZE_MAX)
    SPOIL(ABI, "settings", "byte", c->s.settings.struct_size = sizeof c->s;
          c->s.bytes[sizeof(perp_lcp_settings) + 3] = 1)
    SPOIL(ARGUMENT, "settings.method", "4", c->s.settings.method = 4)
    SPOIL(ARGUMENT, "settings.method", "-1", c->s.settings.method = -1)
    SPOIL(ARGUMENT, "settings.max_iterations", "-1", c->s.settings.max_iterations = -1)
    SPOIL(ARGUMENT, "settings.tol", "0", c->s.settings.tol = 0)
    SPOIL(ARGUMENT, "settings.tol", "-1e-10", c->s.settings.tol = -1e-10)
    SPOIL(NOT_FINITE, "settings.tol", "nan", c->s.settings.tol = NAN)
    SPOIL(ARGUMENT, "settings.time_limit", "-1", c->s.settings.time_limit = -1)
    SPOIL(NOT_FINITE, "settings.time_limit", "nan", c->s.settings.time_limit = NAN)
    SPOIL(ARGUMENT, "settings.relaxation", "0", c->s.settings.relaxation = 0)
    SPOIL(ARGUMENT, "settings.relaxation", "2", c->s.settings.relaxation = 2)
    SPOIL(NOT_FINITE, "settings.relaxation", "nan", c->s.settings.relaxation = NAN)
    SPOIL(ARGUMENT, "settings.pivot_rule", "2", c->s.settings.pivot_rule = 2)
    SPOIL(ARGUMENT, "settings.scaling", "2", c->s.settings.scaling = 2)
    SPOIL(ARGUMENT, "settings.polish", "-1", c->s.settings.polish = -1)
    SPOIL(ARGUMENT, "settings.method", "4", c->s.settings.method = PERP_LCP_POLISH)
    SPOIL(ARGUMENT, "settings.crash", "2", c->s.settings.crash = 2)
    SPOIL(ARGUMENT, "settings.sweep", "-1", c->s.settings.sweep = -1)
    SPOIL(ARGUMENT, "settings.acceleration", "2", c->s.settings.acceleration = 2)
    SPOIL(ARGUMENT, "settings.penalty", "1", c->s.settings.penalty = 1.0)
    SPOIL(NOT_FINITE, "settings.penalty", "nan", c->s.settings.penalty = NAN)
    END_OF_CASES;
}

static refusal spoil_dense_matrix(call *c, int *k)
{
    SPOIL(ARGUMENT, "M", "NULL", c->matrix = NULL)
    SPOIL(ABI, "M", "struct_size", c->M.view.struct_size = 0)
    SPOIL(ABI, "M", "struct_size", c->M.view.struct_size = sizeof(perp_matrix) - 1)
    SPOIL(ABI, "M", "byte", c->M.view.struct_size = sizeof c->M;
          c->M.bytes[sizeof(perp_matrix)] = 1)
    SPOIL(ARGUMENT, "M.storage", "3", c->M.view.storage = 3)
    SPOIL(ARGUMENT, "M", "-1", c->M.view.rows = -1)
    SPOIL(ARGUMENT, "M", "-1", c->M.view.columns = -1)
    SPOIL(ARGUMENT, "M", "3 by 2", c->M.view.columns = 2)
    SPOIL(ARGUMENT, "M.leading_dimension", "2", c->M.view.leading_dimension = N - 1)
    SPOIL(ARGUMENT, "M.leading_dimension", "-3", c->M.view.leading_dimension = -N)
    SPOIL(ARGUMENT, "M.leading_dimension", "2", c->M.view.storage = PERP_STORAGE_ROW_MAJOR;
          c->M.view.leading_dimension = N - 1)
    SPOIL(ARGUMENT, "M.values", "NULL", c->M.view.values = NULL)
    SPOIL(ARGUMENT, "M.reserved", "1", c->M.view.reserved = 1)
    SPOIL(NOT_FINITE, "M", "(2,1)", c->values[5] = NAN) /* row 2, column 1 */
    SPOIL(NOT_FINITE, "M", "(2,2)", c->values[8] = -INFINITY)
    SPOIL(ARGUMENT, "M.row_indices", "not NULL", c->M.view.row_indices = c->rows)
    END_OF_CASES;
}

static refusal spoil_sparse_matrix(call *c, int *k)
{
    as_csc(c);
    SPOIL(ARGUMENT, "M.column_starts", "NULL", c->M.view.column_starts = NULL)
    SPOIL(ARGUMENT, "M.row_indices", "NULL", c->M.view.row_indices = NULL)
    SPOIL(ARGUMENT, "M.values", "NULL", c->M.view.values = NULL)
    SPOIL(ARGUMENT, "M.column_starts[0]", "1", c->starts[0] = 1)
    SPOIL(ARGUMENT, "M.column_starts[2]", "2", c->starts[2] = 2)
    SPOIL(ARGUMENT, "M.column_starts[1]", "-1", c->starts[1] = -1)
    SPOIL(ARGUMENT, "M.row_indices[5]", "1", c->rows[4] = 2; c->rows[5] = 1)
    SPOIL(ARGUMENT, "M.row_indices[7]", "0", c->rows[7] = 0)
    SPOIL(ARGUMENT, "M.row_indices[5]", "3", c->rows[5] = N)
    SPOIL(ARGUMENT, "M.row_indices[3]", "-1", c->rows[3] = -1)
    SPOIL(NOT_FINITE, "M", "4", c->values[4] = NAN)
    END_OF_CASES;
}

static refusal spoil_the_rest(call *c, int *k)
{
    SPOIL(NOT_FINITE, "lower[1]", "nan", c->lower[1] = NAN)
    SPOIL(NOT_FINITE, "lower[2]", "inf", c->lower[2] = INFINITY)
    SPOIL(NOT_FINITE, "upper[0]", "nan", c->upper[0] = NAN)
    SPOIL(NOT_FINITE, "upper[1]", "-inf", c->upper[1] = -INFINITY)
    SPOIL(ARGUMENT, "lower[1]", "upper[1]", c->lower[1] = 11)
    SPOIL(ARGUMENT, "q", "NULL", c->q_in = NULL)
    SPOIL(NOT_FINITE, "q[2]", "nan", c->q[2] = NAN)
    SPOIL(NOT_FINITE, "q[0]", "inf", c->q[0] = INFINITY)
    SPOIL(NOT_FINITE, "z0[1]", "nan", c->z0[1] = NAN)
    SPOIL(NOT_FINITE, "z0[2]", "-inf", c->z0[2] = -INFINITY)
    SPOIL(ARGUMENT, "z", "NULL", c->z_out = NULL)
    SPOIL(ARGUMENT, "result", "NULL", c->result = NULL)
    SPOIL(ABI, "result", "struct_size", c->r.result.struct_size = 0)
    SPOIL(ABI, "result", "struct_size", c->r.result.struct_size = sizeof(perp_lcp_result) - 1)
    SPOIL(ABI, "result", "byte", c->r.result.struct_size = sizeof c->r;
          c->r.bytes[sizeof(perp_lcp_result) + 7] = 1)
    SPOIL(ARGUMENT, "M", "1", c->s.settings.method = PERP_LCP_PGS; c->values[4] = 0)
    SPOIL(ARGUMENT, "M", "2", c->s.settings.method = PERP_LCP_PGS; c->values[8] = -1)
    SPOIL(ARGUMENT, "M", "0", as_csc(c); c->s.settings.method = PERP_LCP_PGS; c->starts[1] = 2;
          c->starts[2] = 5; c->starts[3] = 7; c->rows[0] = 1; c->rows[1] = 2; c->rows[2] = 0;
          c->rows[3] = 1; c->rows[4] = 2; c->rows[5] = 1; c->rows[6] = 2)
    END_OF_CASES;
}

/* Case k of them all; status 0 behind the last. */
static refusal spoil(call *c, int k)
{
    static refusal (*const groups[])(call *, int *) = {spoil_settings, spoil_dense_matrix,
                                                       spoil_sparse_matrix, spoil_the_rest};
    refusal expected = {PERP_OK, {"", ""}};

    for (size_t g = 0; g < sizeof groups / sizeof *groups && expected.status == PERP_OK; g++) {
        prepare(c);
        expected = groups[g](c, &k);
    }
    return expected;
}

/* ---- the two ways to call ------------------------------------------------------------------- */

static perp_status at_once(call *c)
{
    return perp_lcp_solve(context, c->z_out, c->w, c->ray, c->result, &c->s.settings,
                          LCP(c->matrix, c->q_in, c->lower, c->upper), c->z0);
}

/* Through a solver that has a good problem already: where the bad call is refused, solving the
 * good problem must give what it gave before. */
static perp_status step_by_step(call *c, perp_lcp_solver *solver)
{
    perp_status status = perp_lcp_solver_set(solver, &c->s.settings);

    if (status == PERP_OK)
        status = perp_lcp_solver_setup(solver, c->matrix, c->lower, c->upper);
    if (status == PERP_OK)
        status = perp_lcp_solver_solve(solver, c->z_out, c->w, c->ray, c->result, c->q_in, c->z0);
    return status;
}

static void assert_refused(const call *c, const call *before, perp_status status, refusal expected)
{
    refused_as(context, status, expected);
    if (memcmp(c, before, sizeof *c) != 0)
        fail_msg("%s, %s: an output was written", expected.names[0], expected.names[1]);
}

static void test_at_once(void **state)
{
    call c, before, good;
    refusal expected;

    (void)state;
    for (int k = 0; (expected = spoil(&c, k)).status != PERP_OK; k++) {
        memcpy(&before, &c, sizeof c);
        assert_refused(&c, &before, at_once(&c), expected);
        prepare(&good);
        assert_int_equal(at_once(&good), PERP_OK);
        assert_string_equal(perp_context_message(context), "");
        assert_int_equal(good.r.result.outcome, PERP_OUTCOME_SOLVED);
    }
}

static void test_step_by_step(void **state)
{
    perp_lcp_solver *solver;
    call c, before, good, after;
    refusal expected;

    (void)state;
    prepare(&good);
    assert_int_equal(perp_lcp_solver_create(context, &solver, NULL), PERP_OK);
    assert_int_equal(step_by_step(&good, solver), PERP_OK);
    for (int k = 0; (expected = spoil(&c, k)).status != PERP_OK; k++) {
        memcpy(&before, &c, sizeof c);
        assert_refused(&c, &before, step_by_step(&c, solver), expected);
        prepare(&after);
        assert_int_equal(step_by_step(&after, solver), PERP_OK);
        assert_memory_equal(after.z, good.z, sizeof after.z);
    }
    perp_lcp_solver_destroy(solver);
}

/* lcp.h: after a refused set or setup the old settings and the old problem are still in force. */
static void test_old_problem_survives(void **state)
{
    perp_lcp_solver *solver;
    call c, good, after;

    (void)state;
    prepare(&good);
    assert_int_equal(perp_lcp_solver_create(context, &solver, NULL), PERP_OK);
    assert_int_equal(step_by_step(&good, solver), PERP_OK);
    for (int k = 0; spoil(&c, k).status != PERP_OK; k++) {
        if (perp_lcp_solver_set(solver, &c.s.settings) == PERP_OK &&
            perp_lcp_solver_setup(solver, c.matrix, c.lower, c.upper) == PERP_OK) {
            assert_int_equal(step_by_step(&good, solver), PERP_OK);
            continue;
        }
        prepare(&after);
        assert_int_equal(
            perp_lcp_solver_solve(solver, after.z, after.w, NULL, after.result, after.q, NULL),
            PERP_OK);
        assert_memory_equal(after.z, good.z, sizeof good.z);
        assert_int_equal(perp_lcp_solver_set(solver, &good.s.settings), PERP_OK);
    }
    perp_lcp_solver_destroy(solver);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_at_once),
        cmocka_unit_test(test_step_by_step),
        cmocka_unit_test(test_old_problem_survives),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
