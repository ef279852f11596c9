/* Every factorisation that was built, through the same five functions. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "check.h"
#include "exact.h"
#include "gen.h"
#include "linalg/factor.h"

#define UNIT 0x1p-53

static const perp__factor_type *const types[] = {
    &perp__factor_lapack,
    &perp__factor_klu,
#ifdef PERP_GPL
    &perp__factor_umfpack,
    &perp__factor_cholmod,
#endif
};
enum { TYPES = sizeof types / sizeof types[0] };

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

/* A matrix both ways. The CSC pattern is that of the entries that are not zero when it is made. */
typedef struct matrix {
    int32_t n;
    double *dense, *values;
    int32_t *starts, *indices;
} matrix;

static void matrix_release(matrix *A)
{
    free(A->dense);
    free(A->values);
    free(A->starts);
    free(A->indices);
}

static matrix matrix_zero(int32_t n)
{
    matrix A;

    memset(&A, 0, sizeof A);
    A.n = n;
    A.dense = check_allocate((size_t)n * (size_t)n + 1, sizeof(double));
    return A;
}

static void matrix_compress(matrix *A)
{
    const size_t count = (size_t)A->n * (size_t)A->n + 1;
    int32_t i, j, k = 0;

    if (!A->starts) {
        A->values = check_allocate(count, sizeof(double));
        A->indices = check_allocate(count, sizeof(int32_t));
        A->starts = check_allocate((size_t)A->n + 1, sizeof(int32_t));
        for (j = 0; j < A->n; j++) {
            for (i = 0; i < A->n; i++)
                if (A->dense[i + A->n * j] != 0.0)
                    A->indices[k++] = i;
            A->starts[j + 1] = k;
        }
    }
    for (j = 0; j < A->n; j++)
        for (k = A->starts[j]; k < A->starts[j + 1]; k++)
            A->values[k] = A->dense[A->indices[k] + A->n * j];
}

static perp__square view_of(const matrix *A, const perp__factor_type *type)
{
    perp__square view;

    memset(&view, 0, sizeof view);
    view.n = A->n;
    view.values = type->sparse ? A->values : A->dense;
    view.column_starts = type->sparse ? A->starts : NULL;
    view.row_indices = type->sparse ? A->indices : NULL;
    return view;
}

/* Sparse, well conditioned, symmetric positive definite if asked for: random with a diagonal that
 * dominates; otherwise the rows are then shuffled, so that the diagonal is mostly zero. */
static matrix matrix_random(gen_random *random, int32_t n, int positive_definite)
{
    matrix A = matrix_zero(n);
    int32_t i, j, k;

    for (k = 0; k < 3 * n; k++) {
        i = gen_integer(random, n);
        j = gen_integer(random, n);
        A.dense[i + n * j] = gen_uniform(random, -1.0, 1.0);
        if (positive_definite)
            A.dense[j + n * i] = A.dense[i + n * j];
    }
    for (i = 0; i < n; i++) {
        double sum = 1.0;

        for (j = 0; j < n; j++)
            sum += fabs(A.dense[i + n * j]);
        A.dense[i + n * i] = sum;
    }
    for (i = 0; i < n && !positive_definite; i++) {
        k = gen_integer(random, n);
        for (j = 0; j < n; j++) {
            const double kept = A.dense[i + n * j];

            A.dense[i + n * j] = A.dense[k + n * j];
            A.dense[k + n * j] = kept;
        }
    }
    matrix_compress(&A);
    return A;
}

/* max |b - A x|_i / (max |A| |x|_1): the normwise backward error. */
static double backward_error(const matrix *A, int32_t transposed, const double *x, const double *b)
{
    double norm = 0.0, largest = 0.0, worst = 0.0;
    int32_t i, j;

    for (i = 0; i < A->n; i++) {
        check_sum sum;

        check_raise(&norm, 0.0);
        check_sum_clear(&sum);
        check_sum_add(&sum, b[i], 1.0);
        for (j = 0; j < A->n; j++) {
            const double entry = A->dense[transposed ? j + A->n * i : i + A->n * j];

            check_sum_add(&sum, entry, -x[j]);
            check_raise(&largest, fabs(entry));
        }
        check_raise(&worst, fabs(check_sum_value(&sum, 0)));
        norm += fabs(x[i]);
    }
    return A->n == 0 || worst == 0.0 ? 0.0 : worst / (largest * norm);
}

/* Solves with random right-hand sides, A and its transpose. */
static void check_solves(gen_random *random, const perp__factor_type *type, perp__factor *factor,
                         const matrix *A, double tolerance)
{
    double *b = check_allocate((size_t)A->n + 1, sizeof *b);
    double *x = check_allocate((size_t)A->n + 1, sizeof *x);
    int32_t transposed, i;

    for (transposed = 0; transposed < 2; transposed++) {
        double error;

        for (i = 0; i < A->n; i++)
            x[i] = b[i] = gen_normal(random);
        x[A->n] = 77.0;
        type->solve(factor, x, transposed);
        assert_true(x[A->n] == 77.0);
        error = backward_error(A, transposed, x, b);
        if (!(error <= tolerance))
            fail_msg("%s: n = %d, transposed %d: backward error %g", type->name, (int)A->n,
                     (int)transposed, error);
    }
    free(b);
    free(x);
}

static perp__factor *analysed(const perp__factor_type *type, const matrix *A)
{
    perp__factor *factor = NULL;
    perp__square view = view_of(A, type);

    view.values = NULL; /* not looked at */
    assert_int_equal(type->analyse(context, &factor, &view), PERP_OK);
    assert_non_null(factor);
    return factor;
}

static perp_status factored(const perp__factor_type *type, perp__factor *factor, const matrix *A)
{
    const perp__square view = view_of(A, type);

    return type->factor(factor, &view);
}

/* The error of elimination is n u times the factors' growth, which pivoting keeps to a factor of
 * 1000 at worst in KLU (its threshold for leaving the diagonal), to little elsewhere. Most stay
 * below 10 u; 1000 n u still tells a wrong solve from a right one by ten digits. */
static double tolerance_of(int32_t n)
{
    return 1000.0 * (n + 1) * UNIT;
}

static void test_random(void **state)
{
    static const int32_t orders[] = {0, 1, 2, 3, 10, 48, 49, 120};
    gen_random random;
    size_t k;
    int t, round;

    (void)state;
    gen_seed(&random, 1);
    for (t = 0; t < TYPES; t++)
        for (k = 0; k < sizeof orders / sizeof orders[0]; k++) {
            matrix A = matrix_random(&random, orders[k], types[t]->positive_definite);
            perp__factor *factor = analysed(types[t], &A);
            int32_t i;

            for (round = 0; round < 3; round++) {
                assert_int_equal(factored(types[t], factor, &A), PERP_OK);
                check_solves(&random, types[t], factor, &A, tolerance_of(A.n));
                for (i = 0; i < A.n * A.n; i++) /* new values, the same pattern */
                    A.dense[i] *=
                        types[t]->positive_definite ? 0.7 : gen_uniform(&random, 0.5, 1.0);
                matrix_compress(&A);
            }
            types[t]->destroy(factor);
            matrix_release(&A);
        }
    for (t = 0; t < TYPES; t++)
        types[t]->destroy(NULL);
}

/* Kept pivots that turn into zeros, or into next to nothing, must be given up. */
static void test_refactor_pivots(void **state)
{
    static const double corners[] = {2.0, 0.0, 1e-20, 1e-9, 3.0, 1e300, 0x1p-1074, 1.0};
    gen_random random;
    size_t k;
    int t;

    (void)state;
    gen_seed(&random, 2);
    for (t = 0; t < TYPES; t++) {
        matrix A = matrix_zero(3);
        perp__factor *factor;
        int32_t i;

        if (types[t]->positive_definite) {
            matrix_release(&A);
            continue;
        }
        for (i = 0; i < 9; i++)
            A.dense[i] = (double)((7 * i) % 5 + 1);
        matrix_compress(&A);
        factor = analysed(types[t], &A);
        for (k = 0; k < sizeof corners / sizeof corners[0]; k++) {
            for (i = 0; i < 9; i++)
                A.dense[i] = i % 4 == 0 ? corners[k] : (double)((7 * i) % 5 + 1);
            matrix_compress(&A);
            assert_int_equal(factored(types[t], factor, &A), PERP_OK);
            check_solves(&random, types[t], factor, &A, tolerance_of(3));
        }
        types[t]->destroy(factor);
        matrix_release(&A);
    }
}

/* Singular without a doubt: a zero row, a zero column, rows that are equal, NaN and infinities. A
 * matrix that is not comes next and is factored by the same object. */
static void test_singular(void **state)
{
    enum { N = 6, KINDS = 6 };
    static const double poison[] = {NAN, INFINITY, -INFINITY};
    gen_random random;
    int t, kind;

    (void)state;
    gen_seed(&random, 3);
    for (t = 0; t < TYPES; t++)
        for (kind = 0; kind < KINDS; kind++) {
            matrix A = matrix_zero(N);
            perp__factor *factor;
            perp__square view;
            perp_status found;
            double condition;
            int32_t i, j;

            for (i = 0; i < N * N; i++)
                A.dense[i] = i % (N + 1) == 0 ? 8.0 : 1.0;
            matrix_compress(&A);
            factor = analysed(types[t], &A);
            view = view_of(&A, types[t]);
            assert_true(types[t]->condition(factor, &view) == 0.0); /* not factored yet */
            for (i = 0; i < N && kind < 3; i++) {
                A.dense[2 + N * i] = kind == 2 ? A.dense[4 + N * i] : 0.0;
                if (kind == 1)
                    for (j = 0; j < N; j++)
                        A.dense[j + N * 2] = 0.0;
            }
            if (kind == 2) /* and symmetric again: rows and columns 2 and 4 equal */
                for (i = 0; i < N; i++)
                    A.dense[i + N * 2] = A.dense[i + N * 4] = A.dense[2 + N * i] =
                        A.dense[4 + N * i] = i == 2 || i == 4 ? 8.0 : 1.0;
            if (kind >= 3)
                A.dense[N + 1] = poison[kind - 3];
            matrix_compress(&A);
            found = factored(types[t], factor, &A);
            condition = types[t]->condition(factor, &view);
            /* where equal rows are added up in different orders, rounding leaves a pivot */
            if (found != PERP__FACTOR_SINGULAR ? kind != 2 || condition > N * UNIT
                                               : condition != 0.0)
                fail_msg("%s, kind %d: %d, condition %g", types[t]->name, kind, (int)found,
                         condition);
            for (i = 0; i < N * N; i++)
                A.dense[i] = i % (N + 1) == 0 ? 8.0 : -1.0;
            matrix_compress(&A);
            assert_int_equal(factored(types[t], factor, &A), PERP_OK);
            check_solves(&random, types[t], factor, &A, tolerance_of(N));
            types[t]->destroy(factor);
            matrix_release(&A);
        }
}

/* A pattern that no values make regular. */
static void test_structurally_singular(void **state)
{
    int t;

    (void)state;
    for (t = 0; t < TYPES; t++) {
        matrix A = matrix_zero(4);
        perp__factor *factor;
        int32_t i;

        for (i = 0; i < 4; i++)
            A.dense[i] = A.dense[4 * i] = 1.0; /* an arrow without a shaft */
        matrix_compress(&A);
        factor = analysed(types[t], &A);
        assert_int_equal(factored(types[t], factor, &A), PERP__FACTOR_SINGULAR);
        types[t]->destroy(factor);
        matrix_release(&A);
    }
}

/* Symmetric but not definite is nothing for Cholesky. */
static void test_indefinite(void **state)
{
    int t;

    (void)state;
    for (t = 0; t < TYPES; t++) {
        matrix A = matrix_zero(2);
        perp__factor *factor;

        A.dense[0] = A.dense[3] = 1.0;
        A.dense[1] = A.dense[2] = 2.0;
        matrix_compress(&A);
        factor = analysed(types[t], &A);
        assert_int_equal(factored(types[t], factor, &A),
                         types[t]->positive_definite ? PERP__FACTOR_SINGULAR : PERP_OK);
        types[t]->destroy(factor);
        matrix_release(&A);
    }
}

/* Rows and columns of sizes from 2^-450 to 2^450 change no digit: power-of-two scaling commutes
 * with elimination as long as the pivots stay. Row scaling by KLU may reorder; the residual, row by
 * row in its own scale, tells. */
static void test_ill_scaled(void **state)
{
    enum { N = 20 };
    gen_random random;
    int t;

    (void)state;
    gen_seed(&random, 4);
    for (t = 0; t < TYPES; t++) {
        matrix A = matrix_random(&random, N, 1);
        double x[N], b[N];
        int32_t e[N], i, j;
        perp__factor *factor;

        for (i = 0; i < N; i++)
            e[i] = gen_integer(&random, 901) - 450;
        for (i = 0; i < N; i++)
            for (j = 0; j < N; j++)
                A.dense[i + N * j] = ldexp(A.dense[i + N * j], e[i] + e[j]);
        matrix_compress(&A);
        factor = analysed(types[t], &A);
        if (factored(types[t], factor, &A) != PERP_OK)
            fail_msg("%s finds it singular", types[t]->name);
        for (i = 0; i < N; i++)
            x[i] = b[i] = ldexp(gen_normal(&random), e[i]);
        types[t]->solve(factor, x, 0);
        for (i = 0; i < N; i++)
            assert_true(isfinite(x[i]));
        /* back in units where every entry is of size one */
        for (i = 0; i < N; i++) {
            x[i] = ldexp(x[i], e[i]);
            b[i] = ldexp(b[i], -e[i]);
            for (j = 0; j < N; j++)
                A.dense[i + N * j] = ldexp(A.dense[i + N * j], -e[i] - e[j]);
        }
        if (types[t]->positive_definite) /* diagonal pivots are scaled along with the matrix */
            assert_true(backward_error(&A, 0, x, b) <= tolerance_of(N));
        types[t]->destroy(factor);
        matrix_release(&A);
    }
}

/* tridiag(-1, 2, -1) of order n: its inverse is min(i, j) (n + 1 - max(i, j)) / (n + 1), whose
 * largest column sum is that of the middle column m = (n + 1) / 2: m (n + 1 - m) / 2, so cond_1 =
 * 4 m (n + 1 - m) / 2. The estimator finds it, as for every matrix with an inverse >= 0. */
static void test_condition(void **state)
{
    static const int32_t orders[] = {3, 10, 77, 200};
    size_t k;
    int t;

    (void)state;
    for (t = 0; t < TYPES; t++)
        for (k = 0; k < sizeof orders / sizeof orders[0]; k++) {
            const int32_t n = orders[k], m = (n + 1) / 2;
            matrix A = matrix_zero(n);
            perp__factor *factor;
            perp__square view;
            double condition;
            int32_t i;

            for (i = 0; i < n; i++) {
                A.dense[i + n * i] = 2.0;
                if (i > 0)
                    A.dense[i - 1 + n * i] = A.dense[i + n * (i - 1)] = -1.0;
            }
            matrix_compress(&A);
            factor = analysed(types[t], &A);
            assert_int_equal(factored(types[t], factor, &A), PERP_OK);
            view = view_of(&A, types[t]);
            condition = 1.0 / types[t]->condition(factor, &view);
            /* the solves are right to about cond u < 1e-11 */
            assert_true(fabs(condition - 2.0 * m * (n + 1 - m)) <= 1e-10 * condition);
            types[t]->destroy(factor);
            matrix_release(&A);
        }
}

/* An allocator that fails at the k-th call and counts what is alive. */
typedef struct failing {
    int32_t calls, fail_at, alive;
} failing;

static void *failing_allocate(size_t size, void *user)
{
    failing *f = user;
    void *pointer;

    if (++f->calls == f->fail_at)
        return NULL;
    pointer = malloc(size);
    f->alive += pointer != NULL;
    return pointer;
}

static void failing_release(void *pointer, void *user)
{
    failing *f = user;

    f->alive--;
    free(pointer);
}

static void test_allocation_failures(void **state)
{
    gen_random random;
    int t;

    (void)state;
    gen_seed(&random, 5);
    for (t = 0; t < TYPES; t++) {
        matrix A = matrix_random(&random, 10, 1);
        const perp__square view = view_of(&A, types[t]);
        perp_status status = PERP_ERROR_MEMORY;
        int32_t k;

        for (k = 1; status != PERP_OK; k++) {
            failing f = {0, 0, 0};
            perp_context *own;
            perp_context_settings settings;
            perp__factor *factor = NULL;

            perp_context_settings_init(&settings, sizeof settings);
            settings.allocate = failing_allocate;
            settings.release = failing_release;
            settings.allocator_user = &f;
            assert_int_equal(perp_context_create(&own, &settings), PERP_OK);
            f.fail_at = f.calls + k;
            status = types[t]->analyse(own, &factor, &view);
            if (status == PERP_OK) {
                /* what follows allocates nothing of ours */
                f.fail_at = f.calls + 1;
                assert_int_equal(types[t]->factor(factor, &view), PERP_OK);
                assert_int_equal(types[t]->factor(factor, &view), PERP_OK);
                check_solves(&random, types[t], factor, &A, tolerance_of(10));
                assert_true(types[t]->condition(factor, &view) > 0.0);
                types[t]->destroy(factor);
            } else {
                assert_int_equal(status, PERP_ERROR_MEMORY);
                assert_null(factor);
                assert_non_null(strstr(perp_context_message(own), "out of memory"));
            }
            assert_int_equal(f.alive, 1); /* the context */
            perp_context_destroy(own);
            assert_int_equal(f.alive, 0);
        }
        assert_true(k > 3);
        matrix_release(&A);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_random),     cmocka_unit_test(test_refactor_pivots),
        cmocka_unit_test(test_singular),   cmocka_unit_test(test_structurally_singular),
        cmocka_unit_test(test_indefinite), cmocka_unit_test(test_ill_scaled),
        cmocka_unit_test(test_condition),  cmocka_unit_test(test_allocation_failures),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
