//! Deformable bodies: what they are made of, and how they are solved.

use super::{Material, Shape, Vec3};
use foible3d::CavityFilling;
use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;

/// A soft body.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Deformable {
    /// Unique among all names of the scene.
    #[schemars(with = "String")]
    pub name: Spanned<String>,
    /// Its shape.
    #[schemars(with = "Body")]
    pub body: Spanned<Body>,
    /// What it is made of.
    #[schemars(with = "Material")]
    pub material: Spanned<Material>,
    /// Where it is \[m\].
    #[serde(default)]
    pub translation: Vec3,
    /// Axis times angle \[degrees\].
    #[serde(default)]
    pub rotation: Vec3,
    /// Velocity \[m/s\].
    #[serde(default)]
    pub linvel: Vec3,
    /// Angular velocity \[rad/s\].
    #[serde(default)]
    pub angvel: Vec3,
    /// Vertices in this box of the world, or in one of several, are pinned.
    pub pinned: Option<Regions>,
    /// Whether it collides with itself.
    #[serde(default)]
    pub self_contact: bool,
    /// Parts of another material: boxes of the body's own frame, later ones over earlier ones, or groups of a mesh file.
    #[serde(default)]
    #[schemars(with = "Vec<RegionMaterial>")]
    pub regions: Vec<Spanned<RegionMaterial>>,
    /// Direction of the warp of woven sheets in the body's own frame, projected on each triangle.
    pub warp: Option<Vec3>,
    /// What fills its closed rooms, the largest first.
    #[serde(default)]
    #[schemars(with = "Vec<Filling>")]
    pub cavities: Vec<Spanned<Filling>>,
    /// How it is solved.
    #[serde(default)]
    pub solver: Solver,
}

/// What fills a closed room. Pressures are above that around the body, in Pa.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Filling {
    /// The same pressure at any volume.
    Pressure {
        /// \[Pa\]
        gauge: f64,
    },
    /// A sealed amount of gas, at the volume at rest of this pressure.
    Gas {
        /// \[Pa\]
        #[serde(default)]
        gauge: f64,
        /// Pressure around the body (101325) \[Pa\].
        #[serde(default = "ambient")]
        ambient: f64,
        /// 1 for slow changes, 1.4 for quick ones of air (1.4).
        #[serde(default = "exponent")]
        exponent: f64,
    },
    /// A liquid, `excess` over the volume at rest.
    Liquid {
        /// Over the volume at rest, as a part of it.
        #[serde(default)]
        excess: f64,
        /// (2.2e9) \[Pa\]
        #[serde(default = "of_water")]
        bulk_modulus: f64,
    },
}

impl Filling {
    /// Of a cavity of this volume at rest \[m³\].
    pub fn at_rest(self, volume: f64) -> CavityFilling {
        match self {
            Self::Pressure { gauge } => CavityFilling::Pressure { gauge },
            Self::Gas { gauge, ambient, exponent } => CavityFilling::Gas { gauge, ambient, volume, exponent },
            Self::Liquid { excess, bulk_modulus } => {
                CavityFilling::Liquid { volume: volume * (1.0 + excess), bulk_modulus }
            }
        }
    }
}

fn ambient() -> f64 {
    101_325.0
}

fn exponent() -> f64 {
    1.4
}

fn of_water() -> f64 {
    2.2e9
}

/// The shape of a soft body.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Body {
    /// A cuboid, cut into cells and those into tetrahedra.
    Lattice {
        /// Half its sides \[m\].
        half_extents: Vec3,
        /// Along x, y and z.
        cells: [usize; 3],
        /// Boxes of its own frame that are left out, whole cells: chambers for `cavities`, holes.
        #[serde(default)]
        hollows: Vec<Region>,
    },
    /// A simple shape, filled with tetrahedra.
    Filled {
        /// What is filled.
        shape: Shape,
        /// Size of the tetrahedra \[m\].
        cell_size: f32,
    },
    /// A file, relative to the scene file: tetrahedra from Gmsh, TetGen, MEDIT and VTK files, or a closed surface from OBJ, STL, PLY
    /// and glTF ones, which is repaired and filled.
    Mesh {
        /// Relative to the scene file.
        path: String,
        /// Size of the tetrahedra \[m\] that a surface is filled with; a twelfth of its size if not given.
        cell_size: Option<f32>,
        /// Metres per unit of the file.
        #[serde(default = "super::rigid::one")]
        scale: f32,
        /// Whether z is up in a surface's file.
        #[serde(default)]
        z_up: bool,
    },
    /// A rectangle of triangles in the plane of x and z.
    Cloth {
        /// Half its sides \[m\].
        half_extents: [f32; 2],
        /// Along x and z.
        cells: [usize; 2],
        /// \[m\]
        thickness: f32,
    },
    /// A polyline, cut into `segments` of equal length.
    Rope {
        /// Through these \[m\].
        points: Vec<Vec3>,
        /// How many.
        segments: usize,
        /// \[m\]
        radius: f32,
    },
    /// The edges of a lattice as springs.
    Network {
        /// Half its sides \[m\].
        half_extents: Vec3,
        /// Along x, y and z.
        cells: [usize; 3],
    },
}

/// A part of a soft body with a material of its own.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RegionMaterial {
    /// Elements whose middle is in this box, before the body is placed \[m\].
    #[serde(rename = "box")]
    pub within: Option<Region>,
    /// Elements of this physical group of a Gmsh file.
    pub group: Option<String>,
    /// Direction of the warp of its woven sheets, if it is not the body's.
    pub warp: Option<Vec3>,
    /// Whether it is rigid, a bone or an insert: a body of its own of its material's density, or part of another.
    #[serde(default)]
    pub rigid: bool,
    /// The rigid body that it is part of, which keeps its mass.
    #[schemars(with = "Option<String>")]
    pub part_of: Option<Spanned<String>>,
    /// What it is made of.
    pub material: Material,
}

/// A box of the world.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Least corner \[m\].
    pub min: Vec3,
    /// Largest corner \[m\].
    pub max: Vec3,
}

/// One box, or several.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "a box `{ min, max }` or a list of such")]
pub enum Regions {
    /// One.
    One(Region),
    /// Several.
    Several(Vec<Region>),
}

impl Regions {
    /// All of them.
    pub fn all(&self) -> &[Region] {
        match self {
            Self::One(region) => std::slice::from_ref(region),
            Self::Several(regions) => regions,
        }
    }
}

/// How a soft body is solved.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Solver {
    /// A preset that the other keys change.
    pub fidelity: Option<Fidelity>,
    /// The solver.
    pub kind: Option<SolverKind>,
    /// The constant matrix.
    pub system: Option<System>,
    /// What the constant matrix turns with.
    pub frames: Option<Frames>,
    /// The formula of a step.
    pub integrator: Option<Integrator>,
    /// Iterations of a step, at the most.
    pub max_iterations: Option<usize>,
    /// Residual where iterations end, over the forces.
    pub tolerance: Option<f64>,
    /// The same of contacts.
    pub contact_tolerance: Option<f64>,
    /// Pairs of L-BFGS; 0 for none.
    pub lbfgs: Option<usize>,
}

/// Speed against accuracy: presets.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Fidelity {
    /// The fastest.
    Preview,
    /// For games.
    Game,
    /// For measurements.
    Engineering,
    /// Converged.
    Reference,
}

/// Solvers.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SolverKind {
    /// Projective Dynamics.
    Projective,
    /// Conjugate gradients.
    ConjugateGradients,
    /// Gauss–Seidel.
    GaussSeidel,
    /// Extended position-based dynamics.
    Xpbd,
    /// Jacobi.
    Jacobi,
    /// Newton's method.
    Newton,
    /// Newton's method for what hangs untouched or settles, else Projective Dynamics.
    Automatic,
}

/// Constant matrices.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum System {
    /// The stiffness at rest.
    RestStiffness,
    /// Projective Dynamics' Laplacian.
    Laplacian,
}

/// What the constant matrix turns with.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Frames {
    /// As the body asks for.
    Automatic,
    /// One frame.
    Floating,
    /// A frame per node.
    PerNode,
}

/// Formulas of a step.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Integrator {
    /// The first order: takes energy from vibrations.
    ImplicitEuler,
    /// The second order, in flight and in contact.
    Bdf2,
}
