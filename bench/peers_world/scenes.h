/* scenes.h: the scenes of the dial, in metres, kilograms and seconds. */
#ifndef BENCH_SCENES_H
#define BENCH_SCENES_H

#include "scene.h"

static inline scene_body *scene_add(scene *s, int sphere, const double *half, double mass, double x,
                                    double y, double z)
{
    if (s->count == s->room) {
        s->room = 2 * s->room + 16;
        s->bodies = (scene_body *)realloc(s->bodies, (size_t)s->room * sizeof *s->bodies);
        if (!s->bodies)
            exit(1);
    }
    scene_body *body = &s->bodies[s->count++];
    memset(body, 0, sizeof *body);
    body->sphere = sphere;
    body->mass = mass;
    memcpy(body->half, half, 3 * sizeof *half);
    body->position[0] = x;
    body->position[1] = s->planar ? z : y;
    body->position[2] = s->planar ? 0 : z;
    body->orientation[0] = 1;
    return body;
}

static const double scene_cube[] = {0.5, 0.5, 0.5};

static inline void scene_boxes(scene *s, int across, int along, double speed)
{
    for (int i = 0; i < along; i++)
        for (int j = 0; j < across; j++)
            scene_add(s, 0, scene_cube, 1, 2.0 * i, 2.0 * j, 0.5)->velocity[0] = speed;
}

static inline void scene_pyramid(scene *s, int base, double x, double y)
{
    for (int i = 0; i < base; i++)
        for (int j = 0; j < base - i; j++)
            scene_add(s, 0, scene_cube, 1, x + 1.02 * (j + 0.5 * i) - 0.51 * base, y, 0.5 + i);
}

static inline void scene_wall(scene *s)
{
    static const double brick[] = {0.5, 0.25, 0.25};
    s->gravity[0] = 0.12 * 9.81;
    for (int i = 0; i < 9; i++)
        for (int j = 0; j < 14; j++)
            scene_add(s, 0, brick, 1, 1.02 * j + (i % 2 ? 0.2 : 0), 0, 0.25 + 0.5 * i);
}

/* Cards of 0.9 m by 0.6 m by 1 cm, leaning at 15 degrees; those that lie on them are shorter, with
 * 2 mm between them: they would lie in each other. */
static inline void scene_cards(scene *s, int levels)
{
    const double length = 0.9, thick = 0.01, lean = 15 * 3.14159265358979323846 / 180;
    const double width = 2 * (length * sin(lean) + thick * cos(lean));
    const double height = length * cos(lean) + thick * sin(lean);
    const double standing[] = {thick / 2, 0.3, length / 2},
                 lying[] = {width / 2 - 0.001, 0.3, thick / 2};
    double z = 0;
    for (int count = levels; count > 0; count--) {
        for (int c = 0; c < 2 * count; c++) {
            const int side = c % 2 ? 1 : -1;
            const double foot = length / 2 * sin(lean) + thick / 2 * cos(lean);
            scene_body *card =
                scene_add(s, 0, standing, 1, (c / 2 - (count - 1) / 2.0) * width + side * foot, 0,
                          z + height / 2);
            card->orientation[0] = cos(lean / 2);
            card->orientation[2] = -side * sin(lean / 2);
        }
        z += height;
        for (int c = 0; c < count - 1; c++)
            scene_add(s, 0, lying, 1, (c - (count - 2) / 2.0) * width, 0, z + thick / 2);
        z += thick;
    }
}

static inline double scene_random(unsigned *seed)
{
    *seed = *seed * 1664525u + 1013904223u;
    return (*seed >> 8) / 16777216.0;
}

/* Spheres above a shaft with a floor of 10 m by 10 m. */
static inline void scene_heap(scene *s, int spheres)
{
    const double side[] = {0.5, 6, 15}, front[] = {6, 0.5, 15};
    unsigned seed = 1;
    for (int k = -1; k <= 1; k += 2) {
        scene_add(s, 0, side, 0, 5.5 * k, 0, 15);
        scene_add(s, 0, front, 0, 0, 5.5 * k, 15);
    }
    for (int i = 0; i < spheres; i++) {
        const double x = 0.1 * (scene_random(&seed) - 0.5), y = 0.1 * (scene_random(&seed) - 0.5);
        scene_add(s, 1, scene_cube, 1, (i % 8 - 3.5) * 1.15 + x, (i / 8 % 8 - 3.5) * 1.15 + y,
                  0.6 + 1.15 * (i / 64));
    }
}

static inline void scene_column(scene *s, int boxes, double last)
{
    for (int i = 0; i < boxes; i++)
        scene_add(s, 0, scene_cube, i + 1 < boxes ? 1 : last, 0, 0, 0.5 + i);
}

/* Heaps of ten boxes next to each other. */
static inline void scene_heaps(scene *s, int heaps)
{
    const int row = (int)sqrt((double)heaps);
    for (int i = 0; i < heaps; i++)
        scene_pyramid(s, 4, 6.0 * (i % row), 3.0 * (i / row));
}

static inline void scene_free(scene *s, int bodies)
{
    const int row = (int)cbrt((double)bodies);
    for (int i = 0; i < bodies; i++)
        scene_add(s, 0, scene_cube, 1, 3.0 * (i % row), 3.0 * (i / row % row),
                  100 + 3.0 * (i / row / row));
}

/* A cube of spheres 2 cm apart that shake against each other and fall. */
static inline void scene_packed(scene *s, int spheres)
{
    const int row = (int)ceil(cbrt((double)spheres));
    unsigned seed = 1;
    for (int i = 0; i < spheres; i++) {
        scene_body *sphere = scene_add(s, 1, scene_cube, 1, 1.02 * (i % row),
                                       1.02 * (i / row % row), 0.52 + 1.02 * (i / row / row));
        for (int k = 0; k < 3; k++)
            sphere->velocity[k] = scene_random(&seed) - 0.5;
    }
}

static inline void scene_hit(scene *s)
{
    scene_pyramid(s, 20, 0, 0);
    scene_add(s, 1, scene_cube, 20, -0.51 * 20 + 1.02 * 1.5 - 1.6, 0.1, 3.6)->velocity[0] = 30;
}

static const char *const scene_names[] = {
    "slide",      "slide_planar",   "rest",        "rest_planar",  "separate",  "separate_rest",
    "pyramid",    "pyramid_planar", "hit",         "heap",         "wall",      "stack",
    "cards",      "tower_1e4",      "tower_1e8",   "tower_1e12",   "free_1000", "free_100000",
    "heaps_1000", "heaps_100000",   "packed_1000", "packed_100000"};

/* 0 if there is no scene of that name. */
static inline int scene_make(scene *s, const char *name)
{
    const int down = strstr(name, "planar") ? 1 : 2;
    memset(s, 0, sizeof *s);
    snprintf(s->name, sizeof s->name, "%s", name);
    s->planar = down == 1;
    s->at_rest = 1;
    s->steps = 300;
    s->h = 0.01;
    s->friction = 0.6;
    s->gravity[down] = -9.81;
    if (!strncmp(name, "slide", 5) || !strcmp(name, "separate")) {
        s->at_rest = 0;
        const int side = name[1] == 'l' ? 1 : 32;
        s->friction = 0.05;
        scene_boxes(s, side, side, 3);
    } else if (!strncmp(name, "rest", 4)) {
        scene_boxes(s, 1, 1, 0);
    } else if (!strcmp(name, "separate_rest")) {
        scene_boxes(s, 32, 32, 0);
    } else if (!strncmp(name, "pyramid", 7)) {
        scene_pyramid(s, 20, 0, 0);
    } else if (!strcmp(name, "hit")) {
        s->at_rest = 0;
        s->steps = 100;
        scene_hit(s);
    } else if (!strcmp(name, "heap")) {
        s->at_rest = 0;
        s->friction = 0.5;
        scene_heap(s, 1000);
    } else if (!strcmp(name, "wall")) {
        scene_wall(s);
    } else if (!strcmp(name, "stack")) {
        scene_column(s, 20, 1);
    } else if (!strcmp(name, "cards")) {
        s->friction = 0.5;
        scene_cards(s, 3);
    } else if (!strncmp(name, "tower_", 6)) {
        scene_column(s, 4, atof(name + 6));
    } else if (!strncmp(name, "free_", 5)) {
        s->at_rest = 0;
        s->steps = 10;
        scene_free(s, atoi(name + 5));
    } else if (!strncmp(name, "heaps_", 6)) {
        s->steps = 10;
        scene_heaps(s, atoi(name + 6) / 10);
    } else if (!strncmp(name, "packed_", 7)) {
        s->at_rest = 0;
        s->steps = 20;
        scene_packed(s, atoi(name + 7));
    }
    return s->count > 0;
}

#endif
