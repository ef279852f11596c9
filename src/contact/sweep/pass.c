/* One constraint of a sweep; sweeps in the space of bodies, u_k = P_k y + q_k, y += P_k' dr, and
 * over the rows of W, which is used as given; and the tested residual. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "contact/law.h"
#include "contact/sweep/local_step.h"
#include "contact/sweep/sweep.h"
#include "linalg/lanes/lanes.h"
#include "linalg/lanes/loops.h"
#include "linalg/lanes/multiversion.h"
#include "linalg/pivoting.h"

/* Contacts that roll or spin go round their parts until they agree to so much of a first step. */
#define ROUNDS_ACCURACY 1e-3

/* ---- packed contacts ----
 *
 * Contacts of rigid bodies, the common case in one piece of memory: at most 3 rows on at most 2
 * blocks of 6 unknowns, tangents turned to where the local problem is diagonal. A row that a
 * frictionless or planar contact lacks is zero, and so are the unknowns that a planar body lacks
 * and the piece of a contact with the ground. */
enum { WIDTH = PERP__PACKED_WIDTH, ROW = PERP__PACKED_ROW };

bool perp__sweep_packs(const perp__sweep_work *work, int32_t k)
{
    const perp__contact_problem *problem = work->common.problem;
    const perp__bodies *b = problem->bodies;
    const int32_t first = problem->starts[k], dim = problem->dims[k];

    return perp__contact_two_sided(problem, k) == 0 && problem->starts[k + 1] - first == dim &&
           b->piece_starts[k + 1] - b->piece_starts[k] <= 2 &&
           (dim < 3 || b->compliance[first + 1] == b->compliance[first + 2]);
}

static void pack_row(double *row, int32_t which, double factor, const double *piece, int32_t width)
{
    for (int32_t j = 0; j < width; j++)
        row[perp__packed_place(which, j)] += factor * piece[j];
}

void perp__sweep_pack(perp__sweep_work *work, int32_t k, perp__packed_contact *c)
{
    const perp__contact_problem *problem = work->common.problem;
    const perp__bodies *b = problem->bodies;
    const perp__local *local = &work->local[k];
    const int32_t first = problem->starts[k], dim = problem->dims[k];
    const int64_t start = b->piece_starts[k];
    const double turn[2][2] = {{local->turn[0], local->turn[1]}, {-local->turn[1], local->turn[0]}};

    memset(c, 0, sizeof *c);
    c->blocks[0] = c->blocks[1] = b->blocks;
    for (int64_t piece = start; piece < b->piece_starts[k + 1]; piece++) {
        const double *p = b->values + b->piece_values[piece];
        const int32_t which = (int32_t)(piece - start);

        c->blocks[which] = b->piece_blocks[piece];
        pack_row(c->P, which, 1.0, p, b->width);
        for (int32_t i = 1; i < dim; i++)
            for (int32_t j = 1; j < dim; j++)
                pack_row(c->P + i * ROW, which, turn[i - 1][j - 1], p + j * b->width, b->width);
    }
    for (int32_t i = 0; i < dim; i++) {
        c->q[i] = problem->q[first + i];
        c->compliance[i > 0] = b->compliance[first + i];
    }
    if (dim == 3) {
        c->q[1] = turn[0][0] * problem->q[first + 1] + turn[0][1] * problem->q[first + 2];
        c->q[2] = turn[1][0] * problem->q[first + 1] + turn[1][1] * problem->q[first + 2];
    }
    c->local = *local;
    if (dim < 3) /* the rows that are missing stick at 0 */
        c->local.s[1] = c->local.inverse_s[1] = 1.0;
    if (dim < 2)
        c->local.s[0] = c->local.inverse_s[0] = 1.0;
    c->weight = work->weights[k] * work->weights[k];
}

#define SUM_LANES(v) ((((v)[0] + (v)[2]) + ((v)[1] + (v)[3])))

/* u := P (first, second) + q + compliance x */
PERP__KERNEL static void find_velocity(const perp__packed_contact *c, const double *first,
                                       const double *second, const double *x, double *u)
{
    const perp__lanes a = PERP__CONST_LANES_AT(first), b = PERP__CONST_LANES_AT(second);
    const perp__lanes ends = {first[4], first[5], second[4], second[5]};
    const double *P = c->P;

    for (int32_t i = 0; i < 3; i++, P += ROW) {
        const perp__lanes sum = PERP__CONST_LANES_AT(P) * a + PERP__CONST_LANES_AT(P + 4) * b +
                                PERP__CONST_LANES_AT(P + 8) * ends;

        u[i] = SUM_LANES(sum) + (c->q[i] + c->compliance[i > 0] * x[i]);
    }
}

/* (first, second) += P'd */
PERP__KERNEL static void push(const perp__packed_contact *c, const double *d, double *first,
                              double *second)
{
    perp__lanes a = PERP__LANES_AT(first), b = PERP__LANES_AT(second);
    perp__lanes ends = {first[4], first[5], second[4], second[5]};

    for (int32_t i = 2; i >= 0; i--) { /* the normal last: its step is known last */
        const perp__lanes step = PERP__SAME_LANES(d[i]);
        const double *P = c->P + i * ROW;

        a += PERP__CONST_LANES_AT(P) * step;
        b += PERP__CONST_LANES_AT(P + 4) * step;
        ends += PERP__CONST_LANES_AT(P + 8) * step;
    }
    PERP__LANES_AT(first) = a;
    PERP__LANES_AT(second) = b;
    first[4] = ends[0];
    first[5] = ends[1];
    second[4] = ends[2];
    second[5] = ends[3];
}

/* One pass over the contacts from `from` up to before `to`, all packed, which raises *most to the
 * largest squared change. */
PERP__MULTIVERSION(pass_packed, (perp__sweep_work * work, int32_t from, int32_t to, double *most),
                   (work, from, to, most))
{
    const int32_t *starts = work->common.problem->starts;
    double worst = *most;

    for (int32_t k = from; k < to; k++) {
        perp__packed_contact *c = &work->packed[k];
        const int32_t dim = starts[k + 1] - starts[k];
        double *first = work->y + (size_t)c->blocks[0] * WIDTH;
        double *second = work->y + (size_t)c->blocks[1] * WIDTH, *r = work->r + starts[k];
        double x[3] = {r[0], dim > 1 ? r[1] : 0.0, dim > 2 ? r[2] : 0.0}, u[3], d[3], change;

        find_velocity(c, first, second, x, u);
        memcpy(d, x, sizeof d);
        work->modes[k] =
            (int8_t)(dim == 2 ? perp__step_2(&c->local, u, x) : perp__step_3(&c->local, u, x));
        for (int32_t i = 0; i < 3; i++)
            d[i] = x[i] - d[i];
        change = d[0] * d[0] + (d[1] * d[1] + d[2] * d[2]);
        if (change != 0.0) {
            for (int32_t i = 0; i < dim; i++)
                r[i] = x[i];
            push(c, d, first, second);
        }
        change *= c->weight;
        if (!(change <= worst))
            worst = isnan(worst) ? worst : change;
    }
    *most = worst;
}

/* to := from with the tangents of packed contacts turned into their frames (1) or back (-1) */
static void turn(const perp__sweep_work *work, int32_t which, const double *from, double *to)
{
    const perp__contact_problem *problem = work->common.problem;

    memcpy(to, from, (size_t)work->size * sizeof *to);
    for (int32_t k = 0; work->packed && k < problem->contacts; k++) {
        const double *turn = work->local[k].turn;
        const int32_t first = problem->starts[k];

        if (!work->packs[k] || problem->starts[k + 1] - first < 3)
            continue;
        to[first + 1] = turn[0] * from[first + 1] + which * (turn[1] * from[first + 2]);
        to[first + 2] = turn[0] * from[first + 2] - which * (turn[1] * from[first + 1]);
    }
}

void perp__sweep_import(perp__sweep_work *work, const double *x)
{
    turn(work, 1, x, work->r);
}

/* Slips near the edge of their cones may be outside of them by a hair. */
void perp__sweep_export(perp__sweep_work *work, const double *r)
{
    turn(work, -1, r, work->x);
    for (int32_t k = 0; k < work->common.problem->contacts; k++)
        perp__contact_clip(work->common.problem, k, work->x);
}

/* ---- any constraint ---- */

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
    const int32_t rows = problem->starts[k + 1] - problem->starts[k];
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
            const int32_t row = parts[p].row - problem->starts[k], size = parts[p].size;

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
    const perp__contact_problem *problem = work->common.problem;
    const int32_t both = perp__contact_two_sided(problem, k);
    const int32_t rows = problem->starts[k + 1] - problem->starts[k], tangents = rows - both;
    const double mu = problem->mu[k];
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
    const perp__contact_problem *problem = work->common.problem;
    const int32_t first = problem->starts[constraint];
    const int32_t rows = problem->starts[constraint + 1] - first;
    double *r = work->r + first;
    int32_t mode;

    for (int32_t i = 0; i < rows; i++)
        dr[i] = r[i];
    if (constraint >= problem->contacts) {
        r[0] -= u[0] * work->local[constraint].inverse_normal;
        mode = PERP_CONTACT_STICK;
    } else if (perp__contact_two_sided(problem, constraint) > 0) {
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
        const int32_t first = problem->starts[k], rows = problem->starts[k + 1] - first;
        const int64_t begin = b ? b->piece_starts[k] : 0, last = b ? b->piece_starts[k + 1] : 0;
        double u[PERP__ROWS_MOST], dr[PERP__ROWS_MOST], sum = 0.0;
        int32_t mode;

        /* 1. Packed contacts that follow each other. */
        for (end = k; b && end < problem->contacts && work->packs[end];)
            end++;
        if (end > k) {
            pass_packed(work, k, end, &most);
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
