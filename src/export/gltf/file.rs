//! The file while it is put together: one buffer, and the lists that name parts of it.

use gltf::binary::{Glb, Header};
use gltf::json::accessor::{Accessor, ComponentType, GenericComponentType, Type};
use gltf::json::buffer::{Buffer, Target, View};
use gltf::json::validation::Checked::Valid;
use gltf::json::{Index, Root, Value, serialize};
use rapier3d::math::Vector;
use std::borrow::Cow;

#[derive(Default)]
pub(super) struct File {
    pub root: Root,
    bytes: Vec<u8>,
}

impl File {
    /// Vectors that are read at vertices; with the bounds that positions have to state.
    pub fn vectors(&mut self, values: &[Vector], has_bounds: bool) -> Index<Accessor> {
        let bytes = values.iter().flat_map(|v| v.to_array()).flat_map(f32::to_le_bytes);
        let view = self.view(bytes, Some(Target::ArrayBuffer));
        let accessor = self.accessor(view, ComponentType::F32, Type::Vec3, values.len());
        if has_bounds {
            let low = values.iter().fold(Vector::splat(f32::INFINITY), |a, b| a.min(*b));
            let high = values.iter().fold(Vector::splat(f32::NEG_INFINITY), |a, b| a.max(*b));
            let own = &mut self.root.accessors[accessor.value()];
            [own.min, own.max] = [low, high].map(|v| Some(Value::from(v.to_array().to_vec())));
        }
        accessor
    }

    /// Corners of triangles.
    pub fn corners(&mut self, triangles: &[[u32; 3]]) -> Index<Accessor> {
        let bytes = triangles.as_flattened().iter().flat_map(|v| v.to_le_bytes());
        let view = self.view(bytes, Some(Target::ElementArrayBuffer));
        self.accessor(view, ComponentType::U32, Type::Scalar, 3 * triangles.len())
    }

    /// Numbers that an animation reads, `kind` at a time; times have to state their bounds.
    pub fn numbers(&mut self, values: &[f32], kind: Type, has_bounds: bool) -> Index<Accessor> {
        let view = self.view(values.iter().flat_map(|x| x.to_le_bytes()), None);
        let accessor = self.accessor(view, ComponentType::F32, kind, values.len() / kind.multiplicity());
        if let (true, Some(first), Some(last)) = (has_bounds, values.first(), values.last()) {
            let own = &mut self.root.accessors[accessor.value()];
            [own.min, own.max] = [first, last].map(|x| Some(Value::from(vec![*x])));
        }
        accessor
    }

    fn view(&mut self, bytes: impl Iterator<Item = u8>, target: Option<Target>) -> Index<View> {
        // All are of four bytes and so stay aligned.
        let from = self.bytes.len();
        self.bytes.extend(bytes);
        self.root.push(View {
            buffer: Index::new(0),
            byte_length: (self.bytes.len() - from).into(),
            byte_offset: Some(from.into()),
            byte_stride: None,
            name: None,
            target: target.map(Valid),
            extensions: None,
            extras: Default::default(),
        })
    }

    fn accessor(
        &mut self,
        view: Index<View>,
        component: ComponentType,
        kind: Type,
        count: usize,
    ) -> Index<Accessor> {
        self.root.push(Accessor {
            buffer_view: Some(view),
            byte_offset: None,
            count: count.into(),
            component_type: Valid(GenericComponentType(component)),
            extensions: None,
            extras: Default::default(),
            type_: Valid(kind),
            min: None,
            max: None,
            name: None,
            normalized: false,
            sparse: None,
        })
    }

    /// The bytes of a `.glb` file.
    pub fn into_bytes(mut self) -> Result<Vec<u8>, String> {
        if !self.bytes.is_empty() {
            self.root.push(Buffer {
                byte_length: self.bytes.len().into(),
                name: None,
                uri: None,
                extensions: None,
                extras: Default::default(),
            });
        }
        let json = serialize::to_vec(&self.root).map_err(|error| error.to_string())?;
        // Header, heads of two chunks, and their padding.
        let length = json.len().next_multiple_of(4) + self.bytes.len() + 28;
        let length =
            u32::try_from(length).map_err(|_| format!("{length} bytes are more than the format has"))?;
        let glb = Glb {
            header: Header { magic: *b"glTF", version: 2, length },
            json: Cow::Owned(json),
            bin: (!self.bytes.is_empty()).then_some(Cow::Owned(self.bytes)),
        };
        glb.to_vec().map_err(|error| error.to_string())
    }
}
