/* The settings of a solver and its life: create, set, setup, destroy, and the public entrances. */
#include "lcp/solver.h"

#include <math.h>
#include <string.h>

#include "base/check.h"
#include "base/clock.h"
#include "base/context.h"
#include "lcp/all/all.h"
#include "linalg/lanes/vectors.h"
#include "linalg/scale.h"

/* ---- settings ---- */

PERP__INIT_WITH(perp_lcp_settings, .tol = 1e-10, .relaxation = 1.0, .scaling = 1, .polish = 1,
                .crash = 1)

PERP__WORDS(perp_lcp_method_text, "unknown method", "auto", "lemke", "pgs", "fischer", "polish",
            "active_set", "patterns", "mprgp")

static const perp__field fields[] = {
    PERP__INTEGER(perp_lcp_settings, method, 0, PERP_LCP_ACTIVE_SET),
    PERP__INTEGER(perp_lcp_settings, pivot_rule, 0, PERP_PIVOT_LEXICOGRAPHIC),
    PERP__INTEGER(perp_lcp_settings, sweep, 0, PERP_SWEEP_SYMMETRIC),
    PERP__INTEGER(perp_lcp_settings, acceleration, 0, PERP_ACCELERATION_CONJUGATE_GRADIENT),
    PERP__INTEGER(perp_lcp_settings, max_iterations, 0, INFINITY),
    PERP__REAL(perp_lcp_settings, tol, "()", 0, INFINITY),
    PERP__REAL(perp_lcp_settings, time_limit, "[]", 0, INFINITY),
    PERP__REAL(perp_lcp_settings, relaxation, "()", 0, 2),
    PERP__REAL(perp_lcp_settings, penalty, "[)", 0, 1),
    PERP__INTEGER(perp_lcp_settings, scaling, 0, 1),
    PERP__INTEGER(perp_lcp_settings, polish, 0, 1),
    PERP__INTEGER(perp_lcp_settings, crash, 0, 1),
};

PERP__SETTINGS_READER(perp__lcp_settings_read, perp_lcp_settings, fields,
                      read.method != PERP_LCP_POLISH && read.method != PERP_LCP_PATTERNS
                          ? PERP_OK
                          : perp__refuse(context,
                                         "settings.method is %d, which is only ever reported",
                                         (int)read.method))

/* ---- life ---- */

static const perp__lcp_method *const methods[PERP__METHODS] = {
    &perp__lcp_lemke, &perp__lcp_pgs, &perp__lcp_fischer, &perp__lcp_active_set};

static void release(void *object)
{
    perp_lcp_solver *solver = object;

    for (int32_t k = 0; k < PERP__METHODS; k++)
        perp__workspace_release(&solver->slots[k].space, solver->slots[k].method->release);
    perp__arena_release(&solver->polish.arena);
    perp__arena_release(&solver->S_arena);
    if (solver->inner)
        perp__handle_end(solver->inner);
    if (solver->tree)
        perp__last_word_release(solver);
    if (solver->block.M)
        perp__sparse_block_release(&solver->block);
    perp__arena_release(&solver->arena);
}

static const perp__kind kind = {"a solver", sizeof(perp_lcp_solver), release};

static perp_status begin(perp_lcp_solver *made, const perp_lcp_settings *settings)
{
    made->block.context = made->context;
    for (int32_t k = 0; k < PERP__METHODS; k++)
        made->slots[k].method = methods[k];
    return perp__lcp_settings_read(made->context, &made->settings, settings);
}

perp_status perp__lcp_create(perp_context *context, perp_lcp_solver **solver,
                             const perp_lcp_settings *settings)
{
    perp_status status = perp__check_pointer(context, "solver", solver);
    perp_lcp_solver *made = status == PERP_OK ? perp__handle_create(context, &kind) : NULL;

    if (!made)
        return status == PERP_OK ? PERP_ERROR_MEMORY : status;
    status = begin(made, settings);
    PERP__HAND_OUT(status, made, solver);
    return status;
}

static void layout(perp__arena *arena, void *object)
{
    perp_lcp_solver *s = object;
    size_t n = (size_t)s->n, entries = n <= PERP__SMALL_LENGTH ? n * PERP__SMALL_LENGTH : 0;

    /* those that are read to s->length come first */
    PERP__DOUBLES(arena, n, &s->lower, &s->upper, &s->row_norms, &s->z_down, &s->z_up, &s->w_down,
                  &s->q_scaled, &s->q_own, &s->z, &s->w_high, &s->w_low, &s->factors,
                  &s->lower_scaled, &s->upper_scaled, &s->iterate, &s->ray, &s->covering);
    s->exponents = perp__arena_take(arena, n, sizeof(int32_t));
    PERP__INTEGERS(arena, 2 * n, &s->work, &s->part, &s->omega, &s->part_omega);
    s->apart = perp__arena_take(arena, 4 * n, sizeof(int32_t));
    s->reach = perp__arena_take(arena, 2 * n, sizeof(double));
    perp__witness_layout(arena, &s->witness, n);
    s->places = perp__arena_take(arena, n, sizeof(int8_t));
    s->signs = perp__arena_take(arena, n, sizeof(int8_t));
    s->turned = perp__arena_take(arena, s->turned_entries, sizeof(double));
    PERP__DOUBLES(arena, entries, &s->columns, &s->scaled);
    PERP__DOUBLES(arena, n, &s->best.z, &s->best.w, &s->best_ray, &s->game_start);
}

/* Room for problems of n rows; without it that for the last one's stays. */
static perp_status make_room(perp_lcp_solver *solver, int32_t n, size_t turned_entries)
{
    const int32_t before = solver->n;
    const size_t turned_before = solver->turned_entries;
    perp_status status;

    solver->n = n;
    solver->turned_entries = turned_entries;
    status = perp__arena_fit(&solver->arena, solver->context, layout, solver);
    if (status != PERP_OK) {
        solver->n = before;
        solver->turned_entries = turned_before;
        if (solver->setups > 0) /* the block is there */
            perp__arena_fit(&solver->arena, solver->context, layout, solver);
        return status;
    }
    solver->length = n;
    if (n > 0 && n <= PERP__SMALL_LENGTH) { /* zeros beyond n, so that vectors may reach there */
        const int32_t lanes = perp__widest_vectors() == PERP__VECTOR_AVX512 ? 8 : 4;

        solver->length = (n + lanes - 1) / lanes * lanes;
        memset(solver->lower, 0, (size_t)((char *)solver->lower_scaled - (char *)solver->lower));
        memset(solver->columns, 0, (size_t)n * PERP__SMALL_LENGTH * sizeof *solver->columns);
    }
    return PERP_OK;
}

perp_status perp__lcp_problem_read(perp_context *context, perp__matrix *copy, const perp_matrix *M,
                                   const double *lower, const double *upper)
{
    perp_status status = perp__matrix_read(context, "M", copy, M);

    if (status == PERP_OK && copy->rows != copy->columns)
        status = perp__refuse(context, "M is %d by %d, expected a square matrix", (int)copy->rows,
                              (int)copy->columns);
    PERP__THEN(status, perp__check_bounds(context, lower, upper, (size_t)copy->rows));
    return status;
}

/* Which way round equations stand. Row i of a free z_i says w_i = 0, and its negative says the
 * same; but methods see more than that. [H A'; A 0] with free multipliers is symmetric and not
 * monotone, and paths may end in rays beside its solutions; [H A'; -A 0] is monotone where H is
 * (Cottle, Pang and Stone, "The Linear Complementarity Problem", sections 1.3 and 4.4). So an
 * equation in which z_i itself has no part is turned round where more of its entries have the sign
 * of their mirror images than the other one; the scale of no row depends on that. */
static bool is_free(const double *lower, const double *upper, int32_t i)
{
    return lower[i] == -INFINITY && (!upper || upper[i] == INFINITY);
}

/* Whether row i is to be turned round, with signs of the others as they are. */
static bool is_turned(const perp__matrix *M, int32_t i, const int8_t *signs)
{
    const perp__line l = perp__line_of(M, i);
    int64_t alike = 0;

    if (perp__entry(M, i, i) != 0.0)
        return 0;
    for (int32_t k = 0; k < l.count; k++) {
        const int32_t j = l.indices ? l.indices[k] : k;
        const double entry = perp__entry(M, i, j), mirrored = perp__entry(M, j, i);

        if (j != i && entry != 0.0 && mirrored != 0.0) /* the sign of M_ij M_ji */
            alike += (entry > 0.0) == (mirrored > 0.0) ? signs[j] : -signs[j];
    }
    return alike > 0;
}

/* How many entries of M a copy has for them; 0 where there is nothing to turn. */
static size_t turned_entries_of(const perp__matrix *M, const double *lower, const double *upper)
{
    const size_t n = (size_t)M->rows;
    const size_t stride = M->row_stride > M->column_stride ? M->row_stride : M->column_stride;

    for (int32_t i = 0; i < M->rows && lower; i++)
        if (is_free(lower, upper, i) && perp__entry(M, i, i) == 0.0)
            return M->column_starts ? (size_t)M->column_starts[n] : n * stride;
    return 0;
}

int32_t perp__lcp_orient(const perp__matrix *M, const double *lower, const double *upper,
                         int8_t *signs)
{
    int32_t count = 0;

    memset(signs, 1, (size_t)M->rows);
    for (int32_t i = 0; i < M->rows; i++)
        if (is_free(lower, upper, i) && is_turned(M, i, signs)) {
            signs[i] = -1;
            count++;
        }
    return count;
}

/* M is then that copy, in solver->turned. */
static void turn_equations(perp_lcp_solver *solver, perp__matrix *M)
{
    const int32_t count = perp__lcp_orient(M, solver->lower, solver->upper, solver->signs);

    for (int32_t j = 0; j < M->columns && count > 0; j++) {
        const perp__line l = perp__line_of(M, j);

        for (int32_t k = 0; k < l.count; k++) {
            const int32_t i = perp__lines_are_rows(M) ? j : l.indices ? l.indices[k] : k;

            solver->turned[l.values - M->values + k] = solver->signs[i] * l.values[k];
        }
    }
    solver->is_turned = count > 0;
    if (solver->is_turned)
        M->values = solver->turned;
}

static void equilibrate(perp_lcp_solver *solver)
{
    solver->powers_known = 0;
    solver->witness.known = 0;
    if (solver->by_columns)
        perp__small_equilibrate(solver);
    else
        perp__equilibrate(&solver->M, solver->settings.scaling, solver->exponents,
                          solver->row_norms, solver->work);
    for (int32_t i = 0; i < solver->n && !solver->by_columns; i++)
        solver->factors[i] = perp__power_of_two(solver->exponents[i]);
    solver->parts = perp__find_parts(&solver->M, solver->part, solver->reach);
}

/* Large sparse matrices stay so. */
static bool is_expanded(const perp_lcp_solver *s)
{
    return !s->M.column_starts || s->n <= PERP__SMALL_SPARSE;
}

size_t perp__scaled_entries(const perp_lcp_solver *s)
{
    const size_t n = (size_t)s->n;

    return !is_expanded(s)                    ? (size_t)s->M.column_starts[n]
           : n == 0 || n <= SIZE_MAX / 16 / n ? n * n
                                              : SIZE_MAX;
}

static void layout_S(perp__arena *arena, void *object)
{
    perp_lcp_solver *s = object;
    const size_t entries = perp__scaled_entries(s);

    /* in one piece: allocators give back to the system what is more than twice the largest */
    s->S_values = perp__arena_take(arena, entries, sizeof(double));
    s->block.room = is_expanded(s) ? perp__arena_take(arena, entries, sizeof(double)) : NULL;
}

/* into[i] := from[i stride] (d_i d_j), i < count. */
static inline void scale_strip(const double *from, size_t stride, const double *d, double d_j,
                               double *into, size_t count)
{
    for (size_t i = 0; i < count; i++)
        into[i] = from[i * stride] * (d[i] * d_j);
}

/* Of a matrix by rows a strip at a time, so that what is read and what is written stay in the cache
 * until their lines are complete. The compiler knows strides of 1 and whole strips. */
static void scale_dense(const perp__matrix *M, const double *d, double *S)
{
    enum { STRIP = 16 };
    const size_t n = (size_t)M->rows, stride = M->row_stride, most = stride == 1 ? n : STRIP;

    for (size_t begin = 0; begin < n; begin += most)
        for (size_t j = 0; j < n; j++) {
            const double *from = M->values + begin * stride + j * M->column_stride;
            double *into = S + begin + j * n;

            if (stride == 1)
                scale_strip(from, 1, d, d[j], into, n);
            else if (begin + STRIP <= n)
                scale_strip(from, stride, d + begin, d[j], into, STRIP);
            else
                scale_strip(from, stride, d + begin, d[j], into, n - begin);
        }
}

perp__matrix perp__scale_matrix(const perp_lcp_solver *s, double *values)
{
    const perp__matrix *M = &s->M;
    const double *d = s->factors;
    const size_t n = (size_t)s->n;
    const bool is_sparse = !is_expanded(s);

    if (!M->column_starts)
        scale_dense(M, d, values);
    else if (!is_sparse && n > 0)
        memset(values, 0, n * n * sizeof *values);
    for (int32_t j = 0; M->column_starts && j < s->n; j++)
        for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++) {
            const int32_t i = M->row_indices[k];

            values[is_sparse ? k : i + j * s->n] = M->values[k] * (d[i] * d[j]);
        }
    return (perp__matrix){s->n,
                          s->n,
                          1,
                          n,
                          values,
                          is_sparse ? M->column_starts : NULL,
                          is_sparse ? M->row_indices : NULL};
}

perp_status perp__read_block(perp_lcp_solver *s)
{
    perp_status status = PERP_OK;

    if (s->S_setup != s->setups) {
        s->S_setup = 0;
        status = perp__arena_fit(&s->S_arena, s->context, layout_S, s);
        if (status != PERP_OK)
            return status;
        s->S = perp__scale_matrix(s, s->S_values);
        s->S_setup = s->setups;
    }
    if (s->block_read != s->setups) {
        s->block_read = 0;
        status = perp__sparse_block_read(&s->block, &s->S, s->row_norms);
        s->block_read = status == PERP_OK ? s->setups : 0;
    }
    perp__sparse_block_restart(&s->block, s->deadline);
    return status;
}

perp_status perp__lcp_setup(perp_lcp_solver *solver, const perp_matrix *M, const double *lower,
                            const double *upper)
{
    perp__matrix copy;
    perp_status status = perp__lcp_problem_read(solver->context, &copy, M, lower, upper);
    int32_t free_before = solver->free_variables, other_shape;
    size_t turned_entries;

    if (status != PERP_OK)
        return status;
    other_shape = solver->setups == 0 || copy.rows != solver->n || copy.column_starts ||
                  solver->M.column_starts;
    turned_entries = solver->as_given ? 0 : turned_entries_of(&copy, lower, upper);
    if (solver->setups == 0 || copy.rows != solver->n || turned_entries > solver->turned_entries)
        status = make_room(solver, copy.rows, turned_entries);
    if (status != PERP_OK)
        return status;
    solver->free_variables = 0;
    solver->is_small = 1;
    for (int32_t i = 0; i < solver->n; i++) {
        solver->lower[i] = lower ? lower[i] : 0.0;
        solver->upper[i] = upper ? upper[i] : INFINITY;
        solver->is_small &= solver->lower[i] == 0.0 && solver->upper[i] == INFINITY;
        solver->free_variables += solver->lower[i] == -INFINITY && solver->upper[i] == INFINITY;
    }
    solver->is_turned = 0;
    if (turned_entries > 0)
        turn_equations(solver, &copy);
    solver->M = copy;
    solver->wide = copy;
    solver->by_columns = !copy.column_starts && copy.rows > 0 && copy.rows <= PERP__SMALL_LENGTH;
    solver->is_small &= solver->by_columns;
    if (solver->by_columns)
        perp__small_read(solver);
    solver->setups++;
    if (other_shape || free_before != solver->free_variables)
        solver->shape = solver->setups;
    equilibrate(solver);
    return PERP_OK;
}

perp_status perp__lcp_set(perp_lcp_solver *solver, const perp_lcp_settings *settings)
{
    int32_t scaling = solver->settings.scaling;
    perp_status status = perp__lcp_settings_read(solver->context, &solver->settings, settings);

    if (status == PERP_OK && solver->setups && scaling != solver->settings.scaling) {
        equilibrate(solver);
        solver->setups++; /* what was made of the scaled matrix is out of date */
    }
    return status;
}

/* Doubles of room for the solver's arena at n = PERP__SMALL_LENGTH. */
enum { SMALL_ROOM = 3520 };

perp_status perp_lcp_solver_create(perp_context *context, perp_lcp_solver **solver,
                                   const perp_lcp_settings *settings)
{
    return PERP__CALL(perp__enter(context), context, perp__lcp_create(context, solver, settings));
}

void perp_lcp_solver_destroy(perp_lcp_solver *solver)
{
    perp__handle_destroy(solver, &kind);
}

perp_status perp_lcp_solver_set(perp_lcp_solver *solver, const perp_lcp_settings *settings)
{
    return PERP__HANDLE_CALL(solver, &kind, perp__lcp_set(solver, settings));
}

perp_status perp_lcp_solver_setup(perp_lcp_solver *solver, const perp_matrix *M,
                                  const double *lower, const double *upper)
{
    return PERP__HANDLE_CALL(solver, &kind, perp__lcp_setup(solver, M, lower, upper));
}

perp_status perp_lcp_solver_solve(perp_lcp_solver *solver, double *z, double *w, double *ray,
                                  perp_lcp_result *result, const double *q, const double *z0)
{
    return PERP__HANDLE_CALL(solver, &kind, perp__lcp_solve(solver, z, w, ray, result, q, z0));
}

perp_status perp__lcp_caller_read(perp_context *context, perp_lcp_problem *copy,
                                  const perp_lcp_problem *problem, bool products)
{
    const perp_status status = PERP__READ(perp_lcp_problem, context, copy, problem);

    if (status == PERP_OK && copy->reserved != 0)
        return perp__refuse(context, "problem.reserved is %d, expected 0", (int)copy->reserved);
    if (status == PERP_OK && copy->product && !products)
        return perp__refuse(context, "problem has a product, which perp_lcp_solve alone takes");
    return status;
}

perp_status perp_lcp_solve(perp_context *context, double *z, double *w, double *ray,
                           perp_lcp_result *result, const perp_lcp_settings *settings,
                           const perp_lcp_problem *problem, const double *z0)
{
    double room[SMALL_ROOM]; /* small problems, so the solver and what it needs, take no memory */
    perp_lcp_solver solver = {.kind = &kind, .context = context};
    perp_lcp_problem p = {0};
    perp_status status = perp__enter(context);
    double deadline = 0.0;

    if (status != PERP_OK)
        return status;
    status = perp__lcp_caller_read(context, &p, problem, 1);
    if (status != PERP_OK || p.product)
        return perp__leave(context,
                           status != PERP_OK
                               ? status
                               : perp__lcp_solve_product(context, z, w, result, settings, &p, z0));
    perp__arena_lend(&solver.arena, context, room, sizeof room);
    status = begin(&solver, settings);
    if (solver.settings.time_limit > 0.0)
        deadline = perp__now() + solver.settings.time_limit;
    PERP__THEN(status, perp__lcp_setup(&solver, p.M, p.lower, p.upper));
    if (deadline > 0.0) /* what the set-up left */
        solver.settings.time_limit = perp__time_left(deadline);
    PERP__THEN(status, perp__lcp_solve(&solver, z, w, ray, result, p.q, z0));
    release(&solver);
    return perp__leave(context, status);
}
