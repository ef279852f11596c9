/* The kernels of doubled.c, a template (linalg/lanes/vectors.h). NAME(x) is the name of a function.
 */

/* h + l + a x; the product's error is -(p - a x) */
#define ACCUMULATE(h, l, a, x)                                                     \
    do {                                                                           \
        const lanes p = multiply((a), (x)), s = add((h), p), t = subtract(s, (h)); \
        const lanes e = add(subtract((h), subtract(s, t)), subtract(p, t));        \
        (h) = s;                                                                   \
        (l) = add((l), subtract(e, minus_fused(p, (a), (x))));                     \
    } while (0)

/* Four columns in one pass save three quarters of the traffic on high and low; each row still adds
 * its products one after the other, as one column at a time would. */
TARGET static void NAME(add_4_columns)(size_t rows, const double *const *a, const double *x,
                                       double *high, double *low)
{
    const lanes x0 = spread(x[0]), x1 = spread(x[1]), x2 = spread(x[2]), x3 = spread(x[3]);
    size_t i;

    for (i = 0; i + LANES <= rows; i += LANES) {
        lanes h = load(high + i), l = load(low + i);

        ACCUMULATE(h, l, load(a[0] + i), x0);
        ACCUMULATE(h, l, load(a[1] + i), x1);
        ACCUMULATE(h, l, load(a[2] + i), x2);
        ACCUMULATE(h, l, load(a[3] + i), x3);
        store(high + i, h);
        store(low + i, l);
    }
    for (; i < rows; i++)
        for (size_t k = 0; k < 4; k++)
            perp__accumulate(high + i, low + i, a[k][i], x[k]);
}

TARGET static void NAME(add_column)(size_t rows, const double *a, double x, double *high,
                                    double *low)
{
    const lanes all = spread(x);
    size_t i;

    for (i = 0; i + LANES <= rows; i += LANES) {
        lanes h = load(high + i), l = load(low + i);

        ACCUMULATE(h, l, load(a + i), all);
        store(high + i, h);
        store(low + i, l);
    }
    for (; i < rows; i++)
        perp__accumulate(high + i, low + i, a[i], x);
}

/* high + low + a' x; entries 8 apart are summed by themselves first. */
TARGET static void NAME(add_row)(size_t columns, const double *a, const double *x, double *high,
                                 double *low)
{
    double h[8], l[8];
    size_t j;

#define ZERO(q) lanes h##q = spread(0.0), l##q = h##q;
#define STEP(q) ACCUMULATE(h##q, l##q, load(a + j + (q)*LANES), load(x + j + (q)*LANES));
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

/* 8 rows side by side, entry j of row i at a[8 j + i]: each adds its products one after the other.
 */
TARGET static void NAME(add_8_rows)(size_t columns, const double *a, const double *x, double *h,
                                    double *l)
{
#define LOAD(q) lanes h##q = load(h + (q)*LANES), l##q = load(l + (q)*LANES);
#define STEP(q) ACCUMULATE(h##q, l##q, load(a + 8 * j + (q)*LANES), factor);
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

static const doubled_kernels NAME(kernels) = {NAME(add_4_columns), NAME(add_column), NAME(add_row),
                                              NAME(add_8_rows)};

#undef ACCUMULATE
#undef NAME
