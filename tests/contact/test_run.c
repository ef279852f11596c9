/* perp_contact_solver_run and _arrange: masses that fall on a table and slide there, as a simulator
 * has them that keeps contacts in records of its own; against closed forms. */
#include "suite.h"

#include <math.h>
#include <string.h>

#include <perp/perp.h>

enum { BODIES = 2, N = 3 * BODIES, MOST_ROWS = 1 + 3 * BODIES };

#define G 10.0
#define H_STEP 0.01
#define MU 0.5

typedef struct record {
    double friction[5], surface[3];
    int32_t geoms[2], row, dim;
} record;

typedef struct simulator {
    perp_context *context;
    perp_contact_solver *solver;
    perp_contact_step step;
    perp_contact_run run;
    perp_contact_source source;
    perp_contact_result result;
    perp_contact_laws laws;
    perp_contact_dynamics dynamics;
    perp_matrix mass_view;
    double mass[N], M[N * N], place[N], velocity[N], force[N], push[N], time, room[3 * N];
    double f[N], v[N], acceleration[N], force_of_rows[N];
    double J[MOST_ROWS * N], gaps[MOST_ROWS], row_force[MOST_ROWS], bounds[MOST_ROWS];
    double speeds[MOST_ROWS], belt, damping[N], seen[N];
    int32_t counts[5], kinds[MOST_ROWS], ids[MOST_ROWS];
    int32_t mass_sources[N * N], diagonal[N];
    record records[BODIES];
    const double *at_J, *at_gaps, *at_bounds;
    const int32_t *at_kinds, *at_ids;
    const void *at_records;
    double *at_force;
    int32_t has_friction; /* of the first mass along x, dry */
    int32_t calls;
} simulator;

/* Contacts of masses that are not above the table. */
static void look(const void *model, void *data)
{
    simulator *sim = data;
    int32_t row = 0;

    assert_null(model);
    sim->calls++;
    memset(sim->counts, 0, sizeof sim->counts);
    memset(sim->J, 0, sizeof sim->J);
    if (sim->has_friction) {
        sim->J[0] = 1.0, sim->bounds[0] = 3.0, sim->ids[0] = 7, sim->counts[2] = 1;
        row = 1;
    }
    for (int32_t k = 0; k < BODIES; k++) {
        const record r = {{MU, MU, 0.0, 0.0, 0.0}, {sim->belt, 0.0, 0.0}, {-1, k}, row, 3};
        double *J = sim->J + (size_t)row * N + 3 * (size_t)k;

        for (int32_t i = 0; i < 3; i++)
            sim->force[3 * k + i] = sim->push[3 * k + i] - (i == 2 ? G : 0.0);
        if (sim->place[3 * k + 2] > 0.0)
            continue;
        J[2] = J[N] = J[2 * N + 1] = 1.0;
        sim->gaps[row] = sim->place[3 * k + 2];
        sim->speeds[row] = sim->velocity[3 * k + 2];
        sim->records[sim->counts[0]++] = r;
        row += 3;
    }
    sim->counts[4] = row;
}

/* A mass of 2 each. */
static void invert(const void *model, void *data, double *acceleration, const double *force,
                   int32_t count)
{
    assert_null(model);
    assert_non_null(data);
    assert_int_equal(count, 1);
    for (int32_t i = 0; i < N; i++)
        acceleration[i] = force[i] / 2.0;
}

static void see(const void *model, void *data)
{
    simulator *sim = data;

    assert_null(model);
    memcpy(sim->seen, sim->acceleration, sizeof sim->seen);
}

static void integrate(const void *model, double *place, const double *velocity, double h)
{
    assert_null(model);
    for (int32_t i = 0; i < N; i++)
        place[i] += h * velocity[i];
}

static const perp_contact_stage before[1] = {look};

static void point_source(simulator *sim)
{
    perp_contact_source *source = &sim->source;

    perp_struct_init(source, sizeof *source);
    sim->at_records = sim->records;
    source->counts = sim->counts, source->contacts = &sim->at_records;
    source->stride = (int32_t)sizeof(record);
    source->geoms_at = (int32_t)offsetof(record, geoms);
    source->row_at = (int32_t)offsetof(record, row);
    source->dim_at = (int32_t)offsetof(record, dim);
    source->friction_at = (int32_t)offsetof(record, friction);
    sim->at_kinds = sim->kinds, sim->at_ids = sim->ids, sim->at_bounds = sim->bounds;
    source->kinds = &sim->at_kinds, source->ids = &sim->at_ids, source->bounds = &sim->at_bounds;
}

static void point(simulator *sim)
{
    perp_contact_step *s = &sim->step;
    perp_contact_run *run = &sim->run;

    sim->at_J = sim->J, sim->at_gaps = sim->gaps, sim->at_force = sim->row_force;
    for (int32_t i = 0; i < N; i++) {
        sim->mass[i] = 1.0, sim->diagonal[i] = i * (N + 1);
        for (int32_t j = 0; j < N; j++)
            sim->mass_sources[i * N + j] = i == j ? i : -1;
    }
    s->n = N, s->M_entries = N * N, s->h = H_STEP, s->mass = sim->mass, s->M = sim->M;
    s->mass_sources = sim->mass_sources, s->mass_diagonal = sim->diagonal;
    s->velocity = sim->velocity, s->force = sim->force, s->f = sim->f, s->v = sim->v;
    s->J = &sim->at_J, s->gaps = &sim->at_gaps, s->row_force = &sim->at_force;
    s->acceleration = sim->acceleration, s->force_of_rows = sim->force_of_rows;
    s->source = &sim->source;
    perp_struct_init(&sim->mass_view, sizeof sim->mass_view);
    sim->mass_view.rows = N, sim->mass_view.columns = N, sim->mass_view.leading_dimension = N;
    sim->mass_view.storage = PERP_STORAGE_ROW_MAJOR, sim->mass_view.values = sim->M;
    sim->dynamics.n = N, sim->dynamics.M = &sim->mass_view;
    run->data = sim, run->before = before, run->before_count = 1, run->places = N;
    run->place = sim->place, run->velocity = sim->velocity, run->time = &sim->time;
    run->room = sim->room, run->integrate = integrate;
}

static int setup(void **state)
{
    static simulator sim;

    memset(&sim, 0, sizeof sim);
    assert_int_equal(perp_context_create(&sim.context, NULL), PERP_OK);
    assert_int_equal(perp_contact_solver_create(sim.context, &sim.solver, NULL), PERP_OK);
    perp_struct_init(&sim.step, sizeof sim.step);
    perp_struct_init(&sim.run, sizeof sim.run);
    perp_struct_init(&sim.result, sizeof sim.result);
    perp_contact_laws_init(&sim.laws, sizeof sim.laws);
    perp_struct_init(&sim.dynamics, sizeof sim.dynamics);
    point_source(&sim);
    point(&sim);
    *state = &sim;
    return 0;
}

static int teardown(void **state)
{
    simulator *sim = *state;

    perp_contact_solver_destroy(sim->solver);
    perp_context_destroy(sim->context);
    return 0;
}

static perp_status steps(simulator *sim, int32_t count)
{
    sim->run.steps = count, sim->run.done = 0;
    return perp_contact_solver_run(sim->solver, &sim->run, &sim->step, &sim->result, &sim->laws,
                                   &sim->dynamics);
}

static perp_status arrange(simulator *sim)
{
    return perp_contact_solver_arrange(sim->solver, &sim->step, &sim->laws, &sim->dynamics);
}

#define near(is, should, tolerance) assert_true(fabs((is) - (should)) <= (tolerance))
#define TEST(f) cmocka_unit_test_setup_teardown(f, setup, teardown)

/* tol 1e-8 a step of impulses near h G, some hundred steps */
#define CLOSE 1e-7

static void test_a_mass_slides_to_rest_while_another_falls(void **state)
{
    simulator *sim = *state;
    const int32_t count = 60; /* h mu G = 0.05 a step: at rest after 20 */

    sim->velocity[0] = 0.99;
    sim->place[5] = 1.0; /* lands in step 45: h^2 G k (k + 1) / 2 > 1 */
    assert_int_equal(steps(sim, count), PERP_OK);
    assert_int_equal(sim->run.done, count);
    assert_int_equal(sim->run.wait, PERP_CONTACT_WAIT_DONE);
    assert_int_equal(sim->run.unsolved, 0);
    assert_int_equal(sim->calls, count);
    near(sim->time, count * H_STEP, 1e-12);
    assert_true(sim->velocity[0] == 0.0 && sim->velocity[5] == 0.0);
    near(sim->place[0], H_STEP * (19.0 * 0.99 - 0.05 * 19.0 * 20.0 / 2.0), CLOSE);
    near(sim->place[5], 1.0 - H_STEP * H_STEP * G * 45.0 * 46.0 / 2.0, CLOSE);
    near(sim->step.start[0], H_STEP * G, CLOSE);
}

static void test_what_lasts_keeps_its_impulse(void **state)
{
    simulator *sim = *state;

    sim->push[0] = 2.0;
    sim->place[5] = 1e-9;
    assert_int_equal(steps(sim, 1), PERP_OK);
    assert_int_equal(sim->step.contacts, 1);
    look(NULL, sim);
    assert_int_equal(
        perp_contact_solver_step(sim->solver, &sim->step, &sim->result, &sim->laws, &sim->dynamics),
        PERP_OK);
    assert_int_equal(sim->step.is_other, 1);
    assert_int_equal(
        perp_contact_solver_arrange(sim->solver, &sim->step, &sim->laws, &sim->dynamics), PERP_OK);
    assert_int_equal(sim->step.contacts, 2);
    assert_int_equal(sim->step.rows, 6);
    near(sim->step.start[0], H_STEP * G, CLOSE);
    near(sim->step.start[1], -H_STEP * 2.0, CLOSE);
    for (int i = 3; i < 6; i++)
        assert_true(sim->step.start[i] == 0.0);
    sim->place[2] = 1.0; /* the first one goes, the second stays */
    sim->step.start[3] = 0.25;
    look(NULL, sim);
    assert_int_equal(
        perp_contact_solver_arrange(sim->solver, &sim->step, &sim->laws, &sim->dynamics), PERP_OK);
    assert_int_equal(sim->step.contacts, 1);
    assert_true(sim->step.start[0] == 0.25);
}

/* A normal of rounding beside its tangents is none; one of 1e-9 bears. */
static void test_a_normal_of_rounding_bears_nothing(void **state)
{
    simulator *sim = *state;

    look(NULL, sim);
    sim->J[2] = 1e-17;
    assert_int_equal(arrange(sim), PERP_OK);
    assert_int_equal(sim->step.contacts, 1);
    sim->J[2] = 1e-9;
    assert_int_equal(arrange(sim), PERP_OK);
    assert_int_equal(sim->step.contacts, 2);
}

/* One on a rail along y, its first tangent of rounding: two rows, and friction along y alone. */
static void test_tangents_of_rounding_do_not_rub(void **state)
{
    simulator *sim = *state;

    look(NULL, sim);
    sim->J[N] = 1e-17;
    sim->velocity[0] = 3.0, sim->velocity[1] = 1.0;
    assert_int_equal(arrange(sim), PERP_OK);
    assert_int_equal(sim->step.rows, 5);
    assert_int_equal(sim->laws.dims[0], 2);
    assert_int_equal(sim->step.H_rows[1], 2);
    assert_int_equal(
        perp_contact_solver_step(sim->solver, &sim->step, &sim->result, &sim->laws, &sim->dynamics),
        PERP_OK);
    assert_true(sim->v[0] == 3.0 && sim->row_force[1] == 0.0);
    near(sim->v[1], 1.0 - MU * G * H_STEP, CLOSE);
    near(sim->row_force[2], -MU * G, CLOSE);
    sim->J[N] = 1e-9; /* what comes begins at 0, the other tangent has its impulse */
    assert_int_equal(arrange(sim), PERP_OK);
    assert_int_equal(sim->step.rows, 6);
    assert_true(sim->step.start[1] == 0.0 && sim->step.start[2] < 0.0);
    sim->J[2 * N + 1] = 0.0;
    assert_int_equal(arrange(sim), PERP_OK);
    assert_int_equal(sim->step.H_rows[1], 1);
    sim->J[N] = 0.0;
    assert_int_equal(arrange(sim), PERP_OK);
    assert_int_equal(sim->laws.dims[0], 1);
    sim->source.surface_at = (int32_t)offsetof(record, surface); /* friction against what moves */
    assert_int_equal(arrange(sim), PERP_OK);
    assert_int_equal(sim->step.rows, 6);
}

static void test_dry_friction_has_bounds(void **state)
{
    simulator *sim = *state;

    sim->has_friction = 1;
    sim->place[2] = sim->place[5] = 1.0;
    sim->push[0] = 2.5;
    assert_int_equal(steps(sim, 3), PERP_OK);
    assert_true(sim->velocity[0] == 0.0);
    sim->push[0] = 4.0; /* 1 more than its friction */
    assert_int_equal(steps(sim, 3), PERP_OK);
    near(sim->velocity[0], 3.0 * H_STEP, CLOSE);
}

/* Moreau's law: what came with 2 leaves with 1. */
static void test_a_mass_bounces(void **state)
{
    simulator *sim = *state;
    const double *speeds = sim->speeds;

    sim->place[5] = 1.0;
    sim->velocity[2] = -2.0;
    sim->step.restitution = 0.5, sim->step.speeds = &speeds;
    assert_int_equal(steps(sim, 1), PERP_OK);
    near(sim->velocity[2], 1.0, CLOSE);
    sim->step.restitution = 2.0;
    assert_int_equal(steps(sim, 1), PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(sim->context), "restitution"));
    sim->step.restitution = 0.5, sim->step.speeds = NULL;
    sim->run.phase = PERP_CONTACT_PHASE_BEGIN, sim->place[2] = 0.0;
    assert_int_equal(steps(sim, 1), PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(sim->context), "step.speeds"));
}

/* The masses' surfaces move against the table: friction drives them back, until that is made up. */
static void test_surfaces_move(void **state)
{
    simulator *sim = *state;

    sim->source.surface_at = (int32_t)offsetof(record, surface);
    sim->belt = 1.0;
    assert_int_equal(steps(sim, 10), PERP_OK);
    near(sim->velocity[0], -10.0 * H_STEP * MU * G, CLOSE);
    assert_int_equal(steps(sim, 20), PERP_OK);
    near(sim->velocity[0], -1.0, CLOSE);
    near(sim->velocity[3], -1.0, CLOSE);
}

static void test_inputs_and_outputs_have_a_row_a_step(void **state)
{
    simulator *sim = *state;
    double pushes[3][2] = {{8.0, 0.0}, {4.0, 0.0}, {-8.0, 0.0}}, seen[3][3];
    const perp_contact_copy in = {sim->push, pushes[0], 1, 2};
    const perp_contact_copy out[2] = {{seen[0], sim->velocity, 1, 3},
                                      {seen[0] + 1, &sim->time, 1, 3}};
    const double expected[3] = {0.03, 0.02, -0.01}; /* mu G = 5 */

    sim->run.inputs = &in, sim->run.input_count = 1;
    sim->run.outputs = out, sim->run.output_count = 2;
    assert_int_equal(steps(sim, 3), PERP_OK);
    for (int k = 0; k < 3; k++) {
        near(seen[k][0], expected[k], CLOSE);
        near(seen[k][1], (k + 1) * H_STEP, 1e-15);
    }
}

/* A spring of stiffness 100 at the first mass, along x. */
static void pull(const void *model, void *data)
{
    simulator *sim = data;

    look(model, data);
    sim->force[0] -= 100.0 * sim->place[0];
}

/* The classical scheme on x'' = -w^2 x is Taylor's series of the exact solution up to h^4, and on a
 * fall it is exact; where a contact is there at the begin, the step is as without `again`. */
static void test_a_free_step_has_four_stages(void **state)
{
    simulator *sim = *state;
    const perp_contact_stage stage = pull;
    const double z = 10.0 * H_STEP, even = 1.0 - z * z / 2.0 + z * z * z * z / 24.0;
    const double x = even * 0.3 + (z - z * z * z / 6.0) / 10.0 * 0.7;
    const double v = even * 0.7 - 10.0 * (z - z * z * z / 6.0) * 0.3;

    sim->run.before = &stage;
    sim->run.again = &stage, sim->run.again_count = 1;
    assert_int_equal(steps(sim, 0), PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(sim->context), "run.drive"));
    sim->run.drive = sim->force; /* masses are 1 */
    sim->place[0] = 0.3, sim->velocity[0] = 0.7, sim->place[2] = sim->place[5] = 1.0;
    assert_int_equal(steps(sim, 1), PERP_OK);
    assert_int_equal(sim->calls, 4);
    near(sim->place[0], x, 1e-15);
    near(sim->velocity[0], v, 1e-14);
    near(sim->place[2], 1.0 - G * H_STEP * H_STEP / 2.0, 1e-15);
    near(sim->velocity[2], -G * H_STEP, 1e-15);
    near(sim->acceleration[0], -30.0, 1e-12);
    near(sim->time, H_STEP, 1e-15);
    sim->place[5] = sim->velocity[5] = 0.0, sim->calls = 0;
    sim->place[2] = 1.0, sim->velocity[2] = 0.0;
    assert_int_equal(steps(sim, 1), PERP_OK);
    assert_int_equal(sim->calls, 1);
    near(sim->place[2], 1.0 - G * H_STEP * H_STEP, 1e-15);
    sim->run.again_count = 0, sim->run.before = before;
}

static void test_slow_slips_are_looked_at(void **state)
{
    simulator *sim = *state;

    sim->velocity[0] = 1.0;
    sim->run.look_slip = 1e9; /* all are slow */
    assert_int_equal(steps(sim, 5), PERP_OK);
    assert_int_equal(sim->run.wait, PERP_CONTACT_WAIT_LOOK);
    assert_int_equal(sim->run.phase, PERP_CONTACT_PHASE_MOVE);
    assert_int_equal(sim->run.done, 1); /* the first one was not warm */
    sim->run.patience = 100;
    sim->step.warm = 1;
    sim->run.steps = 5;
    assert_int_equal(perp_contact_solver_run(sim->solver, &sim->run, &sim->step, &sim->result,
                                             &sim->laws, &sim->dynamics),
                     PERP_OK);
    assert_int_equal(sim->run.done, 5);
    near(sim->velocity[0], 1.0 - 5.0 * H_STEP * MU * G, CLOSE);
}

/* Along the second tangent alone, and none. */
static void refuse_friction(simulator *sim)
{
    const double bad[3][2] = {{0.0, 0.5}, {0.5, -0.5}, {0.5, NAN}};

    for (int32_t k = 0; k < 3; k++) {
        look(NULL, sim);
        memcpy(sim->records[1].friction, bad[k], sizeof bad[k]);
        assert_int_equal(arrange(sim), PERP_ERROR_ARGUMENT);
        assert_non_null(strstr(perp_context_message(sim->context), "contact 1 has friction"));
    }
    look(NULL, sim);
    sim->records[1].friction[0] = sim->records[1].friction[1] = 0.0;
    assert_int_equal(arrange(sim), PERP_OK);
    sim->records[1].row = sim->counts[4] - 2; /* one row of its three is not there */
    assert_int_equal(arrange(sim), PERP_ERROR_ARGUMENT);
    look(NULL, sim);
}

/* Damped masses: m v' + h c v' = m v + h f. What looks behind a step sees f / m, what is left
 * behind is (v' - v) / h, and what rests is left as it is. */
static void test_sensors_see_accelerations_without_damping(void **state)
{
    simulator *sim = *state;
    const perp_contact_stage after = see;

    for (int32_t i = 0; i < N; i++)
        sim->mass[i] = 2.0, sim->damping[i] = 3.0;
    sim->step.damping = sim->damping, sim->run.invert = invert;
    sim->run.after = &after, sim->run.after_count = 1;
    sim->push[0] = 1.0, sim->place[2] = sim->place[5] = 1.0;
    assert_int_equal(steps(sim, 1), PERP_OK);
    near(sim->seen[0], 1.0 / 2.0, 1e-15);
    near(sim->acceleration[0], 1.0 / (2.0 + 3.0 * H_STEP), 1e-14);
    near(sim->seen[2], -G / 2.0, 1e-14);
    sim->push[0] = 0.0, sim->place[2] = sim->place[5] = 0.0;
    memset(sim->velocity, 0, sizeof sim->velocity);
    assert_int_equal(steps(sim, 1), PERP_OK);
    for (int32_t i = 0; i < N; i++)
        assert_true(sim->seen[i] == 0.0 && sim->acceleration[i] == 0.0);
    sim->run.after_count = 0;
}

static void refuse_stages(simulator *sim)
{
    const perp_contact_stage none = NULL;
    perp_contact_copy copy = {sim->push, sim->push, -1, 0};

    sim->run.after = &none, sim->run.after_count = 1;
    assert_int_equal(steps(sim, 1), PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(sim->context), "run.after[0]"));
    sim->run.after_count = 0;
    sim->run.inputs = &copy, sim->run.input_count = 1;
    assert_int_equal(steps(sim, 1), PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(sim->context), "run.inputs[0]"));
    copy.count = 0, copy.to = NULL;
    assert_int_equal(steps(sim, 1), PERP_ERROR_ARGUMENT);
    sim->run.input_count = 0;
    sim->run.places = -1;
    assert_int_equal(steps(sim, 1), PERP_ERROR_ARGUMENT);
    sim->run.places = N;
}

/* The impulses of contacts of one pair go to the same ones again, those of other pairs, and of more
 * than 64 contacts of one, to nobody else. */
static void test_names(void **state)
{
    simulator *sim = *state;
    enum { MANY = 70 };
    record many[MANY];
    const int32_t size = 3 * MANY;
    double J[3 * MANY * N], gaps[3 * MANY] = {0};

    look(NULL, sim);
    for (int32_t k = 0; k < MANY; k++) {
        many[k] = sim->records[k == MANY - 1];
        many[k].row = 3 * k;
        memcpy(J + 3 * k * N, sim->J + (k == MANY - 1) * 3 * N, sizeof(double[3 * N]));
    }
    many[MANY - 1].geoms[1] = INT32_MAX;
    sim->at_records = many, sim->at_J = J, sim->at_gaps = gaps;
    sim->counts[0] = MANY, sim->counts[4] = size;
    sim->step.row_force = NULL;
    assert_int_equal(arrange(sim), PERP_OK);
    for (int32_t i = 0; i < size; i++)
        sim->step.start[i] = 1.0 + i;
    many[0].row = -1; /* the first of the pair is gone: the others move up */
    assert_int_equal(arrange(sim), PERP_OK);
    for (int32_t i = 0; i < size - 6; i++)
        assert_true(sim->step.start[i] == 1.0 + i);
    for (int32_t i = 0; i < 3; i++)
        assert_true(sim->step.start[size - 6 + i] == 1.0 + size - 3 + i);
    many[0].row = 0; /* one more of the pair: it begins at 0 */
    assert_int_equal(arrange(sim), PERP_OK);
    assert_true(sim->step.start[size - 9] == 1.0 + size - 9 && sim->step.start[size - 6] == 0.0);
    many[MANY - 1].geoms[0] = 5;
    assert_int_equal(arrange(sim), PERP_OK);
    assert_true(sim->step.start[size - 3] == 0.0);
}

/* Contacts that share their rows: more numbers than can be counted, of a J that is small. */
static void test_too_many_numbers_are_refused(void **state)
{
    simulator *sim = *state;
    enum { MANY = 700, WIDE = 1 << 20 };
    static record many[MANY];
    static double J[3 * WIDE];

    look(NULL, sim);
    for (int32_t k = 0; k < MANY; k++)
        many[k] = sim->records[0], many[k].row = 0;
    J[0] = J[WIDE] = J[2 * WIDE] = 1.0;
    sim->at_records = many, sim->at_J = J;
    sim->counts[0] = MANY, sim->counts[4] = 3, sim->step.n = WIDE;
    assert_int_equal(arrange(sim), PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(sim->context), "2^31"));
    sim->at_records = sim->records, sim->at_J = sim->J, sim->step.n = N;
    assert_int_equal(steps(sim, 1), PERP_OK);
}

static void test_refusals(void **state)
{
    simulator *sim = *state;

    sim->run.integrate = NULL;
    assert_int_equal(steps(sim, 1), PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(sim->context), "run.integrate"));
    sim->run.integrate = integrate;
    sim->run.room = NULL;
    assert_int_equal(steps(sim, 1), PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(sim->context), "run.room"));
    sim->run.room = sim->room;
    sim->source.counts = NULL;
    assert_int_equal(
        perp_contact_solver_arrange(sim->solver, &sim->step, &sim->laws, &sim->dynamics),
        PERP_ERROR_ARGUMENT);
    assert_int_equal(
        perp_contact_solver_step(sim->solver, &sim->step, &sim->result, &sim->laws, &sim->dynamics),
        PERP_ERROR_ARGUMENT);
    sim->source.counts = sim->counts;
    sim->counts[2] = -1;
    assert_int_equal(steps(sim, 0), PERP_OK); /* nothing is asked */
    assert_int_equal(
        perp_contact_solver_step(sim->solver, &sim->step, &sim->result, &sim->laws, &sim->dynamics),
        PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(sim->context), "source.counts[2]"));
    look(NULL, sim);
    sim->records[0].dim = 5;
    assert_int_equal(
        perp_contact_solver_arrange(sim->solver, &sim->step, &sim->laws, &sim->dynamics),
        PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(sim->context), "dimension 5"));
    refuse_friction(sim);
    refuse_stages(sim);
    sim->step.source = NULL;
    assert_int_equal(
        perp_contact_solver_arrange(sim->solver, &sim->step, &sim->laws, &sim->dynamics),
        PERP_ERROR_ARGUMENT);
    sim->step.source = &sim->source;
    assert_int_equal(steps(sim, 2), PERP_OK); /* as good as new */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(test_a_mass_slides_to_rest_while_another_falls),
        TEST(test_what_lasts_keeps_its_impulse),
        TEST(test_a_normal_of_rounding_bears_nothing),
        TEST(test_tangents_of_rounding_do_not_rub),
        TEST(test_dry_friction_has_bounds),
        TEST(test_a_mass_bounces),
        TEST(test_surfaces_move),
        TEST(test_inputs_and_outputs_have_a_row_a_step),
        TEST(test_a_free_step_has_four_stages),
        TEST(test_slow_slips_are_looked_at),
        TEST(test_sensors_see_accelerations_without_damping),
        TEST(test_names),
        TEST(test_too_many_numbers_are_refused),
        TEST(test_refusals),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
