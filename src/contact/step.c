/* A step of a simulator that keeps M and J in an order of its own (perp/contact.h): gathered,
 * solved, handed back. At rest, where every number is the last step's, the answer is too. */
#include <math.h>
#include <string.h>

#include "base/check.h"
#include "contact/solver.h"

static bool gather(double *to, const double *from, const int32_t *sources, const double *scale,
                   int32_t count)
{
    bool changes = 0;

    for (int32_t k = 0; k < count; k++)
        changes |= perp__put(&to[k], scale ? from[sources[k]] * scale[k] : from[sources[k]]);
    return changes;
}

/* Rows of J, each of them n long. */
static bool gather_rows(double *to, const double *J, const int32_t *rows, const double *scale,
                        int32_t count, int32_t n)
{
    bool changes = 0;

    for (int32_t i = 0; i < count; i++, to += n) {
        const double *from = J + (size_t)rows[i] * (size_t)n, factor = scale ? scale[i] : 1.0;

        for (int32_t k = 0; factor != 1.0 && k < n; k++)
            changes |= perp__put(&to[k], from[k] * factor);
        if (factor == 1.0 && memcmp(to, from, (size_t)n * sizeof *to) != 0) {
            memcpy(to, from, (size_t)n * sizeof *to);
            changes = 1;
        }
    }
    return changes;
}

/* M, with the damping before it is compared; no branch asks which entries are there, as that has no
 * order. */
static int32_t gather_mass(const perp_contact_step *s)
{
    int32_t changes = 0, k = 0;

    for (int32_t next = 0; k < s->M_entries; next++) {
        const int32_t end = next < s->n ? s->mass_diagonal[next] : s->M_entries;

        for (; k < end; k++) {
            const int32_t source = s->mass_sources[k];

            changes |= perp__put(&s->M[k], *(source < 0 ? &s->M[k] : &s->mass[source]));
        }
        if (next < s->n && s->mass_sources[k] >= 0)
            changes |= perp__put(&s->M[k], s->mass[s->mass_sources[k]] +
                                               (s->damping ? s->h * s->damping[next] : 0.0));
        k += next < s->n;
    }
    return changes;
}

static void hand_back(perp_contact_solver *solver, perp_contact_step *s)
{
    /* as the caller gave them */
    const bool bounded = solver->bounded.count > 0;
    const perp__matrix *H = bounded ? &solver->bounded.H : &solver->dynamics.H;
    const perp__matrix *G = bounded ? &solver->bounded.G : &solver->dynamics.G;
    double *force = s->row_force ? *s->row_force : NULL, largest = 0.0;

    s->slips = 0;
    for (int32_t k = 0; k < s->contacts; k++)
        s->slips += s->modes[k] == PERP_CONTACT_SLIP;
    for (int32_t i = 0; i < s->n; i++) {
        largest = fmax(largest, fabs(s->v[i]));
        s->acceleration[i] = (s->v[i] - s->velocity[i]) / s->h;
        s->force_of_rows[i] = perp__column_times(H, i, s->r) / s->h;
        if (s->bilateral > 0)
            s->force_of_rows[i] += perp__column_times(G, i, s->r + s->rows) / s->h;
    }
    s->fastest = largest;
    s->driven = 0.0;
    for (int32_t i = 0; i < s->rows; i++)
        s->driven = fmax(s->driven, fabs(solver->q[bounded ? solver->bounded.row[i] : i]));
    if (force)
        memset(force, 0, (size_t)s->J_rows * sizeof *force);
    for (int32_t i = 0; i < s->rows && force; i++)
        force[s->H_rows[i]] = (s->row_scale ? s->row_scale[i] : 1.0) * s->r[i] / s->h;
    for (int32_t i = 0; i < s->bilateral && force; i++)
        force[s->G_rows[i]] = s->r[s->rows + i] / s->h;
    s->rests = perp__is_good(solver->best.outcome) && largest == 0.0;
    for (int32_t i = 0; i < s->rows + s->bilateral; i++)
        if (perp__put(&s->start[i], s->r[i]))
            s->rests = 0;
}

static perp_status check_arrays(perp_context *context, const perp_contact_step *s)
{
    const int32_t sides = s->rows + s->bilateral, gaps = s->gap_count + s->bilateral;
    const int32_t entries = s->H_entries + s->G_entries;
    const perp__array arrays[] = {
        {"step.mass", s->mass, s->M_entries, -1},
        {"step.mass_sources", s->mass_sources, s->M_entries, -1},
        {"step.mass_diagonal", s->mass_diagonal, s->n, s->M_entries},
        {"step.velocity", s->velocity, s->n, -1},
        {"step.speeds", s->speeds, s->restitution > 0.0 ? gaps : 0, -1},
        {"*step.speeds", s->speeds ? *s->speeds : NULL, s->restitution > 0.0 ? gaps : 0, -1},
        {"step.force", s->force, s->n, -1},
        {"step.J", s->J, entries, -1},
        {"*step.J", s->J ? *s->J : NULL, entries, -1},
        {"step.gaps", s->gaps, gaps, -1},
        {"*step.gaps", s->gaps ? *s->gaps : NULL, gaps, -1},
        {"step.H_sources", s->H_sources, s->by_rows ? 0 : s->H_entries, INT32_MAX},
        {"step.G_sources", s->G_sources, s->by_rows ? 0 : s->G_entries, INT32_MAX},
        {"step.gap_rows", s->gap_rows, s->gap_count, s->rows},
        {"step.gap_sources", s->gap_sources, s->gap_count, s->J_rows},
        {"step.H_rows", s->H_rows, s->rows, s->J_rows},
        {"step.G_rows", s->G_rows, s->bilateral, s->J_rows},
        {"step.M", s->M, s->M_entries, -1},
        {"step.H", s->H, s->H_entries, -1},
        {"step.G", s->G, s->G_entries, -1},
        {"step.f", s->f, s->n, -1},
        {"step.w", s->w, s->rows, -1},
        {"step.b", s->b, s->bilateral, -1},
        {"step.v", s->v, s->n, -1},
        {"step.r", s->r, sides, -1},
        {"step.start", s->start, sides, -1},
        {"step.modes", s->modes, s->contacts, -1},
        {"step.acceleration", s->acceleration, s->n, -1},
        {"step.force_of_rows", s->force_of_rows, s->n, -1}};
    perp_status status = perp__check_arrays(context, arrays, sizeof arrays / sizeof *arrays);

    for (int32_t i = 1; status == PERP_OK && i < s->n; i++)
        if (s->mass_diagonal[i] <= s->mass_diagonal[i - 1])
            status = perp__refuse(context,
                                  "step.mass_diagonal[%d] is %d, expected more than the one before",
                                  (int)i, (int)s->mass_diagonal[i]);
    return status;
}

/* What is needed to look at the watches. */
static perp_status check_counts(perp_context *context, const perp_contact_step *s)
{
    perp_status status = PERP__CHECK(perp_contact_step, context, s);

    if (status != PERP_OK)
        return status;
    if (s->n < 0 || s->rows < 0 || s->bilateral < 0 || s->contacts < 0 || s->M_entries < 0 ||
        s->H_entries < 0 || s->G_entries < 0 || s->gap_count < 0 || s->J_rows < 0 ||
        s->watch_count < 0)
        return perp__refuse(context, "step has a count below 0");
    if ((int64_t)(s->rows > s->gap_count ? s->rows : s->gap_count) + s->bilateral > INT32_MAX ||
        (int64_t)s->H_entries + s->G_entries > INT32_MAX)
        return perp__refuse(context, "step has counts that make more than 2^31 together");
    if (!(s->h > 0.0 && s->h < INFINITY))
        return perp__refuse(context, "step.h is %g, expected a time > 0", s->h);
    if (!(s->restitution >= 0.0 && s->restitution <= 1.0))
        return perp__refuse(context, "step.restitution is %g, expected 0 to 1", s->restitution);
    if (s->shift && !(s->slop >= 0.0))
        return perp__refuse(context, "step.slop is %g, expected a length >= 0", s->slop);
    if (s->by_rows &&
        ((int64_t)s->rows * s->n != s->H_entries || (int64_t)s->bilateral * s->n != s->G_entries))
        return perp__refuse(context,
                            "step.by_rows is set, but H_entries or G_entries are not rows times n");
    if (s->watch_count > 0)
        status = perp__check_pointer(context, "step.watches", s->watches);
    for (int32_t k = 0; k < s->watch_count && status == PERP_OK; k++) {
        const perp_contact_watch *w = &s->watches[k];

        if (w->count < 0 || w->bytes < 0 || w->offset < 0 || !w->at || (w->count > 0 && !w->seen))
            status =
                perp__refuse(context, "step.watches[%d] has a NULL or a number below 0", (int)k);
    }
    return status;
}

/* Whether the problem that is set up is one of the step's size, with an M to multiply. */
static perp_status check_sizes(const perp_contact_solver *solver, const perp_contact_step *s)
{
    const perp__contact_bounded *bounded = &solver->bounded;
    const bool given = bounded->count > 0;
    const int32_t rows = given ? bounded->rows : solver->rows;
    const struct {
        const char *name;
        int32_t is, should;
    } sizes[] = {
        {"n", s->n, solver->n},
        {"contacts", s->contacts, given ? bounded->contacts : solver->contacts},
        {"rows", s->rows, rows},
        {"bilateral", s->bilateral, (given ? bounded->size : solver->size) - rows},
    };

    if (solver->entrance != PERP__ENTRANCE_DYNAMICS || !solver->dynamics.has_M)
        return perp__refuse(solver->context,
                            "the solver was not set up by perp_contact_solver_step with an M");
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++)
        if (sizes[k].is != sizes[k].should)
            return perp__refuse(solver->context, "step.%s is %d, but laws and dynamics have %d",
                                sizes[k].name, (int)sizes[k].is, (int)sizes[k].should);
    return PERP_OK;
}

/* A solve of what has changed since the answer. Nothing is at rest until there is another. */
static perp_status solve(perp_contact_solver *solver, perp_contact_step *s, int32_t changes,
                         perp_contact_result *result, const perp_contact_laws *laws,
                         const perp_contact_dynamics *dynamics)
{
    const double *start = s->warm ? s->start : NULL;
    const perp__contact_call call = {
        {0, s->v, s->r, s->u, s->modes, NULL}, result, s->f, s->w, s->b, NULL, start};
    const bool keeps = s->warm && s->rests && !changes;
    double *momentum;
    perp_status status = PERP_OK;

    s->rests = 0;
    if (!keeps)
        status = perp__contact_setup(solver, laws, dynamics, NULL);
    PERP__THEN(status, check_sizes(solver, s));
    PERP__THEN(status, perp__contact_open(solver, s));
    if (status != PERP_OK)
        return status;
    momentum = solver->push;
    perp__multiply(&solver->dynamics.M, s->velocity, momentum);
    changes = 0;
    for (int32_t i = 0; i < s->n; i++) /* f = M velocity + h force */
        changes |= perp__put(&s->f[i], momentum[i] + s->h * s->force[i]);
    s->was_known = !changes && keeps;
    solver->steps = 1; /* of this call alone: the handle may solve other problems as well */
    status = s->was_known ? PERP_OK : perp__contact_solve(solver, &call);
    solver->steps = 0;
    return status;
}

static perp_status step_once(perp_contact_solver *solver, perp_contact_step *s,
                             perp_contact_result *result, const perp_contact_laws *laws,
                             const perp_contact_dynamics *dynamics)
{
    perp_status status = check_counts(solver->context, s);
    int32_t changes;

    /* 1. Whether the problem is another one than was told. */
    if (status == PERP_OK)
        s->was_known = s->is_other = 0;
    if (status == PERP_OK && s->source)
        status = perp__contact_check_source(solver->context, s);
    if (status == PERP_OK && s->source)
        s->is_other = !perp__contact_rows_last(solver, s);
    for (int32_t i = 0; status == PERP_OK && i < s->watch_count && !s->is_other; i++) {
        const perp_contact_watch *w = &s->watches[i];
        const char *seen = w->seen;

        s->is_other = w->count > 0 && !*w->at;
        for (int32_t k = 0; k < w->count && !s->is_other; k++)
            s->is_other = memcmp((const char *)*w->at + w->offset + (size_t)k * (size_t)w->stride,
                                 seen + (size_t)k * (size_t)w->bytes, (size_t)w->bytes) != 0;
    }
    if (status == PERP_OK && !s->is_other)
        status = check_arrays(solver->context, s);
    if (status != PERP_OK || s->is_other)
        return status;

    /* 2. M, H, G, w and b. */
    changes = gather_mass(s);
    if (s->H_entries > 0)
        changes |= s->by_rows ? gather_rows(s->H, *s->J, s->H_rows, s->row_scale, s->rows, s->n)
                              : gather(s->H, *s->J, s->H_sources, s->H_scale, s->H_entries);
    if (s->G_entries > 0)
        changes |= s->by_rows ? gather_rows(s->G, *s->J, s->G_rows, NULL, s->bilateral, s->n)
                              : gather(s->G, *s->J, s->G_sources, NULL, s->G_entries);
    s->least_gap = 0.0;
    for (int32_t k = 0; k < s->gap_count; k++) {
        const double gap = (*s->gaps)[s->gap_sources[k]];
        double w = 0.0;

        s->least_gap = fmin(s->least_gap, gap);
        if (!(gap <= 0.0))
            w = gap / s->h; /* NaN: NaN */
        else if (s->restitution > 0.0 && k < s->contacts)
            w = s->restitution * fmin((*s->speeds)[s->gap_sources[k]], 0.0);
        changes |= perp__put(&s->w[s->gap_rows[k]], w);
    }
    if (s->source && s->source->surface_at > 0)
        changes |= perp__contact_rows_move(solver, s);
    for (int32_t k = 0; k < s->bilateral; k++)
        changes |= perp__put(&s->b[k], s->correction / s->h * (*s->gaps)[s->G_rows[k]]);

    /* 3. The answer. */
    status = solve(solver, s, changes, result, laws, dynamics);
    if (status == PERP_OK)
        hand_back(solver, s);
    return status;
}

perp_status perp_contact_solver_step(perp_contact_solver *solver, perp_contact_step *step,
                                     perp_contact_result *result, const perp_contact_laws *laws,
                                     const perp_contact_dynamics *dynamics)
{
    return PERP__CONTACT_CALL(solver, step_once(solver, step, result, laws, dynamics));
}

static perp_status hand_back_checked(perp_contact_solver *solver, perp_contact_step *s)
{
    perp_status status = check_counts(solver->context, s);

    PERP__THEN(status, check_arrays(solver->context, s));
    PERP__THEN(status, check_sizes(solver, s));
    PERP__THEN(status, perp__check_finite(solver->context, "step.v", s->v, (size_t)s->n));
    PERP__THEN(status, perp__check_finite(solver->context, "step.r", s->r,
                                          (size_t)s->rows + (size_t)s->bilateral));
    if (status == PERP_OK)
        hand_back(solver, s);
    return status;
}

perp_status perp_contact_solver_hand_back(perp_contact_solver *solver, perp_contact_step *step)
{
    return PERP__CONTACT_CALL(solver, hand_back_checked(solver, step));
}
