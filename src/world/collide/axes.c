/* The separating axes of two boxes (Gottschalk, Lin & Manocha 1996), in the world frame. */
#include "world/collide/meeting.h"
#include "linalg/spatial.h"

/* Sine of the angle between two edges below which their product is no axis of its own: its
 * direction would be rounding, and the face normals stand in for it to 1e-7 of an edge's length. */
#define PARALLEL 1e-7

static double half_width(const perp__placed *box, const double *normal)
{
    const double *R = box->rotation, *half = box->geometry->half_extents;
    double width = 0.0;
    for (int j = 0; j < 3; j++)
        width += half[j] * fabs(normal[0] * R[j] + normal[1] * R[3 + j] + normal[2] * R[6 + j]);
    return width;
}

double perp__box_separation(const perp__placed *a, const perp__placed *b, const double *normal)
{
    double between[3];
    perp__subtract3(between, b->position, a->position);
    return (perp__dot3(normal, between) - half_width(a, normal)) - half_width(b, normal);
}

/* Turns the normal from A to B and measures. */
static void measure(const perp__placed *a, const perp__placed *b, const double *between,
                    perp__axis *axis)
{
    double along = perp__dot3(axis->normal, between);
    for (int k = 0; k < 3 && along < 0.0; k++)
        axis->normal[k] = -axis->normal[k];
    axis->separation = (fabs(along) - half_width(a, axis->normal)) - half_width(b, axis->normal);
}

static void edge_axis(const perp__placed *a, const perp__placed *b, const double *between,
                      const double *u, const double *v, perp__axis *axis)
{
    double *n = axis->normal;
    n[0] = u[1] * v[2] - u[2] * v[1];
    n[1] = u[2] * v[0] - u[0] * v[2];
    n[2] = u[0] * v[1] - u[1] * v[0];
    double length = sqrt(perp__dot3(n, n));
    axis->separation = -INFINITY;
    if (length < PARALLEL)
        return;
    for (int k = 0; k < 3; k++)
        n[k] /= length;
    measure(a, b, between, axis);
}

int32_t perp__box_axes(const perp__placed *a, const perp__placed *b, int32_t planar,
                       perp__axis *axes)
{
    int dimension = planar ? 2 : 3;
    double between[3], u[3][3], v[3][3];
    perp__subtract3(between, b->position, a->position);
    for (int j = 0; j < dimension; j++) {
        perp__column3(u[j], a->rotation, j);
        perp__column3(v[j], b->rotation, j);
        for (int k = 0; k < 3; k++) {
            axes[j].normal[k] = u[j][k];
            axes[dimension + j].normal[k] = v[j][k];
        }
        measure(a, b, between, &axes[j]);
        measure(a, b, between, &axes[dimension + j]);
    }
    for (int i = 0; i < 3 && !planar; i++)
        for (int j = 0; j < 3; j++)
            edge_axis(a, b, between, u[i], v[j], &axes[6 + 3 * i + j]);
    return planar ? 4 : 15;
}
