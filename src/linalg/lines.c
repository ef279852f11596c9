#include "linalg/lines.h"

int32_t perp__find_parts(const perp__matrix *M, int32_t *part)
{
    const int32_t n = M->rows;
    int32_t left = n, i, j, k;

    for (i = 0; i < n; i++)
        part[i] = i;
    for (j = 0; j < n && left > 1; j++) {
        const perp__line l = perp__line_of(M, j);

        for (k = 0; k < l.count; k++)
            if (l.values[k] != 0.0)
                left -= perp__join(part, l.indices ? l.indices[k] : k, j);
    }
    return perp__number_parts(part, n);
}
