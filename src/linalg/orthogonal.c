/* The modified Gram-Schmidt process with threshold pivoting. */
#include "linalg/orthogonal.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Rows have length 1; a remainder below the square root of rounding counts as dependent. Such a row
 * would determine a direction only with more error than the impulses that act on it have. */
#define RANK_TOLERANCE 1e-8

/* The first row with at least this share of the largest remainder is taken: among rows that serve
 * equally well the order of the caller decides, not rounding. */
#define PIVOT_THRESHOLD 0.5

static double dot(const double *a, const double *b, int32_t n)
{
    double sum = 0.0;

    for (int32_t i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

static void add(double *y, double s, const double *x, int32_t n)
{
    for (int32_t i = 0; i < n; i++)
        y[i] += s * x[i];
}

/* Where a vector is not 0: rows of large systems mostly are. Sums over less than that are the same
 * bits. */
typedef struct span {
    int32_t first, count;
} span;

static span span_of(const double *x, int32_t n)
{
    span s = {0, n};

    while (s.count > 0 && x[s.first + s.count - 1] == 0.0)
        s.count--;
    while (s.count > 0 && x[s.first] == 0.0) {
        s.first++;
        s.count--;
    }
    return s;
}

static double length_of(const double *row, int32_t n)
{
    const span s = span_of(row, n);

    return sqrt(dot(row + s.first, row + s.first, s.count));
}

/* The row to take next, or -1 if none is left that is independent. One with a norm that is no
 * number, or too large for one, never is. */
static int32_t choose_row(const double *norms, int32_t m)
{
    double largest = 0.0;
    int32_t i;

    for (i = 0; i < m; i++)
        if (norms[i] <= DBL_MAX)
            largest = fmax(largest, norms[i]);
    if (!(largest > RANK_TOLERANCE))
        return -1;
    for (i = 0; !(norms[i] >= PIVOT_THRESHOLD * largest && norms[i] <= DBL_MAX); i++)
        ;
    return i;
}

/* Takes the row as the next basis vector q; eta is the component of the solution along q. */
static double new_direction(double *q, const double *row, double norm, double target,
                            const double *basis, const double *particular, int32_t rank, int32_t n)
{
    double eta = target / norm;
    double length;

    for (int32_t i = 0; i < n; i++)
        q[i] = row[i] / norm;
    for (int32_t k = 0; k < rank; k++) { /* a second time: the first leaves rounding / norm */
        const double *b = basis + (size_t)k * (size_t)n;
        const span s = span_of(b, n);
        double share = dot(b + s.first, q + s.first, s.count);

        if (share == 0.0)
            continue;
        add(q + s.first, -share, b + s.first, s.count);
        eta -= share * dot(b + s.first, particular + s.first, s.count);
    }
    length = length_of(q, n);
    for (int32_t i = 0; i < n; i++)
        q[i] /= length;
    return eta / length;
}

/* Removes the direction q from a row. */
static void remove_direction(double *row, double *target, double *norm, const double *q, span s,
                             double eta, int32_t n)
{
    const double share = dot(row + s.first, q + s.first, s.count);

    if (share == 0.0)
        return;
    add(row + s.first, -share, q + s.first, s.count);
    *target -= share * eta;
    *norm = length_of(row, n);
}

int32_t perp__orthogonal_rows(double *rows, double *targets, int32_t *taken, double *norms,
                              double *basis, double *particular, int32_t m, int32_t n)
{
    int32_t rank, pick;

    memset(taken, 0, (size_t)m * sizeof *taken);
    memset(particular, 0, (size_t)n * sizeof *particular);
    for (int32_t i = 0; i < m; i++)
        norms[i] = length_of(rows + (size_t)i * (size_t)n, n);
    for (rank = 0; rank < n; rank++) {
        double *q = basis + (size_t)rank * (size_t)n;
        double eta;
        span s;

        pick = choose_row(norms, m);
        if (pick < 0)
            break;
        eta = new_direction(q, rows + (size_t)pick * (size_t)n, norms[pick], targets[pick], basis,
                            particular, rank, n);
        taken[pick] = 1;
        norms[pick] = 0.0;
        s = span_of(q, n);
        add(particular + s.first, eta, q + s.first, s.count);
        for (int32_t i = 0; i < m; i++)
            if (!taken[i])
                remove_direction(rows + (size_t)i * (size_t)n, &targets[i], &norms[i], q, s, eta,
                                 n);
    }
    return rank;
}

/* Twice: the second pass removes what rounding of the first one left. */
void perp__project_out(const double *basis, int32_t rank, int32_t n, double *y)
{
    for (int32_t pass = 0; pass < 2; pass++)
        for (int32_t k = 0; k < rank; k++) {
            const double *q = basis + (size_t)k * (size_t)n;
            const span s = span_of(q, n);
            const double share = dot(q + s.first, y + s.first, s.count);

            if (share != 0.0)
                add(y + s.first, -share, q + s.first, s.count);
        }
}

double perp__length(const double *x, int32_t n)
{
    double length = 0.0;

    for (int32_t i = 0; i < n; i++)
        if (x[i] != 0.0)
            length = length == 0.0 ? fabs(x[i]) : hypot(length, x[i]);
    return length;
}
