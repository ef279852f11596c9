/* The shortest way for small dense problems 0 <= z perp M z + q >= 0: Lemke's path (lemke/path.c
 * has its source) on a tableau of the stack, one step of refinement by the inverse of the active
 * block that is in it, and the same residuals and the same judge as for any other point. It takes
 * nothing but what is solved to the last digits; all else is left to the methods, which begin
 * anew. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "lcp/solver.h"
#include "linalg/lanes/vectors.h"

enum {
    LENGTH = PERP__SMALL_LENGTH,
    /* Pivots a row: twice what most problems need. */
    MOST_PIVOTS = 4
};

/* As for the first of lemke's attempts: smaller pivots, beside the largest entry of their columns,
 * are rounding; and how far rows may be passed, beside the largest |q|, for a larger pivot. */
#define SMALLEST_PIVOT 1e-11
#define SLACK 1e-12
/* A pivot of this size beside its column makes a basis to start from. */
#define SMALLEST_START 1e-8
/* A q this small beside the largest hides from common units: perp__polish_hidden looks for such
 * rows. */
#define HIDDEN 0x1p-70

/* basic + T nonbasic = b: b is column n + 1 of T, t's at first is column n. Variables: z_k = k,
 * w_k = n + k, t = 2 n. Rows from n on are 0, so that vectors may reach there. */
typedef struct tableau {
    size_t n, b, row; /* t's row, once it is basic */
    double slack;
    int32_t most; /* pivots */
    int32_t basic[LENGTH], nonbasic[LENGTH + 1], column_of[2 * LENGTH + 1];
    double T[(LENGTH + 2) * LENGTH];
} tableau;

#define NONE SIZE_MAX

typedef struct kernels {
    int32_t (*follow)(tableau *t, const double *z);
    void (*correct)(tableau *t, const double *w);
    void (*scale)(size_t n, const double *columns, const double *d, double *scaled);
} kernels;

#define TEMPLATE "lcp/small_vector.h"
#include "linalg/lanes/each_set.h"

static const kernels *fastest(void)
{
    static const kernels *const sets[] = {PERP__OF_EACH_SET(&kernels)};

    return sets[perp__widest_vectors()];
}

int32_t perp__small_suits(const perp_lcp_solver *solver)
{
    return !solver->M.column_starts && solver->n > 0 && solver->n <= LENGTH;
}

void perp__small_read(perp_lcp_solver *solver)
{
    const size_t n = (size_t)solver->n, rows = solver->M.row_stride;
    const size_t columns = solver->M.column_stride;
    const double *from = solver->M.values;
    double *into = solver->columns;

    memset(into, 0, n * LENGTH * sizeof *into);
    for (size_t j = 0; j < n; j++, from += columns, into += LENGTH)
        for (size_t i = 0; i < n; i++)
            into[i] = from[i * rows];
    solver->M.values = solver->columns;
    solver->M.row_stride = 1;
    solver->M.column_stride = LENGTH;
    solver->wide = solver->M;
    solver->wide.rows = solver->length;
}

void perp__small_scale(perp_lcp_solver *solver)
{
    double d[LENGTH] = {0.0};

    memcpy(d, solver->factors, (size_t)solver->n * sizeof *d);
    fastest()->scale((size_t)solver->n, solver->columns, d, solver->scaled);
}

/* Whether the bounds are 0 and +inf, M is one part, and nothing is asked for that takes a method of
 * its own. */
static int32_t is_plain(const perp_lcp_solver *solver)
{
    const perp_lcp_settings *s = &solver->settings;

    return solver->is_small && solver->parts == 1 && solver->powers_normal && s->polish &&
           s->pivot_rule == PERP_PIVOT_HARRIS;
}

static void fill(const perp_lcp_solver *solver, tableau *t)
{
    const size_t n = (size_t)solver->n;
    double largest = 0.0, *cover = t->T + n * LENGTH, *b = cover + LENGTH;

    t->n = n;
    t->b = n + 1;
    memcpy(t->T, solver->scaled, n * LENGTH * sizeof *t->T);
    memset(cover, 0, 2 * LENGTH * sizeof *cover);
    for (size_t k = 0; k < n; k++) {
        cover[k] = -1.0;
        b[k] = solver->q_scaled[k];
        largest = fabs(b[k]) > largest ? fabs(b[k]) : largest;
        t->basic[k] = (int32_t)(n + k);
        t->nonbasic[k] = t->column_of[k] = (int32_t)k;
    }
    t->nonbasic[n] = (int32_t)(2 * n);
    t->slack = SLACK * largest;
    t->most = MOST_PIVOTS * (int32_t)n;
    if (solver->settings.max_iterations > 0 && solver->settings.max_iterations < t->most)
        t->most = solver->settings.max_iterations;
}

static void write_point(perp_lcp_solver *solver, tableau *t)
{
    double values[2 * LENGTH + 1] = {0.0}, *b = t->T + t->b * LENGTH;

    for (size_t r = 0; r < t->n; r++) {
        b[r] = b[r] > 0.0 ? b[r] : 0.0;
        values[t->basic[r]] = b[r];
    }
    for (size_t k = 0; k < t->n; k++)
        solver->z[k] = values[k] * solver->z_up[k];
}

/* One step of refinement. Whether it is short enough to be the last: its square is what it leaves.
 */
static int32_t correct(perp_lcp_solver *solver, const kernels *fast, tableau *t)
{
    double w[LENGTH], before[LENGTH], step = 0.0, largest = 0.0;
    const double *b = t->T + t->b * LENGTH;

    perp__multiply_doubled(&solver->wide, solver->z, solver->q, solver->w_high, solver->w_low);
    for (size_t i = 0; i < t->n; i++) {
        w[i] = solver->w_high[i] * solver->w_down[i];
        before[i] = b[i];
    }
    fast->correct(t, w);
    for (size_t r = 0; r < t->n; r++) {
        const double is_z = t->basic[r] < solver->n ? 1.0 : 0.0;
        const double change = is_z * fabs(b[r] - before[r]), size = is_z * fabs(b[r]);

        step = change > step ? change : step;
        largest = size > largest ? size : largest;
    }
    return step <= PERP__LAST_STEP * largest;
}

/* Whether a row is so small beside others that perp__polish_hidden is to look at it. */
static int32_t is_hidden(const perp_lcp_solver *solver)
{
    for (int32_t i = 0; i < solver->n; i++)
        if (solver->q[i] != 0.0 && fabs(solver->q_scaled[i]) <= HIDDEN)
            return 1;
    return 0;
}

/* The start in scaled units. */
static void read_start(const perp_lcp_solver *solver, const double *z0, double *z)
{
    memset(z, 0, LENGTH * sizeof *z);
    for (int32_t i = 0; i < solver->n; i++)
        z[i] = z0[i] > 0.0 ? z0[i] * solver->z_down[i] : 0.0;
}

int32_t perp__small_solve(perp_lcp_solver *solver, const double *z0, perp__evaluation *worth)
{
    const kernels *fast = fastest();
    double start[LENGTH];
    tableau t;

    if (!is_plain(solver))
        return 0;
    fill(solver, &t);
    if (z0)
        read_start(solver, z0, start);
    solver->spent = fast->follow(&t, z0 ? start : NULL);
    if (solver->spent < 0)
        return 0;
    write_point(solver, &t);
    if (!correct(solver, fast, &t))
        return 0;
    write_point(solver, &t);
    *worth = perp__evaluate(solver);
    return perp__is_exact(solver, worth) && (worth->small || !is_hidden(solver));
}
