/* W = A M^-1 A' of few velocities as Y'Y with Y = L^-1 A', M = L L': half of the solves, and
 * symmetric as it is. */
#include "contact/dynamics/dynamics.h"

#include <string.h>

#include "linalg/lanes/lanes.h"
#include "linalg/lanes/multiversion.h"

enum { TILE = PERP__HALF_TILE, ROWS = 4 };

PERP__MULTIVERSION(solve_tile,
                   (size_t n, size_t width, const double *L, const double *reciprocals,
                    size_t first, double *Y),
                   (n, width, L, reciprocals, first, Y))
{
    for (size_t i = first; i < n; i++) {
        double *y = Y + i * width;
        perp__lanes a = PERP__LANES_AT(y), b = PERP__LANES_AT(y + 4);

        for (size_t k = first; k < i; k++) {
            const perp__lanes l = PERP__SAME_LANES(L[i + k * n]);

            a -= l * PERP__LANES_AT(Y + k * width);
            b -= l * PERP__LANES_AT(Y + k * width + 4);
        }
        PERP__LANES_AT(y) = a * PERP__SAME_LANES(reciprocals[i]);
        PERP__LANES_AT(y + 4) = b * PERP__SAME_LANES(reciprocals[i]);
    }
}

void perp__half_solve(int32_t n, int32_t size, const double *L, double *Y, const int32_t *firsts,
                      double *work)
{
    const size_t width = perp__half_width(size);

    for (size_t i = 0; i < (size_t)n; i++)
        work[i] = 1.0 / L[i + i * (size_t)n];
    for (size_t tile = 0; tile * TILE < width; tile++)
        solve_tile((size_t)n, width, L, work, (size_t)firsts[tile], Y + tile * TILE);
}

void perp__half_invert(int32_t n, const double *L, double *X, double *work)
{
    const size_t width = perp__half_width(n);
    int32_t firsts[PERP__HALF_MOST / TILE];

    memset(X, 0, (size_t)n * width * sizeof *X);
    for (size_t i = 0; i < (size_t)n; i++)
        X[i * width + i] = 1.0;
    for (size_t tile = 0; tile * TILE < width; tile++)
        firsts[tile] = (int32_t)(tile * TILE);
    perp__half_solve(n, n, L, X, firsts, work);
}

/* Row i of X ends in the tile of its diagonal: so many lanes are enough. out: as wide as X. */
PERP__MULTIVERSION(apply, (size_t n, size_t width, const double *X, const double *x, double *out),
                   (n, width, X, x, out))
{
    for (size_t j = 0; j < width; j++)
        out[j] = 0.0;
    for (size_t i = 0; i < n; i++, X += width) {
        perp__lanes sum = PERP__SAME_LANES(0.0), y;

        for (size_t j = 0; j <= i; j += 4)
            sum += PERP__CONST_LANES_AT(X + j) * PERP__CONST_LANES_AT(x + j);
        y = PERP__SAME_LANES((sum[0] + sum[1]) + (sum[2] + sum[3]));
        for (size_t j = 0; j <= i; j += 4)
            PERP__LANES_AT(out + j) += PERP__CONST_LANES_AT(X + j) * y;
    }
}

void perp__half_apply(int32_t n, const double *X, double *x, double *work)
{
    const size_t width = perp__half_width(n);

    memcpy(work, x, (size_t)n * sizeof *x);
    for (size_t j = (size_t)n; j < width; j++)
        work[j] = 0.0;
    apply((size_t)n, width, X, work, work + width);
    memcpy(x, work + width, (size_t)n * sizeof *x);
}

/* out := X'Z for ROWS columns of X and a tile of Z. */
PERP__MULTIVERSION(product_tile,
                   (size_t first, size_t n, size_t width, const double *X, const double *Z,
                    double *out),
                   (first, n, width, X, Z, out))
{
    perp__lanes a[ROWS], b[ROWS];

    for (int k = 0; k < ROWS; k++)
        a[k] = b[k] = PERP__SAME_LANES(0.0);
    for (size_t i = first; i < n; i++) {
        const double *x = X + i * width, *z = Z + i * width;
        const perp__lanes left = PERP__CONST_LANES_AT(z), right = PERP__CONST_LANES_AT(z + 4);

        for (int k = 0; k < ROWS; k++)
            a[k] += PERP__SAME_LANES(x[k]) * left, b[k] += PERP__SAME_LANES(x[k]) * right;
    }
    for (int k = 0; k < ROWS; k++)
        PERP__LANES_AT(out + TILE * k) = a[k], PERP__LANES_AT(out + TILE * k + 4) = b[k];
}

void perp__half_product(int32_t n, int32_t size, const double *Y, const int32_t *firsts, double *W)
{
    const size_t width = perp__half_width(size);
    const size_t rows = (size_t)size;
    double tile[ROWS * TILE];

    for (size_t i = 0; i < rows; i += ROWS)
        for (size_t j = i / TILE * TILE; j < rows; j += TILE) {
            const int32_t a = firsts[i / TILE], b = firsts[j / TILE];
            const size_t end = i + ROWS < rows ? i + ROWS : rows;
            const size_t right = j + TILE < rows ? j + TILE : rows;

            product_tile((size_t)(a > b ? a : b), (size_t)n, width, Y + i, Y + j, tile);
            for (size_t k = i; k < end; k++) /* and their mirror images */
                for (size_t l = j; l < right; l++)
                    W[k * rows + l] = W[l * rows + k] = tile[(k - i) * TILE + l - j];
        }
}
