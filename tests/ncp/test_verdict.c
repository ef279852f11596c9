/* Verdicts against an independent look at the rows: programs whose Jacobians have noise where zeros
 * should be, systems that fall into parts in any units, numbers at the edge of the doubles. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "problems.h"

enum { MOST = 16 };

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

/* F, and the sum of the magnitudes of each row's terms. */
typedef void (*equations)(double *F, double *terms, const double *z);

static void add(double *F, double *terms, int32_t i, double term)
{
    F[i] += term;
    terms[i] += fabs(term);
}

/* Hock & Schittkowski 80: min exp(x1 x2 x3 x4 x5), |x|^2 = 10, x2 x3 = 5 x4 x5, x1^3 + x2^3 = -1.
 * x in a box, multipliers free. */
static void hs80(double *F, double *terms, const double *z)
{
    const double *x = z, *y = z + 5, e = exp(x[0] * x[1] * x[2] * x[3] * x[4]);

    for (int32_t i = 0; i < 8; i++)
        F[i] = terms[i] = 0;
    for (int32_t i = 0; i < 5; i++) {
        double others = 1;

        for (int32_t j = 0; j < 5; j++)
            others *= i == j ? 1 : x[j];
        add(F, terms, i, e * others);
        add(F, terms, i, -y[0] * 2 * x[i]);
        add(F, terms, 5, x[i] * x[i]);
    }
    add(F, terms, 5, -10);
    add(F, terms, 1, -y[1] * x[2]);
    add(F, terms, 2, -y[1] * x[1]);
    add(F, terms, 3, y[1] * 5 * x[4]);
    add(F, terms, 4, y[1] * 5 * x[3]);
    add(F, terms, 6, x[1] * x[2]);
    add(F, terms, 6, -5 * x[3] * x[4]);
    for (int32_t i = 0; i < 2; i++) {
        add(F, terms, i, -y[2] * 3 * x[i] * x[i]);
        add(F, terms, 7, x[i] * x[i] * x[i]);
    }
    add(F, terms, 7, 1);
}

/* Hock & Schittkowski 93, the transformer: monomials c prod x_i^k_i of the objective and of two
 * constraints >= 0; x >= 0, multipliers >= 0. */
typedef struct monomial {
    int32_t function; /* 0: the objective */
    double c;
    int32_t powers[6];
} monomial;

static const monomial transformer[] = {
    {0, 0.0204, {2, 0, 0, 1, 0, 0}},           {0, 0.0204, {1, 1, 0, 1, 0, 0}},
    {0, 0.0204, {1, 0, 1, 1, 0, 0}},           {0, 0.0187, {1, 1, 1, 0, 0, 0}},
    {0, 0.0187 * 1.57, {0, 2, 1, 0, 0, 0}},    {0, 0.0187, {0, 1, 1, 1, 0, 0}},
    {0, 0.0607, {2, 0, 0, 1, 2, 0}},           {0, 0.0607, {1, 1, 0, 1, 2, 0}},
    {0, 0.0607, {1, 0, 1, 1, 2, 0}},           {0, 0.0437, {1, 1, 1, 0, 0, 2}},
    {0, 0.0437 * 1.57, {0, 2, 1, 0, 0, 2}},    {0, 0.0437, {0, 1, 1, 1, 0, 2}},
    {1, 0.001, {1, 1, 1, 1, 1, 1}},            {1, -2.07, {0, 0, 0, 0, 0, 0}},
    {2, 1, {0, 0, 0, 0, 0, 0}},                {2, -0.00062, {2, 0, 0, 1, 2, 0}},
    {2, -0.00062, {1, 1, 0, 1, 2, 0}},         {2, -0.00062, {1, 0, 1, 1, 2, 0}},
    {2, -0.00058, {1, 1, 1, 0, 0, 2}},         {2, -0.00058 * 1.57, {0, 2, 1, 0, 0, 2}},
    {2, -0.00058, {0, 1, 1, 1, 0, 2}},
};

static double power(double x, int32_t k)
{
    return k <= 0 ? 1 : k == 1 ? x : x * x;
}

static void hs93(double *F, double *terms, const double *z)
{
    for (int32_t i = 0; i < 8; i++)
        F[i] = terms[i] = 0;
    for (size_t k = 0; k < sizeof transformer / sizeof *transformer; k++) {
        const monomial *t = &transformer[k];
        const double y = t->function ? -z[5 + t->function] : 1;
        double value = t->c;

        for (int32_t i = 0; i < 6; i++)
            value *= power(z[i], t->powers[i]);
        if (t->function)
            add(F, terms, 5 + t->function, value);
        for (int32_t i = 0; i < 6; i++) {
            double slope = y * t->c * t->powers[i];

            for (int32_t j = 0; j < 6; j++)
                slope *= power(z[j], t->powers[j] - (i == j));
            if (t->powers[i] > 0)
                add(F, terms, i, slope);
        }
    }
}

/* Columns of 8. */
typedef void (*slopes)(double *J, const double *z);

static void couple(double *J, int32_t i, int32_t k, double slope)
{
    J[i + 8 * (5 + k)] -= slope;
    J[5 + k + 8 * i] += slope;
}

static void hs80_slopes(double *J, const double *z)
{
    const double *x = z, *y = z + 5, e = exp(x[0] * x[1] * x[2] * x[3] * x[4]);

    memset(J, 0, 64 * sizeof *J);
    for (int32_t i = 0; i < 5; i++)
        for (int32_t j = 0; j < 5; j++) {
            double but_i = 1, but_j = 1, but_both = i == j ? 0 : 1;

            for (int32_t k = 0; k < 5; k++) {
                but_i *= k == i ? 1 : x[k];
                but_j *= k == j ? 1 : x[k];
                but_both *= k == i || k == j ? 1 : x[k];
            }
            J[i + 8 * j] = e * (but_i * but_j + but_both);
        }
    for (int32_t i = 0; i < 5; i++) {
        J[9 * i] -= 2 * y[0];
        couple(J, i, 0, 2 * x[i]);
    }
    J[1 + 8 * 2] -= y[1];
    J[2 + 8 * 1] -= y[1];
    J[3 + 8 * 4] += 5 * y[1];
    J[4 + 8 * 3] += 5 * y[1];
    couple(J, 1, 1, x[2]);
    couple(J, 2, 1, x[1]);
    couple(J, 3, 1, -5 * x[4]);
    couple(J, 4, 1, -5 * x[3]);
    for (int32_t i = 0; i < 2; i++) {
        J[9 * i] -= 6 * x[i] * y[2];
        couple(J, i, 2, 3 * x[i] * x[i]);
    }
}

static double derivative(const monomial *t, const double *x, int32_t a, int32_t b)
{
    double value = t->c;

    for (int32_t i = 0; i < 6; i++) {
        int32_t k = t->powers[i];

        if (i == a)
            value *= k--;
        if (i == b)
            value *= k--;
        value *= value != 0 ? power(x[i], k) : 1;
    }
    return value;
}

static void hs93_slopes(double *J, const double *z)
{
    memset(J, 0, 64 * sizeof *J);
    for (size_t k = 0; k < sizeof transformer / sizeof *transformer; k++) {
        const monomial *t = &transformer[k];
        const double y = t->function ? -z[5 + t->function] : 1;

        for (int32_t i = 0; i < 6; i++) {
            if (t->function)
                couple(J, i, t->function, derivative(t, z, i, -1));
            for (int32_t j = 0; j < 6; j++)
                J[i + 8 * j] += y * derivative(t, z, i, j);
        }
    }
}

typedef struct program {
    equations rows;
    slopes slopes;
    double lower[8], upper[8];
    int32_t variables;
} program;

static const program programs[] = {
    {hs80,
     hs80_slopes,
     {-2.3, -2.3, -3.2, -3.2, -3.2, -INFINITY, -INFINITY, -INFINITY},
     {2.3, 2.3, 3.2, 3.2, 3.2, INFINITY, INFINITY, INFINITY},
     5},
    {hs93, hs93_slopes, {0}, {INFINITY, INFINITY, INFINITY, INFINITY, INFINITY, INFINITY, INFINITY, INFINITY}, 6},
};

static int32_t program_function(double *F, const double *z, void *user)
{
    double terms[MOST];

    ((const program *)user)->rows(F, terms, z);
    return 0;
}

static int32_t program_jacobian(double *J, const double *z, void *user)
{
    ((const program *)user)->slopes(J, z);
    return 0;
}

/* Complex steps would be exact; central differences of a step of 2^-17 are wrong by 2^-34. */
static double worst_row(const program *p, const double *z, int *row)
{
    double F[8], terms[8], worst = 0;

    p->rows(F, terms, z);
    for (int32_t i = 0; i < 8; i++) {
        double r = fabs(F[i]);

        if (z[i] == p->lower[i])
            r = fmax(-F[i], 0);
        else if (z[i] == p->upper[i])
            r = fmax(F[i], 0);
        if (r / (terms[i] + 1e-3) > worst) {
            worst = r / (terms[i] + 1e-3);
            *row = i;
        }
    }
    return worst;
}

static void explore(void)
{
    for (int p = 0; p < 2; p++)
        for (int method = 0; method < 3; method++) {
            int good = 0, bad = 0;
            uint64_t state = 12345;
            for (int s = 0; s < 300; s++) {
                const program *q = &programs[p];
                perp_ncp_problem problem;
                perp_ncp_settings settings;
                perp_ncp_result result;
                double z0[8], z[8], w[8], worst;
                int row = -1;
                (void)!perp_ncp_problem_init(&problem, sizeof problem);
                (void)!perp_ncp_settings_init(&settings, sizeof settings);
                (void)!perp_ncp_result_init(&result, sizeof result);
                settings.method = method;
                problem.n = 8;
                problem.function = program_function;
                problem.jacobian = program_jacobian;
                if(s==0&&method==0){perp_ncp_check c;(void)!perp_ncp_check_init(&c,sizeof c);double zz[8]={.9,1.1,.7,.6,1.3,.5,1.2,.4};
                   problem.user=(void*)q;problem.lower=q->lower;problem.upper=q->upper;int st=perp_ncp_check_jacobian(context,&c,&problem,zz);printf("check %d wrong %d\n",st,c.wrong);}
                problem.lower = q->lower;
                problem.upper = q->upper;
                problem.user = (void *)q;
                for (int i = 0; i < 8; i++) {
                    double u = zoo_random(&state);
                    z0[i] = p == 0 ? (i < 5 ? q->lower[i] + u * (q->upper[i] - q->lower[i]) : 4 * u - 2)
                                   : (i < 6 ? 15 * u : 4 * u);
                }
                if (perp_ncp_solve(context, z, w, &result, &settings, &problem, z0) != PERP_OK)
                    abort();
                worst = worst_row(q, z, &row);
                if (result.outcome == 0 || result.outcome == 1) {
                    good++;
                    if (worst > 1e-6) {
                        if (bad++ < 5)
                            printf("%d m%d s%d %s it %d res %g nat %g back %g worst %g row %d z %g %g %g %g %g %g %g %g\n", p, method, s,
                                   perp_outcome_text(result.outcome), (int)result.iterations, result.residual,
                                   result.natural_residual, result.backward_error, worst, row,z[0],z[1],z[2],z[3],z[4],z[5],z[6],z[7]);
                    }
                }
            }
            printf("program %d method %d: good %d, doubtful %d\n", p, method, good, bad);
        }
}
int main(void)
{
    make(NULL);
    explore();
    destroy(NULL);
}
