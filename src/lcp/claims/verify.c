/* perp_lcp_verify: that a solution lies near z, proved for the caller's own doubles.
 *
 * The index set that z shows turns the problem into linear equations for the variables between
 * their bounds. If their matrix is regular they have one solution; if in an interval around it all
 * variables keep strictly within their bounds and every other w_i keeps its sign, then that
 * solution, with the other variables at their bounds, solves the problem. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/check.h"
#include "base/outcome.h"
#include "lcp/solver.h"
#include "linalg/verified.h"

typedef struct perp__verify {
    perp_context *context;
    perp__arena arena, dense_arena;
    perp_lcp_solver *solver; /* the problem, scaled by powers of two: exact but for underflow, which
                                the bounds count, and overflow, which makes them infinite */
    int32_t n;
    const double *z;          /* the caller's */
    perp__matrix M;           /* D M D */
    double *values;           /* its entries */
    int8_t *places;           /* enum perp__place */
    int32_t *active;          /* rows that are between, */
    int32_t *position, count; /* where a row is among them, or -1, and how many there are */
    double *high, *low;       /* the point whose neighbourhood is searched: high + low */
    double *w_high, *w_low;
    double *w, *width;        /* M (high + low) + q lies within width of w */
    double *delta;            /* the solution lies within delta of high + low */
    double *spread;           /* |M| delta */
    double *middle, *margin;  /* count: w and width of the active rows */
    double *step, *enclosure; /* count */
    int32_t *starts, *rows;   /* CSC: pattern of the active block */
    double *block;            /* CSC: its entries */
    perp__verified dense;     /* one of these two bounds |M_AA^-1 r| */
    perp__dominance dominance;
    int32_t uses_dense;
} perp__verify;

static void layout(perp__arena *arena, void *object)
{
    perp__verify *v = object;
    const size_t n = (size_t)v->n;
    const size_t entries = perp__scaled_entries(v->solver);

    v->values = perp__arena_take(arena, entries, sizeof(double));
    PERP__INTEGERS(arena, n, &v->active, &v->position);
    PERP__DOUBLES(arena, n, &v->high, &v->low, &v->w_high, &v->w_low, &v->w, &v->width, &v->delta,
                  &v->spread, &v->middle, &v->margin, &v->step, &v->enclosure);
    v->places = perp__arena_take(arena, n, sizeof(int8_t));
    if (v->solver->M.column_starts && v->n > PERP__SMALL_SPARSE) {
        v->starts = perp__arena_take(arena, n + 1, sizeof(int32_t));
        v->rows = perp__arena_take(arena, entries, sizeof(int32_t));
        v->block = perp__arena_take(arena, entries, sizeof(double));
        perp__dominance_layout(arena, &v->dominance, v->n, (int32_t)entries);
    }
}

/* The index set that z shows by the natural map: the side of z - w on which it lies. */
static void read_places(perp__verify *v)
{
    const perp_lcp_solver *s = v->solver;

    for (int32_t i = 0; i < v->n; i++)
        v->high[i] = perp__z_scaled(s, i, v->z[i]);
    perp__multiply_doubled(&v->M, v->high, s->q_scaled, v->w_high, v->w_low);
    v->count = 0;
    for (int32_t i = 0; i < v->n; i++) {
        const double l = s->lower_scaled[i], u = s->upper_scaled[i], z = v->high[i];
        const int8_t place =
            perp__place(perp__is_same(s->lower[i], s->upper[i]), z - l, z - u, v->w_high[i]);

        v->places[i] = place;
        v->position[i] = place == PERP__BETWEEN ? v->count : -1;
        v->high[i] = place == PERP__AT_UPPER ? u : place == PERP__BETWEEN ? z : l;
        v->low[i] = 0.0;
        if (place == PERP__BETWEEN)
            v->active[v->count++] = i;
    }
}

/* ---- the enclosure: the equations of the index set are solved to doubled precision, and what is
 * left is bounded with the inverse ---- */

/* Up to this size it is where the sparse bound fails: three arrays of 32 MiB. */
#define PERP__LARGEST_BLOCK 2048

static void layout_dense(perp__arena *arena, void *object)
{
    perp__verify *v = object;

    perp__verified_layout(arena, &v->dense, v->count);
}

/* w := M (high + low) + q, in doubled precision but for its last rounding */
static void find_w(perp__verify *v)
{
    perp__multiply_doubled(&v->M, v->high, v->solver->q_scaled, v->w_high, v->w_low);
    perp__multiply(&v->M, v->low, v->w);
    for (int32_t i = 0; i < v->n; i++)
        v->w[i] = v->w_high[i] + (v->w_low[i] + v->w[i]);
}

/* Any point will do for the proof; the nearer, the narrower the interval. */
static void refine(perp__verify *v)
{
    double last = INFINITY;

    find_w(v);
    for (int32_t round = 0; round < 2 * DBL_MANT_DIG && v->count > 0; round++) {
        double largest = 0.0;

        /* 1. step := M_AA^-1 w_A, approximately */
        for (int32_t k = 0; k < v->count; k++)
            v->middle[k] = v->w[v->active[k]];
        if (v->uses_dense) {
            perp__verified_apply(&v->dense, v->middle, v->step);
        } else {
            memcpy(v->step, v->middle, (size_t)v->count * sizeof *v->step);
            perp__klu_solve(v->dominance.kept.factor, v->step, 0);
        }
        for (int32_t k = 0; k < v->count; k++)
            largest = perp__larger(largest, fabs(v->step[k]));
        if (!(largest < 0.5 * last) || largest == 0.0)
            break;
        /* 2. high + low -= step */
        for (int32_t k = 0; k < v->count; k++) {
            const int32_t i = v->active[k];
            const double low = v->low[i] - v->step[k];
            const double sum = v->high[i] + low;
            const double part = sum - v->high[i];

            v->low[i] = (v->high[i] - (sum - part)) + (low - part);
            v->high[i] = sum;
        }
        find_w(v);
        last = largest;
    }
}

/* width, delta and spread, from the bounds of |M_AA^-1 w_A|. False if nothing was proved. */
static int32_t find_delta(perp__verify *v)
{
    const double n = v->n;
    const double sizes = perp__sum_of_sizes(v->high, v->n) + perp__sum_of_sizes(v->low, v->n);
    double *products = v->delta, *ones = v->delta;
    int32_t i, k, proved = 1;

    /* 1. width: the error of the product in doubled precision, of the one with `low`, of adding
     * the three, of underflow. */
    for (i = 0; i < v->n; i++)
        ones[i] = 1.0;
    perp__multiply_absolute(&v->M, ones, v->width);
    for (i = 0; i < v->n; i++)
        v->width[i] = DBL_MIN * (16.0 * (n + 1.0) + 2.0 * (sizes + v->width[i]));
    perp__multiply_absolute(&v->M, v->high, products);
    for (i = 0; i < v->n; i++)
        v->width[i] += perp__doubled_error(v->n) * (products[i] + fabs(v->solver->q_scaled[i]));
    perp__multiply_absolute(&v->M, v->low, products);
    for (i = 0; i < v->n; i++) {
        v->width[i] += PERP__GAMMA(n + 8.0) * (products[i] + fabs(v->w_low[i])) +
                       PERP__GAMMA(2.0) * fabs(v->w[i]);
        v->width[i] = perp__raise(v->width[i], 4.0 * n + 8.0);
    }
    /* 2. The interval around the active variables, and how far the others' w move with it. */
    for (k = 0; k < v->count; k++) {
        v->middle[k] = v->w[v->active[k]];
        v->margin[k] = v->width[v->active[k]];
    }
    if (v->uses_dense)
        perp__verified_bound(&v->dense, v->middle, v->margin, v->enclosure);
    else
        proved = perp__dominance_bound(&v->dominance, v->middle, v->margin, v->enclosure);
    for (i = 0; i < v->n; i++)
        v->delta[i] = 0.0;
    for (k = 0; k < v->count; k++) {
        v->delta[v->active[k]] = v->enclosure[k];
        proved &= isfinite(v->enclosure[k]) != 0;
    }
    perp__multiply_absolute(&v->M, v->delta, v->spread);
    for (i = 0; i < v->n; i++)
        v->spread[i] = perp__raise(v->spread[i], 2.0 * v->n);
    return proved;
}

static perp_status enclose_dense(perp__verify *v, int32_t *verdict)
{
    const perp__index_set block = {v->count, v->active, v->position};
    perp_status status;

    v->uses_dense = 1;
    status = perp__arena_fit(&v->dense_arena, v->context, layout_dense, v);
    if (status != PERP_OK)
        return status;
    perp__principal_dense(&v->M, &block, v->dense.transposed, (size_t)v->count, 1);
    *verdict = PERP_VERDICT_SINGULAR;
    if (perp__verified_factor(&v->dense)) {
        refine(v);
        if (find_delta(v))
            *verdict = PERP_VERDICT_REGULAR;
    }
    return PERP_OK;
}

/* Finds the solution of the index set's equations and an interval around it that holds the exact
 * one. *verdict: PERP_VERDICT_REGULAR, _SINGULAR or _TOO_LARGE. PERP_OK or PERP_ERROR_MEMORY. */
static perp_status enclose(perp__verify *v, int32_t *verdict)
{
    const perp__index_set block = {v->count, v->active, v->position};
    const perp__square A = {v->count, v->block, v->starts, v->rows};
    perp_status status;

    if (!v->M.column_starts || v->count <= PERP__SMALL_SPARSE)
        return enclose_dense(v, verdict);
    v->uses_dense = 0;
    perp__principal_csc(&v->M, &block, 0.0, NULL, v->starts, v->rows, v->block);
    v->dominance.n = v->count;
    v->dominance.A = A;
    status = perp__dominance_factor(&v->dominance, v->context);
    if (status < 0)
        return status;
    if (status == PERP_OK) {
        refine(v);
        if (find_delta(v)) {
            *verdict = PERP_VERDICT_REGULAR;
            return PERP_OK;
        }
    }
    if (v->count <= PERP__LARGEST_BLOCK)
        return enclose_dense(v, verdict);
    *verdict = PERP_VERDICT_TOO_LARGE;
    return PERP_OK;
}

/* ---- the verdict: bounds and signs against the enclosure ---- */

/* What is known of the sign of a number within `width` of x: nothing where either overflowed. */
static int32_t sign_of(double x, double width)
{
    if (!isfinite(width))
        return 0;
    return x >= width ? 1 : x < -width ? -1 : 0;
}

/* Where z_i - bound stands, in the direction that leads inside: proved to be above 0 (1), below 0
 * (-1), or neither (0). */
static int32_t side_of(const perp__verify *v, int32_t i, double bound, double direction)
{
    const double distance = direction * (v->high[i] - bound);
    const double low = direction * v->low[i];
    const double width = perp__raise(
        v->delta[i] + PERP__GAMMA(4.0) * (fabs(distance) + fabs(low)) + 4.0 * DBL_MIN, 4.0);

    if (distance + low > width)
        return 1;
    return distance + low < -width ? -1 : 0;
}

/* Compares the enclosure with bounds and signs; *index is the row that decides, or -1. */
static int32_t find_verdict(const perp__verify *v, int32_t *index)
{
    int32_t verdict = PERP_VERDICT_REGULAR;

    *index = -1;
    for (int32_t i = 0; i < v->n; i++) {
        const double width = perp__raise(v->width[i] + v->spread[i], 4.0);
        int32_t row = 1; /* proved right (1), wrong (-1), or neither (0) */

        if (v->places[i] == PERP__AT_LOWER) {
            row = sign_of(v->w[i], width);
        } else if (v->places[i] == PERP__AT_UPPER) {
            row = sign_of(-v->w[i], width);
        } else if (v->places[i] == PERP__BETWEEN) {
            const double lower = v->solver->lower_scaled[i], upper = v->solver->upper_scaled[i];
            const int32_t above = lower > -INFINITY ? side_of(v, i, lower, 1.0) : 1;
            const int32_t below = upper < INFINITY ? side_of(v, i, upper, -1.0) : 1;

            row = above < below ? above : below;
        }
        if (row < 0) {
            *index = i;
            return PERP_VERDICT_NOT_A_SOLUTION;
        }
        if (row == 0 && verdict == PERP_VERDICT_REGULAR) {
            *index = i;
            verdict = PERP_VERDICT_DEGENERATE;
        }
    }
    return verdict;
}

/* |z_i - z*_i| at most, in the caller's units. */
static double radius_of(const perp__verify *v, int32_t i)
{
    const perp_lcp_solver *s = v->solver;
    const double bound = v->places[i] == PERP__AT_UPPER ? s->upper[i] : s->lower[i];
    double radius;

    if (v->places[i] != PERP__BETWEEN)
        return perp__is_same(v->z[i], bound) ? 0.0
                                             : perp__raise(fabs(v->z[i] - bound) + DBL_MIN, 2.0);
    radius = perp__raise(fabs(perp__z_scaled(s, i, v->z[i]) - v->high[i]) + fabs(v->low[i]) +
                             v->delta[i] + 4.0 * DBL_MIN,
                         4.0);
    return perp__raise(perp__z_caller(s, i, radius) + DBL_MIN, 2.0);
}

/* ---- the call ---- */

PERP__WORDS(perp_lcp_verdict_text, "unknown verdict", "regular", "not a solution", "singular",
            "degenerate", "too large")

static perp_status verify(perp__verify *v, double *radii, perp_lcp_proof *proof,
                          const perp_lcp_problem *problem)
{
    perp_lcp_problem p = {0};
    perp_lcp_proof copy = {.verdict = PERP_VERDICT_SINGULAR, .index = -1};
    perp_status status = PERP__CHECK(perp_lcp_proof, v->context, proof);

    /* 1. What the caller gave: the problem goes into a solver of its own. */
    PERP__THEN(status, perp__lcp_create(v->context, &v->solver, NULL));
    if (status != PERP_OK)
        return status;
    v->solver->as_given = 1;
    status = perp__lcp_caller_read(v->context, &p, problem, 0);
    PERP__THEN(status, perp__lcp_setup(v->solver, p.M, p.lower, p.upper));
    v->n = v->solver->n;
    PERP__THEN(status, perp__check_vector(v->context, "q", p.q, (size_t)v->n));
    PERP__THEN(status, perp__check_vector(v->context, "z", v->z, (size_t)v->n));
    PERP__THEN(status, perp__arena_fit(&v->arena, v->context, layout, v));
    /* 2. The proof. A radius that is not finite proves nothing. */
    if (status == PERP_OK) {
        perp__scale_problem(v->solver, p.q);
        v->M = perp__scale_matrix(v->solver, v->values);
        read_places(v);
        status = enclose(v, &copy.verdict);
    }
    if (status == PERP_OK && copy.verdict == PERP_VERDICT_REGULAR)
        copy.verdict = find_verdict(v, &copy.index);
    for (int32_t i = 0; i < v->n && status == PERP_OK && copy.verdict == PERP_VERDICT_REGULAR; i++)
        perp__raise_to(&copy.radius, radius_of(v, i));
    if (!isfinite(copy.radius))
        copy.verdict = PERP_VERDICT_SINGULAR;
    if (copy.verdict != PERP_VERDICT_REGULAR)
        copy.radius = INFINITY;
    for (int32_t i = 0; i < v->n && status == PERP_OK && radii; i++)
        radii[i] = copy.verdict == PERP_VERDICT_REGULAR ? radius_of(v, i) : INFINITY;
    if (status == PERP_OK)
        perp__struct_write(proof, &copy, sizeof copy);
    perp__dominance_release(&v->dominance);
    perp__arena_release(&v->dense_arena);
    perp__arena_release(&v->arena);
    perp__handle_end(v->solver);
    return status;
}

perp_status perp_lcp_verify(perp_context *context, double *radii, perp_lcp_proof *proof,
                            const perp_lcp_problem *problem, const double *z)
{
    perp__verify v = {.context = context, .z = z};

    return PERP__CALL(perp__enter(context), context, verify(&v, radii, proof, problem));
}
