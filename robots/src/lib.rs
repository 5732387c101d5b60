//! Robots from URDF and MJCF files, with soft parts: links and joints go into a rapier world through rapier's own loaders, soft
//! parts become deformable bodies of foible3d that are attached to the links.
//!
//! | module | what it holds |
//! |---|---|
//! | `error` | what can be wrong, with file, line and element |
//! | `xml` | elements and attributes with their places |
//! | `rigid` | links and joints of either kind of file, read and put into rapier's sets |
//! | `part` | soft parts: the TOML file, shapes, what is attached |
//! | `urdf`, `mjcf` | the two kinds of file, checked |
//! | `hooks` | which pairs of a soft part and a link do not touch |
//! | `robot`, `motor`, `passive` | links, joints and parts by name; motors, springs and damping |
//! | `saved` | robots as what is saved of them, feature `serde-serialize` |
//! | `builder` | the way in |
//!
//! What a file says and this package does not do is an error, or one of [`Robot::warnings`].

mod error;
mod xml;

mod rigid;

mod part;

mod mjcf;
mod urdf;

mod hooks;

mod actuator;
mod mimic;
mod motor;
mod passive;
mod robot;

#[cfg(feature = "serde-serialize")]
mod saved;

mod builder;

pub use actuator::RobotActuator;
pub use builder::{JointSolver, RobotBuilder};
pub use error::{Place, RobotError, Warning};
pub use hooks::RobotHooks;
pub use rigid::RobotJointHandle;
pub use robot::{Robot, RobotJoint, RobotLink, RobotPart};

/// The example of the README compiles and runs with the tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
