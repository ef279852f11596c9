#include "lcp/lemke/rows.h"

#include <float.h>
#include <math.h>

#include "linalg/lanes/vectors.h"

#define NAME(x) x##_one
#include "linalg/lanes/vector_one.h"
#include "lcp/lemke/rows_vector.h"
#include "linalg/lanes/vector_end.h"

#if PERP__X86
#define NAME(x) x##_avx512
#include "linalg/lanes/vector_avx512.h"
#include "lcp/lemke/rows_vector.h"
#include "linalg/lanes/vector_end.h"

#define NAME(x) x##_avx2
#include "linalg/lanes/vector_avx2.h"
#include "lcp/lemke/rows_vector.h"
#include "linalg/lanes/vector_end.h"
#endif

static const perp__row_kernels *const kernels[] = {
    &kernels_one,
#if PERP__X86
    &kernels_avx2,
    &kernels_avx512,
#endif
};

const perp__row_kernels *perp__row_kernels_number(int32_t number)
{
    const int32_t widest = (int32_t)perp__widest_vectors();

    return number >= 0 && number <= widest ? kernels[widest - number] : NULL;
}

const perp__row_kernels *perp__row_kernels_choose(void)
{
    return perp__row_kernels_number(0);
}
