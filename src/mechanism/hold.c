/* Velocities in what the rows that hold leave free.
 *
 * Let A v = t be the rows that hold: closed normals, sticking tangents, bilateral ones. In
 * mass-weighted coordinates y = L'v (M = L L') the solution of the problem is
 *
 *   y = y_0 + (E - Q Q') L^-1 (momentum + J_free' r_free),    A L^-T y_0 = t,
 *
 * with Q an orthonormal basis of the rows of A L^-T: the impulses of rows that hold drop out, and
 * no cancellation of large impulses touches the result. Where t = 0 and A has full rank, v is 0.0;
 * the same holds for a single coordinate that the rows determine. */
#include "mechanism/mechanism.h"

#include <math.h>
#include <string.h>

#include "linalg/orthogonal.h"

/* Exact velocities must agree with the solution's as well as that is known; where they do not (a
 * problem stopped early), the solution's stand. */
#define AGREEMENT 1e-8

/* A coordinate counts as determined if no more than this of it is outside the span. */
#define SPAN_TOLERANCE 1e-10

typedef struct held {
    double *rows, *targets, *norms;        /* count by n, count, count */
    double *basis, *particular, *y, *unit; /* n by n, n, n, n */
    int32_t *taken;
    int32_t count, rank, moving; /* moving: some target is not 0 */
} held;

void perp__solve_lower(const perp_mechanism *m, const perp__terms *terms, double *x)
{
    const size_t n = (size_t)m->n;
    size_t i, k;

    for (i = 0; i < n; i++) {
        for (k = 0; k < i; k++)
            x[i] -= terms->factor[i + n * k] * x[k];
        x[i] /= terms->factor[i * (n + 1)];
    }
}

/* x := L^-T x. */
static void backward(const perp_mechanism *m, const perp__terms *terms, double *x)
{
    const size_t n = (size_t)m->n;
    size_t i, k;

    for (i = n; i-- > 0;) {
        for (k = i + 1; k < n; k++)
            x[i] -= terms->factor[k + n * i] * x[k];
        x[i] /= terms->factor[i * (n + 1)];
    }
}

static double length_of(const double *x, size_t n)
{
    double length = 0.0;
    size_t i;

    for (i = 0; i < n; i++)
        length = hypot(length, x[i]);
    return length;
}

/* What the row's velocity J_i v is where it holds. */
static double target_of(const perp_mechanism *m, const perp__velocity_problem *problem, int32_t row,
                        int32_t contact)
{
    double target = 0.0 - problem->terms->drift[row];

    if (contact >= 0 && row == m->starts[contact])
        target -= problem->shift[contact];
    return target;
}

static void gather(const perp_mechanism *m, held *h, const perp__velocity_answer *answer,
                   const perp__velocity_problem *problem)
{
    const size_t n = (size_t)m->n;
    int32_t i, contact = 0;
    size_t k;

    for (i = 0; i < m->rows; i++) {
        double *row = h->rows + (size_t)h->count * n;
        double norm, target;

        while (contact < m->contacts && i >= m->starts[contact + 1])
            contact++;
        if (!answer->holds[i])
            continue;
        memcpy(row, problem->terms->J + (size_t)i * n, n * sizeof *row);
        perp__solve_lower(m, problem->terms, row);
        norm = length_of(row, n);
        if (norm == 0.0)
            continue;
        for (k = 0; k < n; k++)
            row[k] /= norm;
        target = target_of(m, problem, i, contact < m->contacts ? contact : -1);
        h->moving = h->moving || target != 0.0;
        h->targets[h->count++] = target / norm;
    }
}

static void add_free(const perp_mechanism *m, const perp__velocity_answer *answer,
                     const perp__velocity_problem *problem, double *x)
{
    const size_t n = (size_t)m->n;
    int32_t i;
    size_t k;

    memcpy(x, problem->momentum, n * sizeof *x);
    for (i = 0; i < m->rows; i++)
        for (k = 0; k < n && !answer->holds[i] && answer->r[i] != 0.0; k++)
            x[k] += problem->terms->J[(size_t)i * n + k] * answer->r[i];
}

/* A coordinate that the rows determine, or that one row alone does, without rounding. */
static void fix_coordinates(const perp_mechanism *m, held *h, const perp__velocity_answer *answer,
                            const perp__velocity_problem *problem, double *v)
{
    const size_t n = (size_t)m->n;
    int32_t row, contact = 0;
    size_t i, k, only;

    for (i = 0; i < n; i++) {
        double length;

        memset(h->unit, 0, n * sizeof *h->unit);
        h->unit[i] = 1.0;
        perp__solve_lower(m, problem->terms, h->unit);
        length = length_of(h->unit, n);
        perp__project_out(h->basis, h->rank, m->n, h->unit);
        if (length_of(h->unit, n) <= SPAN_TOLERANCE * length && !h->moving)
            v[i] = 0.0;
    }
    for (row = 0; row < m->rows; row++) {
        while (contact < m->contacts && row >= m->starts[contact + 1])
            contact++;
        if (!answer->holds[row])
            continue;
        for (k = 0, i = 0, only = 0; k < n; k++)
            if (problem->terms->J[(size_t)row * n + k] != 0.0) {
                i++;
                only = k;
            }
        if (i == 1)
            v[only] = target_of(m, problem, row, contact < m->contacts ? contact : -1) /
                          problem->terms->J[(size_t)row * n + only] +
                      0.0; /* never -0.0 */
    }
}

/* v, or 0 where that does not agree with the solution. */
static int32_t hold(const perp_mechanism *m, held *h, perp__velocity_answer *answer,
                    const perp__velocity_problem *problem)
{
    const size_t n = (size_t)m->n;
    double *v = h->y, size, distance = 0.0;
    size_t i;

    h->rank = perp__orthogonal_rows(h->rows, h->targets, h->taken, h->norms, h->basis,
                                    h->particular, h->count, m->n);
    add_free(m, answer, problem, h->y);
    perp__solve_lower(m, problem->terms, h->y);
    size = length_of(h->y, n) + length_of(h->particular, n);
    if (h->rank == m->n)
        memcpy(h->y, h->particular, n * sizeof *h->y);
    else {
        perp__project_out(h->basis, h->rank, m->n, h->y);
        for (i = 0; i < n; i++)
            h->y[i] += h->particular[i];
    }
    backward(m, problem->terms, v);
    fix_coordinates(m, h, answer, problem, v);
    for (i = 0; i < n; i++)
        h->unit[i] = v[i] - answer->v[i];
    for (i = 0; i < n; i++) { /* L'(v - v_solution) */
        double sum = 0.0;
        size_t k;

        for (k = i; k < n; k++)
            sum += problem->terms->factor[k + n * i] * h->unit[k];
        distance = hypot(distance, sum);
    }
    return distance <= AGREEMENT * size;
}

void perp__hold_velocities(perp_mechanism *m, perp__velocity_answer *answer,
                           const perp__velocity_problem *problem)
{
    const size_t n = (size_t)m->n, rows = (size_t)m->rows;
    held h = {0};
    int32_t i, contact = 0;

    h.rows = m->work;
    h.targets = h.rows + rows * n;
    h.norms = h.targets + rows;
    h.basis = h.norms + rows;
    h.particular = h.basis + n * n;
    h.y = h.particular + n;
    h.unit = h.y + n;
    h.taken = m->indices;
    gather(m, &h, answer, problem);
    if (hold(m, &h, answer, problem))
        memcpy(answer->v, h.y, n * sizeof *answer->v);
    perp__row_velocities(m, problem->terms, answer->u, answer->v);
    for (i = 0; i < m->rows; i++) {
        while (contact < m->contacts && i >= m->starts[contact + 1])
            contact++;
        if (answer->holds[i])
            answer->u[i] = contact < m->contacts && i == m->starts[contact]
                               ? 0.0 - problem->shift[contact]
                               : 0.0;
    }
}
