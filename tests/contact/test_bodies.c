/* The space of bodies against dense algebra: W, q, traces, velocities, for rigid and other blocks,
 * CSC and dense matrices, bilateral rows and compliance; what is refused; failing memory. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "bodies_load.h"
#include "memory.h"
#include "piles.h"

#include "context.h"

enum { MOST = 48 };

/* Dense problem: n unknowns in blocks of those sizes, in a scattered order; contacts of 1 to 3
 * rows, two bilateral rows. */
typedef struct dense {
    int32_t n, contacts, rows, size;
    int32_t starts[MOST];
    double M[MOST][MOST], H[MOST][MOST], G[MOST][MOST]; /* row-major */
    double f[MOST], w[MOST], b[MOST], compliance[MOST];
    double inverse[MOST][MOST], W[MOST][MOST], q[MOST];
} dense;

static perp__matrix view_dense(const double *values, int32_t rows, int32_t columns)
{
    perp__matrix view;

    memset(&view, 0, sizeof view);
    view.rows = rows;
    view.columns = columns;
    view.row_stride = MOST;
    view.column_stride = 1;
    view.values = values;
    return view;
}

/* M^-1 by Gauss-Jordan. */
static void invert(dense *d)
{
    static double A[MOST][2 * MOST];

    memset(A, 0, sizeof A);
    for (int32_t i = 0; i < d->n; i++) {
        for (int32_t j = 0; j < d->n; j++)
            A[i][j] = d->M[i][j];
        A[i][d->n + i] = 1.0;
    }
    for (int32_t k = 0; k < d->n; k++) {
        const double pivot = A[k][k];

        for (int32_t j = 0; j < 2 * d->n; j++)
            A[k][j] /= pivot;
        for (int32_t i = 0; i < d->n; i++) {
            const double factor = A[i][k];

            for (int32_t j = 0; i != k && j < 2 * d->n; j++)
                A[i][j] -= factor * A[k][j];
        }
    }
    for (int32_t i = 0; i < d->n; i++)
        for (int32_t j = 0; j < d->n; j++)
            d->inverse[i][j] = A[i][d->n + j];
}

static const double *row_of(const dense *d, int32_t i)
{
    return i < d->rows ? d->H[i] : d->G[i - d->rows];
}

static void reference(dense *d)
{
    invert(d);
    for (int32_t i = 0; i < d->size; i++) {
        d->q[i] = i < d->rows ? d->w[i] : d->b[i - d->rows];
        for (int32_t k = 0; k < d->n; k++)
            for (int32_t l = 0; l < d->n; l++)
                d->q[i] += row_of(d, i)[k] * d->inverse[k][l] * d->f[l];
        for (int32_t j = 0; j < d->size; j++) {
            d->W[i][j] = i == j ? d->compliance[i] : 0.0;
            for (int32_t k = 0; k < d->n; k++)
                for (int32_t l = 0; l < d->n; l++)
                    d->W[i][j] += row_of(d, i)[k] * d->inverse[k][l] * row_of(d, j)[l];
        }
    }
}

static void draw(dense *d, gen_random *random, const int32_t *blocks, int32_t scattered)
{
    int32_t order[MOST], first = 0, row = 0;

    memset(d, 0, sizeof *d);
    for (int32_t k = 0; blocks[k]; k++)
        d->n += blocks[k];
    for (int32_t i = 0; i < d->n; i++)
        order[i] = scattered ? i * 5 % d->n : i; /* n is no multiple of 5 */
    for (int32_t k = 0; blocks[k]; first += blocks[k++])
        for (int32_t i = 0; i < blocks[k]; i++)
            for (int32_t j = 0; j <= i; j++)
                d->M[order[first + i]][order[first + j]] =
                    d->M[order[first + j]][order[first + i]] =
                        i == j ? 4.0 + i : gen_uniform(random, -0.5, 0.5);
    d->contacts = 7;
    for (int32_t k = 0; k < d->contacts; k++) {
        const int32_t a = gen_integer(random, d->n), rows = 1 + gen_integer(random, 3);

        for (int32_t i = 0; i < rows; i++, row++)
            for (int32_t j = 0; j < d->n; j++)
                if (abs(j - a) < 7 && gen_integer(random, 3))
                    d->H[row][j] = gen_normal(random);
        d->starts[k + 1] = row;
    }
    d->rows = row;
    d->size = row + 2;
    for (int32_t i = 0; i < d->n; i++) {
        d->f[i] = gen_normal(random);
        d->G[0][i] = i % 4 ? 0.0 : gen_normal(random);
        d->G[1][i] = i < 3 ? 1.0 : 0.0;
    }
    for (int32_t i = 0; i < d->size; i++) {
        d->w[i] = gen_normal(random);
        d->b[i] = gen_normal(random);
        d->compliance[i] = i % 3 ? 0.0 : 0.125;
    }
    reference(d);
}

static perp_status setup(perp__bodies *bodies, const dense *d, int32_t *suits)
{
    const perp__matrix M = view_dense(&d->M[0][0], d->n, d->n),
                       H = view_dense(&d->H[0][0], d->rows, d->n),
                       G = view_dense(&d->G[0][0], 2, d->n);
    const perp__bodies_input input = {d->n, d->contacts, d->size, d->starts,
                                      &M,   &H,          &G,      d->compliance};

    return perp__bodies_setup(bodies, &input, suits);
}

/* All that the bodies offer against the reference; sums of at most 48 terms of order 1. */
static void compare(const perp__bodies *bodies, const dense *d)
{
    const double tolerance = 1e-12;
    double q[MOST], r[MOST], u[MOST], trace[MOST];
    int32_t starts[MOST + 1], rows[MOST * MOST];
    double values[MOST * MOST];
    int64_t entries;

    bodies_load(bodies, d->f, d->w, d->b, q);
    for (int32_t i = 0; i < d->size; i++) {
        assert_true(fabs(q[i] - d->q[i]) <= tolerance);
        r[i] = sin(1.0 + i);
    }
    perp__bodies_multiply(bodies, r, NULL, u);
    for (int32_t i = 0; i < d->size; i++)
        for (int32_t j = 0; j < d->size; j++)
            u[i] -= d->W[i][j] * r[j];
    for (int32_t i = 0; i < d->size; i++)
        assert_true(fabs(u[i]) <= tolerance);
    bodies_traces(bodies, trace);
    for (int32_t k = 0; k < bodies->constraints; k++) {
        for (int32_t i = bodies->rows[k]; i < bodies->rows[k + 1]; i++)
            trace[k] -= d->W[i][i];
        assert_true(fabs(trace[k]) <= tolerance);
    }
    entries = perp__bodies_delassus_entries(bodies);
    assert_in_range(entries, d->size, MOST * MOST);
    perp__bodies_delassus(bodies, starts, rows, values);
    assert_int_equal(starts[d->size], entries);
    for (int32_t j = 0; j < d->size; j++) {
        double column[MOST] = {0};

        for (int32_t k = starts[j]; k < starts[j + 1]; k++) {
            assert_true(k == starts[j] || rows[k] > rows[k - 1]);
            column[rows[k]] = values[k];
        }
        for (int32_t i = 0; i < d->size; i++)
            assert_true(fabs(column[i] - d->W[i][j]) <= tolerance);
    }
}

static void test_against_dense_algebra(void **state)
{
    static const int32_t shapes[][12] = {
        {6, 6, 6, 6}, {3, 3, 3},    {3, 3, 3, 3, 3, 3, 3, 3}, {1, 1, 1, 1, 1}, {12, 2, 7, 1},
        {6, 6, 3},    {5, 5, 1, 2}, {1, 1, 1, 3, 1, 1, 1, 3}};
    static const int32_t widths[] = {6, 3, 6, 1, 12, 3, 5, 6};
    gen_random random;

    (void)state;
    gen_seed(&random, 3);
    for (size_t k = 0; k < sizeof shapes / sizeof shapes[0]; k++)
        for (int32_t scattered = 0; scattered < 2; scattered++) {
            perp__bodies bodies;
            int32_t suits = 0;
            dense d;

            draw(&d, &random, shapes[k], scattered);
            if (scattered && d.n % 5 == 0)
                continue;
            memset(&bodies, 0, sizeof bodies);
            bodies.context = context;
            assert_int_equal(setup(&bodies, &d, &suits), PERP_OK);
            assert_true(suits);
            if (!scattered && k != 5)
                assert_int_equal(bodies.width, widths[k]);
            compare(&bodies, &d);
            assert_int_equal(setup(&bodies, &d, &suits), PERP_OK); /* again, in the same memory */
            compare(&bodies, &d);
            perp__bodies_release(&bodies);
        }
}

static void test_refusals(void **state)
{
    const int32_t large[] = {13, 0}, plain[] = {6, 6, 0};
    perp__bodies bodies;
    gen_random random;
    int32_t suits = 1;
    dense d;

    (void)state;
    gen_seed(&random, 4);
    memset(&bodies, 0, sizeof bodies);
    bodies.context = context;
    draw(&d, &random, large, 0);
    assert_int_equal(setup(&bodies, &d, &suits), PERP_OK);
    assert_false(suits);
    draw(&d, &random, plain, 0);
    d.M[8][8] = -1.0;
    assert_int_equal(setup(&bodies, &d, &suits), PERP_ERROR_ARGUMENT);
    assert_string_equal(perp_context_message(context),
                        "M is not positive definite: found at unknown 8");
    d.M[8][8] = 8.0;
    assert_int_equal(setup(&bodies, &d, &suits), PERP_OK);
    reference(&d);
    compare(&bodies, &d);
    perp__bodies_release(&bodies);
}

static void test_failing_memory(void **state)
{
    const int32_t blocks[] = {6, 6, 0};
    gen_random random;
    dense d;

    (void)state;
    gen_seed(&random, 5);
    draw(&d, &random, blocks, 0);
    for (int fails = 1; fails < 10; fails++) {
        memory m = {0, 0, 0};
        perp_context_settings settings = memory_settings(&m);
        perp_context *own;
        perp__bodies bodies;
        int32_t suits;
        perp_status status;

        assert_int_equal(perp_context_create(&own, &settings), PERP_OK);
        memset(&bodies, 0, sizeof bodies);
        bodies.context = own;
        m.fails_at = m.calls + fails;
        status = setup(&bodies, &d, &suits);
        assert_int_equal(status, fails <= 3 ? PERP_ERROR_MEMORY : PERP_OK);
        perp__bodies_release(&bodies);
        perp_context_destroy(own);
        assert_int_equal(m.live, 0);
    }
}

/* CSC as simulators give it: W is symmetric, bit for bit, and as H M^-1 H' of the piles has it. */
static void test_piles(void **state)
{
    (void)state;
    for (int32_t class = 0; class < PILES_CLASSES; class ++) {
        piles_options options = piles_defaults();
        perp__matrix M, H;
        perp__bodies bodies;
        perp__bodies_input input;
        int32_t suits, *starts, *rows;
        double *values, *e, *u;
        int64_t entries;
        piles p;

        options.class = class;
        options.mass_ratio = 1e8;
        piles_make(&p, &options);
        starts = gen_allocate((size_t)p.contacts + 1, sizeof *starts);
        for (int32_t k = 0; k < p.contacts; k++)
            starts[k + 1] = starts[k] + p.dims[k];
        assert_int_equal(perp__matrix_read(context, "M", &M, &p.M), PERP_OK);
        assert_int_equal(perp__matrix_read(context, "H", &H, &p.H), PERP_OK);
        memset(&input, 0, sizeof input);
        input.n = p.n;
        input.contacts = p.contacts;
        input.size = p.rows;
        input.starts = starts;
        input.M = &M;
        input.H = &H;
        memset(&bodies, 0, sizeof bodies);
        bodies.context = context;
        assert_int_equal(perp__bodies_setup(&bodies, &input, &suits), PERP_OK);
        assert_true(suits && bodies.width == 6 && bodies.blocks == p.bodies);
        entries = perp__bodies_delassus_entries(&bodies);
        rows = gen_allocate((size_t)entries, sizeof *rows);
        values = gen_allocate((size_t)entries, sizeof *values);
        free(starts);
        starts = gen_allocate((size_t)p.rows + 1, sizeof *starts);
        perp__bodies_delassus(&bodies, starts, rows, values);
        e = gen_allocate((size_t)p.rows, sizeof *e);
        u = gen_allocate((size_t)p.rows, sizeof *u);
        for (int32_t j = 0; j < p.rows; j += 7) { /* columns by products */
            e[j] = 1.0;
            perp__bodies_multiply(&bodies, e, NULL, u);
            for (int32_t k = starts[j]; k < starts[j + 1]; k++) {
                assert_true(fabs(u[rows[k]] - values[k]) <= 1e-13 * (1.0 + fabs(values[k])));
                u[rows[k]] = 0.0;
            }
            for (int32_t i = 0; i < p.rows; i++)
                assert_true(u[i] == 0.0);
            e[j] = 0.0;
        }
        for (int32_t j = 0; j < p.rows; j++)
            for (int32_t k = starts[j]; k < starts[j + 1]; k++)
                for (int32_t l = starts[rows[k]]; l < starts[rows[k] + 1]; l++)
                    assert_true(rows[l] != j || values[l] == values[k]);
        free(e);
        free(u);
        free(starts);
        free(rows);
        free(values);
        perp__bodies_release(&bodies);
        piles_destroy(&p);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_against_dense_algebra), cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_failing_memory), cmocka_unit_test(test_piles)};

    return cmocka_run_group_tests(tests, make, destroy);
}
