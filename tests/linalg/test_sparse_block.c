/* Principal blocks of sparse matrices of every kind: tridiagonal, symmetric, general. */
#include "suite.h"

#include "linalg/sparse_block.h"
#include "linalg/squares.h"

enum { TRIDIAGONAL, SYMMETRIC, INDEFINITE, GENERAL, MATRICES };

static const int32_t kinds[] = {PERP__SPARSE_TRIDIAGONAL, PERP__SPARSE_SYMMETRIC,
                                PERP__SPARSE_SYMMETRIC, PERP__SPARSE_GENERAL};

/* Tridiagonal ones need row exchanges: the diagonal is small. Indefinite ones have a positive
 * diagonal and a pair of rows with a negative minor. */
static matrix make_matrix(gen_random *random, int32_t n, int which)
{
    matrix A;
    int32_t i;

    if (which != TRIDIAGONAL) {
        A = matrix_random(random, n, which != GENERAL);
        if (which == INDEFINITE && n > 1)
            A.dense[1] = A.dense[n] = 3.0 * (A.dense[0] + A.dense[n + 1]);
    } else {
        A = matrix_zero(n);
        for (i = 0; i < n; i++) {
            A.dense[i + n * i] = gen_uniform(random, -0.5, 0.5);
            if (i > 0 && gen_integer(random, 8) > 0) {
                A.dense[i + n * (i - 1)] = gen_uniform(random, 1.0, 1.5);
                A.dense[i - 1 + n * i] = gen_uniform(random, -2.0, -0.5);
            }
        }
    }
    free(A.values);
    free(A.indices);
    free(A.starts);
    A.values = NULL;
    A.indices = A.starts = NULL;
    matrix_compress(&A);
    return A;
}

static int32_t choose(gen_random *random, int32_t n, int32_t *active, int32_t of_eight)
{
    int32_t count = 0, i;

    for (i = 0; i < n; i++)
        if (gen_integer(random, 8) < of_eight)
            active[count++] = i;
    return count;
}

/* The block as a matrix of its own. */
static matrix block_of(const matrix *A, const int32_t *active, int32_t count, double rho)
{
    matrix B = matrix_zero(count);
    int32_t r, c;

    for (c = 0; c < count; c++)
        for (r = 0; r < count; r++)
            B.dense[r + count * c] = A->dense[active[r] + A->n * active[c]] + (r == c ? rho : 0.0);
    return B;
}

/* Entries outside of the block keep their values. Blocks of the tridiagonal matrices may be nearly
 * singular; the backward error is small all the same. */
static void check_block_solve(gen_random *random, perp__sparse_block *block, const matrix *A,
                              const int32_t *active, int32_t count, double rho, int transposed)
{
    matrix B = block_of(A, active, count, rho);
    double *x = check_allocate((size_t)A->n + 1, sizeof *x);
    double *b = check_allocate((size_t)A->n + 1, sizeof *b);
    double *y = check_allocate((size_t)A->n + 1, sizeof *y);
    double error;
    int32_t i, k;

    for (i = 0; i < A->n; i++)
        x[i] = 1e300;
    for (k = 0; k < count; k++)
        x[active[k]] = b[k] = gen_normal(random);
    perp__sparse_block_solve(block, x, transposed);
    for (k = 0; k < count; k++) {
        y[k] = x[active[k]];
        x[active[k]] = 1e300;
    }
    for (i = 0; i < A->n; i++)
        assert_true(x[i] == 1e300);
    error = backward_error(&B, transposed, y, b);
    if (!(error <= tolerance_of(count)))
        fail_msg("n = %d, %d active: backward error %g", (int)A->n, (int)count, error);
    free(x);
    free(b);
    free(y);
    matrix_release(&B);
}

static void check_matrix(gen_random *random, perp__sparse_block *block, int which, int32_t n,
                         int is_dense)
{
    matrix A = make_matrix(random, n, which);
    const perp__matrix M =
        is_dense ? (perp__matrix){n, n, 1, (size_t)n, A.dense, NULL, NULL} : sparse_view(&A);
    int32_t *active = check_allocate((size_t)n + 1, sizeof *active);
    double *norms = check_allocate((size_t)n + 1, sizeof *norms);
    int32_t round;

    for (int32_t k = 0; k < n * n; k++)
        norms[k % n] += fabs(A.dense[k]);
    assert_int_equal(perp__sparse_block_read(block, &M, norms), PERP_OK);
    if (n > 20)
        assert_int_equal(block->kind, is_dense ? PERP__DENSE : kinds[which]);
    for (round = 0; round < 6; round++) {
        const int32_t count = choose(random, n, active, round < 5 ? 3 + round : 0);
        const double rho = round % 2 ? 0.25 : 0.0;
        const perp_status status = perp__sparse_block_factor(block, active, count, rho);

        if (which == GENERAL && status == PERP__FACTOR_SINGULAR)
            continue; /* many entries of its diagonal are zero */
        assert_int_equal(status, PERP_OK);
        check_block_solve(random, block, &A, active, count, rho, 0);
        check_block_solve(random, block, &A, active, count, rho, 1);
    }
    free(active);
    free(norms);
    matrix_release(&A);
}

static void test_blocks(void **state)
{
    static const int32_t orders[] = {0, 1, 2, 3, 30, 61, 30};
    perp__sparse_block block;
    gen_random random;
    size_t k;
    int which, round;

    (void)state;
    gen_seed(&random, 91);
    memset(&block, 0, sizeof block);
    block.context = context;
    for (round = 0; round < 5; round++)
        for (k = 0; k < sizeof orders / sizeof *orders; k++)
            for (which = 0; which < MATRICES; which++)
                check_matrix(&random, &block, which, orders[k], round % 2);
    perp__sparse_block_release(&block);
}

/* The same block after others and after one that a deadline refused, and in a fresh object: the
 * same bits. */
static void test_history_leaves_no_trace(void **state)
{
    enum { N = 50 };
    int32_t first[N], second[N], count_first, count_second, i;
    gen_random random;
    int which;

    (void)state;
    gen_seed(&random, 92);
    for (which = 0; which < MATRICES - 1; which++) {
        matrix A = make_matrix(&random, N, which);
        perp__matrix M = sparse_view(&A);
        perp__sparse_block used, fresh;
        double x[N], y[N];

        memset(&used, 0, sizeof used);
        used.context = context;
        memset(&fresh, 0, sizeof fresh);
        fresh.context = context;
        assert_int_equal(perp__sparse_block_read(&used, &M, NULL), PERP_OK);
        assert_int_equal(perp__sparse_block_read(&fresh, &M, NULL), PERP_OK);
        count_first = choose(&random, N, first, 6);
        count_second = choose(&random, N, second, 4);
        assert_int_equal(perp__sparse_block_factor(&used, first, count_first, 0.0), PERP_OK);
        assert_int_equal(perp__sparse_block_factor(&used, second, count_second, 0.5), PERP_OK);
        perp__sparse_block_restart(&used, 1e-9); /* long past */
        assert_int_equal(perp__sparse_block_factor(&used, first, count_first, 0.5),
                         PERP__FACTOR_SINGULAR);
        assert_true(used.late);
        perp__sparse_block_restart(&used, 0.0);
        assert_int_equal(perp__sparse_block_factor(&used, first, count_first, 0.0), PERP_OK);
        assert_int_equal(perp__sparse_block_factor(&used, first, count_first, 0.0), PERP_OK);
        assert_int_equal(perp__sparse_block_factor(&fresh, first, count_first, 0.0), PERP_OK);
        for (i = 0; i < N; i++)
            x[i] = y[i] = gen_normal(&random);
        perp__sparse_block_solve(&used, x, 0);
        perp__sparse_block_solve(&fresh, y, 0);
        assert_memory_equal(x, y, sizeof x);
        perp__sparse_block_release(&used);
        perp__sparse_block_release(&fresh);
        matrix_release(&A);
    }
}

/* Neighbours at four random distances on a ring: factors fill in. Entries have both signs, so that
 * multigrid is not for it; the diagonal is the sum of a row's absolute values and `more`. */
typedef struct ring {
    int32_t *starts, *rows;
    double *values;
} ring;

enum { RING = 3000, SHIFTS = 4 };

static ring make_ring(gen_random *random, double more)
{
    int32_t shifts[SHIFTS], at = 0;
    double *weights = check_allocate(SHIFTS * RING, sizeof *weights);
    ring r = {check_allocate(RING + 1, sizeof *r.starts),
              check_allocate((2 * SHIFTS + 1) * RING, sizeof *r.rows),
              check_allocate((2 * SHIFTS + 1) * RING, sizeof *r.values)};

    for (int32_t k = 0; k < SHIFTS; k++) /* none of which is another's, or half of the ring */
        shifts[k] = 1 + k * RING / 10 + gen_integer(random, RING / 10 - 1);
    for (int32_t k = 0; k < SHIFTS * RING; k++)
        weights[k] = (k % 2 ? 1.0 : -1.0) * gen_uniform(random, 1.0, 1.5);
    for (int32_t j = 0; j < RING; j++) {
        double sum = more;

        r.starts[j] = at;
        for (int32_t k = 0; k < 2 * SHIFTS + 1; k++) {
            const int32_t shift = k < SHIFTS ? shifts[k] : k < 2 * SHIFTS ? -shifts[k - SHIFTS] : 0;
            const int32_t row = (j + shift + RING) % RING;
            const double weight = weights[k < SHIFTS       ? k * RING + j
                                          : k < 2 * SHIFTS ? (k - SHIFTS) * RING + row
                                                           : 0];
            int32_t place = at++;

            for (; place > r.starts[j] && r.rows[place - 1] > row; place--) {
                r.rows[place] = r.rows[place - 1];
                r.values[place] = r.values[place - 1];
            }
            r.rows[place] = row;
            r.values[place] = shift ? weight : sum;
            sum += fabs(weight);
        }
    }
    r.starts[RING] = at;
    free(weights);
    return r;
}

/* Blocks that would fill in are solved by steps, as far as a rough solve promises; where these end
 * with nothing (a diagonal of 4, eight entries of 1.25 beside it: eigenvalues down to 4 - 1.25 * 2
 * sqrt(7) < 0) by factors. The second time in the same object the bits are the same. */
static void test_fill_is_left_out(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 17);
    for (int32_t hard = 0; hard < 2; hard++) {
        ring r = make_ring(&random, hard ? -6.0 : 0.1);
        const perp__matrix M = {RING, RING, 0, 0, r.values, r.starts, r.rows};
        double *x = check_allocate(3 * RING, sizeof *x), *b = x + RING, *first = b + RING;
        int32_t *active = check_allocate(RING, sizeof *active), count = 0;
        double left = 0.0, size = 0.0;
        perp__sparse_block block;

        memset(&block, 0, sizeof block);
        block.context = context;
        for (int32_t i = 0; i < RING; i++) {
            b[i] = gen_normal(&random);
            if (gen_integer(&random, 20) > 0)
                active[count++] = i;
        }
        assert_int_equal(perp__sparse_block_read(&block, &M, NULL), PERP_OK);
        for (int32_t round = 0; round < 2; round++) {
            perp__sparse_block_restart(&block, 0.0);
            assert_int_equal(perp__sparse_block_approach(&block, active, count), PERP_OK);
            assert_true(block.by_steps > 0 && !block.factored);
            memcpy(x, b, RING * sizeof *x);
            assert_int_equal(perp__sparse_block_solve_roughly(&block, x), PERP_OK);
            assert_true(hard ? block.factored : !block.factored);
            if (round == 0)
                memcpy(first, x, RING * sizeof *x);
        }
        assert_memory_equal(x, first, RING * sizeof *x);
        for (int32_t i = 0, at = 0; i < RING; i++) { /* x is b outside of the block */
            if (at < count && active[at] == i)
                at++;
            else
                x[i] = 0.0;
        }
        for (int32_t k = 0; k < count; k++) {
            const int32_t j = active[k];
            double sum = -b[j];

            for (int32_t e = r.starts[j]; e < r.starts[j + 1]; e++)
                sum += r.values[e] * x[r.rows[e]];
            left += sum * sum;
            size += b[j] * b[j];
        }
        assert_true(sqrt(left) <= 1.01 * PERP__ROUGH * sqrt(size)); /* 1.01: rounding */
        perp__sparse_block_release(&block);
        free(r.starts);
        free(r.rows);
        free(r.values);
        free(x);
        free(active);
    }
}

/* Rows that are equal leave no factors, with rho they do. */
static void test_singular(void **state)
{
    static const int32_t active[] = {0, 1, 2};
    gen_random random;
    perp__sparse_block block;
    matrix A = matrix_zero(3);
    perp__matrix M;
    int32_t k;

    (void)state;
    gen_seed(&random, 93);
    for (k = 0; k < 9; k++)
        A.dense[k] = 1.0;
    matrix_compress(&A);
    M = sparse_view(&A);
    memset(&block, 0, sizeof block);
    block.context = context;
    assert_int_equal(perp__sparse_block_read(&block, &M, NULL), PERP_OK);
    assert_int_equal(perp__sparse_block_factor(&block, active, 3, 0.0), PERP__FACTOR_SINGULAR);
    assert_int_equal(perp__sparse_block_factor(&block, active, 3, 0.25), PERP_OK);
    check_block_solve(&random, &block, &A, active, 3, 0.25, 0);
    assert_int_equal(perp__sparse_block_factor(&block, active, 3, 0.0), PERP__FACTOR_SINGULAR);
    perp__sparse_block_release(&block);
    matrix_release(&A);
}

/* Two triangles that were rounded differently are one symmetric matrix, larger differences not. */
static void test_symmetry(void **state)
{
    static const double factors[] = {1.0, 1.0 + 0x1p-51, 1.0 + 1e-10};
    perp__sparse_block block;
    int k;

    (void)state;
    memset(&block, 0, sizeof block);
    block.context = context;
    for (k = 0; k < 3; k++) {
        matrix A = matrix_zero(3);
        perp__matrix M;

        A.dense[0] = A.dense[4] = A.dense[8] = 4.0;
        A.dense[2] = A.dense[1] = A.dense[3] = -1.0;
        A.dense[6] = -factors[k];
        matrix_compress(&A);
        M = sparse_view(&A);
        assert_int_equal(perp__sparse_block_read(&block, &M, NULL), PERP_OK);
        assert_int_equal(block.kind, k < 2 ? PERP__SPARSE_SYMMETRIC : PERP__SPARSE_GENERAL);
        assert_true(block.has_z_signs);
        matrix_release(&A);
    }
    perp__sparse_block_release(&block);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_blocks),
        cmocka_unit_test(test_fill_is_left_out),
        cmocka_unit_test(test_history_leaves_no_trace),
        cmocka_unit_test(test_singular),
        cmocka_unit_test(test_symmetry),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
