/* General equilibrium with constant elasticities of substitution. */
#include "problems.h"
#include "problems_hansen.h"

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

/* Economies with activities (Scarf & Hansen): prices, then levels of the activities, then incomes
 * of the consumers. data: shares. The stated solutions as in problems_markets.c. */
typedef struct economy {
    int32_t goods, activities, consumers;
    const double *endowment, *demand, *activity, *elasticity; /* consumer or activity by good */
} economy;

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

static const double scarf_elasticity[] = {1.2, 1.6, 0.8, 0.5, 0.6};
static const double hansen_elasticity[] = {1, 1, 1, 1};

static const economy economies[] = {
    {6, 8, 5, scarf_endowment[0], scarf_demand[0], scarf_activity[0], scarf_elasticity},
    {14, 26, 4, hansen_endowment[0], hansen_demand[0], hansen_activity[0], hansen_elasticity},
};

static int32_t activities(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    const economy *e = &economies[p->size];
    const int32_t m = e->goods, incomes = m + e->activities;
    for (int32_t i = 0; i < p->n; i++)
        F[i] = 0;
    for (int32_t c = 0; c < m; c++)
        if (p->lower[c] > 0 && z[c] <= 0)
            return 1;
    for (int32_t k = 0; k < e->activities; k++) {
        for (int32_t c = 0; c < m; c++) {
            link_to(F, z, J, m + k, c, -e->activity[m * k + c]);
            link_to(F, z, J, c, m + k, e->activity[m * k + c]);
        }
    }
    for (int32_t h = 0; h < e->consumers; h++) {
        const double *holdings = e->endowment + m * h;
        const consumer k = {m, incomes + h, p->data + m * h, holdings, e->elasticity[h]};
        link_to(F, z, J, incomes + h, incomes + h, 1);
        for (int32_t c = 0; c < m; c++) {
            F[c] += holdings[c];
            link_to(F, z, J, incomes + h, c, -holdings[c]);
        }
        demand(&k, z, z[incomes + h], F, J);
    }
    return 0;
}

/* Prices and levels start at 1, and the incomes are what the endowments are worth. */
static void build_economy(zoo_problem *p, int32_t which, const double *solution)
{
    const economy *e = &economies[which];
    const int32_t m = e->goods, incomes = m + e->activities;
    zoo_size(p, incomes + e->consumers, activities);
    zoo_set(zoo_solution(p), solution, p->n);
    p->size = which;
    p->scale = 10;
    double *share = zoo_data(p, (size_t)(m * e->consumers));
    double *start = zoo_start(p, 1), *other = zoo_start(p, 0.5);
    for (int32_t h = 0; h < e->consumers; h++) {
        double income = 0, sum = 0;
        for (int32_t c = 0; c < m; c++) {
            income += e->endowment[m * h + c];
            sum += e->demand[m * h + c];
        }
        for (int32_t c = 0; c < m; c++) {
            share[m * h + c] = e->demand[m * h + c] / sum;
            if (share[m * h + c] > 0)
                p->lower[c] = 1e-5;
        }
        start[incomes + h] = other[incomes + h] = income;
    }
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
    build_economy(p, 0, solution);
    zoo_bounds(p, 14, 15, p->starts[14], p->starts[14]); /* the first income is the unit */
}

static void build_hansen(zoo_problem *p, int32_t size)
{
    static const double solution[] = {1,
                                      0.9386857743026096,
                                      1.5359047996213,
                                      1.14964999165567,
                                      1.059664194352844,
                                      1.00490902442218,
                                      1.108723577988234,
                                      1.578762035945874,
                                      1.452054431138991,
                                      1.280152523286529,
                                      0.9044181219799618,
                                      0.9978512201894105,
                                      0.5875814316921999,
                                      1.493047563296727,
                                      0.4792337240884877,
                                      0,
                                      0,
                                      5.197140286866075,
                                      0.4041379955336161,
                                      0,
                                      0,
                                      0,
                                      3.050034977821867,
                                      2.118479723445856,
                                      3.68944985172632,
                                      2.802859713133925,
                                      0,
                                      4.404409209108137,
                                      2.364643752568375,
                                      0,
                                      2.56427420710441,
                                      0,
                                      1.205296713569144,
                                      0,
                                      0,
                                      0,
                                      4.728468246156882,
                                      0,
                                      0,
                                      0,
                                      5.154938763543475,
                                      2.827534834524566,
                                      0.5875814316921999,
                                      8.559967508019868};
    (void)size;
    build_economy(p, 1, solution);
    zoo_bounds(p, 0, 1, 1, 1); /* the first price is the unit */
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
    {"hansen", "Hansen in Scarf & Hansen 1973, as hansmcp of GAMS", build_hansen, 0, 0, ZOO_SOME,
     0},
    {"exchange", "pure exchange with gross substitutes, generated", build_exchange, 0, 0,
     ZOO_UNIQUE, 0},
    {NULL, NULL, NULL, 0, 0, 0, 0},
};
