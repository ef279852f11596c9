/* What takes overlaps away (perp_contact_step, `shift`): the least velocity s, in the metric of M,
 * with
 *
 *   0 <= p  perp  A s + g >= 0,   G s = 0,   M s = A'p + G'q,
 *
 * A the rows that have gaps and g = (correction min(gap + slop, 0) + max(gap, 0)) / h. Its matrix
 * is a block of W, which the step has made. Where overlaps contradict each other, as those of a
 * body in a gap that is too narrow do, there is no such s; then every row with a gap yields by a
 * share of its own response, and s is a compromise, at most 1 / sqrt(YIELD) of what the deepest
 * overlap would need alone.
 *
 * A is that of a place. A link that overlaps beside its hinge, or lightly turns about its own axis,
 * would go round and round: s is shortened to the caller's reach, within which A holds. What is 0
 * or more in A s + g at s and at 0 is so between them. */
#include <math.h>
#include <string.h>

#include "base/groups.h"
#include "contact/solver.h"

#define YIELD 0.1

/* Steps without a look at whether contradictions have gone. */
enum { PATIENCE = 32 };

static void lay_out(perp__arena *arena, void *object)
{
    perp__contact_opening *work = object;
    const size_t size = (size_t)work->size;

    work->W = perp__arena_take(arena, size, size * sizeof(double));
    PERP__DOUBLES(arena, size, &work->q, &work->r, &work->start, &work->sign);
    PERP__INTEGERS(arena, size, &work->rows);
    PERP__INTEGERS(arena, (size_t)work->n, &work->part);
    PERP__INTEGERS(arena, (size_t)(work->n < work->whole ? work->whole : work->n), &work->first);
    work->dims = perp__arena_take(arena, size, sizeof(int32_t));
    PERP__DOUBLES(arena, (size_t)work->n, &work->share);
    work->position = perp__arena_take(arena, (size_t)work->whole, sizeof(int32_t));
    PERP__DOUBLES(arena, (size_t)work->whole, &work->push, &work->opened);
}

/* Whether the matrix or what is to be opened overflows where the gaps' rows are by themselves: then
 * no velocity opens them, and the step is none the worse. */
static bool refuses(perp_status status)
{
    return status == PERP_ERROR_NOT_FINITE || status == PERP_ERROR_ARGUMENT;
}

/* p, from the last one. */
static perp_status solve(perp_contact_solver *solver, const perp_contact_step *s,
                         perp__contact_opening *work, double yield, int32_t *solved)
{
    const perp__index_set set = {work->size, work->rows, work->position};
    const size_t size = (size_t)work->size;
    const perp_matrix W = perp__view(PERP_STORAGE_COLUMN_MAJOR, work->size, work->size, work->W);
    perp_contact_result result;
    perp__contact_call call = {.to.r = work->r, .result = &result, .q = work->q};
    perp_contact_laws laws;
    perp_status status = perp_struct_init(&result, sizeof result);

    perp__principal_dense(&solver->W, &set, work->W, 1, size);
    for (size_t j = 0; j < size; j++)
        for (size_t i = 0; i < size; i++)
            work->W[i + j * size] *= work->sign[i] * work->sign[j];
    for (size_t i = 0; i < (size_t)s->gap_count; i++)
        work->W[i * (size + 1)] *= 1.0 + yield;
    perp_contact_laws_init(&laws, sizeof laws);
    laws.contacts = s->gap_count;
    laws.dims = work->dims;
    laws.bilateral = s->bilateral;
    if (!work->solver)
        PERP__THEN(status, perp__contact_create(solver->context, &work->solver, NULL));
    if (status != PERP_OK)
        return status;
    work->solver->settings = solver->settings;
    status = perp__contact_setup(work->solver, &laws, NULL, &W);
    if (status != PERP_OK)
        return refuses(status) ? PERP_OK : status;
    work->solver->proves = 0;
    work->solver->quick = yield == 0.0;
    call.r0 = work->start;
    status = perp__contact_solve(work->solver, &call);
    *solved = status == PERP_OK && perp__is_good(result.outcome);
    return refuses(status) ? PERP_OK : status;
}

/* Joins the coordinates of each row of A, as long as there are several parts; own->first of each
 * row: its first coordinate. */
static int32_t join_rows(perp__contact_opening *work, const perp__matrix *A, int32_t parts)
{
    perp__cursor c = perp__first(A);

    for (int32_t i = 0; i < A->rows; i++)
        work->first[i] = -1;
    while (parts > 1 && A->rows > 0 && perp__advance(&c)) {
        const int32_t first = work->first[c.i] < 0 ? c.j : work->first[c.i];

        work->first[c.i] = first;
        if (work->part[first] != work->part[c.j])
            parts -= perp__join(work->part, first, c.j);
    }
    return parts;
}

/* s to within the reach, in each part of the coordinates by itself: what M or rows join. */
static void shorten(const perp_contact_solver *solver, perp_contact_step *s,
                    perp__contact_opening *work)
{
    double *share = work->share;
    int32_t reaches = 1, parts = s->n;

    for (int32_t i = 0; i < s->n; i++) {
        const double way = fabs(s->shift[i]) * s->h;

        share[i] = way > s->reach[i] ? fmax(s->reach[i], 0.0) / way : 1.0;
        reaches &= share[i] == 1.0;
        work->part[i] = i;
    }
    if (!reaches) {
        parts = join_rows(work, &solver->dynamics.M, parts);
        parts = join_rows(work, &solver->dynamics.H, parts);
        join_rows(work, &solver->dynamics.G, parts);
        for (int32_t i = 0; i < s->n; i++) {
            const int32_t root = perp__root_of(work->part, i);

            share[root] = fmin(share[root], share[i]);
        }
        for (int32_t i = 0; i < s->n; i++) {
            share[i] = share[perp__root_of(work->part, i)];
            s->shift[i] *= share[i];
        }
    }
    if (s->shares)
        memcpy(s->shares, share, (size_t)s->n * sizeof *share);
}

/* Row i of A and G, as the caller numbers H's rows and then G's. */
static int32_t given_row(const perp_contact_step *s, int32_t i)
{
    return i < s->gap_count ? s->gap_rows[i] : s->rows + i - s->gap_count;
}

static perp_status open(perp_contact_solver *solver, perp_contact_step *s,
                        perp__contact_opening *work)
{
    const perp__contact_bounded *bounded = &solver->bounded;
    double *opened = s->source
                         ? solver->arranged[solver->arranged_now].start + s->rows + s->bilateral
                         : work->opened;
    int32_t solved = 0;
    perp_status status = PERP_OK;

    /* 1. Rows with gaps, then equations, as the methods number them; and g. */
    for (int32_t i = 0; i < work->whole; i++)
        work->position[i] = -1;
    for (int32_t i = 0; i < work->size; i++) {
        const bool has_gap = i < s->gap_count;
        const int32_t given = given_row(s, i);
        const double gap = has_gap ? (*s->gaps)[s->gap_sources[i]] : 0.0;

        work->rows[i] = bounded->count > 0 ? bounded->row[given] : given;
        work->sign[i] = bounded->count > 0 ? bounded->sign[given] : 1.0;
        work->dims[i] = 1;
        work->position[work->rows[i]] = i;
        work->start[i] = opened[given]; /* what has come begins at 0 */
        work->q[i] = (s->correction * fmin(gap + s->slop, 0.0) + fmax(gap, 0.0)) / s->h;
    }
    if (!perp__all_finite(work->q, (size_t)work->size)) /* overflowed: no velocity opens that */
        return status;

    /* 2. p, and where overlaps contradict each other, that of rows that yield. */
    if (work->patience == 0) {
        status = solve(solver, s, work, 0.0, &solved);
        work->patience = solved ? 0 : PATIENCE;
    } else {
        work->patience--;
    }
    if (status == PERP_OK && !solved)
        status = solve(solver, s, work, YIELD, &solved);
    for (int32_t i = 0; i < work->size; i++)
        opened[given_row(s, i)] = solved ? work->r[i] : 0.0;
    if (status != PERP_OK || !solved)
        return status;

    /* 3. shift := M^-1 (A'p + G'q) */
    memset(work->push, 0, (size_t)work->whole * sizeof *work->push);
    for (int32_t i = 0; i < work->size; i++)
        work->push[work->rows[i]] += work->sign[i] * work->r[i];
    status =
        perp__dynamics_velocities(&solver->dynamics, NULL, work->push, s->shift, solver->push_low);
    s->shifts = status == PERP_OK && perp__all_finite(s->shift, (size_t)s->n);
    if (s->shifts && s->reach)
        shorten(solver, s, work);
    return status;
}

perp_status perp__contact_open(perp_contact_solver *solver, perp_contact_step *s)
{
    perp__contact_opening *work = &solver->opening;
    const int32_t size = work->size, whole = work->whole, n = work->n;
    int32_t made = 1;
    perp_status status;

    s->shifts = 0;
    if (!s->shift || !(s->least_gap < -2.0 * s->slop))
        return PERP_OK;
    work->size = s->gap_count + s->bilateral;
    work->whole = solver->size;
    work->n = s->n;
    status = perp__arena_fit(&work->arena, solver->context, lay_out, work);
    if (status != PERP_OK)
        work->n = -1;
    else if (work->size != size || work->whole != whole ||
             work->n != n) /* no last answer is there */
        memset(work->opened, 0, (size_t)work->whole * sizeof *work->opened);
    if (!solver->problem.W) /* for this once: methods choose by whether it is there */
        PERP__THEN(status, perp__delassus_of_bodies(&solver->delassus, solver->context,
                                                    &solver->bodies, &solver->W, &made));
    return status == PERP_OK && made ? open(solver, s, work) : status;
}
