/* Where bodies and contacts of each class of pile are. Up is z. */
#include "piles.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double up[3] = {0, 0, 1};

static void *grown(void *old, int32_t count, int32_t *room, size_t size)
{
    if (count < *room)
        return old;
    *room = *room ? 2 * *room : 64;
    old = realloc(old, (size_t)*room * size);
    if (!old)
        abort();
    return old;
}

static int32_t add_body(piles_scene *s, double x, double y, double z, double a, double b, double c)
{
    const double position[3] = {x, y, z}, half[3] = {a, b, c};
    piles_body *body;

    s->body = grown(s->body, s->bodies, &s->body_room, sizeof *s->body);
    body = &s->body[s->bodies];
    memset(body, 0, sizeof *body);
    memcpy(body->position, position, sizeof position);
    memcpy(body->half, half, sizeof half);
    return s->bodies++;
}

static void add_contact(piles_scene *s, int32_t below, int32_t above, const double point[3],
                        const double normal[3], double gap)
{
    piles_contact *c;

    s->contact = grown(s->contact, s->contacts, &s->contact_room, sizeof *s->contact);
    c = &s->contact[s->contacts++];
    memset(c, 0, sizeof *c);
    c->body[0] = below;
    c->body[1] = above;
    c->gap = gap;
    memcpy(c->point, point, sizeof c->point);
    memcpy(c->normal, normal, sizeof c->normal);
}

/* The 4 corners of [x0, x1] x [y0, y1] at height z. */
static void add_face(piles_scene *s, int32_t below, int32_t above, double x0, double x1, double y0,
                     double y1, double z)
{
    int k;

    for (k = 0; k < 4; k++) {
        const double point[3] = {k % 2 ? x1 : x0, k / 2 ? y1 : y0, z};

        add_contact(s, below, above, point, up, 0.0);
    }
}

static void fill_columns(piles_scene *s, gen_random *random, int32_t contacts, int32_t layers)
{
    int32_t column, layer;

    if (layers <= 0)
        layers = 10;
    for (column = 0; s->contacts < contacts; column++) {
        double z = 0.0, side = 0.0;

        for (layer = 0; layer < layers && s->contacts < contacts; layer++) {
            double a = gen_uniform(random, 0.3, 0.6), c = gen_uniform(random, 0.1, 0.4);
            int32_t box = add_body(s, 2.0 * column, 0, z + c, a, a, c);
            double face = layer ? fmin(a, side) : a;

            add_face(s, layer ? box - 1 : PILES_GROUND, box, 2.0 * column - face,
                     2.0 * column + face, -face, face, z);
            z += 2 * c;
            side = a;
        }
    }
}

static void fill_towers(piles_scene *s, int32_t contacts, int32_t layers)
{
    int32_t tower, layer, i, j;

    if (layers <= 0)
        layers = 10;
    for (tower = 0; s->contacts < contacts; tower++) {
        const double x0 = 3.0 * tower;

        for (layer = 0; layer < layers && s->contacts < contacts; layer++) {
            const int32_t first = s->bodies, across = layer % 2;
            const double z = 0.2 * layer;

            for (i = 0; i < 3; i++)
                add_body(s, x0 + (across ? 0 : 0.4 * (i - 1)), across ? 0.4 * (i - 1) : 0, z + 0.1,
                         across ? 0.6 : 0.2, across ? 0.2 : 0.6, 0.1);
            for (i = 0; i < 3; i++) {
                double c = 0.4 * (i - 1);

                if (layer == 0)
                    add_face(s, PILES_GROUND, first + i, x0 + c - 0.2, x0 + c + 0.2, -0.6, 0.6, z);
                for (j = 0; layer > 0 && j < 3; j++) {
                    double x = x0 + (across ? 0.4 * (j - 1) : c), y = across ? c : 0.4 * (j - 1);

                    add_face(s, first - 3 + j, first + i, x - 0.2, x + 0.2, y - 0.2, y + 0.2, z);
                }
            }
        }
    }
}

/* Each layer half a brick off the last: two faces a brick, four points a face. */
static void fill_wall(piles_scene *s, int32_t contacts, int32_t layers)
{
    const double length = 1.0, height = 0.5;
    int32_t width, layer, k, j;

    if (layers <= 0)
        layers = (int32_t)fmax(2.0, sqrt(contacts / 16.0));
    width = (int32_t)fmax(1.0, ceil(contacts / (8.0 * layers)));
    for (layer = 0; layer < layers && s->contacts < contacts; layer++) {
        const int32_t first = s->bodies, below = first - width;
        const double shift = layer % 2 ? 0.5 : 0.0, z = layer * height;

        for (k = 0; k < width; k++)
            add_body(s, (k + shift) * length, 0, z + 0.5 * height, 0.5 * length, 0.25,
                     0.5 * height);
        for (k = 0; k < width; k++) {
            const double x = (k + shift) * length;

            if (layer == 0)
                add_face(s, PILES_GROUND, first + k, x - 0.5, x + 0.5, -0.25, 0.25, z);
            for (j = layer % 2 ? k : k - 1; layer > 0 && j <= (layer % 2 ? k + 1 : k); j++) {
                const double other = (j + (layer % 2 ? 0.0 : 0.5)) * length;

                if (j >= 0 && j < width)
                    add_face(s, below + j, first + k, fmax(x, other) - 0.5, fmin(x, other) + 0.5,
                             -0.25, 0.25, z);
            }
        }
    }
}

static void add_pair(piles_scene *s, int32_t under, int32_t ball, double most_gap)
{
    const double *p = s->body[under].position, *q = s->body[ball].position;
    double normal[3], point[3], length = 0.0, gap;
    int c;

    for (c = 0; c < 3; c++) {
        normal[c] = q[c] - p[c];
        length += normal[c] * normal[c];
    }
    length = sqrt(length);
    gap = length - s->body[under].half[0] - s->body[ball].half[0];
    if (gap > most_gap)
        return;
    for (c = 0; c < 3; c++) {
        normal[c] /= length;
        point[c] = p[c] + (s->body[under].half[0] + 0.5 * gap) * normal[c];
    }
    add_contact(s, under, ball, point, normal, fabs(gap) < 1e-9 ? 0.0 : gap);
}

/* Balls of radius 1/2, each on four; one contact a pair. A pyramid, cut off above `layers`. */
static void fill_balls(piles_scene *s, int32_t contacts, int32_t layers)
{
    int32_t side = 1, layer, i, j, k, below = 0, counted = 0;

    while (counted < contacts) { /* of a pyramid with that side */
        side++;
        counted = side * side;
        for (layer = 1; layer < side && (layers <= 0 || layer < layers); layer++)
            counted += 4 * (side - layer) * (side - layer);
    }
    for (layer = 0; side > 0 && (layers <= 0 || layer < layers); layer++, side--) {
        const int32_t first = s->bodies;

        for (i = 0; i < side; i++)
            for (j = 0; j < side; j++) {
                const double foot[3] = {i + 0.5 * layer, j + 0.5 * layer, 0};
                int32_t ball =
                    add_body(s, foot[0], foot[1], 0.5 + layer * sqrt(0.5), 0.5, 0.5, 0.5);

                if (layer == 0)
                    add_contact(s, PILES_GROUND, ball, foot, up, 0.0);
                for (k = 0; layer > 0 && k < 4; k++)
                    add_pair(s, below + (i + k / 2) * (side + 1) + j + k % 2, ball, 0.1);
            }
        below = first;
    }
}

/* A box of layers of balls that stand a little off the places of a lattice, of radii 0.45 to 0.5:
 * each may touch four below it and two beside it. */
static void fill_heap(piles_scene *s, gen_random *random, int32_t contacts, int32_t layers)
{
    int32_t side, layer, i, j, k;

    if (layers <= 0)
        layers = (int32_t)fmax(2.0, cbrt(contacts / 10.0));
    side = (int32_t)fmax(2.0, ceil(sqrt(contacts / (5.0 * layers))));
    for (layer = 0; layer < layers && s->contacts < contacts; layer++) {
        const int32_t first = s->bodies, below = first - side * side;
        const double shift = layer % 2 ? 0.5 : 0.0;

        for (i = 0; i < side; i++)
            for (j = 0; j < side; j++) {
                const double radius = gen_uniform(random, 0.45, 0.5);
                const double x = i + shift + gen_uniform(random, -0.03, 0.03);
                const double y = j + shift + gen_uniform(random, -0.03, 0.03);
                const double z = layer * sqrt(0.5) + gen_uniform(random, 0.46, 0.5);
                const double foot[3] = {x, y, 0};
                int32_t ball = add_body(s, x, y, z, radius, radius, radius);

                if (layer == 0)
                    add_contact(s, PILES_GROUND, ball, foot, up, fmax(z - radius, 0.0));
                if (i > 0)
                    add_pair(s, ball - side, ball, 0.05);
                if (j > 0)
                    add_pair(s, ball - 1, ball, 0.05);
                for (k = 0; layer > 0 && k < 4; k++) {
                    int32_t a = i - (layer % 2 ? 0 : 1) + k / 2,
                            b = j - (layer % 2 ? 0 : 1) + k % 2;

                    if (a >= 0 && b >= 0 && a < side && b < side)
                        add_pair(s, below + a * side + b, ball, 0.05);
                }
            }
    }
}

void piles_fill(piles_scene *s, gen_random *random, const piles_options *o)
{
    switch (o->class) {
    case PILES_TOWER:
        fill_towers(s, o->contacts, o->layers);
        break;
    case PILES_WALL:
        fill_wall(s, o->contacts, o->layers);
        break;
    case PILES_BALLS:
        fill_balls(s, o->contacts, o->layers);
        break;
    case PILES_HEAP:
        fill_heap(s, random, o->contacts, o->layers);
        break;
    default:
        fill_columns(s, random, o->contacts, o->layers);
        break;
    }
}
