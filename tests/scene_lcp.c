#include "scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { DOF = 6, MOST_DIRECTIONS = 16, LARGEST = 1600 };

static const double step = 0.01;

const char *scene_class_text(int32_t class)
{
    static const char *const texts[SCENE_CLASSES] = {
        "stack", "pushed", "wedge",       "table",       "wall",       "tower",
        "pile",  "random", "planar_wall", "planar_arch", "planar_peg", "planar_random"};

    return class >= 0 && class < SCENE_CLASSES ? texts[class] : "unknown";
}

static const double *drawn(gen_random *random, const double *from, int32_t count)
{
    return from + gen_integer(random, count);
}

scene_options scene_draw(uint64_t seed)
{
    static const double ratios[] = {1, 1e2, 1e4, 1e6, 1e8};
    static const double frictions[] = {0.0, 0.3, 0.3, 1.0, 1e3, -1, -1};
    static const double jitters[] = {0, 0, 0, 1e-12, 1e-8, 1e-4, 1e-2};
    gen_random random;
    scene_options o;

    memset(&o, 0, sizeof o);
    gen_seed(&random, seed * UINT64_C(0x2545f4914f6cdd1d) + 1);
    o.seed = seed;
    o.class = (int32_t)(seed % SCENE_CLASSES); /* every class with every ratio within 60 seeds */
    o.mass_ratio = ratios[seed / SCENE_CLASSES % 5];
    o.contacts = (int32_t)(8.0 * exp(gen_uniform(&random, 0, log(16.0)))); /* 8 .. 128 */
    o.directions = 4 + 2 * gen_integer(&random, 7);
    while (o.directions > 4 && o.contacts * (o.directions + 2) > LARGEST)
        o.directions -= 2;
    o.order = gen_integer(&random, 4);
    o.mu = *drawn(&random, frictions, 7);
    o.gaps = gen_integer(&random, 4) == 0;
    o.jitter = *drawn(&random, jitters, 7);
    o.motion = gen_integer(&random, 3);
    o.duplicated = gen_integer(&random, 3) ? 0 : 1 + gen_integer(&random, o.contacts / 2);
    o.moved = gen_integer(&random, 4) > 0;
    o.permuted = gen_integer(&random, 2);
    o.scaling = gen_integer(&random, 2)   ? SCENE_PLAIN
                : gen_integer(&random, 3) ? SCENE_SYMMETRIC
                                          : SCENE_ROWS;
    return o;
}

/* Rows of the Jacobian of one contact and their products with m^-1, on both bodies. */
typedef struct rows {
    double J[1 + MOST_DIRECTIONS][2][DOF];
    double W[1 + MOST_DIRECTIONS][2][DOF];
} rows;

static void fill_row(const scene *s, const scene_contact *c, const double axis[3], double J[2][DOF],
                     double W[2][DOF])
{
    int side, i, k;

    for (side = 0; side < 2; side++) {
        const double sign = side ? 1.0 : -1.0;
        double arm[3], moment[3];

        if (c->body[side] == SCENE_GROUND)
            continue;
        for (k = 0; k < 3; k++)
            arm[k] = c->point[k] - s->body[c->body[side]].position[k];
        scene_cross(arm, axis, moment);
        for (k = 0; k < 3; k++) {
            J[side][k] = sign * axis[k];
            J[side][k + 3] = sign * moment[k];
        }
        for (i = 0; i < DOF; i++)
            for (k = 0; k < DOF; k++)
                W[side][i] += s->body[c->body[side]].inverse[i][k] * J[side][k];
    }
}

static void fill_rows(const scene *s, const scene_contact *c, int32_t directions, rows *r)
{
    const int32_t half = directions / 2;
    double second[3], axis[3];
    int32_t d, k;

    memset(r, 0, sizeof *r);
    scene_cross(c->normal, c->tangent, second);
    fill_row(s, c, c->normal, r->J[0], r->W[0]);
    for (d = 0; d < half; d++) {
        double angle = 3.14159265358979323846 * d / half;

        for (k = 0; k < 3; k++)
            axis[k] = d == 0 ? c->tangent[k] : cos(angle) * c->tangent[k] + sin(angle) * second[k];
        fill_row(s, c, axis, r->J[1 + d], r->W[1 + d]);
        for (k = 0; k < 2 * DOF; k++) { /* the opposite direction, bit for bit */
            r->J[1 + half + d][k / DOF][k % DOF] = -r->J[1 + d][k / DOF][k % DOF];
            r->W[1 + half + d][k / DOF][k % DOF] = -r->W[1 + d][k / DOF][k % DOF];
        }
    }
}

static double couple(const scene_contact *a, double J[2][DOF], const scene_contact *b,
                     double W[2][DOF])
{
    double sum = 0.0;
    int p, r, k;

    for (p = 0; p < 2; p++)
        for (r = 0; r < 2; r++)
            if (a->body[p] != SCENE_GROUND && a->body[p] == b->body[r])
                for (k = 0; k < DOF; k++)
                    sum += J[p][k] * W[r][k];
    return sum;
}

static double approach(const scene *s, const scene_contact *c, double J[2][DOF])
{
    double sum = 0.0;
    int p, k;

    for (p = 0; p < 2; p++)
        for (k = 0; c->body[p] != SCENE_GROUND && k < DOF; k++)
            sum += J[p][k] * s->body[c->body[p]].velocity[k];
    return sum;
}

static int32_t share_a_body(const scene_contact *a, const scene_contact *b)
{
    int p, r;

    for (p = 0; p < 2; p++)
        for (r = 0; r < 2; r++)
            if (a->body[p] != SCENE_GROUND && a->body[p] == b->body[r])
                return 1;
    return 0;
}

/* Variables contact by contact: normal, frictions, lambda. */
static void assemble(gen_lcp *problem, const scene *s, int32_t directions, const int32_t *order)
{
    const int32_t each = directions + 2;
    const size_t n = (size_t)problem->n;
    rows *all = gen_allocate((size_t)s->contacts, sizeof *all);
    int32_t a, b, i, j;

    for (a = 0; a < s->contacts; a++)
        fill_rows(s, &s->contact[a], directions, &all[a]);
    for (a = 0; a < s->contacts; a++) {
        const scene_contact *c = &s->contact[a];
        const size_t lambda = (size_t)order[a * each + directions + 1];

        for (i = 0; i <= directions; i++) {
            const size_t row = (size_t)order[a * each + i];

            problem->q[row] = approach(s, c, all[a].J[i]) + (i == 0 ? c->gap / step : 0.0);
            for (b = 0; b < s->contacts; b++)
                for (j = 0; share_a_body(c, &s->contact[b]) && j <= directions; j++)
                    problem->M[row * n + (size_t)order[b * each + j]] =
                        couple(c, all[a].J[i], &s->contact[b], all[b].W[j]);
            problem->M[row * n + lambda] = i == 0 ? 0.0 : 1.0;
            problem->M[lambda * n + row] = i == 0 ? c->mu : -1.0;
        }
    }
    free(all);
}

/* Row i, and column i too where that is asked for, by 1e-6 .. 1e6. A column's factor only changes
 * the unit of z_i, a row's that of w_i. */
static void scale(gen_lcp *problem, gen_random *random, int32_t scaling)
{
    const size_t n = (size_t)problem->n;
    size_t i, j;

    for (i = 0; i < n && scaling != SCENE_PLAIN; i++) {
        const double factor = exp(gen_uniform(random, -6, 6) * log(10.0));

        problem->q[i] *= factor;
        for (j = 0; j < n; j++) {
            problem->M[i * n + j] *= factor;
            if (scaling == SCENE_SYMMETRIC)
                problem->M[j * n + i] *= factor;
        }
    }
}

void scene_lcp(gen_lcp *problem, const scene_options *options)
{
    gen_random random;
    scene s;
    int32_t directions, n, i, *order;

    memset(&s, 0, sizeof s);
    gen_seed(&random, options->seed);
    scene_fill(&s, &random, options->class, options->contacts);
    scene_finish(&s, &random, options);
    directions = s.planar ? 2 : options->directions;
    n = s.contacts * (directions + 2);
    order = gen_allocate((size_t)n, sizeof *order);
    for (i = 0; i < n; i++)
        order[i] = i;
    for (i = n - 1; options->permuted && i > 0; i--) {
        const int32_t j = gen_integer(&random, i + 1), kept = order[i];

        order[i] = order[j];
        order[j] = kept;
    }
    gen_begin_dense(problem, n);
    free(problem->z); /* no solution is recorded */
    free(problem->w);
    problem->z = problem->w = NULL;
    assemble(problem, &s, directions, order);
    scale(problem, &random, options->scaling);
    scene_release(&s);
    free(order);
}
