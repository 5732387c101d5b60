//! How sheets bend: Morley's triangle [Morley 1968], whose curvature is that of the slopes across the middles of its edges, with those
//! slopes taken from quadratics through the corners of its neighbours.
//!
//! Slopes of quadratics are exact where the sheet is one, and each edge has one slope for both of its triangles. Elements that lack the first
//! are too stiff on irregular meshes, by a constant factor however fine; those that lack the second too soft. Flat sheets' energy is
//! quadratic: curvatures are sums over nodes, and rotations do not change their lengths [Bergou et al. 2006].

use super::stencils::{Kept, Stencils};
use crate::energy::stencil::StencilKind;
use crate::math::{Mat3, Vec3};
use nalgebra::Vector2;
use std::collections::BTreeMap;

/// A triangle of a sheet, before it is an element.
#[derive(Clone, Copy, Debug)]
pub(super) struct SheetPiece {
    pub nodes: [u32; 3],
    /// \[m\].
    pub thickness: f64,
    pub region: u32,
}

/// Curvature as sums over places: of each its node, and its part of `κ₁₁`, `κ₂₂` and `κ₁₂` per metre \[1/m²\].
type Curvature = Vec<(u32, [f64; 3])>;

/// A sum over nodes.
type Sum = BTreeMap<u32, f64>;

/// Least singular value of a fit, over places at a distance of one about, that counts: below it the places lie nearly on a conic, and take what
/// is farther around into it. Of equilateral triangles it is 0.46, of right ones 0.25. At 0.02 the largest entry of the stiffness of a mesh of random points
/// is five times as large, at 0.2 its rows are half as long again, and either is as exact.
const WEAK_FIT: f64 = 0.05;
/// Rest curvature times the size of a triangle that counts as none \[rad\]: what single precision leaves of a plane.
const FLAT: f64 = 1.0e-6;
/// Part of the largest coefficient of a stencil below which one is rounding.
const ROUNDING: f64 = 1.0e-12;

/// A triangle in its own plane, about its centroid.
#[derive(Clone, Copy, Debug)]
struct Flat {
    corners: [Vector2<f64>; 3],
    /// Of the corners' shape functions [1/m].
    gradients: [Vector2<f64>; 3],
    /// Of the edges opposite of the corners: outward normal, length \[m\].
    normals: [Vector2<f64>; 3],
    lengths: [f64; 3],
    area: f64,
}

/// Adds the bending of triangles that meet at edges, two at the most. Returns the corners opposite of each such edge.
pub(super) fn add_sheet_bends(
    stencils: &mut Stencils,
    pieces: &[SheetPiece],
    rest: &[Vec3],
) -> Vec<[u32; 2]> {
    let flats: Vec<Flat> =
        pieces.iter().map(|piece| Flat::new(piece.nodes.map(|n| rest[n as usize]))).collect();
    let neighbours = neighbours(pieces);
    let sheet = Sheet { pieces, flats: &flats, neighbours: &neighbours, rest };
    let slopes: Vec<[Sum; 3]> = (0..pieces.len()).map(|t| sheet.slopes(t)).collect();
    for t in 0..pieces.len() {
        sheet.add_triangle(t, &slopes, stencils);
    }
    let across = neighbours.iter().enumerate().flat_map(|(t, sides)| {
        sides.iter().enumerate().filter_map(move |(k, side)| {
            let (u, j) = side.filter(|(u, _)| t < *u)?;
            Some([pieces[t].nodes[k], pieces[u].nodes[j]])
        })
    });
    across.collect()
}

/// Of each triangle, across the edges opposite of its corners: the neighbour, and the corner of it that is opposite of the edge.
fn neighbours(pieces: &[SheetPiece]) -> Vec<[Option<(usize, usize)>; 3]> {
    let mut sides: BTreeMap<[u32; 2], Vec<(usize, usize)>> = BTreeMap::new();
    for (t, piece) in pieces.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (piece.nodes[(k + 1) % 3], piece.nodes[(k + 2) % 3]);
            sides.entry([a.min(b), a.max(b)]).or_default().push((t, k));
        }
    }
    let mut neighbours = vec![[None; 3]; pieces.len()];
    for sides in sides.values() {
        if let [(t, k), (u, j)] = sides[..] {
            neighbours[t][k] = Some((u, j));
            neighbours[u][j] = Some((t, k));
        }
    }
    neighbours
}

struct Sheet<'a> {
    pieces: &'a [SheetPiece],
    flats: &'a [Flat],
    neighbours: &'a [[Option<(usize, usize)>; 3]],
    rest: &'a [Vec3],
}

impl Sheet<'_> {
    /// Slopes across the middles of a triangle's edges, outward, of the quadratic through what is around it, above those of its plane.
    fn slopes(&self, t: usize) -> [Sum; 3] {
        let flat = &self.flats[t];
        let curvature = self.fit(t);
        [0, 1, 2].map(|k| {
            let parts = flat.slope_of_curvature(k);
            let mut sum = Sum::new();
            for (node, own) in &curvature {
                *sum.entry(*node).or_default() += parts.iter().zip(own).map(|(a, b)| a * b).sum::<f64>();
            }
            sum
        })
    }

    /// Curvature of the quadratic through a triangle's corners and those opposite of its edges: the least one, where these leave it open.
    fn fit(&self, t: usize) -> Curvature {
        let mut places = self.around(t, false);
        let (mut curvature, weakest) = fit_quadratic(&places);
        if places.len() >= 6 && weakest < WEAK_FIT {
            places = self.around(t, true);
            curvature = fit_quadratic(&places).0;
        }
        places.iter().map(|(node, _)| *node).zip(curvature).collect()
    }

    /// Corners of a triangle and of its neighbours, of theirs too if it is to go far, folded down into its plane.
    fn around(&self, t: usize, far: bool) -> Vec<(u32, Vector2<f64>)> {
        let (piece, flat) = (&self.pieces[t], &self.flats[t]);
        let mut places: Vec<(u32, Vector2<f64>)> = piece.nodes.into_iter().zip(flat.corners).collect();
        for (k, neighbour) in self.neighbours[t].iter().enumerate() {
            let Some((u, j)) = *neighbour else { continue };
            let [a, b] = [1, 2].map(|i| (piece.nodes[(k + i) % 3], flat.corners[(k + i) % 3]));
            let apex = self.unfold([a, b], self.pieces[u].nodes[j], flat.corners[k]);
            places.push(apex);
            if !far {
                continue;
            }
            for (edge, inner) in [([a, apex], b), ([apex, b], a)] {
                let corner = self.pieces[u].nodes.iter().position(|n| *n == inner.0);
                if let Some((v, i)) = corner.and_then(|corner| self.neighbours[u][corner]) {
                    places.push(self.unfold(edge, self.pieces[v].nodes[i], inner.1));
                }
            }
        }
        places
    }

    /// Where a node comes to lie if its triangle with two others is turned about these into the plane, away from `inner`.
    fn unfold(
        &self,
        [a, b]: [(u32, Vector2<f64>); 2],
        apex: u32,
        inner: Vector2<f64>,
    ) -> (u32, Vector2<f64>) {
        let [x, y, z] = [a.0, b.0, apex].map(|n| self.rest[n as usize]);
        let edge = y - x;
        let (along, height) = ((z - x).dot(&edge) / edge.norm(), (z - x).cross(&edge).norm() / edge.norm());
        let direction = (b.1 - a.1).normalize();
        let across = Vector2::new(direction.y, -direction.x);
        let across = if across.dot(&(inner - a.1)) > 0.0 { -across } else { across };
        (apex, a.1 + direction * along + across * height)
    }

    fn add_triangle(&self, t: usize, slopes: &[[Sum; 3]], stencils: &mut Stencils) {
        let (piece, flat) = (&self.pieces[t], &self.flats[t]);
        // Twice the mean curvature, and what of it is a saddle's, per metre.
        let mut curvatures: BTreeMap<u32, [f64; 3]> = BTreeMap::new();
        for k in 0..3 {
            let normal = flat.normals[k];
            let weights = [1.0, normal.x * normal.x - normal.y * normal.y, 2.0 * normal.x * normal.y];
            for (node, slope) in self.bend(t, k, slopes) {
                let own = curvatures.entry(node).or_default();
                own.iter_mut().zip(weights).for_each(|(c, w)| *c += w * slope * flat.lengths[k] / flat.area);
            }
        }
        let neighbours = self.neighbours[t].map(|n| n.map_or(piece, |(u, _)| &self.pieces[u]));
        let [a, b, c] = neighbours.map(|n| n.region);
        let softness = neighbours.iter().chain([&piece]).map(|n| n.thickness.powi(-3)).sum::<f64>() / 4.0;
        let kinds = [StencilKind::MeanCurvature, StencilKind::SaddleCurvature, StencilKind::SaddleCurvature];
        for (k, kind) in kinds.into_iter().enumerate() {
            let largest = curvatures.values().map(|c| c[k].abs()).fold(0.0, f64::max);
            let terms = curvatures.iter().map(|(node, c)| (*node, c[k]));
            let terms = terms.filter(|(_, c)| c.abs() > ROUNDING * largest);
            let at_rest = terms.clone().map(|(node, c)| self.rest[node as usize] * c).sum::<Vec3>().norm();
            let length = if at_rest * flat.area.sqrt() > FLAT { at_rest } else { 0.0 };
            let weight = flat.area / (12.0 * softness);
            if largest > 0.0 {
                stencils.add(terms, Kept { length, weight, kind, regions: [piece.region, a, b, c] });
            }
        }
    }

    /// Slope across an edge of a triangle, outward, above that of its plane: the mean of its own and its neighbour's.
    fn bend(&self, t: usize, k: usize, slopes: &[[Sum; 3]]) -> Sum {
        let mut sum = slopes[t][k].clone();
        let Some((u, j)) = self.neighbours[t][k] else { return sum };
        for (node, slope) in &slopes[u][j] {
            *sum.entry(*node).or_default() -= slope;
        }
        for (t, k) in [(t, k), (u, j)] {
            let (piece, flat) = (&self.pieces[t], &self.flats[t]);
            for (node, gradient) in piece.nodes.into_iter().zip(flat.gradients) {
                *sum.entry(node).or_default() -= gradient.dot(&flat.normals[k]);
            }
        }
        sum.values_mut().for_each(|c| *c *= 0.5);
        sum
    }
}

impl Flat {
    fn new([a, b, c]: [Vec3; 3]) -> Self {
        let along = (b - a).normalize();
        let (l, s) = ((b - a).norm(), along.dot(&(c - a)));
        let height = (c - a - along * s).norm();
        let corners = [Vector2::zeros(), Vector2::new(l, 0.0), Vector2::new(s, height)];
        let centroid = (corners[0] + corners[1] + corners[2]) / 3.0;
        let corners = corners.map(|corner| corner - centroid);
        let edges = [0, 1, 2].map(|k| corners[(k + 2) % 3] - corners[(k + 1) % 3]);
        let lengths = edges.map(|edge| edge.norm());
        let area = 0.5 * l * height;
        // Counterclockwise: the right of an edge is outside.
        let normals = [0, 1, 2].map(|k| Vector2::new(edges[k].y, -edges[k].x) / lengths[k]);
        let gradients = [0, 1, 2].map(|k| normals[k] * (-lengths[k] / (2.0 * area)));
        Self { corners, gradients, normals, lengths, area }
    }

    /// What a unit of `κ₁₁`, `κ₂₂` and `κ₁₂` makes of the slope across the middle of an edge, above that of the plane through the corners.
    fn slope_of_curvature(&self, k: usize) -> [f64; 3] {
        let normal = self.normals[k];
        let middle = (self.corners[(k + 1) % 3] + self.corners[(k + 2) % 3]) / 2.0;
        let height = |x: &Vector2<f64>| [0.5 * x.x * x.x, 0.5 * x.y * x.y, x.x * x.y];
        let mut slope = [normal.x * middle.x, normal.y * middle.y, normal.x * middle.y + normal.y * middle.x];
        for (corner, gradient) in self.corners.iter().zip(&self.gradients) {
            let plane = normal.dot(gradient);
            slope.iter_mut().zip(height(corner)).for_each(|(s, h)| *s -= plane * h);
        }
        slope
    }
}

/// Of each place what it adds per metre to `κ₁₁`, `κ₂₂` and `κ₁₂` of the quadratic through all, or nearest to them in the mean of squares, and of
/// those the one of the least curvature; and the least singular value of the fit.
fn fit_quadratic(places: &[(u32, Vector2<f64>)]) -> (Vec<[f64; 3]>, f64) {
    let squares: f64 = places.iter().map(|(_, x)| x.norm_squared()).sum();
    let scale = (squares / places.len() as f64).sqrt();
    let planes: Vec<Vec3> = places.iter().map(|(_, x)| Vec3::new(1.0, x.x / scale, x.y / scale)).collect();
    // Scaled so that the norm of what is found is that of the curvature.
    let quadratic = |p: &Vec3| Vec3::new(0.5 * p.y * p.y, 0.5 * p.z * p.z, p.y * p.z / 2f64.sqrt());
    let (mut PP, mut PQ) = (Mat3::zeros(), Mat3::zeros());
    for p in &planes {
        PP += p * p.transpose();
        PQ += p * quadratic(p).transpose();
    }
    // The corners of a triangle are among them.
    let fitted = PP.try_inverse().unwrap_or_else(Mat3::zeros) * PQ;
    let beyond: Vec<Vec3> = planes.iter().map(|p| quadratic(p) - fitted.tr_mul(p)).collect();
    let gram: Mat3 = beyond.iter().fold(Mat3::zeros(), |sum, q| sum + q * q.transpose());
    let eigen = gram.symmetric_eigen();
    let inverse = eigen.eigenvalues.map(|l| if l > WEAK_FIT * WEAK_FIT { 1.0 / l } else { 0.0 });
    let inverse = eigen.eigenvectors * Mat3::from_diagonal(&inverse) * eigen.eigenvectors.transpose();
    let curvature = beyond.iter().map(|q| {
        let c = inverse * q / (scale * scale);
        [c.x, c.y, c.z / 2f64.sqrt()]
    });
    (curvature.collect(), eigen.eigenvalues.min().max(0.0).sqrt())
}
