#include "oracle.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "fuzz.h"

wide *oracle_wide(int32_t count, const double *x)
{
    wide *copy = fuzz_take(count, sizeof *copy);
    int32_t i;

    for (i = 0; i < count; i++)
        copy[i] = x[i];
    return copy;
}

wide oracle_abs(wide x)
{
    return x < 0 ? -x : x;
}

/* long double has the exponents of __float128 on x86; one Newton step doubles its digits. */
wide oracle_sqrt(wide x)
{
    wide root = sqrtl((long double)x);

    return root > 0 ? (root + x / root) / 2 : 0;
}

static wide larger(wide a, wide b)
{
    return a > b ? a : b;
}

void oracle_multiply(int32_t rows, int32_t columns, const wide *A, const wide *x, const wide *add,
                     wide *w, wide *t)
{
    int32_t i, j;

    for (i = 0; i < rows; i++) {
        wide sum = add ? add[i] : 0, size = oracle_abs(sum);

        for (j = 0; j < columns; j++) {
            sum += A[i * columns + j] * x[j];
            size += oracle_abs(A[i * columns + j] * x[j]);
        }
        w[i] = sum;
        if (t)
            t[i] = size;
    }
}

/* The row at or below k with the largest entry of column k beside its own largest. */
static int32_t pivot_row(int32_t n, const wide *A, int32_t k)
{
    int32_t i, j, found = k;
    wide best = 0;

    for (i = k; i < n; i++) {
        wide largest = 0;

        for (j = k; j < n; j++)
            largest = larger(largest, oracle_abs(A[i * n + j]));
        if (largest > 0 && oracle_abs(A[i * n + k]) / largest > best) {
            best = oracle_abs(A[i * n + k]) / largest;
            found = i;
        }
    }
    return found;
}

static void exchange(wide *a, wide *b, int32_t count)
{
    int32_t k;

    for (k = 0; k < count; k++) {
        wide kept = a[k];

        a[k] = b[k];
        b[k] = kept;
    }
}

int oracle_solve(int32_t n, int32_t columns, wide *A, wide *b)
{
    int32_t i, j, k;

    for (k = 0; k < n; k++) {
        int32_t p = pivot_row(n, A, k);

        if (A[p * n + k] == 0)
            return 0;
        exchange(&A[p * n], &A[k * n], n);
        exchange(&b[p * columns], &b[k * columns], columns);
        for (i = 0; i < n; i++) {
            wide factor = i == k ? 0 : A[i * n + k] / A[k * n + k];

            if (factor == 0)
                continue;
            for (j = k; j < n; j++)
                A[i * n + j] -= factor * A[k * n + j];
            for (j = 0; j < columns; j++)
                b[i * columns + j] -= factor * b[k * columns + j];
        }
    }
    for (k = 0; k < n; k++)
        for (j = 0; j < columns; j++)
            b[k * columns + j] /= A[k * n + k];
    return 1;
}

/* ---- what a row carries ---------------------------------------------------------------------- */

/* The largest log2 |A_ij| + e_i + e_j of row and column i; -inf where both are empty. */
static long double largest_of(int32_t n, const wide *A, const long double *e, int32_t i)
{
    long double largest = -INFINITY;
    int32_t j;

    for (j = 0; j < n; j++) {
        wide x = larger(oracle_abs(A[i * n + j]), oracle_abs(A[j * n + i]));

        if (x > 0)
            largest = fmaxl(largest, log2l((long double)x) + e[i] + e[j]);
    }
    return largest;
}

/* Units in which diagonals are 1, and of a row that has none the largest coupling to those that are
 * known, level after level; else the caller's. */
static void start_at_diagonals(int32_t n, const wide *A, long double *e)
{
    int *known = fuzz_take(n, sizeof *known), *found = fuzz_take(n, sizeof *found), changed = 1;
    int32_t i, j;

    for (i = 0; i < n; i++) {
        const long double size = (long double)oracle_abs(A[i * n + i]);

        known[i] = size > 0;
        e[i] = known[i] ? -log2l(size) / 2 : 0;
    }
    while (changed) {
        memcpy(found, known, (size_t)n * sizeof *found);
        for (changed = 0, i = 0; i < n; i++) {
            long double largest = -INFINITY;

            for (j = 0; j < n && !known[i]; j++) {
                wide x = larger(oracle_abs(A[i * n + j]), oracle_abs(A[j * n + i]));

                if (x > 0 && known[j])
                    largest = fmaxl(largest, log2l((long double)x) + e[j]);
            }
            if (isfinite(largest)) {
                e[i] = -largest;
                found[i] = changed = 1;
            }
        }
        memcpy(known, found, (size_t)n * sizeof *known);
    }
}

/* Ruiz' equilibration: rows and columns by 2^e_i; half of what is missing in each of 20 rounds, row
 * after row from the caller's units, or all at once from those (way 2), or of the diagonal (1). */
static void equilibrate(int32_t n, const wide *A, int way, long double *e)
{
    long double *last = fuzz_take(n, sizeof *last);
    int32_t round, i;

    memset(e, 0, (size_t)n * sizeof *e);
    if (way == 1)
        start_at_diagonals(n, A, e);
    for (round = 0; round < 20; round++) {
        memcpy(last, e, (size_t)n * sizeof *e);
        for (i = 0; i < n; i++) {
            long double largest = largest_of(n, A, way > 0 ? last : e, i);

            if (isfinite(largest))
                e[i] -= largest / 2;
        }
    }
    for (i = 0; i < n; i++)
        e[i] = roundl(fminl(fmaxl(e[i], -8000), 8000));
}

typedef struct scaled {
    int32_t n;
    wide *A, *D; /* equilibrated, |entries|; the factors */
    wide *t;     /* in those units */
    int *joined; /* n by n: significant */
} scaled;

/* What is significant depends a little on how units were made equal: at the edge it counts. */
static void find_significant(scaled *s, double tol)
{
    wide *largest = fuzz_take(s->n, sizeof *largest);
    int32_t n = s->n, i, j;

    for (i = 0; i < n; i++)
        for (j = 0, largest[i] = 0; j < n; j++)
            largest[i] = larger(largest[i], larger(s->A[i * n + j], s->A[j * n + i]));
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            s->joined[i * n + j] =
                s->A[i * n + j] > 0 &&
                s->A[i * n + j] >= 0.25 * oracle_sqrt(tol) * larger(largest[i], largest[j]);
}

static scaled scale(int32_t n, const wide *A, const wide *t, double tol, int way)
{
    long double *e = fuzz_take(n, sizeof *e);
    scaled s = {n, fuzz_take(n * n, sizeof(wide)), fuzz_take(n, sizeof(wide)),
                fuzz_take(n, sizeof(wide)), fuzz_take(n * n, sizeof(int))};
    int32_t i, j;

    equilibrate(n, A, way, e);
    for (i = 0; i < n; i++)
        s.D[i] = exp2l(e[i]);
    for (i = 0; i < n; i++) {
        s.t[i] = t[i] * s.D[i];
        for (j = 0; j < n; j++)
            s.A[i * n + j] = oracle_abs(A[i * n + j]) * s.D[i] * s.D[j];
    }
    find_significant(&s, tol);
    return s;
}

/* largest[i] := the largest t of the rows that row i is connected with; those of a block are. */
static void spread(const scaled *s, const int32_t *block, wide *largest)
{
    int32_t n = s->n, i, j, changed = 1;

    memcpy(largest, s->t, (size_t)n * sizeof *largest);
    while (changed)
        for (changed = 0, i = 0; i < n; i++)
            for (j = 0; j < n; j++)
                if ((s->joined[i * n + j] || s->joined[j * n + i] ||
                     (block && block[i] == block[j])) &&
                    largest[j] > largest[i]) {
                    largest[i] = largest[j];
                    changed = 1;
                }
}

/* What the couplings of row i that are not significant bring in, up to tol of what is carried where
 * they come from. */
static wide through_noise(const scaled *s, const wide *z, double tol, int32_t i)
{
    int32_t n = s->n, j, k;
    wide sum = 0;

    for (j = 0; j < n; j++) {
        wide from = 0, brought = s->A[i * n + j] * oracle_abs(z[j]) / s->D[j];

        for (k = 0; k < n; k++)
            if (s->joined[k * n + j])
                from = larger(from, s->t[k]);
        if (!s->joined[i * n + j])
            sum += brought < tol * from ? brought : tol * from;
    }
    return sum;
}

static void carry(int32_t n, const scaled *s, const wide *z, const int32_t *block, double tol,
                  int unit, wide *carried, wide *zhat)
{
    wide *near = fuzz_take(n, sizeof *near), *largest = fuzz_take(n, sizeof *largest);
    int32_t i, j, empty;

    for (j = 0; j < n; j++)
        for (near[j] = oracle_abs(z[j]) / s->D[j], i = 0; i < n; i++)
            if (s->joined[i * n + j])
                near[j] = larger(near[j], s->t[i] / s->A[i * n + j]);
    spread(s, block, largest);
    for (i = 0; i < n; i++) {
        wide sum = s->t[i] + larger(1e-5, 16 * DBL_EPSILON / tol) * largest[i] +
                   through_noise(s, z, tol, i) / tol + unit * larger(1, s->D[i]);

        for (j = 0; j < n; j++)
            sum += s->A[i * n + j] * near[j];
        carried[i] = larger(carried[i], sum / s->D[i]);
        for (empty = 1, j = 0; j < n; j++)
            empty = empty && s->A[j * n + i] == 0;
        if (zhat) /* a variable of no row has no unit but 1 */
            zhat[i] = larger(zhat[i], empty ? larger(near[i] * s->D[i], 1) : near[i] * s->D[i]);
    }
}

void oracle_carried(int32_t n, const wide *A, const wide *z, const wide *t, const int32_t *block,
                    double tol, int unit, wide *carried, wide *zhat)
{
    int32_t i, way;

    for (i = 0; i < n; i++) {
        carried[i] = 0;
        if (zhat)
            zhat[i] = 0;
    }
    for (way = 0; way < 3; way++) {
        const scaled s = scale(n, A, t, tol, way);

        carry(n, &s, z, block, tol, unit, carried, zhat);
    }
}

/* What row i is off by because numbers end at 2^-1074. */
static wide grain(int32_t n, const wide *row)
{
    wide sum = 0;
    int32_t j;

    for (j = 0; j < n; j++)
        sum += oracle_abs(row[j]);
    return sum * (wide)0x1p-1073 + (wide)0x1p-1073;
}

double oracle_limit(int32_t outcome, double tol)
{
    return 1e3 * (outcome == PERP_OUTCOME_SOLVED ? fmax(tol, 16 * DBL_EPSILON)
                                                 : sqrt(fmax(tol, 16 * DBL_EPSILON)));
}

/* ---- complementarity with bounds ------------------------------------------------------------- */

/* The violation of row i at a point whose z_i may be off a bound by `slack`. */
static wide violation(const oracle_point *p, int32_t i, wide slack)
{
    wide z = p->z[i], w = p->w[i], worst = oracle_abs(w);

    if (p->lower[i] == p->upper[i])
        return 0;
    if (isfinite(p->lower[i]) && z - p->lower[i] <= slack && w >= 0)
        return 0;
    if (isfinite(p->upper[i]) && p->upper[i] - z <= slack && w <= 0)
        return 0;
    return worst;
}

static void check_bounds(const oracle_point *p)
{
    int32_t i;

    for (i = 0; i < p->n; i++)
        if (!(p->z[i] >= p->lower[i] && p->z[i] <= p->upper[i]) && !isnan(p->z[i]))
            fuzz_fail("%s: z is within the bounds: z[%d] = %.17g, [%.17g, %.17g]", p->where, i,
                      p->z[i], p->lower[i], p->upper[i]);
}

/* Whether no row can tell where between its bounds z_i is: then it is as good as fixed. */
static int is_pinned(const oracle_point *p, const wide *M, int32_t i, double limit,
                     const wide *carried)
{
    const wide width = (wide)p->upper[i] - p->lower[i];
    int32_t k;

    for (k = 0; k < p->n; k++)
        if (!(oracle_abs(M[k * p->n + i]) * width <= limit * carried[k]))
            return 0;
    return isfinite(p->lower[i]) && isfinite(p->upper[i]);
}

/* Whether units may be farther apart than docs/lcp.md promises anything for: entries of a problem
 * whose units are within 1e12 of each other are within 1e24. */
static int has_far_units(int32_t entries, const double *M)
{
    double least = INFINITY, most = 0.0;
    int32_t k;

    for (k = 0; k < entries; k++)
        if (M[k] != 0.0) {
            least = fmin(least, fabs(M[k]));
            most = fmax(most, fabs(M[k]));
        }
    return most * 1e-24 > least;
}

void oracle_check_point(const oracle_point *p)
{
    double limit = oracle_limit(p->outcome, p->tol);
    int mark = fuzz_mark();
    wide *carried = fuzz_take(p->n, sizeof *carried), *zhat = fuzz_take(p->n, sizeof *zhat);
    wide *M, *z;
    int32_t i;

    check_bounds(p);
    if (!fuzz_good(p->outcome))
        return;
    fuzz_finite("z", p->z, p->n);
    if (limit > 0.1 || has_far_units(p->n * p->n, p->M))
        return;
    M = oracle_wide(p->n * p->n, p->M);
    z = oracle_wide(p->n, p->z);
    for (i = 0; p->start && i < p->n; i++)
        z[i] = larger(oracle_abs(z[i]), oracle_abs(p->start[i]) * (wide)0x1p-20);
    oracle_carried(p->n, M, z, p->t, NULL, p->tol, p->homogeneous, carried, zhat);
    for (i = 0; i < p->n; i++) {
        wide v = violation(p, i, limit * zhat[i]);

        if (v > limit * carried[i] + grain(p->n, &M[i * p->n]) &&
            !is_pinned(p, M, i, limit, carried))
            fuzz_fail("%s: '%s' with tol %g: row %d is violated by %.3Lg, it and its neighbours "
                      "carry %.3Lg (ratio %.3Lg)",
                      p->where, perp_outcome_text(p->outcome), p->tol, i, (long double)v,
                      (long double)carried[i], (long double)(v / carried[i]));
    }
    fuzz_drop_to(mark);
}

int oracle_is_exact(const oracle_point *p)
{
    int32_t i;

    for (i = 0; i < p->n; i++)
        if (!isfinite(p->z[i]) || violation(p, i, 0) != 0)
            return 0;
    return 1;
}

/* ---- contact laws ---------------------------------------------------------------------------- */

static wide norm(const wide *x, int32_t count)
{
    wide sum = 0;
    int32_t k;

    for (k = 0; k < count; k++)
        sum += x[k] * x[k];
    return oracle_sqrt(sum);
}

/* The radius of the disc that the impulses of a friction law stay in. */
static wide radius(const oracle_contacts *c, const oracle_law *law)
{
    wide N[3] = {1, 0, 0};
    int32_t k;

    for (k = 0; law->normal >= 0 && k < (law->normals > 0 ? law->normals : 1); k++)
        N[k] = c->r[law->normal + k];
    return law->mu * (law->normals > 0 ? norm(N, 3) : N[0]);
}

/* 1e-12: some roundings of the scaling into the disc; 1e-307: those at the end of the doubles. */
static void check_cone(const oracle_contacts *c, const oracle_law *law)
{
    wide *r = oracle_wide(law->rows, &c->r[law->first]);
    wide size = norm(r, law->rows);

    if (law->kind == ORACLE_NORMAL && !(r[0] >= 0))
        fuzz_fail("%s: r_n >= 0: row %d has %g", c->where, law->first, c->r[law->first]);
    if (law->kind == ORACLE_BOUNDED && !(r[0] >= law->lower && r[0] <= law->upper))
        fuzz_fail("%s: lower <= r <= upper: row %d has %.17g, [%g, %g]", c->where, law->first,
                  c->r[law->first], law->lower, law->upper);
    if (law->kind == ORACLE_FRICTION && size > radius(c, law) * (1 + (wide)1e-12) + (wide)1e-307)
        fuzz_fail("%s: impulses lie within their cones: row %d has %Lg, the cone %Lg", c->where,
                  law->first, (long double)size, (long double)radius(c, law));
}

/* How far r_t is from the projection of r_t - u_t / t onto the disc, in units of velocity. */
static wide slip_error(const oracle_contacts *c, const oracle_law *law, const wide *u, wide trace)
{
    wide moved[3], error[3], size, share;
    int32_t k;

    if (trace <= 0)
        return 0;
    for (k = 0; k < law->rows; k++)
        moved[k] = c->r[law->first + k] - u[law->first + k] / trace;
    size = norm(moved, law->rows);
    share = size > radius(c, law) ? radius(c, law) / size : 1;
    for (k = 0; k < law->rows; k++)
        error[k] = trace * (c->r[law->first + k] - share * moved[k]);
    return norm(error, law->rows);
}

static wide trace_of(const oracle_contacts *c, const oracle_law *law)
{
    wide trace = 0;
    int32_t k;

    for (k = 0; k < law->rows; k++)
        trace += c->W[(law->first + k) * c->rows + law->first + k];
    return trace;
}

/* How far r is from r - u / t between the bounds, in units of velocity. */
static wide bounded_error(const oracle_contacts *c, const oracle_law *law, wide u, wide trace)
{
    const wide r = c->r[law->first];
    wide low = trace * (r - law->lower), high = trace * (r - law->upper);

    if (law->lower == law->upper)
        return 0;
    low = isfinite(law->lower) && low < u ? low : u; /* the middle of low, u and high */
    return oracle_abs(isfinite(law->upper) && high > low ? high : low);
}

static wide law_error(const oracle_contacts *c, const oracle_law *law, const wide *u)
{
    const wide trace = trace_of(c, law);
    wide pressed;

    switch (law->kind) {
    case ORACLE_NORMAL:
        pressed = trace * c->r[law->first];
        return oracle_abs(u[law->first] < pressed ? u[law->first] : pressed);
    case ORACLE_FRICTION:
        return law->polyhedral ? 0 : slip_error(c, law, u, trace);
    case ORACLE_BOUNDED:
        return bounded_error(c, law, u[law->first], trace);
    default:
        return norm(&u[law->first], law->rows);
    }
}

static void check_law(const oracle_contacts *c, const oracle_law *law, const wide *u,
                      const wide *carried)
{
    static const char *const names[] = {"Signorini's law", "Coulomb's law", "a bilateral row",
                                        "a row with bounds"};
    wide most = 0, error = law_error(c, law, u);
    double limit = oracle_limit(c->outcome, c->tol);
    int32_t k;

    for (k = law->block; k < law->block + law->block_rows; k++)
        most = larger(most, carried[k] + grain(c->rows, &c->W[k * c->rows]) / limit);
    if (law->kind == ORACLE_FRICTION && law->normal < 0) /* what the bound itself can stop */
        most = larger(most, trace_of(c, law) * law->mu);
    for (k = law->first; k < law->first + law->rows; k++) /* r is a double, whatever it does */
        most = larger(most, 4 * DBL_EPSILON / limit * trace_of(c, law) * oracle_abs(c->r[k]));
    if (most < (wide)0x1p-960) /* such numbers have lost digits to underflow on their way */
        return;
    if (error > limit * most)
        fuzz_fail("%s: '%s' with tol %g: %s at row %d is violated by %.3Lg, its terms are %.3Lg "
                  "(ratio %.3Lg)",
                  c->where, perp_outcome_text(c->outcome), c->tol, names[law->kind], law->first,
                  (long double)error, (long double)most, (long double)(error / most));
    for (k = law->first; c->u && k < law->first + law->rows; k++)
        if (oracle_abs(c->u[k] - u[k]) > limit * most)
            fuzz_fail("%s: u is what the impulses lead to: u[%d] is %g instead of %Lg", c->where, k,
                      c->u[k], (long double)u[k]);
}

void oracle_check_contacts(const oracle_contacts *c)
{
    int32_t rows = c->rows, k, homogeneous = 1;
    wide *u = fuzz_take(rows, sizeof *u), *t = fuzz_take(rows, sizeof *t);
    wide *carried = fuzz_take(rows, sizeof *carried), *r = oracle_wide(rows, c->r);
    int32_t *block = fuzz_take(rows, sizeof *block), i;

    if (fuzz_good(c->outcome))
        fuzz_finite("r", c->r, rows);
    for (k = 0; k < rows; k++)
        if (!isfinite(c->r[k]))
            return;
    for (k = 0; k < c->laws; k++)
        check_cone(c, &c->law[k]);
    if (!fuzz_good(c->outcome) || oracle_limit(c->outcome, c->tol) > 0.1)
        return;
    oracle_multiply(rows, rows, c->W, r, c->q, u, t);
    for (k = 0; k < rows; k++) {
        homogeneous = homogeneous && c->q[k] == 0;
        block[k] = k;
    }
    for (k = 0; k < c->laws; k++)
        for (i = 0; i < c->law[k].block_rows; i++)
            block[c->law[k].block + i] = c->law[k].block;
    oracle_carried(rows, c->W, r, c->t ? c->t : t, block, c->tol, homogeneous, carried, NULL);
    for (k = 0; k < c->laws; k++)
        check_law(c, &c->law[k], u, carried);
}
