#include "lcp/lemke/rows.h"

#include <float.h>
#include <math.h>

#include "linalg/lanes/vectors.h"

#define TEMPLATE "lcp/lemke/rows_vector.h"
#include "linalg/lanes/each_set.h"

static const perp__row_kernels *const kernels[] = {PERP__OF_EACH_SET(&kernels)};

const perp__row_kernels *perp__row_kernels_number(int32_t number)
{
    const int32_t widest = (int32_t)perp__widest_vectors();

    return number >= 0 && number <= widest ? kernels[widest - number] : NULL;
}

const perp__row_kernels *perp__row_kernels_choose(void)
{
    return perp__row_kernels_number(0);
}
