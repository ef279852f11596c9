/* Frictional contact between random bodies as a linear complementarity problem (Stewart & Trinkle
 * 1996; Anitescu & Potra 1997). */
#include "gen.h"

#include <math.h>
#include <stdlib.h>

enum { DOF = 6, GROUND = -1 };

/* One contact: two bodies (the second may be the ground) and rows of the contact's Jacobian. */
typedef struct contact {
    int32_t body[2];
    double rows[1 + 16][2][DOF]; /* normal, then the directions of friction */
    double gap, mu;
} contact;

typedef struct scene {
    int32_t bodies, contacts, directions;
    double *inverse_mass; /* bodies x DOF, diagonal in each body's principal axes */
    double *velocity;     /* bodies x DOF */
    contact *contact;
} scene;

static void unit(gen_random *random, double x[3])
{
    double length;

    do {
        x[0] = gen_uniform(random, -1, 1);
        x[1] = gen_uniform(random, -1, 1);
        x[2] = gen_uniform(random, -1, 1);
        length = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
    } while (length < 0.1 || length > 1);
    x[0] /= length;
    x[1] /= length;
    x[2] /= length;
}

static void cross(const double a[3], const double b[3], double c[3])
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

/* Row of the Jacobian for a unit force along `axis` on the first body at its arm, and the opposite
 * on the second. */
static void fill_row(double row[2][DOF], const double axis[3], double arm[2][3])
{
    int side, k;

    for (side = 0; side < 2; side++) {
        double sign = side == 0 ? 1.0 : -1.0, moment[3];

        cross(arm[side], axis, moment);
        for (k = 0; k < 3; k++) {
            row[side][k] = sign * axis[k];
            row[side][k + 3] = sign * moment[k];
        }
    }
}

static void make_contact(scene *s, gen_random *random, contact *c, double mu_max)
{
    double normal[3], other[3], first[3], second[3], axis[3], arm[2][3], length;
    int32_t half = s->directions / 2, d, k;

    unit(random, normal);
    unit(random, other);
    cross(normal, other, first);
    length = sqrt(first[0] * first[0] + first[1] * first[1] + first[2] * first[2]);
    for (k = 0; k < 3; k++)
        first[k] /= length;
    cross(normal, first, second);
    unit(random, arm[0]);
    unit(random, arm[1]);
    c->body[0] = gen_integer(random, s->bodies);
    c->body[1] = gen_integer(random, s->bodies + 1) - 1;
    if (c->body[1] == c->body[0])
        c->body[1] = GROUND;
    c->gap = gen_integer(random, 2) ? 0.0 : gen_uniform(random, 0, 0.2);
    c->mu = gen_integer(random, 8) ? mu_max * gen_uniform(random, 0, 1) : 0.0;
    fill_row(c->rows[0], normal, arm);
    for (d = 0; d < half; d++) {
        double angle = 3.14159265358979323846 * d / half;

        for (k = 0; k < 3; k++)
            axis[k] = cos(angle) * first[k] + sin(angle) * second[k];
        fill_row(c->rows[1 + d], axis, arm);
        for (k = 0; k < 2 * DOF; k++) /* the opposite direction, bit for bit */
            c->rows[1 + half + d][k / DOF][k % DOF] = -c->rows[1 + d][k / DOF][k % DOF];
    }
}

static void make_scene(scene *s, gen_random *random, const gen_contact_options *o)
{
    int32_t b, k;

    s->bodies = o->bodies;
    s->contacts = o->contacts;
    s->directions = o->directions;
    s->inverse_mass = gen_allocate((size_t)o->bodies * DOF, sizeof(double));
    s->velocity = gen_allocate((size_t)o->bodies * DOF, sizeof(double));
    s->contact = gen_allocate((size_t)o->contacts, sizeof(contact));
    for (b = 0; b < o->bodies; b++) {
        /* the lightest and the heaviest are always there; the others lie between, on a log scale */
        double position = b == 0 ? 0 : b == 1 ? 1 : gen_uniform(random, 0, 1);
        double inverse = exp(-position * log(o->mass_ratio));

        for (k = 0; k < DOF; k++) {
            s->inverse_mass[b * DOF + k] =
                k < 3 ? inverse : inverse * gen_uniform(random, 1.0, 10.0);
            s->velocity[b * DOF + k] = gen_normal(random);
        }
    }
    for (k = 0; k < o->contacts; k++) {
        if (k > 0 && k >= o->contacts - o->duplicates)
            s->contact[k] = s->contact[gen_integer(random, k)];
        else
            make_contact(s, random, &s->contact[k], o->mu_max);
    }
}

static void destroy_scene(scene *s)
{
    free(s->inverse_mass);
    free(s->velocity);
    free(s->contact);
}

/* a' m^-1 b for two rows of the Jacobian, in one order of summation whichever comes first */
static double couple(const scene *s, const contact *a, int32_t i, const contact *b, int32_t j)
{
    double sum = 0.0;
    int32_t body, p, r, k;

    for (body = 0; body < s->bodies; body++)
        for (p = 0; p < 2; p++)
            for (r = 0; r < 2; r++)
                if (a->body[p] == body && b->body[r] == body)
                    for (k = 0; k < DOF; k++)
                        sum +=
                            s->inverse_mass[body * DOF + k] * (a->rows[i][p][k] * b->rows[j][r][k]);
    return sum;
}

static double approach(const scene *s, const contact *c, int32_t i)
{
    double sum = 0.0;
    int32_t p, k;

    for (p = 0; p < 2; p++)
        if (c->body[p] != GROUND)
            for (k = 0; k < DOF; k++)
                sum += c->rows[i][p][k] * s->velocity[c->body[p] * DOF + k];
    return sum;
}

/* Position of row i of contact c in the order (normals, frictions, lambdas). */
static int32_t place(const scene *s, int32_t c, int32_t i)
{
    if (i == 0)
        return c;
    if (i <= s->directions)
        return s->contacts + c * s->directions + i - 1;
    return s->contacts * (1 + s->directions) + c;
}

static void assemble(gen_lcp *problem, const scene *s, const int32_t *order)
{
    int32_t n = problem->n, a, b, i, j;

    for (a = 0; a < s->contacts; a++) {
        const contact *c = &s->contact[a];
        int32_t lambda = order[place(s, a, s->directions + 1)], row;

        for (i = 0; i <= s->directions; i++) {
            row = order[place(s, a, i)];
            problem->q[row] = approach(s, c, i) + (i == 0 ? c->gap * 100.0 : 0.0); /* h = 0.01 */
            for (b = 0; b < s->contacts; b++)
                for (j = 0; j <= s->directions; j++)
                    problem->M[row * n + order[place(s, b, j)]] =
                        couple(s, c, i, &s->contact[b], j);
            problem->M[row * n + lambda] = i == 0 ? 0.0 : 1.0;
            problem->M[lambda * n + row] = i == 0 ? c->mu : -1.0;
        }
    }
}

void gen_contact(gen_lcp *problem, gen_random *random, const gen_contact_options *options)
{
    int32_t n = options->contacts * (options->directions + 2), i;
    int32_t *order = gen_allocate((size_t)n, sizeof *order);
    scene s;

    gen_begin_dense(problem, n);
    free(problem->z); /* no solution is recorded */
    free(problem->w);
    problem->z = problem->w = NULL;
    make_scene(&s, random, options);
    for (i = 0; i < n; i++)
        order[i] = i;
    for (i = n - 1; options->permuted && i > 0; i--) {
        int32_t j = gen_integer(random, i + 1), kept = order[i];

        order[i] = order[j];
        order[j] = kept;
    }
    assemble(problem, &s, order);
    destroy_scene(&s);
    free(order);
}
