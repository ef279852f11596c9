/* The loops of convex.c, a template (linalg/lanes/vectors.h). */

/* The least of what the corners of `other` lie along the normals of a group of faces. */
TARGET static void NAME(find_least)(double normal[3][GROUP], const perp__polytope *other,
                                    double *least)
{
    for (int32_t l = 0; l < GROUP; l += LANES) {
        const lanes x = load(normal[0] + l), y = load(normal[1] + l), z = load(normal[2] + l);
        lanes lowest = spread(INFINITY);
        for (int32_t c = 0; c < other->corners; c++) {
            const double *at = other->corner + 3 * c;
            lowest = smaller(add(add(multiply(x, spread(at[0])), multiply(y, spread(at[1]))),
                                 multiply(z, spread(at[2]))),
                             lowest);
        }
        store(least + l, lowest);
    }
}

/* Whether the arcs of edges of B cross that of edge i of A on the Gauss map, bit by bit: each edge
 * parts the other's two faces, which are not on opposite sides of the map. Segments have none. */
TARGET static void NAME(find_crossing)(const perp__convex_pair *pair, int32_t i,
                                       const edge_group *edges, int32_t groups, unsigned *crossing)
{
    const perp__polytope *a = &pair->side[0];
    const double *left = a->normal + 3 * a->edge[4 * i + 2];
    const double *right = a->normal + 3 * a->edge[4 * i + 3];
    const bool bare_a = pair->side[0].faces == 0, bare_b = pair->side[1].faces == 0;
    const lanes none = spread(0.0);
    double u[3];
    edge_vector(a, i, u);
#define ALONG(v, x)                                      \
    add(add(multiply(load((v)[0] + l), spread((x)[0])),  \
            multiply(load((v)[1] + l), spread((x)[1]))), \
        multiply(load((v)[2] + l), spread((x)[2])))
    for (int32_t g = 0; g < groups; g++) {
        crossing[g] = 0;
        for (int32_t l = 0; l < GROUP; l += LANES) {
            const lanes left_b = ALONG(edges[g].left, u), left_a = ALONG(edges[g].along, left);
            const lanes right_a = ALONG(edges[g].along, right);
            const truth parts_b = less(multiply(left_b, ALONG(edges[g].right, u)), none);
            const truth parts_a = less(multiply(left_a, right_a), none);
            const truth near = less(multiply(left_b, right_a), none);
            crossing[g] |= bits_of(bare_b   ? parts_a
                                   : bare_a ? parts_b
                                            : both(both(parts_a, parts_b), near))
                           << l;
        }
    }
#undef ALONG
}

static const convex_kernels NAME(kernels) = {NAME(find_least), NAME(find_crossing)};
#undef NAME
