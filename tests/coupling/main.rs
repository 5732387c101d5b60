//! Across the border to rapier: attachments, joints, multibodies, rigid regions, loads.

#[path = "../common/mod.rs"]
mod common;

mod attachments;
mod changing_floors;
mod control;
mod drag;
mod forces;
mod grabbing;
mod gripper;
mod hinges;
mod joints;
mod kinematics;
mod light_links;
mod momentum;
mod multibodies;
mod query_colliders;
mod rigid_region_throws;
mod rigid_regions;
mod wheels;
