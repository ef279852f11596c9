/* Contacts that roll and spin, by every method: problems made from a solution with all modes, and
 * the law of every part of the answer beside the problem's numbers, which are of size 1. */
#include <math.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

#include "gen.h"

#include "context.h"

enum { BODIES = 4, N = 6 * BODIES, MOST = 5, ROWS = 6 * MOST, TRIALS = 40 };

typedef struct scene {
    int32_t contacts, rows, dim;
    double mu[MOST], rolling[MOST], spinning[MOST], compliance[ROWS];
    double M[N * N], H[ROWS * N], f[N], w[ROWS], W[ROWS * ROWS], q[ROWS];
} scene;

typedef struct part {
    int32_t row, size;
    double coefficient;
} part;

/* The parts of contact k whose rows begin at `row`; returns the row behind them. */
static int32_t parts_of(const scene *s, int32_t k, int32_t row, part parts[3], int32_t *count)
{
    const double coefficients[3] = {s->mu[k], s->rolling[k], s->spinning[k]};
    const int32_t sizes[3] = {s->dim - 1, s->dim - 1, 1};

    row++;
    *count = 0;
    for (int32_t p = 0; p < 3; p++) {
        if (p > 0 && coefficients[p] == 0.0)
            continue;
        parts[*count].row = row;
        parts[*count].size = sizes[p];
        parts[(*count)++].coefficient = coefficients[p];
        row += sizes[p];
    }
    return row;
}

/* r and u of a contact that opens, or presses and holds or slides part by part. */
static void plant(const part *parts, int32_t count, int32_t row, gen_random *random, double *r,
                  double *u)
{
    const int32_t opens = gen_integer(random, 4) == 0;

    r[row] = opens ? 0.0 : gen_uniform(random, 0.2, 2.0);
    u[row] = opens ? gen_uniform(random, 0.2, 2.0) : 0.0;
    for (int32_t p = 0; p < count; p++) {
        const int32_t slides = gen_integer(random, 2);
        const double radius = parts[p].coefficient * r[row];
        const double share = slides ? 1.0 : gen_uniform(random, 0.0, 0.9);
        const double speed = slides || opens ? gen_uniform(random, 0.1, 1.0) : 0.0;
        const double angle = gen_uniform(random, 0.0, 6.28);

        for (int32_t i = 0; i < parts[p].size; i++) {
            const double e = parts[p].size == 1 ? 1.0 : i == 0 ? cos(angle) : sin(angle);

            r[parts[p].row + i] = share * radius * e;
            u[parts[p].row + i] = -speed * e;
        }
    }
}

static void fill_motion(scene *s, gen_random *random)
{
    memset(s->M, 0, sizeof s->M);
    memset(s->H, 0, sizeof s->H);
    for (int32_t b = 0; b < BODIES; b++)
        for (int32_t i = 0; i < 6; i++)
            s->M[(6 * b + i) * (N + 1)] = gen_uniform(random, 0.5, 2.0);
    for (int32_t i = 0; i < s->rows; i++)
        for (int32_t j = 0; j < N; j++) /* two bodies a contact */
            if ((j / 6 + i / 6) % BODIES < 2)
                s->H[i * N + j] = gen_uniform(random, -1.0, 1.0);
}

static void fill(scene *s, gen_random *random, int32_t trial)
{
    double r[ROWS], u[ROWS], v[N];
    int32_t row = 0;

    memset(s, 0, sizeof *s);
    s->contacts = 1 + gen_integer(random, MOST);
    s->dim = trial % 4 == 3 ? 2 : 3;
    for (int32_t k = 0; k < s->contacts; k++) {
        part parts[3];
        int32_t count;

        s->mu[k] = gen_integer(random, 5) == 0 ? 0.0 : gen_uniform(random, 0.1, 1.5);
        s->rolling[k] = gen_integer(random, 3) == 0 ? 0.0 : gen_uniform(random, 0.01, 0.3);
        s->spinning[k] =
            s->dim == 2 || gen_integer(random, 3) == 0 ? 0.0 : gen_uniform(random, 0.01, 0.3);
        s->rows = parts_of(s, k, row, parts, &count);
        plant(parts, count, row, random, r, u);
        row = s->rows;
    }
    fill_motion(s, random);
    for (int32_t j = 0; j < N; j++) {
        v[j] = gen_uniform(random, -1.0, 1.0);
        s->f[j] = s->M[j * (N + 1)] * v[j];
        for (int32_t i = 0; i < s->rows; i++)
            s->f[j] -= s->H[i * N + j] * r[i];
    }
    for (int32_t i = 0; i < s->rows; i++) {
        s->compliance[i] = trial % 3 == 2 ? gen_uniform(random, 0.0, 0.1) : 0.0;
        s->w[i] = u[i] - s->compliance[i] * r[i];
        for (int32_t j = 0; j < N; j++)
            s->w[i] -= s->H[i * N + j] * v[j];
    }
}

/* W and q of the same problem, for the other entrance. */
static void reduce(scene *s)
{
    for (int32_t i = 0; i < s->rows; i++) {
        s->q[i] = s->w[i];
        for (int32_t j = 0; j < N; j++)
            s->q[i] += s->H[i * N + j] * s->f[j] / s->M[j * (N + 1)];
        for (int32_t c = 0; c < s->rows; c++) {
            s->W[i * s->rows + c] = i == c ? s->compliance[i] : 0.0;
            for (int32_t j = 0; j < N; j++)
                s->W[i * s->rows + c] += s->H[i * N + j] * s->H[c * N + j] / s->M[j * (N + 1)];
        }
    }
}

static void near_zero(double x, double tol)
{
    assert_true(fabs(x) <= tol);
}

/* u is computed here, from r alone. tol: a hundred times that of the solver, whose residual is over
 * |q| and the roots of traces: these are 1 to 10 here. */
static void check_law(const scene *s, const double *r, double tol)
{
    int32_t row = 0;

    for (int32_t k = 0; k < s->contacts; k++) {
        part parts[3];
        int32_t count;
        const int32_t normal = row;
        double u[ROWS];

        row = parts_of(s, k, row, parts, &count);
        for (int32_t i = normal; i < row; i++) {
            u[i] = s->q[i];
            for (int32_t c = 0; c < s->rows; c++)
                u[i] += s->W[i * s->rows + c] * r[c];
        }
        near_zero(fmin(r[normal], u[normal]), tol);
        for (int32_t p = 0; p < count; p++) {
            const double *x = r + parts[p].row, *y = u + parts[p].row;
            const double speed = parts[p].size == 1 ? fabs(y[0]) : hypot(y[0], y[1]);
            const double length = parts[p].size == 1 ? fabs(x[0]) : hypot(x[0], x[1]);

            assert_true(length <= parts[p].coefficient * r[normal] + tol);
            for (int32_t i = 0; i < parts[p].size; i++)
                near_zero(speed * x[i] + parts[p].coefficient * r[normal] * y[i], tol);
        }
    }
}

static void solve(const scene *s, int32_t method, int32_t by_rows, double tol, double *r)
{
    perp_contact_settings settings = fresh_contact_settings();
    perp_contact_result result = fresh_contact_result();
    perp_contact_dynamics dynamics = fresh_contact_dynamics();
    perp_contact_laws laws = fresh_contact_laws();
    perp_matrix M, H, W;
    double v[N];
    perp_status status;

    M = matrix_rows(s->M, N, N);
    H = matrix_rows(s->H, s->rows, N);
    W = matrix_rows(s->W, s->rows, s->rows);
    laws.contacts = s->contacts;
    laws.dim = s->dim;
    laws.mu = s->mu;
    laws.rolling = s->rolling;
    laws.spinning = s->spinning;
    laws.compliance = by_rows ? NULL : s->compliance;
    settings.method = method;
    settings.tol = tol;
    dynamics.n = N;
    dynamics.M = &M;
    dynamics.H = &H;
    if (by_rows)
        status = perp_contact_solve(context, ANSWER(NULL, r), &result, &settings,
                                    DELASSUS(&laws, &W, s->q), NULL);
    else
        status = perp_contact_solve(context, ANSWER(v, r), &result, &settings,
                                    DYNAMICS(&laws, &dynamics, s->f, s->w), NULL);
    assert_int_equal(status, PERP_OK);
    assert_true(result.outcome == PERP_OUTCOME_SOLVED ||
                result.outcome == PERP_OUTCOME_ROUNDING_LIMIT);
}

static void test_planted(void **state)
{
    static const struct {
        int32_t method;
        double tol;
    } ways[] = {{PERP_CONTACT_METHOD_AUTO, 1e-9},
                {PERP_CONTACT_METHOD_PROXIMAL, 1e-9},
                {PERP_CONTACT_METHOD_ADMM, 1e-5}};
    static scene s;
    gen_random random;

    (void)state;
    gen_seed(&random, 7);
    for (int32_t trial = 0; trial < TRIALS; trial++) {
        fill(&s, &random, trial);
        reduce(&s);
        for (size_t k = 0; k < sizeof ways / sizeof *ways; k++)
            for (int32_t by_rows = 0; by_rows < 2; by_rows++) {
                double r[ROWS];

                solve(&s, ways[k].method, by_rows, ways[k].tol, r);
                check_law(&s, r, 100.0 * ways[k].tol);
            }
    }
}

/* W = 1, in the plane: it slides and rolls on with u = 1 less what r takes away, 0.5 and 0.1. */
static void test_closed_form(void **state)
{
    static const int32_t methods[] = {PERP_CONTACT_METHOD_AUTO, PERP_CONTACT_METHOD_SWEEP,
                                      PERP_CONTACT_METHOD_LEMKE, PERP_CONTACT_METHOD_PROXIMAL,
                                      PERP_CONTACT_METHOD_ADMM};
    static scene s;

    (void)state;
    s.contacts = 1;
    s.rows = 3;
    s.dim = 2;
    s.mu[0] = 0.5;
    s.rolling[0] = 0.1;
    for (int32_t i = 0; i < 3; i++) {
        s.W[4 * i] = 1.0;
        s.q[i] = i == 0 ? -1.0 : 1.0;
    }
    for (size_t k = 0; k < sizeof methods / sizeof *methods; k++) {
        double r[3];

        solve(&s, methods[k], 1, 1e-8, r);
        near_zero(r[0] - 1.0, 1e-7);
        near_zero(r[1] + 0.5, 1e-7);
        near_zero(r[2] + 0.1, 1e-7);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_closed_form, make, destroy),
        cmocka_unit_test_setup_teardown(test_planted, make, destroy),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
