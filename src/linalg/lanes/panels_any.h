/* The kernels of panels.h for any processor, in loops that compilers can make vectors of. Included
 * once for each arithmetic with NAME(x), the name of a function of this set; minus_one(c, a, b) =
 * c - a b; and FUSED: is that rounded once? */

static void NAME(eliminate)(const perp__exchanges *e, size_t first, size_t last, double *v,
                            double *y)
{
    for (size_t k = first; k < last; k++) {
        const double *owed = e->L + k * e->stride;
        double x = y[e->rows[k]];

        for (size_t l = first; l < k; l++)
            x = minus_one(x, owed[l], v[l - first]);
        v[k - first] = x;
        y[e->rows[k]] = x / e->pivots[k];
    }
}

static void NAME(subtract_vector)(size_t panels, size_t depth, const double *U, size_t stride,
                                  const double *v, double *y)
{
    for (size_t p = 0; p < panels; p++) {
        const double *u = U + p * stride;
        double *restrict into = y + p * PERP__PANEL;

        for (size_t k = 0; k < depth; k++)
            for (size_t i = 0; i < PERP__PANEL; i++)
                into[i] = minus_one(into[i], u[k * PERP__PANEL + i], v[k]);
    }
}

static void NAME(subtract_tile)(size_t panels, size_t depth, const double *U, size_t stride,
                                const double *V, double *C, size_t ldc)
{
    for (size_t p = 0; p < panels; p++)
        for (size_t j = 0; j < PERP__TILE; j++) {
            const double *u = U + p * stride;
            double *restrict into = C + j * ldc + p * PERP__PANEL;

            for (size_t k = 0; k < depth; k++)
                for (size_t i = 0; i < PERP__PANEL; i++)
                    into[i] = minus_one(into[i], u[k * PERP__PANEL + i], V[k * PERP__STRIP + j]);
        }
}

static void NAME(subtract_rows)(size_t depth, const double *f, const double *V, double pivot,
                                double *x, double *quotients)
{
    for (size_t k = 0; k < depth; k++)
        for (size_t j = 0; j < PERP__STRIP; j++)
            x[j] = minus_one(x[j], f[k], V[k * PERP__STRIP + j]);
    for (size_t j = 0; j < PERP__STRIP; j++)
        quotients[j] = x[j] / pivot;
}

static void NAME(keep)(size_t panels, double pivot, const double *column, double *into, double *u,
                       size_t stride)
{
    const double reciprocal = 1.0 / pivot;

    for (size_t i = 0; i < panels; i++, column += PERP__PANEL, into += PERP__PANEL, u += stride)
        for (size_t k = 0; k < PERP__PANEL; k++) {
            u[k] = FUSED ? column[k] * reciprocal : column[k] / pivot;
            into[k] = 0.0 - u[k];
        }
}

static const perp__panel_kernels NAME(kernels) = {
    FUSED,     NAME(eliminate), NAME(subtract_vector), NAME(subtract_tile), NAME(subtract_rows),
    NAME(keep)};

#undef NAME
#undef FUSED
#undef minus_one
