/* Programs with functions that are no polynomials, and systems of equations with bounds. */
#include "problems.h"

/* min sin(x1 + x2) + (x1 - x2)^2 - 1.5 x1 + 2.5 x2 + 1 */
static int32_t hs5(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    double c = cos(z[0] + z[1]), s = sin(z[0] + z[1]), d = 2 * (z[0] - z[1]);
    (void)p;
    F[0] = c + d - 1.5;
    F[1] = c - d + 2.5;
    if (J) {
        zoo_add(J, 0, 0, 2 - s);
        zoo_add(J, 0, 1, -2 - s);
        zoo_add(J, 1, 0, -2 - s);
        zoo_add(J, 1, 1, 2 - s);
    }
    return 0;
}

static void build_hs5(zoo_problem *p, int32_t size)
{
    const double third = 3.14159265358979323846 / 3;
    (void)size;
    zoo_size(p, 2, hs5);
    zoo_bounds(p, 0, 1, -1.5, 4);
    zoo_bounds(p, 1, 2, -3, 3);
    zoo_start(p, 0);
    zoo_start(p, 3);
    zoo_set(zoo_solution(p), (double[]){0.5 - third, -0.5 - third}, 2);
}

/* min 0.2 x3 - 0.8 x1, x2 >= exp x1, x3 >= exp x2 */
static int32_t hs66(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    double e1 = exp(z[0]), e2 = exp(z[1]);
    (void)p;
    F[0] = -0.8 + z[3] * e1;
    F[1] = -z[3] + z[4] * e2;
    F[2] = 0.2 - z[4];
    F[3] = z[1] - e1;
    F[4] = z[2] - e2;
    if (J) {
        zoo_add(J, 0, 0, z[3] * e1);
        zoo_add(J, 0, 3, e1);
        zoo_add(J, 1, 1, z[4] * e2);
        zoo_add(J, 1, 3, -1);
        zoo_add(J, 1, 4, e2);
        zoo_add(J, 2, 4, -1);
        zoo_add(J, 3, 0, -e1);
        zoo_add(J, 3, 1, 1);
        zoo_add(J, 4, 1, -e2);
        zoo_add(J, 4, 2, 1);
    }
    return isfinite(e1) && isfinite(e2) ? 0 : 1;
}

static void build_hs66(zoo_problem *p, int32_t size)
{
    (void)size;
    zoo_size(p, 5, hs66);
    zoo_bounds(p, 0, 2, 0, 100);
    zoo_bounds(p, 2, 3, 0, 10);
    zoo_set(zoo_start(p, 0), (double[]){0, 1.05, 2.9}, 3);
    zoo_start(p, 1);
    zoo_set(zoo_solution(p),
            (double[]){0.1841264879228477, 1.202167873197043, 3.327322322599096, 0.6654644645198191,
                       0.2},
            5);
}

/* min sum (ln(x - 2)^2 + ln(10 - x)^2) - (prod x)^0.2 */
static int32_t hs110(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    double product = 1;
    for (int32_t i = 0; i < p->n; i++) {
        if (!(z[i] > 2 && z[i] < 10))
            return 1;
        product *= z[i];
    }
    double r = 0.2 * pow(product, 0.2);
    for (int32_t i = 0; i < p->n; i++) {
        double a = z[i] - 2, b = 10 - z[i], la = log(a), lb = log(b);
        F[i] = 2 * la / a - 2 * lb / b - r / z[i];
        for (int32_t j = 0; J && j < p->n; j++) {
            double own = 2 * (1 - la) / (a * a) + 2 * (1 - lb) / (b * b) + r / (z[i] * z[i]);
            zoo_add(J, i, j, -0.2 * r / (z[i] * z[j]) + (i == j ? own : 0));
        }
    }
    return 0;
}

/* All entries equal: ln(x-2)/(x-2) - ln(10-x)/(10-x) = x/10, in 40 digits. */
static void build_hs110(zoo_problem *p, int32_t size)
{
    (void)size;
    zoo_size(p, 10, hs110);
    zoo_bounds(p, 0, 10, 2.001, 9.999);
    zoo_start(p, 9);
    zoo_start(p, 8);
    double *solution = zoo_solution(p);
    for (int32_t i = 0; i < 10; i++)
        solution[i] = 9.35026583306938516;
    p->scale = 10;
}

/* Five variables and ten multipliers. */
static int32_t hs86(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    static const double e[] = {-15, -27, -36, -18, -12}, d[] = {4, 8, 10, 6, 2};
    static const double C[5][5] = {{30, -20, -10, 32, -10},
                                   {-20, 39, -6, -31, 32},
                                   {-10, -6, 10, -6, -10},
                                   {32, -31, -6, 39, -20},
                                   {-10, 32, -10, -20, 30}};
    static const double A[10][5] = {{-16, 2, 0, 1, 0},    {0, -2, 0, 0.4, 2},   {-3.5, 0, 2, 0, 0},
                                    {0, -2, 0, -4, -1},   {0, -9, -2, 1, -2.8}, {2, 0, -4, 0, 0},
                                    {-1, -1, -1, -1, -1}, {-1, -2, -3, -2, -1}, {1, 2, 3, 4, 5},
                                    {1, 1, 1, 1, 1}};
    static const double b[] = {-40, -2, -0.25, -4, -4, -1, -40, -60, 5, 1};
    (void)p;
    for (int32_t i = 0; i < 5; i++) {
        F[i] = e[i] + 3 * d[i] * z[i] * z[i];
        for (int32_t j = 0; j < 5; j++) {
            F[i] += 2 * C[i][j] * z[j];
            if (J)
                zoo_add(J, i, j, 2 * C[i][j] + (i == j ? 6 * d[i] * z[i] : 0));
        }
    }
    for (int32_t k = 0; k < 10; k++) {
        F[5 + k] = -b[k];
        for (int32_t j = 0; j < 5; j++) {
            F[5 + k] += A[k][j] * z[j];
            F[j] -= A[k][j] * z[5 + k];
            if (J) {
                zoo_add(J, 5 + k, j, A[k][j]);
                zoo_add(J, j, 5 + k, -A[k][j]);
            }
        }
    }
    return 0;
}

static void build_hs86(zoo_problem *p, int32_t size)
{
    (void)size;
    zoo_size(p, 15, hs86);
    zoo_start(p, 0);
    zoo_set(zoo_start(p, 0), (double[]){0, 0, 0, 0, 1}, 5);
    zoo_start(p, 1);
    zoo_set(zoo_solution(p),
            (double[]){0.3, 0.33346760653460711, 0.4, 0.42831010478169876, 0.22396487356079815, 0,
                       0, 5.1740407276982, 0, 3.0611086877585, 11.839545664801, 0, 0,
                       0.10389619077062, 0},
            15);
    p->scale = 40;
}

/* x^3 - 2x + 2: Newton's method without safeguards goes round in 0, 1, 0, 1, ... */
static int32_t cycle(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    (void)p;
    F[0] = z[0] * z[0] * z[0] - 2 * z[0] + 2;
    if (J)
        zoo_add(J, 0, 0, 3 * z[0] * z[0] - 2);
    return 0;
}

static void build_cycle(zoo_problem *p, int32_t size)
{
    (void)size;
    zoo_size(p, 1, cycle);
    zoo_bounds(p, 0, 1, -INFINITY, INFINITY);
    zoo_start(p, 0);
    zoo_start(p, 1);
    zoo_start(p, -3);
    zoo_solution(p)[0] = -1.7692923542386314; /* -cbrt(1 + sqrt(57)/9) - cbrt(1 - sqrt(57)/9) */
}

/* Powell's singular function as equations: the Jacobian at 0 has rank 2. */
static int32_t powell(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    double a = z[1] - 2 * z[2], b = z[0] - z[3];
    (void)p;
    F[0] = z[0] + 10 * z[1];
    F[1] = sqrt(5) * (z[2] - z[3]);
    F[2] = a * a;
    F[3] = sqrt(10) * b * b;
    if (J) {
        zoo_add(J, 0, 0, 1);
        zoo_add(J, 0, 1, 10);
        zoo_add(J, 1, 2, sqrt(5));
        zoo_add(J, 1, 3, -sqrt(5));
        zoo_add(J, 2, 1, 2 * a);
        zoo_add(J, 2, 2, -4 * a);
        zoo_add(J, 3, 0, 2 * sqrt(10) * b);
        zoo_add(J, 3, 3, -2 * sqrt(10) * b);
    }
    return 0;
}

static void build_powell(zoo_problem *p, int32_t size)
{
    (void)size;
    zoo_size(p, 4, powell);
    zoo_bounds(p, 0, 4, -INFINITY, INFINITY);
    zoo_set(zoo_start(p, 0), (double[]){3, -1, 0, 1}, 4);
    zoo_start(p, 1);
    zoo_solution(p);
}

/* (3 - 2 x_i) x_i - x_i-1 - 2 x_i+1 + 1, with a ceiling over every third variable. */
static int32_t broyden(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    for (int32_t i = 0; i < p->n; i++) {
        F[i] = (3 - 2 * z[i]) * z[i] + 1;
        if (i > 0)
            F[i] -= z[i - 1];
        if (i + 1 < p->n)
            F[i] -= 2 * z[i + 1];
        if (!J)
            continue;
        zoo_add(J, i, i, 3 - 4 * z[i]);
        if (i > 0)
            zoo_add(J, i, i - 1, -1);
        if (i + 1 < p->n)
            zoo_add(J, i, i + 1, -2);
    }
    return 0;
}

static void build_broyden(zoo_problem *p, int32_t size)
{
    zoo_size(p, size, broyden);
    p->sparse = 1;
    for (int32_t i = 0; i < size; i++)
        zoo_bounds(p, i, i + 1, -2, i % 3 == 0 ? -0.75 : 2);
    zoo_start(p, -1);
    zoo_start(p, 0);
}

/* Lower triangle, 1 on and 2 below the diagonal, times its transpose: Fathi's matrix. */
static int32_t fathi(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    for (int32_t i = 0; i < p->n; i++) {
        F[i] = -1;
        for (int32_t j = 0; j < p->n; j++) {
            int32_t low = (i < j ? i : j) + 1;
            double m = i == j ? 4 * low - 3 : 4 * low - 2;
            F[i] += m * z[j];
            if (J)
                zoo_add(J, i, j, m);
        }
    }
    return 0;
}

static void build_fathi(zoo_problem *p, int32_t size)
{
    zoo_size(p, size, fathi);
    zoo_start(p, 0);
    zoo_start(p, 1);
    zoo_solution(p)[0] = 1;
}

/* M z + d arctan z + q, M = tridiagonal (-1, 4, -1) plus a skew part: strongly monotone. q is such
 * that the solution is (1, 0, 2, 0, 1, 0, 2, 0, ...) with slack at the zeros. */
static int32_t arctangents(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    const double *d = p->data, *q = p->data + p->n;
    for (int32_t i = 0; i < p->n; i++) {
        F[i] = 4 * z[i] + d[i] * atan(z[i]) + q[i];
        if (i > 0)
            F[i] -= 1.75 * z[i - 1];
        if (i + 1 < p->n)
            F[i] -= 0.25 * z[i + 1];
        if (!J)
            continue;
        zoo_add(J, i, i, 4 + d[i] / (1 + z[i] * z[i]));
        if (i > 0)
            zoo_add(J, i, i - 1, -1.75);
        if (i + 1 < p->n)
            zoo_add(J, i, i + 1, -0.25);
    }
    return 0;
}

static void build_arctangents(zoo_problem *p, int32_t size)
{
    uint64_t seed = 1993;
    zoo_size(p, size, arctangents);
    double *data = zoo_data(p, 2 * (size_t)size), *solution = zoo_solution(p);
    p->sparse = 1;
    for (int32_t i = 0; i < size; i++) {
        data[i] = 10 * zoo_random(&seed);
        solution[i] = i % 4 == 0 ? 1 : i % 4 == 2 ? 2 : 0;
    }
    zoo_start(p, 0);
    arctangents(p, solution, p->scratch, NULL);
    for (int32_t i = 0; i < size; i++)
        data[size + i] = (i % 2 ? 1 + i % 3 : 0) - p->scratch[i];
    zoo_start(p, 1);
    double *start = zoo_start(p, 0);
    for (int32_t i = 0; i < size; i++)
        start[i] = 20 * zoo_random(&seed);
    p->scale = 10;
}

const zoo_entry zoo_systems[] = {
    {"hs5", "Hock & Schittkowski 5", build_hs5, 0, 0, ZOO_SOME, 0},
    {"hs66", "Hock & Schittkowski 66", build_hs66, 0, 0, ZOO_ALL, 0},
    {"hs86", "Hock & Schittkowski 86 (Colville 1), Colville 2 as its dual", build_hs86, 0, 0,
     ZOO_ALL, 0},
    {"hs110", "Hock & Schittkowski 110 (Himmelblau)", build_hs110, 0, 0, ZOO_SOME, 0},
    {"newton-cycle", "x^3 - 2x + 2 = 0: full steps cycle, descent may be trapped", build_cycle, 0,
     0, ZOO_ALL, 1},
    {"powell-singular", "Powell 1962 as four equations", build_powell, 0, 0, ZOO_SINGULAR, 0},
    {"broyden-bounds", "Broyden 1965, tridiagonal, with bounds of our own", build_broyden, 60,
     10000, ZOO_UNKNOWN, 0},
    {"fathi", "Fathi 1979 (linear), exponential for Lemke's method", build_fathi, 16, 200, ZOO_ALL,
     0},
    {"arctangents", "in the manner of Taji, Fukushima & Ibaraki 1993: M z + d arctan z + q",
     build_arctangents, 60, 10000, ZOO_ALL, 0},
    {NULL, NULL, NULL, 0, 0, 0, 0},
};
