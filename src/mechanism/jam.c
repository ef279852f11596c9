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

#include <string.h>

/* p of contact j, which slides with `speed`. */
static double sliding_inertia(perp_mechanism *m, int32_t j, double speed)
{
    const size_t n = (size_t)m->n;
    double *force = m->work, *pressed = force + n, p = 0.0;
    int32_t i;
    size_t k;

    perp__held_rows_begin(&m->held, m->n);
    for (i = 0; i < m->bilateral; i++)
        perp__hold_row(m, &m->begin, m->contact_rows + i, 0.0);
    perp__held_rows_solve(&m->held);
    memcpy(pressed, m->begin.J + (size_t)m->starts[j] * n, n * sizeof *pressed);
    memcpy(force, pressed, n * sizeof *force);
    for (i = m->starts[j] + 1; i < m->starts[j + 1]; i++)
        perp__add_row(m, &m->begin, i, -m->friction[j] * m->start_velocity[i] / speed, force);
    perp__solve_lower(m, &m->begin, pressed);
    perp__solve_lower(m, &m->begin, force);
    perp__project_out(m->held.basis, m->held.rank, m->n, force);
    for (k = 0; k < n; k++)
        p += pressed[k] * force[k];
    return p;
}

int32_t perp__is_jammed(perp_mechanism *m, const perp__motion *answer, int32_t j)
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
