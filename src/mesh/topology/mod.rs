//! Conditioning: any triangles at all become an oriented manifold and what it takes to sew them together again.
//!
//! Guéziec, Taubin, Lazarus, Horn: "Cutting and Stitching: Converting Sets of Polygons to Manifold Surfaces" (2001),
//! their local cutting, whose pinched cuts are closed again.

mod census;
mod classes;
mod complex;
mod near;
mod sets;
mod weld;

use bitvec::vec::BitVec;

pub use census::{Census, census};
pub use classes::{VertexClass, classify};
pub use weld::Weld;
#[cfg(feature = "cli")]
pub(crate) use weld::first_in_place;

use self::complex::Complex;
use self::sets::Sets;
use super::corner_table::CornerTable;
use super::index::{CornerMap, Vertex};
use super::indexed::IndexedMesh;
use super::lattice::{self, Lattice};

/// An oriented manifold, made from any triangles without losing one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Conditioned {
    /// The manifold.
    pub manifold: Manifold,
    /// What the input was beside it.
    pub remainder: Remainder,
    /// What was found and done.
    pub report: ConditioningReport,
}

/// An oriented manifold of the input's vertices and triangles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Manifold {
    /// Its triangles in the order of the input, its vertices in the order of their first corners.
    pub table: CornerTable,
    /// One position a vertex of the table, as in the input.
    pub positions: Vec<[f64; 3]>,
    /// Vertices of the table that must stay, so that no crack opens: ends of cut edges and copies of cut vertices.
    pub locked: BitVec,
}

/// What a [`Manifold`] does not tell of the input that it was made from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Remainder {
    /// Triangles of the table whose orientation in the input was the opposite one. The first corner is the same.
    pub flipped: BitVec,
    /// Groups of two or more vertices of the table that were one vertex, each in ascending order.
    pub stitches: Vec<Vec<Vertex>>,
    /// Positions of the vertices in no triangle of the table, in the order of the input.
    pub extras: Vec<[f64; 3]>,
    /// Triangles that no manifold holds, oriented and as often as in the input. An index below the table's number of
    /// vertices is one of them (its first copy where it was cut), any other one is that number more than one of `extras`.
    pub residue: Vec<[u32; 3]>,
    /// Where all of it was in the input.
    pub origins: Origins,
}

/// Where the parts of a [`Conditioned`] mesh were in the input.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Origins {
    /// For each vertex of the input the one that stands for it ([`Weld::representatives`]).
    pub same: Vec<u32>,
    /// For each vertex of the table the vertex of the input that stands for it.
    pub vertices: Vec<Vertex>,
    /// The same for the vertices in no triangle of the table.
    pub extras: Vec<Vertex>,
    /// For each triangle of the input whether it is in the table; the others are in the residue.
    pub in_table: BitVec,
}

/// What conditioning found and did; all are numbers of things.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ConditioningReport {
    /// Vertices of the input.
    pub input_vertices: usize,
    /// Triangles of the input.
    pub input_triangles: usize,
    /// Vertices replaced by an earlier one in the same place.
    pub welded_vertices: usize,
    /// Different places that are one with another one: that so many vertices, after welding what is equal, were joined.
    pub joined_vertices: usize,
    /// Triangles with two corners on one vertex: residue.
    pub degenerate_triangles: usize,
    /// Triangles with the same vertices as an earlier one, in whichever orientation: residue.
    pub repeated_triangles: usize,
    /// Vertices, after welding, in no triangle at all.
    pub isolated_vertices: usize,
    /// Edges cut because they had more than two triangles.
    pub nonmanifold_edges: usize,
    /// Edges cut because no orientation suits both their triangles.
    pub nonorientable_edges: usize,
    /// Vertices cut into copies, for whichever reason: the number of stitches.
    pub cut_vertices: usize,
    /// Those of them at which no cut edge ends: fans that share nothing but the vertex.
    pub nonmanifold_vertices: usize,
    /// Triangles whose orientation was reversed.
    pub reoriented_triangles: usize,
    /// Vertices that must stay.
    pub locked_vertices: usize,
    /// Components, boundary and handles of the manifold.
    pub census: Census,
}

/// As [`condition_on`], the lattice being that of [`Lattice::DEFAULT_BITS`] over the mesh.
///
/// # Panics
/// Where a triangle names a vertex that does not exist, see [`IndexedMesh::triangles`].
pub fn condition(mesh: &IndexedMesh, weld: Weld) -> Conditioned {
    let used = mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]);
    let (min, max) = lattice::bounds(used).unwrap_or_default();
    condition_on(mesh, weld, &Lattice::over(min, max, Lattice::DEFAULT_BITS))
}

/// Makes an oriented manifold of any triangles; takes time n log n.
///
/// # Panics
/// Where a triangle names a vertex that does not exist, see [`IndexedMesh::triangles`].
pub fn condition_on(mesh: &IndexedMesh, weld: Weld, lattice: &Lattice) -> Conditioned {
    let same = weld.representatives(mesh, lattice);
    let others = |same: &[u32]| (0..).zip(same).filter(|&(v, &other)| v != other).count();
    let welded_vertices = match weld {
        Weld::Exact | Weld::None => others(&same),
        Weld::Lattice | Weld::Within(_) => others(&weld::first_in_bodies(mesh)),
    };
    let sorted_out = weld::set_aside(&mesh.triangles, &same);
    let (mut complex, nonmanifold_edges) = Complex::pair(CornerMap(sorted_out.kept));
    let (flipped, nonorientable_edges) = complex.orient();
    let origins = complex.split_vertices();
    let stitches = stitches(&origins, same.len());
    let nonmanifold_vertices = bow_ties(&stitches, &complex.cut_ends(origins.len()));
    let locked = copies(&stitches, origins.len());
    complex.zip(origins.len());
    let table = CornerTable::from_parts(origins.len(), complex.vertices, complex.opposites);
    debug_assert_eq!(table.check(), Ok(()));
    let report = ConditioningReport {
        input_vertices: mesh.positions.len(),
        input_triangles: mesh.triangles.len(),
        welded_vertices,
        joined_vertices: others(&same) - welded_vertices,
        degenerate_triangles: sorted_out.degenerate,
        repeated_triangles: sorted_out.repeated,
        isolated_vertices: 0,
        nonmanifold_edges,
        nonorientable_edges,
        cut_vertices: stitches.len(),
        nonmanifold_vertices,
        reoriented_triangles: flipped.count_ones(),
        locked_vertices: locked.count_ones(),
        census: census(&table),
    };
    let positions = origins.iter().map(|v| mesh.positions[v.index()]).collect();
    let origins = Origins { same, vertices: origins, extras: Vec::new(), in_table: sorted_out.is_kept };
    let remainder = Remainder { flipped, stitches, extras: Vec::new(), residue: sorted_out.residue, origins };
    let mut conditioned = Conditioned { manifold: Manifold { table, positions, locked }, remainder, report };
    conditioned.place_residue(&mesh.positions);
    conditioned
}

impl Conditioned {
    /// How many parts the manifold has if vertices hold together that are the same, or, with a lattice, that have the same
    /// point of it and are of one of the `bodies` of the input ([`IndexedMesh::bodies`]).
    pub fn parts(&self, lattice: Option<&Lattice>, bodies: &[u32]) -> usize {
        let Manifold { table, positions, .. } = &self.manifold;
        let mut sets = Sets::new(positions.len());
        for t in table.triangles() {
            let [a, b, c] = table.triangle(t);
            sets.unite(a.0, b.0);
            sets.unite(b.0, c.0);
        }
        let origins = &self.remainder.origins.vertices;
        let body = |v: &Vertex| bodies.partition_point(|&first| first <= v.0);
        let mut places: Vec<((usize, [i32; 3]), u32)> = match lattice {
            Some(lattice) => origins
                .iter()
                .map(body)
                .zip(positions.iter().map(|&p| lattice.quantise(p)))
                .zip(0..)
                .collect(),
            None => origins.iter().map(|v| (v.index(), [0; 3])).zip(0..).collect(),
        };
        places.sort_unstable();
        for pair in places.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
            sets.unite(pair[0].1, pair[1].1);
        }
        sets.count()
    }

    /// Turns the vertices of the residue from input vertices into places in the manifold's positions and `extras`.
    fn place_residue(&mut self, input: &[[f64; 3]]) {
        let Remainder { extras, residue, origins, .. } = &mut self.remainder;
        let count = self.manifold.positions.len();
        let mut places = vec![u32::MAX; input.len()];
        for (copy, origin) in origins.vertices.iter().enumerate().rev() {
            places[origin.index()] = copy as u32;
        }
        let mut in_residue: BitVec = BitVec::repeat(false, input.len());
        for &v in residue.iter().flatten() {
            in_residue.set(v as usize, true);
        }
        for (v, &first) in origins.same.iter().enumerate() {
            if first as usize == v && places[v] == u32::MAX {
                places[v] = (count + extras.len()) as u32;
                extras.push(input[v]);
                origins.extras.push(Vertex(first));
                self.report.isolated_vertices += usize::from(!in_residue[v]);
            }
        }
        for v in residue.iter_mut().flatten() {
            *v = places[*v as usize];
        }
    }
}

impl Manifold {
    /// The vertices that must stay where those of the boundary are to stay, too.
    pub fn locked_with_boundary(&self) -> BitVec {
        let (table, mut locked) = (&self.table, self.locked.clone());
        for v in (0..table.vertex_slots() as u32).map(Vertex).filter(|&v| table.is_boundary(v)) {
            locked.set(v.index(), true);
        }
        locked
    }
}

/// The vertices of the table with the same origin, where there are several; in the order of the origins.
fn stitches(origins: &[Vertex], input_vertices: usize) -> Vec<Vec<Vertex>> {
    let (mut seen, mut several) =
        (BitVec::<usize>::repeat(false, input_vertices), BitVec::<usize>::repeat(false, input_vertices));
    for origin in origins {
        if seen.replace(origin.index(), true) {
            several.set(origin.index(), true);
        }
    }
    let copies = (0..).zip(origins).filter(|(_, origin)| several[origin.index()]);
    let mut copies: Vec<(Vertex, Vertex)> = copies.map(|(copy, &origin)| (origin, Vertex(copy))).collect();
    copies.sort_unstable();
    copies.chunk_by(|x, y| x.0 == y.0).map(|group| group.iter().map(|&(_, copy)| copy).collect()).collect()
}

/// How many vertices were cut although no cut edge ended there.
fn bow_ties(stitches: &[Vec<Vertex>], cut_ends: &BitVec) -> usize {
    stitches.iter().filter(|group| group.iter().all(|v| !cut_ends[v.index()])).count()
}

/// The copies of cut vertices, of `count` vertices. The ends of cut edges are among them: a fan has one boundary edge out
/// and one in, too few for the pieces of an edge of three triangles, or of one that both its triangles leave alike.
fn copies(stitches: &[Vec<Vertex>], count: usize) -> BitVec {
    let mut copies = BitVec::repeat(false, count);
    for v in stitches.iter().flatten() {
        copies.set(v.index(), true);
    }
    copies
}
