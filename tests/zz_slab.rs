mod common;
use common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;
#[test]
fn slab() {
    for (e, half_box, yaw, offset) in [
        (1e5, 0.1, 0.0, 0.0),
        (1e5, 0.1, 0.3, 0.0),
        (3e4, 0.1, 0.0, 0.02),
        (1e5, 0.15, 0.1, 0.03),
        (3e5, 0.05, 0.0, 0.0),
        (3e4, 0.05, 0.5, 0.0),
        (2e4, 0.2, 0.2, 0.01),
    ] {
        let (mut physics, _) = world_with_floor(1.0 / 60.0);
        let (_, _) = physics.insert(
            RigidBodyBuilder::fixed().translation(Vector::Y * 0.5).rotation(Vector::Y * yaw),
            ColliderBuilder::cuboid(half_box, 0.1, half_box).friction(0.8),
        );
        let mut world = DeformableWorld::new();
        let slab = DeformableBodyBuilder::cuboid(Vector::new(0.4, 0.03, 0.2), [10, 1, 5])
            .can_sleep(false)
            .translation(Vector::new(offset as f32, 0.635, 0.0))
            .material(DeformableMaterial::new(e, 0.3).friction(0.8).mass_damping(1.0));
        let slab = world.insert(slab).unwrap();
        let mut fastest = 0.0f64;
        let mut energy_up = 0.0f64;
        for step in 0..600 {
            world.step(&mut physics);
            if step > 480 {
                let v = (0..world.bodies[slab].vertex_count())
                    .map(|i| {
                        let v = world.bodies[slab].velocity(i).unwrap();
                        (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
                    })
                    .fold(0.0, f64::max);
                fastest = fastest.max(v);
                energy_up = energy_up.max(world.bodies[slab].kinetic_energy());
            }
        }
        println!(
            "SLAB E {e:.0e} half {half_box} yaw {yaw} offset {offset}: fastest {fastest:.2e} m/s y {:.3} gave {} conv {}",
            world.bodies[slab].center_of_mass()[1],
            world.counters().gave_up,
            world.counters().not_converged
        );
    }
}
