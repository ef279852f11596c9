/* The tree over patterns, depth first: without recursion, since there may be thousands of positions
 * with one choice each. */
#include "patterns/patterns.h"

perp_status perp__pattern_tree_search(perp__pattern_tree *tree)
{
    perp_status status = PERP_OK;
    int32_t depth = 0;

    if (tree->positions == 0)
        return tree->leaf(tree->user);
    tree->next[0] = 0;
    while (depth >= 0 && status == PERP_OK && !tree->ended) {
        if (tree->next[depth] == tree->choices(tree->user, depth)) {
            depth--;
            continue;
        }
        if (!tree->choose(tree->user, depth, tree->next[depth]++))
            continue;
        if (depth + 1 < tree->positions)
            tree->next[++depth] = 0;
        else
            status = tree->leaf(tree->user);
    }
    return status;
}

int64_t perp__pattern_tree_count(const perp__pattern_tree *tree, int64_t most)
{
    int64_t product = 1;
    int32_t i;

    for (i = 0; i < tree->positions && product <= most; i++)
        product *= tree->choices(tree->user, i);
    return product;
}
