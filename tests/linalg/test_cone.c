/* Rays and lines of cones whose faces are known. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "base/context.h"
#include "check.h"
#include "gen.h"
#include "linalg/cone.h"
#include "memory.h"

#include "context.h"

static void begin(perp__cone *cone, int32_t rows, int32_t dimension)
{
    memset(cone, 0, sizeof *cone);
    cone->context = context;
    assert_int_equal(perp__cone_fit(cone, rows, dimension), PERP_OK);
    memset(cone->A, 0, (size_t)rows * (size_t)dimension * sizeof *cone->A);
    cone->A[0] = 1.0;
}

/* (s, t) with s >= 0 and -s <= t_k <= s */
static void begin_cube(perp__cone *cone, int32_t d)
{
    int32_t k, side;

    begin(cone, 2 * d + 1, d + 1);
    for (k = 0; k < d; k++)
        for (side = 0; side < 2; side++) {
            double *a = cone->A + (1 + 2 * k + side) * (d + 1);

            a[0] = 1.0;
            a[1 + k] = side ? -1.0 : 1.0;
        }
}

static const double *ray(const perp__cone *cone, int32_t k)
{
    return cone->x + (size_t)k * (size_t)cone->dimension;
}

/* 2^d vertices with entries 1 and -1, each once. */
static void test_cube(void **state)
{
    int32_t d, k, j;

    (void)state;
    for (d = 1; d <= 8; d++) {
        uint64_t seen[4] = {0, 0, 0, 0};
        perp__cone cone;

        begin_cube(&cone, d);
        assert_int_equal(perp__cone_enumerate(&cone), PERP_OK);
        assert_int_equal(cone.rays, 1 << d);
        assert_int_equal(cone.lines, 0);
        for (k = 0; k < cone.rays; k++) {
            int32_t code = 0;

            for (j = 1; j <= d; j++) {
                assert_true(fabs(fabs(ray(&cone, k)[j]) - ray(&cone, k)[0]) <= 1e-14);
                code |= (ray(&cone, k)[j] > 0.0) << (j - 1);
            }
            assert_true((seen[code / 64] >> (code % 64) & 1) == 0);
            seen[code / 64] |= UINT64_C(1) << (code % 64);
        }
        perp__cone_release(&cone);
    }
}

/* |t_1| + ... + |t_d| <= 1: 2^d facets, 2 d vertices, degenerate everywhere. */
static void test_cross_polytope(void **state)
{
    int32_t d, k, j, row;

    (void)state;
    for (d = 2; d <= 6; d++) {
        perp__cone cone;

        begin(&cone, (1 << d) + 1, d + 1);
        for (row = 0; row < 1 << d; row++) {
            cone.A[(row + 1) * (d + 1)] = 1.0;
            for (j = 0; j < d; j++)
                cone.A[(row + 1) * (d + 1) + 1 + j] = row >> j & 1 ? 1.0 : -1.0;
        }
        assert_int_equal(perp__cone_enumerate(&cone), PERP_OK);
        assert_int_equal(cone.rays, 2 * d);
        for (k = 0; k < cone.rays; k++) {
            double sum = 0.0, largest = 0.0;

            for (j = 1; j <= d; j++) {
                sum += fabs(ray(&cone, k)[j]);
                check_raise(&largest, fabs(ray(&cone, k)[j]));
            }
            assert_true(fabs(sum - largest) <= 1e-12 && fabs(largest - 1.0) <= 1e-12);
        }
        perp__cone_release(&cone);
    }
}

/* t_1 >= 0 in the plane, twice: one vertex's worth of rays, (1; 0) and (0; 1), and a line t_2. */
static void test_lines(void **state)
{
    perp__cone cone;
    int32_t k;

    (void)state;
    begin(&cone, 3, 3);
    cone.A[3 + 1] = 2.0;
    cone.A[6 + 1] = 1.0;
    assert_int_equal(perp__cone_enumerate(&cone), PERP_OK);
    assert_int_equal(cone.rays, 2);
    assert_int_equal(cone.lines, 1);
    for (k = 0; k < 2; k++)
        assert_true(ray(&cone, k)[2] == 0.0 && ray(&cone, k)[0] + ray(&cone, k)[1] == 1.0);
    assert_true(ray(&cone, 2)[0] == 0.0 && ray(&cone, 2)[1] == 0.0 && ray(&cone, 2)[2] != 0.0);
    perp__cone_release(&cone);
}

/* t >= s and t <= -s leave the origin alone: no ray with s > 0. */
static void test_empty(void **state)
{
    perp__cone cone;
    int32_t k;

    (void)state;
    begin(&cone, 3, 2);
    cone.A[2] = -1.0;
    cone.A[3] = 1.0;
    cone.A[4] = -1.0;
    cone.A[5] = -1.0;
    assert_int_equal(perp__cone_enumerate(&cone), PERP_OK);
    for (k = 0; k < cone.rays; k++)
        assert_true(ray(&cone, k)[0] == 0.0);
    perp__cone_release(&cone);
}

/* Random cones: every ray satisfies all rows and is tight in as many of them as make an edge. */
static void test_random(void **state)
{
    gen_random random;
    int32_t round, k, j, i;

    (void)state;
    gen_seed(&random, 5);
    for (round = 0; round < 300; round++) {
        const int32_t d = 1 + gen_integer(&random, 5), rows = d + 2 + gen_integer(&random, 12);
        perp__cone cone;
        double A[18 * 6];

        begin(&cone, rows, d + 1);
        for (i = 1; i < rows; i++) {
            cone.A[i * (d + 1)] = gen_integer(&random, 4);
            for (j = 1; j <= d; j++)
                cone.A[i * (d + 1) + j] = gen_integer(&random, 5) - 2;
        }
        memcpy(A, cone.A, (size_t)(rows * (d + 1)) * sizeof *A);
        assert_int_equal(perp__cone_enumerate(&cone), PERP_OK);
        for (k = 0; k < cone.rays; k++) {
            int32_t tight = 0;

            for (i = 0; i < rows; i++) {
                double sum = 0.0;

                for (j = 0; j <= d; j++)
                    sum += A[i * (d + 1) + j] * ray(&cone, k)[j];
                assert_true(sum >= -1e-8);
                tight += sum <= 1e-8;
            }
            assert_true(tight >= d - cone.lines);
        }
        perp__cone_release(&cone);
    }
}

static void test_limits(void **state)
{
    perp__cone cone;

    (void)state;
    begin_cube(&cone, 16); /* 65536 vertices: half of them come last, each beside all: 2e9 */
    assert_int_equal(perp__cone_enumerate(&cone), PERP__CONE_TOO_LARGE);
    /* the room serves a smaller one */
    assert_int_equal(perp__cone_fit(&cone, 2, 2), PERP_OK);
    cone.A[0] = cone.A[3] = 1.0;
    cone.A[1] = cone.A[2] = 0.0;
    assert_int_equal(perp__cone_enumerate(&cone), PERP_OK);
    assert_int_equal(cone.rays, 2);
    perp__cone_release(&cone);
}

static void test_memory(void **state)
{
    memory m = {0, 0, 0};
    perp_context_settings settings = memory_settings(&m);
    perp_context *limited, *const usual = context;
    perp_status status = PERP_ERROR_MEMORY;

    (void)state;
    assert_int_equal(perp_context_create(&limited, &settings), PERP_OK);
    context = limited;
    for (m.fails_at = 1; status != PERP_OK; m.fails_at++) {
        perp__cone cone;

        memset(&cone, 0, sizeof cone);
        cone.context = limited;
        m.calls = 0;
        status = perp__cone_fit(&cone, 13, 7);
        if (status == PERP_OK) {
            const int next = m.fails_at;

            m.fails_at = 0;
            perp__cone_release(&cone);
            begin_cube(&cone, 6);
            m.calls = 0;
            m.fails_at = next - 5; /* growing on the way */
            status = perp__cone_enumerate(&cone);
            m.fails_at = next;
        }
        assert_true(status == PERP_OK || status == PERP_ERROR_MEMORY);
        perp__cone_release(&cone);
        assert_int_equal(m.live, 1);
    }
    assert_true(m.fails_at > 7);
    context = usual;
    perp_context_destroy(limited);
    assert_int_equal(m.live, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cube),   cmocka_unit_test(test_cross_polytope),
        cmocka_unit_test(test_lines),  cmocka_unit_test(test_empty),
        cmocka_unit_test(test_random), cmocka_unit_test(test_limits),
        cmocka_unit_test(test_memory),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
