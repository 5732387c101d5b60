//! Meshes that follow bodies.

use foible3d::BodyError;
use foible3d::prelude::*;
use proptest::prelude::*;
use rapier3d::prelude::*;

fn vector(size: f32) -> impl Strategy<Value = Vector> {
    [-size..size, -size..size, -size..size].prop_map(Vector::from)
}

/// Sets every vertex by a map of its rest position.
fn move_by(body: &mut DeformableBody, map: impl Fn([f64; 3]) -> [f64; 3]) {
    for v in 0..body.vertex_count() {
        let to = map(body.model().rest_position(v));
        body.set_position(v, to).unwrap();
    }
}

/// `M p + t` with the columns of M.
fn affine(columns: [Vector; 3], t: Vector, p: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|r| (0..3).map(|c| f64::from(columns[c][r]) * p[c]).sum::<f64>() + f64::from(t[r]))
}

fn deform(columns: [Vector; 3], t: Vector, p: Vector) -> Vector {
    let [x, y, z] = affine(columns, t, p.to_array().map(f64::from));
    Vector::new(x as f32, y as f32, z as f32)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// Inside and outside of lattices and filled shapes; normals as cross products of what lies in the surface.
    #[test]
    fn skins_of_solids_follow_affine_motions(
        shake in [vector(0.4), vector(0.4), vector(0.4)], t in vector(50.0), kind in 0usize..3,
        points in proptest::collection::vec((vector(0.7), vector(1.0)), 20),
    ) {
        let builder = match kind {
            0 => DeformableBodyBuilder::cuboid(Vector::splat(0.5), [3, 4, 5]),
            1 => DeformableBodyBuilder::filled(&Ball::new(0.5), 0.2),
            _ => DeformableBodyBuilder::cuboid(Vector::splat(0.5), [2; 3]).smoothed(),
        };
        let mut body = builder.build().unwrap();
        let columns = [Vector::X + shake[0], Vector::Y + shake[1], Vector::Z + shake[2]];
        let determinant = columns[0].dot(columns[1].cross(columns[2]));
        prop_assume!(determinant > 0.05);
        let vertices: Vec<Vector> = points.iter().map(|(p, _)| *p).collect();
        let normals: Vec<Vector> = points.iter().map(|(_, n)| n.normalize_or(Vector::Y)).collect();
        let skin = DeformableSkin::bind(body.model(), &vertices, &normals).unwrap();
        prop_assert_eq!(skin.vertex_count(), 20);
        move_by(&mut body, |p| affine(columns, t, p));
        let (mut positions, mut turned) = (vertices.clone(), normals.clone());
        skin.update(&body, &mut positions, &mut turned).unwrap();
        for i in 0..20 {
            let expected = deform(columns, t, vertices[i]);
            // f32 keeps 4e-6 at 50 m.
            prop_assert!((positions[i] - expected).length() < 2e-5, "{} {}", positions[i], expected);
            let side = normals[i].any_orthonormal_vector();
            let zero = Vector::ZERO;
            let [a, b] = [side, normals[i].cross(side)].map(|s| deform(columns, zero, s));
            let expected = a.cross(b).normalize();
            prop_assert!((turned[i] - expected).length() < 1e-4, "{} {}", turned[i], expected);
        }
    }

    /// Both sides of a sheet, turned and stretched in its plane.
    #[test]
    fn skins_of_sheets_keep_their_thickness(
        turn in vector(3.0), t in vector(5.0), stretch in (0.5f32..2.0, 0.5f32..2.0), up in any::<bool>(),
        points in proptest::collection::vec((-0.5f32..0.5, -0.4f32..0.4), 10),
    ) {
        let mut body = DeformableBodyBuilder::cloth([0.5, 0.4], [5, 4], 0.02).build().unwrap();
        let side = if up { 1.0 } else { -1.0 };
        let vertices: Vec<Vector> = points.iter().map(|(x, z)| Vector::new(*x, 0.01 * side, *z)).collect();
        let normals = vec![Vector::Y * side; 10];
        let skin = DeformableSkin::bind(body.model(), &vertices, &normals).unwrap();
        let turn = Rotation::from_scaled_axis(turn);
        let map = |p: Vector| turn * (p * Vector::new(stretch.0, 1.0, stretch.1)) + t;
        move_by(&mut body, |p| map(Vector::new(p[0] as f32, p[1] as f32, p[2] as f32)).to_array().map(f64::from));
        let (mut positions, mut turned) = (vertices.clone(), normals.clone());
        skin.update(&body, &mut positions, &mut turned).unwrap();
        for i in 0..10 {
            prop_assert!((positions[i] - map(vertices[i])).length() < 1e-5);
            prop_assert!((turned[i] - turn * normals[i]).length() < 1e-4);
        }
    }
}

#[test]
fn tubes_along_ropes_keep_their_radius_and_do_not_turn_about_themselves() {
    let points: Vec<Vector> = (0..=20).map(|k| Vector::X * (0.05 * k as f32)).collect();
    let mut body = DeformableBodyBuilder::rope(&points, 0.02).build().unwrap();
    // A tube of twelve sides with caps.
    let ring = |x: f32, k: usize| {
        let angle = std::f32::consts::TAU * k as f32 / 12.0;
        (Vector::new(x, 0.02 * angle.cos(), 0.02 * angle.sin()), Vector::new(0.0, angle.cos(), angle.sin()))
    };
    let tube: Vec<(Vector, Vector)> =
        (0..=40).flat_map(|j| (0..12).map(move |k| ring(j as f32 / 40.0, k))).collect();
    let vertices: Vec<Vector> = tube.iter().map(|(p, _)| *p).collect();
    let normals: Vec<Vector> = tube.iter().map(|(_, n)| *n).collect();
    let skin = DeformableSkin::bind(body.model(), &vertices, &normals).unwrap();
    // Bent to three quarters of a circle, in the plane of x and y.
    let bend = |x: f64| {
        let angle = 1.5 * std::f64::consts::PI * x;
        let r = 1.0 / (1.5 * std::f64::consts::PI);
        ([r * angle.sin(), r * (1.0 - angle.cos()), 0.0], angle)
    };
    move_by(&mut body, |p| bend(p[0]).0);
    let (mut positions, mut turned) = (vertices.clone(), normals.clone());
    skin.update(&body, &mut positions, &mut turned).unwrap();
    for (i, (rest, normal)) in tube.iter().enumerate() {
        let (at, angle) = bend(f64::from(rest.x));
        let at = Vector::from(at.map(|c| c as f32));
        let across = Vector::new(-angle.sin() as f32, angle.cos() as f32, 0.0);
        let expected = across * normal.y + Vector::Z * normal.z;
        // Segments are chords of 13.5°: r (1 − cos 6.75°) inside, directions half of that off.
        assert!((positions[i] - (at + expected * 0.02)).length() < 5e-3, "{i}: {} {}", positions[i], at);
        assert!((turned[i] - expected).length() < 0.13, "{i}: {} {}", turned[i], expected);
    }
    // Carried as a whole.
    let by =
        Pose::from_parts(Vector::new(1.0, 2.0, 3.0), Rotation::from_scaled_axis(Vector::new(0.0, 0.7, 0.9)));
    let mut body = DeformableBodyBuilder::rope(&points, 0.02).build().unwrap();
    body.teleport(by).unwrap();
    skin.update(&body, &mut positions, &mut turned).unwrap();
    for (i, (rest, _)) in tube.iter().enumerate() {
        assert!((positions[i] - by.transform_point(*rest)).length() < 1e-5, "{i}");
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    let body = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [1; 3]).build().unwrap();
    let other = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2; 3]).build().unwrap();
    let wrong = |vertices, expected| Err(BodyError::WrongSize { vertices, expected });
    let bind = |p: &[Vector], n: &[Vector]| DeformableSkin::bind(body.model(), p, n).map(drop);
    assert_eq!(bind(&[Vector::X; 3], &[Vector::Y; 2]), wrong(2, 3));
    assert!(matches!(bind(&[Vector::X * f32::NAN], &[Vector::Y]), Err(BodyError::NotFinite { .. })));
    let skin = DeformableSkin::bind(body.model(), &[Vector::X], &[Vector::ZERO]).unwrap();
    let (mut p, mut n) = ([Vector::ZERO; 1], [Vector::ONE; 1]);
    skin.update(&body, &mut p, &mut n).unwrap();
    assert!((p[0] - Vector::X).length() < 1e-6 && n[0] == Vector::ZERO);
    assert_eq!(skin.update(&other, &mut p, &mut n), wrong(27, 8));
    assert_eq!(skin.update(&body, &mut [], &mut n), wrong(0, 1));
}

#[test]
fn frames_between_steps_are_between_them() {
    let mut physics = PhysicsWorld::new();
    let mut world = DeformableWorld::new();
    let body =
        world.insert(DeformableBodyBuilder::cuboid(Vector::splat(0.1), [1; 3]).linvel(Vector::X)).unwrap();
    let all = |body: &DeformableBody| body.positions().collect::<Vec<_>>();
    let first = all(&world.bodies[body]);
    assert_eq!(world.bodies[body].positions_between(0.5), first, "before the first step");
    world.step(&mut physics);
    let second = all(&world.bodies[body]);
    assert_eq!(world.bodies[body].positions_between(0.0), first);
    assert_eq!(world.bodies[body].positions_between(1.0), second);
    let half = world.bodies[body].positions_between(0.5);
    for i in 0..8 {
        assert!((half[i] - (first[i] + second[i]) * 0.5).length() < 1e-7);
    }
    let skin = DeformableSkin::bind(world.bodies[body].model(), &[Vector::ZERO], &[Vector::Y]).unwrap();
    let (mut p, mut n) = ([Vector::ZERO; 1], [Vector::ZERO; 1]);
    skin.update_interpolated(&world.bodies[body], 0.5, &mut p, &mut n).unwrap();
    let middle = half.iter().sum::<Vector>() / 8.0;
    assert!((p[0] - middle).length() < 1e-6);
    // What is put somewhere is there at once.
    world.bodies[body].teleport(Pose::from_translation(Vector::Y * 9.0)).unwrap();
    assert_eq!(world.bodies[body].positions_between(0.0), all(&world.bodies[body]));
}

#[test]
fn geometry_is_read_in_the_order_of_the_users_vertices() {
    let mesh = TetMesh::cuboid([0.2, 0.3, 0.4], [2, 3, 4]).unwrap();
    let body = DeformableBodyBuilder::mesh(&mesh).build().unwrap();
    let sorted = |tets: Vec<[u32; 4]>| {
        let mut tets: Vec<[u32; 4]> = tets
            .into_iter()
            .map(|mut t| {
                t.sort_unstable();
                t
            })
            .collect();
        tets.sort_unstable();
        tets
    };
    assert_eq!(sorted(body.model().tetrahedra().collect()), sorted(mesh.tetrahedra().to_vec()));
    let normals = body.normals();
    for (p, n) in body.positions().zip(&normals) {
        let half = [0.2f32, 0.3, 0.4];
        let out =
            Vector::from([0, 1, 2].map(|k| if p[k].abs() > half[k] - 1e-6 { p[k].signum() } else { 0.0 }));
        match out == Vector::ZERO {
            true => assert_eq!(*n, Vector::ZERO),
            // On edges and corners somewhere between the faces.
            false => assert!(n.dot(out) > 0.5 && (n.length() - 1.0).abs() < 1e-5, "{p} {n}"),
        }
    }
}

/// Rims, hems and curved sheets, at rest: nothing is moved, and every normal is kept.
#[test]
fn skins_of_sheets_are_where_they_were_bound() {
    let check = |name: &str, body: &DeformableBody, skin: &[(Vector, Vector)]| {
        let vertices: Vec<Vector> = skin.iter().map(|(p, _)| *p).collect();
        let normals: Vec<Vector> = skin.iter().map(|(_, n)| *n).collect();
        let bound = DeformableSkin::bind(body.model(), &vertices, &normals).unwrap();
        let (mut positions, mut turned) = (vertices.clone(), normals.clone());
        bound.update(body, &mut positions, &mut turned).unwrap();
        for i in 0..skin.len() {
            assert!(
                (positions[i] - vertices[i]).length() < 1e-5,
                "{name} {i}: {} {}",
                positions[i],
                vertices[i]
            );
            assert!((turned[i] - normals[i]).length() < 1e-4, "{name} {i}: {} {}", turned[i], normals[i]);
        }
    };
    let flat = DeformableBodyBuilder::cloth([0.5, 0.4], [5, 4], 0.02).build().unwrap();
    let rim = [
        (Vector::new(0.55, 0.0, 0.0), Vector::X),
        (Vector::new(0.51, 0.01, 0.1), Vector::new(0.6, 0.8, 0.0)),
        (Vector::new(0.1, 0.01, 0.1), Vector::ZERO),
        (Vector::new(-0.3, -0.01, 0.41), -Vector::Y),
    ];
    check("flat", &flat, &rim);
    // A dome of 0.5 m, and a skin 5 cm off.
    let (vertices, triangles) = Ball::new(0.5).to_trimesh(24, 24);
    let places = vertices.iter().map(|v| v.to_array().map(f64::from)).collect();
    let dome = Structure::sheet(places, &triangles, 0.002).unwrap();
    let dome = DeformableBodyBuilder::structure(&dome).build().unwrap();
    let (outer, _) = Ball::new(0.55).to_trimesh(40, 40);
    let outer: Vec<(Vector, Vector)> = outer.iter().map(|v| (*v, v.normalize())).collect();
    check("dome", &dome, &outer);
}

/// However far from a solid, a vertex goes with what is nearest.
#[test]
fn far_vertices_go_with_the_nearest_part_and_bind_as_fast() {
    let mut body = DeformableBodyBuilder::cuboid(Vector::new(1.0, 0.1, 0.1), [20, 2, 2]).build().unwrap();
    let far: Vec<Vector> =
        (0..200).map(|k| Vector::new(-1.0 + 0.01 * k as f32, 0.4 + 0.1 * (k % 30) as f32, 0.0)).collect();
    let skin = DeformableSkin::bind(body.model(), &far, &vec![Vector::Y; 200]).unwrap();
    // Only the half beyond x = 0 rises.
    move_by(&mut body, |[x, y, z]| if x > 1e-9 { [x, y + 1.0, z] } else { [x, y, z] });
    let (mut positions, mut normals) = (far.clone(), far.clone());
    skin.update(&body, &mut positions, &mut normals).unwrap();
    for (p, rest) in positions.iter().zip(&far).filter(|(_, rest)| rest.x < -0.11 || rest.x > 0.11) {
        let expected = if rest.x > 0.0 { *rest + Vector::Y } else { *rest };
        assert!((*p - expected).length() < 1e-4, "{rest} {p}");
    }
    let body = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [1; 3]).build().unwrap();
    let skin = DeformableSkin::bind(body.model(), &[Vector::X * 1e15], &[Vector::X]).unwrap();
    assert_eq!(skin.vertex_count(), 1);
}

/// Volume within triangles that are wound outward \[m³\].
fn volume(mesh: &DeformableSurfaceMesh) -> f32 {
    let corners = |t: &[u32; 3]| t.map(|v| mesh.vertices[v as usize]);
    mesh.triangles.iter().map(corners).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
}

#[test]
fn surface_meshes_are_closed_and_outward() {
    let points: Vec<Vector> =
        (0..=20).map(|k| Vector::new(0.05 * k as f32, 0.0, (0.2 * k as f32).sin() * 0.1)).collect();
    let rope = DeformableBodyBuilder::rope(&points, 0.02).build().unwrap();
    let length: f32 = points.windows(2).map(|ends| (ends[1] - ends[0]).length()).sum();
    // A polygon of ten sides has 0.935 of its circle's area; and bends cut corners.
    let tube = 0.935 * std::f32::consts::PI * 0.02 * 0.02 * length;
    let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.5), [3, 2, 2]).build().unwrap();
    let ball = DeformableBodyBuilder::filled(&Ball::new(0.5), 0.125).build().unwrap();
    let cloth = DeformableBodyBuilder::cloth([0.5, 0.4], [5, 4], 0.02).build().unwrap();
    let inside = ball.model().volume() as f32;
    for (body, expected, tolerance) in
        [(rope, tube, 0.03), (cube, 1.0, 1e-5), (ball, inside, 1e-4), (cloth, 0.016, 1e-4)]
    {
        let mesh = DeformableSurfaceMesh::new(body.model());
        assert!((volume(&mesh) / expected - 1.0).abs() < tolerance, "{} of {expected}", volume(&mesh));
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|v| mesh.vertices[v as usize]);
            let normal = (b - a).cross(c - a).normalize();
            let least = triangle.iter().map(|v| mesh.normals[*v as usize].dot(normal)).fold(1.0, f32::min);
            assert!(least > 0.7, "{least}");
        }
        // At rest a skin is where the mesh is.
        let skin = DeformableSkin::bind(body.model(), &mesh.vertices, &mesh.normals).unwrap();
        let (mut positions, mut normals) = (mesh.vertices.clone(), mesh.normals.clone());
        skin.update(&body, &mut positions, &mut normals).unwrap();
        for i in 0..positions.len() {
            assert!(
                (positions[i] - mesh.vertices[i]).length() < 1e-5,
                "{} {}",
                positions[i],
                mesh.vertices[i]
            );
            assert!((normals[i] - mesh.normals[i]).length() < 1e-3, "{} {}", normals[i], mesh.normals[i]);
        }
    }
}
