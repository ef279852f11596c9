/* Scenes of rigid bodies for the inner entrance: bodies with their factors, contacts by point and
 * normal, arrays that grow. Gravity acts for one step of H seconds. */
#ifndef PERP_TESTS_RIGID_SCENE_H
#define PERP_TESTS_RIGID_SCENE_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "contact/contact.h"

#define RIGID_H 0.01
#define RIGID_G 9.81

enum { RIGID_GROUND = -1 };

typedef struct rigid_scene {
    int32_t width, bodies, carriers, contacts, room_bodies, room_rows;
    double *factors, *free, *origins; /* bodies, then carriers */
    double *mass;                     /* width by width each: M, for checks */
    perp__rigid_rows *rows;
    double *warm, *impulse, *velocity, *v;
    int32_t *modes, *carrier;
} rigid_scene;

static inline void *rigid_grown(void *old, size_t count, size_t size)
{
    void *grown = realloc(old, count * size + 1);

    if (!grown)
        abort();
    return grown;
}

static inline void rigid_open(rigid_scene *s, int32_t planar)
{
    memset(s, 0, sizeof *s);
    s->width = planar ? 3 : 6;
}

static inline void rigid_close(rigid_scene *s)
{
    void *all[] = {s->factors, s->free,     s->origins, s->mass,  s->rows,   s->warm,
                   s->impulse, s->velocity, s->v,       s->modes, s->carrier};

    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        free(all[i]);
}

/* Any square root C of M^-1 will do: this one is turned by 0.3 about the last axis, so that nobody
 * relies on triangles. Down is -z, in the plane -y. All bodies come before carriers. */
static inline int32_t rigid_add(rigid_scene *s, const double *position, const double *half,
                                double mass, const double *velocity)
{
    const int32_t w = s->width, b = s->bodies + s->carriers, linear = w == 3 ? 2 : 3;
    const size_t square = (size_t)(w * w);
    double *C, *M, *v;

    if (b >= s->room_bodies) {
        const size_t room = (size_t)(s->room_bodies = 2 * b + 16);

        s->factors = rigid_grown(s->factors, room * square, sizeof(double));
        s->mass = rigid_grown(s->mass, room * square, sizeof(double));
        s->free = rigid_grown(s->free, room * (size_t)w, sizeof(double));
        s->origins = rigid_grown(s->origins, room * 3, sizeof(double));
        s->v = rigid_grown(s->v, room * (size_t)w, sizeof(double));
        s->carrier = rigid_grown(s->carrier, room, sizeof(int32_t));
    }
    C = s->factors + (size_t)b * square;
    M = s->mass + (size_t)b * square;
    v = s->free + (size_t)(b * w);
    memset(C, 0, square * sizeof *C);
    memset(M, 0, square * sizeof *M);
    for (int32_t i = 0; i < w; i++)
        v[i] = velocity ? velocity[i] : 0.0;
    for (int32_t i = 0; i < 3; i++)
        s->origins[3 * b + i] = i < linear ? position[i] : 0.0;
    if (mass <= 0.0) {
        s->carriers++;
        return b;
    }
    for (int32_t i = 0; i < w; i++) {
        const int32_t a = (i - linear + 1) % 3, c = (i - linear + 2) % 3;
        double inertia = mass;

        if (w == 3 && i == 2)
            inertia = mass * (half[0] * half[0] + half[1] * half[1]) / 3.0;
        else if (i >= linear)
            inertia = mass * (half[a] * half[a] + half[c] * half[c]) / 3.0;
        M[i * w + i] = inertia;
        C[i * w + i] = 1.0 / sqrt(inertia);
    }
    for (int32_t i = 0; i < w; i++) { /* C times a rotation of two coordinates, in space angular */
        double *row = C + i * w + (w == 3 ? 0 : linear);
        const double x = row[0], y = row[1];

        row[0] = cos(0.3) * x - sin(0.3) * y;
        row[1] = sin(0.3) * x + cos(0.3) * y;
    }
    v[linear - 1] -= RIGID_G * RIGID_H;
    s->bodies++;
    return b;
}

static inline void rigid_tangents(const double *n, double t[2][3])
{
    const int axis = fabs(n[0]) > 0.9 ? 1 : 0;
    double length = 0.0;

    for (int i = 0; i < 3; i++) {
        t[0][i] = (i == axis) - n[axis] * n[i];
        length += t[0][i] * t[0][i];
    }
    for (int i = 0; i < 3; i++)
        t[0][i] /= sqrt(length);
    for (int i = 0; i < 3; i++)
        t[1][i] = n[(i + 1) % 3] * t[0][(i + 2) % 3] - n[(i + 2) % 3] * t[0][(i + 1) % 3];
}

/* A contact of a and b at a point; the normal points from a to b. Returns its rows. */
static inline perp__rigid_rows *rigid_touch(rigid_scene *s, int32_t a, int32_t b,
                                            const double *point, const double *normal, int32_t dim,
                                            double mu)
{
    const int32_t linear = s->width == 3 ? 2 : 3, bodies[2] = {a, b};
    double axes[3][3] = {{normal[0], normal[1], linear == 3 ? normal[2] : 0.0}};
    perp__rigid_rows *g;

    if (s->contacts >= s->room_rows) {
        const size_t room = (size_t)(s->room_rows = 2 * s->contacts + 64);

        s->rows = rigid_grown(s->rows, room, sizeof *s->rows);
        s->warm = rigid_grown(s->warm, 3 * room, sizeof(double));
        s->impulse = rigid_grown(s->impulse, 3 * room, sizeof(double));
        s->velocity = rigid_grown(s->velocity, 3 * room, sizeof(double));
        s->modes = rigid_grown(s->modes, room, sizeof(int32_t));
    }
    g = &s->rows[s->contacts++];
    memset(g, 0, sizeof *g);
    g->dim = dim;
    g->mu = mu;
    if (linear == 3) {
        rigid_tangents(axes[0], axes + 1);
    } else {
        axes[1][0] = -normal[1];
        axes[1][1] = normal[0];
    }
    for (int32_t side = 0; side < 2; side++) {
        const double sign = side ? 1.0 : -1.0;

        g->body[side] = bodies[side];
        for (int32_t i = 0; i < dim && bodies[side] >= 0; i++) {
            double arm[3] = {0}, *J = g->rows[side][i];

            for (int32_t j = 0; j < linear; j++) {
                arm[j] = point[j] - s->origins[3 * bodies[side] + j];
                J[j] = sign * axes[i][j];
            }
            for (int32_t j = 0; linear == 3 && j < 3; j++)
                J[3 + j] = sign * (arm[(j + 1) % 3] * axes[i][(j + 2) % 3] -
                                   arm[(j + 2) % 3] * axes[i][(j + 1) % 3]);
            if (linear == 2)
                J[2] = sign * (arm[0] * axes[i][1] - arm[1] * axes[i][0]);
        }
    }
    return g;
}

/* Points of a horizontal face from x0 to x1 (and y0 to y1) at height z: two, or four. */
static inline void rigid_face(rigid_scene *s, int32_t below, int32_t above, double x0, double x1,
                              double y0, double y1, double z, double mu)
{
    static const double up[3] = {0.0, 0.0, 1.0}, planar_up[2] = {0.0, 1.0};

    for (int k = 0; k < (s->width == 3 ? 2 : 4); k++) {
        const double point[3] = {k % 2 ? x1 : x0, k / 2 ? y1 : y0, z};
        const double flat[2] = {k % 2 ? x1 : x0, z};

        rigid_touch(s, below, above, s->width == 3 ? flat : point, s->width == 3 ? planar_up : up,
                    s->width == 3 ? 2 : 3, mu);
    }
}

static inline int32_t rigid_box(rigid_scene *s, double x, double y, double z, const double *half,
                                double mass, const double *velocity)
{
    const double flat[3] = {x, z, 0.0}, flat_half[2] = {half[0], half[2]};
    const double place[3] = {x, y, z};

    return s->width == 3 ? rigid_add(s, flat, flat_half, mass, velocity)
                         : rigid_add(s, place, half, mass, velocity);
}

/* A pyramid of boxes, `base` in the lowest row, each on two of the row below. */
static inline void rigid_pyramid(rigid_scene *s, int32_t base, double mu)
{
    static const double half[3] = {0.5, 0.5, 0.5};
    int32_t below = RIGID_GROUND, row, i;

    for (row = 0; row < base; row++) {
        const int32_t first = s->bodies;

        for (i = 0; i < base - row; i++) {
            const double x = 1.05 * (i + 0.5 * row), z = 1.0 * row;
            const int32_t box = rigid_box(s, x, 0.0, z + 0.5, half, 1.0, NULL);

            if (row == 0) {
                rigid_face(s, RIGID_GROUND, box, x - 0.5, x + 0.5, -0.5, 0.5, z, mu);
                continue;
            }
            rigid_face(s, below + i, box, x - 0.5, x - 0.525 + 0.5, -0.5, 0.5, z, mu);
            rigid_face(s, below + i + 1, box, x + 0.525 - 0.5, x + 0.5, -0.5, 0.5, z, mu);
        }
        below = first;
    }
}

static inline perp__rigid_problem rigid_problem(const rigid_scene *s)
{
    perp__rigid_problem p;

    memset(&p, 0, sizeof p);
    p.width = s->width;
    p.bodies = s->bodies;
    p.carriers = s->carriers;
    p.contacts = s->contacts;
    p.factors = s->factors;
    p.free = s->free;
    p.origins = s->origins;
    p.rows = s->rows;
    p.tol = 1e-8;
    return p;
}

static inline perp__rigid_answer rigid_answer(const rigid_scene *s)
{
    perp__rigid_answer a;

    memset(&a, 0, sizeof a);
    a.impulse = s->impulse;
    a.velocity = s->velocity;
    a.v = s->v;
    a.modes = s->modes;
    a.carrier = s->carrier;
    return a;
}

#endif
