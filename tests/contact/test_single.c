/* One body whose impulses are looked at without a solver: what passes there passes the solver's own
 * look, which is in doubled precision, with the same modes, the same zeros and the same motion. */
#include <math.h>
#include <stdio.h>

#include "suite.h"

#include <perp/perp.h>

#include "base/handle.h"
#include "contact/contact.h"
#include "gen.h"
#include "rigid_scene.h"

enum { SCENES = 400, MOST = 8, NUMBERS = 3 * MOST };

typedef struct copy {
    double impulse[NUMBERS], velocity[NUMBERS], v[6];
    int32_t modes[MOST], carrier;
} copy;

/* A box that slides, lies, tips or spins on the ground, at times in a corner. */
static void fill(rigid_scene *s, gen_random *rng)
{
    static const double walls[2][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}};
    const double half[3] = {gen_uniform(rng, 0.1, 1.0), gen_uniform(rng, 0.1, 1.0), 0.5};
    const double mu = gen_uniform(rng, 0.0, 1.0) < 0.2 ? 0.0 : gen_uniform(rng, 0.0, 1.0);
    const int32_t last = s->width - 1;
    double start[6] = {0.0}, point[3];

    if (gen_uniform(rng, 0.0, 1.0) < 0.7)
        start[0] = gen_uniform(rng, -3.0, 3.0);
    if (gen_uniform(rng, 0.0, 1.0) < 0.3)
        start[last] = gen_uniform(rng, -1.0, 1.0);
    rigid_box(s, 0.0, 0.0, 0.5, half, gen_uniform(rng, 0.5, 5.0), start);
    rigid_face(s, RIGID_GROUND, 0, -half[0], half[0], -half[1], half[1], 0.0, mu);
    if (s->width == 6 && gen_uniform(rng, 0.0, 1.0) < 0.3) {
        point[0] = -half[0];
        point[1] = half[1];
        point[2] = 0.5;
        rigid_touch(s, RIGID_GROUND, 0, point, walls[0], 3, mu);
    }
}

static void keep(const rigid_scene *s, copy *to)
{
    memset(to, 0, sizeof *to);
    memcpy(to->impulse, s->impulse, 3 * (size_t)s->contacts * sizeof(double));
    memcpy(to->velocity, s->velocity, 3 * (size_t)s->contacts * sizeof(double));
    memcpy(to->v, s->v, (size_t)s->width * sizeof(double));
    memcpy(to->modes, s->modes, (size_t)s->contacts * sizeof(int32_t));
    to->carrier = s->carrier[0];
}

static double distance(const double *a, const double *b, int32_t count)
{
    double largest = 0.0;

    for (int32_t i = 0; i < count; i++)
        largest = fmax(largest, fabs(a[i] - b[i]));
    return largest;
}

/* To the tolerance, of numbers of size 1 to 10. What nothing determines may come out as 0 in one
 * and as rounding in the other. */
static void check_near(double a, double b, int32_t is_determined)
{
    if (a == 0.0 || b == 0.0)
        assert_true(a == b || (!is_determined && fabs(a - b) <= 1e-14));
    assert_true(fabs(a - b) <= 1e-8);
}

/* Contacts with the ground determine all but what slides, and turns about the normal. */
static void check_same(const rigid_scene *s, const copy *one, const copy *other)
{
    double largest = 0.0;

    for (int32_t i = 0; i < s->width; i++)
        check_near(one->v[i], other->v[i], s->width == 3 ? i > 0 : i >= 2 && i <= 4);
    for (int32_t i = 0; i < 3 * s->contacts; i++)
        check_near(one->velocity[i], other->velocity[i],
                   i % 3 == 0 ||
                       (one->modes[i / 3] == PERP_CONTACT_STICK && s->rows[i / 3].mu > 0.0));
    for (int32_t i = 0; i < 3 * s->contacts; i++)
        largest = fmax(largest, fabs(one->impulse[i]));
    /* what was clipped into its cone once may be clipped again by rounding */
    assert_true(distance(one->impulse, other->impulse, 3 * s->contacts) <= 4e-16 * largest);
    for (int32_t k = 0; k < s->contacts; k++) {
        const double *r = one->impulse + 3 * k;

        const double most = s->rows[k].mu * r[0], rest = most - hypot(r[1], r[2]);

        /* without friction, at its edge, or where the impulse is itself rounding, rounding tells
         * stick from slip */
        if (most > 0.0 && fabs(rest) > 1e-15 * most &&
            fabs(r[0]) + fabs(r[1]) + fabs(r[2]) > 1e-14 * largest)
            assert_int_equal(one->modes[k], other->modes[k]);
    }
    assert_int_equal(one->carrier, other->carrier);
}

/* Answers, and answers spoilt a little: 1 where it said yes. */
static int32_t try(perp_contact_solver *solver, rigid_scene *s, double spoil, gen_random *rng)
{
    const double tol = 1e-12;
    perp__rigid_problem p = rigid_problem(s);
    perp__rigid_answer a = rigid_answer(s), look = rigid_answer(s);
    copy one, other;
    int32_t says;

    p.tol = 1e-13;
    p.warm = NULL;
    assert_int_equal(perp__rigid_solve(solver, &a, &p), PERP_OK);
    memcpy(s->warm, s->impulse, 3 * (size_t)s->contacts * sizeof(double));
    for (int32_t i = 0; i < 3 * s->contacts; i++)
        s->warm[i] *= 1.0 + spoil * gen_uniform(rng, -1.0, 1.0);
    p.warm = s->warm;
    p.tol = 1e-10;
    says = perp__rigid_single(&a, &p, tol);
    if (!says)
        return 0;
    keep(s, &one);
    /* those, or the least ones */
    memcpy(s->warm, s->impulse, 3 * (size_t)s->contacts * sizeof(double));
    p.max_iterations = -1;
    p.tol = tol;
    assert_int_equal(perp__rigid_solve(solver, &look, &p), PERP_OK);
    assert_int_equal(look.outcome, PERP_OUTCOME_SOLVED);
    assert_true(look.tested <= a.tested + 1e-15); /* as in check_same() */
    p.tol = 1e-10;
    p.again = 1;
    assert_int_equal(perp__rigid_hold(solver, &look, &p), PERP_OK);
    keep(s, &other);
    check_same(s, &one, &other);
    return 1;
}

static void test_same(void **state)
{
    static const double spoils[] = {0.0, 1e-15, 1e-13, 1e-12, 1e-11, 1e-9, 1e-3};
    perp_context *context = NULL;
    perp_contact_solver *solver = NULL;
    gen_random rng;
    int32_t yes[7] = {0};

    (void)state;
    gen_seed(&rng, 1);
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    assert_int_equal(perp__contact_create(context, &solver, NULL), PERP_OK);
    for (int32_t k = 0; k < SCENES; k++)
        for (int32_t i = 0; i < 7; i++) {
            rigid_scene s;

            rigid_open(&s, k % 2);
            fill(&s, &rng);
            yes[i] += try(solver, &s, spoils[i], &rng);
            rigid_close(&s);
        }
    perp__handle_end(solver);
    perp_context_destroy(context);
    print_message("taken of %d: %d %d %d %d %d %d %d\n", SCENES, yes[0], yes[1], yes[2], yes[3],
                  yes[4], yes[5], yes[6]);
    assert_true(yes[0] >= SCENES / 2); /* most answers are to rounding */
    assert_true(yes[6] <= SCENES / 4); /* what is held, by others */
}

/* What it is not for. */
static void test_refusals(void **state)
{
    gen_random rng;
    perp__rigid_problem p;
    perp__rigid_answer a;
    rigid_scene s;

    (void)state;
    gen_seed(&rng, 2);
    rigid_open(&s, 0);
    fill(&s, &rng);
    p = rigid_problem(&s);
    a = rigid_answer(&s);
    p.tol = 1e-10;
    p.warm = NULL;
    assert_int_equal(perp__rigid_single(&a, &p, 1e-12), 0);
    memset(s.warm, 0, 3 * (size_t)s.contacts * sizeof(double));
    p.warm = s.warm;
    assert_int_equal(perp__rigid_single(&a, &p, 1e-12), 0); /* it falls */
    s.warm[0] = NAN;
    assert_int_equal(perp__rigid_single(&a, &p, 1e-12), 0);
    rigid_close(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_same),
                                       cmocka_unit_test(test_refusals)};

    return cmocka_run_group_tests(tests, NULL, NULL);
}
