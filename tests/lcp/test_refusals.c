/* Every refusal of lcp.h and matrix.h: the status, a message that names argument and index, outputs
 * untouched, and a solver that works as before. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

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
    assert_int_equal(perp_matrix_init(&c->M.view, sizeof c->M.view), PERP_OK);
    assert_int_equal(perp_matrix_dense(&c->M.view, PERP_STORAGE_COLUMN_MAJOR, N, N, c->values, N),
                     PERP_OK);
    assert_int_equal(perp_lcp_result_init(&c->r.result, sizeof c->r.result), PERP_OK);
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

#define CASE(name, statement) \
    static void name(call *c) \
    {                         \
        statement;            \
    }

CASE(settings_not_initialised, c->s.settings.struct_size = 0)
CASE(settings_too_small, c->s.settings.struct_size = sizeof(size_t))
CASE(settings_huge, c->s.settings.struct_size = SIZE_MAX)
CASE(settings_unknown_tail, c->s.settings.struct_size = sizeof c->s;
     c->s.bytes[sizeof(perp_lcp_settings) + 3] = 1)
CASE(method_unknown, c->s.settings.method = 4)
CASE(method_negative, c->s.settings.method = -1)
CASE(iterations_negative, c->s.settings.max_iterations = -1)
CASE(tol_zero, c->s.settings.tol = 0)
CASE(tol_negative, c->s.settings.tol = -1e-10)
CASE(tol_nan, c->s.settings.tol = NAN)
CASE(time_negative, c->s.settings.time_limit = -1)
CASE(time_nan, c->s.settings.time_limit = NAN)
CASE(relaxation_zero, c->s.settings.relaxation = 0)
CASE(relaxation_two, c->s.settings.relaxation = 2)
CASE(relaxation_nan, c->s.settings.relaxation = NAN)
CASE(rule_unknown, c->s.settings.pivot_rule = 2)
CASE(scaling_two, c->s.settings.scaling = 2)
CASE(polish_negative, c->s.settings.polish = -1)
CASE(settings_method_polish, c->s.settings.method = PERP_LCP_POLISH)
CASE(settings_crash, c->s.settings.crash = 2)
CASE(settings_sweep, c->s.settings.sweep = -1)
CASE(settings_acceleration, c->s.settings.acceleration = 2)
CASE(settings_penalty, c->s.settings.penalty = 1.0)
CASE(settings_penalty_nan, c->s.settings.penalty = NAN)
CASE(matrix_null, c->matrix = NULL)
CASE(matrix_not_initialised, c->M.view.struct_size = 0)
CASE(matrix_too_small, c->M.view.struct_size = sizeof(perp_matrix) - 1)
CASE(matrix_unknown_tail, c->M.view.struct_size = sizeof c->M; c->M.bytes[sizeof(perp_matrix)] = 1)
CASE(matrix_storage, c->M.view.storage = 3)
CASE(matrix_rows_negative, c->M.view.rows = -1)
CASE(matrix_columns_negative, c->M.view.columns = -1)
CASE(matrix_not_square, c->M.view.columns = 2)
CASE(matrix_leading, c->M.view.leading_dimension = N - 1)
CASE(matrix_leading_negative, c->M.view.leading_dimension = -N)
CASE(matrix_leading_row_major, c->M.view.storage = PERP_STORAGE_ROW_MAJOR;
     c->M.view.leading_dimension = N - 1)
CASE(matrix_no_values, c->M.view.values = NULL)
CASE(matrix_reserved, c->M.view.reserved = 1)
CASE(matrix_nan, c->values[5] = NAN) /* row 2, column 1 */
CASE(matrix_infinite, c->values[8] = -INFINITY)
CASE(dense_with_indices, c->M.view.row_indices = c->rows)
CASE(csc_no_starts, as_csc(c); c->M.view.column_starts = NULL)
CASE(csc_no_rows, as_csc(c); c->M.view.row_indices = NULL)
CASE(csc_no_values, as_csc(c); c->M.view.values = NULL)
CASE(csc_first_start, as_csc(c); c->starts[0] = 1)
CASE(csc_falling_starts, as_csc(c); c->starts[2] = 2)
CASE(csc_negative_start, as_csc(c); c->starts[1] = -1)
CASE(csc_unsorted, as_csc(c); c->rows[4] = 2; c->rows[5] = 1)
CASE(csc_duplicate, as_csc(c); c->rows[7] = 0)
CASE(csc_row_too_large, as_csc(c); c->rows[5] = N)
CASE(csc_row_negative, as_csc(c); c->rows[3] = -1)
CASE(csc_nan, as_csc(c); c->values[4] = NAN)
CASE(lower_nan, c->lower[1] = NAN)
CASE(lower_infinite, c->lower[2] = INFINITY)
CASE(upper_nan, c->upper[0] = NAN)
CASE(upper_infinite, c->upper[1] = -INFINITY)
CASE(bounds_crossed, c->lower[1] = 11)
CASE(q_null, c->q_in = NULL)
CASE(q_nan, c->q[2] = NAN)
CASE(q_infinite, c->q[0] = INFINITY)
CASE(z0_nan, c->z0[1] = NAN)
CASE(z0_infinite, c->z0[2] = -INFINITY)
CASE(z_null, c->z_out = NULL)
CASE(result_null, c->result = NULL)
CASE(result_not_initialised, c->r.result.struct_size = 0)
CASE(result_too_small, c->r.result.struct_size = sizeof(perp_lcp_result) - 1)
CASE(result_unknown_tail, c->r.result.struct_size = sizeof c->r;
     c->r.bytes[sizeof(perp_lcp_result) + 7] = 1)
CASE(pgs_zero_diagonal, c->s.settings.method = PERP_LCP_PGS; c->values[4] = 0)
CASE(pgs_negative_diagonal, c->s.settings.method = PERP_LCP_PGS; c->values[8] = -1)
CASE(pgs_no_diagonal, as_csc(c); c->s.settings.method = PERP_LCP_PGS; c->starts[1] = 2;
     c->starts[2] = 5; c->starts[3] = 7; c->rows[0] = 1; c->rows[1] = 2; c->rows[2] = 0;
     c->rows[3] = 1; c->rows[4] = 2; c->rows[5] = 1; c->rows[6] = 2)

typedef struct refusal {
    void (*spoil)(call *c);
    perp_status status;
    const char *names[2]; /* what the message must name */
} refusal;

#define ARGUMENT PERP_ERROR_ARGUMENT
#define INFINITE PERP_ERROR_NOT_FINITE
#define ABI PERP_ERROR_ABI

static const refusal refusals[] = {
    {settings_not_initialised, ABI, {"settings", "struct_size"}},
    {settings_too_small, ABI, {"settings", "struct_size"}},
    {settings_huge, ABI, {"settings", "struct_size"}},
    {settings_unknown_tail, ABI, {"settings", "byte"}},
    {method_unknown, ARGUMENT, {"settings.method", "4"}},
    {method_negative, ARGUMENT, {"settings.method", "-1"}},
    {iterations_negative, ARGUMENT, {"settings.max_iterations", "-1"}},
    {tol_zero, ARGUMENT, {"settings.tol", "0"}},
    {tol_negative, ARGUMENT, {"settings.tol", "-1e-10"}},
    {tol_nan, INFINITE, {"settings.tol", "nan"}},
    {time_negative, ARGUMENT, {"settings.time_limit", "-1"}},
    {time_nan, INFINITE, {"settings.time_limit", "nan"}},
    {relaxation_zero, ARGUMENT, {"settings.relaxation", "0"}},
    {relaxation_two, ARGUMENT, {"settings.relaxation", "2"}},
    {relaxation_nan, INFINITE, {"settings.relaxation", "nan"}},
    {rule_unknown, ARGUMENT, {"settings.pivot_rule", "2"}},
    {scaling_two, ARGUMENT, {"settings.scaling", "2"}},
    {polish_negative, ARGUMENT, {"settings.polish", "-1"}},
    {settings_method_polish, ARGUMENT, {"settings.method", "4"}},
    {settings_crash, ARGUMENT, {"settings.crash", "2"}},
    {settings_sweep, ARGUMENT, {"settings.sweep", "-1"}},
    {settings_acceleration, ARGUMENT, {"settings.acceleration", "2"}},
    {settings_penalty, ARGUMENT, {"settings.penalty", "1"}},
    {settings_penalty_nan, INFINITE, {"settings.penalty", "nan"}},
    {matrix_null, ARGUMENT, {"M", "NULL"}},
    {matrix_not_initialised, ABI, {"M", "struct_size"}},
    {matrix_too_small, ABI, {"M", "struct_size"}},
    {matrix_unknown_tail, ABI, {"M", "byte"}},
    {matrix_storage, ARGUMENT, {"M.storage", "3"}},
    {matrix_rows_negative, ARGUMENT, {"M", "-1"}},
    {matrix_columns_negative, ARGUMENT, {"M", "-1"}},
    {matrix_not_square, ARGUMENT, {"M", "3 by 2"}},
    {matrix_leading, ARGUMENT, {"M.leading_dimension", "2"}},
    {matrix_leading_negative, ARGUMENT, {"M.leading_dimension", "-3"}},
    {matrix_leading_row_major, ARGUMENT, {"M.leading_dimension", "2"}},
    {matrix_no_values, ARGUMENT, {"M.values", "NULL"}},
    {matrix_reserved, ARGUMENT, {"M.reserved", "1"}},
    {matrix_nan, INFINITE, {"M", "(2,1)"}},
    {matrix_infinite, INFINITE, {"M", "(2,2)"}},
    {dense_with_indices, ARGUMENT, {"M.row_indices", "not NULL"}},
    {csc_no_starts, ARGUMENT, {"M.column_starts", "NULL"}},
    {csc_no_rows, ARGUMENT, {"M.row_indices", "NULL"}},
    {csc_no_values, ARGUMENT, {"M.values", "NULL"}},
    {csc_first_start, ARGUMENT, {"M.column_starts[0]", "1"}},
    {csc_falling_starts, ARGUMENT, {"M.column_starts[2]", "2"}},
    {csc_negative_start, ARGUMENT, {"M.column_starts[1]", "-1"}},
    {csc_unsorted, ARGUMENT, {"M.row_indices[5]", "1"}},
    {csc_duplicate, ARGUMENT, {"M.row_indices[7]", "0"}},
    {csc_row_too_large, ARGUMENT, {"M.row_indices[5]", "3"}},
    {csc_row_negative, ARGUMENT, {"M.row_indices[3]", "-1"}},
    {csc_nan, INFINITE, {"M", "4"}},
    {lower_nan, INFINITE, {"lower[1]", "nan"}},
    {lower_infinite, INFINITE, {"lower[2]", "inf"}},
    {upper_nan, INFINITE, {"upper[0]", "nan"}},
    {upper_infinite, INFINITE, {"upper[1]", "-inf"}},
    {bounds_crossed, ARGUMENT, {"lower[1]", "upper[1]"}},
    {q_null, ARGUMENT, {"q", "NULL"}},
    {q_nan, INFINITE, {"q[2]", "nan"}},
    {q_infinite, INFINITE, {"q[0]", "inf"}},
    {z0_nan, INFINITE, {"z0[1]", "nan"}},
    {z0_infinite, INFINITE, {"z0[2]", "-inf"}},
    {z_null, ARGUMENT, {"z", "NULL"}},
    {result_null, ARGUMENT, {"result", "NULL"}},
    {result_not_initialised, ABI, {"result", "struct_size"}},
    {result_too_small, ABI, {"result", "struct_size"}},
    {result_unknown_tail, ABI, {"result", "byte"}},
    {pgs_zero_diagonal, ARGUMENT, {"M", "1"}},
    {pgs_negative_diagonal, ARGUMENT, {"M", "2"}},
    {pgs_no_diagonal, ARGUMENT, {"M", "0"}},
};

enum { REFUSALS = sizeof refusals / sizeof *refusals };

/* ---- the two ways to call ------------------------------------------------------------------- */

static perp_status at_once(call *c)
{
    return perp_lcp_solve(context, c->z_out, c->w, c->ray, c->result, &c->s.settings, c->matrix,
                          c->q_in, c->lower, c->upper, c->z0);
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

static void assert_refused(const call *c, const call *before, perp_status status, int index)
{
    const refusal *expected = &refusals[index];
    const char *message = perp_context_message(context);

    if (status != expected->status)
        fail_msg("case %d (%s): status %d, expected %d: %s", index, expected->names[0], (int)status,
                 (int)expected->status, message);
    if (!strstr(message, expected->names[0]) || !strstr(message, expected->names[1]))
        fail_msg("case %d: '%s' does not name %s and %s", index, message, expected->names[0],
                 expected->names[1]);
    if (memcmp(c, before, sizeof *c) != 0)
        fail_msg("case %d (%s): an output was written", index, expected->names[0]);
}

static void test_at_once(void **state)
{
    call good;
    int k;

    (void)state;
    for (k = 0; k < REFUSALS; k++) {
        call c, before;

        memset(&c, 0, sizeof c);
        prepare(&c);
        refusals[k].spoil(&c);
        memcpy(&before, &c, sizeof c);
        assert_refused(&c, &before, at_once(&c), k);
        prepare(&good);
        assert_int_equal(at_once(&good), PERP_OK);
        assert_string_equal(perp_context_message(context), "");
        assert_int_equal(good.r.result.outcome, PERP_OUTCOME_SOLVED);
    }
}

static void test_step_by_step(void **state)
{
    perp_lcp_solver *solver;
    call good;
    double z[N];
    int k;

    (void)state;
    prepare(&good);
    assert_int_equal(perp_lcp_solver_create(context, &solver, NULL), PERP_OK);
    assert_int_equal(step_by_step(&good, solver), PERP_OK);
    memcpy(z, good.z, sizeof z);
    for (k = 0; k < REFUSALS; k++) {
        call c, before, after;

        memset(&c, 0, sizeof c);
        prepare(&c);
        refusals[k].spoil(&c);
        memcpy(&before, &c, sizeof c);
        assert_refused(&c, &before, step_by_step(&c, solver), k);
        prepare(&after);
        assert_int_equal(perp_lcp_solver_set(solver, &after.s.settings), PERP_OK);
        assert_int_equal(perp_lcp_solver_setup(solver, &good.M.view, good.lower, good.upper),
                         PERP_OK);
        assert_int_equal(
            perp_lcp_solver_solve(solver, after.z, after.w, NULL, after.result, after.q, NULL),
            PERP_OK);
        assert_memory_equal(after.z, z, sizeof z);
    }
    perp_lcp_solver_destroy(solver);
}

/* lcp.h: after a refused set or setup the old settings and the old problem are still in force. */
static void test_old_problem_survives(void **state)
{
    perp_lcp_solver *solver;
    call good;
    int k;

    (void)state;
    prepare(&good);
    assert_int_equal(perp_lcp_solver_create(context, &solver, NULL), PERP_OK);
    assert_int_equal(step_by_step(&good, solver), PERP_OK);
    for (k = 0; k < REFUSALS; k++) {
        call c, after;

        prepare(&c);
        refusals[k].spoil(&c);
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
