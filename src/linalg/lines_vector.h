/* The kernels of multiply.c that look at the lines of a dense matrix, a template
 * (linalg/lanes/vectors.h) for n >= LANES. The last vector may overlap the one before: all that is
 * done can be done twice. */

/* Raises *most to |line_k| D_k and across_k to own |line_k|, in one vector. */
TARGET static inline lanes NAME(raise_at)(const double *line, const double *D, lanes own,
                                          double *across, lanes most)
{
    const lanes size = absolute(load(line));

    store(across, larger(multiply(size, own), load(across)));
    return larger(multiply(size, load(D)), most);
}

/* The largest |line_k| D_k; across_k is raised to own |line_k|. */
TARGET static double NAME(raise)(size_t n, const double *line, const double *D, double own,
                                 double *across)
{
    const lanes factor = spread(own);
    lanes most = spread(0.0);
    size_t k = 0;

    for (; k + LANES <= n; k += LANES)
        most = NAME(raise_at)(line + k, D + k, factor, across + k, most);
    k = n - LANES;
    if (n % LANES != 0)
        most = NAME(raise_at)(line + k, D + k, factor, across + k, most);
    return largest_of(most);
}

/* Which of |line_k| D_k are not 0 and at least `bound`, in one vector. */
TARGET static inline uint64_t NAME(mark_at)(const double *line, const double *D, lanes bound)
{
    const lanes size = multiply(absolute(load(line)), load(D));

    return bits_of(both(less(spread(0.0), size), at_most(bound, size)));
}

/* Of a block of n lines and as many entries, n <= 64: bit k of bits_j says whether |line_jk| D_k is
 * not 0 and at least bounds_j. */
TARGET static void NAME(mark)(size_t n, const double *first, size_t stride, const double *D,
                              const double *bounds, uint64_t *bits)
{
    for (size_t j = 0; j < n; j++) {
        const double *line = first + j * stride;
        const lanes bound = spread(bounds[j]);
        uint64_t found = 0;
        size_t k = 0;

        for (; k + LANES <= n; k += LANES)
            found |= NAME(mark_at)(line + k, D + k, bound) << k;
        k = n - LANES;
        if (n % LANES != 0)
            found |= NAME(mark_at)(line + k, D + k, bound) << k;
        bits[j] = found;
    }
}

static const kernels NAME(kernels) = {LANES, NAME(raise), NAME(mark)};

#undef NAME
