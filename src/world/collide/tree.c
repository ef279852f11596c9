/* A binary tree of boxes, each around its children (Goldsmith & Salmon 1987 for where a leaf goes,
 * Adelson-Velsky & Landis 1962 for how it stays balanced). */
#include "world/collide/tree.h"

#include <stddef.h>
#include <string.h>

enum { NONE = -1 };

void perp__tree_init(perp__tree *tree)
{
    tree->nodes = NULL;
    tree->used = 0;
    tree->root = NONE;
    tree->free = NONE;
}

/* Written out: fmin and fmax are calls. */
static void unite(perp__bounds *to, const perp__bounds *a, const perp__bounds *b)
{
    for (int k = 0; k < 3; k++) {
        to->low[k] = a->low[k] < b->low[k] ? a->low[k] : b->low[k];
        to->high[k] = a->high[k] > b->high[k] ? a->high[k] : b->high[k];
    }
}

/* What a box costs: the sum of its sides, which tells flat boxes and planar ones apart too. */
static double cost(const perp__bounds *box)
{
    return (box->high[0] - box->low[0]) + (box->high[1] - box->low[1]) +
           (box->high[2] - box->low[2]);
}

static double united_cost(const perp__bounds *a, const perp__bounds *b)
{
    perp__bounds both;
    unite(&both, a, b);
    return cost(&both);
}

static int32_t take(perp__tree *tree)
{
    int32_t node = tree->free;
    if (node == NONE)
        return tree->used++;
    tree->free = tree->nodes[node].parent;
    return node;
}

static void give_back(perp__tree *tree, int32_t node)
{
    tree->nodes[node].parent = tree->free;
    tree->nodes[node].height = NONE;
    tree->free = node;
}

/* Returns whether that changes the node. */
static int refit(perp__tree *tree, int32_t node)
{
    perp__tree_node *at = &tree->nodes[node];
    const perp__tree_node *left = &tree->nodes[at->child[0]], *right = &tree->nodes[at->child[1]];
    const int32_t height = 1 + (left->height > right->height ? left->height : right->height);
    perp__bounds bounds;
    unite(&bounds, &left->bounds, &right->bounds);
    if (height == at->height && memcmp(&bounds, &at->bounds, sizeof bounds) == 0)
        return 0;
    at->bounds = bounds;
    at->height = height;
    return 1;
}

static void replace_child(perp__tree *tree, int32_t parent, int32_t old, int32_t node)
{
    tree->nodes[node].parent = parent;
    if (parent == NONE)
        tree->root = node;
    else
        tree->nodes[parent].child[tree->nodes[parent].child[1] == old] = node;
}

/* Bounds, heights and balance from `node` up to what does not change. */
static void mend(perp__tree *tree, int32_t node)
{
    perp__tree_node *nodes = tree->nodes;
    int changed = 1;
    while (node != NONE && changed) {
        const int lean = nodes[nodes[node].child[1]].height - nodes[nodes[node].child[0]].height;
        changed = refit(tree, node);
        if (lean > 1 || lean < -1) {
            /* the higher child is lifted above the node, which gets the lower of its children */
            const int32_t up = nodes[node].child[lean > 1];
            const int higher = nodes[nodes[up].child[1]].height > nodes[nodes[up].child[0]].height;
            const int32_t lower = nodes[up].child[1 - higher];
            replace_child(tree, nodes[node].parent, node, up);
            nodes[up].child[1 - higher] = node;
            nodes[node].parent = up;
            nodes[node].child[lean > 1] = lower;
            nodes[lower].parent = node;
            refit(tree, node);
            refit(tree, up);
            node = up;
            changed = 1;
        }
        node = nodes[node].parent;
    }
}

int32_t perp__tree_insert(perp__tree *tree, const perp__bounds *bounds, int32_t item)
{
    int32_t leaf = take(tree), sibling = tree->root, parent;
    perp__tree_node *nodes = tree->nodes;
    nodes[leaf].bounds = *bounds;
    nodes[leaf].parent = NONE;
    nodes[leaf].child[0] = nodes[leaf].child[1] = NONE;
    nodes[leaf].height = 0;
    nodes[leaf].item = item;
    if (tree->root == NONE) {
        tree->root = leaf;
        return leaf;
    }

    /* 1. where the leaf costs least: beside a node, or down in the child that grows less */
    while (nodes[sibling].height > 0) {
        const perp__tree_node *at = &nodes[sibling];
        double alone = cost(&at->bounds), with = united_cost(&at->bounds, bounds);
        double here = 2.0 * with, inherited = 2.0 * (with - alone), down[2];
        for (int c = 0; c < 2; c++) {
            const perp__tree_node *child = &nodes[at->child[c]];
            down[c] = inherited + united_cost(&child->bounds, bounds) -
                      (child->height > 0 ? cost(&child->bounds) : 0.0);
        }
        if (here < down[0] && here < down[1])
            break;
        sibling = at->child[down[1] < down[0]];
    }

    /* 2. a parent for both in its place */
    parent = take(tree);
    nodes[parent].item = nodes[parent].height = NONE;
    replace_child(tree, nodes[sibling].parent, sibling, parent);
    nodes[parent].child[0] = sibling;
    nodes[parent].child[1] = leaf;
    nodes[sibling].parent = nodes[leaf].parent = parent;
    mend(tree, parent);
    return leaf;
}

void perp__tree_remove(perp__tree *tree, int32_t leaf)
{
    perp__tree_node *nodes = tree->nodes;
    int32_t parent = nodes[leaf].parent;
    give_back(tree, leaf);
    if (parent == NONE) {
        tree->root = NONE;
        return;
    }
    replace_child(tree, nodes[parent].parent, parent,
                  nodes[parent].child[nodes[parent].child[0] == leaf]);
    int32_t above = nodes[parent].parent;
    give_back(tree, parent);
    mend(tree, above);
}

void perp__tree_start(const perp__tree *tree, perp__tree_query *query)
{
    query->depth = tree->root != NONE;
    query->stack[0] = tree->root;
}

int32_t perp__tree_next(const perp__tree *tree, perp__tree_query *query, const perp__bounds *bounds)
{
    while (query->depth > 0) {
        const perp__tree_node *at = &tree->nodes[query->stack[--query->depth]];
        if (!perp__bounds_overlap(&at->bounds, bounds))
            continue;
        if (at->height == 0)
            return at->item;
        query->stack[query->depth++] = at->child[0];
        query->stack[query->depth++] = at->child[1];
    }
    return NONE;
}
