/* Random planar systems of integers, one to four contacts, at rest and sliding, ordinary ones and
 * such that hold both ways: every answer by exact elimination of all patterns, with forces and
 * accelerations of exactly 0. */
#include "found.h"

#include "rational.h"

enum { CONTACTS = 4, MOST = 300, SYSTEMS = 400 };

static uint64_t seed;

static int draw(int low, int high)
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return low + (int)((seed >> 33) % (uint64_t)(high - low + 1));
}

/* M = I: W = J J', beta = J k. Rows: normal and tangent of each contact. mu in quarters. */
typedef struct integers {
    int n, contacts, J[2 * CONTACTS * TABLE_N], k[TABLE_N];
    int W[2 * CONTACTS * 2 * CONTACTS], beta[2 * CONTACTS];
    int mu[CONTACTS], mu_static[CONTACTS], slides[CONTACTS], both[CONTACTS];
} integers;

/* both: every second contact holds both ways. */
static void draw_system(integers *s, int contacts, int both)
{
    int rows = 2 * contacts, i, j, k;

    s->contacts = contacts;
    s->n = draw(contacts > 1 ? 3 : 2, 7);
    for (i = 0; i < rows; i++) {
        int any = 0;

        while (!any) /* a normal is not 0 */
            for (j = 0; j < s->n; j++)
                any |= s->J[i * s->n + j] = draw(-1, 1);
    }
    for (j = 0; j < s->n; j++)
        s->k[j] = draw(-3, 3);
    for (i = 0; i < rows; i++) {
        for (j = 0; j < rows; j++)
            for (s->W[i * rows + j] = 0, k = 0; k < s->n; k++)
                s->W[i * rows + j] += s->J[i * s->n + k] * s->J[j * s->n + k];
        for (s->beta[i] = 0, k = 0; k < s->n; k++)
            s->beta[i] += s->J[i * s->n + k] * s->k[k];
    }
    for (j = 0; j < contacts; j++) {
        s->mu[j] = draw(0, 12);
        s->mu_static[j] = s->mu[j] + draw(0, 1);
        s->slides[j] = draw(-1, 1);
        s->both[j] = both && draw(0, 1);
    }
}

typedef struct exact_answers {
    int count, singular;
    double f[MOST][2 * CONTACTS], u[MOST][2 * CONTACTS];
} exact_answers;

/* Modes: 0 separates, 1 sticks, 2 and -2 slips with the friction of that velocity's sign. side: the
 * sign of the normal force that the friction counts with; 0: none. */
static void try_exact(const integers *s, exact_answers *e, const int *mode, const int *side)
{
    const int rows = 2 * s->contacts;
    int64_t K[64], rhs[8], x[8], f[8], u[8], det; /* f: times 4 det, u too */
    int unknown[8], count = 0, i, j, c, r;

    for (j = 0; j < s->contacts; j++) {
        if (mode[j] != 0)
            unknown[count++] = 2 * j;
        if (mode[j] == 1)
            unknown[count++] = 2 * j + 1;
    }
    for (r = 0; r < count; r++) { /* forces are in quarters of the unknowns */
        for (c = 0; c < count; c++) {
            const int j2 = unknown[c] / 2, drag = side[j2] * (mode[j2] / 2) * s->mu[j2];

            K[count * r + c] = 4 * s->W[unknown[r] * rows + unknown[c]];
            if (mode[j2] != 1)
                K[count * r + c] -= drag * s->W[unknown[r] * rows + unknown[c] + 1];
        }
        rhs[r] = -4 * s->beta[unknown[r]];
    }
    det = count > 0 ? rational_solve(count, K, rhs, x) : 1;
    if (det == 0) {
        e->singular = 1;
        return;
    }
    memset(f, 0, sizeof f);
    for (c = 0; c < count; c++) {
        const int j2 = unknown[c] / 2;

        f[unknown[c]] = 4 * x[c];
        if (mode[j2] != 1)
            f[unknown[c] + 1] = -side[j2] * (mode[j2] / 2) * s->mu[j2] * x[c];
    }
    for (i = 0; i < rows; i++)
        for (u[i] = 4 * s->beta[i] * det, j = 0; j < rows; j++)
            u[i] += s->W[i * rows + j] * f[j];
    for (j = 0; j < s->contacts; j++) {
        if (mode[j] == 0 ? u[2 * j] < 0 : side[j] * f[2 * j] < 0)
            return;
        if (mode[j] == 1 && 4 * llabs(f[2 * j + 1]) > s->mu_static[j] * side[j] * f[2 * j])
            return;
        if (mode[j] * mode[j] == 4 && s->slides[j] == 0 && s->mu_static[j] > 0 &&
            mode[j] * u[2 * j + 1] <= 0)
            return;
    }
    for (r = 0; r < e->count; r++) {
        for (i = 0; i < rows && e->f[r][i] == (double)f[i] / (4.0 * (double)det); i++)
            ;
        if (i == rows)
            return;
    }
    assert_true(e->count < MOST);
    for (i = 0; i < rows; i++) {
        e->f[e->count][i] = (double)f[i] / (4.0 * (double)det);
        e->u[e->count][i] = (double)u[i] / (4.0 * (double)det);
    }
    e->count++;
}

static void enumerate_exactly(const integers *s, exact_answers *e)
{
    static const int modes[2][2][8] = {{{0, 1, 2, -2}, {0, 2}}, {{1, 2, -2, 1, 2, -2}, {2, 2}}};
    static const int sides[2][2][8] = {{{1, 1, 1, 1}, {1, 1}}, {{1, 1, 1, -1, -1, -1}, {1, -1}}};
    static const int choices[2][2] = {{4, 2}, {6, 2}};
    int mode[CONTACTS], side[CONTACTS], code, total = 1, j;

    e->count = e->singular = 0;
    for (j = 0; j < s->contacts; j++)
        total *= choices[s->both[j]][s->slides[j] != 0 || s->mu_static[j] == 0];
    for (code = 0; code < total; code++) {
        int rest = code;

        for (j = 0; j < s->contacts; j++) {
            const int few = s->slides[j] != 0 || s->mu_static[j] == 0, both = s->both[j];
            const int choice = rest % choices[both][few];

            rest /= choices[both][few];
            mode[j] = modes[both][few][choice];
            side[j] = sides[both][few][choice];
            if (few && s->slides[j] < 0)
                mode[j] = -mode[j];
        }
        try_exact(s, e, mode, side);
    }
}

static void ask_in_doubles(const integers *s, int64_t most_patterns, table *t)
{
    int i, j;

    table_make(t, s->n, s->contacts, 2);
    t->model.mu_static = t->mu_static;
    t->model.two_sided = s->both;
    for (i = 0; i < 2 * s->contacts * s->n; i++)
        t->H[i] = s->J[i];
    for (i = 0; i < s->n; i++)
        t->k[i] = s->k[i];
    for (j = 0; j < s->contacts; j++) {
        t->mu[j] = s->mu[j] / 4.0;
        t->mu_static[j] = s->mu_static[j] / 4.0;
        t->drift[2 * j + 1] = s->slides[j];
    }
    t->settings.most_patterns = most_patterns;
    table_open(t);
    table_ask(t);
}

/* The answer with these forces and accelerations; numbers are of size 1, systems regular: minors
 * are integers / 4^8, so that 1e-9 is far above rounding. */
static int32_t is_among(table *t, const double *f, const double *u, int rows)
{
    int32_t k, i;

    for (k = 0; k < t->summary.count; k++) {
        const perp_mechanism_found *found = table_get(t, k);

        for (i = 0; i < rows; i++)
            if (!(fabs(found->force[i] - f[i]) <= 1e-9 * fmax(1.0, fabs(f[i]))) ||
                !(fabs(found->row_acceleration[i] - u[i]) <= 1e-9 * fmax(1.0, fabs(u[i]))))
                break;
        if (i == rows)
            return 1;
    }
    return 0;
}

static void check_systems(int both)
{
    int regular = 0, contacts, k, j, counts[8] = {0};

    seed = 5;
    for (contacts = 1; contacts <= CONTACTS; contacts++)
        for (k = 0; k < SYSTEMS; k++) {
            integers s;
            exact_answers e;
            table t;

            draw_system(&s, contacts, both);
            enumerate_exactly(&s, &e);
            ask_in_doubles(&s, 1 << 20, &t);
            assert_int_equal(t.summary.exhaustive, 1);
            for (j = 0; j < t.summary.count; j++)
                assert_true(table_get(&t, j)->residual <= 1e-11);
            if (!e.singular) {
                if (t.summary.count != e.count)
                    fail_msg("system %d of %d contacts: %d answers, not %d", k, contacts,
                             (int)t.summary.count, e.count);
                for (j = 0; j < e.count; j++)
                    assert_true(is_among(&t, e.f[j], e.u[j], 2 * contacts));
                counts[e.count < 7 ? e.count : 7]++;
                regular++;
                if (t.summary.reason == PERP_MECHANISM_ALWAYS_ONE)
                    assert_int_equal(e.count, 1);
                /* all patterns were looked at: what is known to have two answers is told */
                for (j = 0; j < contacts; j++)
                    if (!s.slides[j] && s.mu_static[j] > s.mu[j])
                        assert_int_not_equal(t.summary.reason, PERP_MECHANISM_UNDECIDED);
            } else if (t.summary.families == 0) { /* patterns without a unique point have none */
                for (j = 0; j < e.count; j++)
                    assert_true(is_among(&t, e.f[j], e.u[j], 2 * contacts));
                /* but that a contact which holds both ways may carry nothing in one */
                assert_true(both ? t.summary.count >= e.count : t.summary.count == e.count);
            }
            table_close(&t);
        }
    /* all kinds occur */
    assert_true(regular > SYSTEMS && counts[0] > 10 && counts[1] > 10 && counts[2] > 10 &&
                counts[3] > 10);
}

static void test_random(void **state)
{
    (void)state;
    check_systems(0);
}

static void test_random_two_sided(void **state)
{
    (void)state;
    check_systems(1);
}

/* Where no patterns are enumerated the search finds nothing but answers, one at least of nine in
 * ten systems that have some, and nine in ten of them all. */
static void test_search(void **state)
{
    int both, contacts, k, j;

    (void)state;
    for (both = 0; both < 2; both++) {
        int answers = 0, found = 0, systems = 0, answered = 0;

        seed = 5;
        for (contacts = 1; contacts <= CONTACTS; contacts++)
            for (k = 0; k < SYSTEMS; k++) {
                int of_this = 0;
                integers s;
                exact_answers e;
                table t;

                draw_system(&s, contacts, both);
                enumerate_exactly(&s, &e);
                if (e.singular) /* families: test_many_corners */
                    continue;
                ask_in_doubles(&s, 1, &t);
                for (j = 0; j < e.count; j++)
                    of_this += is_among(&t, e.f[j], e.u[j], 2 * contacts);
                assert_int_equal(t.summary.count, of_this);
                answers += e.count;
                found += of_this;
                systems += e.count > 0;
                answered += of_this > 0;
                table_close(&t);
            }
        assert_true(10 * found >= 9 * answers && 10 * answered >= 9 * systems && systems > 500);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_random),
                                       cmocka_unit_test(test_random_two_sided),
                                       cmocka_unit_test(test_search)};

    return cmocka_run_group_tests(tests, NULL, NULL);
}
