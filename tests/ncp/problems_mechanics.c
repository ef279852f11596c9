/* Lubrication, friction, beams, trusses, control. */
#include "problems.h"

static const double pi = 3.14159265358979323846;

/* Two elastic cylinders with a lubricant between, line contact: pressures p_1 .. p_N and the
 * constant k of the gap. data: dh_j / dp_m, j = 0 .. N by m = 1 .. N. */
typedef struct film {
    double h, h3, slope; /* gap, its cube, 3 h^2 */
} film;

static film gap(const zoo_problem *p, const double *z, int32_t j)
{
    const int32_t N = p->n - 1;
    const double *row = p->data + (ptrdiff_t)N * j;
    double x = -3 + (j + 0.5) * 5.0 / N, h = x * x + z[N] + 1;
    for (int32_t m = 0; m < N; m++)
        h += row[m] * z[m];
    return (film){h, h * h * h, 3 * h * h};
}

static int32_t lubrication(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    const int32_t N = p->n - 1;
    const double dx = 5.0 / N, alpha = 2.832, lambda = 6.057, d2 = 1 / (dx * dx);
    film low = gap(p, z, 0);
    F[N] = 1;
    for (int32_t i = 1; i <= N; i++) {
        film high = gap(p, z, i);
        double here = z[i - 1], left = i > 1 ? z[i - 2] : 0, right = i < N ? z[i] : 0;
        double up = exp(-0.5 * alpha * (here + right)), down = exp(-0.5 * alpha * (here + left));
        double rise = right - here, fall = here - left, weight = dx * 2 / pi * (i < N ? 1 : 0.5);
        F[i - 1] =
            lambda / dx * (high.h - low.h) - d2 * (high.h3 * rise * up - low.h3 * fall * down);
        F[N] -= weight * here;
        if (J) {
            double of_high = lambda / dx - d2 * high.slope * rise * up;
            double of_low = -lambda / dx + d2 * low.slope * fall * down;
            for (int32_t m = 0; m < N; m++)
                zoo_add(J, i - 1, m,
                        of_high * p->data[(ptrdiff_t)N * i + m] +
                            of_low * p->data[(ptrdiff_t)N * (i - 1) + m]);
            zoo_add(J, i - 1, N, of_high + of_low);
            zoo_add(J, i - 1, i - 1,
                    d2 * (high.h3 * up * (1 + 0.5 * alpha * rise) +
                          low.h3 * down * (1 - 0.5 * alpha * fall)));
            if (i < N)
                zoo_add(J, i - 1, i, -d2 * high.h3 * up * (1 - 0.5 * alpha * rise));
            if (i > 1)
                zoo_add(J, i - 1, i - 2, -d2 * low.h3 * down * (1 + 0.5 * alpha * fall));
            zoo_add(J, N, i - 1, -weight);
        }
        low = high;
    }
    return 0;
}

static void build_lubrication(zoo_problem *p, int32_t N)
{
    double dx = 5.0 / N;
    zoo_size(p, N + 1, lubrication);
    double *K = zoo_data(p, (size_t)N * (size_t)(N + 1)), *start = zoo_start(p, 0);
    for (int32_t j = 0; j <= N; j++) {
        for (int32_t i = 0; i <= N; i++) {
            double d = (i - j - 0.5) * dx, w = i == 0 || i == N ? 0.5 : 1;
            double g = w * d * log(fabs(d)) / pi;
            if (i < N)
                K[(ptrdiff_t)N * j + i] += g; /* of p_(i+1) */
            if (i > 1)
                K[(ptrdiff_t)N * j + i - 2] -= g; /* of p_(i-1) */
        }
    }
    for (int32_t i = 1; i <= N; i++)
        start[i - 1] = fmax(0, 1 - fabs((-2 + i * dx) / 2));
    start[N] = 1.6;
    double *flatter = zoo_start(p, 2);
    for (int32_t i = 0; i < N; i++)
        flatter[i] = 0.5 * start[i];
    zoo_bounds(p, N, N + 1, -INFINITY, INFINITY);
    p->scale = 100;
}

/* Friction impulse b of a body that slides on a plane, and its speed s, in the form of Fritz John:
 * limit v + s b = 0, 0 <= s perp limit^2 - |b|^2 >= 0, v = v_free + b / m. data: v_free, limit; m
 * = 2. */
static int32_t friction(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    const double limit = p->data[2];
    for (int32_t i = 0; i < 2; i++) {
        F[i] = limit * (p->data[i] + z[i] / 2) + z[2] * z[i];
        if (J) {
            zoo_add(J, i, i, limit / 2 + z[2]);
            zoo_add(J, i, 2, z[i]);
            zoo_add(J, 2, i, -2 * z[i]);
        }
    }
    F[2] = limit * limit - z[0] * z[0] - z[1] * z[1];
    return 0;
}

static void build_friction(zoo_problem *p, double limit, const double *solution)
{
    zoo_size(p, 3, friction);
    zoo_bounds(p, 0, 2, -INFINITY, INFINITY);
    zoo_set(zoo_data(p, 3), (double[]){3, 4, limit}, 3);
    zoo_start(p, 0);
    zoo_start(p, 1);
    zoo_start(p, -5);
    zoo_set(zoo_solution(p), solution, 3);
    p->scale = 10;
}

static void build_slide(zoo_problem *p, int32_t size)
{
    (void)size;
    build_friction(p, 5, (double[]){-3, -4, 2.5});
}

static void build_stick(zoo_problem *p, int32_t size)
{
    (void)size;
    build_friction(p, 20, (double[]){-6, -8, 0});
}

/* Shallow truss of two bars that snaps through onto a stop: x (1 - x) (2 - x) = 0.2, x <= 1.9. */
static int32_t truss(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    double y = z[0] - 1;
    (void)p;
    F[0] = y * y * y - y - 0.2;
    if (J)
        zoo_add(J, 0, 0, 3 * y * y - 1);
    return 0;
}

static void build_truss(zoo_problem *p, int32_t size)
{
    const double angle = acos(0.3 * sqrt(3)) / 3, radius = 2 / sqrt(3);
    (void)size;
    zoo_size(p, 1, truss);
    zoo_bounds(p, 0, 1, 0, 1.9);
    zoo_start(p, 0);
    zoo_start(p, 0.9);
    zoo_start(p, 1.9);
    zoo_solution(p)[0] = 1 + radius * cos(angle - 2 * pi / 3);
    zoo_solution(p)[0] = 1 + radius * cos(angle + 2 * pi / 3);
    zoo_solution(p)[0] = 1.9;
}

/* Clamped beam over a floor, on a foundation that stiffens: nodal forces (stencil / h^3 + h (20 u^3
 * + 400)), u >= -0.5. */
static int32_t beam(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    static const double stencil[] = {1, -4, 6, -4, 1};
    const double h = 1.0 / (p->n + 1);
    for (int32_t i = 0; i < p->n; i++) {
        F[i] = h * (20 * z[i] * z[i] * z[i] + 400);
        for (int32_t d = -2; d <= 2; d++) {
            /* clamped: the node behind the wall mirrors the one before it */
            int32_t j = i + d == -2 ? 0 : i + d == p->n + 1 ? p->n - 1 : i + d;
            double c = stencil[d + 2] / (h * h * h);
            if (i + d == -1 || i + d == p->n)
                continue;
            if (j < 0 || j >= p->n)
                continue;
            F[i] += c * z[j];
            if (J)
                zoo_add(J, i, j, c + (d == 0 ? 60 * h * z[i] * z[i] : 0));
        }
    }
    return 0;
}

static void build_beam(zoo_problem *p, int32_t size)
{
    zoo_size(p, size, beam);
    p->sparse = 1;
    zoo_bounds(p, 0, size, -0.5, INFINITY);
    zoo_start(p, 0);
    zoo_start(p, -0.5);
    zoo_start(p, 1);
    p->scale = pow(size + 1.0, 3);
}

/* Pendulum brought to rest: per step angle, speed, torque |u| <= 0.5 and the multipliers of the two
 * equations of motion (explicit Euler, ten time units, from angle 1.5). */
static int32_t pendulum(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    const int32_t N = p->n / 5;
    const double dt = 10.0 / N;
    for (int32_t s = 0; s < N; s++) {
        const int32_t i = 5 * s, e = i + 5, b = s ? i - 5 : 0; /* this step, the next, the last */
        const double *y = z + i, *was = z + b, *next = z + e;
        double angle = s ? was[0] : 1.5, speed = s ? was[1] : 0;
        int32_t last = s + 1 == N;
        F[i] = dt * y[0] - y[3] + (last ? 0 : next[3] - dt * cos(y[0]) * next[4]);
        F[i + 1] = 0.1 * dt * y[1] - y[4] + (last ? 0 : dt * next[3] + next[4]);
        F[i + 2] = dt * (0.1 * y[2] + y[4]);
        F[i + 3] = y[0] - angle - dt * speed;
        F[i + 4] = y[1] - speed + dt * sin(angle) - dt * y[2];
        if (!J)
            continue;
        zoo_add(J, i, i, dt + (last ? 0 : dt * sin(y[0]) * next[4]));
        zoo_add(J, i, i + 3, -1);
        zoo_add(J, i + 1, i + 1, 0.1 * dt);
        zoo_add(J, i + 1, i + 4, -1);
        zoo_add(J, i + 2, i + 2, 0.1 * dt);
        zoo_add(J, i + 2, i + 4, dt);
        zoo_add(J, i + 3, i, 1);
        zoo_add(J, i + 4, i + 1, 1);
        zoo_add(J, i + 4, i + 2, -dt);
        if (!last) {
            zoo_add(J, i, e + 3, 1);
            zoo_add(J, i, e + 4, -dt * cos(y[0]));
            zoo_add(J, i + 1, e + 3, dt);
            zoo_add(J, i + 1, e + 4, 1);
        }
        if (s) {
            zoo_add(J, i + 3, b, -1);
            zoo_add(J, i + 3, b + 1, -dt);
            zoo_add(J, i + 4, b, dt * cos(was[0]));
            zoo_add(J, i + 4, b + 1, -1);
        }
    }
    return 0;
}

static void build_pendulum(zoo_problem *p, int32_t size)
{
    zoo_size(p, size / 5 * 5, pendulum);
    p->sparse = 1;
    zoo_bounds(p, 0, p->n, -INFINITY, INFINITY);
    for (int32_t i = 2; i < p->n; i += 5)
        zoo_bounds(p, i, i + 1, -0.5, 0.5);
    zoo_start(p, 0);
    zoo_start(p, 0.1);
}

/* x lies over an obstacle that gives way to it: y = x - m(x) >= 0 perp (A x + q), A = (-1, 2.1,
 * -1), m_i = 0.2 tanh x_(i+1) - 0.5. Unknowns x (free), then y. */
static int32_t implicit(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    const int32_t n = p->n / 2;
    for (int32_t i = 0; i < n; i++) {
        double t = i + 1 < n ? tanh(z[i + 1]) : 0;
        double q = sin(6 * pi * (i + 1) / (n + 1));
        F[i] = z[n + i] - z[i] + 0.2 * t - 0.5;
        F[n + i] = 2.1 * z[i] + q;
        if (i > 0)
            F[n + i] -= z[i - 1];
        if (i + 1 < n)
            F[n + i] -= z[i + 1];
        if (!J)
            continue;
        zoo_add(J, i, n + i, 1);
        zoo_add(J, i, i, -1);
        zoo_add(J, n + i, i, 2.1);
        if (i > 0)
            zoo_add(J, n + i, i - 1, -1);
        if (i + 1 < n) {
            zoo_add(J, i, i + 1, 0.2 * (1 - t * t));
            zoo_add(J, n + i, i + 1, -1);
        }
    }
    return 0;
}

static void build_implicit(zoo_problem *p, int32_t size)
{
    zoo_size(p, size / 2 * 2, implicit);
    p->sparse = 1;
    zoo_bounds(p, 0, p->n / 2, -INFINITY, INFINITY);
    zoo_start(p, 0);
    zoo_start(p, 1);
}

const zoo_entry zoo_mechanics[] = {
    {"ehl-kost", "Kostreva 1984, elastohydrodynamic lubrication, as in MCPLIB", build_lubrication,
     100, 0, ZOO_UNKNOWN, 0},
    {"coulomb-slide", "one sliding body, Stewart & Trinkle's form of friction", build_slide, 0, 0,
     ZOO_ALL, 0},
    {"coulomb-stick", "the same with more friction", build_stick, 0, 0, ZOO_ALL, 0},
    {"truss-stop", "von Mises 1923, snap-through onto a stop", build_truss, 0, 0, ZOO_ALL, 1},
    {"beam-floor", "clamped beam, stiffening foundation, floor", build_beam, 60, 400, ZOO_UNIQUE,
     0},
    {"pendulum-control", "in the manner of opt_cont of MCPLIB: bounded torque", build_pendulum, 200,
     10000, ZOO_UNKNOWN, 0},
    {"implicit-obstacle", "in the manner of Pang 1981: implicit complementarity", build_implicit,
     120, 10000, ZOO_UNKNOWN, 0},
    {NULL, NULL, NULL, 0, 0, 0, 0},
};
