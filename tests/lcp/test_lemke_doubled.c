/* Lemke's tableau in doubled precision: exchanges that lose every digit in double keep them all. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "lcp/lemke/lemke.h"
#include "run.h"

enum { N = 10 };

/* lcm(1 .. 19): 1 / (i + j - 1) times this is an integer for i, j <= 10. */
static const double scale = 232792560.0;

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

/* What the front door and the cold start would have made of 0 <= x, v = H x - e times `scale`. */
typedef struct fixture {
    perp__lemke l;
    perp__lcp_problem problem;
    perp_lcp_settings settings;
    perp__arena arena;
    double lower[N], upper[N], row_norms[N], q[N];
} fixture;

static void set_up(fixture *f)
{
    perp__lemke *l = &f->l;
    int32_t i;

    memset(f, 0, sizeof *f);
    f->settings = run_settings(PERP_LCP_LEMKE);
    f->problem.context = context;
    f->problem.n = N;
    f->problem.lower = f->lower;
    f->problem.upper = f->upper;
    f->problem.row_norms = f->row_norms;
    f->problem.q = f->q;
    f->problem.settings = &f->settings;
    l->head.problem = &f->problem;
    perp__arena_init(&f->arena, context);
    for (i = 0; i < N; i++) {
        f->upper[i] = INFINITY;
        f->q[i] = -scale;
    }
}

/* The memory that lemke.c takes and that is of account here. */
static void lay_out(perp__arena *arena, void *object)
{
    perp__lemke *l = object;
    const size_t rows = perp__tableau_length(N);

    l->capacity = l->pairs = N;
    perp__tableau_layout(arena, &l->tableau, N, N + 1);
    l->index = perp__arena_take(arena, N, sizeof(int32_t));
    l->sign = perp__arena_take(arena, N, sizeof(int8_t));
    l->at_upper = perp__arena_take(arena, N, sizeof(int8_t));
    l->range = perp__arena_take(arena, N, sizeof(double));
    l->cover = perp__arena_take(arena, N, sizeof(double));
    l->twin = perp__arena_take(arena, N, sizeof(int32_t));
    l->basic = perp__arena_take(arena, N, sizeof(int32_t));
    l->nonbasic = perp__arena_take(arena, N + 1, sizeof(int32_t));
    l->row_of = perp__arena_take(arena, 2 * N + 1, sizeof(int32_t));
    l->column_of = perp__arena_take(arena, 2 * N + 1, sizeof(int32_t));
    l->row_unit = perp__arena_take(arena, N, sizeof(double));
    l->column_unit = perp__arena_take(arena, N, sizeof(double));
    l->b = perp__arena_take(arena, rows, sizeof(double));
    l->low = perp__arena_take(arena, rows, sizeof(double));
    l->high = perp__arena_take(arena, rows, sizeof(double));
    l->column = perp__arena_take(arena, rows, sizeof(double));
}

static void start(fixture *f)
{
    perp__lemke *l = &f->l;
    int32_t i, j;

    assert_int_equal(perp__arena_fit(&f->arena, lay_out, l), PERP_OK);
    assert_int_equal(perp__doubled_fit(l), PERP_OK);
    perp__tableau_reset(&l->tableau, N, N);
    for (j = 0; j < N; j++) {
        for (i = 0; i < N; i++)
            l->tableau.T[i + j * l->tableau.leading_dimension] = -scale / (i + j + 1);
        l->b[j] = -scale;
        l->index[j] = j;
        l->sign[j] = 1;
        l->at_upper[j] = 0;
        l->range[j] = INFINITY;
        l->twin[j] = -1;
        l->basic[j] = N + j;
        l->nonbasic[j] = j;
    }
    perp__lemke_reset_units(l);
    perp__lemke_index(l);
    perp__doubled_start(l);
}

/* x_k and v_k change places, whichever is in the basis. */
static void exchange(perp__lemke *l, int32_t k)
{
    const int32_t entering = l->row_of[k] >= 0 ? N + k : k;
    const int32_t leaving = l->row_of[k] >= 0 ? k : N + k;
    const int32_t c = l->column_of[entering], r = l->row_of[leaving];

    perp__doubled_column(l, entering);
    l->basic[r] = entering;
    l->nonbasic[c] = leaving;
    l->row_of[entering] = r;
    l->row_of[leaving] = -1;
    l->column_of[entering] = -1;
    l->column_of[leaving] = c;
    assert_true(perp__doubled_exchange(l, r));
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

    perp__doubled_values(l);
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
    perp__doubled_release(&f.l);
    perp__arena_release(&f.arena);
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
    perp__doubled_release(&f.l);
    perp__arena_release(&f.arena);
}

/* step and move: along the column of x_0 until row r blocks, where b is 0 to all 32 digits. */
static void test_step(void **state)
{
    fixture f;
    double low, step;
    int32_t r;

    (void)state;
    set_up(&f);
    start(&f);
    for (r = 1; r < N; r++)
        exchange(&f.l, r);
    perp__doubled_values(&f.l);
    perp__doubled_column(&f.l, 0);
    r = f.l.row_of[5];
    f.l.direction = f.l.b[r] * f.l.column[r] > 0.0 ? 1.0 : -1.0;
    step = perp__doubled_step(&f.l, r, fabs(f.l.b[r]), &low);
    assert_true(step > 0.0 && fabs(low) <= 0x1p-53 * step);
    perp__doubled_move(&f.l, step, low);
    assert_true(fabs(f.l.b[r]) <= 1e-30 * scale);
    perp__doubled_release(&f.l);
    perp__arena_release(&f.arena);
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
