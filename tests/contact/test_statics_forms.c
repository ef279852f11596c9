/* One question in many forms: storages, orders, units, repetition. Problems are random, of all laws
 * at once; each answer is checked for what it claims (statics_case.h). */
#include <math.h>
#include <stdio.h>

#include "suite.h"

#include "statics_case.h"

#include "context.h"

enum { CASES = 300 };

static statics_case one, other;

/* Bodies that touch in random points, with all laws. Where they stand is known: forces are those of
 * impulses inside all cones. In half of the others one body falls off; what remains may do either.
 */
static int32_t make_random(gen_random *random, int32_t width)
{
    const int32_t bodies = 1 + gen_integer(random, 4), kind = gen_integer(random, 3);
    const int32_t contacts = bodies * (1 + gen_integer(random, 4));
    int32_t k, i, j;

    case_begin(&one, width, bodies);
    for (k = 0; k < bodies; k++)
        for (i = 0; i < 3; i++)
            one.center[k][i] = width == 3 && i == 2 ? 0.0 : gen_dyadic(random, 2);
    for (k = 0; k < contacts; k++) {
        const int32_t a = k % bodies, b = gen_integer(random, bodies + 1) - 1;
        const double x = gen_normal(random), y = gen_normal(random);
        const double z = width == 3 ? 0.0 : gen_normal(random), size = sqrt(x * x + y * y + z * z);
        const double normal[3] = {x / size, y / size, z / size};
        const double p[3] = {gen_dyadic(random, 3), gen_dyadic(random, 3), width == 3 ? 0.0 : 0.5};
        const int32_t rolls = gen_integer(random, 4) == 0, spins = gen_integer(random, 4) == 0;
        const double mu = gen_integer(random, 5) ? gen_uniform(random, 0.0, 1.5) : -1.0;

        case_contact_at(&one, a, b == a ? CASE_GROUND : b, p, normal, gen_uniform(random, -3, 3),
                        mu, rolls && mu > 0.0 ? 0.1 : 0.0,
                        spins && mu > 0.0 && width == 6 ? 0.1 : 0.0);
    }
    for (k = 0; k < gen_integer(random, 3); k++)
        case_bounded(&one, -1.0 - k, k ? INFINITY : 1.5)[gen_integer(random, one.n)] = 1.0;
    for (k = 0; k < gen_integer(random, 3); k++) {
        const double d[3] = {k ? 0.0 : 1.0, k ? 1.0 : 0.0, 0.0};

        case_joint(&one, 0, CASE_GROUND, one.center[bodies - 1], d, 0);
    }
    if (kind > 0)
        for (j = 0; j < one.n; j++)
            one.f[j] = gen_normal(random);
    for (k = i = 0; k < contacts && kind == 0; k++) {
        const int32_t tangents = one.dims[k] - 1, rolls = one.rolling[k] > 0.0 ? tangents : 0;
        const int32_t rows = 1 + tangents + rolls + (one.spinning[k] > 0.0);
        int32_t m;

        for (m = 0; m < rows; m++)
            for (j = 0; j < one.n; j++) {
                const double factor = m == 0                               ? 1.0
                                      : m <= tangents                      ? one.mu[k]
                                      : m < rows - (one.spinning[k] > 0.0) ? one.rolling[k]
                                                                           : one.spinning[k];

                one.f[j] -=
                    (m == 0 ? 1.0 : (m % 2 ? 0.5 : -0.5) * factor) * one.H[(i + m) * one.n + j];
            }
        i += rows;
    }
    return kind;
}

/* The verdict of `other`, a form of the problem of `one`. */
static void require_same(const char *form, int32_t i)
{
    char name[64];

    snprintf(name, sizeof name, "%s %d", form, (int)i);
    if (case_decide(name, &other, context) != one.result.verdict)
        fail_msg("%s: %s instead of %s, margins %g and %g", name,
                 perp_statics_verdict_text(other.result.verdict),
                 perp_statics_verdict_text(one.result.verdict), other.result.margin,
                 one.result.margin);
}

static void begin_other(void)
{
    memcpy(&other, &one, sizeof other);
    case_pose(&other);
}

/* Column-major with a leading dimension that is longer, and CSC without zeros, of H and G. */
static void store(perp_matrix *view, double *values, int32_t *starts, int32_t *indices,
                  const double *rows, int32_t count, int32_t n, int32_t sparse)
{
    int32_t i, j, entries = 0;

    starts[0] = 0;
    for (j = 0; j < n; j++) {
        for (i = 0; i < count; i++)
            if (!sparse) {
                values[j * (count + 3) + i] = rows[i * n + j];
            } else if (rows[i * n + j] != 0.0) {
                indices[entries] = i;
                values[entries++] = rows[i * n + j];
            }
        for (i = count; i < count + 3 && !sparse; i++)
            values[j * (count + 3) + i] = NAN; /* nobody reads it */
        starts[j + 1] = entries;
    }
    if (sparse)
        assert_int_equal(perp_matrix_csc(view, count, n, starts, indices, values), PERP_OK);
    else
        assert_int_equal(
            perp_matrix_dense(view, PERP_STORAGE_COLUMN_MAJOR, count, n, values, count + 3),
            PERP_OK);
}

static void check_storages(int32_t i)
{
    static double H[(CASE_ROWS + 3) * CASE_N], G[(CASE_JOINTS + 3) * CASE_N];
    static int32_t starts[2][CASE_N + 1], H_rows[CASE_ROWS * CASE_N], G_rows[CASE_JOINTS * CASE_N];
    int32_t sparse;

    for (sparse = 0; sparse < 2; sparse++) {
        begin_other();
        store(&other.H_view, H, starts[0], H_rows, one.H, one.rows, one.n, sparse);
        store(&other.G_view, G, starts[1], G_rows, one.G, one.joints, one.n, sparse);
        require_same(sparse ? "csc" : "column-major", i);
        /* the same rows, entry by entry in the same order: the same bits */
        assert_memory_equal(other.r, one.r, sizeof one.r);
        assert_memory_equal(other.v, one.v, sizeof one.v);
    }
}

/* Contacts in another order, and forces and lengths in units of powers of two. */
static void check_order(gen_random *random, int32_t i)
{
    int32_t first[CASE_CONTACTS + 1] = {0}, order[CASE_CONTACTS], k, m, row = 0;

    for (k = 0; k < one.contacts; k++) {
        const int32_t tangents = one.dims[k] - 1;

        first[k + 1] = first[k] + 1 + tangents + (one.rolling[k] > 0.0 ? tangents : 0) +
                       (one.spinning[k] > 0.0);
        m = gen_integer(random, k + 1);
        order[k] = order[m];
        order[m] = k;
    }
    begin_other();
    for (k = 0; k < one.contacts; k++) {
        const int32_t from = order[k], rows = first[from + 1] - first[from];

        other.dims[k] = one.dims[from];
        other.mu[k] = one.mu[from];
        other.rolling[k] = one.rolling[from];
        other.spinning[k] = one.spinning[from];
        memcpy(other.H + row * one.n, one.H + first[from] * one.n,
               (size_t)(rows * one.n) * sizeof *one.H);
        row += rows;
    }
    require_same("order", i);
}

/* Forces times 2^k; lengths times 2^k: angular coordinates, rows that turn, and coefficients that
 * are lengths. */
static void check_units(int32_t i, int32_t force, int32_t length)
{
    const double L = ldexp(1.0, length), F = ldexp(1.0, force);
    int32_t k, m, j, row = 0;

    begin_other();
    for (j = 0; j < one.n; j++) {
        const int32_t turns = j % one.width >= (one.width == 6 ? 3 : 2);

        other.f[j] = one.f[j] * F * (turns ? L : 1.0);
        for (k = 0; k < one.joints && turns; k++)
            other.G[k * one.n + j] *= L;
        for (k = 0; k < one.rows - one.bounded && turns; k++)
            other.H[k * one.n + j] *= L;
    }
    for (k = 0; k < one.contacts; k++) {
        const int32_t tangents = one.dims[k] - 1, rolls = one.rolling[k] > 0.0 ? tangents : 0;

        row += 1 + tangents;
        for (m = 0; m < rolls + (one.spinning[k] > 0.0); m++, row++)
            for (j = 0; j < one.n; j++)
                other.H[row * one.n + j] /= L;
        other.rolling[k] *= L;
        other.spinning[k] *= L;
    }
    for (k = 0; k < one.bounded; k++, row++) {
        double own = F;

        for (j = 0; j < one.n; j++)
            if (one.H[row * one.n + j] != 0.0 && j % one.width >= (one.width == 6 ? 3 : 2))
                own *= L;
        other.lower[k] *= own;
        other.upper[k] *= own;
    }
    require_same("units", i);
}

static void test_forms(void **state)
{
    int32_t i, verdicts[3] = {0}, kind;
    gen_random random;

    (void)state;
    gen_seed(&random, 4);
    for (i = 0; i < CASES; i++) {
        kind = make_random(&random, i & 1 ? 3 : 6);
        case_pose(&one);
        verdicts[case_decide("random", &one, context)]++;
        if (one.result.verdict == PERP_STATICS_INDETERMINATE || (kind == 0 && one.result.verdict))
            fail_msg("random %d (%d): %s, margin %g", (int)i, (int)kind,
                     perp_statics_verdict_text(one.result.verdict), one.result.margin);
        begin_other();
        require_same("again", i);
        assert_memory_equal(other.r, one.r, sizeof one.r);
        assert_memory_equal(other.v, one.v, sizeof one.v);
        check_storages(i);
        check_order(&random, i);
        check_units(i, 40, 0);
        check_units(i, -40, 0);
        check_units(i, 0, 10);
        check_units(i, 7, -10);
    }
    assert_true(verdicts[0] > CASES / 4 && verdicts[1] > CASES / 4);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_forms),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
