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

/* A coordinate counts as determined if no more than this of it is outside the span. */
#define SPAN_TOLERANCE 1e-10

typedef struct held {
    double *rows, *targets, *norms;        /* count by n, count, count */
    double *basis, *particular, *y, *unit; /* n by n, n, n, n */
    double *components; /* n: of `particular` along the basis; n more of scratch behind */
    int32_t *taken;
    int32_t count, rank;
} held;

void perp__solve_lower(const perp_mechanism *m, const perp__terms *terms, double *x)
{
    const size_t n = (size_t)m->n;
    size_t i, k;

    for (k = 0; k < n; k++) {
        const double *column = terms->factor + n * k;

        if (x[k] == 0.0)
            continue;
        x[k] /= column[k];
        for (i = k + 1; i < n; i++)
            x[i] -= column[i] * x[k];
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
        if (x[i] != 0.0)
            length = length == 0.0 ? fabs(x[i]) : hypot(length, x[i]);
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

/* Whether the rows determine coordinate i, and with rows alone whose targets are 0. */
static int32_t is_at_rest(const perp_mechanism *m, held *h, const perp__terms *terms, size_t i)
{
    const size_t n = (size_t)m->n;
    double *rest = h->components + n, length;
    int32_t j;
    size_t k;

    memset(h->unit, 0, n * sizeof *h->unit);
    h->unit[i] = 1.0;
    perp__solve_lower(m, terms, h->unit); /* 0 before i */
    memcpy(rest, h->unit, n * sizeof *rest);
    length = length_of(h->unit, n);
    for (j = 0; j < h->rank; j++) {
        const double *q = h->basis + (size_t)j * n;
        double along = 0.0;

        for (k = i; k < n; k++)
            along += q[k] * h->unit[k];
        if (along == 0.0)
            continue;
        if (h->components[j] != 0.0)
            return 0;
        for (k = 0; k < n; k++)
            rest[k] -= along * q[k];
    }
    return length_of(rest, n) <= SPAN_TOLERANCE * length;
}

/* Components of the particular solution along the basis: exactly 0 where rows of other bodies
 * alone have targets. */
static void find_components(const perp_mechanism *m, held *h)
{
    const size_t n = (size_t)m->n;
    int32_t j;
    size_t k;

    for (j = 0; j < h->rank; j++) {
        const double *q = h->basis + (size_t)j * n;

        h->components[j] = 0.0;
        for (k = 0; k < n; k++)
            h->components[j] += q[k] * h->particular[k];
    }
}

/* A coordinate that the rows determine, or that one row alone does, without rounding. */
static void fix_coordinates(const perp_mechanism *m, held *h, const perp__velocity_answer *answer,
                            const perp__velocity_problem *problem, double *v)
{
    const size_t n = (size_t)m->n;
    int32_t row, contact = 0;
    size_t i, k, only;

    find_components(m, h);
    for (i = 0; i < n && h->rank > 0; i++)
        if (v[i] == 0.0 || is_at_rest(m, h, problem->terms, i)) /* never -0.0 */
            v[i] = 0.0;
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
    double *v = h->y, size;
    size_t i, k;

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

        for (k = i; k < n; k++)
            sum += problem->terms->factor[k + n * i] * h->unit[k];
        h->unit[i] = sum; /* no longer needed */
    }
    return length_of(h->unit, n) <= PERP__AGREEMENT * size;
}

void perp__hold_velocities(perp_mechanism *m, perp__velocity_answer *answer,
                           const perp__velocity_problem *problem)
{
    const size_t n = (size_t)m->n, rows = (size_t)m->rows;
    held h = {0};
    int32_t i, contact = 0, agrees;

    h.rows = m->work;
    h.targets = h.rows + rows * n;
    h.norms = h.targets + rows;
    h.basis = h.norms + rows;
    h.particular = h.basis + n * n;
    h.y = h.particular + n;
    h.unit = h.y + n;
    h.components = h.unit + n;
    h.taken = m->indices;
    gather(m, &h, answer, problem);
    agrees = h.count == 0 || hold(m, &h, answer, problem);
    if (agrees && h.count > 0) /* else the solution's are as good */
        memcpy(answer->v, h.y, n * sizeof *answer->v);
    perp__row_velocities(m, problem->terms, answer->u, answer->v);
    for (i = 0; i < m->rows && agrees; i++) {
        while (contact < m->contacts && i >= m->starts[contact + 1])
            contact++;
        if (answer->holds[i])
            answer->u[i] = contact < m->contacts && i == m->starts[contact]
                               ? 0.0 - problem->shift[contact]
                               : 0.0;
    }
}
