/* Five firms sell one good; each chooses the amount q_i >= 0 that is best for it, given the others'
 * (a Nash-Cournot equilibrium; Murphy, Sherali & Soyster, Math. Prog. 24 (1982)):
 *
 *   0 <= q_i  perp  cost'_i(q_i) - p(Q) - q_i p'(Q) >= 0,   Q = sum q_i,  p(Q) = (5000/Q)^(1/1.1).
 *
 * No Jacobian is written down: perp takes differences. */
#include <perp/perp.h>

#include <math.h>
#include <stdio.h>

enum { FIRMS = 5 };

typedef struct market {
    double c[FIRMS], beta[FIRMS];
    double gamma;
} market;

static int32_t marginal_loss(double *F, const double *q, void *user)
{
    const market *m = user;
    double Q = 0, price;
    int i;

    for (i = 0; i < FIRMS; i++)
        Q += q[i];
    if (!(Q > 0))
        return 1; /* no price without a sale: outside of the domain */
    price = pow(5000 / Q, 1 / m->gamma);
    for (i = 0; i < FIRMS; i++)
        F[i] = m->c[i] + pow(q[i] / 5, 1 / m->beta[i]) - price * (1 - q[i] / (m->gamma * Q));
    return 0;
}

int main(void)
{
    market m = {{10, 8, 6, 4, 2}, {1.2, 1.1, 1, 0.9, 0.8}, 1.1};
    const double start[FIRMS] = {10, 10, 10, 10, 10};
    double q[FIRMS];
    perp_context *context;
    perp_ncp_problem problem;
    perp_ncp_result result;
    int i;

    perp_struct_init(&problem, sizeof problem);
    problem.n = FIRMS;
    problem.function = marginal_loss;
    problem.user = &m;
    perp_struct_init(&result, sizeof result);
    if (perp_context_create(&context, NULL) != PERP_OK)
        return 1;
    if (perp_ncp_solve(context, q, NULL, &result, NULL, &problem, start) != PERP_OK) {
        fprintf(stderr, "%s\n", perp_context_message(context));
        perp_context_destroy(context);
        return 1;
    }
    printf("%s: q =", perp_outcome_text(result.outcome));
    for (i = 0; i < FIRMS; i++)
        printf(" %.6f", q[i]);
    printf("\n");
    perp_context_destroy(context);
    return 0;
}
