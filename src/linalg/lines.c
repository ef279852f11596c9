#include "linalg/lines.h"

#include <string.h>

/* Whether all lines from j on have an entry other than 0. */
static int32_t have_entries(const perp__matrix *M, int32_t j)
{
    for (; j < M->rows; j++) {
        const perp__line l = perp__line_of(M, j);
        int32_t k = 0;

        while (k < l.count && l.values[k] == 0.0)
            k++;
        if (k == l.count)
            return 0;
    }
    return 1;
}

int32_t perp__find_parts(const perp__matrix *M, int32_t *part)
{
    const int32_t n = M->rows;
    /* a line, row or column, is one kind of node, what crosses it the other */
    const int32_t lines = perp__lines_are_rows(M) ? 0 : n, others = n - lines;
    int32_t left = n, ask = 1, i, j, k; /* left: parts that the others are in */

    for (i = 0; i < 2 * n; i++)
        part[i] = i;
    for (j = 0; j < n; j++) {
        const perp__line l = perp__line_of(M, j);
        int32_t root = lines + j, seen = 0; /* nothing has brought in the line yet */

        if (left == 1 && ask && have_entries(M, 0)) { /* the lines hang on to the others */
            memset(part, 0, 2 * (size_t)n * sizeof *part);
            return 1;
        }
        ask = left > 1;
        for (k = 0; k < l.count && !(seen && left == 1); k++)
            if (l.values[k] != 0.0) {
                const int32_t other = perp__root_of(part, others + (l.indices ? l.indices[k] : k));

                left -= seen && other != root; /* the first only brings in the line itself */
                seen = 1;
                root = perp__link(part, root, other);
            }
    }
    return perp__number_parts(part, 2 * n);
}
