/* Bullet in the scenes in motion, as its manual says: a discrete world, 10 iterations, no sleeping.
 *
 *   motion_bullet SCENE [SECONDS [SUBSTEPS]]
 *
 * A step is SUBSTEPS of its own, 1 by default: more make it more accurate than more iterations do.
 *
 * The overlap is that of its own contact points, about the margins that it gives to hulls; moved is
 * how far the farthest of all bodies has come. */
#include "motion.h"

#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <vector>

struct engine {
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btDiscreteDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
    std::vector<btRigidBody *> bodies;
    const motion_scene *scene;
    int substeps = 1, now = 0;
    double h = 0, overlap = 0;
};

static btVector3 vector(const double *v)
{
    return btVector3(v[0], v[1], v[2]);
}

static btCollisionShape *shape_of(const motion_body &b)
{
    if (b.shape == MOTION_BOX)
        return new btBoxShape(vector(b.size));
    if (b.shape == MOTION_SPHERE)
        return new btSphereShape(b.size[0]);
    btConvexHullShape *hull = new btConvexHullShape;
    for (int k = 0; k < b.count; k += 3)
        hull->addPoint(vector(b.size + k));
    return hull;
}

static btRigidBody *add_body(engine &e, btCollisionShape *shape, const motion_body &b)
{
    const double *q = b.orientation;
    btRigidBody *body = new btRigidBody(b.mass, nullptr, shape, vector(b.inertia));
    body->setFriction(sqrt(e.scene->friction)); /* a pair's is the product */
    body->setActivationState(DISABLE_DEACTIVATION);
    body->setDamping(0, 0);
    const btTransform place(btQuaternion(q[1], q[2], q[3], q[0]), vector(b.position));
    body->setWorldTransform(place);
    body->setInterpolationWorldTransform(place); /* where a driven body comes from */
    if (b.driven)
        body->setCollisionFlags(body->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    e.world.addRigidBody(body);
    body->setLinearVelocity(vector(b.velocity));
    return body;
}

/* The angle of a hinge is that of b, in the frame of a; as its motor knows impulses, force times h.
 */
static void add_joint(engine &e, const motion_joint &j, btRigidBody &ground)
{
    btRigidBody &a = j.b < 0 ? ground : *e.bodies[size_t(j.a)];
    btRigidBody &b = *e.bodies[size_t(j.b < 0 ? j.a : j.b)];
    const btTransform to_a = a.getWorldTransform().inverse();
    const btTransform to_b = b.getWorldTransform().inverse();
    const btVector3 anchor = vector(j.anchor), axis = vector(j.axis);
    if (j.kind == MOTION_BALL) {
        e.world.addConstraint(new btPoint2PointConstraint(a, b, to_a * anchor, to_b * anchor),
                              true);
        return;
    }
    btHingeConstraint *hinge = new btHingeConstraint(
        a, b, to_a * anchor, to_b * anchor, to_a.getBasis() * axis, to_b.getBasis() * axis, true);
    if (j.lower < j.upper)
        hinge->setLimit(j.lower, j.upper);
    if (j.force > 0)
        hinge->enableAngularMotor(true, j.speed, j.force * e.h);
    e.world.addConstraint(hinge, true);
}

static void prepare(void *object, int step)
{
    static_cast<engine *>(object)->now = step;
}

static void move_driven(engine &e)
{
    for (int i = 0; i < e.scene->bodies; i++) {
        if (!e.scene->body[i].driven)
            continue;
        double v[3];
        motion_velocity(e.scene, &e.scene->body[i], e.now, v);
        btTransform place = e.bodies[size_t(i)]->getWorldTransform();
        place.setOrigin(place.getOrigin() + e.h * vector(v));
        e.bodies[size_t(i)]->setWorldTransform(place);
    }
}

static void step(void *object)
{
    engine *e = static_cast<engine *>(object);
    for (int k = 0; k < e->substeps; k++) {
        move_driven(*e);
        e->world.stepSimulation(e->h, 0);
    }
}

static void look(void *object, int begun)
{
    engine *e = static_cast<engine *>(object);
    for (int i = 0; begun && i < e->dispatcher.getNumManifolds(); i++) {
        const btPersistentManifold *pair = e->dispatcher.getManifoldByIndexInternal(i);
        for (int k = 0; k < pair->getNumContacts(); k++)
            e->overlap = std::max(e->overlap, -pair->getContactPoint(k).getDistance());
    }
}

static double energy(void *object)
{
    const engine *e = static_cast<engine *>(object);
    double sum = 0;
    for (int i = 0; i < e->scene->bodies; i++) {
        const motion_body &b = e->scene->body[i];
        const btRigidBody &body = *e->bodies[size_t(i)];
        const btTransform &place = body.getWorldTransform();
        const btVector3 spin = body.getAngularVelocity() * place.getBasis(); /* in its own frame */
        if (b.mass > 0)
            sum += 0.5 * b.mass * body.getLinearVelocity().length2() +
                   0.5 * spin.dot(spin * vector(b.inertia)) -
                   b.mass * place.getOrigin().dot(vector(e->scene->gravity));
    }
    return sum;
}

int main(int argc, char **argv)
{
    motion_scene s;
    engine e;
    motion_engine calls = {&e, prepare, step, look, energy};
    const motion_body still = {0,         0,         0, 0,      {0, 0, 0}, {0, 0, 0}, {1, 0, 0, 0},
                               {0, 0, 0}, {0, 0, 0}, 0, nullptr};
    if (argc < 2)
        motion_end("usage: motion_bullet SCENE [SECONDS]");
    motion_read(&s, argv[1]);
    if (s.planar) {
        puts("skipped: no plane");
        return 0;
    }
    e.scene = &s;
    e.substeps = argc > 3 ? atoi(argv[3]) : 1;
    e.h = s.h / e.substeps;
    e.world.setGravity(vector(s.gravity));
    btRigidBody *ground = add_body(e, new btStaticPlaneShape(btVector3(0, 0, 1), 0), still);
    for (int i = 0; i < s.bodies; i++)
        e.bodies.push_back(add_body(e, shape_of(s.body[i]), s.body[i]));
    for (int i = 0; i < s.joints; i++)
        add_joint(e, s.joint[i], *ground);
    motion_play(&s, "bullet", &calls, argc > 2 ? atof(argv[2]) : 30);
    double moved = 0;
    for (int i = 0; i < s.bodies; i++) {
        const btVector3 &end = e.bodies[size_t(i)]->getWorldTransform().getOrigin();
        moved = std::max(moved, double((end - vector(s.body[i].position)).length()));
    }
    printf(" overlap %.3g moved %.3g\n", e.overlap, moved);
    return 0;
}
