/* The kernels of evaluate.c, a template (linalg/lanes/vectors.h) for n >= LANES. NAME(x) is the
 * name of a function. The last vector may overlap the one before: all that is done can be done
 * twice. */

/* The first entry of the vector after the one at i; n if there is none. */
static size_t NAME(next)(size_t i, size_t n)
{
    return i + LANES == n ? n : i + 2 * LANES <= n ? i + LANES : n - LANES;
}

/* q_scaled by the powers as they are. Whether these are those of q: its largest entry is in [1, 2).
 */
TARGET static int32_t NAME(scale)(perp_lcp_solver *solver)
{
    const size_t n = (size_t)solver->length;
    lanes largest = spread(0.0);

    for (size_t i = 0; i < n; i = NAME(next)(i, n)) {
        const lanes q = multiply(load(solver->q + i), load(solver->w_down + i));

        store(solver->q_scaled + i, q);
        largest = larger(absolute(q), largest);
    }
    return largest_of(largest) >= 1.0 && largest_of(largest) < 2.0;
}

TARGET static lanes NAME(middle)(lanes above, lanes below, lanes w)
{
    const lanes least = pick(less(above, w), above, w);

    return pick(less(least, below), below, least);
}

TARGET static int32_t NAME(project)(perp_lcp_solver *solver, double *z_largest)
{
    const size_t n = (size_t)solver->length;
    const lanes infinity = spread(INFINITY), zero = spread(0.0);
    lanes largest = zero;
    truth good = less(zero, infinity);

    for (size_t i = 0; i < n; i = NAME(next)(i, n)) {
        const lanes lower = load(solver->lower + i), upper = load(solver->upper + i);
        lanes z = load(solver->z + i), size;

        z = pick(less(z, lower), lower, z);
        z = pick(less(upper, z), upper, z);
        store(solver->z + i, z);
        size = absolute(multiply(z, load(solver->z_down + i)));
        good = both(good, at_most(size, infinity));
        largest = larger(size, largest);
    }
    *z_largest = largest_of(largest);
    return all_of(good);
}

TARGET static int32_t NAME(measure)(const perp_lcp_solver *solver, double z_largest,
                                    perp__evaluation *worth)
{
    const size_t n = (size_t)solver->length;
    const lanes infinity = spread(INFINITY), zero = spread(0.0), size_of_z = spread(z_largest);
    const lanes most = spread(DBL_MAX), tol = spread(solver->settings.tol);
    lanes natural = zero, tested = zero, backward = zero;
    truth good = less(zero, infinity), small = good;

    for (size_t i = 0; i < n; i = NAME(next)(i, n)) {
        const lanes z = load(solver->z + i), w = load(solver->w_high + i);
        const lanes lower = load(solver->lower + i), upper = load(solver->upper + i);
        const lanes above = subtract(z, lower), below = subtract(z, upper);
        const lanes down = load(solver->z_down + i), w_down = load(solver->w_down + i);
        const lanes residual = absolute(NAME(middle)(above, below, w));
        const lanes scaled = absolute(
            NAME(middle)(multiply(above, down), multiply(below, down), multiply(w, w_down)));
        const truth at_lower = at_most(z, lower), at_upper = at_most(upper, z);
        const lanes free_row = pick(at_upper, larger(w, zero), absolute(w));
        const lanes row = pick(at_lower, larger(subtract(zero, w), zero), free_row);
        const lanes violation = pick(both(at_lower, at_upper), zero, row);
        const lanes wrong = multiply(violation, w_down);
        const lanes norms = load(solver->row_norms + i);
        const lanes size = add(multiply(norms, size_of_z), absolute(load(solver->q_scaled + i)));
        const lanes relative = pick(less(zero, wrong), divide(wrong, size), zero);

        small = both(small, at_most(violation, multiply(tol, absolute(load(solver->q + i)))));
        good = both(good, at_most(absolute(w), most));
        good = both(good, at_most(relative, infinity));
        natural = larger(residual, natural);
        tested = larger(scaled, tested);
        backward = larger(relative, backward);
    }
    worth->natural = largest_of(natural);
    worth->tested = largest_of(tested);
    worth->backward = largest_of(backward);
    worth->finite = 1; /* z is, where it is not doubtful */
    worth->small = all_of(small);
    return all_of(good);
}

static const kernels NAME(kernels) = {LANES, NAME(scale), NAME(project), NAME(measure)};

#undef NAME
