#include "contact/bounded.h"

#include <math.h>
#include <string.h>

#include "contact/law.h"
#include "contact/solver.h"

enum { NEITHER = 0, LOWER = 1, UPPER = 2, BOTH = 3 };

static double lower_of(const perp_contact_laws *laws, int32_t i)
{
    return laws->lower ? laws->lower[i] : 0.0;
}

static double upper_of(const perp_contact_laws *laws, int32_t i)
{
    return laws->upper ? laws->upper[i] : INFINITY;
}

static int32_t kind_of(const perp__contact_bounded *set, int32_t i)
{
    return (set->low[i] > -INFINITY ? LOWER : 0) | (set->high[i] < INFINITY ? UPPER : 0);
}

void perp__contact_bounded_count(perp__contact_bounded *set, const perp_contact_laws *laws,
                                 int32_t rows)
{
    set->count = laws->bounded;
    set->contacts = set->own_contacts = laws->contacts;
    set->rows = rows + laws->bounded;
    set->own_rows = rows;
    set->free = set->boxes = 0;
    for (int32_t i = 0; i < laws->bounded; i++) {
        const int32_t bounds = (lower_of(laws, i) > -INFINITY) + (upper_of(laws, i) < INFINITY);

        set->free += bounds == 0;
        set->boxes += bounds == 2;
        set->own_contacts += bounds > 0;
        set->own_rows += bounds;
    }
}

/* How far x of a row with two bounds goes. */
static double reach_of(const perp__contact_bounded *set, int32_t i)
{
    return set->low[i] < set->high[i] ? set->bound[set->contact_of[i]] : 0.0;
}

static int32_t own_size(const perp__contact_bounded *set)
{
    return set->own_rows + set->free + set->size - set->rows;
}

/* Entries of A, were none of them 0. */
static int64_t entries_of(const perp__matrix *A)
{
    return A->column_starts ? A->column_starts[A->columns] : (int64_t)A->rows * A->columns;
}

static void lay_out(perp__arena *arena, void *object)
{
    perp__contact_bounded *set = object;
    const size_t size = (size_t)set->size;
    const size_t larger = (size_t)(own_size(set) > set->n ? own_size(set) : set->n);

    PERP__DOUBLES(arena, (size_t)set->count, &set->low, &set->high, &set->reach, &set->likely,
                  &set->near_low, &set->near_high);
    set->contact_of = perp__arena_take(arena, (size_t)set->count, sizeof(int32_t));
    set->row = perp__arena_take(arena, size, sizeof(int32_t));
    PERP__DOUBLES(arena, size, &set->sign, &set->shift, &set->work);
    PERP__DOUBLES(arena, larger, &set->f, &set->w, &set->r0);
    PERP__DOUBLES(arena, (size_t)own_size(set), &set->load, &set->away);
    for (int32_t k = 0; k < 2; k++) {
        perp__contact_lines *lines = &set->lines[k];

        lines->starts =
            perp__arena_take(arena, (size_t)(set->by_W ? own_size(set) : set->n) + 1, 4);
        lines->indices = perp__arena_take(arena, (size_t)lines->room, sizeof(int32_t));
        lines->values = perp__arena_take(arena, (size_t)lines->room, sizeof(double));
    }
}

/* Shift and half width of row i among the bounded, by the bounds that count. */
static void set_bounds(perp__contact_bounded *set, int32_t i, double low, double high)
{
    const int32_t kind = kind_of(set, i);
    const double half = 0.5 * high - 0.5 * low;

    set->near_low[i] = low;
    set->near_high[i] = high;
    set->shift[set->rows - set->count + i] = kind == LOWER   ? low
                                             : kind == UPPER ? high
                                                             : 0.5 * low + 0.5 * high;
    set->bound[set->contact_of[i]] = kind != BOTH ? 0.0 : half > 0.0 ? half : 1.0;
}

/* Where each given row is among the own ones, and the contacts that rows with bounds become, behind
 * the given ones. */
static void place_rows(perp__contact_bounded *set, perp_contact_solver *solver,
                       const perp_contact_laws *laws)
{
    const int32_t first = set->rows - set->count;
    int32_t contact = set->contacts, row = first, free = set->own_rows;

    set->bound = solver->bound;
    set->compliance = solver->compliance;
    for (int32_t i = 0; i < set->size; i++) {
        set->row[i] = i < first ? i : set->own_rows + set->free + i - set->rows;
        set->sign[i] = 1.0;
        set->shift[i] = 0.0;
    }
    for (int32_t i = 0; i < set->count; i++) {
        const int32_t given = first + i;
        int32_t kind;

        set->low[i] = lower_of(laws, i);
        set->high[i] = upper_of(laws, i);
        kind = kind_of(set, i);
        if (kind == NEITHER) {
            set->contact_of[i] = -1;
            set->row[given] = free++;
            continue;
        }
        set->contact_of[i] = contact;
        set->row[given] = row + (kind == BOTH);
        set->sign[given] = kind == UPPER ? -1.0 : 1.0;
        solver->dims[contact] = kind == BOTH ? 2 : 1;
        solver->two_sided[contact] = 0;
        solver->mu[contact] = kind == BOTH && set->low[i] < set->high[i] ? 1.0 : 0.0;
        solver->rolling[contact] = solver->spinning[contact] = 0.0;
        set_bounds(set, i, set->low[i], set->high[i]);
        row += solver->dims[contact++];
        solver->starts[contact] = row;
    }
    set->given = set->free == 0;
    set->shifts = 0;
    for (int32_t i = 0; i < set->size; i++) {
        set->shifts |= set->shift[i] != 0.0;
        set->given &= set->row[i] == i && set->sign[i] > 0.0;
    }
    for (int32_t i = 0; laws->compliance && i < set->size; i++)
        set->compliance[set->row[i]] = laws->compliance[i];
}

/* Columns that are being written: own rows from `begin` up to `end`, the first of them number
 * `base`; `at`: the end of the entries. */
typedef struct writer {
    const perp__contact_lines *lines;
    int32_t begin, end, base, at;
} writer;

/* Appends what becomes of `sign` times column j of A, whose first row is the given row `first`. */
static void append(const perp__contact_bounded *set, writer *to, const perp__matrix *A, int32_t j,
                   int32_t first, double sign)
{
    const perp__line sparse = perp__line_of(A, A->column_starts ? j : 0);
    const int32_t count = A->column_starts ? sparse.count : A->rows;

    for (int32_t k = 0; k < count; k++) {
        const int32_t i = A->column_starts ? sparse.indices[k] : k;
        const double value =
            A->column_starts ? sparse.values[k]
                             : A->values[(size_t)i * A->row_stride + (size_t)j * A->column_stride];
        const int32_t row = value == 0.0 ? -1 : set->row[first + i];

        if (row < to->begin || row >= to->end)
            continue;
        to->lines->indices[to->at] = row - to->begin + to->base;
        to->lines->values[to->at++] = sign * set->sign[first + i] * value;
    }
}

static void view(const perp__contact_lines *lines, int32_t rows, int32_t columns, perp__matrix *A)
{
    *A = (perp__matrix){rows, columns, 1, 1, lines->values, lines->starts, lines->indices};
}

static void copy_rows(perp__contact_bounded *set, perp__dynamics *dynamics)
{
    const int32_t size = own_size(set);
    writer H = {&set->lines[0], 0, set->own_rows, 0, 0};
    writer G = {&set->lines[1], set->own_rows, size, 0, 0};

    for (int32_t j = 0; j < set->n; j++) {
        H.lines->starts[j] = H.at;
        G.lines->starts[j] = G.at;
        append(set, &H, &set->H, j, 0, 1.0);
        if (set->free > 0)
            append(set, &G, &set->H, j, 0, 1.0);
        if (set->G.rows > 0)
            append(set, &G, &set->G, j, set->rows, 1.0);
    }
    H.lines->starts[set->n] = H.at;
    G.lines->starts[set->n] = G.at;
    view(H.lines, set->own_rows, set->n, &dynamics->H);
    if (size > set->own_rows)
        view(G.lines, size - set->own_rows, set->n, &dynamics->G);
    dynamics->size = size;
}

/* Columns in the own order. */
static void copy_delassus(perp__contact_bounded *set, perp__matrix *W)
{
    const int32_t size = own_size(set);
    perp__contact_lines *lines = &set->lines[0];
    writer to = {lines, 0, 0, 0, 0};
    int32_t *column = lines[1].indices; /* given column of an own one; -1: none */

    for (int32_t j = 0; j < size; j++)
        column[j] = -1;
    for (int32_t i = 0; i < set->size; i++)
        column[set->row[i]] = i;
    for (int32_t j = 0; j < size; j++) {
        lines->starts[j] = to.at;
        if (column[j] < 0) { /* moves nothing: what it yields by is added later */
            lines->indices[to.at] = j;
            lines->values[to.at++] = 0.0;
            continue;
        }
        to.begin = to.base = 0;
        to.end = set->own_rows;
        append(set, &to, &set->H, column[j], 0, set->sign[column[j]]);
        to.begin = to.base = set->own_rows;
        to.end = size;
        append(set, &to, &set->H, column[j], 0, set->sign[column[j]]);
    }
    lines->starts[size] = to.at;
    view(lines, size, size, W);
}

/* c of the normals that move nothing, near what their rows respond by: work. */
static void yield(perp__contact_bounded *set)
{
    for (int32_t i = 0; i < set->count; i++) {
        const int32_t given = set->rows - set->count + i;

        if (kind_of(set, i) == BOTH)
            set->compliance[set->row[given] - 1] = perp__contact_power_near(set->work[given]);
    }
}

void perp__contact_bounded_yield(perp__contact_bounded *set, const double *W)
{
    for (int32_t i = 0; i < set->size; i++)
        set->work[i] = W[(size_t)set->row[i] * ((size_t)own_size(set) + 1)];
    yield(set);
}

perp_status perp__contact_bounded_read(perp_contact_solver *solver, const perp_contact_laws *laws)
{
    perp__contact_bounded *set = &solver->bounded;
    perp__matrix *W = &solver->W;
    perp__dynamics *dynamics =
        solver->entrance == PERP__ENTRANCE_DYNAMICS ? &solver->dynamics : NULL;
    perp_status status;

    memset(&set->G, 0, sizeof set->G);
    set->by_W = dynamics == NULL;
    set->H = dynamics ? dynamics->H : *W;
    if (dynamics)
        set->G = dynamics->G;
    set->size = set->rows + laws->bilateral;
    set->n = set->H.columns;
    set->lines[0].room = entries_of(&set->H) + set->boxes;
    set->lines[1].room = dynamics ? entries_of(&set->G) + set->lines[0].room : own_size(set);
    status = perp__arena_fit(&set->arena, solver->context, lay_out, set);
    if (status != PERP_OK)
        return status;
    place_rows(set, solver, laws);
    if (set->given) /* they are the methods' rows as they are */
        return PERP_OK;
    if (dynamics)
        copy_rows(set, dynamics);
    else
        copy_delassus(set, W);
    if (dynamics && !dynamics->has_M)
        return PERP_OK; /* W will tell what rows respond by */
    if (!dynamics) {
        perp__delassus_diagonal(&set->H, set->work);
    } else { /* by h M^-1 h', were M its diagonal */
        const perp__contact_lines *H = &set->lines[0];
        double *diagonal = set->f, *moved = set->w;

        perp__delassus_diagonal(&dynamics->M, diagonal);
        memset(moved, 0, (size_t)set->own_rows * sizeof *moved);
        for (int32_t j = 0; j < set->n; j++)
            for (int32_t k = H->starts[j]; k < H->starts[j + 1]; k++)
                moved[H->indices[k]] += H->values[k] * (H->values[k] / diagonal[j]);
        for (int32_t i = set->rows - set->count; i < set->rows; i++)
            set->work[i] = set->row[i] < set->own_rows ? moved[set->row[i]] : 0.0;
    }
    yield(set);
    return PERP_OK;
}

/* ---- a call -------------------------------------------------------------------------------- */

/* The number within the bounds that is nearest to 0. */
static double nearest(const perp__contact_bounded *set, int32_t i)
{
    return fmin(fmax(0.0, set->low[i]), set->high[i]);
}

bool perp__contact_bounded_is_far(const perp__contact_bounded *set)
{
    for (int32_t i = 0; i < set->count; i++) {
        const int32_t kind = kind_of(set, i);
        const double middle = 0.5 * set->low[i] + 0.5 * set->high[i];
        const double shift = kind == LOWER ? set->low[i] : kind == UPPER ? set->high[i] : middle;

        if (kind != NEITHER && shift != nearest(set, i))
            return 1;
    }
    return 0;
}

void perp__contact_bounded_draw_in(perp__contact_bounded *set)
{
    for (int32_t i = 0; i < set->count; i++) {
        const double middle = nearest(set, i), reach = set->reach[i];

        if (kind_of(set, i) != NEITHER) /* where there is no bound, none is made */
            set_bounds(set, i,
                       set->low[i] > -INFINITY ? fmax(set->low[i], middle - reach) : -INFINITY,
                       set->high[i] < INFINITY ? fmin(set->high[i], middle + reach) : INFINITY);
    }
    set->shifts = 0;
    for (int32_t i = 0; i < set->size; i++)
        set->shifts |= set->shift[i] != 0.0;
    for (int32_t i = 0; i < own_size(set); i++)
        set->away[i] = 0.0;
    for (int32_t i = 0; i < set->count; i++) {
        const int32_t given = set->rows - set->count + i;

        if (kind_of(set, i) != NEITHER)
            set->away[set->row[given]] = set->sign[given] * (set->shift[given] - nearest(set, i));
    }
}

bool perp__contact_bounded_widen(perp__contact_bounded *set, const double *x, const double *u,
                                 bool is_ray)
{
    bool widened = 0;

    for (int32_t i = 0; i < set->count; i++) {
        const int32_t row = set->row[set->rows - set->count + i], kind = kind_of(set, i);
        const bool low = set->near_low[i] > set->low[i], high = set->near_high[i] < set->high[i];
        const double next = fmax(PERP__REACH * set->reach[i], set->likely[i]);
        bool is_reached;

        if (kind == NEITHER || (!low && !high))
            continue;
        if (kind == BOTH)
            is_reached = (low && x[row] <= -set->bound[set->contact_of[i]]) ||
                         (high && x[row] >= set->bound[set->contact_of[i]]);
        else /* what nothing drives stays there */
            is_reached = x[row] <= 0.0 && (set->reach[i] > 0.0 || u[row] > 0.0);
        if (!is_reached && !is_ray)
            continue;
        set->reach[i] = is_ray || next == 0.0 ? INFINITY : next;
        widened = 1;
    }
    return widened;
}

void perp__contact_bounded_pose(perp__contact_bounded *set, const perp__contact_call *given,
                                perp__contact_call *call)
{
    const int32_t first = set->rows - set->count;
    const double *load = set->by_W ? given->q : given->f, *yields = set->compliance;
    double *moved = set->by_W ? set->work : set->f;

    /* 1. f + H'shift, or q + W shift. */
    memcpy(moved, load, (size_t)set->n * sizeof *moved);
    if (set->shifts && set->by_W)
        perp__multiply(&set->H, set->shift, moved);
    for (int32_t j = 0; j < set->n && set->shifts; j++)
        moved[j] += set->by_W ? load[j] : perp__column_times(&set->H, j, set->shift);

    /* 2. w and b of the own rows, and of normals that move nothing. */
    for (int32_t i = 0; i < set->size; i++) {
        const int32_t row = set->row[i];
        const double w = set->by_W       ? set->work[i]
                         : i < set->rows ? given->w[i]
                         : given->b      ? given->b[i - set->rows]
                                         : 0.0;

        set->w[row] = set->sign[i] * (w + yields[row] * set->shift[i]);
    }
    for (int32_t i = 0; i < set->count; i++) {
        const int32_t row = set->row[first + i];

        if (kind_of(set, i) == BOTH)
            set->w[row - 1] = -(yields[row - 1] * set->bound[set->contact_of[i]]);
    }

    /* 3. The start, within the bounds; what lies beyond is clipped by the law. */
    for (int32_t k = 0; k < own_size(set) && given->r0; k++)
        set->r0[k] = 0.0;
    for (int32_t i = 0; i < set->size && given->r0; i++)
        set->r0[set->row[i]] = set->sign[i] * (given->r0[i] - set->shift[i]);
    for (int32_t i = 0; i < set->count && given->r0; i++)
        if (kind_of(set, i) == BOTH)
            set->r0[set->row[first + i] - 1] = set->bound[set->contact_of[i]];
    *call = *given;
    call->f = set->f;
    call->w = set->w;
    call->b = set->w + set->own_rows;
    call->q = set->w;
    call->r0 = given->r0 ? set->r0 : NULL;
}

void perp__contact_bounded_impulses(const perp__contact_bounded *set, const double *x, double *r)
{
    const int32_t first = set->rows - set->count;

    for (int32_t i = 0; i < set->size; i++) {
        const double value = x[set->row[i]];
        const int32_t k = i - first;

        r[i] = value == 0.0 ? set->shift[i] : set->shift[i] + set->sign[i] * value;
        if (k < 0 || k >= set->count || kind_of(set, k) != BOTH)
            continue;
        if (fabs(value) >= reach_of(set, k))
            r[i] = value > 0.0 ? set->near_high[k] : set->near_low[k];
    }
}

void perp__contact_bounded_velocities(const perp__contact_bounded *set, const double *x, double *u)
{
    for (int32_t i = 0; i < set->size; i++)
        u[i] = set->sign[i] < 0.0 ? 0.0 - x[set->row[i]] : x[set->row[i]];
}

void perp__contact_bounded_modes(const perp__contact_bounded *set, const int8_t *modes,
                                 const double *x, const double *u, int32_t *given)
{
    for (int32_t k = 0; k < set->contacts; k++)
        given[k] = modes[k];
    for (int32_t i = 0; i < set->count; i++) {
        const int32_t row = set->row[set->rows - set->count + i], contact = set->contact_of[i];
        const int32_t kind = kind_of(set, i), mode = contact < 0 ? 0 : modes[contact];
        int32_t *to = &given[set->contacts + i], inside;

        *to = PERP_CONTACT_STICK;
        if (kind == BOTH) {
            inside = fabs(x[row]) < reach_of(set, i);
            if (mode != PERP_CONTACT_STICK && !(inside && u[row] == 0.0))
                *to = (inside ? 0.0 - u[row] : x[row]) > 0.0 ? PERP_CONTACT_UPPER
                                                             : PERP_CONTACT_LOWER;
        } else if (kind != NEITHER && mode == PERP_CONTACT_SEPARATE &&
                   !(set->near_low[i] > set->low[i] || set->near_high[i] < set->high[i])) {
            *to = kind == UPPER ? PERP_CONTACT_UPPER : PERP_CONTACT_LOWER;
        }
    }
}
