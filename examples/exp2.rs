use foible3d::prelude::*;
use rapier3d::prelude::*;
fn main() {
    for (e, nu) in [(1e8,0.3),(1e9,0.3),(1e9,0.45)] { for (it,lb) in [(1,false),(2,false),(3,false),(5,false),(10,false),(0,false)] {
    let mut physics = PhysicsWorld::new();
    physics.insert(RigidBodyBuilder::fixed().translation(Vector::Y * -0.5), ColliderBuilder::cuboid(5.0, 0.5, 5.0).friction(0.5));
    let mut d = DeformableWorld::new();
    let axis = Vector::new(1.0, 0.0, -1.0).normalize() * (1.0f32 / 3f32.sqrt()).acos();
    let s = if it == 0 { SolverSettings::default() } else { SolverSettings{ acceleration: if lb {Acceleration::Lbfgs{window:8}} else {Acceleration::None}, ..SolverSettings::iterations(it)} };
    let c = d.insert(DeformableBodyBuilder::cuboid(Vector::splat(0.2), [6, 6, 6]).translation(Vector::Y * 0.36).rotation(axis).linvel(Vector::Y*-4.0)
        .material(DeformableMaterial::new(e, nu)).settings(s)).unwrap();
    let en = |b: &DeformableBody| b.kinetic_energy()+b.elastic_energy()+b.mass()*9.81f32 as f64*b.center_of_mass()[1];
    let mut prev = en(&d.bodies[c]); let mut g = vec![]; let mut its=0;
    for i in 0..600 { d.step(&mut physics); its+=d.counters().iterations; let b=&d.bodies[c]; let x = en(b); if (x-prev)/512.0 > 1e-4 { g.push(format!("{i}:{:.1e} el {:.1e}({}) r{:.0e}", (x-prev)/512.0, b.elastic_energy()/512.0, d.counters().active_contacts, b.last_residual())); } prev = x; }
    println!("E {e:.0e} nu {nu} it {it} its {:.2}: {:?}", its as f64/600.0, &g[..g.len().min(6)]);
    }}
}
