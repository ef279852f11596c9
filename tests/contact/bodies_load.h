/* What a problem made of bodies by hand needs, for tests below the front door. */
#ifndef PERP_TESTS_BODIES_LOAD_H
#define PERP_TESTS_BODIES_LOAD_H

#include "contact/bodies/bodies.h"

/* q := H M^-1 f + w, and + g for the rows of G (NULL: 0), by way of the bodies: P L^-1 f. */
static inline void bodies_load(const perp__bodies *b, const double *f, const double *w,
                               const double *g, double *q)
{
    perp__bodies_force(b, f);
    for (int32_t k = 0; k < b->constraints; k++)
        for (int32_t i = b->rows[k]; i < b->rows[k + 1]; i++) {
            const int32_t rows = b->rows[b->contacts];

            q[i] = i < rows ? w[i] : g ? g[i - rows] : 0.0;
            for (int64_t piece = b->piece_starts[k]; piece < b->piece_starts[k + 1]; piece++)
                for (int32_t j = 0; j < b->width; j++)
                    q[i] += b->values[b->piece_values[piece] + (i - b->rows[k]) * b->width + j] *
                            b->free[b->piece_blocks[piece] * b->width + j];
        }
}

/* trace[k] := trace(W_kk) */
static inline void bodies_traces(const perp__bodies *b, double *trace)
{
    for (int32_t k = 0; k < b->constraints; k++) {
        const int32_t rows = b->rows[k + 1] - b->rows[k];
        double W[36];

        perp__bodies_diagonal(b, k, W);
        trace[k] = 0.0;
        for (int32_t i = 0; i < rows; i++)
            trace[k] += W[i * rows + i];
    }
}

#endif
