/* What all problems of the zoo share: memory, the pattern of the Jacobian, the residual. */
#include "problems.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void *zoo_memory(size_t count, size_t size)
{
    void *memory = calloc(count ? count : 1, size);
    if (!memory) {
        fprintf(stderr, "problems: not enough memory\n");
        exit(1);
    }
    return memory;
}

void zoo_bounds(zoo_problem *problem, int32_t first, int32_t end, double lower, double upper)
{
    for (int32_t i = first; i < end; i++) {
        problem->lower[i] = lower;
        problem->upper[i] = upper;
    }
}

void zoo_size(zoo_problem *problem, int32_t n, zoo_equations equations)
{
    size_t size = (size_t)n;
    problem->n = n;
    problem->equations = equations;
    problem->lower = zoo_memory(size, sizeof(double));
    problem->upper = zoo_memory(size, sizeof(double));
    problem->scratch = zoo_memory(size, sizeof(double));
    problem->starts = zoo_memory(ZOO_STARTS * size, sizeof(double));
    problem->solutions = zoo_memory(ZOO_SOLUTIONS * size, sizeof(double));
    problem->scale = 1;
    zoo_bounds(problem, 0, n, 0, INFINITY);
}

double *zoo_data(zoo_problem *problem, size_t count)
{
    return problem->data = zoo_memory(count, sizeof(double));
}

double *zoo_start(zoo_problem *problem, double value)
{
    double *start = problem->starts + (ptrdiff_t)problem->n * problem->start_count;
    if (problem->start_count++ == ZOO_STARTS)
        abort();
    for (int32_t i = 0; i < problem->n; i++)
        start[i] = value;
    return start;
}

double *zoo_solution(zoo_problem *problem)
{
    if (problem->solution_count == ZOO_SOLUTIONS)
        abort();
    return problem->solutions + (ptrdiff_t)problem->n * problem->solution_count++;
}

void zoo_set(double *target, const double *numbers, int32_t count)
{
    memcpy(target, numbers, (size_t)count * sizeof *target);
}

/* Places by column, then by row; `order` keeps them beside the entry they belong to. */
typedef struct place {
    int32_t row, column;
    size_t entry;
} place;

static int compare_places(const void *left, const void *right)
{
    const place *a = left, *b = right;
    if (a->column != b->column)
        return a->column < b->column ? -1 : 1;
    return a->row < b->row ? -1 : a->row > b->row;
}

/* Compressed columns, and the slot of each entry, from the places in the order they were named. */
static void make_pattern(zoo_problem *problem, const zoo_jacobian *record)
{
    size_t count = record->count, n = (size_t)problem->n;
    place *places = zoo_memory(count, sizeof *places);
    int32_t slot = -1;
    problem->column_starts = zoo_memory(n + 1, sizeof(int32_t));
    problem->row_indices = zoo_memory(count, sizeof(int32_t));
    for (size_t k = 0; k < count; k++)
        places[k] = (place){record->rows[k], record->columns[k], k};
    qsort(places, count, sizeof *places, compare_places);
    for (size_t k = 0; k < count; k++) {
        if (k == 0 || compare_places(&places[k], &places[k - 1]) != 0) {
            problem->row_indices[++slot] = places[k].row;
            problem->column_starts[places[k].column + 1]++;
        }
        problem->slots[places[k].entry] = slot;
    }
    for (size_t j = 0; j < n; j++)
        problem->column_starts[j + 1] += problem->column_starts[j];
    problem->nonzeros = slot + 1;
    free(places);
}

/* Two looks at the entries: how many, and where. */
static void find_entries(zoo_problem *problem)
{
    zoo_jacobian record = {0};
    for (int look = 0; look < 2; look++) {
        if (look == 1) {
            record.capacity = record.count;
            record.rows = zoo_memory(record.count, sizeof(int32_t));
            record.columns = zoo_memory(record.count, sizeof(int32_t));
            record.count = 0;
        }
        if (problem->equations(problem, problem->starts, problem->scratch, &record) != 0)
            abort(); /* the first start has to be in the domain */
    }
    problem->entries = record.count;
    problem->slots = zoo_memory(record.count, sizeof(int32_t));
    if (problem->sparse) {
        make_pattern(problem, &record);
    } else {
        problem->nonzeros = problem->n * problem->n;
        for (size_t k = 0; k < record.count; k++)
            problem->slots[k] = record.rows[k] + problem->n * record.columns[k];
    }
    free(record.rows);
    free(record.columns);
}

zoo_problem *zoo_create(const zoo_entry *entry, int32_t size)
{
    zoo_problem *problem = zoo_memory(1, sizeof *problem);
    problem->name = entry->name;
    problem->size = size;
    entry->build(problem, size);
    find_entries(problem);
    return problem;
}

void zoo_destroy(zoo_problem *problem)
{
    if (!problem)
        return;
    free(problem->lower);
    free(problem->upper);
    free(problem->data);
    free(problem->column_starts);
    free(problem->row_indices);
    free(problem->slots);
    free(problem->starts);
    free(problem->solutions);
    free(problem->scratch);
    free(problem);
}

int32_t zoo_function(double *F, const double *z, void *user)
{
    const zoo_problem *problem = user;
    return problem->equations(problem, z, F, NULL);
}

int32_t zoo_jacobian_values(double *values, const double *z, void *user)
{
    const zoo_problem *problem = user;
    zoo_jacobian J = {0};
    memset(values, 0, (size_t)problem->nonzeros * sizeof *values);
    J.values = values;
    J.slots = problem->slots;
    return problem->equations(problem, z, problem->scratch, &J);
}

void zoo_view(zoo_problem *problem, perp_ncp_problem *view)
{
    view->n = problem->n;
    view->storage = problem->sparse ? PERP_STORAGE_CSC : PERP_STORAGE_COLUMN_MAJOR;
    view->column_starts = problem->column_starts;
    view->row_indices = problem->row_indices;
    view->function = zoo_function;
    view->jacobian = zoo_jacobian_values;
    view->lower = problem->lower;
    view->upper = problem->upper;
    view->user = problem;
}

double zoo_residual(const zoo_problem *problem, const double *z, const double *F)
{
    double largest = 0;
    for (int32_t i = 0; i < problem->n; i++) {
        double x = fmin(fmax(z[i] - F[i], problem->lower[i]), problem->upper[i]);
        double r = fabs(z[i] - x);
        if (!(r <= largest))
            largest = r;
    }
    return largest;
}

/* The groups, one after the other. */
const zoo_entry *zoo_table(int32_t *count)
{
    static const zoo_entry *const groups[] = {zoo_classic,   zoo_programs,  zoo_more_programs,
                                              zoo_markets,   zoo_exchanges, zoo_grids,
                                              zoo_mechanics, zoo_networks,  zoo_systems};
    static zoo_entry table[100];
    int32_t k = 0;
    for (size_t g = 0; g < sizeof groups / sizeof *groups; g++) {
        for (const zoo_entry *entry = groups[g]; entry->name; entry++) {
            if (k == (int32_t)(sizeof table / sizeof *table))
                abort();
            table[k++] = *entry;
        }
    }
    *count = k;
    return table;
}
