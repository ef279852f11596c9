#include "scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Enough for every class with up to 128 contacts asked for. */
enum { MOST_BODIES = 256, MOST_CONTACTS = 1024 };

void scene_cross(const double a[3], const double b[3], double c[3])
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

void scene_unit(gen_random *random, int32_t planar, double x[3])
{
    double length;
    int k;

    do {
        x[0] = gen_uniform(random, -1, 1);
        x[1] = gen_uniform(random, -1, 1);
        x[2] = planar ? 0.0 : gen_uniform(random, -1, 1);
        length = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
    } while (length < 0.1 || length > 1);
    for (k = 0; k < 3; k++)
        x[k] /= length;
}

int32_t scene_add_box(scene *s, double x, double y, double z, double a, double b, double c)
{
    scene_body *body;
    int k;

    if (!s->body)
        s->body = gen_allocate(MOST_BODIES, sizeof *s->body);
    if (s->bodies == MOST_BODIES)
        abort();
    body = &s->body[s->bodies];
    body->position[0] = x;
    body->position[1] = y;
    body->position[2] = z;
    body->half[0] = a;
    body->half[1] = b;
    body->half[2] = c;
    for (k = 0; k < 3; k++)
        body->rotation[k][k] = 1.0;
    return s->bodies++;
}

void scene_add_contact(scene *s, int32_t below, int32_t above, const double point[3],
                       const double normal[3])
{
    scene_contact *c;

    if (!s->contact)
        s->contact = gen_allocate(MOST_CONTACTS, sizeof *s->contact);
    if (s->contacts == MOST_CONTACTS)
        abort();
    c = &s->contact[s->contacts++];
    c->body[0] = below;
    c->body[1] = above;
    memcpy(c->point, point, sizeof c->point);
    memcpy(c->normal, normal, sizeof c->normal);
}

void scene_add_face(scene *s, int32_t below, int32_t above, const double corner[3],
                    const double edge1[3], const double edge2[3], const double normal[3],
                    int32_t count1, int32_t count2)
{
    int32_t i, j, k;

    for (i = 0; i < count1; i++)
        for (j = 0; j < count2; j++) {
            double a = count1 > 1 ? (double)i / (count1 - 1) : 0.5, point[3];
            double b = count2 > 1 ? (double)j / (count2 - 1) : 0.5;

            for (k = 0; k < 3; k++)
                point[k] = corner[k] + a * edge1[k] + b * edge2[k];
            scene_add_contact(s, below, above, point, normal);
        }
}

void scene_release(scene *s)
{
    free(s->body);
    free(s->contact);
    memset(s, 0, sizeof *s);
}
