/* More programs of Hock & Schittkowski 1981, small ones. The solutions are closed forms but for 11
 * and 65: Newton's method in 40 digits. */
#include "problems_polynomial.h"

static const term hs10_terms[] = {
    {0, 1, 1, 1, 0, {0}},  {0, -1, 2, 1, 0, {0}}, {1, -3, 1, 2, 0, {0}}, {1, 2, 1, 1, 0, {2}},
    {1, -1, 2, 2, 0, {0}}, {1, 1, 0, 0, 0, {0}},  {0, 0, 0, 0, 0, {0}}};
static const program hs10 = {2, 1, 0, hs10_terms};
static const term hs11_terms[] = {{0, 1, 1, 2, 5, {0}},
                                  {0, 1, 2, 2, 0, {0}},
                                  {1, 1, 2, 1, 0, {0}},
                                  {1, -1, 1, 2, 0, {0}},
                                  {0, 0, 0, 0, 0, {0}}};
static const program hs11 = {2, 1, 0, hs11_terms};
static const term hs12_terms[] = {
    {0, 0.5, 1, 2, 0, {0}}, {0, 1, 2, 2, 0, {0}},  {0, -1, 1, 1, 0, {2}},
    {0, -7, 1, 1, 0, {0}},  {0, -7, 2, 1, 0, {0}}, {1, 25, 0, 0, 0, {0}},
    {1, -4, 1, 2, 0, {0}},  {1, -1, 2, 2, 0, {0}}, {0, 0, 0, 0, 0, {0}}};
static const program hs12 = {2, 1, 0, hs12_terms};
static const term hs22_terms[] = {
    {0, 1, 1, 2, 2, {0}},  {0, 1, 2, 2, 1, {0}}, {1, 2, 0, 0, 0, {0}},  {1, -1, 1, 1, 0, {0}},
    {1, -1, 2, 1, 0, {0}}, {2, 1, 2, 1, 0, {0}}, {2, -1, 1, 2, 0, {0}}, {0, 0, 0, 0, 0, {0}}};
static const program hs22 = {2, 2, 0, hs22_terms};
static const term hs29_terms[] = {{0, -1, 1, 1, 0, {2, 3}}, {1, 48, 0, 0, 0, {0}},
                                  {1, -1, 1, 2, 0, {0}},    {1, -2, 2, 2, 0, {0}},
                                  {1, -4, 3, 2, 0, {0}},    {0, 0, 0, 0, 0, {0}}};
static const program hs29 = {3, 1, 0, hs29_terms};
static const term hs31_terms[] = {{0, 9, 1, 2, 0, {0}},  {0, 1, 2, 2, 0, {0}},
                                  {0, 9, 3, 2, 0, {0}},  {1, 1, 1, 1, 0, {2}},
                                  {1, -1, 0, 0, 0, {0}}, {0, 0, 0, 0, 0, {0}}};
static const program hs31 = {3, 1, 0, hs31_terms};
static const term hs33_terms[] = {
    {0, 1, 1, 3, 0, {0}}, {0, -6, 1, 2, 0, {0}}, {0, 11, 1, 1, 0, {0}}, {0, 1, 3, 1, 0, {0}},
    {1, 1, 3, 2, 0, {0}}, {1, -1, 2, 2, 0, {0}}, {1, -1, 1, 2, 0, {0}}, {2, 1, 1, 2, 0, {0}},
    {2, 1, 2, 2, 0, {0}}, {2, 1, 3, 2, 0, {0}},  {2, -4, 0, 0, 0, {0}}, {0, 0, 0, 0, 0, {0}}};
static const program hs33 = {3, 2, 0, hs33_terms};
static const term hs37_terms[] = {
    {0, -1, 1, 1, 0, {2, 3}}, {1, 72, 0, 0, 0, {0}}, {1, -1, 1, 1, 0, {0}},
    {1, -2, 2, 1, 0, {0}},    {1, -2, 3, 1, 0, {0}}, {2, 1, 1, 1, 0, {0}},
    {2, 2, 2, 1, 0, {0}},     {2, 2, 3, 1, 0, {0}},  {0, 0, 0, 0, 0, {0}}};
static const program hs37 = {3, 2, 0, hs37_terms};
static const term hs44_terms[] = {
    {0, 1, 1, 1, 0, {0}},  {0, -1, 2, 1, 0, {0}}, {0, -1, 3, 1, 0, {0}}, {0, -1, 1, 1, 0, {3}},
    {0, 1, 1, 1, 0, {4}},  {0, 1, 2, 1, 0, {3}},  {0, -1, 2, 1, 0, {4}}, {1, 8, 0, 0, 0, {0}},
    {1, -1, 1, 1, 0, {0}}, {1, -2, 2, 1, 0, {0}}, {2, 12, 0, 0, 0, {0}}, {2, -4, 1, 1, 0, {0}},
    {2, -1, 2, 1, 0, {0}}, {3, 12, 0, 0, 0, {0}}, {3, -3, 1, 1, 0, {0}}, {3, -4, 2, 1, 0, {0}},
    {4, 8, 0, 0, 0, {0}},  {4, -2, 3, 1, 0, {0}}, {4, -1, 4, 1, 0, {0}}, {5, 8, 0, 0, 0, {0}},
    {5, -1, 3, 1, 0, {0}}, {5, -2, 4, 1, 0, {0}}, {6, 5, 0, 0, 0, {0}},  {6, -1, 3, 1, 0, {0}},
    {6, -1, 4, 1, 0, {0}}, {0, 0, 0, 0, 0, {0}}};
static const program hs44 = {4, 6, 0, hs44_terms};
static const term hs65_terms[] = {
    {0, 10.0 / 9, 1, 2, 0, {0}},  {0, 10.0 / 9, 2, 2, 0, {0}},  {0, -16.0 / 9, 1, 1, 0, {2}},
    {0, -20.0 / 9, 1, 1, 0, {0}}, {0, -20.0 / 9, 2, 1, 0, {0}}, {0, 1, 3, 2, 5, {0}},
    {1, 48, 0, 0, 0, {0}},        {1, -1, 1, 2, 0, {0}},        {1, -1, 2, 2, 0, {0}},
    {1, -1, 3, 2, 0, {0}},        {0, 0, 0, 0, 0, {0}}};
static const program hs65 = {3, 1, 0, hs65_terms};

static void build_hs10(zoo_problem *p, int32_t size)
{
    (void)size;
    zoo_polynomial(p, &hs10, (double[]){-10, 10}, (double[]){0, 1, 0.5});
    p->scale = 1;
}

static void build_hs11(zoo_problem *p, int32_t size)
{
    (void)size;
    zoo_polynomial(p, &hs11, (double[]){4.9, 0.1},
                   (double[]){1.234772825053297, 1.52466392949, 3.04932785898});
    p->scale = 10;
}

static void build_hs12(zoo_problem *p, int32_t size)
{
    (void)size;
    zoo_polynomial(p, &hs12, (double[]){0, 0}, (double[]){2, 3, 0.5});
    p->scale = 10;
}

static void build_hs22(zoo_problem *p, int32_t size)
{
    (void)size;
    zoo_polynomial(p, &hs22, (double[]){2, 2}, (double[]){1, 1, 2.0 / 3, 2.0 / 3});
    p->scale = 1;
}

static void build_hs29(zoo_problem *p, int32_t size)
{
    (void)size;
    zoo_polynomial(p, &hs29, (double[]){1, 1, 1}, (double[]){4, 2 * sqrt(2), 2, sqrt(0.5)});
    p->scale = 10;
}

static void build_hs31(zoo_problem *p, int32_t size)
{
    (void)size;
    zoo_polynomial(p, &hs31, (double[]){1, 1, 1}, (double[]){1 / sqrt(3), sqrt(3), 0, 6});
    zoo_bounds(p, 0, 1, -10, 10);
    zoo_bounds(p, 1, 2, 1, 10);
    zoo_bounds(p, 2, 3, -10, 1);
    p->scale = 10;
}

static void build_hs33(zoo_problem *p, int32_t size)
{
    (void)size;
    zoo_polynomial(p, &hs33, (double[]){0, 0, 3},
                   (double[]){0, sqrt(2), sqrt(2), sqrt(2) / 8, sqrt(2) / 8});
    zoo_bounds(p, 0, 2, 0, INFINITY);
    zoo_bounds(p, 2, 3, 0, 5);
    p->scale = 10;
}

static void build_hs37(zoo_problem *p, int32_t size)
{
    (void)size;
    zoo_polynomial(p, &hs37, (double[]){10, 10, 10}, (double[]){24, 12, 12, 144, 0});
    zoo_bounds(p, 0, 3, 0, 42);
    p->scale = 300;
}

static void build_hs44(zoo_problem *p, int32_t size)
{
    (void)size;
    zoo_polynomial(p, &hs44, (double[]){0, 0, 0, 0}, (double[]){0, 3, 0, 4, 0, 0, 1.25, 0, 1.5, 0});
    zoo_bounds(p, 0, 4, 0, INFINITY);
    p->scale = 10;
}

static void build_hs65(zoo_problem *p, int32_t size)
{
    (void)size;
    zoo_polynomial(p, &hs65, (double[]){-4.5, 4.5, 0},
                   (double[]){3.6504617252130363, 3.6504617252130363, 4.6204175553200086,
                              0.082153277303462593});
    zoo_bounds(p, 0, 2, -4.5, 4.5);
    zoo_bounds(p, 2, 3, -5, 5);
    p->scale = 10;
}

const zoo_entry zoo_more_programs[] = {
    {"hs10", "Hock & Schittkowski 10", build_hs10, 0, 0, ZOO_ALL, 0},
    {"hs11", "Hock & Schittkowski 11", build_hs11, 0, 0, ZOO_ALL, 0},
    {"hs12", "Hock & Schittkowski 12", build_hs12, 0, 0, ZOO_ALL, 0},
    {"hs22", "Hock & Schittkowski 22", build_hs22, 0, 0, ZOO_ALL, 0},
    {"hs29", "Hock & Schittkowski 29", build_hs29, 0, 0, ZOO_SOME, 0},
    {"hs31", "Hock & Schittkowski 31", build_hs31, 0, 0, ZOO_SOME, 0},
    {"hs33", "Hock & Schittkowski 33", build_hs33, 0, 0, ZOO_SOME, 0},
    {"hs37", "Hock & Schittkowski 37", build_hs37, 0, 0, ZOO_SOME, 0},
    {"hs44", "Hock & Schittkowski 44 (not convex)", build_hs44, 0, 0, ZOO_SOME, 0},
    {"hs65", "Hock & Schittkowski 65", build_hs65, 0, 0, ZOO_ALL, 0},
    {NULL, NULL, NULL, 0, 0, 0, 0},
};
