//! Elastic energy and forces of a body: the element loop, known as the local step of Projective
//! Dynamics.
//!
//! `E(x) = Σ_e V_e Ψ(F_e)`, `F_e = Σ_a x_a g_aᵀ`, `f_a = −V_e P(F_e) g_a`.
//!
//! Stiffness damping adds `β/h·V·(μ‖F − R′S_n‖² + λ/2·(tr(RᵀF) − tr S_n)²)` with the stretch
//! `S_n = R_nᵀF_n` at the start of the step and R′ = polar(F S_n), so that spinning costs nothing.

use super::elements::ElementBlock;
use super::gradients::{deformation_gradient, scatter_forces, solid_blocks, solid_gradient, transpose_mul};
use super::model::{DeformableModel, Elements};
use super::smoothing::SmoothingDomains;
use super::thin_elements;
use super::thin_elements::ThinDamping;
use crate::energy::{ElementEnergy, Lame, with_energy};
use crate::material::DeformableMaterial;
use crate::math::lanes::{LANES, Lane, LaneMat3};
use crate::math::polar::polar_rotations;
use crate::math::{Mat3, Vec3, vectorized};

/// Stiffness damping over one step.
#[derive(Clone, Debug, Default)]
pub(crate) struct StiffnessDamping {
    /// β/h.
    ratio: f64,
    /// Stretch of each block at the start of the step; empty without damping.
    stretches: Vec<LaneMat3>,
    /// Those of the patches of smoothed bodies.
    patches: Vec<LaneMat3>,
    thin: ThinDamping,
}

impl StiffnessDamping {
    /// Takes the stretches at `x`, or what they and those `before` amount to in a step of the second order; `beta`
    /// \[s\], `h` \[s\].
    pub fn begin(&mut self, model: &DeformableModel, beta: f64, h: f64, x: &[Vec3], before: Option<&[Vec3]>) {
        self.ratio = beta / h;
        let mut last = Vec::new();
        for (stretches, push) in [
            (&mut self.stretches, push_stretches as fn(&DeformableModel, &[Vec3], &mut Vec<LaneMat3>)),
            (&mut self.patches, push_patch_stretches),
        ] {
            stretches.clear();
            if beta > 0.0 {
                push(model, x, stretches);
                last.clear();
                before.iter().for_each(|before| push(model, before, &mut last));
                for (now, last) in stretches.iter_mut().zip(&last) {
                    *now = now.plus_scaled(&now.minus(last), Lane::splat(1.0 / 3.0));
                }
            }
        }
        self.thin.begin(&model.triangles, &model.stencils, beta, x, before);
    }
}

vectorized! {
fn push_stretches[](model: &DeformableModel, x: &[Vec3], stretches: &mut Vec<LaneMat3>) {
    for block in 0..solid_blocks(model) {
        stretches.push(stretch(&solid_gradient(model, block, x)));
    }
}
}

vectorized! {
fn push_patch_stretches[](model: &DeformableModel, x: &[Vec3], stretches: &mut Vec<LaneMat3>) {
    for block in 0..model.volume_domains.block_count() {
        stretches.push(stretch(&model.volume_domains.deformation_gradient(block, x)));
    }
}
}

#[inline(always)]
fn stretch(F: &LaneMat3) -> LaneMat3 {
    let S = transpose_mul(&polar_rotations(F), F);
    // Symmetric but for roundings.
    LaneMat3(std::array::from_fn(|k| (S.0[k] + S.at(k / 3, k % 3)) * 0.5))
}

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
    let Elements { model, material, .. } = elements;
    let mut elastic = if model.is_smoothed() {
        add_smoothed_forces(model, material, at, force)
    } else {
        with_energy!(material, material.lame(), energy => {
            sum_elements(energy, model, material.lame(), at, force)
        })
    };
    if !(model.triangles.is_empty() && model.stencils.is_empty()) {
        let StiffnessDamping { thin, ratio, .. } = at.damping;
        elastic.evaluated += model.triangles.len() + model.stencils.len();
        elastic.energy += thin_elements::add_forces(elements, thin, *ratio, at.x, force);
    }
    elastic
}

vectorized! {
fn sum_elements[E: ElementEnergy](
    energy: E,
    model: &DeformableModel,
    lame: Lame,
    at: &Evaluation<'_>,
    force: &mut [Vec3],
) -> Elastic {
    let Evaluation { damping, x, frame, limit } = *at;
    let mut total = Lane::default();
    let mut least_trace = Lane::splat(3.0);
    // In stages over a few blocks: each loop is short enough for the next block to start in it while
    // the last one waits for its divisions.
    let mut buffer = [LaneMat3::default(); STAGE];
    for (stage, blocks) in model.blocks.chunks(STAGE).enumerate() {
        for (F, block) in buffer.iter_mut().zip(blocks) {
            *F = deformation_gradient(block, x);
        }
        for (k, (F, block)) in buffer.iter_mut().zip(blocks).enumerate() {
            if let Some(next) = model.blocks.get((stage + 1) * STAGE + k) {
                prefetch(next);
            }
            let mut response = energy.evaluate(F);
            if let Some(stretch) = damping.stretches.get(stage * STAGE + k) {
                let (density, stress) = damping_response(lame, stretch, F, &response.rotation);
                response.density += density * damping.ratio;
                response.stress = response.stress.plus_scaled(&stress, Lane::splat(damping.ratio));
            }
            total += response.density * block.volumes;
            least_trace = least_trace.zip(turn_trace(&response.rotation, frame), f64::min);
            *F = response.stress;
        }
        if total.sum() > limit {
            let evaluated = (stage * STAGE + blocks.len()) * LANES;
            return Elastic { energy: f64::INFINITY, least_trace: 3.0, evaluated };
        }
        for (stress, block) in buffer.iter().zip(blocks) {
            scatter_forces(block, stress, force);
        }
    }
    let least_trace = least_trace.0.into_iter().fold(3.0, f64::min);
    Elastic { energy: total.sum(), least_trace, evaluated: model.tetrahedra.len() }
}
}

/// Shape over edges, volume over patches: every energy, and damping, is the sum of what μ and what λ weigh.
fn add_smoothed_forces(
    model: &DeformableModel,
    material: &DeformableMaterial,
    at: &Evaluation<'_>,
    force: &mut [Vec3],
) -> Elastic {
    let [shape, volume] = material.lame().split();
    let mut elastic = with_energy!(material, shape, energy => {
        sum_domains(energy, &model.domains, (shape, &at.damping.stretches), at, force)
    });
    if volume.lambda > 0.0 && elastic.energy < f64::INFINITY {
        let bare = DeformableMaterial { strain_limits: None, ..*material };
        let rest = Evaluation { limit: at.limit - elastic.energy, ..*at };
        let of_volume = with_energy!(bare, volume, energy => {
            sum_domains(energy, &model.volume_domains, (volume, &at.damping.patches), &rest, force)
        });
        elastic.energy += of_volume.energy;
        elastic.evaluated += of_volume.evaluated;
    }
    elastic
}

vectorized! {
fn sum_domains[E: ElementEnergy](
    energy: E,
    domains: &SmoothingDomains,
    damped: (Lame, &[LaneMat3]),
    at: &Evaluation<'_>,
    force: &mut [Vec3],
) -> Elastic {
    let Evaluation { damping, x, frame, limit } = *at;
    let (lame, stretches) = damped;
    let mut total = Lane::default();
    let mut least_trace = Lane::splat(3.0);
    for block in 0..domains.block_count() {
        let F = domains.deformation_gradient(block, x);
        let mut response = energy.evaluate(&F);
        if let Some(stretch) = stretches.get(block) {
            let (density, stress) = damping_response(lame, stretch, &F, &response.rotation);
            response.density += density * damping.ratio;
            response.stress = response.stress.plus_scaled(&stress, Lane::splat(damping.ratio));
        }
        total += response.density * domains.volumes[block];
        least_trace = least_trace.zip(turn_trace(&response.rotation, frame), f64::min);
        domains.scatter_forces(block, &response.stress, force);
        if total.sum() > limit {
            return Elastic { energy: f64::INFINITY, least_trace: 3.0, evaluated: (block + 1) * LANES };
        }
    }
    let least_trace = least_trace.0.into_iter().fold(3.0, f64::min);
    Elastic { energy: total.sum(), least_trace, evaluated: domains.count }
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

/// Damping's energy density and stress, both per β/h.
#[inline(always)]
fn damping_response(
    Lame { mu, lambda }: Lame,
    stretch: &LaneMat3,
    F: &LaneMat3,
    rotation: &LaneMat3,
) -> (Lane, LaneMat3) {
    // R' S_n with S_n symmetric.
    let turned = polar_rotations(&F.mul_transpose(stretch)).mul(stretch);
    let deviation = F.minus(&turned);
    let trace = rotation.dot(F) - (stretch.at(0, 0) + stretch.at(1, 1) + stretch.at(2, 2));
    let density = deviation.dot(&deviation) * mu + trace * trace * (0.5 * lambda);
    let stress = deviation.scaled(Lane::splat(2.0 * mu)).plus_scaled(rotation, trace * lambda);
    (density, stress)
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
        let elements = Elements { model: &model(), material, activation: 1.0 };
        let elastic = add_forces(&elements, &free(damping, x), &mut f);
        (elastic.energy, f)
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
            let material = DeformableMaterial::new(1e3, 0.4).elasticity(elasticity);
            let mut damping = StiffnessDamping::default();
            damping.begin(&model(), beta, 0.01, &shaken(seed ^ 1, 0.05), None);
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
        fn smoothed_forces_are_minus_the_gradient_too(
            seed in any::<u64>(), beta in prop_oneof![Just(0.0), Just(0.02)], kind in 0usize..4,
        ) {
            let material = DeformableMaterial::new(1e3, 0.4).elasticity(Elasticity::ALL[kind]);
            let model = model().smoothed();
            let elements = Elements { model: &model, material: &material, activation: 1.0 };
            let mut damping = StiffnessDamping::default();
            damping.begin(&model, beta, 0.01, &shaken(seed ^ 1, 0.05), None);
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
            let material = DeformableMaterial::new(1e3, 0.3);
            let mut damping = StiffnessDamping::default();
            damping.begin(&model(), 0.02, 0.01, &shaken(seed ^ 1, 0.05), None);
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
            let elements = Elements { model: &model, material: &material, activation: 1.0 };
            add_forces(&elements, &free(&StiffnessDamping::default(), &x), &mut f);
            for (X, f) in model.rest.iter().zip(&f) {
                if X.iter().all(|c| c.abs() < 0.29) {
                    assert!(f.norm() < 1e-10, "{elasticity:?}: {f}");
                }
            }
        }
    }
}
