#include "laws.h"

#include <math.h>
#include <string.h>

static void add_law(laws_problem *p, int32_t kind, int32_t rows, int32_t normal, double mu)
{
    if (rows > 0)
        p->law[p->count++] =
            (oracle_law){kind, p->rows, rows, normal, mu, p->rows, rows, 0, 0, 0, 0};
    p->rows += rows;
}

static void add_contact(laws_problem *p, int32_t k)
{
    int32_t dim = p->laws.dims ? p->dims[k] : p->laws.dim, normal = p->rows, law = p->count;
    int32_t both = p->two_sided[k], normals = both > 0 ? both : 1;
    double rolling = p->laws.rolling ? p->rolling[k] : 0;
    double spinning = p->laws.spinning ? p->spinning[k] : 0;

    p->first[k] = normal;
    add_law(p, both > 0 ? ORACLE_BILATERAL : ORACLE_NORMAL, normals, -1, 0);
    add_law(p, ORACLE_FRICTION, dim - normals, normal, p->laws.mu ? p->mu[k] : 0);
    p->law[p->count - 1].normals = both;
    if (rolling > 0 && dim > 1)
        add_law(p, ORACLE_FRICTION, dim - 1, normal, rolling);
    if (spinning > 0 && dim == 3)
        add_law(p, ORACLE_FRICTION, 1, normal, spinning);
    for (; law < p->count; law++) {
        p->law[law].block = normal;
        p->law[law].block_rows = p->rows - normal;
    }
}

/* Rows with bounds and contacts that hold both ways come from trailers, two bytes of numbers, then
 * two of a name. Without them, as in inputs of before there were such rows, there are none. */
static uint32_t take_trailer(fuzz_bytes *bytes, char kind)
{
    const uint8_t *end = bytes->end;

    if (end - bytes->at < 4 || end[-2] != 'b' || end[-1] != kind)
        return 0;
    bytes->end -= 4;
    return end[-4] | (uint32_t)end[-3] << 8;
}

/* Five bits a row: how far its bounds are off, and which of them there are. */
static void add_bounded(laws_problem *p, uint32_t trailer)
{
    static const double sizes[] = {1, 0, 1e-3, 1e3, 1e6, 1e9, 1e12, 1e-9};
    int32_t k;

    for (k = 0; k < LAWS_BOUNDED && trailer >> 5 * k; k++) {
        const double size = sizes[trailer >> 5 * k & 7];
        const int32_t sides = trailer >> (5 * k + 3) & 3;

        p->lower[k] = sides == 1 ? -INFINITY : sides == 2 ? -size : 0.5 * size * (sides - 1);
        p->upper[k] = sides == 2 ? INFINITY : size;
        add_law(p, ORACLE_BOUNDED, 1, -1, 0);
        p->law[p->count - 1].lower = p->lower[k];
        p->law[p->count - 1].upper = p->upper[k];
    }
    p->laws.bounded = k;
    p->laws.lower = k > 0 ? p->lower : NULL;
    p->laws.upper = k > 0 ? p->upper : NULL;
}

static void hold_both_ways(laws_problem *p, uint32_t trailer)
{
    int32_t k;

    if (trailer == 0)
        return;
    for (k = 0; k < p->laws.contacts; k++) {
        p->two_sided[k] = (int32_t)(trailer >> 3 * k & 3);
        if (p->two_sided[k] > 0) {
            p->dims[k] = p->two_sided[k] + (p->dims[k] > 2 ? 2 : 1);
            p->rolling[k] = p->spinning[k] = 0;
        }
    }
    p->laws.dims = p->dims;
    p->laws.two_sided = p->two_sided;
}

void laws_make(fuzz_bytes *bytes, fuzz_mood mood, laws_problem *p)
{
    uint32_t bounded = take_trailer(bytes, '3'), both = take_trailer(bytes, '2');
    uint8_t flags;
    int32_t k;

    memset(p, 0, sizeof *p);
    if (perp_contact_laws_init(&p->laws, sizeof p->laws) != PERP_OK)
        fuzz_fail("perp_contact_laws_init takes its own size");
    flags = fuzz_byte(bytes);
    p->laws.contacts = fuzz_pick(bytes, LAWS_CONTACTS + 1);
    p->laws.dim = 3 - fuzz_pick(bytes, 3);
    p->laws.bilateral = flags & 1 ? fuzz_pick(bytes, 3) : 0;
    for (k = 0; k < p->laws.contacts; k++) {
        p->dims[k] = flags & 2 ? 1 + fuzz_pick(bytes, 3) : p->laws.dim;
        p->mu[k] = fuzz_one_in(bytes, 8) ? fuzz_size(bytes, mood) : fuzz_pick(bytes, 9) * 0.125;
        p->rolling[k] = flags & 8 && p->dims[k] > 1 ? fuzz_pick(bytes, 4) * 0.05 : 0;
        p->spinning[k] = flags & 16 && p->dims[k] > 2 ? fuzz_pick(bytes, 4) * 0.05 : 0;
    }
    p->laws.dims = flags & 2 ? p->dims : NULL;
    p->laws.mu = flags & 4 ? NULL : p->mu;
    p->laws.rolling = flags & 8 ? p->rolling : NULL;
    p->laws.spinning = flags & 16 ? p->spinning : NULL;
    hold_both_ways(p, both);
    for (k = 0; k < p->laws.contacts; k++)
        add_contact(p, k);
    add_bounded(p, bounded);
    for (k = 0; k < p->laws.bilateral; k++)
        add_law(p, ORACLE_BILATERAL, 1, -1, 0);
    if (flags & 32) {
        for (k = 0; k < p->rows; k++)
            p->compliance[k] = fuzz_pick(bytes, 4) * 0.01;
        p->laws.compliance = p->compliance;
    }
}

int laws_settings_make(fuzz_bytes *bytes, perp_contact_settings *settings, laws_problem *p)
{
    uint8_t flags = fuzz_byte(bytes);
    int32_t k;

    if (perp_contact_settings_init(settings, sizeof *settings) != PERP_OK)
        fuzz_fail("perp_contact_settings_init takes its own size");
    settings->method = fuzz_pick(bytes, 4);
    settings->tol = fuzz_tol(bytes, settings->tol);
    if (flags & 1 && flags & 2)
        settings->cone = 3 + fuzz_pick(bytes, 8);
    if (flags & 4)
        settings->max_iterations = fuzz_pick(bytes, 20);
    if ((flags & 0x18) == 0x18)
        settings->time_limit = fuzz_one_in(bytes, 2) ? 1e-3 : 1e-6;
    for (k = 0; settings->cone && k < p->count; k++)
        p->law[k].polyhedral = p->law[k].rows == 2;
    return settings->max_iterations > 0 || settings->time_limit > 0;
}

/* The word for a row with bounds, which it is at, as far as it is known at all. */
static void check_bounded_mode(const char *where, const laws_problem *p,
                               const perp_contact_settings *settings,
                               const perp_contact_result *result, int32_t k, double r, double u,
                               int32_t mode)
{
    const double near = oracle_limit(result->outcome, settings->tol) * (p->upper[k] - p->lower[k]);
    const int known =
        mode == PERP_CONTACT_STICK || mode == PERP_CONTACT_LOWER || mode == PERP_CONTACT_UPPER;

    if (!known || (fuzz_good(result->outcome) &&
                   ((mode == PERP_CONTACT_LOWER && !(r - p->lower[k] <= near)) ||
                    (mode == PERP_CONTACT_UPPER && !(p->upper[k] - r <= near)) ||
                    (mode == PERP_CONTACT_STICK && u != 0))))
        fuzz_fail("%s: '%s' with tol %g: row %d with bounds is called '%s' with r = %g, u = %g",
                  where, perp_outcome_text(result->outcome), settings->tol, k,
                  perp_contact_mode_text(mode), r, u);
}

/* A contact that separates carries nothing; one that sticks has velocity 0.0; who presses stays. */
static void check_modes(const char *where, const laws_problem *p,
                        const perp_contact_settings *settings, const perp_contact_result *result,
                        const double *r, const double *u, const int32_t *modes)
{
    int32_t first = p->rows - p->laws.bilateral - p->laws.bounded, k, i;

    for (k = 0; k < p->laws.contacts; k++) {
        int32_t end = k + 1 < p->laws.contacts ? p->first[k + 1] : first;

        for (i = p->first[k]; i < end; i++) {
            if (modes[k] == PERP_CONTACT_SEPARATE && r[i] != 0)
                fuzz_fail("%s: contact %d separates with impulse r[%d] = %g", where, k, i, r[i]);
            if (modes[k] == PERP_CONTACT_STICK && fuzz_good(result->outcome) && u[i] != 0)
                fuzz_fail("%s: contact %d sticks with velocity u[%d] = %g", where, k, i, u[i]);
        }
        for (i = p->first[k]; fuzz_good(result->outcome) && i < p->first[k] + p->two_sided[k]; i++)
            if (u[i] != 0 || modes[k] == PERP_CONTACT_SEPARATE)
                fuzz_fail("%s: contact %d holds both ways, with u[%d] = %g", where, k, i, u[i]);
        if (fuzz_good(result->outcome) && r[p->first[k]] > 0 && u[p->first[k]] != 0)
            fuzz_fail("%s: contact %d presses with r_n = %g and opens with u_n = %g", where, k,
                      r[p->first[k]], u[p->first[k]]);
    }
    for (k = 0; k < p->laws.bounded; k++)
        check_bounded_mode(where, p, settings, result, k, r[first + k], u[first + k],
                           modes[p->laws.contacts + k]);
    for (i = p->rows - p->laws.bilateral; fuzz_good(result->outcome) && i < p->rows; i++)
        if (u[i] != 0)
            fuzz_fail("%s: bilateral row %d moves with %g", where, i, u[i]);
}

void laws_check(const char *where, const laws_problem *p, wide *W, const wide *q, const wide *t,
                const perp_contact_settings *settings, const perp_contact_result *result,
                const double *r, const double *u, const int32_t *modes)
{
    oracle_contacts contacts = {where,  p->rows, p->count, result->outcome, settings->tol, W, q, t,
                                p->law, r,       u};
    int32_t k;

    if (isnan(result->residual))
        fuzz_fail("%s: the residual is a number with outcome '%s'", where,
                  perp_outcome_text(result->outcome));
    if (result->outcome == PERP_OUTCOME_SOLVED && !(result->residual <= settings->tol))
        fuzz_fail("%s: 'solved' with tested residual %g", where, result->residual);
    if (result->certificate != PERP_CONTACT_CERTIFICATE_NONE && fuzz_good(result->outcome))
        fuzz_fail("%s: '%s' with a proof that there is no answer", where,
                  perp_outcome_text(result->outcome));
    for (k = 0; p->laws.compliance && k < p->rows; k++)
        W[k * p->rows + k] += p->compliance[k];
    if (fuzz_good(result->outcome))
        fuzz_finite("u", u, p->rows);
    check_modes(where, p, settings, result, r, u, modes);
    oracle_check_contacts(&contacts);
}
