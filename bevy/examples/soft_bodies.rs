//! A soft ball and a jelly cube with a box on it, a cloth over a rigid ball, and a rope with a weight:
//! `cargo run --release --ignore-rust-version --features window --example soft_bodies`. Space throws a ball, G shows what the
//! solver sees. With the name of a PNG file it writes a picture after three seconds and ends.

use bevy::prelude::*;
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured, save_to_disk};
use bevy_foible3d::prelude::*;
use bevy_rapier3d::prelude::*;

fn main() {
    let window = Window { title: "foible3d".into(), resolution: (1280, 720).into(), ..default() };
    App::new()
        .insert_resource(ClearColor(Color::srgb(0.93, 0.94, 0.96)))
        .insert_resource(TimestepMode::Fixed { dt: 1.0 / 60.0, substeps: 1 })
        .add_plugins((
            DefaultPlugins.set(WindowPlugin { primary_window: Some(window), ..default() }),
            RapierPhysicsPlugin::<NoUserData>::default(),
            DeformablePhysicsPlugin::<NoUserData>::default(),
            DeformableDebugRenderPlugin,
        ))
        .insert_resource(DeformableDebugRenderSettings { enabled: false, ..default() })
        .add_systems(Startup, (light, scene))
        .add_systems(Update, (throw, toggle_lines, picture))
        .run();
}

fn light(mut commands: Commands) {
    let eye = Transform::from_xyz(-0.7, 1.7, 4.3).looking_at(Vec3::new(0.35, 0.55, 0.0), Vec3::Y);
    commands.spawn((Camera3d::default(), Msaa::Sample4, eye));
    let sun = DirectionalLight { shadow_maps_enabled: true, illuminance: 9_000.0, ..default() };
    commands.spawn((sun, Transform::from_xyz(2.0, 6.0, 4.0).looking_at(Vec3::ZERO, Vec3::Y)));
    commands.insert_resource(GlobalAmbientLight { brightness: 350.0, ..default() });
}

/// What is drawn, and its colour.
fn drawn(
    meshes: &mut Assets<Mesh>,
    materials: &mut Assets<StandardMaterial>,
    mesh: impl Into<Mesh>,
    color: Srgba,
) -> (Mesh3d, MeshMaterial3d<StandardMaterial>) {
    (Mesh3d(meshes.add(mesh)), painted(materials, color))
}

fn painted(materials: &mut Assets<StandardMaterial>, color: Srgba) -> MeshMaterial3d<StandardMaterial> {
    MeshMaterial3d(materials.add(StandardMaterial {
        base_color: color.into(),
        perceptual_roughness: 0.6,
        ..default()
    }))
}

const GREY: Srgba = Srgba::rgb(0.62, 0.64, 0.68);
const RED: Srgba = Srgba::rgb(0.85, 0.28, 0.25);
const GREEN: Srgba = Srgba::rgb(0.35, 0.68, 0.42);
const BLUE: Srgba = Srgba::rgb(0.25, 0.45, 0.80);
const YELLOW: Srgba = Srgba::rgb(0.92, 0.73, 0.25);
const DARK: Srgba = Srgba::rgb(0.25, 0.26, 0.30);

fn scene(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let (meshes, materials) = (&mut *meshes, &mut *materials);
    let floor = drawn(meshes, materials, Cuboid::new(14.0, 0.2, 14.0), Srgba::rgb(0.80, 0.82, 0.85));
    commands.spawn((Collider::cuboid(7.0, 0.1, 7.0), Transform::from_xyz(0.0, -0.1, 0.0), floor));

    // A ball: the mesh that is drawn is filled with tetrahedra and becomes the body's skin.
    let rubber = DeformableMaterial::new(4.0e4, 0.45).density(300.0).mass_damping(1.0);
    let ball = drawn(meshes, materials, Sphere::new(0.4).mesh().uv(48, 32), RED);
    let filled = Deformable::filled_mesh(0.2).map(move |body| body.material(rubber));
    commands.spawn((filled, ball, Transform::from_xyz(-1.5, 1.2, 0.3)));

    // A cube of jelly, drawn as it is solved, with a rigid box on it.
    let jelly = DeformableMaterial::new(1.5e4, 0.45).density(500.0).mass_damping(2.0);
    let cube = DeformableBodyBuilder::cuboid(Vec3::new(0.4, 0.3, 0.4), [6, 4, 6]).material(jelly);
    let paint = painted(materials, GREEN);
    commands.spawn((Deformable::new(cube), DeformableMeshSync, paint, Transform::from_xyz(-0.3, 0.35, 0.6)));
    let weight = drawn(meshes, materials, Cuboid::from_length(0.36), GREY);
    let on_top = Transform::from_xyz(-0.3, 1.1, 0.6).with_rotation(Quat::from_rotation_y(0.4));
    let heavy = ColliderMassProperties::Density(1000.0);
    commands.spawn((RigidBody::Dynamic, Collider::cuboid(0.18, 0.18, 0.18), heavy, weight, on_top));
    commands.spawn((
        Collider::ball(0.4),
        Transform::from_xyz(1.0, 0.4, 0.0),
        drawn(meshes, materials, Sphere::new(0.395), GREY),
    ));

    // A cloth over a rigid ball.
    let cotton = DeformableMaterial::new(2.0e5, 0.3).density(400.0).mass_damping(2.0).friction(0.4);
    let cloth = DeformableBodyBuilder::cloth([0.75, 0.75], [20, 20], 0.003).material(cotton);
    let paint = painted(materials, BLUE);
    commands.spawn((Deformable::new(cloth), DeformableMeshSync, paint, Transform::from_xyz(1.0, 1.1, 0.0)));

    // A rope from a beam, with a weight at its end.
    let beam = drawn(meshes, materials, Cuboid::new(0.8, 0.08, 0.08), DARK);
    let beam =
        (RigidBody::Fixed, Collider::cuboid(0.4, 0.04, 0.04), beam, Transform::from_xyz(2.0, 1.5, -0.4));
    let beam = commands.spawn(beam).id();
    let weight = drawn(meshes, materials, Sphere::new(0.13), DARK);
    let heavy = ColliderMassProperties::Density(300.0);
    let weight =
        (RigidBody::Dynamic, Collider::ball(0.13), heavy, weight, Transform::from_xyz(2.9, 1.5, -0.4));
    let weight = commands.spawn(weight).id();
    let points: Vec<Vec3> = (0..=24).map(|k| Vec3::X * (0.9 * k as f32 / 24.0)).collect();
    let fibre = DeformableMaterial::new(1.0e6, 0.3).density(900.0).mass_damping(1.0);
    let rope = DeformableBodyBuilder::rope(&points, 0.012).material(fibre);
    let ends = DeformableAttachments(vec![
        DeformableAnchor::to_entity(beam, |x| x.x < 2.001),
        DeformableAnchor::to_entity(weight, |x| x.x > 2.899),
    ]);
    let paint = painted(materials, YELLOW);
    commands.spawn((
        Deformable::new(rope),
        ends,
        DeformableMeshSync,
        paint,
        Transform::from_xyz(2.0, 1.5, -0.4),
    ));
}

fn throw(
    keys: Res<ButtonInput<KeyCode>>,
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    if keys.just_pressed(KeyCode::Space) {
        let ball = drawn(&mut meshes, &mut materials, Sphere::new(0.12), GREY);
        let thrown = (RigidBody::Dynamic, Collider::ball(0.12), Velocity::linear(Vec3::new(0.0, 1.0, -7.0)));
        commands.spawn((thrown, ball, Transform::from_xyz(-0.3, 1.0, 4.0)));
    }
}

fn toggle_lines(keys: Res<ButtonInput<KeyCode>>, mut settings: ResMut<DeformableDebugRenderSettings>) {
    if keys.just_pressed(KeyCode::KeyG) {
        settings.enabled = !settings.enabled;
    }
}

/// Frames before the picture: three seconds.
const FRAMES: usize = 180;

fn picture(mut commands: Commands, mut frame: Local<usize>) {
    *frame += 1;
    let path = std::env::args().nth(1).filter(|path| path.ends_with(".png"));
    if let Some(path) = path.filter(|_| *frame == FRAMES) {
        let end = |_: On<ScreenshotCaptured>, mut exit: MessageWriter<AppExit>| {
            exit.write(AppExit::Success);
        };
        commands.spawn(Screenshot::primary_window()).observe(save_to_disk(path)).observe(end);
    }
}
