#include "contact/coloured/joint_factor.h"

#include <amd.h>
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "linalg/lanes/multiversion.h"

static void lay_out_nodes(perp__arena *arena, void *object)
{
    perp__joint_factor *f = object;
    const size_t nodes = (size_t)f->most_nodes;

    f->known = 0;
    PERP__INTEGERS(arena, nodes, &f->rows, &f->order, &f->rank, &f->parent, &f->mark, &f->count);
    PERP__INTEGERS(arena, nodes + 1, &f->starts, &f->tiles);
    PERP__INTEGERS(arena, 2 * nodes, &f->body, &f->old_body, &f->touching);
    f->first = perp__arena_take(arena, (size_t)f->most_bodies + 2, sizeof *f->first);
    f->P = perp__arena_take(arena, nodes, sizeof *f->P);
    f->repeats = perp__arena_take(arena, PERP__NODE * nodes, sizeof *f->repeats);
}

static void lay_out_links(perp__arena *arena, void *object)
{
    perp__joint_factor *f = object;

    f->known = 0;
    f->links = perp__arena_take(arena, (size_t)f->most_links, sizeof *f->links);
}

static void lay_out_tiles(perp__arena *arena, void *object)
{
    perp__joint_factor *f = object;

    f->row = perp__arena_take(arena, (size_t)f->most_tiles, sizeof *f->row);
    f->tile = perp__arena_take(arena, (size_t)f->most_tiles, sizeof *f->tile);
    f->back = perp__arena_take(arena, (size_t)f->most_tiles, sizeof *f->back);
}

perp_status perp__joint_factor_open(perp__joint_factor *f, perp_context *context, int32_t nodes,
                                    int32_t bodies)
{
    f->nodes = nodes;
    f->bodies = bodies;
    perp__raise_room(&f->most_nodes, nodes);
    perp__raise_room(&f->most_bodies, bodies);
    return perp__arena_fit_sizes(&f->arena, context, lay_out_nodes, f, f->fitted,
                                 (size_t[]){(size_t)f->most_nodes, (size_t)f->most_bodies}, 2);
}

/* ---- pattern ---- */

/* The nodes of each body, in order; returns the most links that K can have. */
static int64_t list_nodes(perp__joint_factor *f)
{
    int64_t most = 0;

    memset(f->first, 0, (size_t)(f->bodies + 2) * sizeof *f->first);
    for (int32_t k = 0; k < 2 * f->nodes; k++)
        if (f->body[k] < f->bodies)
            f->first[f->body[k] + 2]++;
    for (int32_t i = 0; i < f->bodies; i++) {
        most += (int64_t)f->first[i + 2] * f->first[i + 2];
        f->first[i + 2] += f->first[i + 1];
    }
    for (int32_t k = 0; k < 2 * f->nodes; k++)
        if (f->body[k] < f->bodies)
            f->touching[f->first[f->body[k] + 1]++] = k;
    return most + f->nodes;
}

/* Row by row of L, the columns on the ways up the tree from where K has tiles: counted, with the
 * tree itself; or written. */
static void trace_rows(perp__joint_factor *f, bool writes)
{
    for (int32_t k = 0; k < f->nodes; k++) {
        f->parent[k] = writes ? f->parent[k] : -1;
        f->mark[k] = k;
        f->count[k] = 1;
        if (writes)
            f->row[f->tiles[k]] = k;
        for (int32_t p = f->starts[f->order[k]]; p < f->starts[f->order[k] + 1]; p++) {
            int32_t i = f->rank[f->links[p]];

            for (; i < k && f->mark[i] != k; i = f->parent[i]) {
                if (f->parent[i] < 0)
                    f->parent[i] = k;
                if (writes)
                    f->row[f->tiles[i] + f->count[i]] = k;
                f->count[i]++;
                f->mark[i] = k;
            }
        }
    }
}

/* The order and the tiles of L, unless the nodes are on the bodies of the last factors. */
static perp_status analyse(perp__joint_factor *f, perp_context *context)
{
    const size_t bodies = 2 * (size_t)f->nodes * sizeof *f->body;
    int64_t links;
    int32_t count = 0;
    size_t size;
    perp_status status;

    if (f->known == f->nodes && f->known_bodies == f->bodies &&
        !memcmp(f->body, f->old_body, bodies))
        return PERP_OK;
    f->known = 0;
    links = list_nodes(f);
    if (links > INT32_MAX)
        return perp__fail_memory(context, "the equations of joints");
    perp__raise_room(&f->most_links, (int32_t)links);
    size = (size_t)f->most_links;
    status =
        perp__arena_fit_sizes(&f->link_arena, context, lay_out_links, f, f->fitted + 2, &size, 1);
    if (status != PERP_OK)
        return status;
    /* nodes that share a body, each with itself */
    for (int32_t i = 0; i < f->nodes; i++)
        f->mark[i] = -1;
    for (int32_t j = 0; j < f->nodes; j++) {
        f->starts[j] = count;
        f->links[count++] = f->mark[j] = j;
        for (int32_t side = 0; side < 2; side++) {
            const int32_t body = f->body[2 * j + side], moves = body < f->bodies;

            for (int32_t k = moves ? f->first[body] : 0; k < (moves ? f->first[body + 1] : 0); k++)
                if (f->mark[f->touching[k] / 2] != j) {
                    f->links[count++] = f->touching[k] / 2;
                    f->mark[f->touching[k] / 2] = j;
                }
        }
    }
    f->starts[f->nodes] = count;
    if (amd_order(f->nodes, f->starts, f->links, f->order, NULL, NULL) < AMD_OK)
        return perp__fail_memory(context, "an ordering");
    for (int32_t k = 0; k < f->nodes; k++)
        f->rank[f->order[k]] = k;
    trace_rows(f, 0);
    f->tiles[0] = 0;
    for (int32_t k = 0; k < f->nodes; k++)
        f->tiles[k + 1] = f->tiles[k] + f->count[k];
    perp__raise_room(&f->most_tiles, f->tiles[f->nodes]);
    size = (size_t)f->most_tiles;
    status =
        perp__arena_fit_sizes(&f->tile_arena, context, lay_out_tiles, f, f->fitted + 3, &size, 1);
    if (status != PERP_OK)
        return status;
    trace_rows(f, 1);
    memcpy(f->old_body, f->body, bodies);
    f->known = f->nodes;
    f->known_bodies = f->bodies;
    return PERP_OK;
}

/* ---- numbers ---- */

/* Where the tiles of column k are. */
PERP__KERNEL static void find_places(const perp__joint_factor *f, int32_t k, int32_t *place)
{
    for (int32_t t = f->tiles[k]; t < f->tiles[k + 1]; t++)
        place[f->row[t]] = t;
}

/* K's tiles of column k of L. */
PERP__KERNEL static void fill_column(perp__joint_factor *f, int32_t k, double ridge)
{
    const int32_t node = f->order[k];

    find_places(f, k, f->mark);
    memset(f->tile[f->tiles[k]], 0, (size_t)(f->tiles[k + 1] - f->tiles[k]) * sizeof *f->tile);
    for (int32_t c = 0; c < f->rows[node]; c++)
        f->tile[f->tiles[k]][c][c] = ridge;
    for (int32_t side = 0; side < 2; side++) {
        const int32_t body = f->body[2 * node + side], moves = body < f->bodies;
        double(*number)[PERP__NODE] = &f->P[node][PERP__NODE * side];

        for (int32_t p = moves ? f->first[body] : 0; p < (moves ? f->first[body + 1] : 0); p++) {
            const int32_t other = f->touching[p] / 2;
            double(*P)[PERP__NODE] = &f->P[other][PERP__NODE * (f->touching[p] % 2)];
            double(*tile)[PERP__NODE];

            if (f->rank[other] < k)
                continue;
            tile = f->tile[f->mark[f->rank[other]]];
            for (int32_t c = 0; c < f->rows[node]; c++) {
                const double x[6] = {number[0][c], number[1][c], number[2][c],
                                     number[3][c], number[4][c], number[5][c]};

                perp__add_columns(tile[c], f->rows[other], 1.0, P, x, 6);
            }
        }
    }
}

static const perp__joint_tile none;

/* In vectors: instructions for strings, which compilers write for it, are long to begin. */
PERP__KERNEL static void copy_tile(double (*to)[PERP__NODE], const void *from)
{
    const double *tile = from;

    for (int32_t c = 0; c < PERP__NODE; c++)
        for (int32_t l = 0; l < PERP__NODE; l += PERP__NODE / 2)
            PERP__LANES_AT(to[c] + l) = PERP__CONST_LANES_AT(tile + PERP__NODE * c + l);
}

static void exchange(double *a, double *b)
{
    const double kept = *a;

    *a = *b;
    *b = kept;
}

/* Brings the largest pivot that is left of D to c, of which the lower triangle is known; `lane`
 * tells where its row and the other one were. */
PERP__KERNEL static void find_pivot(double (*D)[PERP__NODE], int32_t rows, int32_t c, int32_t *lane)
{
    int32_t p = c, kept;

    for (int32_t l = c + 1; l < rows; l++)
        p = D[l][l] > D[p][p] ? l : p;
    for (int32_t l = 0; l < rows && p != c; l++)
        if (l < c)
            exchange(&D[l][c], &D[l][p]);
        else if (l == c)
            exchange(&D[c][c], &D[p][p]);
        else if (l != p)
            exchange(&D[c][l], l < p ? &D[l][p] : &D[p][l]);
    kept = lane[c];
    lane[c] = lane[p];
    lane[p] = kept;
}

/* A positive definite tile D = R R': the inverse of R in its place, and its transpose. Rows whose
 * pivots are not above `least` >= 0 are left out, 0 in both, of what others say as clearly as can
 * be: the largest pivot comes first. Returns whether the other pivots are positive numbers. R^-1
 * has twice the digits of D^-1: rows that say nearly the same need them. */
PERP__KERNEL static bool invert(double (*D)[PERP__NODE], double (*back)[PERP__NODE], int32_t rows,
                                double least, int8_t *repeats)
{
    int32_t lane[PERP__NODE] = {0, 1, 2, 3, 4, 5, 6, 7};
    perp__joint_tile sorted;

    copy_tile(back, none);
    for (int32_t c = 0; c < rows; c++) {
        double pivot, root;

        /* 1. Column c of R, and row c of R^-1: column c of back. */
        if (least >= 0.0)
            find_pivot(D, rows, c, lane);
        pivot = D[c][c];
        root = 1.0 / sqrt(pivot);
        repeats[lane[c]] = pivot <= least;
        if (!isfinite(pivot) || (pivot <= 0.0 && !repeats[lane[c]]))
            return 0;
        if (repeats[lane[c]]) {
            for (int32_t l = c; l < rows; l++)
                D[c][l] = 0.0;
            continue;
        }
        back[c][c] = root;
        for (int32_t l = c + 1; l < rows; l++)
            D[c][l] *= root;
        for (int32_t k = 0; k < c; k++) {
            const double x = -root * D[k][c];

            perp__add_columns(back[c], rows, 1.0, &back[k], &x, 1);
        }
        /* 2. What that leaves of the columns behind it. */
        for (int32_t d = c + 1; d < rows; d++) {
            const double x = -D[c][d];

            for (int32_t l = d; l < rows; l++)
                D[d][l] += x * D[c][l];
        }
    }
    copy_tile(sorted, back);
    for (int32_t c = 0; c < rows; c++)
        for (int32_t l = 0; l < rows; l++)
            D[lane[l]][c] = back[c][lane[l]] = sorted[c][l];
    return 1;
}

/* Column k of L = (its tiles of K, less what columns before took) D^-1, there and back; and what it
 * takes from those after it. Returns whether D has an inverse. */
PERP__KERNEL static int32_t eliminate(perp__joint_factor *f, int32_t k, double least)
{
    const int32_t rows = f->rows[f->order[k]], first = f->tiles[k], end = f->tiles[k + 1];
    double(*inverse)[PERP__NODE] = f->tile[first], (*turned)[PERP__NODE] = f->back[first];

    if (!invert(inverse, turned, rows, least, f->repeats + PERP__NODE * f->order[k]))
        return 0;
    for (int32_t t = first + 1; t < end; t++) {
        const int32_t others = f->rows[f->order[f->row[t]]];
        perp__joint_tile half, L;

        copy_tile(half, none);
        copy_tile(L, none);
        for (int32_t c = 0; c < rows; c++)
            perp__add_product(half[c], others, 1.0, f->tile[t], turned[c], rows);
        for (int32_t c = 0; c < rows; c++)
            perp__add_product(L[c], others, 1.0, half, inverse[c], rows);
        copy_tile(f->back[t], none);
        for (int32_t c = 0; c < rows; c++)
            for (int32_t l = 0; l < others; l++)
                f->back[t][l][c] = L[c][l];
        find_places(f, f->row[t], f->mark);
        for (int32_t s = t; s < end; s++) {
            double(*to)[PERP__NODE] = f->tile[f->mark[f->row[s]]];

            for (int32_t d = 0; d < others; d++)
                perp__add_product(to[d], f->rows[f->order[f->row[s]]], -1.0, f->tile[s],
                                  f->back[t][d], rows);
        }
        copy_tile(f->tile[t], L);
    }
    return 1;
}

PERP__MULTIVERSION(factor, (perp__joint_factor * f, double ridge, double least, int32_t *definite),
                   (f, ridge, least, definite))
{
    *definite = 1;
    for (int32_t k = 0; k < f->nodes; k++)
        fill_column(f, k, ridge);
    for (int32_t k = 0; k < f->nodes && *definite; k++)
        *definite = eliminate(f, k, least);
}

perp_status perp__joint_factor_make(perp__joint_factor *f, perp_context *context, double ridge,
                                    double least, int32_t *definite)
{
    const perp_status status = analyse(f, context);

    *definite = 0;
    if (status == PERP_OK)
        factor(f, ridge, least, definite);
    return status;
}

PERP__MULTIVERSION_SHARED(perp__joint_factor_solve, (const perp__joint_factor *f, double *x),
                          (f, x))
{
    for (int32_t k = 0; k < f->nodes; k++) {
        const int32_t node = f->order[k];

        for (int32_t t = f->tiles[k] + 1; t < f->tiles[k + 1]; t++) {
            const int32_t other = f->order[f->row[t]];

            perp__add_product(x + PERP__NODE * other, f->rows[other], -1.0, f->tile[t],
                              x + PERP__NODE * node, f->rows[node]);
        }
    }
    for (int32_t k = f->nodes; k-- > 0;) {
        const int32_t node = f->order[k], rows = f->rows[node];
        double half[PERP__NODE] = {0.0}, number[PERP__NODE] = {0.0};

        perp__add_product(half, rows, 1.0, f->tile[f->tiles[k]], x + PERP__NODE * node, rows);
        perp__add_product(number, rows, 1.0, f->back[f->tiles[k]], half, rows);
        for (int32_t t = f->tiles[k] + 1; t < f->tiles[k + 1]; t++) {
            const int32_t other = f->order[f->row[t]];

            perp__add_product(number, rows, -1.0, f->back[t], x + PERP__NODE * other,
                              f->rows[other]);
        }
        memcpy(x + PERP__NODE * node, number, sizeof number);
    }
}

void perp__joint_factor_release(perp__joint_factor *f)
{
    perp__arena_release(&f->arena);
    perp__arena_release(&f->link_arena);
    perp__arena_release(&f->tile_arena);
}
