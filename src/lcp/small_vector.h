/* The kernels of small.c, a template (linalg/lanes/vectors.h). It defines NAME(kernels). `rows`: n,
 * in whole vectors; where that is a constant, columns stay in registers. */

/* All w are basic. */
TARGET static inline void NAME(begin)(const perp_lcp_solver *solver, path *p, size_t rows)
{
    const size_t n = (size_t)solver->n;
    const int32_t budget = solver->settings.max_iterations;
    lanes largest = spread(0.0);

    for (size_t i = 0; i < rows; i += LANES) {
        const lanes q = load(solver->q_scaled + i);

        store(p->b + i, q);
        store(p->cover + i, load(covers + LENGTH - n + i));
        largest = larger(absolute(q), largest);
    }
    for (size_t k = 0; k < n; k++) {
        p->basic[k] = (int32_t)(n + k);
        p->nonbasic[k] = (column){solver->scaled + k * LENGTH, 0};
    }
    p->n = n;
    p->slack = PERP__DEPENDENT * largest_of(largest);
    p->count = 0;
    p->most = MOST_PIVOTS * (int32_t)n;
    if (budget > 0 && budget < p->most)
        p->most = budget;
}

/* x := the column that began with `from`, as it is now. */
TARGET static inline void NAME(follow_up)(const path *p, size_t rows, column from, double *x)
{
    lanes kept[LENGTH / LANES];

    for (size_t i = 0; i < rows; i += LANES) {
        kept[i / LANES] = load(from.start + i);
        store(x + i, kept[i / LANES]);
    }
    for (int32_t k = from.pivot; k < p->count; k++) {
        const double *eta = p->etas + k * LENGTH, *but = others + LENGTH - 1 - p->rows[k];
        const lanes factor = spread(x[p->rows[k]]);

        for (size_t i = 0; i < rows; i += LANES) {
            lanes *at = kept + i / LANES;

            *at = minus_product(multiply(*at, load(but + i)), factor, load(eta + i));
            store(x + i, *at);
        }
    }
}

/* Exchanges the basic variable of row r, whose value is taken to be that, with the one of column
 * x, where inverse is 1 / x_r. Returns what has left. */
TARGET static inline size_t NAME(exchange)(path *p, size_t rows, const double *x, double inverse,
                                           size_t r, size_t entering, double value)
{
    const double *unit = units + LENGTH - 1 - r, *but = others + LENGTH - 1 - r;
    const lanes scale = spread(inverse), factor = spread(value);
    const int32_t leaving = p->basic[r];
    double *eta = p->etas + p->count * LENGTH;

    for (size_t i = 0; i < rows; i += LANES) {
        const lanes rest = multiply(load(x + i), load(but + i)); /* in row r -1 / x_r */
        const lanes scaled = multiply(subtract(rest, load(unit + i)), scale);

        store(eta + i, scaled);
        store(p->b + i, minus_product(multiply(load(p->b + i), load(but + i)), factor, scaled));
    }
    p->nonbasic[leaving] = (column){unit, p->count};
    p->rows[p->count++] = (int32_t)r;
    p->basic[r] = (int32_t)entering;
    return (size_t)leaving;
}

/* Of the rows where wrong is 1 the one with the largest entry of column x; NONE: it is rounding. */
TARGET static inline size_t NAME(largest_row)(size_t rows, const double *wrong, const double *x)
{
    lanes most = spread(0.0), largest = most;
    unsigned found = 0;

    for (size_t i = 0; i < rows; i += LANES) {
        most = larger(absolute(load(x + i)), most);
        largest = larger(absolute(multiply(load(x + i), load(wrong + i))), largest);
    }
    if (!(largest_of(largest) > PERP__POOR_PIVOT * largest_of(most)))
        return NONE;
    largest = spread(largest_of(largest));
    for (size_t i = 0; i < rows; i += LANES)
        found |= bits_of(at_most(largest, absolute(multiply(load(x + i), load(wrong + i))))) << i;
    return perp__lowest_bit(found);
}

/* To the basis that the start z0 names: z_k where it is above w_k, scaled. t covers the rows that
 * are wrong there. False where that is no basis. */
TARGET static inline int32_t NAME(begin_at)(const perp_lcp_solver *solver, path *p, size_t rows,
                                            const double *z0)
{
    const lanes zero = spread(0.0), one = spread(1.0);
    double wrong[LENGTH], x[LENGTH], z[LENGTH] = {0.0};
    unsigned positive = 0;

    for (size_t k = 0; k < p->n; k++)
        z[k] = z0[k] > 0.0 ? z0[k] * solver->z_down[k] : 0.0;
    for (size_t i = 0; i < rows; i += LANES) {
        lanes w = load(p->b + i);
        truth below;

        for (size_t j = 0; j < p->n; j++)
            w = minus_product(w, load(p->nonbasic[j].start + i), spread(z[j]));
        below = less(w, load(z + i));
        store(wrong + i, pick(below, one, zero));
        positive |= bits_of(below) << i;
    }
    for (; positive; positive &= positive - 1) {
        const size_t k = perp__lowest_bit(positive);
        size_t r;

        NAME(follow_up)(p, rows, p->nonbasic[k], x);
        r = NAME(largest_row)(rows, wrong, x);
        if (r == NONE)
            return 0;
        NAME(exchange)(p, rows, x, 1.0 / x[r], r, k, p->b[r]);
        for (size_t i = 0; i < rows; i += LANES)
            store(wrong + i, multiply(load(wrong + i), load(others + LENGTH - 1 - r + i)));
    }
    for (size_t i = 0; i < rows; i += LANES)
        store(p->cover + i, pick(less(load(p->b + i), spread(-p->slack)), spread(-1.0), zero));
    return 1;
}

/* The row of the least value of b that t covers; NONE: none is below 0. Of equals the last, as the
 * lexicographic order of the unit matrix has it. */
TARGET static inline size_t NAME(worst_row)(const path *p, size_t rows)
{
    lanes most = spread(0.0);
    unsigned found = 0;

    for (size_t i = 0; i < rows; i += LANES)
        most = larger(multiply(load(p->cover + i), load(p->b + i)), most);
    most = spread(largest_of(most));
    if (!any_of(less(spread(0.0), most)))
        return NONE;
    for (size_t i = 0; i < rows; i += LANES)
        found |= bits_of(at_most(most, multiply(load(p->cover + i), load(p->b + i)))) << i;
    return perp__highest_bit(found);
}

/* kept := x without what is rounding beside its largest entry, if there is any; returns whether. */
TARGET static inline int32_t NAME(has_rounding)(const double *x, size_t rows, double *kept)
{
    const lanes zero = spread(0.0);
    lanes largest = zero, least;
    bool found = 0;

    for (size_t i = 0; i < rows; i += LANES)
        largest = larger(absolute(load(x + i)), largest);
    least = spread(PERP__DEPENDENT * largest_of(largest));
    for (size_t i = 0; i < rows; i += LANES)
        found |= any_of(both(less(zero, load(x + i)), at_most(load(x + i), least)));
    if (found)
        for (size_t i = 0; i < rows; i += LANES)
            store(kept + i, pick(less(least, load(x + i)), load(x + i), zero));
    return found;
}

/* Harris' two passes (lemke/path.c): the row of the largest entry of column x among those that
 * block within the slack, t's first; NONE: nothing blocks. inverse: of x. What has to come one
 * after the other takes the time: so rounding is looked for on the way, and the largest of several
 * only where several block. */
TARGET static inline size_t NAME(blocking_row)(const path *p, size_t rows, const double *x,
                                               const double *inverse)
{
    const double *b = p->b, chosen = x[p->row];
    const lanes zero = spread(0.0), infinity = spread(INFINITY), slack = spread(p->slack);
    lanes reach = infinity, best = zero;
    unsigned blocking = 0, largest = 0;
    double kept[LENGTH];

    if (NAME(has_rounding)(x, rows, kept))
        x = kept;
    for (size_t i = 0; i < rows; i += LANES) {
        const lanes end = multiply(add(larger(load(b + i), zero), slack), load(inverse + i));

        reach = smaller(pick(less(zero, load(x + i)), end, infinity), reach);
    }
    if (chosen > 0.0)
        reach = smaller(spread((b[p->row] + p->slack) * inverse[p->row]), reach);
    reach = spread(smallest_of(reach));
    if (chosen > 0.0 && b[p->row] <= smallest_of(reach) * chosen)
        return p->row;
    for (size_t i = 0; i < rows; i += LANES) {
        const lanes speed = load(x + i), far = larger(load(b + i), zero);
        const truth blocks = both(less(zero, speed), at_most(far, multiply(reach, speed)));

        blocking |= bits_of(blocks) << i;
        best = larger(pick(blocks, speed, zero), best);
    }
    if ((blocking & (blocking - 1)) == 0)
        return blocking == 0 ? NONE : perp__lowest_bit(blocking);
    best = spread(largest_of(best));
    for (size_t i = 0; i < rows; i += LANES)
        largest |= bits_of(at_most(best, load(x + i))) << i;
    return perp__lowest_bit(blocking & largest);
}

/* From the basis of all w, or the one that z0 names, to one that solves the problem. Returns the
 * number of pivots; -1: it ends elsewhere. */
TARGET static inline int32_t NAME(path)(const perp_lcp_solver *solver, path *p, size_t rows,
                                        const double *z0)
{
    const size_t n = (size_t)solver->n;
    double x[LENGTH], inverse[LENGTH];
    size_t r, entering = 2 * n;

    NAME(begin)(solver, p, rows);
    if (z0 && !NAME(begin_at)(solver, p, rows, z0))
        return -1;
    r = p->row = NAME(worst_row)(p, rows);
    if (r == NONE)
        return 0;
    p->nonbasic[entering] = (column){p->cover, p->count};
    NAME(follow_up)(p, rows, p->nonbasic[entering], x);
    inverse[r] = 1.0 / x[r];
    for (int32_t count = 1; count <= p->most && r != NONE; count++) {
        const double value = count > 1 && p->b[r] < 0.0 ? 0.0 : p->b[r];
        const size_t leaving = NAME(exchange)(p, rows, x, inverse[r], r, entering, value);

        if (leaving == 2 * n)
            return count;
        entering = leaving < n ? leaving + n : leaving - n;
        NAME(follow_up)(p, rows, p->nonbasic[entering], x);
        for (size_t i = 0; i < rows; i += LANES)
            store(inverse + i, divide(spread(1.0), load(x + i)));
        r = NAME(blocking_row)(p, rows, x, inverse);
    }
    return -1;
}

/* z := that of the basis, not below 0; and the product. */
TARGET static inline void NAME(place)(perp_lcp_solver *solver, const path *p, size_t rows)
{
    const size_t n = p->n;
    lanes high[LENGTH / LANES], low[LENGTH / LANES];
    double z[LENGTH + 1]; /* the last one for all w */
    size_t active[LENGTH], count = 0;

    for (size_t i = 0; i < LENGTH; i += LANES)
        store(z + i, spread(0.0));
    for (size_t r = 0; r < n; r++) {
        const size_t k = (size_t)p->basic[r], chosen = k < n ? k : 0;

        z[k < n ? k : LENGTH] = (p->b[r] > 0.0 ? p->b[r] : 0.0) * solver->z_up[chosen];
        active[count] = chosen;
        count += k < n; /* no branch, which nobody foresees */
    }
    for (size_t i = 0; i < rows; i += LANES) {
        high[i / LANES] = load(solver->q + i);
        low[i / LANES] = spread(0.0);
    }
    for (size_t k = 0; k < count; k++) {
        const double *from = solver->columns + active[k] * LENGTH;
        const lanes factor = spread(z[active[k]]);

        for (size_t i = 0; i < rows; i += LANES)
            PERP__ACCUMULATE(high[i / LANES], low[i / LANES], load(from + i), factor);
    }
    for (size_t i = 0; i < rows; i += LANES) {
        PERP__JOIN(high[i / LANES], low[i / LANES]);
        store(solver->w_high + i, high[i / LANES]);
        store(solver->w_low + i, low[i / LANES]);
        store(solver->z + i, load(z + i));
    }
}

/* One step of refinement: with z_A basic and w_A nonbasic z_A = b - T w_A, so where M z + q leaves
 * a w_A, z_A is off by T w_A. Whether it is short enough to be the last: its square is what it
 * leaves. */
TARGET static inline int32_t NAME(correct)(perp_lcp_solver *solver, path *p, size_t rows)
{
    const size_t n = p->n;
    double w[LENGTH], x[LENGTH], is_z[LENGTH], is_0[2 * LENGTH]; /* of rows; of z and w */
    lanes step = spread(0.0), largest = step;

    for (size_t i = 0; i < LENGTH; i += LANES) {
        store(is_z + i, spread(0.0));
        store(is_0 + n + i, spread(1.0));
    }
    for (size_t r = 0; r < n; r++) {
        is_z[r] = p->basic[r] < (int32_t)n ? 1.0 : 0.0;
        is_0[p->basic[r]] = 0.0;
    }
    NAME(place)(solver, p, rows);
    for (size_t i = 0; i < rows; i += LANES) {
        const lanes left = multiply(load(solver->w_high + i), load(solver->w_down + i));

        store(w + i, multiply(left, load(is_0 + n + i)));
    }
    NAME(follow_up)(p, rows, (column){w, 0}, x);
    for (size_t i = 0; i < rows; i += LANES) {
        const lanes change = load(x + i), z = load(is_z + i);
        const lanes b = add(larger(load(p->b + i), spread(0.0)), change);

        store(p->b + i, b);
        step = larger(absolute(multiply(change, z)), step);
        largest = larger(multiply(b, z), largest);
    }
    NAME(place)(solver, p, rows);
    return largest_of(step) <= PERP__LAST_STEP * largest_of(largest);
}

TARGET static inline int32_t NAME(in_rows)(perp_lcp_solver *solver, size_t rows, const double *z0)
{
    path p;

    solver->spent = NAME(path)(solver, &p, rows, z0);
    return solver->spent >= 0 && NAME(correct)(solver, &p, rows);
}

TARGET static int32_t NAME(solve)(perp_lcp_solver *solver, const double *z0)
{
    const size_t rows = ((size_t)solver->n + LANES - 1) / LANES * LANES;

    return rows == LANES                             ? NAME(in_rows)(solver, LANES, z0)
           : rows == 2 * LANES                       ? NAME(in_rows)(solver, 2 * LANES, z0)
           : rows == 3 * LANES && 3 * LANES < LENGTH ? NAME(in_rows)(solver, 3 * LANES, z0)
           : rows == 4 * LANES && 4 * LANES < LENGTH
               ? NAME(in_rows)(solver, 4 * LANES, z0)
               : NAME(in_rows)(solver, rows < LENGTH ? rows : LENGTH, z0);
}

/* Factors of the exponents, -D M D and its row norms; returns the largest of them. */
TARGET static double NAME(scale)(perp_lcp_solver *solver)
{
    const size_t n = (size_t)solver->n;
    double *d = solver->factors;
    lanes largest = spread(0.0);

    for (size_t i = 0; i < n; i++)
        d[i] = perp__power_of_two(solver->exponents[i]);
    for (size_t i = 0; i < n; i += LANES) {
        const double *from = solver->columns + i;
        double *into = solver->scaled + i;
        lanes sum = spread(0.0);

        for (size_t j = 0; j < n; j++, from += LENGTH, into += LENGTH) {
            const lanes entry = multiply(load(from), multiply(load(d + i), spread(-d[j])));

            store(into, entry);
            sum = add(sum, absolute(entry));
        }
        store(solver->row_norms + i, sum);
        largest = larger(sum, largest);
    }
    return largest_of(largest);
}

static const kernels NAME(kernels) = {NAME(solve), NAME(scale)};

#undef NAME
