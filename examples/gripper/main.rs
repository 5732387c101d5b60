//! Two jointed fingers with soft pads hold a box by friction: `cargo run --release --example gripper`.
//!
//! They close, lift it, hold it while the hand shakes by ±1 g, and let go. Prints grip force, slip and lift.

mod scene;

use scene::{Gripper, Setup};

const RATE: f32 = 60.0;

fn main() {
    // Lifting against gravity and 1 g of shaking takes m·(g + 1 g)/(2 μ) = 19.6 N.
    let setup = Setup { squeeze: 30.0, mass: 0.5, friction: 0.5, stiffness: 3e5 };
    let mut gripper = Gripper::new(setup);
    for _ in 0..60 {
        gripper.step(0.0, 0.0);
    }
    let [left, right] = gripper.grip();
    println!("closed: the pads press with {left:.3} N and {right:.3} N, the motors with {} N", setup.squeeze);
    // A smooth lift of 0.2 m in a second.
    for step in 1..=60 {
        let t = step as f32 / 60.0;
        gripper.step(0.2 * t * t * (3.0 - 2.0 * t), 0.0);
    }
    println!("lifted: the box is {:.4} m above the floor", gripper.load_height());
    let before = gripper.load_in_hand();
    // ±1 g at 2 Hz to the side.
    let omega = 2.0 * std::f32::consts::PI * 2.0;
    let (mut slip, mut slowest) = (0.0f32, 0.0f64);
    for step in 1..=600 {
        let t = step as f32 / RATE;
        // Begins at rest.
        let amplitude = 9.81 / (omega * omega) * (t / 0.5).min(1.0);
        gripper.step(0.2, amplitude * (omega * t).sin());
        slip = slip.max((gripper.load_in_hand() - before).length());
        slowest = slowest.max(gripper.world.counters().total_time().as_secs_f64() * 1e3);
    }
    for _ in 0..60 {
        gripper.step(0.2, 0.0);
    }
    let left_over = (gripper.load_in_hand() - before).length();
    println!(
        "held for ten seconds of shaking: moved by {:.3} mm at most, {:.4} mm after it",
        slip * 1e3,
        left_over * 1e3
    );
    println!("slowest step {slowest:.1} ms");
    gripper.open();
    for _ in 0..60 {
        gripper.step(0.2, 0.0);
    }
    println!("let go: the box is {:.4} m above the floor", gripper.load_height());
}
