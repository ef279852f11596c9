/* The contact solver over dynamics: bodies (blocks of 3 or 6), dense and sparse M or a callback in
 * its place, joints, several solves with warm starts; and the same numbers as a simulator has them
 * that keeps its own order (perp_contact_solver_step). */
#include <float.h>
#include <math.h>
#include <string.h>

#include "laws.h"

#define VELOCITIES 12

typedef struct dynamics_problem {
    int32_t n, bilateral;
    fuzz_matrix M, H, G;
    double *f, *w, *b;
    perp_contact_dynamics dynamics;
    int32_t calls, abort_at;
} dynamics_problem;

static int32_t mass_solve(double *x, int32_t columns, void *user)
{
    dynamics_problem *d = user;
    wide *A, *right;
    int32_t n = d->n, mark = fuzz_mark(), i, k;

    if (d->calls++ == d->abort_at)
        return 1;
    for (k = 0; k < columns; k++) {
        A = oracle_wide(n * n, d->M.dense);
        right = oracle_wide(n, &x[k * n]);
        oracle_solve(n, 1, A, right);
        for (i = 0; i < n; i++)
            x[k * n + i] = (double)right[i];
        fuzz_drop_to(mark);
    }
    return 0;
}

/* Rows that touch one block or two, as contacts of bodies do. */
static void make_rows(fuzz_bytes *bytes, fuzz_mood mood, fuzz_matrix *H, int32_t rows, int32_t n,
                      int32_t block)
{
    double *dense = fuzz_doubles(rows * n);
    int32_t i, j, bodies = (n + block - 1) / block, first = 0, second = 0;

    memset(dense, 0, (size_t)(rows * n) * sizeof *dense);
    for (i = 0; i < rows; i++) {
        if (i % 3 == 0) {
            first = fuzz_pick(bytes, bodies);
            second = fuzz_pick(bytes, bodies);
        }
        for (j = 0; j < n; j++)
            if (j / block == first || j / block == second)
                dense[i * n + j] = fuzz_number(bytes, mood);
    }
    fuzz_wrap(bytes, H, rows, n, dense);
}

static void make(fuzz_bytes *bytes, fuzz_mood mood, const laws_problem *p, dynamics_problem *d)
{
    static const int32_t blocks[] = {3, 6, 1, VELOCITIES};
    int32_t block = blocks[fuzz_pick(bytes, 4)], n = d->n = 1 + fuzz_pick(bytes, VELOCITIES);
    fuzz_mood rows_mood = mood == FUZZ_WIDE ? FUZZ_MODERATE : mood;

    d->calls = 0;
    d->abort_at = -1;
    d->bilateral = p->laws.bilateral;
    fuzz_fill_definite(bytes, mood, &d->M, n, block);
    make_rows(bytes, rows_mood, &d->H, p->rows - d->bilateral, n, block);
    make_rows(bytes, rows_mood, &d->G, d->bilateral, n, block);
    d->f = fuzz_doubles(n);
    d->w = fuzz_doubles(p->rows);
    d->b = &d->w[p->rows - d->bilateral];
    fuzz_numbers(bytes, mood, d->f, n);
    fuzz_numbers(bytes, mood, d->w, p->rows);
    if (perp_contact_dynamics_init(&d->dynamics, sizeof d->dynamics) != PERP_OK)
        fuzz_fail("perp_contact_dynamics_init takes its own size");
    d->dynamics.n = n;
    d->dynamics.H = &d->H.view;
    d->dynamics.G = d->bilateral > 0 ? &d->G.view : NULL;
    if (fuzz_one_in(bytes, 4)) {
        d->dynamics.solve = mass_solve;
        d->dynamics.user = d;
        d->abort_at = fuzz_one_in(bytes, 8) ? fuzz_pick(bytes, 8) : -1;
    } else
        d->dynamics.M = &d->M.view;
}

/* X = M^-1 (rows' and f), in 113 bits; W = rows X, q = rows M^-1 f + w, t = |W||r| + sizes of q. */
static void reduce(const laws_problem *p, const dynamics_problem *d, double limit, const double *r,
                   wide *W, wide *q, wide *t)
{
    int32_t n = d->n, rows = p->rows, i, j, k;
    wide *M = oracle_wide(n * n, d->M.dense), *X = fuzz_take(n * (rows + 1), sizeof *X);
    wide *all = fuzz_take(rows * n, sizeof *all), most = 0;

    for (i = 0; i < rows; i++)
        for (j = 0; j < n; j++)
            all[i * n + j] = i < rows - d->bilateral
                                 ? d->H.dense[i * n + j]
                                 : d->G.dense[(i - rows + d->bilateral) * n + j];
    for (j = 0; j < n; j++) {
        for (i = 0; i < rows; i++)
            X[j * (rows + 1) + i] = all[i * n + j];
        X[j * (rows + 1) + rows] = d->f[j];
    }
    if (!oracle_solve(n, rows + 1, M, X))
        fuzz_fail("the target's M is singular");
    for (k = 0; k < n; k++)
        if (oracle_abs(X[k * (rows + 1) + rows]) > most)
            most = oracle_abs(X[k * (rows + 1) + rows]);
    for (i = 0; i < rows; i++) {
        t[i] = oracle_abs(d->w[i]);
        /* a velocity that is 0 is so to rounding of the others, and doubles end at 2^-1074 */
        for (k = 0; k < n; k++)
            t[i] += oracle_abs(all[i * n + k]) * (most * (wide)0x1p-80 + (wide)0x1p-1074 / limit);
        for (j = 0; j <= rows; j++) {
            wide sum = 0, size = 0;

            for (k = 0; k < n; k++) {
                sum += all[i * n + k] * X[k * (rows + 1) + j];
                size += oracle_abs(all[i * n + k] * X[k * (rows + 1) + j]);
            }
            *(j < rows ? &W[i * rows + j] : &q[i]) = j < rows ? sum : sum + d->w[i];
            t[i] += j < rows ? size * oracle_abs(r[j]) : size;
        }
    }
}

/* What the terms of a contact's rows amount to as impulses. */
static wide *find_impulses(const laws_problem *p, const wide *W, const wide *t)
{
    wide *impulses = fuzz_take(p->rows, sizeof *impulses);
    int32_t l, k;

    for (l = 0; l < p->count; l++) {
        const oracle_law *law = &p->law[l];
        wide trace = 0, most = 0;

        for (k = law->block; k < law->block + law->block_rows; k++) {
            trace += W[k * p->rows + k];
            most = t[k] > most ? t[k] : most;
        }
        for (k = law->first; k < law->first + law->rows; k++)
            impulses[k] = trace > 0 ? most / trace : 0;
    }
    return impulses;
}

/* M v = f + H'r + G's, row by row. Impulses carry roundings of their contact's terms; beside a
 * velocity that the rows which hold make 0.0, whatever the impulses, they are known to tol of them.
 * 1e-6: solves with M, of a condition below 10 in each block; 2^-960: smaller numbers have lost
 * digits to underflow. */
static void check_momentum(const laws_problem *p, const dynamics_problem *d, double tol,
                           const double *v, const double *r, const wide *impulses)
{
    int32_t n = d->n, rows = p->rows, i, j;
    wide *sums = fuzz_take(n, sizeof *sums), *sizes = fuzz_take(n, sizeof *sizes), most = 0;

    fuzz_finite("v", v, n);
    for (i = 0; i < n; i++) {
        wide sum = -(wide)d->f[i], size = oracle_abs(sum), known = (wide)1e-6;

        for (j = 0; j < n; j++)
            if (d->M.dense[i * n + j] != 0.0 && v[j] == 0.0 &&
                10.0 * tol > 1e-12) /* size is times 1e-6 below */
                known = 10.0 * tol / 1e-6;
        for (j = 0; j < n + rows; j++) {
            wide a = j < n ? d->M.dense[i * n + j]
                     : j - n < rows - d->bilateral
                         ? -d->H.dense[(j - n) * n + i]
                         : -d->G.dense[(j - n - rows + d->bilateral) * n + i];
            wide x = a * (j < n ? v[j] : r[j - n]);

            sum += x;
            size += oracle_abs(x);
            if (j >= n)
                size += oracle_abs(a) * impulses[j - n] * known;
        }
        most = size > most ? size : most;
        for (j = 0; j < n; j++)
            size += oracle_abs(d->M.dense[i * n + j]) * (wide)0x1p-960;
        sums[i] = oracle_abs(sum);
        sizes[i] = size * (wide)1e-6 + (wide)0x1p-960;
    }
    for (i = 0; i < n; i++)
        if (sums[i] > sizes[i] + most * (wide)1e-9)
            fuzz_fail("contact: M v = f + H'r + G's: row %d is off by %Lg, %Lg are allowed", i,
                      (long double)sums[i], (long double)sizes[i]);
}

/* ---- derivatives --------------------------------------------------------------------------------
 */

static wide dot(const double *x, const double *y, int32_t count, wide *size)
{
    wide sum = 0;
    int32_t i;

    for (i = 0; i < count; i++) {
        sum += (wide)x[i] * y[i];
        *size += oracle_abs((wide)x[i] * y[i]);
    }
    return sum;
}

/* M dv = df + H'dr + G's of the same, in rows of moderate numbers and equations. */
static void check_forward(const laws_problem *p, const dynamics_problem *d, const double *df,
                          const double *dv, const double *dr, double known)
{
    int32_t n = d->n, own = p->rows - d->bilateral, i, j;

    for (i = 0; i < n; i++) {
        wide sum = -(wide)df[i], size = oracle_abs(sum);

        for (j = 0; j < n + p->rows; j++) {
            const int32_t k = j - n;
            const wide a = j < n     ? (wide)d->M.dense[i * n + j]
                           : k < own ? -(wide)d->H.dense[k * n + i]
                                     : -(wide)d->G.dense[(k - own) * n + i];
            const wide x = a * (j < n ? dv[j] : dr[k]);

            sum += x;
            size += oracle_abs(x);
        }
        if (oracle_abs(sum) > size * known + DBL_MIN)
            fuzz_fail("sensitivity: M dv = df + H'dr + G'ds: row %d is off by %Lg of %Lg", i,
                      (long double)sum, (long double)size);
    }
}

/* What velocities are sums of before rows take most of it away: (|df| + |gv|)'|M^-1| (|df| + |gv| +
 * |H'|(|dr| + |y|)), M^-1 and rows by their numbers. */
static wide size_of_moves(const laws_problem *p, const dynamics_problem *d, const double *df,
                          const double *gv, const double *dr, const double *y)
{
    int32_t n = d->n, own = p->rows - d->bilateral, i, j;
    wide *M = oracle_wide(n * n, d->M.dense), *inverse = fuzz_take(n * n, sizeof *inverse);
    wide *push = fuzz_take(n, sizeof *push), sum = 0;

    for (i = 0; i < n; i++) {
        push[i] = oracle_abs(df[i]) + oracle_abs(gv[i]);
        for (j = 0; j < p->rows; j++)
            push[i] += oracle_abs(j < own ? d->H.dense[j * n + i] : d->G.dense[(j - own) * n + i]) *
                       (oracle_abs(dr[j]) + oracle_abs(y[j]));
        for (j = 0; j < n; j++)
            inverse[i * n + j] = i == j;
    }
    oracle_solve(n, n, M, inverse);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            sum +=
                (oracle_abs(df[i]) + oracle_abs(gv[i])) * oracle_abs(inverse[i * n + j]) * push[j];
    return sum;
}

/* Forward and adjoint products belong together: gv'dv + gr'dr = x'df + y'dw + z'db. */
static void differentiate(perp_context *context, const perp_contact_settings *settings,
                          const laws_problem *p, dynamics_problem *d, const double *r)
{
    int32_t n = d->n, rows = p->rows, i;
    double *dv = fuzz_doubles(n), *dr = fuzz_doubles(rows), *df = fuzz_doubles(n);
    double *dw = fuzz_doubles(rows), *x = fuzz_doubles(n), *y = fuzz_doubles(rows), known;
    double *gv = fuzz_doubles(n), *gr = fuzz_doubles(rows);
    perp_contact_sensitivity *sensitivity = NULL;
    perp_contact_sensitivity_info info;
    wide size = 0, forward, adjoint;

    if (perp_contact_sensitivity_info_init(&info, sizeof info) != PERP_OK)
        fuzz_fail("perp_contact_sensitivity_info_init takes its own size");
    if (!fuzz_status(context,
                     perp_contact_sensitivity_create(context, &sensitivity, &info, settings,
                                                     &p->laws, &d->dynamics, d->f, d->w, d->b, r),
                     "sensitivity_create"))
        return;
    for (i = 0; i < n; i++)
        df[i] = 1.0 + i % 3, gv[i] = 2.0 - i % 4;
    for (i = 0; i < rows; i++)
        dw[i] = 1.0 - i % 2, gr[i] = 1.0 + i % 2;
    if (!fuzz_status_of(context,
                        perp_contact_sensitivity_forward(sensitivity, dv, dr, df, dw,
                                                         dw + rows - d->bilateral, NULL, NULL, NULL,
                                                         NULL),
                        "sensitivity_forward", (const void *[]){dv, dr, NULL}) ||
        !fuzz_status_of(context,
                        perp_contact_sensitivity_adjoint(sensitivity, x, y, y + rows - d->bilateral,
                                                         NULL, gv, gr),
                        "sensitivity_adjoint", (const void *[]){x, y, NULL})) {
        perp_contact_sensitivity_destroy(sensitivity);
        return;
    }
    if (info.verdict != PERP_VERDICT_REGULAR && info.verdict != PERP_VERDICT_DEGENERATE)
        fuzz_fail("sensitivity: products where the verdict is %d", info.verdict);
    fuzz_finite("dv", dv, n);
    fuzz_finite("dr", dr, rows);
    fuzz_finite("x", x, n);
    fuzz_finite("y", y, rows);
    forward = dot(gv, dv, n, &size) + dot(gr, dr, rows, &size);
    adjoint = dot(df, x, n, &size) + dot(dw, y, rows, &size);
    size += size_of_moves(p, d, df, gv, dr, y);
    known = 1e-8 * info.condition; /* what the factors of the active set lose */
    if (known < 1e-3 && oracle_abs(forward - adjoint) > size * known)
        fuzz_fail("sensitivity: forward gives %Lg, adjoint %Lg (%Lg of %Lg), condition %g",
                  (long double)forward, (long double)adjoint,
                  (long double)oracle_abs(forward - adjoint), (long double)size, info.condition);
    if (known < 1e-3)
        check_forward(p, d, df, dv, dr, known);
    perp_contact_sensitivity_destroy(sensitivity);
}

static void solve(fuzz_bytes *bytes, perp_context *context, perp_contact_solver *solver,
                  const perp_contact_settings *settings, const laws_problem *p, dynamics_problem *d)
{
    double *v = fuzz_doubles(d->n), *r = fuzz_doubles(p->rows), *u = fuzz_doubles(p->rows);
    double *ray = fuzz_doubles(p->rows), *r0 = fuzz_doubles(p->rows);
    int32_t *modes = fuzz_take(p->laws.contacts + p->laws.bounded, sizeof *modes);
    wide *W = fuzz_take(p->rows * p->rows, sizeof *W), *q = fuzz_take(p->rows, sizeof *q);
    wide *t = fuzz_take(p->rows, sizeof *t);
    perp_contact_result result;
    int warm = fuzz_one_in(bytes, 3), i;

    fuzz_show("r", r, p->rows);
    fuzz_show("v", v, d->n);
    fuzz_show("mu", p->mu, p->laws.contacts);
    if (warm)
        fuzz_numbers(bytes, FUZZ_MODERATE, r0, p->rows);
    if (perp_contact_result_init(&result, sizeof result) != PERP_OK)
        fuzz_fail("perp_contact_result_init takes its own size");
    if (!fuzz_status_of(context,
                        perp_contact_solver_solve_dynamics(solver, v, r, u, modes, ray, &result,
                                                           d->f, d->w, d->b, warm ? r0 : NULL),
                        "solve_dynamics", (const void *[]){v, r, u, modes, ray, NULL}))
        return;
    for (i = 0; i < p->rows; i++)
        if (!isfinite(r[i])) {
            if (fuzz_good(result.outcome))
                fuzz_finite("r", r, p->rows);
            return;
        }
    reduce(p, d, oracle_limit(result.outcome, settings->tol), r, W, q, t);
    laws_check("contact", p, W, q, t, settings, &result, r, u, modes);
    if (fuzz_good(result.outcome)) {
        const int mark = fuzz_mark();

        check_momentum(p, d, settings->tol, v, r, find_impulses(p, W, t));
        differentiate(context, settings, p, d, r);
        fuzz_drop_to(mark);
    }
}

/* ---- perp_contact_solver_step ---------------------------------------------------------------- */

/* A simulator's side of the problem: every array of H and G's numbers lies backwards in J, M's in
 * mass, the rows of J are the problem's backwards, with two in between that are nobody's. */
typedef struct simulator {
    perp_contact_step step;
    double *mass, *damping, *velocity, *force, *J, *gaps;
    const double *at_J, *at_gaps;
    double *at_force;
} simulator;

static int64_t numbers_of(const perp_matrix *view, int32_t lines)
{
    return view->storage == PERP_STORAGE_CSC ? view->column_starts[view->columns]
                                             : view->leading_dimension * lines;
}

static int32_t count_numbers(const fuzz_matrix *m)
{
    return (int32_t)numbers_of(
        &m->view, m->view.storage == PERP_STORAGE_ROW_MAJOR ? m->view.rows : m->view.columns);
}

/* Where M_ii is. */
static int32_t find_diagonal(const perp_matrix *M, int32_t i)
{
    int32_t k;

    if (M->storage != PERP_STORAGE_CSC)
        return i * ((int32_t)M->leading_dimension + 1);
    for (k = M->column_starts[i]; M->row_indices[k] != i; k++)
        ;
    return k;
}

/* sources[k] = last - k, and the numbers there, over `scale` (a power of 2) or as they are. */
static int32_t *turn_round(double *to, int32_t last, const double *values, int32_t count,
                           const double *scale)
{
    int32_t *sources = fuzz_take(count, sizeof *sources), k;

    for (k = 0; k < count; k++) {
        sources[k] = last - k;
        to[last - k] = scale ? values[k] / scale[k] : values[k];
    }
    return sources;
}

static void make_matrices(fuzz_bytes *bytes, const dynamics_problem *d, simulator *sim)
{
    perp_contact_step *s = &sim->step;
    int32_t *diagonal = fuzz_take(d->n, sizeof *diagonal), i;
    double *scale = NULL;

    s->M_entries = count_numbers(&d->M);
    s->H_entries = count_numbers(&d->H);
    s->G_entries = d->bilateral > 0 ? count_numbers(&d->G) : 0;
    s->M = (double *)d->M.view.values;
    s->H = (double *)d->H.view.values;
    s->G = s->G_entries > 0 ? (double *)d->G.view.values : NULL;
    sim->mass = fuzz_doubles(s->M_entries);
    sim->J = fuzz_doubles(s->H_entries + s->G_entries);
    if (fuzz_one_in(bytes, 2)) {
        scale = fuzz_doubles(s->H_entries);
        for (i = 0; i < s->H_entries; i++)
            scale[i] = i % 3 == 1 ? -1.0 : 1.0;
    }
    s->mass_sources = turn_round(sim->mass, s->M_entries - 1, s->M, s->M_entries, NULL);
    s->H_sources = turn_round(sim->J, s->H_entries - 1, s->H, s->H_entries, scale);
    s->G_sources = turn_round(sim->J, s->H_entries + s->G_entries - 1, s->G, s->G_entries, NULL);
    s->H_scale = scale;
    for (i = 0; i < d->n; i++)
        diagonal[i] = find_diagonal(&d->M.view, i);
    s->mass_diagonal = diagonal;
    if (fuzz_one_in(bytes, 2)) {
        sim->damping = fuzz_doubles(d->n);
        for (i = 0; i < d->n; i++)
            sim->damping[i] = fuzz_pick(bytes, 4) * s->M[diagonal[i]]; /* no worse conditioned */
    }
}

static void make_lists(const laws_problem *p, const dynamics_problem *d, simulator *sim)
{
    perp_contact_step *s = &sim->step;
    int32_t *places = fuzz_take(p->rows, sizeof *places), k;
    int32_t *gap_rows = fuzz_take(p->laws.contacts, sizeof *gap_rows);
    int32_t *gap_sources = fuzz_take(p->laws.contacts, sizeof *gap_sources);

    s->n = d->n;
    s->contacts = s->gap_count = p->laws.contacts;
    s->bilateral = d->bilateral;
    s->rows = p->rows - d->bilateral;
    s->J_rows = p->rows + 2;
    for (k = 0; k < p->rows; k++)
        places[k] = p->rows + (k < s->rows) - k;
    for (k = 0; k < s->contacts; k++) {
        gap_rows[k] = p->first[k];
        gap_sources[k] = places[p->first[k]];
    }
    s->H_rows = places, s->G_rows = places + s->rows;
    s->gap_rows = gap_rows, s->gap_sources = gap_sources;
}

/* Loads that move things, none, or such as the contacts bear at rest. */
static void make_loads(fuzz_bytes *bytes, fuzz_mood mood, const laws_problem *p,
                       const dynamics_problem *d, simulator *sim)
{
    int32_t kind = fuzz_pick(bytes, 3), i, k;

    fuzz_numbers(bytes, mood, sim->velocity, d->n);
    fuzz_numbers(bytes, mood, sim->force, d->n);
    fuzz_numbers(bytes, mood, sim->gaps, sim->step.J_rows);
    for (i = 0; i < d->n && kind > 0; i++) {
        sim->velocity[i] = sim->force[i] = 0.0;
        for (k = 0; k < p->laws.contacts && kind > 1; k++)
            sim->force[i] -= d->H.dense[p->first[k] * d->n + i];
    }
    for (k = 0; k < sim->step.J_rows && kind > 0; k++)
        sim->gaps[k] = 0.0;
}

static void make_simulator(fuzz_bytes *bytes, fuzz_mood mood, const laws_problem *p,
                           dynamics_problem *d, simulator *sim)
{
    static const double times[] = {0.0009765625, 0.01, 1.0, 1e-6};
    perp_contact_step *s = &sim->step;

    memset(sim, 0, sizeof *sim);
    if (perp_contact_step_init(s, sizeof *s) != PERP_OK)
        fuzz_fail("perp_contact_step_init takes its own size");
    make_lists(p, d, sim);
    make_matrices(bytes, d, sim);
    sim->velocity = fuzz_doubles(d->n), sim->force = fuzz_doubles(d->n);
    sim->gaps = fuzz_doubles(s->J_rows);
    make_loads(bytes, mood, p, d, sim);
    s->h = times[fuzz_pick(bytes, 4)];
    s->correction = fuzz_pick(bytes, 3) * 0.25;
    sim->at_J = sim->J, sim->at_gaps = sim->gaps;
    s->mass = sim->mass, s->damping = sim->damping, s->velocity = sim->velocity;
    s->force = sim->force, s->J = &sim->at_J, s->gaps = &sim->at_gaps;
    s->f = d->f, s->w = d->w, s->b = d->b;
    s->start = fuzz_doubles(p->rows);
    memset(s->start, 0, (size_t)p->rows * sizeof *s->start);
}

/* Outputs that nobody has written to. */
static void renew_outputs(const laws_problem *p, const dynamics_problem *d, simulator *sim)
{
    perp_contact_step *s = &sim->step;

    s->v = fuzz_doubles(d->n), s->r = fuzz_doubles(p->rows), s->u = fuzz_doubles(p->rows);
    s->modes = fuzz_take(p->laws.contacts + p->laws.bounded, sizeof *s->modes);
    s->acceleration = fuzz_doubles(d->n), s->force_of_rows = fuzz_doubles(d->n);
    s->shift = fuzz_doubles(d->n);
    sim->at_force = fuzz_doubles(s->J_rows);
    s->row_force = &sim->at_force;
}

/* M and f are what the simulator's numbers make, to rounding; then M.dense is what is solved. */
static void check_gathered(const laws_problem *p, dynamics_problem *d, const simulator *sim)
{
    const perp_contact_step *s = &sim->step;
    int32_t i, j, k;

    for (i = 0; i < d->n; i++)
        if (sim->damping)
            d->M.dense[i * d->n + i] = s->M[s->mass_diagonal[i]];
    for (i = 0; i < d->n; i++) {
        wide sum = (wide)s->h * sim->force[i] - d->f[i], size = oracle_abs(d->f[i]);
        wide M = sim->mass[s->mass_sources[s->mass_diagonal[i]]];

        M += sim->damping ? (wide)s->h * sim->damping[i] : 0;
        if (oracle_abs(M - d->M.dense[i * d->n + i]) > M * (wide)0x1p-51 + (wide)0x1p-1072)
            fuzz_fail("step: M(%d,%d) has h damping on it", i, i);
        size += oracle_abs((wide)s->h * sim->force[i]);
        for (j = 0; j < d->n; j++) {
            sum += (wide)d->M.dense[i * d->n + j] * sim->velocity[j];
            size += oracle_abs((wide)d->M.dense[i * d->n + j] * sim->velocity[j]);
        }
        if (oracle_abs(sum) > size * (wide)0x1p-48 + (wide)0x1p-1068)
            fuzz_fail("step: f = M velocity + h force: row %d", i);
    }
    for (k = 0; k < s->contacts; k++) {
        double gap = sim->gaps[s->gap_sources[k]];

        if (d->w[p->first[k]] != (gap > 0 ? gap / s->h : 0.0) || s->least_gap > gap)
            fuzz_fail("step: w = gap / h: contact %d", k);
    }
}

/* What is handed back follows from v and r, to the bit where one division makes it. */
static void check_handed(const laws_problem *p, const dynamics_problem *d, const simulator *sim)
{
    const perp_contact_step *s = &sim->step;
    int32_t i, j, slips = 0;

    for (i = 0; i < d->n; i++) {
        wide sum = 0, size = 0;

        if (s->acceleration[i] != (s->v[i] - sim->velocity[i]) / s->h || fabs(s->v[i]) > s->fastest)
            fuzz_fail("step: acceleration = (v - velocity) / h: %d", i);
        for (j = 0; j < p->rows; j++) {
            wide term =
                (j < s->rows ? d->H.dense[j * d->n + i] : d->G.dense[(j - s->rows) * d->n + i]) *
                (wide)s->r[j] / s->h;

            sum += term;
            size += oracle_abs(term);
        }
        if (size < (wide)1e300 &&
            oracle_abs(sum - s->force_of_rows[i]) > size * (wide)0x1p-46 + (wide)0x1p-1064 / s->h)
            fuzz_fail("step: force_of_rows = (H'r + G's) / h: %d", i);
    }
    for (j = 0; j < p->rows; j++)
        if (s->start[j] != s->r[j] ||
            sim->at_force[j < s->rows ? s->H_rows[j] : s->G_rows[j - s->rows]] != s->r[j] / s->h)
            fuzz_fail("step: row_force = r / h and start = r: row %d", j);
    for (i = 0; i < d->n && s->shifts; i++)
        if (!isfinite(s->shift[i]) || !(s->least_gap < 0.0))
            fuzz_fail("step: shift is of something that overlaps: %d", i);
    for (j = 0; j < s->contacts; j++)
        slips += s->modes[j] == PERP_CONTACT_SLIP;
    if (s->slips != slips || (s->rests && s->fastest != 0.0))
        fuzz_fail("step: slips, rests");
}

static int take_step(perp_context *context, perp_contact_solver *solver,
                     const perp_contact_settings *settings, const laws_problem *p,
                     dynamics_problem *d, simulator *sim)
{
    perp_contact_step *s = &sim->step;
    wide *W = fuzz_take(p->rows * p->rows, sizeof *W), *q = fuzz_take(p->rows, sizeof *q);
    wide *t = fuzz_take(p->rows, sizeof *t);
    perp_contact_result result;
    int32_t i;

    if (perp_contact_result_init(&result, sizeof result) != PERP_OK)
        fuzz_fail("perp_contact_result_init takes its own size");
    if (s->rests) {
        if (perp_contact_solver_step(solver, s, &result, &p->laws, &d->dynamics) != PERP_OK ||
            !s->was_known)
            fuzz_fail("step: the same numbers at rest are known");
        check_handed(p, d, sim);
        return 1;
    }
    renew_outputs(p, d, sim);
    if (!fuzz_status_of(
            context, perp_contact_solver_step(solver, s, &result, &p->laws, &d->dynamics), "step",
            (const void *[]){s->v, s->r, s->u, s->modes, s->acceleration, s->force_of_rows,
                             sim->at_force, NULL}))
        return 0;
    check_gathered(p, d, sim);
    for (i = 0; i < p->rows; i++)
        if (!isfinite(s->r[i]) || !isfinite(s->r[i] / s->h))
            return 0;
    for (i = 0; i < d->n; i++)
        if (!isfinite(s->v[i]))
            return 0;
    check_handed(p, d, sim);
    reduce(p, d, oracle_limit(result.outcome, settings->tol), s->r, W, q, t);
    laws_check("step", p, W, q, t, settings, &result, s->r, s->u, s->modes);
    if (fuzz_good(result.outcome))
        check_momentum(p, d, settings->tol, s->v, s->r, find_impulses(p, W, t));
    return 1;
}

/* A number that is none is refused however often it comes, whatever was known before. */
static void refuse_a_number(fuzz_bytes *bytes, perp_context *context, perp_contact_solver *solver,
                            const laws_problem *p, const dynamics_problem *d, simulator *sim)
{
    perp_contact_step *s = &sim->step;
    double *numbers[] = {sim->velocity, sim->force,
                         &sim->mass[s->mass_sources[s->mass_diagonal[0]]]};
    double *bad = numbers[fuzz_pick(bytes, 3)], was = *bad;
    perp_contact_result result;
    int k;

    *bad = NAN;
    if (perp_contact_result_init(&result, sizeof result) != PERP_OK)
        fuzz_fail("perp_contact_result_init takes its own size");
    for (k = 0; k < 2; k++) {
        renew_outputs(p, d, sim);
        if (fuzz_status_of(context,
                           perp_contact_solver_step(solver, s, &result, &p->laws, &d->dynamics),
                           "step",
                           (const void *[]){s->v, s->r, s->u, s->modes, s->acceleration,
                                            s->force_of_rows, sim->at_force, NULL}))
            fuzz_fail("step: a NaN is refused");
    }
    *bad = was;
}

/* Steps: cold, warm, with the same numbers, after a refusal; then what is handed back again. */
static void simulate(fuzz_bytes *bytes, fuzz_mood mood, perp_context *context,
                     perp_contact_solver *solver, const perp_contact_settings *settings,
                     const laws_problem *p, dynamics_problem *d)
{
    simulator sim;
    perp_contact_step *s = &sim.step;
    int32_t rested;

    make_simulator(bytes, mood, p, d, &sim);
    fuzz_show("velocity", sim.velocity, d->n);
    fuzz_show("force", sim.force, d->n);
    fuzz_show("gaps", sim.gaps, s->J_rows);
    if (!take_step(context, solver, settings, p, d, &sim))
        return;
    s->warm = 1;
    if (!take_step(context, solver, settings, p, d, &sim))
        return;
    rested = s->rests;
    if (perp_contact_solver_hand_back(solver, s) != PERP_OK)
        fuzz_fail("hand_back takes what a step handed back");
    check_handed(p, d, &sim);
    refuse_a_number(bytes, context, solver, p, d, &sim);
    if (s->rests)
        fuzz_fail("step: nothing rests where numbers were refused");
    if (take_step(context, solver, settings, p, d, &sim) && rested && s->was_known)
        fuzz_fail("step: what came before a refusal is not known");
    s->rests = 0;
    make_loads(bytes, mood, p, d, &sim);
    take_step(context, solver, settings, p, d, &sim);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_bytes bytes = {data, data + size};
    perp_context *context = fuzz_open(&bytes, 1);
    fuzz_mood mood = fuzz_mood_of(&bytes);
    perp_contact_solver *solver = NULL;
    perp_contact_settings settings;
    laws_problem p;
    dynamics_problem d;
    int32_t times;

    laws_make(&bytes, mood, &p);
    laws_settings_make(&bytes, &settings, &p);
    make(&bytes, mood, &p, &d);
    times = 1 + fuzz_pick(&bytes, 3);
    fuzz_show("M", d.M.dense, d.n * d.n);
    fuzz_show("H", d.H.dense, (p.rows - d.bilateral) * d.n);
    fuzz_show("G", d.G.dense, d.bilateral * d.n);
    fuzz_show("f", d.f, d.n);
    fuzz_show("w", d.w, p.rows);
    fuzz_show("tol", &settings.tol, 1);
    if (fuzz_status(context, perp_contact_solver_create(context, &solver, &settings), "create") &&
        fuzz_status(context, perp_contact_solver_setup_dynamics(solver, &p.laws, &d.dynamics),
                    "setup"))
        while (times-- > 0) {
            solve(&bytes, context, solver, &settings, &p, &d);
            fuzz_numbers(&bytes, mood, d.w, p.rows);
        }
    if (solver && d.dynamics.M && fuzz_one_in(&bytes, 2))
        simulate(&bytes, mood, context, solver, &settings, &p, &d);
    perp_contact_solver_destroy(solver);
    fuzz_close(context);
    return 0;
}
