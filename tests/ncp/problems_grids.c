/* Free boundaries on a grid: membranes, torsion, bearings, combustion, options. Sizes are n = k^2
 * and go down to the next square. */
#include "problems.h"

static const double pi = 3.14159265358979323846;

/* The grid's side from a number of unknowns. */
static int32_t side(int32_t size)
{
    return (int32_t)floor(sqrt((double)size) + 1e-9);
}

/* 4 u - neighbours - data[0] e^u - data[1 + i]: Laplace's operator times -h^2. */
static int32_t laplace(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    const int32_t k = p->size;
    for (int32_t b = 0, i = 0; b < k; b++) {
        for (int32_t a = 0; a < k; a++, i++) {
            double source = p->data[0] * exp(z[i]);
            const int32_t inside[4] = {a > 0, a + 1 < k, b > 0, b + 1 < k};
            const int32_t next[4] = {i - 1, i + 1, i - k, i + k};
            F[i] = 4 * z[i] - source - p->data[1 + i];
            for (int d = 0; d < 4; d++)
                if (inside[d])
                    F[i] -= z[next[d]];
            if (!J)
                continue;
            zoo_add(J, i, i, 4 - source);
            for (int d = 0; d < 4; d++)
                if (inside[d])
                    zoo_add(J, i, next[d], -1);
        }
    }
    return 0;
}

/* Zero on the rim of the unit square, constant load, source strength lambda. */
static double membrane(zoo_problem *p, int32_t size, double load, double lambda)
{
    int32_t k = side(size);
    double h = 1.0 / (k + 1);
    zoo_size(p, k * k, laplace);
    p->size = k;
    p->sparse = 1;
    double *data = zoo_data(p, 1 + (size_t)(k * k));
    data[0] = lambda * h * h;
    for (int32_t i = 0; i < k * k; i++)
        data[1 + i] = load * h * h;
    return h;
}

/* -Laplace u = 5, |u| <= distance to the rim. */
static void build_torsion(zoo_problem *p, int32_t size)
{
    double h = membrane(p, size, 5, 0);
    int32_t k = p->size;
    for (int32_t i = 0; i < p->n; i++) {
        double x = h * (1 + i % k), y = h * (1 + i / k);
        double distance = fmin(fmin(x, 1 - x), fmin(y, 1 - y));
        zoo_bounds(p, i, i + 1, -distance, distance);
    }
    zoo_start(p, 0);
    zoo_set(zoo_start(p, 0), p->upper, p->n);
    zoo_set(zoo_start(p, 0), p->lower, p->n);
}

/* Obstacles below and above, as the AMPL version of MCPLIB's obstacle has them. */
static void build_obstacles(zoo_problem *p, int32_t size)
{
    double h = membrane(p, size, 1, 0);
    int32_t k = p->size;
    for (int32_t i = 0; i < p->n; i++) {
        double s = sin(9.2 * h * (1 + i / k)) * sin(9.3 * h * (1 + i % k));
        zoo_bounds(p, i, i + 1, s * s * s, s * s + 0.2);
    }
    double *start = zoo_start(p, 0);
    for (int32_t i = 0; i < p->n; i++)
        start[i] = fmax(0, p->lower[i]);
    zoo_start(p, 0);
    zoo_start(p, 1);
}

/* The membrane over the hemisphere on (-2, 2)^2, with the exact membrane on the rim. */
static double hemisphere_height(double x, double y)
{
    const double a = 0.69796514822337357, r = hypot(x, y); /* a^2 (1 - ln(a/2)) = 1 */
    return r <= a ? sqrt(1 - r * r) : -a * a / sqrt(1 - a * a) * log(r / 2);
}

static void build_hemisphere(zoo_problem *p, int32_t size)
{
    double h = 4 * membrane(p, size, 0, 0);
    int32_t k = p->size;
    for (int32_t i = 0; i < p->n; i++) {
        int32_t a = i % k, b = i / k;
        double x = -2 + h * (a + 1), y = -2 + h * (b + 1), r2 = x * x + y * y;
        zoo_bounds(p, i, i + 1, r2 < 1 ? sqrt(1 - r2) : -INFINITY, INFINITY);
        if (a == 0 || a + 1 == k)
            p->data[1 + i] += hemisphere_height(2, y);
        if (b == 0 || b + 1 == k)
            p->data[1 + i] += hemisphere_height(x, 2);
    }
    zoo_start(p, 0);
    zoo_start(p, 1);
}

/* -Laplace u = 6 e^u, u <= 0.5: without the ceiling u would reach 0.8. */
static void build_bratu_ceiling(zoo_problem *p, int32_t size)
{
    membrane(p, size, 0, 6);
    zoo_bounds(p, 0, p->n, 0, 0.5);
    zoo_start(p, 0);
    zoo_start(p, 0.5);
}

/* -u'' = 2 e^u on (0, 1): two solutions, the lower has u(1/2) = 0.32895242134111357. */
static int32_t bratu(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    double h = 1.0 / (p->n + 1);
    for (int32_t i = 0; i < p->n; i++) {
        double source = 2 * h * h * exp(z[i]);
        F[i] = 2 * z[i] - source;
        if (i > 0)
            F[i] -= z[i - 1];
        if (i + 1 < p->n)
            F[i] -= z[i + 1];
        if (!J)
            continue;
        zoo_add(J, i, i, 2 - source);
        if (i > 0)
            zoo_add(J, i, i - 1, -1);
        if (i + 1 < p->n)
            zoo_add(J, i, i + 1, -1);
    }
    return 0;
}

static void build_bratu(zoo_problem *p, int32_t size)
{
    zoo_size(p, size, bratu);
    p->sparse = 1;
    zoo_start(p, 0);
    zoo_start(p, 0.2);
    zoo_start(p, 1);
}

/* u'' = 2 off contact, u(+-1) = 1/4: u = (|x| - 1/2)_+^2 solves the differences exactly. */
static int32_t string_equations(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    double h = 2.0 / (p->n + 1);
    for (int32_t i = 0; i < p->n; i++) {
        F[i] = 2 * z[i] + 2 * h * h;
        F[i] -= i > 0 ? z[i - 1] : 0.25;
        F[i] -= i + 1 < p->n ? z[i + 1] : 0.25;
        if (!J)
            continue;
        zoo_add(J, i, i, 2);
        if (i > 0)
            zoo_add(J, i, i - 1, -1);
        if (i + 1 < p->n)
            zoo_add(J, i, i + 1, -1);
    }
    return 0;
}

static void build_string(zoo_problem *p, int32_t size)
{
    int32_t n = (size + 1) / 4 * 4 - 1; /* so that +-1/2 are nodes */
    zoo_size(p, n, string_equations);
    p->sparse = 1;
    zoo_start(p, 0);
    zoo_start(p, 1);
    double *solution = zoo_solution(p);
    for (int32_t i = 0; i < n; i++) {
        double away = fmax(fabs(2.0 * (i + 1) / (n + 1) - 1) - 0.5, 0);
        solution[i] = away * away;
    }
}

/* Reynolds' equation in (0, 2 pi) x (0, 20): -div((1 + e cos x)^3 exp(-alpha p) grad p) = e sin x,
 * fluxes through the middle of the faces. data: alpha. */
static void flux(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J, int32_t i,
                 int32_t j, double weight)
{
    double alpha = p->data[0], other = j < 0 ? 0 : z[j], d = z[i] - other;
    double c = weight * exp(-0.5 * alpha * (z[i] + other));
    F[i] += c * d;
    if (J) {
        zoo_add(J, i, i, c * (1 - 0.5 * alpha * d));
        if (j >= 0)
            zoo_add(J, i, j, -c * (1 + 0.5 * alpha * d));
    }
}

static int32_t bearing(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    const int32_t k = p->size;
    const double e = 0.1, hx = 2 * pi / (k + 1), hy = 20.0 / (k + 1), x_over_y = hx / hy;
    for (int32_t i = 0; i < p->n; i++) {
        int32_t a = i % k, b = i / k;
        double x = hx * (a + 1), here = pow(1 + e * cos(x), 3) * x_over_y;
        F[i] = -hx * hy * e * sin(x);
        flux(p, z, F, J, i, a > 0 ? i - 1 : -1, pow(1 + e * cos(x - hx / 2), 3) / x_over_y);
        flux(p, z, F, J, i, a + 1 < k ? i + 1 : -1, pow(1 + e * cos(x + hx / 2), 3) / x_over_y);
        flux(p, z, F, J, i, b > 0 ? i - k : -1, here);
        flux(p, z, F, J, i, b + 1 < k ? i + k : -1, here);
    }
    return 0;
}

static void build_bearing_any(zoo_problem *p, int32_t size, double alpha)
{
    int32_t k = side(size);
    zoo_size(p, k * k, bearing);
    p->size = k;
    p->sparse = 1;
    zoo_data(p, 1)[0] = alpha;
    zoo_start(p, 0);
    zoo_start(p, 0.1);
    double *start = zoo_start(p, 0);
    for (int32_t i = 0; i < p->n; i++)
        start[i] = fmax(sin(2 * pi * (i % k + 1) / (k + 1)), 0);
}

static void build_bearing(zoo_problem *p, int32_t size)
{
    build_bearing_any(p, size, 0);
}

static void build_bearing_barus(zoo_problem *p, int32_t size)
{
    build_bearing_any(p, size, 3);
}

/* American put, strike 1, one year, r = 0.1, all times at once (implicit Euler); the variance grows
 * with the curvature G: sigma^2 = 0.16 (1 + 0.3 tanh G). S = 0 pays 1, S = 3 nothing. */
static int32_t put(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    const int32_t k = p->size;
    const double h = 3.0 / (k + 1), dt = 1.0 / k, r = 0.1;
    for (int32_t i = 0; i < p->n; i++) {
        int32_t a = i % k, early = i < k;
        double s = h * (a + 1), left = a > 0 ? z[i - 1] : 1, right = a + 1 < k ? z[i + 1] : 0;
        double before = early ? fmax(1 - s, 0) : z[i - k];
        double G = (left - 2 * z[i] + right) / (h * h), t = tanh(G), c = 0.08 * s * s * dt;
        double slope = c * (1 + 0.3 * t + 0.3 * G * (1 - t * t)) / (h * h), drift = r * s * dt / h;
        F[i] = z[i] * (1 + r * dt) - before - c * G * (1 + 0.3 * t) - 0.5 * drift * (right - left);
        if (!J)
            continue;
        zoo_add(J, i, i, 1 + r * dt + 2 * slope);
        if (a > 0)
            zoo_add(J, i, i - 1, -slope + 0.5 * drift);
        if (a + 1 < k)
            zoo_add(J, i, i + 1, -slope - 0.5 * drift);
        if (!early)
            zoo_add(J, i, i - k, -1);
    }
    return 0;
}

static void build_put(zoo_problem *p, int32_t size)
{
    int32_t k = side(size);
    zoo_size(p, k * k, put);
    p->size = k;
    p->sparse = 1;
    for (int32_t i = 0; i < p->n; i++)
        zoo_bounds(p, i, i + 1, fmax(1 - 3.0 / (k + 1) * (i % k + 1), 0), INFINITY);
    zoo_start(p, 1);
    zoo_set(zoo_start(p, 0), p->lower, p->n);
}

const zoo_entry zoo_grids[] = {
    {"obstacle-1d", "u = (|x| - 1/2)_+^2 (linear)", build_string, 63, 1023, ZOO_ALL, 0},
    {"obstacle-2d", "membrane over a hemisphere (linear)", build_hemisphere, 225, 9801, ZOO_UNIQUE,
     0},
    {"obstacle-mcplib", "Ciarlet 1978, as obstacle of MCPLIB (linear, both bounds)",
     build_obstacles, 225, 9801, ZOO_UNIQUE, 0},
    {"torsion", "elastic-plastic torsion, MINPACK-2 (Averick et al. 1992), c = 5 (linear)",
     build_torsion, 225, 9801, ZOO_UNIQUE, 0},
    {"bearing", "journal bearing, MINPACK-2, e = 0.1, b = 10 (linear)", build_bearing, 225, 9801,
     ZOO_UNIQUE, 0},
    {"bearing-barus", "the same with viscosity exp(3 p)", build_bearing_barus, 225, 9801,
     ZOO_UNKNOWN, 0},
    {"bratu-1d", "Bratu 1914, lambda = 2", build_bratu, 63, 10000, ZOO_UNKNOWN, 0},
    {"bratu-ceiling", "in the manner of bratu of MCPLIB: 2-D, lambda = 6, 0 <= u <= 0.5",
     build_bratu_ceiling, 225, 9801, ZOO_UNKNOWN, 0},
    {"american-put", "put with curvature-dependent volatility, in space and time", build_put, 225,
     9801, ZOO_UNKNOWN, 0},
    {NULL, NULL, NULL, 0, 0, 0, 0},
};
