/* What the same work costs with two builds of the library: rows of lcp_dense, lcp_contact,
 * contact_sweep, contact_newton and mechanism, short enough to be run again and again. One pass
 * prints a row's name, its processor time in us (median of a few), and how many of its problems
 * ended in a good outcome. bench/house.sh runs two builds in turn and writes their ratios. */
#include "measure.h"

#include "../tests/machines.h"
#include "../tests/piles.h"
#include "../tests/scene.h"

enum { REPEATS = 5 };

typedef struct work {
    int good, all;
    double times[REPEATS];
} work;

static perp_context *context;

static double processor_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void count(work *w, int32_t outcome)
{
    w->good += outcome == PERP_OUTCOME_SOLVED || outcome == PERP_OUTCOME_ROUNDING_LIMIT;
    w->all++;
}

static void print(const char *bench, const char *row, work *w)
{
    printf("%-15s %-24s %10.1f %4d/%d\n", bench, row, 1e6 * median(w->times, REPEATS), w->good,
           w->all);
    fflush(stdout);
}

/* M = A A'/n + I/10, as lcp_dense. */
static void dense(int n, int32_t method, int32_t crash)
{
    double *A = require_memory(2 * sizeof(double) * (size_t)n * (size_t)n), *M = A + n * n;
    double *q = require_memory(2 * sizeof(double) * (size_t)n), *z = q + n;
    uint64_t seed = (uint64_t)n;
    perp_lcp_settings settings;
    perp_lcp_solver *solver = NULL;
    perp_lcp_result result;
    perp_matrix view;
    work w = {0, 0, {0}};
    char row[64];
    for (int k = 0; k < n * n; k++)
        A[k] = random_number(&seed);
    for (int i = 0; i < n; i++)
        q[i] = random_number(&seed);
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            double sum = i == j ? 0.1 : 0;
            for (int k = 0; k < n; k++)
                sum += A[i * n + k] * A[j * n + k] / n;
            M[i + j * n] = sum;
        }
    perp_lcp_settings_init(&settings, sizeof settings);
    perp_struct_init(&result, sizeof result);
    perp_struct_init(&view, sizeof view);
    perp_matrix_dense(&view, PERP_STORAGE_COLUMN_MAJOR, n, n, M, n);
    settings.method = method;
    settings.crash = crash;
    require(perp_lcp_solver_create(context, &solver, &settings) == PERP_OK &&
                perp_lcp_solver_setup(solver, &view, NULL, NULL) == PERP_OK,
            "dense");
    for (int k = -1; k < REPEATS; k++) {
        const int solves = n <= 20 ? 1000 : n <= 100 ? 50 : n <= 200 ? 10 : 2;
        const double start = processor_seconds();
        for (int s = 0; s < solves; s++)
            require(perp_lcp_solver_solve(solver, z, NULL, NULL, &result, q, NULL) == PERP_OK,
                    "a dense solve");
        if (k >= 0)
            w.times[k] = (processor_seconds() - start) / solves;
    }
    count(&w, result.outcome);
    snprintf(row, sizeof row, "%s%s, n %d", perp_lcp_method_text(method), crash ? "" : ", no crash",
             n);
    print("lcp_dense", row, &w);
    perp_lcp_solver_destroy(solver);
    free(A);
    free(q);
}

/* Scenes of lcp_contact with least < n <= most, the first `wanted` of them, one after the other. */
static void scenes(int least, int most, int wanted, int32_t method)
{
    perp_lcp_settings settings;
    perp_lcp_result result;
    work w = {0, 0, {0}};
    char row[64];
    int taken = 0;
    perp_lcp_settings_init(&settings, sizeof settings);
    perp_struct_init(&result, sizeof result);
    settings.method = method;
    for (uint64_t seed = 1; taken < wanted; seed++) {
        scene_options options = scene_draw(seed);
        gen_lcp problem;
        scene_lcp(&problem, &options);
        if (problem.n > least && problem.n <= most) {
            const perp_lcp_problem posed = {
                .struct_size = sizeof posed, .M = &problem.view, .q = problem.q};
            double *z = require_memory((size_t)problem.n * sizeof *z);
            taken++;
            for (int k = 0; k < REPEATS; k++) {
                const double start = processor_seconds();
                require(perp_lcp_solve(context, z, NULL, NULL, &result, &settings, &posed, NULL) ==
                            PERP_OK,
                        "a scene");
                w.times[k] += processor_seconds() - start;
            }
            count(&w, result.outcome);
            free(z);
        }
        gen_destroy(&problem);
    }
    snprintf(row, sizeof row, "%s, n %d to %d", perp_lcp_method_text(method), least + 1, most);
    print("lcp_contact", row, &w);
}

/* A pile from no impulses and, for forces that differ by one in a thousand, from its answer. */
static void pile(const char *bench, int32_t method, int32_t class, int32_t contacts, double tol)
{
    piles_options options = piles_defaults();
    const perp_contact_settings settings = piles_settings(method, tol);
    perp_contact_laws laws;
    perp_contact_dynamics dynamics;
    perp_contact_solver *solver = NULL;
    perp_contact_result result;
    uint64_t seed = 5;
    piles p;
    char row[64];
    options.class = class;
    options.contacts = contacts;
    options.seed = 7;
    piles_make(&p, &options);
    double *r = require_memory(2 * (size_t)p.rows * sizeof *r), *start = r + p.rows;
    double *f = require_memory((size_t)p.n * sizeof *f);
    const perp_contact_answer answer = {.struct_size = sizeof answer, .r = r};
    perp_struct_init(&result, sizeof result);
    laws = piles_laws(&p);
    dynamics = piles_dynamics(&p);
    require(perp_contact_solver_create(context, &solver, &settings) == PERP_OK &&
                perp_contact_solver_setup_dynamics(solver, &laws, &dynamics) == PERP_OK,
            "a pile");
    memcpy(f, p.f, (size_t)p.n * sizeof *f);
    for (int warm = 0; warm < 2; warm++) {
        work w = {0, 0, {0}};
        for (int k = 0; k < REPEATS; k++) {
            const double begun = processor_seconds();
            require(perp_contact_solver_solve_dynamics(solver, &answer, &result, f, p.w, NULL,
                                                       warm ? start : NULL) == PERP_OK,
                    "a solve of a pile");
            w.times[k] = processor_seconds() - begun;
        }
        count(&w, result.outcome);
        snprintf(row, sizeof row, "%s %d, %g, %s", piles_class_text(class), p.contacts, tol,
                 warm ? "warm" : "cold");
        print(bench, row, &w);
        memcpy(start, r, (size_t)p.rows * sizeof *r);
        for (int32_t k = 0; k < p.n; k++)
            f[k] = p.f[k] * (1 + 1e-3 * random_number(&seed));
    }
    perp_contact_solver_destroy(solver);
    piles_destroy(&p);
    free(r);
    free(f);
}

/* The machines of bench/mechanism.c, `steps` each, or as many as they choose. */
static void machines(int32_t scheme, int steps, double error, const char *row)
{
    static const int32_t names[] = {
        MACHINE_RAMP_R1, MACHINE_RAMP_R3,  MACHINE_RAMP_R5,   MACHINE_RAMP_R6, MACHINE_RAMP_R7,
        MACHINE_PLANE,   MACHINE_FLOOR,    MACHINE_ROLL_BALL, MACHINE_BELT,    MACHINE_BALL,
        MACHINE_BLOCK,   MACHINE_ROD_FALL, MACHINE_PENDULUM,  MACHINE_SPIN};
    perp_mechanism_settings settings;
    work w = {0, 0, {0}};
    perp_mechanism_settings_init(&settings, sizeof settings);
    settings.scheme = scheme;
    settings.error = error;
    for (size_t m = 0; m < sizeof names / sizeof *names; m++) {
        machine made;
        machine_record record;
        machine_make(&made, names[m]);
        for (int k = 0; k < REPEATS; k++) {
            const double start = processor_seconds();
            require(machine_run(&record, context, &made, &settings, made.end / steps, 0) == PERP_OK,
                    "a machine");
            w.times[k] += processor_seconds() - start;
        }
        count(&w, record.result.outcome);
    }
    print("mechanism", row, &w);
}

int main(void)
{
    require(perp_context_create(&context, NULL) == PERP_OK, "no context");
    dense(10, PERP_LCP_AUTO, 1);
    dense(100, PERP_LCP_AUTO, 1);
    dense(500, PERP_LCP_AUTO, 1);
    dense(100, PERP_LCP_LEMKE, 0);
    dense(200, PERP_LCP_LEMKE, 0);
    dense(500, PERP_LCP_ACTIVE_SET, 1);
    dense(200, PERP_LCP_FISCHER, 1);
    dense(200, PERP_LCP_PGS, 1);
    scenes(0, 60, 20, PERP_LCP_AUTO);
    scenes(60, 150, 20, PERP_LCP_AUTO);
    scenes(60, 150, 20, PERP_LCP_LEMKE);
    scenes(150, 300, 6, PERP_LCP_AUTO);
    for (int32_t class = PILES_COLUMN; class <= PILES_BALLS; class ++) {
        pile("contact_sweep", PERP_CONTACT_METHOD_SWEEP, class, 200, 1e-4);
        pile("contact_sweep", PERP_CONTACT_METHOD_SWEEP, class, 200, 1e-8);
    }
    pile("contact_sweep", PERP_CONTACT_METHOD_SWEEP, PILES_COLUMN, 5000, 1e-4);
    for (int32_t class = PILES_COLUMN; class <= PILES_BALLS; class ++)
        pile("contact_newton", PERP_CONTACT_METHOD_NEWTON, class, 100, 1e-8);
    machines(PERP_MECHANISM_FROZEN, 400, 0.0, "frozen");
    machines(PERP_MECHANISM_IMPLICIT, 400, 0.0, "implicit");
    machines(PERP_MECHANISM_THETA, 400, 0.0, "theta");
    machines(PERP_MECHANISM_THETA, 400, 1e-6, "theta, adaptive");
    perp_context_destroy(context);
    return 0;
}
