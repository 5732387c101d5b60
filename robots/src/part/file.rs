//! What may stand in a file of soft parts.

use crate::error::{Place, RobotError};
use foible3d::DeformableMaterial;
use serde::Deserialize;
use std::ops::Range;
use std::path::Path;
use toml::Spanned;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct PartsFile {
    #[serde(default)]
    part: Vec<Spanned<Part>>,
}

/// One soft part.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Part {
    pub name: Spanned<String>,
    /// The link that carries it.
    pub link: Spanned<String>,
    pub shape: Spanned<Shape>,
    /// In the link's frame.
    #[serde(default)]
    pub pose: Option<Spanned<PartPose>>,
    pub material: Spanned<Material>,
    pub attach: Spanned<Attach>,
    /// Further links that it does not touch.
    #[serde(default)]
    pub ignore: Vec<Spanned<String>>,
    /// Elements that do not lock where the material hardly changes its volume.
    #[serde(default)]
    pub smoothed: bool,
}

/// Lengths in metres. Capsules and cylinders stand along z, as in URDF.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub(super) enum Shape {
    Cuboid(Cuboid),
    Ball(Ball),
    Capsule(Round),
    Cylinder(Round),
    Mesh(Mesh),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Cuboid {
    pub size: [f64; 3],
    pub cells: [usize; 3],
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Ball {
    pub radius: f64,
    pub cell: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Round {
    pub radius: f64,
    /// Of a capsule without its caps.
    pub length: f64,
    pub cell: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Mesh {
    /// Beside the file of soft parts, unless absolute.
    pub file: String,
    #[serde(default)]
    pub scale: Option<f64>,
    /// Of surfaces, which are filled; files of tetrahedra need none.
    #[serde(default)]
    pub cell: Option<f64>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PartPose {
    #[serde(default)]
    pub xyz: [f64; 3],
    /// As in URDF: about the fixed x, y, z, in this order \[rad\].
    #[serde(default)]
    pub rpy: [f64; 3],
}

/// A preset or a hardness and what differs from it, or Young's modulus and Poisson's ratio.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Material {
    #[serde(default)]
    pub preset: Option<Preset>,
    #[serde(default)]
    pub shore_a: Option<f64>,
    /// \[Pa\]
    #[serde(default)]
    pub young: Option<f64>,
    #[serde(default)]
    pub poisson: Option<f64>,
    /// [kg/m³]
    #[serde(default)]
    pub density: Option<f64>,
    #[serde(default)]
    pub friction: Option<f64>,
    /// Of the rate of strain \[s\].
    #[serde(default)]
    pub damping: Option<f64>,
    /// Of all motion [1/s].
    #[serde(default)]
    pub mass_damping: Option<f64>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Preset {
    #[serde(rename = "sylgard_184")]
    Sylgard184,
    #[serde(rename = "ecoflex_00_30")]
    Ecoflex0030,
    #[serde(rename = "ecoflex_00_50")]
    Ecoflex0050,
    #[serde(rename = "dragon_skin_10")]
    DragonSkin10,
    #[serde(rename = "dragon_skin_20")]
    DragonSkin20,
    #[serde(rename = "dragon_skin_30")]
    DragonSkin30,
    #[serde(rename = "natural_rubber")]
    NaturalRubber,
    #[serde(rename = "texin_245")]
    Texin245,
    #[serde(rename = "plastazote_ld33")]
    PlastazoteLd33,
}

impl Preset {
    pub fn material(self) -> DeformableMaterial {
        match self {
            Self::Sylgard184 => DeformableMaterial::sylgard_184(),
            Self::Ecoflex0030 => DeformableMaterial::ecoflex_00_30(),
            Self::Ecoflex0050 => DeformableMaterial::ecoflex_00_50(),
            Self::DragonSkin10 => DeformableMaterial::dragon_skin_10(),
            Self::DragonSkin20 => DeformableMaterial::dragon_skin_20(),
            Self::DragonSkin30 => DeformableMaterial::dragon_skin_30(),
            Self::NaturalRubber => DeformableMaterial::natural_rubber(),
            Self::Texin245 => DeformableMaterial::texin_245(),
            Self::PlastazoteLd33 => DeformableMaterial::plastazote_ld33(),
        }
    }
}

/// Which vertices of the surface the link leads. In the link's frame.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub(super) enum Attach {
    /// All in a box.
    Inside(Inside),
    /// All so near to a plane, on either side.
    Plane(Plane),
    /// All so near to the link's shapes, beyond the nearest.
    Nearest(Nearest),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Inside {
    pub center: [f64; 3],
    pub size: [f64; 3],
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Plane {
    pub point: [f64; 3],
    pub normal: [f64; 3],
    pub within: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Nearest {
    pub within: f64,
}

/// Lines of a text.
pub(super) struct Lines<'a> {
    text: &'a str,
    file: &'a Path,
}

impl<'a> Lines<'a> {
    pub fn new(text: &'a str, file: &'a Path) -> Self {
        Self { text, file }
    }

    pub fn place(&self, span: Range<usize>) -> Place {
        let before = self.text.as_bytes().get(..span.start).unwrap_or_default();
        Place::new(self.file, 1 + before.iter().filter(|byte| **byte == b'\n').count())
    }
}

/// Reads the parts of a file.
pub(super) fn read(lines: &Lines<'_>) -> Result<Vec<Spanned<Part>>, RobotError> {
    let file: PartsFile = toml::from_str(lines.text).map_err(|error| RobotError::Syntax {
        place: lines.place(error.span().unwrap_or_default()),
        reason: error.message().to_string(),
    })?;
    Ok(file.part)
}
