/* Starts for two players' games. From z = 0 every covering vector leads to a ray there at once;
 * Lemke and Howson ("Equilibrium points of bimatrix games", J. SIAM 12 (1964) 413) begin where
 * player one takes strategy j alone, and as much of it as the other's costs need, and player two
 * the one strategy that answers it. */
#include <math.h>
#include <string.h>

#include "lcp/solver.h"

int32_t perp__is_game(const perp_lcp_solver *solver)
{
    perp__cursor c = perp__first(&solver->M);
    int32_t game = 1;

    for (int32_t i = 0; i < solver->n && game; i++)
        game = solver->q[i] < 0.0 && solver->lower[i] == 0.0 && solver->upper[i] == INFINITY;
    while (game && perp__advance(&c))
        game = c.i == c.j ? c.value == 0.0 : c.value >= 0.0;
    return game;
}

/* Which s limits z_j from below where all rows that it can lift, w_s = M_sj z_j + q_s >= 0, are to
 * be lifted by it alone: *z is the least such z_j. -1: none is lifted. */
static int32_t last_lifted(const perp_lcp_solver *solver, int32_t j, double *z)
{
    int32_t found = -1;

    *z = 0.0;
    for (int32_t s = 0; s < solver->n; s++) {
        const double entry = perp__entry(&solver->M, s, j);

        if (entry > 0.0 && -solver->q[s] > *z * entry) {
            *z = -solver->q[s] / entry;
            found = s;
        }
    }
    return found;
}

int32_t perp__game_start(perp_lcp_solver *solver, int32_t j)
{
    double first, second;
    const int32_t s = last_lifted(solver, j, &first);

    if (s < 0 || last_lifted(solver, s, &second) < 0)
        return 0;
    memset(solver->game_start, 0, (size_t)solver->n * sizeof *solver->game_start);
    solver->game_start[j] = first;
    solver->game_start[s] = second;
    return 1;
}
