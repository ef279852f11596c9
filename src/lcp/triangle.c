/* Triangular problems, in whatever order: where the rows can be put in an order in which each
 * depends on the z before it alone, each is a problem of one variable once those are known,
 *
 *   z_i = mid(l_i, u_i, -(q_i + sum_(j before i) M_ij z_j) / M_ii),
 *
 * and one sweep of Gauss-Seidel in that order is the solution. Pivoting may take 2^n steps on them
 * (Murty, "Linear Complementarity, Linear and Nonlinear Programming" (1988), chapter 6). */
#include <math.h>
#include <string.h>

#include "lcp/solver.h"
#include "linalg/doubled.h"

enum { NOBODY = -1, TAKEN = -2 };

/* Lines of M, rows or columns, are taken one after the other, each once all others that it has
 * entries of are; the line `on` waits for one of these at a time. Each entry is looked at once, and
 * of a matrix that is no triangle few are. */
typedef struct search {
    const perp__matrix *M;
    int32_t *first, *next; /* the lines that wait for a line, as lists */
    int32_t *at;           /* the entry of a line that it waits for */
    int32_t *order, count;
} search;

/* Goes on to the next entry that line j has to wait for, if there is one. */
static void wait(search *s, int32_t j)
{
    const perp__line l = perp__line_of(s->M, j);
    int32_t k = s->at[j], other = j;

    for (; k < l.count; k++) {
        other = l.indices ? l.indices[k] : k;
        if (l.values[k] != 0.0 && other != j && s->first[other] != TAKEN)
            break;
    }
    s->at[j] = k;
    if (k == l.count) {
        s->order[s->count++] = j;
    } else {
        s->next[j] = s->first[other];
        s->first[other] = j;
    }
}

/* order := one in which the rows can be solved; 0 if there is none. */
static int32_t find_order(perp_lcp_solver *solver)
{
    const int32_t n = solver->n;
    search s = {&solver->M, solver->work, solver->work + n, solver->row_size, solver->order, 0};

    for (int32_t j = 0; j < n; j++) {
        s.first[j] = NOBODY;
        s.at[j] = 0;
    }
    for (int32_t j = 0; j < n; j++)
        wait(&s, j);
    for (int32_t k = 0; k < s.count; k++) {
        const int32_t j = s.order[k];
        int32_t waiting = s.first[j], next;

        for (s.first[j] = TAKEN; waiting != NOBODY; waiting = next) {
            next = s.next[waiting];
            wait(&s, waiting);
        }
    }
    if (!perp__lines_are_rows(&solver->M)) /* whose column needs no one is needed by no one */
        for (int32_t k = 0; k < s.count / 2; k++) {
            const int32_t j = s.order[k];

            s.order[k] = s.order[s.count - 1 - k];
            s.order[s.count - 1 - k] = j;
        }
    return s.count == n;
}

static int32_t is_triangle(perp_lcp_solver *solver)
{
    if (solver->ordered == solver->setups || solver->ordered == -solver->setups)
        return solver->ordered > 0;
    solver->ordered = -solver->setups;
    if (solver->n == 0 || !find_order(solver))
        return 0;
    for (int32_t i = 0; i < solver->n; i++)
        if (!(perp__diagonal_entry(&solver->M, i) > 0.0) && solver->lower[i] < solver->upper[i])
            return 0;
    solver->ordered = solver->setups;
    return 1;
}

/* The z so far: in two doubles, and which are not 0. */
typedef struct solved {
    double *high, *low;
    int32_t *set, count;
} solved;

/* w += M_ij z_j for all i; w_i += M_ij z_j for all j. */
static void add_column(perp_lcp_solver *solver, const solved *z, int32_t j)
{
    const perp__line l = perp__line_of(&solver->M, j);

    for (int32_t k = 0; k < l.count && z->high[j] != 0.0; k++) {
        const int32_t i = l.indices ? l.indices[k] : k;

        perp__accumulate(&solver->w_high[i], &solver->w_low[i], l.values[k], z->high[j]);
        solver->w_low[i] += l.values[k] * z->low[j];
    }
}

static void add_row(perp_lcp_solver *solver, const solved *z, int32_t i)
{
    const double *row = perp__line_of(&solver->M, i).values;

    for (int32_t k = 0; k < z->count; k++) {
        const int32_t j = z->set[k];

        perp__accumulate(&solver->w_high[i], &solver->w_low[i], row[j], z->high[j]);
        solver->w_low[i] += row[j] * z->low[j];
    }
}

/* z_i, and what its rounding leaves. */
static void solve_row(const perp_lcp_solver *solver, solved *z, int32_t i)
{
    const double lower = solver->lower[i], upper = solver->upper[i];
    const double diagonal = perp__diagonal_entry(&solver->M, i);
    double high = solver->w_high[i], low = solver->w_low[i], value = lower;

    if (lower < upper)
        value = perp__clamp(0.0 - (high + low) / diagonal, lower, upper);
    z->high[i] = value;
    z->low[i] = 0.0;
    if (value != lower && value != upper) {
        perp__accumulate(&high, &low, diagonal, value);
        z->low[i] = -(high + low) / diagonal;
    }
    if (value != 0.0)
        z->set[z->count++] = i;
}

int32_t perp__triangle_solve(perp_lcp_solver *solver, perp__evaluation *worth)
{
    const size_t bytes = (size_t)solver->n * sizeof(double);
    const int32_t by_rows = perp__lines_are_rows(&solver->M);
    solved z = {solver->z, solver->game_start, solver->work, 0};

    if (!is_triangle(solver))
        return 0;
    memcpy(solver->w_high, solver->q, bytes);
    memset(solver->w_low, 0, bytes);
    for (int32_t k = 0; k < solver->n; k++) {
        const int32_t i = solver->order[k];

        if (by_rows)
            add_row(solver, &z, i);
        solve_row(solver, &z, i);
        if (!by_rows)
            add_column(solver, &z, i);
    }
    *worth = perp__evaluate(solver);
    return perp__is_exact(solver, worth);
}
