use foible3d::prelude::*;
use rapier3d::prelude::*;
fn main() {
    for (e, nu, it) in [(1e4,0.3,3),(1e4,0.45,1),(1e5,0.3,1),(1e5,0.3,3),(1e5,0.45,10),(1e6,0.3,1),(1e6,0.3,3),(1e7,0.3,3),(1e8,0.3,3),(1e9,0.3,3)] {
    let mut physics = PhysicsWorld::new();
    physics.insert(RigidBodyBuilder::fixed().translation(Vector::Y * -0.5), ColliderBuilder::cuboid(5.0, 0.5, 5.0).friction(0.5));
    let mut d = DeformableWorld::new();
    let axis = Vector::new(1.0, 0.0, -1.0).normalize() * (1.0f32 / 3f32.sqrt()).acos();
    let c = d.insert(DeformableBodyBuilder::cuboid(Vector::splat(0.2), [6, 6, 6]).translation(Vector::Y * 0.36).rotation(axis).linvel(Vector::Y*-4.0)
        .material(DeformableMaterial::new(e, nu)).settings(SolverSettings::iterations(it))).unwrap();
    let t = std::time::Instant::now();
    print!("E {e:.0e} nu {nu} it {it}: ");
    let (mut n, mut f, mut mx) = (0,0,0.0f64);
    for i in 0..1200 { let t0=std::time::Instant::now(); d.step(&mut physics); mx=mx.max(t0.elapsed().as_secs_f64()*1e3); n+=d.counters().newton_steps; f+=d.counters().contact_failures; if i % 60 == 59 { let b=&d.bodies[c]; print!("{:.0e}/{:.3} ", b.max_speed(), b.center_of_mass()[1]); } }
    println!(" ms {:.2} worst {mx:.1} newton {:.1} fails {f}", t.elapsed().as_secs_f64()*1e3/1200.0, n as f64/1200.0);
    }
}
