//! Surfaces broken in named ways: what is reported of them, and what their repair makes.

use foible3d::prelude::*;
use foible3d::{MeshError, SurfaceFault};
use rapier3d::prelude::*;

/// A torus of 24 by 12 quads, as triangles; volume 2π² R r² but for its facets.
fn torus() -> SurfaceMesh {
    let (around, across) = (24u32, 12u32);
    let point = |i: u32, j: u32| {
        let [a, b] =
            [i as f32 / around as f32, j as f32 / across as f32].map(|part| part * std::f32::consts::TAU);
        let r = 0.3 + 0.1 * b.cos();
        Vector::new(r * a.cos(), 0.1 * b.sin(), r * a.sin())
    };
    let vertex = |i: u32, j: u32| (i % around) * across + j % across;
    let cells = || (0..around).flat_map(|i| (0..across).map(move |j| (i, j)));
    let vertices = cells().map(|(i, j)| point(i, j)).collect();
    let triangles = cells().flat_map(|(i, j)| {
        let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
        [[a, c, b], [a, d, c]]
    });
    SurfaceMesh { vertices, triangles: triangles.collect() }
}

fn boxed(half: f32, at: Vector) -> SurfaceMesh {
    let (vertices, triangles) = Cuboid::new(Vector::splat(half)).to_trimesh();
    SurfaceMesh { vertices: vertices.iter().map(|v| *v + at).collect(), triangles }
}

fn joined(mut first: SurfaceMesh, second: &SurfaceMesh) -> SurfaceMesh {
    let count = first.vertices.len() as u32;
    first.vertices.extend(&second.vertices);
    first.triangles.extend(second.triangles.iter().map(|t| t.map(|v| v + count)));
    first
}

fn inside_out(mut mesh: SurfaceMesh) -> SurfaceMesh {
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    mesh
}

/// What no closed surface comes of: its border has 80 edges.
fn sheet() -> SurfaceMesh {
    let vertices = (0..21).flat_map(|i| (0..21).map(move |j| Vector::new(i as f32, 0.0, j as f32) * 0.05));
    let cells = (0..20u32).flat_map(|i| (0..20).map(move |j| 21 * i + j));
    let triangles = cells.flat_map(|v| [[v, v + 1, v + 22], [v, v + 22, v + 21]]);
    SurfaceMesh { vertices: vertices.collect(), triangles: triangles.collect() }
}

/// Every triangle with corners of its own, as STL has them.
fn soup(mesh: &SurfaceMesh) -> SurfaceMesh {
    let vertices: Vec<Vector> = mesh.triangles.iter().flatten().map(|v| mesh.vertices[*v as usize]).collect();
    let triangles = (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    SurfaceMesh { triangles: triangles.collect(), vertices }
}

fn is_near(at: [f64; 3], expected: Vector) -> bool {
    (0..3).all(|k| (at[k] - f64::from(expected[k])).abs() < 1e-5)
}

fn middle(mesh: &SurfaceMesh, triangle: usize) -> Vector {
    mesh.triangles[triangle].iter().map(|v| mesh.vertices[*v as usize]).sum::<Vector>() / 3.0
}

/// What was done to a surface: its name, the surface, the faults it has to have, the volume it is to have when repaired, if it
/// can be.
type Damage = (&'static str, SurfaceMesh, fn(&SurfaceFault) -> bool, usize, Option<f64>);

fn removed(mesh: &SurfaceMesh, gone: &[usize]) -> SurfaceMesh {
    let kept = mesh.triangles.iter().enumerate().filter(|(k, _)| !gone.contains(k)).map(|(_, t)| *t);
    SurfaceMesh { triangles: kept.collect(), vertices: mesh.vertices.clone() }
}

fn turned(mesh: &SurfaceMesh, which: &[usize]) -> SurfaceMesh {
    let mut mesh = mesh.clone();
    which.iter().for_each(|t| mesh.triangles[*t].swap(1, 2));
    mesh
}

fn holes_and_windings() -> Vec<Damage> {
    let (ring, whole) = (torus(), torus().volume());
    let hole = |f: &SurfaceFault| matches!(f, SurfaceFault::Hole { .. });
    let flipped = |f: &SurfaceFault| matches!(f, SurfaceFault::Flipped { .. });
    let none = |_: &SurfaceFault| false;
    let cube = boxed(0.5, Vector::ZERO);
    let lidless = removed(&cube, &[0, 1]);
    vec![
        ("nothing", ring.clone(), none, 0, Some(whole)),
        ("one triangle is missing", removed(&ring, &[100]), hole, 1, Some(whole)),
        ("two triangles of a quad are missing", removed(&ring, &[100, 101]), hole, 1, Some(whole)),
        ("two holes far apart", removed(&ring, &[10, 300]), hole, 2, Some(whole)),
        ("two holes that touch at a vertex", removed(&ring, &[10, 10 + 26]), hole, 2, Some(whole)),
        ("half of it is missing", removed(&ring, &(0..288).collect::<Vec<_>>()), hole, 2, Some(whole / 2.0)),
        ("a sheet", sheet(), hole, 1, None),
        ("one triangle is turned", turned(&ring, &[55]), flipped, 1, Some(whole)),
        (
            "every third is turned",
            turned(&ring, &(0..576).step_by(3).collect::<Vec<_>>()),
            flipped,
            192,
            Some(whole),
        ),
        ("inside out", inside_out(ring.clone()), none, 0, Some(whole)),
        ("a soup of triangles", soup(&ring), none, 0, Some(whole)),
        ("a soup inside out", soup(&inside_out(ring)), none, 0, Some(whole)),
        ("a box without a side", lidless.clone(), hole, 1, Some(1.0)),
        ("a box without a side, inside out", inside_out(lidless), hole, 1, Some(1.0)),
    ]
}

/// The soup with corners that are a rounding apart.
fn shaken(mesh: &SurfaceMesh) -> SurfaceMesh {
    let mut shaken = soup(mesh);
    for (k, vertex) in shaken.vertices.iter_mut().enumerate() {
        *vertex += Vector::new(1.0, -1.0, 0.5) * (1.0e-8 * (k % 7) as f32);
    }
    shaken
}

fn vertices_and_pieces() -> Vec<Damage> {
    let (ring, whole) = (torus(), torus().volume());
    let with = |mesh: &SurfaceMesh, triangles: &[[u32; 3]]| {
        let mut mesh = mesh.clone();
        mesh.triangles.extend(triangles);
        mesh
    };
    let mut bad = ring.clone();
    bad.vertices.push(Vector::new(f32::NAN, 0.0, 0.0));
    let bad = with(&bad, &[[0, 1, 288]]);
    let cube = boxed(0.5, Vector::ZERO);
    let cavity = inside_out(boxed(0.2, Vector::ZERO));
    // Its plane goes through the side of the first only.
    let apart = joined(cube.clone(), &boxed(0.3, Vector::new(0.6, 0.05, 0.07)));
    let fin = joined(cube.clone(), &SurfaceMesh { vertices: vec![Vector::Y * 3.0], triangles: Vec::new() });
    let edge = cube.triangles[0];
    vec![
        ("corners a rounding apart", shaken(&ring), |_| false, 0, Some(whole)),
        (
            "a triangle twice",
            with(&ring, &[ring.triangles[7]]),
            |f| matches!(f, SurfaceFault::Duplicate { .. }),
            1,
            Some(whole),
        ),
        (
            "a triangle without area",
            with(&ring, &[[3, 3, 9]]),
            |f| matches!(f, SurfaceFault::NoArea { .. }),
            1,
            Some(whole),
        ),
        (
            "a vertex that is not there",
            with(&ring, &[[0, 1, 9999]]),
            |f| matches!(f, SurfaceFault::VertexOutOfRange { .. }),
            1,
            Some(whole),
        ),
        ("a vertex that is NaN", bad, |f| matches!(f, SurfaceFault::NotFinite { .. }), 1, Some(whole)),
        (
            "a fin on an edge",
            with(&fin, &[[edge[0], edge[1], 8]]),
            |f| matches!(f, SurfaceFault::NonManifold { .. }),
            1,
            None,
        ),
        (
            "two boxes through one another",
            apart,
            |f| matches!(f, SurfaceFault::Crossing { .. }),
            1,
            Some(1.216),
        ),
        ("a box with a cavity", joined(cube.clone(), &cavity), |_| false, 0, Some(1.0 - 0.064)),
        ("the same inside out", inside_out(joined(cube, &cavity)), |_| false, 0, Some(1.0 - 0.064)),
    ]
}

#[test]
fn damaged_surfaces_are_reported_and_repaired_or_refused() {
    let cases: Vec<Damage> = holes_and_windings().into_iter().chain(vertices_and_pieces()).collect();
    assert!(cases.len() >= 20);
    for (name, mesh, is_it, least, volume) in cases {
        let report = mesh.report();
        let found = report.faults.iter().filter(|fault| is_it(fault)).count();
        assert!(if least == 0 { report.faults.is_empty() } else { found >= least }, "{name}: {report}");
        assert_eq!(report.is_sound(), least == 0 && mesh.volume() > 0.0, "{name}: {report}");
        match (mesh.repaired(&SurfaceRepair::default()), volume) {
            (Ok((repaired, done)), Some(volume)) => {
                // A hole in a curved surface is filled with what is flat.
                assert!(
                    (repaired.volume() / volume - 1.0).abs() < 2e-3,
                    "{name}: {} of {volume}",
                    repaired.volume()
                );
                let left = repaired.report();
                let crosses = |f: &SurfaceFault| matches!(f, SurfaceFault::Crossing { .. });
                assert!(left.faults.iter().all(crosses) && left.volume > 0.0, "{name}: {done:?} {left}");
            }
            (Err(MeshError::OpenSurface { edges, .. }), None) => assert!(edges > 0, "{name}"),
            (other, _) => panic!("{name}: {:?}", other.map(|(_, done)| done)),
        }
    }
}

#[test]
fn faults_are_where_they_were_made() {
    let ring = torus();
    for triangle in [0, 17, 333] {
        let expected = middle(&ring, triangle);
        let open = removed(&ring, &[triangle]).report();
        let [SurfaceFault::Hole { edges: 3, at }] = open.faults[..] else { panic!("{open}") };
        assert!(is_near(at, expected), "{at:?} {expected}");
        let against = turned(&ring, &[triangle]).report();
        let [SurfaceFault::Flipped { triangle: told, at }] = against.faults[..] else { panic!("{against}") };
        assert!(told == triangle && is_near(at, expected), "{told} {at:?} {expected}");
        let mut twice = ring.clone();
        twice.triangles.push(ring.triangles[triangle]);
        let twice = twice.report();
        let [SurfaceFault::Duplicate { triangle: 576, at }] = twice.faults[..] else { panic!("{twice}") };
        assert!(is_near(at, expected));
    }
    let text = removed(&ring, &[0]).report().to_string();
    assert!(text.contains("288 vertices") && text.contains("a hole of 3 edges around ["), "{text}");
}

#[test]
fn nothing_is_left_of_what_is_no_surface() {
    for mesh in [
        SurfaceMesh::default(),
        SurfaceMesh { vertices: vec![Vector::ZERO; 3], triangles: vec![[0, 1, 2]] },
        SurfaceMesh { vertices: vec![Vector::NAN; 3], triangles: vec![[0, 1, 2]] },
    ] {
        assert_eq!(mesh.repaired(&SurfaceRepair::default()).unwrap_err(), MeshError::Empty);
        assert!(!mesh.report().is_sound());
    }
}

#[test]
fn what_is_repaired_is_filled() {
    let ring = soup(&removed(&torus(), &[40, 41])).scaled(1000.0).scaled(1.0e-3).z_up_to_y_up();
    let (ring, done) = ring.repaired(&SurfaceRepair::default()).unwrap();
    assert_eq!(done.holes, 1);
    let mesh = ring.filled(0.06).unwrap();
    assert!((mesh.volume() / ring.volume() - 1.0).abs() < 0.03, "{} of {}", mesh.volume(), ring.volume());
}

/// Every hole that any few triangles leave is found and filled, and the volume is nearly what it was.
#[test]
fn random_holes_are_filled() {
    use proptest::prelude::*;
    use proptest::test_runner::{Config, TestRunner};
    let ring = torus();
    let gone = proptest::collection::vec(0usize..576, 1..12);
    let turns = proptest::collection::vec(0usize..576, 0..60);
    let result = TestRunner::new(Config::with_cases(200)).run(&(gone, turns), |(gone, turns)| {
        let broken = soup(&removed(&turned(&ring, &turns), &gone));
        let repaired = broken.repaired(&SurfaceRepair::default());
        let (repaired, done) = repaired.map_err(|error| TestCaseError::fail(error.to_string()))?;
        prop_assert!(done.holes >= 1 && repaired.report().is_sound());
        prop_assert!((repaired.volume() / ring.volume() - 1.0).abs() < 0.02);
        Ok(())
    });
    result.unwrap();
}
