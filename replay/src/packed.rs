//! A replay as bytes, small enough for a page: positions in 16 bits, differences in time, deflated.
//!
//! Within the zlib stream: the length of a header of JSON (u32), the header, filled up to four bytes, and then, little-endian,
//! triangles (u32), vertices of rigid meshes and their poses of each frame (f32), counts of contacts per frame (u32) and the contacts
//! (f32), vertices of soft meshes of each frame (u16: x of all, y, z; of the first frame as they are, of later ones as differences) and
//! stresses (u8, likewise, the root of their share of the largest). A mesh is in the frames from `first` up to `end`; before it stands as
//! it comes, behind as it went.

use super::replay::{Replay, ReplayFrame, ReplayMesh, UpAxis};
use serde_json::json;

/// Deflate's effort, of 10. A tumbling slab of 2018 vertices for 5 s (`--test pages`): 2.82 MB at 1, 1.37 at 3, 1.36 at 6 and at 9.
const EFFORT: u8 = 6;

/// Values of the meshes as they come: those that later frames have and earlier ones do not.
fn firsts<T: Copy>(frames: &[ReplayFrame], values: impl Fn(&ReplayFrame) -> &[T]) -> Vec<T> {
    let mut firsts: Vec<T> = Vec::new();
    for frame in frames {
        let known = firsts.len();
        firsts.extend(values(frame).get(known..).unwrap_or_default());
    }
    firsts
}

/// The values of a frame, behind them those of meshes to come.
fn filled<'a, T>(own: &'a [T], firsts: &'a [T]) -> impl Iterator<Item = &'a T> {
    own.iter().chain(firsts.get(own.len()..).unwrap_or_default())
}

impl Replay {
    /// As bytes that the page's player reads.
    pub fn to_bytes(&self) -> Vec<u8> {
        let bounds = self.bounds();
        let largest = self.frames.iter().flat_map(|f| &f.stresses).copied().fold(0.0, f32::max);
        let mut header = self.header(&bounds, largest);
        while !header.len().is_multiple_of(4) {
            header.push(' ');
        }
        let mut bytes = (header.len() as u32).to_le_bytes().to_vec();
        bytes.extend(header.bytes());
        let words = self.meshes.iter().flat_map(|m| m.triangles.iter().flatten());
        bytes.extend(words.flat_map(|word| word.to_le_bytes()));
        let rigid = self.meshes.iter().filter(|m| !m.is_soft).flat_map(|m| m.vertices.iter().flatten());
        bytes.extend(rigid.flat_map(|v| v.to_le_bytes()));
        let first = firsts(&self.frames, |frame| &frame.poses);
        let poses = self.frames.iter().flat_map(|f| filled(&f.poses, &first).flatten());
        bytes.extend(poses.flat_map(|v| v.to_le_bytes()));
        bytes.extend(self.frames.iter().flat_map(|f| (f.contacts.len() as u32).to_le_bytes()));
        let contacts = self.frames.iter().flat_map(|f| f.contacts.iter().flatten());
        bytes.extend(contacts.flat_map(|v| v.to_le_bytes()));
        self.add_moving(&bounds, &mut bytes);
        self.add_stresses(largest, &mut bytes);
        miniz_oxide::deflate::compress_to_vec_zlib(&bytes, EFFORT)
    }

    fn header(&self, bounds: &[[f32; 3]; 2], largest: f32) -> String {
        let mesh = |mesh: &ReplayMesh| {
            json!({
                "name": mesh.name, "soft": mesh.is_soft, "fixed": mesh.is_fixed,
                "first": mesh.first, "end": mesh.end.unwrap_or(self.frames.len()),
                "vertices": mesh.vertices.len(), "triangles": mesh.triangles.len(),
            })
        };
        let header = json!({
            "version": 1, "rate": self.rate, "up": if self.up == UpAxis::Z { "z" } else { "y" },
            "times": self.frames.iter().map(|f| f.time).collect::<Vec<_>>(),
            "meshes": self.meshes.iter().map(mesh).collect::<Vec<_>>(),
            "least": bounds[0], "largest": bounds[1], "stress": largest,
        });
        header.to_string()
    }

    /// Least and largest coordinates of soft vertices.
    fn bounds(&self) -> [[f32; 3]; 2] {
        let vertices =
            self.frames.iter().flat_map(|f| &f.vertices).filter(|v| v.iter().all(|c| c.is_finite()));
        let start = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
        let found = vertices.fold(start, |[low, high], v| {
            [0, 1].map(|side| [0, 1, 2].map(|k| if side == 0 { low[k].min(v[k]) } else { high[k].max(v[k]) }))
        });
        if found[0][0] <= found[1][0] { found } else { [[0.0; 3], [1.0; 3]] }
    }

    fn add_moving(&self, [low, high]: &[[f32; 3]; 2], bytes: &mut Vec<u8>) {
        let first = firsts(&self.frames, |frame| &frame.vertices);
        for k in 0..3 {
            let (low, high) = (f64::from(low[k]), f64::from(high[k]));
            let scale = 65535.0 / (high - low).max(f64::from(f32::MIN_POSITIVE));
            let mut before: Vec<u16> = vec![0; first.len()];
            for frame in &self.frames {
                let vertices = filled(&frame.vertices, &first);
                for (before, v) in before.iter_mut().zip(vertices) {
                    let now = ((f64::from(v[k]) - low) * scale).round() as u16;
                    bytes.extend(now.wrapping_sub(*before).to_le_bytes());
                    *before = now;
                }
            }
        }
    }

    fn add_stresses(&self, largest: f32, bytes: &mut Vec<u8>) {
        let first = firsts(&self.frames, |frame| &frame.stresses);
        let mut before: Vec<u8> = vec![0; first.len()];
        for frame in &self.frames {
            for (before, s) in before.iter_mut().zip(filled(&frame.stresses, &first)) {
                let now = ((s / largest.max(f32::MIN_POSITIVE)).sqrt() * 255.0).round() as u8;
                bytes.push(now.wrapping_sub(*before));
                *before = now;
            }
        }
    }
}
