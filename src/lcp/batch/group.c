#include "lcp/batch/group.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "lcp/active_set/active_set.h"
#include "linalg/doubled.h"
#include "linalg/lanes/multiversion.h"
#include "linalg/lanes/vectors.h"

/* Scaled numbers, rows and variables, that add up to no more than this need no care. */
#define PERP__BATCH_LARGE 0x1p24

#define TEMPLATE "lcp/batch/vector.h"
#include "linalg/lanes/each_set.h"

static const perp__batch_kernel *const kernels[] = {PERP__OF_EACH_SET(&kernel)};

const perp__batch_kernel *perp__batch_kernel_number(int32_t number)
{
    const int32_t widest = (int32_t)perp__widest_vectors();

    return number >= 0 && number <= widest ? kernels[widest - number] : NULL;
}

void perp__batch_group_layout(perp__arena *arena, void *object)
{
    perp__batch_group *g = object;
    const size_t row = (size_t)g->n * (size_t)g->width, all = row * (size_t)g->n;

    PERP__DOUBLES(arena, all, &g->M, &g->LU);
    PERP__DOUBLES(arena, row, &g->q, &g->lower, &g->upper, &g->z_unit, &g->w_unit, &g->size,
                  &g->norm, &g->active, &g->rest, &g->target, &g->change, &g->inverse, &g->z,
                  &g->high);
    PERP__DOUBLES(arena, (size_t)g->width, &g->tested, &g->own_residual);
}

/* Copies numbers, a stream a problem. */
PERP__KERNEL static void interleave_loops(size_t entries, size_t width, double *restrict into,
                                          const double *const *from)
{
    for (size_t i = 0; i < entries; i++)
        for (size_t k = 0; k < width; k++)
            into[i * width + k] = from[k][i];
}

/* Eight and four streams have loops of their own, which compilers unroll. */
static void interleave(size_t entries, int32_t width, double *into, const double *const *from)
{
    if (width == 8)
        interleave_loops(entries, 8, into, from);
    else if (width == 4)
        interleave_loops(entries, 4, into, from);
    else
        interleave_loops(entries, (size_t)width, into, from);
}

/* floor(log2 |value|) of a normal number; -1023 of 0 and of what is smaller. */
static int32_t binary_exponent(double value)
{
    uint64_t bits;

    memcpy(&bits, &value, sizeof bits);
    return (int32_t)(bits >> 52 & 0x7ff) - 1023;
}

static uint64_t bits_of_power(int32_t e)
{
    return (uint64_t)(e + 1023) << 52;
}

/* The units of the tested residual. Returns 0 where the kernel must leave the problem to a solver:
 * not every diagonal entry fixes its own scale, or a power of two is out of range. */
static int32_t read_units(const perp__batch_group *g, int32_t scaling, size_t lane)
{
    const size_t n = (size_t)g->n, width = (size_t)g->width;
    int32_t exponents[PERP__SMALL_LENGTH];
    int32_t omega = INT32_MIN, takes = 1;
    uint64_t twice; /* what omega^2 adds to the bits of a power of two */

    for (size_t i = 0; i < n; i++) {
        const double diagonal = g->M[(i * n + i) * width + lane];
        const double q = g->q[i * width + lane];
        /* as unit_diagonal of linalg/scale.c for normal numbers: their half exponents never reach
         * its limits */
        const int32_t twice_e = binary_exponent(diagonal) + 1, p = binary_exponent(q);
        const int32_t e = scaling ? -((twice_e - (twice_e & 1)) / 2) : 0;

        takes &= diagonal >= DBL_MIN && (p > -1023 || q == 0.0);
        exponents[i] = e;
        if (p > -1023 && p + e > omega)
            omega = p + e;
    }
    if (omega == INT32_MIN)
        omega = 0;
    takes &= omega > -480 && omega < 480; /* |e| <= 512 */
    omega = takes ? omega : 0;            /* a lane that is not taken runs along in units of 1 */
    twice = (uint64_t)(2 * omega) << 52;
    for (size_t i = 0; i < n; i++) {
        const uint64_t size = bits_of_power(takes ? exponents[i] + omega : 0);
        const uint64_t z_unit = 2 * bits_of_power(0) - size, w_unit = size - twice;

        memcpy(g->size + i * width + lane, &size, sizeof size);
        memcpy(g->z_unit + i * width + lane, &z_unit, sizeof z_unit);
        memcpy(g->w_unit + i * width + lane, &w_unit, sizeof w_unit);
    }
    return takes;
}

void perp__batch_group_read(perp__batch_group *group, const perp__batch_data *data, int64_t first,
                            int32_t *takes)
{
    const size_t n = (size_t)group->n, width = (size_t)group->width;
    const double *M[8] = {NULL}, *q[8] = {NULL};

    group->has_free = 0;
    group->most_rounds = data->max_iterations > 0 && data->max_iterations < PERP__CRASH_ROUNDS
                             ? data->max_iterations
                             : PERP__CRASH_ROUNDS;
    group->rests_at_zero = !data->stack.lower && !data->stack.upper;
    for (size_t i = 0; i < n * width && group->rests_at_zero; i++) {
        group->lower[i] = group->active[i] = group->rest[i] = 0.0;
        group->upper[i] = INFINITY;
    }
    for (size_t k = 0; k < width; k++) {
        const int64_t own_residual = first + (int64_t)k;
        const size_t problem =
            (size_t)(own_residual < data->stack.count ? own_residual : data->stack.count - 1);

        M[k] = data->stack.M + problem * n * n;
        q[k] = data->stack.q + problem * n;
        /* z starts at its lower bound, else at its upper one; where it has neither, it is active */
        for (size_t i = 0; i < n && !group->rests_at_zero; i++) {
            const double low = data->stack.lower ? data->stack.lower[problem * n + i] : 0.0;
            const double up = data->stack.upper ? data->stack.upper[problem * n + i] : INFINITY;
            const int32_t is_free = low == -INFINITY && up == INFINITY;

            group->has_free |= is_free;
            group->lower[i * width + k] = low;
            group->upper[i * width + k] = up;
            group->active[i * width + k] = is_free;
            group->rest[i * width + k] = is_free ? 0.0 : low > -INFINITY ? low : up;
        }
    }
    interleave(n * n, group->width, group->M, M);
    interleave(n, group->width, group->q, q);
    for (int32_t k = 0; k < group->width; k++)
        takes[k] = read_units(group, data->scaling, (size_t)k);
}
