/* Derivatives of v and r at a solution whose modes are strict. With A = (H, G), W = A M^-1 A' and
 * the compliance, and the active rows (those whose impulses move) kept:
 *
 *   M dv = p + A'dr,   p = df - dM v + dA'r,   du = W dr + A M^-1 p + dA v + dw = W dr + d
 *
 *   it holds   du = 0
 *   it slips   t (dr_p + m e n'dr_N) + c (1 - e e') du_p = -t |r_N| e dm,   c = t m |r_N| / |u_p|,
 *
 * the latter from r_p = -m |r_N| e, e = u_p / |u_p|, n = r_N / |r_N|: E du + F dr + B dm = 0 in
 * short, so that K dr = -(E d + B dm), K = E W + F. The adjoint solves K'y = -(A M^-1 g_v + g_r)
 * once; with z = E'y and x = M^-1 (g_v + A'z) gradients are x for f, z for w and B'y for m. */
#include <math.h>
#include <string.h>

#include "base/check.h"
#include "contact/law.h"
#include "contact/solver.h"
#include "lcp/lcp.h"
#include "linalg/blas.h"
#include "linalg/factor/factor.h"

/* A part of a contact that presses. */
typedef struct part {
    int32_t row, size, normal, normals, contact;
    double e[2], n[3]; /* the directions in which it slips and is pressed */
    double t, m, c, b; /* b: t |r_N|; 0 where m is not mu */
} part;

struct perp_contact_sensitivity {
    PERP__HANDLE;
    perp_contact_solver *solver;
    perp__arena arena;
    perp__matrix H, G; /* as they were given */
    int32_t n, contacts, bounded, rows, size, verdict, count, slips;
    int32_t *modes;                    /* contacts and rows with bounds */
    int32_t *active;                   /* count */
    int8_t *moves;                     /* size: is active */
    part *parts;                       /* slips */
    double *v, *r, *u;                 /* the point */
    double *K, *work;                  /* count by count, and its factors; 2 count */
    int32_t *pivots;                   /* count */
    double *units;                     /* size: 1 / sqrt(trace of W_kk): K has it on both sides */
    double *push, *dv, *free, *low;    /* n */
    double *d, *dr, *image, *step, *y; /* size */
    double *dmu;                       /* contacts */
};

/* ---- the maps ------------------------------------------------------------------------------ */

/* x := M^-1 x, by way of `free`. */
static perp_status solve_mass(perp_contact_sensitivity *s, double *x)
{
    perp_status status = perp__dynamics_velocities(&s->solver->dynamics, x, NULL, s->free, s->low);

    if (status == PERP_OK)
        perp__copy(x, s->free, s->n);
    return status;
}

/* y := A x */
static void multiply(const perp_contact_sensitivity *s, const double *x, double *y)
{
    perp__multiply(&s->H, x, y);
    if (s->G.rows > 0)
        perp__multiply(&s->G, x, y + s->rows);
}

/* y += A'x */
static void add_transposed(const perp__matrix *H, const perp__matrix *G, int32_t n, int32_t rows,
                           const double *x, double *y)
{
    for (int32_t j = 0; j < n; j++) {
        if (H)
            y[j] += perp__column_times(H, j, x);
        if (G && G->rows > 0)
            y[j] += perp__column_times(G, j, x + rows);
    }
}

/* x := E x = E'x on the active rows; 0 elsewhere. */
static void apply_E(const perp_contact_sensitivity *s, double *x)
{
    for (int32_t i = 0; i < s->size; i++)
        if (!s->moves[i])
            x[i] = 0.0;
    for (int32_t k = 0; k < s->slips; k++) {
        const part *p = &s->parts[k];
        double *y = x + p->row;

        if (p->size == 1) {
            y[0] = 0.0;
        } else { /* 1 - e e' by what is square to e: nothing cancels */
            const double across = p->c * (p->e[0] * y[1] - p->e[1] * y[0]);

            y[0] = -p->e[1] * across;
            y[1] = p->e[0] * across;
        }
    }
}

/* ---- the active set ------------------------------------------------------------------------ */

static int32_t own_row(const perp_contact_sensitivity *s, int32_t i)
{
    return s->solver->bounded.count > 0 ? s->solver->bounded.row[i] : i;
}

/* How far a constraint is from another mode: a distance of impulses, in units of the tested
 * residual. */
static void near(const perp_contact_sensitivity *s, int32_t constraint, int32_t index,
                 double distance, perp_contact_sensitivity_info *info)
{
    const double margin =
        s->solver->root[constraint] * fabs(distance) / s->solver->omega[constraint];

    if (margin < info->margin) {
        info->margin = margin;
        info->index = index;
    }
}

/* Part of contact k, which presses: whether and where it slips. */
static void read_part(perp_contact_sensitivity *s, int32_t k, const perp__contact_part *given,
                      perp_contact_sensitivity_info *info)
{
    const double t = s->solver->trace[k], *r = s->r + given->row, *u = s->u + given->row;
    const double load = perp__contact_pressure(&s->solver->problem, k, s->r);
    const double radius = given->coefficient * load;
    const double speed = perp__contact_length(s->u, given->row, given->row + given->size);
    const int32_t normal = s->solver->starts[k];
    part *p = &s->parts[s->slips];
    double reach = 0.0;

    for (int32_t i = 0; i < given->size; i++)
        reach = hypot(reach, r[i] - u[i] / t);
    if (given->coefficient > 0.0)
        near(s, k, k, reach - radius, info);
    if (given->coefficient == 0.0 && speed == 0.0)
        return; /* no friction to change */
    for (int32_t i = 0; i < given->size; i++)
        s->moves[given->row + i] = 1;
    if (s->modes[k] != PERP_CONTACT_SLIP || !(reach > radius) || speed == 0.0)
        return;
    s->slips++;
    *p = (part){.row = given->row, .size = given->size, .normal = normal, .contact = k};
    p->normals = perp__contact_normals(&s->solver->problem, k);
    p->t = t, p->m = given->coefficient, p->c = t * radius / speed;
    p->b = given->row == normal + p->normals && s->solver->dims[k] > p->normals ? t * load : 0.0;
    for (int32_t i = 0; i < given->size; i++)
        p->e[i] = u[i] / speed;
    for (int32_t i = 0; i < p->normals; i++)
        p->n[i] = load > 0.0 ? s->r[normal + i] / load : i == 0;
}

/* The rows that are active, and how far each constraint is from another mode. */
static void read_set(perp_contact_sensitivity *s, perp_contact_sensitivity_info *info)
{
    const perp__contact_bounded *bounded = &s->solver->bounded;
    const perp__contact_problem *problem = &s->solver->problem;

    s->count = s->slips = 0;
    memset(s->moves, 0, (size_t)s->size);
    for (int32_t k = 0; k < s->contacts; k++) {
        const int32_t normal = problem->starts[k];
        perp__contact_part parts[3];
        const int32_t count = perp__contact_parts(problem, k, parts);

        if (perp__contact_two_sided(problem, k) == 0)
            near(s, k, k, s->r[normal] - s->u[normal] / problem->trace[k], info);
        else if (problem->mu[k] > 0.0) /* |r_N| has a kink at 0 */
            near(s, k, k, perp__contact_pressure(problem, k, s->r), info);
        if (s->modes[k] == PERP_CONTACT_SEPARATE)
            continue;
        memset(s->moves + normal, 1, (size_t)perp__contact_normals(problem, k));
        for (int32_t c = 0; c < count; c++)
            read_part(s, k, &parts[c], info);
    }
    for (int32_t k = 0; k < s->bounded; k++) {
        const int32_t i = s->rows - s->bounded + k, constraint = bounded->contact_of[k];

        s->moves[i] = s->modes[s->contacts + k] == PERP_CONTACT_STICK;
        if (constraint < 0 || bounded->low[k] == bounded->high[k])
            continue;
        near(s, constraint, s->contacts + k,
             s->moves[i] ? fmin(s->r[i] - bounded->low[k], bounded->high[k] - s->r[i])
                         : s->u[i] / s->solver->trace[constraint],
             info);
    }
    for (int32_t i = s->rows; i < s->size; i++)
        s->moves[i] = 1;
    for (int32_t i = 0; i < s->size; i++) {
        s->units[i] = 1.0 / s->solver->root[s->solver->constraint_of[own_row(s, i)]];
        if (s->moves[i])
            s->active[s->count++] = i;
    }
}

/* x := K^-1 x, or K^-T x */
static void solve_active(void *user, double *x, int32_t transposed)
{
    const perp_contact_sensitivity *s = user;

    perp__lu_solve(s->count, s->K, s->count, s->pivots, x, transposed);
}

/* ---- K and its factors --------------------------------------------------------------------- */

/* K, column by column, and its factors: image := (E W + F) x of a unit x on an active row. */
static perp_status factor(perp_contact_sensitivity *s, perp_contact_sensitivity_info *info)
{
    const size_t count = (size_t)s->count;
    double norm = 0.0;
    perp_status status = PERP_OK;

    info->condition = 1.0;
    memset(s->dr, 0, (size_t)s->size * sizeof *s->dr);
    for (size_t j = 0; j < count; j++) {
        const int32_t row = s->active[j];
        double sum = 0.0;

        s->dr[row] = s->units[row];
        memset(s->push, 0, (size_t)s->n * sizeof *s->push);
        add_transposed(&s->H, &s->G, s->n, s->rows, s->dr, s->push);
        status = solve_mass(s, s->push);
        if (status != PERP_OK)
            return status;
        multiply(s, s->push, s->image);
        for (int32_t i = 0; i < s->size; i++)
            s->image[i] += s->solver->compliance[own_row(s, i)] * s->dr[i];
        apply_E(s, s->image);
        for (int32_t k = 0; k < s->slips; k++) {
            const part *p = &s->parts[k];
            double load = 0.0;

            for (int32_t i = 0; i < p->normals; i++)
                load += p->n[i] * s->dr[p->normal + i];
            for (int32_t i = 0; i < p->size; i++)
                s->image[p->row + i] += p->t * (s->dr[p->row + i] + p->m * p->e[i] * load);
        }
        s->dr[row] = 0.0;
        for (size_t i = 0; i < count; i++) {
            s->K[i + j * count] = s->units[s->active[i]] * s->image[s->active[i]];
            sum += fabs(s->K[i + j * count]);
        }
        norm = sum > norm || isnan(sum) ? sum : norm;
    }
    if (count == 0)
        return PERP_OK;
    info->condition = INFINITY;
    if (isfinite(norm) && perp__lu_factor(s->count, s->K, s->count, s->pivots) == 0)
        info->condition =
            1.0 / perp__reciprocal_condition(s->count, norm, s->work, solve_active, s);
    return PERP_OK;
}

/* x := -K^-1 x, or -K^-T x, from velocities to impulses; 0 on rows that are not active. */
static void solve(perp_contact_sensitivity *s, double *x, int32_t transposed)
{
    for (int32_t k = 0; k < s->count; k++)
        s->step[k] = s->units[s->active[k]] * x[s->active[k]];
    if (s->count > 0)
        perp__lu_solve(s->count, s->K, s->count, s->pivots, s->step, transposed);
    memset(x, 0, (size_t)s->size * sizeof *x);
    for (int32_t k = 0; k < s->count; k++)
        x[s->active[k]] = -s->units[s->active[k]] * s->step[k];
}

/* ---- life ---------------------------------------------------------------------------------- */

static void release(void *object)
{
    perp_contact_sensitivity *s = object;

    perp__arena_release(&s->arena);
    perp__handle_end(s->solver);
}

static const perp__kind kind = {"sensitivities of contacts", sizeof(perp_contact_sensitivity),
                                release};

static void layout(perp__arena *arena, void *object)
{
    perp_contact_sensitivity *s = object;
    const size_t n = (size_t)s->n, size = (size_t)s->size, contacts = (size_t)s->contacts;

    PERP__DOUBLES(arena, n, &s->v, &s->push, &s->dv, &s->free, &s->low);
    PERP__DOUBLES(arena, size, &s->r, &s->u, &s->units, &s->d, &s->dr, &s->image, &s->step, &s->y);
    s->K = perp__arena_take(arena, size, size * sizeof(double));
    s->work = perp__arena_take(arena, size, 2 * sizeof(double));
    PERP__INTEGERS(arena, size, &s->active, &s->pivots);
    s->moves = perp__arena_take(arena, size, 1);
    s->modes = perp__arena_take(arena, contacts + (size_t)s->bounded, sizeof(int32_t));
    s->parts = perp__arena_take(arena, 3 * contacts, sizeof(part));
    s->dmu = perp__arena_take(arena, contacts, sizeof(double));
}

/* The verdict of the front door on r, and with it v, u and modes. */
static perp_status find_outcome(perp_contact_sensitivity *s, perp_contact_sensitivity_info *info,
                                const double *f, const double *w, const double *b, const double *r)
{
    perp_contact_result result;
    const perp__contact_call call = {
        {0, s->v, s->r, s->u, s->modes, NULL}, &result, f, w, b, NULL, r};
    perp_status status = perp_struct_init(&result, sizeof result);

    if (status == PERP_OK && s->size > 0)
        status = perp__check_pointer(s->context, "r", r);
    s->solver->settings.max_iterations = -1; /* the start alone */
    s->solver->settings.time_limit = 0.0;
    PERP__THEN(status, perp__contact_solve(s->solver, &call));
    if (status != PERP_OK)
        return status;
    info->margin = INFINITY;
    info->index = -1;
    read_set(s, info);
    info->active = s->count;
    status = factor(s, info);
    info->verdict = perp__lcp_verdict(perp__is_good(result.outcome), info->condition, info->margin,
                                      s->solver->settings.tol);
    if (info->verdict != PERP_VERDICT_DEGENERATE)
        info->index = -1;
    s->verdict = info->verdict;
    return status;
}

perp_status perp_contact_sensitivity_create(perp_context *context,
                                            perp_contact_sensitivity **sensitivity,
                                            perp_contact_sensitivity_info *info,
                                            const perp_contact_settings *settings,
                                            const perp_contact_problem *problem, const double *r)
{
    perp_contact_sensitivity_info copy = {0};
    perp_contact_sensitivity *s = NULL;
    perp_contact_problem p = {0};
    perp_status status = perp__enter(context);

    if (status != PERP_OK)
        return status;
    PERP__THEN(status, perp__check_pointer(context, "sensitivity", sensitivity));
    PERP__THEN(status, PERP__CHECK(perp_contact_sensitivity_info, context, info));
    if (status == PERP_OK && !(s = perp__handle_create(context, &kind)))
        status = PERP_ERROR_MEMORY;
    PERP__THEN(status, perp__contact_create(context, &s->solver, settings));
    PERP__THEN(status, PERP__READ(perp_contact_problem, context, &p, problem));
    PERP__THEN(status, perp__check_pointer(context, "dynamics", p.dynamics));
    PERP__THEN(status, perp__contact_setup(s->solver, p.laws, p.dynamics, NULL));
    if (status == PERP_OK) {
        const perp__contact_bounded *bounded = &s->solver->bounded;

        s->bounded = bounded->count;
        s->contacts = s->bounded > 0 ? bounded->contacts : s->solver->contacts;
        s->H = s->bounded > 0 ? bounded->H : s->solver->dynamics.H;
        s->G = s->bounded > 0 ? bounded->G : s->solver->dynamics.G;
        s->n = s->solver->n;
        s->rows = s->H.rows;
        s->size = s->rows + s->G.rows;
        status = perp__arena_fit(&s->arena, s->context, layout, s);
    }
    PERP__THEN(status, find_outcome(s, &copy, p.f, p.w, p.b, r));
    if (status == PERP_OK)
        perp__struct_write(info, &copy, sizeof copy);
    if (s)
        PERP__HAND_OUT(status, s, sensitivity);
    return perp__leave(context, status);
}

void perp_contact_sensitivity_destroy(perp_contact_sensitivity *sensitivity)
{
    perp__handle_destroy(sensitivity, &kind);
}

perp_status perp_contact_sensitivity_point(perp_contact_sensitivity *s, double *v, double *r,
                                           double *u, int32_t *modes)
{
    perp_status status = perp__handle_enter(s, &kind);

    if (status != PERP_OK)
        return status;
    perp__copy(v, s->v, s->n);
    perp__copy(r, s->r, s->size);
    perp__copy(u, s->u, s->size);
    for (int32_t k = 0; modes && k < s->contacts + s->bounded; k++)
        modes[k] = s->modes[k];
    return perp__leave(s->context, PERP_OK);
}

/* ---- products ------------------------------------------------------------------------------ */

/* A change of the data as it was given; views of its matrices. */
typedef struct direction {
    perp_contact_change as;
    perp__matrix dM, dH, dG;
} direction;

static perp_status read_change(const perp_contact_sensitivity *s, direction *c)
{
    const perp_contact_change *as = &c->as;
    const int32_t bilateral = s->size - s->rows;
    perp_status status = perp__lcp_check_verdict(s->context, "r", "active set", s->verdict);

    PERP__THEN(status, perp__check_finite(s->context, "df", as->df, (size_t)s->n));
    PERP__THEN(status, perp__check_finite(s->context, "dw", as->dw, (size_t)s->rows));
    PERP__THEN(status, perp__check_finite(s->context, "db", as->db, (size_t)bilateral));
    PERP__THEN(status, perp__check_finite(s->context, "dmu", as->dmu, (size_t)s->contacts));
    if (status == PERP_OK && as->dM)
        status = perp__matrix_read_sized(s->context, "dM", &c->dM, as->dM, s->n, s->n);
    if (status == PERP_OK && as->dH)
        status = perp__matrix_read_sized(s->context, "dH", &c->dH, as->dH, s->rows, s->n);
    if (status == PERP_OK && as->dG)
        status = perp__matrix_read_sized(s->context, "dG", &c->dG, as->dG, bilateral, s->n);
    return status;
}

static perp_status forward(perp_contact_sensitivity *s, double *dv, double *dr,
                           const perp_contact_change *given)
{
    direction copy = {{0}, {0}, {0}, {0}}, *c = &copy;
    perp_status status = PERP__READ(perp_contact_change, s->context, &c->as, given);

    PERP__THEN(status, read_change(s, c));
    /* 1. dv := M^-1 p and d := A dv + dA v + dw, as if no impulse changed. */
    if (status != PERP_OK)
        return status;
    for (int32_t j = 0; j < s->n; j++)
        s->dv[j] = c->as.df ? c->as.df[j] : 0.0;
    if (c->as.dM) {
        perp__multiply(&c->dM, s->v, s->push);
        for (int32_t j = 0; j < s->n; j++)
            s->dv[j] -= s->push[j];
    }
    add_transposed(c->as.dH ? &c->dH : NULL, c->as.dG ? &c->dG : NULL, s->n, s->rows, s->r, s->dv);
    status = solve_mass(s, s->dv);
    if (status != PERP_OK)
        return status;
    multiply(s, s->dv, s->d);
    memset(s->image, 0, (size_t)s->size * sizeof *s->image);
    if (c->as.dH)
        perp__multiply(&c->dH, s->v, s->image);
    if (c->as.dG && s->size > s->rows)
        perp__multiply(&c->dG, s->v, s->image + s->rows);
    for (int32_t i = 0; i < s->size; i++) {
        const double *offset = i < s->rows ? c->as.dw : c->as.db;

        s->d[i] += s->image[i] + (offset ? offset[i < s->rows ? i : i - s->rows] : 0.0);
    }

    /* 2. dr = -K^-1 (E d + B dm), and what it adds to dv. */
    apply_E(s, s->d);
    for (int32_t k = 0; c->as.dmu && k < s->slips; k++) {
        const part *p = &s->parts[k];

        for (int32_t i = 0; i < p->size; i++)
            s->d[p->row + i] += p->b * p->e[i] * c->as.dmu[p->contact];
    }
    solve(s, s->d, 0);
    memset(s->push, 0, (size_t)s->n * sizeof *s->push);
    add_transposed(&s->H, &s->G, s->n, s->rows, s->d, s->push);
    status = solve_mass(s, s->push);
    for (int32_t j = 0; j < s->n; j++)
        s->dv[j] += s->push[j];
    PERP__THEN(status, perp__check_finite(s->context, "dv", s->dv, (size_t)s->n));
    PERP__THEN(status, perp__check_finite(s->context, "dr", s->d, (size_t)s->size));
    if (status != PERP_OK)
        return status;
    perp__copy(dv, s->dv, s->n);
    perp__copy(dr, s->d, s->size);
    return PERP_OK;
}

perp_status perp_contact_sensitivity_forward(perp_contact_sensitivity *sensitivity, double *dv,
                                             double *dr, const perp_contact_change *change)
{
    return PERP__HANDLE_CALL(sensitivity, &kind, forward(sensitivity, dv, dr, change));
}

static perp_status adjoint(perp_contact_sensitivity *s, double *x, double *y, double *z, double *mu,
                           const double *gv, const double *gr)
{
    perp_status status = perp__lcp_check_verdict(s->context, "r", "active set", s->verdict);

    PERP__THEN(status, perp__check_finite(s->context, "gv", gv, (size_t)s->n));
    PERP__THEN(status, perp__check_finite(s->context, "gr", gr, (size_t)s->size));
    if (status != PERP_OK)
        return status;
    for (int32_t j = 0; j < s->n; j++)
        s->push[j] = s->dv[j] = gv ? gv[j] : 0.0;
    status = solve_mass(s, s->push);
    if (status != PERP_OK)
        return status;
    multiply(s, s->push, s->y);
    for (int32_t i = 0; gr && i < s->size; i++)
        s->y[i] += gr[i];
    solve(s, s->y, 1);
    memset(s->dmu, 0, (size_t)s->contacts * sizeof *s->dmu);
    for (int32_t k = 0; k < s->slips; k++) { /* B'y */
        const part *p = &s->parts[k];

        for (int32_t i = 0; i < p->size; i++)
            s->dmu[p->contact] += p->b * p->e[i] * s->y[p->row + i];
    }
    apply_E(s, s->y);
    add_transposed(&s->H, &s->G, s->n, s->rows, s->y, s->dv);
    status = solve_mass(s, s->dv);
    PERP__THEN(status, perp__check_finite(s->context, "x", s->dv, (size_t)s->n));
    PERP__THEN(status, perp__check_finite(s->context, "y", s->y, (size_t)s->size));
    PERP__THEN(status, perp__check_finite(s->context, "mu", s->dmu, (size_t)s->contacts));
    if (status != PERP_OK)
        return status;
    perp__copy(x, s->dv, s->n);
    perp__copy(y, s->y, s->rows);
    perp__copy(z, s->y + s->rows, s->size - s->rows);
    perp__copy(mu, s->dmu, s->contacts);
    return PERP_OK;
}

perp_status perp_contact_sensitivity_adjoint(perp_contact_sensitivity *sensitivity, double *x,
                                             double *y, double *z, double *mu, const double *gv,
                                             const double *gr)
{
    return PERP__HANDLE_CALL(sensitivity, &kind, adjoint(sensitivity, x, y, z, mu, gv, gr));
}
