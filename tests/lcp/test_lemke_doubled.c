/* Lemke's tableau in doubled precision: exchanges that lose every digit in double keep them all. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "lcp/lemke/lemke.h"
#include "run.h"

#include "context.h"

enum { N = 10 };

/* lcm(1 .. 19): 1 / (i + j - 1) times this is an integer for i, j <= 10. */
static const double scale = 232792560.0;

static const perp__lemke_basis *const basis = &perp__lemke_doubled;

/* What the front door would have made of 0 <= x, v = H x - e times `scale`. */
typedef struct fixture {
    perp__lemke l;
    perp__matrix M;
    double values[N * N];
    perp__lcp_problem problem;
    perp__sparse_block block;
    perp_lcp_settings settings;
    perp__arena arena;
    double lower[N], upper[N], row_norms[N], q[N];
} fixture;

static void set_up(fixture *f)
{
    perp__lemke *l = &f->l;
    int32_t i, j;

    memset(f, 0, sizeof *f);
    f->settings = run_settings(PERP_LCP_LEMKE);
    f->problem.context = context;
    f->problem.n = N;
    f->M.rows = f->M.columns = N;
    f->M.values = f->values;
    f->M.row_stride = 1;
    f->M.column_stride = N;
    f->problem.M = &f->M;
    f->problem.lower = f->lower;
    f->problem.upper = f->upper;
    f->problem.row_norms = f->row_norms;
    f->problem.q = f->q;
    f->problem.block = &f->block;
    f->problem.settings = &f->settings;
    l->head.problem = &f->problem;
    memset(&f->arena, 0, sizeof f->arena);
    for (i = 0; i < N; i++) {
        f->upper[i] = INFINITY;
        f->q[i] = -scale;
        for (j = 0; j < N; j++)
            f->values[i + j * N] = scale / (i + j + 1);
    }
}

static void start(fixture *f)
{
    const perp__lcp_iterate iterate = {0};

    assert_int_equal(perp__arena_fit(&f->arena, context, perp__lcp_lemke.layout, &f->l), PERP_OK);
    assert_int_equal(basis->start(&f->l, &iterate), PERP_OK);
}

static void finish(fixture *f)
{
    perp__lcp_lemke.release(&f->l);
    perp__arena_release(&f->arena);
}

/* x_k and v_k change places, whichever is in the basis. */
static void exchange(perp__lemke *l, int32_t k)
{
    const int32_t entering = l->row_of[k] >= 0 ? N + k : k;
    const int32_t leaving = l->row_of[k] >= 0 ? k : N + k;
    const int32_t r = l->row_of[leaving];

    assert_int_equal(basis->column(l, entering), PERP_OK);
    l->basic[r] = entering;
    l->row_of[entering] = r;
    l->row_of[leaving] = -1;
    assert_int_equal(basis->exchange(l, r, leaving), PERP_OK);
}

static double factorial(int32_t n)
{
    return n < 2 ? 1.0 : n * factorial(n - 1);
}

/* Row i of the inverse Hilbert matrix has the sum (-1)^(n+i) (n+i-1)! / ((i-1)!^2 (n-i)!): integers
 * up to 2e6, exact in double. */
static double solution(int32_t i)
{
    double sum = factorial(N + i) / (factorial(i) * factorial(i) * factorial(N - 1 - i));

    return (N + i + 1) % 2 ? -sum : sum;
}

static void require_solution(perp__lemke *l, const char *where)
{
    int32_t i;

    assert_int_equal(basis->values(l), PERP_OK);
    for (i = 0; i < N; i++) {
        const double found = l->b[l->row_of[i]];

        /* condition 1e13 of 1e32: 19 digits are right, and rounding to double leaves the integer */
        if (found != solution(i))
            fail_msg("%s: x[%d] = %.17g, not %.17g", where, (int)i, found, solution(i));
    }
}

static void test_hilbert(void **state)
{
    fixture f;
    int32_t k;

    (void)state;
    set_up(&f);
    start(&f);
    for (k = 0; k < N; k++)
        exchange(&f.l, k);
    require_solution(&f.l, "ten exchanges");
    finish(&f);
}

/* More exchanges than there is room for: the basis is inverted afresh on the way, with whatever of
 * it is not as it was at the start. */
static void test_inversion(void **state)
{
    gen_random random;
    fixture f;
    int32_t k, round;

    (void)state;
    gen_seed(&random, 81);
    set_up(&f);
    start(&f);
    for (round = 0; round < 400; round++)
        exchange(&f.l, gen_integer(&random, N));
    assert_true(f.l.doubled.count <= f.l.doubled.capacity);
    for (k = 0; k < N; k++)
        if (f.l.row_of[k] < 0)
            exchange(&f.l, k);
    require_solution(&f.l, "four hundred exchanges");
    finish(&f);
}

/* Along the column of x_0 until row r blocks, where b is 0 to all 32 digits. */
static void test_step(void **state)
{
    fixture f;
    double step;
    int32_t r;

    (void)state;
    set_up(&f);
    start(&f);
    for (r = 1; r < N; r++)
        exchange(&f.l, r);
    assert_int_equal(basis->values(&f.l), PERP_OK);
    assert_int_equal(basis->column(&f.l, 0), PERP_OK);
    r = f.l.row_of[5];
    f.l.direction = f.l.b[r] * f.l.column[r] > 0.0 ? 1.0 : -1.0;
    step = basis->move(&f.l, r, fabs(f.l.b[r]));
    assert_true(step > 0.0 && fabs(f.l.doubled.step_low) <= 0x1p-53 * step);
    assert_true(fabs(f.l.b[r]) <= 1e-30 * scale);
    finish(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_hilbert),
        cmocka_unit_test(test_inversion),
        cmocka_unit_test(test_step),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
