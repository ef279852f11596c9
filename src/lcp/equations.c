/* Which way round equations stand. Row i of a free z_i says w_i = 0, and its negative says the
 * same; but methods see more than that. [H A'; A 0] with free multipliers is symmetric and not
 * monotone, and paths may end in rays beside its solutions; [H A'; -A 0] is monotone where H is
 * (Cottle, Pang and Stone, "The Linear Complementarity Problem", sections 1.3 and 4.4). So an
 * equation in which z_i itself has no part is turned round where more of its entries have the sign
 * of their mirror images than the other one; the scale of no row depends on that. */
#include "lcp/solver.h"

#include <math.h>
#include <string.h>

static int32_t is_free(const double *lower, const double *upper, int32_t i)
{
    return lower && lower[i] == -INFINITY && (!upper || upper[i] == INFINITY);
}

/* M_ij M_ji > 0: 1; < 0: -1. */
static int32_t sign_of(double entry, double mirrored)
{
    return entry == 0.0 || mirrored == 0.0 ? 0 : (entry > 0.0) == (mirrored > 0.0) ? 1 : -1;
}

/* Whether row i is to be turned round, with signs of the others as they are. */
static int32_t is_turned(const perp__matrix *M, int32_t i, const int8_t *signs)
{
    const perp__line l = perp__line_of(M, i);
    int64_t alike = 0;

    if (perp__diagonal_entry(M, i) != 0.0)
        return 0;
    for (int32_t k = 0; k < l.count; k++) {
        const int32_t j = l.indices ? l.indices[k] : k;

        if (j != i)
            alike += signs[j] * sign_of(perp__entry(M, i, j), perp__entry(M, j, i));
    }
    return alike > 0;
}

size_t perp__turned_entries(const perp__matrix *M, const double *lower, const double *upper)
{
    const size_t n = (size_t)M->rows;
    const size_t stride = M->row_stride > M->column_stride ? M->row_stride : M->column_stride;

    for (int32_t i = 0; i < M->rows; i++)
        if (is_free(lower, upper, i) && perp__diagonal_entry(M, i) == 0.0)
            return M->column_starts ? (size_t)M->column_starts[n] : n * stride;
    return 0;
}

void perp__turn_equations(perp_lcp_solver *solver, perp__matrix *M)
{
    int32_t count = 0;

    /* 1. Which ones. */
    solver->is_turned = 0;
    if (perp__turned_entries(M, solver->lower, solver->upper) == 0)
        return;
    memset(solver->signs, 1, (size_t)M->rows);
    for (int32_t i = 0; i < M->rows; i++)
        if (is_free(solver->lower, solver->upper, i) && is_turned(M, i, solver->signs)) {
            solver->signs[i] = -1;
            count++;
        }
    /* 2. M with their rows turned round. */
    for (int32_t j = 0; j < M->columns && count > 0; j++) {
        const perp__line l = perp__line_of(M, j);

        for (int32_t k = 0; k < l.count; k++) {
            const int32_t i = perp__lines_are_rows(M) ? j : l.indices ? l.indices[k] : k;

            solver->turned[l.values - M->values + k] = solver->signs[i] * l.values[k];
        }
    }
    solver->is_turned = count > 0;
    if (solver->is_turned)
        M->values = solver->turned;
}
