/* The implicit step against its own definition: random particles on and between curved surfaces,
 * with masses and forces that depend on everything; what the step returns is put into the equations
 * of the header, evaluated here at the end of the step. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "suite.h"

#include <perp/mechanism.h>
#include <perp/perp.h>

#include "gen.h"

enum { PARTICLES = 2, N = 3 * PARTICLES, CONTACTS = 4, LINKS = 1, DRY = 1, ROWS = 16 };

typedef struct scene {
    int32_t particles, contacts, dim;
    double centre[CONTACTS][3], radius[CONTACTS]; /* < 0: inside of a sphere */
    int32_t first[CONTACTS], second[CONTACTS];    /* second: -1, or the other particle */
    double mu[CONTACTS], gravity[3], mass[PARTICLES], bend, drag;
    int32_t links, dry;
    double dry_bound, dry_direction[2][3], along[3];
    perp_mechanism_model model;
} scene;

static int32_t mass(double *M, const double *q, void *user)
{
    const scene *s = user;
    const int n = 3 * s->particles;
    double square = 0;
    int i, j;

    for (i = 0; i < n; i++)
        square += q[i] * q[i];
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            M[i * n + j] = (i == j ? s->mass[i / 3] : 0.0) + s->bend * q[i] * q[j] / (1 + square);
    return 0;
}

static int32_t force(double *k, double t, const double *q, const double *v, void *user)
{
    const scene *s = user;
    int i;

    for (i = 0; i < 3 * s->particles; i++)
        k[i] =
            s->gravity[i % 3] * s->mass[i / 3] + 0.3 * sin(q[i] + t) - s->drag * v[i] * fabs(v[i]);
    return 0;
}

/* Two directions at right angles to n and to each other. */
static void tangents_of(const double *n, double a[3], double b[3])
{
    const int least = fabs(n[0]) < 0.6 ? 0 : 1;
    double length;
    int i;

    for (i = 0; i < 3; i++)
        a[i] = (i == least) - n[least] * n[i];
    length = sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    for (i = 0; i < 3; i++)
        a[i] /= length;
    b[0] = n[1] * a[2] - n[2] * a[1];
    b[1] = n[2] * a[0] - n[0] * a[2];
    b[2] = n[0] * a[1] - n[1] * a[0];
}

static int32_t contacts(double *gap, double *H, double *drift, double *mu, double t,
                        const double *q, void *user)
{
    const scene *s = user;
    const int n = 3 * s->particles;
    int j, i, row = 0;

    (void)t;
    for (j = 0; j < s->contacts; j++) {
        const double *x = q + 3 * s->first[j];
        const double *y = s->second[j] < 0 ? s->centre[j] : q + 3 * s->second[j];
        const double sign = s->radius[j] < 0 ? -1 : 1;
        double d[3][3], length = 0;

        for (i = 0; i < 3; i++)
            length += (x[i] - y[i]) * (x[i] - y[i]);
        length = sqrt(length);
        if (length < 1e-3)
            return 1; /* no normal there */
        gap[j] = sign * (length - fabs(s->radius[j]));
        for (i = 0; i < 3; i++)
            d[0][i] = sign * (x[i] - y[i]) / length;
        tangents_of(d[0], d[1], d[2]);
        for (i = 0; i < s->dim; i++, row++) {
            int k;

            for (k = 0; k < 3; k++) {
                H[row * n + 3 * s->first[j] + k] = d[i][k];
                if (s->second[j] >= 0)
                    H[row * n + 3 * s->second[j] + k] = -d[i][k];
            }
            drift[row] = i == 1 ? 0.1 : 0.0; /* surfaces that turn like a belt */
        }
        mu[j] = s->mu[j] * (1 + 0.2 * x[0] * x[0]);
    }
    return 0;
}

/* The last particle keeps to a paraboloid. */
static int32_t link(double *c, double *G, double *drift, double t, const double *q, void *user)
{
    const scene *s = user;
    const int at = 3 * (s->particles - 1);

    c[0] = q[at + 2] - 0.4 * q[at] * q[at] - 0.3 * q[at + 1] * q[at + 1] - 0.1 * (t - 0.3);
    G[at] = -0.8 * q[at];
    G[at + 1] = -0.6 * q[at + 1];
    G[at + 2] = 1;
    drift[0] = -0.1;
    return 0;
}

static int32_t dry(double *bound, double *B, double *drift, double t, const double *q,
                   const double *v, void *user)
{
    const scene *s = user;
    int i, k;

    (void)t;
    bound[0] = s->dry_bound * (1 + 0.1 * q[0] * q[0] + 0.05 * v[1] * v[1]);
    for (i = 0; i < s->model.dry_dim; i++)
        for (k = 0; k < 3; k++)
            B[3 * s->particles * i + k] = s->dry_direction[i][k] * (1 + 0.1 * q[2]);
    drift[0] = -0.05;
    return 0;
}

static void make(scene *s, double *q, double *v, gen_random *random, int32_t dim)
{
    int32_t i, j;

    memset(s, 0, sizeof *s);
    s->particles = 1 + gen_integer(random, PARTICLES);
    s->contacts = 1 + gen_integer(random, CONTACTS);
    s->dim = dim;
    s->bend = gen_uniform(random, 0, 1);
    s->drag = gen_uniform(random, 0, 0.3);
    for (i = 0; i < 3; i++)
        s->gravity[i] = gen_uniform(random, -6, 6);
    for (i = 0; i < s->particles; i++) {
        s->mass[i] = exp(gen_uniform(random, -1, 1));
        for (j = 0; j < 3; j++) {
            q[3 * i + j] = gen_uniform(random, -1, 1) + 2 * i * (j == 0);
            v[3 * i + j] = gen_uniform(random, -2, 2);
        }
    }
    for (j = 0; j < s->contacts; j++) {
        const double wanted = gen_uniform(random, -0.3, 1) * 0.02;
        double length = 0;

        s->first[j] = gen_integer(random, s->particles);
        s->second[j] = j == 3 && s->particles == 2 ? 1 - s->first[j] : -1;
        s->mu[j] = gen_integer(random, 4) == 0 ? 0 : gen_uniform(random, 0, 1.2);
        for (i = 0; i < 3; i++) {
            const double *y = q + 3 * s->second[j];

            s->centre[j][i] = q[3 * s->first[j] + i] + gen_uniform(random, -1, 1);
            length += s->second[j] < 0 ? pow(q[3 * s->first[j] + i] - s->centre[j][i], 2)
                                       : pow(q[3 * s->first[j] + i] - y[i], 2);
        }
        length = sqrt(length);
        s->radius[j] = gen_integer(random, 2) ? -(length + wanted) : length - wanted;
        if (fabs(s->radius[j]) < 0.1 || s->second[j] >= 0)
            s->radius[j] = length - wanted;
    }
    s->links = gen_integer(random, 2);
    if (s->links) {
        const int at = 3 * (s->particles - 1);

        q[at + 2] = 0.4 * q[at] * q[at] + 0.3 * q[at + 1] * q[at + 1];
        v[at + 2] = 0.1 + 0.8 * q[at] * v[at] + 0.6 * q[at + 1] * v[at + 1];
    }
    s->dry = gen_integer(random, 2);
    s->dry_bound = gen_uniform(random, 0, 8);
    tangents_of((double[3]){0.6, 0, 0.8}, s->dry_direction[0], s->dry_direction[1]);
    assert_int_equal(perp_mechanism_model_init(&s->model, sizeof s->model), PERP_OK);
    s->model.velocities = 3 * s->particles;
    s->model.contacts = s->contacts;
    s->model.dim = dim;
    s->model.bilateral = s->links;
    s->model.dry = s->dry;
    s->model.dry_dim = dim - 1;
    s->model.mass = mass;
    s->model.force = force;
    s->model.contact_rows = contacts;
    s->model.bilateral_rows = s->links ? link : NULL;
    s->model.dry_rows = s->dry ? dry : NULL;
    s->model.mu = s->mu;
    s->model.user = s;
}

/* Largest violation, as a velocity or an impulse (masses and speeds are of the order of 1): r
 * within the disc, or its polygon, and of all forces there the one that takes the most from u. */
static double friction(double radius, const double *r, const double *u, int32_t size, int32_t edges)
{
    double size_r = 0, most = 0, along = 0, outside;
    int32_t i;

    for (i = 0; i < size; i++) {
        size_r = hypot(size_r, r[i]);
        most = hypot(most, u[i]);
        along += r[i] * u[i];
    }
    outside = size_r - radius;
    if (size == 2 && edges > 0) {
        const double step = 2 * 3.14159265358979323846 / edges;

        for (i = 0, most = 0, outside = 0; i < edges; i++) {
            const double middle = (i + 0.5) * step;

            most = fmax(most, -(cos(i * step) * u[0] + sin(i * step) * u[1]));
            outside =
                fmax(outside, cos(middle) * r[0] + sin(middle) * r[1] - radius * cos(step / 2));
        }
    }
    return fmax(outside, fabs(along + radius * most));
}

static double violation(scene *s, const double *q0, const double *v0, const double *q,
                        const double *v, const double *r, double t, double h, int32_t edges)
{
    const int n = 3 * s->particles, dim = s->dim;
    double M[N * N] = {0}, k[N] = {0}, J[ROWS * N] = {0}, drift[ROWS] = {0}, gap[CONTACTS] = {0};
    double gap0[CONTACTS] = {0}, unused[ROWS * N] = {0}, mu[CONTACTS] = {0}, c = 0, bound = 0;
    double u[ROWS], worst = 0;
    int rows = dim * s->contacts, i, j;

    contacts(gap0, unused, drift, mu, t, q0, s);
    memset(drift, 0, sizeof drift);
    mass(M, q, s);
    force(k, t + h, q, v, s);
    contacts(gap, J, drift, mu, t + h, q, s);
    if (s->links) {
        link(&c, J + rows * n, drift + rows, t + h, q, s);
        rows++;
    }
    if (s->dry) {
        dry(&bound, J + rows * n, drift + rows, t + h, q, v, s);
        rows += dim - 1;
    }
    for (i = 0; i < n; i++) {
        double sum = -h * k[i];

        for (j = 0; j < n; j++)
            sum += M[i * n + j] * (v[j] - v0[j]);
        for (j = 0; j < rows; j++)
            sum -= J[j * n + i] * r[j];
        worst = fmax(worst, fabs(sum));
        worst = fmax(worst, fabs(q[i] - q0[i] - h * v[i]) / h);
    }
    for (j = 0; j < rows; j++) {
        u[j] = drift[j];
        for (i = 0; i < n; i++)
            u[j] += J[j * n + i] * v[i];
    }
    for (j = 0; j < s->contacts; j++) {
        const double room = (gap[j] - fmin(gap0[j], 0)) / h;

        worst = fmax(worst, fmax(-room, -r[dim * j]));
        worst = fmax(worst, fmin(fabs(room), fabs(r[dim * j])));
        worst = fmax(
            worst, friction(mu[j] * r[dim * j], r + dim * j + 1, u + dim * j + 1, dim - 1, edges));
    }
    if (s->links)
        worst = fmax(worst, fabs(c) / h);
    if (s->dry)
        worst = fmax(worst,
                     friction(h * bound, r + rows - dim + 1, u + rows - dim + 1, dim - 1, edges));
    return worst;
}

typedef struct tally {
    int32_t fallbacks, presses, sticks;
} tally;

/* One step of a random scene. */
static void attempt(gen_random *random, int32_t dim, int32_t edges, double h, tally *all)
{
    perp_mechanism_settings settings = fresh_mechanism_settings();
    perp_mechanism_step step = fresh_mechanism_step();
    perp_mechanism *mechanism;
    perp_context *context;
    double q0[N], v0[N], q[N], v[N], r[ROWS], u[ROWS];
    int32_t modes[CONTACTS + DRY];
    scene s;

    make(&s, q0, v0, random, dim);
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    settings.scheme = PERP_MECHANISM_IMPLICIT;
    settings.project = 0;
    settings.cone = edges;
    assert_int_equal(perp_mechanism_create(context, &mechanism, &settings, &s.model), PERP_OK);
    if (perp_mechanism_advance(mechanism, q, v, r, u, modes, NULL, &step, START(0.3, h, q0, v0)) !=
        PERP_OK)
        fail_msg("%s", perp_context_message(context));
    if (step.scheme == PERP_MECHANISM_IMPLICIT) {
        const double left = violation(&s, q0, v0, q, v, r, 0.3, h, edges);

        /* what rounding of gap / h leaves is called that, no less and no more */
        assert_in_range(step.outcome, PERP_OUTCOME_SOLVED, PERP_OUTCOME_ROUNDING_LIMIT);
        assert_int_equal(step.outcome == PERP_OUTCOME_SOLVED, step.residual <= settings.tol);
        /* gaps are known up to 16 eps of their terms, |q| of up to 4 in three of them; the rest is
           solved to tol = 1e-10 of speeds up to 5 */
        if (!(left < 1e-9 + 4e-14 / h))
            fail_msg("h = %g: the step's equations are violated by %g", h, left);
        all->presses += step.closed;
        all->sticks += step.sticking;
    } else {
        all->fallbacks++;
        /* a long step may jump over what it touches; else no answer means that there is none:
           surfaces that close in on the particle that the link moves */
        if (h < 0.05 && step.outcome == PERP_OUTCOME_SOLVED)
            fail_msg("h = %g: there is an answer with the rows at the start", h);
    }
    perp_mechanism_destroy(mechanism);
    perp_context_destroy(context);
}

static void try_all(int32_t dim, int32_t edges)
{
    static const double lengths[] = {1e-1, 1e-2, 1e-4, 1e-7};
    size_t k;

    for (k = 0; k < sizeof lengths / sizeof *lengths; k++) {
        gen_random random;
        tally all = {0, 0, 0};
        int32_t i;

        gen_seed(&random, (uint64_t)(1 + dim + edges));
        for (i = 0; i < 60; i++)
            attempt(&random, dim, edges, lengths[k], &all);
        assert_in_range(all.fallbacks, 0, 6);
        assert_in_range(all.presses, 10, 240);
        assert_in_range(all.sticks, 1, 240);
    }
}

static void test_planar(void **state)
{
    (void)state;
    try_all(2, 0);
}

static void test_exact(void **state)
{
    (void)state;
    try_all(3, 0);
}

static void test_polygon(void **state)
{
    (void)state;
    try_all(3, 5);
    try_all(3, 8);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_planar),
        cmocka_unit_test(test_exact),
        cmocka_unit_test(test_polygon),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
