/* A block on a table, handed over to perp_contact_solver_step as by a simulator that keeps its
 * rows in another order: its steps, and what has to hold where one is refused. For test_step*.c. */
#ifndef PERP_TESTS_CONTACT_STEP_BLOCK_H
#define PERP_TESTS_CONTACT_STEP_BLOCK_H

#include <math.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

/* Velocities x (along the table), y (up) and s, a slider on a rail of its own that a motor pulls,
 * tied to nothing. M is kept as its lower triangle: (x x), (y y), (s x) = 0 here, (s s). Rows of J:
 * the slider's dry friction, a dead one, the tangent along -x (the solver's is +x), the normal. */
enum { N = 3, ROWS = 4 };

typedef struct block {
    perp_context *context;
    perp_contact_solver *solver;
    perp_contact_step step;
    perp_contact_result result;
    perp_contact_laws laws;
    perp_contact_dynamics dynamics;
    perp_matrix views[2];
    double mass[4], damping[N], velocity[N], force[N], J[ROWS * N], gaps[ROWS];
    double M[N * N], H[3 * N], f[N], w[3], v[N], r[3], u[3], start[3];
    double acceleration[N], row_force[ROWS], force_of_rows[N], mu, bound, scale[3 * N], rows[3];
    double lower;
    const double *at_J, *at_gaps;
    double *at_force;
    int32_t modes[2];
} block;

static const int32_t mass_sources[N * N] = {0, -1, 2, -1, 1, -1, 2, -1, 3};
static const int32_t diagonal[N] = {0, 4, 8};
static const int32_t H_rows[3] = {3, 2, 0}, gap_rows[1] = {0}, gap_sources[1] = {3};
static const int32_t H_sources[3 * N] = {9, 10, 11, 6, 7, 8, 0, 1, 2};

#define H_STEP 0.01
#define WEIGHT 20.0

static inline void point(block *b)
{
    perp_contact_step *s = &b->step;

    s->n = N, s->contacts = 1, s->rows = 3, s->M_entries = N * N, s->H_entries = 3 * N;
    s->gap_count = 1, s->J_rows = ROWS, s->h = H_STEP;
    s->mass = b->mass, s->damping = b->damping, s->velocity = b->velocity, s->force = b->force;
    s->J = &b->at_J, s->gaps = &b->at_gaps, s->row_force = &b->at_force,
    s->mass_sources = mass_sources, s->mass_diagonal = diagonal;
    s->H_sources = H_sources, s->H_scale = b->scale, s->gap_rows = gap_rows;
    s->gap_sources = gap_sources, s->H_rows = H_rows, s->row_scale = b->rows;
    s->M = b->M, s->H = b->H, s->f = b->f, s->w = b->w, s->v = b->v, s->r = b->r, s->u = b->u;
    s->start = b->start, s->modes = b->modes, s->acceleration = b->acceleration;
    s->force_of_rows = b->force_of_rows;
}

static inline int setup(void **state)
{
    static block b;
    static const double J[ROWS * N] = {0, 0, 1, 0, 0, 0, -1, 0, 0, 0, 1, 0};

    memset(&b, 0, sizeof b);
    assert_int_equal(perp_context_create(&b.context, NULL), PERP_OK);
    assert_int_equal(perp_contact_solver_create(b.context, &b.solver, NULL), PERP_OK);
    perp_struct_init(&b.step, sizeof b.step);
    perp_struct_init(&b.result, sizeof b.result);
    perp_contact_laws_init(&b.laws, sizeof b.laws);
    perp_struct_init(&b.dynamics, sizeof b.dynamics);
    memcpy(b.J, J, sizeof J);
    b.mass[0] = b.mass[1] = 2.0, b.mass[3] = 1.0;
    b.force[1] = -WEIGHT;
    b.row_force[1] = NAN; /* is to become 0 */
    for (int k = 0; k < 3 * N; k++)
        b.scale[k] = k / N == 1 ? -1.0 : 1.0;
    b.rows[0] = b.rows[2] = 1.0, b.rows[1] = -1.0;
    b.mu = 0.5, b.bound = H_STEP * 3.0, b.lower = -b.bound;
    for (int k = 0; k < 2; k++) {
        perp_struct_init(&b.views[k], sizeof b.views[k]);
        b.views[k].rows = b.views[k].columns = N;
        b.views[k].leading_dimension = N;
        b.views[k].storage = (int32_t)PERP_STORAGE_ROW_MAJOR;
        b.views[k].values = k ? b.H : b.M;
    }
    b.dynamics.n = N, b.dynamics.M = &b.views[0], b.dynamics.H = &b.views[1];
    b.laws.contacts = 1, b.laws.dim = 2, b.laws.mu = &b.mu;
    b.laws.bounded = 1, b.laws.lower = &b.lower, b.laws.upper = &b.bound;
    b.at_J = b.J, b.at_gaps = b.gaps, b.at_force = b.row_force;
    point(&b);
    *state = &b;
    return 0;
}

static inline int teardown(void **state)
{
    block *b = *state;

    perp_contact_solver_destroy(b->solver);
    perp_context_destroy(b->context);
    return 0;
}

#define TEST(f) cmocka_unit_test_setup_teardown(f, setup, teardown)

#define near(is, should, tolerance) assert_true(fabs((is) - (should)) <= (tolerance))

/* A few operations on numbers near 1, and tol 1e-8 of impulses that two steps of Newton make exact
 */
#define CLOSE 1e-13

static inline perp_status try_step(block *b)
{
    return perp_contact_solver_step(b->solver, &b->step, &b->result, &b->laws, &b->dynamics);
}

static inline void advance(block *b)
{
    assert_int_equal(try_step(b), PERP_OK);
    assert_int_equal(b->result.outcome, PERP_OUTCOME_SOLVED);
}

/* What a refused step may not touch. */
typedef struct answer {
    double v[N], r[3], u[3], start[3], acceleration[N], row_force[ROWS], force_of_rows[N];
    int32_t modes[2];
} answer;

static inline answer answer_of(const block *b)
{
    answer a;

    memset(&a, 0, sizeof a);
    memcpy(a.v, b->v, sizeof a.v);
    memcpy(a.r, b->r, sizeof a.r);
    memcpy(a.u, b->u, sizeof a.u);
    memcpy(a.start, b->start, sizeof a.start);
    memcpy(a.acceleration, b->acceleration, sizeof a.acceleration);
    memcpy(a.row_force, b->row_force, sizeof a.row_force);
    memcpy(a.force_of_rows, b->force_of_rows, sizeof a.force_of_rows);
    memcpy(a.modes, b->modes, sizeof a.modes);
    return a;
}

/* At rest under a load, known to be: a step that is refused twice may not be answered from that. */
static inline void rest(block *b)
{
    b->force[0] = 4.0;
    b->step.warm = 1;
    b->row_force[1] = 0.0;
    advance(b);
    advance(b);
    assert_int_equal(b->step.rests, 1);
}

static inline void require_refused(block *b, perp_status expected, const char *message)
{
    const answer before = answer_of(b);

    for (int k = 0; k < 2; k++) {
        answer after;
        perp_status status = try_step(b);

        if (status != expected || !strstr(perp_context_message(b->context), message))
            fail_msg("%s: status %d, '%s'", message, (int)status, perp_context_message(b->context));
        after = answer_of(b);
        assert_memory_equal(&after, &before, sizeof before);
    }
}

/* After a refusal: the old numbers are solved anew, and have the old answer. */
static inline void require_usable(block *b)
{
    b->step.warm = 0;
    advance(b);
    near(b->row_force[3], WEIGHT, CLOSE);
    near(b->row_force[2], 4.0, CLOSE);
    b->step.warm = 1;
    advance(b);
    assert_int_equal(b->step.rests, 1);
}

#endif
