/* Method sweep on what is not a plain contact: discs of rolling and spinning, bilateral rows,
 * compliance; and a problem without a solution. */
#include "sweep_fixture.h"

/* One contact that rolls and spins, W = I: three discs of radius coefficient * r_n. */
static void test_discs(void **state)
{
    static const double q[6] = {-2, 3, 0, 0.25, 0.25, -4};
    const double mu = 0.5, rolling = 0.25, spinning = 0.125;
    const int32_t dims = 3;
    double identity[36] = {0};
    fixture f;

    (void)state;
    memset(&f, 0, sizeof f);
    f.starts = gen_allocate(2, sizeof *f.starts);
    f.starts[1] = 6;
    prepare(&f, 1, 6);
    f.problem.dims = &dims;
    f.problem.mu = &mu;
    f.problem.rolling = &rolling;
    f.problem.spinning = &spinning;
    f.problem.has_discs = 1;
    f.trace[0] = 6;
    memcpy(f.q, q, sizeof q);
    for (int32_t i = 0; i < 6; i++)
        identity[7 * i] = 1.0;
    f.W.rows = f.W.columns = 6;
    f.W.row_stride = 6;
    f.W.column_stride = 1;
    f.W.values = identity;
    f.problem.W = &f.W;
    assert_int_equal(run(&f), PERP_OUTCOME_SOLVED);
    assert_true(f.r[0] == 2.0);
    assert_true(f.r[1] == -1.0 && f.r[2] == 0.0);    /* slips: mu r_n = 1 < 3 */
    assert_true(f.r[3] == -0.25 && f.r[4] == -0.25); /* 0.354 < rolling r_n = 0.5 */
    assert_true(f.r[5] == 0.25 && f.u[5] == -3.75);  /* spins */
    assert_int_equal(f.modes[0], SLIP);
    end(&f);
}

/* A bilateral row beside a contact: W = [[2, 1], [1, 2]], u_0 perp r_0, u_1 = 0. */
static void test_bilateral(void **state)
{
    static const double W[4] = {2, 1, 1, 2};
    const int32_t dims = 1;
    const double mu = 0.0;
    fixture f;

    (void)state;
    memset(&f, 0, sizeof f);
    f.starts = gen_allocate(3, sizeof *f.starts);
    f.starts[1] = 1;
    f.starts[2] = 2;
    prepare(&f, 1, 2);
    f.problem.rows = 1;
    f.problem.tol = 1e-14;
    f.problem.dims = &dims;
    f.problem.mu = &mu;
    f.trace[0] = f.trace[1] = 2;
    f.q[0] = -1;
    f.q[1] = 4;
    f.W.rows = f.W.columns = 2;
    f.W.row_stride = 2;
    f.W.column_stride = 1;
    f.W.values = W;
    f.problem.W = &f.W;
    assert_int_equal(run(&f), PERP_OUTCOME_SOLVED);
    assert_true(fabs(f.r[0] - 2.0) <= 1e-13 && fabs(f.r[1] + 3.0) <= 1e-13); /* 2 r0 + r1 = 1 */
    end(&f);
}

/* What does not fit into a packed contact goes the general way among those that do: compliance that
 * differs between the tangents, rolling and spinning, a bilateral row that holds two boxes together
 * sideways. In body space and with W. */
static double rolling[16], spinning[16], compliance[64], w[64];

static int32_t number_rows(fixture *f)
{
    int32_t row = 0;

    for (int32_t k = 0; k < 16; k++) {
        f->starts[k] = row;
        row += 3 + (k % 4 == 1) * 3; /* rolls and spins: 2 and 1 rows of zeros and compliance */
        rolling[k] = k % 4 == 1 ? 0.01 : 0.0;
        spinning[k] = k % 4 == 1 ? 0.02 : 0.0;
        for (int32_t i = 0; i < 3; i++)
            w[f->starts[k] + i] = f->p.w[3 * k + i];
        if (k % 4 == 1)
            for (int32_t i = 3; i < 6; i++) {
                w[f->starts[k] + i] = 0.1 * i - 0.35;
                compliance[f->starts[k] + i] = 1.0;
            }
        if (k % 4 == 2)
            compliance[f->starts[k] + 1] = 0.5;
    }
    f->starts[16] = row;
    f->starts[17] = row + 1;
    for (int32_t j = 0; j < f->p.H_starts[24]; j++)
        f->p.H_rows[j] = f->starts[f->p.H_rows[j] / 3] + f->p.H_rows[j] % 3;
    f->p.H.rows = row;
    return row;
}

/* The bodies of M, H and one row G, and the problem on them. */
static void set_up(fixture *f, int32_t row)
{
    static const double b[1] = {0.25};
    int32_t G_starts[25], G_rows[24], suits;
    double G_values[24];
    perp__matrix M, H, G;
    perp__bodies_input input;

    memset(G_starts, 0, sizeof G_starts);
    for (int32_t j = 0; j < 24; j++) { /* velocity of box 0 against box 3, along x */
        if (j == 0 || j == 18) {
            G_rows[G_starts[j]] = 0;
            G_values[G_starts[j]] = j == 0 ? 1.0 : -1.0;
        }
        G_starts[j + 1] = G_starts[j] + (j == 0 || j == 18);
    }
    assert_int_equal(perp__matrix_read(context, "M", &M, &f->p.M), PERP_OK);
    assert_int_equal(perp__matrix_read(context, "H", &H, &f->p.H), PERP_OK);
    memset(&G, 0, sizeof G);
    G.rows = 1;
    G.columns = 24;
    G.values = G_values;
    G.column_starts = G_starts;
    G.row_indices = G_rows;
    memset(&input, 0, sizeof input);
    input.n = 24;
    input.contacts = 16;
    input.size = row + 1;
    input.starts = f->starts;
    input.M = &M;
    input.H = &H;
    input.G = &G;
    input.compliance = compliance;
    assert_int_equal(perp__bodies_setup(&f->bodies, &input, &suits), PERP_OK);
    free(f->trace);
    free(f->q);
    free(f->r);
    free(f->u);
    free(f->modes);
    prepare(f, 16, row + 1);
    f->problem.rows = row;
    f->problem.rolling = rolling;
    f->problem.spinning = spinning;
    f->problem.has_discs = 1;
    f->problem.tol = 1e-9;
    bodies_load(&f->bodies, f->p.f, w, b, f->q);
    bodies_traces(&f->bodies, f->trace);
}

static void make_W(fixture *f, int32_t row)
{
    free(f->W_starts);
    free(f->W_rows);
    free(f->W_values);
    f->W_starts = gen_allocate((size_t)row + 2, sizeof *f->W_starts);
    f->W_rows = gen_allocate((size_t)perp__bodies_delassus_entries(&f->bodies), sizeof *f->W_rows);
    f->W_values = gen_allocate((size_t)perp__bodies_delassus_entries(&f->bodies), sizeof(double));
    perp__bodies_delassus(&f->bodies, f->W_starts, f->W_rows, f->W_values);
    f->W.rows = f->W.columns = row + 1;
    f->W.column_starts = f->W_starts;
    f->W.row_indices = f->W_rows;
    f->W.values = f->W_values;
}

static void test_general_units(void **state)
{
    piles_options options = piles_defaults();
    int32_t row;
    fixture f;

    (void)state;
    options.contacts = 16;
    options.layers = 4;
    options.motion = PILES_IMPACT;
    begin(&f, &options);
    assert_true(f.p.n == 24 && f.p.contacts == 16);
    row = number_rows(&f);
    set_up(&f, row);
    assert_int_equal(run(&f), PERP_OUTCOME_SOLVED);
    make_W(&f, row);
    assert_true(law(&f) <= 10 * f.problem.tol);
    velocities(&f, f.u);
    assert_true(fabs(f.u[row]) <= 1e-7); /* the bilateral row; velocities are of order 1 */
    for (int32_t k = 1; k < 16; k += 4) {
        const double *r = f.r + f.starts[k], *u = f.u + f.starts[k];

        assert_true(hypot(r[3], r[4]) <= rolling[k] * r[0] * (1 + 1e-12));
        assert_true(fabs(r[5]) <= spinning[k] * r[0] * (1 + 1e-12));
        assert_true(fabs(r[5] * u[5] + spinning[k] * r[0] * fabs(u[5])) <= 1e-6);
        assert_true(fabs(r[3] * u[3] + r[4] * u[4] + rolling[k] * r[0] * hypot(u[3], u[4])) <=
                    1e-6);
    }
    f.problem.W = &f.W;
    f.problem.bodies = NULL;
    f.iterate.warm = 1;
    assert_int_equal(run(&f), PERP_OUTCOME_SOLVED);
    assert_in_range(f.iterate.iterations, 1, 3);
    end(&f);
}

static void test_no_solution(void **state)
{
    static const double W[4] = {1, -1, -1, 1};
    static const double mu[2] = {0, 0};
    static const int32_t dims[2] = {1, 1};
    fixture f;

    (void)state;
    memset(&f, 0, sizeof f);
    f.starts = gen_allocate(3, sizeof *f.starts);
    f.starts[1] = 1;
    f.starts[2] = 2;
    prepare(&f, 2, 2);
    f.problem.dims = dims;
    f.problem.mu = mu;
    f.trace[0] = f.trace[1] = 1;
    f.q[0] = f.q[1] = -1;
    f.W.rows = f.W.columns = 2;
    f.W.row_stride = 2;
    f.W.column_stride = 1;
    f.W.values = W;
    f.problem.W = &f.W;
    assert_int_equal(run(&f), PERP_OUTCOME_STALLED);
    assert_false(f.iterate.has_modes);
    assert_true(isfinite(f.r[0]) && isfinite(f.r[1]));
    end(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_discs), cmocka_unit_test(test_bilateral),
        cmocka_unit_test(test_general_units), cmocka_unit_test(test_no_solution)};

    return cmocka_run_group_tests(tests, make, destroy);
}
