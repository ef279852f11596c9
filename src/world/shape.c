/* Shapes: adding them to bodies, and removing them with their body. */
#include "world/step.h"

#include "base/check.h"
#include "base/context.h"
#include "world/collide/polytope.h"

/* Density of a shape that says none. */
#define WATER 1000.0

PERP__INIT_WITH(perp_shape_settings, .friction = PERP_FRICTION_OF_WORLD, .rotation[0] = 1.0,
                .density = WATER)

static perp_status check_material(perp_context *context, const perp_shape_settings *settings)
{
    perp_status status = perp__check_finite(context, "settings.friction", &settings->friction, 1);

    PERP__THEN(status,
               perp__check_finite(context, "settings.restitution", &settings->restitution, 1));
    PERP__THEN(status, perp__check_finite(context, "settings.density", &settings->density, 1));
    if (status != PERP_OK)
        return status;
    if (settings->friction < 0.0 && settings->friction != PERP_FRICTION_OF_WORLD)
        return perp__refuse(context, "settings.friction is %g, >= 0 expected", settings->friction);
    if (settings->density < 0.0)
        return perp__refuse(context, "settings.density is %g, >= 0 expected", settings->density);
    if (settings->restitution < 0.0 || settings->restitution > 1.0)
        return perp__refuse(context, "settings.restitution is %g, 0 .. 1 expected",
                            settings->restitution);
    return PERP_OK;
}

/* Reads the caller's settings into everything of `shape` but its geometry, radius and slot. */
static perp_status read_settings(const perp_world *world, perp__shape *shape,
                                 const perp_shape_settings *caller)
{
    perp_context *context = world->context;
    perp_shape_settings settings;
    perp_status status = perp_shape_settings_init(&settings, sizeof settings);

    PERP__THEN(status, perp__struct_read(context, "settings", &settings, sizeof settings, caller,
                                         PERP__FIRST(perp_shape_settings)));
    PERP__THEN(status, check_material(context, &settings));
    PERP__THEN(status, perp__check_vector3(world, "settings.offset", settings.offset));
    PERP__THEN(status, perp__check_quaternion(context, "settings.rotation", settings.rotation));
    if (status == PERP_OK && world->settings.planar &&
        (settings.rotation[1] != 0.0 || settings.rotation[2] != 0.0))
        status = perp__refuse(context, "settings.rotation must be about z in a planar world");
    if (status != PERP_OK)
        return status;
    shape->friction =
        settings.friction == PERP_FRICTION_OF_WORLD ? world->settings.friction : settings.friction;
    shape->density = settings.density;
    shape->restitution = settings.restitution;
    perp__copy3(shape->offset, settings.offset);
    perp__quaternion_matrix(shape->rotation, settings.rotation);
    return PERP_OK;
}

void perp__remove_shapes(perp_world *world, int32_t body)
{
    int32_t i;

    while ((i = world->bodies.all[body].first_shape) >= 0) {
        perp__shape *shape = &world->shapes.all[i];

        perp__forget_shape(world, i);
        perp__release(world->context, shape->geometry.hull);
        shape->geometry.hull = NULL;
        shape->alive = 0;
        shape->generation++;
        shape->next_free = world->shapes.free;
        world->shapes.free = i;
        world->results.stats.shapes--;
    }
    world->bodies.all[body].radius = 0.0;
    world->bodies.all[body].shapes = 0;
}

/* Puts `shape`, complete but for body and slot, on the body. */
static perp_status attach_shape(perp_world *world, perp_shape *id, perp_body body_id,
                                const perp__shape *shape)
{
    const perp__growing arrays[] = {
        PERP__GROWING(world->pairs.tree.nodes, world->pairs.tree.used, 2),
        PERP__GROWING(world->shapes.all, world->shapes.slots, 1)};
    uint32_t generation = 1;
    int32_t slot, body;
    perp__shape *copy;
    perp_status status = perp__find_body(world, &body, body_id);

    if (status == PERP_OK && shape->geometry.kind == PERP__PLANE && perp__is_dynamic(world, body))
        status = perp__refuse(world->context,
                              "body is dynamic: a half-space may be on a static or kinematic body");
    if (status == PERP_OK && world->shapes.free < 0)
        status = perp__grow(world->context, "another shape", &world->shapes.capacity,
                            (int64_t)world->shapes.slots + 1, arrays, 2);
    PERP__THEN(status, perp__add_shape_mass(world, &world->bodies.all[body], shape));
    if (status != PERP_OK)
        return status;
    world->bodies.weighed = 0;
    slot = world->shapes.free;
    if (slot >= 0) {
        world->shapes.free = world->shapes.all[slot].next_free;
        generation = world->shapes.all[slot].generation;
    } else {
        slot = world->shapes.slots++;
    }
    copy = &world->shapes.all[slot];
    *copy = *shape;
    copy->alive = 1;
    copy->body = body;
    copy->generation = generation;
    copy->reach = perp__length3(copy->offset) + copy->radius;
    /* on the lists of its body's, and of the half-spaces; its pairs come with the next step */
    copy->leaf = copy->first_link = -1;
    copy->mark = 0;
    copy->next_of_body = world->bodies.all[body].first_shape;
    world->bodies.all[body].first_shape = slot;
    perp__note_put(world, body);
    perp__disturb(world, body);
    if (copy->geometry.kind == PERP__PLANE) {
        copy->next_plane = world->pairs.first_plane;
        world->pairs.first_plane = slot;
        world->pairs.planes_changed = 1;
    }
    world->bodies.all[body].shapes++;
    if (copy->geometry.kind != PERP__PLANE && copy->reach > world->bodies.all[body].radius)
        world->bodies.all[body].radius = copy->reach;
    world->results.stats.shapes++;
    if (id)
        *id = perp__id(slot, generation);
    return PERP_OK;
}

/* The same of one whose settings are still the caller's. */
static perp_status add_shape(perp_world *world, perp_shape *id, perp_body body, perp__shape *shape,
                             const perp_shape_settings *settings)
{
    const perp_status status = read_settings(world, shape, settings);

    return status == PERP_OK ? attach_shape(world, id, body, shape) : status;
}

static perp_status add_sphere(perp_world *world, perp_shape *id, perp_body body, double radius,
                              const perp_shape_settings *settings)
{
    perp__shape shape = {.geometry = {.kind = PERP__SPHERE, .radius = radius},
                         .radius = radius,
                         .thickness = radius > 0.0 ? radius : INFINITY};
    perp_status status = perp__check_finite(world->context, "radius", &radius, 1);

    if (status == PERP_OK && radius < 0.0)
        status = perp__refuse(world->context, "radius is %g, >= 0 expected", radius);
    return status == PERP_OK ? add_shape(world, id, body, &shape, settings) : status;
}

perp_status perp_world_add_sphere(perp_world *world, perp_shape *shape, perp_body body,
                                  double radius, const perp_shape_settings *settings)
{
    return PERP__WORLD_CALL(world, add_sphere(world, shape, body, radius, settings));
}

static perp_status add_box(perp_world *world, perp_shape *id, perp_body body,
                           const double *half_extents, const perp_shape_settings *settings)
{
    const size_t dimensions = world->settings.planar ? 2 : 3;
    perp__shape shape = {.geometry = {.kind = PERP__BOX}, .thickness = INFINITY};
    perp_status status = perp__check_pointer(world->context, "half_extents", half_extents);

    PERP__THEN(status,
               perp__check_finite(world->context, "half_extents", half_extents, dimensions));
    for (size_t i = 0; status == PERP_OK && i < dimensions; i++) {
        if (half_extents[i] <= 0.0)
            status = perp__refuse(world->context, "half_extents[%zu] is %g, > 0 expected", i,
                                  half_extents[i]);
        shape.geometry.half_extents[i] = half_extents[i];
        shape.thickness = fmin(shape.thickness, half_extents[i]);
    }
    shape.radius = perp__length3(shape.geometry.half_extents);
    return status == PERP_OK ? add_shape(world, id, body, &shape, settings) : status;
}

perp_status perp_world_add_box(perp_world *world, perp_shape *shape, perp_body body,
                               const double *half_extents, const perp_shape_settings *settings)
{
    return PERP__WORLD_CALL(world, add_box(world, shape, body, half_extents, settings));
}

static perp_status add_capsule(perp_world *world, perp_shape *id, perp_body body, double radius,
                               double half_length, const perp_shape_settings *settings)
{
    perp__shape shape = {
        .geometry = {.kind = PERP__CAPSULE, .radius = radius, .half_extents = {half_length}},
        .radius = half_length + radius,
        .thickness = radius};
    perp_status status = perp__check_finite(world->context, "radius", &radius, 1);

    PERP__THEN(status, perp__check_finite(world->context, "half_length", &half_length, 1));
    if (status == PERP_OK && radius <= 0.0)
        status = perp__refuse(world->context, "radius is %g, > 0 expected", radius);
    if (status == PERP_OK && half_length < 0.0)
        status = perp__refuse(world->context, "half_length is %g, >= 0 expected", half_length);
    return status == PERP_OK ? add_shape(world, id, body, &shape, settings) : status;
}

perp_status perp_world_add_capsule(perp_world *world, perp_shape *shape, perp_body body,
                                   double radius, double half_length,
                                   const perp_shape_settings *settings)
{
    return PERP__WORLD_CALL(world, add_capsule(world, shape, body, radius, half_length, settings));
}

/* The shape's centre becomes that of the hull, which is where its corners are measured from. */
static perp_status add_hull(perp_world *world, perp_shape *id, perp_body body, const double *points,
                            int32_t count, const perp_shape_settings *settings)
{
    perp__shape shape;
    perp__hull *hull = NULL;
    double centre[3], turned[3];
    const int32_t planar = world->settings.planar, least = planar ? 3 : 4;
    perp_status status = perp__check_pointer(world->context, "points", points);

    if (status == PERP_OK && (count < least || count > INT32_MAX / 3))
        return perp__refuse(world->context, "count is %d, >= %d expected", (int)count, (int)least);
    PERP__THEN(status, perp__check_finite(world->context, "points", points, 3 * (size_t)count));
    for (int32_t i = 0; i < count && status == PERP_OK && planar; i++)
        if (points[3 * i + 2] != 0.0)
            status = perp__refuse(world->context, "points[%d] is %g, 0 expected in a planar world",
                                  (int)(3 * i + 2), points[3 * i + 2]);
    memset(&shape, 0, sizeof shape);
    PERP__THEN(status, read_settings(world, &shape, settings));
    PERP__THEN(status, perp__hull_make(world->context, &hull, centre, points, count, planar));
    if (status != PERP_OK)
        return status;
    shape.geometry.kind = PERP__HULL;
    shape.geometry.hull = hull;
    perp__copy3(shape.geometry.half_extents, hull->half);
    perp__apply3(turned, shape.rotation, centre);
    perp__add3(shape.offset, 1.0, turned);
    shape.radius = hull->reach;
    shape.thickness = hull->thickness;
    status = attach_shape(world, id, body, &shape);
    if (status != PERP_OK)
        perp__release(world->context, hull);
    return status;
}

perp_status perp_world_add_hull(perp_world *world, perp_shape *shape, perp_body body,
                                const double *points, int32_t count,
                                const perp_shape_settings *settings)
{
    return PERP__WORLD_CALL(world, add_hull(world, shape, body, points, count, settings));
}

/* The normal may be as long or short as a double goes. A unit normal keeps its bits. */
static perp_status unit_normal(const perp_world *world, double *unit, const double *normal)
{
    perp_status status = perp__check_pointer(world->context, "normal", normal);

    PERP__THEN(status, perp__check_vector3(world, "normal", normal));
    if (status != PERP_OK)
        return status;
    perp__copy3(unit, normal);
    if (!(fabs(perp__length3(unit) - 1.0) <= 2.0 * DBL_EPSILON) && perp__normalise3(unit) == 0.0)
        return perp__refuse(world->context, "normal is zero");
    return PERP_OK;
}

static perp_status add_plane(perp_world *world, perp_shape *id, perp_body body,
                             const double *normal, double offset,
                             const perp_shape_settings *settings)
{
    perp__shape shape = {.geometry = {.kind = PERP__PLANE, .offset = offset},
                         .thickness = INFINITY};
    perp_status status = unit_normal(world, shape.geometry.normal, normal);

    PERP__THEN(status, perp__check_finite(world->context, "offset", &offset, 1));
    return status == PERP_OK ? add_shape(world, id, body, &shape, settings) : status;
}

perp_status perp_world_add_plane(perp_world *world, perp_shape *shape, perp_body body,
                                 const double *normal, double offset,
                                 const perp_shape_settings *settings)
{
    return PERP__WORLD_CALL(world, add_plane(world, shape, body, normal, offset, settings));
}
