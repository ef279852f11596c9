/* Islands that sweeps have not solved, looked at without a set-up: the same word, residual, modes,
 * impulses and motion as the solver's own look at that point; and what is an answer is let pass. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include <perp/perp.h>

#include "contact/contact.h"
#include "gen.h"
#include "rigid_scene.h"

enum { SCENES = 300 };

/* Sums of some hundred terms, each beside the largest. */
#define ROUNDING 1e-12

typedef struct fixture {
    perp_context *context;
    perp__rigid_solver *solver;
    rigid_scene s;
} fixture;

/* A pyramid in some disorder, with a floor that moves or not, and contacts without friction. */
static void fill(rigid_scene *s, gen_random *rng)
{
    static const double half[3] = {20.0, 20.0, 0.5};
    const double speed = exp(gen_uniform(rng, -6.0, 3.0));
    const double mass = exp(gen_uniform(rng, 0.0, 3.0));
    int32_t carrier;

    rigid_pyramid(s, 2 + gen_integer(rng, 4), gen_uniform(rng, 0.0, 1.0));
    for (int32_t i = 0; i < s->width * s->bodies; i++)
        s->free[i] += gen_uniform(rng, -speed, speed);
    for (int32_t b = 0; b < s->bodies; b += 3)
        for (int32_t i = 0; i < s->width * s->width; i++)
            s->factors[b * s->width * s->width + i] /= sqrt(mass);
    for (int32_t k = 0; k < s->contacts; k++) {
        if (gen_integer(rng, 6) == 0)
            s->rows[k].dim = 1;
        s->rows[k].bias[0] = gen_integer(rng, 2) * gen_uniform(rng, 0.0, speed);
    }
    if (gen_integer(rng, 3) > 0)
        return;
    carrier = rigid_box(s, 0.0, 0.0, -0.5, half, 0.0, NULL);
    for (int32_t i = 0; i < s->width; i++)
        s->free[carrier * s->width + i] = gen_uniform(rng, -speed, speed);
    for (int32_t k = 0; k < s->contacts; k++) {
        perp__rigid_rows *g = &s->rows[k];

        if (g->body[0] != RIGID_GROUND)
            continue;
        g->body[0] = carrier;
        for (int32_t i = 0; i < 3; i++)
            for (int32_t j = 0; j < 6; j++)
                g->rows[0][i][j] = -g->rows[1][i][j]; /* of a point at one place for both */
    }
}

/* Impulses that sweeps come to, or some such, in s->warm. */
static void start(fixture *f, gen_random *rng, perp__rigid_problem *p)
{
    perp__rigid_answer a = rigid_answer(&f->s);
    const int32_t wild = gen_integer(rng, 4) == 0;

    p->max_iterations = 1 + gen_integer(rng, 40);
    p->method = PERP_CONTACT_METHOD_SWEEP;
    assert_int_equal(perp__rigid_solve(f->solver, &a, p), PERP_OK);
    for (int32_t i = 0; i < 3 * f->s.contacts; i++)
        f->s.warm[i] = f->s.impulse[i] + (wild ? 0.1 * gen_normal(rng) : 0.0);
    p->warm = f->s.warm;
    p->max_iterations = -1;
    p->method = PERP_CONTACT_METHOD_AUTO;
}

static double largest(const double *x, int32_t count)
{
    double most = 0.0;

    for (int32_t i = 0; i < count; i++)
        most = fmax(most, fabs(x[i]));
    return most;
}

static void check_near(const double *x, const double *y, int32_t count, double scale)
{
    for (int32_t i = 0; i < count; i++)
        assert_true(fabs(x[i] - y[i]) <= ROUNDING * scale);
}

/* What the solver says of the same point. */
static void compare(fixture *f, const perp__rigid_answer *found, const perp__rigid_problem *p)
{
    const int32_t rows = 3 * f->s.contacts, n = f->s.width * f->s.bodies;
    rigid_scene other = f->s;
    perp__rigid_answer a;
    double speed;

    other.impulse = gen_allocate((size_t)rows, sizeof(double));
    other.velocity = gen_allocate((size_t)rows, sizeof(double));
    other.v = gen_allocate((size_t)n, sizeof(double));
    other.modes = gen_allocate((size_t)f->s.contacts, sizeof(int32_t));
    a = rigid_answer(&other);
    assert_int_equal(perp__rigid_solve(f->solver, &a, p), PERP_OK);
    assert_true(a.outcome == found->outcome && a.method == found->method && !found->held);
    assert_true(fabs(a.tested - found->tested) <= ROUNDING * a.tested);
    speed = largest(a.v, n) + largest(p->free, n);
    check_near(found->impulse, a.impulse, rows, largest(a.impulse, rows));
    check_near(found->velocity, a.velocity, rows, 20.0 * speed); /* arms of 20 below, 1 above */
    check_near(found->v, a.v, n, speed);
    for (int32_t k = 0; k < f->s.contacts; k++) {
        assert_int_equal(found->modes[k], a.modes[k]);
        assert_true((found->impulse[3 * k] == 0.0) == (a.impulse[3 * k] == 0.0));
    }
    free(other.impulse);
    free(other.velocity);
    free(other.v);
    free(other.modes);
}

static void test_the_same_word(void **state)
{
    static const double tols[] = {1e-2, 1e-3, 1e-6};
    gen_random rng;
    int32_t refuted = 0, passed = 0;

    (void)state;
    gen_seed(&rng, 17);
    for (int32_t scene = 0; scene < SCENES; scene++) {
        fixture f;
        perp__rigid_problem p;
        perp__rigid_answer a;

        rigid_open(&f.s, scene % 2);
        assert_int_equal(perp_context_create(&f.context, NULL), PERP_OK);
        assert_int_equal(perp__rigid_create(f.context, &f.solver), PERP_OK);
        fill(&f.s, &rng);
        p = rigid_problem(&f.s);
        p.tol = tols[scene / 2 % 3];
        start(&f, &rng, &p);
        a = rigid_answer(&f.s);
        if (perp__rigid_refute(&a, &p, p.tol)) {
            compare(&f, &a, &p);
            refuted++;
        } else {
            assert_int_equal(perp__rigid_solve(f.solver, &a, &p), PERP_OK);
            assert_true(a.tested <= p.tol * (1.0 + ROUNDING));
            passed++;
        }
        perp__rigid_destroy(f.solver);
        perp_context_destroy(f.context);
        rigid_close(&f.s);
    }
    assert_true(refuted > SCENES / 3 && passed > SCENES / 10); /* both are met */
}

/* Nothing is said of what another look is for: a tolerance below plain doubles, polyhedra, joints,
 * friction next to infinite, numbers beyond the range, nothing that drives but rounding. */
static void test_says_nothing(void **state)
{
    rigid_scene s;
    perp__rigid_problem p, other;
    perp__rigid_answer a;

    (void)state;
    rigid_open(&s, 0);
    rigid_pyramid(&s, 3, 0.5);
    for (int32_t i = 0; i < 3 * s.contacts; i++)
        s.warm[i] = 0.0;
    p = rigid_problem(&s);
    p.tol = 1e-3;
    p.warm = s.warm;
    a = rigid_answer(&s);
    assert_true(perp__rigid_refute(&a, &p, 1e-3)); /* nothing holds it up */
    assert_false(perp__rigid_refute(&a, &p, INFINITY));
    other = p;
    other.tol = 1e-8;
    assert_false(perp__rigid_refute(&a, &other, 1e-3));
    other = p;
    other.cone = 8;
    assert_false(perp__rigid_refute(&a, &other, 1e-3));
    other = p;
    other.contacts--;
    other.joints++;
    assert_false(perp__rigid_refute(&a, &other, 1e-3));
    s.rows[5].mu = 1e4;
    assert_false(perp__rigid_refute(&a, &p, 1e-3));
    s.rows[5].mu = 0.5;
    s.warm[4] = NAN;
    s.warm[3] = 1.0;
    assert_false(perp__rigid_refute(&a, &p, 1e-3));
    s.warm[4] = s.warm[3] = 0.0;
    other = p; /* all but the contacts with the ground: everything falls alike, at 1e9 */
    other.rows += 12;
    other.contacts -= 12;
    for (int32_t b = 0; b < s.bodies; b++)
        s.free[6 * b] = 1e9;
    s.free[2] += 1e5; /* much more than rounding: from below against what lies on it */
    assert_true(perp__rigid_refute(&a, &other, 1e-3));
    s.free[2] += 1e-3 - 1e5;
    assert_false(perp__rigid_refute(&a, &other, 1e-3));
    memset(s.free, 0, (size_t)(6 * s.bodies) * sizeof *s.free);
    assert_false(perp__rigid_refute(&a, &p, 1e-3));
    rigid_close(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_same_word),
        cmocka_unit_test(test_says_nothing),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
