/* What a scene still needs once its bodies and contacts are placed. The order of the random draws
 * is part of SCENE_VERSION. */
#include "scene.h"

#include <math.h>
#include <string.h>

static const double step = 0.01, gravity = 9.81;

/* Height counts along y in the plane, along z in space. */
static double height_of(const scene *s, int32_t b)
{
    return s->body[b].position[s->planar ? 1 : 2];
}

/* Where body b stands between the lightest (0) and the heaviest (1). */
static double position_of(const scene *s, gen_random *random, int32_t b, int32_t order)
{
    double low = height_of(s, 0), high = low, share;
    int32_t k;

    for (k = 1; k < s->bodies; k++) {
        low = fmin(low, height_of(s, k));
        high = fmax(high, height_of(s, k));
    }
    share = high > low ? (height_of(s, b) - low) / (high - low) : s->bodies > 1 && b > 0;
    switch (order) {
    case SCENE_LIGHT_ON_HEAVY:
        return 1.0 - share;
    case SCENE_HEAVY_ON_LIGHT:
        return share;
    case SCENE_ALTERNATING:
        return b % 2;
    default: /* both ends are always there */
        return b == 0 ? 0.0 : b == 1 ? 1.0 : gen_uniform(random, 0, 1);
    }
}

static void set_masses(scene *s, gen_random *random, const scene_options *o)
{
    int32_t b, k;

    for (b = 0; b < s->bodies; b++) {
        scene_body *body = &s->body[b];
        const double *h = body->half;

        body->mass = exp(position_of(s, random, b, o->order) * log(o->mass_ratio));
        for (k = 0; k < 3; k++) {
            double y = h[(k + 1) % 3], z = h[(k + 2) % 3];

            body->inertia[k] = body->mass * (y * y + z * z) / 3.0;
        }
    }
}

static void set_motion(scene *s, gen_random *random, const scene_options *o)
{
    const int32_t pushed = gen_integer(random, s->bodies);
    int32_t b, k;

    for (b = 0; b < s->bodies; b++) {
        double *v = s->body[b].velocity;

        v[s->planar ? 1 : 2] = -step * gravity;
        if (o->motion == SCENE_IMPACT || (o->motion == SCENE_PUSH && b == pushed))
            for (k = 0; k < 6; k++)
                v[k] += gen_normal(random) * (k < 3 ? 1.0 : 0.3);
        if (s->planar)
            v[2] = v[3] = v[4] = 0.0;
    }
}

static void set_contacts(scene *s, gen_random *random, const scene_options *o)
{
    static const double frictions[] = {0.0, 0.3, 1.0, 1e3};
    const int32_t aligned = gen_integer(random, 2);
    int32_t i, k;

    for (i = 0; i < s->contacts; i++) {
        scene_contact *c = &s->contact[i];
        double other[3] = {0.6, 0.64, 0.48}, length = 0.0;

        c->mu = o->mu < 0.0 ? frictions[gen_integer(random, 4)] : o->mu;
        c->gap = o->gaps && gen_integer(random, 2) ? gen_uniform(random, 0, 0.02) : 0.0;
        for (k = 0; k < (s->planar ? 2 : 3); k++)
            c->point[k] += o->jitter * gen_normal(random);
        if (!aligned)
            scene_unit(random, 0, other);
        if (s->planar) {
            c->tangent[0] = -c->normal[1];
            c->tangent[1] = c->normal[0];
            c->tangent[2] = 0.0;
            continue;
        }
        scene_cross(c->normal, other, c->tangent);
        for (k = 0; k < 3; k++)
            length += c->tangent[k] * c->tangent[k];
        for (k = 0; k < 3; k++)
            c->tangent[k] /= sqrt(length);
    }
}

/* Contacts that occur twice take the place of others, so that their number stays. */
static void repeat(scene *s, gen_random *random, int32_t count)
{
    int32_t k;

    for (k = 0; k < count; k++) {
        const int32_t to = gen_integer(random, s->contacts);

        s->contact[to] = s->contact[gen_integer(random, s->contacts)];
    }
}

static void move(scene *s, gen_random *random)
{
    double R[3][3], shift[3];
    int32_t i, k;

    gen_rotation(random, s->planar, R);
    for (k = 0; k < 3; k++)
        shift[k] = s->planar && k == 2 ? 0.0 : gen_uniform(random, -10, 10);
    for (i = 0; i < s->bodies; i++) {
        scene_body *b = &s->body[i];

        gen_turn(R, b->position);
        gen_turn(R, b->velocity);
        gen_turn(R, b->velocity + 3);
        for (k = 0; k < 3; k++) {
            gen_turn(R, b->rotation[k]);
            b->position[k] += shift[k];
        }
    }
    for (i = 0; i < s->contacts; i++) {
        scene_contact *c = &s->contact[i];

        gen_turn(R, c->point);
        gen_turn(R, c->normal);
        gen_turn(R, c->tangent);
        for (k = 0; k < 3; k++)
            c->point[k] += shift[k];
    }
}

/* 1/m and R' I^-1 R; in the plane only x, y and the angle about z can move. */
static void invert_masses(scene *s)
{
    int32_t b, i, j, k;

    for (b = 0; b < s->bodies; b++) {
        scene_body *body = &s->body[b];

        for (i = 0; i < (s->planar ? 2 : 3); i++)
            body->inverse[i][i] = 1.0 / body->mass;
        for (i = s->planar ? 2 : 0; i < 3; i++)
            for (j = s->planar ? 2 : 0; j < 3; j++)
                for (k = 0; k < 3; k++)
                    body->inverse[i + 3][j + 3] +=
                        body->rotation[k][i] * body->rotation[k][j] / body->inertia[k];
    }
}

void scene_finish(scene *s, gen_random *random, const scene_options *options)
{
    set_masses(s, random, options);
    set_motion(s, random, options);
    set_contacts(s, random, options);
    repeat(s, random, options->duplicated);
    if (options->moved)
        move(s, random);
    invert_masses(s);
}
