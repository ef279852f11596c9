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

static void make_rod(tabled *r, rod *rod, double angle, double mu, double e, double slip, double u)
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
    rod->mu = mu;
    rod->e = e;
    rod->nn = 1.0 + 3.0 * s * s;
    rod->nt = -3.0 * s * c;
    rod->tt = 1.0 + 3.0 * c * c;
    rod->slip = slip;
    rod->u = u;
}

enum regime {
    SLIDES,           /* in both parts */
    STICKS_EARLY,     /* in the compression */
    STICKS_LATE,      /* in the expansion */
    REVERSES_EARLY,
    REVERSES_LATE,
    REGIMES
};

/* Routh's diagram: impulses r_n, r_t of a slip to the right. In the first part u_n grows with p by
 * B = nn - mu nt and the slip by C = nt - mu tt; behind its end by D: that of sticking, or of the
 * reverse slip. */
static int32_t find_impulses(const rod *rod, double *normal, double *tangent, double *u_end)
{
    const double B = rod->nn - rod->mu * rod->nt, C = rod->nt - rod->mu * rod->tt;
    const int32_t stays = fabs(rod->nt) <= rod->mu * rod->tt;
    const double D = stays ? rod->nn - rod->nt * rod->nt / rod->tt : rod->nn + rod->mu * rod->nt;
    const double friction = stays ? -rod->nt / rod->tt : rod->mu;
    const double compressed = -rod->u / B, stop = C < 0.0 ? -rod->slip / C : INFINITY;
    const double e = rod->e;

    if (B > 0.0 && stop >= compressed * (1.0 + e)) { /* W_c = -u^2/2B, u+ = -e u */
        *normal = compressed * (1.0 + e);
        *tangent = -rod->mu * *normal;
        *u_end = -e * rod->u;
        return SLIDES;
    }
    if (!(B > 0.0) || stop < compressed) { /* u at the stop, then D: W_c in two pieces */
        const double u = rod->u + B * stop;
        const double W = 0.5 * stop * (rod->u + u) - 0.5 * u * u / D;

        *u_end = e * sqrt(-2.0 * D * W);
        *normal = stop + (*u_end - u) / D;
        *tangent = -rod->mu * stop + friction * (*normal - stop);
        return stays ? STICKS_EARLY : REVERSES_EARLY;
    }
    { /* in the expansion: u at the stop has got (u^2)/2B back of e^2 u_0^2/2B */
        const double u = rod->u + B * stop;

        *u_end = sqrt(u * u + D / B * (e * e * rod->u * rod->u - u * u));
        *normal = stop + (*u_end - u) / D;
        *tangent = -rod->mu * stop + friction * (*normal - stop);
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
        rod rod;

        make_rod(&r, &rod, angle, mu, e, slip, u);
        regime = find_impulses(&rod, &normal, &tangent, &u_end);
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
    for (k = 0; k < REGIMES; k++) {
        print_message("regime %d: %d\n", (int)k, (int)seen[k]);
        assert_true(seen[k] > 50);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rod),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
