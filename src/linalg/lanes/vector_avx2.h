/* Vectors of 4 doubles, for the templates that linalg/lanes/vectors.h tells of. */
#define TARGET __attribute__((target("avx2,fma")))
#define LANES 4
#define lanes __m256d
#define load _mm256_loadu_pd
#define store _mm256_storeu_pd
#define spread _mm256_set1_pd
#define minus_product(c, a, b) _mm256_sub_pd((c), _mm256_mul_pd((a), (b)))
#define plus_fused(c, a, b) _mm256_fmadd_pd((a), (b), (c))
#define root _mm256_sqrt_pd
#define minus_fused(c, a, b) _mm256_fnmadd_pd((a), (b), (c))
#define add _mm256_add_pd
#define subtract _mm256_sub_pd
#define multiply _mm256_mul_pd
#define divide _mm256_div_pd
#define absolute(a) _mm256_andnot_pd(_mm256_set1_pd(-0.0), (a))
#define larger _mm256_max_pd
#define smaller _mm256_min_pd
#define largest_of perp__largest_of_4
#define smallest_of perp__smallest_of_4
#define first_of(t) __builtin_ctz((unsigned)_mm256_movemask_pd(t))
#define bits_of(t) (unsigned)_mm256_movemask_pd(t)
#define truth __m256d
#define less(a, b) _mm256_cmp_pd((a), (b), _CMP_LT_OQ)
#define at_most(a, b) _mm256_cmp_pd((a), (b), _CMP_LE_OQ)
#define both _mm256_and_pd
#define any_of(t) (_mm256_movemask_pd(t) != 0)
#define all_of(t) (_mm256_movemask_pd(t) == 0xf)
#define pick(t, a, b) _mm256_blendv_pd((b), (a), (t))
#define prefetch(at) _mm_prefetch((const char *)(at), _MM_HINT_T1)
#define EIGHT_DOUBLES(X) X(0) X(1)
