use foible3d::prelude::*;
use rapier3d::prelude::*;
fn main() {
    let w = std::env::args().nth(1).unwrap_or_default();
    let n: usize = std::env::args().nth(2).map_or(100, |s| s.parse().unwrap());
    let mut physics = PhysicsWorld::new();
    let mut d = DeformableWorld::new();
    if w.starts_with("cant") {
        let e = if w.ends_with("6") { 1e6 } else { 1e7 };
        d.insert(DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.1), [49, 9, 9]).material(DeformableMaterial::new(e, 0.3).mass_damping(5.0)).pinned(|x| x.x < -0.4999)).unwrap();
    } else if w.starts_with("c4") {
        d.insert(DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.1), [32, 5, 5]).material(DeformableMaterial::new(1e6, 0.3).mass_damping(5.0)).pinned(|x| x.x < -0.4999)).unwrap();
    } else {
        physics.insert(RigidBodyBuilder::fixed().translation(Vector::Y * -0.5), ColliderBuilder::cuboid(20.0, 0.5, 20.0).friction(0.5));
        let k = if w.starts_with("rest9") { 9 } else { 14 };
        d.insert(DeformableBodyBuilder::cuboid(Vector::splat(0.2), [k; 3]).translation(Vector::Y * 0.202).material(DeformableMaterial::new(1e6, 0.3))).unwrap();
    }
    let mut times = vec![]; let (mut it, mut nw, mut fc) = (0,0,0);
    for i in 0..n { let t = std::time::Instant::now(); d.step(&mut physics); let ms = t.elapsed().as_secs_f64()*1e3; times.push(ms); let c = d.counters(); it += c.iterations; nw += c.newton_steps; fc += c.contact_factorizations;
      if i < 3 || i == n-1 { println!("{i}: {ms:.2} ms: detect {:?} factor {:?} solve {:?} adv {:?} it {} newton {} fac {} col {} contacts {}", c.detection_time, c.factor_time, c.solve_time, c.advance_time, c.iterations, c.newton_steps, c.contact_factorizations, c.columns, c.contacts); } }
    times.sort_by(f64::total_cmp);
    println!("median {:.3} it/step {:.2} newton {:.2} facs {:.2} factor MB {:.1} cols MB {:.1}", times[n/2], it as f64/n as f64, nw as f64/n as f64, fc as f64/n as f64, d.counters().factor_bytes as f64/1e6, d.counters().column_bytes as f64/1e6);
}
