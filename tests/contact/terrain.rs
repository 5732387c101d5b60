//! Bodies on meshes finer than they are themselves, of which any vertex might carry.
use foible3d::prelude::*;
use rapier3d::prelude::*;

const WIDE: f32 = 0.8;

/// Hills 4 cm high, of squares of 1 cm.
fn hills() -> (Vec<Vector>, Vec<[u32; 3]>) {
    const CELLS: u32 = 80;
    let n = CELLS + 1;
    let at = |i: u32| (i as f32 / CELLS as f32 - 0.5) * WIDE;
    let point = |k: u32| {
        let (x, z) = (at(k / n), at(k % n));
        Vector::new(x, 0.02 * (20.0 * x).sin() * (17.0 * z).cos(), z)
    };
    let squares = (0..CELLS * CELLS).map(|k| k / CELLS * n + k % CELLS);
    let faces = squares.flat_map(|a| [[a, a + 1, a + n], [a + 1, a + n + 1, a + n]]);
    ((0..n * n).map(point).collect(), faces.collect())
}

/// How far the highest of some points is above a triangle, looking straight up, if it is over it \[m\].
fn highest_above(points: &[Vector], [a, b, c]: [Vector; 3]) -> f32 {
    let normal = (b - a).cross(c - a);
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    let is_near = |p: &&Vector| p.x >= low.x && p.x <= high.x && p.z >= low.z && p.z <= high.z;
    let height = |p: &Vector| {
        let inside =
            [(a, b), (b, c), (c, a)].map(|(u, v)| (v.x - u.x) * (p.z - u.z) - (v.z - u.z) * (p.x - u.x));
        let is_over = inside.iter().all(|s| *s >= 0.0) || inside.iter().all(|s| *s <= 0.0);
        // Along the normal: flanks would be deep looking up.
        (is_over && normal.y != 0.0).then(|| normal.dot(*p - a) / normal.length() * normal.y.signum())
    };
    points.iter().filter(is_near).filter_map(height).fold(f32::NEG_INFINITY, f32::max)
}

/// What lands there has few contacts for each of its vertices, and comes to rest above every vertex of the ground.
#[test]
fn what_lies_on_fine_hills_is_above_all_of_them() {
    const HALF: f32 = 0.003;
    let material = |e| DeformableMaterial::new(e, 0.3).friction(0.5).mass_damping(2.0);
    let cloth = DeformableBodyBuilder::cloth([0.25, 0.25], [10, 10], 2.0 * HALF).material(material(1e5));
    let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.15), [6; 3]).material(material(1e5));
    for (name, body, skin) in [("cloth", cloth, HALF), ("cube", cube, 0.0)] {
        let (points, faces) = hills();
        let mut physics = PhysicsWorld::new();
        let ground = ColliderBuilder::trimesh(points.clone(), faces).unwrap();
        physics.insert(RigidBodyBuilder::fixed(), ground);
        let mut world = DeformableWorld::new();
        let body = world.insert(body.translation(Vector::new(0.013, 0.25, 0.007)).can_sleep(false)).unwrap();
        let mut most = 0;
        for _ in 0..200 {
            world.step(&mut physics);
            most = most.max(world.counters().contacts);
        }
        let at: Vec<Vector> = world.bodies[body].positions().collect();
        let model = world.bodies[body].model();
        let triangles: Vec<[Vector; 3]> =
            model.surface_triangles().map(|t| t.map(|n| at[n as usize])).collect();
        // Of a solid those that look down.
        let looks_down = |[a, b, c]: &&[Vector; 3]| skin > 0.0 || (*b - *a).cross(*c - *a).y < 0.0;
        let above = triangles.iter().filter(looks_down).map(|t| highest_above(&points, *t));
        let deepest = skin + above.fold(f32::NEG_INFINITY, f32::max);
        let nodes = if skin > 0.0 { at.len() } else { 7 * 7 * 7 - 5 * 5 * 5 };
        println!("{name}: at most {most} contacts, ground {:.1e} m deep in it at the end", deepest);
        assert!(most < 12 * nodes, "{name}: {most} contacts of {nodes} nodes of its surface");
        assert!(deepest.abs() < 2e-4, "{name}: {deepest} m deep");
    }
}
