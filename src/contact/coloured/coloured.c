/* Passes over the whole step: Gauss-Seidel with Nesterov's momentum, restarted where it leads back
 * (O'Donoghue & Candes 2015), that ends on a plain one. A normal row wants u_n >= -max(gap, 0) / h:
 * what the exact methods solve, of which this is what a budget gives. */
#include "contact/coloured/coloured.h"

#include <math.h>
#include <string.h>

#include "base/context.h"
#include "linalg/lanes/multiversion.h"
#include "linalg/pivoting.h"

/* A pass over positions takes this share of the penetration away, and no point further than that
 * many guards in a step. */
#define SHARE 0.2
#define FARTHEST 64.0

/* Nesterov's weight at most. */
#define MOMENTUM 0.9

void perp__coloured_init(perp__coloured *c, perp_context *context)
{
    const perp__coloured_kernels *found[PERP__COLOURED_SETS];

    memset(c, 0, sizeof *c);
    perp__coloured_find_kernels(found);
    c->kernels = found[0];
    c->context = context;
}

void perp__coloured_release(perp__coloured *c)
{
    perp__arena_release(&c->arena);
    perp__arena_release(&c->point_arena);
}

/* y := C^-1 v of a body. */
static void weigh_velocity(const perp__coloured *c, const double *factors, int32_t body,
                           const double *v, double *y)
{
    const int32_t width = c->width;
    const double *C = factors + width * width * body;

    memset(y, 0, 8 * sizeof *y);
    memcpy(y, v, (size_t)width * sizeof *y);
    if (!c->splits[body]) {
        perp__solve_small(C, width, width, y, 1);
        return;
    }
    for (int32_t i = 0; i < 3; i++)
        y[i] /= C[7 * i];
    if (C[22] != 0.0 || C[23] != 0.0 || C[27] != 0.0 || C[29] != 0.0 || C[33] != 0.0 ||
        C[34] != 0.0) {
        perp__solve_small(C + 21, 3, 6, y + 3, 1);
        return;
    }
    for (int32_t i = 3; i < 6; i++) /* a ball, or what lies along its axes */
        y[i] /= C[7 * i];
}

/* b of the normal rows: what a contact may still close by. */
static void write_bias(perp__coloured *c, double h)
{
    for (int32_t p = 0; p < c->points; p++) {
        perp__lane_point *point = &c->point[p];

        for (int32_t l = 0; l < PERP__GROUP; l++)
            point->bias[l] = point->w[0][l] + (point->gap[l] > 0.0 ? point->gap[l] / h : 0.0);
    }
}

/* y goes on in the direction that it took, as r will when it is swept next; or both stay where that
 * led back. Then the next pass begins there. Returns theta. */
PERP__MULTIVERSION(gain_momentum, (perp__coloured * c, double *theta), (c, theta))
{
    const size_t size = 8 * ((size_t)c->bodies + 1);
    double next = 0.5 * (1.0 + sqrt(1.0 + 4.0 * *theta * *theta)), back[8] = {0.0}, beta;

    for (size_t i = 0; i < size; i += 8) /* before: where the pass began; moved: where the last */
        for (size_t l = 0; l < 8; l++)
            back[l] += (c->before[i + l] - c->y[i + l]) * (c->y[i + l] - c->moved[i + l]);
    if (((back[0] + back[4]) + (back[2] + back[6])) + ((back[1] + back[5]) + (back[3] + back[7])) >
        0.0)
        next = *theta = 1.0;
    beta = fmin((*theta - 1.0) / next, MOMENTUM);
    for (size_t i = 0; i < size; i++) {
        const double now = c->y[i];

        c->before[i] = c->y[i] = now + beta * (now - c->moved[i]);
        c->moved[i] = now;
    }
    c->momentum = beta;
    *theta = next;
}

static void run_passes(perp__coloured *c, const perp__rigid_problem *problem,
                       const perp__passes *step)
{
    const size_t size = 8 * ((size_t)c->bodies + 1);
    double theta = 1.0;

    for (int32_t i = 0; i < c->bodies; i++)
        weigh_velocity(c, problem->factors, i, problem->free + c->width * i, c->free + 8 * i);
    memset(c->free + 8 * c->bodies, 0, 8 * sizeof *c->free);
    memcpy(c->y, c->free, size * sizeof *c->y);
    if (!step->pushed)
        c->kernels->pass(c, PERP__COLOURED_ADD, c->y);
    memcpy(c->moved, c->y, size * sizeof *c->y);
    memcpy(c->before, c->y, size * sizeof *c->y);
    write_bias(c, step->h);
    c->momentum = 0.0;
    for (int32_t pass = 0; pass < step->passes; pass++) {
        c->kernels->pass(c, PERP__COLOURED_SWEEP, c->y);
        if (pass + 1 < step->passes)
            gain_momentum(c, &theta);
    }
    memcpy(c->moved, c->y, size * sizeof *c->y);
}

/* Adds to `moved` what takes a share of the penetration away. */
static void clear_penetration(perp__coloured *c, const perp__passes *step)
{
    const size_t size = 8 * ((size_t)c->bodies + 1);
    int32_t p, l, k, deep = 0;

    for (p = 0; p < c->points; p++) {
        perp__lane_point *point = &c->point[p];

        for (l = 0; l < PERP__GROUP; l++) {
            const int32_t contact = point->contact[l];
            const double guard = point->guard[l];
            const double lack = contact < 0 ? 0.0 : -(step->gap[contact] + guard);

            point->shift[l] = point->bias[l] = 0.0;
            if (!(lack > 0.0))
                continue;
            point->bias[l] = -fmin(SHARE * lack, FARTHEST * guard) / step->h;
            deep++;
        }
    }
    if (deep == 0)
        return;
    memset(c->before, 0, size * sizeof *c->before);
    for (k = 0; k < step->clear; k++)
        c->kernels->pass(c, PERP__COLOURED_CLEAR, c->before);
    for (size_t i = 0; i < size; i++)
        c->moved[i] += c->before[i];
}

/* v := free + C (y - y_free): where impulses change nothing, the bits of `free`. */
static void write_velocity(const perp__coloured *c, const perp__rigid_problem *problem,
                           const double *y, double *v)
{
    const int32_t width = c->width;
    int32_t body;

    for (body = 0; body < c->bodies; body++) {
        const double *C = problem->factors + width * width * body;
        double dy[6];

        for (int32_t j = 0; j < width; j++)
            dy[j] = y[8 * body + j] - c->free[8 * body + j];
        for (int32_t i = 0; i < width; i++) {
            double sum = 0.0;

            for (int32_t j = 0; j < width; j++)
                sum += C[width * i + j] * dy[j];
            v[width * body + i] = problem->free[width * body + i] + sum;
        }
    }
}

static void write_impulses(const perp__coloured *c, double *impulse)
{
    for (int32_t p = 0; p < c->points; p++)
        for (int32_t l = 0; l < PERP__GROUP; l++) {
            const int32_t contact = c->point[p].contact[l];

            for (int32_t k = 0; k < 3 && contact >= 0; k++)
                impulse[3 * contact + k] = c->point[p].r[k][l];
        }
}

perp_status perp__coloured_step(perp__coloured *c, perp__rigid_answer *answer, double *moving,
                                const perp__rigid_problem *problem, const perp__passes *step)
{
    perp_status status = perp__coloured_pack(c, problem, step);

    if (status != PERP_OK)
        return status;
    run_passes(c, problem, step);
    if (step->clear > 0)
        clear_penetration(c, step);
    write_velocity(c, problem, c->y, answer->v);
    if (moving)
        write_velocity(c, problem, c->moved, moving);
    write_impulses(c, answer->impulse);
    answer->iterations = step->passes;
    return PERP_OK;
}
