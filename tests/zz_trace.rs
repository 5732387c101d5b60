mod common;
use common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;
#[test]
fn trace() {
    let v = |k: &str, d: f64| std::env::var(k).ok().and_then(|s| s.parse().ok()).unwrap_or(d);
    let (e, nu, dt, ratio, it, speed) = (
        v("E", 1e3),
        v("NU", 0.0),
        v("H", 1.0 / 60.0) as f32,
        v("R", 1e3),
        v("IT", 10.0) as usize,
        v("V", 0.0) as f32,
    );
    let soft_too = v("SOFT", 1.0) > 0.0;
    let (mut physics, floor) = world_with_floor(dt);
    let mut world = DeformableWorld::new();
    let half = 0.025f32;
    let soft = DeformableBodyBuilder::cuboid(Vector::splat(half), [3; 3])
        .can_sleep(false)
        .translation(Vector::Y * (half + 0.01))
        .linvel(Vector::Y * -speed)
        .material(DeformableMaterial::new(e, nu).friction(MU))
        .settings(SolverSettings::iterations(it));
    let soft = world.insert(soft).unwrap();
    let mass = ratio * world.bodies[soft].mass();
    if !soft_too {
        world.bodies[soft].set_enabled(false);
    }
    let shape = ColliderBuilder::cuboid(half, half, half).mass(mass as f32).friction(MU as f32);
    let body = RigidBodyBuilder::dynamic()
        .translation(Vector::Y * (3.0 * half + 0.011))
        .can_sleep(false)
        .ccd_enabled(true);
    let (load, col) = physics.insert(body.linvel(Vector::Y * -speed), shape);
    let rigid = |physics: &PhysicsWorld| {
        let b = &physics.bodies[load];
        let inertia = b.mass_properties().local_mprops.principal_inertia();
        let spin = b.rotation().inverse() * b.angvel();
        let kinetic = 0.5 * (b.mass() * b.linvel().length_squared() + inertia.dot(spin * spin));
        (f64::from(kinetic), f64::from(b.mass()) * G * f64::from(b.translation().y))
    };
    let moving = world.bodies[soft].mass() + mass;
    let impact = moving * (0.5 * f64::from(speed * speed) + G * 0.05);
    let mut before = f64::INFINITY;
    for step in 0..v("N", 30.0) as usize {
        let v0 = physics.bodies[load].linvel().y;
        world.pipeline.before_step(
            &world.parameters,
            &mut world.bodies,
            &mut PhysicsParts::from(&mut physics),
        );
        let (v1, w1) = (physics.bodies[load].linvel().y, physics.bodies[load].angvel().length());
        physics.step();
        world.pipeline.after_step(&mut PhysicsParts::from(&mut physics));
        let (k, p) = rigid(&physics);
        let s = if soft_too { total_energy(&world.bodies[soft]) } else { 0.0 };
        let b = &physics.bodies[load];
        let total = k + p + s;
        let ys: Vec<f64> = world.bodies[soft].positions().map(|x| f64::from(x.y)).collect();
        let low = ys.iter().cloned().fold(f64::INFINITY, f64::min);
        let high = ys.iter().cloned().fold(-f64::INFINITY, f64::max);
        let c = world.counters();
        println!(
            "{step:2} grow {:9.2e} dK {:8.1e} dP.. K {:8.2e} P {:8.2e} S {:8.2e}(el {:8.2e}) | y {:.5} vy {:.4} ->solve {:.4} ->rapier {:.4} w {:.3}->{:.3} | soft com {:.5} {:.5}..{:.5} | boxF {:.2e} floorF {:.2e} rigid {:.2e} it {} conv {} gave {}",
            (total - before) / impact,
            0.0,
            k,
            p,
            s,
            world.bodies[soft].elastic_energy(),
            b.translation().y,
            v0,
            v1,
            b.linvel().y,
            w1,
            b.angvel().length(),
            world.bodies[soft].center_of_mass()[1],
            low,
            high,
            world.contact_force(soft, col).y,
            world.contact_force(soft, floor).y,
            world.rigid_contacts().iter().map(|c| c.force.y).sum::<f32>(),
            c.iterations,
            c.not_converged,
            world.bodies[soft].last_gave_up()
        );
        before = total;
    }
}
