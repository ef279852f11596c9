/* The problem as the method sees it: scaled rows on bodies, part after part, and their graph. */
#include "contact/proximal/proximal.h"

#include <math.h>
#include <string.h>

static int32_t own_rows(const perp__contact_problem *problem, int32_t unit)
{
    if (unit >= problem->contacts)
        return 1;
    return problem->mu[unit] > 0.0 ? problem->dims[unit] : 1;
}

static int32_t first_row(const perp__contact_problem *problem, int32_t unit)
{
    return unit < problem->contacts ? problem->starts[unit]
                                    : problem->rows + unit - problem->contacts;
}

/* Edges of the graph at most: every pair of pieces of a unit, and the blocks themselves. */
static size_t edge_room(const perp__bodies *b)
{
    size_t room = (size_t)b->blocks;

    for (int32_t k = 0; k < b->units; k++) {
        const size_t pieces = (size_t)(b->piece_starts[k + 1] - b->piece_starts[k]);

        room += pieces * (pieces - 1);
    }
    return room;
}

void perp__proximal_layout(perp__arena *arena, void *work)
{
    perp__proximal *s = work;
    const perp__contact_problem *problem = s->common.problem;
    const perp__bodies *b = problem->bodies;
    const size_t units = (size_t)b->units, blocks = (size_t)b->blocks + 1, size = (size_t)b->size;
    const size_t edges = edge_room(b), numbers = blocks * (size_t)b->width;
    double **const rows[] = {&s->q,     &s->x,     &s->z,     &s->y,   &s->best,
                             &s->start, &s->speed, &s->spare, &s->pull};
    double **const velocities[] = {&s->v,    &s->step,  &s->image,  &s->way,   &s->rest,
                                   &s->bend, &s->ahead, &s->normal, &s->across};

    s->part = perp__arena_take(arena, (size_t)problem->parts + 1, sizeof *s->part);
    s->unit = perp__arena_take(arena, units, sizeof(int32_t));
    PERP__INTEGERS(arena, blocks, &s->block, &s->number);
    s->starts = perp__arena_take(arena, units + 1, sizeof(int32_t));
    PERP__DOUBLES(arena, units, &s->radius, &s->scale, &s->head);
    s->piece_starts = perp__arena_take(arena, units + 1, sizeof(int64_t));
    s->piece_blocks = perp__arena_take(arena, (size_t)b->pieces, sizeof(int32_t));
    s->value_starts = perp__arena_take(arena, units, sizeof(int64_t));
    s->values = perp__arena_take(arena, (size_t)b->entries, sizeof(double));
    s->slot_starts = perp__arena_take(arena, units, sizeof(int64_t));
    s->slots = perp__arena_take(arena, edges + (size_t)b->pieces, sizeof(int32_t));
    s->graph_starts = perp__arena_take(arena, blocks, sizeof(int32_t));
    s->graph = perp__arena_take(arena, edges, sizeof(int32_t));
    s->K = perp__arena_take(arena, 9 * units, sizeof(double));
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++)
        *rows[k] = perp__arena_take(arena, size, sizeof(double));
    for (size_t k = 0; k < sizeof velocities / sizeof *velocities; k++)
        *velocities[k] = perp__arena_take(arena, numbers, sizeof(double));
}

/* Units in the order of their parts. starts: counters. */
static void sort_units(perp__proximal *s)
{
    const perp__contact_problem *problem = s->common.problem;
    const int32_t *part = problem->leaks ? NULL : problem->part;

    s->parts = part ? problem->parts : s->units > 0;
    for (int32_t p = 0; p < s->parts; p++)
        s->part[p].last_unit = 0;
    for (int32_t k = 0; k < s->units; k++)
        s->part[part ? part[k] : 0].last_unit++;
    for (int32_t p = 0, at = 0; p < s->parts; p++) {
        s->part[p].unit = at;
        at += s->part[p].last_unit;
        s->part[p].last_unit = s->part[p].unit;
    }
    for (int32_t k = 0; k < s->units; k++)
        s->unit[s->part[part ? part[k] : 0].last_unit++] = k;
}

/* The pieces of a unit, scaled. */
static int64_t copy_pieces(perp__proximal *s, int32_t k, int64_t at)
{
    const perp__bodies *b = s->common.problem->bodies;
    const int32_t unit = s->unit[k], d = s->starts[k + 1] - s->starts[k], width = b->width;
    int64_t own = s->piece_starts[k];

    s->value_starts[k] = at;
    for (int64_t p = b->piece_starts[unit]; p < b->piece_starts[unit + 1]; p++) {
        const double *P = b->values + b->piece_values[p];

        s->piece_blocks[own++] = s->number[b->piece_blocks[p]];
        for (int32_t i = 0; i < d; i++)
            for (int32_t j = 0; j < width; j++)
                s->values[at++] = P[i * width + j] * (i == 0 ? s->head[k] : s->scale[k]);
    }
    s->piece_starts[k + 1] = own;
    return at;
}

/* Scales without the part's unit. */
static void set_scales(perp__proximal *s, int32_t k)
{
    const perp__contact_problem *problem = s->common.problem;
    const int32_t unit = s->unit[k];

    s->head[k] = s->scale[k] = 1.0 / sqrt(problem->trace[unit]);
    s->radius[k] = -1.0;
    if (unit >= problem->contacts)
        return;
    s->radius[k] = fmax(problem->mu[unit], 1.0);
    if (s->starts[k + 1] - s->starts[k] > 1)
        s->head[k] /= fmin(problem->mu[unit], 1.0);
}

/* Rows of one part after the other; blocks are numbered as they are met. */
static void read_rows(perp__proximal *s)
{
    const perp__contact_problem *problem = s->common.problem;
    const perp__bodies *b = problem->bodies;
    int64_t at = 0;

    for (int32_t i = 0; i < b->blocks; i++)
        s->number[i] = -1;
    s->blocks = s->starts[0] = 0;
    s->piece_starts[0] = 0;
    for (int32_t p = 0; p < s->parts; p++) {
        perp__proximal_part *part = &s->part[p];

        part->block = s->blocks;
        part->row = s->starts[part->unit];
        for (int32_t k = part->unit; k < part->last_unit; k++) {
            const int32_t unit = s->unit[k];

            s->starts[k + 1] = s->starts[k] + own_rows(problem, unit);
            for (int64_t q = b->piece_starts[unit]; q < b->piece_starts[unit + 1]; q++)
                if (s->number[b->piece_blocks[q]] < 0) {
                    s->block[s->blocks] = b->piece_blocks[q];
                    s->number[b->piece_blocks[q]] = s->blocks++;
                }
            set_scales(s, k);
            at = copy_pieces(s, k, at);
        }
        part->last_block = s->blocks;
        part->last_row = s->starts[part->last_unit];
    }
}

static void sort(int32_t *x, int32_t count)
{
    for (int32_t i = 1; i < count; i++) {
        const int32_t moved = x[i];
        int32_t j = i;

        for (; j > 0 && x[j - 1] > moved; j--)
            x[j] = x[j - 1];
        x[j] = moved;
    }
}

/* Which blocks share a unit; slots: marks. */
static void read_graph(perp__proximal *s)
{
    const perp__bodies *b = s->common.problem->bodies;
    int32_t *mark = s->slots;
    int32_t at = 0;

    for (int32_t i = 0; i < s->blocks; i++)
        mark[i] = -1;
    for (int32_t i = 0; i < s->blocks; i++) {
        const int32_t block = s->block[i];

        s->graph_starts[i] = at;
        mark[i] = i;
        s->graph[at++] = i;
        for (int64_t e = b->block_starts[block]; e < b->block_starts[block + 1]; e++) {
            const int32_t unit = b->block_units[e];

            for (int64_t p = b->piece_starts[unit]; p < b->piece_starts[unit + 1]; p++) {
                const int32_t j = s->number[b->piece_blocks[p]];

                if (mark[j] != i)
                    s->graph[at++] = j;
                mark[j] = i;
            }
        }
        sort(s->graph + s->graph_starts[i], at - s->graph_starts[i]);
    }
    s->graph_starts[s->blocks] = at;
}

static void find_slots(perp__proximal *s)
{
    int64_t at = 0;

    for (int32_t k = 0; k < s->units; k++) {
        s->slot_starts[k] = at;
        for (int64_t q = s->piece_starts[k]; q < s->piece_starts[k + 1]; q++)
            for (int64_t p = s->piece_starts[k]; p < s->piece_starts[k + 1]; p++)
                s->slots[at++] =
                    perp__fronts_edge(&s->fronts, s->piece_blocks[p], s->piece_blocks[q]);
    }
}

static void read_speeds(perp__proximal *s)
{
    const perp__contact_problem *problem = s->common.problem;

    for (int32_t k = 0; k < s->units; k++) {
        const double omega = problem->omega[s->unit[k]];
        const double *q = problem->q + first_row(problem, s->unit[k]) - s->starts[k];

        for (int32_t i = s->starts[k]; i < s->starts[k + 1]; i++)
            s->q[i] = q[i] / omega * (i == s->starts[k] ? s->head[k] : s->scale[k]);
    }
}

perp_status perp__proximal_read(perp__proximal *s)
{
    const perp__contact_problem *problem = s->common.problem;
    perp_status status;

    s->width = problem->bodies->width;
    s->units = problem->bodies->units;
    sort_units(s);
    read_rows(s);
    read_speeds(s);
    read_graph(s);
    status = perp__fronts_analyse(&s->fronts, problem->context, s->blocks, s->width,
                                  s->graph_starts, s->graph);
    if (status == PERP_OK)
        find_slots(s);
    return status;
}

void perp__proximal_load(const perp__proximal *s, const perp__proximal_part *part, const double *r,
                         double *x)
{
    const perp__contact_problem *problem = s->common.problem;

    for (int32_t k = part->unit; k < part->last_unit; k++) {
        const double omega = problem->omega[s->unit[k]];
        const double *from = r + first_row(problem, s->unit[k]);

        for (int32_t i = s->starts[k]; i < s->starts[k + 1]; i++)
            x[i] = from[i - s->starts[k]] / omega / (i == s->starts[k] ? s->head[k] : s->scale[k]);
    }
}

void perp__proximal_store(const perp__proximal *s, const perp__proximal_part *part, const double *x,
                          double *r)
{
    const perp__contact_problem *problem = s->common.problem;

    for (int32_t k = part->unit; k < part->last_unit; k++) {
        const double omega = problem->omega[s->unit[k]];
        double *to = r + first_row(problem, s->unit[k]);

        for (int32_t i = s->starts[k]; i < s->starts[k + 1]; i++)
            to[i - s->starts[k]] = x[i] * omega * (i == s->starts[k] ? s->head[k] : s->scale[k]);
    }
}
