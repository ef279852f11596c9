/* Whether forces are in equilibrium with contacts and joints (statics.h), by the interior point:
 *
 *   1. least squares without cones: where they are inside, they are the answer; where they do not
 *      balance the forces, what is left of these moves the bodies against nothing
 *   2. the margin, in doubles, and again in doubled precision where these cannot tell and that is
 *      cheap
 *   3. a margin of 0: contacts that some virtual motion opens without work of the forces carry
 *      nothing (facial reduction); they are left out, and it begins anew
 *   4. least impulses, from inside; a load's factor, by proofs that larger ones fall */
#include "contact/statics/statics.h"

#include <math.h>
#include <string.h>

#include "base/context.h"
#include "base/outcome.h"
#include "contact/statics/interior.h"
#include "linalg/matrix.h"
#include "linalg/spatial.h"

/* Of a load's factor: the first one, beside that which makes the load as large as the forces; the
 * largest that doubles tell the forces beside; the gap of proofs that it is too large, and so what
 * a step down to the next leaves, besides its square; and the last step, which is that square. */
#define FAR 1024.0
#define FARTHEST (FAR * FAR * FAR)
#define NEAR 1e-4
#define LAST (NEAR * NEAR / 2.0)

static void lay_out(perp__arena *arena, void *object)
{
    perp__statics *s = object;
    const perp__statics_rows *rows = s->rows;
    const size_t units = (size_t)rows->units, size = (size_t)rows->size;
    const size_t n = (size_t)rows->nodes * (size_t)rows->width;

    s->kept_units = perp__arena_take(arena, units, sizeof *s->kept_units);
    s->kept_links = perp__arena_take(arena, (size_t)rows->links, sizeof *s->kept_links);
    s->kept_values = perp__arena_take(arena, s->numbers, sizeof *s->kept_values);
    PERP__INTEGERS(arena, units + 1, &s->unit_cone, &s->square, &s->unit_edge);
    s->edge = perp__arena_take(arena, s->edges, sizeof *s->edge);
    PERP__INTEGERS(arena, (size_t)rows->nodes + 2, &s->graph_starts, &s->mark, &s->unit_starts);
    s->units = perp__arena_take(arena, (size_t)rows->links + 1, sizeof *s->units);
    s->graph = perp__arena_take(arena, (size_t)rows->nodes + s->edges + 1, sizeof *s->graph);
    s->idle = perp__arena_take(arena, units, sizeof *s->idle);
    s->cones = perp__arena_take(arena, 3 * units, sizeof *s->cones);
    s->weight = perp__arena_take(arena, units, sizeof *s->weight);
    s->F = perp__arena_take(arena, s->squares, sizeof *s->F);
    s->P = perp__arena_take(arena, s->widest, sizeof *s->P);
    PERP__DOUBLES(arena, size, &s->k, &s->x, &s->dx, &s->p, &s->rd, &s->met, &s->base, &s->inside);
    PERP__DOUBLES(arena, n, &s->b, &s->g, &s->c, &s->rb, &s->y, &s->dy, &s->Kr, &s->Kg, &s->reach,
                  &s->shift, &s->terms, &s->permuted);
    PERP__DOUBLES(arena, n, &s->rb_low, &s->dy_low, &s->Kr_low, &s->Kg_low);
}

perp__statics *perp__statics_create(perp_context *context)
{
    perp__statics *s = perp__allocate_zeros(context, 1, sizeof *s, "statics");

    if (s) {
        s->context = context;
        s->fronts.is_symmetric = 1;
    }
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

perp_status perp__statics_set_up(perp__statics *s, const perp__statics_rows *rows, double most)
{
    const int32_t width = rows->width;
    perp_status status;

    s->rows = rows;
    s->factored = 0;
    s->edges = s->squares = s->widest = s->numbers = 0;
    for (int32_t u = 0; u < rows->units; u++) {
        const size_t links = (size_t)rows->unit[u].links, height = (size_t)rows->unit[u].rows;
        const size_t entries = links * height * (size_t)width;

        s->edges += links * links;
        s->squares += height * height;
        s->widest = entries > s->widest ? entries : s->widest;
        s->numbers += entries;
    }
    status = perp__arena_fit(&s->arena, s->context, lay_out, s);
    if (status != PERP_OK)
        return status;
    memcpy(s->kept_units, rows->unit, (size_t)rows->units * sizeof *s->kept_units);
    memcpy(s->kept_links, rows->link, (size_t)rows->links * sizeof *s->kept_links);
    memcpy(s->kept_values, rows->values, s->numbers * sizeof *s->kept_values);
    s->kept = *rows;
    s->kept.unit = s->kept_units;
    s->kept.link = s->kept_links;
    s->kept.values = s->kept_values;
    s->rows = &s->kept;
    s->unit_edge[0] = s->square[0] = 0;
    memset(s->reach, 0, (size_t)(rows->nodes * width) * sizeof *s->reach);
    for (int32_t u = 0; u < rows->units; u++) {
        const perp__statics_unit *unit = &rows->unit[u];

        s->unit_edge[u + 1] = s->unit_edge[u] + unit->links * unit->links;
        s->square[u + 1] = s->square[u] + unit->rows * unit->rows;
        for (int32_t l = unit->link; l < unit->link + unit->links; l++)
            for (int32_t i = 0; i < unit->rows * width; i++)
                perp__raise_to(&s->reach[rows->link[l].node * width + i % width],
                               fabs(rows->values[rows->link[l].at + (size_t)i]));
    }
    s->fronts.most_products = most;
    return perp__statics_order(s);
}

/* ---- the phases ---- */

/* Contacts of which a virtual motion without work shows that they carry nothing, for its u is
 * strictly inside their dual cone; and rows that are at a bound likewise. Returns how many. */
static int32_t drop_idle(perp__statics *s)
{
    double most_u = 0.0, most_z = 1.0; /* of an ordinary size: joints may carry all */
    int32_t count = 0;

    for (int32_t c = 0; c < s->cone_count; c++) {
        most_u = fmax(most_u, s->cones[c].u[0]);
        most_z = fmax(most_z, s->cones[c].z[0]);
    }
    for (int32_t u = 0; u < s->rows->units; u++) {
        const perp__statics_unit *unit = &s->rows->unit[u];
        const int32_t first = s->unit_cone[u], end = s->unit_cone[u + 1];
        int32_t dead = 0;
        double bound = 0.0;

        for (int32_t c = first; c < end; c++)
            if (perp__cone_room(s->cones[c].u) / most_u > 1e3 * s->cones[c].z[0] / most_z) {
                bound = s->cones[c].h == 0.0     ? 0.0
                        : s->cones[c].sign > 0.0 ? unit->lower / s->scale
                                                 : unit->upper / s->scale;
                dead++;
            }
        if (dead == 0 || (dead < end - first && unit->kind == PERP__STATICS_CONE))
            continue;
        s->idle[u] = 1;
        count++;
        for (int32_t k = 0; k < unit->rows; k++)
            s->x[unit->row + k] = bound;
    }
    perp__statics_build_cones(s);
    return count;
}

/* Phases 1 and 2: `room` is the least room of x then. */
static perp__statics_end find_margin(perp__statics *s, perp__statics_answer *answer,
                                     const perp__statics_aim *aim, double *room)
{
    const int32_t width = s->rows->width, n = s->rows->nodes * width;
    const int32_t most = s->iterations + aim->max_iterations;
    perp__statics_end end;
    double left;

    /* 1. Forces on coordinates without a row, or with none but noise beside others of the body. */
    *room = -INFINITY;
    perp__statics_clear(s);
    for (int32_t i = 0; i < n; i++)
        s->y[i] =
            s->reach[i] > PERP__BALANCED_AT_BEST * perp__largest(s->reach + i - i % width, width) ||
                    s->b[i] == 0.0
                ? 0.0
                : copysign(1.0, s->b[i]);
    if (perp__statics_prove(s, answer, s->y))
        return PERP__STATICS_PROVED;
    left = perp__statics_start_balanced(s);
    if (!(left < INFINITY))
        return PERP__STATICS_STUCK;

    /* 2. Forces that no row can answer: of (A A' + shift) y = b, nearly all of y is in the null
     * space of A', for what b has there is divided by the shift; once more, and all of it is. */
    if (left > PERP__BALANCED) {
        perp__copy(s->y, s->b, n);
        for (int32_t round = 0; round < 2; round++) {
            for (int32_t i = 0; i < n && round > 0; i++)
                s->y[i] *= s->shift[i];
            memset(s->dy_low, 0, (size_t)n * sizeof *s->dy_low);
            perp__statics_solve(s, s->y, s->dy_low);
        }
        if (perp__statics_prove(s, answer, s->y))
            return PERP__STATICS_PROVED;
    }

    /* 3. The margin, unless least squares are inside. */
    *room = perp__statics_room(s);
    if (*room > 0.0 && left <= PERP__BALANCED && aim->gap == 0.0)
        return PERP__STATICS_FOUND;
    perp__statics_start_margin(s, *room);
    end = perp__statics_follow_path(s, answer, aim, most);
    *room = fmin(s->s, 1.0);
    return end;
}

/* Whether x is an answer, once balanced to rounding: by the last factors, or by such as move each
 * contact by its own room alone. */
static bool is_inside(perp__statics *s, perp__statics_answer *answer)
{
    const int32_t aim = s->aim;

    answer->unbalance =
        perp__statics_refine(s, perp__statics_unbalance(s, 0), PERP__BALANCED_AT_BEST);
    if (!(answer->unbalance <= PERP__BALANCED) && perp__statics_room(s) > 0.0) {
        perp__statics_start_inside(s, PERP__AIM_MARGIN, 1.0);
        perp__statics_condense(s, 1.0);
        if (perp__statics_factor(s))
            answer->unbalance =
                perp__statics_refine(s, perp__statics_unbalance(s, 0), PERP__BALANCED_AT_BEST);
        s->aim = aim;
    }
    return answer->unbalance <= PERP__BALANCED && perp__statics_room(s) > 0.0;
}

/* Doubles end where the margin is 0. Nearly always contacts that carry nothing are the reason: they
 * are dropped, and where impulses are inside all other cones it stands. Else what doubles say of a
 * margin near 0 is not believed: doubled precision is asked, about all contacts. */
static perp_status find_inside(perp__statics *s, perp__statics_answer *answer,
                               const perp__statics_aim *aim, perp__statics_end *end)
{
    perp_status status = PERP_OK;
    int32_t again, dropped = 0, first = 1, guessed = 0;

    do {
        double room = 0.0;

        again = 0;
        *end = find_margin(s, answer, aim, &room);
        if (*end >= PERP__STATICS_ENDED && aim->gap > 0.0) {
            perp__statics_aim rough = *aim; /* a proof at once, before numbers end */

            rough.gap = 0.0;
            *end = find_margin(s, answer, &rough, &room);
        }
        if (*end == PERP__STATICS_FOUND && !is_inside(s, answer))
            *end = PERP__STATICS_STUCK;
        if (!dropped || room > -INFINITY) /* else some rows alone do not answer the forces */
            answer->margin = room;
        if (*end < PERP__STATICS_ENDED)
            break;
        if (first)
            again = dropped = guessed = drop_idle(s) > 0;
        first = 0;
        if (!again)
            status = perp__statics_go_doubled(s, &again);
        if (guessed && s->doubled) {
            memset(s->idle, 0, (size_t)s->rows->units * sizeof *s->idle);
            perp__statics_build_cones(s);
            dropped = guessed = 0;
        }
        if (status == PERP_OK && !again) {
            again = drop_idle(s) > 0;
            dropped |= again;
            s->doubled &= !again;
        }
    } while (again);
    if (dropped && *end != PERP__STATICS_PROVED)
        answer->margin = 0.0; /* of those that carry nothing */
    return status;
}

/* The least impulses that balance the forces, from those inside. */
static void find_least(perp__statics *s, perp__statics_answer *answer, const perp__statics_aim *aim)
{
    const size_t bytes = (size_t)s->rows->size * sizeof(double);
    const bool doubled = s->doubled;
    perp__statics_end end;
    double mean = 0.0;

    memcpy(s->inside, s->x, bytes);
    for (int32_t c = 0; c < s->cone_count; c++) {
        const double normal = s->cones[c].z[0] * s->weight[s->cones[c].unit];

        mean += normal * normal / s->cone_count;
    }
    perp__statics_start_inside(s, PERP__AIM_LEAST, mean);
    end = perp__statics_follow_path(s, answer, aim, s->iterations + aim->max_iterations);
    for (int32_t i = 0; i < s->rows->size; i++) /* from the edge, where rounding may take it out:
                                                   what the end of the path is known to */
        s->x[i] += PERP__BALANCED * (s->inside[i] - s->x[i]);
    if (end != PERP__STATICS_FOUND || !is_inside(s, answer)) {
        memcpy(s->x, s->inside, bytes);
        s->aim = PERP__AIM_MARGIN;
        answer->unbalance = perp__statics_unbalance(s, 0);
    }
    s->doubled = doubled;
}

static bool is_loaded(const perp__statics *s)
{
    return (s->pushes && !s->recedes) || !perp__is_zero(s->b, s->rows->nodes * s->rows->width);
}

/* Decides about forces + factor load. No impulses are an answer where nothing asks for any. */
static perp_status carry(perp__statics *s, perp__statics_answer *answer,
                         const perp__statics_aim *aim, const double *forces, double factor,
                         const double *load, perp__statics_end *end)
{
    memset(s->x, 0, (size_t)s->rows->size * sizeof *s->x);
    perp__statics_set_forces(s, forces, factor, load);
    *end = PERP__STATICS_FOUND;
    return is_loaded(s) ? find_inside(s, answer, aim, end) : PERP_OK;
}

/* The largest factor of the load, by proofs that larger ones fall: v'(forces + a load), with what
 * bounds add, is linear in a, and where it is 0 is the next one to ask. This is Newton's method on
 * the margin, a concave function of a; where no proof is left is the largest factor. The first v,
 * in s->y, is that of the load alone. Of a load that is carried alone any factor is above one that
 * is found. Where no rows answer, at most one is carried; 0 is the only one that doubles tell. */
static perp_status find_factor(perp__statics *s, perp__statics_answer *answer,
                               const perp__statics_aim *aim, const double *forces, bool carried)
{
    const int32_t n = s->rows->nodes * s->rows->width;
    const double size = perp__largest(forces, n), unit = perp__unit_of(perp__largest(aim->load, n));
    const double first = size > 0.0 ? fmin(FAR * size, 0.25 * DBL_MAX) : 1.0;
    const perp__statics_aim near = {aim->objective, aim->max_iterations, NEAR, NULL};
    perp__statics_answer other = {.v = s->g};
    const double most = first * (carried ? FARTHEST : 1.0 / (DBL_EPSILON * DBL_EPSILON));
    double a = first, above = INFINITY, least;
    perp_status status = PERP_OK;
    bool stood = 0;

    for (int32_t i = 0; i < n; i++)
        s->c[i] = aim->load[i] / unit;
    perp__statics_set_forces(s, forces, 0.0, s->c);
    least = -FARTHEST * s->scale;
    for (int32_t round = 0; status == PERP_OK && isnan(answer->safety) &&
                            round < aim->max_iterations && a > least && a < most;
         round++) {
        perp__statics_end end = PERP__STATICS_PROVED;

        perp__statics_set_forces(s, forces, a, s->c);
        if (round > 0 || !perp__statics_prove(s, &other, s->y))
            status = find_inside(s, &other, &near, &end);
        if (end == PERP__STATICS_PROVED && other.margin == -INFINITY) {
            status = carry(s, &other, aim, forces, 0.0, s->c, &end);
            if (status == PERP_OK && end == PERP__STATICS_FOUND)
                answer->safety = 0.0;
            return status;
        }
        if (end == PERP__STATICS_PROVED) {
            const double slope = perp__dot(other.v, s->c, n), next = a - s->work / slope * s->scale;

            stood = 0;
            if (slope > 0.0 && a - next <= LAST * fabs(a))
                answer->safety = next / unit;
            if (!(slope > 0.0) && above < INFINITY) /* smaller ones fall, too */
                return status;
            above = slope > 0.0 ? a : above;
            a = slope > 0.0 ? next : FAR * a;
        } else if (carried && end == PERP__STATICS_FOUND) {
            answer->safety = INFINITY;
        } else if (above < INFINITY) {
            const double rounding = PERP__ROUNDING_LIMIT * above;

            if (stood || rounding <= LAST * fabs(a))
                answer->safety = a / unit;
            a += rounding;
            stood = 1;
        } else {
            a *= FAR;
        }
    }
    return status;
}

/* The impulses in the caller's unit. Returns their least room in a cone; or -1 where doubles have
 * no such numbers, or where one left bounds that were thought to be too far away. */
static double write_impulses(perp__statics *s, perp__statics_answer *answer)
{
    double *r = answer->r ? answer->r : s->dx, least = INFINITY;
    bool fine = 1;

    for (int32_t i = 0; i < s->rows->size; i++) {
        r[i] = s->scale * s->x[i];
        fine &= isfinite(r[i]) != 0;
    }

    /* within the cones to the last bit: rounding of a product may leave them by one */
    for (int32_t c = 0; c < s->cone_count; c++) {
        const perp__cone *cone = &s->cones[c];
        const perp__statics_unit *unit = &s->rows->unit[cone->unit];
        double *at_unit = r + unit->row, *t = at_unit + cone->first;
        double z[3], room;

        perp__cone_place(s, cone, s->x, cone->h, z);
        room = perp__cone_room(z);
        least = fmin(least, room / cone->e);
        for (int32_t round = cone->dim > 1 && room <= 8.0 * DBL_EPSILON * z[0] ? 0 : 8; round < 8;
             round++) {
            if (perp__length2(t[0], cone->dim > 2 ? t[1] : 0.0) * (1.0 + 2.0 * DBL_EPSILON) <
                perp__statics_share(unit, cone->first) * at_unit[0])
                break;
            for (int32_t j = 0; j < cone->dim - 1; j++)
                t[j] = nextafter(t[j], 0.0);
        }
    }
    for (int32_t u = 0; u < s->rows->units; u++) {
        const perp__statics_unit *unit = &s->rows->unit[u];
        const double at_unit = r[unit->row];

        if (unit->kind != PERP__STATICS_INTERVAL || unit->rows == 0)
            continue;
        r[unit->row] = fmin(fmax(at_unit, unit->lower), unit->upper);
        fine &= fabs(at_unit - r[unit->row]) <= 4.0 * DBL_EPSILON * fabs(at_unit);
    }
    return fine ? least : -1.0;
}

perp_status perp__statics_decide(perp__statics *s, perp__statics_answer *answer,
                                 const double *forces, const perp__statics_aim *aim)
{
    perp__statics_end end = PERP__STATICS_FOUND;
    perp__statics_aim plain = *aim;
    perp__statics_answer other = {0};
    perp_status status = PERP_OK;

    s->iterations = s->factored = 0;
    answer->verdict = PERP_STATICS_INDETERMINATE;
    answer->iterations = 0;
    answer->safety = NAN;
    answer->margin = answer->unbalance = answer->work = 0.0;
    if (s->fronts.is_too_large)
        return PERP_OK;

    /* 1. The load's factor. */
    plain.gap = 0.0;
    if (aim->load) {
        status = carry(s, &other, &plain, NULL, 1.0, aim->load, &end);
        PERP__THEN(status, find_factor(s, answer, &plain, forces, end == PERP__STATICS_FOUND));
    }

    /* 2. The verdict. */
    PERP__THEN(status, carry(s, answer, aim, forces, 1.0, aim->load, &end));
    if (status == PERP_OK && end == PERP__STATICS_FOUND && is_loaded(s) &&
        aim->objective == PERP_STATICS_LEAST)
        find_least(s, answer, aim);
    if (status != PERP_OK)
        return status;
    if (end == PERP__STATICS_FOUND && !(write_impulses(s, answer) >= 0.0))
        end = PERP__STATICS_STUCK;
    answer->verdict = end == PERP__STATICS_FOUND    ? PERP_STATICS_STANDS
                      : end == PERP__STATICS_PROVED ? PERP_STATICS_FALLS
                                                    : PERP_STATICS_INDETERMINATE;
    if (!(answer->margin <= 1.0)) /* numbers ended before one was found */
        answer->margin = 0.0;
    if (end != PERP__STATICS_FOUND)
        answer->unbalance = 0.0;
    answer->iterations = s->iterations;
    return PERP_OK;
}

void perp__statics_nearest(perp__statics *s, double *r)
{
    memset(r, 0, (size_t)s->rows->size * sizeof *r);
    for (int32_t u = 0; u < s->rows->units; u++) {
        const perp__statics_unit *unit = &s->rows->unit[u];
        const double *x = s->x + unit->row, most = unit->rows > 0 ? unit->mu * x[0] : 0.0;
        const double size =
            perp__length2(unit->tangents > 0 ? x[1] : 0.0, unit->tangents > 1 ? x[2] : 0.0);

        for (int32_t k = 0; k <= unit->tangents && unit->rows > 0 && x[0] > 0.0; k++)
            r[unit->row + k] = s->scale * x[k] * (k > 0 && size > most ? most / size : 1.0);
    }
}

/* ---- other forces ---- */

void perp__statics_keep(perp__statics *s, const double *base)
{
    const perp__statics_rows *rows = s->rows;

    s->iterations = s->doubled = s->recedes = 0;
    s->scale = perp__unit_of(perp__largest(base, rows->size));
    for (int32_t i = 0; i < rows->size; i++)
        s->x[i] = s->base[i] = base[i] / s->scale;
    for (int32_t u = 0; u < rows->units; u++) { /* contacts that carry nothing go on so */
        s->weight[u] = 1.0;
        s->idle[u] = rows->unit[u].kind == PERP__STATICS_CONE && s->x[rows->unit[u].row] == 0.0;
    }
    perp__statics_build_cones(s);
    if (s->fronts.is_too_large || !(perp__statics_room(s) > 0.0))
        return;
    s->t = s->tau = 0.0;
    memset(s->b, 0, perp__statics_numbers(s) * sizeof *s->b);
    perp__statics_balance(s, 0);
    memcpy(s->g, s->rb, perp__statics_numbers(s) * sizeof *s->g);
    perp__statics_start_inside(s, PERP__AIM_MARGIN, 1.0);
    perp__statics_condense(s, 1.0);
    s->factored = perp__statics_factor(s);
}

bool perp__statics_adjust(perp__statics *s, perp__statics_answer *answer, const double *forces)
{
    if (!s->factored)
        return 0;
    for (size_t i = 0; i < perp__statics_numbers(s); i++) {
        s->b[i] = -forces[i] / s->scale;
        s->rb[i] = s->b[i] + s->g[i];
    }
    memcpy(s->x, s->base, (size_t)s->rows->size * sizeof *s->x);
    answer->unbalance = perp__statics_refine(s, perp__statics_unbalance(s, 1), PERP__BALANCED);
    return answer->unbalance <= PERP__BALANCED && write_impulses(s, answer) > 0.0;
}
