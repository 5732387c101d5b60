//! Ropes and sheets in hollows of one mesh, where a node lies on two of its faces.
use crate::common::gutter;
use foible3d::prelude::*;
use rapier3d::prelude::*;

const RADIUS: f64 = 0.01;

fn rope(z: f32, y: f32) -> DeformableBodyBuilder {
    let points: Vec<Vector> = (0..=16).map(|k| Vector::X * (0.025 * k as f32 - 0.2)).collect();
    let rope = DeformableBodyBuilder::rope(&points, RADIUS as f32);
    rope.material(DeformableMaterial::new(1e6, 0.3).friction(0.1)).translation(Vector::new(0.013, y, z))
}

/// Heights of the lowest and the highest vertex after so many seconds \[m\].
fn heights(collider: ColliderBuilder, body: DeformableBodyBuilder, dt: f32, seconds: f32) -> [f64; 2] {
    let mut physics = PhysicsWorld::new();
    physics.integration_parameters.dt = dt;
    physics.insert(RigidBodyBuilder::fixed(), collider);
    let mut world = DeformableWorld::new();
    let body = world.insert(body).unwrap();
    for _ in 0..(seconds / dt) as usize {
        world.step(&mut physics);
    }
    let heights = world.bodies[body].positions().map(|p| f64::from(p.y));
    heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], y| [low.min(y), high.max(y)])
}

/// It lies on both walls: its middle r / sin(α/2) above the bottom.
#[test]
fn ropes_lie_on_both_walls_of_gutters() {
    for degrees in [40.0_f64, 60.0, 90.0, 120.0] {
        for parts in [1, 37] {
            for dt in [1.0 / 240.0, 1.0 / 60.0, 1.0 / 30.0] {
                let angle = degrees.to_radians();
                let y = RADIUS / (0.5 * angle).sin();
                let body = rope(0.004, y as f32 + 0.1).linvel(Vector::Y * -1.4);
                let [low, high] = heights(gutter(angle, parts), body, dt, 3.0);
                println!("{degrees}°, {parts} strips, {dt:.4} s: {low:.5} to {high:.5} m, {y:.5}");
                let what = format!("{degrees}°, {parts} strips, {dt} s: {low} to {high} m, not {y}");
                assert!(low > 0.999 * y && high < 1.001 * y, "{what}");
            }
        }
    }
}

/// Of ropes and strips of cloth that come askew at 2 to 5 m/s some are caught in a wall, and none goes far through it.
#[test]
fn most_of_what_is_thrown_into_gutters_stays_in_them() {
    let (mut caught, mut lowest) = (0, f64::INFINITY);
    for k in 0..60 {
        let angle = [30.0_f64, 60.0, 90.0][k % 3].to_radians();
        let dt = [1.0 / 240.0, 1.0 / 60.0, 1.0 / 30.0][k / 3 % 3];
        let turn = |n: usize| ((k * n) % 13) as f32 / 13.0 - 0.5;
        let thin = match k % 2 {
            0 => rope(0.0, 0.0),
            _ => DeformableBodyBuilder::cloth([0.2, 0.03], [10, 2], 0.006)
                .material(DeformableMaterial::new(1e5, 0.3).friction(0.1)),
        };
        let thin = thin
            .rotation(Vector::new(turn(5), 0.3 * turn(7), 0.3 * turn(3)))
            .translation(Vector::new(0.0, 0.35, 0.05 * turn(11)))
            .linvel(Vector::new(turn(2), -5.0 * (0.5 + turn(4).abs()), turn(9)));
        let [low, _] = heights(gutter(angle, 5), thin, dt, 2.0);
        lowest = lowest.min(low);
        caught += usize::from(low < 0.0);
    }
    println!("{caught} of 60 caught, lowest vertex {lowest:.4} m above the bottom");
    assert!(caught <= 10 && lowest > -0.05, "{caught} caught, {lowest} m");
}

/// Over the edge of a box that is a mesh nothing stands in the way.
#[test]
fn cloths_slide_over_edges_of_meshes() {
    let cuboid = Cuboid::new(Vector::new(1.0, 5.0, 5.0)).to_trimesh();
    let mut physics = PhysicsWorld::new();
    let table =
        ColliderBuilder::trimesh(cuboid.0, cuboid.1).unwrap().friction(0.0).translation(Vector::Y * -5.0);
    physics.insert(RigidBodyBuilder::fixed(), table);
    let mut world = DeformableWorld::new();
    let cloth = DeformableBodyBuilder::cloth([0.2, 0.2], [10, 10], 0.001);
    let cloth = cloth
        .material(DeformableMaterial::new(1e5, 0.3).friction(0.0))
        .translation(Vector::new(0.7, 6e-4, 0.0));
    let cloth = world.insert(cloth.linvel(Vector::X)).unwrap();
    let mut last = 0.0;
    for step in 0..30 {
        world.step(&mut physics);
        let [x, ..] = world.bodies[cloth].center_of_mass();
        // Until half of it hangs over the edge, and draws it on.
        assert!(step == 0 || x - last > 0.9 / 60.0, "step {step}: {x} m, {last} m before");
        last = x;
    }
    assert!(last > 1.15, "{last}");
}

/// A channel along x, `width` \[m\] wide and 0.5 m deep, one mesh of three walls in `parts` strips along it.
fn channel(width: f64, parts: usize) -> ColliderBuilder {
    let (mut points, mut faces) = (Vec::new(), Vec::new());
    let z = 0.5 * width as f32;
    for k in 0..=parts {
        let x = 6.0 * k as f32 / parts as f32 - 3.0;
        points.extend([(0.5, -z), (0.0, -z), (0.0, z), (0.5, z)].map(|(y, z)| Vector::new(x, y, z)));
    }
    for k in 0..parts as u32 {
        for i in [4 * k, 4 * k + 1, 4 * k + 2] {
            faces.extend([[i, i + 1, i + 4], [i + 1, i + 5, i + 4]]);
        }
    }
    ColliderBuilder::trimesh(points, faces).unwrap().friction(0.1)
}

/// Ropes fall to the bottom of channels, wide ones and one that they just fit, and on the way they keep to their walls. Between two walls
/// nearer than the way that friction takes in a step, a tenth of it here, what is thrown aside is not tried: it hangs there.
#[test]
fn ropes_lie_at_the_bottom_of_channels() {
    for (width, speeds) in
        [(0.021, &[0.0][..]), (0.025, &[0.0, 1.0]), (0.04, &[0.0, 1.0]), (0.1, &[0.0, 1.0])]
    {
        for parts in [1, 37] {
            for dt in [1.0 / 240.0, 1.0 / 60.0, 1.0 / 30.0] {
                for &aside in speeds {
                    let clearance = 0.5 * width - RADIUS;
                    let body = rope(0.4 * clearance as f32, 0.3).linvel(Vector::new(0.0, -1.0, aside));
                    let mut physics = PhysicsWorld::new();
                    physics.integration_parameters.dt = dt;
                    physics.insert(RigidBodyBuilder::fixed(), channel(width, parts));
                    let mut world = DeformableWorld::new();
                    let body = world.insert(body).unwrap();
                    let mut widest: f64 = 0.0;
                    for _ in 0..(3.0 / dt) as usize {
                        world.step(&mut physics);
                        let aside = world.bodies[body].positions().map(|p| f64::from(p.z.abs()));
                        widest = aside.fold(widest, f64::max);
                    }
                    let what = format!("{width} m, {parts} strips, {dt} s, {aside} m/s");
                    let off = |p: Vector| (f64::from(p.y) / RADIUS - 1.0).abs();
                    let off = world.bodies[body].positions().map(off).fold(0.0, f64::max);
                    assert!(off < 1e-3, "{what}: off the bottom by {off} of its radius");
                    assert!(widest < clearance + 1e-5, "{what}: {widest} m aside of {clearance}");
                }
            }
        }
    }
}
