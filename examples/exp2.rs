use foible3d::prelude::*;
use rapier3d::prelude::*;
fn main() {
    for (e, nu, it, beta) in [(1e4,0.45,10,0.02),(1e4,0.3,10,0.02),(1e4,0.3,3,0.02),(1e4,0.45,10,0.05)] {
    let mut physics = PhysicsWorld::new();
    physics.insert(RigidBodyBuilder::fixed().translation(Vector::Y * -0.5), ColliderBuilder::cuboid(5.0, 0.5, 5.0).friction(0.5));
    let mut d = DeformableWorld::new();
    let axis = Vector::new(1.0, 0.0, -1.0).normalize() * (1.0f32 / 3f32.sqrt()).acos();
    let c = d.insert(DeformableBodyBuilder::cuboid(Vector::splat(0.2), [6, 6, 6]).translation(Vector::Y * 0.36).rotation(axis).linvel(Vector::Y*-4.0)
        .material(DeformableMaterial::new(e, nu).stiffness_damping(beta)).settings(SolverSettings::iterations(it))).unwrap();
    print!("{e} {nu} {it} {beta}: "); let (mut mx, mut n, mut f, mut r) = (0.0f64,0,0,0);
    for i in 0..1200 { d.step(&mut physics); let k=d.counters(); n+=k.newton_steps; f+=k.contact_failures; r+=k.guard_retries; mx=mx.max(d.bodies[c].max_speed()); if i%60==59 { print!("{mx:.0e}({}/{f}/{r}/{:.0e}) ", n/60, d.bodies[c].last_residual()); mx=0.0; n=0; f=0; r=0; } }
    println!(" vol {:.3}", d.bodies[c].volume()/0.064);
    }
}
