/* Impulses that hold what begins at rest, to rounding. Where a heavy body lies on light ones, what
 * a method leaves of velocities is worth as little as the ratio of the masses; forces know nothing
 * of that ratio. With r from a method, what is out of balance is e = -M v_free - J'r, and
 *
 *   r := r + J z,     J'J z = e
 *
 * are the nearest impulses that are not, over the contacts that stick. J'J has no masses in it;
 * turns are taken times the bodies' radius. By conjugate gradients, again from what they leave.
 * Where that leads out of friction's cones the nearest point in these comes next, and so forth
 * (projections in turn, von Neumann's method).
 *
 * A pile's contacts are many, and some hardly press: with J z times the squares of weights, which
 * are as the impulses, nearly all stay within their cones at once. */
#include "world/step.h"

#include <math.h>
#include <string.h>

#include "linalg/lanes/lanes.h"
#include "linalg/lanes/multiversion.h"
#include "linalg/matrix.h"
#include "linalg/spatial.h"

/* How often, with so many steps a coordinate at most, and what each time leaves of it. */
#define TIMES 3
#define STEPS 2
#define LEFT 1e-8

/* What is left in a pile beside its weight, and then of each body beside its own terms. */
#define FINE 1e-14
#define BALANCED 1e-12

/* Projections: one, and as many more as this is times the contacts; and the share of friction that
 * they come within. */
#define ROUNDS 512
#define WITHIN 0.99

/* Of a pile: what is drawn into its cones presses less, and carries less of what comes next. */
#define PILE_ROUNDS 20

/* Rows of contact i on one of its bodies, turns over that body's radius; returns the body. */
static int32_t rows_of(const perp_world *world, int32_t i, int32_t side, double out[3][6])
{
    const perp__island_work *work = &world->work;
    const perp__rigid_rows *rows = &work->rows[i];
    const int32_t n = world->dof, linear = n == 6 ? 3 : 2, body = rows->body[side];
    const double arm = body < 0 ? 0.0 : 1.0 / world->bodies[work->members[body]].radius;

    for (int32_t k = 0; k < rows->dim; k++)
        for (int32_t j = 0; j < n; j++)
            out[k][j] = rows->rows[side][k][j] * (j < linear ? 1.0 : arm);
    return body;
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
    for (int32_t i = 0; i < 2 * work->count; i++) {
        double rows[3][6];
        const int32_t body = rows_of(world, i / 2, i % 2, rows);

        for (int32_t k = 0; k < work->rows[i / 2].dim && body >= 0; k++)
            for (int32_t j = 0; j < n; j++)
                e[n * body + j] -= work->impulse[i / 2 * 3 + k] * rows[k][j];
    }
}

/* block += f a'b. */
static void add_block(double *block, double f, double (*a)[6], double (*b)[6], int32_t rows,
                      int32_t n)
{
    for (int32_t k = 0; k < rows; k++)
        for (int32_t i = 0; i < n; i++)
            for (int32_t j = 0; j < n; j++)
                block[n * i + j] += f * a[k][i] * b[k][j];
}

/* J'WJ: a block for each body, and two for each pair of bodies that contacts lie between. */
static void assemble(perp_world *world, const perp__island *island)
{
    perp__island_work *work = &world->work;
    const int32_t n = world->dof, size = n * n;
    double *block = work->stiffness + size * island->bodies;

    memset(work->stiffness, 0, (size_t)(size * island->bodies) * sizeof *block);
    work->couples = 0;
    for (int32_t i = 0; i < work->count; i++) {
        const int32_t dim = work->rows[i].dim, *last = work->couple + 2 * (work->couples - 1);
        const double f = work->weight[i];
        double a[3][6], b[3][6];
        const int32_t first = rows_of(world, i, 0, a), second = rows_of(world, i, 1, b);

        if (f == 0.0)
            continue;
        if (first >= 0)
            add_block(work->stiffness + size * first, f, a, a, dim, n);
        if (second >= 0)
            add_block(work->stiffness + size * second, f, b, b, dim, n);
        if (first < 0 || second < 0)
            continue;
        if (work->couples == 0 || last[0] != first || last[1] != second) {
            work->couple[2 * work->couples] = first;
            work->couple[2 * work->couples++ + 1] = second;
            memset(block, 0, (size_t)(2 * size) * sizeof *block);
            block += 2 * size;
        }
        add_block(block - 2 * size, f, a, b, dim, n);
        add_block(block - size, f, b, a, dim, n);
    }
}

/* y += K'x. */
PERP__KERNEL static void multiply(const double *K, const double *x, double *y, int32_t n)
{
    for (int32_t i = 0; i < n && n == 6; i++) {
        PERP__LANES_AT(y) += PERP__SAME_LANES(x[i]) * PERP__CONST_LANES_AT(K + 6 * i);
        PERP__PAIR_AT(y + 4) += PERP__SAME_PAIR(x[i]) * PERP__CONST_PAIR_AT(K + 6 * i + 4);
    }
    for (int32_t i = 0; i < n && n == 3; i++)
        for (int32_t j = 0; j < 3; j++)
            y[j] += x[i] * K[3 * i + j];
}

/* q := J'WJ p. */
PERP__MULTIVERSION(apply,
                   (const perp__island_work *work, int32_t bodies, int32_t n, const double *p,
                    double *q),
                   (work, bodies, n, p, q))
{
    const int32_t size = n * n;
    const double *block = work->stiffness;

    memset(q, 0, (size_t)(n * bodies) * sizeof *q);
    for (int32_t i = 0; i < bodies; i++, block += size)
        multiply(block, p + n * i, q + n * i, n);
    for (int32_t i = 0; i < work->couples; i++, block += 2 * size) {
        const int32_t a = n * work->couple[2 * i], b = n * work->couple[2 * i + 1];

        multiply(block, p + a, q + b, n);
        multiply(block + size, p + b, q + a, n);
    }
}

/* r += W J z. */
static void press(const perp_world *world, const double *z)
{
    const perp__island_work *work = &world->work;
    const int32_t n = world->dof;

    for (int32_t i = 0; i < 2 * work->count; i++) {
        double rows[3][6];
        const int32_t body = rows_of(world, i / 2, i % 2, rows);

        if (body < 0 || work->weight[i / 2] == 0.0)
            continue;
        for (int32_t k = 0; k < work->rows[i / 2].dim; k++)
            work->impulse[i / 2 * 3 + k] +=
                work->weight[i / 2] * perp__dot(rows[k], z + n * body, n);
    }
}

/* One solution of J'WJ z = e from z = 0 to |e|^2 <= least, into the impulses. */
static void correct(perp_world *world, const perp__island *island, double least)
{
    const perp__island_work *work = &world->work;
    const int32_t numbers = world->dof * island->bodies;
    double *e = work->still, *p = work->moving, *q = work->solved, *z = work->v;
    double square = perp__dot(e, e, numbers), alpha, next;

    memcpy(p, e, (size_t)numbers * sizeof *p);
    memset(z, 0, (size_t)numbers * sizeof *z);
    for (int32_t step = 0; step < STEPS * numbers && square > least; step++) {
        apply(work, island->bodies, world->dof, p, q);
        alpha = square / perp__dot(p, q, numbers);
        if (!(fabs(alpha) < INFINITY))
            break;
        for (int32_t i = 0; i < numbers; i++) {
            z[i] += alpha * p[i];
            e[i] -= alpha * q[i];
        }
        next = perp__dot(e, e, numbers);
        for (int32_t i = 0; i < numbers; i++)
            p[i] = e[i] + next / square * p[i];
        square = next;
    }
    press(world, z);
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
            work->v[n * i + j] = perp__dot(C + n * j, own, n);
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
    perp__island_work *work = &world->work;
    const int32_t numbers = world->dof * island->bodies;
    int32_t rounds = 1 + ROUNDS / work->count;

    for (int32_t i = 0; i < work->count; i++)
        work->weight[i] = work->modes[i] != PERP_CONTACT_SEPARATE;
    assemble(world, island);
    do {
        for (int32_t time = 0; time < TIMES; time++) {
            find_unbalance(world, island, work->still);
            correct(world, island, LEFT * LEFT * perp__dot(work->still, work->still, numbers));
        }
    } while (--rounds > 0 && clip(world));
    find_unbalance(world, island, work->still);
    leave(world, island);
}

/* The square of the momentum that forces give to the island. */
static double load_of(const perp_world *world, const perp__island *island)
{
    double sum = 0.0;

    for (int32_t i = 0; i < island->bodies; i++) {
        const int32_t body = world->work.members[i];
        const double norm = perp__mass_norm(world, body, world->work.gain + world->dof * i);

        sum += world->bodies[body].mass * norm * norm;
    }
    return sum;
}

/* Impulses within their cones, and weights as large as these; none where shapes do not touch. */
static void draw_in(const perp__island_work *work)
{
    for (int32_t i = 0; i < work->count; i++) {
        double *r = work->impulse + 3 * i, most = WITHIN * work->rows[i].mu * r[0];
        const double tangent = hypot(r[1], r[2]);

        if (work->rows[i].bias[0] > 0.0 || !(r[0] > 0.0))
            memset(r, 0, 3 * sizeof *r);
        for (int32_t k = 1; k < 3 && tangent > most; k++)
            r[k] *= most / tangent;
        work->weight[i] = r[0];
    }
}

static int32_t count_outside(const perp__island_work *work)
{
    int32_t count = 0;

    for (int32_t i = 0; i < work->count; i++) {
        const double *r = work->impulse + 3 * i;

        count += !(r[0] >= 0.0 && hypot(r[1], r[2]) <= work->rows[i].mu * r[0]);
    }
    return count;
}

/* Balances the impulses, and draws in those that this takes out of their cones, until none is.
 * Returns how many are. */
static int32_t draw_and_balance(perp_world *world, const perp__island *island)
{
    const double least = FINE * FINE * load_of(world, island);
    int32_t rounds = PILE_ROUNDS, outside = world->work.count, last;

    do {
        last = outside;
        draw_in(&world->work);
        assemble(world, island);
        find_unbalance(world, island, world->work.still);
        correct(world, island, least);
        outside = count_outside(&world->work);
        rounds -= outside < last ? 1 : PILE_ROUNDS / 4;
    } while (outside > 0 && rounds > 0);
    return outside;
}

int32_t perp__balance_pile(perp_world *world, const perp__island *island, double *left)
{
    perp__island_work *work = &world->work;
    const size_t bytes = 3 * (size_t)work->count * sizeof(double);
    const size_t numbers = (size_t)(world->dof * island->bodies);
    int32_t outside;

    memcpy(work->warm, work->impulse, bytes);
    memcpy(work->forces, work->v, numbers * sizeof(double));
    outside = draw_and_balance(world, island);
    find_unbalance(world, island, work->still);
    leave(world, island);
    if (outside > 0 || !perp__rest_island(world, island, BALANCED, left)) {
        memcpy(work->impulse, work->warm, bytes);
        memcpy(work->v, work->forces, numbers * sizeof(double));
        return 0;
    }
    for (int32_t i = 0; i < work->count; i++)
        work->modes[i] = work->impulse[3 * i] > 0.0 ? PERP_CONTACT_STICK : PERP_CONTACT_SEPARATE;
    return 1;
}
