/* Kernels in terms of vectors, written once and compiled for each instruction set. A template, a
 * header of functions NAME(x), is included after one of
 *   linalg/lanes/vector_avx512.h, vector_avx2.h (PERP__X86 only), vector_one.h (any processor)
 * and before linalg/lanes/vector_end.h, or for all of them by linalg/lanes/each_set.h. It gets
 *   lanes, a vector of LANES doubles; load, store, spread (of one double); add, subtract, multiply,
 *   divide, absolute; larger, smaller (b where a is NaN); largest_of, smallest_of (no NaN);
 * minus_product(c, a, b) = c - a b, and minus_fused and plus_fused, rounded once; root, the square
 * root; truth, a vector of truths; less, at_most, both, any_of, all_of, first_of, bits_of;
 * pick(t, a, b), a where t; EIGHT_DOUBLES(X), X(0) X(1) ... for the vectors of 8 doubles;
 * prefetch(at), a hint; TARGET, the attribute of its functions. Each is rounded as IEEE 754 says:
 * the bits don't depend on the set. */
#ifndef PERP_LINALG_VECTORS_H
#define PERP_LINALG_VECTORS_H

#include <stdint.h>

#if defined(__GNUC__) && defined(__x86_64__)
#define PERP__X86 1
#include <immintrin.h>
#else
#define PERP__X86 0
#endif

#if PERP__X86
__attribute__((target("avx2"))) static inline double perp__largest_of_4(__m256d a)
{
    const __m128d two = _mm_max_pd(_mm256_castpd256_pd128(a), _mm256_extractf128_pd(a, 1));

    return _mm_cvtsd_f64(_mm_max_sd(two, _mm_unpackhi_pd(two, two)));
}

__attribute__((target("avx2"))) static inline double perp__smallest_of_4(__m256d a)
{
    const __m128d two = _mm_min_pd(_mm256_castpd256_pd128(a), _mm256_extractf128_pd(a, 1));

    return _mm_cvtsd_f64(_mm_min_sd(two, _mm_unpackhi_pd(two, two)));
}
#endif

/* The lowest and the highest of bits that are not all 0. */
static inline size_t perp__lowest_bit(unsigned bits)
{
#if defined(__GNUC__)
    return (size_t)__builtin_ctz(bits);
#else
    return bits & 1 ? 0 : 1 + perp__lowest_bit(bits >> 1);
#endif
}

static inline size_t perp__highest_bit(unsigned bits)
{
#if defined(__GNUC__)
    return 8 * sizeof bits - 1 - (size_t)__builtin_clz(bits);
#else
    return bits < 2 ? 0 : 1 + perp__highest_bit(bits >> 1);
#endif
}

enum perp__vector_set { PERP__VECTOR_ONE, PERP__VECTOR_AVX2, PERP__VECTOR_AVX512 };

/* The widest vectors of this processor. */
static inline enum perp__vector_set perp__widest_vectors(void)
{
#if PERP__X86
    if (__builtin_cpu_supports("avx512f"))
        return PERP__VECTOR_AVX512;
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        return PERP__VECTOR_AVX2;
#endif
    return PERP__VECTOR_ONE;
}

#endif
