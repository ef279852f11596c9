/* What the front door adds to every method: Newton's method on the equations of one active set; the
 * polyhedra that fit ever closer; and that threads share nothing. */
#include "suite.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include <perp/perp.h>

#include "check.h"
#include "piles.h"

typedef struct answer {
    double *v, *r;
    perp_contact_result result;
} answer;

static void make_answer(answer *a, const piles *p)
{
    a->v = check_allocate((size_t)p->n, sizeof(double));
    a->r = check_allocate((size_t)p->rows, sizeof(double));
}

static void free_answer(answer *a)
{
    free(a->v);
    free(a->r);
}

static perp_status solve(perp_context *context, const piles *p, answer *a, int32_t method,
                         int32_t iterations, const double *r0)
{
    perp_contact_settings settings = piles_settings(method, 1e-12);

    settings.max_iterations = iterations;
    return piles_solve(context, p, &settings, &a->result, a->v, a->r, NULL, r0);
}

static int is_good(const answer *a)
{
    return a->result.outcome == PERP_OUTCOME_SOLVED ||
           a->result.outcome == PERP_OUTCOME_ROUNDING_LIMIT;
}

static piles_options pushed_wall(void)
{
    piles_options o = piles_defaults();

    o.class = PILES_WALL;
    o.contacts = 20;
    o.motion = PILES_IMPACT;
    return o;
}

/* A start 1e-6 off and six sweeps leave 1e-8 or so: the rest of the digits are the polish's,
 * which the limit of six grants as many steps. Which solution it ends in is left open, contacts
 * being redundant. */
static void test_last_digits(void **state)
{
    perp_context *context = NULL;
    uint64_t seed;

    (void)state;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    for (seed = 1; seed <= 10; seed++) {
        piles_options o = pushed_wall();
        gen_random random;
        answer known, found;
        piles p;
        int32_t i;

        o.seed = seed;
        piles_make(&p, &o);
        make_answer(&known, &p);
        make_answer(&found, &p);
        assert_int_equal(solve(context, &p, &known, PERP_CONTACT_METHOD_PROXIMAL, 0, NULL),
                         PERP_OK);
        assert_true(is_good(&known));
        gen_seed(&random, seed);
        for (i = 0; i < p.rows; i++)
            found.r[i] = known.r[i] * (1.0 + 1e-6 * gen_normal(&random));
        assert_int_equal(solve(context, &p, &found, PERP_CONTACT_METHOD_SWEEP, 6, found.r),
                         PERP_OK);
        assert_true(is_good(&found));
        assert_true(found.result.residual <= 1e-12);
        free_answer(&known);
        free_answer(&found);
        piles_destroy(&p);
    }
    perp_context_destroy(context);
}

/* Pivoting alone leaves the error of its polyhedra; closer ones and the polish end at 1e-12. */
static void test_pivoting_ends_on_the_cone(void **state)
{
    perp_context *context = NULL;
    uint64_t seed;

    (void)state;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    for (seed = 1; seed <= 10; seed++) {
        piles_options o = pushed_wall();
        answer a;
        piles p;

        o.seed = seed;
        o.mass_ratio = seed % 2 ? 1.0 : 1e4;
        piles_make(&p, &o);
        make_answer(&a, &p);
        assert_int_equal(solve(context, &p, &a, PERP_CONTACT_METHOD_LEMKE, 0, NULL), PERP_OK);
        assert_true(is_good(&a));
        free_answer(&a);
        piles_destroy(&p);
    }
    perp_context_destroy(context);
}

typedef struct work {
    const piles *problem;
    answer answer;
    perp_status status;
} work;

static void *run(void *argument)
{
    work *w = argument;
    perp_context *context = NULL;

    w->status = perp_context_create(&context, NULL);
    if (w->status == PERP_OK)
        w->status = solve(context, w->problem, &w->answer, PERP_CONTACT_METHOD_AUTO, 0, NULL);
    perp_context_destroy(context);
    return NULL;
}

static void test_threads_change_no_bit(void **state)
{
    enum { THREADS = 4 };
    piles_options o = pushed_wall();
    pthread_t threads[THREADS];
    work works[THREADS];
    piles p;
    int k;

    (void)state;
    piles_make(&p, &o);
    for (k = 0; k < THREADS; k++) {
        works[k].problem = &p;
        make_answer(&works[k].answer, &p);
    }
    run(&works[0]);
    for (k = 1; k < THREADS; k++)
        assert_int_equal(pthread_create(&threads[k], NULL, run, &works[k]), 0);
    for (k = 1; k < THREADS; k++)
        assert_int_equal(pthread_join(threads[k], NULL), 0);
    for (k = 0; k < THREADS; k++) {
        assert_int_equal(works[k].status, PERP_OK);
        assert_memory_equal(works[k].answer.r, works[0].answer.r, (size_t)p.rows * sizeof(double));
        assert_memory_equal(works[k].answer.v, works[0].answer.v, (size_t)p.n * sizeof(double));
    }
    for (k = 0; k < THREADS; k++)
        free_answer(&works[k].answer);
    piles_destroy(&p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_last_digits),
                                       cmocka_unit_test(test_pivoting_ends_on_the_cone),
                                       cmocka_unit_test(test_threads_change_no_bit)};

    return cmocka_run_group_tests(tests, NULL, NULL);
}
