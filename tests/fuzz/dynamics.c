#include "dynamics.h"

#include <float.h>
#include <math.h>
#include <string.h>

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

void dynamics_make_rows(fuzz_bytes *bytes, fuzz_mood mood, fuzz_matrix *H, int32_t rows, int32_t n,
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

void dynamics_make(fuzz_bytes *bytes, fuzz_mood mood, const laws_problem *p, dynamics_problem *d)
{
    static const int32_t blocks[] = {3, 6, 1, VELOCITIES};
    int32_t block = blocks[fuzz_pick(bytes, 4)], n = d->n = 1 + fuzz_pick(bytes, VELOCITIES);
    fuzz_mood rows_mood = mood == FUZZ_WIDE ? FUZZ_MODERATE : mood;

    d->calls = 0;
    d->abort_at = -1;
    d->bilateral = p->laws.bilateral;
    fuzz_fill_definite(bytes, mood, &d->M, n, block);
    dynamics_make_rows(bytes, rows_mood, &d->H, p->rows - d->bilateral, n, block);
    dynamics_make_rows(bytes, rows_mood, &d->G, d->bilateral, n, block);
    d->f = fuzz_doubles(n);
    d->w = fuzz_doubles(p->rows);
    d->b = &d->w[p->rows - d->bilateral];
    fuzz_numbers(bytes, mood, d->f, n);
    fuzz_numbers(bytes, mood, d->w, p->rows);
    if (perp_struct_init(&d->dynamics, sizeof d->dynamics) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
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

/* What velocities are known to where f, that acts, has roundings: |M^-1| |f|. */
static wide *find_acting(const dynamics_problem *d)
{
    int32_t n = d->n, k;
    wide *M = oracle_wide(n * n, d->M.dense), *X = fuzz_take(n * n, sizeof *X);
    wide *acting = fuzz_take(n, sizeof *acting);

    for (k = 0; k < n * n; k++)
        X[k] = k % (n + 1) == 0;
    if (!oracle_solve(n, n, M, X))
        fuzz_fail("the target's M is singular");
    for (k = 0; k < n; k++)
        acting[k] = 0;
    for (k = 0; k < n * n; k++)
        acting[k / n] += oracle_abs(X[k]) * oracle_abs(d->f[k % n]);
    return acting;
}

/* X = M^-1 (rows' and f), in 113 bits. */
void dynamics_reduce(const laws_problem *p, const dynamics_problem *d, double limit,
                     const double *r, wide *W, wide *q, wide *t)
{
    int32_t n = d->n, rows = p->rows, i, j, k;
    wide *M = oracle_wide(n * n, d->M.dense), *X = fuzz_take(n * (rows + 1), sizeof *X);
    wide *all = fuzz_take(rows * n, sizeof *all), *acting = find_acting(d), most = 0;

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
        /* a velocity that is 0 is so to rounding of f and of the others; doubles end at 2^-1074 */
        for (k = 0; k < n; k++)
            t[i] += oracle_abs(all[i * n + k]) * (acting[k] * 4 * DBL_EPSILON / limit +
                                                  most * (wide)0x1p-80 + (wide)0x1p-1074 / limit);
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

/* What the terms of a contact's rows amount to as impulses: their length, as in the library. */
static wide *find_impulses(const laws_problem *p, const wide *W, const wide *t)
{
    wide *impulses = fuzz_take(p->rows, sizeof *impulses);
    int32_t l, k;

    for (l = 0; l < p->count; l++) {
        const oracle_law *law = &p->law[l];
        wide trace = 0, most = 0, squares = 0;

        for (k = law->block; k < law->block + law->block_rows; k++) {
            trace += W[k * p->rows + k];
            most = t[k] > most ? t[k] : most;
        }
        for (k = law->block; most > 0 && k < law->block + law->block_rows; k++)
            squares += (t[k] / most) * (t[k] / most);
        for (k = law->first; k < law->first + law->rows; k++)
            impulses[k] = trace > 0 ? most * oracle_sqrt(squares) / trace : 0;
    }
    return impulses;
}

/* M v = f + H'r + G's, row by row. Impulses carry roundings of their contact's terms. A velocity
 * that the rows which hold make 0.0, whatever the impulses, may take what docs/contact.md says:
 * 10 tol of what the terms of the contacts push, by which impulses may be wrong, and 1e-7 of that,
 * which M^-1 loses, as it loses it whatever tol is.
 * 1e-6: solves with M, of a condition below 10 in each block; 2^-960: smaller numbers have lost
 * digits to underflow. */
static void check_rows(const laws_problem *p, const dynamics_problem *d, double tol,
                       const double *v, const double *r, const wide *impulses)
{
    int32_t n = d->n, rows = p->rows, i, j;
    wide *sums = fuzz_take(n, sizeof *sums), *sizes = fuzz_take(n, sizeof *sizes), most = 0;

    fuzz_finite("v", v, n);
    for (i = 0; i < n; i++) {
        wide sum = -(wide)d->f[i], size = oracle_abs(sum), known = (wide)1e-6;

        for (j = 0; j < n; j++)
            if (d->M.dense[i * n + j] != 0.0 && v[j] == 0.0)
                known = (10.0 * tol + 1e-7) / 1e-6; /* size is times 1e-6 below */
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

void dynamics_check(const laws_problem *p, const dynamics_problem *d, double tol, const double *v,
                    const double *r, const wide *W, const wide *t)
{
    check_rows(p, d, tol, v, r, find_impulses(p, W, t));
}

/* ---- derivatives ----------------------------------------------------------------------------- */

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
void dynamics_differentiate(perp_context *context, const perp_contact_settings *settings,
                            const laws_problem *p, dynamics_problem *d, const double *r)
{
    int32_t n = d->n, rows = p->rows, i;
    double *dv = fuzz_doubles(n), *dr = fuzz_doubles(rows), *df = fuzz_doubles(n);
    double *dw = fuzz_doubles(rows), *x = fuzz_doubles(n), *y = fuzz_doubles(rows), known;
    double *gv = fuzz_doubles(n), *gr = fuzz_doubles(rows);
    perp_contact_sensitivity *sensitivity = NULL;
    perp_contact_sensitivity_info info;
    wide size = 0, forward, adjoint;

    if (perp_struct_init(&info, sizeof info) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    if (!fuzz_status(
            context,
            perp_contact_sensitivity_create(context, &sensitivity, &info, settings,
                                            DYNAMICS(&p->laws, &d->dynamics, d->f, d->w, d->b), r),
            "sensitivity_create"))
        return;
    for (i = 0; i < n; i++)
        df[i] = 1.0 + i % 3, gv[i] = 2.0 - i % 4;
    for (i = 0; i < rows; i++)
        dw[i] = 1.0 - i % 2, gr[i] = 1.0 + i % 2;
    if (!fuzz_status_of(context,
                        perp_contact_sensitivity_forward(
                            sensitivity, dv, dr,
                            DIRECTION(df, dw, dw + rows - d->bilateral, NULL, NULL, NULL, NULL)),
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
