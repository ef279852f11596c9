/* Systems that fall into independent parts, each in units of its own from 1e-30 to 1e30: the same
 * answers and the same verdicts as alone, and powers of two in the units change no bit. */
#include "problems.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

#include <stdlib.h>
#include <string.h>

enum { PARTS = 5, LARGEST_PART = 60, MOST = PARTS * LARGEST_PART };

static perp_context *context;

static int make(void **state)
{
    (void)state;
    return perp_context_create(&context, NULL);
}

static int destroy(void **state)
{
    (void)state;
    perp_context_destroy(context);
    return 0;
}

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

static perp_ncp_result solve(stack *s, int32_t method, double *z)
{
    perp_ncp_problem problem;
    perp_ncp_settings settings;
    perp_ncp_result result;

    assert_int_equal(perp_ncp_problem_init(&problem, sizeof problem), PERP_OK);
    assert_int_equal(perp_ncp_settings_init(&settings, sizeof settings), PERP_OK);
    assert_int_equal(perp_ncp_result_init(&result, sizeof result), PERP_OK);
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
    settings.method = method;
    assert_int_equal(perp_ncp_solve(context, z, NULL, &result, &settings, &problem, s->start),
                     PERP_OK);
    return result;
}
int main(void)
{
    int32_t count; const zoo_entry *table = zoo_table(&count);
    uint64_t state = 99; static stack s, alone; static double z[MOST], za[MOST];
    make(NULL);
    zoo_problem *zoo[100]; int m = 0;
    for (int e = 0; e < count; e++) { zoo_problem *p = zoo_create(&table[e], table[e].size); if (p->n <= LARGEST_PART) zoo[m++] = p; }
    printf("%d problems\n", m);
    /* units change no bit */
    for (int e = 0; e < m; e++) for (int k = 0; k < zoo[e]->start_count; k++) for (int u = 0; u < 3; u++) {
        memset(&alone, 0, sizeof alone); memset(&s, 0, sizeof s);
        pile(&alone, zoo[e], 1, 1, k);
        pile(&s, zoo[e], u == 2 ? 1 : ldexp(1, (int)(200 * zoo_random(&state)) - 100), u == 2 ? 1 : ldexp(1, (int)(200 * zoo_random(&state)) - 100), k);
        if (u == 2) for (int i = 0; i < zoo[e]->n; i++) { int b = (int)(80 * zoo_random(&state)) - 40; s.z_unit[i] = ldexp(1, b); s.F_unit[i] = ldexp(1, -b); s.lower[i] *= s.z_unit[i]; s.upper[i] *= s.z_unit[i]; s.start[i] *= s.z_unit[i]; }
        perp_ncp_result a = solve(&alone, 0, za), b = solve(&s, 0, z);
        if (a.outcome != b.outcome || a.residual != b.residual) printf("%s %d u%d: %s %g it %d; %s %g it %d\n", zoo[e]->name, k, u, perp_outcome_text(a.outcome), a.residual, (int)a.iterations, perp_outcome_text(b.outcome), b.residual, (int)b.iterations);
    }
    int bad = 0, same = 0;
    for (int r = 0; r < 300; r++) {
        int worst = 0, it = 0; char names[200] = "";
        memset(&s, 0, sizeof s); s.sparse = r % 2;
        for (int p = 0; p < 2 + r % 4; p++) {
            int e = (int)(m * zoo_random(&state)), k = (int)(8 * zoo_random(&state));
            pile(&s, zoo[e], pow(10, 60 * zoo_random(&state) - 30), pow(10, 60 * zoo_random(&state) - 30), k);
            memset(&alone, 0, sizeof alone); pile(&alone, zoo[e], s.z_unit[s.first[p]], s.F_unit[s.first[p]], k);
            perp_ncp_result a = solve(&alone, 0, za);
            strcat(names, zoo[e]->name); strcat(names, " ");
            if (a.outcome > 1) { worst = a.outcome; printf("  alone %s %d: %s %g\n", zoo[e]->name, k, perp_outcome_text(a.outcome), a.residual); }
            if (a.restarts) strcat(names, "(r) ");
        }
        perp_ncp_result b = solve(&s, 0, z);
        if ((b.outcome > 1) != (worst > 1)) { printf("%s: %s %g, nat %g back %g re %d it %d, alone %s\n", names, perp_outcome_text(b.outcome), b.residual, b.natural_residual, b.backward_error, b.restarts, (int)b.iterations, perp_outcome_text(worst)); bad++; }
        else same++;
    }
    printf("same %d, other %d\n", same, bad);
}
