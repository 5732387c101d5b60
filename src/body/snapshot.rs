//! A set of bodies as it is saved, and what is checked when it is read: files may be cut, damaged or forged.

use super::attachment::{Anchors, DeformableAttachment};
use super::body::{DeformableBody, Pin, StepReport};
use super::cable::{DeformableCable, Guide};
use super::handle::{DeformableAttachmentHandle, DeformableBodyHandle, DeformableCableHandle};
use super::kinematics::Drive;
use super::set::DeformableBodySet;
use super::settings::SolverSettings;
use super::slots::{Slot, Slots};
use super::state::DeformableState;
use super::touching::{Touch, TouchKey};
use super::wind::DeformableWind;
use crate::energy::CavityFilling;
use crate::fem::DeformableModel;
use crate::material::DeformableMaterial;
use crate::math::Vec3;
use crate::mesh::TetMesh;
use rapier3d::dynamics::{CoefficientCombineRule, RigidBodyHandle, RigidBodyType};
use rapier3d::geometry::InteractionGroups;
use rapier3d::pipeline::{ActiveEvents, ActiveHooks};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

/// Of what is written. Another one is refused: numbers of another layout would be read as something else.
const VERSION: u32 = 11;

/// Comes first, so that nothing of another version is read.
#[derive(Serialize)]
struct Version(u32);

impl<'de> Deserialize<'de> for Version {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match u32::deserialize(deserializer)? {
            VERSION => Ok(Self(VERSION)),
            other => Err(D::Error::custom(format!(
                "deformable bodies were saved in version {other} of their format, this is version {VERSION}"
            ))),
        }
    }
}

/// The fields of a body, whose model is saved once for all bodies that share it.
#[derive(Serialize, Deserialize)]
#[serde(remote = "DeformableBody")]
struct BodyRecord {
    #[serde(skip, default = "no_model")]
    model: Arc<DeformableModel>,
    state: DeformableState,
    #[serde(skip)]
    before: Vec<Vec3>,
    #[serde(skip)]
    materials: Vec<DeformableMaterial>,
    material: DeformableMaterial,
    region_materials: Vec<(u32, DeformableMaterial)>,
    #[serde(skip)]
    masses: Vec<f64>,
    #[serde(skip)]
    node_surfaces: Vec<[f64; 2]>,
    pins: Vec<Pin>,
    held_pins: Vec<Pin>,
    body_type: RigidBodyType,
    drive: Drive,
    wind: Option<DeformableWind>,
    forces: Vec<Vec3>,
    report: StepReport,
    settings: SolverSettings,
    activation: f64,
    region_activations: Vec<(u32, f64)>,
    #[serde(skip)]
    activations: Vec<f64>,
    fillings: Vec<Option<CavityFilling>>,
    gravity_scale: f64,
    enabled: bool,
    can_sleep: bool,
    sleep_speed: f64,
    #[serde(with = "crate::math::finite_or_none")]
    time_until_sleep: f64,
    self_contact: bool,
    collision_groups: InteractionGroups,
    friction_combine_rule: CoefficientCombineRule,
    restitution_combine_rule: CoefficientCombineRule,
    active_events: ActiveEvents,
    active_hooks: ActiveHooks,
    contact_force_event_threshold: f32,
    user_data: u128,
}

/// Stands in while a body is read.
fn no_model() -> Arc<DeformableModel> {
    static TETRAHEDRON: OnceLock<Arc<DeformableModel>> = OnceLock::new();
    let make = || {
        let corners = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mesh = TetMesh::new(corners, vec![[0, 1, 2, 3]]).expect("a tetrahedron is a mesh");
        Arc::new(DeformableModel::new(&mesh))
    };
    TETRAHEDRON.get_or_init(make).clone()
}

struct WrittenBody<'a>(&'a DeformableBody);

impl Serialize for WrittenBody<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        BodyRecord::serialize(self.0, serializer)
    }
}

#[derive(Deserialize)]
struct ReadBody(#[serde(with = "BodyRecord")] DeformableBody);

/// What a slot holds: the place of a body's model in the list, and the body.
#[derive(Serialize, Deserialize)]
struct SlotRecord<B> {
    generation: u32,
    body: Option<(u32, B)>,
}

#[derive(Serialize)]
struct WrittenSet<'a> {
    version: Version,
    models: Vec<&'a DeformableModel>,
    slots: Vec<SlotRecord<WrittenBody<'a>>>,
    attachments: Vec<(&'a DeformableAttachmentHandle, &'a DeformableAttachment)>,
    attached: u64,
    cables: Vec<(&'a DeformableCableHandle, &'a DeformableCable)>,
    cabled: u64,
    released: &'a [RigidBodyHandle],
    touching: Vec<(&'a TouchKey, &'a Touch)>,
}

#[derive(Deserialize)]
struct ReadSet {
    #[serde(rename = "version")]
    _version: Version,
    models: Vec<DeformableModel>,
    slots: Vec<SlotRecord<ReadBody>>,
    attachments: Vec<(DeformableAttachmentHandle, DeformableAttachment)>,
    attached: u64,
    cables: Vec<(DeformableCableHandle, DeformableCable)>,
    cabled: u64,
    released: Vec<RigidBodyHandle>,
    touching: Vec<(TouchKey, Touch)>,
}

impl Serialize for DeformableBodySet {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut places = HashMap::new();
        let mut models = Vec::new();
        let mut slots = Vec::with_capacity(self.bodies.slots().len());
        for of in self.bodies.slots() {
            let body = of.value.as_ref().map(|body| {
                let place = *places.entry(Arc::as_ptr(&body.model)).or_insert_with(|| {
                    models.push(&*body.model);
                    models.len() as u32 - 1
                });
                (place, WrittenBody(body))
            });
            slots.push(SlotRecord { generation: of.generation, body });
        }
        WrittenSet {
            version: Version(VERSION),
            models,
            slots,
            attachments: self.attachments.iter().collect(),
            attached: self.attached,
            cables: self.cables.iter().collect(),
            cabled: self.cabled,
            released: &self.released,
            touching: self.touching.iter().collect(),
        }
        .serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for DeformableBodySet {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        ReadSet::deserialize(deserializer)?.checked().map_err(D::Error::custom)
    }
}

impl ReadSet {
    fn checked(self) -> Result<DeformableBodySet, String> {
        let models: Vec<Arc<DeformableModel>> = self.models.into_iter().map(Arc::new).collect();
        let mut slots = Vec::with_capacity(self.slots.len());
        for (place, SlotRecord { generation, body }) in self.slots.into_iter().enumerate() {
            let value = match body {
                Some((model, ReadBody(mut body))) => {
                    let model = models.get(model as usize);
                    body.model =
                        model.ok_or_else(|| format!("the body in slot {place} has no model"))?.clone();
                    body.check_read().map_err(|what| format!("the body in slot {place}: {what}"))?;
                    Some(body)
                }
                None => None,
            };
            slots.push(Slot { generation, value });
        }
        let mut set = DeformableBodySet {
            bodies: Slots::new(slots),
            attached: self.attached,
            cabled: self.cabled,
            released: self.released,
            touching: self.touching.into_iter().collect(),
            ..DeformableBodySet::default()
        };
        for (handle, attachment) in self.attachments {
            let is_known = handle.0 < set.attached && set.fits(&attachment);
            if !is_known || set.attachments.insert(handle, attachment).is_some() {
                return Err(format!("attachment {} does not fit the bodies", handle.0));
            }
        }
        for (handle, cable) in self.cables {
            let is_known = handle.0 < set.cabled && set.carries(&cable);
            if !is_known || set.cables.insert(handle, cable).is_some() {
                return Err(format!("cable {} does not fit the bodies", handle.0));
            }
        }
        Ok(set)
    }
}

impl DeformableBodySet {
    /// Whether bodies and nodes of a cable are there.
    fn carries(&self, cable: &DeformableCable) -> bool {
        cable.has_sound_numbers()
            && cable.route.iter().all(|guide| match guide {
                Guide::Soft(body, nodes, _) => self
                    .get(*body)
                    .is_some_and(|body| nodes.iter().all(|n| (*n as usize) < body.vertex_count())),
                Guide::World(_) | Guide::Rigid(..) => true,
            })
    }

    /// Whether bodies and nodes of an attachment are there, on their surfaces.
    fn fits(&self, attachment: &DeformableAttachment) -> bool {
        let has = |body: DeformableBodyHandle, nodes: &[u32]| {
            self.get(body).is_some_and(|body| nodes.iter().all(|n| body.model.surface.has_node(*n as usize)))
        };
        let count = attachment.nodes.len();
        has(attachment.body, &attachment.nodes)
            && attachment.has_finite_numbers()
            && match &attachment.anchors {
                Anchors::World(points) | Anchors::Rigid(_, points) => points.len() == count,
                Anchors::Deformable(other, nodes) => {
                    nodes.len() == count && has(*other, nodes) && *other != attachment.body
                }
            }
    }
}

impl DeformableBody {
    /// Whether what was read is a body that a step can go on from.
    fn check_read(&mut self) -> Result<(), String> {
        let count = self.vertex_count();
        let own = self.region_materials.iter().map(|(_, material)| material);
        for material in own.chain([&self.material]) {
            material.validate().map_err(|error| error.to_string())?;
        }
        let known = |(tag, _): &(u32, DeformableMaterial)| self.model.region(*tag).is_some();
        let regions = &self.region_materials;
        if !(regions.is_sorted_by(|a, b| a.0 < b.0) && regions.iter().all(known)) {
            return Err("its regions are not those of its model".to_string());
        }
        for region in self.model.regions() {
            self.check_warp(self.region_material(region), region).map_err(|error| error.to_string())?;
        }
        self.distribute_materials();
        self.state.check(&self.model).map_err(str::to_string)?;
        let are_pins = |pins: &[Pin]| {
            pins.is_sorted_by(|a, b| a.node < b.node)
                && pins.last().is_none_or(|pin| (pin.node as usize) < count)
                && pins.iter().all(|pin| [pin.target, pin.velocity, pin.force].iter().all(is_finite))
        };
        if !are_pins(&self.pins) || !are_pins(&self.held_pins) || self.is_led() && self.pins.len() != count {
            return Err("its pins are none".to_string());
        }
        if !(self.forces.is_empty() || self.forces.len() == count && self.forces.iter().all(is_finite)) {
            return Err("its forces are not those of its vertices".to_string());
        }
        let drives = [self.drive.linvel, self.drive.angvel].iter().all(is_finite);
        let blows = self.wind.is_none_or(|wind| {
            wind.velocity.is_finite()
                && [wind.density, wind.drag, wind.friction].iter().all(|c| c.is_finite())
        });
        let cavities = self.model.cavities.len();
        let fits = self.fillings.is_empty() || self.fillings.len() == cavities;
        if !fits || self.fillings.iter().flatten().any(|filling| filling.fault().is_some()) {
            return Err("what fills its cavities does not fit them".to_string());
        }
        let scales = self.are_activations() && self.gravity_scale.is_finite();
        if !(drives && blows && scales && !self.time_until_sleep.is_nan()) {
            return Err("a number of it is out of range".to_string());
        }
        // Brings what is out of range into it; of those that were in range nothing changes.
        let sleep = std::mem::take(&mut self.state.sleep);
        self.set_settings(self.settings);
        self.state.sleep = sleep;
        Ok(())
    }
}

pub(super) fn is_finite(v: &Vec3) -> bool {
    v.iter().all(|c| c.is_finite())
}
