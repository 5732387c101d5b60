//! Tetrahedra on their way to a mesh: vertices that know where they belong and move there.

use super::domain::Domain;
use super::stuffing::Stuffing;
use crate::math::Vec3;
use crate::mesh::surface::boundary_triangles;
use crate::mesh::tet_mesh::signed_volume;

/// Where a vertex may be.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Home {
    Inside,
    /// On the surface, in these patches: of a smooth one none is named; two share a crease; more a corner.
    Surface(Vec<u32>),
}

/// A mesh whose vertices still move.
pub(super) struct Draft {
    pub points: Vec<Vec3>,
    pub tetrahedra: Vec<[u32; 4]>,
    pub home: Vec<Home>,
    /// Tetrahedra at each vertex.
    pub around: Vec<Vec<u32>>,
    /// The other two corners of each boundary triangle at a vertex.
    skin: Vec<Vec<[u32; 2]>>,
}

impl Draft {
    pub fn new(stuffing: Stuffing, domain: &Domain) -> Self {
        let Stuffing { mut points, tetrahedra, is_on_surface } = stuffing;
        for (x, _) in points.iter_mut().zip(&is_on_surface).filter(|(_, on)| **on) {
            *x = domain.nearest(x);
        }
        let mut around = vec![Vec::new(); points.len()];
        for (t, tet) in tetrahedra.iter().enumerate() {
            tet.iter().for_each(|v| around[*v as usize].push(t as u32));
        }
        let home = |(x, on): (&Vec3, &bool)| match (on, domain.creases()) {
            (false, _) => Home::Inside,
            (true, Some((creases, mesh))) => Home::Surface(vec![creases.patch_at(mesh, x)]),
            (true, None) => Home::Surface(Vec::new()),
        };
        let home = points.iter().zip(&is_on_surface).map(home).collect();
        let mut draft = Self { points, tetrahedra, home, around, skin: Vec::new() };
        draft.find_skin();
        draft
    }

    /// Finds the boundary anew, after vertices have been added.
    pub fn find_skin(&mut self) {
        self.skin = vec![Vec::new(); self.points.len()];
        for [a, b, c] in boundary_triangles(&self.tetrahedra).unwrap_or_default() {
            for [v, next, last] in [[a, b, c], [b, c, a], [c, a, b]] {
                self.skin[v as usize].push([next, last]);
            }
        }
    }

    /// Whether a triangle of the boundary would turn by more than 90° if a vertex were at `x`. Sharp corners fold over
    /// their neighbours so, with no tetrahedron inverted: hulls were 5 % larger than they are.
    fn folds(&self, vertex: usize, x: &Vec3) -> bool {
        self.skin[vertex].iter().any(|ends| {
            let [a, b] = ends.map(|v| self.points[v as usize]);
            let normal = |x: &Vec3| (a - x).cross(&(b - x));
            normal(x).dot(&normal(&self.points[vertex])) < 0.0
        })
    }

    /// \[m³\]
    pub fn volume(&self) -> f64 {
        self.tetrahedra.iter().map(|tet| signed_volume(&tet.map(|v| self.points[v as usize]))).sum()
    }

    /// See [`quality`].
    pub fn quality(&self, tet: &[u32; 4]) -> f64 {
        quality(&tet.map(|v| self.points[v as usize]))
    }

    /// Quality of the tetrahedron between a triangle, seen counterclockwise from `x`, and `x`.
    pub fn quality_to(&self, triangle: &[u32; 3], x: &Vec3) -> f64 {
        let [a, b, c] = triangle.map(|v| self.points[v as usize]);
        quality(&[a, b, c, *x])
    }

    /// Adds the tetrahedron between a triangle of the boundary and a new vertex.
    pub fn grow(&mut self, &[a, b, c]: &[u32; 3], x: Vec3, home: Home) {
        let (new, t) = (self.points.len() as u32, self.tetrahedra.len() as u32);
        self.points.push(x);
        self.home.push(home);
        self.around.push(Vec::new());
        self.tetrahedra.push([a, b, c, new]);
        [a, b, c, new].into_iter().for_each(|v| self.around[v as usize].push(t));
    }

    /// The worst quality at a vertex.
    pub fn worst_at(&self, vertex: usize) -> f64 {
        self.worst_if(vertex, self.points[vertex])
    }

    /// The worst quality at a vertex if it were at `x`; −∞ if the surface would fold there.
    pub fn worst_if(&self, vertex: usize, x: Vec3) -> f64 {
        if self.folds(vertex, &x) {
            return f64::NEG_INFINITY;
        }
        let point = |v: u32| if v as usize == vertex { x } else { self.points[v as usize] };
        let tets = self.around[vertex].iter().map(|&t| self.tetrahedra[t as usize]);
        tets.map(|tet| quality(&tet.map(point))).fold(f64::MAX, f64::min)
    }

    /// The mean place of a vertex's neighbours, each counted once for each tetrahedron.
    pub fn middle_of_neighbours(&self, vertex: usize) -> Vec3 {
        let around = &self.around[vertex];
        let all = around.iter().flat_map(|&t| self.tetrahedra[t as usize]);
        let sum: Vec3 = all.filter(|&v| v as usize != vertex).map(|v| self.points[v as usize]).sum();
        sum / (3 * around.len()) as f64
    }

    /// The nearest place to `x` where a vertex may be.
    pub fn at_home(&self, vertex: usize, x: &Vec3, domain: &Domain) -> Option<Vec3> {
        match (&self.home[vertex], domain.creases()) {
            (Home::Inside, _) => Some(*x),
            (Home::Surface(patches), creases) => match (&patches[..], creases) {
                ([], _) => Some(domain.nearest(x)),
                (&[patch], Some((creases, mesh))) => {
                    let at = domain.nearest(x);
                    (creases.patch_at(mesh, &at) == patch).then_some(at)
                }
                (&[p, q], Some((creases, _))) => creases.nearest_on(&[p, q], x),
                _ => None,
            },
        }
    }

    /// Parts an edge at a new vertex, if every tetrahedron around it keeps a quality of `least`.
    pub fn split(&mut self, [a, b]: [u32; 2], at: Vec3, home: Home, least: f64) {
        let new = self.points.len() as u32;
        let both = |t: &&u32| self.tetrahedra[**t as usize].contains(&b);
        let around: Vec<u32> = self.around[a as usize].iter().filter(both).copied().collect();
        let replaced = |t: u32, old: u32| self.tetrahedra[t as usize].map(|v| if v == old { new } else { v });
        let halves: Vec<[[u32; 4]; 2]> = around.iter().map(|&t| [replaced(t, b), replaced(t, a)]).collect();
        self.points.push(at);
        if halves.iter().flatten().any(|tet| self.quality(tet) < least) {
            self.points.pop();
            return;
        }
        self.home.push(home);
        self.around.push(Vec::new());
        for (&t, [with_a, with_b]) in around.iter().zip(halves) {
            let other = self.tetrahedra.len() as u32;
            self.around[b as usize].retain(|&u| u != t);
            self.tetrahedra[t as usize] = with_a;
            self.tetrahedra.push(with_b);
            for v in with_b {
                if v != new && v != b {
                    self.around[v as usize].push(other);
                }
            }
            self.around[b as usize].push(other);
            self.around[new as usize].extend([t, other]);
        }
    }
}

/// Volume over the cubed root mean square edge, 1 for a regular tetrahedron; negative if inverted. It falls towards
/// dihedral angles of 0° and of 180° alike [Parthasarathy Graichen Hathaway 1994].
fn quality(x: &[Vec3; 4]) -> f64 {
    let square = |(i, j): (usize, usize)| (x[i] - x[j]).norm_squared();
    let squares: f64 = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)].into_iter().map(square).sum();
    let length = (squares / 6.0).sqrt();
    6.0 * 2f64.sqrt() * signed_volume(x) / (length * length * length)
}
