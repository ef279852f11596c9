#include "linalg/kept_factor.h"

#include <string.h>

#include "base/context.h"

static int32_t is_analysed(const perp__kept_factor *kept, const perp__factor_type *type,
                           const perp__square *A)
{
    size_t starts = (size_t)A->n + 1;

    if (!kept->factor || kept->type != type || kept->n != A->n)
        return 0;
    return !A->column_starts ||
           (!memcmp(kept->pattern, A->column_starts, starts * sizeof(int32_t)) &&
            !memcmp(kept->pattern + starts, A->row_indices,
                    (size_t)A->column_starts[A->n] * sizeof(int32_t)));
}

static perp_status keep_pattern(perp__kept_factor *kept, const perp__square *A)
{
    size_t starts = (size_t)A->n + 1;
    size_t entries = (size_t)A->column_starts[A->n];

    kept->pattern = perp__allocate(kept->context, starts + entries, sizeof(int32_t));
    if (!kept->pattern)
        return perp__fail_memory(kept->context, "a sparse pattern");
    memcpy(kept->pattern, A->column_starts, starts * sizeof(int32_t));
    memcpy(kept->pattern + starts, A->row_indices, entries * sizeof(int32_t));
    return PERP_OK;
}

perp_status perp__kept_factor_analyse(perp__kept_factor *kept, perp_context *context,
                                      const perp__factor_type *type, const perp__square *A)
{
    perp_status status;

    if (is_analysed(kept, type, A))
        return PERP_OK;
    if (kept->factor && kept->type == type && !type->sparse && A->n <= kept->most) {
        kept->n = A->n;
        return type->reanalyse(kept->factor, A);
    }
    perp__kept_factor_release(kept);
    kept->context = context;
    kept->type = type;
    kept->n = kept->most = A->n;
    status = type->analyse(context, &kept->factor, A);
    if (status == PERP_OK && A->column_starts)
        status = keep_pattern(kept, A);
    if (status != PERP_OK)
        perp__kept_factor_release(kept);
    return status;
}

void perp__kept_factor_release(perp__kept_factor *kept)
{
    if (kept->factor)
        kept->type->destroy(kept->factor);
    kept->factor = NULL;
    if (kept->pattern)
        perp__release(kept->context, kept->pattern);
    kept->pattern = NULL;
}
