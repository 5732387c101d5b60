//! The step, told as a list of verbs.
//!
//! ```text
//! read_obstacles → sense → wake → predict → detect → detect_soft_pairs → attach → walk_neighbourhood →
//! choose_integration_order → prepare_factors → form_islands → solve → stop_tunnelling → carry_attached → advance → fall_asleep →
//! tell_events → hand over reactions → (rapier steps) → after_step
//! ```

mod quarantine;
mod tunnelling;

mod island_work;
mod work;

mod events;
mod islands;
mod readout;
mod sleeping;
mod soft_pairs;

mod scratch;

mod carry;
mod detect;
mod factors;
mod finish;
mod solve;
mod solved;

mod run;

pub(super) use scratch::StepScratch;
pub(crate) use solved::{SolvedBody, SolvedContact};
