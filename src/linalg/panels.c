#include "linalg/panels.h"

#include <math.h>

#define NAME(x) x##_any
#define FUSED 0
#define minus_one(c, a, b) ((c) - (a) * (b))
#include "linalg/panels_any.h"

#ifdef FP_FAST_FMA
#define NAME(x) x##_any_fused
#define FUSED 1
#define minus_one(c, a, b) fma(-(a), (b), (c))
#include "linalg/panels_any.h"
#endif

#if defined(__GNUC__) && defined(__x86_64__)

#include <immintrin.h>

#define SET "avx512"
#define TARGET __attribute__((target("avx512f,avx2,fma")))
#define lanes __m512d
#define LANES 8
#define load _mm512_loadu_pd
#define store _mm512_storeu_pd
#define spread _mm512_set1_pd
#define COLUMNS(X) X(0) X(1) X(2) X(3) X(4) X(5) X(6) X(7) X(8) X(9) X(10) X(11)

#define NAME(x) x##_avx512
#define FUSED 0
#define minus(c, a, b) _mm512_sub_pd((c), _mm512_mul_pd((a), (b)))
#define minus_one(c, a, b) ((c) - (a) * (b))
#include "linalg/panels_vector.h"

#define NAME(x) x##_avx512_fused
#define FUSED 1
#define minus(c, a, b) _mm512_fnmadd_pd((a), (b), (c))
#define minus_one(c, a, b) fma(-(a), (b), (c))
#include "linalg/panels_vector.h"

#undef SET
#undef TARGET
#undef lanes
#undef LANES
#undef load
#undef store
#undef spread
#undef COLUMNS

#define SET "avx2"
#define TARGET __attribute__((target("avx2,fma")))
#define lanes __m256d
#define LANES 4
#define load _mm256_loadu_pd
#define store _mm256_storeu_pd
#define spread _mm256_set1_pd
#define COLUMNS(X) X(0) X(1) X(2) X(3) X(4) X(5)

#define NAME(x) x##_avx2
#define FUSED 0
#define minus(c, a, b) _mm256_sub_pd((c), _mm256_mul_pd((a), (b)))
#define minus_one(c, a, b) ((c) - (a) * (b))
#include "linalg/panels_vector.h"

#define NAME(x) x##_avx2_fused
#define FUSED 1
#define minus(c, a, b) _mm256_fnmadd_pd((a), (b), (c))
#define minus_one(c, a, b) fma(-(a), (b), (c))
#include "linalg/panels_vector.h"

#endif

enum { MOST = 6 };

/* Fastest first; both arithmetics for each instruction set. */
static int32_t find(const perp__panel_kernels **found)
{
    int32_t count = 0;

#if defined(__GNUC__) && defined(__x86_64__)
    if (__builtin_cpu_supports("avx512f")) {
        found[count++] = &kernels_avx512_fused;
        found[count++] = &kernels_avx512;
    }
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
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

const perp__panel_kernels *perp__panel_kernels_number(int32_t number)
{
    const perp__panel_kernels *found[MOST];

    return number >= 0 && number < find(found) ? found[number] : NULL;
}

const perp__panel_kernels *perp__panel_kernels_choose(int32_t fused)
{
    const perp__panel_kernels *found[MOST];
    const int32_t count = find(found);
    int32_t k;

    for (k = 0; k < count; k++)
        if (found[k]->fused == fused)
            return found[k];
    return found[count - 1];
}
