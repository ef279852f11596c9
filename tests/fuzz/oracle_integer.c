/* Small integer problems, exactly. */
#include "oracle.h"

/* Minors of order 6 of entries up to 3 are at most (3 sqrt 6)^6 < 2^18 (Hadamard): the products of
 * two of them that Bareiss's elimination makes fit an int64_t. */
typedef struct equations {
    int rows, columns;
    int64_t T[ORACLE_LARGEST][ORACLE_LARGEST + 1]; /* (A, b) */
} equations;

static void exchange_rows(equations *s, int a, int b)
{
    int k;

    for (k = 0; k <= s->columns; k++) {
        int64_t kept = s->T[a][k];

        s->T[a][k] = s->T[b][k];
        s->T[b][k] = kept;
    }
}

static void eliminate_column(equations *s, int k, int64_t last)
{
    int i, j;

    for (i = 0; i < s->rows; i++)
        for (j = s->columns; i != k && j >= 0; j--)
            if (j != k)
                s->T[i][j] = (s->T[k][k] * s->T[i][j] - s->T[i][k] * s->T[k][j]) / last;
    for (i = 0; i < s->rows; i++)
        if (i != k)
            s->T[i][k] = 0;
}

/* The one x with A x = b: x_k = T[k][columns] / the result. 0 where there is none or several. */
static int64_t solve(equations *s)
{
    int64_t last = 1;
    int i, k;

    for (k = 0; k < s->columns; k++) {
        for (i = k; i < s->rows && s->T[i][k] == 0; i++)
            ;
        if (i >= s->rows)
            return 0;
        exchange_rows(s, i, k);
        eliminate_column(s, k, last);
        last = s->T[k][k];
    }
    for (i = s->columns; i < s->rows; i++)
        if (s->T[i][s->columns] != 0)
            return 0;
    return last;
}

/* The point with support `support` where w = 0 on `zero`: numerators and denominator > 0, if it is
 * unique, non-negative and has w >= 0. */
static int64_t point_of(int n, const int *M, const int *q, unsigned support, unsigned zero,
                        int64_t *z)
{
    equations s = {0, 0, {{0}}};
    int columns[ORACLE_LARGEST], i, j;
    int64_t denominator;

    for (j = 0; j < n; j++)
        if (support >> j & 1u)
            columns[s.columns++] = j;
    for (i = 0; i < n; i++)
        if (zero >> i & 1u) {
            for (j = 0; j < s.columns; j++)
                s.T[s.rows][j] = M[i * n + columns[j]];
            s.T[s.rows++][s.columns] = -q[i];
        }
    denominator = solve(&s);
    for (i = 0; i < n; i++)
        z[i] = 0;
    for (j = 0; j < s.columns; j++)
        z[columns[j]] = denominator < 0 ? -s.T[j][s.columns] : s.T[j][s.columns];
    denominator = denominator < 0 ? -denominator : denominator;
    for (i = 0; i < n && denominator > 0; i++) {
        int64_t w = q[i] * denominator;

        for (j = 0; j < n; j++)
            w += M[i * n + j] * z[j];
        if (z[i] < 0 || w < 0)
            return 0;
    }
    return denominator;
}

/* A vertex of a piece {z_A >= 0, z_N = 0, w_A = 0, w_N >= 0}: columns of (-M, I) that carry it are
 * independent, so its support S within A is the only point with w_A = 0. */
int32_t oracle_vertices(int32_t n, const int *M, const int *q, oracle_vertex *vertices)
{
    int64_t z[ORACLE_LARGEST], denominator;
    unsigned zero, support;
    int32_t count = 0, i;

    for (zero = 0; zero < 1u << n; zero++)
        for (support = zero;; support = (support - 1) & zero) {
            denominator = point_of(n, M, q, support, zero, z);
            if (denominator > 0) {
                for (i = 0; i < n; i++)
                    vertices[count].z[i] = (double)z[i] / (double)denominator;
                count++;
            }
            if (support == 0)
                break;
        }
    return count;
}

/* {z >= 0, M z + q >= 0} has no line: it is empty or has a vertex, where as many rows are 0 as
 * there are numbers in the support. */
int oracle_feasible(int32_t n, const int *M, const int *q)
{
    int64_t z[ORACLE_LARGEST];
    unsigned zero, support;

    for (zero = 0; zero < 1u << n; zero++)
        for (support = 0; support < 1u << n; support++)
            if (__builtin_popcount(zero) == __builtin_popcount(support) &&
                point_of(n, M, q, support, zero, z) > 0)
                return 1;
    return 0;
}

int oracle_nondegenerate(int32_t n, const int *M)
{
    unsigned set;

    for (set = 1; set < 1u << n; set++) {
        equations s = {0, 0, {{0}}};
        int i, j;

        for (i = 0; i < n; i++)
            if (set >> i & 1u) {
                s.columns = 0;
                for (j = 0; j < n; j++)
                    if (set >> j & 1u)
                        s.T[s.rows][s.columns++] = M[i * n + j];
                s.rows++;
            }
        if (solve(&s) == 0)
            return 0;
    }
    return 1;
}
