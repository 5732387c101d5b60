//! A static minimiser of its own: linear corotated energy plus gravity, Newton's method with
//! conjugate gradients on the exact tangent. Shares no code with the engine.

#![allow(non_snake_case)]

use nalgebra::{Matrix3, Vector3};

type M = Matrix3<f64>;
type V = Vector3<f64>;

struct Element {
    nodes: [usize; 4],
    gradients: [V; 4],
    volume: f64,
}

/// Everything that the energy depends on.
pub struct StaticProblem {
    elements: Vec<Element>,
    masses: Vec<f64>,
    fixed: Vec<bool>,
    gravity: V,
    mu: f64,
    lambda: f64,
}

impl StaticProblem {
    /// A mesh of Young's modulus `e` [Pa], Poisson's ratio `nu`, density `rho` [kg/m³] under gravity
    /// `g` [m/s²] along −y, with fixed nodes.
    pub fn new(
        rest: &[[f64; 3]],
        tets: &[[u32; 4]],
        e: f64,
        nu: f64,
        rho: f64,
        g: f64,
        fixed: impl Fn([f64; 3]) -> bool,
    ) -> Self {
        let mut masses = vec![0.0; rest.len()];
        let elements = tets
            .iter()
            .map(|t| {
                let nodes = t.map(|i| i as usize);
                let p = nodes.map(|i| V::from(rest[i]));
                let D = M::from_columns(&[p[1] - p[0], p[2] - p[0], p[3] - p[0]]);
                let volume = D.determinant() / 6.0;
                let inv = D.try_inverse().unwrap();
                let g: Vec<V> = (0..3).map(|k| inv.row(k).transpose()).collect();
                nodes.iter().for_each(|&i| masses[i] += rho * volume / 4.0);
                Element { nodes, gradients: [-(g[0] + g[1] + g[2]), g[0], g[1], g[2]], volume }
            })
            .collect();
        Self {
            elements,
            masses,
            fixed: rest.iter().map(|&p| fixed(p)).collect(),
            gravity: V::new(0.0, -g, 0.0),
            mu: e / (2.0 * (1.0 + nu)),
            lambda: e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)),
        }
    }

    fn rotation(F: &M) -> M {
        let svd = F.svd(true, true);
        let (U, Vt) = (svd.u.unwrap(), svd.v_t.unwrap());
        let sign = (U * Vt).determinant().signum();
        U * M::from_diagonal(&V::new(1.0, 1.0, sign)) * Vt
    }

    fn energy_and_forces(&self, x: &[V]) -> (f64, Vec<V>) {
        let mut energy = 0.0;
        let mut f: Vec<V> = self.masses.iter().map(|m| self.gravity * *m).collect();
        energy -= f.iter().zip(x).map(|(f, x)| f.dot(x)).sum::<f64>();
        for e in &self.elements {
            let F: M = (0..4).map(|a| x[e.nodes[a]] * e.gradients[a].transpose()).sum();
            let R = Self::rotation(&F);
            let t = R.dot(&F) - 3.0;
            energy += e.volume * (self.mu * (F - R).norm_squared() + 0.5 * self.lambda * t * t);
            let P = (F - R) * (2.0 * self.mu) + R * (self.lambda * t);
            (0..4).for_each(|a| f[e.nodes[a]] -= P * e.gradients[a] * e.volume);
        }
        (0..f.len()).filter(|&i| self.fixed[i]).for_each(|i| f[i] = V::zeros());
        (energy, f)
    }

    fn tangent_times(&self, x: &[V], d: &[V]) -> Vec<V> {
        let mut out = vec![V::zeros(); x.len()];
        for e in &self.elements {
            let F: M = (0..4).map(|a| x[e.nodes[a]] * e.gradients[a].transpose()).sum();
            let dF: M = (0..4).map(|a| d[e.nodes[a]] * e.gradients[a].transpose()).sum();
            let R = Self::rotation(&F);
            let S = R.transpose() * F;
            let B = R.transpose() * dF;
            let axl = V::new(B[(2, 1)] - B[(1, 2)], B[(0, 2)] - B[(2, 0)], B[(1, 0)] - B[(0, 1)]);
            let omega = (M::identity() * S.trace() - S).try_inverse().unwrap_or_else(M::zeros) * axl;
            let dR = R * omega.cross_matrix();
            let dP = (dF - dR) * (2.0 * self.mu)
                + R * (self.lambda * R.dot(&dF))
                + dR * (self.lambda * (S.trace() - 3.0));
            (0..4).for_each(|a| out[e.nodes[a]] += dP * e.gradients[a] * e.volume);
        }
        (0..out.len()).filter(|&i| self.fixed[i]).for_each(|i| out[i] = V::zeros());
        out
    }

    /// The positions of least energy, to residual forces of 1e-8 of the heaviest node's weight.
    pub fn minimise(&self, rest: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let dot = |a: &[V], b: &[V]| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>();
        let mut x: Vec<V> = rest.iter().map(|&p| p.into()).collect();
        let heaviest = self.masses.iter().fold(0.0, |a: f64, b| a.max(*b)) * self.gravity.norm();
        for _ in 0..200 {
            let (energy, f) = self.energy_and_forces(&x);
            if f.iter().all(|f| f.amax() < 1e-8 * heaviest) {
                return x.iter().map(|p| (*p).into()).collect();
            }
            let mut step = vec![V::zeros(); x.len()];
            let (mut r, mut p) = (f.clone(), f.clone());
            let start = dot(&r, &r);
            for _ in 0..4000 {
                let Hp = self.tangent_times(&x, &p);
                let curvature = dot(&p, &Hp);
                if curvature <= 0.0 {
                    break;
                }
                let rr = dot(&r, &r);
                let a = rr / curvature;
                (0..x.len()).for_each(|i| step[i] += p[i] * a);
                (0..x.len()).for_each(|i| r[i] -= Hp[i] * a);
                let next = dot(&r, &r);
                if next < 1e-12 * start {
                    break;
                }
                (0..x.len()).for_each(|i| p[i] = r[i] + p[i] * (next / rr));
            }
            let mut t = 1.0;
            loop {
                let trial: Vec<V> = x.iter().zip(&step).map(|(x, s)| x + s * t).collect();
                if self.energy_and_forces(&trial).0 <= energy + 1e-12 * energy.abs() || t < 1e-8 {
                    x = trial;
                    break;
                }
                t *= 0.5;
            }
        }
        panic!("the static reference did not converge");
    }
}
