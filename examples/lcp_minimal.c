/* The smallest program: 0 <= z  perp  M z + q >= 0 with two variables. */
#include <perp/perp.h>

#include <stdio.h>

int main(void)
{
    const double M[] = {2, 1, 1, 2}, q[] = {-1, 1};
    double z[2], w[2];
    perp_context *context;
    perp_matrix view;
    const perp_lcp_problem problem = {.struct_size = sizeof problem, .M = &view, .q = q};
    perp_lcp_result result;

    perp_struct_init(&view, sizeof view);
    perp_matrix_dense(&view, PERP_STORAGE_ROW_MAJOR, 2, 2, M, 2);
    perp_struct_init(&result, sizeof result);
    if (perp_context_create(&context, NULL) != PERP_OK)
        return 1;
    if (perp_lcp_solve(context, z, w, NULL, &result, NULL, &problem, NULL) != PERP_OK) {
        fprintf(stderr, "%s\n", perp_context_message(context));
        perp_context_destroy(context);
        return 1;
    }
    printf("%s: z = (%g, %g), w = (%g, %g)\n", perp_outcome_text(result.outcome), z[0], z[1], w[0],
           w[1]);
    perp_context_destroy(context);
    return 0;
}
