/* The kernels of small.c, a template (linalg/lanes/vectors.h). It defines NAME(kernels). `rows`: n,
 * in whole vectors; where that is a constant, columns stay in registers. */

/* Exchanges the basic variable of row r with the one of column c. Returns what has left. */
TARGET static inline size_t NAME(exchange)(tableau *t, size_t rows, size_t r, size_t c)
{
    double *column = t->T + c * LENGTH, *other = t->T;
    const double inverse = 1.0 / column[r];
    const int32_t leaving = t->basic[r];
    lanes kept[LENGTH / LANES];

    for (size_t i = 0; i < rows; i += LANES)
        kept[i / LANES] = load(column + i);
    for (size_t j = 0; j <= t->b; j++, other += LENGTH) { /* c too: a branch costs more */
        const double factor = other[r] * inverse;

        for (size_t i = 0; i < rows; i += LANES)
            store(other + i, minus_product(load(other + i), spread(factor), kept[i / LANES]));
        other[r] = factor;
    }
    for (size_t i = 0; i < rows; i += LANES)
        store(column + i, multiply(kept[i / LANES], spread(-inverse)));
    column[r] = inverse;
    t->basic[r] = t->nonbasic[c];
    t->nonbasic[c] = leaving;
    t->column_of[leaving] = (int32_t)c;
    return (size_t)leaving;
}

/* Of the rows whose w is marked in w[] the one with the largest entry of column c; NONE: that is
 * rounding. */
static inline size_t NAME(largest_row)(const tableau *t, const double *w, size_t c)
{
    const double *column = t->T + c * LENGTH;
    double largest = 0.0, most = 0.0;
    size_t found = NONE;

    for (size_t r = 0; r < t->n; r++) {
        const double size = fabs(column[r]);
        const size_t k = (size_t)t->basic[r];

        most = size > most ? size : most;
        if (k >= t->n && w[k - t->n] < 0.0 && size > largest) {
            largest = size;
            found = r;
        }
    }
    return largest > SMALLEST_START * most ? found : NONE;
}

/* To the basis that the start z, scaled, names: z_k where it is above w_k. t covers the rows that
 * are wrong there. False where that is no basis. */
TARGET static inline int32_t NAME(begin_at)(tableau *t, size_t rows, const double *z)
{
    double w[LENGTH] = {0.0}, *cover = t->T + t->n * LENGTH;
    const double *b = t->T + t->b * LENGTH;

    for (size_t i = 0; i < rows; i += LANES) {
        lanes sum = subtract(load(b + i), load(z + i));

        for (size_t j = 0; j < t->n; j++)
            sum = minus_product(sum, load(t->T + j * LENGTH + i), spread(z[j]));
        store(w + i, sum);
    }
    for (size_t k = 0; k < t->n; k++) {
        const size_t r = w[k] < 0.0 ? NAME(largest_row)(t, w, k) : t->n;

        if (r == NONE)
            return 0;
        if (r < t->n)
            NAME(exchange)(t, rows, r, k);
    }
    for (size_t r = 0; r < t->n; r++)
        cover[r] = b[r] < -t->slack ? -1.0 : 0.0;
    return 1;
}

/* The row of the least value of b that t covers; NONE: none is below 0. Of equals the last, as the
 * lexicographic order of the unit matrix has it. */
static inline size_t NAME(worst_row)(const tableau *t)
{
    const double *b = t->T + t->b * LENGTH, *cover = t->T + t->n * LENGTH;
    size_t found = NONE;
    double least = -0x1p-1074;

    for (size_t r = 0; r < t->n; r++) {
        const double value = -cover[r] * b[r];

        found = value <= least ? r : found;
        least = value <= least ? value : least;
    }
    return found;
}

/* Harris' two passes (lemke/path.c): the row of the largest entry of column c among those that
 * block within the slack, t's first; NONE: nothing blocks. */
TARGET static inline size_t NAME(blocking_row)(const tableau *t, size_t rows, size_t c)
{
    const double *column = t->T + c * LENGTH, *b = t->T + t->b * LENGTH;
    const double own = column[t->row];
    const lanes zero = spread(0.0), infinity = spread(INFINITY), slack = spread(t->slack);
    lanes largest = zero, reach = infinity, least, best = zero;

    for (size_t i = 0; i < rows; i += LANES)
        largest = larger(absolute(load(column + i)), largest);
    least = spread(SMALLEST_PIVOT * largest_of(largest));
    for (size_t i = 0; i < rows; i += LANES) {
        const lanes speed = load(column + i), far = add(larger(load(b + i), zero), slack);

        reach = smaller(pick(less(least, speed), divide(far, speed), infinity), reach);
    }
    if (own > 0.0)
        reach = smaller(spread((b[t->row] + t->slack) / own), reach);
    reach = spread(smallest_of(reach));
    if (own > 0.0 && b[t->row] <= smallest_of(reach) * own)
        return t->row;
    for (size_t i = 0; i < rows; i += LANES) {
        const lanes speed = load(column + i), far = larger(load(b + i), zero);
        const truth blocks = both(less(least, speed), at_most(far, multiply(reach, speed)));

        best = larger(pick(blocks, speed, zero), best);
    }
    best = spread(largest_of(best));
    for (size_t i = 0; i < rows && any_of(less(zero, best)); i += LANES) {
        const lanes speed = load(column + i), far = larger(load(b + i), zero);
        const truth found = both(at_most(best, speed), at_most(far, multiply(reach, speed)));

        if (any_of(found))
            return i + (size_t)first_of(found);
    }
    return NONE;
}

/* From the basis of all w, or the one that z names, to one that solves the problem. Returns the
 * number of pivots; -1: it ends elsewhere. */
TARGET static inline int32_t NAME(path)(tableau *t, size_t rows, const double *z)
{
    const size_t n = t->n;
    double *b = t->T + t->b * LENGTH;
    int32_t count = 0;
    size_t r, c = n;

    if (z && !NAME(begin_at)(t, rows, z))
        return -1;
    r = t->row = NAME(worst_row)(t);
    while (r != NONE && count++ < t->most) {
        const size_t leaving = NAME(exchange)(t, rows, r, c);

        if (leaving == 2 * n)
            return count;
        c = (size_t)t->column_of[leaving < n ? leaving + n : leaving - n];
        r = NAME(blocking_row)(t, rows, c);
        if (r != NONE && b[r] < 0.0)
            b[r] = 0.0;
    }
    return count == 0 ? 0 : -1;
}

TARGET static int32_t NAME(follow)(tableau *t, const double *z)
{
    const size_t rows = (t->n + LANES - 1) / LANES * LANES;

    return rows == LANES       ? NAME(path)(t, LANES, z)
           : rows == 2 * LANES ? NAME(path)(t, 2 * LANES, z)
           : rows == 3 * LANES && 3 * LANES < LENGTH
               ? NAME(path)(t, 3 * LANES, z)
               : NAME(path)(t, rows < LENGTH ? rows : LENGTH, z);
}

/* With z_A basic and w_A nonbasic z_A = b - T w_A: where M z + q leaves a w_A, z_A is off by
 * T w_A. `w`: n, scaled. */
TARGET static void NAME(correct)(tableau *t, const double *w)
{
    double left[2 * LENGTH + 1] = {0.0}, *b = t->T + t->b * LENGTH;

    for (size_t i = 0; i < t->n; i++)
        left[t->n + i] = w[i];
    for (size_t c = 0; c <= t->n; c++) {
        const lanes factor = spread(-left[t->nonbasic[c]]); /* 0 for z and t */

        for (size_t i = 0; i < t->n; i += LANES)
            store(b + i, minus_product(load(b + i), factor, load(t->T + c * LENGTH + i)));
    }
}

/* scaled := -D columns D; d has LENGTH entries. */
TARGET static void NAME(scale)(size_t n, const double *columns, const double *d, double *scaled)
{
    for (size_t j = 0; j < n; j++, columns += LENGTH, scaled += LENGTH)
        for (size_t i = 0; i < LENGTH; i += LANES)
            store(scaled + i, multiply(load(columns + i), multiply(load(d + i), spread(-d[j]))));
}

static const kernels NAME(kernels) = {NAME(follow), NAME(correct), NAME(scale)};

#undef NAME
