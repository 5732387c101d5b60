//! The gripper of the examples: how hard it must squeeze, and what slips.
#[path = "../../examples/gripper/scene.rs"]
mod scene;

use scene::{Gripper, Setup};

const SETUP: Setup = Setup { squeeze: 30.0, mass: 0.5, friction: 0.5, stiffness: 3e5 };

/// Closes and lifts slowly; tells whether the box came along.
fn lifts(squeeze: f32) -> bool {
    let mut gripper = Gripper::new(Setup { squeeze, ..SETUP });
    for _ in 0..90 {
        gripper.step(0.0, 0.0);
    }
    // 5 cm in three seconds: at most 0.04 m/s², less than half a percent of gravity.
    for step in 1..=180 {
        let t = step as f32 / 180.0;
        gripper.step(0.05 * t * t * (3.0 - 2.0 * t), 0.0);
    }
    for _ in 0..60 {
        gripper.step(0.05, 0.0);
    }
    gripper.load_height() > 0.045
}

#[test]
fn the_box_is_held_by_just_more_than_its_weight_over_twice_the_friction() {
    let needed = SETUP.mass * 9.81 / (2.0 * SETUP.friction);
    assert!(lifts(1.02 * needed));
    assert!(!lifts(0.98 * needed));
}

#[test]
fn what_is_held_does_not_slip_while_the_hand_shakes() {
    let mut gripper = Gripper::new(SETUP);
    for _ in 0..60 {
        gripper.step(0.0, 0.0);
    }
    let [left, right] = gripper.grip();
    assert!((left / SETUP.squeeze - 1.0).abs() < 1e-3 && (right / SETUP.squeeze - 1.0).abs() < 1e-3);
    for step in 1..=60 {
        let t = step as f32 / 60.0;
        gripper.step(0.2 * t * t * (3.0 - 2.0 * t), 0.0);
    }
    let before = gripper.load_in_hand();
    let omega = 2.0 * std::f32::consts::PI * 2.0;
    let mut moved = 0.0f32;
    for step in 1..=600 {
        let t = step as f32 / 60.0;
        let amplitude = 9.81 / (omega * omega) * (t / 0.5).min(1.0);
        gripper.step(0.2, amplitude * (omega * t).sin());
        moved = moved.max((gripper.load_in_hand() - before).length());
    }
    for _ in 0..60 {
        gripper.step(0.2, 0.0);
    }
    let slipped = (gripper.load_in_hand() - before).length();
    println!("moved by {moved} m at most, {slipped} m after it");
    assert!(moved < 1e-3, "{moved} m");
    assert!(slipped < 1e-4, "{slipped} m");
    gripper.open();
    for _ in 0..60 {
        gripper.step(0.2, 0.0);
    }
    // Rapier's own contacts hold it now: they give way a little.
    assert!(gripper.load_height() < 1e-3);
}
