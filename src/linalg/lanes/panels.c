#include "linalg/lanes/panels.h"

#include <math.h>

#include "linalg/lanes/vectors.h"

#define TEMPLATE "linalg/lanes/panels_vector.h"
#include "linalg/lanes/each_set.h"

static const perp__panel_kernels *const kernels[] = {PERP__OF_EACH_SET(&kernels)};

const perp__panel_kernels *perp__panel_kernels_number(int32_t number)
{
    const int32_t widest = (int32_t)perp__widest_vectors();

    return number >= 0 && number <= widest ? kernels[widest - number] : NULL;
}
