//! Rapier with its defaults, nothing asleep; substeps: solver iterations times so many (its own
//! knob of accuracy). Called as every peer is, see ../scene.h.
use rapier3d::prelude::*;
use std::io::{Read, Write};

struct Body {
    sphere: bool,
    numbers: Vec<f64>, // mass, half 3, position 3, orientation 4 (w first), velocity 3
}

struct Scene {
    planar: bool,
    steps: usize,
    h: f64,
    friction: f64,
    gravity: [f64; 3],
    bodies: Vec<Body>,
}

fn read_scene() -> Scene {
    let mut text = String::new();
    std::io::stdin().read_to_string(&mut text).expect("a scene");
    let mut words = text.split_whitespace().skip(2);
    let mut next = || words.next().expect("a number").parse::<f64>().expect("a number");
    let (planar, _, steps, h, friction) = (next() != 0.0, next(), next() as usize, next(), next());
    let gravity = [next(), next(), next()];
    let count = next() as usize;
    let bodies = (0..count)
        .map(|_| Body { sphere: next() != 0.0, numbers: (0..14).map(|_| next()).collect() })
        .collect();
    Scene { planar, steps, h, friction, gravity, bodies }
}

fn processor_seconds() -> f64 {
    let mut now = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    unsafe { libc::clock_gettime(libc::CLOCK_PROCESS_CPUTIME_ID, &mut now) };
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}

fn add(body: &Body, friction: f64, bodies: &mut RigidBodySet, shapes: &mut ColliderSet) -> RigidBodyHandle {
    let x: Vec<f32> = body.numbers.iter().map(|&number| number as f32).collect();
    let turn = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(x[7], x[8], x[9], x[10]));
    let builder = if x[0] > 0.0 { RigidBodyBuilder::dynamic() } else { RigidBodyBuilder::fixed() };
    let rigid = builder
        .position(Isometry::from_parts(vector![x[4], x[5], x[6]].into(), turn))
        .linvel(vector![x[11], x[12], x[13]])
        .can_sleep(false);
    let handle = bodies.insert(rigid);
    let shape = if body.sphere { ColliderBuilder::ball(x[1]) } else { ColliderBuilder::cuboid(x[1], x[2], x[3]) };
    shapes.insert_with_parent(shape.friction(friction as f32).mass(x[0]), handle, bodies);
    handle
}

fn record(handles: &[RigidBodyHandle], bodies: &RigidBodySet, file: &mut impl Write) {
    for &handle in handles {
        let body = &bodies[handle];
        let (p, q, v, w) = (body.translation(), body.rotation(), body.linvel(), body.angvel());
        for number in [p.x, p.y, p.z, q.w, q.i, q.j, q.k, v.x, v.y, v.z, w.x, w.y, w.z] {
            file.write_all(&(number as f64).to_le_bytes()).expect("room for the record");
        }
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let scene = read_scene();
    if scene.planar {
        println!("skipped: no plane");
        return;
    }
    let times: usize = arguments[1].parse().expect("substeps");
    let parts: usize = arguments.get(4).map_or(1, |word| word.parse().expect("parts"));
    let seconds: f64 = arguments[2].parse().expect("seconds");
    let mut file = std::io::BufWriter::new(std::fs::File::create(&arguments[3]).expect("a record"));
    let (mut bodies, mut shapes) = (RigidBodySet::new(), ColliderSet::new());
    let ground = bodies.insert(RigidBodyBuilder::fixed());
    let plane = ColliderBuilder::halfspace(Vector::z_axis()).friction(scene.friction as f32);
    shapes.insert_with_parent(plane, ground, &mut bodies);
    let handles: Vec<RigidBodyHandle> =
        scene.bodies.iter().map(|body| add(body, scene.friction, &mut bodies, &mut shapes)).collect();
    let mut parameters = IntegrationParameters { dt: (scene.h / parts as f64) as f32, ..Default::default() };
    parameters.num_solver_iterations =
        std::num::NonZeroUsize::new(times * parameters.num_solver_iterations.get()).expect("substeps");
    let gravity = vector![scene.gravity[0] as f32, scene.gravity[1] as f32, scene.gravity[2] as f32];
    let (mut pipeline, mut islands) = (PhysicsPipeline::new(), IslandManager::new());
    let (mut broad, mut narrow) = (DefaultBroadPhase::new(), NarrowPhase::new());
    let (mut impulse, mut multibody) = (ImpulseJointSet::new(), MultibodyJointSet::new());
    let (mut ccd, mut took) = (CCDSolver::new(), Vec::new());
    record(&handles, &bodies, &mut file);
    while took.len() < scene.steps && (took.iter().sum::<f64>() < seconds || took.len() < 3) {
        let start = processor_seconds();
        for _ in 0..parts {
            pipeline.step(
                &gravity, &parameters, &mut islands, &mut broad, &mut narrow, &mut bodies, &mut shapes,
                &mut impulse, &mut multibody, &mut ccd, None, &(), &(),
            );
        }
        took.push(processor_seconds() - start);
        record(&handles, &bodies, &mut file);
    }
    let mean = took.iter().sum::<f64>() / took.len() as f64;
    took.sort_by(f64::total_cmp);
    println!("time {:.6} {:.6} {}", 1e3 * took[took.len() / 2], 1e3 * mean, took.len());
}
