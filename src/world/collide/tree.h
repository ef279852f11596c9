/* A dynamic tree of boxes: which of them overlap a given one. */
#ifndef PERP_WORLD_COLLIDE_TREE_H
#define PERP_WORLD_COLLIDE_TREE_H

#include "world/collide/collide.h"

static inline int32_t perp__bounds_overlap(const perp__bounds *a, const perp__bounds *b)
{
    return a->low[0] <= b->high[0] && b->low[0] <= a->high[0] && a->low[1] <= b->high[1] &&
           b->low[1] <= a->high[1] && a->low[2] <= b->high[2] && b->low[2] <= a->high[2];
}

typedef struct perp__tree_node {
    perp__bounds bounds;
    int32_t parent;   /* -1: root; of a free node: the next free one */
    int32_t child[2]; /* -1: leaf */
    int32_t height;   /* 0: leaf */
    int32_t item;     /* of a leaf: the caller's number */
} perp__tree_node;

/* The nodes are the caller's memory: n leaves take 2 n - 1. */
typedef struct perp__tree {
    perp__tree_node *nodes;
    int32_t used; /* nodes that were ever taken */
    int32_t root; /* -1: empty */
    int32_t free; /* list of free nodes */
} perp__tree;

void perp__tree_init(perp__tree *tree);

/* Returns the leaf. There must be room for two nodes. O(log n). */
int32_t perp__tree_insert(perp__tree *tree, const perp__bounds *bounds, int32_t item);
void perp__tree_remove(perp__tree *tree, int32_t leaf);

/* A query for the leaves that overlap `bounds`. */
typedef struct perp__tree_query {
    int32_t stack[64]; /* the tree is balanced as an AVL tree: 45 levels at 2^31 nodes */
    int32_t depth;
} perp__tree_query;

void perp__tree_start(const perp__tree *tree, perp__tree_query *query);
/* The item of the next leaf, -1 at the end. */
int32_t perp__tree_next(const perp__tree *tree, perp__tree_query *query,
                        const perp__bounds *bounds);

#endif
