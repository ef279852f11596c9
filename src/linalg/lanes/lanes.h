/* Four doubles in one vector register, for kernels in which the compiler finds no vectors by
 * itself. GNU C vectors (gcc, clang): plain C operators, one IEEE operation a lane, the same bits
 * whatever the processor makes of them. Only through variables and pointers: a vector as an
 * argument would change the calling convention with the processor. */
#ifndef PERP_LINALG_LANES_H
#define PERP_LINALG_LANES_H

#include <math.h>
#include <stdint.h>

#include "linalg/lanes/multiversion.h"

/* At any address, beside any other type. */
typedef double perp__lanes __attribute__((vector_size(32), aligned(8), may_alias));
typedef int64_t perp__lane_bits __attribute__((vector_size(32), aligned(8), may_alias));

/* The four doubles from p on, to read or to write. */
#define PERP__LANES_AT(p) (*(perp__lanes *)(p))
#define PERP__CONST_LANES_AT(p) (*(const perp__lanes *)(p))

#define PERP__SAME_LANES(x) ((perp__lanes){(x), (x), (x), (x)})

/* Two doubles: what four leave of six. */
typedef double perp__lane_pair __attribute__((vector_size(16), aligned(8), may_alias));

#define PERP__PAIR_AT(p) (*(perp__lane_pair *)(p))
#define PERP__CONST_PAIR_AT(p) (*(const perp__lane_pair *)(p))

/* where ? a : b, lane by lane; `where` is the result of a comparison. */
#define PERP__SELECT_LANES(where, a, b)                                \
    ((perp__lanes)(((perp__lane_bits)(where) & (perp__lane_bits)(a)) | \
                   (~(perp__lane_bits)(where) & (perp__lane_bits)(b))))

#define PERP__ABSOLUTE_LANES(a)           \
    ((perp__lanes)((perp__lane_bits)(a) & \
                   (perp__lane_bits){INT64_MAX, INT64_MAX, INT64_MAX, INT64_MAX}))

/* The roots of all four. The compiler finds that this is one instruction. */
#define PERP__ROOT_LANES(x) ((perp__lanes){sqrt((x)[0]), sqrt((x)[1]), sqrt((x)[2]), sqrt((x)[3])})

/* Inside of an if: keeps the branch where the compiler would take the minimum of two numbers, and
 * wait for it. A branch is predicted. */
#define PERP__KEEP_BRANCH() __asm__ volatile("")

/* sum_k a_k b_k in the turns of two lanes: for kernels. */
PERP__KERNEL static double perp__lanes_dot(const double *a, const double *b, int32_t n)
{
    perp__lanes even = {0.0}, odd = {0.0};
    double rest = 0.0;
    int32_t i = 0;

    for (; i + 8 <= n; i += 8) {
        even += PERP__CONST_LANES_AT(a + i) * PERP__CONST_LANES_AT(b + i);
        odd += PERP__CONST_LANES_AT(a + i + 4) * PERP__CONST_LANES_AT(b + i + 4);
    }
    for (; i < n; i++)
        rest += a[i] * b[i];
    even += odd;
    return ((even[0] + even[1]) + (even[2] + even[3])) + rest;
}

#endif
