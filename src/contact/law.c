/* Natural maps in forms that do not cancel: r - P(r - d) is d where r - d is inside, and d plus
 * what P takes away where it is not, with |r - d| - |r| = (|d|^2 - 2 r.d) / (|r - d| + |r|). */
#include "contact/law.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include <perp/contact.h>

#include "base/outcome.h"

/* A sum of squares between this and its inverse has lost nothing to the range of doubles; nor has
 * the quotient of two such. */
#define SMALL 1e-150

/* Of the radius: r nearer to the edge of its disc than this is on it. */
#define EDGE (8.0 * DBL_EPSILON)

int32_t perp__contact_parts(const perp__contact_problem *problem, int32_t k,
                            perp__contact_part parts[3])
{
    const int32_t normals = perp__contact_normals(problem, k);
    const int32_t tangents = problem->dims[k] - normals;
    int32_t row = problem->starts[k] + normals, count = 0;

    if (tangents > 0) {
        parts[count].row = row;
        parts[count].size = tangents;
        parts[count++].coefficient = problem->mu[k];
        row += tangents;
    }
    if (problem->rolling && problem->rolling[k] > 0.0) {
        parts[count].row = row;
        parts[count].size = tangents;
        parts[count++].coefficient = problem->rolling[k];
        row += tangents;
    }
    if (problem->spinning && problem->spinning[k] > 0.0) {
        parts[count].row = row;
        parts[count].size = 1;
        parts[count++].coefficient = problem->spinning[k];
    }
    return count;
}

void perp__contact_direction(int32_t edges, int32_t j, double d[2])
{
    const double pi = 3.14159265358979323846;
    const int32_t opposite = edges % 2 == 0 && j >= edges / 2;
    const int32_t i = opposite ? j - edges / 2 : j;

    if (4 * i % edges == 0) {
        d[0] = i == 0 ? 1.0 : 4 * i == 2 * edges ? -1.0 : 0.0;
        d[1] = 4 * i == edges ? 1.0 : 4 * i == 3 * edges ? -1.0 : 0.0;
    } else {
        d[0] = cos(2.0 * pi * i / edges);
        d[1] = sin(2.0 * pi * i / edges);
    }
    if (opposite) {
        d[0] = 0.0 - d[0];
        d[1] = 0.0 - d[1];
    }
}

/* Whether x is outside of the polygon of `radius`. nearest := P(x), excess := x - P(x): each in a
 * form that does not cancel, far from the polygon the one and next to it the other. */
static int32_t polygon_excess(int32_t edges, double radius, const double x[2], double nearest[2],
                              double excess[2])
{
    const double pi = 3.14159265358979323846;
    double angle = atan2(x[1], x[0]), a[2], b[2], normal[2], length, out, along, span;
    int32_t j = isnan(angle) ? 0 : (int32_t)floor(angle * edges / (2.0 * pi));

    j = (j % edges + edges) % edges;
    perp__contact_direction(edges, j, a);
    perp__contact_direction(edges, (j + 1) % edges, b);
    normal[0] = a[0] + b[0];
    normal[1] = a[1] + b[1];
    length = hypot(normal[0], normal[1]);
    normal[0] /= length;
    normal[1] /= length;
    out = normal[0] * x[0] + normal[1] * x[1] - radius * (0.5 * length);
    excess[0] = excess[1] = 0.0;
    if (!(out > 0.0))
        return 0;
    /* along the edge, from its middle; beyond its ends the vertex is nearest */
    along = normal[0] * x[1] - normal[1] * x[0];
    span = radius * sin(pi / edges);
    if (fabs(along) <= span) {
        nearest[0] = radius * (0.5 * length) * normal[0] - along * normal[1];
        nearest[1] = radius * (0.5 * length) * normal[1] + along * normal[0];
        excess[0] = out * normal[0];
        excess[1] = out * normal[1];
        return 1;
    }
    for (int32_t i = 0; i < 2; i++) {
        nearest[i] = radius * (along > 0.0 ? b[i] : a[i]);
        excess[i] = x[i] - nearest[i];
    }
    return 1;
}

/* hypot, by the square root where no square leaves the range of doubles. */
static inline double norm2(double a, double b)
{
    const double sum = a * a + b * b;

    if (sum >= SMALL && sum <= 1.0 / SMALL)
        return sqrt(sum);
    return a == 0.0 && b == 0.0 ? 0.0 : hypot(a, b);
}

static inline double norm(const double *x, int32_t size)
{
    return size == 1 ? fabs(x[0]) : norm2(x[0], x[1]);
}

void perp__contact_clip(const perp__contact_problem *problem, int32_t k, double *r)
{
    const int32_t normal = problem->starts[k];
    perp__contact_part parts[3];
    const int32_t count = perp__contact_parts(problem, k, parts);
    double pressure;

    if (perp__contact_is_bound(problem, k))
        r[normal] = problem->bound[k];
    else if (!(r[normal] > 0.0) && perp__contact_two_sided(problem, k) == 0)
        r[normal] = 0.0;
    pressure = perp__contact_pressure(problem, k, r);
    for (int32_t p = 0; p < count; p++) {
        double *x = r + parts[p].row, nearest[2], excess[2];
        /* pressures of both ways may be beyond the range of doubles */
        const double radius = parts[p].coefficient > 0.0 ? parts[p].coefficient * pressure : 0.0;
        const double length = norm(x, parts[p].size);

        if (radius == 0.0) {
            for (int32_t i = 0; i < parts[p].size; i++)
                x[i] = 0.0;
        } else if (parts[p].size == 2 && problem->cone > 0) {
            if (polygon_excess(problem->cone, radius, x, nearest, excess))
                memcpy(x, nearest, sizeof nearest);
        } else if (length > radius) {
            for (int32_t i = 0; i < parts[p].size; i++)
                x[i] *= radius / length;
        }
    }
}

/* out := r - P_D(r - d). Returns whether r - d is outside of the disc. */
static int32_t part_map(const perp__contact_problem *problem, const perp__contact_part *part,
                        double radius, const double *r, const double *d, double *out)
{
    double x[2] = {0.0, 0.0}, nearest[2], excess[2], length, over;

    for (int32_t i = 0; i < part->size; i++) {
        x[i] = r[i] - d[i];
        out[i] = d[i];
    }
    if (radius == 0.0) {
        for (int32_t i = 0; i < part->size; i++)
            out[i] = r[i];
        return norm(d, part->size) > 0.0;
    }
    if (part->size == 2 && problem->cone > 0) {
        if (!polygon_excess(problem->cone, radius, x, nearest, excess))
            return 0;
        out[0] += excess[0];
        out[1] += excess[1];
        return 1;
    }
    length = norm(x, part->size);
    if (length <= radius)
        return 0;
    over = norm(r, part->size) - radius;
    for (int32_t i = 0; i < part->size; i++)
        over += d[i] * (d[i] - 2.0 * r[i]) / (length + norm(r, part->size));
    for (int32_t i = 0; i < part->size; i++)
        out[i] += over * (x[i] / length);
    return 1;
}

/* Distance of -u from the normal cone of the polygon at r: nothing inside, the normal on an edge,
 * all between the normals of its two edges at a vertex. */
static double polygon_change(int32_t edges, double radius, const double *r, const double *u)
{
    const double pi = 3.14159265358979323846;
    const double speed = norm2(u[0], u[1]);
    int32_t j = (int32_t)floor(atan2(r[1], r[0]) * edges / (2.0 * pi));
    double angle = pi * (2 * j + 1) / edges, width = 0.0, along;

    if (r[0] * cos(angle) + r[1] * sin(angle) < radius * (cos(pi / edges) - EDGE))
        return speed;
    along = r[1] * cos(angle) - r[0] * sin(angle);
    if (fabs(along) > radius * (sin(pi / edges) - EDGE)) {
        angle += along > 0.0 ? pi / edges : -pi / edges;
        width = pi / edges;
    }
    /* angle from there to -u */
    angle =
        fabs(atan2(u[0] * sin(angle) - u[1] * cos(angle), -u[0] * cos(angle) - u[1] * sin(angle)));
    if (angle <= width)
        return 0.0;
    return angle - width < 0.5 * pi ? speed * sin(angle - width) : speed;
}

/* Smallest change of the part's u for which -u is in the normal cone of the disc at r. */
static double part_change(const perp__contact_problem *problem, const perp__contact_part *part,
                          double radius, const double *r, const double *u)
{
    const double length = norm(r, part->size), speed = norm(u, part->size);
    double against = 0.0, across;

    if (radius == 0.0)
        return 0.0;
    if (part->size == 2 && problem->cone > 0)
        return polygon_change(problem->cone, radius, r, u);
    if (length < radius * (1.0 - EDGE))
        return speed;
    for (int32_t i = 0; i < part->size; i++)
        against += r[i] * u[i] / length;
    if (against >= 0.0 || part->size == 1)
        return against >= 0.0 ? speed : 0.0;
    across = (r[0] * u[1] - r[1] * u[0]) / length;
    return fabs(across);
}

/* |r - P_K(r - d)| for the exact cone, d = (u + s e_n) / t. */
static double cone_map(const perp__contact_part *part, double r_n, double d_n, const double *r,
                       const double *d, int32_t *mode)
{
    const double mu = part->coefficient;
    const double x_n = r_n - d_n;
    double x[2], length, over, c, out_n, sum;
    int32_t i;

    for (i = 0; i < part->size; i++)
        x[i] = r[i] - d[i];
    length = norm(x, part->size);
    if (mu * length <= -x_n || (mu == 0.0 && x_n <= 0.0)) {
        *mode = PERP_CONTACT_SEPARATE;
        return norm2(r_n, norm(r, part->size));
    }
    if (mu == 0.0) {
        *mode = length > 0.0 ? PERP_CONTACT_SLIP : PERP_CONTACT_STICK;
        return fabs(d_n);
    }
    if (length <= mu * x_n) {
        *mode = PERP_CONTACT_STICK;
        return norm2(d_n, norm(d, part->size));
    }
    *mode = PERP_CONTACT_SLIP;
    over = norm(r, part->size) - mu * r_n + mu * d_n;
    for (i = 0; i < part->size; i++)
        over += d[i] * (d[i] - 2.0 * r[i]) / (length + norm(r, part->size));
    c = over / (1.0 + mu * mu);
    out_n = d_n - mu * c;
    for (sum = 0.0, i = 0; i < part->size; i++)
        sum = norm2(sum, d[i] + c * (x[i] / length));
    return norm2(out_n, sum);
}

/* A contact's impulse and velocity: along the normal, as its law sees them, and everywhere. */
typedef struct state {
    const double *r, *u;
    double r_n, u_n, t;
} state;

/* Normal and parts one by one: contacts that roll or spin, and polyhedra. */
static void judge_parts(const perp__contact_problem *problem, const perp__contact_part *parts,
                        int32_t count, const state *s, perp__contact_law *law)
{
    int32_t p, i, slips = 0;

    for (p = 0; p < count; p++) {
        const double radius = parts[p].coefficient * s->r_n;
        const double *r_p = s->r + parts[p].row, *u_p = s->u + parts[p].row;
        double d[2] = {0.0, 0.0}, out[2] = {0.0, 0.0}, length;

        for (i = 0; i < parts[p].size; i++)
            d[i] = u_p[i] / s->t;
        slips |= part_map(problem, &parts[p], radius, r_p, d, out);
        length = norm(r_p, parts[p].size) - radius;
        law->cone = fmax(law->cone, length);
        law->dissipation = norm2(law->dissipation, norm(out, parts[p].size));
        if (s->r_n > 0.0)
            law->change = norm2(law->change, part_change(problem, &parts[p], radius, r_p, u_p));
    }
    law->natural = norm2(law->signorini, law->dissipation);
    law->mode = s->r_n <= s->u_n / s->t ? PERP_CONTACT_SEPARATE
                : slips                 ? PERP_CONTACT_SLIP
                                        : PERP_CONTACT_STICK;
}

/* Both ways: u_N = 0, and the parts beside |r_N|. One that carries nothing slips where it moves. */
static void judge_two_sided(const perp__contact_problem *problem, int32_t k, const double *r,
                            const double *u, perp__contact_law *law)
{
    const int32_t row = problem->starts[k], both = problem->two_sided[k];
    const double speed = perp__contact_length(u, row, row + both);
    const state s = {r, u, perp__contact_pressure(problem, k, r), -INFINITY, problem->trace[k]};
    perp__contact_part parts[3];
    const int32_t count = perp__contact_parts(problem, k, parts);

    law->signorini = law->cone = law->dissipation = 0.0;
    law->change = speed;
    law->bilateral = speed / s.t;
    judge_parts(problem, parts, count, &s, law);
    law->natural = norm2(law->bilateral, law->dissipation);
}

void perp__contact_judge(const perp__contact_problem *problem, int32_t k, const double *r,
                         const double *u, perp__contact_law *law)
{
    const int32_t row = problem->starts[k];
    const int32_t given = perp__contact_first_row(problem, k) > row;
    const state s = {r, u, given ? problem->bound[k] : r[row], given ? 0.0 : u[row],
                     problem->trace[k]};
    perp__contact_part parts[3];
    const int32_t count = perp__contact_parts(problem, k, parts);
    double d[2] = {0.0, 0.0};

    if (perp__contact_two_sided(problem, k) > 0) {
        judge_two_sided(problem, k, r, u, law);
        return;
    }
    law->signorini = fabs(fmin(s.r_n, s.u_n / s.t));
    law->cone = law->dissipation = law->bilateral = 0.0;
    law->change = s.r_n > 0.0 ? fabs(s.u_n) : fmax(0.0, 0.0 - s.u_n);
    judge_parts(problem, parts, count, &s, law);
    if (count != 1 || problem->cone > 0 || given || problem->mu[k] > PERP__STEEP)
        return;
    for (int32_t i = 0; i < parts[0].size; i++)
        d[i] = u[parts[0].row + i] / s.t;
    law->natural =
        cone_map(&parts[0], s.r_n, s.u_n / s.t + parts[0].coefficient * norm(d, parts[0].size),
                 r + parts[0].row, d, &law->mode);
}

double perp__contact_natural_of(double mu, int32_t tangents, double t, const double *r,
                                const double *u, int32_t *mode)
{
    const perp__contact_part part = {1, tangents, mu};
    double d[2] = {0.0, 0.0};

    if (tangents == 0) {
        *mode = r[0] <= u[0] / t ? PERP_CONTACT_SEPARATE : PERP_CONTACT_STICK;
        return fabs(fmin(r[0], u[0] / t));
    }
    for (int32_t i = 0; i < tangents; i++)
        d[i] = u[1 + i] / t;
    return cone_map(&part, r[0], u[0] / t + mu * norm(d, tangents), r + 1, d, mode);
}

double perp__contact_natural(const perp__contact_problem *problem, int32_t k, const double *r,
                             const double *u, int32_t *mode)
{
    const int32_t row = problem->starts[k], tangents = problem->dims[k] - 1;
    perp__contact_law law;

    if (!(problem->has_discs || problem->cone > 0 || problem->bound || problem->two_sided ||
          problem->mu[k] > PERP__STEEP))
        return perp__contact_natural_of(problem->mu[k], tangents, problem->trace[k], r + row,
                                        u + row, mode);
    perp__contact_judge(problem, k, r, u, &law);
    *mode = law.mode;
    return law.natural;
}

double perp__contact_length(const double *x, int32_t begin, int32_t end)
{
    double sum = 0.0, length = 0.0;

    for (int32_t i = begin; i < end; i++)
        sum += x[i] * x[i];
    if (sum >= SMALL && sum <= 1.0 / SMALL)
        return sqrt(sum);
    for (int32_t i = begin; i < end; i++)
        if (x[i] != 0.0)
            length = hypot(length, x[i]);
    return length;
}

/* |q| / sqrt(trace), with one rounding less where that leaves no square out of range. */
static double share(const double *q, int32_t begin, int32_t end, double trace)
{
    double sum = 0.0;

    for (int32_t i = begin; i < end; i++)
        sum += q[i] * q[i];
    if (sum >= SMALL && sum <= 1.0 / SMALL && trace >= SMALL && trace <= 1.0 / SMALL)
        return sqrt(sum / trace);
    return perp__contact_length(q, begin, end) / sqrt(trace);
}

void perp__contact_omegas(const perp__contact_problem *problem, const int32_t *part, int32_t parts,
                          double *drive, double *omega)
{
    const int32_t constraints = problem->contacts + problem->size - problem->rows;

    for (int32_t k = 0; k < parts; k++)
        drive[k] = 0.0;
    for (int32_t k = 0; k < constraints; k++) {
        const double own = share(problem->q, perp__contact_first_row(problem, k),
                                 perp__contact_end_row(problem, k), problem->trace[k]);

        perp__raise_to(&drive[part ? part[k] : 0], own);
    }
    for (int32_t k = 0; k < constraints; k++) {
        const double own = drive[part ? part[k] : 0];

        omega[k] = own == 0.0 ? 1.0 : own;
    }
}

/* Within what has an inverse. */
static double power_near(double x)
{
    int32_t exponent = 0;

    (void)frexp(x, &exponent);
    return ldexp(1.0, exponent > 1000 ? 1000 : exponent < -1000 ? -1000 : exponent);
}

void perp__contact_units(const perp__contact_problem *problem, int32_t k, double *impulse,
                         double *velocity)
{
    const double root = sqrt(problem->trace[k]);

    *impulse = power_near(problem->omega[k] / root);
    *velocity = power_near(problem->omega[k] * root);
}
