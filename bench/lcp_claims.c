/* What is said beside a solution: proofs, derivatives, all solutions.
 *
 * Proofs and derivatives: M = Q diag(d) Q', Q a product of ten reflections, 1 >= d >= 1/cond; about
 * half ('half') or all ('all') variables positive, solved by the library. 'proved' of 20 problems
 * (3 from n = 500 on); 'radius' in units of cond eps max|z|, the worst; times are medians, 'in LU'
 * counts them in factorisations of the whole M at the speed of dgemm.
 *
 * All solutions: entries of M from (-1,1), q from (0,1) ('random'), A A' of those with q < 0
 * ('psd'), and steps with c contacts of 2 friction directions on a body in the plane ('contact').
 */
#include "measure.h"

typedef struct problem {
    int n;
    double *M, *q, *z;
} problem;

static void allocate(problem *lcp, int n)
{
    lcp->n = n;
    lcp->M = require_memory(sizeof(double) * (size_t)(n * n + 2 * n));
    lcp->q = lcp->M + n * n;
    lcp->z = lcp->q + n;
}

static perp_matrix view_of(const problem *lcp)
{
    perp_matrix view;
    perp_struct_init(&view, sizeof view);
    perp_matrix_dense(&view, PERP_STORAGE_COLUMN_MAJOR, lcp->n, lcp->n, lcp->M, lcp->n);
    return view;
}

/* lines of M := lines - 2 v (v' lines) / v'v; `step` within a line, `apart` from line to line */
static void reflect(double *M, int n, const double *v, int step, int apart)
{
    double square = 0;
    for (int i = 0; i < n; i++)
        square += v[i] * v[i];
    for (int k = 0; k < n; k++) {
        double dot = 0;
        for (int i = 0; i < n; i++)
            dot += v[i] * M[k * apart + i * step];
        for (int i = 0; i < n; i++)
            M[k * apart + i * step] -= 2 * dot / square * v[i];
    }
}

static void create_conditioned(problem *lcp, int n, double condition, int all, uint64_t *seed)
{
    allocate(lcp, n);
    memset(lcp->M, 0, sizeof(double) * (size_t)(n * n));
    for (int i = 0; i < n; i++)
        lcp->M[i * (n + 1)] = pow(condition, -(double)i / (n > 1 ? n - 1 : 1));
    for (int k = 0; k < 10; k++) {
        for (int i = 0; i < n; i++)
            lcp->z[i] = random_number(seed);
        reflect(lcp->M, n, lcp->z, 1, n);
        reflect(lcp->M, n, lcp->z, n, 1);
    }
    for (int i = 0; i < n; i++) {
        double number = random_number(seed);
        lcp->z[i] = all ? 0.1 + fabs(number) : number > 0 ? 0.01 + number : 0;
        lcp->q[i] = lcp->z[i] > 0 ? 0 : 0.01 - number;
    }
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++)
            lcp->q[i] -= lcp->M[i + n * j] * lcp->z[j];
}

typedef struct tally {
    int problems, proved;
    double radius, proof[20], create[20], product[20];
} tally;

/* Solves, proves, differentiates. */
static void claim(perp_context *context, problem *lcp, double condition, tally *t)
{
    const int k = t->problems++;
    double size = 0, start = 0;
    perp_matrix view = view_of(lcp);
    const perp_lcp_problem posed = {.struct_size = sizeof posed, .M = &view, .q = lcp->q};
    perp_lcp_result result;
    perp_lcp_proof proof;
    perp_lcp_sensitivity_info info;
    perp_lcp_sensitivity *slope = NULL;
    perp_struct_init(&result, sizeof result);
    perp_struct_init(&proof, sizeof proof);
    perp_struct_init(&info, sizeof info);
    require(perp_lcp_solve(context, lcp->z, NULL, NULL, &result, NULL, &posed, NULL) == PERP_OK,
            "a solve failed");
    start = seconds_now();
    require(perp_lcp_verify(context, NULL, &proof, &posed, lcp->z) == PERP_OK, "a proof failed");
    t->proof[k] = seconds_now() - start;
    for (int i = 0; i < lcp->n; i++)
        size = fmax(size, lcp->z[i]);
    if (proof.verdict == PERP_VERDICT_REGULAR) {
        t->proved++;
        t->radius = fmax(t->radius, proof.radius / (condition * 0x1p-52 * size));
    }
    start = seconds_now();
    require(perp_lcp_sensitivity_create(context, &slope, &info, NULL, &posed, lcp->z) == PERP_OK,
            "a derivative failed");
    t->create[k] = seconds_now() - start;
    start = seconds_now();
    require(perp_lcp_sensitivity_forward(slope, lcp->z, lcp->q, NULL, NULL, NULL) == PERP_OK,
            "a product failed");
    t->product[k] = seconds_now() - start;
    perp_lcp_sensitivity_destroy(slope);
}

static void measure_claims(perp_context *context, int n, double condition, int all, double gflops)
{
    const double cubic = 2.0 / 3 * pow(n, 3);
    uint64_t seed = 1;
    tally t;
    memset(&t, 0, sizeof t);
    for (int k = 0; k < (n < 500 ? 20 : 3); k++) {
        problem lcp;
        create_conditioned(&lcp, n, condition, all, &seed);
        claim(context, &lcp, condition, &t);
        free(lcp.M);
    }
    double proof = median(t.proof, t.problems), create = median(t.create, t.problems);
    printf("%6d %6.0e %-5s %4d/%-4d %8.1e %9.3f", n, condition, all ? "all" : "half", t.proved,
           t.problems, t.radius, 1e3 * proof);
    if (gflops > 0)
        printf(" %6.1f", proof * gflops * 1e9 / cubic);
    printf(" %9.3f", 1e3 * create);
    if (gflops > 0)
        printf(" %6.1f", create * gflops * 1e9 / cubic);
    printf(" %9.4f\n", 1e3 * median(t.product, t.problems));
}

static void create_random(problem *lcp, int n, int psd, uint64_t *seed)
{
    allocate(lcp, n);
    double *A = require_memory(sizeof(double) * (size_t)(n * n));
    for (int k = 0; k < n * n; k++)
        A[k] = lcp->M[k] = random_number(seed);
    for (int i = 0; i < n; i++)
        lcp->q[i] = psd ? -fabs(random_number(seed)) : fabs(random_number(seed));
    for (int i = 0; i < n && psd; i++)
        for (int j = 0; j < n; j++) {
            lcp->M[i + n * j] = 0;
            for (int k = 0; k < n; k++)
                lcp->M[i + n * j] += A[i + n * k] * A[j + n * k];
        }
    free(A);
}

/* Four variables a contact: normal, two tangents, cone; one body, mass and inertia 1. */
static void create_contact(problem *lcp, int contacts, uint64_t *seed)
{
    const int rows = 3 * contacts, n = 4 * contacts;
    double B[3][60];
    allocate(lcp, n);
    memset(lcp->M, 0, sizeof(double) * (size_t)(n * n + n));
    for (int k = 0; k < contacts; k++) {
        double x = random_number(seed), y = random_number(seed);
        for (int r = 0; r < 3; r++) {
            const double a = r == 0 ? 0 : r == 1 ? 1 : -1, b = r == 0 ? 1 : 0;
            B[0][3 * k + r] = a;
            B[1][3 * k + r] = b;
            B[2][3 * k + r] = x * b - y * a;
            if (r > 0) {
                lcp->M[3 * k + r + n * (rows + k)] = 1;
                lcp->M[rows + k + n * (3 * k + r)] = -1;
            }
        }
        lcp->M[rows + k + n * 3 * k] = 0.5;
    }
    for (int i = 0; i < rows; i++) {
        lcp->q[i] = 0.3 * B[0][i] - B[1][i] + 0.1 * B[2][i];
        for (int j = 0; j < rows; j++)
            for (int r = 0; r < 3; r++)
                lcp->M[i + n * j] += B[r][i] * B[r][j];
    }
}

static void measure_all(perp_context *context, const char *name, problem *lcp)
{
    perp_lcp_settings settings;
    perp_lcp_enumeration found;
    perp_matrix view = view_of(lcp);
    const perp_lcp_problem posed = {.struct_size = sizeof posed, .M = &view, .q = lcp->q};
    perp_lcp_settings_init(&settings, sizeof settings);
    perp_struct_init(&found, sizeof found);
    settings.time_limit = 60;
    require(perp_lcp_all(context, &found, &settings, &posed, NULL, NULL) == PERP_OK,
            "an enumeration failed");
    printf("%-8s %4d %-12s %9d %9d %10lld %10lld %10lld %9.3f %8.2f\n", name, lcp->n,
           perp_outcome_text(found.outcome), found.isolated, found.families, (long long)found.nodes,
           (long long)found.bases, (long long)found.singular, found.seconds,
           1e6 * found.seconds / (double)found.nodes);
    free(lcp->M);
}

int main(void)
{
    static const int sizes[] = {20, 100, 200, 500, 1000};
    double gflops, gbytes;
    perp_context *context = NULL;
    uint64_t seed = 7;
    require(perp_context_create(&context, NULL) == PERP_OK, "no context");
    print_machine_speed(&gflops, &gbytes);
    printf("\n%6s %6s %-5s %9s %8s %9s %6s %9s %6s %9s\n", "n", "cond", "z > 0", "proved", "radius",
           "proof ms", "in LU", "slope ms", "in LU", "product");
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++)
        for (int all = 0; all < 2; all++)
            for (double condition = 1e2; condition < 1e11; condition *= 1e4)
                measure_claims(context, sizes[s], condition, all, gflops);
    printf("\n%-8s %4s %-12s %9s %9s %10s %10s %10s %9s %8s\n", "class", "n", "outcome", "isolated",
           "families", "nodes", "bases", "singular", "seconds", "us/node");
    for (int n = 12; n <= 20; n += 4)
        for (int kind = 0; kind < 3; kind++) {
            problem lcp;
            if (kind < 2)
                create_random(&lcp, n, kind, &seed);
            else
                create_contact(&lcp, n / 4, &seed);
            measure_all(context, kind == 0 ? "random" : kind == 1 ? "psd" : "contact", &lcp);
        }
    perp_context_destroy(context);
    return 0;
}
