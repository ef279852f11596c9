/* The kernels of lemke_rows.h, a template (linalg/vectors.h). It defines NAME(kernels).
 *
 * Rows that lower the reach or raise the largest speed are few: groups of rows are tested together
 * and looked at one by one, in their order, only where the test finds one. */

TARGET static void NAME(move)(size_t length, double factor, const double *column, double *b)
{
    const lanes f = spread(factor);
    size_t i;

    for (i = 0; i < length; i += LANES)
        store(b + i, minus_product(load(b + i), f, load(column + i)));
}

TARGET static double NAME(largest)(size_t length, const double *column)
{
    lanes h = spread(0.0);
    double all[LANES], found = 0.0;
    size_t i;

    for (i = 0; i < length; i += LANES)
        h = larger(absolute(load(column + i)), h);
    store(all, h);
    for (i = 0; i < LANES; i++)
        if (all[i] > found)
            found = all[i];
    return found;
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
    const double floor = rows->smallest_pivot * NAME(largest)(length, rows->column);
    const lanes zero = spread(0.0), most = spread(DBL_MAX), least = spread(floor);
    const lanes turn = spread(-rows->direction), slack = spread(rows->slack);
    double always_far = 0.0, always_speed = 0.0, reach = INFINITY;
    size_t i, k;

    if (rows->always >= 0)
        reach = NAME(reach_of)(rows, rows->always, &always_far, &always_speed);
    for (i = 0; i < length; i += LANES) {
        const lanes b = load(rows->b + i), rate = multiply(turn, load(rows->column + i));
        const lanes down = subtract(b, load(rows->low + i));
        const lanes up = subtract(load(rows->high + i), b);
        const lanes distance = pick(less(rate, zero), down, up);
        const lanes far_i = larger(distance, zero), size = absolute(rate);
        const lanes moves = pick(both(less(least, size), at_most(distance, most)), size, zero);

        store(far + i, far_i);
        store(speed + i, moves);
        if (!any_of(less(add(far_i, slack), multiply(spread(reach), moves))))
            continue;
        for (k = i; k < i + LANES; k++)
            if (far[k] + rows->slack < reach * speed[k])
                reach = (far[k] + rows->slack) / speed[k];
    }
    if (rows->always >= 0) {
        far[rows->always] = always_far;
        speed[rows->always] = always_speed;
    }
    return reach;
}

TARGET static int32_t NAME(fastest)(size_t length, const double *far, const double *speed,
                                    double reach)
{
    const lanes within = spread(reach);
    double best = 0.0;
    int32_t found = -1;
    size_t i, k;

    for (i = 0; i < length; i += LANES) {
        const lanes s = load(speed + i);

        if (!any_of(both(less(spread(best), s), at_most(load(far + i), multiply(within, s)))))
            continue;
        for (k = i; k < i + LANES; k++)
            if (speed[k] > best && far[k] <= reach * speed[k]) {
                best = speed[k];
                found = (int32_t)k;
            }
    }
    return found;
}

static const perp__row_kernels NAME(kernels) = {
    SET,
    NAME(move),
    NAME(reach),
    NAME(fastest),
};

#undef NAME
