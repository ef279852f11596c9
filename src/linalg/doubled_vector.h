/* The kernels of doubled.c, a template (linalg/lanes/vectors.h). NAME(x) names a function. */

/* LANES rows of a pass, from row i on. */
TARGET static inline void NAME(pass)(const doubled_pass *pass, size_t i, lanes *high, lanes *low)
{
    lanes h = load((pass->from ? pass->from : pass->high) + i),
          l = pass->from ? spread(0.0) : load(pass->low + i);

    for (size_t k = 0; k < pass->count; k++)
        PERP__ACCUMULATE(h, l, load(pass->columns[k] + i), spread(pass->factors[k]));
    if (pass->last)
        PERP__JOIN(h, l);
    *high = h;
    *low = l;
}

TARGET static void NAME(add_columns)(const doubled_pass *pass, size_t rows)
{
    const size_t end = rows - LANES;
    lanes h, l, h_end, l_end;

    if (rows < LANES) {
        pass_any(pass, rows);
        return;
    }
    NAME(pass)
    (pass, end, &h_end, &l_end); /* may overlap the one before: read before that is written */
    for (size_t i = 0; i < end; i += LANES) {
        NAME(pass)(pass, i, &h, &l);
        store(pass->high + i, h);
        store(pass->low + i, l);
    }
    store(pass->high + end, h_end);
    store(pass->low + end, l_end);
}

/* high + low + a' x; entries 8 apart are summed by themselves first. */
TARGET static void NAME(add_row)(size_t columns, const double *a, const double *x, double *high,
                                 double *low)
{
    double h[8], l[8];
    size_t j;

#define ZERO(q) lanes h##q = spread(0.0), l##q = h##q;
#define STEP(q) PERP__ACCUMULATE(h##q, l##q, load(a + j + (q)*LANES), load(x + j + (q)*LANES));
#define STORE(q)                \
    store(h + (q)*LANES, h##q); \
    store(l + (q)*LANES, l##q);
    if (columns >= FEW_COLUMNS) {
        EIGHT_DOUBLES(ZERO)
        for (j = 0; j + 8 <= columns; j += 8) {
            EIGHT_DOUBLES(STEP)
        }
        EIGHT_DOUBLES(STORE)
        add_lanes(h, l, high, low);
    }
#undef ZERO
#undef STEP
    for (j = columns >= FEW_COLUMNS ? columns - columns % 8 : 0; j < columns; j++)
        perp__accumulate(high, low, a[j], x[j]);
}

/* 8 rows side by side, entry j of row i at a[8 j + i]: each adds its products one by one. */
TARGET static void NAME(add_8_rows)(size_t columns, const double *a, const double *x, double *h,
                                    double *l)
{
#define LOAD(q) lanes h##q = load(h + (q)*LANES), l##q = load(l + (q)*LANES);
#define STEP(q) PERP__ACCUMULATE(h##q, l##q, load(a + 8 * j + (q)*LANES), factor);
    EIGHT_DOUBLES(LOAD)
    for (size_t j = 0; j < columns; j++) {
        const lanes factor = spread(x[j]);

        EIGHT_DOUBLES(STEP)
    }
    EIGHT_DOUBLES(STORE)
#undef LOAD
#undef STEP
#undef STORE
}

static const doubled_kernels NAME(kernels) = {LANES, NAME(add_columns), NAME(add_row),
                                              NAME(add_8_rows)};

#undef NAME
