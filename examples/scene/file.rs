//! The scene file: what it may hold, and what is said of one that holds something else.

use rapier3d::prelude::JointAxis;
use serde::Deserialize;
use std::fmt::Write as _;
use std::ops::Range;
use toml::Spanned;

type Vec3 = [f32; 3];

/// A whole scene.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    pub world: World,
    #[serde(default)]
    pub rigid: Vec<Rigid>,
    #[serde(default)]
    pub joint: Vec<Joint>,
    #[serde(default)]
    pub deformable: Vec<Deformable>,
    #[serde(default)]
    pub attach: Vec<Attach>,
    #[serde(default, rename = "move")]
    pub moves: Vec<Move>,
    #[serde(default)]
    pub probe: Vec<Probe>,
    #[serde(default)]
    pub expect: Vec<Expect>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct World {
    #[serde(default = "gravity")]
    pub gravity: Vec3,
    #[serde(default = "dt")]
    pub dt: Spanned<f32>,
    pub duration: Spanned<f32>,
    /// Rapier's solver iterations.
    pub iterations: Option<usize>,
}

fn gravity() -> Vec3 {
    [0.0, -9.81, 0.0]
}

fn dt() -> Spanned<f32> {
    Spanned::new(0..0, 1.0 / 60.0)
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rigid {
    pub name: Spanned<String>,
    pub kind: Kind,
    pub shape: Spanned<Shape>,
    pub mass: Option<Spanned<f32>>,
    pub density: Option<Spanned<f32>>,
    #[serde(default)]
    pub translation: Vec3,
    /// Axis times angle [degrees].
    #[serde(default)]
    pub rotation: Vec3,
    #[serde(default)]
    pub linvel: Vec3,
    #[serde(default)]
    pub angvel: Vec3,
    #[serde(default = "friction")]
    pub friction: f32,
    #[serde(default)]
    pub restitution: f32,
    #[serde(default)]
    pub can_sleep: bool,
    /// Whether other rigid bodies and deformables touch it.
    #[serde(default = "yes")]
    pub collides: bool,
}

fn yes() -> bool {
    true
}

fn friction() -> f32 {
    0.5
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    Fixed,
    Dynamic,
    Kinematic,
}

/// Two rigid bodies held together.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Joint {
    pub between: [Spanned<String>; 2],
    pub kind: JointKind,
    /// Where in the world it is at the start.
    pub anchor: Vec3,
    /// Whether the second body becomes a link of a multibody.
    #[serde(default)]
    pub multibody: bool,
    pub motor: Option<Motor>,
}

/// The axis is that of both bodies' frames.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum JointKind {
    Fixed {},
    Revolute { axis: Vec3 },
    Prismatic { axis: Vec3 },
}

impl JointKind {
    pub fn free_axis(&self) -> Option<JointAxis> {
        match self {
            Self::Fixed {} => None,
            Self::Revolute { .. } => Some(JointAxis::AngX),
            Self::Prismatic { .. } => Some(JointAxis::LinX),
        }
    }
}

/// Drives the free axis of a joint with no more than `max_force` [N, N m].
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motor {
    pub velocity: f32,
    pub damping: f32,
    pub max_force: f32,
    /// Other velocities from later times on.
    #[serde(default)]
    pub then: Vec<Switch>,
}

/// A motor's velocity from a time on.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Switch {
    pub at: Spanned<f32>,
    pub velocity: f32,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    Ball { radius: f32 },
    Cuboid { half_extents: Vec3 },
    Capsule { half_height: f32, radius: f32 },
    Cylinder { half_height: f32, radius: f32 },
    Cone { half_height: f32, radius: f32 },
    HalfSpace { normal: Vec3 },
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Deformable {
    pub name: Spanned<String>,
    pub body: Spanned<Body>,
    pub material: Spanned<Material>,
    #[serde(default)]
    pub translation: Vec3,
    /// Axis times angle [degrees].
    #[serde(default)]
    pub rotation: Vec3,
    #[serde(default)]
    pub linvel: Vec3,
    #[serde(default)]
    pub angvel: Vec3,
    /// Vertices in this box of the world, or in one of several, are pinned.
    pub pinned: Option<Regions>,
    #[serde(default)]
    pub self_contact: bool,
    #[serde(default)]
    pub solver: Solver,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Body {
    Lattice {
        half_extents: Vec3,
        cells: [usize; 3],
    },
    Filled {
        shape: Shape,
        cell_size: f32,
    },
    /// A Gmsh file, relative to the scene file.
    Mesh {
        path: String,
    },
    /// A rectangle of triangles in the plane of x and z.
    Cloth {
        half_extents: [f32; 2],
        cells: [usize; 2],
        thickness: f32,
    },
    /// A polyline, cut into `segments` of equal length.
    Rope {
        points: Vec<Vec3>,
        segments: usize,
        radius: f32,
    },
    /// The edges of a lattice as springs.
    Network {
        half_extents: Vec3,
        cells: [usize; 3],
    },
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    pub youngs_modulus: f64,
    pub poisson_ratio: f64,
    #[serde(default = "density")]
    pub density: f64,
    #[serde(default = "soft_friction")]
    pub friction: f64,
    #[serde(default)]
    pub restitution: f64,
    #[serde(default)]
    pub mass_damping: f64,
    #[serde(default)]
    pub stiffness_damping: f64,
    #[serde(default)]
    pub elasticity: Elasticity,
    /// Least and largest stretch.
    pub strain_limits: Option<[f64; 2]>,
}

fn density() -> f64 {
    1000.0
}

fn soft_friction() -> f64 {
    0.5
}

#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Elasticity {
    #[default]
    LinearCorotated,
    Projective,
    FixedCorotated,
    NeoHookean,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    pub min: Vec3,
    pub max: Vec3,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(untagged, expecting = "a box `{ min, max }` or a list of such")]
pub enum Regions {
    One(Region),
    Several(Vec<Region>),
}

impl Regions {
    pub fn all(&self) -> &[Region] {
        match self {
            Self::One(region) => std::slice::from_ref(region),
            Self::Several(regions) => regions,
        }
    }
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Solver {
    /// A preset that the other keys change.
    pub fidelity: Option<Fidelity>,
    pub kind: Option<SolverKind>,
    pub system: Option<System>,
    pub frames: Option<Frames>,
    pub max_iterations: Option<usize>,
    pub tolerance: Option<f64>,
    /// Pairs of L-BFGS; 0 for none.
    pub lbfgs: Option<usize>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fidelity {
    Preview,
    Game,
    Engineering,
    Reference,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SolverKind {
    Projective,
    ConjugateGradients,
    GaussSeidel,
    Jacobi,
    Newton,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum System {
    RestStiffness,
    Laplacian,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Frames {
    Automatic,
    Floating,
    PerNode,
}

/// Surface vertices of a deformable in a box of the world, held by a rigid body where they are at the start.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Attach {
    pub deformable: Spanned<String>,
    pub to: Spanned<String>,
    pub region: Region,
}

/// How a kinematic body moves beside its velocities: smoothly by a vector, or to and fro by it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Move {
    pub of: Spanned<String>,
    /// Begin and end [s].
    pub during: Spanned<[f32; 2]>,
    pub by: Vec3,
    /// Periods to and fro; comes back to where it was then.
    pub swings: Option<u32>,
}

impl Move {
    /// Share of `by` at a time [s].
    pub fn share(&self, time: f32) -> f32 {
        let [begin, end] = *self.during.as_ref();
        let smooth = |t: f32| t.clamp(0.0, 1.0).powi(2) * (3.0 - 2.0 * t.clamp(0.0, 1.0));
        let along = ((time - begin) / (end - begin)).clamp(0.0, 1.0);
        match self.swings {
            None => smooth(along),
            // The first and the last period swell and fade.
            Some(swings) => {
                let turns = along * swings as f32;
                let swell = smooth(turns.min(swings as f32 - turns));
                swell * (std::f32::consts::TAU * turns).sin()
            }
        }
    }
}

/// The vertex of a body that is nearest to a point at the start.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    pub name: Spanned<String>,
    pub of: Spanned<String>,
    pub near: Vec3,
}

/// A number that the scene must come to.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expect {
    pub quantity: Spanned<Quantity>,
    /// Body or probe.
    pub of: Spanned<String>,
    /// The body that touches it, for `force`.
    pub on: Option<Spanned<String>>,
    /// Time [s]; the end if not given.
    pub at: Option<Spanned<f32>>,
    pub equals: Option<f64>,
    pub at_most: Option<f64>,
    pub at_least: Option<f64>,
    /// Tolerance of `equals`.
    pub within: Option<f64>,
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Position of the centre of mass, or of a probe [m].
    X,
    Y,
    Z,
    /// Speed of the fastest vertex, or of a rigid body or probe [m/s].
    Speed,
    /// Volume over volume at rest.
    VolumeRatio,
    /// Vertical contact force between the body and `on` [N].
    Force,
    /// Deepest penetration of the body's contacts [m].
    Penetration,
}

/// Reads and checks a scene; the error says the line, the key and what would be right.
pub fn parse(text: &str) -> Result<Scene, String> {
    let scene: Scene = toml::from_str(text).map_err(|error| syntax_error(text, &error))?;
    check(&scene).map_err(|(span, what)| at_line(text, span.start, &what))?;
    Ok(scene)
}

/// The parser's words, with the key where they lack it and without Rust's names of types.
fn syntax_error(text: &str, error: &toml::de::Error) -> String {
    let offset = error.span().map_or(0, |s| s.start);
    let message = error
        .message()
        .replace("expected f32", "expected a number")
        .replace("expected f64", "expected a number");
    let before = text[..offset.min(text.len())].rsplit(['\n', '{', ',']).next().unwrap_or_default();
    let key: String = before.trim().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
    let named = key.is_empty() || message.contains(&key);
    at_line(text, offset, &if named { message } else { format!("`{key}`: {message}") })
}

fn at_line(text: &str, offset: usize, what: &str) -> String {
    let line = text[..offset.min(text.len())].matches('\n').count();
    let quoted = text.lines().nth(line).unwrap_or_default().trim();
    let mut message = String::new();
    let _ = write!(message, "line {}: {what}\n    {quoted}", line + 1);
    message
}

type Mistake = (Range<usize>, String);

fn check(scene: &Scene) -> Result<(), Mistake> {
    let positive = |value: &Spanned<f32>, key: &str| match *value.as_ref() > 0.0 && value.as_ref().is_finite()
    {
        true => Ok(()),
        false => Err((value.span(), format!("`{key}` is {}, but must be positive", value.as_ref()))),
    };
    positive(&scene.world.dt, "dt")?;
    positive(&scene.world.duration, "duration")?;
    let mut names: Vec<&Spanned<String>> = Vec::new();
    let rigid = scene.rigid.iter().map(|r| &r.name);
    for name in
        rigid.chain(scene.deformable.iter().map(|d| &d.name)).chain(scene.probe.iter().map(|p| &p.name))
    {
        if names.iter().any(|n| n.as_ref() == name.as_ref()) {
            return Err((
                name.span(),
                format!("`name` \"{}\" is taken; every name must be unique", name.as_ref()),
            ));
        }
        names.push(name);
    }
    for body in &scene.rigid {
        if let (Some(mass), Some(_)) = (&body.mass, &body.density) {
            return Err((mass.span(), "give `mass` or `density`, not both".into()));
        }
        body.mass.as_ref().map_or(Ok(()), |m| positive(m, "mass"))?;
        body.density.as_ref().map_or(Ok(()), |d| positive(d, "density"))?;
    }
    for joint in &scene.joint {
        let bodies: Vec<&str> = scene.rigid.iter().map(|r| r.name.as_ref().as_str()).collect();
        for name in &joint.between {
            if !bodies.contains(&name.as_ref().as_str()) {
                return Err(unknown(name, "between", "a rigid body", &bodies));
            }
        }
        if let JointKind::Revolute { axis } | JointKind::Prismatic { axis } = joint.kind
            && (axis.iter().all(|a| *a == 0.0) || !axis.iter().all(|a| a.is_finite()))
        {
            return Err((joint.between[0].span(), "`axis` of this joint must not be zero".into()));
        }
    }
    check_control(scene)?;
    for body in &scene.rigid {
        let problem = shape_problem(body.shape.as_ref());
        problem.map_or(Ok(()), |what| Err((body.shape.span(), format!("`shape`: {what}"))))?;
    }
    for body in &scene.deformable {
        let problem = body_problem(body.body.as_ref());
        problem.map_or(Ok(()), |what| Err((body.body.span(), format!("`body`: {what}"))))?;
        let material = body.material.as_ref().to_material().validate();
        material.map_err(|what| (body.material.span(), format!("`material`: {what}")))?;
    }
    let deformable = |name: &str| scene.deformable.iter().any(|d| d.name.as_ref() == name);
    let rigid = |name: &str| scene.rigid.iter().any(|r| r.name.as_ref() == name);
    let probe = |name: &str| scene.probe.iter().any(|p| p.name.as_ref() == name);
    for p in &scene.probe {
        if !deformable(p.of.as_ref()) {
            return Err(unknown(
                &p.of,
                "of",
                "a deformable",
                &scene.deformable.iter().map(|d| d.name.as_ref().as_str()).collect::<Vec<_>>(),
            ));
        }
    }
    let all: Vec<&str> = names.iter().map(|n| n.as_ref().as_str()).collect();
    for e in &scene.expect {
        let of = e.of.as_ref();
        if !all.contains(&of.as_str()) {
            return Err(unknown(&e.of, "of", "a body or probe", &all));
        }
        let of_deformable_only = matches!(e.quantity.as_ref(), Quantity::VolumeRatio | Quantity::Penetration);
        if of_deformable_only && !deformable(of) {
            return Err((
                e.of.span(),
                format!("`of` must name a deformable for this quantity, and \"{of}\" is none"),
            ));
        }
        if probe(of) && *e.quantity.as_ref() == Quantity::Force {
            return Err((e.of.span(), "a probe has no `force`; name its body".into()));
        }
        match (&e.on, *e.quantity.as_ref() == Quantity::Force) {
            (Some(on), true) if !rigid(on.as_ref()) && !deformable(on.as_ref()) => {
                return Err(unknown(on, "on", "a body", &all));
            }
            (None, true) => {
                return Err((e.quantity.span(), "`force` needs `on`, the body that touches".into()));
            }
            (Some(on), false) => return Err((on.span(), "`on` is for the quantity `force` only".into())),
            _ => {}
        }
        if let Some(at) = &e.at {
            let end = *scene.world.duration.as_ref();
            if !(0.0..=end).contains(at.as_ref()) {
                return Err((
                    at.span(),
                    format!("`at` is {} s, but the scene lasts from 0 to {end} s", at.as_ref()),
                ));
            }
        }
        match (e.equals, e.at_most, e.at_least) {
            (None, None, None) => {
                return Err((
                    e.quantity.span(),
                    "an expectation needs `equals`, `at_most` or `at_least`".into(),
                ));
            }
            (Some(_), ..) if e.within.is_none() => {
                return Err((e.quantity.span(), "`equals` needs `within`, its tolerance".into()));
            }
            _ => {}
        }
    }
    Ok(())
}

/// What holds and drives: attachments, moves and motors.
fn check_control(scene: &Scene) -> Result<(), Mistake> {
    let rigid: Vec<&str> = scene.rigid.iter().map(|r| r.name.as_ref().as_str()).collect();
    let soft: Vec<&str> = scene.deformable.iter().map(|d| d.name.as_ref().as_str()).collect();
    for attach in &scene.attach {
        if !soft.contains(&attach.deformable.as_ref().as_str()) {
            return Err(unknown(&attach.deformable, "deformable", "a deformable", &soft));
        }
        if !rigid.contains(&attach.to.as_ref().as_str()) {
            return Err(unknown(&attach.to, "to", "a rigid body", &rigid));
        }
    }
    for motion in &scene.moves {
        let kinematic = scene.rigid.iter().filter(|r| r.kind == Kind::Kinematic);
        let kinematic: Vec<&str> = kinematic.map(|r| r.name.as_ref().as_str()).collect();
        if !kinematic.contains(&motion.of.as_ref().as_str()) {
            return Err(unknown(&motion.of, "of", "a kinematic body", &kinematic));
        }
        let [begin, end] = *motion.during.as_ref();
        if !(begin >= 0.0 && begin < end && end.is_finite()) {
            let message = format!(
                "`during` is from {begin} to {end} s, but must begin at 0 or later and before it ends"
            );
            return Err((motion.during.span(), message));
        }
    }
    for switch in scene.joint.iter().filter_map(|j| j.motor.as_ref()).flat_map(|m| &m.then) {
        if !(*switch.at.as_ref() >= 0.0) {
            return Err((
                switch.at.span(),
                format!("`at` is {} s, but must not be negative", switch.at.as_ref()),
            ));
        }
    }
    Ok(())
}

fn shape_problem(shape: &Shape) -> Option<String> {
    let lengths: Vec<(&str, f32)> = match shape {
        Shape::Ball { radius } => vec![("radius", *radius)],
        Shape::Cuboid { half_extents } => half_extents.iter().map(|e| ("half_extents", *e)).collect(),
        Shape::Capsule { half_height, radius }
        | Shape::Cylinder { half_height, radius }
        | Shape::Cone { half_height, radius } => vec![("half_height", *half_height), ("radius", *radius)],
        Shape::HalfSpace { normal } => {
            let zero = normal.iter().all(|n| *n == 0.0) || !normal.iter().all(|n| n.is_finite());
            return zero.then(|| "`normal` must not be zero".into());
        }
    };
    let wrong = lengths.into_iter().find(|(_, length)| !(*length > 0.0 && length.is_finite()));
    wrong.map(|(key, length)| format!("`{key}` is {length}, but must be positive"))
}

fn body_problem(body: &Body) -> Option<String> {
    match body {
        Body::Lattice { half_extents, cells } => {
            if cells.contains(&0) {
                return Some(format!("`cells` is {cells:?}, but every axis needs at least one"));
            }
            shape_problem(&Shape::Cuboid { half_extents: *half_extents })
        }
        Body::Filled { shape, cell_size } => {
            let wrong = !(*cell_size > 0.0 && cell_size.is_finite());
            let size = wrong.then(|| format!("`cell_size` is {cell_size}, but must be positive"));
            size.or_else(|| shape_problem(shape))
        }
        Body::Network { half_extents, cells } => {
            let lattice = Body::Lattice { half_extents: *half_extents, cells: *cells };
            body_problem(&lattice)
        }
        Body::Cloth { half_extents: [x, z], cells, thickness } => {
            if cells.contains(&0) {
                return Some(format!("`cells` is {cells:?}, but every axis needs at least one"));
            }
            let thin = !(*thickness > 0.0 && thickness.is_finite());
            let thin = thin.then(|| format!("`thickness` is {thickness}, but must be positive"));
            thin.or_else(|| shape_problem(&Shape::Cuboid { half_extents: [*x, *thickness, *z] }))
        }
        Body::Rope { points, segments, radius } => {
            if points.len() < 2 || *segments == 0 {
                return Some("a rope needs at least two `points` and one of `segments`".into());
            }
            shape_problem(&Shape::Ball { radius: *radius })
        }
        Body::Mesh { .. } => None,
    }
}

impl Material {
    pub fn to_material(&self) -> foible3d::DeformableMaterial {
        let material = foible3d::DeformableMaterial::new(self.youngs_modulus, self.poisson_ratio)
            .density(self.density)
            .friction(self.friction)
            .restitution(self.restitution)
            .mass_damping(self.mass_damping)
            .stiffness_damping(self.stiffness_damping)
            .elasticity(match self.elasticity {
                Elasticity::LinearCorotated => foible3d::Elasticity::LinearCorotated,
                Elasticity::Projective => foible3d::Elasticity::Projective,
                Elasticity::FixedCorotated => foible3d::Elasticity::FixedCorotated,
                Elasticity::NeoHookean => foible3d::Elasticity::NeoHookean,
            });
        match self.strain_limits {
            Some([least, largest]) => material.strain_limits(least, largest),
            None => material,
        }
    }
}

fn unknown(name: &Spanned<String>, key: &str, what: &str, right: &[&str]) -> Mistake {
    let there_are = if right.is_empty() { "none".into() } else { right.join(", ") };
    let message = format!("`{key}` names \"{}\", which is not {what}; there are: {there_are}", name.as_ref());
    (name.span(), message)
}
