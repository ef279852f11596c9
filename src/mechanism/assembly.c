/* Problems in velocities, put to the contact solver.
 *
 * Friction of a given bound is no contact of its own kind: a coordinate is added that a unit of
 * force presses against a stop, M_a y = -bound + r_n, 0 <= r_n perp y >= 0, which makes r_n =
 * bound; the friction of that contact, with coefficient 1, is what was asked for. The same holds
 * for the share of a contact's friction that a known impulse (pressure) carries: |r_t| <= mu (r_n +
 * p) is the sum of two discs in the same plane. */
#include "base/clock.h"
#include "base/context.h"
#include "mechanism/mechanism.h"

#include <math.h>
#include <string.h>

static void layout(perp__arena *arena, void *object)
{
    perp__assembly *a = object;
    const size_t columns = (size_t)a->most_columns, rows = (size_t)a->most_rows;
    const size_t contacts = (size_t)a->most_contacts;

    a->M = perp__arena_take(arena, columns * columns, sizeof(double));
    PERP__DOUBLES(arena, rows * columns, &a->H, &a->G);
    PERP__DOUBLES(arena, columns, &a->f, &a->v);
    PERP__DOUBLES(arena, rows, &a->w, &a->b, &a->r, &a->u, &a->ray, &a->start);
    a->mu = perp__arena_take(arena, contacts, sizeof(double));
    PERP__INTEGERS(arena, contacts, &a->dims, &a->two_sided, &a->modes, &a->source);
}

perp_status perp__assembly_fit(perp_mechanism *m, perp__assembly *a, bool pressures, double tol,
                               int32_t cone)
{
    perp__assembly next = *a;
    perp_status status;

    next.most_contacts = m->contacts + m->dry + (pressures ? m->contacts : 0);
    next.most_columns = m->n + m->dry + (pressures ? m->contacts : 0);
    next.most_rows = m->rows + m->dry + (pressures ? m->contact_rows : 0) + 1;
    status = perp__arena_fit(&next.arena, m->context, layout, &next);
    if (status != PERP_OK)
        return status;
    *a = next;
    perp_contact_settings_init(&a->settings, sizeof a->settings);
    a->settings.tol = tol;
    a->settings.cone = cone;
    a->settings.raw_velocity = a == &m->assembly; /* hold.c finds its velocities */
    if (a->solver)
        PERP__ASK(status, m->context, perp_contact_solver_set(a->solver, &a->settings));
    else
        PERP__ASK(status, m->context,
                  perp_contact_solver_create(m->context, &a->solver, &a->settings));
    return status;
}

void perp__assembly_release(const perp_mechanism *m, perp__assembly *a)
{
    PERP__TELL(m->context, perp_contact_solver_destroy(a->solver));
    perp__arena_release(&a->arena);
}

perp_status perp__assembly_solve(perp_mechanism *m, perp__assembly *a, int32_t bilateral,
                                 perp__motion *answer)
{
    const perp_matrix M = perp__view(PERP_STORAGE_COLUMN_MAJOR, a->columns, a->columns, a->M);
    const perp_matrix H = perp__view(PERP_STORAGE_ROW_MAJOR, a->rows, a->columns, a->H);
    const perp_matrix G = perp__view(PERP_STORAGE_ROW_MAJOR, bilateral, a->columns, a->G);
    perp_contact_laws laws;
    perp_contact_dynamics dynamics;
    const perp_contact_answer found = {sizeof found, a->v, a->r, a->u, a->modes, a->ray};
    perp_contact_result result;
    perp_status status = PERP_OK;

    perp_contact_laws_init(&laws, sizeof laws);
    perp_struct_init(&dynamics, sizeof dynamics);
    perp_struct_init(&result, sizeof result);
    laws.contacts = a->contacts;
    laws.dims = a->dims;
    laws.mu = a->mu;
    laws.two_sided = a->two_sided;
    laws.bilateral = bilateral;
    dynamics.n = a->columns;
    dynamics.M = &M;
    dynamics.H = &H;
    dynamics.G = bilateral > 0 ? &G : NULL;
    if (m->deadline > 0.0 || a->settings.time_limit > 0.0) {
        a->settings.time_limit = /* 0 would be none */
            m->deadline > 0.0 ? fmax(m->deadline - perp__now(), DBL_MIN) : 0.0;
        PERP__ASK(status, m->context, perp_contact_solver_set(a->solver, &a->settings));
    }
    PERP__ASK(status, m->context, perp_contact_solver_setup_dynamics(a->solver, &laws, &dynamics));
    PERP__ASK(status, m->context,
              perp_contact_solver_solve_dynamics(a->solver, &found, &result, a->f, a->w, a->b,
                                                 a->starts ? a->start : NULL));
    if (status != PERP_OK) { /* the solver's message, and what it was solving */
        char message[PERP__MESSAGE_SIZE];

        memcpy(message, m->context->message, sizeof message);
        return perp__fail(m->context, status, "the contact problem of the step: %s", message);
    }
    answer->outcome = result.outcome;
    answer->method = result.method;
    answer->certificate = result.certificate;
    answer->has_ray = result.has_ray;
    answer->residual = result.residual;
    answer->iterations += result.iterations;
    return PERP_OK;
}

/* ---- the problem in velocities ------------------------------------------------------------- */

/* An added coordinate whose contact presses with `impulse`, and the rows whose friction it bounds.
 * Its mass makes both rows of W alike. */
static void add_pressed(perp_mechanism *m, perp__assembly *a, const perp__velocity_problem *problem,
                        int32_t source, double impulse, double mu)
{
    const int32_t of = source < 0 ? -1 - source : source, first = m->tangent[of];
    const int32_t rows = m->tangents[of];
    const size_t n = (size_t)m->n, width = (size_t)a->columns;
    const size_t column = (size_t)a->next_column++, row = (size_t)a->rows;
    double inverse_mass = 0.0;

    memset(a->H + row * width, 0, ((size_t)rows + 1) * width * sizeof *a->H);
    for (size_t i = 0; i < (size_t)rows; i++)
        for (size_t k = 0; k < n; k++) {
            const double entry = problem->terms->J[((size_t)first + i) * n + k];
            const double lever = entry / sqrt(problem->terms->M[k * (n + 1)]);

            a->H[(row + 1 + i) * width + k] = entry;
            inverse_mass += lever * lever; /* entry^2 may underflow */
        }
    for (size_t i = 0; i < (size_t)rows; i++)
        a->w[row + 1 + i] = problem->terms->drift[(size_t)first + i];
    a->H[row * width + column] = 1.0;
    a->M[column * (width + 1)] = inverse_mass > 0.0 ? 1.0 / inverse_mass : 1.0;
    a->f[column] = -impulse;
    a->w[row] = 0.0;
    a->mu[a->contacts] = mu;
    a->dims[a->contacts] = rows + 1;
    a->two_sided[a->contacts] = 0;
    a->source[a->contacts++] = source;
    a->rows += rows + 1;
}

/* A row of n entries with zeros behind it. */
static void copy_row(double *to, const double *from, size_t n, size_t width)
{
    memcpy(to, from, n * sizeof *to);
    memset(to + n, 0, (width - n) * sizeof *to);
}

static bool has_pressure(const perp_mechanism *m, const perp__velocity_problem *problem, int32_t j)
{
    return problem->pressure && problem->included[j] && m->dims[j] > 1 &&
           problem->friction[j] * problem->pressure[j] > 0.0;
}

static void assemble(perp_mechanism *m, perp__assembly *a, const perp__velocity_problem *problem)
{
    const size_t n = (size_t)m->n;
    size_t width;

    a->columns = m->n;
    for (int32_t i = 0; i < m->contacts; i++)
        a->columns += has_pressure(m, problem, i);
    for (int32_t i = 0; i < m->dry; i++)
        a->columns += problem->dry[i] > 0.0;
    a->contacts = a->rows = 0;
    width = (size_t)a->columns;
    for (size_t i = 0; i < n; i++)
        copy_row(a->M + i * width, problem->terms->M + i * n, n, width);
    memset(a->M + n * width, 0, (width - n) * width * sizeof *a->M);
    memcpy(a->f, problem->momentum, n * sizeof *a->f);
    for (int32_t j = 0; j < m->contacts; j++)
        if (problem->included[j]) {
            for (int32_t i = m->starts[j]; i < m->starts[j + 1]; i++) {
                const size_t row = (size_t)(a->rows + i - m->starts[j]);

                copy_row(a->H + row * width, problem->terms->J + (size_t)i * n, n, width);
                a->w[row] =
                    problem->terms->drift[i] + (m->normal_of[i] >= 0 ? problem->shift[j] : 0.0);
            }
            a->mu[a->contacts] = problem->friction[j];
            a->dims[a->contacts] = m->dims[j];
            a->two_sided[a->contacts] = m->two_sided[j];
            a->source[a->contacts++] = j;
            a->rows += m->dims[j];
        }
    a->next_column = m->n;
    for (int32_t j = 0; j < m->contacts; j++)
        if (has_pressure(m, problem, j))
            add_pressed(m, a, problem, -1 - j, problem->pressure[j], problem->friction[j]);
    for (int32_t j = 0; j < m->dry; j++)
        if (problem->dry[j] > 0.0)
            add_pressed(m, a, problem, m->contacts + j, problem->dry[j], 1.0);
    for (int32_t j = 0; j < m->bilateral; j++) {
        const size_t row = (size_t)(m->contact_rows + j);

        copy_row(a->G + (size_t)j * width, problem->terms->J + row * n, n, width);
        a->b[j] = problem->terms->drift[row];
    }
}

/* ---- where to start -------------------------------------------------------------------------
 *
 * With friction that grows with |N|, N of any sign, a step may have several answers. Compliant
 * contacts go on where friction does not take more inertia than there is: there N has the sign that
 * it has without friction (docs/friction.md). What slides is taken to slide on, what rests to
 * stick. */

/* Whether friction of such contacts counts: then start := impulses without it, and with it on what
 * slides already. */
static perp_status find_start(perp_mechanism *m, perp__assembly *a,
                              const perp__velocity_problem *problem, perp__motion *answer)
{
    perp_status status;
    int32_t counts = 0, c, row;

    for (c = 0; c < a->contacts; c++) {
        counts |= a->two_sided[c] > 0 && a->mu[c] > 0.0;
        a->mu[c] = a->two_sided[c] > 0 ? 0.0 : a->mu[c];
    }
    a->starts = 0;
    if (!counts)
        return PERP_OK;
    status = perp__assembly_solve(m, a, m->bilateral, answer);
    a->starts = status == PERP_OK && perp__is_good(answer->outcome);
    for (c = row = 0; c < a->contacts; row += a->dims[c++]) {
        const int32_t j = a->source[c];
        double size;

        if (a->two_sided[c] == 0)
            continue;
        a->mu[c] = problem->friction[j];
        size = problem->friction[j] * perp__length(a->r + row, m->two_sided[j]);
        for (int32_t i = 0; i < m->tangents[j]; i++)
            a->r[row + m->two_sided[j] + i] =
                m->start_speed[j] > 0.0
                    ? -size * (m->start_velocity[m->tangent[j] + i] / m->start_speed[j])
                    : 0.0;
    }
    memcpy(a->start, a->r, (size_t)(a->rows + m->bilateral) * sizeof *a->start);
    return status;
}

/* Contact c of the assembly, whose rows start at `row`. */
static void take_contact(perp_mechanism *m, perp__assembly *a, perp__motion *answer,
                         const perp__velocity_problem *problem, int32_t c, int32_t row)
{
    const int32_t source = a->source[c], mode = a->modes[c];
    const int32_t j = source < 0 ? -1 - source : source;
    const bool dry = source >= m->contacts;
    const int32_t skip = dry || source < 0; /* the normal of an added coordinate */
    const int32_t normals = skip ? 1 : m->tangent[j] - m->starts[j];
    const int32_t first = m->tangent[j] - (skip ? 0 : normals);

    /* a group that slides holds back with its bound, however small beside other impulses */
    if (dry && mode == PERP_CONTACT_SLIP && (m->settings.cone == 0 || a->dims[c] == 2)) {
        const double speed = perp__length(a->u + row + 1, a->dims[c] - 1);

        for (int32_t i = row + 1; i < row + a->dims[c] && speed > 0.0; i++)
            a->r[i] = -problem->dry[j - m->contacts] * (a->u[i] / speed);
    }
    for (int32_t i = skip; i < a->dims[c]; i++) {
        const int32_t at = first + i - skip;

        answer->r[at] += a->r[row + i];
        answer->ray[at] += a->ray[row + i];
        if ((i >= normals && mode == PERP_CONTACT_STICK) ||
            (i < normals && mode != PERP_CONTACT_SEPARATE))
            answer->holds[at] = 1;
    }
    /* |friction| of an added coordinate's contact is settled by its tangents alone */
    if (source >= 0)
        answer->modes[j] = dry && mode == PERP_CONTACT_SEPARATE ? PERP_CONTACT_SLIP : mode;
    else if (answer->modes[j] != PERP_CONTACT_SEPARATE && mode == PERP_CONTACT_STICK)
        answer->modes[j] = PERP_CONTACT_STICK;
}

perp_status perp__solve_velocities(perp_mechanism *m, perp__motion *answer,
                                   const perp__velocity_problem *problem)
{
    perp__assembly *a = &m->assembly;
    int32_t c, row;
    perp_status status =
        perp__check_finite(m->context, "(M v0 + h k)", problem->momentum, (size_t)m->n);

    if (status != PERP_OK)
        return status;
    perp__clear_motion(m, answer);
    assemble(m, a, problem);
    if (a->contacts == 0 && m->bilateral == 0) {
        perp__solve_mass(m, problem->terms, answer->v, problem->momentum);
        answer->outcome = PERP_OUTCOME_SOLVED; /* until it is judged: there are no laws */
        answer->residual = 0.0;
    } else {
        memset(a->ray, 0, (size_t)a->most_rows * sizeof *a->ray);
        status = find_start(m, a, problem, answer);
        PERP__THEN(status, perp__assembly_solve(m, a, m->bilateral, answer));
        if (status != PERP_OK)
            return status;
        for (c = row = 0; c < a->contacts; row += a->dims[c++])
            take_contact(m, a, answer, problem, c, row);
        for (int32_t i = 0; i < m->bilateral; i++) {
            answer->r[m->contact_rows + i] = a->r[row + i];
            answer->ray[m->contact_rows + i] = a->ray[row + i];
            answer->holds[m->contact_rows + i] = 1;
        }
        memcpy(answer->v, a->v, (size_t)m->n * sizeof *answer->v);
    }
    perp__hold_velocities(m, answer, problem);
    perp__check_motion(m, answer, problem);
    return status;
}
