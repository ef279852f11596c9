/* Contacts into coloured groups of eight pairs, and their rows P = J C. */
#include <string.h>

#include "contact/coloured/coloured.h"

/* Of a colour: by points, then by those that press. */
enum { RANKS = PERP__PAIR_POINTS * (PERP__PAIR_POINTS + 1), KEYS = PERP__COLOURS * RANKS };

/* Points that are worth a piece of their own. */
#define PIECE 8

static void lay_out_lists(perp__arena *arena, void *object)
{
    perp__coloured *c = object;
    const size_t bodies = (size_t)c->most_bodies + PERP__COLOURED_PIECES;
    const size_t contacts = (size_t)c->most_contacts;

    PERP__DOUBLES(arena, 8 * bodies, &c->y, &c->free, &c->before, &c->moved);
    c->back = perp__arena_take(arena, bodies, sizeof *c->back);
    c->colours = perp__arena_take(arena, bodies, sizeof *c->colours);
    PERP__INTEGERS(arena, contacts, &c->pair_first, &c->pair_points, &c->pair_key, &c->pair_order,
                   &c->pair_part, &c->place);
    c->pair_body = perp__arena_take(arena, 2 * contacts, sizeof *c->pair_body);
}

static void lay_out_points(perp__arena *arena, void *object)
{
    perp__coloured *c = object;

    c->group = perp__arena_take(arena, (size_t)c->most_groups, sizeof *c->group);
    c->point = perp__arena_take(arena, (size_t)c->most_points, sizeof *c->point);
    c->piece_first = perp__arena_take(arena, (size_t)c->most_groups + 1, sizeof *c->piece_first);
}

/* Whether the impulse that a contact starts from presses. */
static bool presses(const perp__coloured *c, int32_t pair, int32_t k)
{
    const double *warm = c->part[c->pair_part[pair]].problem->warm;

    return !warm || warm[3 * (c->pair_first[pair] + k)] > 0.0;
}

/* Among the pairs of a colour: those of most points first, so that a group's have about as many,
 * and of these those of which most press, so that those that do not are side by side. */
static int32_t rank(const perp__coloured *c, int32_t pair)
{
    int32_t pressing = 0;

    for (int32_t k = 0; k < c->pair_points[pair]; k++)
        pressing += presses(c, pair, k);
    return (PERP__PAIR_POINTS - c->pair_points[pair]) * (PERP__PAIR_POINTS + 1) +
           PERP__PAIR_POINTS - pressing;
}

/* Pairs by colour, the first one that neither body has, and rank. Those without one come last. */
static void order_pairs(perp__coloured *c, int32_t pairs, int32_t *starts)
{
    memset(c->colours, 0, (size_t)c->bodies * sizeof *c->colours);
    memset(starts, 0, (KEYS + 3) * sizeof *starts);
    for (int32_t i = 0; i < pairs; i++) {
        const int32_t *body = c->pair_body + 2 * i;
        uint64_t taken = 0;
        int32_t found = 0;

        for (int32_t side = 0; side < 2; side++)
            if (body[side] >= 0)
                taken |= c->colours[body[side]];
        while (~taken != 0 && taken >> found & 1)
            found++;
        for (int32_t side = 0; side < 2 && ~taken != 0; side++)
            if (body[side] >= 0)
                c->colours[body[side]] |= UINT64_C(1) << found;
        c->pair_key[i] = ~taken == 0 ? KEYS : RANKS * found + rank(c, i);
        starts[c->pair_key[i] + 2]++;
    }
    for (int32_t i = 0; i <= KEYS; i++)
        starts[i + 2] += starts[i + 1];
    for (int32_t i = 0; i < pairs; i++)
        c->pair_order[starts[c->pair_key[i] + 1]++] = i;
}

/* Groups of what is ordered, colour by colour, with what has none last; with room for them, writes
 * them, and where pieces of so many points begin. */
static void form_groups(perp__coloured *c, int32_t pairs, const int32_t *starts, int32_t size,
                        bool writes)
{
    int32_t pieces = 0, last = -1, begun = 0, i = 0;

    c->groups = c->points = c->colour_count = 0;
    while (i < pairs) {
        const int32_t key = c->pair_key[c->pair_order[i]], now = key / RANKS;
        const int32_t end = key == KEYS ? i + 1 : starts[(now + 1) * RANKS];
        const int32_t count = end - i < PERP__GROUP ? end - i : PERP__GROUP;

        if (now != last)
            c->colour_first[c->colour_count++] = pieces;
        if (writes && (now != last || (c->points - begun >= size && key != KEYS))) {
            begun = c->points;
            c->piece_first[pieces++] = c->groups;
        }
        last = now;
        if (writes) { /* of the pairs i .. i + count - 1; what does not move is `none` */
            const int32_t none = c->bodies + pieces - 1 - c->colour_first[c->colour_count - 1];
            perp__lane_group *group = &c->group[c->groups];

            group->pairs = count;
            group->rests = 0;
            group->first = c->points;
            group->points = c->pair_points[c->pair_order[i]];
            for (int32_t l = 0; l < PERP__GROUP; l++) {
                const int32_t pair = l < count ? c->pair_order[i + l] : -1;
                const int32_t *body = pair < 0 ? NULL : c->pair_body + 2 * pair;

                group->a[l] = body && body[0] >= 0 ? body[0] : none;
                group->b[l] = body && body[1] >= 0 ? body[1] : none;
                group->pair[l] = pair;
            }
        }
        c->points += c->pair_points[c->pair_order[i]];
        c->groups++;
        i += count;
    }
    c->colour_first[c->colour_count] = pieces;
    if (writes)
        c->piece_first[pieces] = c->groups;
}

/* A contact's rows, P = J C, in their lane. */
static void fill_lane(perp__coloured *c, perp__lane_point *p, int32_t lane, int32_t contact,
                      const perp__coloured_part *part)
{
    const perp__rigid_problem *problem = part->problem;
    const perp__passes *step = part->step;
    const perp__rigid_rows *rows = &problem->rows[contact];

    for (int32_t i = 0; i < rows->dim; i++) {
        p->w[i][lane] = rows->bias[i];
        p->r[i][lane] = p->last[i][lane] = problem->warm ? problem->warm[3 * contact + i] : 0.0;
    }
    if (rows->bounded) { /* its normal moves nothing, and bounds the row after it (law.h) */
        p->r[0][lane] = p->last[0][lane] = -rows->bias[0] / rows->compliance[0];
        p->w[0][lane] = 0.0;
    }
    for (int32_t side = 0; side < 2; side++)
        for (int32_t i = 0; i < rows->dim; i++) {
            double P[6];

            perp__coloured_row(problem, rows, side, i, P, &p->w[i][lane]);
            for (int32_t k = 0; k < 6; k++)
                p->P[12 * i + 6 * side + k][lane] = P[k];
        }
    p->mu[lane] = rows->dim > 1 ? rows->mu : 0.0;
    p->gap[lane] = step->gap ? step->gap[contact] : 0.0;
    p->bias[lane] = p->w[0][lane] + (p->gap[lane] > 0.0 ? p->gap[lane] / step->h : 0.0);
    p->guard[lane] = step->gap ? step->guard[contact] : 0.0;
    p->contact[lane] = contact;
    c->place[part->first_contact + contact] = PERP__GROUP * (int32_t)(p - c->point) + lane;
}

/* A pair's points, those that press first. */
static void fill_pair(perp__coloured *c, const perp__lane_group *group, int32_t lane)
{
    const int32_t pair = group->pair[lane];
    int32_t to = group->first;

    for (int32_t pressing = 1; pressing >= 0; pressing--)
        for (int32_t k = 0; k < c->pair_points[pair]; k++)
            if (presses(c, pair, k) == pressing)
                fill_lane(c, &c->point[to++], lane, c->pair_first[pair] + k,
                          &c->part[c->pair_part[pair]]);
}

void perp__coloured_fill(perp__coloured *c, int32_t first, int32_t end)
{
    for (int32_t g = first; g < end; g++) {
        const perp__lane_group *group = &c->group[g];
        perp__lane_point *p = &c->point[group->first];

        for (int32_t k = 0; k < group->points; k++) {
            memset(&p[k], 0, sizeof *p);
            memset(p[k].contact, -1, sizeof p[k].contact);
        }
        for (int32_t l = 0; l < group->pairs; l++)
            fill_pair(c, group, l);
        for (int32_t k = 0; k < group->points; k++)
            c->kernels->invert(&p[k]);
    }
}

/* Pairs of at most four points; returns how many there are. */
static int32_t pair_contacts(perp__coloured *c, int32_t number, int32_t pairs)
{
    const perp__coloured_part *part = &c->part[number];
    const perp__rigid_problem *problem = part->problem;

    for (int32_t k = 0, end; k < problem->contacts; k = end) {
        const int32_t *body = problem->rows[k].body;

        for (end = k + 1; end < problem->contacts && end < k + PERP__PAIR_POINTS &&
                          problem->rows[end].body[0] == body[0] &&
                          problem->rows[end].body[1] == body[1];)
            end++;
        for (int32_t side = 0; side < 2; side++)
            c->pair_body[2 * pairs + side] =
                perp__rigid_moves(problem, body[side]) ? part->first_body + body[side] : -1;
        c->pair_part[pairs] = number;
        c->pair_first[pairs] = k;
        c->pair_points[pairs++] = end - k;
    }
    return pairs;
}

perp_status perp__coloured_pack(perp__coloured *c)
{
    int32_t starts[KEYS + 3], contacts = 0, pairs = 0, size;
    perp_status status;

    c->width = c->part->problem->width;
    c->bodies = 0;
    for (int32_t k = 0; k < c->parts; k++) {
        c->part[k].first_body = c->bodies;
        c->part[k].end_body = c->bodies += c->part[k].problem->bodies;
        c->part[k].first_contact = contacts;
        c->part[k].end_contact = contacts += c->part[k].problem->contacts;
    }
    perp__raise_room(&c->most_bodies, c->bodies);
    perp__raise_room(&c->most_contacts, contacts);
    status = perp__arena_fit(&c->arena, c->context, lay_out_lists, c);
    if (status != PERP_OK)
        return status;
    /* 1. Pairs, by colour. */
    for (int32_t k = 0; k < c->parts; k++)
        pairs = pair_contacts(c, k, pairs);
    order_pairs(c, pairs, starts);
    /* 2. Groups of them, first counted. */
    form_groups(c, pairs, starts, 0, 0);
    perp__raise_room(&c->most_groups, c->groups);
    perp__raise_room(&c->most_points, c->points);
    status = perp__arena_fit(&c->point_arena, c->context, lay_out_points, c);
    if (status != PERP_OK)
        return status;
    /* 3. A piece has all points of a colour, or so many at least that a colour has no more pieces
     * than there is room for. */
    c->is_large = c->points >= PERP__PIECE_BODIES && c->parts == 1;
    c->rows = c->bodies + (c->is_large ? PERP__COLOURED_PIECES : 1);
    size = 1 + c->points / PERP__COLOURED_PIECES;
    size = !c->is_large ? INT32_MAX : size > PIECE ? size : PIECE;
    form_groups(c, pairs, starts, size, 1);
    return PERP_OK;
}
