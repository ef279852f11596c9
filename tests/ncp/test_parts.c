/* Systems that fall into independent parts, each in units of its own from 1e-30 to 1e30: the same
 * answers and the same verdicts as alone, and powers of two in the units change no bit. */
#include "problems.h"

#include <stdio.h>

#include "suite.h"

#include <stdlib.h>
#include <string.h>

#include "context.h"

enum { PARTS = 5, LARGEST_PART = 60, MOST = PARTS * LARGEST_PART };

/* Problems of the zoo one after the other, in other units: z = 2^a x, F = 2^b f. With `units`,
 * variable i of a single problem counts in 2^units[i] and its row in 2^-units[i]. */
typedef struct stack {
    zoo_problem *parts[PARTS];
    int32_t count, first[PARTS + 1];
    double z_unit[MOST], F_unit[MOST];
    double lower[MOST], upper[MOST], start[MOST];
    double z[LARGEST_PART], F[LARGEST_PART], J[LARGEST_PART * LARGEST_PART];
    int32_t column_starts[MOST + 1], rows[PARTS * LARGEST_PART * LARGEST_PART];
    int32_t sparse;
} stack;

static int32_t stack_function(double *F, const double *z, void *user)
{
    stack *s = user;

    for (int32_t p = 0; p < s->count; p++) {
        const int32_t n = s->parts[p]->n, at = s->first[p];

        for (int32_t i = 0; i < n; i++)
            s->z[i] = z[at + i] / s->z_unit[at + i];
        if (s->parts[p]->equations(s->parts[p], s->z, s->F, NULL) != 0)
            return 1;
        for (int32_t i = 0; i < n; i++)
            F[at + i] = s->F[i] * s->F_unit[at + i];
    }
    return 0;
}

/* Of a part, by columns; 0 off its pattern. */
static int32_t part_jacobian(stack *s, int32_t p)
{
    zoo_problem *part = s->parts[p];
    const int32_t n = part->n;
    double *values = s->J;
    double packed[LARGEST_PART * LARGEST_PART];

    if (!part->sparse)
        return zoo_jacobian_values(values, s->z, part);
    if (zoo_jacobian_values(packed, s->z, part) != 0)
        return 1;
    memset(values, 0, (size_t)(n * n) * sizeof *values);
    for (int32_t j = 0; j < n; j++)
        for (int32_t k = part->column_starts[j]; k < part->column_starts[j + 1]; k++)
            values[part->row_indices[k] + n * j] = packed[k];
    return 0;
}

static int32_t stack_jacobian(double *values, const double *z, void *user)
{
    stack *s = user;
    const int32_t all = s->first[s->count];

    if (!s->sparse)
        memset(values, 0, (size_t)(all * all) * sizeof *values);
    for (int32_t p = 0; p < s->count; p++) {
        const int32_t n = s->parts[p]->n, at = s->first[p];

        for (int32_t i = 0; i < n; i++)
            s->z[i] = z[at + i] / s->z_unit[at + i];
        if (part_jacobian(s, p) != 0)
            return 1;
        for (int32_t j = 0; j < n; j++)
            for (int32_t i = 0; i < n; i++)
                values[s->sparse ? s->column_starts[at + j] + i : at + i + all * (at + j)] =
                    s->J[i + n * j] * s->F_unit[at + i] / s->z_unit[at + j];
    }
    return 0;
}

/* The k-th start, as far as there are so many. */
static void pile(stack *s, zoo_problem *part, double z_unit, double F_unit, int32_t k)
{
    const int32_t at = s->first[s->count], n = part->n;

    s->parts[s->count++] = part;
    s->first[s->count] = at + n;
    for (int32_t i = 0; i < n; i++) {
        s->z_unit[at + i] = z_unit;
        s->F_unit[at + i] = F_unit;
        s->lower[at + i] = part->lower[i] * z_unit;
        s->upper[at + i] = part->upper[i] * z_unit;
        s->start[at + i] = part->starts[n * (k % part->start_count) + i] * z_unit;
        s->column_starts[at + i + 1] = s->column_starts[at + i] + n;
        for (int32_t j = 0; j < n; j++)
            s->rows[s->column_starts[at + i] + j] = at + j;
    }
}

static perp_ncp_result solve(stack *s, perp_ncp_settings settings, double *z)
{
    perp_ncp_problem problem = fresh_ncp_problem();
    perp_ncp_result result = fresh_ncp_result();

    problem.n = s->first[s->count];
    problem.function = stack_function;
    problem.jacobian = stack_jacobian;
    problem.lower = s->lower;
    problem.upper = s->upper;
    problem.user = s;
    if (s->sparse) {
        problem.storage = PERP_STORAGE_CSC;
        problem.column_starts = s->column_starts;
        problem.row_indices = s->rows;
    }
    assert_int_equal(perp_ncp_solve(context, z, NULL, &result, &settings, &problem, s->start),
                     PERP_OK);
    return result;
}

/* Any point will do, so that the start comes back with its numbers. */
static perp_ncp_result look(stack *s)
{
    static double z[MOST];
    perp_ncp_settings settings = fresh_ncp_settings();
    perp_ncp_result result;

    settings.tol = 1e300;
    settings.polish = 0;
    settings.method = PERP_NCP_FISCHER;
    result = solve(s, settings, z);
    for (int32_t i = 0; i < s->first[s->count]; i++)
        assert_true(z[i] == s->start[i] || s->start[i] < s->lower[i] || s->start[i] > s->upper[i]);
    return result;
}

static zoo_problem *zoo[100];
static const zoo_entry *entries[100];
static int32_t zoo_count;

static int make_zoo(void **state)
{
    int32_t count;
    const zoo_entry *table = zoo_table(&count);

    for (int32_t e = 0; e < count; e++) {
        zoo_problem *problem = zoo_create(&table[e], table[e].size);

        if (problem->n > LARGEST_PART) {
            zoo_destroy(problem);
            continue;
        }
        entries[zoo_count] = &table[e];
        zoo[zoo_count++] = problem;
    }
    return make(state);
}

static int destroy_zoo(void **state)
{
    for (int32_t e = 0; e < zoo_count; e++)
        zoo_destroy(zoo[e]);
    return destroy(state);
}

static int32_t pick(uint64_t *state, int32_t count)
{
    return (int32_t)(count * zoo_random(state));
}

/* 1e-30 .. 1e30 */
static double unit(uint64_t *state)
{
    return pow(10, 60 * zoo_random(state) - 30);
}

/* Moves a start off the point that the zoo states, within the bounds. */
static void shake(stack *s, int32_t p, uint64_t *state)
{
    for (int32_t i = s->first[p]; i < s->first[p + 1]; i++) {
        const double moved = s->start[i] * (0.5 + zoo_random(state));

        if (moved >= s->lower[i] && moved <= s->upper[i])
            s->start[i] = moved;
    }
}

/* The marks of a point are the worst of its parts' marks, bit for bit. */
static void the_whole_is_as_its_worst_part(void **state)
{
    static stack whole, alone;
    uint64_t random = 7;

    (void)state;
    for (int32_t repeat = 0; repeat < 200; repeat++) {
        double residual = 0, natural = 0, backward = 0;
        perp_ncp_result result;

        memset(&whole, 0, sizeof whole);
        whole.sparse = repeat % 2;
        for (int32_t p = 0; p < 2 + repeat % (PARTS - 1); p++) {
            const int32_t e = pick(&random, zoo_count), k = pick(&random, ZOO_STARTS);
            const int32_t n = zoo[e]->n;

            pile(&whole, zoo[e], unit(&random), unit(&random), k);
            shake(&whole, p, &random);
            memset(&alone, 0, sizeof alone);
            alone.sparse = whole.sparse;
            pile(&alone, zoo[e], whole.z_unit[whole.first[p]], whole.F_unit[whole.first[p]], k);
            memcpy(alone.start, whole.start + whole.first[p], (size_t)n * sizeof *alone.start);
            result = look(&alone);
            residual = fmax(residual, result.residual);
            natural = fmax(natural, result.natural_residual);
            backward = fmax(backward, result.backward_error);
        }
        result = look(&whole);
        assert_true(result.residual == residual);
        assert_true(result.natural_residual == natural);
        assert_true(result.backward_error == backward);
    }
}

/* Variable i in 2^k, its row in 2^-k: no bit of what has no dimension changes. The equilibration of
 * a Jacobian without any diagonal begins at its first row, in whatever unit that is: of those
 * problems only the ones whose units the couplings settle can be compared. */
static void units_change_no_bit(void **state)
{
    static stack plain, other;
    uint64_t random = 8;
    int32_t tested = 0;

    (void)state;
    for (int32_t e = 0; e < zoo_count; e++)
        for (int32_t k = 0; k < zoo[e]->start_count; k++) {
            perp_ncp_result a, b;

            if (strcmp(entries[e]->name, "hs29") == 0 || strcmp(entries[e]->name, "hs37") == 0)
                continue;
            memset(&plain, 0, sizeof plain);
            memset(&other, 0, sizeof other);
            pile(&plain, zoo[e], 1, 1, k);
            shake(&plain, 0, &random);
            pile(&other, zoo[e], 1, 1, k);
            for (int32_t i = 0; i < zoo[e]->n; i++) {
                const double u = ldexp(1, pick(&random, 121) - 60);

                other.z_unit[i] = u;
                other.F_unit[i] = 1 / u;
                other.lower[i] *= u;
                other.upper[i] *= u;
                other.start[i] = plain.start[i] * u;
            }
            a = look(&plain);
            b = look(&other);
            if (a.residual != b.residual || a.backward_error != b.backward_error)
                fail_msg("%s, start %d: %g and %g", entries[e]->name, (int)k, a.residual,
                         b.residual);
            tested++;
        }
    assert_true(tested > 100);
}

/* Found by restarts at random where at all: alone another stream of numbers is as lucky. */
static int32_t is_luck(const zoo_entry *entry)
{
    static const char *const names[] = {"choi", "hs66", "watson-4"};

    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        if (strcmp(entry->name, names[k]) == 0)
            return 1;
    return 0;
}

/* Whether each part of z has a small natural residual in the units of the zoo. */
static void check_parts(stack *s, const double *z)
{
    for (int32_t p = 0; p < s->count; p++) {
        zoo_problem *part = s->parts[p];
        double scale = part->scale, residual;

        for (int32_t i = 0; i < part->n; i++) {
            s->z[i] = fmin(fmax(z[s->first[p] + i] / s->z_unit[s->first[p] + i], part->lower[i]),
                           part->upper[i]);
            scale = fmax(scale, fabs(s->z[i])); /* a continuum may go on to large z */
        }
        assert_int_equal(part->equations(part, s->z, s->F, NULL), 0);
        residual = zoo_residual(part, s->z, s->F);
        /* tol = 1e-10 of the sizes of F's terms; those of the zoo are up to 1e3 times its scale */
        if (!(residual <= 1e-7 * scale))
            fail_msg("%s: residual %g beside %g", part->name, residual, scale);
    }
}

static void parts_are_solved_as_alone(void **state)
{
    static stack whole;
    static double z[MOST];
    uint64_t random = 9;

    (void)state;
    for (int32_t repeat = 0; repeat < 60; repeat++) {
        perp_ncp_result result;

        memset(&whole, 0, sizeof whole);
        whole.sparse = repeat % 2;
        while (whole.count < 2 + repeat % (PARTS - 1)) {
            const int32_t e = pick(&random, zoo_count);

            if (!is_luck(entries[e]))
                pile(&whole, zoo[e], unit(&random), unit(&random), pick(&random, ZOO_STARTS));
        }
        result = solve(&whole, fresh_ncp_settings(), z);
        if (result.outcome != PERP_OUTCOME_SOLVED && result.outcome != PERP_OUTCOME_ROUNDING_LIMIT)
            fail_msg("%d: %s, %g", (int)repeat, perp_outcome_text(result.outcome), result.residual);
        check_parts(&whole, z);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_whole_is_as_its_worst_part),
        cmocka_unit_test(units_change_no_bit),
        cmocka_unit_test(parts_are_solved_as_alone),
    };

    return cmocka_run_group_tests(tests, make_zoo, destroy_zoo);
}
