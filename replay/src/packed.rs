//! A replay as bytes, small enough for a page: positions in 16 bits, differences in time, deflated.
//!
//! Within the zlib stream: the length of a header of JSON (u32), the header, filled up to four bytes, and then, little-endian,
//! triangles (u32), vertices of rigid meshes and their poses of each frame (f32), counts of contacts per frame (u32) and the contacts
//! (f32), vertices of soft meshes of each frame (u16: x of all, y, z; of the first frame as they are, of later ones as differences) and
//! stresses (u8, likewise, the root of their share of the largest).

use super::replay::{Replay, ReplayFrame, ReplayMesh};
use serde_json::json;

/// Deflate's effort, of 10. A tumbling slab of 2018 vertices for 5 s (`--test pages`): 2.82 MB at 1, 1.37 at 3, 1.36 at 6 and at 9.
const EFFORT: u8 = 6;

impl Replay {
    /// As bytes that the page's player reads.
    pub fn to_bytes(&self) -> Vec<u8> {
        let soft = |mesh: &&ReplayMesh| mesh.is_soft;
        let bounds = self.bounds();
        let largest = self.frames.iter().flat_map(|f| &f.stresses).copied().fold(0.0, f32::max);
        let mesh = |mesh: &ReplayMesh| {
            json!({
                "name": mesh.name, "soft": mesh.is_soft, "fixed": mesh.is_fixed,
                "vertices": mesh.vertices.len(), "triangles": mesh.triangles.len(),
            })
        };
        let header = json!({
            "version": 1, "rate": self.rate, "times": self.frames.iter().map(|f| f.time).collect::<Vec<_>>(),
            "meshes": self.meshes.iter().map(mesh).collect::<Vec<_>>(),
            "least": bounds[0], "largest": bounds[1], "stress": largest,
        });
        let mut header = header.to_string();
        while !header.len().is_multiple_of(4) {
            header.push(' ');
        }
        let mut bytes = (header.len() as u32).to_le_bytes().to_vec();
        bytes.extend(header.bytes());
        let words = self.meshes.iter().flat_map(|m| m.triangles.iter().flatten());
        bytes.extend(words.flat_map(|word| word.to_le_bytes()));
        let rigid = self.meshes.iter().filter(|m| !soft(m)).flat_map(|m| m.vertices.iter().flatten());
        bytes.extend(rigid.flat_map(|v| v.to_le_bytes()));
        let poses = self.frames.iter().flat_map(|f| f.poses.iter().flatten());
        bytes.extend(poses.flat_map(|v| v.to_le_bytes()));
        bytes.extend(self.frames.iter().flat_map(|f| (f.contacts.len() as u32).to_le_bytes()));
        let contacts = self.frames.iter().flat_map(|f| f.contacts.iter().flatten());
        bytes.extend(contacts.flat_map(|v| v.to_le_bytes()));
        self.add_moving(&bounds, largest, &mut bytes);
        miniz_oxide::deflate::compress_to_vec_zlib(&bytes, EFFORT)
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

    fn add_moving(&self, [low, high]: &[[f32; 3]; 2], largest: f32, bytes: &mut Vec<u8>) {
        let quantised = |frame: &ReplayFrame, k: usize| -> Vec<u16> {
            let scale = 65535.0 / (high[k] - low[k]).max(f32::MIN_POSITIVE);
            frame.vertices.iter().map(|v| ((v[k] - low[k]) * scale).round() as u16).collect()
        };
        for k in 0..3 {
            let mut before: Vec<u16> = Vec::new();
            for frame in &self.frames {
                let now = quantised(frame, k);
                before.resize(now.len(), 0);
                bytes.extend(
                    now.iter().zip(&before).flat_map(|(now, before)| now.wrapping_sub(*before).to_le_bytes()),
                );
                before = now;
            }
        }
        let mut before: Vec<u8> = Vec::new();
        for frame in &self.frames {
            let share = |s: &f32| ((s / largest.max(f32::MIN_POSITIVE)).sqrt() * 255.0).round() as u8;
            let now: Vec<u8> = frame.stresses.iter().map(share).collect();
            before.resize(now.len(), 0);
            bytes.extend(now.iter().zip(&before).map(|(now, before)| now.wrapping_sub(*before)));
            before = now;
        }
    }
}
