/* Method sweep of perp_contact on piles of rigid bodies with redundant contacts (boxes touch in
 * four points), 3-D, exact cone. Times are processor time of one thread, the fastest of a few
 * solves through the public call, its checks and the residuals in doubled precision included;
 * 'set-up' is perp_contact_solver_setup_dynamics. 'rest': bodies under gravity, mu = 0.5; 'hit':
 * all of them also move at random. */
#include "measure.h"

#include <sys/resource.h>

#include "../tests/piles.h"

typedef struct solved {
    double setup, cold, warm; /* seconds */
    int64_t sweeps, warm_sweeps;
    int32_t modes[3];
    perp_contact_result result;
} solved;

static double processor_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static const char *short_outcome(int32_t outcome)
{
    return outcome == PERP_OUTCOME_ITERATION_LIMIT ? "limit" : perp_outcome_text(outcome);
}

typedef struct bench {
    perp_context *context;
    perp_contact_solver *solver;
    piles p;
    double *r, *start, *f;
    int32_t *modes;
} bench;

static void begin(bench *b, const piles_options *options, const perp_contact_settings *settings,
                  solved *s)
{
    perp_contact_laws laws;
    perp_contact_dynamics dynamics;
    double started;
    piles_make(&b->p, options);
    require(perp_context_create(&b->context, NULL) == PERP_OK, "no context");
    require(perp_contact_laws_init(&laws, sizeof laws) == PERP_OK, "laws");
    require(perp_struct_init(&dynamics, sizeof dynamics) == PERP_OK, "dynamics");
    laws.contacts = b->p.contacts;
    laws.dims = b->p.dims;
    laws.mu = b->p.mu;
    dynamics.n = b->p.n;
    dynamics.M = &b->p.M;
    dynamics.H = &b->p.H;
    require(perp_contact_solver_create(b->context, &b->solver, settings) == PERP_OK, "solver");
    started = processor_seconds();
    require(perp_contact_solver_setup_dynamics(b->solver, &laws, &dynamics) == PERP_OK,
            perp_context_message(b->context));
    s->setup = processor_seconds() - started;
    b->r = require_memory((size_t)b->p.rows * sizeof(double));
    b->start = require_memory((size_t)b->p.rows * sizeof(double));
    b->f = require_memory((size_t)b->p.n * sizeof(double));
    b->modes = require_memory((size_t)b->p.contacts * sizeof(int32_t));
}

static void end(bench *b)
{
    perp_contact_solver_destroy(b->solver);
    perp_context_destroy(b->context);
    piles_destroy(&b->p);
    free(b->r);
    free(b->start);
    free(b->f);
    free(b->modes);
}

/* Seconds of the fastest of a few solves. */
static double fastest(bench *b, const double *f, const double *r0, int repeats,
                      perp_contact_result *result)
{
    const perp_contact_answer answer = {.struct_size = sizeof answer, .r = b->r, .modes = b->modes};
    double best = INFINITY;
    for (int k = 0; k < repeats; k++) {
        double started = processor_seconds();
        require(perp_struct_init(result, sizeof *result) == PERP_OK, "result");
        require(perp_contact_solver_solve_dynamics(b->solver, &answer, result, f, b->p.w, NULL,
                                                   r0) == PERP_OK,
                perp_context_message(b->context));
        best = fmin(best, processor_seconds() - started);
    }
    return best;
}

static solved solve(const piles_options *options, double tol, int32_t limit, int32_t warm)
{
    const int repeats = options->contacts > 20000 ? 2 : options->contacts > 2000 ? 3 : 5;
    perp_contact_settings settings;
    uint64_t seed = 5;
    solved s;
    bench b;
    memset(&s, 0, sizeof s);
    require(perp_contact_settings_init(&settings, sizeof settings) == PERP_OK, "settings");
    settings.method = PERP_CONTACT_METHOD_SWEEP;
    settings.tol = tol;
    settings.max_iterations = limit;
    begin(&b, options, &settings, &s);
    s.cold = fastest(&b, b.p.f, NULL, repeats, &s.result);
    s.sweeps = s.result.iterations;
    for (int32_t k = 0; k < b.p.contacts; k++)
        s.modes[b.modes[k]]++;
    if (warm) { /* forces that differ by one in a thousand */
        perp_contact_result result;
        memcpy(b.start, b.r, (size_t)b.p.rows * sizeof(double));
        for (int32_t k = 0; k < b.p.n; k++)
            b.f[k] = b.p.f[k] * (1 + 1e-3 * random_number(&seed));
        s.warm = fastest(&b, b.f, b.start, repeats, &result);
        s.warm_sweeps = result.iterations;
    }
    end(&b);
    return s;
}

static int32_t count_contacts(const piles_options *options)
{
    piles p;
    int32_t contacts;
    piles_make(&p, options);
    contacts = p.contacts;
    piles_destroy(&p);
    return contacts;
}

/* ---- tables ---------------------------------------------------------------------------------- */

enum { FEW = 20, MANY = 220 };

/* Notes the time after FEW sweeps and after MANY, where it stops. */
static int32_t note_time(const perp_contact_progress *progress, void *user)
{
    double *times = user;
    if (progress->iterations == FEW)
        times[0] = processor_seconds();
    if (progress->iterations == MANY)
        times[1] = processor_seconds();
    return progress->iterations == MANY;
}

/* Of many sweeps in the middle of a solve, to a tolerance that is never reached. */
static void print_sweep(const char *name, const piles_options *options)
{
    perp_contact_settings settings;
    perp_contact_result result;
    double times[2] = {0, 0}, best = INFINITY;
    int32_t modes[3] = {0, 0, 0};
    solved s;
    bench b;
    require(perp_contact_settings_init(&settings, sizeof settings) == PERP_OK, "settings");
    settings.method = PERP_CONTACT_METHOD_SWEEP;
    settings.tol = 1e-300;
    settings.monitor = note_time;
    settings.monitor_user = times;
    begin(&b, options, &settings, &s);
    for (int k = 0; k < 5; k++) {
        fastest(&b, b.p.f, NULL, 1, &result);
        best = fmin(best, times[1] - times[0]);
    }
    for (int32_t k = 0; k < b.p.contacts; k++)
        modes[b.modes[k]]++;
    printf("%-22s %8d %9d %6d %6d %10.1f\n", name, b.p.contacts, modes[0], modes[1], modes[2],
           1e9 * best / (MANY - FEW) / b.p.contacts);
    end(&b);
}

static void print_sweeps(void)
{
    piles_options stick = piles_defaults(), slip = piles_defaults(), separate = piles_defaults();
    puts(
        "One sweep, mixing included (its share is about 10 ns), 1000 contacts in cache, 100000 not."
        "\n\nscene                  contacts  separate  stick   slip  ns/contact");
    stick.contacts = 1000;
    print_sweep("columns at rest", &stick);
    stick.class = PILES_BALLS;
    print_sweep("pyramid of balls", &stick);
    stick.class = PILES_WALL;
    stick.motion = PILES_IMPACT;
    print_sweep("wall, hit", &stick);
    stick.motion = PILES_REST;
    separate.class = PILES_HEAP;
    separate.contacts = 1500;
    print_sweep("heap of balls", &separate);
    slip.class = PILES_TOWER;
    slip.contacts = 1000;
    slip.mu = 0.1;
    slip.motion = PILES_IMPACT;
    print_sweep("towers, hit, mu = 0.1", &slip);
    stick.class = PILES_COLUMN;
    stick.contacts = 100000;
    print_sweep("columns at rest", &stick);
}

static void print_solves(double tol, int32_t motion)
{
    static const int32_t sizes[] = {50, 200, 1000};
    printf(
        "\nTo %.0e, %s, at most 1000 sweeps; us per contact. Warm: from the answer, f changed by "
        "1e-3.\n\nscene   contacts  set-up    cold  sweeps  residual  outcome   warm  sweeps\n",
        tol, motion == PILES_REST ? "rest" : "hit");
    for (int32_t class = 0; class < PILES_CLASSES; class ++)
        for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
            piles_options options = piles_defaults();
            int32_t contacts;
            solved s;
            options.class = class;
            options.contacts = sizes[k];
            options.motion = motion;
            contacts = count_contacts(&options);
            s = solve(&options, tol, 1000, 1);
            printf("%-7s %8d %7.2f %7.2f %7lld %9.1e  %-7s %6.2f %7lld\n", piles_class_text(class),
                   contacts, 1e6 * s.setup / contacts, 1e6 * s.cold / contacts, (long long)s.sweeps,
                   s.result.residual, short_outcome(s.result.outcome), 1e6 * s.warm / contacts,
                   (long long)s.warm_sweeps);
        }
}

static void print_depth(void)
{
    static const int32_t layers[] = {5, 10, 20, 40, 80};
    puts("\nGrowth with depth: about 1000 contacts, so many layers, to 1e-4, at most 1000 sweeps; "
         "us "
         "per contact\n\nscene           layers    cold  sweeps  residual  outcome");
    for (int32_t kind = 0; kind < 4; kind++)
        for (size_t k = 0; k < sizeof layers / sizeof *layers; k++) {
            piles_options options = piles_defaults();
            int32_t contacts;
            solved s;
            options.class = kind % 2 ? PILES_WALL : PILES_COLUMN;
            options.motion = kind / 2 ? PILES_IMPACT : PILES_REST;
            options.contacts = 1000;
            options.layers = layers[k];
            contacts = count_contacts(&options);
            s = solve(&options, 1e-4, 1000, 0);
            printf("%-6s %-8s %6d %7.2f %7lld %9.1e  %s\n", piles_class_text(options.class),
                   kind / 2 ? "hit" : "rest", layers[k], 1e6 * s.cold / contacts,
                   (long long)s.sweeps, s.result.residual, short_outcome(s.result.outcome));
        }
}

static void print_large(void)
{
    puts("\n100000 contacts, 20 layers, rest, to 1e-4; seconds; MB: the process's peak so far\n\n"
         "scene   contacts  set-up    cold  sweeps  residual  outcome      MB");
    for (int32_t class = 0; class < PILES_CLASSES; class ++) {
        piles_options options = piles_defaults();
        struct rusage usage;
        int32_t contacts;
        solved s;
        if (class == PILES_BALLS)
            continue; /* sweeps do not solve large pyramids: see above */
        options.class = class;
        options.contacts = 100000;
        options.layers = 20;
        contacts = count_contacts(&options);
        s = solve(&options, 1e-4, 300, 0);
        getrusage(RUSAGE_SELF, &usage);
        printf("%-7s %8d %7.3f %7.3f %7lld %9.1e  %-7s %7.0f\n", piles_class_text(class), contacts,
               s.setup, s.cold, (long long)s.sweeps, s.result.residual,
               short_outcome(s.result.outcome), (double)usage.ru_maxrss / 1024);
    }
}

int main(void)
{
    double gflops, gbytes;
    print_machine_speed(&gflops, &gbytes);
    puts("");
    print_sweeps();
    print_solves(1e-4, PILES_REST);
    print_solves(1e-4, PILES_IMPACT);
    print_solves(1e-8, PILES_REST);
    print_depth();
    print_large();
    return 0;
}
