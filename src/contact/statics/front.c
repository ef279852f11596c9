/* perp/statics.h: checks, and rows of H and G as units on a graph of nodes. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/check.h"
#include "base/clock.h"
#include "base/context.h"
#include "base/rounding.h"
#include "contact/contact.h"
#include "contact/bounded.h"
#include "contact/statics/statics.h"
#include "linalg/matrix.h"
#include "linalg/spatial.h"

PERP__WORDS(perp_statics_verdict_text, "unknown verdict", "stands", "falls", "indeterminate")

/* The gap of a margin that is told, beside it. */
#define MEASURED 1e-2

/* Beside the least work of a factorisation, what nodes of more coordinates may cost. */
#define LITTLE_MORE 4.0

/* A row of a unit: the caller's from `first` on, times factors. */
typedef struct combined_row {
    int32_t first, count;
    double factor[3];
} combined_row;

struct perp__statics_front {
    perp_context *context;
    perp_contact_laws laws;
    perp__matrix H, G;
    int32_t n, rows, size; /* rows of H; with those of G */
    const double *f, *load;
    const double *w;  /* rows of H, or NULL: contacts with a normal above 0 are open */
    const double *r0; /* rows of H, or NULL: which way contacts press that hold both ways */
    int32_t lost;     /* 1: doubles do not hold all numbers in these units */

    perp__arena arena, value_arena;
    int32_t entries; /* room */
    size_t numbers;
    int32_t *starts, *columns; /* of H and G, row by row */
    double *entry;
    combined_row *row; /* own.size */
    int32_t *mark;     /* n: the unit that met a block last */
    double *scale;     /* n: powers of two that bring velocities to rows of size 1 */
    perp__statics_unit *unit;
    perp__statics_link *link;
    double *values, *forces, *loads, *r, *v;
    perp__statics_rows copy; /* its rows: those that can carry something */
    perp__statics *statics;  /* NULL until it is first needed */
    double most_products;    /* of a factorisation; 0: no limit */
};

typedef struct perp__statics_front front;

/* ---- checks ---- */

static perp_status read_problem(front *a, const perp_statics_problem *given)
{
    perp_statics_problem copy;
    perp_status status = perp_struct_init(&copy, sizeof copy);

    PERP__THEN(status, perp__check_pointer(a->context, "problem", given));
    PERP__THEN(status, perp__struct_read(a->context, "problem", &copy, sizeof copy, given,
                                         PERP__FIRST(perp_statics_problem)));
    PERP__THEN(status, perp__contact_read_laws(a->context, &a->laws, &a->rows, copy.laws));
    if (status != PERP_OK)
        return status;
    if (copy.n < 0 || copy.reserved != 0)
        return perp__refuse(
            a->context, "problem.%s is %d, expected %s", copy.n < 0 ? "n" : "reserved",
            (int)(copy.n < 0 ? copy.n : copy.reserved), copy.n < 0 ? "0 or more" : "0");
    a->n = copy.n;
    a->rows += a->laws.bounded;
    a->size = a->rows;
    if (a->rows > 0 || copy.H)
        status = perp__matrix_read_sized(a->context, "H", &a->H, copy.H, a->rows, a->n);
    if (status == PERP_OK && copy.G)
        status = perp__matrix_read_sized(a->context, "G", &a->G, copy.G, copy.G->rows, a->n);
    a->size += a->G.rows;
    PERP__THEN(status, perp__check_vector(a->context, "f", copy.f, (size_t)a->n));
    if (status == PERP_OK && copy.load)
        status = perp__check_vector(a->context, "load", copy.load, (size_t)a->n);
    if (status == PERP_OK && copy.r0)
        status = perp__check_vector(a->context, "r0", copy.r0, (size_t)a->rows);
    a->f = copy.f;
    a->load = copy.load;
    a->r0 = copy.r0;
    a->copy.units = a->laws.contacts + a->laws.bounded + a->size - a->rows;
    return status;
}

perp_status perp__statics_read_settings(perp_context *context, perp__statics_aim *aim,
                                        const perp_statics_settings *given)
{
    static const perp__field fields[] = {
        PERP__INTEGER(perp_statics_settings, objective, 0, PERP_STATICS_INTERIOR),
        PERP__INTEGER(perp_statics_settings, max_iterations, 0, INFINITY),
    };
    perp_statics_settings copy;
    perp_status status = perp_struct_init(&copy, sizeof copy);

    PERP__THEN(status, perp__struct_read(context, "settings", &copy, sizeof copy, given,
                                         PERP__FIRST(perp_statics_settings)));
    PERP__THEN(status, PERP__CHECK_FIELDS(context, "settings", &copy, fields));
    aim->objective = copy.objective;
    aim->max_iterations = copy.max_iterations > 0 ? copy.max_iterations : PERP__STATICS_ITERATIONS;
    aim->gap = MEASURED;
    return status;
}

/* ---- rows in blocks ---- */

static void lay_out_rows(perp__arena *arena, void *object)
{
    front *a = object;

    a->starts = perp__arena_take(arena, (size_t)a->size + 2, sizeof *a->starts);
    a->columns = perp__arena_take(arena, (size_t)a->entries, sizeof *a->columns);
    a->entry = perp__arena_take(arena, (size_t)a->entries, sizeof *a->entry);
    a->row = perp__arena_take(arena, (size_t)a->size, sizeof *a->row);
    a->mark = perp__arena_take(arena, (size_t)a->n, sizeof *a->mark);
    a->scale = perp__arena_take(arena, (size_t)a->n, sizeof *a->scale);
    a->unit =
        perp__arena_take(arena, (size_t)(a->copy.units + 2 * a->laws.contacts), sizeof *a->unit);
}

/* At most: some may be 0. */
static int32_t count_entries(const perp__matrix *M)
{
    return M->column_starts ? M->column_starts[M->columns] : M->rows * M->columns;
}

/* The entries of H and G row by row, and what brings their columns to size 1; noise stays so. */
static void list_rows(front *a)
{
    double most = 0.0;

    memset(a->starts, 0, ((size_t)a->size + 2) * sizeof *a->starts);
    for (int32_t pass = 0; pass < 4; pass++) { /* H and G are counted, then filled in */
        const perp__matrix *M = pass % 2 == 0 ? &a->H : &a->G;
        int32_t *place = a->starts + (pass % 2 == 0 ? 0 : a->rows) + (pass < 2 ? 2 : 1);
        perp__cursor at = perp__first(M);

        for (int32_t i = 0; i <= a->size && pass == 2; i++)
            a->starts[i + 1] += a->starts[i];
        while (M->rows > 0 && perp__advance(&at)) {
            if (pass >= 2) {
                a->columns[place[at.i]] = at.j;
                a->entry[place[at.i]] = at.value;
            }
            place[at.i]++;
        }
    }
    for (int32_t j = 0; j < a->n; j++)
        a->scale[j] = 0.0;
    for (int32_t e = 0; e < a->starts[a->size]; e++) {
        a->scale[a->columns[e]] = fmax(a->scale[a->columns[e]], fabs(a->entry[e]));
        most = fmax(most, fabs(a->entry[e]));
    }
    for (int32_t j = 0; j < a->n; j++)
        a->scale[j] = ldexp(1.0, -ilogb(a->scale[j] > PERP__BALANCED * most ? a->scale[j]
                                        : most > 0.0                        ? most
                                                                            : 1.0));
}

/* `count` of the caller's rows for the unit that is being listed. */
static void take_rows(front *a, int32_t row, int32_t count)
{
    for (int32_t i = 0; i < count; i++)
        a->row[a->copy.size++] = (combined_row){row + i, 1, {1.0, 0.0, 0.0}};
}

/* One of the normals from `row` on, turned: along r0, or an axis across it, of Householder's
 * reflection. */
static void take_turned(front *a, int32_t row, int32_t normals, int32_t axis)
{
    combined_row *copy = &a->row[a->copy.size++];
    double d[3] = {0.0};

    memcpy(d, a->r0 + row, (size_t)normals * sizeof *d);
    perp__normalise3(d);
    *copy = (combined_row){row, normals, {d[0], d[1], d[2]}};
    for (int32_t i = 0; i < 3 && axis > 0; i++)
        copy->factor[i] = (i == axis) - d[axis] / (1.0 + fabs(d[0])) *
                                            (d[i] + (i == 0 ? copysign(1.0, d[0]) : 0.0));
}

/* A contact, whose rows begin at *row. One that holds both ways is free where it has no friction;
 * else it presses along r0, and what it carries across that is free. */
static perp_status list_contact(front *a, int32_t u, int32_t *row)
{
    const perp_contact_laws *laws = &a->laws;
    const int32_t both = laws->two_sided ? laws->two_sided[u] : 0, normals = both > 0 ? both : 1;
    const int32_t tangents = perp__contact_dim(laws, u) - normals, first = *row;
    perp__statics_unit *unit = &a->unit[u];
    const bool turned = both > 0 && laws->mu && laws->mu[u] > 0.0;

    unit->mu = laws->mu ? laws->mu[u] : 0.0;
    unit->rolling = laws->rolling ? laws->rolling[u] : 0.0;
    unit->spinning = laws->spinning ? laws->spinning[u] : 0.0;
    unit->tangents = unit->mu > 0.0 ? tangents : 0;
    unit->rolls = unit->rolling > 0.0 ? tangents : 0;
    unit->spins = unit->spinning > 0.0;
    *row += normals + tangents + unit->rolls + unit->spins;
    if (turned && (!a->r0 || perp__is_zero(a->r0 + first, both)))
        return perp__refuse(a->context,
                            "laws.two_sided[%d] is %d, and r0 does not tell which way it presses",
                            (int)u, (int)both);
    if (a->w && a->w[first] > 0.0) { /* open */
        unit->tangents = unit->rolls = unit->spins = 0;
        return PERP_OK;
    }
    unit->kind = both > 0 && !turned ? PERP__STATICS_FREE : PERP__STATICS_CONE;
    unit->mu *= both > 1 ? 1.0 - PERP__ROUNDING_LIMIT : 1.0;
    if (turned)
        take_turned(a, first, both, 0);
    else
        take_rows(a, first, normals);
    take_rows(a, first + normals, unit->tangents);
    take_rows(a, first + normals + tangents, unit->rolls + unit->spins);
    unit->rows = a->copy.size - unit->row;
    for (int32_t axis = 1; axis < both && turned; axis++) {
        a->unit[a->copy.units++] =
            (perp__statics_unit){.kind = PERP__STATICS_FREE, .row = a->copy.size, .rows = 1};
        take_turned(a, first, both, axis);
    }
    return PERP_OK;
}

/* The units of the laws. */
static perp_status list_units(front *a)
{
    const perp_contact_laws *laws = &a->laws;
    const int32_t units = a->copy.units;
    int32_t row = 0;
    perp_status status = PERP_OK;

    a->copy.size = 0;
    for (int32_t u = 0; u < units && status == PERP_OK; u++) {
        perp__statics_unit *unit = &a->unit[u];
        const int32_t k = u - laws->contacts;

        memset(unit, 0, sizeof *unit);
        unit->row = a->copy.size;
        if (k < 0) {
            status = list_contact(a, u, &row);
            continue;
        }
        unit->kind = k < laws->bounded ? PERP__STATICS_INTERVAL : PERP__STATICS_FREE;
        unit->lower = k < laws->bounded && laws->lower ? laws->lower[k] : 0.0;
        unit->upper = k < laws->bounded && laws->upper ? laws->upper[k] : INFINITY;
        if (unit->lower == -INFINITY && unit->upper == INFINITY)
            unit->kind = PERP__STATICS_FREE;
        unit->rows = 1;
        take_rows(a, row++, 1);
    }
    return status;
}

/* How many blocks of `width` columns the units meet; *work: of the products of K. */
static int32_t count_links(front *a, int32_t width, double *work)
{
    int32_t sum = 0;

    memset(a->mark, -1, (size_t)a->n * sizeof *a->mark);
    *work = 0.0;
    for (int32_t u = 0; u < a->copy.units; u++) {
        int32_t links = 0;

        for (int32_t k = 0; k < a->unit[u].rows; k++) {
            const combined_row *row = &a->row[a->unit[u].row + k];

            for (int32_t e = a->starts[row->first]; e < a->starts[row->first + row->count]; e++)
                if (a->mark[a->columns[e] / width] != u) {
                    a->mark[a->columns[e] / width] = u;
                    links++;
                }
        }
        sum += links;
        *work += (double)links * links * width * width;
    }
    return sum;
}

static void lay_out_values(perp__arena *arena, void *object)
{
    front *a = object;
    const size_t n = (size_t)a->copy.nodes * (size_t)a->copy.width;

    a->link = perp__arena_take(arena, (size_t)a->copy.links, sizeof *a->link);
    a->values = perp__arena_take(arena, a->numbers, sizeof *a->values);
    a->r = perp__arena_take(arena, (size_t)a->copy.size, sizeof *a->r);
    PERP__DOUBLES(arena, n, &a->forces, &a->loads, &a->v);
}

/* A number in the unit of its velocity. Where doubles do not hold it there it is lost. */
static double bring_in(front *a, double x, double scale)
{
    const double size = fabs(scale * x);

    a->lost |=
        x != 0.0 && (!(size > 0.0 && size < INFINITY) || (size < DBL_MIN && fabs(x) >= DBL_MIN));
    return scale * x;
}

static void fill_links(front *a)
{
    const int32_t width = a->copy.width;
    int32_t links = 0;
    size_t at = 0;

    memset(a->mark, -1, (size_t)a->n * sizeof *a->mark);
    memset(a->values, 0, a->numbers * sizeof *a->values);
    for (int32_t u = 0; u < a->copy.units; u++) {
        perp__statics_unit *unit = &a->unit[u];

        unit->link = links;
        for (int32_t k = 0; k < unit->rows; k++) {
            const combined_row *row = &a->row[unit->row + k];
            int32_t part = 0;

            for (int32_t e = a->starts[row->first]; e < a->starts[row->first + row->count]; e++) {
                const int32_t node = a->columns[e] / width, i = a->columns[e] % width;

                if (a->mark[node] < unit->link) {
                    a->mark[node] = links;
                    a->link[links++] = (perp__statics_link){node, 0, at};
                    at += (size_t)(unit->rows * width);
                }
                while (e >= a->starts[row->first + part + 1])
                    part++;
                a->values[a->link[a->mark[node]].at + (size_t)(k * width + i)] +=
                    row->factor[part] * bring_in(a, a->entry[e], a->scale[a->columns[e]]);
            }
        }
        unit->links = links - unit->link;
    }
}

static perp_status build(front *a)
{
    const int32_t widths[] = {a->n > 0 ? a->n : 1, 6, 3, 1};
    double work[4], least = INFINITY;
    int32_t best = 3;
    perp_status status;

    /* 1. Units of rows. */
    a->entries = count_entries(&a->H) + count_entries(&a->G);
    status = perp__arena_fit(&a->arena, a->context, lay_out_rows, a);
    if (status != PERP_OK)
        return status;
    list_rows(a);
    status = list_units(a);
    if (status != PERP_OK)
        return status;

    /* 2. Coordinates a node: all, six or three as bodies have them, or one: the most that costs
     * little more than the best, for it is beside all forces of a node that one is balanced. */
    for (int32_t k = 3; k >= 0; k--) {
        work[k] = INFINITY;
        if (widths[k] > a->n)
            continue;
        count_links(a, widths[k], &work[k]);
        least = fmin(least, work[k]);
    }
    for (int32_t k = 3; k >= 0; k--)
        if (work[k] <= LITTLE_MORE * least)
            best = k;
    a->copy.width = widths[best];
    a->copy.links = count_links(a, widths[best], &least);
    a->copy.nodes = (a->n + a->copy.width - 1) / a->copy.width;
    a->numbers = (size_t)a->copy.links * (size_t)(PERP__STATICS_MOST_ROWS * a->copy.width);
    status = perp__arena_fit(&a->value_arena, a->context, lay_out_values, a);
    if (status != PERP_OK)
        return status;
    fill_links(a);
    a->copy.unit = a->unit;
    a->copy.link = a->link;
    a->copy.values = a->values;

    /* 3. Forces in nodes. */
    memset(a->forces, 0, (size_t)(a->copy.nodes * a->copy.width) * sizeof *a->forces);
    memset(a->loads, 0, (size_t)(a->copy.nodes * a->copy.width) * sizeof *a->loads);
    for (int32_t j = 0; j < a->n; j++) {
        a->forces[j] = bring_in(a, a->f[j], a->scale[j]);
        a->loads[j] = a->load ? bring_in(a, a->load[j], a->scale[j]) : 0.0;
    }
    return PERP_OK;
}

/* Impulses in the caller's rows; velocities in its coordinates, the largest 1. Scales are those
 * beside the largest of them, for all may be next to nothing. */
static void write_answer(const front *a, perp__statics_answer *answer, double *r, double *v)
{
    const double unit = perp__largest(a->scale, a->n);
    double most = 0.0;

    if (answer->verdict == PERP_STATICS_STANDS && r) {
        for (int32_t i = 0; i < a->size; i++)
            r[i] = 0.0;
        for (int32_t i = 0; i < a->copy.size; i++)
            for (int32_t j = 0; j < a->row[i].count; j++)
                r[a->row[i].first + j] += a->row[i].factor[j] * a->r[i];
    } else if (answer->verdict == PERP_STATICS_FALLS) {
        for (int32_t j = 0; j < a->n; j++)
            most = fmax(most, a->scale[j] / unit * fabs(a->v[j]));
        for (int32_t j = 0; j < a->n && v; j++)
            v[j] = a->scale[j] / unit * a->v[j] / most;
        answer->work = fmin(answer->work / unit / most, DBL_MAX);
    }
}

/* Builds and decides for what was read. */
static perp_status decide(front *a, const perp__statics_aim *given, perp__statics_answer *answer,
                          double *r, double *v)
{
    perp__statics_aim aim = *given;
    perp_status status = build(a);

    if (status == PERP_OK && !a->statics && !(a->statics = perp__statics_create(a->context)))
        status = PERP_ERROR_MEMORY;
    answer->r = a->r;
    answer->v = a->v;
    aim.load = a->load ? a->loads : NULL;
    PERP__THEN(status, perp__statics_set_up(a->statics, &a->copy, a->most_products));
    PERP__THEN(status, perp__statics_decide(a->statics, answer, a->forces, &aim));
    if (status == PERP_OK && a->lost)
        answer->verdict = PERP_STATICS_INDETERMINATE;
    if (status == PERP_OK)
        write_answer(a, answer, r, v);
    return status;
}

static void release(front *a)
{
    perp__statics_destroy(a->statics);
    perp__arena_release(&a->value_arena);
    perp__arena_release(&a->arena);
}

perp_status perp_contact_statics(perp_context *context, double *r, double *v,
                                 perp_statics_result *result, const perp_statics_problem *problem,
                                 const perp_statics_settings *settings)
{
    const double started = perp__now();
    perp__statics_aim aim = {0};
    perp__statics_answer answer = {0};
    front a = {.context = context};
    perp_status status = perp__enter(context);

    if (status != PERP_OK)
        return status;
    status = PERP__CHECK(perp_statics_result, context, result);
    PERP__THEN(status, perp__statics_read_settings(context, &aim, settings));
    PERP__THEN(status, read_problem(&a, problem));
    PERP__THEN(status, decide(&a, &aim, &answer, r, v));
    if (status == PERP_OK) {
        perp_statics_result copy = {.verdict = answer.verdict,
                                    .iterations = answer.iterations,
                                    .margin = answer.margin,
                                    .safety = answer.safety,
                                    .unbalance = answer.unbalance,
                                    .work = answer.work,
                                    .seconds = perp__now() - started};

        perp__struct_write(result, &copy, sizeof copy);
    }
    release(&a);
    return perp__leave(context, status);
}

perp_status perp__statics_rests(perp_context *context, front **kept, const perp_contact_laws *laws,
                                const perp__dynamics *dynamics, const double *f, const double *w,
                                double seconds, double *r, int32_t *rests)
{
    const perp__statics_aim aim = {PERP_STATICS_LEAST, PERP__STATICS_ITERATIONS, 0, NULL};
    perp__statics_answer answer = {0};
    front *a = *kept;
    perp_status status;

    if (!a)
        a = *kept = perp__allocate_zeros(context, 1, sizeof *a, "statics");
    if (!a)
        return PERP_ERROR_MEMORY;
    a->context = context;
    a->laws = *laws;
    a->H = dynamics->H;
    a->G = dynamics->G;
    a->n = dynamics->n;
    a->rows = dynamics->H.rows;
    a->size = dynamics->size;
    a->f = f;
    a->w = w;
    a->lost = 0;
    a->most_products = seconds < INFINITY ? perp__statics_products(seconds) : 0.0;
    a->copy.units = laws->contacts + dynamics->G.rows;
    status = decide(a, &aim, &answer, r, NULL);
    *rests = status == PERP_OK && answer.verdict == PERP_STATICS_STANDS;
    return status;
}

void perp__statics_front_release(perp_context *context, front *a)
{
    if (!a)
        return;
    release(a);
    perp__release(context, a);
}
