/* Box2D 2.4, as its manual says: 8 velocity and 3 position iterations (so many times that as
 * substeps say), no sleeping. */
#include "scene.h"

#include <box2d/box2d.h>

#include <vector>

struct engine {
    b2World world{b2Vec2(0, 0)};
    std::vector<b2Body *> bodies;
    int times = 1;
};

static void step(void *object, double h)
{
    engine *e = static_cast<engine *>(object);
    e->world.Step(float(h), 8 * e->times, 3 * e->times);
}

static void read_state(void *object, int k, double *x)
{
    const b2Body *body = static_cast<engine *>(object)->bodies[size_t(k)];
    const b2Vec2 p = body->GetWorldCenter(), v = body->GetLinearVelocity();
    const double angle = body->GetAngle();
    const double numbers[13] = {p.x,
                                p.y,
                                0,
                                cos(angle / 2),
                                0,
                                0,
                                sin(angle / 2),
                                v.x,
                                v.y,
                                0,
                                0,
                                0,
                                body->GetAngularVelocity()};
    memcpy(x, numbers, sizeof numbers);
}

static void add(engine &e, b2Shape &shape, double area, double mass, double friction,
                const double *position, const double *velocity)
{
    b2BodyDef definition;
    b2FixtureDef fixture;
    definition.type = mass > 0 ? b2_dynamicBody : b2_staticBody;
    definition.position.Set(float(position[0]), float(position[1]));
    definition.linearVelocity.Set(float(velocity[0]), float(velocity[1]));
    definition.allowSleep = false;
    fixture.shape = &shape;
    fixture.density = float(mass / area);
    fixture.friction = float(friction);
    b2Body *body = e.world.CreateBody(&definition);
    body->CreateFixture(&fixture);
    e.bodies.push_back(body);
}

int main(int argc, char **argv)
{
    static const double origin[] = {0, -50}, still[] = {0, 0};
    scene s;
    FILE *record = scene_open(&s, argc, argv);
    engine e;
    b2PolygonShape box;
    if (!s.planar) {
        puts("skipped: only the plane");
        return 0;
    }
    e.times = atoi(argv[1]);
    e.world.SetGravity(b2Vec2(float(s.gravity[0]), float(s.gravity[1])));
    box.SetAsBox(500, 50);
    add(e, box, 1, 0, s.friction, origin, still);
    e.bodies.clear();
    for (int i = 0; i < s.count; i++) {
        const scene_body &b = s.bodies[i];
        box.SetAsBox(float(b.half[0]), float(b.half[1]));
        add(e, box, 4 * b.half[0] * b.half[1], b.mass, s.friction, b.position, b.velocity);
    }
    scene_play(&s, &e, step, read_state, record, atof(argv[2]), argc > 4 ? atoi(argv[4]) : 1);
    fclose(record);
    return 0;
}
