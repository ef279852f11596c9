/* ODE, as its manual says: collide with contact joints, then dWorldQuickStep (20 iterations, so
 * many times that as substeps say). ERP and CFM are the defaults; bodies are never disabled. */
#include "scene.h"

#include <ode/ode.h>

#include <vector>

struct engine {
    dWorldID world;
    dSpaceID space;
    dJointGroupID contacts;
    double friction;
    std::vector<dBodyID> bodies;
    std::vector<dGeomID> shapes;
};

static void meet(void *object, dGeomID first, dGeomID second)
{
    enum { MOST = 8 };
    engine *e = static_cast<engine *>(object);
    dBodyID a = dGeomGetBody(first), b = dGeomGetBody(second);
    dContact contacts[MOST];
    if (!a && !b)
        return;
    const int count = dCollide(first, second, MOST, &contacts[0].geom, sizeof *contacts);
    for (int k = 0; k < count; k++) {
        memset(&contacts[k].surface, 0, sizeof contacts[k].surface);
        contacts[k].surface.mode = dContactApprox1;
        contacts[k].surface.mu = e->friction;
        dJointAttach(dJointCreateContact(e->world, e->contacts, &contacts[k]), a, b);
    }
}

static void step(void *object, double h)
{
    engine *e = static_cast<engine *>(object);
    dSpaceCollide(e->space, e, meet);
    dWorldQuickStep(e->world, h);
    dJointGroupEmpty(e->contacts);
}

static void read_state(void *object, int k, double *x)
{
    const engine *e = static_cast<engine *>(object);
    dBodyID body = e->bodies[size_t(k)];
    memset(x, 0, 13 * sizeof *x);
    memcpy(x, dGeomGetPosition(e->shapes[size_t(k)]), 3 * sizeof *x);
    dQuaternion q;
    dGeomGetQuaternion(e->shapes[size_t(k)], q);
    memcpy(x + 3, q, 4 * sizeof *x);
    if (body) {
        memcpy(x + 7, dBodyGetLinearVel(body), 3 * sizeof *x);
        memcpy(x + 10, dBodyGetAngularVel(body), 3 * sizeof *x);
    }
}

static void add(engine &e, const scene_body &b)
{
    const double *half = b.half;
    dMass mass;
    dBodyID body = nullptr;
    dGeomID shape = b.sphere ? dCreateSphere(e.space, half[0])
                             : dCreateBox(e.space, 2 * half[0], 2 * half[1], 2 * half[2]);
    if (b.mass > 0) {
        body = dBodyCreate(e.world);
        if (b.sphere)
            dMassSetSphereTotal(&mass, b.mass, half[0]);
        else
            dMassSetBoxTotal(&mass, b.mass, 2 * half[0], 2 * half[1], 2 * half[2]);
        dBodySetMass(body, &mass);
        dGeomSetBody(shape, body);
        dBodySetLinearVel(body, b.velocity[0], b.velocity[1], b.velocity[2]);
    }
    dGeomSetPosition(shape, b.position[0], b.position[1], b.position[2]);
    dGeomSetQuaternion(shape, b.orientation);
    e.bodies.push_back(body);
    e.shapes.push_back(shape);
}

int main(int argc, char **argv)
{
    scene s;
    FILE *record = scene_open(&s, argc, argv);
    if (s.planar) {
        puts("skipped: no plane");
        return 0;
    }
    dInitODE();
    engine e = {
        dWorldCreate(), dHashSpaceCreate(nullptr), dJointGroupCreate(0), s.friction, {}, {}};
    dWorldSetGravity(e.world, s.gravity[0], s.gravity[1], s.gravity[2]);
    dWorldSetQuickStepNumIterations(e.world,
                                    atoi(argv[1]) * dWorldGetQuickStepNumIterations(e.world));
    dCreatePlane(e.space, 0, 0, 1, 0);
    for (int i = 0; i < s.count; i++)
        add(e, s.bodies[i]);
    scene_play(&s, &e, step, read_state, record, atof(argv[2]), argc > 4 ? atoi(argv[4]) : 1);
    fclose(record);
    return 0;
}
