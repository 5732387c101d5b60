//! VTK, legacy and XML: unstructured grids.

use super::grid::Grid;
use vtkio::Vtk;
use vtkio::model::{Attribute, CellType, DataSet, Piece, UnstructuredGridPiece, VertexNumbers};

/// Cell data that says in which region a cell is.
const REGIONS: [&str; 4] = ["region", "MaterialIds", "gmsh:physical", "medit:ref"];

pub(super) fn parse(bytes: &[u8]) -> Result<Grid, String> {
    // The library (0.7.0-rc2) is trusted with no file of a stranger's.
    let read =
        || if bytes.starts_with(b"# vtk") { Vtk::parse_legacy_be(bytes) } else { Vtk::parse_xml(bytes) };
    let file = std::panic::catch_unwind(read).map_err(|_| "it is damaged".to_owned())?;
    let DataSet::UnstructuredGrid { pieces, .. } = file.map_err(|error| error.to_string())?.data else {
        return Err("it holds no unstructured grid".into());
    };
    let mut grid = Grid::default();
    for piece in pieces {
        let Piece::Inline(piece) = piece else { return Err("a piece of it is a file of its own".into()) };
        add_piece(&piece, &mut grid)?;
    }
    if grid.tetrahedra.is_empty() { Err("there are no tetrahedra in it".into()) } else { Ok(grid) }
}

fn add_piece(piece: &UnstructuredGridPiece, grid: &mut Grid) -> Result<(), String> {
    let points: Vec<f64> = piece.points.cast_into().ok_or("its points are no numbers")?;
    let first = grid.positions.len() as i64;
    let positions = points.chunks_exact(3).map(|p| [p[0], p[1], p[2]]);
    grid.positions.extend((first..).zip(positions));
    let regions = regions(piece);
    let (corners, mut ends) = cells(&piece.cells.cell_verts)?;
    // Of some writers the first offset is where the first cell begins.
    if ends.len() > piece.cells.types.len() && ends.first() == Some(&0) {
        ends.remove(0);
    }
    let mut start = 0;
    for (k, (kind, end)) in piece.cells.types.iter().zip(ends).enumerate() {
        let own = corners.get(start..end).ok_or_else(|| format!("cell {k} ends beyond the list of cells"))?;
        start = end;
        if *kind != CellType::Tetra {
            *grid.others.entry(*kind as i64).or_default() += 1;
            continue;
        }
        let [a, b, c, d] = *own else { return Err(format!("tetrahedron {k} has {} corners", own.len())) };
        let region = regions.get(k).copied().unwrap_or(0.0);
        if !(region.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&region)) {
            return Err(format!("the region {region} of cell {k} is none"));
        }
        grid.tetrahedra.push((k as i64, [a, b, c, d].map(|corner| first + corner), region as u32));
    }
    Ok(())
}

/// Corners of all cells, and where those of each end.
fn cells(list: &VertexNumbers) -> Result<(Vec<i64>, Vec<usize>), String> {
    match list {
        VertexNumbers::XML { connectivity, offsets } => {
            let corner = |c: &u64| i64::try_from(*c).map_err(|_| format!("{c} is no point"));
            let corners = connectivity.iter().map(corner).collect::<Result<_, _>>()?;
            let end = |o: &u64| usize::try_from(*o).map_err(|_| format!("{o} is no offset"));
            Ok((corners, offsets.iter().map(end).collect::<Result<_, _>>()?))
        }
        VertexNumbers::Legacy { vertices, .. } => {
            let (mut corners, mut ends) = (Vec::new(), Vec::new());
            let mut rest = &vertices[..];
            while let Some((count, behind)) = rest.split_first() {
                let own = behind.get(..*count as usize).ok_or("the list of cells ends too early")?;
                corners.extend(own.iter().map(|c| i64::from(*c)));
                ends.push(corners.len());
                rest = &behind[own.len()..];
            }
            Ok((corners, ends))
        }
    }
}

/// The first list of regions among the data of the cells.
fn regions(piece: &UnstructuredGridPiece) -> Vec<f64> {
    let mut lists = Vec::new();
    for attribute in &piece.data.cell {
        match attribute {
            Attribute::DataArray(array) => lists.push((&array.name, &array.data)),
            Attribute::Field { data_array, .. } => {
                lists.extend(data_array.iter().map(|array| (&array.name, &array.data)));
            }
        }
    }
    let of = |name: &&str| lists.iter().find(|(own, _)| own.as_str() == *name);
    REGIONS.iter().find_map(of).and_then(|(_, data)| data.cast_into()).unwrap_or_default()
}
