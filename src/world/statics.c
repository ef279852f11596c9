/* Impulses that hold what begins at rest, to rounding. Where a heavy body lies on light ones, what
 * a method leaves of velocities is worth as little as the ratio of the masses; forces know nothing
 * of that ratio. With r from a method, what is out of balance is e = -M v_free - J'r, and
 *
 *   r := r + J z,     J'J z = e
 *
 * are the nearest impulses that are not, over the contacts that stick. J'J has no masses in it;
 * turns are taken times the bodies' radius. By conjugate gradients, again from what they leave.
 * Where that leads out of friction's cones the nearest point in these comes next, and so forth
 * (projections in turn, von Neumann's method). */
#include "world/world.h"

#include <math.h>
#include <string.h>

#include "linalg/spatial.h"

/* How often, with so many steps a coordinate at most, and what each time leaves of it. */
#define TIMES 3
#define STEPS 2
#define LEFT 1e-8

/* Projections: one, and as many more as this is times the contacts; and the share of friction that
 * they come within. */
#define ROUNDS 512
#define WITHIN 0.999

/* y += f J'x or, `back`, x += J y of what sticks; x 3 a contact, y by coordinates. */
static void apply(const perp_world *world, int32_t back, double f, double *x, double *y)
{
    const perp__island_work *work = &world->work;
    const int32_t n = world->dof, linear = n == 6 ? 3 : 2;

    for (int32_t i = 0; i < 2 * work->count; i++) {
        const perp__rigid_rows *rows = &work->rows[i / 2];
        const int32_t body = rows->body[i % 2];
        double *at = y + n * body, *of = x + i / 2 * 3, arm;

        if (body < 0 || work->modes[i / 2] == PERP_CONTACT_SEPARATE)
            continue;
        arm = 1.0 / world->bodies[work->members[body]].radius;
        for (int32_t k = 0; k < rows->dim; k++)
            for (int32_t j = 0; j < n; j++) {
                const double entry = rows->rows[i % 2][k][j] * (j < linear ? 1.0 : arm);

                if (back)
                    of[k] += entry * at[j];
                else
                    at[j] += f * entry * of[k];
            }
    }
}

static double dot(const double *x, const double *y, int32_t count)
{
    double sum = 0.0;

    for (int32_t i = 0; i < count; i++)
        sum += x[i] * y[i];
    return sum;
}

/* e := -M v_free - J'r, turns over the bodies' radius. */
static void find_unbalance(const perp_world *world, const perp__island *island, double *e)
{
    const perp__island_work *work = &world->work;
    const int32_t n = world->dof;

    for (int32_t i = 0; i < island->bodies; i++) {
        const perp__body *body = &world->bodies[work->members[i]];
        const double *R = world->motions[work->members[i]].rotation;
        double twist[6], own[3], turned[3];

        perp__twist_of(world, work->free + n * i, twist);
        perp__apply_transposed3(own, R, twist + 3);
        perp__apply3(turned, body->inertia, own);
        perp__apply3(twist + 3, R, turned);
        for (int32_t k = 0; k < 3; k++) {
            twist[k] *= -body->mass;
            twist[3 + k] /= -body->radius;
        }
        perp__coordinates_of(world, twist, e + n * i);
    }
    apply(world, 0, -1.0, work->impulse, e);
}

/* One solution of J'J z = e from z = 0, into the impulses. */
static void correct(const perp_world *world, int32_t numbers)
{
    const perp__island_work *work = &world->work;
    double *e = work->still, *p = work->moving, *q = work->solved, *x = work->solved_rows;
    const size_t rows = 3 * (size_t)work->count;
    double square = dot(e, e, numbers), least = LEFT * LEFT * square, alpha, next;

    memcpy(p, e, (size_t)numbers * sizeof *p);
    for (int32_t step = 0; step < STEPS * numbers && square > least; step++) {
        memset(x, 0, rows * sizeof *x);
        memset(q, 0, (size_t)numbers * sizeof *q);
        apply(world, 1, 1.0, x, p);
        apply(world, 0, 1.0, x, q);
        alpha = square / dot(x, x, 3 * work->count);
        if (!(alpha < INFINITY))
            return;
        for (size_t i = 0; i < rows; i++)
            work->impulse[i] += alpha * x[i];
        for (int32_t i = 0; i < numbers; i++)
            e[i] -= alpha * q[i];
        next = dot(e, e, numbers);
        for (int32_t i = 0; i < numbers; i++)
            p[i] = e[i] + next / square * p[i];
        square = next;
    }
}

/* v := what is left out of balance makes of velocities. */
static void leave(const perp_world *world, const perp__island *island)
{
    const perp__island_work *work = &world->work;
    const int32_t n = world->dof, linear = n == 6 ? 3 : 2;

    for (int32_t i = 0; i < island->bodies; i++) {
        const double *C = work->factors + n * n * i, *e = work->still + n * i;
        const double radius = world->bodies[work->members[i]].radius;
        double own[6] = {0.0};

        for (int32_t j = 0; j < n; j++)
            for (int32_t k = 0; k < n; k++)
                own[j] -= C[n * k + j] * e[k] * (k < linear ? 1.0 : radius);
        for (int32_t j = 0; j < n; j++)
            work->v[n * i + j] = dot(C + n * j, own, n);
    }
}

/* The nearest impulses within the cones; returns whether these are others. */
static int32_t clip(const perp_world *world)
{
    int32_t clipped = 0;

    for (int32_t i = 0; i < world->work.count; i++) {
        double *r = world->work.impulse + 3 * i, mu = world->work.rows[i].mu;
        const double tangent = hypot(r[1], r[2]);

        if (r[0] >= 0.0 && tangent <= mu * r[0])
            continue;
        mu *= WITHIN;
        clipped = 1;
        r[0] = fmax(r[0] + mu * tangent, 0.0) / (1.0 + mu * mu);
        for (int32_t k = 1; k < 3 && tangent > 0.0; k++)
            r[k] *= mu * r[0] / tangent;
    }
    return clipped;
}

void perp__balance_island(perp_world *world, const perp__island *island)
{
    int32_t rounds = 1 + ROUNDS / world->work.count;

    do {
        for (int32_t time = 0; time < TIMES; time++) {
            find_unbalance(world, island, world->work.still);
            correct(world, world->dof * island->bodies);
        }
    } while (--rounds > 0 && clip(world));
    find_unbalance(world, island, world->work.still);
    leave(world, island);
}
