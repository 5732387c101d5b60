//! What runs are differentiated with respect to.

use super::{Outcome, Pull, Run};
use foible3d::prelude::*;

/// A number that a run depends on, with what its difference is to be and the tape's derivative.
#[derive(Clone, Copy)]
pub struct Parameter {
    pub name: &'static str,
    pub by: f64,
    pub change: fn(&mut Run, f64),
    pub of: fn(&DeformableGradient, &Outcome) -> f64,
}

pub const MATERIAL: [Parameter; 4] = [
    Parameter {
        name: "Young's modulus",
        by: 64.0,
        change: |run, d| run.material.youngs_modulus += d,
        of: |g, _| g.material().youngs_modulus,
    },
    Parameter {
        name: "Poisson's ratio",
        by: 1e-3,
        change: |run, d| run.material.poisson_ratio += d,
        of: |g, _| g.material().poisson_ratio,
    },
    Parameter {
        name: "density",
        by: 1.0,
        change: |run, d| run.material.density += d,
        of: |g, _| g.material().density,
    },
    Parameter {
        name: "mass damping",
        by: 0.01,
        change: |run, d| run.material.mass_damping += d,
        of: |g, _| g.material().mass_damping,
    },
];

pub const LOADS: [Parameter; 4] = [
    Parameter {
        name: "gravity",
        by: 0.0078125,
        change: |run, d| run.gravity += d,
        of: |g, _| g.gravity()[1],
    },
    Parameter {
        name: "force",
        by: 0.0078125,
        change: |run, d| run.push += d,
        of: |g, out| g.forces()[out.tip][2],
    },
    Parameter {
        name: "initial velocity",
        by: 0.0078125,
        change: |run, d| run.throw += d,
        of: |g, out| g.initial_velocities[out.tip][1],
    },
    Parameter {
        name: "initial position",
        by: 0.00006103515625,
        change: |run, d| run.place += d,
        of: |g, out| g.initial_positions[out.tip][2],
    },
];

pub const PINS: Parameter = Parameter {
    name: "pins",
    by: 0.0078125,
    change: |run, d| run.lead += d,
    of: |g, out| {
        let led = |(k, step): (usize, &StepGradient)| {
            (k + 1) as f64 * out.h * step.pin_targets.iter().map(|target| target[2]).sum::<f64>()
        };
        g.steps.iter().enumerate().map(led).sum()
    },
};

pub const TENSION: Parameter = Parameter {
    name: "tension",
    by: 0.0078125,
    change: |run, d| match run.pull.as_mut().unwrap() {
        Pull::Tension(tension) => *tension += d,
        Pull::Length(..) | Pull::AsItIs(_) => unreachable!(),
    },
    of: |g, out| g.cable(out.cable.unwrap()).tension,
};

pub const LENGTH: Parameter = Parameter {
    name: "length",
    by: 0.00006103515625,
    change: |run, d| match run.pull.as_mut().unwrap() {
        Pull::Length(length, _) => *length += d,
        Pull::Tension(_) | Pull::AsItIs(_) => unreachable!(),
    },
    of: |g, out| g.cable(out.cable.unwrap()).length,
};

pub const ACTIVATION: Parameter = Parameter {
    name: "activation",
    by: 1e-3,
    change: |run, d| run.activation += d,
    of: |g, _| g.activation(),
};

pub const LAUNCH: Parameter = Parameter {
    name: "launch",
    by: 0.0078125,
    change: |run, d| run.launch[0] += d,
    of: |g, _| g.initial_velocities.iter().map(|v| v[0]).sum(),
};

pub const FRICTION: Parameter = Parameter {
    name: "friction",
    by: 0.0009765625,
    change: |run, d| run.friction += d,
    of: |g, _| g.friction,
};

pub const DAMPING: Parameter = Parameter {
    name: "stiffness damping",
    by: 1e-5,
    change: |run, d| run.material.stiffness_damping += d,
    of: |g, _| g.material().stiffness_damping,
};

/// Ratio and time of the first and of the second Maxwell branch.
pub const BRANCHES: [Parameter; 4] = [
    Parameter {
        name: "ratio",
        by: 1e-3,
        change: |run, d| run.material.maxwell_branches[0].ratio += d,
        of: |g, _| g.material().maxwell_ratios[0],
    },
    Parameter {
        name: "time",
        by: 1e-4,
        change: |run, d| run.material.maxwell_branches[0].time += d,
        of: |g, _| g.material().maxwell_times[0],
    },
    Parameter {
        name: "second ratio",
        by: 1e-3,
        change: |run, d| run.material.maxwell_branches[1].ratio += d,
        of: |g, _| g.material().maxwell_ratios[1],
    },
    Parameter {
        name: "second time",
        by: 1e-3,
        change: |run, d| run.material.maxwell_branches[1].time += d,
        of: |g, _| g.material().maxwell_times[1],
    },
];
