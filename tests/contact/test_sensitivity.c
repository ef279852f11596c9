/* Derivatives of contact: closed forms, central differences of solves, the adjoint against the
 * forward products, and what has none. */
#include <math.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

#include "context.h"

enum { N = 12, ROWS = 12, BILATERAL = 1, SIZE = ROWS + BILATERAL, CONTACTS = 3, BOUNDED = 3 };

static uint64_t seed;

static double draw(void)
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(seed >> 11) * 0x1p-52 - 1.0;
}

/* Three contacts in space, a limit, a motor and a friction of a given bound, an equation. */
typedef struct data {
    double M[N * N], H[ROWS * N], G[BILATERAL * N], f[N], w[ROWS], b[BILATERAL], mu[CONTACTS];
} data;

typedef struct answer {
    double v[N], r[SIZE], u[SIZE];
    int32_t modes[CONTACTS + BOUNDED];
} answer;

static const double lower[BOUNDED] = {0.0, -0.3, -0.2}, upper[BOUNDED] = {INFINITY, 0.3, 0.2};

typedef struct rig {
    perp_contact_settings settings;
    perp_contact_laws laws;
    perp_contact_dynamics dynamics;
    perp_matrix M, H, G;
} rig;

static void view(perp_matrix *A, int32_t rows, const double *values)
{
    assert_int_equal(perp_struct_init(A, sizeof *A), PERP_OK);
    assert_int_equal(perp_matrix_dense(A, PERP_STORAGE_ROW_MAJOR, rows, N, values, N), PERP_OK);
}

/* tol is what differences with steps of 1e-5 need. */
static void rig_of(const data *p, rig *g)
{
    assert_int_equal(perp_contact_settings_init(&g->settings, sizeof g->settings), PERP_OK);
    assert_int_equal(perp_contact_laws_init(&g->laws, sizeof g->laws), PERP_OK);
    assert_int_equal(perp_struct_init(&g->dynamics, sizeof g->dynamics), PERP_OK);
    view(&g->M, N, p->M);
    view(&g->H, ROWS, p->H);
    view(&g->G, BILATERAL, p->G);
    g->settings.tol = 1e-13;
    g->laws.contacts = CONTACTS;
    g->laws.mu = p->mu;
    g->laws.bounded = BOUNDED;
    g->laws.lower = lower;
    g->laws.upper = upper;
    g->dynamics.n = N;
    g->dynamics.M = &g->M;
    g->dynamics.H = &g->H;
    g->dynamics.G = &g->G;
}

static void draw_data(data *p)
{
    double L[N * N];
    for (int k = 0; k < N * N; k++)
        L[k] = draw();
    memset(p->M, 0, sizeof p->M);
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++)
            for (int k = 0; k < N; k++)
                p->M[i * N + j] += 0.2 * L[i * N + k] * L[j * N + k] + (i == j && k == 0);
    for (int k = 0; k < ROWS * N; k++)
        p->H[k] = draw();
    for (int k = 0; k < N; k++) {
        p->G[k] = draw();
        p->f[k] = 2.0 * draw();
    }
    for (int k = 0; k < ROWS; k++)
        p->w[k] = draw() - (k % 3 == 0 && k < 9);
    p->b[0] = draw();
    for (int k = 0; k < CONTACTS; k++)
        p->mu[k] = 0.3 + 0.2 * draw();
}

static int solve(const data *p, answer *a)
{
    perp_contact_result result = fresh_contact_result();
    rig g;
    rig_of(p, &g);
    assert_int_equal(perp_contact_solve(context, ANSWER(a->v, a->r, a->u, a->modes), &result,
                                        &g.settings,
                                        DYNAMICS(&g.laws, &g.dynamics, p->f, p->w, p->b), NULL),
                     PERP_OK);
    return result.outcome == PERP_OUTCOME_SOLVED || result.outcome == PERP_OUTCOME_ROUNDING_LIMIT;
}

static void add(data *p, double h, const data *d)
{
    double *x = (double *)p;
    for (size_t k = 0; k < sizeof *p / sizeof *x; k++)
        x[k] += h * ((const double *)d)[k];
}

static perp_contact_sensitivity *sensitivity_at(const data *p, const answer *a, rig *g,
                                                perp_contact_sensitivity_info *info)
{
    perp_contact_sensitivity *s = NULL;
    rig_of(p, g);
    g->settings.tol = 1e-9;
    assert_int_equal(perp_struct_init(info, sizeof *info), PERP_OK);
    assert_int_equal(
        perp_contact_sensitivity_create(context, &s, info, &g->settings,
                                        DYNAMICS(&g->laws, &g->dynamics, p->f, p->w, p->b), a->r),
        PERP_OK);
    return s;
}

static void draw_direction(data *d)
{
    double *x = (double *)d;
    for (size_t k = 0; k < sizeof *d / sizeof *x; k++)
        x[k] = draw();
    for (int i = 0; i < N; i++)
        for (int j = 0; j < i; j++)
            d->M[i * N + j] = d->M[j * N + i];
}

static void forward(perp_contact_sensitivity *s, const data *d, double *dv, double *dr)
{
    perp_matrix dM, dH, dG;
    view(&dM, N, d->M);
    view(&dH, ROWS, d->H);
    view(&dG, BILATERAL, d->G);
    assert_int_equal(perp_contact_sensitivity_forward(
                         s, dv, dr, DIRECTION(d->f, d->w, d->b, d->mu, &dM, &dH, &dG)),
                     PERP_OK);
}

/* Against (x(h) - x(-h)) / 2h, h = 1e-5: the third derivative leaves h^2 of it, the solves 1e-13 /
 * h of their size; where derivatives are large both are in proportion. */
static void compare(const data *p, const data *d, const double *dv, const double *dr)
{
    const double h = 1e-5;
    data ahead = *p, behind = *p;
    answer x, y;
    double size = 1.0;
    add(&ahead, h, d);
    add(&behind, -h, d);
    assert_true(solve(&ahead, &x) && solve(&behind, &y));
    for (int i = 0; i < SIZE; i++)
        size = fmax(size, fabs(dr[i]));
    for (int j = 0; j < N; j++)
        assert_true(fabs((x.v[j] - y.v[j]) / (2.0 * h) - dv[j]) <= 2e-6 * size * size);
    for (int i = 0; i < SIZE; i++)
        assert_true(fabs((x.r[i] - y.r[i]) / (2.0 * h) - dr[i]) <= 2e-6 * size * size);
}

/* g'dv + h'dr = (gradients)'(changes), for every kind of data. */
static void check_adjoint(perp_contact_sensitivity *s, const answer *a, const data *d,
                          const double *dv, const double *dr)
{
    double gv[N], gr[SIZE], x[N], y[ROWS], z[BILATERAL], mu[CONTACTS], left = 0.0, right = 0.0;
    double size = 1.0;
    for (int j = 0; j < N; j++)
        gv[j] = draw();
    for (int i = 0; i < SIZE; i++)
        gr[i] = draw();
    assert_int_equal(perp_contact_sensitivity_adjoint(s, x, y, z, mu, gv, gr), PERP_OK);
    for (int j = 0; j < N; j++)
        left += gv[j] * dv[j];
    for (int i = 0; i < SIZE; i++) {
        left += gr[i] * dr[i];
        size = fmax(size, fabs(dr[i]));
    }
    for (int j = 0; j < N; j++) {
        right += x[j] * d->f[j];
        for (int i = 0; i < N; i++)
            right -= x[i] * a->v[j] * d->M[i * N + j];
        for (int i = 0; i < ROWS; i++)
            right += (a->r[i] * x[j] + y[i] * a->v[j]) * d->H[i * N + j];
        right += (a->r[ROWS] * x[j] + z[0] * a->v[j]) * d->G[j];
    }
    for (int i = 0; i < ROWS; i++)
        right += y[i] * d->w[i];
    right += z[0] * d->b[0];
    for (int k = 0; k < CONTACTS; k++)
        right += mu[k] * d->mu[k];
    assert_true(fabs(left - right) <= 1e-11 * size * size); /* rounding alone */
}

static void test_differences(void **state)
{
    int regular = 0, modes[5] = {0};
    (void)state;
    for (uint64_t k = 1; k <= 40; k++) {
        perp_contact_sensitivity_info info;
        perp_contact_sensitivity *s;
        double dv[N], dr[SIZE];
        data p, d;
        answer a;
        rig g;
        seed = 5 * k;
        draw_data(&p);
        if (!solve(&p, &a))
            continue;
        s = sensitivity_at(&p, &a, &g, &info);
        /* modes that 1e-5 may change, and kinks beside which curvature is large, are left out */
        if (info.verdict == PERP_VERDICT_REGULAR && info.margin > 2e-2 && info.condition < 1e3) {
            draw_direction(&d);
            forward(s, &d, dv, dr);
            compare(&p, &d, dv, dr);
            check_adjoint(s, &a, &d, dv, dr);
            regular++;
            for (int c = 0; c < CONTACTS + BOUNDED; c++)
                modes[a.modes[c]]++;
        }
        perp_contact_sensitivity_destroy(s);
    }
    assert_true(regular >= 10);
    for (int m = 0; m < 5; m++)
        assert_true(modes[m] > 0);
}

/* ---- a block on a plane: M = m, u = v, n = 3, rows normal first ---- */

typedef struct block {
    double M[9], H[9], f[3], w[3], mu;
    perp_contact_sensitivity_info info;
    perp_contact_sensitivity *s;
} block;

static perp_status open_block(block *b, const double *r)
{
    perp_contact_laws laws = fresh_contact_laws();
    perp_contact_dynamics dynamics = fresh_contact_dynamics();
    perp_matrix M, H;
    M = matrix_rows(b->M, 3, 3);
    H = matrix_rows(b->H, 3, 3);
    assert_int_equal(perp_struct_init(&b->info, sizeof b->info), PERP_OK);
    laws.contacts = 1;
    laws.mu = &b->mu;
    dynamics.n = 3;
    dynamics.M = &M;
    dynamics.H = &H;
    return perp_contact_sensitivity_create(context, &b->s, &b->info, NULL,
                                           DYNAMICS(&laws, &dynamics, b->f, b->w), r);
}

/* Mass 2, weight 10, pushed along the plane by (3, 4) times `push`. */
static block block_pushed(double push)
{
    const block b = {.M = {2, 0, 0, 0, 2, 0, 0, 0, 2},
                     .H = {0, 0, 1, 1, 0, 0, 0, 1, 0},
                     .f = {3 * push, 4 * push, -10},
                     .mu = 0.5};
    return b;
}

/* It slips along (3, 4) / 5: v = (|f_t| - mu r_n) e / m. dv/dmu = -r_n e / m; of df across e only
 * the share 1 - mu r_n / |f_t| turns the motion, for friction turns with it. */
static void test_slip(void **state)
{
    const double r[3] = {10.0, -3.0, -4.0}, dmu = 1.0, across[3] = {-4.0, 3.0, 0.0};
    block b = block_pushed(2.0);
    double dv[3], dr[3], mu;
    (void)state;
    assert_int_equal(open_block(&b, r), PERP_OK);
    assert_int_equal(b.info.verdict, PERP_VERDICT_REGULAR);
    assert_int_equal(b.info.active, 3);
    assert_int_equal(
        perp_contact_sensitivity_forward(b.s, dv, dr, DIRECTION(NULL, NULL, NULL, &dmu)), PERP_OK);
    /* sums of a few terms of this size: rounding */
    assert_true(fabs(dv[0] + 3.0) <= 1e-14 && fabs(dv[1] + 4.0) <= 1e-14 && fabs(dv[2]) <= 1e-14);
    assert_true(fabs(dr[0]) <= 1e-14 && fabs(dr[1] + 6.0) <= 1e-13 && fabs(dr[2] + 8.0) <= 1e-13);
    assert_int_equal(perp_contact_sensitivity_forward(b.s, dv, dr, DIRECTION(across)), PERP_OK);
    assert_true(fabs(dv[0] + 1.0) <= 1e-14 && fabs(dv[1] - 0.75) <= 1e-14);
    assert_int_equal(perp_contact_sensitivity_adjoint(b.s, NULL, NULL, NULL, &mu, across, NULL),
                     PERP_OK);
    assert_true(fabs(mu) <= 1e-13); /* mu does not turn the motion */
    perp_contact_sensitivity_destroy(b.s);
}

/* It slips along (1, h), h = 1e-14, with |f_t| = 2 mu r_n: g_r = (0, 1, 1) has the share -(1 - h)
 * of (-h, 1) as its gradient in w. The first of these is
 * rounding where (1, h) is cut out by a difference; 1e-10: rounding of a few products of h. */
static void test_slip_along_an_axis(void **state)
{
    const double h = 1e-14, r[3] = {10.0, -5.0, -5.0 * h}, gr[3] = {0.0, 1.0, 1.0};
    block b = block_pushed(0.0);
    double y[3];
    (void)state;
    b.f[0] = 10.0;
    b.f[1] = 10.0 * h;
    assert_int_equal(open_block(&b, r), PERP_OK);
    assert_int_equal(perp_contact_sensitivity_adjoint(b.s, NULL, y, NULL, NULL, NULL, gr), PERP_OK);
    assert_true(fabs(y[1] - h) <= 1e-10 * h && fabs(y[2] + 1.0) <= 1e-13);
    perp_contact_sensitivity_destroy(b.s);
}

/* It sticks: v = 0 whatever changes but w, which is the plane's velocity. */
static void test_stick(void **state)
{
    const double r[3] = {10.0, -1.5, -2.0}, df[3] = {1.0, 2.0, 3.0}, dw[3] = {0.0, -1.0, 2.0};
    block b = block_pushed(0.5);
    double dv[3], dr[3];
    int32_t mode;
    (void)state;
    assert_int_equal(open_block(&b, r), PERP_OK);
    assert_int_equal(b.info.verdict, PERP_VERDICT_REGULAR);
    assert_int_equal(perp_contact_sensitivity_point(b.s, dv, NULL, NULL, &mode), PERP_OK);
    assert_int_equal(mode, PERP_CONTACT_STICK);
    assert_int_equal(perp_contact_sensitivity_forward(b.s, dv, dr, DIRECTION(df, dw)), PERP_OK);
    assert_true(fabs(dv[0] - 1.0) <= 1e-14 && fabs(dv[1] + 2.0) <= 1e-14 && fabs(dv[2]) <= 1e-14);
    assert_true(fabs(dr[0] + 3.0) <= 1e-14 && fabs(dr[1] - 1.0) <= 1e-14 &&
                fabs(dr[2] + 6.0) <= 1e-14); /* dr = m dv - df */
    perp_contact_sensitivity_destroy(b.s);
}

/* At the threshold, |f_t| = mu r_n, it sticks and is about to slip; a weight on two contacts at the
 * same place; impulses that solve nothing. */
static void test_verdicts(void **state)
{
    const double threshold[3] = {10.0, -3.0, -4.0}, wrong[3] = {11.0, -3.0, -4.0};
    block b = block_pushed(1.0);
    double dv[3];
    (void)state;
    assert_int_equal(open_block(&b, threshold), PERP_OK);
    assert_int_equal(b.info.verdict, PERP_VERDICT_DEGENERATE);
    assert_int_equal(b.info.index, 0);
    assert_true(b.info.margin <= 1e-8);
    assert_int_equal(perp_contact_sensitivity_forward(b.s, dv, NULL, DIRECTION(b.f)), PERP_OK);
    perp_contact_sensitivity_destroy(b.s);
    assert_int_equal(open_block(&b, wrong), PERP_OK);
    assert_int_equal(b.info.verdict, PERP_VERDICT_NOT_A_SOLUTION);
    assert_int_equal(perp_contact_sensitivity_forward(b.s, dv, NULL, DIRECTION(b.f)),
                     PERP_ERROR_ARGUMENT);
    perp_contact_sensitivity_destroy(b.s);
}

/* Two equations with compliance c, joined by W_12 = 3 / m alone, that carry impulses 1e16 apart:
 * db = (0, 1) has dr = -W^-1 db = (W_12, -W_11) / det W, to rounding of each. */
static void test_far_impulses(void **state)
{
    const double m = 0x1p56, c = 0x1p-7, M[4] = {m, 0.0, 0.0, m}, G[4] = {1.0, 1.0, 1.0, 2.0};
    const double compliance[2] = {c, c}, f[2] = {0.0, 0.0}, b[2] = {0x1p55, -1.0};
    const double W[3] = {c + 2.0 / m, 3.0 / m, c + 5.0 / m}, det = W[0] * W[2] - W[1] * W[1];
    const double r[2] = {(W[1] * b[1] - W[2] * b[0]) / det, (W[1] * b[0] - W[0] * b[1]) / det};
    const double db[2] = {0.0, 1.0};
    perp_contact_laws laws = fresh_contact_laws();
    perp_contact_dynamics dynamics = fresh_contact_dynamics();
    perp_contact_sensitivity_info info = fresh_contact_sensitivity_info();
    perp_contact_sensitivity *s;
    perp_matrix matrices[3];
    double dr[2];
    (void)state;
    for (int k = 0; k < 3; k++) { /* M, G, and H without rows */
        matrices[k] = matrix_rows(k == 0 ? M : G, k == 2 ? 0 : 2, 2);
    }
    dynamics.n = 2;
    dynamics.M = &matrices[0];
    dynamics.G = &matrices[1];
    dynamics.H = &matrices[2];
    laws.compliance = compliance;
    assert_int_equal(perp_contact_sensitivity_create(context, &s, &info, NULL,
                                                     DYNAMICS(&laws, &dynamics, f, NULL, b), r),
                     PERP_OK);
    assert_int_equal(perp_contact_sensitivity_forward(s, NULL, dr, DIRECTION(NULL, NULL, db)),
                     PERP_OK);
    assert_true(fabs(dr[0] - W[1] / det) <= 1e-12 * W[1] / det);
    assert_true(fabs(dr[1] + W[0] / det) <= 1e-12 * W[0] / det);
    perp_contact_sensitivity_destroy(s);
}

static void test_redundant(void **state)
{
    const double M = 1.0, H[2] = {1.0, 1.0}, f = -1.0, w[2] = {0.0, 0.0}, r[2] = {0.5, 0.5};
    perp_contact_laws laws = fresh_contact_laws();
    perp_contact_dynamics dynamics = fresh_contact_dynamics();
    perp_contact_sensitivity_info info = fresh_contact_sensitivity_info();
    perp_contact_sensitivity *s = NULL;
    perp_matrix M_view, H_view;
    double x;
    (void)state;
    M_view = matrix_rows(&M, 1, 1);
    H_view = matrix_rows(H, 2, 1);
    laws.contacts = 2;
    laws.dim = 1;
    dynamics.n = 1;
    dynamics.M = &M_view;
    dynamics.H = &H_view;
    assert_int_equal(perp_contact_sensitivity_create(context, &s, &info, NULL,
                                                     DYNAMICS(&laws, &dynamics, &f, w), r),
                     PERP_OK);
    assert_int_equal(info.verdict, PERP_VERDICT_SINGULAR);
    assert_int_equal(perp_contact_sensitivity_adjoint(s, &x, NULL, NULL, NULL, &f, NULL),
                     PERP_ERROR_ARGUMENT);
    perp_contact_sensitivity_destroy(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_differences),        cmocka_unit_test(test_slip),
        cmocka_unit_test(test_slip_along_an_axis), cmocka_unit_test(test_stick),
        cmocka_unit_test(test_verdicts),           cmocka_unit_test(test_redundant),
        cmocka_unit_test(test_far_impulses),
    };
    return cmocka_run_group_tests(tests, make, destroy);
}
