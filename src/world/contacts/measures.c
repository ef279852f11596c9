/* What pairs and their shapes measure: sizes, roundings, and how far a motion takes them. */
#include "world/step.h"

#include "linalg/spatial.h"

static double rounding_of(const perp_world *world, int32_t shape)
{
    const perp__shape *at = &world->shapes[shape];

    return PERP__SUM_ROUNDING *
           (perp__largest3(world->placed[shape].position) + at->radius + fabs(at->geometry.offset));
}

double perp__pair_rounding(const perp_world *world, const perp__pair *pair)
{
    return rounding_of(world, pair->first) + rounding_of(world, pair->second);
}

double perp__pair_size(const perp_world *world, const perp__pair *pair)
{
    const double a = world->bodies[world->shapes[pair->first].body].radius;
    const double b = world->bodies[world->shapes[pair->second].body].radius;

    return a > 0.0 && b > 0.0 ? 2.0 * fmin(a, b) : a + b;
}

double perp__pair_thickness(const perp_world *world, const perp__pair *pair)
{
    double size =
        perp__lesser(world->shapes[pair->first].thickness, world->shapes[pair->second].thickness);

    return isfinite(size) ? size : 0.0;
}

double perp__pair_touching(const perp_world *world, const perp__pair *pair, double rounding)
{
    return PERP__NEGLIGIBLE * perp__pair_thickness(world, pair) + rounding;
}

int32_t perp__are_near(const perp_world *world, const perp__pair *pair, double margin)
{
    const double *a = world->placed[pair->first].position;
    const double *b = world->placed[pair->second].position;
    const double between[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    const double reach =
        world->shapes[pair->first].radius + world->shapes[pair->second].radius + margin;

    return pair->plane || perp__dot3(between, between) <= reach * reach || !isfinite(reach * reach);
}

/* A ball in its body's centre does not. */
static int32_t rotates(const perp__shape *shape)
{
    return shape->geometry.kind != PERP__SPHERE || !perp__is_zero3(shape->offset);
}

double perp__turning_reach(const perp__shape *shape)
{
    return rotates(shape) ? shape->reach : 0.0;
}

double perp__shape_turning(const perp_world *world, const perp__shape *shape, double h)
{
    return perp__turning(world, shape->body, perp__turning_reach(shape), h);
}

void perp__moving_shape(const perp_world *world, int32_t shape, double h, perp__moving *moving)
{
    const perp__shape *at = &world->shapes[shape];
    const double *twist = world->motions[at->body].moving;
    const int32_t turns = rotates(at);

    moving->start = &world->placed[shape];
    moving->reach = at->reach;
    perp__copy3(moving->centre, world->states[at->body].position);
    for (int32_t k = 0; k < 3; k++) {
        moving->displacement[k] = h * twist[k];
        moving->turn[k] = turns ? h * twist[3 + k] : 0.0;
    }
}

double perp__way_of(const perp__moving *shape)
{
    return perp__length3(shape->displacement) + perp__length3(shape->turn) * shape->reach;
}
