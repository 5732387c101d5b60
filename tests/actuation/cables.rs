//! Cables routed through bodies, over rigid ones and the world.

use crate::common::cables::{finger, steps, world};
use crate::common::{G, at_rest_where, mean_position, world_with_floor};
use foible3d::BodyError;
use foible3d::prelude::*;
use rapier3d::prelude::*;

const H: f32 = 1.0 / 60.0;

/// A cube of 10 cm and 1 kg whose centre is at a place.
fn weight(at: Vector) -> DeformableBodyBuilder {
    DeformableBodyBuilder::cuboid(Vector::splat(0.05), [2, 2, 2])
        .translation(at)
        .material(DeformableMaterial::new(1.0e6, 0.3).mass_damping(5.0))
        .can_sleep(false)
}

/// The vertex in the middle of its upper face.
fn top(body: &DeformableBody) -> usize {
    let at = |v: &usize| body.position(*v).unwrap();
    let centre = body.center_of_mass();
    (0..body.vertex_count())
        .min_by(|a, b| {
            let off = |v: &usize| {
                let p = at(v);
                (p[0] - centre[0]).abs() + (p[2] - centre[2]).abs() - p[1]
            };
            off(a).total_cmp(&off(b))
        })
        .unwrap()
}

/// A weight that hangs on a cable over a guide 3 m above it, and further ones.
struct Hoist {
    physics: PhysicsWorld,
    deformables: DeformableWorld,
    weight: DeformableBodyHandle,
    cable: DeformableCableHandle,
    /// \[N\].
    load: f64,
}

impl Hoist {
    fn new(
        further: &[Vector],
        cable: impl FnOnce(DeformableCableBuilder, f64) -> DeformableCableBuilder,
    ) -> Self {
        let (physics, mut deformables) = world(Vector::Y * -9.81);
        let weight = deformables.insert(weight(Vector::ZERO)).unwrap();
        let body = &deformables.bodies[weight];
        let (tied, load) = (top(body), body.mass() * G);
        let guides = [Vector::Y * 3.0].into_iter().chain(further.iter().copied()).map(CablePoint::World);
        let points = [CablePoint::Vertex(weight, tied)].into_iter().chain(guides);
        let cable =
            deformables.bodies.insert_cable(cable(DeformableCableBuilder::new(points), load)).unwrap();
        Self { physics, deformables, weight, cable, load }
    }

    fn step(&mut self, count: usize) {
        steps(&mut self.physics, &mut self.deformables, count);
    }

    fn cable(&mut self) -> &mut DeformableCable {
        self.deformables.bodies.cable_mut(self.cable).unwrap()
    }

    fn height(&self) -> f64 {
        self.deformables.bodies[self.weight].center_of_mass()[1]
    }

    fn speed(&self) -> f64 {
        let body = &self.deformables.bodies[self.weight];
        body.linear_momentum()[1] / body.mass()
    }
}

#[test]
fn without_friction_there_is_one_tension_through_bodies_links_and_the_world() {
    // A movable pulley: the rigid block hangs in two parts of the cable, the soft weight on a third.
    let (mut physics, mut deformables) = world(Vector::Y * -9.81);
    let soft = deformables.insert(weight(Vector::new(-1.0, 0.0, 0.0))).unwrap();
    let tied = top(&deformables.bodies[soft]);
    let mass = deformables.bodies[soft].mass();
    let rigid = RigidBodyBuilder::dynamic().translation(Vector::X).linear_damping(2.0).angular_damping(5.0);
    let (pulley, _) = physics.insert(rigid, ColliderBuilder::cuboid(0.1, 0.1, 0.1).mass(2.0 * mass as f32));
    let points = [
        CablePoint::Vertex(soft, tied),
        CablePoint::World(Vector::new(-1.0, 2.0, 0.0)),
        CablePoint::World(Vector::new(0.9, 2.0, 0.0)),
        CablePoint::RigidBody(pulley, Vector::new(0.0, 0.1, 0.0)),
        CablePoint::World(Vector::new(1.1, 2.0, 0.0)),
    ];
    let cable = deformables.bodies.insert_cable(DeformableCableBuilder::new(points)).unwrap();
    steps(&mut physics, &mut deformables, 600);
    let tensions = deformables.bodies.cable(cable).unwrap().tensions().to_vec();
    let weight = mass * G;
    println!("tensions {tensions:?}, weight {weight}");
    for tension in &tensions {
        assert!((tension - tensions[0]).abs() < 1e-9 * weight);
        // Two parts, of which each leans by 1 in 19, carry twice the weight.
        assert!((tension - weight).abs() < 5e-3 * weight);
    }
    let length = deformables.bodies.cable_length(cable, &physics.bodies);
    let free = deformables.bodies.cable(cable).unwrap().free_length().unwrap();
    assert!((length - free).abs() < 1e-5, "{length} {free}");
}

#[test]
fn friction_at_guides_is_eulers() {
    // Over two guides, by 90 degrees each; the winch takes in, then lets out.
    for mu in [0.1, 0.5, 1.0] {
        let over = [Vector::new(1.0, 3.0, 0.0), Vector::new(1.0, 0.0, 0.0)];
        let mut hoist = Hoist::new(&over, |cable, _| cable.friction(mu).speed(0.05));
        hoist.step(60);
        let load = hoist.load;
        let grows = (mu * std::f64::consts::FRAC_PI_2).exp();
        for (sign, by) in [(-1.0, grows), (1.0, 1.0 / grows)] {
            let free = hoist.cable().free_length().unwrap();
            hoist.cable().set_length(free + sign * 0.5).unwrap();
            hoist.step(300);
            let tensions = hoist.cable().tensions();
            println!("mu {mu}, {sign}: {:?}", tensions.iter().map(|t| t / load).collect::<Vec<_>>());
            // At 0.05 m/s the damping of 5/s bears a part.
            assert!((tensions[0] / load - 1.0 + sign * 5.0 * 0.05 / G).abs() < 1e-5);
            assert!((tensions[1] / tensions[0] - by).abs() < 1e-6 * by);
            assert!((tensions[2] / tensions[1] - by).abs() < 1e-6 * by);
        }
    }
}

#[test]
fn what_is_held_by_friction_stays() {
    // The winch draws with less than the weight, by less than friction bears: nothing passes the guide.
    let mut hoist =
        Hoist::new(&[Vector::new(1.0, 3.0, 0.0)], |cable, load| cable.friction(0.5).tension(load));
    hoist.step(60);
    let load = hoist.load;
    hoist.cable().set_tension(0.6 * load).unwrap();
    hoist.step(60);
    let before = hoist.height();
    hoist.step(300);
    let fallen = before - hoist.height();
    let tensions = hoist.cable().tensions();
    println!("fell {fallen:e} m in 5 s, {tensions:?} of {load}");
    assert!(fallen.abs() < 1e-4);
    assert!((tensions[0] - load).abs() < 1e-3 * load);
}

#[test]
fn a_tendon_bends_a_finger_as_its_moment_does() {
    // Euler and Bernoulli: curvature T e / (E I), all along; a circle.
    let (young, length, half, offset) = (1.0e6, 0.12, 0.01, 0.006);
    let inertia = (2.0 * half as f64).powi(4) / 12.0;
    let tension = 1.5;
    for (cells, within) in [([24, 4, 4], 0.03), ([48, 4, 4], 0.01)] {
        let (mut physics, mut deformables) = world(Vector::ZERO);
        let (finger, cable) =
            finger(&mut deformables, young, [length, half, offset], cells, |c| c.tension(tension));
        steps(&mut physics, &mut deformables, 240);
        let body = &deformables.bodies[finger];
        let tip = mean_position(body, &at_rest_where(body, |x| x[0] > 0.5 * f64::from(length) - 1e-6));
        let strain = tension / (young * (2.0 * half as f64).powi(2));
        let angle = tension * f64::from(offset) / (young * inertia) * f64::from(length);
        let shortened = f64::from(length) * (1.0 - strain);
        let expected = shortened * (1.0 - angle.cos()) / angle;
        println!("{cells:?}: tip {:.6} m, beam {expected:.6} m, turn {angle:.3}", -tip[1]);
        assert!((-tip[1] / expected - 1.0).abs() < within);
        let tensions = deformables.bodies.cable(cable).unwrap().tensions();
        assert!(tensions.iter().all(|t| (t - tension).abs() < 1e-9));
    }
}

#[test]
fn a_finger_holds_a_ball_with_the_force_of_statics() {
    // A cantilever that a moment T e bends all along, pressed by a tendon to (1 − ε) of its length, against a ball and a wall:
    // (1 − ε) T e l²/(2 E I) − F ((1 − ε)² l² (3 s − l)/(6 E I) + shear, 6/5 l/(G A)) is how far its place at l has gone under
    // a force F at s: where it is touched, which its turn moves a little.
    let (young, half, offset, tension, l) = (1.0e6f64, 0.01f32, 0.006f32, 3.0, 0.1f64);
    let (area, inertia) = ((2.0 * half as f64).powi(2), (2.0 * half as f64).powi(4) / 12.0);
    let pressed = 1.0 - tension / (young * area);
    let (mut physics, mut deformables) = world(Vector::ZERO);
    let (finger, _) =
        finger(&mut deformables, young, [0.12, half, offset], [48, 4, 4], |c| c.tension(tension));
    let (radius, at) = (0.01, (l * pressed) as f32);
    let wall = ColliderBuilder::cuboid(0.05, 0.01, 0.05).friction(0.5);
    physics.insert_collider(wall.translation(Vector::new(at, -half - 2.0 * radius - 0.012, 0.0)), None);
    let ball = RigidBodyBuilder::dynamic().translation(Vector::new(at, -half - radius - 0.001, 0.0));
    let (ball, ball_collider) = physics.insert(ball, ColliderBuilder::ball(radius).friction(0.5).mass(0.01));
    steps(&mut physics, &mut deformables, 400);
    let body = &deformables.bodies[finger];
    let (mut held, mut moment) = (0.0, 0.0);
    for contact in deformables.contacts().iter().filter(|c| c.collider == ball_collider) {
        let force = f64::from(contact.force.y);
        let rest = contact.vertices.iter().zip(contact.weights);
        let place: f64 = rest.map(|(v, w)| w * (body.model().rest_position(*v)[0] + 0.06)).sum();
        (held, moment) = (held + force, moment + force * place);
    }
    let s = moment / held;
    let under = at_rest_where(body, |x| (x[0] + 0.06 - l).abs() < 1e-6 && x[1].abs() < 1e-6);
    let gone = -mean_position(body, &under)[1];
    let free = pressed * tension * f64::from(offset) * l * l / (2.0 * young * inertia);
    let gives_way =
        (pressed * l).powi(2) * (3.0 * s - l) / (6.0 * young * inertia) + 1.2 * l / (0.5 * young * area);
    let expected = (free - gone) / gives_way;
    println!("held with {held:.4} N, statics {expected:.4} N, gone {gone:.5} m of {free:.5} m, at {s:.5} m");
    assert!((held / expected - 1.0).abs() < 0.02);
    assert!(physics.bodies[ball].linvel().length() < 1e-3);
}

#[test]
fn a_winch_keeps_to_its_speed_and_its_strength() {
    let mut hoist = Hoist::new(&[], |cable, load| cable.speed(0.2).max_tension(4.0 * load));
    hoist.step(30);
    let (start, load) = (hoist.height(), hoist.load);
    let free = hoist.cable().free_length().unwrap();
    hoist.cable().set_length(free - 1.0).unwrap();
    hoist.step(120);
    let risen = hoist.height() - start;
    println!("risen {risen} m in 2 s at 0.2 m/s");
    assert!((risen - 0.4).abs() < 1e-3);
    // Too weak: it runs off. The weight is damped by 5/s, so it sinks at g/2 · 1/5.
    hoist.cable().set_max_tension(0.5 * load).unwrap();
    hoist.step(60);
    let tension = hoist.cable().tension();
    println!("sinks at {} m/s under {tension} N of {load}", hoist.speed());
    assert!((tension - 0.5 * load).abs() < 1e-9 * load);
    assert!((hoist.speed() + 0.5 * G / 5.0).abs() < 0.01);
    // And takes up from where it is when it is strong again.
    hoist.cable().set_max_tension(100.0 * load).unwrap();
    hoist.step(30);
    assert!((hoist.speed() - 0.2).abs() < 0.01, "{}", hoist.speed());
}

#[test]
fn slack_cables_do_nothing_and_catch() {
    let (mut physics, mut deformables) = world(Vector::Y * -9.81);
    let soft = deformables.insert(weight(Vector::ZERO)).unwrap();
    let tied = top(&deformables.bodies[soft]);
    let points = [CablePoint::Vertex(soft, tied), CablePoint::World(Vector::new(0.0, 1.05, 0.0))];
    let cable = deformables.bodies.insert_cable(DeformableCableBuilder::new(points).length(2.0)).unwrap();
    assert_eq!(DeformableCableHandle::from_raw_parts(cable.into_raw_parts()), cable);
    steps(&mut physics, &mut deformables, 10);
    assert_eq!(deformables.bodies.cable(cable).unwrap().tension(), 0.0);
    steps(&mut physics, &mut deformables, 300);
    let length = deformables.bodies.cable_length(cable, &physics.bodies);
    assert!((length - 2.0).abs() < 1e-5, "{length}");
}

#[test]
fn what_no_cable_has_is_refused() {
    let (_, mut deformables) = world(Vector::ZERO);
    let soft = deformables.insert(weight(Vector::ZERO)).unwrap();
    let good = [CablePoint::Vertex(soft, 0), CablePoint::World(Vector::Y)];
    let mut refuse = |cable: DeformableCableBuilder, what: &str| {
        let error = deformables.bodies.insert_cable(cable).unwrap_err().to_string();
        assert!(error.contains(what), "{error}");
    };
    let new = |points: &[CablePoint]| DeformableCableBuilder::new(points.iter().copied());
    refuse(new(&[good[0]]), "two points");
    refuse(new(&[CablePoint::World(Vector::X), CablePoint::World(Vector::Y)]), "none of its points");
    refuse(new(&[CablePoint::Vertex(soft, 999), good[1]]), "vertex 999");
    refuse(new(&[CablePoint::Inside(soft, Vector::splat(9.0)), good[1]]), "is not inside");
    refuse(new(&[CablePoint::World(Vector::splat(f32::NAN)), good[0]]), "point of a cable");
    refuse(new(&good).friction(-1.0), "friction");
    refuse(new(&good).tension(f64::INFINITY), "tension");
    refuse(new(&good).length(f64::NAN), "length");
    refuse(new(&good).compliance(-1.0), "compliance");
    refuse(new(&good).speed(f64::NAN), "speed");
    let cable = deformables.bodies.insert_cable(new(&good)).unwrap();
    let cable_mut = deformables.bodies.cable_mut(cable).unwrap();
    assert!(matches!(cable_mut.set_tension(-1.0), Err(BodyError::BadCable { .. })));
    deformables.bodies.remove(soft).unwrap();
    assert!(deformables.bodies.cable(cable).is_none());
}

#[test]
fn what_hangs_on_a_cable_sleeps_and_wakes() {
    let (mut physics, _) = world_with_floor(H);
    let mut deformables = DeformableWorld::new();
    let soft = deformables.insert(weight(Vector::Y * 2.0).can_sleep(true)).unwrap();
    let tied = top(&deformables.bodies[soft]);
    let hook = physics.insert_body(RigidBodyBuilder::kinematic_position_based().translation(Vector::Y * 3.0));
    let points = [CablePoint::Vertex(soft, tied), CablePoint::RigidBody(hook, Vector::ZERO)];
    let cable = deformables.bodies.insert_cable(DeformableCableBuilder::new(points)).unwrap();
    steps(&mut physics, &mut deformables, 600);
    assert!(deformables.bodies[soft].is_sleeping());
    let carried = deformables.bodies.cable(cable).unwrap().tension();
    assert!((carried / (deformables.bodies[soft].mass() * G) - 1.0).abs() < 1e-4);
    physics.bodies[hook].set_next_kinematic_translation(Vector::Y * 3.01);
    steps(&mut physics, &mut deformables, 2);
    assert!(!deformables.bodies[soft].is_sleeping());
    steps(&mut physics, &mut deformables, 600);
    assert!(deformables.bodies[soft].is_sleeping());
    deformables.bodies.remove_cable(cable).unwrap();
    steps(&mut physics, &mut deformables, 200);
    assert!(deformables.bodies[soft].center_of_mass()[1] < 0.1);
}
