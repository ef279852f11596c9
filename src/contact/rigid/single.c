/* One body that contacts join with the world at rest, as most that slide or lie are: whether the
 * impulses to start from are the answer, and the velocities that what holds leaves (hold.h), with
 * all numbers on the stack.
 *
 * The residuals are those of verdict.c with the terms of the contacts alone below, in plain
 * doubles, and what rounding may have made of them added: a point that passes here passes there.
 * Where one does not, that says nothing. */
#include "contact/contact.h"

#include <math.h>
#include <string.h>

#include "base/outcome.h"
#include "contact/law.h"
#include "contact/rigid/rigid.h"
#include "linalg/lanes/lanes.h"
#include "linalg/lanes/multiversion.h"

/* Vectors are filled up with zeros: one group of lanes in the plane, two in space. */
enum { LANES = 4, WIDTH = 2 * LANES, MOST = 8, ROWS = 3 * MOST };

/* As in held.c, orthogonal.c and clusters.c. */
#define ROUNDING (256.0 * DBL_EPSILON)
#define RANK_TOLERANCE 1e-8
#define PIVOT_THRESHOLD 0.5
#define SPAN 1e-10

typedef struct single {
    const perp__rigid_problem *problem;
    int32_t rows, starts[MOST + 1], dims[MOST], modes[MOST], held[MOST];
    double C[WIDTH][WIDTH];     /* the factor, a row a vector */
    double sizes[WIDTH][WIDTH]; /* |C| */
    double v[WIDTH];
    double P[ROWS][WIDTH];                         /* J C */
    double A[ROWS][WIDTH];                         /* |J| |C| */
    double q[ROWS], r[ROWS], u[ROWS], scale[ROWS]; /* |P| |P'| |r| + |q| */
    double error[ROWS];                            /* at least what rounding made of u */
    double mu[MOST], trace[MOST], root[MOST], omega[MOST];
    double y[WIDTH];            /* P'r */
    double basis[WIDTH][WIDTH]; /* of the rows that hold */
    int32_t rank;
} single;

PERP__KERNEL static double dot(const double *a, const double *b, int32_t n)
{
    perp__lanes sum = PERP__CONST_LANES_AT(a) * PERP__CONST_LANES_AT(b);

    if (n > LANES)
        sum += PERP__CONST_LANES_AT(a + LANES) * PERP__CONST_LANES_AT(b + LANES);
    return (sum[0] + sum[2]) + (sum[1] + sum[3]);
}

/* y += s x */
PERP__KERNEL static void add(double *y, double s, const double *x, int32_t n)
{
    for (int32_t i = 0; i < n; i += LANES)
        PERP__LANES_AT(y + i) += PERP__SAME_LANES(s) * PERP__CONST_LANES_AT(x + i);
}

/* y += |s x| */
PERP__KERNEL static void add_size(double *y, double s, const double *x, int32_t n)
{
    for (int32_t i = 0; i < n; i += LANES) {
        const perp__lanes term = PERP__SAME_LANES(s) * PERP__CONST_LANES_AT(x + i);

        PERP__LANES_AT(y + i) += PERP__ABSOLUTE_LANES(term);
    }
}

/* |a|'b, b >= 0 */
PERP__KERNEL static double size_of(const double *a, const double *b, int32_t n)
{
    perp__lanes sum = {0.0, 0.0, 0.0, 0.0};

    for (int32_t i = 0; i < n; i += LANES) {
        const perp__lanes part = PERP__CONST_LANES_AT(a + i);

        sum += PERP__ABSOLUTE_LANES(part) * PERP__CONST_LANES_AT(b + i);
    }
    return (sum[0] + sum[2]) + (sum[1] + sum[3]);
}

static int32_t is_single(const perp__rigid_problem *problem)
{
    if (problem->bodies != 1 || problem->carriers > 0 || problem->joints > 0 ||
        problem->contacts < 1 || problem->contacts > MOST || !problem->warm || problem->cone > 0 ||
        problem->method != PERP_CONTACT_METHOD_AUTO)
        return 0;
    for (int32_t k = 0; k < problem->contacts; k++)
        if (problem->rows[k].body[0] + problem->rows[k].body[1] != PERP__RIGID_AT_REST)
            return 0;
    return 1;
}

static const double (*rows_of(const perp__rigid_rows *g))[6]
{
    return g->rows[g->body[0] != 0];
}

/* P = J C and |J| |C| of one row. */
PERP__KERNEL static void whiten(single *s, int32_t row, const double *J, int32_t n)
{
    for (int32_t i = 0; i < n; i += LANES) {
        perp__lanes sum = PERP__SAME_LANES(0.0), size = PERP__SAME_LANES(0.0);

        for (int32_t l = 0; l < n; l++) {
            sum += PERP__SAME_LANES(J[l]) * PERP__CONST_LANES_AT(s->C[l] + i);
            size += PERP__SAME_LANES(fabs(J[l])) * PERP__CONST_LANES_AT(s->sizes[l] + i);
        }
        PERP__LANES_AT(s->P[row] + i) = sum;
        PERP__LANES_AT(s->A[row] + i) = size;
    }
}

/* P, q and what bounds their errors, of one contact. */
PERP__KERNEL static void load(single *s, int32_t k, int32_t n)
{
    const perp__rigid_rows *g = &s->problem->rows[k];
    const double(*J)[6] = rows_of(g);
    const int32_t from = s->starts[k];
    double square = 0.0;

    for (int32_t i = 0; i < s->dims[k]; i++) {
        double q = g->bias[i], size = fabs(g->bias[i]);

        whiten(s, from + i, J[i], n);
        for (int32_t l = 0; l < n; l++) {
            q += J[i][l] * s->v[l];
            size += fabs(J[i][l] * s->v[l]);
        }
        square += dot(s->P[from + i], s->P[from + i], n);
        s->q[from + i] = q;
        s->error[from + i] = size;
        s->r[from + i] = s->problem->warm[3 * k + i];
    }
    s->trace[k] = square;
    s->root[k] = sqrt(square);
}

PERP__KERNEL static void load_all(single *s, int32_t n)
{
    const perp__rigid_problem *p = s->problem;

    memset(s->C, 0, sizeof s->C);
    memset(s->v, 0, sizeof s->v);
    memcpy(s->v, p->free, (size_t)n * sizeof *s->v);
    for (int32_t i = 0; i < n; i++) {
        memcpy(s->C[i], p->factors + n * i, (size_t)n * sizeof(double));
        for (int32_t k = 0; k < n; k += LANES) {
            const perp__lanes part = PERP__CONST_LANES_AT(s->C[i] + k);

            PERP__LANES_AT(s->sizes[i] + k) = PERP__ABSOLUTE_LANES(part);
        }
    }
    s->starts[0] = 0;
    for (int32_t k = 0; k < p->contacts; k++) {
        s->dims[k] = p->rows[k].dim;
        s->mu[k] = s->dims[k] > 1 ? p->rows[k].mu : 0.0;
        s->starts[k + 1] = s->starts[k] + s->dims[k];
        load(s, k, n);
    }
    s->rows = s->starts[p->contacts];
}

/* u = P P'r + q, its terms, and its errors: products and sums of at most rows + 3 n + 4 terms. */
PERP__KERNEL static void find_velocities(single *s, int32_t n)
{
    const double unit = (s->rows + 3 * n + 4) * DBL_EPSILON;
    double terms[WIDTH] = {0.0}, most[WIDTH] = {0.0};

    memset(s->y, 0, sizeof s->y);
    for (int32_t i = 0; i < s->rows; i++) {
        add(s->y, s->r[i], s->P[i], n);
        add_size(terms, s->r[i], s->P[i], n);
        add_size(most, s->r[i], s->A[i], n);
    }
    for (int32_t i = 0; i < s->rows; i++) {
        s->u[i] = dot(s->P[i], s->y, n) + s->q[i];
        s->scale[i] = fabs(s->q[i]) + size_of(s->P[i], terms, n);
        s->error[i] = unit * (s->error[i] + dot(s->A[i], most, n));
    }
}

/* The residuals, as they are or larger. Returns 0 where contacts that press separate. */
PERP__KERNEL static int32_t judge(single *s, perp__evidence *worth, int32_t n)
{
    perp__contact_problem law;
    double drive = 0.0;

    memset(&law, 0, sizeof law);
    law.contacts = s->problem->contacts;
    law.rows = law.size = s->rows;
    law.starts = s->starts;
    law.dims = s->dims;
    law.mu = s->mu;
    law.trace = s->trace;
    law.q = s->q;
    for (int32_t k = 0; k < law.contacts; k++)
        perp__contact_clip(&law, k, s->r);
    find_velocities(s, n);
    perp__contact_omegas(&law, NULL, 1, &drive, s->omega);
    for (int32_t k = 0; k < law.contacts; k++) {
        const int32_t from = s->starts[k], to = s->starts[k + 1];
        const double natural = perp__contact_natural(&law, k, s->r, s->u, &s->modes[k]);
        const double error = 2.0 * (1.0 + s->mu[k]) * perp__contact_length(s->error, from, to);
        double lack = s->trace[k] * natural;

        if (s->r[from] == 0.0)
            s->modes[k] = PERP_CONTACT_SEPARATE;
        else if (s->modes[k] == PERP_CONTACT_SEPARATE)
            return 0;
        if (s->modes[k] == PERP_CONTACT_STICK)
            lack = fmax(lack, perp__contact_length(s->u, from, to));
        else if (s->modes[k] == PERP_CONTACT_SLIP)
            lack = fmax(lack, fabs(s->u[from]));
        perp__raise_to(&worth->tested, (lack + error) / (s->root[k] * s->omega[k]));
        perp__raise_to(&worth->own, (lack + error) / perp__contact_length(s->scale, from, to));
    }
    return drive > 0.0;
}

/* How many rows of a contact hold, as in held.c. */
static int32_t count_held(const single *s, int32_t k)
{
    const int32_t from = s->starts[k], to = s->starts[k + 1], mode = s->modes[k];
    const double slack = sqrt(s->problem->tol) * s->omega[k] * s->root[k];
    int32_t rounds = mode == PERP_CONTACT_STICK;

    if (!(fabs(s->u[from]) <= slack))
        return 0;
    if (mode == PERP_CONTACT_SEPARATE && !(fabs(s->u[from]) <= ROUNDING * s->scale[from]))
        return 0;
    for (int32_t i = from + 1; i < to; i++)
        if (!(fabs(s->u[i]) <= slack) || (!rounds && !(fabs(s->u[i]) <= ROUNDING * s->scale[i])))
            return 1;
    return s->mu[k] > 0.0 ? to - from : 1;
}

/* The rows that hold, normals first, at length 1, and the velocities along them without what they
 * push. */
PERP__KERNEL static int32_t gather(const single *s, const double *loose, double (*rows)[WIDTH],
                                   double *targets, int32_t n)
{
    int32_t count = 0;

    for (int32_t tangents = 0; tangents < 2; tangents++)
        for (int32_t k = 0; k < s->problem->contacts; k++) {
            const int32_t from = s->starts[k];

            for (int32_t i = tangents; i < (tangents ? s->held[k] : s->held[k] > 0); i++) {
                const double *P = s->P[from + i], square = dot(P, P, n);
                const double scale = square > 0.0 ? 1.0 / sqrt(square) : 0.0;

                memset(rows[count], 0, sizeof *rows);
                add(rows[count], scale, P, n);
                targets[count++] = -scale * (s->q[from + i] + dot(P, loose, n));
            }
        }
    return count;
}

/* move := the least that takes the rows to their targets; modified Gram-Schmidt, each row twice. */
PERP__KERNEL static void solve(single *s, double (*rows)[WIDTH], double *targets, int32_t count,
                               double *move, int32_t n)
{
    double squares[ROWS];

    for (int32_t i = 0; i < count; i++)
        squares[i] = dot(rows[i], rows[i], n);
    for (s->rank = 0; s->rank < n; s->rank++) {
        double largest = 0.0, *b = s->basis[s->rank], length;
        int32_t pick = 0;

        for (int32_t i = 0; i < count; i++)
            largest = squares[i] > largest ? squares[i] : largest;
        if (!(largest > RANK_TOLERANCE * RANK_TOLERANCE))
            return;
        while (!(squares[pick] >= PIVOT_THRESHOLD * PIVOT_THRESHOLD * largest))
            pick++;
        memcpy(b, rows[pick], sizeof *rows);
        for (int32_t k = 0; k < s->rank; k++) {
            const double share = dot(s->basis[k], b, n);

            add(b, -share, s->basis[k], n);
            targets[pick] -= share * dot(s->basis[k], move, n);
        }
        length = sqrt(dot(b, b, n));
        for (int32_t j = 0; j < n; j++)
            b[j] /= length;
        squares[pick] = -1.0; /* taken */
        add(move, targets[pick] / length, b, n);
        for (int32_t i = 0; i < count; i++) {
            const double share = dot(b, rows[i], n);

            if (squares[i] < 0.0)
                continue;
            add(rows[i], -share, b, n);
            targets[i] -= share * (targets[pick] / length);
            squares[i] = dot(rows[i], rows[i], n);
        }
    }
}

/* Whether the rows that hold determine a coordinate of the body; as in clusters.c. */
PERP__KERNEL static int32_t is_at_rest(const single *s, const double *row, int32_t n)
{
    const double square = dot(row, row, n);
    double x[WIDTH], share = 0.0;

    for (int32_t k = 0; k < s->rank; k++) {
        const double along = dot(s->basis[k], row, n);

        share += along * along;
    }
    if (!(share > 0.5 * square))
        return 0;
    memcpy(x, row, sizeof x);
    for (int32_t k = 0; k < 2 * s->rank; k++) {
        const double *b = s->basis[k % s->rank], along = dot(b, x, n);

        add(x, -along, b, n);
    }
    return dot(x, x, n) <= SPAN * SPAN * square;
}

/* v, and the change beside the solution's velocities as a share of their terms; INFINITY where
 * something that moves would have to hold. */
PERP__KERNEL static double hold(single *s, int32_t n)
{
    const perp__rigid_problem *p = s->problem;
    double rows[ROWS][WIDTH], targets[ROWS], loose[WIDTH] = {0.0}, move[WIDTH] = {0.0};
    double change = 0.0, strength = 0.0;

    for (int32_t k = 0; k < p->contacts; k++) {
        s->held[k] = count_held(s, k);
        for (int32_t i = s->starts[k]; i < s->starts[k + 1]; i++) {
            const int32_t holds = i < s->starts[k] + s->held[k];

            if (holds && p->rows[k].bias[i - s->starts[k]] != 0.0)
                return INFINITY;
            strength += fabs(s->r[i]) * sqrt(dot(s->P[i], s->P[i], n));
            if (!holds)
                add(loose, s->r[i], s->P[i], n);
        }
    }
    solve(s, rows, targets, gather(s, loose, rows, targets, n), move, n);
    for (int32_t j = 0; j < n; j++) {
        move[j] += loose[j];
        change += (move[j] - s->y[j]) * (move[j] - s->y[j]);
    }
    for (int32_t i = 0; i < n; i++) {
        s->v[i] = s->rank == n ? 0.0 : p->free[i] + dot(s->C[i], move, n);
        if (s->v[i] == 0.0 || is_at_rest(s, s->C[i], n))
            s->v[i] = 0.0; /* never -0.0 */
    }
    return change > 0.0 ? sqrt(change) / strength : 0.0;
}

static void write(const single *s, perp__rigid_answer *answer)
{
    const perp__rigid_problem *p = s->problem;

    memcpy(answer->v, s->v, (size_t)p->width * sizeof *answer->v);
    for (int32_t k = 0; k < p->contacts; k++) {
        const double(*J)[6] = rows_of(&p->rows[k]);

        for (int32_t i = 0; i < 3; i++) {
            const int32_t row = s->starts[k] + i, is_row = i < s->dims[k];
            double u = is_row && i >= s->held[k] ? p->rows[k].bias[i] : 0.0;

            for (int32_t j = 0; is_row && i >= s->held[k] && j < p->width; j++)
                u += J[i][j] * s->v[j];
            answer->impulse[3 * k + i] = is_row ? s->r[row] : 0.0;
            answer->velocity[3 * k + i] = u;
        }
        answer->modes[k] = s->modes[k];
    }
    answer->carrier[0] = s->rank == p->width ? PERP__RIGID_AT_REST : PERP__RIGID_FREE;
}

PERP__KERNEL static int32_t solve_width(single *s, perp__rigid_answer *answer, double tol,
                                        int32_t n)
{
    perp__evidence worth = {0.0, 0.0, 1.0, 1};

    load_all(s, n);
    if (!judge(s, &worth, n) || !perp__is_good(perp__gate(&worth, tol, -1)))
        return 0;
    answer->tested = worth.tested;
    perp__raise_to(&worth.own, hold(s, n));
    worth.sound = perp__all_finite(s->v, WIDTH) && perp__all_finite(s->u, (size_t)s->rows);
    answer->outcome = perp__gate(&worth, s->problem->tol, -1);
    answer->own = worth.own;
    answer->backward = worth.backward;
    return perp__is_good(answer->outcome);
}

PERP__KERNEL static void solve_single_loops(single *s, perp__rigid_answer *answer, double tol,
                                            int32_t *is_answer)
{
    *is_answer =
        s->problem->width == 6 ? solve_width(s, answer, tol, 6) : solve_width(s, answer, tol, 3);
}

PERP__MULTIVERSION(solve_single,
                   (single * s, perp__rigid_answer *answer, double tol, int32_t *is_answer),
                   (s, answer, tol, is_answer))

int32_t perp__rigid_single(perp__rigid_answer *answer, const perp__rigid_problem *problem,
                           double tol)
{
    int32_t is_answer = 0;
    single s;

    s.problem = problem;
    if (is_single(problem))
        solve_single(&s, answer, tol, &is_answer);
    if (!is_answer)
        return 0;
    write(&s, answer);
    answer->held = 1;
    answer->iterations = 0;
    return 1;
}
