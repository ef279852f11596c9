/* Dense LCPs for Newton's method on the Fischer-Burmeister function, made from their solutions:
 * half of the variables positive, the others with w_i > 0. With A_ij in (-1,1): pd symmetric     A
 * A'/n + I/10, A square pd unsymmetric   the same and (A - A')/sqrt(n) psd symmetric    A A'/n, A n
 * by n/2: singular psd unsymmetric  A A'/n, A n by n/2, and a skew matrix of that size Cold start,
 * solver created and set up once, median of repeated solves. 'steps' are Newton's, 'factored'
 * counts factorisations, the polish's own included, and 'Mflop' what these cost. 'in LU' and 'in
 * dgemm' give the time in LU factorisations of M and in products of two such matrices, both timed
 * between the solves. */
#ifndef _GNU_SOURCE
#define _GNU_SOURCE 1 /* RTLD_NEXT */
#endif
#include "measure.h"

enum { MAX_REPEATS = 60 };

static const double seconds_for_a_row = 1.5;

/* The library's calls of LAPACK come here first and are counted. */
static int factorisations;
static double flops;

static void *next(const char *name)
{
    void *address = dlsym(RTLD_NEXT, name);
    require(address != NULL, "no LAPACK to count");
    return address;
}

void dgetrf_(const int *m, const int *n, double *A, const int *lda, int *pivots, int *info);
void dpotrf_(const char *uplo, const int *n, double *A, const int *lda, int *info, size_t length);

void dgetrf_(const int *m, const int *n, double *A, const int *lda, int *pivots, int *info)
{
    static void (*real)(const int *, const int *, double *, const int *, int *, int *);
    if (!real) {
        void *address = next("dgetrf_");
        memcpy(&real, &address, sizeof real);
    }
    factorisations++;
    flops += 2.0 / 3 * pow(*n, 3);
    real(m, n, A, lda, pivots, info);
}

void dpotrf_(const char *uplo, const int *n, double *A, const int *lda, int *info, size_t length)
{
    static void (*real)(const char *, const int *, double *, const int *, int *, size_t);
    if (!real) {
        void *address = next("dpotrf_");
        memcpy(&real, &address, sizeof real);
    }
    factorisations++;
    flops += 1.0 / 3 * pow(*n, 3);
    real(uplo, n, A, lda, info, length);
}

typedef struct problem {
    int n;
    double *M, *q, *z;
    double *lu, *product; /* n by n, for the kernels */
    int *pivots;
} problem;

static const char *const kinds[] = {"pd symmetric", "pd unsymmetric", "psd symmetric",
                                    "psd unsymmetric"};

/* M := A A'/n + shift I, A n by rank */
static void make_gram(problem *lcp, const double *A, int rank, double shift)
{
    int n = lcp->n;
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            double sum = i == j ? shift * n : 0;
            for (int k = 0; k < rank; k++)
                sum += A[(size_t)i * (size_t)n + (size_t)k] * A[(size_t)j * (size_t)n + (size_t)k];
            lcp->M[(size_t)i * (size_t)n + (size_t)j] = sum / n;
            lcp->M[(size_t)j * (size_t)n + (size_t)i] = sum / n;
        }
}

static void create(problem *lcp, int n, int kind)
{
    size_t size = (size_t)n * (size_t)n;
    uint64_t seed = (uint64_t)n;
    double *A = require_memory(size * sizeof *A);
    lcp->n = n;
    lcp->M = require_memory(3 * size * sizeof *lcp->M);
    lcp->lu = lcp->M + size;
    lcp->product = lcp->lu + size;
    lcp->q = require_memory((size_t)n * sizeof *lcp->q);
    lcp->z = require_memory((size_t)n * sizeof *lcp->z);
    lcp->pivots = require_memory((size_t)n * sizeof *lcp->pivots);
    for (size_t k = 0; k < size; k++)
        A[k] = random_number(&seed);
    make_gram(lcp, A, kind < 2 ? n : n / 2, kind < 2 ? 0.1 : 0);
    for (int i = 0; i < n && kind % 2; i++)
        for (int j = 0; j < n; j++)
            lcp->M[(size_t)i * (size_t)n + (size_t)j] +=
                (A[(size_t)i * (size_t)n + (size_t)j] - A[(size_t)j * (size_t)n + (size_t)i]) /
                sqrt(n);
    for (int i = 0; i < n; i++)
        lcp->z[i] = fmax(0, random_number(&seed));
    for (int i = 0; i < n; i++) {
        lcp->q[i] = lcp->z[i] > 0 ? 0 : fabs(random_number(&seed));
        for (int j = 0; j < n; j++) /* M is row-major here */
            lcp->q[i] -= lcp->M[(size_t)i * (size_t)n + (size_t)j] * lcp->z[j];
    }
    free(A);
}

static void destroy(problem *lcp)
{
    free(lcp->M);
    free(lcp->q);
    free(lcp->z);
    free(lcp->pivots);
}

static double lu_seconds(problem *lcp)
{
    int info;
    memcpy(lcp->lu, lcp->M, (size_t)lcp->n * (size_t)lcp->n * sizeof *lcp->lu);
    double start = seconds_now();
    dgetrf_(&lcp->n, &lcp->n, lcp->lu, &lcp->n, lcp->pivots, &info);
    return seconds_now() - start;
}

static double dgemm_seconds(problem *lcp)
{
    static dgemm_function dgemm;
    const double one = 1, zero = 0;
    const int *n = &lcp->n;
    if (!dgemm) {
        void *address = next("dgemm_");
        memcpy(&dgemm, &address, sizeof dgemm);
    }
    double start = seconds_now();
    dgemm("N", "N", n, n, n, &one, lcp->M, n, lcp->M, n, &zero, lcp->product, n);
    return seconds_now() - start;
}

static void measure(perp_context *context, problem *lcp, const char *kind)
{
    double times[MAX_REPEATS], lu[MAX_REPEATS], gemm[MAX_REPEATS], spent = 0;
    int repeats = 0, factored = 0;
    perp_lcp_settings settings;
    perp_lcp_result result;
    perp_lcp_solver *solver = NULL;
    perp_matrix view;
    perp_lcp_settings_init(&settings, sizeof settings);
    perp_struct_init(&result, sizeof result);
    perp_struct_init(&view, sizeof view);
    perp_status status =
        perp_matrix_dense(&view, PERP_STORAGE_ROW_MAJOR, lcp->n, lcp->n, lcp->M, lcp->n);
    settings.method = PERP_LCP_FISCHER;
    if (status == PERP_OK)
        status = perp_lcp_solver_create(context, &solver, &settings);
    if (status == PERP_OK)
        status = perp_lcp_solver_setup(solver, &view, NULL, NULL);
    flops = 0;
    factorisations = 0;
    if (status == PERP_OK) /* the first solve allocates: it is not timed */
        status = perp_lcp_solver_solve(solver, lcp->z, NULL, NULL, &result, lcp->q, NULL);
    factored = factorisations;
    double cost = flops;
    while (status == PERP_OK && repeats < MAX_REPEATS &&
           (repeats < 5 || spent < seconds_for_a_row)) {
        double start = seconds_now();
        status = perp_lcp_solver_solve(solver, lcp->z, NULL, NULL, &result, lcp->q, NULL);
        times[repeats] = seconds_now() - start;
        lu[repeats] = lu_seconds(lcp);
        gemm[repeats] = dgemm_seconds(lcp);
        spent += times[repeats++];
        if (spent > 4 * seconds_for_a_row)
            break;
    }
    require(status == PERP_OK, perp_context_message(context));
    double time = median(times, repeats);
    printf("%5d %-16s %-15s %8.1e %6lld %8d %8.1f %10.3f %8.2f %8.2f %7d\n", lcp->n, kind,
           perp_outcome_text(result.outcome), result.residual, (long long)result.iterations,
           factored, 1e-6 * cost, 1e3 * time, time / median(lu, repeats),
           time / median(gemm, repeats), repeats);
    perp_lcp_solver_destroy(solver);
}

int main(void)
{
    static const int sizes[] = {100, 300, 1000};
    double gflops, gbytes;
    perp_context *context = NULL;
    require(perp_context_create(&context, NULL) == PERP_OK, "no context");
    print_machine_speed(&gflops, &gbytes);
    printf("\n%5s %-16s %-15s %8s %6s %8s %8s %10s %8s %8s %7s\n", "n", "M", "outcome", "residual",
           "steps", "factored", "Mflop", "ms", "in LU", "in dgemm", "repeats");
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++)
        for (int kind = 0; kind < 4; kind++) {
            problem lcp;
            create(&lcp, sizes[s], kind);
            measure(context, &lcp, kinds[kind]);
            destroy(&lcp);
        }
    perp_context_destroy(context);
    return 0;
}
