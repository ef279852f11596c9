/* The contact solver over dynamics: bodies (blocks of 3 or 6), dense and sparse M or a callback in
 * its place, joints, several solves with warm starts. */
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
static void reduce(const laws_problem *p, const dynamics_problem *d, const double *r, wide *W,
                   wide *q, wide *t)
{
    int32_t n = d->n, rows = p->rows, i, j, k;
    wide *M = oracle_wide(n * n, d->M.dense), *X = fuzz_take(n * (rows + 1), sizeof *X);
    wide *all = fuzz_take(rows * n, sizeof *all);

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
    for (i = 0; i < rows; i++) {
        t[i] = oracle_abs(d->w[i]);
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

static void solve(fuzz_bytes *bytes, perp_context *context, perp_contact_solver *solver,
                  const perp_contact_settings *settings, const laws_problem *p, dynamics_problem *d)
{
    double *v = fuzz_doubles(d->n), *r = fuzz_doubles(p->rows), *u = fuzz_doubles(p->rows);
    double *ray = fuzz_doubles(p->rows), *r0 = fuzz_doubles(p->rows);
    int32_t *modes = fuzz_take(p->laws.contacts, sizeof *modes);
    wide *W = fuzz_take(p->rows * p->rows, sizeof *W), *q = fuzz_take(p->rows, sizeof *q);
    wide *t = fuzz_take(p->rows, sizeof *t);
    perp_contact_result result;
    int warm = fuzz_one_in(bytes, 3), i;

    fuzz_show("r", r, p->rows);
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
    reduce(p, d, r, W, q, t);
    laws_check("contact", p, W, q, t, settings, &result, r, u, modes);
    if (fuzz_good(result.outcome))
        check_momentum(p, d, settings->tol, v, r, find_impulses(p, W, t));
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
    if (fuzz_status(context, perp_contact_solver_create(context, &solver, &settings), "create") &&
        fuzz_status(context, perp_contact_solver_setup_dynamics(solver, &p.laws, &d.dynamics),
                    "setup"))
        while (times-- > 0) {
            solve(&bytes, context, solver, &settings, &p, &d);
            fuzz_numbers(&bytes, mood, d.w, p.rows);
        }
    perp_contact_solver_destroy(solver);
    fuzz_close(context);
    return 0;
}
