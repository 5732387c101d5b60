use foible3d::prelude::*;
use rapier3d::prelude::*;
fn main() {
    for (it, nu, lb, touch) in [(3,0.3,false,true),(3,0.3,false,false),(2,0.3,false,true),(4,0.3,false,true)] { for tol in [1e-6, 1e-8, 1e-10] {
    let mut physics = PhysicsWorld::new();
    physics.insert(RigidBodyBuilder::fixed().translation(Vector::Y * -0.1), ColliderBuilder::cuboid(2.0, 0.1, 2.0).friction(0.5));
    let mut d = DeformableWorld::new(); d.parameters.contact_tolerance = tol;
    let (m, mb) = (64.0, 64000.0);
    let e = (mb + m / 2.0) * 9.81 / (0.05 * 0.16);
    let acceleration = if lb { Acceleration::Lbfgs{window:8} } else { Acceleration::None };
    let c = d.insert(DeformableBodyBuilder::cuboid(Vector::splat(0.2), [6, 6, 6]).translation(Vector::Y * if touch {0.2} else {0.201})
        .material(DeformableMaterial::new(e, nu)).settings(SolverSettings{acceleration, ..SolverSettings::iterations(it)})).unwrap();
    let (b, _bc) = physics.insert(RigidBodyBuilder::dynamic().translation(Vector::Y * if touch {0.6} else {0.605}).can_sleep(false), ColliderBuilder::cuboid(0.2, 0.2, 0.2).density((mb / 0.064) as f32).friction(0.5));
    print!("it {it} lb {lb} touch {touch}: ");
    let mut mx = 0.0f32; let mut re = 0;
    for i in 0..360 { d.step(&mut physics); mx = mx.max(physics.bodies[b].linvel().with_y(0.0).length()); re += d.counters().guard_retries;
      
      if i % 60 == 59 { let u = physics.bodies[b].rotation()*Vector::Y; print!("{:.0e}/{:.0e}/{}  ", mx, u.x.hypot(u.z), re); mx = 0.0; re=0; } }
    println!(" soft speed {:.1e} tol {tol}", d.bodies[c].max_speed());
    }}
}
