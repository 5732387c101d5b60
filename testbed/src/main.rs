//! Foible3d's scenes in rapier's testbed: `cargo run --release [-- FILE.toml …]`; without files, every scene in
//! `examples/scenes`.
//!
//! T runs and stops, S makes one step, R starts again. What is soft is dragged with the middle mouse button, or while D is
//! held; what is rigid with the left. With `--picture OUT.png SECONDS` the first scene is run for so long, written as a picture,
//! and the program ends.

mod drag;
mod drawn;

use drag::Drag;
use drawn::DrawnBodies;
use foible_cli::scene::SceneFile;
use foible_cli::stage::{self, Stage};
use rapier_testbed3d::{ExampleEntry, TestbedViewer};
use rapier3d::math::Vector;
use rapier3d::prelude::Aabb;
use std::path::{Path, PathBuf};

/// A picture to write of the first scene.
struct Picture {
    path: PathBuf,
    /// Of simulated time \[s\].
    after: f32,
}

#[kiss3d::main]
async fn main() {
    let (scenes, picture) = match arguments() {
        Ok(arguments) => arguments,
        Err(usage) => {
            eprintln!("{usage}");
            std::process::exit(2);
        }
    };
    let entries = scenes.iter().map(|(name, ..)| ExampleEntry::new("Scenes", name.clone().leak()));
    let mut viewer = TestbedViewer::new(entries.collect()).await;
    if let Some(picture) = picture {
        run(&mut viewer, &scenes[0], Some(&picture)).await;
        return;
    }
    while !viewer.quitting() {
        let selected = viewer.selected();
        run(&mut viewer, &scenes[selected], None).await;
    }
}

type NamedScene = (String, SceneFile);

fn arguments() -> Result<(Vec<NamedScene>, Option<Picture>), String> {
    let (mut files, mut picture) = (Vec::new(), None);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--picture" => {
                let path = arguments.next().ok_or("--picture needs a file")?.into();
                let after = arguments.next().and_then(|s| s.parse().ok()).ok_or("--picture needs seconds")?;
                picture = Some(Picture { path, after });
            }
            option if option.starts_with('-') => {
                return Err("usage: foible3d_testbed [--picture OUT.png SECONDS] [FILE.toml …]".into());
            }
            path => files.push(PathBuf::from(path)),
        }
    }
    if files.is_empty() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/scenes");
        let entries = std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        files = entries.filter_map(|e| Some(e.ok()?.path())).collect();
        files.retain(|p| p.extension().is_some_and(|e| e == "toml"));
        files.sort();
    }
    let scenes: Result<Vec<_>, String> = files.into_iter().map(read).collect();
    let scenes = scenes?;
    if scenes.is_empty() { Err("there are no scenes".into()) } else { Ok((scenes, picture)) }
}

fn read(path: PathBuf) -> Result<NamedScene, String> {
    let file = SceneFile::read(&path, &[]).map_err(|error| format!("{}: {error}", path.display()))?;
    Ok((file.name.replace('_', " "), file))
}

/// Runs a scene until another is chosen, or its picture is written.
async fn run(viewer: &mut TestbedViewer, (name, file): &NamedScene, picture: Option<&Picture>) {
    let built = stage::build(&file.scene, &file.folder);
    let mut stage = match built {
        Ok(stage) => stage,
        Err(error) => {
            eprintln!("{name}: {error}");
            std::process::exit(1);
        }
    };
    // With it come the lights.
    viewer.clear_scene();
    viewer.set_world(&mut stage.physics);
    let seen = extent(&stage);
    let distance = 3.4 * seen.half_extents().length().max(0.1);
    viewer.look_at(seen.center() + Vector::new(0.9, 0.6, 1.4).normalize() * distance, seen.center());
    let mut bodies = DrawnBodies::new(&stage.world, viewer.graphics_mut().scene_mut());
    let mut drag = Drag::default();
    let dt = stage.physics.integration_parameters.dt;
    let mut time = 0.0;
    while viewer.render_frame(&mut stage.physics).await {
        drag.update(viewer, &mut stage.world);
        if viewer.simulating() || picture.is_some() {
            stage::drive(&file.scene, &mut stage, time, dt);
            stage.world.step(&mut stage.physics);
            time += dt;
        }
        bodies.write(&stage.world);
        if let Some(picture) = picture.filter(|picture| time >= picture.after) {
            // What has been written is drawn in the next frame.
            viewer.render_frame(&mut stage.physics).await;
            if let Err(error) = viewer.window().snap_image().save(&picture.path) {
                eprintln!("{}: {error}", picture.path.display());
                std::process::exit(1);
            }
            return;
        }
    }
}

/// A box around what is soft, and the rigid things about its size.
fn extent(stage: &Stage) -> Aabb {
    let soft = stage.world.bodies.iter().map(|(_, body)| body.aabb());
    let soft = soft.reduce(|a, b| Aabb::new(a.mins.min(b.mins), a.maxs.max(b.maxs)));
    let soft = soft.unwrap_or_else(|| Aabb::new(-Vector::ONE, Vector::ONE));
    let small = stage.physics.colliders.iter().map(|(_, collider)| collider.compute_aabb());
    let small =
        small.filter(|b| b.extents().is_finite() && b.extents().length() < 3.0 * soft.extents().length());
    small.fold(soft, |a, b| Aabb::new(a.mins.min(b.mins), a.maxs.max(b.maxs)))
}
