/* Frictional contact problems drawn from a seed each (tests/piles.h): columns, towers, walls,
 * pyramids and heaps of 4 to 60 contacts with redundant points, mass ratios 1 to 1e8, friction 0 to
 * 1e3, at rest, pushed or in impact, in one to three dimensions. All of them have a solution. How
 * many are solved at tol 1e-12, to which residual, and how fast, in a solver made for each: 'cold'
 * in microseconds a contact, set-up included, ten seconds at most. 'false' counts rays and answers
 * that do not stand a check of their own: |M v - f - H'r|, |u - H v - w| and the laws, relative to
 * the problem's scales.
 *
 *   contact_random [first seed [count [method...]]]      default: 1 300 auto proximal sweep */
#include "measure.h"

#include "../tests/piles.h"

enum { RATIOS = 5, GROUPS = PILES_CLASSES + RATIOS + 1, MOST_CONTACTS = 60 };

typedef struct row {
    int count, solved, limit, wrong, other;
    double worst, slowest, *times;
} row;

typedef struct answer {
    double *v, *r, *u, *spread, *terms;
    perp_contact_result result;
} answer;

static void add_product(const perp_matrix *A, int transposed, double sign, const double *x,
                        double *sum, double *terms)
{
    for (int j = 0; j < A->columns; j++)
        for (int k = A->column_starts[j]; k < A->column_starts[j + 1]; k++) {
            const int i = A->row_indices[k];
            const int to = transposed ? j : i, from = transposed ? i : j;
            sum[to] += sign * A->values[k] * x[from];
            terms[to] += fabs(A->values[k] * x[from]);
        }
}

/* The largest velocity of a contact, were there none: |H| |M^-1 f| + |w|. M is nearly diagonal. */
static double free_speed(const piles *p)
{
    double largest = 0;
    double *speed = require_memory((size_t)(p->n + p->rows) * sizeof *speed), *sum = speed + p->n;
    memset(speed, 0, (size_t)(p->n + p->rows) * sizeof *speed);
    for (int j = 0; j < p->n; j++)
        for (int k = p->M_starts[j]; k < p->M_starts[j + 1]; k++)
            if (p->M_rows[k] == j)
                speed[j] = fabs(p->f[j] / p->M_values[k]);
    for (int j = 0; j < p->n; j++)
        for (int k = p->H_starts[j]; k < p->H_starts[j + 1]; k++)
            sum[p->H_rows[k]] += fabs(p->H_values[k]) * speed[j];
    for (int i = 0; i < p->rows; i++)
        largest = fmax(largest, sum[i] + fabs(p->w[i]));
    free(speed);
    return largest;
}

/* |M v - f - H'r| over its terms and |u - H v - w| over the free speed. */
static double equations(const piles *p, const answer *a, double speed)
{
    double worst = 0, terms = 0, slip = 0;
    memset(a->spread, 0, (size_t)p->n * sizeof *a->spread);
    memset(a->terms, 0, (size_t)p->n * sizeof *a->terms);
    add_product(&p->M, 0, 1, a->v, a->spread, a->terms);
    add_product(&p->H, 1, -1, a->r, a->spread, a->terms);
    for (int i = 0; i < p->n; i++) {
        worst = fmax(worst, fabs(a->spread[i] - p->f[i]));
        terms = fmax(terms, a->terms[i] + fabs(p->f[i]));
    }
    memset(a->spread, 0, (size_t)p->rows * sizeof *a->spread);
    add_product(&p->H, 0, 1, a->v, a->spread, a->terms);
    for (int i = 0; i < p->rows; i++)
        slip = fmax(slip, fabs(a->spread[i] + p->w[i] - a->u[i]));
    return fmax(terms > 0 ? worst / terms : worst, speed > 0 ? slip / speed : slip);
}

/* The laws on r and u as returned, relative to the largest impulse and free velocity. */
static double laws(const piles *p, const answer *a, double speed)
{
    double r_size = 0, u_size = speed, worst = 0;
    int at = 0;
    for (int i = 0; i < p->rows; i++)
        r_size = fmax(r_size, fabs(a->r[i]));
    r_size = r_size > 0 ? r_size : 1;
    u_size = u_size > 0 ? u_size : 1;
    for (int k = 0; k < p->contacts; at += p->dims[k++]) {
        double rt = 0, ut = 0, power = 0;
        for (int i = 1; i < p->dims[k]; i++) {
            rt = hypot(rt, a->r[at + i]);
            ut = hypot(ut, a->u[at + i]);
            power += a->r[at + i] * a->u[at + i];
        }
        worst = fmax(worst, fmax(-a->r[at] / r_size, -a->u[at] / u_size));
        worst = fmax(worst, fmin(a->r[at] / r_size, a->u[at] / u_size));
        if (p->dims[k] == 1)
            continue;
        worst = fmax(worst, (rt - p->mu[k] * a->r[at]) / (r_size * fmax(1, p->mu[k])));
        /* u_t (mu r_n) = - r_t |u_t|: as much power as there can be */
        worst =
            fmax(worst, (power + p->mu[k] * a->r[at] * ut) / (r_size * u_size * fmax(1, p->mu[k])));
    }
    return worst;
}

static void solve(perp_context *context, int32_t method, uint64_t seed, row *rows)
{
    uint64_t state = seed;
    const int contacts = 4 + (int)(random_bits(&state) % (MOST_CONTACTS - 3));
    const piles_options o = piles_draw(seed, contacts);
    const int ratio = (int)lround(log10(o.mass_ratio) / 2);
    const int groups[] = {o.class, PILES_CLASSES + ratio, GROUPS - 1};
    perp_contact_settings settings = piles_settings(method, 1e-12);
    int good, wrong;
    double start, time, off, speed;
    size_t most;
    piles p;
    answer a;
    piles_make(&p, &o);
    most = (size_t)(p.n > p.rows ? p.n : p.rows);
    a.v = require_memory(5 * most * sizeof *a.v);
    a.r = a.v + most;
    a.u = a.r + most;
    a.spread = a.u + most;
    a.terms = a.spread + most;
    settings.time_limit = 10;
    start = seconds_now();
    require(piles_solve(context, &p, &settings, &a.result, a.v, a.r, a.u, NULL) == PERP_OK,
            perp_context_message(context));
    time = seconds_now() - start;
    speed = free_speed(&p);
    good =
        a.result.outcome == PERP_OUTCOME_SOLVED || a.result.outcome == PERP_OUTCOME_ROUNDING_LIMIT;
    off = good ? fmax(equations(&p, &a, speed), laws(&p, &a, speed)) : 0;
    wrong = a.result.outcome == PERP_OUTCOME_RAY || !(off <= 1e-7);
    for (int g = 0; g < 3; g++) {
        row *r = &rows[groups[g]];
        r->times[r->count++] = 1e6 * time / p.contacts;
        r->solved += a.result.outcome == PERP_OUTCOME_SOLVED;
        r->limit += a.result.outcome == PERP_OUTCOME_ROUNDING_LIMIT;
        r->wrong += wrong;
        r->other += !good && !wrong;
        r->worst = good ? fmax(r->worst, a.result.residual) : r->worst;
        r->slowest = fmax(r->slowest, time);
    }
    if (!good || wrong)
        printf("# %s seed %llu (%s, %d contacts, dim %d, mass ratio %g, mu %g, motion %d): %s by "
               "%s, residual %.1e, off %.1e\n",
               perp_contact_method_text(method), (unsigned long long)seed,
               piles_class_text(o.class), p.contacts, o.dim, o.mass_ratio, o.mu, o.motion,
               perp_outcome_text(a.result.outcome), perp_contact_method_text(a.result.method),
               a.result.residual, off),
            fflush(stdout);
    free(a.v);
    piles_destroy(&p);
}

static void print(const char *name, row *r)
{
    if (r->count > 0)
        printf("%-10s %6d %6d %8d %5d %6d %9.1e %9.1f %9.1f\n", name, r->count, r->solved, r->limit,
               r->wrong, r->other, r->worst, median(r->times, r->count), 1e3 * r->slowest);
}

static void run(perp_context *context, int32_t method, uint64_t first, int count)
{
    static const char *const ratios[RATIOS] = {"ratio 1", "ratio 1e2", "ratio 1e4", "ratio 1e6",
                                               "ratio 1e8"};
    row rows[GROUPS];
    double *times = require_memory((size_t)GROUPS * (size_t)count * sizeof *times);
    memset(rows, 0, sizeof rows);
    for (int k = 0; k < GROUPS; k++)
        rows[k].times = times + k * count;
    for (int k = 0; k < count; k++)
        solve(context, method, first + (uint64_t)k, rows);
    printf("\n%-10s %6s %6s %8s %5s %6s %9s %9s %9s\n", perp_contact_method_text(method), "count",
           "solved", "rounding", "false", "other", "worst", "us cold", "max ms");
    for (int k = 0; k < PILES_CLASSES; k++)
        print(piles_class_text(k), &rows[k]);
    for (int k = 0; k < RATIOS; k++)
        print(ratios[k], &rows[PILES_CLASSES + k]);
    print("all", &rows[GROUPS - 1]);
    printf("\n");
    fflush(stdout);
    free(times);
}

static int32_t method_named(const char *name)
{
    for (int32_t m = 0; m <= PERP_CONTACT_METHOD_PROXIMAL; m++)
        if (strcmp(perp_contact_method_text(m), name) == 0)
            return m;
    require(0, "unknown method");
    return 0;
}

int main(int argc, char **argv)
{
    static const char *const usual[] = {"auto", "proximal", "sweep"};
    const uint64_t first = argc > 1 ? strtoull(argv[1], NULL, 10) : 1;
    const int count = argc > 2 ? atoi(argv[2]) : 300;
    const int named = argc > 3 ? argc - 3 : 3;
    double gflops, gbytes;
    perp_context *context = NULL;
    require(count > 0, "no instances");
    require(perp_context_create(&context, NULL) == PERP_OK, "no context");
    print_machine_speed(&gflops, &gbytes);
    for (int k = 0; k < named; k++)
        run(context, method_named(argc > 3 ? argv[3 + k] : usual[k]), first, count);
    perp_context_destroy(context);
    return 0;
}
