/* Dense LCPs with a random positive definite matrix, M = A A'/n + I/10 with A_ij in (-1,1), q_i in
 * (-1,1): about half of the variables are positive. The solver is created and set up once; the time
 * is the median of repeated solves from cold. 'in LU' counts it in factorisations of M at the speed
 * of dgemm, so that machines can be compared. */
#include "measure.h"

enum { MAX_REPEATS = 200 };

static const double seconds_for_a_row = 1.0;

typedef struct problem {
    int n;
    double *M, *q, *z;
} problem;

static void create(problem *lcp, int n)
{
    size_t size = (size_t)n * (size_t)n;
    uint64_t seed = (uint64_t)n;
    double *A = require_memory(size * sizeof *A);
    lcp->n = n;
    lcp->M = require_memory(size * sizeof *lcp->M);
    lcp->q = require_memory((size_t)n * sizeof *lcp->q);
    lcp->z = require_memory((size_t)n * sizeof *lcp->z);
    for (size_t k = 0; k < size; k++)
        A[k] = random_number(&seed);
    for (int i = 0; i < n; i++) {
        lcp->q[i] = random_number(&seed);
        for (int j = 0; j <= i; j++) {
            double sum = i == j ? 0.1 * n : 0;
            for (int k = 0; k < n; k++)
                sum += A[(size_t)i * (size_t)n + (size_t)k] * A[(size_t)j * (size_t)n + (size_t)k];
            lcp->M[(size_t)i * (size_t)n + (size_t)j] = sum / n;
            lcp->M[(size_t)j * (size_t)n + (size_t)i] = sum / n;
        }
    }
    free(A);
}

static void measure(perp_context *context, const problem *lcp, int32_t method, double gflops)
{
    double times[MAX_REPEATS], spent = 0, cubic = 2.0 / 3 * pow(lcp->n, 3);
    int repeats = 0;
    perp_lcp_settings settings;
    perp_lcp_result result;
    perp_lcp_solver *solver = NULL;
    perp_matrix view;
    perp_lcp_settings_init(&settings, sizeof settings);
    perp_lcp_result_init(&result, sizeof result);
    perp_matrix_init(&view, sizeof view);
    perp_matrix_dense(&view, PERP_STORAGE_COLUMN_MAJOR, lcp->n, lcp->n, lcp->M, lcp->n);
    settings.method = method;
    perp_status status = perp_lcp_solver_create(context, &solver, &settings);
    if (status == PERP_OK)
        status = perp_lcp_solver_setup(solver, &view, NULL, NULL);
    if (status == PERP_OK) /* the first solve allocates: it is not timed */
        status = perp_lcp_solver_solve(solver, lcp->z, NULL, NULL, &result, lcp->q, NULL);
    while (status == PERP_OK && repeats < MAX_REPEATS &&
           (repeats < 3 || spent < seconds_for_a_row)) {
        double start = seconds_now();
        status = perp_lcp_solver_solve(solver, lcp->z, NULL, NULL, &result, lcp->q, NULL);
        times[repeats] = seconds_now() - start;
        spent += times[repeats++];
        if (spent > 4 * seconds_for_a_row)
            break;
    }
    if (status != PERP_OK) {
        printf("%6d %-8s %s\n", lcp->n, perp_lcp_method_text(method),
               perp_context_message(context));
    } else {
        double time = median(times, repeats);
        printf("%6d %-8s %-8s %-15s %8.1e %8.1e %7lld %11.3f", lcp->n, perp_lcp_method_text(method),
               perp_lcp_method_text(result.method), perp_outcome_text(result.outcome),
               result.residual, result.backward_error, (long long)result.iterations, 1e3 * time);
        if (gflops > 0)
            printf(" %9.1f", time * gflops * 1e9 / cubic);
        printf(" %7d\n", repeats);
    }
    perp_lcp_solver_destroy(solver);
}

int main(void)
{
    static const int sizes[] = {10, 100, 200, 500, 1000};
    static const int32_t methods[] = {PERP_LCP_AUTO, PERP_LCP_LEMKE, PERP_LCP_ACTIVE_SET,
                                      PERP_LCP_FISCHER, PERP_LCP_PGS};
    double gflops, gbytes;
    perp_context *context = NULL;
    require(perp_context_create(&context, NULL) == PERP_OK, "no context");
    print_machine_speed(&gflops, &gbytes);
    printf("\n%6s %-8s %-8s %-15s %8s %8s %7s %11s %9s %7s\n", "n", "method", "answered", "outcome",
           "residual", "backward", "iter.", "ms", "in LU", "repeats");
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
        problem lcp;
        create(&lcp, sizes[s]);
        for (size_t m = 0; m < sizeof methods / sizeof *methods; m++)
            measure(context, &lcp, methods[m], gflops);
        free(lcp.M);
        free(lcp.q);
        free(lcp.z);
    }
    perp_context_destroy(context);
    return 0;
}
