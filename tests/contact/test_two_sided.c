/* Contacts that hold both ways: every method against all the answers that an enumeration of modes
 * finds, closed forms (Dupont's drawer), laws recomputed, zeros, starts, and what is refused. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include <perp/perp.h>

enum { MOST = 20, UNITS = 8 };

static perp_context *context;

static int make(void **state)
{
    (void)state;
    return perp_context_create(&context, NULL);
}

static int destroy(void **state)
{
    (void)state;
    perp_context_destroy(context);
    return 0;
}

/* Rows: contacts of dims[k], then those with bounds, then equations. */
typedef struct problem {
    int32_t contacts, bounded, bilateral, rows, size, n;
    int32_t dims[UNITS], two_sided[UNITS];
    double mu[UNITS], lower[MOST], upper[MOST];
    double W[MOST * MOST], q[MOST];                          /* row-major */
    double M[MOST * MOST], H[MOST * MOST], f[MOST], w[MOST]; /* the same problem */
} problem;

typedef struct answer {
    double v[MOST], r[MOST], u[MOST], ray[MOST];
    int32_t modes[MOST];
    perp_contact_result result;
} answer;

static uint64_t seed;

static double draw(void)
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(seed >> 11) * 0x1p-52 - 1.0;
}

/* x := A^-1 x by elimination with pivoting; 0 where A is singular. */
static int eliminate(int n, double *A, double *x)
{
    for (int j = 0; j < n; j++) {
        int p = j;
        for (int i = j; i < n; i++)
            p = fabs(A[i * MOST + j]) > fabs(A[p * MOST + j]) ? i : p;
        if (!(fabs(A[p * MOST + j]) > 1e-9))
            return 0;
        for (int k = 0; k < n; k++) {
            const double t = A[j * MOST + k];
            A[j * MOST + k] = A[p * MOST + k];
            A[p * MOST + k] = t;
        }
        const double t = x[j];
        x[j] = x[p];
        x[p] = t;
        for (int i = j + 1; i < n; i++) {
            const double l = A[i * MOST + j] / A[j * MOST + j];
            for (int k = j; k < n; k++)
                A[i * MOST + k] -= l * A[j * MOST + k];
            x[i] -= l * x[j];
        }
    }
    for (int j = n; j-- > 0;) {
        for (int k = j + 1; k < n; k++)
            x[j] -= A[j * MOST + k] * x[k];
        x[j] /= A[j * MOST + j];
    }
    return 1;
}

/* W = H M^-1 H', q = H M^-1 f + w. */
static void form(problem *p)
{
    double A[MOST * MOST], x[MOST];
    for (int j = 0; j <= p->size; j++) {
        memcpy(A, p->M, sizeof A);
        for (int i = 0; i < p->n; i++)
            x[i] = j < p->size ? p->H[j * MOST + i] : p->f[i];
        assert_true(eliminate(p->n, A, x));
        for (int i = 0; i < p->size; i++) {
            double sum = j < p->size ? 0.0 : p->w[i];
            for (int k = 0; k < p->n; k++)
                sum += p->H[i * MOST + k] * x[k];
            if (j < p->size)
                p->W[i * MOST + j] = sum;
            else
                p->q[i] = sum;
        }
    }
}

static void add_contact(problem *p, int32_t two_sided, int32_t dim, double mu)
{
    p->two_sided[p->contacts] = two_sided;
    p->dims[p->contacts] = dim;
    p->mu[p->contacts++] = mu;
    p->rows += dim;
}

/* Data of size 1 for n velocities, more than there are rows, so that W is regular. blocks: M falls
 * into blocks of three. */
static void draw_data(problem *p, int32_t bounded, int32_t bilateral, int blocks)
{
    p->bounded = bounded;
    p->bilateral = bilateral;
    p->size = p->rows + bounded + bilateral;
    p->n = 18;
    assert_true(p->size <= p->n);
    for (int i = 0; i < bounded; i++) {
        p->lower[i] = draw();
        p->upper[i] = p->lower[i] + draw() + 1.0;
    }
    for (int i = 0; i < p->n; i++) {
        for (int j = 0; j < p->n; j++)
            for (int k = 0; k < p->n && (!blocks || i / 3 == j / 3); k++)
                p->M[i * MOST + j] += cos(1.7 * i * k + k) * cos(1.7 * j * k + k) / p->n;
        p->M[i * MOST + i] += 0.3;
        p->f[i] = draw();
    }
    for (int i = 0; i < p->size; i++) {
        p->w[i] = draw();
        for (int j = 0; j < p->n; j++)
            p->H[i * MOST + j] = draw();
    }
    form(p);
}

/* Friction of the contacts that hold both ways pushes on their normals: what makes answers many. */
static void skew(problem *p, double by)
{
    for (int k = 0, at = 0; k < p->contacts; at += p->dims[k++])
        for (int j = 0; j < p->n && p->two_sided[k] > 0; j++)
            p->H[(at + 1) * MOST + j] += by * p->H[at * MOST + j];
    form(p);
}

/* ---- enumeration --------------------------------------------------------------------------- */

/* Contacts that hold both ways: stick, r_t = mu N, r_t = -mu N; planar ones: separate, stick, slip
 * either way; rows: lower, between, upper. */
static int choices(const problem *p, int unit)
{
    return unit < p->contacts && p->two_sided[unit] == 0 ? 4 : 3;
}

static void set_row(double *A, double *x, const problem *p, int row, int holds, double value)
{
    for (int j = 0; j < p->size; j++)
        A[row * MOST + j] = holds ? p->W[row * MOST + j] : row == j;
    x[row] = holds ? -p->q[row] : value;
}

static double velocity(const problem *p, const double *r, int row)
{
    double u = p->q[row];
    for (int j = 0; j < p->size; j++)
        u += p->W[row * MOST + j] * r[j];
    return u;
}

/* Planar contact k with these impulses and velocities: whether it does what the mode says. */
static int agrees(const problem *p, int k, int mode, const double *r, double u_n, double u_t)
{
    const double friction = p->mu[k] * fabs(r[0]);
    if (p->two_sided[k] == 1)
        return mode == 0 ? fabs(r[1]) <= friction : r[1] * u_t <= 0.0;
    if (mode == 0 ? u_n < 0.0 : r[0] < 0.0)
        return 0;
    return mode == 1 ? fabs(r[1]) <= friction : mode == 2 ? u_t <= 0.0 : mode == 3 ? u_t >= 0.0 : 1;
}

/* The r of these modes; 0 where their signs are wrong. */
static int solve_modes(const problem *p, const int *mode, double *r)
{
    double A[MOST * MOST];
    int ok = 1;
    for (int k = 0; k < p->contacts; k++) {
        const int both = p->two_sided[k] == 1, slips = mode[k] - (both ? 0 : 1);
        set_row(A, r, p, 2 * k, both || mode[k] > 0, 0.0);
        set_row(A, r, p, 2 * k + 1, slips == 0, 0.0);
        if (slips > 0)
            A[(2 * k + 1) * MOST + 2 * k] = slips == 1 ? -p->mu[k] : p->mu[k];
    }
    for (int i = 0; i < p->bounded; i++) {
        const int at = mode[p->contacts + i];
        set_row(A, r, p, p->rows + i, at == 1, at == 0 ? p->lower[i] : p->upper[i]);
    }
    for (int i = p->rows + p->bounded; i < p->size; i++)
        set_row(A, r, p, i, 1, 0.0);
    if (!eliminate(p->size, A, r))
        return 0;
    for (int k = 0; k < p->contacts; k++)
        ok &= agrees(p, k, mode[k], r + 2 * k, velocity(p, r, 2 * k), velocity(p, r, 2 * k + 1));
    for (int i = 0; i < p->bounded; i++) {
        const int row = p->rows + i, at = mode[p->contacts + i];
        const double u = velocity(p, r, row);
        ok &= at == 0   ? u >= 0.0
              : at == 2 ? u <= 0.0
                        : r[row] >= p->lower[i] && r[row] <= p->upper[i];
    }
    return ok;
}

enum { ANSWERS = 64 };

/* All answers of planar contacts. */
static int enumerate(const problem *p, double found[ANSWERS][MOST])
{
    int mode[MOST] = {0}, count = 0;
    const int units = p->contacts + p->bounded;
    for (;;) {
        int k = 0;
        if (solve_modes(p, mode, found[count])) {
            count++;
            assert_true(count < ANSWERS);
        }
        while (k < units && ++mode[k] == choices(p, k))
            mode[k++] = 0;
        if (k == units)
            return count;
    }
}

/* ---- solving ------------------------------------------------------------------------------- */

static void prepare(const problem *p, int32_t method, perp_contact_laws *laws,
                    perp_contact_settings *settings, answer *a)
{
    memset(a, 0, sizeof *a);
    assert_int_equal(perp_contact_result_init(&a->result, sizeof a->result), PERP_OK);
    assert_int_equal(perp_contact_laws_init(laws, sizeof *laws), PERP_OK);
    laws->contacts = p->contacts;
    laws->dims = p->dims;
    laws->two_sided = p->two_sided;
    laws->mu = p->mu;
    laws->bounded = p->bounded;
    laws->lower = p->lower;
    laws->upper = p->upper;
    assert_int_equal(perp_contact_settings_init(settings, sizeof *settings), PERP_OK);
    settings->method = method;
    settings->tol = 1e-10;
}

static void by_delassus(const problem *p, int32_t method, answer *a)
{
    perp_contact_laws laws;
    perp_contact_settings settings;
    perp_matrix W;
    prepare(p, method, &laws, &settings, a);
    laws.bilateral = p->bilateral;
    assert_int_equal(perp_matrix_init(&W, sizeof W), PERP_OK);
    assert_int_equal(perp_matrix_dense(&W, PERP_STORAGE_ROW_MAJOR, p->size, p->size, p->W, MOST),
                     PERP_OK);
    assert_int_equal(perp_contact_solve_delassus(context, a->r, a->u, a->modes, a->ray, &a->result,
                                                 &settings, &laws, &W, p->q, NULL),
                     PERP_OK);
}

static int32_t solve_mass(double *x, int32_t columns, void *user)
{
    const problem *p = user;
    for (int32_t c = 0; c < columns; c++) {
        double A[MOST * MOST];
        memcpy(A, p->M, sizeof A);
        if (!eliminate(p->n, A, x + c * p->n))
            return 1;
    }
    return 0;
}

static perp_status call(problem *p, int32_t method, int callback, const double *r0, answer *a)
{
    perp_contact_laws laws;
    perp_contact_settings settings;
    perp_contact_dynamics dynamics;
    perp_matrix M, H, G;
    const int32_t rows = p->rows + p->bounded;
    prepare(p, method, &laws, &settings, a);
    assert_int_equal(perp_contact_dynamics_init(&dynamics, sizeof dynamics), PERP_OK);
    perp_matrix_init(&M, sizeof M);
    perp_matrix_init(&H, sizeof H);
    perp_matrix_init(&G, sizeof G);
    assert_int_equal(perp_matrix_dense(&M, PERP_STORAGE_ROW_MAJOR, p->n, p->n, p->M, MOST), 0);
    assert_int_equal(perp_matrix_dense(&H, PERP_STORAGE_ROW_MAJOR, rows, p->n, p->H, MOST), 0);
    assert_int_equal(
        perp_matrix_dense(&G, PERP_STORAGE_ROW_MAJOR, p->bilateral, p->n, p->H + rows * MOST, MOST),
        PERP_OK);
    dynamics.n = p->n;
    dynamics.M = callback ? NULL : &M;
    dynamics.solve = callback ? solve_mass : NULL;
    dynamics.user = p;
    dynamics.H = &H;
    dynamics.G = p->bilateral > 0 ? &G : NULL;
    return perp_contact_solve(context, a->v, a->r, a->u, a->modes, a->ray, &a->result, &settings,
                              &laws, &dynamics, p->f, p->w, p->w + rows, r0);
}

static void by_dynamics(problem *p, int32_t method, int callback, const double *r0, answer *a)
{
    assert_int_equal(call(p, method, callback, r0, a), PERP_OK);
}

static int is_good(const answer *a)
{
    return a->result.outcome == PERP_OUTCOME_SOLVED ||
           a->result.outcome == PERP_OUTCOME_ROUNDING_LIMIT;
}

static void require_solved(const answer *a, uint64_t which)
{
    if (!is_good(a))
        fail_msg("draw %llu: %s by %s, residual %g", (unsigned long long)which,
                 perp_outcome_text(a->result.outcome), perp_contact_method_text(a->result.method),
                 a->result.residual);
}

/* How far r is from the nearest of the answers, relatively. */
static double distance(const problem *p, const double *r, int count, double found[ANSWERS][MOST])
{
    double least = INFINITY;
    for (int k = 0; k < count; k++) {
        double most = 0.0;
        for (int i = 0; i < p->size; i++)
            most = fmax(most, fabs(r[i] - found[k][i]) / (1.0 + fabs(found[k][i])));
        least = fmin(least, most);
    }
    return least;
}

/* With tol 1e-10 and conditions of some hundreds, of W and of the equations of modes, impulses of
 * size 1 are right to 1e-6. */
static void require_one_of(const problem *p, const answer *a, int count,
                           double found[ANSWERS][MOST], uint64_t which)
{
    require_solved(a, which);
    if (!(distance(p, a->r, count, found) <= 1e-6))
        fail_msg("draw %llu: %s's answer is none of %d", (unsigned long long)which,
                 perp_contact_method_text(a->result.method), count);
}

/* The laws of any contact, recomputed: u_N = 0 to the last bit, friction within its disc (1e-15:
 * three roundings) and against the motion, to what tol 1e-10 leaves of numbers of size 1. */
static void require_laws(const problem *p, const answer *a)
{
    for (int k = 0, at = 0; k < p->contacts; at += p->dims[k++]) {
        const double *r = a->r + at, *u = a->u + at;
        double load = 0.0, friction = 0.0, slip = 0.0, power = 0.0;
        for (int i = 0; i < p->two_sided[k]; i++) {
            load = hypot(load, r[i]);
            assert_true(u[i] == 0.0);
        }
        if (p->two_sided[k] == 0)
            continue;
        for (int i = p->two_sided[k]; i < p->dims[k]; i++) {
            friction = hypot(friction, r[i]);
            slip = hypot(slip, u[i]);
            power += r[i] * u[i];
        }
        assert_true(friction <= p->mu[k] * load * (1.0 + 1e-15));
        assert_true(fabs(power + p->mu[k] * load * slip) <= 1e-8 * (1.0 + load));
        assert_true(a->modes[k] == PERP_CONTACT_SLIP ||
                    (a->modes[k] == PERP_CONTACT_STICK && slip == 0.0));
    }
}

/* Two guides, a planar contact, a row with bounds and an equation: whatever a method answers is one
 * of all the answers, and auto, pivoting and proximal answer always, from W, from M, from blocks
 * of M and from a callback. */
static void test_enumerated(void **state)
{
    static const int32_t methods[] = {PERP_CONTACT_METHOD_AUTO, PERP_CONTACT_METHOD_LEMKE,
                                      PERP_CONTACT_METHOD_SWEEP};
    int several = 0;
    (void)state;
    for (uint64_t k = 1; k <= 200; k++) {
        double found[ANSWERS][MOST];
        problem p;
        int count;
        memset(&p, 0, sizeof p);
        seed = 1000 * k;
        for (int c = 0; c < 3; c++)
            add_contact(&p, c < 2, 2, 2.5 + 2.0 * draw());
        draw_data(&p, 1, 1, k % 2 == 0);
        skew(&p, 1.5 * draw());
        count = enumerate(&p, found);
        assert_true(count > 0); /* W is positive definite: there is always one (Brouwer) */
        several += count > 1;
        for (int m = 0; m < 3; m++)
            for (int way = 0; way < 3; way++) {
                answer a;
                if (way < 2)
                    by_dynamics(&p, methods[m], way, NULL, &a);
                else
                    by_delassus(&p, methods[m], &a);
                if (methods[m] == PERP_CONTACT_METHOD_SWEEP && !is_good(&a))
                    continue;
                require_one_of(&p, &a, count, found, k);
                require_laws(&p, &a);
            }
    }
    assert_true(several >= 20);
}

/* Pins, axles, ball joints and guides in space, beside contacts in space: the laws. */
static void test_laws(void **state)
{
    static const int32_t kinds[][2] = {{1, 2}, {1, 3}, {2, 3}, {2, 4}, {3, 4}, {3, 5}, {0, 3}};
    (void)state;
    for (uint64_t k = 1; k <= 200; k++) {
        problem p;
        answer a;
        memset(&p, 0, sizeof p);
        seed = 77 * k;
        for (int c = 0; c < 3; c++) {
            const int32_t *kind = kinds[(int)(3.5 * (draw() + 1.0))];
            add_contact(&p, kind[0], kind[1], 0.8 + 0.7 * draw());
        }
        draw_data(&p, 1, k % 3 == 0, k % 2 == 0);
        by_dynamics(&p, PERP_CONTACT_METHOD_AUTO, 0, NULL, &a);
        require_solved(&a, k);
        require_laws(&p, &a);
        by_delassus(&p, PERP_CONTACT_METHOD_LEMKE, &a);
        require_solved(&a, k);
        require_laws(&p, &a);
    }
}

/* ---- Dupont's drawer ------------------------------------------------------------------------ */

/* A drawer of mass m between guides without clearance, pulled by F at h off its mass centre: corner
 * guides at +-L/2 carry N_2 = -N_1 = m a h / L, so that m a + 2 mu |m a h / L| = F where it moves
 * forward: a = F / (m (1 +- 2 mu h / L)), two answers. One step of h from speed V. */
enum { DRAWER = 3 };

static const double mass = 2.3, inertia = 0.11, pull = 3.0, offset = 0.6, guide = 0.25,
                    friction = 0.35, step = 1e-3, speed = 1.0;

/* Velocities x, y, theta of the mass centre, which is `offset` off the line of the pull and of the
 * guides. */
static void build_drawer(problem *p)
{
    memset(p, 0, sizeof *p);
    add_contact(p, 1, 2, friction);
    add_contact(p, 1, 2, friction);
    p->size = p->rows;
    p->n = DRAWER;
    p->M[0] = p->M[MOST + 1] = mass;
    p->M[2 * MOST + 2] = inertia;
    for (int k = 0; k < 2; k++) {
        double *normal = p->H + 2 * k * MOST, *tangent = normal + MOST;
        normal[1] = 1.0;
        normal[2] = k ? -guide / 2 : guide / 2;
        tangent[0] = 1.0;
        tangent[2] = offset; /* the line is below the mass centre */
    }
    p->f[0] = mass * speed + step * pull;
    p->f[2] = step * pull * offset;
    form(p);
}

static double acceleration(const answer *a)
{
    return (a->v[0] - speed) / step;
}

/* From a start on either side of N each of the two answers is found, and at rest the third, that
 * the drawer jams, where the start sticks. */
static void test_drawer(void **state)
{
    const double arm = 2.0 * friction * offset / guide;
    const double expected[] = {pull / (mass * (1.0 + arm)), pull / (mass * (1.0 - arm))};
    (void)state;
    assert_true(fabs(expected[0] - 0.486697) < 5e-7 && fabs(expected[1] + 1.918159) < 5e-7);
    for (int side = 0; side < 2; side++) {
        const double N = -step * mass * expected[side] * offset / guide;
        const double r0[] = {N, -friction * fabs(N), -N, -friction * fabs(N)};
        problem p;
        answer a;
        build_drawer(&p);
        by_dynamics(&p, PERP_CONTACT_METHOD_AUTO, 0, r0, &a);
        require_solved(&a, (uint64_t)side);
        /* tol 1e-10 of a momentum of 2.3, over m h = 2.3e-3 */
        assert_true(fabs(acceleration(&a) - expected[side]) < 2e-7);
        assert_true(a.u[0] == 0.0 && a.u[2] == 0.0 && a.v[1] == 0.0 && a.v[2] == 0.0);
        assert_int_equal(a.modes[0], PERP_CONTACT_SLIP);
        assert_int_equal(a.modes[1], PERP_CONTACT_SLIP);
    }
}

/* Without a start it is one of the three. */
static void test_drawer_methods(void **state)
{
    static const int32_t methods[] = {PERP_CONTACT_METHOD_AUTO, PERP_CONTACT_METHOD_LEMKE};
    (void)state;
    for (int m = 0; m < 2; m++) {
        problem p;
        answer a;
        build_drawer(&p);
        by_dynamics(&p, methods[m], 0, NULL, &a);
        require_solved(&a, (uint64_t)m);
        assert_true(fabs(acceleration(&a) - 0.486697) < 1e-6 ||
                    fabs(acceleration(&a) + 1.918159) < 1e-6 || a.v[0] == 0.0);
    }
}

/* Pushed against its jam it does not move: v is 0 to the last bit. */
static void test_zeros(void **state)
{
    problem p;
    answer a;
    (void)state;
    build_drawer(&p);
    p.f[0] = step * pull;
    form(&p);
    by_dynamics(&p, PERP_CONTACT_METHOD_AUTO, 0, NULL, &a);
    require_solved(&a, 0);
    if (a.modes[0] == PERP_CONTACT_STICK)
        for (int i = 0; i < 3; i++)
            assert_true(a.v[i] == 0.0);
    p.f[2] = 0.0; /* at the mass centre's height the guides carry it all */
    for (int k = 0; k < 2; k++)
        p.mu[k] = 2.0;
    by_dynamics(&p, PERP_CONTACT_METHOD_AUTO, 0, NULL, &a);
    require_solved(&a, 1);
    require_laws(&p, &a);
}

/* ---- refusals ------------------------------------------------------------------------------- */

static void refuse(problem *p, int32_t method, const char *text)
{
    answer a;
    const perp_status status = call(p, method, 0, NULL, &a);
    assert_int_equal(status, PERP_ERROR_ARGUMENT);
    if (!strstr(perp_context_message(context), text))
        fail_msg("'%s' without '%s'", perp_context_message(context), text);
    build_drawer(p);
}

static void test_refusals(void **state)
{
    problem p;
    (void)state;
    build_drawer(&p);
    p.two_sided[1] = 4;
    refuse(&p, 0, "laws.two_sided[1] is 4, expected 0, 1, 2 or 3");
    p.two_sided[1] = -1;
    refuse(&p, 0, "laws.two_sided[1] is -1, expected 0, 1, 2 or 3");
    p.two_sided[1] = 2;
    refuse(&p, 0, "laws.dims[1] is 2, expected 3 or 4: 2 normals that hold both ways");
    p.dims[0] = 1;
    refuse(&p, 0, "laws.dims[0] is 1, expected 2 or 3");
    p.dims[0] = 4;
    refuse(&p, 0, "laws.dims[0] is 4, expected 2 or 3");
    memset(p.H, 0, MOST * sizeof *p.H);
    refuse(&p, 0, "contact 0: its normal impulse moves nothing");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_enumerated), cmocka_unit_test(test_laws),
        cmocka_unit_test(test_drawer),     cmocka_unit_test(test_drawer_methods),
        cmocka_unit_test(test_zeros),      cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, make, destroy);
}
