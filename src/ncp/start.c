/* Where a method begins: at the caller's start, near it where F is not defined there, and at
 * perturbations of it from a generator with a fixed seed. */
#include <math.h>
#include <string.h>

#include "ncp/solver.h"

#define SEED UINT64_C(0x9e3779b97f4a7c15)
#define START_TRIES 40 /* to find a point of the domain: 2^-20 .. 2^19 units */

/* Steele, Lea & Flood, "Fast splittable pseudorandom number generators" (2014); in [-1, 1). */
static double random_number(perp_ncp_solver *solver)
{
    uint64_t x = solver->random += SEED;

    x = (x ^ (x >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ (x >> 27)) * UINT64_C(0x94d049bb133111eb);
    x ^= x >> 31;
    return ldexp((double)(x >> 11), -52) - 1.0;
}

void perp__ncp_perturb(perp_ncp_solver *solver, int32_t attempt)
{
    const perp__ncp_model *m = &solver->model;
    static const int32_t sizes[] = {0, 2, 4, 6, 8, 10, -2, -4};
    const double factor = ldexp(1.0, sizes[attempt % 8]);

    for (int32_t i = 0; i < m->n; i++) {
        const double width = m->upper[i] - m->lower[i];
        const double size = fmin(factor * solver->unit[i], width);

        double shift = size * random_number(solver);

        if (solver->start[i] + shift < m->lower[i] || solver->start[i] + shift > m->upper[i])
            shift = -shift; /* into the box, not onto its boundary */
        solver->perturbed[i] = perp__ncp_clamp(solver->start[i] + shift, m->lower[i], m->upper[i]);
    }
}

/* candidate := the start, moved off its bounds by about `size`, elsewhere at random */
static void move_in(perp_ncp_solver *solver, double size)
{
    const perp__ncp_model *m = &solver->model;

    for (int32_t i = 0; i < m->n; i++) {
        const double z = solver->start[i], half = 0.5 * (m->upper[i] - m->lower[i]);
        const double random = random_number(solver);
        double shift = size * (0.75 + 0.25 * random);

        if (z == m->upper[i] || (z > m->lower[i] && random < 0.0))
            shift = -shift;
        solver->candidate[i] =
            perp__ncp_clamp(z + copysign(fmin(fabs(shift), half), shift), m->lower[i], m->upper[i]);
    }
}

perp_status perp__ncp_find_start(perp_ncp_solver *solver, const double *z0)
{
    perp__ncp_model *m = &solver->model;
    const double deadline = m->control.deadline;
    double unit = 0.0;
    perp_status status;

    solver->random = SEED;
    for (int32_t i = 0; i < m->n; i++) {
        solver->start[i] = perp__ncp_clamp(z0 ? z0[i] : 0.0, m->lower[i], m->upper[i]);
        unit = fmax(unit, fabs(solver->start[i]));
        m->largest[i] = fabs(solver->start[i]);
    }
    unit = unit > 0.0 ? unit : 1.0;
    m->control.deadline = 0.0; /* one call of F, come what may */
    status = perp__ncp_call(m, solver->start, m->w_caller);
    m->control.deadline = deadline;
    for (int32_t k = 0; k < START_TRIES && status == PERP__NCP_OUTSIDE; k++) {
        /* 1, 1/2, 2, 1/4, ... */
        move_in(solver, ldexp(unit, k % 2 == 0 ? k / 2 : -(k + 1) / 2));
        status = perp__ncp_call(m, solver->candidate, m->w_caller);
        if (status == PERP_OK)
            memcpy(solver->start, solver->candidate, (size_t)m->n * sizeof(double));
    }
    for (int32_t i = 0; i < m->n && status == PERP_OK; i++)
        m->z_start[i] = fabs(solver->start[i]);
    m->start_known = 0;
    perp__ncp_start_groups(m);
    return status;
}
