/* Impulses that passes have not brought to an answer, and ways out of overlap, may give energy.
 * With d what impulses make of the velocities, m the mean of these before and after the step, and f
 * the forces, it grows by
 *
 *   d'M m + h f'(m - moving).
 *
 * Then there is less of d, and the way is more that of m. */
#include "world/step.h"

#include <math.h>

/* Energy that is rounding, beside what impulses move. */
#define ENERGY_ROUNDING 1e-12

/* x'My of the island's bodies. */
static double mass_product(const perp_world *world, const perp__island *island, const double *x,
                           const double *y)
{
    const int32_t n = world->dof;
    double sum = 0.0, both[6];

    for (int32_t i = 0; i < island->bodies; i++) {
        const int32_t body = world->work.members[i];
        const double a = perp__mass_norm(world, body, x + n * i);
        const double b = perp__mass_norm(world, body, y + n * i);

        for (int32_t k = 0; k < n; k++)
            both[k] = x[n * i + k] + y[n * i + k];
        both[0] = perp__mass_norm(world, body, both);
        sum += 0.5 * (both[0] * both[0] - a * a - b * b);
    }
    return sum;
}

/* What forces do where bodies move by `moving` over h, not by m, in d := m - moving. */
static double work_beside(const perp_world *world, const perp__island *island, double h)
{
    const perp__island_work *work = &world->work;
    const int32_t n = world->dof;
    double sum = 0.0, shift[6];

    for (int32_t i = 0; i < island->bodies; i++) {
        perp__twist_of(world, work->solved + n * i, shift);
        sum -= h * perp__work_needed(world, work->members[i], shift);
    }
    return sum;
}

int32_t perp__take_energy(perp_world *world, const perp__island *island, double h)
{
    perp__island_work *work = &world->work;
    const int32_t numbers = world->dof * island->bodies;
    double *d = work->solved, *m = work->drift, size, work_of_d, growth, share;
    int32_t scaled;

    for (int32_t i = 0; i < numbers; i++) {
        d[i] = work->v[i] - work->start[i] - work->gain[i];
        m[i] = 0.5 * (work->start[i] + work->v[i]);
    }
    work_of_d = mass_product(world, island, d, m);
    size = mass_product(world, island, d, d);
    scaled = work_of_d > ENERGY_ROUNDING * size;
    if (scaled) {
        share = fmax(1.0 - 2.0 * work_of_d / size, 0.0);
        for (int32_t i = 0; i < numbers; i++) {
            work->v[i] -= (1.0 - share) * d[i];
            work->moving[i] -= 0.5 * (1.0 - share) * d[i];
            m[i] -= 0.5 * (1.0 - share) * d[i];
        }
        for (int32_t i = 0; i < 3 * island->contacts; i++)
            work->impulse[i] *= share;
        work_of_d = 0.0;
    }
    for (int32_t i = 0; i < numbers; i++)
        d[i] = m[i] - work->moving[i];
    growth = work_beside(world, island, h);
    share = work_of_d + growth > ENERGY_ROUNDING * size ? fmax(-work_of_d / growth, 0.0) : 1.0;
    for (int32_t i = 0; i < numbers && share < 1.0; i++)
        work->moving[i] = m[i] - share * d[i];
    return scaled;
}
