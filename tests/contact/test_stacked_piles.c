/* Piles beside each other, in units of 2^-60 .. 2^60: hard ones, that take one method or another.
 * What each of them has by itself, it has in the stack. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

#include "piles.h"

enum { PARTS = 4 };

static int32_t solve(perp_context *context, const piles *p, double tol)
{
    const perp_contact_settings settings = piles_settings(PERP_CONTACT_METHOD_AUTO, tol);
    double *v = gen_allocate((size_t)p->n, sizeof *v),
           *r = gen_allocate((size_t)p->rows, sizeof *r);
    perp_contact_result result;

    assert_int_equal(piles_solve(context, p, &settings, &result, v, r, NULL, NULL), PERP_OK);
    free(v);
    free(r);
    return result.outcome == PERP_OUTCOME_SOLVED || result.outcome == PERP_OUTCOME_ROUNDING_LIMIT;
}

/* Room for all that is in the parts. */
static void make_room(piles *s, const piles *parts)
{
    size_t M = 0, H = 0;
    int32_t k;

    for (k = 0; k < PARTS; k++) {
        s->n += parts[k].n;
        s->rows += parts[k].rows;
        s->contacts += parts[k].contacts;
        M += (size_t)parts[k].M_starts[parts[k].n];
        H += (size_t)parts[k].H_starts[parts[k].n];
    }
    s->dims = gen_allocate((size_t)s->contacts, sizeof *s->dims);
    s->mu = gen_allocate((size_t)s->contacts, sizeof *s->mu);
    s->f = gen_allocate((size_t)s->n, sizeof *s->f);
    s->w = gen_allocate((size_t)s->rows, sizeof *s->w);
    s->M_starts = gen_allocate((size_t)s->n + 1, sizeof *s->M_starts);
    s->H_starts = gen_allocate((size_t)s->n + 1, sizeof *s->H_starts);
    s->M_rows = gen_allocate(M, sizeof *s->M_rows);
    s->H_rows = gen_allocate(H, sizeof *s->H_rows);
    s->M_values = gen_allocate(M, sizeof *s->M_values);
    s->H_values = gen_allocate(H, sizeof *s->H_values);
}

/* Behind the last part: column by column, with row numbers from `rows` on. */
static void append(int32_t *starts, int32_t *to_rows, double *to, int32_t columns, int32_t rows,
                   double factor, const piles *p, int32_t which)
{
    const int32_t *from_starts = which ? p->H_starts : p->M_starts;
    const int32_t *from_rows = which ? p->H_rows : p->M_rows;
    const double *from = which ? p->H_values : p->M_values;
    const int32_t at = starts[columns];
    int32_t i;

    for (i = 0; i <= p->n; i++)
        starts[columns + i] = at + from_starts[i];
    for (i = 0; i < from_starts[p->n]; i++) {
        to_rows[at + i] = rows + from_rows[i];
        to[at + i] = from[i] * factor;
    }
}

static void stack(piles *s, const piles *parts, uint64_t seed)
{
    int32_t n = 0, rows = 0, contacts = 0, k, i;

    memset(s, 0, sizeof *s);
    make_room(s, parts);
    s->M_starts[0] = s->H_starts[0] = 0;
    for (k = 0; k < PARTS; k++) {
        const piles *p = &parts[k];
        const double speed = ldexp(1.0, (int)(seed * 37 + (uint64_t)k * 61) % 120 - 60);
        const double mass = ldexp(1.0, (int)(seed * 53 + (uint64_t)k * 29) % 120 - 60);

        append(s->M_starts, s->M_rows, s->M_values, n, n, mass, p, 0);
        append(s->H_starts, s->H_rows, s->H_values, n, rows, 1.0, p, 1);
        for (i = 0; i < p->n; i++)
            s->f[n++] = p->f[i] * speed * mass;
        for (i = 0; i < p->rows; i++)
            s->w[rows++] = p->w[i] * speed;
        for (i = 0; i < p->contacts; i++) {
            s->dims[contacts] = p->dims[i];
            s->mu[contacts++] = p->mu[i];
        }
    }
    s->M = matrix_csc(n, n, s->M_starts, s->M_rows, s->M_values);
    s->H = matrix_csc(rows, n, s->H_starts, s->H_rows, s->H_values);
}

static void test_as_good_as_alone(void **state)
{
    static const uint64_t seeds[] = {11, 17, 56};
    const double tol = 1e-10;
    perp_context *context = NULL;
    size_t i;

    (void)state;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    for (i = 0; i < sizeof seeds / sizeof *seeds; i++) {
        piles parts[PARTS], s;
        int32_t k;

        for (k = 0; k < PARTS; k++) {
            const piles_options o = piles_draw(seeds[i] * PARTS + (uint64_t)k,
                                               4 + (int32_t)(seeds[i] * 7 + (uint64_t)k * 5) % 17);

            piles_make(&parts[k], &o);
            assert_true(solve(context, &parts[k], tol));
        }
        stack(&s, parts, seeds[i]);
        assert_true(solve(context, &s, tol));
        piles_destroy(&s);
        for (k = 0; k < PARTS; k++)
            piles_destroy(&parts[k]);
    }
    perp_context_destroy(context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_as_good_as_alone),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
