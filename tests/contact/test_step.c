/* perp_contact_solver_step: a block on a table, as a simulator has it that keeps its rows in
 * another order; against closed forms. What is refused: test_step_refusals.c. */
#include "suite.h"

#include "contact/solver.h"
#include "step_block.h"

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
    assert_int_equal(b->solver->steps, 0); /* the handle solves other problems as if it made none */
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

/* y and the slider, which the contact's row joins, go half as far where one of them may; x, which
 * nothing joins with them, is opened by the other row's 1 cm in full, and shortened alone. */
static void test_overlaps_are_taken_away_within_a_reach(void **state)
{
    static const int32_t rows[2] = {0, 2}, sources[2] = {3, 0};
    static const double reaches[2][N] = {{INFINITY, 2e-3, INFINITY}, {1e-3, INFINITY, INFINITY}};
    const double g = 6e-3 / H_STEP; /* y and s alone: 2/3 of it each, x: 1 cm a step */
    block *b = *state;
    static double shift[N], shares[N];

    b->J[3 * N + 2] = 0.5, b->J[0] = 1.0, b->J[2] = 0.0;
    b->lower = 0.0, b->bound = INFINITY;
    b->step.by_rows = 1;
    b->step.shift = shift, b->step.slop = 0.0, b->step.correction = 1.0;
    b->step.gap_count = 2, b->step.gap_rows = rows, b->step.gap_sources = sources;
    b->gaps[3] = -6e-3, b->gaps[0] = -1e-2;
    b->step.shares = shares;
    for (int k = 0; k < 2; k++) {
        const double of_y = k == 0 ? 0.5 : 1.0, of_x = k == 0 ? 1.0 : 0.1;

        b->step.reach = reaches[k];
        b->step.rests = 0;
        advance(b);
        near(shift[0], of_x * 1e-2 / H_STEP, CLOSE);
        near(shift[1], of_y * 2.0 / 3.0 * g, CLOSE);
        near(shift[2], of_y * 2.0 / 3.0 * g, CLOSE);
        near(shares[0], of_x, CLOSE);
        near(shares[1], of_y, CLOSE);
        near(shares[2], of_y, CLOSE);
    }
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

/* The block a star of 1e20 kg, 1e300 m deep in the table: the step is a step, and what would open
 * that is beyond numbers. */
static void test_overlaps_beyond_numbers(void **state)
{
    block *b = *state;
    double shift[N] = {1.0, 2.0, 3.0};

    b->mass[0] = b->mass[1] = 1e20;
    b->gaps[3] = -1e300;
    b->step.shift = shift, b->step.slop = 0.0, b->step.correction = 1.0;
    advance(b);
    assert_int_equal(b->step.shifts, 0);
    assert_true(shift[0] == 1.0 && shift[1] == 2.0 && shift[2] == 3.0);
}

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
        TEST(test_overlaps_are_taken_away_within_a_reach),
        TEST(test_overlaps_beyond_numbers),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
