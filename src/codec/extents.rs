//! Where the vertices are, and how large everything is round them (spec §5.5.1).

use super::vector::{Vector, Vectors, truncate_long};
use crate::error::Result;
use crate::limits::make_room;
use crate::mesh::Vertex;
use crate::refine::ProgressiveMesh;

/// What a level pass knows of a vertex: where it is, and how large everything is there.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub struct Extent {
    /// Its cell.
    pub cell: Vector,
    /// Sum of the squared lengths of its edges, each rounded down to an integer: in integers their order does not matter.
    squares: i64,
    /// How many edges it has.
    pub edges: i32,
    /// The last new vertex whose link it was on.
    pub linked: Vertex,
}

impl Extent {
    fn nowhere() -> Self {
        Self { cell: Vector::default(), squares: 0, edges: 0, linked: Vertex::NONE }
    }
}

/// The vertices of a mesh under refinement, by number.
#[derive(Clone, Debug, Default)]
pub struct Extents {
    extents: Vec<Extent>,
    precision: u32,
}

/// How long an edge is, in quarter octaves of its squared length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Length {
    /// Beside those round it, from 2^-2.5 on: below [`CLASSES`].
    pub beside: u8,
    /// By itself, from 1 on: below [`LENGTHS`].
    pub alone: u8,
}

impl Length {
    /// Of no edge.
    pub const NONE: Self = Self { beside: 0, alone: 0 };
}

/// More than there are classes of [`Length::beside`], so that any five bits make one.
pub const CLASSES: usize = 32;
/// More than there are classes of [`Length::alone`], 50 octaves.
pub const LENGTHS: usize = 256;
/// The last class beside others.
const LONGEST: usize = 19;

impl Extents {
    /// Measures a mesh in cells of side 2^`precision`.
    pub fn new(mesh: &ProgressiveMesh, precision: u32) -> Self {
        let mut this = Self { extents: Vec::with_capacity(mesh.positions.capacity()), precision };
        this.measure(mesh, precision);
        this
    }

    /// Measures a mesh anew, in the same memory.
    pub fn measure(&mut self, mesh: &ProgressiveMesh, precision: u32) {
        self.precision = precision;
        self.extents.clear();
        for (v, &position) in (0..).map(Vertex).zip(&mesh.positions) {
            self.put(v, position);
        }
        // Each triangle counts its edges for where they start on its left; at the boundary nobody else counts them for where they end.
        for t in mesh.table.triangles() {
            let corners = mesh.table.triangle(t);
            let [x, y, z] = corners.map(|v| self.cell(v));
            let along = Vectors::new([y - x, z - y, x - z, Vector::default()]);
            let squares = along.dot(along).floats().map(truncate_long);
            for (v, square) in corners.into_iter().zip(squares) {
                self.appear(v, square);
            }
            for (k, beyond) in mesh.table.opposites_from(t.corner(0)).into_iter().enumerate() {
                if beyond.is_none() {
                    self.appear(corners[(k + 2) % 3], squares[(k + 1) % 3]);
                }
            }
        }
    }

    /// What is known of a vertex of the mesh.
    #[inline(always)]
    pub fn at(&self, v: Vertex) -> &Extent {
        &self.extents[v.index()]
    }

    /// The cell of a vertex.
    #[inline(always)]
    pub fn cell(&self, v: Vertex) -> Vector {
        self.at(v).cell
    }

    /// How many edges a vertex has, and the sum of their squares.
    #[cfg(all(test, feature = "encode"))]
    pub fn extent(&self, v: Vertex) -> (i32, i64) {
        (self.at(v).edges, self.at(v).squares)
    }

    /// What each takes.
    pub const BYTES_A_VERTEX: usize = size_of::<Extent>();

    /// Makes room for so many vertices in all.
    pub fn make_room(&mut self, vertices: usize) -> Result<()> {
        let more = vertices.saturating_sub(self.extents.len());
        make_room(&mut self.extents, more)
    }

    /// As [`Extents::make_room`], where nobody asks.
    pub fn reserve(&mut self, vertices: usize) {
        self.extents.reserve_exact(vertices.saturating_sub(self.extents.len()));
    }

    /// Puts a vertex, without edges, where it is at full scale.
    #[inline]
    pub fn put(&mut self, v: Vertex, position: [i32; 3]) {
        let cell = Vector::of_cell(position.map(|x| x >> self.precision));
        let extent = Extent { cell, ..Extent::nowhere() };
        if v.index() == self.extents.len() {
            self.extents.push(extent);
        } else {
            // A writer's vertices come in an order of its own.
            self.extents.resize(self.extents.len().max(v.index() + 1), Extent::nowhere());
            self.extents[v.index()] = extent;
        }
    }

    /// Measures an interior vertex that has moved, and what that changes for its neighbours.
    pub fn follow(&mut self, mesh: &ProgressiveMesh, v: Vertex) {
        let before = self.cell(v);
        let now = Vector::of_cell(mesh.positions[v.index()].map(|x| x >> self.precision));
        let mut change = 0i64;
        for c in mesh.table.fan(v) {
            let extent = &mut self.extents[mesh.table.vertex(c.next()).index()];
            let longer = length_squared(now - extent.cell).wrapping_sub(length_squared(before - extent.cell));
            extent.squares = extent.squares.wrapping_add(longer);
            change = change.wrapping_add(longer);
        }
        let extent = &mut self.extents[v.index()];
        (extent.cell, extent.squares) = (now, extent.squares.wrapping_add(change));
    }

    /// An edge of this squared length appears at `v`.
    #[inline(always)]
    fn appear(&mut self, v: Vertex, square: i64) {
        let extent = &mut self.extents[v.index()];
        extent.squares = extent.squares.wrapping_add(square);
        extent.edges += 1;
    }

    /// The edge between `a` and `b`, of this squared length, is no more.
    #[inline(always)]
    pub fn part(&mut self, a: Vertex, b: Vertex, square: i64) {
        for v in [a, b] {
            let extent = &mut self.extents[v.index()];
            extent.squares = extent.squares.wrapping_sub(square);
            extent.edges -= 1;
        }
    }

    /// An edge of this squared length leads from `w`, on the link of `v`, to `v`. Returns the square.
    #[inline(always)]
    pub fn meet(&mut self, w: Vertex, v: Vertex, square: i64) -> i64 {
        let extent = &mut self.extents[w.index()];
        extent.squares = extent.squares.wrapping_add(square);
        extent.edges += 1;
        extent.linked = v;
        square
    }

    /// [`Extents::meet`] where the edge takes the place of one of squared length `instead`.
    #[inline(always)]
    pub fn join(&mut self, w: Vertex, v: Vertex, square: i64, instead: i64) -> i64 {
        let extent = &mut self.extents[w.index()];
        extent.squares = extent.squares.wrapping_add(square - instead);
        extent.linked = v;
        square
    }

    /// All edges of a new vertex have been counted.
    #[inline(always)]
    pub fn settle(&mut self, v: Vertex, spokes: Spokes) {
        let extent = &mut self.extents[v.index()];
        (extent.squares, extent.edges) = (spokes.squares, spokes.edges);
    }

    /// How long an edge is: its squared length over the mean of those of the edges at its ends, and by itself.
    #[inline(always)]
    pub fn length(&self, a: Vertex, b: Vertex) -> Length {
        let alone = self.length_alone(a, b).alone;
        let (a, b) = (self.at(a), self.at(b));
        let (edge, edges) = (b.cell - a.cell, (a.edges + b.edges) as f32);
        let size = edge.dot(edge) * edges / (a.squares.wrapping_add(b.squares) as f32).max(1.0);
        Length { beside: quarters(size, (127 << 2) - 10).min(LONGEST) as u8, alone }
    }

    /// [`Extents::length`] by itself: the other one is left out.
    #[inline(always)]
    pub fn length_alone(&self, a: Vertex, b: Vertex) -> Length {
        let edge = self.cell(b) - self.cell(a);
        Length { alone: quarters(edge.dot(edge), 127 << 2) as u8, ..Length::NONE }
    }
}

/// Quarter octaves are the leading bits of a number: those above `least`.
#[inline(always)]
fn quarters(x: f32, least: usize) -> usize {
    ((x.to_bits() >> 21) as usize).saturating_sub(least)
}

/// The edges of a new vertex while they are counted.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spokes {
    squares: i64,
    edges: i32,
}

impl Spokes {
    /// Counts one of this squared length.
    #[inline(always)]
    pub fn count(&mut self, square: i64) {
        self.squares = self.squares.wrapping_add(square);
        self.edges += 1;
    }
}

/// The squared lengths of the edges to four cells.
#[inline(always)]
pub fn squares_from(at: Vector, cells: [Vector; 4]) -> [i64; 4] {
    let to = Vectors::new(cells) - Vectors::of(at);
    to.dot(to).floats().map(truncate_long)
}

/// The squared length of an edge, rounded down to an integer.
#[inline(always)]
pub fn length_squared(v: Vector) -> i64 {
    truncate_long(v.dot(v))
}

#[cfg(all(test, feature = "encode"))]
mod tests {
    use super::*;
    use crate::mesh::CornerTable;
    use crate::refine::Roots;

    /// The square of the specification (spec §5.7.1).
    #[test]
    fn a_square_and_its_diagonal() {
        let table = CornerTable::from_triangles(4, &[[0, 1, 2], [0, 2, 3]]).unwrap();
        let positions = vec![[0, 0, 0], [255, 0, 0], [255, 255, 0], [0, 255, 0]];
        let roots = Roots::choose(&table);
        let extents = Extents::new(&ProgressiveMesh { table, positions, roots }, 0);
        let of_all: Vec<_> = (0..4).map(|v| extents.extent(Vertex(v))).collect();
        assert_eq!(of_all, [(3, 260_100), (2, 130_050), (3, 260_100), (2, 130_050)]);
        // 65025 * 5 / 390150 = 0.83, the third quarter of the octave from 2^-1 on; 130050 * 6 / 520200 = 1.5, the third of that from 1.
        // 65025 is a little below 2^16, 130050 below 2^17.
        assert_eq!(extents.length(Vertex(0), Vertex(1)), Length { beside: 8, alone: 63 });
        assert_eq!(extents.length(Vertex(2), Vertex(0)), Length { beside: 12, alone: 67 });
    }
}
