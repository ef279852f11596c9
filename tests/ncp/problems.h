/* problems.h: named nonlinear complementarity problems with bounds, with their sources.
 *
 * Find z in [lower, upper] with F_i(z) >= 0 where z_i = lower_i, <= 0 where z_i = upper_i, and 0
 * between. Where the data of a published problem could not be read, there is one in its manner,
 * with data and a name of its own, and its source says so. */
#ifndef PERP_TESTS_NCP_PROBLEMS_H
#define PERP_TESTS_NCP_PROBLEMS_H

#include <perp/perp.h>

#include <math.h>
#include <stddef.h>
#include <stdint.h>

typedef struct zoo_problem zoo_problem;

/* Where the entries of a Jacobian go. A problem names its entries in the same order every time, so
 * that their places in the matrix are looked up once. */
typedef struct zoo_jacobian {
    double *values;       /* NULL: only the places are recorded */
    const int32_t *slots; /* the k-th entry named is values[slots[k]] */
    int32_t *rows, *columns;
    size_t count, capacity;
} zoo_jacobian;

/* F := F(z), and the Jacobian's entries where J is not NULL. 0, or 1: z is outside of the domain.
 */
typedef int32_t (*zoo_equations)(const zoo_problem *problem, const double *z, double *F,
                                 zoo_jacobian *J);

enum { ZOO_STARTS = 8, ZOO_SOLUTIONS = 4 };

struct zoo_problem {
    const char *name;
    int32_t n, size;
    zoo_equations equations;
    double *lower, *upper;
    double *data;     /* the problem's own */
    const void *form; /* of problems that differ in it alone */
    double scale;     /* of F near its solutions; residuals are judged relative to it */
    int32_t sparse, nonzeros;
    int32_t *column_starts, *row_indices; /* NULL if dense */
    int32_t *slots;
    size_t entries;
    int32_t start_count, solution_count;
    double *starts, *solutions; /* one after the other */
    double *scratch;
};

/* What is known about the solutions. */
enum zoo_knowledge {
    ZOO_UNKNOWN = 0,  /* none is stated */
    ZOO_SOME = 1,     /* the stated ones are solutions; there may be others */
    ZOO_ALL = 2,      /* there are no others */
    ZOO_FAMILY = 3,   /* the stated ones are points of a continuum */
    ZOO_SINGULAR = 4, /* as ZOO_ALL, but a small residual says little: the Jacobian is singular */
    ZOO_UNIQUE = 5    /* none is stated, and there is exactly one */
};

typedef struct zoo_entry {
    const char *name, *source;
    void (*build)(zoo_problem *problem, int32_t size);
    int32_t size;  /* for tests; 0: there is only one */
    int32_t large; /* for measurements; 0: none */
    int32_t knowledge;
    int32_t trap; /* descent on a merit function may end at a point that is no solution */
} zoo_entry;

/* The entries, and their number. */
const zoo_entry *zoo_table(int32_t *count);

/* Builds an entry; ends the program if there is no memory. Sparse problems in compressed columns.
 */
zoo_problem *zoo_create(const zoo_entry *entry, int32_t size);
void zoo_destroy(zoo_problem *problem);

/* Callbacks of perp_ncp_problem; user is the zoo_problem. */
int32_t zoo_function(double *F, const double *z, void *user);
int32_t zoo_jacobian_values(double *values, const double *z, void *user);

/* Fills an initialised view; it refers to the zoo_problem, which is its user pointer. */
void zoo_view(zoo_problem *problem, perp_ncp_problem *view);

/* max_i |z_i - mid(lower_i, z_i - F_i, upper_i)| */
double zoo_residual(const zoo_problem *problem, const double *z, const double *F);

/* For builders. Bounds start as 0 and infinity; starts and solutions as zeros. */
void zoo_size(zoo_problem *problem, int32_t n, zoo_equations equations);
void zoo_bounds(zoo_problem *problem, int32_t first, int32_t end, double lower, double upper);
double *zoo_data(zoo_problem *problem, size_t count);
double *zoo_start(zoo_problem *problem, double value);
double *zoo_solution(zoo_problem *problem);
void zoo_set(double *target, const double *numbers, int32_t count);
void *zoo_memory(size_t count, size_t size);

/* Names the next entry of the Jacobian; entries at the same place add up. */
static inline void zoo_add(zoo_jacobian *J, int32_t row, int32_t column, double value)
{
    if (J->values) {
        J->values[J->slots[J->count++]] += value;
        return;
    }
    if (J->count < J->capacity) {
        J->rows[J->count] = row;
        J->columns[J->count] = column;
    }
    J->count++;
}

/* Uniform numbers in (0, 1): SplitMix64 (Steele, Lea & Flood 2014), the same on every machine. */
static inline double zoo_random(uint64_t *state)
{
    uint64_t x = *state += UINT64_C(0x9e3779b97f4a7c15);
    x = (x ^ (x >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ (x >> 27)) * UINT64_C(0x94d049bb133111eb);
    return ((double)((x ^ (x >> 31)) >> 11) + 0.5) * 0x1p-53;
}

/* The groups that make the table, each ended by a name that is NULL. */
extern const zoo_entry zoo_classic[], zoo_programs[], zoo_more_programs[], zoo_markets[],
    zoo_exchanges[], zoo_grids[], zoo_mechanics[], zoo_networks[], zoo_systems[];

#endif
