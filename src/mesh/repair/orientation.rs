//! Triangles wound alike, and outward.

use super::SurfaceMesh;
use crate::math::from_real;
use rapier3d::math::Vector;

/// Winds the triangles of each piece alike; with `outward` the outermost pieces also so that they enclose a positive volume, and
/// with them what is inside of them: cavities stay cavities.
pub(super) fn orient(mesh: &mut SurfaceMesh, outward: bool) {
    let pieces = wind_alike(mesh);
    if outward {
        let boxes: Vec<[Vector; 2]> = pieces.iter().map(|piece| bounds(mesh, piece)).collect();
        let volumes: Vec<f64> = pieces.iter().map(|piece| volume(mesh, piece)).collect();
        for (k, piece) in pieces.iter().enumerate() {
            let holds = |b: &[Vector; 2]| b[0].cmplt(boxes[k][0]).all() && b[1].cmpgt(boxes[k][1]).all();
            let outermost = (0..pieces.len()).filter(|o| holds(&boxes[*o])).max_by(|a, b| {
                let size = |o: usize| (boxes[o][1] - boxes[o][0]).element_product();
                size(*a).total_cmp(&size(*b))
            });
            if volumes[outermost.unwrap_or(k)] < 0.0 {
                piece.iter().for_each(|t| mesh.triangles[*t as usize].swap(1, 2));
            }
        }
    }
}

/// Pieces of triangles that share edges, each wound as most of its triangles were.
pub(super) fn wind_alike(mesh: &mut SurfaceMesh) -> Vec<Vec<u32>> {
    let edges = mesh.edges();
    // Across edges of two triangles only: beyond three and more nothing is alike.
    let mut neighbours = vec![Vec::new(); mesh.triangles.len()];
    for (edge, uses) in &edges {
        if let [a, b] = uses.triangles[..] {
            neighbours[a as usize].push((b, *edge));
            neighbours[b as usize].push((a, *edge));
        }
    }
    let mut is_seen = vec![false; mesh.triangles.len()];
    let mut pieces = Vec::new();
    for start in 0..mesh.triangles.len() {
        if std::mem::replace(&mut is_seen[start], true) {
            continue;
        }
        let mut piece = vec![start as u32];
        let (mut next, mut turned) = (0, Vec::new());
        while let Some(&triangle) = piece.get(next) {
            next += 1;
            for &(other, edge) in &neighbours[triangle as usize] {
                if !std::mem::replace(&mut is_seen[other as usize], true) {
                    let [own, others] =
                        [triangle, other].map(|t| passes_forward(&mesh.triangles[t as usize], edge));
                    if own == others {
                        mesh.triangles[other as usize].swap(1, 2);
                        turned.push(other);
                    }
                    piece.push(other);
                }
            }
        }
        if 2 * turned.len() > piece.len() {
            piece.iter().for_each(|t| mesh.triangles[*t as usize].swap(1, 2));
        }
        pieces.push(piece);
    }
    pieces
}

fn passes_forward([a, b, c]: &[u32; 3], [low, high]: [u32; 2]) -> bool {
    [[a, b], [b, c], [c, a]].contains(&[&low, &high])
}

fn bounds(mesh: &SurfaceMesh, piece: &[u32]) -> [Vector; 2] {
    let corners = piece.iter().flat_map(|t| mesh.triangles[*t as usize]).map(|v| mesh.vertices[v as usize]);
    let start = [Vector::splat(f32::INFINITY), Vector::splat(f32::NEG_INFINITY)];
    corners.fold(start, |[low, high], v| [low.min(v), high.max(v)])
}

/// Against one of its own vertices, so that open pieces far from the origin have a sign too.
fn volume(mesh: &SurfaceMesh, piece: &[u32]) -> f64 {
    let at = |v: u32| from_real(mesh.vertices[v as usize]);
    let origin = at(mesh.triangles[piece[0] as usize][0]);
    let signed = |t: &u32| {
        let [a, b, c] = mesh.triangles[*t as usize].map(|v| at(v) - origin);
        a.dot(&b.cross(&c))
    };
    piece.iter().map(signed).sum()
}
