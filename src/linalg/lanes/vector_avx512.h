/* Vectors of 8 doubles, for the templates that linalg/lanes/vectors.h tells of. */
#define TARGET __attribute__((target("avx512f,avx2,fma")))
#define LANES 8
#define lanes __m512d
#define load _mm512_loadu_pd
#define store _mm512_storeu_pd
#define spread _mm512_set1_pd
#define minus_product(c, a, b) _mm512_sub_pd((c), _mm512_mul_pd((a), (b)))
#define plus_fused(c, a, b) _mm512_fmadd_pd((a), (b), (c))
#define root _mm512_sqrt_pd
#define minus_fused(c, a, b) _mm512_fnmadd_pd((a), (b), (c))
#define add _mm512_add_pd
#define subtract _mm512_sub_pd
#define multiply _mm512_mul_pd
#define divide _mm512_div_pd
#define absolute _mm512_abs_pd
#define larger _mm512_max_pd
#define smaller _mm512_min_pd
#define largest_of _mm512_reduce_max_pd
#define smallest_of _mm512_reduce_min_pd
#define first_of(t) __builtin_ctz((unsigned)(t))
#define bits_of(t) (unsigned)(t)
#define truth __mmask8
#define less(a, b) _mm512_cmp_pd_mask((a), (b), _CMP_LT_OQ)
#define at_most(a, b) _mm512_cmp_pd_mask((a), (b), _CMP_LE_OQ)
#define both(t, u) ((__mmask8)((t) & (u)))
#define any_of(t) ((t) != 0)
#define all_of(t) ((t) == 0xff)
#define pick(t, a, b) _mm512_mask_blend_pd((t), (b), (a))
#define prefetch(at) _mm_prefetch((const char *)(at), _MM_HINT_T1)
#define EIGHT_DOUBLES(X) X(0)
