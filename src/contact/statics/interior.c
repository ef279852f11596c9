/* Phase one of a primal-dual interior-point method that starts balanced: x with A x = b by least
 * squares, s below the worst margin of a cone, then
 *
 *   maximise s   subject to   A x = b,   z = B x + h - s e in K,   s <= 1
 *
 * A dx = 0 from then on, so that the first iterate with s > 0 is an equilibrium strictly inside all
 * cones. The dual, B'u + A'y = 0, e'u + tau = 1, u in K, is at once the proof where there is none:
 * y'b > 0. Nesterov and Todd's scaling, Mehrotra's predictor and corrector. With the units' blocks
 * S = B'G B (+ q of least squares) eliminated,
 *
 *   K dy = rb - A S^-1 p - ds g,   p = B'rc + rd,   g = A k,   k = S^-1 B'G e,   K = A S^-1 A'
 *   dx = S^-1 (p + A'dy) + ds k
 *
 * The same steps minimise |x|^2 / 2 from an x inside. Free rows, of joints, are proximal: S = rho
 * with a rho that vanishes. */
#include <math.h>
#include <string.h>

#include "base/outcome.h"
#include "contact/statics/interior.h"
#include "linalg/doubled.h"
#include "linalg/matrix.h"

/* A margin with which impulses have room for other forces, in units of each contact's load; and the
 * iterations after the first margin that are spent on it. */
#define ROOMY 0.05
#define ROOMY_ITERATIONS 2

/* Of joints, which carry what the heaviest bodies weigh, of size 1: rho beside u z. */
#define PROXIMAL 0.1

/* ---- cones of units ---- */

/* out += B'u */
static void add_dual(const perp__cone *cone, const double *u, double *out)
{
    out[0] += cone->sign * u[0];
    for (int32_t j = 1; j < cone->dim; j++)
        out[cone->first + j - 1] += cone->scale * u[j];
}

static double coefficient(const perp__cone *cone, int32_t j)
{
    return j == 0 ? cone->sign : cone->scale;
}

/* Whether S^-1 is that of the one cone that has all of the unit's rows. */
static bool is_single(const perp__statics *s, int32_t u)
{
    return s->aim == PERP__AIM_MARGIN && s->unit_cone[u + 1] == s->unit_cone[u] + 1;
}

/* Householder's reflections of M, `rows` by n + 1: R in its place, and what they make of the last
 * column. The square of what is left below that is returned. */
static double reflect(double M[][7], int32_t rows, int32_t n)
{
    double left = 0.0;

    for (int32_t j = 0; j < n; j++) {
        double norm = 0.0, pivot;

        for (int32_t i = j; i < rows; i++)
            norm = hypot(norm, M[i][j]);
        pivot = M[j][j] + copysign(norm, M[j][j]);
        for (int32_t c = j + 1; c <= n && norm > 0.0; c++) {
            double sum = pivot * M[j][c];

            for (int32_t i = j + 1; i < rows; i++)
                sum += M[i][j] * M[i][c];
            sum /= norm * fabs(pivot);
            M[j][c] -= sum * pivot;
            for (int32_t i = j + 1; i < rows; i++)
                M[i][c] -= sum * M[i][j];
        }
        M[j][j] = -copysign(norm, M[j][j]);
    }
    for (int32_t i = n; i < rows; i++)
        left += M[i][n] * M[i][n];
    return left;
}

/* F and k of a unit of several cones, or with least squares: S = M'M with a row of M for each of V
 * B, so that R of M = Q R is worth twice the digits of S; k is the least-squares solution for V e,
 * and what that leaves adds to kappa. */
static void condense_stack(perp__statics *s, int32_t u)
{
    const perp__statics_unit *unit = &s->rows->unit[u];
    const int32_t n = unit->rows;
    double M[15][7] = {{0.0}}, *F = s->F + s->square[u], *k = s->k + unit->row;
    int32_t count = 0;

    for (int32_t c = s->unit_cone[u]; c < s->unit_cone[u + 1]; c++) {
        const perp__cone *cone = &s->cones[c];

        for (int32_t i = 0; i < cone->dim; i++, count++) {
            for (int32_t j = 0; j < cone->dim; j++)
                M[count][j == 0 ? 0 : cone->first + j - 1] =
                    cone->V[3 * i + j] * coefficient(cone, j);
            M[count][n] = s->aim == PERP__AIM_MARGIN ? cone->V[3 * i] * cone->e : 0.0;
        }
    }
    for (int32_t i = 0; i < n && s->aim == PERP__AIM_LEAST; i++)
        M[count++][i] = 1.0;
    s->kappa += reflect(M, count, n);
    for (int32_t j = 0; j < n; j++) /* F = R^-1, and R k = the last column */
        for (int32_t i = n - 1; i >= 0; i--) {
            double sum = i == j;

            for (int32_t m = i + 1; m < n; m++)
                sum -= M[i][m] * F[m * n + j];
            F[i * n + j] = i > j ? 0.0 : sum / M[i][i];
        }
    for (int32_t i = n - 1; i >= 0; i--) {
        k[i] = M[i][n];
        for (int32_t m = i + 1; m < n; m++)
            k[i] -= M[i][m] * k[m];
        k[i] /= M[i][i];
    }
}

void perp__statics_condense(perp__statics *s, double mean)
{
    s->kappa = 0.0;
    memset(s->k, 0, (size_t)s->rows->size * sizeof *s->k);
    for (int32_t c = 0; c < s->cone_count; c++)
        perp__cone_scale(&s->cones[c]);
    for (int32_t u = 0; u < s->rows->units; u++) {
        const int32_t n = s->rows->unit[u].rows;
        const double rho = PROXIMAL * fmax(mean, 1e-16);
        double *F = s->F + s->square[u];

        if (s->idle[u])
            continue;
        memset(F, 0, (size_t)(n * n) * sizeof *F);
        if (s->unit_cone[u] == s->unit_cone[u + 1]) { /* free, or as good as that */
            for (int32_t i = 0; i < n; i++)
                F[i * n + i] = 1.0 / sqrt(rho + (s->aim == PERP__AIM_LEAST));
        } else if (is_single(s, u)) {
            const perp__cone *cone = &s->cones[s->unit_cone[u]];

            for (int32_t i = 0; i < n; i++)
                for (int32_t j = 0; j < n; j++)
                    F[i * n + j] = cone->inverse[3 * i + j] / coefficient(cone, i);
            if (s->aim == PERP__AIM_MARGIN)
                s->k[s->rows->unit[u].row] = cone->e / cone->sign;
        } else if (n > 0) {
            condense_stack(s, u);
        }
    }
}

/* ---- a step ---- */

/* rd := B'u + A'y - q x, what the dual lacks. */
static void find_dual_residual(perp__statics *s)
{
    const double q = s->aim == PERP__AIM_LEAST ? 1.0 : 0.0;

    perp__statics_meet(s, s->y, s->rd);
    for (int32_t u = 0; u < s->rows->units; u++) {
        const perp__statics_unit *unit = &s->rows->unit[u];
        double *p = s->rd + unit->row;

        if (s->idle[u]) {
            memset(p, 0, (size_t)unit->rows * sizeof *p);
            continue;
        }
        for (int32_t k = 0; k < unit->rows; k++)
            p[k] -= q * s->x[unit->row + k];
        for (int32_t c = s->unit_cone[u]; c < s->unit_cone[u + 1]; c++)
            add_dual(&s->cones[c], s->cones[c].u, p);
    }
}

/* ds. */
static double find_margin_step(const perp__statics *s, double rs, double rt, double sum)
{
    const int32_t n = (int32_t)perp__statics_numbers(s);
    double kp = 0.0;

    for (int32_t u = 0; u < s->rows->units; u++) {
        const int32_t row = s->rows->unit[u].row;

        if (!s->idle[u])
            kp += perp__dot(s->k + row, s->p + row, s->rows->unit[u].rows);
    }
    return (-rs + kp + perp__dot(s->g, s->Kr, n) - sum - rt / s->t) /
           (s->kappa + perp__dot(s->g, s->Kg, n) + s->tau / s->t);
}

/* dz and du of a unit's cones, from dx, dy and ds. */
static void find_cone_steps(perp__statics *s, int32_t u, double ds)
{
    /* of a single one: exactly what the dual lacks */
    const double *row = s->met + s->rows->unit[u].row;

    for (int32_t c = s->unit_cone[u]; c < s->unit_cone[u + 1]; c++) {
        perp__cone *cone = &s->cones[c];
        double v[3];

        perp__cone_place(s, cone, s->dx, -ds * cone->e, cone->dz);
        for (int32_t i = 0; i < 3; i++)
            v[i] = perp__dot(cone->V + 3 * i, cone->dz, 3);
        for (int32_t i = 0; i < 3; i++)
            if (i >= cone->dim)
                cone->du[i] = 0.0;
            else if (is_single(s, u))
                cone->du[i] = -(row[i] + s->rd[s->rows->unit[u].row + i]) / coefficient(cone, i);
            else
                cone->du[i] = cone->rc[i] - perp__dot(cone->V + 3 * i, v, 3);
    }
}

/* The step that the cones' rc ask for: dx, dy, dz, du, and those of s and tau. */
static void find_step(perp__statics *s, double rs, double rt, double *ds, double *dtau)
{
    const size_t n = perp__statics_numbers(s);
    const bool margin = s->aim == PERP__AIM_MARGIN;
    double sum = 0.0;

    /* 1. p; Kr = K^-1 (rb - A S^-1 p); e'rc. */
    memcpy(s->p, s->rd, (size_t)s->rows->size * sizeof *s->p);
    for (int32_t c = 0; c < s->cone_count; c++) {
        const perp__cone *cone = &s->cones[c];

        add_dual(cone, cone->rc, s->p + s->rows->unit[cone->unit].row);
        sum += cone->e * cone->rc[0];
    }
    memcpy(s->Kr, s->rb, n * sizeof *s->Kr);
    memcpy(s->Kr_low, s->rb_low, n * sizeof *s->Kr);
    perp__statics_push(s, -1.0, 1, s->p, s->Kr, s->Kr_low);
    perp__statics_solve(s, s->Kr, s->Kr_low);

    /* 2. The border's equation, dy, dx. */
    *ds = margin ? find_margin_step(s, rs, rt, sum) : 0.0;
    *dtau = margin ? (rt + s->tau * *ds) / s->t : 0.0;
    for (size_t i = 0; i < n; i++) {
        s->dy[i] = s->Kr[i];
        s->dy_low[i] = s->Kr_low[i];
        perp__accumulate(&s->dy[i], &s->dy_low[i], -*ds, s->Kg[i]);
        s->dy_low[i] -= *ds * s->Kg_low[i];
        if (s->doubled)
            perp__round_sum(&s->dy[i], &s->dy_low[i]);
        else
            s->dy_low[i] = 0.0;
    }
    perp__statics_pull(s, s->p, s->dy, s->dy_low, s->dx);
    for (int32_t i = 0; i < s->rows->size; i++)
        s->dx[i] += *ds * s->k[i];

    /* 3. The cones. */
    for (int32_t u = 0; u < s->rows->units; u++)
        if (!s->idle[u])
            find_cone_steps(s, u, *ds);
}

/* The largest step with t + step dt >= 0. */
static double longest(double t, double dt)
{
    return dt < 0.0 ? -t / dt : INFINITY;
}

static double longest_step(const perp__statics *s, double ds, double dtau)
{
    double most = INFINITY;

    for (int32_t c = 0; c < s->cone_count; c++) {
        most = fmin(most, perp__cone_longest(s->cones[c].z, s->cones[c].dz));
        most = fmin(most, perp__cone_longest(s->cones[c].u, s->cones[c].du));
    }
    if (s->aim == PERP__AIM_MARGIN)
        most = fmin(most, fmin(longest(s->t, -ds), longest(s->tau, dtau)));
    return most;
}

/* K^-1 of what s brings in: g = A k. */
static void find_border(perp__statics *s)
{
    const size_t bytes = perp__statics_numbers(s) * sizeof(double);

    memset(s->Kg, 0, bytes);
    memset(s->Kg_low, 0, bytes);
    if (s->aim == PERP__AIM_LEAST)
        return;
    perp__statics_push(s, 1.0, 0, s->k, s->Kg, s->Kg_low);
    memcpy(s->g, s->Kg, bytes);
    perp__statics_solve(s, s->Kg, s->Kg_low);
}

/* One iteration. Returns how far it went; 0 where numbers end. */
static double iterate(perp__statics *s, double mean)
{
    const int32_t n = (int32_t)perp__statics_numbers(s);
    double rt = -s->t * s->tau, rs = s->tau - 1.0, step, sigma, ds, dtau;

    /* 1. The equations; rs: what the dual's measure lacks, e'u + tau = 1. */
    perp__statics_condense(s, mean);
    if (!perp__statics_factor(s))
        return 0.0;
    find_border(s);
    for (int32_t c = 0; c < s->cone_count; c++)
        rs += s->cones[c].e * s->cones[c].u[0];

    /* 2. The predictor, towards complementarity, and the corrector. */
    for (int32_t c = 0; c < s->cone_count; c++)
        perp__cone_aim(&s->cones[c], 0.0, 0.0);
    find_step(s, rs, rt, &ds, &dtau);
    step = fmin(longest_step(s, ds, dtau), 1.0);
    if (!(step >= 0.0))
        return 0.0;
    sigma = (1.0 - step) * (1.0 - step) * (1.0 - step);
    for (int32_t c = 0; c < s->cone_count; c++)
        perp__cone_aim(&s->cones[c], sigma * mean, 1.0);
    rt += ds * dtau + sigma * mean;
    find_step(s, rs, rt, &ds, &dtau);
    step = fmin(PERP__CONE_REACH * longest_step(s, ds, dtau), 1.0);
    if (!(step >= 0.0))
        return 0.0;

    /* 3. There. */
    for (int32_t i = 0; i < s->rows->size; i++)
        s->x[i] += step * s->dx[i];
    for (int32_t i = 0; i < n; i++)
        s->y[i] += step * s->dy[i];
    s->s += step * ds;
    s->tau += step * dtau;
    s->t -= step * ds;
    for (int32_t c = 0; c < s->cone_count; c++)
        for (int32_t j = 0; j < 3; j++) {
            s->cones[c].u[j] += step * s->cones[c].du[j];
            /* B x + h - s e would round to 0 beside h */
            s->cones[c].z[j] += step * s->cones[c].dz[j];
        }
    return step;
}

/* ---- the two aims ---- */

perp__statics_end perp__statics_follow_path(perp__statics *s, perp__statics_answer *answer,
                                            const perp__statics_aim *aim, int32_t most)
{
    /* beside the limit 1 of s: the gap at which s is 0 */
    const double none = s->doubled ? PERP__BALANCED_AT_BEST : PERP__BALANCED;
    int32_t since = 0, slow = 0;

    while (s->iterations < most) {
        const int32_t margin = s->aim == PERP__AIM_MARGIN, count = s->cone_count + margin;
        double gap = margin ? s->t * s->tau : 0.0, whole, step;

        /* 1. The gap, u'z of all; with what x makes of the dual's residual: joints approach
         * theirs. */
        perp__statics_balance(s, 0);
        find_dual_residual(s);
        for (int32_t c = 0; c < s->cone_count; c++)
            gap += perp__dot(s->cones[c].u, s->cones[c].z, 3);
        whole = gap;
        for (int32_t i = 0; i < s->rows->size; i++)
            whole += fabs(s->rd[i] * s->x[i]);
        if (!(gap < INFINITY))
            return PERP__STATICS_STUCK;

        /* 2. What is known by now. */
        if (margin && s->s > 0.0) {
            const bool close = whole <= aim->gap * s->s || s->s >= 1.0 - aim->gap;

            if (close || (aim->gap == 0.0 && (s->s >= ROOMY || since >= ROOMY_ITERATIONS)))
                return PERP__STATICS_FOUND;
            since++;
        }
        if (margin && s->s <= 0.0 && (aim->gap == 0.0 || gap <= aim->gap * fabs(s->s)) &&
            perp__statics_prove(s, answer, s->y))
            return PERP__STATICS_PROVED;
        if (margin && gap <= none)
            return PERP__STATICS_ENDED;
        if (!margin && gap <= PERP__BALANCED * perp__dot(s->x, s->x, s->rows->size))
            return PERP__STATICS_FOUND;

        /* 3. On. */
        step = iterate(s, count > 0 ? gap / count : 0.0);
        slow = step <= PERP__BALANCED ? slow + 1 : 0; /* leads nowhere */
        if (step == 0.0 || slow > 2)
            break;
    }
    return s->aim == PERP__AIM_MARGIN && s->s < 0.0 && perp__statics_prove(s, answer, s->y)
               ? PERP__STATICS_PROVED
               : PERP__STATICS_STUCK;
}
