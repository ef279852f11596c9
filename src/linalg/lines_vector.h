/* The kernels of multiply.c that look at the lines of a dense matrix, a template
 * (linalg/lanes/vectors.h) for n >= LANES. The last vector may overlap the one before: all that is
 * done can be done twice. */

/* The first entry of the vector after the one at i; n if there is none. */
static size_t NAME(after)(size_t i, size_t n)
{
    return i + LANES == n ? n : i + 2 * LANES <= n ? i + LANES : n - LANES;
}

/* The largest |line_k| D_k; across_k is raised to own |line_k|. */
TARGET static double NAME(raise)(size_t n, const double *line, const double *D, double own,
                                 double *across)
{
    const lanes factor = spread(own);
    lanes most = spread(0.0);

    for (size_t k = 0; k < n; k = NAME(after)(k, n)) {
        const lanes size = absolute(load(line + k));

        most = larger(multiply(size, load(D + k)), most);
        store(across + k, larger(multiply(size, factor), load(across + k)));
    }
    return largest_of(most);
}

/* The largest |line_k| inside_k, and |line_k| outside_k. */
TARGET static void NAME(split)(size_t n, const double *line, const double *inside,
                               const double *outside, double *reached, double *left)
{
    lanes in = spread(0.0), out = in;

    for (size_t k = 0; k < n; k = NAME(after)(k, n)) {
        const lanes size = absolute(load(line + k));

        in = larger(multiply(size, load(inside + k)), in);
        out = larger(multiply(size, load(outside + k)), out);
    }
    *reached = largest_of(in);
    *left = largest_of(out);
}

static const kernels NAME(kernels) = {LANES, NAME(raise), NAME(split)};

#undef NAME
