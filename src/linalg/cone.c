/* Motzkin, Raiffa, Thompson & Thrall, "The double description method" (1953), with the
 * combinatorial test of adjacency of Fukuda & Prodon, "Double description method revisited" (1996).
 * Numbers below TOLERANCE of the largest in their row or ray count as 0. */
#include "linalg/cone.h"

#include <math.h>
#include <string.h>

#include "base/context.h"
#include "base/arena.h"
#include "linalg/blas.h"
#include "linalg/matrix.h"

/* Comparisons of two rays with a third: seconds. Each new ray is compared with all others, so that
 * there are no more than its root or so. */
#define PERP__MOST_EFFORT 1e9
static const double tolerance = 1e-9;

void perp__cone_release(perp__cone *cone)
{
    perp__release(cone->context, cone->A);
    perp__release(cone->context, cone->work);
    perp__release(cone->context, cone->chosen);
    perp__release(cone->context, cone->x);
    perp__release(cone->context, cone->tight);
    perp__release(cone->context, cone->values);
    cone->A = cone->work = cone->x = cone->values = NULL;
    cone->chosen = NULL;
    cone->tight = NULL;
    cone->capacity = cone->most_rows = cone->most_dimension = 0;
}

static perp_status reserve(perp__cone *cone, int32_t count)
{
    const size_t width = (size_t)cone->most_dimension, used = (size_t)cone->capacity;
    const perp__growing arrays[] = {PERP__GROWING(cone->x, used * width, width),
                                    PERP__GROWING(cone->values, used, 1),
                                    PERP__GROWING(cone->tight, used * 2, 2)};

    return perp__grow(cone->context, "the rays of a cone", &cone->capacity, count, arrays, 3);
}

perp_status perp__cone_fit(perp__cone *cone, int32_t rows, int32_t dimension)
{
    const size_t m = (size_t)rows, width = (size_t)dimension;
    perp_status status;

    cone->rows = rows;
    cone->dimension = dimension;
    cone->rays = cone->lines = 0;
    cone->effort = 0.0;
    if (rows <= cone->most_rows && dimension <= cone->most_dimension)
        return PERP_OK;
    perp__cone_release(cone);
    cone->A = perp__allocate(cone->context, m * width, sizeof *cone->A);
    cone->work = perp__allocate(cone->context, (m + 3 * width) * width, sizeof *cone->work);
    cone->chosen = perp__allocate(cone->context, 3 * width, sizeof *cone->chosen);
    if (!cone->A || !cone->work || !cone->chosen)
        return perp__fail_memory(cone->context, "the constraints of a cone");
    cone->most_rows = rows;
    cone->most_dimension = dimension;
    status = reserve(cone, 2 * dimension);
    if (status != PERP_OK) /* or the next call would find room for rays that is not there */
        perp__cone_release(cone);
    return status;
}

static void normalise(double *x, int32_t count)
{
    const double largest = perp__largest(x, count);

    for (int32_t k = 0; k < count && largest > 0.0; k++)
        x[k] /= largest;
}

/* Complete elimination with full pivoting on a copy of A, which stays in `work`; row 0 comes first.
 * chosen: pivot rows, then (from `dimension` on) pivot columns. Returns the rank. */
static int32_t eliminate(perp__cone *cone)
{
    const int32_t width = cone->dimension;
    double *T = cone->work;
    int32_t rank, i, j;

    memcpy(T, cone->A, (size_t)cone->rows * (size_t)width * sizeof *T);
    for (rank = 0; rank < width; rank++) {
        double best = tolerance, *pivot_row, pivot;
        int32_t row = -1, column = 0;

        for (i = 0; i < (rank == 0 ? 1 : cone->rows); i++) {
            bool used = 0;

            for (int32_t k = 0; k < rank; k++)
                used |= cone->chosen[k] == i;
            for (j = 0; j < width && !used; j++)
                if (fabs(T[i * width + j]) > best) {
                    best = fabs(T[i * width + j]);
                    row = i;
                    column = j;
                }
        }
        if (row < 0)
            break;
        pivot_row = T + row * width;
        pivot = pivot_row[column];
        cone->chosen[rank] = row;
        cone->chosen[width + rank] = column;
        for (j = 0; j < width; j++)
            pivot_row[j] = j == column ? 1.0 : pivot_row[j] / pivot;
        for (i = 0; i < cone->rows; i++) {
            const double factor = T[i * width + column];

            for (j = 0; j < width && i != row; j++)
                T[i * width + j] = j == column ? 0.0 : T[i * width + j] - factor * pivot_row[j];
        }
    }
    return rank;
}

static void mark(perp__cone *cone, int32_t ray, int32_t row)
{
    cone->tight[2 * ray + row / 64] |= UINT64_C(1) << (row % 64);
}

/* The chosen rows B alone make a simplicial cone, its rays are the columns of B^-1; coordinates
 * without a pivot are 0, where the lines make up for them. */
static void start(perp__cone *cone, int32_t rank)
{
    const int32_t width = cone->dimension;
    double *B = cone->work + (size_t)(cone->rows + width) * (size_t)width, *X = B + width * width;

    for (int32_t c = 0; c < rank; c++)
        for (int32_t r = 0; r < rank; r++) {
            B[r + rank * c] = cone->A[cone->chosen[r] * width + cone->chosen[width + c]];
            X[r + rank * c] = r == c ? 1.0 : 0.0;
        }
    perp__lu_factor(rank, B, rank, cone->chosen + 2 * width);
    perp__lu_solve_columns(rank, rank, B, rank, cone->chosen + 2 * width, X, rank, 0);
    memset(cone->x, 0, (size_t)rank * (size_t)width * sizeof *cone->x);
    memset(cone->tight, 0, (size_t)rank * 2 * sizeof *cone->tight);
    for (int32_t c = 0; c < rank; c++) {
        for (int32_t r = 0; r < rank; r++) {
            cone->x[c * width + cone->chosen[width + r]] = X[r + rank * c];
            if (r != c)
                mark(cone, c, cone->chosen[r]);
        }
        normalise(cone->x + c * width, width);
    }
    cone->rays = rank;
}

static int32_t count_bits(uint64_t bits)
{
    int32_t count = 0;

    for (; bits != 0; bits &= bits - 1)
        count++;
    return count;
}

/* Two rays span a face of dimension two if no third is tight wherever both are. */
static bool are_adjacent(perp__cone *cone, int32_t a, int32_t b, int32_t rank)
{
    const uint64_t low = cone->tight[2 * a] & cone->tight[2 * b];
    const uint64_t high = cone->tight[2 * a + 1] & cone->tight[2 * b + 1];

    if (count_bits(low) + count_bits(high) < rank - 2)
        return 0;
    cone->effort += cone->rays;
    for (int32_t k = 0; k < cone->rays; k++)
        if (k != a && k != b && (low & ~cone->tight[2 * k]) == 0 &&
            (high & ~cone->tight[2 * k + 1]) == 0)
            return 0;
    return 1;
}

/* Appends the point of the span of a and b where row `row` is 0. */
static perp_status combine(perp__cone *cone, int32_t at, int32_t a, int32_t b, int32_t row)
{
    const int32_t width = cone->dimension;
    perp_status status;
    double *x;

    status = reserve(cone, at + 1);
    if (status != PERP_OK)
        return status;
    x = cone->x + (size_t)at * (size_t)width;
    for (int32_t j = 0; j < width; j++)
        x[j] = cone->values[a] * cone->x[b * width + j] - cone->values[b] * cone->x[a * width + j];
    normalise(x, width);
    cone->values[at] = 0.0;
    cone->tight[2 * at] = cone->tight[2 * a] & cone->tight[2 * b];
    cone->tight[2 * at + 1] = cone->tight[2 * a + 1] & cone->tight[2 * b + 1];
    mark(cone, at, row);
    return PERP_OK;
}

/* Cuts the cone with one more half-space. */
static perp_status cut(perp__cone *cone, int32_t row, int32_t rank)
{
    const size_t width = (size_t)cone->dimension;
    perp_status status = PERP_OK;
    int32_t total = cone->rays, kept = 0;

    /* 1. On which side rays are. */
    for (int32_t a = 0; a < cone->rays; a++) {
        const double sum =
            perp__dot(cone->A + (size_t)row * width, cone->x + (size_t)a * width, cone->dimension);

        cone->values[a] = fabs(sum) <= tolerance ? 0.0 : sum;
    }
    /* 2. A new one between every two neighbours on different sides. */
    for (int32_t a = 0; a < cone->rays && status == PERP_OK; a++) {
        if (!(cone->values[a] > 0.0))
            continue;
        cone->effort += cone->rays;
        for (int32_t b = 0; b < cone->rays && status == PERP_OK; b++) {
            if (!(cone->values[b] < 0.0) || !are_adjacent(cone, a, b, rank))
                continue;
            status = combine(cone, total++, a, b, row);
            if (status == PERP_OK && cone->effort > PERP__MOST_EFFORT)
                status = PERP__CONE_TOO_LARGE;
        }
    }
    /* 3. Those on the right side stay. */
    for (int32_t k = 0; k < total && status == PERP_OK; k++) {
        if (cone->values[k] < 0.0)
            continue;
        if (cone->values[k] == 0.0)
            mark(cone, k, row);
        memmove(cone->x + (size_t)kept * width, cone->x + (size_t)k * width,
                width * sizeof *cone->x);
        cone->tight[2 * kept] = cone->tight[2 * k];
        cone->tight[2 * kept + 1] = cone->tight[2 * k + 1];
        kept++;
    }
    if (status == PERP_OK)
        cone->rays = kept;
    return status;
}

perp_status perp__cone_enumerate(perp__cone *cone)
{
    const size_t width = (size_t)cone->dimension;
    double *lines = cone->work + (size_t)cone->rows * width;
    perp_status status = PERP_OK;
    int32_t rank;

    for (int32_t i = 0; i < cone->rows; i++)
        normalise(cone->A + (size_t)i * width, cone->dimension);
    rank = eliminate(cone);
    /* 1. The null space of A, a line for every column without a pivot, behind that work. */
    cone->lines = 0;
    for (int32_t j = 0; j < cone->dimension; j++) {
        double *line = lines + (size_t)cone->lines * width;
        bool is_pivot = 0;

        for (int32_t k = 0; k < rank; k++)
            is_pivot |= cone->chosen[cone->dimension + k] == j;
        if (is_pivot)
            continue;
        memset(line, 0, width * sizeof *line);
        line[j] = 1.0;
        for (int32_t k = 0; k < rank; k++)
            line[cone->chosen[cone->dimension + k]] =
                -cone->work[cone->chosen[k] * cone->dimension + j];
        normalise(line, cone->dimension);
        cone->lines++;
    }
    /* 2. Rays: those of the chosen rows, cut by one row after the other. */
    start(cone, rank);
    for (int32_t i = 0; i < cone->rows && status == PERP_OK; i++) {
        bool used = 0;

        for (int32_t k = 0; k < rank; k++)
            used |= cone->chosen[k] == i;
        if (!used)
            status = cut(cone, i, rank);
    }
    /* 3. The lines come behind them. */
    PERP__THEN(status, reserve(cone, cone->rays + cone->lines));
    if (status == PERP_OK && cone->lines > 0)
        memcpy(cone->x + (size_t)cone->rays * width, lines,
               (size_t)cone->lines * width * sizeof *cone->x);
    return status;
}
