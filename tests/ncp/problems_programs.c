/* Karush-Kuhn-Tucker systems of programs with polynomials: Hock & Schittkowski 1981.
 *
 * Function 0 is minimised, the others are >= 0 (or = 0). With multipliers y >= 0 (or free):
 * x perp grad f_0 - sum y_k grad f_k, y_k perp f_k. Solutions: closed forms, or Newton's method in
 * 40 digits on the active set of a general solver; the optimal values agree with the published
 * ones. */
#include "problems.h"

/* coefficient (x_v - shift)^power x_a x_b x_c; variables from 1, 0 for none. */
typedef struct term {
    int32_t function;
    double coefficient;
    int32_t v, power;
    double shift;
    int32_t other[3];
} term;

typedef struct program {
    int32_t variables, functions, equalities; /* the last `equalities` functions are = 0 */
    const term *terms;                        /* ended by a coefficient of zero */
} program;

static const term hs2_terms[] = {{0, 100, 2, 2, 0, {0}},
                                 {0, -200, 1, 2, 0, {2}},
                                 {0, 100, 1, 4, 0, {0}},
                                 {0, 1, 1, 2, 1, {0}},
                                 {0, 0, 0, 0, 0, {0}}};
static const term hs4_terms[] = {
    {0, 1.0 / 3, 1, 3, -1, {0}}, {0, 1, 2, 1, 0, {0}}, {0, 0, 0, 0, 0, {0}}};
static const term hs35_terms[] = {
    {0, -8, 1, 1, 0, {0}}, {0, -6, 2, 1, 0, {0}}, {0, -4, 3, 1, 0, {0}}, {0, 2, 1, 2, 0, {0}},
    {0, 2, 2, 2, 0, {0}},  {0, 1, 3, 2, 0, {0}},  {0, 2, 1, 1, 0, {2}},  {0, 2, 1, 1, 0, {3}},
    {1, 3, 0, 0, 0, {0}},  {1, -1, 1, 1, 0, {0}}, {1, -1, 2, 1, 0, {0}}, {1, -2, 3, 1, 0, {0}},
    {0, 0, 0, 0, 0, {0}}};
static const term hs38_terms[] = {
    {0, 100, 2, 2, 0, {0}},   {0, -200, 1, 2, 0, {2}}, {0, 100, 1, 4, 0, {0}},
    {0, 1, 1, 2, 1, {0}},     {0, 90, 4, 2, 0, {0}},   {0, -180, 3, 2, 0, {4}},
    {0, 90, 3, 4, 0, {0}},    {0, 1, 3, 2, 1, {0}},    {0, 10.1, 2, 2, 1, {0}},
    {0, 10.1, 4, 2, 1, {0}},  {0, 19.8, 2, 1, 0, {4}}, {0, -19.8, 2, 1, 0, {0}},
    {0, -19.8, 4, 1, 0, {0}}, {0, 0, 0, 0, 0, {0}}};
static const term hs43_terms[] = {
    {0, 1, 1, 2, 0, {0}},  {0, 1, 2, 2, 0, {0}},  {0, 2, 3, 2, 0, {0}},   {0, 1, 4, 2, 0, {0}},
    {0, -5, 1, 1, 0, {0}}, {0, -5, 2, 1, 0, {0}}, {0, -21, 3, 1, 0, {0}}, {0, 7, 4, 1, 0, {0}},
    {1, 8, 0, 0, 0, {0}},  {1, -1, 1, 2, 0, {0}}, {1, -1, 2, 2, 0, {0}},  {1, -1, 3, 2, 0, {0}},
    {1, -1, 4, 2, 0, {0}}, {1, -1, 1, 1, 0, {0}}, {1, 1, 2, 1, 0, {0}},   {1, -1, 3, 1, 0, {0}},
    {1, 1, 4, 1, 0, {0}},  {2, 10, 0, 0, 0, {0}}, {2, -1, 1, 2, 0, {0}},  {2, -2, 2, 2, 0, {0}},
    {2, -1, 3, 2, 0, {0}}, {2, -2, 4, 2, 0, {0}}, {2, 1, 1, 1, 0, {0}},   {2, 1, 4, 1, 0, {0}},
    {3, 5, 0, 0, 0, {0}},  {3, -2, 1, 2, 0, {0}}, {3, -1, 2, 2, 0, {0}},  {3, -1, 3, 2, 0, {0}},
    {3, -2, 1, 1, 0, {0}}, {3, 1, 2, 1, 0, {0}},  {3, 1, 4, 1, 0, {0}},   {0, 0, 0, 0, 0, {0}}};
static const term hs71_terms[] = {
    {0, 1, 1, 2, 0, {4}},   {0, 1, 1, 1, 0, {2, 4}}, {0, 1, 1, 1, 0, {3, 4}},
    {0, 1, 3, 1, 0, {0}},   {1, -25, 0, 0, 0, {0}},  {1, 1, 1, 1, 0, {2, 3, 4}},
    {2, -40, 0, 0, 0, {0}}, {2, 1, 1, 2, 0, {0}},    {2, 1, 2, 2, 0, {0}},
    {2, 1, 3, 2, 0, {0}},   {2, 1, 4, 2, 0, {0}},    {0, 0, 0, 0, 0, {0}}};
static const term hs76_terms[] = {
    {0, 1, 1, 2, 0, {0}},    {0, 0.5, 2, 2, 0, {0}}, {0, 1, 3, 2, 0, {0}},  {0, 0.5, 4, 2, 0, {0}},
    {0, -1, 1, 1, 0, {3}},   {0, 1, 3, 1, 0, {4}},   {0, -1, 1, 1, 0, {0}}, {0, -3, 2, 1, 0, {0}},
    {0, 1, 3, 1, 0, {0}},    {0, -1, 4, 1, 0, {0}},  {1, 5, 0, 0, 0, {0}},  {1, -1, 1, 1, 0, {0}},
    {1, -2, 2, 1, 0, {0}},   {1, -1, 3, 1, 0, {0}},  {1, -1, 4, 1, 0, {0}}, {2, 4, 0, 0, 0, {0}},
    {2, -3, 1, 1, 0, {0}},   {2, -1, 2, 1, 0, {0}},  {2, -2, 3, 1, 0, {0}}, {2, 1, 4, 1, 0, {0}},
    {3, -1.5, 0, 0, 0, {0}}, {3, 1, 2, 1, 0, {0}},   {3, 4, 3, 1, 0, {0}},  {0, 0, 0, 0, 0, {0}}};
static const term hs100_terms[] = {
    {0, 1, 1, 2, 10, {0}},  {0, 5, 2, 2, 12, {0}}, {0, 1, 3, 4, 0, {0}},   {0, 3, 4, 2, 11, {0}},
    {0, 10, 5, 6, 0, {0}},  {0, 7, 6, 2, 0, {0}},  {0, 1, 7, 4, 0, {0}},   {0, -4, 6, 1, 0, {7}},
    {0, -10, 6, 1, 0, {0}}, {0, -8, 7, 1, 0, {0}}, {1, 127, 0, 0, 0, {0}}, {1, -2, 1, 2, 0, {0}},
    {1, -3, 2, 4, 0, {0}},  {1, -1, 3, 1, 0, {0}}, {1, -4, 4, 2, 0, {0}},  {1, -5, 5, 1, 0, {0}},
    {2, 282, 0, 0, 0, {0}}, {2, -7, 1, 1, 0, {0}}, {2, -3, 2, 1, 0, {0}},  {2, -10, 3, 2, 0, {0}},
    {2, -1, 4, 1, 0, {0}},  {2, 1, 5, 1, 0, {0}},  {3, 196, 0, 0, 0, {0}}, {3, -23, 1, 1, 0, {0}},
    {3, -1, 2, 2, 0, {0}},  {3, -6, 6, 2, 0, {0}}, {3, 8, 7, 1, 0, {0}},   {4, -4, 1, 2, 0, {0}},
    {4, -1, 2, 2, 0, {0}},  {4, 3, 1, 1, 0, {2}},  {4, -2, 3, 2, 0, {0}},  {4, -5, 6, 1, 0, {0}},
    {4, 11, 7, 1, 0, {0}},  {0, 0, 0, 0, 0, {0}}};
static const term hs113_terms[] = {
    {0, 1, 1, 2, 0, {0}},   {0, 1, 2, 2, 0, {0}},   {0, 1, 1, 1, 0, {2}},    {0, -14, 1, 1, 0, {0}},
    {0, -16, 2, 1, 0, {0}}, {0, 1, 3, 2, 10, {0}},  {0, 4, 4, 2, 5, {0}},    {0, 1, 5, 2, 3, {0}},
    {0, 2, 6, 2, 1, {0}},   {0, 5, 7, 2, 0, {0}},   {0, 7, 8, 2, 11, {0}},   {0, 2, 9, 2, 10, {0}},
    {0, 1, 10, 2, 7, {0}},  {1, 105, 0, 0, 0, {0}}, {1, -4, 1, 1, 0, {0}},   {1, -5, 2, 1, 0, {0}},
    {1, 3, 7, 1, 0, {0}},   {1, -9, 8, 1, 0, {0}},  {2, -10, 1, 1, 0, {0}},  {2, 8, 2, 1, 0, {0}},
    {2, 17, 7, 1, 0, {0}},  {2, -2, 8, 1, 0, {0}},  {3, 12, 0, 0, 0, {0}},   {3, 8, 1, 1, 0, {0}},
    {3, -2, 2, 1, 0, {0}},  {3, -5, 9, 1, 0, {0}},  {3, 2, 10, 1, 0, {0}},   {4, 120, 0, 0, 0, {0}},
    {4, -3, 1, 2, 2, {0}},  {4, -4, 2, 2, 3, {0}},  {4, -2, 3, 2, 0, {0}},   {4, 7, 4, 1, 0, {0}},
    {5, 40, 0, 0, 0, {0}},  {5, -5, 1, 2, 0, {0}},  {5, -8, 2, 1, 0, {0}},   {5, -1, 3, 2, 6, {0}},
    {5, 2, 4, 1, 0, {0}},   {6, 30, 0, 0, 0, {0}},  {6, -0.5, 1, 2, 8, {0}}, {6, -2, 2, 2, 4, {0}},
    {6, -3, 5, 2, 0, {0}},  {6, 1, 6, 1, 0, {0}},   {7, -1, 1, 2, 0, {0}},   {7, -2, 2, 2, 2, {0}},
    {7, 2, 1, 1, 0, {2}},   {7, -14, 5, 1, 0, {0}}, {7, 6, 6, 1, 0, {0}},    {8, 3, 1, 1, 0, {0}},
    {8, -6, 2, 1, 0, {0}},  {8, -12, 9, 2, 8, {0}}, {8, 7, 10, 1, 0, {0}},   {0, 0, 0, 0, 0, {0}}};

enum { HS2, HS4, HS35, HS38, HS43, HS71, HS76, HS100, HS113 };

static const program programs[] = {
    [HS2] = {2, 0, 0, hs2_terms},     [HS4] = {2, 0, 0, hs4_terms},
    [HS35] = {3, 1, 0, hs35_terms},   [HS38] = {4, 0, 0, hs38_terms},
    [HS43] = {4, 3, 0, hs43_terms},   [HS71] = {4, 2, 1, hs71_terms},
    [HS76] = {4, 3, 0, hs76_terms},   [HS100] = {7, 4, 0, hs100_terms},
    [HS113] = {10, 8, 0, hs113_terms}};

/* Derivative of order 0, 1 or 2 in the variables a and b (0: none). */
static double derive(const term *t, const double *x, int32_t a, int32_t b)
{
    double value = t->coefficient;
    int32_t order = (a && a == t->v) + (b && b == t->v), power = t->power, taken_a = a == t->v,
            taken_b = b == t->v;
    if (t->v) {
        for (int32_t k = 0; k < order; k++)
            value *= power--;
        if (power < 0)
            return 0;
        for (int32_t k = 0; k < power; k++)
            value *= x[t->v - 1] - t->shift;
    }
    for (int k = 0; k < 3 && t->other[k]; k++) {
        if (a == t->other[k])
            taken_a = 1;
        else if (b == t->other[k])
            taken_b = 1;
        else
            value *= x[t->other[k] - 1];
    }
    return (a && !taken_a) || (b && !taken_b) ? 0 : value;
}

static void add_term(const program *P, const term *t, const double *z, double *F, zoo_jacobian *J)
{
    const int32_t n = P->variables, row = n + t->function - 1;
    const double sign = t->function ? -z[row] : 1;
    const int32_t variables[4] = {t->v, t->other[0], t->other[1], t->other[2]};
    if (t->function)
        F[row] += derive(t, z, 0, 0);
    for (int a = 0; a < 4; a++) {
        int32_t i = variables[a];
        if (i == 0)
            continue;
        double slope = derive(t, z, i, 0);
        F[i - 1] += sign * slope;
        if (J && t->function) {
            zoo_add(J, i - 1, row, -slope);
            zoo_add(J, row, i - 1, slope);
        }
        for (int b = 0; J && b < 4; b++) {
            if (variables[b])
                zoo_add(J, i - 1, variables[b] - 1, sign * derive(t, z, i, variables[b]));
        }
    }
}

static int32_t polynomial(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    const program *P = &programs[p->size];
    for (int32_t i = 0; i < p->n; i++)
        F[i] = 0;
    for (const term *t = P->terms; t->coefficient != 0; t++)
        add_term(P, t, z, F, J);
    return 0;
}

static void polynomial_problem(zoo_problem *p, int32_t index, const double *start,
                               const double *solution)
{
    const program *P = &programs[index];
    zoo_size(p, P->variables + P->functions, polynomial);
    p->size = index;
    zoo_bounds(p, 0, P->variables, -INFINITY, INFINITY);
    zoo_bounds(p, p->n - P->equalities, p->n, -INFINITY, INFINITY);
    zoo_set(zoo_start(p, 0), start, P->variables);
    double *ones = zoo_start(p, 0);
    for (int32_t i = 0; i < p->n; i++)
        ones[i] = i < P->variables ? start[i] : 1;
    zoo_set(zoo_solution(p), solution, p->n);
}

static void build_hs2(zoo_problem *p, int32_t size)
{
    (void)size;
    polynomial_problem(p, HS2, (double[]){-2, 1.5}, (double[]){1.224370748736353, 1.5});
    zoo_set(zoo_solution(p), (double[]){-1.221026242107102, 1.5}, 2);
    p->lower[1] = 1.5;
    p->scale = 100;
}

static void build_hs4(zoo_problem *p, int32_t size)
{
    (void)size;
    polynomial_problem(p, HS4, (double[]){1.125, 0.125}, (double[]){1, 0});
    zoo_start(p, 10);
    p->lower[0] = 1;
    p->lower[1] = 0;
}

static void build_hs35(zoo_problem *p, int32_t size)
{
    (void)size;
    polynomial_problem(p, HS35, (double[]){0.5, 0.5, 0.5},
                       (double[]){4.0 / 3, 7.0 / 9, 4.0 / 9, 2.0 / 9});
    zoo_bounds(p, 0, 3, 0, INFINITY);
}

static void build_hs38(zoo_problem *p, int32_t size)
{
    (void)size;
    polynomial_problem(p, HS38, (double[]){-3, -1, -3, -1}, (double[]){1, 1, 1, 1});
    zoo_start(p, 0);
    zoo_bounds(p, 0, 4, -10, 10);
    p->scale = 100;
}

static void build_hs43(zoo_problem *p, int32_t size)
{
    (void)size;
    polynomial_problem(p, HS43, (double[]){0, 0, 0, 0}, (double[]){0, 1, 2, -1, 1, 0, 2});
    zoo_start(p, 10);
    p->scale = 10;
}

static void build_hs71(zoo_problem *p, int32_t size)
{
    (void)size;
    polynomial_problem(p, HS71, (double[]){1, 5, 5, 1},
                       (double[]){1, 4.742999637264417, 3.821149984184874, 1.379408293172672,
                                  0.5522936601207268, -0.1614685667705058});
    zoo_bounds(p, 0, 4, 1, 5);
    p->scale = 40;
}

static void build_hs76(zoo_problem *p, int32_t size)
{
    (void)size;
    polynomial_problem(p, HS76, (double[]){0.5, 0.5, 0.5, 0.5},
                       (double[]){3.0 / 11, 23.0 / 11, 0, 6.0 / 11, 5.0 / 11, 0, 0});
    zoo_bounds(p, 0, 4, 0, INFINITY);
}

static void build_hs100(zoo_problem *p, int32_t size)
{
    (void)size;
    polynomial_problem(p, HS100, (double[]){1, 2, 0, 4, 0, 1, 1},
                       (double[]){2.33049937287957, 1.951372372896889, -0.4775413923888716,
                                  4.36572623365581, -0.6244869705268174, 1.038131018607958,
                                  1.594226711611868, 1.139719959167376, 0, 0, 0.3686145171872114});
    p->scale = 300;
}

static void build_hs113(zoo_problem *p, int32_t size)
{
    (void)size;
    polynomial_problem(p, HS113, (double[]){2, 3, 5, 5, 1, 2, 7, 3, 6, 10},
                       (double[]){2.171996371255455, 2.36368297369728, 8.77392573847685,
                                  5.095984487948453, 0.9906547649638592, 1.430573978936316,
                                  1.321644208161703, 9.828725807886321, 8.280091670098346,
                                  8.375926663921323, 1.716533153468174, 0.4745201541889713,
                                  1.375926663921323, 0.0205455551024224, 0.3120285089353326, 0,
                                  0.2870493192908773, 0});
    p->scale = 100;
}

const zoo_entry zoo_programs[] = {
    {"hs2", "Hock & Schittkowski 2: Rosenbrock's valley, bound", build_hs2, 0, 0, ZOO_SOME, 0},
    {"hs4", "Hock & Schittkowski 4", build_hs4, 0, 0, ZOO_ALL, 0},
    {"hs35", "Hock & Schittkowski 35 (Beale)", build_hs35, 0, 0, ZOO_ALL, 0},
    {"hs38", "Hock & Schittkowski 38 (Colville 4)", build_hs38, 0, 0, ZOO_SOME, 0},
    {"hs43", "Hock & Schittkowski 43 (Rosen & Suzuki)", build_hs43, 0, 0, ZOO_ALL, 0},
    {"hs71", "Hock & Schittkowski 71", build_hs71, 0, 0, ZOO_SOME, 0},
    {"hs76", "Hock & Schittkowski 76", build_hs76, 0, 0, ZOO_ALL, 0},
    {"hs100", "Hock & Schittkowski 100", build_hs100, 0, 0, ZOO_SOME, 0},
    {"hs113", "Hock & Schittkowski 113 (Wong)", build_hs113, 0, 0, ZOO_ALL, 0},
    {NULL, NULL, NULL, 0, 0, 0, 0},
};
