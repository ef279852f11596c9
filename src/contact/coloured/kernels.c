/* The passes, compiled for each set of instructions. */
#include <math.h>
#include <string.h>

#include "contact/coloured/coloured.h"
#include "linalg/lanes/multiversion.h"
#include "linalg/lanes/vectors.h"

#define TEMPLATE "contact/coloured/kernel.h"
#include "linalg/lanes/each_set.h"

int32_t perp__coloured_find_kernels(const perp__coloured_kernels **found)
{
    static const perp__coloured_kernels *const sets[] = {PERP__OF_EACH_SET(&kernels)};
    const int32_t widest = (int32_t)perp__widest_vectors();

    for (int32_t k = 0; k <= widest; k++)
        found[k] = sets[widest - k];
    return widest + 1;
}
