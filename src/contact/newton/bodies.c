#include "contact/newton/bodies.h"

#include <math.h>
#include <string.h>

#include "contact/newton/matrix.h"
#include "linalg/pivoting.h"

void perp__newton_bodies_multiply(const perp__newton_bodies *own, const double *x, double *out)
{
    const perp__newton_blocks *blocks = own->blocks;

    memset(own->full, 0, (size_t)own->bodies->size * sizeof *own->full);
    for (int32_t i = 0; i < blocks->n; i++)
        own->full[blocks->rows[i]] = blocks->scales[i] * x[i];
    perp__bodies_multiply(own->bodies, own->full, NULL, own->image);
    for (int32_t i = 0; i < blocks->n; i++)
        out[i] = blocks->scales[i] * own->image[blocks->rows[i]];
}

/* N = (R + L C)^-1, column by column; 0 where that is singular. */
static int32_t invert(int32_t d, const double *L, const double *R, const double *C, double *N)
{
    double M[9], X[9];

    for (int32_t i = 0; i < d; i++)
        for (int32_t j = 0; j < d; j++) {
            M[3 * i + j] = R[3 * j + i] + L[3 * j + i] * C[j];
            X[d * i + j] = i == j;
        }
    if (!perp__solve_small(M, d, 3, X, d))
        return 0;
    for (int32_t i = 0; i < d; i++)
        for (int32_t j = 0; j < d; j++)
            N[3 * j + i] = X[d * i + j];
    return 1;
}

/* Adds B_p' K B_q of contact k for all its pieces. Returns the next slot. */
static int64_t add_contact(perp__newton_bodies *own, int32_t k, const double *K, int64_t slot)
{
    const perp__bodies *b = own->bodies;
    const perp__newton_blocks *blocks = own->blocks;
    const int32_t width = b->width, at = blocks->starts[k], d = blocks->starts[k + 1] - at;
    const double *scales = blocks->scales + at;
    double image[3][PERP__BODY_WIDTH_MOST];

    for (int64_t q = b->piece_starts[k]; q < b->piece_starts[k + 1]; q++) {
        const double *Q = b->values + b->piece_values[q];
        const int32_t column = b->piece_blocks[q] * width;
        const int32_t height = own->column_starts[column + 1] - own->column_starts[column];

        for (int32_t i = 0; i < d; i++)
            for (int32_t c = 0; c < width; c++) {
                double sum = 0.0;

                for (int32_t j = 0; j < d; j++)
                    sum += K[3 * j + i] * scales[j] * Q[j * width + c];
                image[i][c] = sum * scales[i];
            }
        for (int64_t p = b->piece_starts[k]; p < b->piece_starts[k + 1]; p++) {
            const double *P = b->values + b->piece_values[p];
            double *to = own->values + own->slots[slot++];

            for (int32_t c = 0; c < width; c++, to += height)
                for (int32_t i = 0; i < d; i++)
                    for (int32_t e = 0; e < width; e++)
                        to[e] += P[i * width + e] * image[i][c];
        }
    }
    return slot;
}

static int64_t add_bilateral(perp__newton_bodies *own, int32_t unit, double R, int64_t slot)
{
    const perp__bodies *b = own->bodies;
    const int32_t width = b->width, row = b->blocks * width + unit - b->contacts;
    const double scale = own->blocks->scales[own->blocks->starts[unit]];
    int32_t at = own->column_starts[row], c;

    for (int64_t q = b->piece_starts[unit]; q < b->piece_starts[unit + 1]; q++) {
        const double *Q = b->values + b->piece_values[q];
        const int32_t column = b->piece_blocks[q] * width;
        const int32_t height = own->column_starts[column + 1] - own->column_starts[column];
        double *to = own->values + own->slots[slot++];

        for (c = 0; c < width; c++, to += height) {
            *to = scale * Q[c];
            own->values[at++] = -scale * Q[c];
        }
    }
    own->values[at] = R + scale * scale * b->compliance[b->rows[unit]];
    return slot;
}

perp_status perp__newton_bodies_factor(perp__newton_bodies *own, const double *L, const double *R,
                                       int32_t keep_pivots)
{
    const perp__bodies *b = own->bodies;
    const perp__newton_blocks *blocks = own->blocks;
    perp__square A = {own->order, own->values, own->column_starts, own->row_indices};
    int64_t slot = 0;

    memset(own->values, 0, (size_t)own->column_starts[own->order] * sizeof *own->values);
    for (int32_t i = 0; i < b->blocks * b->width; i++)
        own->values[perp__newton_bodies_find(own, i, i)] = 1.0;
    for (int32_t k = 0; k < b->contacts; k++) {
        const int32_t at = blocks->starts[k], d = blocks->starts[k + 1] - at;
        double *N = own->inverses + 9 * (size_t)k;
        double K[9] = {0.0}, C[3];

        for (int32_t i = 0; i < d; i++)
            C[i] = blocks->scales[at + i] * blocks->scales[at + i] *
                   b->compliance[blocks->rows[at + i]];
        if (!invert(d, L + 9 * (size_t)k, R + 9 * (size_t)k, C, N))
            return PERP__FACTOR_SINGULAR;
        for (int32_t j = 0; j < d; j++)
            for (int32_t i = 0; i < d; i++)
                for (int32_t c = 0; c < d; c++)
                    K[3 * j + i] += N[3 * c + i] * L[9 * (size_t)k + 3 * (size_t)j + (size_t)c];
        slot = add_contact(own, k, K, slot);
    }
    for (int32_t k = b->contacts; k < b->units; k++)
        slot = add_bilateral(own, k, R[9 * (size_t)k], slot);
    return own->factor.type->factor(own->factor.factor, &A, keep_pivots);
}

/* out = M in, in block k */
static void times(int32_t d, const double *M, const double *in, double *out)
{
    for (int32_t i = 0; i < d; i++) {
        out[i] = 0.0;
        for (int32_t j = 0; j < d; j++)
            out[i] += M[3 * j + i] * in[j];
    }
}

/* rest = rhs - L B y of contact k */
static void leave(const perp__newton_bodies *own, int32_t k, const double *L, const double *rhs,
                  double *rest)
{
    const perp__bodies *b = own->bodies;
    const int32_t width = b->width, at = own->blocks->starts[k];
    const int32_t d = own->blocks->starts[k + 1] - at;
    double speed[3];

    for (int32_t i = 0; i < d; i++) {
        double sum = 0.0;

        for (int64_t p = b->piece_starts[k]; p < b->piece_starts[k + 1]; p++) {
            const double *P = b->values + b->piece_values[p] + i * width;
            const double *y = own->y + (size_t)b->piece_blocks[p] * (size_t)width;

            for (int32_t c = 0; c < width; c++)
                sum += P[c] * y[c];
        }
        speed[i] = own->blocks->scales[at + i] * sum;
    }
    times(d, L + 9 * (size_t)k, speed, rest);
    for (int32_t i = 0; i < d; i++)
        rest[i] = rhs[i] - rest[i];
}

void perp__newton_bodies_solve(perp__newton_bodies *own, const double *L, double *x)
{
    const perp__bodies *b = own->bodies;
    const perp__newton_blocks *blocks = own->blocks;
    const int32_t free_rows = b->units - b->contacts, velocities = b->blocks * b->width;
    const int32_t last = blocks->starts[b->contacts];
    double part[3], rest[3];

    memset(own->full, 0, (size_t)b->size * sizeof *own->full);
    for (int32_t k = 0; k < b->contacts; k++) {
        const int32_t at = blocks->starts[k], d = blocks->starts[k + 1] - at;

        times(d, own->inverses + 9 * (size_t)k, x + at, part);
        for (int32_t i = 0; i < d; i++)
            own->full[blocks->rows[at + i]] = blocks->scales[at + i] * part[i];
    }
    perp__bodies_gather(b, own->full, own->y);
    for (int32_t i = 0; i < free_rows; i++)
        own->y[velocities + i] = x[last + i];
    own->factor.type->solve(own->factor.factor, own->y, 0);
    for (int32_t k = 0; k < b->contacts; k++) {
        const int32_t at = blocks->starts[k], d = blocks->starts[k + 1] - at;

        leave(own, k, L, x + at, rest);
        times(d, own->inverses + 9 * (size_t)k, rest, x + at);
    }
    for (int32_t i = 0; i < free_rows; i++)
        x[last + i] = own->y[velocities + i];
}
