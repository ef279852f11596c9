/* The stepper at its extremes: a table of what holds, and where the result says that it does not.
 *
 *     build/tests/extremes/test_world_extremes table      prints it (make extremes)
 *
 * Each row runs a scene of extreme_scenes.h, whose answer is known in closed form, over a range of
 * values and takes the worst error. Up to `bound` it holds; beyond it is wrong, unless the result
 * said that it was (an outcome that is not good, or a refusal). The committed table,
 * bench/results/extremes.txt, has to have the same rows, verdicts and outcomes.
 * PERP_EXTREMES_LONG=1 takes the hour's steps that are skipped otherwise. */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

#include "check.h"
#include "extreme_scenes.h"

enum { MANY = 1000000 };

/* Sizes */

static double size_stack(double size)
{
    return extreme_stacks_move((extreme_stack){
        .count = 5, .number = 300, .side = size, .g = 9.81, .h = 0.01 * sqrt(size)});
}

static double size_slide(double size)
{
    return extreme_slide_off(&(extreme_slide){.planar = 0,
                                              .size = size,
                                              .mu = 0.5,
                                              .g = 9.81,
                                              .v = 3 * sqrt(size),
                                              .h = 0.01 * sqrt(size)},
                             1.0);
}

/* Steps */

static double step_stack(double h)
{
    return extreme_stacks_move(
        (extreme_stack){.count = 5, .number = 300, .side = 0.3, .g = 9.81, .h = h});
}

static double step_slide(double h)
{
    extreme_slide a = {.size = 0, .mu = 0.5, .g = 9.81, .v = 1, .h = h};
    double way = a.v * a.v / (2 * a.mu * a.g), brake = a.mu * a.g * h * h / 8;

    /* what is off beside a h^2 / 8, rounding of as many sums left out */
    return extreme_slide_off(&a, 0.0) * way / (brake + way * 16 * DBL_EPSILON * (2 + 0.2 / h));
}

/* Friction */

static double friction_threshold(double mu)
{
    return extreme_threshold_off(mu, 9.81);
}

static double friction_slide(double mu)
{
    double v = sqrt(2 * mu * 9.81);

    return extreme_slide_off(
        &(extreme_slide){.size = 0, .mu = mu, .g = 9.81, .v = v, .h = v / (mu * 9.81) / 64.5}, 1.0);
}

static double friction_none(double mu)
{
    (void)mu;
    return extreme_slides_on(3.0);
}

/* Masses */

static double mass_tower(double ratio)
{
    return extreme_tower_moves(ratio, 0);
}

static double mass_top(double ratio)
{
    return extreme_tower_moves(ratio, 1);
}

/* Speeds */

static double speed_spin(double omega)
{
    return extreme_spin_off(omega, 0.01, 1000);
}

/* Gravity */

static double gravity_stack(double g)
{
    return extreme_stacks_move(
        (extreme_stack){.count = 5, .number = 300, .side = 0.3, .g = g, .h = 0.01});
}

static double gravity_slide(double g)
{
    return extreme_slide_off(
        &(extreme_slide){.size = 1, .mu = 0.5, .g = g, .v = sqrt(g), .h = 0.01 / sqrt(g)}, 1.0);
}

static double gravity_threshold(double g)
{
    return extreme_threshold_off(0.5, g);
}

/* Places */

static double place_stack(double at)
{
    return extreme_stacks_move(
        (extreme_stack){.count = 5, .number = 300, .side = 0.3, .g = 9.81, .h = 0.01, .at = at});
}

static double place_slide(double at)
{
    return extreme_slide_off(
        &(extreme_slide){.size = 0.3, .mu = 0.5, .g = 9.81, .v = 3, .h = 0.01, .at = at}, 1.0);
}

/* Long runs */

static int whole(void)
{
    const char *text = getenv("PERP_EXTREMES_LONG");

    return text && *text && *text != '0';
}

static double long_stack(double number)
{
    return extreme_stack_moves(&(extreme_stack){.planar = 1,
                                                .accuracy = PERP_ACCURACY_STANDARD,
                                                .wakeful = 1,
                                                .count = 3,
                                                .number = (int)number,
                                                .side = 0.3,
                                                .g = 9.81,
                                                .h = 0.01});
}

static double long_spin(double number)
{
    return extreme_spin_off(1.0, 0.01, (int)number);
}

static double hour_stack(double number)
{
    extreme_stack a = {.count = 20, .side = 0.3, .g = 9.81, .h = 0.01, .number = (int)number};

    a.wakeful = whole();
    return extreme_stacks_move(a);
}

static double awake_stack(double number)
{
    return extreme_stacks_move((extreme_stack){.count = 20,
                                               .side = 0.3,
                                               .g = 9.81,
                                               .h = 0.01,
                                               .wakeful = 1,
                                               .accuracy = PERP_ACCURACY_STANDARD,
                                               .number = (int)number});
}

/* Beyond: a number, or a refusal; a good outcome has finite states. */
static double beyond_size(double size)
{
    double worst = size_stack(size);

    return extreme_said.refused || isfinite(worst) ? 0.0 : 1.0;
}

typedef struct row {
    const char *extreme, *scene, *promise;
    double (*measure)(double value);
    double bound;
    double values[8];
    const char *range;
} row;

/* clang-format off */
static const row rows[] = {
    {"sizes", "heap of 9, bits", "those of size 1", extreme_bits_differ, 0,
     {-15, -14, -7, -1, 1, 7, 14, 15}, "4^-15 .. 4^15"},
    {"sizes", "stack of 5", "moves by rounding", size_stack, 1e-15,
     {1e-9, 1e-6, 1e-3, 1, 1e3, 1e6, 1e9}, "1e-9 .. 1e9 m"},
    {"sizes", "box slides to its stop", "v^2/(2 mu g)", size_slide, 1e-3,
     {1e-9, 1e-6, 1e-3, 1, 1e3, 1e6, 1e9}, "1e-9 .. 1e9 m"},
    {"steps", "stack of 5", "moves by rounding", step_stack, 1e-15,
     {1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1}, "1e-6 .. 1 s"},
    {"steps", "point slides to its stop", "off by a h^2/8", step_slide, 1,
     {1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1}, "1e-6 .. 1 s"},
    {"steps", "ball bounces, e = 1/2", "on its parabola", extreme_bounce_off, 1e-9,
     {1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1}, "1e-6 .. 1 s"},
    {"friction", "box slides without", "velocity kept, bits", friction_none, 0,
     {1}, "0"},
    {"friction", "point pushed by 1 -+ 1e-9", "rests, moves", friction_threshold, 1e-5,
     {1e-6, 1e-4, 1e-2, 1, 1e2, 1e4, 1e6}, "1e-6 .. 1e6"},
    {"friction", "point slides to its stop", "v^2/(2 mu g)", friction_slide, 1e-3,
     {1e-6, 1e-4, 1e-2, 1, 1e2, 1e4, 1e6}, "1e-6 .. 1e6"},
    {"masses", "one box on another", "rest, load carried", extreme_load_off, 1e-12,
     {1e2, 1e4, 1e6, 1e8, 1e10, 1e12}, "1e2 .. 1e12"},
    {"masses", "tower of 10, in turn", "rests", mass_tower, 0,
     {1e2, 1e4, 1e6, 1e8, 1e10, 1e12}, "1e2 .. 1e12"},
    {"masses", "tower of 10 under one", "rests", mass_top, 0,
     {1e2, 1e4, 1e6, 1e8, 1e10, 1e12}, "1e2 .. 1e12"},
    {"masses", "ball hits ball, e = 1", "closed form", extreme_hit_off, 1e-12,
     {1e2, 1e4, 1e6, 1e8, 1e10, 1e12}, "1e2 .. 1e12"},
    {"speeds", "ball and box at thin plate", "stopped before it", extreme_plate_passed, 1e-8,
     {1, 10, 1e2, 1e3, 1e4, 1e5, 1e6}, "1 .. 1e6 sizes/s"},
    {"speeds", "box slides without friction", "velocity kept, bits", extreme_slides_on, 0,
     {1, 10, 1e2, 1e3, 1e4, 1e5, 1e6}, "1 .. 1e6 sizes/s"},
    {"speeds", "free spin", "energy, momentum kept", speed_spin, 1e-12,
     {1, 10, 1e2, 1e3, 1e4, 1e5, 1e6}, "1 .. 1e6 rad/s"},
    {"gravity", "stack of 5", "moves by rounding", gravity_stack, 1e-15,
     {1e-12, 1e-9, 1e-6, 1e-3}, "1e-12 .. 1e-3"},
    {"gravity", "point pushed by 1 -+ 1e-9", "rests, moves", gravity_threshold, 1e-5,
     {1e-12, 1e-9, 1e-6, 1e-3}, "1e-12 .. 1e-3"},
    {"gravity", "box slides to its stop", "v^2/(2 mu g)", gravity_slide, 1e-3,
     {1e-12, 1e-9, 1e-6, 1e-3}, "1e-12 .. 1e-3"},
    {"places", "stack of 5", "moves by rounding", place_stack, 1e-15,
     {1e2, 1e4, 1e6, 1e8}, "1e2 .. 1e8 m"},
    {"places", "box slides to its stop", "v^2/(2 mu g)", place_slide, 1e-3,
     {1e2, 1e4, 1e6, 1e8}, "1e2 .. 1e8 m"},
    {"long", "stack of 3, nothing skipped", "moves by rounding", long_stack, 1e-15,
     {MANY}, "1e6 steps"},
    {"long", "free spin", "energy, momentum kept", long_spin, 1e-9,
     {MANY}, "1e6 steps"},
    {"long", "ball bounces, e = 1", "energy kept", extreme_energy_lost, 1e-3,
     {MANY}, "1e6 steps"},
    {"long", "stack of 20, nothing skipped", "moves by rounding", awake_stack, 1e-15,
     {1000}, "10 s"},
    {"long", "stack of 20", "moves by rounding", hour_stack, 1e-15,
     {360000}, "an hour"},
    {"beyond", "stack of 5", "no number is NaN", beyond_size, 0,
     {1e-300, 1e-200, 1e-100, 1e100, 1e200, 1e300}, "1e-300 .. 1e300 m"},
};
/* clang-format on */

enum { ROWS = sizeof rows / sizeof rows[0], WIDE = 240 };

static int good(void)
{
    const unsigned good_ones = 1u << PERP_OUTCOME_SOLVED | 1u << PERP_OUTCOME_ROUNDING_LIMIT;

    return !extreme_said.refused && !(extreme_said.outcomes & ~good_ones);
}

static void outcomes_of(char *text, size_t size)
{
    size_t used = 0;
    unsigned k;

    text[0] = '\0';
    for (k = 0; k < 32; k++)
        if (extreme_said.outcomes >> k & 1u)
            used += (size_t)snprintf(text + used, size - used, "%s%s", used ? ", " : "",
                                     perp_outcome_text((int32_t)k));
    if (extreme_said.refused)
        snprintf(text + used, size - used, "%srefused", used ? ", " : "");
}

/* One line; what follows the last '|' is measured and may differ from machine to machine. */
static const char *run_row(char *line, const row *r)
{
    double worst = 0.0;
    const char *verdict;
    char outcomes[100];
    int i;

    extreme_said.outcomes = 0;
    extreme_said.refused = 0;
    for (i = 0; i < 8 && r->values[i] != 0.0; i++)
        check_raise(&worst, r->measure(r->values[i]));
    if (worst <= r->bound)
        verdict = "holds";
    else
        verdict = good() ? "WRONG" : "says so";
    outcomes_of(outcomes, sizeof outcomes);
    snprintf(line, WIDE, "%-8s  %-17s  %-28s  %-21s  %6.0e  %-8s  %s | %.1e", r->extreme, r->range,
             r->scene, r->promise, r->bound, verdict, outcomes, worst);
    return verdict;
}

static void test_row(void **state)
{
    const row *r = *state;
    char line[WIDE], kept[WIDE];
    FILE *file;
    int found = 0;

    if (!strcmp(run_row(line, r), "WRONG"))
        fail_msg("%s", line);
    *strrchr(line, '|') = '\0';
    file = fopen(PERP_TEST_TABLES "/extremes.txt", "r");
    assert_non_null(file);
    while (!found && fgets(kept, sizeof kept, file))
        found = !strncmp(kept, line, strlen(line));
    fclose(file);
    if (!found)
        fail_msg("bench/results/extremes.txt (make extremes) has not: %s", line);
}

static int print_table(void)
{
    int k, wrong = 0;

    printf(
        "The stepper at its extremes (make extremes; tests/extremes/test_world_extremes.c).\n\n"
        "Each row is a scene whose answer is known, run over a range of values: the worst error\n"
        "(behind the last |, of the machine that wrote this) beside what is promised. 'holds' is\n"
        "within the promise, 'says so' is wrong with an outcome that says it. Stacks: all\n"
        "accuracies, plane and space. Errors are relative.\n\n"
        "%-8s  %-17s  %-28s  %-21s  %6s  %-8s  %s\n",
        "", "values", "scene", "promise", "bound", "verdict", "outcomes | error");
    for (k = 0; k < ROWS; k++) {
        char line[WIDE];

        wrong += !strcmp(run_row(line, &rows[k]), "WRONG");
        printf("%s\n", line);
        fflush(stdout);
    }
    return wrong > 0;
}

int main(int argc, char **argv)
{
    struct CMUnitTest tests[ROWS];
    char names[ROWS][100];
    int k;

    if (argc > 1 && !strcmp(argv[1], "table"))
        return print_table();
    for (k = 0; k < ROWS; k++) {
        snprintf(names[k], sizeof names[k], "%s: %s", rows[k].extreme, rows[k].scene);
        tests[k] = (struct CMUnitTest){names[k], test_row, NULL, NULL, (void *)&rows[k]};
    }
    return cmocka_run_group_tests_name("world extremes", tests, NULL, NULL);
}
