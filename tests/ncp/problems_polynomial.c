/* Terms of polynomials, their derivatives, and the system they make. */
#include "problems_polynomial.h"

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
    const program *P = p->form;
    for (int32_t i = 0; i < p->n; i++)
        F[i] = 0;
    for (const term *t = P->terms; t->coefficient != 0; t++)
        add_term(P, t, z, F, J);
    return 0;
}

void zoo_polynomial(zoo_problem *p, const program *P, const double *start, const double *solution)
{
    zoo_size(p, P->variables + P->functions, polynomial);
    p->form = P;
    zoo_bounds(p, 0, P->variables, -INFINITY, INFINITY);
    zoo_bounds(p, p->n - P->equalities, p->n, -INFINITY, INFINITY);
    zoo_set(zoo_start(p, 0), start, P->variables);
    double *ones = zoo_start(p, 0);
    for (int32_t i = 0; i < p->n; i++)
        ones[i] = i < P->variables ? start[i] : 1;
    zoo_set(zoo_solution(p), solution, p->n);
}
