/* The bodies and contacts of every class. Up is y in the plane, z in space. */
#include "scene.h"

#include <math.h>

static const double up[3] = {0, 0, 1}, planar_up[3] = {0, 1, 0};
static const double nowhere[3] = {0, 0, 0};

static int32_t at_least(int32_t x, int32_t least)
{
    return x < least ? least : x;
}

/* A rectangle [x0, x1] x [y0, y1] of contacts at height z. */
static void add_rectangle(scene *s, int32_t below, int32_t above, double x0, double x1, double y0,
                          double y1, double z, int32_t count1, int32_t count2)
{
    const double corner[3] = {x0, y0, z}, edge1[3] = {x1 - x0, 0, 0}, edge2[3] = {0, y1 - y0, 0};

    scene_add_face(s, below, above, corner, edge1, edge2, up, count1, count2);
}

static void add_segment(scene *s, int32_t below, int32_t above, double x0, double x1, double y)
{
    const double corner[3] = {x0, y, 0}, edge[3] = {x1 - x0, 0, 0};

    scene_add_face(s, below, above, corner, edge, nowhere, planar_up, 2, 1);
}

static void fill_stack(scene *s, gen_random *random, int32_t contacts)
{
    const int32_t side = gen_integer(random, 4) ? 2 : 3;
    const int32_t levels = at_least(contacts / (side * side), 1);
    double height = 0.0, x = 0.0, y = 0.0, a = 0.5, b = 0.5;
    int32_t k;

    for (k = 0; k < levels; k++) {
        double na = gen_uniform(random, 0.3, 0.6), nb = gen_uniform(random, 0.3, 0.6);
        double c = gen_uniform(random, 0.1, 0.4), fx, fy;
        int32_t box = scene_add_box(s, x, y, height + c, na, nb, c);

        fx = k ? fmin(a, na) : na; /* the face that both have */
        fy = k ? fmin(b, nb) : nb;
        add_rectangle(s, box - 1, box, x - fx, x + fx, y - fy, y + fy, height, side, side);
        height += 2 * c;
        a = na;
        b = nb;
    }
}

static void fill_pushed(scene *s, gen_random *random, int32_t contacts)
{
    const int32_t side1 = at_least((int32_t)sqrt((double)contacts), 2);
    const int32_t side2 = at_least(contacts / side1, 2);
    double c = gen_uniform(random, 0.1, 2.0);
    int32_t box = scene_add_box(s, 0, 0, c, 1.0, 0.5, c);

    if (gen_integer(random, 2)) { /* upon another one */
        int32_t top = scene_add_box(s, 0, 0, 2 * c + 0.2, 0.9, 0.4, 0.2);

        add_rectangle(s, SCENE_GROUND, box, -1, 1, -0.5, 0.5, 0, side1, at_least(side2 / 2, 2));
        add_rectangle(s, box, top, -0.9, 0.9, -0.4, 0.4, 2 * c, side1, at_least(side2 / 2, 2));
    } else {
        add_rectangle(s, SCENE_GROUND, box, -1, 1, -0.5, 0.5, 0, side1, side2);
    }
}

/* A block with two oblique faces, at +-angle from the vertical, and blocks on top of it. */
static void fill_wedge(scene *s, gen_random *random, int32_t contacts)
{
    const double angle = gen_uniform(random, 0.02, 1.4);
    const int32_t tops = gen_integer(random, 3);
    const int32_t side = at_least((contacts - 4 * tops) / 4, 1);
    int32_t block = scene_add_box(s, 0, 0, 1, 0.5, 0.5, 1), k;
    double height = 2.0;

    for (k = -1; k <= 1; k += 2) {
        const double corner[3] = {0.1 * k, -0.5, 0}, edge2[3] = {0, 1, 0};
        const double edge1[3] = {2 * k * sin(angle), 0, 2 * cos(angle)};
        const double normal[3] = {-k * cos(angle), 0, sin(angle)};

        scene_add_face(s, SCENE_GROUND, block, corner, edge1, edge2, normal, side, 2);
    }
    for (k = 0; k < tops; k++, height += 0.4) {
        int32_t top = scene_add_box(s, 0, 0, height + 0.2, 0.4, 0.4, 0.2);

        add_rectangle(s, top - 1, top, -0.4, 0.4, -0.4, 0.4, height, 2, 2);
    }
}

static void fill_table(scene *s, gen_random *random, int32_t contacts)
{
    const int32_t loads = 1 + gen_integer(random, 2), legs = at_least(contacts - 4 * loads, 3);
    int32_t table = scene_add_box(s, 0, 0, 1, 1, 1, 0.05), k;

    for (k = 0; k < legs; k++) {
        double angle = 6.28318530717958648 * k / legs;
        double foot[3];

        foot[0] = cos(angle);
        foot[1] = sin(angle);
        foot[2] = 0;
        scene_add_contact(s, SCENE_GROUND, table, foot, up);
    }
    for (k = 0; k < loads; k++) {
        double x = gen_uniform(random, -0.6, 0.6), y = gen_uniform(random, -0.6, 0.6);
        int32_t load = scene_add_box(s, x, y, 1.25, 0.2, 0.2, 0.2);

        add_rectangle(s, table, load, x - 0.2, x + 0.2, y - 0.2, y + 0.2, 1.05, 2, 2);
    }
}

/* Layers of bricks, each half a brick off the last; two points (planar) or four where two overlap.
 */
static void fill_wall(scene *s, gen_random *random, int32_t contacts, int32_t planar)
{
    const int32_t each = planar ? 2 : 4;
    const int32_t width = 2 + gen_integer(random, 4), pyramid = planar || gen_integer(random, 2);
    const double length = 1.0, height = 0.5;
    int32_t layer, below = 0, first_below = 0;

    for (layer = 0; s->contacts < contacts - each; layer++) {
        const int32_t bricks = pyramid ? width + 6 - layer : width + layer % 2;
        const double start = pyramid ? 0.5 * layer : layer % 2 ? 0.0 : 0.5;
        const int32_t first = s->bodies;
        int32_t k, j;

        if (bricks < 1)
            break;
        for (k = 0; k < bricks; k++) {
            double x = (start + k) * length, y = (layer + 0.5) * height;

            if (planar)
                scene_add_box(s, x, y, 0, 0.5 * length, 0.5 * height, 1);
            else
                scene_add_box(s, x, 0, y, 0.5 * length, 0.25, 0.5 * height);
        }
        for (k = 0; k < bricks; k++)
            for (j = 0; j < (layer ? below : 1); j++) {
                double x = (start + k) * length - 0.5 * length, x1 = x + length;
                double other = layer ? s->body[first_below + j].position[0] - 0.5 * length : x;

                x = fmax(x, other);
                x1 = fmin(x1, other + length);
                if (x1 - x < 0.1 * length)
                    continue;
                if (planar)
                    add_segment(s, layer ? first_below + j : SCENE_GROUND, first + k, x, x1,
                                layer * height);
                else
                    add_rectangle(s, layer ? first_below + j : SCENE_GROUND, first + k, x, x1,
                                  -0.25, 0.25, layer * height, 2, 2);
            }
        below = bricks;
        first_below = first;
    }
}

/* Three bars a layer, crossed from layer to layer: nine patches of four. */
static void fill_tower(scene *s, gen_random *random, int32_t contacts)
{
    const int32_t layers = at_least((contacts + 12) / 36, 1);
    int32_t layer, i, j;

    (void)random;
    for (layer = 0; layer <= layers; layer++) {
        const int32_t first = s->bodies;
        const double z = 0.2 * layer;

        if (layer == layers && s->contacts + 12 > contacts)
            break;
        for (i = 0; i < 3; i++)
            if (layer % 2)
                scene_add_box(s, 0, 0.4 * (i - 1), z + 0.1, 0.6, 0.2, 0.1);
            else
                scene_add_box(s, 0.4 * (i - 1), 0, z + 0.1, 0.2, 0.6, 0.1);
        for (i = 0; i < 3; i++) {
            double c = 0.4 * (i - 1);

            if (layer == 0)
                add_rectangle(s, SCENE_GROUND, first + i, c - 0.2, c + 0.2, -0.6, 0.6, z, 2, 2);
            for (j = 0; layer > 0 && j < 3; j++) {
                double x = layer % 2 ? 0.4 * (j - 1) : c, y = layer % 2 ? c : 0.4 * (j - 1);

                add_rectangle(s, first - 3 + j, first + i, x - 0.2, x + 0.2, y - 0.2, y + 0.2, z, 2,
                              2);
            }
        }
        if (s->contacts >= contacts)
            break;
    }
}

/* Balls of radius 1/2 in a square pyramid, each on four below; one contact a pair. */
static void fill_pile(scene *s, gen_random *random, int32_t contacts)
{
    int32_t side = 2, layer, i, j;
    int32_t below = 0;

    while ((side + 1) * (side + 1) + 2 * side * (side + 1) * (2 * side + 1) / 3 < contacts)
        side++;
    (void)random;
    for (layer = 0; side > 0; layer++, side--) {
        const int32_t first = s->bodies;

        for (i = 0; i < side; i++)
            for (j = 0; j < side; j++) {
                double x = i + 0.5 * layer, y = j + 0.5 * layer, z = 0.5 + layer * sqrt(0.5);
                int32_t ball = scene_add_box(s, x, y, z, 0.5, 0.5, 0.5), k;
                double foot[3], normal[3];

                foot[0] = x;
                foot[1] = y;
                foot[2] = 0;
                if (layer == 0)
                    scene_add_contact(s, SCENE_GROUND, ball, foot, up);
                for (k = 0; layer > 0 && k < 4; k++) {
                    int32_t under = below + (i + k / 2) * (side + 1) + j + k % 2, c;

                    for (c = 0; c < 3; c++) {
                        normal[c] = s->body[ball].position[c] - s->body[under].position[c];
                        foot[c] = s->body[under].position[c] + 0.5 * normal[c];
                    }
                    scene_add_contact(s, under, ball, foot, normal);
                }
            }
        below = first;
    }
}

static void fill_random(scene *s, gen_random *random, int32_t contacts, int32_t planar)
{
    const int32_t bodies = 2 + gen_integer(random, at_least(contacts / 2, 1));
    int32_t k, c;

    for (k = 0; k < bodies; k++) {
        double at[3], half[3];

        for (c = 0; c < 3; c++) {
            at[c] = planar && c == 2 ? 0.0 : gen_uniform(random, -1, 1);
            half[c] = gen_uniform(random, 0.2, 1);
        }
        scene_add_box(s, at[0], at[1], at[2], half[0], half[1], half[2]);
    }
    for (k = 0; k < contacts; k++) {
        int32_t a = gen_integer(random, bodies), b = gen_integer(random, bodies + 1) - 1;
        double point[3], normal[3];

        if (a == b)
            b = SCENE_GROUND;
        scene_unit(random, planar, normal);
        scene_unit(random, planar, point);
        for (c = 0; c < 3; c++)
            point[c] += s->body[a].position[c];
        scene_add_contact(s, b, a, point, normal);
    }
}

/* Stones between the angles of an arch; joints are radial, two points each. */
static void fill_arch(scene *s, gen_random *random, int32_t contacts)
{
    const int32_t stones = at_least(contacts / 2 - 1, 2);
    const double span = gen_uniform(random, 1.5, 3.1), inner = 1.0,
                 outer = gen_uniform(random, 1.05, 1.4), middle = 0.5 * (inner + outer);
    int32_t k;

    for (k = 0; k < stones; k++) {
        double angle = 1.5707963267948966 + span * ((k + 0.5) / stones - 0.5);

        scene_add_box(s, middle * cos(angle), middle * sin(angle), 0, 0.5 * (outer - inner),
                      0.5 * span * middle / stones, 1);
    }
    for (k = 0; k <= stones; k++) {
        double angle = 1.5707963267948966 + span * ((double)k / stones - 0.5), width;
        double corner[3] = {0, 0, 0}, edge[3] = {0, 0, 0}, normal[3] = {0, 0, 0};
        int32_t before = k == 0 ? SCENE_GROUND : k - 1, after = k == stones ? SCENE_GROUND : k;

        width = outer - inner;
        corner[0] = inner * cos(angle);
        corner[1] = inner * sin(angle);
        edge[0] = width * cos(angle);
        edge[1] = width * sin(angle);
        normal[0] = -sin(angle); /* onwards along the arch */
        normal[1] = cos(angle);
        scene_add_face(s, before, after, corner, edge, nowhere, normal, 2, 1);
    }
}

/* Pegs between two walls each, contacts on both sides at several depths, and a floor under some. */
static void fill_peg(scene *s, gen_random *random, int32_t contacts)
{
    const int32_t pegs = 1 + gen_integer(random, 4), depth = at_least(contacts / pegs / 2, 2);
    int32_t k, side;

    for (k = 0; k < pegs; k++) {
        double x = 2.0 * k;
        int32_t peg = scene_add_box(s, x, 0, 0, 0.3, 1, 1);
        int32_t wall = k > 0 && gen_integer(random, 2) ? peg - 1 : SCENE_GROUND;

        for (side = -1; side <= 1; side += 2) {
            const double corner[3] = {x + 0.3 * side, -0.9, 0}, edge[3] = {0, 1.2, 0};
            const double normal[3] = {-side, 0, 0};

            scene_add_face(s, side < 0 ? wall : SCENE_GROUND, peg, corner, edge, nowhere, normal,
                           depth, 1);
        }
        if (gen_integer(random, 2))
            add_segment(s, SCENE_GROUND, peg, x - 0.3, x + 0.3, -1);
    }
}

void scene_fill(scene *s, gen_random *random, int32_t class, int32_t contacts)
{
    s->planar = class >= SCENE_PLANAR_WALL;
    switch (class) {
    case SCENE_STACK:
        fill_stack(s, random, contacts);
        break;
    case SCENE_PUSHED:
        fill_pushed(s, random, contacts);
        break;
    case SCENE_WEDGE:
        fill_wedge(s, random, contacts);
        break;
    case SCENE_TABLE:
        fill_table(s, random, contacts);
        break;
    case SCENE_WALL:
    case SCENE_PLANAR_WALL:
        fill_wall(s, random, contacts, s->planar);
        break;
    case SCENE_TOWER:
        fill_tower(s, random, contacts);
        break;
    case SCENE_PILE:
        fill_pile(s, random, contacts);
        break;
    case SCENE_PLANAR_ARCH:
        fill_arch(s, random, contacts);
        break;
    case SCENE_PLANAR_PEG:
        fill_peg(s, random, contacts);
        break;
    default:
        fill_random(s, random, contacts, s->planar);
        break;
    }
}
