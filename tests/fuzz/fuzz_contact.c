/* The contact solver over dynamics: bodies (blocks of 3 or 6), dense and sparse M or a callback in
 * its place, joints, several solves with warm starts; and the same numbers as a simulator has them
 * that keeps its own order (perp_contact_solver_step). */
#include <math.h>
#include <string.h>

#include "dynamics.h"

static void solve(fuzz_bytes *bytes, perp_context *context, perp_contact_solver *solver,
                  const perp_contact_settings *settings, const laws_problem *p, dynamics_problem *d)
{
    double *v = fuzz_doubles(d->n), *r = fuzz_doubles(p->rows), *u = fuzz_doubles(p->rows);
    double *ray = fuzz_doubles(p->rows), *r0 = fuzz_doubles(p->rows);
    int32_t *modes = fuzz_take(p->laws.contacts + p->laws.bounded, sizeof *modes);
    wide *W = fuzz_take(p->rows * p->rows, sizeof *W), *q = fuzz_take(p->rows, sizeof *q);
    wide *t = fuzz_take(p->rows, sizeof *t);
    perp_contact_result result;
    int warm = fuzz_one_in(bytes, 3), i;

    fuzz_show("r", r, p->rows);
    fuzz_show("v", v, d->n);
    fuzz_show("mu", p->mu, p->laws.contacts);
    if (warm)
        fuzz_numbers(bytes, FUZZ_MODERATE, r0, p->rows);
    if (perp_struct_init(&result, sizeof result) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    if (!fuzz_status_of(context,
                        perp_contact_solver_solve_dynamics(solver, ANSWER(v, r, u, modes, ray),
                                                           &result, d->f, d->w, d->b,
                                                           warm ? r0 : NULL),
                        "solve_dynamics", (const void *[]){v, r, u, modes, ray, NULL}))
        return;
    for (i = 0; i < p->rows; i++)
        if (!isfinite(r[i])) {
            if (fuzz_good(result.outcome))
                fuzz_finite("r", r, p->rows);
            return;
        }
    dynamics_reduce(p, d, oracle_limit(result.outcome, settings->tol), r, W, q, t);
    laws_check("contact", p, W, q, t, settings, &result, r, u, modes);
    if (fuzz_good(result.outcome)) {
        const int mark = fuzz_mark();

        dynamics_check(p, d, settings->tol, v, r, W, t);
        dynamics_differentiate(context, settings, p, d, r);
        fuzz_drop_to(mark);
    }
}

/* ---- perp_contact_solver_step ---------------------------------------------------------------- */

/* A simulator's side of the problem: every array of H and G's numbers lies backwards in J, M's in
 * mass, the rows of J are the problem's backwards, with two in between that are nobody's. */
typedef struct simulator {
    perp_contact_step step;
    double *mass, *damping, *velocity, *force, *J, *gaps;
    const double *at_J, *at_gaps;
    double *at_force;
} simulator;

static int64_t numbers_of(const perp_matrix *view, int32_t lines)
{
    return view->storage == PERP_STORAGE_CSC ? view->column_starts[view->columns]
                                             : view->leading_dimension * lines;
}

static int32_t count_numbers(const fuzz_matrix *m)
{
    return (int32_t)numbers_of(
        &m->view, m->view.storage == PERP_STORAGE_ROW_MAJOR ? m->view.rows : m->view.columns);
}

/* Where M_ii is. */
static int32_t find_diagonal(const perp_matrix *M, int32_t i)
{
    int32_t k;

    if (M->storage != PERP_STORAGE_CSC)
        return i * ((int32_t)M->leading_dimension + 1);
    for (k = M->column_starts[i]; M->row_indices[k] != i; k++)
        ;
    return k;
}

/* sources[k] = last - k, and the numbers there, over `scale` (a power of 2) or as they are. */
static int32_t *turn_round(double *to, int32_t last, const double *values, int32_t count,
                           const double *scale)
{
    int32_t *sources = fuzz_take(count, sizeof *sources), k;

    for (k = 0; k < count; k++) {
        sources[k] = last - k;
        to[last - k] = scale ? values[k] / scale[k] : values[k];
    }
    return sources;
}

static void make_matrices(fuzz_bytes *bytes, const dynamics_problem *d, simulator *sim)
{
    perp_contact_step *s = &sim->step;
    int32_t *diagonal = fuzz_take(d->n, sizeof *diagonal), i;
    double *scale = NULL;

    s->M_entries = count_numbers(&d->M);
    s->H_entries = count_numbers(&d->H);
    s->G_entries = d->bilateral > 0 ? count_numbers(&d->G) : 0;
    s->M = (double *)d->M.view.values;
    s->H = (double *)d->H.view.values;
    s->G = s->G_entries > 0 ? (double *)d->G.view.values : NULL;
    sim->mass = fuzz_doubles(s->M_entries);
    sim->J = fuzz_doubles(s->H_entries + s->G_entries);
    if (fuzz_one_in(bytes, 2)) {
        scale = fuzz_doubles(s->H_entries);
        for (i = 0; i < s->H_entries; i++)
            scale[i] = i % 3 == 1 ? -1.0 : 1.0;
    }
    s->mass_sources = turn_round(sim->mass, s->M_entries - 1, s->M, s->M_entries, NULL);
    s->H_sources = turn_round(sim->J, s->H_entries - 1, s->H, s->H_entries, scale);
    s->G_sources = turn_round(sim->J, s->H_entries + s->G_entries - 1, s->G, s->G_entries, NULL);
    s->H_scale = scale;
    for (i = 0; i < d->n; i++)
        diagonal[i] = find_diagonal(&d->M.view, i);
    s->mass_diagonal = diagonal;
    if (fuzz_one_in(bytes, 2)) {
        sim->damping = fuzz_doubles(d->n);
        for (i = 0; i < d->n; i++)
            sim->damping[i] = fuzz_pick(bytes, 4) * s->M[diagonal[i]]; /* no worse conditioned */
    }
}

static void make_lists(const laws_problem *p, const dynamics_problem *d, simulator *sim)
{
    perp_contact_step *s = &sim->step;
    int32_t *places = fuzz_take(p->rows, sizeof *places), k;
    int32_t *gap_rows = fuzz_take(p->laws.contacts, sizeof *gap_rows);
    int32_t *gap_sources = fuzz_take(p->laws.contacts, sizeof *gap_sources);

    s->n = d->n;
    s->contacts = s->gap_count = p->laws.contacts;
    s->bilateral = d->bilateral;
    s->rows = p->rows - d->bilateral;
    s->J_rows = p->rows + 2;
    for (k = 0; k < p->rows; k++)
        places[k] = p->rows + (k < s->rows) - k;
    for (k = 0; k < s->contacts; k++) {
        gap_rows[k] = p->first[k];
        gap_sources[k] = places[p->first[k]];
    }
    s->H_rows = places, s->G_rows = places + s->rows;
    s->gap_rows = gap_rows, s->gap_sources = gap_sources;
}

/* Loads that move things, none, or such as the contacts bear at rest. */
static void make_loads(fuzz_bytes *bytes, fuzz_mood mood, const laws_problem *p,
                       const dynamics_problem *d, simulator *sim)
{
    int32_t kind = fuzz_pick(bytes, 3), i, k;

    fuzz_numbers(bytes, mood, sim->velocity, d->n);
    fuzz_numbers(bytes, mood, sim->force, d->n);
    fuzz_numbers(bytes, mood, sim->gaps, sim->step.J_rows);
    for (i = 0; i < d->n && kind > 0; i++) {
        sim->velocity[i] = sim->force[i] = 0.0;
        for (k = 0; k < p->laws.contacts && kind > 1; k++)
            sim->force[i] -= d->H.dense[p->first[k] * d->n + i];
    }
    for (k = 0; k < sim->step.J_rows && kind > 0; k++)
        sim->gaps[k] = 0.0;
}

static void make_simulator(fuzz_bytes *bytes, fuzz_mood mood, const laws_problem *p,
                           dynamics_problem *d, simulator *sim)
{
    static const double times[] = {0.0009765625, 0.01, 1.0, 1e-6};
    perp_contact_step *s = &sim->step;

    memset(sim, 0, sizeof *sim);
    if (perp_struct_init(s, sizeof *s) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    make_lists(p, d, sim);
    make_matrices(bytes, d, sim);
    sim->velocity = fuzz_doubles(d->n), sim->force = fuzz_doubles(d->n);
    sim->gaps = fuzz_doubles(s->J_rows);
    make_loads(bytes, mood, p, d, sim);
    s->h = times[fuzz_pick(bytes, 4)];
    s->correction = fuzz_pick(bytes, 3) * 0.25;
    sim->at_J = sim->J, sim->at_gaps = sim->gaps;
    s->mass = sim->mass, s->damping = sim->damping, s->velocity = sim->velocity;
    s->force = sim->force, s->J = &sim->at_J, s->gaps = &sim->at_gaps;
    s->f = d->f, s->w = d->w, s->b = d->b;
    s->start = fuzz_doubles(p->rows);
    memset(s->start, 0, (size_t)p->rows * sizeof *s->start);
}

/* Outputs that nobody has written to. */
static void renew_outputs(const laws_problem *p, const dynamics_problem *d, simulator *sim)
{
    perp_contact_step *s = &sim->step;

    s->v = fuzz_doubles(d->n), s->r = fuzz_doubles(p->rows), s->u = fuzz_doubles(p->rows);
    s->modes = fuzz_take(p->laws.contacts + p->laws.bounded, sizeof *s->modes);
    s->acceleration = fuzz_doubles(d->n), s->force_of_rows = fuzz_doubles(d->n);
    s->shift = fuzz_doubles(d->n);
    sim->at_force = fuzz_doubles(s->J_rows);
    s->row_force = &sim->at_force;
}

/* M and f are what the simulator's numbers make, to rounding; then M.dense is what is solved. */
static void check_gathered(const laws_problem *p, dynamics_problem *d, const simulator *sim)
{
    const perp_contact_step *s = &sim->step;
    int32_t i, j, k;

    for (i = 0; i < d->n; i++)
        if (sim->damping)
            d->M.dense[i * d->n + i] = s->M[s->mass_diagonal[i]];
    for (i = 0; i < d->n; i++) {
        wide sum = (wide)s->h * sim->force[i] - d->f[i], size = oracle_abs(d->f[i]);
        wide M = sim->mass[s->mass_sources[s->mass_diagonal[i]]];

        M += sim->damping ? (wide)s->h * sim->damping[i] : 0;
        if (oracle_abs(M - d->M.dense[i * d->n + i]) > M * (wide)0x1p-51 + (wide)0x1p-1072)
            fuzz_fail("step: M(%d,%d) has h damping on it", i, i);
        size += oracle_abs((wide)s->h * sim->force[i]);
        for (j = 0; j < d->n; j++) {
            sum += (wide)d->M.dense[i * d->n + j] * sim->velocity[j];
            size += oracle_abs((wide)d->M.dense[i * d->n + j] * sim->velocity[j]);
        }
        if (oracle_abs(sum) > size * (wide)0x1p-48 + (wide)0x1p-1068)
            fuzz_fail("step: f = M velocity + h force: row %d", i);
    }
    for (k = 0; k < s->contacts; k++) {
        double gap = sim->gaps[s->gap_sources[k]];

        if (d->w[p->first[k]] != (gap > 0 ? gap / s->h : 0.0) || s->least_gap > gap)
            fuzz_fail("step: w = gap / h: contact %d", k);
    }
}

/* What is handed back follows from v and r, to the bit where one division makes it. */
static void check_handed(const laws_problem *p, const dynamics_problem *d, const simulator *sim)
{
    const perp_contact_step *s = &sim->step;
    int32_t i, j, slips = 0;

    for (i = 0; i < d->n; i++) {
        wide sum = 0, size = 0;

        if (s->acceleration[i] != (s->v[i] - sim->velocity[i]) / s->h || fabs(s->v[i]) > s->fastest)
            fuzz_fail("step: acceleration = (v - velocity) / h: %d", i);
        for (j = 0; j < p->rows; j++) {
            wide term =
                (j < s->rows ? d->H.dense[j * d->n + i] : d->G.dense[(j - s->rows) * d->n + i]) *
                (wide)s->r[j] / s->h;

            sum += term;
            size += oracle_abs(term);
        }
        if (size < (wide)1e300 &&
            oracle_abs(sum - s->force_of_rows[i]) > size * (wide)0x1p-46 + (wide)0x1p-1064 / s->h)
            fuzz_fail("step: force_of_rows = (H'r + G's) / h: %d", i);
    }
    for (j = 0; j < p->rows; j++)
        if (s->start[j] != s->r[j] ||
            sim->at_force[j < s->rows ? s->H_rows[j] : s->G_rows[j - s->rows]] != s->r[j] / s->h)
            fuzz_fail("step: row_force = r / h and start = r: row %d", j);
    for (i = 0; i < d->n && s->shifts; i++)
        if (!isfinite(s->shift[i]) || !(s->least_gap < 0.0))
            fuzz_fail("step: shift is of something that overlaps: %d", i);
    for (j = 0; j < s->contacts; j++)
        slips += s->modes[j] == PERP_CONTACT_SLIP;
    if (s->slips != slips || (s->rests && s->fastest != 0.0))
        fuzz_fail("step: slips, rests");
}

static int take_step(perp_context *context, perp_contact_solver *solver,
                     const perp_contact_settings *settings, const laws_problem *p,
                     dynamics_problem *d, simulator *sim)
{
    perp_contact_step *s = &sim->step;
    wide *W = fuzz_take(p->rows * p->rows, sizeof *W), *q = fuzz_take(p->rows, sizeof *q);
    wide *t = fuzz_take(p->rows, sizeof *t);
    perp_contact_result result;
    int32_t i;

    if (perp_struct_init(&result, sizeof result) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    if (s->rests) {
        if (perp_contact_solver_step(solver, s, &result, &p->laws, &d->dynamics) != PERP_OK ||
            !s->was_known)
            fuzz_fail("step: the same numbers at rest are known");
        check_handed(p, d, sim);
        return 1;
    }
    renew_outputs(p, d, sim);
    if (!fuzz_status_of(
            context, perp_contact_solver_step(solver, s, &result, &p->laws, &d->dynamics), "step",
            (const void *[]){s->v, s->r, s->u, s->modes, s->acceleration, s->force_of_rows,
                             sim->at_force, NULL}))
        return 0;
    check_gathered(p, d, sim);
    for (i = 0; i < p->rows; i++)
        if (!isfinite(s->r[i]) || !isfinite(s->r[i] / s->h))
            return 0;
    for (i = 0; i < d->n; i++)
        if (!isfinite(s->v[i]))
            return 0;
    check_handed(p, d, sim);
    dynamics_reduce(p, d, oracle_limit(result.outcome, settings->tol), s->r, W, q, t);
    laws_check("step", p, W, q, t, settings, &result, s->r, s->u, s->modes);
    if (fuzz_good(result.outcome))
        dynamics_check(p, d, settings->tol, s->v, s->r, W, t);
    return 1;
}

/* A number that is none is refused however often it comes, whatever was known before. */
static void refuse_a_number(fuzz_bytes *bytes, perp_context *context, perp_contact_solver *solver,
                            const laws_problem *p, const dynamics_problem *d, simulator *sim)
{
    perp_contact_step *s = &sim->step;
    double *numbers[] = {sim->velocity, sim->force,
                         &sim->mass[s->mass_sources[s->mass_diagonal[0]]]};
    double *bad = numbers[fuzz_pick(bytes, 3)], was = *bad;
    perp_contact_result result;
    int k;

    *bad = NAN;
    if (perp_struct_init(&result, sizeof result) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    for (k = 0; k < 2; k++) {
        renew_outputs(p, d, sim);
        if (fuzz_status_of(context,
                           perp_contact_solver_step(solver, s, &result, &p->laws, &d->dynamics),
                           "step",
                           (const void *[]){s->v, s->r, s->u, s->modes, s->acceleration,
                                            s->force_of_rows, sim->at_force, NULL}))
            fuzz_fail("step: a NaN is refused");
    }
    *bad = was;
}

/* Steps: cold, warm, with the same numbers, after a refusal; then what is handed back again. */
static void simulate(fuzz_bytes *bytes, fuzz_mood mood, perp_context *context,
                     perp_contact_solver *solver, const perp_contact_settings *settings,
                     const laws_problem *p, dynamics_problem *d)
{
    simulator sim;
    perp_contact_step *s = &sim.step;
    int32_t rested;

    make_simulator(bytes, mood, p, d, &sim);
    fuzz_show("velocity", sim.velocity, d->n);
    fuzz_show("force", sim.force, d->n);
    fuzz_show("gaps", sim.gaps, s->J_rows);
    if (!take_step(context, solver, settings, p, d, &sim))
        return;
    s->warm = 1;
    if (!take_step(context, solver, settings, p, d, &sim))
        return;
    rested = s->rests;
    if (perp_contact_solver_hand_back(solver, s) != PERP_OK)
        fuzz_fail("hand_back takes what a step handed back");
    check_handed(p, d, &sim);
    refuse_a_number(bytes, context, solver, p, d, &sim);
    if (s->rests)
        fuzz_fail("step: nothing rests where numbers were refused");
    if (take_step(context, solver, settings, p, d, &sim) && rested && s->was_known)
        fuzz_fail("step: what came before a refusal is not known");
    s->rests = 0;
    make_loads(bytes, mood, p, d, &sim);
    take_step(context, solver, settings, p, d, &sim);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_bytes bytes = {data, data + size};
    perp_context *context = fuzz_open(&bytes, 1);
    fuzz_mood mood = fuzz_mood_of(&bytes);
    perp_contact_solver *solver = NULL;
    perp_contact_settings settings;
    laws_problem p;
    dynamics_problem d;
    int32_t times;

    laws_make(&bytes, mood, &p);
    laws_settings_make(&bytes, &settings, &p);
    dynamics_make(&bytes, mood, &p, &d);
    times = 1 + fuzz_pick(&bytes, 3);
    fuzz_show("M", d.M.dense, d.n * d.n);
    fuzz_show("H", d.H.dense, (p.rows - d.bilateral) * d.n);
    fuzz_show("G", d.G.dense, d.bilateral * d.n);
    fuzz_show("f", d.f, d.n);
    fuzz_show("w", d.w, p.rows);
    fuzz_show("tol", &settings.tol, 1);
    if (fuzz_status(context, perp_contact_solver_create(context, &solver, &settings), "create") &&
        fuzz_status(context, perp_contact_solver_setup_dynamics(solver, &p.laws, &d.dynamics),
                    "setup"))
        while (times-- > 0) {
            solve(&bytes, context, solver, &settings, &p, &d);
            fuzz_numbers(&bytes, mood, d.w, p.rows);
        }
    if (solver && d.dynamics.M && fuzz_one_in(&bytes, 2))
        simulate(&bytes, mood, context, solver, &settings, &p, &d);
    perp_contact_solver_destroy(solver);
    fuzz_close(context);
    return 0;
}
