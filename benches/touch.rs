//! Touch: what reading 16 by 16 taxels, their markers and a depth image of a pad takes beside a step of it with a ball pressed in.
//! `cargo bench --bench touch`

use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::time::Instant;

/// Steps that are timed, after as many.
const STEPS: usize = 100;

fn milliseconds(f: &mut dyn FnMut()) -> f64 {
    let start = Instant::now();
    f();
    start.elapsed().as_secs_f64() * 1e3
}

fn main() {
    let (mut physics, mut world) = (PhysicsWorld::new(), DeformableWorld::new());
    physics.gravity = Vector::ZERO;
    let pad = DeformableBodyBuilder::cuboid(Vector::new(0.02, 0.005, 0.02), [16, 4, 16])
        .material(DeformableMaterial::new(1.0e5, 0.45).mass_damping(20.0))
        .can_sleep(false);
    let pad = world.insert(pad).expect("a cuboid is a body");
    for vertex in world.bodies[pad].vertices_where(|x| x.y < -0.0049) {
        world.bodies[pad].pin(vertex).expect("a vertex of the body");
    }
    let ball = RigidBodyBuilder::kinematic_velocity_based().translation(Vector::Y * 0.0151);
    let (ball, _) = physics.insert(ball, ColliderBuilder::ball(0.01));
    let up = Pose::new(Vector::Y * 0.005, Vector::X * -std::f32::consts::FRAC_PI_2);
    let skin = TactilePad::new(&world.bodies[pad], up, [0.02, 0.02], [16, 16]).expect("there is a surface");
    let eye = Pose::new(Vector::Y * -0.02, Vector::X * -std::f32::consts::FRAC_PI_2);
    let camera = DepthCamera::new(eye, 1.2, [64, 64], [0.016, 0.1]).expect("a camera");
    let (mut step, mut taxels, mut markers, mut image) = (0.0, 0.0, 0.0, 0.0);
    let mut depths = camera.render(&world.bodies[pad]);
    for k in 0..2 * STEPS {
        // In and along, so that no step is at rest.
        let led = if k < STEPS { Vector::Y * -0.001 } else { Vector::X * 0.002 };
        physics.bodies[ball].set_linvel(led, true);
        let stepped = milliseconds(&mut || world.step(&mut physics));
        if k < STEPS {
            continue;
        }
        step += stepped;
        taxels += milliseconds(&mut || drop(skin.read(&world, pad).expect("the body is there")));
        let body = &world.bodies[pad];
        markers += milliseconds(&mut || drop(skin.marker_displacements(body, &up).expect("its body")));
        depths.fill(f64::INFINITY);
        image += milliseconds(&mut || camera.render_into(body, &mut depths));
    }
    println!(
        "{} vertices, {} contacts: a step {:.3} ms; of it taxels {:.3}, markers {:.3}, a depth image {:.3}",
        world.bodies[pad].vertex_count(),
        world.contacts().len(),
        step / STEPS as f64,
        taxels / step,
        markers / step,
        image / step
    );
    assert!(
        taxels + markers < 0.05 * step,
        "reading taxels and markers takes a twentieth of a step and more"
    );
}
