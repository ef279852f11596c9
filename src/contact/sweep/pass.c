/* One constraint of a sweep; sweeps in the space of bodies, u_k = P_k y + q_k, y += P_k' dr, and
 * over the rows of W, which is used as given; and the tested residual. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "contact/law.h"
#include "contact/sweep/local_step.h"
#include "contact/sweep/sweep.h"
#include "linalg/lanes/loops.h"
#include "linalg/pivoting.h"

/* Contacts that roll or spin go round their parts until they agree to so much of a first step. */
#define ROUNDS_ACCURACY 1e-3

/* One part's step: r[from ..] was `old` before, and u follows W within the contact. Returns the
 * largest change. */
static double follow(const double *W, int32_t rows, int32_t from, int32_t count, const double *old,
                     const double *r, double *u)
{
    double d[3], most = 0.0;

    for (int32_t i = 0; i < count; i++) {
        d[i] = r[from + i] - old[i];
        most = fmax(most, fabs(d[i]));
    }
    for (int32_t i = 0; i < rows; i++)
        for (int32_t j = 0; j < count; j++)
            u[i] += W[i * rows + from + j] * d[j];
    return most;
}

/* The normal with its tangents, then each other part in the disc that r_n gives it. */
static int32_t step_with_discs(perp__sweep_work *work, int32_t k, double *u, double *r)
{
    const perp__contact_problem *problem = work->common.problem;
    const int32_t rows = work->rows[k + 1] - work->rows[k];
    perp__sweep_discs *discs = &work->discs[k];
    perp__contact_part parts[3];
    const int32_t count = perp__contact_parts(problem, k, parts);
    double first = 0.0, old[3];
    int32_t mode = PERP_CONTACT_SEPARATE;

    for (int32_t round = 0; round < DBL_MANT_DIG; round++) {
        double change;

        memcpy(old, r, (size_t)problem->dims[k] * sizeof *r);
        mode = perp__local_step(&work->local[k], u, r);
        change = follow(discs->W, rows, 0, problem->dims[k], old, r, u);
        for (int32_t p = 1; p < count; p++) {
            const int32_t row = parts[p].row - work->rows[k], size = parts[p].size;

            memcpy(old, r + row, (size_t)size * sizeof *r);
            perp__local_step_disc(&discs->part[p], parts[p].coefficient * r[0], u + row, r + row);
            change = fmax(change, follow(discs->W, rows, row, size, old, r, u));
        }
        if (round == 0)
            first = change;
        if (!(change > ROUNDS_ACCURACY * first))
            break;
    }
    return mode;
}

/* One that holds both ways, exactly: u_N = 0, and r_t in the disc of radius mu |r_N|, r_N = n - A
 * r_t. Where sticking asks for more friction than there is, and none for less, some radius between
 * is what there is: regula falsi (Illinois). Of several answers sticking comes first. */
static int32_t step_both_ways(perp__sweep_work *work, int32_t k, double *u, double *r)
{
    const int32_t both = perp__contact_two_sided(work->common.problem, k);
    const int32_t rows = work->rows[k + 1] - work->rows[k], tangents = rows - both;
    const double mu = work->common.problem->mu[k];
    perp__sweep_discs *discs = &work->discs[k];
    double n[3], N[3], t[2] = {0.0, 0.0}, radius = INFINITY, low = 0.0, high = 0.0;
    double at_low = 0.0, at_high = 0.0;
    int32_t mode = PERP_CONTACT_STICK, side = 0;

    /* 1. n for the tangents as they are, and u_t with it. */
    memcpy(n, u, (size_t)both * sizeof *u);
    (void)perp__solve_small(discs->W, both, rows, n, 1);
    for (int32_t i = 0; i < both; i++) {
        for (int32_t j = 0; j < tangents; j++)
            u[both + j] -= discs->W[(both + j) * rows + i] * n[i];
        n[i] = r[i] - n[i];
    }
    /* 2. r_t: sticking, none, and the root between. */
    for (int32_t round = 0; round < 2 * DBL_MANT_DIG; round++) {
        double excess;

        memcpy(t, r + both, (size_t)tangents * sizeof *t);
        mode = perp__local_step_disc(&discs->part[0], radius, u + both, t);
        for (int32_t i = 0; i < both; i++) {
            N[i] = n[i];
            for (int32_t j = 0; j < tangents; j++)
                N[i] -= discs->A[i * tangents + j] * (t[j] - r[both + j]);
        }
        excess = mu * perp__contact_length(N, 0, both) - perp__contact_length(t, 0, tangents);
        if (round == 0 && excess >= 0.0)
            break;
        if (excess < 0.0) {
            high = round == 0 ? perp__contact_length(t, 0, tangents) : radius;
            at_high = excess;
            at_low *= side < 0 ? 0.5 : 1.0;
        } else {
            low = radius;
            at_low = excess;
            at_high *= side > 0 ? 0.5 : 1.0;
        }
        side = round < 2 ? 0 : excess < 0.0 ? -1 : 1;
        radius = round == 0 ? 0.0 : low + (high - low) * (at_low / (at_low - at_high));
        if (round > 0 &&
            (fabs(excess) <= 2.0 * DBL_EPSILON * high || !(radius > low && radius < high)))
            break;
    }
    memcpy(r, N, (size_t)both * sizeof *r);
    memcpy(r + both, t, (size_t)tangents * sizeof *r);
    return mode;
}

/* u_k given, with the current r: the constraint's next r, and dr. Returns the mode. */
static int32_t visit(perp__sweep_work *work, int32_t constraint, double *u, double *dr)
{
    const int32_t first = work->rows[constraint], rows = work->rows[constraint + 1] - first;
    double *r = work->r + first;
    int32_t mode;

    for (int32_t i = 0; i < rows; i++)
        dr[i] = r[i];
    if (constraint >= work->common.problem->contacts) {
        r[0] -= u[0] * work->local[constraint].inverse_normal;
        mode = PERP_CONTACT_STICK;
    } else if (perp__contact_two_sided(work->common.problem, constraint) > 0) {
        mode = step_both_ways(work, constraint, u, r);
    } else if (rows > work->local[constraint].dim) {
        mode = step_with_discs(work, constraint, u, r);
    } else {
        mode = perp__local_step(&work->local[constraint], u, r);
    }
    for (int32_t i = 0; i < rows; i++)
        dr[i] = r[i] - dr[i];
    return mode;
}

/* (W r + q)_i by the rows of W. */
static double row_times(const perp__sweep_work *work, int32_t i, const double *r)
{
    const double *W = work->entries;
    double sum[4] = {work->common.problem->q[i], 0.0, 0.0, 0.0};

    if (work->columns)
        for (int32_t k = work->entry_starts[i]; k < work->entry_starts[i + 1]; k++)
            sum[k % 4] += W[k] * r[work->columns[k]];
    else
        perp__loops_dot(work->size, W + (size_t)i * (size_t)work->size, r, &sum[1]);
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

double perp__sweep_pass(perp__sweep_work *work)
{
    const perp__contact_problem *problem = work->common.problem;
    const perp__bodies *b = problem->bodies;
    double most = 0.0; /* the square */

    for (int32_t k = 0, end; k < work->constraints; k = end) {
        const int32_t first = work->rows[k], rows = work->rows[k + 1] - first;
        const int64_t begin = b ? b->piece_starts[k] : 0, last = b ? b->piece_starts[k + 1] : 0;
        double u[PERP__ROWS_MOST], dr[PERP__ROWS_MOST], sum = 0.0;
        int32_t mode;

        /* 1. Packed contacts that follow each other. */
        for (end = k; b && end < problem->contacts && work->packs[end];)
            end++;
        if (end > k) {
            perp__sweep_packed(work, k, end, &most);
            continue;
        }
        end = k + 1;
        /* 2. u. */
        for (int32_t i = 0; i < rows; i++)
            u[i] = b ? problem->q[first + i] + b->compliance[first + i] * work->r[first + i]
                     : row_times(work, first + i, work->r);
        for (int64_t piece = begin; piece < last; piece++) {
            const double *p = b->values + b->piece_values[piece];
            const double *y = work->y + b->piece_blocks[piece] * (int64_t)work->stride;

            for (int32_t i = 0; i < rows; i++, p += b->width)
                for (int32_t j = 0; j < b->width; j++)
                    u[i] += p[j] * y[j];
        }
        /* 3. r, and what its change does. */
        mode = visit(work, k, u, dr);
        if (k < problem->contacts)
            work->modes[k] = (int8_t)mode;
        for (int32_t i = 0; i < rows; i++)
            sum += dr[i] * dr[i];
        for (int64_t piece = begin; piece < last && sum != 0.0; piece++) {
            const double *p = b->values + b->piece_values[piece];
            double *y = work->y + b->piece_blocks[piece] * (int64_t)work->stride;

            for (int32_t i = 0; i < rows; i++, p += b->width)
                for (int32_t j = 0; j < b->width; j++)
                    y[j] += p[j] * dr[i];
        }
        sum *= work->weights[k] * work->weights[k];
        if (!(sum <= most) && !isnan(most))
            most = sum;
    }
    return sqrt(most);
}

double perp__sweep_residual(perp__sweep_work *work, const double *x, double *u)
{
    const perp__contact_problem *problem = work->common.problem;

    if (problem->bodies)
        perp__bodies_multiply(problem->bodies, x, problem->q, u);
    for (int32_t i = 0; i < work->size && !problem->bodies; i++)
        u[i] = row_times(work, i, x);
    return perp__contact_tested(problem, x, u);
}
