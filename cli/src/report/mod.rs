//! What is told of runs: to a terminal, to build servers, and as pages for colleagues.

mod junit;
mod page;
mod plot;
mod sweep_page;
mod text;

pub use junit::to_xml;
pub use page::{PageOfRun, page_of_run};
pub use plot::{Line, lines};
pub use sweep_page::page_of_sweep;
pub use text::{of_drifts, of_run, of_sweep};
