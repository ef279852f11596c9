/* Trade between regions and traffic on networks. */
#include "problems.h"

/* Dantzig's transport: six shipments, prices of two plants and three markets, whose demand reacts
 * to the price. Prices at the fixed demand are the plain costs, and so they are here. */
static const double freight[6] = {0.225, 0.153, 0.162, 0.225, 0.162, 0.126};

static int32_t transport(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    static const double capacity[] = {350, 600}, demand[] = {325, 300, 275};
    static const double usual[] = {0.225, 0.153, 0.126}, elasticity[] = {1.5, 1.2, 2};
    (void)p;
    F[6] = capacity[0];
    F[7] = capacity[1];
    for (int32_t j = 0; j < 3; j++) {
        if (z[8 + j] <= 0)
            return 1;
        F[8 + j] = -demand[j] * pow(usual[j] / z[8 + j], elasticity[j]);
        if (J)
            zoo_add(J, 8 + j, 8 + j, -F[8 + j] * elasticity[j] / z[8 + j]);
    }
    for (int32_t k = 0; k < 6; k++) {
        int32_t plant = 6 + k / 3, market = 8 + k % 3;
        F[k] = z[plant] + freight[k] - z[market];
        F[plant] -= z[k];
        F[market] += z[k];
        if (J) {
            zoo_add(J, k, plant, 1);
            zoo_add(J, k, market, -1);
            zoo_add(J, plant, k, -1);
            zoo_add(J, market, k, 1);
        }
    }
    return 0;
}

/* Both plants can serve the first market: 0 to 50 come from the first plant. */
static void build_transport(zoo_problem *p, int32_t size)
{
    (void)size;
    zoo_size(p, 11, transport);
    zoo_start(p, 1);
    double *start = zoo_start(p, 0);
    zoo_set(start + 8, (double[]){0.2, 0.2, 0.2}, 3);
    zoo_set(zoo_solution(p), (double[]){0, 300, 0, 325, 0, 275, 0, 0, 0.225, 0.153, 0.126}, 11);
    zoo_set(zoo_solution(p), (double[]){50, 300, 0, 275, 0, 275, 0, 0, 0.225, 0.153, 0.126}, 11);
    p->scale = 600;
}

/* Shipments between three countries with linear demand and supply. */
static int32_t three_countries(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    static const double supply[] = {9, 3, 18}, supply_slope[] = {1, 2, 1};
    static const double demand[] = {42, 54, 51}, demand_slope[] = {3, 2, 1};
    static const double cost[] = {0, 3, 9, 3, 0, 3, 6, 3, 0};
    (void)p;
    for (int32_t k = 0; k < 9; k++) {
        int32_t from = k / 3, to = k % 3;
        F[k] = supply[from] + cost[k] - demand[to];
        for (int32_t l = 0; l < 9; l++) {
            double c =
                (l / 3 == from ? supply_slope[from] : 0) + (l % 3 == to ? demand_slope[to] : 0);
            F[k] += c * z[l];
            if (J)
                zoo_add(J, k, l, c);
        }
    }
    return 0;
}

static void build_three_countries(zoo_problem *p, int32_t size)
{
    (void)size;
    zoo_size(p, 9, three_countries);
    /* the only one of all 512 index sets, in rationals */
    zoo_set(zoo_solution(p),
            (double[]){153.0 / 26, 123.0 / 13, 0, 0, 201.0 / 52, 108.0 / 13, 0, 0, 321.0 / 26}, 9);
    zoo_start(p, 0);
    zoo_start(p, 10);
    p->scale = 50;
}

/* Producers and consumers on a ring, each linked with its five nearest: shipment k goes from k / 5
 * to k / 5 + k % 5. Price of supply a + b s + c s^2, of demand d - e t^1.5, cost of shipping
 * f + g x^2 / 2: strictly monotone. data: a, b, c, d, e of each place, then f, g of each link. */
static int32_t ring(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    const int32_t m = p->n / 5;
    for (int32_t k = 0; k < p->n; k++) {
        const int32_t from = k / 5, to = (k / 5 + k % 5) % m;
        const double *here = p->data + 5 * from, *there = p->data + 5 * to;
        const double *way = p->data + 5 * m + 2 * k;
        double s = 0, t = 0;
        if (z[k] < 0)
            return 1; /* t^1.5 */
        for (int32_t d = 0; d < 5; d++) {
            s += z[5 * from + d];
            t += z[5 * ((to + m - d) % m) + d];
        }
        F[k] = here[0] + here[1] * s + here[2] * s * s + way[0] + 0.5 * way[1] * z[k] * z[k] -
               there[3] + there[4] * t * sqrt(t);
        for (int32_t d = 0; J && d < 5; d++) {
            zoo_add(J, k, 5 * from + d, here[1] + 2 * here[2] * s);
            zoo_add(J, k, 5 * ((to + m - d) % m) + d, 1.5 * there[4] * sqrt(t));
        }
        if (J)
            zoo_add(J, k, k, way[1] * z[k]);
    }
    return 0;
}

static void build_ring(zoo_problem *p, int32_t size)
{
    const int32_t m = size / 5;
    uint64_t seed = 1952;
    zoo_size(p, 5 * m, ring);
    p->sparse = 1;
    double *data = zoo_data(p, 15 * (size_t)m);
    for (int32_t i = 0; i < m; i++) {
        data[5 * i] = 5 + 10 * zoo_random(&seed);
        data[5 * i + 1] = 0.5 + zoo_random(&seed);
        data[5 * i + 2] = 0.1 * zoo_random(&seed);
        data[5 * i + 3] = 20 + 20 * zoo_random(&seed);
        data[5 * i + 4] = 0.2 + 0.4 * zoo_random(&seed);
    }
    for (int32_t k = 0; k < 5 * m; k++) {
        data[5 * m + 2 * k] = k % 5 + zoo_random(&seed);
        data[5 * m + 2 * k + 1] = 0.05 + 0.1 * zoo_random(&seed);
    }
    zoo_start(p, 0);
    zoo_start(p, 1);
    zoo_start(p, 20);
    p->scale = 30;
}

/* Five nodes on two rings of roads: x goes the long way from node i to i + 3, y the short one, and
 * v is the delay. Delays are sums of g(flow) = 1 + flow + flow^2 on merging roads. */
static void delay(double *F, const double *z, zoo_jacobian *J, int32_t row, double c, int32_t a,
                  int32_t b, int32_t d)
{
    const int32_t on[3] = {a, b, d};
    double s = 0;
    for (int k = 0; k < 3; k++)
        s += on[k] < 0 ? 0 : z[on[k]];
    F[row] += c * (1 + s + s * s);
    for (int k = 0; J && k < 3; k++)
        if (on[k] >= 0)
            zoo_add(J, row, on[k], c * (1 + 2 * s));
}

static int32_t two_rings(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    (void)p;
    for (int32_t i = 0; i < 5; i++) {
        const int32_t x[5] = {i, (i + 1) % 5, (i + 2) % 5, (i + 3) % 5, (i + 4) % 5};
        const int32_t y = 5 + i, after = 5 + x[1], before = 5 + x[4], v = 10 + i;
        F[i] = F[y] = -z[v];
        F[v] = z[i] + z[y] - (i + 1);
        delay(F, z, J, i, 1, x[0], -1, -1);
        delay(F, z, J, i, 1, x[3], x[4], -1);
        delay(F, z, J, i, 10, x[0], x[3], x[4]);
        delay(F, z, J, i, 2, x[3], -1, -1);
        delay(F, z, J, i, 1, x[0], x[4], -1);
        delay(F, z, J, i, 10, x[0], x[1], x[4]);
        delay(F, z, J, i, 2, x[4], -1, -1);
        delay(F, z, J, i, 1, x[0], x[1], -1);
        delay(F, z, J, i, 10, x[0], x[1], x[2]);
        delay(F, z, J, i, 3, x[0], -1, -1);
        delay(F, z, J, y, 5, y, -1, -1);
        delay(F, z, J, y, 3, after, -1, -1);
        delay(F, z, J, y, 10, y, after, -1);
        delay(F, z, J, y, 10, y, before, -1);
        if (J) {
            zoo_add(J, i, v, -1);
            zoo_add(J, y, v, -1);
            zoo_add(J, v, i, 1);
            zoo_add(J, v, y, 1);
        }
    }
    return 0;
}

static void build_two_rings(zoo_problem *p, int32_t size)
{
    static const double starts[6][3] = {{0, 0, 0},   {0.5, 0.5, 0.5}, {100, 100, 100},
                                        {0, 0, 100}, {0, 0, 1},       {1, 1, 200}};
    (void)size;
    zoo_size(p, 15, two_rings);
    zoo_bounds(p, 10, 15, -INFINITY, INFINITY);
    for (int k = 0; k < 6; k++) {
        double *start = zoo_start(p, 0);
        for (int32_t i = 0; i < 15; i++)
            start[i] = starts[k][i / 5];
    }
    p->scale = 1000;
}

/* Traffic on a k by k grid, to the four corners from everywhere: flows on the roads (right, left,
 * up, down of a node) by destination, and times to the destination. A road of capacity c takes t (1
 * + 0.15 (v/c)^4) (Bureau of Public Roads 1964). data: t, c of each road, demand of each node. */
enum { CORNERS = 4 };

static int32_t road_head(int32_t k, int32_t node, int32_t way)
{
    const int32_t a = node % k, b = node / k;
    const int32_t open[4] = {a + 1 < k, a > 0, b + 1 < k, b > 0};
    const int32_t head[4] = {node + 1, node - 1, node + k, node - k};
    return open[way] ? head[way] : -1;
}

static int32_t corner(int32_t k, int32_t d)
{
    return (d % 2 ? k - 1 : 0) + (d / 2 ? k * (k - 1) : 0);
}

static void road(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J, int32_t node,
                 int32_t way)
{
    const int32_t k = p->size, r = 4 * node + way, block = 5 * k * k;
    const int32_t head = road_head(k, node, way);
    double flow = 0, t = p->data[2 * r], c = p->data[2 * r + 1];
    for (int32_t d = 0; d < CORNERS; d++)
        flow += z[block * d + 5 * node + way];
    double s = flow / c, time = t * (1 + 0.15 * s * s * s * s), slope = t * 0.6 * s * s * s / c;
    for (int32_t d = 0; d < CORNERS; d++) {
        const int32_t i = block * d + 5 * node + way, tail = block * d + 5 * node + 4;
        const int32_t to = block * d + 5 * (head < 0 ? node : head) + 4;
        if (head < 0 || node == corner(k, d)) { /* no such road: no flow */
            F[i] = z[i] + 1;
            if (J)
                zoo_add(J, i, i, 1);
            continue;
        }
        F[i] = time + z[to] - z[tail];
        F[tail] += z[i];
        if (head != corner(k, d))
            F[to] -= z[i];
        if (!J)
            continue;
        for (int32_t e = 0; e < CORNERS; e++)
            zoo_add(J, i, block * e + 5 * node + way, slope);
        zoo_add(J, i, to, 1);
        zoo_add(J, i, tail, -1);
        zoo_add(J, tail, i, 1);
        if (head != corner(k, d))
            zoo_add(J, to, i, -1);
    }
}

static int32_t traffic(const zoo_problem *p, const double *z, double *F, zoo_jacobian *J)
{
    const int32_t k = p->size, nodes = k * k, block = 5 * nodes;
    for (int32_t d = 0; d < CORNERS; d++)
        for (int32_t node = 0; node < nodes; node++)
            F[block * d + 5 * node + 4] = -p->data[8 * nodes + node];
    for (int32_t node = 0; node < nodes; node++)
        for (int32_t way = 0; way < 4; way++)
            road(p, z, F, J, node, way);
    for (int32_t d = 0; d < CORNERS; d++) { /* the time to the corner from itself is 0 */
        const int32_t i = block * d + 5 * corner(k, d) + 4;
        F[i] = z[i];
        if (J)
            zoo_add(J, i, i, 1);
    }
    return 0;
}

static void build_traffic(zoo_problem *p, int32_t size)
{
    const int32_t k = (int32_t)floor(sqrt(size / (5.0 * CORNERS)) + 1e-9), nodes = k * k;
    uint64_t seed = 1956;
    zoo_size(p, 5 * CORNERS * nodes, traffic);
    p->size = k;
    p->sparse = 1;
    double *data = zoo_data(p, 9 * (size_t)nodes);
    for (int32_t r = 0; r < 4 * nodes; r++) {
        data[2 * r] = 1 + zoo_random(&seed);
        data[2 * r + 1] = 0.5 * nodes * (1 + zoo_random(&seed));
    }
    for (int32_t i = 0; i < nodes; i++)
        data[8 * nodes + i] = 0.5 + zoo_random(&seed);
    zoo_start(p, 0);
    zoo_start(p, 1);
    p->scale = nodes;
}

const zoo_entry zoo_networks[] = {
    {"transport", "Dantzig 1963 with reacting demand, as transmcp of GAMS", build_transport, 0, 0,
     ZOO_FAMILY, 0},
    {"three-countries", "Miranda & Fackler 2002, spatial equilibrium (linear)",
     build_three_countries, 0, 0, ZOO_ALL, 0},
    {"trade-ring", "in the manner of sppe and tobin of MCPLIB, generated", build_ring, 200, 10000,
     ZOO_UNIQUE, 0},
    {"two-rings", "in the manner of Bertsekas & Gafni 1982, coefficients and demands our own",
     build_two_rings, 0, 0, ZOO_UNKNOWN, 0},
    {"traffic-grid", "Wardrop 1952 on a generated grid, four destinations", build_traffic, 180,
     2000, ZOO_UNKNOWN, 0},
    {NULL, NULL, NULL, 0, 0, 0, 0},
};
