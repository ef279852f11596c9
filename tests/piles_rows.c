/* The matrices of a scene: M (mass times unit, inertia in the world's axes) and H. */
#include "piles.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double step = 0.01;

static void cross(const double a[3], const double b[3], double c[3])
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

/* Row `i` of contact c on its body `side`: u is the velocity of body 1 against body 0. */
static void fill_row(const piles_scene *s, const piles_contact *c, int32_t i, int32_t side,
                     double row[6])
{
    const double sign = side ? 1.0 : -1.0;
    double axis[3], arm[3], moment[3];
    int k;

    if (i == 2)
        cross(c->normal, c->tangent, axis);
    else
        memcpy(axis, i == 0 ? c->normal : c->tangent, sizeof axis);
    for (k = 0; k < 3; k++)
        arm[k] = c->point[k] - s->body[c->body[side]].position[k];
    cross(arm, axis, moment);
    for (k = 0; k < 3; k++) {
        row[k] = sign * axis[k];
        row[k + 3] = sign * moment[k];
    }
}

static void fill_M(piles *p, const piles_scene *s)
{
    int32_t b, i, j, at = 0;

    for (b = 0; b < s->bodies; b++)
        for (j = 0; j < 6; j++) {
            const piles_body *body = &s->body[b];

            p->M_starts[6 * b + j] = at;
            for (i = j < 3 ? j : 3; i < (j < 3 ? j + 1 : 6); i++, at++) {
                p->M_rows[at] = 6 * b + i;
                p->M_values[at] = j < 3 ? body->mass : body->inertia[i - 3][j - 3];
            }
        }
    p->M_starts[p->n] = at;
}

/* f = M (v + h g): what gravity alone makes of the velocities. */
static void fill_f(piles *p, const piles_scene *s)
{
    int32_t b, i, j;

    for (b = 0; b < s->bodies; b++)
        for (i = 0; i < 3; i++) {
            const piles_body *body = &s->body[b];

            p->f[6 * b + i] = body->mass * (body->velocity[i] + step * 9.81 * s->down[i]);
            for (j = 0; j < 3; j++)
                p->f[6 * b + 3 + i] += body->inertia[i][j] * body->velocity[3 + j];
        }
}

static void fill_H(piles *p, const piles_scene *s)
{
    int32_t *next = gen_allocate((size_t)p->n + 1, sizeof *next);
    int32_t c, side, i, j, first = 0;

    for (c = 0; c < s->contacts; c++)
        for (side = 0; side < 2; side++)
            for (j = 0; s->contact[c].body[side] >= 0 && j < 6; j++)
                p->H_starts[6 * s->contact[c].body[side] + j + 1] += p->dims[c];
    for (j = 0; j < p->n; j++) {
        p->H_starts[j + 1] += p->H_starts[j];
        next[j] = p->H_starts[j];
    }
    for (c = 0; c < s->contacts; first += p->dims[c++])
        for (side = 0; side < 2; side++)
            for (i = 0; s->contact[c].body[side] >= 0 && i < p->dims[c]; i++) {
                const int32_t column = 6 * s->contact[c].body[side];
                double row[6];

                fill_row(s, &s->contact[c], i, side, row);
                for (j = 0; j < 6; j++) {
                    p->H_rows[next[column + j]] = first + i;
                    p->H_values[next[column + j]++] = row[j];
                }
            }
    free(next);
}

/* w: gap over step, or Moreau's restitution times the old normal velocity. */
static void fill_w(piles *p, const piles_scene *s, double restitution)
{
    int32_t c, side, k, first = 0;

    for (c = 0; c < s->contacts; first += p->dims[c++]) {
        const piles_contact *contact = &s->contact[c];
        double row[6], before = 0.0;

        for (side = 0; side < 2; side++)
            if (contact->body[side] >= 0) {
                fill_row(s, contact, 0, side, row);
                for (k = 0; k < 6; k++)
                    before += row[k] * s->body[contact->body[side]].velocity[k];
            }
        p->w[first] = contact->gap > 0.0 ? contact->gap / step : restitution * before;
    }
}

static void check(int good)
{
    if (!good)
        abort();
}

void piles_assemble(piles *p, const piles_scene *s, const piles_options *options)
{
    size_t entries;
    int32_t c;

    memset(p, 0, sizeof *p);
    p->bodies = s->bodies;
    p->n = 6 * s->bodies;
    p->contacts = s->contacts;
    p->dims = gen_allocate((size_t)p->contacts, sizeof *p->dims);
    p->mu = gen_allocate((size_t)p->contacts, sizeof *p->mu);
    for (c = 0; c < p->contacts; c++) {
        p->dims[c] = s->contact[c].dim;
        p->mu[c] = s->contact[c].mu;
        p->rows += p->dims[c];
    }
    entries = (size_t)p->rows * 12;
    p->f = gen_allocate((size_t)p->n, sizeof(double));
    p->w = gen_allocate((size_t)p->rows, sizeof(double));
    p->M_starts = gen_allocate((size_t)p->n + 1, sizeof(int32_t));
    p->M_rows = gen_allocate((size_t)p->bodies * 12, sizeof(int32_t));
    p->M_values = gen_allocate((size_t)p->bodies * 12, sizeof(double));
    p->H_starts = gen_allocate((size_t)p->n + 1, sizeof(int32_t));
    p->H_rows = gen_allocate(entries, sizeof(int32_t));
    p->H_values = gen_allocate(entries, sizeof(double));
    fill_M(p, s);
    fill_f(p, s);
    fill_H(p, s);
    fill_w(p, s, options->restitution);
    check(perp_struct_init(&p->M, sizeof p->M) == PERP_OK);
    check(perp_struct_init(&p->H, sizeof p->H) == PERP_OK);
    check(perp_matrix_csc(&p->M, p->n, p->n, p->M_starts, p->M_rows, p->M_values) == PERP_OK);
    check(perp_matrix_csc(&p->H, p->rows, p->n, p->H_starts, p->H_rows, p->H_values) == PERP_OK);
}

void piles_destroy(piles *p)
{
    free(p->dims);
    free(p->mu);
    free(p->f);
    free(p->w);
    free(p->M_starts);
    free(p->M_rows);
    free(p->M_values);
    free(p->H_starts);
    free(p->H_rows);
    free(p->H_values);
    memset(p, 0, sizeof *p);
}
