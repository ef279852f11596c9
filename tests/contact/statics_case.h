/* Bodies that touch, as rows of H and G in general coordinates, one call of
 * perp_contact_statics, and what its answer has to obey, from the caller's own numbers in
 * extended precision. */
#ifndef PERP_TESTS_STATICS_CASE_H
#define PERP_TESTS_STATICS_CASE_H

#include <float.h>
#include <math.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

#include "gen.h"

enum { CASE_N = 192, CASE_ROWS = 400, CASE_BODIES = 64, CASE_GROUND = -1 };
enum { CASE_CONTACTS = 160, CASE_BOUNDED = 16, CASE_JOINTS = 32 };

typedef struct statics_case {
    int32_t width, n; /* coordinates of a body: 1, 3 (x, y, turn) or 6 */
    int32_t contacts, bounded, joints, rows, loaded;
    double center[CASE_BODIES][3];
    int32_t dims[CASE_CONTACTS];
    double mu[CASE_CONTACTS], rolling[CASE_CONTACTS], spinning[CASE_CONTACTS];
    double lower[CASE_BOUNDED], upper[CASE_BOUNDED];
    double H[CASE_ROWS * CASE_N], G[CASE_JOINTS * CASE_N]; /* row by row, n apart */
    double f[CASE_N], load[CASE_N];
    perp_contact_laws laws;
    perp_matrix H_view, G_view;
    perp_statics_problem problem;
    perp_statics_settings settings;
    double r[CASE_ROWS + CASE_JOINTS], v[CASE_N];
    perp_statics_result result;
} statics_case;

/* Bodies of `width` coordinates, all at the origin, without rows and forces. */
static inline void case_begin(statics_case *c, int32_t width, int32_t bodies)
{
    c->width = width;
    c->n = width * bodies;
    c->contacts = c->bounded = c->joints = c->rows = c->loaded = 0;
    assert_true(c->n <= CASE_N && bodies <= CASE_BODIES);
    memset(c->center, 0, sizeof c->center);
    memset(c->f, 0, sizeof c->f);
    memset(c->load, 0, sizeof c->load);
    perp_struct_init(&c->settings, sizeof c->settings);
}

/* row += sign times the velocity of a body's point p along d; turns: of its turning about d. */
static inline void case_push(const statics_case *c, double *row, int32_t body, double sign,
                             const double p[3], const double d[3], int32_t turns)
{
    double arm[3] = {0.0}, moment[3];
    int32_t k;

    if (body == CASE_GROUND)
        return;
    for (k = 0; k < 3; k++)
        arm[k] = p[k] - c->center[body][k];
    for (k = 0; k < 3; k++)
        moment[k] =
            turns ? d[k] : arm[(k + 1) % 3] * d[(k + 2) % 3] - arm[(k + 2) % 3] * d[(k + 1) % 3];
    row += body * c->width;
    for (k = 0; k < 3; k++)
        if (c->width == 6) {
            row[k] += turns ? 0.0 : sign * d[k];
            row[3 + k] += sign * moment[k];
        }
    if (c->width == 3) {
        row[0] += turns ? 0.0 : sign * d[0];
        row[1] += turns ? 0.0 : sign * d[1];
        row[2] += sign * moment[2];
    }
    if (c->width == 1)
        row[0] += sign * d[0];
}

static inline void case_row(statics_case *c, double *row, int32_t a, int32_t b, const double p[3],
                            const double d[3], int32_t turns)
{
    memset(row, 0, (size_t)c->n * sizeof *row);
    case_push(c, row, a, 1.0, p, d, turns);
    case_push(c, row, b, -1.0, p, d, turns);
}

static inline double *case_next(statics_case *c)
{
    assert_true(c->rows < CASE_ROWS);
    return c->H + c->n * c->rows++;
}

/* Two directions that make a right-handed system with the unit vector `normal`, turned by `angle`.
 */
static inline void case_tangents(const double normal[3], double angle, double t[2][3])
{
    const double side[3] = {fabs(normal[0]) > 0.7 ? 0.0 : 1.0, fabs(normal[0]) > 0.7 ? 1.0 : 0.0,
                            0};
    double a[3], b[3], size = 0.0, along = 0.0;
    int32_t k;

    for (k = 0; k < 3; k++)
        along += side[k] * normal[k];
    for (k = 0; k < 3; k++) {
        a[k] = side[k] - along * normal[k];
        size += a[k] * a[k];
    }
    for (k = 0; k < 3; k++)
        a[k] /= sqrt(size);
    for (k = 0; k < 3; k++)
        b[k] = normal[(k + 1) % 3] * a[(k + 2) % 3] - normal[(k + 2) % 3] * a[(k + 1) % 3];
    for (k = 0; k < 3; k++) {
        t[0][k] = cos(angle) * a[k] + sin(angle) * b[k];
        t[1][k] = cos(angle) * b[k] - sin(angle) * a[k];
    }
}

/* A contact at p that pushes a along the normal, and b the other way. mu < 0: of dimension 1. */
static inline void case_contact_at(statics_case *c, int32_t a, int32_t b, const double p[3],
                                   const double normal[3], double angle, double mu, double rolling,
                                   double spinning)
{
    const int32_t tangents = mu < 0.0 ? 0 : c->width == 6 ? 2 : 1, k = c->contacts++;
    const double flat[3] = {-normal[1], normal[0], 0.0}, up[3] = {0.0, 0.0, 1.0};
    double t[2][3];
    int32_t i;

    assert_true(k < CASE_CONTACTS);
    c->dims[k] = 1 + tangents;
    c->mu[k] = fmax(mu, 0.0);
    c->rolling[k] = rolling;
    c->spinning[k] = spinning;
    case_row(c, case_next(c), a, b, p, normal, 0);
    case_tangents(normal, angle, t);
    for (i = 0; i < tangents; i++)
        case_row(c, case_next(c), a, b, p, tangents == 1 ? flat : t[i], 0);
    for (i = 0; i < tangents && rolling > 0.0; i++)
        case_row(c, case_next(c), a, b, p, tangents == 1 ? up : t[i], 1);
    if (spinning > 0.0)
        case_row(c, case_next(c), a, b, p, normal, 1);
}

static inline void case_contact(statics_case *c, int32_t a, int32_t b, double x, double y, double z,
                                double nx, double ny, double nz, double mu)
{
    const double p[3] = {x, y, z}, normal[3] = {nx, ny, nz};

    case_contact_at(c, a, b, p, normal, 0.0, mu, 0.0, 0.0);
}

/* Contacts at the corners of a rectangle whose sides are x and y: width 6 only. */
static inline void case_corners(statics_case *c, int32_t a, int32_t b, double x, double y, double z,
                                double half_x, double half_y, double mu)
{
    int32_t k;

    for (k = 0; k < 4; k++)
        case_contact(c, a, b, x + (k & 1 ? half_x : -half_x), y + (k & 2 ? half_y : -half_y), z,
                     0.0, 0.0, 1.0, mu);
}

/* A row with bounds, after all contacts; returns its place. */
static inline double *case_bounded(statics_case *c, double lower, double upper)
{
    double *row = case_next(c);

    assert_true(c->bounded < CASE_BOUNDED);
    memset(row, 0, (size_t)c->n * sizeof *row);
    c->lower[c->bounded] = lower;
    c->upper[c->bounded++] = upper;
    return row;
}

/* A bilateral row along d at p. */
static inline void case_joint(statics_case *c, int32_t a, int32_t b, const double p[3],
                              const double d[3], int32_t turns)
{
    assert_true(c->joints < CASE_JOINTS);
    case_row(c, c->G + c->n * c->joints++, a, b, p, d, turns);
}

/* The problem as dense rows; views may be changed then. */
static inline void case_pose(statics_case *c)
{
    const int32_t n = c->n > 0 ? c->n : 1;

    assert_int_equal(perp_contact_laws_init(&c->laws, sizeof c->laws), PERP_OK);
    assert_int_equal(perp_struct_init(&c->H_view, sizeof c->H_view), PERP_OK);
    assert_int_equal(perp_struct_init(&c->G_view, sizeof c->G_view), PERP_OK);
    assert_int_equal(perp_struct_init(&c->problem, sizeof c->problem), PERP_OK);
    assert_int_equal(perp_struct_init(&c->result, sizeof c->result), PERP_OK);
    perp_matrix_dense(&c->H_view, PERP_STORAGE_ROW_MAJOR, c->rows, c->n, c->H, n);
    perp_matrix_dense(&c->G_view, PERP_STORAGE_ROW_MAJOR, c->joints, c->n, c->G, n);
    c->laws.contacts = c->contacts;
    c->laws.dims = c->dims;
    c->laws.mu = c->mu;
    c->laws.rolling = c->rolling;
    c->laws.spinning = c->spinning;
    c->laws.bounded = c->bounded;
    c->laws.lower = c->lower;
    c->laws.upper = c->upper;
    c->problem.n = c->n;
    c->problem.laws = &c->laws;
    c->problem.H = &c->H_view;
    c->problem.G = c->joints > 0 ? &c->G_view : NULL;
    c->problem.f = c->f;
    c->problem.load = c->loaded ? c->load : NULL;
}

static inline perp_status case_call(statics_case *c, perp_context *context)
{
    int32_t i;

    for (i = 0; i < c->rows + c->joints; i++)
        c->r[i] = 123.25;
    for (i = 0; i < c->n; i++)
        c->v[i] = 123.25;
    return perp_contact_statics(context, c->r, c->v, &c->result, &c->problem, &c->settings);
}

static inline double case_force(const statics_case *c, int32_t j)
{
    return c->f[j] + (c->loaded ? c->load[j] : 0.0);
}

/* |r_t| <= factor r_n; exactly, to a bit of extended precision. */
static inline void case_check_disc(const char *name, int32_t k, const double *r, int32_t rows,
                                   double normal, double factor)
{
    const long double size = rows == 0   ? 0.0L
                             : rows == 1 ? fabsl(r[0])
                                         : hypotl((long double)r[0], (long double)r[1]);

    if (size > (long double)factor * normal * (1.0L + 4.0L * LDBL_EPSILON))
        fail_msg("%s: contact %d leaves its cone: |%.17g, %.17g| > %.17g times %.17g, by %.2Lg",
                 name, (int)k, r[0], rows > 1 ? r[1] : 0.0, factor, normal,
                 size / ((long double)factor * normal) - 1.0L);
}

/* Impulses in their cones and bounds, and in balance with all forces: what is left of a body's
 * coordinates beside the largest sum of terms there, 1e-12 (statics.c, BALANCED). */
static inline void case_check_stands(const char *name, const statics_case *c)
{
    const double *r = c->r;
    int32_t i, j, k, row = 0;

    for (k = 0; k < c->contacts; k++) {
        const int32_t tangents = c->dims[k] - 1, rolls = c->rolling[k] > 0.0 ? tangents : 0;
        const double normal = r[row++];

        if (!(normal >= 0.0))
            fail_msg("%s: contact %d pulls by %g", name, (int)k, normal);
        case_check_disc(name, k, r + row, tangents, normal, c->mu[k]);
        case_check_disc(name, k, r + row + tangents, rolls, normal, c->rolling[k]);
        case_check_disc(name, k, r + row + tangents + rolls, c->spinning[k] > 0.0, normal,
                        c->spinning[k]);
        row += tangents + rolls + (c->spinning[k] > 0.0);
    }
    for (k = 0; k < c->bounded; k++, row++)
        if (!(c->lower[k] <= r[row] && r[row] <= c->upper[k]))
            fail_msg("%s: row %d: %.17g leaves [%g, %g]", name, (int)k, r[row], c->lower[k],
                     c->upper[k]);
    for (i = 0; i < c->n; i += c->width) {
        long double left = 0.0L, most = 0.0L;

        for (j = i; j < i + c->width; j++) {
            long double sum = (long double)c->f[j] + (c->loaded ? c->load[j] : 0.0);
            long double terms = fabsl(sum);

            for (k = 0; k < c->rows + c->joints; k++) {
                const double *H = k < c->rows ? c->H + k * c->n : c->G + (k - c->rows) * c->n;

                sum += (long double)H[j] * r[k];
                terms += fabsl((long double)H[j] * r[k]);
            }
            left = fmaxl(left, fabsl(sum));
            most = fmaxl(most, terms);
        }
        if (left > 1e-12L * most)
            fail_msg("%s: body %d lacks %.3Lg of %.3Lg", name, (int)(i / c->width), left, most);
    }
    if (!(c->result.unbalance <= 1e-12))
        fail_msg("%s: unbalance %g", name, c->result.unbalance);
}

/* |row| of the largest |v| in coordinates in which columns of H and G have size 1. */
static inline double case_reach(const statics_case *c, const double *row, const double *scale,
                                double most)
{
    double sum = 0.0;
    int32_t j;

    for (j = 0; j < c->n; j++)
        sum += fabs(row[j]) / scale[j];
    return sum * most;
}

static inline double case_speed(const statics_case *c, const double *row)
{
    long double sum = 0.0L;
    int32_t j;

    for (j = 0; j < c->n; j++)
        sum += (long double)row[j] * c->v[j];
    return (double)sum;
}

/* The virtual velocity proves that nothing stands: to 1e-9 of |v| in every row, and with more work
 * than 10 times all forces together could do on what rows lack. */
static inline void case_check_falls(const char *name, const statics_case *c)
{
    double scale[CASE_N], most = 0.0, forces = 0.0, work = 0.0, lacks = 0.0, size = 0.0;
    double largest = 0.0;
    int32_t i, j, k, row = 0;

    for (j = 0; j < c->n; j++) {
        scale[j] = 0.0;
        for (k = 0; k < c->rows; k++)
            scale[j] = fmax(scale[j], fabs(c->H[k * c->n + j]));
        for (k = 0; k < c->joints; k++)
            scale[j] = fmax(scale[j], fabs(c->G[k * c->n + j]));
        largest = fmax(largest, scale[j]);
    }
    for (j = 0; j < c->n; j++) {
        if (!(scale[j] > 1e-12 * largest)) /* noise stays so */
            scale[j] = largest > 0.0 ? largest : 1.0;
        most = fmax(most, scale[j] * fabs(c->v[j]));
        size = fmax(size, fabs(c->v[j]));
        forces += fabs(case_force(c, j)) / scale[j];
        work += case_force(c, j) * c->v[j];
    }
    if (!(size <= 1.0 && size > 0.5))
        fail_msg("%s: |v| is %g", name, size);
    for (k = 0; k < c->contacts; k++) {
        const int32_t tangents = c->dims[k] - 1, rolls = c->rolling[k] > 0.0 ? tangents : 0;
        const double *H = c->H + row * c->n;
        double u[6] = {0.0}, lack, reach = 0.0;
        const int32_t rows = 1 + tangents + rolls + (c->spinning[k] > 0.0);

        for (i = 0; i < rows; i++) {
            u[i] = case_speed(c, H + i * c->n);
            reach += case_reach(c, H + i * c->n, scale, most);
        }
        lack = c->mu[k] * hypot(tangents > 0 ? u[1] : 0.0, tangents > 1 ? u[2] : 0.0) - u[0];
        lack += c->rolling[k] * (rolls > 0 ? hypot(u[1 + tangents], rolls > 1 ? u[4] : 0.0) : 0.0);
        lack += c->spinning[k] * (c->spinning[k] > 0.0 ? fabs(u[rows - 1]) : 0.0);
        if (lack > 1e-9 * (1.0 + c->mu[k]) * reach)
            fail_msg("%s: contact %d: certificate lacks %.3g of %.3g", name, (int)k, lack, reach);
        lacks += fmax(lack, 0.0);
        row += rows;
    }
    for (k = 0; k < c->bounded + c->joints; k++) {
        const double *H = k < c->bounded ? c->H + (row + k) * c->n : c->G + (k - c->bounded) * c->n;
        const double u = case_speed(c, H);
        const double bound = k >= c->bounded ? INFINITY : u > 0.0 ? -c->lower[k] : c->upper[k];

        if (k < c->bounded && isfinite(bound)) {
            work -= bound * fabs(u);
            continue;
        }
        if (fabs(u) > 1e-9 * case_reach(c, H, scale, most))
            fail_msg("%s: row %d: certificate lacks %.3g of %.3g", name, (int)k, u,
                     case_reach(c, H, scale, most));
        lacks += fabs(u);
    }
    if (!(work > 0.0) || !(work > 10.0 * forces * lacks))
        fail_msg("%s: the certificate does work %.3g; rows lack %.3g, forces are %.3g", name, work,
                 lacks, forces);
    if (fabs(work - c->result.work) > 1e-9 * fabs(work) + 1e-13 * forces * most)
        fail_msg("%s: work %.17g instead of %.17g", name, c->result.work, work);
}

/* Calls, and checks whatever the verdict is; outputs that it does not concern are untouched. */
static inline int32_t case_decide(const char *name, statics_case *c, perp_context *context)
{
    const int32_t stands =
        (case_call(c, context) == PERP_OK) && c->result.verdict == PERP_STATICS_STANDS;
    int32_t i;

    if (perp_context_message(context)[0] != '\0')
        fail_msg("%s: %s", name, perp_context_message(context));
    if (stands)
        case_check_stands(name, c);
    if (c->result.verdict == PERP_STATICS_FALLS)
        case_check_falls(name, c);
    for (i = 0; i < c->n && c->result.verdict != PERP_STATICS_FALLS; i++)
        assert_true(c->v[i] == 123.25);
    for (i = 0; i < c->rows + c->joints && !stands; i++)
        assert_true(c->r[i] == 123.25);
    return c->result.verdict;
}

static inline void case_require(const char *name, statics_case *c, perp_context *context,
                                int32_t verdict)
{
    case_pose(c);
    if (case_decide(name, c, context) != verdict)
        fail_msg("%s: %s instead of %s, margin %g, %d iterations", name,
                 perp_statics_verdict_text(c->result.verdict), perp_statics_verdict_text(verdict),
                 c->result.margin, (int)c->result.iterations);
}

#endif
