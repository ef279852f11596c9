/* Lemke's method: friction cones as polyhedra, the contact problem as an LCP (Stewart & Trinkle
 * 1996; Anitescu & Potra 1997). For each contact, with directions d_1 .. d_k that span its tangent
 * plane positively, r_t = sum_j beta_j d_j and
 *
 *   0 <= r_n    perp  u_n             >= 0
 *   0 <= beta_j perp  d_j'u_t + lambda >= 0
 *   0 <= lambda perp  mu r_n - sum_j beta_j >= 0
 *
 * and the same for rolling and spinning friction; bilateral rows are equations. At the solution
 * lambda is the slip speed against the polygon: lambda = 0 is stick, r_n = 0 separation. Of a
 * contact that holds both ways r_N is free, u_N = 0, and
 *
 *   0 <= z  perp  e'r_N + z >= 0,     mu (e'r_N + 2 z) - sum_j beta_j  in the last row,
 *
 * as z is the negative part of e'r_N. With one normal e = 1 and that is exact; with more, e is
 * where the last answer pushed.
 *
 * A row with one tangent takes two opposite directions, which is exact. */
#include <float.h>
#include <math.h>
#include <string.h>

#include <perp/contact.h>

#include "base/clock.h"
#include "base/handle.h"
#include "base/outcome.h"
#include "contact/law.h"
#include "lcp/lcp.h"
#include "linalg/spatial.h"

/* Unknown of the LCP: z_j acts on `row` and, with size 2, the next, along d. Slip speeds and the
 * negative parts of e'r_N act on nothing: size 0. */
typedef struct perp__unknown {
    int32_t constraint; /* its contact or bilateral row */
    int32_t row, size;
    int32_t normal, first; /* of a contact: its first normal; of a slip speed: its first beta, from
                              where on to itself all are of one part; else: itself */
    double coefficient;    /* of a slip speed's part */
    double d[2];
} perp__unknown;

typedef struct perp__pyramid {
    perp__contact_work base;
    perp_lcp_solver *lcp;
    int32_t n;
    perp__unknown *unknowns;
    double *M, *q, *lower, *z, *direction;
    double *W;               /* by columns */
    double *angles, *widths; /* 3 contacts: where the discs pushed at the last answer; windows */
    double *sides;           /* 3 contacts: e of those that hold both ways */
    int32_t regular;         /* polygons, without a window */
    double *impulse;         /* contacts and bilateral rows: the unit of z; and 1 over that of */
    double *per_velocity;    /* the rows; for slip speeds the other way round */
} perp__pyramid;

/* ---- the rows of the LCP, from contacts and W ------------------------------------------------ */

/* Edges where the exact cone was asked for and this is only its start. */
enum { EDGES = 10 };

/* Radians from the middle of a window: the last vertex before the opposite one. */
#define WIDEST 2.0

/* Vertices of a part's polygon; 0 where its coefficient is. */
static int32_t edges_of(const perp__contact_problem *problem, const perp__contact_part *part)
{
    if (part->coefficient == 0.0)
        return 0;
    return part->size == 1 ? 2 : problem->cone > 0 ? problem->cone : EDGES;
}

static int64_t count_unknowns(const perp__contact_problem *problem)
{
    int64_t n = problem->size - problem->rows;

    for (int32_t k = 0; k < problem->contacts; k++) {
        perp__contact_part parts[3];
        const int32_t count = perp__contact_parts(problem, k, parts);

        n += 1 + perp__contact_two_sided(problem, k);
        for (int32_t p = 0; p < count; p++)
            if (edges_of(problem, &parts[p]) > 0)
                n += edges_of(problem, &parts[p]) + 1;
    }
    return n;
}

static perp__unknown *add_unknown(perp__pyramid *p, int32_t constraint, int32_t normal, int32_t row,
                                  int32_t size)
{
    perp__unknown *added = &p->unknowns[p->n];

    *added = (perp__unknown){constraint, row, size, normal, p->n, 0.0, {1.0, 0.0}};
    p->n++;
    return added;
}

/* Vertex j of the polygon of a disc, part c of contact k. */
static void vertex(const perp__pyramid *p, int32_t edges, int32_t k, int32_t c, int32_t j,
                   double d[2])
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

/* Contact by contact: r_n, or r_N and z, then for each part its betas and its lambda; then the
 * bilateral rows. */
static void number(perp__pyramid *p)
{
    const perp__contact_problem *problem = p->base.problem;

    p->n = 0;
    for (int32_t k = 0; k < problem->contacts + problem->size - problem->rows; k++) {
        perp__contact_units(problem, k, &p->impulse[k], &p->per_velocity[k]);
        p->per_velocity[k] = 1.0 / p->per_velocity[k];
    }
    for (int32_t k = 0; k < problem->contacts; k++) {
        perp__contact_part parts[3];
        const int32_t count = perp__contact_parts(problem, k, parts), normal = p->n;

        for (int32_t i = 0; i < perp__contact_normals(problem, k); i++)
            add_unknown(p, k, normal, problem->starts[k] + i, 1);
        if (perp__contact_two_sided(problem, k) > 0)
            add_unknown(p, k, normal, -1, 0);
        for (int32_t c = 0; c < count; c++) {
            const int32_t edges = edges_of(problem, &parts[c]), first = p->n;

            for (int32_t j = 0; j < edges; j++) {
                double *d = add_unknown(p, k, normal, parts[c].row, parts[c].size)->d;

                if (parts[c].size == 2)
                    vertex(p, edges, k, c, j, d);
                else
                    d[0] = j == 0 ? 1.0 : -1.0;
            }
            if (edges > 0) {
                perp__unknown *lambda = add_unknown(p, k, normal, -1, 0);

                lambda->first = first;
                lambda->coefficient = parts[c].coefficient;
            }
        }
    }
    for (int32_t k = problem->rows; k < problem->size; k++)
        add_unknown(p, problem->contacts + k - problem->rows, p->n, k, 1);
}

/* The rows of all that impulses move. Returns 0 where time is up. */
static bool fill_impulses(perp__pyramid *p)
{
    const perp__contact_problem *problem = p->base.problem;
    const double deadline = problem->control ? problem->control->deadline : 0.0;
    const size_t n = (size_t)p->n, size = (size_t)problem->size;

    if (size > 0)
        memset(p->W, 0, size * size * sizeof *p->W);
    perp__matrix_spread(problem->W, p->W, size);
    for (size_t j = 0; j < n; j++) {
        const perp__unknown *b = &p->unknowns[j];
        const int32_t k = b->constraint;

        if (deadline > 0.0 && perp__now() >= deadline)
            return 0;
        for (size_t i = 0; i < n; i++) {
            const perp__unknown *a = &p->unknowns[i];
            double sum = 0.0;

            if (a->size > 0 && b->size > 0 && perp__contact_couples(problem, a->constraint, k)) {
                for (int32_t c = 0; c < a->size; c++)
                    for (int32_t e = 0; e < b->size; e++)
                        sum += a->d[c] * b->d[e] *
                               p->W[(size_t)(a->row + c) + (size_t)(b->row + e) * size];
                sum *= p->impulse[k] * p->per_velocity[a->constraint];
            }
            p->M[i + j * n] = sum;
        }
        p->q[j] = 0.0;
        for (int32_t c = 0; c < b->size; c++)
            p->q[j] += b->d[c] * problem->q[b->row + c] * p->per_velocity[k];
        p->lower[j] = 0.0; /* but of bilateral rows, and normals that hold both ways */
        if (b->size > 0 && (k >= problem->contacts ||
                            b->row < problem->starts[k] + perp__contact_two_sided(problem, k)))
            p->lower[j] = -INFINITY;
    }
    return 1;
}

/* The rows and columns of the slip speeds, and of z. The pressure in the row of a slip speed is
 * r_n, or e'r_N + 2 z = |e'r_N|. */
static void fill_speeds(perp__pyramid *p)
{
    const size_t n = (size_t)p->n;

    for (size_t i = 0; i < n; i++) {
        const perp__unknown *a = &p->unknowns[i];
        const bool slips = (size_t)a->first < i;
        const double *sides = p->sides + 3 * a->constraint;
        const size_t normal = (size_t)a->normal;
        size_t both;

        if (a->size > 0)
            continue;
        both = (size_t)perp__contact_two_sided(p->base.problem, a->constraint);
        for (size_t j = (size_t)a->first; j < i; j++) {
            p->M[j + i * n] = 1.0;
            p->M[i + j * n] = -1.0;
        }
        if (both == 0)
            p->M[i + normal * n] = a->coefficient;
        for (size_t j = 0; j < both; j++)
            p->M[i + (normal + j) * n] = (slips ? a->coefficient : 1.0) * sides[j];
        if (both > 0)
            p->M[i + (normal + both) * n] = slips ? 2.0 * a->coefficient : 1.0;
    }
}

/* x := the impulses that z stands for. */
static void gather(const perp__pyramid *p, const double *z, double *x)
{
    for (int32_t i = 0; i < p->base.problem->size; i++)
        x[i] = 0.0;
    for (int32_t i = 0; i < p->n; i++)
        for (int32_t c = 0; c < p->unknowns[i].size; c++)
            x[p->unknowns[i].row + c] +=
                p->unknowns[i].d[c] * (z[i] * p->impulse[p->unknowns[i].constraint]);
}

/* The modes that z shows: a contact slips where some part does, or has no friction. */
static void read_modes(const perp__pyramid *p, int8_t *modes)
{
    const perp__contact_problem *problem = p->base.problem;

    for (int32_t i = 0; i < p->n; i++) {
        const perp__unknown *a = &p->unknowns[i];
        perp__contact_part parts[3];

        if (a->constraint >= problem->contacts)
            continue;
        if (i == a->normal) {
            const int32_t count = perp__contact_parts(problem, a->constraint, parts);

            modes[a->constraint] = p->z[i] > 0.0 ? PERP_CONTACT_STICK : PERP_CONTACT_SEPARATE;
            for (int32_t c = 0; c < count && p->z[i] > 0.0; c++)
                if (parts[c].coefficient == 0.0)
                    modes[a->constraint] = PERP_CONTACT_SLIP;
        } else if (a->size == 0 && p->z[i] > 0.0 && p->z[a->normal] > 0.0) {
            modes[a->constraint] = PERP_CONTACT_SLIP;
        }
    }
}

/* ---- the method ------------------------------------------------------------------------------ */

/* Attempts after the first look closer: each disc's polygon has its vertices near the direction in
 * which the last answer pushed and further and further apart from there on. In the window, `width`
 * radians to either side of the middle, the error is of second order in it. An answer in the window
 * narrows it. */
#define WIDTH 0.2               /* of attempt 1 */
#define LEAST sqrt(DBL_EPSILON) /* narrower, cosines could not tell the vertices apart */
#define NARROWER 0.125

/* More unknowns than this are more than pivoting serves. In a plan, of more than so few, the path
 * has the last word: M is copositive, but for contacts that hold both ways, and where its paths end
 * in rays nothing promises an answer: Newton's method on M costs fifty times as much in vain. */
enum { MOST_UNKNOWNS = 20000, FEW_UNKNOWNS = 20 };

static perp_status check(const perp__contact_problem *problem)
{
    const int64_t n = count_unknowns(problem);

    if (problem->cone > 0 && problem->two_sided)
        return perp__refuse(problem->context,
                            "settings.cone is %d, expected 0 with contacts that hold both ways",
                            (int)problem->cone);
    if (n <= MOST_UNKNOWNS)
        return PERP_OK;
    return perp__refuse(problem->context,
                        "the method lemke takes up to %d unknowns, and the contacts' polyhedral "
                        "cones have %lld",
                        (int)MOST_UNKNOWNS, (long long)n);
}

static void layout(perp__arena *arena, void *work)
{
    perp__pyramid *p = work;
    const perp__contact_problem *problem = p->base.problem;
    const size_t n = (size_t)count_unknowns(problem), size = (size_t)problem->size;

    p->n = (int32_t)n;
    p->unknowns = perp__arena_take(arena, n, sizeof(perp__unknown));
    p->M = perp__arena_take(arena, n, n * sizeof(double));
    PERP__DOUBLES(arena, n, &p->q, &p->lower, &p->z, &p->direction);
    PERP__DOUBLES(arena, 3 * (size_t)problem->contacts, &p->angles, &p->widths, &p->sides);
    PERP__DOUBLES(arena, size, &p->impulse, &p->per_velocity);
    p->W = perp__arena_take(arena, size, size * sizeof(double));
}

/* The next windows: about where the discs of r push, or, where there is no impulse, would push
 * first. */
static void set_windows(perp__pyramid *p, const double *r, const double *u)
{
    const perp__contact_problem *problem = p->base.problem;

    for (int32_t k = 0; k < problem->contacts; k++) {
        perp__contact_part parts[3];
        const int32_t count = perp__contact_parts(problem, k, parts);

        for (int32_t c = 0; c < count; c++) {
            const double *x = r + parts[c].row, *y = u + parts[c].row;
            double *angle = &p->angles[3 * k + c], *width = &p->widths[3 * k + c];
            const double last = p->regular ? 0.0 : *angle; /* of no account after regular ones */
            double turn;

            if (parts[c].size != 2)
                continue;
            *angle = x[0] != 0.0 || x[1] != 0.0 ? atan2(x[1], x[0]) : atan2(0.0 - y[1], 0.0 - y[0]);
            turn = fabs(remainder(*angle - last, 2.0 * PERP__PI));
            *width = p->regular       ? WIDTH
                     : turn <= *width ? fmax(LEAST, NARROWER * *width)
                                      : fmin(WIDTH, turn);
        }
    }
}

/* e of contacts that hold both ways: along r_N, or, where there is none, against u_N. */
static void set_sides(perp__pyramid *p, const double *r, const double *u)
{
    const perp__contact_problem *problem = p->base.problem;

    for (int32_t k = 0; k < problem->contacts; k++) {
        const int32_t row = problem->starts[k], end = row + perp__contact_two_sided(problem, k);
        const double length = perp__contact_length(r, row, end);
        const double speed = perp__contact_length(u, row, end);
        double *e = p->sides + 3 * (size_t)k;

        for (int32_t i = row; i < end; i++)
            e[i - row] = end - row == 1 ? 1.0
                         : length > 0.0 ? r[i] / length
                         : speed > 0.0  ? -u[i] / speed
                                        : i == row;
    }
}

static int32_t watch(const perp_lcp_progress *progress, void *user)
{
    const perp__contact_control *control = user;

    return control->tick(control->tick_user, progress->iterations, progress->residual);
}

static perp_status solve(void *work, perp__contact_iterate *iterate)
{
    perp__pyramid *p = work;
    const perp__contact_problem *problem = p->base.problem;
    perp_matrix M;
    perp_lcp_settings settings;
    perp_lcp_result result;
    perp_status status = perp_struct_init(&result, sizeof result);

    /* 1. The LCP. */
    PERP__THEN(status, perp_lcp_settings_init(&settings, sizeof settings));
    p->regular = iterate->attempt == 0 || problem->cone > 0;
    if (p->regular)
        set_sides(p, iterate->r, problem->q);
    number(p);
    iterate->outcome = PERP_OUTCOME_TIME_LIMIT;
    if (status != PERP_OK || !fill_impulses(p))
        return status; /* with the start */
    fill_speeds(p);
    if (!perp__all_finite(p->M, (size_t)p->n * (size_t)p->n) ||
        !perp__all_finite(p->q, (size_t)p->n)) {
        /* the caller's numbers are finite, but at the ends of what there is, and so may overflow in
         * the units of their contacts: no error of theirs */
        iterate->outcome = PERP_OUTCOME_STALLED;
        return PERP_OK;
    }

    /* 2. Its answer, to this call's tolerance and limits. */
    M = perp__view(PERP_STORAGE_COLUMN_MAJOR, p->n, p->n, p->M);
    settings.tol = fmin(settings.tol, problem->tol);
    if (problem->yields || (!problem->chosen && !problem->two_sided && p->n > FEW_UNKNOWNS))
        settings.method = PERP_LCP_LEMKE;
    settings.monitor = watch;
    settings.monitor_user = (void *)(uintptr_t)problem->control;
    if (problem->control->deadline > 0.0)
        settings.time_limit = perp__time_left(problem->control->deadline);
    if (problem->iteration_limit > 0)
        settings.max_iterations = (int32_t)problem->iteration_limit;
    if (!p->lcp)
        status = perp__lcp_create(problem->context, &p->lcp, &settings);
    if (p->lcp)
        perp__lcp_insist(p->lcp, problem->two_sided != NULL);
    PERP__THEN(status, perp__lcp_set(p->lcp, &settings));
    PERP__THEN(status, perp__lcp_setup(p->lcp, &M, p->lower, NULL));
    PERP__THEN(status, perp__lcp_solve(p->lcp, p->z, NULL, p->direction, &result, p->q, NULL));
    if (status != PERP_OK)
        return status;

    /* 3. What it means, and where to look closer next time. */
    gather(p, p->z, iterate->r);
    perp__multiply(problem->W, iterate->r, iterate->u);
    for (int32_t i = 0; i < problem->size; i++)
        iterate->u[i] += problem->q[i];
    set_windows(p, iterate->r, iterate->u);
    set_sides(p, iterate->r, iterate->u);
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
    perp__pyramid *p = work;

    perp__handle_end(p->lcp);
    p->lcp = NULL;
}

const perp__contact_method perp__contact_lemke = {
    PERP_CONTACT_METHOD_LEMKE, sizeof(perp__pyramid), 1, 1, check, layout, solve, release, NULL};
