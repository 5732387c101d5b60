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
pub const DETECTION: &str = "detection over step";
pub const ERROR: &str = "largest error of contact forces";
pub const THREADS: &str = "one thread over two, on the wall";
pub const ASLEEP: &str = "asleep after, s";
pub const TOUCH: &str = "touch over rest";
pub const BYTES: &str = "peak bytes over twice factor and state";
pub const AGAIN: &str = "rollback over a settled step";
pub const LATE: &str = "rollback with a late input over a settled step";
pub const TO_CONSTANT: &str = "mean over that of constant steps";
pub const TYPICAL: &str = "worst over median, of the middle scene";
pub const EXTREME: &str = "worst over median, of the worst scene";
pub const NEWTON_STEPS: &str = "most Newton steps in a step";

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

const CLAIMS: &[Claim] = &[
    claim("heap of 16 cubes", MEAN, 0.24),
    claim("heap of 16 cubes", WORST, 0.33),
    claim("heap of 16 cubes", WORST_TO_SETTLED, 4.4),
    claim("heap of 16 cubes", ASLEEP, 2.1),
    claim("heap of 16 cubes", DETECTION, 0.22),
    claim("heap of 48 cubes", MEAN, 0.22),
    claim("heap of 48 cubes", WORST, 0.22),
    claim("heap of 48 cubes", WORST_TO_SETTLED, 2.3),
    claim("heap of 48 cubes", DETECTION, 0.23),
    claim("heap of 48 cubes", THREADS, 1.4),
    claim("heap of 100 cubes", MEAN, 0.26),
    claim("heap of 100 cubes", WORST, 0.36),
    claim("heap of 200 cubes", MEAN, 0.30),
    claim("heap of 200 cubes", WORST, 0.55),
    claim("heap of 200 cubes", ERROR, 0.02),
    claim("cloth on terrain of 100 mm", MEAN, 1.9),
    claim("cloth on terrain of 33 mm", MEAN, 0.6),
    claim("cloth on terrain of 10 mm", MEAN, 0.13),
    claim("cloth on terrain of 10 mm", WORST, 0.1),
    claim("rope on terrain of 10 mm", MEAN, 0.55),
    claim("cube on terrain of 33 mm", MEAN, 0.07),
    claim("cube on terrain of 10 mm", WORST, 0.05),
    claim("pinch at 5 m/s", WORST_TO_SETTLED, 43.0),
    claim("first touch, 13720 tets", TOUCH, 6.2),
    claim("first touch, 13720 tets", BYTES, 0.5),
    claim("first touch, 34295 tets", TOUCH, 7.1),
    claim("first touch, 34295 tets", BYTES, 0.5),
    claim("slab of 289 contacts, 2560 tets", TOUCH, 9.3),
    claim("slab of 289 contacts, 2560 tets", BYTES, 0.5),
    claim("slab of 1024 contacts, 9610 tets", TOUCH, 7.9),
    claim("slab of 1024 contacts, 9610 tets", MEAN, 0.20),
    claim("slab of 1024 contacts, 9610 tets", BYTES, 0.5),
    claim("slab of 2116 contacts, 20250 tets", TOUCH, 9.8),
    claim("slab of 2116 contacts, 20250 tets", MEAN, 0.27),
    claim("slab of 2116 contacts, 20250 tets", BYTES, 0.5),
    claim("swings, 1/144 and 1/30 s", TO_CONSTANT, 1.3),
    claim("swings, 1/144 to 1/30 s", TO_CONSTANT, 1.8),
    claim("lands, 1/144 and 1/30 s", TO_CONSTANT, 1.4),
    claim("lands, 1/144 to 1/30 s", TO_CONSTANT, 2.2),
    claim("rollback of 8 frames", AGAIN, 8.5),
    claim("rollback of 8 frames", LATE, 103.0),
    claim("level", MEAN, 0.33),
    claim("level", MEDIAN, 0.25),
    claim("level", P99, 0.44),
    claim("level", WORST, 0.6),
    claim("level", ASLEEP, 8.0),
    claim("30 random scenes", TYPICAL, 13.0),
    claim("30 random scenes", EXTREME, 130.0),
    claim("30 random scenes", NEWTON_STEPS, 820.0),
];

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
