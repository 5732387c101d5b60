//! What a world of rigid and deformable bodies looked like: recorded over time, as a page with a player, and as pictures.
//!
//! A library of the command `foible` and of the Python package; scene files are not known here.
//!
//! | module | what it holds |
//! |---|---|
//! | `shapes` | triangles of colliders and of deformable bodies |
//! | `replay` | what is drawn, and the frames, taken between steps |
//! | `packed` | a replay as bytes that the player reads |
//! | `page` | HTML with the player, whole in one file |
//! | `picture` | pictures of a replay, drawn without a window |

mod packed;
mod page;
mod picture;
mod replay;
mod shapes;

pub use page::{PLAYER_SECTION, escaped, page, player_scripts};
pub use picture::{Film, Look};
pub use replay::{Replay, ReplayFrame, ReplayMesh, UpAxis};
