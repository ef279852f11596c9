/* Rows of a simulator's J as contacts, bounds and equations (perp_contact_source), arranged where
 * other things touch, with the impulses of what lasts. */
#include <math.h>
#include <string.h>

#include "base/check.h"
#include "contact/solver.h"

PERP__INIT(perp_contact_source)

enum { CONTACTS, EQUATIONS, FRICTIONS, LIMITS, ALL_ROWS };
enum { SLOTS = 6, NAME = 3 };

/* Of a contact of so many dimensions: its rows here, as places among the simulator's. Slots are
 * normal, tangents, rolling, spin. */
static const int32_t row_of[7][SLOTS] = {{-1, -1, -1, -1, -1, -1}, {0, -1, -1, -1, -1, -1},
                                         {-1, -1, -1, -1, -1, -1}, {0, 1, 2, -1, -1, -1},
                                         {0, 1, 2, -1, -1, 3},     {-1, -1, -1, -1, -1, -1},
                                         {0, 1, 2, 4, 5, 3}};
static const int32_t rows_of[7] = {0, 1, 0, 3, 4, 0, 6};

typedef struct touch {
    int32_t geoms[2], row, dim;
    double friction[5];
} touch;

static touch read_contact(const perp_contact_source *source, int32_t k)
{
    const char *at = (const char *)*source->contacts + (ptrdiff_t)k * source->stride;
    touch t;

    memcpy(t.geoms, at + source->geoms_at, sizeof t.geoms);
    memcpy(&t.row, at + source->row_at, sizeof t.row);
    memcpy(&t.dim, at + source->dim_at, sizeof t.dim);
    memcpy(t.friction, at + source->friction_at, sizeof t.friction);
    return t;
}

static int32_t moves(const perp_contact_step *s, int32_t row)
{
    return perp__largest_or_nan(*s->J + (size_t)row * (size_t)s->n, s->n) != 0.0;
}

/* A normal that is noise (as to the equilibration) beside its tangents moves nothing. */
static int32_t contact_moves(const perp_contact_step *s, const touch *t)
{
    const double *at = *s->J + (ptrdiff_t)t->row * s->n;
    const int32_t all = (t->dim < 3 ? 1 : 3) * s->n;

    return t->row >= 0 &&
           !(perp__largest_or_nan(at, s->n) <= 0x1p-40 * perp__largest_or_nan(at, all));
}

int32_t perp__contact_rows_last(const perp_contact_solver *solver, const perp_contact_step *s)
{
    const perp__contact_rows *own = &solver->arranged[solver->arranged_now];
    const int32_t *now = s->source->counts;
    const size_t bounds = (size_t)own->counts[FRICTIONS];
    const size_t ids = bounds + (size_t)own->counts[LIMITS], skip = (size_t)own->counts[EQUATIONS];

    if (!own->names || s->w != own->zeros || own->n != s->n || own->h != s->h ||
        memcmp(now, own->counts, sizeof own->counts) != 0)
        return 0;
    if ((ids > 0 && memcmp(*s->source->ids + skip, own->ids, ids * sizeof *own->ids) != 0) ||
        (bounds > 0 &&
         memcmp(*s->source->bounds + skip, own->bounds, bounds * sizeof *own->bounds) != 0))
        return 0;
    for (int32_t i = 0; i < now[EQUATIONS]; i++)
        if (moves(s, i) != own->moves[i])
            return 0;
    for (int32_t k = 0; k < now[CONTACTS]; k++) {
        const touch t = read_contact(s->source, k);
        const int32_t *seen = own->places + 4 * (size_t)k;

        if (t.geoms[0] != seen[0] || t.geoms[1] != seen[1] || t.row != seen[2] ||
            t.dim != seen[3] ||
            memcmp(t.friction, own->frictions + 5 * (size_t)k, sizeof t.friction) != 0 ||
            contact_moves(s, &t) != own->moves[own->counts[EQUATIONS] + k])
            return 0;
    }
    return 1;
}

/* Slots of the tangents and the spin, among the three of a surface. */
static const int32_t surface_of[SLOTS] = {-1, 0, 1, -1, -1, 2};

int32_t perp__contact_rows_move(const perp_contact_solver *solver, const perp_contact_step *s)
{
    const perp__contact_rows *own = &solver->arranged[solver->arranged_now];
    int32_t changes = 0;

    for (int32_t c = 0; c < own->contacts; c++) {
        const char *at = (const char *)*s->source->contacts +
                         (ptrdiff_t)own->record[c] * s->source->stride + s->source->surface_at;
        int32_t row = own->first[c];
        double velocity[3];

        memcpy(velocity, at, sizeof velocity);
        for (int32_t slot = 0; slot < SLOTS; slot++) {
            const int32_t k = surface_of[slot];

            if (row_of[own->kept[c]][slot] < 0)
                continue;
            if (k >= 0)
                changes |= perp__put(&s->w[row], own->scale[row] * velocity[k]);
            row++;
        }
    }
    return changes;
}

static void lay_out(perp__arena *arena, void *object)
{
    perp__contact_rows *own = object;
    const size_t all = (size_t)own->counts[CONTACTS], bounded = (size_t)own->bounded;
    const size_t contacts = (size_t)own->contacts, rows = (size_t)own->rows;
    const size_t bilateral = (size_t)own->bilateral, size = rows + bilateral, n = (size_t)own->n;

    PERP__INTEGERS(arena, contacts, &own->dims, &own->kept, &own->record);
    PERP__INTEGERS(arena, contacts + 1, &own->first);
    PERP__INTEGERS(arena, size + 1, &own->H_rows, &own->G_rows, &own->gap_rows, &own->gap_sources,
                   &own->modes);
    PERP__DOUBLES(arena, contacts, &own->mu, &own->rolling, &own->spinning);
    PERP__DOUBLES(arena, bounded, &own->lower, &own->upper, &own->bounds);
    PERP__INTEGERS(arena, bounded, &own->ids);
    PERP__DOUBLES(arena, rows, &own->scale);
    PERP__DOUBLES(arena, size * (n + 3) + 1, &own->zeros);
    PERP__DOUBLES(arena, 2 * size, &own->start);
    PERP__INTEGERS(arena, 4 * all + 1, &own->places);
    PERP__DOUBLES(arena, 5 * all + 1, &own->frictions);
    PERP__INTEGERS(arena, (size_t)own->counts[EQUATIONS] + all + 1, &own->moves);
    PERP__INTEGERS(arena, NAME * (contacts + bounded) + 1, &own->names);
}

/* A second direction in units in which its coefficient is the first one's. */
static double scale_of(const touch *t, int32_t slot)
{
    const double *mu = t->friction + (slot == 4 ? 3 : 0);

    return (slot != 2 && slot != 4) || mu[1] == mu[0] ? 1.0 : mu[1] / mu[0];
}

static perp_status check_contact(perp_context *context, int32_t k, const touch *t, int32_t rows)
{
    if (t->dim < 0 || t->dim > 6 || rows_of[t->dim] == 0 || t->row > rows - rows_of[t->dim])
        return perp__refuse(context, "source: contact %d has dimension %d and row %d", (int)k,
                            (int)t->dim, (int)t->row);
    for (int32_t slot = 2; slot <= 4; slot += 2) {
        const double scale = row_of[t->dim][slot] >= 0 ? scale_of(t, slot) : 1.0;

        if (!(scale >= 0.0 && scale < INFINITY))
            return perp__refuse(context, "source: contact %d has friction %g beside %g", (int)k,
                                t->friction[slot == 2 ? 1 : 4], t->friction[slot == 2 ? 0 : 3]);
    }
    return PERP_OK;
}

/* How many there are of what. Counts of numbers fit what a step has them in. */
static perp_status count(perp_context *context, const perp_contact_step *s, perp__contact_rows *own)
{
    const perp_contact_source *source = s->source;
    const int32_t *counts = memcpy(own->counts, source->counts, sizeof own->counts);
    int64_t rows = (int64_t)counts[FRICTIONS] + counts[LIMITS];

    own->n = s->n, own->h = s->h;
    own->contacts = own->bilateral = own->is_scaled = 0, own->bounded = (int32_t)rows;
    own->gaps = counts[LIMITS];
    for (int32_t i = 0; i < counts[EQUATIONS]; i++)
        own->bilateral += moves(s, i);
    for (int32_t k = 0; k < counts[CONTACTS]; k++) {
        const touch t = read_contact(source, k);
        const perp_status status =
            t.row < 0 ? PERP_OK : check_contact(context, k, &t, counts[ALL_ROWS]);

        if (status != PERP_OK)
            return status;
        if (contact_moves(s, &t))
            own->contacts++, own->gaps++, rows += rows_of[t.dim];
    }
    if (rows + own->bilateral > INT32_MAX / ((int64_t)s->n + 4))
        return perp__refuse(context, "source: so many rows have more than 2^31 numbers");
    own->rows = (int32_t)rows;
    return PERP_OK;
}

/* By what an item is known to last: two numbers, and its place among neighbours with the same. */
static void name_item(perp__contact_rows *own, int32_t item, int32_t first, int32_t second)
{
    int32_t *name = own->names + NAME * (size_t)item;
    const int32_t *before = name - NAME;

    name[0] = first, name[1] = second;
    name[2] = item > 0 && memcmp(before, name, 2 * sizeof *name) == 0 ? before[2] + 1 : 0;
}

static void take_contacts(perp__contact_rows *own, const perp_contact_step *s, int32_t *row)
{
    int32_t c = 0;

    for (int32_t k = 0; k < own->counts[CONTACTS]; k++) {
        const touch t = read_contact(s->source, k);
        const int32_t there = contact_moves(s, &t);

        memcpy(own->places + 4 * (size_t)k, (int32_t[]){t.geoms[0], t.geoms[1], t.row, t.dim},
               4 * sizeof *own->places);
        memcpy(own->frictions + 5 * (size_t)k, t.friction, sizeof t.friction);
        own->moves[own->counts[EQUATIONS] + k] = there;
        if (!there)
            continue;
        name_item(own, c, t.geoms[0], t.geoms[1]);
        own->record[c] = k;
        own->first[c] = own->gap_rows[c] = *row;
        own->kept[c] = t.dim;
        own->dims[c] = t.dim == 1 ? 1 : 3;
        own->mu[c] = t.dim >= 3 ? t.friction[0] : 0.0;
        own->spinning[c] = t.dim >= 4 ? t.friction[2] : 0.0;
        own->rolling[c] = t.dim == 6 ? t.friction[3] : 0.0;
        own->gap_sources[c++] = t.row;
        for (int32_t slot = 0; slot < SLOTS; slot++)
            if (row_of[t.dim][slot] >= 0) {
                own->scale[*row] = scale_of(&t, slot);
                own->is_scaled |= own->scale[*row] != 1.0;
                own->H_rows[(*row)++] = t.row + row_of[t.dim][slot];
            }
    }
    own->first[c] = *row;
}

/* Rows of dry friction and limits, and equations. */
static void take_rows(perp__contact_rows *own, const perp_contact_step *s, int32_t *row)
{
    const int32_t *kinds = *s->source->kinds, *ids = *s->source->ids;
    int32_t gap = own->contacts, equation = 0;

    for (int32_t k = 0; k < own->bounded; k++) {
        const int32_t from = own->counts[EQUATIONS] + k, limits = k >= own->counts[FRICTIONS];
        const double most = limits ? INFINITY : own->h * (*s->source->bounds)[from];

        /* kinds as numbers that no geom has */
        name_item(own, own->contacts + k, INT32_MIN + (kinds[from] & INT32_MAX), ids[from]);
        own->ids[k] = ids[from];
        own->bounds[k] = limits ? 0.0 : (*s->source->bounds)[from];
        own->lower[k] = limits ? 0.0 : -most;
        own->upper[k] = most;
        if (limits)
            own->gap_rows[gap] = *row, own->gap_sources[gap++] = from;
        own->scale[*row] = 1.0;
        own->H_rows[(*row)++] = from;
    }
    for (int32_t i = 0; i < own->counts[EQUATIONS]; i++) {
        if ((own->moves[i] = moves(s, i)) != 0)
            own->G_rows[equation++] = i;
    }
}

/* The impulses of contact or row `item` by slots; where they begin among the rows. */
static int32_t begin_of(const perp__contact_rows *own, int32_t item, const int32_t **slots)
{
    const int32_t is_contact = item < own->contacts;

    *slots = row_of[is_contact ? own->kept[item] : 1];
    return is_contact ? own->first[item] : own->first[own->contacts] + item - own->contacts;
}

/* Impulses, and those of openings behind them. What lasts is mostly in the same order. */
static void hand_over(perp__contact_rows *own, const perp__contact_rows *old)
{
    const int32_t items = own->contacts + own->bounded, olds = old->contacts + old->bounded;
    const int32_t size = own->rows + own->bilateral, old_size = old->rows + old->bilateral;
    const double *before = old->start;
    double *start = own->start;
    int32_t next = 0;

    for (int32_t item = 0; item < items && olds > 0; item++)
        for (int32_t tried = 0; tried < olds; tried++) {
            const int32_t was = (next + tried) % olds;

            if (memcmp(old->names + NAME * (size_t)was, own->names + NAME * (size_t)item,
                       NAME * sizeof *own->names) == 0) {
                const int32_t *slots, *old_slots;
                int32_t row = begin_of(own, item, &slots), from = begin_of(old, was, &old_slots);

                for (int32_t slot = 0; slot < SLOTS; slot++) {
                    const int32_t had = old_slots[slot] >= 0;

                    if (slots[slot] >= 0 && had)
                        start[row] = before[from], start[row + size] = before[from + old_size];
                    row += slots[slot] >= 0;
                    from += had;
                }
                next = was + 1;
                break;
            }
        }
    for (int32_t k = 0; k < 2 && own->bilateral == old->bilateral && own->bilateral > 0; k++)
        memcpy(start + k * size + own->rows, before + k * old_size + old->rows,
               (size_t)own->bilateral * sizeof *start);
}

/* w, b, r, u and start begin at 0, as H and G do. */
static void show(perp__contact_rows *own, perp_contact_step *s, perp_contact_laws *laws,
                 perp_contact_dynamics *dynamics)
{
    const size_t rows = (size_t)own->rows, size = rows + (size_t)own->bilateral;
    double *at = own->zeros;

    s->w = at, s->b = at + rows, s->H = at + size, s->G = s->H + rows * (size_t)own->n;
    at += size * ((size_t)own->n + 1);
    s->r = at, s->u = at + size, s->start = own->start;
    s->contacts = own->contacts, s->rows = own->rows, s->bilateral = own->bilateral;
    s->H_entries = own->rows * own->n, s->G_entries = own->bilateral * own->n;
    s->gap_count = own->gaps, s->J_rows = own->counts[ALL_ROWS], s->by_rows = 1, s->rests = 0;
    s->H_rows = own->H_rows, s->G_rows = own->G_rows,
    s->row_scale = own->is_scaled ? own->scale : NULL;
    s->gap_rows = own->gap_rows, s->gap_sources = own->gap_sources;
    s->first = own->first, s->modes = own->modes;
    s->watch_count = 0;
    own->views[0] = perp__view(PERP_STORAGE_ROW_MAJOR, own->rows, own->n, s->H);
    own->views[1] = perp__view(PERP_STORAGE_ROW_MAJOR, own->bilateral, own->n, s->G);
    dynamics->H = &own->views[0];
    dynamics->G = own->bilateral > 0 ? &own->views[1] : NULL;
    laws->contacts = own->contacts, laws->bounded = own->bounded;
    laws->dims = own->dims, laws->mu = own->mu;
    laws->rolling = own->rolling, laws->spinning = own->spinning;
    laws->lower = own->lower, laws->upper = own->upper;
}

perp_status perp__contact_check_source(perp_context *context, const perp_contact_step *s)
{
    const perp_contact_source *source = s->source;
    perp_status status = PERP__CHECK(perp_contact_source, context, source);
    int64_t all = 0;

    if (status != PERP_OK)
        return status;
    if (!source->counts || !source->contacts || !source->kinds || !source->ids || !source->bounds)
        return perp__refuse(context, "source has a NULL");
    for (int32_t k = 0; k < 5; k++)
        if (source->counts[k] < 0)
            return perp__refuse(context, "source.counts[%d] is below 0", (int)k);
    for (int32_t k = EQUATIONS; k <= LIMITS; k++)
        all += source->counts[k];
    if (all > source->counts[ALL_ROWS])
        return perp__refuse(context, "source.counts has fewer rows than there are of each kind");
    if (source->counts[CONTACTS] > 0 && !*source->contacts)
        return perp__refuse(context, "*source.contacts is NULL");
    if (all > 0 && (!*source->kinds || !*source->ids || !*source->bounds))
        return perp__refuse(context, "*source.kinds, *source.ids or *source.bounds is NULL");
    if (source->counts[ALL_ROWS] > 0 && (!s->J || !*s->J))
        return perp__check_pointer(context, "step.J", NULL);
    if (s->n < 0 || !(s->h > 0.0 && s->h < INFINITY))
        return perp__refuse(context, "step.n or step.h is below 0 or no number");
    return PERP_OK;
}

static perp_status arrange(perp_contact_solver *solver, perp_contact_step *s,
                           perp_contact_laws *laws, perp_contact_dynamics *dynamics)
{
    const perp__contact_rows *old = &solver->arranged[solver->arranged_now];
    perp__contact_rows *own = &solver->arranged[!solver->arranged_now];
    perp_status status = PERP__CHECK(perp_contact_step, solver->context, s);
    int32_t row = 0;
    size_t size;

    if (status == PERP_OK && !s->source)
        status = perp__check_pointer(solver->context, "step.source", NULL);
    PERP__THEN(status, PERP__CHECK(perp_contact_laws, solver->context, laws));
    PERP__THEN(status, PERP__CHECK(perp_contact_dynamics, solver->context, dynamics));
    PERP__THEN(status, perp__contact_check_source(solver->context, s));
    PERP__THEN(status, count(solver->context, s, own));
    PERP__THEN(status, perp__arena_fit(&own->arena, solver->context, lay_out, own));
    if (status != PERP_OK)
        return status;
    size = (size_t)own->rows + (size_t)own->bilateral;
    memset(own->zeros, 0, size * ((size_t)own->n + 3) * sizeof(double));
    if (size > 0)
        memset(own->start, 0, 2 * size * sizeof(double));
    take_contacts(own, s, &row);
    take_rows(own, s, &row);
    if (old->names && s->w == old->zeros)
        hand_over(own, old);
    show(own, s, laws, dynamics);
    solver->arranged_now = !solver->arranged_now;
    return PERP_OK;
}

perp_status perp_contact_solver_arrange(perp_contact_solver *solver, perp_contact_step *step,
                                        perp_contact_laws *laws, perp_contact_dynamics *dynamics)
{
    return PERP__CONTACT_CALL(solver, arrange(solver, step, laws, dynamics));
}
