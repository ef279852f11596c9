#include "linalg/lines.h"

int32_t perp__find_parts(const perp__matrix *M, int32_t *part)
{
    const int32_t n = M->rows;
    /* a line, row or column, is one kind of node, what crosses it the other */
    const int32_t lines = perp__lines_are_rows(M) ? 0 : n, others = n - lines;
    int32_t left = n, i, j, k; /* parts that the others are in */

    for (i = 0; i < 2 * n; i++)
        part[i] = i;
    for (j = 0; j < n; j++) {
        const perp__line l = perp__line_of(M, j);
        int32_t seen = 0;

        for (k = 0; k < l.count && !(seen && left == 1); k++)
            if (l.values[k] != 0.0) {
                const int32_t joined =
                    perp__join(part, others + (l.indices ? l.indices[k] : k), lines + j);

                left -= joined && seen; /* the first only brings in the line itself */
                seen = 1;
            }
    }
    return perp__number_parts(part, 2 * n);
}
