/* The kernel of perp_lcp_batch for one instruction set; see linalg/lanes/vectors.h. Arrays are
 * named by variables of the functions' own: a store of a vector might change what g points to, for
 * all that the compiler knows. */

/* LU = the active block, rows and columns of the others those of the unit matrix; its factors,
 * without pivoting: P-matrices have only positive pivots. Returns 1 in the lanes that have not. */
static TARGET lanes NAME(factor)(const perp__batch_group *g)
{
    const size_t n = (size_t)g->n;
    double *const LU = g->LU;
    const double *const M = g->M;
    const double *const active = g->active;
    double *const inverses = g->inverse;
    const lanes one = spread(1.0), zero = spread(0.0);
    lanes bad = zero;
    size_t i;

    for (i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            const lanes both_active = multiply(load(active + i * LANES), load(active + j * LANES));
            lanes entry = multiply(load(M + (i * n + j) * LANES), both_active);

            if (i == j)
                entry = add(entry, subtract(one, both_active));
            store(LU + (i * n + j) * LANES, entry);
        }
    for (size_t k = 0; k < n; k++) {
        const double *from = LU + k * n * LANES;
        const lanes pivot = load(from + k * LANES);
        const truth good = less(multiply(spread(1e-13), load(M + (k * n + k) * LANES)), pivot);
        const lanes inverse = divide(one, pick(good, pivot, one));

        bad = pick(good, bad, one);
        store(inverses + k * LANES, inverse);
        for (i = k + 1; i + 1 < n; i += 2) { /* two rows: what is loaded serves twice */
            double *into = LU + i * n * LANES, *next = into + n * LANES;
            const lanes factor = multiply(load(into + k * LANES), inverse);
            const lanes second = multiply(load(next + k * LANES), inverse);

            store(into + k * LANES, factor);
            store(next + k * LANES, second);
            for (size_t j = k + 1; j < n; j++) {
                const lanes entry = load(from + j * LANES);

                store(into + j * LANES, minus_fused(load(into + j * LANES), factor, entry));
                store(next + j * LANES, minus_fused(load(next + j * LANES), second, entry));
            }
        }
        for (; i < n; i++) {
            double *into = LU + i * n * LANES;
            const lanes factor = multiply(load(into + k * LANES), inverse);

            store(into + k * LANES, factor);
            for (size_t j = k + 1; j < n; j++)
                store(into + j * LANES,
                      minus_fused(load(into + j * LANES), factor, load(from + j * LANES)));
        }
    }
    return bad;
}

/* x := LU^-1 x */
static TARGET void NAME(solve_factors)(const perp__batch_group *g, double *x)
{
    const size_t n = (size_t)g->n;
    const double *const LU = g->LU;
    const double *const inverses = g->inverse;

    for (size_t k = 0; k < n; k++) {
        const lanes known = load(x + k * LANES);

        for (size_t i = k + 1; i < n; i++)
            store(x + i * LANES,
                  minus_fused(load(x + i * LANES), load(LU + (i * n + k) * LANES), known));
    }
    for (size_t k = n; k-- > 0;) {
        const lanes known = multiply(load(x + k * LANES), load(inverses + k * LANES));

        store(x + k * LANES, known);
        for (size_t i = 0; i < k; i++)
            store(x + i * LANES,
                  minus_fused(load(x + i * LANES), load(LU + (i * n + k) * LANES), known));
    }
}

/* norm; returns 1 in lanes where a number of M or q is not finite, or a row of D M D is large. */
static TARGET lanes NAME(find_norms)(const perp__batch_group *g)
{
    const size_t n = (size_t)g->n;
    const double *const M = g->M;
    double *const norm = g->norm;
    const double *const q = g->q;
    const double *const size = g->size;
    const lanes one = spread(1.0), large = spread(PERP__BATCH_LARGE);
    lanes bad = spread(0.0);

    for (size_t i = 0; i < n; i++) {
        lanes sum = spread(0.0);

        for (size_t j = 0; j < n; j++)
            sum =
                add(sum, multiply(absolute(load(M + (i * n + j) * LANES)), load(size + j * LANES)));
        store(norm + i * LANES, sum);
        sum = add(sum, absolute(load(q + i * LANES)));
        bad = pick(less(multiply(sum, load(g->w_unit + i * LANES)), large), bad, one);
    }
    return bad;
}

/* into = -(q + M x), one rounding an addition. */
static TARGET void NAME(minus_w)(const perp__batch_group *g, const double *x, double *into)
{
    const size_t n = (size_t)g->n;
    const double *const M = g->M;
    const double *const q = g->q;

    for (size_t i = 0; i < n; i++) {
        lanes sum = subtract(spread(0.0), load(q + i * LANES));

        for (size_t j = 0; j < n; j++)
            sum = minus_fused(sum, load(M + (i * n + j) * LANES), load(x + j * LANES));
        store(into + i * LANES, sum);
    }
}

/* z of the active set, with the others at rest. Returns 1 in the lanes where it is singular. */
static TARGET lanes NAME(solve_set)(const perp__batch_group *g)
{
    const size_t n = (size_t)g->n;
    const lanes half = spread(0.5), zero = spread(0.0);
    const lanes bad = NAME(factor)(g);

    if (!g->rests_at_zero)
        NAME(minus_w)(g, g->rest, g->z); /* rest is 0 in active rows */
    for (size_t i = 0; i < n; i++) {
        const lanes known =
            g->rests_at_zero ? subtract(zero, load(g->q + i * LANES)) : load(g->z + i * LANES);

        store(g->z + i * LANES,
              pick(less(half, load(g->active + i * LANES)), known, load(g->rest + i * LANES)));
    }
    NAME(solve_factors)(g, g->z);
    return bad;
}

/* change, target; returns how many indices are out of place, beyond rounding for w. z_is_zero: in
 * all lanes. */
static TARGET lanes NAME(find_changes)(const perp__batch_group *g, bool z_is_zero)
{
    const size_t n = (size_t)g->n;
    const lanes half = spread(0.5), one = spread(1.0), zero = spread(0.0);
    lanes largest = zero, count = zero;

    for (size_t i = 0; i < n && !z_is_zero; i++)
        largest = larger(largest,
                         multiply(absolute(load(g->z + i * LANES)), load(g->z_unit + i * LANES)));
    if (!z_is_zero)
        NAME(minus_w)(g, g->z, g->high);
    for (size_t i = 0; i < n; i++) {
        const lanes z = load(g->z + i * LANES);
        const lanes minus_w =
            z_is_zero ? subtract(zero, load(g->q + i * LANES)) : load(g->high + i * LANES);
        const lanes low = load(g->lower + i * LANES), up = load(g->upper + i * LANES);
        const lanes rest = load(g->rest + i * LANES);
        const lanes size =
            add(multiply(load(g->norm + i * LANES), largest), absolute(load(g->q + i * LANES)));
        const lanes noise = multiply(spread(PERP__ROUNDING_LIMIT), size);
        const truth is_active = less(half, load(g->active + i * LANES));
        const lanes leaves = pick(less(z, low), one, pick(less(up, z), one, zero));
        /* at its lower bound and not at its upper one, w too small; or the other way round */
        const lanes enters =
            pick(both(both(at_most(rest, low), less(rest, up)), less(noise, minus_w)), one,
                 pick(both(both(at_most(up, rest), less(low, rest)),
                           less(noise, subtract(zero, minus_w))),
                      one, zero));
        const lanes change = pick(is_active, leaves, enters);

        store(g->change + i * LANES, change);
        store(g->target + i * LANES, pick(less(z, low), low, up));
        count = add(count, change);
    }
    return count;
}

/* Exchanges all indices out of place; in lanes where `single` is 1, the last of them alone, which
 * ends for every P-matrix (Murty 1974). */
static TARGET void NAME(exchange)(const perp__batch_group *g, lanes single)
{
    const lanes half = spread(0.5), one = spread(1.0), zero = spread(0.0);
    lanes taken = zero;

    for (size_t i = (size_t)g->n; i-- > 0;) {
        const lanes active = load(g->active + i * LANES);
        const truth takes =
            both(less(half, load(g->change + i * LANES)), less(multiply(taken, single), half));
        const truth is_active = less(half, active);

        taken = pick(takes, one, taken);
        store(g->active + i * LANES, pick(takes, subtract(one, active), active));
        store(g->rest + i * LANES, pick(takes, pick(is_active, load(g->target + i * LANES), zero),
                                        load(g->rest + i * LANES)));
    }
}

/* Active sets from z at rest. Returns 1 in the lanes where it did not end in a solution. */
static TARGET lanes NAME(find_set)(const perp__batch_group *g)
{
    const lanes one = spread(1.0), zero = spread(0.0), half = spread(0.5);
    const lanes not_finite = NAME(find_norms)(g);
    lanes best = spread((double)g->n + 1.0), tries = zero, bad = zero, count;

    memcpy(g->z, g->rest, (size_t)g->n * LANES * sizeof *g->z); /* nothing active: no equations */
    for (int32_t round = 0;; round++) {
        truth falls;

        if (round > 0 || g->has_free)
            bad = NAME(solve_set)(g);
        count = NAME(find_changes)(g, round == 0 && g->rests_at_zero);
        if (!any_of(less(half, count)) || round == g->most_rounds)
            break;
        falls = less(count, best);
        tries = pick(falls, spread(PERP__CRASH_PATIENCE), subtract(tries, one));
        best = pick(falls, count, best);
        NAME(exchange)(g, pick(less(tries, zero), one, zero));
    }
    return pick(less(half, add(count, not_finite)), one, bad);
}

/* high := M z + q, rounded from doubled precision (Ogita, Rump & Oishi 2005, algorithm 5.3). */
static TARGET void NAME(multiply_doubled)(const perp__batch_group *g)
{
    const size_t n = (size_t)g->n;
    const double *const M = g->M;
    double *const high_out = g->high;
    const double *const q = g->q;
    const double *const z = g->z;

    for (size_t i = 0; i < n; i++) {
        lanes high = load(q + i * LANES), low = spread(0.0);

        for (size_t j = 0; j < n; j++)
            PERP__ACCUMULATE(high, low, load(M + (i * n + j) * LANES), load(z + j * LANES));
        store(high_out + i * LANES, add(high, low));
    }
}

/* Returns the largest |mid((z - l) / (D omega), (z - u) / (D omega), D w / omega)|. own: an upper
 * bound of the own residuals, each row's violation beside the terms q_i and M_ii z_i alone; +inf
 * where the point needs a closer look than the kernel's. A NaN is lost in the one, but not here. */
static TARGET lanes NAME(measure)(const perp__batch_group *g)
{
    const size_t n = (size_t)g->n;
    const double *const M = g->M, *const q = g->q, *const active = g->active;
    const lanes half = spread(0.5), zero = spread(0.0);
    lanes worst = zero, lack = zero, sizes = zero;

    NAME(multiply_doubled)(g);
    for (size_t i = 0; i < n; i++) {
        const lanes z = load(g->z + i * LANES), unit = load(g->z_unit + i * LANES);
        const lanes above = multiply(subtract(z, load(g->lower + i * LANES)), unit);
        const lanes below = multiply(subtract(z, load(g->upper + i * LANES)), unit);
        const lanes w_unit = load(g->w_unit + i * LANES);
        const lanes w = multiply(load(g->high + i * LANES), w_unit);
        const lanes least = pick(less(above, w), above, w);
        const lanes residual = absolute(pick(less(least, below), below, least));
        const lanes term = multiply(load(M + (i * n + i) * LANES), z);
        const lanes terms = add(absolute(load(q + i * LANES)), absolute(term));
        const lanes violation = pick(less(half, load(active + i * LANES)), absolute(w), residual);

        worst = larger(residual, worst);
        lack = larger(pick(less(zero, violation), divide(violation, multiply(terms, w_unit)), zero),
                      lack);
        sizes = add(sizes, add(absolute(multiply(z, unit)), absolute(w)));
    }
    store(g->own_residual, pick(at_most(sizes, spread(PERP__BATCH_LARGE)), lack, spread(INFINITY)));
    return worst;
}

/* Whether each index is coupled, beyond noise, to one before it: then the matrix does not fall into
 * parts, and one omega serves all of its rows. (Some that don't fall apart fail this, too.) */
static TARGET truth NAME(is_one_part)(const perp__batch_group *g)
{
    const size_t n = (size_t)g->n;
    const double *const M = g->M, *const w_unit = g->w_unit, *const size = g->size;
    /* beside rows of that size a coupling from here on is no noise to equilibration */
    const lanes least =
        spread(PERP__CERTAIN * PERP__BATCH_LARGE * perp__power_of_two(-PERP__NOISE));
    truth one_part = at_most(least, least);

    for (size_t j = 1; j < n; j++) {
        lanes largest = spread(0.0);
        truth coupled;

        for (size_t i = j - 1;; i--) {
            const lanes entry = larger(absolute(load(M + (i * n + j) * LANES)),
                                       absolute(load(M + (j * n + i) * LANES)));
            const lanes units = multiply(load(w_unit + i * LANES), load(size + j * LANES));

            largest = larger(multiply(entry, units), largest);
            coupled = at_most(least, largest);
            if (i == 0 || all_of(coupled))
                break;
        }
        one_part = both(one_part, coupled);
    }
    return one_part;
}

/* One refinement of the active rows, kept within the bounds, in the lanes where `wanted` is 1. */
static TARGET void NAME(refine)(const perp__batch_group *g, truth wanted)
{
    const lanes half = spread(0.5), zero = spread(0.0);

    for (size_t i = 0; i < (size_t)g->n; i++)
        store(g->target + i * LANES, pick(both(wanted, less(half, load(g->active + i * LANES))),
                                          load(g->high + i * LANES), zero));
    NAME(solve_factors)(g, g->target);
    for (size_t i = 0; i < (size_t)g->n; i++) {
        const lanes low = load(g->lower + i * LANES), up = load(g->upper + i * LANES);
        const lanes z = subtract(load(g->z + i * LANES), load(g->target + i * LANES));
        const lanes raised = pick(less(z, low), low, z);

        store(g->z + i * LANES, pick(less(up, raised), up, raised));
    }
}

static TARGET void NAME(solve)(const perp__batch_group *g)
{
    const lanes bad = NAME(find_set)(g);
    lanes tested = NAME(measure)(g);
    const truth wanted = less(spread(8.0 * DBL_EPSILON), tested);

    if (any_of(wanted)) {
        NAME(refine)(g, wanted);
        tested = NAME(measure)(g);
    }
    for (size_t i = 0; i < (size_t)g->n;
         i++) /* which lanes went through refine may change a zero's sign */
        store(g->z + i * LANES, add(load(g->z + i * LANES), spread(0.0)));
    store(g->tested, pick(less(spread(0.5), bad), spread(INFINITY), tested));
    store(g->own_residual, pick(NAME(is_one_part)(g), load(g->own_residual), spread(INFINITY)));
}

static const perp__batch_kernel NAME(kernel) = {LANES, NAME(solve)};
#undef NAME
