/* Slips that start in 3 dimensions: friction is opposite to the acceleration along the tangents,
 * whose direction is an unknown. Newton's method on the angles, from the directions of the
 * pattern:
 *
 *   g_j = way_j x u_j' = 0,   K x = -(beta + W f_0) of the rows that hold,
 *   dx = -K^-1 E W c_k with c_k = -mu f_n way_k^perp, what a turn of way_k does to the forces.
 *
 * Where contacts share a load K is singular at the solution and nearly so around it: then the rank
 * of the start is kept. */
#include <math.h>
#include <string.h>

#include "mechanism/accelerations/accelerations.h"

#define MOST_ROUNDS 20
#define LONGEST_TURN 0.5
#define SETTLED 1e-13
/* Turns larger than this after so many rounds lead nowhere. */
#define NEAR 0.1
#define PATIENCE 7

int32_t perp__found_turns(const perp__acceleration *a, int32_t index)
{
    return a->unit[index].tangents == 2 &&
           perp__found_starts(a->unit + index, a->pattern.mode[index]);
}

static int32_t tangent_of(const perp__unit *unit)
{
    return unit->dry ? unit->row : unit->row + 1;
}

int32_t perp__found_turning(const perp__acceleration *a)
{
    int32_t count = 0, i;

    for (i = 0; i < a->units; i++)
        count += perp__found_turns(a, i);
    return count;
}

/* change := what turning the way of this unit by an angle of 1 does to u'. */
static void turn_accelerations(perp__acceleration *a, int32_t index, double *change)
{
    const perp__unit *unit = a->unit + index;
    const double *way = a->pattern.way + 2 * (size_t)index;
    const double size = unit->dry ? unit->bound : unit->mu * a->f[unit->row];
    const int32_t t = tangent_of(unit);
    const size_t active = (size_t)a->active;
    double *force = a->work, *rhs = force + active, *x = rhs + active;
    int32_t r;

    memset(force, 0, active * sizeof *force);
    force[t] = size * way[1];
    force[t + 1] = -size * way[0];
    perp__found_row_accelerations(a, change, NULL, force, 1);
    for (r = 0; r < a->system.n; r++)
        rhs[r] = -change[a->first[r]] * a->scale[a->first[r]];
    perp__pivoting_solve(&a->system, x, rhs);
    perp__found_add_forces(a, force, x);
    perp__found_row_accelerations(a, change, NULL, force, 1);
}

static double cross(const double *way, const double *u)
{
    return way[0] * u[1] - way[1] * u[0];
}

/* The Newton step; returns the largest turn, or -1 where there is none. */
static double turn(perp__acceleration *a)
{
    perp__pivoting *p = &a->turning;
    const size_t active = (size_t)a->active;
    double *g = a->turn_work, *step = g + active, *change = step + active, largest = 0.0, top = 0.0;
    int32_t row = 0, column = 0, i, j;

    p->n = perp__found_turning(a);
    for (j = 0; j < a->units; j++) {
        if (!perp__found_turns(a, j))
            continue;
        turn_accelerations(a, j, change);
        for (i = 0, row = 0; i < a->units; i++) {
            const double *way = a->pattern.way + 2 * (size_t)i;
            const int32_t t = tangent_of(a->unit + i);
            double entry;

            if (!perp__found_turns(a, i))
                continue;
            entry = cross(way, change + t);
            if (i == j)
                entry -= way[0] * a->u[t] + way[1] * a->u[t + 1];
            top = fmax(top, fabs(entry));
            p->K[(size_t)row * (size_t)p->n + (size_t)column] = entry;
            g[row++] = -cross(way, a->u + t);
        }
        column++;
    }
    perp__pivoting_eliminate(p, 1e-12 * top, p->n);
    if (p->rank < p->n)
        return -1.0;
    perp__pivoting_solve(p, step, g);
    for (i = 0, row = 0; i < a->units; i++) {
        double *way = a->pattern.way + 2 * (size_t)i, kept = way[0], angle;

        if (!perp__found_turns(a, i))
            continue;
        angle = fmax(-LONGEST_TURN, fmin(LONGEST_TURN, step[row++]));
        largest = fmax(largest, fabs(angle));
        way[0] = cos(angle) * kept - sin(angle) * way[1];
        way[1] = sin(angle) * kept + cos(angle) * way[1];
        kept = hypot(way[0], way[1]);
        way[0] /= kept;
        way[1] /= kept;
    }
    return isfinite(largest) ? largest : -1.0;
}

int32_t perp__found_turn(perp__acceleration *a, double singular)
{
    int32_t round, rank;

    perp__found_solve_roughly(a, singular, a->active);
    rank = a->system.rank;
    for (round = 0; round < MOST_ROUNDS; round++) {
        const double largest = turn(a);

        if (largest < 0.0 || (round >= PATIENCE && largest > NEAR))
            return -1;
        if (largest <= SETTLED)
            return perp__found_solve(a);
        /* with the rank of the start, what is left without a pivot becomes consistent at the end */
        perp__found_solve_roughly(a, 0.0, rank);
    }
    return -1;
}
