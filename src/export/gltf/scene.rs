//! Nodes, meshes with their targets, and the animation.
//!
//! A mesh is its body in the first frame in which it is there, `x₀`; its k-th target is `x_k − x₀`, and the weights at the time of
//! frame k are one for that target and zero for the others. Between frames viewers mix the two.

use super::file::File;
use super::recording::{GltfRecording, RecordedBody, RecordedCollider};
use gltf::json::accessor::{Accessor, Type};
use gltf::json::animation::{Animation, Channel, Interpolation, Property, Sampler, Target};
use gltf::json::material::{PbrBaseColorFactor, PbrMetallicRoughness, StrengthFactor};
use gltf::json::mesh::{MorphTarget, Primitive, Semantic};
use gltf::json::scene::UnitQuaternion;
use gltf::json::validation::Checked::Valid;
use gltf::json::{Index, Material, Mesh, Node, Scene};
use rapier3d::math::{Pose, Vector};
use std::collections::BTreeMap;

/// Colours of bodies, one after the other, and of colliders.
const COLOURS: [[f32; 3]; 7] = [
    [0.85, 0.33, 0.22],
    [0.18, 0.52, 0.78],
    [0.95, 0.68, 0.18],
    [0.30, 0.62, 0.35],
    [0.58, 0.38, 0.70],
    [0.20, 0.66, 0.66],
    [0.62, 0.64, 0.67],
];
/// Roughness of all of them: as of rubber.
const ROUGHNESS: f32 = 0.7;

/// The animation while it is put together.
struct Draft {
    file: File,
    times: Index<Accessor>,
    channels: Vec<Channel>,
    samplers: Vec<Sampler>,
    /// Samplers of weights by the target that each frame shows: bodies of one history share theirs.
    of_weights: BTreeMap<Vec<Option<usize>>, Index<Sampler>>,
    nodes: Vec<Index<Node>>,
}

impl GltfRecording {
    pub(super) fn file(&self) -> File {
        let mut file = File::default();
        file.root.asset.generator = Some("foible3d".into());
        if self.times.is_empty() {
            return file;
        }
        for colour in COLOURS {
            let [r, g, b] = colour;
            let pbr_metallic_roughness = PbrMetallicRoughness {
                base_color_factor: PbrBaseColorFactor([r, g, b, 1.0]),
                metallic_factor: StrengthFactor(0.0),
                roughness_factor: StrengthFactor(ROUGHNESS),
                ..Default::default()
            };
            file.root.push(Material { pbr_metallic_roughness, ..Default::default() });
        }
        let times = file.numbers(&self.times, Type::Scalar, true);
        let (channels, samplers, nodes) = (Vec::new(), Vec::new(), Vec::new());
        let mut draft = Draft { file, times, channels, samplers, of_weights: BTreeMap::new(), nodes };
        // A skin may have been given without a frame.
        let bodies = self.bodies.iter().filter(|own| own.frames.iter().any(Option::is_some));
        bodies.enumerate().for_each(|(k, body)| draft.add_body(k, body));
        self.colliders.iter().enumerate().for_each(|(k, collider)| draft.add_collider(k, collider));
        draft.finish()
    }
}

impl Draft {
    fn add_body(&mut self, k: usize, body: &RecordedBody) {
        let Some((base, normals)) = body.frames.iter().flatten().next() else { return };
        let less = |a: &[Vector], b: &[Vector]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>();
        let (mut targets, mut shown) = (Vec::new(), Vec::new());
        // What the last frame showed, and the target of it.
        let mut last = (base, None);
        for frame in &body.frames {
            let Some((positions, of_frame)) = frame else {
                shown.push(None);
                continue;
            };
            if positions != last.0 {
                let places = self.file.vectors(&less(positions, base), true);
                let turned = self.file.vectors(&less(of_frame, normals), false);
                last = (positions, Some(targets.len()));
                targets.push(MorphTarget { positions: Some(places), normals: Some(turned), tangents: None });
            }
            shown.push(last.1);
        }
        let target_count = targets.len();
        let mesh = (&base[..], Some(normals), &body.drawn.triangles[..]);
        let node = self.add_mesh(format!("body_{k}"), mesh, k % (COLOURS.len() - 1), targets);
        if target_count > 0 {
            let sampler = self.weights(shown, target_count);
            self.animate(node, sampler, Property::MorphTargetWeights);
        }
        self.show(node, body.frames.iter().map(Option::is_some));
    }

    /// A sampler of weights: in each frame one for what it shows.
    fn weights(&mut self, shown: Vec<Option<usize>>, targets: usize) -> Index<Sampler> {
        if let Some(known) = self.of_weights.get(&shown) {
            return *known;
        }
        let mut weights = vec![0.0; shown.len() * targets];
        for (row, target) in weights.chunks_mut(targets).zip(&shown) {
            target.iter().for_each(|target| row[*target] = 1.0);
        }
        let sampler = self.sampler(&weights, Type::Scalar, Interpolation::Linear);
        self.of_weights.insert(shown, sampler);
        sampler
    }

    fn add_collider(&mut self, k: usize, collider: &RecordedCollider) {
        let Some(first) = collider.frames.iter().flatten().next() else { return };
        let mesh = (&collider.vertices[..], None, &collider.triangles[..]);
        let node = self.add_mesh(format!("collider_{k}"), mesh, COLOURS.len() - 1, Vec::new());
        let own = &mut self.file.root.nodes[node.value()];
        own.translation = Some(first.translation.to_array());
        own.rotation = Some(UnitQuaternion(first.rotation.to_array()));
        if collider.frames.iter().flatten().any(|pose| pose != first) {
            // Where it is not there, it stays where it was.
            let mut last = *first;
            let follow = |pose: &Option<Pose>| {
                last = pose.unwrap_or(last);
                last
            };
            let poses: Vec<Pose> = collider.frames.iter().map(follow).collect();
            let places: Vec<f32> = poses.iter().flat_map(|pose| pose.translation.to_array()).collect();
            let turns: Vec<f32> = poses.iter().flat_map(|pose| pose.rotation.to_array()).collect();
            let places = self.sampler(&places, Type::Vec3, Interpolation::Linear);
            self.animate(node, places, Property::Translation);
            let turns = self.sampler(&turns, Type::Vec4, Interpolation::Linear);
            self.animate(node, turns, Property::Rotation);
        }
        self.show(node, collider.frames.iter().map(Option::is_some));
    }

    fn add_mesh(
        &mut self,
        name: String,
        (vertices, normals, triangles): (&[Vector], Option<&Vec<Vector>>, &[[u32; 3]]),
        colour: usize,
        targets: Vec<MorphTarget>,
    ) -> Index<Node> {
        let mut attributes =
            BTreeMap::from([(Valid(Semantic::Positions), self.file.vectors(vertices, true))]);
        // Without normals viewers show facets.
        if let Some(normals) = normals {
            attributes.insert(Valid(Semantic::Normals), self.file.vectors(normals, false));
        }
        let weights = (!targets.is_empty()).then(|| vec![0.0; targets.len()]);
        let primitive = Primitive {
            attributes,
            extensions: None,
            extras: Default::default(),
            indices: Some(self.file.corners(triangles)),
            material: Some(Index::new(colour as u32)),
            mode: Valid(gltf::json::mesh::Mode::Triangles),
            targets: (!targets.is_empty()).then_some(targets),
        };
        let primitives = vec![primitive];
        let (extensions, extras) = (None, Default::default());
        let mesh =
            self.file.root.push(Mesh { extensions, extras, name: Some(name.clone()), primitives, weights });
        let node = self.file.root.push(Node { mesh: Some(mesh), name: Some(name), ..Default::default() });
        self.nodes.push(node);
        node
    }

    /// Of no size in frames in which it is not there.
    fn show(&mut self, node: Index<Node>, is_there: impl Iterator<Item = bool>) {
        let sizes: Vec<f32> = is_there.flat_map(|is_there| [f32::from(u8::from(is_there)); 3]).collect();
        if sizes.contains(&0.0) {
            let sampler = self.sampler(&sizes, Type::Vec3, Interpolation::Step);
            self.animate(node, sampler, Property::Scale);
        }
    }

    fn sampler(&mut self, values: &[f32], kind: Type, interpolation: Interpolation) -> Index<Sampler> {
        let output = self.file.numbers(values, kind, false);
        let (extensions, extras, interpolation) = (None, Default::default(), Valid(interpolation));
        let sampler = Sampler { extensions, extras, input: self.times, interpolation, output };
        Index::push(&mut self.samplers, sampler)
    }

    fn animate(&mut self, node: Index<Node>, sampler: Index<Sampler>, path: Property) {
        let target = Target { extensions: None, extras: Default::default(), node, path: Valid(path) };
        self.channels.push(Channel { sampler, target, extensions: None, extras: Default::default() });
    }

    fn finish(self) -> File {
        let Self { mut file, channels, samplers, nodes, .. } = self;
        let (extensions, extras, name) = (None, Default::default(), None);
        if !channels.is_empty() {
            file.root.push(Animation { extensions, extras, channels, name: Some("run".into()), samplers });
        }
        let scene = file.root.push(Scene { extensions: None, extras: Default::default(), name, nodes });
        file.root.scene = Some(scene);
        file
    }
}
