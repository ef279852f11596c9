/* Passes over the constraints of a part: speeds, the law of each, its slope, pushes. */
#include <math.h>
#include <string.h>

#include "contact/dynamics/dynamics.h"
#include "contact/law.h"
#include "contact/proximal/proximal.h"
#include "linalg/blas.h"
#include "linalg/lanes/lanes.h"
#include "linalg/lanes/multiversion.h"

/* u := J v + q of constraint k */
PERP__KERNEL static void move_one(int32_t width, int32_t d, const perp__proximal *s, int32_t k,
                                  const double *v, const double *q, double *u)
{
    const double *P = s->values + s->value_starts[k];

    for (int32_t i = 0; i < d; i++)
        u[i] = q ? q[i] : 0.0;
    for (int64_t p = s->piece_starts[k]; p < s->piece_starts[k + 1]; p++, P += d * width) {
        const double *x = v + (int64_t)s->piece_blocks[p] * width;

        for (int32_t i = 0; i < d; i++)
            u[i] += width % PERP__WHOLE_STEP == 0 && s->whole
                        ? perp__lanes_dot(P + i * width, x, width)
                        : perp__dot(P + i * width, x, width);
    }
}

/* out += J'x of constraint k */
PERP__KERNEL static void push_one(int32_t width, int32_t d, const perp__proximal *s, int32_t k,
                                  const double *x, double *out)
{
    const double *P = s->values + s->value_starts[k];

    for (int32_t i = 0; s->by_rows && i < d; i++)
        out[s->home[k] + i] += x[i];
    for (int64_t p = s->piece_starts[k]; !s->by_rows && p < s->piece_starts[k + 1];
         p++, P += d * width) {
        double *y = out + (int64_t)s->piece_blocks[p] * width;

        for (int32_t i = 0; i < d; i++)
            for (int32_t j = 0; j < width; j++)
                y[j] += P[i * width + j] * x[i];
    }
}

/* The discs of a constraint; NULL where it is an ordinary one. */
static inline const perp__discs *discs_of(const perp__proximal *s, int32_t k)
{
    return s->discs && s->discs[k].count > 0 ? &s->discs[k] : NULL;
}

/* What discs grow with: z_n, or |z_N|. */
static inline double pressure(const perp__discs *discs, const double *z)
{
    return discs && discs->both > 0 ? perp__contact_length(z, 0, discs->both) : z[0];
}

/* The same of a constraint with discs. */
static void project_discs(const perp__discs *discs, const double *z, double *x)
{
    const double pressed = fmax(pressure(discs, z), 0.0);

    for (int32_t i = 0; i < perp__discs_first(discs); i++)
        x[i] = discs->both > 0 ? z[i] : pressed;
    for (int32_t p = 0, at = perp__discs_first(discs); p < discs->count; at += discs->sizes[p++]) {
        const double reach = discs->radii[p] * pressed;
        const double length = perp__length(z + at, discs->sizes[p]);
        const double share = length <= reach ? 1.0 : length > 0.0 ? reach / length : 0.0;

        for (int32_t i = at; i < at + discs->sizes[p]; i++)
            x[i] = share * z[i];
    }
}

/* x := P(z). */
PERP__KERNEL static void project_one(int32_t d, double radius, const perp__discs *discs,
                                     const double *z, double *x)
{
    double reach, length;

    if (discs) {
        project_discs(discs, z, x);
        return;
    }
    if (radius < 0.0) {
        x[0] = z[0] > -radius ? -radius : z[0] < radius ? radius : z[0];
        return;
    }
    x[0] = z[0] > 0.0 ? z[0] : 0.0;
    if (d == 1)
        return;
    reach = radius * x[0];
    length = d == 2 ? fabs(z[1]) : sqrt(z[1] * z[1] + z[2] * z[2]);
    reach = length <= reach ? 1.0 : length > 0.0 ? reach / length : 0.0;
    for (int32_t i = 1; i < d; i++)
        x[i] = reach * z[i];
}

#define WITH_KIND(kernel, s, k, ...) \
    PERP__WITH_SHAPE(kernel, (s)->width, (s)->starts[(k) + 1] - (s)->starts[k], __VA_ARGS__)

static void clear(const perp__proximal *s, const perp__proximal_part *part, double *out)
{
    const size_t width = (size_t)s->width;

    memset(out + (size_t)part->block * width, 0,
           (size_t)(part->last_block - part->block) * width * sizeof *out);
}

PERP__KERNEL static void visit_one(int32_t width, int32_t d, const perp__proximal *s, int32_t k,
                                   double rho, const double *v)
{
    const int32_t at = s->starts[k];
    const double *x = s->x;
    double *z = s->z, *y = s->y, u[PERP__ROWS_MOST], change[PERP__ROWS_MOST];

    move_one(width, d, s, k, v, s->speed + at, u);
    for (int32_t i = 0; i < d; i++)
        z[at + i] = x[at + i] - rho * u[i];
    project_one(d, s->radius[k], discs_of(s, k), z + at, y + at);
    for (int32_t i = 0; i < d; i++)
        change[i] = y[at + i] - x[at + i];
    push_one(width, d, s, k, change, s->rhs);
}

PERP__MULTIVERSION_SHARED(perp__proximal_visit,
                          (const perp__proximal *s, const perp__proximal_part *part, double rho,
                           const double *v),
                          (s, part, rho, v))
{
    clear(s, part, s->rhs);
    for (int32_t k = part->constraint; k < part->last_constraint; k++)
        WITH_KIND(visit_one, s, k, s, k, rho, v);
}

/* Relaxation of the speeds (Eckstein & Bertsekas, Math. Programming 55 (1992) 293). */
#define RELAXATION 1.6

PERP__KERNEL static void split_one(int32_t width, int32_t d, const perp__proximal *s, int32_t k,
                                   double rho, int32_t first)
{
    const int32_t at = s->starts[k];
    double *z = s->z, *y = s->y, *r = s->x, u[PERP__ROWS_MOST], push[PERP__ROWS_MOST];
    double negative[PERP__ROWS_MOST] = {0.0};

    move_one(width, d, s, k, s->v, s->q + at, u);
    for (int32_t i = 0; i < d; i++) {
        if (!first)
            u[i] = RELAXATION * u[i] + (1.0 - RELAXATION) * y[at + i];
        z[at + i] = rho * u[i] - r[at + i];
        negative[i] = -z[at + i];
    }
    project_one(d, s->radius[k], discs_of(s, k), negative, r + at);
    for (int32_t i = 0; i < d; i++) {
        y[at + i] = (z[at + i] + r[at + i]) / rho;
        push[i] = r[at + i] - rho * (s->q[at + i] - y[at + i]);
    }
    push_one(width, d, s, k, push, s->rhs);
}

PERP__MULTIVERSION_SHARED(perp__proximal_split,
                          (const perp__proximal *s, const perp__proximal_part *part, double rho,
                           int32_t first),
                          (s, part, rho, first))
{
    clear(s, part, s->rhs);
    for (int32_t k = part->constraint; k < part->last_constraint; k++)
        WITH_KIND(split_one, s, k, s, k, rho, first);
}

PERP__MULTIVERSION_SHARED(perp__proximal_push,
                          (const perp__proximal *s, const perp__proximal_part *part,
                           const double *x, double *out),
                          (s, part, x, out))
{
    clear(s, part, out);
    for (int32_t k = part->constraint; k < part->last_constraint; k++)
        WITH_KIND(push_one, s, k, s, k, x + s->starts[k], out);
}

PERP__MULTIVERSION_SHARED(perp__proximal_move,
                          (const perp__proximal *s, const perp__proximal_part *part,
                           const double *v, const double *q, double *u),
                          (s, part, v, q, u))
{
    for (int32_t k = part->constraint; k < part->last_constraint; k++)
        WITH_KIND(move_one, s, k, s, k, v, q ? q + s->starts[k] : NULL, u + s->starts[k]);
}

PERP__KERNEL static void apply_one(int32_t width, int32_t d, const perp__proximal *s, int32_t k,
                                   const double *v, double *out)
{
    const double *K = perp__proximal_slope(s, k);
    double u[PERP__ROWS_MOST], push[PERP__ROWS_MOST];

    move_one(width, d, s, k, v, NULL, u);
    for (int32_t i = 0; i < d; i++) {
        push[i] = 0.0;
        for (int32_t j = 0; j < d; j++)
            push[i] += K[s->side * j + i] * u[j];
    }
    push_one(width, d, s, k, push, out);
}

PERP__MULTIVERSION_SHARED(perp__proximal_apply,
                          (const perp__proximal *s, const perp__proximal_part *part,
                           const double *v, double *out),
                          (s, part, v, out))
{
    const size_t begin = (size_t)part->block * (size_t)s->width;
    const size_t end = (size_t)part->last_block * (size_t)s->width;

    memcpy(out + begin, v + begin, (end - begin) * sizeof *out);
    for (int32_t k = part->constraint; k < part->last_constraint; k++)
        WITH_KIND(apply_one, s, k, s, k, v, out);
}

void perp__proximal_project(const perp__proximal *s, const perp__proximal_part *part, double *x)
{
    for (int32_t k = part->constraint; k < part->last_constraint; k++) {
        const int32_t at = s->starts[k];
        double z[PERP__ROWS_MOST] = {0.0};

        for (int32_t i = at; i < s->starts[k + 1]; i++)
            z[i - at] = x[i];
        project_one(s->starts[k + 1] - at, s->radius[k], discs_of(s, k), z, x + at);
    }
}

/* K := rho P'(z), by columns. */
void perp__proximal_slopes(perp__proximal *s, const perp__proximal_part *part, double rho)
{
    for (int32_t k = part->constraint; k < part->last_constraint; k++) {
        const int32_t d = s->starts[k + 1] - s->starts[k], side = s->side;
        const perp__discs *discs = discs_of(s, k);
        const int32_t both = discs ? discs->both : 0, first = discs ? perp__discs_first(discs) : 1;
        const int32_t count = discs ? discs->count : d > 1;
        const double *z = s->z + s->starts[k], pressed = pressure(discs, z);
        double *K = perp__proximal_slope(s, k);
        int32_t at = first, size;

        memset(K, 0, (size_t)(side * side) * sizeof *K);
        if (s->radius[k] < 0.0 ? !(fabs(z[0]) < -s->radius[k]) : both == 0 && !(z[0] > 0.0))
            continue;
        for (int32_t i = 0; i < first; i++)
            K[side * i + i] = rho;
        for (int32_t p = 0; p < count; p++, at += size) {
            const double radius = discs ? discs->radii[p] : s->radius[k];
            const double reach = radius * pressed, *x = z + at;
            double length;

            size = discs ? discs->sizes[p] : d - 1;
            length = size == 1 ? fabs(x[0]) : sqrt(x[0] * x[0] + x[1] * x[1]);
            for (int32_t i = 0; i < size && length <= reach; i++)
                K[side * (at + i) + at + i] = rho;
            for (int32_t i = 0; i < size && !(length <= reach); i++) {
                K[at + i] = rho * radius * (x[i] / length);
                for (int32_t j = both; j-- > 0;)
                    K[side * j + at + i] =
                        pressed > 0.0 ? rho * radius * (x[i] / length) * (z[j] / pressed) : 0.0;
                for (int32_t j = 0; j < size && size > 1; j++) /* else no length is left to turn */
                    K[side * (at + j) + at + i] =
                        rho * reach / length * ((i == j) - x[i] / length * (x[j] / length));
            }
        }
    }
}

/* K's row times a column of a piece. */
static inline double row_of(const perp__proximal *s, int32_t d, int32_t width, const double *K,
                            const double *Q)
{
    double sum = 0.0;

    for (int32_t j = 0; j < d; j++)
        sum += K[s->side * j] * Q[j * width];
    return sum;
}

/* The same of a block W_kq alone, K W_kq in its rows of a block. */
PERP__KERNEL static void add_rows(int32_t width, int32_t d, const perp__proximal *s, int32_t k,
                                  const double *W, double *to)
{
    const double *K = perp__proximal_slope(s, k);

    to += s->home[k] % width;
    for (int32_t i = 0; i < d; i++)
        for (int32_t c = 0; c < width; c++)
            to[c * width + i] += row_of(s, d, width, K + i, W + c);
}

/* Adds J'KJ of constraint k to the blocks of the matrix. */
PERP__KERNEL static void add_one(int32_t width, int32_t d, perp__proximal *s, int32_t k)
{
    const int32_t pieces = (int32_t)(s->piece_starts[k + 1] - s->piece_starts[k]);
    const double *K = perp__proximal_slope(s, k), *values = s->values + s->value_starts[k];
    const int32_t *slot = s->slots + s->slot_starts[k];
    double image[PERP__ROWS_MOST * PERP__HALF_MOST];

    for (int32_t q = 0; q < pieces; q++) {
        const double *Q = values + q * d * width;

        if (s->by_rows) {
            add_rows(width, d, s, k, Q,
                     s->fronts.values + (size_t)slot[q] * (size_t)(width * width));
            continue;
        }
        for (int32_t i = 0; i < d; i++)
            for (int32_t c = 0; c < width; c++)
                image[i * width + c] = row_of(s, d, width, K + i, Q + c);
        for (int32_t p = 0; p < pieces; p++) {
            const double *P = values + p * d * width;
            double *to = s->fronts.values + (size_t)*slot++ * (size_t)(width * width);

            for (int32_t c = 0; c < width; c++)
                for (int32_t i = 0; i < d; i++)
                    for (int32_t e = 0; e < width; e++)
                        to[c * width + e] += P[i * width + e] * image[i * width + c];
        }
    }
}

/* The same of a part that is one block: all rows that slope at once. */
static void add_whole(perp__proximal *s, const perp__proximal_part *part)
{
    const int32_t width = s->width, most = part->last_row - part->row;
    const int32_t slot = s->slots[s->slot_starts[part->constraint]];
    int32_t rows = 0;

    for (int32_t k = part->constraint; k < part->last_constraint; k++) {
        const int32_t d = s->starts[k + 1] - s->starts[k];
        const double *K = perp__proximal_slope(s, k), *J = s->values + s->value_starts[k];

        if (*K == 0.0)
            continue;
        memcpy(s->sloping + rows * width, J, (size_t)(d * width) * sizeof *J);
        for (int32_t c = 0; c < width; c++)
            for (int32_t i = 0; i < d; i++)
                s->images[c * most + rows + i] = -row_of(s, d, width, K + i, J + c);
        rows += d;
    }
    perp__gemm_subtract(width, width, rows, s->sloping, width, s->images, most,
                        s->fronts.values + (size_t)slot * (size_t)(width * width), width);
}

PERP__MULTIVERSION(add, (perp__proximal * s, const perp__proximal_part *part), (s, part))
{
    for (int32_t k = part->constraint; k < part->last_constraint; k++)
        if (*perp__proximal_slope(s, k) != 0.0)
            WITH_KIND(add_one, s, k, s, k);
}

int32_t perp__proximal_factor(perp__proximal *s, const perp__proximal_part *part)
{
    const size_t width = (size_t)s->width, square = width * width;
    const size_t begin = (size_t)s->graph_starts[part->block];
    const size_t end = (size_t)s->graph_starts[part->last_block];
    const perp__contact_control *control = s->common.problem->control;

    s->fronts.deadline = control ? control->deadline : 0.0;
    memset(s->fronts.values + begin * square, 0, (end - begin) * square * sizeof(double));
    for (int32_t b = part->block; b < part->last_block; b++) {
        double *diagonal = s->fronts.values + (size_t)perp__fronts_edge(&s->fronts, b, b) * square;

        for (size_t i = 0; i < width; i++)
            diagonal[i * (width + 1)] = 1.0;
    }
    (s->whole && !s->by_rows ? add_whole : add)(s, part);
    return perp__fronts_factor(&s->fronts, part->block, part->last_block);
}

double perp__proximal_residual(perp__proximal *s, const perp__proximal_part *part, double *x,
                               double *speed)
{
    const perp__contact_problem *problem = s->common.problem;
    double most = 0.0;

    perp__proximal_project(s, part, x);
    perp__proximal_push(s, part, x, s->rest);
    perp__proximal_move(s, part, s->rest, s->q, speed);
    for (int32_t k = part->constraint; k < part->last_constraint; k++) {
        /* the tested residual of the law, in the problem's terms but for omega; of a row of any
         * sign here */
        const int32_t begin = s->starts[k], d = s->starts[k + 1] - begin;
        const int32_t constraint = s->constraint[k];
        const double *scale = s->scale + begin, radius = s->radius[k];
        const double aim = x[begin] - speed[begin];
        double one =
            fabs(aim) > -radius ? fabs(x[begin] - copysign(radius, aim)) : fabs(speed[begin]);
        int32_t mode;

        if (!(radius < 0.0)) {
            const int32_t row = problem->starts[constraint];

            for (int32_t i = 0; row + i < problem->starts[constraint + 1]; i++) {
                s->r[row + i] = i < d ? x[begin + i] * scale[i] : 0.0;
                s->u[row + i] = i < d ? speed[begin + i] / scale[i] : 0.0;
            }
            one = perp__contact_natural(problem, constraint, s->r, s->u, &mode) *
                  sqrt(problem->trace[constraint]);
        }
        most = one <= most ? most : one; /* keeps a NaN */
    }
    if (most < s->best_residual) {
        s->best_residual = most;
        memcpy(s->best + part->row, x + part->row,
               (size_t)(part->last_row - part->row) * sizeof *x);
    }
    return most;
}
