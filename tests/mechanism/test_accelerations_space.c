/* Accelerations in 3 dimensions: directions of slips that start, discs of friction, and what is
 * found where there are too many contacts to look at every pattern. */
#include "found.h"

#define GRAVITY 9.81
#define PI 3.14159265358979323846

static uint64_t seed;

static double draw(double low, double high)
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return low + (high - low) * (double)(seed >> 11) / 9007199254740992.0;
}

/* A mass that is larger along y, pushed: slips where (push - mu N d) / mass is along d. */
static void test_oblique(void **state)
{
    static const double rows[3][3] = {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}};
    const double masses[] = {1.0, 3.0, 1.0}, weight = 2.0, mu = 0.5;
    int k, i;

    (void)state;
    seed = 1;
    for (k = 0; k < 40; k++) {
        const double heading = draw(-PI, PI), push = draw(0.2, 4.0);
        const perp_mechanism_found *found;
        table s;

        table_make(&s, 3, 1, 3);
        for (i = 0; i < 3; i++) {
            table_row(s.H, 3, i, rows[i]);
            s.M[4 * i] = masses[i];
        }
        s.k[0] = push * cos(heading);
        s.k[1] = push * sin(heading);
        s.k[2] = -weight;
        s.mu[0] = mu;
        table_open(&s);
        assert_int_equal(table_ask(&s), 1);
        assert_int_equal(s.summary.reason, PERP_MECHANISM_ALWAYS_ONE);
        found = table_get(&s, 0);
        table_near(found->force[0], weight, 1e-15, "N");
        if (push < mu * weight) {
            assert_int_equal(found->modes[0], PERP_MECHANISM_STICK);
            assert_true(found->acceleration[0] == 0.0 && found->acceleration[1] == 0.0);
            table_near(found->force[1], -s.k[0], 1e-15, "friction");
        } else {
            const double *u = found->row_acceleration, length = hypot(u[1], u[2]);

            assert_int_equal(found->modes[0], PERP_MECHANISM_SLIP);
            for (i = 0; i < 2; i++) { /* the law, and Newton's; Newton's method leaves 1e-13 */
                table_near(found->force[1 + i], -mu * weight * u[1 + i] / length, 1e-12,
                           "friction");
                table_near(masses[i] * found->acceleration[i], s.k[i] + found->force[1 + i], 1e-13,
                           "acceleration");
            }
        }
        table_close(&s);
    }
}

/* One contact whose normal and tangents are coupled, at rest: answers that slip are zeros of one
 * function of an angle, counted on a fine grid. p N = -beta_n; across times p has no poles. margin:
 * how far the zeros are from what is no answer. */
static int scan(const double *W, const double *beta, double mu, double *margin)
{
    const int points = 4000;
    double before = 0.0;
    int count = 0, k;

    *margin = INFINITY;
    for (k = 0; k <= points; k++) {
        const double angle = 2.0 * PI * (k + 0.123) / points, c = cos(angle), s = sin(angle);
        const double p = W[0] - mu * (W[1] * c + W[2] * s), N = -beta[0] / p;
        const double x = beta[1] + (W[3] - mu * (W[4] * c + W[5] * s)) * N;
        const double y = beta[2] + (W[6] - mu * (W[7] * c + W[8] * s)) * N;
        const double across = (c * y - s * x) * p, along = (c * x + s * y) * p;

        if (k > 0 && before * across < 0.0) {
            count += N > 0.0 && along * p > 0.0;
            *margin = fmin(*margin, fmin(fabs(p) / W[0], fabs(along) / hypot(beta[1], beta[2])));
        }
        before = across;
    }
    return count;
}

static void test_coupled(void **state)
{
    int counts[4] = {0}, k, i, j, l;

    (void)state;
    seed = 7;
    for (k = 0; k < 300; k++) {
        double L[9], W[9], beta[3], f[3], margin, room;
        int expected, sticks, separates;
        table s;

        for (i = 0; i < 9; i++)
            L[i] = draw(-1.0, 1.0);
        table_make(&s, 3, 1, 3);
        memcpy(s.H, L, sizeof L);
        for (i = 0; i < 3; i++)
            s.k[i] = draw(-1.0, 1.0);
        for (i = 0; i < 3; i++) {
            for (j = 0; j < 3; j++)
                for (W[3 * i + j] = 0.0, l = 0; l < 3; l++)
                    W[3 * i + j] += L[3 * i + l] * L[3 * j + l];
            for (beta[i] = 0.0, l = 0; l < 3; l++)
                beta[i] += L[3 * i + l] * s.k[l];
        }
        s.mu[0] = draw(0.0, 3.0);
        expected = scan(W, beta, s.mu[0], &margin);
        table_open(&s);
        table_ask(&s);
        /* stick: L'f = -k */
        sticks = separates = 0;
        for (i = 0; i < 3; i++) {
            const int p = (i + 1) % 3, q = (i + 2) % 3;
            double det = 0.0;

            f[i] = 0.0;
            for (j = 0; j < 3; j++) { /* Cramer: the cross product of the other rows */
                const int a = (j + 1) % 3, b = (j + 2) % 3;
                const double minor = L[3 * p + a] * L[3 * q + b] - L[3 * p + b] * L[3 * q + a];

                det += L[3 * i + j] * minor;
                f[i] -= s.k[j] * minor;
            }
            f[i] /= det;
        }
        room = s.mu[0] * f[0] - hypot(f[1], f[2]);
        sticks = f[0] > 0.0 && room >= 0.0;
        separates = beta[0] >= 0.0;
        expected += sticks + separates;
        if (margin > 0.01 && fabs(room) > 0.01 && fabs(beta[0]) > 0.01) {
            if (s.summary.count != expected)
                fail_msg("system %d: %d answers, not %d", k, (int)s.summary.count, expected);
            counts[expected < 3 ? expected : 3]++;
        }
        for (i = 0; i < s.summary.count; i++)
            assert_true(table_get(&s, i)->residual <= 1e-10);
        table_close(&s);
    }
    assert_true(counts[0] == 0 && counts[1] > 50 && counts[3] > 5); /* at rest there is one */
}

/* Contacts at rest have an answer for every load, and one where friction is small. */
static void test_existence(void **state)
{
    int contacts, k, i, j;

    (void)state;
    seed = 3;
    for (contacts = 2; contacts <= 3; contacts++)
        for (k = 0; k < 40; k++) {
            const double mu = k % 2 ? 0.15 : draw(0.2, 1.5);
            table s;

            table_make(&s, 9, contacts, 3);
            for (i = 0; i < 9; i++) {
                for (j = 0; j < 3 * contacts; j++)
                    s.H[9 * j + i] = (i == j) + draw(-0.3, 0.3);
                s.k[i] = draw(-1.0, 1.0);
            }
            for (j = 0; j < contacts; j++)
                s.mu[j] = mu;
            table_open(&s);
            assert_true(table_ask(&s) >= 1);
            assert_int_equal(s.summary.exhaustive, 1);
            if (k % 2) {
                assert_int_equal(s.summary.count, 1);
                assert_int_equal(s.summary.reason, PERP_MECHANISM_ALWAYS_ONE);
            }
            for (i = 0; i < s.summary.count; i++)
                assert_true(table_get(&s, i)->residual <= 1e-12);
            table_close(&s);
        }
}

/* ---- a table: a body of mass 3 on four legs at (+-1, +-0.5, -0.7) of its mass centre --------- */

/* The tangents of each leg are turned by another angle. */
static void make_table(table *s, const double *push, double mu)
{
    int i, k;

    table_make(s, 6, 4, 3);
    for (i = 0; i < 3; i++) {
        s->M[7 * i] = 3.0;
        s->M[7 * (i + 3)] = 0.5 + i;
        s->k[i] = push[i];
    }
    s->k[2] -= 3.0 * GRAVITY;
    for (k = 0; k < 4; k++) {
        const double place[] = {k < 2 ? 1.0 : -1.0, k % 2 ? 0.5 : -0.5, -0.7},
                     angle = 0.3 + 1.1 * k;
        const double d[3][3] = {
            {0, 0, 1}, {cos(angle), sin(angle), 0}, {-sin(angle), cos(angle), 0}};

        for (i = 0; i < 3; i++) {
            const double row[] = {d[i][0],
                                  d[i][1],
                                  d[i][2],
                                  place[1] * d[i][2] - place[2] * d[i][1],
                                  place[2] * d[i][0] - place[0] * d[i][2],
                                  place[0] * d[i][1] - place[1] * d[i][0]};

            table_row(s->H, 6, 3 * k + i, row);
        }
        s->mu[k] = mu;
    }
}

static void test_table(void **state)
{
    static const double none[] = {0, 0, 0}, push[] = {6.0, -2.5, 0.0};
    const double force = hypot(6.0, 2.5), weight = 3.0 * GRAVITY;
    const perp_mechanism_found *found;
    table s;
    int i, k;

    (void)state;
    make_table(&s, none, 0.2); /* at rest: twelve forces, six equations */
    s.settings.directions = 8;
    table_open(&s);
    assert_int_equal(table_ask(&s), 1);
    found = table_get(&s, 0);
    assert_int_equal(found->dimension, 6);
    assert_int_equal(found->free, 0);
    assert_int_equal(found->stable, 1);
    assert_int_equal(found->eigenvalue_count, 12);
    for (i = 0; i < 6; i++)
        assert_true(found->acceleration[i] == 0.0);
    for (i = 0; i < 4; i++)
        assert_int_equal(found->modes[i], PERP_MECHANISM_STICK);
    for (i = 0; i < found->vertex_count; i++)
        for (k = 0; k < 4; k++) { /* inside of the disc; points are known to 1e-9 */
            const double *f = found->vertices + 12 * i + 3 * k;

            assert_true(hypot(f[1], f[2]) <= 0.2 * f[0] + 1e-7);
        }
    table_close(&s);
    make_table(&s, push, 0.2); /* slides along the push: 0.2 * 29.43 = 5.9 < 6.5 */
    s.settings.directions = 8;
    table_open(&s);
    assert_int_equal(table_ask(&s), 1);
    found = table_get(&s, 0);
    assert_int_equal(found->dimension, 1);
    assert_int_equal(found->free, 0);
    assert_int_equal(found->vertex_count, 2);
    for (i = 0; i < 2; i++)
        table_near(found->acceleration[i], push[i] / 3.0 * (1.0 - 0.2 * weight / force), 1e-12,
                   "acceleration");
    for (i = 2; i < 6; i++)
        table_near(found->acceleration[i], 0.0, 1e-12, "no other acceleration");
    for (i = 0; i < 4; i++)
        assert_int_equal(found->modes[i], PERP_MECHANISM_SLIP);
    table_close(&s);
    make_table(&s, push, 0.23); /* at rest, close to the limit 0.2209 */
    s.settings.directions = 8;
    table_open(&s);
    assert_int_equal(table_ask(&s), 1);
    found = table_get(&s, 0);
    assert_int_equal(found->free, 0);
    assert_true(found->acceleration[0] == 0.0 && found->acceleration[5] == 0.0);
    table_close(&s);
}

/* Dry friction on a disc. */
static void test_disc(void **state)
{
    static const double rows[2][2] = {{1, 0}, {0, 1}};
    table s;
    int i;

    (void)state;
    table_make(&s, 2, 0, 2);
    s.model.dry = 1;
    s.model.dry_dim = 2;
    for (i = 0; i < 2; i++)
        table_row(s.B, 2, i, rows[i]);
    s.bound[0] = 5.0;
    s.k[0] = 3.0;
    s.k[1] = -4.0;
    table_open(&s);
    assert_int_equal(table_ask(&s), 1);
    assert_int_equal(table_get(&s, 0)->modes[0], PERP_MECHANISM_STICK);
    assert_int_equal(s.found.at_vertex, 1);
    s.bound[0] = 2.5;
    assert_int_equal(table_ask(&s), 1);
    assert_int_equal(table_get(&s, 0)->modes[0], PERP_MECHANISM_SLIP);
    table_near(s.found.acceleration[0], 1.5, 1e-13, "along x");
    table_near(s.found.acceleration[1], -2.0, 1e-13, "along y");
    s.v[1] = 1e-3;
    assert_int_equal(table_ask(&s), 1);
    table_near(s.found.acceleration[0], 3.0, 1e-13, "along x");
    table_near(table_get(&s, 0)->acceleration[1], -6.5, 1e-13, "along y");
    table_close(&s);
}

/* ---- too many contacts ---------------------------------------------------------------------- */

/* Fourteen blocks that know nothing of each other: 4^14 patterns, one answer. */
static void test_many_blocks(void **state)
{
    table s;
    int j;

    (void)state;
    table_make(&s, 28, 14, 2);
    for (j = 0; j < 14; j++) {
        s.H[(2 * j) * 28 + 2 * j + 1] = 1.0;
        s.H[(2 * j + 1) * 28 + 2 * j] = 1.0;
        s.k[2 * j] = (j - 7) * 0.11;
        s.k[2 * j + 1] = j % 3 == 2 ? 1.0 : -1.0;
        s.mu[j] = 0.5;
    }
    table_open(&s);
    assert_int_equal(table_ask(&s), 1);
    assert_int_equal(s.summary.exhaustive, 0);
    assert_int_equal(s.summary.closed, 14);
    assert_int_equal(s.summary.reason, PERP_MECHANISM_UNDECIDED);
    assert_true(s.summary.patterns > 0 && s.summary.patterns <= s.settings.starts * 8 * (14 + 1));
    table_get(&s, 0);
    for (j = 0; j < 14; j++) {
        const double push = (j - 7) * 0.11, rest = fmax(fabs(push) - 0.5, 0.0);

        if (j % 3 == 2)
            table_near(s.found.acceleration[2 * j], push, 1e-15, "in the air");
        else
            table_near(s.found.acceleration[2 * j], copysign(rest, push), 1e-15, "on the floor");
        table_near(s.found.acceleration[2 * j + 1], j % 3 == 2 ? 1.0 : 0.0, 1e-15, "up");
    }
    table_close(&s);
}

/* Sixteen contacts of one box, which starts to slide, rests or slides: far more forces than a
 * family could list. */
static void test_many_corners(void **state)
{
    table s;
    int j, kind;

    (void)state;
    for (kind = 0; kind < 3; kind++) {
        table_make(&s, 3, 16, 2);
        s.v[0] = kind == 2;
        for (j = 0; j < 16; j++) {
            const double n[] = {0, 1, j / 7.5 - 1.0}, t[] = {1, 0, 0.2};

            table_row(s.H, 3, 2 * j, n);
            table_row(s.H, 3, 2 * j + 1, t);
            s.mu[j] = 0.5;
        }
        s.k[0] = kind == 1 ? 4.0 : 6.0;
        s.k[1] = -10.0;
        table_open(&s);
        assert_int_equal(table_ask(&s), 1);
        assert_int_equal(s.summary.exhaustive, 0);
        assert_true(table_get(&s, 0)->dimension > 0);
        table_near(s.found.acceleration[0], kind == 1 ? 0.0 : 1.0, 1e-12, "acceleration");
        table_near(s.found.acceleration[1], 0.0, 1e-12, "up");
        table_near(s.found.acceleration[2], 0.0, 1e-12, "angular");
        assert_true(s.found.residual <= 1e-9);
        table_close(&s);
    }
}

/* The rod of Painleve thirteen times: any of 2^13 answers, all of them found or not, must be right.
 */
static void test_few_patterns(void **state)
{
    table s;
    int j, k;

    (void)state;
    table_make(&s, 26, 13, 2);
    for (j = 0; j < 13; j++) {
        s.H[(2 * j) * 26 + 2 * j + 1] = 1.0;
        s.H[(2 * j + 1) * 26 + 2 * j] = 1.0;
        s.M[(2 * j) * 27] = 1.0;
        s.M[(2 * j + 1) * 27] = 1.0;
        s.M[(2 * j) * 26 + 2 * j + 1] = s.M[(2 * j + 1) * 26 + 2 * j] = -0.5;
        s.k[2 * j + 1] = 1.0;
        s.mu[j] = 3.0; /* W = [[1, .5], [.5, 1]] / .75: 1 - 3 * 0.5 < 0 */
        s.v[2 * j] = 1.0;
    }
    s.settings.most_patterns = 100;
    table_open(&s);
    assert_true(table_ask(&s) >= 1);
    assert_int_equal(s.summary.exhaustive, 0);
    assert_int_equal(s.summary.reason, PERP_MECHANISM_NEGATIVE_INERTIA);
    table_near(s.summary.inertia, -0.5, 1e-14, "inertia");
    for (k = 0; k < s.summary.count; k++) {
        table_get(&s, k);
        assert_true(s.found.residual <= 1e-12);
        for (j = 0; j < 13; j++) /* N = 0, or -b / p = (1 / .75) / (.5 / .75) */
            assert_true(s.found.force[2 * j] == 0.0 || fabs(s.found.force[2 * j] - 2.0) <= 1e-13);
    }
    table_close(&s);
}

/* A time limit that the first patterns use up. */
static void test_time(void **state)
{
    table s;
    int j;

    (void)state;
    table_make(&s, 20, 10, 2);
    for (j = 0; j < 10; j++) {
        s.H[(2 * j) * 20 + 2 * j + 1] = 1.0;
        s.H[(2 * j + 1) * 20 + 2 * j] = 1.0;
        s.k[2 * j + 1] = -1.0;
    }
    s.mu[3] = 0.5;
    s.settings.time_limit = 1e-9;
    table_open(&s);
    table_ask(&s);
    assert_int_equal(s.summary.exhaustive, 0);
    assert_true(s.summary.patterns < 2048);
    s.settings.time_limit = 0.0;
    assert_int_equal(perp_mechanism_set(s.mechanism, &s.settings), PERP_OK);
    assert_int_equal(table_ask(&s), 1);
    assert_int_equal(s.summary.exhaustive, 1);
    assert_int_equal(s.summary.patterns, 2048); /* nine without friction: 2^9 4 */
    table_close(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_oblique),      cmocka_unit_test(test_coupled),
        cmocka_unit_test(test_table),        cmocka_unit_test(test_disc),
        cmocka_unit_test(test_many_blocks),  cmocka_unit_test(test_many_corners),
        cmocka_unit_test(test_few_patterns), cmocka_unit_test(test_existence),
        cmocka_unit_test(test_time),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
