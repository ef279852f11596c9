/* perp_contact_solver_step: a block on a table, as a simulator has it that keeps its rows in
 * another order; against closed forms. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <string.h>

#include <perp/perp.h>

#include "memory.h"

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

static void point(block *b)
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

static int setup(void **state)
{
    static block b;
    static const double J[ROWS * N] = {0, 0, 1, 0, 0, 0, -1, 0, 0, 0, 1, 0};

    memset(&b, 0, sizeof b);
    assert_int_equal(perp_context_create(&b.context, NULL), PERP_OK);
    assert_int_equal(perp_contact_solver_create(b.context, &b.solver, NULL), PERP_OK);
    perp_contact_step_init(&b.step, sizeof b.step);
    perp_contact_result_init(&b.result, sizeof b.result);
    perp_contact_laws_init(&b.laws, sizeof b.laws);
    perp_contact_dynamics_init(&b.dynamics, sizeof b.dynamics);
    memcpy(b.J, J, sizeof J);
    b.mass[0] = b.mass[1] = 2.0, b.mass[3] = 1.0;
    b.force[1] = -WEIGHT;
    b.row_force[1] = NAN; /* is to become 0 */
    for (int k = 0; k < 3 * N; k++)
        b.scale[k] = k / N == 1 ? -1.0 : 1.0;
    b.rows[0] = b.rows[2] = 1.0, b.rows[1] = -1.0;
    b.mu = 0.5, b.bound = H_STEP * 3.0, b.lower = -b.bound;
    for (int k = 0; k < 2; k++) {
        perp_matrix_init(&b.views[k], sizeof b.views[k]);
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

static int teardown(void **state)
{
    block *b = *state;

    perp_contact_solver_destroy(b->solver);
    perp_context_destroy(b->context);
    return 0;
}

#define near(is, should, tolerance) assert_true(fabs((is) - (should)) <= (tolerance))

static void advance(block *b)
{
    assert_int_equal(
        perp_contact_solver_step(b->solver, &b->step, &b->result, &b->laws, &b->dynamics), PERP_OK);
    assert_int_equal(b->result.outcome, PERP_OUTCOME_SOLVED);
}

/* A few operations on numbers near 1, and tol 1e-8 of impulses that two steps of Newton make exact
 */
#define CLOSE 1e-13

static void test_slides(void **state)
{
    block *b = *state;

    b->velocity[0] = 1.0;
    b->force[2] = 5.0; /* 2 more than the slider's friction */
    b->damping[0] = 100.0;
    advance(b);
    /* (m + h c) (v - v0) = -mu h W,   m s = h (5 - 3) */
    near(b->v[0], 1.0 - H_STEP * 0.5 * WEIGHT / 3.0, CLOSE);
    assert_true(b->v[1] == 0.0);
    near(b->v[2], H_STEP * 2.0, CLOSE);
    near(b->row_force[3], WEIGHT, CLOSE);
    near(b->row_force[2], 0.5 * WEIGHT, CLOSE); /* along -x */
    near(b->row_force[0], -3.0, CLOSE);
    assert_true(b->row_force[1] == 0.0);
    near(b->force_of_rows[0], -0.5 * WEIGHT, CLOSE);
    near(b->force_of_rows[1], WEIGHT, CLOSE);
    near(b->force_of_rows[2], -3.0, CLOSE);
    for (int i = 0; i < N; i++)
        near(b->acceleration[i], (b->v[i] - b->velocity[i]) / H_STEP, CLOSE / H_STEP);
    assert_int_equal(b->step.slips, 1);
    near(b->step.fastest, b->v[0], 0.0);
    assert_int_equal(b->step.rests, 0);
    assert_memory_equal(b->start, b->r, sizeof b->r);
}

static void test_rest_is_known(void **state)
{
    block *b = *state;

    b->force[0] = 4.0;
    advance(b);
    b->step.warm = 1;
    advance(b); /* from its answer: the same */
    assert_int_equal(b->step.rests, 1);
    assert_true(b->step.fastest == 0.0);
    b->row_force[3] = 0.0; /* as where a simulator makes room anew */
    advance(b);
    assert_int_equal(b->step.was_known, 1);
    near(b->row_force[3], WEIGHT, CLOSE);
    b->force[0] = 4.0 + 0x1p-50; /* a bit more */
    advance(b);
    assert_int_equal(b->step.was_known, 0);
    b->force[0] = 16.0; /* more than mu W */
    advance(b);
    near(b->v[0], H_STEP * (16.0 - 0.5 * WEIGHT) / 2.0, CLOSE);
}

static void test_a_gap_closes_no_further(void **state)
{
    block *b = *state;

    b->velocity[1] = -1.0;
    b->gaps[3] = 0.002;
    advance(b);
    near(b->v[1], -0.2, CLOSE);
    assert_true(b->step.least_gap == 0.0);
    b->gaps[3] = -0.003;
    advance(b);
    assert_true(b->v[1] == 0.0);
    assert_true(b->step.least_gap == -0.003);
}

static void test_equations_are_corrected(void **state)
{
    static const int32_t G_rows[1] = {0}, G_sources[N] = {0, 1, 2};
    block *b = *state;
    double G[N] = {0.0}, bilateral = 0.0;
    double r[3], u[3], start[3] = {0.0};
    perp_matrix view = b->views[1];

    /* the slider's row is an equation now, 1 mm off; the contact has no other rows beside it */
    b->laws.bounded = 0;
    b->views[1].rows = 2;
    view.rows = 1, view.values = G;
    b->dynamics.G = &view;
    b->step.rows = 2, b->step.H_entries = 2 * N, b->step.bilateral = 1, b->step.G_entries = N;
    b->step.G = G, b->step.b = &bilateral, b->step.G_rows = G_rows, b->step.G_sources = G_sources;
    b->step.r = r, b->step.u = u, b->step.start = start;
    b->step.correction = 0.2, b->gaps[0] = 1e-3;
    advance(b);
    near(b->v[2], -0.2 * 1e-3 / H_STEP, CLOSE);
    near(b->row_force[0], b->v[2] / H_STEP, CLOSE / H_STEP);
}

/* The normal's row is (0, 1, 1/2), M = diag(2, 2, 1): the least velocity that opens by g a second
 * is M^-1 a g / (a'M^-1 a), a the row, that is (0, 2, 2) g / 3. */
static void test_overlaps_are_taken_away(void **state)
{
    const double share = 0.2, slop = 1e-3, overlap = 1e-2, g = share * (overlap - slop) / H_STEP;
    block *b = *state;
    double shift[N] = {NAN, NAN, NAN};

    b->J[3 * N + 2] = 0.5;
    b->bound = 1.0, b->lower = -1.0; /* the slider's friction bears what the contact leaves it */
    b->step.by_rows = 1;
    b->step.shift = shift, b->step.slop = slop, b->step.correction = share;
    b->gaps[3] = -2.0 * slop;
    advance(b);
    assert_int_equal(b->step.shifts, 0);
    assert_true(isnan(shift[1]));
    b->gaps[3] = -overlap;
    for (int warm = 0; warm < 3; warm++) { /* the last of which finds all at rest */
        b->step.warm = 1;
        memset(shift, 0, sizeof shift);
        advance(b);
        assert_int_equal(b->step.shifts, 1);
        near(shift[0], 0.0, CLOSE);
        near(shift[1], 2.0 / 3.0 * g, CLOSE);
        near(shift[2], 2.0 / 3.0 * g, CLOSE);
    }
    assert_int_equal(b->step.was_known, 1);
    b->gaps[3] = -1e308; /* no velocity opens that in a step */
    advance(b);
    assert_int_equal(b->step.shifts, 0);
}

/* Two rows with gaps, the second a limit of the slider's from above with bounds of its own, -r: it
 * is 4 mm away and stays so; and with an equation on the slider nothing there moves. */
static void test_overlaps_close_nothing_else(void **state)
{
    static const int32_t rows[2] = {0, 2}, sources[2] = {3, 0}, G_rows[1] = {1};
    const double share = 1.0, overlap = 1e-2;
    block *b = *state;
    double shift[N], G[N] = {0.0}, bilateral = 0.0, r[4], u[4], start[4] = {0.0};
    perp_matrix view = b->views[1];

    b->J[3 * N + 2] = 0.5, b->J[2] = -1.0;
    b->lower = 0.0, b->bound = INFINITY;
    b->step.by_rows = 1;
    b->step.shift = shift, b->step.slop = 0.0, b->step.correction = share;
    b->step.gap_count = 2, b->step.gap_rows = rows, b->step.gap_sources = sources;
    b->gaps[3] = -overlap, b->gaps[0] = 4e-3;
    advance(b);
    near(shift[0], 0.0, CLOSE); /* y + s / 2 = 1 cm a step, s = 4 mm a step */
    near(shift[1], 0.8, CLOSE);
    near(shift[2], 0.4, CLOSE);

    b->J[N + 2] = 1.0;
    view.rows = 1, view.values = G;
    b->dynamics.G = &view;
    b->step.bilateral = 1, b->step.G_entries = N, b->step.G = G, b->step.b = &bilateral;
    b->step.G_rows = G_rows, b->step.r = r, b->step.u = u, b->step.start = start;
    b->step.rests = 0;
    advance(b);
    for (int i = 0; i < N; i++)
        near(shift[i], i == 1 ? 1.0 : 0.0, 1e-8); /* tol, of 1 m/s: the rows depend on each other */
}

/* Between two walls that are too near each other, 3 cm in the one and 1 cm in the other: to the
 * middle, but for the tenth by which rows yield. With one wall gone the shift is exact again, some
 * steps later. */
static void test_overlaps_that_contradict_each_other(void **state)
{
    static const int32_t rows[2] = {0, 2}, sources[2] = {3, 0};
    block *b = *state;
    double shift[N];

    b->J[2] = 0.0, b->J[1] = -1.0; /* the slider's limit bounds y, too */
    b->lower = 0.0, b->bound = INFINITY;
    b->step.by_rows = 1;
    b->step.shift = shift, b->step.slop = 0.0, b->step.correction = 1.0;
    b->step.gap_count = 2, b->step.gap_rows = rows, b->step.gap_sources = sources;
    b->gaps[3] = -3e-2, b->gaps[0] = -1e-2;
    advance(b);
    assert_int_equal(b->step.shifts, 1);
    near(shift[0], 0.0, CLOSE);
    near(shift[1], 1e-2 / H_STEP, 0.1 * 1e-2 / H_STEP);
    near(shift[2], 0.0, CLOSE);
    b->gaps[0] = 1.0;
    for (int k = 0; k < 40; k++) {
        b->step.rests = 0;
        advance(b);
    }
    near(shift[1], 3e-2 / H_STEP, 1e-8); /* tol, of 1 m/s: from the last answer */
}

static void test_hand_back_takes_what_it_is_given(void **state)
{
    block *b = *state;

    advance(b);
    b->v[2] = 0.5;
    b->r[2] = 0.01;
    assert_int_equal(perp_contact_solver_hand_back(b->solver, &b->step), PERP_OK);
    assert_true(b->row_force[0] == 0.01 / H_STEP && b->start[2] == 0.01);
    near(b->acceleration[2], 0.5 / H_STEP, CLOSE / H_STEP);
    assert_true(b->step.fastest == 0.5);
    near(b->step.driven, 0.5 * WEIGHT * H_STEP, CLOSE); /* of a mass of 2 that falls */
}

/* One field of structs that lie in a row, which are somewhere else in the next step. */
static void test_what_is_watched(void **state)
{
    struct {
        double other;
        int32_t name, more;
    } rows[2] = {{1.0, 5, 0}, {2.0, 7, 0}}, moved[2];
    const int32_t seen[2] = {5, 7};
    const void *at = rows;
    const perp_contact_watch watch = {&at, seen, 2, sizeof(double), sizeof rows[0], sizeof seen[0]};
    block *b = *state;

    b->step.watches = &watch, b->step.watch_count = 1;
    advance(b);
    assert_int_equal(b->step.is_other, 0);
    memcpy(moved, rows, sizeof rows);
    at = moved;
    moved[1].other = 3.0;
    b->v[0] = 8.0;
    advance(b);
    assert_int_equal(b->step.is_other, 0);
    assert_true(b->v[0] == 0.0);
    moved[1].name = 8;
    b->v[0] = 8.0;
    advance(b);
    assert_int_equal(b->step.is_other, 1);
    assert_true(b->v[0] == 8.0);
    at = NULL, b->at_J = NULL; /* there are no rows now: not an error */
    advance(b);
    assert_int_equal(b->step.is_other, 1);
    assert_true(b->v[0] == 8.0);
}

static perp_status try_step(block *b)
{
    return perp_contact_solver_step(b->solver, &b->step, &b->result, &b->laws, &b->dynamics);
}

/* What a refused step may not touch. */
typedef struct answer {
    double v[N], r[3], u[3], start[3], acceleration[N], row_force[ROWS], force_of_rows[N];
    int32_t modes[2];
} answer;

static answer answer_of(const block *b)
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
static void rest(block *b)
{
    b->force[0] = 4.0;
    b->step.warm = 1;
    b->row_force[1] = 0.0;
    advance(b);
    advance(b);
    assert_int_equal(b->step.rests, 1);
}

static void require_refused(block *b, perp_status expected, const char *message)
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
static void require_usable(block *b)
{
    b->step.warm = 0;
    advance(b);
    near(b->row_force[3], WEIGHT, CLOSE);
    near(b->row_force[2], 4.0, CLOSE);
    b->step.warm = 1;
    advance(b);
    assert_int_equal(b->step.rests, 1);
}

static void test_what_is_missing(void **state)
{
    block *b = *state;
    const struct {
        void *field;
        const char *message;
    } needed[] = {
        {&b->step.mass, "step.mass is NULL"},
        {&b->step.mass_sources, "step.mass_sources is NULL"},
        {&b->step.mass_diagonal, "step.mass_diagonal is NULL"},
        {&b->step.velocity, "step.velocity is NULL"},
        {&b->step.force, "step.force is NULL"},
        {&b->step.J, "step.J is NULL"},
        {&b->at_J, "*step.J is NULL"},
        {&b->step.gaps, "step.gaps is NULL"},
        {&b->at_gaps, "*step.gaps is NULL"},
        {&b->step.H_sources, "step.H_sources is NULL"},
        {&b->step.gap_rows, "step.gap_rows is NULL"},
        {&b->step.gap_sources, "step.gap_sources is NULL"},
        {&b->step.H_rows, "step.H_rows is NULL"},
        {&b->step.M, "step.M is NULL"},
        {&b->step.H, "step.H is NULL"},
        {&b->step.f, "step.f is NULL"},
        {&b->step.w, "step.w is NULL"},
        {&b->step.v, "step.v is NULL"},
        {&b->step.r, "step.r is NULL"},
        {&b->step.start, "step.start is NULL"},
        {&b->step.modes, "step.modes is NULL"},
        {&b->step.acceleration, "step.acceleration is NULL"},
        {&b->step.force_of_rows, "step.force_of_rows is NULL"},
    };

    rest(b);
    for (size_t k = 0; k < sizeof needed / sizeof *needed; k++) {
        void *was, *none = NULL;

        memcpy(&was, needed[k].field, sizeof was);
        memcpy(needed[k].field, &none, sizeof none);
        require_refused(b, PERP_ERROR_ARGUMENT, needed[k].message);
        memcpy(needed[k].field, &was, sizeof was);
        require_usable(b);
    }
}

static int32_t mass_solve(double *x, int32_t columns, void *user)
{
    const double *mass = user;

    for (int32_t i = 0; i < columns * N; i++)
        x[i] /= mass[i % N == 2 ? 3 : 0];
    return 0;
}

/* f = M v + h force takes an M. */
static void test_a_callback_is_no_mass(void **state)
{
    block *b = *state;

    rest(b);
    b->dynamics.M = NULL, b->dynamics.solve = mass_solve, b->dynamics.user = b->mass;
    b->step.rests = 0;
    require_refused(b, PERP_ERROR_ARGUMENT, "perp_contact_solver_step with an M");
    b->dynamics.M = &b->views[0], b->dynamics.solve = NULL, b->dynamics.user = NULL;
    require_usable(b);
}

static void test_places_out_of_range(void **state)
{
    static const int32_t bad[] = {-1, INT32_MIN, 3, INT32_MAX};
    block *b = *state;
    int32_t gap_row = 0, gap_source = 3, rows[3] = {3, 2, 0}, diagonals[N] = {0, 4, 8};
    int32_t sources[3 * N];

    memcpy(sources, H_sources, sizeof sources);
    b->step.gap_rows = &gap_row, b->step.gap_sources = &gap_source, b->step.H_rows = rows;
    b->step.H_sources = sources, b->step.mass_diagonal = diagonals;
    rest(b);
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        gap_row = bad[k];
        require_refused(b, PERP_ERROR_ARGUMENT, "step.gap_rows[0] is");
        gap_row = 0;
        gap_source = bad[k] == 3 ? 4 : bad[k];
        require_refused(b, PERP_ERROR_ARGUMENT, "step.gap_sources[0] is");
        gap_source = 3;
        rows[2] = bad[k] == 3 ? 4 : bad[k];
        require_refused(b, PERP_ERROR_ARGUMENT, "step.H_rows[2] is");
        rows[2] = 0;
        diagonals[1] = bad[k] == 3 ? 9 : bad[k];
        require_refused(b, PERP_ERROR_ARGUMENT, "step.mass_diagonal[1] is");
        diagonals[1] = 4;
        if (bad[k] < 0) { /* nobody told how long J is */
            sources[4] = bad[k];
            require_refused(b, PERP_ERROR_ARGUMENT, "step.H_sources[4] is");
            sources[4] = H_sources[4];
        }
        require_usable(b);
    }
    diagonals[1] = 0;
    require_refused(b, PERP_ERROR_ARGUMENT, "expected more than the one before");
    diagonals[1] = 4;
    require_usable(b);
}

/* H, whole rows of J, to the bit what its entries one by one are; and a change of one is seen. */
static void test_whole_rows(void **state)
{
    block *b = *state;
    double H[3 * N];

    b->velocity[0] = 1.0;
    advance(b);
    memcpy(H, b->H, sizeof H);
    memset(b->H, 0, sizeof b->H);
    b->step.H_sources = NULL, b->step.H_scale = NULL, b->step.by_rows = 1;
    advance(b);
    assert_memory_equal(b->H, H, sizeof H);
    near(b->v[0], 1.0 - b->mu * WEIGHT / 2.0 * H_STEP, CLOSE);
    b->velocity[0] = 0.0;
    rest(b);
    advance(b);
    assert_int_equal(b->step.was_known, 1);
    for (int row = 2; row < ROWS; row++) { /* the tangent, with a scale, and the normal, without */
        b->J[row * N + 2] = 0.0625;
        advance(b);
        assert_int_equal(b->step.was_known, 0);
        assert_true(b->H[(ROWS - 1 - row) * N + 2] == (row == 2 ? -0.0625 : 0.0625));
        b->J[row * N + 2] = 0.0;
        require_usable(b);
    }
    b->step.H_entries--;
    require_refused(b, PERP_ERROR_ARGUMENT, "H_entries or G_entries are not rows times n");
    b->step.H_entries++;
    b->step.shift = b->acceleration, b->step.slop = -1.0;
    require_refused(b, PERP_ERROR_ARGUMENT, "step.slop is -1, expected a length >= 0");
    b->step.shift = NULL;
    require_usable(b);
}

static void test_sizes_that_do_not_fit(void **state)
{
    block *b = *state;
    const struct {
        int32_t *field, value;
        const char *message;
    } wrong[] = {
        {&b->step.n, 2, "step.n is 2, but laws and dynamics have 3"},
        {&b->step.contacts, 2, "step.contacts is 2, but laws and dynamics have 1"},
        {&b->step.rows, 2, "step.rows is 2, but laws and dynamics have 3"},
        {&b->step.contacts, 0, "step.contacts is 0, but laws and dynamics have 1"},
        {&b->step.rows, -1, "step has a count below 0"},
        {&b->step.M_entries, -1, "step has a count below 0"},
        {&b->step.watch_count, -1, "step has a count below 0"},
        {&b->step.watch_count, 1, "step.watches is NULL"},
        {&b->step.bilateral, 1, "step.G_rows is NULL"},
        {&b->dynamics.n, 2, "M is 3 by 3, expected 2 by 2"},
        {&b->laws.contacts, 2, ""},
    };

    rest(b);
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        const int32_t was = *wrong[k].field;

        *wrong[k].field = wrong[k].value;
        b->step.rests = 0;
        require_refused(b, PERP_ERROR_ARGUMENT, wrong[k].message);
        *wrong[k].field = was;
        require_usable(b);
    }
    b->step.h = 0.0;
    require_refused(b, PERP_ERROR_ARGUMENT, "step.h is 0, expected a time > 0");
    b->step.h = NAN;
    require_refused(b, PERP_ERROR_ARGUMENT, "step.h is ");
    b->step.h = H_STEP;
    require_usable(b);
}

static void test_numbers_that_are_none(void **state)
{
    static const double none[] = {NAN, INFINITY, -INFINITY};
    block *b = *state;
    double *numbers[] = {&b->mass[1], &b->mass[3], &b->velocity[2], &b->force[0],  &b->J[11],
                         &b->J[6],    &b->gaps[3], &b->scale[0],    &b->damping[1]};

    b->dynamics.M = &b->views[0];
    rest(b);
    for (size_t k = 0; k < sizeof numbers / sizeof *numbers; k++)
        for (size_t i = 0; i < sizeof none / sizeof *none; i++) {
            const double was = *numbers[k];

            if (numbers[k] == &b->gaps[3] && none[i] < 0.0)
                continue; /* deep: no velocity */
            *numbers[k] = none[i];
            require_refused(b, PERP_ERROR_NOT_FINITE, "");
            *numbers[k] = was;
            require_usable(b);
        }
    b->r[1] = NAN;
    assert_int_equal(perp_contact_solver_hand_back(b->solver, &b->step), PERP_ERROR_NOT_FINITE);
    assert_string_equal(perp_context_message(b->context), "step.r[1] is nan");
}

/* Each allocation of a first step, and of one that needs more room, fails once. */
static void test_memory_runs_out(void **state)
{
    block *b = *state;
    memory m = {0, 0, 0};
    perp_context_settings settings = memory_settings(&m);
    answer untouched;
    double shift[N];
    int k;

    b->step.shift = shift, b->gaps[3] = -0.01;
    perp_contact_solver_destroy(b->solver);
    perp_context_destroy(b->context);
    assert_int_equal(perp_context_create(&b->context, &settings), PERP_OK);
    for (k = 1;; k++) {
        answer after;
        perp_status status;

        assert_int_equal(perp_contact_solver_create(b->context, &b->solver, NULL), PERP_OK);
        b->force[0] = 4.0, b->row_force[1] = 0.0, b->step.rests = 0, b->step.warm = 1;
        memset(b->start, 0, sizeof b->start);
        untouched = answer_of(b);
        m.calls = 0, m.fails_at = k;
        status = try_step(b);
        m.fails_at = 0;
        if (status == PERP_OK) {
            require_usable(b);
            break;
        }
        assert_int_equal(status, PERP_ERROR_MEMORY);
        assert_string_not_equal(perp_context_message(b->context), "");
        after = answer_of(b);
        assert_memory_equal(&after, &untouched, sizeof after);
        require_usable(b);
        perp_contact_solver_destroy(b->solver);
    }
    assert_true(k > 3);
    perp_contact_solver_destroy(b->solver);
    perp_context_destroy(b->context); /* whose memory ends here */
    b->solver = NULL, b->context = NULL;
}

static void test_who_may_not_be_asked(void **state)
{
    block *b = *state;

    assert_int_equal(perp_contact_solver_hand_back(b->solver, &b->step), PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_contact_solver_step(NULL, &b->step, &b->result, &b->laws, &b->dynamics),
                     PERP_ERROR_HANDLE);
    assert_int_equal(perp_contact_solver_hand_back(NULL, &b->step), PERP_ERROR_HANDLE);
    assert_int_equal(perp_contact_solver_step(b->solver, NULL, &b->result, &b->laws, &b->dynamics),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_contact_solver_hand_back(b->solver, NULL), PERP_ERROR_ARGUMENT);
    b->step.struct_size = 8;
    assert_int_equal(try_step(b), PERP_ERROR_ABI);
}

#define TEST(f) cmocka_unit_test_setup_teardown(f, setup, teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(test_slides),
        TEST(test_rest_is_known),
        TEST(test_a_gap_closes_no_further),
        TEST(test_equations_are_corrected),
        TEST(test_hand_back_takes_what_it_is_given),
        TEST(test_what_is_watched),
        TEST(test_whole_rows),
        TEST(test_overlaps_are_taken_away),
        TEST(test_overlaps_close_nothing_else),
        TEST(test_overlaps_that_contradict_each_other),
        TEST(test_what_is_missing),
        TEST(test_a_callback_is_no_mass),
        TEST(test_places_out_of_range),
        TEST(test_sizes_that_do_not_fit),
        TEST(test_numbers_that_are_none),
        TEST(test_memory_runs_out),
        TEST(test_who_may_not_be_asked),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
