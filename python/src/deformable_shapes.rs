//! Builders of deformable bodies: shapes and meshes.

use crate::arrays::{Triple, count, indices, list, number, points};
use crate::collider_builder::mesh;
use crate::deformable::PyDeformableBody;
use crate::deformable_builder::{PyDeformableBuilder, SPREAD};
use crate::errors::{bad_value, raised, without_panic};
use crate::options::apply;
use foible3d::{DeformableModel, MeshError, Structure, SurfaceMesh, TetMesh};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rapier3d::parry::shape::{Ball, Capsule, Cylinder, Shape};
use std::path::PathBuf;

type Options<'a, 'py> = &'a Bound<'py, PyDict>;
type Built<'py> = PyResult<Bound<'py, PyDeformableBuilder>>;

/// A builder of what `make` makes, while other threads run: filling a shape takes its time.
fn build<'py>(
    py: Python<'py>,
    options: Option<Options<'_, 'py>>,
    make: impl FnOnce() -> Result<DeformableModel, MeshError> + Send,
) -> Built<'py> {
    let model = py.detach(|| without_panic(make))?.map_err(raised)?;
    apply(Bound::new(py, PyDeformableBuilder::of(model))?, options, &SPREAD)
}

fn filled<'py>(
    py: Python<'py>,
    options: Option<Options<'_, 'py>>,
    shape: impl Shape,
    cell_size: f64,
) -> Built<'py> {
    build(py, options, move || {
        TetMesh::fill_shape(&shape, cell_size as f32).map(|mesh| DeformableModel::new(&mesh))
    })
}

fn counts<const N: usize>(cells: [i64; N]) -> PyResult<[usize; N]> {
    let mut counts = [0; N];
    for (place, (own, cells)) in counts.iter_mut().zip(cells).enumerate() {
        *own = count(&format!("cells[{place}]"), cells)?;
    }
    Ok(counts)
}

/// What is in a file: tetrahedra, or a surface to be filled.
fn read(path: &PathBuf, cell_size: Option<f32>, scale: f64) -> Result<TetMesh, MeshError> {
    let extension = path.extension().map_or_else(String::new, |e| e.to_string_lossy().to_lowercase());
    match (&*extension, cell_size) {
        ("obj" | "stl" | "ply" | "gltf" | "glb", Some(size)) => {
            SurfaceMesh::read(path)?.scaled(scale as f32).filled(size)
        }
        _ => TetMesh::read(path)?.scaled(scale),
    }
}

#[pymethods]
impl PyDeformableBody {
    /// A cuboid of these half extents [m] (x, y, z), cut into cells (x, y, z) of five tetrahedra each.
    #[staticmethod]
    #[pyo3(signature = (half_extents, cells, **options))]
    fn cuboid<'py>(
        py: Python<'py>,
        half_extents: Triple,
        cells: [i64; 3],
        options: Option<Options<'_, 'py>>,
    ) -> Built<'py> {
        let cells = counts(cells)?;
        build(py, options, move || {
            TetMesh::cuboid(half_extents.0, cells).map(|mesh| DeformableModel::new(&mesh))
        })
    }

    /// A ball of this radius [m], filled with cells of about `cell_size` [m].
    #[staticmethod]
    #[pyo3(signature = (radius, cell_size, **options))]
    fn ball<'py>(
        py: Python<'py>,
        radius: f64,
        cell_size: f64,
        options: Option<Options<'_, 'py>>,
    ) -> Built<'py> {
        filled(py, options, Ball::new(number("radius", radius, true)?), cell_size)
    }

    /// A cylinder along y: half its height, its radius, and the size of the cells that it is filled with [m].
    #[staticmethod]
    #[pyo3(signature = (half_height, radius, cell_size, **options))]
    fn cylinder<'py>(
        py: Python<'py>,
        half_height: f64,
        radius: f64,
        cell_size: f64,
        options: Option<Options<'_, 'py>>,
    ) -> Built<'py> {
        let half_height = number("half_height", half_height, true)?;
        filled(py, options, Cylinder::new(half_height, number("radius", radius, true)?), cell_size)
    }

    /// A capsule along y: half the distance between the centres of its ends, its radius, and the size of the cells that it is
    /// filled with [m].
    #[staticmethod]
    #[pyo3(signature = (half_height, radius, cell_size, **options))]
    fn capsule<'py>(
        py: Python<'py>,
        half_height: f64,
        radius: f64,
        cell_size: f64,
        options: Option<Options<'_, 'py>>,
    ) -> Built<'py> {
        let half_height = number("half_height", half_height, true)?;
        filled(py, options, Capsule::new_y(half_height, number("radius", radius, true)?), cell_size)
    }

    /// What a closed surface encloses: vertices of shape (n, 3) [m], triangles of shape (m, 3) that are wound outward, and the size
    /// of the cells that it is filled with [m].
    #[staticmethod]
    #[pyo3(signature = (vertices, triangles, cell_size, **options))]
    fn surface<'py>(
        py: Python<'py>,
        vertices: &Bound<'py, PyAny>,
        triangles: &Bound<'py, PyAny>,
        cell_size: f64,
        options: Option<Options<'_, 'py>>,
    ) -> Built<'py> {
        let (vertices, triangles) = mesh(vertices, triangles, "triangles")?;
        build(py, options, move || {
            let mesh = TetMesh::fill_surface(&vertices, &triangles, cell_size as f32)?;
            Ok(DeformableModel::new(&mesh))
        })
    }

    /// A mesh of tetrahedra: vertices of shape (n, 3) [m], four of their indices per tetrahedron, of shape (m, 4), positively oriented,
    /// and if wanted a region for each, of shape (m,).
    #[staticmethod]
    #[pyo3(signature = (vertices, tetrahedra, regions = None, **options))]
    fn mesh<'py>(
        py: Python<'py>,
        vertices: &Bound<'py, PyAny>,
        tetrahedra: &Bound<'py, PyAny>,
        regions: Option<&Bound<'py, PyAny>>,
        options: Option<Options<'_, 'py>>,
    ) -> Built<'py> {
        let (vertices, tetrahedra) = (points(vertices, "vertices")?, indices::<4>(tetrahedra, "tetrahedra")?);
        let regions = regions.map(|regions| list::<u32>(regions, "regions")).transpose()?;
        build(py, options, move || {
            let mesh = TetMesh::new(vertices, tetrahedra)?;
            let mesh = match regions {
                Some(regions) => mesh.with_regions(regions)?,
                None => mesh,
            };
            Ok(DeformableModel::new(&mesh))
        })
    }

    /// A file. Tetrahedra of Gmsh (``.msh``), TetGen (``.node``, ``.ele``), MEDIT (``.mesh``) and VTK (``.vtk``, ``.vtu``); or a closed surface of
    /// OBJ, STL, PLY or glTF, which is filled with cells of ``cell_size`` [m]. ``scale`` is 0.001 for files in millimetres.
    #[staticmethod]
    #[pyo3(signature = (path, cell_size = None, scale = 1.0, **options))]
    fn file<'py>(
        py: Python<'py>,
        path: PathBuf,
        cell_size: Option<f64>,
        scale: f64,
        options: Option<Options<'_, 'py>>,
    ) -> Built<'py> {
        let is_surface = path.extension().is_some_and(|e| {
            ["obj", "stl", "ply", "gltf", "glb"].iter().any(|known| e.eq_ignore_ascii_case(known))
        });
        if is_surface && cell_size.is_none() {
            let path = path.display();
            return Err(bad_value(format!(
                "{path} is a surface: say the cell_size that it is to be filled with"
            )));
        }
        build(py, options, move || {
            let mesh = read(&path, cell_size.map(|size| size as f32), scale)?;
            Ok(DeformableModel::new(&mesh))
        })
    }

    /// A rectangular sheet in the plane of x and z: half extents [m] (x, z), cells (x, z), and its thickness [m].
    #[staticmethod]
    #[pyo3(signature = (half_extents, cells, thickness, **options))]
    fn cloth<'py>(
        py: Python<'py>,
        half_extents: [f64; 2],
        cells: [i64; 2],
        thickness: f64,
        options: Option<Options<'_, 'py>>,
    ) -> Built<'py> {
        let cells = counts(cells)?;
        build(py, options, move || {
            DeformableModel::from_structure(&Structure::rectangle(half_extents, cells, thickness)?)
        })
    }

    /// A sheet of triangles: vertices of shape (n, 3) [m], triangles of shape (m, 3), and its thickness [m].
    #[staticmethod]
    #[pyo3(signature = (vertices, triangles, thickness, **options))]
    fn sheet<'py>(
        py: Python<'py>,
        vertices: &Bound<'py, PyAny>,
        triangles: &Bound<'py, PyAny>,
        thickness: f64,
        options: Option<Options<'_, 'py>>,
    ) -> Built<'py> {
        let (vertices, triangles) = (points(vertices, "vertices")?, indices::<3>(triangles, "triangles")?);
        build(py, options, move || {
            DeformableModel::from_structure(&Structure::sheet(vertices, &triangles, thickness)?)
        })
    }

    /// A rope or rod along points of shape (n, 3) [m], of this radius [m].
    #[staticmethod]
    #[pyo3(signature = (points, radius, **options))]
    fn rope<'py>(
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        radius: f64,
        options: Option<Options<'_, 'py>>,
    ) -> Built<'py> {
        let points = self::points(points, "points")?;
        build(py, options, move || DeformableModel::from_structure(&Structure::rod(&points, radius)?))
    }
}
