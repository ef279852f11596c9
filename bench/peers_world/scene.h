/* scene.h: a scene as lines of text, which every engine reads, and the loop that times an engine
 * and records what it did. C99 and C++11.
 *
 * Text: a line 'scene NAME planar at_rest steps h friction gx gy gz bodies', then a line a body:
 * 'sphere mass hx hy hz  x y z  qw qx qy qz  vx vy vz'; mass 0: static. Ground is the half-space
 * z <= 0, of planar scenes y <= 0 (then hz is half a thickness that means nothing).
 * A record: 13 doubles a body and step, the beginning included: position, orientation (w,x,y,z),
 * velocity, angular velocity, of the mass centre and in the world's frame. */
#ifndef BENCH_SCENE_H
#define BENCH_SCENE_H

#ifndef _POSIX_C_SOURCE
#define _POSIX_C_SOURCE 200809L
#endif

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef struct scene_body {
    int sphere; /* of radius half[0] */
    double mass, half[3], position[3], orientation[4], velocity[3];
} scene_body;

typedef struct scene {
    char name[32];
    int planar, at_rest, steps, count, room;
    double h, friction, gravity[3];
    scene_body *bodies;
} scene;

static inline void scene_inertia(const scene_body *body, double inertia[3])
{
    for (int k = 0; k < 3; k++) {
        const double a = body->half[(k + 1) % 3], b = body->half[(k + 2) % 3];
        inertia[k] = body->sphere ? 0.4 * body->mass * body->half[0] * body->half[0]
                                  : body->mass / 3 * (a * a + b * b);
    }
}

static inline int scene_read(scene *s, FILE *file)
{
    memset(s, 0, sizeof *s);
    if (fscanf(file, " scene %31s %d %d %d %lf %lf %lf %lf %lf %d", s->name, &s->planar,
               &s->at_rest, &s->steps, &s->h, &s->friction, &s->gravity[0], &s->gravity[1],
               &s->gravity[2], &s->count) != 10)
        return 0;
    s->bodies = (scene_body *)calloc((size_t)s->count, sizeof *s->bodies);
    for (int i = 0; i < s->count && s->bodies; i++) {
        scene_body *b = &s->bodies[i];
        if (fscanf(file, "%d %lf %lf %lf %lf %lf %lf %lf %lf %lf %lf %lf %lf %lf %lf", &b->sphere,
                   &b->mass, &b->half[0], &b->half[1], &b->half[2], &b->position[0],
                   &b->position[1], &b->position[2], &b->orientation[0], &b->orientation[1],
                   &b->orientation[2], &b->orientation[3], &b->velocity[0], &b->velocity[1],
                   &b->velocity[2]) != 15)
            return 0;
    }
    return s->bodies != NULL;
}

static inline void scene_write(const scene *s, FILE *file)
{
    fprintf(file, "scene %s %d %d %d %.17g %.17g %.17g %.17g %.17g %d\n", s->name, s->planar,
            s->at_rest, s->steps, s->h, s->friction, s->gravity[0], s->gravity[1], s->gravity[2],
            s->count);
    for (int i = 0; i < s->count; i++) {
        const scene_body *b = &s->bodies[i];
        fprintf(file, "%d %.17g %.17g %.17g %.17g", b->sphere, b->mass, b->half[0], b->half[1],
                b->half[2]);
        for (int k = 0; k < 3; k++)
            fprintf(file, " %.17g", b->position[k]);
        for (int k = 0; k < 4; k++)
            fprintf(file, " %.17g", b->orientation[k]);
        for (int k = 0; k < 3; k++)
            fprintf(file, " %.17g", b->velocity[k]);
        fputc('\n', file);
    }
}

/* What an engine does for the loop. */
typedef void (*scene_step)(void *engine, double h);
typedef void (*scene_state)(void *engine, int body, double state[13]);

static inline double processor_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static inline int scene_compare(const void *left, const void *right)
{
    const double a = *(const double *)left, b = *(const double *)right;
    return (a > b) - (a < b);
}

static inline double scene_median(double *numbers, int count)
{
    qsort(numbers, (size_t)count, sizeof *numbers, scene_compare);
    return numbers[count / 2];
}

/* What two looks at the clock cost. */
static inline double clock_cost(void)
{
    double cost[201];
    for (int k = 0; k < 201; k++) {
        const double start = processor_seconds();
        cost[k] = processor_seconds() - start;
    }
    return scene_median(cost, 201);
}

static inline void scene_record(const scene *s, void *engine, scene_state state, FILE *record)
{
    double numbers[13];
    for (int i = 0; i < s->count && record; i++) {
        state(engine, i, numbers);
        fwrite(numbers, sizeof *numbers, 13, record);
    }
}

/* Steps and records the scene, each step in parts of the engine's own, for about `seconds` of
 * processor time at the most; prints what a step took: 'time median mean steps', in milliseconds.
 */
static inline void scene_play(const scene *s, void *engine, scene_step step, scene_state state,
                              FILE *record, double seconds, int parts)
{
    double *times = (double *)malloc((size_t)s->steps * sizeof *times);
    const double cost = clock_cost();
    double sum = 0;
    int done = 0;
    scene_record(s, engine, state, record);
    while (times && done < s->steps && (sum < seconds || done < 3)) {
        const double start = processor_seconds();
        for (int k = 0; k < parts; k++)
            step(engine, s->h / parts);
        times[done] = processor_seconds() - start - cost;
        sum += times[done++];
        scene_record(s, engine, state, record);
    }
    if (done > 0)
        printf("time %.6g %.6g %d\n", 1e3 * scene_median(times, done), 1e3 * sum / done, done);
    free(times);
}

/* The way every peer is called: ENGINE TIMES SECONDS RECORD [PARTS] < scene; a step has TIMES its
 * iterations, and is PARTS steps of the engine, 1 by default. */
static inline FILE *scene_open(scene *s, int argc, char **argv)
{
    FILE *record = argc == 4 || argc == 5 ? fopen(argv[3], "wb") : NULL;
    if (!record || !scene_read(s, stdin)) {
        fprintf(stderr, "usage: %s TIMES SECONDS RECORD [PARTS] < scene\n", argv[0]);
        exit(2);
    }
    return record;
}

#endif
