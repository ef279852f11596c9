/* Dense LCPs with a random positive definite matrix, M = A A'/n + I/10 with A_ij in (-1,1), q_i in
 * (-1,1): about half of the variables are positive. The solver is created and set up once; the time
 * is the median of repeated solves from cold, everything included. 'crash' is settings.crash: 0 is
 * Lemke's path from its cold start. 'dgemm' is measured just before the row, in GFlop/s, and 'in
 * LU' counts the time in factorisations of M at that speed, so that machines can be compared. Below
 * n = 10 the methods are those that `auto` takes there. */
#include "measure.h"

enum { MAX_REPEATS = 200 };

static const double seconds_for_a_row = 1.0;

typedef struct mode {
    int32_t method, crash;
} mode;

typedef struct problem {
    int n;
    double *M, *q, *z;
} problem;

/* In eight sums, which compilers make vectors of. */
static double product(const double *a, const double *b, int n)
{
    double sums[8] = {0}, sum = 0;
    int k = 0;
    for (; k + 8 <= n; k += 8)
        for (int lane = 0; lane < 8; lane++)
            sums[lane] += a[k + lane] * b[k + lane];
    for (; k < n; k++)
        sum += a[k] * b[k];
    for (int lane = 0; lane < 8; lane++)
        sum += sums[lane];
    return sum;
}

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
            double entry = product(A + (size_t)i * (size_t)n, A + (size_t)j * (size_t)n, n) / n +
                           (i == j ? 0.1 : 0);
            lcp->M[(size_t)i * (size_t)n + (size_t)j] = entry;
            lcp->M[(size_t)j * (size_t)n + (size_t)i] = entry;
        }
    }
    free(A);
}

/* Seconds of one solve: the mean of `count`, so that the clock's own time does not show. */
static double time_of(perp_lcp_solver *solver, const problem *lcp, perp_lcp_result *result,
                      int count, perp_status *status)
{
    double start = seconds_now();
    for (int k = 0; k < count && *status == PERP_OK; k++)
        *status = perp_lcp_solver_solve(solver, lcp->z, NULL, NULL, result, lcp->q, NULL);
    return (seconds_now() - start) / count;
}

static void measure(perp_context *context, const problem *lcp, mode how)
{
    double times[MAX_REPEATS], spent = 0, cubic = 2.0 / 3 * pow(lcp->n, 3);
    double gflops = dgemm_speed();
    int repeats = 0, count = lcp->n < 100 ? 100 : lcp->n < 500 ? 5 : 1;
    perp_lcp_settings settings;
    perp_lcp_result result;
    perp_lcp_solver *solver = NULL;
    perp_matrix view;
    perp_lcp_settings_init(&settings, sizeof settings);
    perp_struct_init(&result, sizeof result);
    perp_struct_init(&view, sizeof view);
    perp_matrix_dense(&view, PERP_STORAGE_COLUMN_MAJOR, lcp->n, lcp->n, lcp->M, lcp->n);
    settings.method = how.method;
    settings.crash = how.crash;
    perp_status status = perp_lcp_solver_create(context, &solver, &settings);
    if (status == PERP_OK)
        status = perp_lcp_solver_setup(solver, &view, NULL, NULL);
    if (status == PERP_OK) /* the first solve allocates: it is not timed */
        status = perp_lcp_solver_solve(solver, lcp->z, NULL, NULL, &result, lcp->q, NULL);
    while (status == PERP_OK && repeats < MAX_REPEATS &&
           (repeats < 3 || spent < seconds_for_a_row)) {
        times[repeats] = time_of(solver, lcp, &result, count, &status);
        spent += count * times[repeats++];
        if (spent > 4 * seconds_for_a_row)
            break;
    }
    printf("%6d %-10s %5d ", lcp->n, perp_lcp_method_text(how.method), (int)how.crash);
    if (status != PERP_OK) {
        printf("%s\n", perp_context_message(context));
    } else {
        double time = median(times, repeats);
        printf("%-10s %-14s %8.1e %8.1e %5lld %11.2f %6.1f", perp_lcp_method_text(result.method),
               perp_outcome_text(result.outcome), result.residual, result.backward_error,
               (long long)result.iterations, 1e6 * time, gflops);
        if (gflops > 0)
            printf(" %8.2f", time * gflops * 1e9 / cubic);
        printf(" %7d\n", repeats);
    }
    fflush(stdout);
    perp_lcp_solver_destroy(solver);
}

int main(void)
{
    static const int sizes[] = {4, 6, 10, 100, 200, 500, 1000, 2000};
    static const mode modes[] = {{PERP_LCP_AUTO, 1},    {PERP_LCP_LEMKE, 0},
                                 {PERP_LCP_LEMKE, 1},   {PERP_LCP_ACTIVE_SET, 1},
                                 {PERP_LCP_FISCHER, 1}, {PERP_LCP_PGS, 1}};
    double gflops, gbytes;
    perp_context *context = NULL;
    require(perp_context_create(&context, NULL) == PERP_OK, "no context");
    print_machine_speed(&gflops, &gbytes);
    printf("\n%6s %-10s %5s %-10s %-14s %8s %8s %5s %11s %6s %8s %7s\n", "n", "method", "crash",
           "answered", "outcome", "residual", "backward", "iter.", "us", "dgemm", "in LU",
           "repeats");
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
        problem lcp;
        create(&lcp, sizes[s]);
        for (size_t m = 0; m < (sizes[s] < 10 ? 3 : sizeof modes / sizeof *modes); m++)
            measure(context, &lcp, modes[m]);
        free(lcp.M);
        free(lcp.q);
        free(lcp.z);
    }
    perp_context_destroy(context);
    return 0;
}
