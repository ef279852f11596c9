/* Pins and ball joints: |N| of several normals is no linear function, and the answers are the roots
 * of a system of quadratic equations, up to 2^p for p contacts that slide. What is found is checked
 * by Newton's method on |N| = n'N from many directions n: whatever it finds has to be there. */
#include "found.h"

enum { PINS = 4, MOST = 3 * PINS };

static uint64_t seed;

static double draw(void)
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(seed >> 11) / 4503599627370496.0 - 1.0;
}

/* p contacts of k normals and a tangent, all sliding; M = I. */
typedef struct pins {
    table table;
    int p, k, rows;
    int32_t two_sided[PINS];
    double W[4 * PINS][4 * PINS], beta[4 * PINS], way[PINS];
} pins;

static void draw_pins(pins *s, int p, int k, double mu)
{
    table *t = &s->table;
    const int rows = p * (k + 1), n = p * k + 2;
    int i, j, l;

    s->p = p;
    s->k = k;
    s->rows = rows;
    table_make(t, n, p, k + 1);
    t->model.two_sided = s->two_sided;
    for (i = 0; i < n; i++) {
        t->k[i] = draw();
        t->v[i] = draw();
    }
    for (i = 0; i < rows * n; i++)
        t->H[i] = draw();
    for (i = 0; i < rows; i++) {
        for (s->beta[i] = 0, l = 0; l < n; l++)
            s->beta[i] += t->H[i * n + l] * t->k[l];
        for (j = 0; j < rows; j++)
            for (s->W[i][j] = 0, l = 0; l < n; l++)
                s->W[i][j] += t->H[i * n + l] * t->H[j * n + l];
    }
    for (i = 0; i < p; i++) {
        double speed = 0;

        for (l = 0; l < n; l++)
            speed += t->H[(i * (k + 1) + k) * n + l] * t->v[l];
        s->way[i] = speed > 0 ? 1 : -1;
        s->two_sided[i] = k;
        t->mu[i] = mu;
    }
}

/* A x = b, overwritten, by elimination with rows exchanged. */
static void solve(int n, double A[MOST][MOST], double *b)
{
    int i, j, r;

    for (i = 0; i < n; i++) {
        int best = i;

        for (r = i; r < n; r++)
            if (fabs(A[r][i]) > fabs(A[best][i]))
                best = r;
        for (j = 0; j <= n; j++) {
            double *one = j < n ? &A[i][j] : &b[i], *other = j < n ? &A[best][j] : &b[best];
            const double swap = *one;

            *one = *other;
            *other = swap;
        }
        for (r = 0; r < n; r++) {
            const double factor = A[r][i] / A[i][i];

            for (j = i; j < n && r != i; j++)
                A[r][j] -= factor * A[i][j];
            b[r] -= r != i ? factor * b[i] : 0;
        }
    }
    for (i = 0; i < n; i++)
        b[i] /= A[i][i];
}

static double length(const double *x, int k)
{
    double sum = 0;

    while (k-- > 0)
        sum += x[k] * x[k];
    return sqrt(sum);
}

/* N from the directions `normal`, which become those of N; returns the largest change. */
static double turn(const pins *s, double *N, double normal[PINS][3])
{
    double A[MOST][MOST], change = 0;
    int e, f, i, j;

    for (e = 0; e < s->p; e++)
        for (i = 0; i < s->k; i++) {
            const int row = e * (s->k + 1) + i;

            N[e * s->k + i] = -s->beta[row];
            for (f = 0; f < s->p; f++)
                for (j = 0; j < s->k; j++)
                    A[e * s->k + i][f * s->k + j] =
                        s->W[row][f * (s->k + 1) + j] - s->way[f] * s->table.mu[f] * normal[f][j] *
                                                            s->W[row][f * (s->k + 1) + s->k];
        }
    solve(s->p * s->k, A, N);
    for (e = 0; e < s->p; e++)
        for (i = 0; i < s->k; i++) {
            const double next = N[e * s->k + i] / length(N + e * s->k, s->k);

            change = fmax(change, fabs(next - normal[e][i]));
            normal[e][i] = next;
        }
    return change;
}

/* Newton's points are good to 1e-13 of their directions, 1e-8 beside that is their condition. */
static int is_among(pins *s, const double *N)
{
    int32_t k;

    for (k = 0; k < s->table.summary.count; k++) {
        const double *force = table_get(&s->table, k)->force;
        double worst = 0, largest = 0;
        int e, i;

        for (e = 0; e < s->p; e++)
            for (i = 0; i < s->k; i++) {
                worst = fmax(worst, fabs(force[e * (s->k + 1) + i] - N[e * s->k + i]));
                largest = fmax(largest, fabs(N[e * s->k + i]));
            }
        if (worst <= 1e-8 * largest)
            return 1;
    }
    return 0;
}

static void look_for_others(pins *s)
{
    int start, e, i, round;

    for (start = 0; start < 100; start++) {
        double normal[PINS][3], N[MOST], change = 1;

        for (e = 0; e < s->p; e++) {
            for (i = 0; i < s->k; i++)
                normal[e][i] = draw(); /* of any length, to begin with */
        }
        for (round = 0; round < 50 && change > 1e-13; round++)
            change = turn(s, N, normal);
        if (change <= 1e-13 && !is_among(s, N))
            fail_msg("%d contacts of %d normals: N = %g, ... is missing", s->p, s->k, N[0]);
    }
}

/* The laws, of every answer: |f| = mu |N| against the slip, and u_N' = 0. Numbers are of size 1 to
 * 1e3, and these laws hold to rounding of their terms. */
static void check_laws(pins *s)
{
    int32_t k;

    for (k = 0; k < s->table.summary.count; k++) {
        const perp_mechanism_found *found = table_get(&s->table, k);
        int e, i;

        assert_true(found->residual <= 1e-13);
        for (e = 0; e < s->p; e++) {
            const double *force = found->force + e * (s->k + 1);
            const double size = length(force, s->k);

            assert_true(fabs(force[s->k] + s->way[e] * s->table.mu[e] * size) <= 1e-11 * size);
            for (i = 0; i < s->k; i++)
                assert_true(found->row_acceleration[e * (s->k + 1) + i] == 0.0);
        }
    }
}

static void test_roots(void **state)
{
    static const double mus[] = {0.1, 0.4, 1.0, 3.0};
    int counts[4] = {0}, p, k, i, repeat;
    pins s;

    (void)state;
    seed = 3;
    for (p = 1; p <= PINS; p++)
        for (k = 2; k <= 3; k++)
            for (i = 0; i < 4; i++)
                for (repeat = 0; repeat < 16; repeat++) {
                    draw_pins(&s, p, k, mus[i]);
                    table_open(&s.table);
                    table_ask(&s.table);
                    assert_int_equal(s.table.summary.exhaustive, 1);
                    assert_int_equal(s.table.summary.families, 0);
                    check_laws(&s);
                    look_for_others(&s);
                    if (s.table.summary.reason == PERP_MECHANISM_ALWAYS_ONE)
                        assert_int_equal(s.table.summary.count, 1);
                    counts[s.table.summary.count < 3 ? s.table.summary.count : 3]++;
                    table_close(&s.table);
                }
    assert_true(counts[0] > 20 && counts[1] > 50 && counts[2] > 10);
}

/* p pins apart from each other: N = (2 s - 2, -1/2) for the load s, so that 3 s^2 - 8 s + 4.25 = 0,
 * which has two roots, (8 +- sqrt 13) / 6: 2^p answers in all. */
static void test_all_roots(void **state)
{
    int p, e;
    int32_t k;

    (void)state;
    for (p = 1; p <= PINS; p++) {
        const int n = 3 * p;
        int seen[1 << PINS] = {0};
        table s;
        int32_t two_sided[PINS];

        table_make(&s, n, p, 3);
        s.model.two_sided = two_sided;
        for (e = 0; e < p; e++) {
            two_sided[e] = 2;
            s.H[3 * e * n + 3 * e] = s.H[(3 * e + 1) * n + 3 * e + 1] = 1;
            s.H[(3 * e + 2) * n + 3 * e] = 4;
            s.H[(3 * e + 2) * n + 3 * e + 2] = 1;
            s.k[3 * e] = 2;
            s.k[3 * e + 1] = s.mu[e] = 0.5;
            s.v[3 * e + 2] = 1;
        }
        table_open(&s);
        assert_int_equal(table_ask(&s), 1 << p);
        assert_int_equal(s.summary.exhaustive, 1);
        for (k = 0; k < s.summary.count; k++) {
            const perp_mechanism_found *found = table_get(&s, k);
            int code = 0;

            for (e = 0; e < p; e++) {
                const double load = -found->force[3 * e + 2] / 0.5;
                const int upper = load > 8.0 / 6;

                /* of size 1, and the quadratic's slope is 3.6 at its roots */
                table_near(load, (8 + (upper ? 1 : -1) * sqrt(13)) / 6, 1e-13, "load");
                code |= upper << e;
            }
            seen[code]++;
        }
        for (k = 0; k < 1 << p; k++)
            assert_int_equal(seen[k], 1);
        table_close(&s);
    }
}

/* A load that is 0 has no direction: nothing pushes, nothing is felt, and the pins turn on. */
static void test_without_load(void **state)
{
    pins s;
    int i;

    (void)state;
    seed = 7;
    draw_pins(&s, 3, 2, 0.05);
    memset(s.table.k, 0, sizeof s.table.k);
    table_open(&s.table);
    assert_int_equal(table_ask(&s.table), 1);
    assert_int_equal(s.table.summary.exhaustive, 1);
    for (i = 0; i < s.rows; i++)
        assert_true(table_get(&s.table, 0)->force[i] == 0.0);
    table_close(&s.table);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_roots),
                                       cmocka_unit_test(test_all_roots),
                                       cmocka_unit_test(test_without_load)};

    return cmocka_run_group_tests(tests, NULL, NULL);
}
