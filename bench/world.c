/* The dial: what a step of the world costs, and how far from the truth it is.
 *
 *   world scene NAME                                  the scene as text, for other engines
 *   world play NAME ACCURACY SUBSTEPS SECONDS [RECORD] time a step, and what it consists of
 *   world judge NAME RECORD                           how true a record of perp's or theirs is
 *
 * peers_world/scene.h says what a record is; bench/world.py runs it all and draws. */
#include "measure.h"
#include "peers_world/scenes.h"

#include <sys/resource.h>

#define SAMPLES 5  /* steps of a moving scene that are compared with the exact one */
#define PATIENCE 1 /* seconds for each of them */
#define ENOUGH 10  /* and for all: after that no other one is begun */
#define SHIFT 1e-9 /* of velocities, for a second answer where the exact one is not solved; */
#define DOUBTS 3   /* an error counts from so many times the distance between the two on */

typedef struct engine {
    perp_context *context;
    perp_world *world;
    const scene *scene;
    perp_body *bodies;
    perp_step_result result;
    int good, limited, other; /* steps by their outcome */
    double residual;
} engine;

static void check(const engine *e, perp_status status)
{
    require(status == PERP_OK, perp_context_message(e->context));
}

static void add(engine *e, const scene_body *from, perp_body *body)
{
    perp_body_settings settings;
    perp_shape_settings shape;
    double inertia[3];
    check(e, perp_body_settings_init(&settings, sizeof settings));
    check(e, perp_shape_settings_init(&shape, sizeof shape));
    settings.kind = from->mass > 0 ? PERP_BODY_DYNAMIC : PERP_BODY_STATIC;
    settings.mass = from->mass;
    scene_inertia(from, inertia);
    for (int k = 0; k < 3; k++)
        settings.inertia[4 * k] = e->scene->planar && k < 2 ? 0 : inertia[k];
    memcpy(settings.position, from->position, sizeof settings.position);
    memcpy(settings.orientation, from->orientation, sizeof settings.orientation);
    memcpy(settings.velocity, from->velocity, sizeof settings.velocity);
    check(e, perp_world_add_body(e->world, body, &settings));
    check(e, from->sphere ? perp_world_add_sphere(e->world, NULL, *body, from->half[0], &shape)
                          : perp_world_add_box(e->world, NULL, *body, from->half, &shape));
}

static void create(engine *e, const scene *s, int32_t accuracy, int32_t substeps, double tol)
{
    double up[] = {0, 0, 0};
    perp_world_settings settings;
    memset(e, 0, sizeof *e);
    e->scene = s;
    require(perp_context_create(&e->context, NULL) == PERP_OK, "no context");
    check(e, perp_world_settings_init(&settings, sizeof settings, s->planar));
    memcpy(settings.gravity, s->gravity, sizeof settings.gravity);
    settings.friction = s->friction;
    settings.accuracy = accuracy;
    settings.wakeful = strncmp(s->name, "rest", 4) != 0; /* nothing is skipped but in these */
    settings.substeps = substeps;
    settings.tol = tol;
    if (tol > 0)
        settings.time_limit = PATIENCE;
    check(e, perp_world_create(e->context, &e->world, &settings));
    up[s->planar ? 1 : 2] = 1;
    check(e, perp_world_add_plane(e->world, NULL, perp_world_ground(e->world), up, 0, NULL));
    e->bodies = require_memory((size_t)s->count * sizeof *e->bodies);
    for (int i = 0; i < s->count; i++)
        add(e, &s->bodies[i], &e->bodies[i]);
    check(e, perp_struct_init(&e->result, sizeof e->result));
}

static void destroy(engine *e)
{
    perp_world_destroy(e->world);
    perp_context_destroy(e->context);
    free(e->bodies);
}

static void step(void *object, double h)
{
    engine *e = object;
    check(e, perp_world_step(e->world, &e->result, h));
    const int good = e->result.outcome == PERP_OUTCOME_SOLVED ||
                     e->result.outcome == PERP_OUTCOME_ROUNDING_LIMIT;
    const int limit = e->result.outcome == PERP_OUTCOME_ITERATION_LIMIT;
    e->good += good;
    e->limited += limit;
    e->other += !good && !limit;
    e->residual = fmax(e->residual, e->result.residual);
}

static void read_state(void *object, int body, double state[13])
{
    engine *e = object;
    perp_body_state now;
    check(e, perp_body_state_init(&now, sizeof now));
    check(e, perp_world_get_body(e->world, &now, e->bodies[body]));
    if (e->scene->planar) {
        const double turn[] = {cos(now.angle / 2), 0, 0, sin(now.angle / 2)};
        memcpy(now.orientation, turn, sizeof turn);
    }
    memcpy(state, now.position, sizeof now.position);
    memcpy(state + 3, now.orientation, sizeof now.orientation);
    memcpy(state + 7, now.velocity, sizeof now.velocity);
    memcpy(state + 10, now.angular_velocity, sizeof now.angular_velocity);
}

static void write_state(engine *e, int body, const double state[13])
{
    perp_body_state now;
    double size = 0;
    if (e->scene->bodies[body].mass <= 0)
        return;
    check(e, perp_body_state_init(&now, sizeof now));
    memcpy(now.position, state, sizeof now.position);
    memcpy(now.velocity, state + 7, sizeof now.velocity);
    memcpy(now.angular_velocity, state + 10, sizeof now.angular_velocity);
    for (int k = 0; k < 4; k++)
        size += state[3 + k] * state[3 + k];
    for (int k = 0; k < 4; k++)
        now.orientation[k] = state[3 + k] / sqrt(size);
    if (e->scene->planar) {
        now.angle = 2 * atan2(state[6], state[3]);
        now.position[2] = now.velocity[2] = 0;
        now.angular_velocity[0] = now.angular_velocity[1] = 0;
    }
    check(e, perp_world_set_body(e->world, &now, e->bodies[body]));
}

static long memory(void) /* kB that the process had at most */
{
    struct rusage usage;
    return getrusage(RUSAGE_SELF, &usage) == 0 ? usage.ru_maxrss : 0;
}

static void play(const scene *s, int32_t accuracy, int32_t substeps, double seconds, FILE *record)
{
    engine e;
    perp_world_stats stats;
    const long before = memory();
    if (s->count < 10) { /* a world to be thrown away: of one box, pages new to us were the mean */
        create(&e, s, accuracy, substeps, 0);
        step(&e, s->h);
        destroy(&e);
    }
    create(&e, s, accuracy, substeps, 0);
    scene_play(s, &e, step, read_state, record, seconds, 1);
    check(&e, perp_struct_init(&stats, sizeof stats));
    check(&e, perp_world_get_stats(e.world, &stats));
    const double each = 1e3 / (double)stats.steps;
    printf("phases %.4g %.4g %.4g %.4g\n", each * stats.seconds_collide, each * stats.seconds_solve,
           each * stats.seconds_integrate, each * stats.seconds_project);
    printf("outcomes %d %d %d %.2g\ncontacts %d\n", e.good, e.limited, e.other, e.residual,
           (int)stats.contacts);
    printf("memory %ld\n", memory() - before);
    destroy(&e);
}

/* Rotation of a state, row-major. */
static void rotation_of(const double *state, double R[3][3])
{
    const double w = state[3], x = state[4], y = state[5], z = state[6];
    const double s = 2 / (w * w + x * x + y * y + z * z);
    const double rows[3][3] = {{1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)},
                               {s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)},
                               {s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)}};
    memcpy(R, rows, sizeof rows);
}

/* m |v|^2 + w'Iw of a twist v, w of a body in this state. */
static double metric(const scene_body *body, const double *state, const double *v, const double *w)
{
    double inertia[3], R[3][3], sum = 0;
    scene_inertia(body, inertia);
    rotation_of(state, R);
    for (int k = 0; k < 3; k++) {
        const double spin = R[0][k] * w[0] + R[1][k] * w[1] + R[2][k] * w[2];
        sum += body->mass * v[k] * v[k] + inertia[k] * spin * spin;
    }
    return sum;
}

static double energy(const scene *s, const double *states)
{
    double sum = 0;
    for (int i = 0; i < s->count; i++) {
        const double *x = states + 13 * i;
        if (s->bodies[i].mass <= 0)
            continue;
        sum += 0.5 * metric(&s->bodies[i], x, x + 7, x + 10);
        for (int k = 0; k < 3; k++)
            sum -= s->bodies[i].mass * s->gravity[k] * x[k];
    }
    return sum;
}

/* Half the extent of a shape along an axis of length 1. */
static double reach(const scene_body *body, double R[3][3], const double *axis)
{
    double sum = 0;
    for (int k = 0; k < 3 && !body->sphere; k++)
        sum += body->half[k] * fabs(R[0][k] * axis[0] + R[1][k] * axis[1] + R[2][k] * axis[2]);
    return body->sphere ? body->half[0] : sum;
}

static double overlap_along(const scene *s, const double *states, int i, int j, const double *axis)
{
    const double *a = states + 13 * i, *b = states + 13 * j;
    double R[3][3], Q[3][3], way = 0, size = 0;
    for (int k = 0; k < 3; k++) {
        size += axis[k] * axis[k];
        way += axis[k] * (b[k] - a[k]);
    }
    if (size < 1e-6)
        return INFINITY; /* parallel edges */
    const double unit[] = {axis[0] / sqrt(size), axis[1] / sqrt(size), axis[2] / sqrt(size)};
    rotation_of(a, R);
    rotation_of(b, Q);
    return reach(&s->bodies[i], R, unit) + reach(&s->bodies[j], Q, unit) - fabs(way) / sqrt(size);
}

/* How deep two shapes overlap: along the best of the axes that can separate boxes; of spheres, from
 * the nearest point of the other. Negative: apart. */
static double overlap(const scene *s, const double *states, int i, int j)
{
    const double *a = states + 13 * i, *b = states + 13 * j;
    const int turned = s->bodies[i].sphere && !s->bodies[j].sphere;
    double R[3][3], Q[3][3], axis[3], least = INFINITY;
    if (turned)
        return overlap(s, states, j, i);
    rotation_of(a, R);
    rotation_of(b, Q);
    if (s->bodies[j].sphere) { /* and the other one a sphere or a box */
        for (int k = 0; k < 3; k++)
            axis[k] = b[k] - a[k];
        for (int k = 0; k < 3 && !s->bodies[i].sphere; k++) {
            const double along =
                R[0][k] * (b[0] - a[0]) + R[1][k] * (b[1] - a[1]) + R[2][k] * (b[2] - a[2]);
            const double inside = fmax(fmin(along, s->bodies[i].half[k]), -s->bodies[i].half[k]);
            for (int c = 0; c < 3; c++)
                axis[c] -= R[c][k] * inside;
        }
        const double way = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
        return s->bodies[j].half[0] + (s->bodies[i].sphere ? s->bodies[i].half[0] : 0) - way;
    }
    for (int k = 0; k < 15; k++) {
        const int p = (k - 6) / 3, q = (k - 6) % 3;
        for (int c = 0; c < 3; c++)
            axis[c] = k < 3   ? R[c][k]
                      : k < 6 ? Q[c][k - 3]
                              : R[(c + 1) % 3][p] * Q[(c + 2) % 3][q] -
                                    R[(c + 2) % 3][p] * Q[(c + 1) % 3][q];
        least = fmin(least, overlap_along(s, states, i, j, axis));
    }
    return least;
}

static double radius(const scene_body *body)
{
    return body->sphere ? body->half[0]
                        : sqrt(body->half[0] * body->half[0] + body->half[1] * body->half[1] +
                               body->half[2] * body->half[2]);
}

/* The deepest overlap of all pairs, and with the ground. */
static double penetration(const scene *s, const double *states)
{
    double up[] = {0, 0, 0}, R[3][3], most = 0;
    up[s->planar ? 1 : 2] = 1;
    for (int i = 0; i < s->count; i++) {
        const double *a = states + 13 * i;
        if (s->bodies[i].mass > 0) {
            rotation_of(a, R);
            most = fmax(most, reach(&s->bodies[i], R, up) - a[s->planar ? 1 : 2]);
        }
        for (int j = 0; j < i; j++) {
            const double *b = states + 13 * j, sum = radius(&s->bodies[i]) + radius(&s->bodies[j]);
            const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
            if (x * x + y * y + z * z < sum * sum && s->bodies[i].mass + s->bodies[j].mass > 0)
                most = fmax(most, overlap(s, states, i, j));
        }
    }
    return most;
}

/* The exact step from `states`, velocities times 1 + shift: into v, 6 a body. */
static int exact_step(engine *exact, const double *states, double shift, double *v)
{
    const scene *s = exact->scene;
    double now[13];
    for (int i = 0; i < s->count; i++) {
        memcpy(now, states + 13 * i, sizeof now);
        for (int k = 7; k < 13; k++)
            now[k] *= 1 + shift;
        write_state(exact, i, now);
    }
    check(exact, perp_world_step(exact->world, &exact->result, s->h));
    for (int i = 0; i < s->count; i++) {
        read_state(exact, i, now);
        memcpy(v + 6 * i, now + 7, 6 * sizeof *v);
    }
    return exact->result.outcome == PERP_OUTCOME_SOLVED ||
           exact->result.outcome == PERP_OUTCOME_ROUNDING_LIMIT;
}

/* |v - w| in the kinetic metric. */
static double distance(const scene *s, const double *states, const double *v, const double *w)
{
    double sum = 0, off[6];
    for (int i = 0; i < s->count; i++) {
        for (int k = 0; k < 6; k++)
            off[k] = v[6 * i + k] - w[6 * i + k];
        if (s->bodies[i].mass > 0)
            sum += metric(&s->bodies[i], states + 13 * i, off, off + 3);
    }
    return sqrt(sum);
}

/* The step from one state to the next, beside the exact one from there: the error of velocities
 * over what contacts change, both in the kinetic metric; -1 if the exact one is not known. What is
 * not solved to the end is known as well as it agrees with the same from a state that is hardly
 * another. */
static double step_error(engine *exact, const double *states, const double *after)
{
    const scene *s = exact->scene;
    double *v[4], wrong, change, doubt = 0;
    for (int k = 0; k < 4; k++)
        v[k] = require_memory(6 * (size_t)s->count * sizeof **v);
    const int solved = exact_step(exact, states, 0, v[0]);
    if (!solved)
        exact_step(exact, states, SHIFT, v[1]);
    for (int i = 0; i < s->count; i++)
        for (int k = 0; k < 6; k++) {
            v[2][6 * i + k] = after[13 * i + 7 + k];
            v[3][6 * i + k] = states[13 * i + 7 + k] + (k < 3 ? s->h * s->gravity[k] : 0);
        }
    doubt = solved ? 0 : distance(s, states, v[0], v[1]);
    wrong = distance(s, states, v[2], v[0]);
    change = distance(s, states, v[3], v[0]);
    for (int k = 0; k < 4; k++)
        free(v[k]);
    if (wrong < DOUBTS * doubt)
        return -1;
    return change > 0 ? wrong / change : 0;
}

typedef struct record {
    double *states; /* 13 a body and step */
    int steps;      /* the beginning is not one */
    size_t stride;
} record;

static record read_record(const scene *s, const char *path)
{
    record r = {NULL, -1, 13 * (size_t)s->count};
    FILE *file = fopen(path, "rb");
    require(file != NULL, "no record");
    r.states = require_memory(((size_t)s->steps + 1) * r.stride * sizeof *r.states);
    while (r.steps < s->steps && fread(r.states + (size_t)(r.steps + 1) * r.stride,
                                       sizeof *r.states, r.stride, file) == r.stride)
        r.steps++;
    fclose(file);
    require(r.steps > 0, "an empty record");
    return r;
}

/* How far bodies went and sank, the deepest overlap, and how much energy came from nowhere, beside
 * that of the beginning. */
static void judge_way(const scene *s, const record *r)
{
    const double *first = r->states, *last = r->states + (size_t)r->steps * r->stride;
    const int down = s->planar ? 1 : 2;
    double drift = 0, sunk = 0, deep = 0, lowest = energy(s, first), rise = 0;
    const double scale = fabs(lowest);
    for (int i = 0; i < s->count; i++) {
        const double *a = first + 13 * i, *b = last + 13 * i;
        drift = fmax(drift, hypot(hypot(b[0] - a[0], b[1] - a[1]), b[2] - a[2]));
        sunk = fmax(sunk, a[down] - b[down]);
        if (!isfinite(b[0] + b[1] + b[2]))
            drift = INFINITY;
    }
    for (int k = 1; k <= r->steps; k++) {
        const double *states = r->states + (size_t)k * r->stride, now = energy(s, states);
        rise = fmax(rise, now - lowest);
        lowest = fmin(lowest, now);
        if (k % (r->steps / 30 + 1) == 0 || k == r->steps)
            deep = fmax(deep, penetration(s, states));
    }
    printf("steps %d\n", s->steps);
    printf("drift %.3g\nsunk %.3g\ndeep %.3g\nrise %.3g\n", drift, sunk, deep, rise / scale);
}

static void judge_steps(const scene *s, const record *r)
{
    double error[SAMPLES];
    const double began = processor_seconds();
    int known = 0;
    engine exact;
    create(&exact, s, PERP_ACCURACY_EXACT, 0, 1e-10);
    for (int k = 0; k < SAMPLES && processor_seconds() - began < ENOUGH; k++) {
        const int at = (2 * k + 1) * r->steps / (2 * SAMPLES);
        const double *states = r->states + (size_t)at * r->stride;
        const double found = step_error(&exact, states, states + r->stride);
        if (found >= 0)
            error[known++] = found;
    }
    if (known == 0) {
        puts("error unknown");
    } else {
        const double middle = scene_median(error, known);
        printf("error %.3g %.3g %d\n", middle, error[known - 1], known);
    }
    destroy(&exact);
}

static int32_t accuracy_of(const char *name)
{
    static const char *const names[] = {"fast", "standard", "accurate", "exact"};
    for (int32_t k = 0; k < 4; k++)
        if (!strcmp(name, names[k]))
            return k;
    require(0, "accuracy is fast, standard, accurate or exact");
    return 0;
}

int main(int argc, char **argv)
{
    scene s;
    const char *task = argc > 2 ? argv[1] : "";
    require(argc > 2 && scene_make(&s, argv[2]), "world scene|play|judge NAME ...");
    if (!strcmp(task, "scene")) {
        scene_write(&s, stdout);
    } else if (!strcmp(task, "play") && argc >= 6) {
        FILE *file = argc > 6 ? fopen(argv[6], "wb") : NULL;
        play(&s, accuracy_of(argv[3]), atoi(argv[4]), atof(argv[5]), file);
        if (file)
            fclose(file);
    } else if (!strcmp(task, "judge") && argc == 4) {
        record r = read_record(&s, argv[3]);
        judge_way(&s, &r);
        if (!s.at_rest)
            judge_steps(&s, &r);
        free(r.states);
    } else {
        require(0, "world scene NAME | play NAME ACCURACY SUBSTEPS SECONDS [RECORD] | judge NAME "
                   "RECORD");
    }
    free(s.bodies);
    return 0;
}
