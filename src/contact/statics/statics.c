/* Whether forces are in equilibrium with contacts and joints (statics.h), by the interior point:
 *
 *   1. least squares without cones: where they are inside, they are the answer; where they do not
 *      balance the forces, what is left of these moves the bodies against nothing
 *   2. the margin, in doubles, and again in doubled precision where these cannot tell and that is
 *      cheap
 *   3. a margin of 0: contacts that some virtual motion opens without work of the forces carry
 *      nothing (facial reduction); they are left out, and it begins anew
 *   4. least impulses, from inside; a load's factor, from inside */
#include "contact/statics/statics.h"

#include <math.h>
#include <string.h>

#include "base/context.h"
#include "base/outcome.h"
#include "contact/statics/interior.h"
#include "linalg/matrix.h"

/* What bodies' terms may lack in the end; what shows that forces are not in the rows' range. */
#define BALANCED 1e-12
#define ROUNDED 1e-15
#define ADJUSTED 1e-13
#define OUT_OF_RANGE 1e-11
#define FACTOR_BALANCED 1e-11

/* The gap of a load's factor, beside it, with which that is told where numbers end. */
#define ROUGH 1e-7

/* Of the smallest load beside the largest: what counts as none. */
#define LEAST_LOAD 1e-15
#define LIGHTEST 1e-8

/* Times the impulses of least squares: the sum of normals that no one but wedged parts comes near.
 */
#define UNLIMITED 1e4

static void lay_out(perp__arena *arena, void *object)
{
    perp__statics *s = object;
    const perp__statics_rows *rows = s->rows;
    const size_t units = (size_t)rows->units, size = (size_t)rows->size;
    const size_t n = (size_t)rows->nodes * (size_t)rows->width;

    PERP__INTEGERS(arena, units + 1, &s->unit_cone, &s->square, &s->unit_edge);
    s->edge = perp__arena_take(arena, s->fitted[3], sizeof *s->edge);
    PERP__INTEGERS(arena, (size_t)rows->nodes + 1, &s->graph_starts, &s->mark);
    s->idle = perp__arena_take(arena, units, sizeof *s->idle);
    s->cones = perp__arena_take(arena, 3 * units, sizeof *s->cones);
    s->weight = perp__arena_take(arena, units, sizeof *s->weight);
    s->F = perp__arena_take(arena, s->fitted[4], sizeof *s->F);
    PERP__DOUBLES(arena, size, &s->k, &s->j, &s->x, &s->dx, &s->p, &s->rd, &s->inside);
    PERP__DOUBLES(arena, n, &s->b, &s->g, &s->q, &s->c, &s->rb, &s->y, &s->dy, &s->Kr, &s->Kg,
                  &s->Kq, &s->reach, &s->shift, &s->terms, &s->permuted);
    PERP__DOUBLES(arena, n, &s->rb_low, &s->dy_low, &s->Kr_low, &s->Kg_low, &s->Kq_low);
}

perp__statics *perp__statics_create(perp_context *context)
{
    perp__statics *s = perp__allocate_zeros(context, 1, sizeof *s, "statics");

    if (s)
        s->context = context;
    return s;
}

void perp__statics_destroy(perp__statics *s)
{
    if (!s)
        return;
    perp__fronts_release(&s->fronts);
    perp__arena_release(&s->arena);
    perp__arena_release(&s->doubled_arena);
    perp__release(s->context, s);
}

void perp__statics_limit(perp__statics *s, double most_products)
{
    s->fronts.most_products = most_products;
}

int32_t perp__statics_is_too_large(const perp__statics *s)
{
    return s->fronts.is_too_large;
}

perp_status perp__statics_set_up(perp__statics *s, const perp__statics_rows *rows)
{
    const int32_t width = rows->width;
    size_t edges = 0, squares = 0;
    perp_status status;

    s->factored = 0;
    for (int32_t u = 0; u < rows->units; u++) {
        edges += (size_t)rows->unit[u].links * (size_t)rows->unit[u].links;
        squares += (size_t)rows->unit[u].rows * (size_t)rows->unit[u].rows;
    }
    s->rows = rows;
    s->fitted[3] = edges;
    s->fitted[4] = squares;
    status = perp__arena_fit(&s->arena, s->context, lay_out, s);
    if (status != PERP_OK)
        return status;
    s->unit_edge[0] = s->square[0] = 0;
    for (int32_t u = 0; u < rows->units; u++) {
        s->unit_edge[u + 1] = s->unit_edge[u] + rows->unit[u].links * rows->unit[u].links;
        s->square[u + 1] = s->square[u] + rows->unit[u].rows * rows->unit[u].rows;
    }
    memset(s->reach, 0, (size_t)(rows->nodes * width) * sizeof *s->reach);
    for (int32_t u = 0; u < rows->units; u++)
        for (int32_t l = 0; l < rows->unit[u].links; l++) {
            const perp__statics_link *link = &rows->link[rows->unit[u].link + l];

            for (int32_t i = 0; i < rows->unit[u].rows * width; i++)
                perp__raise_to(&s->reach[link->node * width + i % width],
                               fabs(rows->values[link->at + (size_t)i]));
        }
    return perp__statics_order(s);
}

/* ---- the start ---- */

static perp__cone *add_cone(perp__statics *s, int32_t u, double sign, double h, double e)
{
    perp__cone *cone = &s->cones[s->cone_count++];

    memset(cone, 0, sizeof *cone);
    cone->unit = u;
    cone->dim = 1;
    cone->sign = sign / s->weight[u];
    cone->h = h / s->scale / s->weight[u];
    cone->e = e;
    return cone;
}

static void add_disc(perp__statics *s, int32_t u, int32_t first, int32_t rows, double coefficient)
{
    perp__cone *cone = add_cone(s, u, 1.0, 0.0, 1.0);

    cone->dim = 1 + rows;
    cone->first = first;
    cone->scale = 1.0 / (coefficient * s->weight[u]);
}

/* The cones of the units in units of their weights. */
static void build_cones(perp__statics *s)
{
    s->cone_count = 0;
    for (int32_t u = 0; u < s->rows->units; u++) {
        const perp__statics_unit *unit = &s->rows->unit[u];

        s->unit_cone[u] = s->cone_count;
        if (unit->kind == PERP__STATICS_INTERVAL && unit->rows > 0) {
            const double half = 0.5 * (unit->upper - unit->lower) / s->scale / s->weight[u];
            const double e = fmin(1.0, half);

            if (unit->lower > -INFINITY)
                add_cone(s, u, 1.0, -unit->lower, e);
            if (unit->upper < INFINITY)
                add_cone(s, u, -1.0, unit->upper, e);
        } else if (unit->kind == PERP__STATICS_CONE) {
            const int32_t rolling = 1 + unit->tangents, spinning = rolling + unit->rolls;

            if (unit->tangents > 0)
                add_disc(s, u, 1, unit->tangents, unit->mu);
            if (unit->rolls > 0)
                add_disc(s, u, rolling, unit->rolls, unit->rolling);
            if (unit->spins > 0)
                add_disc(s, u, spinning, 1, unit->spinning);
            if (unit->rows == 1)
                add_cone(s, u, 1.0, 0.0, 1.0);
        }
    }
    s->unit_cone[s->rows->units] = s->cone_count;
}

/* The weight of a unit: the load of the less loaded of the nodes that it pushes. */
static void weigh(perp__statics *s)
{
    const int32_t width = s->rows->width;

    for (int32_t node = 0; node < s->rows->nodes; node++) {
        s->terms[node] = 0.0;
        for (int32_t i = node * width; i < (node + 1) * width; i++)
            if (s->reach[i] > 0.0)
                s->terms[node] = fmax(s->terms[node], fabs(s->b[i]) / s->reach[i]);
    }
    for (int32_t u = 0; u < s->rows->units; u++) {
        double least = INFINITY, most = 0.0;

        for (int32_t l = 0; l < s->rows->unit[u].links; l++) {
            const double load = s->terms[s->rows->link[s->rows->unit[u].link + l].node];

            if (load > LEAST_LOAD)
                least = fmin(least, load);
            most = fmax(most, load);
        }
        s->weight[u] = least < INFINITY ? fmax(least, LIGHTEST * most) : 1.0;
    }
}

/* x := the least |x|^2 with A x = b, without cones; y; returns what is left of b. */
static double start_balanced(perp__statics *s)
{
    const size_t n = (size_t)s->rows->nodes * (size_t)s->rows->width;

    for (int32_t u = 0; u < s->rows->units; u++) {
        double *F = s->F + s->square[u];
        const int32_t rows = s->rows->unit[u].rows;

        memset(F, 0, (size_t)(rows * rows) * sizeof *F);
        for (int32_t i = 0; i < rows; i++)
            F[i * rows + i] = 1.0;
    }
    s->aim = PERP__AIM_MARGIN;
    if (!perp__statics_factor(s))
        return INFINITY;
    memset(s->x, 0, (size_t)s->rows->size * sizeof *s->x);
    memset(s->y, 0, n * sizeof *s->y);
    perp__statics_unbalance(s);
    memcpy(s->dy, s->rb, n * sizeof *s->dy);
    memset(s->p, 0, (size_t)s->rows->size * sizeof *s->p);
    return perp__statics_refine(s, ROUNDED);
}

/* R: far above what x has by now; the first tau_R gives t_R tau_R = `mean`. */
static void limit_sum(perp__statics *s, double mean)
{
    double sum = 0.0, size = 1.0;

    for (int32_t u = 0; u < s->rows->units; u++)
        if (s->rows->unit[u].kind == PERP__STATICS_CONE && s->rows->unit[u].rows > 0 &&
            !s->idle[u]) {
            const double normal = s->x[s->rows->unit[u].row] / s->weight[u];

            sum += normal;
            size += 1.0 + fabs(normal);
        }
    s->most = UNLIMITED * size;
    s->t_R = s->most - sum;
    s->tau_R = mean / s->t_R;
}

/* The first z and u of the margin's way, s below the worst margin. */
static void start_margin(perp__statics *s, double room)
{
    int32_t count = 1;

    s->aim = PERP__AIM_MARGIN;
    s->limit = 1.0;
    s->s = fmin(room, 1.0 - 1e-3);
    if (!(room < INFINITY))
        s->s = 0.0;
    s->s -= fmax(1.0, fabs(s->s));
    s->t = s->limit - s->s;
    memset(s->y, 0, (size_t)(s->rows->nodes * s->rows->width) * sizeof *s->y);
    for (int32_t c = 0; c < s->cone_count; c++)
        count += !s->idle[s->cones[c].unit];
    s->tau = 1.0 / count;
    limit_sum(s, 1.0 / count);
    for (int32_t c = 0; c < s->cone_count; c++) {
        perp__cone *cone = &s->cones[c];

        cone->z[0] -= s->s * cone->e;
        memset(cone->u, 0, sizeof cone->u);
        cone->u[0] = 1.0 / count / cone->e;
    }
}

/* The first u of a way from inside, on the central path: u o z = mean e. */
static void start_inside(perp__statics *s, int32_t aim, double mean)
{
    s->aim = aim;
    s->tau = s->t = 0.0;
    memset(s->y, 0, (size_t)(s->rows->nodes * s->rows->width) * sizeof *s->y);
    memset(s->k, 0, (size_t)s->rows->size * sizeof *s->k);
    perp__statics_room(s); /* z */
    for (int32_t c = 0; c < s->cone_count; c++) {
        perp__cone *cone = &s->cones[c];
        const double t = hypot(cone->z[1], cone->z[2]);
        const double det = fmax(cone->z[0] - t, 0.0) * (cone->z[0] + t);

        cone->u[0] = mean * cone->z[0] / det;
        cone->u[1] = -mean * cone->z[1] / det;
        cone->u[2] = -mean * cone->z[2] / det;
    }
    limit_sum(s, mean);
}

/* ---- the phases ---- */

/* Contacts of which a virtual motion without work shows that they carry nothing: its u is strictly
 * inside their dual cone. Returns how many. */
static int32_t drop_idle(perp__statics *s)
{
    double most_u = 0.0, most_z = 0.0;
    int32_t count = 0;

    for (int32_t c = 0; c < s->cone_count; c++)
        if (!s->idle[s->cones[c].unit]) {
            most_u = fmax(most_u, s->cones[c].u[0]);
            most_z = fmax(most_z, s->cones[c].z[0]);
        }
    for (int32_t u = 0; u < s->rows->units; u++) {
        int32_t dies = s->rows->unit[u].kind == PERP__STATICS_CONE && !s->idle[u];

        for (int32_t c = s->unit_cone[u]; c < s->unit_cone[u + 1] && dies; c++)
            dies = perp__cone_room(s->cones[c].u) / most_u > 1e3 * s->cones[c].z[0] / most_z;
        s->idle[u] = (int8_t)(s->idle[u] || dies);
        count += dies;
        for (int32_t k = 0; k < s->rows->unit[u].rows && dies; k++)
            s->x[s->rows->unit[u].row + k] = 0.0;
    }
    return count;
}

/* Forces that no row can answer: of (A A' + shift) y = b, nearly all of y is in the null space of
 * A', for what b has there is divided by the shift; once more, and all of it is. */
static int32_t project_out(perp__statics *s, perp__statics_answer *answer)
{
    const int32_t n = s->rows->nodes * s->rows->width;

    memcpy(s->y, s->b, (size_t)n * sizeof *s->y);
    for (int32_t round = 0; round < 2; round++) {
        for (int32_t i = 0; i < n && round > 0; i++)
            s->y[i] *= s->shift[i];
        memset(s->dy_low, 0, (size_t)n * sizeof *s->dy_low);
        perp__statics_solve(s, s->y, s->dy_low);
    }
    return perp__statics_prove(s, answer, s->y);
}

/* Phases 1 and 2: `room` is the least room of x then. */
static perp__statics_end find_margin(perp__statics *s, perp__statics_answer *answer,
                                     const perp__statics_aim *aim, double *room)
{
    const double left = start_balanced(s);
    const int32_t most = s->iterations + aim->max_iterations;
    perp__statics_end end;

    if (!(left < INFINITY))
        return PERP__STATICS_STUCK;
    if (left > OUT_OF_RANGE && project_out(s, answer)) {
        *room = -INFINITY;
        return PERP__STATICS_PROVED;
    }
    *room = perp__statics_room(s);
    if (*room > 0.0 && left <= BALANCED && !aim->measures)
        return PERP__STATICS_FOUND;
    start_margin(s, *room);
    end = perp__statics_follow_path(s, answer, aim, most);
    *room = s->s;
    return end;
}

/* Whether x is an answer, once balanced to rounding: by the last factors, or by such as move each
 * contact by its own room alone. */
static int32_t is_inside(perp__statics *s, perp__statics_answer *answer)
{
    const int32_t aim = s->aim;

    answer->unbalance = perp__statics_refine(s, ROUNDED);
    if (!(answer->unbalance <= BALANCED) && perp__statics_room(s) > 0.0) {
        start_inside(s, PERP__AIM_MARGIN, 1.0);
        perp__statics_condense(s, 1.0);
        if (perp__statics_factor(s))
            answer->unbalance = perp__statics_refine(s, ROUNDED);
        s->aim = aim;
    }
    return answer->unbalance <= BALANCED && perp__statics_room(s) > 0.0;
}

static perp_status find_inside(perp__statics *s, perp__statics_answer *answer,
                               const perp__statics_aim *aim, perp__statics_end *end)
{
    const int32_t may_double = perp__statics_may_double(s);
    perp_status status = PERP_OK;
    int32_t dropped, any = 0;

    do {
        double room = 0.0;

        dropped = 0;
        *end = find_margin(s, answer, aim, &room);
        if (*end >= PERP__STATICS_ENDED && aim->measures) {
            perp__statics_aim rough = *aim; /* a proof at once, before numbers end */

            rough.measures = 0;
            *end = find_margin(s, answer, &rough, &room);
        }
        if (*end == PERP__STATICS_FOUND && !is_inside(s, answer))
            *end = PERP__STATICS_STUCK;
        answer->margin = room;
        if (*end >= PERP__STATICS_ENDED && !s->doubled && may_double) {
            status = perp__statics_make_doubled(s);
            s->doubled = status == PERP_OK;
            dropped = s->doubled;
            continue;
        }
        if (*end >= PERP__STATICS_ENDED)
            dropped = drop_idle(s);
        s->doubled &= dropped == 0;
        any |= dropped > 0 && !s->doubled;
    } while (status == PERP_OK && dropped > 0);
    if (any && *end == PERP__STATICS_FOUND)
        answer->margin = 0.0; /* of those that carry nothing */
    return status;
}

/* The least impulses that balance the forces, from those inside. */
static void find_least(perp__statics *s, perp__statics_answer *answer, const perp__statics_aim *aim)
{
    const size_t bytes = (size_t)s->rows->size * sizeof(double);
    const int32_t doubled = s->doubled;
    double mean = 0.0;

    memcpy(s->inside, s->x, bytes);
    for (int32_t c = 0; c < s->cone_count; c++) {
        const double normal = s->cones[c].z[0] * s->weight[s->cones[c].unit];

        mean += normal * normal / s->cone_count;
    }
    start_inside(s, PERP__AIM_LEAST, mean);
    if (perp__statics_follow_path(s, answer, aim, s->iterations + aim->max_iterations) !=
            PERP__STATICS_FOUND ||
        !is_inside(s, answer)) {
        memcpy(s->x, s->inside, bytes);
        s->aim = PERP__AIM_MARGIN;
        answer->unbalance = perp__statics_unbalance(s);
    }
    s->doubled = doubled;
}

/* The largest factor of the load, from impulses inside at `factor`; in doubled precision where
 * doubles do not come to an end. */
static perp_status find_factor(perp__statics *s, perp__statics_answer *answer,
                               const perp__statics_aim *aim, const double *forces, double factor)
{
    const int32_t n = s->rows->nodes * s->rows->width;
    const size_t bytes = (size_t)s->rows->size * sizeof(double);
    perp__statics_end end;
    perp_status status = PERP_OK;
    int32_t again;

    for (int32_t i = 0; i < n; i++) {
        s->b[i] = -forces[i] / s->scale;
        s->c[i] = -aim->load[i] / s->scale;
    }
    memcpy(s->inside, s->x, bytes);
    do {
        s->s = s->factor = factor;
        s->lacks = INFINITY;
        memcpy(s->x, s->inside, bytes);
        start_inside(s, PERP__AIM_LOAD, 0.1);
        end = perp__statics_follow_path(s, answer, aim, s->iterations + aim->max_iterations);
        if (end == PERP__STATICS_FOUND && perp__statics_refine(s, ROUNDED) > FACTOR_BALANCED)
            end = PERP__STATICS_STUCK;
        answer->safety = s->lacks <= ROUGH * fmax(fabs(s->factor), ROUGH) ? s->factor : NAN;
        again = end == PERP__STATICS_STUCK && !s->doubled && perp__statics_may_double(s);
        if (again)
            status = perp__statics_make_doubled(s);
        s->doubled |= again;
    } while (again && status == PERP_OK);
    return status;
}

static void set_forces(perp__statics *s, const double *forces, const double *load)
{
    const int32_t n = s->rows->nodes * s->rows->width;

    for (int32_t i = 0; i < n; i++)
        s->b[i] = -(forces ? forces[i] : 0.0) - (load ? load[i] : 0.0);
    s->scale = perp__largest(s->b, n);
    if (s->scale == 0.0)
        s->scale = 1.0;
    for (int32_t i = 0; i < n; i++)
        s->b[i] /= s->scale;
    s->doubled = 0;
    memset(s->idle, 0, (size_t)s->rows->units * sizeof *s->idle);
    weigh(s);
    build_cones(s);
}

/* The cones of what impulses may grow by without end: intervals have none but where they are
 * infinite. */
static void use_recession_cones(perp__statics *s)
{
    for (int32_t c = 0; c < s->cone_count; c++)
        s->cones[c].h = 0.0;
    for (int32_t u = 0; u < s->rows->units; u++) {
        const perp__statics_unit *unit = &s->rows->unit[u];

        s->idle[u] = (int8_t)(unit->kind == PERP__STATICS_INTERVAL && unit->lower > -INFINITY &&
                              unit->upper < INFINITY);
    }
}

/* The load's factor, in runs of its own: where the load alone is carried, every factor is. */
static perp_status find_safety(perp__statics *s, perp__statics_answer *answer,
                               const perp__statics_aim *aim, const double *forces)
{
    perp__statics_aim plain = *aim;
    perp__statics_answer own = {0};
    perp__statics_end end;
    perp_status status;

    plain.measures = 0;
    set_forces(s, NULL, aim->load);
    use_recession_cones(s);
    status = find_inside(s, &own, &plain, &end);
    if (status == PERP_OK && end == PERP__STATICS_FOUND)
        answer->safety = INFINITY;
    for (double factor = 1.0; status == PERP_OK && isnan(answer->safety) && factor >= 0.0;
         factor--) {
        set_forces(s, forces, factor > 0.0 ? aim->load : NULL);
        status = find_inside(s, &own, &plain, &end);
        if (status == PERP_OK && end == PERP__STATICS_FOUND)
            status = find_factor(s, answer, aim, forces, factor);
    }
    return status;
}

/* Within the cones to the last bit: rounding of a product may leave them by one. */
static void pull_in(const perp__statics *s, double *r)
{
    for (int32_t c = 0; c < s->cone_count; c++) {
        const perp__cone *cone = &s->cones[c];
        const perp__statics_unit *unit = &s->rows->unit[cone->unit];
        double *own = r + unit->row;
        const double coefficient = cone->first == 1 && unit->tangents > 0 ? unit->mu
                                   : cone->first == 1 + unit->tangents && unit->rolls > 0
                                       ? unit->rolling
                                       : unit->spinning;

        for (int32_t round = 0; round < 8 && cone->dim > 1 && !s->idle[cone->unit]; round++) {
            if (hypot(own[cone->first], cone->dim > 2 ? own[cone->first + 1] : 0.0) *
                    (1.0 + 2.0 * DBL_EPSILON) <=
                coefficient * own[0])
                break;
            for (int32_t j = 1; j < cone->dim; j++)
                own[cone->first + j - 1] *= 1.0 - DBL_EPSILON;
        }
    }
}

/* Whether impulses of 0 are within all bounds. */
static int32_t allows_nothing(const perp__statics *s)
{
    for (int32_t u = 0; u < s->rows->units; u++) {
        const perp__statics_unit *unit = &s->rows->unit[u];

        if (unit->kind == PERP__STATICS_INTERVAL && !(unit->lower <= 0.0 && unit->upper >= 0.0))
            return 0;
    }
    return 1;
}

perp_status perp__statics_decide(perp__statics *s, perp__statics_answer *answer,
                                 const double *forces, const perp__statics_aim *aim)
{
    const int32_t n = s->rows->nodes * s->rows->width;
    perp__statics_end end = PERP__STATICS_STUCK;
    perp_status status = PERP_OK;

    s->iterations = s->factored = 0;
    answer->safety = NAN;
    answer->margin = answer->unbalance = answer->work = 0.0;
    if (aim->load)
        status = find_safety(s, answer, aim, forces);
    set_forces(s, forces, aim->load);
    if (status == PERP_OK)
        status = find_inside(s, answer, aim, &end);
    if (status != PERP_OK)
        return status;
    if (end != PERP__STATICS_FOUND && perp__is_zero(s->b, n) && allows_nothing(s)) {
        memset(s->x, 0, (size_t)s->rows->size * sizeof *s->x);
        end = PERP__STATICS_FOUND;
    } else if (end == PERP__STATICS_FOUND && aim->objective == PERP_STATICS_LEAST) {
        find_least(s, answer, aim);
    }
    answer->verdict = end == PERP__STATICS_FOUND    ? PERP_STATICS_STANDS
                      : end == PERP__STATICS_PROVED ? PERP_STATICS_FALLS
                                                    : PERP_STATICS_INDETERMINATE;
    for (int32_t i = 0; i < s->rows->size && end == PERP__STATICS_FOUND && answer->r; i++)
        answer->r[i] = s->scale * s->x[i];
    if (end == PERP__STATICS_FOUND && answer->r)
        pull_in(s, answer->r);
    answer->iterations = s->iterations;
    return PERP_OK;
}

/* ---- other forces ---- */

int32_t perp__statics_adjust(perp__statics *s, const perp__statics_rows *rows,
                             perp__statics_answer *answer, const double *forces, const double *base,
                             int32_t keep)
{
    s->rows = rows;
    if (!(keep && s->factored)) {
        s->iterations = s->doubled = 0;
        s->scale = ldexp(1.0, ilogb(perp__largest(base, rows->size)));
        for (int32_t u = 0; u < rows->units; u++)
            s->weight[u] = 1.0;
        build_cones(s);
        for (int32_t i = 0; i < s->rows->size; i++)
            s->x[i] = base[i] / s->scale;
        for (int32_t u = 0; u < s->rows->units; u++) /* contacts that carry nothing go on so */
            s->idle[u] = (int8_t)(s->rows->unit[u].kind == PERP__STATICS_CONE &&
                                  s->x[s->rows->unit[u].row] == 0.0);
        if (!(perp__statics_room(s) > 0.0))
            return 0;
        s->t = s->tau = 0.0;
        start_inside(s, PERP__AIM_MARGIN, 1.0);
        perp__statics_condense(s, 1.0);
        if (!perp__statics_factor(s))
            return 0;
        s->factored = 1;
    }
    for (int32_t i = 0; i < s->rows->nodes * s->rows->width; i++)
        s->b[i] = -forces[i] / s->scale;
    for (int32_t i = 0; i < s->rows->size; i++)
        s->x[i] = base[i] / s->scale;
    s->aim = PERP__AIM_MARGIN;
    answer->unbalance = perp__statics_refine(s, ADJUSTED);
    answer->margin = perp__statics_room(s);
    if (!(answer->unbalance <= BALANCED && answer->margin > 0.0))
        return 0;
    for (int32_t i = 0; i < s->rows->size; i++)
        answer->r[i] = s->scale * s->x[i];
    pull_in(s, answer->r);
    answer->verdict = PERP_STATICS_STANDS;
    answer->iterations = 0;
    return 1;
}
