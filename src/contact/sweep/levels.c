/* A first guess for what rests on the ground: level by level from the top, each body settles on
 * those below it as if they were fixed, and hands its load on to them. Where all come to rest the
 * guess is a solution, whatever the height, while sweeps carry the news of the load through a pile
 * of n levels in the order of n^2 of them. (Cf. shock propagation: Guendelman, Bridson & Fedkiw,
 * ACM Trans. Graph. 22 (2003) 871, from the ground up.)
 *
 * A body's level is how many supports are below it, at least: a contact supports a body if the
 * free body would move into the other one, stopped. */
#include <math.h>
#include <string.h>

#include "contact/sweep/local_step.h"
#include "contact/sweep/packed.h"

/* The contacts of a level go round at most so often, until they change by so much of tol: first
 * without friction, because friction in the first rounds would leave bodies that are wedged in for
 * no reason, and these drive others apart. */
#define ROUNDS_SMOOTH 20
#define ROUNDS_MOST 30
#define ACCURACY 0.1

void perp__levels_layout(perp__arena *arena, perp__levels *levels, const perp__bodies *b)
{
    const size_t blocks = (size_t)b->blocks + 1, contacts = (size_t)b->contacts;

    PERP__INTEGERS(arena, blocks, &levels->of_block, &levels->queue);
    levels->starts = perp__arena_take(arena, blocks + 2, sizeof *levels->starts);
    levels->contacts = perp__arena_take(arena, contacts, sizeof *levels->contacts);
    levels->rest = perp__arena_take(arena, blocks * PERP__PACKED_WIDTH, sizeof(double));
}

/* Normal velocity of a packed contact with its block 1 - which stopped, block `which` free. */
static double approach(const perp__sweep_work *work, const perp__packed_contact *c, int32_t which)
{
    const double *y = work->levels.rest + (size_t)c->blocks[1 - which] * PERP__PACKED_WIDTH;
    double sum = c->q[0];

    for (int32_t j = 0; j < PERP__PACKED_WIDTH; j++)
        sum += c->P[perp__packed_place(1 - which, j)] * y[j];
    return sum;
}

/* Levels by breadth-first search from the ground, 0; -1: no support. Returns the highest. */
static int32_t find_levels(perp__sweep_work *work)
{
    const perp__bodies *b = work->common.problem->bodies;
    perp__levels *levels = &work->levels;
    int32_t tail = 0, most = 0;

    for (int32_t i = 0; i < b->blocks; i++)
        levels->of_block[i] = -1;
    levels->of_block[b->blocks] = 0; /* the ground */
    for (int32_t k = 0; k < b->contacts; k++) {
        const perp__packed_contact *c = &work->packed[k];
        const int32_t block = c->blocks[0];

        if (c->blocks[1] == b->blocks && block < b->blocks && levels->of_block[block] < 0 &&
            approach(work, c, 0) < 0.0) {
            levels->of_block[block] = 1;
            levels->queue[tail++] = block;
        }
    }
    for (int32_t head = 0; head < tail; head++) {
        const int32_t block = levels->queue[head];

        most = levels->of_block[block];
        for (int64_t at = b->block_starts[block]; at < b->block_starts[block + 1]; at++) {
            const perp__packed_contact *c = &work->packed[b->block_constraints[at]];
            const int32_t which = c->blocks[0] == block, other = c->blocks[which];

            if (levels->of_block[other] < 0 && approach(work, c, which) < 0.0) {
                levels->of_block[other] = most + 1;
                levels->queue[tail++] = other;
            }
        }
    }
    return most;
}

static int32_t level_of(const perp__levels *levels, const perp__packed_contact *c)
{
    const int32_t a = levels->of_block[c->blocks[0]], b = levels->of_block[c->blocks[1]];

    return a < 0 || b < 0 ? 0 : a > b ? a : b;
}

/* d := the step from x, given u; both in the packed contact's frame, not the local one's. */
PERP__KERNEL static void step_turned(perp__local *local, const double *u, const double *x,
                                     double *d)
{
    const double *t = local->turn;
    const double v[3] = {u[0], t[0] * u[1] + t[1] * u[2], t[0] * u[2] - t[1] * u[1]};
    double r[3] = {x[0], t[0] * x[1] + t[1] * x[2], t[0] * x[2] - t[1] * x[1]};

    if (local->dim == 2)
        perp__step_2(local, v, r);
    else
        perp__step_3(local, v, r);
    d[0] = r[0] - x[0];
    d[1] = t[0] * r[1] - t[1] * r[2] - x[1];
    d[2] = t[0] * r[2] + t[1] * r[1] - x[2];
}

/* One round of a level's contacts against what is fixed. Raises *most to the largest weighted
 * square of a change. Blocks that are fixed are read from `rest`, and what is pushed into them is
 * dropped. */
PERP__MULTIVERSION(settle,
                   (perp__sweep_work * work, const int32_t *contacts, int32_t count, int32_t level,
                    double *most),
                   (work, contacts, count, level, most))
{
    const int32_t *of_block = work->levels.of_block;

    for (int32_t i = 0; i < count; i++) {
        const int32_t k = contacts[i], dim = work->rows[k + 1] - work->rows[k];
        const perp__packed_contact *c = &work->packed[k];
        double *r = work->r + work->rows[k], nowhere[2][PERP__PACKED_WIDTH], *block[2];
        double x[3] = {r[0], dim > 1 ? r[1] : 0.0, dim > 2 ? r[2] : 0.0}, u[3], d[3];

        for (int32_t which = 0; which < 2; which++) {
            const size_t at = (size_t)c->blocks[which] * PERP__PACKED_WIDTH;

            block[which] = work->y + at;
            if (of_block[c->blocks[which]] == level)
                continue;
            block[which] = nowhere[which];
            memcpy(nowhere[which], work->levels.rest + at, sizeof nowhere[which]);
        }
        perp__packed_velocity(c, block[0], block[1], x, u);
        step_turned(&work->local[k], u, x, d);
        for (int32_t j = 0; j < dim; j++)
            r[j] += d[j];
        *most = fmax(*most, c->weight * (d[0] * d[0] + (d[1] * d[1] + d[2] * d[2])));
        perp__packed_push(c, d, block[0], block[1]);
    }
}

/* The level's contacts, by themselves: each with its own problem where only blocks of this level
 * can move. What they do to lower ones is handed on. */
static void settle_level(perp__sweep_work *work, int32_t level)
{
    const perp__levels *levels = &work->levels;
    const double enough = ACCURACY * work->common.problem->tol;
    const int32_t *contacts = levels->contacts + levels->starts[level];
    const int32_t count = levels->starts[level + 1] - levels->starts[level];

    for (int32_t n = 0; n < count; n++) {
        const perp__packed_contact *c = &work->packed[contacts[n]];
        const int32_t dim = c->local.dim;
        double W[9];

        for (int32_t i = 0; i < dim; i++)
            for (int32_t j = 0; j < dim; j++) {
                const double *P = c->P + i * PERP__PACKED_ROW, *Q = c->P + j * PERP__PACKED_ROW;
                double sum = i == j ? c->compliance[i > 0] : 0.0;

                for (int32_t which = 0; which < 2; which++)
                    for (int32_t l = 0;
                         levels->of_block[c->blocks[which]] == level && l < PERP__PACKED_WIDTH; l++)
                        sum += P[perp__packed_place(which, l)] * Q[perp__packed_place(which, l)];
                W[i * dim + j] = sum;
            }
        perp__local_make(&work->local[contacts[n]], dim, W, dim, c->local.mu);
    }
    for (int32_t smooth = 1; smooth >= 0; smooth--) {
        const int32_t rounds = smooth ? ROUNDS_SMOOTH : ROUNDS_MOST;
        double change = INFINITY;

        for (int32_t n = 0; n < count; n++)
            work->local[contacts[n]].mu = smooth ? 0.0 : work->packed[contacts[n]].local.mu;
        for (int32_t round = 0; round < rounds && change > enough * enough; round++) {
            change = 0.0;
            settle(work, contacts, count, level, &change);
        }
    }
    for (int32_t n = 0; n < count; n++) {
        const perp__packed_contact *c = &work->packed[contacts[n]];
        const double *r = work->r + work->rows[contacts[n]];

        for (int32_t which = 0; which < 2; which++) {
            const int32_t block = c->blocks[which];
            double *y = work->y + (size_t)block * PERP__PACKED_WIDTH;

            for (int32_t l = 0; l < PERP__PACKED_WIDTH && levels->of_block[block] != level &&
                                block != work->common.problem->bodies->blocks;
                 l++)
                for (int32_t i = 0; i < c->local.dim; i++)
                    y[l] += c->P[i * PERP__PACKED_ROW + perp__packed_place(which, l)] * r[i];
        }
        work->local[contacts[n]] = c->local;
    }
}

void perp__sweep_settle(perp__sweep_work *work)
{
    const perp__bodies *b = work->common.problem->bodies;
    perp__levels *levels = &work->levels;
    int32_t most;

    /* 1. No impulses. */
    memset(work->r, 0, (size_t)work->size * sizeof *work->r);
    perp__bodies_find_free(b);
    memset(work->y, 0, (size_t)b->blocks * PERP__PACKED_WIDTH * sizeof *work->y);
    memset(levels->rest, 0, (size_t)(b->blocks + 1) * PERP__PACKED_WIDTH * sizeof *levels->rest);
    for (int32_t i = 0; i < b->blocks; i++)
        for (int32_t j = 0; j < b->width; j++)
            levels->rest[i * PERP__PACKED_WIDTH + j] = -b->free[i * b->width + j];
    /* 2. Contacts in the order of their levels; those without support come first. */
    most = find_levels(work);
    memset(levels->starts, 0, ((size_t)most + 2) * sizeof *levels->starts);
    for (int32_t k = 0; k < b->contacts; k++)
        levels->starts[level_of(levels, &work->packed[k]) + 1]++;
    for (int32_t level = 0; level <= most; level++)
        levels->starts[level + 1] += levels->starts[level];
    for (int32_t k = 0; k < b->contacts; k++)
        levels->contacts[levels->starts[level_of(levels, &work->packed[k])]++] = k;
    memmove(levels->starts + 1, levels->starts, ((size_t)most + 1) * sizeof *levels->starts);
    levels->starts[0] = 0;
    /* 3. From the top. */
    for (int32_t level = most; level > 0; level--)
        settle_level(work, level);
}
