/* Small problems over a dense or sparse M, the robot's case: W against elimination, cold and warm
 * answers against the laws recomputed, and the same answer from every storage. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

#include "contact/dynamics/dynamics.h"

enum { N = 20, CONTACTS = 5, LIMITS = 8, ROWS = 3 * CONTACTS + LIMITS, SIZE = ROWS + 1 };

static uint64_t seed;

static double draw(void)
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(seed >> 11) * 0x1p-52 - 1.0;
}

/* A well-conditioned lower triangle: M = L L' has a condition number below 100. */
static void draw_triangle(int n, double *L)
{
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++)
            L[i + j * n] = i == j ? 1.0 + 0.5 * fabs(draw()) : i > j ? 0.5 * draw() / n : 0.0;
}

/* W_ab = (L^-1 a)'(L^-1 b), each by its own substitution. */
static double entry(int n, const double *L, const double *a, const double *b)
{
    double x[64], y[64], sum = 0.0;
    for (int i = 0; i < n; i++) {
        x[i] = a[i];
        y[i] = b[i];
        for (int k = 0; k < i; k++) {
            x[i] -= L[i + k * n] * x[k];
            y[i] -= L[i + k * n] * y[k];
        }
        x[i] /= L[i + i * n];
        y[i] /= L[i + i * n];
        sum += x[i] * y[i];
    }
    return sum;
}

/* Rows of A begin with as many zeros as they like; tiles are full, or not. */
static void test_half(void **state)
{
    static const int sizes[][2] = {{1, 1}, {5, 3}, {13, 8}, {30, 21}, {64, 70}};
    static double L[64 * 64], A[70 * 64], Y[64 * 72], W[70 * 70], work[64];
    (void)state;
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        const int n = sizes[k][0], size = sizes[k][1];
        const size_t width = perp__half_width(size);
        int32_t firsts[9];
        seed = k + 1;
        draw_triangle(n, L);
        memset(Y, 0, sizeof Y);
        for (int t = 0; t < 9; t++)
            firsts[t] = n;
        for (int a = 0; a < size; a++) {
            const int zeros = a * n / (size + 1);
            for (int i = 0; i < n; i++)
                A[a * n + i] = Y[(size_t)i * width + (size_t)a] = i < zeros ? 0.0 : draw();
            if (zeros < firsts[a / 8])
                firsts[a / 8] = zeros;
        }
        perp__half_solve(n, size, L, Y, firsts, work);
        perp__half_product(n, size, Y, firsts, W);
        for (int a = 0; a < size; a++)
            for (int b = 0; b < size; b++)
                /* sums of n terms of size 1, in other orders */
                assert_true(fabs(W[a * size + b] - entry(n, L, A + a * n, A + b * n)) <=
                            16.0 * n * DBL_EPSILON);
    }
}

typedef struct machine {
    double M[N * N], H[ROWS * N], G[N], f[N], w[ROWS], b[1], mu[CONTACTS];
    double lower[LIMITS], upper[LIMITS]; /* of the last rows, where upper[0] > 0: dry friction */
    double sparse[N * N + (ROWS + 1) * N];
    int32_t starts[3][N + 1], indices[N * N + (ROWS + 1) * N];
} machine;

static void move(machine *m, double size)
{
    for (int i = 0; i < N; i++)
        for (int j = 0; j <= i; j++)
            m->M[i * N + j] = m->M[j * N + i] += size * (0.1 * draw() + 0.2 * (i == j));
    for (int k = 0; k < 3 * CONTACTS * N; k++)
        m->H[k] += size * draw();
    for (int k = 0; k < N; k++) {
        m->G[k] += size * draw();
        m->f[k] += 2.0 * size * draw();
    }
    for (int k = 0; k < 3 * CONTACTS; k++)
        m->w[k] += size * (draw() - (k % 3 == 0));
    for (int k = 0; k < LIMITS; k++)
        m->w[3 * CONTACTS + k] += size * (k < 3 ? draw() : 20.0);
}

static void draw_machine(machine *m)
{
    memset(m, 0, sizeof *m);
    for (int i = 0; i < N; i++)
        m->M[i * N + i] = 2.0;
    for (int k = 0; k < LIMITS; k++)
        m->H[(3 * CONTACTS + k) * N + 6 + k] = 1.0;
    for (int k = 0; k < CONTACTS; k++)
        m->mu[k] = 0.5 + 0.3 * draw();
    move(m, 1.0);
}

static int32_t compress(machine *m, int32_t at, int which, const double *A, int rows,
                        perp_matrix *view)
{
    const int32_t begin = at;
    for (int j = 0; j < N; j++) {
        m->starts[which][j] = at - begin;
        for (int i = 0; i < rows; i++)
            if (A[i * N + j] != 0.0) {
                m->sparse[at] = A[i * N + j];
                m->indices[at++] = i;
            }
    }
    m->starts[which][N] = at - begin;
    assert_int_equal(
        perp_matrix_csc(view, rows, N, m->starts[which], m->indices + begin, m->sparse + begin),
        PERP_OK);
    return at;
}

typedef struct answer {
    double v[N], r[SIZE], u[SIZE];
    int32_t modes[CONTACTS + LIMITS];
    perp_contact_result result;
} answer;

static void set_up(perp_contact_solver *solver, machine *m, int sparse)
{
    perp_contact_laws laws = fresh_contact_laws();
    perp_contact_dynamics dynamics = fresh_contact_dynamics();
    perp_matrix M, H, G;
    assert_int_equal(perp_struct_init(&M, sizeof M), PERP_OK);
    assert_int_equal(perp_struct_init(&H, sizeof H), PERP_OK);
    assert_int_equal(perp_struct_init(&G, sizeof G), PERP_OK);
    if (sparse) {
        compress(m, compress(m, compress(m, 0, 0, m->M, N, &M), 1, m->H, ROWS, &H), 2, m->G, 1, &G);
    } else {
        const int32_t by_rows = PERP_STORAGE_ROW_MAJOR;
        assert_int_equal(perp_matrix_dense(&M, by_rows, N, N, m->M, N), PERP_OK);
        assert_int_equal(perp_matrix_dense(&H, by_rows, ROWS, N, m->H, N), PERP_OK);
        assert_int_equal(perp_matrix_dense(&G, by_rows, 1, N, m->G, N), PERP_OK);
    }
    laws.contacts = CONTACTS;
    laws.bounded = LIMITS;
    laws.mu = m->mu;
    if (m->upper[0] > 0.0) {
        laws.lower = m->lower;
        laws.upper = m->upper;
    }
    dynamics.n = N;
    dynamics.M = &M;
    dynamics.H = &H;
    dynamics.G = &G;
    assert_int_equal(perp_contact_solver_setup_dynamics(solver, &laws, &dynamics), PERP_OK);
}

static void solve(perp_contact_solver *solver, const machine *m, const double *r0, answer *a)
{
    assert_int_equal(perp_struct_init(&a->result, sizeof a->result), PERP_OK);
    assert_int_equal(perp_contact_solver_solve_dynamics(solver, ANSWER(a->v, a->r, a->u, a->modes),
                                                        &a->result, m->f, m->w, m->b, r0),
                     PERP_OK);
}

static double times(const double *a, const double *x)
{
    double sum = 0.0;
    for (int j = 0; j < N; j++)
        sum += a[j] * x[j];
    return sum;
}

/* The laws from M, H, G alone: velocities are of size 10 at most, tol is 1e-8. */
static void check_laws(const machine *m, const answer *a)
{
    const double small = 1e-6;
    assert_true(a->result.outcome == PERP_OUTCOME_SOLVED ||
                a->result.outcome == PERP_OUTCOME_ROUNDING_LIMIT);
    for (int i = 0; i < N; i++) {
        double push = m->f[i] + m->G[i] * a->r[ROWS];
        for (int k = 0; k < ROWS; k++)
            push += m->H[k * N + i] * a->r[k];
        assert_true(fabs(times(m->M + i * N, a->v) - push) <= 1e-12 * (1.0 + fabs(push)) * 100.0);
    }
    for (int k = 0; k < CONTACTS; k++) {
        const double *r = a->r + 3 * k;
        double u[3], slip, friction = hypot(r[1], r[2]);
        for (int i = 0; i < 3; i++)
            u[i] = times(m->H + (3 * k + i) * N, a->v) + m->w[3 * k + i];
        slip = hypot(u[1], u[2]);
        assert_true(r[0] >= 0.0 && u[0] >= -small && fabs(r[0] * u[0]) <= small);
        assert_true(friction <= m->mu[k] * r[0] * (1.0 + 1e-15));
        assert_true(fabs(r[1] * u[1] + r[2] * u[2] + m->mu[k] * r[0] * slip) <= small);
        if (a->modes[k] == PERP_CONTACT_STICK)
            assert_true(a->u[3 * k] == 0.0 && a->u[3 * k + 1] == 0.0 && a->u[3 * k + 2] == 0.0);
        if (a->modes[k] == PERP_CONTACT_SEPARATE)
            assert_true(r[0] == 0.0 && r[1] == 0.0 && r[2] == 0.0);
    }
    for (int i = 3 * CONTACTS; i < ROWS; i++) {
        const double u = times(m->H + i * N, a->v) + m->w[i];
        const double most = m->upper[i - 3 * CONTACTS];
        if (m->upper[0] > 0.0) {
            assert_true(fabs(a->r[i]) <= most);
            assert_true(fabs(u) <= small || a->r[i] == (u > 0.0 ? -most : most));
            continue;
        }
        assert_true(a->r[i] >= 0.0 && u >= -small && fabs(a->r[i] * u) <= small);
    }
    assert_true(fabs(times(m->G, a->v) + m->b[0]) <= small);
}

/* Steps of a machine that moves: from nothing, and from the step before, which takes few Newton
 * steps and no sweeps. */
static void test_steps(void **state)
{
    perp_context *context;
    perp_contact_solver *solver;
    int quick = 0, steps = 0;
    (void)state;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    assert_int_equal(perp_contact_solver_create(context, &solver, NULL), PERP_OK);
    for (uint64_t k = 1; k <= 20; k++) {
        machine m;
        answer cold, warm, sparse;
        seed = 11 * k;
        draw_machine(&m);
        set_up(solver, &m, 0);
        solve(solver, &m, NULL, &cold);
        check_laws(&m, &cold);
        for (int step = 0; step < 10; step++, steps++) {
            move(&m, 1e-3);
            set_up(solver, &m, 0);
            solve(solver, &m, cold.r, &warm);
            check_laws(&m, &warm);
            quick +=
                warm.result.method == PERP_CONTACT_METHOD_PROXIMAL && warm.result.iterations <= 6;
            set_up(solver, &m, 1);
            solve(solver, &m, cold.r, &sparse);
            check_laws(&m, &sparse);
            for (int j = 0; j < N; j++) /* the same point by other sums */
                assert_true(fabs(sparse.v[j] - warm.v[j]) <= 1e-6 * (1.0 + fabs(warm.v[j])));
            cold = warm;
        }
        solve(solver, &m, cold.r, &warm); /* the answer itself is left as it is */
        assert_true(warm.result.method == PERP_CONTACT_METHOD_POLISH &&
                    warm.result.iterations == 0);
    }
    assert_true(10 * quick >= 9 * steps);
    perp_contact_solver_destroy(solver);
    perp_context_destroy(context);
}

/* Joints with dry friction, and more contacts of one body than it has ways to move: sets of modes
 * are singular, and many contradict themselves. */
static void draw_dry(machine *m)
{
    draw_machine(m);
    for (int i = 0; i < 3 * CONTACTS; i++)
        for (int j = 6; j < N; j++)
            m->H[i * N + j] = 0.0;
    memset(m->w, 0, sizeof m->w);
    for (int k = 0; k < LIMITS; k++) {
        m->upper[k] = 0.3 + 0.2 * draw();
        m->lower[k] = -m->upper[k];
    }
}

/* From the step before: thirty sweeps at most, and a few sets from the one that these show. */
static void test_dry_joints(void **state)
{
    perp_context *context;
    perp_contact_solver *solver;
    int quick = 0;
    (void)state;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    assert_int_equal(perp_contact_solver_create(context, &solver, NULL), PERP_OK);
    for (uint64_t k = 1; k <= 20; k++) {
        machine m;
        answer cold, warm;
        seed = 13 * k;
        draw_dry(&m);
        set_up(solver, &m, 0);
        solve(solver, &m, NULL, &cold);
        check_laws(&m, &cold);
        for (int step = 0; step < 10; step++) {
            for (int i = 0; i < N; i++)
                m.f[i] += 0.5 * draw();
            set_up(solver, &m, 0);
            solve(solver, &m, cold.r, &warm);
            check_laws(&m, &warm);
            quick +=
                warm.result.method == PERP_CONTACT_METHOD_PROXIMAL && warm.result.iterations <= 60;
            cold = warm;
        }
    }
    assert_true(quick >= 180); /* half of them where such sets end the search */
    perp_contact_solver_destroy(solver);
    perp_context_destroy(context);
}

static int32_t stop(const perp_contact_progress *progress, void *user)
{
    (void)progress;
    (void)user;
    return 1;
}

/* Stopped before a set was found the start is still judged, and handed over. */
static void test_stopped(void **state)
{
    perp_context *context;
    perp_contact_solver *solver;
    perp_contact_settings settings = fresh_contact_settings();
    machine m;
    answer a;
    (void)state;
    seed = 3;
    draw_machine(&m);
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    settings.monitor = stop;
    assert_int_equal(perp_contact_solver_create(context, &solver, &settings), PERP_OK);
    set_up(solver, &m, 0);
    solve(solver, &m, NULL, &a);
    assert_int_equal(a.result.outcome, PERP_OUTCOME_STOPPED);
    assert_int_equal(a.result.method, PERP_CONTACT_METHOD_POLISH);
    assert_true(a.result.residual > 0.01 && isfinite(a.result.residual));
    for (int i = 0; i < SIZE; i++)
        assert_true(a.r[i] == 0.0);
    perp_contact_solver_destroy(solver);
    perp_context_destroy(context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_half), cmocka_unit_test(test_steps),
                                       cmocka_unit_test(test_dry_joints),
                                       cmocka_unit_test(test_stopped)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
