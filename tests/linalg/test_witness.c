/* Which units the second witness looks at a point in: the same whatever the storage is. */
#include <math.h>
#include <string.h>

#include "suite.h"

#include "linalg/scale.h"
#include "linalg/views.h"
#include "linalg/witness.h"

enum { LARGEST = 24 };

typedef struct looked {
    int32_t exponents[LARGEST], cut[2 * LARGEST];
    double own;
} looked;

static void layout(perp__arena *arena, void *object)
{
    perp__witness_layout(arena, object, LARGEST);
}

/* Rows that nothing excuses. */
static void look(const perp__matrix *M, perp__witness *witness, looked *f)
{
    double q[LARGEST], lower[LARGEST], upper[LARGEST], z[LARGEST], w[LARGEST];
    double norms[LARGEST];
    int32_t e[LARGEST], part[2 * LARGEST], work[2 * LARGEST];
    perp__witness_point p = {.M = M,
                             .exponents = e,
                             .part = part,
                             .q = q,
                             .lower = lower,
                             .upper = upper,
                             .z = z,
                             .w = w,
                             .tol = 1e-10};

    for (int32_t i = 0; i < M->rows; i++) {
        q[i] = lower[i] = 0.0;
        upper[i] = INFINITY;
        z[i] = 1.0;
        w[i] = 1e30;
    }
    perp__equilibrate(M, 1, e, norms, work);
    p.parts = perp__find_parts(M, part, norms);
    perp__scaled_row_norms(M, e, norms);
    witness->known = 0;
    memset(f, 0, sizeof *f);
    f->own = perp__witness_own_residual(witness, &p);
    assert_true(f->own > 0.0);
    memcpy(f->exponents, witness->exponents, (size_t)M->rows * sizeof *f->exponents);
    memcpy(f->cut, witness->cut, 2 * (size_t)M->rows * sizeof *f->cut);
}

/* Diagonals that are noise, or nearly; couplings that no unit explains, or nearly; units that lose
 * some, in the caller's units or in others. */
static double draw(gen_random *random, int32_t kind, int32_t hollow, int32_t is_diagonal)
{
    static const int32_t diagonals[] = {0, 0, 0, -36, -38, -40, -60, -100};
    static const int32_t couplings[] = {0, 0, 10, 20, 9, -31, 18, 19, 21, 42};
    const double sign = gen_integer(random, 6) ? 1.0 : -1.0;

    if (is_diagonal)
        return gen_integer(random, hollow)
                   ? 0.0
                   : sign * ldexp(1.0, diagonals[gen_integer(random, kind)]);
    return gen_integer(random, 3) ? 0.0
                                  : sign * ldexp(1.5, couplings[gen_integer(random, kind + 2)]);
}

static void test_units_of_storages(void **state)
{
    static double entries[LARGEST * LARGEST];
    perp__arena arena = {0};
    perp_context *context;
    perp__witness witness;
    gen_random random;

    (void)state;
    memset(&witness, 0, sizeof witness);
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    assert_int_equal(perp__arena_fit(&arena, context, layout, &witness), PERP_OK);
    gen_seed(&random, 7);
    for (int32_t round = 0; round < 4000; round++) {
        const int32_t n = 1 + gen_integer(&random, LARGEST), kind = 1 + gen_integer(&random, 8);
        const int32_t hollow = 1 + gen_integer(&random, 2) * gen_integer(&random, 20);
        int32_t units[LARGEST];
        looked of_view[VIEWS];
        views v;

        for (int32_t i = 0; i < n; i++)
            units[i] = gen_integer(&random, 4) ? 0 : gen_integer(&random, 41) - 20;
        for (int32_t j = 0; j < n; j++)
            for (int32_t i = 0; i < n; i++)
                entries[i + n * j] =
                    ldexp(draw(&random, kind, hollow, i == j), units[i] + units[j]);
        views_make(&v, n, n, entries);
        for (int k = 0; k < VIEWS; k++)
            look(&v.view[k], &witness, &of_view[k]);
        assert_memory_equal(&of_view[VIEW_BY_COLUMNS], &of_view[VIEW_CSC], sizeof(looked));
        assert_memory_equal(&of_view[VIEW_BY_ROWS], &of_view[VIEW_CSC], sizeof(looked));
        views_release(&v);
    }
    perp__arena_release(&arena);
    perp_context_destroy(context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_units_of_storages),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
