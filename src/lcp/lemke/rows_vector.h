/* The kernels of path.c, a template (linalg/lanes/vectors.h). It defines NAME(kernels). */

TARGET static void NAME(move)(size_t length, double factor, const double *column, double *b)
{
    const lanes f = spread(factor);

    for (size_t i = 0; i < length; i += LANES)
        store(b + i, minus_product(load(b + i), f, load(column + i)));
}

TARGET static double NAME(largest)(size_t length, const double *column)
{
    lanes h = spread(0.0);

    for (size_t i = 0; i < length; i += LANES)
        h = larger(absolute(load(column + i)), h);
    return largest_of(h);
}

/* Distance and speed of one row, whatever its speed. */
static double NAME(reach_of)(const perp__lemke_rows *rows, int32_t r, double *far, double *speed)
{
    const double rate = -rows->direction * rows->column[r];
    const double distance = rate < 0.0 ? rows->b[r] - rows->low[r] : rows->high[r] - rows->b[r];

    *far = distance < 0.0 ? 0.0 : distance;
    *speed = distance <= DBL_MAX ? fabs(rate) : 0.0;
    return *speed > 0.0 ? (*far + rows->slack) / *speed : INFINITY;
}

TARGET static double NAME(reach)(const perp__lemke_rows *rows, double *far, double *speed)
{
    const size_t length = rows->length;
    const double largest = NAME(largest)(length, rows->column);
    const lanes zero = spread(0.0), most = spread(DBL_MAX),
                least = spread(rows->smallest_pivot * largest);
    const lanes turn = spread(-rows->direction), slack = spread(rows->slack);
    const lanes infinity = spread(INFINITY);
    lanes reach = infinity;

    for (size_t i = 0; i < length; i += LANES) {
        const lanes b = load(rows->b + i), rate = multiply(turn, load(rows->column + i));
        const lanes down = subtract(b, load(rows->low + i));
        const lanes up = subtract(load(rows->high + i), b);
        const lanes distance = pick(less(rate, zero), down, up);
        const lanes far_i = larger(distance, zero), size = absolute(rate);
        const truth moves = both(less(least, size), at_most(distance, most));

        store(far + i, far_i);
        store(speed + i, pick(moves, size, zero));
        reach = smaller(pick(moves, divide(add(far_i, slack), size), infinity), reach);
    }
    if (rows->always >= 0 && !(fabs(rows->column[rows->always]) <= rows->noise * largest)) {
        const double entry =
            NAME(reach_of)(rows, rows->always, far + rows->always, speed + rows->always);

        reach = smaller(spread(entry), reach);
    }
    return smallest_of(reach);
}

TARGET static int32_t NAME(fastest)(size_t length, const double *far, const double *speed,
                                    double reach)
{
    const lanes within = spread(reach), zero = spread(0.0);
    lanes best = zero;

    for (size_t i = 0; i < length; i += LANES) {
        const lanes s = load(speed + i);

        best = larger(pick(at_most(load(far + i), multiply(within, s)), s, zero), best);
    }
    best = spread(largest_of(best));
    if (!any_of(less(zero, best)))
        return -1;
    for (size_t i = 0;; i += LANES) {
        const lanes s = load(speed + i);
        const truth found = both(at_most(best, s), at_most(load(far + i), multiply(within, s)));

        if (any_of(found))
            return (int32_t)i + first_of(found);
    }
}

static const perp__row_kernels NAME(kernels) = {
    NAME(move),
    NAME(reach),
    NAME(fastest),
};

#undef NAME
