/* The interior point that proximal starts from, alone: on piles of all kinds, at rest and pushed,
 * it comes to where the laws hold to 1e-4, by the test's own reckoning. */
#include "contact/proximal/proximal.h"
#include "sweep_fixture.h"

/* Runs it; the best point goes to f->r. Returns its factorisations. */
static int64_t run_interior(fixture *f)
{
    perp__arena arena;
    perp__proximal *s = gen_allocate(1, sizeof *s);
    double *omega = gen_allocate((size_t)f->problem.size, sizeof *omega), drive;
    int64_t steps;

    perp__contact_omegas(&f->problem, NULL, 1, &drive, omega);
    f->problem.omega = omega;
    s->common.problem = &f->problem;
    memset(&arena, 0, sizeof arena);
    assert_int_equal(perp__arena_fit(&arena, context, perp__proximal_layout, s), PERP_OK);
    assert_int_equal(perp__proximal_read(s), PERP_OK);
    s->limit = INT64_MAX;
    s->tol = f->problem.tol;
    s->best_residual = INFINITY;
    s->outcome = -1;
    perp__proximal_interior_run(s, &s->part[0]);
    for (int32_t k = 0; k < s->constraints; k++)
        for (int32_t i = s->starts[k]; i < s->starts[k + 1]; i++)
            f->r[f->starts[s->constraint[k]] + i - s->starts[k]] =
                s->best[i] * s->scale[i] * omega[s->constraint[k]];
    steps = s->factorisations;
    perp__fronts_release(&s->fronts);
    perp__arena_release(&arena);
    free(omega);
    free(s);
    return steps;
}

static void test_piles(void **state)
{
    (void)state;
    for (int class = 0; class < PILES_CLASSES; class ++)
        for (int motion = PILES_REST; motion <= PILES_PUSH; motion++) {
            piles_options options = piles_defaults();
            fixture f;
            int64_t steps;
            double error, most;

            options.class = class;
            options.contacts = 60;
            options.mu = 0.5;
            options.motion = motion;
            begin(&f, &options);
            steps = run_interior(&f);
            error = law(&f);
            /* to 1e-4 of the drive: from there Newton's method knows the active set; the way to
               where pushed balls come to rest has folds, and ends at one. Interior points take tens
               of steps */
            most = class == PILES_BALLS && motion == PILES_PUSH ? 1e-2 : 1e-4;
            if (!(error <= most && steps < 60))
                fail_msg("class %d, motion %d: %g after %d steps", class, motion, error,
                         (int)steps);
            end(&f);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_piles),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
