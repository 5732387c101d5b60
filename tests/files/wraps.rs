//! Closed surfaces made around damaged ones.

use crate::surfaces::{Triangles, joined, lump, torus, turned};
use foible3d::prelude::*;
use foible3d::{MeshError, SurfaceWrapped};
use rapier3d::parry::query::PointQuery;
use rapier3d::parry::shape::TriMesh;
use rapier3d::prelude::*;
use std::collections::BTreeMap;

fn ball() -> Triangles {
    Ball::new(0.5).to_trimesh(48, 32)
}

fn mesh((vertices, triangles): Triangles) -> SurfaceMesh {
    SurfaceMesh { vertices, triangles }
}

/// Numbers between 0 and 1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }
}

/// Every edge has two triangles, one each way; every vertex one fan of them; each side one volume.
fn is_manifold(mesh: &SurfaceMesh) -> bool {
    let mut edges: BTreeMap<[u32; 2], i32> = BTreeMap::new();
    let mut next: BTreeMap<u32, BTreeMap<u32, u32>> = BTreeMap::new();
    for [a, b, c] in &mesh.triangles {
        for [p, q, r] in [[a, b, c], [b, c, a], [c, a, b]] {
            *edges.entry([*p, *q]).or_default() += 1;
            next.entry(*p).or_default().insert(*q, *r);
        }
    }
    let alike = edges.iter().all(|([p, q], n)| *n == 1 && edges.get(&[*q, *p]) == Some(&1));
    let one_fan = |fan: &BTreeMap<u32, u32>| {
        let start = *fan.keys().next().unwrap();
        let mut at = start;
        for k in 1.. {
            match fan.get(&at) {
                Some(to) => at = *to,
                None => return false,
            }
            if at == start {
                return k == fan.len();
            }
        }
        false
    };
    alike && next.values().all(one_fan)
}

fn wrap(given: &SurfaceMesh, cell: f32) -> (SurfaceMesh, SurfaceWrapped) {
    let (made, report) = given.wrapped(cell).unwrap();
    assert!(is_manifold(&made));
    assert!(made.report().is_sound(), "{}", made.report());
    assert_eq!(report.volume, made.volume());
    (made, report)
}

/// Greatest distance of points all over one surface from another.
fn away(from: &SurfaceMesh, to: &SurfaceMesh) -> f32 {
    let to = TriMesh::new(to.vertices.clone(), to.triangles.clone()).unwrap();
    let mut most = 0.0f32;
    for [a, b, c] in from.triangles.iter().map(|t| t.map(|v| from.vertices[v as usize])) {
        for (i, j) in (0..=2).flat_map(|i| (0..=2 - i).map(move |j| (i, j))) {
            let [u, v] = [i, j].map(|k| k as f32 / 2.0);
            most = most.max(to.distance_to_local_point(a + (b - a) * u + (c - a) * v, false));
        }
    }
    most
}

/// What is closed stays where it is: nowhere more than half a cell off, either way.
#[test]
fn a_wrap_of_a_sound_surface_is_within_half_a_cell() {
    let cube = Cuboid::new(Vector::splat(0.4)).to_trimesh();
    let hollow = joined(ball(), Ball::new(0.3).to_trimesh(24, 16), Vector::ZERO, true);
    let bar = Cylinder::new(0.5, 0.2).to_trimesh(6);
    let cases = [
        ("ball", ball()),
        ("torus", torus()),
        ("lump", lump()),
        ("cube", turned(cube, [0.5, 0.3, 0.9])),
        ("hollow", hollow),
        ("bar", turned(bar, [0.3, 1.0, 0.2])),
    ];
    for (name, given) in cases {
        let given = mesh(given);
        for cell in [0.12, 0.08] {
            let (made, report) = wrap(&given, cell);
            let off = [away(&made, &given), away(&given, &made)].map(|off| off / cell);
            let volume = made.volume() / given.volume() - 1.0;
            println!("{name} at {cell} m: {off:?} cells off, volume {volume:+.4}");
            assert!(off[0] < 0.5 && off[1] < 0.5, "{name}: {off:?}");
            assert!(volume.abs() < 0.05, "{name}: {volume}");
            assert!((report.bridged, report.turned) == (0.0, 0) && report.distance < 0.5 * f64::from(cell));
        }
    }
}

/// A flat hole is closed by a plane: the winding number of a disc on itself is a half.
#[test]
fn a_ball_without_a_cap_is_closed_by_a_plane() {
    let (vertices, triangles) = Ball::new(0.5).to_trimesh(96, 96);
    let height =
        triangles.iter().flatten().map(|v| vertices[*v as usize].y).filter(|y| *y < 0.17).fold(0.0, f32::max);
    let below = |t: &&[u32; 3]| t.iter().all(|v| vertices[*v as usize].y < 0.17);
    let triangles = triangles.iter().filter(below).copied().collect();
    let given = SurfaceMesh { vertices, triangles };
    let (made, report) = wrap(&given, 0.05);
    let cap = 0.5 - f64::from(height);
    let whole = std::f64::consts::PI * (4.0 / 3.0 * 0.125 - cap * cap * (0.5 - cap / 3.0));
    println!("volume {:+.4}, bridged {:.4} m²", made.volume() / whole - 1.0, report.bridged);
    assert!((made.volume() / whole - 1.0).abs() < 0.01, "{} {whole}", made.volume());
    // The disc but for half a cell at its rim.
    let inner = std::f64::consts::PI * ((0.25 - f64::from(height * height)).sqrt() - 0.025).powi(2);
    assert!((report.bridged / inner - 1.0).abs() < 0.1, "{} {inner}", report.bridged);
    let top = made.vertices.iter().map(|v| v.y).fold(f32::MIN, f32::max);
    assert!((top - height).abs() < 0.025, "{top} {height}");
}

/// A third of a ball's triangles gone, at random.
#[test]
fn a_ball_without_a_third_of_its_triangles_keeps_its_volume() {
    let whole = mesh(ball()).volume();
    for seed in 0..5 {
        let (mut random, mut given) = (Random(seed), mesh(ball()));
        given.triangles.retain(|_| random.next() > 1.0 / 3.0);
        for cell in [0.15, 0.1] {
            let (made, report) = wrap(&given, cell);
            println!("{cell} m: volume {:+.4}, {report:?}", made.volume() / whole - 1.0);
            assert!((made.volume() / whole - 1.0).abs() < 0.05, "{}", made.volume() / whole);
        }
    }
}

/// Holes, triangles wound the wrong way or there twice, another shell inside, one that crosses, and scraps beside it.
fn damaged(random: &mut Random, case: usize) -> SurfaceMesh {
    let mut given = mesh([torus(), lump(), ball()][case % 3].clone());
    let hole = given.vertices[(random.next() * 300.0) as usize];
    let far = |t: &[u32; 3], given: &SurfaceMesh| given.vertices[t[0] as usize].distance(hole) > 0.15;
    let kept = given.triangles.iter().filter(|t| far(t, &given)).copied().collect();
    given.triangles = kept;
    given.triangles.retain(|_| random.next() > 0.1);
    for k in 0..given.triangles.len() {
        match (random.next() * 20.0) as u32 {
            0 => given.triangles[k].swap(0, 1),
            1 => given.triangles.push(given.triangles[k]),
            _ => {}
        }
    }
    let first = given.vertices.len() as u32;
    let (other, of_other) = Ball::new(0.15).to_trimesh(16, 8);
    let at = given.vertices[(random.next() * 300.0) as usize];
    given.vertices.extend(other.iter().map(|v| *v + at));
    given.triangles.extend(of_other.iter().map(|t| t.map(|v| v + first)));
    let scrap = given.vertices.len() as u32;
    given.vertices.extend([
        Vector::X,
        Vector::X * 1.01,
        Vector::new(1.0, 0.01, 0.0),
        Vector::splat(f32::NAN),
    ]);
    given.triangles.extend([[scrap, scrap + 1, scrap + 2], [scrap, scrap, scrap + 1], [0, 1, scrap + 3]]);
    // Every triangle with corners of its own, as STL has them.
    let soup = given.triangles.iter().flatten().map(|v| given.vertices[*v as usize]).collect();
    let triangles = (0..given.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    if case.is_multiple_of(2) { given } else { SurfaceMesh { vertices: soup, triangles } }
}

#[test]
fn random_damage_ends_closed_and_is_filled() {
    let (mut random, mut refused) = (Random(7), 0);
    for case in 0..20 {
        let given = damaged(&mut random, case);
        refused += usize::from(given.repaired(&SurfaceRepair::default()).is_err());
        let (made, report) = wrap(&given, 0.1);
        let sound = mesh([torus(), lump(), ball()][case % 3].clone()).volume();
        println!("{case}: volume {:+.3}, {report:?}", made.volume() / sound - 1.0);
        // A ball of 0.15 m stands out of it by as much as 0.014 m³.
        assert!((made.volume() - sound).abs() < 0.1 * sound + 0.014, "{case}: {}", made.volume() / sound);
        let body = made.filled(0.1).unwrap_or_else(|error| panic!("{case}: {error}"));
        assert!((body.volume() / made.volume() - 1.0).abs() < 0.1, "{case}");
        assert!(DeformableBodyBuilder::mesh(&body).build().is_ok());
    }
    println!("{refused} of 20 are beyond repair");
    assert!(refused >= 5, "{refused}");
}

#[test]
fn what_encloses_nothing_is_refused() {
    let sheet = |bent: f32| {
        let vertices = (0..21).flat_map(|i| {
            (0..21).map(move |j| Vector::new(i as f32 * 0.05, bent * (j as f32 * 0.3).sin(), j as f32 * 0.05))
        });
        let cells = (0..20u32).flat_map(|i| (0..20).map(move |j| 21 * i + j));
        let triangles = cells.flat_map(|v| [[v, v + 1, v + 22], [v, v + 22, v + 21]]);
        SurfaceMesh { vertices: vertices.collect(), triangles: triangles.collect() }
    };
    for bent in [0.0, 0.02] {
        let refused = sheet(bent).wrapped(0.1).unwrap_err();
        assert!(
            matches!(refused, MeshError::NothingEnclosed { .. } | MeshError::NotWrapped { .. }),
            "{refused}"
        );
    }
    // In cells of four times its size a ball is within half a cell of anything near it.
    let coarse = mesh(ball()).wrapped(4.0);
    assert!(coarse.is_err() || coarse.is_ok_and(|(_, report)| report.distance < 2.0));
    // A plate of 1 cm beside a ball, in cells of 10.
    let plate = Cuboid::new(Vector::new(1.0, 0.005, 1.0)).to_trimesh();
    let both = mesh(joined(ball(), plate, Vector::new(0.0, 2.0, 0.0), false));
    let refused = both.wrapped(0.1).unwrap_err();
    assert!(matches!(refused, MeshError::NotWrapped { lost, .. } if lost > 3.0), "{refused}");
    assert!(matches!(SurfaceMesh::default().wrapped(0.1), Err(MeshError::Empty)));
    for cell in [0.0, -1.0, f32::NAN, 1e-4, f32::INFINITY] {
        let refused = mesh(ball()).wrapped(cell).unwrap_err();
        assert!(
            matches!(refused, MeshError::BadCellSize { .. } | MeshError::NothingEnclosed { .. }),
            "{cell}: {refused}"
        );
    }
    let far = SurfaceMesh {
        vertices: vec![Vector::splat(1e30), Vector::ZERO, Vector::X],
        triangles: vec![[0, 1, 2]],
    };
    assert!(far.wrapped(0.1).is_err());
}
