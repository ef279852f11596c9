/* Machines with known motions: error and time of each scheme over the length of its steps.
 *
 * error: the largest of those in the places and speeds that are known at the end, each relative to
 * the known one or to 1; of 5 runs with 1 to 5 percent more steps than the row says the median, as
 * events fall into steps as they like. order: how error fell since the row above, log2 of their
 * ratio if steps are half as long. The row `order` gives that over all rows beside the one that
 * theory expects: 1 of frozen and implicit; 2 of theta where motions are smooth or end in friction,
 * 1 where there are impacts, a turn against friction or a friction that jumps. us/step: time
 * of the processor, the median of the 5; a mechanism is made for each. ms: the same for a run.
 * drift: the largest |c| or penetration, with projection. energy: the largest change, where none
 * should be.
 *
 * adaptive: steps chosen by settings.error instead of a length; `error` is still the true one.
 *
 * Equal cost: error of implicit and of theta over that of frozen at the time that they take, where
 * frozen's error is extended along its expected order. Below 1 is better than frozen.
 *
 * Without projection: what then is left of drift (pendulum) and penetration. */
#include "measure.h"

#include "../tests/machines.h"

enum { HALVINGS = 5, RUNS = 5, TASKS = 14, TOLERANCES = 4 };

typedef struct task {
    int32_t name;
    int coarsest; /* steps of the first row */
    int order;    /* that theta should have */
    int free;     /* energy should not change */
} task;

static const task tasks[TASKS] = {
    {MACHINE_RAMP_R1, 50, 2, 0},  {MACHINE_RAMP_R3, 50, 2, 0},   {MACHINE_RAMP_R5, 50, 1, 0},
    {MACHINE_RAMP_R6, 50, 2, 0},  {MACHINE_RAMP_R7, 500, 2, 0},  {MACHINE_PLANE, 50, 2, 0},
    {MACHINE_FLOOR, 50, 2, 0},    {MACHINE_ROLL_BALL, 50, 2, 0}, {MACHINE_BELT, 100, 1, 0},
    {MACHINE_BALL, 100, 1, 0},    {MACHINE_BLOCK, 100, 1, 0},    {MACHINE_ROD_FALL, 200, 1, 0},
    {MACHINE_PENDULUM, 50, 2, 1}, {MACHINE_SPIN, 100, 2, 1},
};

typedef struct row {
    double error, seconds;
    int steps;
    machine_record record;
} row;

static double error_of(const machine *m, const machine_record *record)
{
    double worst = 0;
    int32_t k;

    for (k = 0; k < m->references; k++) {
        const machine_reference *reference = &m->reference[k];

        if (reference->kind == MACHINE_COORDINATE || reference->kind == MACHINE_VELOCITY)
            worst = fmax(worst, fabs(machine_measure(record, reference) - reference->value) /
                                    fmax(1, fabs(reference->value)));
    }
    return worst;
}

static perp_mechanism_settings settings_of(int32_t scheme)
{
    perp_mechanism_settings settings;

    require(perp_mechanism_settings_init(&settings, sizeof settings) == PERP_OK, "settings");
    settings.scheme = scheme;
    return settings;
}

/* Seconds of the processor, which other programs beside this one hardly change. */
static double processor_seconds(void)
{
    struct timespec now;

    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Returns its seconds. */
static double run(row *r, perp_context *context, const machine *m,
                  const perp_mechanism_settings *settings, double h)
{
    const double start = processor_seconds();

    if (machine_run(&r->record, context, m, settings, h, 0) != PERP_OK)
        require(0, perp_context_message(context));
    return processor_seconds() - start;
}

static int is_good(const machine_record *r)
{
    return r->result.outcome == PERP_OUTCOME_SOLVED ||
           r->result.outcome == PERP_OUTCOME_ROUNDING_LIMIT;
}

/* row->error is nan where a run did not reach its end; the record is that of the last run. */
static void measure(row *r, perp_context *context, const machine *m,
                    const perp_mechanism_settings *settings, int steps)
{
    double errors[RUNS], seconds[RUNS];
    int k, ended = 1;

    for (k = 0; k < RUNS; k++) {
        seconds[k] = run(r, context, m, settings, m->end / (steps * (1 + 0.01 * (k + 1))));
        seconds[k] /= (double)r->record.result.steps;
        errors[k] = error_of(m, &r->record);
        ended = ended && is_good(&r->record);
    }
    r->error = ended ? median(errors, RUNS) : NAN;
    r->seconds = median(seconds, RUNS) * steps;
    r->steps = steps;
}

/* Steps that the run chooses. */
static void measure_adaptive(row *r, perp_context *context, const machine *m,
                             const perp_mechanism_settings *settings, double first)
{
    r->seconds = run(r, context, m, settings, first);
    r->error = is_good(&r->record) ? error_of(m, &r->record) : NAN;
    r->steps = (int)r->record.result.steps;
}

static void print_row(const task *t, const row *r, const char *scheme, double order)
{
    const perp_mechanism_run_result *result = &r->record.result;

    printf("  %-9s %7d %10.2e", scheme, r->steps, r->error);
    if (isnan(order))
        printf("      ");
    else
        printf(" %5.2f", order);
    printf(" %9.3f %8.2f", 1e3 * r->seconds, 1e6 * r->seconds / r->steps);
    printf(" %8.1e", fmax(result->drift, result->penetration));
    if (t->free)
        printf(" %8.1e", r->record.energy_change);
    if (result->outcome != PERP_OUTCOME_SOLVED)
        printf(" %s", perp_outcome_text(result->outcome));
    if (result->fallbacks > 0)
        printf(" (frozen answered %d steps)", (int)result->fallbacks);
    if (result->rejected > 0)
        printf(" (%d rejected)", (int)result->rejected);
    printf("\n");
}

/* log2(a / b) a halving; nan where both are rounding. */
static double order_of(double a, double b, int halvings)
{
    return a > 1e-11 && b > 0 ? log2(a / b) / halvings : NAN;
}

static void run_scheme(row *rows, const task *t, perp_context *context, const machine *m,
                       int32_t scheme)
{
    const perp_mechanism_settings settings = settings_of(scheme);
    const char *name = perp_mechanism_scheme_text(scheme);
    const int expected = scheme == PERP_MECHANISM_THETA ? t->order : 1;
    double order;
    int k;

    for (k = 0; k <= HALVINGS; k++) {
        measure(&rows[k], context, m, &settings, t->coarsest << k);
        print_row(t, &rows[k], name, k ? order_of(rows[k - 1].error, rows[k].error, 1) : NAN);
    }
    order = order_of(rows[0].error, rows[HALVINGS].error, HALVINGS);
    printf("  %-9s   order ", name);
    if (isnan(order))
        printf("      exact       expected %d\n", expected);
    else
        printf("            %5.2f expected %d\n", order, expected);
    fflush(stdout);
}

static void run_adaptive(const task *t, perp_context *context, const machine *m)
{
    perp_mechanism_settings settings = settings_of(PERP_MECHANISM_THETA);
    int k;

    for (k = 0; k < TOLERANCES; k++) {
        char name[16];
        row r;

        settings.error = pow(10, -3 - k);
        snprintf(name, sizeof name, "to %.0e", settings.error);
        measure_adaptive(&r, context, m, &settings, m->end / t->coarsest);
        if (isnan(r.record.result.error)) /* equal steps: this library chooses none */
            break;
        print_row(t, &r, name, NAN);
    }
    fflush(stdout);
}

/* What `other` makes of the time it takes, over what frozen would make of it. */
static double at_equal_cost(const row *frozen, const row *other)
{
    return other->error / (frozen->error * frozen->seconds / other->seconds);
}

static void print_costs(const char *title, double costs[][TASKS], const machine *machines)
{
    double sorted[TASKS];
    int s, k;

    printf("\n%s\n%-12s %10s %10s\n", title, "", "implicit", "theta");
    for (k = 0; k < TASKS; k++)
        printf("%-12s %10.2g %10.2g\n", machines[k].name, costs[0][k], costs[1][k]);
    printf("%-12s", "median");
    for (s = 0; s < 2; s++) {
        int count = 0;

        for (k = 0; k < TASKS; k++)
            if (isfinite(costs[s][k]))
                sorted[count++] = costs[s][k];
        printf(" %10.2g", count ? median(sorted, count) : NAN);
    }
    printf("\n");
}

/* Drift that projection would remove, in steps of the middle length. */
static void print_drift(perp_context *context)
{
    static const int chosen[] = {10, 11, 12}; /* block, falling rod, pendulum */
    size_t k;
    int32_t s;

    printf("\nWithout projection: largest drift or penetration, steps as in the fourth row\n");
    printf("%-12s %10s %10s %10s\n", "", "frozen", "implicit", "theta");
    for (k = 0; k < sizeof chosen / sizeof *chosen; k++) {
        const task *t = &tasks[chosen[k]];
        machine m;

        machine_make(&m, t->name);
        printf("%-12s", m.name);
        for (s = 0; s < 3; s++) {
            const int32_t schemes[] = {PERP_MECHANISM_FROZEN, PERP_MECHANISM_IMPLICIT,
                                       PERP_MECHANISM_THETA};
            perp_mechanism_settings settings = settings_of(schemes[s]);
            row r;

            settings.project = 0;
            measure(&r, context, &m, &settings, t->coarsest << 3);
            printf(" %10.1e", fmax(r.record.result.drift, r.record.result.penetration));
        }
        printf("\n");
    }
}

int main(void)
{
    static machine machines[TASKS];
    static row rows[3][HALVINGS + 1];
    double equal[2][TASKS], gflops, gbytes;
    perp_context *context;
    int k, s;

    require(perp_context_create(&context, NULL) == PERP_OK, "context");
    print_machine_speed(&gflops, &gbytes);
    for (k = 0; k < TASKS; k++) {
        machine_make(&machines[k], tasks[k].name);
        printf("\n%s, to %.3g (%s)\n", machines[k].name, machines[k].end,
               machines[k].reference[0].source);
        printf("  %-9s %7s %10s %5s %9s %8s %8s%s\n", "scheme", "steps", "error", "order", "ms",
               "us/step", "drift", tasks[k].free ? "   energy" : "");
        run_scheme(rows[0], &tasks[k], context, &machines[k], PERP_MECHANISM_FROZEN);
        run_scheme(rows[1], &tasks[k], context, &machines[k], PERP_MECHANISM_IMPLICIT);
        run_scheme(rows[2], &tasks[k], context, &machines[k], PERP_MECHANISM_THETA);
        for (s = 0; s < 2; s++)
            equal[s][k] = at_equal_cost(&rows[0][HALVINGS], &rows[s + 1][HALVINGS]);
        run_adaptive(&tasks[k], context, &machines[k]);
    }
    print_costs("Equal cost: error over frozen's, at the time of the shortest steps", equal,
                machines);
    print_drift(context);
    perp_context_destroy(context);
    return 0;
}
