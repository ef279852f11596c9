/* Products with P, W and M^-1; every sum in one fixed order. */
#include <math.h>
#include <string.h>

#include "contact/bodies/bodies.h"
#include "linalg/lanes/multiversion.h"

/* ---- sums over constraints ------------------------------------------------------------------ */

/* out += P y, or |P| y */
PERP__KERNEL static void times_one(int32_t width, int32_t rows, bool absolute,
                                   const perp__bodies *b, int32_t k, const double *y, double *out)
{
    double sum[PERP__ROWS_MOST];

    for (int32_t i = 0; i < rows; i++)
        sum[i] = out[b->rows[k] + i];
    for (int64_t piece = b->piece_starts[k]; piece < b->piece_starts[k + 1]; piece++) {
        const double *p = b->values + b->piece_values[piece];
        const double *x = y + (int64_t)b->piece_blocks[piece] * width;

        for (int32_t i = 0; i < rows; i++)
            for (int32_t j = 0; j < width; j++)
                sum[i] += (absolute ? fabs(p[i * width + j]) : p[i * width + j]) * x[j];
    }
    for (int32_t i = 0; i < rows; i++)
        out[b->rows[k] + i] = sum[i];
}

PERP__MULTIVERSION(times_y, (const perp__bodies *b, const double *y, double *out), (b, y, out))
{
    for (int32_t k = 0; k < b->constraints; k++)
        PERP__WITH_SHAPE(times_one, b->width, b->rows[k + 1] - b->rows[k], 0, b, k, y, out);
}

/* y += P'r, or |P|'|r| */
PERP__KERNEL static void gather_one(int32_t width, int32_t rows, bool absolute,
                                    const perp__bodies *b, int32_t k, const double *r, double *y)
{
    for (int64_t piece = b->piece_starts[k]; piece < b->piece_starts[k + 1]; piece++) {
        const double *p = b->values + b->piece_values[piece];
        double *to = y + (int64_t)b->piece_blocks[piece] * width, x[PERP__BODY_WIDTH_MOST];

        for (int32_t j = 0; j < width; j++)
            x[j] = to[j];
        for (int32_t i = 0; i < rows; i++)
            for (int32_t j = 0; j < width; j++) {
                const double push = p[i * width + j] * r[b->rows[k] + i];

                x[j] += absolute ? fabs(push) : push;
            }
        for (int32_t j = 0; j < width; j++)
            to[j] = x[j];
    }
}

PERP__MULTIVERSION_SHARED(perp__bodies_gather, (const perp__bodies *b, const double *r, double *y),
                          (b, r, y))
{
    memset(y, 0, (size_t)b->blocks * (size_t)b->width * sizeof *y);
    for (int32_t k = 0; k < b->constraints; k++)
        PERP__WITH_SHAPE(gather_one, b->width, b->rows[k + 1] - b->rows[k], 0, b, k, r, y);
}

/* diagonal := W_ii of the constraint's rows */
PERP__KERNEL static void diagonal_one(int32_t width, int32_t rows, const perp__bodies *b, int32_t k,
                                      double *diagonal)
{
    for (int32_t i = 0; i < rows; i++)
        diagonal[b->rows[k] + i] = b->compliance[b->rows[k] + i];
    for (int64_t piece = b->piece_starts[k]; piece < b->piece_starts[k + 1]; piece++) {
        const double *p = b->values + b->piece_values[piece];
        double square = 0.0;

        for (int32_t i = 0; i < rows; i++) {
            double sum = 0.0;

            for (int32_t j = 0; j < width; j++)
                sum += p[i * width + j] * p[i * width + j];
            diagonal[b->rows[k] + i] += sum;
            square += sum;
        }
        b->squares[piece] = square;
    }
}

PERP__MULTIVERSION_SHARED(perp__bodies_diagonals, (const perp__bodies *b, double *diagonal),
                          (b, diagonal))
{
    for (int32_t k = 0; k < b->constraints; k++)
        PERP__WITH_SHAPE(diagonal_one, b->width, b->rows[k + 1] - b->rows[k], b, k, diagonal);
}

/* out := |P| (|P|'|x|) + |compliance x| + |add| by way of y, as those above */
PERP__MULTIVERSION_SHARED(perp__absolute_bodies,
                          (const perp__bodies *b, const double *x, const double *add, double *y,
                           double *out),
                          (b, x, add, y, out))
{
    memset(y, 0, (size_t)b->blocks * (size_t)b->width * sizeof *y);
    for (int32_t k = 0; k < b->constraints; k++)
        PERP__WITH_SHAPE(gather_one, b->width, b->rows[k + 1] - b->rows[k], 1, b, k, x, y);
    for (int32_t i = 0; i < b->size; i++)
        out[i] = fabs(add[i]) + fabs(b->compliance[i] * x[i]);
    for (int32_t k = 0; k < b->constraints; k++)
        PERP__WITH_SHAPE(times_one, b->width, b->rows[k + 1] - b->rows[k], 1, b, k, y, out);
}

void perp__bodies_force(const perp__bodies *b, const double *f)
{
    const int32_t width = b->width;
    const double *L = b->factors;
    double *y = b->free;

    for (int32_t block = 0; block < b->blocks; block++, y += width, L += width * width)
        for (int32_t i = 0; i < width; i++) {
            const int32_t dof = b->dofs[block * width + i];
            double sum = dof < 0 ? 0.0 : f[dof];

            for (int32_t j = 0; j < i; j++)
                sum -= L[i * width + j] * y[j];
            y[i] = sum / L[i * width + i];
        }
}

void perp__bodies_multiply(const perp__bodies *b, const double *r, const double *q, double *u)
{
    perp__bodies_gather(b, r, b->y);
    for (int32_t i = 0; i < b->size; i++)
        u[i] = q ? q[i] : 0.0;
    times_y(b, b->y, u);
    for (int32_t i = 0; i < b->size; i++)
        u[i] += b->compliance[i] * r[i];
}

/* ---- W --------------------------------------------------------------------------------------- */

/* W[i * stride + c] += sum of row i of one piece, of so many rows, times row c of the other */
PERP__KERNEL static void add_product(int32_t width, int32_t rows, const double *p, int32_t columns,
                                     const double *other, double *W, int32_t stride)
{
    for (int32_t i = 0; i < rows; i++)
        for (int32_t c = 0; c < columns; c++) {
            double sum = 0.0;

            for (int32_t j = 0; j < width; j++)
                sum += p[i * width + j] * other[c * width + j];
            W[i * stride + c] += sum;
        }
}

void perp__bodies_diagonal(const perp__bodies *b, int32_t constraint, double *W)
{
    const int32_t rows = b->rows[constraint + 1] - b->rows[constraint];

    for (int32_t i = 0; i < rows * rows; i++)
        W[i] = 0.0;
    for (int32_t i = 0; i < rows; i++)
        W[i * rows + i] = b->compliance[b->rows[constraint] + i];
    for (int64_t piece = b->piece_starts[constraint]; piece < b->piece_starts[constraint + 1];
         piece++) {
        const double *p = b->values + b->piece_values[piece];

        PERP__WITH_SHAPE(add_product, b->width, rows, p, rows, p, W, rows);
    }
}

/* The constraints that share a block with one constraint, in ascending order: each of its blocks
 * has a sorted list, and a cursor in it. */
static void start_neighbours(const perp__bodies *b, int32_t constraint)
{
    const int64_t first = b->piece_starts[constraint];

    for (int64_t piece = first; piece < b->piece_starts[constraint + 1]; piece++)
        b->cursors[piece - first] = b->block_starts[b->piece_blocks[piece]];
}

/* The next one, or -1. Where W is not NULL, the coupling W[its rows][the constraint's rows], with
 * stride of the latter. */
static int32_t next_neighbour(const perp__bodies *b, int32_t constraint, double *W)
{
    const int64_t first = b->piece_starts[constraint],
                  count = b->piece_starts[constraint + 1] - first;
    const int32_t columns = b->rows[constraint + 1] - b->rows[constraint];
    int32_t next = -1;

    for (int64_t c = 0; c < count; c++)
        if (b->cursors[c] < b->block_starts[b->piece_blocks[first + c] + 1]) {
            const int32_t other = b->block_constraints[b->cursors[c]];

            if (next < 0 || other < next)
                next = other;
        }
    if (next < 0)
        return -1;
    for (int32_t i = 0; W && i < (b->rows[next + 1] - b->rows[next]) * columns; i++)
        W[i] = 0.0;
    for (int64_t c = 0; c < count; c++) {
        const int64_t at = b->cursors[c];

        if (at >= b->block_starts[b->piece_blocks[first + c] + 1] ||
            b->block_constraints[at] != next)
            continue;
        b->cursors[c]++;
        if (W)
            add_product(b->width, b->rows[next + 1] - b->rows[next],
                        b->values + b->piece_values[b->block_pieces[at]], columns,
                        b->values + b->piece_values[first + c], W, columns);
    }
    for (int32_t i = 0; W && next == constraint && i < columns; i++)
        W[i * columns + i] += b->compliance[b->rows[constraint] + i];
    return next;
}

int64_t perp__bodies_delassus_entries(const perp__bodies *b)
{
    int64_t entries = 0;

    for (int32_t k = 0; k < b->constraints; k++) {
        int32_t other;

        start_neighbours(b, k);
        while ((other = next_neighbour(b, k, NULL)) >= 0)
            entries +=
                (int64_t)(b->rows[other + 1] - b->rows[other]) * (b->rows[k + 1] - b->rows[k]);
    }
    return entries <= INT32_MAX ? entries : -1;
}

void perp__bodies_delassus(const perp__bodies *b, int32_t *column_starts, int32_t *row_indices,
                           double *values)
{
    int32_t at = 0;

    for (int32_t k = 0; k < b->constraints; k++) {
        const int32_t columns = b->rows[k + 1] - b->rows[k];
        int32_t height = 0, row = 0, other;

        start_neighbours(b, k);
        while ((other = next_neighbour(b, k, NULL)) >= 0)
            height += b->rows[other + 1] - b->rows[other];
        for (int32_t c = 0; c < columns; c++)
            column_starts[b->rows[k] + c] = at + c * height;
        start_neighbours(b, k);
        while ((other = next_neighbour(b, k, b->coupling)) >= 0) {
            const int32_t rows = b->rows[other + 1] - b->rows[other];

            for (int32_t i = 0; i < rows; i++, row++)
                for (int32_t c = 0; c < columns; c++) {
                    row_indices[at + c * height + row] = b->rows[other] + i;
                    values[at + c * height + row] = b->coupling[i * columns + c];
                }
        }
        at += columns * height;
    }
    column_starts[b->size] = at;
}
