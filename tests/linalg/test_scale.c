/* Equilibration: what scale.h promises, entry by entry, and bit for bit under powers of two. */
#include <limits.h>
#include <math.h>
#include <string.h>

#include "suite.h"

#include "linalg/scale.h"
#include "linalg/views.h"

enum { LARGEST = 60 };

static void equilibrate(const perp__matrix *M, int32_t *e)
{
    int32_t work[2 * LARGEST + 1];
    double norms[LARGEST];

    work[2 * M->rows] = 77;
    perp__equilibrate(M, 1, e, norms, work);
    assert_int_equal(work[2 * M->rows], 77);
}

/* All storages agree with each other and with the independent version of the tests' checks. */
static void exponents_of(int32_t n, const double *entries, int32_t *e)
{
    int32_t other[LARGEST];
    views v;
    int k;

    views_make(&v, n, n, entries);
    equilibrate(&v.view[0], e);
    for (k = 0; k < VIEWS; k++) {
        equilibrate(&v.view[k], other);
        assert_memory_equal(e, other, (size_t)n * sizeof *e);
    }
    check_exponents(&v.caller[VIEW_CSC], 1, other);
    assert_memory_equal(e, other, (size_t)n * sizeof *e);
    views_release(&v);
}

static void expect(int32_t n, const double *entries, const int32_t *expected)
{
    int32_t e[LARGEST], i;

    exponents_of(n, entries, e);
    for (i = 0; i < n; i++)
        assert_int_equal(e[i], expected[i]);
}

static void test_power_of_two(void **state)
{
    int32_t e;

    (void)state;
    for (e = -1022; e <= 1022; e++)
        assert_true(perp__power_of_two(e) == ldexp(1.0, e));
}

static void test_diagonal(void **state)
{
    static const double sizes[] = {1.0,     0.5,      2.0, 3.999, 4.0,        0.25,
                                   0x1p100, 0x1p-101, 1e9, 1e-12, 0x1.fp1020, 0x1p-1020};
    double entries[12 * 12] = {0.0};
    int32_t e[LARGEST], i;

    (void)state;
    for (i = 0; i < 12; i++) {
        entries[13 * i] = sizes[i];
        if (i > 0)
            /* couplings don't count where there is a diagonal, up to 2^40 times their fair share */
            entries[13 * i - 1] = sqrt(sizes[i]) * sqrt(sizes[i - 1]) * 0x1p38;
    }
    exponents_of(12, entries, e);
    for (i = 0; i < 12; i++) {
        const double scaled = ldexp(sizes[i], 2 * e[i]);

        assert_true(scaled >= 0.5 && scaled < 2.0);
    }
}

/* A diagonal, or a coupling that gave a row its scale, of 2^-40 of another entry is noise. */
static void test_noise(void **state)
{
    /* [[1, 2^60], [2^60, 1]]: both diagonals are; 2^-30 each makes the coupling 1 */
    static const double diagonals[4] = {1, 0x1p60, 0x1p60, 1};
    /* F18: [[1, e, 0], [e, -1, 2], [0, 2, -1]]: the couplings e are noise beside -1. Row 2 has its
     * couplings to rows with a positive diagonal, none, and its own -1. */
    static const double negative[9] = {1, 1e-13, 0, 1e-13, -1, 2, 0, 2, -1};
    /* [[1, e, e], [e, 0, 2], [e, 2, 0]], e = 2^-50: 2 would become 2^101; 101 / 2 = 50 of it goes
     * to either row. What is left, 2^1, is near enough. */
    static const double corner[9] = {1, 0x1p-50, 0x1p-50, 0x1p-50, 0, 2, 0x1p-50, 2, 0};

    (void)state;
    expect(2, diagonals, (const int32_t[2]){-30, -30});
    expect(3, negative, (const int32_t[3]){0, 0, 0});
    expect(3, corner, (const int32_t[3]){0, 0, 0});
}

static void test_couplings(void **state)
{
    /* columns of [[4, 0, 6, 0], [0, 1, 0, 40], [5, 0, 0, 0], [-3, 0, 0, -9]] */
    static const double entries[16] = {4, 0, 5, -3, 0, 1, 0, 0, 6, 0, 0, 0, 0, 40, 0, -9};
    /* 4 2^(2e) in [1/2, 2): e = -1. Row 2: max(6, 5) / 2 = 3 in [2, 4): e = -1. Row 3: 40 by the
     * column beats 3/2 by the row, in [32, 64): e = -5, whatever its negative diagonal is. */
    static const int32_t expected[4] = {-1, 0, -1, -5};

    (void)state;
    expect(4, entries, expected);
}

/* A chain from one diagonal: each row is scaled by its neighbour on the level before, not by the
 * stronger coupling to the one after. */
static void test_breadth_first(void **state)
{
    enum { N = 50 };
    static double entries[N * N];
    int32_t expected[N], i;

    (void)state;
    entries[(N - 1) * (N + 1)] = 0.75;
    expected[N - 1] = 0;
    for (i = N - 2; i >= 0; i--) {
        const int32_t power = (i * 7) % 11 - 5;

        /* above or below the diagonal in turn */
        entries[i % 2 == 0 ? i + N * (i + 1) : i + 1 + N * i] = -1.5 * ldexp(1.0, power);
        expected[i] = -(power + expected[i + 1]);
    }
    expect(N, entries, expected);
}

static void test_without_diagonal(void **state)
{
    double entries[49] = {0.0};
    static const int32_t expected[7] = {-3, -2, -1, 1, 0, 1, -3};

    (void)state;
    entries[0 + 7 * 6] = 8.0; /* rows 0, 6: 6 has -64, which a unit makes 2^-3 ... */
    entries[6 + 7 * 6] = -64.0;
    entries[2 + 7 * 1] = 0x1p3; /* rows 1, 2: no diagonal, 1 has half of 2^3, rounded up */
    entries[3 + 7 * 5] = 0.3;   /* rows 3, 5 */
    expect(7, entries, (const int32_t[7]){0, -2, -1, 1, 0, 1, -3});
    entries[0 + 7 * 6] = 64.0; /* ... and row 0 follows it: 64 / 8 = 2^3 */
    expect(7, entries, expected);
}

static void test_zero_and_empty(void **state)
{
    static const double zeros[9] = {0.0};
    static const int32_t expected[3] = {0, 0, 0};

    (void)state;
    expect(3, zeros, expected);
    expect(0, zeros, NULL);
}

static void test_stored_zeros(void **state)
{
    static const int32_t starts[4] = {0, 2, 4, 5}, indices[5] = {0, 1, 1, 2, 2};
    static const double values[5] = {64.0, 0.0, 0.0, 0.0, 0.25};
    int32_t e[3];
    perp_matrix M = matrix_csc(3, 3, starts, indices, values);
    perp__matrix own;

    (void)state;
    assert_int_equal(perp__matrix_read(NULL, "M", &own, &M), PERP_OK);
    equilibrate(&own, e);
    assert_true(e[0] == -3 && e[1] == 0 && e[2] == 1);
}

/* Row 1 has its scale from row 0, before the search in the part without a diagonal: that leaves it.
 */
static void test_parts(void **state)
{
    static const int32_t expected[4] = {0, -24, 0, 0};
    double entries[16] = {0.0};

    (void)state;
    entries[0 + 4 * 0] = 1.0;
    entries[0 + 4 * 1] = 0x1p24;
    entries[2 + 4 * 3] = 1.0;
    expect(4, entries, expected);
}

static void test_clamp(void **state)
{
    double entries[25] = {0.0};
    int32_t e[LARGEST], i;

    (void)state;
    entries[0 + 5 * 0] = 0x1p-1074;  /* asks for 2^537 */
    entries[1 + 5 * 1] = 0x1.fp1023; /* 2^-512 */
    entries[2 + 5 * 2] = 1.0;
    entries[3 + 5 * 0] = 0x1p-1074; /* 2^(1074 - 511) */
    entries[4 + 5 * 2] = 0x1p1023;  /* 2^-1023; the diagonal 1 is noise beside it */
    exponents_of(5, entries, e);
    assert_true(e[0] == 511 && e[1] == -511 && e[2] < 0 && e[3] == 511 && e[4] == -511);
    for (i = 0; i < 5; i++)
        assert_true(e[i] >= -511 && e[i] <= 511);
}

static void test_disabled(void **state)
{
    static const double entries[4] = {100.0, 3.0, 4.0, 0.0};
    int32_t e[2] = {5, 5}, work[4];
    double norms[2];
    views v;

    (void)state;
    views_make(&v, 2, 2, entries);
    perp__equilibrate(&v.view[0], 0, e, norms, work);
    assert_true(e[0] == 0 && e[1] == 0);
    views_release(&v);
}

/* Row and column i of M times 2^k_i, |k_i| <= 250: e_i must become e_i - k_i in rows that hang
 * together with a positive diagonal, and in none that don't may S change by more than one common
 * factor; the scaled matrix keeps every bit. */
static void check_invariance(gen_random *random, int32_t n, const double *entries)
{
    static double moved[LARGEST * LARGEST];
    int32_t e[LARGEST], f[LARGEST], powers[LARGEST], i, j;

    for (i = 0; i < n; i++)
        powers[i] = gen_integer(random, 501) - 250;
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            moved[i + n * j] = ldexp(entries[i + n * j], powers[i] + powers[j]);
    exponents_of(n, entries, e);
    exponents_of(n, moved, f);
    for (i = 0; i < n; i++)
        assert_int_equal(f[i], e[i] - powers[i]);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            assert_true(ldexp(moved[i + n * j], f[i] + f[j]) ==
                        ldexp(entries[i + n * j], e[i] + e[j]));
}

static void test_invariance_random(void **state)
{
    static double entries[LARGEST * LARGEST];
    gen_random random;
    int32_t round, n, i, j;

    (void)state;
    gen_seed(&random, 1);
    for (round = 0; round < 100; round++) {
        n = 1 + gen_integer(&random, 20);
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++)
                entries[i + n * j] = gen_integer(&random, 4) == 0 ? gen_normal(&random) : 0.0;
        /* row 0 is anchored, and through the first row or column so is all that would not be */
        for (i = 1; i < n; i++)
            if (!(entries[i + n * i] > 0.0))
                entries[i % 2 == 0 ? i : n * i] = gen_normal(&random);
        entries[0] = 0.1 + gen_uniform(&random, 0.0, 10.0);
        check_invariance(&random, n, entries);
    }
}

/* Stewart and Trinkle's LCP: the friction bounds' rows have no diagonal, and are reached through
 * the tangential rows. */
static void test_invariance_contact(void **state)
{
    gen_contact_options options = {3, 4, 4, 1e6, 0.9, 1, 1};
    static double entries[LARGEST * LARGEST];
    gen_random random;
    int32_t round, i, j;

    (void)state;
    gen_seed(&random, 2);
    for (round = 0; round < 20; round++) {
        gen_lcp problem;

        memset(&problem, 0, sizeof problem);
        gen_contact(&problem, &random, &options);
        assert_true(problem.n <= LARGEST);
        for (i = 0; i < problem.n; i++)
            for (j = 0; j < problem.n; j++)
                entries[i + problem.n * j] = check_entry(&problem.view, i, j);
        check_invariance(&random, problem.n, entries);
        gen_destroy(&problem);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_power_of_two),
        cmocka_unit_test(test_diagonal),
        cmocka_unit_test(test_noise),
        cmocka_unit_test(test_couplings),
        cmocka_unit_test(test_breadth_first),
        cmocka_unit_test(test_without_diagonal),
        cmocka_unit_test(test_zero_and_empty),
        cmocka_unit_test(test_stored_zeros),
        cmocka_unit_test(test_parts),
        cmocka_unit_test(test_clamp),
        cmocka_unit_test(test_disabled),
        cmocka_unit_test(test_invariance_random),
        cmocka_unit_test(test_invariance_contact),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
