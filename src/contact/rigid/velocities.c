/* Velocities of rigid bodies and of their contacts,
 *
 *   v = v_free + C C' J'r,     u = J v + bias,
 *
 * in plain doubles by way of P = J C, or in doubled precision from the caller's rows and factors
 * (products and their sums with the errors beside them: Ogita, Rump & Oishi, SIAM J. Sci. Comput.
 * 26 (2005) 1955). */
#include "contact/rigid/rigid.h"

#include <math.h>
#include <string.h>

#include "linalg/doubled.h"
#include "linalg/lanes/lanes.h"
#include "linalg/lanes/multiversion.h"

/* The velocity of what a constraint's side is on: NULL where that is the world at rest. v: of the
 * bodies; carriers have their own. */
PERP__KERNEL static const double *velocity_of(const perp__rigid_problem *p, int32_t body,
                                              const double *v)
{
    if (body < 0)
        return NULL;
    return (body < p->bodies ? v : p->free) + (size_t)body * (size_t)p->width;
}

/* u of row i of g, rounded once; v_low: what v lacks. */
PERP__KERNEL static double relative(int32_t width, const perp__rigid_problem *p,
                                    const perp__rigid_rows *g, int32_t i, const double *v,
                                    const double *v_low)
{
    double u = g->bias[i], error = 0.0;

    for (int32_t side = 0; side < 2; side++) {
        const double *x = velocity_of(p, g->body[side], v), *J = g->rows[side][i];
        const double *low = v_low + (int64_t)g->body[side] * width;

        if (!x)
            continue;
        for (int32_t j = 0; j < width; j++)
            perp__accumulate(&u, &error, J[j], x[j]);
        for (int32_t j = 0; g->body[side] < p->bodies && j < width; j++)
            error += J[j] * low[j];
    }
    return u + error;
}

PERP__MULTIVERSION(relative_doubled,
                   (const perp__rigid_problem *p, const double *v, const double *v_low, double *u),
                   (p, v, v_low, u))
{
    for (int32_t k = 0; k < p->contacts + p->joints; k++)
        for (int32_t i = 0; i < p->rows[k].dim; i++)
            *u++ = p->width == 6 ? relative(6, p, &p->rows[k], i, v, v_low)
                                 : relative(p->width, p, &p->rows[k], i, v, v_low);
}

/* q of the constraints of one contact or joint, in plain doubles, and the sizes of its terms */
PERP__KERNEL static void load_rows(int32_t width, int32_t dim, const perp__rigid_problem *p,
                                   const perp__rigid_rows *g, double *q, double *sizes)
{
    double sum[3] = {g->bias[0], g->bias[1], g->bias[2]};
    double size[3] = {fabs(sum[0]), fabs(sum[1]), fabs(sum[2])};

    for (int32_t side = 0; side < 2; side++) {
        const double *v = p->free + (int64_t)g->body[side] * width;

        for (int32_t i = 0; g->body[side] >= 0 && i < dim; i++)
            for (int32_t j = 0; j < width; j++) {
                const double term = g->rows[side][i][j] * v[j];

                sum[i] += term;
                size[i] += fabs(term);
            }
    }
    for (int32_t i = 0; i < dim; i++) {
        q[i] = sum[i];
        sizes[i] = size[i];
    }
}

#define SUM(four, two) ((((four)[0] + (four)[2]) + ((four)[1] + (four)[3])) + ((two)[0] + (two)[1]))

/* The same for three rows of six, in vectors: the first four columns and the last two. */
PERP__KERNEL static void load_6(const perp__rigid_problem *p, const perp__rigid_rows *g, double *q,
                                double *sizes)
{
    static const double rest[18]; /* rows of what is at rest are not read */
    const double *x = g->body[0] >= 0 ? p->free + 6 * (int64_t)g->body[0] : rest;
    const double *y = g->body[1] >= 0 ? p->free + 6 * (int64_t)g->body[1] : rest;
    const double *a = g->body[0] >= 0 ? g->rows[0][0] : rest;
    const double *b = g->body[1] >= 0 ? g->rows[1][0] : rest;

    for (int32_t i = 0; i < 3; i++, a += 6, b += 6) {
        const perp__lanes one = PERP__CONST_LANES_AT(a) * PERP__CONST_LANES_AT(x);
        const perp__lanes other = PERP__CONST_LANES_AT(b) * PERP__CONST_LANES_AT(y);
        const perp__lane_pair end = PERP__CONST_PAIR_AT(a + 4) * PERP__CONST_PAIR_AT(x + 4);
        const perp__lane_pair other_end = PERP__CONST_PAIR_AT(b + 4) * PERP__CONST_PAIR_AT(y + 4);
        const perp__lanes sum = one + other;
        const perp__lanes size = PERP__ABSOLUTE_LANES(one) + PERP__ABSOLUTE_LANES(other);
        const perp__lane_pair end_sum = end + other_end;
        const perp__lane_pair end_size = PERP__ABSOLUTE_PAIR(end) + PERP__ABSOLUTE_PAIR(other_end);

        q[i] = g->bias[i] + SUM(sum, end_sum);
        sizes[i] = fabs(g->bias[i]) + SUM(size, end_size);
    }
}

PERP__MULTIVERSION(load, (const perp__rigid_problem *p, double *q, double *sizes), (p, q, sizes))
{
    for (int32_t k = 0; k < p->contacts + p->joints; k++) {
        const perp__rigid_rows *g = &p->rows[k];

        if (p->width == 6 && g->dim == 3)
            load_6(p, g, q, sizes);
        else if (p->width == 3 && g->dim == 2)
            load_rows(3, 2, p, g, q, sizes);
        else
            load_rows(p->width, g->dim, p, g, q, sizes);
        q += g->dim;
        sizes += g->dim;
    }
}

void perp__rigid_load(perp_contact_solver *solver)
{
    const perp__rigid_problem *p = solver->rigid;

    perp__copy(solver->v, p->free, solver->n);
    load(p, solver->q, solver->load);
    if (solver->is_lean)
        return;
    if (solver->n > 0)
        memset(solver->v_low, 0, (size_t)solver->n * sizeof *solver->v_low);
    relative_doubled(p, solver->v, solver->v_low, solver->q);
}

void perp__rigid_bias(const perp_contact_solver *solver, double *u)
{
    const perp__rigid_problem *p = solver->rigid;

    for (int32_t k = 0; k < p->contacts + p->joints; k++)
        for (int32_t i = 0; i < p->rows[k].dim; i++) {
            const perp__rigid_rows *g = &p->rows[k];
            double sum = g->bias[i];

            for (int32_t side = 0; side < 2; side++)
                for (int32_t j = 0; g->body[side] >= p->bodies && j < p->width; j++)
                    sum += g->rows[side][i][j] *
                           p->free[(size_t)g->body[side] * (size_t)p->width + (size_t)j];
            *u++ = sum;
        }
}

static double plain_row(const perp__rigid_problem *p, const perp__rigid_rows *g, int32_t i,
                        const double *v)
{
    double u = g->bias[i];

    for (int32_t side = 0; side < 2; side++) {
        const double *x = velocity_of(p, g->body[side], v);

        for (int32_t j = 0; x && j < p->width; j++)
            u += g->rows[side][i][j] * x[j];
    }
    return u;
}

/* A carrier that does not move is as good as none. */
static int32_t root_of(const perp__rigid_problem *p, int32_t body)
{
    if (body < p->bodies) /* -1, or one that is of no account here */
        return PERP__RIGID_AT_REST;
    for (int32_t j = 0; j < p->width; j++)
        if (p->free[(size_t)body * (size_t)p->width + (size_t)j] != 0.0)
            return body;
    return PERP__RIGID_AT_REST;
}

/* Where a body is that moves as one with others: PERP__RIGID_FREE if it is with none. */
static int32_t place_of(const perp_contact_solver *solver, int32_t body)
{
    return body >= 0 && body < solver->rigid->bodies ? solver->hold.root[body]
                                                     : root_of(solver->rigid, body);
}

void perp__rigid_held_velocities(const perp_contact_solver *solver, const double *v, double *u)
{
    const perp__rigid_problem *p = solver->rigid;
    int32_t constraint = 0, row = 0;

    for (int32_t k = 0; k < p->contacts + p->joints; k++) {
        const perp__rigid_rows *g = &p->rows[k];
        const int32_t a = place_of(solver, g->body[0]);
        const int32_t is_one = a != PERP__RIGID_FREE && a == place_of(solver, g->body[1]);

        for (int32_t i = 0; i < g->dim; i++, row++) {
            const int32_t holds = k < p->contacts ? i < solver->hold.holds[constraint] : 1;

            u[row] = holds ? 0.0 : is_one ? g->bias[i] : plain_row(p, g, i, v);
        }
        constraint += k < p->contacts ? 1 : g->dim;
    }
}

void perp__rigid_beside(const perp_contact_solver *solver, const int8_t *holds, int32_t *beside,
                        int8_t *pushed)
{
    const perp__rigid_problem *p = solver->rigid;
    int32_t constraint = 0;

    for (int32_t k = 0; k < p->contacts + p->joints; k++) {
        const perp__rigid_rows *g = &p->rows[k];
        const int32_t a = root_of(p, g->body[0]), b = root_of(p, g->body[1]);

        for (int32_t i = 0; i < (k < p->contacts ? 1 : g->dim); i++, constraint++) {
            const int32_t first = k < p->contacts ? 0 : i;

            beside[constraint] = a != PERP__RIGID_AT_REST ? a : b;
            pushed[constraint] = 0;
            for (int32_t j = first; j < first + holds[constraint]; j++)
                pushed[constraint] |= g->bias[j] != 0.0 && g->compliance[j] == 0.0;
        }
    }
}

/* out := C x or, transposed, C'x of every body; x + x_low and out + out_low. */
PERP__MULTIVERSION(apply,
                   (const perp__rigid_problem *p, int32_t transposed, const double *x,
                    const double *x_low, double *out, double *out_low),
                   (p, transposed, x, x_low, out, out_low))
{
    const int32_t width = p->width;
    const int32_t row = transposed ? 1 : width, column = transposed ? width : 1;
    const double *C = p->factors;

    for (int32_t b = 0; b < p->bodies; b++, C += width * width)
        for (int32_t i = 0; i < width; i++) {
            const size_t at = (size_t)b * (size_t)width;
            double sum = 0.0, error = 0.0;

            for (int32_t j = 0; j < width; j++) {
                perp__accumulate(&sum, &error, C[i * row + j * column], x[at + (size_t)j]);
                error += C[i * row + j * column] * x_low[at + (size_t)j];
            }
            perp__round_sum(&sum, &error);
            out[at + (size_t)i] = sum;
            out_low[at + (size_t)i] = error;
        }
}

/* sum + error += J_i r for the bodies of a contact or joint */
PERP__KERNEL static void push_rows(int32_t width, const perp__rigid_problem *p,
                                   const perp__rigid_rows *g, const double *r, double *sum,
                                   double *error)
{
    for (int32_t side = 0; side < 2; side++) {
        const int64_t at = (int64_t)g->body[side] * width;

        if (g->body[side] < 0 || g->body[side] >= p->bodies)
            continue;
        for (int32_t i = 0; i < g->dim; i++)
            for (int32_t j = 0; j < width; j++)
                perp__accumulate(sum + at + j, error + at + j, g->rows[side][i][j], r[i]);
    }
}

PERP__MULTIVERSION(push,
                   (const perp__rigid_problem *p, const double *r, double *sum, double *error),
                   (p, r, sum, error))
{
    for (int32_t k = 0; k < p->contacts + p->joints; k++) {
        if (p->width == 6)
            push_rows(6, p, &p->rows[k], r, sum, error);
        else
            push_rows(p->width, p, &p->rows[k], r, sum, error);
        r += p->rows[k].dim;
    }
}

static void doubled_velocities(perp_contact_solver *solver)
{
    const perp__rigid_problem *p = solver->rigid;
    const size_t bytes = (size_t)solver->n * sizeof(double);

    if (bytes > 0) {
        memset(solver->push, 0, bytes);
        memset(solver->push_low, 0, bytes);
    }
    push(p, solver->r, solver->push, solver->push_low);
    apply(p, 1, solver->push, solver->push_low, solver->v, solver->v_low);
    apply(p, 0, solver->v, solver->v_low, solver->push, solver->push_low);
    for (int32_t i = 0; i < solver->n; i++) {
        solver->v[i] = p->free[i];
        solver->v_low[i] = solver->push_low[i];
        perp__accumulate(solver->v + i, solver->v_low + i, 1.0, solver->push[i]);
        perp__round_sum(solver->v + i, solver->v_low + i);
    }
    relative_doubled(p, solver->v, solver->v_low, solver->u);
}

/* v := v_free + C y */
static void add_factors(const perp_contact_solver *solver, const double *y)
{
    const int32_t width = solver->rigid->width;
    const double *C = solver->rigid->factors, *v_free = solver->rigid->free;
    double *v = solver->v;

    for (int32_t b = 0; b < solver->rigid->bodies; b++) {
        for (int32_t i = 0; i < width; i++) {
            double sum = 0.0;

            for (int32_t j = 0; j < width; j++)
                sum += C[i * width + j] * y[j];
            v[i] = v_free[i] + sum;
        }
        C += width * width;
        v_free += width;
        v += width;
        y += width;
    }
}

/* y += P'r and terms += |P|'|r| of one constraint */
PERP__KERNEL static void push_one(int32_t width, int32_t rows, const perp__bodies *b, int32_t k,
                                  const double *r, double *y, double *terms)
{
    for (int64_t piece = b->piece_starts[k]; piece < b->piece_starts[k + 1]; piece++) {
        const int64_t at = (int64_t)b->piece_blocks[piece] * width;
        const double *p = b->values + b->piece_values[piece];

        for (int32_t i = 0; i < rows; i++)
            for (int32_t j = 0; j < width; j++) {
                y[at + j] += p[i * width + j] * r[i];
                terms[at + j] += fabs(p[i * width + j] * r[i]);
            }
    }
}

/* Of all constraints: u := P y + q and scale := |P| terms + |q|. */
typedef struct motion {
    const double *y, *terms, *q;
    double *u, *scale;
} motion;

PERP__KERNEL static void move_one(int32_t width, int32_t rows, const perp__bodies *b, int32_t k,
                                  const motion *m)
{
    for (int32_t i = 0; i < rows; i++) {
        const int32_t row = b->rows[k] + i;
        double sum = m->q[row], size = fabs(sum);

        for (int64_t piece = b->piece_starts[k]; piece < b->piece_starts[k + 1]; piece++) {
            const int64_t at = (int64_t)b->piece_blocks[piece] * width;
            const double *p = b->values + b->piece_values[piece] + i * width;

            for (int32_t j = 0; j < width; j++) {
                sum += p[j] * m->y[at + j];
                size += fabs(p[j]) * m->terms[at + j];
            }
        }
        m->u[row] = sum;
        m->scale[row] = size;
    }
}

/* The same in vectors for three rows of six: the first four columns and the last two. */
PERP__KERNEL static void push_6(const perp__bodies *b, int32_t k, const double *r, double *y,
                                double *terms)
{
    for (int64_t piece = b->piece_starts[k]; piece < b->piece_starts[k + 1]; piece++) {
        const int64_t at = (int64_t)b->piece_blocks[piece] * 6;
        const double *p = b->values + b->piece_values[piece];
        perp__lanes sum = PERP__CONST_LANES_AT(y + at), size = PERP__CONST_LANES_AT(terms + at);
        perp__lane_pair end = PERP__CONST_PAIR_AT(y + at + 4),
                        end_size = PERP__CONST_PAIR_AT(terms + at + 4);

        for (int32_t i = 0; i < 3; i++, p += 6) {
            const perp__lanes part = PERP__CONST_LANES_AT(p) * PERP__SAME_LANES(r[i]);
            const perp__lane_pair end_part = PERP__CONST_PAIR_AT(p + 4) * PERP__SAME_PAIR(r[i]);

            sum += part;
            size += PERP__ABSOLUTE_LANES(part);
            end += end_part;
            end_size += PERP__ABSOLUTE_PAIR(end_part);
        }
        PERP__LANES_AT(y + at) = sum;
        PERP__LANES_AT(terms + at) = size;
        PERP__PAIR_AT(y + at + 4) = end;
        PERP__PAIR_AT(terms + at + 4) = end_size;
    }
}

PERP__KERNEL static void move_6(const perp__bodies *b, int32_t k, const double *y,
                                const double *terms, const double *q, double *u, double *scale)
{
    static const double nothing[18];
    const int64_t piece = b->piece_starts[k];
    const int32_t two = b->piece_starts[k + 1] - piece == 2;
    const int64_t first = 6 * (int64_t)b->piece_blocks[piece];
    const int64_t second = two ? 6 * (int64_t)b->piece_blocks[piece + 1] : first;
    const double *p = b->values + b->piece_values[piece];
    const double *o = two ? b->values + b->piece_values[piece + 1] : nothing;

    for (int32_t i = 0; i < 3; i++, p += 6, o += 6) {
        const perp__lanes row = PERP__CONST_LANES_AT(p), other = PERP__CONST_LANES_AT(o);
        const perp__lane_pair rest = PERP__CONST_PAIR_AT(p + 4),
                              other_rest = PERP__CONST_PAIR_AT(o + 4);
        const perp__lanes sum =
            row * PERP__CONST_LANES_AT(y + first) + other * PERP__CONST_LANES_AT(y + second);
        const perp__lanes size = PERP__ABSOLUTE_LANES(row) * PERP__CONST_LANES_AT(terms + first) +
                                 PERP__ABSOLUTE_LANES(other) * PERP__CONST_LANES_AT(terms + second);
        const perp__lane_pair end = rest * PERP__CONST_PAIR_AT(y + first + 4) +
                                    other_rest * PERP__CONST_PAIR_AT(y + second + 4);
        const perp__lane_pair end_size =
            PERP__ABSOLUTE_PAIR(rest) * PERP__CONST_PAIR_AT(terms + first + 4) +
            PERP__ABSOLUTE_PAIR(other_rest) * PERP__CONST_PAIR_AT(terms + second + 4);

        u[i] = q[i] + SUM(sum, end);
        scale[i] = fabs(q[i]) + SUM(size, end_size);
    }
}

PERP__MULTIVERSION(plain,
                   (const perp__bodies *b, const double *r, const double *q, double *y,
                    double *terms, double *u, double *scale),
                   (b, r, q, y, terms, u, scale))
{
    const motion all = {y, terms, q, u, scale};

    for (int32_t k = 0; k < b->constraints; k++) {
        const int32_t at = b->rows[k], rows = b->rows[k + 1] - at;

        if (b->width == 6 && rows == 3)
            push_6(b, k, r + at, y, terms);
        else if (b->width == 3 && rows == 2)
            push_one(3, 2, b, k, r + at, y, terms);
        else
            push_one(b->width, rows, b, k, r + at, y, terms);
    }
    for (int32_t k = 0; k < b->constraints; k++) {
        const int32_t at = b->rows[k], rows = b->rows[k + 1] - at;

        if (b->width == 6 && rows == 3)
            move_6(b, k, y, terms, q + at, u + at, scale + at);
        else if (b->width == 3 && rows == 2)
            move_one(3, 2, b, k, &all);
        else
            move_one(b->width, rows, b, k, &all);
    }
}

/* Also scale := |W| |r| + |q|, which the verdict asks for next. */
static void plain_velocities(perp_contact_solver *solver)
{
    const perp__bodies *b = &solver->bodies;
    const size_t bytes = (size_t)solver->n * sizeof(double);

    if (bytes > 0) {
        memset(b->y, 0, bytes);
        memset(solver->push, 0, bytes);
    }
    plain(b, solver->r, solver->q, b->y, solver->push, solver->u, solver->scale);
    add_factors(solver, b->y);
}

void perp__rigid_velocities(perp_contact_solver *solver)
{
    if (solver->is_lean)
        plain_velocities(solver);
    else
        doubled_velocities(solver);
    for (int32_t i = 0; solver->complies && i < solver->size; i++) {
        const double given = solver->compliance[i] * solver->r[i];

        solver->u[i] += given;
        solver->scale[i] += solver->is_lean ? fabs(given) : 0.0;
    }
}
