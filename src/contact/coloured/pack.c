/* Contacts into coloured groups of eight pairs, and their rows P = J C. */
#include <string.h>

#include "contact/coloured/coloured.h"

enum { KEYS = PERP__COLOURS * PERP__PAIR_POINTS };

/* Points, of eight contacts each, from which on a problem is large; and how many are worth a
 * piece of their own. */
#define LARGE 128
#define PIECE 8

static void lay_out_lists(perp__arena *arena, void *object)
{
    perp__coloured *c = object;
    const size_t bodies = (size_t)c->most_bodies + PERP__COLOURED_PIECES;
    const size_t contacts = (size_t)c->most_contacts;

    PERP__DOUBLES(arena, 8 * bodies, &c->y, &c->free, &c->before, &c->moved);
    c->back = perp__arena_take(arena, bodies, sizeof *c->back);
    c->colours = perp__arena_take(arena, bodies, sizeof *c->colours);
    PERP__INTEGERS(arena, contacts, &c->pair_first, &c->pair_points, &c->pair_key, &c->pair_order);
}

static void lay_out_points(perp__arena *arena, void *object)
{
    perp__coloured *c = object;

    c->group = perp__arena_take(arena, (size_t)c->most_groups, sizeof *c->group);
    c->point = perp__arena_take(arena, (size_t)c->most_points, sizeof *c->point);
    c->piece_first = perp__arena_take(arena, (size_t)c->most_groups + 1, sizeof *c->piece_first);
}

static int32_t moves(const perp__rigid_problem *problem, int32_t body)
{
    return body >= 0 && body < problem->bodies;
}

/* Pairs by colour, the first one that neither body has, those of most points first, so that a
 * group's have about as many. Pairs without a colour come last. */
static void order_pairs(perp__coloured *c, const perp__rigid_problem *problem, int32_t pairs,
                        int32_t *starts)
{
    memset(c->colours, 0, (size_t)problem->bodies * sizeof *c->colours);
    memset(starts, 0, (KEYS + 2) * sizeof *starts);
    for (int32_t i = 0; i < pairs; i++) {
        const int32_t *body = problem->rows[c->pair_first[i]].body;
        uint64_t taken = 0;
        int32_t found = 0;

        for (int32_t side = 0; side < 2; side++)
            if (moves(problem, body[side]))
                taken |= c->colours[body[side]];
        while (~taken != 0 && taken >> found & 1)
            found++;
        for (int32_t side = 0; side < 2 && ~taken != 0; side++)
            if (moves(problem, body[side]))
                c->colours[body[side]] |= UINT64_C(1) << found;
        c->pair_key[i] =
            ~taken == 0 ? KEYS : PERP__PAIR_POINTS * found + PERP__PAIR_POINTS - c->pair_points[i];
        starts[c->pair_key[i] + 1]++;
    }
    for (int32_t i = 0; i <= KEYS; i++)
        starts[i + 1] += starts[i];
    for (int32_t i = 0; i < pairs; i++)
        c->pair_order[starts[c->pair_key[i]]++] = i;
    for (int32_t i = KEYS; i > 0; i--)
        starts[i] = starts[i - 1];
    starts[0] = 0;
}

/* Groups of what is ordered, colour by colour, with what has none last; with room for them, writes
 * them, and where pieces of so many points begin. */
static void form_groups(perp__coloured *c, const perp__rigid_problem *problem, int32_t pairs,
                        const int32_t *starts, int32_t size, int32_t writes)
{
    int32_t pieces = 0, last = -1, begun = 0, i = 0;

    c->groups = c->points = c->colour_count = 0;
    while (i < pairs) {
        const int32_t key = c->pair_key[c->pair_order[i]], now = key / PERP__PAIR_POINTS;
        const int32_t end = key == KEYS ? i + 1 : starts[(now + 1) * PERP__PAIR_POINTS];
        const int32_t count = end - i < PERP__GROUP ? end - i : PERP__GROUP;

        if (now != last)
            c->colour_first[c->colour_count++] = pieces;
        if (writes && (now != last || (c->points - begun >= size && key != KEYS))) {
            begun = c->points;
            c->piece_first[pieces++] = c->groups;
        }
        last = now;
        if (writes) { /* of the pairs from i on; what does not move is `none` of the piece */
            const int32_t none =
                problem->bodies + pieces - 1 - c->colour_first[c->colour_count - 1];
            perp__lane_group *group = &c->group[c->groups];

            group->pairs = count;
            group->first = c->points;
            group->points = c->pair_points[c->pair_order[i]];
            for (int32_t l = 0; l < PERP__GROUP; l++) {
                const int32_t pair = l < count ? c->pair_order[i + l] : -1;
                const int32_t *body = pair < 0 ? NULL : problem->rows[c->pair_first[pair]].body;

                group->a[l] = body && moves(problem, body[0]) ? body[0] : none;
                group->b[l] = body && moves(problem, body[1]) ? body[1] : none;
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
                      const perp__rigid_problem *problem, const perp__passes *step)
{
    const perp__rigid_rows *rows = &problem->rows[contact];
    const int32_t width = c->width;

    for (int32_t i = 0; i < rows->dim; i++) {
        p->w[i][lane] = rows->bias[i];
        p->r[i][lane] = p->last[i][lane] = problem->warm ? problem->warm[3 * contact + i] : 0.0;
    }
    if (rows->bounded) { /* its normal moves nothing, and bounds the row after it (law.h) */
        p->r[0][lane] = p->last[0][lane] = -rows->bias[0] / rows->compliance[0];
        p->w[0][lane] = 0.0;
    }
    for (int32_t side = 0; side < 2; side++) {
        const int32_t body = rows->body[side];
        const double *C = moves(problem, body) ? problem->factors + width * width * body : NULL;

        for (int32_t i = 0; i < rows->dim && body >= 0; i++) {
            double(*P)[PERP__GROUP] = (double(*)[PERP__GROUP]) & p->P[12 * i + 6 * side][lane];
            const double *J = rows->rows[side][i];

            if (!C) {
                for (int32_t k = 0; k < width; k++)
                    p->w[i][lane] += J[k] * problem->free[width * body + k];
            } else if (width == 6) {
                for (int32_t j = 0; j < 3; j++) {
                    P[j][0] = J[j] * C[0];
                    P[3 + j][0] = J[3] * C[21 + j] + J[4] * C[27 + j] + J[5] * C[33 + j];
                }
            } else {
                for (int32_t j = 0; j < 3; j++)
                    for (int32_t k = 0; k < 3; k++)
                        P[j][0] += J[k] * C[3 * k + j];
            }
        }
    }
    p->mu[lane] = rows->dim > 1 ? rows->mu : 0.0;
    p->gap[lane] = step->gap ? step->gap[contact] : 0.0;
    p->bias[lane] = p->w[0][lane] + (p->gap[lane] > 0.0 ? p->gap[lane] / step->h : 0.0);
    p->guard[lane] = step->gap ? step->guard[contact] : 0.0;
    p->contact[lane] = contact;
}

void perp__coloured_fill(perp__coloured *c, const perp__rigid_problem *problem,
                         const perp__passes *step, int32_t first, int32_t end)
{
    for (int32_t g = first; g < end; g++) {
        const perp__lane_group *group = &c->group[g];

        for (int32_t k = 0; k < group->points; k++) {
            perp__lane_point *p = &c->point[group->first + k];

            memset(p, 0, sizeof *p);
            for (int32_t l = 0; l < PERP__GROUP; l++) {
                const int32_t pair = group->pair[l];

                p->contact[l] = -1;
                if (pair >= 0 && k < c->pair_points[pair])
                    fill_lane(c, p, l, c->pair_first[pair] + k, problem, step);
            }
            c->kernels->invert(p);
        }
    }
}

perp_status perp__coloured_pack(perp__coloured *c, const perp__rigid_problem *problem)
{
    int32_t starts[KEYS + 2], pairs = 0, size;
    perp_status status;

    perp__raise_room(&c->most_bodies, problem->bodies);
    perp__raise_room(&c->most_contacts, problem->contacts);
    status = perp__arena_fit(&c->arena, c->context, lay_out_lists, c);
    if (status != PERP_OK)
        return status;
    c->bodies = problem->bodies;
    c->width = problem->width;
    /* 1. Pairs of at most four points, by colour. */
    for (int32_t k = 0, end; k < problem->contacts; k = end) {
        const int32_t *body = problem->rows[k].body;

        for (end = k + 1; end < problem->contacts && end < k + PERP__PAIR_POINTS &&
                          problem->rows[end].body[0] == body[0] &&
                          problem->rows[end].body[1] == body[1];)
            end++;
        c->pair_first[pairs] = k;
        c->pair_points[pairs++] = end - k;
    }
    order_pairs(c, problem, pairs, starts);
    /* 2. Groups of them, first counted. */
    form_groups(c, problem, pairs, starts, 0, 0);
    perp__raise_room(&c->most_groups, c->groups);
    perp__raise_room(&c->most_points, c->points);
    status = perp__arena_fit(&c->point_arena, c->context, lay_out_points, c);
    if (status != PERP_OK)
        return status;
    /* 3. A piece has all points of a colour, or so many at least that a colour has no more pieces
     * than there is room for. */
    c->is_large = c->points >= LARGE;
    c->rows = c->bodies + (c->is_large ? PERP__COLOURED_PIECES : 1);
    size = 1 + c->points / PERP__COLOURED_PIECES;
    size = !c->is_large ? INT32_MAX : size > PIECE ? size : PIECE;
    form_groups(c, problem, pairs, starts, size, 1);
    return PERP_OK;
}
