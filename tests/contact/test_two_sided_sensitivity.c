/* Derivatives of contacts that hold both ways: the drawer's in closed form, central differences of
 * solves, the adjoint against the forward products, kinks and what is not determined. */
#include <math.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

#include "two_sided.h"

static perp_contact_sensitivity *derive(both_problem *p, const double *r,
                                        perp_contact_sensitivity_info *info)
{
    perp_contact_sensitivity *s = NULL;
    both_answer a;
    static both_rig g;
    both_set(p, 0, 0, &g, &a);
    g.settings.tol = 1e-9;
    assert_int_equal(perp_struct_init(info, sizeof *info), PERP_OK);
    assert_int_equal(perp_contact_sensitivity_create(
                         both_context, &s, info, &g.settings,
                         DYNAMICS(&g.laws, &g.dynamics, p->f, p->w, p->w + p->rows + p->bounded),
                         r),
                     PERP_OK);
    return s;
}

/* ---- random mechanisms ---------------------------------------------------------------------- */

static void draw_direction(const both_problem *p, both_problem *d)
{
    memset(d, 0, sizeof *d);
    for (int i = 0; i < p->n; i++) {
        d->f[i] = both_draw();
        for (int j = 0; j <= i; j++)
            d->M[i * MOST + j] = d->M[j * MOST + i] = 0.2 * both_draw();
    }
    for (int i = 0; i < p->size; i++) {
        d->w[i] = both_draw();
        for (int j = 0; j < p->n; j++)
            d->H[i * MOST + j] = both_draw();
    }
    for (int k = 0; k < p->contacts; k++)
        d->mu[k] = both_draw();
}

static void forward(perp_contact_sensitivity *s, const both_problem *p, const both_problem *d,
                    double *dv, double *dr)
{
    const int32_t rows = p->rows + p->bounded;
    both_problem change = *d;
    both_answer unused;
    both_rig g;
    change.n = p->n;
    change.rows = p->rows;
    change.bounded = p->bounded;
    change.bilateral = p->bilateral;
    both_set(&change, 0, 0, &g, &unused);
    assert_int_equal(
        perp_contact_sensitivity_forward(
            s, dv, dr,
            DIRECTION(d->f, d->w, d->w + rows, d->mu, &g.M, &g.H, p->bilateral ? &g.G : NULL)),
        PERP_OK);
}

static void solve_beside(const both_problem *p, const both_problem *d, double h, const double *r0,
                         both_answer *a)
{
    both_problem q = *p;
    for (int i = 0; i < MOST * MOST; i++) {
        q.M[i] += h * d->M[i];
        q.H[i] += h * d->H[i];
    }
    for (int i = 0; i < MOST; i++) {
        q.f[i] += h * d->f[i];
        q.w[i] += h * d->w[i];
    }
    for (int k = 0; k < p->contacts; k++)
        q.mu[k] += h * d->mu[k];
    both_by_dynamics(&q, 0, 0, r0, a);
    both_require_solved(a, 0);
}

/* h = 1e-4: its square is left of the third derivatives, and tol 1e-10 / h of the solves, in
 * proportion where derivatives are large. From r, for other answers may be near. */
static void compare(const both_problem *p, const both_problem *d, const double *r, const double *dv,
                    const double *dr)
{
    const double h = 1e-4;
    both_answer x, y;
    double size = 1.0;
    solve_beside(p, d, h, r, &x);
    solve_beside(p, d, -h, r, &y);
    for (int i = 0; i < p->size; i++)
        size = fmax(size, fabs(dr[i]));
    for (int j = 0; j < p->n; j++)
        assert_true(fabs((x.v[j] - y.v[j]) / (2.0 * h) - dv[j]) <= 2e-6 * size * size);
    for (int i = 0; i < p->size; i++)
        assert_true(fabs((x.r[i] - y.r[i]) / (2.0 * h) - dr[i]) <= 2e-6 * size * size);
}

/* g'dv + h'dr = (gradients)'(changes), for every kind of data. */
static void check_adjoint(perp_contact_sensitivity *s, const both_problem *p, const both_problem *d,
                          const both_answer *a, const double *dv, const double *dr)
{
    double gv[MOST], gr[MOST], x[MOST], y[MOST], mu[UNITS], left = 0.0, right = 0.0, size = 1.0;
    for (int i = 0; i < MOST; i++) {
        gv[i] = both_draw();
        gr[i] = both_draw();
    }
    assert_int_equal(
        perp_contact_sensitivity_adjoint(s, x, y, y + p->rows + p->bounded, mu, gv, gr), PERP_OK);
    for (int j = 0; j < p->n; j++) {
        left += gv[j] * dv[j];
        right += x[j] * d->f[j];
        for (int i = 0; i < p->n; i++)
            right -= x[i] * a->v[j] * d->M[i * MOST + j];
    }
    for (int i = 0; i < p->size; i++) {
        left += gr[i] * dr[i];
        right += y[i] * d->w[i];
        for (int j = 0; j < p->n; j++)
            right += (a->r[i] * x[j] + y[i] * a->v[j]) * d->H[i * MOST + j];
        size = fmax(size, fabs(dr[i]));
    }
    for (int k = 0; k < p->contacts; k++)
        right += mu[k] * d->mu[k];
    assert_true(fabs(left - right) <= 1e-11 * size * size); /* rounding alone */
}

static void test_differences(void **state)
{
    static const int32_t kinds[][2] = {{1, 2}, {1, 3}, {2, 3}, {2, 4}, {3, 4}, {3, 5}, {0, 3}};
    int regular = 0, slips[4] = {0}, sticks[4] = {0};
    (void)state;
    for (uint64_t k = 1; k <= 60; k++) {
        perp_contact_sensitivity_info info;
        perp_contact_sensitivity *s;
        double dv[MOST], dr[MOST];
        both_problem p, d;
        both_answer a;
        memset(&p, 0, sizeof p);
        both_seed = 31 * k;
        for (int c = 0; c < 3; c++) {
            const int32_t *kind = kinds[(int)(3.5 * (both_draw() + 1.0))];
            both_add(&p, kind[0], kind[1], 0.5 + 0.4 * both_draw());
        }
        both_fill(&p, 1, k % 3 == 0, k % 2 == 0);
        both_by_dynamics(&p, 0, 0, NULL, &a);
        both_require_solved(&a, k);
        s = derive(&p, a.r, &info);
        /* modes that 1e-4 may change, and kinks beside which curvature is large, are left out */
        if (info.verdict == PERP_VERDICT_REGULAR && info.margin > 2e-2 && info.condition < 1e3) {
            draw_direction(&p, &d);
            forward(s, &p, &d, dv, dr);
            compare(&p, &d, a.r, dv, dr);
            check_adjoint(s, &p, &d, &a, dv, dr);
            regular++;
            for (int c = 0; c < p.contacts; c++)
                (a.modes[c] == PERP_CONTACT_SLIP ? slips : sticks)[p.two_sided[c]]++;
        }
        perp_contact_sensitivity_destroy(s);
    }
    assert_true(regular >= 20);
    for (int m = 1; m < 4; m++)
        assert_true(slips[m] > 0 && sticks[m] > 0);
}

/* ---- Dupont's drawer ------------------------------------------------------------------------ */

static const double mass = 2.0, inertia = 0.5, pull = 3.0, offset = 0.5, guide = 0.25;

/* As in test_two_sided.c, from a speed that keeps it going: m v = m V + F -+ 2 mu |N|, N = m (v -
 * V) h / L, so that v = V + F / (m (1 + side 2 mu h / L)). */
static double build_drawer(both_problem *p, double mu, double speed, double side, double *r)
{
    const double change = pull / (1.0 + side * 2.0 * mu * offset / guide);
    const double N = change * offset / guide;

    both_drawer(p, mass, inertia, offset, guide, mu);
    for (int k = 0; k < 2; k++) {
        r[2 * k] = k ? N : -N;
        r[2 * k + 1] = -mu * fabs(N);
    }
    p->f[0] = mass * speed + pull;
    p->f[2] = pull * offset;
    return change / mass;
}

/* dv/dmu = -side (v - V) 2 h / L / (1 + side 2 mu h / L), dv/dF along the same line as dv/df; of
 * both answers. */
static void test_drawer(void **state)
{
    const double mu = 0.4, arm = 2.0 * offset / guide, dmu[2] = {1.0, 1.0};
    const double df[3] = {1.0, 0.0, offset};
    (void)state;
    for (double side = -1.0; side <= 1.0; side += 2.0) {
        perp_contact_sensitivity_info info;
        double r[4], dv[3], dr[4], of_mu[2];
        both_problem p;
        const double gain = build_drawer(&p, mu, 20.0, side, r), factor = 1.0 + side * mu * arm;
        perp_contact_sensitivity *s = derive(&p, r, &info);
        assert_int_equal(info.verdict, PERP_VERDICT_REGULAR);
        assert_int_equal(info.active, 4);
        assert_int_equal(
            perp_contact_sensitivity_forward(s, dv, dr, DIRECTION(NULL, NULL, NULL, dmu)), PERP_OK);
        /* sums of a few terms of size 10: rounding */
        assert_true(fabs(dv[0] + side * gain * arm / factor) <= 1e-12);
        assert_true(fabs(dv[1]) <= 1e-13 && fabs(dv[2]) <= 1e-13);
        assert_int_equal(perp_contact_sensitivity_adjoint(s, NULL, NULL, NULL, of_mu, df, NULL),
                         PERP_OK);
        assert_true(fabs(of_mu[0] - of_mu[1]) <= 1e-12);
        assert_true(fabs(of_mu[0] + of_mu[1] + side * gain * arm / factor) <= 1e-12);
        assert_int_equal(perp_contact_sensitivity_forward(s, dv, dr, DIRECTION(df)), PERP_OK);
        assert_true(fabs(dv[0] - gain / pull) <= 1e-13);
        perp_contact_sensitivity_destroy(s);
    }
}

/* Where it carries nothing |r_N| has a kink, and without friction there is none; where 2 mu h / L
 * is 1 and the load is 0, friction turns the drawer by just what the guides hold: any N < 0 will
 * do. */
static void test_verdicts(void **state)
{
    perp_contact_sensitivity_info info;
    both_problem p;
    double r[4], dv[3];
    perp_contact_sensitivity *s;
    (void)state;
    build_drawer(&p, 0.4, 20.0, 1.0, r);
    p.f[0] = 20.0 * mass;
    p.f[2] = 0.0;
    memset(r, 0, sizeof r);
    s = derive(&p, r, &info);
    assert_int_equal(info.verdict, PERP_VERDICT_DEGENERATE);
    assert_int_equal(info.index, 0);
    assert_true(info.margin == 0.0);
    assert_int_equal(perp_contact_sensitivity_forward(s, dv, NULL, DIRECTION(p.f)), PERP_OK);
    perp_contact_sensitivity_destroy(s);
    p.mu[0] = p.mu[1] = 0.0;
    s = derive(&p, r, &info);
    assert_int_equal(info.verdict, PERP_VERDICT_REGULAR);
    perp_contact_sensitivity_destroy(s);
    p.mu[0] = p.mu[1] = 0.25; /* the arm is 1 to the last bit */
    r[0] = 1.0;
    r[2] = -1.0;
    r[1] = r[3] = -0.25;
    s = derive(&p, r, &info);
    assert_int_equal(info.verdict, PERP_VERDICT_SINGULAR);
    perp_contact_sensitivity_destroy(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_differences),
        cmocka_unit_test(test_drawer),
        cmocka_unit_test(test_verdicts),
    };
    return cmocka_run_group_tests(tests, both_make, both_destroy);
}
