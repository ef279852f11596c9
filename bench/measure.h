/* measure.h: a clock, medians, random numbers, and what the machine itself can do. */
#ifndef BENCH_MEASURE_H
#define BENCH_MEASURE_H

#ifndef _POSIX_C_SOURCE
#define _POSIX_C_SOURCE 200809L
#endif

#include <perp/perp.h>

#include <dlfcn.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static inline double seconds_now(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static inline int compare_doubles(const void *left, const void *right)
{
    double a = *(const double *)left, b = *(const double *)right;
    return (a > b) - (a < b);
}

/* Sorts the array and returns its median. */
static inline double median(double *numbers, int count)
{
    qsort(numbers, (size_t)count, sizeof *numbers, compare_doubles);
    return count % 2 ? numbers[count / 2] : 0.5 * (numbers[count / 2 - 1] + numbers[count / 2]);
}

/* Ends a benchmark that can't go on. */
static inline void require(int good, const char *what)
{
    if (!good) {
        fprintf(stderr, "bench: %s\n", what);
        exit(1);
    }
}

static inline void *require_memory(size_t size)
{
    void *memory = malloc(size);
    require(memory != NULL, "not enough memory");
    return memory;
}

/* SplitMix64 (Steele, Lea & Flood 2014): the same numbers on every machine. */
static inline uint64_t random_bits(uint64_t *state)
{
    uint64_t x = *state += UINT64_C(0x9e3779b97f4a7c15);
    x = (x ^ (x >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ (x >> 27)) * UINT64_C(0x94d049bb133111eb);
    return x ^ (x >> 31);
}

/* In (-1, 1). */
static inline double random_number(uint64_t *state)
{
    return (double)(random_bits(state) >> 11) * 0x1p-52 - 1;
}

typedef void (*dgemm_function)(const char *, const char *, const int *, const int *, const int *,
                               const double *, const double *, const int *, const double *,
                               const int *, const double *, double *, const int *);

/* GFlop/s of the dgemm that perp is linked with, n = 600, best of fifteen; 0 if it has none. */
static inline double dgemm_speed(void)
{
    enum { N = 600 };
    const int n = N;
    const double one = 1, zero = 0;
    void *program = dlopen(NULL, RTLD_LAZY);
    void *address = program ? dlsym(program, "dgemm_") : NULL;
    dgemm_function dgemm;
    double best = 0;
    if (!address)
        return 0;
    memcpy(&dgemm, &address, sizeof dgemm);
    double *a = require_memory(3 * sizeof(double) * N * N), *b = a + N * N, *c = b + N * N;
    uint64_t seed = 1;
    for (int k = 0; k < 3 * N * N; k++)
        a[k] = random_number(&seed);
    for (int repeat = 0; repeat < 15; repeat++) {
        double start = seconds_now();
        dgemm("N", "N", &n, &n, &n, &one, a, &n, b, &n, &zero, c, &n);
        best = fmax(best, 2e-9 * N * N * N / (seconds_now() - start));
    }
    free(a);
    return best;
}

/* GB/s of a = b + s c on arrays of 32 MB, best of fifteen, one thread. */
static inline double triad_speed(void)
{
    enum { N = 4000000 };
    double *a = require_memory(3 * sizeof(double) * N), *b = a + N, *c = b + N, best = 0;
    volatile double kept = 0;
    for (int k = 0; k < 3 * N; k++)
        a[k] = k;
    for (int repeat = 0; repeat < 15; repeat++) {
        double start = seconds_now(), s = 1.0 / (repeat + 3);
        for (int k = 0; k < N; k++)
            a[k] = b[k] + s * c[k];
        best = fmax(best, 1e-9 * 3 * sizeof(double) * N / (seconds_now() - start));
        kept = a[N / 3];
    }
    (void)kept;
    free(a);
    return best;
}

/* One line that a table can be scaled by; returns GFlop/s of dgemm and GB/s of the triad. */
static inline void print_machine_speed(double *gflops, double *gbytes)
{
    *gflops = dgemm_speed();
    *gbytes = triad_speed();
    printf("perp %s; reference kernels of this run: dgemm ", perp_version_text());
    if (*gflops > 0)
        printf("%.1f GFlop/s", *gflops);
    else
        printf("not linked");
    printf(", triad %.1f GB/s\n", *gbytes);
}

#endif
