/* What every generator stands on: random numbers (splitmix64: Steele, Lea & Flood 2014) and memory.
 * Free of the test framework, so that benchmarks can generate too. */
#include "gen.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void gen_seed(gen_random *random, uint64_t seed)
{
    random->state = seed;
}

uint64_t gen_bits(gen_random *random)
{
    uint64_t x = random->state += UINT64_C(0x9e3779b97f4a7c15);

    x = (x ^ (x >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ (x >> 27)) * UINT64_C(0x94d049bb133111eb);
    return x ^ (x >> 31);
}

double gen_uniform(gen_random *random, double low, double high)
{
    return low + (high - low) * ((double)(gen_bits(random) >> 11) * 0x1p-53);
}

double gen_normal(gen_random *random)
{
    double sum = -6.0;
    int k;

    for (k = 0; k < 12; k++)
        sum += gen_uniform(random, 0.0, 1.0);
    return sum;
}

int32_t gen_integer(gen_random *random, int32_t count)
{
    return (int32_t)(gen_bits(random) % (uint64_t)count);
}

double gen_dyadic(gen_random *random, int32_t limit)
{
    return (double)(gen_integer(random, 32 * limit + 1) - 16 * limit) / 16.0;
}

void *gen_allocate(size_t count, size_t size)
{
    void *memory = calloc(count ? count : 1, size);

    if (!memory) {
        fprintf(stderr, "no memory for a generated problem\n");
        abort();
    }
    return memory;
}

void gen_destroy(gen_lcp *problem)
{
    free(problem->M);
    free(problem->column_starts);
    free(problem->row_indices);
    free(problem->values);
    free(problem->q);
    free(problem->lower);
    free(problem->upper);
    free(problem->z);
    free(problem->w);
    memset(problem, 0, sizeof *problem);
}

void gen_begin(gen_lcp *problem, int32_t n)
{
    size_t count = (size_t)n;

    memset(problem, 0, sizeof *problem);
    problem->n = n;
    problem->q = gen_allocate(count, sizeof(double));
    problem->z = gen_allocate(count, sizeof(double));
    problem->w = gen_allocate(count, sizeof(double));
}

void gen_begin_dense(gen_lcp *problem, int32_t n)
{
    gen_begin(problem, n);
    problem->M = gen_allocate((size_t)n * (size_t)n, sizeof(double));
    if (perp_struct_init(&problem->view, sizeof problem->view) != PERP_OK ||
        perp_matrix_dense(&problem->view, PERP_STORAGE_ROW_MAJOR, n, n, problem->M,
                          n > 0 ? n : 1) != PERP_OK)
        abort();
}

void gen_rotation(gen_random *random, int32_t planar, double R[3][3])
{
    double a[4], length = 0.0;
    int k;

    for (k = 0; k < 4; k++) {
        a[k] = planar && (k == 1 || k == 2) ? 0.0 : gen_normal(random);
        length += a[k] * a[k];
    }
    for (k = 0; k < 4; k++)
        a[k] /= sqrt(length);
    R[0][0] = 1 - 2 * (a[2] * a[2] + a[3] * a[3]);
    R[0][1] = 2 * (a[1] * a[2] - a[0] * a[3]);
    R[0][2] = 2 * (a[1] * a[3] + a[0] * a[2]);
    R[1][0] = 2 * (a[1] * a[2] + a[0] * a[3]);
    R[1][1] = 1 - 2 * (a[1] * a[1] + a[3] * a[3]);
    R[1][2] = 2 * (a[2] * a[3] - a[0] * a[1]);
    R[2][0] = 2 * (a[1] * a[3] - a[0] * a[2]);
    R[2][1] = 2 * (a[2] * a[3] + a[0] * a[1]);
    R[2][2] = 1 - 2 * (a[1] * a[1] + a[2] * a[2]);
}

void gen_turn(double R[3][3], double x[3])
{
    double y[3];
    int k;

    for (k = 0; k < 3; k++)
        y[k] = R[k][0] * x[0] + R[k][1] * x[1] + R[k][2] * x[2];
    memcpy(x, y, sizeof y);
}
