/* Matrix views: what is refused, the message that names the place, and that a refusal writes
 * nothing. */
#include <math.h>
#include <string.h>

#include "suite.h"

#include "linalg/matrix.h"

#include "context.h"

static perp_matrix dense(int32_t storage, int32_t rows, int32_t columns, const double *values,
                         int64_t leading_dimension)
{
    perp_matrix M = fresh_matrix();

    assert_int_equal(perp_matrix_dense(&M, storage, rows, columns, values, leading_dimension),
                     PERP_OK);
    return M;
}

static perp_matrix csc(int32_t rows, int32_t columns, const int32_t *starts, const int32_t *indices,
                       const double *values)
{
    perp_matrix M = fresh_matrix();

    assert_int_equal(perp_matrix_csc(&M, rows, columns, starts, indices, values), PERP_OK);
    return M;
}

/* Refused with this status and exactly this message; `own` keeps every byte. */
static void refused(const perp_matrix *M, perp_status status, const char *message)
{
    perp__matrix own, before;

    memset(&own, 0x5a, sizeof own);
    before = own;
    assert_int_equal(perp__matrix_read(context, "M", &own, M), status);
    assert_string_equal(perp_context_message(context), message);
    assert_memory_equal(&own, &before, sizeof own);
}

static perp__matrix accepted(const perp_matrix *M)
{
    perp__matrix own;

    memset(&own, 0x5a, sizeof own);
    assert_int_equal(perp__matrix_read(context, "M", &own, M), PERP_OK);
    assert_int_equal(own.rows, M->rows);
    assert_int_equal(own.columns, M->columns);
    return own;
}

static void test_init(void **state)
{
    perp_matrix M, grown[2];

    (void)state;
    memset(&M, 0x5a, sizeof M);
    assert_int_equal(perp_struct_init(&M, sizeof M), PERP_OK);
    assert_true(M.struct_size == sizeof M);
    assert_true(M.storage == 0 && M.rows == 0 && M.columns == 0 && M.reserved == 0);
    assert_true(M.leading_dimension == 0 && !M.values && !M.column_starts && !M.row_indices);
    /* a caller compiled against a later, larger struct */
    assert_int_equal(perp_struct_init(grown, sizeof grown), PERP_OK);
    assert_int_equal(perp_matrix_dense(grown, PERP_STORAGE_ROW_MAJOR, 0, 0, NULL, 1), PERP_OK);
    accepted(grown);
    grown[1].rows = 1;
    assert_int_equal(perp_matrix_dense(grown, PERP_STORAGE_ROW_MAJOR, 0, 0, NULL, 1),
                     PERP_ERROR_ABI);
}

static void test_fill_needs_init(void **state)
{
    perp_matrix M, before;

    (void)state;
    memset(&M, 0, sizeof M);
    before = M;
    assert_int_equal(perp_matrix_dense(&M, 0, 1, 1, NULL, 1), PERP_ERROR_ABI);
    assert_int_equal(perp_matrix_csc(&M, 1, 1, NULL, NULL, NULL), PERP_ERROR_ABI);
    assert_memory_equal(&M, &before, sizeof M);
    assert_int_equal(perp_matrix_dense(NULL, 0, 1, 1, NULL, 1), PERP_ERROR_ABI);
    assert_int_equal(perp_matrix_csc(NULL, 1, 1, NULL, NULL, NULL), PERP_ERROR_ABI);
}

static void test_struct(void **state)
{
    double value = 1.0;
    perp_matrix M = dense(PERP_STORAGE_COLUMN_MAJOR, 1, 1, &value, 1);

    (void)state;
    refused(NULL, PERP_ERROR_ARGUMENT, "M is NULL");
    M.struct_size = 0;
    refused(&M, PERP_ERROR_ABI, "M.struct_size is 0, at least 56 expected: initialise it first");
    M = dense(3, 1, 1, &value, 1);
    refused(&M, PERP_ERROR_ARGUMENT, "M.storage is 3, not a storage");
    M = dense(-1, 1, 1, &value, 1);
    refused(&M, PERP_ERROR_ARGUMENT, "M.storage is -1, not a storage");
    M = dense(0, -1, 1, &value, 1);
    refused(&M, PERP_ERROR_ARGUMENT, "M.rows is -1");
    M = dense(0, 1, -2, &value, 1);
    refused(&M, PERP_ERROR_ARGUMENT, "M.columns is -2");
    M = csc(1, INT32_MIN, NULL, NULL, NULL);
    refused(&M, PERP_ERROR_ARGUMENT, "M.columns is -2147483648");
    M = dense(0, 1, 1, &value, 1);
    M.reserved = 7;
    refused(&M, PERP_ERROR_ARGUMENT, "M.reserved is 7, 0 expected");
}

static void test_dense_shape(void **state)
{
    static const double values[6] = {0.0};
    static const int32_t index = 0;
    perp_matrix M = dense(PERP_STORAGE_COLUMN_MAJOR, 3, 2, values, 2);

    (void)state;
    refused(&M, PERP_ERROR_ARGUMENT, "M.leading_dimension is 2, at least 3 expected");
    M.storage = PERP_STORAGE_ROW_MAJOR;
    accepted(&M);
    M.leading_dimension = 1;
    refused(&M, PERP_ERROR_ARGUMENT, "M.leading_dimension is 1, at least 2 expected");
    M.leading_dimension = -5;
    refused(&M, PERP_ERROR_ARGUMENT, "M.leading_dimension is -5, at least 2 expected");
    /* 3 * 2^62 doubles: the product of the sizes wraps round */
    M.leading_dimension = INT64_C(1) << 62;
    refused(&M, PERP_ERROR_ARGUMENT, "M.leading_dimension is 4611686018427387904, too large");
    M.leading_dimension = INT64_MAX;
    refused(&M, PERP_ERROR_ARGUMENT, "M.leading_dimension is 9223372036854775807, too large");
    M = dense(PERP_STORAGE_COLUMN_MAJOR, 3, 2, NULL, 3);
    refused(&M, PERP_ERROR_ARGUMENT, "M.values is NULL");
    M = dense(PERP_STORAGE_COLUMN_MAJOR, 3, 2, values, 3);
    M.column_starts = &index;
    refused(&M, PERP_ERROR_ARGUMENT, "M is dense but M.column_starts is not NULL");
    M.column_starts = NULL;
    M.row_indices = &index;
    refused(&M, PERP_ERROR_ARGUMENT, "M is dense but M.row_indices is not NULL");
}

static void test_dense_strides(void **state)
{
    static const double values[12] = {0.0};
    perp_matrix M = dense(PERP_STORAGE_COLUMN_MAJOR, 3, 2, values, 5);
    perp__matrix own = accepted(&M);

    (void)state;
    assert_true(own.row_stride == 1 && own.column_stride == 5 && own.values == values);
    assert_true(!own.column_starts && !own.row_indices);
    M.storage = PERP_STORAGE_ROW_MAJOR;
    M.leading_dimension = 4;
    own = accepted(&M);
    assert_true(own.row_stride == 4 && own.column_stride == 1 && own.values == values);
}

static void test_dense_values(void **state)
{
    double values[8 * 7] = {0.0};
    perp_matrix by_columns = dense(PERP_STORAGE_COLUMN_MAJOR, 5, 7, values, 8);
    perp_matrix by_rows = dense(PERP_STORAGE_ROW_MAJOR, 7, 5, values, 8);
    size_t k;

    (void)state;
    /* subnormal, huge and negative numbers pass; what lies between the columns is not read */
    for (k = 0; k < 56; k++)
        values[k] = k % 8 >= 5 ? NAN : k % 3 == 0 ? 5e-324 : k % 3 == 1 ? -1.7e308 : -0.0;
    accepted(&by_columns);
    accepted(&by_rows);
    values[3 + 5 * 8] = NAN;
    refused(&by_columns, PERP_ERROR_NOT_FINITE, "M(3,5) is nan");
    refused(&by_rows, PERP_ERROR_NOT_FINITE, "M(5,3) is nan");
    values[3 + 5 * 8] = -NAN;
    refused(&by_columns, PERP_ERROR_NOT_FINITE, "M(3,5) is nan");
    values[4] = -INFINITY; /* the first one is named */
    refused(&by_columns, PERP_ERROR_NOT_FINITE, "M(4,0) is -inf");
    values[0] = INFINITY;
    refused(&by_rows, PERP_ERROR_NOT_FINITE, "M(0,0) is inf");
    values[0] = values[4] = values[3 + 5 * 8] = 0.0;
    values[4 + 6 * 8] = INFINITY;
    refused(&by_columns, PERP_ERROR_NOT_FINITE, "M(4,6) is inf");
}

static void test_csc_starts(void **state)
{
    int32_t starts[4] = {0, 2, 2, 5}, indices[5] = {0, 3, 1, 2, 3};
    double values[5] = {1, 2, 3, 4, 5};
    perp_matrix M = csc(4, 3, starts, indices, values);
    perp__matrix own = accepted(&M);

    (void)state;
    assert_true(own.column_starts == starts && own.row_indices == indices && own.values == values);
    M.column_starts = NULL;
    refused(&M, PERP_ERROR_ARGUMENT, "M.column_starts is NULL");
    M.column_starts = starts;
    M.row_indices = NULL;
    refused(&M, PERP_ERROR_ARGUMENT, "M.row_indices is NULL");
    M.row_indices = indices;
    M.values = NULL;
    refused(&M, PERP_ERROR_ARGUMENT, "M.values is NULL");
    M.values = values;
    starts[0] = 1;
    refused(&M, PERP_ERROR_ARGUMENT, "M.column_starts[0] is 1, 0 expected");
    starts[0] = -1;
    refused(&M, PERP_ERROR_ARGUMENT, "M.column_starts[0] is -1, 0 expected");
    starts[0] = 0;
    starts[2] = 1;
    refused(&M, PERP_ERROR_ARGUMENT, "M.column_starts[2] = 1 is below M.column_starts[1] = 2");
    /* starts that run ahead must not be followed into the arrays before all are checked */
    starts[2] = 1000000000;
    refused(&M, PERP_ERROR_ARGUMENT,
            "M.column_starts[3] = 5 is below M.column_starts[2] = 1000000000");
}

static void test_csc_indices(void **state)
{
    int32_t starts[4] = {0, 2, 2, 5}, indices[5] = {0, 3, 1, 2, 3};
    double values[5] = {1, 2, 3, 4, 5};
    perp_matrix M = csc(4, 3, starts, indices, values);

    (void)state;
    indices[1] = 4;
    refused(&M, PERP_ERROR_ARGUMENT, "M.row_indices[1] = 4 in column 0 is outside 0 .. 3");
    indices[1] = 3;
    indices[2] = -1;
    refused(&M, PERP_ERROR_ARGUMENT, "M.row_indices[2] = -1 in column 2 is outside 0 .. 3");
    indices[2] = 2;
    refused(&M, PERP_ERROR_ARGUMENT,
            "M.row_indices[3] = 2 is not above M.row_indices[2] = 2 in column 2");
    indices[2] = 3;
    refused(&M, PERP_ERROR_ARGUMENT,
            "M.row_indices[3] = 2 is not above M.row_indices[2] = 3 in column 2");
    indices[2] = 1;
    values[3] = NAN;
    refused(&M, PERP_ERROR_NOT_FINITE, "M(2,2) = M.values[3] is nan");
    values[3] = 0.0; /* a stored zero */
    values[4] = -INFINITY;
    refused(&M, PERP_ERROR_NOT_FINITE, "M(3,2) = M.values[4] is -inf");
    values[4] = 5.0;
    accepted(&M);
}

static void test_empty(void **state)
{
    static const int32_t zeros[4] = {0};
    static const int32_t one[1] = {1};
    perp_matrix M = dense(PERP_STORAGE_COLUMN_MAJOR, 0, 0, NULL, 1);
    perp__matrix own;

    (void)state;
    accepted(&M);
    M = dense(PERP_STORAGE_ROW_MAJOR, 0, 3, NULL, 3);
    accepted(&M);
    M = dense(PERP_STORAGE_COLUMN_MAJOR, 0, 3, NULL, 1);
    accepted(&M);
    M.leading_dimension = 0;
    refused(&M, PERP_ERROR_ARGUMENT, "M.leading_dimension is 0, at least 1 expected");
    M = csc(0, 0, NULL, NULL, NULL);
    accepted(&M);
    M = csc(0, 0, zeros, NULL, NULL);
    accepted(&M);
    M = csc(0, 0, one, NULL, NULL);
    refused(&M, PERP_ERROR_ARGUMENT, "M.column_starts[0] is 1, 0 expected");
    M = csc(2, 3, zeros, NULL, NULL);
    own = accepted(&M);
    assert_true(own.column_starts == zeros);
}

/* A long argument name must not run over the message's end. */
static void test_long_name(void **state)
{
    char name[600];
    perp_matrix M = dense(PERP_STORAGE_COLUMN_MAJOR, 1, 1, NULL, 1);
    perp__matrix own;

    (void)state;
    memset(name, 'x', sizeof name - 1);
    name[sizeof name - 1] = '\0';
    assert_int_equal(perp__matrix_read(context, name, &own, &M), PERP_ERROR_ARGUMENT);
    assert_true(strlen(perp_context_message(context)) < sizeof name);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_init),          cmocka_unit_test(test_fill_needs_init),
        cmocka_unit_test(test_struct),        cmocka_unit_test(test_dense_shape),
        cmocka_unit_test(test_dense_strides), cmocka_unit_test(test_dense_values),
        cmocka_unit_test(test_csc_starts),    cmocka_unit_test(test_csc_indices),
        cmocka_unit_test(test_empty),         cmocka_unit_test(test_long_name),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
