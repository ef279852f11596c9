/* The table of machines. */
#include "machines.h"

#include <stdlib.h>
#include <string.h>

typedef struct maker {
    const char *name;
    void (*make)(machine *m, double parameter);
    double parameter; /* what tells it from others of its kind */
} maker;

static const maker makers[MACHINES] = {
    {"ramp_r1", machine_make_ramp, 1},
    {"ramp_r2", machine_make_ramp, 2},
    {"ramp_r3", machine_make_ramp, 3},
    {"ramp_r4", machine_make_ramp, 4},
    {"ramp_r5", machine_make_ramp, 5},
    {"ramp_r6", machine_make_ramp, 6},
    {"ramp_r7", machine_make_ramp, 7},
    {"plane", machine_make_plane, 2},
    {"floor", machine_make_plane, 3},
    {"rod", machine_make_rod, 0},
    {"rod_fall", machine_make_rod_fall, 0},
    {"ball", machine_make_ball, 0.5},
    {"chain_3", machine_make_chain, 3},
    {"chain_5", machine_make_chain, 5},
    {"chain_1:3", machine_make_chain_unlike, 3},
    {"block", machine_make_block, 0},
    {"block_slope", machine_make_block_slope, 15},
    {"block_push", machine_make_block_push, 0.1},
    {"wedge", machine_make_wedge, 10},
    {"table", machine_make_table, 4},
    {"table_many", machine_make_table, MACHINE_LEGS},
    {"roll_ball", machine_make_roll, 2.0 / 5},
    {"roll_disc", machine_make_roll, 1.0 / 2},
    {"roll_hoop", machine_make_roll, 1},
    {"roll_back", machine_make_roll_back, 20},
    {"roll_slope", machine_make_roll_slope, 30},
    {"belt", machine_make_belt, 0},
    {"finger", machine_make_finger, 45},
    {"finger_jam", machine_make_finger, 70},
    {"peg", machine_make_peg, 0.012},
    {"pendulum", machine_make_pendulum, 90},
    {"spin", machine_make_spin, 0},
};

void machine_make(machine *m, int32_t name)
{
    memset(m, 0, sizeof *m);
    if (name < 0 || name >= MACHINES ||
        perp_mechanism_model_init(&m->model, sizeof m->model) != PERP_OK)
        abort();
    m->name = makers[name].name;
    m->model.mu = m->mu;
    m->model.restitution = m->restitution;
    m->model.user = m;
    makers[name].make(m, makers[name].parameter);
    if (m->model.contacts > MACHINE_ROOM) /* frictionless, inelastic */
        m->model.mu = m->model.restitution = NULL;
}

void machine_refer(machine *m, int32_t kind, int32_t index, double value, const char *what,
                   const char *source)
{
    machine_reference *reference;

    if (m->references == MACHINE_ROOM)
        abort();
    reference = &m->reference[m->references++];
    reference->kind = kind;
    reference->index = index;
    reference->value = value;
    reference->what = what;
    reference->source = source;
}

double machine_value(const machine *m, const char *what)
{
    int32_t k;

    for (k = 0; k < m->references; k++)
        if (strcmp(m->reference[k].what, what) == 0)
            return m->reference[k].value;
    abort();
}

void machine_row(double *row, const double *direction, const double *offset)
{
    row[0] = direction[0];
    row[1] = direction[1];
    row[2] = offset[0] * direction[1] - offset[1] * direction[0];
}
