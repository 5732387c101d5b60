//! Deformable bodies as meshes of the viewer's scene.

use foible3d::prelude::*;
use kiss3d::prelude::{Color, GpuMesh3d, SceneNode3d};
use rapier3d::math::Vector;
use std::cell::RefCell;
use std::rc::Rc;

/// A mesh for each body.
pub struct DrawnBodies(Vec<DrawnBody>);

struct DrawnBody {
    handle: DeformableBodyHandle,
    skin: DeformableSkin,
    positions: Vec<Vector>,
    normals: Vec<Vector>,
    node: SceneNode3d,
}

/// One after another.
const COLORS: [[f32; 3]; 6] = [
    [0.85, 0.33, 0.28],
    [0.28, 0.50, 0.80],
    [0.38, 0.68, 0.42],
    [0.92, 0.72, 0.28],
    [0.58, 0.42, 0.70],
    [0.25, 0.66, 0.68],
];

impl DrawnBodies {
    /// Adds the bodies of a world to a scene.
    pub fn new(world: &DeformableWorld, scene: &mut SceneNode3d) -> Self {
        let bodies = world.bodies.iter().zip(COLORS.iter().cycle()).map(|((handle, body), [r, g, b])| {
            let DeformableSurfaceMesh { vertices, normals, triangles } =
                DeformableSurfaceMesh::new(body.model());
            let skin = DeformableSkin::bind(body.model(), &vertices, &normals).expect("a body's own surface");
            let mesh = GpuMesh3d::new(vertices.clone(), triangles, Some(normals.clone()), None, true);
            let mut node = scene.add_mesh(Rc::new(RefCell::new(mesh)), Vector::ONE);
            node.set_color(Color::new(*r, *g, *b, 1.0));
            DrawnBody { handle, skin, positions: vertices, normals, node }
        });
        Self(bodies.collect())
    }

    /// Moves their vertices to where the bodies are.
    pub fn write(&mut self, world: &DeformableWorld) {
        for drawn in &mut self.0 {
            let Some(body) = world.bodies.get(drawn.handle) else { continue };
            let DrawnBody { skin, positions, normals, node, .. } = drawn;
            skin.update(body, positions, normals).expect("buffers of the skin's own size");
            node.modify_vertices(&mut |vertices| vertices.copy_from_slice(positions));
            node.modify_normals(&mut |turned| turned.copy_from_slice(normals));
        }
    }
}
