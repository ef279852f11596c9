/* Natural maps in forms that do not cancel: r - P(r - d) is d where r - d is inside, and d plus
 * what P takes away where it is not, with |r - d| - |r| = (|d|^2 - 2 r.d) / (|r - d| + |r|). */
#include "contact/law.h"

#include <math.h>
#include <string.h>

#include <perp/contact.h>

#include "base/outcome.h"
#include "linalg/spatial.h"

int32_t perp__contact_parts(const perp__contact_problem *problem, int32_t k,
                            perp__contact_part parts[3])
{
    const int32_t normals = perp__contact_normals(problem, k);
    const int32_t tangents = problem->dims[k] - normals;
    int32_t row = problem->starts[k] + normals, count = 0;

    if (tangents > 0) {
        parts[count++] = (perp__contact_part){row, tangents, problem->mu[k]};
        row += tangents;
    }
    if (problem->rolling && problem->rolling[k] > 0.0) {
        parts[count++] = (perp__contact_part){row, tangents, problem->rolling[k]};
        row += tangents;
    }
    if (problem->spinning && problem->spinning[k] > 0.0)
        parts[count++] = (perp__contact_part){row, 1, problem->spinning[k]};
    return count;
}

void perp__contact_direction(int32_t edges, int32_t j, double d[2])
{
    const bool opposite = edges % 2 == 0 && j >= edges / 2;
    const int32_t i = opposite ? j - edges / 2 : j;

    if (4 * i % edges == 0) {
        d[0] = i == 0 ? 1.0 : 4 * i == 2 * edges ? -1.0 : 0.0;
        d[1] = 4 * i == edges ? 1.0 : 4 * i == 3 * edges ? -1.0 : 0.0;
    } else {
        d[0] = cos(2.0 * PERP__PI * i / edges);
        d[1] = sin(2.0 * PERP__PI * i / edges);
    }
    if (opposite) {
        d[0] = 0.0 - d[0];
        d[1] = 0.0 - d[1];
    }
}

/* Whether x is outside of the polygon of `radius`. nearest := P(x), excess := x - P(x): each in a
 * form that does not cancel, far from the polygon the one and next to it the other. */
static bool polygon_excess(int32_t edges, double radius, const double x[2], double nearest[2],
                           double excess[2])
{
    double angle = atan2(x[1], x[0]), a[2], b[2], normal[2], length, out, along, span;
    int32_t j = isnan(angle) ? 0 : (int32_t)floor(angle * edges / (2.0 * PERP__PI));

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
    span = radius * sin(PERP__PI / edges);
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

static inline double norm(const double *x, int32_t size)
{
    return size == 1 ? fabs(x[0]) : perp__length2(x[0], x[1]);
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
static bool part_map(const perp__contact_problem *problem, const perp__contact_part *part,
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
    const double speed = perp__length2(u[0], u[1]);
    int32_t j = (int32_t)floor(atan2(r[1], r[0]) * edges / (2.0 * PERP__PI));
    double angle = PERP__PI * (2 * j + 1) / edges, width = 0.0, along;

    if (r[0] * cos(angle) + r[1] * sin(angle) <
        radius * (cos(PERP__PI / edges) - PERP__ROUNDING_LIMIT))
        return speed;
    along = r[1] * cos(angle) - r[0] * sin(angle);
    if (fabs(along) > radius * (sin(PERP__PI / edges) - PERP__ROUNDING_LIMIT)) {
        angle += along > 0.0 ? PERP__PI / edges : -PERP__PI / edges;
        width = PERP__PI / edges;
    }
    /* angle from there to -u */
    angle =
        fabs(atan2(u[0] * sin(angle) - u[1] * cos(angle), -u[0] * cos(angle) - u[1] * sin(angle)));
    if (angle <= width)
        return 0.0;
    return angle - width < 0.5 * PERP__PI ? speed * sin(angle - width) : speed;
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
    if (length < radius * (1.0 - PERP__ROUNDING_LIMIT))
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
        return perp__length2(r_n, norm(r, part->size));
    }
    if (mu == 0.0) {
        *mode = length > 0.0 ? PERP_CONTACT_SLIP : PERP_CONTACT_STICK;
        return fabs(d_n);
    }
    if (length <= mu * x_n) {
        *mode = PERP_CONTACT_STICK;
        return perp__length2(d_n, norm(d, part->size));
    }
    *mode = PERP_CONTACT_SLIP;
    over = norm(r, part->size) - mu * r_n + mu * d_n;
    for (i = 0; i < part->size; i++)
        over += d[i] * (d[i] - 2.0 * r[i]) / (length + norm(r, part->size));
    c = over / (1.0 + mu * mu);
    out_n = d_n - mu * c;
    for (sum = 0.0, i = 0; i < part->size; i++)
        sum = perp__length2(sum, d[i] + c * (x[i] / length));
    return perp__length2(out_n, sum);
}

void perp__contact_outcome_of(const perp__contact_problem *problem, int32_t k, const double *r,
                              const double *u, perp__contact_law *law)
{
    const int32_t row = problem->starts[k], both = perp__contact_two_sided(problem, k);
    const bool given = perp__contact_is_bound(problem, k);
    const double t = problem->trace[k], speed = perp__contact_length(u, row, row + both);
    const double r_n = given ? problem->bound[k] : perp__contact_pressure(problem, k, r);
    const double u_n = both > 0 ? -INFINITY : given ? 0.0 : u[row];
    perp__contact_part parts[3];
    const int32_t count = perp__contact_parts(problem, k, parts);
    double d[2] = {0.0, 0.0}, out[2];
    bool slips = 0;

    /* 1. The normal law; u_N = 0 of one that holds both ways. */
    law->signorini = law->bilateral = law->cone = law->dissipation = 0.0;
    if (both > 0) {
        law->bilateral = speed / t;
        law->change = speed;
    } else {
        law->signorini = fabs(fmin(r_n, u_n / t));
        law->change = r_n > 0.0 ? fabs(u_n) : fmax(0.0, 0.0 - u_n);
    }
    /* 2. Each part beside r_n or |r_N|. One that carries nothing slips where it moves. */
    for (int32_t p = 0; p < count; p++) {
        const double radius = parts[p].coefficient * r_n;
        const double *r_p = r + parts[p].row, *u_p = u + parts[p].row;

        for (int32_t i = 0; i < parts[p].size; i++)
            d[i] = u_p[i] / t;
        slips |= part_map(problem, &parts[p], radius, r_p, d, out);
        law->cone = fmax(law->cone, norm(r_p, parts[p].size) - radius);
        law->dissipation = perp__length2(law->dissipation, norm(out, parts[p].size));
        if (r_n > 0.0)
            law->change =
                perp__length2(law->change, part_change(problem, &parts[p], radius, r_p, u_p));
    }
    law->natural = perp__length2(both > 0 ? law->bilateral : law->signorini, law->dissipation);
    law->mode = r_n <= u_n / t ? PERP_CONTACT_SEPARATE
                : slips        ? PERP_CONTACT_SLIP
                               : PERP_CONTACT_STICK;
    /* 3. The cone as a whole, where it is one; d is that of the one part. */
    if (count == 1 && both == 0 && !given && problem->cone == 0 && problem->mu[k] <= PERP__STEEP)
        law->natural =
            cone_map(&parts[0], r_n, u_n / t + parts[0].coefficient * norm(d, parts[0].size),
                     r + parts[0].row, d, &law->mode);
}

double perp__contact_natural(const perp__contact_problem *problem, int32_t k, const double *r,
                             const double *u, int32_t *mode)
{
    const int32_t row = problem->starts[k];
    const perp__contact_part part = {row + 1, problem->dims[k] - 1, problem->mu[k]};
    const double t = problem->trace[k];
    double d[2] = {0.0, 0.0};
    perp__contact_law law;

    if (problem->has_discs || problem->cone > 0 || problem->bound || problem->two_sided ||
        part.size == 0 || part.coefficient > PERP__STEEP) {
        perp__contact_outcome_of(problem, k, r, u, &law);
        *mode = law.mode;
        return law.natural;
    }
    for (int32_t i = 0; i < part.size; i++)
        d[i] = u[part.row + i] / t;
    return cone_map(&part, r[row], u[row] / t + part.coefficient * norm(d, part.size), r + part.row,
                    d, mode);
}

double perp__contact_tested(const perp__contact_problem *problem, const double *r, const double *u)
{
    const int32_t constraints = problem->contacts + problem->size - problem->rows;
    double most = 0.0;
    int32_t mode;

    for (int32_t k = 0; k < constraints; k++) {
        const double t = problem->trace[k];
        const double natural = k < problem->contacts
                                   ? perp__contact_natural(problem, k, r, u, &mode)
                                   : fabs(u[perp__contact_first_row(problem, k)]) / t;
        const double tested = sqrt(t) / problem->omega[k] * natural;

        if (!(tested <= most) && !isnan(most)) /* NaN stays */
            most = tested;
    }
    return most;
}

void perp__contact_omegas(const perp__contact_problem *problem, const int32_t *part, int32_t parts,
                          double *drive, double *omega)
{
    const int32_t constraints = problem->contacts + problem->size - problem->rows;

    for (int32_t k = 0; k < parts; k++)
        drive[k] = 0.0;
    for (int32_t k = 0; k < constraints; k++) {
        const int32_t begin = perp__contact_first_row(problem, k);
        const int32_t end = problem->starts[k + 1];
        const double trace = problem->trace[k];
        double sum = 0.0, share = perp__contact_length(problem->q, begin, end) / sqrt(trace);

        for (int32_t i = begin; i < end; i++)
            sum += problem->q[i] * problem->q[i];
        /* with one rounding less where that leaves no square out of range */
        if (sum >= PERP__SMALL && sum <= 1.0 / PERP__SMALL && trace >= PERP__SMALL &&
            trace <= 1.0 / PERP__SMALL)
            share = sqrt(sum / trace);
        perp__raise_to(&drive[part ? part[k] : 0], share);
    }
    for (int32_t k = 0; k < constraints; k++)
        omega[k] = drive[part ? part[k] : 0] == 0.0 ? 1.0 : drive[part ? part[k] : 0];
}

double perp__contact_power_near(double x)
{
    int exponent = 0;

    if (x > 0.0 && x < INFINITY)
        (void)frexp(x, &exponent);
    return ldexp(1.0, exponent > 1000 ? 1000 : exponent < -1000 ? -1000 : exponent);
}

void perp__contact_units(const perp__contact_problem *problem, int32_t k, double *impulse,
                         double *velocity)
{
    const double root = sqrt(problem->trace[k]);

    *impulse = perp__contact_power_near(problem->omega[k] / root);
    *velocity = perp__contact_power_near(problem->omega[k] * root);
}
