/* Rows of the contacts, and the matrix of an island's complementarity problem.
 *
 * A contact has the axes (n, t1, t2), right-handed. With r the arm from a body's mass centre to the
 * contact point, the row of axis a is J_B = (a, r_B x a), J_A = -(a, r_A x a), and
 *
 *   G_ij = J_i M^-1 J_j'
 *
 * is the 3 by 3 Delassus block of contacts i and j, zero unless they share a dynamic body. The
 * friction directions are d = c t1 + s t2, so that the variables (c, beta_1 .. beta_k, lambda) of a
 * contact meet those of another in d_a' G d_b; besides,
 *
 *   row beta_j: + lambda,    row lambda: mu c - sum beta_j. */
#include "world/world.h"

#include <string.h>

#include "world/spatial.h"

/* t1 is the x axis brought into the tangent plane, or the y axis where the normal is close to x;
 * t2 = n x t1. Planar: t1 is the normal turned by +90 degrees. The normal (0,0,1) has t1 = x and
 * t2 = y. */
void perp__contact_frame(const perp_world *world, perp__world_contact *contact)
{
    const double *n = contact->axes[0];
    double *t1 = contact->axes[1];
    int32_t i, axis = fabs(n[0]) > 0.9 ? 1 : 0;
    double length;

    memset(contact->axes[1], 0, 2 * sizeof contact->axes[1]);
    if (world->settings.planar) {
        t1[0] = -n[1];
        t1[1] = n[0];
        return;
    }
    t1[axis] = 1.0;
    perp__add3(t1, -n[axis], n);
    length = perp__length3(t1);
    for (i = 0; i < 3; i++)
        t1[i] /= length;
    perp__cross(contact->axes[2], n, t1);
}

static void body_rows(const perp_world *world, perp__world_contact *contact, int32_t side)
{
    const perp__motion *motion = &world->motions[side == 0 ? contact->body_a : contact->body_b];
    double sign = side == 0 ? -1.0 : 1.0;
    double moment[3];
    int32_t k, i;

    for (k = 0; k < 3; k++) {
        double *row = contact->rows[side][k];
        double *response = contact->response[side][k];

        perp__cross(moment, contact->arms[side], contact->axes[k]);
        for (i = 0; i < 3; i++) {
            row[i] = sign * contact->axes[k][i];
            row[3 + i] = sign * moment[i];
            response[i] = motion->inverse_mass * row[i];
        }
        perp__apply3(response + 3, motion->inverse_inertia, row + 3);
    }
}

void perp__contact_jacobian(const perp_world *world, perp__world_contact *contact)
{
    body_rows(world, contact, 0);
    body_rows(world, contact, 1);
}

void perp__relative_velocity(const perp_world *world, const perp__world_contact *contact,
                             size_t twist, double *u)
{
    const double *a = perp__const_twist(&world->motions[contact->body_a], twist);
    const double *b = perp__const_twist(&world->motions[contact->body_b], twist);
    int32_t k;

    for (k = 0; k < 3; k++)
        u[k] = perp__dot6(contact->rows[0][k], a) + perp__dot6(contact->rows[1][k], b);
}

/* d_j in the axes of its contact: the normal for j = 0, friction direction j - 1 after it. */
static void direction(const perp_world *world, int32_t j, double *d)
{
    d[0] = j == 0 ? 1.0 : 0.0;
    d[1] = j == 0 ? 0.0 : world->edge[j - 1][0];
    d[2] = j == 0 ? 0.0 : world->edge[j - 1][1];
}

/* Adds d_a' G d_b to the block of contacts i (rows) and j (columns) and, mirrored, to that of j and
 * i. On the diagonal only a >= b is computed: the matrix is symmetric to the last bit. */
static void add_block(perp_world *world, const perp__world_contact *i, const perp__world_contact *j,
                      const double *G, int32_t n)
{
    double *W = world->work.matrix;
    int32_t a, b;

    for (b = 0; b < j->edges + 1; b++) {
        double d[3], Gd[3];

        direction(world, b, d);
        perp__apply3(Gd, G, d);
        for (a = i == j ? b : 0; a < i->edges + 1; a++) {
            double e[3], value;
            size_t row = (size_t)(i->first_row + a), column = (size_t)(j->first_row + b);

            direction(world, a, e);
            value = perp__dot3(e, Gd);
            W[row + column * (size_t)n] += value;
            if (row != column)
                W[column + row * (size_t)n] += value;
        }
    }
}

/* What body `motion` contributes to the blocks of its contacts with each other. */
static void add_body(perp_world *world, const perp__contact_set *set, const perp__motion *motion,
                     int32_t n)
{
    const perp__link *links = world->links + motion->first_link;
    int32_t i, j, k, l;

    for (i = 0; i < motion->touched; i++) {
        const perp__world_contact *ci = &set->contacts[links[i].contact];

        for (j = 0; j <= i; j++) {
            const perp__world_contact *cj = &set->contacts[links[j].contact];
            double G[9];

            for (k = 0; k < 3; k++)
                for (l = 0; l < 3; l++)
                    G[3 * k + l] =
                        perp__dot6(ci->rows[links[i].side][k], cj->response[links[j].side][l]);
            add_block(world, ci, cj, G, n);
        }
    }
}

static void add_cone(perp_world *world, const perp__world_contact *contact, int32_t n)
{
    double *W = world->work.matrix;
    size_t first = (size_t)contact->first_row;
    size_t lambda = first + (size_t)contact->edges + 1;
    size_t j;

    W[lambda + first * (size_t)n] = contact->friction;
    for (j = first + 1; j < lambda; j++) {
        W[j + lambda * (size_t)n] = 1.0;
        W[lambda + j * (size_t)n] = -1.0;
    }
}

void perp__assemble_matrix(perp_world *world, const perp__contact_set *set,
                           const perp__island *island)
{
    size_t rows = (size_t)island->rows;
    int32_t i;

    memset(world->work.matrix, 0, rows * rows * sizeof *world->work.matrix);
    for (i = 0; i < island->bodies; i++)
        add_body(world, set, &world->motions[world->body_order[island->first_body + i]],
                 island->rows);
    for (i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact =
            &set->contacts[world->contact_order[island->first_contact + i]];

        if (contact->edges > 0)
            add_cone(world, contact, island->rows);
    }
}
