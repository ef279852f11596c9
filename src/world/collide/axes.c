/* The separating axes of two boxes (Gottschalk, Lin & Manocha 1996), in the frame of the first; and
 * which one of two shapes' axes closes last. */
#include "world/collide/box.h"
#include "world/collide/collision.h"
#include "world/collide/polytope.h"
#include "linalg/spatial.h"

/* Sine of the angle between two edges below which their product is no axis of its own: its
 * direction would be rounding, and the face normals stand in for it to 1e-7 of an edge's length. */
#define PARALLEL 1e-7

/* Boxes whose axes are parallel to 1e-6 have no edge products of their own: what they separate more
 * than the faces is no more than that of an edge's length. */
#define ALIGNED (1.0 - 1e-12)

/* An axis takes over from one preferred only where it is better by this share of the size. */
#define BIAS 1e-6

static double half_width(const perp__placed *box, const double *normal)
{
    const double *R = box->rotation, *half = box->geometry->half_extents;
    double width = 0.0;
    for (int j = 0; j < 3; j++)
        width += half[j] * fabs(normal[0] * R[j] + normal[1] * R[3 + j] + normal[2] * R[6 + j]);
    return width;
}

double perp__separation(const perp__placed *a, const perp__placed *b, const double *normal)
{
    double between[3], local[3], back[3];
    perp__subtract3(between, b->position, a->position);
    if (a->geometry->kind == PERP__BOX && b->geometry->kind == PERP__BOX)
        return (perp__dot3(normal, between) - half_width(a, normal)) - half_width(b, normal);
    perp__apply_transposed3(local, a->rotation, normal);
    double reach = perp__reach_of(a->geometry, local);
    perp__apply_transposed3(local, b->rotation, normal);
    for (int k = 0; k < 3; k++)
        back[k] = -local[k];
    return (perp__dot3(normal, between) - reach) - perp__reach_of(b->geometry, back);
}

/* Two boxes in the frame of the first. */
typedef struct view {
    const double *half_a;
    const double *half_b;
    double centre[3]; /* of B */
    double C[9];      /* columns: B's axes */
    double size[9];   /* their entries' sizes */
} view;

static void set_view(view *v, const perp__placed *a, const perp__placed *b)
{
    double between[3];
    perp__subtract3(between, b->position, a->position);
    perp__apply_transposed3(v->centre, a->rotation, between);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const double *A = a->rotation, *B = b->rotation;
            v->C[3 * i + j] = A[i] * B[j] + A[3 + i] * B[3 + j] + A[6 + i] * B[6 + j];
            v->size[3 * i + j] = fabs(v->C[3 * i + j]);
        }
    v->half_a = a->geometry->half_extents;
    v->half_b = b->geometry->half_extents;
}

static void face_of_a(const view *v, int i, perp__axis *axis)
{
    const double *row = v->size + 3 * i, *h = v->half_b;
    for (int k = 0; k < 3; k++)
        axis->normal[k] = k != i ? 0.0 : v->centre[i] < 0.0 ? -1.0 : 1.0;
    double width = row[0] * h[0] + row[1] * h[1] + row[2] * h[2];
    axis->separation = (fabs(v->centre[i]) - v->half_a[i]) - width;
    axis->width = v->half_a[i] + width;
}

static void face_of_b(const view *v, int j, perp__axis *axis)
{
    const double *h = v->half_a;
    double along = v->C[j] * v->centre[0] + v->C[3 + j] * v->centre[1] + v->C[6 + j] * v->centre[2];
    double sign = along < 0.0 ? -1.0 : 1.0;
    for (int k = 0; k < 3; k++)
        axis->normal[k] = sign * v->C[3 * k + j];
    double width = v->size[j] * h[0] + v->size[3 + j] * h[1] + v->size[6 + j] * h[2];
    axis->separation = (fabs(along) - v->half_b[j]) - width;
    axis->width = v->half_b[j] + width;
}

/* The product of edge i of A and j of B is (0, -C_lj, C_kj) on the axes i, k, l of A, and has the
 * components C_in and -C_im on the axes m, n of B that follow j. */
static void edge_axis(const view *v, int i, int j, perp__axis *axis)
{
    int k = (i + 1) % 3, l = (i + 2) % 3, m = (j + 1) % 3, n = (j + 2) % 3;
    double x = v->C[3 * l + j], y = v->C[3 * k + j], length = sqrt(x * x + y * y);
    axis->separation = -INFINITY;
    axis->normal[i] = axis->normal[k] = axis->normal[l] = 0.0;
    if (length < PARALLEL)
        return;
    double along = y * v->centre[l] - x * v->centre[k];
    double scale = (along < 0.0 ? -1.0 : 1.0) / length;
    double reach = v->half_a[k] * v->size[3 * l + j] + v->half_a[l] * v->size[3 * k + j] +
                   v->half_b[m] * v->size[3 * i + n] + v->half_b[n] * v->size[3 * i + m];
    axis->normal[k] = -x * scale;
    axis->normal[l] = y * scale;
    axis->separation = (fabs(along) - reach) / length;
    axis->width = reach / length;
}

static int are_aligned(const view *v)
{
    for (int i = 0; i < 3; i++) {
        const double *row = v->size + 3 * i;
        if (fmax(fmax(row[0], row[1]), row[2]) < ALIGNED)
            return 0;
    }
    return 1;
}

void perp__box_axes(const perp__placed *a, const perp__placed *b, int32_t planar, perp__axes *axes)
{
    int dimension = planar ? 2 : 3;
    perp__axis *axis = axes->axis;
    view v;
    set_view(&v, a, b);
    for (int j = 0; j < dimension; j++) {
        face_of_a(&v, j, &axis[j]);
        face_of_b(&v, j, &axis[dimension + j]);
    }
    axes->faces[0] = axes->faces[1] = dimension;
    axes->count = planar ? 4 : are_aligned(&v) ? 6 : PERP__BOX_AXES;
    for (int k = 6; k < axes->count; k++)
        edge_axis(&v, (k - 6) / 3, (k - 6) % 3, &axis[k]);
    for (int k = 0; k < axes->count; k++)
        axis[k].number = k;
}

static double size_of(const perp__placed *shape)
{
    return perp__largest3(shape->geometry->half_extents) + shape->geometry->radius;
}

int32_t perp__last_to_close(const perp__placed *a, const perp__placed *b, const perp__axes *axes,
                            const double *gate)
{
    const double bias = BIAS * fmin(size_of(a), size_of(b));
    const int32_t smaller = perp__box_is_smaller(a, b);
    const int32_t first = smaller ? axes->faces[0] : 0, faces = axes->faces[smaller];
    double most = -INFINITY;
    int32_t best = 0;
    for (int32_t k = first; k < first + faces; k++) {
        const double lacks = axes->axis[k].separation + (gate ? gate[k] : 0.0);
        if (lacks > most) {
            best = k;
            most = lacks;
        }
    }
    for (int32_t k = 0; k < axes->count; k++) {
        const double lacks = axes->axis[k].separation + (gate ? gate[k] : 0.0);
        if ((k < first || k >= first + faces) && lacks > most + bias) {
            best = k;
            most = lacks;
        }
    }
    return best;
}
