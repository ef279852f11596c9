/* motion.h: a scene in motion as text, which every engine reads, and the loop that times its steps.
 * C99 and C++11. bench/motion_scenes.py writes the text, numbers apart from the name:
 *
 *   scene NAME planar steps h friction gx gy gz bodies joints
 *   a body:   shape mass I1 I2 I3  x y z  qw qx qy qz  vx vy vz  driven Ax Ay Az omega  n ...
 *   a joint:  kind a b  x y z  axis  lower upper speed force
 *
 * Shape 0 is a box of n = 3 half lengths, 1 a sphere of n = 1 radius, 2 a hull of n / 3 corners.
 * Mass 0: static, or driven with the velocity A omega cos(omega t). Kind 0 is a ball, 1 a hinge; b
 * = -1 is the ground; no limits unless lower < upper. Ground is the half-space z <= 0, of planar
 * scenes y <= 0. */
#ifndef BENCH_MOTION_H
#define BENCH_MOTION_H

#include "scene.h"

enum { MOTION_BOX, MOTION_SPHERE, MOTION_HULL };
enum { MOTION_BALL, MOTION_HINGE };

typedef struct motion_body {
    int shape, driven, count;
    double mass, inertia[3], position[3], orientation[4], velocity[3], way[3], omega;
    double *size; /* count numbers */
} motion_body;

typedef struct motion_joint {
    int kind, a, b;
    double anchor[3], axis[3], lower, upper, speed, force;
} motion_joint;

typedef struct motion_scene {
    char name[32];
    int planar, steps, bodies, joints;
    double h, friction, gravity[3];
    motion_body *body;
    motion_joint *joint;
} motion_scene;

static inline void motion_end(const char *why)
{
    fprintf(stderr, "bench: %s\n", why);
    exit(1);
}

static inline void motion_numbers(FILE *file, double *numbers, int count)
{
    for (int k = 0; k < count; k++)
        if (fscanf(file, "%lf", &numbers[k]) != 1)
            motion_end("the scene ends early");
}

static inline int motion_integer(FILE *file)
{
    double number = 0;
    motion_numbers(file, &number, 1);
    return (int)number;
}

static inline void *motion_memory(int count, size_t size)
{
    void *memory = calloc((size_t)count + 1, size);
    if (!memory)
        motion_end("not enough memory");
    return memory;
}

static inline void motion_read_body(motion_body *b, FILE *file)
{
    b->shape = motion_integer(file);
    motion_numbers(file, &b->mass, 1);
    motion_numbers(file, b->inertia, 3);
    motion_numbers(file, b->position, 3);
    motion_numbers(file, b->orientation, 4);
    motion_numbers(file, b->velocity, 3);
    b->driven = motion_integer(file);
    motion_numbers(file, b->way, 3);
    motion_numbers(file, &b->omega, 1);
    b->count = motion_integer(file);
    b->size = (double *)motion_memory(b->count, sizeof *b->size);
    motion_numbers(file, b->size, b->count);
}

static inline void motion_read_joint(motion_joint *j, FILE *file)
{
    j->kind = motion_integer(file);
    j->a = motion_integer(file);
    j->b = motion_integer(file);
    motion_numbers(file, j->anchor, 3);
    motion_numbers(file, j->axis, 3);
    motion_numbers(file, &j->lower, 1);
    motion_numbers(file, &j->upper, 1);
    motion_numbers(file, &j->speed, 1);
    motion_numbers(file, &j->force, 1);
}

static inline void motion_read(motion_scene *s, const char *path)
{
    FILE *file = fopen(path, "r");
    memset(s, 0, sizeof *s);
    if (!file || fscanf(file, " scene %31s", s->name) != 1)
        motion_end("no scene");
    s->planar = motion_integer(file);
    s->steps = motion_integer(file);
    motion_numbers(file, &s->h, 1);
    motion_numbers(file, &s->friction, 1);
    motion_numbers(file, s->gravity, 3);
    s->bodies = motion_integer(file);
    s->joints = motion_integer(file);
    s->body = (motion_body *)motion_memory(s->bodies, sizeof *s->body);
    s->joint = (motion_joint *)motion_memory(s->joints, sizeof *s->joint);
    for (int i = 0; i < s->bodies; i++)
        motion_read_body(&s->body[i], file);
    for (int i = 0; i < s->joints; i++)
        motion_read_joint(&s->joint[i], file);
    fclose(file);
}

static inline void motion_free(motion_scene *s)
{
    for (int i = 0; i < s->bodies; i++)
        free(s->body[i].size);
    free(s->body);
    free(s->joint);
}

/* Velocity of a driven body in the middle of a step. */
static inline void motion_velocity(const motion_scene *s, const motion_body *b, int step,
                                   double velocity[3])
{
    for (int k = 0; k < 3; k++)
        velocity[k] = b->way[k] * b->omega * cos(b->omega * (step + 0.5) * s->h);
}

/* What an engine does for the loop: prepare what is driven, step, look at what came out. */
typedef struct motion_engine {
    void *object;
    void (*prepare)(void *object, int step);
    void (*step)(void *object);
    void (*look)(void *object, int begun); /* begun: not in the first tenth of the steps */
    double (*energy)(void *object);
} motion_engine;

/* Steps for about `seconds` of processor time at the most, and prints what steps took, in
 * milliseconds, and the energy at both ends; the line is left open. */
static inline void motion_play(const motion_scene *s, const char *setting, motion_engine *e,
                               double seconds)
{
    double *times = (double *)motion_memory(s->steps, sizeof *times), sum = 0;
    const double begin = e->energy(e->object);
    int done = 0;
    while (done < s->steps && sum < seconds) {
        e->prepare(e->object, done);
        const double start = processor_seconds();
        e->step(e->object);
        times[done] = processor_seconds() - start;
        sum += times[done++];
        e->look(e->object, 10 * done > s->steps);
    }
    if (done == 0)
        motion_end("no step");
    qsort(times, (size_t)done, sizeof *times, scene_compare);
    printf("%s %s steps %d mean %.4g median %.4g p99 %.4g max %.4g energy %.5g %.5g", s->name,
           setting, done, 1e3 * sum / done, 1e3 * times[done / 2],
           1e3 * times[(int)(0.99 * (done - 1))], 1e3 * times[done - 1], begin,
           e->energy(e->object));
    free(times);
}

#endif
