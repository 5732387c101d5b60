//! A model as it is saved: what it was made of. What follows from that is made again, to the same bits.

use super::model::DeformableModel;
use crate::math::Vec3;
use crate::mesh::Structure;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Written from references, read into values.
#[derive(Serialize)]
struct Written<'a> {
    structure: &'a Structure,
    fibres: &'a [(u32, Vec3)],
    is_smoothed: bool,
}

#[derive(Deserialize)]
struct Read {
    structure: Structure,
    fibres: Vec<(u32, Vec3)>,
    is_smoothed: bool,
}

/// Unit lengths are kept to this.
const ROUNDING: f64 = 1.0e-9;

impl Serialize for DeformableModel {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let (structure, fibres) = (&*self.structure, &self.fibres[..]);
        Written { structure, fibres, is_smoothed: self.is_smoothed() }.serialize(serializer)
    }
}

/// Checked as any mesh of a user is.
impl<'de> Deserialize<'de> for DeformableModel {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Read { structure, fibres, is_smoothed } = Read::deserialize(deserializer)?;
        structure.check().map_err(D::Error::custom)?;
        let mut model = Self::of(structure);
        for (tet, along) in &fibres {
            let is_one = (*tet as usize) < model.tetrahedron_count();
            if !is_one || !((along.norm() - 1.0).abs() < ROUNDING) {
                return Err(D::Error::custom(format!("fibre {along:?} of tetrahedron {tet} is none")));
            }
        }
        model.add_fibres(&fibres);
        Ok(if is_smoothed { model.smoothed() } else { model })
    }
}
