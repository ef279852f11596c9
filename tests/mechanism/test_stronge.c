/* Stronge's law: the falling rod's five impacts in closed form (E. J. Routh 1905; W. J. Stronge,
 * Proc. R. Soc. A 431 (1990); Y. Wang & M. T. Mason, J. Appl. Mech. 59 (1992)), jams, slips that
 * turn in space, several contacts at once, and energy. */
#include "gen.h"
#include "tabled.h"

/* One impulsive step: no forces, positions are left alone. */
static int32_t hit(tabled *r, int32_t law)
{
    int32_t outcome;

    r->settings.law = law;
    r->settings.project = 0;
    tabled_open(r);
    outcome = tabled_advance(r, 1e-3);
    tabled_close(r);
    return outcome;
}

/* ---- the plane ------------------------------------------------------------------------------ */

/* A rod of length 2 and mass 1, M = diag(1, 1, 1/3), whose lower end at the angle `angle` from the
 * vertical touches the floor with velocities (u_t, u_n) and no spin. */
typedef struct rod {
    double mu, e, nn, nt, tt; /* mobility of its end */
    double slip, u;           /* before */
} rod;

static void make_rod(tabled *r, rod *end, double angle, double mu, double e, double slip, double u)
{
    const double s = sin(angle), c = cos(angle);
    const double H[] = {0.0, 1.0, -s, 1.0, 0.0, c};

    tabled_make(r, 3, 1, 2);
    memcpy(r->H, H, sizeof H);
    r->M[8] = 1.0 / 3.0;
    r->mu[0] = mu;
    r->restitution[0] = e;
    r->v[0] = slip;
    r->v[1] = u;
    end->mu = mu;
    end->e = e;
    end->nn = 1.0 + 3.0 * s * s;
    end->nt = -3.0 * s * c;
    end->tt = 1.0 + 3.0 * c * c;
    end->slip = slip;
    end->u = u;
}

enum regime {
    SLIDES,       /* in both parts */
    STICKS_EARLY, /* in the compression */
    STICKS_LATE,  /* in the expansion */
    REVERSES_EARLY,
    REVERSES_LATE,
    REGIMES
};

/* Routh's diagram: impulses r_n, r_t of a slip to the right. In the first part u_n grows with p by
 * B = nn - mu nt and the slip by C = nt - mu tt; behind its end by D: that of sticking, or of the
 * reverse slip. */
static int32_t find_impulses(const rod *end, double *normal, double *tangent, double *u_end)
{
    const double B = end->nn - end->mu * end->nt, C = end->nt - end->mu * end->tt;
    const int32_t stays = fabs(end->nt) <= end->mu * end->tt;
    const double D = stays ? end->nn - end->nt * end->nt / end->tt : end->nn + end->mu * end->nt;
    const double friction = stays ? -end->nt / end->tt : end->mu;
    const double compressed = -end->u / B, stop = C < 0.0 ? -end->slip / C : INFINITY;
    const double e = end->e;

    if (B > 0.0 && stop >= compressed * (1.0 + e)) { /* W_c = -u^2/2B, u+ = -e u */
        *normal = compressed * (1.0 + e);
        *tangent = -end->mu * *normal;
        *u_end = -e * end->u;
        return SLIDES;
    }
    if (!(B > 0.0) || stop < compressed) { /* u at the stop, then D: W_c in two pieces */
        const double u = end->u + B * stop;
        const double W = 0.5 * stop * (end->u + u) - 0.5 * u * u / D;

        *u_end = e * sqrt(-2.0 * D * W);
        *normal = stop + (*u_end - u) / D;
        *tangent = -end->mu * stop + friction * (*normal - stop);
        return stays ? STICKS_EARLY : REVERSES_EARLY;
    }
    { /* in the expansion: u at the stop has got (u^2)/2B back of e^2 u_0^2/2B */
        const double u = end->u + B * stop;

        *u_end = sqrt(u * u + D / B * (e * e * end->u * end->u - u * u));
        *normal = stop + (*u_end - u) / D;
        *tangent = -end->mu * stop + friction * (*normal - stop);
        return stays ? STICKS_LATE : REVERSES_LATE;
    }
}

static void test_rod(void **state)
{
    int32_t seen[REGIMES] = {0}, k;
    gen_random random;

    (void)state;
    gen_seed(&random, 1990);
    for (k = 0; k < 5000; k++) {
        const double angle = gen_uniform(&random, -1.5, 1.5), mu = gen_uniform(&random, 0.0, 1.2);
        const double e = k % 10 == 0 ? 1.0 : gen_uniform(&random, 0.05, 1.0);
        const double slip = gen_uniform(&random, 0.0, 2.0), u = gen_uniform(&random, -1.0, -0.1);
        double normal, tangent, u_end;
        int32_t regime;
        tabled r;
        rod end;

        make_rod(&r, &end, angle, mu, e, slip, u);
        regime = find_impulses(&end, &normal, &tangent, &u_end);
        seen[regime]++;
        assert_int_equal(hit(&r, PERP_MECHANISM_STRONGE), PERP_OUTCOME_SOLVED);
        assert_int_equal(r.step.impacts, 1);
        /* tol = 1e-10 of what sticks, which is the contact solver's; else rounding */
        tabled_near(r.impulse[0], normal, 1e-9, "normal");
        tabled_near(r.impulse[1], tangent, 1e-9, "tangent");
        tabled_near(r.velocity[0], u_end, 1e-9, "u_n");
        if (regime == STICKS_EARLY || regime == STICKS_LATE)
            tabled_zero(r.velocity[1], "slip");
        assert_int_equal(r.modes[0], regime == STICKS_EARLY || regime == STICKS_LATE
                                         ? PERP_MECHANISM_STICK
                                         : PERP_MECHANISM_SLIP);
    }
    for (k = 0; k < REGIMES; k++)
        assert_true(seen[k] > 50);
}

/* Where slip does not stop Newton's, Poisson's and Stronge's coefficients are one. */
static void test_laws_agree_without_a_stop(void **state)
{
    static const int32_t laws[] = {PERP_MECHANISM_NEWTON, PERP_MECHANISM_POISSON,
                                   PERP_MECHANISM_STRONGE};
    gen_random random;
    int32_t k, law, count = 0;

    (void)state;
    gen_seed(&random, 5);
    for (k = 0; k < 500; k++) {
        const double angle = gen_uniform(&random, -1.5, 1.5), mu = gen_uniform(&random, 0.0, 0.6);
        const double e = gen_uniform(&random, 0.1, 1.0), slip = gen_uniform(&random, 1.0, 3.0);
        double normal, tangent, u_end;
        tabled r;
        rod end;

        make_rod(&r, &end, angle, mu, e, slip, -1.0);
        if (find_impulses(&end, &normal, &tangent, &u_end) != SLIDES)
            continue;
        count++;
        for (law = 0; law < 3; law++) {
            make_rod(&r, &end, angle, mu, e, slip, -1.0);
            assert_int_equal(hit(&r, laws[law]), PERP_OUTCOME_SOLVED);
            tabled_near(r.impulse[0], normal, 1e-9, "normal");
            tabled_near(r.velocity[0], e, 1e-9, "u_n");
        }
    }
    assert_true(count > 300);
}

/* A jam: no approach, but sliding pulls the end into the floor until it stops. */
static void test_jam(void **state)
{
    static const double es[] = {0.25, 0.5, 1.0};
    int32_t k;

    (void)state;
    for (k = 0; k < 3; k++) {
        double normal, tangent, u_end;
        tabled r;
        rod end;

        make_rod(&r, &end, -0.5, 2.0, es[k], 1.0, 0.0);
        r.k[1] = -1e-3; /* in a step of 1e-3: presses the end down */
        end.u = -1e-6;
        assert_true(end.nn - end.mu * end.nt < 0.0);
        assert_int_equal(find_impulses(&end, &normal, &tangent, &u_end), STICKS_EARLY);
        assert_int_equal(hit(&r, PERP_MECHANISM_STRONGE), PERP_OUTCOME_SOLVED);
        assert_int_equal(r.step.impacts, 1);
        tabled_near(r.impulse[0], normal, 1e-8, "normal");
        tabled_near(r.velocity[0], u_end, 1e-8, "u_n");
        tabled_zero(r.velocity[1], "slip");
    }
}

/* The centre on a rail, y = 0: the mobility is that with the constraint held. */
static void test_on_a_rail(void **state)
{
    gen_random random;
    int32_t k;

    (void)state;
    gen_seed(&random, 6);
    for (k = 0; k < 300; k++) {
        const double angle = gen_uniform(&random, 0.2, 1.3), mu = gen_uniform(&random, 0.0, 1.0);
        const double e = gen_uniform(&random, 0.1, 1.0), spin = gen_uniform(&random, 0.1, 2.0);
        double normal, tangent, u_end;
        tabled r;
        rod end;

        make_rod(&r, &end, angle, mu, e, 0.0, 0.0);
        r.model.bilateral = 1;
        r.G[1] = 1.0;
        r.v[2] = spin;
        r.v[0] = gen_uniform(&random, 0.0, 2.0);
        end.nn -= 1.0;
        end.slip = r.v[0] + cos(angle) * spin;
        end.u = -sin(angle) * spin;
        find_impulses(&end, &normal, &tangent, &u_end);
        assert_int_equal(hit(&r, PERP_MECHANISM_STRONGE), PERP_OUTCOME_SOLVED);
        tabled_zero(r.v[1], "y'");
        tabled_near(r.impulse[0], normal, 1e-8 * fmax(1.0, normal), "normal");
        tabled_near(r.velocity[0], u_end, 1e-8, "u_n");
    }
}

/* ---- space ---------------------------------------------------------------------------------- */

/* The rod of the plane with a second tangent, both turned: the closed forms hold. */
static void test_rod_in_space(void **state)
{
    int32_t seen[REGIMES] = {0}, k, i;
    gen_random random;

    (void)state;
    gen_seed(&random, 1992);
    for (k = 0; k < 1000; k++) {
        const double angle = gen_uniform(&random, -1.5, 1.5), mu = gen_uniform(&random, 0.05, 0.7);
        const double turn = gen_uniform(&random, -3.0, 3.0), e = gen_uniform(&random, 0.1, 1.0);
        double normal, tangent, u_end;
        tabled plane, r;
        rod end;

        make_rod(&plane, &end, angle, mu, e, gen_uniform(&random, 0.0, 1.0), -1.0);
        tabled_make(&r, 4, 1, 3); /* x, y, angle, and z */
        for (i = 0; i < 3; i++) {
            r.M[5 * i] = plane.M[4 * i];
            r.v[i] = plane.v[i];
            r.H[i] = plane.H[i];
            r.H[4 + i] = cos(turn) * plane.H[3 + i];
            r.H[8 + i] = sin(turn) * plane.H[3 + i];
        }
        r.H[7] = -sin(turn);
        r.H[11] = cos(turn);
        r.mu[0] = mu;
        r.restitution[0] = e;
        seen[find_impulses(&end, &normal, &tangent, &u_end)]++;
        assert_int_equal(hit(&r, PERP_MECHANISM_STRONGE), PERP_OUTCOME_SOLVED);
        tabled_near(r.impulse[0], normal, 1e-8, "normal");
        tabled_near(cos(turn) * r.impulse[1] + sin(turn) * r.impulse[2], tangent, 1e-8, "tangent");
        tabled_near(r.velocity[0], u_end, 1e-8, "u_n");
        tabled_near(r.v[3], 0.0, 1e-8, "z'");
    }
    for (k = 0; k < REGIMES; k++)
        assert_true(seen[k] > 5);
}

/* A free body of mass 1 with random inertia, hit at a random point. */
static void make_body(tabled *r, gen_random *random, double mu, double e)
{
    double p[3], n[3], t[3], b[3], length = 0.0, u = 0.0;
    int32_t i, k;

    tabled_make(r, 6, 1, 3);
    for (i = 0; i < 3; i++) {
        r->M[7 * (3 + i)] = exp(gen_uniform(random, -2.0, 0.5));
        p[i] = gen_uniform(random, -1.0, 1.0);
        n[i] = gen_uniform(random, -1.0, 1.0);
        length += n[i] * n[i];
    }
    for (i = 0; i < 3; i++)
        n[i] /= sqrt(length);
    k = fabs(n[0]) < 0.6 ? 0 : 1;
    for (i = 0; i < 3; i++)
        t[i] = (i == k ? 1.0 : 0.0) - n[k] * n[i];
    length = sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]);
    for (i = 0; i < 3; i++)
        t[i] /= length;
    for (i = 0; i < 3; i++)
        b[i] = n[(i + 1) % 3] * t[(i + 2) % 3] - n[(i + 2) % 3] * t[(i + 1) % 3];
    for (i = 0; i < 3; i++) {
        const double *rows[3] = {n, t, b};

        for (k = 0; k < 3; k++) {
            const double *d = rows[k];

            r->H[6 * k + i] = d[i];
            r->H[6 * k + 3 + i] = p[(i + 1) % 3] * d[(i + 2) % 3] - p[(i + 2) % 3] * d[(i + 1) % 3];
        }
    }
    for (i = 0; i < 6; i++) {
        r->v[i] = gen_uniform(random, -1.0, 1.0);
        u += r->H[i] * r->v[i];
    }
    for (i = 0; i < 6 && u > 0.0; i++)
        r->v[i] = -r->v[i];
    r->mu[0] = mu;
    r->restitution[0] = e;
}

/* Darboux' and Keller's equations in steps of p so short that order 2 is enough: friction of the
 * middle of the step; a slip that the step's friction could turn round is over, or starts anew if
 * none stops it. Returns the smallest slip; *stops: 1: it ended and stays, 2: it started anew. */
/* Where the slip ends: f of what sticks, by Cramer's rule; else that along the direction d, with f
 * = -mu d, in which the slip grows, sought by the angle. */
static int32_t start_anew(const tabled *r, double f[3])
{
    double W[3][3], ahead = 0.0, sum = 0.0;
    int32_t i, k, l;

    for (k = 0; k < 3; k++)
        for (l = 0; l < 3; l++) {
            W[k][l] = 0.0;
            for (i = 0; i < 6; i++)
                W[k][l] += r->H[6 * k + i] * r->H[6 * l + i] / r->M[7 * i];
        }
    sum = W[1][1] * W[2][2] - W[1][2] * W[1][2];
    f[1] = (W[1][2] * W[2][0] - W[2][2] * W[1][0]) / sum;
    f[2] = (W[1][2] * W[1][0] - W[1][1] * W[2][0]) / sum;
    if (hypot(f[1], f[2]) <= r->mu[0])
        return 1;
    for (k = 0; k <= 100000; k++) {
        const double c = cos(2e-5 * 3.14159265358979323846 * k),
                     s = sin(2e-5 * 3.14159265358979323846 * k), mu = r->mu[0];
        const double x = W[1][0] - mu * (W[1][1] * c + W[1][2] * s);
        const double y = W[2][0] - mu * (W[1][2] * c + W[2][2] * s), across = c * y - s * x;

        if (k > 0 && across * ahead <= 0.0 && c * x + s * y > 0.0) {
            f[1] = -mu * c;
            f[2] = -mu * s;
            return 2;
        }
        ahead = across;
    }
    fail_msg("no direction");
    return 0;
}

static double integrate(const tabled *r, double step, double v[6], double *normal, int32_t *stops)
{
    double work = 0.0, least = 0.0, slowest = INFINITY, u[3], f[3], half[6];
    const double *H = r->H;
    int32_t i, k, part, expands = 0;

    memcpy(v, r->v, 6 * sizeof *v);
    *normal = 0.0;
    *stops = 0;
    f[0] = 1.0;
    for (;;) {
        double before = 0.0, now = 0.0;

        for (part = 0; part < 2; part++) {
            const double *at = part == 0 ? v : half;
            double speed;

            for (k = 0; k < 3; k++) {
                u[k] = 0.0;
                for (i = 0; i < 6; i++)
                    u[k] += H[6 * k + i] * at[i];
            }
            if (part == 0)
                before = u[0];
            speed = hypot(u[1], u[2]);
            if (*stops == 0 && speed < 40.0 * step) /* rates are up to 30 */
                *stops = start_anew(r, f);
            if (*stops == 0) {
                slowest = fmin(slowest, speed);
                f[1] = -r->mu[0] * u[1] / speed;
                f[2] = -r->mu[0] * u[2] / speed;
            }
            for (i = 0; i < 6; i++) {
                half[i] = v[i];
                for (k = 0; k < 3; k++)
                    half[i] += (part == 0 ? 0.5 : 1.0) * step * H[6 * k + i] * f[k] / r->M[7 * i];
            }
        }
        memcpy(v, half, sizeof half);
        *normal += step;
        for (i = 0; i < 6; i++)
            now += H[i] * v[i];
        work += 0.5 * step * (before + now);
        if (!expands && now >= 0.0 && before < 0.0) {
            expands = 1;
            least = work - 0.5 * now * now * step / (now - before); /* back to u = 0 */
        }
        if (expands && work >= (1.0 - r->restitution[0] * r->restitution[0]) * least) {
            const double beyond =
                (work - (1.0 - r->restitution[0] * r->restitution[0]) * least) / now;

            *normal -= beyond; /* to first order of a step */
            for (i = 0; i < 6; i++)
                for (k = 0; k < 3; k++)
                    v[i] -= beyond * H[6 * k + i] * f[k] / r->M[7 * i];
            return slowest;
        }
    }
}

/* Slips that turn, and those that stop and stay. One that cannot stay goes round 0 in space, but
 * for those of a plane. */
static void test_turning_slip(void **state)
{
    int32_t k, i, stops, count[3] = {0};
    double worst[3] = {0.0}, turned = 0.0;
    gen_random random;

    (void)state;
    gen_seed(&random, 3);
    for (k = 0; k < 200; k++) {
        const double mu = gen_uniform(&random, 0.0, 1.2);
        const double e = gen_uniform(&random, 0.1, 1.0);
        double v[6], normal, slowest, u[2] = {0.0, 0.0}, off;
        tabled r;

        make_body(&r, &random, mu, e);
        for (i = 0; i < 3 && k % 2 > 0; i++) { /* without spin, and a slip that may end */
            r.v[i] = -r.H[i] + 0.4 * r.H[6 + i];
            r.v[3 + i] = 0.0;
        }
        slowest = integrate(&r, 4e-6, v, &normal, &stops);
        if (stops == 0 && slowest < 0.05)
            continue;
        count[stops]++;
        for (i = 0; i < 12; i++)
            u[i / 6] += r.H[6 + i] * r.v[i % 6];
        assert_int_equal(hit(&r, PERP_MECHANISM_STRONGE), PERP_OUTCOME_SOLVED);
        if (stops == 0)
            turned = fmax(turned, fabs(u[0] * r.velocity[2] - u[1] * r.velocity[1]) /
                                      (hypot(u[0], u[1]) * hypot(r.velocity[1], r.velocity[2])));
        off = fabs(r.impulse[0] - normal);
        for (i = 0; i < 6; i++)
            off = fmax(off, fabs(r.v[i] - v[i]));
        worst[stops] = fmax(worst[stops], off);
    }
    assert_true(count[0] > 50 && count[1] > 20);
    assert_true(turned > 0.9);
    /* the integration's: (4e-6/0.05)^2 times rates; behind a stop that is taken for one 1.6e-4
     * early, so much */
    assert_true(worst[0] < 1e-7);
    assert_true(worst[1] < 1e-3);
}

/* ---- energy --------------------------------------------------------------------------------- */

/* Random impacts in space of one contact: the largest change of energy, relative; how many grew. */
static int32_t count_growth(int32_t law, double *most)
{
    gen_random random;
    int32_t k, grew = 0;

    *most = -INFINITY;
    gen_seed(&random, 11);
    for (k = 0; k < 3000; k++) {
        double before, change;
        tabled r;

        make_body(&r, &random, gen_uniform(&random, 0.0, 2.0),
                  k % 2 ? 1.0 : gen_uniform(&random, 0.1, 1.0));
        before = tabled_energy(&r, r.v);
        assert_int_equal(hit(&r, law), PERP_OUTCOME_SOLVED);
        change = (tabled_energy(&r, r.v) - before) / before;
        grew += change > 1e-9;
        *most = fmax(*most, change);
    }
    return grew;
}

static void test_energy_of_one(void **state)
{
    double most;
    int32_t newton = count_growth(PERP_MECHANISM_NEWTON, &most);

    (void)state;
    assert_true(newton > 100);
    assert_int_equal(count_growth(PERP_MECHANISM_STRONGE, &most), 0);
}

/* A free body in the plane; the first contacts approach, and each has its e. */
static void make_several(tabled *r, gen_random *random, int32_t contacts, int32_t approach,
                         double mu)
{
    int32_t i, j;

    tabled_make(r, 3, contacts, 2);
    r->M[8] = exp(gen_uniform(random, -2.0, 1.0));
    for (i = 0; i < 3; i++)
        r->v[i] = gen_uniform(random, -1.0, 1.0);
    for (j = 0; j < contacts; j++) {
        const double angle = gen_uniform(random, -3.14, 3.14), x = gen_uniform(random, -1.0, 1.0);
        const double y = gen_uniform(random, -1.0, 1.0), c = cos(angle), s = sin(angle);
        const double rows[] = {c, s, x * s - y * c, -s, c, x * c + y * s};
        double u = 0.0;

        memcpy(r->H + 6 * j, rows, sizeof rows);
        for (i = 0; i < 3; i++)
            u += rows[i] * r->v[i];
        for (i = 0; i < 3 && u > 0.0 && j < approach; i++)
            r->H[6 * j + i] = -rows[i];
        r->mu[j] = mu * gen_uniform(random, 0.0, 2.0);
        r->restitution[j] = fmin(gen_uniform(random, 0.0, 2.0), 1.0); /* every second one is 1 */
    }
}

static void count_several(int32_t law, int32_t contacts, double mu, int32_t *solved, int32_t *grew,
                          double *most)
{
    gen_random random;
    int32_t k;

    *solved = *grew = 0;
    *most = -INFINITY;
    gen_seed(&random, 12);
    for (k = 0; k < 3000; k++) {
        double before, change;
        tabled r;

        make_several(&r, &random, contacts, 1, mu);
        before = tabled_energy(&r, r.v);
        *solved += hit(&r, law) == PERP_OUTCOME_SOLVED;
        change = (tabled_energy(&r, r.v) - before) / before;
        *grew += change > 1e-9;
        *most = fmax(*most, change);
    }
}

static void test_energy_of_several(void **state)
{
    int32_t contacts, solved, grew, friction, poisson = 0;
    double most, worst = 0.0;

    (void)state;
    for (friction = 0; friction < 2; friction++)
        for (contacts = 2; contacts <= 3; contacts++) {
            count_several(PERP_MECHANISM_POISSON, contacts, friction, &solved, &grew, &most);
            poisson += grew;
            worst = fmax(worst, most);
            count_several(PERP_MECHANISM_STRONGE, contacts, friction, &solved, &grew, &most);
            assert_int_equal(solved, 3000);
            assert_int_equal(grew, 0);
        }
    assert_int_equal(poisson, 18);
    tabled_near(worst, 53.97, 0.01, "worst of Poisson's law");
}

static double distance(const tabled *a, const tabled *b)
{
    return fmax(fmax(fabs(a->v[0] - b->v[0]), fabs(a->v[1] - b->v[1])), fabs(a->v[2] - b->v[2]));
}

/* Where Poisson's law moves what is hit, Stronge's does, but in 1 of 1000: then the factors are not
 * found. */
static void test_several_give_back(void **state)
{
    static const int32_t laws[] = {PERP_MECHANISM_STRONGE, PERP_MECHANISM_POISSON};
    int32_t k, law, moved = 0, none = 0;
    gen_random random;

    (void)state;
    gen_seed(&random, 13);
    for (k = 0; k < 6000; k++) {
        const gen_random start = random;
        tabled r[2], plastic;

        for (law = 0; law < 2; law++) {
            random = start;
            make_several(r + law, &random, 2 + k % 2, 1, k / 2 % 2);
            hit(r + law, laws[law]);
        }
        random = start;
        make_several(&plastic, &random, 2 + k % 2, 1, k / 2 % 2);
        memset(plastic.restitution, 0, sizeof plastic.restitution);
        hit(&plastic, PERP_MECHANISM_POISSON);
        moved += distance(r + 1, &plastic) > 1e-3;
        none += distance(r + 1, &plastic) > 1e-3 && distance(r, &plastic) <= 1e-9;
    }
    assert_true(moved > 4000);
    assert_true(none <= moved / 500);
}

/* ---- several at once ------------------------------------------------------------------------ */

/* Two contacts without friction that both approach, each with its e. The compression by the four
 * patterns of its linear problem; then every contact that opens got e^2 of what its compression
 * took, along straight lines. */
static void test_two_without_friction(void **state)
{
    int32_t k, j, opened = 0;
    gen_random random;

    (void)state;
    gen_seed(&random, 8);
    for (k = 0; k < 500; k++) {
        double u[2] = {0.0, 0.0}, W[2][2] = {{0.0, 0.0}, {0.0, 0.0}}, c[2], u_c[2], determinant;
        tabled r;
        int32_t i, l;

        make_several(&r, &random, 2, 2, 0.0);
        for (j = 0; j < 2; j++)
            for (i = 0; i < 3; i++) {
                u[j] += r.H[6 * j + i] * r.v[i];
                for (l = 0; l < 2; l++)
                    W[j][l] += r.H[6 * j + i] * r.H[6 * l + i] / r.M[4 * i];
            }
        determinant = W[0][0] * W[1][1] - W[0][1] * W[0][1];
        c[0] = (W[0][1] * u[1] - W[1][1] * u[0]) / determinant;
        c[1] = (W[0][1] * u[0] - W[0][0] * u[1]) / determinant;
        for (j = 0; j < 2; j++)
            if (c[j] < 0.0) {
                c[j] = 0.0;
                c[1 - j] = -u[1 - j] / W[1 - j][1 - j];
            }
        for (j = 0; j < 2; j++)
            u_c[j] = u[j] + W[j][0] * c[0] + W[j][1] * c[1];
        assert_int_equal(hit(&r, PERP_MECHANISM_STRONGE), PERP_OUTCOME_SOLVED);
        for (j = 0; j < 2; j++) {
            const double e = r.restitution[j], x = r.impulse[2 * j] - c[j];

            assert_true(x >= -1e-9);
            if (c[0] * c[1] > 0.0 && r.velocity[2 * j] > 1e-6 && x > 1e-6) {
                opened++;
                tabled_near(0.5 * x * (u_c[j] + r.velocity[2 * j]), -0.5 * e * e * c[j] * u[j],
                            1e-8, "work");
            }
        }
    }
    assert_true(opened > 400);
}

/* Two bodies that are hit in the same step answer as each alone does. */
static void test_two_apart(void **state)
{
    gen_random random;
    int32_t k, i, j;

    (void)state;
    gen_seed(&random, 9);
    for (k = 0; k < 200; k++) {
        tabled one[2], both;

        tabled_make(&both, 6, 2, 2);
        for (j = 0; j < 2; j++) {
            make_several(one + j, &random, 1, 1, 1.0);
            for (i = 0; i < 3; i++) {
                both.M[7 * (3 * j + i)] = one[j].M[4 * i];
                both.v[3 * j + i] = one[j].v[i];
                both.H[12 * j + 3 * j + i] = one[j].H[i];
                both.H[12 * j + 6 + 3 * j + i] = one[j].H[3 + i];
            }
            both.mu[j] = one[j].mu[0];
            both.restitution[j] = one[j].restitution[0];
            assert_int_equal(hit(one + j, PERP_MECHANISM_STRONGE), PERP_OUTCOME_SOLVED);
        }
        assert_int_equal(hit(&both, PERP_MECHANISM_STRONGE), PERP_OUTCOME_SOLVED);
        for (i = 0; i < 6; i++) /* tol = 1e-10 of each problem, by levers */
            tabled_near(both.v[i], one[i / 3].v[i % 3], 1e-8, "v");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rod),
        cmocka_unit_test(test_laws_agree_without_a_stop),
        cmocka_unit_test(test_jam),
        cmocka_unit_test(test_on_a_rail),
        cmocka_unit_test(test_rod_in_space),
        cmocka_unit_test(test_turning_slip),
        cmocka_unit_test(test_energy_of_one),
        cmocka_unit_test(test_energy_of_several),
        cmocka_unit_test(test_several_give_back),
        cmocka_unit_test(test_two_without_friction),
        cmocka_unit_test(test_two_apart),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
