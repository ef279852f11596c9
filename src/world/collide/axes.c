/* The separating axes of two boxes (Gottschalk, Lin & Manocha 1996), in the frame of the first; and
 * which one of two shapes' axes closes last. */
#include "world/collide/polytope.h"
#include "linalg/lanes/lanes.h"
#include "linalg/lanes/multiversion.h"
#include "linalg/spatial.h"

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

/* Two boxes in the frame of the first; in vectors, what is of the axes of B, the last one twice:
 * beside them, what is of those after them, and of those before. */
typedef struct view {
    const double *half_a;
    double centre[3];                          /* of B */
    perp__lanes half, half_after, half_before; /* of B */
    perp__lanes C[3];                          /* components of B's axes along those of A */
    perp__lanes size[3], size_after[3], size_before[3];
} view;

#define TURNED(x, i, j, k) ((perp__lanes){(x)[i], (x)[j], (x)[k], (x)[k]})

PERP__KERNEL static void set_view(view *v, const perp__placed *a, const perp__placed *b)
{
    const double *A = a->rotation, *B = b->rotation, *half = b->geometry->half_extents;
    const perp__lanes rows[3] = {TURNED(B, 0, 1, 2), TURNED(B, 3, 4, 5), TURNED(B, 6, 7, 8)};
    const perp__lanes after[3] = {TURNED(B, 1, 2, 0), TURNED(B, 4, 5, 3), TURNED(B, 7, 8, 6)};
    const perp__lanes before[3] = {TURNED(B, 2, 0, 1), TURNED(B, 5, 3, 4), TURNED(B, 8, 6, 7)};
    double between[3];

    perp__subtract3(between, b->position, a->position);
    perp__apply_transposed3(v->centre, a->rotation, between);
    for (int i = 0; i < 3; i++) {
        const perp__lanes x = PERP__SAME_LANES(A[i]), y = PERP__SAME_LANES(A[3 + i]);
        const perp__lanes z = PERP__SAME_LANES(A[6 + i]);
        const perp__lanes next = x * after[0] + y * after[1] + z * after[2];
        const perp__lanes last = x * before[0] + y * before[1] + z * before[2];

        v->C[i] = x * rows[0] + y * rows[1] + z * rows[2];
        v->size[i] = PERP__ABSOLUTE_LANES(v->C[i]);
        v->size_after[i] = PERP__ABSOLUTE_LANES(next);
        v->size_before[i] = PERP__ABSOLUTE_LANES(last);
    }
    v->half_a = a->geometry->half_extents;
    v->half = TURNED(half, 0, 1, 2);
    v->half_after = TURNED(half, 1, 2, 0);
    v->half_before = TURNED(half, 2, 0, 1);
}

PERP__KERNEL static void face_of_a(const view *v, int i, perp__axis *axis)
{
    const perp__lanes share = v->size[i] * v->half;
    const double width = share[0] + share[1] + share[2];

    for (int k = 0; k < 3; k++)
        axis->normal[k] = k != i ? 0.0 : v->centre[i] < 0.0 ? -1.0 : 1.0;
    axis->separation = (fabs(v->centre[i]) - v->half_a[i]) - width;
    axis->width = v->half_a[i] + width;
}

#define SIGN_LANES(x) PERP__SELECT_LANES((x) < zero, PERP__SAME_LANES(-1.0), PERP__SAME_LANES(1.0))

PERP__KERNEL static void faces_of_b(const view *v, perp__axis *axis)
{
    const double *c = v->centre, *h = v->half_a;
    const perp__lanes zero = {0.0};
    const perp__lanes along = v->C[0] * PERP__SAME_LANES(c[0]) + v->C[1] * PERP__SAME_LANES(c[1]) +
                              v->C[2] * PERP__SAME_LANES(c[2]);
    const perp__lanes width = v->size[0] * PERP__SAME_LANES(h[0]) +
                              v->size[1] * PERP__SAME_LANES(h[1]) +
                              v->size[2] * PERP__SAME_LANES(h[2]);
    const perp__lanes apart = (PERP__ABSOLUTE_LANES(along) - v->half) - width;
    const perp__lanes sign = SIGN_LANES(along), all = v->half + width;

    for (int j = 0; j < 3; j++) {
        for (int k = 0; k < 3; k++)
            axis[j].normal[k] = sign[j] * v->C[k][j];
        axis[j].separation = apart[j];
        axis[j].width = all[j];
    }
}

/* The product of edge i of A and j of B is (0, -C_lj, C_kj) on the axes i, k, l of A, and has the
 * components C_in and -C_im on the axes m, n of B that follow j. */
PERP__KERNEL static void edges_of_a(const view *v, int i, perp__axis *axis)
{
    const int k = (i + 1) % 3, l = (i + 2) % 3;
    const double *h = v->half_a;
    const perp__lanes zero = {0.0};
    const perp__lanes x = v->C[l], y = v->C[k], square = x * x + y * y;
    const perp__lanes length = PERP__ROOT_LANES(square);
    const perp__lanes along =
        y * PERP__SAME_LANES(v->centre[l]) - x * PERP__SAME_LANES(v->centre[k]);
    const perp__lanes scale = SIGN_LANES(along) / length;
    const perp__lanes reach = PERP__SAME_LANES(h[k]) * v->size[l] +
                              PERP__SAME_LANES(h[l]) * v->size[k] +
                              v->half_after * v->size_before[i] + v->half_before * v->size_after[i];
    const perp__lanes apart = (PERP__ABSOLUTE_LANES(along) - reach) / length;
    const perp__lanes width = reach / length, back = -x * scale, on = y * scale;

    for (int j = 0; j < 3; j++) {
        const int parallel = length[j] < PERP__PARALLEL;

        axis[j].normal[i] = 0.0;
        axis[j].normal[k] = parallel ? 0.0 : back[j];
        axis[j].normal[l] = parallel ? 0.0 : on[j];
        axis[j].separation = parallel ? -INFINITY : apart[j];
        axis[j].width = width[j];
    }
}

PERP__KERNEL static int are_aligned(const view *v)
{
    for (int i = 0; i < 3; i++) {
        const perp__lanes s = v->size[i];

        if (!perp__is_same_way(s[0]) && !perp__is_same_way(s[1]) && !perp__is_same_way(s[2]))
            return 0;
    }
    return 1;
}

PERP__MULTIVERSION_SHARED(perp__box_axes,
                          (const perp__placed *a, const perp__placed *b, double far,
                           perp__axes *axes),
                          (a, b, far, axes))
{
    perp__axis *axis = axes->axis;
    view v;

    set_view(&v, a, b);
    for (int i = 0; i < 3; i++)
        face_of_a(&v, i, &axis[i]);
    faces_of_b(&v, axis + 3);
    axes->faces[0] = axes->faces[1] = 3;
    axes->count = are_aligned(&v) ? 6 : PERP__BOX_AXES;
    for (int k = 0; k < 6; k++)
        axes->count = axis[k].separation > far ? 6 : axes->count;
    if (axes->count > 6) {
        edges_of_a(&v, 0, axis + 6);
        edges_of_a(&v, 1, axis + 9);
        edges_of_a(&v, 2, axis + 12);
    }
    for (int k = 0; k < axes->count; k++)
        axis[k].number = k;
}

void perp__ball_axes(const perp__placed *a, const perp__placed *b, int32_t planar, perp__axes *axes)
{
    const int32_t turns = b->geometry->kind == PERP__BOX, dimension = planar ? 2 : 3;
    const perp__placed *box = turns ? b : a, *ball = turns ? a : b;
    const int32_t faces = box->geometry->kind == PERP__BOX ? 2 * dimension : 0;
    const double *half = box->geometry->half_extents;
    const double radius = box->geometry->radius + ball->geometry->radius;
    double between[3], centre[3], out[3] = {0.0, 0.0, 0.0};
    int32_t beyond = 0;

    axes->faces[turns] = faces;
    axes->faces[1 - turns] = 0;
    axes->count = faces + 1;
    perp__subtract3(between, ball->position, box->position);
    perp__apply_transposed3(centre, box->rotation, between);
    for (int32_t k = 0; k < faces; k++) {
        perp__axis *axis = &axes->axis[k];
        const double sign = k % 2 ? 1.0 : -1.0, height = sign * centre[k / 2] - half[k / 2];

        *axis = (perp__axis){k, {0.0, 0.0, 0.0}, height - radius, INFINITY};
        axis->normal[k / 2] = sign;
        out[k / 2] += height > 0.0 ? sign * height : 0.0;
        beyond += height > 0.0;
    }
    if (faces == 0)
        perp__copy3(out, centre);
    const double distance = perp__normalise3(out);
    out[1] = distance > 0.0 || faces > 0 ? out[1] : 1.0; /* of one centre: any */
    axes->axis[faces] = (perp__axis){PERP__CLOSEST_AXIS,
                                     {out[0], out[1], out[2]},
                                     faces == 0 || beyond > 1 ? distance - radius : -INFINITY,
                                     INFINITY};
    for (int32_t k = 0; k < axes->count && turns; k++) { /* as A sees them */
        perp__apply3(between, box->rotation, axes->axis[k].normal);
        perp__apply_transposed3(out, ball->rotation, between);
        for (int j = 0; j < 3; j++)
            axes->axis[k].normal[j] = -out[j];
    }
}

double perp__size_of(const perp__placed *shape)
{
    return perp__largest3(shape->geometry->half_extents) + shape->geometry->radius;
}

int perp__box_is_smaller(const perp__placed *a, const perp__placed *b)
{
    const double *x = a->geometry->half_extents, *y = b->geometry->half_extents;
    return x[0] + x[1] + x[2] < y[0] + y[1] + y[2];
}

/* The one of the axes from `from` to `end` that lacks most, if that is more by `ahead`. */
static void close_later(const perp__axes *axes, const double *gate, int32_t from, int32_t end,
                        double ahead, int32_t *best, double *most)
{
    for (int32_t k = from; k < end; k++) {
        const double lacks = axes->axis[k].separation + (gate ? gate[k] : 0.0);
        if (lacks > *most + ahead) {
            *best = k;
            *most = lacks;
        }
    }
}

int32_t perp__last_to_close(const perp__placed *a, const perp__placed *b, const perp__axes *axes,
                            const double *gate)
{
    /* by what an axis has to be better than one preferred: as axes that count as one may be */
    const double bias = PERP__PARALLEL * perp__lesser(perp__size_of(a), perp__size_of(b));
    const int32_t smaller = perp__box_is_smaller(a, b);
    const int32_t first = smaller ? axes->faces[0] : 0, end = first + axes->faces[smaller];
    double most = -INFINITY;
    int32_t best = 0;
    close_later(axes, gate, first, end, 0.0, &best, &most);
    close_later(axes, gate, 0, first, bias, &best, &most);
    close_later(axes, gate, end, axes->count, bias, &best, &most);
    return best;
}

bool perp__middle_of_faces(const perp__axes *axes, double touching, double *normal, double *within)
{
    const double *found[PERP__MAX_AXES];
    int32_t count = 0, flush = 0;
    normal[0] = normal[1] = normal[2] = 0.0;
    for (int32_t k = 0; k < axes->faces[0] + axes->faces[1]; k++) {
        bool touches = fabs(axes->axis[k].separation) <= touching, another = touches;
        for (int32_t i = 0; i < count && another; i++)
            another = !perp__is_same_way(perp__dot3(found[i], axes->axis[k].normal));
        flush |= touches && !another;
        if (!another)
            continue;
        found[count++] = axes->axis[k].normal;
        perp__add3(normal, 1.0, axes->axis[k].normal);
    }
    perp__normalise3(normal);
    if (within)
        *within = flush ? 0.0 : 1.0;
    for (int32_t i = 0; i < count && within; i++)
        *within = perp__lesser(*within, perp__dot3(found[i], normal));
    return count > 1;
}
