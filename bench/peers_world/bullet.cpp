/* Bullet, as its manual says: a discrete world, one step of h, no sleeping; substeps: solver
 * iterations times so many (its own knob of accuracy, 10 by default). */
#include "scene.h"

#include <btBulletDynamicsCommon.h>

#include <vector>

struct engine {
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btDiscreteDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
    std::vector<btRigidBody *> bodies;
};

static void step(void *object, double h)
{
    static_cast<engine *>(object)->world.stepSimulation(btScalar(h), 0);
}

static void read_state(void *object, int k, double *x)
{
    const btRigidBody *body = static_cast<engine *>(object)->bodies[size_t(k)];
    const btVector3 p = body->getWorldTransform().getOrigin(), v = body->getLinearVelocity();
    const btVector3 w = body->getAngularVelocity();
    const btQuaternion q = body->getWorldTransform().getRotation();
    const double numbers[13] = {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z(),
                                v.x(), v.y(), v.z(), w.x(), w.y(), w.z()};
    memcpy(x, numbers, sizeof numbers);
}

static btRigidBody *add(engine &e, btCollisionShape *shape, double mass, double friction)
{
    btVector3 inertia(0, 0, 0);
    if (mass > 0)
        shape->calculateLocalInertia(btScalar(mass), inertia);
    btRigidBody *body = new btRigidBody(btScalar(mass), nullptr, shape, inertia);
    body->setFriction(btScalar(sqrt(friction))); /* a pair's is the product */
    body->setActivationState(DISABLE_DEACTIVATION);
    body->setDamping(0, 0);
    return body;
}

int main(int argc, char **argv)
{
    scene s;
    FILE *record = scene_open(&s, argc, argv);
    engine e;
    if (s.planar) {
        puts("skipped: no plane");
        return 0;
    }
    e.world.setGravity(
        btVector3(btScalar(s.gravity[0]), btScalar(s.gravity[1]), btScalar(s.gravity[2])));
    e.world.getSolverInfo().m_numIterations *= atoi(argv[1]);
    e.world.addRigidBody(add(e, new btStaticPlaneShape(btVector3(0, 0, 1), 0), 0, s.friction));
    for (int i = 0; i < s.count; i++) {
        const scene_body &b = s.bodies[i];
        const double *p = b.position, *q = b.orientation, *v = b.velocity;
        btCollisionShape *shape = nullptr;
        if (b.sphere)
            shape = new btSphereShape(btScalar(b.half[0]));
        else
            shape = new btBoxShape(
                btVector3(btScalar(b.half[0]), btScalar(b.half[1]), btScalar(b.half[2])));
        btRigidBody *body = add(e, shape, b.mass, s.friction);
        body->setWorldTransform(btTransform(
            btQuaternion(btScalar(q[1]), btScalar(q[2]), btScalar(q[3]), btScalar(q[0])),
            btVector3(btScalar(p[0]), btScalar(p[1]), btScalar(p[2]))));
        e.world.addRigidBody(body);
        body->setLinearVelocity(btVector3(btScalar(v[0]), btScalar(v[1]), btScalar(v[2])));
        e.bodies.push_back(body);
    }
    scene_play(&s, &e, step, read_state, record, atof(argv[2]), argc > 4 ? atoi(argv[4]) : 1);
    fclose(record);
    return 0;
}
