/* Scenes in motion: what a step costs, and what came out of it.
 *
 *   motion SCENE LEVEL [SECONDS]     a file of bench/motion_scenes.py; fast, standard, ...
 *
 * One line: steps done in SECONDS (30) of processor time, milliseconds a step, energy at both ends,
 * the largest overlap after the first tenth of the steps, the median of residuals above 0, and how
 * many steps had which outcome. bench/motion.py runs it beside other engines. */
#include "measure.h"
#include "peers_world/motion.h"

enum { OUTCOMES = PERP_OUTCOME_EVALUATION_FAILED + 1 };

typedef struct engine {
    perp_context *context;
    perp_world *world;
    const motion_scene *scene;
    perp_body *bodies;
    double overlap, *residuals;
    int count, outcomes[OUTCOMES];
    perp_step_result result;
} engine;

static void check(const engine *e, perp_status status)
{
    require(status == PERP_OK, perp_context_message(e->context));
}

static void add_body(engine *e, const motion_body *from, perp_body *body)
{
    perp_body_settings settings;
    check(e, perp_body_settings_init(&settings, sizeof settings));
    settings.kind = from->mass > 0 ? PERP_BODY_DYNAMIC
                    : from->driven ? PERP_BODY_KINEMATIC
                                   : PERP_BODY_STATIC;
    settings.mass = from->mass;
    for (int k = 0; k < 3; k++)
        settings.inertia[4 * k] = from->inertia[k];
    memcpy(settings.position, from->position, sizeof settings.position);
    memcpy(settings.velocity, from->velocity, sizeof settings.velocity);
    if (e->scene->planar)
        settings.angle = 2 * atan2(from->orientation[3], from->orientation[0]);
    else
        memcpy(settings.orientation, from->orientation, sizeof settings.orientation);
    check(e, perp_world_add_body(e->world, body, &settings));
    if (from->shape == MOTION_BOX)
        check(e, perp_world_add_box(e->world, NULL, *body, from->size, NULL));
    else if (from->shape == MOTION_SPHERE)
        check(e, perp_world_add_sphere(e->world, NULL, *body, from->size[0], NULL));
    else
        check(e, perp_world_add_hull(e->world, NULL, *body, from->size, from->count / 3, NULL));
}

/* The ground is A of its joints: angles are those of the body. */
static void add_joint(engine *e, const motion_joint *from)
{
    const perp_body a = e->bodies[from->a];
    perp_joint_settings settings;
    perp_joint joint;
    check(e, perp_joint_settings_init(&settings, sizeof settings));
    settings.kind = from->kind == MOTION_BALL ? PERP_JOINT_BALL : PERP_JOINT_REVOLUTE;
    memcpy(settings.anchor, from->anchor, sizeof settings.anchor);
    memcpy(settings.axis, from->axis, sizeof settings.axis);
    if (from->lower < from->upper) {
        settings.lower = from->lower;
        settings.upper = from->upper;
    }
    settings.motor_speed = from->speed;
    settings.motor_force = from->force;
    check(e, perp_world_add_joint(e->world, &joint, from->b < 0 ? perp_world_ground(e->world) : a,
                                  from->b < 0 ? a : e->bodies[from->b], &settings));
}

static void create(engine *e, const motion_scene *s, int32_t accuracy)
{
    const double up[] = {0, s->planar, !s->planar};
    perp_world_settings settings;
    memset(e, 0, sizeof *e);
    e->scene = s;
    require(perp_context_create(&e->context, NULL) == PERP_OK, "no context");
    check(e, perp_world_settings_init(&settings, sizeof settings, s->planar));
    memcpy(settings.gravity, s->gravity, sizeof settings.gravity);
    settings.friction = s->friction;
    settings.accuracy = accuracy;
    settings.wakeful = 1;
    check(e, perp_world_create(e->context, &e->world, &settings));
    check(e, perp_world_add_plane(e->world, NULL, perp_world_ground(e->world), up, 0, NULL));
    e->bodies = motion_memory(s->bodies, sizeof *e->bodies);
    e->residuals = motion_memory(s->steps, sizeof *e->residuals);
    for (int i = 0; i < s->bodies; i++)
        add_body(e, &s->body[i], &e->bodies[i]);
    for (int i = 0; i < s->joints; i++)
        add_joint(e, &s->joint[i]);
    check(e, perp_struct_init(&e->result, sizeof e->result));
}

static void destroy(engine *e)
{
    perp_world_destroy(e->world);
    perp_context_destroy(e->context);
    free(e->bodies);
    free(e->residuals);
}

static void prepare(void *object, int step)
{
    engine *e = object;
    perp_body_state now;
    check(e, perp_body_state_init(&now, sizeof now));
    for (int i = 0; i < e->scene->bodies; i++) {
        if (!e->scene->body[i].driven)
            continue;
        check(e, perp_world_get_body(e->world, &now, e->bodies[i]));
        motion_velocity(e->scene, &e->scene->body[i], step, now.velocity);
        check(e, perp_world_set_body(e->world, &now, e->bodies[i]));
    }
}

static void step(void *object)
{
    engine *e = object;
    check(e, perp_world_step(e->world, &e->result, e->scene->h));
}

static void look(void *object, int begun)
{
    engine *e = object;
    perp_world_contact contact;
    check(e, perp_struct_init(&contact, sizeof contact));
    for (int32_t i = 0; begun && i < e->result.contacts; i++) {
        check(e, perp_world_get_contact(e->world, &contact, i));
        e->overlap = fmax(e->overlap, -contact.gap);
    }
    if (e->result.residual > 0)
        e->residuals[e->count++] = e->result.residual;
    e->outcomes[e->result.outcome]++;
}

static double energy(void *object)
{
    engine *e = object;
    double kinetic, potential;
    check(e, perp_world_energy(e->world, &kinetic, &potential));
    return kinetic + potential;
}

static int32_t accuracy_of(const char *name)
{
    static const char *const names[] = {"fast", "standard", "accurate", "exact"};
    for (int32_t k = PERP_ACCURACY_FAST; k <= PERP_ACCURACY_EXACT; k++)
        if (strcmp(name, names[k]) == 0)
            return k;
    require(0, "no such level");
    return 0;
}

int main(int argc, char **argv)
{
    engine e;
    motion_scene s;
    motion_engine calls = {&e, prepare, step, look, energy};
    require(argc == 3 || argc == 4, "usage: motion SCENE LEVEL [SECONDS]");
    motion_read(&s, argv[1]);
    create(&e, &s, accuracy_of(argv[2]));
    motion_play(&s, argv[2], &calls, argc > 3 ? atof(argv[3]) : 30);
    printf(" overlap %.3g residual %.2g", e.overlap,
           e.count > 0 ? median(e.residuals, e.count) : 0);
    for (int32_t k = 0; k < OUTCOMES; k++)
        if (e.outcomes[k] > 0)
            printf(" %s %d", perp_outcome_text(k), e.outcomes[k]);
    putchar('\n');
    destroy(&e);
    motion_free(&s);
    return 0;
}
