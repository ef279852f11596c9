/* The kernels of panels.h, a template (lanes/vectors.h). It defines NAME(kernels). Accumulators
 * have names of their own: compilers spill what is an array. */

/* x less what it owes to the first, the first two, ... of a group: in registers, since each waits
 * for the one before. */
#define OWE_0(x, L) (x)
#define OWE_1(x, L) ((x) - (L)[0] * v0)
#define OWE_2(x, L) (OWE_1(x, L) - (L)[1] * v1)
#define OWE_3(x, L) (OWE_2(x, L) - (L)[2] * v2)
#define OWE_4(x, L) (OWE_3(x, L) - (L)[3] * v3)
#define OWE_5(x, L) (OWE_4(x, L) - (L)[4] * v4)
#define OWE_6(x, L) (OWE_5(x, L) - (L)[5] * v5)
#define OWE_7(x, L) (OWE_6(x, L) - (L)[6] * v6)

TARGET static void NAME(eliminate)(const perp__exchanges *e, size_t first, size_t last, double *v,
                                   double *y)
{
    const double *L = e->L + first * e->stride + first, *pivots = e->pivots + first;
    const int32_t *rows = e->rows + first;
    const size_t count = last - first, stride = e->stride;

#define STEP(k)                                              \
    const double v##k = OWE_##k(y[rows[k]], L + (k)*stride); \
                                                             \
    v[k] = v##k;                                             \
    y[rows[k]] = v##k / pivots[k];                           \
    if (count == (k) + 1)                                    \
        return;
    STEP(0)
    STEP(1)
    STEP(2)
    STEP(3)
    STEP(4)
    STEP(5)
    STEP(6)
    STEP(7)
#undef STEP
}

#undef OWE_0
#undef OWE_1
#undef OWE_2
#undef OWE_3
#undef OWE_4
#undef OWE_5
#undef OWE_6
#undef OWE_7

/* Row i of a column of U, and the vector number q from a row on that begins a group of eight. */
#define ROW(U, i) ((U) + (i) / PERP__PANEL * stride + (i) % PERP__PANEL)
#define U_AT(u, q) load(ROW(u, (q)*LANES))
#define SIX(X) X(0) X(1) X(2) X(3) X(4) X(5)
#define EIGHT(X) SIX(X) X(6) X(7)

/* Eight vectors of y, which hide the latency of the chains. */
TARGET static void NAME(eight_vectors)(size_t depth, const double *u, size_t stride,
                                       const double *v, double *y)
{
    size_t k;

#define LOAD(q) lanes y##q = load(y + (q)*LANES);
#define STEP(q) y##q = minus_product(y##q, U_AT(u, q), f);
#define STORE(q) store(y + (q)*LANES, y##q);
    EIGHT(LOAD)
    for (k = 0; k < depth; k++, u += PERP__PANEL) {
        const lanes f = spread(v[k]);

        EIGHT(STEP)
    }
    EIGHT(STORE)
#undef LOAD
#undef STEP
#undef STORE
}

TARGET static void NAME(subtract_vector)(size_t panels, size_t depth, const double *U,
                                         size_t stride, const double *v, double *y)
{
    const size_t rows = panels * PERP__PANEL;
    size_t i;

    for (i = 0; i + 8 * LANES <= rows; i += 8 * LANES)
        NAME(eight_vectors)(depth, ROW(U, i), stride, v, y + i);
    for (; i < rows; i += 2 * LANES) {
        const double *u = ROW(U, i);
        lanes a = load(y + i), b = load(y + i + LANES);

        for (size_t k = 0; k < depth; k++, u += PERP__PANEL) {
            const lanes f = spread(v[k]);

            a = minus_product(a, load(u), f);
            b = minus_product(b, load(u + LANES), f);
        }
        store(y + i, a);
        store(y + i + LANES, b);
    }
}

TARGET static void NAME(block)(size_t depth, const double *u, const double *v, double *c,
                               size_t ldc)
{
    size_t k;

#define LOAD(j) lanes a##j = load(c + (j)*ldc), b##j = load(c + (j)*ldc + LANES);
#define STEP(j)                         \
    {                                   \
        const lanes f = spread(v[j]);   \
        a##j = minus_fused(a##j, a, f); \
        b##j = minus_fused(b##j, b, f); \
    }
#define STORE(j)              \
    store(c + (j)*ldc, a##j); \
    store(c + (j)*ldc + LANES, b##j);
#define AHEAD(j)                             \
    prefetch(c + ((j) + PERP__STRIP) * ldc); \
    prefetch(c + ((j) + PERP__STRIP) * ldc + 2 * LANES - 1);
    SIX(LOAD)
    SIX(AHEAD)
    for (k = 0; k < depth; k++, u += PERP__PANEL, v += PERP__STRIP) {
        const lanes a = load(u), b = load(u + LANES);

        SIX(STEP)
    }
    SIX(STORE)
#undef AHEAD
#undef LOAD
#undef STEP
#undef STORE
}

TARGET static void NAME(subtract_tile)(size_t panels, size_t depth, const double *U, size_t stride,
                                       const double *V, double *C, size_t ldc)
{
    size_t p, i, j;

#define block NAME(block)
    for (p = 0; p < panels; p++)
        for (j = 0; j < PERP__TILE; j += 6)
            for (i = 0; i < PERP__PANEL; i += 2 * LANES)
                block(depth, U + p * stride + i, V + j, C + p * PERP__PANEL + i + j * ldc, ldc);
#undef block
}

TARGET static void NAME(subtract_rows)(size_t depth, const double *f, const double *V, double pivot,
                                       double *x, double *quotients)
{
    const lanes p = spread(pivot);
    size_t j, k;

#define LOAD(q) lanes x##q = load(x + j + (q)*LANES);
#define STEP(q) x##q = minus_fused(x##q, load(row + (q)*LANES), factor);
#define STORE(q)                    \
    store(x + j + (q)*LANES, x##q); \
    store(quotients + j + (q)*LANES, divide(x##q, p));
    for (j = 0; j < PERP__STRIP; j += 6 * LANES) {
        const double *row = V + j;

        SIX(LOAD)
        for (k = 0; k < depth; k++, row += PERP__STRIP) {
            const lanes factor = spread(f[k]);

            SIX(STEP)
        }
        SIX(STORE)
    }
#undef LOAD
#undef STEP
#undef STORE
}

TARGET static void NAME(keep)(size_t panels, double pivot, const double *column, double *into,
                              double *u, size_t stride)
{
    const lanes p = spread(pivot), zero = spread(0.0);

    for (size_t i = 0; i < panels; i++, column += PERP__PANEL, into += PERP__PANEL, u += stride)
        for (size_t k = 0; k < PERP__PANEL; k += LANES) {
            const lanes a = load(column + k), scaled = divide(a, p);

            store(u + k, scaled);
            store(into + k, subtract(zero, scaled));
        }
}

#undef ROW
#undef U_AT
#undef SIX
#undef EIGHT

static const perp__panel_kernels NAME(kernels) = {
    NAME(eliminate), NAME(subtract_vector), NAME(subtract_tile), NAME(subtract_rows), NAME(keep)};

#undef NAME
