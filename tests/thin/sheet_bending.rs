//! Sheets bend as thin plates do, however they are cut into triangles: closed forms [Timoshenko & Woinowsky-Krieger 1959].
use crate::common::games::Random;
use crate::common::*;
use foible3d::Structure;
use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::f64::consts::PI;

const YOUNG: f64 = 1.0e9;
const THICKNESS: f64 = 1.0e-2;
/// So light that plates sag by hundredths of their thickness.
const DENSITY: f64 = 10.0;

/// How a rectangle is cut.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Cut {
    /// Every other row is shifted by half a cell.
    Staggered,
    /// All diagonals one way.
    Right,
    /// Diagonals to and fro: vertices of four and of eight neighbours.
    UnionJack,
    /// Right triangles, of which vertices are moved by up to a third of a cell.
    Irregular,
}

const CUTS: [Cut; 4] = [Cut::Staggered, Cut::Right, Cut::UnionJack, Cut::Irregular];

/// A rectangle in x and z about the origin, of `size` [m] and `cells`.
fn rectangle(cut: Cut, size: [f64; 2], cells: [usize; 2]) -> Structure {
    if cut == Cut::Staggered {
        return Structure::rectangle(size.map(|s| s / 2.0), cells, THICKNESS).unwrap();
    }
    let points = grid(cut, size, cells, cells[0]);
    Structure::sheet(points, &triangles(cut, cells, cells[0] + 1), THICKNESS).unwrap()
}

/// A ring about z whose middle is the origin, `size` [m] around and along.
fn ring(cut: Cut, size: [f64; 2], cells: [usize; 2]) -> Structure {
    let radius = size[0] / (2.0 * PI);
    let around = |[x, _, z]: [f64; 3]| [radius * (x / radius).sin(), -radius * (x / radius).cos(), z];
    let points = grid(cut, size, cells, cells[0] - 1).into_iter().map(around).collect();
    Structure::sheet(points, &triangles(cut, cells, cells[0]), THICKNESS).unwrap()
}

/// Points of rows from 0 to `last` of the cells along x; of the first and the middle column none is moved along.
fn grid(cut: Cut, size: [f64; 2], [nx, nz]: [usize; 2], last: usize) -> Vec<[f64; 3]> {
    let mut random = Random(7);
    let mut points = Vec::new();
    for j in 0..=nz {
        for i in 0..=last {
            let mut at = |k: usize, n: usize| {
                let by = f64::from(0.66 * random.unit() - 0.33);
                let is_moved = cut == Cut::Irregular && k > 0 && k < n && 2 * k != n;
                (k as f64 + if is_moved { by } else { 0.0 }) / n as f64 - 0.5
            };
            points.push([size[0] * at(i, nx), 0.0, size[1] * at(j, nz)]);
        }
    }
    points
}

/// Triangles between rows of `columns` points, closed where these are no more than the cells.
fn triangles(cut: Cut, [nx, nz]: [usize; 2], columns: usize) -> Vec<[u32; 3]> {
    let mut triangles = Vec::new();
    for j in 0..nz {
        for i in 0..nx {
            let at = |i: usize, j: usize| (j * columns + i % columns) as u32;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            let turned = cut == Cut::UnionJack && (i + j) % 2 == 1;
            triangles.extend(if turned { [[a, b, d], [b, c, d]] } else { [[a, b, c], [a, c, d]] });
        }
    }
    triangles
}

/// How far vertices `at` move down from rest to where a sheet rests under forces on vertices `on`, pinned where told [m].
fn sag(
    structure: &Structure,
    nu: f64,
    pinned: impl Fn([f64; 3]) -> bool,
    gravity: f32,
    forces: &[(usize, Vector)],
    at: impl Fn([f64; 3]) -> bool,
) -> f64 {
    let sheet = DeformableBodyBuilder::structure(structure).material(material(YOUNG, nu));
    sag_of(sheet, structure, pinned, gravity, forces, at)
}

fn material(young: f64, nu: f64) -> DeformableMaterial {
    DeformableMaterial::new(young, nu).density(DENSITY)
}

/// The same of a body that is made already.
fn sag_of(
    sheet: DeformableBodyBuilder,
    structure: &Structure,
    pinned: impl Fn([f64; 3]) -> bool,
    gravity: f32,
    forces: &[(usize, Vector)],
    at: impl Fn([f64; 3]) -> bool,
) -> f64 {
    let sheet = sheet.can_sleep(false);
    let sheet = sheet.settings(SolverSettings::default().solver(Solver::Newton).max_iterations(20));
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::NEG_Y * gravity;
    let mut world = DeformableWorld::new();
    let handle = world.insert(sheet).unwrap();
    let body = &mut world.bodies[handle];
    for v in at_rest_where(body, &pinned) {
        body.pin(v).unwrap();
    }
    for (vertex, force) in forces {
        body.add_force(&[*vertex], *force).unwrap();
    }
    // Long steps of implicit Euler: what moves is still after a few.
    physics.integration_parameters.dt = 0.1;
    for _ in 0..60 {
        world.step(&mut physics);
    }
    let body = &world.bodies[handle];
    assert!(body.max_speed() < 1e-6, "{}", body.max_speed());
    let vertices = at_rest_where(body, at);
    let before: f64 =
        vertices.iter().map(|v| structure.vertices()[*v][1]).sum::<f64>() / vertices.len() as f64;
    before - mean_position(body, &vertices)[1]
}

fn rigidity(nu: f64) -> f64 {
    YOUNG * THICKNESS.powi(3) / (12.0 * (1.0 - nu * nu))
}

/// The middle of a square plate of 1 m that is simply supported all around, under its weight, over that of the closed form.
fn square_plate(cut: Cut, cells: usize) -> f64 {
    let plate = rectangle(cut, [1.0; 2], [cells; 2]);
    let edge = |[x, _, z]: [f64; 3]| x.abs() > 0.4999 || z.abs() > 0.4999;
    let middle = |[x, _, z]: [f64; 3]| x.hypot(z) < 1e-6;
    let found = sag(&plate, 0.3, edge, G as f32, &[], middle);
    found / (0.00406235 * DENSITY * G * THICKNESS / rigidity(0.3))
}

#[test]
fn square_plates_sag_as_plates_do_on_any_triangles() {
    for cut in CUTS {
        let [coarse, fine] = [12, 24].map(|cells| (square_plate(cut, cells) - 1.0).abs());
        println!("{cut:?}: off by {:.2} % at 12 cells, {:.2} % at 24", 100.0 * coarse, 100.0 * fine);
        assert!(coarse < 0.03 && fine < 0.01 && fine < 0.7 * coarse + 1e-3, "{cut:?}: {coarse} {fine}");
    }
}

#[test]
fn strips_bend_as_beams_do_on_any_triangles_and_of_any_width() {
    for cut in CUTS {
        for wide in [1, 2, 4, 12] {
            let (cell, length) = (1.0 / 40.0, 1.0);
            let strip = rectangle(cut, [length, wide as f64 * cell], [40, wide]);
            // Two columns, of which the second may be moved.
            let clamped = if cut == Cut::Irregular { 1.4 } else { 1.01 } * cell;
            let clamp = |[x, _, _]: [f64; 3]| x < -0.5 + clamped;
            let end = |[x, _, _]: [f64; 3]| x > 0.4999;
            let found = sag(&strip, 0.0, clamp, G as f32, &[], end);
            let free: f64 = length - cell / 2.0;
            let beam = DENSITY * G * THICKNESS * free.powi(4) / (8.0 * rigidity(0.0));
            println!("{cut:?}, {wide} wide: {:.4} of a beam's", found / beam);
            let within = if cut == Cut::Irregular { 0.03 } else { 0.01 };
            assert!((found / beam - 1.0).abs() < within, "{cut:?} {wide}: {found} {beam}");
        }
    }
}

#[test]
fn strips_twist_as_plates_do_on_any_triangles() {
    // Held at three corners and pressed at the fourth: y = κ x z, and F = 2 D (1 − ν) κ.
    let (nu, force) = (0.3, 1e-3);
    for cut in CUTS {
        for wide in [1, 2, 4, 20] {
            let width = wide as f64 / 20.0;
            let strip = rectangle(cut, [1.0, width], [20, wide]);
            let is_corner = |[x, _, z]: [f64; 3]| x.abs() > 0.4999 && z.abs() > 0.4999 * width;
            let is_pressed = |p: [f64; 3]| is_corner(p) && p[0] > 0.0 && p[2] > 0.0;
            let pressed = strip.vertices().iter().position(|p| is_pressed(*p)).unwrap();
            let forces = [(pressed, Vector::NEG_Y * force)];
            let found = sag(&strip, nu, |p| is_corner(p) && !is_pressed(p), 0.0, &forces, is_pressed);
            let plate = f64::from(force) / (2.0 * rigidity(nu) * (1.0 - nu)) * width;
            println!("{cut:?}, {wide} wide: {:.4} of a plate's", found / plate);
            assert!((found / plate - 1.0).abs() < 0.03, "{cut:?} {wide}: {found} {plate}");
        }
    }
}

#[test]
fn a_ring_that_is_pulled_gives_way_as_a_ring() {
    // A thin ring between two forces: (π/4 − 2/π) P R³/(E I). Pulled, as one that is pressed rolls aside.
    // Faces of irregular triangles lock in their planes, less where they are finer: the first order of flat faces.
    for (cut, within) in
        [(Cut::Right, [0.03, 0.01]), (Cut::UnionJack, [0.03, 0.01]), (Cut::Irregular, [0.1, 0.05])]
    {
        let [coarse, fine] = [48, 96].map(|cells| pulled_ring(cut, cells));
        println!("{cut:?}: {coarse:.4} of a thin ring's of 48 cells around, {fine:.4} of 96");
        assert!(
            (coarse - 1.0).abs() < within[0] && (fine - 1.0).abs() < within[1],
            "{cut:?} {coarse} {fine}"
        );
    }
}

/// How far a ring of `cells` around gives way to a force, over what a thin ring does.
fn pulled_ring(cut: Cut, cells: usize) -> f64 {
    let (radius, width, force) = (0.5, 0.1, 0.1);
    let ring = ring(cut, [2.0 * PI * radius, width], [cells, cells / 12]);
    let top = |[x, y, _]: [f64; 3]| y > 0.9 * radius && x.abs() < 0.01;
    let bottom = |[x, y, _]: [f64; 3]| y < -0.9 * radius && x.abs() < 0.01;
    let tops: Vec<usize> = (0..ring.vertices().len()).filter(|v| top(ring.vertices()[*v])).collect();
    let each = Vector::Y * (force / tops.len() as f32);
    let forces: Vec<(usize, Vector)> = tops.iter().map(|v| (*v, each)).collect();
    let found = -sag(&ring, 0.0, bottom, 0.0, &forces, top);
    let inertia = width * THICKNESS.powi(3) / 12.0;
    found / ((PI / 4.0 - 2.0 / PI) * f64::from(force) * radius.powi(3) / (YOUNG * inertia))
}

#[test]
fn strips_of_two_stiffnesses_bend_as_beams_of_them() {
    // One end after the other: both have the moment of what is beyond. Side by side: together.
    let (cell, length, contrast) = (1.0 / 40.0, 1.0, 100.0);
    for cut in CUTS {
        let strip = |painted: &dyn Fn([f64; 3]) -> u32| {
            let strip = rectangle(cut, [length, 8.0 * cell], [40, 8]).painted(painted);
            let clamp = |[x, _, _]: [f64; 3]| x < -0.5 + 1.4 * cell;
            let sheet = DeformableBodyBuilder::structure(&strip).material(material(YOUNG, 0.0));
            let sheet = sheet.region_material(1, material(contrast * YOUNG, 0.0));
            sag_of(sheet, &strip, clamp, G as f32, &[], |[x, _, _]| x > 0.4999)
        };
        let free: f64 = length - cell / 2.0;
        let load = DENSITY * G * THICKNESS;
        let one = load * free.powi(4) / (8.0 * rigidity(0.0));
        let beside = strip(&|[_, _, z]| u32::from(z > 0.0)) / (one * 2.0 / (1.0 + contrast));
        // ∫ x·M(x)/(E I) over the free length; the soft half is beyond the middle.
        let soft = (length / 2.0f64).powi(4) / 8.0 * load / rigidity(0.0);
        let after = strip(&|[x, _, _]| u32::from(x < 0.0)) / (soft + (one - soft) / contrast);
        println!("{cut:?}: {beside:.4} of the beam's side by side, {after:.4} one after the other");
        assert!((beside - 1.0).abs() < 0.25 && (after - 1.0).abs() < 0.06, "{cut:?} {beside} {after}");
    }
}

/// A name, points [m] and triangles.
type Odd = (&'static str, Vec<[f64; 3]>, Vec<[u32; 3]>);

/// Sheets of few triangles, and of such that are all there is around one another.
fn odd_sheets() -> Vec<Odd> {
    let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let prism = [0.0, 1.0]
        .into_iter()
        .flat_map(|z| [0.0, 2.0, 4.0].map(|k: f64| [(k * PI / 3.0).cos(), (k * PI / 3.0).sin(), z]));
    let around = |k: u32| [[k, (k + 1) % 3, 3 + (k + 1) % 3], [k, 3 + (k + 1) % 3, 3 + k]];
    let fan = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [-0.5, 0.9, 0.0], [-0.5, -0.9, 0.0]];
    let sliver = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 1e-3, 0.0], [0.5, -1.0, 0.0], [1.5, 1.0, 0.0]];
    let book = vec![[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.5, 0.0], [1.0, 0.5, 1e-3]];
    vec![
        ("triangle", corners[..3].to_vec(), vec![[0, 1, 2]]),
        ("two triangles", corners.clone(), vec![[0, 1, 2], [1, 0, 3]]),
        ("tetrahedron", corners, vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]),
        ("prism", prism.collect(), (0..3).flat_map(around).collect()),
        ("fan of three", fan, vec![[0, 1, 2], [0, 2, 3], [0, 3, 1]]),
        ("sliver", sliver, vec![[0, 1, 2], [1, 0, 3], [2, 1, 4]]),
        ("shut book", book, vec![[0, 1, 2], [1, 0, 3]]),
    ]
}

#[test]
fn odd_sheets_keep_their_shape_and_spin_freely() {
    for (name, points, triangles) in odd_sheets() {
        let sheet = Structure::sheet(points.clone(), &triangles, 0.02).unwrap();
        for young in [1e4, 1e9] {
            let (mut physics, mut world) = (PhysicsWorld::new(), DeformableWorld::new());
            physics.gravity = Vector::ZERO;
            let body = || {
                let body = DeformableBodyBuilder::structure(&sheet).can_sleep(false);
                body.material(DeformableMaterial::new(young, 0.3).mass_damping(0.0))
            };
            let still = world.insert(body()).unwrap();
            let thrown = body().translation(Vector::X * 10.0).angvel(Vector::new(0.3, 0.2, 0.1));
            let thrown = world.insert(thrown).unwrap();
            let before = total_energy(&world.bodies[thrown]);
            for _ in 0..120 {
                world.step(&mut physics);
            }
            let [still, thrown] = [still, thrown].map(|handle| &world.bodies[handle]);
            let off = points.iter().enumerate().map(|(v, p)| {
                let x = still.position(v).unwrap();
                (0..3).map(|k| (x[k] - p[k]).abs()).fold(0.0, f64::max)
            });
            let off = off.fold(0.0, f64::max);
            let energy = total_energy(thrown) / before;
            println!(
                "{name}, {young:.0e} Pa: off by {off:.1e} m at rest, {energy:.4} of its energy spinning"
            );
            assert!(off < 1e-9 && (0.9..1.0001).contains(&energy), "{name} {young:e}: {off} {energy}");
        }
    }
}
