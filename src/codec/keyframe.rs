//! A keyframe: one whole level, connectivity first, then positions in walk order (spec §7).

use super::edgebreaker::{self, ConnectivityError};
use super::lift::Cells;
use super::shared::Shared;
use super::walk::Walk;
use super::whole::WholeError;
#[cfg(feature = "encode")]
use crate::entropy::RangeEncoder;
use crate::entropy::{BitCoder, NumberModel, RangeDecoder, varint};
use crate::limits::Budget;
use crate::mesh::{CornerTable, Vertex};
use crate::refine::{ProgressiveMesh, Roots, from_cell};
use bitvec::vec::BitVec;

/// What a keyframe must turn out to be: the level entry of the table of contents, and the lattice.
#[derive(Clone, Copy, Debug)]
pub struct Expected {
    /// Vertices of the level.
    pub vertices: u32,
    /// Triangles of the level.
    pub triangles: u32,
    /// The cells that its vertices are in.
    pub cells: Cells,
}

/// What a keyframe takes.
#[cfg(feature = "encode")]
#[derive(Clone, Debug)]
pub struct Written {
    /// The payload.
    pub payload: Vec<u8>,
    /// Bits of its connectivity, by part; what nothing here is told of are positions.
    pub connectivity: edgebreaker::Bits,
    /// Bits of what comes behind the positions.
    pub attributes: f64,
    /// Units of work that reading it takes (spec §3.6).
    pub work: u64,
}

/// Writes a level as a payload. `behind` writes what comes behind the positions, of this walk, and tells the units of work that it takes.
#[cfg(feature = "encode")]
pub fn encode(
    mesh: &ProgressiveMesh,
    precision: u32,
    behind: impl FnOnce(&Walk, &mut RangeEncoder) -> u64,
) -> Written {
    write(mesh, precision, OF_LEVEL, None, behind).expect(HOLDS)
}

/// Writes a mesh some of whose vertices are those of another one (spec §15.2), as [`encode`] a level of shift 0.
///
/// # Errors
/// An error of the connectivity, a limit, where that takes too much of the budget.
#[cfg(feature = "encode")]
pub fn encode_beside(
    mesh: &ProgressiveMesh,
    other: &[[i32; 3]],
    budget: &mut Budget,
    behind: impl FnOnce(&Walk, &mut RangeEncoder) -> u64,
) -> Result<Written, ConnectivityError> {
    let before = budget.work();
    let mut shared = Shared::new(other, budget)?;
    let written = write(mesh, 0, OF_LEVEL, Some((&mut shared, budget)), behind);
    budget.give_memory(Shared::bytes(other.len()), 1);
    written.map(|written| Written { work: written.work + (budget.work() - before), ..written })
}

/// Writes components that are born as a payload (spec §7.4), as [`encode`] a level.
#[cfg(feature = "encode")]
pub fn encode_birth(
    components: &ProgressiveMesh,
    precision: u32,
    behind: impl FnOnce(&Walk, &mut RangeEncoder) -> u64,
) -> Written {
    write(components, precision, OF_BIRTH, None, behind).expect(HOLDS)
}

#[cfg(feature = "encode")]
fn write(
    mesh: &ProgressiveMesh,
    precision: u32,
    first: First,
    beside: Beside,
    behind: impl FnOnce(&Walk, &mut RangeEncoder) -> u64,
) -> Result<Written, ConnectivityError> {
    let boundary =
        mesh.table.triangles().flat_map(|t| t.corners()).filter(|&c| mesh.table.opposite(c).is_none());
    let boundary = boundary.count() as u64;
    let mut payload = Vec::new();
    varint::write(boundary, &mut payload);
    let mut coder = RangeEncoder::default();
    let connectivity = edgebreaker::encode(&mesh.table, &mesh.roots, &mut coder);
    let walk = Walk::new(&mesh.table, &mesh.roots);
    let known = |v: Vertex| mesh.positions[v.index()].map(|x| x >> precision);
    code_positions(&mesh.table, &walk, &mut coder, first, beside, known)?;
    let before = coder.bits();
    let more = behind(&walk, &mut coder);
    let attributes = coder.bits() - before;
    payload.extend(coder.finish());
    // A symbol for each triangle, those of caps included.
    let work = (1 + WORK_A_TRIANGLE) * mesh.table.triangle_count() as u64 + boundary + more;
    Ok(Written { payload, connectivity, attributes, work })
}

/// Reads a payload. Vertices are numbered in walk order. `behind` reads what comes behind the positions, of the mesh and this walk of it.
///
/// # Errors
/// An error of the connectivity where the payload is damaged or not what was expected.
pub fn decode(
    payload: &[u8],
    expected: Expected,
    budget: &mut Budget,
    behind: impl FnOnce(Behind, &mut Budget) -> Result<(), WholeError>,
) -> Result<ProgressiveMesh, ConnectivityError> {
    read(payload, expected, OF_LEVEL, None, budget, behind)
}

/// Reads a mesh some of whose vertices are those of another one, as [`decode`] a level. `other` is where these are, in their order there.
///
/// # Errors
/// As [`decode`].
pub fn decode_beside(
    payload: &[u8],
    expected: Expected,
    other: &[[i32; 3]],
    budget: &mut Budget,
    behind: impl FnOnce(Behind, &mut Budget) -> Result<(), WholeError>,
) -> Result<ProgressiveMesh, ConnectivityError> {
    let mut shared = Shared::new(other, budget)?;
    let mesh = read(payload, expected, OF_LEVEL, Some(&mut shared), budget, behind);
    budget.give_memory(Shared::bytes(other.len()), 1);
    mesh
}

/// Reads a payload of components that are born, as [`decode`] one of a level.
///
/// # Errors
/// As [`decode`].
pub fn decode_birth(
    payload: &[u8],
    expected: Expected,
    budget: &mut Budget,
    behind: impl FnOnce(Behind, &mut Budget) -> Result<(), WholeError>,
) -> Result<ProgressiveMesh, ConnectivityError> {
    read(payload, expected, OF_BIRTH, None, budget, behind)
}

/// A payload, read up to the end of its positions.
#[derive(Debug)]
pub struct Behind<'a, 'b> {
    /// The mesh.
    pub mesh: &'a ProgressiveMesh,
    /// A walk of it.
    pub walk: &'a Walk,
    /// What reads on.
    pub coder: &'a mut RangeDecoder<'b>,
}

fn read(
    payload: &[u8],
    expected: Expected,
    first: First,
    shared: Option<&mut Shared>,
    budget: &mut Budget,
    behind: impl FnOnce(Behind, &mut Budget) -> Result<(), WholeError>,
) -> Result<ProgressiveMesh, ConnectivityError> {
    let mut bytes = payload;
    let boundary = varint::read(&mut bytes)
        .filter(|&n| n <= 3 * u64::from(expected.triangles))
        .ok_or_else(|| ConnectivityError::Mesh("the number of boundary edges is out of range".into()))?;
    let mut coder = RangeDecoder::new(bytes);
    budget.take_work(WORK_A_TRIANGLE * u64::from(expected.triangles))?;
    let connectivity = edgebreaker::decode(&mut coder, expected.triangles, boundary as u32, budget)?;
    let held = connectivity.held;
    let vertices = connectivity.table.vertex_slots();
    if vertices != expected.vertices as usize {
        let what = format!("{vertices} vertices instead of {}", expected.vertices);
        return Err(ConnectivityError::Mesh(what));
    }
    let walk = Walk::new(&connectivity.table, &connectivity.roots);
    let mut mesh = renumbered(&connectivity.table, &connectivity.roots, &walk);
    let beside = shared.map(|shared| (shared, &mut *budget));
    let cells = code_positions(&mesh.table, &walk, &mut coder, first, beside, |_| [0; 3])?;
    for (place, cell) in mesh.positions.iter_mut().zip(cells) {
        if !expected.cells.hold(cell) {
            return Err(ConnectivityError::Mesh(format!("position {cell:?} is off the lattice")));
        }
        *place = cell.map(|x| from_cell(x, expected.cells.precision));
    }
    behind(Behind { mesh: &mesh, walk: &walk, coder: &mut coder }, budget)?;
    coder.finish()?;
    budget.give_memory(held, 1);
    Ok(mesh)
}

impl From<WholeError> for ConnectivityError {
    fn from(e: WholeError) -> Self {
        match e {
            WholeError::Coding(e) => Self::Coding(e),
            WholeError::Range(what) => Self::Mesh(what.to_owned()),
            WholeError::Limit(limit) => Self::Limit(limit),
        }
    }
}

/// Codes the cells of all vertices in walk order: by parallelogram where the walk enters a triangle, else by the vertex before.
fn code_positions<C: BitCoder>(
    table: &CornerTable,
    walk: &Walk,
    coder: &mut C,
    first: First,
    mut beside: Beside,
    known: impl Fn(Vertex) -> [i32; 3],
) -> Result<Vec<[i32; 3]>, ConnectivityError> {
    let mut cells = vec![[0i32; 3]; table.vertex_slots()];
    let mut seen: BitVec = BitVec::repeat(false, table.vertex_slots());
    let mut models = vec![NumberModel::default(); 36];
    let mut last = [0i32; 3];
    for &c in &walk.triangles {
        for (corner, of_first) in [c.next(), c.prev(), c].into_iter().zip(first) {
            let v = table.vertex(corner);
            if seen.replace(v.index(), true) {
                continue;
            }
            let across = table.opposite(c);
            let entered = corner == c && across.is_some() && seen[table.vertex(across).index()];
            let truth = if C::ENCODES { known(v) } else { [0; 3] };
            let (prediction, size) = if entered {
                let [n, p, w] = [c.next(), c.prev(), across].map(|c| cells[table.vertex(c).index()]);
                let size = (0..3).map(|k| n[k].abs_diff(p[k])).max().unwrap_or(0);
                let prediction = std::array::from_fn(|k| n[k].wrapping_add(p[k]).wrapping_sub(w[k]));
                (prediction, Some(size))
            } else {
                (last, None)
            };
            if let Some((shared, budget)) = &mut beside
                && let Some(cell) = match size {
                    Some(size) => shared.next(coder, prediction, size, truth, budget)?,
                    None => shared.first(coder, truth)?,
                }
            {
                cells[v.index()] = cell;
                last = cell;
                coder.check()?;
                continue;
            }
            let context = size.map_or(of_first, |size| 33 - size.leading_zeros() as usize);
            let mut cell = [0; 3];
            for k in 0..3 {
                let residual = models[context].signed(coder, || truth[k].wrapping_sub(prediction[k]))?;
                cell[k] = prediction[k].wrapping_add(residual);
            }
            cells[v.index()] = cell;
            last = cell;
            coder.check()?;
        }
    }
    Ok(cells)
}

/// The same mesh with vertices numbered in walk order; their positions are still open.
fn renumbered(table: &CornerTable, roots: &Roots, walk: &Walk) -> ProgressiveMesh {
    let order = walk.vertices(table);
    let mut name = vec![Vertex::NONE; table.vertex_slots()];
    for (k, v) in order.iter().enumerate() {
        name[v.index()] = Vertex(k as u32);
    }
    let renamed = |v: Vertex| name[v.index()];
    let triangles =
        table.triangles().map(|t| (table.triangle(t).map(renamed), table.opposites_from(t.corner(0))));
    let table = CornerTable::collect(order.len(), table.triangle_count(), triangles);
    let edges = roots.edges().iter().map(|&(u, w)| (renamed(u), renamed(w))).collect();
    let roots = Roots::new(&table, edges);
    ProgressiveMesh { positions: vec![[0; 3]; order.len()], table, roots }
}

/// What has vertices that may be this mesh's, too, and what looking for them takes.
type Beside<'a, 'b, 'c> = Option<(&'a mut Shared<'b>, &'c mut Budget)>;

/// Why a writer without another mesh cannot fail.
#[cfg(feature = "encode")]
const HOLDS: &str = "lattice coordinates are numbers of at most 24 bits";

/// Contexts of the three vertices of a component's first triangle.
type First = [usize; 3];
/// A level has few components, as a rule: the three are told alike.
const OF_LEVEL: First = [0; 3];
/// Births have many, and small ones: from the last vertex of one to the first of the next it is farther than from one to the next in it.
const OF_BIRTH: First = [0, 34, 35];

/// Units of work for a triangle: to be walked over, checked and numbered anew, and half a position.
const WORK_A_TRIANGLE: u64 = 8;
