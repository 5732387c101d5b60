//! All bodies of a world as one unstructured grid of VTK's.

use crate::body::DeformableBody;
use crate::pipeline::DeformableWorld;
use vtkio::model::{Attribute, Attributes, CellType, Cells, DataArray, UnstructuredGridPiece, VertexNumbers};

/// Lists of the grid while it is put together.
#[derive(Default)]
struct Lists {
    points: Vec<f64>,
    displacement: Vec<f32>,
    velocity: Vec<f32>,
    traction: Vec<f32>,
    connectivity: Vec<u64>,
    offsets: Vec<u64>,
    types: Vec<CellType>,
    body: Vec<i32>,
    region: Vec<u32>,
    stress: Vec<f32>,
    von_mises: Vec<f32>,
    strain: Vec<f32>,
    density: Vec<f32>,
}

pub(super) fn grid(world: &DeformableWorld) -> UnstructuredGridPiece {
    let mut lists = Lists::default();
    for (k, (handle, body)) in world.bodies.iter().enumerate() {
        let first = (lists.points.len() / 3) as u64;
        // The handle comes from the set.
        lists.add_points(body, &world.contact_tractions(handle).unwrap_or_default());
        lists.add_tetrahedra(body, first);
        lists.add_thin(body, first);
        lists.body.resize(lists.types.len(), k as i32);
    }
    let point = |name: &str, values| Attribute::DataArray(DataArray::vectors(name).with_vec(values));
    let numbers = |name: &str, values, count| {
        Attribute::DataArray(DataArray::scalars(name, count).with_vec::<f32>(values))
    };
    UnstructuredGridPiece {
        points: lists.points.into(),
        cells: Cells {
            cell_verts: VertexNumbers::XML { connectivity: lists.connectivity, offsets: lists.offsets },
            types: lists.types,
        },
        data: Attributes {
            point: vec![
                point("displacement", lists.displacement),
                point("velocity", lists.velocity),
                point("traction", lists.traction),
            ],
            cell: vec![
                Attribute::DataArray(DataArray::scalars("body", 1).with_vec(lists.body)),
                Attribute::DataArray(DataArray::scalars("region", 1).with_vec(lists.region)),
                numbers("cauchy_stress", lists.stress, 9),
                numbers("von_mises", lists.von_mises, 1),
                numbers("green_strain", lists.strain, 9),
                numbers("energy_density", lists.density, 1),
            ],
        },
    }
}

impl Lists {
    fn add_points(&mut self, body: &DeformableBody, tractions: &[[f64; 3]]) {
        for node in body.model().nodes_by_vertex() {
            let (x, rest) = (body.state().x[node], body.model().rest[node]);
            self.points.extend(x.iter());
            self.displacement.extend((x - rest).iter().map(|c| *c as f32));
            self.velocity.extend(body.state().v[node].iter().map(|c| *c as f32));
        }
        self.traction.extend(tractions.iter().flatten().map(|t| *t as f32));
        self.traction.resize(self.points.len(), 0.0);
    }

    fn add_tetrahedra(&mut self, body: &DeformableBody, first: u64) {
        let model = body.model();
        let (stresses, strains, energies) = (body.stresses(), body.strains(), body.element_energies());
        for (e, corners) in model.tetrahedra().enumerate() {
            self.add_cell(CellType::Tetra, &corners, first, model.region_of_tetrahedron(e));
            // A spring network has no stress.
            let Some(stress) = stresses.get(e) else {
                self.add_no_stress();
                continue;
            };
            self.stress.extend(stress.cauchy.iter().flatten().map(|c| *c as f32));
            self.von_mises.push(stress.von_mises() as f32);
            self.strain.extend(strains[e].iter().flatten().map(|c| *c as f32));
            self.density.push((energies[e] / model.tetrahedron_volume(e)) as f32);
        }
    }

    fn add_thin(&mut self, body: &DeformableBody, first: u64) {
        for ((corners, region), stress) in body.model().sheet_triangles().zip(body.sheet_stresses()) {
            self.add_cell(CellType::Triangle, &corners, first, region);
            self.stress.extend(stress.cauchy.iter().flatten().map(|c| *c as f32));
            self.von_mises.push(stress.von_mises() as f32);
            self.strain.extend([f32::NAN; 9]);
            self.density.push(f32::NAN);
        }
        for (ends, region) in body.model().rod_segments() {
            self.add_cell(CellType::Line, &ends, first, region);
            self.add_no_stress();
        }
    }

    fn add_cell(&mut self, kind: CellType, corners: &[u32], first: u64, region: u32) {
        self.types.push(kind);
        self.connectivity.extend(corners.iter().map(|corner| first + u64::from(*corner)));
        self.offsets.push(self.connectivity.len() as u64);
        self.region.push(region);
    }

    fn add_no_stress(&mut self) {
        self.stress.extend([f32::NAN; 9]);
        self.strain.extend([f32::NAN; 9]);
        self.von_mises.push(f32::NAN);
        self.density.push(f32::NAN);
    }
}
