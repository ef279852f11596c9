/* Contact problems that an earlier version failed on: with a ray that does not exist, at a limit,
 * or with a backward error above 4 units. Small ones are files in tests/regressions, so that they
 * stay what they are whatever becomes of the generator; the others are made from a seed.
 *
 * A file has a line of origin that begins with #, then lines 'n COUNT', 'q I VALUE' and 'M I J
 * VALUE', values in hexadecimal; what is not named is 0. */
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "run.h"
#include "scene.h"

static const char *const files[] = {
    "scene_58.txt",   /* tested residual 1e-6: another basis reaches 1e-11 */
    "scene_105.txt",  /* false ray: pivots of 1e-23 in the basis */
    "scene_117.txt",  /* false rays in double whatever the covering vector */
    "scene_156.txt",  /* 3400 pivots, at last on rounding */
    "scene_1005.txt", /* 5800 pivots around one vertex */
};

/* Of SCENE_VERSION 1. */
static const uint64_t seeds[] = {
    /* rays and limits in double, from bases of condition 1e12 */
    55, 114, 118, 161, 177, 202, 236, 278, 316, 384, 417, 419, 511, 540, 648, 698, 699, 758, 787,
    819, 829, 837, 872, 878, 885, 886, 891, 1044, 1071, 1119, 1138,
    /* solved by the residual, but rows off by more than their rounding */
    38, 181, 184, 422, 467, 539, 668, 695, 730, 1014, 1070, 1160,
    /* rows scaled by 1e-6 .. 1e6 */
    28, 31, 63, 85, 94};

static perp_context *context;

static int make(void **state)
{
    (void)state;
    assert_int_equal(SCENE_VERSION, 1); /* else the seeds above are other problems */
    return perp_context_create(&context, NULL);
}

static int destroy(void **state)
{
    (void)state;
    perp_context_destroy(context);
    return 0;
}

static void require_exact(const gen_lcp *problem, int32_t method, const char *where)
{
    perp_lcp_settings settings = run_settings(method);
    run r;

    run_lcp(&r, context, problem, &settings, NULL, where);
    /* 4 units: the bound on what a solution that counts may be off, row by row */
    if (!run_ok(&r) || !(r.result.backward_error <= 4 * 0x1p-52))
        fail_msg("%s, %s: %s, residual %g, backward error %g", where, perp_lcp_method_text(method),
                 perp_outcome_text(r.result.outcome), r.result.residual, r.result.backward_error);
    run_release(&r);
}

/* The number at *text, which moves behind it. */
static double read_number(const char **text, const char *where)
{
    char *end;
    double value = strtod(*text, &end);

    if (end == *text)
        fail_msg("%s: no number in '%s'", where, *text);
    *text = end;
    return value;
}

static void read_line(gen_lcp *problem, const char *line, const char *where)
{
    const char *rest = line + 1;
    int32_t i, j;

    if (line[0] == '#')
        return;
    i = (int32_t)read_number(&rest, where);
    if (line[0] == 'n') {
        gen_begin_dense(problem, i);
        return;
    }
    assert_true(i >= 0 && i < problem->n);
    if (line[0] == 'q') {
        problem->q[i] = read_number(&rest, where);
        return;
    }
    assert_int_equal(line[0], 'M');
    j = (int32_t)read_number(&rest, where);
    assert_true(j >= 0 && j < problem->n);
    problem->M[i * problem->n + j] = read_number(&rest, where);
}

static void read_problem(gen_lcp *problem, const char *name)
{
    char path[512], line[256];
    FILE *file;

    snprintf(path, sizeof path, "%s/%s", PERP_TEST_REGRESSIONS, name);
    file = fopen(path, "r");
    if (!file)
        fail_msg("%s: %s", path, strerror(errno));
    memset(problem, 0, sizeof *problem);
    while (fgets(line, sizeof line, file))
        read_line(problem, line, name);
    fclose(file);
    assert_true(problem->n > 0);
}

static void test_files(void **state)
{
    size_t k;

    (void)state;
    for (k = 0; k < sizeof files / sizeof *files; k++) {
        gen_lcp problem;

        read_problem(&problem, files[k]);
        require_exact(&problem, PERP_LCP_LEMKE, files[k]);
        require_exact(&problem, PERP_LCP_AUTO, files[k]);
        gen_destroy(&problem);
    }
}

/* The files hold what the generator makes from their seeds, but for the last digits of libm. */
static void test_files_are_scenes(void **state)
{
    static const uint64_t of_files[] = {58, 105, 117, 156, 1005};
    size_t k;
    int32_t i;

    (void)state;
    for (k = 0; k < sizeof files / sizeof *files; k++) {
        scene_options o = scene_draw(of_files[k]);
        gen_lcp problem, made;

        read_problem(&problem, files[k]);
        scene_lcp(&made, &o);
        assert_int_equal(problem.n, made.n);
        for (i = 0; i < made.n; i++) /* a few roundings in terms that may be a thousand times q */
            if (!(fabs(made.q[i] - problem.q[i]) <= 1e-10 * (1.0 + fabs(made.q[i]))))
                fail_msg("%s: q[%d] is %g, the generator makes %g", files[k], (int)i, problem.q[i],
                         made.q[i]);
        gen_destroy(&made);
        gen_destroy(&problem);
    }
}

static void test_seeds(void **state)
{
    size_t k;

    (void)state;
    for (k = 0; k < sizeof seeds / sizeof *seeds; k++) {
        scene_options o = scene_draw(seeds[k]);
        char where[64];
        gen_lcp problem;

        snprintf(where, sizeof where, "seed %d, %s", (int)seeds[k], scene_class_text(o.class));
        scene_lcp(&problem, &o);
        require_exact(&problem, k % 4 ? PERP_LCP_LEMKE : PERP_LCP_AUTO, where);
        gen_destroy(&problem);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_files),
        cmocka_unit_test(test_files_are_scenes),
        cmocka_unit_test(test_seeds),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
