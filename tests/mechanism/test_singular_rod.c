/* A rod that slides on its tip and turns towards p = 0, where load and friction no longer push the
 * tip out (Genot & Brogliato's singular point, p = b = 0): when it gets there, how its load grows
 * on the way, and what comes then, against an integration in the time of p. */
#include "rig.h"

#define ALPHA 3.0 /* m l^2 / I of the thin rod, m = l = 1 */

typedef struct approach {
    double mu, angle, spin, slip; /* of the start, slip of the tip */
} approach;

/* Angle, spin, time and slip of the tip. */
typedef struct slide {
    double y[4];
} slide;

static double inertia_of(const approach *a, double angle)
{
    const double c = cos(angle);

    return 1 + ALPHA * c * c - a->mu * ALPHA * sin(angle) * c;
}

static double lift_of(const slide *s)
{
    return s->y[1] * s->y[1] * sin(s->y[0]) - MACHINE_GRAVITY;
}

/* angle'' per unit of load. */
static double turn_of(const approach *a, double angle)
{
    return ALPHA * (a->mu * sin(angle) - cos(angle));
}

/* With dt = p ds the load N = -b/p leaves no quotient: smooth to the singular point and through it.
 * a_t = (W_tt mu + W_nt) N + spin^2 cos. */
static void rate_of(const approach *a, const slide *s, double rate[4])
{
    const double sine = sin(s->y[0]), cosine = cos(s->y[0]), b = lift_of(s),
                 p = inertia_of(a, s->y[0]);

    rate[0] = p * s->y[1];
    rate[1] = -b * turn_of(a, s->y[0]);
    rate[2] = p;
    rate[3] = -b * (a->mu * (1 + ALPHA * sine * sine) - ALPHA * sine * cosine) +
              p * s->y[1] * s->y[1] * cosine;
}

/* One step of Runge and Kutta's method. */
static void advance_slide(const approach *a, slide *s, double h)
{
    static const double shares[] = {0.5, 0.5, 1}, weights[] = {1, 2, 2, 1};
    slide at = *s;
    double rate[4], sum[4] = {0};
    int k, i;

    for (k = 0; k < 4; k++) {
        rate_of(a, &at, rate);
        for (i = 0; i < 4; i++) {
            sum[i] += weights[k] * rate[i];
            at.y[i] = k < 3 ? s->y[i] + shares[k] * h * rate[i] : 0;
        }
    }
    for (i = 0; i < 4; i++)
        s->y[i] += h / 6 * sum[i];
}

/* To the singular point, or to b = 0 with p > 0; whether it is the point. Halved steps change the
 * end by less than 1e-11; b shrinks by exp(-6 s), and 6 of s leave less than 1e-14 of it. */
static int slide_down(const approach *a, slide *s)
{
    const double h = 2e-5;
    double t;

    *s = (slide){{a->angle, a->spin, 0, a->slip}};
    for (t = 0; t < 6; t += h) {
        slide next = *s;

        advance_slide(a, &next, h);
        if (inertia_of(a, s->y[0]) > 1e-4 && lift_of(&next) >= 0) {
            advance_slide(a, s, h * lift_of(s) / (lift_of(s) - lift_of(&next)));
            return 0;
        }
        *s = next;
    }
    return 1;
}

/* The plastic impact that leaves the tip at rest: W (N, F) = (0, -slip). Then under Poisson's law
 * e N along the normal, with the friction that keeps the tip's slip 0. Its speed off the floor. */
static double jam(slide *s, double e)
{
    const double sine = sin(s->y[0]), cosine = cos(s->y[0]);
    const double nn = 1 + ALPHA * cosine * cosine, tt = 1 + ALPHA * sine * sine,
                 nt = -ALPHA * sine * cosine, det = nn * tt - nt * nt;
    const double N = nt * s->y[3] / det, F = -nn * s->y[3] / det;

    s->y[1] += ALPHA * ((F - e * N * nt / tt) * sine - (1 + e) * N * cosine);
    s->y[3] = 0;
    return e * N * det / tt;
}

/* ---- the runs ------------------------------------------------------------------------------ */

enum { MOST_STEPS = 4000 };

static int32_t law = PERP_MECHANISM_POISSON;

typedef struct history {
    double t[MOST_STEPS], load[MOST_STEPS]; /* of the sliding steps: their ends, mean loads */
    double jam;                             /* when the tip first stuck */
    int32_t steps;
} history;

static int32_t watch(const perp_mechanism_view *view, void *user)
{
    history *all = user;

    if (view->h > 0 && view->modes[0] == PERP_MECHANISM_SLIP && all->steps < MOST_STEPS) {
        all->t[all->steps] = view->t;
        all->load[all->steps++] = view->impulse[0] / view->h;
    }
    if (view->h > 0 && view->modes[0] == PERP_MECHANISM_STICK)
        all->jam = fmin(all->jam, view->t);
    return 0;
}

/* v of the centre and spin, from those of the tip. */
static void whole(const slide *s, double lift, double v[3])
{
    v[0] = s->y[3] - s->y[1] * sin(s->y[0]);
    v[1] = lift + s->y[1] * cos(s->y[0]);
    v[2] = s->y[1];
}

/* An adaptive theta run of that long; v at its end. */
static void run_rod(const approach *a, double error, double e, double end, double v[3],
                    history *all)
{
    const slide start = {{a->angle, a->spin, 0, a->slip}};
    perp_mechanism_run_result result = fresh_mechanism_run_result();
    double q[3];
    rig r;

    all->steps = 0;
    all->jam = INFINITY;
    rig_open(&r, MACHINE_ROD);
    r.settings.scheme = PERP_MECHANISM_THETA;
    r.settings.law = law;
    r.settings.error = error;
    r.machine.mu[0] = r.machine.mu_static[0] = a->mu;
    r.machine.restitution[0] = e;
    r.machine.q[0] = cos(a->angle);
    r.machine.q[1] = sin(a->angle);
    r.machine.q[2] = a->angle;
    whole(&start, 0, r.machine.v);
    rig_start(&r);
    assert_int_equal(
        perp_mechanism_run(r.mechanism, q, v, &result, START(0, 1e-3, r.q, r.v), end, watch, all),
        PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    rig_close(&r);
}

/* Errors of the steps add up: 2 to 15 times that of one in twenty random approaches. */
#define ADDED 30

static void check_end(const approach *a, double error, double e)
{
    const double flight = 0.01;
    history *all = malloc(sizeof *all);
    slide s;
    const int singular = slide_down(a, &s);
    double v[3], expected[3], lift = 0;
    int i;

    assert_non_null(all);
    if (singular) {
        near(s.y[1], sqrt(MACHINE_GRAVITY / sin(s.y[0])), 1e-9, "spin at the singular point");
        near(inertia_of(a, s.y[0]), 0, 1e-9, "p");
        lift = jam(&s, law == PERP_MECHANISM_STRONGE ? 0.0 : e);
    }
    whole(&s, lift, expected);
    expected[1] -= MACHINE_GRAVITY * flight; /* it leaves the floor, with either spin */
    run_rod(a, error, e, s.y[2] + flight, v, all);
    for (i = 0; i < 3; i++)
        near(v[i], expected[i], ADDED * error, "v");
    if (singular)
        near(all->jam, s.y[2], ADDED * error, "time");
    else
        assert_true(all->jam == INFINITY);
    free(all);
}

static const approach slow = {2, 25 * MACHINE_PI / 180, 2, -8};

/* At p = b = 0 the impulse along n - mu d changes nothing of u_n, and ends with the slip. That is
 * where contacts that give go, too: with stiffness k and damping ratio z the spin when the tip
 * leaves the floor is, by SciPy's LSODA at relative tolerances of 1e-9 (tanh(slip / 1e-3) for the
 * sign of the slip), for k = 1e6, 1e8, 1e10, 1e12
 *
 *   z = 0.05   4.570   4.718   4.773   4.795
 *   z = 0.3    4.659   4.752   4.787   4.802
 *   z = 1      4.744   4.784   4.801   4.808      and 4.8137397 after the jam; 4.0199 before it. */
static void test_jam(void **state)
{
    const approach fast = {2, 25 * MACHINE_PI / 180, 3, -8},
                   rough = {2.6, 27.6 * MACHINE_PI / 180, 2.44, -11.9},
                   smooth = {1.6, 33 * MACHINE_PI / 180, 1.3, -6.8},
                   light[] = {{1.981, 28.81 * MACHINE_PI / 180, 1.552, -7.526},
                              {2.41, 29.74 * MACHINE_PI / 180, 2.195, -8.548},
                              {1.899, 23.03 * MACHINE_PI / 180, 3.032, -4.495},
                              {2.89, 23.9 * MACHINE_PI / 180, 4.15, -6.224}};
    double error;
    slide s;

    (void)state;
    assert_int_equal(slide_down(&slow, &s), 1);
    near(s.y[2], 0.09672322226303, 1e-10, "time"); /* SciPy's DOP853, 1e-13 */
    jam(&s, 0);
    near(s.y[1], 4.81373972166823, 1e-9, "spin");
    for (error = 1e-4; error > 0.9e-9; error /= 10) {
        check_end(&slow, error, 0);
        check_end(&fast, error, 0);
    }
    check_end(&rough, 1e-6, 0);
    check_end(&smooth, 1e-6, 0);
    for (size_t i = 0; i < sizeof light / sizeof *light; i++) /* their loads fall to 0 with p */
        check_end(&light[i], 1e-6, 0);
}

/* What was compressed expands. */
static void test_poisson(void **state)
{
    (void)state;
    check_end(&slow, 1e-6, 0.5);
    check_end(&slow, 1e-6, 1);
}

/* The jam at p = 0 changes nothing of u_n: it takes no work, and Stronge's law gives none back. */
static void test_stronge(void **state)
{
    (void)state;
    law = PERP_MECHANISM_STRONGE;
    check_end(&slow, 1e-6, 0.5);
    check_end(&slow, 1e-6, 1);
    law = PERP_MECHANISM_POISSON;
}

/* With less friction b passes 0 first, with p > 0: the tip is let go without a jump. */
static void test_release(void **state)
{
    const approach little = {1.45, 23.4 * MACHINE_PI / 180, 3.2, -9},
                   much = {2.24, 21.7 * MACHINE_PI / 180, 4.36, -7.8},
                   close = {1.5, 37 * MACHINE_PI / 180, 1.35, -5.9}, /* p = 1.6e-4 is left */
        falls = {1.494, 25.34 * MACHINE_PI / 180, 2.194, -11.63};    /* its load, in a long step */

    (void)state;
    check_end(&little, 1e-6, 0);
    check_end(&little, 1e-8, 0);
    check_end(&much, 1e-6, 0);
    check_end(&close, 1e-6, 0);
    check_end(&close, 1e-7, 0);
    check_end(&falls, 1e-4, 0);
}

/* N ~ (T - t)^(l/k - 1), with the eigenvalues k = spin dp/dangle and l = -2 A spin sin of the
 * singular point in the time of p: 0.34 at mu = 2, so that N grows without bound. */
static void test_growth(void **state)
{
    history *all = malloc(sizeof *all);
    double v[3], slope, c, sine, k, l;
    int32_t first = -1, last = -1, i;
    slide s;

    (void)state;
    assert_non_null(all);
    slide_down(&slow, &s);
    c = cos(s.y[0]);
    sine = sin(s.y[0]);
    k = s.y[1] * ALPHA * (-2 * c * sine - slow.mu * (c * c - sine * sine));
    l = -2 * s.y[1] * sine * turn_of(&slow, s.y[0]);
    run_rod(&slow, 1e-8, 0, s.y[2] + 1e-3, v, all);
    for (i = 1; i < all->steps; i++) { /* the middles of two steps */
        const double left = s.y[2] - 0.5 * (all->t[i] + all->t[i - 1]);

        if (first < 0 && left < 1e-4)
            first = i;
        if (left > 3e-6)
            last = i;
    }
    assert_true(first > 0 && last > first);
    slope = log(all->load[last] / all->load[first]) /
            log((s.y[2] - 0.5 * (all->t[last] + all->t[last - 1])) /
                (s.y[2] - 0.5 * (all->t[first] + all->t[first - 1])));
    near(slope, l / k - 1, 0.02, "exponent"); /* the next term is smaller by (T - t)^0.66 */
    free(all);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_jam), cmocka_unit_test(test_poisson), cmocka_unit_test(test_stronge),
        cmocka_unit_test(test_release), cmocka_unit_test(test_growth)};

    return cmocka_run_group_tests(tests, NULL, NULL);
}
