/* Rows of a simulator's J as contacts, bounds and equations (perp_contact_source), arranged where
 * other things touch, with the impulses of what lasts. */
#include <math.h>
#include <string.h>

#include "base/check.h"
#include "contact/solver.h"

enum { CONTACTS, EQUATIONS, FRICTIONS, LIMITS, ALL_ROWS };
enum { SLOTS = 6, NAME = 3, NONE = 0, BY_FIRST = 2, BY_SECOND = 5 };

/* Of a contact of such a shape: its rows here, as places among the simulator's. Slots are normal,
 * tangents, rolling, spin. Shapes are the simulator's dimensions, none, and where one of two
 * tangents moves nothing the other one. */
static const int32_t row_of[7][SLOTS] = {{-1, -1, -1, -1, -1, -1}, {0, -1, -1, -1, -1, -1},
                                         {0, 1, -1, -1, -1, -1},   {0, 1, 2, -1, -1, -1},
                                         {0, 1, 2, -1, -1, 3},     {0, -1, 2, -1, -1, -1},
                                         {0, 1, 2, 4, 5, 3}};
static const int32_t rows_of[7] = {0, 1, 2, 3, 4, 2, 6};

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

static bool moves(const perp_contact_step *s, int32_t row)
{
    return perp__largest_or_nan(*s->J + (size_t)row * (size_t)s->n, s->n) != 0.0;
}

/* A row that is noise (as to the equilibration) beside its contact's others moves nothing: then
 * friction along it is none, unless surfaces move: they may do so along it. */
static int32_t shape_of(const perp_contact_step *s, const touch *t)
{
    static const int32_t shapes[8] = {NONE, 1, NONE, BY_FIRST, NONE, BY_SECOND, NONE, 3};
    const double *at = *s->J + (ptrdiff_t)t->row * s->n;
    const int32_t rows = t->row < 0 ? 0 : t->dim < 3 ? 1 : 3;
    const double least = 0x1p-40 * perp__largest_or_nan(at, rows * s->n);
    int32_t there = 0;

    for (int32_t i = 0; i < rows; i++, at += s->n)
        there |= !(perp__largest_or_nan(at, s->n) <= least) << i;
    return t->dim == 3 && s->source->surface_at == 0 ? shapes[there] : there % 2 ? t->dim : NONE;
}

bool perp__contact_rows_last(const perp_contact_solver *solver, const perp_contact_step *s)
{
    const perp__contact_rows *list = &solver->arranged[solver->arranged_now];
    const int32_t *now = s->source->counts;
    const size_t bounds = (size_t)list->counts[FRICTIONS];
    const size_t ids = bounds + (size_t)list->counts[LIMITS],
                 skip = (size_t)list->counts[EQUATIONS];

    if (!list->names || s->w != list->zeros || list->n != s->n || list->h != s->h ||
        memcmp(now, list->counts, sizeof list->counts) != 0)
        return 0;
    if ((ids > 0 && memcmp(*s->source->ids + skip, list->ids, ids * sizeof *list->ids) != 0) ||
        (bounds > 0 &&
         memcmp(*s->source->bounds + skip, list->bounds, bounds * sizeof *list->bounds) != 0))
        return 0;
    for (int32_t i = 0; i < now[EQUATIONS]; i++)
        if (moves(s, i) != list->moves[i])
            return 0;
    for (int32_t k = 0; k < now[CONTACTS]; k++) {
        const touch t = read_contact(s->source, k);
        const int32_t *seen = list->places + 4 * (size_t)k;

        if (t.geoms[0] != seen[0] || t.geoms[1] != seen[1] || t.row != seen[2] ||
            t.dim != seen[3] ||
            memcmp(t.friction, list->frictions + 5 * (size_t)k, sizeof t.friction) != 0 ||
            shape_of(s, &t) != list->moves[list->counts[EQUATIONS] + k])
            return 0;
    }
    return 1;
}

/* Slots of the tangents and the spin, among the three of a surface. */
static const int32_t surface_of[SLOTS] = {-1, 0, 1, -1, -1, 2};

bool perp__contact_rows_move(const perp_contact_solver *solver, const perp_contact_step *s)
{
    const perp__contact_rows *list = &solver->arranged[solver->arranged_now];
    bool changes = 0;

    for (int32_t c = 0; c < list->contacts; c++) {
        const char *at = (const char *)*s->source->contacts +
                         (ptrdiff_t)list->record[c] * s->source->stride + s->source->surface_at;
        int32_t row = list->first[c];
        double velocity[3];

        memcpy(velocity, at, sizeof velocity);
        for (int32_t slot = 0; slot < SLOTS; slot++) {
            const int32_t k = surface_of[slot];

            if (row_of[list->kept[c]][slot] < 0)
                continue;
            if (k >= 0)
                changes |= perp__put(&s->w[row], list->scale[row] * velocity[k]);
            row++;
        }
    }
    return changes;
}

static void lay_out(perp__arena *arena, void *object)
{
    perp__contact_rows *list = object;
    const size_t all = (size_t)list->counts[CONTACTS], bounded = (size_t)list->bounded;
    const size_t contacts = (size_t)list->contacts, rows = (size_t)list->rows;
    const size_t bilateral = (size_t)list->bilateral, size = rows + bilateral, n = (size_t)list->n;

    PERP__INTEGERS(arena, contacts, &list->dims, &list->kept, &list->record);
    PERP__INTEGERS(arena, contacts + 1, &list->first);
    PERP__INTEGERS(arena, size + 1, &list->H_rows, &list->G_rows, &list->gap_rows,
                   &list->gap_sources, &list->modes);
    PERP__DOUBLES(arena, contacts, &list->mu, &list->rolling, &list->spinning);
    PERP__DOUBLES(arena, bounded, &list->lower, &list->upper, &list->bounds);
    PERP__INTEGERS(arena, bounded, &list->ids);
    PERP__DOUBLES(arena, rows, &list->scale);
    PERP__DOUBLES(arena, size * (n + 3) + 1, &list->zeros);
    PERP__DOUBLES(arena, 2 * size, &list->start);
    PERP__INTEGERS(arena, 4 * all + 1, &list->places);
    PERP__DOUBLES(arena, 5 * all + 1, &list->frictions);
    PERP__INTEGERS(arena, (size_t)list->counts[EQUATIONS] + all + 1, &list->moves);
    PERP__INTEGERS(arena, NAME * (contacts + bounded) + 1, &list->names);
}

/* A second direction in units in which its coefficient is the first one's. */
static double scale_of(const touch *t, int32_t slot)
{
    const double *mu = t->friction + (slot == 4 ? 3 : 0);

    return (slot != 2 && slot != 4) || mu[1] == mu[0] ? 1.0 : mu[1] / mu[0];
}

static perp_status check_contact(perp_context *context, int32_t k, const touch *t, int32_t rows)
{
    if (!(t->dim == 1 || t->dim == 3 || t->dim == 4 || t->dim == 6) ||
        t->row > rows - rows_of[t->dim])
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
static perp_status count(perp_context *context, const perp_contact_step *s,
                         perp__contact_rows *list)
{
    const perp_contact_source *source = s->source;
    const int32_t *counts = memcpy(list->counts, source->counts, sizeof list->counts);
    int64_t rows = (int64_t)counts[FRICTIONS] + counts[LIMITS];

    list->n = s->n, list->h = s->h;
    list->contacts = list->bilateral = list->is_scaled = 0, list->bounded = (int32_t)rows;
    list->gaps = counts[LIMITS];
    for (int32_t i = 0; i < counts[EQUATIONS]; i++)
        list->bilateral += moves(s, i);
    for (int32_t k = 0; k < counts[CONTACTS]; k++) {
        const touch t = read_contact(source, k);
        const perp_status status =
            t.row < 0 ? PERP_OK : check_contact(context, k, &t, counts[ALL_ROWS]);
        const int32_t shape = status == PERP_OK ? shape_of(s, &t) : NONE;

        if (status != PERP_OK)
            return status;
        if (shape != NONE)
            list->contacts++, list->gaps++, rows += rows_of[shape];
    }
    if (rows + list->bilateral > INT32_MAX / ((int64_t)s->n + 4))
        return perp__refuse(context, "source: so many rows have more than 2^31 numbers");
    list->rows = (int32_t)rows;
    return PERP_OK;
}

/* By what an item is known to last: two numbers, and its place among neighbours with the same. */
static void name_item(perp__contact_rows *list, int32_t item, int32_t first, int32_t second)
{
    int32_t *name = list->names + NAME * (size_t)item;
    const int32_t *before = name - NAME;

    name[0] = first, name[1] = second;
    name[2] = item > 0 && memcmp(before, name, 2 * sizeof *name) == 0 ? before[2] + 1 : 0;
}

static void take_contacts(perp__contact_rows *list, const perp_contact_step *s, int32_t *row)
{
    int32_t c = 0;

    for (int32_t k = 0; k < list->counts[CONTACTS]; k++) {
        const touch t = read_contact(s->source, k);
        const int32_t shape = shape_of(s, &t);

        memcpy(list->places + 4 * (size_t)k, (int32_t[]){t.geoms[0], t.geoms[1], t.row, t.dim},
               4 * sizeof *list->places);
        memcpy(list->frictions + 5 * (size_t)k, t.friction, sizeof t.friction);
        list->moves[list->counts[EQUATIONS] + k] = shape;
        if (shape == NONE)
            continue;
        name_item(list, c, t.geoms[0], t.geoms[1]);
        list->record[c] = k;
        list->first[c] = list->gap_rows[c] = *row;
        list->kept[c] = shape;
        list->dims[c] = rows_of[shape] < 3 ? rows_of[shape] : 3;
        list->mu[c] = shape > 1 ? t.friction[0] : 0.0;
        list->spinning[c] = t.dim >= 4 ? t.friction[2] : 0.0;
        list->rolling[c] = t.dim == 6 ? t.friction[3] : 0.0;
        list->gap_sources[c++] = t.row;
        for (int32_t slot = 0; slot < SLOTS; slot++)
            if (row_of[shape][slot] >= 0) {
                list->scale[*row] = scale_of(&t, slot);
                list->is_scaled |= list->scale[*row] != 1.0;
                list->H_rows[(*row)++] = t.row + row_of[shape][slot];
            }
    }
    list->first[c] = *row;
}

/* Rows of dry friction and limits, and equations. */
static void take_rows(perp__contact_rows *list, const perp_contact_step *s, int32_t *row)
{
    const int32_t *kinds = *s->source->kinds, *ids = *s->source->ids;
    int32_t gap = list->contacts, equation = 0;

    for (int32_t k = 0; k < list->bounded; k++) {
        const int32_t from = list->counts[EQUATIONS] + k, limits = k >= list->counts[FRICTIONS];
        const double most = limits ? INFINITY : list->h * (*s->source->bounds)[from];

        /* kinds as numbers that no geom has */
        name_item(list, list->contacts + k, INT32_MIN + (kinds[from] & INT32_MAX), ids[from]);
        list->ids[k] = ids[from];
        list->bounds[k] = limits ? 0.0 : (*s->source->bounds)[from];
        list->lower[k] = limits ? 0.0 : -most;
        list->upper[k] = most;
        if (limits)
            list->gap_rows[gap] = *row, list->gap_sources[gap++] = from;
        list->scale[*row] = 1.0;
        list->H_rows[(*row)++] = from;
    }
    for (int32_t i = 0; i < list->counts[EQUATIONS]; i++) {
        if ((list->moves[i] = moves(s, i)) != 0)
            list->G_rows[equation++] = i;
    }
}

/* The impulses of contact or row `item` by slots; where they begin among the rows. */
static int32_t begin_of(const perp__contact_rows *list, int32_t item, const int32_t **slots)
{
    const bool is_contact = item < list->contacts;

    *slots = row_of[is_contact ? list->kept[item] : 1];
    return is_contact ? list->first[item] : list->first[list->contacts] + item - list->contacts;
}

/* Impulses, and those of openings behind them. What lasts is mostly in the same order. */
static void hand_over(perp__contact_rows *list, const perp__contact_rows *old)
{
    const int32_t items = list->contacts + list->bounded, olds = old->contacts + old->bounded;
    const int32_t size = list->rows + list->bilateral, old_size = old->rows + old->bilateral;
    const double *before = old->start;
    double *start = list->start;
    int32_t next = 0;

    for (int32_t item = 0; item < items && olds > 0; item++)
        for (int32_t tried = 0; tried < olds; tried++) {
            const int32_t was = (next + tried) % olds;

            if (memcmp(old->names + NAME * (size_t)was, list->names + NAME * (size_t)item,
                       NAME * sizeof *list->names) == 0) {
                const int32_t *slots, *old_slots;
                int32_t row = begin_of(list, item, &slots), from = begin_of(old, was, &old_slots);

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
    for (int32_t k = 0; k < 2 && list->bilateral == old->bilateral && list->bilateral > 0; k++)
        memcpy(start + k * size + list->rows, before + k * old_size + old->rows,
               (size_t)list->bilateral * sizeof *start);
}

/* w, b, r, u and start begin at 0, as H and G do. */
static void show(perp__contact_rows *list, perp_contact_step *s, perp_contact_laws *laws,
                 perp_contact_dynamics *dynamics)
{
    const size_t rows = (size_t)list->rows, size = rows + (size_t)list->bilateral;
    double *at = list->zeros;

    s->w = at, s->b = at + rows, s->H = at + size, s->G = s->H + rows * (size_t)list->n;
    at += size * ((size_t)list->n + 1);
    s->r = at, s->u = at + size, s->start = list->start;
    s->contacts = list->contacts, s->rows = list->rows, s->bilateral = list->bilateral;
    s->H_entries = list->rows * list->n, s->G_entries = list->bilateral * list->n;
    s->gap_count = list->gaps, s->J_rows = list->counts[ALL_ROWS], s->by_rows = 1, s->rests = 0;
    s->H_rows = list->H_rows, s->G_rows = list->G_rows,
    s->row_scale = list->is_scaled ? list->scale : NULL;
    s->gap_rows = list->gap_rows, s->gap_sources = list->gap_sources;
    s->first = list->first, s->modes = list->modes;
    s->watch_count = 0;
    list->views[0] = perp__view(PERP_STORAGE_ROW_MAJOR, list->rows, list->n, s->H);
    list->views[1] = perp__view(PERP_STORAGE_ROW_MAJOR, list->bilateral, list->n, s->G);
    dynamics->H = &list->views[0];
    dynamics->G = list->bilateral > 0 ? &list->views[1] : NULL;
    laws->contacts = list->contacts, laws->bounded = list->bounded;
    laws->dims = list->dims, laws->mu = list->mu;
    laws->rolling = list->rolling, laws->spinning = list->spinning;
    laws->lower = list->lower, laws->upper = list->upper;
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
    perp__contact_rows *list = &solver->arranged[!solver->arranged_now];
    perp_status status = PERP__CHECK(perp_contact_step, solver->context, s);
    int32_t row = 0;
    size_t size;

    if (status == PERP_OK && !s->source)
        status = perp__check_pointer(solver->context, "step.source", NULL);
    PERP__THEN(status, PERP__CHECK(perp_contact_laws, solver->context, laws));
    PERP__THEN(status, PERP__CHECK(perp_contact_dynamics, solver->context, dynamics));
    PERP__THEN(status, perp__contact_check_source(solver->context, s));
    PERP__THEN(status, count(solver->context, s, list));
    PERP__THEN(status, perp__arena_fit(&list->arena, solver->context, lay_out, list));
    if (status != PERP_OK)
        return status;
    size = (size_t)list->rows + (size_t)list->bilateral;
    memset(list->zeros, 0, size * ((size_t)list->n + 3) * sizeof(double));
    if (size > 0)
        memset(list->start, 0, 2 * size * sizeof(double));
    take_contacts(list, s, &row);
    take_rows(list, s, &row);
    if (old->names && s->w == old->zeros)
        hand_over(list, old);
    show(list, s, laws, dynamics);
    solver->arranged_now = !solver->arranged_now;
    return PERP_OK;
}

perp_status perp_contact_solver_arrange(perp_contact_solver *solver, perp_contact_step *step,
                                        perp_contact_laws *laws, perp_contact_dynamics *dynamics)
{
    return PERP__CONTACT_CALL(solver, arrange(solver, step, laws, dynamics));
}
