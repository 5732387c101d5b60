//! Touch as sensors report it, read after a step: pressure and shear by taxels, markers on the skin of a pad, its image from inside, and
//! what one body does to another. What is not read costs nothing.

mod depth_camera;
mod pad;
mod taxels;
mod wrench;

pub use depth_camera::DepthCamera;
pub use pad::{TactilePad, TactileReading};
pub use wrench::ContactWrench;
