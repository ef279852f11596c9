/* Lemke's method: friction cones as polyhedra, the contact problem as an LCP (Stewart & Trinkle
 * 1996; Anitescu & Potra 1997). For each contact, with directions d_1 .. d_k that span its tangent
 * plane positively, r_t = sum_j beta_j d_j and
 *
 *   0 <= r_n    perp  u_n             >= 0
 *   0 <= beta_j perp  d_j'u_t + lambda >= 0
 *   0 <= lambda perp  mu r_n - sum_j beta_j >= 0
 *
 * and the same for rolling and spinning friction; bilateral rows are equations. At the solution
 * lambda is the slip speed against the polygon: lambda = 0 is stick, r_n = 0 separation.
 *
 * A row with one tangent takes two opposite directions, which is exact. */
#include <math.h>
#include <string.h>

#include <perp/contact.h>

#include "base/context.h"
#include "contact/law.h"
#include "lcp/lcp.h"

/* Edges where the exact cone was asked for and this is only its start. */
enum { EDGES = 10 };

/* Attempts after the first look closer: each disc's polygon has its vertices near the direction in
 * which the last answer pushed and further and further apart from there on. In the window, `width`
 * radians to either side of the middle, the error is of second order in it. An answer in the window
 * narrows it. */
#define WIDTH 0.2  /* of attempt 1 */
#define LEAST 1e-6 /* narrower, the vertices could hardly be told apart */
#define NARROWER 0.125
#define WIDEST 2.0 /* the last vertex before the opposite one */

/* More unknowns than this are more than pivoting serves. */
enum { MOST_UNKNOWNS = 20000 };

/* Unknown of the LCP: z_j acts on `row` and, with size 2, the next, along d. Slip speeds act on
 * nothing: row -1. */
typedef struct unknown {
    int32_t row, size;
    double d[2];
} unknown;

typedef struct pyramid {
    perp__contact_work base;
    perp_lcp_solver *lcp;
    int32_t n;
    unknown *unknowns;
    double *M, *q, *lower, *z, *direction;
    double *W;               /* dense copy of a sparse W */
    double *angles, *widths; /* 3 contacts: where the discs pushed at the last answer; windows */
    int32_t regular;         /* polygons, without a window */
    double *guess;           /* z of the last answer with respect to new windows */
} pyramid;

static int32_t edges_of(const perp__contact_problem *problem, const perp__contact_part *part)
{
    if (part->coefficient == 0.0)
        return 0;
    return part->size == 1 ? 2 : problem->cone > 0 ? problem->cone : EDGES;
}

static int64_t count_unknowns(const perp__contact_problem *problem)
{
    int64_t n = problem->size - problem->rows;
    int32_t k, p;

    for (k = 0; k < problem->contacts; k++) {
        perp__contact_part parts[3];
        const int32_t count = perp__contact_parts(problem, k, parts);

        n++;
        for (p = 0; p < count; p++)
            if (edges_of(problem, &parts[p]) > 0)
                n += edges_of(problem, &parts[p]) + 1;
    }
    return n;
}

static perp_status check(const perp__contact_problem *problem)
{
    const int64_t n = count_unknowns(problem);

    if (n <= MOST_UNKNOWNS)
        return PERP_OK;
    return perp__fail(problem->context, PERP_ERROR_ARGUMENT,
                      "the method lemke takes up to %d unknowns, and the contacts' polyhedral "
                      "cones have %lld",
                      (int)MOST_UNKNOWNS, (long long)n);
}

static void layout(perp__arena *arena, void *work)
{
    pyramid *p = work;
    const perp__contact_problem *problem = p->base.problem;
    const size_t n = (size_t)count_unknowns(problem), size = (size_t)problem->size;

    p->n = (int32_t)n;
    p->unknowns = perp__arena_take(arena, n, sizeof(unknown));
    p->M = perp__arena_take(arena, n, n * sizeof(double));
    p->q = perp__arena_take(arena, n, sizeof(double));
    p->lower = perp__arena_take(arena, n, sizeof(double));
    p->z = perp__arena_take(arena, n, sizeof(double));
    p->direction = perp__arena_take(arena, n, sizeof(double));
    p->angles = perp__arena_take(arena, 3 * (size_t)problem->contacts, sizeof(double));
    p->widths = perp__arena_take(arena, 3 * (size_t)problem->contacts, sizeof(double));
    p->guess = perp__arena_take(arena, n, sizeof(double));
    p->W = problem->W->column_starts ? perp__arena_take(arena, size, size * sizeof(double)) : NULL;
}

static unknown *add_unknown(pyramid *p, int32_t row, int32_t size, double x, double y)
{
    unknown *added = &p->unknowns[p->n++];

    added->row = row;
    added->size = size;
    added->d[0] = x;
    added->d[1] = y;
    return added;
}

/* Vertex j of the polygon of a disc, part c of contact k. */
static void vertex(const pyramid *p, int32_t edges, int32_t k, int32_t c, int32_t j, double d[2])
{
    const double angle = p->angles[3 * k + c], width = p->widths[3 * k + c];
    double offset = 0.0;

    if (p->regular) {
        perp__contact_direction(edges, j, d);
        return;
    }
    if (j == EDGES - 1) {
        d[0] = -cos(angle); /* to the last bit opposite to vertex 0 */
        d[1] = -sin(angle);
        return;
    }
    if (j > 0) {
        const double steps = (EDGES - 2) / 2 - 1, growth = pow(WIDEST / width, 1.0 / steps);

        offset = width * pow(growth, (j - 1) / 2) * (j % 2 ? 1.0 : -1.0);
    }
    d[0] = cos(angle + offset);
    d[1] = sin(angle + offset);
}

/* Contact by contact: r_n, then for each part its betas and its lambda; then the bilateral rows. */
static void number_unknowns(pyramid *p)
{
    const perp__contact_problem *problem = p->base.problem;
    int32_t k, c, j;

    p->n = 0;
    for (k = 0; k < problem->contacts; k++) {
        perp__contact_part parts[3];
        const int32_t count = perp__contact_parts(problem, k, parts);

        add_unknown(p, problem->starts[k], 1, 1.0, 0.0);
        for (c = 0; c < count; c++) {
            const int32_t edges = edges_of(problem, &parts[c]);

            for (j = 0; j < edges; j++) {
                double d[2] = {j == 0 ? 1.0 : -1.0, 0.0};

                if (parts[c].size == 2)
                    vertex(p, edges, k, c, j, d);
                add_unknown(p, parts[c].row, parts[c].size, d[0], d[1]);
            }
            if (edges > 0)
                add_unknown(p, -1, 0, 0.0, 0.0);
        }
    }
    for (k = problem->rows; k < problem->size; k++)
        add_unknown(p, k, 1, 1.0, 0.0);
}

static void spread_sparse(pyramid *p)
{
    const perp__matrix *W = p->base.problem->W;
    const size_t size = (size_t)W->rows;
    int32_t j, k;

    if (!p->W || size == 0)
        return;
    memset(p->W, 0, size * size * sizeof(double));
    for (j = 0; j < W->columns; j++)
        for (k = W->column_starts[j]; k < W->column_starts[j + 1]; k++)
            p->W[(size_t)W->row_indices[k] + (size_t)j * size] = W->values[k];
}

static double product(const double *W, size_t row_stride, size_t column_stride, const unknown *a,
                      const unknown *b)
{
    double sum = 0.0;
    int32_t i, j;

    for (i = 0; i < a->size; i++)
        for (j = 0; j < b->size; j++)
            sum += a->d[i] * b->d[j] *
                   W[(size_t)(a->row + i) * row_stride + (size_t)(b->row + j) * column_stride];
    return sum;
}

static void fill_impulses(pyramid *p)
{
    const perp__contact_problem *problem = p->base.problem;
    const perp__matrix *W = problem->W;
    const double *values = p->W ? p->W : W->values;
    const size_t row_stride = p->W ? 1 : W->row_stride;
    const size_t column_stride = p->W ? (size_t)problem->size : W->column_stride;
    const size_t n = (size_t)p->n;
    size_t i, j;
    int32_t c;

    for (j = 0; j < n; j++)
        for (i = 0; i < n; i++)
            p->M[i + j * n] =
                p->unknowns[i].size == 0 || p->unknowns[j].size == 0
                    ? 0.0
                    : product(values, row_stride, column_stride, &p->unknowns[i], &p->unknowns[j]);
    for (i = 0; i < n; i++) {
        const unknown *a = &p->unknowns[i];

        p->q[i] = 0.0;
        for (c = 0; c < a->size; c++)
            p->q[i] += a->d[c] * problem->q[a->row + c];
        p->lower[i] = a->size > 0 && a->row >= problem->rows ? -INFINITY : 0.0;
    }
}

/* The rows and columns of the slip speeds. */
static void fill_speeds(pyramid *p)
{
    const perp__contact_problem *problem = p->base.problem;
    const size_t n = (size_t)p->n;
    size_t at = 0;
    int32_t k, c, j;

    for (k = 0; k < problem->contacts; k++) {
        perp__contact_part parts[3];
        const int32_t count = perp__contact_parts(problem, k, parts);
        const size_t normal = at++;

        for (c = 0; c < count; c++) {
            const int32_t edges = edges_of(problem, &parts[c]);
            const size_t lambda = at + (size_t)edges;

            for (j = 0; j < edges; j++, at++) {
                p->M[at + lambda * n] = 1.0;
                p->M[lambda + at * n] = -1.0;
            }
            if (edges > 0)
                p->M[at++ + normal * n] = parts[c].coefficient;
        }
    }
}

/* x := the impulses that z stands for. */
static void gather(const pyramid *p, const double *z, double *x)
{
    int32_t i, c;

    for (i = 0; i < p->base.problem->size; i++)
        x[i] = 0.0;
    for (i = 0; i < p->n; i++)
        for (c = 0; c < p->unknowns[i].size; c++)
            x[p->unknowns[i].row + c] += p->unknowns[i].d[c] * z[i];
}

static void read_modes(const pyramid *p, int8_t *modes)
{
    const perp__contact_problem *problem = p->base.problem;
    int32_t at = 0, k, c;

    for (k = 0; k < problem->contacts; k++) {
        perp__contact_part parts[3];
        const int32_t count = perp__contact_parts(problem, k, parts);

        modes[k] = p->z[at++] > 0.0 ? PERP_CONTACT_STICK : PERP_CONTACT_SEPARATE;
        for (c = 0; c < count; c++) {
            const int32_t edges = edges_of(problem, &parts[c]);

            at += edges > 0 ? edges + 1 : 0;
            if (modes[k] == PERP_CONTACT_STICK && (edges == 0 || p->z[at - 1] > 0.0))
                modes[k] = PERP_CONTACT_SLIP;
        }
    }
}

/* The next windows: about where the discs of r push, or, where there is no impulse, would push
 * first. */
static void set_windows(pyramid *p, const double *r, const double *u)
{
    const perp__contact_problem *problem = p->base.problem;
    int32_t k, c;

    for (k = 0; k < problem->contacts; k++) {
        perp__contact_part parts[3];
        const int32_t count = perp__contact_parts(problem, k, parts);

        for (c = 0; c < count; c++) {
            const double *x = r + parts[c].row, *y = u + parts[c].row;
            double *angle = &p->angles[3 * k + c], *width = &p->widths[3 * k + c], last = *angle;
            double turn;

            if (parts[c].size != 2)
                continue;
            *angle = x[0] != 0.0 || x[1] != 0.0 ? atan2(x[1], x[0]) : atan2(0.0 - y[1], 0.0 - y[0]);
            turn = fabs(remainder(*angle - last, 2.0 * 3.14159265358979323846));
            *width = p->regular       ? WIDTH
                     : turn <= *width ? fmax(LEAST, NARROWER * *width)
                                      : fmin(WIDTH, turn);
        }
    }
}

/* z of the last answer: every disc pushes along the vertex in the middle of its new window. */
static void set_guess(pyramid *p, const double *r, const double *u)
{
    const perp__contact_problem *problem = p->base.problem;
    int32_t at = 0, k, c, j;

    for (k = 0; k < problem->contacts; k++) {
        perp__contact_part parts[3];
        const int32_t count = perp__contact_parts(problem, k, parts);

        p->guess[at++] = r[problem->starts[k]];
        for (c = 0; c < count; c++) {
            const int32_t edges = edges_of(problem, &parts[c]);
            const double *x = r + parts[c].row, *y = u + parts[c].row;
            const double length = parts[c].size == 1 ? fabs(x[0]) : hypot(x[0], x[1]);
            const double radius = parts[c].coefficient * r[problem->starts[k]];

            for (j = 0; j < edges; j++)
                p->guess[at + j] = 0.0;
            if (edges == 0)
                continue;
            p->guess[at + (parts[c].size == 1 && x[0] < 0.0)] = length;
            p->guess[at + edges] = length < 0.999 * radius ? 0.0
                                   : parts[c].size == 1    ? fabs(y[0])
                                                           : hypot(y[0], y[1]);
            at += edges + 1;
        }
    }
    for (k = problem->rows; k < problem->size; k++)
        p->guess[at++] = r[k];
}

static int32_t watch(const perp_lcp_progress *progress, void *user)
{
    const perp__contact_control *control = user;

    return control->tick(control->tick_user, progress->iterations, progress->residual);
}

/* A solver for this call's tolerance and limits. */
static perp_status prepare(pyramid *p)
{
    const perp__contact_problem *problem = p->base.problem;
    perp_lcp_settings settings;
    perp_matrix M;
    perp_status status = perp_lcp_settings_init(&settings, sizeof settings);

    settings.tol = fmin(settings.tol, problem->tol);
    settings.monitor = watch;
    settings.monitor_user = (void *)(uintptr_t)problem->control;
    if (problem->iteration_limit > 0)
        settings.max_iterations = (int32_t)problem->iteration_limit;
    if (status == PERP_OK && !p->lcp)
        status = perp__lcp_create(problem->context, &p->lcp, &settings);
    if (status == PERP_OK)
        status = perp__lcp_set(p->lcp, &settings);
    if (status == PERP_OK)
        status = perp_matrix_init(&M, sizeof M);
    if (status == PERP_OK)
        status =
            perp_matrix_dense(&M, PERP_STORAGE_COLUMN_MAJOR, p->n, p->n, p->M, p->n > 1 ? p->n : 1);
    return status == PERP_OK ? perp__lcp_setup(p->lcp, &M, p->lower, NULL) : status;
}

static perp_status solve(void *work, perp__contact_iterate *iterate)
{
    pyramid *p = work;
    const perp__contact_problem *problem = p->base.problem;
    perp_lcp_result result;
    int32_t i;
    perp_status status = perp_lcp_result_init(&result, sizeof result);

    p->regular = iterate->attempt == 0 || problem->cone > 0;
    number_unknowns(p);
    spread_sparse(p);
    fill_impulses(p);
    fill_speeds(p);
    if (status == PERP_OK)
        status = prepare(p);
    if (status == PERP_OK)
        status = perp__lcp_solve(p->lcp, p->z, NULL, p->direction, &result, p->q,
                                 p->regular ? NULL : p->guess);
    if (status != PERP_OK)
        return status;
    gather(p, p->z, iterate->r);
    perp__multiply(problem->W, iterate->r, iterate->u);
    for (i = 0; i < problem->size; i++)
        iterate->u[i] += problem->q[i];
    set_windows(p, iterate->r, iterate->u);
    set_guess(p, iterate->r, iterate->u);
    iterate->outcome = result.outcome;
    iterate->iterations = result.iterations;
    if (result.outcome == PERP_OUTCOME_RAY)
        gather(p, p->direction, iterate->ray);
    /* an exact cone's contacts may do something else than the polyhedron's */
    if ((result.outcome == PERP_OUTCOME_SOLVED || result.outcome == PERP_OUTCOME_ROUNDING_LIMIT) &&
        problem->cone > 0) {
        read_modes(p, iterate->modes);
        iterate->has_modes = 1;
    }
    return PERP_OK;
}

static void release(void *work)
{
    pyramid *p = work;

    perp__lcp_destroy(p->lcp);
    p->lcp = NULL;
}

const perp__contact_method perp__contact_lemke = {
    PERP_CONTACT_METHOD_LEMKE, sizeof(pyramid), 1, 1, check, layout, solve, release};
