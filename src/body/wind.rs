//! Moving air that pushes surfaces.

use super::body::{DeformableBody, finite};
use crate::error::BodyError;
use crate::fem::DeformableModel;
use crate::math::{Vec3, from_real};
use rapier3d::math::Vector;

/// Air that moves past a body, and does not slow down behind it. Each triangle of its surface is pushed as a plate is: by `ρ/2 C A u²` along its normal, with
/// the speed u of the air through it, and by the same with the friction coefficient along itself. Of solids those that face
/// the wind, of sheets all; segments of rods as cylinders, by their length times their diameter. In a step no vertex gains
/// more than the air has against it: at 1/60 s a cloth of 0.1 kg/m² that is held in 9 m/s and more is pushed by less.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub struct DeformableWind {
    /// Velocity of the air [m/s].
    pub velocity: Vector,
    /// Its density ρ [kg/m³].
    pub density: f64,
    /// Drag coefficient C of a plate across the wind; 1.1 to 1.3 of square to long ones [Hoerner 1965].
    pub drag: f64,
    /// Friction coefficient of a plate along the wind.
    pub friction: f64,
}

impl DeformableWind {
    /// Air of 1.2 kg/m³ that moves with a velocity [m/s]; drag 1.2, friction 0.01.
    pub fn new(velocity: Vector) -> Self {
        Self { velocity, density: 1.2, drag: 1.2, friction: 0.01 }
    }
}

impl DeformableBody {
    /// The air around the body; `None` is a vacuum.
    pub fn wind(&self) -> Option<DeformableWind> {
        self.wind
    }

    /// Sets the air around the body, still air too: it brakes what moves. Negative coefficients are taken as zero.
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// use rapier3d::prelude::*;
    /// let mut flag = DeformableBodyBuilder::cloth([0.6, 0.4], [12, 8], 5.0e-4).build()?;
    /// flag.set_wind(Some(DeformableWind::new(Vector::X * 8.0)))?;
    /// # Ok::<(), DeformableBodyError>(())
    /// ```
    ///
    /// # Errors
    /// [`BodyError::NotFinite`]; of the coefficients as density, drag and friction.
    pub fn set_wind(&mut self, wind: Option<DeformableWind>) -> Result<(), BodyError> {
        if let Some(wind) = wind {
            finite("wind", wind.velocity)?;
            let numbers = [wind.density, wind.drag, wind.friction].map(|c| c as f32);
            finite("density, drag and friction of the wind", numbers.into())?;
        }
        self.wake_up();
        self.wind = wind;
        Ok(())
    }

    /// Adds the accelerations [m/s²] that the wind gives to nodes in a step of `h` \[s\].
    pub(crate) fn add_wind(&self, h: f64, accelerations: &mut [Vec3]) {
        let Some(wind) = self.wind.as_ref() else { return };
        let push = wind.push(&self.model, &self.state.x, &self.state.v);
        for (n, acceleration) in accelerations.iter_mut().enumerate() {
            *acceleration += push.forces[n] / push.divisor(n, self.node_mass(n), h);
        }
    }
}

/// What the wind does to nodes.
#[derive(Clone, Debug)]
pub(crate) struct Push {
    /// \[N\].
    pub forces: Vec<Vec3>,
    /// Force per speed [kg/s].
    pub coefficients: Vec<f64>,
}

impl Push {
    fn add(&mut self, nodes: &[u32], force: Vec3, coefficient: f64) {
        let share = 1.0 / nodes.len() as f64;
        for &n in nodes {
            self.forces[n as usize] += force * share;
            self.coefficients[n as usize] += coefficient * share;
        }
    }

    /// What the force on a node is divided by: what is light takes the speed of the air at the most, and not that of the other way.
    pub fn divisor(&self, node: usize, mass: f64, h: f64) -> f64 {
        mass.max(h * self.coefficients[node])
    }
}

impl DeformableWind {
    /// Force per area and squared speed across a plate and along it [kg/m³].
    pub(crate) fn pressures(&self) -> [f64; 2] {
        [self.drag, self.friction].map(|c| 0.5 * self.density.max(0.0) * c.max(0.0))
    }

    /// What it does to nodes at x \[m\] of velocities v [m/s].
    pub(crate) fn push(&self, model: &DeformableModel, x: &[Vec3], v: &[Vec3]) -> Push {
        let mut push = Push { forces: vec![Vec3::zeros(); x.len()], coefficients: vec![0.0; x.len()] };
        let [drag, friction] = self.pressures();
        for panel in panels(model, x) {
            let through = self.through(&panel, v);
            match panel {
                Panel::Plate { nodes, edges: [b, c], is_solid } => {
                    let across = b.cross(&c);
                    let length = across.norm();
                    let along_normal = if length > 0.0 { through.dot(&across) / length } else { continue };
                    let normal = across * (along_normal / length);
                    let slip = through - normal;
                    let drag =
                        if is_pushed(is_solid, along_normal) { drag * along_normal.abs() } else { 0.0 };
                    let [k, l] = [drag, friction * slip.norm()].map(|k| k * 0.5 * length);
                    push.add(&nodes, normal * k + slip * l, k.max(l));
                }
                Panel::Segment { nodes, edge, diameter } => {
                    let length = edge.norm();
                    let across = if length > 0.0 {
                        through - edge * (edge.dot(&through) / (length * length))
                    } else {
                        continue;
                    };
                    let coefficient = drag * across.norm() * length * diameter;
                    push.add(&nodes, across * coefficient, coefficient);
                }
            }
        }
        push
    }

    /// Velocity of the air through a panel, whose nodes have velocities v [m/s].
    pub(crate) fn through(&self, panel: &Panel, v: &[Vec3]) -> Vec3 {
        let nodes = panel.nodes();
        let mean = nodes.iter().map(|&n| v[n as usize]).sum::<Vec3>() / nodes.len() as f64;
        from_real(self.velocity) - mean
    }
}

/// What the wind meets.
pub(crate) enum Panel {
    /// A triangle, by its edges from the first node \[m\].
    Plate { nodes: [u32; 3], edges: [Vec3; 2], is_solid: bool },
    /// Of a rod.
    Segment { nodes: [u32; 2], edge: Vec3, diameter: f64 },
}

impl Panel {
    pub fn nodes(&self) -> &[u32] {
        match self {
            Self::Plate { nodes, .. } => nodes,
            Self::Segment { nodes, .. } => nodes,
        }
    }
}

/// All that the wind meets of a body with its nodes at x \[m\].
pub(crate) fn panels<'a>(model: &'a DeformableModel, x: &'a [Vec3]) -> impl Iterator<Item = Panel> + 'a {
    let surface = &model.surface;
    let plates = surface.triangles.iter().enumerate().map(|(t, &nodes)| {
        let [a, b, c] = nodes.map(|n| x[n as usize]);
        Panel::Plate { nodes, edges: [b - a, c - a], is_solid: t < surface.closed }
    });
    let segments = surface.segments.iter().map(|&e| {
        let nodes = surface.edges[e as usize];
        let [a, b] = nodes.map(|n| n as usize);
        let diameter = model.half_thickness[a] + model.half_thickness[b];
        Panel::Segment { nodes, edge: x[b] - x[a], diameter }
    });
    plates.chain(segments)
}

/// Whether the wind through a plate pushes it: behind a solid there is none.
pub(crate) fn is_pushed(is_solid: bool, along_normal: f64) -> bool {
    !is_solid || along_normal < 0.0
}
