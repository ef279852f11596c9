/* The small problems that every paper on the subject uses. */
#include "problems.h"

/* Rows of a quadratic map of four variables: x1^2, x1 x2, x2^2, x1, x2, x3, x4, constant. */
typedef double quadratic_rows[4][8];

static const quadratic_rows kojima_shindo_rows = {{3, 2, 2, 0, 0, 1, 3, -6},
                                                  {2, 0, 1, 1, 0, 10, 2, -2},
                                                  {3, 1, 2, 0, 0, 2, 9, -9},
                                                  {1, 0, 3, 0, 0, 2, 3, -3}};
static const quadratic_rows josephy_rows = {{3, 2, 2, 0, 0, 1, 3, -6},
                                            {2, 0, 1, 1, 0, 3, 2, -2},
                                            {3, 1, 2, 0, 0, 2, 3, -1},
                                            {1, 0, 3, 0, 0, 2, 3, -3}};

static void quadratic(const quadratic_rows rows, const double *x, double *F, zoo_jacobian *J)
{
    for (int32_t i = 0; i < 4; i++) {
        const double *c = rows[i];
        F[i] = c[0] * x[0] * x[0] + c[1] * x[0] * x[1] + c[2] * x[1] * x[1] + c[3] * x[0] +
               c[4] * x[1] + c[5] * x[2] + c[6] * x[3] + c[7];
        if (!J)
            continue;
        zoo_add(J, i, 0, 2 * c[0] * x[0] + c[1] * x[1] + c[3]);
        zoo_add(J, i, 1, c[1] * x[0] + 2 * c[2] * x[1] + c[4]);
        zoo_add(J, i, 2, c[5]);
        zoo_add(J, i, 3, c[6]);
    }
}

static int32_t kojima_shindo(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    (void)p;
    quadratic(kojima_shindo_rows, z, F, J);
    return 0;
}

static int32_t josephy(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    (void)p;
    quadratic(josephy_rows, z, F, J);
    return 0;
}

/* The eight starts of the AMPL version of MCPLIB. */
static void four_variables(zoo_problem *p, zoo_equations equations)
{
    static const double starts[8][4] = {{0, 0, 0, 0}, {1, 1, 1, 1},     {100, 100, 100, 100},
                                        {1, 0, 1, 0}, {1, 0, 0, 0},     {0, 1, 1, 0},
                                        {0, 1, 0, 1}, {1.25, 0, 0, 0.5}};
    zoo_size(p, 4, equations);
    for (int k = 0; k < 8; k++)
        zoo_set(zoo_start(p, 0), starts[k], 4);
    zoo_set(zoo_solution(p), (double[]){sqrt(6) / 2, 0, 0, 0.5}, 4);
}

static void build_kojima_shindo(zoo_problem *p, int32_t size)
{
    (void)size;
    four_variables(p, kojima_shindo);
    zoo_set(zoo_solution(p), (double[]){1, 0, 3, 0}, 4);
}

static void build_josephy(zoo_problem *p, int32_t size)
{
    (void)size;
    four_variables(p, josephy);
}

static int32_t mathiesen(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    double b = z[1] + 1, c = z[2] + 1, s = 4.5 * z[2] + 2.7 * z[3], t = 0.5 * z[2] + 0.3 * z[3];
    (void)p;
    if (b <= 0 || c <= 0)
        return 1;
    F[0] = -z[1] + z[2] + z[3];
    F[1] = z[0] - s / b;
    F[2] = 5 - z[0] - t / c;
    F[3] = 3 - z[0];
    if (J) {
        zoo_add(J, 0, 1, -1);
        zoo_add(J, 0, 2, 1);
        zoo_add(J, 0, 3, 1);
        zoo_add(J, 1, 0, 1);
        zoo_add(J, 1, 1, s / (b * b));
        zoo_add(J, 1, 2, -4.5 / b);
        zoo_add(J, 1, 3, -2.7 / b);
        zoo_add(J, 2, 0, -1);
        zoo_add(J, 2, 2, t / (c * c) - 0.5 / c);
        zoo_add(J, 2, 3, -0.3 / c);
        zoo_add(J, 3, 0, -1);
    }
    return 0;
}

static void build_mathiesen(zoo_problem *p, int32_t size)
{
    (void)size;
    zoo_size(p, 4, mathiesen);
    zoo_start(p, 0);
    zoo_start(p, 1);
    zoo_start(p, 10);
    zoo_set(zoo_solution(p), (double[]){0, 0, 0, 0}, 4);
    zoo_set(zoo_solution(p), (double[]){1.5, 0, 0, 0}, 4);
    zoo_set(zoo_solution(p), (double[]){3, 0, 0, 0}, 4);
}

/* Activity y and prices p1, p2, p3; endowment (0, 5, 3), demand shares (0.9, 0.1, 0). */
static int32_t walras(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    double income = 5 * z[2] + 3 * z[3];
    (void)p;
    if (z[1] <= 0 || z[2] <= 0)
        return 1;
    F[0] = -z[1] + z[2] + z[3];
    F[1] = z[0] - 0.9 * income / z[1];
    F[2] = 5 - z[0] - 0.1 * income / z[2];
    F[3] = 3 - z[0];
    if (J) {
        zoo_add(J, 0, 1, -1);
        zoo_add(J, 0, 2, 1);
        zoo_add(J, 0, 3, 1);
        zoo_add(J, 1, 0, 1);
        zoo_add(J, 1, 1, 0.9 * income / (z[1] * z[1]));
        zoo_add(J, 1, 2, -4.5 / z[1]);
        zoo_add(J, 1, 3, -2.7 / z[1]);
        zoo_add(J, 2, 0, -1);
        zoo_add(J, 2, 2, -0.5 / z[2] + 0.1 * income / (z[2] * z[2]));
        zoo_add(J, 2, 3, -0.3 / z[2]);
        zoo_add(J, 3, 0, -1);
    }
    return 0;
}

/* Homogeneous of degree 0 in the prices: (3, 6t, t, 5t) for every t. */
static void build_walras(zoo_problem *p, int32_t size)
{
    (void)size;
    zoo_size(p, 4, walras);
    zoo_start(p, 1);
    zoo_set(zoo_start(p, 0), (double[]){0, 6, 2, 1}, 4);
    zoo_set(zoo_solution(p), (double[]){3, 6, 1, 5}, 4);
    zoo_set(zoo_solution(p), (double[]){3, 0.6, 0.1, 0.5}, 4);
}

static int32_t billups(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    (void)p;
    F[0] = (z[0] - 1) * (z[0] - 1) - 1.01;
    if (J)
        zoo_add(J, 0, 0, 2 * (z[0] - 1));
    return 0;
}

static void build_billups(zoo_problem *p, int32_t size)
{
    (void)size;
    zoo_size(p, 1, billups);
    zoo_start(p, 0);
    zoo_start(p, 0.5);
    zoo_start(p, 4);
    zoo_solution(p)[0] = 1 + sqrt(1.01);
}

/* F = gradient of exp sum (x_i - i + 2)^2, i from 1. */
static int32_t watson(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    double sum = 0;
    for (int32_t i = 0; i < p->n; i++)
        sum += (z[i] - i + 1) * (z[i] - i + 1);
    double e = exp(sum);
    for (int32_t i = 0; i < p->n; i++) {
        double d = z[i] - i + 1;
        F[i] = 2 * d * e;
        for (int32_t j = 0; J && j < p->n; j++)
            zoo_add(J, i, j, (i == j ? 2 * e : 0) + 4 * d * (z[j] - j + 1) * e);
    }
    return isfinite(e) ? 0 : 1;
}

static void build_watson(zoo_problem *p, int32_t size)
{
    (void)size;
    zoo_size(p, 5, watson);
    zoo_start(p, 0);
    zoo_start(p, 1);
    zoo_set(zoo_start(p, 0), (double[]){0, 1, 2, 3, 4}, 5);
    zoo_start(p, 3);
    zoo_start(p, 5);
    zoo_start(p, 8);
    zoo_set(zoo_solution(p), (double[]){0, 0, 1, 2, 3}, 5);
    p->scale = 2 * exp(1);
}

/* Data: gamma, then c, beta and the factor of q in the marginal cost for every firm. The stated
 * solutions are from Newton's method in 40 digits. */
static int32_t nash(const zoo_problem *p, const double *q, double *F, zoo_jacobian *J)
{
    const int32_t n = p->n;
    const double gamma = p->data[0], *c = p->data + 1, *beta = c + n, *factor = beta + n;
    double Q = 0;
    for (int32_t i = 0; i < n; i++) {
        if (q[i] < 0)
            return 1;
        Q += q[i];
    }
    if (Q <= 0)
        return 1;
    double price = pow(5000 / Q, 1 / gamma), slope = -price / (gamma * Q);
    for (int32_t i = 0; i < n; i++) {
        double share = q[i] / (gamma * Q), power = 1 / beta[i];
        F[i] = c[i] + pow(factor[i] * q[i], power) - price * (1 - share);
        for (int32_t j = 0; J && j < n; j++) {
            double own = factor[i] * power * pow(factor[i] * q[i], power - 1) + price / (gamma * Q);
            zoo_add(J, i, j, slope * (share - 1) - price * share / Q + (i == j ? own : 0));
        }
    }
    return 0;
}

static void build_nash(zoo_problem *p, int32_t n, double gamma, const double *c, const double *beta,
                       double factor, const double *solution)
{
    zoo_size(p, n, nash);
    double *data = zoo_data(p, 1 + 3 * (size_t)n);
    data[0] = gamma;
    zoo_set(data + 1, c, n);
    zoo_set(data + 1 + n, beta, n);
    for (int32_t i = 0; i < n; i++)
        data[1 + 2 * n + i] = factor;
    zoo_start(p, 1);
    zoo_start(p, 10);
    double *start = zoo_start(p, 0);
    for (int32_t i = 0; i < n; i++)
        start[i] = 1 + i;
    zoo_set(zoo_solution(p), solution, n);
    p->scale = 10;
}

static void build_nash_5(zoo_problem *p, int32_t size)
{
    static const double c[] = {10, 8, 6, 4, 2}, beta[] = {1.2, 1.1, 1, 0.9, 0.8};
    static const double solution[] = {36.93251081573577, 41.81814166043763, 43.70657852227421,
                                      42.65923974330512, 39.17895251662502};
    (void)size;
    build_nash(p, 5, 1.1, c, beta, 0.2, solution);
}

static void build_nash_10(zoo_problem *p, int32_t size)
{
    static const double c[] = {5, 3, 8, 5, 1, 3, 7, 4, 6, 3};
    static const double beta[] = {1.2, 1, 0.9, 0.6, 1.5, 1, 0.7, 1.1, 0.95, 0.75};
    static const double solution[] = {7.441546697058734,  4.09781044734732,  2.590643747438953,
                                      0.9353857680722275, 17.9489523420066,  4.09781044734732,
                                      1.304725757680007,  5.590082543557629, 3.222179453824615,
                                      1.677094316839327};
    (void)size;
    build_nash(p, 10, 1.2, c, beta, 10, solution);
}

/* Three paths and the cost of the cheapest. */
static int32_t braess(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    static const double M[4][4] = {
        {11, 0, 10, -1}, {0, 11, 10, -1}, {10, 10, 21, -1}, {1, 1, 1, 0}};
    static const double q[] = {50, 50, 10, -6};
    (void)p;
    for (int32_t i = 0; i < 4; i++) {
        F[i] = q[i];
        for (int32_t j = 0; j < 4; j++) {
            F[i] += M[i][j] * z[j];
            if (J)
                zoo_add(J, i, j, M[i][j]);
        }
    }
    return 0;
}

static void build_braess(zoo_problem *p, int32_t size)
{
    (void)size;
    zoo_size(p, 4, braess);
    zoo_start(p, 0);
    zoo_start(p, 1);
    zoo_set(zoo_start(p, 0), (double[]){3, 3, 0, 83}, 4);
    zoo_set(zoo_solution(p), (double[]){2, 2, 2, 92}, 4);
    p->scale = 92;
}

static int32_t munson(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    (void)p;
    F[0] = z[0] + 2 * z[1] + 3 * z[2] - 1;
    F[1] = z[1] - z[2] + 1;
    F[2] = z[0] + z[1] + 1;
    if (J) {
        zoo_add(J, 0, 0, 1);
        zoo_add(J, 0, 1, 2);
        zoo_add(J, 0, 2, 3);
        zoo_add(J, 1, 1, 1);
        zoo_add(J, 1, 2, -1);
        zoo_add(J, 2, 0, 1);
        zoo_add(J, 2, 1, 1);
    }
    return 0;
}

/* F3 >= 1, so z3 = 0; then F2 >= 1, so z2 = 0; then z1 = 1. */
static void build_munson(zoo_problem *p, int32_t size)
{
    (void)size;
    zoo_size(p, 3, munson);
    zoo_start(p, 0);
    zoo_start(p, 5);
    zoo_set(zoo_solution(p), (double[]){1, 0, 0}, 3);
}

const zoo_entry zoo_classic[] = {
    {"kojima-shindo", "Kojima & Shindo 1986, as kojshin of MCPLIB", build_kojima_shindo, 0, 0,
     ZOO_ALL, 0},
    {"josephy", "Josephy 1979, MCPLIB", build_josephy, 0, 0, ZOO_ALL, 0},
    {"mathiesen", "Mathiesen 1987 as Pang & Gabriel 1993 state it", build_mathiesen, 0, 0,
     ZOO_FAMILY, 0},
    {"mathiesen-walras", "Mathiesen 1987, Walrasian equilibrium without a numeraire", build_walras,
     0, 0, ZOO_FAMILY, 0},
    {"billups", "Billups 1995: the merit function has a minimum that is no solution", build_billups,
     0, 0, ZOO_ALL, 1},
    {"watson-4", "Watson 1979, problem 4", build_watson, 0, 0, ZOO_ALL, 0},
    {"nash-5", "Murphy, Sherali & Soyster 1982; marginal cost c + (q/5)^(1/beta)", build_nash_5, 0,
     0, ZOO_ALL, 0},
    {"nash-10", "Harker 1988; marginal cost c + (10 q)^(1/beta), as MCPLIB has it", build_nash_10,
     0, 0, ZOO_ALL, 0},
    {"braess", "Braess 1968, six travellers, paths", build_braess, 0, 0, ZOO_ALL, 0},
    {"munson-1", "Munson, in the AMPL versions of MCPLIB (linear)", build_munson, 0, 0, ZOO_ALL, 0},
    {NULL, NULL, NULL, 0, 0, 0, 0},
};
