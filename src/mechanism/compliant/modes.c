/* What compliant contacts do: separate, stick or slip.
 *
 * The normal forces follow from the state, so friction has given bounds, and what rests decides by
 * a linear complementarity problem with a positive semidefinite matrix, which has a solution:
 *
 *   -mu_static |N| <= F <= mu_static |N|   perp   -t,   t = tangent x'' = tangent free - W F,
 *
 * W = tangent mass^-1 tangent', F of what slides fixed at mu |N|. A contact at its bound starts to
 * slide; where its mu is lower than mu_static others may follow at the next event, at once. Where
 * the tangents of sticking contacts depend on each other a basic solution ties down as many as are
 * independent; the others keep their share of |N|. What is tied down takes its part of x'' out:
 *
 *   x'' := (E - M^-1 T' (T M^-1 T')^-1 T) x'',   F = (T M^-1 T')^-1 T x''. */
#include <math.h>
#include <string.h>

#include "base/outcome.h"
#include "linalg/blas.h"
#include "linalg/matrix.h"
#include "mechanism/compliant/compliant.h"

static size_t at(const perp_compliant *c, int32_t row, int32_t column)
{
    return (size_t)row + (size_t)c->p * (size_t)column;
}

bool perp__compliant_rests(const perp_compliant *c, int32_t k)
{
    double size = 0.0;

    for (int32_t i = 0; i < c->n; i++)
        size += fabs(c->tangent[at(c, k, i)] * c->v[i]);
    return c->mu_static[k] > 0.0 &&
           fabs(perp__compliant_row(c, c->tangent, k, c->v)) <= PERP__SUM_ROUNDING * size;
}

/* A one-sided contact presses where it overlaps and is not pulled. */
static bool presses(const perp_compliant *c, int32_t k, const double *x, double N)
{
    return !c->one_sided[k] || (N > 0.0 && perp__compliant_row(c, c->normal, k, x) > 0.0);
}

/* ---- what is tied down ---------------------------------------------------------------------- */

/* Whether contact k's row is independent of the stuck ones'; joins it to them where `joins`. */
static bool is_independent(perp_compliant *c, int32_t k, bool joins)
{
    const int32_t count = c->stuck_count;
    double left = c->slip_response[at(c, k, k)];

    for (int32_t i = 0; i < count; i++) {
        double sum = c->slip_response[at(c, c->stuck[i], k)];

        for (int32_t j = 0; j < i; j++)
            sum -= c->factor[at(c, i, j)] * c->factor[at(c, count, j)];
        sum /= c->factor[at(c, i, i)];
        c->factor[at(c, count, i)] = sum;
        left -= sum * sum;
    }
    if (!(left > PERP__NOTHING * c->slip_response[at(c, k, k)]))
        return 0;
    if (joins) {
        c->factor[at(c, count, count)] = sqrt(left);
        c->stuck[c->stuck_count++] = k;
    }
    return 1;
}

/* Takes out of an acceleration what the stuck contacts forbid; right: the forces that do that. */
static void take_out(perp_compliant *c, double *acceleration)
{
    const int32_t count = c->stuck_count;

    for (int32_t k = 0; k < count; k++)
        c->right[k] = perp__compliant_row(c, c->tangent, c->stuck[k], acceleration);
    perp__cholesky_solve(count, 1, c->factor, c->p, c->right, c->p);
    for (int32_t k = 0; k < count; k++)
        for (int32_t i = 0; i < c->n; i++)
            acceleration[i] -=
                c->all.drag[(size_t)i + (size_t)c->n * (size_t)c->stuck[k]] * c->right[k];
}

void perp__compliant_hold(perp_compliant *c, double *v)
{
    if (c->stuck_count > 0)
        perp__active_rows_free(&c->rows, v); /* without rounding where a row is an axis */
}

/* c->now := the response, less what the stuck contacts forbid. */
static void hold_stuck(perp_compliant *c)
{
    const size_t n = (size_t)c->n, p = (size_t)c->p;
    const double *const all[] = {c->all.response, c->all.drag};
    double *const now[] = {c->held.response, c->held.drag};

    c->now = c->stuck_count > 0 ? c->held : c->all;
    if (c->stuck_count == 0)
        return;
    perp__active_rows_begin(&c->rows, c->n);
    for (int32_t k = 0; k < c->stuck_count; k++) {
        double *row = perp__active_rows_next(&c->rows);

        for (int32_t i = 0; i < c->n; i++)
            row[i] = c->tangent[at(c, c->stuck[k], i)];
        perp__active_rows_add(&c->rows, 0.0);
    }
    perp__active_rows_solve(&c->rows);
    memcpy(c->now.free, c->all.free, n * sizeof *c->now.free);
    take_out(c, c->now.free);
    perp__compliant_hold(c, c->now.free);
    for (size_t k = 0; k < 2 * p; k++) {
        double *column = now[k / p] + n * (k % p);

        memcpy(column, all[k / p] + n * (k % p), n * sizeof *column);
        take_out(c, column);
        perp__compliant_hold(c, column);
    }
    perp__compliant_couple(c, &c->now);
}

void perp__compliant_friction(perp_compliant *c, const double *N)
{
    double *a = c->V; /* without the stuck ones' forces */

    for (int32_t k = 0; k < c->p; k++)
        c->friction[k] = c->share[k] * fabs(N[k]);
    if (c->stuck_count == 0)
        return;
    memcpy(a, c->all.free, (size_t)c->n * sizeof *a);
    for (int32_t k = 0; k < c->p; k++)
        for (int32_t i = 0; i < c->n; i++) {
            const size_t entry = (size_t)i + (size_t)c->n * (size_t)k;

            if (c->modes[k] != PERP_CONTACT_SEPARATE)
                a[i] -= c->all.response[entry] * N[k] + c->all.drag[entry] * c->friction[k];
        }
    take_out(c, a);
    for (int32_t k = 0; k < c->stuck_count; k++)
        c->friction[c->stuck[k]] = c->right[k];
}

/* ---- who sticks ------------------------------------------------------------------------------ */

/* Contact k's friction, which is no longer free: it slides that way. */
static void slide(perp_compliant *c, int32_t k, double sense)
{
    c->modes[k] = PERP_CONTACT_SLIP;
    c->sense[k] = sense;
    c->share[k] = sense * c->mu[k];
    c->lower[k] = c->upper[k] = c->share[k] * fabs(c->N[k]);
}

/* Whether F of what rests is at a bound; one that had to give is where it comes close. */
static bool is_at_bound(const perp_compliant *c, int32_t k)
{
    const double bound = c->gives[k] ? c->upper[k] * (1.0 - PERP__AGREEMENT) : c->upper[k];

    return !(fabs(c->friction[k]) < bound);
}

/* Where F of what rests is at a bound: the sense in which it is driven; else 0. */
static double driven(const perp_compliant *c, int32_t k)
{
    const double F = c->friction[k], sense = F != 0.0 ? F : -c->w[k];

    return is_at_bound(c, k) ? (double)((sense > 0.0) - (sense < 0.0)) : 0.0;
}

/* What each contact may do at the state, and the problem's data. */
static void read_contacts(perp_compliant *c)
{
    perp__compliant_normals(c, c->N, c->x, c->v);
    for (int32_t k = 0; k < c->p; k++) {
        const double speed = perp__compliant_row(c, c->tangent, k, c->v);
        const int32_t before = c->modes[k];

        c->lower[k] = c->upper[k] = c->share[k] = 0.0;
        c->flank[k] = c->N[k] < 0.0 ? -1.0 : 1.0;
        if (!presses(c, k, c->x, c->N[k])) {
            c->modes[k] = PERP_CONTACT_SEPARATE;
            c->N[k] = 0.0;
        } else if (before == PERP_CONTACT_STICK ||
                   (before == PERP_CONTACT_SLIP && c->mu_static[k] > 0.0 &&
                    c->sense[k] * speed <= 0.0) ||
                   (before == PERP_CONTACT_SEPARATE && perp__compliant_rests(c, k))) {
            c->modes[k] = PERP_CONTACT_STICK;
            c->upper[k] = c->mu_static[k] * fabs(c->N[k]);
            c->lower[k] = -c->upper[k];
        } else {
            slide(c, k, (double)((speed > 0.0) - (speed < 0.0)));
        }
    }
    for (int32_t k = 0; k < c->p; k++) {
        double sum = perp__compliant_row(c, c->tangent, k, c->all.free);

        for (int32_t l = 0; l < c->p; l++)
            sum -= c->all.Q[at(c, l, k)] * c->N[l];
        c->q[k] = -sum;
    }
}

/* Ties down what sticks among what rests, and lets go what is driven and not tied down by the
 * others. What is within its bounds comes first: at a bound of 0 (N = 0) nothing can hold. */
static void sort_resting(perp_compliant *c)
{
    for (int32_t k = 0; k < c->p; k++)
        if (c->modes[k] == PERP_CONTACT_STICK)
            c->share[k] = c->N[k] != 0.0 ? c->friction[k] / fabs(c->N[k]) : 0.0;
    for (int32_t at_bound = 0; at_bound < 2; at_bound++)
        for (int32_t k = 0; k < c->p; k++)
            if (c->modes[k] == PERP_CONTACT_STICK && is_at_bound(c, k) == at_bound &&
                driven(c, k) == 0.0 && is_independent(c, k, 1))
                c->share[k] = 0.0;
    for (int32_t k = 0; k < c->p; k++) {
        const double sense = c->modes[k] == PERP_CONTACT_STICK ? driven(c, k) : 0.0;

        if (sense != 0.0 && is_independent(c, k, 0))
            slide(c, k, sense);
    }
}

perp_status perp__compliant_decide(perp_compliant *c, perp_compliant_result *result,
                                   int32_t *failed)
{
    const perp_matrix W = perp__view(PERP_STORAGE_COLUMN_MAJOR, c->p, c->p, c->slip_response);
    perp_lcp_settings settings;
    perp_lcp_result solved;
    perp_status status = perp_lcp_settings_init(&settings, sizeof settings);
    bool rests = 0;

    /* 1. who presses, and what may stick */
    memcpy(c->modes_before, c->modes, (size_t)c->p * sizeof *c->modes);
    memcpy(c->sense_before, c->sense, (size_t)c->p * sizeof *c->sense);
    read_contacts(c);
    c->stuck_count = 0;
    *failed = 0;
    for (int32_t k = 0; k < c->p; k++)
        rests |= c->modes[k] == PERP_CONTACT_STICK;
    /* 2. friction within its bounds, by basic solutions; c->w = -t */
    perp_struct_init(&solved, sizeof solved);
    settings.method = PERP_LCP_LEMKE;
    if (rests && !c->choice)
        PERP__ASK(status, c->context, perp_lcp_solver_create(c->context, &c->choice, &settings));
    if (rests) {
        PERP__ASK(status, c->context, perp_lcp_solver_setup(c->choice, &W, c->lower, c->upper));
        PERP__ASK(status, c->context,
                  perp_lcp_solver_solve(c->choice, c->friction, c->w, NULL, &solved, c->q, NULL));
        *failed = status == PERP_OK && !perp__is_good(solved.outcome);
        if (status == PERP_OK && !*failed)
            sort_resting(c);
    }
    /* 3. what has changed, and what is held now */
    for (int32_t k = 0; k < c->p; k++) {
        const int32_t before = c->modes_before[k], now = c->modes[k];

        result->stops += before == PERP_CONTACT_SLIP && now == PERP_CONTACT_STICK;
        result->starts += before == PERP_CONTACT_STICK && now == PERP_CONTACT_SLIP;
        result->releases += before != PERP_CONTACT_SEPARATE && now == PERP_CONTACT_SEPARATE;
        result->reversals += before == PERP_CONTACT_SLIP && now == PERP_CONTACT_SLIP &&
                             c->sense_before[k] * c->sense[k] < 0.0;
    }
    hold_stuck(c);
    perp__compliant_hold(c, c->v);
    return status;
}

perp__event perp__compliant_event(perp_compliant *c)
{
    perp__event event = {-1, PERP_COMPLIANT_TIME}; /* it goes on */
    double beyond = 0.0;                           /* how fast what has turned round slides back */

    perp__compliant_normals(c, c->N, c->next_x, c->next_v);
    /* 1. what a force's sign lets go or take; else the slip that has turned round farthest */
    for (int32_t k = 0; k < c->p; k++) {
        const bool separate = c->modes[k] == PERP_CONTACT_SEPARATE;

        if (presses(c, k, c->next_x, c->N[k]) == separate) {
            event.contact = k;
            event.end = separate ? PERP_COMPLIANT_TOUCHED : PERP_COMPLIANT_RELEASED;
            break;
        }
        if (c->modes[k] == PERP_CONTACT_SLIP && c->mu_static[k] > 0.0) {
            const double sliding = c->sense[k] * perp__compliant_row(c, c->tangent, k, c->next_v);

            if (sliding <= beyond) {
                beyond = sliding;
                event.contact = k;
                event.end = PERP_COMPLIANT_STOPPED;
            } else if (event.contact < 0 &&
                       c->flank[k] * c->N[k] < -c->tol * c->stiffness * c->top_delta[k]) {
                event.contact = k; /* |N| has a kink there, which costs steps their order */
            }
        }
    }
    /* 2. what sticks beyond its friction */
    perp__compliant_friction(c, c->N);
    memset(c->gives, 0, (size_t)c->p * sizeof *c->gives);
    for (int32_t i = 0; i < c->stuck_count; i++) {
        const int32_t k = c->stuck[i];

        c->gives[k] = fabs(c->friction[k]) > c->mu_static[k] * (c->flank[k] * c->N[k]);
        if (c->gives[k])
            event.contact = k;
    }
    return event;
}
