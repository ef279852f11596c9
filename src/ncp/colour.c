/* Columns that can be differenced together: Curtis, Powell & Reid, "On the estimation of sparse
 * Jacobian matrices", J. Inst. Maths Applics 13 (1974). Greedy, in the order of the columns. */
#include <string.h>

#include "ncp/model.h"

/* The pattern by rows. */
static void transpose(perp__ncp_model *m)
{
    perp__ncp_colours *c = &m->colours;

    memset(c->row_starts, 0, ((size_t)m->n + 1) * sizeof(int32_t));
    for (int32_t k = 0; k < m->pattern_starts[m->n]; k++)
        c->row_starts[m->pattern_rows[k] + 1]++;
    for (int32_t i = 0; i < m->n; i++) {
        c->row_starts[i + 1] += c->row_starts[i];
        c->marks[i] = c->row_starts[i];
    }
    for (int32_t j = 0; j < m->n; j++)
        for (int32_t k = m->pattern_starts[j]; k < m->pattern_starts[j + 1]; k++)
            c->row_columns[c->marks[m->pattern_rows[k]]++] = j;
}

/* The least colour that no column of a row of column j has. */
static int32_t free_colour(perp__ncp_model *m, int32_t j)
{
    perp__ncp_colours *c = &m->colours;
    int32_t colour = 0;

    for (int32_t k = m->pattern_starts[j]; k < m->pattern_starts[j + 1]; k++) {
        const int32_t i = m->pattern_rows[k];

        for (int32_t p = c->row_starts[i]; p < c->row_starts[i + 1] && c->row_columns[p] < j; p++)
            if (c->of[c->row_columns[p]] >= 0)
                c->marks[c->of[c->row_columns[p]]] = j + 1;
    }
    while (c->marks[colour] == j + 1)
        colour++;
    return colour;
}

static void sort(perp__ncp_model *m)
{
    perp__ncp_colours *c = &m->colours;

    memset(c->starts, 0, ((size_t)m->n + 1) * sizeof(int32_t));
    for (int32_t j = 0; j < m->n; j++)
        if (c->of[j] >= 0)
            c->starts[c->of[j] + 1]++;
    for (int32_t k = 0; k < m->n; k++) {
        c->starts[k + 1] += c->starts[k];
        c->marks[k] = c->starts[k];
    }
    for (int32_t j = 0; j < m->n; j++)
        if (c->of[j] >= 0)
            c->order[c->marks[c->of[j]]++] = j;
}

void perp__ncp_colour(perp__ncp_model *m)
{
    perp__ncp_colours *c = &m->colours;

    if (c->known)
        return;
    c->known = 1;
    c->count = 0;
    if (m->sparse)
        transpose(m);
    if (m->n > 0)
        memset(c->marks, 0, (size_t)m->n * sizeof(int32_t));
    for (int32_t j = 0; j < m->n; j++) {
        c->of[j] = -1;
        if (m->lower[j] < m->upper[j])
            c->of[j] = m->sparse ? free_colour(m, j) : c->count;
        c->count = c->of[j] >= c->count ? c->of[j] + 1 : c->count;
    }
    sort(m);
}
