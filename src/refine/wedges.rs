//! Which wedge each corner names, and what an operation does to that (spec §13.3, §13.9).

use super::Site;
use crate::mesh::prefetch::prefetch;
use crate::mesh::{Corner, CornerTable, Triangle, Vertex};

/// The wedges of a mesh: a wedge is a vertex with one value of every attribute, what a graphics processor calls a vertex.
///
/// Empty where there is no attribute at corners.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Wedges {
    /// By slot of the table, and place in the triangle; the fourth is the triangle's own row of values of triangles.
    corners: Vec<[u32; 4]>,
    count: u32,
}

/// The corners of the star of `v`: from the edge to the first vertex of its site on, or at the boundary from the edge that leaves it.
pub fn ring(table: &CornerTable, v: Vertex, site: Site, corners: &mut Vec<Corner>) {
    let (Site::Edge(a, _) | Site::Face(a, ..) | Site::Attach(a, _)) = site;
    ring_from(table, v, a, corners);
}

/// The corners of the star of `v`: from the edge to `a` on, or at the boundary from the edge that leaves it.
pub fn ring_from(table: &CornerTable, v: Vertex, a: Vertex, corners: &mut Vec<Corner>) {
    corners.clear();
    corners.extend(table.fan(v));
    if !table.is_boundary(v) {
        let first = corners.iter().position(|c| table.vertex(c.next()) == a);
        corners.rotate_left(first.unwrap_or(0));
    }
}

/// The first of the corners that [`ring`] tells of, where an operation tells which it is.
#[inline]
pub fn first_of(table: &CornerTable, operation: &Carried) -> Corner {
    // Across a→b, (d, b, a) has become (d, b, v) and the new (d, v, a), which is the first then: flips leave the corner at a there.
    match (operation.site, operation.star) {
        (Site::Edge(a, _), &[_, first, ..]) if operation.created == 2 && table.vertex(first.next()) == a => {
            first
        }
        _ => Corner::NONE,
    }
}

/// The corners of the star of `v`, as [`ring`], of which the first may be known.
#[inline]
pub fn ring_of(table: &CornerTable, v: Vertex, site: Site, first: Corner, corners: &mut Vec<Corner>) {
    if first.is_none() {
        ring(table, v, site, corners);
        return;
    }
    corners.clear();
    let mut at = first;
    loop {
        corners.push(at);
        at = table.swing(at);
        if at == first || at.is_none() {
            break;
        }
    }
}

/// An operation as it was carried out, to the triangles that it has made and rewritten.
#[derive(Clone, Copy, Debug)]
pub struct Carried<'a> {
    /// Where it was.
    pub site: Site,
    /// The corners at its vertex: in new triangles, then in rewritten ones; those of flips in their order behind the others.
    pub star: &'a [Corner],
    /// How many of its triangles are new.
    pub created: usize,
    /// Of each flip the corner at the vertex that faced the edge.
    pub flips: &'a [Corner],
}

impl Wedges {
    /// Stands for "not known yet"; never a wedge.
    pub const NONE: u32 = u32::MAX;

    /// No wedge is known yet of any corner of a table.
    pub fn open(table: &CornerTable) -> Self {
        Self { corners: vec![[Self::NONE; 4]; table.slots()], count: 0 }
    }

    /// Wedges that are called as a writer calls them.
    #[cfg(test)]
    pub fn of_labels(
        table: &CornerTable,
        of: impl Fn(Corner) -> u32,
        of_triangle: impl Fn(Triangle) -> u32,
    ) -> Self {
        let mut wedges = Self::open(table);
        for t in table.triangles() {
            let [a, b, c] = t.corners().map(&of);
            wedges.corners[t.index()] = [a, b, c, of_triangle(t)];
        }
        wedges
    }

    /// How many wedges there are.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// The wedge of a corner, or [`Wedges::NONE`].
    #[inline]
    pub fn of(&self, c: Corner) -> u32 {
        self.corners.get(c.triangle().index()).map_or(Self::NONE, |corners| corners[c.place()])
    }

    /// Asks for the triangle of a corner to be brought into the caches.
    #[inline(always)]
    pub fn prefetch(&self, c: Corner) {
        if let Some(corners) = self.corners.get(c.triangle().index()) {
            prefetch(corners);
        }
    }

    /// The row of a triangle, or [`Wedges::NONE`].
    #[inline]
    pub fn row(&self, t: Triangle) -> u32 {
        self.corners.get(t.index()).map_or(Self::NONE, |corners| corners[3])
    }

    /// Names the row of a triangle.
    pub fn set_row(&mut self, t: Triangle, row: u32) {
        self.corners[t.index()][3] = row;
    }

    /// Whether nothing is known of any triangle.
    pub fn is_empty(&self) -> bool {
        self.corners.is_empty()
    }

    /// Corners take wedges as an operation has them: those of the link from the triangles that they come from, those of the new vertex
    /// are open. `table` is the one that it has led to (spec §13.9).
    pub fn carry(&mut self, table: &CornerTable, operation: &Carried) {
        self.corners.resize(table.slots(), [Self::NONE; 4]);
        let star = operation.star;
        match operation.site {
            Site::Edge(..) => {
                // (c, a, b) has become (c, a, v) and the new (c, v, b); the corners at v are given, and so across the edge.
                // Word by word: a whole triangle made of words that have just been written would have to wait for these.
                for side in 0..operation.created {
                    let (new, old) = (star[side], star[operation.created + side]);
                    let was = &mut self.corners[old.triangle().index()];
                    let (a, b, row) = (was[old.place()], was[old.next().place()], was[3]);
                    was[old.place()] = Self::NONE;
                    let made = &mut self.corners[new.triangle().index()];
                    made[new.prev().place()] = b;
                    made[new.next().place()] = a;
                    made[new.place()] = Self::NONE;
                    made[3] = row;
                }
                let flipped = &star[2 * operation.created..];
                for (&c, &other) in operation.flips.iter().zip(flipped) {
                    // (v, p, q) and (r, q, p) have become (v, p, r) and (v, r, q).
                    let o = other.next();
                    let was = &mut self.corners[o.triangle().index()];
                    let (p, r, row) = (was[o.prev().place()], was[o.place()], was[3]);
                    was[other.place()] = Self::NONE;
                    let made = &mut self.corners[c.triangle().index()];
                    made[c.next().place()] = p;
                    made[c.prev().place()] = r;
                    made[c.place()] = Self::NONE;
                    made[3] = row;
                }
            }
            Site::Face(..) => {
                // (x, y, z) has become (x, y, v), and (y, z, v) and (z, x, v) are new.
                let Some(&old) = star.last() else { return };
                let second = Triangle(table.slots() as u32 - 2).corner(0);
                let third = Triangle(table.slots() as u32 - 1).corner(0);
                let [x, y, z] = [old.next(), old.prev(), old].map(|c| self.of(c));
                self.set([(second, y), (second.next(), z), (third, z), (third.next(), x)]);
                self.set([(second.prev(), Self::NONE), (third.prev(), Self::NONE), (old, Self::NONE)]);
                let row = self.row(old.triangle());
                [second, third].iter().for_each(|c| self.corners[c.triangle().index()][3] = row);
            }
            Site::Attach(..) => {
                let Some(&at) = star.first() else { return };
                // The ear (b, a, v) has the triangle of a→b behind it.
                let behind = table.opposite(at);
                let [a, b] = [behind.next(), behind.prev()].map(|c| self.of(c));
                self.set([(at.next(), b), (at.prev(), a), (at, Self::NONE)]);
                self.corners[at.triangle().index()][3] = self.row(behind.triangle());
            }
        }
    }

    fn set<const N: usize>(&mut self, corners: [(Corner, u32); N]) {
        for (c, wedge) in corners {
            self.corners[c.triangle().index()][c.place()] = wedge;
        }
    }

    /// A corner gets a wedge that there is.
    pub fn assign(&mut self, c: Corner, wedge: u32) {
        self.corners[c.triangle().index()][c.place()] = wedge;
    }

    /// A new wedge, of these corners.
    pub fn append(&mut self, corners: &[Corner]) -> u32 {
        let wedge = self.count;
        for c in corners {
            self.corners[c.triangle().index()][c.place()] = wedge;
        }
        self.count += 1;
        wedge
    }

    /// No wedge is known yet of any corner of a table; those to come are numbered from `first`.
    pub fn open_from(table: &CornerTable, first: u32) -> Self {
        Self { count: first, ..Self::open(table) }
    }

    /// The triangles of a part, whose wedges are numbered behind these, come behind the others.
    pub fn append_part(&mut self, part: &Self) {
        self.corners.extend_from_slice(&part.corners);
        self.count = part.count;
    }

    /// What a triangle names: the wedges of its corners, and its row.
    pub fn triangle(&self, t: Triangle) -> [u32; 4] {
        self.corners.get(t.index()).copied().unwrap_or([Self::NONE; 4])
    }

    /// Has a triangle name what `there` says, and says what it named.
    pub fn swap(&mut self, t: Triangle, there: &mut [u32; 4]) {
        if let Some(corners) = self.corners.get_mut(t.index()) {
            std::mem::swap(corners, there);
        }
    }

    /// Has all triangles name what `there` says, by slot, and says what they named.
    pub fn swap_all(&mut self, there: &mut Vec<[u32; 4]>) {
        std::mem::swap(&mut self.corners, there);
    }

    /// What all triangles name, by slot.
    pub fn all(&self) -> &[[u32; 4]] {
        &self.corners
    }

    /// Takes the triangles from slot `from` on away.
    pub fn cut(&mut self, from: usize) -> Vec<[u32; 4]> {
        self.corners.split_off(from.min(self.corners.len()))
    }

    /// Puts back triangles that have been taken away.
    pub fn put_back(&mut self, tail: &[[u32; 4]]) {
        self.corners.extend_from_slice(tail);
    }

    /// Bytes that the corners of a table take.
    pub fn bytes(table: &CornerTable) -> usize {
        table.slots() * size_of::<[u32; 4]>()
    }
}
