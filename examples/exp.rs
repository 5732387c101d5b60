use foible3d::prelude::*;
use rapier3d::prelude::*;
fn rest(e: f64, nu: f64, it: usize, h: f32, secs: f32, beta: f64) {
    let mut physics = PhysicsWorld::new();
    physics.integration_parameters.dt = h;
    let (_, floor) = physics.insert(RigidBodyBuilder::fixed().translation(Vector::Y * -0.1), ColliderBuilder::cuboid(2.0, 0.1, 2.0).friction(0.5));
    let mut d = DeformableWorld::new();
    let c = d.insert(DeformableBodyBuilder::cuboid(Vector::splat(0.2), [6, 6, 6]).translation(Vector::Y * 0.21)
        .material(DeformableMaterial::new(e, nu).stiffness_damping(beta)).settings(SolverSettings::iterations(it))).unwrap();
    let t = std::time::Instant::now();
    let n = (secs / h) as usize;
    let mut newton = 0; let mut fails = 0; let mut facs=0; let mut retries=0;
    for _ in 0..n { d.step(&mut physics); newton += d.counters().newton_steps; fails += d.counters().contact_failures; facs += d.counters().contact_factorizations; retries+=d.counters().guard_retries; }
    let ms = t.elapsed().as_secs_f64() * 1e3 / n as f64;
    let f = d.contact_force(c, floor);
    let pen = d.contacts().iter().map(|c| -c.gap).fold(0.0, f64::max);
    let w = d.bodies[c].mass() * 9.81f32 as f64;
    println!("rest E={e:.0e} nu={nu} it={it} h={h:.4}: v={:.2e} f/w-1={:.1e} pen={:.1e} ms={ms:.3} newton/it={:.2} facs/step={:.2} fails={fails} retries={retries} last newton {}", d.bodies[c].max_speed(), f.y as f64 / w - 1.0, pen, newton as f64 / (n*it) as f64, facs as f64 / n as f64, d.counters().newton_steps);
}
fn stack(ratio: f64, nu: f64, it: usize) {
    let mut physics = PhysicsWorld::new();
    let (_, floor) = physics.insert(RigidBodyBuilder::fixed().translation(Vector::Y * -0.1), ColliderBuilder::cuboid(2.0, 0.1, 2.0).friction(0.5));
    let mut d = DeformableWorld::new();
    let m = 64.0; let mb = m * ratio;
    let e = (mb + m / 2.0) * 9.81 / (0.05 * 0.16);
    let c = d.insert(DeformableBodyBuilder::cuboid(Vector::splat(0.2), [6, 6, 6]).translation(Vector::Y * 0.201)
        .material(DeformableMaterial::new(e, nu)).settings(SolverSettings::iterations(it))).unwrap();
    let (b, bc) = physics.insert(RigidBodyBuilder::dynamic().translation(Vector::Y * 0.605).can_sleep(false), ColliderBuilder::cuboid(0.2, 0.2, 0.2).density((mb / 0.064) as f32).friction(0.5));
    let t = std::time::Instant::now();
    let (mut newton, mut fails, mut maxn, mut retries) = (0, 0, 0, 0);
    let n = 300;
    for _ in 0..n { d.step(&mut physics); let k=d.counters(); newton += k.newton_steps; maxn = maxn.max(k.newton_steps); fails += k.contact_failures; retries+=k.guard_retries; }
    let ms = t.elapsed().as_secs_f64() * 1e3 / n as f64;
    let f = d.contact_force(c, floor).y as f64;
    let pen = d.contacts().iter().map(|c| -c.gap).fold(0.0, f64::max);
    let w = (m + mb) * 9.81f32 as f64;
    let rb = &physics.bodies[b];
    println!("stack ratio={ratio} nu={nu} it={it} E={e:.1e}: box v={:.1e} w={:.1e} y={:.5} tilt={:.1e} f/w-1={:.1e} boxf {:.1e} pen={pen:.1e} vsoft={:.1e} ms={ms:.2} newton {:.1} max {maxn} fails {fails} retries {retries}", rb.linvel().length(), rb.angvel().length(), rb.translation().y, (rb.rotation()*Vector::Y).x.hypot((rb.rotation()*Vector::Y).z), f / w - 1.0, d.contact_force(c, bc).y as f64 / (mb*9.81) +1.0, d.bodies[c].max_speed(), newton as f64 / n as f64);
}
fn main() {
    let which = std::env::args().nth(1).unwrap_or_default();
    if which.contains("rest") {
    for e in [1e5, 1e6, 1e7, 1e9] { for nu in [0.3, 0.45] { for it in [1, 3] { rest(e, nu, it, 1.0/60.0, 5.0, 0.0); } } }
    rest(1e4, 0.3, 3, 1.0/60.0, 10.0, 0.01);
    rest(1e6, 0.3, 3, 0.1, 5.0, 0.0);
    rest(1e6, 0.3, 3, 1.0/240.0, 5.0, 0.001);
    rest(1e6, 0.3, 3, 1.0/1000.0, 5.0, 0.001);
    }
    if which.contains("stack") {
    for ratio in [0.01, 1.0, 10.0, 100.0, 1000.0] { for nu in [0.3, 0.45] { for it in [1, 3] { stack(ratio, nu, it); } } }
    }
}
