//! Many cases of a scene: what they are, running them side by side, and the table of what they come to.

mod cases;
mod columns;
mod jobs;
mod table;

pub use cases::{Case, cases};
pub use jobs::{Done, Job, JobOptions, finished, jobs, read, run_jobs};
pub use table::{Row, Summary, Table};
