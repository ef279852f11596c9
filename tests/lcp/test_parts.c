/* A problem that falls into parts is solved and judged part by part: random problems on the
 * diagonal of one, each in units of its own, rows in any order, are good where each alone is, and
 * only there; and where one is proven to have no solution, so are all. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "run.h"

#include "context.h"

enum { PARTS = 5, MOST_PART = 12, MOST = PARTS * MOST_PART };

/* Variable i of part k is number at[k][i] of all. */
typedef struct stack {
    gen_lcp parts[PARTS], whole, sparse;
    int32_t count, at[PARTS][MOST_PART];
} stack;

/* Integers: full, few entries of -1..1, symmetric, skew but for the diagonal; q random or of a
 * complementary point. Many of these need the tree of index sets, many have no solution. */
static void make_integers(gen_lcp *part, gen_random *random, int32_t n)
{
    const int kind = gen_integer(random, 4), planted = gen_integer(random, 4) > 0;
    int M[MOST_PART * MOST_PART], q[MOST_PART], i, j;

    for (i = 0; i < n * n; i++)
        M[i] = kind == 1 ? (gen_integer(random, 5) - 2) / 2 : gen_integer(random, 7) - 3;
    for (i = 0; i < n && kind >= 2; i++)
        for (j = 0; j <= i; j++)
            M[i * n + j] =
                i == j && kind == 3 ? gen_integer(random, 2) : (kind == 3 ? -1 : 1) * M[j * n + i];
    for (i = 0; i < n; i++)
        q[i] = planted ? 0 : gen_integer(random, 7) - 3;
    for (j = 0; j < n && planted; j++) {
        const int at = gen_integer(random, 3), value = 1 + gen_integer(random, 3);

        q[j] += at == 1 ? value : 0;
        for (i = 0; i < n && at == 2; i++)
            q[i] -= M[i * n + j] * value;
    }
    gen_from_integers(part, n, M, q);
}

/* M 2^a, q 2^b and bounds 2^(b - a): 2^100 is about 1e30. */
static void change_units(gen_lcp *part, int32_t a, int32_t b)
{
    for (int32_t i = 0; i < part->n * part->n; i++)
        part->M[i] = ldexp(part->M[i], a);
    for (int32_t i = 0; i < part->n; i++) {
        part->q[i] = ldexp(part->q[i], b);
        if (part->lower)
            part->lower[i] = ldexp(part->lower[i], b - a);
        if (part->upper)
            part->upper[i] = ldexp(part->upper[i], b - a);
    }
}

static void assemble(stack *s)
{
    gen_lcp *whole = &s->whole;

    for (int32_t k = 0; k < s->count; k++) {
        const gen_lcp *part = &s->parts[k];

        for (int32_t i = 0; i < part->n; i++) {
            const int32_t to = s->at[k][i];

            for (int32_t j = 0; j < part->n; j++)
                whole->M[to * whole->n + s->at[k][j]] = part->M[i * part->n + j];
            whole->q[to] = part->q[i];
            whole->lower[to] = part->lower ? part->lower[i] : 0.0;
            whole->upper[to] = part->upper ? part->upper[i] : INFINITY;
        }
    }
    gen_to_csc(&s->sparse, whole);
}

static void make_stack(stack *s, gen_random *random)
{
    int32_t owner[MOST], placed[PARTS] = {0}, n = 0;

    memset(s, 0, sizeof *s);
    s->count = 2 + gen_integer(random, PARTS - 1);
    for (int32_t k = 0; k < s->count; k++) {
        const int32_t size = 1 + gen_integer(random, gen_integer(random, 2) ? 6 : MOST_PART);

        if (gen_integer(random, 3) == 0)
            gen_problem(&s->parts[k], random, size, gen_integer(random, GEN_CLASSES),
                        gen_integer(random, GEN_BOUNDS));
        else
            make_integers(&s->parts[k], random, size);
        change_units(&s->parts[k], gen_integer(random, 201) - 100, gen_integer(random, 201) - 100);
        for (int32_t i = 0; i < size; i++, n++) { /* the parts' rows are shuffled */
            const int32_t j = gen_integer(random, n + 1);

            owner[n] = owner[j];
            owner[j] = k;
        }
    }
    for (int32_t i = 0; i < n; i++)
        s->at[owner[i]][placed[owner[i]]++] = i;
    gen_begin_dense(&s->whole, n);
    s->whole.lower = gen_allocate((size_t)n, sizeof(double));
    s->whole.upper = gen_allocate((size_t)n, sizeof(double));
    assemble(s);
}

static void destroy_stack(stack *s)
{
    for (int32_t k = 0; k < s->count; k++)
        gen_destroy(&s->parts[k]);
    gen_destroy(&s->whole);
    gen_destroy(&s->sparse);
}

/* Counts the parts that are good alone, and those that are proven infeasible. The part of a good
 * whole solves the part. */
static void compare_parts(const stack *s, const run *whole, int32_t *good, int32_t *infeasible,
                          const char *where)
{
    *good = *infeasible = 0;
    for (int32_t k = 0; k < s->count; k++) {
        const gen_lcp *part = &s->parts[k];
        const check_lcp problem = {&part->view, part->q, part->lower, part->upper, 1};
        double z[MOST_PART];
        check_measures m;
        run alone;

        run_lcp(&alone, context, part, NULL, NULL, where);
        *good += run_ok(&alone);
        *infeasible += alone.result.certificate == PERP_CERTIFICATE_INFEASIBLE;
        run_release(&alone);
        for (int32_t i = 0; i < part->n; i++)
            z[i] = whole->z[s->at[k][i]];
        check_measure(&m, &problem, z, NULL);
        if (run_ok(whole) && !(m.residual <= 1e-10)) /* the default tol */
            fail_msg("%s: part %d of a good whole has the residual %g", where, (int)k, m.residual);
    }
}

/* STACKS in the environment asks for another number of problems. */
static void test_worst_of_the_parts(void **state)
{
    const char *wanted = getenv("STACKS");
    const long count = wanted ? atol(wanted) : 600;
    long tally[2] = {0, 0}, certified = 0;
    gen_random random;

    (void)state;
    gen_seed(&random, 81);
    for (long round = 0; round < count; round++) {
        const int in_csc = round % 2 == 1;
        int32_t good, infeasible;
        char where[48];
        stack s;
        run r;

        make_stack(&s, &random);
        snprintf(where, sizeof where, "round %ld, n = %d", round, (int)s.whole.n);
        run_view(&r, context, in_csc ? &s.sparse.view : &s.whole.view, s.whole.q, s.whole.lower,
                 s.whole.upper, NULL, NULL, where);
        compare_parts(&s, &r, &good, &infeasible, where);
        tally[good == s.count]++;
        certified += infeasible > 0;
        if (run_ok(&r) && good < s.count)
            fail_msg("%s: good, but only %d of %d parts are alone", where, (int)good, (int)s.count);
        if (!run_ok(&r) && good == s.count)
            fail_msg("%s: all parts are good alone; the whole is %s", where,
                     perp_outcome_text(r.result.outcome));
        if (infeasible > 0 && r.result.certificate != PERP_CERTIFICATE_INFEASIBLE)
            fail_msg("%s: a part is infeasible; the whole is %s", where,
                     perp_outcome_text(r.result.outcome));
        run_release(&r);
        destroy_stack(&s);
    }
    assert_true(tally[0] > count / 10 && tally[1] > count / 10 && certified > count / 20);
    if (wanted)
        print_message("%ld good, %ld not, %ld of these infeasible\n", tally[1], tally[0],
                      certified);
}

/* The budget is one for all parts. */
static void test_budget(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 82);
    for (int32_t round = 0; round < 300; round++) {
        perp_lcp_settings settings = run_settings(PERP_LCP_AUTO);
        stack s;
        run r;

        make_stack(&s, &random);
        settings.max_iterations = 1 + gen_integer(&random, 1 << gen_integer(&random, 12));
        run_view(&r, context, round % 2 ? &s.sparse.view : &s.whole.view, s.whole.q, s.whole.lower,
                 s.whole.upper, &settings, NULL, "budget");
        assert_true(r.result.iterations <= settings.max_iterations);
        run_release(&r);
        destroy_stack(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_worst_of_the_parts),
        cmocka_unit_test(test_budget),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
