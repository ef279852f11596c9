/* What a sweep of projected Gauss-Seidel costs, and what sweeps it takes. First table: the membrane
 * over a hemisphere (examples/data/README.md) on grids of k^2 inner points, five-point Laplacian in
 * compressed columns. 'sweep' is the time of 200 sweeps (few at k = 1024) beyond that of 20, per
 * sweep and nonzero of M, diagonal included; 'product' is a product of the same matrix with a
 * vector, by rows, a plain loop of C, timed in turns with it; 'copied' is the speed at which the 12
 * bytes of each nonzero would be read. Times are the least of many.
 *
 * Second table: sweeps and milliseconds to a tested residual of 1e-6 and of 1e-10, without polish
 * and, last, with it. The stacks: ten bodies, two contacts between each two and below, dense,
 * masses growing to the top by the ratio in all. 'best' is the relaxation of Young (1954) for the
 * membrane without an obstacle, and 1.8 for the stacks. '-' is not within 20000 sweeps. */
#include "measure.h"

typedef struct problem {
    int32_t n, nonzeros;
    int32_t *starts, *rows;
    double *values, *q, *lower, *z, *product;
} problem;

static void allocate(problem *lcp, size_t n, size_t nonzeros)
{
    lcp->n = (int32_t)n;
    lcp->starts = require_memory((n + 1) * sizeof *lcp->starts);
    lcp->rows = require_memory(nonzeros * sizeof *lcp->rows);
    lcp->values = require_memory(nonzeros * sizeof *lcp->values);
    lcp->q = require_memory(4 * n * sizeof *lcp->q);
    lcp->lower = lcp->q + n;
    lcp->z = lcp->lower + n;
    lcp->product = lcp->z + n;
}

static void release(problem *lcp)
{
    free(lcp->starts);
    free(lcp->rows);
    free(lcp->values);
    free(lcp->q);
}

/* The free membrane is harmonic outside of r = a, a^2 (1 - ln(a/2)) = 1. */
static double height(double x, double y)
{
    const double a = 0.69796514822337357, r = hypot(x, y);
    return r <= a ? sqrt(1 - r * r) : -a * a / sqrt(1 - a * a) * log(r / 2);
}

static void create_membrane(problem *lcp, int k)
{
    static const int across[] = {0, -1, 0, 1, 0}, along[] = {-1, 0, 0, 0, 1};
    const size_t n = (size_t)k * (size_t)k;
    double h = 4.0 / (k + 1);
    int32_t count = 0;
    allocate(lcp, n, 5 * n);
    for (int j = 0, node = 0; j < k; j++) {
        for (int i = 0; i < k; i++, node++) {
            double x = -2 + h * (i + 1), y = -2 + h * (j + 1), r2 = x * x + y * y;
            lcp->starts[node] = count;
            lcp->q[node] = 0;
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

/* ---- the first table ------------------------------------------------------------------------- */

/* M is symmetric: its columns are its rows. */
static double product_time(const problem *lcp, int repeats)
{
    double start = seconds_now();
    for (int r = 0; r < repeats; r++) {
        for (int32_t i = 0; i < lcp->n; i++) {
            double sum = 0;
            for (int32_t p = lcp->starts[i]; p < lcp->starts[i + 1]; p++)
                sum += lcp->values[p] * lcp->z[lcp->rows[p]];
            lcp->product[i] = sum;
        }
        lcp->z[r % lcp->n] += 1e-300 * lcp->product[r % lcp->n];
    }
    return (seconds_now() - start) / repeats;
}

static perp_lcp_settings settings_of(int sweeps)
{
    perp_lcp_settings settings;
    require(perp_lcp_settings_init(&settings, sizeof settings) == PERP_OK, "no settings");
    settings.method = PERP_LCP_PGS;
    settings.max_iterations = sweeps;
    settings.tol = 1e-300;
    settings.polish = 0;
    return settings;
}

static double solve_time(perp_lcp_solver *solver, const problem *lcp,
                         const perp_lcp_settings *settings)
{
    perp_lcp_result result;
    double start;
    require(perp_struct_init(&result, sizeof result) == PERP_OK, "no result");
    require(perp_lcp_solver_set(solver, settings) == PERP_OK, "settings refused");
    start = seconds_now();
    require(perp_lcp_solver_solve(solver, lcp->z, NULL, NULL, &result, lcp->q, NULL) == PERP_OK,
            "solve failed");
    require(result.iterations == settings->max_iterations, "stopped early");
    return seconds_now() - start;
}

static void measure_sweeps(perp_context *context, int k, int sweep, double gbytes)
{
    const int few = k > 512 ? 4 : 20, many = k > 512 ? 20 : 220;
    const int repeats = k > 512 ? 12 : k > 128 ? 40 : 150;
    perp_lcp_settings little = settings_of(few), much = settings_of(many);
    double short_time = INFINITY, long_time = INFINITY, product = INFINITY, each;
    perp_lcp_solver *solver = NULL;
    perp_matrix view;
    problem lcp;
    create_membrane(&lcp, k);
    little.sweep = much.sweep = sweep;
    require(perp_struct_init(&view, sizeof view) == PERP_OK, "no view");
    require(perp_matrix_csc(&view, lcp.n, lcp.n, lcp.starts, lcp.rows, lcp.values) == PERP_OK,
            "view refused");
    require(perp_lcp_solver_create(context, &solver, &little) == PERP_OK, "no solver");
    require(perp_lcp_solver_setup(solver, &view, lcp.lower, NULL) == PERP_OK, "no set-up");
    for (int r = 0; r < repeats; r++) {
        short_time = fmin(short_time, solve_time(solver, &lcp, &little));
        long_time = fmin(long_time, solve_time(solver, &lcp, &much));
        product = fmin(product, product_time(&lcp, k > 512 ? 2 : 8));
    }
    each = (long_time - short_time) / (many - few);
    printf("%5d %8d %-9s %9.3f %9.3f %9.2f %9.2f\n", k, lcp.nonzeros,
           sweep ? "symmetric" : "forward", 1e9 * each / lcp.nonzeros, 1e9 * product / lcp.nonzeros,
           each / product, 12e-9 * lcp.nonzeros / each / gbytes);
    perp_lcp_solver_destroy(solver);
    release(&lcp);
}

/* ---- the second table ------------------------------------------------------------------------ */

typedef struct kind {
    const char *name;
    int best;
    double relaxation;
    int32_t sweep, acceleration, polish;
} kind;

static const kind kinds[] = {
    {"plain", 0, 1, PERP_SWEEP_FORWARD, PERP_ACCELERATION_NONE, 0},
    {"relaxed by 1.5", 0, 1.5, PERP_SWEEP_FORWARD, PERP_ACCELERATION_NONE, 0},
    {"relaxed, best", 1, 1.8, PERP_SWEEP_FORWARD, PERP_ACCELERATION_NONE, 0},
    {"gradients", 0, 1, PERP_SWEEP_FORWARD, PERP_ACCELERATION_CONJUGATE_GRADIENT, 0},
    {"to and fro, gradients", 0, 1, PERP_SWEEP_SYMMETRIC, PERP_ACCELERATION_CONJUGATE_GRADIENT, 0},
    {"the same by 1.5", 0, 1.5, PERP_SWEEP_SYMMETRIC, PERP_ACCELERATION_CONJUGATE_GRADIENT, 0},
    {"the same, best", 1, 1.8, PERP_SWEEP_SYMMETRIC, PERP_ACCELERATION_CONJUGATE_GRADIENT, 0},
    {"plain, polished", 0, 1, PERP_SWEEP_FORWARD, PERP_ACCELERATION_NONE, 1},
    {"all, by 1.5, polished", 0, 1.5, PERP_SWEEP_SYMMETRIC, PERP_ACCELERATION_CONJUGATE_GRADIENT,
     1},
};

static void measure_to(perp_lcp_solver *solver, const double *q, double *z, const kind *how,
                       double best, double tol)
{
    perp_lcp_settings settings = settings_of(20000);
    perp_lcp_result result;
    double least = INFINITY;
    settings.tol = tol;
    settings.relaxation = how->best ? best : how->relaxation;
    settings.sweep = how->sweep;
    settings.acceleration = how->acceleration;
    settings.polish = how->polish;
    require(perp_struct_init(&result, sizeof result) == PERP_OK, "no result");
    require(perp_lcp_solver_set(solver, &settings) == PERP_OK, "settings refused");
    for (int r = 0; r < 5 && (r == 0 || least < 0.5); r++) {
        require(perp_lcp_solver_solve(solver, z, NULL, NULL, &result, q, NULL) == PERP_OK,
                "solve failed");
        least = fmin(least, result.seconds);
    }
    if (result.outcome == PERP_OUTCOME_SOLVED)
        printf(" %7lld %9.3f", (long long)result.iterations, 1e3 * least);
    else
        printf(" %7s %9s", "-", "-");
}

static void measure_kinds(perp_lcp_solver *solver, const char *name, const double *q, double *z,
                          double best)
{
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        printf("%-16s %-22s", name, kinds[k].name);
        measure_to(solver, q, z, &kinds[k], best, 1e-6);
        measure_to(solver, q, z, &kinds[k], best, 1e-10);
        printf("\n");
    }
}

static void measure_membrane(perp_context *context, int k)
{
    perp_lcp_solver *solver = NULL;
    perp_matrix view;
    char name[32];
    problem lcp;
    create_membrane(&lcp, k);
    snprintf(name, sizeof name, "membrane %d", k);
    require(perp_struct_init(&view, sizeof view) == PERP_OK, "no view");
    require(perp_matrix_csc(&view, lcp.n, lcp.n, lcp.starts, lcp.rows, lcp.values) == PERP_OK,
            "view refused");
    require(perp_lcp_solver_create(context, &solver, NULL) == PERP_OK, "no solver");
    require(perp_lcp_solver_setup(solver, &view, lcp.lower, NULL) == PERP_OK, "no set-up");
    measure_kinds(solver, name, lcp.q, lcp.z, 2 / (1 + sin(3.14159265358979 / (k + 1))));
    perp_lcp_solver_destroy(solver);
    release(&lcp);
}

/* W = sum over bodies of (1/m) (s_a s_b) (1 + 3 x_a x_b): s = 1 on the body above a contact, -1 on
 * the one below, x = -1, 1 the contact's place on a body of inertia m / 3. */
static void measure_stack(perp_context *context, double ratio)
{
    enum { BODIES = 10, N = 2 * BODIES };
    static double W[N * N], q[N], z[N];
    perp_lcp_solver *solver = NULL;
    perp_matrix view;
    char name[32];
    for (int a = 0; a < N; a++) {
        q[a] = a < 2 ? -1 : 0;
        for (int b = 0; b < N; b++) {
            double sum = 0;
            for (int body = 0; body < BODIES; body++) {
                int on_a = (body == a / 2) - (body == a / 2 - 1);
                int on_b = (body == b / 2) - (body == b / 2 - 1);
                sum += on_a * on_b * pow(ratio, -body / (BODIES - 1.0));
            }
            W[a * N + b] = sum * (a % 2 == b % 2 ? 4 : -2);
        }
    }
    snprintf(name, sizeof name, "stack %g", ratio);
    require(perp_struct_init(&view, sizeof view) == PERP_OK, "no view");
    require(perp_matrix_dense(&view, PERP_STORAGE_ROW_MAJOR, N, N, W, N) == PERP_OK,
            "view refused");
    require(perp_lcp_solver_create(context, &solver, NULL) == PERP_OK, "no solver");
    require(perp_lcp_solver_setup(solver, &view, NULL, NULL) == PERP_OK, "no set-up");
    measure_kinds(solver, name, q, z, 1.8);
    perp_lcp_solver_destroy(solver);
}

int main(void)
{
    static const int sizes[] = {64, 256, 1024};
    double gflops, gbytes;
    perp_context *context = NULL;
    require(perp_context_create(&context, NULL) == PERP_OK, "no context");
    print_machine_speed(&gflops, &gbytes);
    printf("\n%5s %8s %-9s %9s %9s %9s %9s\n", "k", "nonzeros", "order", "sweep ns", "product ns",
           "ratio", "of triad");
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
        measure_sweeps(context, sizes[s], PERP_SWEEP_FORWARD, gbytes);
        measure_sweeps(context, sizes[s], PERP_SWEEP_SYMMETRIC, gbytes);
    }
    printf("\n%-16s %-22s %7s %9s %7s %9s\n", "problem", "sweeps", "1e-6", "ms", "1e-10", "ms");
    measure_membrane(context, 64);
    measure_membrane(context, 128);
    measure_stack(context, 1);
    measure_stack(context, 100);
    measure_stack(context, 1e4);
    perp_context_destroy(context);
    return 0;
}
