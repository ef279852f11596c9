/* perp_lcp_batch: many problems, threads, and the same bits whatever their number. */
#include <string.h>

#include "problem.h"

typedef struct batch {
    int32_t n, count;
    double *M, *q, *lower, *upper;
    lcp_problem *problems;
} batch;

static void make(fuzz_bytes *bytes, batch *b)
{
    int32_t n, k, i;

    b->count = fuzz_pick(bytes, 8);
    b->problems = fuzz_take(b->count, sizeof *b->problems);
    b->n = fuzz_pick(bytes, 6);
    n = b->n;
    b->M = fuzz_doubles(b->count * n * n);
    b->q = fuzz_doubles(b->count * n);
    b->lower = fuzz_doubles(b->count * n);
    b->upper = fuzz_doubles(b->count * n);
    for (k = 0; k < b->count; k++) {
        lcp_problem *p = &b->problems[k];

        lcp_problem_make(bytes, p, n, n);
        memcpy(&b->M[k * n * n], p->M.dense, (size_t)(n * n) * sizeof(double));
        for (i = 0; i < n; i++) {
            b->q[k * n + i] = p->q[i];
            b->lower[k * n + i] = p->lower[i];
            b->upper[k * n + i] = p->upper[i];
        }
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_bytes bytes = {data, data + size};
    perp_context *context = fuzz_open(&bytes, 1);
    perp_lcp_settings settings;
    int ended_early = lcp_settings_make(&bytes, &settings), round;
    int32_t threads = 1 + fuzz_one_in(&bytes, 16), k, n;
    double *z[2], *w[2], *residuals[2];
    int32_t *outcomes[2];
    batch b;

    make(&bytes, &b);
    n = b.n;
    for (round = 0; round < 1 + (threads > 1 && settings.time_limit == 0); round++) {
        const void *outputs[] = {z[round] = fuzz_doubles(b.count * n),
                                 w[round] = fuzz_doubles(b.count * n),
                                 residuals[round] = fuzz_doubles(b.count),
                                 outcomes[round] = fuzz_take(b.count, sizeof(int32_t)), NULL};
        perp_status status = perp_lcp_batch(context, z[round], w[round], outcomes[round],
                                            residuals[round], &settings, round ? 1 : threads,
                                            LCP_STACK(b.count, n, b.M, b.q, b.lower, b.upper));

        if (!fuzz_status_of(context, status, "perp_lcp_batch", outputs))
            break;
        for (k = 0; k < b.count; k++) {
            if (outcomes[round][k] == PERP_OUTCOME_TIME_LIMIT)
                continue; /* w is nan then */
            lcp_problem_check("batch", &b.problems[k], &z[round][k * n], &w[round][k * n],
                              outcomes[round][k], settings.tol, ended_early);
            if (outcomes[round][k] == PERP_OUTCOME_SOLVED && !(residuals[round][k] <= settings.tol))
                fuzz_fail("batch: 'solved' with tested residual %g", residuals[round][k]);
        }
        if (round && memcmp(z[0], z[1], (size_t)(b.count * n) * sizeof(double)) != 0)
            fuzz_fail("batch: the same bits with any number of threads");
    }
    fuzz_close(context);
    return 0;
}
