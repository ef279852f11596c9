/* Jolt with its defaults, one thread, nothing asleep; substeps: velocity steps times so many (its
 * own knob of accuracy, 10 by default). */
#include "scene.h"

#include <Jolt/Jolt.h>

#include <Jolt/Core/Factory.h>
#include <Jolt/Core/JobSystemSingleThreaded.h>
#include <Jolt/Core/TempAllocator.h>
#include <Jolt/Physics/Body/BodyCreationSettings.h>
#include <Jolt/Physics/Collision/Shape/BoxShape.h>
#include <Jolt/Physics/Collision/Shape/SphereShape.h>
#include <Jolt/Physics/PhysicsSystem.h>
#include <Jolt/RegisterTypes.h>

#include <vector>

using namespace JPH;

/* Two layers: what stands still and what moves. */
struct layers final : BroadPhaseLayerInterface,
                      ObjectVsBroadPhaseLayerFilter,
                      ObjectLayerPairFilter {
    uint GetNumBroadPhaseLayers() const override
    {
        return 2;
    }
    BroadPhaseLayer GetBroadPhaseLayer(ObjectLayer layer) const override
    {
        return BroadPhaseLayer(BroadPhaseLayer::Type(layer));
    }
    bool ShouldCollide(ObjectLayer a, BroadPhaseLayer b) const override
    {
        return a == 1 || b == BroadPhaseLayer(1);
    }
    bool ShouldCollide(ObjectLayer a, ObjectLayer b) const override
    {
        return a == 1 || b == 1;
    }
};

struct engine {
    layers filter;
    TempAllocatorImpl memory{256 << 20};
    JobSystemSingleThreaded jobs{cMaxPhysicsJobs};
    PhysicsSystem system;
    std::vector<BodyID> bodies;
};

static void step(void *object, double h)
{
    engine *e = static_cast<engine *>(object);
    e->system.Update(float(h), 1, &e->memory, &e->jobs);
}

static void read_state(void *object, int k, double *x)
{
    engine *e = static_cast<engine *>(object);
    const BodyInterface &all = e->system.GetBodyInterfaceNoLock();
    const RVec3 p = all.GetCenterOfMassPosition(e->bodies[size_t(k)]);
    const Quat q = all.GetRotation(e->bodies[size_t(k)]);
    const Vec3 v = all.GetLinearVelocity(e->bodies[size_t(k)]);
    const Vec3 w = all.GetAngularVelocity(e->bodies[size_t(k)]);
    const double numbers[13] = {double(p.GetX()), double(p.GetY()), double(p.GetZ()), q.GetW(),
                                q.GetX(),         q.GetY(),         q.GetZ(),         v.GetX(),
                                v.GetY(),         v.GetZ(),         w.GetX(),         w.GetY(),
                                w.GetZ()};
    memcpy(x, numbers, sizeof numbers);
}

static BodyID add(engine &e, Shape *shape, RVec3 position, Quat turn, double mass, double friction)
{
    const bool moves = mass > 0;
    BodyCreationSettings settings(shape, position, turn,
                                  moves ? EMotionType::Dynamic : EMotionType::Static, moves);
    settings.mFriction = float(friction); /* a pair's is the geometric mean */
    settings.mRestitution = 0;
    settings.mLinearDamping = settings.mAngularDamping = 0;
    settings.mMaxLinearVelocity = settings.mMaxAngularVelocity = 1e6f;
    settings.mAllowSleeping = false;
    if (moves) {
        settings.mOverrideMassProperties = EOverrideMassProperties::CalculateInertia;
        settings.mMassPropertiesOverride.mMass = float(mass);
    }
    return e.system.GetBodyInterface().CreateAndAddBody(settings, EActivation::Activate);
}

static Shape *box(const double *half)
{
    const double least = fmin(half[0], fmin(half[1], half[2]));
    return new BoxShape(Vec3(float(half[0]), float(half[1]), float(half[2])),
                        fmin(cDefaultConvexRadius, float(0.5 * least)));
}

int main(int argc, char **argv)
{
    scene s;
    FILE *record = scene_open(&s, argc, argv);
    if (s.planar) {
        puts("skipped: no plane");
        return 0;
    }
    RegisterDefaultAllocator();
    Factory::sInstance = new Factory();
    RegisterTypes();
    engine *e = new engine;
    const uint most = uint(s.count + 8);
    e->system.Init(most, 0, 64 * most, 64 * most, e->filter, e->filter, e->filter);
    e->system.SetGravity(Vec3(float(s.gravity[0]), float(s.gravity[1]), float(s.gravity[2])));
    PhysicsSettings settings = e->system.GetPhysicsSettings();
    settings.mNumVelocitySteps *= uint(atoi(argv[1]));
    e->system.SetPhysicsSettings(settings);
    const double ground[3] = {1000, 1000, 10};
    add(*e, box(ground), RVec3(0, 0, -10), Quat::sIdentity(), 0, s.friction);
    for (int i = 0; i < s.count; i++) {
        const scene_body &b = s.bodies[i];
        const double *p = b.position, *q = b.orientation, *v = b.velocity;
        const BodyID id =
            add(*e, b.sphere ? new SphereShape(float(b.half[0])) : box(b.half),
                RVec3(Real(p[0]), Real(p[1]), Real(p[2])),
                Quat(float(q[1]), float(q[2]), float(q[3]), float(q[0])), b.mass, s.friction);
        if (b.mass > 0)
            e->system.GetBodyInterface().SetLinearVelocity(
                id, Vec3(float(v[0]), float(v[1]), float(v[2])));
        e->bodies.push_back(id);
    }
    e->system.OptimizeBroadPhase();
    scene_play(&s, e, step, read_state, record, atof(argv[2]), argc > 4 ? atoi(argv[4]) : 1);
    fclose(record);
    return 0;
}
