/* The bodies' own coordinates y, in which M is the identity: v = C y with C = L^-T of a block. */
#include <string.h>

#include "contact/bodies/bodies.h"
#include "linalg/pivoting.h"

void perp__bodies_to_own(const perp__bodies *b, int32_t block, const double *v, double *y)
{
    const int32_t width = b->width;

    memmove(y, v, (size_t)width * sizeof *y);
    perp__solve_small(b->C + (size_t)block * (size_t)(width * width), width, width, y, 1);
}

void perp__bodies_from_own(const perp__bodies *b, int32_t block, const double *y, double *v)
{
    const int32_t width = b->width;
    const size_t at = (size_t)block * (size_t)(width * width);

    for (int32_t i = width - 1; i >= 0; i--) {
        double sum = b->C ? 0.0 : y[i];

        for (int32_t j = 0; b->C && j < width; j++)
            sum += b->C[at + (size_t)(i * width + j)] * y[j];
        for (int32_t j = i + 1; !b->C && j < width; j++)
            sum -= b->factors[at + (size_t)(j * width + i)] * v[j];
        v[i] = b->C ? sum : sum / b->factors[at + (size_t)(i * width + i)];
    }
}

void perp__bodies_own_row(const perp__bodies *b, int32_t block, int32_t i, double *row)
{
    const int32_t width = b->width;
    const size_t at = (size_t)block * (size_t)(width * width);

    if (b->C) {
        memcpy(row, b->C + at + (size_t)(i * width), (size_t)width * sizeof *row);
        return;
    }
    for (int32_t k = 0; k < width; k++) { /* L^-1 e_i, whose transpose is e_i' L^-T */
        double sum = k == i;

        for (int32_t j = i; j < k; j++)
            sum -= b->factors[at + (size_t)(k * width + j)] * row[j];
        row[k] = k < i ? 0.0 : sum / b->factors[at + (size_t)(k * width + k)];
    }
}

void perp__bodies_own_free(const perp__bodies *b, int32_t block, double *y)
{
    const size_t at = (size_t)block * (size_t)b->width;

    if (b->C)
        perp__bodies_to_own(b, block, b->v_free + at, y);
    else
        memcpy(y, b->free + at, (size_t)b->width * sizeof *y);
}

void perp__bodies_find_free(const perp__bodies *b)
{
    for (int32_t k = 0; b->C && k < b->blocks; k++)
        perp__bodies_own_free(b, k, b->free + (size_t)k * (size_t)b->width);
}
