//! Scripted drop and stacking tests of soft and rigid bodies: the scene files of foible3d, their runner, sweeps and reports.
//!
//! The command is `foible`; everything that it does can be called from here.
//!
//! | module | what it holds |
//! |---|---|
//! | [`scene`] | the scene file, read and checked; parameters, units, includes |
//! | [`stage`] | a scene turned into a rapier world and a deformable one, and what is measured there |
//! | [`run`] | a run of a scene: steps, signals, verdicts, the replay |
//! | [`sweep`] | cases of a scene, run side by side, and their table |
//! | [`baseline`] | what a scene came to when it was found right |
//! | [`picture`] | pictures of a replay |
//! | [`report`] | text, JUnit, and pages |
//! | `command` | the arguments of `foible`, feature `command` |
//!
//! A module imports from those above it only. Data flows the same way: a scene file and what is set make a
//! [`SceneFile`](scene::SceneFile), a [`Run`](run::Run) of it leaves a folder with `outcome.json`, `trace.csv` and `replay.bin`, and
//! reports are made of such folders.

pub mod baseline;
#[cfg(feature = "command")]
pub mod command;
pub mod fit;
pub mod picture;
pub mod report;
pub mod run;
pub mod scene;
pub mod stage;
pub mod sweep;
