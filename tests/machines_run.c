/* One run of a machine, and what it shows. */
#include "machines.h"

#include <math.h>
#include <string.h>

typedef struct watch {
    machine_record *record;
    const machine *machine;
} watch;

static int32_t look(const perp_mechanism_view *view, void *user)
{
    watch *w = user;
    machine_record *record = w->record;
    const machine *m = w->machine;
    int32_t i, row;

    for (i = 0; i < m->model.velocities && i < MACHINE_ROOM; i++) {
        if (view->v[i] != 0.0)
            record->stop[i] = INFINITY;
        else if (isinf(record->stop[i]))
            record->stop[i] = view->t;
    }
    for (i = 0, row = 0; i < m->model.contacts && i < MACHINE_ROOM; row += m->model.dim, i++)
        if (view->h > 0 && view->impulse[row] > 0 && isinf(record->hit[i]))
            record->hit[i] = view->t;
    if (m->energy) {
        record->energy[1] = m->energy(m, view->q, view->v);
        if (view->h == 0)
            record->energy[0] = record->energy[1];
        record->energy_change =
            fmax(record->energy_change, fabs(record->energy[1] - record->energy[0]));
    }
    return 0;
}

perp_status machine_run(machine_record *record, perp_context *context, const machine *m,
                        const perp_mechanism_settings *settings, double h, double end)
{
    perp_mechanism *mechanism = NULL;
    perp_status status;
    watch w;
    int32_t i;

    memset(record, 0, sizeof *record);
    for (i = 0; i < MACHINE_ROOM; i++)
        record->stop[i] = record->hit[i] = INFINITY;
    w.record = record;
    w.machine = m;
    status = perp_struct_init(&record->result, sizeof record->result);
    if (status == PERP_OK)
        status = perp_mechanism_create(context, &mechanism, settings, &m->model);
    if (status == PERP_OK)
        status = perp_mechanism_run(mechanism, record->q, record->v, &record->result,
                                    START(0, h, m->q, m->v), end > 0 ? end : m->end, look, &w);
    perp_mechanism_destroy(mechanism);
    return status;
}

double machine_measure(const machine_record *record, const machine_reference *reference)
{
    switch (reference->kind) {
    case MACHINE_COORDINATE:
        return record->q[reference->index];
    case MACHINE_VELOCITY:
        return record->v[reference->index];
    case MACHINE_STOP:
        return record->stop[reference->index];
    case MACHINE_HIT:
        return record->hit[reference->index];
    default:
        return NAN;
    }
}
