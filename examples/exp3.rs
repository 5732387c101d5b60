use foible3d::prelude::*;
use rapier3d::prelude::*;
fn tip(b: &DeformableBody, l: f32) -> f64 { // mean y of end face
    let vs: Vec<usize> = (0..b.vertex_count()).filter(|&v| b.model().rest_position(v)[0] > l as f64 / 2.0 - 1e-6).collect();
    vs.iter().map(|&v| b.position(v).unwrap()[1]).sum::<f64>() / vs.len() as f64
}
fn cantilever(e: f64, cells: [usize; 3], h: f32, s: SolverSettings) {
    let mut p = PhysicsWorld::new(); p.integration_parameters.dt = h;
    let mut d = DeformableWorld::new();
    let c = d.insert(DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.1), cells).material(DeformableMaterial::new(e, 0.3).mass_damping(5.0)).settings(s).pinned(|x| x.x < -0.4999)).unwrap();
    let t = std::time::Instant::now(); let n = (6.0 / h) as usize; let mut its = 0; let mut re = 0;
    for _ in 0..n { d.step(&mut p); its += d.counters().iterations; re += d.counters().guard_retries; }
    println!("static E={e:.0e} {cells:?} h={h:.4} tip {:.5} ms {:.3} it/step {:.2} retries {re} resid {:.1e}", -tip(&d.bodies[c], 1.0), t.elapsed().as_secs_f64()*1e3/n as f64, its as f64/n as f64, d.bodies[c].last_residual());
}
fn slender(e: f64, nu: f64, s: SolverSettings, t_end: f32) -> (Vec<f64>, f64, f64, usize) {
    let mut p = PhysicsWorld::new();
    let mut d = DeformableWorld::new();
    let c = d.insert(DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.05, 0.05), [20,2,2]).material(DeformableMaterial::new(e, nu)).settings(s).pinned(|x| x.x < -0.4999)).unwrap();
    let t = std::time::Instant::now(); let n = (t_end * 60.0) as usize; let mut its = 0; let mut re = 0;
    let mut out = vec![];
    for _ in 0..n { d.step(&mut p); its += d.counters().iterations; re += d.counters().guard_retries; out.push(tip(&d.bodies[c], 1.0)); }
    (out, t.elapsed().as_secs_f64()*1e3/n as f64, its as f64/n as f64, re)
}
fn hinge(e: f64, nu: f64, s: SolverSettings) -> (f64, f64, f64) {
    let mut p = PhysicsWorld::new();
    let mut d = DeformableWorld::new();
    let c = d.insert(DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.1), [20,4,4]).material(DeformableMaterial::new(e, nu)).settings(s).pinned(|x| x.x < -0.4999 && x.y < -0.0999)).unwrap();
    let ang = |b: &DeformableBody| { let q = b.center_of_mass(); let r0 = (0.1f64).atan2(0.5); let a = (q[1]+0.1).atan2(q[0]+0.5); let mut x = r0 - a; if x < -0.1 { x += std::f64::consts::TAU; } x };
    let mut a = 0.0; let mut its = 0;
    for i in 1..=40 { d.step(&mut p); its += d.counters().iterations; if i == 12 { a = ang(&d.bodies[c]); } }
    (a, ang(&d.bodies[c]), its as f64 / 40.0)
}
fn main() {
    let w = std::env::args().nth(1).unwrap_or_default();
    let def = SolverSettings::default();
    if w.contains("static") {
        println!("refs: 1e7: 495 .02814 4000 .03527 19845 .03669; 1e6: .26736 .32611 .33733");
        for e in [1e6, 1e7, 1e8] { for h in [1.0/30.0, 1.0/60.0, 1.0/240.0] { cantilever(e, [11,3,3], h, def); } }
        cantilever(1e6, [32,5,5], 1.0/60.0, def); cantilever(1e7, [32,5,5], 1.0/60.0, def);
    }
    if w.contains("slender") {
        for (e, nu) in [(3e5,0.3),(1e6,0.3),(1e6,0.45),(3e6,0.3),(1e8,0.3)] {
            let reference = slender(e, nu, SolverSettings { max_iterations: 300, tolerance: 1e-9, frames: Frames::PerNode, ..def }, 1.5);
            print!("E={e:.0e} nu={nu} droop {:.2} refit {:.0} re {}: ", -reference.0.iter().cloned().fold(0.0,f64::min), reference.2, reference.3);
            let run = |name: &str, s: SolverSettings| { let r = slender(e, nu, s, 1.5); let err = r.0.iter().zip(&reference.0).map(|(a,b)|(a-b).abs()).fold(0.0,f64::max); print!("{name} {err:.4} ({:.2}ms {:.1}it re{}) | ", r.1, r.2, r.3); };
            for k in [2,3] { run(&format!("L{k}"), SolverSettings{acceleration: Acceleration::Lbfgs{window:8}, ..SolverSettings::iterations(k)}); }
            for (m,tol) in [(8,1e-1), (8,3e-2), (8,1e-2), (8,3e-3), (12,3e-3),(8,1e-3)] { run(&format!("{m} tol{tol:.0e}"), SolverSettings{tolerance: tol, max_iterations: m, acceleration: Acceleration::Lbfgs{window:8}, ..def}); }
            println!();
        }
    }
    if w.contains("hinge") {
        for (e, nu) in [(1e6,0.3),(1e7,0.45),(1e8,0.3),(1e9,0.45)] {
            let l=Acceleration::Lbfgs{window:8};
            println!("hinge E={e:.0e} nu={nu}: ref {:?} L2 {:?} L3 {:?} Ltol1e-2 {:?} Ltol3e-3 {:?}", hinge(e,nu,SolverSettings{max_iterations:300,tolerance:1e-9,acceleration:l,..def}), hinge(e,nu,SolverSettings{acceleration:l,..SolverSettings::iterations(2)}), hinge(e,nu,SolverSettings{acceleration:l,..SolverSettings::iterations(3)}), hinge(e,nu,SolverSettings{acceleration:l,tolerance:1e-2,..def}), hinge(e,nu,SolverSettings{acceleration:l,tolerance:3e-3,..def}));
        }
    }
}
