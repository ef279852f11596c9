/* Frictional contact problems of Stewart and Trinkle, all of them solvable: how many are solved, to
 * which backward error, and how fast. Scenes, masses, friction, jitter, duplicates, motions and
 * scalings are drawn from a seed each (tests/scene.h). 'false' counts rays and wrong certificates,
 * none of which can be right here; 'worst' is the largest backward error of what counts as solved,
 * in units of 2^-52; 'tries' and 'pivots' are what Lemke's method needed on average (pivots rounded
 * to 16 a try).
 *
 *   lcp_contact [first seed [count [method...]]]      default: 1 120 lemke lexicographic auto
 * fischer */
#include "measure.h"

#include "../tests/scene.h"

enum { RATIOS = 5, GROUPS = SCENE_CLASSES + RATIOS + 1 };

typedef struct mode {
    const char *name;
    int32_t method, rule, scaling, polish;
} mode;

static const mode modes[] = {
    {"lemke", PERP_LCP_LEMKE, PERP_PIVOT_HARRIS, 1, 1},
    {"lexicographic", PERP_LCP_LEMKE, PERP_PIVOT_LEXICOGRAPHIC, 1, 1},
    {"auto", PERP_LCP_AUTO, PERP_PIVOT_HARRIS, 1, 1},
    {"fischer", PERP_LCP_FISCHER, PERP_PIVOT_HARRIS, 1, 1},
    {"unscaled", PERP_LCP_LEMKE, PERP_PIVOT_HARRIS, 0, 1},
    {"unpolished", PERP_LCP_LEMKE, PERP_PIVOT_HARRIS, 1, 0},
};

typedef struct effort {
    int64_t tries, pivots, last;
} effort;

typedef struct row {
    int count, solved, limit, ray, stalled, exact;
    double worst, slowest, *times;
    int64_t tries, pivots;
} row;

static int32_t watch(const perp_lcp_progress *progress, void *user)
{
    effort *e = user;
    if (progress->method != PERP_LCP_LEMKE)
        return 0;
    if (progress->iterations == 1) {
        e->tries++;
        e->pivots += e->last;
    }
    e->last = progress->iterations;
    return 0;
}

static void add(row *r, const perp_lcp_result *result, double time, const effort *e)
{
    int good =
        result->outcome == PERP_OUTCOME_SOLVED || result->outcome == PERP_OUTCOME_ROUNDING_LIMIT;
    r->times[r->count++] = time;
    r->solved += result->outcome == PERP_OUTCOME_SOLVED;
    r->limit += result->outcome == PERP_OUTCOME_ROUNDING_LIMIT;
    r->ray += result->outcome == PERP_OUTCOME_RAY;
    r->stalled += !good && result->outcome != PERP_OUTCOME_RAY;
    r->exact += good && result->backward_error <= 4 * 0x1p-52;
    if (good)
        r->worst = fmax(r->worst, result->backward_error / 0x1p-52);
    r->slowest = fmax(r->slowest, time);
    r->tries += e->tries;
    r->pivots += e->pivots + e->last;
}

static void print(const char *name, row *r)
{
    if (r->count == 0)
        return;
    printf("%-14s %5d %6d %8d %5d %7d %6d %8.2g", name, r->count, r->solved, r->limit, r->ray,
           r->stalled, r->exact, r->worst);
    printf(" %9.2f %9.1f %6.2f %8.0f\n", 1e3 * median(r->times, r->count), 1e3 * r->slowest,
           (double)r->tries / r->count, (double)r->pivots / r->count);
}

static void solve(perp_context *context, const mode *m, const scene_options *o, row *rows)
{
    perp_lcp_settings settings;
    perp_lcp_problem posed = {.struct_size = sizeof posed};
    perp_lcp_result result;
    effort e = {0, 0, 0};
    gen_lcp problem;
    double start, time, *z;
    int ratio = (int)lround(log10(o->mass_ratio) / 2);
    scene_lcp(&problem, o);
    z = require_memory((size_t)problem.n * sizeof *z);
    perp_lcp_settings_init(&settings, sizeof settings);
    perp_struct_init(&result, sizeof result);
    settings.method = m->method;
    settings.pivot_rule = m->rule;
    settings.scaling = m->scaling;
    settings.polish = m->polish;
    settings.monitor = watch;
    settings.monitor_user = &e;
    posed.M = &problem.view;
    posed.q = problem.q;
    start = seconds_now();
    require(perp_lcp_solve(context, z, NULL, NULL, &result, &settings, &posed, NULL) == PERP_OK,
            "a solve failed");
    time = seconds_now() - start;
    add(&rows[o->class], &result, time, &e);
    add(&rows[SCENE_CLASSES + (ratio < RATIOS ? ratio : RATIOS - 1)], &result, time, &e);
    add(&rows[GROUPS - 1], &result, time, &e);
    if (result.outcome != PERP_OUTCOME_SOLVED || result.backward_error > 4 * 0x1p-52)
        printf(
            "# %s seed %llu (%s, n %d, mass ratio %g, mu %g, jitter %g, scaling %d): %s, residual "
            "%.1e, backward error %.2g\n",
            m->name, (unsigned long long)o->seed, scene_class_text(o->class), (int)problem.n,
            o->mass_ratio, o->mu, o->jitter, (int)o->scaling, perp_outcome_text(result.outcome),
            result.residual, result.backward_error / 0x1p-52);
    gen_destroy(&problem);
    free(z);
}

static void run(perp_context *context, const mode *m, uint64_t first, int count)
{
    static const char *const ratios[RATIOS] = {"ratio 1", "ratio 1e2", "ratio 1e4", "ratio 1e6",
                                               "ratio 1e8"};
    row rows[GROUPS];
    double *times = require_memory((size_t)GROUPS * (size_t)count * sizeof *times);
    memset(rows, 0, sizeof rows);
    for (int k = 0; k < GROUPS; k++)
        rows[k].times = times + k * count;
    for (int k = 0; k < count; k++) {
        scene_options o = scene_draw(first + (uint64_t)k);
        solve(context, m, &o, rows);
    }
    printf("\n%-14s %5s %6s %8s %5s %7s %6s %8s %9s %9s %6s %8s\n", m->name, "count", "solved",
           "rounding", "false", "stalled", "<=4eps", "worst", "median ms", "max ms", "tries",
           "pivots");
    for (int k = 0; k < SCENE_CLASSES; k++)
        print(scene_class_text(k), &rows[k]);
    for (int k = 0; k < RATIOS; k++)
        print(ratios[k], &rows[SCENE_CLASSES + k]);
    print("all", &rows[GROUPS - 1]);
    printf("\n");
    fflush(stdout);
    free(times);
}

/* The format of tests/lcp/test_regressions.c. */
static void write_problem(uint64_t seed)
{
    scene_options o = scene_draw(seed);
    gen_lcp problem;
    scene_lcp(&problem, &o);
    printf("# scene generator %d, seed %llu: %s, mass ratio %g, friction %g, jitter %g\n",
           SCENE_VERSION, (unsigned long long)seed, scene_class_text(o.class), o.mass_ratio, o.mu,
           o.jitter);
    printf("n %d\n", (int)problem.n);
    for (int i = 0; i < problem.n; i++)
        if (problem.q[i] != 0)
            printf("q %d %a\n", i, problem.q[i]);
    for (int i = 0; i < problem.n; i++)
        for (int j = 0; j < problem.n; j++)
            if (problem.M[i * problem.n + j] != 0)
                printf("M %d %d %a\n", i, j, problem.M[i * problem.n + j]);
    gen_destroy(&problem);
}

int main(int argc, char **argv)
{
    static const char *const usual[] = {"lemke", "lexicographic", "auto", "fischer"};
    const uint64_t first = argc > 1 ? strtoull(argv[1], NULL, 10) : 1;
    const int count = argc > 2 ? atoi(argv[2]) : 120;
    const int named = argc > 3 ? argc - 3 : 4;
    double gflops, gbytes;
    perp_context *context = NULL;
    if (argc == 3 && strcmp(argv[1], "write") == 0) {
        write_problem(strtoull(argv[2], NULL, 10));
        return 0;
    }
    require(count > 0, "no instances");
    require(perp_context_create(&context, NULL) == PERP_OK, "no context");
    print_machine_speed(&gflops, &gbytes);
    for (int k = 0; k < named; k++) {
        const char *name = argc > 3 ? argv[3 + k] : usual[k];
        size_t m = 0;
        while (m < sizeof modes / sizeof *modes && strcmp(modes[m].name, name) != 0)
            m++;
        require(m < sizeof modes / sizeof *modes, "unknown method");
        run(context, &modes[m], first, count);
    }
    perp_context_destroy(context);
    return 0;
}
