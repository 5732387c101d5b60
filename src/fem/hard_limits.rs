//! Stretches brought back within hard limits, by sweeps of projections.
//!
//! A principal stretch σ with its directions u (now) and v (at rest) changes by `Σ cᵢ u·Δxᵢ`, `cᵢ = v·gᵢ`, with the gradients g
//! of the shape functions. What is beyond its limit is brought back by `Δxᵢ = s cᵢ Wᵢ u`, the least motion weighed by mass that does
//! so [Müller et al. 2007; Goldenthal et al. 2007; Thomaszewski et al. 2009; Wang et al. 2010]. W is 1/m, less what pins and
//! contacts hold. The impulses `s cᵢ u` sum to nothing, and so do their moments, `s F v × u = s σ u × u`: momenta stay.

use super::elements::ElementBlock;
use super::model::{DeformableModel, Elements};
use crate::energy::membrane::principal_axes;
use crate::energy::stencil::StencilKind;
use crate::energy::strain_limit::excess;
use crate::math::lanes::LANES;
use crate::math::polar::signed_svd;
use crate::math::{Mat3, Vec3};

/// Excess of a stretch [–] at which sweeps end: a tenth of what is promised.
const CLOSE: f64 = 1.0e-4;
/// How far projections go over that of the limit [–], 1 to 2: the best for a chain of 20, `2/(1 + sin(π/21))`. What has been pulled
/// too far is not let go again: remembered impulses of axes that turn never settle in solids.
const OVER: f64 = 1.7;
/// Sweeps in a step, at the most: a rope of 20 segments with 1000 times its weight takes 360.
const MOST_SWEEPS: usize = 400;

/// An element that may have a limit.
#[derive(Clone, Copy, Debug)]
enum Piece {
    Tetrahedron { block: u32, lane: u32 },
    Triangle(u32),
    Bar(u32),
}

/// Principal stretches of an element.
struct Stretched {
    nodes: [u32; 4],
    /// Direction u now, stretch, and coefficients c of the nodes; of no nodes and principal directions that are not there zero.
    axes: [(Vec3, f64, [f64; 4]); 3],
    count: usize,
}

/// A bound on how far a point of a body may go against a direction: there is something that carries nothing yet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Room {
    pub nodes: [u32; 3],
    pub weights: [f64; 3],
    pub direction: Vec3,
    /// What is left of it at the start \[m\].
    pub left: f64,
}

/// What holds a body while its stretches are brought back.
#[derive(Clone, Debug, Default)]
pub(crate) struct Holds {
    /// Displacement of each node per impulse [1/kg].
    pub mobility: Vec<Mat3>,
    pub rooms: Vec<Room>,
}

/// Pieces of a body whose material has hard limits, with those.
fn limited_pieces<'a>(elements: &Elements<'a>) -> impl Iterator<Item = (Piece, [f64; 2])> + 'a {
    let Elements { model, materials, .. } = *elements;
    let limits = move |region: u32| materials[region as usize].hard_strain_limits;
    let solid = model.regions.iter().zip(materials).filter_map(|(r, m)| Some((r, m.hard_strain_limits?)));
    let solid = solid.flat_map(|(region, limits)| {
        let (blocks, count) = (region.blocks.clone(), region.tetrahedra.len());
        (0..count.min(LANES * blocks.len())).map(move |k| {
            let (block, lane) = ((blocks.start + k / LANES) as u32, (k % LANES) as u32);
            (Piece::Tetrahedron { block, lane }, limits)
        })
    });
    let triangles = (0..).zip(&model.triangles);
    let triangles = triangles.filter_map(move |(k, t)| Some((Piece::Triangle(k), limits(t.region)?)));
    let is_bar = |kind| matches!(kind, StencilKind::Stretch);
    let bars = (0..).zip(model.stencils.iter()).filter(move |(_, s)| is_bar(s.kind) && s.length > 0.0);
    let bars = bars.filter_map(move |(k, s)| Some((Piece::Bar(k), limits(s.regions[0])?)));
    solid.chain(triangles).chain(bars)
}

/// Whether a body is beyond a hard limit by more than sweeps leave.
pub(crate) fn is_beyond_hard_limits(elements: &Elements<'_>, x: &[Vec3]) -> bool {
    if elements.materials.iter().all(|material| material.hard_strain_limits.is_none()) {
        return false;
    }
    limited_pieces(elements).any(|(piece, limits)| {
        !is_surely_within(&piece, elements.model, x, limits)
            && stretched(&piece, elements.model, x).most_excess(limits) > CLOSE
    })
}

/// What bringing back works in, and what it has done in this step.
#[derive(Clone, Debug, Default)]
pub(crate) struct HardLimiting {
    pieces: Vec<(Piece, [f64; 2])>,
    pub holds: Holds,
    before: Vec<Vec3>,
    /// On each node, whether it yields or not [kg m]; empty of a body that was within its limits.
    pub impulses: Vec<Vec3>,
}

impl HardLimiting {
    /// Brings positions back within the limits; gives the sweeps that it took.
    pub fn bring_back(&mut self, elements: &Elements<'_>, x: &mut [Vec3]) -> usize {
        let Self { pieces, holds, before, impulses } = self;
        pieces.clear();
        pieces.extend(limited_pieces(elements));
        impulses.clear();
        impulses.resize(x.len(), Vec3::zeros());
        before.clear();
        before.extend_from_slice(x);
        for sweep in 1..=MOST_SWEEPS {
            let mut most = 0.0_f64;
            for k in 0..pieces.len() {
                // There and back, so that what one end is told comes to the other.
                let k = if sweep % 2 == 1 { k } else { pieces.len() - 1 - k };
                let (piece, limits) = &pieces[k];
                if is_surely_within(piece, elements.model, x, *limits) {
                    continue;
                }
                let s = stretched(piece, elements.model, x);
                for axis in &s.axes[..s.count] {
                    most = most.max(project(&s.nodes, axis, *limits, holds, x, impulses));
                }
            }
            let went_through =
                holds.rooms.iter().filter(|room| keep(room, holds, before, x, impulses)).count();
            if !(most > CLOSE || went_through > 0) {
                return sweep;
            }
        }
        MOST_SWEEPS
    }
}

/// Brings one stretch back; gives by how much it was beyond.
fn project(
    nodes: &[u32; 4],
    (u, stretch, coefficients): &(Vec3, f64, [f64; 4]),
    limits: [f64; 2],
    holds: &Holds,
    x: &mut [Vec3],
    impulses: &mut [Vec3],
) -> f64 {
    let beyond = excess(*stretch, limits);
    if beyond == 0.0 {
        return 0.0;
    }
    let yields = yielding(nodes, coefficients, u, holds);
    // Written so that NaN moves nothing.
    if !(yields > 0.0) {
        return 0.0;
    }
    push(nodes, coefficients, u, -OVER * beyond / yields, holds, x, impulses);
    beyond.abs()
}

/// By how much `Σ cᵢ u·xᵢ` changes for a unit impulse.
fn yielding(nodes: &[u32], coefficients: &[f64], u: &Vec3, holds: &Holds) -> f64 {
    let terms = nodes.iter().zip(coefficients);
    terms.map(|(n, c)| c * c * u.dot(&(holds.mobility[*n as usize] * u))).sum()
}

/// Gives nodes the impulses `cᵢ u` times `by`.
fn push(
    nodes: &[u32],
    coefficients: &[f64],
    u: &Vec3,
    by: f64,
    holds: &Holds,
    x: &mut [Vec3],
    impulses: &mut [Vec3],
) {
    for (n, c) in nodes.iter().map(|n| *n as usize).zip(coefficients) {
        let impulse = u * (c * by);
        impulses[n] += impulse;
        x[n] += holds.mobility[n] * impulse;
    }
}

/// Puts a point back that has gone beyond its room; true if it had by a length that counts.
fn keep(room: &Room, holds: &Holds, before: &[Vec3], x: &mut [Vec3], impulses: &mut [Vec3]) -> bool {
    let terms = room.nodes.iter().map(|n| *n as usize).zip(room.weights);
    let moved = terms.map(|(n, w)| (x[n] - before[n]) * w).sum::<Vec3>();
    let beyond = moved.dot(&room.direction) + room.left;
    if !(beyond < 0.0) {
        return false;
    }
    let yields = yielding(&room.nodes, &room.weights, &room.direction, holds);
    if !(yields > 0.0) {
        return false;
    }
    push(&room.nodes, &room.weights, &room.direction, -beyond / yields, holds, x, impulses);
    -beyond > CLOSE * room.left
}

/// A quick look that needs no axes: `|σ² − 1| ≤ ‖FᵀF − I‖`.
fn is_surely_within(piece: &Piece, model: &DeformableModel, x: &[Vec3], [least, largest]: [f64; 2]) -> bool {
    let room = (largest * largest - 1.0).min(1.0 - least * least);
    match piece {
        Piece::Tetrahedron { block, lane } => {
            let F = tetrahedron_gradient(&model.blocks[*block as usize], *lane as usize, x);
            F.determinant() > 0.0 && (F.tr_mul(&F) - Mat3::identity()).norm() < room
        }
        Piece::Triangle(t) => {
            let F = model.triangles[*t as usize].deformation_gradient(x);
            (F.tr_mul(&F) - crate::math::Mat2::identity()).norm() < room
        }
        Piece::Bar(_) => false,
    }
}

fn tetrahedron_gradient(block: &ElementBlock, lane: usize, x: &[Vec3]) -> Mat3 {
    let corner = |a: usize| x[block.corners[a][lane] as usize];
    let gradients = block.shape_gradients(lane);
    (1..4).map(|a| (corner(a) - corner(0)) * gradients[a].transpose()).sum()
}

fn stretched(piece: &Piece, model: &DeformableModel, x: &[Vec3]) -> Stretched {
    let mut axes = [(Vec3::zeros(), 1.0, [0.0; 4]); 3];
    let (nodes, count) = match piece {
        Piece::Tetrahedron { block, lane } => {
            let (block, lane) = (&model.blocks[*block as usize], *lane as usize);
            let (U, sigma, V) = signed_svd(&tetrahedron_gradient(block, lane, x));
            let gradients = block.shape_gradients(lane);
            for (k, axis) in axes.iter_mut().enumerate() {
                let v: Vec3 = V.column(k).into();
                *axis = (U.column(k).into(), sigma[k], gradients.map(|g| v.dot(&g)));
            }
            ([0, 1, 2, 3].map(|a| block.corners[a][lane]), 3)
        }
        Piece::Triangle(t) => {
            let triangle = &model.triangles[*t as usize];
            let (U, sigma, V) = principal_axes(&triangle.deformation_gradient(x));
            // The longer one first, so that an axis keeps its place from sweep to sweep.
            let order = if sigma[0] >= sigma[1] { [0, 1] } else { [1, 0] };
            for (axis, k) in axes.iter_mut().zip(order) {
                let c = triangle.gradients.map(|g| V.column(k).dot(&g));
                *axis = (U[k], sigma[k], [c[0], c[1], c[2], 0.0]);
            }
            let [a, b, c] = triangle.nodes;
            ([a, b, c, a], 2)
        }
        Piece::Bar(s) => {
            let bar = model.stencils.get(*s as usize);
            let vector = bar.vector(x);
            let length = vector.norm();
            let u = vector.try_normalize(0.0).unwrap_or_else(Vec3::x);
            let ([a, b], [c, d]) = ([0, 1].map(|k| bar.nodes[k]), [0, 1].map(|k| bar.coefficients[k]));
            axes[0] = (u, length / bar.length, [c / bar.length, d / bar.length, 0.0, 0.0]);
            ([a, b, a, a], 1)
        }
    };
    Stretched { nodes, axes, count }
}

impl Stretched {
    /// By how much the stretch that is farthest from its limits is beyond them.
    fn most_excess(&self, limits: [f64; 2]) -> f64 {
        self.axes[..self.count].iter().map(|(_, s, _)| excess(*s, limits).abs()).fold(0.0, f64::max)
    }
}
