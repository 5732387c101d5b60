//! Deformable bodies: what they are made of, and how they are solved.

use super::{Shape, Vec3};
use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Deformable {
    #[schemars(with = "String")]
    pub name: Spanned<String>,
    #[schemars(with = "Body")]
    pub body: Spanned<Body>,
    #[schemars(with = "Material")]
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

#[derive(Clone, Debug, Deserialize, JsonSchema)]
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
    /// A file, relative to the scene file: tetrahedra from Gmsh, TetGen, MEDIT and VTK files, or a closed surface from OBJ, STL, PLY
    /// and glTF ones, which is repaired and filled.
    Mesh {
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

#[derive(Clone, Debug, Deserialize, JsonSchema)]
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
    /// Up to four terms of a Prony series, each `[ratio, time]`: stiffness over the lasting one, and seconds.
    #[serde(default)]
    pub maxwell_branches: Vec<[f64; 2]>,
}

fn density() -> f64 {
    1000.0
}

fn soft_friction() -> f64 {
    0.5
}

#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Elasticity {
    #[default]
    LinearCorotated,
    Projective,
    FixedCorotated,
    NeoHookean,
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
        let branch =
            |k: usize| self.maxwell_branches.get(k).map_or((0.0, 0.0), |[ratio, time]| (*ratio, *time));
        let material = match self.maxwell_branches.is_empty() {
            true => material,
            false => material.maxwell_branches([branch(0), branch(1), branch(2), branch(3)]),
        };
        match self.strain_limits {
            Some([least, largest]) => material.strain_limits(least, largest),
            None => material,
        }
    }
}

#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Region {
    pub min: Vec3,
    pub max: Vec3,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
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

#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Solver {
    /// A preset that the other keys change.
    pub fidelity: Option<Fidelity>,
    pub kind: Option<SolverKind>,
    pub system: Option<System>,
    pub frames: Option<Frames>,
    pub max_iterations: Option<usize>,
    pub tolerance: Option<f64>,
    pub contact_tolerance: Option<f64>,
    /// Pairs of L-BFGS; 0 for none.
    pub lbfgs: Option<usize>,
}

#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Fidelity {
    Preview,
    Game,
    Engineering,
    Reference,
}

#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SolverKind {
    Projective,
    ConjugateGradients,
    GaussSeidel,
    Jacobi,
    Newton,
}

#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum System {
    RestStiffness,
    Laplacian,
}

#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Frames {
    Automatic,
    Floating,
    PerNode,
}
