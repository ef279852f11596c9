/* Closest points of straight edges. */
#include "world/collide/segment.h"

#include "linalg/spatial.h"

/* Sine of the angle below which two directions count as parallel: the point where two lines come
 * closest is then lost in rounding, and any point of the stretch is as close to 1e-7 of its length.
 */
#define PARALLEL 1e-7

static double clamp(double s, double half)
{
    return fmin(fmax(s, -half), half);
}

/* The middle of what b covers of a, or a's end next to b. */
static double middle_of_overlap(double along, double reach, double half)
{
    double low = fmax(along - reach, -half);
    double high = fmin(along + reach, half);
    return clamp(0.5 * (low + high), half);
}

/* The distance between p + s u and q + r v, u and v unit vectors, is stationary in s and r where
 *   s - r u'v = u'(q - p),    s u'v - r = v'(q - p). */
int perp__segment_closest(const perp__segment *a, const perp__segment *b, double *on_a,
                          double *on_b)
{
    const double *u = a->direction, *v = b->direction;
    double between[3], cross[3];
    perp__subtract3(between, b->centre, a->centre);
    for (int k = 0; k < 3; k++)
        cross[k] = u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
    double cosine = perp__dot3(u, v);
    double sine_squared = perp__dot3(cross, cross);
    double along_a = perp__dot3(u, between);
    double along_b = perp__dot3(v, between);

    int parallel = sine_squared < PARALLEL * PARALLEL;
    double s = parallel ? middle_of_overlap(along_a, b->half, a->half)
                        : clamp((along_a - cosine * along_b) / sine_squared, a->half);

    /* the best r for this s; where r had to be clamped, the best s for that r */
    double r = s * cosine - along_b;
    if (fabs(r) > b->half) {
        r = clamp(r, b->half);
        s = clamp(along_a + r * cosine, a->half);
    }
    perp__along3(on_a, a->centre, s, u);
    perp__along3(on_b, b->centre, r, v);
    return parallel;
}

void perp__segment_of_box(perp__segment *edge, const double *half, const double *axes,
                          const double *centre, int32_t planar, int32_t number)
{
    int dimension = planar ? 2 : 3;
    int32_t each = planar ? 2 : 4;
    int j = (int)(number / each);
    int32_t sides = number % each;
    perp__column3(edge->direction, axes, j);
    edge->half = half[j];
    perp__copy3(edge->centre, centre);
    for (int m = 1; m < dimension; m++) {
        int other = (j + m) % dimension;
        double axis[3];
        perp__column3(axis, axes, other);
        double side = sides >> (m - 1) & 1 ? 1.0 : -1.0;
        perp__along3(edge->centre, edge->centre, side * half[other], axis);
    }
}

void perp__segment_closest_edges(const perp__box_edges *a, const perp__box_edges *b, int32_t planar,
                                 double *on_a, double *on_b)
{
    int32_t edges = planar ? 4 : 12;
    double least = INFINITY;
    for (int32_t i = 0; i < edges; i++) {
        perp__segment edge_a;
        perp__segment_of_box(&edge_a, a->half, a->axes, a->centre, planar, i);
        for (int32_t j = 0; j < edges; j++) {
            perp__segment edge_b;
            double here_a[3], here_b[3], between[3];
            perp__segment_of_box(&edge_b, b->half, b->axes, b->centre, planar, j);
            int parallel = perp__segment_closest(&edge_a, &edge_b, here_a, here_b);
            perp__subtract3(between, here_b, here_a);
            double distance = perp__normalise3(between);

            /* of equal distances that of parallel edges, whose points are the middle of the stretch
             * in which they meet: the others end there. The factor only beats rounding. */
            if (parallel)
                distance *= 1.0 - 1e-9;
            if (!(distance < least))
                continue;
            least = distance;
            for (int k = 0; k < 3; k++) {
                on_a[k] = here_a[k];
                on_b[k] = here_b[k];
            }
        }
    }
}
