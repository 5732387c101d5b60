//! What benches/README.md and CHANGELOG.md say of these scenes, held against what was measured.
//!
//! Ratios only, as machines differ; within a factor of three both ways, as they differ in their caches too, and as a
//! claim that has become much too modest is as wrong as one that has become false.

use crate::report::Measured;

/// What is measured of a scene.
pub const MEAN: &str = "mean over rapier's";
pub const WORST: &str = "worst over rapier's";
pub const MEDIAN: &str = "median over rapier's";
pub const P99: &str = "99 % over rapier's";
pub const WORST_TO_SETTLED: &str = "worst over settled";
pub const ASLEEP: &str = "asleep after, s";
pub const TOUCH: &str = "touch over rest";
pub const BYTES: &str = "peak bytes over twice factor and state";
pub const AGAIN: &str = "rollback over a settled step";
pub const LATE: &str = "rollback with a late input over a settled step";
pub const TO_CONSTANT: &str = "mean over that of constant steps";
pub const TYPICAL: &str = "worst over median, of the middle scene";
pub const EXTREME: &str = "worst over median, of the worst scene";

/// How far a measurement may be from what is claimed.
const FACTOR: f64 = 3.0;

struct Claim {
    scene: &'static str,
    what: &'static str,
    value: f64,
}

const fn claim(scene: &'static str, what: &'static str, value: f64) -> Claim {
    Claim { scene, what, value }
}

const CLAIMS: &[Claim] = &[claim("heap of 48 cubes", MEAN, 0.8)];

/// Those that this run has measured, and that do not hold in it.
pub fn broken(measured: &[Measured]) -> Vec<String> {
    let mut broken = Vec::new();
    let mut held = 0;
    for m in measured {
        for c in CLAIMS.iter().filter(|c| c.scene == m.scene && c.what == m.what) {
            // NaN and what never came to be are not within.
            let within = (m.value / c.value).ln().abs() <= FACTOR.ln();
            held += usize::from(within);
            if !within {
                broken.push(format!("{}, {}: {:.3}, claimed {}", c.scene, c.what, m.value, c.value));
            }
        }
    }
    println!(
        "claims: {held} held, {} did not, {} not measured",
        broken.len(),
        CLAIMS.len() - held - broken.len()
    );
    broken
}
