#include <math.h>
#include <string.h>

#include "base/groups.h"
#include "contact/hold/hold.h"

static void lay_out(perp__arena *arena, void *object)
{
    perp__hold *h = object;
    const size_t blocks = (size_t)h->bodies->blocks, constraints = (size_t)h->bodies->constraints;
    const size_t width = (size_t)h->bodies->width;

    h->holds = perp__arena_take(arena, constraints, sizeof *h->holds);
    h->pushed = perp__arena_take(arena, constraints, sizeof *h->pushed);
    h->beside = perp__arena_take(arena, constraints, sizeof *h->beside);
    PERP__DOUBLES(arena, blocks * width, &h->v, &h->y);
    h->basis = perp__arena_take(arena, blocks, width * width * sizeof *h->basis);
    h->rank = perp__arena_take(arena, blocks, sizeof *h->rank);
    h->is_held = perp__arena_take(arena, blocks, sizeof *h->is_held);
    PERP__INTEGERS(arena, blocks + 1, &h->root, &h->source, &h->queue, &h->cluster, &h->members);
    perp__active_rows_layout(&h->dense, arena, h->room_entries, h->room_rows, h->room_columns);
    h->loose = perp__arena_take(arena, h->room_columns, sizeof(double));
}

perp_status perp__hold_fit(perp__hold *h, const perp__bodies *b)
{
    const size_t blocks = (size_t)b->blocks, width = (size_t)b->width;
    const int32_t n = b->blocks * b->width, most = n < PERP__HOLD_COLUMNS ? n : PERP__HOLD_COLUMNS;
    int32_t single = 0, least = b->width;
    double shared;

    /* the most that a cluster may need, of two blocks at least or of one, whatever holds */
    for (int32_t k = 0; k < b->blocks; k++) {
        int32_t rows = 0;

        for (int64_t at = b->block_starts[k]; at < b->block_starts[k + 1]; at++)
            rows += b->rows[b->block_constraints[at] + 1] - b->rows[b->block_constraints[at]];
        single = rows > single ? rows : single;
        least = perp__bodies_unknowns(b, k) < least ? perp__bodies_unknowns(b, k) : least;
    }
    shared = fmin((double)b->size * most, PERP__HOLD_PRODUCTS / (2.0 * least));
    h->bodies = b;
    h->room_rows = (size_t)b->size;
    h->room_columns = most > b->width ? (size_t)most : width;
    h->room_entries = (size_t)fmax(shared, (double)single * b->width);
    return perp__arena_fit_sizes(&h->arena, b->context, lay_out, h, h->fitted,
                                 (size_t[]){(size_t)b->constraints, blocks, blocks * width * width,
                                            h->room_rows, h->room_columns, h->room_entries},
                                 6);
}

/* ---- carriers -------------------------------------------------------------------------------- */

static bool turns(const perp__rigid_problem *p, const double *twist)
{
    const int32_t linear = p->width == 3 ? 2 : 3;

    for (int32_t i = linear; i < p->width; i++)
        if (twist[i] != 0.0)
            return 1;
    return 0;
}

/* The twist of a carrier, or of a block that is held. */
static const double *twist_of(const perp__hold *h, int32_t root)
{
    return (root < h->bodies->blocks ? h->v : h->rigid->free) +
           (size_t)root * (size_t)h->bodies->width;
}

/* Whether two roots move as one body: the same one, or translations with the same velocity. */
static bool is_same(const perp__hold *h, int32_t a, int32_t b)
{
    if (a == b || a < h->bodies->blocks || b < h->bodies->blocks)
        return a == b;
    return !turns(h->rigid, twist_of(h, a)) && !turns(h->rigid, twist_of(h, b)) &&
           memcmp(twist_of(h, a), twist_of(h, b),
                  (size_t)(h->bodies->width == 3 ? 2 : 3) * sizeof(double)) == 0;
}

/* v of a block := the rigid motion of `root` where it is. Returns 0 where that is not known. */
static bool carry(perp__hold *h, int32_t block, int32_t root)
{
    const int32_t width = h->bodies->width, linear = width == 3 ? 2 : 3;
    double *v = h->v + (size_t)block * (size_t)width, arm[3] = {0.0, 0.0, 0.0};
    const double *twist, *turn;

    memset(v, 0, (size_t)width * sizeof *v);
    if (root == PERP__RIGID_AT_REST)
        return 1;
    if (!h->rigid)
        return 0;
    twist = twist_of(h, root);
    turn = twist + linear;
    if (turns(h->rigid, twist)) {
        if (!h->rigid->origins)
            return 0;
        for (int32_t i = 0; i < linear; i++)
            arm[i] = h->rigid->origins[3 * block + i] - h->rigid->origins[3 * root + i];
    }
    memcpy(v, twist, (size_t)width * sizeof *v);
    if (linear == 2) {
        v[0] -= turn[0] * arm[1];
        v[1] += turn[0] * arm[0];
    } else {
        for (int32_t i = 0; i < 3; i++)
            v[i] += turn[(i + 1) % 3] * arm[(i + 2) % 3] - turn[(i + 2) % 3] * arm[(i + 1) % 3];
    }
    for (int32_t i = 0; i < width; i++)
        v[i] += 0.0; /* never -0.0 */
    return 1;
}

/* A block whose v is that of a root is held. */
static void follow(perp__hold *h, int32_t block, int32_t root)
{
    const size_t width = (size_t)h->bodies->width, at = (size_t)block * width;

    if (root == PERP__RIGID_AT_REST)
        memset(h->y + at, 0, width * sizeof *h->y);
    else
        perp__bodies_to_own(h->bodies, block, h->v + at, h->y + at);
    h->root[block] = root;
    h->is_held[block] = 1;
}

/* How many of the constraint's blocks are not held; *piece: the first of these. */
static int32_t count_open(const perp__hold *h, int32_t constraint, int64_t *piece)
{
    const perp__bodies *b = h->bodies;
    int32_t count = 0;

    for (int64_t at = b->piece_starts[constraint + 1]; at-- > b->piece_starts[constraint];)
        if (!h->is_held[b->piece_blocks[at]]) {
            *piece = at;
            count++;
        }
    return count;
}

/* What the constraint's other blocks, all held, move with: SEVERAL, where it is not one thing, or
 * one of them is stopped in part. */
static int32_t root_beside(const perp__hold *h, int32_t constraint, int32_t block)
{
    const perp__bodies *b = h->bodies;
    int32_t root = h->beside[constraint], count = 0;

    for (int64_t at = b->piece_starts[constraint]; at < b->piece_starts[constraint + 1]; at++) {
        const int32_t other = b->piece_blocks[at];

        if (other == block)
            continue;
        if (h->root[other] == PERP__RIGID_FREE ||
            (count++ > 0 && !is_same(h, root, h->root[other])))
            return PERP__HOLD_SEVERAL;
        root = h->root[other];
    }
    return root;
}

/* ---- clusters: what bodies joined by rows that hold, none of them held by what is held alone,
 * leave free of each other ---- */

/* Whether the rows of a constraint that is met at this piece are taken up here: at the first of its
 * open blocks, which are all of the cluster; and not where one block alone is asked about that
 * others are to be held with. */
static bool is_taken(const perp__hold *h, int32_t constraint, int64_t piece, int32_t count)
{
    int64_t first = piece;
    const int32_t open = count_open(h, constraint, &first);

    return first == piece && (open == 1 || count > 1);
}

/* Appends row i of the constraint, unless it is 0. */
static void add_row(perp__hold *h, int32_t constraint, int32_t i)
{
    const perp__bodies *b = h->bodies;
    double *row = perp__active_rows_next(&h->dense), target = -h->bias[b->rows[constraint] + i];

    memset(row, 0, (size_t)h->dense.n * sizeof *row);
    h->taken_up++;
    for (int64_t piece = b->piece_starts[constraint]; piece < b->piece_starts[constraint + 1];
         piece++) {
        const double *P = b->values + b->piece_values[piece] + i * b->width;
        const int32_t block = b->piece_blocks[piece];

        if (h->is_held[block])
            target -= perp__dot(P, h->y + (size_t)block * (size_t)b->width, b->width);
        else
            memcpy(row + h->cluster[block], P,
                   (size_t)perp__bodies_unknowns(b, block) * sizeof *row);
    }
    perp__active_rows_add(&h->dense, target);
}

/* First the normals, then the tangents: of rows that serve equally well the first are taken. */
static void gather(perp__hold *h, const int32_t *members, int32_t count)
{
    const perp__bodies *b = h->bodies;

    for (int32_t tangents = 0; tangents < 2; tangents++)
        for (int32_t m = 0; m < count; m++)
            for (int64_t at = b->block_starts[members[m]]; at < b->block_starts[members[m] + 1];
                 at++) {
                const int32_t constraint = b->block_constraints[at];

                if (!is_taken(h, constraint, b->block_pieces[at], count))
                    continue;
                for (int32_t i = tangents;
                     i < (tangents ? h->holds[constraint] : h->holds[constraint] > 0); i++)
                    add_row(h, constraint, i);
            }
}

static void find_loose(perp__hold *h, const int32_t *members, int32_t count)
{
    const perp__bodies *b = h->bodies;
    const int32_t width = b->width;

    for (int32_t m = 0; m < count; m++) {
        double y[PERP__BODY_WIDTH_MOST];

        perp__bodies_own_free(b, members[m], y);
        for (int64_t at = b->block_starts[members[m]]; at < b->block_starts[members[m] + 1]; at++) {
            const int32_t constraint = b->block_constraints[at],
                          rows = b->rows[constraint + 1] - b->rows[constraint];
            const double *P = b->values + b->piece_values[b->block_pieces[at]];

            for (int32_t i = h->holds[constraint]; i < rows; i++)
                for (int32_t j = 0; j < width; j++)
                    y[j] += P[i * width + j] * h->r[b->rows[constraint] + i];
        }
        memcpy(h->loose + h->cluster[members[m]], y,
               (size_t)perp__bodies_unknowns(b, members[m]) * sizeof *y);
    }
}

/* to := the columns of a block, padded. */
static void pad(const perp__hold *h, int32_t block, const double *columns, double *to)
{
    const int32_t count = perp__bodies_unknowns(h->bodies, block);

    memcpy(to, columns + h->cluster[block], (size_t)count * sizeof *to);
    for (int32_t i = count; i < h->bodies->width; i++)
        to[i] = 0.0;
}

/* What the rows leave free, and exact zeros in single coordinates: those that the rows determine,
 * and those alone whose targets are 0. */
static void move(perp__hold *h, const int32_t *members, int32_t count)
{
    find_loose(h, members, count);
    perp__active_rows_free(&h->dense, h->loose);
    for (int32_t m = 0; m < count; m++) {
        const int32_t block = members[m], n = perp__bodies_unknowns(h->bodies, block);
        double *v = h->v + (size_t)block * (size_t)h->bodies->width;
        double *unit = h->dense.unit + h->cluster[block], x[PERP__BODY_WIDTH_MOST];

        pad(h, block, h->loose, x);
        perp__bodies_from_own(h->bodies, block, x, v);
        for (int32_t i = 0; i < n; i++) {
            if (v[i] != 0.0) {
                double length;

                memset(h->dense.unit, 0, (size_t)h->dense.n * sizeof *h->dense.unit);
                perp__bodies_own_row(h->bodies, block, i, x);
                length = sqrt(perp__dot(x, x, n));
                for (int32_t k = 0; k < n; k++)
                    unit[k] = x[k] / length;
            }
            if (v[i] == 0.0 || perp__active_rows_fix(&h->dense, h->cluster[block], n))
                v[i] = 0.0; /* never -0.0 */
        }
    }
}

/* All rows of a cluster lead to one carrier: 1, and the members move with it. */
static bool carry_members(perp__hold *h, const int32_t *members, int32_t count)
{
    const perp__bodies *b = h->bodies;
    int32_t root = PERP__HOLD_UNSET;

    for (int32_t m = 0; m < count; m++)
        for (int64_t at = b->block_starts[members[m]]; at < b->block_starts[members[m] + 1]; at++) {
            const int32_t constraint = b->block_constraints[at];
            int64_t piece = 0;
            int32_t beside;

            if (h->holds[constraint] == 0)
                continue;
            if (h->pushed[constraint])
                return 0;
            if (count_open(h, constraint, &piece) > 1) /* within the cluster */
                continue;
            beside = root_beside(h, constraint, members[m]);
            if (beside == PERP__HOLD_SEVERAL ||
                (root != PERP__HOLD_UNSET && !is_same(h, root, beside)))
                return 0;
            root = beside;
        }
    for (int32_t m = 0; m < count; m++)
        if (root == PERP__HOLD_UNSET || !carry(h, members[m], root))
            return 0;
    for (int32_t m = 0; m < count; m++)
        follow(h, members[m], root);
    return 1;
}

/* v of these blocks, one cluster: exact zeros, and what the rows leave free. */
static void solve_cluster(perp__hold *h, const int32_t *members, int32_t count)
{
    const perp__bodies *b = h->bodies;
    int32_t most = 0, n = 0, rests = 1;

    /* 1. Rows and columns that it can have. */
    for (int32_t m = 0; m < count; m++) {
        n += perp__bodies_unknowns(b, members[m]);
        for (int64_t at = b->block_starts[members[m]]; at < b->block_starts[members[m] + 1]; at++)
            if (is_taken(h, b->block_constraints[at], b->block_pieces[at], count))
                most += h->holds[b->block_constraints[at]];
    }
    if (most == 0 ||
        (count > 1 && (n > PERP__HOLD_COLUMNS || (double)most * n * n > PERP__HOLD_PRODUCTS)))
        return;

    /* 2. Its rows. */
    n = 0;
    for (int32_t m = 0; m < count; m++) {
        h->cluster[members[m]] = n;
        n += perp__bodies_unknowns(b, members[m]);
    }
    perp__active_rows_begin(&h->dense, n);
    gather(h, members, count);
    perp__active_rows_solve(&h->dense);
    if (h->dense.rank < n) {
        move(h, members, count);
        return;
    }
    if (carry_members(h, members, count))
        return;

    /* 3. Full rank, and not one carrier: the targets alone say how fast. */
    for (int32_t i = 0; i < n; i++)
        rests &= h->dense.particular[i] == 0.0;
    for (int32_t m = 0; m < count; m++) {
        const size_t at = (size_t)members[m] * (size_t)b->width;

        pad(h, members[m], h->dense.particular, h->y + at);
        if (rests)
            memset(h->v + at, 0, (size_t)b->width * sizeof(double));
        else
            perp__bodies_from_own(b, members[m], h->y + at, h->v + at);
        h->root[members[m]] = rests ? PERP__RIGID_AT_REST : members[m];
        h->is_held[members[m]] = 1;
    }
}

/* The same for all blocks that are not held yet: those that rows join are a cluster. */
static void solve_clusters(perp__hold *h)
{
    const perp__bodies *b = h->bodies;
    int32_t *count = h->queue, sum = 0, end; /* no longer needed */

    /* 1. What rows that hold join. */
    for (int32_t k = 0; k < b->blocks; k++)
        h->cluster[k] = k;
    for (int32_t k = 0; k < b->constraints; k++) {
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

    /* 2. The members by cluster, in the order of the first of each. */
    memset(count, 0, (size_t)b->blocks * sizeof *count);
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

    /* 3. Each by itself, from where another's end was. */
    for (int32_t first = 0; first < sum; first = end) {
        const int32_t cluster = h->cluster[h->members[first]];

        for (end = first + 1; end < sum && h->cluster[h->members[end]] == cluster; end++)
            continue;
        solve_cluster(h, h->members + first, end - first);
    }
}

/* ---- one body after the other ---------------------------------------------------------------- */

/* Takes up a row of the block. Returns 1 if it is independent of those before. */
static bool take_up_row(perp__hold *h, int32_t block, const double *row)
{
    const int32_t width = h->bodies->width, rank = h->rank[block];
    double *basis = h->basis + (size_t)block * (size_t)(width * width), *x = basis + rank * width;
    double length = sqrt(perp__dot(row, row, width));

    h->taken_up++;
    for (int32_t i = 0; i < width; i++)
        x[i] = length > 0.0 ? row[i] / length : 0.0;
    perp__project_out(basis, rank, width, x);
    length = sqrt(perp__dot(x, x, width));
    if (!(length > PERP__RANK_TOLERANCE))
        return 0;
    for (int32_t i = 0; i < width; i++)
        x[i] /= length;
    h->rank[block]++;
    return 1;
}

/* A constraint all blocks of which are held but one, which takes up its rows until there are
 * enough. */
static void visit(perp__hold *h, int32_t constraint, int32_t *tail)
{
    const perp__bodies *b = h->bodies;
    const double *row;
    int32_t block, most, root;
    int64_t piece = 0;

    if (h->holds[constraint] == 0 || count_open(h, constraint, &piece) != 1)
        return;
    block = b->piece_blocks[piece];
    most = perp__bodies_unknowns(b, block);
    if (h->rank[block] == most)
        return;
    root = h->pushed[constraint] ? PERP__HOLD_SEVERAL : root_beside(h, constraint, block);
    row = b->values + b->piece_values[piece];
    for (int32_t i = 0; i < h->holds[constraint] && h->rank[block] < most; i++, row += b->width) {
        if (!take_up_row(h, block, row))
            continue;
        if (h->source[block] == PERP__HOLD_UNSET)
            h->source[block] = root;
        else if (h->source[block] != PERP__HOLD_SEVERAL && !is_same(h, h->source[block], root))
            h->source[block] = PERP__HOLD_SEVERAL;
    }
    if (h->rank[block] == most && h->source[block] != PERP__HOLD_SEVERAL &&
        carry(h, block, h->source[block])) {
        follow(h, block, h->source[block]);
    } else if (h->rank[block] == most) {
        h->cluster[block] = 0;
        solve_cluster(h, &block, 1);
    }
    if (h->is_held[block])
        h->queue[(*tail)++] = block;
}

/* From what impulses do not move to all that is held by what is held; then what is left. */
void perp__hold_run(perp__hold *h)
{
    const perp__bodies *b = h->bodies;
    int32_t tail = 0;

    h->taken_up = 0;
    for (int32_t k = 0; k < b->blocks; k++) {
        h->rank[k] = h->is_held[k] = 0;
        h->source[k] = PERP__HOLD_UNSET;
        h->root[k] = PERP__RIGID_FREE;
    }
    for (int32_t k = 0; k < b->constraints; k++)
        if (b->piece_starts[k + 1] - b->piece_starts[k] == 1)
            visit(h, k, &tail);
    for (int32_t head = 0; head < tail; head++) {
        const int32_t block = h->queue[head];

        for (int64_t at = b->block_starts[block]; at < b->block_starts[block + 1]; at++)
            visit(h, b->block_constraints[at], &tail);
    }
    solve_clusters(h);
}
