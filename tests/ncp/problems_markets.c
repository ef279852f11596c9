/* Markets: energy and brands. Stated solutions: least squares from the
 * starts on equations written anew from the papers, then Newton's method in 25 digits on the active
 * set. */
#include "problems.h"
#include "problems_choi.h"

/* F_row += c z_column */
static void link_to(double *F, const double *z, zoo_jacobian *J, int32_t row, int32_t column,
                    double c)
{
    F[row] += c * z[column];
    if (J)
        zoo_add(J, row, column, c);
}

/* PIES: where each group of unknowns starts; within a group the last index runs fastest. */
enum {
    C = 0,
    O = 6,
    CT = 10,
    OT = 14,
    LT = 18,
    HT = 22,
    P = 26,
    MU = 32,
    CV = 34,
    OV = 36,
    LV = 38,
    HV = 40,
    PIES_SIZE = 42
};

static const double coal_limit[] = {300, 300, 400, 200, 300, 600};
static const double oil_limit[] = {1100, 1200, 1300, 1100};
static const double coal_use[2][6] = {{1, 5, 10, 1, 5, 6}, {1, 2, 3, 1, 4, 5}};
static const double oil_use[2][4] = {{0, 10, 0, 15}, {0, 4, 0, 2}};
static const double output[2][2] = {{0.6, 0.4}, {0.5, 0.5}}; /* light and heavy, by refinery */

/* Costs of producing, carrying and refining, less prices; resources used. */
static void pies_producers(const double *z, double *F, zoo_jacobian *J)
{
    static const double coal_cost[] = {5, 6, 8, 4, 5, 7}, oil_cost[] = {1, 1.5, 1.25, 1.5};
    F[MU] = 35000;
    F[MU + 1] = 12000;
    for (int32_t i = 0; i < 6; i++) {
        F[C + i] = coal_cost[i];
        link_to(F, z, J, C + i, CV + i / 3, -1);
        link_to(F, z, J, CV + i / 3, C + i, 1);
        for (int32_t r = 0; r < 2; r++) {
            link_to(F, z, J, C + i, MU + r, coal_use[r][i]);
            link_to(F, z, J, MU + r, C + i, -coal_use[r][i]);
        }
    }
    for (int32_t i = 0; i < 4; i++) {
        F[O + i] = oil_cost[i];
        link_to(F, z, J, O + i, OV + i / 2, -1);
        link_to(F, z, J, OV + i / 2, O + i, 1);
        for (int32_t r = 0; r < 2; r++) {
            link_to(F, z, J, O + i, MU + r, oil_use[r][i]);
            link_to(F, z, J, MU + r, O + i, -oil_use[r][i]);
        }
    }
}

static void pies_transport(const double *z, double *F, zoo_jacobian *J)
{
    static const double coal[] = {1, 2.5, 0.75, 2.75}, oil[] = {2, 3, 4, 2},
                        rest[] = {1, 1.2, 1, 1.5};
    static const double refining[] = {6.5, 5};
    static const int32_t goods[] = {CT, LT, HT}, prices[] = {CV, LV, HV};
    for (int32_t g = 0; g < 3; g++) {
        for (int32_t i = 0; i < 4; i++) {
            F[goods[g] + i] = g == 0 ? coal[i] : rest[i];
            link_to(F, z, J, goods[g] + i, prices[g] + i / 2, 1);
            link_to(F, z, J, goods[g] + i, P + 2 * g + i % 2, -1);
            link_to(F, z, J, P + 2 * g + i % 2, goods[g] + i, 1);
            link_to(F, z, J, prices[g] + i / 2, goods[g] + i, -1);
        }
    }
    for (int32_t i = 0; i < 4; i++) {
        int32_t field = i / 2, refinery = i % 2;
        F[OT + i] = oil[i] + refining[refinery];
        link_to(F, z, J, OT + i, OV + field, 1);
        link_to(F, z, J, OV + field, OT + i, -1);
        for (int32_t g = 0; g < 2; g++) {
            link_to(F, z, J, OT + i, (g ? HV : LV) + refinery, -output[refinery][g]);
            link_to(F, z, J, (g ? HV : LV) + refinery, OT + i, output[refinery][g]);
        }
    }
}

static int32_t pies(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    static const double demand[] = {1000, 1200, 1000}, price[] = {12, 16, 12};
    static const double elasticity[3][3] = {{-0.75, 0.1, 0.2}, {0.1, -0.5, 0.2}, {0.2, 0.1, -0.5}};
    for (int32_t i = 0; i < p->n; i++)
        F[i] = 0;
    for (int32_t i = P; i < P + 6; i++)
        if (z[i] <= 0)
            return 1;
    pies_producers(z, F, J);
    pies_transport(z, F, J);
    for (int32_t g = 0; g < 3; g++) {
        for (int32_t u = 0; u < 2; u++) {
            double q = demand[g];
            for (int32_t o = 0; o < 3; o++)
                q *= pow(z[P + 2 * o + u] / price[o], elasticity[g][o]);
            F[P + 2 * g + u] -= q;
            for (int32_t o = 0; J && o < 3; o++)
                zoo_add(J, P + 2 * g + u, P + 2 * o + u, -q * elasticity[g][o] / z[P + 2 * o + u]);
        }
    }
    return 0;
}

static void build_pies(zoo_problem *p, int32_t size)
{
    static const double start[PIES_SIZE] = {
        300,  300,  400,  200,  300, 600,  1100, 1000, 1300, 1000, 0,   828, 1016, 84,
        2075, 0,    0,    2358, 22,  1223, 1179, 0,    0,    830,  998, 180, 11.7, 13.7,
        15.8, 16.0, 11.9, 12.4, 1,   1,    1,    1,    1,    1,    1,   1,   1,    1};
    static const double solution[PIES_SIZE] = {300,
                                               300,
                                               227.8892450071591,
                                               200,
                                               300,
                                               600,
                                               1100,
                                               975.0692218705256,
                                               1300,
                                               1058.02768874821,
                                               0,
                                               827.8892450071591,
                                               1016.373198405094,
                                               83.62680159490613,
                                               2075.069221870526,
                                               0,
                                               0,
                                               2358.02768874821,
                                               22.26154982590816,
                                               1222.779983296407,
                                               1179.013844374105,
                                               0,
                                               0,
                                               830.0276887482102,
                                               998.3786893799249,
                                               180.6351549941802,
                                               11.69731202277267,
                                               13.69731202277267,
                                               15.82662351158445,
                                               16.02662351158445,
                                               11.89066737861452,
                                               12.39066737861452,
                                               0.2672524915901246,
                                               0.1749290356238078,
                                               11.19731202277267,
                                               10.94731202277267,
                                               4.872241058396477,
                                               5.858645445099485,
                                               14.82662351158445,
                                               14.82662351158445,
                                               11.19066737861452,
                                               10.89066737861452};
    (void)size;
    zoo_size(p, PIES_SIZE, pies);
    zoo_set(zoo_solution(p), solution, PIES_SIZE);
    for (int32_t i = 0; i < 6; i++) {
        p->upper[C + i] = coal_limit[i];
        p->lower[P + i] = 0.1;
        if (i < 4)
            p->upper[O + i] = oil_limit[i];
    }
    zoo_bounds(p, CV, PIES_SIZE, -INFINITY, INFINITY);
    zoo_set(zoo_start(p, 0), start, PIES_SIZE);
    zoo_start(p, 1);
    zoo_start(p, 10);
    p->scale = 1000;
}

/* Fourteen brands of analgesics, thirty subjects: Bertrand prices. data: weights w_i of the price,
 * then utilities without it, then costs. */
enum { BRANDS = 14, SUBJECTS = 30 };

static int32_t choi(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    const double *w = p->data, *utility = w + SUBJECTS, *cost = utility + SUBJECTS * BRANDS;
    double G[BRANDS][BRANDS] = {{0}}, e[BRANDS];
    for (int32_t j = 0; j < BRANDS; j++)
        F[j] = 0;
    for (int32_t i = 0; i < SUBJECTS; i++) {
        double sum = 1;
        for (int32_t j = 0; j < BRANDS; j++)
            sum += e[j] = exp(w[i] * z[j] + utility[i * BRANDS + j]);
        for (int32_t j = 0; j < BRANDS; j++) {
            double share = e[j] / sum, m = (z[j] - cost[j]) * w[i], bracket = 1 + m * (1 - share);
            F[j] -= share * bracket / SUBJECTS;
            for (int32_t l = 0; J && l < BRANDS; l++) {
                double of_share = w[i] * share * ((l == j) - e[l] / sum);
                G[j][l] -=
                    (of_share * (bracket - m * share) + (l == j ? share * w[i] * (1 - share) : 0)) /
                    SUBJECTS;
            }
        }
    }
    for (int32_t j = 0; J && j < BRANDS; j++)
        for (int32_t l = 0; l < BRANDS; l++)
            zoo_add(J, j, l, G[j][l]);
    for (int32_t j = 0; j < BRANDS; j++)
        if (!isfinite(F[j]))
            return 1;
    return 0;
}

static void choi_data(double *data)
{
    double *w = data, *utility = w + SUBJECTS, *cost = utility + SUBJECTS * BRANDS;
    for (int32_t i = 0; i < SUBJECTS; i++) {
        w[i] = -3 * price_weights[i];
        for (int32_t j = 0; j < BRANDS; j++) {
            double distance = 0;
            for (int k = 0; k < 4; k++)
                distance += pow(contents[j][k] - preferences[i][k], 2);
            utility[i * BRANDS + j] = -3 * (weights[i] * distance + constants[i]);
        }
    }
    zoo_set(cost, costs, BRANDS);
}

static void build_choi(zoo_problem *p, int32_t size)
{
    static const double solution[BRANDS] = {
        0.611357716961235,  0.2268680045878747, 0.611357716961235,  0.2297430170528421,
        0.2003807094924115, 0.2209344636724266, 0.2483738765817012, 0.199,
        0.611357716961235,  0.5151308379343882, 0.611357716961235,  0.611357716961235,
        0.4423024537902687, 0.4088807453186498};
    (void)size;
    zoo_size(p, BRANDS, choi);
    zoo_set(zoo_solution(p), solution, BRANDS);
    choi_data(zoo_data(p, SUBJECTS * (BRANDS + 1) + BRANDS));
    const double *cost = p->data + SUBJECTS * (BRANDS + 1);
    double *near = zoo_start(p, 0), *far = zoo_start(p, 0);
    for (int32_t j = 0; j < BRANDS; j++) {
        p->lower[j] = cost[j];
        near[j] = cost[j] + 0.01;
        far[j] = cost[j] + 0.3;
    }
    zoo_bounds(p, 7, 8, 0.199, 0.199); /* the eighth brand's price is given */
    near[7] = far[7] = 0.199;
}

const zoo_entry zoo_markets[] = {
    {"pies", "Hogan 1975, Josephy 1979, as in MCPLIB", build_pies, 0, 0, ZOO_SOME, 0},
    {"choi", "Choi, DeSarbo & Harker 1990, as in MCPLIB", build_choi, 0, 0, ZOO_SOME, 0},
    {NULL, NULL, NULL, 0, 0, 0, 0},
};
