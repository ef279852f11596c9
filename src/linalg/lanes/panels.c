#include "linalg/lanes/panels.h"

#include <math.h>

#include "linalg/lanes/vectors.h"

#define COLUMNS(X) X(0) X(1) X(2) X(3) X(4) X(5)
#include "linalg/lanes/vector_one.h"

#define NAME(x) x##_any
#define FUSED 0
#include "linalg/lanes/panels_vector.h"

#ifdef FP_FAST_FMA
#define NAME(x) x##_any_fused
#define FUSED 1
#include "linalg/lanes/panels_vector.h"
#endif

#include "linalg/lanes/vector_end.h"
#undef COLUMNS

#if PERP__X86

#define COLUMNS(X) X(0) X(1) X(2) X(3) X(4) X(5) X(6) X(7) X(8) X(9) X(10) X(11)
#include "linalg/lanes/vector_avx512.h"

#define NAME(x) x##_avx512
#define FUSED 0
#include "linalg/lanes/panels_vector.h"

#define NAME(x) x##_avx512_fused
#define FUSED 1
#include "linalg/lanes/panels_vector.h"

#include "linalg/lanes/vector_end.h"
#undef COLUMNS

#define COLUMNS(X) X(0) X(1) X(2) X(3) X(4) X(5)
#include "linalg/lanes/vector_avx2.h"

#define NAME(x) x##_avx2
#define FUSED 0
#include "linalg/lanes/panels_vector.h"

#define NAME(x) x##_avx2_fused
#define FUSED 1
#include "linalg/lanes/panels_vector.h"

#include "linalg/lanes/vector_end.h"
#undef COLUMNS

#endif

/* Fastest first; both arithmetics for each instruction set. */
int32_t perp__panel_kernels_find(const perp__panel_kernels **found)
{
    int32_t count = 0;

#if PERP__X86
    if (perp__widest_vectors() >= PERP__VECTOR_AVX512) {
        found[count++] = &kernels_avx512_fused;
        found[count++] = &kernels_avx512;
    }
    if (perp__widest_vectors() >= PERP__VECTOR_AVX2) {
        found[count++] = &kernels_avx2_fused;
        found[count++] = &kernels_avx2;
    }
#endif
#ifdef FP_FAST_FMA
    found[count++] = &kernels_any_fused;
#endif
    found[count++] = &kernels_any;
    return count;
}

const perp__panel_kernels *perp__panel_kernels_choose(int32_t fused)
{
    const perp__panel_kernels *found[PERP__PANEL_KERNELS_MOST];
    const int32_t count = perp__panel_kernels_find(found);

    for (int32_t k = 0; k < count; k++)
        if (found[k]->fused == fused)
            return found[k];
    return found[count - 1];
}
