/* What bodies joined by rows that hold, none of them held by what is held alone, leave free of each
 * other: a dense system a cluster. */
#include <math.h>
#include <string.h>

#include "base/groups.h"
#include "contact/hold/clusters.h"

/* Joins what is not held by rows that hold; members: by cluster, in the order of the first of
 * each. */
static void find_clusters(perp__hold *h)
{
    const perp__bodies *b = h->bodies;
    int32_t *count = h->queue, sum = 0; /* no longer needed */

    for (int32_t k = 0; k < b->blocks; k++)
        h->cluster[k] = k;
    for (int32_t k = 0; k < b->units; k++) {
        int32_t last = -1;

        for (int64_t at = b->piece_starts[k]; h->holds[k] > 0 && at < b->piece_starts[k + 1];
             at++) {
            const int32_t block = b->piece_blocks[at];

            if (h->is_held[block])
                continue;
            if (last >= 0)
                perp__join(h->cluster, last, block);
            last = block;
        }
    }
    for (int32_t k = 0; k <= b->blocks; k++)
        count[k] = 0;
    for (int32_t k = 0; k < b->blocks; k++) {
        h->cluster[k] = perp__root_of(h->cluster, k);
        count[h->cluster[k]] += !h->is_held[k];
    }
    for (int32_t k = 0; k < b->blocks; k++) { /* now: where the cluster begins */
        const int32_t size = count[k];

        count[k] = sum;
        sum += size;
    }
    for (int32_t k = 0; k < b->blocks; k++)
        if (!h->is_held[k])
            h->members[count[h->cluster[k]]++] = k;
}

/* Whether the rows of a unit that is met at this piece are taken up here: at the first of its open
 * blocks, which are all of the cluster; and not where one block alone is asked about that others
 * are to be held with. */
static int32_t is_taken(const perp__hold *h, int32_t unit, int64_t piece, int32_t count)
{
    int64_t first = piece;
    const int32_t open = perp__hold_count_open(h, unit, &first);

    return first == piece && (open == 1 || count > 1);
}

/* Appends row i of the unit, unless it is 0. */
static void add_row(perp__hold *h, int32_t unit, int32_t i)
{
    const perp__bodies *b = h->bodies;
    double *row = perp__held_rows_next(&h->dense), target = -h->bias[b->rows[unit] + i];

    memset(row, 0, (size_t)h->dense.n * sizeof *row);
    h->taken_up++;
    for (int64_t piece = b->piece_starts[unit]; piece < b->piece_starts[unit + 1]; piece++) {
        const double *P = b->values + b->piece_values[piece] + i * b->width;
        const int32_t block = b->piece_blocks[piece];

        if (h->is_held[block])
            target -= perp__dot(P, h->y + (size_t)block * (size_t)b->width, b->width);
        else
            memcpy(row + h->cluster[block], P,
                   (size_t)perp__bodies_unknowns(b, block) * sizeof *row);
    }
    perp__held_rows_take(&h->dense, target);
}

/* First the normals, then the tangents: of rows that serve equally well the first are taken. */
static void gather(perp__hold *h, const int32_t *members, int32_t count)
{
    const perp__bodies *b = h->bodies;

    for (int32_t tangents = 0; tangents < 2; tangents++)
        for (int32_t m = 0; m < count; m++)
            for (int64_t at = b->block_starts[members[m]]; at < b->block_starts[members[m] + 1];
                 at++) {
                const int32_t unit = b->block_units[at];

                if (!is_taken(h, unit, b->block_pieces[at], count))
                    continue;
                for (int32_t i = tangents; i < (tangents ? h->holds[unit] : h->holds[unit] > 0);
                     i++)
                    add_row(h, unit, i);
            }
}

/* loose := C^-1 v_free + what does not hold */
static void add_loose(perp__hold *h, const int32_t *members, int32_t count)
{
    const perp__bodies *b = h->bodies;
    const int32_t width = b->width;

    for (int32_t m = 0; m < count; m++) {
        double y[PERP__BODY_WIDTH_MOST];

        perp__bodies_own_free(b, members[m], y);
        for (int64_t at = b->block_starts[members[m]]; at < b->block_starts[members[m] + 1]; at++) {
            const int32_t unit = b->block_units[at], rows = b->rows[unit + 1] - b->rows[unit];
            const double *P = b->values + b->piece_values[b->block_pieces[at]];

            for (int32_t i = h->holds[unit]; i < rows; i++)
                for (int32_t j = 0; j < width; j++)
                    y[j] += P[i * width + j] * h->r[b->rows[unit] + i];
        }
        memcpy(h->loose + h->cluster[members[m]], y,
               (size_t)perp__bodies_unknowns(b, members[m]) * sizeof *y);
    }
}

/* Whether the rows determine coordinate i of a block, and those alone whose targets are 0. */
static int32_t is_at_rest(perp__hold *h, int32_t block, int32_t i)
{
    const int32_t count = perp__bodies_unknowns(h->bodies, block);
    double *unit = h->dense.unit + h->cluster[block], x[PERP__BODY_WIDTH_MOST], length;

    memset(h->dense.unit, 0, (size_t)h->dense.n * sizeof *h->dense.unit);
    perp__bodies_own_row(h->bodies, block, i, x);
    length = sqrt(perp__dot(x, x, count));
    for (int32_t k = 0; k < count; k++)
        unit[k] = x[k] / length;
    return perp__held_rows_fix(&h->dense, h->cluster[block], count);
}

/* to := the columns of a block, padded. */
static void pad(const perp__hold *h, int32_t block, const double *columns, double *to)
{
    const int32_t count = perp__bodies_unknowns(h->bodies, block);

    memcpy(to, columns + h->cluster[block], (size_t)count * sizeof *to);
    for (int32_t i = count; i < h->bodies->width; i++)
        to[i] = 0.0;
}

/* What the rows leave free, and exact zeros in single coordinates. */
static void move(perp__hold *h, const int32_t *members, int32_t count)
{
    add_loose(h, members, count);
    perp__held_rows_free(&h->dense, h->loose);
    for (int32_t m = 0; m < count; m++) {
        double *v = h->v + (size_t)members[m] * (size_t)h->bodies->width;
        double y[PERP__BODY_WIDTH_MOST];

        pad(h, members[m], h->loose, y);
        perp__bodies_from_own(h->bodies, members[m], y, v);
        for (int32_t i = 0; i < perp__bodies_unknowns(h->bodies, members[m]); i++)
            if (v[i] == 0.0 || is_at_rest(h, members[m], i))
                v[i] = 0.0; /* never -0.0 */
    }
}

/* Rows of full rank: the targets alone say how fast. */
static void hold_members(perp__hold *h, const int32_t *members, int32_t count)
{
    const int32_t width = h->bodies->width;
    int32_t rests = 1;

    for (int32_t i = 0; i < h->dense.n; i++)
        rests &= h->dense.particular[i] == 0.0;
    for (int32_t m = 0; m < count; m++) {
        const size_t at = (size_t)members[m] * (size_t)width;

        pad(h, members[m], h->dense.particular, h->y + at);
        if (rests)
            memset(h->v + at, 0, (size_t)width * sizeof(double));
        else
            perp__bodies_from_own(h->bodies, members[m], h->y + at, h->v + at);
        h->root[members[m]] = rests ? PERP__RIGID_AT_REST : members[m];
        h->is_held[members[m]] = 1;
    }
}

/* All rows of a cluster lead to one carrier: 1, and the members move with it. */
static int32_t carry_members(perp__hold *h, const int32_t *members, int32_t count)
{
    const perp__bodies *b = h->bodies;
    int32_t root = UNSET;

    for (int32_t m = 0; m < count; m++)
        for (int64_t at = b->block_starts[members[m]]; at < b->block_starts[members[m] + 1]; at++) {
            const int32_t unit = b->block_units[at];
            int64_t piece = 0;
            int32_t leads;

            if (h->holds[unit] == 0)
                continue;
            if (h->pushed[unit])
                return 0;
            if (perp__hold_count_open(h, unit, &piece) > 1) /* within the cluster */
                continue;
            leads = perp__hold_root_beside(h, unit, members[m]);
            if (leads == SEVERAL || (root != UNSET && !perp__hold_is_same(h, root, leads)))
                return 0;
            root = leads;
        }
    for (int32_t m = 0; m < count; m++)
        if (root == UNSET || !perp__hold_carry(h, members[m], root))
            return 0;
    for (int32_t m = 0; m < count; m++)
        perp__hold_follow(h, members[m], root);
    return 1;
}

/* Rows that a cluster can have. */
static int32_t count_rows(const perp__hold *h, const int32_t *members, int32_t count)
{
    const perp__bodies *b = h->bodies;
    int32_t rows = 0;

    for (int32_t m = 0; m < count; m++)
        for (int64_t at = b->block_starts[members[m]]; at < b->block_starts[members[m] + 1]; at++)
            if (is_taken(h, b->block_units[at], b->block_pieces[at], count))
                rows += h->holds[b->block_units[at]];
    return rows;
}

void perp__hold_solve_cluster(perp__hold *h, const int32_t *members, int32_t count)
{
    const int32_t most = count_rows(h, members, count);
    int32_t n = 0;

    for (int32_t m = 0; m < count; m++)
        n += perp__bodies_unknowns(h->bodies, members[m]);
    if (most == 0 ||
        (count > 1 && (n > PERP__HOLD_COLUMNS || (double)most * n * n > PERP__HOLD_PRODUCTS)))
        return;
    n = 0;
    for (int32_t m = 0; m < count; m++) {
        h->cluster[members[m]] = n;
        n += perp__bodies_unknowns(h->bodies, members[m]);
    }
    perp__held_rows_begin(&h->dense, n);
    gather(h, members, count);
    perp__held_rows_solve(&h->dense);
    if (h->dense.rank < n)
        move(h, members, count);
    else if (!carry_members(h, members, count))
        hold_members(h, members, count);
}

void perp__hold_solve_clusters(perp__hold *h)
{
    const int32_t blocks = h->bodies->blocks;
    int32_t first = 0, free_blocks = 0;

    find_clusters(h);
    for (int32_t k = 0; k < blocks; k++)
        free_blocks += !h->is_held[k];
    while (first < free_blocks) {
        const int32_t cluster = h->cluster[h->members[first]];
        int32_t end = first + 1;

        while (end < free_blocks && h->cluster[h->members[end]] == cluster)
            end++;
        perp__hold_solve_cluster(h, h->members + first, end - first);
        first = end;
    }
}
