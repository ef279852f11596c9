/* Proofs that there is no solution: contacts and joints whose normals balance, random directions
 * and weights, so that the balance holds to rounding only. A proof where it exists, none where not.
 */
#include <math.h>

#include "suite.h"

#include "hand_over.h"

#include "context.h"

enum { N = 12, CONTACTS = 5 };

/* The first `closing` contacts close on each other, weights y: H'y = 0, or with a joint H'y + G's =
 * 0, s = 0.7. Returns y'w + s'b, the speed that nothing can undo if it is below 0. */
static double close_up(hand_over *p, gen_random *random, int32_t closing, int32_t blocks)
{
    double y[CONTACTS], sum = 0.0;
    int32_t last = p->starts[closing - 1], i, j;

    for (j = 0; blocks && j < p->n; j++)
        for (i = 0; i < p->n; i++)
            if (i / 6 != j / 6)
                p->M[i + j * p->n] = 0.0;
    for (i = 0; i < p->rows; i++)
        p->w[i] = 0.0;
    for (i = 0; i < closing; i++) {
        y[i] = gen_uniform(random, 0.1, 3.0);
        p->w[p->starts[i]] = -gen_uniform(random, 0.0, 1.0);
        sum += y[i] * p->w[p->starts[i]];
    }
    for (i = 0; i < p->joints; i++)
        p->b[i] = gen_normal(random);
    for (j = 0; j < p->n; j++) {
        double balance = p->joints > 0 ? 0.7 * p->G[j * p->joints] : 0.0;

        for (i = 0; i < closing - 1; i++)
            balance += y[i] * p->H[p->starts[i] + j * p->rows];
        p->H[last + j * p->rows] = -balance / y[closing - 1];
    }
    return sum + (p->joints > 0 ? 0.7 * p->b[0] : 0.0);
}

/* What the ray claims, by loops of our own. */
static void require_proof(const hand_over *p)
{
    double largest = 0.0, speed = 0.0;
    int32_t i, j, k;

    for (k = 0; k < p->contacts; k++)
        for (i = p->starts[k]; i < p->starts[k + 1]; i++)
            assert_true(i == p->starts[k] ? p->ray[i] >= 0.0 : p->ray[i] == 0.0);
    for (i = 0; i < p->size; i++) {
        largest = fmax(largest, fabs(p->ray[i]));
        speed += p->ray[i] * (i < p->rows ? p->w[i] : p->b[i - p->rows]);
    }
    assert_true(largest == 1.0 && speed < 0.0);
    for (j = 0; j < p->n; j++) {
        double sum = 0.0;

        for (i = 0; i < p->size; i++)
            sum += p->ray[i] *
                   (i < p->rows ? p->H[i + j * p->rows] : p->G[i - p->rows + j * p->joints]);
        assert_true(fabs(sum) <= 1e-12); /* 64 roundings of sums of order 10, and some */
    }
}

static void test_closing_contacts(void **state)
{
    uint64_t seed;

    (void)state;
    for (seed = 0; seed < 60; seed++) {
        const int32_t closing = 2 + (int32_t)(seed % 3), dim = 1 + (int32_t)(seed / 3 % 3);
        const int32_t joints = seed % 2 ? 2 : 0, blocks = seed % 4 < 2;
        gen_random random;
        hand_over p;
        double speed;

        hand_make(&p, seed, N, CONTACTS, dim, joints, 1.0);
        gen_seed(&random, seed + 1000);
        speed = close_up(&p, &random, closing, blocks);
        assert_int_equal(hand_solve(&p, context, NULL), PERP_OK);
        if (speed < 0.0) {
            if (p.result.outcome != PERP_OUTCOME_RAY)
                fail_msg("seed %d: %s, residual %g", (int)seed, perp_outcome_text(p.result.outcome),
                         p.result.residual);
            assert_int_equal(p.result.certificate, PERP_CONTACT_CERTIFICATE_INFEASIBLE);
            assert_int_equal(p.result.has_ray, 1);
            require_proof(&p);
        } else {
            assert_int_equal(p.result.has_ray, 0);
            assert_int_equal(p.result.certificate, PERP_CONTACT_CERTIFICATE_NONE);
            assert_true(p.result.outcome <= PERP_OUTCOME_ROUNDING_LIMIT);
        }
    }
}

/* The same by the other entrance, W as a caller would form it. */
static void test_delassus(void **state)
{
    uint64_t seed;

    (void)state;
    for (seed = 0; seed < 12; seed++) {
        double W[4 * 4] = {0.0}, q[4] = {-1, -1, -1, 0.5}, H[4][3];
        const double weights[3] = {1.0 / 3, 0.7, 1.1};
        perp_contact_result result = fresh_contact_result();
        perp_contact_laws laws = fresh_contact_laws();
        gen_random random;
        perp_matrix view = fresh_matrix();
        double r[4], ray[4];
        int32_t i, j, k;

        gen_seed(&random, seed);
        for (k = 0; k < 3; k++) {
            for (i = 0; i < 4; i++)
                H[i][k] = gen_normal(&random);
            H[2][k] = -(weights[0] * H[0][k] + weights[1] * H[1][k]) / weights[2];
        }
        for (i = 0; i < 4; i++)
            for (j = 0; j < 4; j++)
                for (k = 0; k < 3; k++)
                    W[i + 4 * j] += H[i][k] * H[j][k];
        laws.contacts = 4;
        laws.dim = 1;
        assert_int_equal(perp_matrix_dense(&view, PERP_STORAGE_COLUMN_MAJOR, 4, 4, W, 4), PERP_OK);
        assert_int_equal(perp_contact_solve(context, ANSWER(NULL, r, NULL, NULL, ray), &result,
                                            NULL, DELASSUS(&laws, &view, q), NULL),
                         PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_RAY);
        assert_int_equal(result.certificate, PERP_CONTACT_CERTIFICATE_INFEASIBLE);
        for (i = 0; i < 3; i++) /* largest entry 1 */
            assert_true(fabs(ray[i] - weights[i] / 1.1) <= 1e-12);
        assert_true(ray[3] == 0.0);
    }
}

/* A soft contact gives way: then there is a solution. */
static void test_compliance(void **state)
{
    const double W[4] = {1, -1, -1, 1}, q[2] = {-1, -1}, compliance[2] = {0.5, 0.5};
    perp_contact_result result = fresh_contact_result();
    perp_contact_laws laws = fresh_contact_laws();
    perp_matrix view = fresh_matrix();
    double r[2];

    (void)state;
    laws.contacts = 2;
    laws.dim = 1;
    laws.compliance = compliance;
    assert_int_equal(perp_matrix_dense(&view, PERP_STORAGE_COLUMN_MAJOR, 2, 2, W, 2), PERP_OK);
    assert_int_equal(perp_contact_solve(context, ANSWER(NULL, r), &result, NULL,
                                        DELASSUS(&laws, &view, q), NULL),
                     PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    assert_true(fabs(r[0] - 2.0) <= 1e-7 && fabs(r[1] - 2.0) <= 1e-7); /* 1 / compliance */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_closing_contacts),
        cmocka_unit_test(test_delassus),
        cmocka_unit_test(test_compliance),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
