#include "contact/bounded.h"

#include <math.h>
#include <string.h>

#include "contact/contact.h"
#include "contact/dynamics/delassus.h"
#include "contact/law.h"

enum { NEITHER = 0, LOWER = 1, UPPER = 2, BOTH = 3 };

static double lower_of(const perp_contact_laws *laws, int32_t i)
{
    return laws->lower ? laws->lower[i] : 0.0;
}

static double upper_of(const perp_contact_laws *laws, int32_t i)
{
    return laws->upper ? laws->upper[i] : INFINITY;
}

static int32_t kind_of(const perp__contact_bounded *own, int32_t i)
{
    return (own->low[i] > -INFINITY ? LOWER : 0) | (own->high[i] < INFINITY ? UPPER : 0);
}

void perp__contact_bounded_count(perp__contact_bounded *own, const perp_contact_laws *laws,
                                 int32_t rows)
{
    own->count = laws->bounded;
    own->contacts = own->own_contacts = laws->contacts;
    own->rows = rows + laws->bounded;
    own->own_rows = rows;
    own->free = own->boxes = 0;
    for (int32_t i = 0; i < laws->bounded; i++) {
        const int32_t bounds = (lower_of(laws, i) > -INFINITY) + (upper_of(laws, i) < INFINITY);

        own->free += bounds == 0;
        own->boxes += bounds == 2;
        own->own_contacts += bounds > 0;
        own->own_rows += bounds;
    }
}

static int32_t own_size(const perp__contact_bounded *own)
{
    return own->own_rows + own->free + own->size - own->rows;
}

/* Entries of A, were none of them 0. */
static int64_t entries_of(const perp__matrix *A)
{
    return A->column_starts ? A->column_starts[A->columns] : (int64_t)A->rows * A->columns;
}

static void lay_out(perp__arena *arena, void *object)
{
    perp__contact_bounded *own = object;
    const size_t size = (size_t)own->size, own_contacts = (size_t)own->own_contacts;
    const size_t larger = (size_t)(own_size(own) > own->n ? own_size(own) : own->n);

    PERP__DOUBLES(arena, (size_t)own->count, &own->low, &own->high, &own->reach, &own->likely,
                  &own->near_low, &own->near_high);
    own->contact_of = perp__arena_take(arena, (size_t)own->count, sizeof(int32_t));
    own->row = perp__arena_take(arena, size, sizeof(int32_t));
    PERP__DOUBLES(arena, size, &own->sign, &own->shift, &own->work);
    PERP__INTEGERS(arena, own_contacts, &own->dims, &own->two_sided);
    PERP__DOUBLES(arena, own_contacts, &own->bound, &own->mu, &own->rolling, &own->spinning);
    PERP__DOUBLES(arena, larger, &own->compliance, &own->f, &own->w, &own->r0);
    PERP__DOUBLES(arena, (size_t)own_size(own), &own->load, &own->away);
    for (int32_t k = 0; k < 2; k++) {
        perp__contact_lines *lines = &own->lines[k];

        lines->starts =
            perp__arena_take(arena, (size_t)(own->by_W ? own_size(own) : own->n) + 1, 4);
        lines->indices = perp__arena_take(arena, (size_t)lines->room, sizeof(int32_t));
        lines->values = perp__arena_take(arena, (size_t)lines->room, sizeof(double));
    }
}

/* Shift and half width of row i among the bounded, by the bounds that count. */
static void set_bounds(perp__contact_bounded *own, int32_t i, double low, double high)
{
    const int32_t kind = kind_of(own, i);
    const double half = 0.5 * high - 0.5 * low;

    own->near_low[i] = low;
    own->near_high[i] = high;
    own->shift[own->rows - own->count + i] = kind == LOWER   ? low
                                             : kind == UPPER ? high
                                                             : 0.5 * low + 0.5 * high;
    own->bound[own->contact_of[i]] = kind != BOTH ? 0.0 : half > 0.0 ? half : 1.0;
}

/* Where each given row is among the own ones, and the contacts that rows with bounds become. */
static void place_rows(perp__contact_bounded *own, const perp_contact_laws *laws)
{
    const int32_t first = own->rows - own->count;
    int32_t contact = own->contacts, row = first, free = own->own_rows;

    for (int32_t i = 0; i < own->size; i++) {
        own->row[i] = i < first ? i : own->own_rows + own->free + i - own->rows;
        own->sign[i] = 1.0;
        own->shift[i] = 0.0;
    }
    for (int32_t i = 0; i < own->count; i++) {
        const int32_t given = first + i;
        int32_t kind;

        own->low[i] = lower_of(laws, i);
        own->high[i] = upper_of(laws, i);
        kind = kind_of(own, i);
        if (kind == NEITHER) {
            own->contact_of[i] = -1;
            own->row[given] = free++;
            continue;
        }
        own->contact_of[i] = contact;
        own->row[given] = row + (kind == BOTH);
        own->sign[given] = kind == UPPER ? -1.0 : 1.0;
        own->dims[contact] = kind == BOTH ? 2 : 1;
        own->two_sided[contact] = 0;
        own->mu[contact] = kind == BOTH && own->low[i] < own->high[i] ? 1.0 : 0.0;
        own->rolling[contact] = own->spinning[contact] = 0.0;
        set_bounds(own, i, own->low[i], own->high[i]);
        row += own->dims[contact++];
    }
    own->given = own->free == 0;
    own->shifts = 0;
    for (int32_t i = 0; i < own->size; i++) {
        own->shifts |= own->shift[i] != 0.0;
        own->given &= own->row[i] == i && own->sign[i] > 0.0;
    }
}

static void copy_laws(perp__contact_bounded *own, const perp_contact_laws *laws)
{
    for (int32_t k = 0; k < own->contacts; k++) {
        own->dims[k] = perp__contact_dim(laws, k);
        own->two_sided[k] = laws->two_sided ? laws->two_sided[k] : 0;
        own->bound[k] = 0.0;
        own->mu[k] = laws->mu ? laws->mu[k] : 0.0;
        own->rolling[k] = laws->rolling ? laws->rolling[k] : 0.0;
        own->spinning[k] = laws->spinning ? laws->spinning[k] : 0.0;
    }
    memset(own->compliance, 0, (size_t)own_size(own) * sizeof(double));
    for (int32_t i = 0; laws->compliance && i < own->size; i++)
        own->compliance[own->row[i]] = laws->compliance[i];
    own->laws = *laws;
    own->laws.contacts = own->own_contacts;
    own->laws.dims = own->dims;
    own->laws.two_sided = own->two_sided;
    own->laws.mu = own->mu;
    own->laws.rolling = own->rolling;
    own->laws.spinning = own->spinning;
    own->laws.compliance = own->compliance;
    own->laws.bilateral = own->free + own->size - own->rows;
    own->laws.bounded = 0;
}

/* Columns that are being written: own rows from `begin` up to `end`, the first of them number
 * `base`; `at`: the end of the entries. */
typedef struct writer {
    const perp__contact_lines *lines;
    int32_t begin, end, base, at;
} writer;

/* Appends what becomes of `sign` times column j of A, whose first row is the given row `first`. */
static void append(const perp__contact_bounded *own, writer *to, const perp__matrix *A, int32_t j,
                   int32_t first, double sign)
{
    const perp__line sparse = perp__line_of(A, A->column_starts ? j : 0);
    const int32_t count = A->column_starts ? sparse.count : A->rows;

    for (int32_t k = 0; k < count; k++) {
        const int32_t i = A->column_starts ? sparse.indices[k] : k;
        const double value =
            A->column_starts ? sparse.values[k]
                             : A->values[(size_t)i * A->row_stride + (size_t)j * A->column_stride];
        const int32_t row = value == 0.0 ? -1 : own->row[first + i];

        if (row < to->begin || row >= to->end)
            continue;
        to->lines->indices[to->at] = row - to->begin + to->base;
        to->lines->values[to->at++] = sign * own->sign[first + i] * value;
    }
}

static void view(const perp__contact_lines *lines, int32_t rows, int32_t columns, perp__matrix *A)
{
    *A = (perp__matrix){rows, columns, 1, 1, lines->values, lines->starts, lines->indices};
}

static void copy_rows(perp__contact_bounded *own, perp__dynamics *dynamics)
{
    const int32_t size = own_size(own);
    writer H = {&own->lines[0], 0, own->own_rows, 0, 0};
    writer G = {&own->lines[1], own->own_rows, size, 0, 0};

    for (int32_t j = 0; j < own->n; j++) {
        H.lines->starts[j] = H.at;
        G.lines->starts[j] = G.at;
        append(own, &H, &own->H, j, 0, 1.0);
        if (own->free > 0)
            append(own, &G, &own->H, j, 0, 1.0);
        if (own->G.rows > 0)
            append(own, &G, &own->G, j, own->rows, 1.0);
    }
    H.lines->starts[own->n] = H.at;
    G.lines->starts[own->n] = G.at;
    view(H.lines, own->own_rows, own->n, &dynamics->H);
    if (size > own->own_rows)
        view(G.lines, size - own->own_rows, own->n, &dynamics->G);
    dynamics->size = size;
}

/* Columns in the own order. */
static void copy_delassus(perp__contact_bounded *own, perp__matrix *W)
{
    const int32_t size = own_size(own);
    perp__contact_lines *lines = &own->lines[0];
    writer to = {lines, 0, 0, 0, 0};
    int32_t *column = lines[1].indices; /* given column of an own one; -1: none */

    for (int32_t j = 0; j < size; j++)
        column[j] = -1;
    for (int32_t i = 0; i < own->size; i++)
        column[own->row[i]] = i;
    for (int32_t j = 0; j < size; j++) {
        lines->starts[j] = to.at;
        if (column[j] < 0) { /* moves nothing: what it yields by is added later */
            lines->indices[to.at] = j;
            lines->values[to.at++] = 0.0;
            continue;
        }
        to.begin = to.base = 0;
        to.end = own->own_rows;
        append(own, &to, &own->H, column[j], 0, own->sign[column[j]]);
        to.begin = to.base = own->own_rows;
        to.end = size;
        append(own, &to, &own->H, column[j], 0, own->sign[column[j]]);
    }
    lines->starts[size] = to.at;
    view(lines, size, size, W);
}

/* c of the normals that move nothing, near what their rows respond by: work. */
static void yield(perp__contact_bounded *own)
{
    for (int32_t i = 0; i < own->count; i++) {
        const int32_t given = own->rows - own->count + i;

        if (kind_of(own, i) == BOTH)
            own->compliance[own->row[given] - 1] = perp__contact_power_near(own->work[given]);
    }
}

void perp__contact_bounded_yield(perp__contact_bounded *own, const double *W, double *compliance)
{
    const size_t size = (size_t)own_size(own);

    for (int32_t i = 0; i < own->size; i++)
        own->work[i] = W[(size_t)own->row[i] * (size + 1)];
    yield(own);
    memcpy(compliance, own->compliance, size * sizeof *compliance);
}

perp_status perp__contact_bounded_read(perp__contact_bounded *own, perp_context *context,
                                       const perp_contact_laws *laws, perp__dynamics *dynamics,
                                       perp__matrix *W)
{
    perp_status status;

    memset(&own->G, 0, sizeof own->G);
    own->by_W = dynamics == NULL;
    own->H = dynamics ? dynamics->H : *W;
    if (dynamics)
        own->G = dynamics->G;
    own->size = own->rows + laws->bilateral;
    own->n = own->H.columns;
    own->lines[0].room = entries_of(&own->H) + own->boxes;
    own->lines[1].room = dynamics ? entries_of(&own->G) + own->lines[0].room : own_size(own);
    status = perp__arena_fit(&own->arena, context, lay_out, own);
    if (status != PERP_OK)
        return status;
    place_rows(own, laws);
    copy_laws(own, laws);
    if (own->given) /* they are the methods' rows as they are */
        return PERP_OK;
    if (dynamics)
        copy_rows(own, dynamics);
    else
        copy_delassus(own, W);
    if (dynamics && !dynamics->has_M)
        return PERP_OK; /* W will tell what rows respond by */
    if (!dynamics) {
        perp__delassus_diagonal(&own->H, own->work);
    } else { /* by h M^-1 h', were M its diagonal */
        const perp__contact_lines *H = &own->lines[0];
        double *diagonal = own->f, *moved = own->w;

        perp__delassus_diagonal(&dynamics->M, diagonal);
        memset(moved, 0, (size_t)own->own_rows * sizeof *moved);
        for (int32_t j = 0; j < own->n; j++)
            for (int32_t k = H->starts[j]; k < H->starts[j + 1]; k++)
                moved[H->indices[k]] += H->values[k] * (H->values[k] / diagonal[j]);
        for (int32_t i = own->rows - own->count; i < own->rows; i++)
            own->work[i] = own->row[i] < own->own_rows ? moved[own->row[i]] : 0.0;
    }
    yield(own);
    return PERP_OK;
}

/* ---- a call -------------------------------------------------------------------------------- */

/* The number within the bounds that is nearest to 0. */
static double nearest(const perp__contact_bounded *own, int32_t i)
{
    return fmin(fmax(0.0, own->low[i]), own->high[i]);
}

int32_t perp__contact_bounded_is_far(const perp__contact_bounded *own)
{
    for (int32_t i = 0; i < own->count; i++) {
        const int32_t kind = kind_of(own, i);
        const double middle = 0.5 * own->low[i] + 0.5 * own->high[i];
        const double shift = kind == LOWER ? own->low[i] : kind == UPPER ? own->high[i] : middle;

        if (kind != NEITHER && shift != nearest(own, i))
            return 1;
    }
    return 0;
}

void perp__contact_bounded_draw_in(perp__contact_bounded *own)
{
    for (int32_t i = 0; i < own->count; i++) {
        const double middle = nearest(own, i), reach = own->reach[i];

        if (kind_of(own, i) != NEITHER) /* where there is no bound, none is made */
            set_bounds(own, i,
                       own->low[i] > -INFINITY ? fmax(own->low[i], middle - reach) : -INFINITY,
                       own->high[i] < INFINITY ? fmin(own->high[i], middle + reach) : INFINITY);
    }
    own->shifts = 0;
    for (int32_t i = 0; i < own->size; i++)
        own->shifts |= own->shift[i] != 0.0;
    for (int32_t i = 0; i < own_size(own); i++)
        own->away[i] = 0.0;
    for (int32_t i = 0; i < own->count; i++) {
        const int32_t given = own->rows - own->count + i;

        if (kind_of(own, i) != NEITHER)
            own->away[own->row[given]] = own->sign[given] * (own->shift[given] - nearest(own, i));
    }
}

int32_t perp__contact_bounded_widen(perp__contact_bounded *own, const double *x, const double *u,
                                    int32_t is_ray)
{
    int32_t widened = 0;

    for (int32_t i = 0; i < own->count; i++) {
        const int32_t row = own->row[own->rows - own->count + i], kind = kind_of(own, i);
        const int32_t low = own->near_low[i] > own->low[i], high = own->near_high[i] < own->high[i];
        const double next = fmax(PERP__REACH * own->reach[i], own->likely[i]);
        int32_t is_reached;

        if (kind == NEITHER || (!low && !high))
            continue;
        if (kind == BOTH)
            is_reached = (low && x[row] <= -own->bound[own->contact_of[i]]) ||
                         (high && x[row] >= own->bound[own->contact_of[i]]);
        else /* what nothing drives stays there */
            is_reached = x[row] <= 0.0 && (own->reach[i] > 0.0 || u[row] > 0.0);
        if (!is_reached && !is_ray)
            continue;
        own->reach[i] = is_ray || next == 0.0 ? INFINITY : next;
        widened = 1;
    }
    return widened;
}

void perp__contact_bounded_pose(perp__contact_bounded *own, const perp__contact_call *given,
                                perp__contact_call *call)
{
    const int32_t first = own->rows - own->count;
    const double *load = own->by_W ? given->q : given->f, *yields = own->compliance;
    double *moved = own->by_W ? own->work : own->f;

    /* 1. f + H'shift, or q + W shift. */
    memcpy(moved, load, (size_t)own->n * sizeof *moved);
    if (own->shifts && own->by_W)
        perp__multiply(&own->H, own->shift, moved);
    for (int32_t j = 0; j < own->n && own->shifts; j++)
        moved[j] += own->by_W ? load[j] : perp__column_times(&own->H, j, own->shift);

    /* 2. w and b of the own rows, and of normals that move nothing. */
    for (int32_t i = 0; i < own->size; i++) {
        const int32_t row = own->row[i];
        const double w = own->by_W       ? own->work[i]
                         : i < own->rows ? given->w[i]
                         : given->b      ? given->b[i - own->rows]
                                         : 0.0;

        own->w[row] = own->sign[i] * (w + yields[row] * own->shift[i]);
    }
    for (int32_t i = 0; i < own->count; i++) {
        const int32_t row = own->row[first + i];

        if (kind_of(own, i) == BOTH)
            own->w[row - 1] = -(yields[row - 1] * own->bound[own->contact_of[i]]);
    }

    /* 3. The start, within the bounds; what lies beyond is clipped by the law. */
    for (int32_t k = 0; k < own_size(own) && given->r0; k++)
        own->r0[k] = 0.0;
    for (int32_t i = 0; i < own->size && given->r0; i++)
        own->r0[own->row[i]] = own->sign[i] * (given->r0[i] - own->shift[i]);
    for (int32_t i = 0; i < own->count && given->r0; i++)
        if (kind_of(own, i) == BOTH)
            own->r0[own->row[first + i] - 1] = own->bound[own->contact_of[i]];
    *call = *given;
    call->f = own->f;
    call->w = own->w;
    call->b = own->w + own->own_rows;
    call->q = own->w;
    call->r0 = given->r0 ? own->r0 : NULL;
}

void perp__contact_bounded_impulses(const perp__contact_bounded *own, const double *x, double *r)
{
    const int32_t first = own->rows - own->count;

    for (int32_t i = 0; i < own->size; i++) {
        const double value = x[own->row[i]];
        const int32_t k = i - first;

        r[i] = value == 0.0 ? own->shift[i] : own->shift[i] + own->sign[i] * value;
        if (k < 0 || k >= own->count || kind_of(own, k) != BOTH)
            continue;
        if (fabs(value) >= own->mu[own->contact_of[k]] * own->bound[own->contact_of[k]])
            r[i] = value > 0.0 ? own->near_high[k] : own->near_low[k];
    }
}

void perp__contact_bounded_velocities(const perp__contact_bounded *own, const double *x, double *u)
{
    for (int32_t i = 0; i < own->size; i++)
        u[i] = own->sign[i] < 0.0 ? 0.0 - x[own->row[i]] : x[own->row[i]];
}

void perp__contact_bounded_modes(const perp__contact_bounded *own, const int8_t *modes,
                                 const double *x, const double *u, int32_t *given)
{
    for (int32_t k = 0; k < own->contacts; k++)
        given[k] = modes[k];
    for (int32_t i = 0; i < own->count; i++) {
        const int32_t row = own->row[own->rows - own->count + i], contact = own->contact_of[i];
        const int32_t kind = kind_of(own, i), mode = contact < 0 ? 0 : modes[contact];
        int32_t *to = &given[own->contacts + i], inside;

        *to = PERP_CONTACT_STICK;
        if (kind == BOTH) {
            inside = fabs(x[row]) < own->mu[contact] * own->bound[contact];
            if (mode != PERP_CONTACT_STICK && !(inside && u[row] == 0.0))
                *to = (inside ? 0.0 - u[row] : x[row]) > 0.0 ? PERP_CONTACT_UPPER
                                                             : PERP_CONTACT_LOWER;
        } else if (kind != NEITHER && mode == PERP_CONTACT_SEPARATE &&
                   !(own->near_low[i] > own->low[i] || own->near_high[i] < own->high[i])) {
            *to = kind == UPPER ? PERP_CONTACT_UPPER : PERP_CONTACT_LOWER;
        }
    }
}
