/* Sparse problems with compressed columns, by Lemke's method on a factored basis and by others.
 * 'KLU' is one KLU analysis and factorisation of the final active block, 'solve / KLU' the whole
 * solve in units of it, both the best of the repeats, taken in turn; '-' where KLU finds that block
 * singular, or it is empty. 'iter.' counts active-set steps and pivots. 'MB' is the largest
 * resident memory of the process, which does nothing but this row, its problem and KLU's factors
 * included.
 *   obstacle    five-point Laplacian, z >= 0, a load that lifts it in patches
 *   convection  the same with first-order terms: not symmetric
 *   box         the obstacle problem with an upper bound as well
 *   program     optimality conditions of a quadratic program, a fifth of the variables being free
 *               multipliers of equations
 *   contacts    Stewart and Trinkle's problem of spheres in a lattice, four friction directions
 *   random      five entries a column, of size 1, diagonal 2
 *   plate       the biharmonic operator by 13 points, pressed on a dome
 *   hertz       a sphere pressed into an elastic block: a lattice of springs along the 18 nearest
 *               directions, three displacements a node, bounds on the top layer's vertical ones
 * 'cold' starts from the slacks (crash = 0): a pivot for every active variable. */
#include "measure.h"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

typedef struct problem {
    int32_t n;
    int32_t *starts, *rows;
    double *values, *q, *lower, *upper, *z;
    int32_t room;
} problem;

static void begin(problem *lcp, int32_t n, int32_t room)
{
    lcp->n = n;
    lcp->room = room;
    lcp->starts = require_memory(((size_t)n + 1) * sizeof *lcp->starts);
    lcp->rows = require_memory((size_t)room * sizeof *lcp->rows);
    lcp->values = require_memory((size_t)room * sizeof *lcp->values);
    lcp->q = require_memory(4 * (size_t)n * sizeof *lcp->q);
    lcp->lower = lcp->q + n;
    lcp->upper = lcp->lower + n;
    lcp->z = lcp->upper + n;
    lcp->starts[0] = 0;
    for (int32_t i = 0; i < n; i++) {
        lcp->lower[i] = 0;
        lcp->upper[i] = INFINITY;
    }
}

/* Adds an entry to column j, the last one begun; entries of a column may come in any order. */
static void put(problem *lcp, int32_t i, int32_t j, double value)
{
    int32_t first = lcp->starts[j], at = lcp->starts[j + 1];
    require(at < lcp->room, "too many entries");
    for (int32_t k = first; k < at; k++)
        if (lcp->rows[k] == i) {
            lcp->values[k] += value;
            return;
        }
    for (; at > first && lcp->rows[at - 1] > i; at--) {
        lcp->rows[at] = lcp->rows[at - 1];
        lcp->values[at] = lcp->values[at - 1];
    }
    lcp->rows[at] = i;
    lcp->values[at] = value;
    lcp->starts[j + 1]++;
}

static void put_laplacian(problem *lcp, int32_t j, int32_t side, double wind)
{
    static const int across[] = {0, -1, 0, 1, 0}, along[] = {-1, 0, 0, 0, 1};
    int32_t x = j % side, y = j / side;
    for (int d = 0; d < 5; d++) {
        int32_t a = x + across[d], b = y + along[d];
        if (a >= 0 && a < side && b >= 0 && b < side)
            put(lcp, a + side * b, j, (d == 2 ? 4 : -1) - wind * across[d]);
    }
}

static void create_obstacle(problem *lcp, int32_t side, double wind, double upper)
{
    const double h = 1.0 / (side + 1), pi = 3.14159265358979;
    begin(lcp, side * side, 5 * side * side);
    for (int32_t j = 0; j < lcp->n; j++) {
        double x = h * (j % side + 1), y = h * (j / side + 1);
        lcp->starts[j + 1] = lcp->starts[j];
        put_laplacian(lcp, j, side, wind * h);
        lcp->q[j] = -10 * h * h * sin(3 * pi * x) * sin(2 * pi * y);
        lcp->upper[j] = upper;
    }
}

/* q such that z, random, solves the problem: half of the bounded variables are 0. */
static void make_load(problem *lcp, uint64_t *seed)
{
    for (int32_t i = 0; i < lcp->n; i++) {
        int up = lcp->lower[i] < 0 || random_bits(seed) % 2;
        lcp->z[i] = up ? fabs(random_number(seed)) : 0;
        lcp->q[i] = up ? 0 : fabs(random_number(seed));
    }
    for (int32_t j = 0; j < lcp->n; j++)
        for (int32_t k = lcp->starts[j]; k < lcp->starts[j + 1]; k++)
            lcp->q[lcp->rows[k]] -= lcp->values[k] * lcp->z[j];
}

static void create_program(problem *lcp, int32_t side)
{
    int32_t variables = side * side, equations = variables / 4, entries[3];
    uint64_t seed = 1;
    begin(lcp, variables + equations, 5 * variables + 8 * equations + variables);
    /* equation r holds variables 4 r, 4 r + 1 and 4 r + 3: column by column that is simple */
    for (int32_t j = 0; j < variables; j++) {
        lcp->starts[j + 1] = lcp->starts[j];
        put_laplacian(lcp, j, side, 0);
        put(lcp, j, j, 0.5);
        if (j % 4 != 2 && j / 4 < equations)
            put(lcp, variables + j / 4, j, j % 4 == 0 ? 2 : j % 4 == 1 ? 0.7 : -0.4);
    }
    for (int32_t r = 0; r < equations; r++) {
        int32_t j = variables + r;
        lcp->starts[j + 1] = lcp->starts[j];
        lcp->lower[j] = -INFINITY;
        for (int32_t k = 0; k < 3; k++) {
            entries[k] = 4 * r + (k == 2 ? 3 : k);
            put(lcp, entries[k], j, -(k == 0 ? 2 : k == 1 ? 0.7 : -0.4));
        }
    }
    make_load(lcp, &seed);
}

static void create_random(problem *lcp, int32_t n)
{
    uint64_t seed = 2;
    begin(lcp, n, 5 * n);
    for (int32_t j = 0; j < n; j++) {
        lcp->starts[j + 1] = lcp->starts[j];
        put(lcp, j, j, 2);
        for (int k = 0; k < 4; k++) {
            int32_t i = (int32_t)(random_bits(&seed) % (uint64_t)n);
            if (i != j)
                put(lcp, i, j, random_number(&seed));
        }
        lcp->q[j] = random_number(&seed);
    }
}

/* A contact's normal and friction directions; the bodies have mass 1 and do not turn. */
typedef struct contact {
    int32_t body[2]; /* -1: the ground */
    double axis[5][3];
} contact;

static void make_axes(contact *c, const double *towards, uint64_t *seed)
{
    double n[3], t[3], s[3], size = 0, dot = 0;
    for (int k = 0; k < 3; k++)
        n[k] = towards[k] + 0.3 * random_number(seed);
    for (int k = 0; k < 3; k++)
        size += n[k] * n[k];
    for (int k = 0; k < 3; k++)
        n[k] /= sqrt(size);
    for (int k = 0; k < 3; k++) {
        t[k] = random_number(seed);
        dot += t[k] * n[k];
    }
    size = 0;
    for (int k = 0; k < 3; k++) {
        t[k] -= dot * n[k];
        size += t[k] * t[k];
    }
    for (int k = 0; k < 3; k++)
        t[k] /= sqrt(size);
    for (int k = 0; k < 3; k++)
        s[k] = n[(k + 1) % 3] * t[(k + 2) % 3] - n[(k + 2) % 3] * t[(k + 1) % 3];
    for (int k = 0; k < 3; k++) {
        c->axis[0][k] = n[k];
        c->axis[1][k] = t[k];
        c->axis[2][k] = s[k];
        c->axis[3][k] = -t[k];
        c->axis[4][k] = -s[k];
    }
}

static int share_a_body(const contact *c, const contact *d)
{
    for (int k = 0; k < 2; k++)
        for (int l = 0; l < 2; l++)
            if (c->body[k] >= 0 && c->body[k] == d->body[l])
                return 1;
    return 0;
}

/* Entry of the Delassus matrix between axis a of contact c and axis b of contact d. */
static double delassus(const contact *c, int a, const contact *d, int b)
{
    double sum = 0;
    for (int k = 0; k < 2; k++)
        for (int l = 0; l < 2; l++)
            for (int x = 0; x < 3 && c->body[k] >= 0 && c->body[k] == d->body[l]; x++)
                sum += (k == l ? 1 : -1) * c->axis[a][x] * d->axis[b][x];
    return sum;
}

/* Contacts between neighbours across and above, and with the ground; rows normal, four frictions,
 * slip speed. */
static void create_contacts(problem *lcp, int32_t side)
{
    const double up[3] = {0, 0, 1}, across[3] = {1, 0, 0}, mu = 0.5;
    int32_t count = 0, most = 2 * side * side;
    contact *contacts = require_memory((size_t)most * sizeof *contacts);
    uint64_t seed = 3;
    for (int32_t body = 0; body < side * side; body++) {
        contacts[count].body[0] = body;
        contacts[count].body[1] = body < side ? -1 : body - side;
        make_axes(&contacts[count++], up, &seed);
        if (body % side == 0)
            continue;
        contacts[count].body[0] = body;
        contacts[count].body[1] = body - 1;
        make_axes(&contacts[count++], across, &seed);
    }
    begin(lcp, 6 * count, 6 * count * 50);
    for (int32_t d = 0, j = 0; d < count; d++)
        for (int b = 0; b < 6; b++, j++) {
            lcp->starts[j + 1] = lcp->starts[j];
            lcp->q[j] = b < 5 ? -contacts[d].axis[b][2] + 0.1 * random_number(&seed) : 0;
            for (int32_t c = d - 4 * side > 0 ? d - 4 * side : 0;
                 b < 5 && c < count && c <= d + 4 * side; c++)
                for (int a = 0; a < 5 && share_a_body(&contacts[c], &contacts[d]); a++) {
                    double entry = delassus(&contacts[c], a, &contacts[d], b);
                    if (entry != 0)
                        put(lcp, 6 * c + a, j, entry);
                }
            for (int a = 1; a < 5 && b == 5; a++)
                put(lcp, 6 * d + a, j, 1);
            if (b < 5)
                put(lcp, 6 * d + 5, j, b == 0 ? mu : -1);
        }
    free(contacts);
}

static void create_plate(problem *lcp, int32_t side)
{
    const double h = 1.0 / (side + 1);
    begin(lcp, side * side, 13 * side * side);
    for (int32_t j = 0; j < lcp->n; j++) {
        const int x = j % side, y = j / side;
        const double r2 = pow(h * (x + 1) - 0.5, 2) + pow(h * (y + 1) - 0.5, 2);
        lcp->starts[j + 1] = lcp->starts[j];
        for (int b = -2; b <= 2; b++) /* the square of the five-point stencil */
            for (int a = -2; a <= 2; a++)
                for (int c = 0; c < 5; c++) {
                    const int u = c == 0 ? -1 : c == 1, v = c == 2 ? -1 : c == 3;
                    const int near = abs(a - u) + abs(b - v);
                    const int inside = x + u >= 0 && x + u < side && y + v >= 0 && y + v < side;
                    if (near < 2 && inside && x + a >= 0 && x + a < side && y + b >= 0 &&
                        y + b < side)
                        put(lcp, x + a + side * (y + b), j,
                            (near ? -1.0 : 4.0) * (c < 4 ? -1.0 : 4.0));
                }
        lcp->q[j] = 300 * pow(h, 4);
        lcp->lower[j] = -0.03 - 0.5 * r2;
    }
}

static void create_hertz(problem *lcp, int32_t size)
{
    const int side = (int)(cbrt(2.0 * size / 3) + 0.5), high = side / 2;
    begin(lcp, 3 * side * side * high, 57 * 3 * side * side * high);
    for (int32_t j = 0; j < lcp->n; j++) {
        const int node = j / 3, x = node % side, y = node / side % side, z = node / side / side;
        lcp->starts[j + 1] = lcp->starts[j];
        for (int d = 0; d < 27; d++) {
            const int to[3] = {d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1};
            const int square = to[0] * to[0] + to[1] * to[1] + to[2] * to[2];
            const int a = x + to[0], b = y + to[1], c = z + to[2]; /* c < 0: the fixed floor */
            if (square == 0 || square > 2 || a < 0 || a >= side || b < 0 || b >= side || c >= high)
                continue;
            for (int k = 0; k < 3; k++) {
                const double value = (double)(to[k] * to[j % 3]) / square;
                if (value != 0)
                    put(lcp, 3 * node + k, j, value);
                if (value != 0 && c >= 0)
                    put(lcp, 3 * (a + side * (b + side * c)) + k, j, -value);
            }
        }
        lcp->q[j] = 0;
        lcp->lower[j] = -INFINITY;
        if (j % 3 == 2 && z == high - 1)
            lcp->upper[j] =
                (pow(x - 0.5 * (side - 1), 2) + pow(y - 0.5 * (side - 1), 2)) / (2.0 * side) - 0.8;
    }
}

static void create(problem *lcp, const char *name, int32_t size)
{
    int32_t side = (int32_t)(sqrt((double)size) + 0.5);
    if (!strcmp(name, "obstacle"))
        create_obstacle(lcp, side, 0, INFINITY);
    else if (!strcmp(name, "convection"))
        create_obstacle(lcp, side, 20, INFINITY);
    else if (!strcmp(name, "box"))
        create_obstacle(lcp, side, 0, 0.02);
    else if (!strcmp(name, "program"))
        create_program(lcp, (int32_t)(sqrt(0.8 * size) + 0.5));
    else if (!strcmp(name, "contacts"))
        create_contacts(lcp, (int32_t)(sqrt(size / 12.0) + 0.5));
    else if (!strcmp(name, "plate"))
        create_plate(lcp, side);
    else if (!strcmp(name, "hertz"))
        create_hertz(lcp, size);
    else
        create_random(lcp, size);
}

/* KLU as the library is linked with it; its structs stay its own. */
typedef struct klu {
    int (*defaults)(void *);
    void *(*analyze)(int, int *, int *, void *);
    void *(*factor)(int *, int *, double *, void *, void *);
    int (*free_symbolic)(void **, void *);
    int (*free_numeric)(void **, void *);
    double common[256];
} klu;

static int find_klu(klu *found)
{
    void *program = dlopen(NULL, RTLD_LAZY);
    void *addresses[5] = {dlsym(program, "klu_defaults"), dlsym(program, "klu_analyze"),
                          dlsym(program, "klu_factor"), dlsym(program, "klu_free_symbolic"),
                          dlsym(program, "klu_free_numeric")};
    for (int k = 0; k < 5; k++)
        if (!addresses[k])
            return 0;
    memcpy(&found->defaults, &addresses[0], sizeof addresses[0]);
    memcpy(&found->analyze, &addresses[1], sizeof addresses[0]);
    memcpy(&found->factor, &addresses[2], sizeof addresses[0]);
    memcpy(&found->free_symbolic, &addresses[3], sizeof addresses[0]);
    memcpy(&found->free_numeric, &addresses[4], sizeof addresses[0]);
    return found->defaults(found->common);
}

/* The block of the variables between their bounds. */
static void active_block(const problem *lcp, problem *block)
{
    int32_t *local = require_memory((size_t)lcp->n * sizeof *local), count = 0;
    for (int32_t i = 0; i < lcp->n; i++)
        local[i] = lcp->z[i] > lcp->lower[i] && lcp->z[i] < lcp->upper[i] ? count++ : -1;
    begin(block, count, lcp->starts[lcp->n] + 1);
    for (int32_t j = 0; j < lcp->n; j++) {
        if (local[j] < 0)
            continue;
        block->starts[local[j] + 1] = block->starts[local[j]];
        for (int32_t k = lcp->starts[j]; k < lcp->starts[j + 1]; k++)
            if (local[lcp->rows[k]] >= 0)
                put(block, local[lcp->rows[k]], local[j], lcp->values[k]);
    }
    free(local);
}

static double time_klu(klu *found, const problem *block)
{
    double start = seconds_now(), end;
    void *symbolic = found->analyze(block->n, block->starts, block->rows, found->common);
    void *numeric =
        symbolic ? found->factor(block->starts, block->rows, block->values, symbolic, found->common)
                 : NULL;
    end = numeric ? seconds_now() : INFINITY; /* singular */
    found->free_numeric(&numeric, found->common);
    found->free_symbolic(&symbolic, found->common);
    return end - start;
}

static void measure(const char *name, const problem *lcp, int32_t method, int crash)
{
    perp_context *context = NULL;
    perp_lcp_settings settings;
    perp_lcp_result result;
    perp_lcp_solver *solver = NULL;
    perp_matrix view;
    struct rusage usage;
    problem block = {0};
    klu found;
    double best = INFINITY, unit = INFINITY, total = 0;
    int has_klu = find_klu(&found);
    require(perp_context_create(&context, NULL) == PERP_OK, "no context");
    perp_lcp_settings_init(&settings, sizeof settings);
    perp_struct_init(&result, sizeof result);
    perp_struct_init(&view, sizeof view);
    settings.method = method;
    settings.crash = crash;
    perp_status status =
        perp_matrix_csc(&view, lcp->n, lcp->n, lcp->starts, lcp->rows, lcp->values);
    if (status == PERP_OK)
        status = perp_lcp_solver_create(context, &solver, &settings);
    if (status == PERP_OK)
        status = perp_lcp_solver_setup(solver, &view, lcp->lower, lcp->upper);
    /* the first solve allocates; it counts only where it is too long to be repeated */
    for (int k = 0; k < 6 && status == PERP_OK && total < 3; k++) {
        double start = seconds_now(), seconds;
        status = perp_lcp_solver_solve(solver, lcp->z, NULL, NULL, &result, lcp->q, NULL);
        seconds = seconds_now() - start;
        total += seconds;
        if (k > 0 || seconds > 1)
            best = fmin(best, seconds);
        if (k == 0)
            active_block(lcp, &block);
        if (has_klu && block.n > 0 && (k == 0 || seconds < 1))
            unit = fmin(unit, time_klu(&found, &block));
    }
    require(status == PERP_OK, perp_context_message(context));
    getrusage(RUSAGE_SELF, &usage);
    printf("%-10s %7d %8d %-11s %-8s %7lld %8.1e %10.2f ", name, lcp->n, lcp->starts[lcp->n],
           crash ? perp_lcp_method_text(method) : "lemke, cold", perp_outcome_text(result.outcome),
           (long long)result.iterations, result.residual, 1e3 * best);
    if (isinf(unit))
        printf("%9s %9s", "-", "-");
    else
        printf("%9.2f %9.2f", 1e3 * unit, best / unit);
    printf(" %6.0f\n", (double)usage.ru_maxrss / 1024);
    perp_lcp_solver_destroy(solver);
    perp_context_destroy(context);
}

/* A process of its own for every row: its peak of memory is the row's. */
static void measure_apart(const char *name, int32_t size, int32_t method, int crash)
{
    pid_t child;
    fflush(stdout);
    child = fork();
    require(child >= 0, "no process");
    if (child == 0) {
        problem lcp;
        create(&lcp, name, size);
        measure(name, &lcp, method, crash);
        fflush(stdout);
        _exit(0);
    }
    waitpid(child, NULL, 0);
}

/* lcp_sparse [PROBLEM [LARGEST]]: one class alone, and no larger than that. */
int main(int count, char **arguments)
{
    static const char *const names[] = {"obstacle", "convection", "box",   "program",
                                        "contacts", "random",     "plate", "hertz"};
    static const int32_t largest[] = {1000000, 100000, 1000000, 100000, 3000, 10000, 100000, 10000};
    static const int32_t sizes[] = {100, 300, 1000, 3000, 10000, 30000, 100000, 300000, 1000000};
    const char *wanted = count > 1 ? arguments[1] : NULL;
    const long limit = count > 2 ? strtol(arguments[2], NULL, 10) : 1000000;
    double gflops, gbytes;
    print_machine_speed(&gflops, &gbytes);
    printf("\n%-10s %7s %8s %-11s %-8s %7s %8s %10s %9s %9s %6s\n", "problem", "n", "nonzeros",
           "method", "outcome", "iter.", "residual", "ms", "KLU, ms", "solve/KLU", "MB");
    for (size_t p = 0; p < sizeof names / sizeof *names; p++)
        for (size_t s = 0; s < sizeof sizes / sizeof *sizes && sizes[s] <= largest[p]; s++) {
            if (sizes[s] > limit || (wanted && strcmp(wanted, names[p]) != 0))
                continue;
            measure_apart(names[p], sizes[s], PERP_LCP_AUTO, 1);
            if (!strcmp(names[p], "plate") || !strcmp(names[p], "hertz"))
                continue;
            measure_apart(names[p], sizes[s], PERP_LCP_LEMKE, 1);
            if (sizes[s] <= 100000 && strcmp(names[p], "contacts") != 0)
                measure_apart(names[p], sizes[s], PERP_LCP_ACTIVE_SET, 1);
            if (sizes[s] <= 1000)
                measure_apart(names[p], sizes[s], PERP_LCP_FISCHER, 1);
            if (sizes[s] <= 3000)
                measure_apart(names[p], sizes[s], PERP_LCP_LEMKE, 0);
        }
    return 0;
}
