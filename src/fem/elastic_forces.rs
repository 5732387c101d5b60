//! Elastic energy and forces of a body: the element loop, known as the local step of Projective
//! Dynamics.
//!
//! `E(x) = Σ_e V_e Ψ(F_e)`, `F_e = Σ_a x_a g_aᵀ`, `f_a = −V_e P(F_e) g_a`.

use super::elements::ElementBlock;
use super::gradients::{deformation_gradient, scatter_forces};
use super::model::{DeformableModel, Elements};
use super::regions::Region;
use super::smoothing::SmoothingDomains;
use super::stiffness_damping::{StiffnessDamping, damping_response};
use super::thin_elements;
use crate::energy::{ElementEnergy, Lame, with_energy};
use crate::material::DeformableMaterial;
use crate::math::lanes::{LANES, Lane, LaneMat3};
use crate::math::{Mat3, Vec3, vectorized};
use std::ops::Range;

/// Blocks that go through the stages of the element loop together.
const STAGE: usize = 16;

/// What an evaluation tells besides the forces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Elastic {
    /// Energy \[J\].
    pub energy: f64,
    /// Least `tr(QᵀR)` over the elements, `1 + 2 cos θ` of the largest turn θ against the frame Q.
    pub least_trace: f64,
    /// Elements that were computed.
    pub evaluated: usize,
}

impl Elastic {
    fn add(&mut self, other: &Self) {
        self.energy += other.energy;
        self.least_trace = self.least_trace.min(other.least_trace);
        self.evaluated += other.evaluated;
    }
}

/// Where and against what energy and forces are evaluated.
#[derive(Clone, Copy)]
pub(crate) struct Evaluation<'a> {
    pub damping: &'a StiffnessDamping,
    pub x: &'a [Vec3],
    /// What the turn of the elements is measured against.
    pub frame: &'a Mat3,
    /// Energy \[J\] above which the evaluation stops, with an infinite one: no element's is negative.
    pub limit: f64,
}

/// Adds the elastic (and damping) forces \[N\] to `force`.
pub(crate) fn add_forces(elements: &Elements<'_>, at: &Evaluation<'_>, force: &mut [Vec3]) -> Elastic {
    let Elements { model, materials, .. } = elements;
    let mut elastic = Elastic { energy: 0.0, least_trace: 3.0, evaluated: 0 };
    for (k, (region, material)) in model.regions.iter().zip(*materials).enumerate() {
        let ratio = at.damping.ratios.get(k).copied().unwrap_or(0.0);
        let rest = Evaluation { limit: at.limit - elastic.energy, ..*at };
        if model.is_smoothed() {
            add_smoothed_forces((model, region), (material, ratio), &rest, &mut elastic, force);
        } else {
            let lame = material.lame();
            let of_region = with_energy!(material, lame, energy => {
                sum_elements(energy, (model, region), (lame, ratio), &rest, force)
            });
            elastic.add(&of_region);
        }
        if elastic.energy == f64::INFINITY {
            return elastic;
        }
    }
    if !(model.triangles.is_empty() && model.stencils.is_empty()) {
        let limit = at.limit - elastic.energy;
        let thin = thin_elements::add_forces(elements, &Evaluation { limit, ..*at }, force);
        elastic.add(&thin);
    }
    elastic
}

vectorized! {
fn sum_elements[E: ElementEnergy](
    energy: E,
    of: (&DeformableModel, &Region),
    damped: (Lame, f64),
    at: &Evaluation<'_>,
    force: &mut [Vec3],
) -> Elastic {
    let ((model, region), (lame, ratio)) = (of, damped);
    let Evaluation { damping, x, frame, limit } = *at;
    let mut total = Lane::default();
    let mut least_trace = Lane::splat(3.0);
    // In stages over a few blocks: each loop is short enough for the next block to start in it while
    // the last one waits for its divisions.
    let mut buffer = [LaneMat3::default(); STAGE];
    let (start, evaluated) = (region.blocks.start, region.tetrahedra.len());
    for (stage, blocks) in model.blocks[region.blocks.clone()].chunks(STAGE).enumerate() {
        let first = start + stage * STAGE;
        for (F, block) in buffer.iter_mut().zip(blocks) {
            *F = deformation_gradient(block, x);
        }
        for (k, (F, block)) in buffer.iter_mut().zip(blocks).enumerate() {
            if let Some(next) = model.blocks.get(first + STAGE + k) {
                prefetch(next);
            }
            let mut response = energy.evaluate(F);
            if let Some(stretch) = damping.stretches.solid.get(first + k) {
                let (density, stress) = damping_response(lame, stretch, F, &response.rotation);
                response.density += density * ratio;
                response.stress = response.stress.plus_scaled(&stress, Lane::splat(ratio));
            }
            total += response.density * block.volumes;
            least_trace = least_trace.zip(turn_trace(&response.rotation, frame), f64::min);
            *F = response.stress;
        }
        if total.sum() > limit {
            let evaluated = (first - start + blocks.len()) * LANES;
            return Elastic { energy: f64::INFINITY, least_trace: 3.0, evaluated };
        }
        for (stress, block) in buffer.iter().zip(blocks) {
            scatter_forces(block, stress, force);
        }
    }
    let least_trace = least_trace.0.into_iter().fold(3.0, f64::min);
    Elastic { energy: total.sum(), least_trace, evaluated }
}
}

/// Shape over edges, volume over patches: every energy, and damping, is the sum of what μ and what λ weigh.
fn add_smoothed_forces(
    (model, region): (&DeformableModel, &Region),
    (material, ratio): (&DeformableMaterial, f64),
    at: &Evaluation<'_>,
    elastic: &mut Elastic,
    force: &mut [Vec3],
) {
    let [shape, volume] = material.lame().split();
    let domains = (&model.domains, region.domains.clone());
    let damped = (shape, ratio, &at.damping.stretches.solid[..]);
    let of_shape = with_energy!(material, shape, energy => sum_domains(energy, domains, damped, at, force));
    elastic.add(&of_shape);
    if volume.lambda > 0.0 && of_shape.energy < f64::INFINITY {
        let bare = material.without_limits();
        let rest = Evaluation { limit: at.limit - of_shape.energy, ..*at };
        let domains = (&model.volume_domains, region.patches.clone());
        let damped = (volume, ratio, &at.damping.stretches.patches[..]);
        let of_volume =
            with_energy!(bare, volume, energy => sum_domains(energy, domains, damped, &rest, force));
        elastic.energy += of_volume.energy;
        elastic.evaluated += of_volume.evaluated;
    }
}

vectorized! {
fn sum_domains[E: ElementEnergy](
    energy: E,
    of: (&SmoothingDomains, Range<usize>),
    damped: (Lame, f64, &[LaneMat3]),
    at: &Evaluation<'_>,
    force: &mut [Vec3],
) -> Elastic {
    let Evaluation { x, frame, limit, .. } = *at;
    let ((domains, blocks), (lame, ratio, stretches)) = (of, damped);
    let first = blocks.start;
    let mut total = Lane::default();
    let mut least_trace = Lane::splat(3.0);
    for block in blocks.clone() {
        let F = domains.deformation_gradient(block, x);
        let mut response = energy.evaluate(&F);
        if let Some(stretch) = stretches.get(block) {
            let (density, stress) = damping_response(lame, stretch, &F, &response.rotation);
            response.density += density * ratio;
            response.stress = response.stress.plus_scaled(&stress, Lane::splat(ratio));
        }
        total += response.density * domains.volumes[block];
        least_trace = least_trace.zip(turn_trace(&response.rotation, frame), f64::min);
        domains.scatter_forces(block, &response.stress, force);
        if total.sum() > limit {
            return Elastic { energy: f64::INFINITY, least_trace: 3.0, evaluated: (block + 1 - first) * LANES };
        }
    }
    let least_trace = least_trace.0.into_iter().fold(3.0, f64::min);
    Elastic { energy: total.sum(), least_trace, evaluated: blocks.len() * LANES }
}
}

/// `tr(QᵀR)`.
#[inline(always)]
fn turn_trace(rotation: &LaneMat3, frame: &Mat3) -> Lane {
    let mut trace = Lane::default();
    for c in 0..3 {
        for r in 0..3 {
            trace = rotation.at(r, c).mul_add(Lane::splat(frame[(r, c)]), trace);
        }
    }
    trace
}

/// Asks for a block that will be needed soon.
#[inline(always)]
fn prefetch(block: &ElementBlock) {
    #[cfg(target_arch = "x86_64")]
    for line in (0..size_of::<ElementBlock>()).step_by(64) {
        // SAFETY: within the block; a prefetch reads nothing.
        unsafe {
            use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
            _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(block).cast::<i8>().add(line));
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = block;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::energy::Elasticity;
    use crate::mesh::TetMesh;
    use proptest::prelude::*;

    fn model() -> DeformableModel {
        DeformableModel::new(&TetMesh::cuboid([0.3, 0.2, 0.2], [3, 2, 2]).unwrap())
    }

    fn free<'a>(damping: &'a StiffnessDamping, x: &'a [Vec3]) -> Evaluation<'a> {
        const FRAME: Mat3 = Mat3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        Evaluation { damping, x, frame: &FRAME, limit: f64::INFINITY }
    }

    fn forces(material: &DeformableMaterial, damping: &StiffnessDamping, x: &[Vec3]) -> (f64, Vec<Vec3>) {
        let mut f = vec![Vec3::zeros(); x.len()];
        let elements =
            Elements { model: &model(), materials: std::slice::from_ref(material), activations: &[] };
        let elastic = add_forces(&elements, &free(damping, x), &mut f);
        (elastic.energy, f)
    }

    fn begun(model: &DeformableModel, materials: &[DeformableMaterial], seed: u64) -> StiffnessDamping {
        let mut damping = StiffnessDamping::default();
        let elements = Elements { model, materials, activations: &[] };
        damping.begin(&elements, 0.01, &shaken(seed ^ 1, 0.05), None);
        damping
    }

    fn shaken(seed: u64, size: f64) -> Vec<Vec3> {
        // A small linear congruence is random enough to shake a mesh.
        let mut state = seed.wrapping_mul(2862933555777941757).wrapping_add(3037000493);
        let mut next = move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            ((state >> 33) as f64 / (1u64 << 31) as f64 - 0.5) * size
        };
        model().rest.iter().map(|X| X + Vec3::new(next(), next(), next())).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn force_is_minus_the_gradient_with_and_without_damping(
            seed in any::<u64>(), beta in prop_oneof![Just(0.0), Just(0.02)], projective in any::<bool>(),
        ) {
            let elasticity = if projective { Elasticity::Projective } else { Elasticity::LinearCorotated };
            let material = DeformableMaterial::new(1e3, 0.4).elasticity(elasticity).stiffness_damping(beta);
            let damping = begun(&model(), &[material], seed);
            let x = shaken(seed, 0.05);
            let direction: Vec<Vec3> = shaken(seed ^ 7, 1.0).iter().zip(&model().rest).map(|(a, b)| a - b).collect();
            let moved = |t: f64| -> Vec<Vec3> { x.iter().zip(&direction).map(|(p, d)| p + d * t).collect() };
            let eps = 1e-6;
            let slope = (forces(&material, &damping, &moved(eps)).0 - forces(&material, &damping, &moved(-eps)).0) / (2.0 * eps);
            let work: f64 = forces(&material, &damping, &x).1.iter().zip(&direction).map(|(f, d)| f.dot(d)).sum();
            // Central difference: eps² × third derivative plus 1e-16·E/eps with E ~ 10 J.
            prop_assert!((slope + work).abs() < 1e-5 * (1.0 + work.abs()), "{slope} {work}");
        }

        #[test]
        fn forces_of_regions_are_minus_the_gradient_too_smoothed_or_not(
            seed in any::<u64>(), beta in prop_oneof![Just(0.0), Just(0.02)], kind in 0usize..4, smoothed in any::<bool>(),
        ) {
            let halves = model().painted(|[x, y, _]| 7 * u32::from(x > 0.0) + u32::from(x > 0.0 && y > 0.0));
            let model = if smoothed { halves.smoothed() } else { halves };
            let soft = DeformableMaterial::new(1e3, 0.4).elasticity(Elasticity::ALL[kind]);
            let materials = [soft.stiffness_damping(beta), soft.poisson_ratio(0.0), soft.youngs_modulus(1e2)];
            let elements = Elements { model: &model, materials: &materials, activations: &[] };
            let damping = begun(&model, &materials, seed);
            let at = |x: &[Vec3]| {
                let mut f = vec![Vec3::zeros(); x.len()];
                let elastic = add_forces(&elements, &free(&damping, x), &mut f);
                (elastic.energy, f)
            };
            let x = shaken(seed, 0.05);
            let direction: Vec<Vec3> = shaken(seed ^ 7, 1.0).iter().zip(&model.rest).map(|(a, b)| a - b).collect();
            let moved = |t: f64| -> Vec<Vec3> { x.iter().zip(&direction).map(|(p, d)| p + d * t).collect() };
            let slope = (at(&moved(1e-6)).0 - at(&moved(-1e-6)).0) / 2e-6;
            let forces = at(&x).1;
            let work: f64 = forces.iter().zip(&direction).map(|(f, d)| f.dot(d)).sum();
            // As without smoothing.
            prop_assert!((slope + work).abs() < 1e-5 * (1.0 + work.abs()), "{slope} {work}");
            let sum = forces.iter().fold(Vec3::zeros(), |a, b| a + b);
            let moment = forces.iter().zip(&x).fold(Vec3::zeros(), |a, (f, p)| a + p.cross(f));
            let scale: f64 = forces.iter().map(|f| f.norm()).sum();
            prop_assert!(sum.norm() < 1e-12 * scale && moment.norm() < 1e-10 * scale);
        }

        #[test]
        fn internal_forces_have_no_sum_and_no_moment(seed in any::<u64>()) {
            let material = DeformableMaterial::new(1e3, 0.3).stiffness_damping(0.02);
            let damping = begun(&model(), &[material], seed);
            let x = shaken(seed, 0.05);
            let (_, f) = forces(&material, &damping, &x);
            let sum = f.iter().fold(Vec3::zeros(), |a, b| a + b);
            let moment = f.iter().zip(&x).fold(Vec3::zeros(), |a, (f, p)| a + p.cross(f));
            let scale: f64 = f.iter().map(|f| f.norm()).sum();
            // 60 elements × a few roundings each of terms of the forces' size; the polar
            // iteration leaves 1e-12 of symmetry for the moment.
            prop_assert!(sum.norm() < 1e-13 * scale && moment.norm() < 1e-11 * scale);
        }
    }

    #[test]
    fn rigid_rotation_has_no_energy_and_no_force() {
        let material = DeformableMaterial::new(1e9, 0.45);
        let turn = crate::math::rotation_from_vector(&Vec3::new(2.0, -1.0, 0.5));
        let x: Vec<Vec3> = model().rest.iter().map(|X| turn * X + Vec3::new(1.0, 2.0, 3.0)).collect();
        let (energy, f) = forces(&material, &StiffnessDamping::default(), &x);
        // Strains of 1e-15 (positions of 3 m in cells of 0.1 m) at 1e9 Pa over 0.1 m² and 0.1 m³.
        assert!(energy < 1e-18, "{energy}");
        assert!(f.iter().all(|f| f.norm() < 1e-4));
    }

    #[test]
    fn affine_patch_has_uniform_stress() {
        // Under x = F X every interior node is in balance, on an irregular mesh too.
        let mesh = TetMesh::cuboid([0.3; 3], [3; 3]).unwrap();
        let mut points = mesh.vertices().to_vec();
        for (k, p) in points.iter_mut().enumerate() {
            if p.iter().all(|c| c.abs() < 0.29) {
                p[k % 3] += 0.02 * ((k * 7 % 5) as f64 - 2.0) / 2.0;
            }
        }
        let model = DeformableModel::new(&TetMesh::new(points, mesh.tetrahedra().to_vec()).unwrap());
        let F = Mat3::new(1.1, 0.2, -0.1, 0.0, 0.9, 0.3, 0.1, -0.2, 1.2);
        let x: Vec<Vec3> = model.rest.iter().map(|X| F * X).collect();
        for elasticity in [Elasticity::LinearCorotated, Elasticity::Projective] {
            let material = DeformableMaterial::new(1.0, 0.3).elasticity(elasticity);
            let mut f = vec![Vec3::zeros(); x.len()];
            let elements = Elements { model: &model, materials: &[material], activations: &[] };
            add_forces(&elements, &free(&StiffnessDamping::default(), &x), &mut f);
            for (X, f) in model.rest.iter().zip(&f) {
                if X.iter().all(|c| c.abs() < 0.29) {
                    assert!(f.norm() < 1e-10, "{elasticity:?}: {f}");
                }
            }
        }
    }
}
