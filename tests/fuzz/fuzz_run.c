/* Steps of a simulator that has contacts in records of its own (perp_contact_solver_run and
 * _arrange): records, counts and numbers from the bytes, others from step to step, and memory that
 * runs out. What is arranged is compared with what the records say, read again here. */
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "fuzz.h"

enum { VELOCITIES = 5, CONTACTS = 4, OTHERS = 2, STEPS = 4, SLOTS = 6 };

typedef struct record {
    double friction[5], surface[3];
    int32_t geoms[2], row, dim;
} record;

/* An item that lasts: its name, and its impulses by slots. */
typedef struct item {
    int32_t name[4];
    double r[SLOTS];
} item;

typedef struct simulator {
    fuzz_bytes *bytes;
    fuzz_mood mood;
    int32_t n, wild; /* one in so many numbers of a record is wild; 0: none */
    record *records;
    double *J, *gaps, *bounds, *row_force, *force, *velocity, *mass;
    int32_t *kinds, *ids, counts[5];
    const void *at_records;
    const int32_t *at_kinds, *at_ids;
    const double *at_J, *at_gaps, *at_bounds;
    double *at_force;
    item items[CONTACTS + 2 * OTHERS];
    int32_t item_count;
} simulator;

/* Rows of a contact's dimension, by slots: normal, tangents, rolling, spin. */
static const int32_t orders[7][SLOTS] = {[1] = {0, -1, -1, -1, -1, -1},
                                         [3] = {0, 1, 2, -1, -1, -1},
                                         [4] = {0, 1, 2, -1, -1, 3},
                                         [6] = {0, 1, 2, 4, 5, 3}};
static const int32_t row_counts[4] = {1, 3, 4, 6};

static int32_t is_wild(simulator *sim)
{
    return sim->wild && fuzz_one_in(sim->bytes, sim->wild);
}

static void make_record(simulator *sim, record *r, int32_t *row)
{
    for (int32_t k = 0; k < 5; k++)
        r->friction[k] = is_wild(sim) ? fuzz_number(sim->bytes, sim->mood)
                                      : 0.25 * (1 + fuzz_pick(sim->bytes, 4));
    if (fuzz_one_in(sim->bytes, 2))
        r->friction[1] = r->friction[0];
    for (int32_t k = 0; k < 3; k++)
        r->surface[k] = fuzz_pick(sim->bytes, 3) - 1;
    for (int32_t k = 0; k < 2; k++)
        r->geoms[k] =
            is_wild(sim) ? INT32_MAX - fuzz_pick(sim->bytes, 3) : fuzz_pick(sim->bytes, 3) - 1;
    r->dim = row_counts[fuzz_pick(sim->bytes, 4)];
    r->row = *row;
    *row += r->dim;
    if (is_wild(sim))
        r->dim = fuzz_pick(sim->bytes, 9) - 1;
    if (is_wild(sim))
        r->row = fuzz_pick(sim->bytes, 2) ? INT32_MAX - 2 : fuzz_pick(sim->bytes, 9) - 1;
}

/* Everything of the next step, in new blocks. */
static void look(const void *model, void *data)
{
    simulator *sim = data;
    int32_t row = 0;

    (void)model;
    sim->counts[0] = fuzz_pick(sim->bytes, CONTACTS + 1);
    for (int32_t k = 1; k < 4; k++)
        row += sim->counts[k] = fuzz_pick(sim->bytes, OTHERS + 1);
    sim->ids = fuzz_take(row, sizeof *sim->ids), sim->kinds = fuzz_take(row, sizeof *sim->kinds);
    sim->bounds = fuzz_doubles(row);
    for (int32_t k = 0; k < row; k++) {
        sim->ids[k] = is_wild(sim) ? INT32_MIN : fuzz_pick(sim->bytes, 3);
        sim->kinds[k] = is_wild(sim) ? -1 : fuzz_pick(sim->bytes, 2);
        sim->bounds[k] = is_wild(sim) ? fuzz_number(sim->bytes, sim->mood) : 1.0;
    }
    sim->records = fuzz_take(sim->counts[0], sizeof *sim->records);
    for (int32_t k = 0; k < sim->counts[0]; k++)
        make_record(sim, &sim->records[k], &row);
    sim->counts[4] = row;
    sim->J = fuzz_doubles(row * sim->n), sim->gaps = fuzz_doubles(row);
    sim->row_force = fuzz_doubles(row);
    fuzz_numbers(sim->bytes, FUZZ_INTEGERS, sim->J, row * sim->n);
    fuzz_numbers(sim->bytes, sim->mood, sim->gaps, row);
    fuzz_numbers(sim->bytes, sim->mood, sim->force, sim->n);
    if (is_wild(sim))
        sim->counts[fuzz_pick(sim->bytes, 5)] = -1;
    sim->at_records = sim->records, sim->at_kinds = sim->kinds, sim->at_ids = sim->ids;
    sim->at_J = sim->J, sim->at_gaps = sim->gaps, sim->at_bounds = sim->bounds;
    sim->at_force = sim->row_force;
}

static void integrate(const void *model, double *place, const double *velocity, double h)
{
    (void)model, (void)place, (void)velocity, (void)h;
}

static int32_t moves(const simulator *sim, int32_t row)
{
    for (int32_t i = 0; i < sim->n; i++)
        if (sim->J[row * sim->n + i] != 0.0)
            return 1;
    return 0;
}

static void check_row(const simulator *sim, const perp_contact_step *s, int32_t row, int32_t source,
                      double scale)
{
    for (int32_t i = 0; i < sim->n; i++)
        if (s->H[row * sim->n + i] != sim->J[source * sim->n + i] * scale)
            fuzz_fail("run: H is rows of J: row %d is %d", row, source);
    if (isfinite(s->r[row]) && sim->row_force[source] != scale * s->r[row] / s->h)
        fuzz_fail("run: row_force = r / h: row %d", row);
}

static void name_item(item *items, int32_t k, int32_t kind, int32_t first, int32_t second)
{
    int32_t *name = items[k].name;

    memset(&items[k], 0, sizeof items[k]);
    name[0] = kind, name[1] = first, name[2] = second;
    if (k > 0 && memcmp(items[k - 1].name, name, 3 * sizeof *name) == 0)
        name[3] = items[k - 1].name[3] + 1;
}

/* Reads the step as records, rows and r; returns how many items there are. */
static int32_t read_step(const simulator *sim, const perp_contact_step *s,
                         const perp_contact_laws *laws, const double *r, item *items)
{
    int32_t row = 0, count = 0, bounded = sim->counts[2] + sim->counts[3], bilateral = 0;

    for (int32_t k = 0; k < sim->counts[0]; k++) {
        const record *c = &sim->records[k];
        const int32_t planar = c->dim == 3 && s->source->surface_at == 0;
        int32_t dim = c->dim == 1 ? 1 : 3;

        if (c->row < 0 || !moves(sim, c->row))
            continue;
        for (int32_t i = 1; i < 3 && planar; i++) /* a tangent that moves nothing is left out */
            dim -= !moves(sim, c->row + i);
        name_item(items, count, 0, c->geoms[0], c->geoms[1]);
        if (laws->dims[count] != dim || s->first[count] != row ||
            laws->mu[count] != (dim == 1 ? 0.0 : c->friction[0]))
            fuzz_fail("run: dimension, friction and place of contact %d", count);
        for (int32_t slot = 0; slot < SLOTS; slot++)
            if (orders[c->dim][slot] >= 0 &&
                (!planar || slot == 0 || moves(sim, c->row + orders[c->dim][slot]))) {
                const double *mu = c->friction;
                double scale = slot == 2 && mu[1] != mu[0]   ? mu[1] / mu[0]
                               : slot == 4 && mu[4] != mu[3] ? mu[4] / mu[3]
                                                             : 1.0;

                check_row(sim, s, row, c->row + orders[c->dim][slot], scale);
                items[count].r[slot] = r[row++];
            }
        count++;
    }
    for (int32_t k = 0; k < bounded; k++, count++) {
        const int32_t from = sim->counts[1] + k;

        name_item(items, count, 1, sim->kinds[from] & INT32_MAX, sim->ids[from]);
        check_row(sim, s, row, from, 1.0);
        items[count].r[0] = r[row++];
    }
    for (int32_t k = 0; k < sim->counts[1]; k++)
        bilateral += moves(sim, k);
    if (s->rows != row || s->bilateral != bilateral || s->contacts + bounded != count)
        fuzz_fail("run: %d rows, expected %d", s->rows, row);
    return count;
}

/* What lasts begins with the impulses that it had, all else at 0. */
static void check_start(const simulator *sim, const item *items, int32_t count)
{
    for (int32_t k = 0; k < count; k++) {
        item expected = {{0}, {0}};
        int32_t found = 0;

        for (int32_t j = 0; j < sim->item_count; j++)
            if (memcmp(sim->items[j].name, items[k].name, sizeof items[k].name) == 0) {
                expected = sim->items[j];
                found++;
            }
        for (int32_t slot = 0; slot < SLOTS && found <= 1; slot++)
            if (items[k].r[slot] != expected.r[slot] && items[k].r[slot] != 0.0)
                fuzz_fail("run: what lasts keeps its impulse: item %d", k);
        for (int32_t slot = 0; slot < 1 && found == 1; slot++)
            if (items[k].r[slot] != expected.r[slot])
                fuzz_fail("run: what lasts keeps its impulse: item %d", k);
    }
}

static void point(simulator *sim, perp_contact_step *s, perp_contact_source *source)
{
    const int32_t n = sim->n;
    int32_t *sources = fuzz_take(n * n, sizeof *sources), *diagonal = fuzz_take(n, sizeof *sources);

    sim->mass = fuzz_doubles(n), sim->velocity = fuzz_doubles(n), sim->force = fuzz_doubles(n);
    for (int32_t i = 0; i < n; i++) {
        sim->mass[i] = 1 << fuzz_pick(sim->bytes, 4);
        sim->velocity[i] = fuzz_pick(sim->bytes, 3) - 1;
        diagonal[i] = i * (n + 1);
        for (int32_t j = 0; j < n; j++)
            sources[i * n + j] = i == j ? i : -1;
    }
    s->n = n, s->M_entries = n * n, s->h = 0.0625, s->correction = 0.25;
    s->mass = sim->mass, s->mass_sources = sources, s->mass_diagonal = diagonal;
    s->M = fuzz_doubles(n * n), s->velocity = sim->velocity, s->force = sim->force;
    memset(s->M, 0, (size_t)(n * n) * sizeof *s->M);
    s->f = fuzz_doubles(n), s->v = fuzz_doubles(n), s->acceleration = fuzz_doubles(n);
    s->force_of_rows = fuzz_doubles(n), s->shift = fuzz_doubles(n);
    s->J = &sim->at_J, s->gaps = &sim->at_gaps, s->row_force = &sim->at_force;
    s->source = source;
    source->counts = sim->counts, source->contacts = &sim->at_records;
    source->stride = (int32_t)sizeof(record);
    source->geoms_at = (int32_t)offsetof(record, geoms);
    source->row_at = (int32_t)offsetof(record, row),
    source->dim_at = (int32_t)offsetof(record, dim);
    source->friction_at = (int32_t)offsetof(record, friction);
    source->surface_at = fuzz_pick(sim->bytes, 2) ? (int32_t)offsetof(record, surface) : 0;
    source->kinds = &sim->at_kinds, source->ids = &sim->at_ids, source->bounds = &sim->at_bounds;
}

static void run_steps(simulator *sim, perp_context *context, perp_contact_solver *solver,
                      perp_contact_step *step, perp_contact_run *run)
{
    const perp_contact_stage before = look;
    double room[2 * VELOCITIES], place[VELOCITIES] = {0}, time = 0.0;
    item items[CONTACTS + 2 * OTHERS];
    perp_contact_result result;
    perp_contact_laws laws;
    perp_contact_dynamics dynamics;
    perp_matrix M;

    if (perp_struct_init(&result, sizeof result) != PERP_OK ||
        perp_contact_laws_init(&laws, sizeof laws) != PERP_OK ||
        perp_struct_init(&dynamics, sizeof dynamics) != PERP_OK ||
        perp_struct_init(&M, sizeof M) != PERP_OK ||
        perp_matrix_dense(&M, PERP_STORAGE_ROW_MAJOR, sim->n, sim->n, step->M, sim->n) != PERP_OK)
        fuzz_fail("structs take their own size");
    dynamics.n = sim->n, dynamics.M = &M;
    run->data = sim, run->before = &before, run->before_count = 1, run->places = sim->n;
    run->place = place, run->velocity = sim->velocity, run->time = &time, run->room = room;
    run->integrate = integrate;
    for (int32_t k = 0; k < STEPS; k++) {
        const int mark = fuzz_mark();
        int32_t count = 0;

        run->steps = 1, run->done = 0, run->phase = PERP_CONTACT_PHASE_BEGIN;
        if (!fuzz_status(context,
                         perp_contact_solver_run(solver, run, step, &result, &laws, &dynamics),
                         "run")) {
            sim->item_count = 0; /* perhaps arranged, perhaps not: begin anew */
            step->w = NULL;
            fuzz_drop_to(mark);
            continue;
        }
        if (run->done != 1)
            fuzz_fail("run: one step is made");
        if (fuzz_good(result.outcome)) {
            fuzz_finite("velocity", sim->velocity, sim->n);
            fuzz_finite("r", step->r, step->rows);
        }
        sim->item_count = read_step(sim, step, &laws, step->r, sim->items);
        look(NULL, sim);
        if (perp_contact_solver_arrange(solver, step, &laws, &dynamics) == PERP_OK) {
            memset(sim->row_force, 0, (size_t)step->J_rows * sizeof *sim->row_force);
            for (int32_t i = 0; i < step->rows * sim->n; i++)
                step->H[i] = sim->J[step->H_rows[i / sim->n] * sim->n + i % sim->n] *
                             (step->row_scale ? step->row_scale[i / sim->n] : 1.0);
            count = read_step(sim, step, &laws, step->start, items);
            check_start(sim, items, count);
        }
        fuzz_drop_to(mark);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_bytes bytes = {data, data + size};
    perp_context *context = fuzz_open(&bytes, 1);
    perp_contact_solver *solver = NULL;
    perp_contact_settings settings;
    perp_contact_step step;
    perp_contact_source source;
    perp_contact_run run;
    simulator sim;

    memset(&sim, 0, sizeof sim);
    sim.bytes = &bytes;
    sim.mood = fuzz_mood_of(&bytes);
    sim.n = 1 + fuzz_pick(&bytes, VELOCITIES);
    sim.wild = fuzz_pick(&bytes, 2) ? 16 : 0;
    if (perp_contact_settings_init(&settings, sizeof settings) != PERP_OK ||
        perp_struct_init(&step, sizeof step) != PERP_OK ||
        perp_struct_init(&source, sizeof source) != PERP_OK ||
        perp_struct_init(&run, sizeof run) != PERP_OK)
        fuzz_fail("structs take their own size");
    settings.max_iterations = 1000;
    point(&sim, &step, &source);
    if (fuzz_status(context, perp_contact_solver_create(context, &solver, &settings), "create")) {
        run_steps(&sim, context, solver, &step, &run);
        perp_contact_solver_destroy(solver);
    }
    fuzz_close(context);
    return 0;
}
