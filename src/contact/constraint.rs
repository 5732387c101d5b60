//! A constraint as the solver sees it: three components (normal and two tangents), or one if it is bilateral or without
//! friction.

use super::obstacle::ProxyId;
use crate::body::{ConstraintGeometry, ConstraintKey, ConstraintMemory};
use crate::math::{Vec3, tangents};

/// One endpoint of a contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Endpoint {
    /// A point of a body's surface: a weighted sum of up to three nodes.
    Soft {
        /// Index of the body in the step's list.
        body: usize,
        nodes: [u32; 3],
        /// Sum to one; zero for nodes that do not count.
        weights: [f64; 3],
    },
    /// A point of a rigid body, at the start of the step \[m\].
    Rigid { proxy: ProxyId, point: Vec3 },
    /// The turning of a rigid body: directions are axes then, gaps angles \[rad\] and forces
    /// moments \[N m\].
    Rotation { proxy: ProxyId },
}

/// What forces a constraint may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Law {
    /// Pushes, and rubs within the friction cone.
    Contact { friction: f64 },
    /// Acts along the normal with a force between two bounds \[N\]: in both directions, or only one, or with a given force.
    Bounded { least: f64, most: f64 },
}

impl Law {
    /// Holds in both directions.
    pub const BILATERAL: Self = Self::bilateral(f64::INFINITY);

    /// Holds in both directions, with no more than `limit` \[N\].
    pub const fn bilateral(limit: f64) -> Self {
        Self::Bounded { least: -limit, most: limit }
    }

    /// Whether it pulls as well as pushes.
    pub fn is_bilateral(&self) -> bool {
        matches!(self, Self::Bounded { least, .. } if *least < 0.0)
    }
}

/// A point that a constraint along a path acts on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PathPoint {
    pub endpoint: Endpoint,
    /// Force on the endpoint for each newton of the constraint, and what its motion adds to the gap.
    pub direction: Vec3,
}

/// A contact, or what else binds points. Forces are positive on endpoint 0 and negative on endpoint 1.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Constraint {
    pub endpoints: [Endpoint; 2],
    /// All that a constraint along a path acts on; empty of one between two endpoints. Its `endpoints` are idle then, and the
    /// normal is only a place for its one component.
    pub path: Vec<PathPoint>,
    /// Normal, from endpoint 1 to endpoint 0, and two tangents.
    pub frame: [Vec3; 3],
    /// Distance along the normal at the start of the step \[m\].
    pub gap: f64,
    pub law: Law,
    /// Of a cable at a point that rubs: part of the tension on either side that may be lost there, `1 − e^(−μθ)`. The bounds of the
    /// law follow the tensions.
    pub loss: f64,
    /// Displacement per force that the constraint itself gives way by [m/N].
    pub compliance: f64,
    pub restitution: f64,
    /// Motion over the step of the surface of endpoint 1 along itself, beside the endpoint's own \[m\].
    pub surface_motion: Vec3,
    /// Where the point of a rigid body that an attachment holds is at the start of the step \[m\]; endpoint 1 is at the middle of
    /// its arc. The solver's.
    pub held_point: Option<Vec3>,
    pub key: ConstraintKey,
    /// Force on endpoint 0 in the last step \[N\].
    pub warm_force: Vec3,
    /// De Saxcé shift of the last step, per second of it [m/s].
    pub warm_shift_rate: f64,
    /// Where it acted in the last step.
    pub warm_geometry: Option<ConstraintGeometry>,
    /// What to add to the motion along the normal so that zero is where the step is to end \[m\]: the gap,
    /// restitution and bounded recovery. The solver's.
    pub target_gap: f64,
}

impl Constraint {
    pub fn new(endpoints: [Endpoint; 2], normal: Vec3, gap: f64, key: ConstraintKey) -> Self {
        let [t1, t2] = tangents(&normal);
        Self {
            endpoints,
            path: Vec::new(),
            frame: [normal, t1, t2],
            gap,
            law: Law::Contact { friction: 0.0 },
            loss: 0.0,
            compliance: 0.0,
            restitution: 0.0,
            surface_motion: Vec3::zeros(),
            held_point: None,
            key,
            warm_force: Vec3::zeros(),
            warm_shift_rate: 0.0,
            warm_geometry: None,
            target_gap: gap,
        }
    }

    /// One along a path; `idle` is a proxy that does not yield.
    pub fn along(path: Vec<PathPoint>, idle: ProxyId, gap: f64, law: Law, key: ConstraintKey) -> Self {
        let nothing = Endpoint::Rotation { proxy: idle };
        Self { path, law, ..Self::new([nothing; 2], Vec3::x(), gap, key) }
    }

    /// Whether it holds two points together, pulling or pushing, and does not give way.
    pub fn is_hard_hold(&self) -> bool {
        self.path.is_empty() && self.compliance == 0.0 && self.law.is_bilateral()
    }

    /// Whether it holds a point of a deformable body, pulling or pushing, with any force.
    pub fn holds_deformable(&self) -> bool {
        let is_soft = |endpoint: &Endpoint| matches!(endpoint, Endpoint::Soft { .. });
        self.path.is_empty() && self.law == Law::BILATERAL && self.endpoints.iter().any(is_soft)
    }

    /// Everything that it acts on.
    pub fn all_endpoints(&self) -> impl Iterator<Item = &Endpoint> + Clone {
        self.endpoints.iter().chain(self.path.iter().map(|point| &point.endpoint))
    }

    /// The same, to be changed.
    pub fn all_endpoints_mut(&mut self) -> impl Iterator<Item = &mut Endpoint> {
        self.endpoints.iter_mut().chain(self.path.iter_mut().map(|point| &mut point.endpoint))
    }

    /// Lays a force, as [`Self::force`] gives it, on everything that it acts on.
    pub fn for_each_force(&self, force: &Vec3, mut act: impl FnMut(&Endpoint, Vec3)) {
        if self.path.is_empty() {
            act(&self.endpoints[0], *force);
            act(&self.endpoints[1], -force);
        }
        for PathPoint { endpoint, direction } in &self.path {
            act(endpoint, direction * self.frame[0].dot(force));
        }
    }

    /// What motions of endpoints come to: of endpoint 0 against endpoint 1, or of a path along the normal.
    pub fn relative(&self, motion: impl Fn(&Endpoint) -> Vec3) -> Vec3 {
        if self.path.is_empty() {
            return motion(&self.endpoints[0]) - motion(&self.endpoints[1]);
        }
        let along = |sum: f64, point: &PathPoint| sum + point.direction.dot(&motion(&point.endpoint));
        self.frame[0] * self.path.iter().fold(0.0, along)
    }

    /// Starts from what the last step has left of this constraint.
    pub fn warm_start(&mut self, memory: &ConstraintMemory) {
        self.warm_force = memory.force;
        self.warm_shift_rate = memory.shift_rate;
        self.warm_geometry = Some(memory.geometry);
    }

    /// Components of this constraint in the solver: three, or one.
    pub fn dimension(&self) -> usize {
        match self.law {
            Law::Contact { friction } if friction > 0.0 => 3,
            _ => 1,
        }
    }

    /// Directions of those components.
    pub fn directions(&self) -> &[Vec3] {
        &self.frame[..self.dimension()]
    }

    /// The force in the world of the components `lambda` \[N\].
    pub fn force(&self, lambda: &[f64]) -> Vec3 {
        let terms = self.directions().iter().zip(lambda);
        terms.fold(Vec3::zeros(), |sum, (d, l)| sum + d * *l)
    }
}

impl Endpoint {
    /// A node of the body at a place of the step's list.
    pub fn node(body: usize, node: u32) -> Self {
        Self::Soft { body, nodes: [node, 0, 0], weights: [1.0, 0.0, 0.0] }
    }

    /// Weighted nodes of a soft endpoint; nothing for a proxy.
    pub fn soft_nodes(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let (nodes, weights) = match self {
            Endpoint::Soft { nodes, weights, .. } => (*nodes, *weights),
            Endpoint::Rigid { .. } | Endpoint::Rotation { .. } => ([0; 3], [0.0; 3]),
        };
        let pairs = nodes.into_iter().zip(weights);
        pairs.filter(|(_, w)| *w != 0.0).map(|(n, w)| (n as usize, w))
    }

    /// The rigid proxy of an endpoint that has one.
    pub fn proxy(&self) -> Option<ProxyId> {
        match self {
            Endpoint::Soft { .. } => None,
            Endpoint::Rigid { proxy, .. } | Endpoint::Rotation { proxy } => Some(*proxy),
        }
    }

    /// Whether it is on the soft body at this place.
    pub fn is_of(&self, place: usize) -> bool {
        matches!(self, Endpoint::Soft { body, .. } if *body == place)
    }

    /// Value of a nodal field at a soft endpoint.
    pub fn interpolate(&self, field: &[Vec3]) -> Vec3 {
        self.soft_nodes().fold(Vec3::zeros(), |sum, (n, w)| sum + field[n] * w)
    }
}
