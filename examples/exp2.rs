use foible3d::prelude::*;
use rapier3d::prelude::*;
fn main() {
    let mut physics = PhysicsWorld::new();
    let (_, col) = physics.insert(RigidBodyBuilder::fixed(), ColliderBuilder::ball(0.5).translation(Vector::Y*-0.5).friction(1.0));
    let mut world = DeformableWorld::new();
    let body = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [3, 3, 3])
        .translation(Vector::Y * 0.12)
        .material(DeformableMaterial::new(1e5, 0.3).friction(1.0).mass_damping(4.0));
    let body = world.insert(body).unwrap();
    for i in 0..204 { world.step(&mut physics); if i>=200 { let b=&world.bodies[body]; let w=b.mass()*9.81; println!("{i} f {:.5} n {} iters {}", world.contact_force(body,col).y as f64/w, world.contacts().len(), b.last_iterations());
    for c in world.contacts() { if c.gap<1e-3 {println!("   {:?} n {:.5} {:.5} gap {:.2e} f {:?}", c.point, c.normal.x, c.normal.z, c.gap, c.force);} } } }
}
