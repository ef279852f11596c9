/* The order of elimination, the pattern of the factors and the fronts: once for a graph. */
#include <amd.h>
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "base/sort.h"
#include "linalg/fronts/fronts.h"

static void layout_graph(perp__arena *arena, void *object)
{
    perp__fronts *f = object;
    const size_t n = (size_t)f->nodes + 1;

    PERP__INTEGERS(arena, n, &f->order, &f->place, &f->parent, &f->mark, &f->work,
                   &f->column_starts, &f->front_of, &f->starts);
    f->fronts = perp__arena_take(arena, n, sizeof *f->fronts);
    f->whole = perp__arena_take(arena, f->takes_blocks ? n : 0, sizeof *f->whole);
    f->whole_order = perp__arena_take(arena, f->takes_blocks ? n : 0, sizeof(int32_t));
}

static void layout_pattern(perp__arena *arena, void *object)
{
    perp__fronts *f = object;
    const size_t edges = (size_t)f->work[0], rows = (size_t)f->column_starts[f->nodes];

    f->neighbours = perp__arena_take(arena, edges, sizeof(int32_t));
    f->entries = perp__arena_take(arena, edges, sizeof *f->entries);
    PERP__INTEGERS(arena, rows, &f->column_rows, &f->in_parent);
}

static void layout_values(perp__arena *arena, void *object)
{
    perp__fronts *f = object;
    const size_t width = (size_t)f->width, square = width * width;
    size_t most = 0, others = 0;
    double *room;

    for (int32_t t = 0; t < f->count; t++) {
        perp__front *front = &f->fronts[t];
        const size_t pivots = (size_t)front->count, rest = (size_t)front->rest;
        const size_t across = pivots * rest * square;

        front->panel = perp__arena_take(arena, (pivots + rest) * pivots * square, sizeof(double));
        front->across = perp__arena_take(arena, f->is_symmetric ? 0 : across, sizeof(double));
        front->pivots =
            perp__arena_take(arena, f->is_symmetric ? 0 : pivots * width, sizeof(int32_t));
        most = across > most ? across : most;
        if (pivots * width > PERP__FRONT_PANEL && most < PERP__FRONT_PANEL * PERP__FRONT_STRIP)
            most = PERP__FRONT_PANEL * PERP__FRONT_STRIP;
        others += rest;
    }
    room = perp__arena_take(arena, f->is_symmetric ? most : 0, sizeof(double));
    for (int32_t t = 0; t < f->count && f->is_symmetric; t++)
        f->fronts[t].across = room;
    f->block_lists = perp__arena_take(arena, f->takes_blocks ? 2 * others : 0, sizeof(int32_t));
    f->values = perp__arena_take(arena, (size_t)f->starts[f->nodes] * square, sizeof(double));
    f->stack = perp__arena_take(arena, f->stack_size, sizeof(double));
    PERP__DOUBLES(arena, (size_t)f->nodes * width, &f->right, &f->gathered);
}

/* The elimination tree of the order (Liu, ACM TOMS 12 (1986) 127); mark: ancestors. */
static void find_tree(perp__fronts *f, const int32_t *starts, const int32_t *neighbours)
{
    for (int32_t i = 0; i < f->nodes; i++) {
        f->parent[i] = f->mark[i] = -1;
        for (int32_t e = starts[f->order[i]]; e < starts[f->order[i] + 1]; e++) {
            int32_t j = f->place[neighbours[e]];

            while (j >= 0 && j < i) {
                const int32_t next = f->mark[j];

                f->mark[j] = i;
                if (next < 0)
                    f->parent[j] = i;
                j = next;
            }
        }
    }
}

/* Descendants before their ancestors, a tree after the other, by their smallest nodes. */
static void order_trees(perp__fronts *f)
{
    int32_t *child = f->mark, *sibling = f->work, *stack = f->column_starts, *placed = f->front_of;
    int32_t count = 0;

    for (int32_t i = 0; i < f->nodes; i++)
        child[i] = -1;
    for (int32_t i = f->nodes - 1; i >= 0; i--)
        if (f->parent[i] >= 0) {
            sibling[i] = child[f->parent[i]];
            child[f->parent[i]] = i;
        }
    for (int32_t node = 0; node < f->nodes; node++) {
        int32_t root = f->place[node], depth = 0;

        while (child[root] != -2 && f->parent[root] >= 0)
            root = f->parent[root];
        if (child[root] == -2)
            continue;
        stack[depth++] = root;
        while (depth > 0) {
            const int32_t i = stack[depth - 1], next = child[i];

            if (next >= 0) {
                child[i] = sibling[next];
                stack[depth++] = next;
            } else {
                child[i] = -2;
                placed[count++] = f->order[i];
                depth--;
            }
        }
    }
    memcpy(f->order, placed, (size_t)f->nodes * sizeof *placed);
    for (int32_t i = 0; i < f->nodes; i++)
        f->place[f->order[i]] = i;
}

/* The pattern of L, row after row: row i has a column for each j on the ways up the tree from the
 * earlier neighbours of i. Counts them, or also writes them down. */
static void find_pattern(perp__fronts *f, const int32_t *starts, const int32_t *neighbours,
                         int32_t *rows)
{
    int32_t *at = rows ? f->work : f->column_starts + 1;

    for (int32_t i = 0; i < f->nodes; i++) {
        at[i] = rows ? f->column_starts[i] : 0;
        f->mark[i] = -1;
    }
    for (int32_t i = 0; i < f->nodes; i++) {
        f->mark[i] = i;
        for (int32_t e = starts[f->order[i]]; e < starts[f->order[i] + 1]; e++)
            for (int32_t j = f->place[neighbours[e]]; j < i && f->mark[j] != i; j = f->parent[j]) {
                f->mark[j] = i;
                if (rows)
                    rows[at[j]] = i;
                at[j]++;
            }
    }
    if (rows)
        return;
    f->column_starts[0] = 0;
    for (int32_t i = 0; i < f->nodes; i++)
        f->column_starts[i + 1] += f->column_starts[i];
}

/* Fronts: a node joins those before it where its only child at hand is the last of them and little
 * is gained by keeping them apart: a large part of a small front may be zeros, a small one of a
 * large. entry: the zeros that each has taken in. */
static void find_fronts(perp__fronts *f)
{
    f->count = 0;
    for (int32_t j = 0; j < f->nodes; j++) {
        f->fronts[f->count].first = j;
        f->fronts[f->count].count = 1;
        f->fronts[f->count].entry = 0;
        f->fronts[f->count++].rest = f->column_starts[j + 1] - f->column_starts[j];
        while (f->count > 1) {
            perp__front *b = &f->fronts[f->count - 1], *a = b - 1;
            const double pivots = a->count, more = b->count, rest = b->rest;
            const int32_t both = a->count + b->count;
            const double share = 1.0 / sqrt(both);
            const double zeros = a->entry + b->entry + pivots * (more + rest - (double)a->rest);
            const double kept = pivots * (pivots + 1.0) / 2.0 + pivots * (double)a->rest +
                                more * (more + 1.0) / 2.0 + more * rest;

            if (f->parent[a->first + a->count - 1] != b->first ||
                !(zeros <= 0.0 || zeros < share * (kept + zeros)))
                break;
            a->entry = (int32_t)zeros;
            a->count += b->count;
            a->rest = b->rest;
            f->count--;
        }
    }
}

/* Both have their others in the order of elimination. */
static void place_in_parent(const perp__fronts *f, perp__front *front)
{
    const perp__front *parent = front->rest > 0 ? &f->fronts[front->parent] : NULL;

    for (int32_t i = 0, k = 0; i < front->rest; i++) {
        const int32_t place = front->others[i], pivots = place - parent->first;

        while (pivots >= parent->count && parent->others[k] < place)
            k++;
        front->in_parent[i] = pivots < parent->count ? pivots : parent->count + k;
    }
}

static void link_fronts(perp__fronts *f)
{
    const size_t square = (size_t)f->width * (size_t)f->width;
    int32_t *in_parent = f->in_parent;
    size_t top = 0, depth = 0;

    for (int32_t t = 0; t < f->count; t++) {
        perp__front *front = &f->fronts[t];
        const int32_t at = f->column_starts[front->first + front->count - 1];

        front->others = f->column_rows + at;
        front->in_parent = in_parent; /* together: memory that is not touched costs nothing */
        in_parent += front->rest;
        for (int32_t j = 0; j < front->count; j++)
            f->front_of[front->first + j] = t;
    }
    for (int32_t t = 0; t < f->count; t++)
        f->fronts[t].parent = f->fronts[t].rest > 0 ? f->front_of[f->fronts[t].others[0]] : -1;
    f->stack_size = 0;
    for (int32_t t = 0; t < f->count; t++) {
        perp__front *front = &f->fronts[t];
        const size_t left = (size_t)front->rest * (size_t)front->rest * square;

        place_in_parent(f, front);
        if (f->stack_size < top + left)
            f->stack_size = top + left;
        while (depth > 0 && f->fronts[f->work[depth - 1]].parent == t) {
            const size_t gone = (size_t)f->fronts[f->work[--depth]].rest;

            top -= gone * gone * square;
        }
        top += left;
        if (left > 0)
            f->work[depth++] = t;
    }
}

/* The blocks of the matrix, front by front. */
static void list_entries(perp__fronts *f)
{
    int32_t *position = f->mark, at = 0;

    for (int32_t t = 0; t < f->count; t++) {
        perp__front *front = &f->fronts[t];

        front->entry = at;
        for (int32_t i = 0; i < front->count; i++)
            position[front->first + i] = i;
        for (int32_t i = 0; i < front->rest; i++)
            position[front->others[i]] = front->count + i;
        for (int32_t c = front->first; c < front->first + front->count; c++)
            for (int32_t e = f->starts[f->order[c]]; e < f->starts[f->order[c] + 1]; e++) {
                const int32_t place = f->place[f->neighbours[e]];
                const int32_t row = place < front->first ? -1 : position[place];

                if (row < (f->is_symmetric ? c - front->first : 0))
                    continue;
                f->entries[at++] = (perp__front_entry){e, row, c - front->first};
                if (row >= front->count && !f->is_symmetric)
                    f->entries[at++] = (perp__front_entry){
                        perp__fronts_edge(f, f->order[c], f->neighbours[e]), c - front->first, row};
            }
        front->last_entry = at;
    }
}

int32_t perp__fronts_edge(const perp__fronts *f, int32_t row, int32_t column)
{
    const int32_t first = f->starts[column];

    return first + perp__lower_bound(f->neighbours + first, f->starts[column + 1] - first, row);
}

perp_status perp__fronts_analyse(perp__fronts *f, perp_context *context, int32_t nodes,
                                 int32_t width, const int32_t *starts, const int32_t *neighbours)
{
    perp_status status;

    if (f->nodes == nodes && f->width == width && nodes > 0 &&
        !memcmp(f->starts, starts, ((size_t)nodes + 1) * sizeof *starts) &&
        !memcmp(f->neighbours, neighbours, (size_t)starts[nodes] * sizeof *neighbours))
        return PERP_OK;
    f->nodes = nodes;
    f->width = width;
    f->is_too_large = 0;
    status = perp__arena_fit(&f->graph_arena, context, layout_graph, f);
    /* AMD reads the pattern only, but does not say so in its types */
    if (status == PERP_OK && nodes > 0 &&
        amd_order(nodes, (int *)starts, (int *)neighbours, f->order, NULL, NULL) < AMD_OK)
        status = perp__fail_memory(context, "an ordering");
    if (status == PERP_OK) {
        for (int32_t i = 0; i < nodes; i++)
            f->place[f->order[i]] = i;
        find_tree(f, starts, neighbours);
        order_trees(f);
        find_tree(f, starts, neighbours);
        find_pattern(f, starts, neighbours, NULL);
        f->products = 0.0;
        for (int32_t j = 0; j < nodes; j++) {
            const double rows = width * (1.0 + f->column_starts[j + 1] - f->column_starts[j]);

            f->products += width * rows * rows;
        }
        f->is_too_large = f->most_products > 0.0 && f->products > f->most_products;
        f->work[0] = starts[nodes];
        if (f->is_too_large)
            f->nodes = 0;
        else
            status = perp__arena_fit(&f->pattern_arena, context, layout_pattern, f);
    }
    if (status == PERP_OK && !f->is_too_large) {
        memcpy(f->starts, starts, ((size_t)nodes + 1) * sizeof *starts);
        memcpy(f->neighbours, neighbours, (size_t)starts[nodes] * sizeof *neighbours);
        find_pattern(f, starts, neighbours, f->column_rows);
        find_fronts(f);
        link_fronts(f);
        list_entries(f);
        status = perp__arena_fit(&f->value_arena, context, layout_values, f);
    }
    if (status == PERP_OK && f->takes_blocks && !f->is_too_large) {
        memcpy(f->whole, f->fronts, (size_t)f->count * sizeof *f->whole);
        memcpy(f->whole_order, f->order, (size_t)nodes * sizeof *f->order);
    }
    if (status != PERP_OK)
        f->nodes = 0;
    return status;
}

void perp__fronts_take(perp__fronts *f, const int32_t *nodes, int32_t count)
{
    int32_t *list = f->block_lists, *feeds = f->mark, at = 0;

    /* 1. Places in the block. */
    for (int32_t i = 0; i < f->nodes; i++)
        f->place[i] = -1;
    for (int32_t i = 0; i < count; i++)
        f->place[nodes[i]] = 0;
    for (int32_t i = 0; i < f->nodes; i++)
        if (f->place[f->whole_order[i]] == 0) {
            f->order[at] = f->whole_order[i];
            f->place[f->whole_order[i]] = at++;
        }
    /* 2. What is left of each front. One without nodes of its own hands on what its children leave,
     * if any does. */
    at = 0;
    for (int32_t t = 0; t < f->count; t++)
        feeds[t] = 0;
    for (int32_t t = 0; t < f->count; t++) {
        const perp__front *whole = &f->whole[t];
        perp__front *front = &f->fronts[t];

        *front = *whole;
        front->first = at;
        front->others = list;
        front->rest = 0;
        for (int32_t i = 0; i < whole->count; i++)
            if (f->place[f->whole_order[whole->first + i]] >= 0)
                f->front_of[at++] = t;
        front->count = at - front->first;
        for (int32_t i = 0; i < whole->rest && (front->count > 0 || feeds[t]); i++) {
            const int32_t place = f->place[f->whole_order[whole->others[i]]];

            if (place >= 0)
                front->others[front->rest++] = place;
        }
        front->in_parent = list + front->rest;
        list += 2 * front->rest;
        if (front->rest > 0)
            feeds[front->parent] = 1;
        else
            front->parent = -1;
    }
    for (int32_t t = 0; t < f->count; t++)
        place_in_parent(f, &f->fronts[t]);
    list_entries(f);
}

void perp__fronts_release(perp__fronts *f)
{
    perp__arena_release(&f->graph_arena);
    perp__arena_release(&f->pattern_arena);
    perp__arena_release(&f->value_arena);
    f->nodes = 0;
}
