use foible3d::prelude::*;
use rapier3d::prelude::*;
fn main() {
    let mut physics = PhysicsWorld::new();
    physics.insert(RigidBodyBuilder::fixed().translation(Vector::Y * -0.1), ColliderBuilder::cuboid(2.0, 0.1, 2.0).friction(0.5));
    let mut d = DeformableWorld::new();
    let (m, mb) = (64.0, 64.0);
    let e = (mb + m / 2.0) * 9.81 / (0.05 * 0.16);
    d.insert(DeformableBodyBuilder::cuboid(Vector::splat(0.2), [6, 6, 6]).translation(Vector::Y * 0.201)
        .material(DeformableMaterial::new(e, 0.3)).settings(SolverSettings::iterations(1))).unwrap();
    let (b, bc) = physics.insert(RigidBodyBuilder::dynamic().translation(Vector::Y * 0.605).can_sleep(false), ColliderBuilder::cuboid(0.2, 0.2, 0.2).density((mb / 0.064) as f32).friction(0.5));
    let from: usize = std::env::args().nth(1).map_or(200, |s| s.parse().unwrap());
    for i in 0..from+3 { d.step(&mut physics); if i >= from {
        let p = physics.bodies[b].translation();
        println!("--- step {i} box {:?} contacts {}", p, d.contacts_with(bc).count());
        for c in d.contacts_with(bc) { let q = c.point - p; if c.force.length()>0.0 || c.gap<1e-3 {println!("  ({:+.4},{:+.5},{:+.4}) n ({:+.3},{:+.3},{:+.3}) gap {:+.2e} f ({:+.2},{:+.2},{:+.2})", q.x, q.y, q.z, c.normal.x, c.normal.y, c.normal.z, c.gap, c.force.x, c.force.y, c.force.z);} }
    } }
}
