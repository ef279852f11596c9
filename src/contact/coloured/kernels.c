/* The passes, compiled for each set of instructions. */
#include <math.h>
#include <string.h>

#include "contact/coloured/coloured.h"
#include "linalg/lanes/multiversion.h"
#include "linalg/lanes/vectors.h"

#if PERP__X86

#include "linalg/lanes/vector_avx512.h"
#define NAME(x) x##_avx512
#include "contact/coloured/kernel.h"
static const perp__coloured_kernels kernels_avx512 = {pass_avx512, invert_avx512, measure_avx512};
#undef NAME
#include "linalg/lanes/vector_end.h"

#include "linalg/lanes/vector_avx2.h"
#define NAME(x) x##_avx2
#include "contact/coloured/kernel.h"
static const perp__coloured_kernels kernels_avx2 = {pass_avx2, invert_avx2, measure_avx2};
#undef NAME
#include "linalg/lanes/vector_end.h"

#endif

#include "linalg/lanes/vector_one.h"
#define NAME(x) x##_any
#include "contact/coloured/kernel.h"
static const perp__coloured_kernels kernels_any = {pass_any, invert_any, measure_any};
#undef NAME
#include "linalg/lanes/vector_end.h"

int32_t perp__coloured_find_kernels(const perp__coloured_kernels **found)
{
    int32_t count = 0;

#if PERP__X86
    if (perp__widest_vectors() >= PERP__VECTOR_AVX512)
        found[count++] = &kernels_avx512;
    if (perp__widest_vectors() >= PERP__VECTOR_AVX2)
        found[count++] = &kernels_avx2;
#endif
    found[count++] = &kernels_any;
    return count;
}
