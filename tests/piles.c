/* What the scenes need once their bodies are placed: masses, motion, friction, frames. */
#include "piles.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const char *piles_class_text(int32_t class)
{
    static const char *const texts[PILES_CLASSES] = {"column", "tower", "wall", "balls", "heap"};

    return class >= 0 && class < PILES_CLASSES ? texts[class] : "unknown";
}

piles_options piles_defaults(void)
{
    piles_options o;

    memset(&o, 0, sizeof o);
    o.class = PILES_COLUMN;
    o.seed = 1;
    o.contacts = 40;
    o.dim = 3;
    o.mass_ratio = 1.0;
    o.mu = 0.5;
    o.moved = 1;
    return o;
}

piles_options piles_draw(uint64_t seed, int32_t contacts)
{
    static const double ratios[] = {1, 1, 1e2, 1e4, 1e6, 1e8};
    static const double frictions[] = {0.0, 0.3, 0.5, 0.8, 1.0, 10.0, 1e3, -1, -1};
    piles_options o = piles_defaults();
    gen_random random;

    gen_seed(&random, seed * UINT64_C(0x2545f4914f6cdd1d) + 7);
    o.seed = seed;
    o.class = (int32_t)(seed % PILES_CLASSES);
    o.contacts = contacts;
    o.dim = gen_integer(&random, 4) ? 3 : gen_integer(&random, 3);
    o.mass_ratio = ratios[gen_integer(&random, 6)];
    o.order = gen_integer(&random, 4);
    o.mu = frictions[gen_integer(&random, 9)];
    o.motion = gen_integer(&random, 3);
    o.restitution = gen_integer(&random, 3) ? 0.0 : 0.5;
    o.gaps = gen_integer(&random, 4) == 0;
    o.moved = gen_integer(&random, 4) > 0;
    o.shuffled = gen_integer(&random, 2);
    return o;
}

static void set_masses(piles_scene *s, gen_random *random, const piles_options *o)
{
    double low = INFINITY, high = -INFINITY;
    int32_t b, k;

    for (b = 0; b < s->bodies; b++) {
        low = fmin(low, s->body[b].position[2]);
        high = fmax(high, s->body[b].position[2]);
    }
    for (b = 0; b < s->bodies; b++) {
        piles_body *body = &s->body[b];
        const double height = high > low ? (body->position[2] - low) / (high - low) : 0.0;
        const double any = b == 0 ? 0.0 : b == 1 ? 1.0 : gen_uniform(random, 0, 1);
        const double share = o->order == PILES_HEAVY_ON_LIGHT   ? height
                             : o->order == PILES_LIGHT_ON_HEAVY ? 1.0 - height
                             : o->order == PILES_ALTERNATING    ? b % 2
                                                                : any;
        /* a ball's is 2/5 m r^2, a box's m (a^2 + b^2) / 3 */
        const double factor = o->class == PILES_BALLS || o->class == PILES_HEAP ? 0.2 : 1.0 / 3.0;

        body->mass = exp(share * log(o->mass_ratio));
        for (k = 0; k < 3; k++) {
            double y = body->half[(k + 1) % 3], z = body->half[(k + 2) % 3];

            body->inertia[k][k] = factor * body->mass * (y * y + z * z);
        }
    }
}

static void set_motion(piles_scene *s, gen_random *random, const piles_options *o)
{
    int32_t b, k;

    for (b = 0; b < s->bodies; b++)
        if (o->motion == PILES_IMPACT ||
            (o->motion == PILES_PUSH && (b == s->bodies / 2 || gen_integer(random, 50) == 0)))
            for (k = 0; k < 6; k++)
                s->body[b].velocity[k] = gen_normal(random) * (k < 3 ? 1.0 : 0.3);
}

static void unit(gen_random *random, double x[3])
{
    double length;
    int k;

    do {
        for (k = 0; k < 3; k++)
            x[k] = gen_uniform(random, -1, 1);
        length = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
    } while (length < 0.1 || length > 1);
    for (k = 0; k < 3; k++)
        x[k] /= length;
}

/* A tangent at random, orthogonal to the normal to rounding. */
static void draw_tangent(gen_random *random, piles_contact *c)
{
    const double *n = c->normal;
    double other[3], *t = c->tangent, length;

    do {
        unit(random, other);
        t[0] = n[1] * other[2] - n[2] * other[1];
        t[1] = n[2] * other[0] - n[0] * other[2];
        t[2] = n[0] * other[1] - n[1] * other[0];
        length = sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]);
    } while (length < 0.3);
    t[0] /= length;
    t[1] /= length;
    t[2] /= length;
}

static void set_contacts(piles_scene *s, gen_random *random, const piles_options *o)
{
    static const double frictions[] = {0.0, 0.3, 1.0, 1e3};
    int32_t i;

    for (i = 0; i < s->contacts; i++) {
        piles_contact *c = &s->contact[i];
        const int32_t dim = 1 + gen_integer(random, 3), friction = gen_integer(random, 4);

        c->dim = o->dim ? o->dim : dim;
        c->mu = o->mu < 0.0 ? frictions[friction] : o->mu;
        if (o->gaps && gen_integer(random, 2))
            c->gap = gen_uniform(random, 0, 0.02);
        draw_tangent(random, c);
    }
}

/* R I R' */
static void turn_inertia(double R[3][3], double inertia[3][3])
{
    double product[3][3];
    int i, j, k;

    for (i = 0; i < 3; i++)
        for (j = 0; j < 3; j++)
            product[i][j] =
                R[i][0] * inertia[0][j] + R[i][1] * inertia[1][j] + R[i][2] * inertia[2][j];
    for (i = 0; i < 3; i++)
        for (j = 0; j <= i; j++) {
            double sum = 0.0;

            for (k = 0; k < 3; k++)
                sum += product[i][k] * R[j][k];
            inertia[i][j] = inertia[j][i] = sum;
        }
}

static void move(piles_scene *s, gen_random *random)
{
    double R[3][3], shift[3];
    int32_t i, k;

    gen_rotation(random, 0, R);
    for (k = 0; k < 3; k++)
        shift[k] = gen_uniform(random, -10, 10);
    gen_turn(R, s->down);
    for (i = 0; i < s->bodies; i++) {
        gen_turn(R, s->body[i].position);
        gen_turn(R, s->body[i].velocity);
        gen_turn(R, s->body[i].velocity + 3);
        turn_inertia(R, s->body[i].inertia);
        for (k = 0; k < 3; k++)
            s->body[i].position[k] += shift[k];
    }
    for (i = 0; i < s->contacts; i++) {
        gen_turn(R, s->contact[i].point);
        gen_turn(R, s->contact[i].normal);
        gen_turn(R, s->contact[i].tangent);
        for (k = 0; k < 3; k++)
            s->contact[i].point[k] += shift[k];
    }
}

static void shuffle(piles_scene *s, gen_random *random)
{
    int32_t i;

    for (i = s->contacts - 1; i > 0; i--) {
        const int32_t j = gen_integer(random, i + 1);
        const piles_contact kept = s->contact[i];

        s->contact[i] = s->contact[j];
        s->contact[j] = kept;
    }
}

void piles_make(piles *p, const piles_options *options)
{
    piles_scene s;
    gen_random random;

    memset(&s, 0, sizeof s);
    s.down[2] = -1.0;
    gen_seed(&random, options->seed);
    piles_fill(&s, &random, options);
    set_masses(&s, &random, options);
    set_motion(&s, &random, options);
    set_contacts(&s, &random, options);
    if (options->moved)
        move(&s, &random);
    if (options->shuffled)
        shuffle(&s, &random);
    piles_assemble(p, &s, options);
    free(s.body);
    free(s.contact);
}

perp_contact_laws piles_laws(const piles *p)
{
    perp_contact_laws laws;

    (void)perp_contact_laws_init(&laws, sizeof laws);
    laws.contacts = p->contacts;
    laws.dims = p->dims;
    laws.mu = p->mu;
    return laws;
}

perp_contact_dynamics piles_dynamics(const piles *p)
{
    perp_contact_dynamics dynamics;

    (void)perp_struct_init(&dynamics, sizeof dynamics);
    dynamics.n = p->n;
    dynamics.M = &p->M;
    dynamics.H = &p->H;
    return dynamics;
}

perp_contact_settings piles_settings(int32_t method, double tol)
{
    perp_contact_settings settings;

    (void)perp_contact_settings_init(&settings, sizeof settings);
    settings.method = method;
    settings.tol = tol;
    return settings;
}

perp_status piles_solve(perp_context *context, const piles *p,
                        const perp_contact_settings *settings, perp_contact_result *result,
                        double *v, double *r, double *u, const double *r0)
{
    const perp_contact_laws laws = piles_laws(p);
    const perp_contact_dynamics dynamics = piles_dynamics(p);

    (void)perp_struct_init(result, sizeof *result);
    return perp_contact_solve(context, ANSWER(v, r, u), result, settings,
                              DYNAMICS(&laws, &dynamics, p->f, p->w), r0);
}
