//! The preconditioner of the global step: `P = Q A⁻¹ Qᵀ` with rotating frames Q around the constant factor.
//!
//! One frame per node does not know that the whole body may be pushed without strain. That
//! mode is put back exactly: with masses m_i (total m), 1 the rigid translation,
//! `P = (I − 1mᵀ/m) P₀ (I − m1ᵀ/m) + h²/(1 + αh)/m · 11ᵀ`.
//!
//! Frames are rounded to about 10⁻⁶ rad. That costs no convergence to speak of, and at rest they
//! are the same bits in every step, so whatever was made from them can be used again.

use super::clusters::TurnedClusters;
use super::factor::FactorScratch;
use super::factor_cache::SystemFactor;
use super::low_rank::LowRank;
use super::rigid_mode::RigidMode;
use super::turned::solve_turned;
use crate::fem::{DeformableModel, SystemMatrix, node_rotations};
use crate::math::lanes::Lane;
use crate::math::{Mat3, Vec3, rounded_rotation};
use crate::profiler::Stopwatch;
use crate::solver::counters::SolveCounters;

/// Binary places of the frames' quaternions.
const FRAME_BITS: i32 = 20;

/// Frames of one body and what follows from them.
#[derive(Default)]
pub(crate) struct Preconditioner {
    kind: FrameKind,
    floating: Mat3,
    per_node: Vec<Mat3>,
    deflation: Deflation,
    rigid: RigidMode,
    /// What the matrix of another step lacks, or has too much, of how a free body moves rigidly.
    drift: RigidMode,
    drifts: bool,
    clusters: TurnedClusters,
    /// The clusters take part.
    turns: bool,
    low_rank: LowRank,
    rhs: Vec<Lane>,
    balanced: Vec<Vec3>,
    scratch: FactorScratch,
    /// Of the solves.
    pub counters: SolveCounters,
    /// Another one whenever P is.
    pub version: u64,
}

/// How the blocks of P follow from those of the inverse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum BlockForm {
    /// By one frame.
    OneFrame(Mat3),
    /// By the frames of both nodes, and what [`Preconditioner::deflated`] adds.
    NodeFrames,
    /// As [`Preconditioner::compliance`] says.
    Other,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum FrameKind {
    /// The Laplacian: the same in all directions.
    #[default]
    Isotropic,
    Floating,
    PerNode,
    /// None: the body keeps its shape.
    Rigid,
}

/// The translation mode of per-node frames.
#[derive(Default)]
struct Deflation {
    active: bool,
    /// `G_i = Σ_k P₀_ik m_k`.
    coupling: Vec<Mat3>,
    /// `Σ_i m_i G_i`.
    mean: Mat3,
    /// What they were made from: a factor's serial and frames.
    made_from: (Option<u64>, Vec<Mat3>),
    masses: Vec<f64>,
    total_mass: f64,
    /// h²/(1 + αh) [s²].
    mobility: f64,
    push: Vec<Vec3>,
    column: Vec<Vec3>,
}

impl Deflation {
    /// What is the same in all blocks; symmetric.
    fn rigid(&self) -> Mat3 {
        let mass = self.total_mass;
        self.mean / (mass * mass) + Mat3::from_diagonal_element(self.mobility / mass)
    }
}

impl Preconditioner {
    fn begin(&mut self, kind: FrameKind) {
        self.version += 1;
        self.kind = kind;
        self.turns = false;
        self.drifts = false;
        self.deflation.active = false;
        self.low_rank.clear();
    }

    /// The body keeps its shape.
    pub fn set_rigid(&mut self, x: &[Vec3], masses: &[f64], mobility: f64) {
        self.begin(FrameKind::Rigid);
        self.rigid.set(x, masses, mobility);
    }

    /// The scalar matrix: no frames.
    pub fn set_isotropic(&mut self) {
        self.begin(FrameKind::Isotropic);
        self.floating = Mat3::identity();
    }

    /// One frame for the body.
    pub fn set_floating(&mut self, rotation: &Mat3) {
        self.begin(FrameKind::Floating);
        self.floating = rounded_rotation(rotation, FRAME_BITS);
    }

    /// Lets the clusters of the Laplacian turn along, if the factor has such, from where they are at `x`.
    pub fn set_clusters(&mut self, factor: &SystemFactor, x: &[Vec3]) {
        self.version += 1;
        let clusters = factor.clusters.as_ref();
        self.turns = clusters.is_some_and(|clusters| self.clusters.turn(clusters, x));
    }

    /// Turns the body's one frame to `rotation` if that differs by more than `angle` \[rad\]; true if so.
    pub fn turn_floating(&mut self, rotation: &Mat3, angle: f64) -> bool {
        if self.kind != FrameKind::Floating {
            return false;
        }
        // ‖R − Q‖ = 2√2 sin(θ/2).
        let differs = (rotation - self.floating).norm() > angle * std::f64::consts::SQRT_2;
        if differs {
            let (before, active, drifts) = (self.floating, self.deflation.active, self.drifts);
            self.set_floating(rotation);
            self.drifts = drifts;
            if active {
                let turn = self.floating * before.transpose();
                let d = &mut self.deflation;
                d.coupling.iter_mut().for_each(|g| *g = turn * *g * turn.transpose());
                d.mean = turn * d.mean * turn.transpose();
                // Turned numbers are not those that a fresh solve would give.
                d.made_from.0 = None;
                d.active = true;
            }
        }
        differs
    }

    /// Lets a free body with one frame move rigidly as in its own step, by the matrix of another: `mobilities`
    /// \[s²\] are `h²/(1 + αh)` of both. Matrices that resist no rotation of the shape at `rest` have that right too.
    pub fn correct_rigid_motion(
        &mut self,
        rest: &[Vec3],
        masses: &[f64],
        mobilities: [f64; 2],
        resists_rotation: bool,
    ) {
        self.version += 1;
        self.drift.set(rest, masses, mobilities[0] - mobilities[1]);
        if resists_rotation {
            self.drift.hold_rotation();
        }
        self.drifts = true;
    }

    /// One frame per node, of the elements at `x`; free bodies (without pins) get their
    /// translation mode back.
    pub fn set_per_node(
        &mut self,
        model: &DeformableModel,
        x: &[Vec3],
        masses: &[f64],
        mobility: f64,
        is_free: bool,
        factor: &SystemFactor,
    ) {
        self.begin(FrameKind::PerNode);
        self.per_node.resize(x.len(), Mat3::zeros());
        node_rotations(model, x, &mut self.per_node);
        self.per_node.iter_mut().for_each(|q| *q = rounded_rotation(q, FRAME_BITS));
        if is_free {
            self.deflate(masses, mobility, factor);
        }
    }

    /// Puts the translation mode back, of free bodies with frames per node or without a factor.
    pub fn deflate(&mut self, masses: &[f64], mobility: f64, factor: &SystemFactor) {
        self.version += 1;
        let frames = match self.kind {
            FrameKind::PerNode => &self.per_node[..],
            _ => std::slice::from_ref(&self.floating),
        };
        let (serial, before) = &self.deflation.made_from;
        if *serial == Some(factor.serial) && before == frames {
            self.deflation.active = true;
            // The factor may be that of another step.
            self.deflation.mobility = mobility;
            return;
        }
        let frames = frames.to_vec();
        let mut d = std::mem::take(&mut self.deflation);
        d.coupling.clear();
        d.coupling.resize(masses.len(), Mat3::zeros());
        d.column.resize(masses.len(), Vec3::zeros());
        for c in 0..3 {
            d.push.clear();
            d.push.extend(masses.iter().map(|m| Vec3::ith(c, *m)));
            self.rotate_and_solve(factor, &d.push, &mut d.column);
            for (g, v) in d.coupling.iter_mut().zip(&d.column) {
                g.set_column(c, v);
            }
        }
        let mean = d.coupling.iter().zip(masses).fold(Mat3::zeros(), |sum, (g, m)| sum + g * *m);
        d.mean = (mean + mean.transpose()) * 0.5;
        d.made_from = (Some(factor.serial), frames);
        d.active = true;
        d.masses.clear();
        d.masses.extend_from_slice(masses);
        d.total_mass = masses.iter().sum();
        d.mobility = mobility;
        self.deflation = d;
    }

    /// Begins anew with what single directions resist.
    pub fn clear_low_rank(&mut self) {
        self.version += 1;
        self.low_rank.clear();
    }

    /// Lets the direction `g` of forces be resisted by a stiffness.
    pub fn add_low_rank(&mut self, factor: &SystemFactor, g: &[Vec3], stiffness: f64) {
        let mut u = self.low_rank.room(g.len());
        self.apply(factor, g, &mut u);
        self.low_rank.push(g, u, stiffness);
    }

    /// `out = P r`: displacements \[m\] of forces \[N\].
    pub fn apply(&mut self, factor: &SystemFactor, r: &[Vec3], out: &mut [Vec3]) {
        self.apply_full_rank(factor, r, out);
        self.low_rank.take_off(r, out);
    }

    fn apply_full_rank(&mut self, factor: &SystemFactor, r: &[Vec3], out: &mut [Vec3]) {
        if self.is_rigid() {
            return self.rigid.apply(r, out);
        }
        if !self.deflation.active {
            self.rotate_and_solve(factor, r, out);
            if self.drifts {
                self.drift.add_turned(&self.floating, r, out);
            }
            if let Some(clusters) = factor.clusters.as_ref().filter(|_| self.turns) {
                self.clusters.add(clusters, r, out);
            }
            return;
        }
        let sum: Vec3 = r.iter().sum();
        let d = std::mem::take(&mut self.deflation);
        let acceleration = sum / d.total_mass;
        let mut balanced = std::mem::take(&mut self.balanced);
        balanced.clear();
        balanced.extend(r.iter().zip(&d.masses).map(|(r, m)| r - acceleration * *m));
        self.rotate_and_solve(factor, &balanced, out);
        self.balanced = balanced;
        let drift = out.iter().zip(&d.masses).fold(Vec3::zeros(), |a, (o, m)| a + o * *m) / d.total_mass;
        let shift = acceleration * d.mobility - drift;
        out.iter_mut().for_each(|o| *o += shift);
        self.deflation = d;
    }

    /// `out = Q A⁻¹ Qᵀ r`.
    fn rotate_and_solve(&mut self, factor: &SystemFactor, r: &[Vec3], out: &mut [Vec3]) {
        let mut clock = Stopwatch::start();
        let Self { rhs, scratch, .. } = self;
        match (factor.system, self.kind) {
            (SystemMatrix::Laplacian, _) => {
                solve_turned(factor, |_, v| v, |_, v| v, r, out, rhs, scratch);
            }
            (SystemMatrix::RestStiffness, FrameKind::PerNode) => {
                let frames = &self.per_node;
                solve_turned(factor, |i, v| frames[i].tr_mul(&v), |i, v| frames[i] * v, r, out, rhs, scratch);
            }
            (SystemMatrix::RestStiffness, _) => {
                let frame = &self.floating;
                solve_turned(factor, |_, v| frame.tr_mul(&v), |_, v| frame * v, r, out, rhs, scratch);
            }
        }
        self.counters.solves += 1;
        self.counters.solve_bytes += 2 * factor.factor.solve_bytes();
        self.counters.linear_time += clock.lap();
    }

    /// Whether the body moves as P without more than frames around the inverse: no rigid shape, no deflation, nothing of
    /// another step.
    pub fn is_framed(&self) -> bool {
        !self.is_rigid() && !self.deflation.active && !self.drifts && self.low_rank.is_empty()
    }

    /// Whether the body moves as a rigid one.
    pub fn is_rigid(&self) -> bool {
        self.kind == FrameKind::Rigid
    }

    /// The frame of a node.
    pub fn frame(&self, node: usize) -> Mat3 {
        match self.kind {
            FrameKind::Isotropic | FrameKind::Rigid => Mat3::identity(),
            FrameKind::Floating => self.floating,
            FrameKind::PerNode => self.per_node[node],
        }
    }

    /// The block of the inverse between two nodes in the frame of the matrix [m/N], by their `places` on the surface.
    /// Zero where the body moves as a rigid one, which takes no columns.
    pub fn inverse_block(&self, factor: &SystemFactor, places: [usize; 2], nodes: [usize; 2]) -> Mat3 {
        if self.is_rigid() {
            return Mat3::zeros();
        }
        let block = factor.columns.block(places[0], places[1]);
        if self.drifts { block + self.drift.compliance(nodes[0], nodes[1]) } else { block }
    }

    /// The block of P between two surface nodes, given the one of the inverse [m/N].
    pub fn compliance(&self, factor: &SystemFactor, inverse_block: &Mat3, i: usize, j: usize) -> Mat3 {
        if self.is_rigid() {
            return self.rigid.compliance(i, j);
        }
        let block = match self.kind {
            FrameKind::Isotropic if self.turns => match &factor.clusters {
                Some(clusters) => inverse_block + self.clusters.compliance(clusters, i, j),
                None => *inverse_block,
            },
            FrameKind::Isotropic => *inverse_block,
            _ => self.frame(i) * inverse_block * self.frame(j).transpose(),
        };
        let block = block - self.low_rank.compliance(i, j);
        let d = &self.deflation;
        if !d.active {
            return block;
        }
        block - (d.coupling[i] + d.coupling[j].transpose()) / d.total_mass + d.rigid()
    }

    /// How blocks of P are made.
    pub fn block_form(&self) -> BlockForm {
        match (self.one_frame(), self.kind) {
            (Some(frame), _) => BlockForm::OneFrame(frame),
            (None, FrameKind::PerNode) if self.low_rank.is_empty() => BlockForm::NodeFrames,
            _ => BlockForm::Other,
        }
    }

    /// What deflation adds to the block between nodes i and j is the sum of D_i and the transpose of D_j \[m/N\].
    pub fn deflated(&self, i: usize) -> Mat3 {
        let d = &self.deflation;
        if !d.active {
            return Mat3::zeros();
        }
        d.rigid() * 0.5 - d.coupling[i] / d.total_mass
    }

    /// The one frame of the body, if it has one and that is all there is to its blocks.
    pub fn one_frame(&self) -> Option<Mat3> {
        match self.kind {
            _ if self.deflation.active || self.turns || !self.low_rank.is_empty() => None,
            FrameKind::Isotropic => Some(Mat3::identity()),
            FrameKind::Floating => Some(self.floating),
            FrameKind::PerNode | FrameKind::Rigid => None,
        }
    }

    /// Whether every node has a frame of its own, as in bodies that bend.
    pub fn is_per_node(&self) -> bool {
        self.kind == FrameKind::PerNode
    }
}
