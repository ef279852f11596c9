/* A solver of the inner entrance with a scene, and what its answers have to obey, from the caller's
 * own rows and masses. */
#ifndef PERP_TESTS_RIGID_FIXTURE_H
#define PERP_TESTS_RIGID_FIXTURE_H

#include <math.h>

#include "suite.h"

#include <perp/perp.h>

#include "base/handle.h"
#include "gen.h"
#include "rigid_scene.h"

typedef struct fixture {
    perp_context *context;
    perp_contact_solver *solver;
    rigid_scene s;
} fixture;

static inline void open_fixture(fixture *f, int32_t planar, const perp_context_settings *settings)
{
    rigid_open(&f->s, planar);
    assert_int_equal(perp_context_create(&f->context, settings), PERP_OK);
    assert_int_equal(perp__contact_create(f->context, &f->solver, NULL), PERP_OK);
}

static inline void close_fixture(fixture *f)
{
    perp__handle_end(f->solver);
    perp_context_destroy(f->context);
    rigid_close(&f->s);
}

static inline perp__rigid_answer solve(fixture *f, const perp__rigid_problem *p)
{
    perp__rigid_answer a = rigid_answer(&f->s);

    assert_int_equal(perp__rigid_solve(f->solver, &a, p), PERP_OK);
    return a;
}

/* M (v - v_free) = J'r, M diagonal, to rounding of a body's terms. */
static inline void check_momentum(const rigid_scene *s)
{
    const int32_t w = s->width, n = s->bodies * w;
    long double *sum = gen_allocate((size_t)n, sizeof *sum);
    long double *terms = gen_allocate((size_t)n, sizeof *terms);
    int32_t k, i, j, side;

    for (i = 0; i < n; i++) {
        const double m = s->mass[(i / w) * w * w + (i % w) * (w + 1)];

        sum[i] = (long double)m * ((long double)s->v[i] - s->free[i]);
        terms[i] = m * (fabs(s->v[i]) + fabs(s->free[i]));
    }
    for (k = 0; k < s->contacts; k++)
        for (side = 0; side < 2; side++)
            for (i = 0; i < s->rows[k].dim; i++)
                for (j = 0; j < w; j++) {
                    const int32_t b = s->rows[k].body[side];

                    if (b < 0 || b >= s->bodies)
                        continue;
                    sum[b * w + j] -=
                        (long double)s->rows[k].rows[side][i][j] * s->impulse[3 * k + i];
                    terms[b * w + j] += fabs(s->rows[k].rows[side][i][j] * s->impulse[3 * k + i]);
                }
    for (i = 0; i < n; i++) { /* a product with M^-1 = C C' and back, and what holds taken out of
                                 all coordinates of a body: some tens of roundings */
        long double size = 0.0L;

        for (j = 0; j < w; j++)
            size = fmaxl(size, terms[i / w * w + j]);
        assert_true(fabsl(sum[i]) <= 1e-14L * size);
    }
    free(sum);
    free(terms);
}

/* trace of J M^-1 J' of contact k; M is diagonal. */
static inline double trace_of(const rigid_scene *s, int32_t k)
{
    const perp__rigid_rows *g = &s->rows[k];
    const int32_t w = s->width;
    double sum = 0.0;
    int32_t i, j, side;

    for (side = 0; side < 2; side++)
        for (i = 0; i < g->dim; i++)
            for (j = 0; g->body[side] >= 0 && g->body[side] < s->bodies && j < w; j++)
                sum += g->rows[side][i][j] * g->rows[side][i][j] /
                       s->mass[g->body[side] * w * w + j * (w + 1)];
    return sum;
}

/* Signorini's and Coulomb's laws as equations, r_n = max(r_n - u_n / t, 0) and the same with the
 * disc for r_t, u from v: the largest violation of any, as a velocity. */
static inline double worst_violation(const rigid_scene *s, const perp__rigid_answer *a)
{
    double worst = 0.0;
    int32_t k, i, j, side;

    for (k = 0; k < s->contacts; k++) {
        const perp__rigid_rows *g = &s->rows[k];
        const double *r = s->impulse + 3 * k, t = trace_of(s, k), radius = g->mu * r[0];
        double u[3] = {0.0}, x[2], length;

        for (i = 0; i < g->dim; i++) {
            u[i] = g->bias[i];
            for (side = 0; side < 2; side++)
                for (j = 0; g->body[side] >= 0 && j < s->width; j++)
                    u[i] +=
                        g->rows[side][i][j] *
                        (g->body[side] < s->bodies ? s->v : s->free)[g->body[side] * s->width + j];
        }
        assert_true(r[0] >= 0.0);
        assert_true(hypot(r[1], r[2]) <= radius * (1.0 + 1e-14)); /* rounding of the root */
        worst = fmax(worst, t * fabs(r[0] - fmax(r[0] - u[0] / t, 0.0)));
        for (i = 0; i < 2; i++)
            x[i] = r[1 + i] - u[1 + i] / t;
        length = hypot(x[0], x[1]);
        for (i = 0; i < 2 && length > radius; i++)
            x[i] *= radius / length;
        worst = fmax(worst, t * hypot(r[1] - x[0], r[2] - x[1]));
        if (a->modes[k] == PERP_CONTACT_SEPARATE)
            assert_true(r[0] == 0.0 && r[1] == 0.0 && r[2] == 0.0);
    }
    return worst;
}

#endif
