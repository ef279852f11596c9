/* The membrane over a hemisphere (examples/data/README.md) on finer and finer grids: n = k^2
 * unknowns, five-point Laplacian in compressed columns. 'ns' is the time for a nonzero of M and an
 * iteration: for pgs what a sweep costs; reading value and index of a nonzero from memory once
 * takes 12 bytes at the speed of the triad. 'error' is the largest distance to the exact membrane:
 * what the grid is worth, whatever the residual says. */
#include "measure.h"

typedef struct problem {
    int32_t n, nonzeros;
    int32_t *starts, *rows;
    double *values, *q, *lower, *exact, *z;
} problem;

/* The free membrane is harmonic outside of r = a, a^2 (1 - ln(a/2)) = 1. */
static double height(double x, double y)
{
    const double a = 0.69796514822337357, r = hypot(x, y);
    return r <= a ? sqrt(1 - r * r) : -a * a / sqrt(1 - a * a) * log(r / 2);
}

static void allocate(problem *lcp, int k)
{
    size_t n = (size_t)k * (size_t)k;
    lcp->n = (int32_t)n;
    lcp->starts = require_memory((n + 1) * sizeof *lcp->starts);
    lcp->rows = require_memory(5 * n * sizeof *lcp->rows);
    lcp->values = require_memory(5 * n * sizeof *lcp->values);
    lcp->q = require_memory(4 * n * sizeof *lcp->q);
    lcp->lower = lcp->q + n;
    lcp->exact = lcp->lower + n;
    lcp->z = lcp->exact + n;
}

static void create(problem *lcp, int k)
{
    static const int across[] = {0, -1, 0, 1, 0}, along[] = {-1, 0, 0, 0, 1};
    double h = 4.0 / (k + 1);
    int32_t count = 0;
    allocate(lcp, k);
    for (int j = 0, node = 0; j < k; j++) {
        for (int i = 0; i < k; i++, node++) {
            double x = -2 + h * (i + 1), y = -2 + h * (j + 1), r2 = x * x + y * y;
            lcp->starts[node] = count;
            lcp->q[node] = 0;
            lcp->exact[node] = height(x, y);
            lcp->lower[node] = r2 < 1 ? sqrt(1 - r2) : -INFINITY;
            for (int d = 0; d < 5; d++) {
                int a = i + across[d], b = j + along[d];
                if (a < 0 || a >= k || b < 0 || b >= k) {
                    lcp->q[node] -= height(-2 + h * (a + 1), -2 + h * (b + 1));
                    continue;
                }
                lcp->rows[count] = a + k * b;
                lcp->values[count++] = d == 2 ? 4 : -1;
            }
        }
    }
    lcp->starts[lcp->n] = count;
    lcp->nonzeros = count;
}

static double largest_error(const problem *lcp)
{
    double error = 0;
    for (int32_t i = 0; i < lcp->n; i++)
        error = fmax(error, fabs(lcp->z[i] - lcp->exact[i]));
    return error;
}

static void measure(perp_context *context, const problem *lcp, int32_t method, double relaxation,
                    double gbytes)
{
    perp_lcp_settings settings;
    perp_lcp_result result;
    perp_lcp_solver *solver = NULL;
    perp_matrix view;
    double times[3];
    int repeats = 0;
    perp_lcp_settings_init(&settings, sizeof settings);
    perp_struct_init(&result, sizeof result);
    perp_struct_init(&view, sizeof view);
    perp_matrix_csc(&view, lcp->n, lcp->n, lcp->starts, lcp->rows, lcp->values);
    settings.method = method;
    settings.relaxation = relaxation;
    if (method == PERP_LCP_PGS) {
        settings.max_iterations = lcp->n > 20000 ? 500 : 5000;
        settings.polish = 0; /* sweeps and nothing else */
    }
    perp_status status = perp_lcp_solver_create(context, &solver, &settings);
    if (status == PERP_OK)
        status = perp_lcp_solver_setup(solver, &view, lcp->lower, NULL);
    /* the first solve allocates; it counts only where it is too long to be repeated */
    for (int k = 0; k < 4 && status == PERP_OK; k++) {
        double start = seconds_now();
        status = perp_lcp_solver_solve(solver, lcp->z, NULL, NULL, &result, lcp->q, NULL);
        double time = seconds_now() - start;
        if (k > 0 || time > 2)
            times[repeats++] = time;
        if (time > 2)
            break;
    }
    if (status != PERP_OK) {
        printf("%7d %-7s %s\n", lcp->n, perp_lcp_method_text(method),
               perp_context_message(context));
    } else {
        double time = median(times, repeats);
        double each = 1e9 * time / ((double)result.iterations * lcp->nonzeros);
        printf("%7d %-7s %4.2f %-8s %-15s %8.1e %8.1e %8.1e %7lld %10.2f %8.2f %6.1f\n", lcp->n,
               perp_lcp_method_text(method), relaxation, perp_lcp_method_text(result.method),
               perp_outcome_text(result.outcome), result.residual, result.backward_error,
               largest_error(lcp), (long long)result.iterations, 1e3 * time, each,
               each * gbytes / 12);
    }
    perp_lcp_solver_destroy(solver);
}

static void free_problem(problem *lcp)
{
    free(lcp->starts);
    free(lcp->rows);
    free(lcp->values);
    free(lcp->q);
}

int main(void)
{
    static const int sizes[] = {16, 32, 64, 128, 256};
    double gflops, gbytes;
    perp_context *context = NULL;
    require(perp_context_create(&context, NULL) == PERP_OK, "no context");
    print_machine_speed(&gflops, &gbytes);
    printf("\n%7s %-7s %4s %-8s %-15s %8s %8s %8s %7s %10s %8s %6s\n", "n", "method", "rel.",
           "answered", "outcome", "residual", "backward", "error", "iter.", "ms", "ns", "/triad");
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
        problem lcp;
        int k = sizes[s];
        create(&lcp, k);
        measure(context, &lcp, PERP_LCP_AUTO, 1, gbytes);
        if (k <= 32)
            measure(context, &lcp, PERP_LCP_LEMKE, 1, gbytes);
        if (k <= 128)
            measure(context, &lcp, PERP_LCP_FISCHER, 1, gbytes);
        measure(context, &lcp, PERP_LCP_PGS, 1, gbytes);
        /* the best relaxation of the linear problem (Young 1954) */
        measure(context, &lcp, PERP_LCP_PGS, 2 / (1 + sin(3.14159265358979 / (k + 1))), gbytes);
        free_problem(&lcp);
    }
    perp_context_destroy(context);
    return 0;
}
