/* Problems with contacts that hold both ways, and calls with them. */
#include "two_sided.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "suite.h"

perp_context *both_context;
uint64_t both_seed;

int both_make(void **state)
{
    (void)state;
    return perp_context_create(&both_context, NULL);
}

int both_destroy(void **state)
{
    (void)state;
    perp_context_destroy(both_context);
    return 0;
}

double both_draw(void)
{
    both_seed = both_seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(both_seed >> 11) * 0x1p-52 - 1.0;
}

int both_eliminate(int n, double *A, double *x)
{
    for (int j = 0; j < n; j++) {
        int p = j;
        for (int i = j; i < n; i++)
            p = fabs(A[i * MOST + j]) > fabs(A[p * MOST + j]) ? i : p;
        if (!(fabs(A[p * MOST + j]) > 1e-9))
            return 0;
        for (int k = 0; k < n; k++) {
            const double t = A[j * MOST + k];
            A[j * MOST + k] = A[p * MOST + k];
            A[p * MOST + k] = t;
        }
        const double t = x[j];
        x[j] = x[p];
        x[p] = t;
        for (int i = j + 1; i < n; i++) {
            const double l = A[i * MOST + j] / A[j * MOST + j];
            for (int k = j; k < n; k++)
                A[i * MOST + k] -= l * A[j * MOST + k];
            x[i] -= l * x[j];
        }
    }
    for (int j = n; j-- > 0;) {
        for (int k = j + 1; k < n; k++)
            x[j] -= A[j * MOST + k] * x[k];
        x[j] /= A[j * MOST + j];
    }
    return 1;
}

void both_reduce(int n, int size, const double *M, const double *H, const double *f,
                 const double *w, double *W, double *q)
{
    double A[MOST * MOST], x[MOST];
    for (int j = 0; j <= size; j++) {
        memcpy(A, M, sizeof A);
        for (int i = 0; i < n; i++)
            x[i] = j < size ? H[j * MOST + i] : f[i];
        assert_true(both_eliminate(n, A, x));
        for (int i = 0; i < size; i++) {
            double sum = j < size ? 0.0 : w[i];
            for (int k = 0; k < n; k++)
                sum += H[i * MOST + k] * x[k];
            if (j < size)
                W[i * MOST + j] = sum;
            else
                q[i] = sum;
        }
    }
}

void both_form(both_problem *p)
{
    both_reduce(p->n, p->size, p->M, p->H, p->f, p->w, p->W, p->q);
}

void both_add(both_problem *p, int32_t two_sided, int32_t dim, double mu)
{
    p->two_sided[p->contacts] = two_sided;
    p->dims[p->contacts] = dim;
    p->mu[p->contacts++] = mu;
    p->rows += dim;
}

void both_fill_data(both_problem *p, double least, int blocks)
{
    for (int i = 0; i < p->n; i++) {
        for (int j = 0; j < p->n; j++)
            for (int k = 0; k < p->n && (!blocks || i / 3 == j / 3); k++)
                p->M[i * MOST + j] += cos(1.7 * i * k + k) * cos(1.7 * j * k + k) / p->n;
        p->M[i * MOST + i] += least;
        p->f[i] = both_draw();
    }
    for (int i = 0; i < p->size; i++) {
        p->w[i] = both_draw();
        for (int j = 0; j < p->n; j++)
            p->H[i * MOST + j] = both_draw();
    }
    both_form(p);
}

void both_fill(both_problem *p, int32_t bounded, int32_t bilateral, int blocks)
{
    p->bounded = bounded;
    p->bilateral = bilateral;
    p->size = p->rows + bounded + bilateral;
    p->n = 18;
    assert_true(p->size <= p->n);
    for (int i = 0; i < bounded; i++) {
        p->lower[i] = both_draw();
        p->upper[i] = p->lower[i] + both_draw() + 1.0;
    }
    both_fill_data(p, 0.3, blocks);
}

void both_drawer(both_problem *p, double mass, double inertia, double offset, double guide,
                 double mu)
{
    memset(p, 0, sizeof *p);
    both_add(p, 1, 2, mu);
    both_add(p, 1, 2, mu);
    p->size = p->rows;
    p->n = 3;
    p->M[0] = p->M[MOST + 1] = mass;
    p->M[2 * MOST + 2] = inertia;
    for (int k = 0; k < 2; k++) {
        double *normal = p->H + 2 * k * MOST, *tangent = normal + MOST;

        normal[1] = 1.0;
        normal[2] = k ? -guide / 2 : guide / 2;
        tangent[0] = 1.0;
        tangent[2] = offset; /* the line is below the mass centre */
    }
}

void both_skew(both_problem *p, double by)
{
    for (int k = 0, at = 0; k < p->contacts; at += p->dims[k++])
        for (int j = 0; j < p->n && p->two_sided[k] > 0; j++)
            p->H[(at + 1) * MOST + j] += by * p->H[at * MOST + j];
    both_form(p);
}

static void prepare(const both_problem *p, int32_t method, perp_contact_laws *laws,
                    perp_contact_settings *settings, both_answer *a)
{
    memset(a, 0, sizeof *a);
    assert_int_equal(perp_struct_init(&a->result, sizeof a->result), PERP_OK);
    assert_int_equal(perp_contact_laws_init(laws, sizeof *laws), PERP_OK);
    laws->contacts = p->contacts;
    laws->dims = p->dims;
    laws->two_sided = p->two_sided;
    laws->mu = p->mu;
    laws->bounded = p->bounded;
    laws->lower = p->lower;
    laws->upper = p->upper;
    assert_int_equal(perp_contact_settings_init(settings, sizeof *settings), PERP_OK);
    settings->method = method;
    settings->tol = 1e-10;
}

void both_by_delassus(const both_problem *p, int32_t method, const double *r0, both_answer *a)
{
    perp_contact_laws laws;
    perp_contact_settings settings;
    perp_matrix W;
    prepare(p, method, &laws, &settings, a);
    laws.bilateral = p->bilateral;
    assert_int_equal(perp_struct_init(&W, sizeof W), PERP_OK);
    assert_int_equal(perp_matrix_dense(&W, PERP_STORAGE_ROW_MAJOR, p->size, p->size, p->W, MOST),
                     PERP_OK);
    assert_int_equal(perp_contact_solve(both_context, ANSWER(NULL, a->r, a->u, a->modes, a->ray),
                                        &a->result, &settings, DELASSUS(&laws, &W, p->q), r0),
                     PERP_OK);
}

static int32_t solve_mass(double *x, int32_t columns, void *user)
{
    const both_problem *p = user;
    for (int32_t c = 0; c < columns; c++) {
        double A[MOST * MOST];
        memcpy(A, p->M, sizeof A);
        if (!both_eliminate(p->n, A, x + c * p->n))
            return 1;
    }
    return 0;
}

static void view(perp_matrix *A, int32_t rows, int32_t columns, const double *values)
{
    assert_int_equal(perp_struct_init(A, sizeof *A), PERP_OK);
    assert_int_equal(perp_matrix_dense(A, PERP_STORAGE_ROW_MAJOR, rows, columns, values, MOST),
                     PERP_OK);
}

void both_set(both_problem *p, int32_t method, int callback, both_rig *g, both_answer *a)
{
    const int32_t rows = p->rows + p->bounded;
    prepare(p, method, &g->laws, &g->settings, a);
    assert_int_equal(perp_struct_init(&g->dynamics, sizeof g->dynamics), PERP_OK);
    view(&g->M, p->n, p->n, p->M);
    view(&g->H, rows, p->n, p->H);
    view(&g->G, p->bilateral, p->n, p->H + rows * MOST);
    g->dynamics.n = p->n;
    g->dynamics.M = callback ? NULL : &g->M;
    g->dynamics.solve = callback ? solve_mass : NULL;
    g->dynamics.user = p;
    g->dynamics.H = &g->H;
    g->dynamics.G = p->bilateral > 0 ? &g->G : NULL;
}

perp_status both_call(both_problem *p, int32_t method, int callback, const double *r0,
                      both_answer *a)
{
    both_rig g;
    both_set(p, method, callback, &g, a);
    return perp_contact_solve(
        both_context, ANSWER(a->v, a->r, a->u, a->modes, a->ray), &a->result, &g.settings,
        DYNAMICS(&g.laws, &g.dynamics, p->f, p->w, p->w + p->rows + p->bounded), r0);
}

void both_by_dynamics(both_problem *p, int32_t method, int callback, const double *r0,
                      both_answer *a)
{
    assert_int_equal(both_call(p, method, callback, r0, a), PERP_OK);
}

int both_is_good(const both_answer *a)
{
    return a->result.outcome == PERP_OUTCOME_SOLVED ||
           a->result.outcome == PERP_OUTCOME_ROUNDING_LIMIT;
}

void both_require_solved(const both_answer *a, uint64_t which)
{
    if (!both_is_good(a))
        fail_msg("draw %llu: %s by %s, residual %g", (unsigned long long)which,
                 perp_outcome_text(a->result.outcome), perp_contact_method_text(a->result.method),
                 a->result.residual);
}

double both_velocity(const both_problem *p, const double *r, int row)
{
    double u = p->q[row];
    for (int j = 0; j < p->size; j++)
        u += p->W[row * MOST + j] * r[j];
    return u;
}

void both_require_laws(const both_problem *p, const both_answer *a)
{
    double most = 1.0;
    for (int i = 0; i < p->size; i++)
        most = fmax(most, fabs(a->r[i]));
    for (int i = 0; i < p->size; i++)
        assert_true(fabs(both_velocity(p, a->r, i) - a->u[i]) <= 1e-8 * most);
    for (int k = 0, at = 0; k < p->contacts; at += p->dims[k++]) {
        const double *r = a->r + at, *u = a->u + at;
        double load = 0.0, friction = 0.0, slip = 0.0, power = 0.0;
        for (int i = 0; i < p->two_sided[k]; i++) {
            load = hypot(load, r[i]);
            assert_true(u[i] == 0.0);
        }
        if (p->two_sided[k] == 0)
            continue;
        for (int i = p->two_sided[k]; i < p->dims[k]; i++) {
            friction = hypot(friction, r[i]);
            slip = hypot(slip, u[i]);
            power += r[i] * u[i];
        }
        assert_true(friction <= p->mu[k] * load * (1.0 + 1e-15));
        assert_true(fabs(power + p->mu[k] * load * slip) <= 1e-8 * (1.0 + load));
        assert_true(a->modes[k] == PERP_CONTACT_SLIP ||
                    (a->modes[k] == PERP_CONTACT_STICK && slip == 0.0));
    }
}
