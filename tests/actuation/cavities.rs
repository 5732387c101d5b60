//! Closed rooms of bodies with pressure, gas or liquid in them.

use crate::common::cavities::{hollow_cube, steps, weightless};
use crate::common::games::H;
use crate::common::world_with_floor;
use foible3d::prelude::*;
use foible3d::{BodyError, CavityFilling};
use rapier3d::prelude::*;

/// A sphere of triangles around the origin: an icosahedron whose edges were halved so often.
fn sphere(radius: f64, halvings: usize) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let g = 0.5 * (1.0 + 5f64.sqrt());
    let mut points: Vec<[f64; 3]> = Vec::new();
    for k in 0..3 {
        for (one, other) in [(-1.0, -g), (1.0, -g), (-1.0, g), (1.0, g)] {
            let mut p = [0.0; 3];
            (p[(k + 1) % 3], p[(k + 2) % 3]) = (one, other);
            points.push(p);
        }
    }
    let apart = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    let near = |a: usize, b: usize| (apart(points[a], points[b]) - 2.0).abs() < 1e-9;
    let mut faces = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(a, c) {
                    let [p, q, r] = [a, b, c].map(|i| nalgebra::Vector3::from(points[i]));
                    let outward = p.dot(&q.cross(&r)) > 0.0;
                    faces.push(if outward { [a, b, c] } else { [a, c, b] }.map(|i| i as u32));
                }
            }
        }
    }
    for _ in 0..halvings {
        let mut middles = std::collections::BTreeMap::new();
        let mut halved = Vec::new();
        for [a, b, c] in faces {
            let mut middle = |i: u32, j: u32| {
                *middles.entry([i.min(j), i.max(j)]).or_insert_with(|| {
                    points.push([0, 1, 2].map(|k| 0.5 * (points[i as usize][k] + points[j as usize][k])));
                    points.len() as u32 - 1
                })
            };
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            halved.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        faces = halved;
    }
    let onto = |p: [f64; 3]| {
        let size = p.iter().map(|c| c * c).sum::<f64>().sqrt();
        p.map(|c| c * radius / size)
    };
    (points.into_iter().map(onto).collect(), faces)
}

/// A thick spherical shell: prisms over the triangles, three tetrahedra each, cut along the diagonals from lower numbers.
fn shell(inner: f64, outer: f64, halvings: usize, layers: usize) -> TetMesh {
    let (unit, faces) = sphere(1.0, halvings);
    let n = unit.len() as u32;
    let mut vertices = Vec::new();
    for layer in 0..=layers {
        let r = inner + (outer - inner) * layer as f64 / layers as f64;
        vertices.extend(unit.iter().map(|p| p.map(|c| c * r)));
    }
    let mut tetrahedra = Vec::new();
    for layer in 0..layers as u32 {
        for face in &faces {
            let mut order = *face;
            order.sort_unstable();
            let [low, high] = [layer * n, (layer + 1) * n];
            let [a, b, c] = order;
            for tet in [
                [a + low, b + low, c + low, c + high],
                [a + low, b + low, b + high, c + high],
                [a + low, a + high, b + high, c + high],
            ] {
                let [p, q, r, s] = tet.map(|v| nalgebra::Vector3::from(vertices[v as usize]));
                let volume = (q - p).dot(&(r - p).cross(&(s - p)));
                tetrahedra.push(if volume > 0.0 { tet } else { [tet[0], tet[2], tet[1], tet[3]] });
            }
        }
    }
    TetMesh::new(vertices, tetrahedra).unwrap()
}

fn balloon(radius: f64, thickness: f64, halvings: usize) -> DeformableBodyBuilder {
    let (vertices, faces) = sphere(radius, halvings);
    DeformableBodyBuilder::structure(&Structure::sheet(vertices, &faces, thickness).unwrap())
}

fn mean_radius(body: &DeformableBody, vertices: std::ops::Range<usize>) -> f64 {
    let count = vertices.len() as f64;
    let of = |v: usize| body.position(v).unwrap().iter().map(|c| c * c).sum::<f64>().sqrt();
    vertices.map(of).sum::<f64>() / count
}

#[test]
fn a_thin_sphere_grows_as_the_closed_form_says() {
    // Δr = p r² (1 − ν)/(2 E t), a thousandth of r.
    let (radius, thickness, e, nu) = (0.1, 5e-4, 1.0e6, 0.3);
    let pressure = 2.0 * e * thickness * 1e-3 / (radius * (1.0 - nu));
    for halvings in [2, 3] {
        let material = DeformableMaterial::new(e, nu).density(1000.0).mass_damping(20.0);
        let (mut physics, mut world) = (weightless(), DeformableWorld::new());
        let body = balloon(radius, thickness, halvings).material(material);
        let body = body.fill_cavity(0, CavityFilling::Pressure { gauge: pressure });
        let body = world.insert(body).unwrap();
        steps(&mut physics, &mut world, 200);
        let body = &world.bodies[body];
        let grown = mean_radius(body, 0..body.vertex_count()) / radius - 1.0;
        println!("{} vertices: Δr/r {grown:.6}, 0.001 wanted", body.vertex_count());
        assert!(body.max_speed() < 1e-6, "{}", body.max_speed());
        if halvings == 3 {
            assert!((grown / 1e-3 - 1.0).abs() < 0.01, "{grown}");
        }
    }
}

#[test]
fn a_thick_sphere_grows_as_the_closed_form_says() {
    // Lamé: u(a) = p a³/(E (b³ − a³))·((1 − 2ν) a + (1 + ν) b³/(2 a²)).
    let (a, b, e, nu, pressure) = (0.05f64, 0.1f64, 1.0e6, 0.3, 1.0e3);
    let wanted = pressure * a.powi(3) / (e * (b.powi(3) - a.powi(3)))
        * ((1.0 - 2.0 * nu) * a + (1.0 + nu) * b.powi(3) / (2.0 * a * a));
    let off: Vec<f64> = [(2, 4), (3, 8)]
        .into_iter()
        .map(|(halvings, layers)| {
            let material = DeformableMaterial::new(e, nu).mass_damping(50.0);
            let (mut physics, mut world) = (weightless(), DeformableWorld::new());
            let body = DeformableBodyBuilder::mesh(&shell(a, b, halvings, layers)).material(material);
            let body = body.fill_cavity(0, CavityFilling::Pressure { gauge: pressure });
            let body = world.insert(body).unwrap();
            steps(&mut physics, &mut world, 60);
            let body = &world.bodies[body];
            let inside = body.vertex_count() / (layers + 1);
            let grown = mean_radius(body, 0..inside) - a;
            println!(
                "{} tetrahedra: {:.3} of the closed form",
                body.model().tetrahedron_count(),
                grown / wanted
            );
            grown / wanted - 1.0
        })
        .collect();
    // Second order: a third of the difference beyond the finer one.
    let extrapolated = off[1] + (off[1] - off[0]) / 3.0;
    assert!(extrapolated.abs() < 0.01 && off[1].abs() < 0.03, "{off:?} {extrapolated}");
}

#[test]
fn a_pressure_pushes_nothing_away_and_does_not_turn_it() {
    let (mut physics, mut world) = (weightless(), DeformableWorld::new());
    let body = hollow_cube().material(DeformableMaterial::new(1.0e5, 0.3));
    let body =
        body.fill_cavity(0, CavityFilling::Pressure { gauge: 2.0e4 }).translation(Vector::new(3.0, 2.0, 1.0));
    let body = world.insert(body).unwrap();
    let before = world.bodies[body].center_of_mass();
    for _ in 0..120 {
        world.step(&mut physics);
        let body = &world.bodies[body];
        let moved = (0..3).map(|k| (body.center_of_mass()[k] - before[k]).abs()).fold(0.0, f64::max);
        let momentum = body.angular_momentum().iter().map(|c| c.abs()).fold(0.0, f64::max);
        assert!(moved < 1e-9 && momentum < 1e-9, "{moved} {momentum}");
    }
    assert!(world.bodies[body].cavity_volume(0).unwrap() > 1.1 * 0.008);
}

/// A finger of 0.4 × 0.06 × 0.06 m with a chamber above and one below its middle, cells of `1/fine` cm: how much the upper one
/// bends it, over what a beam of its section is bent by `p A e`.
fn finger(fine: usize) -> f64 {
    // So little that nothing bulges: at 2 kPa it bends by 4 % more.
    let (e, pressure) = (1.0e6, 200.0);
    let is_room = |[x, y, z]: [f64; 3]| x.abs() < 0.18 && y.abs() > 0.01 && y.abs() < 0.02 && z.abs() < 0.02;
    let mesh = TetMesh::cuboid([0.2, 0.03, 0.03], [40 * fine, 6 * fine, 6 * fine])
        .unwrap()
        .without(is_room)
        .unwrap();
    let material = DeformableMaterial::new(e, 0.0).mass_damping(20.0);
    let body = DeformableBodyBuilder::mesh(&mesh).smoothed().material(material);
    let mut body = body.pinned(|x| x.x < -0.1999).build().unwrap();
    let rooms: Vec<_> = body.model().cavities().collect();
    assert_eq!(rooms.len(), 2);
    let upper = usize::from(rooms[1].centre[1] > rooms[0].centre[1]);
    body.fill_cavity(upper, Some(CavityFilling::Pressure { gauge: pressure })).unwrap();
    let (mut physics, mut world) = (weightless(), DeformableWorld::new());
    let body = world.bodies.insert_body(body);
    steps(&mut physics, &mut world, 300);
    let body = &world.bodies[body];
    assert!(body.max_speed() < 1e-8, "{}", body.max_speed());
    // Turn of the section at x, by how its sides go along: they are not bulged.
    let turn = |x: f64| {
        let (mut moment, mut square) = (0.0, 0.0);
        for v in 0..body.vertex_count() {
            let [rx, ry, rz] = body.model().rest_position(v);
            if (rx - x).abs() < 1e-6 && rz.abs() > 0.0299 {
                moment -= (body.position(v).unwrap()[0] - rx) * ry;
                square += ry * ry;
            }
        }
        moment / square
    };
    let bent = (turn(0.1) - turn(-0.1)) / 0.2;
    // Both chambers are taken out of the section; their middles are 1.5 cm from its own.
    let (area, arm) = (0.04 * 0.01, 0.015);
    let second = 0.06f64.powi(4) / 12.0 - 2.0 * (0.04 * 0.01f64.powi(3) / 12.0 + area * arm * arm);
    // Longer above: it bends down.
    -bent / (pressure * area * arm / (e * second))
}

#[test]
fn a_chamber_bends_a_finger_as_a_beam_under_its_moment() {
    let [coarse, fine] = [1, 2].map(finger);
    println!("bent by {coarse:.3} and {fine:.3} of the beam");
    assert!((fine - 1.0).abs() < 0.01 && (coarse - 1.0).abs() < 0.03, "{coarse} {fine}");
}

/// A hollow cube pressed by a plate to nine tenths of its height; with its cavity as it is filled.
fn pressed(
    filling: Option<CavityFilling>,
    tune: impl Fn(&mut SolverSettings),
) -> (PhysicsWorld, DeformableWorld, ColliderHandle) {
    let (mut physics, _) = world_with_floor(H);
    let plate = RigidBodyBuilder::kinematic_position_based().translation(Vector::Y * 0.45);
    let (plate, top) = physics.insert(plate, ColliderBuilder::cuboid(0.4, 0.05, 0.4));
    let mut world = DeformableWorld::new();
    let mut body =
        hollow_cube().material(DeformableMaterial::new(1.0e5, 0.3).mass_damping(5.0).friction(0.5));
    if let Some(filling) = filling {
        body = body.fill_cavity(0, filling);
    }
    let body = body.translation(Vector::Y * 0.2).tune(tune).can_sleep(false);
    world.insert(body).unwrap();
    for step in 0..240 {
        let down = 0.04 * (step as f32 / 60.0).min(1.0);
        physics.bodies[plate].set_next_kinematic_translation(Vector::Y * (0.45 - down));
        world.step(&mut physics);
    }
    (physics, world, top)
}

#[test]
fn a_sealed_chamber_that_is_pressed_keeps_its_gas() {
    let gas = CavityFilling::Gas { gauge: 0.0, ambient: 101_325.0, volume: 0.008, exponent: 1.0 };
    let (mut physics, mut world, top) = pressed(Some(gas), |_| {});
    let force =
        |world: &DeformableWorld| world.contacts_with(top).map(|c| f64::from(-c.force.y)).sum::<f64>();
    let handle = world.bodies.iter().next().unwrap().0;
    let body = &mut world.bodies[handle];
    let (volume, gauge) = (body.cavity_volume(0).unwrap(), body.cavity_pressure(0).unwrap());
    println!("volume {volume}, gauge {gauge} Pa, iterations {}", body.last_iterations());
    assert!(gauge > 1e3 && volume < 0.0079, "{gauge} {volume}");
    assert!(((gauge + 101_325.0) * volume / (101_325.0 * 0.008) - 1.0).abs() < 1e-9);
    assert!(body.max_speed() < 1e-5 && body.last_converged(), "{}", body.max_speed());
    // In balance with that pressure: given as such, nothing moves.
    let sealed = body.cavity_pressure(0).unwrap();
    body.fill_cavity(0, Some(CavityFilling::Pressure { gauge: sealed })).unwrap();
    let pressed_by = force(&world);
    steps(&mut physics, &mut world, 120);
    let after = world.bodies[handle].cavity_volume(0).unwrap();
    println!("the plate presses with {pressed_by} N, {} N at the same pressure given", force(&world));
    assert!((after / volume - 1.0).abs() < 1e-5, "{volume} {after}");
    assert!((force(&world) / pressed_by - 1.0).abs() < 1e-4);
    // Without it the plate has less to press.
    let (_, empty, top) = pressed(None, |_| {});
    let alone: f64 = empty.contacts_with(top).map(|c| f64::from(-c.force.y)).sum();
    assert!(pressed_by > 1.03 * alone, "{pressed_by} {alone}");
}

#[test]
fn a_liquid_keeps_its_volume() {
    let water = CavityFilling::Liquid { volume: 0.008, bulk_modulus: 2.2e9 };
    let (_, world, _) = pressed(Some(water), |_| {});
    let body = world.bodies.iter().next().unwrap().1;
    let (volume, gauge) = (body.cavity_volume(0).unwrap(), body.cavity_pressure(0).unwrap());
    println!(
        "volume {volume}, gauge {gauge} Pa, iterations {}, at {} m/s",
        body.last_iterations(),
        body.max_speed()
    );
    assert!((volume / 0.008 - 1.0).abs() < 1e-5 && gauge > 1e3, "{volume} {gauge}");
    assert!(body.max_speed() < 1e-4, "{}", body.max_speed());
}

#[test]
fn fillings_are_read_refused_and_gone_with_what_they_name() {
    let mut body = hollow_cube().build().unwrap();
    let cavity = body.model().cavities().next().unwrap();
    assert!((cavity.volume - 0.008).abs() < 1e-12 && (cavity.area - 0.24).abs() < 1e-12);
    assert!(cavity.centre.iter().all(|c| c.abs() < 1e-12));
    assert_eq!(body.fill_cavity(1, None), Err(BodyError::NoSuchCavity { cavity: 1, cavities: 1 }));
    let bad = body.fill_cavity(0, Some(CavityFilling::Pressure { gauge: f64::NAN }));
    assert!(bad.unwrap_err().to_string().contains("cavity 0 cannot be: its pressure is not finite"));
    assert_eq!((body.cavity_filling(0), body.cavity_pressure(0)), (Ok(None), Ok(0.0)));
    body.seal_cavity(0, 1e5, 1.4).unwrap();
    assert!(body.cavity_pressure(0).unwrap().abs() < 1e-9);
    body.fill_cavity(0, Some(CavityFilling::Pressure { gauge: -1e3 })).unwrap();
    assert_eq!(body.cavity_pressure(0), Ok(-1e3));
    assert!(hollow_cube().fill_cavity(3, CavityFilling::Pressure { gauge: 1.0 }).build().is_err());
    let solid = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2; 3]).build().unwrap();
    assert_eq!(solid.cavity_volume(0), Err(BodyError::NoSuchCavity { cavity: 0, cavities: 0 }));
}

/// Of the second order, what is inflated and lands returns as it does at finer steps: its pressure acts in full at both ends of a step.
#[test]
fn what_is_inflated_bounces_alike_at_finer_steps_in_the_second_order() {
    let rebound = |dt: f32| {
        let mut physics = PhysicsWorld::new();
        physics.integration_parameters.dt = dt;
        let floor = ColliderBuilder::cuboid(5.0, 0.5, 5.0).translation(Vector::Y * -0.5);
        physics.insert(RigidBodyBuilder::fixed(), floor);
        let mut world = DeformableWorld::new();
        let mesh = TetMesh::cuboid([0.15, 0.15, 0.15], [6, 6, 6]).unwrap();
        let hollow = mesh.without(|x| x.iter().all(|c| c.abs() < 0.1)).unwrap();
        let body = DeformableBodyBuilder::mesh(&hollow).material(DeformableMaterial::new(5.0e5, 0.3));
        let body = body.fill_cavity(0, CavityFilling::Pressure { gauge: 1.0e5 }).can_sleep(false);
        let body = body.translation(Vector::Y * 0.2).linvel(Vector::Y * -2.0);
        let body = world.insert(body.tune(|s| s.integrator = Integrator::Bdf2)).unwrap();
        let mut most = f64::NEG_INFINITY;
        for _ in 0..(0.4 / dt) as usize {
            world.step(&mut physics);
            most = most.max(world.bodies[body].linvel()[1]);
        }
        most
    };
    let [coarse, fine] = [1.0 / 960.0, 1.0 / 3840.0].map(rebound);
    println!("returns with {coarse:.3} m/s, at a quarter of the step {fine:.3}");
    assert!((coarse / fine - 1.0).abs() < 0.06 && (2.2..2.5).contains(&fine), "{coarse} {fine}");
}
