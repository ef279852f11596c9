/* General equilibrium with constant elasticities of substitution. */
#include "problems.h"

/* F_row += c z_column */
static void link_to(double *F, const double *z, zoo_jacobian *J, int32_t row, int32_t column,
                    double c)
{
    F[row] += c * z[column];
    if (J)
        zoo_add(J, row, column, c);
}

/* Demand of one consumer with constant elasticity of substitution s and the given income, taken
 * from the market: F_c -= income a_c p_c^-s / sum a p^(1-s). income_column < 0: the income is the
 * price of the holdings. */
typedef struct consumer {
    int32_t goods, income_column;
    const double *share, *holdings;
    double elasticity;
} consumer;

static void demand(const consumer *k, const double *z, double income, double *F, zoo_jacobian *J)
{
    double sum = 0, s = k->elasticity;
    for (int32_t c = 0; c < k->goods; c++)
        if (k->share[c] > 0)
            sum += k->share[c] * pow(z[c], 1 - s);
    for (int32_t c = 0; c < k->goods; c++) {
        if (k->share[c] <= 0)
            continue;
        double unit = k->share[c] * pow(z[c], -s) / sum, d = income * unit;
        F[c] -= d;
        if (!J)
            continue;
        if (k->income_column >= 0)
            zoo_add(J, c, k->income_column, -unit);
        for (int32_t o = 0; o < k->goods; o++) {
            double own = o == c ? s * d / z[c] : 0;
            double other = k->share[o] > 0 ? d * k->share[o] * (1 - s) * pow(z[o], -s) / sum : 0;
            zoo_add(J, c, o, own + other - (k->income_column < 0 ? unit * k->holdings[o] : 0));
        }
    }
}

/* Scarf & Hansen's economy with activities: six prices, eight activities, five incomes. The stated
 * solution as in problems_markets.c. */
static const double scarf_endowment[5][6] = {{0, 0, 1, 3, 5, 0.1},
                                             {0, 0, 2, 0.1, 0.1, 7},
                                             {0, 0, 1.5, 2, 6, 0.1},
                                             {0, 0, 1, 1, 0.1, 8},
                                             {0, 0, 2, 6, 0.1, 0.5}};
static const double scarf_demand[5][6] = {{4, 2, 3.2, 0, 0.2, 0},
                                          {0.4, 4, 1, 0, 0, 0.6},
                                          {2, 2, 1.5, 0, 0.5, 0},
                                          {5, 5, 4.5, 0, 0, 0.2},
                                          {3, 4, 2, 0, 0, 0.2}};
static const double scarf_activity[8][6] = {{4, 0, 4, -5.3, -2, -1}, {4, 0, 3.5, -5, -1, -6},
                                            {1.6, 6, 0, -2, -2, -3}, {1.6, 8, 0, -2, -4, -1},
                                            {1.6, 7, 0, -2, -1, -8}, {0.9, 0, 0, -1, 0, 0},
                                            {7, 0, 0, -4, -3, -1},   {8, 0, 0, -5, -2, -8}};

static int32_t scarf(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    static const double elasticity[] = {1.2, 1.6, 0.8, 0.5, 0.6};
    for (int32_t i = 0; i < p->n; i++)
        F[i] = 0;
    for (int32_t c = 0; c < 6; c++)
        if (z[c] <= 0 && c != 3)
            return 1;
    for (int32_t k = 0; k < 8; k++) {
        for (int32_t c = 0; c < 6; c++) {
            link_to(F, z, J, 6 + k, c, -scarf_activity[k][c]);
            link_to(F, z, J, c, 6 + k, scarf_activity[k][c]);
        }
    }
    for (int32_t h = 0; h < 5; h++) {
        const consumer k = {6, 14 + h, p->data + 6 * h, scarf_endowment[h], elasticity[h]};
        link_to(F, z, J, 14 + h, 14 + h, 1);
        for (int32_t c = 0; c < 6; c++) {
            F[c] += scarf_endowment[h][c];
            link_to(F, z, J, 14 + h, c, -scarf_endowment[h][c]);
        }
        demand(&k, z, z[14 + h], F, J);
    }
    return 0;
}

static void build_scarf(zoo_problem *p, int32_t size)
{
    static const double solution[] = {1.132499481464958,
                                      0.545260162700265,
                                      1.061884958835617,
                                      1.290535010515798,
                                      0.8276541227229443,
                                      0.2823939600226793,
                                      0.4634929345624646,
                                      0,
                                      3.939195056822707,
                                      0.006022990606705473,
                                      0,
                                      0,
                                      0.4382628379900284,
                                      0,
                                      9.1,
                                      4.312346551153862,
                                      9.168061591624955,
                                      4.694337061805143,
                                      10.09094237304966};
    (void)size;
    zoo_size(p, 19, scarf);
    zoo_set(zoo_solution(p), solution, 19);
    double *share = zoo_data(p, 30), *start = zoo_start(p, 1), *other = zoo_start(p, 0.5);
    for (int32_t h = 0; h < 5; h++) {
        double income = 0, sum = 0;
        for (int32_t c = 0; c < 6; c++) {
            income += scarf_endowment[h][c];
            sum += scarf_demand[h][c];
        }
        for (int32_t c = 0; c < 6; c++)
            share[6 * h + c] = scarf_demand[h][c] / sum;
        start[14 + h] = other[14 + h] = income;
    }
    for (int32_t c = 0; c < 6; c++)
        p->lower[c] = c == 3 ? 0 : 1e-5;
    zoo_bounds(p, 14, 15, start[14], start[14]); /* the first consumer's income is the unit */
    p->scale = 10;
}

/* An exchange of ten goods between five consumers; the first price is 1. data: shares, holdings and
 * elasticities between 1 and 2, so that all goods are gross substitutes: one equilibrium. */
enum { GOODS = 10, TRADERS = 5 };

static int32_t exchange(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    for (int32_t c = 0; c < GOODS; c++) {
        F[c] = 0;
        if (z[c] <= 0)
            return 1;
    }
    for (int32_t h = 0; h < TRADERS; h++) {
        const double *row = p->data + (2 * GOODS + 1) * h, *holdings = row + GOODS;
        const consumer k = {GOODS, -1, row, holdings, row[2 * GOODS]};
        double income = 0;
        for (int32_t c = 0; c < GOODS; c++) {
            income += z[c] * holdings[c];
            F[c] += holdings[c];
        }
        demand(&k, z, income, F, J);
    }
    return 0;
}

static void build_exchange(zoo_problem *p, int32_t size)
{
    uint64_t seed = 1954;
    (void)size;
    zoo_size(p, GOODS, exchange);
    double *row = zoo_data(p, (2 * GOODS + 1) * TRADERS);
    for (int32_t h = 0; h < TRADERS; h++, row += 2 * GOODS + 1) {
        for (int32_t c = 0; c < 2 * GOODS; c++)
            row[c] = 0.05 + zoo_random(&seed);
        row[2 * GOODS] = 1.1 + 0.9 * zoo_random(&seed);
    }
    zoo_bounds(p, 0, GOODS, 1e-6, INFINITY);
    zoo_bounds(p, 0, 1, 1, 1);
    zoo_start(p, 1);
    double *start = zoo_start(p, 5);
    start[0] = 1;
    p->scale = 5;
}

const zoo_entry zoo_exchanges[] = {
    {"scarf", "Scarf & Hansen 1973, activity analysis, as scarfmcp of GAMS", build_scarf, 0, 0,
     ZOO_SOME, 0},
    {"exchange", "pure exchange with gross substitutes, generated", build_exchange, 0, 0,
     ZOO_UNIQUE, 0},
    {NULL, NULL, NULL, 0, 0, 0, 0},
};
