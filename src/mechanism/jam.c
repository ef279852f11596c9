/* Impacts without collision (Painleve; Genot & Brogliato 1999).
 *
 * A contact slides with u_t != 0 and u_n = 0. If the force of a contact that goes on sliding pulls
 * the bodies together instead of pushing them apart,
 *
 *   p = n' P (n - mu d) <= 0,     d = direction of u_t,     P = M^-1 restricted to G v = 0,
 *
 * no force keeps it from penetrating: an impulse of the order of the momentum ends the sliding, at
 * any h. With p > 0 the impulse is the integral of a force, of order h, and no impact. The test is
 * of one contact at a time: contacts that only together cannot go on sliding are not recognised. */
#include "mechanism/mechanism.h"

#include <math.h>
#include <string.h>

#include "linalg/orthogonal.h"

/* L^-1 of the bilateral rows, each of length 1, without those that are 0. */
static int32_t gather_bilateral(const perp_mechanism *m, double *rows)
{
    const size_t n = (size_t)m->n;
    int32_t count = 0, i;
    size_t k;

    for (i = 0; i < m->bilateral; i++) {
        double *row = rows + (size_t)count * n;
        double norm = 0.0;

        memcpy(row, m->begin.J + (size_t)(m->contact_rows + i) * n, n * sizeof *row);
        perp__solve_lower(m, &m->begin, row);
        for (k = 0; k < n; k++)
            norm = hypot(norm, row[k]);
        for (k = 0; k < n && norm > 0.0; k++)
            row[k] /= norm;
        count += norm > 0.0;
    }
    return count;
}

/* p of contact j, which slides with `speed`. */
static double sliding_inertia(perp_mechanism *m, int32_t j, double speed)
{
    const size_t n = (size_t)m->n, rows = (size_t)m->rows;
    const double *u = m->start_velocity, *normal = m->begin.J + (size_t)m->starts[j] * n;
    double *basis = m->work + rows * n + 2 * rows, *force = basis + n * n, *pressed = force + n;
    double *particular = pressed + n, p = 0.0;
    const int32_t count = gather_bilateral(m, m->work);
    int32_t i, rank;
    size_t k;

    memset(m->work + rows * n, 0, 2 * rows * sizeof *m->work);
    rank = perp__orthogonal_rows(m->work, m->work + rows * n, m->indices, m->work + rows * n + rows,
                                 basis, particular, count, m->n);
    memcpy(pressed, normal, n * sizeof *pressed);
    memcpy(force, normal, n * sizeof *force);
    for (i = m->starts[j] + 1; i < m->starts[j + 1]; i++)
        for (k = 0; k < n; k++)
            force[k] -= m->friction[j] * u[i] / speed * m->begin.J[(size_t)i * n + k];
    perp__solve_lower(m, &m->begin, pressed);
    perp__solve_lower(m, &m->begin, force);
    perp__project_out(basis, rank, m->n, force);
    for (k = 0; k < n; k++)
        p += pressed[k] * force[k];
    return p;
}

int32_t perp__is_jammed(perp_mechanism *m, const perp__velocity_answer *answer, int32_t j)
{
    const double speed = m->start_speed[j];
    double along = 0.0;
    int32_t i;

    if (speed == 0.0 || m->friction[j] == 0.0)
        return 0;
    for (i = m->starts[j] + 1; i < m->starts[j + 1]; i++)
        along += m->start_velocity[i] * answer->u[i];
    return along <= 0.0 && sliding_inertia(m, j, speed) <= 0.0;
}
