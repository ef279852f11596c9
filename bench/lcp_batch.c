/* Many small LCPs in one call: perp_lcp_batch against a loop of perp_lcp_solver_setup and _solve
 * over the same problems, in the same run. M = A A'/n + I/10 (symmetric), or that with a skew part
 * (unsymmetric). 'us' is the median time a problem, 'solved' counts outcomes, 'residual' is the
 * worst tested residual, 'speed-up' that over the loop. */
#include "measure.h"

typedef struct problems {
    int32_t n;
    int64_t count;
    double *M, *q, *z, *residuals;
    int32_t *outcomes;
} problems;

static void create(problems *p, int32_t n, int64_t count, double skew)
{
    const size_t all = (size_t)count * (size_t)n;
    uint64_t seed = 7;
    double A[32 * 32];
    p->n = n;
    p->count = count;
    p->M = require_memory(all * (size_t)n * sizeof(double));
    p->q = require_memory(all * sizeof(double));
    p->z = require_memory(all * sizeof(double));
    p->residuals = require_memory((size_t)count * sizeof(double));
    p->outcomes = require_memory((size_t)count * sizeof(int32_t));
    for (int64_t k = 0; k < count; k++) {
        double *M = p->M + (size_t)k * (size_t)n * (size_t)n;
        for (int i = 0; i < n * n; i++)
            A[i] = random_number(&seed);
        for (int i = 0; i < n; i++) {
            for (int j = 0; j < n; j++) {
                double sum = i == j ? 0.1 : 0;
                for (int m = 0; m < n; m++)
                    sum += A[i * n + m] * A[j * n + m] / n;
                M[i * n + j] = sum + skew * (A[i * n + j] - A[j * n + i]);
            }
            p->q[(size_t)k * (size_t)n + (size_t)i] = random_number(&seed);
        }
    }
}

static void destroy(problems *p)
{
    free(p->M);
    free(p->q);
    free(p->z);
    free(p->residuals);
    free(p->outcomes);
}

static void report(const problems *p, const char *how, double *times, int repeats, double alone)
{
    int64_t solved = 0;
    double worst = 0, time = median(times, repeats);
    for (int64_t k = 0; k < p->count; k++) {
        solved += p->outcomes[k] == PERP_OUTCOME_SOLVED;
        worst = fmax(worst, p->residuals[k]);
    }
    printf("%4d %8lld %-12s %9.3f %9lld %10.1e", p->n, (long long)p->count, how,
           1e6 * time / (double)p->count, (long long)solved, worst);
    if (alone > 0)
        printf(" %8.1f", alone / time);
    printf("\n");
}

static double loop(perp_context *context, problems *p)
{
    perp_lcp_solver *solver = NULL;
    perp_lcp_result result;
    perp_matrix M;
    double start = seconds_now();
    perp_status status = perp_lcp_solver_create(context, &solver, NULL);
    perp_struct_init(&result, sizeof result);
    perp_struct_init(&M, sizeof M);
    for (int64_t k = 0; k < p->count && status == PERP_OK; k++) {
        const size_t at = (size_t)k * (size_t)p->n;
        perp_matrix_dense(&M, PERP_STORAGE_ROW_MAJOR, p->n, p->n, p->M + at * (size_t)p->n, p->n);
        status = perp_lcp_solver_setup(solver, &M, NULL, NULL);
        if (status == PERP_OK)
            status = perp_lcp_solver_solve(solver, p->z + at, NULL, NULL, &result, p->q + at, NULL);
        p->outcomes[k] = result.outcome;
        p->residuals[k] = result.residual;
    }
    require(status == PERP_OK, perp_context_message(context));
    perp_lcp_solver_destroy(solver);
    return seconds_now() - start;
}

static void measure(perp_context *context, problems *p)
{
    double times[7], alone;
    static const int32_t threads[] = {1, 2};
    const perp_lcp_stack stack = {
        .struct_size = sizeof stack, .count = p->count, .n = p->n, .M = p->M, .q = p->q};
    times[0] = alone = loop(context, p);
    report(p, "loop", times, 1, 0);
    for (size_t t = 0; t < sizeof threads / sizeof *threads; t++) {
        char how[32];
        for (int k = 0; k < 7; k++) {
            double start = seconds_now();
            perp_status status = perp_lcp_batch(context, p->z, NULL, p->outcomes, p->residuals,
                                                NULL, threads[t], &stack);
            times[k] = seconds_now() - start;
            require(status == PERP_OK, perp_context_message(context));
        }
        snprintf(how, sizeof how, "%d thread%s", (int)threads[t], threads[t] > 1 ? "s" : "");
        report(p, how, times, 7, alone);
    }
}

int main(void)
{
    static const int32_t sizes[] = {3, 6, 12, 24};
    double gflops, gbytes;
    perp_context *context = NULL;
    require(perp_context_create(&context, NULL) == PERP_OK, "no context");
    print_machine_speed(&gflops, &gbytes);
    for (int skew = 0; skew < 2; skew++) {
        printf("\n%s\n%4s %8s %-12s %9s %9s %10s %8s\n", skew ? "unsymmetric" : "symmetric", "n",
               "count", "how", "us", "solved", "residual", "speed-up");
        for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
            problems p;
            create(&p, sizes[s], 100000, 0.2 * skew);
            measure(context, &p);
            destroy(&p);
        }
    }
    perp_context_destroy(context);
    return 0;
}
